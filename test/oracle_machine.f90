!> Input of the oracle of the exact frame: a machine of the reference, gears, a probe; and the kind of its real numbers.
module oracle_machine
  use reference_machine, only: dp, machine_data
  implicit none (type, external)
  private

  public :: dot, dp, solved

  !> Extended precision (64 bits of mantissa on x86, 2048 times finer than double); quadruple precision where it is not
  !> available.
  integer, parameter, public :: xp = selected_real_kind(18)
  real(xp), parameter, public :: pi = 3.14159265358979323846264338327950288419716939937510_xp
  complex(xp), parameter, public :: i = (0.0_xp, 1.0_xp)

  type, extends(machine_data), public :: exact_machine
    !> Turns of the drive in a period; turns of crank j in it, negative against the drive. 0: joint j is no crank.
    integer :: turns = 1
    integer, allocatable :: turns_of(:)
    !> Directions of the joints' phase, guide, second guide, slot, shape (4, joints), from their angles (oracle_kinematics).
    complex(xp), allocatable :: directions(:, :)
    !> Instead of `gravity`: acceleration (m/s^2) and direction (deg), as in the input.
    real(dp) :: acceleration = 0, direction_deg = -90
    !> Position of the probe (m, from F) and its band of frequencies (Hz).
    real(dp) :: probe(2) = 0, band(2) = [10.0_dp, 1000.0_dp]
  end type exact_machine

  !> solved(matrix, right): a vector or columns.
  interface solved
    module procedure solve_one
    module procedure solve_several
  end interface solved

contains

  !> a . b.
  elemental real(xp) function dot(a, b)
    complex(xp), intent(in) :: a, b

    dot = real(a) * real(b) + aimag(a) * aimag(b)
  end function dot

  !> The x of matrix x = right, by Gaussian elimination with row exchanges.
  pure function solve_one(matrix, right) result(x)
    real(xp), intent(in) :: matrix(:, :), right(:)
    real(xp) :: x(size(right))
    real(xp) :: columns(size(right), 1)

    columns(:, 1) = right
    columns = solve_several(matrix, columns)
    x = columns(:, 1)
  end function solve_one

  !> Solves the equations for several right-hand sides, given as columns.
  pure function solve_several(matrix, right) result(x)
    real(xp), intent(in) :: matrix(:, :), right(:, :)
    real(xp) :: x(size(right, 1), size(right, 2))
    real(xp) :: u(size(right, 1), size(right, 1)), row(size(right, 1)), row_x(size(right, 2)), factor
    integer :: j, k, n, top

    n = size(right, 1)
    u = matrix
    x = right
    do k = 1, n
      top = k - 1 + maxloc(abs(u(k:, k)), dim=1)
      row(k:) = u(top, k:)
      row_x = x(top, :)
      u(top, k:) = u(k, k:)
      x(top, :) = x(k, :)
      u(k, k:) = row(k:)
      x(k, :) = row_x
      do j = k + 1, n
        factor = u(j, k) / u(k, k)
        u(j, k + 1:) = u(j, k + 1:) - factor * u(k, k + 1:)
        x(j, :) = x(j, :) - factor * x(k, :)
      end do
    end do
    do k = n, 1, -1
      x(k, :) = x(k, :) / u(k, k)
      do j = 1, k - 1
        x(j, :) = x(j, :) - u(j, k) * x(k, :)
      end do
    end do
  end function solve_several

end module oracle_machine
