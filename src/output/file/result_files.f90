!> The names of all files that a run can leave in its folder. A file of another name would not find its way there.
module gestell_output_file_result_files
  implicit none (type, external)
  private

  public :: result_files

  !> Tables, in the order in which their pictures are named: NAME.csv, its script NAME.gp, its pictures NAME.svg and NAME.png.
  character(len=*), parameter, public :: tables(*) = [character(len=18) :: "mechanism", "multipliers", "modes", "response", &
    & "harmonics", "supports", "supports_history", "supports_harmonics", "probes", "probes_history", "probes_harmonics", &
    & "power", "resonance", "peaks", "campbell", "crossings", "critical", "sensitivity", "trade", "sweep", "vibrations", &
    & "boundary", "quantities", "level"]
  !> Endings of a picture, and of what goes with a table.
  character(len=*), parameter, public :: picture_endings(*) = [character(len=4) :: ".svg", ".png"]
  character(len=*), parameter :: endings(*) = [character(len=4) :: ".csv", ".gp", picture_endings]

contains

  !> All names.
  pure function result_files() result(names)
    character(len=22) :: names(size(endings) * size(tables) + 2)
    integer :: i, k

    do i = 1, size(tables)
      do k = 1, size(endings)
        names(size(endings) * (i - 1) + k) = trim(tables(i)) // endings(k)
      end do
    end do
    names(size(names) - 1:) = [character(len=22) :: "report.html", "results.json"]
  end function result_files

end module gestell_output_file_result_files
