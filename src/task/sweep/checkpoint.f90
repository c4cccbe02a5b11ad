!> The files of a sweep while it is computed: a block for every tile, and in the end the table. Whoever computes tiles,
!> in one process or many, now or after an interruption, gives them to `store`; `finish` makes of them the same bytes.
!> Whoever writes in the folder of the blocks holds the file `lock` there meanwhile.
module gestell_task_sweep_checkpoint
  use gestell_base_error, only: error_type, failed_computation, fatal_error, wrong_usage
  use gestell_base_hash, only: mix_text
  use gestell_base_kinds, only: dp
  use gestell_base_version, only: version
  use gestell_task_sweep_block, only: read_block, read_rows, write_block
  use gestell_base_files, only: file_size, lock_file, remove_file, remove_folder, unlock_file
  use gestell_output_file_folder, only: make_folder
  use gestell_task_sweep_plan, only: sweep_plan_type
  use gestell_output_file_output, only: growing, open_output, output_type, write_file
  use gestell_task_sweep_csv, only: header, rows
  use gestell_task_sweep_summary, only: summary_type
  use gestell_input_wording, only: decimal
  use gestell_study_grid, only: grid_type, tile_type
  use gestell_study_point, only: sweep_order_type
  use gestell_study_tile_results, only: tile_results_type
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: open_campaign

  type, public :: campaign_type
    !> Which tiles are done, of those that were looked for, and which of these had blocks that are of no use.
    logical, allocatable :: done(:), damaged(:)
    character(len=:), allocatable, private :: folder
    !> The names of the columns in the table.
    character(len=:), allocatable, private :: header
    type(grid_type), private :: grid
    type(sweep_order_type), private :: order
    integer(int64), private :: content = 0, fingerprint = 0
    !> Whether the table has been written.
    logical, private :: finished = .false.
  contains
    procedure :: begin
    procedure :: has_begun
    procedure :: store
    procedure :: finish
    procedure :: clear
  end type campaign_type

  character, parameter :: newline = new_line("a")

contains

  !> Looks what is there of a sweep in `folder`; nothing is changed. `content`: hash of the input. Only the `wanted` tiles
  !> are looked for, all by default. Error: there are blocks of another input or version.
  subroutine open_campaign(campaign, folder, plan, content, error, wanted)
    type(campaign_type), intent(out) :: campaign
    character(len=*), intent(in) :: folder
    type(sweep_plan_type), intent(in) :: plan
    integer(int64), intent(in) :: content
    type(error_type), allocatable, intent(out) :: error
    logical, intent(in), optional :: wanted(:)
    type(tile_results_type) :: results
    type(tile_type) :: tile
    integer(int64) :: fingerprint
    integer :: i, number
    logical :: sound

    campaign%folder = folder
    campaign%header = header(plan%paths, plan%units, plan%grid, plan%order)
    campaign%grid = plan%grid
    campaign%order = plan%order
    campaign%content = content
    campaign%fingerprint = content
    call mix_text(campaign%fingerprint, version)
    call compare_origin(campaign, error)
    if (allocated(error)) return
    allocate(campaign%done(plan%grid%tiles()), campaign%damaged(plan%grid%tiles()), source=.false.)
    do i = 1, size(campaign%done)
      if (present(wanted)) then
        if (.not. wanted(i)) cycle
      end if
      if (file_size(block_of(campaign, i)) < 0) cycle
      call read_block(block_of(campaign, i), fingerprint, number, results, sound)
      if (sound .and. fingerprint /= campaign%fingerprint) then
        call refuse_origin(campaign, "the input or the version differs", error)
        return
      end if
      tile = plan%grid%tile(i)
      if (sound) sound = number == i .and. all(shape(results%values) == shape_of(campaign, tile))
      campaign%done(i) = sound
      campaign%damaged(i) = .not. sound
    end do
  end subroutine open_campaign

  !> Numbers of a tile along the axes of `tile_results_type%values`.
  pure function shape_of(campaign, tile) result(shape)
    type(campaign_type), intent(in) :: campaign
    type(tile_type), intent(in) :: tile
    integer :: shape(3)

    shape = [campaign%order%numbers(), tile%last(2) - tile%first(2) + 1, tile%last(1) - tile%first(1) + 1]
  end function shape_of

  !> A file in the folder of the blocks: "origin" is the note that says what they belong to, "lock" is held while the folder is
  !> changed.
  pure function file_of(campaign, file) result(name)
    type(campaign_type), intent(in) :: campaign
    character(len=*), intent(in) :: file
    character(len=:), allocatable :: name

    name = campaign%folder // "/sweep.blocks/" // file
  end function file_of

  pure function block_of(campaign, tile) result(name)
    type(campaign_type), intent(in) :: campaign
    integer, intent(in) :: tile
    character(len=:), allocatable :: name
    character(len=10) :: digits

    write (digits, "(i10.10)") tile
    name = file_of(campaign, digits)
  end function block_of

  !> Version and content as words of the note.
  pure function content_word(campaign) result(word)
    type(campaign_type), intent(in) :: campaign
    character(len=16) :: word

    write (word, "(z16.16)") campaign%content
  end function content_word

  subroutine compare_origin(campaign, error)
    type(campaign_type), intent(in) :: campaign
    type(error_type), allocatable, intent(out) :: error
    character(len=64) :: lines(2)
    integer :: unit, status

    if (file_size(file_of(campaign, "origin")) < 0) return
    open (newunit=unit, file=file_of(campaign, "origin"), action="read", status="old", iostat=status)
    if (status /= 0) return
    read (unit, "(a)", iostat=status) lines
    close (unit)
    if (status /= 0) return
    if (lines(1) /= version) then
      call refuse_origin(campaign, "version " // trim(lines(1)) // " of gestell began it, this is " // version, error)
    else if (lines(2) /= content_word(campaign)) then
      call refuse_origin(campaign, "the input was another one", error)
    end if
  end subroutine compare_origin

  pure subroutine refuse_origin(campaign, reason, error)
    type(campaign_type), intent(in) :: campaign
    character(len=*), intent(in) :: reason
    type(error_type), allocatable, intent(out) :: error

    call fatal_error(error, campaign%folder // "/sweep.blocks: points of an unfinished sweep that do not fit, " // reason // &
      & "; remove this folder to start afresh, or name another with --output", wrong_usage)
  end subroutine refuse_origin

  !> Makes the folder for blocks, before the first is stored. Error: it cannot be made.
  subroutine begin(self, error)
    class(campaign_type), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error
    integer(c_int) :: lock

    call make_folder(self%folder // "/sweep.blocks", error)
    if (allocated(error)) return
    call lock_file(file_of(self, "lock"), lock)
    ! another process may have begun meanwhile
    call compare_origin(self, error)
    if (.not. allocated(error)) then
      if (file_size(file_of(self, "origin")) < 0) call write_file(file_of(self, "origin"), version // newline &
        & // content_word(self) // newline, error)
    end if
    call unlock_file(lock)
  end subroutine begin

  !> Whether there is a folder for blocks.
  logical function has_begun(self)
    class(campaign_type), intent(in) :: self

    has_begun = file_size(file_of(self, "origin")) >= 0
  end function has_begun

  !> Keeps the results of a tile. Error: they cannot be written.
  subroutine store(self, number, results, error)
    class(campaign_type), intent(inout) :: self
    integer, intent(in) :: number
    type(tile_results_type), intent(in) :: results
    type(error_type), allocatable, intent(out) :: error
    integer(c_int) :: lock

    call lock_file(file_of(self, "lock"), lock)
    call compare_origin(self, error)
    if (.not. allocated(error)) then
      if (file_size(file_of(self, "origin")) < 0) then
        call tell_gone(self, error)
      else
        call write_block(block_of(self, number), self%fingerprint, number, results, error)
      end if
    end if
    call unlock_file(lock)
    self%done(number) = .not. allocated(error)
  end subroutine store

  !> The blocks are no longer there.
  pure subroutine tell_gone(campaign, error)
    type(campaign_type), intent(in) :: campaign
    type(error_type), allocatable, intent(out) :: error

    call fatal_error(error, campaign%folder // "/sweep.blocks: is gone: another run has finished this sweep, or it was removed", &
      & failed_computation)
  end subroutine tell_gone

  !> Writes sweep.csv, headed by the lines of `preamble`, from the blocks of all tiles, to the folder `staging`.
  !> The blocks stay until `clear`. `values`: the points, shape (numbers, points of the second axis, of the first); of size
  !> 0 where they are not wanted.
  !> Errors: tiles are missing; a file cannot be written.
  subroutine finish(self, staging, preamble, summary, error, values)
    class(campaign_type), intent(inout) :: self
    character(len=*), intent(in) :: staging, preamble
    type(summary_type), intent(out) :: summary
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(inout), optional :: values(:, :, :)
    integer(c_int) :: lock

    call tell_missing(self, error)
    if (allocated(error)) return
    call lock_file(file_of(self, "lock"), lock)
    call write_table(self, staging, preamble, summary, error, values)
    self%finished = .not. allocated(error)
    call unlock_file(lock)
  end subroutine finish

  !> Removes the blocks after `finish`, when the table is in its folder; those that another input has begun meanwhile stay.
  subroutine clear(self)
    class(campaign_type), intent(in) :: self
    type(error_type), allocatable :: another
    integer(c_int) :: lock
    integer :: i

    if (.not. self%finished) return
    call lock_file(file_of(self, "lock"), lock)
    call compare_origin(self, another)
    if (.not. allocated(another)) then
      do i = 1, size(self%done)
        call remove_file(block_of(self, i))
        call remove_file(block_of(self, i) // growing)
      end do
      call remove_file(file_of(self, "origin"))
      call remove_file(file_of(self, "lock"))
      call remove_folder(self%folder // "/sweep.blocks")
    end if
    call unlock_file(lock)
  end subroutine clear

  !> Writes sweep.csv to `staging`. Error: it cannot be written, or a block is gone or damaged.
  subroutine write_table(self, staging, preamble, summary, error, values)
    class(campaign_type), intent(in) :: self
    character(len=*), intent(in) :: staging, preamble
    type(summary_type), intent(out) :: summary
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(inout), optional :: values(:, :, :)
    type(output_type) :: table
    integer :: first, last

    call open_output(table, staging // "/sweep.csv")
    call table%append(preamble // self%header // newline)
    last = 0
    do while (last < size(self%done) .and. .not. table%failed())
      first = last + 1
      last = last_beside(self%grid, first)
      call append_band(self, table, first, last, summary, error, values)
      if (allocated(error)) then
        call table%abandon()
        return
      end if
    end do
    call table%complete(error)
  end subroutine write_table

  subroutine tell_missing(self, error)
    type(campaign_type), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most = 10
    character(len=:), allocatable :: list
    integer :: i, missing, named

    missing = count(.not. self%done)
    if (missing == 0) return
    list = ""
    named = 0
    do i = 1, size(self%done)
      if (self%done(i)) cycle
      if (named == most) then
        list = list // ", ..."
        exit
      end if
      if (named > 0) list = list // ", "
      list = list // decimal(i)
      named = named + 1
    end do
    call fatal_error(error, self%folder // "/sweep.blocks: " // decimal(missing) // " of " // decimal(size(self%done)) &
      & // " tiles are missing: " // list, failed_computation)
  end subroutine tell_missing

  !> The last of the tiles that lie beside `first` along the second axis.
  pure integer function last_beside(grid, first) result(last)
    type(grid_type), intent(in) :: grid
    integer, intent(in) :: first
    type(tile_type) :: here, next

    here = grid%tile(first)
    do last = first, grid%tiles() - 1
      next = grid%tile(last + 1)
      if (next%first(1) /= here%first(1)) return
    end do
    last = grid%tiles()
  end function last_beside

  !> The rows of tiles that lie beside each other, in the grid's order.
  subroutine append_band(self, table, first, last, summary, error, values)
    class(campaign_type), intent(in) :: self
    type(output_type), intent(inout) :: table
    integer, intent(in) :: first, last
    type(summary_type), intent(inout) :: summary
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(inout), optional :: values(:, :, :)
    type(tile_results_type) :: results
    type(tile_type) :: tile
    integer(int64) :: fingerprint
    integer :: i, k, number, piece
    logical :: sound

    do k = first, last
      call read_block(block_of(self, k), fingerprint, number, results, sound)
      tile = self%grid%tile(k)
      if (sound) sound = fingerprint == self%fingerprint .and. number == k &
        & .and. all(shape(results%values) == shape_of(self, tile))
      if (.not. sound) then
        if (file_size(block_of(self, k)) < 0) then
          call tell_gone(self, error)
        else
          call fatal_error(error, block_of(self, k) // ": was damaged meanwhile; start again", failed_computation)
        end if
        return
      end if
      call summary%add_tile(results)
      if (present(values)) then
        if (size(values) > 0) values(:, tile%first(2):tile%last(2), tile%first(1):tile%last(1)) = results%values
      end if
    end do
    tile = self%grid%tile(first)
    ! a tile alone is written at once, those beside each other row by row
    piece = 1
    if (first == last) piece = tile%last(1) - tile%first(1) + 1
    do i = tile%first(1), tile%last(1), piece
      do k = first, last
        call append_piece(self, table, self%grid%tile(k), i, piece, summary, error)
        if (allocated(error)) return
      end do
    end do
  end subroutine append_band

  !> Rows `i` ... `i + piece - 1` of the first axis, as far as a tile has them.
  subroutine append_piece(self, table, tile, i, piece, summary, error)
    class(campaign_type), intent(in) :: self
    type(output_type), intent(inout) :: table
    type(tile_type), intent(in) :: tile
    integer, intent(in) :: i, piece
    type(summary_type), intent(inout) :: summary
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: values(:, :, :)

    allocate(values(self%order%numbers(), tile%last(2) - tile%first(2) + 1, piece))
    call read_rows(block_of(self, tile%number), i - tile%first(1) + 1, values, error)
    if (allocated(error)) return
    call summary%add_points(self%order%columns, [i, tile%first(2)], values)
    call table%append(rows(self%grid, self%order%columns, [i, tile%first(2)], values))
  end subroutine append_piece

end module gestell_task_sweep_checkpoint
