!> Weights: static loads, pendulums in closed form, a machine turned together with gravity, the work of lifting.
module test_weights
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type, impossible_mechanism
  use gestell_base_kinds, only: dp, pi
  use gestell_math_series_trigonometric, only: series_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_quantity_driving, only: damper_watts, drive_watts, rigid_torque, stored_energy
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_mounting, only: support_type
  use gestell_model_quantity_rows, only: guide_forces
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_task_power_drive, only: drive_type, find_drive
  use gestell_study_frame_model, only: settle
  use gestell_task_forces_reactions, only: find_reactions, reaction_type, static_force
  use gestell_system_averaged, only: averaged_system
  use machines, only: frame_of_machine
  use reference_cases, only: random_linkage
  use reference_exact, only: sag
  use reference_machine, only: khang_machine, machine_data
  use reference_momentum, only: derivative
  use shaken_ground, only: make, near
  use systems, only: diagonal
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_weights

  real(dp), parameter :: g = 9.80665_dp, zero(3, 3) = 0

contains

  subroutine collect_weights(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the frequency of a hanging body agrees with the closed form", test_hanging), &
      & new_unittest("weight stiffens a frame hanging from its support and destabilises one standing", test_support_pendulum), &
      & new_unittest("turning machine and gravity by 90 degrees turns the motion", test_turned), &
      & new_unittest("the averaged stiffness is the mean of the periodic one", test_averaged_mean), &
      & new_unittest("power balances with weights; lifting takes no power per turn", test_balance), &
      & new_unittest("static loads of the supports agree with hand calculation", test_static), &
      & new_unittest("the least compression of a support agrees with a fine history", test_least), &
      & new_unittest("weights that no spring carries are an error", test_unsupported), &
      & new_unittest("with zero gravity weights are inactive and change nothing", test_zero_gravity)]
  end subroutine collect_weights

  !> A body of mass m at rest at (0, -l), or above, the frame turning about F on a torsional spring.
  subroutine test_hanging(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: m = 3, inertia = 0.4_dp, own = 0.05_dp, l = 0.7_dp, c = 60
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(averaged_system) :: model
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: frequencies(:)
    real(dp) :: place, expected
    integer :: side

    call new_harmonic_mechanism(mechanism, m, own, [0.0_dp], [0.0_dp], [0.0_dp], [0.0_dp], failure)
    do side = 1, 2
      place = merge(-l, l, side == 1)
      call new_frame(frame, mechanism, 5.0_dp, inertia, [0.0_dp, place], diagonal([0.0_dp, 0.0_dp, c]), zero, 20.0_dp, failure, &
        & free=[3], gravity=[0.0_dp, -g])
      if (.not. allocated(failure)) call frame%natural_frequencies(frequencies, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      expected = c - m * g * place
      call near(error, frequencies, [sqrt(expected / (inertia + own + m * l**2))], 1.0e-13_dp, "frequency")
      call frame%averaged(model)
      call near(error, model%c(1, :), [expected], 1.0e-13_dp * c, "averaged")
      if (allocated(error)) return
      call check_that(error, abs(model%c(1, 1) - expected), "<=", model%c_error(1, 1), "averaged, claimed error")
      if (allocated(error)) return
    end do
  end subroutine test_hanging

  !> The frame alone, of weight m g, on one support at (0, h) above or below F: k h^2 + m g h about F.
  subroutine test_support_pendulum(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: m = 12, inertia = 0.4_dp, h = 0.3_dp, k = 5.0e3_dp
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: frequencies(:)
    real(dp) :: place, m_psi(1, 3, 3), b(1, 3, 3), c(1, 3, 3)
    integer :: side

    call new_harmonic_mechanism(mechanism, 0.0_dp, 0.0_dp, [0.0_dp], [0.0_dp], [0.0_dp], [0.0_dp], failure)
    do side = 1, 2
      place = merge(h, -h, side == 1)
      call new_frame(frame, mechanism, m, inertia, [0.0_dp, 0.0_dp], zero, zero, 20.0_dp, failure, gravity=[0.0_dp, -g], &
        & supports=[support_type([0.0_dp, place], [k, 2 * k])])
      if (.not. allocated(failure)) call frame%natural_frequencies(frequencies, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call frame%sample_second_order([0.3_dp], m_psi, b, c)
      call near(error, [c(1, 3, 3)], [k * h**2 + m * g * place], 1.0e-13_dp * k, "c33")
      ! xi and psi: the product of the squares is det C/det M, c11 c33 - c13^2 = k m g h; upside down one is negative.
      call near(error, [product(sign(frequencies**2, frequencies))], [k * m * g * place / (m * inertia) * 2 * k / m], &
        & 1.0e-11_dp * k**3, "frequencies")
      if (allocated(error)) return
    end do
  end subroutine test_support_pendulum

  !> The paper's machine with all its directions turned by 90 degrees; also on a frame about rest.
  subroutine test_turned(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=11), parameter :: models(3) = [character(len=11) :: "exact", "first_order", "rest"]
    type(machine_data) :: machine, other
    real(dp), dimension(32, 3) :: q, turned, light
    real(dp) :: size_of
    integer :: i, k

    machine = khang_machine(700.0_dp, 10.0_dp)
    machine%supports(1)%angle_deg = 30
    machine%supports(2)%stiffness = [1.0e5_dp, 3.0e5_dp]
    machine%supports(4)%damping = [50.0_dp, 700.0_dp]
    other = machine
    machine%gravity = [20.0_dp, -90.0_dp]
    call solve(other, light, "exact")
    if (allocated(error)) return
    other%gravity = quarter(machine%gravity)
    other%origin = quarter(other%origin)
    do i = 1, size(other%supports)
      other%supports(i)%position = quarter(other%supports(i)%position)
      other%supports(i)%angle_deg = other%supports(i)%angle_deg + 90
    end do
    do i = 1, 2
      other%joints(i)%position = quarter(other%joints(i)%position)
    end do
    other%joints(3)%phase_deg = 90
    do k = 1, 3
      call solve(machine, q, models(k))
      if (.not. allocated(error)) call solve(other, turned, models(k))
      if (allocated(error)) return
      do i = 1, 3
        size_of = maxval(abs(q(:, i)))
        if (i == 1) call near(error, turned(:, 2), q(:, 1), 1.0e-9_dp * size_of, "xi")
        if (i == 2) call near(error, -turned(:, 1), q(:, 2), 1.0e-9_dp * size_of, "eta")
        if (i == 3) call near(error, turned(:, 3), q(:, 3), 1.0e-9_dp * size_of, "psi")
      end do
      if (allocated(error)) return
    end do
    call check_that(error, maxval(abs(q(:, 3) - light(:, 3))), ">", 0.01_dp * maxval(abs(q(:, 3))), "weights matter")

  contains

    pure function quarter(a) result(b)
      real(dp), intent(in) :: a(2)
      real(dp) :: b(2)

      b = [-a(2), a(1)]
    end function quarter

    subroutine solve(one, motion, model)
      type(machine_data), intent(in) :: one
      real(dp), intent(out) :: motion(32, 3)
      character(len=*), intent(in) :: model
      type(frame_type) :: frame
      type(analysis_type) :: analysis
      type(gestell_error), allocatable :: failure

      call frame_of_machine(one, frame, failure)
      if (.not. allocated(failure)) call analyse(frame, analysis_options(model=model, points=32, rows=guide_forces), &
        & accuracy_type(tolerance=1.0e-11_dp), analysis, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      motion = transpose(analysis%vibration%motion_history(:3, :32))
    end subroutine solve

  end subroutine test_turned

  subroutine test_averaged_mean(error)
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
      call make(machine, frame, error)
      if (allocated(error)) return
      call frame%sample_second_order([(i / real(points, dp), i = 1, points)], m, b, c)
      call frame%averaged(model)
      call near(error, [model%c], [sum(c, dim=1) / points], 1.0e-10_dp * maxval(abs(c)), "C")
      if (allocated(error)) return
      call check_that(error, maxval(c(:, 3, 3)) - minval(c(:, 3, 3)), ">", 1.0e-6_dp * maxval(abs(c)), "C changes")
      if (allocated(error)) return
    end do
  end subroutine test_averaged_mean

  !> d/dt of the energy is the drive's power less the dampers', about rest and exact, either way round, with guides.
  subroutine test_balance(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 512
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(drive_type) :: drive, light
    type(gestell_error), allocatable :: failure
    logical :: known, exact
    integer :: number, pass

    do number = 1, 6
      do pass = 1, 2
        exact = number > 3
        machine = random_linkage(number, 1.0_dp, 20.0_dp)
        if (modulo(number, 3) == 1) machine = khang_machine(-360.0_dp, 10.0_dp)
        machine%free(1 + mod(number, 3)) = number /= 2 .and. number /= 5
        if (pass == 2) machine%gravity = [30.0_dp, -90.0_dp]
        call make(machine, frame, error)
        if (allocated(error)) return
        call analyse(frame, analysis_options(model=merge("exact", "rest ", exact), points=points, rows=guide_forces), &
          & accuracy_type(tolerance=1.0e-12_dp), analysis, failure)
        if (.not. allocated(failure)) call find_drive(analysis%frame, analysis%vibration, drive, known, failure)
        if (pass == 1) light = drive
        call check_success(error, failure)
        if (allocated(error)) return
      end do
      associate (h => drive%history(:, :points))
        call near(error, derivative(h(stored_energy, :), frame%period), h(drive_watts, :) - h(damper_watts, :), &
          & 1.0e-9_dp * drive%maximum, "at every time")
        call near(error, [drive%defect()], [0.0_dp], 1.0e-9_dp, "over the turn")
        call near(error, [sum(h(rigid_torque, :)) / points], [0.0_dp], 1.0e-12_dp * maxval(abs(h(rigid_torque, :))), "rigid")
      end associate
      if (allocated(error)) return
      call check_that(error, maxval(abs(drive%history(rigid_torque, :) - light%history(rigid_torque, :))), ">", 1.0e-3_dp &
        & * abs(light%rigid%peak), "weights matter")
      if (allocated(error)) return
    end do
  end subroutine test_balance

  subroutine test_static(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    real(dp) :: force(2), expected(2)
    integer :: number, j

    ! A balanced crank in the middle between two supports.
    machine = khang_machine(300.0_dp)
    machine%links%center(1) = 0
    machine%links%mass = [2.0_dp, 0.0_dp, 0.0_dp]
    machine%origin = [0.0_dp, 0.3_dp]
    machine%supports = machine%supports([1, 4])
    machine%gravity = [0.0_dp, -g]
    call make(machine, frame, error)
    if (allocated(error)) return
    do j = 1, 2
      call near(error, static_force(frame, achar(48 + j)), [0.0_dp, -g * 10], 1.0e-11_dp, "half")
    end do
    do number = 1, 20
      machine = random_linkage(number)
      machine%gravity = [2.0_dp, -9.0_dp]
      if (number > 10) machine%free(1 + mod(number, 3)) = .false.
      call make(machine, frame, error)
      if (allocated(error)) return
      force = static_force(frame, "foundation") + static_force(frame, "guide")
      do j = 1, size(frame%supports)
        force = force + static_force(frame, achar(48 + j))
      end do
      expected = (machine%frame_mass + sum(machine%links%mass)) * machine%gravity
      call near(error, force, expected, 1.0e-11_dp * norm2(expected), "sum")
      call near(error, static_force(frame, "total"), expected, 1.0e-12_dp * norm2(expected), "total")
      call near(error, frame%weights%sag([1, 2, 6]), real(sag(machine), dp), 1.0e-10_dp * maxval(abs(frame%weights%sag)), "sag")
      if (allocated(error)) return
    end do
  end subroutine test_static

  subroutine test_least(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 4000
    character(len=11), parameter :: models(2) = [character(len=11) :: "exact", "rest"]
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: reactions(:)
    type(gestell_error), allocatable :: failure
    real(dp) :: down(2), least
    integer :: i, k

    machine = khang_machine(450.0_dp, 5.0_dp)
    machine%supports(:2)%turning = .true.
    machine%gravity = [3.0_dp, -9.0_dp]
    down = machine%gravity / norm2(machine%gravity)
    call make(machine, frame, error)
    if (allocated(error)) return
    do k = 1, 2
      call analyse(frame, analysis_options(model=models(k), points=points, rows=guide_forces), &
        & accuracy_type(tolerance=1.0e-10_dp), analysis, failure)
      if (.not. allocated(failure)) call find_reactions(analysis%frame, analysis%vibration, reactions, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      do i = 1, size(reactions)
        least = dot_product(down, reactions(i)%static) + minval(matmul(reactions(i)%history(:, :2), down))
        ! Between two of so many times the force rises by less than this part of its span.
        call near(error, [reactions(i)%least_compression], [least], 1.0e-4_dp * reactions(i)%statistics(3)%peak, "least")
        if (allocated(error)) return
        call check_that(error, reactions(i)%least_compression, "<=", least + reactions(i)%min_error, "not above the history")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_least

  subroutine test_unsupported(error)
    type(error_type), allocatable, intent(out) :: error
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure

    call new_harmonic_mechanism(mechanism, 1.0_dp, 1.0_dp, [0.1_dp], [0.0_dp], [0.1_dp], [0.0_dp], failure)
    call attempt([1.0e6_dp, 0.0_dp, 1.0e3_dp], [0.0_dp, -g], "eta")
    call attempt([0.0_dp, 1.0e-3_dp, 1.0e9_dp], [g, 0.0_dp], "xi")
    call attempt([1.0e6_dp, 1.0e6_dp, 0.0_dp], [0.0_dp, -g], "moment")
    call attempt([0.0_dp, 1.0e6_dp, 1.0e3_dp], [1.0e-16_dp, -g], "")
    call attempt([1.0_dp, 1.0e9_dp, 1.0e-3_dp], [1.0_dp, -g], "")
    ! The moment of weights through F needs no spring, in whatever units.
    call attempt([1.0_dp, 1.0e9_dp, 0.0_dp], [g, 0.0_dp], "")
    ! A single spring away from F holds eta or psi, not both.
    call new_frame(frame, mechanism, 5.0_dp, 1.0_dp, [0.3_dp, 0.2_dp], zero, zero, 20.0_dp, failure, gravity=[0.0_dp, -g], &
      & supports=[support_type([-0.2_dp, 0.0_dp], [0.0_dp, 1.0e5_dp])], free=[2, 3])
    call check_failure(error, failure, what="one spring away from F")
    if (allocated(error)) return
    ! Straight below the centre of all masses it does.
    call new_frame(frame, mechanism, 5.0_dp, 1.0_dp, [1.1_dp, 0.2_dp], zero, zero, 20.0_dp, failure, gravity=[0.0_dp, -g], &
      & supports=[support_type([0.2_dp, 0.0_dp], [0.0_dp, 1.0e5_dp])], free=[2, 3])
    call check_success(error, failure, "one spring below the centre")

  contains

    subroutine attempt(stiffness, gravity, word)
      real(dp), intent(in) :: stiffness(3), gravity(2)
      character(len=*), intent(in) :: word

      if (allocated(error)) return
      call new_frame(frame, mechanism, 5.0_dp, 1.0_dp, [0.3_dp, 0.0_dp], diagonal(stiffness), zero, 20.0_dp, failure, &
        & gravity=gravity)
      call check_that(error, allocated(failure), "/=", word == "", "refused: " // word)
      if (allocated(error) .or. .not. allocated(failure)) return
      call check_that(error, failure%code, "==", impossible_mechanism, failure%message)
      call check_that(error, failure%message, "contains", word)
    end subroutine attempt

  end subroutine test_unsupported

  !> Results are bit by bit those of a frame without gravity.
  subroutine test_zero_gravity(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    class(frame_type), allocatable :: settled
    type(gestell_error), allocatable :: failure
    type(series_type) :: motion(2)
    integer :: k

    machine = khang_machine(300.0_dp)
    do k = 1, 2
      machine%gravity = [0.0_dp, -1.0e-300_dp * (k - 1)]
      call make(machine, frame, error)
      if (allocated(error)) return
      call settle(frame, "exact", accuracy_type(), settled, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, frame%weights%act, "==", k == 2, "weights act")
      select type (settled)
      class is (varied_frame_type)
        motion(k) = settled%motion
      end select
    end do
    if (.not. allocated(error)) call check_that(error, [abs(motion(1)%cosine - motion(2)%cosine)], "<=", 0.0_dp, "motion")
  end subroutine test_zero_gravity

end module test_weights
