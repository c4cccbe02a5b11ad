!> Pictures: gnuplot, run on the scripts beside the result files.
module plotting
  use gestell_base_error, only: error_type, failed_computation, fatal_error, wrong_usage
  use gestell_base_text, only: text
  use gestell_io_files, only: file_size
  implicit none (type, external)
  private

  public :: draw_pictures, find_gnuplot

  !> All scripts that there can be, in the order in which pictures are named.
  character(len=*), parameter :: scripts(*) = [character(len=18) :: "mechanism", "multipliers", "modes", "response", &
    & "harmonics", "supports", "supports_history", "supports_harmonics", "probes", "probes_history", "probes_harmonics", &
    & "power", "resonance", "peaks", "campbell", "crossings", "critical", "sensitivity", "trade", "sweep", &
    & "boundary"]

contains

  !> Error: gnuplot is not there.
  subroutine find_gnuplot(error)
    type(error_type), allocatable, intent(out) :: error
    integer :: code, status

    code = 1
    call execute_command_line("command -v gnuplot >/dev/null 2>&1", exitstat=code, cmdstat=status)
    if (code /= 0 .or. status /= 0) call fatal_error(error, "--plot and --report need the program gnuplot (in Debian " // &
      & "the package gnuplot-nox); without them the scripts for it are written all the same", wrong_usage)
  end subroutine find_gnuplot

  !> Draws what has a script in `folder` but no picture: a script that is written takes the pictures of an older one away.
  !> `only_mechanism`: its alone. `drawn` names them, with commas. Error: gnuplot could not draw one.
  subroutine draw_pictures(folder, only_mechanism, drawn, error)
    character(len=*), intent(in) :: folder
    logical, intent(in) :: only_mechanism
    character(len=:), allocatable, intent(out) :: drawn
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: name
    integer :: i, code, status

    drawn = ""
    do i = 1, merge(1, size(scripts), only_mechanism)
      name = trim(scripts(i))
      if (.not. there("gp") .or. there("svg") .and. there("png")) cycle
      code = 0
      ! -d: without the user's own settings
      call execute_command_line("cd " // quoted(folder) // " && gnuplot -d " // name // ".gp >/dev/null 2>&1", exitstat=code, &
        & cmdstat=status)
      if (code /= 0 .or. status /= 0 .or. .not. (there("svg") .and. there("png"))) then
        call fatal_error(error, folder // "/" // name // ".gp: gnuplot cannot draw it (exit code " // text(code) // "); run " // &
          & "gnuplot " // name // ".gp in that folder to see why", failed_computation)
        return
      end if
      if (drawn /= "") drawn = drawn // ", "
      drawn = drawn // name
    end do
  contains
    logical function there(ending)
      character(len=*), intent(in) :: ending

      there = file_size(folder // "/" // name // "." // ending) > 0
    end function there
  end subroutine draw_pictures

  !> A folder's name as one word of the shell's, which is neither an option nor looked for elsewhere.
  pure function quoted(folder) result(word)
    character(len=*), intent(in) :: folder
    character(len=:), allocatable :: word
    integer :: i

    word = "'"
    if (index(folder, "/") /= 1) word = "'./"
    do i = 1, len(folder)
      if (folder(i:i) == "'") then
        word = word // "'\''"
      else
        word = word // folder(i:i)
      end if
    end do
    word = word // "'"
  end function quoted

end module plotting
