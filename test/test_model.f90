!> Kinematics, assembly and the frame's matrices against the reference and against closed forms.
module test_model
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_math_jet, only: cos, jet, operator(*), operator(+), operator(-), operator(/), sin, sqrt
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: mass_functions_type
  use gestell_model_mounting, only: damping_matrix, stiffness_matrix, support_type
  use machines, only: frame_of_machine, linkage_of_machine
  use reference_cases, only: random_machine
  use reference_frame, only: frame_matrices, frame_of
  use reference_linear, only: qp
  use reference_linkage, only: reference_functions => mass_functions, &
    & reference_functions_type => mass_functions_type
  use reference_machine, only: khang_machine, machine_data
  use reference_newton, only: newton_orders
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_model

contains

  subroutine collect_model(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("derivatives of an expression by jets agree with differences", test_jets), &
      & new_unittest("a four-bar satisfies Freudenstein's equation and keeps its link lengths", test_freudenstein), &
      & new_unittest("angles, velocities and accelerations of a four-bar agree with Norton's book", test_published), &
      & new_unittest("a four-bar's derivatives agree with differences", test_differences), &
      & new_unittest("branch -1 is the mirror image of branch 1", test_branches), &
      & new_unittest("mass functions of random machines agree with the reference", test_mass_functions), &
      & new_unittest("M, B, C, h of random machines agree with the reference", test_matrices), &
      & new_unittest("the equations of motion agree with Newton's law to second order", test_newton), &
      & new_unittest("stiffness and damping of supports agree with the paper's formulas", test_supports), &
      & new_unittest("a subset of degrees of freedom selects the matching rows", test_freedoms), &
      & new_unittest("natural frequencies of a frame without mechanism agree with closed forms", test_frequencies), &
      & new_unittest("a balanced mechanism exerts no shaking force", test_balanced)]
  end subroutine collect_model

  subroutine test_jets(error)
    type(error_type), allocatable, intent(out) :: error
    type(jet) :: f, plus, minus
    real(dp), parameter :: h = 1.0e-3_dp, at = 0.7_dp

    f = expression(at)
    plus = expression(at + h)
    minus = expression(at - h)
    ! Central differences are right to h^2 times the third derivative, of size 1 here.
    call check(error, f%d, (plus%v - minus%v) / (2 * h), thr=1.0e-5_dp)
    if (allocated(error)) return
    call check(error, f%dd, (plus%d - minus%d) / (2 * h), thr=1.0e-5_dp)
    if (allocated(error)) return
    ! Their fifth derivative is some hundreds here.
    call check(error, f%ddd, (plus%dd - minus%dd) / (2 * h), thr=1.0e-3_dp)

  contains

    type(jet) function expression(t) result(f)
      real(dp), intent(in) :: t
      type(jet) :: x

      x = jet(t, 1.0_dp, 0.0_dp)
      f = sqrt(x * x + 2.0_dp) * cos(3.0_dp * x) / (sin(x) + 2.0_dp) - (-x) * (x - 0.3_dp) - cos(x * x)
    end function expression

  end subroutine test_jets

  subroutine paper_linkage(linkage, error, branch)
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: branch
    type(machine_data) :: machine
    type(gestell_error), allocatable :: failure

    machine = khang_machine(240.0_dp)
    if (present(branch)) machine%joints(4)%branch = branch
    call linkage_of_machine(machine, linkage, failure)
    call check_success(error, failure)
  end subroutine paper_linkage

  !> K1 cos psi - K2 cos phi + K3 = cos(phi - psi) for the angles of crank and rocker (F. Freudenstein, Trans. ASME 77,
  !> 1955, p. 853), K1 = d / a, K2 = d / c, K3 = (a^2 - b^2 + c^2 + d^2) / (2 a c).
  subroutine test_freudenstein(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: a = 0.07_dp, b = 0.37_dp, c = 0.16_dp, d = 0.40_dp
    type(linkage_type) :: linkage
    type(point_type) :: at(4)
    real(dp) :: phi, psi
    integer :: k

    call paper_linkage(linkage, error)
    if (allocated(error)) return
    do k = 0, 100
      phi = 2 * pi * k / 100
      call linkage%points(phi, at)
      psi = atan2(at(4)%y%v, at(4)%x%v - d)
      call check(error, d / a * cos(psi) - d / c * cos(phi) + (a**2 - b**2 + c**2 + d**2) / (2 * a * c), cos(phi - psi), &
        & thr=1.0e-13_dp, more="Freudenstein")
      if (allocated(error)) return
      call check(error, hypot(at(4)%x%v - at(3)%x%v, at(4)%y%v - at(3)%y%v), b, thr=1.0e-15_dp, more="coupler's length")
      if (allocated(error)) return
      call check(error, hypot(at(4)%x%v - d, at(4)%y%v), c, thr=1.0e-15_dp, more="rocker's length")
      if (allocated(error)) return
      call check_that(error, sin(psi), ">", 0.0_dp, "open branch")
      if (allocated(error)) return
    end do
  end subroutine test_freudenstein

  !> R. L. Norton, Design of Machinery, examples 4-1, 6-7 and 7-1: links 40, 120, 80, ground 100 mm, crank at 40 deg with
  !> 25 rad/s and 15 rad/s^2; open circuit: coupler 20.298 deg, -4.121 rad/s, 296.089 rad/s^2, rocker 57.325 deg,
  !> 6.998 rad/s, 470.134 rad/s^2; crossed: -60.98 and -98.01 deg (units of the last digit).
  subroutine test_published(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(5)
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: degree = pi / 180, speed = 25, acceleration = 15

    call linkage%ground("O2", [0.0_dp, 0.0_dp], failure)
    call linkage%ground("O4", [0.1_dp, 0.0_dp], failure)
    call linkage%crank("A", "O2", 0.04_dp, 0.0_dp, failure)
    call linkage%rrr("B", ["A ", "O4"], [0.12_dp, 0.08_dp], 1, failure)
    call linkage%rrr("C", ["A ", "O4"], [0.12_dp, 0.08_dp], -1, failure)
    call linkage%points(40 * degree, at)
    call compare(at(3), at(4), 20.298_dp, -4.121_dp, 296.089_dp)
    if (allocated(error)) return
    call compare(at(2), at(4), 57.325_dp, 6.998_dp, 470.134_dp)
    if (allocated(error)) return
    call check(error, atan2(at(5)%y%v - at(3)%y%v, at(5)%x%v - at(3)%x%v) / degree, -60.98_dp, thr=0.01_dp)
    if (allocated(error)) return
    call check(error, atan2(at(5)%y%v - at(2)%y%v, at(5)%x%v - at(2)%x%v) / degree, -98.01_dp, thr=0.01_dp)

  contains

    !> Angle (deg), velocity and acceleration of the link between two points.
    subroutine compare(from, to, angle, omega, alpha)
      type(point_type), intent(in) :: from, to
      real(dp), intent(in) :: angle, omega, alpha
      real(dp) :: ux, uy, length, rate, second

      ux = to%x%v - from%x%v
      uy = to%y%v - from%y%v
      length = hypot(ux, uy)
      rate = (ux * (to%y%d - from%y%d) - uy * (to%x%d - from%x%d)) / length**2
      second = (ux * (to%y%dd - from%y%dd) - uy * (to%x%dd - from%x%dd)) / length**2
      call check(error, atan2(uy, ux) / degree, angle, thr=1.0e-3_dp)
      if (allocated(error)) return
      call check(error, rate * speed, omega, thr=1.0e-3_dp)
      if (allocated(error)) return
      call check(error, second * speed**2 + rate * acceleration, alpha, thr=1.0e-3_dp)
    end subroutine compare

  end subroutine test_published

  subroutine test_differences(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(point_type) :: at(4), plus(4), minus(4)
    real(dp), parameter :: h = 1.0e-4_dp
    real(dp) :: phi
    integer :: k

    call paper_linkage(linkage, error)
    if (allocated(error)) return
    do k = 0, 50
      phi = 2 * pi * k / 50
      call linkage%points(phi, at)
      call linkage%points(phi + h, plus)
      call linkage%points(phi - h, minus)
      ! h^2 / 6 times a third derivative below 1 m.
      call check_that(error, maxval(abs(at%x%d - (plus%x%v - minus%x%v) / (2 * h))), "<", 2.0e-9_dp, "x'")
      call check_that(error, maxval(abs(at%y%d - (plus%y%v - minus%y%v) / (2 * h))), "<", 2.0e-9_dp, "y'")
      call check_that(error, maxval(abs(at%x%dd - (plus%x%d - minus%x%d) / (2 * h))), "<", 5.0e-9_dp, "x''")
      call check_that(error, maxval(abs(at%y%dd - (plus%y%d - minus%y%d) / (2 * h))), "<", 5.0e-9_dp, "y''")
      if (allocated(error)) return
    end do
  end subroutine test_differences

  !> One assembly is the mirror image of the other, mirrored at the ground line and run in reverse.
  subroutine test_branches(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: left, right
    type(point_type) :: at_left(4), at_right(4)
    integer :: k

    call paper_linkage(left, error)
    if (allocated(error)) return
    call paper_linkage(right, error, branch=-1)
    if (allocated(error)) return
    do k = 0, 20
      call left%points(0.3_dp * k, at_left)
      call right%points(-0.3_dp * k, at_right)
      call check_that(error, maxval(abs([at_left%x%v - at_right%x%v, at_left%y%v + at_right%y%v])), "<", 1.0e-15_dp, "mirrored")
      if (allocated(error)) return
    end do
  end subroutine test_branches

  subroutine test_mass_functions(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(linkage_type) :: linkage
    type(mass_functions_type) :: a
    type(reference_functions_type) :: r
    type(gestell_error), allocatable :: failure
    real(dp) :: angle, defect, size
    integer :: i, k

    do i = 1, 200
      machine = random_machine(i)
      call linkage_of_machine(machine, linkage, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      do k = 1, 5
        angle = 1.3_dp * k - 2
        call linkage%mass_functions(angle, a)
        r = reference_functions(machine, real(angle, qp))
        defect = real(maxval(abs([a%a1%v - r%a1(0), a%a2%v - r%a2(0), a%a3%v - r%a3(0), a%a1%d - r%a1(1), &
          & a%a2%d - r%a2(1), a%a3%d - r%a3(1), a%a1%dd - r%a1(2), a%a2%dd - r%a2(2), a%a4 - r%a4])), dp)
        size = real(maxval(abs([r%a1, r%a2, r%a3, r%a4])), dp)
        ! A transmission angle with cosine 0.95 amplifies the roundings of the second derivatives some hundredfold.
        call check_that(error, defect, "<=", 1.0e-12_dp * size, "equations")
        if (allocated(error)) return
        call check(error, linkage%mass, real(r%mass, dp), thr=1.0e-14_dp * linkage%mass)
        if (allocated(error)) return
        call check(error, linkage%inertia, real(r%inertia, dp), thr=1.0e-14_dp * linkage%inertia)
        if (allocated(error)) return
      end do
    end do
  end subroutine test_mass_functions

  subroutine test_matrices(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(qp) :: m_q(3, 3), b_q(3, 3), c_q(3, 3), h_q(3)
    real(dp) :: m(3, 3), b(3, 3), c(3, 3), h(3), t
    integer :: i, k

    do i = 1, 100
      machine = random_machine(i)
      call frame_of_machine(machine, frame, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      do k = 0, 3
        t = 0.27_dp * k * frame%period
        call frame%matrices(t, m, b, c)
        call frame%load(t, h)
        call frame_matrices(frame_of(machine), real(t, qp), m_q, b_q, c_q, h_q)
        ! As above, and the crank angle Omega t is rounded.
        call check_that(error, real(maxval(abs(m - m_q)), dp), "<=", 1.0e-12_dp * maxval(abs(m)), "M")
        call check_that(error, real(maxval(abs(b - b_q)), dp), "<=", 1.0e-11_dp * maxval(abs(b)), "B")
        call check_that(error, real(maxval(abs(c - c_q)), dp), "<=", 1.0e-11_dp * maxval(abs(c)), "C")
        call check_that(error, real(maxval(abs(h - h_q)), dp), "<=", 1.0e-11_dp * maxval(abs(h)), "h")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_matrices

  !> The reference's equations, with which the tests above compare ours, differ in second order from the fully nonlinear sums of
  !> all forces and moments.
  subroutine test_newton(error)
    type(error_type), allocatable, intent(out) :: error
    real(qp) :: orders(3, 2), defect(3, 2)
    integer :: i

    do i = 1, 5
      call newton_orders(random_machine(i), 0.9_qp * i, 1.0e-5_qp, orders, defect)
      call check_that(error, [orders], ">", 1.99_qp, "orders of the defects")
      if (allocated(error)) return
    end do
  end subroutine test_newton

  subroutine test_supports(error)
    type(error_type), allocatable, intent(out) :: error
    type(support_type) :: supports(2)
    real(dp) :: c(3, 3)
    real(dp), parameter :: k(2) = [3.0_dp, 5.0_dp], kb(2) = [7.0_dp, 11.0_dp], x(2) = [-0.4_dp, 0.3_dp], y(2) = [-0.2_dp, 0.1_dp]
    integer :: i

    do i = 1, 2
      supports(i) = support_type(position=[x(i), y(i)], stiffness=[k(i), kb(i)], damping=[kb(i), k(i)])
    end do
    c(1, :) = [sum(k), 0.0_dp, -sum(k * y)]
    c(2, :) = [0.0_dp, sum(kb), sum(kb * x)]
    c(3, :) = [-sum(k * y), sum(kb * x), sum(k * y**2 + kb * x**2)]
    call check_that(error, maxval(abs(stiffness_matrix(supports) - c)), "<", 1.0e-14_dp, "C of the supports")
    if (allocated(error)) return

    ! Turned by a right angle the axes change places; a damper stands where the spring stood.
    supports = [(support_type([x(i), y(i)], [k(i), kb(i)], [kb(i), k(i)], angle=pi / 2), i = 1, 2)]
    call check_that(error, maxval(abs(damping_matrix(supports) - c)), "<", 1.0e-14_dp, "B of the supports")
  end subroutine test_supports

  subroutine test_freedoms(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(frame_type) :: full, part
    type(gestell_error), allocatable :: failure
    real(dp) :: stiffness(3, 3), m(3, 3), b(3, 3), c(3, 3), h(3), m2(2, 2), b2(2, 2), c2(2, 2), h2(2)
    integer, parameter :: free(2) = [2, 3]

    call paper_linkage(linkage, error)
    if (allocated(error)) return
    stiffness = reshape([3.0_dp, 0.1_dp, 0.2_dp, 0.1_dp, 4.0_dp, 0.3_dp, 0.2_dp, 0.3_dp, 5.0_dp], [3, 3])
    call new_frame(full, linkage, 18.0_dp, 0.78_dp, [-0.2_dp, 0.2_dp], stiffness, stiffness, 30.0_dp, failure)
    call new_frame(part, linkage, 18.0_dp, 0.78_dp, [-0.2_dp, 0.2_dp], stiffness, stiffness, 30.0_dp, failure, free)
    call check(error, part%states, 4)
    if (allocated(error)) return
    call full%matrices(0.01_dp, m, b, c)
    call full%load(0.01_dp, h)
    call part%matrices(0.01_dp, m2, b2, c2)
    call part%load(0.01_dp, h2)
    call check(error, maxval(abs(m(free, free) - m2)) + maxval(abs(b(free, free) - b2)) + maxval(abs(c(free, free) - c2)) &
      & + maxval(abs(h(free) - h2)), 0.0_dp)
    if (allocated(error)) return
    call new_frame(part, linkage, 18.0_dp, 0.78_dp, [-0.2_dp, 0.2_dp], stiffness, stiffness, 30.0_dp, failure, [3, 3])
    call check_failure(error, failure, what="a degree of freedom twice")
  end subroutine test_freedoms

  !> Without the mechanism's mass: sqrt(k / m) and, with uncoupled springs, sqrt(c33 / J).
  subroutine test_frequencies(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: w(:)

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 0.1_dp, 0.0_dp, failure)
    call linkage%link("crank", "O", "A", 0.0_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    call linkage%prepare(failure)
    call new_frame(frame, linkage, 4.0_dp, 0.5_dp, [0.3_dp, 0.1_dp], diagonal([400.0_dp, 100.0_dp, 32.0_dp]), &
      & diagonal([0.0_dp, 0.0_dp, 0.0_dp]), 30.0_dp, failure)
    if (.not. allocated(failure)) call frame%natural_frequencies(w, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, maxval(abs(w - [5.0_dp, 8.0_dp, 10.0_dp])), "<", 1.0e-13_dp, "natural frequencies")
  end subroutine test_frequencies

  pure function diagonal(d) result(a)
    real(dp), intent(in) :: d(3)
    real(dp) :: a(3, 3)
    integer :: i

    a = 0
    do i = 1, 3
      a(i, i) = d(i)
    end do
  end function diagonal

  !> A crank with a counterweight: a1 and a2 vanish with all derivatives, and with the pivot at O the moment too.
  subroutine test_balanced(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(mass_functions_type) :: a
    type(gestell_error), allocatable :: failure
    integer :: k

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 0.1_dp, 0.2_dp, failure)
    call linkage%link("crank", "O", "A", 3.0_dp, 0.1_dp, [0.07_dp, 0.03_dp], failure)
    call linkage%link("counterweight", "O", "A", 1.0_dp, 0.1_dp, [-0.21_dp, -0.09_dp], failure)
    do k = 1, 30
      call linkage%mass_functions(0.37_dp * k, a)
      call check(error, sum(abs([a%a1%v, a%a2%v, a%a1%d, a%a2%d, a%a1%dd, a%a2%dd, a%a4])), 0.0_dp)
      if (allocated(error)) return
    end do
  end subroutine test_balanced

end module test_model
