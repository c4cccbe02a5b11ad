!> Points of the frame whose vibration is reported.
module test_probes
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_quantity_rows, only: accelerations, probe_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_task_forces_reactions, only: along_x, along_y, find_reactions, reaction_type
  use gestell_task_probes_response, only: probe_parts, velocity_part, find_responses, probe_response_type
  use reference_cases, only: random_linkage, random_machine
  use reference_machine, only: khang_machine, machine_data
  use reference_momentum, only: derivative
  use shaken_ground, only: make, near
  use systems, only: diagonal
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_probes

contains

  subroutine collect_probes(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("a probe's velocity and acceleration are derivatives of its displacement", test_derivatives), &
      & new_unittest("peaks do not depend on the number of requested rows", test_few_rows), &
      & new_unittest("probes on a rocking frame agree with the closed form", test_rocking), &
      & new_unittest("a probe at a support moves by force over stiffness", test_support), &
      & new_unittest("bands include the orders at their edges and give the maximum direction", test_band), &
      & new_unittest("the probe's verdict compares its value and error with the limit", test_verdict), &
      & new_unittest("claimed errors of probes hold for loose tolerances", test_errors), &
      & new_unittest("claimed errors of probes hold on very soft and very stiff mounts", test_extremes)]
  end subroutine collect_probes

  subroutine solve(frame, points, tolerance, probes, analysis, responses, error, averaged, method)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: points
    real(dp), intent(in) :: tolerance
    type(probe_type), intent(in) :: probes(:)
    type(analysis_type), intent(out) :: analysis
    type(probe_response_type), allocatable, intent(out) :: responses(:)
    type(error_type), allocatable, intent(out) :: error
    logical, intent(in), optional :: averaged
    character(len=*), intent(in), optional :: method
    type(gestell_error), allocatable :: failure
    type(analysis_options) :: options
    type(accuracy_type) :: accuracy
    options = analysis_options(model="rest", points=points, rows=accelerations)
    accuracy = accuracy_type(tolerance=tolerance)
    if (present(method)) accuracy%method = method
    if (present(averaged)) options%averaged = averaged
    call analyse(frame, options, accuracy, analysis, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call find_responses(frame, analysis%vibration, probes, responses, failure)
    call check_success(error, failure)
  end subroutine solve

  !> Peaks do not depend on the number of requested rows: samples are added until the motion and its accelerations are resolved.
  !> With 1024 rows the given samples would suffice.
  subroutine test_few_rows(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(probe_response_type), allocatable :: few(:), many(:)
    integer :: number, k

    do number = 1, 6
      machine = random_linkage(number, 1.0_dp, 20.0_dp)
      call make(machine, frame, error)
      frame%least_steps = 8
      if (.not. allocated(error)) call solve(frame, 8, 1.0e-10_dp, [probe_at(0.3_dp, -0.2_dp)], analysis, few, error)
      if (.not. allocated(error)) call solve(frame, 1024, 1.0e-10_dp, [probe_at(0.3_dp, -0.2_dp)], analysis, many, error)
      if (allocated(error)) return
      do k = 1, probe_parts
        ! Harmonics are resolved to 1e-9 of the largest.
        call near(error, [few(1)%statistics(k)%peak], [many(1)%statistics(k)%peak], 1.0e-7_dp * many(1)%statistics(k)%peak, "peak")
      end do
      if (allocated(error)) return
    end do
    call order_of_forty(error)
  end subroutine test_few_rows

  !> A load of order 40 alone, which 64 samples would take for one of order 24, in closed form.
  subroutine order_of_forty(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: order = 40
    real(dp), parameter :: u = 1.0e-4_dp, mass = 20, omega = 2, spring = 1.0e4_dp, damping = 50
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(probe_response_type), allocatable :: responses(:)
    type(gestell_error), allocatable :: failure
    real(dp) :: a1(1 + 2 * order)
    complex(dp) :: iw

    a1 = 0
    a1(2 * order) = u
    call new_harmonic_mechanism(mechanism, 2.0_dp, 0.01_dp, a1, [0.0_dp], [0.01_dp], [0.01_dp], failure)
    call new_frame(frame, mechanism, mass - 2, 1.0_dp, [0.0_dp, 0.0_dp], diagonal([spring, 1.0_dp, 1.0_dp]), &
      & diagonal([damping, 1.0_dp, 1.0_dp]), omega, failure, free=[1])
    call check_success(error, failure)
    ! Pretends that the harmonics of the load are not known.
    frame%least_steps = 8
    if (.not. allocated(error)) call solve(frame, 8, 1.0e-10_dp, [probe_at(0.0_dp, 0.0_dp)], analysis, responses, error)
    if (allocated(error)) return
    iw = cmplx(0.0_dp, order * omega, dp)
    associate (s => responses(1)%statistics(7))
      call near(error, [s%peak], [abs(iw**4 * u / (spring + damping * iw + mass * iw**2))], 1.0e-8_dp * s%peak, "order 40")
      if (.not. allocated(error)) call check(error, s%strongest(), order)
    end associate
  end subroutine order_of_forty

  pure type(probe_type) function probe_at(x, y)
    real(dp), intent(in) :: x, y

    probe_at%name = "p"
    probe_at%position = [x, y]
  end function probe_at

  !> d/dt of displacement and velocity over the turn, periodic and averaged; sizes are norms of the vectors; Parseval.
  subroutine test_derivatives(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 512
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(probe_response_type), allocatable :: responses(:)
    integer :: number, k

    do number = 1, 6
      machine = random_linkage(number, 1.0_dp, 20.0_dp)
      machine%free(1 + mod(number, 3)) = number < 3
      call make(machine, frame, error)
      if (.not. allocated(error)) call solve(frame, points, 1.0e-12_dp, [probe_at(0.3_dp, -0.2_dp)], analysis, responses, error, &
        & averaged=number == 6)
      if (allocated(error)) return
      associate (h => responses(1)%history(:points, :), s => responses(1)%statistics)
        do k = 1, probe_parts
          if (mod(k, 3) == 0) then
            call near(error, h(:, k), hypot(h(:, k - 2), h(:, k - 1)), 1.0e-15_dp * s(k)%peak, "size")
          else if (k > 3) then
            ! 1e-12 of the motion, times the orders that matter.
            call near(error, h(:, k), derivative(h(:, k - 3), frame%period), 1.0e-9_dp * s(3 * ceiling(k / 3.0))%peak, "derivative")
          end if
          call near(error, [s(k)%rms], [sqrt(sum(h(:, k)**2) / points)], 1.0e-12_dp * s(k)%peak, "rms")
          ! Orders up to 40 count; points 0.7 deg apart.
          call near(error, [s(k)%peak], [maxval(abs(h(:, k)))], 0.5_dp * (40 * pi / points)**2 * s(k)%peak, "peak")
          if (allocated(error)) return
        end do
      end associate
    end do
  end subroutine test_derivatives

  !> A moment function H = p sin phi alone rocks the frame: (J s^2 + b s + c) psi = -Omega^2 p cos(Omega t). A point moves
  !> by (-Y, X) psi.
  subroutine test_rocking(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 72
    real(dp), parameter :: p = 0.02_dp, inertia = 1.5_dp, stiffness = 2.0e4_dp, damping = 30, omega = 60, at(2) = [0.4_dp, -0.7_dp]
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(probe_response_type), allocatable :: responses(:)
    type(gestell_error), allocatable :: failure
    complex(dp) :: psi, e, iw
    integer :: turn, k, i

    call new_harmonic_mechanism(mechanism, 1.0_dp, 0.5_dp, [0.0_dp], [0.0_dp], [0.0_dp], [0.0_dp, 0.0_dp, p], failure)
    iw = cmplx(0.0_dp, omega, dp)
    psi = -omega**2 * p / (inertia * iw**2 + damping * iw + stiffness)
    do turn = 1, 2
      call new_frame(frame, mechanism, 10.0_dp, inertia - 0.5_dp, [0.0_dp, 0.0_dp], diagonal([1.0e4_dp, 1.0e4_dp, stiffness]), &
        & diagonal([1.0_dp, 1.0_dp, damping]), merge(omega, -omega, turn == 1), failure)
      call check_success(error, failure)
      if (.not. allocated(error)) call solve(frame, points, 1.0e-12_dp, [probe_at(at(1), at(2))], analysis, responses, error)
      if (allocated(error)) return
      associate (h => responses(1)%history, s => responses(1)%statistics)
        do i = 0, points
          e = exp(iw * frame%period * i / points)
          do k = 0, 2
            ! The tolerance 1e-12 of Phi and condition about 1.
            call near(error, h(i + 1, 3 * k + 1:3 * k + 2), [-at(2), at(1)] * real(iw**k * psi * e, dp), &
              & 1.0e-10_dp * abs(iw**k * psi), "history")
          end do
          if (allocated(error)) return
        end do
        do k = 0, 2
          call near(error, [s(3 * k + 1)%peak, s(3 * k + 2)%peak, s(3 * k + 3)%peak], [abs(at(2)), abs(at(1)), norm2(at)] &
            & * abs(iw**k * psi), 1.0e-10_dp * abs(iw**k * psi), "peak")
          call near(error, [s(3 * k + 2)%series(1)%phase(1)], [atan2(aimag(iw**k * psi), real(iw**k * psi))], 1.0e-10_dp, "phase")
        end do
        call near(error, [responses(1)%band(:2), responses(1)%maximum], [0.0_dp, 0.0_dp, 0.0_dp], 1.0e-13_dp, "9.5 Hz lies below")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_rocking

  !> Without dampers a support's force is its stiffness times the displacement of its head, along its axes.
  subroutine test_support(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    integer, parameter :: points = 60
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(probe_response_type), allocatable :: responses(:)
    type(reaction_type), allocatable :: reactions(:)
    real(dp) :: along(points + 1), across(points + 1), turn
    integer :: number, i

    do number = 1, 4
      machine = random_machine(number, 1.0_dp, 20.0_dp)
      machine%foundation_damping = [20.0_dp, 20.0_dp, 2.0_dp]
      do i = 1, size(machine%supports)
        machine%supports(i)%damping = 0
        machine%supports(i)%angle_deg = 25.0_dp * i
      end do
      call make(machine, frame, error)
      if (.not. allocated(error)) call solve(frame, points, 1.0e-10_dp, [(probe_at(machine%supports(i)%position(1), &
        & machine%supports(i)%position(2)), i = 1, size(machine%supports))], analysis, responses, error)
      if (allocated(error)) return
      call find_reactions(frame, analysis%vibration, reactions, failure)
      do i = 1, size(responses)
        turn = 25.0_dp * i * pi / 180
        associate (h => responses(i)%history, k => machine%supports(i)%stiffness, f => reactions(i)%history)
          along = k(1) * (cos(turn) * h(:, 1) + sin(turn) * h(:, 2))
          across = k(2) * (cos(turn) * h(:, 2) - sin(turn) * h(:, 1))
          ! Roundings of sums whose terms may cancel.
          call near(error, f(:, along_x), cos(turn) * along - sin(turn) * across, 1.0e-12_dp * maxval(k) &
            & * maxval(abs(h(:, 3))), "x")
          call near(error, f(:, along_y), sin(turn) * along + cos(turn) * across, 1.0e-12_dp * maxval(k) &
            & * maxval(abs(h(:, 3))), "y")
          if (allocated(error)) return
        end associate
      end do
    end do
  end subroutine test_support

  !> Bands that end exactly at orders include these and no others; the maximum direction is compared with all directions.
  subroutine test_band(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 512, directions = 900
    real(dp), parameter :: speeds(3) = [240.0_dp, -367.0_dp, 370.33_dp], beside = 1.0e-9_dp
    !> The orders that the probes' bands hold.
    integer, parameter :: orders(2, 4) = reshape([2, 5, 3, 4, 1, 60, 5, 5], [2, 4])
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(probe_response_type), allocatable :: responses(:)
    type(probe_type) :: probes(4)
    real(dp) :: part(points, 2), rms(2), maximum, turn
    integer :: i, k, j

    do i = 1, size(speeds)
      call make(khang_machine(speeds(i)), frame, error)
      if (allocated(error)) return
      probes = probe_at(0.2_dp, -0.15_dp)
      probes(1)%band = [2, 5] / frame%period
      probes(2)%band = [2 * (1 + beside), 5 * (1 - beside)] / frame%period
      probes(3)%band = [0.0_dp, 60 / frame%period]
      probes(4)%band = [4.5_dp, 5.5_dp] / frame%period
      call solve(frame, points, 1.0e-12_dp, probes, analysis, responses, error)
      if (allocated(error)) return
      do k = 1, size(probes)
        do j = 1, 2
          part(:, j) = orders_of(responses(k)%history(:points, 3 + j), orders(1, k), orders(2, k))
        end do
        rms = sqrt(sum(part**2, dim=1) / points)
        maximum = 0
        do j = 1, directions
          turn = pi * j / directions
          maximum = max(maximum, sqrt(sum((cos(turn) * part(:, 1) + sin(turn) * part(:, 2))**2) / points))
        end do
        call near(error, responses(k)%band(:2), rms, 1.0e-11_dp * norm2(rms), "along x and y")
        ! A direction is at most 0.1 deg away: 1 - cos of it.
        call near(error, [responses(k)%maximum], [maximum], 2.0e-6_dp * maximum, "maximum direction")
        if (allocated(error)) return
        call check_that(error, responses(k)%maximum, ">=", maximum * (1 - 1.0e-12_dp), "no direction exceeds the maximum")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_band

  !> The orders `first` to `last` of equidistant samples over a period.
  pure function orders_of(samples, first, last) result(part)
    real(dp), intent(in) :: samples(:)
    integer, intent(in) :: first, last
    real(dp) :: part(size(samples)), c(size(samples)), s(size(samples))
    integer :: i, k

    part = 0
    do k = first, last
      c = [(cos(2 * pi * modulo(k * i, size(samples)) / size(samples)), i = 0, size(samples) - 1)]
      s = [(sin(2 * pi * modulo(k * i, size(samples)) / size(samples)), i = 0, size(samples) - 1)]
      part = part + 2 * (sum(samples * c) * c + sum(samples * s) * s) / size(samples)
    end do
  end function orders_of

  !> Limits above, below and within the error of the measured value; no limit.
  subroutine test_verdict(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=9), parameter :: verdicts(5) = [character(len=9) :: "within", "above", "undecided", "undecided", ""]
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(probe_response_type), allocatable :: responses(:)
    real(dp) :: limits(5)
    integer :: k

    call make(khang_machine(240.0_dp), frame, error)
    if (allocated(error)) return
    call solve(frame, 64, 1.0e-4_dp, [probe_at(0.2_dp, -0.15_dp)], analysis, responses, error, method="rk4")
    if (allocated(error)) return
    associate (w => responses(1))
      call check_that(error, w%error, ">", 1.0e-9_dp * w%maximum, "the error bound is not too wide")
      call check_that(error, w%error, "<", 0.1_dp * w%maximum, "the error bound is not too wide")
      limits = [w%maximum + 2 * w%error, w%maximum - 2 * w%error, w%maximum + w%error / 2, w%maximum - w%error / 2, 0.0_dp]
      do k = 1, size(limits)
        w%probe%limit = limits(k)
        if (.not. allocated(error)) call check(error, trim(w%verdict()), trim(verdicts(k)))
      end do
    end associate
  end subroutine test_verdict

  !> At loose tolerances the claimed error covers the difference from a solution at 1e-13.
  subroutine test_errors(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tolerances(3) = [1.0e-2_dp, 1.0e-4_dp, 1.0e-7_dp]
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(probe_response_type), allocatable :: exact(:), responses(:)
    real(dp) :: miss, maximum
    integer :: number, i, k

    maximum = 0
    do number = 1, 6
      call make(random_machine(20 + number, 3.0_dp, 30.0_dp), frame, error)
      if (.not. allocated(error)) call solve(frame, 64, 1.0e-13_dp, [probe_at(-0.3_dp, 0.4_dp)], analysis, exact, error)
      if (allocated(error)) return
      do i = 1, size(tolerances)
        call solve(frame, 64, tolerances(i), [probe_at(-0.3_dp, 0.4_dp)], analysis, responses, error)
        if (allocated(error)) return
        do k = 1, probe_parts
          miss = max(abs(responses(1)%statistics(k)%peak - exact(1)%statistics(k)%peak), &
            & abs(responses(1)%statistics(k)%rms - exact(1)%statistics(k)%rms))
          maximum = max(maximum, miss / responses(1)%statistics(k)%peak_error)
          call check_that(error, miss, "<=", responses(1)%statistics(k)%peak_error + exact(1)%statistics(k)%peak_error, &
            & "peak or rms")
          if (allocated(error)) return
        end do
        miss = maxval(abs([responses(1)%band - exact(1)%band, responses(1)%maximum - exact(1)%maximum]))
        call check_that(error, miss, "<=", responses(1)%error + exact(1)%error, "band")
        call check_that(error, abs(responses(1)%error - responses(1)%statistics(velocity_part)%error), "<=", 0.0_dp, "band")
        if (allocated(error)) return
      end do
    end do
    ! The bounds are not too wide: somewhere the error is a good part of the claim.
    call check_that(error, maximum, ">", 1.0e-3_dp, "the claimed errors are not too wide")
  end subroutine test_errors

  !> An unbalance u on one spring: (k + i omega b - omega^2 m) x = u omega^2. Soft springs leave accelerations to the load alone,
  !> stiff ones make them differences of great forces.
  subroutine test_extremes(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: u = 0.02_dp, mass = 20, omega = 25, springs(7) = 10.0_dp**[-6, -2, 0, 3, 5, 7, 9]
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(probe_response_type), allocatable :: responses(:)
    type(gestell_error), allocatable :: failure
    complex(dp) :: iw
    real(dp) :: x, damping
    integer :: i, k

    iw = cmplx(0.0_dp, omega, dp)
    call new_harmonic_mechanism(mechanism, 2.0_dp, 0.01_dp, [0.0_dp, u, 0.0_dp], [0.0_dp, 0.0_dp, u], [0.01_dp], [0.01_dp], failure)
    do i = 1, size(springs)
      damping = 1.0e-3_dp * sqrt(springs(i) * mass)
      call new_frame(frame, mechanism, mass - 2, 1.0_dp, [0.0_dp, 0.0_dp], diagonal([springs(i), 1.0_dp, 1.0_dp]), &
        & diagonal([damping, 1.0_dp, 1.0_dp]), omega, failure, free=[1])
      call check_success(error, failure)
      if (.not. allocated(error)) call solve(frame, 36, 1.0e-10_dp, [probe_at(0.0_dp, 0.0_dp)], analysis, responses, error)
      if (allocated(error)) return
      do k = 0, 2
        x = abs(iw**k * u * omega**2 / (springs(i) + damping * iw + mass * iw**2))
        associate (s => responses(1)%statistics(3 * k + 1))
          ! Beside the claim roundings of the closed form itself.
          call near(error, [s%peak], [x], s%peak_error + 1.0e-15_dp * x, "claim")
        end associate
      end do
      if (allocated(error)) return
    end do
  end subroutine test_extremes

end module test_probes
