!> Modes over the speed, and their crossings with the orders of the crank.
module test_campbell
  use checks, only: check_success, check_that
  use data_files, only: machine_of_file
  use families, only: machine_family
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_study_frame_model_settled_family, only: settled_family_type
  use gestell_task_campbell, only: campbell_options, campbell_type, solve_campbell
  use gestell_task_campbell_crossings, only: crossing_type, find_crossings
  use machines, only: frame_of_machine
  use reference_flow, only: flow_map
  use reference_frame, only: frame_of
  use reference_linear, only: qp
  use reference_machine, only: khang_machine, machine_data, period
  use slow_tests, only: new_slow
  use test_campbell_modes, only: rotor
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_campbell

contains

  subroutine collect_campbell(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("frequencies of a system with constant coefficients cross each order once", test_constant), &
      & new_unittest("ends of locked intervals agree with the quadruple-precision reference", test_locked), &
      & new_slow("crossings do not depend on the requested speeds", test_speeds), &
      & new_slow("a mirrored machine turning in reverse has the same crossings", test_mirrored), &
      & new_slow("crossings do not depend on the crank's initial phase", test_phase), &
      & new_unittest("modes that mix on an order of the crank cross it twice", test_mixing_on_order)]
  end subroutine collect_campbell

  subroutine solve(machine, speeds, orders, campbell, crossings, error, averaged)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: speeds(:)
    integer, intent(in) :: orders
    type(campbell_type), intent(out) :: campbell
    type(crossing_type), allocatable, intent(out) :: crossings(:)
    type(error_type), allocatable, intent(out) :: error
    logical, intent(in), optional :: averaged
    type(machine_family) :: machines
    type(settled_family_type) :: family
    type(campbell_options) :: options
    type(gestell_error), allocatable :: failure

    options%orders = orders
    family%model = "rest"
    if (present(averaged)) family%model = merge("averaged   ", "rest       ", averaged)
    call frame_of_machine(machine, machines%frame, failure)
    allocate(family%inner, source=machines)
    if (.not. allocated(failure)) call solve_campbell(family, speeds, options, campbell, failure)
    if (.not. allocated(failure)) call find_crossings(family, options, campbell, crossings, failure)
    call check_success(error, failure)
  end subroutine solve

  pure function spaced(from, to, count) result(speeds)
    real(dp), intent(in) :: from, to
    integer, intent(in) :: count
    real(dp) :: speeds(count)
    integer :: i

    speeds = [(from + (to - from) * (i - 1) / (count - 1), i = 1, count)]
  end function spaced

  !> All crossings are found once each, with periodic and with averaged coefficients. The frequencies themselves are tested with
  !> the modes.
  subroutine test_constant(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: orders = 5
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: crossings(:)
    !> An interpolating search for a zero needs no more solutions than this.
    integer, parameter :: most = 10
    real(dp) :: w(3), exact
    integer :: mode, k, found, way, sought

    do way = 1, 2
      call solve(rotor(300.0_dp), spaced(250.0_dp, 1500.0_dp, 11), orders, campbell, crossings, error, averaged=way == 2)
      if (allocated(error)) return
      w = campbell%points(1)%modes(:3)%frequency()
      found = 0
      do mode = 1, 3
        do k = 1, orders
          exact = w(mode) / k * 60 / (2 * pi)
          if (exact < 250 .or. exact > 1500) cycle
          found = found + 1
          call check_that(error, found, "<=", size(crossings), "missing")
          if (allocated(error)) return
          associate (c => crossings(found))
            call check_that(error, c%mode, "==", mode, "order")
            call check_that(error, abs(c%order - k), "<=", 0.0_dp, "order")
            call check_that(error, c%locked, "==", .false., "order")
            ! Both frequencies have errors.
            call check_that(error, abs(c%speed - exact), "<=", c%error + campbell%points(1)%modes(mode)%error * 60 / (2 * pi * k), &
              & "beyond the error")
            call check_that(error, c%error, "<", 1.0e-6_dp, "the error bound is not too wide")
            if (allocated(error)) return
          end associate
        end do
      end do
      call check(error, size(crossings), found, more="too many")
      if (allocated(error)) return
      ! Crossings with half orders are sought too, because a mode might lock there.
      sought = count([((abs(w(mode) / k * 120 / (2 * pi) - 875) < 625, k = 1, 2 * orders), mode = 1, 3)])
      call check_that(error, campbell%solutions, "<=", 11 + most * sought, "solutions")
      if (allocated(error)) return
    end do
  end subroutine test_constant

  !> The sieve, with and without damping: at the ends of a locked interval two multipliers meet, trace^2 = 4 det of the
  !> reference's Phi(T).
  subroutine test_locked(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: crossings(:)
    type(gestell_error), allocatable :: failure
    integer :: way, i, side
    real(qp) :: inside, outside

    do way = 1, 2
      call machine_of_file("data/rocking_sieve.nml", machine, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      if (way == 2) machine%foundation_damping = 0
      call solve(machine, spaced(20.0_dp, 300.0_dp, 8), 2, campbell, crossings, error)
      if (allocated(error)) return
      ! Half the speed, where the vibration grows; the speed; twice the speed. Without damping also 1.5 times, where it grows
      ! too.
      call check(error, size(crossings), merge(3, 4, way == 1), more="crossings")
      if (allocated(error)) return
      call check_that(error, abs(crossings(1)%order - 0.5_dp), "<=", 0.0_dp, "half the speed")
      call check_that(error, crossings(1)%at%growth, ">", 0.5_dp, "half the speed")
      if (allocated(error)) return
      do i = 1, size(crossings)
        associate (c => crossings(i))
          ! Undamped, (J q')' + c q = 0 with J = J0 + J1 cos(phi) has no locked intervals at whole orders: two periodic motions
          ! coexist there, as for Ince's equation.
          call check_that(error, c%locked, "/=", (way == 2 .and. abs(c%order - anint(c%order)) <= 0), "locked")
          ! The ends are zeros of differences of squared exponents, so they have about as many accurate digits as the exponents.
          call check_that(error, c%error, "<", 1.0e-7_dp, "the error bound is not too wide")
          if (allocated(error)) return
          do side = 1, 2
            associate (step => (c%error + 1.0e-11_dp * c%speed) * merge(1, -1, side == 1))
              call discriminant(machine, c%ends(side) + step, inside)
              call discriminant(machine, c%ends(side) - step, outside)
            end associate
            call check_that(error, inside > 0, "==", c%locked, "end beyond its error")
            call check_that(error, outside, "<", 0.0_qp, "end beyond its error")
            if (allocated(error)) return
          end do
        end associate
      end do
    end do
  end subroutine test_locked

  subroutine discriminant(machine, speed, value)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: speed
    real(qp), intent(out) :: value
    type(machine_data) :: other
    real(qp) :: phi(2, 2), particular(2)

    other = machine
    other%speed_rpm = speed
    call flow_map(frame_of(other), 0.0_qp, period(other), 1.0e-24_qp, phi, particular)
    value = (phi(1, 1) - phi(2, 2))**2 + 4 * phi(1, 2) * phi(2, 1)
  end subroutine discriminant

  !> The same crossings in another order of speeds.
  subroutine compare(a, b, sign, error)
    type(crossing_type), intent(in) :: a(:), b(:)
    real(dp), intent(in) :: sign
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: shift, width, allowed
    integer :: i

    call check(error, size(a), size(b), more="number of crossings")
    if (allocated(error)) return
    do i = 1, size(a)
      call check_that(error, a(i)%mode, "==", b(i)%mode, "mode and order")
      call check_that(error, abs(a(i)%order - b(i)%order), "<=", 0.0_dp, "mode and order")
      call check_that(error, abs(a(i)%speed - sign * b(i)%speed), "<=", a(i)%error + b(i)%error, "speed")
      if (allocated(error)) return
      ! The error of each crossing also bounds the growth at its own speed (rpm), because between the two speeds the growth
      ! changes by less than itself in the whole range of speeds. If an interval with locked frequency is narrower than the
      ! errors, the growth is accurate to the change of the frequency within it.
      shift = abs(a(i)%speed - sign * b(i)%speed)
      allowed = a(i)%at%error + b(i)%at%error + 0.1_dp * abs(a(i)%at%growth) * shift
      width = abs(a(i)%ends(2) - a(i)%ends(1))
      if (width < a(i)%error + b(i)%error) allowed = allowed + a(i)%order * pi / 30 * (width + shift)
      call check_that(error, abs(a(i)%at%growth - b(i)%at%growth), "<=", allowed, "growth")
      ! At the ends of an interval, where two exponents meet, their errors are of the order of the tolerance's square root.
      call check_that(error, a(i)%error, "<", 1.0e-4_dp, "the error bound is not too wide")
      if (allocated(error)) return
    end do
  end subroutine compare

  subroutine test_speeds(error)
    type(error_type), allocatable, intent(out) :: error
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: few(:), many(:), backward(:)

    call solve(khang_machine(240.0_dp), spaced(300.0_dp, 800.0_dp, 4), 5, campbell, few, error)
    if (.not. allocated(error)) call solve(khang_machine(240.0_dp), spaced(300.0_dp, 800.0_dp, 38), 5, campbell, many, error)
    if (.not. allocated(error)) call solve(khang_machine(240.0_dp), spaced(800.0_dp, 300.0_dp, 9), 5, campbell, backward, error)
    if (allocated(error)) return
    ! Frequencies 20.26, 32.05, 52.49 Hz over 5 to 13.3 Hz: orders 2 to 4, 3 to 5, 4 and 5.
    call check(error, size(few), 8, more="crossings")
    if (.not. allocated(error)) call compare(few, many, 1.0_dp, error)
    if (.not. allocated(error)) call compare(few, backward, 1.0_dp, error)
  end subroutine test_speeds

  !> Mirrored at the x-axis.
  subroutine test_mirrored(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: here(:), there(:)
    integer :: i

    machine = khang_machine(240.0_dp, mass_factor=5.0_dp)
    call solve(machine, spaced(300.0_dp, 600.0_dp, 5), 4, campbell, here, error)
    if (allocated(error)) return
    do i = 1, size(machine%joints)
      machine%joints(i)%position(2) = -machine%joints(i)%position(2)
      machine%joints(i)%branch = -machine%joints(i)%branch
    end do
    do i = 1, size(machine%links)
      machine%links(i)%center(2) = -machine%links(i)%center(2)
    end do
    machine%origin(2) = -machine%origin(2)
    do i = 1, size(machine%supports)
      machine%supports(i)%position(2) = -machine%supports(i)%position(2)
    end do
    call solve(machine, spaced(-300.0_dp, -600.0_dp, 5), 4, campbell, there, error)
    if (.not. allocated(error)) call check_that(error, size(here), ">", 3, "crossings")
    if (.not. allocated(error)) call compare(here, there, -1.0_dp, error)
  end subroutine test_mirrored

  subroutine test_phase(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: here(:), there(:)

    machine = khang_machine(240.0_dp, mass_factor=5.0_dp)
    call solve(machine, spaced(300.0_dp, 600.0_dp, 5), 4, campbell, here, error)
    machine%joints(3)%phase_deg = 130
    if (.not. allocated(error)) call solve(machine, spaced(300.0_dp, 600.0_dp, 5), 4, campbell, there, error)
    if (.not. allocated(error)) call compare(here, there, 1.0_dp, error)
  end subroutine test_phase

  !> Links of 27 kg: the first frequency is about the crank's, the second about twice that. Where the two differ by the crank's
  !> frequency the modes mix. Branches cross the orders twice, once on each side, for any requested speeds. That the numbers of
  !> the modes are exchanged in between is no crossing.
  subroutine test_mixing_on_order(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: few(:), many(:)
    real(qp) :: phi(6, 6), particular(6), sum_of_growth
    integer :: i, k

    machine = khang_machine(240.0_dp)
    machine%links%mass = [10.0_dp, 12.0_dp, 5.0_dp]
    machine%foundation_damping = 100 * machine%foundation_damping
    call solve(machine, spaced(600.0_dp, 660.0_dp, 3), 2, campbell, few, error)
    if (.not. allocated(error)) call solve(machine, spaced(590.0_dp, 670.0_dp, 12), 2, campbell, many, error)
    if (.not. allocated(error)) call check(error, size(few), 2, more="crossings")
    if (.not. allocated(error)) call compare(few, many, 1.0_dp, error)
    if (allocated(error)) return
    do i = 1, 2
      call check_that(error, few(i)%locked, "==", .true., "not locked")
      call check_that(error, few(i)%speed, ">", 600.0_dp, "not locked")
      call check_that(error, few(i)%speed, "<", 660.0_dp, "not locked")
      if (allocated(error)) return
      ! A multiplier of the reference there is real: with 1 / rho its characteristic polynomial changes sign between the two.
      machine%speed_rpm = few(i)%speed
      call flow_map(frame_of(machine), 0.0_qp, period(machine), 1.0e-22_qp, phi, particular)
      associate (mode => few(i)%at, t => real(period(machine), dp))
        sum_of_growth = (mode%growth + mode%partner_growth) / 2
        do k = -1, 1
          particular(k + 2) = polynomial(phi, exp((sum_of_growth + k * (mode%growth - mode%partner_growth)) * t))
        end do
        call check_that(error, particular(1) * particular(2), "<", 0.0_qp, "reference")
        call check_that(error, particular(2) * particular(3), "<", 0.0_qp, "reference")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_mixing_on_order

  !> det(Phi - rho E) by elimination.
  pure real(qp) function polynomial(phi, rho)
    real(qp), intent(in) :: phi(:, :), rho
    real(qp) :: a(size(phi, 1), size(phi, 1)), row(size(phi, 1))
    integer :: i, k, best

    a = phi
    do i = 1, size(a, 1)
      a(i, i) = a(i, i) - rho
    end do
    polynomial = 1
    do i = 1, size(a, 1)
      best = i - 1 + maxloc(abs(a(i:, i)), dim=1)
      if (best /= i) polynomial = -polynomial
      row = a(best, :)
      a(best, :) = a(i, :)
      a(i, :) = row
      polynomial = polynomial * a(i, i)
      do k = i + 1, size(a, 1)
        a(k, :) = a(k, :) - a(k, i) / a(i, i) * a(i, :)
      end do
    end do
  end function polynomial

end module test_campbell
