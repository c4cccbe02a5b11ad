!> Writes the text of an input again after its values have been changed.
module gestell_input_schema_rewrite
  use gestell_base_error, only: error_type
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_text, only: concise, either, newline
  use gestell_input_namelist, only: parse_document
  use gestell_input_namelist_document, only: document_type, entry_type, find_entry, group_type
  use gestell_input_namelist_edit, only: set_entry, spell_entry
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_check, only: normalise
  implicit none (type, external)
  private

  public :: rewrite

contains

  !> Returns the text from which a document was read, with the document's present values. Comments and blanks remain as they are.
  !> Groups that the text does not contain follow at its end. Fails if the text from which the document was read is invalid.
  pure subroutine rewrite(document, schema, text, error, author)
    type(document_type), intent(in) :: document
    !> Groups and keys that are allowed in the input
    type(schema_type), intent(in) :: schema
    character(len=:), allocatable, intent(out) :: text
    type(error_type), allocatable, intent(out) :: error
    !> Who has changed the values. If present, comments in the text mark the changes and state the old values
    character(len=*), intent(in), optional :: author
    type(document_type) :: original, typed
    type(entry_type) :: named
    type(growing_text_type) :: added
    character(len=:), allocatable :: new, old
    integer :: i, k, e

    text = ""
    if (allocated(document%text)) text = document%text
    if (text == "") then
      allocate(original%groups(0))
    else
      call parse_document(text, document%file, original, error)
      if (.not. allocated(error)) typed = original
      if (.not. allocated(error)) call normalise(original, schema, error)
      if (allocated(error)) return
    end if
    do i = 1, size(original%groups)
      do k = 1, size(document%groups(i)%entries)
        associate (entry => document%groups(i)%entries(k))
          e = find_entry(original%groups(i), entry%key)
          if (e > 0) then
            call name_as_typed(original%groups(i)%entries(e), typed%groups(i), schema, named)
            call spell_entry(named, old)
            call name_as_typed(entry, typed%groups(i), schema, named)
            call spell_entry(named, new)
            if (new /= old) call set_entry(text, i, named, either("was " // old, "", present(author)))
          else
            call set_entry(text, i, entry, either(entry%key // " was missing", "", present(author)))
          end if
        end associate
      end do
    end do
    do i = size(original%groups) + 1, size(document%groups)
      call added%append("&" // document%groups(i)%name)
      do k = 1, size(document%groups(i)%entries)
        call spell_entry(document%groups(i)%entries(k), new)
        call added%append(either(", ", " ", k > 1) // new)
      end do
      call added%append(" /")
      if (present(author)) call added%append("   ! added by " // author)
      call added%append(newline)
    end do
    if (size(document%groups) > size(original%groups) .and. text /= "") then
      if (text(len(text):) /= newline) text = text // newline
    end if
    text = text // added%whole()

  end subroutine rewrite

  !> Gives an entry that name of its key, and the values in that unit, which the group of the text uses.
  pure subroutine name_as_typed(entry, group, schema, named)
    type(entry_type), intent(in) :: entry
    !> The group in which the entry stands, as typed
    type(group_type), intent(in) :: group
    type(schema_type), intent(in) :: schema
    type(entry_type), intent(out) :: named
    integer :: i, k

    named = entry
    do k = 1, size(schema%keys)
      associate (rule => schema%keys(k))
        if (rule%group /= group%name .or. rule%same_as /= entry%key) cycle
        if (find_entry(group, trim(rule%name)) == 0) cycle
        named%key = trim(rule%name)
        do i = 1, size(entry%values)
          named%values(i)%text = concise(entry%values(i)%number / rule%factor, 17)
        end do
      end associate
    end do
  end subroutine name_as_typed

end module gestell_input_schema_rewrite
