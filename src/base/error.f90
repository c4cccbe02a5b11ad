!> The one way in which the library reports a failure: the last, allocatable argument of a procedure.
module gestell_base_error
  use gestell_base_words, only: put_on_one_line
  implicit none (type, external)
  private

  public :: error_type, fatal_error

  !> What went wrong: unallocated where all is well.
  type :: error_type
    !> One line for the user, of bounded length and without a final full stop.
    character(len=:), allocatable :: message
    !> Kind of the failure; the driver's exit code.
    integer :: code = 0
    !> What programs have to tell from other failures; 0: nothing of that.
    integer :: cause = 0
    !> What the message is about, as "joint 'B'", where that is one part of the machine.
    character(len=:), allocatable :: subject
    !> Whether it is that a file cannot be written.
    logical :: unwritten = .false.
  end type error_type

  integer, parameter, public :: wrong_usage = 1
  integer, parameter, public :: invalid_input = 2
  integer, parameter, public :: impossible_mechanism = 3
  integer, parameter, public :: failed_computation = 4

  !> What a failure can come from: a free vibration that nothing damps meets the excitation, so that there is no periodic one; an
  !> iteration goes astray.
  integer, parameter, public :: resonance = 1, no_convergence = 2

contains

  !> Raises `error` with a message, one of the codes above and the part that it is about.
  pure subroutine fatal_error(error, message, code, subject)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), intent(in) :: message
    integer, intent(in) :: code
    character(len=*), intent(in), optional :: subject

    allocate(error)
    call put_on_one_line(message, error%message)
    error%code = code
    if (present(subject)) error%subject = subject
  end subroutine fatal_error

end module gestell_base_error
