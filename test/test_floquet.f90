!> Monodromy matrices and multipliers against closed forms and published values.
module test_floquet
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_matrix, only: unit_matrix
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: arrange, multipliers_type, set_multipliers, solve_multipliers
  use gestell_system_periodic, only: periodic_system
  use systems, only: constant_type, mathieu_type, meissner_type, plain_type, vinograd_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_floquet

contains

  subroutine collect_floquet(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("exponents of a damped oscillator agree with the closed form", test_constant), &
      & new_unittest("multipliers of Meissner's equation agree with published values", test_meissner), &
      & new_unittest("steps end at coefficient jumps whatever their number", test_breaks), &
      & new_unittest("Vinograd's system has the exponents 2 and -13", test_vinograd), &
      & new_unittest("the exponent of Mathieu's equation agrees with its published value", test_mathieu_exponent), &
      & new_unittest("Mathieu's equation has trace 2 and -2 at tabulated characteristic values", test_mathieu_borders), &
      & new_unittest("damping shifts the exponents of Mathieu's equation by d / 2", test_mathieu_damped), &
      & new_unittest("second-order and first-order formulations agree", test_paths), &
      & new_unittest("a double multiplier 1 lies within its bound; the verdict is undecided", test_double), &
      & new_unittest("two equal conjugate pairs remain conjugate pairs", test_equal_pairs), &
      & new_unittest("coupling of well separated multipliers enters their bounds quadratically", test_separated), &
      & new_unittest("eigenvectors satisfy the eigenvalue equation of the monodromy matrix", test_vectors), &
      & new_unittest("vectors that were not requested are not computed", test_not_requested), &
      & new_unittest("unknown methods and negative numbers of steps are refused", test_refused)]
  end subroutine collect_floquet

  subroutine solve(system, multipliers, error, tolerance, method)
    class(periodic_system), intent(in) :: system
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: tolerance
    character(len=*), intent(in), optional :: method
    type(monodromy_type) :: monodromy
    type(accuracy_type) :: accuracy
    type(gestell_error), allocatable :: failure

    if (present(tolerance)) accuracy%tolerance = tolerance
    if (present(method)) accuracy%method = method
    call solve_monodromy(system, accuracy, .false., monodromy, failure)
    if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., multipliers, failure)
    call check_success(error, failure)
  end subroutine solve

  !> q'' + 2 D w q' + w^2 q = 0: lambda = -D w +- i w sqrt(1 - D^2), of both signs of 1 - D^2.
  subroutine test_constant(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    type(multipliers_type) :: m
    complex(dp) :: lambda, rho(4)
    real(dp), parameter :: w(2) = [3.0_dp, 5.0_dp], d(2) = [0.1_dp, 1.25_dp]
    integer :: i

    system = constant_type(states=4, period=1.3_dp)
    do i = 1, 2
      system%m(i, i) = 2
      system%b(i, i) = 2 * 2 * d(i) * w(i)
      system%c(i, i) = 2 * w(i)**2
    end do
    call solve(system, m, error, tolerance=1.0e-11_dp)
    if (allocated(error)) return
    lambda = w(1) * cmplx(-d(1), sqrt(1 - d(1)**2), dp)
    rho(1:2) = [exp(lambda * system%period), conjg(exp(lambda * system%period))]
    rho(3:4) = exp(w(2) * system%period * [-d(2) + sqrt(d(2)**2 - 1), -d(2) - sqrt(d(2)**2 - 1)])
    do i = 1, 4
      call check_that(error, minval(abs(rho - m%rho(i))), "<=", m%error(i) * abs(m%rho(i)), "claimed error holds")
      ! The tolerance is relative to the largest entries of Phi, of size 1 here.
      call check_that(error, minval(abs(rho - m%rho(i))), "<", 1.0e-10_dp, "multiplier")
      if (allocated(error)) return
    end do
    call check(error, m%verdict(), "stable")
  end subroutine test_constant

  !> Values of the closed form, product of two rotations of the frequencies sqrt(a -+ 2 q).
  subroutine test_meissner(error)
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: m

    call solve(meissner(), m, error, tolerance=1.0e-13_dp)
    if (allocated(error)) return
    call check(error, real(m%rho(1)), -1.138826449407891_dp, thr=1.0e-13_dp)
    if (allocated(error)) return
    call check(error, real(m%rho(2)), -0.878096922072656_dp, thr=1.0e-13_dp)
    if (allocated(error)) return
    call check(error, m%verdict(), "unstable")
  end subroutine test_meissner

  function meissner() result(system)
    type(meissner_type) :: system

    system%states = 2
    system%period = pi
    system%breaks = [pi / 3]
  end function meissner

  !> Constant coefficients between the breaks: few steps suffice, and RK4 keeps its order 4 across the jump.
  subroutine test_breaks(error)
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: trace = -1.138826449407891_dp - 0.878096922072656_dp
    real(dp) :: defect(2)
    integer :: i

    do i = 1, 2
      call solve_monodromy(meissner(), accuracy_type(method="rk4", steps=merge(400, 800, i == 1)), .false., monodromy, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      defect(i) = abs(monodromy%phi(1, 1) + monodromy%phi(2, 2) - trace)
    end do
    call check(error, log(defect(1) / defect(2)) / log(2.0_dp), 4.0_dp, thr=0.2_dp)
  end subroutine test_breaks

  subroutine test_vinograd(error)
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: m

    call solve(vinograd_type(states=2, period=pi / 3), m, error, tolerance=1.0e-13_dp)
    if (allocated(error)) return
    call check(error, real(m%exponent(1)), 2.0_dp, thr=1.0e-11_dp)
    if (allocated(error)) return
    ! rho_2 = exp(-13 pi / 3) = 1e-6 carries the rounding of entries of size 10.
    call check(error, real(m%exponent(2)), -13.0_dp, thr=1.0e-7_dp)
    if (allocated(error)) return
    call check_that(error, abs(m%rho(2) / exp(-13 * pi / 3) - 1), "<=", m%error(2), "claimed error holds")
    if (allocated(error)) return
    call check(error, m%verdict(), "unstable")
  end subroutine test_vinograd

  !> exponent 0.0995364372755138 + i (published to 16 digits, see DLMF 28.29 for the discriminant).
  subroutine test_mathieu_exponent(error)
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: m

    call solve(mathieu_type(states=2, period=pi, a=1.0_dp, q=0.2_dp), m, error, tolerance=1.0e-13_dp)
    if (allocated(error)) return
    call check(error, real(m%exponent(1)), 0.0995364372755138_dp, thr=1.0e-13_dp)
    if (allocated(error)) return
    call check(error, abs(aimag(m%exponent(1))), 1.0_dp, thr=1.0e-13_dp)
    if (allocated(error)) return
    call check(error, m%log_abs(1) + m%log_abs(2), 0.0_dp, thr=1.0e-12_dp, more="reciprocal pair")
    if (allocated(error)) return
    call check(error, m%verdict(), "unstable")
  end subroutine test_mathieu_exponent

  !> On a0 and b1 (NIST DLMF, table 28.4) the trace of Phi is +2 and -2.
  subroutine test_mathieu_borders(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: a(2) = [-5.800046020851508_dp, -5.790080598637771_dp], trace(2) = [2.0_dp, -2.0_dp]
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    integer :: i

    do i = 1, 2
      call solve_monodromy(mathieu_type(states=2, period=pi, a=a(i), q=5.0_dp), accuracy_type(tolerance=1.0e-13_dp), &
        & .false., monodromy, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      ! The entries of Phi are of size 400, and the trace moves by 400 for a step of 1 in a.
      call check(error, monodromy%phi(1, 1) + monodromy%phi(2, 2), trace(i), thr=1.0e-10_dp)
      if (allocated(error)) return
    end do
  end subroutine test_mathieu_borders

  !> y = exp(-d t / 2) z transforms the damped equation (a, d) into the undamped one with a - d^2 / 4.
  subroutine test_mathieu_damped(error)
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: damped, undamped
    real(dp), parameter :: d = 0.3_dp

    call solve(mathieu_type(states=2, period=pi, a=1 + d**2 / 4, q=0.2_dp, d=d), damped, error, tolerance=1.0e-12_dp)
    if (allocated(error)) return
    call solve(mathieu_type(states=2, period=pi, a=1.0_dp, q=0.2_dp), undamped, error, tolerance=1.0e-12_dp)
    if (allocated(error)) return
    call check_that(error, maxval(abs(real(damped%exponent - undamped%exponent) + d / 2)), "<", 1.0e-11_dp, &
      & "real parts of exponents")
    if (allocated(error)) return
    call check(error, damped%verdict(), "stable")
  end subroutine test_mathieu_damped

  subroutine test_paths(error)
    type(error_type), allocatable, intent(out) :: error
    type(mathieu_type) :: system
    type(plain_type) :: plain
    type(monodromy_type) :: one, two
    type(gestell_error), allocatable :: failure
    character(len=6), parameter :: methods(3) = ["gauss2", "gauss6", "gauss8"]
    integer :: i

    system = mathieu_type(states=2, period=pi, a=3.0_dp, q=0.7_dp, d=0.1_dp, h=1.0_dp)
    plain%states = 2
    plain%period = pi
    allocate(plain%system, source=system)
    do i = 1, size(methods)
      call solve_monodromy(system, accuracy_type(method=methods(i), steps=9), .true., one, failure)
      if (.not. allocated(failure)) call solve_monodromy(plain, accuracy_type(method=methods(i), steps=9), .true., two, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      ! The same collocation, solved for accelerations or for slopes: equal but for rounding.
      call check_that(error, maxval(abs(one%phi - two%phi)), "<", 1.0e-13_dp, methods(i))
      call check_that(error, maxval(abs(one%xp - two%xp)), "<", 1.0e-13_dp, methods(i))
      if (allocated(error)) return
    end do
  end subroutine test_paths

  !> On the border a0 the multiplier 1 is double and defective: an error e of Phi moves it by sqrt(e).
  subroutine test_double(error)
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: m

    call solve(mathieu_type(states=2, period=pi, a=-5.800046020851508_dp, q=5.0_dp), m, error, tolerance=1.0e-9_dp)
    if (allocated(error)) return
    call check_that(error, abs(m%rho - 1), "<=", m%error * abs(m%rho), "claimed error holds")
    call check_that(error, m%error, ">", 1.0e-9_dp, "the bound reflects the double multiplier")
    if (allocated(error)) return
    call check(error, m%verdict(), "undecided")
  end subroutine test_double

  !> diag(1, 1/2) with e off the diagonal has the eigenvalues 3/4 + sqrt(1/16 + e^2) and 3/4 - sqrt(1/16 + e^2).
  subroutine test_separated(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: e(3) = [1.0e-6_dp, 1.0e-2_dp, 0.2_dp]
    type(multipliers_type) :: multipliers
    complex(dp) :: unit(2, 2)
    real(dp) :: changes(2, 2, 1), off
    integer :: k

    unit = unit_matrix(2)
    do k = 1, size(e)
      changes(:, :, 1) = reshape([0.0_dp, e(k), e(k), 0.0_dp], [2, 2])
      call set_multipliers(cmplx([1.0_dp, 0.5_dp], 0.0_dp, dp), unit, unit, 1.0e-15_dp, multipliers, changes)
      off = e(k)**2 / (0.25_dp + sqrt(1 / 16.0_dp + e(k)**2))
      print "(a, 4es10.2)", "         coupling, true error, bounds: ", e(k), off, multipliers%error
      ! The second error is relative to 1/2. An error bounded by direction counts twice, four times in its square. Where the
      ! discs come near each other, at 0.2, the plain bounds remain.
      call check_that(error, multipliers%error * [1.0_dp, 0.5_dp], ">=", off, "the bound holds")
      if (.not. allocated(error) .and. k < 3) call check_that(error, multipliers%error * [1.0_dp, 0.5_dp], "<=", 6 * off &
        & + 1.0e-14_dp, "the bound is near the error")
      if (allocated(error)) return
    end do
  end subroutine test_separated

  !> Two equal pairs, as for a frame on equal springs along both axes, in any order.
  subroutine test_equal_pairs(error)
    type(error_type), allocatable, intent(out) :: error
    complex(dp), parameter :: rho = (0.6_dp, 0.7_dp), slow = (0.5_dp, 0.0_dp)
    type(multipliers_type) :: multipliers
    complex(dp) :: unit(5, 5)

    unit = unit_matrix(5)
    call set_multipliers([rho, slow, rho, conjg(rho), conjg(rho)], unit, unit, 1.0e-14_dp, multipliers)
    call arrange(multipliers)
    call check_that(error, abs(multipliers%rho - [rho, conjg(rho), rho, conjg(rho), slow]), "<=", 0.0_dp, &
      & "+ - + - and the slow one")
  end subroutine test_equal_pairs

  subroutine test_vectors(error)
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: m
    type(gestell_error), allocatable :: failure
    integer :: k

    call solve_monodromy(mathieu_type(states=2, period=pi, a=3.0_dp, q=0.7_dp, d=0.1_dp), accuracy_type(), .false., &
      & monodromy, failure)
    if (.not. allocated(failure)) call solve_multipliers(monodromy, .true., m, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 1, 2
      call check_that(error, norm2(abs(matmul(monodromy%phi, m%vectors(:, k)) - m%rho(k) * m%vectors(:, k))), "<", 1.0e-14_dp, &
        & "eigenvector")
      if (allocated(error)) return
      call check(error, norm2(abs(m%vectors(:, k))), 1.0_dp, thr=1.0e-14_dp)
      if (allocated(error)) return
    end do
    call check(error, abs(m%rho(1) - conjg(m%rho(2))), 0.0_dp, more="pair adjacent and conjugate")
  end subroutine test_vectors

  subroutine test_not_requested(error)
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: m
    type(gestell_error), allocatable :: failure

    call solve_monodromy(mathieu_type(states=2, period=pi, a=3.0_dp, h=1.0_dp), accuracy_type(), .false., monodromy, failure)
    if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., m, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, .not. allocated(monodromy%xp), more="x_p")
    if (allocated(error)) return
    call check(error, .not. allocated(m%vectors), more="vectors")
  end subroutine test_not_requested

  subroutine test_refused(error)
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure

    call solve_monodromy(mathieu_type(states=2, period=pi), accuracy_type(method="euler"), .false., monodromy, failure)
    call check_failure(error, failure, what="unknown method")
    if (allocated(error)) return
    call solve_monodromy(mathieu_type(states=2, period=pi), accuracy_type(steps=-1), .false., monodromy, failure)
    call check_failure(error, failure, what="negative steps")
  end subroutine test_refused

end module test_floquet
