!> A measured quantity along a line in the space of the parameters, as a function of a variable x. If only the speed varies along
!> the line, x is the speed, because the search for resonances requires it. Otherwise x is 1 at the start of the line and 2 at its
!> end.
module gestell_task_boundary_level_line
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_measure, only: measure_names, measure_type
  use gestell_study_speed_point, only: solve_response, speed_options, speed_point_type
  use gestell_task_boundary_line, only: coordinate, line_type, parameter_at, sensitivity
  implicit none (type, external)
  private

  !> A measured quantity, and the level (value) whose crossings are sought, in the unit of the quantity.
  type, public :: level_type
    type(measure_type) :: measure
    real(dp) :: value = 0
  contains
    procedure :: subject
  end type level_type

  !> Line in the space of the parameters. Along the line a measured quantity is compared with a level.
  type, extends(line_type), public :: level_line_type
    !> True if only the speed varies along the line. The variable x of the line is then the speed.
    logical :: over_speed = .false.
    !> The measured quantity, its measure (peak, rms or band), and how it is computed.
    type(speed_options) :: options
    !> Level of the quantity, in its unit.
    real(dp) :: level = 0
  contains
    procedure :: at, position, value, step_at, solve
  end type level_line_type

contains

  !> Name of the measured quantity and of its measure, for example `f rms`.
  pure function subject(self)
    class(level_type), intent(in) :: self
    character(len=:), allocatable :: subject

    subject = trim(self%measure%quantity) // " " // trim(measure_names(self%measure%kind))
  end function subject

  !> Number of the axis along which the line extends farthest.
  pure integer function along(self)
    class(level_line_type), intent(in) :: self

    along = maxloc(abs(self%direction), dim=1)
  end function along

  !> Converts the position `t` on the line (0 at its start, 1 at its end) to the line's variable x: the speed or, if other
  !> parameters vary, 1 + t.
  elemental real(dp) function at(self, t) result(x)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: t

    x = 1 + t
    associate (k => along(self))
      if (self%over_speed) x = parameter_at(self%axes(k), self%start(k) + t * self%direction(k))
    end associate
  end function at

  !> Converts the line's variable `x` (the speed or a number from 1 to 2) to the position t on the line (0 to 1); the inverse of
  !> `at`.
  elemental real(dp) function position(self, x) result(t)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x

    t = x - 1
    associate (k => along(self))
      if (self%over_speed) t = (coordinate(self%axes(k), x) - self%start(k)) / self%direction(k)
    end associate
  end function position

  !> Value of the parameter that varies most along the line, at the value `x` of the line's variable.
  elemental real(dp) function value(self, x)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x

    value = x
    associate (k => along(self))
      if (.not. self%over_speed) value = parameter_at(self%axes(k), self%start(k) + (x - 1) * self%direction(k))
    end associate
  end function value

  !> Tolerance of a crossing at `x`, in the unit of the line's variable x. It is at least four units in the last place of x.
  pure real(dp) function step_at(self, x) result(step)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x

    step = self%step()
    associate (k => along(self))
      if (self%over_speed) step = self%tolerance * abs(sensitivity(self%axes(k), coordinate(self%axes(k), x)))
    end associate
    step = max(step, 4 * spacing(x))
  end function step_at

  !> Solves the machine at the value `x` of the line's variable. On return `point%values(1, 1)` contains the measured quantity and
  !> `point%values(2, 1)` its error. Fails if the parameters are invalid.
  subroutine solve(self, x, point, error)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x
    type(speed_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: parameters(size(self%axes))

    parameters = parameter_at(self%axes, self%start + self%position(x) * self%direction)
    if (self%over_speed) parameters(along(self)) = x
    call solve_response(self%family, parameters, self%options, point, error)
    point%speed = x
    if (allocated(point%measured)) point%values(:2, 1) = point%measured(:, 1)
  end subroutine solve

end module gestell_task_boundary_level_line
