!> What the maps of the embedded methods tell of a period's map.
!>
!> Of an oscillation that turns by z in a step Gauss' method with s stages leaves the phase error
!>
!>     e_s = c_s z^(2 s + 1),   c_s = (s!)^2 / ((2 s)! (2 s + 1)!),   c_s / c_(s-1) = 1 / (4 (4 s^2 - 1)),
!>
!> but where it is fitted to it (gestell_floquet_integrator_tableau), and so do the methods of order 2 s - 2 and 2 s - 4 that are
!> embedded in it (gestell_floquet_integrator_nested), which are not, with s - 1 and s - 2 for s: Galerkin's residual of x' = P x is
!> along one of Legendre's polynomials alone, as that of collocation at Gauss' nodes. With positions, which are integrated twice, it
!> is along two, P_s-1 and P_s, where that of collocation has a part along P_s-2 that does as much: there they leave half. So with
!> the maps Phi, Phi_1 and Phi_2 of the three
!>
!>     Phi - Phi_1 = D_1,   Phi_1 - Phi_2 = D_2,   D_1 = q D_2,   q = z^2 / (4 (4 (s - 1)^2 - 1)),                    (a)
!>
!> in leading order, wherever that motion has the error, and of Phi, fitted to a motion that turns by v in a step,
!>
!>     the error is (z^2 - v^2) / (4 (4 s^2 - 1)) D_1, with positions twice that.                                     (b)
!>
!> q is measured, and tells z; what D_1 is beyond q D_2 tells how far all of this holds. Steps that are taken together have one v.
!> Of a motion to which they are not fitted, as where the fastest one dies out, errors of both signs need not cancel though the
!> mean of v^2 is its z^2: the rms of z^2 - v^2 counts.
module gestell_floquet_period_pair
  use gestell_base_kinds, only: dp
  use gestell_floquet_choice_methods, only: pair_begun
  use gestell_floquet_integrator_nested, only: fall_over, left_by_embedded
  use gestell_floquet_period_level, only: level_type
  use gestell_floquet_period_period_map, only: period_map_type
  implicit none (type, external)
  private

  public :: compare_pair, extrapolate

  !> What the maps of embedded methods tell, of Phi(T), 1, and of x_p(T), 2, relative to these: `change` by the method over the
  !> first embedded one, D_1, and by that one over the second, `next`, D_2; the `rest`, D_1 - q D_2; q of Phi(T), and the part of
  !> D_1 by which it misses a motion that it is not fitted to, `missed`, (b).
  type, public :: pair_type
    real(dp) :: change(2) = 0, next(2) = 0, rest(2) = 0, q = 0, missed = 0
  end type pair_type

contains

  !> In units `scale`. Where the embedded methods have begun to converge q is by how much D_1 is less than D_2 in its direction;
  !> not less than 0, nor much more than the fastest motion makes it, which turns by `angle` (radians) in a step: then something
  !> else has the error. The method is fitted to motions whose angles have the mean square and mean fourth power `fitted`; the
  !> system has `positions` or not.
  pure subroutine compare_pair(level, lower, scale, angle, fitted, positions, pair)
    type(level_type), intent(in) :: level
    type(period_map_type), intent(in) :: lower(2)
    real(dp), intent(in) :: scale(:), angle, fitted(2)
    logical, intent(in) :: positions
    type(pair_type), intent(out) :: pair
    real(dp), parameter :: margin = 1.15_dp
    ! D_1^2, D_1 D_2, D_2^2.
    real(dp) :: phi(3), xp(3), unit, first, second
    integer :: i, j

    phi = 0
    ! The squares within a norm vanish below sqrt(tiny): so small a Phi(T) is known to that only.
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
      pair%q = min(max(phi(2) / max(phi(3), tiny(1.0_dp)), 0.0_dp), margin * angle**2 / fall_over(level%stages - 1))
    end if
    pair%missed = sqrt((pair%q * fall_over(level%stages - 1) - fitted(1))**2 + max(fitted(2) - fitted(1)**2, 0.0_dp)) &
      & / fall_over(level%stages) / left_by_embedded(positions)
    pair%rest = sqrt(max([phi(1) - pair%q * (2 * phi(2) - pair%q * phi(3)), xp(1) - pair%q * (2 * xp(2) - pair%q * xp(3))], 0.0_dp))
  end subroutine compare_pair

  !> Phi_1 + q D_2 in the place of Phi_2, and x_p(T) likewise: what the embedded methods foretell of the method's.
  pure subroutine extrapolate(lower, q)
    type(period_map_type), intent(inout) :: lower(2)
    real(dp), intent(in) :: q

    lower(2)%phi = lower(1)%phi + q * (lower(1)%phi - lower(2)%phi)
    if (allocated(lower(2)%xp)) lower(2)%xp = lower(1)%xp + q * (lower(1)%xp - lower(2)%xp)
  end subroutine extrapolate

end module gestell_floquet_period_pair
