!> The methods' coefficients and single steps, and the orders and error constants that they state.
module test_methods
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: text
  use gestell_floquet_integrator_comparison_cooper_verner, only: cooper_verner_tableau
  use gestell_floquet_period_period_map, only: period_map
  use gestell_floquet_integrator_comparison_magnus, only: expm
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type, name_length
  use gestell_floquet_choice_methods, only: method_names, new_method
  use gestell_floquet_integrator_tableau, only: gauss_tableau, tableau_type
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_system_periodic, only: periodic_system
  use systems, only: constant_type, diagonal
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_methods

  integer, parameter :: slopes = 11

  !> Rooted trees with the order condition that each poses: sum b_i value_i = 1 / density.
  type :: tree_type
    integer :: order = 0
    real(dp) :: density = 1, value(slopes) = 1
  end type tree_type

  !> x' = 0, with a count of the evaluations.
  type, extends(periodic_system) :: counting_type
    integer, pointer :: calls => null()
  contains
    procedure :: matrix => counting_matrix
  end type counting_type

  !> A system that turns with the period, and jumps.
  type, extends(periodic_system) :: turning_type
  contains
    procedure :: matrix => turning_matrix
    procedure :: forcing => turning_forcing
  end type turning_type

  real(dp), parameter :: turning_1(2, 2) = reshape([-0.5_dp, -2.0_dp, 1.5_dp, 0.1_dp], [2, 2])
  real(dp), parameter :: turning_2(2, 2) = reshape([0.2_dp, -5.0_dp, 2.5_dp, -0.3_dp], [2, 2])

contains

  subroutine collect_methods(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("explicit8 satisfies all 200 order conditions of order 8", test_trees), &
      & new_unittest("Gauss nodes and weights agree with closed forms and are exact as promised", test_gauss_tableau), &
      & new_unittest("matrix exponentials agree with closed forms", test_expm), &
      & new_unittest("magnus is exact for constant coefficients in any units", test_constant), &
      & new_unittest("every method keeps its order of convergence across a declared jump", test_jump), &
      & new_unittest("shared ends of steps are evaluated once, except at jumps", test_shared), &
      & new_unittest("stated error constants agree with measured errors", test_error_constants)]
  end subroutine collect_methods

  subroutine counting_matrix(self, t, p)
    class(counting_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    associate (unused => t)
    end associate
    self%calls = self%calls + 1
    p = 0
  end subroutine counting_matrix

  !> Nodes and weights of one to three stages; Butcher's simplifying assumptions B(2 s) and C(s), for A A too.
  subroutine test_gauss_tableau(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: c_2 = sqrt(3.0_dp) / 6, c_3 = sqrt(15.0_dp) / 10
    !> For a stage: what sums has a term of at most 1 with the roundings of a node's power and a weight.
    real(dp), parameter :: rounding = 4 * epsilon(1.0_dp)
    type(tableau_type) :: rule
    real(dp) :: worst
    integer :: s, k

    rule = gauss_tableau(1)
    worst = maxval(abs([rule%c, rule%b, rule%a] - [0.5_dp, 1.0_dp, 0.5_dp]))
    rule = gauss_tableau(2)
    worst = max(worst, maxval(abs([rule%c, rule%b] - [0.5_dp - c_2, 0.5_dp + c_2, 0.5_dp, 0.5_dp])))
    rule = gauss_tableau(3)
    worst = max(worst, maxval(abs([rule%c, rule%b] - [0.5_dp - c_3, 0.5_dp, 0.5_dp + c_3, [5, 8, 5] / 18.0_dp])))
    call check_that(error, worst, "<=", rounding, "nodes and weights")
    do s = 1, 12
      rule = gauss_tableau(s)
      call rule%fit(0.0_dp)
      worst = 0
      do k = 1, 2 * s
        worst = max(worst, abs(dot_product(rule%b, rule%c**(k - 1)) - 1.0_dp / k))
        if (k > s) cycle
        worst = max(worst, maxval(abs(matmul(rule%a, rule%c**(k - 1)) - rule%c**k / k)))
        worst = max(worst, abs(dot_product(rule%ba, rule%c**(k - 1)) - 1.0_dp / (k * (k + 1))))
        if (k == s) cycle
        worst = max(worst, maxval(abs(matmul(rule%aa, rule%c**(k - 1)) - rule%c**(k + 1) / (k * (k + 1)))))
      end do
      if (.not. allocated(error)) call check_that(error, worst, "<=", s * rounding, "what is exact with stages " // text(s))
    end do
  end subroutine test_gauss_tableau

  !> J. C. Butcher's conditions, one for each rooted tree: a tree is a root with smaller trees on it.
  subroutine test_trees(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: known(8) = [1, 1, 2, 4, 9, 20, 48, 115]
    type(tree_type) :: trees(200)
    real(dp) :: a(slopes, slopes), b(slopes)
    integer :: n, order, grown, k

    call cooper_verner_tableau(a, b)
    trees(1) = tree_type(order=1)
    n = 1
    do order = 2, 8
      grown = n
      call grow(tree_type(order=1), order - 1, n)
      call check(error, n - grown, known(order), more="number of trees")
      if (allocated(error)) return
      trees(grown + 1:n)%density = trees(grown + 1:n)%density * order
    end do
    do k = 1, n
      ! Coefficients up to 5 and their products of seven, rounded: some 1e-14.
      call check(error, dot_product(b, trees(k)%value), 1 / trees(k)%density, thr=1.0e-13_dp, more="condition")
      if (allocated(error)) return
    end do
    ! No more than order 8: the tall tree with nine vertices.
    call check_that(error, abs(dot_product(b, matmul(a, trees(n)%value)) - 1 / (9 * trees(n)%density)), ">", 1.0e-6_dp, &
      & "tree of order nine")

  contains

    !> Adds all trees that arise when trees up to number `last`, with `room` vertices in all, are put on that root.
    recursive subroutine grow(root, room, last)
      type(tree_type), intent(in) :: root
      integer, intent(in) :: room, last
      type(tree_type) :: next
      integer :: i

      if (room == 0) then
        n = n + 1
        trees(n) = root
        return
      end if
      do i = 1, last
        if (trees(i)%order > room) cycle
        next = tree_type(order=root%order + trees(i)%order, density=root%density * trees(i)%density, &
          & value=root%value * matmul(a, trees(i)%value))
        call grow(next, room - trees(i)%order, i)
      end do
    end subroutine grow

  end subroutine test_trees

  !> Rotations by many angles, a Jordan block, a triangular matrix with close and with distant eigenvalues.
  subroutine test_expm(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: angles(7) = [0.0_dp, 1.0e-9_dp, 0.12_dp, 0.35_dp, 0.5_dp, 0.9_dp, 40.0_dp]
    real(dp) :: a(2, 2), e(2, 2), jordan(3, 3)
    integer :: i

    do i = 1, size(angles)
      a = reshape([0.0_dp, -angles(i), angles(i), 0.0_dp], [2, 2])
      e = expm(a)
      ! Six squarings at most, each of which doubles the roundoff.
      call check(error, maxval(abs(e - reshape([cos(angles(i)), -sin(angles(i)), sin(angles(i)), cos(angles(i))], [2, 2]))), &
        & 0.0_dp, thr=epsilon(1.0_dp) * (1 + 4 * angles(i)), more="rotation")
      if (allocated(error)) return
    end do

    jordan = -2 * diagonal([1.0_dp, 1.0_dp, 1.0_dp])
    jordan(1, 2) = 1
    jordan(2, 3) = 1
    e = expm(jordan(:2, :2))
    call check(error, maxval(abs(e - exp(-2.0_dp) * reshape([1.0_dp, 0.0_dp, 1.0_dp, 1.0_dp], [2, 2]))), 0.0_dp, &
      & thr=4 * epsilon(1.0_dp), more="Jordan block")
    if (allocated(error)) return
    jordan = expm(jordan)
    call check(error, jordan(1, 3), exp(-2.0_dp) / 2, thr=4 * epsilon(1.0_dp), more="Jordan block of three")
    if (allocated(error)) return

    ! exp [a 1; 0 c] = [e^a (e^a - e^c)/(a - c); 0 e^c].
    a = reshape([-30.0_dp, 0.0_dp, 1.0_dp, -1.0_dp], [2, 2])
    e = expm(a)
    call check(error, e(1, 2), (exp(-1.0_dp) - exp(-30.0_dp)) / 29, thr=1.0e-15_dp, more="stiff")
    if (allocated(error)) return
    call check_that(error, abs(e(1, 1) / exp(-30.0_dp) - 1), "<", 1.0e-13_dp, "the small one, relative")
  end subroutine test_expm

  !> One step over the period, in which motions turn by 30 and 3 radians; a large load on the first of two affects neither
  !> Phi(T) nor the second motion.
  subroutine test_constant(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: w(2) = [30.0_dp, 3.0_dp]
    type(constant_type) :: system
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(4, 4), xp(4), reach, unit
    integer :: i

    do i = -1, 1
      unit = 1.0e3_dp**i
      system = constant_type(states=4, period=unit, m=diagonal([1.0_dp, 2.0_dp]), c=diagonal([1.0_dp, 2.0_dp] * (w / unit)**2), &
        & amplitude=[1.0e7_dp, 0.0_dp])
      call new_method(merge("magnus4", "magnus6", i == 0), method, failure)
      call period_map(system, method, [0.0_dp, 1.0_dp], [1.0_dp, 1.0_dp, 1.0_dp, 1.0_dp], phi, failure, xp, reach)
      ! Scaling by 2^-6: 64 epsilon, some times.
      call check_that(error, maxval(abs([phi(1, 1) - cos(w(1)), phi(2, 2) - cos(w(2)), phi(3, 1) * unit / w(1) + sin(w(1)), &
        & phi(2, 4) / unit * w(2) - sin(w(2)), phi(1, 2)])), "<", 1.0e-13_dp, "free motion")
      if (allocated(error)) return
      call check(error, xp(2), 0.0_dp, thr=0.0_dp)
      if (allocated(error)) return
      deallocate(method)
    end do
  end subroutine test_constant

  !> P(t) = R(t) B R(-t) and f(t) = R(t) g with the rotation R by w t, B = B_1 before 0.4 T, B_2 after. y = R(-t) x has
  !> constant coefficients, y' = (B - w J) y + g, R' = w J R; R(T) = E.
  subroutine turning_matrix(self, t, p)
    class(turning_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp) :: r(2, 2)

    r = rotation(2 * pi * t / self%period)
    p = matmul(r, matmul(merge(turning_1, turning_2, t < self%breaks(1)), transpose(r)))
  end subroutine turning_matrix

  subroutine turning_forcing(self, t, f)
    class(turning_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    f = matmul(rotation(2 * pi * t / self%period), [1.0_dp, 2.0_dp])
  end subroutine turning_forcing

  pure function rotation(angle) result(r)
    real(dp), intent(in) :: angle
    real(dp) :: r(2, 2)

    r = reshape([cos(angle), sin(angle), -sin(angle), cos(angle)], [2, 2])
  end function rotation

  subroutine test_jump(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=9), parameter :: methods(9) = [character(len=9) :: "rk4", "explicit8", "magnus4", "magnus6", "gauss2", &
      & "gauss3", "gauss4", "gauss5", "gauss6"]
    integer, parameter :: order(9) = [4, 8, 4, 6, 4, 6, 8, 10, 12]
    integer, parameter :: steps(9) = [120, 40, 80, 40, 80, 40, 20, 20, 10]
    real(dp), parameter :: w = 2 * pi / 3, spin(2, 2) = reshape([0.0_dp, w, -w, 0.0_dp], [2, 2])
    type(turning_type) :: system
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: e1(2, 2), e2(2, 2), phi(2, 2), xp(2), phi_error(2), xp_error(2)
    integer :: i, k

    system = turning_type(states=2, period=3.0_dp, breaks=[1.2_dp])
    e1 = exponential(turning_1 - spin, 1.2_dp)
    e2 = exponential(turning_2 - spin, 1.8_dp)
    phi = matmul(e2, e1)
    xp = matmul(e2, forced(turning_1 - spin, e1)) + forced(turning_2 - spin, e2)
    do i = 1, size(methods)
      do k = 1, 2
        call solve_monodromy(system, accuracy_type(method=trim(methods(i)), steps=steps(i) * (1 + k) / 2), .true., monodromy, &
          & failure)
        call check_success(error, failure)
        if (allocated(error)) return
        phi_error(k) = norm2(monodromy%phi - phi)
        xp_error(k) = norm2(monodromy%xp - xp)
      end do
      call check(error, log(phi_error(1) / phi_error(2)) / log(1.5_dp), real(order(i), dp), thr=0.15_dp * order(i), &
        & more="Phi by " // methods(i))
      if (allocated(error)) return
      call check(error, log(xp_error(1) / xp_error(2)) / log(1.5_dp), real(order(i), dp), thr=0.15_dp * order(i), &
        & more="x_p by " // methods(i))
      if (allocated(error)) return
    end do

  contains

    !> exp(K t) = e^(m t) (cos(v t) E + sin(v t) / v (K - m E)), m = tr K / 2, v^2 = det K - m^2 > 0.
    pure function exponential(k, t) result(e)
      real(dp), intent(in) :: k(2, 2), t
      real(dp) :: e(2, 2), unit(2, 2), m, v

      unit = rotation(0.0_dp)
      m = (k(1, 1) + k(2, 2)) / 2
      v = sqrt(k(1, 1) * k(2, 2) - k(1, 2) * k(2, 1) - m**2)
      e = exp(m * t) * (cos(v * t) * unit + sin(v * t) / v * (k - m * unit))
    end function exponential

    !> K^-1 (e^(K t) - E) g.
    pure function forced(k, e) result(y)
      real(dp), intent(in) :: k(2, 2), e(2, 2)
      real(dp) :: y(2)

      y = matmul(reshape([k(2, 2), -k(2, 1), -k(1, 2), k(1, 1)], [2, 2]), matmul(e - rotation(0.0_dp), [1.0_dp, 2.0_dp])) &
        & / (k(1, 1) * k(2, 2) - k(1, 2) * k(2, 1))
    end function forced

  end subroutine test_jump

  subroutine test_shared(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(2) = [character(len=9) :: "rk4", "explicit8"]
    ! Volatile: gfortran assumes that the target of an argument with intent(in) is unchanged if only an extension of its
    ! declared type has pointers.
    integer, target, volatile :: calls
    type(counting_type) :: system
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(1, 1)
    integer :: i, before

    do i = 1, size(names)
      call new_method(trim(names(i)), method, failure)
      system = counting_type(states=1, period=3.0_dp, calls=calls)
      calls = 0
      call period_map(system, method, mesh(system, 10), [1.0_dp], phi, failure)
      call check(error, calls, 10 * method%stages + 1, more=names(i))
      if (allocated(error)) return
      system%breaks = [0.9_dp]
      before = calls
      call period_map(system, method, mesh(system, 10), [1.0_dp], phi, failure)
      call check(error, calls - before, 10 * method%stages + 2, more=names(i) // " with a jump")
      if (allocated(error)) return
      deallocate(method)
    end do
  end subroutine test_shared

  !> q'' + w^2 q = 0: Phi by cosine and sine.
  subroutine test_error_constants(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=name_length), allocatable :: names(:)
    !> The other oscillator turns faster: methods that are fitted to it have the part faster^2 - 1 of their error for this one.
    real(dp), parameter :: angle = 20, faster = 1.2_dp
    type(constant_type) :: system
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(dp) :: phi(4, 4), stated, ratio
    integer :: i, steps

    system = constant_type(states=4, period=1.0_dp, m=diagonal([1.0_dp, 1.0_dp]), c=diagonal([angle**2, (faster * angle)**2]))
    allocate(names, source=method_names())
    do i = 2, size(names)
      call new_method(trim(names(i)), method, failure)
      if (.not. method%exact_if_constant) then
        ! As many steps as make the error 1e-9.
        steps = ceiling(angle * (1.0e9_dp * method%error_constant * angle)**(1.0_dp / method%order))
        stated = method%error_constant * angle * (angle / steps)**method%order
        if (method%lower_order > 0) stated = stated * (faster**2 - 1)
        call period_map(system, method, mesh(system, steps), [1.0_dp, 1.0_dp, angle, angle], phi, failure)
        ratio = hypot(phi(1, 1) - cos(angle), phi(1, 3) * angle - sin(angle)) / stated
        ! The next term of the expansion is some tenths of the first.
        call check(error, ratio, 1.0_dp, thr=0.4_dp, more=trim(names(i)))
        if (allocated(error)) return
      end if
      deallocate(method)
    end do
  end subroutine test_error_constants

end module test_methods
