!> What heads every table: where its numbers come from.
module gestell_output_head
  use gestell_base_version, only: version
  use gestell_input_wording, only: on_one_line
  use gestell_output_report_verdict, only: verdict_line
  use gestell_output_table, only: table_type
  implicit none (type, external)
  private

  type, public :: head_type
    !> The input's title and name; the frame's model; who holds the crank's speed.
    character(len=:), allocatable :: title, input, model, held_by
    !> What was set from outside the input.
    character(len=:), allocatable :: settings(:)
  contains
    procedure :: lines
  end type head_type

  character, parameter :: newline = new_line("a")

contains

  !> The # lines of a table, without that sign. Ends of lines, as other control characters of ASCII, become blanks.
  pure function lines(self, table)
    class(head_type), intent(in) :: self
    type(table_type), intent(in) :: table
    character(len=:), allocatable :: lines(:)
    character(len=:), allocatable :: verdict, model
    integer :: i, k, n, width, first, last

    model = self%model
    if (table%model /= "" .and. model /= "averaged") model = table%model
    verdict = verdict_line(table%verdict)
    width = max(len(self%title) + 7, len(self%input) + 7, len(self%settings) + 5, len(verdict), len(table%remarks), 40)
    n = merge(4, 5, self%held_by == "motor")
    allocate(character(len=width) :: lines(n + size(self%settings) + merge(0, 1, verdict == "") &
      & + count([(table%remarks(i:i) == newline, i = 1, len(table%remarks))])))
    lines(1) = "title: " // self%title
    lines(2) = "version: gestell " // version
    lines(3) = "input: " // self%input
    lines(4) = "model: " // model
    if (n == 5) lines(n) = "speed held by: " // self%held_by
    do i = 1, size(self%settings)
      lines(n + i) = "set: " // self%settings(i)
    end do
    do i = 1, n + size(self%settings)
      do k = 1, width
        if (lines(i)(k:k) < " ") lines(i)(k:k) = " "
      end do
      lines(i) = on_one_line(lines(i))
    end do
    n = n + size(self%settings)
    if (verdict /= "") then
      n = n + 1
      lines(n) = verdict
    end if
    first = 1
    do n = n + 1, size(lines)
      last = first + index(table%remarks(first:), newline) - 2
      lines(n) = table%remarks(first:last)
      first = last + 2
    end do
  end function lines

end module gestell_output_head
