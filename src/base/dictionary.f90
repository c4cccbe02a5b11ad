!> Words and their positions in a list, found in a time that does not depend on how many there are.
module gestell_base_dictionary
  use gestell_base_hash, only: hash_start, mix_text
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  !> Blanks at the end of a word do not count.
  type, public :: dictionary_type
    private
    integer :: count = 0
    !> All words in a row, and where each begins, less one, and the last one ends: both with room for more.
    character(len=:), allocatable :: text
    integer, allocatable :: ends(:)
    !> Positions in the list, or 0: each word stands where its hash points to, or in the next free slot. At least half are free.
    integer, allocatable :: slots(:)
  contains
    procedure :: add
    procedure :: position
  end type dictionary_type

contains

  !> Puts a word at the end of the list, whether it is there already or not.
  pure subroutine add(self, word)
    class(dictionary_type), intent(inout) :: self
    character(len=*), intent(in) :: word
    integer :: first, last, i

    call make_room(self, len_trim(word))
    self%count = self%count + 1
    first = self%ends(self%count) + 1
    last = first - 1 + len_trim(word)
    self%text(first:last) = trim(word)
    self%ends(self%count + 1) = last
    i = free_slot(self%slots, word)
    self%slots(i) = self%count
  end subroutine add

  !> The first position of a word in the list, 0 where it is not there.
  pure integer function position(self, word)
    class(dictionary_type), intent(in) :: self
    character(len=*), intent(in) :: word
    integer :: i

    position = 0
    if (self%count == 0) return
    i = first_slot(self%slots, word)
    do while (self%slots(i) > 0)
      position = self%slots(i)
      if (self%text(self%ends(position) + 1:self%ends(position + 1)) == word) return
      i = 1 + mod(i, size(self%slots))
    end do
    position = 0
  end function position

  !> Room for one more word of that length: twice as much as before where it is short. The words keep their order, so the first
  !> of equal ones is still found first.
  pure subroutine make_room(self, length)
    class(dictionary_type), intent(inout) :: self
    integer, intent(in) :: length
    integer :: k, i

    if (.not. allocated(self%slots)) then
      self%text = repeat(" ", 64)
      self%ends = spread(0, 1, 9)
      allocate(self%slots(16), source=0)
    end if
    do while (self%ends(self%count + 1) + length > len(self%text))
      self%text = self%text // self%text
    end do
    if (self%count + 1 < size(self%ends)) return
    self%ends = [self%ends, self%ends]
    deallocate(self%slots)
    allocate(self%slots(2 * size(self%ends)), source=0)
    do k = 1, self%count
      i = free_slot(self%slots, self%text(self%ends(k) + 1:self%ends(k + 1)))
      self%slots(i) = k
    end do
  end subroutine make_room

  !> Where a word that is not there yet belongs.
  pure integer function free_slot(slots, word) result(i)
    integer, intent(in) :: slots(:)
    character(len=*), intent(in) :: word

    i = first_slot(slots, word)
    do while (slots(i) > 0)
      i = 1 + mod(i, size(slots))
    end do
  end function free_slot

  pure integer function first_slot(slots, word)
    integer, intent(in) :: slots(:)
    character(len=*), intent(in) :: word
    integer(int64) :: hash

    hash = hash_start
    call mix_text(hash, trim(word))
    first_slot = 1 + int(modulo(hash, size(slots, kind=int64)))
  end function first_slot

end module gestell_base_dictionary
