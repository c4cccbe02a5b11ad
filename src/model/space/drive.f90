!> What keeps the speed of the drive of a frame in space constant, and the torque on its shaft; (50) and (51) of doc/theory.md.
!>
!> The angle of the drive relative to the frame is phi = Omega t - chi. If the drive turns q times per turn of the mechanisms, the
!> angle of the mechanisms is phi = Omega t - chi/q. The variables for chi and b then contain chi/q and b/q. The shaft has the axis
!> n, fixed in the frame; w is the frame's angular velocity along the frame's axes.
!>
!> | held by    | chi                                                           | b                   |
!> |------------|---------------------------------------------------------------|---------------------|
!> | `motor`    | 0                                                             | 0                   |
!> | `outside`  | twist of the frame about n: R = swing x twist                 | (n + e)/(1 + n e)   |
!> | `flywheel` | chi' = w n minus its mean: the spin of the shaft is constant  | n                   |
!>
!> Here e = R^T n is the axis of the shaft at rest, along the frame's axes. If the frame rotates by R [dalpha], phi changes by -b
!> dalpha. The moments on the frame are therefore reduced by b M_d, where M_d is the torque on the shaft, and chi' = w b (minus its
!> mean for a flywheel). With the sums over the masses of gestell_model_space_moving and a = R^T u'', where u'' is the acceleration
!> minus gravity,
!>
!>     M_d = a S_1 + w' A - w J_1 w/2 + phi'' K + phi'^2 K_1/2,   index 1: d/dphi.
module gestell_model_space_drive
  use gestell_base_kinds, only: dp
  use gestell_model_space_moving, only: moving_type
  use gestell_math_rotation, only: cross, cross_matrix, outer, rotation_matrix, turning_matrices
  implicit none (type, external)
  private

  public :: add_drive, find_torque, follow_frame, shift_time

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

  !> The motion of a frame in space and of its drive at one phase.
  type, public :: moved_type
    !> `rotation`: rotation matrix R. `w`, `w_d`: angular velocity of the frame and its derivative. `a`: acceleration of the
    !> frame's centre of mass minus gravity. All vectors are along the frame's axes. `rate`, `gain`: first and second time
    !> derivatives of the mechanisms' angle phi.
    real(dp) :: rotation(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3]), w(3) = 0, w_d(3) = 0, a(3) = 0, rate = 0, gain = 0
    !> Zero without a flywheel. `spin`: angular momentum of the flywheel about the shaft, in addition to that of the links (N m s).
    !> `motor`: torque of the flywheel's motor on the frame (N m).
    real(dp) :: spin(3) = 0, motor(3) = 0
  end type moved_type

  !> The angle chi by which the drive lags behind uniform rotation, with chi' and chi''. Small rotations dalpha of the frame about
  !> its axes change these quantities: dchi = b dalpha, dchi' = b dalpha' + rate_turn dalpha, dchi'' = b dalpha'' + gain_spin
  !> dalpha' + gain_turn dalpha, db = bend dalpha.
  type, public :: turn_type
    real(dp) :: chi(0:2) = 0, b(3) = 0, rate_turn(3) = 0, gain_spin(3) = 0, gain_turn(3) = 0, bend(3, 3) = 0
  end type turn_type

  !> State at one phase. `moved`: motion of the frame. `turn`: lag of the drive. `moving`: sums over the masses that the drive
  !> moves.
  type, public :: driven_type
    type(moved_type) :: moved
    type(turn_type) :: turn
    type(moving_type) :: moving
  end type driven_type

contains

  !> True if the drive turns uniformly relative to the ground, false if it turns uniformly relative to the frame.
  elemental logical function uniform_in_space(self)
    class(drive_type), intent(in) :: self

    uniform_in_space = self%held_by /= "motor"
  end function uniform_in_space

  !> Computes the motion of a frame, and the angle by which the drive lags behind uniform rotation relative to the frame.
  pure subroutine follow_frame(drive, speed, u_dd, theta, moved, turn, lag)
    type(drive_type), intent(in) :: drive
    !> `speed`: mean rate of change of the mechanisms' angle (rad/s). `u_dd`: acceleration of the frame's centre of mass minus
    !> gravity (m/s^2). `theta`: rotation vector theta, theta', theta'', shape (3, 0:2)
    real(dp), intent(in) :: speed, u_dd(:), theta(:, 0:)
    type(moved_type), intent(out) :: moved
    type(turn_type), intent(out) :: turn
    !> Lag chi of the drive (rad), mean of the frame's rate of rotation about the shaft (rad/s), torque of the motor (N m);
    !> required with a flywheel. Without this argument, chi is the component of the rotation vector along the shaft, and mean and
    !> torque are 0
    real(dp), intent(in), optional :: lag(:)
    real(dp) :: turning(3, 3, 0:2)

    turning = turning_matrices(theta)
    moved%rotation = rotation_matrix(theta(:, 0))
    moved%w = matmul(turning(:, :, 0), theta(:, 1))
    moved%w_d = matmul(turning(:, :, 0), theta(:, 2)) + matmul(turning(:, :, 1), theta(:, 1))
    moved%a = matmul(u_dd, moved%rotation)
    moved%spin = speed * drive%turns * drive%flywheel_inertia * drive%axis
    if (present(lag)) moved%spin = (speed * drive%turns + lag(2)) * drive%flywheel_inertia * drive%axis
    if (present(lag)) moved%motor = lag(3) * drive%axis
    call find_turn(drive, theta(:, 0), moved, turn, lag)
    if (drive%turns > 1) turn = turn_type(turn%chi / drive%turns, turn%b / drive%turns, turn%rate_turn / drive%turns, &
      & turn%gain_spin / drive%turns, turn%gain_turn / drive%turns, turn%bend / drive%turns)
    moved%rate = speed - turn%chi(1)
    moved%gain = -turn%chi(2)
  end subroutine follow_frame

  !> Computes the lag chi of the drive, and its derivatives, for a frame with the rotation vector theta and the motion `moved`.
  pure subroutine find_turn(drive, theta, moved, turn, lag)
    type(drive_type), intent(in) :: drive
    real(dp), intent(in) :: theta(:)
    type(moved_type), intent(in) :: moved
    type(turn_type), intent(out) :: turn
    real(dp), intent(in), optional :: lag(:)
    real(dp) :: e(3, 0:2), d(0:2), half, b(3, 0:2)

    if (.not. drive%uniform_in_space()) return
    associate (n => drive%axis, w => moved%w, w_d => moved%w_d)
      e(:, 0) = matmul(n, moved%rotation)
      e(:, 1) = cross(e(:, 0), w)
      e(:, 2) = cross(e(:, 1), w) + cross(e(:, 0), w_d)
      if (drive%held_by == "flywheel") then
        turn%b = n
        turn%chi = [dot_product(n, theta), dot_product(n, w), dot_product(n, w_d)]
        if (present(lag)) turn%chi(0) = lag(1)
        if (present(lag)) turn%chi(1) = turn%chi(1) - lag(2)
        ! dw = dalpha' + w x dalpha
        turn%rate_turn = cross(n, w)
        turn%gain_spin = cross(n, w)
        turn%gain_turn = cross(n, w_d)
        return
      end if
      d = [1 + dot_product(n, e(:, 0)), dot_product(n, e(:, 1)), dot_product(n, e(:, 2))]
      b(:, 0) = (n + e(:, 0)) / d(0)
      b(:, 1) = (e(:, 1) - b(:, 0) * d(1)) / d(0)
      b(:, 2) = (e(:, 2) - 2 * b(:, 1) * d(1) - b(:, 0) * d(2)) / d(0)
      half = norm2(theta) / 2
      ! tan(chi/2) = n theta tan(a/2)/a, a = |theta|
      turn%chi(0) = dot_product(n, theta)
      if (half > 0) turn%chi(0) = 2 * atan2(turn%chi(0) * sin(half) / (2 * half), cos(half))
      turn%chi(1) = dot_product(b(:, 0), w)
      turn%chi(2) = dot_product(b(:, 1), w) + dot_product(b(:, 0), w_d)
      turn%b = b(:, 0)
      turn%rate_turn = b(:, 1)
      turn%gain_spin = 2 * b(:, 1)
      turn%gain_turn = b(:, 2)
      ! de = e x dalpha
      turn%bend = cross_matrix(e(:, 0))
      turn%bend = (turn%bend - outer(b(:, 0), matmul(n, turn%bend))) / d(0)
    end associate
  end subroutine find_turn

  !> Computes the torque M_d on the shaft (N m) and its derivatives with respect to small displacements du and rotations dalpha of
  !> the frame and the rates of both. These rotations also turn the drive, by dphi = -dchi.
  pure subroutine find_torque(turn, moving, moved, torque, by_gain, by_rate, by_place)
    type(turn_type), intent(in) :: turn
    type(moving_type), intent(in) :: moving
    type(moved_type), intent(in) :: moved
    !> `torque`: M_d (N m). `by_gain`, `by_rate`, `by_place`: derivatives of M_d with respect to (du'', dalpha''), (du', dalpha')
    !> and (du, dalpha)
    real(dp), intent(out) :: torque, by_gain(6), by_rate(6), by_place(6)
    real(dp) :: spun(3), by_angle

    associate (s => moving%s, a => moving%a, k => moving%k, w => moved%w, w_d => moved%w_d, rate => moved%rate, gain => moved%gain)
      spun = matmul(moving%j(:, :, 1), w)
      torque = dot_product(moved%a, s(:, 1)) + dot_product(w_d, a(:, 0)) - dot_product(w, spun) / 2 + gain * k(0) &
        & + rate**2 * k(1) / 2
      by_angle = dot_product(moved%a, s(:, 2)) + dot_product(w_d, a(:, 1)) - dot_product(w, matmul(moving%j(:, :, 2), w)) / 2 &
        & + gain * k(1) + rate**2 * k(2) / 2
      by_gain(:3) = matmul(moved%rotation, s(:, 1))
      by_gain(4:) = a(:, 0) - k(0) * turn%b
      by_rate(:3) = 0
      by_rate(4:) = cross(a(:, 0), w) - spun - k(0) * turn%gain_spin - rate * k(1) * turn%b
      by_place(:3) = 0
      by_place(4:) = cross(a(:, 0), w_d) - cross(spun, w) + cross(s(:, 1), moved%a) &
        & - k(0) * turn%gain_turn - rate * k(1) * turn%rate_turn - by_angle * turn%b
    end associate
  end subroutine find_torque

  !> Adds the effect of a drive that turns uniformly relative to the ground. Relative to the frame its angle lags by chi, and its
  !> torque exerts no moment on the frame. The effect is added to the left sides r, shape (6), and to their derivatives, shape (6,
  !> 6): m = dr/d(du'', dalpha''), b = dr/d(du', dalpha') and c = dr/d(du, dalpha). Moments are along the frame's axes.
  pure subroutine add_drive(turn, moving, moved, r, m, b, c)
    type(turn_type), intent(in) :: turn
    type(moving_type), intent(in) :: moving
    type(moved_type), intent(in) :: moved
    !> Left sides r of the equations of motion and their derivatives m, b, c, to which the effect of the drive is added
    real(dp), intent(inout) :: r(6), m(6, 6), b(6, 6), c(6, 6)
    real(dp), dimension(6) :: of_gain, of_rate, of_angle, by_gain, by_rate, by_place, axis
    real(dp) :: torque
    real(dp), parameter :: none(3) = 0

    call find_torque(turn, moving, moved, torque, by_gain, by_rate, by_place)
    associate (s => moving%s, j => moving%j, a => moving%a, w => moved%w, w_d => moved%w_d, rate => moved%rate, gain => moved%gain)
      ! derivatives of the left sides with respect to phi'', phi' and phi
      of_gain = [matmul(moved%rotation, s(:, 1)), a(:, 0)]
      of_rate(:3) = matmul(moved%rotation, 2 * rate * s(:, 2) + 2 * cross(w, s(:, 1)))
      of_rate(4:) = matmul(j(:, :, 1), w) + 2 * rate * a(:, 1) + cross(w, a(:, 0))
      of_angle(:3) = matmul(moved%rotation, rate**2 * s(:, 3) + gain * s(:, 2) + 2 * rate * cross(w, s(:, 2)) &
        & + cross(w_d, s(:, 1)) + cross(w, cross(w, s(:, 1))))
      of_angle(4:) = matmul(j(:, :, 1), w_d) + rate * matmul(j(:, :, 2), w) + cross(w, matmul(j(:, :, 1), w)) &
        & + rate**2 * a(:, 2) + gain * a(:, 1) + rate * cross(w, a(:, 1)) + cross(s(:, 1), moved%a)
    end associate
    axis = [none, turn%b]
    r = r - torque * axis
    m = m - outer(of_gain, axis) - outer(axis, by_gain)
    b = b - outer(of_gain, [none, turn%gain_spin]) - outer(of_rate, axis) - outer(axis, by_rate)
    c = c - outer(of_gain, [none, turn%gain_turn]) - outer(of_rate, [none, turn%rate_turn]) - outer(of_angle, axis) &
      & - outer(axis, by_place)
    c(4:, 4:) = c(4:, 4:) - torque * turn%bend
  end subroutine add_drive

  !> Removes from the linearised equations with a flywheel their dependence on the past motion. With a flywheel dchi is n dalpha
  !> plus the integral of n (w x dalpha). The disturbed motion is therefore compared at the shifted time t + eta, where eta' = n (w
  !> x dalpha)/`spin`. Then dchi = n dalpha alone, dq' becomes dq' - eta' q', and dq'' becomes dq'' - 2 eta' q'' - eta'' q'. The
  !> shift of time does not change the multipliers.
  pure subroutine shift_time(turn, w_d, spin, turning, q, m, b, c)
    type(turn_type), intent(in) :: turn
    !> `w_d`: angular acceleration of the frame (rad/s^2). `spin`: constant spin of the shaft (rad/s). `turning`: the matrix T in
    !> dalpha = T dtheta with its derivatives T', T''. `q`: q, q', q'' in the order (u, theta), shape (6, 0:2). `m`: mass matrix
    real(dp), intent(in) :: w_d(3), spin, turning(3, 3, 0:2), q(6, 0:2), m(6, 6)
    real(dp), intent(inout) :: b(6, 6), c(6, 6)
    real(dp) :: shift(6, 0:1), moved(6)

    shift = 0
    shift(4:, 0) = matmul(turn%rate_turn, turning(:, :, 0)) / spin
    shift(4:, 1) = (matmul(cross(turn%b, w_d), turning(:, :, 0)) + matmul(turn%rate_turn, turning(:, :, 1))) / spin
    moved = matmul(m, q(:, 1))
    c = c - outer(2 * matmul(m, q(:, 2)) + matmul(b, q(:, 1)), shift(:, 0)) - outer(moved, shift(:, 1))
    b = b - outer(moved, shift(:, 0))
  end subroutine shift_time

end module gestell_model_space_drive
