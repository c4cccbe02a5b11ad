!> Reading namelist files: valid input.
module test_namelist
  use checks, only: check_that
  use slow_tests, only: new_slow
  use testdrive, only: new_unittest, unittest_type, check, test_error => error_type
  use gestell_base_error, only: error_type
  use gestell_base_key, only: positive, nonnegative, nonzero
  use gestell_base_kinds, only: dp
  use gestell_input_schema_read, only: count_values, read
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: document_type, group_type, group_named, groups_named, group_names, has
  use gestell_input_namelist, only: read_document
  use namelist_helpers, only: key, read_checked, refused, check_message, check_passed, nl, file, rest, one_joint
  implicit none (type, external)
  private

  public :: collect_namelist

  !> A complete small input of eight lines.
  character(len=*), parameter :: complete = &
    "&case title = 'Four-bar', tasks = 'stability', 'response' /" // nl // &
    "&drive speed_rpm = 240.0 /   ! negative: clockwise" // nl // &
    "&joint name='A0', type='ground', position=0.0, 0.0 /" // nl // &
    "&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /" // nl // &
    "&link name='crank', from='A0', to='A', mass=0.50, inertia=0.0035, center=0.03,0.0 /" // nl // &
    "&frame mass=18.0, inertia=0.78, origin=-0.20,0.20 /" // nl // &
    "&support position=-0.30,-0.20, stiffness=2*196133.0 / &support position=2*0.5 /" // nl // &
    "&foundation damping=0.5,0.5,0.05 /" // nl

contains

  subroutine collect_namelist(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      new_unittest("all values of a complete input are read", test_values), &
      new_unittest("all permitted notations yield the same values", test_writing), &
      new_unittest("all permitted notations of numbers are read correctly", test_numbers), &
      new_unittest("subscripts and matrices assign the right elements", test_subscripts), &
      new_unittest("missing files, directories and empty files are errors", test_files), &
      new_slow("reading time is proportional to the length of the text", test_long)]
  end subroutine collect_namelist

  subroutine test_values(error)
    type(test_error), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    type(group_type), allocatable :: joints(:)
    character(len=:), allocatable :: text
    character(len=word_length), allocatable :: texts(:)
    real(dp) :: x, pair(2)
    integer :: branch

    call read_checked(complete, doc, failure)
    call check_passed(error, failure)
    if (allocated(error)) return
    call read(group_named(doc, "drive"), key("speed_rpm", range=nonzero), "speed_rpm", x, failure)
    call check(error, x, 240.0_dp)
    if (allocated(error)) return
    call read(group_named(doc, "case"), key("title"), "title", text, failure)
    call check(error, text, "Four-bar")
    if (allocated(error)) return
    call read(group_named(doc, "case"), key("tasks"), "tasks", texts, failure)
    call check_that(error, size(texts), "==", 2, "texts")
    call check_that(error, texts(1), "==", "stability", "first text")
    call check_that(error, texts(2), "==", "response", "second text")
    if (allocated(error)) return
    joints = groups_named(doc, "joint")
    call check(error, size(joints), 2)
    if (allocated(error)) return
    associate (names => group_names(joints))
      call check_that(error, names(1), "==", "A0", "first name")
      call check_that(error, names(2), "==", "B", "second name")
    end associate
    if (allocated(error)) return
    call check(error, joints(2)%line, 4)
    if (allocated(error)) return
    call read(joints(2), key("lengths", rank=1, range=positive), "lengths", pair, failure)
    call check_that(error, abs(pair - [0.37_dp, 0.16_dp]), "<=", 0.0_dp, "lengths")
    if (allocated(error)) return
    call read(joints(2), key("branch"), "branch", branch, failure)
    call check(error, branch, 1)
    if (allocated(error)) return
    call check_that(error, [has(joints(1), "position"), has(joints(2), "position")], "==", [.true., .false.], "positions")
    call check_that(error, count_values(joints(2), "ends"), "==", 2, "ends of B")
    call check_that(error, count_values(joints(1), "ends"), "==", 0, "ends of A0")
    if (allocated(error)) return
    ! defaults, of a group that the file has and of one that it has not
    call read(joints(2), key("offset", rank=1, default=-1.0_dp), "offset", pair, failure)
    call check_that(error, abs(pair + 1), "<=", 0.0_dp, "position")
    if (allocated(error)) return
    call read(group_named(doc, "accuracy"), key("method"), "method", text, failure, default="auto")
    call check(error, text, "auto")
    if (allocated(error)) return
    call read(group_named(doc, "response"), key("points", default=360.0_dp), "points", branch, failure)
    call check(error, branch, 360)
  end subroutine test_values

  !> Texts that must all give speed_rpm = 240 and title = it's.
  subroutine test_writing(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=*), parameter :: tab = achar(9), crlf = achar(13) // achar(10)

    call same(error, "&drive speed_rpm=240/&case title='it''s'/")
    call same(error, "&DRIVE SPEED_RPM=2.4E2 /" // nl // "&Case Title=""it's"" /")
    call same(error, char(239) // char(187) // char(191) // "&drive speed_rpm=240 / &case title='it''s' /")
    call same(error, "&drive" // crlf // "speed_rpm=240" // crlf // "/" // crlf // "&case title='it''s'" // crlf // "/")
    call same(error, tab // "&drive" // tab // "speed_rpm" // tab // "=" // tab // "240" // tab &
      // "/&case title='it''s'/")
    call same(error, "&drive speed_rpm ! a comment / & ' ""=" // nl // "= ! another" // nl // "240,/!" // nl &
      // "&case title='it''s', tasks='a!/&=' 'b'/ ! end")
    call same(error, "&case tasks='a' ," // nl // nl // "'b'  title='it''s' /" // nl // "&drive speed_rpm=1*240 /")
    call same(error, "&case tasks=2*'a' title=1*""it's"" / &drive speed_rpm=+240.d0 /" // nl // nl)
    call same(error, "! first" // nl // "&drive" // nl // "  speed_rpm = 24000d-2," // nl // "/" // nl &
      // "&case title = 'it''s'," // nl // " tasks(2) = 'b', tasks(1)='a' /")
  end subroutine test_writing

  subroutine same(error, text)
    type(test_error), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: text
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: title
    real(dp) :: speed

    if (allocated(error)) return
    call read_checked(text // nl // "&frame/" // one_joint, doc, failure)
    call check_passed(error, failure)
    if (allocated(error)) return
    call read(group_named(doc, "drive"), key("speed_rpm"), "speed_rpm", speed, failure)
    call read(group_named(doc, "case"), key("title"), "title", title, failure)
    call check_that(error, abs(speed - 240), "<=", 0.0_dp, "wrong values from " // text)
    call check_that(error, title, "==", "it's", "wrong values from " // text)
  end subroutine same

  subroutine test_numbers(error)
    type(test_error), allocatable, intent(out) :: error

    call number(error, "1.5", 1.5_dp)
    call number(error, ".5", 0.5_dp)
    call number(error, "5.", 5.0_dp)
    call number(error, "-1e3", -1000.0_dp)
    call number(error, "+1.0D+3", 1000.0_dp)
    call number(error, "1d-3", 1.0e-3_dp)
    call number(error, "0012", 12.0_dp)
    call number(error, "0e99999999999", 0.0_dp)
    call number(error, "1e-999999999999", 0.0_dp)
    call number(error, "9.99e307", 9.99e307_dp)
    call number(error, "0.00000999e312", 9.99e306_dp)
    call number(error, repeat("0", 500) // "1" // repeat("0", 300) // "e-300", 1.0_dp)
    call number(error, "4.9406564584124654e-324", tiny(1.0_dp) * epsilon(1.0_dp))
  end subroutine test_numbers

  subroutine number(error, text, expected)
    type(test_error), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: text
    real(dp), intent(in) :: expected
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    real(dp) :: x

    if (allocated(error)) return
    call read_checked("&frame mass=" // text // "/" // rest, doc, failure)
    call check_passed(error, failure)
    if (allocated(error)) return
    call read(group_named(doc, "frame"), key("mass"), "mass", x, failure)
    call check_that(error, abs(x - expected), "<=", 0.0_dp, "wrong number from " // text)
  end subroutine number

  subroutine test_subscripts(error)
    type(test_error), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    real(dp) :: matrix(3, 3), pair(2)

    call read_checked("&frame/ &foundation stiffness = 1 2 3, 4 5 6, 2*7 9 / " &
      // "&support stiffness(2)=5, stiffness (1) = 4/" // nl // "&support damping(2)=3/" // rest, doc, failure)
    call check_passed(error, failure)
    if (allocated(error)) return
    call read(group_named(doc, "foundation"), key("stiffness", rank=2, default=0.0_dp), "stiffness", matrix, failure)
    call check_that(error, nint([matrix(3, 1), matrix(1, 2), matrix(2, 3)]), "==", [3, 4, 7], "elements")
    if (allocated(error)) return
    associate (supports => groups_named(doc, "support"))
      call read(supports(1), key("stiffness", rank=1), "stiffness", pair, failure)
      call check_that(error, nint(pair), "==", [4, 5], "first pair")
      if (.not. allocated(error)) then
        call read(supports(2), key("damping", rank=1, default=0.0_dp), "damping", pair, failure)
        call check_that(error, nint(pair), "==", [0, 3], "second pair")
      end if
      if (.not. allocated(error)) then
        call read(supports(2), key("damping", rank=1), "damping", pair, failure)
        call check_message(error, failure, "in.nml:2: &support 2: damping(1): must be given")
      end if
    end associate
    if (allocated(error)) return

    call read_checked("&frame/ &foundation stiffness(1,3) = -2.5 /" // rest, doc, failure)
    call read(group_named(doc, "foundation"), key("stiffness", rank=2, default=0.0_dp), "stiffness", matrix, failure)
    call check_that(error, abs(matrix(1, 3) + 2.5_dp), "<=", 0.0_dp, "(1, 3)")
    call check_that(error, count(abs(matrix) > 0), "==", 1, "elements")
    if (allocated(error)) return
    call read(group_named(doc, "foundation"), key("stiffness", rank=2, default=0.0_dp, range=nonnegative), &
      & "stiffness", matrix, failure)
    call check_message(error, failure, "in.nml:1: &foundation: stiffness(1,3) = -2.5: must not be negative")
  end subroutine test_subscripts

  subroutine test_files(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=*), parameter :: name = "test_namelist.tmp"
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    integer :: unit

    call read_document("no such file.nml", doc, failure)
    call check_message(error, failure, "no such file.nml: there is no such file")
    call read_document("", doc, failure)
    call check_message(error, failure, ": there is no such file")
    call read_document(".", doc, failure)
    call check_message(error, failure, ".: is a directory, not a file")
    if (allocated(error)) return

    ! no end of the last line, ends of lines of two characters
    open(newunit=unit, file=name, access="stream", form="unformatted", status="replace", action="write")
    write(unit) "&drive" // achar(13) // nl // "speed_rpm = " // repeat(" ", 10000) // "240 /" // achar(13) // nl &
      // "&frame /"
    close(unit)
    call read_document(name, doc, failure)
    call remove(name)
    call check_passed(error, failure)
    if (allocated(error)) return
    call check_that(error, size(doc%groups), "==", 2, "groups")
    call check_that(error, doc%groups(2)%line, "==", 3, "line of the second")
    if (allocated(error)) return

    open(newunit=unit, file=name, access="stream", form="unformatted", status="replace", action="write")
    close(unit)
    call read_document(name, doc, failure)
    call remove(name)
    call check_message(error, failure, name // ": the file is empty")
  end subroutine test_files

  subroutine remove(name)
    character(len=*), intent(in) :: name
    integer :: unit

    open(newunit=unit, file=name, status="old")
    close(unit, status="delete")
  end subroutine remove

  !> A million characters of any kind must be checked. If the work grew with the square this test would take hours.
  subroutine test_long(error)
    type(test_error), allocatable, intent(out) :: error
    integer, parameter :: n = 1000000

    call refused(error, "&frame mass=" // repeat("9", n) // "/", &
      "in.nml:1: &frame: mass = " // repeat("9", 57) // "...: is too large")
    call refused(error, "&frame mass=" // repeat("1 ", n / 2) // "/", "in.nml:1: &frame: mass = " &
      // repeat("1, ", 37) // "1, ...: takes 1 value, has 500000 (a decimal comma? use a point)", "&frame: mass =")
    call refused(error, "&frame mass=" // repeat(" ", n) // nl // "x/", "in.nml:1: &frame: mass = x: must be a number")
    call refused(error, "&frame mass=" // repeat(nl, n) // "$", "in.nml:1: &frame: has no closing / (the file ends)")
    call refused(error, "&case title='" // repeat("''", n / 2) // " /", "the text '" // repeat("'", 57) &
      // "... has no closing quote on its line", "has no closing quote")
    call refused(error, "&case title=" // repeat("'a' ", n / 4) // " /", &
      "takes 1 value, has 250000", "takes 1 value, has 250000")
    call refused(error, "&frame " // repeat("m=1 ", n / 4) // " /", "in.nml:1: &frame: unknown key 'm': allowed are " &
      // "mass, inertia, origin, dof")
    call refused(error, repeat("&link/  ", n / 8), "in.nml: the group &drive is missing")
    call refused(error, "&frame mass=" // repeat("nan(", n / 4), "", "'mass' has no value")
    call refused(error, repeat("x", n), "in.nml:1: '" // repeat("x", 57) // "...' is outside of any group")
    call refused(error, repeat("!", n), "in.nml: contains no group &name ... /")
  end subroutine test_long

end module test_namelist
