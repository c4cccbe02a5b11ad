!> One machine by all models of the frame: what each finds, and its time.
module gestell_task_trade_frame_models
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_study_frame_model, only: frame_models
  use gestell_task_trade, only: median
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: measure_frame_models

  !> What one of `frame_models` finds.
  type, public :: model_finding_type
    character(len=11) :: model = ""
    !> Empty, with the reason, where it finds nothing.
    character(len=9) :: verdict = ""
    character(len=:), allocatable :: reason
    real(dp) :: log_rho = 0
    !> Peaks of the degrees of freedom (m, rad), in the frame's order.
    real(dp), allocatable :: peak(:)
    !> Median time of verdict and vibration (s).
    real(dp) :: seconds = 0
  end type model_finding_type

  !> Solutions that the time is the median of.
  integer, parameter :: runs = 5

contains

  !> The findings in the order of `frame_models`.
  subroutine measure_frame_models(frame, accuracy, findings)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(model_finding_type), intent(out) :: findings(size(frame_models))
    type(analysis_type) :: analysis
    type(error_type), allocatable :: error
    integer(int64) :: begin, finish, rate
    real(dp) :: times(runs)
    integer :: i, k

    do i = 1, size(findings)
      findings(i)%model = frame_models(i)
      allocate(findings(i)%peak(frame%dofs()), source=0.0_dp)
      do k = 1, runs
        call system_clock(begin, rate)
        call analyse(frame, analysis_options(model=frame_models(i)), accuracy, analysis, error)
        call system_clock(finish)
        times(k) = real(finish - begin, dp) / rate
      end do
      findings(i)%seconds = median(times)
      if (allocated(error)) findings(i)%reason = error%message
      if (.not. allocated(analysis%multipliers)) cycle
      findings(i)%verdict = analysis%multipliers%verdict()
      findings(i)%log_rho = analysis%multipliers%log_abs(1)
      if (allocated(analysis%vibration)) findings(i)%peak = analysis%vibration%peak(:frame%dofs())
    end do
  end subroutine measure_frame_models

end module gestell_task_trade_frame_models
