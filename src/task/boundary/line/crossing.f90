!> The borders of stability between two points of a line.
module gestell_task_boundary_line_crossing
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: operator(/=), operator(==), stable, undecided, verdict_type
  use gestell_base_kinds, only: dp, pi
  use gestell_task_boundary_line_functions, only: border_kinds, divergence, flutter, period_doubling
  use gestell_task_boundary_line, only: line_type, probe_line, probe_type
  use gestell_task_boundary_line_root, only: find_change, find_root
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: add_named, separate, verify

  !> A border on a line.
  type, public :: crossing_type
    !> Where, and how far from there verdicts tell the sides apart.
    real(dp) :: t = 0, error = 0
    integer :: kind = 0
    !> Argument of the multiplier on the unit circle, 0 to pi.
    real(dp) :: arg = 0
    !> Whether the greater t are the unstable ones; verdicts below and above.
    logical :: unstable_above = .false.
    type(verdict_type) :: verdicts(2) = undecided
  end type crossing_type

  type, public :: crossings_type
    type(crossing_type), allocatable :: list(:)
  contains
    procedure :: add
    procedure :: sort
    procedure :: exchange
  end type crossings_type

contains

  pure subroutine add(self, crossing)
    class(crossings_type), intent(inout) :: self
    type(crossing_type), intent(in) :: crossing

    if (.not. allocated(self%list)) allocate(self%list(0))
    self%list = [self%list, crossing]
  end subroutine add

  !> Passes all of them to a record, or takes them from there.
  subroutine exchange(self, record)
    class(crossings_type), intent(inout) :: self
    type(record_type), intent(inout) :: record
    integer(int64), allocatable :: words(:)

    if (allocated(self%list)) words = transfer(self%list, [0_int64])
    call record%pass_words(words)
    if (record%reads) self%list = transfer(words, [crossing_type ::])
  end subroutine exchange

  !> Adds a crossing with its argument, and its kind where that is not known yet, from the systems on both sides.
  pure subroutine add_named(found, crossing, below, above)
    type(crossings_type), intent(inout) :: found
    type(crossing_type), intent(in) :: crossing
    type(probe_type), intent(in) :: below, above
    type(crossing_type) :: named

    named = crossing
    if (crossing%unstable_above) call name_kind(above%arg, named)
    if (.not. crossing%unstable_above) call name_kind(below%arg, named)
    call found%add(named)
  end subroutine add_named

  !> Ascending; what was found twice is left once, and regions narrower than `least` are left out.
  pure subroutine sort(self, least)
    class(crossings_type), intent(inout) :: self
    real(dp), intent(in) :: least
    type(crossing_type), allocatable :: sorted(:)
    logical, allocatable :: wide(:)
    type(crossing_type) :: next
    integer :: i, k, kept

    if (.not. allocated(self%list)) allocate(self%list(0))
    allocate(sorted(size(self%list)))
    kept = 0
    do i = 1, size(self%list)
      next = self%list(i)
      if (any(abs(sorted(:kept)%t - next%t) <= sorted(:kept)%error + next%error .and. &
        & (sorted(:kept)%unstable_above .eqv. next%unstable_above))) cycle
      k = kept + 1
      do while (k > 1)
        if (sorted(k - 1)%t <= next%t) exit
        sorted(k) = sorted(k - 1)
        k = k - 1
      end do
      sorted(k) = next
      kept = kept + 1
    end do
    allocate(wide(kept), source=.true.)
    do i = 2, kept
      if (.not. wide(i - 1) .or. sorted(i)%t - sorted(i - 1)%t >= least) cycle
      if (sorted(i)%unstable_above .neqv. sorted(i - 1)%unstable_above) wide(i - 1:i) = .false.
    end do
    self%list = pack(sorted(:kept), wide)
  end subroutine sort

  !> Adds to `found` the borders between `l` and `r`: a zero is sought of each function that changes its sign, or else the
  !> place where the verdict changes; a zero with no change of the verdict is none, but divides what is left. At most
  !> `depth` times. Error: the parameters make no sense.
  recursive subroutine separate(line, l, r, depth, found, error)
    type(line_type), intent(in) :: line
    type(probe_type), intent(in) :: l, r
    integer, intent(in) :: depth
    type(crossings_type), intent(inout) :: found
    type(error_type), allocatable, intent(out) :: error
    type(probe_type) :: obstacle, below, above
    type(crossing_type) :: crossing
    logical :: success
    integer :: kind
    real(dp) :: t

    if (depth == 0 .or. l%missing() .or. r%missing()) return
    if (.not. r%t - l%t > line%step()) then
      if (l%is_unstable() .neqv. r%is_unstable()) call add_named(found, crossing_between(l, r), l, r)
      return
    end if
    kind = changing(l, r)
    if (kind > 0) then
      call find_root(line, kind, l, r, t, obstacle, error)
    else if (l%is_unstable() .neqv. r%is_unstable()) then
      call find_change(line, l, r, t, obstacle, error)
    else
      return
    end if
    if (allocated(error)) return
    if (obstacle%missing()) then
      call last_before(line, l, obstacle, below, error)
      if (.not. allocated(error)) call last_before(line, r, obstacle, above, error)
    else
      call verify(line, l, r, t, crossing, below, above, success, error)
      if (success) then
        crossing%kind = kind
        call add_named(found, crossing, below, above)
      end if
    end if
    if (allocated(error)) return
    call separate(line, l, below, depth - 1, found, error)
    if (.not. allocated(error)) call separate(line, above, r, depth - 1, found, error)
  end subroutine separate

  !> The border between two systems that lie nearer to each other than it is to be found.
  pure type(crossing_type) function crossing_between(l, r) result(crossing)
    type(probe_type), intent(in) :: l, r

    crossing%t = (l%t + r%t) / 2
    crossing%error = (r%t - l%t) / 2
    crossing%unstable_above = r%is_unstable()
    crossing%verdicts = [l%verdict, r%verdict]
  end function crossing_between

  !> The first function whose sign changes between `l` and `r`, 0 if there is none.
  pure integer function changing(l, r) result(kind)
    type(probe_type), intent(in) :: l, r

    do kind = 1, border_kinds
      if (.not. (l%known(kind) .and. r%known(kind))) cycle
      if (kind == flutter .and. (l%reciprocal .neqv. r%reciprocal)) cycle
      if (.not. same_sign(l%f(kind), r%f(kind))) return
    end do
    kind = 0
  end function changing

  elemental logical function same_sign(a, b)
    real(dp), intent(in) :: a, b

    same_sign = (a > 0) .eqv. (b > 0)
  end function same_sign

  !> Both sides of the border at `t` by their verdicts, as near to it as they can tell: `unstable` on one side and not on
  !> the other, and `stable` there if it is so at that end of the interval.
  subroutine verify(line, l, r, t, crossing, below, above, success, error)
    type(line_type), intent(in) :: line
    type(probe_type), intent(in) :: l, r
    real(dp), intent(in) :: t
    type(crossing_type), intent(out) :: crossing
    type(probe_type), intent(out) :: below, above
    logical, intent(out) :: success
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: growth = 4, farthest = 1.0_dp / 64
    real(dp) :: distance

    success = .false.
    distance = line%step()
    do
      below = l
      if (t - distance > l%t) call probe_line(line, t - distance, below, error)
      if (allocated(error)) return
      above = r
      if (t + distance < r%t) call probe_line(line, t + distance, above, error)
      if (allocated(error)) return
      if (below%missing() .or. above%missing()) return
      if (below%is_unstable() .neqv. above%is_unstable()) then
        success = .true.
        crossing%t = t
        crossing%error = distance
        crossing%unstable_above = above%is_unstable()
        crossing%verdicts = [below%verdict, above%verdict]
        if (crossing%unstable_above .and. (below%verdict == stable .or. l%verdict /= stable)) return
        if (.not. crossing%unstable_above .and. (above%verdict == stable .or. r%verdict /= stable)) return
      else if (below%is_unstable() .or. success) then
        return
      end if
      distance = growth * distance
      if (distance > max(growth * line%step(), farthest * (r%t - l%t))) return
    end do
  end subroutine verify

  !> The argument of the critical multiplier, and the kind where only the verdict told of the border.
  pure subroutine name_kind(arg, crossing)
    real(dp), intent(in) :: arg
    type(crossing_type), intent(inout) :: crossing
    real(dp), parameter :: real_axis = 1.0e-6_dp

    if (crossing%kind == 0) then
      crossing%kind = flutter
      if (arg < real_axis) crossing%kind = divergence
      if (arg > pi - real_axis) crossing%kind = period_doubling
    end if
    crossing%arg = arg
    if (crossing%kind == divergence) crossing%arg = 0
    if (crossing%kind == period_doubling) crossing%arg = pi
  end subroutine name_kind

  !> Of the systems from `here` on toward a point where there is none, nearly the last.
  subroutine last_before(line, here, none, last, error)
    type(line_type), intent(in) :: line
    type(probe_type), intent(in) :: here, none
    type(probe_type), intent(out) :: last
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: halvings = 8
    type(probe_type) :: between
    real(dp) :: beyond
    integer :: k

    last = here
    beyond = none%t
    do k = 1, halvings
      call probe_line(line, (last%t + beyond) / 2, between, error)
      if (allocated(error)) return
      if (between%missing()) then
        beyond = between%t
      else
        last = between
      end if
    end do
  end subroutine last_before

end module gestell_task_boundary_line_crossing
