!> Reference kinematics of a linkage and its mass functions (4)-(7), in quadruple precision.
!> All derivatives are with respect to the crank angle.
module reference_linkage
  use reference_joints, only: body_axis, carried, left, place_joint
  use reference_linear, only: qp
  use reference_machine, only: link_data, machine_data
  implicit none (type, external)
  private

  public :: motion_type, mass_functions_type
  public :: move, mass_functions

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

  !> Joints, centres of mass and turning of the links at the crank angle Omega t = angle (rad; the crank's phase is
  !> added here). margin: the smallest of all joints (see place_joint) and links; where it is 0 the linkage cannot be
  !> assembled and the motion is void. Without that argument: error stop there.
  function move(machine, angle, margin) result(motion)
    type(machine_data), intent(in) :: machine
    real(qp), intent(in) :: angle
    real(qp), intent(out), optional :: margin
    type(motion_type) :: motion
    real(qp) :: scale, least, one
    integer :: k

    allocate (motion%joint(2, 0:2, size(machine%joints)), motion%center(2, 0:2, size(machine%links)))
    allocate (motion%turn(2, size(machine%links)))
    motion%joint = 0
    motion%center = 0
    motion%turn = 0
    scale = maxval(machine%joints%radius)
    ! a mechanism without a crank
    if (.not. scale > 0) scale = 1
    least = 1
    do k = 1, size(machine%joints)
      call place_joint(machine%joints(k), angle, scale, motion%joint(:, :, :k - 1), motion%joint(:, :, k), one)
      least = min(least, one)
      if (.not. least > 0) exit
    end do
    if (least > 0) then
      do k = 1, size(machine%links)
        call carry(machine%links(k), scale, motion%joint, motion%center(:, :, k), motion%turn(:, k), one)
        least = min(least, one)
      end do
    end if
    if (present(margin)) then
      margin = least
    else if (.not. least > 0) then
      error stop "reference_linkage: the linkage cannot be assembled"
    end if
  end function move

  !> Centre of mass and turning of a link: its direction e turns with e' = w left(e), e'' = w' left(e) - w^2 e.
  subroutine carry(link, scale, joint, center, turn, margin)
    type(link_data), intent(in) :: link
    real(qp), intent(in) :: scale, joint(:, 0:, :)
    real(qp), intent(out) :: center(2, 0:2), turn(2), margin
    real(qp) :: e(2, 0:2)

    call body_axis(joint, link%from, link%to, scale, e, margin)
    center = carried(link%center*1.0_qp, joint(:, :, link%from), e)
    turn = [dot_product(left(e(:, 0)), e(:, 1)), dot_product(left(e(:, 0)), e(:, 2))]
  end subroutine carry

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

end module reference_linkage
