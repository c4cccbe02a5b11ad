!> Extrapolation of a period's map by those of the embedded methods.
!>
!> The error of Phi(T) is that of the fastest vibration as a rule, by which its phase is wrong. Of an oscillation that turns by z
!> in a step Gauss' method with s stages leaves the phase error
!>
!>     e_s = c_s z^(2 s + 1),   c_s = (s!)^2 / ((2 s)! (2 s + 1)!),   c_s / c_(s-1) = 1 / (4 (4 s^2 - 1)),
!>
!> and so do the methods of order 2 s - 2 and 2 s - 4 that are embedded in it (gestell_floquet_integrator_nested), with s - 1 and
!> s - 2 for s: Galerkin's residual of x' = P x is along one of Legendre's polynomials alone, as that of collocation at Gauss'
!> nodes. With positions, which are integrated twice, it is along two, P_s-1 and P_s, where that of collocation has a part along
!> P_s-2 that does as much: there they leave half. So with the maps Phi, Phi_1 and Phi_2 of the three
!>
!>     Phi - Phi_1 = D_1,   Phi_1 - Phi_2 = D_2,   D_1 = q D_2,   the error of Phi is r D_1,                          (a)
!>     q = z^2 / (4 (4 (s - 1)^2 - 1)),   r = z^2 / (4 (4 s^2 - 1)), with positions twice that,
!>
!> in leading order, wherever that motion has the error. q is measured, and r follows from it. What D_1 is beyond q D_2 tells how
!> far (a) holds.
module gestell_floquet_period_extrapolation
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_methods, only: pair_begun
  use gestell_floquet_integrator_nested, only: left_by_embedded
  use gestell_floquet_period_level, only: level_type
  implicit none (type, external)
  private

  public :: extrapolate, foretell, look_at_pair

  !> What the maps of embedded methods tell, of Phi(T), 1, and of x_p(T), 2, relative to these: `change` by the method over the
  !> first embedded one, D_1, and by that one over the second, `next`, D_2; q and r of Phi(T), and the `rest`, D_1 - q D_2.
  type, public :: pair_type
    real(dp) :: change(2) = 0, next(2) = 0, rest(2) = 0, q = 0, r = 0
  end type pair_type

contains

  !> In units `scale`, of a system with `positions` or without. Where the embedded methods have begun to converge q is by how much
  !> D_1 is less than D_2 in its direction; not less than 0, nor much more than the fastest motion makes it, which turns by `angle`
  !> (radians) in a step: then something else has the error.
  pure subroutine look_at_pair(level, lower, scale, angle, positions, pair)
    type(level_type), intent(in) :: level, lower(2)
    real(dp), intent(in) :: scale(:), angle
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
    pair%r = pair%q * fall_over(level%stages - 1) / fall_over(level%stages) / left_by_embedded(positions)
    pair%rest = sqrt(max([phi(1) - pair%q * (2 * phi(2) - pair%q * phi(3)), xp(1) - pair%q * (2 * xp(2) - pair%q * xp(3))], 0.0_dp))
  end subroutine look_at_pair

  !> 4 (4 s^2 - 1), z^2 over e_s / e_(s-1).
  elemental real(dp) function fall_over(s)
    integer, intent(in) :: s

    fall_over = 4 * (4 * real(s, dp)**2 - 1)
  end function fall_over

  !> Phi_1 + q D_2 in the place of Phi_2, and x_p(T) likewise: what the embedded methods foretell of the method's.
  pure subroutine foretell(lower, q)
    type(level_type), intent(inout) :: lower(2)
    real(dp), intent(in) :: q

    lower(2)%phi = lower(1)%phi + q * (lower(1)%phi - lower(2)%phi)
    if (allocated(lower(2)%xp)) lower(2)%xp = lower(1)%xp + q * (lower(1)%xp - lower(2)%xp)
  end subroutine foretell

  !> Phi + r D_1 in the place of Phi, and x_p(T) likewise; r D_1 and what is added to x_p(T), where there is one: shapes (n, n),
  !> (n).
  pure subroutine extrapolate(level, first, r, phi_added, xp_added)
    type(level_type), intent(inout) :: level
    type(level_type), intent(in) :: first
    real(dp), intent(in) :: r
    real(dp), allocatable, intent(out) :: phi_added(:, :), xp_added(:)

    allocate(phi_added, source=r * (level%phi - first%phi))
    level%phi = level%phi + phi_added
    if (.not. allocated(level%xp)) return
    allocate(xp_added, source=r * (level%xp - first%xp))
    level%xp = level%xp + xp_added
  end subroutine extrapolate

end module gestell_floquet_period_extrapolation
