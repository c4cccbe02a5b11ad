!> Defines the error that a procedure of the library returns in its last, allocatable argument.
module gestell_base_error
  use gestell_base_words, only: put_on_one_line
  implicit none (type, external)
  private

  public :: error_type, fatal_error

  !> Describes a failure; an unallocated error means success.
  type :: error_type
    !> One line for the user, of bounded length and without a final full stop
    character(len=:), allocatable :: message
    !> Kind of the failure (`wrong_usage`, `invalid_input`, ...); also the exit code of the program
    integer :: code = 0
    !> Cause that a calling program may need to test: `resonance`, `no_convergence`, or 0 for any other cause
    integer :: cause = 0
    !> Name of the machine's part that is at fault, such as "joint 'B'"; unallocated if it is no single part
    character(len=:), allocatable :: subject
    !> True if a file could not be written
    logical :: write_failed = .false.
  end type error_type

  !> Values of `code`
  integer, parameter, public :: wrong_usage = 1
  integer, parameter, public :: invalid_input = 2
  integer, parameter, public :: impossible_mechanism = 3
  integer, parameter, public :: failed_computation = 4

  !> Values of `cause`. `resonance`: an undamped natural frequency is excited, so that no periodic vibration exists.
  !> `no_convergence`: an iteration does not converge.
  integer, parameter, public :: resonance = 1, no_convergence = 2

contains

  !> Allocates `error` and sets its message, code and subject.
  pure subroutine fatal_error(error, message, code, subject)
    type(error_type), allocatable, intent(out) :: error
    !> Any text; it is shortened and put on one line
    character(len=*), intent(in) :: message
    !> `wrong_usage`, `invalid_input`, `impossible_mechanism` or `failed_computation`
    integer, intent(in) :: code
    !> Part of the machine that is at fault, such as "joint 'B'"
    character(len=*), intent(in), optional :: subject

    allocate(error)
    call put_on_one_line(message, error%message)
    error%code = code
    if (present(subject)) error%subject = subject
  end subroutine fatal_error

end module gestell_base_error
