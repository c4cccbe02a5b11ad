!> The measured trade of speed for accuracy: its errors are the true ones.
module test_trade
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_period_map, only: period_map
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_integrator_methods, only: new_method
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_model_frame, only: frame_type
  use gestell_task_trade, only: cheapest, measure_trade, trade_row_type, trade_type
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
      & new_unittest("errors of the paper's machine against the reference", test_errors), &
      & new_unittest("the cheapest row", test_cheapest)]
  end subroutine collect_trade

  subroutine test_errors(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(trade_type) :: trade
    type(monodromy_type) :: monodromy
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(qp) :: phi_q(6, 6), xp_q(6), x0_q(6)
    real(dp) :: phi(6, 6), true_error
    integer :: i

    call frame_of_machine(khang_machine(360.0_dp), frame, failure)
    if (.not. allocated(failure)) call measure_trade(frame, 0.5_dp, trade, failure)
    if (.not. allocated(failure)) call solve_monodromy(frame, accuracy_type(), .true., monodromy, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call frame_period(frame_of(khang_machine(360.0_dp)), 1.0e-22_qp, phi_q, xp_q, x0_q)
    do i = 1, size(trade%rows)
      associate (row => trade%rows(i))
        call new_method(trim(row%method), method, failure)
        call period_map(frame, method, mesh(frame, row%steps), monodromy%scale, phi, failure)
        true_error = norm2(real(phi - phi_q, dp) * spread(monodromy%scale, 1, 6) / spread(monodromy%scale, 2, 6)) / monodromy%norm
        call check_that(error, abs(row%error_phi - true_error), "<=", 1.0e-6_dp * true_error + trade%floor_phi, row%method)
        if (allocated(error)) return
        call check_that(error, row%seconds, ">=", 0.0_dp, "seconds")
        call check_that(error, row%evaluations, "==", row%steps * method%stages, "evaluations")
        if (allocated(error)) return
        deallocate(method)
      end associate
    end do
    call check_that(error, cheapest(trade%rows, 1.0e-9_dp), ">", 0, "row for 1e-9")
    if (allocated(error)) return
    call check_that(error, trim(trade%rows(cheapest(trade%rows, 1.0e-9_dp))%method), "/=", "rk4", "method for 1e-9")
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
