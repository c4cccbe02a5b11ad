!> Effect of the loads (forces and moments between links, frame and ground) on a frame in the plane and on its drive.
!>
!> With E = exp(i psi) and phi = Omega t - p psi (gestell_model_mechanism_held), a load against the ground does the work
!>
!>     F . d(u + E r) + M d(psi + phi_2),   d(E r) = i E r_1 dpsi,   r_1 = r + i p r',
!>
!> if only the frame moves; a load between two bodies of the machine does the work Q dphi = -p Q dpsi. Here r' is the velocity of
!> the body's point at r, at unit crank speed.
module gestell_model_mechanism_loads
  use gestell_base_kinds, only: dp, pi
  use gestell_model_mechanism, only: load_sums_type, mechanism_type
  implicit none (type, external)
  private

  public :: effect_of, mean_load_torque, power_of_loads

  !> Effect of all loads at one crank angle. `force`: forces along xi, eta (N) and moment about F (N m) on the frame, those of the
  !> drive's reaction included. `torque`: torque on the crank (N m). Suffix _psi: derivatives with respect to psi at constant time.
  type, public :: load_effect_type
    real(dp) :: force(3) = 0, force_psi(3) = 0, torque = 0, torque_psi = 0
  end type load_effect_type

  complex(dp), parameter :: i = (0.0_dp, 1.0_dp)

contains

  !> Effect of the loads. `turn`: E = exp(i psi). `part`: factor p.
  elemental type(load_effect_type) function effect_of(sums, turn, part) result(effect)
    type(load_sums_type), intent(in) :: sums
    complex(dp), intent(in) :: turn
    real(dp), intent(in) :: part
    complex(dp) :: lever(0:1), force, change

    associate (back => conjg(turn))
      lever = sums%lever - i * part * sums%sweep
      force = turn * sums%force(0) + sums%fixed(0)
      change = turn * (i * sums%force(0) - part * sums%force(1)) - part * sums%fixed(1)
      effect%force = [real(force), aimag(force), sums%moment(0) - part * sums%torque(0) + aimag(back * lever(0))]
      effect%force_psi = [real(change), aimag(change), -part * (sums%moment(1) - part * sums%torque(1)) &
        & - aimag(back * (i * lever(0) + part * lever(1)))]
      effect%torque = sums%torque(0) + real(back * sums%sweep(0))
      effect%torque_psi = -part * sums%torque(1) - real(back * (i * sums%sweep(0) + part * sums%sweep(1)))
    end associate
  end function effect_of

  !> Power of the loads (W). `rate`: speed of the crank relative to the frame (rad/s). `v`: velocity of the frame (m/s, rad/s).
  pure real(dp) function power_of_loads(sums, turn, rate, v) result(power)
    type(load_sums_type), intent(in) :: sums
    complex(dp), intent(in) :: turn
    real(dp), intent(in) :: rate, v(3)
    type(load_effect_type) :: effect

    effect = effect_of(sums, turn, 0.0_dp)
    power = dot_product(effect%force, v) + effect%torque * rate
  end function power_of_loads

  !> Mean over the period of the loads' torque on the crank if the frame is at rest (N m).
  pure real(dp) function mean_load_torque(mechanism, origin) result(mean)
    class(mechanism_type), intent(in) :: mechanism
    real(dp), intent(in) :: origin(2)
    type(load_sums_type), allocatable :: sums(:)
    integer :: k, n

    ! the motion of the links has orders far below n - load_order
    n = 2 * mechanism%load_order + max(64, ceiling(16 * pi / mechanism%angle_scale))
    allocate(sums(n))
    call mechanism%sum_loads([(2 * pi * k / n, k = 1, n)], origin, sums)
    mean = sum([(sums(k)%torque(0) + real(sums(k)%sweep(0)), k = 1, n)]) / n
  end function mean_load_torque

end module gestell_model_mechanism_loads
