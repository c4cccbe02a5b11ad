!> Reference kinematics of a linkage of ground joints, one crank and RRR dyads, in quadruple precision.
!> Data are double precision numbers taken as exact. All derivatives are with respect to the crank angle; those of a
!> dyad's joint solve the differentiated closure equations, they are not derivatives of a formula for the position.
module reference_four_bar
  use, intrinsic :: iso_fortran_env, only: dp => real64
  use reference_linear, only: qp
  implicit none (type, external)
  private

  public :: dp, joint_data, link_data, support_data, machine_data
  public :: motion_type, mass_functions_type
  public :: khang_machine, crank_speed, period, move, mass_functions

  real(qp), parameter, public :: pi_qp = 3.14159265358979323846264338327950288419716939937510_qp

  !> A joint; `ends` are the numbers of earlier joints (crank: the first is the pivot).
  type :: joint_data
    character(len=6) :: kind = 'ground' ! 'ground', 'crank' or 'RRR'
    integer :: ends(2) = 0
    real(dp) :: position(2) = 0    ! ground, m
    real(dp) :: radius = 0         ! crank, m
    real(dp) :: phase_deg = 0      ! crank
    real(dp) :: lengths(2) = 0     ! RRR, m
    integer :: branch = 1          ! RRR: +1 left, -1 right of the way from ends(1) to ends(2)
  end type joint_data

  !> A body; its xi-axis points from joint `from` to joint `to`. to = 0: it translates with `from`, its axes parallel
  !> to x-y.
  type :: link_data
    integer :: from = 0, to = 0
    real(dp) :: mass = 0, inertia = 0, center(2) = 0
  end type link_data

  !> A spring-damper pair in the frame's system, along two axes turned by angle_deg.
  type :: support_data
    real(dp) :: position(2) = 0, stiffness(2) = 0, damping(2) = 0, angle_deg = 0
  end type support_data

  type :: machine_data
    type(joint_data), allocatable :: joints(:)
    type(link_data), allocatable :: links(:)
    type(support_data), allocatable :: supports(:)
    real(dp) :: frame_mass = 0, frame_inertia = 0
    real(dp) :: origin(2) = 0      ! (xi_0, eta_0): the mechanism's origin O in the frame's system
    real(dp) :: foundation_stiffness(3, 3) = 0, foundation_damping(3) = 0
    real(dp) :: speed_rpm = 0      ! negative: clockwise
  end type machine_data

  !> Motion at one crank angle; the index 0:2 is the order of the derivative with respect to the crank angle.
  type :: motion_type
    real(qp), allocatable :: joint(:, :, :)   ! (x-y, 0:2, joint)
    real(qp), allocatable :: center(:, :, :)  ! (x-y, 0:2, link), centres of mass
    real(qp), allocatable :: turn(:, :)       ! (1:2, link), derivatives of phi_i
  end type motion_type

  !> (4)-(7) and their derivatives with respect to the crank angle; in time a derivative of order k gains Omega^k.
  type :: mass_functions_type
    real(qp) :: a1(0:2) = 0, a2(0:2) = 0, a3(0:2) = 0
    real(qp) :: a4 = 0             ! the paper's a4 is Omega^2 times this
    real(qp) :: mass = 0, inertia = 0 ! m_G and the sum of the J_i
  end type mass_functions_type

contains

  !> The paper's machine (Table 1 and what was recovered of Bild 2). With the mass factor 10 its links are ten times
  !> heavier (masses and inertias).
  function khang_machine(speed_rpm, mass_factor) result(machine)
    real(dp), intent(in) :: speed_rpm
    real(dp), intent(in), optional :: mass_factor
    type(machine_data) :: machine
    real(dp), parameter :: along(4) = [-0.30_dp, -0.10_dp, 0.10_dp, 0.30_dp]
    integer :: i

    machine%speed_rpm = speed_rpm
    allocate (machine%joints(4), machine%links(3), machine%supports(4))
    machine%joints(1) = joint_data('ground', position=[0.0_dp, 0.0_dp])
    machine%joints(2) = joint_data('ground', position=[0.40_dp, 0.0_dp])
    machine%joints(3) = joint_data('crank', ends=[1, 0], radius=0.07_dp)
    machine%joints(4) = joint_data('RRR', ends=[3, 2], lengths=[0.37_dp, 0.16_dp], branch=1)
    machine%links(1) = link_data(1, 3, 0.50_dp, 0.0035_dp, [0.03_dp, 0.0_dp])
    machine%links(2) = link_data(3, 4, 0.60_dp, 0.0070_dp, [0.18_dp, 0.0_dp])
    machine%links(3) = link_data(2, 4, 0.25_dp, 0.0060_dp, [0.08_dp, 0.0_dp])
    if (present(mass_factor)) then
      machine%links%mass = machine%links%mass*mass_factor
      machine%links%inertia = machine%links%inertia*mass_factor
    end if
    machine%frame_mass = 18.0_dp
    machine%frame_inertia = 0.78_dp
    machine%origin = [-0.20_dp, 0.20_dp]
    do i = 1, 4
      machine%supports(i)%position = [along(i), -0.20_dp]
      machine%supports(i)%stiffness = 196133.0_dp
    end do
    machine%foundation_damping = [0.5_dp, 0.5_dp, 0.05_dp]
  end function khang_machine

  !> Omega in rad/s, with the sign of the speed.
  function crank_speed(machine) result(omega)
    type(machine_data), intent(in) :: machine
    real(qp) :: omega

    omega = machine%speed_rpm*pi_qp/30
  end function crank_speed

  !> T = 2 pi/|Omega| in s.
  function period(machine) result(t)
    type(machine_data), intent(in) :: machine
    real(qp) :: t

    t = 60/abs(real(machine%speed_rpm, qp))
  end function period

  !> Joints, centres of mass and turning of the links at the crank angle Omega t = angle (rad; the crank's phase is
  !> added here). error stop where a dyad cannot be assembled.
  function move(machine, angle) result(motion)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: angle
    type(motion_type) :: motion
    integer :: k

    allocate (motion%joint(2, 0:2, size(machine%joints)), motion%center(2, 0:2, size(machine%links)))
    allocate (motion%turn(2, size(machine%links)))
    do k = 1, size(machine%joints)
      associate (joint => machine%joints(k), p => motion%joint)
        select case (joint%kind)
        case ('ground')
          p(:, 0, k) = joint%position
          p(:, 1:2, k) = 0
        case ('crank')
          call turn_crank(joint, angle, p(:, :, joint%ends(1)), p(:, :, k))
        case ('RRR')
          call close_dyad(joint, p(:, :, joint%ends(1)), p(:, :, joint%ends(2)), p(:, :, k))
        case default
          error stop "reference_four_bar: unknown kind of joint"
        end select
      end associate
    end do
    do k = 1, size(machine%links)
      call carry(machine%links(k), motion%joint, motion%center(:, :, k), motion%turn(:, k))
    end do
  end function move

  subroutine turn_crank(joint, angle, pivot, p)
    type(joint_data), intent(in) :: joint
    real(qp), intent(in) :: angle, pivot(2, 0:2)
    real(qp), intent(out) :: p(2, 0:2)
    real(qp) :: arm(2), total

    total = angle + joint%phase_deg*pi_qp/180
    arm = joint%radius*[cos(total), sin(total)]
    p(:, 0) = pivot(:, 0) + arm
    p(:, 1) = pivot(:, 1) + left(arm)
    p(:, 2) = pivot(:, 2) - arm
  end subroutine turn_crank

  !> Position: the intersection of two circles. Then, with u = p - a, v = p - b for the two ends a, b, the closure
  !> u.u = l1^2, v.v = l2^2, differentiated once and twice, gives linear equations for p' and p'':
  !>   u.(p' - a') = 0,                 v.(p' - b') = 0,
  !>   u.(p'' - a'') = -|p' - a'|^2,    v.(p'' - b'') = -|p' - b'|^2.
  subroutine close_dyad(joint, a, b, p)
    type(joint_data), intent(in) :: joint
    real(qp), intent(in) :: a(2, 0:2), b(2, 0:2)
    real(qp), intent(out) :: p(2, 0:2)
    real(qp) :: l1, l2, way(2), distance, along, across_squared, u(2), v(2)

    l1 = joint%lengths(1)
    l2 = joint%lengths(2)
    way = b(:, 0) - a(:, 0)
    distance = norm2(way)
    along = ((l1 - l2)*(l1 + l2)/distance + distance)/2
    across_squared = (l1 - along)*(l1 + along)
    if (.not. across_squared > 0) error stop "reference_four_bar: the dyad cannot be assembled"
    p(:, 0) = a(:, 0) + (along*way + joint%branch*sqrt(across_squared)*left(way))/distance
    u = p(:, 0) - a(:, 0)
    v = p(:, 0) - b(:, 0)
    p(:, 1) = by_projections(u, v, dot_product(u, a(:, 1)), dot_product(v, b(:, 1)))
    p(:, 2) = by_projections(u, v, dot_product(u, a(:, 2)) - sum((p(:, 1) - a(:, 1))**2), &
      & dot_product(v, b(:, 2)) - sum((p(:, 1) - b(:, 1))**2))
  end subroutine close_dyad

  !> The vector w with u.w = along_u and v.w = along_v.
  function by_projections(u, v, along_u, along_v) result(w)
    real(qp), intent(in) :: u(2), v(2), along_u, along_v
    real(qp) :: w(2)

    w = [along_u*v(2) - along_v*u(2), along_v*u(1) - along_u*v(1)]/(u(1)*v(2) - u(2)*v(1))
  end function by_projections

  !> Centre of mass and turning of a link: its direction e turns with e' = w left(e); of u = |u| e the part
  !> of u' across e is |u| w, that of u'' is |u| w'.
  subroutine carry(link, joint, center, turn)
    type(link_data), intent(in) :: link
    real(qp), intent(in) :: joint(:, 0:, :)
    real(qp), intent(out) :: center(2, 0:2), turn(2)
    real(qp) :: u(2, 0:2), e(2), length, arm(2)

    e = [1, 0]
    turn = 0
    if (link%to /= 0) then
      u = joint(:, :, link%to) - joint(:, :, link%from)
      length = norm2(u(:, 0))
      e = u(:, 0)/length
      turn = [dot_product(left(e), u(:, 1)), dot_product(left(e), u(:, 2))]/length
    end if
    arm = link%center(1)*e + link%center(2)*left(e)
    center(:, 0) = joint(:, 0, link%from) + arm
    center(:, 1) = joint(:, 1, link%from) + turn(1)*left(arm)
    center(:, 2) = joint(:, 2, link%from) + turn(2)*left(arm) - turn(1)**2*arm
  end subroutine carry

  pure function left(u) result(w)
    real(qp), intent(in) :: u(2)
    real(qp) :: w(2)

    w = [-u(2), u(1)]
  end function left

  !> (4)-(7) with derivatives at the crank angle Omega t = angle.
  function mass_functions(machine, angle) result(a)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: angle
    type(mass_functions_type) :: a
    type(motion_type) :: motion
    real(qp) :: r(2, 0:2), m, inertia
    integer :: i

    motion = move(machine, angle)
    do i = 1, size(machine%links)
      m = machine%links(i)%mass
      inertia = machine%links(i)%inertia
      r = motion%center(:, :, i)
      a%mass = a%mass + m
      a%inertia = a%inertia + inertia
      a%a1 = a%a1 + m*r(1, :)
      a%a2 = a%a2 + m*r(2, :)
      a%a3(0) = a%a3(0) + m*sum(r(:, 0)**2)
      a%a3(1) = a%a3(1) + 2*m*dot_product(r(:, 0), r(:, 1))
      a%a3(2) = a%a3(2) + 2*m*(sum(r(:, 1)**2) + dot_product(r(:, 0), r(:, 2)))
      a%a4 = a%a4 + m*(r(1, 0)*r(2, 2) - r(2, 0)*r(1, 2)) + inertia*motion%turn(2, i)
    end do
  end function mass_functions

end module reference_four_bar
