!> Implements a list of words with a hash table: the time needed to find a word does not increase with the length of the list.
module gestell_base_dictionary
  use gestell_base_hash, only: hash_start, mix_text
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  !> A list of words with a hash table. Trailing blanks of a word are ignored.
  type, public :: dictionary_type
    private
    integer :: count = 0
    !> `text` holds all words of the list one after the other; word k is text(ends(k) + 1:ends(k + 1)). `text` and `ends` are
    !> allocated longer than needed.
    character(len=:), allocatable :: text
    integer, allocatable :: ends(:)
    !> Hash table: each slot holds the index of a word in the list, or 0. A word is in the slot that its hash indicates or, if this
    !> slot was occupied, in the next free one. At least half of the slots are free.
    integer, allocatable :: slots(:)
  contains
    procedure :: add, position
  end type dictionary_type

contains

  !> Appends a word to the list. Words may occur several times.
  pure subroutine add(self, word)
    class(dictionary_type), intent(inout) :: self
    character(len=*), intent(in) :: word
    integer :: first, last

    call make_room(self, len_trim(word))
    self%count = self%count + 1
    first = self%ends(self%count) + 1
    last = first - 1 + len_trim(word)
    self%text(first:last) = trim(word)
    self%ends(self%count + 1) = last
    self%slots(free_slot(self%slots, word)) = self%count
  end subroutine add

  !> Index of the first occurrence of a word in the list; 0 if the list does not contain it.
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

  !> Makes room for one more word of `length` characters by doubling arrays that are full. When the hash table is rebuilt, words are
  !> entered in the order of the list, so that `position` still finds the first of several equal words.
  pure subroutine make_room(self, length)
    class(dictionary_type), intent(inout) :: self
    integer, intent(in) :: length
    integer :: k

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
      self%slots(free_slot(self%slots, self%text(self%ends(k) + 1:self%ends(k + 1)))) = k
    end do
  end subroutine make_room

  !> Index of the free slot in which a new word is to be entered.
  pure integer function free_slot(slots, word) result(i)
    integer, intent(in) :: slots(:)
    character(len=*), intent(in) :: word

    i = first_slot(slots, word)
    do while (slots(i) > 0)
      i = 1 + mod(i, size(slots))
    end do
  end function free_slot

  !> Index of the slot that the hash of a word indicates.
  pure integer function first_slot(slots, word)
    integer, intent(in) :: slots(:)
    character(len=*), intent(in) :: word
    integer(int64) :: hash

    hash = hash_start
    call mix_text(hash, trim(word))
    first_slot = 1 + int(modulo(hash, size(slots, kind=int64)))
  end function first_slot

end module gestell_base_dictionary
