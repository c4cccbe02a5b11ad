!> Draws pictures: runs gnuplot on the scripts that accompany the result files.
module gestell_output_picture_gnuplot
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_text, only: either, text
  use gestell_base_files, only: close_file, file_size, open_to_read, read_at, remove_file
  use gestell_base_platform_shell, only: is_installed, run_in_folder
  use gestell_output_picture_script, only: figure_type
  use, intrinsic :: iso_c_binding, only: c_int
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
    if (.not. is_installed("gnuplot")) then
      call fatal_error(error, "gnuplot is not installed, so no pictures were drawn (Debian package gnuplot-nox, or " // &
        & "./bootstrap --with gnuplot); all other files are written", failed_computation)
      return
    end if
    do i = 1, size(figures)
      name = figures(i)%name
      ! -d: ignore the user's gnuplot settings
      call run_in_folder(staging, "gnuplot -d " // name // ".gp", code)
      complete = code == 0
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

  !> True if the file called `name` ends with these `bytes`.
  logical function has_end(name, bytes)
    character(len=*), intent(in) :: name, bytes
    character(len=last_bytes) :: last
    integer(c_int) :: handle
    logical :: closed

    call open_to_read(name, handle)
    has_end = handle >= 0 .and. file_size(name) >= last_bytes
    if (has_end) call read_at(handle, file_size(name) - last_bytes + 1, last, has_end)
    if (handle >= 0) call close_file(handle, closed)
    if (has_end) has_end = index(last, bytes) > 0
  end function has_end

end module gestell_output_picture_gnuplot
