!> Critical speeds, against direct solutions and closed forms.
module test_campbell_critical
  use checks, only: check_success, check_that
  use data_files, only: machine_of_file
  use families, only: machine_family
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet
  use gestell_model_frame, only: frame_type
  use gestell_task_campbell, only: campbell_options, campbell_type, solve_campbell
  use gestell_task_campbell_crossings, only: crossing_type, find_crossings
  use gestell_task_critical, only: amplitude, critical_type, find_critical, force, no_peak, peak, self_excited, unbounded
  use gestell_study_vibration, only: solve_vibration, vibration_type
  use gestell_system_periodic, only: periodic_system
  use machines, only: frame_of_machine
  use reference_machine, only: joint_data, khang_machine, link_data, machine_data
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_campbell_critical

contains

  subroutine collect_campbell_critical(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the critical speed of an unbalanced rotor agrees with its closed form", test_unbalance), &
      & new_unittest("undamped, overdamped and unstable crossings are reported as such", test_outcomes), &
      & new_slow("sharp peaks of the paper's machine lie at the reported critical speeds", test_sharp), &
      & new_unittest("each peak of the force is assigned to exactly one crossing", test_peak_assignment), &
      & new_slow("with more damping the critical speeds are exactly the peaks of the vibration", test_all)]
  end subroutine collect_campbell_critical

  subroutine solve(machine, from, to, count, orders, critical, error)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: from, to
    integer, intent(in) :: count, orders
    type(critical_type), allocatable, intent(out) :: critical(:)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: family
    type(campbell_options) :: options
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: crossings(:)
    type(gestell_error), allocatable :: failure
    integer :: i

    options%orders = orders
    call frame_of_machine(machine, family%frame, failure)
    if (.not. allocated(failure)) call solve_campbell(family, [(from + (to - from) * (i - 1) / (count - 1), i = 1, count)], &
      & options, campbell, failure)
    if (.not. allocated(failure)) call find_crossings(family, options, campbell, crossings, failure)
    if (.not. allocated(failure)) call find_critical(family, options, crossings, critical, failure)
    call check_success(error, failure)
  end subroutine solve

  !> A frame free along x with a mass on the crank: amplitude m r W^2 / |c - W^2 M + i W b| in order 1, zero in the other
  !> orders.
  type(machine_data) function unbalance(damping_ratio) result(machine)
    real(dp), intent(in) :: damping_ratio

    machine%joints = [joint_data("ground", position=[0.0_dp, 0.0_dp]), joint_data("crank", ends=[1, 0], radius=0.1_dp)]
    machine%links = [link_data(1, 2, 2.0_dp, 0.01_dp, [0.1_dp, 0.0_dp])]
    machine%frame_mass = 18
    machine%frame_inertia = 1
    allocate(machine%supports(0))
    machine%free = [.true., .false., .false.]
    machine%foundation_stiffness(1, 1) = 20 * 30.0_dp**2
    machine%foundation_damping(1) = 2 * damping_ratio * 30 * 20
    machine%speed_rpm = 300
  end function unbalance

  !> With x = W / w the response x^2 / sqrt((1 - x^2)^2 + (2 D x)^2) has its maximum at x = 1 / sqrt(1 - 2 D^2), with the value
  !> 1 / (2 D sqrt(1 - D^2)).
  subroutine test_unbalance(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: ratios(4) = [1.0e-5_dp, 1.0e-3_dp, 0.03_dp, 0.1_dp]
    type(critical_type), allocatable :: critical(:)
    real(dp) :: exact, height
    integer :: i

    do i = 1, size(ratios)
      associate (d => ratios(i))
        call solve(unbalance(d), 80.0_dp, 500.0_dp, 4, 3, critical, error)
        if (allocated(error)) return
        exact = 30 * 60 / (2 * pi) / sqrt(1 - 2 * d**2)
        height = 2 * 0.1_dp / 20 / (2 * d * sqrt(1 - d**2))
        call check(error, size(critical), 3, more="crossings")
        if (allocated(error)) return
        call check_that(error, critical(1)%outcome, "==", peak, "outcomes")
        call check_that(error, critical(2:)%outcome, "==", no_peak, "outcomes")
        if (allocated(error)) return
        associate (c => critical(1))
          ! Within the error, plus the error of the maximum's place due to noise of 1e-9 / D in its flat top.
          call check_that(error, abs(c%speed(amplitude) - exact), "<=", c%error(amplitude) + sqrt(1.0e-9_dp / d) * c%half_width, &
            & "speed")
          call check_that(error, c%error(amplitude), "<", 0.01_dp * c%half_width, "the error bound is not too wide")
          ! Phi(T) to 1e-9, times up to 1 / (2 pi D).
          call check_that(error, abs(c%height(amplitude) / height - 1), "<", 1.0e-6_dp + 1.0e-9_dp / d, "height")
          ! D w over the order: D of the speed, whose own damped frequency is less by D^2 / 2.
          call check_that(error, abs(c%half_width / (d * 30 * 60 / (2 * pi)) - 1), "<", 1.0e-3_dp, "half width")
          call check_that(error, c%share, ">", 0.999_dp, "share")
          if (allocated(error)) return
        end associate
      end associate
    end do
  end subroutine test_unbalance

  subroutine test_outcomes(error)
    type(error_type), allocatable, intent(out) :: error
    type(critical_type), allocatable :: critical(:)

    call solve(unbalance(0.0_dp), 80.0_dp, 500.0_dp, 4, 3, critical, error)
    if (allocated(error)) return
    call check(error, critical(1)%outcome, unbounded, more="undamped")
    if (allocated(error)) return
    ! The amplitude rises with the speed for D > 1 / sqrt(2).
    call solve(unbalance(0.8_dp), 80.0_dp, 500.0_dp, 4, 1, critical, error)
    if (allocated(error)) return
    call check_that(error, size(critical), "==", 1, "much damping")
    call check_that(error, critical%outcome, "==", no_peak, "much damping")
    if (allocated(error)) return
    call check(error, .not. any(critical%found(amplitude)), more="numbers of no peak")
    if (allocated(error)) return
    ! The paper's machine at 1216 rpm.
    call solve(khang_machine(240.0_dp), 1200.0_dp, 1230.0_dp, 3, 1, critical, error)
    if (allocated(error)) return
    call check_that(error, size(critical), "==", 1, "unstable")
    call check_that(error, critical%outcome, "==", self_excited, "unstable")
  end subroutine test_outcomes

  !> The vibration at a speed: the amplitude of an order, all coordinates together (weighted with the frame's mass and its
  !> radius of gyration, 0.2 m), computed through the public interface.
  subroutine direct(machine, speed, order, value, error)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: speed
    integer, intent(in) :: order
    real(dp), intent(out) :: value
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: other
    type(frame_type) :: frame
    type(floquet_type) :: floquet
    type(vibration_type) :: vibration
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: weight(3) = [1.0_dp, 1.0_dp, 0.2_dp]
    integer :: i

    other = machine
    other%speed_rpm = speed
    call frame_of_machine(other, frame, failure)
    if (.not. allocated(failure)) call solve_floquet(frame, accuracy_type(), .true., floquet, failure)
    if (.not. allocated(failure)) call solve_vibration(frame, floquet, 64, 20, vibration, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    value = 0
    do i = 1, 3
      if (order == 0) value = hypot(value, weight(i) * norm2(vibration%series(i)%amplitude))
      if (order > 0) value = hypot(value, weight(i) * vibration%series(i)%amplitude(order))
    end do
  end subroutine direct

  !> At each critical speed the amplitude of the order is larger than 0.7 half widths away, by about 1 / sqrt(1.5), and much
  !> larger than three half widths away.
  subroutine test_sharp(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: beside(5) = [-3.0_dp, -0.7_dp, 0.0_dp, 0.7_dp, 3.0_dp]
    type(critical_type), allocatable :: critical(:)
    real(dp) :: values(5)
    integer :: i, k

    call solve(khang_machine(240.0_dp), 230.0_dp, 420.0_dp, 5, 6, critical, error)
    if (allocated(error)) return
    ! 20.2625 Hz in the orders 3 to 5, 32.047 Hz in 5 and 6.
    call check_that(error, size(critical), "==", 5, "crossings")
    call check_that(error, critical%outcome, "==", peak, "crossings")
    if (allocated(error)) return
    do i = 1, size(critical)
      associate (c => critical(i))
        do k = 1, 5
          call direct(khang_machine(240.0_dp), c%speed(amplitude) + beside(k) * c%half_width, nint(c%crossing%order), values(k), &
            & error)
          if (allocated(error)) return
        end do
        ! 1 / sqrt(1 + s^2) at s half widths: 0.82 and 0.32.
        call check_that(error, abs(values([2, 4]) / values(3) - 0.82_dp), "<", 0.03_dp, "0.7 half widths away")
        call check_that(error, abs(values([1, 5]) / values(3) - 0.32_dp), "<", 0.05_dp, "three half widths away")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_sharp

  !> The compressor: two crossings at 334 and 337 rpm with half widths that overlap, and one peak of the force.
  subroutine test_peak_assignment(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(critical_type), allocatable :: critical(:)
    type(gestell_error), allocatable :: failure
    integer :: i, k, shared

    call machine_of_file("data/compressor.nml", machine, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call solve(machine, 300.0_dp, 400.0_dp, 5, 3, critical, error)
    if (allocated(error)) return
    shared = 0
    do i = 1, size(critical)
      do k = 1, 2
        if (.not. critical(i)%found(k)) cycle
        associate (c => critical(i))
          ! One half width, the distance of the samples, and half of the locked interval.
          call check_that(error, abs(c%speed(k) - c%crossing%speed), "<", 1.5_dp * c%half_width &
            & + abs(c%crossing%ends(2) - c%crossing%ends(1)), "too far")
          call check_that(error, c%prominence(k), ">", 1.01_dp, "not prominent")
          if (allocated(error)) return
        end associate
      end do
      if (critical(i)%found(force)) shared = shared + count(abs(critical%speed(force) - critical(i)%speed(force)) < 0.1_dp) - 1
    end do
    call check(error, any(critical%crossing%mode == 1 .and. critical%found(force)), more="shared")
    if (allocated(error)) return
    call check_that(error, shared, "==", 0, "shared")
  end subroutine test_peak_assignment

  !> With forty times the damping every maximum of the whole vibration over a range is a critical speed, and every critical
  !> speed whose order dominates the vibration is such a maximum.
  subroutine test_all(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: from = 225, to = 430, step = 0.5_dp
    integer, parameter :: count = nint((to - from) / step) + 1
    type(machine_data) :: machine
    type(critical_type), allocatable :: critical(:)
    real(dp) :: values(count)
    logical :: met(count)
    integer :: i, k

    machine = khang_machine(240.0_dp)
    machine%foundation_damping = 40 * machine%foundation_damping
    do i = 1, count
      call direct(machine, from + step * (i - 1), 0, values(i), error)
      if (allocated(error)) return
    end do
    call solve(machine, from, to, 6, 6, critical, error)
    if (allocated(error)) return
    met = .false.
    do k = 1, size(critical)
      associate (c => critical(k))
        if (c%outcome /= peak) cycle
        i = 1 + nint((c%speed(amplitude) - from) / step)
        i = i - 3 + maxloc(values(max(1, i - 2):min(count, i + 2)), dim=1)
        if (i > 1 .and. i < count) then
          if (values(i) > values(i - 1) .and. values(i) > values(i + 1)) met(i) = .true.
        end if
        call check(error, c%share < 0.6_dp .or. met(i), more="no peak at a critical speed")
        if (allocated(error)) return
      end associate
    end do
    do i = 2, count - 1
      if (.not. (values(i) > values(i - 1) .and. values(i) > values(i + 1))) cycle
      call check(error, met(i), more="a peak that is not listed as critical speed")
      if (allocated(error)) return
    end do
    ! 20.2625 Hz in the orders 3 to 5, 32.047 Hz in 5 and 6; some of them are too weak to be visible in the whole vibration.
    call check_that(error, size(critical), "==", 5, "peaks")
    if (allocated(error)) return
    call check(error, any(met), more="peaks")
  end subroutine test_all

end module test_campbell_critical
