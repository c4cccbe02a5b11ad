!> The names of all files that a run can leave in its folder. A file of another name would not find its way there.
module gestell_output_file_result_files
  implicit none (type, external)
  private

  public :: result_files

  !> Maximum number of characters of a table's name. Its files are NAME.csv or NAME.npy, its script NAME.gp, its pictures NAME.svg
  !> and NAME.png.
  integer, parameter, public :: longest_table = 18
  !> Endings of a picture, and of what goes with a table.
  character(len=*), parameter, public :: picture_endings(*) = [character(len=4) :: ".svg", ".png"]
  character(len=*), parameter :: endings(*) = [character(len=4) :: ".csv", ".npy", ".gp", picture_endings]
  !> Files that belong to no table: the page and all results; the improved machine goes with the table of that name.
  character(len=*), parameter :: others(*) = [character(len=12) :: "report.html", "results.json"], improved = "design"
  integer, parameter, public :: longest_file = longest_table + len(endings)

contains

  !> All names, where these tables can be left.
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
