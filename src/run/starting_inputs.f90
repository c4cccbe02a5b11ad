!> Returns the inputs that `gestell --new` prints: machines of the usual kinds, to start from.
module gestell_run_starting_inputs
  use gestell_run_starting_texts, only: kinds, starting_text
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_input_schema_help, only: entry
  use gestell_input_wording, only: lower, shown
  implicit none (type, external)
  private

  public :: starting_input

contains

  !> Text of the input for a machine of this kind. If `kind` is empty, the text lists the kinds. Fails if the kind is unknown.
  pure subroutine starting_input(kind, text, error)
    character(len=*), intent(in) :: kind
    character(len=:), allocatable, intent(out) :: text
    type(error_type), allocatable, intent(out) :: error
    character, parameter :: newline = new_line("a")
    integer :: i

    text = starting_text(lower(kind))
    if (text /= "") return
    if (kind /= "") then
      call fatal_error(error, "--new: unknown kind of machine '" // shown(kind) // "'" &
        & // suggestion(kind, kinds), wrong_usage)
      return
    end if
    text = "usage: gestell --new KIND > machine.nml" // newline // newline
    do i = 1, size(kinds)
      text = text // entry(trim(kinds(i)), title(starting_text(kinds(i))), column=22)
    end do
  end subroutine starting_input

  !> Kind of machine that an input describes: the first line of the input, without the comment mark.
  pure function title(text)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: title

    title = text(3:index(text, new_line("a")) - 1)
  end function title

end module gestell_run_starting_inputs
