!> The groups and keys of an input: what is not among them is refused.
module gestell_input_schema
  use gestell_base_key, only: key_type
  implicit none (type, external)
  private

  public :: find_group_rule, find_key_rule, names_of_keys

  !> What a group is about: the task, the frame with its drive and mounts, the mechanism. Numbers of the last two can run.
  integer, parameter, public :: option_group = 0, frame_group = 1, mechanism_group = 2

  !> A group in a sentence: must it stand in the file, may it repeat, what is it about.
  type, public :: group_rule
    character(len=16) :: name
    character(len=160) :: meaning
    logical :: required = .false., repeatable = .false.
    integer :: about = option_group
  end type group_rule

  !> What a word of a key says of its group: which of the other keys it has, in words.
  type, public :: variant_type
    character(len=16) :: group, key, name
    character(len=320) :: meaning
    character(len=200) :: keys = ""
  end type variant_type

  type, public :: schema_type
    type(group_rule), allocatable :: groups(:)
    type(key_type), allocatable :: keys(:)
    type(variant_type), allocatable :: variants(:)
  contains
    procedure :: add
  end type schema_type

contains

  !> A further group with its keys.
  pure subroutine add(self, group, keys)
    class(schema_type), intent(inout) :: self
    type(group_rule), intent(in) :: group
    type(key_type), intent(in) :: keys(:)

    self%groups = [self%groups, group]
    self%keys = [self%keys, keys]
  end subroutine add

  !> Index of a group's rule, zero where there is no such group.
  pure integer function find_group_rule(schema, name) result(i)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: name

    i = findloc(schema%groups%name == name, .true., dim=1)
  end function find_group_rule

  !> Index of a key's rule, zero where the group has no such key.
  pure integer function find_key_rule(schema, group, name) result(i)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group, name

    i = findloc(schema%keys%group == group .and. schema%keys%name == name, .true., dim=1)
  end function find_key_rule

  !> The names of a group's keys.
  pure function names_of_keys(schema, group) result(names)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: group
    character(len=16), allocatable :: names(:)

    names = pack((schema%keys%name), schema%keys%group == group)
  end function names_of_keys

end module gestell_input_schema
