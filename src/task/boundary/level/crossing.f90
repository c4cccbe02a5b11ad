!> Where a number of the vibration crosses its level between two places of a line.
module gestell_task_boundary_level_crossing
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: failed, has_vibration, state_word, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_math_root_search, only: root_search_type
  use gestell_study_speed_point, only: speed_point_type
  use gestell_task_boundary_level_line, only: level_line_type
  use gestell_task_boundary_line_borders, only: border_type
  implicit none (type, external)
  private

  public :: find_crossing, side_of

  !> A crossing; `below` and `above` are the sides of the level at the smaller and at the greater value (see `side_of`).
  type, extends(border_type), public :: level_crossing_type
    !> Whether it was found: there are vibrations all the way.
    logical :: found = .false.
    !> Verdict on the vibration there.
    type(verdict_type) :: verdict = failed
    !> Whether the number is above the level behind it; whether it jumps there, as where the band's end meets an order of the crank,
    !> or another vibration is found.
    logical :: rises = .false., jumps = .false.
    !> Its x on the line, and those between which it lies for certain.
    real(dp) :: x = 0, ends(2) = 0
  end type level_crossing_type

contains

  !> The crossing between two points, at which the number is on different sides of the level. Error: a parameter makes no sense.
  subroutine find_crossing(line, points, crossing, error)
    type(level_line_type), intent(in) :: line
    type(speed_point_type), intent(in) :: points(2)
    type(level_crossing_type), intent(out) :: crossing
    type(error_type), allocatable, intent(out) :: error
    !> A number that changes by more than this part of its level within the tolerance jumps.
    real(dp), parameter :: jump = 1.0e-2_dp
    type(root_search_type) :: search
    type(speed_point_type) :: point
    real(dp) :: x, step

    crossing%ends = points%speed
    crossing%rises = points(2)%values(1, 1) > line%level
    call search%start(points(2)%speed, points(2)%values(1, 1) - line%level, points(1)%speed, points(1)%values(1, 1) - line%level)
    do
      x = search%root()
      step = line%step(x)
      if (search%found(step)) exit
      x = search%next(step)
      call line%solve(x, point, error)
      if (allocated(error)) return
      if (.not. has_vibration(point%state)) return
      call search%take(x, point%values(1, 1) - line%level)
    end do
    call line%solve(x, point, error)
    if (allocated(error)) return
    crossing%found = .true.
    crossing%verdict = point%state
    crossing%state = state_word(point%state)
    crossing%x = x
    crossing%value = line%value(x)
    crossing%jumps = abs(search%f(1) - search%f(2)) > jump * line%level .and. minval(abs(search%f)) > 0
    crossing%kind = merge("jump ", "level", crossing%jumps)
    call enclose(line, points, max(step, search%width()), crossing, error)
  end subroutine find_crossing

  !> Goes away from the crossing, at first by `distance`, until the number is on one side of the level for certain, and on the other
  !> on the other, or to both `points`. Error: a parameter makes no sense.
  subroutine enclose(line, points, distance, crossing, error)
    type(level_line_type), intent(in) :: line
    type(speed_point_type), intent(in) :: points(2)
    real(dp), intent(in) :: distance
    type(level_crossing_type), intent(inout) :: crossing
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most_doublings = 60
    type(speed_point_type) :: here
    character(len=9) :: sides(2)
    real(dp) :: away(2), values(2)
    integer :: k, doubling
    logical :: at_end(2)

    away = sign(distance, points%speed - crossing%x)
    do doubling = 1, most_doublings
      at_end = abs(away) >= abs(points%speed - crossing%x)
      crossing%ends = merge(points%speed, crossing%x + away, at_end)
      do k = 1, 2
        here = points(k)
        if (.not. at_end(k)) call line%solve(crossing%ends(k), here, error)
        if (allocated(error)) return
        sides(k) = side_of(here, line%level)
      end do
      if (all(sides /= "undecided") .or. all(at_end)) exit
      away = 2 * away
    end do
    values = line%value(crossing%ends)
    crossing%error = maxval(abs(values - crossing%value))
    crossing%below = sides(minloc(values, dim=1))
    crossing%above = sides(maxloc(values, dim=1))
  end subroutine enclose

  !> "within" the level or "above" it, "undecided" where the error reaches across it or there is no vibration.
  pure character(len=9) function side_of(point, level) result(side)
    type(speed_point_type), intent(in) :: point
    real(dp), intent(in) :: level

    side = "undecided"
    if (.not. has_vibration(point%state)) return
    if (point%values(1, 1) + point%values(2, 1) <= level) side = "within"
    if (point%values(1, 1) - point%values(2, 1) > level) side = "above"
  end function side_of

end module gestell_task_boundary_level_crossing
