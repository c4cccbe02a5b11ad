!> Checks the content of an input file against the schema.
module gestell_input_schema_check
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_text, only: text
  use gestell_input_namelist_document, only: count_groups, document_type, has
  use gestell_input_schema_merge, only: merge_entries
  use gestell_input_namelist_message, only: input_error, location
  use gestell_input_schema, only: schema_type, find_group_rule
  use gestell_input_namelist_suggest, only: advice, listed
  use gestell_input_wording, only: shown
  implicit none (type, external)
  private

  public :: check_document, normalise, unknown_group

contains

  !> Checks a document. Fails if it contains anything that the schema does not permit, or lacks a required group or key. On success
  !> each key has one entry, with one value for each element.
  pure subroutine check_document(doc, schema, error)
    type(document_type), intent(inout) :: doc
    type(schema_type), intent(in) :: schema
    type(error_type), allocatable, intent(out) :: error
    integer :: i, k

    call normalise(doc, schema, error)
    if (allocated(error)) return
    do i = 1, size(schema%groups)
      if (schema%groups(i)%required .and. count_groups(doc, trim(schema%groups(i)%name)) == 0) then
        call fatal_error(error, doc%file // ": the group &" // trim(schema%groups(i)%name) // " is missing", invalid_input)
        return
      end if
    end do
    do i = 1, size(doc%groups)
      do k = 1, size(schema%keys)
        if (schema%keys(k)%group /= doc%groups(i)%name .or. .not. schema%keys(k)%required) cycle
        if (has(doc%groups(i), trim(schema%keys(k)%name))) cycle
        call input_error(doc%groups(i), trim(schema%keys(k)%name), "must be given", error)
        return
      end do
    end do
  end subroutine check_document

  !> Normalises a document: checks that all groups and keys are known, resolves subscripts and repeat counts, and checks the kinds
  !> of the values. Missing groups and keys are not reported.
  pure subroutine normalise(doc, schema, error, before)
    type(document_type), intent(inout) :: doc
    type(schema_type), intent(in) :: schema
    type(error_type), allocatable, intent(out) :: error
    !> For each group of the schema: number of groups of this name that precede those of this document. If absent, none precede them
    integer, intent(in), optional :: before(:)
    integer :: i

    if (doc%normalised) return
    call number_groups(doc, schema, error, before)
    if (allocated(error)) return
    do i = 1, size(doc%groups)
      call merge_entries(doc%groups(i), schema, error)
      if (allocated(error)) return
    end do
    doc%normalised = .true.
  end subroutine normalise

  !> Gives each group its number among the groups of the same name. Fails if a group is unknown, or if it occurs several times
  !> although the schema permits it only once.
  pure subroutine number_groups(doc, schema, error, before)
    type(document_type), intent(inout) :: doc
    type(schema_type), intent(in) :: schema
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: before(:)
    integer :: occurrences(size(schema%groups)), first(size(schema%groups))
    character(len=:), allocatable :: message
    integer :: i, rule

    occurrences = 0
    if (present(before)) occurrences = before
    first = 0
    do i = 1, size(doc%groups)
      associate (group => doc%groups(i))
        rule = find_group_rule(schema, group%name)
        if (rule == 0) then
          call unknown_group(group%name, schema, message)
          call fatal_error(error, location(doc%file, group%line) // message, invalid_input)
          return
        end if
        occurrences(rule) = occurrences(rule) + 1
        if (first(rule) == 0) first(rule) = i
        if (occurrences(rule) > 1 .and. .not. schema%groups(rule)%repeatable) then
          if (first(rule) == i) call input_error(group, "", "may occur only once, and was already added", error)
          if (first(rule) /= i) call input_error(group, "", "may occur only once (first in line " &
            // text(doc%groups(first(rule))%line) // ")", error)
          return
        end if
        group%number = occurrences(rule)
      end associate
    end do
    do rule = 1, size(occurrences)
      if (occurrences(rule) == 1 .and. first(rule) > 0) doc%groups(first(rule))%number = 0
    end do
  end subroutine number_groups

  !> Composes the message about a group that the schema does not contain.
  pure subroutine unknown_group(name, schema, message)
    character(len=*), intent(in) :: name
    type(schema_type), intent(in) :: schema
    character(len=:), allocatable, intent(out) :: message

    message = "unknown group &" // shown(name) // ": " &
      & // advice(name, (schema%groups%name), "&", "", "allowed are " // listed((schema%groups%name), "&", ""))
  end subroutine unknown_group

end module gestell_input_schema_check
