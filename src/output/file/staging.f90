!> Manages the staging folder of a run: .gestell-1, .gestell-2, ... inside the folder of the results.
!>
!> A run writes all its files into its staging folder; they are published together when the run ends. If a file cannot be written,
!> the older results stay unchanged. Concurrent runs use staging folders with different numbers. The staging folder of a killed
!> run is recognised by its file `mark`, emptied and reused. A link is never changed, nor is a folder that contains files but not
!> the file `mark`. Publishing never replaces the input file of the run.
module gestell_output_file_staging
  use gestell_base_error, only: error_type, failed_computation, fatal_error, wrong_usage
  use gestell_base_text, only: text
  use gestell_base_files, only: create_file, file_exists, get_system_message, link_file, make_directory, open_to_read, &
    & remove_file, remove_folder, rename_file, report_system_error, try_lock, unlock_file
  use gestell_base_paths, only: is_link, is_same_file
  use gestell_output_file_folder, only: make_folder, remove_made
  use gestell_output_file_output, only: temporary_ending
  use gestell_output_file_result_files, only: longest_file, longest_table, picture_endings, result_files
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none (type, external)
  private

  public :: open_staging, protect_input

  !> The staging folder of a run that is in progress.
  type, public :: staging_type
    !> Path of the staging folder, into which the run writes its files
    character(len=:), allocatable :: path
    !> Folder into which the files are moved when the run ends
    character(len=:), allocatable, private :: folder
    !> Full path of the input file; empty if the run has no input file
    character(len=:), allocatable, private :: input
    !> Handle of a locked file. The lock reserves `path` for this process until the process ends
    integer(c_int), private :: handle = -1
    !> Names of all tables that a run can write. A killed run may have left the files of any of these tables
    character(len=longest_table), allocatable, private :: tables(:)
    !> Length of the path of the first folder that `make_folder` created; 0 if all folders existed
    integer, private :: made = 0
  contains
    procedure :: publish, discard => remove_staging, show_final_folder
  end type staging_type

  !> Name of the journal of incomplete results in the staging folder (see gestell_task_common_journal). The journal survives the run
  !> only if the run is killed.
  character(len=*), parameter, public :: journal_name = "journal"
  !> Name of a file that every staging folder contains, as evidence that a run created the folder
  character(len=*), parameter :: mark = "made_by_gestell"
  !> Maximum number of runs that can write into the same folder at the same time
  integer, parameter :: most = 1000
  !> Ending of an old result file that is kept in `path` until all new files are published
  character(len=*), parameter :: old = ".old"

contains

  !> Creates `folder` and a staging folder in it. Fails if the staging folder cannot be created or the process may not write into
  !> it.
  subroutine open_staging(staging, folder, tables, error, input)
    !> The staging folder that was created
    type(staging_type), intent(out) :: staging
    !> Folder in which the results are to be published
    character(len=*), intent(in) :: folder
    !> Names of all tables that a run can write
    character(len=longest_table), intent(in) :: tables(:)
    type(error_type), allocatable, intent(out) :: error
    !> Full path of the input file; unallocated if the run has no input file
    character(len=:), allocatable, intent(in) :: input
    character(len=:), allocatable :: reason
    integer(c_int) :: folder_lock
    logical :: is_acquired
    integer :: k

    staging%folder = folder
    staging%tables = tables
    staging%input = ""
    if (allocated(input)) staging%input = input
    call make_folder(folder, error, staging%made)
    if (allocated(error)) return
    call lock_folder(folder, folder_lock)
    is_acquired = .false.
    reason = ""
    do k = 1, most
      staging%path = folder // "/.gestell-" // text(k)
      call acquire(staging, is_acquired, reason)
      if (is_acquired .or. reason /= "") exit
    end do
    if (.not. is_acquired .and. reason == "") reason = "all names from .gestell-1 to .gestell-" // text(most) // " are in use"
    if (.not. is_acquired) call fatal_error(error, "the folder '" // folder // "' for the results cannot be written: " &
      & // reason // "; choose another with --output", wrong_usage)
    call unlock_file(folder_lock)
    if (.not. is_acquired) call remove_made(folder, staging%made)
  end subroutine open_staging

  !> Locks `folder` as soon as no other process is creating or removing staging folders in it. Does nothing if the file system does
  !> not support locks.
  subroutine lock_folder(folder, folder_lock)
    character(len=*), intent(in) :: folder
    integer(c_int), intent(out) :: folder_lock
    logical :: is_locked, busy

    call open_to_read(folder, folder_lock)
    if (folder_lock >= 0) call try_lock(folder_lock, .true., is_locked, busy)
  end subroutine lock_folder

  !> Creates the staging folder, or empties and reuses the staging folder of a killed run. `is_acquired` is false in three cases:
  !> another process uses the folder, no run has created it, or it cannot be created (`reason` then says why). If the file system
  !> does not support locks, an existing folder is never reused.
  subroutine acquire(staging, is_acquired, reason)
    type(staging_type), intent(inout) :: staging
    logical, intent(out) :: is_acquired
    character(len=:), allocatable, intent(inout) :: reason
    integer(c_int) :: handle
    logical :: made, exists, is_locked, busy

    is_acquired = .false.
    call make_directory(staging%path, made, exists)
    if (.not. exists) call get_system_message(reason)
    if (exists .and. .not. made) then
      if (is_link(staging%path)) return
      if (.not. file_exists(staging%path // "/" // mark)) then
        ! The run was killed before it could mark its folder. This removes the folder only if it is empty.
        call remove_folder(staging%path, exists)
        if (exists) call make_directory(staging%path, made, exists)
        exists = made
      end if
    end if
    if (.not. exists) return
    call open_to_read(staging%path, staging%handle)
    if (staging%handle >= 0) call try_lock(staging%handle, .false., is_locked, busy)
    is_acquired = made
    if (staging%handle >= 0) is_acquired = is_locked .or. made .and. .not. busy
    if (is_acquired .and. made) then
      call create_file(staging%path // "/" // mark, handle)
      is_acquired = handle >= 0
      if (.not. is_acquired) call get_system_message(reason)
      if (.not. is_acquired) call remove_folder(staging%path)
      call unlock_file(handle)
    else if (is_acquired) then
      call empty(staging)
    end if
    if (.not. is_acquired) call unlock_file(staging%handle)
  end subroutine acquire

  !> Fails if publishing the files `names` into `folder` would replace the file `input`.
  subroutine protect_input(folder, names, input, error)
    character(len=*), intent(in) :: folder, names(:), input
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    if (input == "") return
    do i = 1, size(names)
      if (.not. is_same_file(folder // "/" // trim(names(i)), input)) cycle
      call fatal_error(error, folder // "/" // trim(names(i)) // ": the results would replace the input; choose another folder " &
        & // "with --output", wrong_usage)
      error%write_failed = .true.
      return
    end do
  end subroutine protect_input

  !> Moves all result files to their final folder, or none of them, and removes the staging folder. Old pictures of a table are
  !> removed if the table is replaced but its pictures are not. Fails if a file cannot be moved; the message says if the old files
  !> could not be restored.
  subroutine publish(self, tables, error)
    class(staging_type), intent(inout) :: self
    character(len=longest_table), intent(in) :: tables(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=longest_file), allocatable :: names(:)
    logical, allocatable :: replaces(:)
    logical :: done
    integer :: i

    names = result_files(tables)
    names = pack(names, [(file_exists(self%path // "/" // trim(names(i))), i = 1, size(names))])
    call protect_input(self%folder, names, self%input, error)
    if (allocated(error)) then
      call self%discard()
      return
    end if
    ! a dangling link is replaced too
    replaces = [(any([file_exists(self%folder // "/" // trim(names(i))), is_link(self%folder // "/" // trim(names(i)))]), &
      & i = 1, size(names))]
    do i = 1, size(names)
      if (replaces(i)) call link_file(self%folder // "/" // trim(names(i)), self%path // "/" // trim(names(i)) // old, done)
    end do
    do i = 1, size(names)
      call rename_file(self%path // "/" // trim(names(i)), self%folder // "/" // trim(names(i)), done)
      if (done) cycle
      call report_system_error(self%folder // "/" // trim(names(i)) // ": cannot be written", failed_computation, error)
      error%write_failed = .true.
      call restore(self, names(:i - 1), replaces(:i - 1), done)
      if (.not. done) error%message = error%message // "; other results of this run have already replaced older files"
      exit
    end do
    if (.not. allocated(error)) then
      call remove_old_pictures(self, tables, names)
      call remove_numbered_pictures(self, names)
      do i = 1, size(names)
        if (replaces(i)) call remove_file(self%path // "/" // trim(names(i)) // old)
      end do
    end if
    call remove_staging(self, done)
    if (.not. (done .or. allocated(error))) call report_system_error(self%path // ": cannot be removed", failed_computation, error)
  end subroutine publish

  !> Undoes the publication of the files `names`: moves the old files back to their folder, and removes new files that replaced no
  !> old file. `replaces`: true for each new file that replaced an old one. `done` is false if an old file cannot be moved back,
  !> as on a file system without hard links.
  subroutine restore(staging, names, replaces, done)
    type(staging_type), intent(in) :: staging
    character(len=*), intent(in) :: names(:)
    logical, intent(in) :: replaces(:)
    logical, intent(out) :: done
    logical :: back
    integer :: i

    done = .true.
    do i = 1, size(names)
      if (replaces(i)) then
        call rename_file(staging%path // "/" // trim(names(i)) // old, staging%folder // "/" // trim(names(i)), back)
        done = done .and. back
      else
        call remove_file(staging%folder // "/" // trim(names(i)))
      end if
    end do
  end subroutine restore

  !> Removes the old pictures of each table that has a new gnuplot script but no new pictures.
  subroutine remove_old_pictures(staging, tables, names)
    type(staging_type), intent(in) :: staging
    character(len=*), intent(in) :: tables(:), names(:)
    character(len=:), allocatable :: picture
    integer :: i, k

    do i = 1, size(tables)
      if (all(names /= trim(tables(i)) // ".gp")) cycle
      do k = 1, size(picture_endings)
        picture = trim(tables(i)) // trim(picture_endings(k))
        if (all(names /= picture)) call remove_unless_input(staging, picture)
      end do
    end do
  end subroutine remove_old_pictures

  !> Removes old pictures NAME_2, NAME_3, ... of each table NAME that is replaced, with their scripts, if they are not replaced.
  !> This run may have fewer pictures than the run before.
  subroutine remove_numbered_pictures(staging, names)
    type(staging_type), intent(in) :: staging
    !> Names of the files that were published
    character(len=*), intent(in) :: names(:)
    character(len=:), allocatable :: name
    integer :: i, k

    do i = 1, size(staging%tables)
      name = trim(staging%tables(i))
      k = index(name, "_", back=.true.)
      if (k == 0 .or. k == len(name) .or. any(names == name // ".gp")) cycle
      if (verify(name(k + 1:), "0123456789") > 0 .or. all(names /= name(:k - 1) // ".gp")) cycle
      call remove_unless_input(staging, name // ".gp")
      do k = 1, size(picture_endings)
        call remove_unless_input(staging, name // trim(picture_endings(k)))
      end do
    end do
  end subroutine remove_numbered_pictures

  !> Removes a file from the folder of the results unless it is the input.
  subroutine remove_unless_input(staging, name)
    type(staging_type), intent(in) :: staging
    character(len=*), intent(in) :: name

    if (.not. is_same_file(staging%folder // "/" // name, staging%input)) call remove_file(staging%folder // "/" // name)
  end subroutine remove_unless_input

  !> Removes the staging folder and publishes no file. Also removes the folder of the results if this run created it and it is
  !> empty. `done`: true if the staging folder no longer exists.
  subroutine remove_staging(staging, done)
    class(staging_type), intent(inout) :: staging
    logical, intent(out), optional :: done
    integer(c_int) :: folder_lock
    logical :: is_removed

    call lock_folder(staging%folder, folder_lock)
    call remove_file(staging%path // "/" // journal_name)
    call remove_file(staging%path // "/" // mark)
    ! Hundreds of files could be in the folder; usually there is none.
    call remove_folder(staging%path, is_removed)
    if (.not. is_removed) then
      call empty(staging)
      call remove_file(staging%path // "/" // journal_name // temporary_ending)
      call remove_folder(staging%path, is_removed)
    end if
    call unlock_file(staging%handle)
    staging%handle = -1
    call unlock_file(folder_lock)
    call remove_made(staging%folder, staging%made)
    if (present(done)) done = is_removed
  end subroutine remove_staging

  !> Removes all result files, complete and incomplete, from the staging folder.
  subroutine empty(staging)
    type(staging_type), intent(in) :: staging
    character(len=longest_file), allocatable :: names(:)
    integer :: i

    names = result_files(staging%tables)
    do i = 1, size(names)
      call remove_file(staging%path // "/" // trim(names(i)))
      call remove_file(staging%path // "/" // trim(names(i)) // temporary_ending)
      call remove_file(staging%path // "/" // trim(names(i)) // old)
    end do
  end subroutine empty

  !> Replaces the path of the staging folder in an error message by the folder in which the file would have been published.
  pure subroutine show_final_folder(self, error)
    class(staging_type), intent(in) :: self
    type(error_type), allocatable, intent(inout) :: error
    integer :: i

    if (.not. (allocated(error) .and. allocated(self%path))) return
    i = index(error%message, self%path // "/")
    if (i > 0) error%message = error%message(:i - 1) // self%folder // error%message(i + len(self%path):)
  end subroutine show_final_folder

end module gestell_output_file_staging
