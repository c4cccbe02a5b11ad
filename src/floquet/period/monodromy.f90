!> Computes the monodromy matrix Phi(T) to a requested accuracy, with bounds on its error.
module gestell_floquet_period_monodromy
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: factorise, solve_factored
  use gestell_math_matrix, only: balanced, unit_matrix
  use gestell_base_text, only: text
  use gestell_floquet_period_convergence, only: begin_type, check_steps, detect_rounding, pair_errors, unresolved_errors, &
    & more_steps, next_steps, predicted_reduction, extrapolated_error, safety
  use gestell_floquet_period_embedded_error, only: compare_pair, extrapolate, pair_type
  use gestell_floquet_period_trial, only: distance, level_type, roundoff, solve_level
  use gestell_floquet_period_period_map, only: period_map_type, segments_type
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_cheapest, only: cheapest_method
  use gestell_floquet_choice_methods, only: new_method
  use gestell_floquet_choice_prediction, only: first_steps, rounded_steps
  use gestell_floquet_period_liouville, only: defect_of
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: conserved_form, has_positions
  implicit none (type, external)
  private

  public :: check_accuracy, choose_method, solve_monodromy

  !> Requested accuracy
  type, public :: accuracy_type
    !> Allowed relative error of Phi(T) and x_p(T)
    real(dp) :: tolerance = 1.0e-9_dp
    !> Name of the integration method, one of `method_names()`. An unallocated name means `auto`. `solve_floquet` also accepts
    !> 'reduced'.
    character(len=:), allocatable :: method
    !> Number of steps per period. The value 0 means as many steps as the tolerance requires
    integer :: steps = 0
  end type accuracy_type

  !> Phi(T) and x_p(T) with bounds on their errors. The norm of a vector is the norm of x / scale. The norm of a matrix is the
  !> Frobenius norm of the scaled matrix.
  type, public :: monodromy_type
    !> Period T
    real(dp) :: period = 0
    !> Phi(T), shape (n, n)
    real(dp), allocatable :: phi(:, :)
    !> State x_p(T) of the forced motion that starts from zero, shape (n); unallocated unless requested
    real(dp), allocatable :: xp(:)
    !> Units of the states, shape (n): powers of two that make the states comparable
    real(dp), allocatable :: scale(:)
    !> `norm`: norm of Phi(T). `error`: bound on the norm of its error. `xp_error`: bound on the norm of the error of x_p(T).
    real(dp) :: norm = 0, error = 0, xp_error = 0
    !> Parts of `error` and `xp_error` of which only a bound on the norm is known. They come from roundoff and from variations of
    !> coefficients and loads between the nodes, which embedded methods do not reveal
    real(dp) :: roundoff = 0, xp_roundoff = 0
    !> Two estimates, multiplied by the safety factor, of the integration error of each element of Phi(T) and x_p(T); shapes (n, n,
    !> 2) and (n, 2). Unallocated if only norms of the errors are known.
    real(dp), allocatable :: phi_change(:, :, :), xp_change(:, :)
    !> Maps of segments of the period; empty unless x_p(T) was computed
    type(segments_type) :: segments
    !> Matrix Omega of a system that conserves energy, shape (n, n): the exact Phi(T) satisfies Phi' Omega Phi = Omega. Unallocated
    !> for other systems.
    real(dp), allocatable :: form(:, :)
    !> False if comparing solutions with different numbers of steps gives no information on the error of Phi(T) (`known`) or x_p(T)
    !> (`xp_known`). In this case `error` or `xp_error` is not a bound.
    logical :: known = .true., xp_known = .true.
    !> Factor by which a rounding error can grow within the period, relative to Phi(T). It is far above 1 if Phi(t) first grows and
    !> then falls
    real(dp) :: transient_growth = 1
    !> Phase advance (radians) of the fastest motion within the period
    real(dp) :: phase_advance = 0
    !> `steps`: number of steps of the result. `evaluations`: number of evaluations of the coefficients in all solutions together.
    integer :: steps = 0, evaluations = 0
    !> True if there is no result because the computation of a step or the product of the steps failed, for instance by overflow
    logical :: broken = .false.
    !> Ends of the steps, as phases t / T
    real(dp), allocatable :: nodes(:)
    !> The integration method that was used
    class(method_type), allocatable :: method
  contains
    procedure :: liouville_defect, loses_modes
  end type monodromy_type

  !> Maximum number of steps that a user may request
  integer, parameter :: max_given = 2**20

contains

  !> Computes Phi(T) of `system`, and x_p(T) if `forced`, to the requested accuracy, with bounds on their errors.
  !>
  !> The error is estimated from solutions of the system itself. If the method has embedded methods, its result is compared with
  !> theirs (gestell_floquet_period_embedded_error). Otherwise solutions with three numbers of steps N1 < N2 < N3 are compared:
  !>
  !>     d12 = |Phi_1 - Phi_2|,   d23 = |Phi_2 - Phi_3|,
  !>     (N1^-p - N2^-p) / (N2^-p - N3^-p) = d12 / d23,   p <= order,
  !>     error of Phi_3 = u max(d23 c / (1 - c), d12 (N1 / N3)^order),   c = (N2 / N3)^p.
  !>
  !> p is the observed order, and u the margin for uneven convergence of methods of high order. If the user gives `steps`, the
  !> result is compared with solutions with `steps` / 2 and 2 `steps` steps; see `monodromy%known`.
  !>
  !> Fails if the system (`check`) or the accuracy is invalid, the method is unknown, the equations are singular, a number
  !> overflows, or the tolerance cannot be reached.
  subroutine solve_monodromy(system, accuracy, forced, monodromy, error, surveyed)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    !> If true, compute x_p(T) too
    logical, intent(in) :: forced
    !> Phi(T) and x_p(T) with bounds on their errors
    type(monodromy_type), intent(out) :: monodromy
    type(error_type), allocatable, intent(out) :: error
    !> Estimates from `survey_system`, if the caller already has them
    type(survey_type), intent(in), optional :: surveyed
    type(survey_type) :: survey

    call system%check(error)
    if (.not. allocated(error)) call check_accuracy(accuracy, error)
    if (allocated(error)) return
    monodromy%period = system%period
    if (present(surveyed)) survey = surveyed
    if (.not. present(surveyed)) call survey_system(system, survey, error, forced)
    if (.not. allocated(error)) call choose_method(system, accuracy, survey, monodromy%method, error)
    if (allocated(error)) return
    monodromy%scale = survey%scale
    call conserved_form(system, monodromy%form)
    if (accuracy%steps > 0) then
      call with_given_steps(system, accuracy%steps, forced, survey%phase_advance, monodromy, error)
    else if (monodromy%method%lower_order > 0) then
      call by_pair(system, accuracy, forced, survey, monodromy, error)
    else
      call with_tolerance(system, accuracy%tolerance, forced, survey%phase_advance, monodromy, error)
    end if
  end subroutine solve_monodromy

  !> Checks the requested accuracy. Fails if the tolerance or the number of steps is out of range.
  pure subroutine check_accuracy(accuracy, error)
    type(accuracy_type), intent(in) :: accuracy
    type(error_type), allocatable, intent(out) :: error

    if (.not. (accuracy%tolerance > 0 .and. accuracy%tolerance < 1)) then
      call fatal_error(error, "the tolerance must be greater than 0 and less than 1", invalid_input)
    else if (accuracy%steps < 0 .or. accuracy%steps > max_given) then
      call fatal_error(error, "the number of steps must lie between 0 and " // text(max_given), invalid_input)
    end if
  end subroutine check_accuracy

  !> Creates the requested method. `auto` means the cheapest method for this system or, if the number of steps is given, gauss6.
  !> Fails if the name of the method is unknown.
  subroutine choose_method(system, accuracy, survey, method, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    type(survey_type), intent(in) :: survey
    class(method_type), allocatable, intent(out) :: method
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: name

    name = "auto"
    if (allocated(accuracy%method)) name = accuracy%method
    if (name == "auto" .and. accuracy%steps == 0) then
      call cheapest_method(system, survey, accuracy%tolerance, method)
    else
      call new_method(name, method, error)
    end if
  end subroutine choose_method

  !> Computes a solution with N steps and estimates its error from solutions with N/2 and 2 N steps.
  !>
  !> The error counts as unknown if the method does not converge yet. This is assumed in three cases:
  !>
  !> - the differences between the solutions are not small and do not decrease,
  !> - the error bound exceeds Phi(T), or the largest x_p(t), itself,
  !> - a relative difference exceeds 0.01, and in each step the phase of the fastest motion advances by more radians than the
  !>   order of the method: such differences may be small only by chance.
  subroutine with_given_steps(system, steps, forced, phase_advance, monodromy, error)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: steps
    logical, intent(in) :: forced
    real(dp), intent(in) :: phase_advance
    type(monodromy_type), intent(inout) :: monodromy
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: small = 1.0e-6_dp, hundredth = 0.01_dp, whole = 1, unknown_change = 1 / epsilon(1.0_dp)
    logical :: unknown_error(2)
    type(level_type) :: coarser, level, finer
    real(dp) :: before(2), change(2)

    call solve_trial(system, max(1, steps / 2), forced, monodromy, coarser, error)
    if (.not. allocated(error)) call solve_trial(system, steps, forced, monodromy, level, error)
    if (.not. allocated(error)) call solve_trial(system, 2 * steps, forced, monodromy, finer, error)
    if (allocated(error)) return
    ! The differences are relative to `level`, which becomes the result: the finer solution can be larger.
    before = distance(coarser, level, monodromy%scale)
    change = distance(finer, level, monodromy%scale)
    unknown_error = (change > small .and. 2 * change > before) .or. .not. safety * change < whole &
      & .or. (change > hundredth .and. phase_advance > real(monodromy%method%order, dp) * steps)
    monodromy%known = .not. unknown_error(1)
    monodromy%xp_known = .not. unknown_error(2)
    where (unknown_error) change = unknown_change
    if (.not. any(unknown_error)) call estimate_changes(monodromy, level, finer, [safety, safety], coarser, &
      & spread(safety * predicted_reduction(coarser%steps, level%steps, monodromy%method%order), 1, 2))
    call store_result(system, level, safety * change, phase_advance, monodromy)
  end subroutine with_given_steps

  !> Computes a solution by a method with embedded methods. The number of steps increases until the error is at most the tolerance
  !> or the rounding error.
  subroutine by_pair(system, accuracy, forced, survey, monodromy, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(in) :: forced
    type(survey_type), intent(in) :: survey
    type(monodromy_type), intent(inout) :: monodromy
    type(error_type), allocatable, intent(out) :: error
    type(level_type) :: level
    type(period_map_type) :: lower(2)
    type(begin_type) :: begin
    type(pair_type) :: pair
    real(dp) :: left(2), unresolved(2), floor, steps, angle
    logical :: rounding

    steps = first_steps(monodromy%method, system, survey, accuracy%tolerance)
    do
      call check_steps(steps, error)
      if (.not. allocated(error)) call solve_trial(system, nint(steps), forced, monodromy, level, error, lower)
      if (allocated(error)) return
      angle = survey%fastest / level%steps
      call compare_pair(level, lower, monodromy%scale, angle, level%unresolved%fitted / max(level%unresolved%steps, 1), &
        & has_positions(system), pair)
      left = pair_errors(pair%change, pair%next, pair%rest, pair%missed)
      unresolved = unresolved_errors(level%unresolved, monodromy%scale, level%xp_peak, angle, level%stages)
      floor = roundoff(system, level, survey%phase_advance)
      if (all(safety * (left + unresolved) + floor <= accuracy%tolerance &
        & .or. max(pair%change, unresolved) <= floor + [0.0_dp, system%load_rounding])) exit
      call detect_rounding(max(pair%change, unresolved), level%steps, max(accuracy%tolerance, floor), begin, rounding)
      if (rounding) then
        left = max(left, pair%change)
        exit
      end if
      steps = rounded_steps(monodromy%method, system, more_steps(level%steps, maxval(left + unresolved), monodromy%method%order, &
        & max(accuracy%tolerance, floor)))
    end do
    call extrapolate(lower, pair%q)
    call estimate_changes(monodromy, level, lower(2), safety * left / max(pair%rest, pair%change / 50, tiny(left)), &
      & lower(1), safety * left / max(pair%change, tiny(left)))
    call store_result(system, level, safety * left, survey%phase_advance, monodromy, safety * unresolved)
  end subroutine by_pair

  !> Computes a solution by a method without embedded methods. Solutions with three numbers of steps are compared. The numbers
  !> increase until the error is at most the tolerance or the rounding error.
  subroutine with_tolerance(system, tolerance, forced, phase_advance, monodromy, error)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: tolerance, phase_advance
    logical, intent(in) :: forced
    type(monodromy_type), intent(inout) :: monodromy
    type(error_type), allocatable, intent(out) :: error
    type(level_type) :: coarse, middle, fine
    real(dp) :: d12(2), d23(2), left(2), floor
    type(begin_type) :: begin
    integer :: steps
    logical :: rounding

    ! A method of order p begins to converge where the phase of the fastest motion advances by about p / 3 radians in a step. The
    ! middle solution has this step.
    call check_steps(3 * phase_advance / monodromy%method%order, error)
    if (allocated(error)) return
    steps = max(system%least_steps, ceiling(1.5_dp * phase_advance / monodromy%method%order))
    call solve_trial(system, steps, forced, monodromy, coarse, error)
    if (.not. allocated(error)) call solve_trial(system, 2 * steps, forced, monodromy, middle, error)
    if (allocated(error)) return
    d12 = distance(coarse, middle, monodromy%scale)

    do
      floor = roundoff(system, middle, phase_advance)
      steps = next_steps(coarse%steps, middle%steps, maxval(d12), monodromy%method%order, max(tolerance, floor))
      call check_steps(real(steps, dp), error)
      if (.not. allocated(error)) call solve_trial(system, steps, forced, monodromy, fine, error)
      if (allocated(error)) return
      d23 = distance(middle, fine, monodromy%scale)
      left = extrapolated_error(d12, d23, coarse%steps, middle%steps, fine%steps, monodromy%method%order)
      if (all(safety * left + floor <= tolerance .or. d23 <= floor + [0.0_dp, system%load_rounding])) exit
      call detect_rounding(d23, fine%steps, max(tolerance, floor), begin, rounding)
      if (rounding) then
        left(2) = max(left(2), d12(2), d23(2))
        exit
      end if
      coarse = middle
      middle = fine
      d12 = d23
    end do
    call estimate_changes(monodromy, fine, middle, &
      & spread(safety * maxval([0.0_dp, pack(left, d23 > 0) / pack(d23, d23 > 0)]), 1, 2), coarse, &
      & spread(safety * predicted_reduction(coarse%steps, fine%steps, monodromy%method%order), 1, 2))
    call store_result(system, fine, safety * left, phase_advance, monodromy)
  end subroutine with_tolerance

  !> Stores two estimates of the errors of Phi(T) and x_p(T) of the solution `level`, element by element. Each estimate is the
  !> difference between another solution and `level`, times a factor. The elements contain more information than their norm:
  !> errors of slow modes and of the periodic motion are smaller than those of the fastest mode.
  pure subroutine estimate_changes(monodromy, level, first, first_factor, second, second_factor)
    type(monodromy_type), intent(inout) :: monodromy
    class(period_map_type), intent(in) :: level, first, second
    real(dp), intent(in) :: first_factor(2), second_factor(2)

    allocate(monodromy%phi_change(size(level%phi, 1), size(level%phi, 2), 2))
    monodromy%phi_change(:, :, 1) = max(first_factor(1), 0.0_dp) * (first%phi - level%phi)
    monodromy%phi_change(:, :, 2) = second_factor(1) * (second%phi - level%phi)
    if (.not. allocated(level%xp)) return
    allocate(monodromy%xp_change(size(level%xp), 2))
    monodromy%xp_change(:, 1) = max(first_factor(2), 0.0_dp) * (first%xp - level%xp)
    monodromy%xp_change(:, 2) = second_factor(2) * (second%xp - level%xp)
  end subroutine estimate_changes

  !> Calls `solve_level` and adds the number of evaluations of the coefficients to the total.
  subroutine solve_trial(system, steps, forced, monodromy, level, error, lower)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: steps
    logical, intent(in) :: forced
    type(monodromy_type), intent(inout) :: monodromy
    type(level_type), intent(out) :: level
    type(error_type), allocatable, intent(out) :: error
    type(period_map_type), intent(out), optional :: lower(:)

    call solve_level(system, monodromy%method, monodromy%scale, steps, forced, level, error, lower, monodromy%segments)
    monodromy%broken = allocated(error)
    if (.not. allocated(error)) monodromy%evaluations = monodromy%evaluations + level%steps * monodromy%method%stages
  end subroutine solve_trial

  !> Stores `level` as the result. `errors`: relative integration errors of Phi(T) and x_p(T). `unresolved`: additional relative
  !> errors due to variations of coefficients and loads between the nodes.
  subroutine store_result(system, level, errors, phase_advance, monodromy, unresolved)
    class(periodic_system), intent(in) :: system
    type(level_type), intent(inout) :: level
    real(dp), intent(in) :: errors(2), phase_advance
    type(monodromy_type), intent(inout) :: monodromy
    real(dp), intent(in), optional :: unresolved(2)

    ! Squares below tiny vanish in a norm, so the absolute error of Phi(T) is at least sqrt(tiny).
    monodromy%roundoff = roundoff(system, level, phase_advance) * level%norm + sqrt(tiny(1.0_dp))
    if (present(unresolved)) monodromy%roundoff = monodromy%roundoff + unresolved(1) * level%norm
    monodromy%norm = level%norm
    monodromy%error = errors(1) * level%norm + monodromy%roundoff
    monodromy%xp_roundoff = (roundoff(system, level, phase_advance) + system%load_rounding) * level%xp_peak
    if (allocated(level%xp)) then
      if (any(abs(level%xp) > 0)) monodromy%xp_roundoff = monodromy%xp_roundoff + sqrt(tiny(1.0_dp))
    end if
    if (present(unresolved)) monodromy%xp_roundoff = monodromy%xp_roundoff + unresolved(2) * level%xp_peak
    monodromy%xp_error = errors(2) * level%xp_peak + monodromy%xp_roundoff
    monodromy%steps = level%steps
    monodromy%phase_advance = phase_advance
    monodromy%transient_growth = level%transient_growth
    call move_alloc(level%nodes, monodromy%nodes)
    call move_alloc(level%phi, monodromy%phi)
    call move_alloc(level%xp, monodromy%xp)
  end subroutine store_result

  !> Computes ln |det Phi(T)| minus the integral of tr P for a solved system. By Liouville's theorem this difference is zero. Fails
  !> if P is not finite at some phase.
  subroutine liouville_defect(self, system, defect, error)
    class(monodromy_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(out) :: defect
    type(error_type), allocatable, intent(out) :: error

    call defect_of(system, self%steps, reshape(self%phi, [shape(self%phi), 1]), defect, error)
  end subroutine liouville_defect

  !> True if the error of Phi(T) is too large for its smallest multipliers, because |Phi| |Phi^-1| or the transient growth reaches
  !> `max_spread`. Factors of Phi(T) are then required (gestell_floquet_factors).
  !>
  !> The determinant gives a cheap first test. For |Phi| = 1 the smallest singular value is at least |det Phi| (n - 1)^((n - 1) /
  !> 2), because the product of the other singular values is largest if they are equal.
  logical function loses_modes(self)
    class(monodromy_type), intent(in) :: self
    real(dp), parameter :: max_spread = 1.0e4_dp
    real(dp), dimension(size(self%scale), size(self%scale)) :: lu, inverted
    type(error_type), allocatable :: singular
    real(dp) :: least
    integer :: pivots(size(self%scale)), n, i

    loses_modes = .true.
    if (self%transient_growth >= max_spread) return
    ! Squares below tiny vanish in a norm.
    if (self%norm < sqrt(tiny(1.0_dp)) / epsilon(1.0_dp)) return
    n = size(self%scale)
    lu = balanced(self%phi, self%scale) / self%norm
    call factorise(lu, pivots, singular)
    if (allocated(singular)) return
    least = (n - 1) / 2.0_dp * log(max(real(n - 1, dp), 1.0_dp)) + sum([(log(abs(lu(i, i))), i = 1, n)])
    loses_modes = .not. log(real(n, dp)) / 2 - log(max_spread) < least
    if (.not. loses_modes) return
    inverted = unit_matrix(n)
    call solve_factored(lu, pivots, inverted)
    loses_modes = norm2(inverted) >= max_spread
  end function loses_modes

end module gestell_floquet_period_monodromy
