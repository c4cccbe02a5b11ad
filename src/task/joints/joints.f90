!> The task `joints`: computes the forces that the bodies of the mechanism exert on each other at its joints.
module gestell_task_joints
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: either
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: group_named, group_type, has
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema, only: group_rule, schema_type
  use gestell_input_schema_read, only: read
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_joint_quantities, only: joint_place_type, list_joint_places, pair_words
  use gestell_model_quantity_rows, only: joint_sources
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_harmonics, add_order_column, add_orders, add_turn
  use gestell_output_table_unit, only: degree, newton, newton_metre, unit_type
  use gestell_study_vibration, only: vibration_type
  use gestell_study_vibration_rigid_ground, only: solve_on_rigid_ground
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_joints_forces, only: axes_of, component_names, find_joint_forces, find_sources, joint_force_type, magnitude, &
    & source_type
  use gestell_task_joints_keys, only: joints_keys
  use gestell_task_joints_plot, only: plot_histories, plot_loads, plot_orders, plot_sources
  use gestell_task_joints_report, only: joint_lines
  use gestell_model_pairs_forces, only: moment
  implicit none (type, external)
  private

  type, extends(task_type), public :: joints_task
    private
    !> `rigid`: true if the frame is at rest. `of_links`: true if components refer to the axes of each link
    logical :: rigid = .false., of_links = .false.
    !> Names of the joints to report; empty for all joints
    character(len=word_length), allocatable :: names(:)
  contains
    procedure :: describe, read => read_joints, run
    procedure, nopass :: extend
  end type joints_task

  type(unit_type), parameter :: units(magnitude) = [newton, newton, newton_metre, newton, newton, newton]

contains

  pure subroutine describe(self)
    class(joints_task), intent(inout) :: self

    self%name = "joints"
    self%meaning = "forces in the bearings, guides and cams of the mechanism"
    self%tables = [character(len=longest_table) :: "joints", "joints_history", "joints_harmonics", "joints_sources"]
    self%gives_verdict = .true.
  end subroutine describe

  !> Adds the group &joints to the input schema.
  subroutine extend(schema)
    type(schema_type), intent(inout) :: schema

    call schema%add(group_rule("joints", "for the task `joints`: which joint forces to compute, on which frame"), joints_keys)
  end subroutine extend

  !> Reads the group &joints. Fails if a joint does not exist, or if the task is requested and the forces are not determined.
  subroutine read_joints(self, configuration, error)
    class(joints_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(joint_place_type), allocatable :: places(:)
    type(error_type), allocatable :: failure
    type(group_type) :: group
    character(len=:), allocatable :: word
    integer :: i, k

    group = group_named(configuration%document, "joints")
    call read(group, joints_keys, "on", word, error)
    if (allocated(error)) return
    self%rigid = word == "rigid"
    call read(group, joints_keys, "axes", word, error)
    if (allocated(error)) return
    self%of_links = word == "link"
    allocate(self%names(0))
    if (has(group, "names")) call read(group, joints_keys, "names", self%names, error)
    if (allocated(error) .or. .not. self%requested) return
    call list_joint_places(configuration%frame, places, failure)
    if (allocated(failure)) then
      call input_error(group, "", failure%message, error)
      return
    end if
    do i = 1, size(self%names)
      if (.not. any([(places(k)%joint == self%names(i), k = 1, size(places))])) then
        call input_error(group, "names", "there is no joint '" // trim(self%names(i)) // "' at which forces act", error)
        return
      end if
    end do
    if (.not. self%rigid) configuration%analysis%rows = max(configuration%analysis%rows, joint_sources)
  end subroutine read_joints

  !> Computes the joint forces, and adds tables, pictures and report to `result`.
  subroutine run(self, context, result, error)
    class(joints_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error

    associate (options => context%configuration%analysis)
      if (self%rigid) then
        block
          type(vibration_type) :: rest
          call solve_on_rigid_ground(context%configuration%frame, options%points, options%harmonics, rest)
          call report_forces(self, context, context%configuration%frame, rest, result, error)
        end block
      else if (allocated(context%analysis%vibration)) then
        call report_forces(self, context, context%analysis%frame, context%analysis%vibration, result, error)
      end if
    end associate
  end subroutine run

  !> Adds tables, pictures and report on the joint forces in the motion `vibration`.
  subroutine report_forces(self, context, frame, vibration, result, error)
    class(joints_task), intent(in) :: self
    type(context_type), intent(in) :: context
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(joint_force_type), allocatable :: forces(:)
    type(source_type), allocatable :: sources(:)
    type(table_type) :: table, histories, harmonics, shares
    character(len=:), allocatable :: column, ground, turn
    integer :: i, k, last

    last = context%configuration%analysis%harmonics
    call find_joint_forces(frame, vibration, self%names, axes_of(self%of_links), forces, error)
    if (.not. allocated(error)) call find_sources(frame, vibration, forces, sources, error)
    if (allocated(error)) return
    if (.not. all([(all(forces(i)%statistics%finite()), i = 1, size(forces))])) then
      call fatal_error(error, "the joint forces overflow double precision", failed_computation)
      return
    end if
    ground = either("on rigid ground", "on its mounts", self%rigid)
    turn = turns_in_words(frame%mechanism%turns)
    table = summary(self, forces, frame, ground)
    histories = new_table("joints_history", "Joint forces over " // turn, "Joint forces of the machine " // ground // " during " &
      & // turn // ".")
    call add_turn(histories, frame, size(forces(1)%history, 1) - 1)
    harmonics = new_table("joints_harmonics", "Joint forces by orders", "Amplitudes of the joint forces of the machine " // ground &
      & // ", for each order of the crank speed.")
    call add_orders(harmonics, frame, last)
    k = count(forces%has_moment)
    call histories%expect((magnitude - 1) * size(forces) + k)
    call harmonics%expect(2 * (2 * size(forces) + k))
    do i = 1, size(forces)
      do k = 1, magnitude
        if (k == moment .and. .not. forces(i)%has_moment) cycle
        column = trim(component_names(k)) // "_" // trim(forces(i)%place%name)
        call histories%add(column, units(k), "force or moment on " // trim(forces(i)%place%body), forces(i)%history(:, k))
        if (k == moment .or. any(k == axes_of(self%of_links))) call add_harmonics(harmonics, column, units(k), &
          & forces(i)%statistics(k)%series(1), last)
      end do
    end do
    shares = sources_table(forces, sources, ground)
    call histories%convert(result%units)
    call harmonics%convert(result%units)
    call shares%convert(result%units)
    call result%add(table)
    call result%add(histories)
    call result%add(harmonics)
    call result%add(shares)
    if (context%is_presented()) then
      call result%add_figure(plot_loads(table, histories, forces, ground))
      call result%add_figure(plot_histories(histories, forces, frame, ground))
      call result%add_figure(plot_orders(harmonics, forces, axes_of(self%of_links), frame%mechanism%turns))
      call result%add_figure(plot_sources(shares, forces, sources))
    end if
    if (context%reports) call result%write_section("JOINT FORCES " // ground, joint_lines(forces, sources, frame, &
      & axes_of(self%of_links)))
  end subroutine report_forces

  !> The table joints.csv, which has one row for each place at which a force acts on a body.
  pure type(table_type) function summary(self, forces, frame, ground) result(table)
    class(joints_task), intent(in) :: self
    type(joint_force_type), intent(in) :: forces(:)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: ground
    integer :: axes(2), columns(4), i, k, n
    character(len=:), allocatable :: name

    n = size(forces)
    axes = axes_of(self%of_links)
    columns = [magnitude, axes, moment]
    table = new_table("joints", "Joint forces", "Force on each body at its joints, of the machine " // ground // ".", shown=.true.)
    call table%add("joint", "joint at which the force acts", (forces%place%joint))
    call table%add("on", "body on which the force acts", (forces%place%body))
    call table%add("from", "body that exerts the force; pin: several bodies on the pin of the joint", (forces%place%other))
    call table%add("pair", "pin, guide, slot (of a lever or yoke), cam or drive", pair_words(forces%place%kind))
    do i = 1, size(columns)
      k = columns(i)
      name = trim(component_names(k))
      if (k == moment .and. .not. any(forces%has_moment)) cycle
      call table%add(name // "_peak", units(k), "largest absolute value over the period", (forces%statistics(k)%peak), &
        & bounds=(forces%statistics(k)%peak_error))
      call table%add(name // "_rms", units(k), "root mean square over the period", (forces%statistics(k)%rms))
      call table%add(name // "_peak_crank", degree, "crank angle at which the peak occurs", &
        & frame%degrees_per_period() * forces%statistics(k)%peak_phase)
    end do
    call add_order_column(table, "f_strongest_order", "order of the crank speed with the largest amplitude", &
      & [(forces(i)%statistics(magnitude)%strongest(), i = 1, n)], frame%mechanism%turns)
    call table%mark_details([character(len=15) :: "peak_crank", "strongest_order"])
  end function summary

  !> The table joints_sources.csv, which has one row for each cause of the force at each place.
  pure type(table_type) function sources_table(forces, sources, ground) result(table)
    type(joint_force_type), intent(in) :: forces(:)
    type(source_type), intent(in) :: sources(:)
    character(len=*), intent(in) :: ground
    character(len=word_length), dimension(size(sources) * size(forces)) :: joints, bodies
    character(len=len(sources%name)) :: names(size(joints))
    character(len=5) :: pairs(size(joints))
    real(dp), dimension(size(joints)) :: peak, at_peak
    integer :: i, k, n

    n = 0
    do k = 1, size(forces)
      do i = 1, size(sources)
        n = n + 1
        joints(n) = forces(k)%place%joint
        bodies(n) = forces(k)%place%body
        pairs(n) = pair_words(forces(k)%place%kind)
        names(n) = sources(i)%name
        peak(n) = sources(i)%peak(k)
        at_peak(n) = sources(i)%at_peak(k)
      end do
    end do
    table = new_table("joints_sources", "Causes of the joint forces", "Parts of the joint forces of the machine " // ground &
      & // " that inertia, weights, loads and the motion of the frame cause.")
    call table%add("joint", "joint at which the force acts", joints)
    call table%add("on", "body on which the force acts", bodies)
    call table%add("pair", "pin, guide, slot (of a lever or yoke), cam or drive", pairs)
    call table%add("cause", "inertia: of the links on a frame at rest; weights; name of a load; motion of the frame", names)
    call table%add("peak", newton, "maximum over the period of the magnitude of this part", peak)
    call table%add("at_peak", newton, "component of this part along the joint force when the joint force has its peak", at_peak)
  end function sources_table

end module gestell_task_joints
