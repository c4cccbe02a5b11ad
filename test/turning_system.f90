!> A system of six states whose Floquet solution is known: x = S(t) y with a product S of plane rotations by angles that
!> swing, and y' = D(t) y with two by two blocks that commute with their own integral.
module turning_system
  use gestell_base_kinds, only: dp, pi
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  integer, parameter :: n = 6, planes(2, 4) = reshape([1, 3, 2, 5, 4, 6, 1, 6], [2, 4])
  real(dp), parameter :: phases(4) = [0.0_dp, 1.0_dp, 2.5_dp, 4.0_dp]

  !> Period 2 pi. Block b has the eigenvalues rate +- i frequency (1 + 0.3 cos t), or for a real one rate (1 + 0.2 cos t)
  !> and half of it. The periodic motion is v cos t + w sin 2 t.
  type, extends(periodic_system), public :: turning_type
    real(dp) :: rate(3) = 0, frequency(3) = 0
    logical :: real_block(3) = .false.
    !> Largest angle of the rotations.
    real(dp) :: swing = 0.3_dp
  contains
    procedure :: matrix
    procedure :: forcing
    procedure :: motion
    procedure :: logarithms
  end type turning_type

contains

  subroutine matrix(self, t, p)
    class(turning_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp) :: s(n, n), slope(n, n), turn(n, n), turn_slope(n, n), d(n, n), w
    integer :: k, b

    s = unit_matrix()
    slope = 0
    do k = 1, size(phases)
      call rotation(planes(:, k), self%swing * sin(t + phases(k)), self%swing * cos(t + phases(k)), turn, turn_slope)
      slope = matmul(slope, turn) + matmul(s, turn_slope)
      s = matmul(s, turn)
    end do
    d = 0
    do b = 1, 3
      if (self%real_block(b)) then
        d(2 * b - 1, 2 * b - 1) = self%rate(b) * (1 + 0.2_dp * cos(t))
        d(2 * b, 2 * b) = d(2 * b - 1, 2 * b - 1) / 2
      else
        w = self%frequency(b) * (1 + 0.3_dp * cos(t))
        d(2 * b - 1, 2 * b - 1) = self%rate(b)
        d(2 * b, 2 * b) = self%rate(b)
        d(2 * b - 1, 2 * b) = w
        d(2 * b, 2 * b - 1) = -w
      end if
    end do
    p = matmul(slope, transpose(s)) + matmul(s, matmul(d, transpose(s)))
  end subroutine matrix

  subroutine forcing(self, t, f)
    class(turning_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)
    real(dp) :: p(n, n)

    call self%matrix(t, p)
    f = shape_1() * (-sin(t)) + shape_2() * 2 * cos(2 * t) - matmul(p, self%motion(t))
  end subroutine forcing

  !> The periodic motion.
  pure function motion(self, t) result(x)
    class(turning_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp) :: x(n)

    x = shape_1() * cos(t) + shape_2() * sin(2 * t) + 0 * self%swing
  end function motion

  pure function shape_1() result(v)
    real(dp) :: v(n)

    v = [1.0_dp, -0.5_dp, 0.3_dp, 0.0_dp, 2.0_dp, -1.0_dp]
  end function shape_1

  pure function shape_2() result(w)
    real(dp) :: w(n)

    w = [0.2_dp, 0.4_dp, -1.0_dp, 0.7_dp, 0.0_dp, 0.5_dp]
  end function shape_2

  !> ln rho of all six multipliers, imaginary parts not reduced.
  pure function logarithms(self) result(z)
    class(turning_type), intent(in) :: self
    complex(dp) :: z(n)
    integer :: b

    do b = 1, 3
      if (self%real_block(b)) then
        z(2 * b - 1:2 * b) = 2 * pi * self%rate(b) * [1.0_dp, 0.5_dp]
      else
        z(2 * b - 1) = 2 * pi * cmplx(self%rate(b), self%frequency(b), dp)
        z(2 * b) = conjg(z(2 * b - 1))
      end if
    end do
  end function logarithms

  pure subroutine rotation(plane, angle, slope, turn, turn_slope)
    integer, intent(in) :: plane(2)
    real(dp), intent(in) :: angle, slope
    real(dp), intent(out) :: turn(n, n), turn_slope(n, n)

    turn = unit_matrix()
    turn(plane, plane) = reshape([cos(angle), sin(angle), -sin(angle), cos(angle)], [2, 2])
    turn_slope = 0
    turn_slope(plane, plane) = slope * reshape([-sin(angle), cos(angle), -cos(angle), -sin(angle)], [2, 2])
  end subroutine rotation

  pure function unit_matrix() result(e)
    real(dp) :: e(n, n)
    integer :: i

    e = 0
    do i = 1, n
      e(i, i) = 1
    end do
  end function unit_matrix

end module turning_system
