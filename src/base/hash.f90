!> A hash based on FNV-1a (Fowler, Noll, Vo) that mixes words of 64 bits. It detects damaged data and data of another input; it is
!> not cryptographic.
module gestell_base_hash
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: mix, mix_bytes, mix_text

  !> Initial value of every hash.
  integer(int64), parameter, public :: hash_start = int(z"4BF29CE484222325", int64)

  !> The prime of FNV-1a is 2^40 + 435 (`shift`, `rest`); `low` masks the lower 32 bits.
  integer(int64), parameter :: shift = 40_int64, rest = 435_int64, low = int(z"FFFFFFFF", int64)

contains

  !> The hash after mixing in one more word.
  elemental integer(int64) function mixed(hash, word)
    integer(int64), intent(in) :: hash, word
    integer(int64) :: x, lower, upper

    ! x times the prime modulo 2^64, in two halves: no intermediate result overflows
    x = ieor(hash, word)
    lower = iand(x, low) * rest
    upper = ishft(x, -32) * rest + ishft(lower, -32) + ishft(iand(x, ishft(low, -8)), 8)
    x = ior(ishft(iand(upper, low), 32), iand(lower, low))
    ! without this, upper bits would never influence lower ones
    mixed = ieor(x, ishft(x, -29))
  end function mixed

  !> Mixes words of 64 bits into the hash.
  pure subroutine mix(hash, words)
    integer(int64), intent(inout) :: hash
    integer(int64), intent(in) :: words(:)
    integer :: i

    do i = 1, size(words)
      hash = mixed(hash, words(i))
    end do
  end subroutine mix

  !> Mixes the characters of a text, one by one, and an end mark into the hash.
  pure subroutine mix_text(hash, text)
    integer(int64), intent(inout) :: hash
    character(len=*), intent(in) :: text
    integer :: i

    do i = 1, len(text)
      hash = mixed(hash, int(ichar(text(i:i)), int64))
    end do
    hash = mixed(hash, -1_int64)
  end subroutine mix_text

  !> Mixes bytes into the hash, eight at a time. The last eight are padded with blanks.
  pure subroutine mix_bytes(hash, bytes)
    integer(int64), intent(inout) :: hash
    character(len=*), intent(in) :: bytes
    integer, parameter :: length = 8
    character(len=length) :: last
    integer :: i

    do i = 1, len(bytes) - length + 1, length
      hash = mixed(hash, transfer(bytes(i:i + length - 1), hash))
    end do
    last = bytes(len(bytes) - mod(len(bytes), length) + 1:)
    hash = mixed(hash, transfer(last, hash))
  end subroutine mix_bytes

end module gestell_base_hash
