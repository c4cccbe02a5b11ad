!> Solves the machine of the input once for all tasks that use its vibration or its multipliers.
module gestell_task_machine
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: newline, text
  use gestell_base_verdict, only: not_judged, operator(/=), undecided
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_model_frame, only: dof_names
  use gestell_model_space, only: is_rotation
  use gestell_output_report_warnings, only: motion_warning
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, nothing, table_type
  use gestell_output_table_unit, only: metre, plain, radian, unit_type
  use gestell_study_frame_model_model_check, only: check_model
  use gestell_study_vibration_analysis, only: analyse, find_modes
  use gestell_study_vibration_free_directions, only: describe_free_directions
  use gestell_study_vibration_vibration_list, only: listed_vibration_type
  use gestell_study_vibration_small_motion, only: moved
  use gestell_output_file_result_files, only: longest_table
  use gestell_task_common_context, only: context_type
  use gestell_task_drawing_report, only: report_transmission
  use gestell_task_machine_report, only: model_warning, evidence_lines, newton_line, tolerance_note, verdict_lines, verdict_sentence
  use gestell_task_drawing_frequencies, only: report_frequencies, resonance_lines
  use gestell_task_machine_vibrations, only: mention_others, several_lines
  implicit none (type, external)
  private

  public :: add_machine_columns, solve_machine

  !> Name of the only table that this module creates
  character(len=longest_table), parameter, public :: own_table = "vibrations"

contains

  !> Solves the machine for all tasks, and reports the results that do not belong to a single task. Fails if the machine cannot be
  !> solved. If only the vibration cannot be computed, the reason is recorded in `result` instead.
  subroutine solve_machine(context, result, error)
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: activity
    !> If a mechanism needs more integration steps per turn than this, its solution takes seconds. The progress display then states
    !> the reason
    integer, parameter :: slow_steps = 10000
    logical :: takes_seconds

    associate (configuration => context%configuration, analysis => context%analysis)
      activity = "near a dead point: at least " // text(configuration%frame%least_steps) // " integration steps per turn"
      takes_seconds = configuration%frame%least_steps > slow_steps .and. allocated(context%executor)
      if (takes_seconds) call context%executor%show(activity, 0.0_dp)
      call analyse(configuration%frame, configuration%analysis, configuration%accuracy, analysis, failure)
      if (takes_seconds) call context%executor%show(activity, 1.0_dp)
      if (allocated(failure) .and. .not. (allocated(analysis%multipliers) .and. (configuration%analysis%stability &
        & .or. configuration%analysis%modes))) then
        call move_alloc(failure, error)
        return
      end if
      call result%record_failure(failure)
      if (allocated(analysis%multipliers)) then
        result%verdict = analysis%multipliers%judge()
        call result%include_verdict(result%verdict)
      end if
      if (context%reports) call report(context, result)
      if (allocated(analysis%several)) call result%add(table_of(analysis%several))
    end associate
  end subroutine solve_machine

  !> Adds those columns to the table of --one-line that belong to no single task, for example the verdict.
  subroutine add_machine_columns(context, result)
    type(context_type), intent(in) :: context
    type(result_type), intent(inout) :: result
    integer :: vibration_count

    ! a sweep has already filled the table of --one-line
    if (result%brief%name /= "") return
    vibration_count = nothing
    if (allocated(context%analysis%several)) vibration_count = size(context%analysis%several)
    associate (options => context%configuration%analysis)
      if (options%all_vibrations .and. options%judged()) call result%brief%add("vibrations", "number of periodic vibrations " &
        & // "found", [vibration_count])
    end associate
    if (result%verdict /= not_judged .and. result%brief%number_of("verdict") == 0) call result%brief%add("verdict", &
      & "verdict on the machine", [result%verdict%word()])
  end subroutine add_machine_columns

  !> Adds the verdict, the accuracy of the solution, and the natural frequencies to the report.
  subroutine report(context, result)
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(multipliers_type), allocatable :: exact
    character(len=:), allocatable :: warning

    associate (frame => context%configuration%frame, tasks => context%configuration%analysis, analysis => context%analysis, &
      & accuracy => context%configuration%accuracy)
      call result%write_lines(report_transmission(frame))
      call result%reserve_headlines()
      if (allocated(analysis%multipliers)) then
        if (tasks%model /= "exact" .and. .not. tasks%averaged) call check_model(frame, accuracy, analysis%multipliers, exact)
        call result%warn(result%verdict, verdict_sentence(analysis%multipliers, frame%period, &
          & frame%mechanism%turns, mention_others(analysis%several)))
        call result%write_lines(verdict_lines(analysis%multipliers, frame%mechanism%turns, trim(describe_free_directions(frame)), &
          & tolerance_note(analysis, accuracy) /= ""))
      end if
      call result%write_lines(model_warning(exact, trim(tasks%model)) // tolerance_note(analysis, accuracy))
      if (.not. allocated(analysis%multipliers)) call result%detail(newline)
      call result%detail(evidence_lines(analysis, accuracy) // newton_line(analysis%newton))
      call result%write_lines(several_lines(analysis%several, tasks%all_vibrations))
      if (allocated(analysis%vibration)) then
        warning = motion_warning([moved(frame, analysis%vibration%peak(:frame%dofs()))], tasks%model)
        call result%warn(undecided, warning)
        call result%write_lines(warning)
      end if
      if (allocated(analysis%resonance)) call find_modes(frame, tasks%averaged, accuracy, analysis)
      call result%write_lines(resonance_lines(analysis%resonance) // report_frequencies(frame))
    end associate
  end subroutine report

  !> The table vibrations.csv, which has one row for each periodic vibration of the machine at its speed.
  pure type(table_type) function table_of(several) result(table)
    type(listed_vibration_type), intent(in) :: several(:)
    type(unit_type) :: units(size(several(1)%peak))
    integer :: i, k, n

    n = size(several)
    units = merge(radian, metre, is_rotation([(k, k = 1, size(units))]))
    table = new_table(trim(own_table), "Vibrations at this speed", "Periodic vibrations of the machine, in ascending order of " &
      & // "their rms amplitude.", shown=.true.)
    call table%add("index", "number of the vibration; number 1 has the smallest rms amplitude", [(i, i = 1, n)])
    call table%add("rho_max", plain, "modulus of the largest multiplier", [(abs(several(i)%multipliers%rho(1)), i = 1, n)], &
      & error="rho_error")
    call table%add("rho_error", plain, "bound on the relative error of rho_max", [(several(i)%multipliers%error(1), i = 1, n)])
    do k = 1, size(units)
      call table%add(trim(dof_names(k)) // "_rms", units(k), "root mean square over the period", [(several(i)%rms(k), i = 1, n)])
    end do
    do k = 1, size(units)
      call table%add(trim(dof_names(k)) // "_peak", units(k), "peak over the period", &
        & [(several(i)%peak(k), i = 1, n)], error=trim(dof_names(k)) // "_peak_error")
    end do
    do k = 1, size(units)
      call table%add(trim(dof_names(k)) // "_peak_error", units(k), "bound on the error of the peak", &
        & [(several(i)%peak_error(k), i = 1, n)])
    end do
    call table%add("verdict", "verdict on this vibration", [(several(i)%multipliers%verdict(), i = 1, n)])
    call table%add("turning_index", "-1 if an odd number of real multipliers exceeds 1, otherwise 1", &
      & [(several(i)%vibration_index(), i = 1, n)])
    call table%add("told", "1 for the vibration that all other files describe, otherwise 0", [(several(i)%is_reported, i = 1, n)])
  end function table_of

end module gestell_task_machine
