!> Composes the head of the result files: lines that state where the numbers come from.
module gestell_output_head
  use gestell_base_text, only: newline
  use gestell_base_version, only: version
  use gestell_base_words, only: on_one_line
  use gestell_output_report_verdict, only: verdict_line
  use gestell_output_table, only: table_type
  implicit none (type, external)
  private

  !> An assignment PATH=VALUE made by the option --set.
  type, public :: setting_type
    character(len=:), allocatable :: text
  end type setting_type

  !> Data for the heads of all result files of a run.
  type, public :: head_type
    !> `title`, `input`: title and file name of the input. `model`: model of the frame. `held_by`: what keeps the crank speed
    !> constant ('motor', 'flywheel' or 'outside')
    character(len=:), allocatable :: title, input, model, held_by
    !> Values that the option --set put in place of those in the input file
    type(setting_type), allocatable :: settings(:)
  contains
    procedure :: lines
  end type head_type

contains

  !> Lines of the head of the file of `table`; each begins with #.
  pure function lines(self, table)
    class(head_type), intent(in) :: self
    type(table_type), intent(in) :: table
    character(len=:), allocatable :: lines, model
    integer :: i, first, last

    model = self%model
    if (table%model /= "" .and. model /= "averaged") model = table%model
    lines = line("title: " // self%title) // line("version: gestell " // version) // line("input: " // self%input) &
      & // line("model: " // model)
    if (self%held_by /= "motor") lines = lines // line("speed held by: " // self%held_by)
    do i = 1, size(self%settings)
      lines = lines // line("set: " // self%settings(i)%text)
    end do
    if (verdict_line(table%verdict) /= "") lines = lines // line(verdict_line(table%verdict))
    first = 1
    do while (first <= len(table%remarks))
      last = first + index(table%remarks(first:), newline) - 1
      lines = lines // "# " // table%remarks(first:last)
      first = last + 1
    end do
  end function lines

  !> One line of a file's head. Control characters in the text, including line ends, are replaced by blanks.
  pure function line(words)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: line
    integer :: k

    line = words
    do k = 1, len(line)
      if (line(k:k) < " ") line(k:k) = " "
    end do
    line = "# " // trim(on_one_line(line)) // newline
  end function line

end module gestell_output_head
