!> Straight lines in the space of a family's parameters, and the systems at the points of these lines.
!>
!> Each axis has a coordinate u, which is 0 at the start of its range and 1 at its end. On a logarithmic axis u is linear in the
!> logarithm of the parameter. Tolerances of borders are differences of u and therefore relative to the ranges.
module gestell_task_boundary_line
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_verdict, only: failed, impossible, operator(==), unstable, verdict_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers, only: krein_of, multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type, check_accuracy
  use gestell_task_boundary_line_functions, only: border_functions, border_kinds
  use gestell_task_boundary_line_multipliers, only: border_multipliers
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type, check_axis
  use gestell_study_member, only: member_type
  use gestell_task_common_executor, only: executor_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: check_search, coordinate, parameter_at, probe_line, sensitivity, skewed

  !> Default tolerance of borders in one parameter, relative to the range.
  real(dp), parameter, public :: default_tolerance = 1.0e-10_dp

  !> Options of a search for stability borders.
  type, public :: border_options
    type(accuracy_type) :: accuracy
    !> Allowed error of borders in one parameter, or allowed deviation of border curves in the plane of two parameters. Both are
    !> relative to the ranges of the parameters.
    real(dp) :: tolerance = default_tolerance
    !> Distributes the work over threads. The threads may request members of a family at the same time.
    class(executor_type), pointer :: executor => null()
  end type border_options

  !> Maximum number of points at which a search may start.
  integer(int64), parameter, public :: most_searched = 10_int64**7
  !> Smallest and largest tolerance of borders that can be requested.
  real(dp), parameter, public :: min_tolerance = 1.0e-13_dp, max_tolerance = 0.1_dp

  !> The line u(t) = `start` + t `direction` in the space of a family's parameters.
  type, extends(border_options), public :: line_type
    class(family_type), pointer :: family => null()
    type(axis_type), allocatable :: axes(:)
    !> `start`: coordinates u at t = 0. `direction`: change of the coordinates from t = 0 to t = 1. Both have shape (parameters).
    real(dp), allocatable :: start(:), direction(:)
    !> Maximum number of meetings of multipliers that are searched. A limit is needed, because their number grows without limit as
    !> the speed approaches zero.
    integer :: most_meetings = 5000
  contains
    procedure :: step
  end type line_type

  !> A system at a point of a line, with its multipliers.
  type, public :: probe_type
    real(dp) :: t = 0
    type(verdict_type) :: verdict = failed
    !> Values of the functions of the multipliers whose signs change at borders (see `border_functions`).
    real(dp) :: f(border_kinds) = 0
    !> `sign_certain`: true for each function in `f` whose sign is certain. `reciprocal`: true if the multipliers form pairs rho,
    !> 1/rho.
    logical :: sign_certain(border_kinds) = .false., reciprocal = .false.
    !> Argument of the multiplier with the largest modulus (0 to pi).
    real(dp) :: arg = 0
    !> Logarithms ln(rho) of all multipliers rho, with imaginary parts in (-pi, pi]; shape (number of multipliers).
    complex(dp), allocatable :: z(:)
    !> Error bounds of the real parts of `z`, shape (number of multipliers).
    real(dp), allocatable :: noise(:)
    !> Sign of Krein's form for each multiplier of an undamped system: 1 or -1; 0 if it is unknown. 0 with damping. Shape (number
    !> of multipliers).
    real(dp), allocatable :: krein(:)
  contains
    procedure :: missing, is_unstable, exchange
  end type probe_type

contains

  !> Checks the options of a search for borders. Fails if an axis is invalid or has fewer than two values, or if the search would
  !> start at too many points. Fails also if a tolerance or an accuracy is out of range.
  pure subroutine check_search(axes, accuracy, tolerance, error)
    type(axis_type), intent(in) :: axes(:)
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in) :: tolerance
    type(error_type), allocatable, intent(out) :: error
    integer :: k

    call check_accuracy(accuracy, error)
    do k = 1, size(axes)
      if (.not. allocated(error)) call check_axis(axes(k), error)
    end do
    if (allocated(error)) return
    if (any(axes%count < 2)) then
      call fatal_error(error, "a search for boundaries needs at least two search points on each axis", invalid_input)
    else if (product(real(axes%count, dp)) > most_searched) then
      call fatal_error(error, "the grid of search points has more than 1e7 points", invalid_input)
    else if (.not. (tolerance >= min_tolerance .and. tolerance <= max_tolerance)) then
      call fatal_error(error, "the relative tolerance of boundaries must lie between 1e-13 and 0.1", invalid_input)
    end if
  end subroutine check_search

  !> Tolerance of a border, as a difference of positions t on the line.
  pure real(dp) function step(self)
    class(line_type), intent(in) :: self

    step = self%tolerance / norm2(self%direction)
  end function step

  !> True if no system exists at this point of the line, or if it could not be solved.
  elemental logical function missing(self)
    class(probe_type), intent(in) :: self

    missing = self%verdict == impossible .or. self%verdict == failed
  end function missing

  !> True if the verdict on the system is `unstable`.
  elemental logical function is_unstable(self)
    class(probe_type), intent(in) :: self

    is_unstable = self%verdict == unstable
  end function is_unstable

  !> Writes all components of the probe to a record, or reads them from a record.
  subroutine exchange(self, record)
    class(probe_type), intent(inout) :: self
    type(record_type), intent(inout) :: record
    integer :: i

    call record%pass(self%t)
    call record%pass(self%verdict)
    do i = 1, border_kinds
      call record%pass(self%f(i))
      call record%pass(self%sign_certain(i))
    end do
    call record%pass(self%reciprocal)
    call record%pass(self%arg)
    if (self%missing()) return
    call record%pass(self%z)
    call record%pass(self%noise)
    call record%pass(self%krein)
  end subroutine exchange

  !> Solves the system at the position `t` of the line. Fails if the parameters are invalid.
  subroutine probe_line(line, t, probe, error)
    type(line_type), intent(in) :: line
    real(dp), intent(in) :: t
    type(probe_type), intent(out) :: probe
    type(error_type), allocatable, intent(out) :: error
    type(member_type) :: member
    type(multipliers_type) :: multipliers

    probe%t = t
    call member%make(line%family, parameter_at(line%axes, line%start + t * line%direction), error)
    if (allocated(error)) return
    if (.not. member%is_sound()) then
      probe%verdict = member%state
      return
    end if
    call border_multipliers(member%system, line%accuracy, multipliers, error)
    call member%classify_failure(error)
    if (.not. member%is_sound()) return
    probe%verdict = multipliers%judge()
    probe%arg = abs(multipliers%arg(1))
    probe%z = cmplx(multipliers%log_abs, multipliers%arg, dp)
    probe%noise = multipliers%error
    probe%krein = krein_of(multipliers)
    call border_functions(multipliers, probe%f, probe%sign_certain, probe%reciprocal)
  end subroutine probe_line

  !> Value of the parameter at the coordinate `u` of an axis. For `u` = 0 and 1 it is exactly the start and the end of the range.
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

  !> Derivative of the parameter with respect to its coordinate `u`.
  elemental real(dp) function sensitivity(axis, u)
    type(axis_type), intent(in) :: axis
    real(dp), intent(in) :: u

    sensitivity = axis%to - axis%from
    if (axis%logarithmic) sensitivity = parameter_at(axis, u) * log(axis%to / axis%from)
  end function sensitivity

  !> Coordinate u that belongs to a value of the parameter. It is 0 on an axis with a single value. It is -huge if the axis is
  !> logarithmic and `value` has the wrong sign.
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

  !> Coordinates u (0 to 1) of `count` values of an axis. They are equidistant, but the inner ones are slightly shifted: borders
  !> often lie at round values, and the search works best if it starts at other values.
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
