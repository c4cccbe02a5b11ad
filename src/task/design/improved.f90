!> Writes the input file of the improved machine: the original text, in which the numbers changed by the design are replaced.
module gestell_task_design_improved
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline
  use gestell_input_namelist, only: parse_document
  use gestell_input_namelist_document, only: document_type, entry_type, find_entry
  use gestell_input_namelist_edit, only: set_entry, entry_text
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_check, only: check_document
  use gestell_input_schema_path, only: set_path_text
  implicit none (type, external)
  private

  public :: improved_text

  !> Number of significant digits of the parameters that a design reports.
  integer, parameter, public :: digits = 9

contains

  !> Returns the text of the input with all changes made by --set and by the design. A comment marks each change. The text is
  !> empty if `doc` does not contain the text of the input. Fails if the number at a path cannot be set.
  subroutine improved_text(doc, schema, paths, values, text, error)
    type(document_type), intent(in) :: doc
    !> Groups and keys that are allowed in the input
    type(schema_type), intent(in) :: schema
    !> Paths of the changed numbers, for example "frame.mass"
    character(len=*), intent(in) :: paths(:)
    !> New values of these numbers, in the units of the input
    real(dp), intent(in) :: values(:)
    !> The text of the input file with the changes
    character(len=:), allocatable, intent(out) :: text
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: original, changed
    type(entry_type) :: entry
    integer :: i, k, e

    text = ""
    if (.not. allocated(doc%text)) return
    changed = doc
    do k = 1, size(paths)
      call set_path_text(changed, schema, trim(paths(k)), concise(values(k), digits), error)
      if (allocated(error)) return
    end do
    text = doc%text
    call parse_document(text, doc%file, original, error)
    if (.not. allocated(error)) call check_document(original, schema, error)
    if (allocated(error)) return
    do i = 1, size(changed%groups)
      if (i > size(original%groups)) text = text // newline // "&" // changed%groups(i)%name // " /   ! added by the design" &
        & // newline
      do k = 1, size(changed%groups(i)%entries)
        entry = changed%groups(i)%entries(k)
        e = 0
        if (i <= size(original%groups)) e = find_entry(original%groups(i), entry%key)
        if (e == 0) then
          call set_entry(text, i, entry, entry%key // " was missing")
        else if (entry_text(entry) /= entry_text(original%groups(i)%entries(e))) then
          call set_entry(text, i, entry, "was " // entry_text(original%groups(i)%entries(e)))
        end if
      end do
    end do
  end subroutine improved_text

end module gestell_task_design_improved
