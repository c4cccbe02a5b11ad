!> Finds the groups, the key and the element of a document that a path such as support(2).stiffness(1) denotes.
module gestell_input_schema_locate
  use gestell_base_error, only: error_type, fatal_error, invalid_input, wrong_usage
  use gestell_input_schema_check, only: unknown_group
  use gestell_base_text, only: text
  use gestell_input_namelist_document, only: document_type, group_names, groups_named, has, indices_named, name_of
  use gestell_input_namelist_number, only: is_digits, read_integer
  use gestell_input_schema_rule, only: element_of, describe_extent, subscript_words, unknown_key
  use gestell_input_schema, only: schema_type, find_group_rule, find_key_rule
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_input_wording, only: shown, lower, without_quotes
  implicit none (type, external)
  private

  public :: find_groups, find_target

  !> The part of a document that a path denotes
  type, public :: target_type
    !> Indices in the document of the groups that the path denotes; empty if the group does not exist yet and must be added
    integer, allocatable :: groups(:)
    character(len=:), allocatable :: key
    !> Index in the schema of the record of the key that the path denotes
    integer :: rule = 0
    !> Index of the vector's or matrix's element that the path denotes, counted column by column; 0 if the path denotes all
    !> elements
    integer :: element = 0
  end type target_type

  !> The parts of a path, as the user typed them
  type :: path_type
    character(len=:), allocatable :: group
    !> Name or number of a group, such as B in joint(B).lengths
    character(len=:), allocatable :: selector
    character(len=:), allocatable :: key
    integer, allocatable :: subscript(:)
  end type path_type

contains

  !> Finds the groups, the key and the element that a path denotes. Fails if the path is malformed or denotes nothing.
  pure subroutine find_target(doc, schema, text, prefix, target, error)
    !> Normalised document (see `normalise`)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    !> `text`: the path. `prefix`: text with which error messages begin
    character(len=*), intent(in) :: text, prefix
    type(target_type), intent(out) :: target
    type(error_type), allocatable, intent(out) :: error
    type(path_type) :: path
    character(len=:), allocatable :: reason
    integer :: group

    call read_path(trim(adjustl(text)), path, reason)
    if (reason /= "") call fatal_error(error, prefix // reason, wrong_usage)
    if (allocated(error)) return
    target%key = path%key
    group = find_group_rule(schema, path%group)
    target%rule = find_key_rule(schema, path%group, path%key)
    if (group == 0) then
      call unknown_group(path%group, schema, reason)
    else if (target%rule == 0) then
      call unknown_key(path%key, schema, path%group, reason)
    else if (schema%keys(target%rule)%same_as /= "") then
      reason = "use " // path%group // "." // trim(schema%keys(target%rule)%same_as) // " instead of " // path%key
    else if (size(path%subscript) > 0) then
      associate (rule => schema%keys(target%rule))
        target%element = element_of(path%subscript, rule)
        if (size(path%subscript) /= rule%rank) then
          reason = path%key // " " // subscript_words(rule)
        else if (target%element == 0) then
          call describe_extent(rule, reason)
          reason = path%key // ": " // reason
        end if
      end associate
    end if
    if (reason == "") call choose_groups(doc, path, schema%groups(group)%repeatable, target%groups, reason)
    if (reason /= "") call fatal_error(error, prefix // reason, invalid_input)
  end subroutine find_target

  !> Finds the groups that a path without key denotes, such as support(2) or probe. Fails if the path is malformed or denotes no
  !> group.
  pure subroutine find_groups(doc, schema, text, groups, error)
    !> Normalised document (see `normalise`)
    type(document_type), intent(in) :: doc
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: text
    !> Indices of the groups in the document, in ascending order
    integer, allocatable, intent(out) :: groups(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: some_key = "key"
    type(path_type) :: path
    character(len=:), allocatable :: reason
    integer :: group

    call read_path(trim(adjustl(text)) // "." // some_key, path, reason)
    if (reason == "") then
      if (path%key /= some_key) reason = "the path"
    end if
    if (reason /= "") then
      call fatal_error(error, shown(text) // ": the path must be GROUP or GROUP(NAME), such as support(2)", wrong_usage)
      return
    end if
    group = find_group_rule(schema, path%group)
    if (group == 0) then
      call unknown_group(path%group, schema, reason)
    else
      call choose_groups(doc, path, schema%groups(group)%repeatable, groups, reason)
      if (reason == "" .and. size(groups) == 0) reason = "the input has no &" // path%group
    end if
    if (reason /= "") call fatal_error(error, shown(text) // ": " // reason, invalid_input)
  end subroutine find_groups

  !> Selects the groups that a path denotes: one group by its name or number, or all groups. If this fails, `reason` says why;
  !> otherwise `reason` is empty.
  pure subroutine choose_groups(doc, path, repeatable, chosen, reason)
    type(document_type), intent(in) :: doc
    type(path_type), intent(in) :: path
    logical, intent(in) :: repeatable
    integer, allocatable, intent(out) :: chosen(:)
    character(len=:), allocatable, intent(out) :: reason
    integer :: i, number

    reason = ""
    chosen = indices_named(doc, path%group)
    if (.not. repeatable) then
      if (allocated(path%selector)) reason = "there is only one &" // path%group // ": write " // path%group // "." // path%key
      return
    end if
    if (size(chosen) == 0) then
      reason = "the input has no &" // path%group
      return
    end if
    if (.not. allocated(path%selector)) return

    do i = 1, size(chosen)
      if (.not. has(doc%groups(chosen(i)), "name") .or. path%selector == "") cycle
      if (name_of(doc%groups(chosen(i))) == path%selector) then
        chosen = chosen(i:i)
        return
      end if
    end do
    if (is_digits(path%selector)) then
      call read_integer(path%selector, number, reason)
      if (reason == "" .and. number >= 1 .and. number <= size(chosen)) then
        chosen = chosen(number:number)
        return
      end if
    end if
    if (has(doc%groups(chosen(1)), "name") .and. .not. is_digits(path%selector)) then
      reason = "unknown " // path%group // " '" // shown(path%selector) // "'" &
        // suggestion(path%selector, group_names(groups_named(doc, path%group)))
    else
      reason = "there is no &" // path%group // " " // shown(path%selector) // ": the groups are numbered from 1 to " &
        // text(size(chosen))
    end if
  end subroutine choose_groups

  !> Splits a path into its parts. If the path is malformed, `reason` says why; otherwise `reason` is empty.
  pure subroutine read_path(text, path, reason)
    character(len=*), intent(in) :: text
    type(path_type), intent(out) :: path
    character(len=:), allocatable, intent(out) :: reason
    character(len=:), allocatable :: rest, number_reason
    integer :: i, comma, number

    reason = "the path must be GROUP.KEY, GROUP(NAME).KEY or GROUP.KEY(INDEX), such as drive.speed_rpm"
    allocate(path%subscript(0))
    i = scan(text, "(.")
    if (i <= 1) return
    path%group = lower(trim(text(:i-1)))
    rest = text(i:)
    if (rest(1:1) == "(") then
      i = index(rest, ").")
      if (i == 0) return
      path%selector = without_quotes(trim(adjustl(rest(2:i-1))))
      rest = rest(i+1:)
    end if
    rest = rest(2:)
    i = index(rest, "(")
    if (i == 0) i = len(rest) + 1
    path%key = lower(trim(adjustl(rest(:i-1))))
    if (path%key == "") return
    rest = rest(i:)
    do while (rest /= "")
      comma = scan(rest(2:), ",)") + 1
      if (comma == 1) return
      call read_integer(trim(adjustl(rest(2:comma-1))), number, number_reason)
      if (number_reason /= "" .or. size(path%subscript) == 2) return
      path%subscript = [path%subscript, number]
      rest = rest(comma:)
      if (rest == ")") exit
      if (rest(1:1) == ")") return
    end do
    reason = ""
  end subroutine read_path

end module gestell_input_schema_locate
