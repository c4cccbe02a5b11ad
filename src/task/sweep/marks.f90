!> Marks of the finished tiles of a sweep. Their file consists of sealed records (records with a checksum) of equal length. The mark
!> of each tile has a fixed position.
module gestell_task_sweep_marks
  use gestell_base_error, only: error_type
  use gestell_base_files, only: open_to_write, read_at, write_bytes
  use gestell_base_text, only: text
  use gestell_output_file_sealed, only: sealed, sealed_head, unseal, word_bytes
  use gestell_task_sweep_rows, only: end_writing
  use gestell_task_sweep_summary, only: summary_type, summary_words
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: read_mark, write_mark

  !> Mark that shows that a tile is finished.
  type, public :: mark_type
    !> Hash of the input and of the version of the program.
    integer(int64) :: fingerprint = 0
    integer :: tile = 0
    !> Checksum of the rows that belong to the tile.
    integer(int64) :: checksum = 0
    type(summary_type) :: summary
    !> `none`: true if the tile has no mark. `sound`: true if the mark is complete and not damaged.
    logical :: none = .true., sound = .false.
  end type mark_type

  !> Number of words of a record. A record consists of its head, the number of the tile, the checksum of the rows, the summary,
  !> and the checksum of the record.
  integer, parameter :: words_of_mark = sealed_head + 2 + summary_words + 1

contains

  !> Writes a mark to the position of its tile in the file `name`. Fails if the mark cannot be written.
  subroutine write_mark(name, mark, error)
    character(len=*), intent(in) :: name
    type(mark_type), intent(in) :: mark
    type(error_type), allocatable, intent(out) :: error
    character(len=word_bytes * words_of_mark) :: bytes
    integer(c_int) :: handle
    logical :: done

    bytes = transfer(sealed(mark%fingerprint, [int(mark%tile, int64), mark%checksum, transfer(mark%summary, [0_int64])]), bytes)
    call open_to_write(name, handle)
    done = handle >= 0
    if (done) call write_bytes(handle, bytes, done, place(mark%tile))
    call end_writing(handle, done, name // ": tile " // text(mark%tile), error)
  end subroutine write_mark

  !> Reads the mark of a tile from the open file `handle`.
  subroutine read_mark(handle, tile, mark)
    integer(c_int), intent(in) :: handle
    integer, intent(in) :: tile
    type(mark_type), intent(out) :: mark
    character(len=word_bytes * words_of_mark) :: bytes
    integer(int64) :: words(words_of_mark)
    integer :: content(2)
    logical :: done

    call read_at(handle, place(tile), bytes, done)
    if (.not. done) return
    words = transfer(bytes, words)
    mark%none = all(words == 0)
    call unseal(words, 1, mark%fingerprint, content, mark%sound)
    if (mark%sound) mark%sound = content(2) == words_of_mark - 1
    if (.not. mark%sound) return
    mark%tile = int(words(content(1)))
    mark%checksum = words(content(1) + 1)
    mark%summary = transfer(words(content(1) + 2:content(2)), mark%summary)
    mark%sound = mark%tile == tile
  end subroutine read_mark

  pure integer(int64) function place(tile)
    integer, intent(in) :: tile

    place = 1 + int(word_bytes * words_of_mark, int64) * (tile - 1)
  end function place

end module gestell_task_sweep_marks
