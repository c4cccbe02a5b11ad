!> Newton's method for the periodic vibration of the exact frame (doc/theory.md, equation 36). A step goes from a periodic motion
!> q_k to q_k+1, the periodic motion of the frame linearised about q_k (gestell_model_exact_varied_frame). Only the difference q_k+1
!> - q_k is computed, from the residual of q_k. A fast, coarse solver is enough, because its errors are relative to this difference.
module gestell_study_frame_model_newton
  use gestell_base_error, only: error_type, failed_computation, fatal_error, no_convergence
  use gestell_base_kinds, only: dp
  use gestell_math_series_trigonometric, only: series_through, series_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_period_quick_motion, only: quick_motion_type, solve_quickly
  use gestell_floquet_solution, only: floquet_type, follow, solve_floquet, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_floquet_balance_harmonic_balance, only: balance_harmonics, balance_type
  use gestell_system_corrected, only: corrected_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: iterate, with_min_tolerance, next_motion, too_rough, values_of

  !> Tolerance for a vibration that only serves as the start of a search.
  real(dp), parameter, public :: rough = 1.0e-6_dp
  !> Maximum number of steps of Newton's method.
  integer, parameter :: max_steps = 12
  !> `max_step`: a step larger than this fraction of the motion shows that the start was bad. `all_error`: a motion with a larger
  !> relative error is useless.
  real(dp), parameter :: max_step = 0.5_dp, all_error = 0.5_dp
  !> The method has converged if the next step is expected to be smaller than this fraction of the tolerance.
  real(dp), parameter :: part_left = 0.1_dp
  !> Relative errors allowed for fast solvers. `of_step`: for the start and for a normal step. `of_last_step`: for a step that only
  !> confirms convergence.
  real(dp), parameter :: of_step = 1.0e-3_dp, of_last_step = 0.1_dp
  !> Number of samples of a motion at the start of a search.
  integer, parameter, public :: first_samples = 64
  !> Minimum and maximum number of samples of a motion.
  integer, parameter :: min_samples = 48, max_samples = 2**12
  !> Maximum number of samples of an intermediate motion, unless the step is small. Intermediate motions that need more samples
  !> usually lead away from the vibration.
  integer, parameter :: max_passed = 512
  !> A step of Newton's method counts as small if it is below this fraction of the motion.
  real(dp), parameter :: small_step = 0.1_dp
  !> If a motion needs more phases than this, integration is faster than harmonic balance.
  integer, parameter :: max_balanced = 128
  !> Sizes of harmonics relative to the motion. `resolved`: a motion counts as resolved if its highest orders are smaller than this.
  !> `noise`: harmonics smaller than this are rounding errors and are dropped.
  real(dp), parameter :: resolved = 1.0e-12_dp, noise = 1.0e-14_dp

  !> A periodic motion computed by `next_motion`.
  type, public :: next_type
    !> `q`: the motion at equidistant phases, shape (samples, dofs). `scale`: units that make the states comparable, shape (states)
    real(dp), allocatable :: q(:, :), scale(:)
    !> Fourier series that interpolates the samples
    type(series_type) :: series
    !> `size`: size of the motion in units of `scale`. `step`: change from the previous motion, relative to the motion. `error`:
    !> estimated relative error
    real(dp) :: size = 0, step = 0, error = 0
    !> Data of harmonic balance that are used again for the next motion
    type(balance_type) :: balance
    !> Data of the fast integration that are used again for the next motion
    type(quick_motion_type) :: quick
    !> Truncation error of a fast solver, relative to what it computed: either the motion, or its change from the previous motion
    real(dp) :: truncation = 0
    !> True if a fast solver (harmonic balance or fast integration) was used
    logical :: quickly = .false.
    !> Relative error allowed for fast solvers (harmonic balance and fast integration)
    real(dp) :: of_step = of_step
    !> True for an intermediate motion of Newton's method. It may remain unresolved at its maximum number of samples
    logical :: intermediate = .false.
    !> True if only harmonic balance and fast integration may be used, because a full solution is not worth its cost
    logical :: only_quickly = .false.
  end type next_type

contains

  !> Applies Newton's method. It starts from the motion about which `varied` is linearised, and uses the excitation of `varied`.
  !> Fails if `solve_floquet` or `solve_periodic` fails, or if the method does not converge.
  subroutine iterate(frame, accuracy, linear, varied, steps, error, quickly)
    !> The frame linearised about rest
    class(frame_type), intent(in), target :: frame
    type(accuracy_type), intent(in) :: accuracy
    !> If true, solve the equations linearised about rest instead of the exact equations
    logical, intent(in) :: linear
    !> On entry the frame linearised about the start of the iteration, or about rest. On return the frame linearised about the
    !> vibration
    type(varied_frame_type), intent(inout) :: varied
    !> Relative steps |q_k+1 - q_k|/|q_k+1|. The first step starts from the linear vibration or from the motion of `varied`
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    !> True if a fast solver (harmonic balance or fast integration) computed the last step
    logical, intent(out), optional :: quickly
    type(accuracy_type) :: order
    type(next_type) :: next
    type(varied_frame_type) :: lack
    real(dp) :: units(frame%dofs()), step, before, left, missed
    integer :: first, k, samples
    logical :: astray

    allocate(steps(0))
    first = merge(1, 0, any(abs(varied%motion%cosine) > 0 .or. abs(varied%motion%sine) > 0))
    before = 1
    ! A linear system needs only one step.
    if (linear) next%of_step = part_left * accuracy%tolerance
    do k = first, max_steps
      samples = 2 * ubound(varied%motion%cosine, 1) + 2
      order = accuracy
      if (k == 0 .and. .not. linear) order = with_min_tolerance(accuracy, rough)
      if (k == 0) then
        call next_motion(frame, frame, order, samples, next, error)
      else if (linear) then
        call next_motion(frame, frame, order, samples, next, error, varied%motion, &
          & corrected_system(frame, varied%motion, frame%free))
      else
        lack = varied
        lack%lacking = .true.
        ! While the steps are large, the motion is far from a vibration, and failures to compute it say nothing about the machine.
        astray = .not. before < max_step
        next%intermediate = astray
        next%only_quickly = astray .and. k > 1 .and. next%quickly
        call next_motion(frame, varied, order, samples, next, error, varied%motion, lack)
        if (astray .and. allocated(error)) exit
        if (.not. allocated(error)) then
          if (.not. next%step < small_step .and. too_rough(frame, next)) exit
        end if
      end if
      if (present(quickly)) quickly = next%quickly
      if (allocated(error)) return
      step = next%step
      if (k > 0) steps = [steps, step]
      missed = next%truncation
      ! Drops harmonics that are smaller than rounding errors, than the error of the motion, or than the fraction of the tolerance
      ! that remains for further steps.
      units = 0
      units(frame%free) = next%scale(:size(frame%free))
      call next%series%trim(units, max(noise, next%error / 100, part_left * accuracy%tolerance / 100, missed * step / 100) &
        & * next%size)
      call varied%linearise_about(next%series)
      ! Estimates the size of the steps still to come. Each step is assumed to shrink by at least the ratio of the last two steps,
      ! for a linear system by the truncation error of the fast solver. If the motion consists only of error, further steps do not
      ! help.
      left = step
      if (step < before) left = step * min(1.0_dp, max(step / before, missed))
      if (linear .and. next%quickly) left = step * missed
      next%of_step = min(of_last_step, max(of_step, part_left * accuracy%tolerance / max(left, tiny(left))))
      if ((k > 0 .or. linear) .and. (left <= max(part_left * accuracy%tolerance, next%error) .or. next%error >= all_error)) then
        call add_rounding(frame, next%scale, next%error + 2 * merge(left, 0.0_dp, left < 1), varied)
        return
      end if
      if (.not. step < max_step .and. k > 2) exit
      before = step
    end do
    if (present(quickly)) quickly = next%quickly
    call fatal_error(error, "Newton's method did not converge", failed_computation)
    error%cause = no_convergence
  end subroutine iterate

  !> Computes the periodic motion of `system` at enough equidistant phases to resolve it. Harmonic balance and fast integration are
  !> tried first. If they do not work, the system is solved to `accuracy`; this fails if `solve_floquet` or `solve_periodic` fails.
  !> Fails also if the fast solvers do not work and no others are allowed.
  subroutine next_motion(frame, system, accuracy, samples, next, error, from, lack, floquet)
    !> `frame`: the frame linearised about rest. `system`: the frame whose motion is computed
    class(frame_type), intent(in) :: frame
    class(frame_type), intent(in), target :: system
    type(accuracy_type), intent(in) :: accuracy
    !> Minimum number of samples of the motion
    integer, intent(in) :: samples
    !> The computed motion. On entry it may hold the motion of a similar system
    type(next_type), intent(inout) :: next
    type(error_type), allocatable, intent(out) :: error
    !> A known motion, given together with the system `lack`. The computed motion is then `from` plus the periodic motion of
    !> `lack`. The fast solvers compute only this change, and their errors are relative to it
    type(series_type), intent(in), optional :: from
    class(second_order_system), intent(in), optional, target :: lack
    !> Full solution of the system, with error bounds. It is computed only if this argument is present
    type(floquet_type), intent(inout), optional :: floquet
    type(floquet_type) :: solved
    !> The system that the fast solvers solve
    class(second_order_system), pointer :: to_solve
    real(dp), allocatable :: change(:, :), beyond(:)
    real(dp) :: unresolved
    integer :: n
    logical :: balances

    to_solve => system
    if (present(lack)) to_solve => lack

    ! With fewer samples, high orders would appear as low orders. A coefficient of order k sets `least_steps` to about 2 pi k.
    n = max(min_samples, min(frame%least_steps / 2, max_samples / 2))
    balances = .not. (present(floquet) .or. next%quick%keeps)
    do
      ! The Fourier transform is fast for multiples of 16, and harmonic balance requires them.
      n = 16 * ((max(n, samples) + 15) / 16)
      next%quickly = balances .and. n <= max_balanced
      if (next%quickly) then
        call balance(frame, to_solve, n, next, change, next%quickly, from)
        if (.not. next%quickly .and. next%balance%left_out > next%of_step / 2 .and. 2 * n <= max_balanced) then
          n = 2 * n
          cycle
        end if
        ! Near a resonance with almost no damping, the fast integration estimates its rounding error better than harmonic balance.
        next%quickly = next%quickly .and. next%error <= max(part_left * accuracy%tolerance, frame%load_rounding)
      end if
      if (.not. next%quickly .and. .not. present(floquet)) call integrate(frame, to_solve, n, next, change, next%quickly, from)
      if (.not. next%quickly .and. next%only_quickly) then
        call fatal_error(error, "harmonic balance and order reduction cannot compute this motion", failed_computation)
        return
      end if
      if (.not. next%quickly) then
        call solve_fully(frame, system, accuracy, n, solved, next, error)
        if (allocated(error)) return
        change = next%q
        if (present(from)) change = change - values_of(from, n)
      end if
      next%size = size_of(frame, next%scale, next%q)
      next%step = size_of(frame, next%scale, change) / max(next%size, tiny(next%size))
      beyond = next%series%beyond()
      unresolved = maxval(beyond(frame%free) / next%scale(:size(frame%free))) / max(next%size, tiny(unresolved))
      if (unresolved <= max(resolved, accuracy%tolerance / 100, next%error / 100, &
        & merge(next%of_step / 100, 0.0_dp, next%quickly .and. .not. present(lack))) .or. 2 * n > max_samples &
        & .or. next%error >= all_error .or. (next%intermediate .and. n > max_intermediate_samples(frame))) exit
      n = merge(first_samples, 2 * n, n < first_samples)
    end do
    next%error = max(next%error, unresolved)
    if (present(floquet)) floquet = solved
  end subroutine next_motion

  !> Maximum number of samples of an intermediate motion of Newton's method. It is larger if the coefficients alone need many
  !> samples.
  pure integer function max_intermediate_samples(frame)
    class(frame_type), intent(in) :: frame

    max_intermediate_samples = max(max_passed, min(2 * frame%least_steps, max_samples))
  end function max_intermediate_samples

  !> True if an intermediate motion has reached its maximum number of samples and is still not accurate.
  pure logical function too_rough(frame, next)
    class(frame_type), intent(in) :: frame
    type(next_type), intent(in) :: next

    too_rough = size(next%q, 1) > max_intermediate_samples(frame) .and. .not. next%error <= rough
  end function too_rough

  !> Computes the periodic motion of `to_solve` by harmonic balance. It is the `change` from the motion `from`, if this is present.
  !> `n`: number of phases. The other arguments are those of `next_motion`.
  subroutine balance(frame, to_solve, n, next, change, fits, from)
    class(frame_type), intent(in) :: frame
    class(second_order_system), intent(in) :: to_solve
    integer, intent(in) :: n
    type(next_type), intent(inout) :: next
    real(dp), allocatable, intent(inout) :: change(:, :)
    logical, intent(out) :: fits
    type(series_type), intent(in), optional :: from
    real(dp), allocatable :: harmonics(:, :)
    integer :: known

    call balance_harmonics(to_solve, n, next%of_step, next%balance, fits)
    if (.not. fits) return
    next%scale = next%balance%survey%scale
    next%error = max(frame%load_rounding, next%balance%rounding)
    next%truncation = next%balance%truncation
    allocate(harmonics(0:n - 1, frame%dofs()), source=0.0_dp)
    harmonics(:, frame%free) = next%balance%harmonics
    change = next%balance%at_phases(harmonics)
    next%q = change
    if (present(from)) then
      known = ubound(from%cosine, 1)
      harmonics(:known, :) = harmonics(:known, :) + from%cosine
      harmonics(n / 2:n / 2 + known, :) = harmonics(n / 2:n / 2 + known, :) + from%sine
      next%q = next%balance%at_phases(harmonics)
    end if
    if (allocated(next%series%cosine)) deallocate(next%series%cosine, next%series%sine)
    allocate(next%series%cosine(0:n / 2 - 1, frame%dofs()), next%series%sine(0:n / 2 - 1, frame%dofs()))
    next%series%cosine = harmonics(:n / 2 - 1, :)
    next%series%sine = harmonics(n / 2:, :)
  end subroutine balance

  !> Computes the periodic motion of `to_solve` by one integration over the turn. The arguments are those of `balance`.
  subroutine integrate(frame, to_solve, n, next, change, fits, from)
    class(frame_type), intent(in) :: frame
    class(second_order_system), intent(in) :: to_solve
    integer, intent(in) :: n
    type(next_type), intent(inout) :: next
    real(dp), allocatable, intent(inout) :: change(:, :)
    logical, intent(out) :: fits
    type(series_type), intent(in), optional :: from

    if (.not. allocated(next%quick%scale) .and. allocated(next%balance%survey%scale)) then
      next%quick%scale = next%balance%survey%scale
      next%quick%phase_advance = next%balance%survey%phase_advance
    end if
    call solve_quickly(to_solve, n, next%of_step, next%quick, fits)
    if (.not. fits) return
    next%scale = next%quick%scale
    next%error = max(frame%load_rounding, next%quick%rounding)
    next%truncation = next%quick%truncation
    if (allocated(change)) deallocate(change)
    allocate(change(n, frame%dofs()), source=0.0_dp)
    change(:, frame%free) = transpose(next%quick%x(:size(frame%free), :))
    next%q = change
    if (present(from)) next%q = next%q + values_of(from, n)
    next%series = series_through(next%q)
  end subroutine integrate

  !> Computes the motion of `system` from `solved`, a full solution with error bounds. If `solved` is still empty, it is computed
  !> first. Fails if `next_motion` fails.
  subroutine solve_fully(frame, system, accuracy, n, solved, next, error)
    class(frame_type), intent(in) :: frame, system
    type(accuracy_type), intent(in) :: accuracy
    integer, intent(in) :: n
    type(floquet_type), intent(inout) :: solved
    type(next_type), intent(inout) :: next
    type(error_type), allocatable, intent(out) :: error
    type(periodic_solution_type) :: start
    real(dp), allocatable :: x(:, :)
    integer :: k

    if (.not. allocated(solved%parts)) call solve_floquet(system, accuracy, .true., solved, error)
    if (.not. allocated(error)) call solve_periodic(solved, start, error)
    if (.not. allocated(error)) call follow(system, solved, start, [(real(k, dp) / n, k = 0, n - 1)], x, error)
    if (allocated(error)) return
    if (allocated(next%q)) deallocate(next%q)
    allocate(next%q(n, frame%dofs()), source=0.0_dp)
    next%q(:, frame%free) = transpose(x(:size(frame%free), :))
    next%series = series_through(next%q)
    next%scale = solved%scale
    next%error = max(frame%load_rounding, norm2(start%error / next%scale) &
      & / max(maxval(norm2(x / spread(next%scale, 2, n), dim=1)), tiny(next%error)))
    next%truncation = 0
  end subroutine solve_fully

  !> Adds to `varied%rounding` the effect that the relative error `part` of the motion has on the multipliers. An error of the
  !> motion affects only the difference between the coefficients linearised about the motion and those linearised about rest.
  !> `scale`: units that make the states comparable.
  subroutine add_rounding(frame, scale, part, varied)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: scale(:), part
    type(varied_frame_type), intent(inout) :: varied
    integer, parameter :: points = 16
    real(dp), parameter :: nothing_known = 1.0e100_dp
    real(dp), dimension(varied%states, varied%states, points) :: p, p_rest
    real(dp), dimension(varied%states, varied%states) :: units
    real(dp) :: phases(points), unknown
    integer :: k

    phases = [((k - 0.5_dp) / points, k = 1, points)]
    call varied%sample(phases, p)
    call frame%sample(phases, p_rest)
    units = spread(scale, 1, varied%states) / spread(scale, 2, varied%states)
    unknown = part * frame%period * maxval([(norm2(units * (p(:, :, k) - p_rest(:, :, k))), k = 1, points)])
    varied%rounding = frame%rounding + merge(unknown, nothing_known, unknown < nothing_known)
  end subroutine add_rounding

  !> Copy of `accuracy` whose tolerance is at least `tolerance`.
  pure type(accuracy_type) function with_min_tolerance(accuracy, tolerance)
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in) :: tolerance

    with_min_tolerance = accuracy
    with_min_tolerance%tolerance = max(accuracy%tolerance, tolerance)
  end function with_min_tolerance

  !> Values of a motion at equidistant phases, shape (samples, dofs).
  function values_of(motion, samples) result(q)
    type(series_type), intent(in) :: motion
    integer, intent(in) :: samples
    real(dp), dimension(samples, size(motion%cosine, 2)) :: q, v, a
    integer :: k

    call motion%values([(real(k, dp) / samples, k = 0, samples - 1)], q, v, a)
  end function values_of

  !> Maximum of |q| over all phases and degrees of freedom, in the units `scale` of the states.
  pure real(dp) function size_of(frame, scale, q)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: scale(:), q(:, :)
    integer :: j

    size_of = 0
    do j = 1, size(frame%free)
      size_of = max(size_of, maxval(abs(q(:, frame%free(j)))) / scale(j))
    end do
  end function size_of

end module gestell_study_frame_model_newton
