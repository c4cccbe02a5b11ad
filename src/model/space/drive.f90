!> The motion of a frame in space and of its drive at a batch of phases: what keeps the speed of the drive constant, and the torque
!> on its shaft; (50) and (51) of doc/theory.md.
!>
!> The angle of the drive relative to the frame is phi = Omega t - chi. If the drive turns q times per turn of the mechanisms, the
!> angle of the mechanisms is phi = Omega t - chi/q. The variables for chi and b then contain chi/q and b/q. The shaft has the axis
!> n at rest and e = R n, which is fixed in the frame; w is the frame's angular velocity. All vectors are along the fixed axes.
!>
!> | held by    | chi                                                           | b                   |
!> |------------|---------------------------------------------------------------|---------------------|
!> | `motor`    | 0                                                             | 0                   |
!> | `outside`  | twist of the frame about n: R = swing x twist                 | (n + e)/(1 + n e)   |
!> | `flywheel` | chi' = w e minus its mean: the spin of the shaft is constant  | e                   |
!>
!> If the frame rotates further by dalpha, phi changes by -b dalpha. The moments on the frame are therefore reduced by b M_d, where
!> M_d is the torque on the shaft, and chi' = w b (minus its mean for a flywheel). Let S, J, H, K be the sums over the masses of
!> gestell_model_space_masses along the fixed axes, index 1: d/dphi in the frame, and a = u'' the acceleration minus gravity. Then
!>
!>     M_d = a S_1 + w' H - w J_1 w/2 + phi'' K + phi'^2 K_1/2.
module gestell_model_space_drive
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: find_rotation, find_turning
  use gestell_math_vectors, only: batch, blocks_type, cross, cross_matrix, dot, outer, scaled, steady, times, transposed, &
    & unit_matrix
  use gestell_model_space_masses, only: fixed_masses_type
  implicit none (type, external)
  private

  public :: add_drive, find_torque, follow_frame, rotate_frame, shift_time

  !> The drive of a frame in space: its shaft, and what keeps its speed constant.
  type, public :: drive_type
    !> What keeps the speed constant: "motor", "outside" or "flywheel" (gestell_model_mechanism_held).
    character(len=8) :: held_by = "motor"
    !> `axis`: unit vector n along the shaft. `flywheel_inertia`: moment of inertia of the flywheel in addition to that of the links
    !> (kg m^2).
    real(dp) :: axis(3) = [0, 0, 1], flywheel_inertia = 0
    !> Number of turns of the drive while the mechanisms' angle grows by 2 pi.
    integer :: turns = 1
  contains
    procedure :: uniform_in_space
  end type drive_type

  !> The motion of a frame in space and of its drive at a batch of phases, along the fixed axes.
  type, public :: moved_type
    !> `rotation`: rotation matrix R. `less_one`: R - 1. `turning`: the matrix T^T of gestell_math_rotation, by which w = T^T
    !> theta', with its first and second derivatives. `w`, `w_d`: angular velocity of the frame and its derivative. `a`:
    !> acceleration of the frame's centre of mass minus gravity.
    real(dp) :: rotation(batch, 3, 3), less_one(batch, 3, 3), turning(batch, 3, 3, 0:2), w(batch, 3), w_d(batch, 3), a(batch, 3)
    !> `rate`, `gain`: first and second time derivatives of the mechanisms' angle phi.
    real(dp) :: rate(batch), gain(batch)
    !> Zero without a flywheel. `spin`: angular momentum of the flywheel about the shaft, in addition to that of the links (N m s).
    !> `motor`: torque of the flywheel's motor on the frame (N m).
    real(dp) :: spin(batch, 3), motor(batch, 3)
    !> The angle chi by which the drive lags behind uniform rotation, with chi' and chi''. Small rotations dalpha of the frame
    !> change these quantities: dchi = b dalpha, dchi' = b dalpha' + rate_turn dalpha, dchi'' = b dalpha'' + gain_spin dalpha' +
    !> gain_turn dalpha, db = bend dalpha.
    real(dp) :: chi(batch, 0:2), b(batch, 3), rate_turn(batch, 3), gain_spin(batch, 3), gain_turn(batch, 3), bend(batch, 3, 3)
  end type moved_type

contains

  !> True if the drive turns uniformly relative to the ground, false if it turns uniformly relative to the frame.
  elemental logical function uniform_in_space(self)
    class(drive_type), intent(in) :: self

    uniform_in_space = self%held_by /= "motor"
  end function uniform_in_space

  !> Computes rotation and angular velocity of a frame from the rotation vector and its first and second derivatives.
  pure subroutine rotate_frame(theta, moved)
    real(dp), intent(in) :: theta(batch, 3, 0:2)
    type(moved_type), intent(inout) :: moved

    call find_rotation(batch, theta, moved%less_one)
    call find_turning(batch, theta, moved%turning)
    moved%rotation = moved%less_one + unit_matrix(spread(1.0_dp, 1, batch))
    moved%w = times(moved%turning(:, :, :, 0), theta(:, :, 1))
    moved%w_d = times(moved%turning(:, :, :, 0), theta(:, :, 2)) + times(moved%turning(:, :, :, 1), theta(:, :, 1))
  end subroutine rotate_frame

  !> Computes the motion of a frame, and the angle by which the drive lags behind uniform rotation relative to the frame.
  pure subroutine follow_frame(drive, speed, u_dd, theta, moved, lag)
    type(drive_type), intent(in) :: drive
    !> `speed`: mean rate of change of the mechanisms' angle (rad/s). `u_dd`: acceleration of the frame's centre of mass minus
    !> gravity (m/s^2). `theta`: rotation vector theta, theta', theta''
    real(dp), intent(in) :: speed, u_dd(batch, 3), theta(batch, 3, 0:2)
    type(moved_type), intent(out) :: moved
    !> Lag chi of the drive (rad), mean of the frame's rate of rotation about the shaft (rad/s), torque of the motor (N m);
    !> required with a flywheel. Without this argument, chi is the component of the rotation vector along the shaft, and mean and
    !> torque are 0
    real(dp), intent(in), optional :: lag(batch, 3)
    real(dp) :: e(batch, 3)

    call rotate_frame(theta, moved)
    moved%a = u_dd
    e = times(moved%rotation, steady(drive%axis))
    moved%spin = 0
    moved%motor = 0
    moved%chi = 0
    moved%b = 0
    moved%rate_turn = 0
    moved%gain_spin = 0
    moved%gain_turn = 0
    moved%bend = 0
    if (drive%uniform_in_space()) then
      moved%spin = speed * drive%turns * drive%flywheel_inertia * e
      if (present(lag)) moved%spin = drive%flywheel_inertia * scaled(speed * drive%turns + lag(:, 2), e)
      if (present(lag)) moved%motor = scaled(lag(:, 3), e)
      call find_turn(drive, theta(:, :, 0), e, moved, lag)
    end if
    moved%rate = speed - moved%chi(:, 1)
    moved%gain = -moved%chi(:, 2)
  end subroutine follow_frame

  !> Computes the lag chi of the drive, and its derivatives, for a frame with the rotation vector theta and the motion `moved`. `e`:
  !> axis of the shaft.
  pure subroutine find_turn(drive, theta, e, moved, lag)
    type(drive_type), intent(in) :: drive
    real(dp), intent(in) :: theta(batch, 3), e(batch, 3)
    type(moved_type), intent(inout) :: moved
    real(dp), intent(in), optional :: lag(batch, 3)
    real(dp), dimension(batch, 3) :: n, e_d, e_dd, b, b_d, b_dd
    real(dp), dimension(batch) :: d, d_d, d_dd, half

    n = steady(drive%axis)
    associate (w => moved%w, w_d => moved%w_d)
      e_d = cross(w, e)
      moved%chi(:, 0) = dot(n, theta)
      if (drive%held_by == "flywheel") then
        b = e
        b_d = 0
        ! the rotation dalpha changes w by dalpha' + dalpha x w, and e by dalpha x e
        moved%chi(:, 1) = dot(e, w)
        moved%chi(:, 2) = dot(e, w_d)
        if (present(lag)) moved%chi(:, 0) = lag(:, 1)
        if (present(lag)) moved%chi(:, 1) = moved%chi(:, 1) - lag(:, 2)
        moved%gain_spin = e_d
        moved%gain_turn = 0
        moved%bend = -cross_matrix(e)
      else
        e_dd = cross(w, e_d) + cross(w_d, e)
        d = 1 + dot(n, e)
        d_d = dot(n, e_d)
        d_dd = dot(n, e_dd)
        b = scaled(1 / d, n + e)
        b_d = scaled(1 / d, e_d - scaled(d_d, b))
        b_dd = scaled(1 / d, e_dd - 2 * scaled(d_d, b_d) - scaled(d_dd, b))
        ! tan(chi/2) = n theta tan(a/2)/a, a = |theta|
        half = sqrt(dot(theta, theta)) / 2
        where (half > 0) moved%chi(:, 0) = 2 * atan2(moved%chi(:, 0) * sin(half) / (2 * half), cos(half))
        moved%chi(:, 1) = dot(b, w)
        moved%chi(:, 2) = dot(b_d, w) + dot(b, w_d)
        moved%gain_spin = 2 * b_d
        moved%gain_turn = b_dd
        moved%bend = -cross_matrix(e) - outer(b, cross(e, n))
        moved%bend = scaled(1 / d, moved%bend)
      end if
    end associate
    moved%b = b
    moved%rate_turn = b_d
    if (drive%turns == 1) return
    moved%chi = moved%chi / drive%turns
    moved%b = moved%b / drive%turns
    moved%rate_turn = moved%rate_turn / drive%turns
    moved%gain_spin = moved%gain_spin / drive%turns
    moved%gain_turn = moved%gain_turn / drive%turns
    moved%bend = moved%bend / drive%turns
  end subroutine find_turn

  !> Computes the torque M_d on the shaft (N m) and its derivatives with respect to small displacements du and rotations dalpha of
  !> the frame and the rates of both. These rotations also turn the drive, by dphi = -dchi.
  pure subroutine find_torque(moved, masses, torque, by_gain, by_spin, by_turn)
    type(moved_type), intent(in) :: moved
    type(fixed_masses_type), intent(in) :: masses
    !> `torque`: M_d (N m). `by_gain`, `by_spin`, `by_turn`: derivatives of M_d with respect to dalpha'', dalpha' and dalpha. The
    !> derivative with respect to du'' is S_1; those with respect to du' and du are 0
    real(dp), intent(out) :: torque(batch), by_gain(batch, 3), by_spin(batch, 3), by_turn(batch, 3)
    real(dp) :: momentum(batch, 3), by_angle(batch)

    associate (s_1 => masses%s(:, :, 1), s_2 => masses%s(:, :, 2), h => masses%h(:, :, 0), h_1 => masses%h(:, :, 1), &
      & k => masses%k(:, 0), k_1 => masses%k(:, 1), k_2 => masses%k(:, 2), a => moved%a, w => moved%w, w_d => moved%w_d, &
      & rate => moved%rate, gain => moved%gain, b => moved%b)
      momentum = times(masses%j(:, :, :, 1), w)
      torque = dot(a, s_1) + dot(w_d, h) - dot(w, momentum) / 2 + gain * k + rate**2 * k_1 / 2
      by_angle = dot(a, s_2) + dot(w_d, h_1) - dot(w, times(masses%j(:, :, :, 2), w)) / 2 + gain * k_1 + rate**2 * k_2 / 2
      by_gain = h - scaled(k, b)
      by_spin = cross(w, h) - momentum - scaled(k, moved%gain_spin) - scaled(rate * k_1, b)
      by_turn = cross(s_1, a) - scaled(k, moved%gain_turn) - scaled(rate * k_1, moved%rate_turn) - scaled(by_angle, b)
    end associate
  end subroutine find_torque

  !> Adds the effect of a drive that turns uniformly relative to the ground. Relative to the frame its angle lags by chi, and its
  !> torque exerts no moment on the frame.
  pure subroutine add_drive(moved, masses, moments, m, b, c)
    type(moved_type), intent(in) :: moved
    type(fixed_masses_type), intent(in) :: masses
    !> Left sides of the balance of moments, to which the effect is added, and derivatives of all left sides with respect to the
    !> second and first derivatives of (du, dalpha) and to (du, dalpha)
    real(dp), intent(inout) :: moments(batch, 3)
    type(blocks_type), intent(inout) :: m, b, c
    real(dp), dimension(batch, 3) :: force, force_d, force_dd, moment, moment_d, moment_dd, of_gain, of_spin, of_turn
    real(dp) :: torque(batch)

    call find_torque(moved, masses, torque, of_gain, of_spin, of_turn)
    associate (s_1 => masses%s(:, :, 1), s_2 => masses%s(:, :, 2), s_3 => masses%s(:, :, 3), h => masses%h(:, :, 0), &
      & h_1 => masses%h(:, :, 1), h_2 => masses%h(:, :, 2), j_1 => masses%j(:, :, :, 1), j_2 => masses%j(:, :, :, 2), &
      & w => moved%w, w_d => moved%w_d, rate => moved%rate, gain => moved%gain, axis => moved%b)
      ! derivatives of the left sides with respect to phi'', phi' and phi
      force = s_1
      force_d = 2 * (scaled(rate, s_2) + cross(w, s_1))
      force_dd = scaled(rate**2, s_3) + scaled(gain, s_2) + 2 * scaled(rate, cross(w, s_2)) + cross(w_d, s_1) &
        & + cross(w, cross(w, s_1))
      moment = h
      moment_d = times(j_1, w) + 2 * scaled(rate, h_1) + cross(w, h)
      moment_dd = times(j_1, w_d) + scaled(rate, times(j_2, w)) + cross(w, times(j_1, w)) + scaled(rate**2, h_2) &
        & + scaled(gain, h_1) + scaled(rate, cross(w, h_1)) + cross(s_1, moved%a)
      moments = moments - scaled(torque, axis)
      m%ua = m%ua - outer(force, axis)
      m%aa = m%aa - outer(moment, axis) - outer(axis, of_gain)
      m%au = m%au - outer(axis, s_1)
      b%ua = b%ua - outer(force, moved%gain_spin) - outer(force_d, axis)
      b%aa = b%aa - outer(moment, moved%gain_spin) - outer(moment_d, axis) - outer(axis, of_spin)
      c%ua = c%ua - outer(force, moved%gain_turn) - outer(force_d, moved%rate_turn) - outer(force_dd, axis)
      c%aa = c%aa - outer(moment, moved%gain_turn) - outer(moment_d, moved%rate_turn) - outer(moment_dd, axis) &
        & - outer(axis, of_turn) - scaled(torque, moved%bend)
    end associate
  end subroutine add_drive

  !> Removes from the linearised equations with a flywheel their dependence on the past motion. With a flywheel dchi is e dalpha
  !> plus the integral of -w x e dalpha. The disturbed motion is therefore compared at the shifted time t + eta, where eta' = e x w
  !> dalpha/`spin` and `spin` is the constant spin of the shaft. Then dchi = e dalpha alone, dq' becomes dq' - eta' q', and dq''
  !> becomes dq'' - 2 eta' q'' - eta'' q'. The shift of time does not change the multipliers.
  pure subroutine shift_time(moved, u, theta, m, b, c)
    type(moved_type), intent(in) :: moved
    !> `u`, `theta`: displacement and rotation vector with their first and second derivatives. `m`, `b`, `c`: derivatives of the
    !> left sides with respect to the second and first derivatives of (u, theta) and to (u, theta)
    real(dp), dimension(batch, 3, 0:2), intent(in) :: u, theta
    type(blocks_type), intent(in) :: m
    type(blocks_type), intent(inout) :: b, c
    real(dp), dimension(batch, 3) :: across, across_d, shift, shift_d, force, moment
    real(dp) :: spin(batch)

    associate (w => moved%w, axis => moved%b, axis_d => moved%gain_spin)
      spin = moved%rate + dot(axis, w)
      across = scaled(1 / spin, cross(axis, w))
      across_d = scaled(1 / spin, cross(axis_d, w) + cross(axis, moved%w_d))
    end associate
    ! eta' = shift dtheta, eta'' = shift dtheta' + shift_d dtheta
    shift = times(transposed(moved%turning(:, :, :, 0)), across)
    shift_d = times(transposed(moved%turning(:, :, :, 0)), across_d) + times(transposed(moved%turning(:, :, :, 1)), across)
    force = times(m%uu, u(:, :, 1)) + times(m%ua, theta(:, :, 1))
    moment = times(m%au, u(:, :, 1)) + times(m%aa, theta(:, :, 1))
    c%ua = c%ua - outer(force, shift_d) - outer(2 * (times(m%uu, u(:, :, 2)) + times(m%ua, theta(:, :, 2))) &
      & + times(b%uu, u(:, :, 1)) + times(b%ua, theta(:, :, 1)), shift)
    c%aa = c%aa - outer(moment, shift_d) - outer(2 * (times(m%au, u(:, :, 2)) + times(m%aa, theta(:, :, 2))) &
      & + times(b%au, u(:, :, 1)) + times(b%aa, theta(:, :, 1)), shift)
    b%ua = b%ua - outer(force, shift)
    b%aa = b%aa - outer(moment, shift)
  end subroutine shift_time

end module gestell_model_space_drive
