!> Runs other programs by the shell of the operating system: sh or, on Windows, cmd.
module gestell_base_platform_shell
  use gestell_base_platform, only: c_is_windows
  implicit none (type, external)
  private

  public :: is_installed, run_in_folder

contains

  !> True if the shell finds a program of this name.
  logical function is_installed(program)
    character(len=*), intent(in) :: program
    integer :: code

    if (c_is_windows() /= 0) then
      call run("where " // program, code)
    else
      call run("command -v " // program, code)
    end if
    is_installed = code == 0
  end function is_installed

  !> Runs a command in a folder and discards its output. `code`: exit code; not 0 if the command could not be run.
  subroutine run_in_folder(folder, command, code)
    character(len=*), intent(in) :: folder, command
    integer, intent(out) :: code
    character(len=:), allocatable :: word

    if (c_is_windows() /= 0) then
      call run("cd /d """ // folder // """ && " // command, code)
    else
      call quote(folder, word)
      call run("cd " // word // " && " // command, code)
    end if
  end subroutine run_in_folder

  !> Runs a shell command and discards its output.
  subroutine run(command, code)
    character(len=*), intent(in) :: command
    integer, intent(out) :: code
    integer :: status

    code = 1
    if (c_is_windows() /= 0) then
      call execute_command_line(command // " >NUL 2>&1", exitstat=code, cmdstat=status)
    else
      call execute_command_line(command // " >/dev/null 2>&1", exitstat=code, cmdstat=status)
    end if
    if (status /= 0 .and. code == 0) code = 1
  end subroutine run

  !> Returns the name of a folder as one word in quotes for sh. The prefix ./ prevents sh from reading a relative name as an option
  !> or from searching it in CDPATH.
  pure subroutine quote(folder, word)
    character(len=*), intent(in) :: folder
    character(len=:), allocatable, intent(out) :: word
    integer :: i

    word = "'./"
    if (index(folder, "/") == 1) word = "'"
    do i = 1, len(folder)
      if (folder(i:i) == "'") then
        word = word // "'\''"
      else
        word = word // folder(i:i)
      end if
    end do
    word = word // "'"
  end subroutine quote

end module gestell_base_platform_shell
