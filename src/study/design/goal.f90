!> Defines the goals of a design. A goal is a measure of the vibration, of the shaking force on rigid ground or of the drive's
!> torque; the largest multiplier; or a property of the machine, such as the mass, that is known without solving the equations of
!> motion.
module gestell_study_design_goal
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: look_up_quantity
  use gestell_model_quantity_rows, only: accelerations, force_names, guide_forces, joint_forces, probe_type, quantity_type, &
    & rows_of, shifts_of
  use gestell_model_frame_shaking, only: shaking_loads, shaking_terms
  use gestell_model_space, only: is_rotation
  use gestell_model_quantity_driving, only: drive_power, power_rows, torque
  use gestell_study_design_separation, only: separation_type, compute_distances
  use gestell_study_measure, only: band_measure, band_only, measure_names, measure_type, new_measure
  use gestell_study_vibration_motion, only: add_joints, complete_motion, motion_rows
  implicit none (type, external)
  private

  public :: components, new_goal, plain_values, shaking_error, sample_goals

  !> Subjects of goals: a quantity of the motion, a shaking force on rigid ground, the torque of the drive, the largest
  !> multiplier, or a property of the machine, such as the mass, that is known without solving the equations of motion.
  integer, parameter, public :: motion_goal = 1, shaking_goal = 2, torque_goal = 3, multiplier_goal = 4, machine_goal = 5

  character(len=10), parameter :: machine_names(3) = [character(len=10) :: "added_mass", "sag", "separation"]

  !> An objective or a constraint of a design.
  type, public :: goal_type
    type(measure_type) :: measure
    !> Subject of the goal: `motion_goal`, `shaking_goal`, `torque_goal`, `multiplier_goal` or `machine_goal`
    integer :: about = motion_goal
    !> `weight`: factor of the goal in the objective. `limit`: limit of a constraint. `offset`: value of the quantity for the
    !> machine of the input file; it is subtracted from the quantity
    real(dp) :: weight = 1, limit = 0, offset = 0
    !> Kind of limit: 1 upper limit, -1 lower limit, 0 equality
    integer :: sense = 1
    !> Range of speeds within which natural frequencies are to be separated from orders: minimum and maximum (rad/s); 0: the
    !> machine's own speed
    real(dp) :: speeds(2) = 0
  contains
    procedure :: excess, scale => scale_of, sides, is_minimum, needs_motion, is_periodic, is_inverted, level, excess_at
    procedure :: name => name_of
  end type goal_type

contains

  !> Creates a goal from its name and its measure. Fails if the quantity does not exist or does not have this measure. Fails also if
  !> `sag` is requested without gravity.
  subroutine new_goal(frame, probes, name, kind, goal, error)
    !> The frame whose quantity is a goal
    class(frame_type), intent(in) :: frame
    !> Probes that `name` may refer to
    type(probe_type), intent(in) :: probes(:)
    !> Name of the quantity as the user gave it
    character(len=*), intent(in) :: name
    !> Measure of the quantity: `peak_measure`, `rms_measure` or `band_measure`
    integer, intent(in) :: kind
    type(goal_type), intent(out) :: goal
    type(error_type), allocatable, intent(out) :: error

    real(dp) :: offset
    logical :: named

    goal%measure%quantity = name
    goal%measure%kind = kind
    call find_offset(frame, name, offset, named)
    if (any(is_component(frame, name))) then
      goal%about = shaking_goal
      goal%measure%unit = merge("Nm", "N ", index(name, "shaking.m") == 1)
    else if (name == "torque") then
      goal%about = torque_goal
      goal%measure%unit = "Nm"
    else if (name == "rho_max") then
      goal%about = multiplier_goal
    else if (any(name == machine_names)) then
      goal%about = machine_goal
      if (name == "added_mass") goal%measure%unit = "kg"
      if (name == "sag") goal%measure%unit = "m"
      if (name == "separation") goal%measure%unit = "%"
      if (name == "sag" .and. .not. frame%weights%act) call fatal_error(error, "'sag' requires the group &gravity", invalid_input)
    else if (named) then
      goal%about = machine_goal
      goal%measure%unit = "m"
      if (offset < 0) call fatal_error(error, "unknown link in '" // name // "'", invalid_input)
    else
      call new_measure(frame, probes, name, kind, goal%measure, error)
      ! the quantity exists, but it does not have this measure
      if (.not. allocated(error) .or. len_trim(goal%measure%quantity) > 0) return
      error%message = error%message // "; or shaking.fx (.fy, .f, .m), torque, rho_max, added_mass, sag, separation, " &
        & // "link(NAME).offset"
      return
    end if
    if (kind == band_measure .and. .not. allocated(error)) call fatal_error(error, band_only, invalid_input)
  end subroutine new_goal

  !> Maximum number of components in the samples of a goal, which may be a vector: 2 in the plane, 3 in space.
  pure integer function components(frame)
    class(frame_type), intent(in) :: frame

    components = size(shifts_of(frame))
  end function components

  !> Sets `named` to true if `name` has the form link(NAME).offset, and computes this offset (m). A negative offset shows that no
  !> such link exists.
  pure subroutine find_offset(frame, name, offset, named)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: name
    real(dp), intent(out) :: offset
    logical, intent(out) :: named
    character(len=*), parameter :: head = "link(", tail = ").offset"

    offset = -1
    named = len(name) > len(head // tail)
    if (named) named = name(:len(head)) == head .and. name(len(name) - len(tail) + 1:) == tail
    if (named) offset = frame%mechanism%link_offset(name(len(head) + 1:len(name) - len(tail)))
  end subroutine find_offset

  !> Excess of a goal's value over its limit; for an objective the value itself.
  elemental real(dp) function excess(self, value)
    class(goal_type), intent(in) :: self
    real(dp), intent(in) :: value

    excess = self%sense * (value - self%limit)
    if (self%sense == 0) excess = abs(value - self%limit)
  end function excess

  !> Size of a goal to which its excess is compared: the limit; if the limit is zero, the offset; if both are zero, 1.
  elemental real(dp) function scale_of(self)
    class(goal_type), intent(in) :: self

    scale_of = abs(self%limit)
    if (.not. scale_of > 0) scale_of = abs(self%offset)
    if (.not. scale_of > 0) scale_of = 1
  end function scale_of

  !> True if the value of the goal is the minimum of its branches, as for the distance of the nearest natural frequency from an
  !> order. All other goals are the maximum of their branches.
  elemental logical function is_minimum(self)
    class(goal_type), intent(in) :: self

    is_minimum = self%about == machine_goal .and. self%measure%quantity == "separation"
  end function is_minimum

  !> For each branch of a goal under one condition, shape (branches, 2): column 1 is true if the branch is compared with an upper
  !> limit, column 2 if it is compared with a lower limit. If a goal is the maximum of its branches, all branches must stay below
  !> an upper limit, but only the largest must reach a lower limit.
  pure function sides(self, values)
    class(goal_type), intent(in) :: self
    real(dp), intent(in) :: values(:)
    logical :: sides(size(values), 2)
    integer :: decisive

    sides = .true.
    sides(:, merge(1, 2, self%is_minimum())) = .false.
    decisive = maxloc(values, dim=1)
    if (self%is_minimum()) decisive = minloc(values, dim=1)
    sides(decisive, :) = .true.
    if (self%sense /= 0) sides(:, merge(2, 1, self%sense > 0)) = .false.
  end function sides

  !> True if the vibration must be computed to evaluate the goal.
  elemental logical function needs_motion(self)
    class(goal_type), intent(in) :: self

    needs_motion = any(self%about == [motion_goal, torque_goal, multiplier_goal])
  end function needs_motion

  !> True if the goal is a measure (peak or rms) of a function of time.
  elemental logical function is_periodic(self)
    class(goal_type), intent(in) :: self

    is_periodic = any(self%about == [motion_goal, shaking_goal, torque_goal])
  end function is_periodic

  !> True if the level of the goal (see the function `level`) is -1 / value^2.
  elemental logical function is_inverted(self)
    class(goal_type), intent(in) :: self

    is_inverted = self%sense > 0 .and. all(self%about /= [multiplier_goal, machine_goal])
  end function is_inverted

  !> Level of an excess: an increasing function of the excess, chosen so that its maximum over a range is easy to find. Near a
  !> resonance the peak is P = P_0 / sqrt(1 + u^2), where u is the distance from the resonance in half widths of the resonance.
  !> Its level -1 / P^2 is a parabola.
  elemental real(dp) function level(self, excess)
    class(goal_type), intent(in) :: self
    real(dp), intent(in) :: excess

    level = excess
    if (.not. self%is_inverted()) return
    level = -huge(level)
    if (excess + self%limit > 1 / sqrt(huge(level))) level = -1 / (excess + self%limit)**2
  end function level

  !> Excess of the goal over its limit, computed from the level of this excess; inverse function of `level`.
  elemental real(dp) function excess_at(self, level)
    class(goal_type), intent(in) :: self
    real(dp), intent(in) :: level

    excess_at = level
    if (self%is_inverted()) excess_at = 1 / sqrt(-level) - self%limit
  end function excess_at

  !> Name of the goal in reports, for example "f rms" or "added_mass".
  pure function name_of(self) result(name)
    class(goal_type), intent(in) :: self
    character(len=len(self%measure%quantity) + 1 + len(measure_names)) :: name

    name = self%measure%quantity
    if (self%is_periodic()) name = trim(name) // " " // measure_names(self%measure%kind)
  end function name_of

  !> Samples the periodic goals at `phases`. A goal that is the magnitude of a vector has several components; all other goals have
  !> one. Fails if a quantity does not exist, or if the mechanism does not define its energy.
  subroutine sample_goals(goals, frame, probes, phases, q, samples, error)
    type(goal_type), intent(in) :: goals(:)
    !> The frame whose quantities are the goals
    class(frame_type), intent(in) :: frame
    !> Probes that the goals may refer to
    type(probe_type), intent(in) :: probes(:)
    real(dp), contiguous, intent(in) :: phases(:)
    !> Motion of the frame and its first and second derivatives with respect to theta = 2 pi t/T, shape (phases, dofs, 0:2)
    real(dp), intent(in) :: q(:, :, 0:)
    !> Samples of the components, shape (phases, components, goals)
    real(dp), intent(out) :: samples(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: motion(:, :), forces(:, :), power(:, :)
    type(quantity_type) :: quantity
    logical :: known
    integer, allocatable :: parts(:)
    integer :: dofs, i, k, n, rows
    logical :: of_joints

    samples = 0
    dofs = frame%dofs()
    rows = merge(guide_forces, accelerations, size(frame%free) < dofs)
    of_joints = any([(goals(i)%about == motion_goal .and. index(goals(i)%measure%quantity, "joint(") == 1, i = 1, size(goals))])
    rows = motion_rows(frame, merge(joint_forces, rows, of_joints))
    allocate(motion(rows, size(phases)), power(power_rows, size(phases)), source=0.0_dp)
    if (any(goals%needs_motion())) then
      do k = 0, 2
        motion(dofs * k + 1:dofs * (k + 1), :) = (2 * pi / frame%period)**k * transpose(q(:, :, k))
      end do
      if (rows > rows_of(dofs, accelerations)) call complete_motion(frame, frame, phases, motion)
      if (of_joints) call add_joints(frame, phases, motion)
    end if
    if (any(goals%about == shaking_goal)) call shaking_loads(frame, phases, forces)
    do i = 1, size(goals)
      select case (goals(i)%about)
      case (motion_goal)
        call look_up_quantity(frame, probes, trim(goals(i)%measure%quantity), quantity, error)
        if (allocated(error)) return
        do k = 1, size(quantity%weights, 2)
          n = min(rows, size(quantity%weights, 1))
          samples(:, k, i) = matmul(quantity%weights(:n, k), motion(:n, :))
        end do
      case (shaking_goal)
        parts = pack([(k, k = 1, dofs)], is_component(frame, goals(i)%measure%quantity))
        samples(:, :size(parts), i) = forces(:, parts)
      case (torque_goal)
        call drive_power(frame, phases, (motion(:rows_of(dofs, accelerations), :)), power, known)
        if (.not. known) then
          call fatal_error(error, "'torque' requires the kinetic energy of the mechanism: add the key energy to " // &
            &   "&mass_functions", invalid_input)
          return
        end if
        samples(:, 1, i) = power(torque, :) / frame%mechanism%turns
      case default ! other goals have no samples
      end select
    end do
  end subroutine sample_goals

  !> Bound on the rounding error of a shaking force (N, N m).
  pure real(dp) function shaking_error(frame, quantity) result(error)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: quantity
    real(dp), parameter :: roundings = 16

    error = roundings * frame%rounding * norm2(pack(shaking_terms(frame), is_component(frame, quantity)))
  end function shaking_error

  !> True for the degrees of freedom whose loads are components of the shaking force or moment `quantity`, shape (dofs).
  pure function is_component(frame, quantity)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: quantity
    logical :: is_component(frame%dofs())
    integer :: k

    is_component = "shaking." // force_names(:frame%dofs()) == quantity
    if (quantity == "shaking.f") is_component = .not. is_rotation([(k, k = 1, frame%dofs())])
  end function is_component

  !> Computes a goal that is a property of the machine, such as the mass. The separation of natural frequencies from orders has
  !> one value for each of `branches`; all other properties have one value.
  subroutine plain_values(goal, frame, branches, values)
    type(goal_type), intent(in) :: goal
    class(frame_type), intent(in) :: frame
    type(separation_type), intent(in) :: branches
    real(dp), allocatable, intent(out) :: values(:)
    real(dp) :: offset
    logical :: named

    select case (goal%measure%quantity)
    case ("added_mass")
      values = [frame%mass + frame%mechanism%mass]
    case ("sag")
      values = [norm2(frame%weights%sag(:3))]
    case ("separation")
      call compute_distances(frame, goal%speeds, branches, values)
    case default
      call find_offset(frame, trim(goal%measure%quantity), offset, named)
      values = [offset]
    end select
    values = values - goal%offset
  end subroutine plain_values

end module gestell_study_design_goal
