!> Lists the names of all files that a run can write into its folder. Files with other names are not published.
module gestell_output_file_result_files
  implicit none (type, external)
  private

  public :: result_files

  !> Maximum number of characters of a table's name NAME. Its data are written to NAME.csv or NAME.npy, its script to NAME.gp, and
  !> its pictures to NAME.svg and NAME.png. An animation of the picture is in NAME_motion.svg and NAME_motion.gif.
  integer, parameter, public :: longest_table = 18
  !> End of an animation's name
  character(len=*), parameter, public :: animation = "_motion"
  !> Endings of a table's pictures
  character(len=*), parameter, public :: picture_endings(*) = [character(len=11) :: ".svg", ".png", animation // ".svg", &
    & animation // ".gif"]
  !> Endings of all files of a table
  character(len=*), parameter :: endings(*) = [character(len=11) :: ".csv", ".npy", ".gp", animation // ".gp", picture_endings]
  !> `others`: names of files that concern the whole run: the HTML page and all results in JSON. `improved`: name of the table that
  !> is accompanied by the file design.nml with the improved machine.
  character(len=*), parameter :: others(*) = [character(len=12) :: "report.html", "results.json"], improved = "design"
  integer, parameter, public :: longest_file = longest_table + len(endings)

contains

  !> Names of all files that a run with these tables can write.
  pure function result_files(tables) result(names)
    character(len=longest_table), intent(in) :: tables(:)
    character(len=longest_file), allocatable :: names(:)
    integer :: i, k

    allocate(names(size(endings) * size(tables) + size(others)))
    do i = 1, size(tables)
      do k = 1, size(endings)
        names(size(endings) * (i - 1) + k) = trim(tables(i)) // endings(k)
      end do
    end do
    names(size(endings) * size(tables) + 1:) = others
    if (any(tables == improved)) names = [character(len=longest_file) :: names, improved // ".nml"]
  end function result_files

end module gestell_output_file_result_files
