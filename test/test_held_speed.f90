!> Who holds the speed: a crank that turns evenly in space, against closed forms and conservation laws. Its exact equations are
!> compared with d'Alembert's principle in test_exact.
module test_held_speed
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_model_quantity_driving, only: damper_watts, drive_power, drive_watts, power_rows, stored_energy, torque
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: drive_columns, energy_v
  use gestell_model_quantity_rows, only: guide_forces
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_task_power_drive, only: drive_type, find_drive
  use gestell_task_power_flywheel, only: find_fluctuation, fluctuation_type
  use gestell_system_averaged, only: averaged_system
  use exact_machines, only: machine_on_supports, solve, solve_multiplier
  use reference_cases, only: random_linkage
  use reference_linkage, only: motion_type, move
  use reference_machine, only: khang_machine, machine_data, pi_qp
  use reference_momentum, only: derivative
  use reference_random, only: random_type
  use shaken_ground, only: make, near
  use systems, only: diagonal
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_held_speed

  real(dp), parameter :: zero(3, 3) = 0

contains

  subroutine collect_held_speed(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("M, B, C, h of an evenly turning unbalance agree with hand calculation", test_unbalance), &
      & new_unittest("power balances; the flywheel's motor delivers the mean torque", test_balance), &
      & new_unittest("torque error bounds cover errors of the motion if the speed is held", test_torque_error), &
      & new_unittest("first-order errors fall with the square of the moving masses", test_scale), &
      & new_unittest("averaged M, B, C are the means of the periodic ones", test_averaged), &
      & new_unittest("mass functions and links agree for a crank that turns evenly", test_mass_functions), &
      & new_unittest("a flywheel on a rigid frame conserves energy while its speed fluctuates", test_fluctuation)]
  end subroutine collect_held_speed

  !> The unbalance m c of a crank of inertia j about the joint at O: in space a rotating force and a weight at O, whatever the frame
  !> does.
  subroutine test_unbalance(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: m = 2, c = 0.03_dp, j = 0.01_dp, mass = 20, inertia = 0.9_dp, speed = -31.0_dp, &
      & origin(2) = [0.1_dp, -0.25_dp], gravity(2) = [3.0_dp, -9.0_dp], phases(3) = [0.13_dp, 0.48_dp, 0.81_dp]
    type(linkage_type) :: crank
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp) :: mm(3, 3, 3), b(3, 3, 3), cc(3, 3, 3), h(3, 3), expected(3, 3), force(2), angle
    integer :: k

    call crank%ground("O", [0.0_dp, 0.0_dp], failure)
    call crank%crank("A", "O", 0.07_dp, 0.4_dp, failure)
    call crank%link("crank", "O", "A", m, j, [c, 0.0_dp], failure)
    call new_frame(frame, crank, mass, inertia, origin, diagonal([1.0e4_dp, 2.0e4_dp, 1.0e3_dp]), &
      & diagonal([5.0_dp, 7.0_dp, 0.3_dp]), speed, failure, gravity=gravity, held_by="outside")
    call check_success(error, failure)
    if (allocated(error)) return
    call frame%sample_second_order(phases, mm, b, cc, h)
    expected = diagonal([mass + m, mass + m, inertia + m * sum(origin**2)])
    expected(1, 3) = -m * origin(2)
    expected(2, 3) = m * origin(1)
    expected(3, 1:2) = expected(1:2, 3)
    do k = 1, 3
      angle = speed / abs(speed) * 2 * pi * phases(k) + 0.4_dp
      force = m * c * speed**2 * [cos(angle), sin(angle)]
      ! Roundings of terms of size 1, 7, 2e4 and m c Omega^2 = 60.
      call near(error, [mm(k, :, :)], [expected], 1.0e-14_dp, "M")
      call near(error, [b(k, :, :)], [diagonal([5.0_dp, 7.0_dp, 0.3_dp])], 1.0e-13_dp, "B")
      ! Force and weight keep their direction where the frame turns their arm, the vector to O.
      call near(error, [cc(k, :, :)], [diagonal([1.0e4_dp, 2.0e4_dp, 1.0e3_dp + dot_product(origin, m * gravity + force)])], &
        & 1.0e-11_dp, "C")
      call near(error, h(k, :), [force, origin(1) * force(2) - origin(2) * force(1)], 1.0e-12_dp, "h")
    end do
  end subroutine test_unbalance

  !> d/dt of the energy is the drive's power minus that of the dampers; with a flywheel the motor delivers the mean torque.
  subroutine test_balance(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 512
    character(len=8), parameter :: holders(2) = [character(len=8) :: "outside", "flywheel"]
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(drive_type) :: drive
    type(gestell_error), allocatable :: failure
    logical :: known
    integer :: number

    do number = 1, 6
      machine = random_linkage(number, 1.0_dp, 20.0_dp)
      if (modulo(number, 3) == 1) machine = khang_machine(-360.0_dp, 10.0_dp)
      machine%held_by = holders(1 + modulo(number, 2))
      machine%free(1 + mod(number, 3)) = number /= 3
      if (number > 2) machine%gravity = [30.0_dp, -90.0_dp]
      call make(machine, frame, error)
      if (allocated(error)) return
      call analyse(frame, analysis_options(points=points, rows=guide_forces), accuracy_type(tolerance=1.0e-12_dp), &
        & analysis, failure)
      if (.not. allocated(failure)) call find_drive(analysis%frame, analysis%vibration, drive, known, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      ! 1e-12 of the motion, times orders up to 100.
      associate (h => drive%history(:, :points))
        call near(error, derivative(h(stored_energy, :), frame%period), h(drive_watts, :) - h(damper_watts, :), &
          & 1.0e-9_dp * drive%maximum, "at every time")
        call near(error, [drive%defect()], [0.0_dp], 1.0e-9_dp, "over the turn")
        if (machine%held_by == "flywheel") call near(error, [analysis%frame%motor_torque], [drive%actual%mean], &
          & 1.0e-9_dp * abs(drive%actual%peak), "motor")
      end associate
      if (allocated(error)) return
    end do
  end subroutine test_balance

  !> The same check as for the motor's torque in test_drive.
  subroutine test_torque_error(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: small = 1.0e-6_dp
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(random_type) :: random
    real(dp) :: power(power_rows, 1), changed(power_rows, 1), motion(9, 1), errors(9), claimed, rate
    logical :: known
    integer :: i

    machine = random_linkage(3, 1.0_dp, 20.0_dp)
    machine%held_by = "outside"
    machine%gravity = [200.0_dp, -900.0_dp]
    call make(machine, frame, error)
    if (allocated(error)) return
    call random%start(1, 8)
    rate = 2 * pi / frame%period
    motion(:, 1) = [(random%about_zero(0.1_dp), i = 1, 9)]
    motion(4:6, 1) = rate * motion(4:6, 1)
    motion(7:9, 1) = rate**2 * motion(7:9, 1)
    call drive_power(frame, [0.37_dp], motion, power, known)
    do i = 1, 9
      errors = 0
      errors(i) = small * max(abs(motion(i, 1)), 1.0e-3_dp)
      motion(i, 1) = motion(i, 1) + errors(i)
      call drive_power(frame, [0.37_dp], motion, changed, known, errors, claimed)
      motion(i, 1) = motion(i, 1) - errors(i)
      ! Second order, and roundings of the torque.
      call near(error, [claimed], [abs(changed(torque, 1) - power(torque, 1))], 10 * small * claimed + 1.0e-12_dp * &
        & abs(power(torque, 1)), "row")
      if (allocated(error)) return
    end do
  end subroutine test_torque_error

  subroutine test_scale(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: difference(2, 2)
    integer :: i

    do i = 1, 2
      call compare(0.1_dp**i, difference(:, i), error)
      if (allocated(error)) return
    end do
    ! If the masses are a tenth, terms of third order are a tenth of those of second order.
    call near(error, [log10(difference(1, 1) / difference(1, 2))], [2.0_dp], 0.1_dp, "motion")
    if (.not. allocated(error)) call check_that(error, log10(difference(2, 1) / difference(2, 2)), ">", 1.9_dp, "ln rho_max")

  contains

    subroutine compare(factor, difference, error)
      real(dp), intent(in) :: factor
      real(dp), intent(out) :: difference(2)
      type(error_type), allocatable, intent(out) :: error
      character(len=11), parameter :: models(2) = [character(len=11) :: "exact", "first_order"]
      type(machine_data) :: machine
      class(frame_type), allocatable :: system
      type(multipliers_type) :: rho(2)
      real(dp), dimension(64, 3) :: v, a
      real(dp) :: q(64, 3, 2)
      integer :: n, k

      do n = 1, 2
        machine = machine_on_supports(700.0_dp, factor, held_by="flywheel")
        call solve(machine, models(n), system, error)
        if (.not. allocated(error)) call solve_multiplier(machine, models(n), rho(n), error)
        if (allocated(error)) return
        select type (system)
        class is (varied_frame_type)
          call system%motion%values([(k / 64.0_dp, k = 0, 63)], q(:, :, n), v, a)
        end select
      end do
      difference = [norm2(q(:, :, 1) - q(:, :, 2)), abs(rho(1)%log_abs(1) - rho(2)%log_abs(1))]
    end subroutine compare

  end subroutine test_scale

  subroutine test_averaged(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 256
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(averaged_system) :: model
    real(dp), dimension(points, 3, 3) :: m, b, c
    integer :: number, i

    do number = 1, 5
      machine = random_linkage(number, 1.0_dp, 20.0_dp)
      machine%gravity = [400.0_dp, -900.0_dp]
      machine%held_by = "outside"
      call make(machine, frame, error)
      if (allocated(error)) return
      call frame%sample_second_order([(i / real(points, dp), i = 1, points)], m, b, c)
      call frame%averaged(model)
      call near(error, [model%m], [sum(m, dim=1) / points], 1.0e-10_dp * maxval(abs(m)), "M")
      call near(error, [model%b], [sum(b, dim=1) / points], 1.0e-12_dp * abs(frame%speed) * maxval(abs(m)), "B")
      call near(error, [model%c], [sum(c, dim=1) / points], 1.0e-10_dp * maxval(abs(c)), "C")
      if (allocated(error)) return
    end do
  end subroutine test_averaged

  subroutine test_mass_functions(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: orders = 40, samples = 128, n = 8
    type(machine_data) :: machine
    type(frame_type) :: frame, other
    type(harmonic_mechanism_type) :: mechanism
    type(gestell_error), allocatable :: failure
    type(motion_type) :: motion
    real(dp) :: sums(samples, 5), phases(n)
    real(dp), dimension(n, 3, 3) :: m, b, c, m_same, b_same, c_same
    real(dp), dimension(n, 3) :: h, h_same
    integer :: i, k

    machine = khang_machine(360.0_dp)
    machine%held_by = "outside"
    machine%gravity = [30.0_dp, -90.0_dp]
    call make(machine, frame, error)
    if (allocated(error)) return
    sums = 0
    do k = 1, samples
      motion = move(machine, 2 * pi_qp * (k - 1) / samples)
      do i = 1, size(machine%links)
        associate (mass => machine%links(i)%mass, j => machine%links(i)%inertia, r => motion%center(:, 0, i), &
          & rd => motion%center(:, 1, i), turn => motion%turn(1, i))
          sums(k, :) = sums(k, :) + real([mass * r(1), mass * r(2), mass * sum(r**2), &
            & mass * (r(1) * rd(2) - r(2) * rd(1)) + j * turn, mass * sum(rd**2) + j * turn**2], dp)
        end associate
      end do
    end do
    call new_harmonic_mechanism(mechanism, frame%mechanism%mass, frame%mechanism%inertia, series(sums(:, 1)), series(sums(:, 2)), &
      & series(sums(:, 3)), series(sums(:, 4)), failure, energy=series(sums(:, 5)))
    call new_frame(other, mechanism, frame%mass, frame%inertia, frame%origin, 0 * frame%stiffness, frame%damping, frame%speed, &
      & failure, supports=frame%supports, gravity=machine%gravity, held_by="outside")
    call check_success(error, failure)
    if (allocated(error)) return
    other%damping = frame%damping
    phases = [(0.1_dp * i, i = 1, n)]
    call frame%sample_second_order(phases, m, b, c, h)
    call other%sample_second_order(phases, m_same, b_same, c_same, h_same)
    ! The harmonics fall below 1e-11 before order 40, whose third derivatives are 6e4 times as large.
    call near(error, [m_same], [m], 1.0e-9_dp * maxval(abs(m)), "M")
    call near(error, [b_same], [b], 1.0e-8_dp * maxval(abs(b)), "B")
    call near(error, [c_same], [c], 1.0e-8_dp * maxval(abs(c)), "C")
    call near(error, [h_same], [h], 1.0e-8_dp * maxval(abs(h)), "h")
    if (allocated(error)) return
    call frame%remember(phases)
    call frame%sample_second_order(phases, m_same, b_same, c_same, h_same)
    call near(error, [m_same, b_same, c_same, h_same], [m, b, c, h], 0.0_dp, "reused")
    if (allocated(error)) return
    deallocate(mechanism%energy)
    call new_frame(other, mechanism, frame%mass, frame%inertia, frame%origin, frame%stiffness, zero, frame%speed, failure, &
      & held_by="flywheel")
    call check_failure(error, failure, what="without the energy")
    if (allocated(error)) return
    call new_harmonic_mechanism(mechanism, 1.0_dp, 0.0_dp, [1.0_dp], [0.0_dp], [1.0_dp], [1.0_dp], failure, energy=[0.5_dp])
    call new_frame(other, mechanism, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], zero, zero, 1.0_dp, failure, held_by="outside")
    call check_failure(error, failure, what="an energy that no masses have")

  contains

    !> Mean, factors of cos and sin, from equidistant samples.
    pure function series(values) result(coefficients)
      real(dp), intent(in) :: values(samples)
      real(dp) :: coefficients(1 + 2 * orders), angles(samples)
      integer :: order

      angles = [(2 * pi * (order - 1) / samples, order = 1, samples)]
      coefficients(1) = sum(values) / samples
      do order = 1, orders
        coefficients(2 * order) = 2 * sum(values * cos(order * angles)) / samples
        coefficients(2 * order + 1) = 2 * sum(values * sin(order * angles)) / samples
      end do
    end function series

  end subroutine test_mass_functions

  !> Without dampers and frame (J_f + K) theta'^2 is constant; the reported fluctuation is accurate to about its square.
  subroutine test_fluctuation(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 720
    type(frame_type) :: frame
    type(fluctuation_type) :: claimed
    real(dp) :: drive(points, drive_columns), power(power_rows, points), motion(9, points), speed(points), miss(2), exact
    logical :: known
    integer :: i, k

    call make(khang_machine(-360.0_dp), frame, error)
    if (allocated(error)) return
    motion = 0
    call drive_power(frame, [(real(k, dp) / points, k = 0, points - 1)], motion, power, known)
    call frame%mechanism%tabulate_drive(frame%crank_angles([(real(k, dp) / points, k = 0, points - 1)]), drive, known)
    do i = 1, 2
      frame%flywheel_inertia = 10.0_dp**i * maxval(drive(:, energy_v))
      call find_fluctuation(frame, power(torque, :), 1.0e-9_dp, points, claimed)
      speed = 1 / sqrt(frame%flywheel_inertia + drive(:, energy_v))
      speed = speed / (sum(speed) / points)
      exact = maxval(speed) - minval(speed)
      miss(i) = abs(claimed%irregularity - exact) / exact
      ! The middle of the rows, half a degree apart, is the mean over time but for the square.
      call near(error, claimed%history(:points) / frame%speed, speed - 1, exact**2, "history")
      call near(error, [claimed%maximum, claimed%least], [maxval(claimed%history), minval(claimed%history)], &
        & 1.0e-4_dp * claimed%maximum, "ends")
      call near(error, [claimed%error], [1.0e-9_dp * frame%period / (2 * claimed%inertia * abs(frame%speed))], 1.0e-11_dp, "error")
    end do
    if (.not. allocated(error)) call check(error, miss(2) < miss(1) / 5 .and. miss(1) < 2 * claimed%irregularity * 10, &
      & more="the square")
  end subroutine test_fluctuation

end module test_held_speed
