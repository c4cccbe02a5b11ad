!> Creates and removes the folder in which the result files are published.
module gestell_output_file_folder
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_files, only: file_exists, folder_exists, get_system_message, make_directory, remove_folder
  use gestell_base_paths, only: is_link
  implicit none (type, external)
  private

  public :: is_foreign, make_folder, remove_made

contains

  !> Creates `folder` and all missing folders in its path. `made`: length of the path of the first folder that was created; 0 if all
  !> folders existed. Fails if a folder cannot be created.
  subroutine make_folder(folder, error, made)
    character(len=*), intent(in) :: folder
    type(error_type), allocatable, intent(out) :: error
    integer, intent(out), optional :: made
    character(len=:), allocatable :: reason
    logical :: new, exists
    integer :: i, first

    first = 0
    reason = ""
    do i = 1, len(folder)
      if (.not. ends_a_name(folder, i)) cycle
      call make_directory(folder(:i), new, exists)
      if (new .and. first == 0) first = i
      if (.not. exists) call get_system_message(reason)
    end do
    if (present(made)) made = first
    if (folder_exists(folder)) return
    if (reason == "") call get_system_message(reason)
    call remove_made(folder, first)
    call fatal_error(error, "the folder '" // folder // "' for the results cannot be created: " // reason // "; choose another " &
      & // "with --output", wrong_usage)
    error%write_failed = .true.
  end subroutine make_folder

  !> Removes the folders that `make_folder` created, provided that they are empty.
  subroutine remove_made(folder, made)
    character(len=*), intent(in) :: folder
    integer, intent(in) :: made
    integer :: i

    if (made == 0) return
    do i = len(folder), made, -1
      if (ends_a_name(folder, i)) call remove_folder(folder(:i))
    end do
  end subroutine remove_made

  !> True if this folder, or one of the `files` in it, is a link, or if such files exist but the file `mark` does not. No run of
  !> Gestell has created such a folder, because every run creates `mark` before any other file.
  logical function is_foreign(folder, files, mark)
    character(len=*), intent(in) :: folder, files(:), mark
    logical :: exists
    integer :: i

    is_foreign = any([is_link(folder), is_link(folder // "/" // mark), &
      & (is_link(folder // "/" // trim(files(i))), i = 1, size(files))])
    exists = any([(file_exists(folder // "/" // trim(files(i))), i = 1, size(files))])
    ! the mark is tested last, because another process may be about to begin
    if (exists .and. .not. is_foreign) is_foreign = .not. file_exists(folder // "/" // mark)
  end function is_foreign

  !> True if the i-th character of a path is the last character of a folder's name.
  pure logical function ends_a_name(path, i)
    character(len=*), intent(in) :: path
    integer, intent(in) :: i

    ends_a_name = path(i:i) /= "/"
    if (ends_a_name .and. i < len(path)) ends_a_name = path(i + 1:i + 1) == "/"
  end function ends_a_name

end module gestell_output_file_folder
