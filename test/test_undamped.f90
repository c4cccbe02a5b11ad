!> Machines without damping: conditions for the verdict `undamped`. Natural frequencies with gyroscopic moments.
module test_undamped
  use checks, only: check_success, check_that
  use exact_machines, only: machine_on_supports, solve, solve_multiplier
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: judgement_type, not_judged, operator(==), operator(>), stable, undamped, undecided, unstable, &
    & verdict_named, verdict_type, worst
  use gestell_floquet_multipliers, only: lie_on_circle, multipliers_type
  use gestell_floquet_multipliers_krein, only: krein_signs
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_math_lapack, only: eigensystem
  use gestell_model_frame, only: frame_type
  use gestell_output_result, only: result_type
  use gestell_study_frame_model, only: settle
  use gestell_system_natural_frequencies, only: solve_natural_frequencies
  use gestell_system_second_order, only: second_order_system
  use reference_machine, only: khang_machine, machine_data
  use space_machines, only: three_planes
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_undamped

  character(len=11), parameter :: models(3) = [character(len=11) :: "rest", "first_order", "exact"]

  !> q1'' + w1^2 q1 + s q2 = 0, q2'' + w2^2 q2 + s q1 = 0 with s = coupling cos(2 pi t / T): without damping.
  type, extends(second_order_system) :: pair_type
    real(dp) :: w(2) = 0, coupling = 0
  contains
    procedure :: matrices => pair_matrices, conserves => pair_conserves
  end type pair_type

contains

  subroutine collect_undamped(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("verdicts are ordered by severity", test_order), &
      & new_unittest("the last line starts with the worst verdict whatever the sections' order", test_judge), &
      & new_unittest("isolated error discs prove that multipliers lie on the unit circle", test_circle), &
      & new_unittest("Krein's form of equal frequencies is definite unless energies differ in sign", test_signs), &
      & new_unittest("modes coupled at their difference frequency are undamped, at their sum never", test_meeting), &
      & new_slow("machines without dampers are recognised as undamped", test_lagrangian), &
      & new_unittest("machines in space are undamped only without any damper", test_space), &
      & new_unittest("the four-bar is undamped, stable with damper, unstable in a tongue", test_four_bar), &
      & new_unittest("gyroscopic natural frequencies agree with closed forms", test_gyroscopic)]
  end subroutine collect_undamped

  subroutine test_order(error)
    type(error_type), allocatable, intent(out) :: error
    type(verdict_type) :: all(5)
    integer :: i, k

    all = [not_judged, stable, undamped, undecided, unstable]
    do i = 1, size(all)
      call check(error, verdict_named(all(i)%word()) == all(i), more="by its word")
      if (allocated(error)) return
      do k = 1, size(all)
        call check(error, (all(i) > all(k)) .eqv. (i > k), more="order")
        if (allocated(error)) return
        call check(error, worst(all(i), all(k)) == all(max(i, k)), more="worst")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_order

  !> Sections report their verdicts in any order.
  subroutine test_judge(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=17), parameter :: extents(3) = [character(len=17) :: "", " at 5 of 5 speeds", " at 1 of 2 speeds"]
    integer, parameter :: orders(3, 6) = reshape([1, 2, 3, 1, 3, 2, 2, 1, 3, 2, 3, 1, 3, 1, 2, 3, 2, 1], [3, 6])
    type(verdict_type) :: verdicts(3)
    type(result_type), allocatable :: result
    integer :: i, k

    verdicts = [stable, undecided, unstable]
    do i = 1, size(orders, 2)
      if (allocated(result)) deallocate(result)
      allocate(result)
      call result%begin(.false.)
      do k = 1, 3
        call result%judge(judgement_type(verdicts(orders(k, i)), trim(extents(orders(k, i)))))
      end do
      call check_that(error, result%summary_line(), "contains", "VERDICT  UNSTABLE at 1 of 2 speeds; UNDECIDED at 5 of 5 speeds")
      if (allocated(error)) return
      call check(error, result%worst == unstable, more="of all")
      if (allocated(error)) return
    end do
  end subroutine test_judge

  subroutine test_circle(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: small = 1.0e-10_dp, zero(4) = 0

    call expect([0.3_dp, -0.3_dp, 1.1_dp, -1.1_dp], zero, small, [.true., .true., .true., .true.], "apart")
    ! If two pairs meet within rounding, each may be off the circle, together with its mirror image.
    call expect([0.3_dp, -0.3_dp, 0.3_dp + small, -0.3_dp - small], zero, small, [.false., .false., .false., .false.], "two pairs")
    call expect([0.3_dp, -0.3_dp, 0.3_dp, -0.3_dp], [1.0e-3_dp, 1.0e-3_dp, -1.0e-3_dp, -1.0e-3_dp], small, &
      & [.false., .false., .false., .false.], "off the circle")
    call expect([0.0_dp, 0.0_dp, 1.1_dp, -1.1_dp], [1.0e-8_dp, -1.0e-8_dp, 0.0_dp, 0.0_dp], small, &
      & [.false., .false., .true., .true.], "a real pair")
    call expect([pi, -pi + small, 1.1_dp, -1.1_dp], zero, small, [.false., .false., .true., .true.], "across the branch cut")
    call expect([0.3_dp, -0.3_dp, 1.1_dp, -1.1_dp], zero, 0.3_dp, [.false., .false., .true., .true.], "wide discs")
    call expect([0.3_dp, -0.3_dp, 1.1_dp, -1.1_dp], zero, 2.0_dp, [.false., .false., .false., .false.], "lost")

  contains

    subroutine expect(arg, log_abs, bound, wanted, what)
      real(dp), intent(in) :: arg(4), log_abs(4), bound
      logical, intent(in) :: wanted(4)
      character(len=*), intent(in) :: what

      if (allocated(error)) return
      call check_that(error, lie_on_circle(log_abs, arg, spread(bound, 1, 4)), "==", wanted, what)
    end subroutine expect

  end subroutine test_circle

  !> Oscillators q'' + k w^2 q = 0 with k = 1 or -1 times the mass: x = (1, i w) gives x* Omega x = 2 i w m. The vectors of equal
  !> multipliers are arbitrary: an error of 1e-10 decides them.
  subroutine test_signs(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: angle = 0.7_dp

    call expect([1.0_dp, 1.0_dp, 1.0_dp], [angle, angle, angle], 1.0e-10_dp, -1, "three equal modes")
    call expect([1.0_dp, 1.0_dp, 1.0_dp], [angle, angle + 1.0e-9_dp, 2.0_dp], 1.0e-6_dp, -1, "close modes")
    call expect([-1.0_dp, -1.0_dp, -1.0_dp], [angle, angle, 2.0_dp], 1.0e-10_dp, 1, "negative energies")
    call expect([1.0_dp, -1.0_dp, 1.0_dp], [angle, angle, 2 * angle], 1.0e-10_dp, 0, "opposite energies")
    call expect([1.0_dp, -1.0_dp, 1.0_dp], [angle, angle + 1.0e-9_dp, 2 * angle], 1.0e-10_dp, 0, "close opposite energies")
    call expect([1.0_dp, 1.0_dp, 1.0_dp], [angle, 2 * pi - angle, 2 * angle], 1.0e-10_dp, 0, "a mode meets another's conjugate")
    call expect([1.0_dp, 1.0_dp, 1.0_dp], [2 * pi, pi, angle], 1.0e-10_dp, 0, "real pairs")
    call expect([1.0_dp, 1.0_dp, 1.0_dp], [angle, angle, 2.0_dp], 1.0e-2_dp, 0, "too large an error")

  contains

    !> `wanted`: sign of the first mode's multiplier in the upper half plane. The sign of its conjugate is the opposite.
    subroutine expect(mass, turn, change, wanted, what)
      real(dp), intent(in) :: mass(3), turn(3), change
      integer, intent(in) :: wanted
      character(len=*), intent(in) :: what
      real(dp) :: phi(6, 6), form(6, 6), e(6, 6)
      complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
      type(gestell_error), allocatable :: failure
      integer, allocatable :: signs(:)
      integer :: i, k

      if (allocated(error)) return
      phi = 0
      form = 0
      do k = 1, 3
        phi(k, k) = cos(turn(k))
        phi(k, k + 3) = sin(turn(k))
        phi(k + 3, k) = -sin(turn(k))
        phi(k + 3, k + 3) = cos(turn(k))
        form(k, k + 3) = mass(k)
        form(k + 3, k) = -mass(k)
      end do
      e = reshape([(sin(real(i * i, dp)), i = 1, 36)], [6, 6])
      call eigensystem(phi + change * e / norm2(e), rho, right, left, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      signs = krein_signs(rho, spread(100 * change, 1, 6), left, change, form)
      i = minloc(abs(rho - exp(cmplx(0, turn(1), dp))), dim=1)
      k = minloc(abs(rho - exp(cmplx(0, -turn(1), dp))), dim=1)
      call check_that(error, signs([i, k]), "==", [wanted, -wanted], what)
    end subroutine expect

  end subroutine test_signs

  !> If w2 - w1 or w1 + w2 is the frequency of the coupling, two multipliers are equal without coupling. Only the sum makes the
  !> modes grow, by coupling / (4 sqrt(w1 w2)) to first order; the modes then have opposite signs of Krein's form.
  subroutine test_meeting(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: couplings(3) = [1.0e-13_dp, 1.0e-10_dp, 1.0e-2_dp]
    type(pair_type) :: system
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(gestell_error), allocatable :: failure
    integer :: i, sense

    system%states = 4
    system%w = [1.0_dp, 2.7_dp]
    do i = 1, size(couplings)
      do sense = -1, 1, 2
        system%coupling = couplings(i)
        system%period = 2 * pi / (system%w(2) + sense * system%w(1))
        call solve_floquet(system, accuracy_type(tolerance=1.0e-11_dp), .false., floquet, failure)
        if (.not. allocated(failure)) call solve_multipliers(floquet, .false., multipliers, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        if (sense < 0) call check_that(error, multipliers%verdict(), "==", "undamped", "difference")
        if (sense > 0) call check_that(error, multipliers%verdict(), "/=", "undamped", "sum")
        ! The second order changes the growth by the square of the coupling.
        if (sense > 0 .and. i == 3) call check_that(error, abs(multipliers%log_abs(1) / system%period - couplings(i) &
          & / (4 * sqrt(product(system%w)))), "<=", couplings(i)**2, "growth")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_meeting

  subroutine pair_matrices(self, t, m, b, c)
    class(pair_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    m = reshape([1.0_dp, 0.0_dp, 0.0_dp, 1.0_dp], [2, 2])
    b = 0
    c = self%coupling * cos(2 * pi * t / self%period)
    c(1, 1) = self%w(1)**2
    c(2, 2) = self%w(2)**2
  end subroutine pair_matrices

  logical function pair_conserves(self, chosen) result(conserves)
    class(pair_type), intent(in) :: self
    integer, intent(in) :: chosen(:)

    conserves = self%states == 4 .and. size(chosen) > 0
  end function pair_conserves

  !> With supports of all kinds, weights, and all holders of the speed.
  subroutine test_lagrangian(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=8), parameter :: holders(3) = [character(len=8) :: "motor", "flywheel", "outside"]
    type(machine_data) :: machine
    class(frame_type), allocatable :: system
    integer :: i, k

    do k = 1, size(holders)
      do i = 1, size(models)
        machine = machine_on_supports(700.0_dp, 10.0_dp, [3.0_dp, -9.0_dp], turning=.true., held_by=trim(holders(k)))
        call undamp(machine)
        call solve(machine, trim(models(i)), system, error)
        if (allocated(error)) return
        call check_lagrangian(system, trim(models(i)) // ", " // trim(holders(k)), error)
        if (allocated(error)) return
        machine%supports(2)%damping = [0.0_dp, 1.0e-12_dp]
        call solve(machine, trim(models(i)), system, error)
        if (allocated(error)) return
        call check_that(error, system%conserves([1, 2, 3]), "==", .false., "with a damper, " // models(i))
        if (allocated(error)) return
      end do
    end do
  end subroutine test_lagrangian

  subroutine test_space(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    class(frame_type), allocatable :: system
    type(gestell_error), allocatable :: failure
    integer :: i

    do i = 2, 3
      call three_planes(60.0_dp, 0.0_dp, frame, failure)
      if (.not. allocated(failure)) call settle(frame, trim(models(i)), accuracy_type(tolerance=1.0e-11_dp), system, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_lagrangian(system, "in space, " // trim(models(i)), error)
      if (allocated(error)) return
      call three_planes(60.0_dp, 1.0e-9_dp, frame, failure)
      if (.not. allocated(failure)) call settle(frame, trim(models(i)), accuracy_type(tolerance=1.0e-11_dp), system, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, system%conserves([1, 2, 3, 4, 5, 6]), "==", .false., "with dampers")
      if (allocated(error)) return
    end do
  end subroutine test_space

  pure subroutine undamp(machine)
    type(machine_data), intent(inout) :: machine
    integer :: k

    machine%foundation_damping = 0
    do k = 1, size(machine%supports)
      machine%supports(k)%damping = 0
    end do
  end subroutine undamp

  !> Phi' Omega Phi = Omega for the conserved form Omega, to the accuracy of Phi and of the motion.
  subroutine check_form(system, what, error)
    class(frame_type), intent(in) :: system
    character(len=*), intent(in) :: what
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp), dimension(system%states, system%states) :: phi, form, d

    call solve_monodromy(system, accuracy_type(tolerance=1.0e-11_dp), .false., monodromy, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, allocated(monodromy%form), more="form, " // what)
    if (allocated(error)) return
    d = spread(monodromy%scale, 1, system%states)
    phi = monodromy%phi * d / transpose(d)
    form = monodromy%form * d * transpose(d)
    call check_that(error, norm2(matmul(transpose(phi), matmul(form, phi)) - form), "<=", (2 * monodromy%norm * monodromy%error &
      & + 1.0e-9_dp * monodromy%norm**2) * norm2(form), "form, " // what)
  end subroutine check_form

  !> M q'' + B q' + C q = 0 are the equations of a Lagrangian q' M q'/2 + q' N q - q' K q/2 if and only if, with the antisymmetric
  !> part G of B, B - G = dM/dt and C - C' = dG/dt. Derivatives of trigonometric polynomials through equidistant samples.
  subroutine check_lagrangian(system, what, error)
    class(frame_type), intent(in) :: system
    character(len=*), intent(in) :: what
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 512
    real(dp), dimension(n, size(system%free), size(system%free)) :: m, b, c
    real(dp) :: by_phase(n, n), fastest
    integer :: f, i, k

    f = size(system%free)
    call check_that(error, system%conserves([(i, i = 1, f)]), "==", .true., "conserves, " // what)
    if (allocated(error)) return
    call system%sample_second_order([((i - 1.0_dp) / n, i = 1, n)], m, b, c)
    fastest = max(abs(system%speed), maxval(abs(c)) / maxval(abs(m)) / abs(system%speed))
    by_phase = 0
    do k = 1, n
      do i = 1, n
        if (i /= k) by_phase(i, k) = pi / system%period * (-1)**(i - k) / tan(pi * (i - k) / n)
      end do
    end do
    do k = 1, f
      do i = 1, f
        associate (scale => sqrt(maxval(abs(m(:, i, i))) * maxval(abs(m(:, k, k)))) * abs(system%speed))
          ! The motion is accurate to 1e-11; a derivative loses two more digits.
          call check_that(error, maxval(abs((b(:, i, k) + b(:, k, i)) / 2 - matmul(by_phase, m(:, i, k)))), "<=", &
            & 1.0e-8_dp * scale, "B, " // what)
          call check_that(error, maxval(abs(c(:, i, k) - c(:, k, i) - matmul(by_phase, b(:, i, k) - b(:, k, i)) / 2)), "<=", &
            & 1.0e-8_dp * scale * fastest, "C, " // what)
          if (allocated(error)) return
        end associate
      end do
    end do
    call check_form(system, what, error)
  end subroutine check_lagrangian

  !> The paper's machine at 240 rpm, far from its tongues, where it is undamped by all equations; and in the tongue at 2426 rpm with
  !> ten times the moving masses.
  subroutine test_four_bar(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(multipliers_type) :: multipliers
    integer :: i

    do i = 1, size(models)
      machine = khang_machine(240.0_dp)
      call undamp(machine)
      call solve_multiplier(machine, trim(models(i)), multipliers, error)
      if (allocated(error)) return
      call check_that(error, multipliers%verdict(), "==", "undamped", models(i))
      if (allocated(error)) return
      machine%foundation_damping(1) = 1.0e-9_dp
      call solve_multiplier(machine, trim(models(i)), multipliers, error)
      if (allocated(error)) return
      call check_that(error, multipliers%verdict(), "/=", "undamped", "with a damper")
      if (allocated(error)) return
      machine = khang_machine(2426.0_dp, 10.0_dp)
      call undamp(machine)
      call solve_multiplier(machine, trim(models(i)), multipliers, error)
      if (allocated(error)) return
      call check_that(error, multipliers%verdict() == "unstable", "==", multipliers%log_abs(1) > multipliers%error(1), "verdict")
      if (allocated(error)) return
    end do
  end subroutine test_four_bar

  !> A rotor on bearings (It w^2 -+ Ip W w - k = 0), a free rotor (0 and Ip W / It), and a rotor on unstable springs that is
  !> stable only if it turns fast.
  subroutine test_gyroscopic(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: transverse = 0.28791667_dp, polar = 0.5625_dp, k = 400.0_dp
    real(dp) :: g

    g = polar * 207.1_dp * pi / 30
    call expect(k, g, (sqrt(g**2 + 4 * transverse * k) + [-g, g]) / (2 * transverse), "on bearings")
    call expect(k, 0.0_dp, spread(sqrt(k / transverse), 1, 2), "at rest")
    call expect(0.0_dp, g, [0.0_dp, g / transverse], "free")
    call expect(-k, 4 * sqrt(transverse * k), (4 * sqrt(transverse * k) + [-1, 1] * sqrt(12 * transverse * k)) / (2 * transverse), &
      & "held up")
    call expect(-k, 0.0_dp, spread(-sqrt(k / transverse), 1, 2), "falling")

  contains

    subroutine expect(stiffness, gyroscopic, wanted, what)
      real(dp), intent(in) :: stiffness, gyroscopic, wanted(2)
      character(len=*), intent(in) :: what
      real(dp), parameter :: unit(2, 2) = reshape([1.0_dp, 0.0_dp, 0.0_dp, 1.0_dp], [2, 2]), &
        & turn(2, 2) = reshape([0.0_dp, -1.0_dp, 1.0_dp, 0.0_dp], [2, 2])
      real(dp), allocatable :: found(:)
      type(gestell_error), allocatable :: failure

      if (allocated(error)) return
      call solve_natural_frequencies(transverse * unit, gyroscopic * turn, stiffness * unit, found, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      ! Roundings of a few operations.
      call check_that(error, abs(found - wanted), "<=", 1.0e-13_dp * maxval(abs(wanted)), what)
    end subroutine expect

  end subroutine test_gyroscopic

end module test_undamped
