!> Results of a search along a line: borders, systems on both sides of each border, and parts in which a border cannot be excluded.
module gestell_task_boundary_line_search_result
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: undecided, verdict_type
  use gestell_math_sorting, only: ascending
  use gestell_task_boundary_line, only: probe_type
  use gestell_task_common_executor, only: work_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  !> A crossing on a line: a stability border, or a position at which a measured quantity crosses a level.
  type, public :: crossing_type
    !> `t`: position on the line. `error`: at this distance from `t`, the systems are certain to lie on different sides of the
    !> border.
    real(dp) :: t = 0, error = 0
    integer :: kind = 0
    !> Argument of the multiplier that lies on the unit circle (0 to pi).
    real(dp) :: arg = 0
    !> True if the systems at larger positions t are unstable. For the crossing of a level: true if the quantity is above the
    !> level at larger positions.
    logical :: enters = .false.
    !> Verdicts on the systems beside the crossing: element 1 at smaller positions t on the line, element 2 at larger ones.
    type(verdict_type) :: verdicts(2) = undecided
  end type crossing_type

  !> Part of a line in which a border cannot be excluded. `t`: its middle. `width`: its width.
  type, public :: open_part_type
    real(dp) :: t = 0, width = 0
  end type open_part_type

  !> Results of a search along a line: borders, parts in which a border cannot be excluded, and solved systems along the line.
  type, public :: search_type
    type(crossing_type), allocatable :: borders(:)
    type(open_part_type), allocatable :: open_parts(:)
    !> `meetings`: number of positions at which two multipliers meet. `thin`: number of meetings in undamped systems at which no
    !> growth was found. A tongue (region of instability) at such a meeting is narrower than the tolerance.
    integer :: meetings = 0, thin = 0
    !> Number of meetings of multipliers that were not searched because the line has more meetings than are allowed.
    integer :: left_out = 0
    !> Solved systems along the line, at least one on each side of every border. `sort_marks` sorts them by position. Only the
    !> first `mark_count` elements are used.
    type(probe_type), allocatable :: marks(:)
    integer :: mark_count = 0
  contains
    procedure :: initialise, exchange, append, add_mark, sort_marks, sort_borders, list_unexplained
  end type search_type

  !> Parallel work in which each piece is one search on a line.
  type, abstract, extends(work_type), public :: searches_type
    type(search_type), allocatable :: found(:)
  contains
    procedure :: exchange => exchange_search
  end type searches_type

contains

  !> Initialises the result of a search that has not found anything yet.
  subroutine initialise(self)
    class(search_type), intent(out) :: self

    allocate(self%borders(0), self%open_parts(0), self%marks(0))
  end subroutine initialise

  !> Appends the results of a search in one part of the line to the results for the line.
  pure subroutine append(self, part)
    class(search_type), intent(inout) :: self
    type(search_type), intent(in) :: part
    integer :: i

    do i = 1, part%mark_count
      call self%add_mark(part%marks(i))
    end do
    self%meetings = self%meetings + part%meetings
    self%thin = self%thin + part%thin
    self%open_parts = [self%open_parts, part%open_parts]
    self%borders = [self%borders, part%borders]
  end subroutine append

  !> Adds to `open_parts` each part of the line in which the borders do not explain the verdicts at its ends. The number of borders
  !> between two systems must be odd if exactly one of the systems is unstable, otherwise even. Systems within the error of a border
  !> are ignored.
  pure subroutine list_unexplained(self)
    class(search_type), intent(inout) :: self
    integer :: i, last

    last = 0
    do i = 1, size(self%marks)
      associate (borders => self%borders, here => self%marks(i))
        if (any(abs(borders%t - here%t) <= borders%error)) cycle
        if (last > 0) then
          associate (before => self%marks(last))
            if ((modulo(count(borders%t > before%t .and. borders%t < here%t), 2) == 1) .neqv. &
              & (here%is_unstable() .neqv. before%is_unstable())) self%open_parts = [self%open_parts, &
              & open_part_type((before%t + here%t) / 2, here%t - before%t)]
          end associate
        end if
        last = i
      end associate
    end do
  end subroutine list_unexplained

  !> Writes the results of the search to a record, or reads them from a record.
  subroutine exchange(self, record)
    class(search_type), intent(inout) :: self
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)
    integer :: i

    if (record%reads) call self%initialise()
    words = transfer(self%borders, [0_int64])
    call record%pass_words(words)
    if (record%reads) self%borders = transfer(words, [crossing_type ::])
    words = transfer(self%open_parts, [0_int64])
    call record%pass_words(words)
    if (record%reads) self%open_parts = transfer(words, [open_part_type ::])
    call record%pass(self%meetings)
    call record%pass(self%thin)
    call record%pass(self%left_out)
    call record%pass(self%mark_count)
    if (record%reads) then
      deallocate(self%marks)
      allocate(self%marks(max(self%mark_count, 0)))
    end if
    do i = 1, self%mark_count
      call self%marks(i)%exchange(record)
    end do
  end subroutine exchange

  subroutine exchange_search(self, k, record)
    class(searches_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record

    call self%found(k)%exchange(record)
  end subroutine exchange_search

  !> Adds a system to `marks`, unless the system does not exist or could not be solved.
  pure subroutine add_mark(self, mark)
    class(search_type), intent(inout) :: self
    type(probe_type), intent(in) :: mark
    type(probe_type), allocatable :: longer(:)

    if (mark%missing()) return
    if (self%mark_count == size(self%marks)) then
      allocate(longer(2 * self%mark_count + 64))
      longer(:self%mark_count) = self%marks
      call move_alloc(longer, self%marks)
    end if
    self%mark_count = self%mark_count + 1
    self%marks(self%mark_count) = mark
  end subroutine add_mark

  !> Sorts the systems in `marks` by their positions on the line, and removes duplicates.
  pure subroutine sort_marks(self)
    class(search_type), intent(inout) :: self
    type(probe_type), allocatable :: sorted(:)
    integer, allocatable :: order(:)
    integer :: i

    associate (t => self%marks(:self%mark_count)%t)
      order = ascending((t))
      order = pack(order, [(i == 1 .or. t(order(i)) > t(order(max(i - 1, 1))), i = 1, size(order))])
    end associate
    self%mark_count = size(order)
    allocate(sorted(self%mark_count))
    do i = 1, self%mark_count
      sorted(i) = self%marks(order(i))
    end do
    call move_alloc(sorted, self%marks)
  end subroutine sort_marks

  !> Sorts the borders by their positions on the line and removes duplicates. Also removes pairs of borders that enclose a region
  !> narrower than `least`.
  pure subroutine sort_borders(self, least)
    class(search_type), intent(inout) :: self
    real(dp), intent(in) :: least
    logical, allocatable :: keep(:)
    integer :: i

    allocate(keep(size(self%borders)), source=.false.)
    associate (b => self%borders)
      do i = 1, size(b)
        keep(i) = .not. any(keep .and. abs(b%t - b(i)%t) <= b%error + b(i)%error .and. (b%enters .eqv. b(i)%enters))
      end do
    end associate
    self%borders = pack(self%borders, keep)
    self%borders = self%borders(ascending((self%borders%t)))
    keep = spread(.true., 1, size(self%borders))
    associate (b => self%borders)
      do i = 2, size(b)
        if (.not. keep(i - 1) .or. b(i)%t - b(i - 1)%t >= least) cycle
        if (b(i)%enters .neqv. b(i - 1)%enters) keep(i - 1:i) = .false.
      end do
    end associate
    self%borders = pack(self%borders, keep)
  end subroutine sort_borders

end module gestell_task_boundary_line_search_result
