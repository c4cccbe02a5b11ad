!> Computes a hash of data from words of 64 bits, on the principle of FNV-1a (Fowler, Noll, Vo). The hash reveals damaged data and
!> data that belong to another input; it is not cryptographic.
module gestell_base_hash
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: mix, mix_bytes, mix_text

  !> Initial value of every hash, before any data are mixed in.
  integer(int64), parameter, public :: hash_start = int(z"4BF29CE484222325", int64)

  !> Constants of FNV-1a: the prime is 2^40 + 435 (2^shift + rest). `low` masks the lower 32 bits of a word.
  integer(int64), parameter :: shift = 40_int64, rest = 435_int64, low = int(z"FFFFFFFF", int64)

contains

  !> Hash that results when one more 64-bit word is mixed into `hash`.
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

  !> Updates a hash with 64-bit words.
  pure subroutine mix(hash, words)
    integer(int64), intent(inout) :: hash
    integer(int64), intent(in) :: words(:)
    integer :: i

    do i = 1, size(words)
      hash = mixed(hash, words(i))
    end do
  end subroutine mix

  !> Updates a hash with the characters of a text, one by one, and with an end mark.
  pure subroutine mix_text(hash, text)
    integer(int64), intent(inout) :: hash
    character(len=*), intent(in) :: text
    integer :: i

    do i = 1, len(text)
      hash = mixed(hash, int(ichar(text(i:i)), int64))
    end do
    hash = mixed(hash, -1_int64)
  end subroutine mix_text

  !> Updates a hash with bytes, eight at a time. The last eight are padded with blanks if necessary.
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
