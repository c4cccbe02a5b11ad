!> Supports whose axes turn with the frame: compared with axes fixed in space, closed forms, momentum and energy. D'Alembert's
!> principle is tested in test_exact.
module test_support_axes
  use checks, only: check_success, check_that
  use exact_machines, only: machine_on_supports, solve_multiplier
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_model_quantity_driving, only: damper_watts, drive_watts, stored_energy
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_mounting, only: support_type
  use gestell_model_quantity_rows, only: guide_forces
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_task_power_drive, only: drive_type, find_drive
  use gestell_task_forces_reactions, only: along_x, along_y, find_reactions, moment, reaction_type
  use gestell_system_averaged, only: averaged_system
  use reference_exact, only: inertia_of, mass_of, place
  use reference_linear, only: qp
  use reference_linkage, only: motion_type, move
  use reference_machine, only: crank_speed, khang_machine, machine_data, period
  use reference_momentum, only: derivative
  use shaken_ground, only: make, near
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_support_axes

  real(dp), parameter :: zero(3, 3) = 0
  character(len=11), parameter :: models(3) = [character(len=11) :: "exact", "first_order", "rest"]

contains

  subroutine collect_support_axes(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("equal springs along both axes act alike whether their axes turn or not", test_alike), &
      & new_unittest("unequal springs or dampers act differently if their axes turn with the frame", test_different), &
      & new_unittest("undamped machines with turning support axes have reciprocal multipliers", test_reciprocal), &
      & new_unittest("stiffness of a frame above or below its support agrees with closed form", test_pendulum), &
      & new_unittest("forces and moment on the ground equal the rate of momentum lost", test_momentum), &
      & new_unittest("drive power equals energy growth plus damper power with turning axes", test_balance)]
  end subroutine collect_support_axes

  !> If springs act alike in all directions, the directions of the axes do not matter.
  subroutine test_alike(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(multipliers_type) :: space, frame
    integer :: k

    do k = 1, 2
      machine = khang_machine(2426.0_dp)
      call solve_multiplier(machine, trim(models(k)), space, error)
      machine%supports%turning = .true.
      if (.not. allocated(error)) call solve_multiplier(machine, trim(models(k)), frame, error)
      if (allocated(error)) return
      call check_that(error, maxval(abs(space%log_abs)), ">", 1.0e-3_dp, "far from the circle")
      call near(error, frame%log_abs, space%log_abs, 1.0e-9_dp, models(k))
      if (allocated(error)) return
    end do
  end subroutine test_alike

  subroutine test_different(error)
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: space, frame
    integer :: k

    do k = 1, 2
      call solve_multiplier(machine_on_supports(700.0_dp, 10.0_dp), trim(models(k)), space, error)
      if (.not. allocated(error)) call solve_multiplier(machine_on_supports(700.0_dp, 10.0_dp, turning=.true.), trim(models(k)), &
        & frame, error)
      if (allocated(error)) return
      call check_that(error, maxval(abs(frame%log_abs - space%log_abs)), ">", 1.0e-3_dp, models(k))
      if (allocated(error)) return
    end do
  end subroutine test_different

  !> The equations are Hamilton's, so 1/rho is a multiplier if rho is.
  subroutine test_reciprocal(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(multipliers_type) :: exact
    integer :: j

    machine = machine_on_supports(2426.0_dp, 1.0_dp, [30.0_dp, -90.0_dp], turning=.true.)
    machine%foundation_damping = 0
    do j = 1, size(machine%supports)
      machine%supports(j)%damping = 0
    end do
    call solve_multiplier(machine, "exact", exact, error)
    if (allocated(error)) return
    associate (pairs => exact%log_abs + exact%log_abs(6:1:-1))
      call check(error, maxval(abs(pairs)), 0.0_dp, thr=1.0e-9_dp, more="ln of a pair's product")
    end associate
  end subroutine test_reciprocal

  !> The frame alone, of weight m g, on one support at (0, h), which presses on the ground with m g. With the energy
  !> (k1 e1^2 + k2 e2^2)/2 - m g (e2 - eta), e = conj(E) (u - p) + p, the second derivatives by xi and psi are k1,
  !> -k1 h + m g and k1 h^2 - m g h.
  subroutine test_pendulum(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: m = 12, inertia = 0.4_dp, h = 0.3_dp, k = 5.0e3_dp, g = 9.80665_dp
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(averaged_system) :: model
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: frequencies(:)
    real(dp) :: up, masses(1, 3, 3), b(1, 3, 3), c(1, 3, 3), expected(3, 3)
    integer :: side

    call new_harmonic_mechanism(mechanism, 0.0_dp, 0.0_dp, [0.0_dp], [0.0_dp], [0.0_dp], [0.0_dp], failure)
    do side = 1, 2
      up = merge(h, -h, side == 1)
      call new_frame(frame, mechanism, m, inertia, [0.0_dp, 0.0_dp], zero, zero, 20.0_dp, failure, gravity=[0.0_dp, -g], &
        & supports=[support_type([0.0_dp, up], [k, 2 * k], turning=.true.)])
      if (.not. allocated(failure)) call frame%natural_frequencies(frequencies, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      expected = reshape([k, 0.0_dp, m * g - k * up, 0.0_dp, 2 * k, 0.0_dp, m * g - k * up, 0.0_dp, k * up**2 - m * g * up], &
        & [3, 3])
      call frame%sample_second_order([0.3_dp], masses, b, c)
      call near(error, [c], [expected], 1.0e-13_dp * k, "C")
      call frame%averaged(model)
      call near(error, [model%c], [expected], 1.0e-13_dp * k, "averaged C")
      if (allocated(error)) return
      call check_that(error, [abs(model%c - expected)], "<=", [model%c_error], "averaged, claimed error")
      if (allocated(error)) return
      ! The product of the squares is det C/det M.
      call near(error, [product(sign(frequencies**2, frequencies))], [(expected(1, 1) * expected(3, 3) - expected(1, 3)**2) &
        & * expected(2, 2) / (m**2 * inertia)], 1.0e-11_dp * k**3, "frequencies")
      if (allocated(error)) return
    end do
  end subroutine test_pendulum

  !> For all bodies in space and any supports: the forces are minus d/dt of the momentum and of the angular momentum about F at
  !> rest, plus the deviation of the weights' moment about it from its mean at rest.
  subroutine test_momentum(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 512
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: reactions(:)
    type(gestell_error), allocatable :: failure
    real(dp) :: forces(points, 3), sums(points, 3), p(2)
    integer :: i

    machine = machine_on_supports(700.0_dp, 10.0_dp, [30.0_dp, -90.0_dp])
    machine%supports%turning = .true.
    machine%foundation_damping = 0
    call make(machine, frame, error)
    if (allocated(error)) return
    call analyse(frame, analysis_options(model="exact", points=points, rows=guide_forces), accuracy_type(tolerance=1.0e-12_dp), &
      & analysis, failure)
    if (.not. allocated(failure)) call find_reactions(analysis%frame, analysis%vibration, reactions, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    forces = lost_momentum(machine, analysis%vibration%motion_history(:3, :points))
    sums = 0
    do i = 1, 4
      p = reactions(i)%position
      sums(:, :2) = sums(:, :2) + reactions(i)%history(:points, along_x:along_y)
      sums(:, 3) = sums(:, 3) + p(1) * reactions(i)%history(:points, along_y) - p(2) * reactions(i)%history(:points, along_x)
    end do
    associate (total => reactions(size(reactions))%history(:points, [along_x, along_y, moment]))
      do i = 1, 3
        ! The motion is good to about 1e-11 of its size; two spectral derivatives add two or three digits.
        call near(error, total(:, i), forces(:, i), 1.0e-8_dp * maxval(abs(forces(:, i))), "momentum")
        call near(error, sums(:, i), total(:, i), 1.0e-12_dp * maxval(abs(forces)), "the supports' sum")
      end do
    end associate
  end subroutine test_momentum

  !> Forces and moment about F at rest, shape (points, 3), by the motion q = (xi, eta, psi) at equidistant times over a turn.
  function lost_momentum(machine, q) result(forces)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: q(:, :)
    real(dp) :: forces(size(q, 2), 3)
    real(dp), dimension(size(q, 2)) :: spin, turn, weight
    real(dp) :: z(size(q, 2), 2), v(size(q, 2), 2), t, still(2)
    real(qp), parameter :: rest(3) = 0
    type(motion_type) :: motion
    integer :: i, j, k, n

    n = size(q, 2)
    t = real(period(machine), dp)
    forces = 0
    spin = 0
    weight = 0
    do i = 0, size(machine%links)
      do k = 1, n
        motion = move(machine, crank_speed(machine) * t * (k - 1) / n)
        z(k, :) = real(place(machine, motion, i, real(q(:, k), qp)), dp)
        still = real(place(machine, motion, i, rest), dp)
        associate (m => real(mass_of(machine, i), dp), g => machine%gravity)
          weight(k) = weight(k) + m * (z(k, 1) * g(2) - z(k, 2) * g(1))
          weight = weight - m * (still(1) * g(2) - still(2) * g(1)) / n
        end associate
        turn(k) = 0
        if (i > 0) turn(k) = real(motion%turn(1, i) * crank_speed(machine), dp)
      end do
      do j = 1, 2
        v(:, j) = derivative(z(:, j), t)
        forces(:, j) = forces(:, j) - real(mass_of(machine, i), dp) * derivative(v(:, j), t)
      end do
      spin = spin + real(mass_of(machine, i), dp) * (z(:, 1) * v(:, 2) - z(:, 2) * v(:, 1)) &
        & + real(inertia_of(machine, i), dp) * (derivative(q(3, :), t) + turn)
    end do
    forces(:, 3) = weight - derivative(spin, t)
  end function lost_momentum

  !> d/dt of the energy is the drive's power less the dampers', about rest and exact.
  subroutine test_balance(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 512
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(drive_type) :: drive
    type(gestell_error), allocatable :: failure
    logical :: known
    integer :: k

    do k = 1, 3, 2
      call make(machine_on_supports(-360.0_dp, 10.0_dp, [30.0_dp, -90.0_dp], turning=.true.), frame, error)
      if (allocated(error)) return
      call analyse(frame, analysis_options(model=trim(models(k)), points=points, rows=guide_forces), &
        & accuracy_type(tolerance=1.0e-12_dp), analysis, failure)
      if (.not. allocated(failure)) call find_drive(analysis%frame, analysis%vibration, drive, known, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      associate (h => drive%history(:, :points))
        call near(error, derivative(h(stored_energy, :), frame%period), h(drive_watts, :) - h(damper_watts, :), &
          & 1.0e-9_dp * drive%maximum, models(k))
      end associate
      if (allocated(error)) return
    end do
  end subroutine test_balance

end module test_support_axes
