!> The records of keys are consistent; defaults, ranges, help and tables agree with them.
module test_keys
  use gestell_base_error, only: gestell_error => error_type, wrong_usage
  use gestell_base_key, only: all_words, find_key, of_acceleration, of_angle, of_area, of_damping, of_force, of_inertia, &
    & of_length, of_mass, of_moment, of_pressure, of_rotary_damping, of_stiffness, real_key, text_key, unset
  use gestell_base_kinds, only: dp, pi
  use gestell_input_machine_frame, only: foundation_keys, gravity_keys
  use gestell_input_machine_groups, only: read_units
  use gestell_input_namelist_document, only: document_type, group_named
  use gestell_input_schema, only: find_group_rule, find_key_rule, schema_type
  use gestell_input_schema_help, only: help_on
  use gestell_input_schema_read, only: read
  use gestell_input_schema_units, only: find_unit, unit_type, units_type
  use gestell_task_common_keys, only: accuracy_keys, response_keys
  use gestell_task_registry, only: input_schema
  use checks, only: check_failure, check_that
  use namelist_helpers, only: check_message, nl, read_checked, rest
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_keys

contains

  subroutine collect_keys(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("key records are complete, unique within their group, with permitted defaults", test_records), &
      & new_unittest("every word of a key has a meaning, or none has", test_words), &
      & new_unittest("missing keys take their defaults in SI units", test_defaults), &
      & new_unittest("each element of a matrix is converted in its own unit", test_matrix), &
      & new_unittest("units of other worlds have exact factors", test_other_worlds), &
      & new_unittest("both ends of a key's range are checked", test_ranges), &
      & new_unittest("help on every group and key fits a terminal", test_help), &
      & new_unittest("help on a misspelt word suggests the right one", test_no_help)]
  end subroutine collect_keys

  subroutine test_records(error)
    type(error_type), allocatable, intent(out) :: error
    type(schema_type) :: schema
    character(len=20), allocatable :: words(:), allowed(:)
    integer :: i, k

    schema = input_schema()
    do i = 1, size(schema%groups)
      associate (name => schema%groups(i)%name)
        if (.not. allocated(error)) call check(error, count(schema%groups%name == name), 1, name // ": twice")
        if (.not. allocated(error)) call check(error, any(schema%keys%group == name), name // ": no key")
      end associate
    end do
    if (allocated(error)) return
    do i = 1, size(schema%keys)
      associate (key => schema%keys(i))
        if (.not. allocated(error)) call check(error, find_group_rule(schema, trim(key%group)) > 0, key%name // ": no group")
        if (.not. allocated(error)) call check(error, key%meaning /= "", key%name // ": no sentence")
        if (.not. allocated(error)) call check(error, len_trim(key%meaning) < len(key%meaning) .and. len_trim(key%words) &
          & < len(key%words) .and. len_trim(key%otherwise) < len(key%otherwise), key%name // ": cut off")
        if (.not. allocated(error)) call check(error, count(schema%keys%group == key%group .and. schema%keys%name == key%name), 1, &
          & key%name // ": twice")
        if (.not. allocated(error)) call check(error, key%kind == text_key .or. key%word == "", key%name // ": a word for a number")
        if (.not. allocated(error)) call check(error, key%kind /= text_key .or. .not. key%default > unset, &
          & key%name // ": a number for a word")
        if (.not. allocated(error) .and. key%default > unset) call check(error, key%default >= key%range%least &
          & .and. key%default <= key%range%most, key%name // ": default out of range")
        if (allocated(error)) return
        words = all_words(key%word)
        allowed = all_words(key%words)
        do k = 1, size(words)
          if (key%words /= "") call check(error, any(allowed == words(k)), key%name // ": default is no word")
          if (allocated(error)) return
        end do
      end associate
    end do
  end subroutine test_records

  subroutine test_words(error)
    type(error_type), allocatable, intent(out) :: error
    type(schema_type) :: schema
    type(gestell_error), allocatable :: failure
    character(len=20), allocatable :: words(:)
    character(len=:), allocatable :: text
    integer :: i, k

    schema = input_schema()
    do i = 1, size(schema%variants)
      associate (variant => schema%variants(i))
        k = find_key_rule(schema, trim(variant%group), trim(variant%key))
        call check(error, k > 0, variant%name // ": no key")
        if (allocated(error)) return
        words = all_words(schema%keys(k)%words)
        call check(error, count(words == variant%name), 1, variant%name // ": no word of its key")
        if (.not. allocated(error)) call check(error, variant%meaning /= "", variant%name // ": no meaning")
        if (.not. allocated(error)) call check(error, len_trim(variant%meaning) < len(variant%meaning), variant%name // ": cut off")
        if (.not. allocated(error)) call check(error, count(schema%variants%group == variant%group .and. schema%variants%key &
          & == variant%key), size(words), variant%key // ": words without a meaning")
        if (allocated(error)) return
      end associate
    end do
    call help_on(schema, "case.tasks", text, failure)
    call check_text(error, text, failure, "'response'      periodic vibration")
    call help_on(schema, "drive", text, failure)
    call check_text(error, text, failure, "held_by='motor'")
  end subroutine test_words

  subroutine test_defaults(error)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(units_type) :: units
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: method
    real(dp) :: x
    integer :: n

    call read_checked("&frame/ &units angle='rad'/ &gravity/" // rest, doc, failure)
    call read_units(doc, units, failure)
    call check(error, trim(units%of(of_angle)%name), "rad")
    if (allocated(error)) return
    call read(group_named(doc, "gravity"), gravity_keys, "direction", x, failure, units)
    call check(error, x, -pi / 2, thr=1.0e-15_dp)
    if (allocated(error)) return
    call read(group_named(doc, "gravity"), gravity_keys, "acceleration", x, failure, units)
    call check(error, x, 9.80665_dp)
    if (allocated(error)) return
    call read(group_named(doc, "response"), response_keys, "points", n, failure)
    call check(error, n, 360)
    if (allocated(error)) return
    call read(group_named(doc, "accuracy"), accuracy_keys(), "method", method, failure)
    call check(error, method, "auto")
    if (allocated(error)) return
    ! given values are used as typed
    call read_checked("&frame/ &units angle='rad'/ &gravity direction=-1/" // rest, doc, failure)
    call read(group_named(doc, "gravity"), gravity_keys, "direction", x, failure, units)
    call check(error, x, -1.0_dp)
  end subroutine test_defaults

  !> c11, c12, c22 in N/mm, c13, c23 in kN, c33 in N m; b in kN s/m and N m s.
  subroutine test_matrix(error)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(units_type) :: units
    type(gestell_error), allocatable :: failure
    real(dp) :: c(3, 3), b(3)

    call read_checked("&frame/ &units stiffness='N/mm', force='kN', damping='kN s/m'/ &foundation stiffness=5,1,2,1,6,3,2,3,7, " &
      & // "damping=1,2,3/" // rest, doc, failure)
    call read_units(doc, units, failure)
    call read(group_named(doc, "foundation"), foundation_keys, "stiffness", c, failure, units)
    call check(error, norm2(c - 1000 * reshape([5.0_dp, 1.0_dp, 2.0_dp, 1.0_dp, 6.0_dp, 3.0_dp, 2.0_dp, 3.0_dp, 0.007_dp], &
      & [3, 3])), 0.0_dp, thr=1.0e-11_dp)
    if (allocated(error)) return
    call read(group_named(doc, "foundation"), foundation_keys, "damping", b, failure, units)
    call check(error, norm2(b - [1000.0_dp, 2000.0_dp, 3.0_dp]), 0.0_dp, thr=1.0e-11_dp)
  end subroutine test_matrix

  !> Values of NIST Special Publication 811 (2008), Appendix B.8, and products of its exact factors.
  subroutine test_other_worlds(error)
    type(error_type), allocatable, intent(out) :: error
    type(unit_type) :: unit
    real(dp), parameter :: inch = 0.0254_dp, lbf = 4.4482216152605_dp
    integer, parameter :: quantity(*) = [of_length, of_mass, of_mass, of_mass, of_inertia, of_inertia, of_inertia, of_inertia, &
      & of_stiffness, of_stiffness, of_force, of_force, of_moment, of_moment, of_damping, of_damping, of_rotary_damping, &
      & of_rotary_damping, of_pressure, of_pressure, of_area, of_area, of_acceleration, of_acceleration, of_acceleration]
    character(len=*), parameter :: names(*) = [character(len=10) :: "ft", "lb", "slug", "lbf s^2/in", "lb in^2", "lb ft^2", &
      & "slug ft^2", "lbf in s^2", "lbf/in", "lbf/ft", "lbf", "kip", "lbf in", "lbf ft", "lbf s/in", "lbf s/ft", "lbf in s", &
      & "lbf ft s", "psi", "kp/cm^2", "in^2", "ft^2", "in/s^2", "ft/s^2", "g"]
    real(dp), parameter :: si(*) = [0.3048_dp, 0.45359237_dp, 14.59390293720636_dp, lbf / inch, 0.45359237_dp * inch**2, &
      & 0.04214011009380480_dp, 1.3558179483314004_dp, 0.1129848290276167_dp, 175.12683524647636_dp, 14.59390293720636_dp, lbf, &
      & 1000 * lbf, 0.1129848290276167_dp, 1.3558179483314004_dp, 175.12683524647636_dp, 14.59390293720636_dp, &
      & 0.1129848290276167_dp, 1.3558179483314004_dp, 6894.757293168361_dp, 98066.5_dp, 6.4516e-4_dp, 0.09290304_dp, inch, &
      & 0.3048_dp, 9.80665_dp]
    integer :: i

    do i = 1, size(si)
      unit = find_unit(quantity(i), trim(names(i)))
      ! one division and the digits of the literal
      call check_that(error, abs(unit%factor / unit%divisor / si(i) - 1), "<=", 3 * epsilon(1.0_dp), trim(names(i)))
      if (allocated(error)) return
    end do
  end subroutine test_other_worlds

  subroutine test_ranges(error)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(gestell_error), allocatable :: failure
    real(dp) :: x
    integer :: n

    call read_checked(rest // "&frame/ &accuracy tolerance=0.1, steps=1048576/ &response points=0, harmonics=8001/", doc, failure)
    call read(group_named(doc, "accuracy"), accuracy_keys(), "tolerance", x, failure)
    call check(error, .not. allocated(failure), "the end of a range belongs to it")
    call read(group_named(doc, "accuracy"), accuracy_keys(), "steps", n, failure)
    if (.not. allocated(error)) call check(error, .not. allocated(failure), "the end of a range of whole numbers")
    call read(group_named(doc, "response"), response_keys, "points", n, failure)
    call check_message(error, failure, "in.nml:1: &response: points = 0: must be at least 1")
    call read(group_named(doc, "response"), response_keys, "harmonics", n, failure)
    call check_message(error, failure, "in.nml:1: &response: harmonics = 8001: must be at most 8000")
    call read_checked(rest // "&frame/ &accuracy tolerance=0.2/", doc, failure)
    call read(group_named(doc, "accuracy"), accuracy_keys(), "tolerance", x, failure)
    call check_message(error, failure, "in.nml:1: &accuracy: tolerance = 0.2: must lie between 1e-15 and 0.1")
    call read_checked(rest // "&frame/ &accuracy tolerance=-0.2/", doc, failure)
    call read(group_named(doc, "accuracy"), accuracy_keys(), "tolerance", x, failure)
    call check_message(error, failure, "in.nml:1: &accuracy: tolerance = -0.2: must be positive")
  end subroutine test_ranges

  subroutine test_help(error)
    type(error_type), allocatable, intent(out) :: error
    type(schema_type) :: schema
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: text
    integer :: i

    schema = input_schema()
    do i = 1, size(schema%groups)
      call help_on(schema, trim(schema%groups(i)%name), text, failure)
      call check_text(error, text, failure, "&" // trim(schema%groups(i)%name))
    end do
    do i = 1, size(schema%keys)
      associate (key => schema%keys(i))
        call help_on(schema, trim(key%group) // "." // trim(key%name), text, failure)
        call check_text(error, text, failure, trim(key%group) // "." // trim(key%name) // ": ")
        if (allocated(error)) return
        call check(error, index(text, "yes: &sweep") > 0 .eqv. (key%kind == real_key .and. any(key%group == &
          & [character(len=20) :: "drive", "joint", "link", "mass_functions", "frame", "support", "foundation", "gravity", &
          & "load", "mechanism", "repeat"])), text)
      end associate
    end do
    call help_on(schema, "groups", text, failure)
    call check_text(error, text, failure, "&sensitivity")
    call help_on(schema, "support(2).stiffness(1)", text, failure)
    call check_text(error, text, failure, "N/m, not negative")
    call help_on(schema, "damping", text, failure)
    call check_text(error, text, failure, "foundation.damping")
    if (.not. allocated(error)) call check(error, find_key(schema%keys, "damping") > 0 .and. index(text, "support.damping") > 0)
  end subroutine test_help

  !> A text with a word in it, in lines of 80 columns.
  subroutine check_text(error, text, failure, word)
    type(error_type), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: text, word
    type(gestell_error), allocatable, intent(in) :: failure
    integer :: first, last

    if (allocated(error)) return
    call check(error, .not. allocated(failure), word // ": no help")
    if (.not. allocated(error)) call check(error, index(text, word) > 0, text)
    first = 1
    do while (first <= len(text))
      last = first + index(text(first:), nl) - 2
      if (.not. allocated(error)) call check(error, last - first + 1 <= 80 .and. last >= first - 1, text(first:last))
      if (allocated(error)) return
      first = last + 2
    end do
  end subroutine check_text

  subroutine test_no_help(error)
    type(error_type), allocatable, intent(out) :: error
    type(schema_type) :: schema
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: text

    schema = input_schema()
    call help_on(schema, "suport", text, failure)
    call check_failure(error, failure, code=wrong_usage)
    call check_message(error, failure, "--help suport: no group or key has this name; did you mean 'support'?")
    call help_on(schema, "stifness", text, failure)
    call check_message(error, failure, "--help stifness: no group or key has this name; did you mean 'stiffness'?")
    call help_on(schema, "suport.stiffness", text, failure)
    call check_message(error, failure, "--help suport.stiffness: unknown group &suport: did you mean &support?")
    call help_on(schema, "support.stifness", text, failure)
    call check_message(error, failure, "--help support.stifness: unknown key 'stifness': did you mean 'stiffness'?")
  end subroutine test_no_help

end module test_keys
