!> Computes the forces at the joints of a machine over the period, and what causes them.
module gestell_task_joints_forces
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  use gestell_model_frame, only: frame_type
  use gestell_model_pairs_forces, only: axial, components, fx, fy, moment, transverse
  use gestell_model_pairs_rows, only: before_loads, find_machine_pairs, inertia, load_count, &
    & plane_pairs_type, weights
  use gestell_model_quantity_joint_quantities, only: joint_place_type, list_joint_places
  use gestell_model_quantity_rows, only: exact_rows, joint_sources, quantity_type
  use gestell_study_vibration, only: check_rows, vibration_type
  use gestell_study_vibration_statistics, only: compute_statistics, history_of, statistics_type
  implicit none (type, external)
  private

  public :: axes_of, find_joint_forces, find_sources, shown_forces

  !> Names of the components of a force, in the order of gestell_model_pairs_forces; the last one is the magnitude.
  integer, parameter, public :: magnitude = components + 1
  character(len=*), parameter, public :: component_names(magnitude) = [character(len=10) :: "fx", "fy", "m", "axial", &
    & "transverse", "f"]

  !> The force at one place, over the period.
  type, public :: joint_force_type
    type(joint_place_type) :: place
    !> One element for each of `component_names`; those of components that were not requested are empty
    type(statistics_type) :: statistics(magnitude)
    !> Values at the times of the history, shape (points + 1, magnitude)
    real(dp), allocatable :: history(:, :)
    !> True if the action at the place has a moment: at guides, and the drive's torque on a crank
    logical :: has_moment = .false.
  end type joint_force_type

  !> The part of a joint force that has one cause.
  type, public :: source_type
    character(len=word_length) :: name = ""
    !> For each joint force: maximum of the magnitude of this part (N), and its component along the joint force when the joint force
    !> has its peak (N)
    real(dp), allocatable :: peak(:), at_peak(:)
  end type source_type

contains

  !> The two components that describe a force: along the axes of the mechanism, or of each link.
  pure function axes_of(of_links) result(axes)
    logical, intent(in) :: of_links
    integer :: axes(2)

    axes = merge([axial, transverse], [fx, fy], of_links)
  end function axes_of

  !> True for the forces that report and pictures show: of two opposite forces at a pin only one.
  elemental logical function shown_forces(force)
    type(joint_force_type), intent(in) :: force

    shown_forces = .not. force%place%repeats
  end function shown_forces

  !> Computes the forces at all places, or at the joints `names`. Fails if the joint forces are not determined, or if they are not
  !> in the motion of the vibration.
  subroutine find_joint_forces(frame, vibration, names, axes, forces, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    !> Names of joints; empty for all joints
    character(len=*), intent(in) :: names(:)
    !> Components of the force whose statistics are required in addition to those of magnitude and moment
    integer, intent(in) :: axes(2)
    type(joint_force_type), allocatable, intent(out) :: forces(:)
    type(error_type), allocatable, intent(out) :: error
    type(joint_place_type), allocatable :: places(:)
    type(quantity_type) :: quantity
    real(dp), allocatable :: history(:)
    integer, allocatable :: chosen(:)
    integer :: i, k, rows

    call list_joint_places(frame, places, error)
    if (allocated(error)) return
    chosen = [(i, i = 1, size(places))]
    if (size(names) > 0) chosen = pack(chosen, [(any(names == places(i)%joint), i = 1, size(places))])
    allocate(forces(size(chosen)))
    rows = exact_rows(frame) + components * size(places)
    do i = 1, size(forces)
      associate (force => forces(i))
        force%place = places(chosen(i))
        allocate(force%history(size(vibration%motion_history, 2), magnitude))
        do k = 1, magnitude
          quantity = quantity_type(dofs=frame%dofs(), of_joints=.true.)
          allocate(quantity%weights(rows, merge(2, 1, k == magnitude)), source=0.0_dp)
          quantity%weights(force%place%row + merge(fx, k, k == magnitude), 1) = 1
          if (k == magnitude) quantity%weights(force%place%row + fy, 2) = 1
          if (any(k == [axes, moment, magnitude])) call compute_statistics(vibration, quantity, force%statistics(k), error)
          if (.not. allocated(error)) call history_of(vibration, quantity, history, error)
          if (allocated(error)) return
          force%history(:, k) = history
        end do
        force%has_moment = force%statistics(moment)%peak > force%statistics(moment)%peak_error
      end associate
    end do
  end subroutine find_joint_forces

  !> Splits the joint forces by their causes: inertia of the links on a frame at rest, their weights, each load, and motion of the
  !> frame. Fails if the joint forces are not determined, or if the vibration was computed without `joint_sources`.
  subroutine find_sources(frame, vibration, forces, sources, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(joint_force_type), intent(in) :: forces(:)
    type(source_type), allocatable, intent(out) :: sources(:)
    type(error_type), allocatable, intent(out) :: error
    type(plane_pairs_type), allocatable :: pairs(:)
    real(dp), allocatable :: total(:, :), part(:, :)
    real(dp) :: along(2)
    integer :: i, k, last, load, peak, row

    call check_rows(vibration, joint_sources, error)
    if (.not. allocated(error)) call find_machine_pairs(frame, pairs, error)
    if (allocated(error)) return
    row = exact_rows(frame)
    last = size(vibration%joint_parts, 3) + 1
    allocate(sources(last))
    sources(inertia)%name = "inertia"
    sources(weights)%name = "weights"
    k = before_loads
    do i = 1, size(pairs)
      do load = 1, load_count(pairs(i:i))
        k = k + 1
        sources(k)%name = pairs(i)%plane%linkage%loads(load)%name
      end do
    end do
    sources(last)%name = "motion of the frame"
    do i = 1, last
      allocate(sources(i)%peak(size(forces)), sources(i)%at_peak(size(forces)), source=0.0_dp)
    end do
    do k = 1, size(forces)
      associate (place => forces(k)%place%row)
        total = vibration%motion(place + fx:place + fy, :)
        peak = maxloc(norm2(total, dim=1), dim=1)
        ! A product of two forces could overflow.
        along = total(:, peak) / max(norm2(total(:, peak)), tiny(1.0_dp))
        do i = 1, last
          if (i < last) part = vibration%joint_parts(place - row + fx:place - row + fy, :, i)
          if (i == last) part = total - sum(vibration%joint_parts(place - row + fx:place - row + fy, :, :), dim=3)
          sources(i)%peak(k) = largest_magnitude(part)
          sources(i)%at_peak(k) = dot_product(along, part(:, peak))
        end do
      end associate
    end do
  end subroutine find_sources

  !> Maximum magnitude of a force with these components, shape (2, samples). The components are scaled, because their squares could
  !> overflow.
  pure real(dp) function largest_magnitude(force)
    real(dp), intent(in) :: force(:, :)
    real(dp) :: unit

    unit = max(maxval(abs(force)), tiny(1.0_dp))
    largest_magnitude = unit * sqrt(maxval((force(1, :) / unit)**2 + (force(2, :) / unit)**2))
  end function largest_magnitude

end module gestell_task_joints_forces
