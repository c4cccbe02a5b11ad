!> Work that is spread over the ranks of MPI. Rank 0 tells and writes.
module ranked_executor
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_input_wording, only: counted
  use gestell_task_common_executor, only: executor_type, work_type
  use queue, only: open_queue, queue_type
  use ranks, only: number_of_ranks, own_rank, same_everywhere, share_first_error => share_error, share_marks
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  type, extends(executor_type), public :: ranked_executor_type
  contains
    procedure :: spread
    procedure, nopass :: leads
    procedure, nopass :: share_of
    procedure, nopass :: share_error
    procedure, nopass :: share_marks
    procedure, nopass :: compare
    procedure, nopass :: workers
  end type ranked_executor_type

contains

  !> Each rank computes those of the pieces that the queue gives to it, and keeps what it finds where all ranks can read it. Error:
  !> that of the first piece, in the order of `pieces`, that failed.
  subroutine spread(self, work, pieces, error, points)
    class(ranked_executor_type), intent(inout) :: self
    class(work_type), intent(inout) :: work
    integer, intent(in) :: pieces(:)
    type(error_type), allocatable, intent(out) :: error
    integer(int64), intent(in), optional :: points(:)
    type(queue_type) :: queue
    integer :: k, last

    last = 0
    call open_queue(queue, size(pieces))
    call queue%ask()
    do
      k = queue%answer()
      if (k == 0) exit
      call queue%ask()
      last = k
      call work%compute(pieces(k), error)
      if (.not. allocated(error)) cycle
      ! A piece that this rank has asked for since comes after this one: no error before this one is missed.
      k = queue%answer()
      call queue%stop_all()
      exit
    end do
    call queue%close()
    call share_first_error(error, last)
    associate (unused_executor => self, unused_points => points)
    end associate
  end subroutine spread

  logical function leads()
    leads = own_rank() == 0
  end function leads

  function share_of(count) result(mine)
    integer, intent(in) :: count
    logical :: mine(count)

    mine = .false.
    mine(1 + own_rank()::number_of_ranks()) = .true.
  end function share_of

  subroutine share_error(error)
    type(error_type), allocatable, intent(inout) :: error

    call share_first_error(error)
  end subroutine share_error

  subroutine compare(content, name, error)
    integer(int64), intent(in) :: content
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error

    if (.not. same_everywhere(content)) call fatal_error(error, name // ": is not the same file for all ranks", invalid_input)
  end subroutine compare

  function workers() result(line)
    character(len=:), allocatable :: line

    line = "  computed by " // counted(number_of_ranks(), "rank") // new_line("a")
  end function workers

end module ranked_executor
