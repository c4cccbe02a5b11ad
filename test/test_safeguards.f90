!> Errors that the fast paths must not make silently: losing digits by small pivots, losing NaN, mixing up steps.
module test_safeguards
  use checks, only: check_failure, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_floquet_period_period_map, only: end_of_block, period_map
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_methods, only: new_method
  use gestell_floquet_reduction_phasewise, only: inverses
  use gestell_floquet_period_composition, only: multiply_maps
  use gestell_system_mass, only: solve_mass
  use gestell_system_second_order, only: sample_in_units, second_order_system
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan, ieee_positive_inf, ieee_quiet_nan, ieee_value
  use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
  implicit none (type, external)
  private

  public :: collect_safeguards

  !> A matrix whose first pivot is small and whose condition is good.
  real(dp), parameter :: mix(2, 2) = reshape([1.0e-5_dp, 1.0_dp, 1.0_dp, 0.3_dp], [2, 2])

  !> q1'' + 4 q1 = 1, q2'' + 9 q2 = 1, period 1, in units that make the masses of q1 and q2 `masses`. From phase `from` to
  !> phase `to` the two equations are mixed, or the entry `bad` of M is `value`.
  type, extends(second_order_system) :: pair_type
    real(dp) :: masses(2) = 1, from = 2, to = 2, value = 0
    integer :: bad(2) = 0
  contains
    procedure :: matrices
    procedure :: load
  end type pair_type

contains

  subroutine collect_safeguards(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("small pivots trigger row exchanges, which preserve the digits", test_small_pivots), &
      & new_unittest("one step that needs row exchanges leaves the others unchanged", test_one_step), &
      & new_unittest("balanced units yield masses of about one", test_units), &
      & new_unittest("NaN in the mass matrix never yields a finite result", test_no_mass), &
      & new_unittest("products that contain NaN are reported as not computable", test_no_product), &
      & new_unittest("the reach of a motion is correct even if its square overflows", test_small_units), &
      & new_unittest("no block has fewer steps than are computed side by side", test_blocks)]
  end subroutine collect_safeguards

  subroutine matrices(self, t, m, b, c)
    class(pair_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    m = 0
    b = 0
    c = 0
    m(1, 1) = self%masses(1)
    m(2, 2) = self%masses(2)
    c(1, 1) = 4 * self%masses(1)
    c(2, 2) = 9 * self%masses(2)
    if (t < self%from .or. t > self%to) return
    if (self%bad(1) > 0) then
      m(self%bad(1), self%bad(2)) = self%value
    else
      m = matmul(mix, m)
      c = matmul(mix, c)
    end if
  end subroutine matrices

  subroutine load(self, t, h)
    class(pair_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    h = self%masses
    if (t >= self%from .and. t <= self%to .and. self%bad(1) == 0) h = matmul(mix, h)
  end subroutine load

  !> Without exchanges a pivot of 1e-5 costs five digits; in M only the third pivot is below the permitted minimum.
  subroutine test_small_pivots(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: m(lanes, 3, 3), r(lanes, 3, 2), before(lanes, 3, 2), a(lanes, 2, 2), inverted(lanes, 2, 2)
    type(gestell_error), allocatable :: failure
    integer :: k

    m = 0
    do k = 1, 3
      m(:, k, k) = 1
    end do
    m(2, 1:2, 1:2) = mix
    m(7, 3, 3) = 1.0e-9_dp
    call random_number(r)
    before = r
    call solve_mass(m, r)
    do k = 1, lanes
      ! The condition of the exchanged equations is below 10, residuals are a few roundings.
      call check_that(error, maxval(abs(matmul(m(k, :, :), r(k, :, :)) - before(k, :, :))), "<", 1.0e-14_dp, "M X = R")
      if (allocated(error)) return
    end do

    a = m(:, :2, :2)
    call inverses(a, inverted, failure)
    do k = 1, lanes
      call check_that(error, maxval(abs(matmul(a(k, :, :), inverted(k, :, :)) - m(1, :2, :2))), "<", 1.0e-14_dp, "inverse")
      if (allocated(error)) return
    end do
  end subroutine test_small_pivots

  !> Permuting the equations of any one of 8 to 17 steps does not change the maps.
  subroutine test_one_step(error)
    type(error_type), allocatable, intent(out) :: error
    type(pair_type) :: system
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(dp) :: maps(17, 4, 5), one(1, 4, 5), from(17), to(17)
    integer :: steps, k

    call new_method("gauss4", method, failure)
    system%states = 4
    system%period = 1
    from = [(k / 17.0_dp, k = 0, 16)]
    to = [(k / 17.0_dp, k = 1, 17)]
    system%from = 2
    call method%maps(system, from(:1), to(:1), one, failure)
    do steps = 8, 17
      do k = 1, steps
        system%from = from(k)
        system%to = to(k)
        call method%maps(system, from(:steps), to(:steps), maps, failure)
        ! Constant coefficients: all steps are alike but for roundings of their ends.
        call check_that(error, maxval(abs(maps(:steps, :, :) - spread(one(1, :, :), 1, steps))), "<", 1.0e-14_dp, "every step")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_one_step

  subroutine test_units(error)
    type(error_type), allocatable, intent(out) :: error
    type(pair_type) :: system
    real(dp) :: m(1, 2, 2), b(1, 2, 2), c(1, 2, 2), units(2)
    integer :: i, k

    system%states = 4
    system%period = 1
    do k = -60, 60
      system%masses = [3.0_dp, 7.0_dp] * [10.0_dp**k, 10.0_dp**(-k)]
      call sample_in_units(system, [0.5_dp], m, b, c, units)
      do i = 1, 2
        call check_that(error, m(1, i, i), ">=", 0.25_dp, "mass")
        call check_that(error, m(1, i, i), "<", 2.0_dp, "mass")
        call check_that(error, abs(m(1, i, i) / units(i)**2 / system%masses(i) - 1), "<", 1.0e-15_dp, "units")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_units

  !> NaN anywhere in M must not come out as a finite number, neither from M^-1 R nor from a period's map.
  subroutine test_no_mass(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(3) = [character(len=9) :: "gauss8", "magnus6", "explicit8"]
    real(dp) :: m(lanes, 3, 3), r(lanes, 3, 1), phi(4, 4)
    type(pair_type) :: system
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    logical :: traps(size(ieee_usual))
    integer :: i, j, k

    call ieee_get_halting_mode(ieee_usual, traps)
    call ieee_set_halting_mode(ieee_usual, .false.)
    do j = 1, 3
      do i = 1, 3
        m = 0
        do k = 1, 3
          m(:, k, k) = 1
        end do
        m(4, i, j) = ieee_value(1.0_dp, ieee_quiet_nan)
        r = 1
        call solve_mass(m, r)
        if (.not. allocated(error)) call check(error, any(ieee_is_nan(r(4, :, :))), more="M^-1 R")
        if (.not. allocated(error)) call check_that(error, [abs(r([1, 2, 3, 5, 6, 7, 8], :, :) - 1)], "<=", 0.0_dp, "other lanes")
      end do
    end do
    system%states = 4
    system%period = 1
    system%from = 0.3_dp
    system%to = 0.31_dp
    system%value = ieee_value(1.0_dp, ieee_quiet_nan)
    do k = 1, size(names)
      do i = 1, 2
        do j = 1, 2
          system%bad = [i, j]
          call new_method(trim(names(k)), method, failure)
          call period_map(system, method, mesh(system, 400), [1.0_dp, 1.0_dp, 1.0_dp, 1.0_dp], phi, failure)
          call check_failure(error, failure, what=names(k))
          deallocate(method)
        end do
      end do
    end do
    call ieee_set_flag(ieee_usual, .false.)
    call ieee_set_halting_mode(ieee_usual, traps)
  end subroutine test_no_mass

  !> By segments and one by one, in any entry of any map.
  subroutine test_no_product(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: counts(2) = [10, 40]
    real(dp) :: a(40, 2, 2), phi(2, 2), values(2)
    logical :: fits, traps(size(ieee_usual))
    integer :: c, i, k, v

    call ieee_get_halting_mode(ieee_usual, traps)
    call ieee_set_halting_mode(ieee_usual, .false.)
    values = [ieee_value(1.0_dp, ieee_quiet_nan), ieee_value(1.0_dp, ieee_positive_inf)]
    do c = 1, 2
      do k = 1, counts(c)
        do i = 1, 2
          do v = 1, 2
            a = 0
            a(:, 1, 1) = 1
            a(:, 2, 2) = 1
            a(k, i, 1) = values(v)
            phi = a(merge(1, 2, k > 1), :, :)
            call multiply_maps(counts(c), a, [1.0_dp, 1.0_dp], phi, fits)
            if (.not. allocated(error)) call check(error, .not. fits, more="overflow must be reported")
          end do
        end do
      end do
    end do
    call ieee_set_flag(ieee_usual, .false.)
    call ieee_set_halting_mode(ieee_usual, traps)
  end subroutine test_no_product

  !> The reach of a constant motion, by segments and one by one, where its square in these units is out of range.
  subroutine test_small_units(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: sizes(2) = [1.0e149_dp, 1.0_dp], scales(2) = [1.0e-10_dp, 1.0_dp]
    real(dp) :: maps(40, 1, 2), phi(1, 1), xp(1), reach
    logical :: fits, traps(size(ieee_usual))
    integer :: i, steps

    call ieee_get_halting_mode(ieee_usual, traps)
    call ieee_set_halting_mode(ieee_usual, .false.)
    maps(:, :, 1) = 1
    do i = 1, size(sizes)
      do steps = 10, 40, 30
        maps(:, 1, 2) = 0
        maps(1, 1, 2) = sizes(i)
        phi = 1
        xp = 0
        reach = 0
        call multiply_maps(steps, maps, scales(i:i), phi, fits, xp, reach)
        if (.not. allocated(error)) call check(error, fits .and. ieee_is_finite(reach), more="finite")
        if (.not. allocated(error)) call check_that(error, abs(reach * (scales(i) / sizes(i)) - 1), "<", 1.0e-14_dp, "reach")
      end do
    end do
    call ieee_set_flag(ieee_usual, .false.)
    call ieee_set_halting_mode(ieee_usual, traps)
  end subroutine test_small_units

  !> Blocks follow each other to the last step. Each has at least as many steps as are computed side by side, unless it is the
  !> only one.
  subroutine test_blocks(error)
    type(error_type), allocatable, intent(out) :: error
    integer :: steps, first, last

    do steps = 1, 200
      last = 0
      do while (last < steps)
        first = last + 1
        last = end_of_block(first, steps)
        call check_that(error, last, ">=", first, "last step")
        call check_that(error, last, "<=", steps, "last step")
        call check_that(error, last - first, "<", 32, "steps")
        call check_that(error, last - first + 1, ">=", min(lanes, steps), "short")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_blocks

end module test_safeguards
