!> The task `stability`: computes the multipliers of the vibration and the verdict on its stability.
module gestell_task_stability
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: judgement_type
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: plain, radian, unit_type
  use gestell_study_vibration_analysis, only: find_modes
  use gestell_task_common_task, only: longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_stability_plot, only: plot_multipliers
  use gestell_task_stability_report, only: multiplier_lines
  implicit none (type, external)
  private

  type, extends(task_type), public :: stability_task
  contains
    procedure :: describe, read => read_stability, run
  end type stability_task

contains

  pure subroutine describe(self)
    class(stability_task), intent(inout) :: self

    self%name = "stability"
    self%meaning = "multipliers of the vibration and the verdict on its stability"
    self%tables = [character(len=longest_table) :: "multipliers"]
    self%gives_verdict = .true.
    self%brief = .true.
  end subroutine describe

  !> If the task is requested, includes the multipliers in the results to compute.
  subroutine read_stability(self, configuration, error)
    class(stability_task), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    configuration%analysis%stability = configuration%analysis%stability .or. self%requested
  end subroutine read_stability

  !> Adds the table, picture and report of the multipliers to `result`.
  subroutine run(self, context, result, error)
    class(stability_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    integer :: i

    associate (multipliers => context%analysis%multipliers, frame => context%configuration%frame, unused => self)
      table = new_table("multipliers", "Stability", "Multipliers in the complex plane; disturbances decay if all lie inside " &
        & // "the unit circle.", judgement_type(multipliers%judge()), shown=.true.)
      call table%add("index", "number of the multiplier; number 1 has the largest modulus", [(i, i = 1, size(multipliers%rho))])
      call table%add("re", plain, "real part of rho", real(multipliers%rho))
      call table%add("im", plain, "imaginary part of rho", aimag(multipliers%rho))
      call table%add("abs", plain, "modulus |rho|", abs(multipliers%rho), error="error")
      call table%add("log_abs", plain, "ln |rho|", multipliers%log_abs)
      call table%add("arg", radian, "argument of rho in (-pi, pi]", multipliers%arg)
      call table%add("exponent_re", unit_type("per_s", "1/s"), "real part of the characteristic exponent ln(rho) / T", &
        & real(multipliers%exponent))
      call table%add("exponent_im", unit_type("rad_per_s", "rad/s"), "imaginary part of the exponent, determined only up to " &
        & // "multiples of 2 pi / T", aimag(multipliers%exponent))
      call table%add("error", plain, "bound on the error of rho, relative to |rho|", multipliers%error)
      call table%add("lost", "1 if the error is 1 or more, so that no digit of rho is reliable; otherwise 0", multipliers%lost())
      call table%mark_details(["log_abs", "arg    "])
      call result%add(table)
      if (context%is_presented()) then
        call find_modes(frame, context%configuration%analysis%averaged, context%configuration%accuracy, context%analysis)
        call result%add_figure(plot_multipliers(frame, multipliers, context%analysis%modes))
      end if
      call result%brief%add("rho_max", plain, "modulus of the largest multiplier", [abs(multipliers%rho(1))])
      call result%brief%add("log_rho_max", plain, "natural logarithm of rho_max", [multipliers%log_abs(1)])
      call result%brief%add("rho_error", plain, "bound on the relative error of rho_max", [multipliers%error(1)])
      call result%brief%add("verdict", "verdict on the machine", [multipliers%verdict()])
      if (.not. context%reports) return
      call result%write_lines(multiplier_lines(multipliers, context%analysis%modes, abs(frame%speed), frame%mechanism%turns))
    end associate
  end subroutine run

end module gestell_task_stability
