!> Critical values of one parameter and the nearest stable system, against known stability borders.
module test_boundary
  use boundary_families, only: flutter_family, height_family, mathieu_family
  use boundary_oracles, only: characteristic_values, mathieu_trace
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_task_boundary_line_borders, only: border_accuracy, border_rest_type, border_type, find_borders, nearest_stable, &
    & nearest_type
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_boundary

contains

  subroutine collect_boundary(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("stability borders of Mathieu's equation agree with Abramowitz and Stegun's table", test_published), &
      & new_unittest("borders of Mathieu's equation at q = 5, 10, 25 are accurate to 1e-10", test_characteristic), &
      & new_unittest("one search separates the neighbouring borders a0 and b1 at q = 25", test_close_pair), &
      & new_unittest("instability tongues of Mathieu's equation between two search points are found", test_narrow), &
      & new_slow("a coarse tolerance misses no border of Mathieu's equation", test_coarse), &
      & new_unittest("borders of Mathieu's equation over q are characteristic values", test_over_q), &
      & new_unittest("on borders of damped Mathieu's equation the trace is 2 cosh(c pi)", test_damped), &
      & new_unittest("the flutter border of a damped system agrees with its closed form", test_flutter), &
      & new_unittest("the flutter border of an undamped system agrees with its closed form", test_krein), &
      & new_unittest("borders on both sides of a range without systems are found", test_gap), &
      & new_unittest("a range of systems that cannot be solved is reported as open", test_unsolvable_range), &
      & new_unittest("a border on a logarithmic axis is found with a relative tolerance", test_logarithmic), &
      & new_unittest("borders over a descending range are listed in that direction", test_descending), &
      & new_unittest("the nearest stable system lies on the border, within its error", test_nearest)]
  end subroutine collect_boundary

  subroutine borders_of(family, axis, tolerance, borders, error)
    class(family_type), intent(in) :: family
    type(axis_type), intent(in) :: axis
    real(dp), intent(in) :: tolerance
    type(border_type), allocatable, intent(out) :: borders(:)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call find_borders(family, axis, accuracy_type(tolerance=border_accuracy), tolerance, borders, failure)
    call check_success(error, failure)
  end subroutine borders_of

  !> Abramowitz and Stegun, table 20.1: eight decimals.
  subroutine test_published(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_type), allocatable :: borders(:)

    call borders_of(mathieu_family(q=5), axis_type(-7.0_dp, 2.0_dp, 10), 1.0e-11_dp, borders, error)
    if (allocated(error)) return
    call check(error, size(borders), 3)
    if (allocated(error)) return
    ! Half of the last decimal.
    call check(error, borders(1)%value, -5.80004602_dp, thr=0.5e-8_dp)
    if (allocated(error)) return
    call check(error, borders(2)%value, -5.79008060_dp, thr=0.5e-8_dp)
    if (allocated(error)) return
    call check(error, borders(3)%value, 1.85818754_dp, thr=0.5e-8_dp)
    if (allocated(error)) return
    call check(error, borders(1)%kind // borders(2)%kind, "divergence     period_doubling")
    if (allocated(error)) return
    call check(error, borders(1)%below // borders(1)%above // borders(2)%above, "unstable  undecided unstable")
  end subroutine test_published

  subroutine test_characteristic(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: q(3) = [5.0_dp, 10.0_dp, 25.0_dp]
    integer :: i

    do i = 1, size(q)
      call check_characteristic(q(i), axis_type(-45.0_dp, 60.0_dp, 106), error)
      if (allocated(error)) return
    end do
  end subroutine test_characteristic

  !> All characteristic values within the axis, of both kinds, and no more.
  subroutine check_characteristic(q, axis, error)
    real(dp), intent(in) :: q
    type(axis_type), intent(in) :: axis
    type(error_type), allocatable, intent(out) :: error
    type(border_type), allocatable :: borders(:)
    real(dp), allocatable :: even(:), odd(:)

    call borders_of(mathieu_family(q=q), axis, 1.0e-13_dp, borders, error)
    if (allocated(error)) return
    even = characteristic_values(q, .false., axis%to)
    odd = characteristic_values(q, .true., axis%to)
    call compare(pack(borders, borders%kind == "divergence"), even)
    if (.not. allocated(error)) call compare(pack(borders, borders%kind == "period_doubling"), odd)
    if (.not. allocated(error)) call check(error, size(borders), size(even) + size(odd))

  contains

    subroutine compare(found, values)
      type(border_type), intent(in) :: found(:)
      real(dp), intent(in) :: values(:)

      call check(error, size(found), size(values), more="number of values")
      if (allocated(error)) return
      ! What is promised.
      call check_that(error, abs(found%value - values), "<", 1.0e-10_dp, "values")
      call check_that(error, abs(found%value - values), "<=", found%error, "claimed errors")
    end subroutine compare

  end subroutine check_characteristic

  !> Regions are all wider than twice the tolerance: the narrowest, between a0 and b1 at q = 2, has 0.12.
  subroutine test_coarse(error)
    type(error_type), allocatable, intent(out) :: error
    type(axis_type), parameter :: axis = axis_type(-2.0_dp, 8.0_dp, 10)
    real(dp), parameter :: tolerances(3) = [1.0e-4_dp, 1.0e-3_dp, 4.0e-3_dp]
    type(border_type), allocatable :: borders(:)
    real(dp), allocatable :: values(:)
    real(dp) :: q
    integer :: i, k, n

    do i = 1, size(tolerances)
      do k = 0, 10
        q = 1 + 0.1_dp * k
        call borders_of(mathieu_family(q=q), axis, tolerances(i), borders, error)
        if (allocated(error)) return
        values = [characteristic_values(q, .false., axis%to), characteristic_values(q, .true., axis%to)]
        call check(error, size(borders), size(values), more="number of values")
        if (allocated(error)) return
        ! Each border has its own value.
        call check_that(error, [(minval(abs(borders%value - values(n)) - borders%error), n = 1, size(values))], "<=", 0.0_dp, &
          & "values beyond the error of the nearest border")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_coarse

  subroutine test_close_pair(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_type), allocatable :: borders(:)

    call borders_of(mathieu_family(q=25), axis_type(-41.0_dp, -40.0_dp, 2), 1.0e-11_dp, borders, error)
    if (allocated(error)) return
    call check(error, size(borders), 2)
    if (allocated(error)) return
    call check(error, borders(1)%value, minval(characteristic_values(25.0_dp, .false., 0.0_dp)), thr=1.0e-10_dp)
    if (allocated(error)) return
    call check(error, borders(2)%value, minval(characteristic_values(25.0_dp, .true., 0.0_dp)), thr=1.0e-10_dp)
  end subroutine test_close_pair

  !> q = 0.1: the tongues at 1, 4, 9 are 0.2, 5e-3 and 3e-5 wide, the search points 0.26 apart.
  subroutine test_narrow(error)
    type(error_type), allocatable, intent(out) :: error

    call check_characteristic(0.1_dp, axis_type(-1.0_dp, 12.0_dp, 51), error)
  end subroutine test_narrow

  !> Over q at a = 3 the borders are b1, a1, b2, ...: a characteristic value of each equals 3.
  subroutine test_over_q(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_type), allocatable :: borders(:)
    real(dp), allocatable :: values(:)
    integer :: i

    call borders_of(mathieu_family(a=3, over_q=.true.), axis_type(0.0_dp, 25.0_dp, 51), 1.0e-12_dp, borders, error)
    if (allocated(error)) return
    do i = 1, size(borders)
      values = characteristic_values(borders(i)%value, borders(i)%kind == "period_doubling", 60.0_dp)
      ! |da/dq| < 2, errors of 2.5e-11 in q.
      call check_that(error, minval(abs(values - 3)), "<", 1.0e-10_dp, "distance to 3")
      if (allocated(error)) return
    end do
    ! A change at every crossing of the eight curves b2 ... b5 and a1 ... a4 that descend through 3 below q = 25.
    call check(error, size(borders), crossings_of(3.0_dp, 25.0_dp))
  end subroutine test_over_q

  !> Number of characteristic curves that cross `a` between q = 0 and `q`.
  integer function crossings_of(a, q) result(number)
    real(dp), intent(in) :: a, q

    number = size(characteristic_values(q, .false., a)) - size(characteristic_values(0.0_dp, .false., a)) &
      & + size(characteristic_values(q, .true., a)) - size(characteristic_values(0.0_dp, .true., a))
  end function crossings_of

  !> y = exp(-c t) z turns y'' + 2 c y' + (a - 2 q cos 2 t) y = 0 into Mathieu's equation with a - c**2: the border is where
  !> its multipliers are +-exp(+-c pi), |trace| = 2 cosh(c pi).
  subroutine test_damped(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: c = 0.1_dp, q = 2
    type(border_type), allocatable :: borders(:)
    real(dp) :: excess(2)
    integer :: i, side

    call borders_of(mathieu_family(q=q, d=2 * c), axis_type(-2.0_dp, 6.0_dp, 29), 1.0e-12_dp, borders, error)
    if (allocated(error)) return
    ! a0, b1, a1, b2 and a2, displaced.
    call check(error, size(borders), 5)
    if (allocated(error)) return
    do i = 1, size(borders)
      do side = 1, 2
        ! As near as the borders of the undamped equation are promised.
        excess(side) = real(abs(mathieu_trace(borders(i)%value + (2 * side - 3) * 1.0e-10_dp - c**2, q)), dp) &
          & - 2 * cosh(c * pi)
      end do
      call check_that(error, excess(1) * excess(2), "<", 0.0_dp, "both sides of the border")
      call check_that(error, (excess(1) > 0), "==", borders(i)%below == "unstable", "the unstable side")
      if (allocated(error)) return
      call check(error, any([borders(i)%below, borders(i)%above] == "stable"), more="the stable side")
      if (allocated(error)) return
    end do
  end subroutine test_damped

  subroutine test_flutter(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: d = 0.05_dp
    type(border_type), allocatable :: borders(:)

    call borders_of(flutter_family(d=d), axis_type(0.0_dp, 3.0_dp, 7), 1.0e-11_dp, borders, error)
    if (allocated(error)) return
    call check(error, size(borders), 1)
    if (allocated(error)) return
    call check(error, borders(1)%kind, "flutter")
    if (allocated(error)) return
    ! The tolerance times the range.
    call check(error, borders(1)%value, sqrt(1 + 20 * d**2), thr=3.0e-11_dp)
    if (allocated(error)) return
    ! arg = w T, w = sqrt(5); it changes by less than 1 with p.
    call check(error, borders(1)%arg_rad, sqrt(5.0_dp) * 1.3_dp, thr=1.0e-9_dp)
    if (allocated(error)) return
    call check(error, borders(1)%below // borders(1)%above, "stable    unstable")
  end subroutine test_flutter

  subroutine test_krein(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_type), allocatable :: borders(:)

    call borders_of(flutter_family(), axis_type(0.0_dp, 3.0_dp, 7), 1.0e-9_dp, borders, error)
    if (allocated(error)) return
    call check(error, size(borders), 1)
    if (allocated(error)) return
    call check(error, borders(1)%kind, "flutter")
    if (allocated(error)) return
    call check(error, borders(1)%value, 1.0_dp, thr=3.0e-9_dp)
    if (allocated(error)) return
    call check(error, borders(1)%below // borders(1)%above, "undecided unstable")
  end subroutine test_krein

  !> Stable below 1.7 and unstable above 2.3; the systems in between cannot be solved. No border is found, and the range is
  !> reported as open.
  subroutine test_unsolvable_range(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_type), allocatable :: borders(:)
    type(border_rest_type) :: rest
    type(nearest_type) :: nearest
    type(gestell_error), allocatable :: failure
    type(axis_type), parameter :: range = axis_type(0.0_dp, 4.0_dp, 5)

    call find_borders(height_family(kind="lost"), range, accuracy_type(), 1.0e-10_dp, borders, failure, rest)
    call check_success(error, failure)
    if (.not. allocated(error)) call check(error, size(borders), 0, more="borders")
    if (.not. allocated(error)) call check_that(error, size(rest%places), ">=", 1, "open places")
    if (allocated(error)) return
    ! together they cover the range without systems, and at most 1e-4 of the range around it
    associate (low => minval(rest%places%value - rest%places%width / 2), high => maxval(rest%places%value + rest%places%width / 2))
      call check(error, low, 1.7_dp, thr=4.0e-4_dp, more="from")
      if (.not. allocated(error)) call check(error, high, 2.3_dp, thr=4.0e-4_dp, more="to")
    end associate
    if (.not. allocated(error)) call nearest_stable(height_family(kind="lost"), [3.0_dp], 1, [range], accuracy_type(), 1.0e-10_dp, &
      & nearest, failure)
    if (.not. allocated(error)) call check(error, nearest%value, 1.7_dp, thr=4.0e-4_dp, more="the nearest known stable value")
    if (.not. allocated(error)) call check_that(error, nearest%open, ">=", 1, "open on the way")
  end subroutine test_unsolvable_range

  !> (p - 1)(p - 3) without systems between 1.5 and 2.5; one of four search points lies there.
  subroutine test_gap(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_type), allocatable :: borders(:)

    call borders_of(height_family(kind="gap"), axis_type(0.0_dp, 4.1_dp, 5), 1.0e-12_dp, borders, error)
    if (allocated(error)) return
    call check(error, size(borders), 2)
    if (allocated(error)) return
    call check_that(error, abs(borders%value - [1, 3]), "<", 1.0e-11_dp, "values")
    call check_that(error, [borders(1)%below, borders(2)%above], "==", "unstable", "unstable sides")
  end subroutine test_gap

  !> The same border found in the logarithm; the error follows the value.
  subroutine test_logarithmic(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_type), allocatable :: borders(:)

    call borders_of(flutter_family(d=0.05_dp), axis_type(1.0e-3_dp, 1.0e2_dp, 12, .true.), 1.0e-11_dp, borders, error)
    if (allocated(error)) return
    call check(error, size(borders), 1)
    if (allocated(error)) return
    ! ln(1e5) times the tolerance, relative.
    call check(error, borders(1)%value, sqrt(1.05_dp), thr=1.3e-10_dp)
    if (allocated(error)) return
    call check(error, borders(1)%error, 1.0e-11_dp * log(1.0e5_dp) * sqrt(1.05_dp), thr=1.0e-10_dp)
  end subroutine test_logarithmic

  !> rho = exp((p - 1)(p - 3)) from 5 down to -2, impossible between: stable from 1 to 3.
  subroutine test_descending(error)
    type(error_type), allocatable, intent(out) :: error
    type(border_type), allocatable :: borders(:)

    call borders_of(height_family(kind="gap"), axis_type(5.0_dp, -2.0_dp, 15), 1.0e-10_dp, borders, error)
    if (allocated(error)) return
    call check(error, size(borders), 2)
    if (allocated(error)) return
    ! Tolerance times the range.
    call check(error, borders(1)%value, 3.0_dp, thr=7.0e-10_dp)
    if (allocated(error)) return
    call check(error, borders(1)%below // borders(1)%above, "stable    unstable")
    if (allocated(error)) return
    call check(error, borders(2)%below // borders(2)%above, "unstable  stable")
  end subroutine test_descending

  subroutine test_nearest(error)
    type(error_type), allocatable, intent(out) :: error
    type(axis_type), parameter :: range = axis_type(-2.0_dp, 5.0_dp, 15)
    type(nearest_type) :: nearest
    type(gestell_error), allocatable :: failure

    call nearest_stable(height_family(kind="gap"), [4.0_dp], 1, [range], accuracy_type(), 1.0e-10_dp, nearest, failure)
    call check_that(error, nearest%found, "==", .true., "found")
    call check_that(error, nearest%verdict, "==", "unstable", "verdict here")
    call check_that(error, nearest%there, "==", "stable", "verdict there")
    if (allocated(error)) return
    ! Tolerance times the range, and the distance of the side that was verified.
    call check(error, nearest%value, 3.0_dp, thr=3.0e-9_dp)
    if (.not. allocated(error)) call check_that(error, abs(nearest%value - 3), "<=", nearest%error, "the border within its error")
    if (allocated(error)) return
    call check(error, nearest%distance, -1.0_dp, thr=3.0e-9_dp)
    if (allocated(error)) return
    call nearest_stable(height_family(kind="gap"), [-1.0_dp], 1, [range], accuracy_type(), 1.0e-10_dp, nearest, failure)
    call check(error, nearest%value, 1.0_dp, thr=3.0e-9_dp, more="from below")
    if (allocated(error)) return
    ! Stable already.
    call nearest_stable(height_family(kind="gap"), [2.9_dp], 1, [range], accuracy_type(), 1.0e-10_dp, nearest, failure)
    call check_that(error, nearest%verdict, "==", "stable", "stable already")
    call check_that(error, abs(nearest%distance), "<=", 0.0_dp, "stable already")
    if (allocated(error)) return
    ! None in the range; and the second parameter of two, where p2**2 < 1 - 0.6**2.
    call nearest_stable(height_family(kind="gap"), [4.0_dp], 1, [axis_type(3.5_dp, 5.0_dp, 4)], accuracy_type(), 1.0e-10_dp, &
      & nearest, failure)
    call check(error, .not. nearest%found, more="none in the range")
    if (allocated(error)) return
    call nearest_stable(height_family(), [0.6_dp, 1.0_dp], 2, [range, range], accuracy_type(), 1.0e-10_dp, nearest, failure)
    call check(error, nearest%value, 0.8_dp, thr=3.0e-9_dp, more="second parameter")
    if (allocated(error)) return
    ! Unstable where p1 p2 > 1; 4 lies beyond zero from a logarithmic axis.
    call nearest_stable(height_family(kind="saddle", offset=1.0_dp), [4.0_dp, 1.0_dp], 1, &
      & [axis_type(-1.0_dp, -20.0_dp, 15, .true.), range], accuracy_type(), 1.0e-10_dp, nearest, failure)
    call check_that(error, nearest%verdict, "==", "unstable", "beyond zero")
    call check_that(error, nearest%there, "==", "stable", "beyond zero")
    if (allocated(error)) return
    call check(error, nearest%distance, -5.0_dp, thr=1.0e-12_dp, more="beyond zero")
  end subroutine test_nearest

end module test_boundary
