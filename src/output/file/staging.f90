!> Where the files of a run stand until all are complete: a folder .gestell-1, .gestell-2, ... of its own within that of the
!> results. They are published together, when the run ends; a run that cannot write leaves what was there as it was. Runs
!> at the same time take folders of different numbers. A folder that a killed run has left is taken and emptied; it is known by
!> the file `mark` in it. A link, or a folder of anybody else, is left alone. The file that the run has read is never replaced.
module gestell_output_file_staging
  use gestell_base_error, only: error_type, failed_computation, fatal_error, wrong_usage
  use gestell_base_text, only: text
  use gestell_base_files, only: create_file, is_there, last_reason, link_file, make_directory, open_to_read, remove_file, &
    & remove_folder, rename_file, try_lock, unlock_file
  use gestell_base_paths, only: is_link, is_same
  use gestell_output_file_folder, only: make_folder, remove_made
  use gestell_output_file_output, only: growing
  use gestell_output_file_result_files, only: longest_file, longest_table, picture_endings, result_files
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none (type, external)
  private

  public :: open_staging, spare_input

  type, public :: staging_type
    !> Where the files are written.
    character(len=:), allocatable :: path
    !> Where they will stand.
    character(len=:), allocatable, private :: folder
    !> The full path of the file that the run has read; empty: none.
    character(len=:), allocatable, private :: input
    !> Holds `path` as long as the process lives.
    integer(c_int), private :: handle = -1
    !> The tables that any run can leave, also one that was killed.
    character(len=longest_table), allocatable, private :: tables(:)
    !> As of `make_folder`.
    integer, private :: made = 0
  contains
    procedure :: publish
    procedure :: discard => leave
    procedure :: retell
  end type staging_type

  !> Within it: what a run has computed that is not complete (gestell_task_common_journal). It outlives the run only where that is
  !> killed.
  character(len=*), parameter, public :: journal_name = "journal"
  !> Within it: the file that says that a run has made the folder.
  character(len=*), parameter :: mark = "made_by_gestell"
  !> Runs that can write to one folder at the same time.
  integer, parameter :: most = 1000
  !> What the old file is called within `path` until all new ones have their names.
  character(len=*), parameter :: old = ".old"

contains

  !> Makes `folder` and within it a staging folder for this run's files, those of `tables`, page and JSON. `input`: the full path of
  !> the file that was read, if one was. Error: it cannot be made, or nothing can be written there.
  subroutine open_staging(staging, folder, tables, error, input)
    type(staging_type), intent(out) :: staging
    character(len=*), intent(in) :: folder
    character(len=longest_table), intent(in) :: tables(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable, intent(in) :: input
    character(len=:), allocatable :: reason
    integer(c_int) :: guard
    logical :: mine
    integer :: k

    staging%folder = folder
    staging%tables = tables
    staging%input = ""
    if (allocated(input)) staging%input = input
    call make_folder(folder, error, staging%made)
    if (allocated(error)) return
    call take_turn(folder, guard)
    mine = .false.
    reason = ""
    do k = 1, most
      staging%path = folder // "/.gestell-" // text(k)
      call take(staging, mine, reason)
      if (mine .or. reason /= "") exit
    end do
    if (.not. mine .and. reason == "") reason = "there is something else of each of the names .gestell-1 to .gestell-" // text(most)
    if (.not. mine) call fatal_error(error, "the folder '" // folder // "' for the results cannot be written: " &
      & // reason // "; name another with --output", wrong_usage)
    call unlock_file(guard)
    if (.not. mine) call remove_made(folder, staging%made)
  end subroutine open_staging

  !> Waits until no other process makes or removes staging folders in `folder`. Where there are no locks nothing is waited for.
  subroutine take_turn(folder, guard)
    character(len=*), intent(in) :: folder
    integer(c_int), intent(out) :: guard
    logical :: held, busy

    call open_to_read(folder, guard)
    if (guard >= 0) call try_lock(guard, .true., held, busy)
  end subroutine take_turn

  !> Makes the staging folder, or takes and empties that of a run that was killed. Not `mine`: another process has it, no run has
  !> made it, or, for this `reason`, none can be made. Where there are no locks it must be new.
  subroutine take(staging, mine, reason)
    type(staging_type), intent(inout) :: staging
    logical, intent(out) :: mine
    character(len=:), allocatable, intent(inout) :: reason
    integer(c_int) :: handle
    logical :: made, there, held, busy

    mine = .false.
    call make_directory(staging%path, made, there)
    if (.not. there) reason = last_reason()
    if (there .and. .not. made) then
      if (is_link(staging%path)) return
      if (.not. is_there(staging%path // "/" // mark)) then
        ! Only an empty folder goes: that of a run that was killed before it could mark it.
        call remove_folder(staging%path, there)
        if (there) call make_directory(staging%path, made, there)
        there = made
      end if
    end if
    if (.not. there) return
    call open_to_read(staging%path, staging%handle)
    if (staging%handle >= 0) call try_lock(staging%handle, .false., held, busy)
    mine = made
    if (staging%handle >= 0) mine = held .or. made .and. .not. busy
    if (mine .and. made) then
      call create_file(staging%path // "/" // mark, handle)
      mine = handle >= 0
      if (.not. mine) reason = last_reason()
      if (.not. mine) call remove_folder(staging%path)
      call unlock_file(handle)
    else if (mine) then
      call empty(staging)
    end if
    if (.not. mine) call unlock_file(staging%handle)
  end subroutine take

  !> Error: one of the files `names` in `folder` is the `input` itself, which would be replaced.
  subroutine spare_input(folder, names, input, error)
    character(len=*), intent(in) :: folder, names(:), input
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    if (input == "") return
    do i = 1, size(names)
      if (.not. is_same(folder // "/" // trim(names(i)), input)) cycle
      call fatal_error(error, folder // "/" // trim(names(i)) // ": the results would replace the input; name another folder " &
        & // "with --output", wrong_usage)
      error%unwritten = .true.
      return
    end do
  end subroutine spare_input

  !> Moves all files, which are those of `tables`, page and JSON, to their folder, or none, and ends. Pictures that belong to older
  !> tables are removed.
  !> Error: it cannot be done; what was there before is there again, or the message says that it is not.
  subroutine publish(self, tables, error)
    class(staging_type), intent(inout) :: self
    character(len=longest_table), intent(in) :: tables(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=longest_file), allocatable :: names(:)
    logical, allocatable :: replaces(:)
    logical :: done
    integer :: i

    names = result_files(tables)
    names = pack(names, [(is_there(self%path // "/" // trim(names(i))), i = 1, size(names))])
    call spare_input(self%folder, names, self%input, error)
    if (allocated(error)) then
      call self%discard()
      return
    end if
    replaces = [(is_there(self%folder // "/" // trim(names(i))), i = 1, size(names))]
    do i = 1, size(names)
      ! a link that points nowhere is replaced too
      if (.not. replaces(i)) replaces(i) = is_link(self%folder // "/" // trim(names(i)))
    end do
    do i = 1, size(names)
      if (replaces(i)) call link_file(self%folder // "/" // trim(names(i)), self%path // "/" // trim(names(i)) // old, done)
    end do
    do i = 1, size(names)
      call rename_file(self%path // "/" // trim(names(i)), self%folder // "/" // trim(names(i)), done)
      if (done) cycle
      call fatal_error(error, self%folder // "/" // trim(names(i)) // ": cannot be written: " // last_reason(), failed_computation)
      error%unwritten = .true.
      call restore(self, names(:i - 1), replaces(:i - 1), done)
      if (.not. done) error%message = error%message // "; other files of this run are in their places already"
      exit
    end do
    if (.not. allocated(error)) then
      call remove_old_pictures(self, tables, names)
      do i = 1, size(names)
        if (replaces(i)) call remove_file(self%path // "/" // trim(names(i)) // old)
      end do
    end if
    call leave(self, done)
    if (.not. (done .or. allocated(error))) call fatal_error(error, self%path // ": cannot be removed: " // last_reason(), &
      & failed_computation)
  end subroutine publish

  !> Brings back what was there before these files; not `done` where the file system knows no second names.
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

  !> Removes the pictures of those tables whose script is new and was not run.
  subroutine remove_old_pictures(staging, tables, names)
    type(staging_type), intent(in) :: staging
    character(len=*), intent(in) :: tables(:), names(:)
    character(len=:), allocatable :: picture
    integer :: i, k

    do i = 1, size(tables)
      if (all(names /= trim(tables(i)) // ".gp")) cycle
      do k = 1, size(picture_endings)
        picture = trim(tables(i)) // picture_endings(k)
        if (any(names == picture)) cycle
        picture = staging%folder // "/" // picture
        if (.not. is_same(picture, staging%input)) call remove_file(picture)
      end do
    end do
  end subroutine remove_old_pictures

  !> Removes the staging folder, and that of the results where it was made for nothing: ends without moving any file. `done`: it is
  !> gone.
  subroutine leave(staging, done)
    class(staging_type), intent(inout) :: staging
    logical, intent(out), optional :: done
    integer(c_int) :: guard
    logical :: gone

    call take_turn(staging%folder, guard)
    call remove_file(staging%path // "/" // journal_name)
    call remove_file(staging%path // "/" // mark)
    ! Hundreds of files could stand there, as a rule none does.
    call remove_folder(staging%path, gone)
    if (.not. gone) then
      call empty(staging)
      call remove_file(staging%path // "/" // journal_name // growing)
      call remove_folder(staging%path, gone)
    end if
    call unlock_file(staging%handle)
    staging%handle = -1
    call unlock_file(guard)
    call remove_made(staging%folder, staging%made)
    if (present(done)) done = gone
  end subroutine leave

  subroutine empty(staging)
    type(staging_type), intent(in) :: staging
    character(len=longest_file), allocatable :: names(:)
    integer :: i

    names = result_files(staging%tables)
    do i = 1, size(names)
      call remove_file(staging%path // "/" // trim(names(i)))
      call remove_file(staging%path // "/" // trim(names(i)) // growing)
      call remove_file(staging%path // "/" // trim(names(i)) // old)
    end do
  end subroutine empty

  !> A message that names a file where it will stand.
  pure subroutine retell(self, error)
    class(staging_type), intent(in) :: self
    type(error_type), allocatable, intent(inout) :: error
    integer :: i

    if (.not. (allocated(error) .and. allocated(self%path))) return
    i = index(error%message, self%path // "/")
    if (i > 0) error%message = error%message(:i - 1) // self%folder // error%message(i + len(self%path):)
  end subroutine retell

end module gestell_output_file_staging
