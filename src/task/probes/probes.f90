!> What the task `response` tells of points of the frame: their vibration against its limits.
module gestell_task_probes
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: accelerations
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_harmonics, add_orders, add_turn
  use gestell_output_table_unit, only: hertz, metre, metre_per_s, metre_per_s2, mm_per_s, unit_type
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_probes_plot, only: plot_probes
  use gestell_task_probes_report, only: limit_sentence, probe_lines
  use gestell_task_probes_response, only: find_responses, probe_response_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  type, extends(task_type), public :: probes_task
  contains
    procedure :: describe
    procedure :: read => read_probes
    procedure :: run
  end type probes_task

  !> Of displacement, velocity, acceleration.
  type(unit_type), parameter :: units(3) = [metre, metre_per_s, metre_per_s2]
  real(dp), parameter :: mm = 1000

contains

  pure subroutine describe(self)
    class(probes_task), intent(inout) :: self

    self%name = "response"
    self%tables = [character(len=longest_table) :: "probes", "probes_history", "probes_harmonics"]
    self%judges = .true.
    self%brief = .true.
  end subroutine describe

  subroutine read_probes(self, configuration, error)
    class(probes_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    self%ordered = self%ordered .and. size(configuration%probes) > 0
    if (self%ordered) configuration%analysis%rows = max(configuration%analysis%rows, accelerations)
  end subroutine read_probes

  subroutine run(self, context, result, error)
    class(probes_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(probe_response_type), allocatable :: responses(:)
    type(error_type), allocatable :: failure
    real(dp) :: velocity
    integer :: i

    associate (frame => context%configuration%frame, probes => context%configuration%probes, &
      & tasks => context%configuration%analysis, unused => self)
      if (allocated(context%analysis%vibration)) call find_responses(context%analysis%frame, context%analysis%vibration, probes, &
        & responses, failure, context%executor)
      if (allocated(responses)) then
        if (.not. all([(finite(responses(i)), i = 1, size(responses))])) then
          deallocate(responses)
          call fatal_error(failure, "the motion of probes overflows: it lies beyond what double precision holds", &
            & failed_computation)
        end if
      end if
      call result%brief%expect(size(probes))
      do i = 1, size(probes)
        velocity = ieee_value(velocity, ieee_quiet_nan)
        if (allocated(responses)) velocity = mm * responses(i)%greatest
        call result%brief%add("probe(" // trim(probes(i)%name) // ").v_band", mm_per_s, "rms in its band", [velocity])
      end do
      call result%fail(failure)
      if (.not. allocated(responses)) return
      call result%add(summary(responses, result%verdict))
      call result%add(histories(responses, frame, result%verdict))
      call result%add(harmonics(responses, frame, tasks%harmonics, result%verdict))
      call result%draw(plot_probes(responses, frame%speed, tasks%harmonics, frame%mechanism%turns))
      call result%say(probe_lines(responses, frame%period, frame%mechanism%turns, trim(result%verdict)))
      call warn(responses, result)
    end associate
  end subroutine run

  !> A headline for every probe that has a limit.
  pure subroutine warn(responses, result)
    type(probe_response_type), intent(in) :: responses(:)
    type(result_type), intent(inout) :: result
    character(len=9) :: state
    integer :: i

    do i = 1, size(responses)
      if (.not. responses(i)%probe%limit > 0) cycle
      state = "undecided"
      if (responses(i)%verdict() == "within" .and. result%verdict == "stable") state = "stable"
      if (responses(i)%verdict() == "above" .or. result%verdict == "unstable") state = "unstable"
      call result%warn(state, limit_sentence(responses(i), trim(result%verdict)))
    end do
  end subroutine warn

  pure logical function finite(response)
    type(probe_response_type), intent(in) :: response

    finite = all(response%statistics%finite()) .and. all(ieee_is_finite(response%history)) .and. ieee_is_finite(response%greatest) &
      & .and. ieee_is_finite(response%error)
  end function finite

  !> probes.csv, one row a probe.
  pure type(table_type) function summary(responses, verdict) result(table)
    type(probe_response_type), intent(in) :: responses(:)
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: part
    type(unit_type) :: unit
    integer :: i, k, n, parts

    n = size(responses)
    table = new_table("probes", "Probes", "Vibration at the probes.", verdict, shown=.true.)
    call table%add("name", "of the probe", [(responses(i)%probe%name, i = 1, n)])
    call table%add("x", metre, "where it is in the frame's system", [(responses(i)%probe%position(1), i = 1, n)])
    call table%add("y", metre, "where it is in the frame's system", [(responses(i)%probe%position(2), i = 1, n)])
    if (size(responses(1)%parts) > 9) call table%add("z", metre, "where it is in the frame's system", &
      & [(responses(i)%probe%z, i = 1, n)])
    parts = size(responses(1)%parts)
    do k = 1, parts
      part = trim(responses(1)%parts(k))
      unit = units(1 + 3 * (k - 1) / parts)
      call table%add(part // "_peak", unit, "greatest size over the period", [(responses(i)%statistics(k)%peak, i = 1, n)], &
        & error=part // "_peak_error")
      call table%add(part // "_peak_error", unit, "bound on its error", [(responses(i)%statistics(k)%peak_error, i = 1, n)])
      call table%add(part // "_rms", unit, "root mean square", [(responses(i)%statistics(k)%rms, i = 1, n)])
    end do
    call table%add("vx_rms_band", mm_per_s, "velocity along x, orders within the band", [(mm * responses(i)%band(1), i = 1, n)])
    call table%add("vy_rms_band", mm_per_s, "velocity along y, orders within the band", [(mm * responses(i)%band(2), i = 1, n)])
    if (parts > 9) call table%add("vz_rms_band", mm_per_s, "velocity along z, orders within the band", &
      & [(mm * responses(i)%band(3), i = 1, n)])
    call table%add("v_rms_band", mm_per_s, "the same in the direction in which it is greatest", mm * responses%greatest, &
      & error="v_rms_band_error")
    call table%add("v_rms_band_error", mm_per_s, "bound on its error", mm * responses%error)
    call table%add("band_from", hertz, "as ordered", [(responses(i)%probe%band(1), i = 1, n)])
    call table%add("band_to", hertz, "as ordered", [(responses(i)%probe%band(2), i = 1, n)])
    call table%add("limit", mm_per_s, "as ordered; NaN: none", [(limit(responses(i)), i = 1, n)])
    call table%add("verdict", "against the limit; empty without one", [(responses(i)%verdict(), i = 1, n)])
  end function summary

  !> In mm/s; NaN: there is none.
  pure real(dp) function limit(response)
    type(probe_response_type), intent(in) :: response

    limit = ieee_value(limit, ieee_quiet_nan)
    if (response%probe%limit > 0) limit = mm * response%probe%limit
  end function limit

  pure type(table_type) function histories(responses, frame, verdict) result(table)
    type(probe_response_type), intent(in) :: responses(:)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: verdict
    integer :: i, k

    table = new_table("probes_history", "Probes over " // turns_in_words(frame%mechanism%turns), &
      & "Displacement, velocity and acceleration at the probes over " // turns_in_words(frame%mechanism%turns) // ".", verdict)
    call add_turn(table, frame%speed, frame%period, size(responses(1)%history, 1) - 1, frame%mechanism%turns)
    call table%expect(sum([(size(responses(i)%parts), i = 1, size(responses))]))
    do i = 1, size(responses)
      do k = 1, size(responses(i)%parts)
        call table%add(column(responses(i), k), units(1 + 3 * (k - 1) / size(responses(i)%parts)), "motion of the probe", &
          & responses(i)%history(:, k))
      end do
    end do
  end function histories

  !> The components along the axes.
  pure type(table_type) function harmonics(responses, frame, last, verdict) result(table)
    type(probe_response_type), intent(in) :: responses(:)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: last
    character(len=*), intent(in) :: verdict
    integer :: i, k, kinds

    table = new_table("probes_harmonics", "Probes by orders", "Amplitudes of the velocity at the probes by orders of the crank.", &
      & verdict)
    call add_orders(table, frame%period, last, frame%mechanism%turns)
    ! Amplitude and phase of all parts but one on each axis.
    call table%expect(sum([(2 * (size(responses(i)%parts) - 3), i = 1, size(responses))]))
    do i = 1, size(responses)
      kinds = size(responses(i)%parts) / 3
      do k = 1, 3 * kinds
        if (mod(k, kinds) > 0) call add_harmonics(table, column(responses(i), k), units(1 + (k - 1) / kinds), &
          & responses(i)%statistics(k)%series(1), last)
      end do
    end do
  end function harmonics

  !> As vx_NAME.
  pure function column(response, part) result(name)
    type(probe_response_type), intent(in) :: response
    integer, intent(in) :: part
    character(len=:), allocatable :: name

    name = trim(response%parts(part)) // "_" // trim(response%probe%name)
  end function column

end module gestell_task_probes
