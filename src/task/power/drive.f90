!> Computes torque and power of the drive over the period, and compares the mean power of the drive with that of the dampers.
module gestell_task_power_drive
  use gestell_base_error, only: error_type
  use gestell_math_series_fourier, only: fourier_series, fourier_type
  use gestell_base_kinds, only: dp
  use gestell_model_quantity_driving, only: damper_watts, drive_power, drive_watts, load_watts, power_rows, rigid_torque, torque
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: accelerations, rows_of
  use gestell_task_power_flywheel, only: find_fluctuation, fluctuation_type
  use gestell_study_vibration_statistics, only: phase_of_maximum
  use gestell_study_vibration, only: check_rows, vibration_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: find_drive

  !> Peak, rms and mean of a torque over the period.
  type, public :: torque_type
    !> `peak`: the value with the largest magnitude, including its sign (N m). `peak_phase`: time of the peak as a fraction t / T
    !> of the period T. `rms`, `mean`: rms and mean over the period (N m)
    real(dp) :: peak = 0, peak_phase = 0, rms = 0, mean = 0
  end type torque_type

  !> Torque and power of the drive over the period.
  type, public :: drive_type
    !> Torques, powers and energy at the times of the vibration's history, shape (power_rows, points + 1).
    !> gestell_model_quantity_driving defines the rows
    real(dp), allocatable :: history(:, :)
    !> Torque of the drive: `actual` on the vibrating frame, `rigid` on a frame that is held at rest
    type(torque_type) :: actual, rigid
    !> Error bound of the peak torque of the drive on the vibrating frame (N m)
    real(dp) :: peak_error = 0
    !> `drive_mean`: mean power of the drive (W). `dampers_mean`: mean power that the dampers absorb (W). `loads_mean`: mean power
    !> of the loads (W). `maximum`: magnitude of the peak torque times the drive speed (W)
    real(dp) :: drive_mean = 0, dampers_mean = 0, loads_mean = 0, maximum = 0
    !> Fluctuation of the drive speed. Allocated only if the input gives the moment of inertia of a flywheel
    type(fluctuation_type), allocatable :: fluctuation
  contains
    procedure :: defect, is_finite => drive_is_finite
  end type drive_type

contains

  !> Computes torque and power of the drive. Fails if the frame's `check` fails, or if `vibration` lacks the accelerations.
  subroutine find_drive(frame, vibration, drive, known, error)
    class(frame_type), intent(in) :: frame
    !> Periodic vibration of the frame, computed with periodic (not averaged) coefficients
    type(vibration_type), intent(in) :: vibration
    type(drive_type), intent(out) :: drive
    !> False if the kinetic energy of the mechanism is not given. In this case `drive` is incomplete
    logical, intent(out) :: known
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: samples(:, :), motion(:, :)
    real(dp) :: torque_error, between
    integer :: k

    known = .false.
    call frame%check(error)
    if (.not. allocated(error)) call check_rows(vibration, accelerations, error)
    if (allocated(error)) return
    allocate(drive%history(power_rows, size(vibration%motion_history, 2)), samples(power_rows, size(vibration%motion, 2)))
    associate (points => size(drive%history, 2) - 1, n => size(samples, 2), rows => rows_of(frame%dofs(), accelerations))
      motion = vibration%motion_history(:rows, :)
      call drive_power(frame, [(real(k, dp) / points, k = 0, points)], motion, drive%history, known)
      motion = vibration%motion(:rows, :)
      call drive_power(frame, [(real(k, dp) / n, k = 0, n - 1)], motion, samples, known, vibration%motion_errors%bounds(), &
        & torque_error)
      drive%drive_mean = sum(samples(drive_watts, :)) / n
      drive%dampers_mean = sum(samples(damper_watts, :)) / n
      drive%loads_mean = sum(samples(load_watts, :)) / n
    end associate
    ! The linkage's crank angle is that of a shaft that makes one turn in the period. The drive turns faster than this shaft; its
    ! power is the same.
    drive%history([torque, rigid_torque], :) = drive%history([torque, rigid_torque], :) / frame%mechanism%turns
    samples([torque, rigid_torque], :) = samples([torque, rigid_torque], :) / frame%mechanism%turns
    torque_error = torque_error / frame%mechanism%turns
    if (known .and. frame%flywheel_inertia > 0) then
      allocate(drive%fluctuation)
      call find_fluctuation(frame, samples(torque, :), torque_error, size(drive%history, 2) - 1, drive%fluctuation)
    end if
    call compute_torque(samples(torque, :), drive%actual, between)
    drive%peak_error = torque_error + between
    call compute_torque(samples(rigid_torque, :), drive%rigid, between)
    drive%maximum = abs(drive%actual%peak * frame%speed * frame%mechanism%turns)
  end subroutine find_drive

  !> Computes peak, rms and mean of a torque from equidistant samples over the period. `between`: bound on the error of the peak
  !> due to orders that the samples do not resolve.
  subroutine compute_torque(samples, statistics, between)
    real(dp), intent(in) :: samples(:)
    type(torque_type), intent(out) :: statistics
    real(dp), intent(out) :: between
    type(fourier_type) :: series

    series = fourier_series(samples)
    statistics%peak = sign(series%peak(samples), samples(maxloc(abs(samples), dim=1)))
    statistics%peak_phase = phase_of_maximum(abs(samples))
    statistics%rms = series%rms()
    statistics%mean = series%mean
    between = series%beyond()
  end subroutine compute_torque

  !> Magnitude of the difference between the mean powers of drive and loads and that of the dampers, relative to the
  !> maximum power of the drive. Without numerical errors it would be zero.
  pure real(dp) function defect(self)
    class(drive_type), intent(in) :: self

    defect = 0
    if (self%maximum > 0) defect = abs(self%drive_mean + self%loads_mean - self%dampers_mean) / self%maximum
  end function defect

  !> True if all results for the drive are finite.
  pure logical function drive_is_finite(self) result(finite)
    class(drive_type), intent(in) :: self

    finite = all(ieee_is_finite(self%history)) .and. all(ieee_is_finite([self%actual%rms, self%rigid%rms, self%peak_error, &
      & self%drive_mean, self%dampers_mean]))
    if (allocated(self%fluctuation)) finite = finite .and. ieee_is_finite(self%fluctuation%irregularity) &
      & .and. ieee_is_finite(self%fluctuation%error)
  end function drive_is_finite

end module gestell_task_power_drive
