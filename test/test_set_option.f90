!> Values set from outside the file, and suggestions for misspelt words.
module test_set_option
  use checks, only: check_failure, check_that
  use testdrive, only: new_unittest, unittest_type, check, test_error => error_type
  use gestell_base_error, only: error_type, invalid_input, wrong_usage
  use gestell_base_key, only: positive, nonnegative
  use gestell_base_kinds, only: dp
  use gestell_input_schema_check, only: check_document
  use gestell_input_schema_read, only: read
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: document_type, group_type, group_named, groups_named
  use gestell_input_namelist, only: parse_document
  use gestell_input_schema_path, only: set_value, get_path, set_path_real
  use gestell_task_registry, only: input_schema
  use gestell_input_namelist_suggest, only: suggestion
  use namelist_helpers, only: key, read_checked, check_message, check_passed, file, rest
  implicit none (type, external)
  private

  public :: collect_set_option

contains

  subroutine collect_set_option(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      new_unittest("--set changes exactly the value that its path names", test_assignments), &
      new_unittest("invalid --set options are refused with the exact message", test_wrong_set), &
      new_unittest("misspelt words yield the nearest suggestion", test_suggestion)]
  end subroutine collect_set_option

  subroutine test_assignments(error)
    type(test_error), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    type(group_type), allocatable :: supports(:)
    character(len=:), allocatable :: text
    character(len=word_length), allocatable :: texts(:)
    real(dp), allocatable :: values(:)
    real(dp) :: x, pair(2)
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
    call check_that(error, nint(values), "==", [100000, 100000, 7, 100000], "counts")
    if (allocated(error)) return
    call get_path(doc, input_schema(), "joint(1).lengths", values, failure)
    call check_that(error, abs(values - [0.37_dp, 0.5_dp]), "<=", 0.0_dp, "lengths")
    if (allocated(error)) return
    call get_path(doc, input_schema(), "foundation.stiffness(2,3)", values, failure)
    call check_that(error, size(values), "==", 1, "values")
    call check_that(error, nint(values(1)), "==", 6, "value")
    if (allocated(error)) return
    call read(group_named(doc, "accuracy"), key("steps"), "steps", n, failure)
    call check(error, n, 64)
    if (allocated(error)) return
    call read(group_named(doc, "accuracy"), key("method"), "method", text, failure)
    call check(error, text, "gauss6")
    if (allocated(error)) return
    call read(group_named(doc, "case"), key("title"), "title", text, failure)
    call check(error, text, "a, b = c")
    if (allocated(error)) return
    call read(group_named(doc, "frame"), key("dof"), "dof", texts, failure)
    call check_that(error, size(texts), "==", 2, "texts")
    call check_that(error, texts(1), "==", "xi", "first")
    call check_that(error, texts(2), "==", "eta", "second")
    if (allocated(error)) return

    ! 17 digits bring back the same number
    x = acos(-1.0_dp) * 1.0e-7_dp
    call set_path_real(doc, input_schema(), "drive.speed_rpm", x, failure)
    call check_passed(error, failure)
    if (allocated(error)) return
    call get_path(doc, input_schema(), "drive.speed_rpm", values, failure)
    call check_that(error, abs(values(1) - x), "<=", 0.0_dp, "value")
    if (allocated(error)) return

    ! later checks know where the value came from
    call set(error, doc, "support(1).damping=-1,0")
    allocate(supports, source=groups_named(doc, "support"))
    call read(supports(1), key("damping", rank=1, range=nonnegative), "damping", pair, failure)
    call check_message(error, failure, "--set support(1).damping=-1,0: must not be negative")
    call set_path_real(doc, input_schema(), "frame.mass", -2.0_dp, failure)
    call read(group_named(doc, "frame"), key("mass", range=positive), "mass", x, failure)
    call check_message(error, failure, "at frame.mass=-2.0000000000000000E+000: must be positive")
  end subroutine test_assignments

  subroutine test_wrong_set(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=*), parameter :: form = &
      "the path must be GROUP.KEY, GROUP(NAME).KEY or GROUP.KEY(INDEX), such as drive.speed_rpm"
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    real(dp), allocatable :: values(:)

    call not_set(error, "speed", "must be PATH=VALUE, such as drive.speed_rpm=240", wrong_usage)
    call not_set(error, "speed=5", form, wrong_usage)
    call not_set(error, "=5", form, wrong_usage)
    call not_set(error, "joint(B=5", "must be PATH=VALUE, such as drive.speed_rpm=240", wrong_usage)
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
    call not_set(error, "joint(Q).radius=5", "unknown joint 'Q'; choose from 'A0', 'B'")
    call not_set(error, "joint(3).radius=5", "there is no &joint 3: the groups are numbered from 1 to 2")
    call not_set(error, "support(3).angle=5", "there is no &support 3: the groups are numbered from 1 to 2")
    call not_set(error, "support(x).angle=5", "there is no &support x: the groups are numbered from 1 to 2")
    call not_set(error, "support.position=5", "takes at least 2 values, has 1")
    call not_set(error, "support.position(4)=5", "position: the subscript runs from 1 to 3")
    call not_set(error, "support.position(1)=5,6", "takes 1 value, has 2 (a decimal comma? use a point)")
    call not_set(error, "joint(A0).lengths(2)=5", "the element before it is missing")
    call not_set(error, "case.tasks=a,,b", "a value is missing")
    call not_set(error, "accuracy.steps=2.5", "must be a whole number, written without decimal point and exponent")
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
    call check(error, suggestion("B", words), "; choose from 'stability', 'modes', 'response', 'A'")
    if (allocated(error)) return
    call check(error, suggestion("", words(2:2)), "; choose from 'modes'")
    if (allocated(error)) return
    call check(error, suggestion("x", words(:0)), "")
    if (allocated(error)) return
    call check(error, suggestion(repeat("x", 100000), words(2:2)), "; choose from 'modes'")
  end subroutine test_suggestion

  subroutine set(error, doc, assignment)
    type(test_error), allocatable, intent(inout) :: error
    type(document_type), intent(inout) :: doc
    character(len=*), intent(in) :: assignment
    type(error_type), allocatable :: failure

    if (allocated(error)) return
    call set_value(doc, input_schema(), assignment, failure)
    call check_passed(error, failure)
  end subroutine set

  !> Checks that an assignment is refused with this message after "--set assignment: ".
  subroutine not_set(error, assignment, message, code)
    type(test_error), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: assignment, message
    integer, intent(in), optional :: code
    type(document_type) :: doc
    type(error_type), allocatable :: failure
    integer :: expected

    if (allocated(error)) return
    call parse_document("&joint name='A0', type='ground'/ &joint name='B', type='RRR', lengths=1,2/ " &
      // "&support/ &support/", file, doc, failure)
    call set_value(doc, input_schema(), assignment, failure)
    call check_failure(error, failure)
    if (allocated(error)) return
    expected = invalid_input
    if (present(code)) expected = code
    call check(error, failure%code, expected)
    call check_message(error, failure, "--set " // assignment // ": " // message)
  end subroutine not_set

end module test_set_option
