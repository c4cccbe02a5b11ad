!> Draws pictures: runs gnuplot on the scripts that accompany the result files.
module gestell_output_picture_gnuplot
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_text, only: either, text
  use gestell_base_files, only: file_size, remove_file
  use gestell_output_picture_script, only: figure_type
  implicit none (type, external)
  private

  public :: draw_pictures

  !> Last bytes of a complete SVG, PNG or GIF file. They are tested because gnuplot does not report a full disk.
  character(len=*), parameter :: svg_end = "</svg>", png_end = "IEND", gif_end = ";"
  integer, parameter :: last_bytes = 16

contains

  !> Draws pictures by running their gnuplot scripts in the folder `staging`. Fails if gnuplot is missing. If gnuplot cannot draw a
  !> picture, the other pictures are still drawn and the first failure is returned.
  subroutine draw_pictures(staging, folder, figures, drawn, error)
    !> `staging`: folder that contains the scripts. `folder`: folder in which they will be published, which messages name
    character(len=*), intent(in) :: staging, folder
    type(figure_type), intent(in) :: figures(:)
    !> Names of the pictures that were drawn, separated by commas
    character(len=:), allocatable, intent(out) :: drawn
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: name
    logical :: complete
    integer :: i, code

    drawn = ""
    if (.not. shell_does("command -v gnuplot")) then
      call fatal_error(error, "gnuplot is not installed, so no pictures were drawn (Debian package gnuplot-nox, or " // &
        & "./bootstrap --with gnuplot); all other files are written", failed_computation)
      return
    end if
    do i = 1, size(figures)
      name = figures(i)%name
      ! -d: ignore the user's gnuplot settings
      complete = shell_does("cd " // quoted(staging) // " && gnuplot -d " // name // ".gp", code)
      if (allocated(figures(i)%scenes)) then
        ! gnuplot may have been built without GIF: then only the animated SVG file is there, which needs no gnuplot
        if (.not. (complete .and. has_end(staging // "/" // name // ".gif", gif_end))) call remove_file(staging // "/" // name &
          & // ".gif")
        cycle
      end if
      if (complete) complete = has_end(staging // "/" // name // ".svg", svg_end)
      if (complete) complete = has_end(staging // "/" // name // ".png", png_end)
      if (complete) then
        drawn = drawn // either(", ", "", drawn /= "") // name
        cycle
      end if
      call remove_file(staging // "/" // name // ".svg")
      call remove_file(staging // "/" // name // ".png")
      if (.not. allocated(error)) call fatal_error(error, folder // "/" // name // ".gp: gnuplot cannot draw it (exit code " &
        & // text(code) // "); run gnuplot " // name // ".gp in that folder to see why", failed_computation)
    end do
  end subroutine draw_pictures

  !> Runs a shell command, discards its output, and returns true if the command succeeded.
  logical function shell_does(command, code)
    character(len=*), intent(in) :: command
    integer, intent(out), optional :: code
    integer :: status, exit_code

    exit_code = 1
    call execute_command_line(command // " >/dev/null 2>&1", exitstat=exit_code, cmdstat=status)
    shell_does = exit_code == 0 .and. status == 0
    if (present(code)) code = exit_code
  end function shell_does

  !> True if the file called `name` ends with these `bytes`.
  logical function has_end(name, bytes)
    character(len=*), intent(in) :: name, bytes
    character(len=last_bytes) :: last
    integer :: unit, status

    has_end = file_size(name) >= last_bytes
    if (.not. has_end) return
    open (newunit=unit, file=name, access="stream", form="unformatted", action="read", status="old", iostat=status)
    has_end = status == 0
    if (.not. has_end) return
    read (unit, pos=file_size(name) - last_bytes + 1, iostat=status) last
    if (status == 0) close (unit, iostat=status)
    has_end = status == 0 .and. index(last, bytes) > 0
  end function has_end

  !> Name of a folder as one word in quotes for the shell. The prefix ./ prevents the shell from reading a relative name as an
  !> option or from searching it in CDPATH.
  pure function quoted(folder) result(word)
    character(len=*), intent(in) :: folder
    character(len=:), allocatable :: word
    integer :: i

    word = either("'", "'./", index(folder, "/") == 1)
    do i = 1, len(folder)
      word = word // either("'\''", folder(i:i), folder(i:i) == "'")
    end do
    word = word // "'"
  end function quoted

end module gestell_output_picture_gnuplot
