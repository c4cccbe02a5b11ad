!> Loads: the derivatives of their forces against difference quotients of the virtual work, in the plane and in space.
module test_loads
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_rotation, only: cross_matrix, rotation_matrix
  use gestell_math_series_piecewise, only: harmonics_of, interpolate, quadrature_nodes
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_load, only: ground_body, load_type
  use gestell_model_mechanism, only: load_sums_type
  use gestell_model_mechanism_loads, only: effect_of, load_effect_type
  use gestell_model_space_loads, only: add_loads, find_loads, load_torque, space_load_type
  use gestell_model_space_masses, only: plane_type
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_loads

  real(dp), parameter :: h = 1.0e-5_dp, rounding = 1.0e-8_dp

contains

  subroutine collect_loads(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("forces in the plane are the derivatives of the work, and c is their derivative", test_plane), &
      & new_unittest("forces and torque in space have the derivatives of difference quotients", test_space), &
      & new_unittest("splines reproduce smooth functions, lines their corners, to the known order", test_interpolation)]
  end subroutine collect_loads

  !> A slider-crank with loads of all kinds. `on` points: piston, rod, frame.
  subroutine make_linkage(linkage, failure)
    type(linkage_type), intent(out) :: linkage
    type(gestell_error), allocatable, intent(out) :: failure
    real(dp), parameter :: force(5) = [20.0_dp, 30.0_dp, 15.0_dp, 5.0_dp, -7.0_dp], moment(3) = [1.0_dp, 0.4_dp, 2.0_dp]
    type(load_type) :: loads(4)

    call linkage%ground("O", [0.02_dp, 0.01_dp], failure)
    if (.not. allocated(failure)) call linkage%crank("A", "O", 0.05_dp, 0.3_dp, failure)
    if (.not. allocated(failure)) call linkage%rrp("B", "A", 0.2_dp, guide_type(point=[0.01_dp, 0.0_dp], angle=1.3_dp), 1, failure)
    if (.not. allocated(failure)) call linkage%link("crank", "O", "A", 1.0_dp, 0.01_dp, [0.0_dp, 0.0_dp], failure)
    if (.not. allocated(failure)) call linkage%link("rod", "A", "B", 1.0_dp, 0.01_dp, [0.1_dp, 0.0_dp], failure)
    if (.not. allocated(failure)) call linkage%link("piston", "B", "", 1.0_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    if (allocated(failure)) return
    loads(1) = load_type("within", on=2, against=1, point=[0.05_dp, 0.02_dp, 0.0_dp], axes="link", angle=0.5_dp, force=force, &
      & moment=moment)
    loads(2) = load_type("fixed", on=2, against=ground_body, point=[0.1_dp, 0.03_dp, 0.0_dp], axes="ground", angle=3.5_dp, &
      & force=force, moment=moment)
    loads(3) = load_type("follows", on=2, against=ground_body, joint=3, axes="guide", guide=guide_type(angle=1.3_dp), &
      & angle=0.9_dp, force=force, moment=moment, phase=0.7_dp)
    loads(4) = load_type("shaker", against=ground_body, point=[0.2_dp, -0.1_dp, 0.05_dp], angle=2.0_dp, force=force, &
      & moment=moment, ratio=2)
    linkage%loads = loads
  end subroutine make_linkage

  !> The work of a load for a small rotation of the frame, the drive lagging by p dpsi, from the positions of its point. Then
  !> difference quotients of force and torque.
  subroutine test_plane(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: phi = 0.8_dp, psi = 0.4_dp, part = 0.5_dp, origin(2) = [0.3_dp, -0.2_dp]
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    type(load_effect_type) :: effect, ends(2)
    type(point_type) :: at(3)
    complex(dp) :: place(2), f
    real(dp) :: worked, angle(2)
    integer :: k

    call make_linkage(linkage, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    effect = at_turn(psi)
    ends = [at_turn(psi - h), at_turn(psi + h)]
    call check_that(error, maxval(abs((ends(2)%force - ends(1)%force) / (2 * h) - effect%force_psi)), "<", 100 * rounding, "c")
    if (allocated(error)) return
    call check_that(error, abs((ends(2)%torque - ends(1)%torque) / (2 * h) - effect%torque_psi), "<", 100 * rounding, "torque")
    if (allocated(error)) return
    ! The work of the force fixed in space, alone: its point in space, and the angle of the rod.
    linkage%loads = linkage%loads(2:2)
    effect = at_turn(psi)
    do k = 1, 2
      associate (turned => psi + merge(-h, h, k == 1))
        call linkage%points(phi - part * (turned - psi), at)
        f = cmplx(at(3)%x%v - at(2)%x%v, at(3)%y%v - at(2)%y%v, dp) / 0.2_dp
        angle(k) = atan2(aimag(f), real(f)) + turned
        place(k) = exp((0.0_dp, 1.0_dp) * turned) * (cmplx(origin(1) + at(2)%x%v, origin(2) + at(2)%y%v, dp) &
          & + f * (0.1_dp, 0.03_dp))
      end associate
    end do
    f = cmplx(effect%force(1), effect%force(2), dp)
    worked = (real(conjg(f) * (place(2) - place(1))) + (1 + 0.4_dp * cos(phi) + 2 * sin(phi)) * (angle(2) - angle(1))) / (2 * h)
    call check_that(error, abs(worked - effect%force(3)), "<", 100 * rounding, "work")

  contains

    !> Effect at a rotation of the frame at constant time.
    type(load_effect_type) function at_turn(turned)
      real(dp), intent(in) :: turned
      type(load_sums_type) :: sums(1)

      call linkage%sum_loads([phi - part * (turned - psi)], origin, sums)
      at_turn = effect_of(sums(1), exp((0.0_dp, 1.0_dp) * turned), part)
    end function at_turn

  end subroutine test_plane

  subroutine test_space(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: phi = 0.8_dp, theta(3) = [0.4_dp, -0.3_dp, 0.6_dp]
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure
    type(plane_type) :: planes(1)
    type(space_load_type) :: loads(4)
    real(dp), parameter :: b(3) = [0.2_dp, -0.5_dp, 0.7_dp]
    real(dp) :: bend(3, 3), r(6), c(6, 6), ends(6, 2), torque, by_turn(3), torques(2), unused(3), c_unused(6, 6), step(3)
    integer :: i, k

    call make_linkage(linkage, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    linkage%loads(4)%vector = [0.36_dp, 0.48_dp, 0.8_dp]
    linkage%loads(2)%z = 0.07_dp
    planes(1)%linkage = linkage
    planes(1)%axes = rotation_matrix([0.2_dp, 0.5_dp, -0.4_dp])
    planes(1)%origin = [0.1_dp, -0.2_dp, 0.3_dp]
    bend = cross_matrix([0.3_dp, 0.1_dp, -0.2_dp])
    call at_turn([0.0_dp, 0.0_dp, 0.0_dp], r, c, torque, by_turn)
    do i = 1, 3
      do k = 1, 2
        step = 0
        step(i) = merge(-h, h, k == 1)
        call at_turn(step, ends(:, k), c_unused, torques(k), unused)
      end do
      call check_that(error, maxval(abs((ends(:, 2) - ends(:, 1)) / (2 * h) - c(:, 3 + i))), "<", 100 * rounding, "c")
      if (allocated(error)) return
      call check_that(error, abs((torques(2) - torques(1)) / (2 * h) - by_turn(i)), "<", 100 * rounding, "torque")
      if (allocated(error)) return
    end do
    call check_that(error, maxval(abs(c(:, :3))), "<", rounding, "displacements")

  contains

    !> Effect after a small rotation of the frame about the fixed axes.
    subroutine at_turn(alpha, left, change, torque, by_turn)
      real(dp), intent(in) :: alpha(3)
      real(dp), intent(out) :: left(6), change(6, 6), torque, by_turn(3)
      real(dp) :: rotation(3, 3), turned(3)

      turned = b + matmul(bend, alpha)
      rotation = matmul(rotation_matrix(alpha), rotation_matrix(theta))
      call find_loads(planes, phi - dot_product(b, alpha), loads)
      left = 0
      change = 0
      call add_loads(loads, turned, bend, rotation, left, change)
      call load_torque(loads, turned, rotation, torque, by_turn)
    end subroutine at_turn

  end subroutine test_space

  !> Through n unequal points of exp(cos x), a spline errs by O(h^4). The coefficients are I_0(1) and 2 I_k(1); those of a
  !> triangle, 4/(pi k)^2 for odd k.
  subroutine test_interpolation(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: bessel(0:3) = [1.2660658777520084_dp, 1.1303182079849701_dp, 0.27149533953407656_dp, &
      & 0.044336849848663804_dp]
    real(dp), allocatable :: x(:), nodes(:), weights(:)
    real(dp) :: c(13), miss(2)
    integer :: i, k, n

    do i = 1, 2
      n = 20 * i
      x = [(2 * pi * (k + 0.2_dp * sin(2 * pi * k / n) + 0.3_dp) / n, k = 0, n - 1)]
      call quadrature_nodes(x, 6, nodes, weights)
      c = harmonics_of(interpolate(x, exp(cos(x)), nodes, .false.), nodes, weights, 6)
      miss(i) = maxval(abs([c(1) - bessel(0), c(2:6:2) - bessel(1:)]))
    end do
    call check_that(error, miss(2), "<", miss(1) / 12, "order 4")
    if (.not. allocated(error)) call check_that(error, miss(2), "<", 1.0e-5_dp, "spline")
    if (allocated(error)) return
    call quadrature_nodes([0.0_dp, pi], 6, nodes, weights)
    c = harmonics_of(interpolate([0.0_dp, pi], [1.0_dp, -1.0_dp], nodes, .true.), nodes, weights, 6)
    call check_that(error, maxval(abs(c(2::4) - [(8 / (pi * k)**2, k = 1, 5, 2)])), "<", 1.0e-14_dp, "triangle")
  end subroutine test_interpolation

end module test_loads
