!> Properties of the monodromy matrix that hold for every machine.
module test_invariants
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_period_liouville, only: trace_integral
  use gestell_floquet_multipliers, only: multipliers_type, solve_multipliers
  use gestell_model_frame, only: frame_type
  use machines, only: frame_of_machine, solve3
  use reference_cases, only: random_machine
  use reference_machine, only: machine_data
  use systems, only: again_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_invariants

contains

  subroutine collect_invariants(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("random machines satisfy Liouville's theorem", test_liouville), &
      & new_unittest("undamped machines have reciprocal pairs of multipliers", test_reciprocal), &
      & new_unittest("the monodromy matrix of two turns is the square of one", test_two_turns), &
      & new_unittest("multipliers do not depend on the starting phase", test_starting_phase)]
  end subroutine collect_invariants

  subroutine solve(frame, tolerance, monodromy, error)
    type(frame_type), intent(in) :: frame
    real(dp), intent(in) :: tolerance
    type(monodromy_type), intent(out) :: monodromy
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call solve_monodromy(frame, accuracy_type(tolerance=tolerance), .false., monodromy, failure)
    call check_success(error, failure)
  end subroutine solve

  subroutine random_frame(number, frame, error)
    integer, intent(in) :: number
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call frame_of_machine(random_machine(number), frame, failure)
    call check_success(error, failure)
  end subroutine random_frame

  !> The integral of tr P is the closed form; the library's defect is small, and so is the one of a determinant by the multipliers.
  subroutine test_liouville(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    type(gestell_error), allocatable :: failure
    real(dp) :: integral, defect
    integer :: i

    do i = 1, 60
      call random_frame(i, frame, error)
      if (allocated(error)) return
      call solve(frame, 1.0e-10_dp, monodromy, error)
      if (allocated(error)) return
      call trace_integral(frame, monodromy%nodes, integral, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      ! The points resolve the coefficients to rounding, in sums of hundreds of terms; without damping the sum was 8e-18.
      call check(error, integral, -trace_of_damping(frame), thr=1.0e-12_dp * trace_of_damping(frame) + 1.0e-15_dp, &
        & more="integral of tr P")
      if (allocated(error)) return
      call solve_multipliers(monodromy, .false., multipliers, failure)
      ! An error e of Phi changes ln det Phi by up to e |Phi^-1| n.
      call monodromy%liouville_defect(frame, defect, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, abs(defect), "<=", 1.0e-9_dp * monodromy%norm * exp(-multipliers%log_abs(6)), &
        & "Liouville's defect")
      if (allocated(error)) return
      call check(error, sum(multipliers%log_abs), -trace_of_damping(frame), &
        & thr=1.0e-9_dp * monodromy%norm * exp(-multipliers%log_abs(6)), more="closed form")
      if (allocated(error)) return
    end do
  end subroutine test_liouville

  !> The integral of tr(M^-1 D) over the period with the damping matrix D alone: the periodic part of B is dM/dt plus an
  !> antisymmetric matrix, so tr(M^-1 dM/dt) = d/dt ln det M drops out over a period.
  real(dp) function trace_of_damping(frame)
    type(frame_type), intent(in) :: frame
    integer, parameter :: points = 2000
    real(dp) :: m(3, 3), b(3, 3), c(3, 3), column(3)
    integer :: i, k

    trace_of_damping = 0
    do k = 1, points
      call frame%matrices(frame%period * k / points, m, b, c)
      do i = 1, 3
        column = solve3(m, frame%damping(:, i))
        trace_of_damping = trace_of_damping + column(i) * frame%period / points
      end do
    end do
  end function trace_of_damping

  !> Undamped equations derive from a Lagrangian, so 1 / rho is a multiplier if rho is.
  subroutine test_reciprocal(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: m
    type(gestell_error), allocatable :: failure
    integer :: i, j, k

    do i = 1, 30
      machine = random_machine(i)
      machine%foundation_damping = 0
      do k = 1, size(machine%supports)
        machine%supports(k)%damping = 0
      end do
      call frame_of_machine(machine, frame, failure)
      if (.not. allocated(failure)) call solve_monodromy(frame, accuracy_type(tolerance=1.0e-11_dp), .false., monodromy, failure)
      if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., m, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      do j = 1, 6
        ! The partner is found within the bounds that both carry.
        call check_that(error, minval(abs(m%rho - 1 / m%rho(j)) - abs(m%rho) * m%error - abs(1 / m%rho(j)) * m%error(j)), "<=", &
          & 0.0_dp, "beyond the bounds of the nearest reciprocal")
        if (allocated(error)) return
      end do
      call check_that(error, m%verdict(), "/=", "stable", "an undamped machine is never asymptotically stable")
      if (allocated(error)) return
    end do
  end subroutine test_reciprocal

  subroutine test_two_turns(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(again_type) :: twice
    type(monodromy_type) :: one, two
    type(gestell_error), allocatable :: failure
    integer :: i

    do i = 1, 10
      call random_frame(i, frame, error)
      if (allocated(error)) return
      call solve(frame, 1.0e-11_dp, one, error)
      if (allocated(error)) return
      twice = again(frame, 2, 0.0_dp)
      call solve_monodromy(twice, accuracy_type(tolerance=1.0e-11_dp), .false., two, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      ! Errors of Phi and of its square: 1e-11 each, the first twice, times the norm.
      call check_that(error, norm2((two%phi - matmul(one%phi, one%phi)) * spread(one%scale, 1, 6) / spread(one%scale, 2, 6)), &
        & "<=", 5.0e-11_dp * one%norm**2, "Phi(2 T) and Phi(T)^2")
      if (allocated(error)) return
    end do
  end subroutine test_two_turns

  function again(frame, turns, start) result(system)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: turns
    real(dp), intent(in) :: start
    type(again_type) :: system

    system%states = frame%states
    system%period = turns * frame%period
    system%least_steps = turns * frame%least_steps
    system%start = start
    allocate(system%system, source=frame)
  end function again

  subroutine test_starting_phase(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: m, shifted
    type(gestell_error), allocatable :: failure
    integer :: i, k

    do i = 1, 10
      call random_frame(i, frame, error)
      if (allocated(error)) return
      call solve(frame, 1.0e-11_dp, monodromy, error)
      if (allocated(error)) return
      call solve_multipliers(monodromy, .false., m, failure)
      call solve_monodromy(again(frame, 1, 0.377_dp * frame%period), accuracy_type(tolerance=1.0e-11_dp), .false., &
        & monodromy, failure)
      if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., shifted, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      do k = 1, 6
        call check_that(error, minval(abs(m%rho - shifted%rho(k)) - abs(m%rho) * m%error), "<=", abs(shifted%rho(k)) &
          & * shifted%error(k), "nearest multiplier")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_starting_phase

end module test_invariants
