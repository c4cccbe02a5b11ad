!> Finds the stability borders between two points of a line.
module gestell_task_boundary_line_crossing
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: operator(/=), operator(==), stable, undecided
  use gestell_math_root_search, only: root_search_type
  use gestell_task_boundary_line, only: line_type, probe_line, probe_type
  use gestell_task_boundary_line_search_result, only: crossing_type, search_type
  use gestell_task_boundary_line_functions, only: border_kinds, divergence, flutter, period_doubling
  implicit none (type, external)
  private

  public :: add_classified, find_borders_between, verify

contains

  !> Adds a crossing to `search`. The argument of the multiplier is taken from the unstable system beside the crossing. The kind
  !> of the crossing is still unknown (0) if no border function changed its sign. The argument then determines the kind: 0 is
  !> divergence, pi is period doubling, any other value is flutter.
  pure subroutine add_classified(search, crossing, below, above)
    type(search_type), intent(inout) :: search
    type(crossing_type), intent(in) :: crossing
    !> Systems on both sides of the crossing: `below` at a smaller position t on the line, `above` at a larger one
    type(probe_type), intent(in) :: below, above
    real(dp), parameter :: real_axis = 1.0e-6_dp
    type(crossing_type) :: classified

    classified = crossing
    classified%arg = merge(above%arg, below%arg, crossing%enters)
    if (classified%kind == 0) then
      classified%kind = flutter
      if (classified%arg < real_axis) classified%kind = divergence
      if (classified%arg > pi - real_axis) classified%kind = period_doubling
    end if
    if (classified%kind == divergence) classified%arg = 0
    if (classified%kind == period_doubling) classified%arg = pi
    search%borders = [search%borders, classified]
  end subroutine add_classified

  !> Adds the borders between the systems `l` and `r` to `search`. Finds a zero of the first border function (a function of the
  !> multipliers that changes its sign at a border) whose signs differ at `l` and `r`. If there is none, finds the position at
  !> which the verdict changes. A zero at which the verdict does not change is not a border. The parts on both sides of the zero
  !> are searched recursively, down to `depth` 0. Fails if the parameters are invalid.
  recursive subroutine find_borders_between(line, l, r, depth, search, error)
    type(line_type), intent(in) :: line
    !> Systems at both ends of the interval; `l` lies at the smaller position t on the line
    type(probe_type), intent(in) :: l, r
    integer, intent(in) :: depth
    !> Results, to which the borders are added
    type(search_type), intent(inout) :: search
    type(error_type), allocatable, intent(out) :: error
    type(probe_type) :: obstacle, below, above
    type(crossing_type) :: crossing
    logical :: success, changes
    integer :: kind
    real(dp) :: t

    if (depth == 0 .or. l%missing() .or. r%missing()) return
    changes = l%is_unstable() .neqv. r%is_unstable()
    if (.not. r%t - l%t > line%step()) then
      if (changes) call add_classified(search, crossing_type(t=(l%t + r%t) / 2, error=(r%t - l%t) / 2, enters=r%is_unstable(), &
        & verdicts=[l%verdict, r%verdict]), l, r)
      return
    end if
    kind = changed_function(l, r)
    if (kind == 0 .and. .not. changes) return
    call find_zero(line, kind, l, r, t, obstacle, error)
    if (allocated(error)) return
    if (obstacle%missing()) then
      call last_system_before(line, l, obstacle, below, error)
      if (.not. allocated(error)) call last_system_before(line, r, obstacle, above, error)
    else
      call verify(line, l, r, t, crossing, below, above, success, error)
      if (success) then
        crossing%kind = kind
        call add_classified(search, crossing, below, above)
      end if
    end if
    if (allocated(error)) return
    call find_borders_between(line, l, below, depth - 1, search, error)
    if (.not. allocated(error)) call find_borders_between(line, above, r, depth - 1, search, error)
  end subroutine find_borders_between

  !> Number of the first border function (component `f` of a probe) that has different signs at `l` and `r`; 0 if there is none.
  pure integer function changed_function(l, r) result(kind)
    type(probe_type), intent(in) :: l, r

    do kind = 1, border_kinds
      if (.not. (l%sign_certain(kind) .and. r%sign_certain(kind))) cycle
      if (kind == flutter .and. (l%reciprocal .neqv. r%reciprocal)) cycle
      if ((l%f(kind) > 0) .neqv. (r%f(kind) > 0)) return
    end do
    kind = 0
  end function changed_function

  !> A number whose sign changes at a border: the border function number `kind` or, if `kind` is 0, the verdict as a number (1 for
  !> unstable, otherwise -1).
  pure real(dp) function margin(probe, kind)
    type(probe_type), intent(in) :: probe
    integer, intent(in) :: kind

    margin = merge(1, -1, probe%is_unstable())
    if (kind > 0) margin = probe%f(kind)
  end function margin

  !> Finds a zero of the function `margin` for border function number `kind` between `l` and `r`, where its signs differ. If
  !> `kind` is 0 (the verdict), `margin` has only two values, and the interval is bisected. If there is no system at a point of
  !> the search, the search stops and returns this point as `obstacle`.
  subroutine find_zero(line, kind, l, r, t, obstacle, error)
    type(line_type), intent(in) :: line
    integer, intent(in) :: kind
    type(probe_type), intent(in) :: l, r
    real(dp), intent(out) :: t
    type(probe_type), intent(out) :: obstacle
    type(error_type), allocatable, intent(out) :: error
    !> Allowed error of a zero, divided by the tolerance of a border.
    real(dp), parameter :: share = 0.125_dp
    type(root_search_type) :: search
    type(probe_type) :: new

    obstacle%verdict = undecided
    call search%start(r%t, margin(r, kind), l%t, margin(l, kind))
    do
      t = search%root()
      ! The number for a verdict has no magnitude, so neither end of the interval can be closer to its zero.
      if (kind == 0) t = sum(search%x) / 2
      associate (tolerance => merge(share, share / 2, kind > 0) * line%step() + 2 * spacing(t))
        if (search%found(tolerance)) return
        call probe_line(line, search%next(tolerance), new, error)
      end associate
      if (allocated(error)) return
      if (new%missing()) then
        obstacle = new
        return
      end if
      call search%take(new%t, margin(new, kind))
      ! Where multipliers begin or cease to form reciprocal pairs, the function changes its definition, and its sign has no meaning.
      if (kind == flutter .and. (new%reciprocal .neqv. l%reciprocal)) exit
    end do
    t = search%root()
  end subroutine find_zero

  !> Finds two systems, one on each side of the border at `t`, of which exactly one is unstable. Their distance from `t` is
  !> increased until this condition holds. On the side of the border that is not unstable, the interval from `l` to `r` may end in
  !> a stable system. The distance is then increased further, up to a limit, until the system found on this side is stable and not
  !> merely undecided.
  subroutine verify(line, l, r, t, crossing, below, above, success, error)
    type(line_type), intent(in) :: line
    !> Systems at both ends of the interval; `l` is the one at the smaller t
    type(probe_type), intent(in) :: l, r
    real(dp), intent(in) :: t
    !> The border; defined only if `success` is true
    type(crossing_type), intent(out) :: crossing
    !> The two systems: `below` at a position on the line smaller than `t`, `above` at a larger one
    type(probe_type), intent(out) :: below, above
    !> False if no two such systems were found close to `t`
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
        crossing = crossing_type(t=t, error=distance, enters=above%is_unstable(), verdicts=[below%verdict, above%verdict])
        if (crossing%enters .and. (below%verdict == stable .or. l%verdict /= stable)) return
        if (.not. crossing%enters .and. (above%verdict == stable .or. r%verdict /= stable)) return
      else if (below%is_unstable() .or. success) then
        return
      end if
      distance = growth * distance
      if (distance > max(growth * line%step(), farthest * (r%t - l%t))) return
    end do
  end subroutine verify

  !> Finds the last system that exists between `here` and the point `none`, which has no system. Eight bisections locate it
  !> approximately.
  subroutine last_system_before(line, here, none, last, error)
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
  end subroutine last_system_before

end module gestell_task_boundary_line_crossing
