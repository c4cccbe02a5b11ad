!> Distributes work over the threads of this process. An extension of `executor_type` may also distribute it over several processes.
!> All processes then run the same tasks and exchange their results.
module gestell_task_common_executor
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_task_common_journal, only: journal_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: distribute_over

  !> Work that consists of independent pieces, which are numbered 1, 2, ...
  type, abstract, public :: work_type
  contains
    procedure(compute), deferred :: compute
    procedure :: exchange => exchange_nothing
  end type work_type

  !> A display of the progress of work.
  type, abstract, public :: progress_type
  contains
    procedure(start), deferred :: start
    procedure(add), deferred :: add
    procedure(clear), deferred :: clear
    procedure(show_fraction), nopass, deferred :: show_fraction
  end type progress_type

  !> Distributes pieces of work over threads, and stores finished pieces in a journal.
  type, public :: executor_type
    !> The progress display; if it is not allocated, progress is not displayed.
    class(progress_type), allocatable :: progress
    !> The journal of finished pieces; if it is not allocated, nothing is stored.
    type(journal_type), allocatable :: journal
    !> True if several processes cooperate. A task is then skipped if its work cannot be shared.
    logical :: has_many_processes = .false.
    !> Number of calls of `distribute` so far. Together with the number of a piece it identifies a result in the journal.
    integer, private :: rounds = 0
  contains
    procedure :: distribute, show
    procedure, nopass :: is_leader, share_of, share_error, share_marks, compare, workers_line
  end type executor_type

  abstract interface
    !> Computes piece number `k` and stores its result in `self`, where it does not affect the results of other pieces. Steps that
    !> only one thread may execute at a time, like reading documents or writing files, belong in a critical section named
    !> input_and_output.
    recursive subroutine compute(self, k, error)
      import :: work_type, error_type
      implicit none (type, external)
      class(work_type), intent(inout) :: self
      integer, intent(in) :: k
      type(error_type), allocatable, intent(out) :: error
    end subroutine compute

    !> Starts the progress display for work on `all` points.
    subroutine start(self, all)
      import :: progress_type, int64
      implicit none (type, external)
      class(progress_type), intent(inout) :: self
      integer(int64), intent(in) :: all
    end subroutine start

    !> Increases the number of finished points in the progress display by `points`.
    subroutine add(self, points)
      import :: progress_type, int64
      implicit none (type, external)
      class(progress_type), intent(inout) :: self
      integer(int64), intent(in) :: points
    end subroutine add

    !> Removes the progress display from the screen.
    subroutine clear(self)
      import :: progress_type
      implicit none (type, external)
      class(progress_type), intent(inout) :: self
    end subroutine clear

    !> Displays the text `activity` and the finished fraction `part` (0 to 1).
    subroutine show_fraction(activity, part)
      import :: dp
      implicit none (type, external)
      character(len=*), intent(in) :: activity
      real(dp), intent(in) :: part
    end subroutine show_fraction
  end interface

contains

  !> Computes the given pieces of `work` in parallel. If a piece fails, the pieces after it are skipped. Returns the error of the
  !> first piece in `pieces` that failed.
  subroutine distribute(self, work, pieces, error, points)
    class(executor_type), intent(inout) :: self
    class(work_type), intent(inout) :: work
    integer, intent(in) :: pieces(:)
    type(error_type), allocatable, intent(out) :: error
    !> Weight of each piece in the progress display; 1 if not present
    integer(int64), intent(in), optional :: points(:)
    type(error_type), allocatable :: own
    type(record_type) :: record
    integer(int64) :: weights(size(pieces))
    integer(int64), allocatable :: words(:)
    logical :: is_stored(size(pieces)), has_journal
    integer :: i, failed, first_failed

    weights = 1
    if (present(points)) weights = points
    first_failed = huge(first_failed)
    self%rounds = self%rounds + 1
    has_journal = allocated(self%journal)
    is_stored = .false.
    ! Results of an interrupted run are read from the journal instead of being computed.
    do i = 1, merge(size(pieces), 0, has_journal)
      call self%journal%find(self%rounds, pieces(i), words)
      if (size(words) == 0) cycle
      call record%begin(words)
      call work%exchange(pieces(i), record)
      is_stored(i) = record%is_complete()
    end do
    if (allocated(self%progress)) call self%progress%start(sum(weights, mask=.not. is_stored))
    !$omp parallel do schedule(dynamic, 1) private(own, failed) firstprivate(record)
    do i = 1, size(pieces)
      !$omp atomic read
      failed = first_failed
      if (i > failed .or. is_stored(i)) cycle
      call work%compute(pieces(i), own)
      if (has_journal) then
        call record%begin()
        if (.not. allocated(own)) call work%exchange(pieces(i), record)
      end if
      !$omp critical (input_and_output)
      if (allocated(own) .and. i < first_failed) then
        !$omp atomic write
        first_failed = i
        call move_alloc(own, error)
      end if
      if (has_journal) call self%journal%store(self%rounds, pieces(i), record%words)
      if (allocated(self%progress)) call self%progress%add(weights(i))
      !$omp end critical (input_and_output)
    end do
    !$omp end parallel do
    if (allocated(self%progress)) call self%progress%clear()
  end subroutine distribute

  !> Default of `exchange`, which does nothing, so that the piece is computed again after an interruption. Overriding versions write
  !> the result of piece number `k` to the record or read it from the record (gestell_task_common_record).
  subroutine exchange_nothing(self, k, record)
    class(work_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    associate (unused_work => self, unused_number => k, unused_record => record)
    end associate
  end subroutine exchange_nothing

  !> Computes pieces 1 to `count` of `work`. The `executor` distributes them, if present; otherwise they are computed one after the
  !> other. Returns the error of the first piece that failed.
  subroutine distribute_over(work, count, error, executor)
    class(work_type), intent(inout) :: work
    integer, intent(in) :: count
    type(error_type), allocatable, intent(out) :: error
    class(executor_type), intent(inout), optional :: executor
    integer :: k

    if (present(executor)) then
      call executor%distribute(work, [(k, k = 1, count)], error)
      return
    end if
    do k = 1, count
      call work%compute(k, error)
      if (allocated(error)) return
    end do
  end subroutine distribute_over

  !> True if this process prints the report and writes the files. Only one process does.
  logical function is_leader()
    is_leader = .true.
  end function is_leader

  !> For each of the numbers 1 to `count`: true if this process must compute the piece with this number. Each piece is computed by
  !> one process only.
  function share_of(count) result(is_own)
    integer, intent(in) :: count
    logical :: is_own(count)

    is_own = .true.
  end function share_of

  !> Passes an error of one process to all processes. In this version there is only one process, so nothing is done.
  subroutine share_error(error)
    type(error_type), allocatable, intent(inout) :: error

    associate (unused => error)
    end associate
  end subroutine share_error

  !> Sets an element of `marks` in all processes if any process has set it. In this version there is only one process, so nothing is
  !> done.
  subroutine share_marks(marks)
    logical, contiguous, intent(inout) :: marks(:)

    associate (unused => marks)
    end associate
  end subroutine share_marks

  !> Compares the inputs of all processes by their hash `content`. Fails if they differ. In this version there is only one process,
  !> so it never fails.
  subroutine compare(content, name, error)
    integer(int64), intent(in) :: content
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error

    associate (unused_content => content, unused_name => name)
    end associate
  end subroutine compare

  !> Line of the report that lists the processes of this run; empty if there is only one.
  function workers_line() result(line)
    character(len=:), allocatable :: line

    line = ""
  end function workers_line

  !> Displays the text `activity` and the finished fraction `part` (0 to 1). If `part` is 1, the display is removed.
  subroutine show(self, activity, part)
    class(executor_type), intent(inout) :: self
    character(len=*), intent(in) :: activity
    real(dp), intent(in) :: part

    if (allocated(self%progress)) call self%progress%show_fraction(activity, part)
  end subroutine show

end module gestell_task_common_executor
