!> Corrects an approximate periodic motion of M q'' + B q' + C q = h. The error of the motion solves a system with the same M, B, C
!> and the load
!>
!>     h - M q'' - B q' - C q,
!>
!> where q is the approximate motion. A solution of this system with few correct digits improves the motion by as many digits.
module gestell_system_corrected
  use gestell_base_kinds, only: dp, pi
  use gestell_math_series_trigonometric, only: series_type
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: corrected_system

  type, extends(second_order_system), public :: corrected_system_type
    private
    !> The system whose motion is corrected
    class(second_order_system), pointer :: inner => null()
    !> Approximate motion as a set of functions of theta = 2 pi t/T
    type(series_type) :: motion
    !> For each degree of freedom of `inner`, the index of its function in `motion`
    integer, allocatable :: free(:)
  contains
    procedure :: matrices, sample_second_order
  end type corrected_system_type

contains

  !> Returns the system that the error of `motion` solves. The functions of `motion` with the indices `free` are the degrees of
  !> freedom of `inner`. The result points to `inner`.
  type(corrected_system_type) function corrected_system(inner, motion, free) result(corrected)
    class(second_order_system), intent(in), target :: inner
    type(series_type), intent(in) :: motion
    integer, intent(in) :: free(:)

    corrected%states = inner%states
    call corrected%inherit(inner)
    corrected%inner => inner
    corrected%motion = motion
    corrected%free = free
  end function corrected_system

  !> Computes M, B, C of the system whose motion is corrected.
  subroutine matrices(self, t, m, b, c)
    class(corrected_system_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    call self%inner%matrices(t, m, b, c)
  end subroutine matrices

  !> Samples M, B, C of the inner system, and the residual load: the load of the inner system minus the forces that the approximate
  !> motion requires.
  subroutine sample_second_order(self, phases, m, b, c, h)
    class(corrected_system_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    real(dp), dimension(size(phases), size(self%motion%cosine, 2)) :: q, v, a
    integer :: j, k

    call self%inner%sample_second_order(phases, m, b, c, h)
    if (.not. present(h)) return
    call self%motion%values(phases, q, v, a)
    v = v * (2 * pi / self%period)
    a = a * (2 * pi / self%period)**2
    do k = 1, size(self%free)
      do j = 1, size(self%free)
        h(:, j) = h(:, j) - (m(:, j, k) * a(:, self%free(k)) + b(:, j, k) * v(:, self%free(k)) + c(:, j, k) * q(:, self%free(k)))
      end do
    end do
  end subroutine sample_second_order

end module gestell_system_corrected
