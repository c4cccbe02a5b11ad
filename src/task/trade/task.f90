!> The task `trade`: measures computing time against accuracy for the machine of the input.
module gestell_task_trade_task
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: exact, newline
  use gestell_base_verdict, only: unjudged
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: plain, unit_type
  use gestell_study_frame_model, only: frame_models
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_context, only: context_type
  use gestell_task_trade, only: measure_trade, trade_row_type, trade_type
  use gestell_task_trade_model_trade, only: measure_frame_models, measure_model, model_finding_type, model_trade_type
  use gestell_task_trade_plot, only: plot_trade
  use gestell_task_trade_report, only: report_frame_models, report_model, report_trade
  implicit none (type, external)
  private

  type, extends(task_type), public :: trade_task
  contains
    procedure :: describe, run
  end type trade_task

  !> Approximate computing time for all measurements together (s)
  real(dp), parameter :: budget = 10

contains

  pure subroutine describe(self)
    class(trade_task), intent(inout) :: self

    self%name = "trade"
    self%meaning = "accuracy and computing time that each integration method reaches for this machine"
    self%tables = [character(len=longest_table) :: "trade"]
  end subroutine describe

  !> Measures integration methods and models, and adds table, picture and report to `result`.
  subroutine run(self, context, result, error)
    class(trade_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(trade_type) :: trade
    type(model_trade_type) :: model
    type(model_finding_type) :: models(size(frame_models))
    type(trade_row_type), allocatable :: rows(:)
    type(table_type) :: table

    associate (configuration => context%configuration, unused => self)
      call measure_trade(context%analysis%frame, budget, trade, error, context%executor)
      if (.not. allocated(error)) call measure_model(configuration%frame, configuration%accuracy, model, error)
      if (allocated(error)) return
      ! The averaged model, if it has a periodic vibration, becomes the last row.
      rows = trade%rows
      if (.not. allocated(model%resonance)) rows = [rows, trade_row_type("averaged", 0, 0, model%evaluations, model%error_phi, &
        & model%error_rho, model%error_x0, model%averaged%seconds)]
      table = new_table("trade", "Speed against accuracy", "Errors and computing time of each method.", unjudged, shown=.true.)
      table%remarks = "errors of the converged solution: phi " // exact(trade%floor_phi) // " rho " // exact(trade%floor_rho) &
        & // " x0 " // exact(trade%floor_x0) // newline
      call table%add("method", "method, as in &accuracy; averaged is the model with averaged coefficients", (rows%method))
      call table%add("order", "order of convergence", (rows%order))
      call table%add("steps", "steps per period", (rows%steps))
      call table%add("evaluations", "number of evaluations of the coefficients per period", (rows%evaluations))
      call table%add("error_phi", plain, "error of Phi(T) relative to its norm", (rows%error_phi))
      call table%add("error_rho", plain, "largest relative error of a multiplier", (rows%error_rho))
      call table%add("error_x0", plain, "error of the initial state x0 of the vibration relative to its norm", (rows%error_x0))
      call table%add("seconds", unit_type(words="s"), "median time of one solution", (rows%seconds))
      call result%add(table)
      if (context%is_presented()) call result%add_figure(plot_trade(trade, .not. allocated(model%resonance)))
      if (.not. context%reports) return
      call measure_frame_models(configuration%frame, configuration%accuracy, models)
      call result%write_lines(report_trade(trade) // report_model(model, configuration%turns()) // report_frame_models(models))
    end associate
  end subroutine run

end module gestell_task_trade_task
