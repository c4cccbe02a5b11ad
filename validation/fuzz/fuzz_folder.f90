!> The folder of a run: made, looked through, emptied.
module fuzz_folder
  use fuzz_input, only: input_type
  use fuzz_text, only: read_content, save_text
  use gestell_base_files, only: file_size, remove_file, remove_folder
  use gestell_output_file_folder, only: make_folder
  use gestell_base_error, only: error_type
  use gestell_output_file_result_files, only: longest_file, result_files
  use gestell_task_registry, only: all_tables
  implicit none (type, external)
  private

  public :: clear, file_exists, prepare

contains

  !> `folder`/case with the input in it.
  subroutine prepare(folder, input)
    character(len=*), intent(in) :: folder
    type(input_type), intent(in) :: input
    type(error_type), allocatable :: error

    call make_folder(folder // "/case", error)
    if (allocated(error)) error stop "no folder for the runs"
    call save_text(folder // "/case/" // input%file, input%document)
  end subroutine prepare

  !> Empties it. `clean`: nothing was there but what a run may leave.
  subroutine clear(folder, input, clean)
    character(len=*), intent(in) :: folder
    type(input_type), intent(in) :: input
    logical, intent(out) :: clean
    character(len=:), allocatable :: results
    character(len=longest_file), allocatable :: names(:)
    logical :: pictures
    integer :: i, status

    results = folder // "/case/" // input%folder
    if (file_exists(results // "/.")) then
      names = result_files(all_tables())
      pictures = input%option("--report") .or. input%option("--plot")
      do i = 1, size(names)
        if (pictures .or. .not. is_picture(names(i))) call remove_file(results // "/" // trim(names(i)))
      end do
      call remove_folder(results)
    end if
    call remove_file(folder // "/case/" // input%file)
    call remove_folder(folder // "/case")
    clean = .not. file_exists(folder // "/case/.")
    if (clean) return
    call execute_command_line("ls -lR '" // folder // "/case' >'" // folder // "/left'", exitstat=status)
    call execute_command_line("rm -rf '" // folder // "/case'", exitstat=status)
    if (status /= 0) error stop "a folder cannot be removed"
  end subroutine clear

  pure logical function is_picture(name)
    character(len=*), intent(in) :: name

    is_picture = any([index(name, ".svg"), index(name, ".png"), index(name, ".gif")] > 0)
  end function is_picture

  logical function file_exists(name)
    character(len=*), intent(in) :: name

    inquire (file=name, exist=file_exists)
  end function file_exists

end module fuzz_folder
