!> The file of one tile of a sweep: one sealed record. It stands under its name only when it is complete.
module gestell_task_sweep_block
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_files, only: file_size
  use gestell_output_file_output, only: write_file
  use gestell_output_file_sealed, only: read_words, sealed, sealed_head, unseal, word_bytes
  use gestell_study_tile_results, only: tile_results_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: read_block, read_rows, write_block

  !> Words before the numbers: tile, shape of the numbers (3), solutions, checks, deviation.
  integer, parameter :: own_words = 7

contains

  !> Writes the results of a tile to the file `name`. Error: it cannot be written, as on a full disk.
  subroutine write_block(name, fingerprint, tile, results, error)
    character(len=*), intent(in) :: name
    integer(int64), intent(in) :: fingerprint
    integer, intent(in) :: tile
    type(tile_results_type), intent(in) :: results
    type(error_type), allocatable, intent(out) :: error
    integer(int64), allocatable :: words(:)

    words = sealed(fingerprint, [int(tile, int64), shape(results%values, int64), int(results%solutions, int64), &
      & int(results%checks, int64), transfer(results%deviation, 0_int64), transfer(results%values, [0_int64])])
    call write_file(name, transfer(words, repeat(" ", word_bytes * size(words))), error)
  end subroutine write_block

  !> The results of a tile from the file `name`; `sound` if it is complete and not damaged.
  subroutine read_block(name, fingerprint, tile, results, sound)
    character(len=*), intent(in) :: name
    integer(int64), intent(out) :: fingerprint
    integer, intent(out) :: tile
    type(tile_results_type), intent(out) :: results
    logical, intent(out) :: sound
    integer(int64), allocatable :: words(:)
    integer :: content(2)

    tile = 0
    call read_words(name, words)
    call unseal(words, 1, fingerprint, content, sound)
    if (sound) sound = word_bytes * (content(2) + 1_int64) == file_size(name) .and. content(2) - content(1) >= own_words
    if (.not. sound) return
    associate (own => words(content(1):content(2)))
      sound = all(own(2:4) > 0) .and. product(own(2:4)) == size(own) - own_words
      if (.not. sound) return
      tile = int(own(1))
      results%solutions = int(own(5))
      results%checks = int(own(6))
      results%deviation = transfer(own(7), results%deviation)
      allocate(results%values(own(2), own(3), own(4)))
      results%values = reshape(transfer(own(own_words + 1:), [0.0_dp]), shape(results%values))
    end associate
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
      read (unit, pos=1 + word_bytes * (sealed_head + own_words + (i - 1) * size(values(:, :, 1))), iostat=status) values
      close (unit)
    end if
    if (status /= 0) call fatal_error(error, name // ": cannot be read any more", failed_computation)
  end subroutine read_rows

end module gestell_task_sweep_block
