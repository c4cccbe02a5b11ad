!> Defines the schema: the groups and keys that an input may contain. Everything else is refused.
module gestell_input_schema
  use gestell_base_key, only: key_type
  implicit none (type, external)
  private

  public :: find_group_rule, find_key_rule, names_of_keys

  !> What a group describes: options of the tasks (`option_group`), frame, drive and mounts (`frame_group`), or the mechanism
  !> (`mechanism_group`). A sweep may vary only numbers of the latter two.
  integer, parameter, public :: option_group = 0, frame_group = 1, mechanism_group = 2

  !> Rule of a group
  type, public :: group_rule
    !> Name of the group without &
    character(len=16) :: name
    !> Describes the group in one sentence
    character(len=160) :: meaning
    !> `required`: the file must contain the group; `repeatable`: it may occur several times
    logical :: required = .false., repeatable = .false.
    !> option_group, frame_group or mechanism_group
    integer :: subject = option_group
  end type group_rule

  !> Describes one allowed word of a key, such as a joint's type.
  type, public :: variant_type
    !> `name`: the word; `group`, `key`: where it is allowed
    character(len=16) :: group, key, name
    character(len=320) :: meaning
    !> Keys of the group that apply to this word, as a list for the manual
    character(len=200) :: keys = ""
  end type variant_type

  !> All groups, keys and variants of the input.
  type, public :: schema_type
    type(group_rule), allocatable :: groups(:)
    type(key_type), allocatable :: keys(:)
    type(variant_type), allocatable :: variants(:)
  contains
    procedure :: add
  end type schema_type

contains

  !> Adds a group and its keys.
  pure subroutine add(self, group, keys)
    class(schema_type), intent(inout) :: self
    type(group_rule), intent(in) :: group
    type(key_type), intent(in) :: keys(:)

    self%groups = [self%groups, group]
    self%keys = [self%keys, keys]
  end subroutine add

  !> Index of the rule for the group with this name; 0 if there is no such group.
  pure integer function find_group_rule(schema, name) result(i)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: name

    i = findloc(schema%groups%name == name, .true., dim=1)
  end function find_group_rule

  !> Index of a key's record; 0 if the group has no such key.
  pure integer function find_key_rule(schema, group, name) result(i)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group, name

    i = findloc(schema%keys%group == group .and. schema%keys%name == name, .true., dim=1)
  end function find_key_rule

  !> Names of the keys of a group.
  pure function names_of_keys(schema, group) result(names)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group
    character(len=16), allocatable :: names(:)

    names = pack((schema%keys%name), schema%keys%group == group)
  end function names_of_keys

end module gestell_input_schema
