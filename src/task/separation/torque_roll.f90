!> Compares the modes with the rotation of the machine about its torque-roll axis.
module gestell_task_separation_torque_roll
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: either, fixed, newline, text
  use gestell_base_verdict, only: unjudged
  use gestell_model_frame, only: frame_type
  use gestell_model_space, only: in_frame, in_space
  use gestell_model_space_torque_roll, only: find_torque_roll, torque_roll_type
  use gestell_output_report_text_table, only: listed
  use gestell_output_report_wrapping, only: wrapped
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: degree, metre, plain
  use gestell_study_mode, only: assurance
  use gestell_task_campbell, only: campbell_type
  use gestell_task_separation, only: is_decoupled, separation_type
  implicit none (type, external)
  private

  public :: axis_line, axis_table, share_torque_roll, torque_roll_line

contains

  !> Computes the share of the rotation about the torque-roll axis in each mode. The share is the modal assurance criterion of the
  !> mode and this rotation. Does nothing unless all six degrees of freedom are free.
  subroutine share_torque_roll(frame, campbell, separations)
    class(frame_type), intent(in) :: frame
    type(campbell_type), intent(in) :: campbell
    type(separation_type), intent(inout) :: separations(:)
    type(torque_roll_type) :: roll
    complex(dp) :: shape(6)
    integer :: solved, i

    solved = findloc(campbell%points%solved, .true., dim=1)
    if (solved == 0 .or. size(campbell%free) < 6) return
    associate (mass => campbell%points(solved)%mass)
      call find_torque_roll(mass(in_frame, in_frame), frame%shaft_axes(:, 3), roll)
      if (.not. roll%known) return
      do i = 1, size(separations)
        if (.not. separations(i)%at%identified) cycle
        shape = separations(i)%at%shape()
        separations(i)%torque_roll = assurance(shape, cmplx(roll%motion(in_space), 0, dp), mass)
      end do
    end associate
  end subroutine share_torque_roll

  !> Line that lists the modes that contain rotation about the torque-roll axis; empty if no share was computed.
  pure function torque_roll_line(modes) result(line)
    type(separation_type), intent(in) :: modes(:)
    character(len=:), allocatable :: line
    !> A mode is not listed if the share of the rotation is smaller than this
    real(dp), parameter :: least = 0.05_dp
    integer :: i, most

    line = ""
    if (.not. any(modes%torque_roll >= 0)) return
    do i = 1, size(modes)
      if (modes(i)%torque_roll >= least) line = line // ", " // fixed(100 * modes(i)%torque_roll, 0) // " % in mode " &
        & // text(modes(i)%mode)
    end do
    most = maxloc(modes%torque_roll, dim=1, mask=modes%torque_roll >= 0)
    line = wrapped("  motion about the torque-roll axis: " // line(3:) // either("; decoupled", "; coupled", &
      & is_decoupled(modes(most)%torque_roll)) // newline)
  end function torque_roll_line

  !> Line on the torque-roll axis of a frame in space, for `--check`; empty if the axis is unknown.
  function axis_line(frame) result(line)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: line
    type(torque_roll_type) :: roll

    call find_axis(frame, roll)
    line = ""
    if (.not. roll%known) return
    line = newline // wrapped("TORQUE-ROLL AXIS of the unsupported machine: direction (" // listed(clean(roll%axis), 4, ", ") &
      & // "), " // fixed(roll%angle * 180 / pi, 2) // " deg from the shaft, through the centre of mass at (" &
      & // listed(clean(roll%center), 4, ", ") // ") m" // newline)
  end function axis_line

  !> The table torque_roll.csv, which has one row for the axis. It has no row if the axis is unknown.
  type(table_type) function axis_table(frame) result(table)
    class(frame_type), intent(in) :: frame
    character(len=*), parameter :: names(3) = ["x", "y", "z"]
    type(torque_roll_type) :: roll
    integer :: i, rows

    call find_axis(frame, roll)
    rows = merge(1, 0, roll%known)
    table = new_table("torque_roll", "Torque-roll axis", "Axis about which the unsupported machine starts to rotate if a " // &
      &   "torque acts about the shaft.", unjudged)
    do i = 1, 3
      call table%add("axis_" // names(i), plain, "direction of the axis", spread(roll%axis(i), 1, rows))
    end do
    do i = 1, 3
      call table%add("center_" // names(i), metre, "position of the centre of mass relative to F; the axis passes through " // &
        &   "this point", spread(roll%center(i), 1, rows))
    end do
    call table%add("angle", degree, "angle between the axis and the shaft", spread(roll%angle * 180 / pi, 1, rows))
  end function axis_table

  !> Finds the torque-roll axis of a frame in space, with the moving masses averaged over the period.
  subroutine find_axis(frame, roll)
    class(frame_type), intent(in) :: frame
    type(torque_roll_type), intent(out) :: roll
    real(dp), allocatable, dimension(:, :) :: mass, gyroscopic, stiffness
    integer :: i

    call frame%mean_matrices([(i, i = 1, 6)], mass, gyroscopic, stiffness)
    call find_torque_roll(mass(in_frame, in_frame), frame%shaft_axes(:, 3), roll)
  end subroutine find_axis

  !> The value, or 0 if the value is smaller than 1e-12, because it is then rounding error (the values are about 1).
  elemental real(dp) function clean(value)
    real(dp), intent(in) :: value

    clean = merge(0.0_dp, value, abs(value) < 1.0e-12_dp)
  end function clean

end module gestell_task_separation_torque_roll
