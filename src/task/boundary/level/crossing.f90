!> Where a number of the vibration crosses its level between two places of a line.
module gestell_task_boundary_level_crossing
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: failed, has_vibration, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_math_root_search, only: root_search_type
  use gestell_study_speed_point, only: speed_point_type
  use gestell_task_boundary_level_line, only: level_line_type
  implicit none (type, external)
  private

  public :: find_crossing, side_of

  type, public :: crossing_type
    !> The parameter there, and how far from it on both sides the sides are told.
    real(dp) :: value = 0, error = 0
    !> At the smaller and at the greater value: within the level, above it, undecided where the number's error reaches across.
    character(len=9) :: below = "undecided", above = "undecided"
    !> Verdict on this vibration.
    type(verdict_type) :: state = failed
    !> Whether the number is above the level behind it.
    logical :: rises = .false.
    !> Whether the number jumps there, as where the band's end meets an order of the crank, or another vibration is found.
    logical :: jumps = .false.
    !> Whether it was found: there are vibrations all the way.
    logical :: found = .false.
    !> Its x on the line, and those between which it lies for certain.
    real(dp) :: x = 0, ends(2) = 0
  end type crossing_type

  !> A number that changes by more than this part of its level within the tolerance jumps.
  real(dp), parameter :: jump = 1.0e-2_dp
  !> Doublings of the distance at which the sides are told.
  integer, parameter :: most_doublings = 60

contains

  !> The crossing between `a` and `b`, on whose sides of the level the numbers differ. Error: a parameter makes no sense.
  subroutine find_crossing(line, a, b, crossing, error)
    type(level_line_type), intent(in) :: line
    type(speed_point_type), intent(in) :: a, b
    type(crossing_type), intent(out) :: crossing
    type(error_type), allocatable, intent(out) :: error
    type(root_search_type) :: search
    type(speed_point_type) :: point
    real(dp) :: x, step

    crossing%ends = [a%speed, b%speed]
    crossing%rises = b%values(1, 1) > line%level
    call search%start(b%speed, b%values(1, 1) - line%level, a%speed, a%values(1, 1) - line%level)
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
    crossing%state = point%state
    crossing%x = x
    crossing%value = line%value(x)
    crossing%jumps = abs(search%f(1) - search%f(2)) > jump * line%level .and. minval(abs(search%f)) > 0
    call tell_sides(line, a, b, x, max(step, search%width()), crossing, error)
  end subroutine find_crossing

  !> Goes away from `x`, at first by `distance`, until the number is on one side of the level for certain, and on the other on the
  !> other, or to `a` and `b`. Error: a parameter makes no sense.
  subroutine tell_sides(line, a, b, x, distance, crossing, error)
    type(level_line_type), intent(in) :: line
    type(speed_point_type), intent(in) :: a, b
    real(dp), intent(in) :: x, distance
    type(crossing_type), intent(inout) :: crossing
    type(error_type), allocatable, intent(out) :: error
    type(speed_point_type) :: points(2)
    character(len=9) :: sides(2)
    real(dp) :: ends(2), away(2), values(2)
    integer :: k, doubling

    ends = [a%speed, b%speed]
    away = sign(distance, ends - x)
    do doubling = 1, most_doublings
      do k = 1, 2
        if (abs(away(k)) < abs(ends(k) - x)) then
          call line%solve(x + away(k), points(k), error)
          if (allocated(error)) return
        else
          away(k) = ends(k) - x
          if (k == 1) points(k) = a
          if (k == 2) points(k) = b
        end if
        sides(k) = side_of(points(k), line%level)
      end do
      if (all(sides /= "undecided") .or. all(abs(away) >= abs(ends - x))) exit
      away = 2 * away
    end do
    crossing%ends = x + away
    values = line%value(crossing%ends)
    values(1) = merge(line%value(a%speed), values(1), abs(away(1)) >= abs(ends(1) - x))
    values(2) = merge(line%value(b%speed), values(2), abs(away(2)) >= abs(ends(2) - x))
    crossing%error = maxval(abs(values - crossing%value))
    crossing%below = sides(minloc(values, dim=1))
    crossing%above = sides(maxloc(values, dim=1))
  end subroutine tell_sides

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
