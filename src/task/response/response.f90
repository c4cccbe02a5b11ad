!> The task `response`: the periodic vibration of the frame.
module gestell_task_response
  use gestell_base_error, only: error_type
  use gestell_model_frame, only: frame_type
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_turn, only: add_harmonics, add_orders, add_turn
  use gestell_output_table_unit, only: metre, metre_per_s, newton, newton_metre, radian, radian_per_s, unit_type
  use gestell_study_vibration, only: quantities, vibration_type
  use gestell_task, only: longest_table, task_type
  use gestell_task_configuration, only: configuration_type
  use gestell_task_context, only: context_type
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

  character(len=7), parameter :: names(quantities) = [character(len=7) :: "xi", "eta", "psi", "xi_dot", "eta_dot", "psi_dot", &
    & "fx", "fy", "m"]
  type(unit_type), parameter :: units(quantities) = [metre, metre, radian, metre_per_s, metre_per_s, radian_per_s, newton, &
    & newton, newton_metre]
  character(len=40), parameter :: meanings(quantities) = [character(len=40) :: "F from its static rest, along xi", &
    & "F from its static rest, along eta", "turn of the frame", "velocity along xi", "velocity along eta", &
    & "angular velocity of the frame", "force on the ground along x", "force on the ground along y", &
    & "moment on the ground about F at rest"]

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

    configuration%tasks%response = self%ordered
  end subroutine read_response

  subroutine run(self, context, result, error)
    class(response_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: peaks(3)
    integer :: k

    associate (frame => context%configuration%frame, tasks => context%configuration%tasks, unused => self)
      peaks = ieee_value(peaks, ieee_quiet_nan)
      if (allocated(context%analysis%vibration)) then
        peaks = context%analysis%vibration%peak(:3)
        call result%add(history(frame, context%analysis%vibration, result%verdict), plot_response(frame, &
          & context%analysis%vibration))
        call result%add(harmonics(frame, tasks%harmonics, context%analysis%vibration, result%verdict), plot_harmonics(frame, &
          & tasks%harmonics, &
          & context%analysis%vibration))
        call result%say(vibration_lines(context%analysis%vibration, frame, trim(result%verdict)))
        call result%detail(closing_lines(context%analysis%vibration, tasks%averaged))
      end if
      do k = 1, size(peaks)
        call result%brief%add(trim(names(k)) // "_peak", units(k), "peak of the vibration", peaks(k:k))
      end do
    end associate
  end subroutine run

  !> response.csv.
  pure type(table_type) function history(frame, vibration, verdict) result(table)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    character(len=*), intent(in) :: verdict
    integer :: k

    table = new_table("response", "Vibration over a turn", "Displacements of the frame and forces on the ground.", verdict)
    call add_turn(table, frame%speed, frame%period, size(vibration%history, 2) - 1)
    do k = 1, quantities
      call table%add(names(k), units(k), meanings(k), vibration%history(k, :))
    end do
  end function history

  !> harmonics.csv.
  pure type(table_type) function harmonics(frame, last, vibration, verdict) result(table)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: last
    type(vibration_type), intent(in) :: vibration
    character(len=*), intent(in) :: verdict
    integer :: k

    table = new_table("harmonics", "Spectrum", "Amplitudes by orders of the crank.", verdict)
    call add_orders(table, frame%period, last)
    do k = 1, quantities
      call add_harmonics(table, names(k), units(k), vibration%series(k), last)
    end do
  end function harmonics

end module gestell_task_response
