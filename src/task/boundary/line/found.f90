!> What a search along a line has found: borders, systems on both sides of them, and what it leaves open.
module gestell_task_boundary_line_found
  use gestell_base_kinds, only: dp
  use gestell_math_sorting, only: ascending
  use gestell_task_boundary_line_crossing, only: crossings_type
  use gestell_task_boundary_line, only: probe_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  !> A place where a border could not be excluded, and how wide it is, in t.
  type, public :: doubt_type
    real(dp) :: t = 0, width = 0
  end type doubt_type

  type, public :: search_type
    type(crossings_type) :: found
    type(doubt_type), allocatable :: doubts(:)
    !> Places where multipliers meet; those of them without damping where nothing grows at a distance of the tolerance.
    integer :: meetings = 0, thin = 0
    !> Meetings beyond those that a line allows: they were not looked at.
    integer :: left_out = 0
    !> Systems along the line, ascending, of which each side of each border was seen.
    type(probe_type), allocatable :: marks(:)
    integer, private :: seen = 0
  contains
    procedure :: exchange
    procedure :: take
    procedure :: add_mark
    procedure :: sort_marks
    procedure :: forget_marks
    procedure :: name_unexplained
  end type search_type

contains

  !> Adds what was found at one place of the line.
  pure subroutine take(self, part)
    class(search_type), intent(inout) :: self
    type(search_type), intent(in) :: part
    integer :: i

    do i = 1, part%seen
      call self%add_mark(part%marks(i))
    end do
    self%meetings = self%meetings + part%meetings
    self%thin = self%thin + part%thin
    self%doubts = [self%doubts, part%doubts]
    if (.not. allocated(part%found%list)) return
    do i = 1, size(part%found%list)
      call self%found%add(part%found%list(i))
    end do
  end subroutine take

  pure subroutine forget_marks(self)
    class(search_type), intent(inout) :: self

    self%marks = [probe_type ::]
    self%seen = 0
  end subroutine forget_marks

  !> The borders must explain the verdicts: where two marks differ but no border, or an even number, was found between them, or
  !> where they agree about an odd number, the stretch between them is a doubt. Marks within a border's error show neither side.
  pure subroutine name_unexplained(self)
    class(search_type), intent(inout) :: self
    integer :: i, last

    last = 0
    do i = 1, size(self%marks)
      associate (borders => self%found%list, here => self%marks(i))
        if (any(abs(borders%t - here%t) <= borders%error)) cycle
        if (last > 0) then
          associate (before => self%marks(last))
            if ((modulo(count(borders%t > before%t .and. borders%t < here%t), 2) == 1) .neqv. &
              & (here%is_unstable() .neqv. before%is_unstable())) self%doubts = [self%doubts, &
              & doubt_type((before%t + here%t) / 2, here%t - before%t)]
          end associate
        end if
        last = i
      end associate
    end do
  end subroutine name_unexplained

  !> Passes what was found to a record, or reads it from there.
  subroutine exchange(self, record)
    class(search_type), intent(inout) :: self
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)
    integer :: i

    call self%found%exchange(record)
    if (allocated(self%doubts)) words = transfer(self%doubts, [0_int64])
    call record%pass_words(words)
    if (record%reads) self%doubts = transfer(words, [doubt_type ::])
    call record%pass(self%meetings)
    call record%pass(self%thin)
    call record%pass(self%left_out)
    call record%pass(self%seen)
    if (record%reads) then
      if (allocated(self%marks)) deallocate(self%marks)
      allocate(self%marks(max(self%seen, 0)))
    end if
    do i = 1, self%seen
      call self%marks(i)%exchange(record)
    end do
  end subroutine exchange

  !> Adds a system, unless there is none.
  pure subroutine add_mark(self, mark)
    class(search_type), intent(inout) :: self
    type(probe_type), intent(in) :: mark
    type(probe_type), allocatable :: longer(:)

    if (mark%missing()) return
    if (self%seen == size(self%marks)) then
      allocate(longer(2 * self%seen + 64))
      longer(:self%seen) = self%marks
      call move_alloc(longer, self%marks)
    end if
    self%seen = self%seen + 1
    self%marks(self%seen) = mark
  end subroutine add_mark

  !> Sorts the systems along the line and leaves each once.
  pure subroutine sort_marks(self)
    class(search_type), intent(inout) :: self
    type(probe_type), allocatable :: sorted(:)
    integer, allocatable :: order(:)
    integer :: i

    associate (t => self%marks(:self%seen)%t)
      order = ascending((t))
      order = pack(order, [(i == 1 .or. t(order(i)) > t(order(max(i - 1, 1))), i = 1, size(order))])
    end associate
    allocate(sorted(size(order)))
    do i = 1, size(order)
      sorted(i) = self%marks(order(i))
    end do
    call move_alloc(sorted, self%marks)
  end subroutine sort_marks

end module gestell_task_boundary_line_found
