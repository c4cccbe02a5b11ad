!> The task `response`: the periodic vibration of the frame.
module gestell_task_response
  use gestell_base_error, only: error_type
  use gestell_model_frame, only: frame_type
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_harmonics, add_orders, add_turn
  use gestell_study_vibration, only: vibration_type
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_response_names, only: name_type, names_of
  use gestell_task_response_plot, only: plot_harmonics, plot_response
  use gestell_task_response_report, only: closing_lines, vibration_lines
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  type, extends(task_type), public :: response_task
  contains
    procedure :: describe
    procedure :: read => read_response
    procedure :: run
  end type response_task

contains

  pure subroutine describe(self)
    class(response_task), intent(inout) :: self

    self%name = "response"
    self%tables = [character(len=longest_table) :: "response", "harmonics"]
    self%judges = .true.
    self%brief = .true.
  end subroutine describe

  subroutine read_response(self, configuration, error)
    class(response_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    configuration%analysis%response = self%ordered
  end subroutine read_response

  subroutine run(self, context, result, error)
    class(response_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: peaks(context%configuration%frame%dofs())
    type(name_type) :: names(3 * size(peaks))
    integer :: k

    associate (frame => context%configuration%frame, tasks => context%configuration%analysis, unused => self)
      peaks = ieee_value(peaks, ieee_quiet_nan)
      if (allocated(context%analysis%vibration)) then
        peaks = context%analysis%vibration%peak(:size(peaks))
        call result%add(history(frame, context%analysis%vibration, result%verdict), plot_response(frame, &
          & context%analysis%vibration))
        call result%add(harmonics(frame, tasks%harmonics, context%analysis%vibration, result%verdict), plot_harmonics(frame, &
          & tasks%harmonics, &
          & context%analysis%vibration))
        call result%say(vibration_lines(context%analysis%vibration, frame, trim(result%verdict)))
        call result%detail(closing_lines(context%analysis%vibration, frame%mechanism%turns, tasks%averaged))
      end if
      names = names_of(frame%dofs())
      do k = 1, size(peaks)
        call result%brief%add(trim(names(k)%column) // "_peak", names(k)%unit, "peak of the vibration", peaks(k:k))
      end do
    end associate
  end subroutine run

  !> response.csv.
  pure type(table_type) function history(frame, vibration, verdict) result(table)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    character(len=*), intent(in) :: verdict
    type(name_type) :: names(3 * frame%dofs())
    integer :: k

    names = names_of(frame%dofs())
    table = new_table("response", "Vibration over " // turns_in_words(frame%mechanism%turns), &
      & "Displacements of the frame and forces on the ground.", verdict)
    call add_turn(table, frame%speed, frame%period, size(vibration%history, 2) - 1, &
      & frame%mechanism%turns)
    do k = 1, size(names)
      call table%add(trim(names(k)%column), names(k)%unit, trim(names(k)%meaning), vibration%history(k, :))
    end do
  end function history

  !> harmonics.csv.
  pure type(table_type) function harmonics(frame, last, vibration, verdict) result(table)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: last
    type(vibration_type), intent(in) :: vibration
    character(len=*), intent(in) :: verdict
    type(name_type) :: names(3 * frame%dofs())
    integer :: k

    names = names_of(frame%dofs())
    table = new_table("harmonics", "Spectrum", "Amplitudes by orders of the crank.", verdict)
    call add_orders(table, frame%period, last, frame%mechanism%turns)
    do k = 1, size(names)
      call add_harmonics(table, trim(names(k)%column), names(k)%unit, vibration%series(k), last)
    end do
  end function harmonics

end module gestell_task_response
