!> Helpers that the tests of the input reader share.
module namelist_helpers
  use checks, only: check_failure, check_that
  use testdrive, only: check, test_failed, test_error => error_type
  use gestell_base_error, only: error_type
  use gestell_base_key, only: key_type, range_type, real_key
  use gestell_base_kinds, only: dp
  use gestell_input_schema_check, only: check_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_namelist, only: parse_document
  use gestell_task_registry, only: input_schema
  implicit none (type, external)
  private

  public :: read_checked, refused, check_message, check_passed, key

  character(len=*), parameter, public :: nl = new_line("a")

  character(len=*), parameter, public :: file = "in.nml"

  character(len=*), parameter, public :: one_joint = "&joint name='O' type='ground'/"

  !> A joint and a drive: together with a frame, the minimum input.
  character(len=*), parameter, public :: rest = one_joint // "&drive speed_rpm=1/"

contains

  !> Reads a text and checks it against the schema.
  subroutine read_checked(text, doc, failure)
    character(len=*), intent(in) :: text
    type(document_type), intent(out) :: doc
    type(error_type), allocatable, intent(out) :: failure

    call parse_document(text, file, doc, failure)
    if (.not. allocated(failure)) call check_document(doc, input_schema(), failure)
  end subroutine read_checked

  !> The record of a key with the properties that a test needs, in a table of its own.
  pure function key(name, rank, range, default, words)
    character(len=*), intent(in) :: name
    integer, intent(in), optional :: rank
    type(range_type), intent(in), optional :: range
    real(dp), intent(in), optional :: default
    character(len=*), intent(in), optional :: words
    type(key_type) :: key(1)

    key = key_type("", name, real_key)
    if (present(rank)) key%rank = rank
    if (present(range)) key%range = range
    if (present(default)) key%default = default
    if (present(words)) key%words = words
  end function key

  !> Checks that a text is refused with this message, or, given `part`, with one that contains it.
  subroutine refused(error, text, message, part)
    type(test_error), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: text, message
    character(len=*), intent(in), optional :: part
    type(document_type) :: doc
    type(error_type), allocatable :: failure

    if (allocated(error)) return
    call read_checked(text, doc, failure)
    if (present(part)) then
      call check_failure(error, failure)
      if (allocated(error)) return
      call check_that(error, failure%message, "contains", part)
    else
      call check_message(error, failure, message)
    end if
  end subroutine refused

  subroutine check_message(error, failure, message)
    type(test_error), allocatable, intent(inout) :: error
    type(error_type), allocatable, intent(inout) :: failure
    character(len=*), intent(in) :: message

    if (allocated(error)) return
    if (allocated(failure)) then
      call check(error, failure%message, message)
    else
      call test_failed(error, "no error where this was expected: " // message)
    end if
    ! a reader that finds an error returns no values
    if (allocated(failure)) deallocate(failure)
  end subroutine check_message

  subroutine check_passed(error, failure)
    type(test_error), allocatable, intent(inout) :: error
    type(error_type), allocatable, intent(in) :: failure

    if (allocated(error)) return
    if (allocated(failure)) call test_failed(error, "unexpected error: " // failure%message)
  end subroutine check_passed

end module namelist_helpers
