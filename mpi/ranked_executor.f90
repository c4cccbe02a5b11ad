!> Distributes the work of a task over MPI ranks. Rank 0 prints and writes the files.
module ranked_executor
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_input_wording, only: counted
  use gestell_task_common_executor, only: executor_type, work_type
  use queue, only: open_queue, queue_type
  use ranks, only: number_of_ranks, own_rank, same_everywhere, share_first_error => share_error, share_marks
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  !> An executor that uses all MPI ranks.
  type, extends(executor_type), public :: ranked_executor_type
  contains
    procedure :: distribute
    procedure, nopass :: is_leader
    procedure, nopass :: share_of
    procedure, nopass :: share_error
    procedure, nopass :: share_marks
    procedure, nopass :: compare
    procedure, nopass :: workers_line
  end type ranked_executor_type

contains

  !> Computes pieces of work on all ranks. Each rank takes pieces from the queue and stores its results where all ranks can read
  !> them. Fails with the error of the first failed piece, in the order of `pieces`.
  subroutine distribute(self, work, pieces, error, points)
    class(ranked_executor_type), intent(inout) :: self
    class(work_type), intent(inout) :: work
    integer, intent(in) :: pieces(:)
    type(error_type), allocatable, intent(out) :: error
    integer(int64), intent(in), optional :: points(:)
    type(queue_type) :: queue
    integer :: k, last

    last = 0
    call open_queue(queue, size(pieces))
    call queue%request_next()
    do
      k = queue%answer()
      if (k == 0) exit
      call queue%request_next()
      last = k
      call work%compute(pieces(k), error)
      if (.not. allocated(error)) cycle
      ! The piece that this rank has already requested comes later in the order. Its error, if any, would not be the first.
      k = queue%answer()
      call queue%stop_all()
      exit
    end do
    call queue%close()
    call share_first_error(error, last)
    associate (unused_executor => self, unused_points => points)
    end associate
  end subroutine distribute

  !> True for the rank that prints and writes.
  logical function is_leader()
    is_leader = own_rank() == 0
  end function is_leader

  !> True for each of the numbers 1 ... `count` that this rank handles.
  function share_of(count) result(is_own)
    integer, intent(in) :: count
    logical :: is_own(count)

    is_own = .false.
    is_own(1 + own_rank()::number_of_ranks()) = .true.
  end function share_of

  !> Gives all ranks the error of the lowest rank that has one.
  subroutine share_error(error)
    type(error_type), allocatable, intent(inout) :: error

    call share_first_error(error)
  end subroutine share_error

  !> Fails if the ranks have read different input files. `content` is a hash of the input.
  subroutine compare(content, name, error)
    integer(int64), intent(in) :: content
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error

    if (.not. same_everywhere(content)) call fatal_error(error, name // ": the ranks have read different inputs", invalid_input)
  end subroutine compare

  !> The line of the report that says how many ranks computed.
  function workers_line() result(line)
    character(len=:), allocatable :: line

    line = "  computed by " // counted(number_of_ranks(), "rank") // new_line("a")
  end function workers_line

end module ranked_executor
