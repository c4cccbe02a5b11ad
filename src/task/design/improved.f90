!> Writes the input file of the improved machine: the original text, in which the numbers changed by the design are replaced.
module gestell_task_design_improved
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_path, only: set_path_text
  use gestell_input_schema_rewrite, only: rewrite
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
    type(document_type) :: changed
    integer :: k

    text = ""
    if (.not. allocated(doc%text)) return
    changed = doc
    do k = 1, size(paths)
      call set_path_text(changed, schema, trim(paths(k)), concise(values(k), digits), error)
      if (allocated(error)) return
    end do
    call rewrite(changed, schema, text, error, "the design")
  end subroutine improved_text

end module gestell_task_design_improved
