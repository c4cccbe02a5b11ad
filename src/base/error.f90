!> Defines the error type. The library's procedures return an error in their last, allocatable argument.
module gestell_base_error
  use gestell_base_words, only: put_on_one_line
  implicit none (type, external)
  private

  public :: error_type, fatal_error

  !> Describes why a procedure failed. An unallocated error means success.
  type :: error_type
    !> Message for the user: one line of limited length, without a full stop at its end
    character(len=:), allocatable :: message
    !> Code of the failure (`wrong_usage`, `invalid_input`, ...); the program uses it as its exit code
    integer :: code = 0
    !> Cause of the failure, if a calling program may need to test it: `resonance` or `no_convergence`. 0 for any other cause
    integer :: cause = 0
    !> Part of the machine that caused the failure, such as "joint 'B'"; unallocated if no single part caused it
    character(len=:), allocatable :: subject
    !> True if the failure is that a file could not be written
    logical :: write_failed = .false.
  end type error_type

  !> Values of `code`
  integer, parameter, public :: wrong_usage = 1, invalid_input = 2, impossible_mechanism = 3, failed_computation = 4

  !> Values of the component `cause`. `resonance`: a natural frequency without damping is excited, so that no periodic vibration
  !> exists. `no_convergence`: an iteration does not converge.
  integer, parameter, public :: resonance = 1, no_convergence = 2

contains

  !> Allocates `error` and sets its message, code and subject.
  pure subroutine fatal_error(error, message, code, subject)
    type(error_type), allocatable, intent(out) :: error
    !> Message of any length; it is shortened and put on one line
    character(len=*), intent(in) :: message
    !> `wrong_usage`, `invalid_input`, `impossible_mechanism` or `failed_computation`
    integer, intent(in) :: code
    !> Part of the machine that caused the failure, such as "joint 'B'"
    character(len=*), intent(in), optional :: subject

    allocate(error)
    call put_on_one_line(message, error%message)
    error%code = code
    if (present(subject)) error%subject = subject
  end subroutine fatal_error

end module gestell_base_error
