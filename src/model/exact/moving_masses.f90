!> Effective mass functions (the moving masses as they act on the frame) at given crank angles, with derivatives, for the exact
!> equations. They depend on what keeps the speed constant: the frame, a flywheel or an outside drive (see
!> gestell_model_mechanism_held).
module gestell_model_exact_moving_masses
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_mechanism_held, only: part_of_turn, tabulate_effective
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_dd, a3_v, table_columns
  implicit none (type, external)
  private

  public :: find_masses

  !> Sums over the masses about the frame's centre of mass F, along the frame's axes, each of shape (angles). Suffix _t: time
  !> derivative, Omega d/dphi at constant psi. Suffix _psi: derivative with respect to psi at constant time; for a crank that
  !> turns uniformly relative to the ground, the crank angle phi relative to the frame decreases as psi grows. Z = E S with E =
  !> exp(i psi) is the first moment of the masses along the fixed axes xi and eta.
  type, public :: masses_type
    !> First moment S = sum m r of the masses (kg m). Suffixes _t and _tt: first and second time derivatives. S_1, S_2, S_3 give
    !> the derivatives of Z = E S, E = exp(i psi): dZ/dpsi = i E S_1, d2Z/dpsi2 = -E S_2, d3Z/dpsi3 = -i E S_3.
    complex(dp), allocatable :: s_tt(:), s_1(:), s_1_t(:), s_1_tt(:), s_2(:), s_2_t(:), s_3(:)
    !> `inertia`: effective moment of inertia J_1, the factor of psi'' (kg m^2). The other components are the derivatives of J_1
    !> with respect to time and psi.
    real(dp), allocatable :: inertia(:), inertia_t(:), inertia_psi(:), inertia_tpsi(:), inertia_psipsi(:)
    !> `moment`: moment of the load on a frame at rest about the frame's centre of mass (N m), with reversed sign, as in the
    !> equation of psi. `moment_psi`: derivative of `moment` with respect to psi.
    real(dp), allocatable :: moment(:), moment_psi(:)
  end type masses_type

contains

  !> Computes the effective mass functions of a frame at crank angles phi (rad).
  subroutine find_masses(frame, angles, at)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: angles(:)
    type(masses_type), intent(out) :: at
    complex(dp), parameter :: i = (0.0_dp, 1.0_dp)
    real(dp) :: effective(size(angles), table_columns), load(size(angles), 3), slope(size(angles)), part

    call tabulate_effective(frame%mechanism, frame%origin, frame%uniform_in_space(), angles, effective, load, slope)
    associate (omega => frame%speed, xi0 => frame%origin(1), eta0 => frame%origin(2), m_g => frame%mechanism%mass)
      at%s_tt = omega**2 * cmplx(load(:, 1), load(:, 2), dp)
      at%moment = omega**2 * (xi0 * load(:, 2) - eta0 * load(:, 1) + load(:, 3))
      at%s_1 = frame%mechanism%mass * cmplx(xi0, eta0, dp) + cmplx(effective(:, a1_v), effective(:, a2_v), dp)
      at%s_1_t = omega * cmplx(effective(:, a1_d), effective(:, a2_d), dp)
      at%s_1_tt = omega**2 * cmplx(effective(:, a1_dd), effective(:, a2_dd), dp)
      at%inertia = frame%inertia + frame%mechanism%inertia + m_g * (xi0**2 + eta0**2) + turned(a1_v, a2_v, a3_v)
      at%inertia_t = omega * turned(a1_d, a2_d, a3_d)
      if (frame%uniform_in_space()) then
        part = part_of_turn(frame%mechanism, .true.)
        at%s_2 = at%s_1 + i * part * at%s_1_t / omega
        at%s_2_t = at%s_1_t + i * part * at%s_1_tt / omega
        at%s_3 = at%s_2 + i * part * at%s_2_t / omega
        at%inertia_psi = -part * at%inertia_t / omega
        at%inertia_psipsi = part**2 * turned(a1_dd, a2_dd, a3_dd)
        at%inertia_tpsi = -omega * part * turned(a1_dd, a2_dd, a3_dd)
        at%moment_psi = -omega**2 * slope
      else
        at%s_2 = at%s_1
        at%s_2_t = at%s_1_t
        at%s_3 = at%s_1
        allocate(at%inertia_psi(size(angles)), source=0.0_dp)
        at%inertia_psipsi = at%inertia_psi
        at%inertia_tpsi = at%inertia_psi
        at%moment_psi = at%inertia_psi
      end if
    end associate

  contains

    !> The part of the moment of inertia about the frame's centre of mass that varies with the crank angle, or one of its
    !> derivatives. With the mechanism's origin (xi_0, eta_0) it is a3 + 2 xi_0 a1 + 2 eta_0 a2. The arguments are column numbers
    !> of `effective`: those of a1, a2, a3 or of their derivatives.
    pure function turned(a1, a2, a3)
      integer, intent(in) :: a1, a2, a3
      real(dp) :: turned(size(angles))

      turned = effective(:, a3) + 2 * frame%origin(1) * effective(:, a1) + 2 * frame%origin(2) * effective(:, a2)
    end function turned

  end subroutine find_masses

end module gestell_model_exact_moving_masses
