!> Forces on the ground, reaction by reaction, against momentum, closed forms and limits.
module test_forces
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mechanism_harmonic_mechanism, only: harmonic_mechanism_type, new_harmonic_mechanism
  use gestell_model_mounting, only: support_type
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_rows, only: probe_type, quantity_type
  use gestell_study_vibration_analysis, only: analysis_type
  use gestell_task_forces_reactions, only: along_x, along_y, moment, reaction_type, force_magnitude
  use reference_cases, only: random_linkage, random_machine
  use reference_machine, only: khang_machine, machine_data
  use reference_momentum, only: ground_forces
  use shaken_ground, only: make, near, solve => solve_places
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_forces

contains

  subroutine collect_forces(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("forces on the ground equal the rate of momentum lost", test_momentum), &
      & new_unittest("partial forces add up; peak, rms and crest agree with a fine history", test_parts), &
      & new_unittest("support and guide forces of a rotating unbalance agree with closed forms", test_unbalance), &
      & new_unittest("error bounds of force peaks hold for loose tolerances", test_errors), &
      & new_unittest("a history with more rows than samples has the same values", test_many_rows), &
      & new_unittest("every listed quantity is found; other names are refused", test_names)]
  end subroutine collect_forces

  !> Linkages of all kinds on turned supports, all or some degrees of freedom free: minus d/dt of the momentum of all bodies.
  subroutine test_momentum(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 256
    logical, parameter :: free(3, 4) = reshape([.true., .true., .true., .true., .false., .true., .false., .true., .true., &
      & .true., .true., .false.], [3, 4])
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: reactions(:)
    real(dp) :: forces(3, points), scale(3)
    integer :: i, k

    do i = 1, 8
      machine = random_linkage(i, 1.0_dp, 20.0_dp)
      if (i == 1) machine = khang_machine(-300.0_dp)
      machine%free = free(:, 1 + mod(i, 4))
      call make(machine, frame, error)
      if (allocated(error)) return
      call solve(frame, points, 1.0e-13_dp, analysis, reactions, error)
      if (allocated(error)) return
      forces = ground_forces(machine, analysis%vibration%motion_history(:3, :points))
      associate (total => reactions(size(reactions)))
        ! The motion is good to about 1e-13 of its size; two spectral derivatives of up to 128 orders take four digits and more.
        scale = [maxval(norm2(forces(:2, :), dim=1)), maxval(norm2(forces(:2, :), dim=1)), maxval(abs(forces(3, :)))]
        call near(error, total%history(:points, along_x), forces(1, :), 1.0e-8_dp * scale(1), "x")
        call near(error, total%history(:points, along_y), forces(2, :), 1.0e-8_dp * scale(2), "y")
        call near(error, total%history(:points, moment), forces(3, :), 1.0e-8_dp * scale(3), "moment")
        call near(error, total%history(:points, force_magnitude), [(hypot(forces(1, k), forces(2, k)), k = 1, points)], &
          & 1.0e-8_dp * scale(1), "size")
      end associate
      if (allocated(error)) return
    end do
  end subroutine test_momentum

  !> Supports, foundation and guide add up to the total at every time; peak, rms and crest agree with a fine history.
  subroutine test_parts(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 1024
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: reactions(:)
    real(dp) :: sums(points + 1, 3), r(2), size_of_all
    integer :: i, k, n

    machine = khang_machine(300.0_dp)
    machine%supports(1)%damping = [40.0_dp, 80.0_dp]
    machine%supports(2)%angle_deg = 30
    machine%foundation_stiffness(3, 3) = 1000
    machine%free(2) = .false.
    call make(machine, frame, error)
    if (allocated(error)) return
    call solve(frame, points, 1.0e-12_dp, analysis, reactions, error)
    if (allocated(error)) return
    n = size(reactions)
    call check(error, n, 7)
    if (allocated(error)) return
    call check(error, trim(reactions(1)%name) // trim(reactions(4)%name) // trim(reactions(5)%name) // trim(reactions(6)%name) &
      & // trim(reactions(7)%name), "14foundationguidetotal")
    if (allocated(error)) return
    sums = 0
    do i = 1, n - 1
      r = reactions(i)%position
      sums(:, 1:2) = sums(:, 1:2) + reactions(i)%history(:, along_x:along_y)
      sums(:, 3) = sums(:, 3) + reactions(i)%history(:, moment) + r(1) * reactions(i)%history(:, along_y) &
        & - r(2) * reactions(i)%history(:, along_x)
    end do
    size_of_all = maxval([(reactions(i)%statistics(force_magnitude)%peak, i = 1, n)])
    ! Sums of seven terms; lengths are below 1 m.
    call near(error, reactions(n)%history(:, along_x), sums(:, 1), 1.0e-13_dp * size_of_all, "x")
    call near(error, reactions(n)%history(:, along_y), sums(:, 2), 1.0e-13_dp * size_of_all, "y")
    call near(error, reactions(n)%history(:, moment), sums(:, 3), 1.0e-13_dp * size_of_all, "moment")
    do i = 1, n
      do k = along_x, moment
        associate (s => reactions(i)%statistics(k), f => reactions(i)%history(:points, k))
          ! Parseval: the sum over equidistant points is exact for orders below half of them.
          call near(error, [s%rms], [sqrt(sum(f**2) / points)], 1.0e-12_dp * size_of_all, "rms")
          ! Between points 0.35 deg apart a curve of orders below 20 loses (0.0031 * 20)^2 / 2 at most.
          call near(error, [s%peak], [maxval(abs(f))], 2.0e-3_dp * maxval(abs(f)), "peak")
          if (s%peak > 0) then
            call near(error, [s%crest()], [s%peak / s%rms], 1.0e-15_dp * s%crest(), "crest")
            ! The top of a parabola through three points: less than half a point away.
            call near(error, [abs(modulo(s%peak_phase - real(maxloc(abs(f)) - 1, dp) / points + 0.5_dp, 1.0_dp) - 0.5_dp)], &
              & [0.0_dp], 0.5_dp / points, "where")
          end if
          if (allocated(error)) return
        end associate
      end do
    end do
  end subroutine test_parts

  !> An unbalance u turns on a frame whose rotation is held: (m s^2 + b s + c) q = u Omega^2 exp(i Omega t) along each axis of
  !> the supports, which are turned by 20 deg. Each support carries (k + i Omega b) q; the guide carries the moment h_3 - M_31
  !> xi'' - M_32 eta'' - c_3j q_j - b_3j q_j'.
  subroutine test_unbalance(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 96
    real(dp), parameter :: u = 0.02_dp, m_g = 2, m_f = 30, omega = 40, angle = 20 * pi / 180, origin(2) = [0.1_dp, -0.05_dp]
    real(dp), parameter :: k(2) = [3.0e4_dp, 9.0e4_dp], b(2) = [50.0_dp, 150.0_dp], turned_moment = 0.003_dp
    type(harmonic_mechanism_type) :: mechanism
    type(frame_type) :: frame
    type(support_type) :: supports(2)
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: reactions(:)
    type(gestell_error), allocatable :: failure
    complex(dp) :: e, q(2), axis(2), n(2, 2), force(2)
    real(dp) :: zero(3, 3), t, at(2), speed, sense, v(2), a(2), expected(4, 0:points), h
    integer :: i, j, s, turn

    n(:, 1) = [cos(angle), sin(angle)]
    n(:, 2) = [-sin(angle), cos(angle)]
    supports(1) = support_type([-0.3_dp, -0.2_dp], k, b, angle)
    supports(2) = support_type([0.4_dp, -0.1_dp], 2 * k, 3 * b, angle)
    zero = 0
    do turn = 1, 2
      sense = merge(1, -1, turn == 1)
      speed = sense * omega
      call new_harmonic_mechanism(mechanism, m_g, 0.01_dp, [0.0_dp, u, 0.0_dp], [0.0_dp, 0.0_dp, u], [0.01_dp], &
        & [0.0_dp, 0.0_dp, turned_moment], failure)
      call new_frame(frame, mechanism, m_f, 1.0_dp, origin, zero, zero, speed, failure, free=[1, 2], supports=supports)
      call check_success(error, failure)
      if (allocated(error)) return
      call solve(frame, points, 1.0e-12_dp, analysis, reactions, error)
      if (allocated(error)) return
      call check(error, size(reactions), 4)
      if (allocated(error)) return
      ! h = u Omega^2 (cos Omega t, sin Omega t) is the real part of u omega^2 (1, -i sense) exp(i omega t).
      do j = 1, 2
        axis(j) = sum(n(:, j) * [(1.0_dp, 0.0_dp), cmplx(0.0_dp, -sense, dp)]) * u * omega**2 &
          & / cmplx(3 * k(j) - (m_f + m_g) * omega**2, omega * 4 * b(j), dp)
      end do
      q = matmul(n, axis)
      do i = 0, points
        t = frame%period * i / points
        e = exp(cmplx(0.0_dp, omega * t, dp))
        v = real(q * cmplx(0.0_dp, omega, dp) * e)
        a = real(-omega**2 * q * e)
        ! H = 0.003 sin(phi), a4 = H': h_3 = -Omega^2 (xi_0 a_2'' - eta_0 a_1'' + a_4).
        h = -omega**2 * (-origin(1) * u * sin(speed * t) + origin(2) * u * cos(speed * t) + turned_moment * cos(speed * t))
        expected(moment, i) = h + (m_g * origin(2) + u * sin(speed * t)) * a(1) - (m_g * origin(1) + u * cos(speed * t)) * a(2)
        do s = 1, 2
          force = matmul(n, [(cmplx(supports(s)%stiffness(j), omega * supports(s)%damping(j), dp) * axis(j), j = 1, 2)]) * e
          at = supports(s)%position(:2)
          expected(moment, i) = expected(moment, i) - (at(1) * real(force(2)) - at(2) * real(force(1)))
          ! The closed form and the tolerance 1e-12 of Phi, condition about 1; forces of some 30 N.
          call near(error, reactions(s)%history(i + 1, along_x:along_y), real(force), 1.0e-9_dp, "support")
        end do
        call near(error, reactions(3)%history(i + 1, along_x:force_magnitude), [0.0_dp, 0.0_dp, 0.0_dp], 1.0e-9_dp, "guide, force")
        call near(error, reactions(3)%history(i + 1, moment:moment), expected(moment:moment, i), 1.0e-9_dp, "guide, moment")
        if (allocated(error)) return
      end do
      do s = 1, 2
        force = matmul(n, [(cmplx(supports(s)%stiffness(j), omega * supports(s)%damping(j), dp) * axis(j), j = 1, 2)])
        associate (x => reactions(s)%statistics(along_x), f => reactions(s)%statistics(force_magnitude))
          call near(error, [x%series(1)%amplitude(1), x%series(1)%phase(1)], &
            & [abs(force(1)), atan2(aimag(force(1)), real(force(1)))], 1.0e-9_dp, "amplitude and phase")
          ! The force draws an ellipse: its half axes from f f and f f*.
          call near(error, [f%peak], [sqrt((sum(abs(force)**2) + abs(sum(force**2))) / 2)], 1.0e-9_dp, "ellipse")
          call near(error, [f%rms, f%amplitude(1)], [sqrt(sum(abs(force)**2) / 2), sqrt(sum(abs(force)**2))], 1.0e-9_dp, "rms")
          if (allocated(error)) return
          call check(error, f%strongest(), 1)
          if (allocated(error)) return
        end associate
      end do
    end do
  end subroutine test_unbalance

  !> At loose tolerances the claimed error covers the difference from a solution at 1e-13, for all peaks of all reactions.
  subroutine test_errors(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tolerances(3) = [1.0e-2_dp, 1.0e-4_dp, 1.0e-7_dp]
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: exact(:), reactions(:)
    real(dp) :: miss, maximum
    integer :: number, i, j, k

    maximum = 0
    do number = 1, 6
      machine = random_machine(10 + number, 3.0_dp, 30.0_dp)
      machine%free(1 + mod(number, 3)) = mod(number, 2) == 0
      call make(machine, frame, error)
      if (.not. allocated(error)) call solve(frame, 64, 1.0e-13_dp, analysis, exact, error)
      if (allocated(error)) return
      do i = 1, size(tolerances)
        call solve(frame, 64, tolerances(i), analysis, reactions, error)
        if (allocated(error)) return
        do j = 1, size(reactions)
          do k = along_x, moment
            miss = abs(reactions(j)%statistics(k)%peak - exact(j)%statistics(k)%peak)
            if (reactions(j)%statistics(k)%peak_error > 0) maximum = max(maximum, miss / reactions(j)%statistics(k)%peak_error)
            call check_that(error, miss, "<=", reactions(j)%statistics(k)%peak_error + exact(j)%statistics(k)%peak_error, &
              & trim(reactions(j)%name))
            if (allocated(error)) return
          end do
        end do
      end do
    end do
    ! The bounds are not too wide: somewhere the error is a good part of the claim.
    call check_that(error, maximum, ">", 1.0e-3_dp, "the claimed errors are not too wide")
  end subroutine test_errors

  !> A history of very many rows has times of its own: the same numbers at the times that both have.
  subroutine test_many_rows(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: few(:), many(:)
    integer :: i

    machine = khang_machine(-300.0_dp)
    machine%free(1) = .false.
    call make(machine, frame, error)
    if (.not. allocated(error)) call solve(frame, 250, 1.0e-12_dp, analysis, few, error)
    if (.not. allocated(error)) call solve(frame, 2500, 1.0e-12_dp, analysis, many, error)
    if (allocated(error)) return
    do i = 1, size(few)
      call check(error, size(many(i)%history, 1), 2501)
      ! Times differ by roundings, steps of the integration by its error.
      call near(error, [many(i)%history(::10, :)], [few(i)%history], 1.0e-9_dp * maxval(abs(few(size(few))%history)), "rows")
      if (allocated(error)) return
    end do
  end subroutine test_many_rows

  !> Every listed name finds its quantity, with its unit; other names are refused with the list of valid ones.
  subroutine test_names(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=16), parameter :: good(*) = [character(len=16) :: "xi", "psi_dot", "fx", "m", "f", "support(4).fx", &
      & "support(1).f", "foundation.m", "guide.fy", "probe(a.b).x", "probe(a.b).v", "probe(a.b).ay"]
    character(len=5), parameter :: units(size(good)) = [character(len=5) :: "m", "rad/s", "N", "Nm", "N", "N", "N", "Nm", "N", &
      & "m", "m/s", "m/s^2"]
    character(len=16), parameter :: bad(*) = [character(len=16) :: "", "x", "support(5).fx", "support(0).fx", "support(1).m", &
      & "support(1)", "support().fx", "support(1).", ".fx", "fx.fx", "probe(a).x", "probe(a.b).z", "probe(a.b)", "guide.d", &
      & "probe().x", "support(1)x.fx", "support(04).fx", "support(+4).fx", "support( 4).fx", "support(1e0).fx"]
    type(frame_type) :: frame
    type(quantity_type) :: quantity
    type(gestell_error), allocatable :: failure
    type(probe_type) :: probes(1)
    integer :: i

    probes(1)%name = "a.b"
    call make(khang_machine(240.0_dp), frame, error)
    if (allocated(error)) return
    do i = 1, size(good)
      call find_quantity(frame, probes, trim(good(i)), quantity, failure)
      call check_success(error, failure, trim(good(i)))
      if (.not. allocated(error)) call check(error, trim(quantity%unit), trim(units(i)), more=trim(good(i)))
      if (allocated(error)) return
    end do
    do i = 1, size(bad)
      call find_quantity(frame, probes, trim(bad(i)), quantity, failure)
      call check_failure(error, failure, "'" // trim(bad(i)) // "'")
      if (allocated(error)) return
    end do
  end subroutine test_names

end module test_forces
