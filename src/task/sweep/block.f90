!> The file of one tile of a sweep: a head that says what it belongs to, the numbers, a checksum. It stands under its name
!> only when it is complete.
module gestell_task_sweep_block
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_hash, only: hash_start, mix
  use gestell_base_kinds, only: dp
  use gestell_base_files, only: file_size
  use gestell_output_file_output, only: write_file
  use gestell_study_tile_results, only: tile_results_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: read_block, read_rows, write_block

  !> Words of a head: magic number, fingerprint, tile, shape of the numbers (3), solutions, checks, deviation. The numbers
  !> follow, then the checksum of all before it.
  integer, parameter :: head_words = 9, word_bytes = 8
  !> "gestell" and the number of this format: another byte order does not fit either.
  integer(int64), parameter :: magic = int(z"67657374656C6C01", int64)

contains

  !> Writes the results of a tile to the file `name`. Error: it cannot be written, as on a full disk.
  subroutine write_block(name, fingerprint, tile, results, error)
    character(len=*), intent(in) :: name
    integer(int64), intent(in) :: fingerprint
    integer, intent(in) :: tile
    type(tile_results_type), intent(in) :: results
    type(error_type), allocatable, intent(out) :: error
    integer(int64), allocatable :: words(:)
    integer :: n

    n = head_words + size(results%values) + 1
    allocate(words(n))
    words(:head_words) = [magic, fingerprint, int(tile, int64), shape(results%values, int64), int(results%solutions, int64), &
      & int(results%checks, int64), transfer(results%deviation, 0_int64)]
    words(head_words + 1:n - 1) = transfer(results%values, words)
    words(n) = checksum(words(:n - 1))
    call write_file(name, transfer(words, repeat(" ", word_bytes * n)), error)
  end subroutine write_block

  !> The results of a tile from the file `name`; `sound` if it is complete and not damaged.
  subroutine read_block(name, fingerprint, tile, results, sound)
    character(len=*), intent(in) :: name
    integer(int64), intent(out) :: fingerprint
    integer, intent(out) :: tile
    type(tile_results_type), intent(out) :: results
    logical, intent(out) :: sound
    integer(int64), allocatable :: words(:)
    integer(int64) :: bytes
    integer :: unit, status, n

    fingerprint = 0
    tile = 0
    bytes = file_size(name)
    sound = bytes > word_bytes * (head_words + 1) .and. mod(bytes, int(word_bytes, int64)) == 0 &
      & .and. bytes <= int(huge(n), int64)
    if (.not. sound) return
    n = int(bytes / word_bytes)
    allocate(words(n))
    open (newunit=unit, file=name, access="stream", form="unformatted", action="read", status="old", iostat=status)
    if (status == 0) then
      read (unit, iostat=status) words
      close (unit)
    end if
    sound = status == 0
    if (.not. sound) return
    sound = words(1) == magic .and. words(n) == checksum(words(:n - 1))
    if (.not. sound) return
    sound = all(words(4:6) > 0) .and. product(words(4:6)) == n - head_words - 1
    if (.not. sound) return
    fingerprint = words(2)
    tile = int(words(3))
    results%solutions = int(words(7))
    results%checks = int(words(8))
    results%deviation = transfer(words(9), results%deviation)
    allocate(results%values(words(4), words(5), words(6)))
    results%values = reshape(transfer(words(head_words + 1:n - 1), [0.0_dp]), shape(results%values))
  end subroutine read_block

  !> The numbers of one row of a tile, point `i` of the first axis, from a file that is known to be sound; shape as in
  !> `tile_results_type`. Error: it cannot be read.
  subroutine read_rows(name, i, values, error)
    character(len=*), intent(in) :: name
    integer, intent(in) :: i
    real(dp), contiguous, intent(out) :: values(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: unit, status

    open (newunit=unit, file=name, access="stream", form="unformatted", action="read", status="old", iostat=status)
    if (status == 0) then
      read (unit, pos=1 + word_bytes * (head_words + (i - 1) * size(values(:, :, 1))), iostat=status) values
      close (unit)
    end if
    if (status /= 0) call fatal_error(error, name // ": cannot be read any more", failed_computation)
  end subroutine read_rows

  pure integer(int64) function checksum(words)
    integer(int64), intent(in) :: words(:)

    checksum = hash_start
    call mix(checksum, words)
  end function checksum

end module gestell_task_sweep_block
