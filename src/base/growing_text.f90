!> Defines a text that grows at its end. Its storage is doubled when it is full. The total time for appending is therefore
!> proportional to the total length.
module gestell_base_growing_text
  implicit none (type, external)
  private

  !> A text that is built by appending pieces.
  type, public :: growing_text_type
    private
    character(len=:), allocatable :: room
    integer :: used = 0
    !> Total number of characters that have been copied because the storage was full
    integer, public :: moved = 0
  contains
    procedure :: append, whole
  end type growing_text_type

  integer, parameter :: least_room = 1024

contains

  !> Appends a piece.
  pure subroutine append(self, piece)
    class(growing_text_type), intent(inout) :: self
    character(len=*), intent(in) :: piece
    character(len=:), allocatable :: wider

    if (.not. allocated(self%room)) allocate(character(len=max(least_room, len(piece))) :: self%room)
    if (self%used + len(piece) > len(self%room)) then
      allocate(character(len=max(2 * len(self%room), self%used + len(piece))) :: wider)
      wider(:self%used) = self%room(:self%used)
      self%moved = self%moved + self%used
      call move_alloc(wider, self%room)
    end if
    self%room(self%used + 1:self%used + len(piece)) = piece
    self%used = self%used + len(piece)
  end subroutine append

  !> The whole text.
  pure function whole(self) result(text)
    class(growing_text_type), intent(in) :: self
    character(len=self%used) :: text

    if (self%used > 0) text = self%room(:self%used)
  end function whole

end module gestell_base_growing_text
