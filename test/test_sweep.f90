!> Sweeps: grids, Chebyshev series, tiles by expansions against closed forms and single solutions.
module test_sweep
  use checks, only: check_failure, check_success, check_that
  use families, only: largest_of_oscillator, machine_family, oscillator_family
  use gestell_math_series_chebyshev, only: chebyshev_coefficients, chebyshev_points, chebyshev_values
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: impossible => impossible_number, stable => stable_number, undecided => undecided_number, &
    & unstable => unstable_number
  use gestell_study_grid, only: axis_type, grid_type, new_axis, new_grid, tile_type
  use gestell_study_point, only: solve_point, sweep_options
  use gestell_study_tile_results, only: log_rho_max, rho_error, rho_max, sweep_columns, tile_results_type, verdict
  use gestell_task_sweep, only: solve_tile
  use gestell_task_sweep_expansion_variable, only: inverse, itself, logarithm, variable_type
  use slow_tests, only: new_slow
  use sweeps, only: new_family, ordered, solve_grid
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  implicit none (type, external)
  private

  public :: collect_sweep

contains

  subroutine collect_sweep(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("Chebyshev series have the known coefficients and values", test_chebyshev), &
      & new_unittest("interpolation variables map the range onto -1 to 1", test_variables), &
      & new_unittest("axes yield the requested values and refuse invalid ranges", test_axes), &
      & new_unittest("tiles cover every grid point exactly once", test_tiles), &
      & new_unittest("swept oscillators agree with the closed form within their bounds", test_oscillators), &
      & new_unittest("sweeps over one axis or a single line agree with the full grid", test_lines), &
      & new_unittest("jumps and missing systems do not spoil the neighbouring points", test_jump_and_hole), &
      & new_slow("a sweep of the paper's machine agrees with single solutions", test_machine), &
      & new_unittest("a single requested column has the same values as among all", test_columns), &
      & new_unittest("planning is cheap where expansions cannot pay", test_plan)]
  end subroutine collect_sweep

  !> exp has the coefficients I_0(1) and 2 I_k(1), modified Bessel functions (Abramowitz and Stegun, table 9.8 and 9.9);
  !> T_k(cos t) = cos k t.
  subroutine test_chebyshev(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 20
    real(dp) :: x(n), c(n), at(3), t(3, 5)

    x = chebyshev_points(n)
    c = matmul(chebyshev_coefficients(n), exp(x))
    ! Roundings of twenty products of the size of exp.
    call check_that(error, maxval(abs(c(:3) - [1.2660658777520084_dp, 1.1303182079849700_dp, 0.2714953395340766_dp])), "<", &
      & 5.0e-15_dp, "coefficients of exp")
    if (allocated(error)) return
    at = [-0.3_dp, 0.0_dp, 0.9_dp]
    t = chebyshev_values(at, 5)
    ! Roundings of the recurrence.
    call check_that(error, maxval(abs(t(:, 5) - cos(4 * acos(at)))), "<", 1.0e-14_dp, "T_4")
    call check_that(error, maxval(abs(matmul(chebyshev_values(at, n), c) - exp(at))), "<", 1.0e-14_dp, "values of exp")
    ! To the last digit.
    call check_that(error, abs([x(1) - 1, x(n) + 1, x(:10) + x(20:11:-1)]), "<=", 0.0_dp, "points")
    ! The nearly linear order of cosines keeps its digits for many points too.
    call check_that(error, maxval(abs(matmul(chebyshev_coefficients(257), cos(255 * acos(chebyshev_points(257)))) &
      & - [spread(0.0_dp, 1, 255), 1.0_dp, 0.0_dp])), "<", 1.0e-12_dp, "257 coefficients")
  end subroutine test_chebyshev

  subroutine test_variables(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: kinds(3) = [itself, inverse, logarithm]
    ! The middle in the variable.
    real(dp), parameter :: middles(3) = [5.0_dp, 3.2_dp, 4.0_dp]
    type(variable_type) :: variable
    real(dp) :: p
    integer :: k

    do k = 1, 3
      variable = variable_type(2.0_dp, 8.0_dp, kinds(k))
      call check_that(error, variable%is_applicable(), "==", .true., "suits")
      call check_that(error, abs(variable%x_of(2.0_dp) + 1), "<", 1.0e-15_dp, "x of the first")
      call check_that(error, abs(variable%x_of(8.0_dp) - 1), "<", 1.0e-15_dp, "x of the last")
      if (allocated(error)) return
      call check(error, variable%parameter_of(0.0_dp), middles(k), thr=1.0e-14_dp)
      if (allocated(error)) return
      variable = variable_type(-2.0_dp, -8.0_dp, kinds(k))
      p = variable%parameter_of(0.3_dp)
      call check(error, variable%x_of(p), 0.3_dp, thr=1.0e-14_dp)
      if (allocated(error)) return
      variable = variable_type(-1.0_dp, 1.0_dp, kinds(k))
      call check_that(error, variable%is_applicable(), "==", kinds(k) == itself, "suits")
      if (allocated(error)) return
    end do
  end subroutine test_variables

  subroutine test_axes(error)
    type(error_type), allocatable, intent(out) :: error
    type(axis_type) :: axis
    type(gestell_error), allocatable :: failure

    call new_axis(axis, 0.1_dp, 0.7_dp, 7, .false., failure)
    call check_success(error, failure)
    call check_that(error, axis%value(1), "==", 0.1_dp, "first value")
    call check_that(error, axis%value(7), "==", 0.7_dp, "last value")
    call check_that(error, abs(axis%value(4) - 0.4_dp), "<", 1.0e-15_dp, "value in the middle")
    if (allocated(error)) return
    call new_axis(axis, -1.0_dp, -1000.0_dp, 4, .true., failure)
    call check_success(error, failure)
    call check_that(error, abs(axis%value(3) + 100), "<", 1.0e-12_dp, "third value")
    if (allocated(error)) return
    call new_axis(axis, 1.0_dp, 1.0_dp, 1, .true., failure)
    call check_success(error, failure)
    call check_that(error, axis%value(1), "==", 1.0_dp, "only value")
    if (allocated(error)) return
    call new_axis(axis, 1.0_dp, 1.0_dp, 2, .false., failure)
    call check_failure(error, failure, what="an empty range")
    call new_axis(axis, 1.0_dp, 2.0_dp, 0, .false., failure)
    call check_failure(error, failure, what="no value")
    if (allocated(error)) return
    call new_axis(axis, 1.0_dp, 2.0_dp, 1, .false., failure)
    call check_failure(error, failure, what="one value that should be two")
    if (allocated(error)) return
    call new_axis(axis, -1.0_dp, 2.0_dp, 5, .true., failure)
    call check_failure(error, failure, what="a logarithmic range through zero")
  end subroutine test_axes

  !> To the last digit.
  pure logical function same(a, b)
    real(dp), intent(in) :: a, b

    same = .not. abs(a - b) > 0
  end function same

  subroutine test_tiles(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    integer, parameter :: counts(2, 7) = reshape([1, 1, 1, 300, 300, 1, 7, 9, 501, 40, 2001, 33, 17, 16], [2, 7])
    type(grid_type) :: grid
    type(tile_type) :: tile
    integer, allocatable :: covered(:, :)
    integer :: k, i

    do k = 1, size(counts, 2)
      call new_grid(grid, [(axis_type(0.0_dp, merge(1.0_dp, 0.0_dp, counts(i, k) > 1), counts(i, k)), i = 1, 2)], failure)
      grid%one_by_one = modulo(k, 2) == 0
      allocate(covered(counts(1, k), counts(2, k)), source=0)
      do i = 1, grid%tiles()
        tile = grid%tile(i)
        associate (here => covered(tile%first(1):tile%last(1), tile%first(2):tile%last(2)))
          here = here + 1
          call check_that(error, size(here), ">", 0, "points of a tile")
          call check_that(error, shape(here), "<=", merge(250, 500, grid%one_by_one), "shape of a tile")
          call check_that(error, tile%number, "==", i, "number of a tile")
        end associate
        if (allocated(error)) return
      end do
      call check_that(error, [covered], "==", 1, "times covered")
      call check_that(error, int(grid%points()), "==", product(counts(:, k)), "points")
      if (allocated(error)) return
      deallocate(covered)
    end do
    ! Several tiles for several threads, except where large ones save solutions.
    call new_grid(grid, [axis_type(0.0_dp, 1.0_dp, 999), axis_type(0.0_dp, 1.0_dp, 25)], failure)
    call check_that(error, grid%tiles(), "==", 16, "tiles of a small grid")
    if (allocated(error)) return
    call new_grid(grid, [axis_type(0.0_dp, 1.0_dp, 2000), axis_type(0.0_dp, 1.0_dp, 7)], failure)
    call check_that(error, grid%tiles(), "==", 4, "tiles of a narrow grid")
    if (allocated(error)) return
    call new_grid(grid, [axis_type(0.0_dp, 1.0_dp, 1000), axis_type(0.0_dp, 1.0_dp, 1000)], failure)
    call check_that(error, grid%tiles(), "==", 4, "tiles of a large grid")
    if (allocated(error)) return
    grid%one_by_one = .true.
    call check_that(error, grid%tiles(), "==", 16, "tiles of a large grid, point by point")
    if (allocated(error)) return
    do k = 1000, 4000, 1000
      call new_grid(grid, [axis_type(0.0_dp, 1.0_dp, k)], failure)
      call check_that(error, grid%tiles(), "==", 4, "tiles of a line")
      if (allocated(error)) return
    end do
    call new_grid(grid, [axis_type(0.0_dp, 1.0_dp, 2000000)], failure)
    k = 0
    do i = 1, grid%tiles()
      tile = grid%tile(i)
      k = k + tile%last(1) - tile%first(1) + 1
    end do
    call check(error, k, 2000000)
  end subroutine test_tiles

  !> Oscillators with d from 0.02 to 2 and a from 0.3 to 30: complex pairs, and two real multipliers where a < d^2 / 4,
  !> which meet on the curve a = d^2 / 4. Every bound holds, every verdict is right; away from the curve the numbers are
  !> as exact as the tolerance promises.
  subroutine test_oscillators(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(oscillator_family) :: family
    type(grid_type) :: grid
    real(dp), allocatable :: values(:, :, :)
    type(tile_results_type) :: last
    real(dp) :: p(2), right, deviation
    integer :: i, j

    call new_grid(grid, [axis_type(0.02_dp, 2.0_dp, 70), axis_type(0.3_dp, 30.0_dp, 90, .true.)], failure)
    call solve_grid(family, grid, ordered("expansion"), values, error, last)
    if (allocated(error)) return
    do i = 1, 70
      do j = 1, 90
        p = grid%parameters(i, j)
        right = largest_of_oscillator(p(1), p(2))
        deviation = abs(values(rho_max, j, i) - right) / right
        call check_that(error, deviation, "<=", values(rho_error, j, i), "an error exceeds its bound")
        if (allocated(error)) return
        call check(error, nint(values(verdict, j, i)), stable)
        if (allocated(error)) return
        call check(error, values(log_rho_max, j, i), log(right), thr=2 * values(rho_error, j, i))
        if (allocated(error)) return
        ! Phi is accurate to 1e-9 of its norm, which is up to e^pi times its largest multiplier.
        if (abs(p(2) - p(1)**2 / 4) > 0.1_dp) call check_that(error, deviation, "<", 2.0e-7_dp, "not as exact as promised")
        if (allocated(error)) return
      end do
    end do
    call check_that(error, last%checks, ">", 0, "the expansion was not used")
    call check_that(error, last%deviation, "<", 1.0e-9_dp, "the expansion was not used")
  end subroutine test_oscillators

  subroutine test_lines(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    character(len=9), parameter :: engines(3) = [character(len=9) :: "auto", "expansion", "direct"]
    type(oscillator_family) :: family
    type(grid_type) :: grid
    real(dp), allocatable :: values(:, :, :)
    integer :: k, j

    do k = 1, 3
      call new_grid(grid, [axis_type(1.0_dp, 9.0_dp, 500)], failure)
      call solve_grid(family, grid, ordered(engines(k)), values, error)
      if (allocated(error)) return
      ! The damping, 0.1, is the same for all.
      call check_that(error, maxval(abs(values(rho_max, 1, :) - exp(-0.05_dp * pi))), "<", 1.0e-9_dp, "row of one damping")
      if (allocated(error)) return
      call new_grid(grid, [axis_type(0.5_dp, 0.5_dp, 1), axis_type(1.0_dp, 9.0_dp, 30)], failure)
      call solve_grid(family, grid, ordered(engines(k)), values, error)
      if (allocated(error)) return
      call check_that(error, maxval(abs(values(rho_max, :, 1) - exp(-0.25_dp * pi))), "<", 1.0e-9_dp, &
        & "column of the highest damping")
      if (allocated(error)) return
      call new_grid(grid, [axis_type(0.2_dp, 0.5_dp, 30), axis_type(4.0_dp, 4.0_dp, 1)], failure)
      call solve_grid(family, grid, ordered(engines(k)), values, error)
      if (allocated(error)) return
      call check_that(error, maxval(abs(values(rho_max, 1, :) - [(exp(-pi / 2 * grid%axes(1)%value(j)), j = 1, 30)])), "<", &
        & 1.0e-9_dp, "row over damping")
      if (allocated(error)) return
      call new_grid(grid, [axis_type(0.2_dp, 0.2_dp, 1), axis_type(4.0_dp, 4.0_dp, 1)], failure)
      call solve_grid(family, grid, ordered(engines(k)), values, error)
      if (allocated(error)) return
      call check_that(error, size(values), "==", 4, "values")
      call check_that(error, abs(values(rho_max, 1, 1) - exp(-pi * 0.1_dp)), "<", 1.0e-9_dp, "largest multiplier")
      if (allocated(error)) return
    end do
  end subroutine test_lines

  !> Where Phi jumps and where there is no system, cells are split until the expansions hold; the other points remain correct.
  subroutine test_jump_and_hole(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    character(len=9), parameter :: engines(2) = [character(len=9) :: "auto", "expansion"]
    type(oscillator_family) :: family
    type(grid_type) :: grid
    real(dp), allocatable :: values(:, :, :)
    real(dp) :: p(2), right
    integer :: i, j, k

    family = oscillator_family(jump=4.0_dp, hole=[6.0_dp, 6.5_dp])
    call new_grid(grid, [axis_type(0.1_dp, 0.4_dp, 60), axis_type(1.0_dp, 9.0_dp, 120)], failure)
    do k = 1, 2
      call solve_grid(family, grid, ordered(engines(k)), values, error)
      if (allocated(error)) return
      do i = 1, 60
        do j = 1, 120
          p = grid%parameters(i, j)
          if (p(2) > family%hole(1) .and. p(2) < family%hole(2)) then
            call check_that(error, nint(values(verdict, j, i)), "==", impossible, "verdict in the hole")
            call check_that(error, ieee_is_nan(values(rho_max, j, i)), "==", .true., "no number in the hole")
          else
            right = largest_of_oscillator(p(1) + merge(1.0_dp, 0.0_dp, p(2) >= family%jump), p(2))
            call check_that(error, abs(values(rho_max, j, i) - right), "<", 1.0e-8_dp, "largest multiplier")
            call check_that(error, nint(values(verdict, j, i)), "==", stable, "verdict")
          end if
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_jump_and_hole

  !> The paper's machine without dampers, over speed and stiffness, where some points are unstable: every tenth point is
  !> compared with a single solution.
  subroutine test_machine(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: family
    type(gestell_error), allocatable :: failure
    type(grid_type) :: grid
    type(sweep_options) :: options
    real(dp), allocatable :: values(:, :, :)
    real(dp) :: own(sweep_columns)
    integer :: i, j

    call new_family(family, error)
    if (allocated(error)) return
    call new_grid(grid, [axis_type(300.0_dp, 500.0_dp, 84), axis_type(0.25_dp, 0.5_dp, 84)], failure)
    options = ordered("expansion")
    call solve_grid(family, grid, options, values, error)
    if (allocated(error)) return
    do i = 1, 84, 3
      do j = 1 + mod(i, 10), 84, 10
        call solve_point(family, grid%parameters(i, j), options, own, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call check_that(error, abs(values(rho_max, j, i) - own(rho_max)), "<=", values(rho_error, j, i) * values(rho_max, j, i) &
          & + own(rho_error) * own(rho_max), "beyond both bounds")
        call check_that(error, abs(values(rho_max, j, i) - own(rho_max)), "<", 1.0e-8_dp, "largest multiplier")
        if (allocated(error)) return
        if (nint(values(verdict, j, i)) /= undecided .and. nint(own(verdict)) /= undecided) then
          call check_that(error, nint(values(verdict, j, i)), "==", nint(own(verdict)), "verdict")
        end if
        if (allocated(error)) return
      end do
    end do
    ! Phi is accurate to 1e-9 of its norm in balanced units; discs enlarge that by 6 times the condition. Other units: 1e-6.
    call check_that(error, maxval(values(rho_error, :, :)), "<", 2.0e-7_dp, "the bounds are wide: are units balanced?")
    call check_that(error, count(nint(values(verdict, :, :)) == undecided), "<", 84, "undecided is rare")
    call check_that(error, pack(nint(values(verdict, :, :)), nint(values(verdict, :, :)) /= undecided), "==", &
      & pack(merge(unstable, stable, values(rho_max, :, :) > 1), nint(values(verdict, :, :)) /= undecided), "verdicts")
  end subroutine test_machine

  !> A column requested alone has the same values and does not compute the others.
  subroutine test_columns(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(oscillator_family) :: family
    type(sweep_options) :: options
    type(grid_type) :: grid
    real(dp), allocatable :: all(:, :, :), one(:, :, :)

    call new_grid(grid, [axis_type(0.1_dp, 0.4_dp, 40), axis_type(1.0_dp, 9.0_dp, 40)], failure)
    options = ordered("expansion")
    call solve_grid(family, grid, options, all, error)
    if (allocated(error)) return
    options%columns = .false.
    options%columns(rho_max) = .true.
    call solve_grid(family, grid, options, one, error)
    if (allocated(error)) return
    call check_that(error, size(one, 1), "==", 1, "columns")
    call check_that(error, maxval(abs(one(1, :, :) - all(rho_max, :, :))), "<", 1.0e-14_dp, "largest multiplier")
  end subroutine test_columns

  !> A tile of 625 of the paper's machines, too rough for an expansion to pay: planning costs at most a tenth of their
  !> solutions. (Five are at its corners, 17 along each axis.)
  subroutine test_plan(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(machine_family) :: family
    type(grid_type) :: grid
    type(tile_results_type) :: results
    character(len=60) :: found

    call new_family(family, error)
    if (allocated(error)) return
    call new_grid(grid, [axis_type(100.0_dp, 500.0_dp, 100), axis_type(0.25_dp, 2.0_dp, 100)], failure)
    call solve_tile(family, grid, grid%tile(grid%tiles()), ordered("auto"), results, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    write (found, "(2(i0, a))") size(results%values, 2) * size(results%values, 3), " points by ", results%solutions, " solutions"
    associate (points => size(results%values(1, :, :)))
      call check_that(error, points, ">=", 600, found)
      call check_that(error, real(results%solutions, dp), "<=", 1.1_dp * points, found)
    end associate
  end subroutine test_plan

end module test_sweep
