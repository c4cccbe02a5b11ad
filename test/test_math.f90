!> Searches for zeros of functions with known zeros, sorting, and fractions.
module test_math
  use checks, only: check_that
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_math_rational, only: common_multiple, greatest_divisor, to_rational
  use gestell_math_sorting, only: ascending
  use gestell_math_root_search, only: root_search_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_math

  integer, parameter :: cubic = 1, transcendental = 2, flat = 3, steep = 4, jump = 5, functions = 5
  !> Brackets and zeros.
  real(dp), parameter :: low(functions) = [1.0_dp, 2.0_dp, -1.0_dp, -3.0_dp, -1.0_dp]
  real(dp), parameter :: high(functions) = [3.0_dp, 4.0_dp, 4.0_dp, 2.0_dp, 0.5_dp]
  real(dp), parameter :: zeros(functions) = [2**(1.0_dp / 3), pi, 1.0_dp, 0.25_dp, 0.1_dp]
  character(len=14), parameter :: names(functions) = [character(len=14) :: "cubic", "transcendental", "flat", "steep", "jump"]

contains

  subroutine collect_math(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("zeros are found within tolerance from both ends of the bracket", test_zeros), &
      & new_unittest("smooth functions need fewer steps than bisection", test_speed), &
      & new_unittest("a search that hits the zero exactly ends there", test_exact_hit), &
      & new_unittest("sorting is ascending and keeps the order of equal numbers", test_ascending), &
      & new_unittest("decimal numbers and pairs become the same fraction in lowest terms", test_fractions)]
  end subroutine collect_math

  real(dp) function f(which, x)
    integer, intent(in) :: which
    real(dp), intent(in) :: x

    select case (which)
    case (cubic)
      f = x**3 - 2
    case (transcendental)
      f = sin(x)
    case (flat)
      f = (x - 1)**9
    case (steep)
      f = exp(40 * (x - 0.25_dp)) - 1
    case default
      f = sign(1.0_dp, x - 0.1_dp)
    end select
  end function f

  !> The zero between `a` and `b`, and the number of evaluations; -1 if a point lay outside the bracket or was used twice.
  subroutine solve(which, a, b, tolerance, root, steps)
    integer, intent(in) :: which
    real(dp), intent(in) :: a, b, tolerance
    real(dp), intent(out) :: root
    integer, intent(out) :: steps
    type(root_search_type) :: search
    real(dp) :: x

    call search%start(a, f(which, a), b, f(which, b))
    steps = 0
    do while (.not. search%found(tolerance))
      x = search%next(tolerance)
      if (x <= minval(search%x) .or. x >= maxval(search%x) .or. steps > 1000) then
        steps = -1
        return
      end if
      call search%take(x, f(which, x))
      steps = steps + 1
    end do
    root = search%root()
  end subroutine solve

  subroutine test_zeros(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tolerances(3) = [1.0e-3_dp, 1.0e-8_dp, 1.0e-14_dp]
    real(dp) :: root
    integer :: i, k, way, steps

    do i = 1, functions
      do k = 1, size(tolerances)
        do way = 1, 2
          if (way == 1) call solve(i, low(i), high(i), tolerances(k), root, steps)
          if (way == 2) call solve(i, high(i), low(i), tolerances(k), root, steps)
          call check(error, steps >= 0, more=trim(names(i)) // ": a point outside the bracket")
          if (allocated(error)) return
          call check(error, root, zeros(i), thr=2 * tolerances(k), more=trim(names(i)) // ", tolerance " // concise(tolerances(k)))
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_zeros

  !> Bisection to 1e-12 of about 2 takes 41 steps.
  subroutine test_speed(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: root
    integer :: i, steps

    do i = cubic, transcendental
      call solve(i, low(i), high(i), 1.0e-12_dp, root, steps)
      call check(error, steps > 0 .and. steps <= 12, more=trim(names(i)) // ": " // text(steps) // " steps")
      if (allocated(error)) return
    end do
    ! Where interpolation does not help, the cost is little more than that of bisection.
    call solve(jump, low(jump), high(jump), 1.0e-12_dp, root, steps)
    call check(error, steps > 0 .and. steps <= 60, more="jump: " // text(steps) // " steps")
  end subroutine test_speed

  !> x (x + 1) is zero in the middle of [-1/2, 1/2] to the last bit.
  subroutine test_exact_hit(error)
    type(error_type), allocatable, intent(out) :: error
    type(root_search_type) :: search
    real(dp) :: x

    call search%start(-0.5_dp, -0.25_dp, 0.5_dp, 0.75_dp)
    x = search%next(1.0e-12_dp)
    call search%take(x, x * (x + 1))
    call check(error, search%found(1.0e-12_dp), more="the zero at " // concise(x) // " did not end the search")
    if (.not. allocated(error)) call check(error, search%root(), 0.0_dp, thr=0.0_dp)
    if (.not. allocated(error)) call check(error, search%width() <= 1.0_dp)
  end subroutine test_exact_hit

  subroutine test_ascending(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: values(7) = [3.0_dp, -1.0_dp, 3.0_dp, 0.0_dp, 7.5_dp, -1.0_dp, 3.0_dp]
    integer, parameter :: expected(7) = [2, 6, 4, 1, 3, 7, 5]
    character(len=40) :: words

    write (words, "(7(1x, i0))") ascending(values)
    call check(error, all(ascending(values) == expected), more="the places are" // words)
    if (.not. allocated(error)) call check(error, size(ascending(values(:0))), 0)
  end subroutine test_ascending

  !> Every fraction with a denominator of at most 64, as a decimal number and as a pair that is not in lowest terms. Signs belong to
  !> the numerator.
  subroutine test_fractions(error)
    type(error_type), allocatable, intent(out) :: error
    integer :: p, q, k, numerator, denominator, shared
    logical :: known

    do q = 1, 64
      do p = -130, 130
        if (p == 0) cycle
        shared = maxval([(k, k = 1, q)], mask=[(mod(p, k) == 0 .and. mod(q, k) == 0, k = 1, q)])
        call check_that(error, greatest_divisor(p, q), "==", shared, "greatest divisor")
        call check_that(error, common_multiple(p, q), "==", abs(p) * q / shared, "common multiple")
        call to_rational([real(p, dp) / q], numerator, denominator, known)
        call check_that(error, known, "==", .true., "decimal number")
        call check_that(error, [numerator, denominator], "==", [p, q] / shared, "decimal number")
        ! The signs of both numbers count.
        k = merge(-3, 3, mod(p + q, 2) == 0)
        call to_rational(real(k * [p, q], dp), numerator, denominator, known)
        call check_that(error, known, "==", .true., "pair")
        call check_that(error, [numerator, denominator], "==", [p, q] / shared, "pair")
        if (allocated(error)) return
      end do
    end do
    call expect("zero", [0.0_dp], .false.)
    call expect("division by zero", [1.0_dp, 0.0_dp], .false.)
    call expect("half a tooth", [1.5_dp, 2.0_dp], .false.)
    call expect("denominator 65", [1 / 65.0_dp], .false.)
    call expect("the largest number", [4096.0_dp], .true.)
    call expect("beyond it", [4096.5_dp], .false.)
    call expect("the largest pair", [4096.0_dp, -4096.0_dp], .true.)
    call expect("a pair beyond it", [1.0_dp, 4097.0_dp], .false.)
    ! Ten digits are enough for a fraction, eight are not.
    call expect("one third with ten digits", [0.3333333333_dp], .true.)
    call expect("one third with eight digits", [0.33333333_dp], .false.)

  contains

    subroutine expect(what, values, wanted)
      character(len=*), intent(in) :: what
      real(dp), intent(in) :: values(:)
      logical, intent(in) :: wanted

      call to_rational(values, numerator, denominator, known)
      call check_that(error, known, "==", wanted, what)
    end subroutine expect

  end subroutine test_fractions

end module test_math
