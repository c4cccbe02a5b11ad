!> What happens where the phases of two multipliers meet: a tongue of parametric resonance, or none.
module gestell_task_boundary_line_meeting
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_root_search, only: root_search_type
  use gestell_task_boundary_line_exponents, only: stretch_type
  use gestell_task_boundary_line, only: line_type
  use gestell_task_boundary_line_pair, only: fit_pair, greatest_growth, pair_fit_type, pair_name_type, pair_type, solve_pair
  implicit none (type, external)
  private

  public :: search_meeting, tongue_end

  !> What was found: nothing grows; something does; without damping, nothing within the tolerance of the middle; that it can not
  !> be told.
  integer, parameter, public :: no_tongue = 0, tongue = 1, thin = 2, open_question = 3

  type, public :: meeting_type
    integer :: outcome = open_question
    !> Where the pair grows most, or would; how far about there it may grow.
    real(dp) :: t = 0, width = 0
    type(pair_type) :: top
    !> On both sides of a tongue where both of the pair die out, as near as known; `outside`: whether they do.
    type(pair_type) :: sides(2)
    logical :: outside(2) = .false.
  end type meeting_type

  !> As a multiple of the error, to be sure of a growth.
  real(dp), parameter :: clear = 2

contains

  !> Follows the growth of the pair `name` of a stretch to its maximum near `start`, where its phases meet; they part by `rate`
  !> per t. Error: the parameters make no sense.
  subroutine search_meeting(line, stretch, name, start, rate, meeting, error)
    type(line_type), intent(in) :: line
    type(stretch_type), intent(in) :: stretch
    type(pair_name_type), intent(in) :: name
    real(dp), intent(in) :: start, rate
    type(meeting_type), intent(out) :: meeting
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most = 30
    !> A growth is known where it is told by the fit so well, as a part of itself.
    real(dp), parameter :: part = 0.25_dp, beyond = 2
    type(pair_type) :: seen(most), near(3)
    type(pair_fit_type) :: fit
    real(dp) :: bounds(2), told, t(most)
    integer :: three(3), n

    bounds = bounds_about(stretch)
    call three_about(line, stretch, name, start, rate, bounds, seen(:3), error)
    meeting%t = start
    meeting%width = stretch%length()
    if (allocated(error) .or. any(seen(:3)%at%missing())) return
    three = [1, 2, 3]
    do n = 3, most
      meeting%top = seen(maxloc(seen(:n)%growth - clear * seen(:n)%noise, dim=1))
      if (grows(meeting%top)) then
        meeting%outcome = tongue
        call find_outside(line, stretch, name, seen(:n), bounds, meeting, error)
        return
      end if
      if (n == most) return
      near = seen(three)
      fit = fit_pair(near)
      associate (low => near(1)%t, high => near(3)%t)
        meeting%width = high - low
        meeting%t = greatest_growth(fit, max(bounds(1), low - beyond * (high - low)), min(bounds(2), high + beyond * (high - low)))
      end associate
      told = fit%growth(meeting%t)
      associate (next => seen(minloc(abs(seen(:n)%t - meeting%t), dim=1)))
        if (abs(next%t - meeting%t) <= line%step() / 4 + 4 * spacing(next%t)) then
          call judge(next, abs(rate), line%step(), meeting)
          return
        end if
      end associate
      associate (new => seen(n + 1))
        call solve_pair(line, stretch, name, meeting%t, new, error)
        if (allocated(error) .or. new%at%missing()) return
        if (new%growth < -clear * new%noise .and. abs(new%growth - told) < part * abs(new%growth)) then
          meeting%outcome = no_tongue
          return
        end if
      end associate
      t = seen%t
      three = nearest_three(t(:n + 1), meeting%t)
    end do
  end subroutine search_meeting

  elemental logical function grows(pair)
    type(pair_type), intent(in) :: pair

    grows = pair%growth > clear * pair%noise .and. pair%excess() < 0
  end function grows

  !> The places of the three of `t` that are nearest to `here`, that in the middle second.
  pure function nearest_three(t, here) result(three)
    real(dp), intent(in) :: t(:), here
    integer :: three(3)
    logical :: free(size(t))
    integer :: k, least

    free = .true.
    do k = 1, 3
      three(k) = minloc(abs(t - here), dim=1, mask=free)
      free(three(k)) = .false.
    end do
    do k = 1, 2
      least = k - 1 + minloc(t(three(k:)), dim=1)
      three([k, least]) = three([least, k])
    end do
  end function nearest_three

  !> Where on both sides of a tongue's top the pair dies out: the nearest of those that were `seen`, or else ever farther away.
  subroutine find_outside(line, stretch, name, seen, bounds, meeting, error)
    type(line_type), intent(in) :: line
    type(stretch_type), intent(in) :: stretch
    type(pair_name_type), intent(in) :: name
    type(pair_type), intent(in) :: seen(:)
    real(dp), intent(in) :: bounds(2)
    type(meeting_type), intent(inout) :: meeting
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: distance, t, nearest
    integer :: side, i

    do side = 1, 2
      associate (here => meeting%sides(side), top => meeting%top%t, way => 2 * side - 3)
        nearest = huge(nearest)
        do i = 1, size(seen)
          if (seen(i)%excess() <= 0 .or. way * (seen(i)%t - top) <= 0 .or. abs(seen(i)%t - top) > nearest) cycle
          nearest = abs(seen(i)%t - top)
          here = seen(i)
          meeting%outside(side) = .true.
        end do
        distance = max(maxval(seen%t) - minval(seen%t), line%step())
        do while (.not. meeting%outside(side))
          t = top + way * distance
          if (side == 1) t = max(t, bounds(1))
          if (side == 2) t = min(t, bounds(2))
          if (.not. abs(t - top) > 0) exit
          call solve_pair(line, stretch, name, t, here, error)
          if (allocated(error)) return
          if (here%at%missing()) exit
          meeting%outside(side) = here%excess() > 0
          if (.not. abs(t - bounds(side)) > 0) exit
          distance = 2 * distance
        end do
      end associate
    end do
  end subroutine find_outside

  !> How far beside a stretch its pairs are followed; lines that are searched run from 0 to 1.
  pure function bounds_about(stretch) result(bounds)
    type(stretch_type), intent(in) :: stretch
    real(dp) :: bounds(2)
    real(dp), parameter :: beside = 0.25_dp

    bounds = [stretch%ends(1)%t - beside * stretch%length(), stretch%ends(2)%t + beside * stretch%length()]
    bounds = [max(bounds(1), 0.0_dp), min(bounds(2), 1.0_dp)]
  end function bounds_about

  !> The pair at `start` and on both sides of it, about where the detuning is a few times the growth.
  subroutine three_about(line, stretch, name, start, rate, bounds, three, error)
    type(line_type), intent(in) :: line
    type(stretch_type), intent(in) :: stretch
    type(pair_name_type), intent(in) :: name
    real(dp), intent(in) :: start, rate, bounds(2)
    type(pair_type), intent(out) :: three(3)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: times = 3, widest = 0.2_dp
    real(dp) :: s, middle

    call solve_pair(line, stretch, name, start, three(2), error)
    if (allocated(error) .or. three(2)%at%missing()) return
    s = times * max(abs(real(three(2)%mean)), sqrt(abs(three(2)%delta)), three(2)%noise)
    s = min(s, widest * stretch%length() * abs(rate)) / max(abs(rate), tiny(s))
    s = min(max(s, line%step(), 16 * spacing(start)), (bounds(2) - bounds(1)) / 2)
    middle = min(max(start, bounds(1) + s), bounds(2) - s)
    if (abs(middle - start) > 0) call solve_pair(line, stretch, name, middle, three(2), error)
    if (.not. allocated(error)) call solve_pair(line, stretch, name, middle - s, three(1), error)
    if (.not. allocated(error)) call solve_pair(line, stretch, name, middle + s, three(3), error)
  end subroutine three_about

  !> At the maximum of the growth: it is below zero, or zero within the errors.
  pure subroutine judge(top, rate, step, meeting)
    type(pair_type), intent(in) :: top
    real(dp), intent(in) :: rate, step
    type(meeting_type), intent(inout) :: meeting
    real(dp), parameter :: neutral = 10

    if (top%growth < -clear * top%noise) then
      meeting%outcome = no_tongue
    else if (abs(real(top%mean)) <= neutral * top%noise) then
      meeting%outcome = thin
    else
      meeting%width = max(step, 2 * sqrt(2 * clear * top%noise * abs(real(top%mean))) / max(rate, tiny(rate)))
    end if
  end subroutine judge

  !> The end of a tongue between a pair that dies out and one that grows: the zero of its excess. Error: the parameters make no
  !> sense.
  subroutine tongue_end(line, stretch, name, outside, top, t, missing, error)
    type(line_type), intent(in) :: line
    type(stretch_type), intent(in) :: stretch
    type(pair_name_type), intent(in) :: name
    type(pair_type), intent(in) :: outside, top
    real(dp), intent(out) :: t
    logical, intent(out) :: missing
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: share = 0.125_dp
    integer, parameter :: most_steps = 100
    type(root_search_type) :: search
    type(pair_type) :: new
    integer :: k

    missing = .false.
    call search%start(top%t, top%excess(), outside%t, outside%excess())
    do k = 1, most_steps
      t = search%root()
      associate (tolerance => share * line%step() + 2 * spacing(t))
        if (search%found(tolerance)) return
        call solve_pair(line, stretch, name, search%next(tolerance), new, error)
      end associate
      missing = new%at%missing()
      if (allocated(error) .or. missing) return
      call search%take(new%t, new%excess())
    end do
    t = search%root()
  end subroutine tongue_end

end module gestell_task_boundary_line_meeting
