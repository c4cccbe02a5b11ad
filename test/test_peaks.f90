!> The peak displacements that a sweep reports.
module test_peaks
  use checks, only: check_success, check_that
  use families, only: machine_family
  use gestell_base_error, only: gestell_error => error_type
  use gestell_math_series_fourier, only: find_candidates, largest_value
  use gestell_base_kinds, only: dp, pi
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type, grid_type, new_grid
  use gestell_study_point, only: peak_limit, solve_point, sweep_options
  use gestell_study_tile_results, only: psi_peak, rho_error, rho_max, sweep_columns, tile_results_type, xi_peak
  use slow_tests, only: new_slow
  use sweeps, only: new_family, solve_grid
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  implicit none (type, external)
  private

  public :: collect_peaks

contains

  subroutine collect_peaks(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the interpolated maximum is never below densely sampled values", test_between), &
      & new_unittest("among nearly equal samples few intervals are searched", test_nearly_equal_samples), &
      & new_slow("swept peaks of the paper's machine agree with single solutions", test_machine), &
      & new_slow("swept peaks near a resonance are correct", test_resonance), &
      & new_slow("swept peaks of a light frame are accurate to twelve digits", test_twelve_digits), &
      & new_unittest("multipliers that are small beside the vibration remain accurate", test_small)]
  end subroutine collect_peaks

  !> The maximum of a trigonometric polynomial from as few samples as determine it, against the maximum of very many samples.
  subroutine test_between(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: orders = 7, samples = 16, many = 100000
    real(dp) :: a(0:orders, 2), sparse(samples), dense, f
    integer :: i, k

    do k = 1, 20
      a = reshape([(sin(3.1_dp * i * k + k), i = 1, 2 * (orders + 1))], shape(a))
      ! The amplitudes fall like those of a motion that is sampled densely enough.
      a = a / spread([(2.0_dp**i, i = 0, orders)], 2, 2)
      sparse = [(polynomial(a, 2 * pi * (i - 1) / samples), i = 1, samples)]
      dense = 0
      do i = 1, many
        f = polynomial(a, 2 * pi * i / many)
        dense = max(dense, abs(f))
      end do
      ! Half the spacing of the dense samples squared, times f'' / 2 < 7^2 |f|, and roundings.
      call check(error, largest_value(sparse), dense, thr=1.0e-7_dp * dense)
      if (allocated(error)) return
      call check_that(error, largest_value(sparse), ">=", dense * (1 - 1.0e-13_dp), "at least the maximum of dense samples")
      if (allocated(error)) return
    end do
  end subroutine test_between

  !> A constant with rounding errors, like the force of a rotor: a third of the samples lie above their neighbours, and only the
  !> curve between them shows which is next to the maximum. Compared with samples of the curve at a 32nd of the spacing, summed
  !> term by term.
  subroutine test_nearly_equal_samples(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: samples = 1024, orders = samples / 2 - 1, many = 32 * samples
    !> A place searched costs at least four sums over the orders, samples at a part of the spacing about 32 times as much.
    integer, parameter :: most_places = 128
    real(dp), parameter :: rounding = 1.0e-12_dp
    real(dp) :: a(0:orders, 2), f(samples), dense, spacing, loss
    real(dp), allocatable :: c(:), fine(:), places(:)
    integer :: i, k

    a(0, :) = [1.0_dp, 0.0_dp]
    ! Pseudo-random by a multiplication modulo a prime (Lehmer).
    k = 1
    do i = 1, orders
      k = mod(16807 * k, 65537)
      a(i, 1) = rounding * (k / 32768.5_dp - 1)
      k = mod(16807 * k, 65537)
      a(i, 2) = rounding * (k / 32768.5_dp - 1)
    end do
    allocate(c(0:many - 1), fine(0:many - 1))
    c(:) = [(cos(2 * pi * i / many), i = 0, many - 1)]
    fine(:) = a(0, 1)
    do i = 0, many - 1
      do k = 1, orders
        fine(i) = fine(i) + a(k, 1) * c(modulo(k * i, many)) + a(k, 2) * c(modulo(k * i - many / 4, many))
      end do
    end do
    f = fine(::many / samples)
    dense = maxval(abs(fine))
    loss = (2 * pi / samples)**2 / 8 * sum([(real(i, dp)**2 * norm2(a(i, :)), i = 1, orders)])
    call find_candidates(f, a(0, 1), a(1:, 1), a(1:, 2), loss, places, spacing)
    call check_that(error, real(size(places), dp), "<=", real(most_places, dp), "searched places")
    ! Beside a top samples at a 32nd of the spacing miss (pi / 64)^2 / 2 of the ripple at the most; sums round at 1e-15.
    call check_that(error, abs(largest_value(f) - dense), "<=", 1.3e-3_dp * (dense - 1) + 1.0e-14_dp, "maximum between samples")
  end subroutine test_nearly_equal_samples

  pure real(dp) function polynomial(a, theta)
    real(dp), intent(in) :: a(0:, :), theta
    integer :: k

    polynomial = sum([(a(k, 1) * cos(k * theta) + a(k, 2) * sin(k * theta), k = 0, ubound(a, 1))])
  end function polynomial

  !> The paper's machine over speed and damping, all columns.
  subroutine test_machine(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(machine_family) :: family
    type(grid_type) :: grid
    real(dp), allocatable :: values(:, :, :)
    type(tile_results_type) :: last

    call new_family(family, error)
    if (allocated(error)) return
    call new_grid(grid, [axis_type(400.0_dp, 450.0_dp, 100), axis_type(0.9_dp, 1.1_dp, 100)], failure)
    call solve_grid(family, grid, sweep_options(), values, error, last)
    if (allocated(error)) return
    call check_that(error, last%checks, ">", 0, "the expansion was not used")
    if (allocated(error)) return
    call compare_peaks(family, grid, sweep_options(), values, error)
  end subroutine test_machine

  !> Close to and on a resonance, where E - Phi is nearly singular: without dampers at 5 times the crank's speed. Points near it
  !> are solved one by one; the reported peaks are right.
  subroutine test_resonance(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(machine_family) :: family
    type(grid_type) :: grid
    real(dp), allocatable :: values(:, :, :)

    call new_family(family, error)
    if (allocated(error)) return
    family%frame%damping = 1.0e-6_dp * family%frame%damping
    call new_grid(grid, [axis_type(238.0_dp, 248.0_dp, 40), axis_type(0.99_dp, 1.01_dp, 40)], failure)
    call solve_grid(family, grid, sweep_options(engine="expansion"), values, error)
    if (allocated(error)) return
    call compare_peaks(family, grid, sweep_options(), values, error)
    if (allocated(error)) return
    call check_that(error, maxval(values(xi_peak, :, :)), ">", 100 * minval(values(xi_peak, :, :)), &
      & "the range contains a resonance")
  end subroutine test_resonance

  !> Harmonics that are weak at the cell's corners are amplified in between: with twelve digits requested all of them matter.
  subroutine test_twelve_digits(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: family
    type(grid_type) :: grid
    type(sweep_options) :: options
    real(dp), allocatable :: values(:, :, :)
    real(dp) :: own(sweep_columns)
    type(gestell_error), allocatable :: failure
    integer :: i

    call new_family(family, error)
    if (allocated(error)) return
    family%frame%mass = 1.8_dp
    family%frame%inertia = 0.03_dp
    options%accuracy%tolerance = 1.0e-12_dp
    options%engine = "expansion"
    call new_grid(grid, [axis_type(100.0_dp, 900.0_dp, 100)], failure)
    call solve_grid(family, grid, options, values, error)
    if (allocated(error)) return
    do i = 1, size(values, 3), 3
      call solve_point(family, grid%parameters(i, 1), options, own, failure)
      ! For each peak separately, much less than what is promised for the largest.
      call check_that(error, abs(values(xi_peak:psi_peak, 1, i) / own(xi_peak:psi_peak) - 1), "<=", 0.05_dp * peak_limit(options), &
        & "a peak is wrong")
      if (allocated(error)) return
    end do
  end subroutine test_twelve_digits

  !> Damped so that Phi(T) is small compared with the motion that is expanded together with it: its multipliers are as accurate
  !> as without the motion.
  subroutine test_small(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: family
    type(grid_type) :: grid
    type(sweep_options) :: options
    real(dp), allocatable :: values(:, :, :)
    real(dp) :: own(sweep_columns)
    type(gestell_error), allocatable :: failure
    integer :: i

    call new_family(family, error)
    if (allocated(error)) return
    family%frame%damping = 5000 * family%frame%damping
    options%accuracy%tolerance = 1.0e-6_dp
    options%engine = "expansion"
    call new_grid(grid, [axis_type(200.0_dp, 400.0_dp, 100)], failure)
    call solve_grid(family, grid, options, values, error)
    if (allocated(error)) return
    do i = 1, size(values, 3), 3
      call solve_point(family, grid%parameters(i, 1), options, own, failure)
      ! Phi(T) to 1e-6 of its size, and less than ten times that where multipliers of one size are not normal.
      call check(error, values(rho_max, 1, i), own(rho_max), rel=.true., thr=1.0e-5_dp)
      if (allocated(error)) return
      ! Gershgorin's discs are 6 |E| at least, and norms vary within a cell.
      call check_that(error, values(rho_error, 1, i), "<", 1.0e-3_dp, "the bound is not too wide")
      if (allocated(error)) return
    end do
  end subroutine test_small

  !> Compares every seventh point with a single solution: peaks to the promised limit, in the units of the states.
  subroutine compare_peaks(family, grid, options, values, error)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(sweep_options), intent(in) :: options
    real(dp), intent(in) :: values(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    real(dp) :: own(sweep_columns)
    integer :: i, j

    do i = 1, size(values, 3), 7
      do j = 1 + mod(i, 7), size(values, 2), 7
        call solve_point(family, grid%parameters(i, j), options, own, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call check(error, all(ieee_is_nan(own(xi_peak:psi_peak)) .eqv. ieee_is_nan(values(xi_peak:psi_peak, j, i))), &
          & "a resonance is missed")
        if (allocated(error)) return
        ! eta, psi, xi of this machine are of one size in balanced units.
        if (.not. ieee_is_nan(own(xi_peak))) call check_that(error, abs(values(xi_peak:psi_peak, j, i) - own(xi_peak:psi_peak)), &
          & "<=", 2 * peak_limit(options) * maxval(own(xi_peak:psi_peak)), "a peak is wrong")
        if (allocated(error)) return
      end do
    end do
  end subroutine compare_peaks

end module test_peaks
