!> The frame's vibration: closure, energy, harmonics, peaks.
module test_vibration
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_math_series_fourier, only: fourier_series, fourier_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_period_periodic_solution, only: follow, periodic_solution_type, solve_periodic
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use machines, only: frame_of_machine, solve3
  use reference_flow, only: flow_states
  use reference_frame, only: frame_of
  use reference_linear, only: qp
  use reference_linkage, only: motion_type, move
  use reference_machine, only: khang_machine, machine_data
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_vibration

contains

  subroutine collect_vibration(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("an independent integration returns to its start after one period", test_closes), &
      & new_unittest("the drive's work per turn equals the dampers' losses", test_energy), &
      & new_unittest("an undamped machine run in reverse repeats the vibration backwards in time", test_backwards), &
      & new_unittest("the Fourier series of a known function is exact", test_fourier), &
      & new_unittest("mean, rms and peak of the vibration agree with a fine history", test_parseval), &
      & new_unittest("held degrees of freedom rest; ground forces follow from springs and dampers", test_freedoms), &
      & new_unittest("claimed errors of rows and peaks hold for loose tolerances", test_peak_errors), &
      & new_unittest("only requested results are computed", test_not_requested)]
  end subroutine collect_vibration

  subroutine solve(frame, tolerance, forced, monodromy, error)
    type(frame_type), intent(in) :: frame
    real(dp), intent(in) :: tolerance
    logical, intent(in) :: forced
    type(monodromy_type), intent(out) :: monodromy
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call solve_monodromy(frame, accuracy_type(tolerance=tolerance), forced, monodromy, failure)
    call check_success(error, failure)
  end subroutine solve

  !> The library's x0, followed over a period by the reference's integrator in quadruple precision.
  subroutine test_closes(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: x(:, :)
    real(dp), parameter :: phases(4) = [0.1_dp, 0.5_dp, 0.77_dp, 1.0_dp]
    real(qp) :: states(6, 4)
    integer :: i

    call frame_of_machine(khang_machine(240.0_dp), frame, failure)
    call solve(frame, 1.0e-12_dp, .true., monodromy, error)
    if (allocated(error)) return
    call solve_periodic(monodromy, solution, failure)
    if (.not. allocated(failure)) call follow(frame, monodromy, solution, phases, x, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call flow_states(frame_of(khang_machine(240.0_dp)), 0.0_qp, real(solution%x0, qp), real(phases * frame%period, qp), &
      & 1.0e-20_qp, states)
    do i = 1, 4
      ! Phi has norm 4: the start's own error 1e-12 of its size is all that can grow.
      call check_that(error, real(maxval(abs(x(:, i) - states(:, i)) / monodromy%scale), dp), "<=", &
        & 1.0e-11_dp * maxval(abs(x(:, i)) / monodromy%scale), "history")
      if (allocated(error)) return
    end do
    call check_that(error, real(maxval(abs(solution%x0 - states(:, 4)) / monodromy%scale), dp), "<=", &
      & 1.0e-11_dp * maxval(abs(solution%x0) / monodromy%scale), "closed")
  end subroutine test_closes

  !> The drive's work per turn equals the losses of the dampers. The drive's moment follows from the links' motion in space by
  !> virtual work, sum [m R'' . dR/dphi + J (phi'' + psi'') dphi_i/dphi], not from the frame's equations. With light links the
  !> vibration is so small that terms of higher order do not matter.
  subroutine test_energy(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 400
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: x(:, :)
    real(dp) :: drive, loss, t, acceleration(3), m(3, 3), b(3, 3), c(3, 3), h(3)
    integer :: i, k

    machine = khang_machine(360.0_dp, 1.0e-6_dp)
    machine%foundation_damping = [50.0_dp, 80.0_dp, 5.0_dp]
    call frame_of_machine(machine, frame, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call solve(frame, 1.0e-12_dp, .true., monodromy, error)
    if (allocated(error)) return
    call solve_periodic(monodromy, solution, failure)
    if (.not. allocated(failure)) call follow(frame, monodromy, solution, [(real(k, dp) / points, k = 0, points)], x, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    drive = 0
    loss = 0
    do k = 1, points
      t = frame%period * (k - 1) / points
      associate (q => x(:3, k), v => x(4:, k))
        call frame%matrices(t, m, b, c)
        call frame%load(t, h)
        acceleration = solve3(m, h - matmul(b, v) - matmul(c, q))
        drive = drive + drive_power(machine, frame%speed, t, q, v, acceleration) * frame%period / points
        loss = loss + sum([(machine%foundation_damping(i) * v(i)**2, i = 1, 3)]) * frame%period / points
      end associate
    end do
    ! Neglected: terms of the relative size of the vibration, 1e-8 m to 0.1 m, times the reaction over the loss.
    call check(error, drive, loss, thr=1.0e-4_dp * loss)
  end subroutine test_energy

  !> Power of the drive with the links carried by a frame at q = (xi, eta, psi), velocity v, acceleration a, exact in the
  !> angle psi. Kinematics by the reference.
  real(dp) function drive_power(machine, speed, t, q, v, a) result(power)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: speed, t, q(3), v(3), a(3)
    type(motion_type) :: motion
    real(dp) :: r(2), rd(2), rdd(2), acceleration(2), tangent(2)
    integer :: i

    motion = move(machine, real(speed * t, qp))
    power = 0
    do i = 1, size(machine%links)
      r = machine%origin + real(motion%center(:, 0, i), dp)
      tangent = real(motion%center(:, 1, i), dp)
      rd = speed * tangent
      rdd = speed**2 * real(motion%center(:, 2, i), dp)
      acceleration = a(:2) + turned(rdd - v(3)**2 * r, q(3)) + turned(left(a(3) * r + 2 * v(3) * rd), q(3))
      power = power + speed * (machine%links(i)%mass * dot_product(acceleration, turned(tangent, q(3))) &
        & + machine%links(i)%inertia * (speed**2 * real(motion%turn(2, i), dp) + a(3)) * real(motion%turn(1, i), dp))
    end do

  contains

    pure function turned(u, angle) result(w)
      real(dp), intent(in) :: u(2), angle
      real(dp) :: w(2)

      w = [cos(angle) * u(1) - sin(angle) * u(2), sin(angle) * u(1) + cos(angle) * u(2)]
    end function turned

    pure function left(u) result(w)
      real(dp), intent(in) :: u(2)
      real(dp) :: w(2)

      w = [-u(2), u(1)]
    end function left

  end function drive_power

  !> Without damping the equations are symmetric in time: with -Omega the solution is x(-t).
  subroutine test_backwards(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(analysis_type) :: forwards, backwards
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    integer, parameter :: points = 8
    integer :: k

    machine = khang_machine(300.0_dp)
    machine%foundation_damping = 0
    call frame_of_machine(machine, frame, failure)
    call analyse(frame, analysis_options(model="rest", stability=.false., points=points), accuracy_type(tolerance=1.0e-12_dp), &
      & forwards, failure)
    machine%speed_rpm = -300.0_dp
    call frame_of_machine(machine, frame, failure)
    call analyse(frame, analysis_options(model="rest", stability=.false., points=points), accuracy_type(tolerance=1.0e-12_dp), &
      & backwards, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 1, points + 1
      call check_that(error, maxval(abs(forwards%vibration%history(:3, k) - backwards%vibration%history(:3, points + 2 - k))), &
        & "<=", 1.0e-10_dp * forwards%vibration%peak(3), "backwards")
      if (allocated(error)) return
    end do
  end subroutine test_backwards

  subroutine test_fourier(error)
    type(error_type), allocatable, intent(out) :: error
    type(fourier_type) :: series
    real(dp) :: samples(40), f(3)
    integer :: i, fine

    ! A variable: gfortran would spend seconds on an array of constant length.
    fine = 1000000
    ! 0.3 + 2 cos(3 t + 0.4) + 0.5 sin(7 t), its peak by a fine search below.
    samples = [(given(2 * pi * (i - 1) / 40), i = 1, 40)]
    series = fourier_series(samples)
    call check(error, series%mean, 0.3_dp, thr=1.0e-15_dp)
    if (allocated(error)) return
    call check(error, series%amplitude(3), 2.0_dp, thr=1.0e-14_dp)
    if (allocated(error)) return
    call check(error, series%phase(3), 0.4_dp, thr=1.0e-14_dp)
    if (allocated(error)) return
    call check(error, series%amplitude(7), 0.5_dp, thr=1.0e-14_dp)
    if (allocated(error)) return
    call check(error, series%phase(7), -pi / 2, thr=1.0e-13_dp)
    if (allocated(error)) return
    f = series%value(0.77_dp)
    call check(error, f(1), given(0.77_dp), thr=1.0e-14_dp)
    if (allocated(error)) return
    call check(error, series%rms(), sqrt(0.09_dp + 2 + 0.125_dp), thr=1.0e-14_dp)
    if (allocated(error)) return
    call check(error, series%peak(samples), maxval([(abs(given(2 * pi * i / fine)), i = 1, fine)]), thr=1.0e-9_dp)

  contains

    pure real(dp) function given(t)
      real(dp), intent(in) :: t

      given = 0.3_dp + 2 * cos(3 * t + 0.4_dp) + 0.5_dp * sin(7 * t)
    end function given

  end subroutine test_fourier

  subroutine test_parseval(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(analysis_type) :: coarse, fine
    type(gestell_error), allocatable :: failure
    integer :: i

    call frame_of_machine(khang_machine(240.0_dp), frame, failure)
    call analyse(frame, analysis_options(model="rest", points=7, harmonics=3), accuracy_type(), coarse, failure)
    call analyse(frame, analysis_options(model="rest", points=5000), accuracy_type(), fine, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    associate (history => fine%vibration%history)
      do i = 1, 9
        ! Values from the 5000 rows; with fewer rows mean, rms and peak must not change.
        call check(error, coarse%vibration%rms(i), norm2(history(i, :5000)) / sqrt(5000.0_dp), &
          & thr=1.0e-8_dp * fine%vibration%peak(i))
        if (allocated(error)) return
        call check(error, coarse%vibration%peak(i), maxval(abs(history(i, :))), thr=1.0e-4_dp * fine%vibration%peak(i))
        if (allocated(error)) return
        call check(error, coarse%vibration%peak(i), fine%vibration%peak(i), thr=1.0e-8_dp * fine%vibration%peak(i))
        if (allocated(error)) return
        call check_that(error, coarse%vibration%peak(i), ">=", maxval(abs(history(i, :))) - fine%vibration%peak_error(i), "peak")
        if (allocated(error)) return
      end do
    end associate
    call check(error, size(coarse%vibration%history, 2), 8)
  end subroutine test_parseval

  !> Degrees of freedom that are held rest; the force on the ground is that of springs and dampers.
  subroutine test_freedoms(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: full, frame
    type(analysis_type) :: analysis, few, many
    type(gestell_error), allocatable :: failure
    integer :: i, k

    machine = khang_machine(240.0_dp)
    machine%foundation_damping = [900.0_dp, 700.0_dp, 50.0_dp]
    call frame_of_machine(machine, full, failure)
    do k = 1, 3
      associate (free => pack([1, 2, 3], [1, 2, 3] /= k), stiffness => full%stiffness + 0.1_dp * norm2(full%stiffness))
        if (.not. allocated(failure)) call new_frame(frame, full%mechanism, full%mass, full%inertia, full%origin, stiffness, &
          & full%damping + 0.1_dp * norm2(full%damping), full%speed, failure, free)
        if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest", stability=.false., points=12, &
          & harmonics=70), accuracy_type(), analysis, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        associate (v => analysis%vibration)
          call check(error, maxval(abs(v%history([k, 3 + k], :))) + v%peak_error(k) + v%peak_error(3 + k), 0.0_dp, more="held")
          if (allocated(error)) return
          call check_that(error, v%peak([free, 3 + free]), ">", 0.0_dp, "free")
          call check_that(error, v%peak_error([free, 3 + free]), ">", 0.0_dp, "free")
          ! Sums of six products.
          call check_that(error, maxval(abs(v%history(7:, :) - matmul(frame%stiffness, v%history(:3, :)) &
            & - matmul(frame%damping, v%history(4:6, :)))), "<=", 1.0e-14_dp * maxval(v%peak), "forces")
          call check_that(error, size(v%series(1)%amplitude), ">=", 70, "harmonics")
          ! The tolerance 1e-9 times the condition of a machine away from resonance.
          call check_that(error, v%closing_defect, "<", 1.0e-7_dp, "closed")
          call check_that(error, maxval(abs(v%history(:, 13) - v%history(:, 1)) / max(v%peak, tiny(1.0_dp))), "<", 1.0e-6_dp, &
            & "T and 0")
          if (allocated(error)) return
        end associate
        ! With few rows and harmonics the motion is still sampled finely enough, in the free degrees of freedom too.
        call analyse(frame, analysis_options(model="rest", stability=.false., points=1, harmonics=1), accuracy_type(), few, failure)
        call check_that(error, maxval(abs(few%vibration%peak - analysis%vibration%peak) &
          & / max(analysis%vibration%peak, tiny(1.0_dp))), "<", 1.0e-8_dp, "peaks")
        if (allocated(error)) return
        call analyse(frame, analysis_options(model="rest", stability=.false., points=1, harmonics=200), accuracy_type(), many, &
          & failure)
        call check_that(error, size(many%vibration%series(1)%amplitude), ">=", 200, "harmonics, one row")
        call check_that(error, [(few%vibration%series(i)%tail(), i = 1, 9)], "<", 1.0e-9_dp, "tails")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_freedoms

  !> A solution with a tight tolerance shows the error of one with a loose tolerance.
  subroutine test_peak_errors(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: steps(4) = [10, 12, 16, 20]
    real(dp) :: miss(9)
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: loose, tight
    type(gestell_error), allocatable :: failure
    integer :: i, k

    do i = 1, 2
      machine = khang_machine(merge(240.0_dp, 333.0_dp, i == 1))
      if (i == 2) machine%foundation_damping = [9000.0_dp, 7000.0_dp, 500.0_dp]
      call frame_of_machine(machine, frame, failure)
      call analyse(frame, analysis_options(model="rest", stability=.false.), accuracy_type(tolerance=1.0e-12_dp), tight, failure)
      do k = 1, size(steps)
        if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest", stability=.false.), &
          & accuracy_type(steps=2 * steps(k)), &
          & loose, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call check_that(error, abs(loose%vibration%peak - tight%vibration%peak), "<=", loose%vibration%peak_error, "peaks")
        if (allocated(error)) return
        ! All rows are samples here, so they say how well the motion closes.
        associate (v => loose%vibration, scale => spread(loose%floquet%scale, 2, size(loose%vibration%history, 2)))
          call check(error, v%closing_defect, norm2((v%history(:6, size(scale, 2)) - v%history(:6, 1)) / scale(:, 1)) &
            & / maxval(norm2(v%history(:6, :) / scale, dim=1)), thr=1.0e-14_dp)
          if (allocated(error)) return
        end associate
        ! The bounds of the rows hold at all times. A method of order 12 has 1e-3 of the change from half the steps as error,
        ! and four times that is claimed: where errors exceed rounding, about 4 times their size.
        associate (l => loose%vibration, t => tight%vibration)
          miss = maxval(abs(l%history - t%history), dim=2)
          call check_that(error, miss, "<=", l%error + t%error, "rows")
          call check_that(error, merge(0.0_dp, l%error, miss < 1.0e-9_dp * t%peak), "<=", 8 * miss, &
            & "the error bound is not too wide")
          call check_that(error, l%peak_error, ">=", l%error, "errors of peaks")
          call check_that(error, t%error, ">", 0.0_dp, "errors of rows")
          if (allocated(error)) return
        end associate
      end do
    end do
  end subroutine test_peak_errors

  subroutine test_not_requested(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure

    call frame_of_machine(khang_machine(240.0_dp), frame, failure)
    call analyse(frame, analysis_options(model="rest", response=.false.), accuracy_type(), analysis, failure)
    call check_that(error, [allocated(analysis%vibration), analysis%floquet%forced], "==", [.false., .false.], &
      & "a vibration nobody asked for")
    if (allocated(error)) return
    call check(error, .not. allocated(analysis%multipliers%vectors), more="vectors nobody asked for")
    if (allocated(error)) return
    call analyse(frame, analysis_options(model="rest", stability=.false.), accuracy_type(), analysis, failure)
    ! A vibration includes the verdict of the machine.
    call check_that(error, analysis%multipliers%verdict(), "==", "stable", "verdict")
    if (allocated(error)) return
    call check(error, .not. allocated(analysis%multipliers%vectors), more="vectors nobody asked for")
    if (allocated(error)) return
    call analyse(frame, analysis_options(model="rest", stability=.false., modes=.true., response=.false.), accuracy_type(), &
      & analysis, failure)
    call check(error, allocated(analysis%multipliers%vectors), more="no vectors")
  end subroutine test_not_requested

end module test_vibration
