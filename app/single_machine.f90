!> The machine of the input itself: analysed, reported, written.
module single_machine
  use cli, only: options_type
  use console, only: console_type
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_task_configuration, only: configuration_type
  use gestell_task_findings_output, only: report_findings, write_findings
  use gestell_task_drawing_csv, only: write_mechanism
  use gestell_task_report, only: report_results
  use gestell_task_drawing_report, only: report_transmission
  use gestell_task_report_model, only: report_frame_models
  use gestell_task_response_report_probes, only: limits_told
  use gestell_task_trade_report, only: report_model, report_trade
  use gestell_task_results, only: write_results, write_trade
  use gestell_output_report_verdict, only: with_verdict
  use gestell_study_vibration_analysis, only: analyse, analysis_type
  use gestell_task_findings, only: find, findings_type
  use gestell_study_frame_model, only: frame_models
  use gestell_task_trade_frame_models, only: measure_frame_models, model_finding_type
  use gestell_study_mode_solution, only: solve_modes
  use gestell_study_mode_type, only: mode_type
  use gestell_study_frame_model_model_check, only: check_model
  use gestell_task_trade_model_trade, only: measure_model, model_trade_type
  use gestell_task_trade, only: measure_trade, trade_type
  use gestell_system_averaged, only: averaged_system
  use one_line, only: print_case
  use terminal, only: show_progress
  implicit none (type, external)
  private

  public :: run_single

  !> What the rest of a run needs to know of it.
  type, public :: single_results_type
    !> Its verdict, empty where nothing of it was asked for; whether it has a vibration.
    character(len=10) :: verdict = ""
    logical :: vibrates = .false.
    !> What is said of the probes with a limit.
    character(len=:), allocatable :: limits(:)
  end type single_results_type

  !> Seconds that measuring the trade may take, about.
  real(dp), parameter :: trade_budget = 10

contains

  !> The machine of the input itself. `failure`: what the verdict does not depend on could not be computed.
  subroutine run_single(options, configuration, folder, preamble, console, results, failure, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, preamble(:)
    type(console_type), intent(inout) :: console
    type(single_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: failure, error
    type(analysis_type) :: analysis
    type(trade_type) :: trade
    type(model_trade_type) :: model_trade
    type(model_finding_type) :: models(size(frame_models))
    type(findings_type) :: findings
    type(error_type), allocatable :: unfound
    type(mode_type), allocatable :: modes(:)
    type(multipliers_type), allocatable :: better
    real(dp), allocatable :: frequencies(:)

    call analyse(configuration%frame, configuration%tasks, configuration%accuracy, analysis, failure)
    if (allocated(failure) .and. .not. (allocated(analysis%multipliers) .and. (configuration%tasks%stability &
      & .or. configuration%tasks%modes))) then
      call move_alloc(failure, error)
      return
    end if
    if (configuration%trade) then
      call measure_trade(analysis%frame, trade_budget, trade, error, show_progress)
      if (.not. allocated(error)) call measure_model(configuration%frame, configuration%accuracy, model_trade, error)
      if (allocated(error)) return
    end if
    if (allocated(analysis%multipliers)) results%verdict = analysis%multipliers%verdict()
    results%vibrates = allocated(analysis%vibration)
    if (allocated(analysis%vibration)) call find(analysis%frame, analysis%vibration, &
      & configuration%probes(:merge(size(configuration%probes), 0, configuration%tasks%response)), configuration%forces, &
      & configuration%power, findings, unfound)
    if (allocated(unfound) .and. .not. allocated(failure)) call move_alloc(unfound, failure)
    if (allocated(findings%watched)) results%limits = limits_told(findings%watched, trim(results%verdict))
    if (options%one_line) then
      if (.not. configuration%sweep) call print_case(options%settings, configuration, analysis, findings, error)
      return
    end if
    if (.not. console%silent .or. options%report) then
      call configuration%frame%natural_frequencies(frequencies, error)
      if (allocated(error)) return
      call name_modes(configuration, analysis, modes)
      if (configuration%tasks%model /= "exact" .and. .not. configuration%tasks%averaged .and. allocated(analysis%multipliers)) then
        call check_model(configuration%frame, configuration%accuracy, analysis%multipliers, better)
      end if
      call console%say(report_transmission(configuration%frame) &
        & // report_results(configuration, analysis, frequencies, modes, better) &
        & // report_findings(findings, trim(results%verdict)))
      if (configuration%trade) then
        call measure_frame_models(configuration%frame, configuration%accuracy, models)
        call console%say(report_trade(trade) // report_model(model_trade) // report_frame_models(models))
      end if
    end if

    call write_results(folder, with_verdict(preamble, trim(results%verdict)), configuration%frame, configuration%tasks, &
      & analysis, error)
    if (allocated(error)) return
    call write_findings(folder, with_verdict(preamble, trim(results%verdict)), findings, configuration%tasks%harmonics, error)
    if (allocated(error)) return
    if (configuration%trade) call write_trade(folder, preamble, trade, model_trade, error)
    if (configuration%drawing .and. .not. allocated(error)) call write_mechanism(folder, preamble, &
      & configuration%frame, configuration%probes, error)
  end subroutine run_single

  !> The modes for the report's table of multipliers; none where it has no such table, or they cannot be told.
  subroutine name_modes(configuration, analysis, modes)
    type(configuration_type), intent(in) :: configuration
    type(analysis_type), intent(in) :: analysis
    type(mode_type), allocatable, intent(out) :: modes(:)
    type(error_type), allocatable :: none
    type(averaged_system) :: model
    real(dp), allocatable :: mass(:, :)

    if (configuration%tasks%stability .or. configuration%tasks%modes) then
      if (configuration%tasks%averaged) then
        call configuration%frame%averaged(model)
        call solve_modes(model, configuration%accuracy, modes, mass, none)
      else
        call solve_modes(analysis%frame, configuration%accuracy, modes, mass, none)
      end if
    end if
    if (.not. allocated(modes)) allocate(modes(0))
  end subroutine name_modes

end module single_machine
