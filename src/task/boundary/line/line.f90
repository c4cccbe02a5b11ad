!> Straight lines through the parameters of a family, and systems on them.
!>
!> Every axis is measured by u: 0 where its range begins and 1 where it ends, in the logarithm where it is logarithmic. All
!> tolerances of borders are in u: relative to the ranges.
module gestell_task_boundary_line
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: failed, impossible, operator(==), unstable, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_task_boundary_line_functions, only: border_functions, border_kinds
  use gestell_task_boundary_line_multipliers, only: border_multipliers
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type
  use gestell_study_member, only: member_type
  use gestell_task_boundary_line_options, only: border_options
  use gestell_task_common_record, only: record_type
  implicit none (type, external)
  private

  public :: coordinate, parameter_at, parameters_at, probe_line, sensitivity, skewed

  !> u(t) = start + t way through the parameters of a family.
  type, extends(border_options), public :: line_type
    class(family_type), pointer :: family => null()
    type(axis_type), allocatable :: axes(:)
    real(dp), allocatable :: start(:), way(:)
    !> Maximum number of meetings of multipliers that are searched: a slow crank has any number of them.
    integer :: most_meetings = 5000
  contains
    procedure :: step
  end type line_type

  !> The system at a point of a line.
  type, public :: probe_type
    real(dp) :: t = 0
    type(verdict_type) :: verdict = failed
    real(dp) :: f(border_kinds) = 0
    logical :: known(border_kinds) = .false., reciprocal = .false.
    !> Argument of the largest multiplier.
    real(dp) :: arg = 0
    !> ln(rho) of all multipliers, imaginary parts in (-pi, pi], and the errors of their real parts; shapes (n).
    complex(dp), allocatable :: z(:)
    real(dp), allocatable :: noise(:)
  contains
    procedure :: missing
    procedure :: is_unstable
    procedure :: exchange
  end type probe_type

contains

  !> The tolerance as a difference of t.
  pure real(dp) function step(self)
    class(line_type), intent(in) :: self

    step = self%tolerance / norm2(self%way)
  end function step

  !> Whether there is no system here, or none that could be solved.
  elemental logical function missing(self)
    class(probe_type), intent(in) :: self

    missing = self%verdict == impossible .or. self%verdict == failed
  end function missing

  elemental logical function is_unstable(self)
    class(probe_type), intent(in) :: self

    is_unstable = self%verdict == unstable
  end function is_unstable

  !> Passes all of it to a record, or takes it from there.
  subroutine exchange(self, record)
    class(probe_type), intent(inout) :: self
    type(record_type), intent(inout) :: record
    integer :: i

    call record%pass(self%t)
    call record%pass(self%verdict)
    do i = 1, border_kinds
      call record%pass(self%f(i))
      call record%pass(self%known(i))
    end do
    call record%pass(self%reciprocal)
    call record%pass(self%arg)
    if (self%missing()) return
    call record%pass(self%z)
    call record%pass(self%noise)
  end subroutine exchange

  !> Solves the system at `t`. Error: the parameters make no sense.
  subroutine probe_line(line, t, probe, error)
    type(line_type), intent(in) :: line
    real(dp), intent(in) :: t
    type(probe_type), intent(out) :: probe
    type(error_type), allocatable, intent(out) :: error
    type(member_type) :: member
    type(multipliers_type) :: multipliers
    type(error_type), allocatable :: failure

    probe%t = t
    call member%make(line%family, parameters_at(line, t), error)
    if (allocated(error)) return
    if (.not. member%is_sound()) then
      probe%verdict = member%state
      return
    end if
    call border_multipliers(member%system, line%accuracy, multipliers, failure)
    call member%take_failure(failure, error)
    if (.not. member%is_sound()) return
    probe%verdict = multipliers%judge()
    probe%arg = abs(multipliers%arg(1))
    probe%z = cmplx(multipliers%log_abs, multipliers%arg, dp)
    probe%noise = multipliers%error
    call border_functions(multipliers, probe%f, probe%known, probe%reciprocal)
  end subroutine probe_line

  !> The parameters at `t`.
  pure function parameters_at(line, t) result(parameters)
    type(line_type), intent(in) :: line
    real(dp), intent(in) :: t
    real(dp) :: parameters(size(line%axes))

    parameters = parameter_at(line%axes, line%start + t * line%way)
  end function parameters_at

  !> The value at `u` of an axis; the ends are exactly those that were given.
  elemental real(dp) function parameter_at(axis, u) result(value)
    type(axis_type), intent(in) :: axis
    real(dp), intent(in) :: u

    if (.not. abs(u) > 0) then
      value = axis%from
    else if (.not. abs(u - 1) > 0) then
      value = axis%to
    else if (axis%logarithmic) then
      value = axis%from * exp(u * log(axis%to / axis%from))
    else
      value = axis%from + u * (axis%to - axis%from)
    end if
  end function parameter_at

  !> d value / du.
  elemental real(dp) function sensitivity(axis, u)
    type(axis_type), intent(in) :: axis
    real(dp), intent(in) :: u

    if (axis%logarithmic) then
      sensitivity = parameter_at(axis, u) * log(axis%to / axis%from)
    else
      sensitivity = axis%to - axis%from
    end if
  end function sensitivity

  !> u of a value; 0 on an axis of one value. Values that a logarithmic axis does not have are far away.
  elemental real(dp) function coordinate(axis, value) result(u)
    type(axis_type), intent(in) :: axis
    real(dp), intent(in) :: value

    u = 0
    if (.not. abs(axis%to - axis%from) > 0) return
    if (.not. axis%logarithmic) then
      u = (value - axis%from) / (axis%to - axis%from)
    else if (value / axis%from > 0) then
      u = log(value / axis%from) / log(axis%to / axis%from)
    else
      u = -huge(u)
    end if
  end function coordinate

  !> u of the values of an axis, those between its ends moved by a part of their distance: borders like to lie at round
  !> values, and a search sees best what lies between its points.
  pure function skewed(count) result(u)
    integer, intent(in) :: count
    real(dp) :: u(max(count, 2))
    real(dp), parameter :: part = 2.718281828e-3_dp
    integer :: i

    u = [((i - 1 + part) / (size(u) - 1), i = 1, size(u))]
    u(1) = 0
    u(size(u)) = 1
  end function skewed

end module gestell_task_boundary_line
