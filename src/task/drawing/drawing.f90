!> The task `drawing`: writes the motion of the mechanism as a table and a picture, and the tables that --check reports.
module gestell_task_drawing
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: unjudged
  use gestell_input_namelist_document, only: group_named
  use gestell_input_namelist_message, only: input_error
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_frame_shaking, only: shaking_in_space, space_shaking_type
  use gestell_model_pairs_rows, only: mechanism_angles
  use gestell_model_quantity_rows, only: probe_type
  use gestell_model_linkage_diagnosis, only: diagnose_joints, diagnosis_type
  use gestell_model_linkage_diagram, only: diagram_type, trace_diagram
  use gestell_model_mechanism, only: mechanism_type
  use gestell_model_mechanism_shaking, only: shaking, shaking_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_picture_scene, only: scene_type
  use gestell_output_result, only: result_type
  use gestell_study_vibration_analysis, only: analyse, analysis_options, analysis_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: degree, metre, metre_per_s, metre_per_s2
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_drawing_balance_table, only: tabulate_plane, tabulate_space
  use gestell_task_drawing_elements, only: axes
  use gestell_task_drawing_frequencies, only: tabulate_frequencies
  use gestell_task_drawing_placed, only: place_in_space, placed_type
  use gestell_task_drawing_plot, only: plot_mechanism
  use gestell_task_drawing_scene, only: build_scene
  use gestell_task_drawing_strokes, only: stroke_table
  use gestell_task_drawing_views, only: plot_views
  implicit none (type, external)
  private

  public :: build_motion

  type, extends(task_type), public :: drawing_task
  contains
    procedure :: describe, read => read_drawing, run
  end type drawing_task

  !> Number of positions in the period. The table has one more row, which repeats the first position
  integer, parameter :: rows = 360

contains

  pure subroutine describe(self)
    class(drawing_task), intent(inout) :: self

    self%name = "drawing"
    self%meaning = "motion of joints and links over one period, with a picture; tables of frequencies, strokes and shaking forces"
    self%tables = [character(len=longest_table) :: "mechanism", "frequencies", "strokes", "balance_table", &
      & "unbalance"]
    self%drawn_with_plot = .true.
  end subroutine describe

  !> Checks that there is something to draw. Fails if the task is requested and the mechanism has no joints and links.
  subroutine read_drawing(self, configuration, error)
    class(drawing_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    if (.not. self%requested) return
    select type (mechanism => configuration%frame%mechanism)
    type is (linkage_type)
    class default
      call input_error(group_named(configuration%document, "mass_functions"), "", "the task 'drawing' needs joints and links: " &
        & // "a mechanism given by mass functions cannot be drawn", error)
    end select
  end subroutine read_drawing

  !> Adds the table of positions and the picture to `result` if the mechanism is a linkage, and the tables of --check if they are
  !> requested.
  subroutine run(self, context, result, error)
    class(drawing_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(diagram_type) :: diagram
    type(placed_type) :: placed
    type(table_type) :: table
    integer :: i, k

    associate (frame => context%configuration%frame, probes => context%configuration%probes)
      select type (mechanism => frame%mechanism)
      class is (linkage_type)
        call trace_diagram(mechanism, [(sign(2 * pi, frame%speed) * k / rows, k = 0, rows)], diagram)
        if (frame%dofs() > 3) then
          call place_in_space(frame, mechanism, diagram, placed)
          table = table_of(frame, mechanism, placed%joints, placed%centers, placed%rates)
          call result%add(table, plot_views(table, frame, mechanism, diagram, placed, probes))
        else
          do i = 1, 2
            diagram%joints(i, :, :) = diagram%joints(i, :, :) + frame%origin(i)
            diagram%centers(i, :, :) = diagram%centers(i, :, :) + frame%origin(i)
          end do
          table = table_of(frame, mechanism, diagram%joints, diagram%centers, diagram%rates)
          call result%add(table, plot_mechanism(table, frame, mechanism, diagram, probes))
        end if
      end select
      if (self%requested .or. context%describes_mechanism) call add_tables(frame, result)
      if (context%draws .and. .not. context%only_checks) call add_animation(context, self%requested, result)
    end associate
  end subroutine run

  !> Adds the animation of the machine. The frame is at rest if its vibration is not known. If the task is `requested`, the
  !> vibration is computed.
  subroutine add_animation(context, requested, result)
    type(context_type), intent(in) :: context
    logical, intent(in) :: requested
    type(result_type), intent(inout) :: result
    type(analysis_type) :: analysis
    type(analysis_options) :: options
    type(error_type), allocatable :: failure
    type(scene_type) :: scene

    if (allocated(context%analysis%vibration)) then
      analysis = context%analysis
    else if (requested) then
      options = context%configuration%analysis
      options%response = .true.
      call analyse(context%configuration%frame, options, context%configuration%accuracy, analysis, failure)
    end if
    if (.not. allocated(analysis%frame)) allocate(analysis%frame, source=context%configuration%frame)
    associate (mechanism => context%configuration%frame%mechanism)
      call build_motion(analysis, mechanism, context%configuration%probes, scene)
      call result%animate("mechanism", "The machine during " // turns_in_words(mechanism%turns), [scene])
    end associate
  end subroutine add_animation

  !> Builds the scene of a machine over one period.
  subroutine build_motion(analysis, mechanism, probes, scene)
    !> The frame and, if known, its vibration
    type(analysis_type), intent(in) :: analysis
    class(mechanism_type), intent(in) :: mechanism
    type(probe_type), intent(in) :: probes(:)
    type(scene_type), intent(out) :: scene
    !> Number of instants in a turn, and maximum number in a period
    integer, parameter :: in_turn = 48, most = 192
    !> Largest displacement of the frame in the picture, as a part of the machine's size
    real(dp), parameter :: visible = 0.06_dp
    real(dp), allocatable :: motion(:, :), phases(:)
    integer :: i, k, n

    n = min(in_turn * mechanism%turns, most)
    phases = [(real(k, dp) / n, k = 0, n)]
    associate (frame => analysis%frame)
      ! displacements; velocities and accelerations, which the angle of the drive does not depend on
      allocate(motion(3 * frame%dofs(), 0:n), source=0.0_dp)
      if (allocated(analysis%vibration)) then
        do i = 1, frame%dofs()
          do k = 0, n
            associate (now => analysis%vibration%series(i)%value(2 * pi * phases(k + 1)))
              motion(i, k) = now(1)
            end associate
          end do
        end do
      end if
      call build_scene(frame, mechanism, probes, mechanism_angles(frame, phases, motion), motion(:frame%dofs(), :), scene)
    end associate
    call scene%scale_motion(visible, rounded=.true.)
    scene%degrees = [(analysis%frame%degrees_per_period() * k / n, k = 0, n)]
    scene%seconds = 4 * mechanism%turns
  end subroutine build_motion

  !> Adds those tables of --check that other programs may need. A table is omitted if it cannot be computed.
  subroutine add_tables(frame, result)
    class(frame_type), intent(in) :: frame
    type(result_type), intent(inout) :: result
    type(shaking_type) :: forces
    type(space_shaking_type) :: forces_in_space
    type(diagnosis_type) :: diagnosis
    type(table_type) :: table, unbalance
    type(error_type), allocatable :: failure
    real(dp), allocatable :: frequencies(:)

    call tabulate_frequencies(frame, table, frequencies, failure)
    if (.not. allocated(failure)) call result%add(table)
    select type (mechanism => frame%mechanism)
    class is (linkage_type)
      call diagnose_joints(mechanism, diagnosis)
      if (any(diagnosis%joints%slides)) call result%add(stroke_table(frame, mechanism, diagnosis))
    end select
    if (frame%dofs() > 3) then
      call shaking_in_space(frame, forces_in_space)
      if (.not. forces_in_space%is_finite()) return
      call tabulate_space(frame, forces_in_space, table)
      call result%add(table)
    else
      call shaking(frame%mechanism, frame%speed, forces, failure, frame%uniform_in_space())
      if (.not. forces%is_finite()) return
      call tabulate_plane(frame, forces, table, unbalance)
      call result%add(table)
      call result%add(unbalance)
    end if
  end subroutine add_tables

  !> The table mechanism.csv: motion of all joints and centres of mass relative to the frame, with one row for each crank angle.
  pure type(table_type) function table_of(frame, linkage, joints, centers, rates) result(table)
    class(frame_type), intent(in) :: frame
    class(linkage_type), intent(in) :: linkage
    !> `joints`: positions of the joints (m), shape (axes, joints, rows). `centers`: positions of the centres of mass (m), shape
    !> (axes, links, rows). `rates`: their first and second derivatives with respect to the crank angle (m), shape (axes, joints +
    !> links, rows, 2). There are two or three axes
    real(dp), intent(in) :: joints(:, :, :), centers(:, :, :), rates(:, :, :, :)
    character(len=:), allocatable :: name
    integer :: i, k

    table = new_table("mechanism", "The machine", "The mechanism during " &
      & // turns_in_words(frame%mechanism%turns) // ", drawn to scale with its frame and mounts.", unjudged)
    ! the picture combines the positions with mounts and outlines in m
    table%always_si = .true.
    call table%expect(1 + 3 * size(joints, 1) * size(rates, 2))
    call table%add("crank", degree, "crank angle, negative for a clockwise crank", &
      & [(frame%degrees_per_period() * k / rows, k = 0, rows)])
    do i = 1, size(linkage%joints)
      do k = 1, size(joints, 1)
        call table%add("joint(" // linkage%joints(i)%name // ")." // axes(k), metre, "position of the joint", joints(k, i, :))
      end do
    end do
    do i = 1, size(linkage%links)
      do k = 1, size(centers, 1)
        call table%add("link(" // linkage%links(i)%name // ")." // axes(k), metre, "position of the link's centre of mass", &
          & centers(k, i, :))
      end do
    end do
    do i = 1, size(rates, 2)
      if (i <= size(linkage%joints)) then
        name = "joint(" // linkage%joints(i)%name // ")."
      else
        name = "link(" // linkage%links(i - size(linkage%joints))%name // ")."
      end if
      do k = 1, size(rates, 1)
        call table%add(name // "v" // axes(k), metre_per_s, "velocity relative to the frame", frame%speed * rates(k, i, :, 1))
      end do
      do k = 1, size(rates, 1)
        call table%add(name // "a" // axes(k), metre_per_s2, "acceleration relative to the frame", &
          & frame%speed**2 * rates(k, i, :, 2))
      end do
    end do
  end function table_of

end module gestell_task_drawing
