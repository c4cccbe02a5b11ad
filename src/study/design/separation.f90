!> How far the natural frequencies of a machine lie from the orders of its crank, as branches with derivatives.
!>
!> Between two natural frequencies that meet, the eigenvectors turn by any angle for the smallest change of the machine, so the
!> greater of both has no derivative. It is the greatest of Rayleigh's quotients u' C u / u' M u over the directions u of their
!> plane (R. A. Horn, C. R. Johnson, Matrix Analysis, 1985, section 4.2): directions all around that plane are branches as well.
module gestell_study_design_separation
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: eigensystem, inverse_factor
  use gestell_model_frame, only: frame_type
  use gestell_system_averaged, only: averaged_system
  implicit none (type, external)
  private

  public :: find_branches, take_distances

  !> Directions in which the machine vibrates, shape (degrees of freedom, branches), each beside a harmonic of the period, and the
  !> side on which its frequency is to stay, 1: above, -1: below; shapes (branches).
  type, public :: separation_type
    real(dp), allocatable :: u(:, :)
    integer, allocatable :: harmonic(:), side(:)
  end type separation_type

  !> Orders of the drive that count; directions between two modes; how near squares of frequencies are that may meet.
  integer, parameter :: orders = 4, around = 12
  real(dp), parameter :: near = 0.1_dp

contains

  !> The modes beside every harmonic that the shafts excite, up to four times the drive's speed, over crank `speeds`, the least and
  !> the greatest (rad/s, of the shaft that turns once in the period; 0: the machine's own). A frequency within the range of an
  !> order is to leave it at the nearer end. Error: the mass matrix is not positive definite.
  subroutine find_branches(frame, speeds, branches, error)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: speeds(2)
    type(separation_type), intent(out) :: branches
    type(error_type), allocatable, intent(out) :: error
    type(averaged_system) :: model
    complex(dp), allocatable :: squares(:), right(:, :), left(:, :)
    real(dp), allocatable :: r(:, :), modes(:, :)
    integer, allocatable :: harmonics(:), side(:, :)
    real(dp) :: ends(2), frequency
    integer :: d, h, i, k

    call frame%averaged(model)
    call inverse_factor(model%m, r, error)
    if (allocated(error)) return
    call eigensystem(matmul(r, matmul(model%c + transpose(model%c), transpose(r))) / 2, squares, right, left, error)
    if (allocated(error)) return
    modes = matmul(transpose(r), real(right))
    harmonics = frame%mechanism%harmonics(orders)
    ends = ends_of(frame, speeds)
    allocate(side(size(squares), size(harmonics)))
    allocate(branches%u(size(squares), 0), branches%harmonic(0), branches%side(0))
    do h = 1, size(harmonics)
      do i = 1, size(squares)
        frequency = sign(sqrt(abs(real(squares(i)))), real(squares(i)))
        side(i, h) = merge(1, -1, frequency / (harmonics(h) * ends(2)) - 1 > 1 - frequency / (harmonics(h) * ends(1)))
        call add(modes(:, i), harmonics(h), side(i, h))
      end do
    end do
    do i = 1, size(squares)
      do k = 1, i - 1
        if (abs(squares(i) - squares(k)) > near * max(abs(squares(i)), abs(squares(k)))) cycle
        do h = 1, size(harmonics)
          if (side(i, h) /= side(k, h)) cycle
          do d = 1, around - 1
            call add(cos(pi * d / around) * modes(:, i) + sin(pi * d / around) * modes(:, k), harmonics(h), side(i, h))
          end do
        end do
      end do
    end do

  contains

    subroutine add(u, harmonic, which)
      real(dp), intent(in) :: u(:)
      integer, intent(in) :: harmonic, which

      branches%u = reshape([branches%u, u], [size(u), size(branches%harmonic) + 1])
      branches%harmonic = [branches%harmonic, harmonic]
      branches%side = [branches%side, which]
    end subroutine add

  end subroutine find_branches

  !> The distance of each branch from its order, 100 (f / (k n) - 1) above and 100 (1 - f / (k n)) below it, at the end of the range
  !> that is nearer; negative within the range.
  subroutine take_distances(frame, speeds, branches, distances)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: speeds(2)
    type(separation_type), intent(in) :: branches
    real(dp), allocatable, intent(out) :: distances(:)
    type(averaged_system) :: model
    real(dp) :: ends(2), square
    integer :: b

    call frame%averaged(model)
    ends = ends_of(frame, speeds)
    allocate(distances(size(branches%side)))
    do b = 1, size(distances)
      associate (u => branches%u(:, b), side => branches%side(b))
        square = dot_product(u, matmul(model%c, u)) / dot_product(u, matmul(model%m, u))
        distances(b) = 100 * side * (sign(sqrt(abs(square)), square) / (branches%harmonic(b) * ends(merge(2, 1, side > 0))) - 1)
      end associate
    end do
  end subroutine take_distances

  pure function ends_of(frame, speeds) result(ends)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: speeds(2)
    real(dp) :: ends(2)

    ends = speeds
    if (.not. speeds(2) > 0) ends = abs(frame%speed)
  end function ends_of

end module gestell_study_design_separation
