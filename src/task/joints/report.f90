!> Writes the report of the task `joints`.
module gestell_task_joints_report
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, fixed, newline
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_pairs, only: pin
  use gestell_model_pairs_forces, only: moment
  use gestell_model_quantity_joint_quantities, only: pair_words
  use gestell_output_report_significance, only: zero_if_noise
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_task_joints_forces, only: component_names, joint_force_type, magnitude, shown_forces, source_type
  implicit none (type, external)
  private

  public :: joint_lines

contains

  !> Table of all joint forces, and the causes of the largest one.
  pure function joint_lines(forces, sources, frame, axes) result(lines)
    type(joint_force_type), intent(in) :: forces(:)
    type(source_type), intent(in) :: sources(:)
    class(frame_type), intent(in) :: frame
    !> The two components to report (gestell_model_pairs_forces)
    integer, intent(in) :: axes(2)
    character(len=:), allocatable :: lines
    real(dp), parameter :: rounding = 1.0e-14_dp
    real(dp) :: greatest
    integer :: i, k, most

    lines = ""
    greatest = maxval([(forces(i)%statistics(magnitude)%peak, i = 1, size(forces))])
    do i = 1, size(forces)
      if (.not. shown_forces(forces(i))) cycle
      associate (force => forces(i), whole => forces(i)%statistics(magnitude))
        lines = lines // trim(force%place%joint) // ": " // trim(force%place%other) // " on " // trim(force%place%body)
        if (force%place%kind /= pin) lines = lines // " (" // trim(pair_words(force%place%kind)) // ")"
        do k = 1, 2
          associate (part => force%statistics(axes(k)))
            ! the direction of a guide is rounded
            lines = lines // tab // concise(merge(part%peak, 0.0_dp, part%peak > rounding * greatest) &
              & * zero_if_noise(part%peak, part%peak_error, greatest), 5)
          end associate
        end do
        lines = lines // tab // concise(whole%peak, 5) // tab // concise(whole%peak_error, 1) // tab &
          & // fixed(frame%degrees_per_period() * whole%peak_phase, 1) // tab
        if (force%has_moment) lines = lines // concise(force%statistics(moment)%peak, 5)
        lines = lines // newline
      end associate
    end do
    lines = tabulated("lrrrrrr", "," // trim(component_names(axes(1))) // " peak," // trim(component_names(axes(2))) &
      & // " peak,f peak,error,at,m peak" // newline // ",N,N,N,N,deg,N m", lines)
    most = maxloc([(forces(i)%statistics(magnitude)%peak, i = 1, size(forces))], dim=1)
    associate (force => forces(most))
      lines = lines // "  largest force: " // concise(force%statistics(magnitude)%peak, 5) // " N at joint " &
        & // trim(force%place%joint) // "; at its peak"
    end associate
    do i = 1, size(sources)
      lines = lines // either(",", "", i > 1) // " " // trim(sources(i)%name) // " " // concise(sources(i)%at_peak(most), 4) // " N"
    end do
    lines = lines // newline
  end function joint_lines

end module gestell_task_joints_report
