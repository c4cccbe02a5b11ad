!> A machine of a family and its neighbours. Each neighbour differs from the machine in one parameter. Differences between them
!> yield the derivatives of functions f that are known without solving the equations of motion, such as the coefficients of these
!> equations:
!>
!>     df/dp = (w_0 f(p) + w_1 f(p + d_1 h) + w_2 f(p + d_2 h)) / h.
!>
!> Usually (d_1, d_2) = (-1, 1). If no machine exists on one side, (d_1, d_2) = (1, 2) or (-1, -2). Such functions are exact up to
!> rounding, so the step is known in advance: h = epsilon^(1/3) times the parameter's range. The errors are h^2 |f'''| / 6 (on one
!> side h^2 |f'''| / 3) and epsilon |f| / h, about 1e-10 of the change of f over the range (J. Nocedal, S. J. Wright, Numerical
!> Optimization, 2006, section 8.1).
module gestell_study_design_perturbed_members
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: sum_drive
  use gestell_model_mechanism, only: drive_columns
  use gestell_model_mechanism_tabulated, only: tabulated_type
  use gestell_model_quantity_rows, only: probe_type
  use gestell_system_family, only: family_type, create_member
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: at_condition, find_members, joined, remember

  !> Property of a link that a design parameter changes: none of those listed, mass, a coordinate of the centre of mass, or moment
  !> of inertia.
  integer, parameter, public :: other_part = 0, mass_part = 1, place_parts(2) = [2, 3], inertia_part = 4
  !> Input keys of those properties of a link that design parameters can change: mass, centre of mass, moment of inertia.
  character(len=9), parameter, public :: part_names(4) = [character(len=9) :: "mass", "center(1)", "center(2)", "inertia"]

  !> Quantity that varies along a line through the range of operating conditions: the speed or the stiffness factor.
  integer, parameter, public :: along_speed = 1, along_stiffness = 2

  !> Operating condition of a machine: its speed (rad/s; 0: the machine's own speed), and the factors that multiply the nominal
  !> values of speed, stiffness and damping.
  type, public :: condition_type
    real(dp) :: speed = 0, speed_factor = 1, stiffness_factor = 1, damping_factor = 1
    !> Quantity that varies along the line of conditions on which this condition lies: `along_speed` or `along_stiffness`
    integer :: along = along_speed
  contains
    procedure :: number, moved_to, drive_rpm
  end type condition_type

  !> How a parameter is changed to compute derivatives by differences.
  type, public :: step_type
    !> Length of the range of the parameter
    real(dp) :: range = 0
    !> If the parameter is a property of a single link: index of the link, and the property. The link is then changed without
    !> building the machine again
    integer :: link = 0, part = other_part
    !> Unit of the parameter, as a multiple of the SI unit
    real(dp) :: unit = 1
  end type step_type

  !> Settings for the computation of all machines of a design: probes that goals may refer to, model of the frame, and accuracy.
  type, public :: setting_type
    type(probe_type), allocatable :: probes(:)
    character(len=11) :: model = "exact"
    type(accuracy_type) :: accuracy
  end type setting_type

  !> A machine and its neighbours. Each neighbour differs from it in one parameter.
  type, public :: members_type
    type(setting_type) :: setting
    !> The machine itself
    type(frame_type) :: frame
    type(step_type), allocatable :: steps(:)
    !> Two neighbours for each parameter, shape (2, parameters); unallocated if no derivatives are requested
    type(frame_type), allocatable :: perturbed(:, :)
    !> Difference formula for each parameter. `distance`: changes of the parameter in its two neighbours, shape (2, parameters).
    !> `weight`: factors of the function values at the machine and at the two neighbours, shape (0:2, parameters)
    real(dp), allocatable :: distance(:, :), weight(:, :)
  end type members_type

  !> Changes of the parameter in its two neighbours, for central, forward and backward differences, in units of the step h.
  real(dp), parameter :: offsets(2, 3) = reshape([-1.0_dp, 1.0_dp, 1.0_dp, 2.0_dp, -1.0_dp, -2.0_dp], [2, 3])
  !> Factors of the function values at the machine and at its two neighbours, for central, forward and backward differences, in
  !> units of 1 / h.
  real(dp), parameter :: weights(0:2, 3) = reshape([0.0_dp, -0.5_dp, 0.5_dp, -1.5_dp, 2.0_dp, -0.5_dp, 1.5_dp, -2.0_dp, 0.5_dp], &
    & [3, 3])

contains

  !> Builds the machine at `parameters` and, if `steps` are given, its neighbours, which have one parameter changed each. The
  !> caller sets `members%setting`. Fails if the parameters are invalid, or if the family's members are not frames.
  subroutine find_members(family, parameters, members, known, error, steps)
    !> The family of machines
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    !> The machine, and its neighbours with one parameter changed each
    type(members_type), intent(out) :: members
    !> True if the machine and all its neighbours exist
    logical, intent(out) :: known
    type(error_type), allocatable, intent(out) :: error
    !> How to change each parameter for derivatives, shape (parameters)
    type(step_type), intent(in), optional :: steps(:)
    real(dp) :: h, x(size(parameters))
    integer :: k, side, i

    call build_frame(family, parameters, members%frame, known, error)
    if (allocated(error) .or. .not. known .or. .not. present(steps)) return
    members%steps = steps
    select type (mechanism => members%frame%mechanism)
    type is (linkage_type)
    class default
      members%steps%link = 0
    end select
    ! In space each link belongs to a plane. If damping ratios are given, the link's mass changes the dampers too. In both cases the
    ! neighbours are built as members of the family.
    if (members%frame%dofs() > 3 .or. members%frame%has_damping_ratios) members%steps%link = 0
    associate (n => size(parameters))
      allocate(members%perturbed(2, n), members%distance(2, n), members%weight(0:2, n))
    end associate
    do k = 1, size(parameters)
      h = epsilon(h)**(1.0_dp / 3) * max(steps(k)%range, epsilon(h)**(1.0_dp / 3) * abs(parameters(k)))
      do side = 1, size(offsets, 2)
        members%distance(:, k) = offsets(:, side) * h
        do i = 1, 2
          if (members%steps(k)%link > 0) then
            call change_link(members%frame, steps(k), members%distance(i, k), members%perturbed(i, k), error)
            known = .not. allocated(error)
          else
            x = parameters
            x(k) = x(k) + members%distance(i, k)
            call build_frame(family, x, members%perturbed(i, k), known, error)
          end if
          if (allocated(error)) known = .false.
          if (.not. known) exit
        end do
        if (known) exit
      end do
      if (.not. known) return
      members%weight(:, k) = weights(:, side) / h
    end do
  end subroutine find_members

  !> Changes a property of one link by `distance` in the parameter's unit. A mass may become negative, because the functions to
  !> differentiate are linear in it. Fails if no support carries the weight of the machine.
  subroutine change_link(frame, step, distance, changed, error)
    type(frame_type), intent(in) :: frame
    type(step_type), intent(in) :: step
    real(dp), intent(in) :: distance
    type(frame_type), intent(out) :: changed
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: change

    change = step%unit * distance
    changed = frame
    select type (linkage => changed%mechanism)
    type is (linkage_type)
      associate (link => linkage%links(step%link))
        select case (step%part)
        case (mass_part)
          link%mass = link%mass + change
          linkage%mass = linkage%mass + change
        case (inertia_part)
          link%inertia = link%inertia + change
          linkage%inertia = linkage%inertia + change
        case default
          link%center(step%part - place_parts(1) + 1) = link%center(step%part - place_parts(1) + 1) + change
        end select
      end associate
    end select
    if (changed%weights%act) call changed%weigh((changed%weights%gravity), error)
  end subroutine change_link

  !> Builds the frame at `parameters`. `known` is false if the mechanism is impossible. Fails if the member of the family is not a
  !> frame.
  subroutine build_frame(family, parameters, frame, known, error)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    type(frame_type), intent(out) :: frame
    logical, intent(out) :: known
    type(error_type), allocatable, intent(out) :: error
    class(periodic_system), allocatable :: system

    call create_member(family, parameters, system, error)
    known = .not. allocated(error)
    if (allocated(error)) then
      if (error%code == impossible_mechanism) deallocate(error)
      return
    end if
    select type (system)
    type is (frame_type)
      frame = system
    class default
      call fatal_error(error, "a design requires frames, but the system is not a frame", invalid_input)
    end select
  end subroutine build_frame

  !> Tabulates the mechanisms of the machine and its neighbours (one parameter changed each) at `phases`, because they are
  !> evaluated at these phases for every speed. If `drive` is true, also tabulates the functions needed for the torque of the
  !> drive. If only a property of a link is changed, the joints move as in the machine, so their positions are computed only once.
  subroutine remember(members, phases, drive)
    type(members_type), intent(inout) :: members
    real(dp), intent(in) :: phases(:)
    logical, intent(in) :: drive
    type(linkage_type), allocatable :: linkage
    type(point_type), allocatable :: at(:, :)
    real(dp) :: angles(size(phases)), effective(size(phases), drive_columns)
    logical :: known
    integer :: i, k

    angles = members%frame%crank_angles(phases)
    if (.not. allocated(members%perturbed)) then
      call members%frame%remember(phases, drive)
      return
    end if
    if (drive .and. any(members%steps%link > 0)) then
      select type (mechanism => members%frame%mechanism)
      type is (linkage_type)
        allocate(linkage, source=mechanism)
      end select
      allocate(at(size(linkage%joints), size(phases)))
      do i = 1, size(phases)
        call linkage%points(angles(i), at(:, i))
      end do
    end if
    call members%frame%remember(phases, drive)
    if (allocated(linkage)) call members%frame%mechanism%tabulate_drive(angles, effective, known)
    do k = 1, size(members%perturbed, 2)
      do i = 1, size(members%perturbed, 1)
        call remember_one(members%perturbed(i, k), members%steps(k)%link)
      end do
    end do

  contains

    !> Tabulates one mechanism. `link`: index of the link whose properties were changed, 0 if no link was changed.
    subroutine remember_one(frame, link)
      type(frame_type), intent(inout) :: frame
      integer, intent(in) :: link
      real(dp), dimension(drive_columns) :: before, after
      real(dp) :: changed(size(phases), drive_columns)
      integer :: k

      if (link == 0 .or. .not. allocated(linkage)) then
        call frame%remember(phases, drive)
        return
      end if
      select type (mechanism => frame%mechanism)
      type is (linkage_type)
        do k = 1, size(phases)
          call sum_drive(linkage%links(link:link), at(:, k), before)
          call sum_drive(mechanism%links(link:link), at(:, k), after)
          changed(k, :) = effective(k, :) + (after - before)
        end do
      end select
      call frame%remember(phases, drive=.false.)
      select type (tabulated => frame%mechanism)
      type is (tabulated_type)
        call tabulated%set_drive_functions(changed)
      end select
    end subroutine remember_one

  end subroutine remember

  !> Value of the quantity that varies along the line of conditions: a speed (rad/s), a speed factor or a stiffness factor.
  elemental real(dp) function number(self)
    class(condition_type), intent(in) :: self

    number = self%speed_factor
    if (abs(self%speed) > 0) number = self%speed * self%speed_factor
    if (self%along == along_stiffness) number = self%stiffness_factor
  end function number

  !> Copy of the condition with a new value of the quantity that varies along its line of conditions. `value`: the new speed
  !> (rad/s), speed factor or stiffness factor.
  elemental function moved_to(self, value) result(there)
    class(condition_type), intent(in) :: self
    real(dp), intent(in) :: value
    type(condition_type) :: there

    there = self
    if (self%along == along_stiffness) then
      there%stiffness_factor = value
    else if (abs(self%speed) > 0) then
      there%speed = value
      there%speed_factor = 1
    else
      there%speed_factor = value
    end if
  end function moved_to

  !> Mean speed of the drive (1/min), which makes `turns` turns in the period; 0: the machine's own speed.
  elemental real(dp) function drive_rpm(self, turns)
    class(condition_type), intent(in) :: self
    integer, intent(in) :: turns

    drive_rpm = self%speed * self%speed_factor * turns * 30 / pi
  end function drive_rpm

  !> Returns a copy of `frame` under `condition`: at the condition's speed, with stiffness and damping of the mounting multiplied
  !> by the condition's factors.
  subroutine at_condition(frame, condition, run)
    type(frame_type), intent(in) :: frame
    type(condition_type), intent(in) :: condition
    type(frame_type), intent(out) :: run
    real(dp) :: speed

    run = frame
    speed = frame%speed
    if (abs(condition%speed) > 0) speed = condition%speed
    call run%run_at(speed * condition%speed_factor)
    call run%scale_mounting(condition%stiffness_factor, condition%damping_factor)
  end subroutine at_condition

  !> Joins two lists: appends to `list` those conditions of `more` that it does not contain yet.
  pure function joined(list, more)
    type(condition_type), intent(in) :: list(:), more(:)
    type(condition_type), allocatable :: joined(:)
    integer :: k

    joined = list
    do k = 1, size(more)
      if (.not. any(are_equal(joined, more(k)))) joined = [joined, more(k)]
    end do
  end function joined

  !> True if two conditions are equal within the tolerance `alike`.
  elemental logical function are_equal(one, other)
    type(condition_type), intent(in) :: one, other
    ! the maxima of two goals at one resonance differ by a fraction of its width, perhaps 1e-6 of the speed; each is found to 1e-11
    real(dp), parameter :: alike = 1.0e-10_dp

    are_equal = abs(one%speed * one%speed_factor - other%speed * other%speed_factor) <= alike * abs(one%speed * one%speed_factor) &
      & .and. all(abs([one%speed_factor - other%speed_factor, one%stiffness_factor - other%stiffness_factor, &
      & one%damping_factor - other%damping_factor]) <= alike)
  end function are_equal

end module gestell_study_design_perturbed_members
