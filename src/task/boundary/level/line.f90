!> A number of the vibration over one parameter, as a curve over x: the speed itself where that runs, by which resonances are
!> sought, else 1 where the parameter's range begins and 2 where it ends, in the logarithm where it is logarithmic.
module gestell_task_boundary_level_line
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_family, only: family_type
  use gestell_study_grid, only: axis_type
  use gestell_study_speed_point, only: solve_response, speed_order_type, speed_point_type
  use gestell_task_boundary_line, only: coordinate, parameter_at
  implicit none (type, external)
  private

  type, public :: level_line_type
    class(family_type), pointer :: family => null()
    type(axis_type) :: axis
    logical :: over_speed = .false.
    !> The quantity, and what is measured of it; the level of that.
    type(speed_order_type) :: order
    real(dp) :: level = 0
    !> How exactly a crossing is found, relative to the range.
    real(dp) :: tolerance = 0
  contains
    procedure :: value
    procedure :: coordinate_of
    procedure :: step
    procedure :: solve
  end type level_line_type

contains

  !> The parameter at x.
  elemental real(dp) function value(self, x)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x

    value = x
    if (.not. self%over_speed) value = parameter_at(self%axis, x - 1)
  end function value

  !> The x of a parameter.
  elemental real(dp) function coordinate_of(self, value) result(x)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: value

    x = value
    if (.not. self%over_speed) x = 1 + coordinate(self%axis, value)
  end function coordinate_of

  !> The tolerance at x as a difference of x, no less than its roundings.
  pure real(dp) function step(self, x)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x

    step = self%tolerance
    associate (axis => self%axis)
      if (self%over_speed .and. axis%logarithmic) step = step * abs(x * log(axis%to / axis%from))
      if (self%over_speed .and. .not. axis%logarithmic) step = step * abs(axis%to - axis%from)
    end associate
    step = max(step, 4 * spacing(x))
  end function step

  !> The machine at x: values(1:2, 1) of the point are the number and its error. Error: the parameter makes no sense.
  subroutine solve(self, x, point, error)
    class(level_line_type), intent(in) :: self
    real(dp), intent(in) :: x
    type(speed_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error

    call solve_response(self%family, [self%value(x)], self%order, point, error)
    point%speed = x
    if (allocated(point%measured)) point%values(:2, 1) = point%measured(:, 1)
  end subroutine solve

end module gestell_task_boundary_level_line
