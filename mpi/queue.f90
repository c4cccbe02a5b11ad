!> Distributes work over MPI ranks by a counter in the memory of rank 0. Each rank reads and increments the counter itself, so that
!> no rank is occupied with distributing work.
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

  !> Hands out the numbers 1 ... length, each to one rank. A rank requests its next number before it works on the current one, which
  !> hides the delay of the answer. If the network cannot access the memory of rank 0 directly, the answer arrives when rank 0 next
  !> calls MPI, at the latest after its current tile.
  type, public :: queue_type
    private
    type(mpi_win) :: window
    type(mpi_request) :: request
    integer :: length = 0
    !> Increment of the counter, and its value before the increment. Pointers, because MPI accesses them without the compiler's
    !> knowledge.
    integer(int64), pointer :: step => null(), before => null()
  contains
    procedure :: request_next
    procedure :: answer
    procedure :: stop_all
    procedure :: close => close_queue
  end type queue_type

  integer(mpi_address_kind), parameter :: displacement = 0
  integer, parameter :: probe_count = 4

contains

  !> Creates the queue; all ranks must call this together.
  subroutine open_queue(queue, length)
    type(queue_type), intent(out) :: queue
    integer, intent(in) :: length
    integer, parameter :: bytes = storage_size(0_int64) / 8
    integer(int64), pointer :: counter
    type(c_ptr) :: base

    queue%length = length
    allocate(queue%step, queue%before)
    call mpi_win_allocate(int(merge(bytes, 0, own_rank() == 0), mpi_address_kind), bytes, mpi_info_null, mpi_comm_world, base, &
      & queue%window)
    if (own_rank() == 0) then
      call mpi_win_lock(mpi_lock_exclusive, 0, 0, queue%window)
      call c_f_pointer(base, counter)
      counter = 0
      call mpi_win_unlock(0, queue%window)
    end if
    call mpi_barrier(mpi_comm_world)
    call mpi_win_lock_all(mpi_mode_nocheck, queue%window)
  end subroutine open_queue

  !> Requests a number; `answer` returns it.
  subroutine request_next(self)
    class(queue_type), intent(inout) :: self

    call fetch_numbers(self, 1)
  end subroutine request_next

  !> Waits for the requested number; 0 if none are left.
  integer function answer(self) result(number)
    class(queue_type), intent(inout) :: self

    call mpi_wait(self%request, mpi_status_ignore)
    number = 0
    if (self%before < self%length) number = int(self%before) + 1
  end function answer

  !> Stops the queue: no rank gets further numbers. Call `answer` for an open request first.
  subroutine stop_all(self)
    class(queue_type), intent(inout) :: self

    call fetch_numbers(self, self%length)
    call mpi_wait(self%request, mpi_status_ignore)
  end subroutine stop_all

  !> Requests several numbers at once. MPI_Fetch_and_op would need MPI_Win_flush, which contacts rank 0 a second time. The probes
  !> let rank 0 answer other ranks, because its access to its own memory need not serve the network. One probe may receive a
  !> request, and the next one sends the answer.
  subroutine fetch_numbers(queue, numbers)
    class(queue_type), intent(inout) :: queue
    integer, intent(in) :: numbers
    logical :: message
    integer :: i

    do i = 1, probe_count
      call mpi_iprobe(mpi_any_source, mpi_any_tag, mpi_comm_world, message, mpi_status_ignore)
    end do
    queue%step = numbers
    call mpi_rget_accumulate(queue%step, 1, mpi_integer8, queue%before, 1, mpi_integer8, 0, displacement, 1, mpi_integer8, &
      & mpi_sum, queue%window, queue%request)
  end subroutine fetch_numbers

  !> Frees the queue; all ranks must call this together.
  subroutine close_queue(self)
    class(queue_type), intent(inout) :: self

    call mpi_win_unlock_all(self%window)
    call mpi_win_free(self%window)
    deallocate(self%step, self%before)
  end subroutine close_queue

end module queue
