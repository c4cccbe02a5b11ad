!> The part of the task `response` that computes the vibration at the probes (points of the frame) and compares it with limits.
module gestell_task_probes
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  use gestell_base_verdict, only: operator(==), stable, undecided, unstable, verdict_type
  use gestell_model_quantity_rows, only: accelerations
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_harmonics, add_orders, add_turn
  use gestell_output_table_unit, only: hertz, metre, metre_per_s, metre_per_s2, mm_per_s, unit_type
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_probes_plot, only: plot_histories, plot_limits, plot_orbits, plot_orders
  use gestell_task_probes_report, only: limit_sentence, probe_lines
  use gestell_task_probes_response, only: find_responses, probe_response_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  !> The part of the task `response` that computes the vibration at the probes.
  type, extends(task_type), public :: probes_task
  contains
    procedure :: describe, read => read_probes, run
  end type probes_task

  !> Units of displacement, velocity and acceleration in tables
  type(unit_type), parameter :: units(3) = [metre, metre_per_s, metre_per_s2]
  character(len=*), parameter :: kinds(3) = [character(len=12) :: "displacement", "velocity", "acceleration"]
  real(dp), parameter :: mm = 1000

contains

  pure subroutine describe(self)
    class(probes_task), intent(inout) :: self

    self%name = "response"
    self%tables = [character(len=longest_table) :: "probes", "probes_history", "probes_harmonics", "probes_orbit"]
    self%gives_verdict = .true.
    self%brief = .true.
  end subroutine describe

  !> If the task is requested and the input has probes, includes the accelerations in the results to compute.
  subroutine read_probes(self, configuration, error)
    class(probes_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    self%requested = self%requested .and. size(configuration%probes) > 0
    if (self%requested) configuration%analysis%rows = max(configuration%analysis%rows, accelerations)
  end subroutine read_probes

  !> Computes the vibration at the probes, and adds tables, pictures and report to `result`.
  subroutine run(self, context, result, error)
    class(probes_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(probe_response_type), allocatable :: responses(:)
    type(table_type) :: table, histories, harmonics
    type(error_type), allocatable :: failure
    character(len=word_length), allocatable :: names(:)
    character(len=:), allocatable :: turn, column
    type(verdict_type) :: state
    real(dp) :: velocity
    integer :: axes, i, k

    associate (frame => context%configuration%frame, probes => context%configuration%probes, &
      & last => context%configuration%analysis%harmonics, unused => self)
      if (allocated(context%analysis%vibration)) call find_responses(context%analysis%frame, context%analysis%vibration, probes, &
        & responses, failure, context%executor)
      if (allocated(responses)) then
        if (.not. all([(all(responses(i)%statistics%finite()) .and. all(ieee_is_finite(responses(i)%history)) &
          & .and. ieee_is_finite(responses(i)%maximum) .and. ieee_is_finite(responses(i)%error), i = 1, size(responses))])) then
          deallocate(responses)
          call fatal_error(failure, "the motion of a probe overflows double precision", failed_computation)
        end if
      end if
      call result%brief%expect(size(probes))
      do i = 1, size(probes)
        velocity = ieee_value(velocity, ieee_quiet_nan)
        if (allocated(responses)) velocity = mm * responses(i)%maximum
        call result%brief%add("probe(" // trim(probes(i)%name) // ").v_band", mm_per_s, "rms velocity within the probe's " &
          & // "frequency band, in the direction of strongest vibration", [velocity])
      end do
      call result%record_failure(failure)
      if (.not. allocated(responses)) return
      names = [(responses(i)%probe%name, i = 1, size(responses))]
      axes = size(responses(1)%parts) / 3 - 1
      table = summary(responses)
      call table%convert(result%units)
      call result%add(table)
      turn = turns_in_words(frame%mechanism%turns)
      histories = new_table("probes_history", "Probes over " // turn, &
        & "Displacement, velocity and acceleration at the probes over " // turn // ".")
      call add_turn(histories, frame, size(responses(1)%history, 1) - 1)
      call histories%expect(3 * (axes + 1) * size(responses))
      harmonics = new_table("probes_harmonics", "Harmonics at the probes", &
        & "Amplitudes of the velocity at the probes for each order of the crank. The table also contains displacements, " &
        & // "accelerations and phases.")
      call add_orders(harmonics, frame, last)
      ! Each component along an axis has two columns, amplitude and phase. The magnitude of the vector has no columns.
      call harmonics%expect(2 * 3 * axes * size(responses))
      do i = 1, size(responses)
        do k = 1, size(responses(i)%parts)
          column = trim(responses(i)%parts(k)) // "_" // trim(names(i))
          associate (unit => units(1 + (k - 1) / (axes + 1)))
            call histories%add(column, unit, trim(kinds(1 + (k - 1) / (axes + 1))) // " of the probe", responses(i)%history(:, k))
            if (mod(k, axes + 1) > 0) call add_harmonics(harmonics, column, unit, responses(i)%statistics(k)%series(1), last)
          end associate
        end do
      end do
      call histories%convert(result%units)
      call harmonics%convert(result%units)
      call result%add(histories)
      call result%add(harmonics)
      if (.not. context%is_presented()) return
      call result%add_figure(plot_limits(table, names, axes))
      call result%add_figure(plot_histories(histories, names, axes, frame))
      call result%add_figure(plot_orbits(histories, names, axes))
      call result%add_figure(plot_orders(harmonics, names, axes, frame%mechanism%turns))
      if (context%reports) call result%write_section("VIBRATION AT PROBES, rms in the direction of strongest vibration", &
        & probe_lines(responses, frame%period, frame%mechanism%turns, result%verdict))
      do i = 1, size(responses)
        if (.not. responses(i)%probe%limit > 0) cycle
        state = undecided
        if (responses(i)%verdict() == "within" .and. result%verdict == stable) state = stable
        if (responses(i)%verdict() == "above" .or. result%verdict == unstable) state = unstable
        call result%warn(state, limit_sentence(responses(i), result%verdict))
      end do
    end associate
  end subroutine run

  !> The table probes.csv, which has one row for each probe.
  pure type(table_type) function summary(responses) result(table)
    type(probe_response_type), intent(in) :: responses(:)
    character(len=*), parameter :: axes(3) = ["x", "y", "z"]
    character(len=:), allocatable :: part
    type(unit_type) :: unit
    integer :: i, k, n, parts

    n = size(responses)
    table = new_table("probes", "Probes", "Vibration at the probes.", shown=.true.)
    call table%add("name", "name of the probe", [(responses(i)%probe%name, i = 1, n)])
    call table%add("x", metre, "coordinate of the probe in the frame's axes", [(responses(i)%probe%position(1), i = 1, n)])
    call table%add("y", metre, "coordinate of the probe in the frame's axes", [(responses(i)%probe%position(2), i = 1, n)])
    if (size(responses(1)%parts) > 9) call table%add("z", metre, "coordinate of the probe in the frame's axes", &
      & [(responses(i)%probe%z, i = 1, n)])
    parts = size(responses(1)%parts)
    do k = 1, parts
      part = trim(responses(1)%parts(k))
      unit = units(1 + 3 * (k - 1) / parts)
      call table%add(part // "_peak", unit, "maximum absolute value over the period", [(responses(i)%statistics(k)%peak, &
        & i = 1, n)], bounds=[(responses(i)%statistics(k)%peak_error, i = 1, n)])
      call table%add(part // "_rms", unit, "root mean square over the period", [(responses(i)%statistics(k)%rms, i = 1, n)])
    end do
    do k = 1, parts / 3 - 1
      call table%add("v" // axes(k) // "_rms_band", mm_per_s, "rms velocity along " // axes(k) // ", from the orders within " &
        & // "the probe's frequency band", [(mm * responses(i)%band(k), i = 1, n)])
    end do
    call table%add("v_rms_band", mm_per_s, "rms velocity in the direction of strongest vibration, from the orders within the " &
      & // "probe's frequency band", mm * responses%maximum, bounds=mm * responses%error)
    call table%add("band_from", hertz, "lowest frequency of the probe's band", [(responses(i)%probe%band(1), i = 1, n)])
    call table%add("band_to", hertz, "highest frequency of the probe's band", [(responses(i)%probe%band(2), i = 1, n)])
    call table%add("limit", mm_per_s, "limit of the rms velocity; NaN: no limit", [(merge(mm * responses(i)%probe%limit, &
      & ieee_value(1.0_dp, ieee_quiet_nan), responses(i)%probe%limit > 0), i = 1, n)])
    call table%add("verdict", "within (at most the limit), above (the limit) or undecided (the limit lies within the error " &
      & // "bound); empty without a limit", [(responses(i)%verdict(), i = 1, n)])
    call table%mark_details([character(len=5) :: axes, "v" // axes, "a" // axes, "d_rms", "a_rms"])
  end function summary

end module gestell_task_probes
