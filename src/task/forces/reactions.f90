!> Computes the forces on the ground, which are called reactions: those of every support, of the foundation and of the guides, and
!> their total.
module gestell_task_forces_reactions
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text, whole_number
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_rows, only: guide_forces, probe_type, quantity_type, shifts_of, velocities
  use gestell_model_space, only: in_frame, in_space
  use gestell_study_vibration_statistics, only: history_of, statistics_type, compute_minimum, compute_statistics
  use gestell_study_vibration, only: check_rows, vibration_type
  use gestell_task_common_executor, only: executor_type
  implicit none (type, external)
  private

  public :: find_reactions, has_component, components_of, static_force, support_positions

  !> Components of a reaction: force on the ground along x and y, its magnitude (N), and moment about the rest position of F (N m).
  !> In space also the force along z and the moments about x and y; `moment` is then the moment about z. The reactions of supports
  !> have no moments.
  integer, parameter, public :: along_x = 1, along_y = 2, force_magnitude = 3, moment = 4, along_z = 5, moment_x = 6, &
    & moment_y = 7, component_count = 7
  character(len=2), parameter, public :: component_names(component_count) = &
    & [character(len=2) :: "fx", "fy", "f", "m", "fz", "mx", "my"]

  !> A reaction: the force exerted on the ground by one support, by the foundation, by the guides, or by all of them together.
  type, public :: reaction_type
    !> Name of the reaction: the number of the support, "foundation", "guide" or "total"
    character(len=12) :: name = ""
    !> Position at which the reaction acts, in the frame's axes (m): two coordinates, or three in space
    real(dp), allocatable :: position(:)
    !> True if the reaction has a moment; false for the reaction of a support
    logical :: turns = .true.
    !> Peak, rms and harmonics of each component over the period, shape (components)
    type(statistics_type), allocatable :: statistics(:)
    !> Values at the times of the vibration's history, shape (points + 1, components)
    real(dp), allocatable :: history(:, :)
    !> `includes_weight`: true if the static forces due to gravity were computed. `bears_load`: true if the reaction is that of a
    !> support that carries load when the machine is at rest
    logical :: includes_weight = .false., bears_load = .false.
    !> Static force on the ground due to gravity (N): two components, or three in space
    real(dp), allocatable :: static(:)
    !> Minimum over the period of the force in the direction of gravity, static force included, and its error bound (N). If the
    !> minimum is negative, a support that carries load lifts off.
    real(dp) :: least_compression = 0, min_error = 0
  end type reaction_type

contains

  !> Components that the reaction has, in the order in which the report lists them.
  pure function components_of(reaction) result(parts)
    type(reaction_type), intent(in) :: reaction
    integer, allocatable :: parts(:)

    parts = [along_x, along_y, force_magnitude]
    if (size(reaction%position) == 3) parts = [along_x, along_y, along_z, force_magnitude]
    if (reaction%turns .and. size(reaction%position) == 3) parts = [parts, moment_x, moment_y]
    if (reaction%turns) parts = [parts, moment]
  end function components_of

  !> True if the reaction has the component `part`.
  pure logical function has_component(reaction, part)
    type(reaction_type), intent(in) :: reaction
    integer, intent(in) :: part

    has_component = any(components_of(reaction) == part)
  end function has_component

  !> Positions of the supports in the frame's axes (m), shape (2, supports); in space shape (3, supports).
  pure function support_positions(frame) result(positions)
    class(frame_type), intent(in) :: frame
    real(dp), allocatable :: positions(:, :)
    integer :: i, n

    n = size(shifts_of(frame))
    positions = reshape([(frame%supports(i)%position(:n), i = 1, size(frame%supports))], [n, size(frame%supports)])
  end function support_positions

  !> Computes all reactions: those of the supports in the frame's order, then those of the foundation and the guides if there are
  !> any, then the total. Fails if the frame's `check` fails, or if `vibration` lacks rows of the motion from which the forces are
  !> computed.
  subroutine find_reactions(frame, vibration, reactions, error, executor)
    class(frame_type), intent(in) :: frame
    !> The periodic vibration of the frame
    type(vibration_type), intent(in) :: vibration
    !> All reactions; the last element is the total
    type(reaction_type), allocatable, intent(out) :: reactions(:)
    type(error_type), allocatable, intent(out) :: error
    !> Displays the progress, which is useful if there are thousands of supports
    class(executor_type), intent(inout), optional :: executor
    !> Number of supports between two updates of the progress display. With fewer supports, progress is not displayed
    integer, parameter :: many = 500
    type(quantity_type), allocatable :: parts(:), guide(:)
    real(dp), allocatable :: positions(:, :)
    logical :: has_foundation, has_guide
    integer :: i, n

    has_guide = size(frame%free) < frame%dofs()
    call frame%check(error)
    if (.not. allocated(error)) call check_rows(vibration, merge(guide_forces, velocities, has_guide), error)
    if (allocated(error)) return
    positions = support_positions(frame)
    n = size(positions, 2)
    call find_components(frame, "foundation.", parts)
    has_foundation = .false.
    do i = 1, size(parts)
      if (allocated(parts(i)%weights)) has_foundation = has_foundation .or. any(abs(parts(i)%weights) > 0)
    end do
    allocate(reactions(n + count([has_foundation, has_guide]) + 1))
    do i = 1, size(reactions)
      allocate(reactions(i)%position(size(positions, 1)), reactions(i)%static(size(positions, 1)), source=0.0_dp)
    end do
    if (has_foundation) call compute_reaction(frame, vibration, "foundation", parts, reactions(n + 1), error)
    if (allocated(error)) return
    do i = 1, n
      if (present(executor) .and. modulo(i, many) == 0) call executor%show("supports", (i - 1.0_dp) / n)
      call find_components(frame, "support(" // text(i) // ").", parts)
      reactions(i)%position = positions(:, i)
      reactions(i)%turns = .false.
      call compute_reaction(frame, vibration, text(i), parts, reactions(i), error)
      if (allocated(error)) return
    end do
    if (present(executor) .and. n >= many) call executor%show("supports", 1.0_dp)
    call find_components(frame, "guide.", guide)
    if (has_guide) call compute_reaction(frame, vibration, "guide", guide, reactions(size(reactions) - 1), error)
    if (allocated(error)) return
    call find_components(frame, "total.", parts)
    call compute_reaction(frame, vibration, "total", parts, reactions(size(reactions)), error)
  end subroutine find_reactions

  !> Adds to `reaction` the static force due to gravity, and the minimum over the period of the force in the direction of gravity.
  !> `parts`: the quantities from which the components of the reaction are computed.
  subroutine add_static_force(frame, vibration, parts, reaction, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(quantity_type), intent(in) :: parts(:)
    type(reaction_type), intent(inout) :: reaction
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: roundings = 1.0e-12_dp
    integer, parameter :: axes(3) = [along_x, along_y, along_z]
    type(quantity_type) :: along
    real(dp) :: down(3), least, bearing
    integer :: i, n

    n = size(reaction%position)
    down = frame%weights%gravity / norm2(frame%weights%gravity)
    along = parts(along_x)
    along%weights = down(1) * along%weights
    if (allocated(along%rounding)) along%rounding = abs(down(1)) * along%rounding
    do i = 2, n
      along%weights = along%weights + down(i) * parts(axes(i))%weights
      if (allocated(along%rounding)) along%rounding = along%rounding + abs(down(i)) * parts(axes(i))%rounding
    end do
    call compute_minimum(vibration, along, least, reaction%min_error, error)
    if (allocated(error)) return
    reaction%includes_weight = .true.
    reaction%static = static_force(frame, trim(reaction%name))
    bearing = dot_product(down(:n), reaction%static)
    reaction%least_compression = bearing + least
    ! The error of the static force is the rounding error of the gravity forces.
    reaction%min_error = reaction%min_error + 16 * epsilon(bearing) * (norm2(reaction%static) + norm2(frame%weights%weight))
    ! If a guide carries the frame, the supports carry no load and cannot lift off.
    reaction%bears_load = .not. reaction%turns .and. bearing > roundings * norm2(frame%weights%weight)
  end subroutine add_static_force

  !> Static force (N) that gravity causes in the reaction with this `name`: two components, or three in space.
  pure function static_force(frame, name) result(force)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: name
    real(dp), allocatable :: force(:)
    integer, parameter :: shifts(3) = in_frame(:3)
    integer :: i, n

    n = size(shifts_of(frame))
    allocate(force(n), source=0.0_dp)
    associate (weights => frame%weights, sag => frame%weights%sag(in_space(:frame%dofs())))
      select case (name)
      case ("total")
        force = weights%weight(:n)
      case ("guide")
        do i = 1, n
          if (all(frame%free /= shifts(i))) force(i) = weights%weight(i) - dot_product(frame%stiffness(shifts(i), :), sag)
        end do
      case ("foundation")
        force = matmul(frame%foundation_stiffness(shifts(:n), :), sag)
      case default
        i = whole_number(name)
        if (i >= 1 .and. i <= size(frame%supports)) force = frame%supports(i)%static(:n)
      end select
    end associate
  end function static_force

  !> Finds the quantities from which the components of a reaction are computed. `reaction`: name of the reaction, followed by a
  !> dot, for example "support(2).". If the reaction does not have component number i, `parts(i)%weights` stays unallocated.
  subroutine find_components(frame, reaction, parts)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: reaction
    type(quantity_type), allocatable, intent(out) :: parts(:)
    type(probe_type) :: none(0)
    type(error_type), allocatable :: error
    integer :: i

    allocate(parts(frame%dofs() + 1))
    do i = 1, size(parts)
      call find_quantity(frame, none, reaction // trim(component_names(i)), parts(i), error)
    end do
  end subroutine find_components

  !> Computes statistics and history of the reaction with this `name`. `parts`: the quantities from which the components of the
  !> reaction are computed.
  subroutine compute_reaction(frame, vibration, name, parts, reaction, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    character(len=*), intent(in) :: name
    type(quantity_type), intent(in) :: parts(:)
    type(reaction_type), intent(inout) :: reaction
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: history(:)
    integer :: i

    reaction%name = name
    allocate(reaction%statistics(size(parts)))
    allocate(reaction%history(size(vibration%motion_history, 2), size(parts)), source=0.0_dp)
    do i = 1, size(parts)
      if (.not. allocated(parts(i)%weights)) cycle
      call compute_statistics(vibration, parts(i), reaction%statistics(i), error)
      if (.not. allocated(error)) call history_of(vibration, parts(i), history, error)
      if (allocated(error)) return
      reaction%history(:, i) = history
    end do
    if (frame%weights%act) call add_static_force(frame, vibration, parts, reaction, error)
  end subroutine compute_reaction

end module gestell_task_forces_reactions
