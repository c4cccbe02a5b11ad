!> What every integration method of the library offers: the affine maps of single steps,
!>
!>     x(end of step) = A x(start of step) + b.
module gestell_floquet_method
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  type, abstract, public :: method_type
    !> As a user names it.
    character(len=:), allocatable :: name
    !> The error of Phi(T) falls like steps**(-order).
    integer :: order = 0
    !> Evaluations of the coefficients in a step.
    integer :: stages = 0
  contains
    procedure(step_maps), deferred :: maps
  end type method_type

  abstract interface
    !> Maps of the steps from phase `from(k)` to phase `to(k)`: A, shape (n, n, steps), and if the forced solution
    !> is asked for, b, shape (n, steps). The steps need not follow each other.
    !> Error: the equations of a step are singular.
    subroutine step_maps(self, system, from, to, a, error, b)
      import :: method_type, periodic_system, error_type, dp
      implicit none (type, external)
      class(method_type), intent(in) :: self
      class(periodic_system), intent(in) :: system
      real(dp), intent(in) :: from(:), to(:)
      real(dp), intent(out) :: a(:, :, :)
      type(error_type), allocatable, intent(out) :: error
      real(dp), intent(out), optional :: b(:, :)
    end subroutine step_maps
  end interface

end module gestell_floquet_method
