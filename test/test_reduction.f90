!> Fast free vibrations without integration: multipliers and periodic motion against closed forms and a second method.
module test_reduction
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: evidence, evidence_type, floquet_type, follow, liouville_defect, solve_floquet, &
    & solve_multipliers, solve_periodic
  use gestell_system_periodic, only: periodic_system
  use slow_tests, only: new_slow
  use systems, only: constant_type, meissner_type, oscillators_type
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  use turning_system, only: turning_type
  implicit none (type, external)
  private

  !> x' = S B S (x - v), S a reflection, B constant: a fast vibration, two slow decays that act very unequally: x = v.
  type, extends(periodic_system) :: unequal_type
    real(dp) :: v(4) = [1.0_dp, -2.0_dp, 0.5_dp, 3.0_dp]
  contains
    procedure :: matrix => unequal_matrix
    procedure :: forcing => unequal_forcing
  end type unequal_type

  public :: collect_reduction

contains

  subroutine collect_reduction(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("fast modes are reduced without loss of accuracy", test_fast), &
      & new_unittest("fast modes with close or equal frequencies are reduced accurately", test_close), &
      & new_unittest("fast and slow modes together are reduced accurately", test_mixed), &
      & new_unittest("logarithms of multipliers are accurate if multipliers underflow", test_damped), &
      & new_unittest("logarithms of multipliers are accurate if multipliers overflow", test_growing), &
      & new_unittest("the cost of the reduction does not grow with the frequency", test_cost), &
      & new_unittest("an undamped resonance is an error, a damped one is solved", test_resonance), &
      & new_unittest("a reduced system with constant coefficients agrees with the transfer function", test_transfer), &
      & new_unittest("a weak load with many harmonics keeps its own error bound", test_weak_load), &
      & new_unittest("an unsupported body has no periodic motion; fast modes remain accurate", test_loose), &
      & new_unittest("slow motions of very different size are accurate", test_unequal), &
      & new_unittest("an accuracy out of range is an error", test_accuracy), &
      & new_slow("systems unsuited to the reduction are refused with a reason", test_refused)]
  end subroutine collect_reduction

  !> Solves `system` and compares all results with its closed form.
  subroutine compare(error, system, method, name)
    type(error_type), allocatable, intent(out) :: error
    type(turning_type), intent(in) :: system
    character(len=*), intent(in) :: method, name
    integer, parameter :: points = 8
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    complex(dp) :: exact(6), difference
    real(dp), allocatable :: x(:, :)
    real(dp) :: nearest, own, defect
    integer :: i, k

    call solve_floquet(system, accuracy_type(tolerance=1.0e-9_dp, method=method), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_multipliers(floquet, .true., multipliers, failure)
    if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
    if (.not. allocated(failure)) call follow(system, floquet, solution, [(real(k, dp) / points, k = 0, points)], x, failure)
    if (allocated(failure)) call test_failed(error, name // ": " // failure%message)
    if (allocated(error)) return
    exact = system%logarithms()
    do i = 1, 6
      nearest = huge(nearest)
      do k = 1, 6
        difference = cmplx(multipliers%log_abs(i) - real(exact(k)), multipliers%arg(i) - aimag(exact(k)), dp)
        difference = cmplx(real(difference), aimag(difference) - 2 * pi * anint(aimag(difference) / (2 * pi)), dp)
        nearest = min(nearest, abs(difference))
      end do
      ! The closed form's own arguments and the coefficients are rounded.
      own = 4 * epsilon(1.0_dp) * maxval(abs(exact))
      ! exp of a logarithm of up to 700 is rounded as that is.
      difference = exp(cmplx(min(multipliers%log_abs(i), 700.0_dp), multipliers%arg(i), dp))
      if (multipliers%log_abs(i) <= 700) then
        call check_that(error, abs(multipliers%rho(i) - difference), "<=", 1.0e-12_dp * abs(difference), name // ": rho")
      end if
      if (allocated(error)) return
      call check_that(error, nearest, "<=", multipliers%error(i) + own, name // ": a multiplier's bound")
      call check_that(error, multipliers%error(i), "<=", 2.0e-8_dp + 1.0e4_dp * own, name // ": the bound is too wide")
      if (allocated(error)) return
    end do
    call check_that(error, multipliers%log_abs(2:), "<=", multipliers%log_abs(:5), name // ": order")
    call check_that(error, abs(solution%x0 - system%motion(0.0_dp)), "<=", solution%error, name // ": bound of x0")
    ! The tolerance is 1e-9; the motion's size is 2, the largest condition of E - Phi in these cases about 10, and the forcing
    ! is rounded like the coefficients.
    call check_that(error, maxval(solution%error), "<", 1.0e-6_dp + 1.0e2_dp * own, name // ": the bound of x0 is too wide")
    if (allocated(error)) return
    do k = 0, points
      call check_that(error, maxval(abs(x(:, k + 1) - system%motion(2 * pi * k / points))), "<", 1.0e-7_dp + own, name &
        & // ": motion")
      if (allocated(error)) return
    end do
    call liouville_defect(system, floquet, defect, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, abs(defect), "<=", 1.0e-12_dp * sum(abs(exact)) + 1.0e-8_dp, name // ": Liouville")
  end subroutine compare

  subroutine test_fast(error)
    type(error_type), allocatable, intent(out) :: error

    call compare(error, turning_type(states=6, period=2 * pi, rate=[-0.1_dp, -0.02_dp, 0.05_dp], &
      & frequency=[100.3_dp, 250.2_dp, 900.1_dp]), "auto", "auto")
    if (allocated(error)) return
    call compare(error, turning_type(states=6, period=2 * pi, rate=[0.0_dp, 0.0_dp, 0.0_dp], &
      & frequency=[1.0030e4_dp, 2.5020e6_dp, 9.0010e7_dp] + 0.3_dp), "reduced", "undamped")
    if (allocated(error)) return
    call compare(error, turning_type(states=6, period=2 * pi, rate=[-3.0_dp, -1.0_dp, -0.5_dp], &
      & frequency=[100.3_dp, 250.2_dp, 900.1_dp], swing=0.8_dp), "reduced", "wide swing")
  end subroutine test_fast

  subroutine test_close(error)
    type(error_type), allocatable, intent(out) :: error

    call compare(error, turning_type(states=6, period=2 * pi, rate=[-0.1_dp, -0.02_dp, -0.05_dp], &
      & frequency=[300.3_dp, 302.1_dp, 900.1_dp]), "reduced", "two close ones")
    if (allocated(error)) return
    call compare(error, turning_type(states=6, period=2 * pi, rate=[-0.1_dp, -0.1_dp, -0.1_dp], &
      & frequency=[5000.3_dp, 5000.3_dp, 5002.7_dp]), "reduced", "a double one, and a close one")
  end subroutine test_close

  subroutine test_mixed(error)
    type(error_type), allocatable, intent(out) :: error

    call compare(error, turning_type(states=6, period=2 * pi, rate=[-0.1_dp, -0.2_dp, -0.05_dp], &
      & frequency=[0.3_dp, 302.1_dp, 900.1_dp]), "reduced", "one slow")
    if (allocated(error)) return
    call compare(error, turning_type(states=6, period=2 * pi, rate=[-0.1_dp, -0.2_dp, -0.05_dp], &
      & frequency=[0.3_dp, 2.1_dp, 1.0e9_dp]), "auto", "two slow, one very fast")
  end subroutine test_mixed

  subroutine test_damped(error)
    type(error_type), allocatable, intent(out) :: error

    call compare(error, turning_type(states=6, period=2 * pi, rate=[-0.1_dp, -600.0_dp, -20.0_dp], &
      & frequency=[0.3_dp, 0.0_dp, 900.1_dp], real_block=[.false., .true., .false.]), "auto", "overdamped")
    if (allocated(error)) return
    call compare(error, turning_type(states=6, period=2 * pi, rate=[-300.0_dp, -1.0e4_dp, -2.0e6_dp], &
      & real_block=[.true., .true., .true.]), "auto", "everything overdamped")
  end subroutine test_damped

  subroutine test_growing(error)
    type(error_type), allocatable, intent(out) :: error

    call compare(error, turning_type(states=6, period=2 * pi, rate=[300.0_dp, -250.0_dp, 20.0_dp], &
      & frequency=[200.0_dp, 0.0_dp, 900.1_dp], real_block=[.false., .true., .false.]), "auto", "growing")
  end subroutine test_growing

  !> The number of evaluations at a frequency of 1e9 equals that at 1e3.
  subroutine test_cost(error)
    type(error_type), allocatable, intent(out) :: error
    type(floquet_type) :: floquet
    type(evidence_type) :: found(2)
    type(gestell_error), allocatable :: failure
    integer :: k

    do k = 1, 2
      call solve_floquet(turning_type(states=6, period=2 * pi, rate=[-0.1_dp, -0.02_dp, 0.05_dp], &
        & frequency=[1.003_dp, 2.502_dp, 9.001_dp] * 1.0e3_dp**(2 * k - 1)), accuracy_type(), .false., floquet, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call evidence(floquet, found(k))
    end do
    call check_that(error, found(2)%evaluations, "<=", found(1)%evaluations, "evaluations")
  end subroutine test_cost

  !> A frequency that is a multiple of the crank's: without damping rho = 1 and there is no periodic motion; with damping the
  !> motion is as accurate as elsewhere, since its forcing has no harmonic of that order.
  subroutine test_resonance(error)
    type(error_type), allocatable, intent(out) :: error
    type(floquet_type) :: floquet
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure

    call solve_floquet(turning_type(states=6, period=2 * pi, rate=[0.0_dp, -0.02_dp, -0.05_dp], &
      & frequency=[200.0_dp, 450.2_dp, 900.1_dp]), accuracy_type(method="reduced"), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
    call check_failure(error, failure, "resonance")
    if (allocated(error)) return
    call compare(error, turning_type(states=6, period=2 * pi, rate=[-1.0e-3_dp, -0.02_dp, -0.05_dp], &
      & frequency=[200.0_dp, 450.2_dp, 900.1_dp]), "reduced", "damped resonance")
  end subroutine test_resonance

  !> q = Re [(C - W^2 M + i W B)^-1 h exp(i W t)].
  subroutine test_transfer(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    type(floquet_type) :: floquet
    type(periodic_solution_type) :: solution
    type(evidence_type) :: found
    type(gestell_error), allocatable :: failure
    complex(dp) :: z(2, 2), q(2)
    real(dp) :: w

    system = constant_type(states=4, period=40.0_dp, m=reshape([2.0_dp, 0.3_dp, 0.3_dp, 1.0_dp], [2, 2]), &
      & b=reshape([0.2_dp, 0.1_dp, -0.1_dp, 0.3_dp], [2, 2]), c=reshape([9.0e3_dp, -2.0e3_dp, -2.0e3_dp, 5.0e3_dp], [2, 2]), &
      & amplitude=[3.0_dp, -1.0_dp])
    call solve_floquet(system, accuracy_type(), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
    call check_success(error, failure)
    call evidence(floquet, found)
    call check_that(error, found%angles, ">", 0, "angles of the reduction")
    if (allocated(error)) return
    w = 2 * pi / system%period
    z = cmplx(system%c - w**2 * system%m, w * system%b, dp)
    q = [z(2, 2) * system%amplitude(1) - z(1, 2) * system%amplitude(2), &
      & z(1, 1) * system%amplitude(2) - z(2, 1) * system%amplitude(1)] / (z(1, 1) * z(2, 2) - z(1, 2) * z(2, 1))
    call check_that(error, abs(solution%x0 - [real(q), real(cmplx(0, w, dp) * q)]), "<=", solution%error, "bound")
    ! Of what has the size 1e-3 in displacement.
    call check_that(error, maxval(solution%error(:2)), "<", 1.0e-14_dp, "the bound is too wide")
  end subroutine test_transfer

  !> The load of the slow vibration needs more phases than the strong one of the fast vibration, and has its own bound.
  subroutine test_weak_load(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: amplitudes(4) = [1.0_dp, 1.0e6_dp, 1.0e8_dp, 1.0e10_dp], sharpness(3) = [0.2_dp, 0.05_dp, 0.02_dp]
    type(oscillators_type) :: system
    type(floquet_type) :: floquet
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    integer :: i, k

    do k = 1, size(sharpness)
      do i = 1, size(amplitudes) + 1
        if (i > size(amplitudes)) then
          ! Here it is the fast vibration that has the many harmonics.
          system = oscillators_type(states=4, period=1.0_dp, square=[1.7_dp, 4.0e6_dp], damping=[0.5_dp, 0.1_dp], &
            & amplitude=[1.0_dp, 1.0_dp], sharpness=sharpness(k))
        else
          system = oscillators_type(states=4, period=1.0_dp, square=[4.0e6_dp, 1.7_dp], damping=[0.1_dp, 0.5_dp], &
            & amplitude=[amplitudes(min(i, size(amplitudes))), 1.0_dp], sharpness=sharpness(k))
        end if
        call solve_floquet(system, accuracy_type(), .true., floquet, failure)
        if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call check_that(error, abs(solution%x0 - system%start()), "<=", solution%error, "bound")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_weak_load

  !> A double multiplier 1 with one eigenvector: no periodic motion, and the fast vibration as exact as elsewhere.
  subroutine test_loose(error)
    type(error_type), allocatable, intent(out) :: error
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    integer :: k

    call solve_floquet(oscillators_type(states=4, period=1.0_dp, square=[4.0e6_dp, 0.0_dp], damping=[0.1_dp, 0.0_dp], &
      & amplitude=[1.0_dp, 1.0_dp]), accuracy_type(), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_multipliers(floquet, .false., multipliers, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 1, 4
      call check_that(error, min(abs(multipliers%log_abs(k)), abs(multipliers%log_abs(k) + 0.05_dp)), "<=", multipliers%error(k), &
        & "bound")
      if (allocated(error)) return
    end do
    call check_that(error, multipliers%verdict(), "==", "undecided", "verdict")
    if (allocated(error)) return
    call solve_periodic(floquet, solution, failure)
    call check_failure(error, failure, what="a periodic motion")
  end subroutine test_loose

  subroutine test_unequal(error)
    type(error_type), allocatable, intent(out) :: error
    type(unequal_type) :: system
    type(floquet_type) :: floquet
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure

    system = unequal_type(states=4, period=1.0_dp)
    call solve_floquet(system, accuracy_type(method="reduced"), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, abs(solution%x0 - system%v), "<=", solution%error, "bound")
    ! The tolerance is 1e-9, |(E - Phi)^-1| is about 1e2.
    call check_that(error, maxval(solution%error), "<", 1.0e-5_dp, "the bound is too wide")
  end subroutine test_unequal

  subroutine unequal_matrix(self, t, p)
    class(unequal_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp), parameter :: u(4) = [1.0_dp, 2.0_dp, 3.0_dp, 4.0_dp]
    real(dp) :: b(4, 4), s(4, 4)
    integer :: k

    associate (unused_system => self, unused_time => t)
    end associate
    b = 0
    b(1, 2) = 3000
    b(2, 1) = -3000
    b(3, 3) = -1
    b(4, 4) = -2
    b(3, 4) = 50
    b(4, 3) = 0.01_dp
    s = -2 * spread(u, 2, 4) * spread(u, 1, 4) / sum(u**2)
    do k = 1, 4
      s(k, k) = s(k, k) + 1
    end do
    p = matmul(s, matmul(b, s))
  end subroutine unequal_matrix

  subroutine unequal_forcing(self, t, f)
    class(unequal_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)
    real(dp) :: p(4, 4)

    call self%matrix(t, p)
    f = -matmul(p, self%v)
  end subroutine unequal_forcing

  subroutine test_accuracy(error)
    type(error_type), allocatable, intent(out) :: error

    call expect(accuracy_type(tolerance=0.0_dp))
    call expect(accuracy_type(tolerance=-1.0_dp))
    call expect(accuracy_type(tolerance=2.0_dp))
    call expect(accuracy_type(steps=-5))

  contains

    !> Slow vibrations, and fast ones, which go another way.
    subroutine expect(accuracy)
      type(accuracy_type), intent(in) :: accuracy
      real(dp), parameter :: squares(2) = [1.0_dp, 1.0e8_dp]
      type(floquet_type) :: floquet
      type(gestell_error), allocatable :: failure
      integer :: k

      do k = 1, 2
        if (allocated(error)) return
        call solve_floquet(oscillators_type(states=2, period=1.0_dp, square=squares(k:k), damping=[0.1_dp], amplitude=[1.0_dp]), &
          & accuracy, .false., floquet, failure)
        call check_failure(error, failure)
      end do
    end subroutine expect

  end subroutine test_accuracy

  subroutine test_refused(error)
    type(error_type), allocatable, intent(out) :: error

    call expect(turning_type(states=6, period=2 * pi, rate=-0.1_dp, frequency=[1.0_dp, 2.0_dp, 3.0_dp]), "too slow")
    call expect(meissner_type(states=2, period=pi, breaks=[pi / 3], a=1.0e6_dp), "jump")
    call expect(turning_type(states=6, period=2 * pi, rate=-0.1_dp, frequency=[200.0_dp, 450.0_dp, 900.0_dp], &
      & swing=2.0_dp), "cannot be used")
    call expect(turning_type(states=6, period=2 * pi, rate=-0.1_dp, frequency=[200.0_dp, 450.0_dp, 900.0_dp], &
      & least_steps=10000), "too suddenly")

  contains

    subroutine expect(system, words)
      class(periodic_system), intent(in) :: system
      character(len=*), intent(in) :: words
      type(floquet_type) :: floquet
      type(gestell_error), allocatable :: failure

      if (allocated(error)) return
      call solve_floquet(system, accuracy_type(method="reduced"), .false., floquet, failure)
      if (.not. allocated(failure)) then
        call test_failed(error, words // ": no refusal")
        return
      end if
      call check_that(error, failure%message, "contains", words)
      if (allocated(error)) return
      ! The same system goes through by integration.
      call solve_floquet(system, accuracy_type(), .false., floquet, failure)
      call check_success(error, failure, words // ": integration")
    end subroutine expect
  end subroutine test_refused

end module test_reduction
