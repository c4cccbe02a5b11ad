!> Assigns multipliers to modes. A multiplier determines a frequency only up to multiples of the crank speed; its mode determines
!> the frequency itself.
module gestell_study_mode_naming
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_study_mode, only: mode_type
  implicit none (type, external)
  private

  public :: modes_of_multipliers

  !> Two exponents count as equal if their distance exceeds the sum of their error bounds by less than this fraction of the crank
  !> speed.
  real(dp), parameter :: alike = 1.0e-6_dp

contains

  !> Index of the mode to which each multiplier belongs; 0 if there is none. The exponents of mode and multiplier must agree
  !> within their error bounds. The best matches are assigned first, at most two multipliers to each mode. `speed`: speed of the
  !> crank (rad/s).
  pure function modes_of_multipliers(multipliers, modes, speed) result(mode)
    type(multipliers_type), intent(in) :: multipliers
    type(mode_type), intent(in) :: modes(:)
    real(dp), intent(in) :: speed
    integer :: mode(size(multipliers%rho))
    real(dp) :: apart(size(multipliers%rho), size(modes))
    integer :: remaining_modes(size(modes)), i, k, place(2)

    mode = 0
    remaining_modes = 2
    if (size(modes) == 0) return
    apart = huge(1.0_dp)
    do k = 1, size(modes)
      if (modes(k)%identified) apart(:, k) = distance(multipliers%exponent, modes(k), speed) - modes(k)%error &
        & - multipliers%error * speed
    end do
    do i = 1, size(mode)
      place = minloc(apart)
      if (apart(place(1), place(2)) > alike * speed) exit
      mode(place(1)) = place(2)
      remaining_modes(place(2)) = remaining_modes(place(2)) - 1
      apart(place(1), :) = huge(1.0_dp)
      if (remaining_modes(place(2)) == 0) apart(:, place(2)) = huge(1.0_dp)
    end do
  end function modes_of_multipliers

  !> Distance between an exponent and the nearest exponent of a mode. Multiples of the crank speed and the sign of the frequency are
  !> ignored.
  elemental real(dp) function distance(exponent, mode, speed)
    complex(dp), intent(in) :: exponent
    type(mode_type), intent(in) :: mode
    real(dp), intent(in) :: speed
    real(dp) :: turns(2)

    turns = aimag(exponent) + [-mode%frequency(), mode%frequency()]
    turns = turns - speed * anint(turns / speed)
    distance = min(abs(real(exponent) - mode%growth), abs(real(exponent) - mode%partner_growth)) + minval(abs(turns))
  end function distance

end module gestell_study_mode_naming
