!> Mean over the turn of the first moment of a mechanism's masses.
module gestell_model_mechanism_mean_moment
  use gestell_base_kinds, only: dp, pi
  use gestell_model_mechanism, only: a1_v, a2_v, mechanism_type, table_columns
  implicit none (type, external)
  private

  public :: average_masses

contains

  !> Computes the mean over the turn of the first moment a1 + i a2 of the masses, and its maximum magnitude (kg m). The mean is
  !> computed by the trapezoidal rule. The number of points is doubled until two successive doublings change the mean only by
  !> rounding errors, or until it exceeds 2^18.
  subroutine average_masses(mechanism, mean, maximum)
    class(mechanism_type), intent(in) :: mechanism
    complex(dp), intent(out) :: mean
    real(dp), intent(out) :: maximum
    integer, parameter :: max_points = 2**18
    real(dp), allocatable :: table(:, :), angles(:)
    complex(dp) :: before
    real(dp) :: shift, change, last
    integer :: k, points

    points = max(16, 2 * ceiling(2 * pi / mechanism%angle_scale))
    shift = 0
    mean = 0
    maximum = 0
    change = huge(change)
    do
      if (allocated(table)) deallocate(table)
      allocate(table(points, table_columns))
      angles = [(2 * pi * (k + shift) / points, k = 0, points - 1)]
      call mechanism%tabulate(angles, table)
      maximum = max(maximum, maxval(hypot(table(:, a1_v), table(:, a2_v))))
      before = mean
      mean = cmplx(sum(table(:, a1_v)), sum(table(:, a2_v)), dp) / points
      if (shift > 0) then
        mean = (mean + before) / 2
        points = 2 * points
        last = change
        change = abs(mean - before)
        if (max(change, last) <= 8 * epsilon(1.0_dp) * maximum .or. points > max_points) exit
      end if
      shift = 0.5_dp
    end do
  end subroutine average_masses

end module gestell_model_mechanism_mean_moment
