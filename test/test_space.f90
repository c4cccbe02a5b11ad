!> The frame in space against d'Alembert's principle link by link (validation/space/newton_euler.py, numbers of
!> doc/validation.md), and its derivatives against differences; `test_space_held_speed` has it against the plane.
module test_space
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: floquet_type, follow, solve_floquet, solve_multipliers, solve_periodic
  use gestell_math_dft, only: dft
  use gestell_math_series_trigonometric, only: series_through
  use gestell_model_frame, only: frame_type, add_gravity
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_model_space_masses, only: masses_type, plane_type, sum_planes
  use gestell_model_space, only: in_frame
  use gestell_model_space_variation, only: sample_varied
  use gestell_system_second_order, only: second_order_system
  use space_jets, only: sums_by_jets
  use slow_tests, only: new_slow
  use space_machines, only: engine, three_planes, v_twin
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_space

  integer, parameter :: points = 128
  real(dp), parameter :: rpm = pi / 30

contains

  subroutine collect_space(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("vectorised mass functions in space agree with jets and are reused", test_masses), &
      & new_unittest("derivatives of the exact equations in space agree with differences", test_derivatives), &
      & new_unittest("the balanced orders of engines agree with the literature", test_engines), &
      & new_slow("exact and linear results in space satisfy d'Alembert's principle", test_reference)]
  end subroutine collect_space

  !> In more than one batch of angles, also for a slider that only translates; another frame reuses them.
  subroutine test_masses(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 70
    integer :: i
    real(dp), parameter :: angles(n) = [(0.37_dp * i, i = 1, n)]
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure

    call three_planes(-420 * rpm, 1.0_dp, frame, failure)
    call check_success(error, failure)
    if (.not. allocated(error)) call compare("three planes")
    if (allocated(error)) return
    call v_twin(740 * rpm, frame, failure)
    call check_success(error, failure)
    if (.not. allocated(error)) call compare("V-twin")

  contains

    !> Compares to the rounding of the largest value of each kind, and exactly for reused values.
    subroutine compare(what)
      character(len=*), intent(in) :: what
      type(masses_type) :: bulk, one, again
      type(plane_type), allocatable :: planes(:)
      integer :: k

      planes = frame%space%planes
      call sum_planes(planes, angles, bulk)
      do k = 1, n
        call sums_by_jets(planes, angles(k), one)
        call check_that(error, abs(bulk%mass - one%mass), "<=", 1.0e-15_dp * one%mass, what // ": mass")
        call check_that(error, maxval(abs(bulk%s(k, :, :) - one%s(1, :, :))), "<=", 1.0e-13_dp * maxval(abs(bulk%s)), what // ": S")
        call check_that(error, maxval(abs(bulk%j(k, :, :, :) - one%j(1, :, :, :))), "<=", 1.0e-13_dp * maxval(abs(bulk%j)), &
          & what // ": J")
        call check_that(error, maxval(abs(bulk%h(k, :, :) - one%h(1, :, :))), "<=", 1.0e-13_dp * maxval(abs(bulk%h)), what // ": H")
        if (allocated(error)) return
      end do
      call frame%space%masses_at(frame%mass, angles, bulk)
      call frame%space%remember(angles)
      frame%space%planes(:)%origin(1) = 7
      call frame%space%masses_at(frame%mass, angles, again)
      call check_that(error, maxval(abs(again%j - bulk%j)) + maxval(abs(again%s - bulk%s)) + maxval(abs(again%h - bulk%h)), "<=", &
        & 0.0_dp, what // ": remembered")
      call frame%space%masses_at(frame%mass, angles(2:), again)
      call check_that(error, maxval(abs(again%j - bulk%j(2:, :, :, :))), ">", 0.01_dp, what // ": other angles")
      if (.not. allocated(error)) call compare_thirds(what)
    end subroutine compare

    !> Compares every derivative with central differences of step h: h^2 and rounding over h leave an error of 1e-9.
    subroutine compare_thirds(what)
      character(len=*), intent(in) :: what
      real(dp), parameter :: h = 1.0e-5_dp
      type(masses_type) :: at, ahead, behind, known

      call sum_planes(frame%space%planes, angles, known)
      call sum_planes(frame%space%planes, angles, at, third=.true.)
      call sum_planes(frame%space%planes, angles + h, ahead, third=.true.)
      call sum_planes(frame%space%planes, angles - h, behind, third=.true.)
      call check_that(error, maxval(abs(at%s(:, :, :2) - known%s)), "<=", 1.0e-13_dp * maxval(abs(known%s)), what // ": S again")
      if (.not. allocated(error)) call check_that(error, maxval(abs((ahead%s(:, :, :2) - behind%s(:, :, :2)) / (2 * h) &
        & - at%s(:, :, 1:))), "<=", 1.0e-8_dp * maxval(abs(at%s)), what // ": S'''")
      if (.not. allocated(error)) call check_that(error, maxval(abs((ahead%j(:, :, :, :1) - behind%j(:, :, :, :1)) / (2 * h) &
        & - at%j(:, :, :, 1:))), "<=", 1.0e-8_dp * maxval(abs(at%j)), what // ": J''")
      if (.not. allocated(error)) call check_that(error, maxval(abs((ahead%h(:, :, :1) - behind%h(:, :, :1)) / (2 * h) &
        & - at%h(:, :, 1:))), "<=", 1.0e-8_dp * maxval(abs(at%h)), what // ": H''")
      if (.not. allocated(error)) call check_that(error, maxval(abs((ahead%k(:, :1) - behind%k(:, :1)) / (2 * h) &
        & - at%k(:, 1:))), "<=", 1.0e-8_dp * maxval(abs(at%k)), what // ": K''")
    end subroutine compare_thirds

  end subroutine test_masses

  !> Central differences of steps h and h/2, extrapolated: h^4 and rounding over h leave an error of 1e-9 of the maximum.
  subroutine test_derivatives(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: t = 0.0123_dp, step = 1.0e-3_dp
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp) :: q(6, 0:2), derivatives(6, 6, 0:2), found(6, 2), scale(0:2)
    integer :: i, k, n

    call three_planes(-420 * rpm, 1.0_dp, frame, failure)
    ! with weights, and static forces of which one turns
    frame%supports(2)%turning = .true.
    if (.not. allocated(failure)) call add_gravity(frame, [3.0_dp, -8.0_dp, 4.0_dp], failure)
    call check_success(error, failure)
    if (allocated(error)) return
    q(in_frame, 0) = [0.02_dp, -0.01_dp, 0.03_dp, 0.4_dp, -0.3_dp, 0.5_dp]
    q(in_frame, 1) = [0.5_dp, 0.3_dp, -0.4_dp, 3.0_dp, 5.0_dp, -4.0_dp]
    q(in_frame, 2) = [-9.0_dp, 20.0_dp, 10.0_dp, 90.0_dp, -60.0_dp, 50.0_dp]
    scale = [1.0_dp, 10.0_dp, 100.0_dp]
    derivatives = 0
    call derive(q, derivatives)
    do k = 0, 2
      do i = 1, 6
        do n = 1, 2
          found(:, n) = (left(i, k, scale(k) * step / n) - left(i, k, -scale(k) * step / n)) / (2 * scale(k) * step / n)
        end do
        found(:, 1) = found(:, 2) + (found(:, 2) - found(:, 1)) / 3
        call check_that(error, maxval(abs(found(:, 1) - derivatives(:, i, k))), "<=", &
          & 1.0e-9_dp * maxval(abs(derivatives(:, :, k))), "derivative by q")
        if (allocated(error)) return
      end do
    end do

  contains

    !> Left sides and derivatives in the frame's order of degrees of freedom. `there`: motion in this order.
    subroutine sample(there, left, m, b, c)
      real(dp), intent(in) :: there(6, 0:2)
      real(dp), intent(out) :: left(1, 6), m(1, 6, 6), b(1, 6, 6), c(1, 6, 6)
      real(dp), parameter :: no_lag(1, 3) = 0

      call sample_varied(frame, frame%space, [frame%speed * t], reshape(there(:, 0), [1, 6]), reshape(there(:, 1), [1, 6]), &
        & reshape(there(:, 2), [1, 6]), no_lag, left, m, b, c)
    end subroutine sample

    subroutine derive(q, derivatives)
      real(dp), intent(in) :: q(6, 0:2)
      real(dp), intent(out) :: derivatives(6, 6, 0:2)
      real(dp) :: r(1, 6), m(1, 6, 6), b(1, 6, 6), c(1, 6, 6)

      call sample(q, r, m, b, c)
      derivatives = reshape([c, b, m], [6, 6, 3])
    end subroutine derive

    function left(i, k, change) result(r)
      integer, intent(in) :: i, k
      real(dp), intent(in) :: change
      real(dp) :: r(6), all_r(1, 6), there(6, 0:2), m(1, 6, 6), b(1, 6, 6), c(1, 6, 6)

      there = q
      there(i, k) = there(i, k) + change
      call sample(there, all_r, m, b, c)
      r = all_r(1, :)
    end function left

  end subroutine test_derivatives

  !> For equal cylinders every order k of the force is a sum of exp(i k pin) over the cylinders of a bank; the couple is the
  !> same sum with their positions. The vanishing orders are below 1e-12 of one cylinder's, the others are present. The orders 1
  !> to 4, of force and couple, are those of the textbooks (W. Thomson, Fundamentals of Automotive Engine Balance, 1978).
  subroutine test_engines(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: c = 0.1_dp
    integer :: i

    call compare("I2", [0, 180], [0, 0], [(c * i, i = 1, 2)] - 1.5_dp * c, [.false., .true., .false., .true.], &
      & [.true., .false., .true., .false.])
    call compare("I3", [0, 120, 240], [0, 0, 0], [(c * i, i = 1, 3)] - 2 * c, [.false., .false., .false., .false.], &
      & [.true., .true., .false., .true.])
    call compare("I4", [0, 180, 180, 0], [(0, i = 1, 4)], [(c * i, i = 1, 4)] - 2.5_dp * c, [.false., .true., .false., .true.], &
      & [.false., .false., .false., .false.])
    call compare("I5", [0, 144, 216, 288, 72], [(0, i = 1, 5)], [(c * i, i = 1, 5)] - 3 * c, &
      & [.false., .false., .false., .false.], [.true., .true., .true., .true.])
    call compare("I6", [0, 240, 120, 120, 240, 0], [(0, i = 1, 6)], [(c * i, i = 1, 6)] - 3.5_dp * c, &
      & [.false., .false., .false., .false.], [.false., .false., .false., .false.])
    call compare("V2 90", [0, 0], [45, -45], [0.0_dp, 0.0_dp], [.true., .true., .false., .true.], &
      & [.false., .false., .false., .false.])
    call compare("V8 90", [0, 0, 90, 90, 270, 270, 180, 180], [(45, -45, i = 1, 4)], [(c * i, c * i, i = 1, 4)] - 2.5_dp * c, &
      & [.false., .false., .false., .true.], [.true., .false., .false., .false.])

  contains

    subroutine compare(what, pins, banks, places, forces, couples)
      character(len=*), intent(in) :: what
      integer, intent(in) :: pins(:), banks(:)
      real(dp), intent(in) :: places(:)
      logical, intent(in) :: forces(4), couples(4)
      type(plane_type), allocatable :: planes(:)
      type(gestell_error), allocatable :: failure
      real(dp) :: one(4, 2), all(4, 2)
      integer :: k

      if (allocated(error)) return
      call engine(real(pins, dp), real(banks, dp), places, planes, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call find_orders(planes(1:1), one)
      call find_orders(planes, all)
      do k = 1, 4
        call check_order(what // ", force", all(k, 1), one(1, 1), forces(k) .and. one(k, 1) > 1.0e-12_dp * one(1, 1))
        call check_order(what // ", couple", all(k, 2), c * one(1, 1), couples(k) .and. one(k, 1) > 1.0e-12_dp * one(1, 1))
      end do
    end subroutine compare

    subroutine check_order(what, found, unit, there)
      character(len=*), intent(in) :: what
      real(dp), intent(in) :: found, unit
      logical, intent(in) :: there

      if (there) then
        call check_that(error, found, ">=", 1.0e-6_dp * unit, what)
      else
        call check_that(error, found, "<=", 1.0e-12_dp * unit, what)
      end if
    end subroutine check_order

    !> Amplitudes of orders 1 to 4 of -S'' and of the moments about xi and eta in -H', at unit speed.
    subroutine find_orders(planes, orders)
      type(plane_type), intent(in) :: planes(:)
      real(dp), intent(out) :: orders(4, 2)
      integer, parameter :: n = 64
      type(masses_type) :: masses
      complex(dp) :: spectrum(n, 4)
      real(dp) :: samples(n, 4)
      integer :: k

      call sum_planes(planes, [(2 * pi * (k - 1) / n, k = 1, n)], masses)
      samples(:, :2) = masses%s(:, :2, 2)
      samples(:, 3:) = masses%h(:, :2, 1)
      do k = 1, 4
        spectrum(:, k) = dft(cmplx(samples(:, k), 0, dp)) / n
      end do
      do k = 1, 4
        orders(k, 1) = norm2(abs(spectrum(k + 1, :2)))
        orders(k, 2) = norm2(abs(spectrum(k + 1, 3:)))
      end do
    end subroutine find_orders

  end subroutine test_engines

  !> Largest multipliers and rms of the six coordinates, to the digits of the reference's integration (tolerance 1e-12).
  subroutine test_reference(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure

    call v_twin(740 * rpm, frame, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call compare("V-twin, rest", 0, 0.9433670747951077_dp, [4.38387252492e-05_dp, 1.92707027743e-05_dp, 1.64141545544e-05_dp, &
      & 6.72720456544e-05_dp, 9.90594359569e-05_dp, 0.000191243728223_dp])
    if (allocated(error)) return
    call compare("V-twin, exact", 6, 0.943366628829568_dp, [4.38364941633e-05_dp, 1.92650872662e-05_dp, 1.64130274167e-05_dp, &
      & 6.72619173983e-05_dp, 9.90688415894e-05_dp, 0.000191245595175_dp])
    if (allocated(error)) return
    ! two rotations free and one held, whose moment is at work where theta's directions differ from the axes
    call three_planes(-420 * rpm, 1.0_dp, frame, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    frame%free = [1, 2, 5, 3]
    frame%states = 8
    call compare("two rotations, exact", 8, 0.43483978962971_dp, [8.1164027092351e-03_dp, 1.0048876894687e-03_dp, 0.0_dp, &
      & 1.3260045657603e-03_dp, 0.0_dp, 7.1505766984319e-03_dp])
    if (allocated(error)) return
    ! where equations about rest turn the verdict
    call three_planes(-2235.13_dp * rpm, 0.05_dp, frame, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call compare("three planes, rest", 0, 1.0272182141905737_dp, [0.00275881086091_dp, 0.00145083812632_dp, 0.00157379413429_dp, &
      & 0.0164785110992_dp, 0.0142192601326_dp, 0.0128757181346_dp])
    if (allocated(error)) return
    call compare("three planes, exact", 12, 0.9947397448917186_dp, [0.00274938133257_dp, 0.00147697951399_dp, 0.00168572090764_dp, &
      & 0.0180730637641_dp, 0.0160932421814_dp, 0.0125588383234_dp])

  contains

    subroutine compare(what, steps, rho, rms)
      character(len=*), intent(in) :: what
      integer, intent(in) :: steps
      real(dp), intent(in) :: rho, rms(6)
      type(varied_frame_type), allocatable, target :: varied
      real(dp) :: q(points, 6), found, change
      integer :: k

      call solve(frame, frame%free, q, found, failure)
      do k = 1, steps
        if (allocated(failure)) exit
        varied = varied_frame(frame, series_through(q))
        call solve(varied, frame%free, q, found, failure)
      end do
      call check_success(error, failure)
      call check_that(error, abs(found - rho), "<=", 1.0e-9_dp, what // ": rho_max")
      do k = 1, 6
        change = norm2(q(:, in_frame(k))) / sqrt(real(points, dp)) / max(rms(k), tiny(change)) - merge(1, 0, rms(k) > 0)
        call check_that(error, abs(change), "<=", 1.0e-9_dp, what // ": rms")
      end do
    end subroutine compare

  end subroutine test_reference

  !> The periodic motion at equidistant phases and the maximum of abs(rho).
  subroutine solve(system, free, q, rho, error)
    class(second_order_system), intent(in) :: system
    integer, intent(in) :: free(:)
    real(dp), intent(out) :: q(points, 6), rho
    type(gestell_error), allocatable, intent(out) :: error
    type(floquet_type) :: floquet
    type(periodic_solution_type) :: start
    type(multipliers_type) :: multipliers
    type(accuracy_type) :: accuracy
    real(dp), allocatable :: x(:, :)
    integer :: k

    accuracy%tolerance = 1.0e-11_dp
    rho = 0
    q = 0
    call solve_floquet(system, accuracy, .true., floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
    if (.not. allocated(error)) call solve_periodic(floquet, start, error)
    if (.not. allocated(error)) call follow(system, floquet, start, [(real(k, dp) / points, k = 0, points - 1)], x, error)
    if (allocated(error)) return
    rho = abs(multipliers%rho(1))
    q(:, free) = transpose(x(:size(free), :))
  end subroutine solve

end module test_space
