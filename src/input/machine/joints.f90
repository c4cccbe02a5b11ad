!> Reads the joints of an input file; the keys of a joint depend on its type.
module gestell_input_machine_joints
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type
  use gestell_base_key, only: all_words, find_key, joined, key_type, text_key, unset
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: group_names, group_type, has, name_of
  use gestell_input_machine_mechanisms, only: membership_key
  use gestell_input_namelist_message, only: locate_in_group, input_error
  use gestell_input_namelist_suggest, only: listed, suggestion
  use gestell_input_schema, only: variant_type
  use gestell_input_schema_read, only: count_values, read
  use gestell_input_schema_units, only: units_type
  use gestell_model_joints_data, only: joint_data_type
  use gestell_model_joints_joint, only: form_type, joint_type
  use gestell_model_joints_placement, only: placement_type
  use gestell_model_joints_types_registry, only: joint_forms, new_joint
  use gestell_model_linkage, only: linkage_type
  implicit none (type, external)
  private

  public :: check_joint_references, joint_keys, joint_variants, read_joint, type_of_joint

  type(key_type), parameter :: common_keys(*) = [ &
    & key_type("joint", "name", text_key, "name by which other groups refer to the joint", required=.true.), &
    & key_type("joint", "type", text_key, "type of the joint", required=.true.), membership_key(1)]

  type(variant_type), parameter :: law_variants(*) = [ &
    & variant_type("joint", "law", "dwell", "rest"), &
    & variant_type("joint", "law", "harmonic", "f=(1-cos pi z)/2; the acceleration jumps next to a dwell"), &
    & variant_type("joint", "law", "polynomial_345", "f=10z^3-15z^4+6z^5"), &
    & variant_type("joint", "law", "polynomial_4567", "f=35z^4-84z^5+70z^6-20z^7"), &
    & variant_type("joint", "law", "modified_sine", "sine-shaped acceleration, steeper in the first and last eighth"), &
    & variant_type("joint", "law", "modified_trapezoid", "trapezoidal acceleration with sinusoidal edges")]

contains

  !> Records of the keys of all joint types. Keys of the same name are merged to one record, which permits the numbers of values
  !> that any of the joint types permits.
  function joint_keys() result(keys)
    type(key_type), allocatable :: keys(:)
    type(form_type), allocatable :: forms(:)
    integer :: f, i, k

    call joint_forms(forms)
    keys = common_keys
    keys(2)%words = joined((forms%name))
    do f = 1, size(forms)
      do i = 1, size(forms(f)%keys)
        associate (key => forms(f)%keys(i))
          k = find_key(keys, trim(key%name))
          if (k == 0) then
            keys = [keys, key]
            keys(size(keys))%required = .false.
            if (.not. key%default > unset .and. key%otherwise == "") keys(size(keys))%otherwise = types_requiring(forms, key)
          else
            keys(k)%least = min(keys(k)%least, key%least)
            keys(k)%most = max(keys(k)%most, key%most)
          end if
        end associate
      end do
    end do
  end function joint_keys

  !> Phrase for a message that lists the joint types that require `key`.
  pure function types_requiring(forms, key) result(words)
    type(form_type), intent(in) :: forms(:)
    type(key_type), intent(in) :: key
    character(len=len(key%otherwise)) :: words
    integer :: f, k

    words = "required by"
    do f = 1, size(forms)
      k = find_key(forms(f)%keys, trim(key%name))
      if (k == 0) cycle
      if (.not. forms(f)%keys(k)%required) cycle
      if (words /= "required by") words = trim(words) // ","
      words = trim(words) // " `'" // trim(forms(f)%name) // "'`"
    end do
  end function types_requiring

  !> Descriptions of all joint types and their keys, and of the laws of cams, for the manual.
  function joint_variants() result(variants)
    type(variant_type), allocatable :: variants(:)
    type(form_type), allocatable :: forms(:)
    logical :: begins_optional
    integer :: f, i

    call joint_forms(forms)
    allocate(variants(size(forms)))
    do f = 1, size(forms)
      variants(f) = variant_type("joint", "type", forms(f)%name, forms(f)%meaning)
      do i = 1, size(forms(f)%keys)
        associate (key => forms(f)%keys(i), keys => variants(f)%keys)
          begins_optional = .not. key%required .and. all(forms(f)%keys(:i - 1)%required)
          if (i > 1) keys = trim(keys) // merge(";", ",", begins_optional)
          if (begins_optional) keys = trim(keys) // " optional:"
          keys = trim(keys) // " `" // trim(key%name) // "`"
          if (key%most > key%least) then
            keys = trim(keys) // " (up to " // text(key%most) // ")"
          else if (key%most > 1) then
            keys = trim(keys) // " (" // text(key%most) // ")"
          end if
          keys = adjustl(keys)
        end associate
      end do
    end do
    variants = [variants, law_variants]
  end function joint_variants

  !> Finds the definition of the type of a joint. Fails if the type is unknown.
  subroutine type_of_joint(group, forms, number, error)
    type(group_type), intent(in) :: group
    !> Definitions of all joint types
    type(form_type), intent(in) :: forms(:)
    !> Index in `forms` of the joint's type
    integer, intent(out) :: number
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: type

    call read(group, common_keys, "type", type, error)
    if (allocated(error)) return
    number = findloc(forms%name == type, .true., dim=1)
    if (number == 0) call input_error(group, "type", "unknown" // suggestion(type, (forms%name)), error)
  end subroutine type_of_joint

  !> Reads joint `i`, moves it to the position of its mechanism and adds it to the linkage. Fails if a key does not suit the
  !> joint's type, if a key refers to a joint that is unknown or listed later, or if a value is out of range.
  subroutine read_joint(joints, names, i, forms, units, placement, linkage, error)
    !> Groups of all joints in the input
    type(group_type), intent(in) :: joints(:)
    !> Their names
    type(dictionary_type), intent(in) :: names
    integer, intent(in) :: i
    !> Definitions of all joint types
    type(form_type), intent(in) :: forms(:)
    !> Units of the input
    type(units_type), intent(in) :: units
    !> Position of the mechanism to which the joint belongs
    type(placement_type), intent(in) :: placement
    !> The linkage; on entry it contains all joints listed before joint `i`
    type(linkage_type), intent(inout) :: linkage
    type(error_type), allocatable, intent(out) :: error
    class(joint_type), allocatable :: joint
    type(joint_data_type) :: data
    integer :: number, k

    call type_of_joint(joints(i), forms, number, error)
    if (.not. allocated(error)) call check_keys(joints(i), forms(number), error)
    if (allocated(error)) return
    do k = 1, size(forms(number)%keys)
      call read_datum(joints, names, i, forms(number)%keys(k:k), units, data, error)
      if (allocated(error)) return
    end do
    call new_joint(number, joint)
    call joint%define(data)
    if (data%reason /= "") then
      call input_error(joints(i), trim(data%key), trim(data%reason), error)
    else
      call joint%move(placement)
      call linkage%add_joint(name_of(joints(i)), joint, error)
      if (allocated(error)) call locate_in_group(joints(i), error)
    end if
  end subroutine read_joint

  !> Reads one key of joint `i`, or the default of this key, and adds it to the joint's data. Fails if joints named by the key are
  !> equal or are not listed before joint `i`.
  subroutine read_datum(joints, names, i, key, units, data, error)
    type(group_type), intent(in) :: joints(:)
    type(dictionary_type), intent(in) :: names
    integer, intent(in) :: i
    type(key_type), intent(in) :: key(1)
    type(units_type), intent(in) :: units
    type(joint_data_type), intent(inout) :: data
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: words(:)
    character(len=:), allocatable :: name
    real(dp), allocatable :: numbers(:)
    integer :: n

    name = trim(key(1)%name)
    if (key(1)%kind /= text_key) then
      if (.not. (has(joints(i), name) .or. key(1)%default > unset)) return
      n = key(1)%most
      if (key(1)%least < n) n = max(1, count_values(joints(i), name))
      allocate(numbers(n))
      call read(joints(i), key, name, numbers, error, units)
      if (.not. allocated(error)) call data%add(name, numbers=numbers)
    else if (has(joints(i), name)) then
      call read(joints(i), key, name, words, error)
      if (allocated(error)) return
      if (key(1)%words /= "") then
        call data%add(name, joints=[(findloc(all_words(key(1)%words) == words(n), .true., dim=1), n = 1, size(words))])
        return
      end if
      n = size(words)
      if (n /= key(1)%most) then
        call input_error(joints(i), name, "must name " // trim(merge("1 joint ", "2 joints", key(1)%most == 1)), error)
        return
      end if
      call check_joint_references(joints(i), name, words, joints, names, i - 1, error)
      if (allocated(error)) return
      if (any([(words(n) == words(:n - 1), n = 1, size(words))])) then
        call input_error(joints(i), name, "must name 2 different joints", error)
      else
        call data%add(name, joints=[(names%position(words(n)), n = 1, size(words))])
      end if
    end if
  end subroutine read_datum

  !> Fails if the group of a joint lacks a key that its type requires, or contains a key that its type does not have.
  subroutine check_keys(group, form, error)
    type(group_type), intent(in) :: group
    type(form_type), intent(in) :: form
    type(error_type), allocatable, intent(out) :: error
    integer :: i, k

    do i = 1, size(group%entries)
      associate (key => group%entries(i)%key)
        if (key == "name" .or. key == "type" .or. key == "mechanism" .or. find_key(form%keys, key) > 0) cycle
        call input_error(group, key, "is not a key of a joint of type '" // trim(form%name) // "'; its keys are " &
          & // listed((form%keys%name), "", ""), error)
        return
      end associate
    end do
    do k = 1, size(form%keys)
      if (.not. form%keys(k)%required .or. has(group, trim(form%keys(k)%name))) cycle
      call input_error(group, "", "a joint of type '" // trim(form%name) // "' needs the key '" // trim(form%keys(k)%name) &
        & // "'", error)
      return
    end do
  end subroutine check_keys

  !> Fails if a key refers to a joint that is unknown, or that is not among the first `allowed_count` joints.
  subroutine check_joint_references(group, key, references, joints, names, allowed_count, error)
    !> `group`: the group whose key refers to joints. `joints`: groups of all joints in the input
    type(group_type), intent(in) :: group, joints(:)
    !> `key`: name of the key that refers to joints. `references`: names of the joints to which it refers
    character(len=*), intent(in) :: key, references(:)
    !> Names of all joints
    type(dictionary_type), intent(in) :: names
    !> The key may refer only to the first `allowed_count` joints
    integer, intent(in) :: allowed_count
    type(error_type), allocatable, intent(out) :: error
    integer :: i, number

    do i = 1, size(references)
      number = names%position(references(i))
      if (number == 0) then
        call input_error(group, key, "there is no joint '" // trim(references(i)) // "'" // &
          & suggestion(trim(references(i)), group_names(joints(:allowed_count))), error)
      else if (number == allowed_count + 1) then
        call input_error(group, key, "a joint cannot refer to itself", error)
      else if (number > allowed_count .and. builds_on(joints, number, allowed_count + 1)) then
        call input_error(group, key, "joint '" // trim(references(i)) // "' in line " // text(joints(number)%line) &
          & // " refers to '" &
          & // name_of(group) // "' in turn: joints that can only be located together (Assur groups of class III) are not " &
          & // "supported", error)
      else if (number > allowed_count) then
        call input_error(group, key, "joint '" // trim(references(i)) // "' comes later, in line " // text(joints(number)%line) &
          & // ": list it before this joint", error)
      end if
      if (allocated(error)) return
    end do
  end subroutine check_joint_references

  !> True if the position of joint `i` depends on joint `target`, directly or through other joints. False if joint `i` or joint
  !> `target` does not exist.
  pure logical function builds_on(joints, i, target)
    type(group_type), intent(in) :: joints(:)
    integer, intent(in) :: i, target
    logical :: found(size(joints)), done(size(joints))
    integer :: e, k, v

    builds_on = .false.
    if (i < 1 .or. target > size(joints)) return
    found = [(k == i, k = 1, size(joints))]
    done = .false.
    do while (any(found .and. .not. done))
      k = findloc(found .and. .not. done, .true., dim=1)
      done(k) = .true.
      do e = 1, size(joints(k)%entries)
        associate (entry => joints(k)%entries(e))
          if (any(entry%key == [character(len=9) :: "name", "type", "mechanism", "law"])) cycle
          do v = 1, size(entry%values)
            if (entry%values(v)%quoted) found = found .or. group_names(joints) == entry%values(v)%text
          end do
        end associate
      end do
    end do
    builds_on = found(target)
  end function builds_on

end module gestell_input_machine_joints
