!> Compares models for the machine of the input. For averaged coefficients it computes the errors and the time saved. For all
!> models of the frame it lists results and computing times.
module gestell_task_trade_model_trade
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: evidence, evidence_type, floquet_type, solve_floquet
  use gestell_model_frame, only: frame_type
  use gestell_study_frame_model, only: frame_models
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_task_trade, only: clock_time, median
  use gestell_system_averaged, only: averaged_system
  implicit none (type, external)
  private

  public :: measure_frame_models, measure_model

  !> Results of the model with periodic coefficients, or of the model with averaged coefficients.
  type, public :: finding_type
    character(len=9) :: verdict = ""
    !> Natural logarithm of the largest modulus of a multiplier, and its error bound
    real(dp) :: log_rho = 0, log_rho_error = 0
    !> Peaks of the vibration and their error bounds, for the quantities in the order of `vibration_type`. Unallocated if there is
    !> no periodic vibration
    real(dp), allocatable :: peak(:), peak_error(:)
    !> Median of the computing times of one solution (s)
    real(dp) :: seconds = 0
  end type finding_type

  !> Comparison of two models of the frame, one with averaged coefficients and one with periodic coefficients.
  type, public :: model_trade_type
    !> Results with periodic coefficients, and results with averaged coefficients
    type(finding_type) :: periodic, averaged
    !> Errors that averaging causes in the monodromy matrix Phi(T), in the multipliers and in the initial state x0 of the
    !> vibration. They are defined like the errors in `trade_row_type`
    real(dp) :: error_phi = 0, error_rho = 0, error_x0 = 0
    !> Number of evaluations of the coefficients from which the averages were computed
    integer :: evaluations = 0
    !> Reason why the averaged model has no periodic vibration; unallocated if it has one
    character(len=:), allocatable :: resonance
  contains
    procedure :: peak_difference, log_rho_difference, rho_difference, worst_difference
  end type model_trade_type

  !> Results of one of the models in `frame_models`.
  type, public :: model_finding_type
    !> Name of the model, as in `frame_models`
    character(len=11) :: model = ""
    !> Verdict on the vibration; empty if the model has no result
    character(len=9) :: verdict = ""
    !> Reason why there is no verdict or no vibration
    character(len=:), allocatable :: reason
    !> Natural logarithm of the largest modulus of a multiplier
    real(dp) :: log_rho = 0
    !> Peaks of the degrees of freedom (m, rad), in the frame's order
    real(dp), allocatable :: peak(:)
    !> Median of the computing times of verdict and vibration (s)
    real(dp) :: seconds = 0
  end type model_finding_type

  !> Number of times that each solution is repeated. The median of the computing times is reported
  integer, parameter :: runs = 5

contains

  !> Solves the frame with periodic coefficients to `accuracy`, and with averaged coefficients. Fails if the solution with periodic
  !> coefficients fails, or if the averaged model has no multipliers.
  subroutine measure_model(frame, accuracy, trade, error)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(model_trade_type), intent(out) :: trade
    type(error_type), allocatable, intent(out) :: error
    type(analysis_type) :: periodic, averaged
    type(monodromy_type) :: phi, phi_averaged
    type(averaged_system) :: model
    type(error_type), allocatable :: failure
    type(evidence_type) :: found
    integer :: n, k

    call solve_model(frame, analysis_options(model="rest"), accuracy, periodic, trade%periodic, error)
    if (allocated(error)) return
    call solve_model(frame, analysis_options(averaged=.true.), accuracy, averaged, trade%averaged, failure)
    if (allocated(failure)) then
      if (.not. allocated(averaged%multipliers)) then
        call move_alloc(failure, error)
        return
      end if
      trade%resonance = failure%message
    end if
    call evidence(averaged%floquet, found)
    trade%evaluations = found%evaluations

    call frame%averaged(model)
    call solve_monodromy(frame, accuracy, .false., phi, error)
    if (.not. allocated(error)) call solve_monodromy(model, accuracy, .false., phi_averaged, error)
    if (allocated(error)) return
    n = frame%states
    associate (d => phi%scale, rho => periodic%multipliers%rho, other => averaged%multipliers%rho)
      trade%error_phi = norm2((phi_averaged%phi - phi%phi) * spread(d, 1, n) / spread(d, 2, n)) / max(phi%norm, tiny(1.0_dp))
      trade%error_rho = maxval([(minval(abs(other - rho(k))) / max(abs(rho(k)), tiny(1.0_dp)), k = 1, n)])
      if (allocated(trade%resonance)) return
      associate (x0 => periodic%vibration%start%x0, x0_averaged => averaged%vibration%start%x0)
        trade%error_x0 = norm2((x0_averaged - x0) / d) / max(norm2(x0 / d), tiny(1.0_dp))
      end associate
    end associate
  end subroutine measure_model

  !> Solves the frame with one model and measures the computing time. Fails if there is no periodic vibration, or if the
  !> multipliers cannot be computed. If only the vibration is missing, `finding` still contains the verdict.
  subroutine solve_model(frame, options, accuracy, analysis, finding, error)
    class(frame_type), intent(in) :: frame
    type(analysis_options), intent(in) :: options
    type(accuracy_type), intent(in) :: accuracy
    type(analysis_type), intent(out) :: analysis
    type(finding_type), intent(out) :: finding
    type(error_type), allocatable, intent(out) :: error
    type(averaged_system) :: model
    type(floquet_type) :: floquet
    type(error_type), allocatable :: failure
    real(dp) :: times(runs), begin
    integer :: k

    call analyse(frame, options, accuracy, analysis, error)
    if (.not. allocated(analysis%multipliers)) return
    finding%verdict = analysis%multipliers%verdict()
    finding%log_rho = analysis%multipliers%log_abs(1)
    finding%log_rho_error = analysis%multipliers%error(1)
    if (.not. allocated(error)) then
      finding%peak = analysis%vibration%peak
      finding%peak_error = analysis%vibration%peak_error
    end if
    do k = 1, runs
      begin = clock_time()
      if (options%averaged) then
        call frame%averaged(model)
        call solve_floquet(model, accuracy, .true., floquet, failure)
      else
        call solve_floquet(frame, accuracy, .true., floquet, failure)
      end if
      times(k) = clock_time() - begin
    end do
    finding%seconds = median(times)
  end subroutine solve_model

  !> Solves the frame with each of the models in `frame_models`, and measures the computing times.
  subroutine measure_frame_models(frame, accuracy, findings)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(model_finding_type), intent(out) :: findings(size(frame_models))
    type(analysis_type) :: analysis
    type(error_type), allocatable :: error
    real(dp) :: times(runs), begin
    integer :: i, k

    do i = 1, size(findings)
      findings(i)%model = frame_models(i)
      allocate(findings(i)%peak(frame%dofs()), source=0.0_dp)
      do k = 1, runs
        begin = clock_time()
        call analyse(frame, analysis_options(model=frame_models(i)), accuracy, analysis, error)
        times(k) = clock_time() - begin
      end do
      findings(i)%seconds = median(times)
      if (allocated(error)) findings(i)%reason = error%message
      if (.not. allocated(analysis%multipliers)) cycle
      findings(i)%verdict = analysis%multipliers%verdict()
      findings(i)%log_rho = analysis%multipliers%log_abs(1)
      if (allocated(analysis%vibration)) findings(i)%peak = analysis%vibration%peak(:frame%dofs())
    end do
  end subroutine measure_frame_models

  !> Relative error that averaging causes in a peak. It is 0 if the peaks of the two models agree within the sum of their error
  !> bounds, or if the averaged model has no vibration.
  pure real(dp) function peak_difference(self, quantity) result(miss)
    class(model_trade_type), intent(in) :: self
    integer, intent(in) :: quantity
    real(dp) :: difference

    miss = 0
    if (.not. allocated(self%averaged%peak)) return
    associate (p => self%periodic, a => self%averaged, i => quantity)
      difference = a%peak(i) - p%peak(i)
      if (abs(difference) > a%peak_error(i) + p%peak_error(i)) miss = difference / p%peak(i)
    end associate
  end function peak_difference

  !> Relative error that averaging causes in ln rho_max (rho_max: largest modulus of a multiplier). It is the error of the decay
  !> rate of the slowest free vibration, or of the growth rate of the fastest. Zero if the two models agree within their error
  !> bounds.
  pure real(dp) function log_rho_difference(self) result(miss)
    class(model_trade_type), intent(in) :: self
    real(dp) :: difference

    miss = 0
    associate (p => self%periodic, a => self%averaged)
      difference = a%log_rho - p%log_rho
      if (abs(difference) > a%log_rho_error + p%log_rho_error) miss = difference / abs(p%log_rho)
    end associate
  end function log_rho_difference

  !> Relative error that averaging causes in the largest modulus of a multiplier. Zero if the two models agree within their error
  !> bounds.
  pure real(dp) function rho_difference(self) result(miss)
    class(model_trade_type), intent(in) :: self

    miss = 0
    if (abs(self%log_rho_difference()) > 0) miss = exp(min(self%averaged%log_rho - self%periodic%log_rho, 700.0_dp)) - 1
  end function rho_difference

  !> Largest magnitude of the relative errors that averaging causes in the peaks and in the logarithm of the largest modulus of a
  !> multiplier.
  pure real(dp) function worst_difference(self) result(miss)
    class(model_trade_type), intent(in) :: self
    integer :: i, n

    n = 0
    if (allocated(self%averaged%peak)) n = size(self%averaged%peak)
    miss = maxval(abs([self%log_rho_difference(), (self%peak_difference(i), i = 1, n)]))
  end function worst_difference

end module gestell_task_trade_model_trade
