!> Reference kinematics of the single joint, in quadruple precision.
!> A vector that moves is given as (x-y, 0:2), 0:2 the order of the derivative with respect to the crank angle. The
!> position of a joint comes from geometry; its derivatives solve the closure equations, differentiated once and
!> twice, which are linear in them. They are not derivatives of a formula for the position.
module reference_joints
  use reference_linear, only: qp
  use reference_machine, only: dp, joint_data, pi_qp
  implicit none (type, external)
  private

  public :: place_joint, body_axis, carried, left

contains

  !> The joint s at a crank angle (rad), p(:, :, k) being the earlier joints. margin: how far it is from a dead point,
  !> in [0, 1]: sine of the angle between the two lines whose closure equations hold it, and where a direction is
  !> taken from two joints, their distance over `scale` (m, the crank's radius). 0: it cannot be assembled, s is void.
  subroutine place_joint(joint, angle, scale, p, s, margin)
    type(joint_data), intent(in) :: joint
    real(qp), intent(in) :: angle, scale, p(:, 0:, :)
    real(qp), intent(out) :: s(2, 0:2), margin
    real(qp), dimension(2, 0:2) :: g, u, g2, u2
    real(qp) :: margin2, lift(0:2)

    s = 0
    margin = 1
    select case (joint%kind)
    case ('ground')
      s(:, 0) = joint%position
    case ('crank')
      call turn_crank(joint, angle, p(:, :, joint%ends(1)), s)
    case ('RRR')
      call meet_circles(joint, p(:, :, joint%ends(1)), p(:, :, joint%ends(2)), s, margin)
    case ('RRP')
      call guide_of(joint%guide, joint%guide_point*1.0_qp, joint%guide_angle_deg*1.0_qp, scale, p, g, u, margin2)
      call meet_line_and_circle(joint, p(:, :, joint%ends(1)), g, u, s, margin)
      margin = min(margin, margin2)
    case ('RPR')
      call body_axis(p, joint%ends(2), joint%ends(1), scale, u, margin)
      s = p(:, :, joint%ends(2)) + joint%branch*joint%lengths(1)*u
    case ('rigid')
      call body_axis(p, joint%ends(1), joint%ends(2), scale, u, margin)
      s = carried(joint%offset*1.0_qp, p(:, :, joint%ends(1)), u)
    case ('PRP')
      call guide_of(joint%guide, joint%guide_point*1.0_qp, joint%guide_angle_deg*1.0_qp, scale, p, g, u, margin)
      call guide_of(joint%guide2, joint%guide2_point*1.0_qp, joint%guide2_angle_deg*1.0_qp, scale, p, g2, u2, margin2)
      margin = min(margin, margin2)
      call meet_lines(g, u, g2, u2, s, margin2)
      margin = min(margin, margin2)
    case ('RPP')
      call guide_of(joint%guide, joint%guide_point*1.0_qp, joint%guide_angle_deg*1.0_qp, scale, p, g, u, margin2)
      call meet_lines(g, u, p(:, :, joint%ends(1)), turned(u, joint%slot_angle_deg*1.0_qp), s, margin)
      margin = min(margin, margin2)
    case ('cylinder')
      lift = harmonics(joint%lift, [angle + joint%phase_deg*pi_qp/180, 1.0_qp, 0.0_qp])
      if (joint%ends(1) > 0) then
        call meet_circles(joint, p(:, :, joint%ends(1)), p(:, :, joint%ends(2)), s, margin, lift)
      else
        call guide_of(joint%guide, joint%guide_point*1.0_qp, joint%guide_angle_deg*1.0_qp, scale, p, g, u, margin)
        s = slid(lift, g, u)
      end if
    case ('follower')
      call guide_of(joint%guide, joint%guide_point*1.0_qp, joint%guide_angle_deg*1.0_qp, scale, p, g, u, margin)
      call body_axis(p, joint%ends(1), joint%ends(2), scale, u2, margin2)
      margin = min(margin, margin2)
      s = lifted(joint, g, u, u2)
    case default
      error stop "reference_joints: unknown kind of joint"
    end select
  end subroutine place_joint

  subroutine turn_crank(joint, angle, pivot, s)
    type(joint_data), intent(in) :: joint
    real(qp), intent(in) :: angle, pivot(2, 0:2)
    real(qp), intent(out) :: s(2, 0:2)
    real(qp) :: arm(2), total

    total = angle + joint%phase_deg*pi_qp/180
    arm = joint%radius*[cos(total), sin(total)]
    s(:, 0) = pivot(:, 0) + arm
    s(:, 1) = pivot(:, 1) + left(arm)
    s(:, 2) = pivot(:, 2) - arm
  end subroutine turn_crank

  !> RRR: |s - a| = l1, |s - b| = l2; `length`: l2 with its derivatives, if it changes.
  subroutine meet_circles(joint, a, b, s, margin, length)
    type(joint_data), intent(in) :: joint
    real(qp), intent(in) :: a(2, 0:2), b(2, 0:2)
    real(qp), intent(out) :: s(2, 0:2), margin
    real(qp), intent(in), optional :: length(0:2)
    real(qp) :: l1, l2, way(2), distance, along, across_squared, d1(2), d2(2), growth(2)
    integer :: k

    s = 0
    margin = 0
    l1 = joint%lengths(1)
    l2 = joint%lengths(2)
    growth = 0
    if (present(length)) then
      l2 = length(0)
      growth = [length(0)*length(1), length(1)**2 + length(0)*length(2)]
    end if
    way = b(:, 0) - a(:, 0)
    distance = norm2(way)
    if (.not. distance > 0) return
    along = ((l1 - l2)*(l1 + l2)/distance + distance)/2
    across_squared = (l1 - along)*(l1 + along)
    if (.not. across_squared > 0) return
    s(:, 0) = a(:, 0) + (along*way + joint%branch*sqrt(across_squared)*left(way))/distance
    d1 = s(:, 0) - a(:, 0)
    d2 = s(:, 0) - b(:, 0)
    margin = abs(cross(d1, d2))/(l1*l2)
    do k = 1, 2
      s(:, k) = by_projections(d1, d2, on_circle(a, s, k), on_circle(b, s, k) + growth(k))
    end do
  end subroutine meet_circles

  !> RRP: n.(s - g) = 0 with n across the line, |s - a| = l.
  subroutine meet_line_and_circle(joint, a, g, u, s, margin)
    type(joint_data), intent(in) :: joint
    real(qp), intent(in) :: a(2, 0:2), g(2, 0:2), u(2, 0:2)
    real(qp), intent(out) :: s(2, 0:2), margin
    real(qp) :: l, way(2), across, root_squared, d(2)
    integer :: k

    s = 0
    margin = 0
    l = joint%lengths(1)
    way = a(:, 0) - g(:, 0)
    across = cross(u(:, 0), way)
    root_squared = (l - across)*(l + across)
    if (.not. root_squared > 0) return
    s(:, 0) = g(:, 0) + (dot_product(u(:, 0), way) + joint%branch*sqrt(root_squared))*u(:, 0)
    d = s(:, 0) - a(:, 0)
    margin = abs(dot_product(d, u(:, 0)))/l
    do k = 1, 2
      s(:, k) = by_projections(left(u(:, 0)), d, on_line(g, u, s, k), on_circle(a, s, k))
    end do
  end subroutine meet_line_and_circle

  !> PRP and RPP: n.(s - g) = 0 for two lines through g and h along u and w.
  subroutine meet_lines(g, u, h, w, s, margin)
    real(qp), dimension(2, 0:2), intent(in) :: g, u, h, w
    real(qp), intent(out) :: s(2, 0:2), margin
    integer :: k

    s = 0
    margin = abs(cross(u(:, 0), w(:, 0)))
    if (.not. margin > 0) return
    do k = 0, 2
      s(:, k) = by_projections(left(u(:, 0)), left(w(:, 0)), on_line(g, u, s, k), on_line(h, w, s, k))
    end do
  end subroutine meet_lines

  !> Follower: s = g + L u, L(theta) along the guide; theta from u to the cam's axis e turns by e x e' - u x u'.
  pure function lifted(joint, g, u, e) result(s)
    type(joint_data), intent(in) :: joint
    real(qp), dimension(2, 0:2), intent(in) :: g, u, e
    real(qp) :: s(2, 0:2), theta(0:2)
    integer :: k

    theta(0) = atan2(cross(u(:, 0), e(:, 0)), dot_product(u(:, 0), e(:, 0))) + joint%phase_deg*pi_qp/180
    theta(1:2) = [(cross(e(:, 0), e(:, k)) - cross(u(:, 0), u(:, k)), k = 1, 2)]
    s = slid(harmonics(joint%lift, theta), g, u)
  end function lifted

  !> Fourier series of an angle theta, with two derivatives.
  pure function harmonics(coefficients, theta) result(lift)
    real(dp), intent(in) :: coefficients(:)
    real(qp), intent(in) :: theta(0:2)
    real(qp) :: lift(0:2)
    integer :: k

    lift = [coefficients(1)*1.0_qp, 0.0_qp, 0.0_qp]
    do k = 1, (size(coefficients) - 1)/2
      associate (c => coefficients(2*k)*cos(k*theta(0)), d => coefficients(2*k)*sin(k*theta(0)), &
        & p => coefficients(2*k + 1)*sin(k*theta(0)), q => coefficients(2*k + 1)*cos(k*theta(0)))
        lift = lift + [c + p, k*(q - d)*theta(1), k*(q - d)*theta(2) - k**2*(c + p)*theta(1)**2]
      end associate
    end do
  end function harmonics

  !> The point at the distance `lift` along a line.
  pure function slid(lift, g, u) result(s)
    real(qp), intent(in) :: lift(0:2), g(2, 0:2), u(2, 0:2)
    real(qp) :: s(2, 0:2)

    s(:, 0) = g(:, 0) + lift(0)*u(:, 0)
    s(:, 1) = g(:, 1) + lift(0)*u(:, 1) + lift(1)*u(:, 0)
    s(:, 2) = g(:, 2) + lift(0)*u(:, 2) + 2*lift(1)*u(:, 1) + lift(2)*u(:, 0)
  end function slid

  !> Unit vector e from joint `from` toward joint `to`; the x-axis if to = 0. With the way r between them its closure
  !> is e.e = 1 and left(r).e = 0, hence e.e' = 0, left(r).e' = -left(r').e, and so on; |r| may vary.
  subroutine body_axis(p, from, to, scale, e, margin)
    real(qp), intent(in) :: p(:, 0:, :), scale
    integer, intent(in) :: from, to
    real(qp), intent(out) :: e(2, 0:2), margin
    real(qp) :: r(2, 0:2), origin(2, 0:2), distance

    e = 0
    e(1, 0) = 1
    margin = 1
    if (to == 0) return
    r = p(:, :, to) - p(:, :, from)
    distance = norm2(r(:, 0))
    margin = min(1.0_qp, distance/scale)
    if (.not. distance > 0) return
    origin = 0
    e(:, 0) = r(:, 0)/distance
    e(:, 1) = by_projections(left(r(:, 0)), e(:, 0), on_line(origin, r, e, 1), on_circle(origin, e, 1))
    e(:, 2) = by_projections(left(r(:, 0)), e(:, 0), on_line(origin, r, e, 2), on_circle(origin, e, 2))
  end subroutine body_axis

  !> The guide through g along u, carried by two joints or fixed (carriers 0).
  subroutine guide_of(carriers, point, angle_deg, scale, p, g, u, margin)
    integer, intent(in) :: carriers(2)
    real(qp), intent(in) :: point(2), angle_deg, scale, p(:, 0:, :)
    real(qp), intent(out) :: g(2, 0:2), u(2, 0:2), margin
    real(qp) :: e(2, 0:2), origin(2, 0:2)

    call body_axis(p, carriers(1), carriers(2), scale, e, margin)
    origin = 0
    if (carriers(1) /= 0) origin = p(:, :, carriers(1))
    g = carried(point, origin, e)
    u = turned(e, angle_deg)
  end subroutine guide_of

  !> Required values of left(u).s^(k) for s to stay on the line through g along u: (left(u).(s - g))^(k) = 0, k = 0, 1, 2.
  pure function on_line(g, u, s, k) result(projection)
    real(qp), dimension(2, 0:2), intent(in) :: g, u, s
    integer, intent(in) :: k
    real(qp) :: projection

    projection = dot_product(left(u(:, 0)), g(:, k))
    if (k == 1) projection = projection - dot_product(left(u(:, 1)), s(:, 0) - g(:, 0))
    if (k == 2) projection = projection - 2*dot_product(left(u(:, 1)), s(:, 1) - g(:, 1)) &
      & - dot_product(left(u(:, 2)), s(:, 0) - g(:, 0))
  end function on_line

  !> Required values of (s - a).s^(k) for s to stay at its distance from a, k = 1, 2.
  pure function on_circle(a, s, k) result(projection)
    real(qp), dimension(2, 0:2), intent(in) :: a, s
    integer, intent(in) :: k
    real(qp) :: projection

    projection = dot_product(s(:, 0) - a(:, 0), a(:, k))
    if (k == 2) projection = projection - sum((s(:, 1) - a(:, 1))**2)
  end function on_circle

  !> The vector w with u.w = along_u and v.w = along_v.
  pure function by_projections(u, v, along_u, along_v) result(w)
    real(qp), intent(in) :: u(2), v(2), along_u, along_v
    real(qp) :: w(2)

    w = [along_u*v(2) - along_v*u(2), along_v*u(1) - along_u*v(1)]/cross(u, v)
  end function by_projections

  !> The point with the given coordinates in the system with this origin and the x-axis e.
  pure function carried(coordinates, origin, e) result(s)
    real(qp), intent(in) :: coordinates(2), origin(2, 0:2), e(2, 0:2)
    real(qp) :: s(2, 0:2)
    integer :: k

    do k = 0, 2
      s(:, k) = origin(:, k) + coordinates(1)*e(:, k) + coordinates(2)*left(e(:, k))
    end do
  end function carried

  !> u turned counter-clockwise by a constant angle.
  pure function turned(u, angle_deg) result(w)
    real(qp), intent(in) :: u(2, 0:2), angle_deg
    real(qp) :: w(2, 0:2)

    w = carried([cos(angle_deg*pi_qp/180), sin(angle_deg*pi_qp/180)], spread([0.0_qp, 0.0_qp], 2, 3), u)
  end function turned

  pure function left(u) result(w)
    real(qp), intent(in) :: u(2)
    real(qp) :: w(2)

    w = [-u(2), u(1)]
  end function left

  pure function cross(u, w) result(z)
    real(qp), intent(in) :: u(2), w(2)
    real(qp) :: z

    z = u(1)*w(2) - u(2)*w(1)
  end function cross

end module reference_joints
