!> The task `drawing`: computes the positions of the mechanism over the period, and writes them as a table and a picture.
module gestell_task_drawing
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: unjudged
  use gestell_input_namelist_document, only: group_named
  use gestell_input_namelist_message, only: input_error
  use gestell_model_frame, only: frame_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_diagram, only: diagram_type, trace_diagram
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: degree, metre
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_drawing_elements, only: axes
  use gestell_task_drawing_placed, only: place_in_space, placed_type
  use gestell_task_drawing_plot, only: plot_mechanism
  use gestell_task_drawing_views, only: plot_views
  implicit none (type, external)
  private

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
    self%meaning = "positions of the mechanism's joints and links over one period, as a table and a picture"
    self%tables = [character(len=longest_table) :: "mechanism"]
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

  !> Adds the table of positions and the picture to `result`. Does nothing if the mechanism is not a linkage.
  subroutine run(self, context, result, error)
    class(drawing_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(diagram_type) :: diagram
    type(placed_type) :: placed
    type(table_type) :: table
    integer :: i, k

    associate (frame => context%configuration%frame, unused => self)
      select type (mechanism => frame%mechanism)
      class is (linkage_type)
        call trace_diagram(mechanism, [(sign(2 * pi, frame%speed) * k / rows, k = 0, rows)], diagram)
        if (frame%dofs() > 3) then
          call place_in_space(frame, mechanism, diagram, placed)
          table = table_of(frame, mechanism, placed%joints, placed%centers)
          call result%add(table, plot_views(table, frame, mechanism, diagram, placed, context%configuration%probes))
          return
        end if
        do i = 1, 2
          diagram%joints(i, :, :) = diagram%joints(i, :, :) + frame%origin(i)
          diagram%centers(i, :, :) = diagram%centers(i, :, :) + frame%origin(i)
        end do
        table = table_of(frame, mechanism, diagram%joints, diagram%centers)
        call result%add(table, plot_mechanism(table, frame, mechanism, diagram, context%configuration%probes))
      end select
    end associate
  end subroutine run

  !> The table mechanism.csv: positions of all joints and centres of mass in the frame's axes, with one row for each crank angle.
  pure type(table_type) function table_of(frame, linkage, joints, centers) result(table)
    class(frame_type), intent(in) :: frame
    class(linkage_type), intent(in) :: linkage
    !> `joints`: positions of the joints (m), shape (axes, joints, rows). `centers`: positions of the centres of mass (m), shape
    !> (axes, links, rows). There are two or three axes
    real(dp), intent(in) :: joints(:, :, :), centers(:, :, :)
    integer :: i, k

    table = new_table("mechanism", "The machine", "The mechanism during " &
      & // turns_in_words(frame%mechanism%turns) // ", drawn to scale with its frame and mounts.", unjudged)
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
  end function table_of

end module gestell_task_drawing
