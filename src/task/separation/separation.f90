!> Computes the distance of the modes' frequencies from the orders of the crank speed. Also computes how the degrees of freedom
!> share the kinetic energy of each mode.
module gestell_task_separation
  use gestell_base_kinds, only: dp, pi
  use gestell_study_mode, only: mode_type, max_dofs
  use gestell_task_campbell, only: campbell_type
  use gestell_task_campbell_crossings, only: crossing_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: find_separations, is_decoupled

  !> A mode counts as decoupled if one degree of freedom has at least this share (%) of its kinetic energy. This value is a common
  !> requirement for mounts
  integer, parameter, public :: decoupled = 80

  !> A pair of a mode with the frequency f (Hz) and an order k of the crank speed n (1/s). Their distance is d = |f / (k n) - 1|.
  type, public :: separation_type
    !> `mode`: number of the mode. `harmonic`: the order as a harmonic of the period
    integer :: mode = 0, harmonic = 0
    !> The order k, as a multiple of the crank speed
    real(dp) :: order = 0
    !> Speed within the range at which the distance is smallest (1/min)
    real(dp) :: speed = 0
    !> The mode at the speed with the smallest distance
    type(mode_type) :: at
    !> Values at the speed with the smallest distance. `frequency`: f of the mode (Hz). `excitation`: frequency k n of the order
    !> (Hz). `distance`: d = |f / (k n) - 1|. `error`: error bound of d. If the mode is not identified at any speed, all but
    !> `excitation` are NaN
    real(dp) :: frequency = 0, excitation = 0, distance = 0, error = 0
    !> Share of each degree of freedom in the kinetic energy of the mode
    real(dp) :: energy(max_dofs) = 0
    !> Number of degrees of freedom that have a share in `energy`
    integer :: dofs = 3
    !> For a frame in space: share of the rotation about the torque-roll axis in the mode; negative if unknown
    real(dp) :: torque_roll = -1
    !> "pass" or "fail"; "undecided" if the error bound of the distance includes the required distance
    character(len=9) :: state = "undecided"
  end type separation_type

contains

  !> True if a mode with this share of the kinetic energy (0 to 1) in one degree of freedom counts as decoupled. The share is first
  !> rounded to whole per cent, as it is printed.
  pure logical function is_decoupled(part)
    real(dp), intent(in) :: part

    is_decoupled = nint(100 * part) >= decoupled
  end function is_decoupled

  !> Distances of all modes of a Campbell diagram from the given harmonics, sorted by mode and harmonic. The distance is zero if the
  !> mode and the order cross in one of the `crossings`.
  pure function find_separations(campbell, crossings, harmonics, turns, margin) result(separations)
    type(campbell_type), intent(in) :: campbell
    type(crossing_type), intent(in) :: crossings(:)
    !> `harmonics`: numbers of the harmonics of the period. `turns`: number of turns that the crank makes in the period
    integer, intent(in) :: harmonics(:), turns
    !> Required distance of a mode from an order, relative to the frequency of the order
    real(dp), intent(in) :: margin
    type(separation_type) :: separations(campbell%modes * size(harmonics))
    integer :: i, k, crossing

    do i = 1, size(separations)
      separations(i)%mode = 1 + (i - 1) / size(harmonics)
      separations(i)%harmonic = harmonics(1 + mod(i - 1, size(harmonics)))
      separations(i)%order = real(separations(i)%harmonic, dp) / turns
      do k = 1, size(campbell%points)
        call update_nearest(separations(i), campbell%points(k)%speed, campbell%points(k)%modes(separations(i)%mode))
      end do
      crossing = findloc(crossings%mode == separations(i)%mode .and. .not. abs(crossings%order - separations(i)%order) > 0, &
        & .true., dim=1)
      associate (one => separations(i))
        if (crossing > 0) then
          one%speed = crossings(crossing)%speed
          one%at = crossings(crossing)%at
          one%frequency = one%at%frequency() / (2 * pi)
          one%excitation = one%order * abs(one%speed) / 60
          one%distance = 0
          one%error = 0
        end if
        call share_energy(campbell, one)
        if (.not. ieee_is_finite(one%distance)) cycle
        if (one%distance - one%error >= margin) one%state = "pass"
        if (one%distance + one%error < margin) one%state = "fail"
      end associate
    end do
  end function find_separations

  !> Updates the pair if its mode is nearer to the order at `speed` than at all previous speeds.
  pure subroutine update_nearest(self, speed, mode)
    type(separation_type), intent(inout) :: self
    real(dp), intent(in) :: speed
    type(mode_type), intent(in) :: mode
    real(dp) :: excitation, frequency

    excitation = self%order * abs(speed) / 60
    if (mode%identified) then
      frequency = mode%frequency() / (2 * pi)
      if (self%at%identified) then
        if (abs(frequency / excitation - 1) >= self%distance) return
      end if
      self%distance = abs(frequency / excitation - 1)
      self%error = mode%error / (2 * pi) / excitation
    else
      if (self%at%identified) return
      frequency = ieee_value(1.0_dp, ieee_quiet_nan)
      self%distance = frequency
      self%error = frequency
    end if
    self%speed = speed
    self%at = mode
    self%frequency = frequency
    self%excitation = excitation
  end subroutine update_nearest

  !> Computes the shares of the degrees of freedom in the kinetic energy of a mode with the complex shape q. The share of degree of
  !> freedom i is Re(conj(q_i) (M q)_i) / q* M q. M is the mean mass matrix, which does not depend on the speed, and q* is the
  !> conjugate transpose of q. The shares add up to 1. A share can be negative if M couples two degrees of freedom.
  pure subroutine share_energy(campbell, self)
    type(campbell_type), intent(in) :: campbell
    type(separation_type), intent(inout) :: self
    complex(dp) :: q(max_dofs)
    real(dp) :: parts(max_dofs)
    integer :: solved

    self%energy = ieee_value(1.0_dp, ieee_quiet_nan)
    self%dofs = merge(max_dofs, 3, any(campbell%free > 3))
    solved = findloc(campbell%points%solved, .true., dim=1)
    if (.not. self%at%identified .or. solved == 0) return
    q = self%at%shape()
    parts = real(conjg(q) * matmul(campbell%points(solved)%mass, q))
    if (.not. sum(parts) > 0) return
    self%energy = 0
    self%energy(campbell%free) = parts(:size(campbell%free)) / sum(parts)
  end subroutine share_energy

end module gestell_task_separation
