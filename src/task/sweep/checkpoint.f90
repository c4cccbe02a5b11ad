!> Manages the files of a sweep in the folder sweep.blocks while the sweep is computed.
!>
!> A tile is a rectangle of grid points that is computed as one piece of work. In the file `rows` the rows of each tile have a
!> fixed position (gestell_task_sweep_layout). The file `marks` lists the finished tiles. The mark of a tile is written after its
!> rows; rows without a mark are ignored. One or several processes compute tiles and pass them to `store`; they may continue an
!> interrupted run. `finish` turns `rows` into the table: it adds the header and the name.
!>
!> The file `origin` identifies the input and the version of the program, and contains the header of the table. A process that
!> changes the folder locks the file `lock` exclusively; processes that store tiles share this lock. `lock` is created first and
!> removed last. Files with these names in a folder without `lock` do not belong to a sweep and are not changed.
module gestell_task_sweep_checkpoint
  use gestell_base_error, only: error_type, failed_computation, fatal_error, wrong_usage
  use gestell_base_files, only: close_file, file_size, link_file, lock_file, open_to_read, open_to_write, &
    & read_file, remove_file, remove_folder, rename_file, unlock_file, write_bytes
  use gestell_base_hash, only: mix_text
  use gestell_base_kinds, only: dp
  use gestell_base_version, only: version
  use gestell_base_text, only: newline, text
  use gestell_output_file_folder, only: is_foreign, make_folder
  use gestell_output_file_output, only: write_file
  use gestell_study_grid, only: tile_type
  use gestell_study_point, only: sweep_options
  use gestell_study_tile_results, only: tile_results_type
  use gestell_task_sweep_layout, only: layout_type, new_layout
  use gestell_task_sweep_marks, only: mark_type, read_mark, write_mark
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_rows, only: checksum_of, end_writing, read_values, write_tile
  use gestell_task_sweep_summary, only: summary_type
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: open_campaign

  !> A sweep, and the state of its files in the folder sweep.blocks.
  type, public :: campaign_type
    !> `done`: true for finished tiles. `damaged`: true for tiles whose rows or marks are damaged. Both have shape (tiles) and are
    !> valid only for tiles that were examined.
    logical, allocatable :: done(:), damaged(:)
    type(layout_type) :: layout
    !> Path of the folder sweep.blocks.
    character(len=:), allocatable, private :: blocks
    type(sweep_options), private :: options
    integer(int64), private :: content = 0, fingerprint = 0
    !> Length of the table's header in bytes, as read from `origin`.
    integer(int64), private :: head = 0
    !> True if `finish` has completed the table.
    logical, private :: finished = .false.
  contains
    procedure :: begin, has_begun, look, store, finish, clear
  end type campaign_type

  !> Maximum number of missing tiles that an error message lists.
  integer, parameter :: most_named = 10

contains

  !> Examines the state of a sweep in `folder` without changing anything. Fails if the folder contains points computed from another
  !> input or by another version of the program.
  subroutine open_campaign(campaign, folder, plan, content, error, selected)
    type(campaign_type), intent(out) :: campaign
    !> Folder that contains the folder sweep.blocks
    character(len=*), intent(in) :: folder
    type(sweep_plan_type), intent(in) :: plan
    !> Hash of the input; stored points with another hash belong to another input
    integer(int64), intent(in) :: content
    type(error_type), allocatable, intent(out) :: error
    !> True for the tiles to examine; by default all tiles are examined
    logical, intent(in), optional :: selected(:)

    campaign%blocks = folder // "/sweep.blocks"
    campaign%layout = new_layout(plan)
    campaign%options = plan%options
    campaign%content = content
    campaign%fingerprint = content
    call mix_text(campaign%fingerprint, version)
    allocate(campaign%done(plan%grid%tiles()), campaign%damaged(plan%grid%tiles()), source=.false.)
    call compare_origin(campaign, error)
    if (.not. allocated(error)) call campaign%look(selected)
  end subroutine open_campaign

  !> Finds out which of the `selected` tiles are finished; by default all tiles are examined. A tile is finished if its mark is
  !> valid and the checksum of its rows agrees with the mark.
  subroutine look(self, selected)
    class(campaign_type), intent(inout) :: self
    logical, intent(in), optional :: selected(:)
    type(mark_type) :: mark
    integer(c_int) :: rows, marks
    integer :: i
    logical :: closed

    self%done = .false.
    self%damaged = .false.
    if (.not. self%has_begun()) return
    call open_to_read(file_of(self, "marks"), marks)
    if (marks < 0) return
    call open_to_read(file_of(self, "rows"), rows)
    do i = 1, size(self%done)
      if (present(selected)) then
        if (.not. selected(i)) cycle
      end if
      call read_mark(marks, i, mark)
      if (mark%none) cycle
      self%done(i) = mark%sound .and. rows >= 0 .and. mark%fingerprint == self%fingerprint
      if (self%done(i)) self%done(i) = mark%checksum == checksum_of(self%layout, rows, self%head, self%layout%grid%tile(i))
      self%damaged(i) = .not. self%done(i)
    end do
    call close_file(marks, closed)
    if (rows >= 0) call close_file(rows, closed)
  end subroutine look

  !> Path of a file in the folder sweep.blocks.
  pure function file_of(campaign, file) result(name)
    type(campaign_type), intent(in) :: campaign
    character(len=*), intent(in) :: file
    character(len=:), allocatable :: name

    name = campaign%blocks // "/" // file
  end function file_of

  !> The first lines of `origin`: version of the program and hash of the input.
  pure function first_lines(campaign) result(lines)
    type(campaign_type), intent(in) :: campaign
    character(len=len(version) + 18) :: lines
    character(len=16) :: word

    write (word, "(z16.16)") campaign%content
    lines = version // newline // word // newline
  end function first_lines

  !> Reads the file `origin` and determines the length of the table's header. Fails if `origin` belongs to another input or to
  !> another version of the program, or if the folder contains files that are not from a sweep.
  subroutine compare_origin(campaign, error)
    type(campaign_type), intent(inout) :: campaign
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: note, reason
    integer :: first, second

    if (is_foreign(campaign%blocks, [character(len=6) :: "origin", "rows", "marks"], "lock")) then
      call fatal_error(error, campaign%blocks // ": is a symbolic link, or contains files that are not from a sweep; choose " &
        & // "another folder with --output", wrong_usage)
      return
    end if
    if (.not. campaign%has_begun()) return
    call read_file(file_of(campaign, "origin"), note)
    if (index(note, first_lines(campaign)) == 1) then
      campaign%head = len(note) - len(first_lines(campaign))
      return
    end if
    first = index(note, newline)
    second = first + index(note(first + 1:), newline)
    if (first == 0 .or. second == first) return
    reason = "of another input"
    if (note(:first - 1) /= version) reason = "by version " // note(:first - 1) // " of gestell (this is version " // version // ")"
    call fatal_error(error, campaign%blocks // ": contains an unfinished sweep " // reason // &
      & "; remove this folder to start again, or choose another with --output", wrong_usage)
  end subroutine compare_origin

  !> Checks the folder sweep.blocks. Fails if it no longer exists, or if `compare_origin` fails.
  subroutine check_folder_exists(campaign, error)
    type(campaign_type), intent(inout) :: campaign
    type(error_type), allocatable, intent(out) :: error

    call compare_origin(campaign, error)
    if (campaign%has_begun() .or. allocated(error)) return
    call fatal_error(error, campaign%blocks // ": no longer exists: another run has finished this sweep, or the folder was " &
      & // "removed", failed_computation)
  end subroutine check_folder_exists

  !> Creates the folder and its files before the first tile is stored. `preamble`: complete comment lines for the top of the table.
  !> The process that begins the sweep supplies them. Fails if the files cannot be written.
  subroutine begin(self, preamble, error)
    class(campaign_type), intent(inout) :: self
    character(len=*), intent(in) :: preamble
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: head
    integer(c_int) :: lock

    call make_folder(self%blocks, error)
    if (allocated(error)) return
    call lock_file(file_of(self, "lock"), lock, shared=.false.)
    ! Another process may have begun the sweep in the meantime.
    call compare_origin(self, error)
    if (.not. (self%has_begun() .or. allocated(error))) then
      call write_file(file_of(self, "rows"), "", error)
      if (.not. allocated(error)) call write_file(file_of(self, "marks"), "", error)
      head = self%layout%header
      ! A file of a NumPy array cannot contain comments.
      if (.not. self%layout%binary) head = preamble // head
      if (.not. allocated(error)) call write_file(file_of(self, "origin"), first_lines(self) // head, error)
      self%head = len(head)
    end if
    call unlock_file(lock)
  end subroutine begin

  !> True if a process has begun the sweep, so that the file `origin` exists.
  logical function has_begun(self)
    class(campaign_type), intent(in) :: self

    has_begun = file_size(file_of(self, "origin")) >= 0
  end function has_begun

  !> Stores the results of a tile. Several threads may call this procedure at the same time. Fails if the results cannot be written.
  subroutine store(self, number, results, error)
    class(campaign_type), intent(inout) :: self
    integer, intent(in) :: number
    type(tile_results_type), intent(in) :: results
    type(error_type), allocatable, intent(out) :: error
    type(tile_type) :: tile
    type(mark_type) :: mark
    integer(c_int) :: lock

    call lock_file(file_of(self, "lock"), lock, shared=.true.)
    !$omp critical (input_and_output)
    call check_folder_exists(self, error)
    !$omp end critical (input_and_output)
    if (.not. allocated(error)) then
      mark%fingerprint = self%fingerprint
      mark%tile = number
      tile = self%layout%grid%tile(number)
      call write_tile(self%layout, file_of(self, "rows"), self%head, tile, results%values, mark%checksum, error)
    end if
    if (.not. allocated(error)) then
      mark%summary = summary_type(solutions=results%solutions, checks=results%checks, deviation=results%deviation)
      call mark%summary%add_points(self%options, tile%first, results%values)
      call write_mark(file_of(self, "marks"), mark, error)
    end if
    call unlock_file(lock)
    self%done(number) = .not. allocated(error)
  end subroutine store

  !> Completes the table: writes its header, and gives the file its name in the folder `staging`. The file also keeps its name in
  !> sweep.blocks until `clear` is called. Fails if tiles are missing, or if a file cannot be written.
  subroutine finish(self, staging, summary, error, values)
    class(campaign_type), intent(inout) :: self
    !> Folder in which the finished table is placed
    character(len=*), intent(in) :: staging
    type(summary_type), intent(out) :: summary
    type(error_type), allocatable, intent(out) :: error
    !> Results at all points, shape (results per point, points of the second axis, points of the first axis). Size 0 if they are
    !> not needed
    real(dp), intent(inout), optional :: values(:, :, :)
    character(len=:), allocatable :: list
    integer(c_int) :: lock
    integer, allocatable :: missing(:)
    integer :: i

    missing = pack([(i, i = 1, size(self%done))], .not. self%done)
    if (size(missing) > 0) then
      list = text(missing(1))
      do i = 2, min(size(missing), most_named)
        list = list // ", " // text(missing(i))
      end do
      if (size(missing) > most_named) list = list // ", ..."
      call fatal_error(error, self%blocks // ": " // text(size(missing)) // " of " // text(size(self%done)) &
        & // " tiles are missing: " // list, failed_computation)
      return
    end if
    call lock_file(file_of(self, "lock"), lock, shared=.false.)
    call check_folder_exists(self, error)
    if (.not. allocated(error)) call sum_up(self, summary, error)
    if (.not. allocated(error) .and. present(values)) then
      call read_values(self%layout, file_of(self, "rows"), self%head, values, error)
    end if
    if (.not. allocated(error)) call publish_table(self, staging // "/" // self%layout%file, error)
    self%finished = .not. allocated(error)
    call unlock_file(lock)
  end subroutine finish

  !> Adds up the summaries of all tiles. Fails if a mark has changed or is damaged.
  subroutine sum_up(campaign, summary, error)
    type(campaign_type), intent(in) :: campaign
    type(summary_type), intent(inout) :: summary
    type(error_type), allocatable, intent(out) :: error
    type(mark_type) :: mark
    integer(c_int) :: handle
    integer :: i
    logical :: sound, closed

    call open_to_read(file_of(campaign, "marks"), handle)
    sound = file_size(file_of(campaign, "rows")) == campaign%head + campaign%layout%width * &
      & campaign%layout%grid%points() .and. handle >= 0
    do i = 1, size(campaign%done)
      if (.not. sound) exit
      call read_mark(handle, i, mark)
      sound = mark%sound .and. mark%fingerprint == campaign%fingerprint
      call summary%add(mark%summary)
    end do
    if (handle >= 0) call close_file(handle, closed)
    if (.not. sound) call fatal_error(error, campaign%blocks // ": was damaged during the run; start the sweep again", &
      & failed_computation)
  end subroutine sum_up

  !> Writes the header into the file of the rows, and adds the name of the table as a hard link to this file. If the run is killed
  !> before `clear`, all files still exist. If the file system does not support hard links, the file is renamed.
  subroutine publish_table(campaign, name, error)
    type(campaign_type), intent(in) :: campaign
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: note
    integer(c_int) :: handle
    logical :: done

    call read_file(file_of(campaign, "origin"), note)
    call open_to_write(file_of(campaign, "rows"), handle)
    done = handle >= 0
    if (done) call write_bytes(handle, note(len(first_lines(campaign)) + 1:), done, 1_int64)
    call end_writing(handle, done, file_of(campaign, "rows"), error)
    if (allocated(error)) return
    call link_file(file_of(campaign, "rows"), name, done)
    if (.not. done) call rename_file(file_of(campaign, "rows"), name, done)
    ! The file is closed, so there is no handle.
    call end_writing(-1_c_int, done, name, error)
  end subroutine publish_table

  !> Removes the folder after `finish`, when the table has its final name. If another run with another input has used the folder in
  !> the meantime, its files are kept.
  subroutine clear(self)
    class(campaign_type), intent(inout) :: self
    type(error_type), allocatable :: another
    integer(c_int) :: lock

    if (.not. self%finished) return
    call lock_file(file_of(self, "lock"), lock, shared=.false.)
    call compare_origin(self, another)
    if (.not. allocated(another)) then
      call remove_file(file_of(self, "origin"))
      call remove_file(file_of(self, "marks"))
      call remove_file(file_of(self, "rows"))
      call remove_file(file_of(self, "lock"))
      call remove_folder(self%blocks)
    end if
    call unlock_file(lock)
  end subroutine clear

end module gestell_task_sweep_checkpoint
