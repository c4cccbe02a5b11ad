!> Data of a machine: a linkage of ground joints, one crank, dyads and rigid points on an elastically mounted frame.
!> Numbers are double precision, taken as exact by the other modules of the reference.
module reference_machine
  use, intrinsic :: iso_fortran_env, only: dp => real64
  use reference_linear, only: qp
  implicit none (type, external)
  private

  public :: dp, joint_data, link_data, support_data, machine_data
  public :: khang_machine, crank_speed, period

  real(qp), parameter, public :: pi_qp = 3.14159265358979323846264338327950288419716939937510_qp

  !> A joint S; joints are numbered in their order, and one uses only earlier ones.
  !>
  !>   ground  at `position`
  !>   crank   about ends(1) with `radius`, at the crank angle plus `phase_deg`
  !>   RRR     at lengths(1) from ends(1), lengths(2) from ends(2); branch 1: left of the way from ends(1) to ends(2)
  !>   RRP     on the guide, at lengths(1) from ends(1); branch 1: the solution farther along the guide
  !>   RPR     at lengths(1) from ends(2), branch 1: toward ends(1), -1: away from it
  !>   rigid   from ends(1) offset(1) along the direction to ends(2), offset(2) to the left of it
  !>   PRP     where the guide and the second guide meet
  !>   RPP     on the guide, where it is met by the slot: the line through ends(1), along the guide's direction turned
  !>           by `slot_angle_deg` counter-clockwise
  !>   follower on the guide, by the lift from its point: lift(1) + lift(2) cos + lift(3) sin + lift(4) cos 2 + ... of the
  !>           angle from the guide's direction to the way from ends(1) to ends(2), plus `phase_deg`
  !>   cylinder at lengths(1) from ends(1) and L from ends(2), branch as for RRR, or, if ends(1) = 0, at L along the guide;
  !>           L: the Fourier series `lift` of the crank angle plus `phase_deg`
  !>
  !> A guide is a directed line through `guide_point` at `guide_angle_deg`: in x-y, or, if the numbers of two joints
  !> stand in `guide` (P, Q), in the system with origin P and x-axis toward Q. The second guide in the same way.
  type :: joint_data
    character(len=8) :: kind = 'ground'
    integer :: ends(2) = 0
    real(dp) :: position(2) = 0    ! m
    real(dp) :: radius = 0         ! m
    real(dp) :: phase_deg = 0
    real(dp) :: lengths(2) = 0     ! m
    integer :: branch = 1          ! 1 or -1
    real(dp) :: offset(2) = 0      ! m
    integer :: guide(2) = 0        ! 0: the guide is fixed
    real(dp) :: guide_point(2) = 0 ! m
    real(dp) :: guide_angle_deg = 0
    integer :: guide2(2) = 0
    real(dp) :: guide2_point(2) = 0
    real(dp) :: guide2_angle_deg = 0
    real(dp) :: slot_angle_deg = 90
    real(dp) :: lift(7) = 0        ! m
  end type joint_data

  !> A body; its xi-axis points from joint `from` to joint `to`, whose distance may vary. to = 0: it translates with
  !> `from`, its axes parallel to x-y.
  type :: link_data
    integer :: from = 0, to = 0
    real(dp) :: mass = 0, inertia = 0, center(2) = 0
  end type link_data

  !> A spring-damper pair in the frame's system, along two axes turned by angle_deg, which stay in space or turn with the frame.
  type :: support_data
    real(dp) :: position(2) = 0, stiffness(2) = 0, damping(2) = 0, angle_deg = 0
    logical :: turning = .false.
  end type support_data

  type :: machine_data
    type(joint_data), allocatable :: joints(:)
    type(link_data), allocatable :: links(:)
    type(support_data), allocatable :: supports(:)
    real(dp) :: frame_mass = 0, frame_inertia = 0
    real(dp) :: origin(2) = 0      ! (xi_0, eta_0): the mechanism's origin O in the frame's system
    real(dp) :: foundation_stiffness(3, 3) = 0, foundation_damping(3) = 0
    logical :: free(3) = .true.    ! which of xi, eta, psi the frame can do
    real(dp) :: speed_rpm = 0      ! negative: clockwise
    real(dp) :: gravity(2) = 0     ! m/s^2 along xi and eta
    character(len=8) :: held_by = 'motor' ! or 'flywheel', 'outside': the crank turns evenly in space, not against the frame
  end type machine_data

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

end module reference_machine
