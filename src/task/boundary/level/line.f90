!> A number of the vibration along a line through the parameters, as a curve over x: the speed itself where the line runs along that
!> alone, by which resonances are sought, else 1 where the line begins and 2 where it ends.
module gestell_task_boundary_level_line
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_speed_point, only: solve_response, speed_options, speed_point_type
  use gestell_task_boundary_line, only: coordinate, line_type, parameter_at, parameters_at, sensitivity
  implicit none (type, external)
  private

  type, public :: level_line_type
    type(line_type) :: line
    logical :: over_speed = .false.
    !> The quantity, and what is measured of it; the level of that.
    type(speed_options) :: options
    real(dp) :: level = 0
  contains
    procedure :: at
    procedure :: position
    procedure :: value
    procedure :: step
    procedure :: solve
  end type level_line_type

contains

  !> The axis along which the line runs, or runs farthest.
  pure integer function along(self)
    class(level_line_type), intent(in) :: self

    along = maxloc(abs(self%line%way), dim=1)
  end function along

  !> The x of a place t on the line.
  elemental real(dp) function at(self, t) result(x)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: t

    x = 1 + t
    associate (k => along(self))
      if (self%over_speed) x = parameter_at(self%line%axes(k), self%line%start(k) + t * self%line%way(k))
    end associate
  end function at

  !> The place t on the line at x.
  elemental real(dp) function position(self, x) result(t)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x

    t = x - 1
    associate (k => along(self))
      if (self%over_speed) t = (coordinate(self%line%axes(k), x) - self%line%start(k)) / self%line%way(k)
    end associate
  end function position

  !> The parameter along which the line runs, at x.
  elemental real(dp) function value(self, x)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x

    value = x
    associate (k => along(self))
      if (.not. self%over_speed) value = parameter_at(self%line%axes(k), self%line%start(k) + (x - 1) * self%line%way(k))
    end associate
  end function value

  !> The tolerance at x as a difference of x, no less than its roundings.
  pure real(dp) function step(self, x)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x

    step = self%line%step()
    if (self%over_speed) then
      associate (axis => self%line%axes(along(self)))
        step = self%line%tolerance * abs(sensitivity(axis, coordinate(axis, x)))
      end associate
    end if
    step = max(step, 4 * spacing(x))
  end function step

  !> The machine at x: values(1:2, 1) of the point are the number and its error. Error: the parameters make no sense.
  subroutine solve(self, x, point, error)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x
    type(speed_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: parameters(size(self%line%axes))

    parameters = parameters_at(self%line, self%position(x))
    if (self%over_speed) parameters(along(self)) = x
    call solve_response(self%line%family, parameters, self%options, point, error)
    point%speed = x
    if (allocated(point%measured)) point%values(:2, 1) = point%measured(:, 1)
  end subroutine solve

end module gestell_task_boundary_level_line
