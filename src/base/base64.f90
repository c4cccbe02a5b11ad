!> Encodes bytes as text with an alphabet of 64 characters (base64, RFC 4648, section 4).
module gestell_base_base64
  implicit none (type, external)
  private

  public :: base64

  character(len=64), parameter :: letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"

contains

  !> Encodes every three bytes as four characters. `=` fills the last four characters if fewer than three bytes remain.
  pure subroutine base64(bytes, encoded)
    character(len=*), intent(in) :: bytes
    character(len=:), allocatable, intent(out) :: encoded
    integer :: i, k, n, group, have, letter

    n = (len(bytes) + 2) / 3
    allocate(character(len=4 * n) :: encoded)
    do i = 1, n
      have = min(3, len(bytes) - 3 * (i - 1))
      group = 0
      do k = 1, 3
        group = 256 * group
        if (k <= have) group = group + iand(ichar(bytes(3 * (i - 1) + k:3 * (i - 1) + k)), 255)
      end do
      do k = 4, 1, -1
        letter = 1 + mod(group, 64)
        encoded(4 * (i - 1) + k:4 * (i - 1) + k) = letters(letter:letter)
        group = group / 64
      end do
      if (have < 3) encoded(4 * i:4 * i) = "="
      if (have < 2) encoded(4 * i - 1:4 * i - 1) = "="
    end do
  end subroutine base64

end module gestell_base_base64
