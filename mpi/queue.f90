!> Who computes what: a number in the memory of rank 0, which every rank reads and raises by one, so that no rank is kept
!> for giving out work.
module queue
  use mpi_f08, only: mpi_address_kind, mpi_any_source, mpi_any_tag, mpi_barrier, mpi_comm_world, mpi_info_null, mpi_integer8, &
    & mpi_iprobe, mpi_lock_exclusive, mpi_mode_nocheck, mpi_request, mpi_rget_accumulate, mpi_status_ignore, mpi_sum, &
    & mpi_wait, mpi_win, mpi_win_allocate, mpi_win_free, mpi_win_lock, mpi_win_lock_all, mpi_win_unlock, mpi_win_unlock_all
  use ranks, only: own_rank
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_ptr
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: open_queue

  !> Numbers 1 ... length, each of which one rank gets. A rank asks for its next number before it works on the one it has:
  !> where the network cannot reach into the memory of rank 0 by itself, the answer comes when rank 0 calls MPI the next
  !> time, at the latest after the tile that it has in hands.
  type, public :: queue_type
    private
    type(mpi_win) :: window
    type(mpi_request) :: request
    integer :: length = 0
    !> What is added, and what was there before: pointers, for MPI reads and writes them behind the compiler's back.
    integer(int64), pointer :: step => null(), before => null()
  contains
    procedure :: ask
    procedure :: answer
    procedure :: stop_all
    procedure :: close => close_queue
  end type queue_type

  integer(mpi_address_kind), parameter :: displacement = 0
  integer, parameter :: looks = 4

contains

  !> All ranks open it together.
  subroutine open_queue(queue, length)
    type(queue_type), intent(out) :: queue
    integer, intent(in) :: length
    integer, parameter :: bytes = storage_size(0_int64) / 8
    integer(int64), pointer :: taken
    type(c_ptr) :: base

    queue%length = length
    allocate(queue%step, queue%before)
    call mpi_win_allocate(int(merge(bytes, 0, own_rank() == 0), mpi_address_kind), bytes, mpi_info_null, mpi_comm_world, base, &
      & queue%window)
    if (own_rank() == 0) then
      call mpi_win_lock(mpi_lock_exclusive, 0, 0, queue%window)
      call c_f_pointer(base, taken)
      taken = 0
      call mpi_win_unlock(0, queue%window)
    end if
    call mpi_barrier(mpi_comm_world)
    call mpi_win_lock_all(mpi_mode_nocheck, queue%window)
  end subroutine open_queue

  !> Asks for a number; `answer` brings it.
  subroutine ask(self)
    class(queue_type), intent(inout) :: self

    call take(self, 1)
  end subroutine ask

  !> The number that was asked for, 0 if there are no more.
  integer function answer(self) result(number)
    class(queue_type), intent(inout) :: self

    call mpi_wait(self%request, mpi_status_ignore)
    number = 0
    if (self%before < self%length) number = int(self%before) + 1
  end function answer

  !> Nobody gets any more numbers. What was asked for before is to be answered.
  subroutine stop_all(self)
    class(queue_type), intent(inout) :: self

    call take(self, self%length)
    call mpi_wait(self%request, mpi_status_ignore)
  end subroutine stop_all

  !> Takes so many numbers at once. MPI_Fetch_and_op would need MPI_Win_flush, which asks rank 0 a second time. The probes
  !> let rank 0 answer the others: what it does to its own memory need not look at the network. One look may bring a question,
  !> the next one sends the answer.
  subroutine take(queue, numbers)
    class(queue_type), intent(inout) :: queue
    integer, intent(in) :: numbers
    logical :: message
    integer :: i

    do i = 1, looks
      call mpi_iprobe(mpi_any_source, mpi_any_tag, mpi_comm_world, message, mpi_status_ignore)
    end do
    queue%step = numbers
    call mpi_rget_accumulate(queue%step, 1, mpi_integer8, queue%before, 1, mpi_integer8, 0, displacement, 1, mpi_integer8, &
      & mpi_sum, queue%window, queue%request)
  end subroutine take

  !> All ranks close it together.
  subroutine close_queue(self)
    class(queue_type), intent(inout) :: self

    call mpi_win_unlock_all(self%window)
    call mpi_win_free(self%window)
    deallocate(self%step, self%before)
  end subroutine close_queue

end module queue
