!> Machines without damping: conditions for the verdict `undamped`. Natural frequencies with gyroscopic moments.
module test_undamped
  use checks, only: check_success, check_that
  use exact_machines, only: machine_on_supports, solve, solve_multiplier
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: judgement_type, not_judged, operator(==), operator(>), stable, undamped, undecided, unstable, &
    & verdict_named, verdict_type, worst
  use gestell_floquet_multipliers, only: lie_on_circle, multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_output_result, only: result_type
  use gestell_study_frame_model, only: settle
  use gestell_system_natural_frequencies, only: solve_natural_frequencies
  use reference_machine, only: khang_machine, machine_data
  use space_machines, only: three_planes
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_undamped

  character(len=11), parameter :: models(3) = [character(len=11) :: "rest", "first_order", "exact"]

contains

  subroutine collect_undamped(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("verdicts are ordered by severity", test_order), &
      & new_unittest("the last line starts with the worst verdict whatever the sections' order", test_judge), &
      & new_unittest("isolated error discs prove that multipliers lie on the unit circle", test_circle), &
      & new_unittest("machines without dampers are recognised as undamped", test_lagrangian), &
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
