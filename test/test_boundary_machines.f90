!> Critical values of machines' parameters against plain bisection and a dense sweep.
module test_boundary_machines
  use boundary_families, only: machine_family, new_machine_family
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_task_boundary_line_borders, only: border_accuracy, border_type, find_borders
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type
  use gestell_system_periodic, only: periodic_system
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_boundary_machines

contains

  subroutine collect_boundary_machines(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("borders of the rocking sieve agree with plain bisection", test_sieve), &
      & new_unittest("borders of a weakly damped four-bar agree with a dense sweep and bisection", test_four_bar), &
      & new_unittest("coarse and fine searches over a four-bar's stiffness find the same borders", test_coarse)]
  end subroutine collect_boundary_machines

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

  !> Parametric instability near twice the natural frequency, against bisection by solutions of the usual kind.
  subroutine test_sieve(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: sieve
    type(gestell_error), allocatable :: failure
    type(border_type), allocatable :: borders(:)
    integer :: i

    call new_machine_family("data/rocking_sieve.nml", ["drive.speed_rpm"], sieve, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call borders_of(sieve, axis_type(120.0_dp, 300.0_dp, 10), 1.0e-11_dp, borders, error)
    if (allocated(error)) return
    call check(error, size(borders), 2)
    if (allocated(error)) return
    call check_that(error, borders%kind, "==", "period_doubling", "kinds")
    if (allocated(error)) return
    do i = 1, 2
      ! Verdicts cannot distinguish the sides within their error, 1e-12, times the change of speed that changes ln rho by 1.
      call check(error, borders(i)%value, bisected(sieve, 120.0_dp + 109 * (i - 1), 229.0_dp + 71 * (i - 1)), thr=1.0e-8_dp)
      if (allocated(error)) return
    end do
  end subroutine test_sieve

  !> With a fifth of the damping eight narrow ranges of speed are unstable, three of them by flutter of two modes. A sweep of
  !> 58001 points in steps of 0.05 rpm shows them; here 40 search points must find them.
  subroutine test_four_bar(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: ranges(2, 8) = reshape([1215.75_dp, 1216.0_dp, 1455.15_dp, 1455.15_dp, 1569.2_dp, 1569.5_dp, &
      & 1922.8_dp, 1922.8_dp, 2099.65_dp, 2099.8_dp, 2182.65_dp, 2182.9_dp, 2430.0_dp, 2433.7_dp, 2536.05_dp, 2536.35_dp], [2, 8])
    type(machine_family) :: four_bar
    type(gestell_error), allocatable :: failure
    type(border_type), allocatable :: borders(:)
    integer :: i

    call new_machine_family("data/khang_four_bar.nml", ["drive.speed_rpm"], four_bar, failure, &
      & ["foundation.damping=0.1,0.1,0.01"])
    call check_success(error, failure)
    if (allocated(error)) return
    call borders_of(four_bar, axis_type(1100.0_dp, 2600.0_dp, 40), 1.0e-10_dp, borders, error)
    if (allocated(error)) return
    call check(error, size(borders), 16)
    if (allocated(error)) return
    ! The sweep's step; all of its unstable points lie between the borders.
    call check_that(error, borders(::2)%value, "<", ranges(1, :), "lower borders")
    call check_that(error, borders(::2)%value, ">", ranges(1, :) - 0.0501_dp, "lower borders")
    call check_that(error, borders(2::2)%value, ">", ranges(2, :), "upper borders")
    call check_that(error, borders(2::2)%value, "<", ranges(2, :) + 0.0501_dp, "upper borders")
    if (allocated(error)) return
    call check(error, count(borders%kind == "flutter"), 8)
    if (allocated(error)) return
    do i = 1, size(borders), 5
      ! The claimed error, plus that of verdicts, as above.
      call check(error, borders(i)%value, bisected(four_bar, borders(i)%value - 0.02_dp, borders(i)%value + 0.02_dp), &
        & thr=borders(i)%error + 1.0e-8_dp)
      if (allocated(error)) return
    end do
  end subroutine test_four_bar

  !> Regions of different kinds close together, and search points that do not resolve the functions.
  subroutine test_coarse(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: four_bar
    type(gestell_error), allocatable :: failure
    type(border_type), allocatable :: coarse(:), fine(:)

    call new_machine_family("data/khang_four_bar.nml", ["support.stiffness"], four_bar, failure, &
      & ["foundation.damping=0.1,0.1,0.01", "drive.speed_rpm=2000           "])
    call check_success(error, failure)
    if (allocated(error)) return
    call borders_of(four_bar, axis_type(49033.25_dp, 392266.0_dp, 15), 1.0e-10_dp, coarse, error)
    if (allocated(error)) return
    call borders_of(four_bar, axis_type(49033.25_dp, 392266.0_dp, 120), 1.0e-10_dp, fine, error)
    if (allocated(error)) return
    call check(error, size(fine), 18)
    if (allocated(error)) return
    call check(error, size(coarse), 18)
    if (allocated(error)) return
    call check_that(error, abs(coarse%value - fine%value), "<=", coarse%error + fine%error, "coarse and fine values")
  end subroutine test_coarse

  !> Finds by bisection where the largest multiplier is 1 between two values of the only parameter.
  real(dp) function bisected(family, from, to) result(middle)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: from, to
    class(periodic_system), allocatable :: system
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(gestell_error), allocatable :: failure
    real(dp) :: ends(2), log_rho(3), t(3)
    integer :: halving, k

    ends = [from, to]
    do halving = 1, 45
      t = [ends(1), (ends(1) + ends(2)) / 2, ends(2)]
      middle = t(2)
      do k = 1, 2
        call family%member([t(k)], system, failure)
        if (.not. allocated(failure)) call solve_floquet(system, accuracy_type(tolerance=1.0e-12_dp), .false., floquet, failure)
        if (.not. allocated(failure)) call solve_multipliers(floquet, .false., multipliers, failure)
        if (allocated(failure)) return
        log_rho(k) = multipliers%log_abs(1)
      end do
      if (log_rho(1) * log_rho(2) > 0) then
        ends(1) = middle
      else
        ends(2) = middle
      end if
    end do
  end function bisected

end module test_boundary_machines
