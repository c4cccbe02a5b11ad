!> Computes the factors of the monodromy matrix over segments of the period,
!>
!>     Phi(T) = A_K ... A_1,
!>
!> without multiplying them. The segments are so short that rounding errors do not destroy the strongly damped modes of a
!> factor. See "Factors" in doc/theory.md.
module gestell_floquet_factors
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: inverse
  use gestell_math_matrix, only: balanced, unit_matrix
  use gestell_floquet_period_convergence, only: begin_type, check_steps, next_steps, extrapolated_error, safety, detect_rounding
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_period_monodromy, only: accuracy_type, choose_method
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_floquet_period_turn_errors, only: relative_rounding
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: solve_factors

  !> Factors of a monodromy matrix in balanced units, x / scale. Errors are bounds in the Frobenius norm. n is the number of states,
  !> K the number of segments.
  type, public :: factors_type
    !> Period T (s)
    real(dp) :: period = 0
    !> Units of the states, shape (n): powers of two that make the states comparable.
    real(dp), allocatable :: scale(:)
    !> Ends of the segments as phases t / T, shape (0:K).
    real(dp), allocatable :: ends(:)
    !> `a`, `b`: map of each segment, x(end) = A x(start) + b, shapes (n, n, K) and (n, K). `error`, `b_error`: bounds on the errors
    !> of A and b, shapes (K).
    real(dp), allocatable :: a(:, :, :), b(:, :), error(:), b_error(:)
    !> Sum over all segments of the error bound of A relative to |A|.
    real(dp) :: relative_error = 0
    !> Phase advance of the fastest motion within the period (rad).
    real(dp) :: phase_advance = 0
    !> `steps`: number of steps of the final solution. `evaluations`: number of evaluations of the coefficients in all solutions
    !> together.
    integer :: steps = 0, evaluations = 0
    !> Ends of the steps as phases t / T, shape (steps + 1).
    real(dp), allocatable :: nodes(:)
    !> Integration method
    class(method_type), allocatable :: method
  end type factors_type

  !> A segment ends when |A| |A^-1| reaches this limit.
  real(dp), parameter :: max_spread = 30
  !> A segment also ends when the absolute value of ln |A| reaches this limit, so that squares neither underflow nor overflow.
  real(dp), parameter :: max_growth = 100
  !> Maximum number of steps that the division into segments tries.
  integer, parameter :: max_segments = 2**14

  !> Factors from one solution with a given number of steps. `size_a`: |A|. `size_b`: maximum of |b| within each segment.
  type :: level_type
    real(dp), allocatable :: nodes(:), a(:, :, :), b(:, :), size_a(:), size_b(:)
    integer :: steps = 0
  end type level_type

contains

  !> Computes the factors of `system` until the sum of their relative errors is at most the tolerance. The errors are estimated as
  !> in `solve_monodromy`. Fails if the equations are singular or the tolerance cannot be reached.
  subroutine solve_factors(system, accuracy, forced, factors, error, surveyed)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    !> If true, compute b too
    logical, intent(in) :: forced
    type(factors_type), intent(out) :: factors
    type(error_type), allocatable, intent(out) :: error
    !> Estimates from `survey_system`, if the caller already has them
    type(survey_type), intent(in), optional :: surveyed
    type(level_type) :: coarse, middle, fine
    real(dp), allocatable :: d12(:, :), d23(:, :), left(:, :), floor(:)
    type(begin_type) :: begin
    type(survey_type) :: survey
    real(dp) :: phase_advance
    integer :: steps
    logical :: rounding

    factors%period = system%period
    if (present(surveyed)) survey = surveyed
    if (.not. present(surveyed)) call survey_system(system, survey, error)
    if (allocated(error)) return
    factors%scale = survey%scale
    phase_advance = survey%phase_advance
    call choose_method(system, accuracy, survey_type(phase_advance, phase_advance), factors%method, error)
    if (allocated(error)) return
    associate (order => factors%method%order)
      call check_steps(3 * phase_advance / order, error)
      if (allocated(error)) return
      steps = max(system%least_steps, ceiling(1.5_dp * phase_advance / order))
      call divide(system, steps, factors, error)
      if (.not. allocated(error)) call solve_level(system, steps, forced, factors, coarse, error)
      if (.not. allocated(error)) call solve_level(system, 2 * steps, forced, factors, middle, error)
      if (allocated(error)) return
      d12 = distances(coarse, middle, forced)
      do
        ! Distribute the rounding error of the whole period over the segments.
        floor = spread(relative_rounding(system, middle%steps, phase_advance) / size(d12, 1), 1, size(d12, 1))
        steps = next_steps(coarse%steps, middle%steps, maxval(sum(d12, dim=1)), order, max(accuracy%tolerance, sum(floor)))
        call check_steps(real(steps, dp), error)
        if (.not. allocated(error)) call solve_level(system, steps, forced, factors, fine, error)
        if (allocated(error)) return
        d23 = distances(middle, fine, forced)
        left = extrapolated_error(d12, d23, coarse%steps, middle%steps, fine%steps, order)
        if (all(sum(safety * left, dim=1) + sum(floor) <= accuracy%tolerance .or. &
          & sum(d23, dim=1) <= sum(floor) + [0.0_dp, system%load_rounding])) exit
        call detect_rounding(sum(d23, dim=1), fine%steps, max(accuracy%tolerance, sum(floor)), begin, rounding)
        if (rounding) then
          left(:, 2) = max(left(:, 2), d12(:, 2), d23(:, 2))
          exit
        end if
        coarse = middle
        middle = fine
        d12 = d23
      end do
    end associate
    floor = spread(relative_rounding(system, fine%steps, phase_advance) / size(left, 1), 1, size(left, 1))
    factors%relative_error = sum(safety * left(:, 1) + floor)
    factors%error = (safety * left(:, 1) + floor) * fine%size_a
    factors%b_error = (safety * left(:, 2) + floor + system%load_rounding) * fine%size_b
    factors%steps = fine%steps
    factors%phase_advance = phase_advance
    call move_alloc(fine%nodes, factors%nodes)
    call move_alloc(fine%a, factors%a)
    call move_alloc(fine%b, factors%b)
  end subroutine solve_factors

  !> Divides the period into segments. It uses at least `steps` steps and doubles their number until no single step exceeds the
  !> limit on |A| |A^-1|.
  subroutine divide(system, steps, factors, error)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: steps
    type(factors_type), intent(inout) :: factors
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: nodes(:), maps(:, :, :), product(:, :)
    logical :: too_long
    integer :: number, k

    allocate(maps(1, system%states, system%states))
    number = steps
    do
      nodes = mesh(system, number)
      factors%evaluations = factors%evaluations + (size(nodes) - 1) * factors%method%stages
      factors%ends = [0.0_dp]
      product = unit_matrix(system%states)
      too_long = .false.
      do k = lbound(nodes, 1), ubound(nodes, 1) - 1
        call factors%method%maps(system, nodes(k:k), nodes(k + 1:k + 1), maps, error)
        if (allocated(error)) return
        product = matmul(balanced(maps(1, :, :), factors%scale), product)
        if (condition_of(product) < max_spread .and. abs(log(max(norm2(product), tiny(1.0_dp)))) < max_growth) cycle
        if (condition_of(balanced(maps(1, :, :), factors%scale)) >= max_spread) too_long = .true.
        if (nodes(k + 1) < 1) factors%ends = [factors%ends, nodes(k + 1)]
        product = unit_matrix(system%states)
      end do
      if (.not. too_long .or. 2 * number > max_segments) exit
      number = 2 * number
    end do
    factors%ends = [factors%ends, 1.0_dp]
  end subroutine divide

  !> |A| |A^-1|, the condition number of `a`; huge if `a` is singular.
  real(dp) function condition_of(a)
    real(dp), intent(in) :: a(:, :)
    real(dp), allocatable :: inverted(:, :)
    type(error_type), allocatable :: singular

    condition_of = huge(condition_of)
    call inverse(a, inverted, singular)
    if (.not. allocated(singular)) condition_of = norm2(a) * norm2(inverted)
  end function condition_of

  !> Computes the factors with at least `steps` steps. Slightly more may be needed, because every end of a segment must be an end of
  !> a step.
  subroutine solve_level(system, steps, forced, factors, level, error)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: steps
    logical, intent(in) :: forced
    type(factors_type), intent(inout) :: factors
    type(level_type), intent(out) :: level
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: block_length = 256
    real(dp), allocatable :: maps(:, :, :)
    integer :: n, count, segment, first, last, k

    n = system%states
    count = size(factors%ends) - 1
    level%nodes = mesh(system, steps, factors%ends(2:count))
    level%steps = size(level%nodes) - 1
    allocate(level%a(n, n, count), level%b(n, count), level%size_b(count), source=0.0_dp)
    allocate(maps(block_length, n, merge(n + 1, n, forced)))
    level%a = spread(unit_matrix(n), 3, count)
    segment = 1
    do first = 1, level%steps, block_length
      last = min(first + block_length - 1, level%steps)
      associate (from => level%nodes(first:last), to => level%nodes(first + 1:last + 1))
        call factors%method%maps(system, from, to, maps, error)
        if (allocated(error)) return
        do k = 1, size(from)
          associate (map => balanced(maps(k, :, :n), factors%scale))
            level%a(:, :, segment) = matmul(map, level%a(:, :, segment))
            if (forced) level%b(:, segment) = matmul(map, level%b(:, segment)) + maps(k, :, n + 1) / factors%scale
          end associate
          level%size_b(segment) = max(level%size_b(segment), norm2(level%b(:, segment)))
          if (to(k) >= factors%ends(segment + 1)) segment = segment + 1
        end do
      end associate
    end do
    level%size_a = [(norm2(level%a(:, :, k)), k = 1, count)]
    factors%evaluations = factors%evaluations + level%steps * factors%method%stages
  end subroutine solve_level

  !> Norms of the differences between solutions `one` and `other`, relative to `other`; shape (K, 2). Column 1 is for the matrices
  !> A, column 2 for the vectors b.
  pure function distances(one, other, forced) result(d)
    type(level_type), intent(in) :: one, other
    logical, intent(in) :: forced
    real(dp), allocatable :: d(:, :)
    integer :: k

    allocate(d(size(one%size_a), 2), source=0.0_dp)
    do k = 1, size(d, 1)
      d(k, 1) = norm2(one%a(:, :, k) - other%a(:, :, k)) / other%size_a(k)
      if (forced .and. other%size_b(k) > 0) d(k, 2) = norm2(one%b(:, k) - other%b(:, k)) / other%size_b(k)
    end do
  end function distances

end module gestell_floquet_factors
