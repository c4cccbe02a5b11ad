!> The input's groups and keys: nothing else is accepted.
module gestell_input_schema
  implicit none (type, external)
  private

  public :: group_rule, key_rule, schema_type, input_schema, find_group_rule, find_key_rule, &
    allowed_groups, allowed_keys, count_keys

  integer, parameter, public :: real_key = 1
  integer, parameter, public :: integer_key = 2
  integer, parameter, public :: text_key = 3

  !> A group: must it stand in the file, may it repeat.
  type :: group_rule
    character(len=16) :: name
    logical :: required
    logical :: repeatable
  end type group_rule

  !> A key of a group.
  type :: key_rule
    character(len=16) :: group
    character(len=16) :: name
    !> real_key, integer_key or text_key.
    integer :: kind
    !> Number of subscripts: 0 scalar, 1 vector or list, 2 matrix.
    integer :: rank = 0
    !> Fewest and most values.
    integer :: least = 1
    integer :: most = 1
    logical :: required = .false.
    !> First dimension of a matrix.
    integer :: rows = 1
    !> With --set one value stands for all components.
    logical :: alike = .false.
  end type key_rule

  type :: schema_type
    type(group_rule), allocatable :: groups(:)
    type(key_rule), allocatable :: keys(:)
  end type schema_type

  !> Most coefficients of a mass function: mean, cosines and sines of 500 orders.
  integer, parameter :: most_harmonics = 1001

  type(group_rule), parameter :: group_table(*) = [ &
      group_rule("case",       required=.false., repeatable=.false.), &
      group_rule("drive",      required=.true.,  repeatable=.false.), &
      group_rule("units",      required=.false., repeatable=.false.), &
      group_rule("joint",      required=.false., repeatable=.true.), &
      group_rule("link",       required=.false., repeatable=.true.), &
      group_rule("mass_functions", required=.false., repeatable=.false.), &
      group_rule("frame",      required=.true.,  repeatable=.false.), &
      group_rule("support",    required=.false., repeatable=.true.), &
      group_rule("foundation", required=.false., repeatable=.false.), &
      group_rule("gravity",    required=.false., repeatable=.false.), &
      group_rule("probe",      required=.false., repeatable=.true.), &
      group_rule("model",      required=.false., repeatable=.false.), &
      group_rule("accuracy",   required=.false., repeatable=.false.), &
      group_rule("response",   required=.false., repeatable=.false.), &
      group_rule("sweep",      required=.false., repeatable=.true.), &
      group_rule("boundary",   required=.false., repeatable=.false.), &
      group_rule("resonance",  required=.false., repeatable=.false.), &
      group_rule("sensitivity", required=.false., repeatable=.false.)]

  type(key_rule), parameter :: key_table(*) = [ &
      key_rule("case", "title", text_key), &
      key_rule("case", "tasks", text_key, 1, 1, 20), &
      key_rule("drive", "speed_rpm", real_key, required=.true.), &
      key_rule("drive", "held_by", text_key), &
      key_rule("drive", "flywheel_inertia", real_key), &
      key_rule("units", "length", text_key), &
      key_rule("units", "mass", text_key), &
      key_rule("units", "inertia", text_key), &
      key_rule("units", "stiffness", text_key), &
      key_rule("units", "force", text_key), &
      key_rule("units", "moment", text_key), &
      key_rule("units", "damping", text_key), &
      key_rule("units", "rotary_damping", text_key), &
      key_rule("units", "angle", text_key), &
      key_rule("joint", "name", text_key, required=.true.), &
      key_rule("joint", "type", text_key, required=.true.), &
      key_rule("joint", "position", real_key, 1, 2, 2), &
      key_rule("joint", "pivot", text_key), &
      key_rule("joint", "radius", real_key), &
      key_rule("joint", "phase", real_key), &
      key_rule("joint", "ends", text_key, 1, 1, 2), &
      key_rule("joint", "lengths", real_key, 1, 1, 2), &
      key_rule("joint", "branch", integer_key), &
      key_rule("joint", "guide_point", real_key, 1, 2, 2), &
      key_rule("joint", "guide_angle", real_key), &
      key_rule("joint", "guide", text_key, 1, 2, 2), &
      key_rule("joint", "guide2_point", real_key, 1, 2, 2), &
      key_rule("joint", "guide2_angle", real_key), &
      key_rule("joint", "guide2", text_key, 1, 2, 2), &
      key_rule("joint", "slot_angle", real_key), &
      key_rule("joint", "offset", real_key, 1, 2, 2), &
      key_rule("link", "name", text_key, required=.true.), &
      key_rule("link", "from", text_key, required=.true.), &
      key_rule("link", "to", text_key), &
      key_rule("link", "mass", real_key), &
      key_rule("link", "inertia", real_key), &
      key_rule("link", "center", real_key, 1, 2, 2), &
      key_rule("mass_functions", "mass", real_key), &
      key_rule("mass_functions", "inertia", real_key), &
      key_rule("mass_functions", "a1", real_key, 1, 1, most_harmonics), &
      key_rule("mass_functions", "a2", real_key, 1, 1, most_harmonics), &
      key_rule("mass_functions", "a3", real_key, 1, 1, most_harmonics), &
      key_rule("mass_functions", "moment", real_key, 1, 1, most_harmonics), &
      key_rule("mass_functions", "energy", real_key, 1, 1, most_harmonics), &
      key_rule("frame", "mass", real_key), &
      key_rule("frame", "inertia", real_key), &
      key_rule("frame", "origin", real_key, 1, 2, 2), &
      key_rule("frame", "dof", text_key, 1, 1, 3), &
      key_rule("support", "position", real_key, 1, 2, 2), &
      key_rule("support", "stiffness", real_key, 1, 2, 2, alike=.true.), &
      key_rule("support", "damping", real_key, 1, 2, 2, alike=.true.), &
      key_rule("support", "angle", real_key), &
      key_rule("support", "axes", text_key), &
      key_rule("foundation", "stiffness", real_key, 2, 9, 9, rows=3), &
      key_rule("foundation", "damping", real_key, 1, 3, 3), &
      key_rule("gravity", "acceleration", real_key), &
      key_rule("gravity", "direction", real_key), &
      key_rule("probe", "name", text_key, required=.true.), &
      key_rule("probe", "position", real_key, 1, 2, 2, required=.true.), &
      key_rule("probe", "limit_mm_s", real_key), &
      key_rule("probe", "band_hz", real_key, 1, 2, 2), &
      key_rule("model", "coefficients", text_key), &
      key_rule("model", "frame", text_key), &
      key_rule("model", "vibrations", text_key), &
      key_rule("accuracy", "tolerance", real_key), &
      key_rule("accuracy", "method", text_key), &
      key_rule("accuracy", "steps", integer_key), &
      key_rule("response", "points", integer_key), &
      key_rule("response", "harmonics", integer_key), &
      key_rule("sweep", "parameter", text_key), &
      key_rule("sweep", "from", real_key), &
      key_rule("sweep", "to", real_key), &
      key_rule("sweep", "count", integer_key), &
      key_rule("sweep", "spacing", text_key), &
      key_rule("sweep", "engine", text_key), &
      key_rule("sweep", "columns", text_key, 1, 1, 7), &
      key_rule("boundary", "tolerance", real_key), &
      key_rule("resonance", "quantities", text_key, 1, 1, 20), &
      key_rule("resonance", "orders", integer_key), &
      key_rule("sensitivity", "quantities", text_key, 1, 1, 20), &
      key_rule("sensitivity", "parameters", text_key, 1, 1, 40)]

contains

  !> The schema of the input file.
  pure function input_schema() result(schema)
    type(schema_type) :: schema

    schema = schema_type(group_table, key_table)
  end function input_schema

  !> Index of a group's rule, zero where there is no such group.
  pure integer function find_group_rule(schema, name) result(i)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: name

    do i = 1, size(schema%groups)
      if (schema%groups(i)%name == name) return
    end do
    i = 0
  end function find_group_rule

  !> Index of a key's rule, zero where the group has no such key.
  pure integer function find_key_rule(schema, group, name) result(i)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group, name

    do i = 1, size(schema%keys)
      if (schema%keys(i)%group == group .and. schema%keys(i)%name == name) return
    end do
    i = 0
  end function find_key_rule

  !> The names of all groups.
  pure function allowed_groups(schema) result(names)
    type(schema_type), intent(in) :: schema
    character(len=16) :: names(size(schema%groups))
    integer :: i

    do i = 1, size(names)
      names(i) = schema%groups(i)%name
    end do
  end function allowed_groups

  !> The keys of a group.
  pure function allowed_keys(schema, group) result(names)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group
    character(len=16) :: names(count_keys(schema, group))
    integer :: i, n

    n = 0
    do i = 1, size(schema%keys)
      if (schema%keys(i)%group /= group) cycle
      n = n + 1
      names(n) = schema%keys(i)%name
    end do
  end function allowed_keys

  !> Number of keys that a group knows.
  pure integer function count_keys(schema, group) result(n)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group
    integer :: i

    n = 0
    do i = 1, size(schema%keys)
      if (schema%keys(i)%group == group) n = n + 1
    end do
  end function count_keys

end module gestell_input_schema
