!> Reading namelist files: what is understood, and the exact words for what is not.
module test_namelist
  use testdrive, only: new_unittest, unittest_type, test_error => error_type, check, test_failed
  use gestell_base_error, only: error_type, invalid_input, wrong_usage
  use gestell_base_kinds, only: dp
  use gestell_io_check, only: check_document
  use gestell_io_document, only: document_type, group_type, the_group, groups_named, group_names, has, &
    word_length
  use gestell_io_get, only: get, positive, nonnegative, nonzero, at_least, count_values
  use gestell_io_message, only: input_error
  use gestell_io_namelist, only: read_document, parse_document
  use gestell_io_path, only: set_value, get_path, set_path_real
  use gestell_io_schema, only: input_schema
  use gestell_io_suggest, only: suggestion
  implicit none (type, external)
  private

  public :: collect_namelist

  character(len=*), parameter :: nl = new_line("a")
  character(len=*), parameter :: file = "in.nml"

  !> A complete small input of eight lines.
  character(len=*), parameter :: complete = &
    "&case title = 'Four-bar', tasks = 'stability', 'response' /" // nl // &
    "&drive speed_rpm = 240.0 /   ! negative: clockwise" // nl // &
    "&joint name='A0', type='ground', position=0.0, 0.0 /" // nl // &
    "&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /" // nl // &
    "&link name='crank', from='A0', to='A', mass=0.50, inertia=0.0035, center=0.03,0.0 /" // nl // &
    "&frame mass=18.0, inertia=0.78, origin=-0.20,0.20 /" // nl // &
    "&support position=-0.30,-0.20, stiffness=2*196133.0 / &support position=3*0.5 /" // nl // &
    "&foundation damping=0.5,0.5,0.05 /" // nl

  !> The same without its mistake.
  character(len=*), parameter :: valid = complete(:index(complete, "3*0.5") - 1) // "2" // &
    complete(index(complete, "3*0.5") + 1:)

  !> A joint and a drive: with a frame, all that is required.
  character(len=*), parameter :: one_joint = "&joint name='O' type='ground'/"
  character(len=*), parameter :: rest = one_joint // "&drive speed_rpm=1/"

contains

  subroutine collect_namelist(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      new_unittest("values of a complete input", test_values), &
      new_unittest("all ways of writing", test_writing), &
      new_unittest("numbers as they may be written", test_numbers), &
      new_unittest("subscripts and matrices", test_subscripts), &
      new_unittest("errors of form", test_form), &
      new_unittest("errors of the schema", test_schema), &
      new_unittest("errors of values", test_wrong_values), &
      new_unittest("errors of subscripts", test_wrong_subscripts), &
      new_unittest("errors of getters", test_getters), &
      new_unittest("--set and paths", test_set), &
      new_unittest("errors of --set", test_wrong_set), &
      new_unittest("suggestions", test_suggestion), &
      new_unittest("files that are none", test_files), &
      new_unittest("long texts in short time", test_long), &
      new_unittest("truncated input", test_truncated), &
      new_unittest("changed and random input", test_fuzz)]
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

    call read_checked(valid, doc, failure)
    call check_passed(error, failure)
    if (allocated(error)) return
    call get(the_group(doc, "drive"), "speed_rpm", x, failure, must=nonzero)
    call check(error, x, 240.0_dp)
    if (allocated(error)) return
    call get(the_group(doc, "case"), "title", text, failure)
    call check(error, text, "Four-bar")
    if (allocated(error)) return
    call get(the_group(doc, "case"), "tasks", texts, failure)
    call check(error, size(texts) == 2 .and. texts(1) == "stability" .and. texts(2) == "response")
    if (allocated(error)) return
    joints = groups_named(doc, "joint")
    call check(error, size(joints), 2)
    if (allocated(error)) return
    associate (names => group_names(joints))
      call check(error, names(1) == "A0" .and. names(2) == "B")
    end associate
    if (allocated(error)) return
    call check(error, joints(2)%line, 4)
    if (allocated(error)) return
    call get(joints(2), "lengths", pair, failure, must=positive)
    call check(error, all(abs(pair - [0.37_dp, 0.16_dp]) <= 0.0_dp))
    if (allocated(error)) return
    call get(joints(2), "branch", branch, failure)
    call check(error, branch, 1)
    if (allocated(error)) return
    call check(error, has(joints(1), "position") .and. .not. has(joints(2), "position"))
    if (allocated(error)) return
    call check(error, count_values(joints(2), "ends") == 2 .and. count_values(joints(1), "ends") == 0)
    if (allocated(error)) return
    ! defaults, of a group that the file has and of one that it has not
    call get(joints(2), "offset", pair, failure, default=-1.0_dp)
    call check(error, all(abs(pair + 1) <= 0.0_dp))
    if (allocated(error)) return
    call get(the_group(doc, "accuracy"), "method", text, failure, default="auto")
    call check(error, text, "auto")
    if (allocated(error)) return
    call get(the_group(doc, "response"), "points", branch, failure, default=360)
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
    call same(error, tab // "&drive" // tab // "speed_rpm" // tab // "=" // tab // "240" // tab // "/&case title='it''s'/")
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
    call get(the_group(doc, "drive"), "speed_rpm", speed, failure)
    call get(the_group(doc, "case"), "title", title, failure)
    call check(error, abs(speed - 240) <= 0.0_dp .and. title == "it's", "wrong values from " // text)
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
    call get(the_group(doc, "frame"), "mass", x, failure)
    call check(error, abs(x - expected) <= 0.0_dp, "wrong number from " // text)
  end subroutine number

  subroutine test_subscripts(error)
    type(test_error), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    real(dp) :: matrix(3, 3), pair(2)

    call read_checked("&frame/ &foundation stiffness = 1 2 3, 4 5 6, 2*7 9 / &support stiffness(2)=5, stiffness (1) = 4/" &
      // nl // "&support damping(2)=3/" // rest, doc, failure)
    call check_passed(error, failure)
    if (allocated(error)) return
    call get(the_group(doc, "foundation"), "stiffness", matrix, failure, default=0.0_dp)
    call check(error, nint(matrix(3, 1)) == 3 .and. nint(matrix(1, 2)) == 4 .and. nint(matrix(2, 3)) == 7)
    if (allocated(error)) return
    associate (supports => groups_named(doc, "support"))
      call get(supports(1), "stiffness", pair, failure)
      call check(error, all(nint(pair) == [4, 5]))
      if (.not. allocated(error)) then
        call get(supports(2), "damping", pair, failure, default=0.0_dp)
        call check(error, all(nint(pair) == [0, 3]))
      end if
      if (.not. allocated(error)) then
        call get(supports(2), "damping", pair, failure)
        call check_message(error, failure, "in.nml:2: &support 2: damping(1): must be given")
      end if
    end associate
    if (allocated(error)) return

    call read_checked("&frame/ &foundation stiffness(1,3) = -2.5 /" // rest, doc, failure)
    call get(the_group(doc, "foundation"), "stiffness", matrix, failure, default=0.0_dp)
    call check(error, abs(matrix(1, 3) + 2.5_dp) <= 0.0_dp .and. count(abs(matrix) > 0) == 1)
    if (allocated(error)) return
    call get(the_group(doc, "foundation"), "stiffness", matrix, failure, default=0.0_dp, must=nonnegative)
    call check_message(error, failure, "in.nml:1: &foundation: stiffness(1,3) = -2.5: must not be negative")
  end subroutine test_subscripts

  subroutine test_form(error)
    type(test_error), allocatable, intent(out) :: error

    call refused(error, "", "in.nml: the file is empty")
    call refused(error, "! nothing" // nl, "in.nml: has no group &name ... /")
    call refused(error, "hello", "in.nml:1: 'hello' stands outside of the groups")
    call refused(error, "&drive speed_rpm=1 / rpm", &
      "in.nml:1: 'rpm' stands outside of the groups: the / before it ended &drive")
    call refused(error, "&joint name='B'," // nl // "radius = 1/2 /", &
      "in.nml:2: '2' stands outside of the groups: the / before it ended &joint 'B' (a fraction? write a decimal number)")
    call refused(error, nl // "$drive speed_rpm=1 $end", "in.nml:2: write &drive ... / in place of $drive")
    call refused(error, "&drive speed_rpm=1" // nl // "&end", "in.nml:2: &drive: close the group with / in place of &end")
    call refused(error, "&drive" // nl // "$end", "in.nml:2: &drive: close the group with / in place of $end")
    call refused(error, "&end", "in.nml:1: &end without a group before it")
    call refused(error, "& = 2 /", "in.nml:1: a group's name must follow the &")
    call refused(error, nl // "&joint name='B'" // nl // "type='RRR'" // nl // "&link name='c' /", &
      "in.nml:2: &joint 'B': has no closing / (the next group begins in line 4)")
    call refused(error, nl // "&drive speed_rpm = 240" // nl // nl, "in.nml:2: &drive: has no closing / (the file ends)")
    call refused(error, "&drive speed_rpm 240 /", "in.nml:1: &drive: = is missing after 'speed_rpm'")
    call refused(error, "&drive 240 /", "in.nml:1: &drive: '240' where a key is expected")
    call refused(error, "&drive speed_rpm = /", "in.nml:1: &drive: 'speed_rpm' has no value")
    call refused(error, "&frame mass = inertia = 2 /", "in.nml:1: &frame: 'mass' has no value")
    call refused(error, "&frame origin = , 2 /", "in.nml:1: &frame: a value is missing before a comma of 'origin'")
    call refused(error, "&frame origin = 1," // nl // ", 2 /", &
      "in.nml:2: &frame: a value is missing before a comma of 'origin'")
    call refused(error, "&frame origin = 2* /", "in.nml:1: &frame: a value is missing behind '2*'")
    call refused(error, "&frame origin = 0*1 /", "in.nml:1: &frame: '0*1': no possible repeat count")
    call refused(error, "&frame origin = 99999999999*1 /", "in.nml:1: &frame: '99999999999*1': no possible repeat count")
    call refused(error, "&case title = 'open" // nl // "' /", &
      "in.nml:1: &case: the text 'open has no closing quote on its line")
    call refused(error, "&case tasks = 2*'open /", "in.nml:1: &case: the text 'open / has no closing quote on its line")
    call refused(error, "&case title = 'Watt's linkage' /", &
      "in.nml:1: &case: a blank or comma is missing before 's' (a quote within a text is written twice)")
    call refused(error, "&frame mass = = 2 /", "in.nml:1: &frame: 'mass' has no value")
    call refused(error, "&frame mass = 2 = 3 /", "in.nml:1: &frame: 'mass' has no value")
    call refused(error, "&frame mass = 2 ) /", "in.nml:1: &frame: ')' where a key or the closing / is expected")
    call refused(error, "&frame 'mass' = 2 /", "in.nml:1: &frame: 'mass' where a key or the closing / is expected")
    call refused(error, "&support stiffness(1:2) = 3, 4 /", &
      "in.nml:1: &support: 'stiffness(': one or two whole numbers and a ) must follow")
    call refused(error, "&drive" // nl // achar(0) // "/", &
      "in.nml:2: not a text file (character code 0); save it as UTF-8 text")
    call refused(error, "&drive" // achar(13) // "/", "in.nml:1: a carriage return within a line")
  end subroutine test_form

  subroutine test_schema(error)
    type(test_error), allocatable, intent(out) :: error

    call refused(error, valid // "&suport /", "in.nml:9: unknown group &suport: did you mean &support?")
    call refused(error, "&zzz /", "in.nml:1: unknown group &zzz: allowed are &case, &drive, &joint, &link, &frame, " &
      // "&support, &foundation, &accuracy, &response")
    call refused(error, nl // "&joint" // nl // "lenghts=1, name='B' /", &
      "in.nml:3: &joint 'B': unknown key 'lenghts': did you mean 'lengths'?")
    call refused(error, "&drive xyz=1 /", "in.nml:1: &drive: unknown key 'xyz': allowed are speed_rpm")
    call refused(error, "&support/" // nl // "&support colour='red'/", &
      "in.nml:2: &support 2: unknown key 'colour': allowed are position, stiffness, damping, angle")
    call refused(error, "&drive speed_rpm=1/" // nl // "&frame/&drive speed_rpm=2/", &
      "in.nml:2: &drive: may stand only once (first in line 1)")
    call refused(error, "&frame mass=1," // nl // "inertia=2," // nl // "Mass=3/", &
      "in.nml:3: &frame: mass = 3: given twice (first in line 1)")
    call refused(error, complete, "in.nml:7: &support 2: position = 3*0.5: takes 2 values, has 3")
    call refused(error, "&frame origin=0.1/", "in.nml:1: &frame: origin = 0.1: takes 2 values, has 1")
    call refused(error, "&frame mass=1 2/", "in.nml:1: &frame: mass = 1, 2: takes 1 value, has 2 " &
      // "(a decimal comma? use a point)")
    call refused(error, "&drive speed_rpm = 240,5/", &
      "in.nml:1: &drive: speed_rpm = 240, 5: takes 1 value, has 2 (a decimal comma? use a point)")
    call refused(error, "&frame origin = -0,2 0,5e1/", &
      "in.nml:1: &frame: origin = -0, 2, 0, 5e1: takes 2 values, has 4 (a decimal comma? use a point)")
    call refused(error, "&frame mass=1.5 2.5/", "in.nml:1: &frame: mass = 1.5, 2.5: takes 1 value, has 2")
    call refused(error, "&frame origin=2000000000*1, 2000000000*1/", "in.nml:1: &frame: origin = 2000000000*1, " &
      // "2000000000*1: takes 2 values, has more than 1000000")
    call refused(error, "&case tasks=11*'a'/", "in.nml:1: &case: tasks = 11*'a': takes at most 10 values, has 11")
    call refused(error, "&joint name='A' type='ground'/ &frame/", "in.nml: the group &drive is missing")
    call refused(error, "&drive speed_rpm=1/ &frame/", "in.nml: the group &joint is missing")
    call refused(error, "&drive/" // one_joint // "&frame/", "in.nml:1: &drive: speed_rpm: must be given")
    call refused(error, rest // "&frame/" // nl // "&joint type='ground'/", "in.nml:2: &joint 2: name: must be given")
    call refused(error, rest // "&frame/" // nl // "&link name='k'" // nl // "/", &
      "in.nml:2: &link 'k': from: must be given")
    call refused(error, "&joint name='' /", "in.nml:1: &joint: name = '': must not be blank")
    call refused(error, "&case tasks='" // repeat("x", 65) // "'/", "in.nml:1: &case: tasks(1) = '" // repeat("x", 57) &
      // "...': must not be longer than 64 characters")
  end subroutine test_schema

  subroutine test_wrong_values(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=*), parameter :: at = "in.nml:1: &frame: mass = "
    character(len=*), parameter :: none(*) = [character(len=8) :: "abc", "1-5", "0x10", "1e", "1.2.3", ".", "-", &
      "1e5.0", "--1", "4Habcd", "1_8", "1,5e", "z'FF'", "T", "1e+", "e5", "+", "1 e5", "#5"]
    character(len=*), parameter :: infinite(*) = [character(len=10) :: "NaN", "-nan", "nan(0x1)", "Inf", "+INF", &
      "-Infinity", "infinity"]
    integer :: i

    do i = 1, size(none)
      if (scan(trim(none(i)), ", '") > 0) cycle
      call refused(error, "&frame mass=" // trim(none(i)) // "/", at // trim(none(i)) // ": must be a number")
    end do
    do i = 1, size(infinite)
      call refused(error, "&frame mass=" // trim(infinite(i)) // "/", at // trim(infinite(i)) // ": must be finite")
    end do
    call refused(error, "&frame mass=1e309/", at // "1e309: is too large")
    call refused(error, "&frame mass=-1d99999999999/", at // "-1d99999999999: is too large")
    call refused(error, "&frame mass='5'/", at // "'5': must be a number, without quotes")
    call refused(error, "&frame mass=" // repeat("x", 1000) // "/", at // repeat("x", 57) // "...: must be a number")
    call refused(error, "&accuracy steps=2.5/", &
      "in.nml:1: &accuracy: steps = 2.5: must be a whole number, written without a point or exponent")
    call refused(error, "&accuracy steps=3.0/", &
      "in.nml:1: &accuracy: steps = 3.0: must be a whole number, written without a point or exponent")
    call refused(error, "&accuracy steps=3000000000/", "in.nml:1: &accuracy: steps = 3000000000: is too large")
    call refused(error, "&accuracy steps=nan/", "in.nml:1: &accuracy: steps = nan: must be finite")
    call refused(error, "&link from=A0/", "in.nml:1: &link: from = A0: must stand in quotes: 'A0'")
    call refused(error, "&joint ends='A', B0/", "in.nml:1: &joint: ends(2) = B0: must stand in quotes: 'B0'")
    call refused(error, "&support position=" // nl // "0.1," // nl // "0.2x/", &
      "in.nml:1: &support: position(2) = 0.2x: must be a number")
    call refused(error, "&foundation stiffness=8*1.0, c/", &
      "in.nml:1: &foundation: stiffness(3,3) = c: must be a number")
  end subroutine test_wrong_values

  subroutine test_wrong_subscripts(error)
    type(test_error), allocatable, intent(out) :: error

    call refused(error, "&frame mass(1)=2/", "in.nml:1: &frame: mass(1) = 2: takes no subscript")
    call refused(error, "&frame origin(1,1)=2/", "in.nml:1: &frame: origin(1,1) = 2: takes one subscript")
    call refused(error, "&foundation stiffness(4)=2/", &
      "in.nml:1: &foundation: stiffness(4) = 2: takes two subscripts")
    call refused(error, "&frame origin(3)=2/", &
      "in.nml:1: &frame: origin(3) = 2: is no element: the subscript runs from 1 to 2")
    call refused(error, "&frame origin(0)=2/", &
      "in.nml:1: &frame: origin(0) = 2: is no element: the subscript runs from 1 to 2")
    call refused(error, "&foundation stiffness(3,4)=2/", &
      "in.nml:1: &foundation: stiffness(3,4) = 2: is no element: the subscripts run from 1 to 3 and 1 to 3")
    call refused(error, "&frame origin(1)=2, 3/", &
      "in.nml:1: &frame: origin(1) = 2, 3: takes 1 value (a decimal comma? use a point)")
    call refused(error, "&frame origin(1)=2" // nl // "origin(2)=3" // nl // "origin(1)=4/", &
      "in.nml:3: &frame: origin(1) = 4: given twice (first in line 1)")
    call refused(error, "&frame origin=2,3" // nl // "origin(1)=4/", &
      "in.nml:2: &frame: origin(1) = 4: given twice (first in line 1)")
    call refused(error, "&frame origin(1)=4" // nl // "origin=2,3/", &
      "in.nml:2: &frame: origin = 2, 3: given twice (first in line 1)")
    call refused(error, "&joint ends(2)='A'/", "in.nml:1: &joint: ends(2) = 'A': needs the element before it too")
  end subroutine test_wrong_subscripts

  subroutine test_getters(error)
    type(test_error), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    type(group_type), allocatable :: joints(:)
    character(len=:), allocatable :: text
    character(len=word_length), allocatable :: texts(:)
    real(dp) :: x, pair(2)
    integer :: n

    call read_checked(rest // nl // "&joint name='B', type='RRr'," // nl // " lengths=0.37, -0.16, branch=+0," // nl &
      // " ends='A','B0', radius=0d0/ &frame mass=-1e-3/ &case tasks='modes','stabilty'/", doc, failure)
    call check_passed(error, failure)
    if (allocated(error)) return
    joints = groups_named(doc, "joint")
    call get(joints(2), "lengths", pair, failure, must=positive)
    call check_message(error, failure, "in.nml:3: &joint 'B': lengths(2) = -0.16: must be positive")
    call get(joints(2), "lengths", pair(:1), failure)
    call check_message(error, failure, "in.nml:3: &joint 'B': lengths = 0.37, -0.16: needs 1 value, has 2")
    call get(joints(2), "radius", x, failure, must=positive)
    call check_message(error, failure, "in.nml:4: &joint 'B': radius = 0d0: must be positive")
    call get(joints(2), "radius", x, failure, must=nonzero)
    call check_message(error, failure, "in.nml:4: &joint 'B': radius = 0d0: must not be zero")
    call get(the_group(doc, "frame"), "mass", x, failure, must=nonnegative)
    call check_message(error, failure, "in.nml:4: &frame: mass = -1e-3: must not be negative")
    call get(joints(2), "branch", n, failure, must=at_least(2))
    call check_message(error, failure, "in.nml:3: &joint 'B': branch = +0: must be at least 2")
    call get(joints(2), "pivot", text, failure)
    call check_message(error, failure, "in.nml:2: &joint 'B': pivot: must be given")
    call get(joints(2), "type", text, failure, allowed=[character(len=6) :: "ground", "crank", "RRR"])
    call check_message(error, failure, "in.nml:2: &joint 'B': type = 'RRr': unknown; did you mean 'RRR'?")
    call get(the_group(doc, "case"), "tasks", texts, failure, allowed=[character(len=9) :: "stability", "modes"])
    call check_message(error, failure, "in.nml:4: &case: tasks(2) = 'stabilty': unknown; did you mean 'stability'?")
    call get(the_group(doc, "accuracy"), "tolerance", x, failure)
    call check_message(error, failure, "in.nml: &accuracy: tolerance: must be given")
    call input_error(joints(2), "ends", "unknown joint" // suggestion("B0", group_names(joints)), failure, 2)
    call check_message(error, failure, "in.nml:4: &joint 'B': ends(2) = 'B0': unknown joint; did you mean 'B'?")
    call input_error(joints(2), "", "is not connected", failure)
    call check_message(error, failure, "in.nml:2: &joint 'B': is not connected")
  end subroutine test_getters

  subroutine test_set(error)
    type(test_error), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    type(group_type), allocatable :: supports(:)
    character(len=:), allocatable :: text
    character(len=word_length), allocatable :: texts(:)
    real(dp), allocatable :: values(:)
    real(dp) :: x
    integer :: n

    call parse_document("&joint name='B', type='RRR', lengths=0.37,0.16/ &frame/ &support/ &support stiffness=1,2/", &
      file, doc, failure)
    call set(error, doc, "drive.speed_rpm=240")
    call set(error, doc, " Support . stiffness = 1e5 ")
    call set(error, doc, "support(2).stiffness(1)=7")
    call set(error, doc, "joint(B).lengths(2)=.5")
    call set(error, doc, "foundation.stiffness(2,3)=6")
    call set(error, doc, "frame.origin=1,2")
    call set(error, doc, "frame.dof='xi', eta")
    call set(error, doc, "case.title=a, b = c")
    call set(error, doc, "case.tasks=stability,response")
    call set(error, doc, "accuracy.method=gauss6")
    call set(error, doc, "accuracy.steps=64")
    if (allocated(error)) return
    call check_document(doc, input_schema(), failure)
    call check_passed(error, failure)
    if (allocated(error)) return

    call get_path(doc, input_schema(), "support.stiffness", values, failure)
    call check(error, all(nint(values) == [100000, 100000, 7, 100000]))
    if (allocated(error)) return
    call get_path(doc, input_schema(), "joint(1).lengths", values, failure)
    call check(error, all(abs(values - [0.37_dp, 0.5_dp]) <= 0.0_dp))
    if (allocated(error)) return
    call get_path(doc, input_schema(), "foundation.stiffness(2,3)", values, failure)
    call check(error, size(values) == 1 .and. nint(values(1)) == 6)
    if (allocated(error)) return
    call get(the_group(doc, "accuracy"), "steps", n, failure)
    call check(error, n, 64)
    if (allocated(error)) return
    call get(the_group(doc, "accuracy"), "method", text, failure)
    call check(error, text, "gauss6")
    if (allocated(error)) return
    call get(the_group(doc, "case"), "title", text, failure)
    call check(error, text, "a, b = c")
    if (allocated(error)) return
    call get(the_group(doc, "frame"), "dof", texts, failure)
    call check(error, size(texts) == 2 .and. texts(1) == "xi" .and. texts(2) == "eta")
    if (allocated(error)) return

    ! 17 digits bring back the same number
    x = acos(-1.0_dp) * 1.0e-7_dp
    call set_path_real(doc, input_schema(), "drive.speed_rpm", x, failure)
    call check_passed(error, failure)
    if (allocated(error)) return
    call get_path(doc, input_schema(), "drive.speed_rpm", values, failure)
    call check(error, abs(values(1) - x) <= 0.0_dp)
    if (allocated(error)) return

    ! later checks know where the value came from
    call set(error, doc, "support(1).damping=-1,0")
    allocate(supports, source=groups_named(doc, "support"))
    call get(supports(1), "damping", values, failure, must=nonnegative)
    call check_message(error, failure, "--set support(1).damping=-1,0: must not be negative")
    call set_path_real(doc, input_schema(), "frame.mass", -2.0_dp, failure)
    call get(the_group(doc, "frame"), "mass", x, failure, must=positive)
    call check_message(error, failure, "at frame.mass=-2.0000000000000000E+000: must be positive")
  end subroutine test_set

  subroutine test_wrong_set(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=*), parameter :: form = "a path is GROUP.KEY, GROUP(NAME).KEY or GROUP.KEY(INDEX), as in drive.speed_rpm"
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    real(dp), allocatable :: values(:)

    call not_set(error, "speed", "must be PATH=VALUE, as in drive.speed_rpm=240", wrong_usage)
    call not_set(error, "speed=5", form, wrong_usage)
    call not_set(error, "=5", form, wrong_usage)
    call not_set(error, "joint(B=5", "must be PATH=VALUE, as in drive.speed_rpm=240", wrong_usage)
    call not_set(error, "joint(B)=5", form, wrong_usage)
    call not_set(error, "joint(B).lengths(x)=5", form, wrong_usage)
    call not_set(error, "joint(B).lengths(1)2=5", form, wrong_usage)
    call not_set(error, "joint(B).lengths(1,1,1)=5", form, wrong_usage)
    call not_set(error, "drve.speed_rpm=5", "unknown group &drve: did you mean &drive?")
    call not_set(error, "drive.sped_rpm=5", "unknown key 'sped_rpm': did you mean 'speed_rpm'?")
    call not_set(error, "drive.speed_rpm=abc", "must be a number")
    call not_set(error, "drive.speed_rpm=", "a value is missing")
    call not_set(error, "drive.speed_rpm=240,5", "takes 1 value, has 2 (a decimal comma? use a point)")
    call not_set(error, "drive.speed_rpm=1/2", "must be a number")
    call not_set(error, "drive.speed_rpm=inf", "must be finite")
    call not_set(error, "drive.speed_rpm(1)=5", "speed_rpm takes no subscript")
    call not_set(error, "drive(1).speed_rpm=5", "there is only one &drive: write drive.speed_rpm")
    call not_set(error, "joint(b1).radius=5", "unknown joint 'b1'; did you mean 'B'?")
    call not_set(error, "joint(Q).radius=5", "unknown joint 'Q'; known: 'A0', 'B'")
    call not_set(error, "joint(3).radius=5", "there is no &joint 3: they are numbered from 1 to 2")
    call not_set(error, "support(3).angle=5", "there is no &support 3: they are numbered from 1 to 2")
    call not_set(error, "support(x).angle=5", "there is no &support x: they are numbered from 1 to 2")
    call not_set(error, "support.position=5", "takes 2 values, has 1")
    call not_set(error, "support.position(3)=5", "position: the subscript runs from 1 to 2")
    call not_set(error, "support.position(1)=5,6", "takes 1 value, has 2 (a decimal comma? use a point)")
    call not_set(error, "joint(A0).lengths(2)=5", "needs the element before it too")
    call not_set(error, "case.tasks=a,,b", "a value is missing")
    call not_set(error, "accuracy.steps=2.5", "must be a whole number, written without a point or exponent")
    call not_set(error, "joint(B).name=", "must not be blank")

    call read_checked("&frame/" // rest, doc, failure)
    call get_path(doc, input_schema(), "link(k).mass", values, failure)
    call check_message(error, failure, "link(k).mass: the input has no &link")
    call get_path(doc, input_schema(), "frame.mass", values, failure)
    call check_message(error, failure, "frame.mass: has no value in the input")
    call get_path(doc, input_schema(), "joint(O).type", values, failure)
    call check_message(error, failure, "joint(O).type: is a text, not a number")
    call set_value(doc, input_schema(), "frame.mass=" // repeat("9", 500), failure)
    call check_message(error, failure, "--set frame.mass=" // repeat("9", 46) // "...: is too large")
  end subroutine test_wrong_set

  subroutine test_suggestion(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=9), parameter :: words(4) = [character(len=9) :: "stability", "modes", "response", "A"]

    call check(error, suggestion("stabiltiy", words), "; did you mean 'stability'?")
    if (allocated(error)) return
    call check(error, suggestion("MODES", words), "; did you mean 'modes'?")
    if (allocated(error)) return
    call check(error, suggestion("mdoes", words), "; did you mean 'modes'?")
    if (allocated(error)) return
    call check(error, suggestion("reponses", words), "; did you mean 'response'?")
    if (allocated(error)) return
    call check(error, suggestion("B", words), "; known: 'stability', 'modes', 'response', 'A'")
    if (allocated(error)) return
    call check(error, suggestion("", words(2:2)), "; known: 'modes'")
    if (allocated(error)) return
    call check(error, suggestion("x", words(:0)), "; none is known")
    if (allocated(error)) return
    call check(error, suggestion(repeat("x", 100000), words(2:2)), "; known: 'modes'")
  end subroutine test_suggestion

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
    write(unit) "&drive" // achar(13) // nl // "speed_rpm = " // repeat(" ", 10000) // "240 /" // achar(13) // nl // "&frame /"
    close(unit)
    call read_document(name, doc, failure)
    call remove(name)
    call check_passed(error, failure)
    if (allocated(error)) return
    call check(error, size(doc%groups) == 2 .and. doc%groups(2)%line == 3)
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

  !> A million characters of any kind must be judged in seconds: work that grows with the square would take hours.
  subroutine test_long(error)
    type(test_error), allocatable, intent(out) :: error
    integer, parameter :: n = 1000000
    real(dp) :: start, finish

    call cpu_time(start)
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
    call refused(error, repeat("x", n), "in.nml:1: '" // repeat("x", 57) // "...' stands outside of the groups")
    call refused(error, repeat("!", n), "in.nml: has no group &name ... /")
    call cpu_time(finish)
    if (allocated(error)) return
    ! about 2 s with all run-time checks on a slow machine
    call check(error, finish - start < 30, "too slow")
  end subroutine test_long

  !> Each beginning of a valid input is either accepted or refused in good form.
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
      call check(error, index(failure%message, "--set ") == 1 .and. scan(failure%message, nl // achar(0)) == 0, failure%message)
      if (allocated(error)) return
    end do
  end subroutine test_fuzz

  !> Reads a text that may be anything: it passes, or its message is one line, of input errors, with a line of the text.
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
    call check(error, scan(failure%message, nl // achar(13) // achar(0)) == 0 .and. len(failure%message) < 500, text)
    if (allocated(error)) return
    if (index(failure%message, file // ": ") == 1) return
    call check(error, index(failure%message, file // ":"), 1, failure%message)
    if (allocated(error)) return
    i = len(file) + 2
    read(failure%message(i:i+index(failure%message(i:), ":")-2), *, iostat=status) line
    call check(error, status == 0 .and. line >= 1 .and. line <= lines, failure%message)
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

  !> Reads a text and holds it against the schema.
  subroutine read_checked(text, doc, failure)
    character(len=*), intent(in) :: text
    type(document_type), intent(out) :: doc
    type(error_type), allocatable, intent(out) :: failure

    call parse_document(text, file, doc, failure)
    if (.not. allocated(failure)) call check_document(doc, input_schema(), failure)
  end subroutine read_checked

  !> A text must be refused with this message, or, given `part`, with one that has this in it.
  subroutine refused(error, text, message, part)
    type(test_error), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: text, message
    character(len=*), intent(in), optional :: part
    type(document_type) :: doc
    type(error_type), allocatable :: failure

    if (allocated(error)) return
    call read_checked(text, doc, failure)
    if (present(part)) then
      call check(error, allocated(failure))
      if (allocated(error)) return
      call check(error, index(failure%message, part) > 0, failure%message)
    else
      call check_message(error, failure, message)
    end if
  end subroutine refused

  subroutine set(error, doc, assignment)
    type(test_error), allocatable, intent(inout) :: error
    type(document_type), intent(inout) :: doc
    character(len=*), intent(in) :: assignment
    type(error_type), allocatable :: failure

    if (allocated(error)) return
    call set_value(doc, input_schema(), assignment, failure)
    call check_passed(error, failure)
  end subroutine set

  !> An assignment must be refused with this message behind "--set assignment: ".
  subroutine not_set(error, assignment, message, code)
    type(test_error), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: assignment, message
    integer, intent(in), optional :: code
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    integer :: expected

    if (allocated(error)) return
    call parse_document("&joint name='A0', type='ground'/ &joint name='B', type='RRR', lengths=1,2/ &support/ &support/", &
      file, doc, failure)
    call set_value(doc, input_schema(), assignment, failure)
    call check_message(error, failure, "--set " // assignment // ": " // message)
    if (allocated(error)) return
    expected = invalid_input
    if (present(code)) expected = code
    call check(error, failure%code, expected)
  end subroutine not_set

  subroutine check_message(error, failure, message)
    type(test_error), allocatable, intent(inout) :: error
    type(error_type), allocatable, intent(in) :: failure
    character(len=*), intent(in) :: message

    if (allocated(error)) return
    if (allocated(failure)) then
      call check(error, failure%message, message)
    else
      call test_failed(error, "no error where this was expected: " // message)
    end if
  end subroutine check_message

  subroutine check_passed(error, failure)
    type(test_error), allocatable, intent(inout) :: error
    type(error_type), allocatable, intent(in) :: failure

    if (allocated(error)) return
    if (allocated(failure)) call test_failed(error, "unexpected error: " // failure%message)
  end subroutine check_passed

end module test_namelist
