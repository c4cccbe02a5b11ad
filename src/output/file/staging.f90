!> Where the files of a run stand until all are complete: a folder .gestell-1, .gestell-2, ... of its own within that of the
!> results. They are published together, when the run ends; a run that cannot write leaves what was there as it was. Runs
!> at the same time take folders of different numbers, and one that was left by a run that was killed is taken and emptied.
module gestell_output_file_staging
  use gestell_base_error, only: error_type, failed_computation, fatal_error, wrong_usage
  use gestell_base_text, only: text
  use gestell_base_files, only: is_there, last_reason, link_file, make_directory, open_to_read, remove_file, remove_folder, &
    & rename_file, try_lock, unlock_file
  use gestell_output_file_folder, only: make_folder, remove_made
  use gestell_output_file_output, only: growing
  use gestell_output_file_result_files, only: longest_file, longest_table, picture_endings, result_files
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none (type, external)
  private

  public :: open_staging

  type, public :: staging_type
    !> Where the files are written.
    character(len=:), allocatable :: path
    !> Where they will stand.
    character(len=:), allocatable, private :: folder
    !> Holds `path` as long as the process lives.
    integer(c_int), private :: handle = -1
    !> The tables that any run can leave, also one that was killed.
    character(len=longest_table), allocatable, private :: tables(:)
    !> As of `make_folder`.
    integer, private :: made = 0
  contains
    procedure :: publish
    procedure :: discard
    procedure :: retell
  end type staging_type

  !> Within it: what a run has computed that is not complete (gestell_task_journal). It outlives the run only where that is
  !> killed.
  character(len=*), parameter, public :: journal_name = "journal"
  !> Runs that can write to one folder at the same time.
  integer, parameter :: most = 1000
  !> What the old file is called within `path` until all new ones have their names.
  character(len=*), parameter :: old = ".old"

contains

  !> Makes `folder` and within it a staging folder for this run's files, those of `tables`, page and JSON. Error: it cannot be
  !> made, or nothing can be written there.
  subroutine open_staging(staging, folder, tables, error)
    type(staging_type), intent(out) :: staging
    character(len=*), intent(in) :: folder
    character(len=longest_table), intent(in) :: tables(:)
    type(error_type), allocatable, intent(out) :: error
    integer(c_int) :: guard
    logical :: made, there, mine
    integer :: k

    staging%folder = folder
    staging%tables = tables
    call make_folder(folder, error, staging%made)
    if (allocated(error)) return
    call take_turn(folder, guard)
    mine = .false.
    do k = 1, most
      staging%path = folder // "/.gestell-" // text(k)
      call make_directory(staging%path, made, there)
      if (.not. there) exit
      call take(staging, made, mine)
      if (.not. mine) cycle
      if (.not. made) call empty(staging)
      exit
    end do
    if (.not. mine) call fatal_error(error, "the folder '" // folder // "' for the results cannot be written: " &
      & // last_reason() // "; name another with --output", wrong_usage)
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

  !> Takes a staging folder unless another process has it. Where there are no locks it must be new.
  subroutine take(staging, made, mine)
    type(staging_type), intent(inout) :: staging
    logical, intent(in) :: made
    logical, intent(out) :: mine
    logical :: held, busy

    mine = made
    call open_to_read(staging%path, staging%handle)
    if (staging%handle < 0) return
    call try_lock(staging%handle, .false., held, busy)
    mine = held .or. made .and. .not. busy
    if (.not. mine) call unlock_file(staging%handle)
  end subroutine take

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
    replaces = [(is_there(self%folder // "/" // trim(names(i))), i = 1, size(names))]
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
        if (all(names /= picture)) call remove_file(staging%folder // "/" // picture)
      end do
    end do
  end subroutine remove_old_pictures

  !> Ends without moving any file.
  subroutine discard(self)
    class(staging_type), intent(inout) :: self
    logical :: done

    call leave(self, done)
  end subroutine discard

  !> Removes the staging folder, and that of the results where it was made for nothing.
  subroutine leave(staging, done)
    type(staging_type), intent(inout) :: staging
    logical, intent(out) :: done
    integer(c_int) :: guard

    call take_turn(staging%folder, guard)
    ! Hundreds of files could stand there, as a rule none does.
    call remove_folder(staging%path, done)
    if (.not. done) then
      call empty(staging)
      call remove_file(staging%path // "/" // journal_name)
      call remove_file(staging%path // "/" // journal_name // growing)
      call remove_folder(staging%path, done)
    end if
    call unlock_file(staging%handle)
    staging%handle = -1
    call unlock_file(guard)
    call remove_made(staging%folder, staging%made)
  end subroutine leave

  subroutine empty(staging)
    type(staging_type), intent(in) :: staging
    character(len=longest_file) :: name
    integer :: i

    associate (names => result_files(staging%tables))
      do i = 1, size(names)
        name = names(i)
        call remove_file(staging%path // "/" // trim(name))
        call remove_file(staging%path // "/" // trim(name) // growing)
        call remove_file(staging%path // "/" // trim(name) // old)
      end do
    end associate
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
