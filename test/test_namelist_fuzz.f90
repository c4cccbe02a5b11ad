!> Truncated, changed and random input is accepted, or refused with a proper message, never worse.
module test_namelist_fuzz
  use checks, only: check_that
  use testdrive, only: new_unittest, unittest_type, check, test_error => error_type
  use gestell_base_error, only: error_type, invalid_input
  use gestell_input_schema_check, only: check_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema_path, only: set_value
  use gestell_task_registry, only: input_schema
  use namelist_helpers, only: read_checked, nl, file
  implicit none (type, external)
  private

  public :: collect_namelist_fuzz

  !> A valid small input of eight lines.
  character(len=*), parameter :: valid = &
    "&case title = 'Four-bar', tasks = 'stability', 'response' /" // nl // &
    "&drive speed_rpm = 240.0 /   ! negative: clockwise" // nl // &
    "&joint name='A0', type='ground', position=0.0, 0.0 /" // nl // &
    "&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /" // nl // &
    "&link name='crank', from='A0', to='A', mass=0.50, inertia=0.0035, center=0.03,0.0 /" // nl // &
    "&frame mass=18.0, inertia=0.78, origin=-0.20,0.20 /" // nl // &
    "&support position=-0.30,-0.20, stiffness=2*196133.0 / &support position=2*0.5 /" // nl // &
    "&foundation damping=0.5,0.5,0.05 /" // nl

contains

  subroutine collect_namelist_fuzz(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      new_unittest("every truncated input is accepted or refused with a proper message", test_truncated), &
      new_unittest("changed and random input is accepted or refused with a proper message", test_fuzz)]
  end subroutine collect_namelist_fuzz

  !> Each beginning of a valid input is either accepted or refused with a proper message.
  subroutine test_truncated(error)
    type(test_error), allocatable, intent(out) :: error
    integer :: i

    do i = 0, len(valid)
      call judge(error, valid(:i))
      if (allocated(error)) return
    end do
  end subroutine test_truncated

  subroutine test_fuzz(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=*), parameter :: alphabet = "&/=,()'""!* " // nl // achar(13) // achar(9) // "$;:.+-0123eEdDnanmsx" &
      // "stiffness" // char(195) // char(164) // achar(0)
    character(len=:), allocatable :: text
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    integer :: state, i, k, at, length

    state = 12345
    do i = 1, 3000
      text = valid
      do k = 1, 1 + draw(state, 4)
        at = 1 + draw(state, len(text))
        length = min(draw(state, 12), len(text) - at + 1)
        select case (draw(state, 4))
        case (0)
          text = text(:at-1) // text(at+length:)
        case (1)
          text = text(:at-1) // text(at:at+length-1) // text(at:)
        case (2)
          text = text(:at-1) // letter(state, alphabet) // text(at:)
        case default
          text = text(:at-1) // letter(state, alphabet) // text(at+1:)
        end select
        if (len(text) == 0) text = " "
      end do
      call judge(error, text)
      if (allocated(error)) return
    end do
    do i = 1, 2000
      text = "&frame "
      do k = 1, draw(state, 60)
        text = text // letter(state, alphabet)
      end do
      call judge(error, text)
      if (allocated(error)) return
    end do
    do i = 1, 200
      text = ""
      do k = 1, 1 + draw(state, 100)
        text = text // char(draw(state, 256))
      end do
      call judge(error, text)
      if (allocated(error)) return
    end do

    do i = 1, 3000
      text = "support(2).stiffness(1)=1,joint(B).name=.()="
      do k = 1, 1 + draw(state, 4)
        at = 1 + draw(state, len(text))
        length = draw(state, 20)
        text = text(:at-1) // letter(state, alphabet // "bjointBframemassA") // text(min(at+length, len(text)):)
      end do
      call read_checked(valid, doc, failure)
      call set_value(doc, input_schema(), text, failure)
      if (.not. allocated(failure)) call check_document(doc, input_schema(), failure)
      if (.not. allocated(failure)) cycle
      call check_that(error, index(failure%message, "--set "), "==", 1, failure%message)
      call check_that(error, scan(failure%message, nl // achar(0)), "==", 0, failure%message)
      if (allocated(error)) return
    end do
  end subroutine test_fuzz

  !> Reads any text: it must pass, or have a message of one line, with the code of input errors and a line of the text.
  subroutine judge(error, text)
    type(test_error), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: text
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    integer :: lines, line, i, status

    call read_checked(text, doc, failure)
    if (.not. allocated(failure)) return
    lines = 1
    do i = 1, len(text)
      if (text(i:i) == nl) lines = lines + 1
    end do
    call check(error, failure%code, invalid_input)
    if (allocated(error)) return
    call check_that(error, scan(failure%message, nl // achar(13) // achar(0)), "==", 0, text)
    call check_that(error, len(failure%message), "<", 500, text)
    if (allocated(error)) return
    if (index(failure%message, file // ": ") == 1) return
    call check(error, index(failure%message, file // ":"), 1, failure%message)
    if (allocated(error)) return
    i = len(file) + 2
    read(failure%message(i:i+index(failure%message(i:), ":")-2), *, iostat=status) line
    call check_that(error, status, "==", 0, failure%message)
    call check_that(error, line, ">=", 1, failure%message)
    call check_that(error, line, "<=", lines, failure%message)
  end subroutine judge

  !> A number from 0 to n-1.
  integer function draw(state, n)
    integer, intent(inout) :: state
    integer, intent(in) :: n

    state = mod(state * 1103 + 12347, 1000003)
    draw = mod(state, n)
  end function draw

  character(len=1) function letter(state, alphabet)
    integer, intent(inout) :: state
    character(len=*), intent(in) :: alphabet
    integer :: i

    i = 1 + draw(state, len(alphabet))
    letter = alphabet(i:i)
  end function letter

end module test_namelist_fuzz
