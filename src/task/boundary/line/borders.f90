!> Finds the stability borders in one parameter, where the largest modulus of a multiplier passes through 1. Also finds the stable
!> machine nearest to a given machine.
module gestell_task_boundary_line_borders
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: verdict_length, verdict_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_task_boundary_line_functions, only: kind_names
  use gestell_task_boundary_line, only: border_options, check_search, coordinate, line_type, parameter_at, probe_line, &
    & probe_type, sensitivity
  use gestell_task_boundary_line_search_result, only: search_type
  use gestell_task_boundary_line_search, only: range_nodes, search_line
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type
  use gestell_task_common_executor, only: executor_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: add_open_parts, borders_on, find_borders, line_along, nearest_stable

  !> Tolerance of the monodromy matrix Phi(T) when borders are sought.
  real(dp), parameter, public :: border_accuracy = 1.0e-12_dp
  !> Default tolerance for the deviation of a computed curve from the true border in the plane of two parameters, relative to the
  !> ranges.
  real(dp), parameter, public :: usual_deviation = 1.0e-3_dp

  !> A border: a critical value of a parameter, or a value at which a quantity crosses a level.
  type, public :: border_type
    real(dp) :: value = 0
    !> Error bound of `value`: the border lies between `value - error` and `value + error`. The systems at these two values have the
    !> verdicts `below` and `above`. For a crossing of a level, `below` and `above` are 'within', 'above' or 'undecided'.
    real(dp) :: error = 0
    !> Kind of the border. Stability borders: 'divergence' (multiplier +1), 'period_doubling' (multiplier -1) or 'flutter' (a
    !> conjugate pair). Crossings of a level: 'level', or 'jump' if the quantity jumps across the level.
    character(len=15) :: kind = ""
    !> Argument of the multiplier that has modulus 1 at the border (0 to pi).
    real(dp) :: arg_rad = 0
    character(len=verdict_length) :: below = "", above = ""
    !> Number of the vibration to which the border belongs, if the machine has several vibrations at the same parameter.
    integer :: vibration = 1
    !> State of the machine where its measured quantity crosses a level.
    character(len=verdict_length) :: state = ""
  end type border_type

  !> Part of the range in which a border cannot be excluded. `value`: parameter at the middle of this part. `width`: its width.
  type, public :: open_border_type
    real(dp) :: value = 0, width = 0
  end type open_border_type

  !> Results of a search for borders, other than the borders themselves.
  type, public :: border_rest_type
    !> `meetings`: number of parameter values at which two multipliers meet. `thin`: number of meetings in undamped systems at
    !> which no growth was found. A tongue (region of instability) at such a meeting is narrower than the tolerance.
    integer :: meetings = 0, thin = 0
    !> Parts of the range in which a border cannot be excluded.
    type(open_border_type), allocatable :: places(:)
    !> Number of meetings of multipliers that were not searched because there were too many. `places` includes the parts of the
    !> range that contain them.
    integer :: left_out = 0
  end type border_rest_type

  !> Result of a search, along one parameter, for the nearest system that is not unstable. If the given system is not unstable, it
  !> is itself the result.
  type, public :: nearest_type
    !> Verdict on the system from which the search starts.
    character(len=10) :: verdict = ""
    !> True if the range contains a system that is not unstable.
    logical :: found = .false.
    !> `value`: parameter of the nearest system that is not unstable. `distance`: `value` minus the given parameter.
    real(dp) :: value = 0, distance = 0
    !> Verdict on the nearest system that is not unstable.
    character(len=10) :: there = ""
    !> Error bound of `value` if the nearest system lies on a border, otherwise 0. If the parameter is moved beyond the border by
    !> more than this error, the verdict is `there`.
    real(dp) :: error = 0
    !> Number of parts of the range, closer to the given system than `value`, in which a border cannot be excluded.
    integer :: open = 0
  end type nearest_type

contains

  !> Finds all stability borders in the range of `axis` by the method of gestell_task_boundary_line_search, and lists them in the
  !> direction of the axis. Fails if `check_search` fails, or if the parameters are invalid.
  subroutine find_borders(family, axis, accuracy, tolerance, borders, error, rest, executor)
    !> Family of systems that depend on one parameter
    class(family_type), intent(in), target :: family
    !> Range of the parameter. Component `count`: number of values at which the search starts
    type(axis_type), intent(in) :: axis
    !> Tolerance of the monodromy matrix, integration method, and number of steps
    type(accuracy_type), intent(in) :: accuracy
    !> Tolerance of the borders, relative to the range or, on a logarithmic axis, to the range of the logarithm
    real(dp), intent(in) :: tolerance
    !> Borders, sorted in the direction of the axis
    type(border_type), allocatable, intent(out) :: borders(:)
    type(error_type), allocatable, intent(out) :: error
    !> Number of meetings of multipliers, and parts of the range in which a border cannot be excluded
    type(border_rest_type), intent(out), optional :: rest
    !> Distributes the work over threads. The threads may request members of `family` at the same time
    class(executor_type), intent(inout), optional, target :: executor
    type(border_options) :: options
    type(line_type) :: line
    type(search_type) :: search

    allocate(borders(0))
    call check_search([axis], accuracy, tolerance, error)
    if (allocated(error)) return
    options = border_options(accuracy, tolerance)
    if (present(executor)) options%executor => executor
    call line_along(family, [axis], 1, [axis%from], options, line)
    call search_line(line, range_nodes(axis%count), search, error)
    if (allocated(error)) return
    borders = borders_on(line, search, 1)
    if (present(rest)) call add_open_parts(line, search, rest)
  end subroutine find_borders

  !> Converts the crossings that were found along `line` to borders of one parameter. `number`: number of the vibration to which the
  !> borders belong.
  pure function borders_on(line, search, number) result(borders)
    type(line_type), intent(in) :: line
    type(search_type), intent(in) :: search
    integer, intent(in) :: number
    type(border_type) :: borders(size(search%borders))
    character(len=verdict_length) :: sides(2)
    integer :: i

    do i = 1, size(borders)
      associate (axis => line%axes(1), crossing => search%borders(i), u => line%start(1) + search%borders(i)%t * line%direction(1))
        sides = crossing%verdicts%word()
        if (axis%to < axis%from) sides = sides(2:1:-1)
        borders(i) = border_type(value=parameter_at(axis, u), kind=kind_names(crossing%kind), arg_rad=crossing%arg, &
          & error=abs(sensitivity(axis, u) * line%direction(1)) * crossing%error, below=sides(1), above=sides(2), vibration=number)
      end associate
    end do
  end function borders_on

  !> Adds two results of `search` to `rest`: the numbers of meetings of multipliers, and the parts in which a border cannot be
  !> excluded. Along `line` only one parameter varies.
  pure subroutine add_open_parts(line, search, rest)
    type(line_type), intent(in) :: line
    type(search_type), intent(in) :: search
    type(border_rest_type), intent(inout) :: rest
    integer :: i

    if (.not. allocated(rest%places)) allocate(rest%places(0))
    rest%meetings = rest%meetings + search%meetings
    rest%thin = rest%thin + search%thin
    rest%left_out = rest%left_out + search%left_out
    do i = 1, size(search%open_parts)
      associate (axis => line%axes(1), open_part => search%open_parts(i), u => line%start(1) + search%open_parts(i)%t &
        & * line%direction(1))
        rest%places = [rest%places, open_border_type(parameter_at(axis, u), &
          & abs(sensitivity(axis, u) * line%direction(1)) * open_part%width)]
      end associate
    end do
  end subroutine add_open_parts

  !> Varies one parameter from its value in `base` and finds the nearest system that is not unstable. The verdict on this system
  !> is 'stable' or, without damping, 'undamped' or 'undecided'. The result is a border with its error, an end of the range, or
  !> the system `base` itself.
  !>
  !> Fails if `check_search` fails for the axis of this parameter. Fails also if `base` and `axes` differ in size, if `which` is
  !> out of range, or if the parameters are invalid.
  subroutine nearest_stable(family, base, which, axes, accuracy, tolerance, nearest, error, executor)
    !> Family of systems that depend on all parameters
    class(family_type), intent(in), target :: family
    !> Values of all parameters of the given system
    real(dp), intent(in) :: base(:)
    !> Number of the parameter that varies along the line
    integer, intent(in) :: which
    !> One axis for each parameter; only the range of axis number `which` is used
    type(axis_type), intent(in) :: axes(:)
    !> Tolerance of the monodromy matrix, integration method, and number of steps
    type(accuracy_type), intent(in) :: accuracy
    !> Tolerance of the borders, relative to the range
    real(dp), intent(in) :: tolerance
    !> The nearest system that is not unstable, its distance from `base`, and its verdict
    type(nearest_type), intent(out) :: nearest
    type(error_type), allocatable, intent(out) :: error
    !> Distributes the work over threads. The threads may request members of the family at the same time
    class(executor_type), intent(inout), optional, target :: executor
    type(border_options) :: options
    type(line_type) :: line
    type(probe_type) :: here
    type(search_type) :: search
    type(verdict_type), allocatable :: verdicts(:)
    real(dp), allocatable :: u(:), errors(:), distances(:)
    logical, allocatable :: outside(:)
    real(dp) :: base_coordinate
    integer :: i

    if (size(base) /= size(axes) .or. which < 1 .or. which > size(axes)) then
      call fatal_error(error, "'base' must have one value for each axis, and 'which' must be the number of an axis", invalid_input)
      return
    end if
    call check_search([axes(which)], accuracy, tolerance, error)
    if (allocated(error)) return
    if (.not. all(ieee_is_finite(base))) then
      call fatal_error(error, "the parameters in 'base' must be finite", invalid_input)
      return
    end if
    options = border_options(accuracy, tolerance)
    if (present(executor)) options%executor => executor
    ! `base` may lie outside a logarithmic axis, for example because its sign differs. Linear axes through `base` are therefore
    ! used.
    call line_along(family, [(axis_type(base(i), base(i), 1, .false.), i = 1, size(base))], which, base, options, line)
    call probe_line(line, 0.0_dp, here, error)
    if (allocated(error)) return
    nearest%verdict = here%verdict%word()
    if (.not. (here%missing() .or. here%is_unstable())) then
      nearest = nearest_type(nearest%verdict, .true., base(which), 0.0_dp, nearest%verdict)
      return
    end if
    call line_along(family, axes, which, base, options, line)
    base_coordinate = coordinate(axes(which), base(which))
    u = range_nodes(axes(which)%count)
    if (base_coordinate > 0 .and. base_coordinate < 1) u = [pack(u, u < base_coordinate), base_coordinate, pack(u, &
      & u > base_coordinate)]
    call search_line(line, u, search, error)
    if (allocated(error)) return
    associate (marks => search%marks, borders => search%borders)
      ! The verdict of a system is not reliable within the error of a border.
      outside = [(.not. (marks(i)%is_unstable() .or. any(abs(marks(i)%t - borders%t) <= borders%error)), i = 1, size(marks))]
      u = [pack((marks%t), outside), borders%t]
      errors = [spread(0.0_dp, 1, count(outside)), borders%error]
      verdicts = [pack((marks%verdict), outside), (borders(i)%verdicts(merge(1, 2, borders(i)%enters)), i = 1, size(borders))]
    end associate
    nearest%found = size(u) > 0
    if (.not. nearest%found) return
    distances = parameter_at(axes(which), u) - base(which)
    i = minloc(abs(distances), dim=1)
    nearest%value = parameter_at(axes(which), u(i))
    nearest%distance = distances(i)
    nearest%there = verdicts(i)%word()
    nearest%error = abs(sensitivity(axes(which), u(i))) * errors(i)
    nearest%open = count(abs(parameter_at(axes(which), search%open_parts%t) - base(which)) < abs(nearest%distance))
  end subroutine nearest_stable

  !> Sets up the line through `base` along which only parameter number `which` varies.
  subroutine line_along(family, axes, which, base, options, line)
    class(family_type), intent(in), target :: family
    !> One axis for each parameter; only the range of axis number `which` is used
    type(axis_type), intent(in) :: axes(:)
    integer, intent(in) :: which
    !> Values of the parameters that do not vary
    real(dp), intent(in) :: base(:)
    !> Accuracy, tolerance of the borders, and the executor that distributes the work
    type(border_options), intent(in) :: options
    type(line_type), intent(out) :: line
    integer :: k

    line%border_options = options
    line%family => family
    line%axes = [(axis_type(base(k), base(k), 1, .false.), k = 1, size(axes))]
    line%axes(which) = axes(which)
    allocate(line%start(size(axes)), line%direction(size(axes)), source=0.0_dp)
    line%direction(which) = 1
  end subroutine line_along

end module gestell_task_boundary_line_borders
