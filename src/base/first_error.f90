!> The error of a loop whose passes run side by side: that of the first pass, by number, that fails, whichever ends first.
module gestell_base_first_error
  use gestell_base_error, only: error_type
  implicit none (type, external)
  private

  !> The errors of all passes are to be given to `take`, then `error` is the one that a loop of one thread would have met.
  type, public :: first_error_type
    type(error_type), allocatable :: error
    !> Number of the pass with this error
    integer, private :: pass = huge(1)
  contains
    procedure :: take
  end type first_error_type

contains

  !> Takes the error of a pass, if it is allocated.
  subroutine take(self, pass, error)
    class(first_error_type), intent(inout) :: self
    integer, intent(in) :: pass
    type(error_type), allocatable, intent(inout) :: error

    if (.not. allocated(error)) return
    !$omp critical (first_error)
    if (pass < self%pass) then
      self%pass = pass
      call move_alloc(error, self%error)
    end if
    !$omp end critical (first_error)
  end subroutine take

end module gestell_base_first_error
