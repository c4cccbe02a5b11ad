!> Measures computing time against accuracy for the machine of the input.
module gestell_task_trade
  use gestell_base_error, only: error_type, fatal_error, failed_computation, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: inverse
  use gestell_math_matrix, only: balanced
  use gestell_math_sorting, only: ascending
  use gestell_floquet_period_period_map, only: period_map
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type, name_length
  use gestell_floquet_choice_methods, only: method_names, new_method
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: evidence, evidence_type, floquet_type, solve_floquet, solve_multipliers, solve_periodic
  use gestell_model_frame, only: frame_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_fortran_env, only: int64
  use gestell_task_common_executor, only: executor_type
  implicit none (type, external)
  private

  public :: cheapest, clock_time, measure_row, measure_trade, median

  !> Result of one method with a given number of steps. Errors are relative to the converged solution.
  type, public :: trade_row_type
    !> Name of the integration method
    character(len=name_length) :: method = ""
    !> `order`: order of convergence. `steps`: number of steps in the period. `evaluations`: number of evaluations of the
    !> coefficients in the period
    integer :: order = 0, steps = 0, evaluations = 0
    !> Errors of the row. `error_phi`: error of the monodromy matrix Phi(T), relative to its norm. `error_x0`: error of the initial
    !> state x0 of the vibration, relative to its norm. For both, the state is scaled to balanced units. `error_rho`: largest
    !> relative error of a multiplier
    real(dp) :: error_phi = 0, error_rho = 0, error_x0 = 0
    !> Median of the computing times (s) of one solution, which consists of the monodromy matrix Phi(T) and the response x_p(T)
    !> from rest after one period
    real(dp) :: seconds = 0
  end type trade_row_type

  !> The converged solution with which all rows are compared.
  type, public :: converged_type
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
  end type converged_type

  !> All measurements for one machine, and the error bounds below which errors cannot be measured.
  type, public :: trade_type
    !> One row for each number of steps of every method
    type(trade_row_type), allocatable :: rows(:)
    !> Error bounds of the converged solution: of the monodromy matrix (`floor_phi`), of the multipliers (`floor_rho`), and of the
    !> initial state (`floor_x0`). Errors of the methods below these bounds cannot be measured
    real(dp) :: floor_phi = 0, floor_rho = 0, floor_x0 = 0
  end type trade_type

contains

  !> Measures every method with increasing numbers of steps, and the method "reduced" if it is applicable. Each method has the same
  !> share of the budget. Its measurement ends when its error is about as small as that of the converged solution, or when half of
  !> its share is spent. Until its first row is complete, it may spend five times its share. Fails if the budget is not positive
  !> and finite, if there is no converged solution, or at resonance.
  subroutine measure_trade(frame, budget, trade, error, executor)
    class(frame_type), intent(in) :: frame
    !> Approximate computing time for all methods together (s)
    real(dp), intent(in) :: budget
    type(trade_type), intent(out) :: trade
    type(error_type), allocatable, intent(out) :: error
    !> Displays the progress of the measurements
    class(executor_type), intent(inout), optional :: executor
    type(converged_type) :: converged
    class(method_type), allocatable :: method
    character(len=name_length), allocatable :: names(:)
    integer :: i

    if (.not. (budget > 0 .and. ieee_is_finite(budget))) then
      call fatal_error(error, "the time budget must be positive and finite", invalid_input)
      return
    end if
    associate (monodromy => converged%monodromy, multipliers => converged%multipliers, solution => converged%solution)
      call solve_monodromy(frame, accuracy_type(tolerance=1.0e-14_dp, method="gauss8"), .true., monodromy, error)
      if (.not. allocated(error)) call solve_multipliers(monodromy, .false., multipliers, error)
      if (.not. allocated(error)) call solve_periodic(monodromy, solution, error)
      if (allocated(error)) return
      trade%floor_phi = monodromy%error / monodromy%norm
      trade%floor_rho = maxval(multipliers%error)
      trade%floor_x0 = norm2(solution%error / monodromy%scale) / max(norm2(solution%x0 / monodromy%scale), tiny(1.0_dp))
    end associate

    allocate(trade%rows(0))
    allocate(names, source=pack(method_names(), method_names() /= "auto"))
    do i = 1, size(names)
      call new_method(trim(names(i)), method, error)
      if (allocated(error)) return
      call measure_method(frame, method, converged, budget / size(names), trade)
      deallocate(method)
      if (present(executor)) call executor%show("measuring", real(i, dp) / size(names))
    end do
    call measure_reduction(frame, converged, trade)
    if (size(trade%rows) == 0) call fatal_error(error, "no method finished within the time budget", failed_computation)
  end subroutine measure_trade

  !> Measures one method with increasing numbers of steps: each number is 1.5 times the previous one.
  subroutine measure_method(frame, method, converged, budget, trade)
    class(frame_type), intent(in) :: frame
    class(method_type), intent(in) :: method
    type(converged_type), intent(in) :: converged
    real(dp), intent(in) :: budget
    type(trade_type), intent(inout) :: trade
    type(trade_row_type) :: row
    type(survey_type) :: survey
    type(error_type), allocatable :: error
    real(dp) :: spent, time_needed
    integer :: steps, before

    call survey_system(frame, survey, error)
    if (allocated(error)) return
    before = size(trade%rows)
    ! No method converges if the fastest vibration advances by more than `order` radians in a step.
    steps = max(frame%least_steps, nint(survey%phase_advance / method%order))
    spent = 0
    do
      call measure_row(frame, method, steps, converged, row, time_needed, error)
      ! If a step is too long, the equations may become singular or overflow. The next number of steps is then tried.
      spent = spent + time_needed
      if (.not. allocated(error)) then
        if (row%error_phi < 1) trade%rows = [trade%rows, row]
        if (row%error_phi <= 2 * trade%floor_phi) exit
      end if
      ! A method that has no row yet may spend ten times as much, so that it is not excluded if the computer is busy.
      if (spent > merge(0.5_dp, 5.0_dp, size(trade%rows) > before) * budget) exit
      steps = ceiling(1.5_dp * steps)
    end do
  end subroutine measure_method

  !> Measures one row: computes the same solution at least three times, takes the median of the computing times, and computes the
  !> errors. Fails if matrices are singular or not finite, or at resonance.
  subroutine measure_row(frame, method, steps, converged, row, spent, error)
    class(frame_type), intent(in) :: frame
    class(method_type), intent(in) :: method
    !> Number of integration steps in the period
    integer, intent(in) :: steps
    !> Converged solution with which the row is compared
    type(converged_type), intent(in) :: converged
    type(trade_row_type), intent(out) :: row
    !> Total computing time of all solutions that were made for this row (s)
    real(dp), intent(out) :: spent
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most = 9
    type(monodromy_type) :: coarse
    type(multipliers_type) :: its_multipliers
    type(periodic_solution_type) :: its_solution
    real(dp) :: times(most), reach, begin
    integer :: runs

    coarse = converged%monodromy
    ! The copy still contains this component of the converged solution.
    if (allocated(coarse%phi_change)) deallocate(coarse%phi_change)
    coarse%nodes = mesh(frame, steps)
    spent = 0
    do runs = 1, most
      begin = clock_time()
      call period_map(frame, method, coarse%nodes, coarse%scale, coarse%phi, error, coarse%xp, reach)
      times(runs) = clock_time() - begin
      spent = spent + times(runs)
      if (allocated(error)) return
      if (runs >= 3 .and. spent > 0.02_dp) exit
    end do
    runs = min(runs, most)

    row%method = trim(method%name)
    row%order = method%order
    row%steps = size(coarse%nodes) - 1
    row%evaluations = row%steps * method%stages
    row%seconds = median(times(:runs))
    coarse%error = 0
    call solve_multipliers(coarse, .false., its_multipliers, error)
    if (.not. allocated(error)) call solve_periodic(coarse, its_solution, error)
    if (.not. allocated(error)) call compare(coarse%phi, its_multipliers, its_solution, converged, row)
  end subroutine measure_row

  !> Adds a row for the method "reduced" if it is applicable to this machine. The monodromy matrix Phi(T) is composed from the
  !> multipliers and eigenvectors that this method computes.
  subroutine measure_reduction(frame, converged, trade)
    class(frame_type), intent(in) :: frame
    type(converged_type), intent(in) :: converged
    type(trade_type), intent(inout) :: trade
    integer, parameter :: runs = 3
    type(trade_row_type) :: row
    type(floquet_type) :: floquet
    type(evidence_type) :: found
    type(multipliers_type) :: its_multipliers
    type(periodic_solution_type) :: its_solution
    type(error_type), allocatable :: error
    complex(dp), allocatable :: inverted(:, :)
    real(dp) :: times(runs), begin
    integer :: k

    do k = 1, runs
      begin = clock_time()
      call solve_floquet(frame, accuracy_type(tolerance=1.0e-12_dp, method="reduced"), .true., floquet, error)
      times(k) = clock_time() - begin
      if (allocated(error)) return
    end do
    call solve_multipliers(floquet, .true., its_multipliers, error)
    if (.not. allocated(error)) call solve_periodic(floquet, its_solution, error)
    if (.not. allocated(error)) call inverse(its_multipliers%vectors, inverted, error)
    if (allocated(error)) return
    call evidence(floquet, found)
    row%method = "reduced"
    row%steps = found%angles
    row%evaluations = found%evaluations
    row%seconds = median(times)
    associate (v => its_multipliers%vectors, rho => its_multipliers%rho)
      call compare(real(matmul(v * spread(rho, 1, size(rho)), inverted)), its_multipliers, its_solution, converged, row)
    end associate
    trade%rows = [trade%rows, row]
  end subroutine measure_reduction

  !> Computes the errors of a row. A multiplier is ignored if its relative error in the converged solution is 0.5 or more.
  subroutine compare(phi, its_multipliers, its_solution, converged, row)
    real(dp), intent(in) :: phi(:, :)
    type(multipliers_type), intent(in) :: its_multipliers
    type(periodic_solution_type), intent(in) :: its_solution
    type(converged_type), intent(in) :: converged
    type(trade_row_type), intent(inout) :: row
    integer :: n, k

    n = size(phi, 1)
    associate (d => converged%monodromy%scale, x0 => converged%solution%x0, multipliers => converged%multipliers)
      row%error_phi = norm2(balanced(phi - converged%monodromy%phi, d)) / converged%monodromy%norm
      row%error_x0 = norm2((its_solution%x0 - x0) / d) / max(norm2(x0 / d), tiny(1.0_dp))
      row%error_rho = maxval([(minval(abs(its_multipliers%rho - multipliers%rho(k))) / max(abs(multipliers%rho(k)), &
        & tiny(1.0_dp)), k = 1, n)], mask=multipliers%error < 0.5_dp)
    end associate
  end subroutine compare

  !> Index of the fastest row among those whose errors of the monodromy matrix and of the initial state do not exceed `allowed`; 0
  !> if there is none.
  pure integer function cheapest(rows, allowed)
    type(trade_row_type), intent(in) :: rows(:)
    real(dp), intent(in) :: allowed

    cheapest = minloc(rows%seconds, dim=1, mask=rows%error_phi <= allowed .and. rows%error_x0 <= allowed)
  end function cheapest

  !> Median of the values. If their number is even, it is the lower one of the two values in the middle.
  pure real(dp) function median(values)
    real(dp), intent(in) :: values(:)
    real(dp) :: sorted(size(values))

    sorted = values(ascending(values))
    median = sorted((size(sorted) + 1) / 2)
  end function median

  !> Time since the system's clock started (s).
  real(dp) function clock_time()
    integer(int64) :: ticks, rate

    call system_clock(ticks, rate)
    clock_time = real(ticks, dp) / rate
  end function clock_time

end module gestell_task_trade
