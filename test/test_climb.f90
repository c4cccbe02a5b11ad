!> The search for the worst speed of a range finds maxima of known functions.
module test_climb
  use checks, only: check_that
  use gestell_base_kinds, only: dp
  use gestell_study_design_range_climb, only: climb_type
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_climb

  integer, parameter :: parabola = 1, peak = 2, rising = 3, falling = 4, jump = 5, functions = 5
  character(len=8), parameter :: names(functions) = [character(len=8) :: "parabola", "peak", "rising", "falling", "jump"]
  !> Interval, and places of the maxima.
  real(dp), parameter :: bounds(2) = [1.0_dp, 11.0_dp], maxima(functions) = [5.2_dp, 7.1_dp, 11.0_dp, 1.0_dp, 6.5_dp]

contains

  subroutine collect_climb(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("maxima inside, at ends and at jumps are found from all starts", test_maxima)]
  end subroutine collect_climb

  pure real(dp) function value(which, x)
    integer, intent(in) :: which
    real(dp), intent(in) :: x

    select case (which)
    case (parabola)
      value = 3 - 0.02_dp * (x - maxima(parabola))**2
    case (peak)
      value = 5 / (1 + 4 * (x - maxima(peak))**2)
    case (rising)
      value = x**2
    case (falling)
      value = -x**3
    case default
      value = merge(x, -x, x < maxima(jump))
    end select
  end function value

  !> From three places at the lower end, in the middle and at the upper end. The search may leave neither the interval nor the
  !> larger one of its values.
  subroutine test_maxima(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most = 80
    real(dp), parameter :: starts(3) = [1.0_dp, 4.0_dp, 9.0_dp]
    type(climb_type) :: climb
    real(dp) :: x(3), f, highest
    integer :: which, i, k

    do which = 1, functions
      do i = 1, size(starts)
        x = starts(i) + [0.0_dp, 0.8_dp, 2.0_dp]
        call climb%start(x, [(value(which, x(k)), k = 1, 3)], bounds, most)
        highest = maxval([(value(which, x(k)), k = 1, 3)])
        do while (.not. climb%done)
          call check_that(error, climb%next, ">=", bounds(1), names(which))
          call check_that(error, climb%next, "<=", bounds(2), names(which))
          f = value(which, climb%next)
          highest = max(highest, f)
          call climb%take(f)
          if (allocated(error)) return
        end do
        ! Only roundings of the parabola's values, 1e-15, displace its top: divided by twice the curvature and by intervals of a
        ! thousandth. A relative gain of 1e-10 of a value of 5 with the curvature 20 is a distance of 1e-5; halvings end at 1e-10.
        call check_that(error, abs(climb%top - maxima(which)), "<=", merge(1.0e-9_dp, 1.0e-5_dp, which == parabola), &
          & trim(names(which)) // ": place")
        call check_that(error, climb%smooth, "==", which <= peak, trim(names(which)) // ": smooth")
        call check_that(error, climb%highest, "==", highest, trim(names(which)) // ": highest value")
        ! A jump is approached by sections; all others by parabolas or by steps that double.
        call check_that(error, climb%steps, "<=", merge(most - 1, 20, which == jump), trim(names(which)) // ": steps")
        ! The same roundings, divided by the square of the interval.
        if (which == parabola) call check_that(error, abs(climb%bend - 0.02_dp), "<=", 1.0e-8_dp, "curvature of the parabola")
        ! 5 / (1 + 4 t^2) is 5 - 20 t^2. Its curvature is measured over the last interval.
        if (which == peak) call check_that(error, abs(climb%bend - 20), "<=", 0.5_dp, "curvature of the peak")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_maxima

end module test_climb
