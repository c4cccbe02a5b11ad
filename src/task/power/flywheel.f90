!> Computes how much the speed fluctuates if a flywheel keeps it nearly constant.
!>
!> A flywheel with the moment of inertia J_f rotates with the crank. Its angle relative to the ground is theta = phi + psi, where
!> phi is the crank angle and psi the rotation of the frame. If products of fluctuations are neglected, (J_f + K) theta'' =
!> M - M_d. M_d is the torque on the crank at constant speed, and M is the mean of M_d. K = sum (m |r'|^2 + J phi'^2) is the
!> reduced inertia of the mechanism's links, which is replaced by its mean. The neglected terms are about as large as the square of
!> the relative fluctuation.
!>
!> With loads (forces and moments between links, frame and ground), which can be much larger than inertia forces, no product is
!> neglected: (J_f + K) theta'^2/2 grows by the work of M - M_d, where M_d is taken without Omega^2 K'/2, the part that accelerates
!> the links. The mean of theta'^2 over the angle is Omega^2. The result is exact for a rigid frame.
module gestell_task_power_flywheel
  use gestell_math_series_fourier, only: fourier_series, fourier_type, largest_value
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type
  use gestell_model_mechanism, only: drive_columns, energy_d, energy_v
  implicit none (type, external)
  private

  public :: find_fluctuation

  !> Above this coefficient of irregularity, the report notes that results computed for constant speed may be wrong. Inertia forces
  !> grow with the square of the speed, and the change of the speed, mostly of second order, adds about as much. Together they
  !> change results by up to twice the coefficient, here 2 %.
  real(dp), parameter, public :: max_irregularity = 0.01_dp

  !> Fluctuation of the drive speed over the period.
  type, public :: fluctuation_type
    !> Difference of the drive speed from its mean (rad/s) at equidistant times of the period, shape (points + 1)
    real(dp), allocatable :: history(:)
    !> `maximum`, `least`: largest and smallest difference of the drive speed from its mean (rad/s)
    real(dp) :: maximum = 0, least = 0
    !> Coefficient of irregularity, (`maximum` - `least`) / |mean speed|, and its error bound
    real(dp) :: irregularity = 0, error = 0
    !> Moment of inertia of the flywheel plus mean reduced inertia of the mechanism (kg m^2)
    real(dp) :: inertia = 0
  end type fluctuation_type

contains

  !> Computes the fluctuation of the drive speed from the torque on the crank, without loads to first order in the fluctuation.
  subroutine find_fluctuation(frame, torque, torque_error, points, fluctuation)
    class(frame_type), intent(in) :: frame
    !> Torque on the crank (N m) at equidistant times of the period, and a bound on its error
    real(dp), intent(in) :: torque(:), torque_error
    !> Number of time intervals in `fluctuation%history`
    integer, intent(in) :: points
    type(fluctuation_type), intent(out) :: fluctuation
    type(fourier_type) :: series
    real(dp) :: drive(size(torque), drive_columns), speed(size(torque)), inertia(size(torque)), shift, mean, f(3)
    logical :: known
    integer :: k

    associate (n => size(torque))
      call frame%mechanism%tabulate_drive(frame%crank_angles([(real(k, dp) / n, k = 0, n - 1)]), drive, known)
      ! K refers to the crank angle of the linkage; the angle of the drive changes `turns` times as fast
      fluctuation%inertia = frame%flywheel_inertia + sum(drive(:, energy_v)) / n / frame%mechanism%turns**2
      inertia = frame%flywheel_inertia + drive(:, energy_v) / frame%mechanism%turns**2
      series = fourier_series(torque)
      if (frame%mechanism%load_order >= 0) series = fourier_series(torque - frame%speed**2 * drive(:, energy_d) / 2 &
        & / frame%mechanism%turns)
      series%mean = 0
      series%phase = series%phase + pi / 2
      series%amplitude = series%amplitude * frame%period / (2 * pi * fluctuation%inertia) / [(k, k = 1, size(series%amplitude))]
      do k = 1, n
        f = series%value(2 * pi * (k - 1) / n)
        speed(k) = f(1)
      end do
      mean = frame%drive_speed()
      if (frame%mechanism%load_order >= 0) then
        ! twice the kinetic energy, up to a constant that follows from the mean of the squared speed
        speed = 2 * fluctuation%inertia * mean * speed
        speed = (speed + (mean**2 - sum(speed / inertia) / n) / (sum(1 / inertia) / n)) / inertia
        speed = sign(sqrt(max(speed, tiny(1.0_dp))), mean)
        mean = n / sum(1 / speed)
        speed = speed - mean
        series = fourier_series(speed)
      end if
    end associate
    allocate(fluctuation%history(points + 1))
    do k = 0, points
      f = series%value(2 * pi * k / points)
      fluctuation%history(k + 1) = f(1)
    end do
    ! The values are made positive by a shift, because the maximum of positive values is also the maximum of their moduli.
    shift = sum(series%amplitude)
    fluctuation%maximum = largest_value(speed + shift) - shift
    fluctuation%least = shift - largest_value(shift - speed)
    mean = abs(mean)
    fluctuation%irregularity = (fluctuation%maximum - fluctuation%least) / mean
    ! In the worst case the error of the torque is positive for one half of the period and negative for the other half.
    fluctuation%error = (torque_error * frame%period / (2 * fluctuation%inertia) + 2 * series%beyond()) / mean
  end subroutine find_fluctuation

end module gestell_task_power_flywheel
