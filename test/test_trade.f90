!> The measured trade of speed for accuracy: the reported errors are the true ones.
module test_trade
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_period_map, only: period_map
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_methods, only: new_method
  use gestell_floquet_period_monodromy, only: accuracy_type, solve_monodromy
  use gestell_floquet_solution, only: solve_multipliers, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_task_trade, only: cheapest, converged_type, measure_row, measure_trade, trade_row_type, trade_type
  use machines, only: frame_of_machine
  use reference_frame, only: frame_of, frame_period
  use reference_linear, only: qp
  use reference_machine, only: khang_machine
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_trade

contains

  subroutine collect_trade(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("reported errors of the speed-accuracy trade are the true errors", test_errors), &
      & new_unittest("the cheapest row that meets the tolerance is chosen", test_cheapest)]
  end subroutine collect_trade

  !> Rows for increasing steps for every method, and the first rows of the task itself: with hardly any time allowed it ends
  !> after the first row of each method, however busy the computer is.
  subroutine test_errors(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: methods(*) = [character(len=7) :: "rk4", "gauss4", "gauss8", "magnus6"]
    integer, parameter :: rungs = 7
    type(frame_type) :: frame
    type(trade_type) :: trade
    type(trade_row_type) :: rows(rungs, size(methods))
    type(accuracy_type) :: accuracy
    type(converged_type) :: converged
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(qp) :: phi_q(6, 6), xp_q(6), x0_q(6)
    real(dp) :: spent
    integer :: least(size(methods)), i, k

    call frame_of_machine(khang_machine(360.0_dp), frame, failure)
    if (.not. allocated(failure)) call measure_trade(frame, 1.0e-7_dp, trade, failure)
    accuracy = accuracy_type(tolerance=1.0e-14_dp, method="gauss8")
    if (.not. allocated(failure)) call solve_monodromy(frame, accuracy, .true., converged%monodromy, failure)
    if (.not. allocated(failure)) call solve_multipliers(converged%monodromy, .false., converged%multipliers, failure)
    if (.not. allocated(failure)) call solve_periodic(converged%monodromy, converged%solution, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call frame_period(frame_of(khang_machine(360.0_dp)), 1.0e-22_qp, phi_q, xp_q, x0_q)
    call check_that(error, size(trade%rows), ">", 0, "rows of the task")
    do i = 1, size(trade%rows)
      call check_row(trade%rows(i))
    end do
    least = huge(1)
    do k = 1, size(methods)
      call new_method(trim(methods(k)), method, failure)
      do i = 1, rungs
        call measure_row(frame, method, 20 * 2**i, converged, rows(i, k), spent, failure)
        call check_success(error, failure, methods(k))
        if (allocated(error)) return
        call check_row(rows(i, k))
        if (rows(i, k)%error_phi < 1.0e-9_dp) least(k) = min(least(k), rows(i, k)%evaluations)
      end do
      deallocate(method)
    end do
    ! The higher the order, the less the work for nine digits.
    call check_that(error, least(2:), "<", least(1), "evaluations for 1e-9, by rk4 at most")

  contains

    !> The error that a row claims is the true one of its method and steps.
    subroutine check_row(row)
      type(trade_row_type), intent(in) :: row
      class(method_type), allocatable :: its_method
      real(dp) :: phi(6, 6), true_error

      call new_method(trim(row%method), its_method, failure)
      call period_map(frame, its_method, mesh(frame, row%steps), converged%monodromy%scale, phi, failure)
      true_error = &
        & norm2(real(phi - phi_q, dp) * spread(converged%monodromy%scale, 1, 6) &
        & / spread(converged%monodromy%scale, 2, 6)) / converged%monodromy%norm
      call check_that(error, abs(row%error_phi - true_error), "<=", 1.0e-6_dp * true_error + trade%floor_phi, row%method)
      call check_that(error, row%evaluations, "==", row%steps * its_method%stages, row%method)
      call check_that(error, row%seconds, ">=", 0.0_dp, row%method)
    end subroutine check_row

  end subroutine test_errors

  subroutine test_cheapest(error)
    type(error_type), allocatable, intent(out) :: error
    type(trade_row_type) :: rows(4)

    rows%error_phi = [1.0e-3_dp, 1.0e-7_dp, 1.0e-7_dp, 1.0e-12_dp]
    rows%error_x0 = [1.0e-3_dp, 1.0e-8_dp, 1.0e-5_dp, 1.0e-12_dp]
    rows%seconds = [1.0_dp, 3.0_dp, 2.0_dp, 9.0_dp]
    call check(error, cheapest(rows, 1.0e-2_dp), 1)
    if (allocated(error)) return
    call check(error, cheapest(rows, 1.0e-6_dp), 2)
    if (allocated(error)) return
    call check(error, cheapest(rows, 1.0e-10_dp), 4)
    if (allocated(error)) return
    call check(error, cheapest(rows, 1.0e-14_dp), 0)
  end subroutine test_cheapest

end module test_trade
