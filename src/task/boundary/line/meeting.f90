!> Search for a tongue (region of instability) of parametric resonance where the phases of two multipliers meet.
module gestell_task_boundary_line_meeting
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_root_search, only: root_search_type
  use gestell_math_sorting, only: ascending
  use gestell_task_boundary_line_pair, only: fit_pair, place_of_max_growth, pair_fit_type, pair_path_type, pair_type
  implicit none (type, external)
  private

  public :: search_meeting, tongue_end

  !> Outcomes of a search for a tongue where two multipliers meet. `no_tongue`: the multipliers do not grow. `tongue`: they grow.
  !> `thin`: the system is undamped and no growth was found, so a tongue is narrower than the tolerance. `open_question`:
  !> undecided.
  integer, parameter, public :: no_tongue = 0, tongue = 1, thin = 2, open_question = 3

  !> Result of a search for a tongue where two multipliers meet.
  type, public :: meeting_type
    !> Outcome of the search: `no_tongue`, `tongue`, `thin` or `open_question`
    integer :: outcome = open_question
    !> `t`: position at which the growth of the two multipliers is largest. `width`: width of the surrounding part of the line in
    !> which they may grow.
    real(dp) :: t = 0, width = 0
    !> The two multipliers at the position where the largest growth was found
    type(pair_type) :: strongest
    !> On each side of a tongue, the two multipliers at the nearest solved position at which both decay.
    type(pair_type) :: sides(2)
    !> For each side of the tongue: true if a position was found at which both multipliers decay.
    logical :: outside(2) = .false.
  end type meeting_type

  !> The sign of a growth rate counts as certain if the rate exceeds its error by this factor.
  real(dp), parameter :: clear = 2

contains

  !> Searches for the largest growth of a pair of multipliers near `start`, the position at which their phases meet. Fails if the
  !> parameters are invalid.
  subroutine search_meeting(path, start, rate, meeting, error)
    type(pair_path_type), intent(in) :: path
    !> `start`: position at which the phases meet. `rate`: derivative of the phase difference with respect to the position on the
    !> line
    real(dp), intent(in) :: start, rate
    type(meeting_type), intent(out) :: meeting
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most = 30
    !> The fit of the pair by parabolas is accurate enough if it predicts the growth with this relative accuracy.
    real(dp), parameter :: part = 0.25_dp
    !> The largest growth is sought up to this distance beyond the three fitted positions, relative to the distance between the
    !> outer two positions.
    real(dp), parameter :: beyond = 2
    !> A mean growth counts as zero if it is at most this multiple of its error.
    real(dp), parameter :: neutral = 10
    !> A pair is followed beyond both ends of its interval by at most this fraction of the interval's length.
    real(dp), parameter :: overhang = 0.25_dp
    type(pair_type) :: pairs(most), near(3)
    type(pair_fit_type) :: fit
    real(dp) :: bounds(2), predicted
    integer :: three(3), n
    integer, allocatable :: order(:)

    bounds = path%stretch%ends%t + overhang * path%stretch%length() * [-1, 1]
    bounds = [max(bounds(1), 0.0_dp), min(bounds(2), 1.0_dp)]
    call solve_three_pairs(path, start, rate, bounds, pairs(:3), error)
    meeting%t = start
    meeting%width = path%stretch%length()
    if (allocated(error) .or. any(pairs(:3)%at%missing())) return
    three = [1, 2, 3]
    do n = 3, most
      meeting%strongest = pairs(maxloc(pairs(:n)%growth - clear * pairs(:n)%noise, dim=1))
      if (meeting%strongest%growth > clear * meeting%strongest%noise .and. meeting%strongest%decay_margin() < 0) then
        meeting%outcome = tongue
        call find_decaying_sides(path, pairs(:n), bounds, meeting, error)
        return
      end if
      if (n == most) return
      near = pairs(three)
      fit = fit_pair(near)
      associate (low => near(1)%t, high => near(3)%t)
        meeting%width = high - low
        meeting%t = place_of_max_growth(fit, max(bounds(1), low - beyond * (high - low)), &
          & min(bounds(2), high + beyond * (high - low)))
      end associate
      predicted = fit%growth(meeting%t)
      associate (next => pairs(minloc(abs(pairs(:n)%t - meeting%t), dim=1)))
        if (abs(next%t - meeting%t) <= path%line%step() / 4 + 4 * spacing(next%t)) then
          ! If the largest growth is certainly negative, there is no tongue. If it is zero within its error, it may be positive
          ! nearby.
          if (next%growth < -clear * next%noise) then
            meeting%outcome = no_tongue
          else if (abs(real(next%mean)) <= neutral * next%noise) then
            meeting%outcome = thin
          else
            meeting%width = max(path%line%step(), 2 * sqrt(2 * clear * next%noise * abs(real(next%mean))) &
              & / max(abs(rate), tiny(rate)))
          end if
          return
        end if
      end associate
      associate (new => pairs(n + 1))
        call path%solve(meeting%t, new, error)
        if (allocated(error) .or. new%at%missing()) return
        if (new%growth < -clear * new%noise .and. abs(new%growth - predicted) < part * abs(new%growth)) then
          meeting%outcome = no_tongue
          return
        end if
      end associate
      order = ascending(abs(pairs(:n + 1)%t - meeting%t))
      three = order(:3)
      three = three(ascending((pairs(three)%t)))
    end do
  end subroutine search_meeting

  !> Finds, on each side of a tongue, a position at which both multipliers decay. If such a position was solved before, the nearest
  !> one is used. Otherwise the distance from the maximum of the growth is doubled until both multipliers decay.
  subroutine find_decaying_sides(path, pairs, bounds, meeting, error)
    type(pair_path_type), intent(in) :: path
    type(pair_type), intent(in) :: pairs(:)
    real(dp), intent(in) :: bounds(2)
    type(meeting_type), intent(inout) :: meeting
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: distance, t
    integer :: side, i

    do side = 1, 2
      associate (here => meeting%sides(side), strongest => meeting%strongest%t, direction => 2 * side - 3)
        i = minloc(abs(pairs%t - strongest), dim=1, mask=pairs%decay_margin() > 0 .and. direction * (pairs%t - strongest) > 0)
        meeting%outside(side) = i > 0
        if (i > 0) here = pairs(i)
        distance = max(maxval(pairs%t) - minval(pairs%t), path%line%step())
        do while (.not. meeting%outside(side))
          t = strongest + direction * distance
          if (side == 1) t = max(t, bounds(1))
          if (side == 2) t = min(t, bounds(2))
          if (.not. abs(t - strongest) > 0) exit
          call path%solve(t, here, error)
          if (allocated(error)) return
          if (here%at%missing()) exit
          meeting%outside(side) = here%decay_margin() > 0
          if (.not. abs(t - bounds(side)) > 0) exit
          distance = 2 * distance
        end do
      end associate
    end do
  end subroutine find_decaying_sides

  !> Computes the pair of multipliers at `start` and at two further positions, one on each side of `start`. The distance of these
  !> positions is chosen so that the detuning there is about three times the growth.
  subroutine solve_three_pairs(path, start, rate, bounds, three, error)
    type(pair_path_type), intent(in) :: path
    real(dp), intent(in) :: start, rate, bounds(2)
    type(pair_type), intent(out) :: three(3)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: times = 3, widest = 0.2_dp
    real(dp) :: s, middle

    call path%solve(start, three(2), error)
    if (allocated(error) .or. three(2)%at%missing()) return
    s = times * max(abs(real(three(2)%mean)), sqrt(abs(three(2)%delta)), three(2)%noise)
    s = min(s, widest * path%stretch%length() * abs(rate)) / max(abs(rate), tiny(s))
    s = min(max(s, path%line%step(), 16 * spacing(start)), (bounds(2) - bounds(1)) / 2)
    middle = min(max(start, bounds(1) + s), bounds(2) - s)
    if (abs(middle - start) > 0) call path%solve(middle, three(2), error)
    if (.not. allocated(error)) call path%solve(middle - s, three(1), error)
    if (.not. allocated(error)) call path%solve(middle + s, three(3), error)
  end subroutine solve_three_pairs

  !> Computes the end of a tongue: the zero of `decay_margin` between a position at which both multipliers decay and a position at
  !> which the pair grows. Fails if the parameters are invalid.
  subroutine tongue_end(path, outside, strongest, t, missing, error)
    type(pair_path_type), intent(in) :: path
    !> `outside`: the pair of multipliers at a position where both decay. `strongest`: the pair at a position where it grows
    type(pair_type), intent(in) :: outside, strongest
    !> Position of the end of the tongue on the line
    real(dp), intent(out) :: t
    !> True if a system between the two positions could not be solved
    logical, intent(out) :: missing
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: share = 0.125_dp
    integer, parameter :: max_steps = 100
    type(root_search_type) :: search
    type(pair_type) :: new
    integer :: k

    missing = .false.
    call search%start(strongest%t, strongest%decay_margin(), outside%t, outside%decay_margin())
    do k = 1, max_steps
      t = search%root()
      associate (tolerance => share * path%line%step() + 2 * spacing(t))
        if (search%found(tolerance)) return
        call path%solve(search%next(tolerance), new, error)
      end associate
      missing = new%at%missing()
      if (allocated(error) .or. missing) return
      call search%take(new%t, new%decay_margin())
    end do
    t = search%root()
  end subroutine tongue_end

end module gestell_task_boundary_line_meeting
