!> Defines the schema, which lists the groups and keys that an input may contain. Any other group or key is an error.
module gestell_input_schema
  use gestell_base_key, only: key_type
  implicit none (type, external)
  private

  public :: find_group_rule, find_key_rule

  !> Part of the input that a group describes: options of the tasks (`option_group`), frame, drive and mounts (`frame_group`), or
  !> the mechanism (`mechanism_group`). Sweeps can vary only numbers of a `frame_group` or a `mechanism_group`.
  integer, parameter, public :: option_group = 0, frame_group = 1, mechanism_group = 2

  !> Rule of a group
  type, public :: group_rule
    !> Name of the group, without the character &
    character(len=16) :: name
    !> Meaning of the group in one sentence
    character(len=160) :: meaning
    !> `required`: true if every input must contain the group. `repeatable`: true if the group may occur several times
    logical :: required = .false., repeatable = .false.
    !> option_group, frame_group or mechanism_group
    integer :: subject = option_group
  end type group_rule

  !> Describes one of the words that a key accepts, such as the joint type RRR.
  type, public :: variant_type
    !> `name`: the word. `group`, `key`: group and key that accept this word
    character(len=16) :: group, key
    character(len=20) :: name
    character(len=320) :: meaning
    !> Keys of the group that apply to this word, as a list in the manual
    character(len=240) :: keys = ""
  end type variant_type

  !> All groups and keys of the input, and descriptions of the words that keys accept.
  type, public :: schema_type
    type(group_rule), allocatable :: groups(:)
    type(key_type), allocatable :: keys(:)
    type(variant_type), allocatable :: variants(:)
  contains
    procedure :: add
  end type schema_type

contains

  !> Adds a group and its keys to the schema.
  pure subroutine add(self, group, keys)
    class(schema_type), intent(inout) :: self
    type(group_rule), intent(in) :: group
    type(key_type), intent(in) :: keys(:)

    self%groups = [self%groups, group]
    self%keys = [self%keys, keys]
  end subroutine add

  !> Index in the schema of the group called `name`; 0 if there is none.
  pure integer function find_group_rule(schema, name) result(i)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: name

    i = findloc(schema%groups%name == name, .true., dim=1)
  end function find_group_rule

  !> Index in the schema of the key called `name` of a group; 0 if the group has no such key.
  pure integer function find_key_rule(schema, group, name) result(i)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group, name

    i = findloc(schema%keys%group == group .and. schema%keys%name == name, .true., dim=1)
  end function find_key_rule

end module gestell_input_schema
