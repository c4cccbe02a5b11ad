!> Reads and writes the rows of a sweep in the file that becomes its table. Each tile has its own positions in the file.
module gestell_task_sweep_rows
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_files, only: close_file, get_system_message, open_to_read, open_to_write, read_at, write_bytes
  use gestell_base_hash, only: hash_start, mix_bytes
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_study_grid, only: tile_type
  use gestell_task_sweep_layout, only: layout_type, piece_type
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: checksum_of, end_writing, read_values, write_tile

contains

  !> Checksum of those rows in the open file `rows` that belong to a tile; 0 if they cannot be read. `head`: length of the file's
  !> header in bytes.
  integer(int64) function checksum_of(layout, rows, head, tile) result(checksum)
    type(layout_type), intent(in) :: layout
    integer(c_int), intent(in) :: rows
    integer(int64), intent(in) :: head
    type(tile_type), intent(in) :: tile
    type(piece_type), allocatable :: pieces(:)
    character(len=:), allocatable :: bytes
    integer :: k
    logical :: done

    checksum = hash_start
    pieces = layout%pieces(tile)
    do k = 1, size(pieces)
      call read_piece(layout, rows, head, pieces(k), bytes, done)
      if (.not. done) exit
      call mix_bytes(checksum, bytes)
    end do
    if (.not. done) checksum = 0
  end function checksum_of

  !> Reads the rows of a piece from the open file `rows`.
  subroutine read_piece(layout, rows, head, piece, bytes, done)
    type(layout_type), intent(in) :: layout
    integer(c_int), intent(in) :: rows
    integer(int64), intent(in) :: head
    type(piece_type), intent(in) :: piece
    character(len=:), allocatable, intent(out) :: bytes
    logical, intent(out) :: done

    allocate(character(len=layout%width * product(piece%last - piece%first + 1)) :: bytes)
    call read_at(rows, head + layout%place(piece%first) + 1, bytes, done)
  end subroutine read_piece

  !> Reads the values at all points from the file. Fails if they cannot be read.
  subroutine read_values(layout, name, head, values, error)
    type(layout_type), intent(in) :: layout
    !> Path of the file of the rows
    character(len=*), intent(in) :: name
    !> Length of the header before the rows, in bytes
    integer(int64), intent(in) :: head
    !> Results at all points, shape (results per point, points of the second axis, points of the first axis)
    real(dp), intent(inout) :: values(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    type(piece_type), allocatable :: pieces(:)
    character(len=:), allocatable :: bytes
    integer(c_int) :: handle
    integer :: i, k
    logical :: done, closed

    if (size(values) == 0) return
    call open_to_read(name, handle)
    done = handle >= 0
    do i = 1, layout%grid%tiles()
      pieces = layout%pieces(layout%grid%tile(i))
      do k = 1, size(pieces)
        if (done) call read_piece(layout, handle, head, pieces(k), bytes, done)
        if (.not. done) exit
        associate (first => pieces(k)%first, last => pieces(k)%last)
          call layout%values(bytes, values(:, first(2):last(2), first(1):last(1)))
        end associate
      end do
    end do
    if (handle >= 0) call close_file(handle, closed)
    if (.not. done) call fatal_error(error, name // ": can no longer be read", failed_computation)
  end subroutine read_values

  !> Writes the rows of a tile to the file. Fails if they cannot be written.
  subroutine write_tile(layout, name, head, tile, values, checksum, error)
    type(layout_type), intent(in) :: layout
    !> Path of the file of the rows
    character(len=*), intent(in) :: name
    !> Length of the header before the rows, in bytes
    integer(int64), intent(in) :: head
    type(tile_type), intent(in) :: tile
    !> Results of the tile, shape (results per point, points of the second axis, points of the first axis)
    real(dp), contiguous, intent(in) :: values(:, :, :)
    !> Checksum of the bytes that were written
    integer(int64), intent(out) :: checksum
    type(error_type), allocatable, intent(out) :: error
    type(piece_type), allocatable :: pieces(:)
    character(len=:), allocatable :: rows
    integer(c_int) :: handle
    integer :: first, last, k
    logical :: done

    checksum = hash_start
    pieces = layout%pieces(tile)
    call open_to_write(name, handle)
    done = handle >= 0
    do k = 1, size(pieces)
      if (.not. done) exit
      ! Each piece extends over the whole second axis of the tile.
      first = pieces(k)%first(1) - tile%first(1) + 1
      last = pieces(k)%last(1) - tile%first(1) + 1
      rows = layout%rows(pieces(k)%first, values(:, :, first:last))
      call mix_bytes(checksum, rows)
      call write_bytes(handle, rows, done, head + layout%place(pieces(k)%first) + 1)
    end do
    call end_writing(handle, done, name // ": tile " // text(tile%number), error)
  end subroutine write_tile

  !> Closes a file that was opened for writing. Fails if the last write was not completed (`done` is false), or if the file cannot
  !> be closed. The error message contains `name`.
  subroutine end_writing(handle, done, name, error)
    integer(c_int), intent(in) :: handle
    logical, intent(in) :: done
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: reason
    logical :: closed

    if (.not. done) call get_system_message(reason)
    closed = .true.
    if (handle >= 0) call close_file(handle, closed)
    if (done .and. closed) return
    if (done) call get_system_message(reason)
    call fatal_error(error, name // ": cannot be written: " // reason, failed_computation)
    error%write_failed = .true.
  end subroutine end_writing

end module gestell_task_sweep_rows
