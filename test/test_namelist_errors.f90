!> Reading namelist files: the exact messages for invalid input.
module test_namelist_errors
  use testdrive, only: new_unittest, unittest_type, test_error => error_type
  use gestell_base_error, only: error_type
  use gestell_base_key, only: positive, nonnegative, nonzero, range_type
  use gestell_base_kinds, only: dp
  use gestell_input_schema_read, only: read
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: document_type, group_type, group_named, groups_named, group_names
  use gestell_input_namelist_message, only: input_error
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_input_schema, only: schema_type
  use gestell_task_registry, only: input_schema
  use namelist_helpers, only: key, read_checked, refused, check_message, check_passed, nl, rest, one_joint
  implicit none (type, external)
  private

  public :: collect_namelist_errors

contains

  subroutine collect_namelist_errors(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      new_unittest("syntax errors are refused with the exact message", test_form), &
      new_unittest("unknown groups and keys are refused with the exact message", test_schema), &
      new_unittest("invalid values are refused with the exact message", test_wrong_values), &
      new_unittest("invalid subscripts are refused with the exact message", test_wrong_subscripts), &
      new_unittest("values that break their key's rules are refused with the exact message", test_getters)]
  end subroutine collect_namelist_errors

  subroutine test_form(error)
    type(test_error), allocatable, intent(out) :: error

    call refused(error, "", "in.nml: the file is empty")
    call refused(error, "! nothing" // nl, "in.nml: contains no group &name ... /")
    call refused(error, "hello", "in.nml:1: 'hello' is outside of any group")
    call refused(error, "&drive speed_rpm=1 / rpm", &
      "in.nml:1: 'rpm' is outside of any group: the / before it ended &drive")
    call refused(error, "&joint name='B'," // nl // "radius = 1/2 /", &
      "in.nml:2: '2' is outside of any group: the / before it ended &joint 'B' " &
      // "(a fraction? write a decimal number)")
    call refused(error, nl // "$drive speed_rpm=1 $end", "in.nml:2: write &drive ... / instead of $drive")
    call refused(error, "&drive speed_rpm=1" // nl // "&end", &
      "in.nml:2: &drive: close the group with / instead of &end")
    call refused(error, "&drive" // nl // "$end", "in.nml:2: &drive: close the group with / instead of $end")
    call refused(error, "&end", "in.nml:1: &end without a group before it")
    call refused(error, "& = 2 /", "in.nml:1: a group's name must follow the &")
    call refused(error, nl // "&joint name='B'" // nl // "type='RRR'" // nl // "&link name='c' /", &
      "in.nml:2: &joint 'B': has no closing / (the next group begins in line 4)")
    call refused(error, nl // "&drive speed_rpm = 240" // nl // nl, &
      "in.nml:2: &drive: has no closing / (the file ends)")
    call refused(error, "&drive speed_rpm 240 /", "in.nml:1: &drive: = is missing after 'speed_rpm'")
    call refused(error, "&drive 240 /", "in.nml:1: &drive: a key is expected, not '240'")
    call refused(error, "&drive speed_rpm = /", "in.nml:1: &drive: 'speed_rpm' has no value")
    call refused(error, "&frame mass = inertia = 2 /", "in.nml:1: &frame: 'mass' has no value")
    call refused(error, "&frame origin = , 2 /", "in.nml:1: &frame: a value is missing before a comma of 'origin'")
    call refused(error, "&frame origin = 1," // nl // ", 2 /", &
      "in.nml:2: &frame: a value is missing before a comma of 'origin'")
    call refused(error, "&frame origin = 2* /", "in.nml:1: &frame: a value is missing after '2*'")
    call refused(error, "&frame origin = 0*1 /", "in.nml:1: &frame: '0*1': the repeat count must be from 1 to 2147483647")
    call refused(error, "&frame origin = 99999999999*1 /", &
      "in.nml:1: &frame: '99999999999*1': the repeat count must be from 1 to 2147483647")
    call refused(error, "&case title = 'open" // nl // "' /", &
      "in.nml:1: &case: the text 'open has no closing quote on its line")
    call refused(error, "&case tasks = 2*'open /", "in.nml:1: &case: the text 'open / has no closing quote on its line")
    call refused(error, "&case title = 'Watt's linkage' /", &
      "in.nml:1: &case: a blank or comma is missing before 's' (a quote within a text is written twice)")
    call refused(error, "&frame mass = = 2 /", "in.nml:1: &frame: 'mass' has no value")
    call refused(error, "&frame mass = 2 = 3 /", "in.nml:1: &frame: 'mass' has no value")
    call refused(error, "&frame mass = 2 ) /", "in.nml:1: &frame: a key or the closing / is expected, not ')'")
    call refused(error, "&frame 'mass' = 2 /", "in.nml:1: &frame: a key or the closing / is expected, not 'mass'")
    call refused(error, "&support stiffness(1:2) = 3, 4 /", &
      "in.nml:1: &support: 'stiffness(': one or two whole numbers and a ) must follow")
    call refused(error, "&drive" // nl // achar(0) // "/", &
      "in.nml:2: not a text file (character code 0); save it as UTF-8 text")
    call refused(error, "&drive" // achar(13) // "/", "in.nml:1: a carriage return within a line")
  end subroutine test_form

  subroutine test_schema(error)
    type(test_error), allocatable, intent(out) :: error
    type(schema_type) :: schema
    character(len=:), allocatable :: groups
    integer :: i

    call refused(error, rest // nl // nl // "&suport /", "in.nml:3: unknown group &suport: did you mean &support?")
    schema = input_schema()
    groups = ""
    do i = 1, size(schema%groups)
      groups = groups // trim(merge(", &", " & ", i > 1)) // trim(schema%groups(i)%name)
    end do
    call refused(error, "&zzz /", "in.nml:1: unknown group &zzz: allowed are" // groups)
    call refused(error, nl // "&joint" // nl // "lenghts=1, name='B' /", &
      "in.nml:3: &joint 'B': unknown key 'lenghts': did you mean 'lengths'?")
    call refused(error, "&drive xyz=1 /", "in.nml:1: &drive: unknown key 'xyz': allowed are speed_rpm, " &
      & // "speed_hz, held_by, flywheel_inertia")
    call refused(error, "&support/" // nl // "&support colour='red'/", &
      "in.nml:2: &support 2: unknown key 'colour': allowed are position, stiffness, damping, damping_ratio, angle, axes")
    call refused(error, "&drive speed_rpm=1/" // nl // "&frame/&drive speed_rpm=2/", &
      "in.nml:2: &drive: may occur only once (first in line 1)")
    call refused(error, "&frame mass=1," // nl // "inertia=2," // nl // "Mass=3/", &
      "in.nml:3: &frame: mass = 3: is given twice (first in line 1)")
    call refused(error, "&support/" // nl // "&support position = 4*0.5/", &
      "in.nml:2: &support 2: position = 4*0.5: takes at most 3 values, has 4")
    call refused(error, "&frame origin=0.1/", "in.nml:1: &frame: origin = 0.1: takes at least 2 values, has 1")
    call refused(error, "&frame mass=1 2/", "in.nml:1: &frame: mass = 1, 2: takes 1 value, has 2 " &
      // "(a decimal comma? use a point)")
    call refused(error, "&drive speed_rpm = 240,5/", &
      "in.nml:1: &drive: speed_rpm = 240, 5: takes 1 value, has 2 (a decimal comma? use a point)")
    call refused(error, "&frame origin = -0,2 0,5e1/", &
      "in.nml:1: &frame: origin = -0, 2, 0, 5e1: takes at most 3 values, has 4 (a decimal comma? use a point)")
    call refused(error, "&frame mass=1.5 2.5/", "in.nml:1: &frame: mass = 1.5, 2.5: takes 1 value, has 2")
    call refused(error, "&frame origin=2000000000*1, 2000000000*1/", "in.nml:1: &frame: origin = 2000000000*1, " &
      // "2000000000*1: takes at most 3 values, has more than 1000000")
    call refused(error, "&case tasks=21*'a'/", "in.nml:1: &case: tasks = 21*'a': takes at most 20 values, has 21")
    call refused(error, "&joint name='A' type='ground'/ &frame/", "in.nml: the group &drive is missing")
    call refused(error, "&drive speed_rpm=1/", "in.nml: the group &frame is missing")
    call refused(error, "&drive/" // one_joint // "&frame/", "in.nml:1: &drive: speed_rpm: must be given")
    call refused(error, rest // "&frame/" // nl // "&joint type='ground'/", "in.nml:2: &joint 2: name: must be given")
    call refused(error, rest // "&frame/" // nl // "&link name='k'" // nl // "/", &
      "in.nml:2: &link 'k': from: must be given")
    call refused(error, "&joint name='' /", "in.nml:1: &joint: name = '': must not be blank")
    call refused(error, "&case tasks='" // repeat("x", 129) // "'/", "in.nml:1: &case: tasks(1) = '" // repeat("x", 57) &
      // "...': must not be longer than 128 characters")
    call refused(error, "&joint name='" // repeat("é", 65) // "'/", "in.nml:1: &joint '" // repeat("é", 28) // "...': name = '" &
      // repeat("é", 28) // "...': must not be longer than 64 characters")
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
    call refused(error, "&frame mass=1e308/", at // "1e308: is too large")
    call refused(error, "&frame mass=1e309/", at // "1e309: is too large")
    call refused(error, "&frame mass=-1d99999999999/", at // "-1d99999999999: is too large")
    call refused(error, "&frame mass='5'/", at // "'5': must be a number, without quotes")
    call refused(error, "&frame mass=" // repeat("x", 1000) // "/", at // repeat("x", 57) // "...: must be a number")
    call refused(error, "&accuracy steps=2.5/", &
      "in.nml:1: &accuracy: steps = 2.5: must be a whole number, written without decimal point and exponent")
    call refused(error, "&accuracy steps=3.0/", &
      "in.nml:1: &accuracy: steps = 3.0: must be a whole number, written without decimal point and exponent")
    call refused(error, "&accuracy steps=3000000000/", "in.nml:1: &accuracy: steps = 3000000000: is too large")
    call refused(error, "&accuracy steps=nan/", "in.nml:1: &accuracy: steps = nan: must be finite")
    call refused(error, "&link from=A0/", "in.nml:1: &link: from = A0: must be in quotes: 'A0'")
    call refused(error, "&joint ends='A', B0/", "in.nml:1: &joint: ends(2) = B0: must be in quotes: 'B0'")
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
    call refused(error, "&frame origin(4)=2/", &
      "in.nml:1: &frame: origin(4) = 2: has no such element: the subscript runs from 1 to 3")
    call refused(error, "&frame origin(0)=2/", &
      "in.nml:1: &frame: origin(0) = 2: has no such element: the subscript runs from 1 to 3")
    call refused(error, "&foundation stiffness(3,7)=2/", &
      "in.nml:1: &foundation: stiffness(3,7) = 2: has no such element: the subscripts run from 1 to 6 and 1 to 6")
    call refused(error, "&frame origin(1)=2, 3/", &
      "in.nml:1: &frame: origin(1) = 2, 3: takes 1 value (a decimal comma? use a point)")
    call refused(error, "&frame origin(1)=2" // nl // "origin(2)=3" // nl // "origin(1)=4/", &
      "in.nml:3: &frame: origin(1) = 4: is given twice (first in line 1)")
    call refused(error, "&frame origin=2,3" // nl // "origin(1)=4/", &
      "in.nml:2: &frame: origin(1) = 4: is given twice (first in line 1)")
    call refused(error, "&frame origin(1)=4" // nl // "origin=2,3/", &
      "in.nml:2: &frame: origin = 2, 3: is given twice (first in line 1)")
    call refused(error, "&joint ends(2)='A'/", "in.nml:1: &joint: ends(2) = 'A': the element before it is missing")
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
    call read(joints(2), key("lengths", rank=1, range=positive), "lengths", pair, failure)
    call check_message(error, failure, "in.nml:3: &joint 'B': lengths(2) = -0.16: must be positive")
    call read(joints(2), key("lengths", rank=1), "lengths", pair(:1), failure)
    call check_message(error, failure, "in.nml:3: &joint 'B': lengths = 0.37, -0.16: takes 1 value, has 2")
    call read(joints(2), key("radius", range=positive), "radius", x, failure)
    call check_message(error, failure, "in.nml:4: &joint 'B': radius = 0d0: must be positive")
    call read(joints(2), key("radius", range=nonzero), "radius", x, failure)
    call check_message(error, failure, "in.nml:4: &joint 'B': radius = 0d0: must not be zero")
    call read(group_named(doc, "frame"), key("mass", range=nonnegative), "mass", x, failure)
    call check_message(error, failure, "in.nml:4: &frame: mass = -1e-3: must not be negative")
    call read(joints(2), key("branch", range=range_type(least=2.0_dp)), "branch", n, failure)
    call check_message(error, failure, "in.nml:3: &joint 'B': branch = +0: must be at least 2")
    call read(joints(2), key("pivot"), "pivot", text, failure)
    call check_message(error, failure, "in.nml:2: &joint 'B': pivot: must be given")
    call read(joints(2), key("type", words="ground, crank, RRR"), "type", text, failure)
    call check_message(error, failure, "in.nml:2: &joint 'B': type = 'RRr': unknown; did you mean 'RRR'?")
    call read(group_named(doc, "case"), key("tasks", words="stability, modes"), "tasks", texts, failure)
    call check_message(error, failure, "in.nml:4: &case: tasks(2) = 'stabilty': unknown; did you mean 'stability'?")
    call read(group_named(doc, "accuracy"), key("tolerance"), "tolerance", x, failure)
    call check_message(error, failure, "in.nml: &accuracy: tolerance: must be given")
    call input_error(joints(2), "ends", "unknown joint" // suggestion("B0", group_names(joints)), failure, 2)
    call check_message(error, failure, "in.nml:4: &joint 'B': ends(2) = 'B0': unknown joint; did you mean 'B'?")
    call input_error(joints(2), "", "is not connected", failure)
    call check_message(error, failure, "in.nml:2: &joint 'B': is not connected")
  end subroutine test_getters

end module test_namelist_errors
