!> Resonance curves: a closed form, a search by brute force, what must not depend on the grid.
module test_resonance_curve
  use checks, only: check_success, check_that
  use families, only: machine_family
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: in_resonance, operator(==), state_word, undamped, unstable
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_linkage, only: linkage_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_task_resonance_curve, only: resonance_curve_type, solve_curve
  use gestell_study_speed_point, only: speed_options
  use gestell_system_periodic, only: periodic_system
  use gestell_study_frame_model_settled_family, only: settled_family_type
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine, machine_data
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_resonance_curve

  !> A mass M on spring and damper, with an unbalance m e; rpm of its natural frequency.
  real(dp), parameter :: total = 20.0_dp, unbalance = 0.1_dp, natural_rpm = 300.0_dp, natural = natural_rpm * 2 * pi / 60

contains

  subroutine collect_resonance_curve(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the resonance curve of an unbalanced rotor agrees with its closed form", test_closed_form), &
      & new_unittest("clockwise rotation and descending speeds yield the same resonance curve", test_clockwise), &
      & new_unittest("without damping the maximum is reported as unbounded", test_undamped), &
      & new_unittest("a speed without any periodic vibration is listed as resonance", test_no_vibration), &
      & new_slow("every maximum found by brute force is listed", test_brute_force), &
      & new_slow("straight lines between the points approximate the curve within 1 %", test_straight), &
      & new_slow("the listed maxima do not depend on the grid", test_grids), &
      & new_slow("speeds inside an instability tongue are marked, with unbounded vibration at both ends", test_tongue)]
  end subroutine collect_resonance_curve

  subroutine unbalanced_family(ratio, family, error)
    real(dp), intent(in) :: ratio
    type(machine_family), intent(out) :: family
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(linkage_type) :: linkage
    real(dp) :: c(3, 3), b(3, 3)

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 1.0_dp, 0.0_dp, failure)
    call linkage%link("crank", "O", "A", 2.0_dp, 1.0_dp, [unbalance / 2, 0.0_dp], failure)
    c = 0
    b = 0
    c(1, 1) = total * natural**2
    b(1, 1) = 2 * ratio * total * natural
    call new_frame(family%frame, linkage, total - 2, 1.0_dp, [0.0_dp, 0.0_dp], c, b, 1.0_dp, failure, free=[1])
    call check_success(error, failure)
  end subroutine unbalanced_family

  !> |xi| of M xi'' + b xi' + c xi = m e Omega^2 cos(Omega t).
  elemental real(dp) function amplitude(rpm, ratio)
    real(dp), intent(in) :: rpm, ratio
    real(dp) :: r

    r = rpm / natural_rpm
    amplitude = unbalance / total * r**2 / hypot(1 - r**2, 2 * ratio * r)
  end function amplitude

  pure type(speed_options) function order_of(names)
    character(len=*), intent(in) :: names(:)

    allocate(order_of%names(size(names)), order_of%probes(0))
    order_of%names = names
    order_of%orders = 3
  end function order_of

  pure function grid(from, to, count) result(speeds)
    real(dp), intent(in) :: from, to
    integer, intent(in) :: count
    real(dp) :: speeds(count)
    integer :: k

    speeds = [(from + (to - from) * real(k, dp) / (count - 1), k = 0, count - 1)]
  end function grid

  subroutine solve(family, names, speeds, curve, error)
    type(machine_family), intent(in) :: family
    character(len=*), intent(in) :: names(:)
    real(dp), intent(in) :: speeds(:)
    type(resonance_curve_type), intent(out) :: curve
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call solve_curve(family, order_of(names), speeds, curve, failure)
    call check_success(error, failure)
  end subroutine solve

  subroutine test_closed_form(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: ratios(*) = [0.3_dp, 0.02_dp, 1.0e-4_dp]
    type(machine_family) :: family
    type(resonance_curve_type) :: curve
    integer :: i

    do i = 1, size(ratios)
      call unbalanced_family(ratios(i), family, error)
      if (.not. allocated(error)) call solve(family, ["xi"], grid(50.0_dp, 1000.0_dp, 6), curve, error)
      if (.not. allocated(error)) call check_curve(curve, ratios(i), 1.0_dp, error)
      if (allocated(error)) return
    end do
  end subroutine test_closed_form

  !> With `direction` -1 the speeds are negative.
  subroutine check_curve(curve, ratio, direction, error)
    type(resonance_curve_type), intent(in) :: curve
    real(dp), intent(in) :: ratio, direction
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: rpm(:), between(:)
    real(dp) :: s(2), height, width
    integer :: i, n

    n = size(curve%points)
    rpm = direction * curve%points%speed
    call check_that(error, state_word(curve%points%state), "==", "ok", "states")
    call check_that(error, curve%complete, "==", .true., "complete")
    do i = 1, n
      associate (p => curve%points(i)%values(:, 1), right => amplitude(rpm(i), ratio))
        ! Phi is accurate to 1e-9, x0 near the resonance to 1e-9 / (2 pi ratio); in fact much more accurate
        call check_that(error, abs([p(1), p(3) * sqrt(2.0_dp), p(4)] / right - 1), "<=", &
          & 1.0e-9_dp / min(1.0_dp, 2 * pi * ratio), "vibration")
        ! one harmonic: the others are rounding
        call check_that(error, p(5:6), "<", 1.0e-11_dp * right, "other orders")
      end associate
    end do
    ! error of linear interpolation
    between = (rpm(2:) + rpm(:n - 1)) / 2
    call check_that(error, maxval(abs(log(amplitude(between, ratio)) &
      & - (log(amplitude(rpm(2:), ratio)) + log(amplitude(rpm(:n - 1), ratio))) / 2)), "<", 0.01_dp, "logarithm between points")
    call check_that(error, size(curve%maxima), "==", 1, "maxima")
    if (allocated(error)) return
    associate (maximum => curve%maxima(1))
      ! top at 1 / sqrt(1 - 2 ratio^2), (m e / M) / (2 ratio sqrt(1 - ratio^2)); half power where s = r^2 solves
      ! s^2 = H^2 / 2 ((1 - s)^2 + 4 ratio^2 s), H = 1 / (2 ratio sqrt(1 - ratio^2))
      height = 1 / (2 * ratio * sqrt(1 - ratio**2))
      ! to 1e-6, as promised
      call check(error, direction * maximum%speed, natural_rpm / sqrt(1 - 2 * ratio**2), thr=1.0e-6_dp * natural_rpm)
      ! a top is flat: a miss of 1e-9 as ordered, and what Phi leaves
      if (.not. allocated(error)) call check(error, maximum%value, unbalance / total * height, &
        & thr=unbalance / total * height * (2.0e-9_dp + 1.0e-9_dp / (2 * pi * ratio)))
      if (.not. allocated(error)) call check(error, maximum%strongest_order, 1)
      if (allocated(error)) return
      s = roots(1 - height**2 / 2, height**2 * (1 - 2 * ratio**2), -height**2 / 2)
      width = natural_rpm * abs(sqrt(s(1)) - sqrt(s(2)))
      ! the half-power speeds are interpolated between points, one of which is as near as 1e-4 half-widths
      call check(error, maximum%width, width, thr=1.0e-4_dp * width)
      if (.not. allocated(error)) call check(error, maximum%damping_ratio, width / (2 * maximum%speed * direction), &
        & thr=1.0e-4_dp * width / maximum%speed * direction)
      ! a narrow resonance: the damping ratio itself, except for its square and the error of the estimated width
      if (.not. allocated(error) .and. ratio < 0.1_dp) call check(error, maximum%damping_ratio, ratio, &
        & thr=ratio * (1.0e-4_dp + 3 * ratio))
    end associate
  end subroutine check_curve

  !> Damping ratio of a s^2 + b s + c.
  pure function roots(a, b, c) result(s)
    real(dp), intent(in) :: a, b, c
    real(dp) :: s(2)

    s = -(b + [1, -1] * sqrt(b**2 - 4 * a * c)) / (2 * a)
  end function roots

  subroutine test_clockwise(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: family
    type(resonance_curve_type) :: curve

    call unbalanced_family(0.01_dp, family, error)
    if (.not. allocated(error)) call solve(family, ["xi"], grid(-50.0_dp, -1000.0_dp, 6), curve, error)
    if (allocated(error)) return
    call check_that(error, curve%points(2:)%speed, "<", curve%points(:size(curve%points) - 1)%speed, "speeds descend")
    if (.not. allocated(error)) call check_curve(curve, 0.01_dp, -1.0_dp, error)
    if (.not. allocated(error)) call solve(family, ["xi"], grid(1000.0_dp, 50.0_dp, 6), curve, error)
    if (.not. allocated(error)) call check_curve(curve, 0.01_dp, 1.0_dp, error)
  end subroutine test_clockwise

  subroutine test_undamped(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: family
    type(resonance_curve_type) :: curve

    call unbalanced_family(0.0_dp, family, error)
    if (.not. allocated(error)) call solve(family, ["xi"], grid(50.0_dp, 1000.0_dp, 6), curve, error)
    ! at a half, a third, ... of the natural frequency Phi = E: the free vibration is periodic, with arbitrary amplitude
    if (allocated(error)) return
    call check(error, all(curve%points%state == undamped .or. curve%points%state == in_resonance), more="states")
    call check_that(error, curve%complete, "==", .true., "complete")
    call check_that(error, size(curve%maxima), "==", 1, "maxima")
    call check_that(error, curve%maxima(1)%unbounded, "==", .true., "unbounded")
    call check_that(error, curve%maxima(1)%value, ">", huge(1.0_dp), "maximum")
    ! intervals there are a millionth wide
    if (.not. allocated(error)) call check(error, curve%maxima(1)%speed, natural_rpm, thr=1.0e-6_dp * natural_rpm)
  end subroutine test_undamped

  !> The speed of the resonance is a point of the grid, so that there is no vibration between the speeds on its two sides.
  subroutine test_no_vibration(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=8), parameter :: models(2) = [character(len=8) :: "rest", "averaged"]
    type(machine_family) :: machines
    type(settled_family_type) :: family
    type(resonance_curve_type) :: curve
    type(gestell_error), allocatable :: failure
    integer :: k

    call unbalanced_family(0.0_dp, machines, error)
    allocate(family%inner, source=machines)
    do k = 1, 2
      if (allocated(error)) return
      family%model = models(k)
      call solve_curve(family, order_of(["xi"]), natural_rpm * grid(0.6_dp, 1.4_dp, 9), curve, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, count(curve%points%state == in_resonance), "==", 1, "points in resonance")
      call check_that(error, size(curve%maxima), "==", 1, "maxima")
      call check_that(error, curve%maxima(1)%unbounded, "==", .true., "unbounded")
      call check_that(error, curve%maxima(1)%value, ">", huge(1.0_dp), "maximum")
      ! the speed of the resonance is one of the solved points
      if (.not. allocated(error)) call check(error, curve%maxima(1)%speed, natural_rpm, thr=1.0e-9_dp * natural_rpm)
    end do
  end subroutine test_no_vibration

  !> The paper's machine with `factor` times its damping.
  subroutine khang_family(factor, family, error)
    real(dp), intent(in) :: factor
    type(machine_family), intent(out) :: family
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(machine_data) :: machine

    machine = khang_machine(240.0_dp)
    machine%foundation_damping = factor * machine%foundation_damping
    call frame_of_machine(machine, family%frame, failure)
    call check_success(error, failure)
  end subroutine khang_family

  !> At one of two places within every interval the machine is solved separately. Where two maxima are equal the peaks have
  !> kinks.
  subroutine test_straight(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: places(2) = [0.5_dp, 0.31_dp], dampings(2) = [5.0_dp, 100.0_dp]
    type(machine_family) :: family
    type(resonance_curve_type) :: curve
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure
    class(periodic_system), allocatable :: system
    real(dp) :: worst
    integer :: d, i

    do d = 1, size(dampings)
      call khang_family(dampings(d), family, error)
      if (.not. allocated(error)) call solve(family, ["xi ", "eta", "psi"], grid(500.0_dp, 1500.0_dp, 5), curve, error)
      if (allocated(error)) return
      worst = 0
      do i = 2, size(curve%points)
        associate (a => curve%points(i - 1), b => curve%points(i), place => places(1 + mod(i, 2)))
          call family%member([a%speed + place * (b%speed - a%speed)], system, failure)
          select type (system)
          class is (frame_type)
            if (.not. allocated(failure)) call analyse(system, analysis_options(model="rest", stability=.false., points=64), &
              & accuracy_type(), analysis, failure)
          end select
          call check_success(error, failure)
          if (allocated(error)) return
          worst = max(worst, maxval(abs(log(analysis%vibration%peak(:3)) - (1 - place) * log(a%values(1, :)) &
            & - place * log(b%values(1, :)))))
        end associate
      end do
      call check_that(error, worst, "<", 0.01_dp, "straight lines miss")
      if (allocated(error)) return
    end do
  end subroutine test_straight

  !> Every maximum of a fine grid of single solutions with a prominence of 6 % is listed for a coarse grid too, at least as high
  !> and less than a step away.
  subroutine test_brute_force(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: fine = 601
    type(machine_family) :: family
    type(resonance_curve_type) :: curve
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure
    class(periodic_system), allocatable :: system
    real(dp) :: speeds(fine), peak(fine, 2), away
    integer :: i, q, found

    call khang_family(20.0_dp, family, error)
    if (.not. allocated(error)) call solve(family, ["psi", "f  "], grid(300.0_dp, 1500.0_dp, 8), curve, error)
    if (allocated(error)) return
    speeds = grid(300.0_dp, 1500.0_dp, fine)
    do i = 1, fine
      call family%member([speeds(i)], system, failure)
      select type (system)
      class is (frame_type)
        call analyse(system, analysis_options(model="rest", stability=.false., points=360), accuracy_type(), analysis, failure)
      end select
      call check_success(error, failure)
      if (allocated(error)) return
      associate (history => analysis%vibration%history)
        peak(i, :) = [maxval(abs(history(3, :))), maxval(hypot(history(7, :), history(8, :)))]
      end associate
    end do
    found = 0
    do q = 1, 2
      do i = 2, fine - 1
        if (peak(i, q) < max(peak(i - 1, q), peak(i + 1, q)) .or. prominence(peak(:, q), i) < 1.06_dp) cycle
        found = found + 1
        away = minval(abs(curve%maxima%speed - speeds(i)), mask=curve%maxima%quantity == q &
          & .and. curve%maxima%value > (1 - 1.0e-6_dp) * peak(i, q))
        call check_that(error, away, "<", 2 * (speeds(2) - speeds(1)), "a maximum is missed")
        if (allocated(error)) return
      end do
    end do
    ! orders 1 to 4 of the lowest frequency, 1216 rpm, in both at least
    call check_that(error, found, ">=", 8, "maxima found")
  end subroutine test_brute_force

  !> Factor by which the maximum at place i exceeds the higher one of the minima that separate it from higher maxima.
  pure real(dp) function prominence(peak, i)
    real(dp), intent(in) :: peak(:)
    integer, intent(in) :: i
    real(dp) :: dip(2)
    integer :: k

    dip = peak(i)
    do k = i - 1, 1, -1
      if (peak(k) > peak(i)) exit
      dip(1) = min(dip(1), peak(k))
    end do
    do k = i + 1, size(peak)
      if (peak(k) > peak(i)) exit
      dip(2) = min(dip(2), peak(k))
    end do
    prominence = peak(i) / maxval(dip)
  end function prominence

  !> Maxima of the unmodified paper's machine, whose resonances are a few thousandths of a rpm wide, from 5 and from 30 speeds.
  subroutine test_grids(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: family
    type(resonance_curve_type) :: coarse, fine
    integer :: i

    call khang_family(1.0_dp, family, error)
    if (.not. allocated(error)) call solve(family, ["f"], grid(450.0_dp, 1150.0_dp, 5), coarse, error)
    if (.not. allocated(error)) call solve(family, ["f"], grid(450.0_dp, 1150.0_dp, 30), fine, error)
    if (allocated(error)) return
    call check_that(error, size(coarse%maxima), "==", size(fine%maxima), "maxima")
    call check_that(error, size(fine%maxima), ">=", 5, "maxima")
    if (allocated(error)) return
    do i = 1, size(fine%maxima)
      associate (one => coarse%maxima(i), other => fine%maxima(i))
        ! twice the 1e-6 that is promised; the tops are flat there to 1e-6 and less
        call check(error, one%speed, other%speed, thr=2.0e-6_dp * other%speed)
        if (.not. allocated(error)) call check(error, one%value, other%value, thr=1.0e-5_dp * other%value)
        if (.not. allocated(error)) call check(error, one%strongest_order, other%strongest_order)
      end associate
      if (allocated(error)) return
    end do
  end subroutine test_grids

  !> The paper's machine near its lowest frequency, 1216 rpm, where a multiplier passes 1: unstable speeds are marked, and at
  !> both ends of their range the vibration grows without bound.
  subroutine test_tongue(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: family
    type(resonance_curve_type) :: curve
    real(dp), allocatable :: ends(:)
    integer :: i

    call khang_family(1.0_dp, family, error)
    if (.not. allocated(error)) call solve(family, ["psi"], grid(1200.0_dp, 1230.0_dp, 7), curve, error)
    if (allocated(error)) return
    call check_that(error, count(curve%points%state == unstable), ">", 0, "unstable points")
    call check_that(error, count(curve%maxima%unbounded), "==", 2, "maxima without a bound")
    call check_that(error, curve%complete, "==", .true., "complete")
    if (allocated(error)) return
    ends = pack([(curve%maxima(i)%speed, i = 1, size(curve%maxima))], [(curve%maxima(i)%unbounded, i = 1, size(curve%maxima))])
    do i = 1, size(curve%points)
      associate (s => curve%points(i)%speed, inside => curve%points(i)%state == unstable)
        ! the borders are accurate to the last interval, a millionth wide
        if (minval(abs(s - ends)) > 4.0e-6_dp * s) call check_that(error, inside, "==", (s > ends(1) .and. s < ends(2)), &
          & "inside the tongue")
      end associate
      if (allocated(error)) return
    end do
  end subroutine test_tongue

end module test_resonance_curve
