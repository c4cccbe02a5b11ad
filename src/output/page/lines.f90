!> Joins the lines of style sheets and scripts, which constants hold as arrays of lines.
module gestell_output_page_lines
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_text, only: newline
  implicit none (type, external)
  private

  public :: joined

contains

  !> Text of `lines` without the blanks at their ends.
  pure function joined(lines) result(words)
    character(len=*), intent(in) :: lines(:)
    character(len=:), allocatable :: words
    type(growing_text_type) :: pieces
    integer :: i

    do i = 1, size(lines)
      call pieces%append(trim(lines(i)) // newline)
    end do
    words = pieces%whole()
  end function joined

end module gestell_output_page_lines
