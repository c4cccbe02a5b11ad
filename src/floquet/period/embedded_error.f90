!> Estimates the error of the map of the period from the maps of the embedded methods, equation (61) of doc/theory.md.
!>
!> For an oscillation whose phase advances by z in a step, Gauss' method with s stages has the phase error
!>
!>     e_s = c_s z^(2 s + 1),   c_s = (s!)^2 / ((2 s)! (2 s + 1)!),   c_s / c_(s-1) = 1 / (4 (4 s^2 - 1)),
!>
!> unless it is fitted to this oscillation (gestell_floquet_integrator_tableau). The embedded methods of orders 2 s - 2 and 2 s -
!> 4 (gestell_floquet_integrator_nested) are not fitted. Their phase errors are e_(s-1) and e_(s-2), because the Galerkin
!> residual of x' = P x is a multiple of a single Legendre polynomial, like the residual of collocation at the Gauss nodes.
!>
!> For systems with positions, which are integrated twice, the Galerkin residual is a combination of the Legendre polynomials
!> P_s-1 and P_s. The residual of collocation also contains P_s-2 with an equally large coefficient. The embedded methods
!> therefore have half the error of collocation with as many stages. Let Phi, Phi_1 and Phi_2 be the maps of the method and of
!> the embedded methods of orders 2 s - 2 and 2 s - 4. If the oscillation causes the error, these maps satisfy in leading order
!>
!>     Phi - Phi_1 = D_1,   Phi_1 - Phi_2 = D_2,   D_1 = q D_2,   q = z^2 / (4 (4 (s - 1)^2 - 1)).                    (a)
!>
!> If the method is fitted to a motion whose phase advances by v in a step, the error of Phi is
!>
!>     (z^2 - v^2) / (4 (4 s^2 - 1)) D_1, with positions twice this value.                                           (b)
!>
!> The measured q yields z. The norm of D_1 - q D_2 shows how accurately (a) and (b) hold. Steps that are computed together are
!> fitted to the same v. If the steps are not fitted to the motion, for instance because the fastest motion dies out, errors of
!> both signs need not cancel even if the mean of v^2 equals z^2. Therefore the rms of z^2 - v^2 is used.
module gestell_floquet_period_embedded_error
  use gestell_base_kinds, only: dp
  use gestell_floquet_choice_methods, only: pair_begun
  use gestell_floquet_integrator_nested, only: phase_error_ratio, embedded_phase_error
  use gestell_floquet_period_trial, only: level_type
  use gestell_floquet_period_period_map, only: period_map_type
  implicit none (type, external)
  private

  public :: compare_pair, extrapolate

  !> Relative differences between the maps of the method and of its embedded methods: of Phi(T), index 1, and of x_p(T), index 2
  type, public :: pair_type
    !> `change`, `next`: norms of the difference D_1 between the method and the first embedded method, and of the difference D_2
    !> between the two embedded methods. `rest`: norm of D_1 - q D_2. `q`: factor q of Phi(T), equation (a) in the module's
    !> header. `missed`: error in motions to which the method is not fitted, as a fraction of D_1, equation (b) there.
    real(dp) :: change(2) = 0, next(2) = 0, rest(2) = 0, q = 0, missed = 0
  end type pair_type

contains

  !> Compares the map of the method with the maps of its two embedded methods.
  !>
  !> If the embedded methods converge, q is the inner product of D_1 and D_2 divided by |D_2|^2. Here D_1 is the difference
  !> between the method and the first embedded method, D_2 the difference between the two embedded methods. q is limited to the
  !> range from 0 to slightly more than the fastest motion can cause, because a larger value has another cause.
  pure subroutine compare_pair(level, lower, scale, angle, fitted, positions, pair)
    !> Map over the period, computed by the method itself
    type(level_type), intent(in) :: level
    !> Maps over the period, computed by the first and the second embedded method
    type(period_map_type), intent(in) :: lower(2)
    !> `scale`: units of the states, shape (n). `angle`: phase advance (radians) of the fastest motion in a step. `fitted`: means of
    !> the squares and fourth powers of the phase advances (radians) to which the steps are fitted.
    real(dp), intent(in) :: scale(:), angle, fitted(2)
    !> True if the states are positions and velocities
    logical, intent(in) :: positions
    !> Norms of the differences, factor q and fraction `missed`
    type(pair_type), intent(out) :: pair
    real(dp), parameter :: margin = 1.15_dp
    ! Inner products D_1 D_1, D_1 D_2, D_2 D_2
    real(dp) :: phi(3), xp(3), unit, first, second
    integer :: i, j

    phi = 0
    ! Squares below tiny vanish in a norm, so nothing smaller than sqrt(tiny) is compared.
    unit = 0
    if (level%norm > sqrt(tiny(unit))) unit = 1 / level%norm
    do j = 1, size(scale)
      do i = 1, size(scale)
        first = (level%phi(i, j) - lower(1)%phi(i, j)) * (scale(j) / scale(i) * unit)
        second = (lower(1)%phi(i, j) - lower(2)%phi(i, j)) * (scale(j) / scale(i) * unit)
        phi = phi + [first**2, first * second, second**2]
      end do
    end do
    xp = 0
    if (allocated(level%xp) .and. level%xp_peak > 0) then
      do i = 1, size(scale)
        first = (level%xp(i) - lower(1)%xp(i)) / (scale(i) * level%xp_peak)
        second = (lower(1)%xp(i) - lower(2)%xp(i)) / (scale(i) * level%xp_peak)
        xp = xp + [first**2, first * second, second**2]
      end do
    end if
    pair%change = sqrt([phi(1), xp(1)])
    pair%next = sqrt([phi(3), xp(3)])
    if (pair%next(1) < pair_begun) then
      pair%q = min(max(phi(2) / max(phi(3), tiny(1.0_dp)), 0.0_dp), margin * angle**2 / phase_error_ratio(level%stages - 1))
    end if
    pair%missed = sqrt((pair%q * phase_error_ratio(level%stages - 1) - fitted(1))**2 + max(fitted(2) - fitted(1)**2, 0.0_dp)) &
      & / phase_error_ratio(level%stages) / embedded_phase_error(positions)
    pair%rest = sqrt(max([phi(1) - pair%q * (2 * phi(2) - pair%q * phi(3)), xp(1) - pair%q * (2 * xp(2) - pair%q * xp(3))], 0.0_dp))
  end subroutine compare_pair

  !> Replaces the map of the second embedded method by an extrapolation to the map of the method. With the difference D_2 between
  !> the two embedded methods, Phi_2 becomes Phi_1 + q D_2. x_p(T) is extrapolated in the same way.
  pure subroutine extrapolate(lower, q)
    type(period_map_type), intent(inout) :: lower(2)
    real(dp), intent(in) :: q

    lower(2)%phi = lower(1)%phi + q * (lower(1)%phi - lower(2)%phi)
    if (allocated(lower(2)%xp)) lower(2)%xp = lower(1)%xp + q * (lower(1)%xp - lower(2)%xp)
  end subroutine extrapolate

end module gestell_floquet_period_embedded_error
