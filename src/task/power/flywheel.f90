!> How evenly a flywheel holds the speed.
!>
!> A flywheel J_f turns with the crank in space, theta = phi + psi, and (J_f + K) theta'' = M - M_d, but for products with the
!> fluctuation of the speed: M_d is the torque on the crank at constant speed, M its mean, K = sum (m |r'|^2 + J phi'^2) the reduced
!> inertia of the mechanism, here its mean. What is left out of the fluctuation is about as large as its square.
module gestell_task_power_flywheel
  use gestell_math_series_fourier, only: fourier_series, fourier_type, greatest
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type
  use gestell_model_mechanism, only: drive_columns, energy_v
  implicit none (type, external)
  private

  public :: find_fluctuation

  !> A coefficient beyond this tells that the speed is not constant: inertia forces go with its square, and its change, mostly of
  !> second order, adds about as much. Together that is up to twice the coefficient, 2 %.
  real(dp), parameter, public :: uneven = 0.01_dp

  type, public :: fluctuation_type
    !> The drive's speed less its mean at points + 1 times of the period (rad/s); its greatest and least.
    real(dp), allocatable :: history(:)
    real(dp) :: greatest = 0, least = 0
    !> (greatest - least)/|speed|, and a bound on its error.
    real(dp) :: irregularity = 0, error = 0
    !> Of flywheel and mechanism (kg m^2).
    real(dp) :: inertia = 0
  end type fluctuation_type

contains

  !> From the torque on the drive's crank (N m) at equidistant times of the period, known to `torque_error`.
  subroutine find_fluctuation(frame, torque, torque_error, points, fluctuation)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: torque(:), torque_error
    integer, intent(in) :: points
    type(fluctuation_type), intent(out) :: fluctuation
    type(fourier_type) :: series
    real(dp) :: drive(size(torque), drive_columns), speed(size(torque)), shift, mean, f(3)
    logical :: known
    integer :: k

    associate (n => size(torque))
      call frame%mechanism%tabulate_drive(frame%crank_angles([(real(k, dp) / n, k = 0, n - 1)]), drive, known)
      ! K of the linkage's crank angle, of which the drive turns several times as fast
      fluctuation%inertia = frame%flywheel_inertia + sum(drive(:, energy_v)) / n / frame%mechanism%turns**2
      series = fourier_series(torque)
      series%mean = 0
      series%phase = series%phase + pi / 2
      series%amplitude = series%amplitude * frame%period / (2 * pi * fluctuation%inertia) &
        & / [(k, k = 1, size(series%amplitude))]
      do k = 1, n
        f = series%value(2 * pi * (k - 1) / n)
        speed(k) = f(1)
      end do
    end associate
    allocate(fluctuation%history(points + 1))
    do k = 0, points
      f = series%value(2 * pi * k / points)
      fluctuation%history(k + 1) = f(1)
    end do
    ! What is lifted above zero everywhere has its greatest value where it has its greatest size.
    shift = sum(series%amplitude)
    fluctuation%greatest = greatest(speed + shift) - shift
    fluctuation%least = shift - greatest(shift - speed)
    mean = abs(frame%drive_speed())
    fluctuation%irregularity = (fluctuation%greatest - fluctuation%least) / mean
    ! An error of the torque that is positive for half a period and negative for the other does most.
    fluctuation%error = (torque_error * frame%period / (2 * fluctuation%inertia) + 2 * series%beyond()) / mean
  end subroutine find_fluctuation

end module gestell_task_power_flywheel
