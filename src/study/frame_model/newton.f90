!> Newton's method for the periodic vibration of the exact frame, in the space of periodic functions: from q_k to the periodic
!> motion q_k+1 of the frame varied about q_k (gestell_model_exact_varied_frame). Each step is a quick solution of the system that
!> tells what q_k lacks, so that its own errors are small beside the step.
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
  use gestell_study_frame_model_harmonic_balance, only: balance_harmonics, balance_type
  use gestell_system_corrected, only: corrected_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: iterate, loosened, next_motion, too_rough, values_of

  !> Accuracy of a vibration that is a start only.
  real(dp), parameter, public :: rough = 1.0e-6_dp
  !> Newton's steps for a vibration.
  integer, parameter :: most_steps = 12
  !> A step greater than this part of the motion tells that the start was bad, an error that the motion is nothing but error.
  real(dp), parameter :: greatest_step = 0.5_dp, all_error = 0.5_dp
  !> Part of the tolerance that may be left of the steps to come.
  real(dp), parameter :: part_left = 0.1_dp
  !> Errors that are allowed of a start and of a step where they are told quickly, relative to them; those of a step that confirms.
  real(dp), parameter :: of_step = 1.0e-3_dp, of_last_step = 0.1_dp
  !> Samples of a motion; harmonics that count as resolved and those that are left out as rounding, relative to the motion.
  integer, parameter, public :: first_samples = 64
  integer, parameter :: fewest_samples = 48, most_samples = 2**12
  !> A motion that Newton's method only passes on the way to a vibration gets no more samples than this, unless the step to it is
  !> small: motions that need more lead astray as a rule.
  integer, parameter :: most_passed = 512
  real(dp), parameter :: small_step = 0.1_dp
  !> With more phases integration takes less than harmonic balance.
  integer, parameter :: most_balanced = 128
  real(dp), parameter :: resolved = 1.0e-12_dp, noise = 1.0e-14_dp

  !> A periodic motion as it is told by `next_motion`.
  type, public :: next_type
    !> At equidistant phases, shape (samples, dofs), the series through them, units that make the states comparable.
    real(dp), allocatable :: q(:, :), scale(:)
    type(series_type) :: series
    !> Its size in these units; its change from the motion it is told from, and an estimate of its error, relative to it.
    real(dp) :: size = 0, step = 0, error = 0
    !> What the quick ways keep for the next motion.
    type(balance_type) :: balance
    type(quick_motion_type) :: quick
    !> What a quick way may have missed, relative to what it told.
    real(dp) :: truncation = 0
    !> Whether a quick way did; the error that is allowed of such a motion or step, relative to it.
    logical :: quickly = .false.
    real(dp) :: of_step = of_step
    !> Whether the motion is passed on the way to a vibration: then it may stay unresolved beyond `most_samples_passed`.
    logical :: passed = .false.
    !> Whether the quick ways are the only ones that are worth their cost.
    logical :: only_quickly = .false.
  end type next_type

contains

  !> Newton's method with the excitation of `varied`, from its motion, or from rest; `varied` becomes the frame varied about the
  !> vibration that is found, about that of `frame` itself, of the equations about rest, where `linear`. `steps`:
  !> |q_k+1 - q_k|/|q_k+1|, the first from the linear vibration or from the motion that `varied` had.
  !> Errors: as of `solve_floquet` and `solve_periodic`; no convergence.
  subroutine iterate(frame, accuracy, linear, varied, steps, error, quickly)
    class(frame_type), intent(in), target :: frame
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(in) :: linear
    type(varied_frame_type), intent(inout) :: varied
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    !> Whether the last step was a quick solution.
    logical, intent(out), optional :: quickly
    type(accuracy_type) :: order
    type(next_type) :: next
    type(varied_frame_type) :: lack
    real(dp) :: units(frame%dofs()), step, before, left, missed
    integer :: first, k, samples
    logical :: astray

    allocate(steps(0))
    first = 1
    if (.not. any(abs(varied%motion%cosine) > 0 .or. abs(varied%motion%sine) > 0)) first = 0
    before = 1
    ! A linear system has its motion at once.
    if (linear) next%of_step = part_left * accuracy%tolerance
    do k = first, most_steps
      samples = 2 * ubound(varied%motion%cosine, 1) + 2
      order = accuracy
      if (k == 0 .and. .not. linear) order = loosened(accuracy, rough)
      if (k == 0) then
        call next_motion(frame, frame, order, samples, next, error)
      else if (linear) then
        call next_motion(frame, frame, order, samples, next, error, varied%motion, &
          & corrected_system(frame, varied%motion, frame%free))
      else
        lack = varied
        lack%lacking = .true.
        ! As long as steps are great the motion is no vibration: what is wrong about it says nothing of the machine.
        astray = .not. before < greatest_step
        next%passed = astray
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
      ! What is rounding, within the motion's error, or within the part that is left of the steps, is no part of the series.
      units = 0
      units(frame%free) = next%scale(:size(frame%free))
      call next%series%trim(units, max(noise, next%error / 100, part_left * accuracy%tolerance / 100, missed * step / 100) &
        & * next%size)
      call varied%move_to(next%series)
      ! Steps fall at least as the last two did, those of a linear system as quick solutions miss it: what is yet to come. A motion
      ! that is all error is not told better by another.
      left = step
      if (step < before) left = step * min(1.0_dp, max(step / before, missed))
      if (linear .and. next%quickly) left = step * missed
      next%of_step = min(of_last_step, max(of_step, part_left * accuracy%tolerance / max(left, tiny(left))))
      if ((k > 0 .or. linear) .and. (left <= max(part_left * accuracy%tolerance, next%error) .or. next%error >= all_error)) then
        call add_rounding(frame, next%scale, next%error + 2 * merge(left, 0.0_dp, left < 1), varied)
        return
      end if
      if (.not. step < greatest_step .and. k > 2) exit
      before = step
    end do
    if (present(quickly)) quickly = next%quickly
    call fatal_error(error, "Newton's method does not converge", failed_computation)
    error%cause = no_convergence
  end subroutine iterate

  !> The periodic motion of `system` at as many equidistant phases as resolve it, at least `samples`. It is solved quickly, so its
  !> error may be `rough`, unless there is a motion `from` which lacks the periodic motion of the system `lack`. `next` may hold the
  !> motion of a system that differs little. Where the quick way does not fit the system is solved as all others, to `accuracy`.
  !> `floquet`: returns the full solution and forces it to be used. Errors: as of `solve_floquet` and `solve_periodic`; no quick way
  !> fits where no other is allowed.
  subroutine next_motion(frame, system, accuracy, samples, next, error, from, lack, floquet)
    class(frame_type), intent(in) :: frame, system
    type(accuracy_type), intent(in) :: accuracy
    integer, intent(in) :: samples
    type(next_type), intent(inout) :: next
    type(error_type), allocatable, intent(out) :: error
    type(series_type), intent(in), optional :: from
    class(second_order_system), intent(in), optional :: lack
    type(floquet_type), intent(out), optional :: floquet
    type(floquet_type) :: solved
    real(dp), allocatable :: change(:, :)
    real(dp) :: unseen
    real(dp), allocatable :: beyond(:)
    integer :: n
    logical :: balances

    ! A motion of more orders than half the samples would be read as one of fewer: of order k least_steps is about 2 pi k.
    n = max(fewest_samples, min(frame%least_steps / 2, most_samples / 2))
    balances = .not. (present(floquet) .or. next%quick%keeps)
    do
      ! Multiples of 16 are quickly transformed, and balanced.
      n = 16 * ((max(n, samples) + 15) / 16)
      next%quickly = balances .and. n <= most_balanced
      if (next%quickly) then
        call balance(frame, system, n, next, change, next%quickly, from, lack)
        if (.not. next%quickly .and. next%balance%left_out > next%of_step / 2 .and. 2 * n <= most_balanced) then
          n = 2 * n
          cycle
        end if
        ! Beside a resonance next to no damping integration knows its rounding better.
        next%quickly = next%quickly .and. next%error <= max(part_left * accuracy%tolerance, frame%load_rounding)
      end if
      if (.not. next%quickly .and. .not. present(floquet)) call integrate(frame, system, n, next, change, next%quickly, from, lack)
      if (.not. next%quickly .and. next%only_quickly) then
        call fatal_error(error, "the quick methods cannot compute this motion", failed_computation)
        return
      end if
      if (.not. next%quickly) then
        call solve_fully(frame, system, accuracy, n, solved, next, error)
        if (allocated(error)) return
        change = next%q
        if (present(from) .and. present(lack)) change = change - values_of(from, n)
      end if
      next%size = size_of(frame, next%scale, next%q)
      next%step = size_of(frame, next%scale, change) / max(next%size, tiny(next%size))
      beyond = next%series%beyond()
      unseen = maxval(beyond(frame%free) / next%scale(:size(frame%free))) / max(next%size, tiny(unseen))
      if (unseen <= max(resolved, accuracy%tolerance / 100, next%error / 100, &
        & merge(next%of_step / 100, 0.0_dp, next%quickly .and. .not. present(lack))) .or. 2 * n > most_samples &
        & .or. next%error >= all_error .or. (next%passed .and. n > most_samples_passed(frame))) exit
      n = merge(first_samples, 2 * n, n < first_samples)
    end do
    next%error = max(next%error, unseen)
    if (present(floquet)) floquet = solved
  end subroutine next_motion

  !> Samples beyond which a motion that is only passed is given up: more where the coefficients alone need many.
  pure integer function most_samples_passed(frame)
    class(frame_type), intent(in) :: frame

    most_samples_passed = max(most_passed, min(2 * frame%least_steps, most_samples))
  end function most_samples_passed

  !> Whether a motion that is only passed is not resolved by as many samples as it may have.
  pure logical function too_rough(frame, next)
    class(frame_type), intent(in) :: frame
    type(next_type), intent(in) :: next

    too_rough = size(next%q, 1) > most_samples_passed(frame) .and. .not. next%error <= rough
  end function too_rough

  !> The motion by harmonic balance, and its `change` from the motion `from` that it is told from; arguments as of `next_motion`.
  subroutine balance(frame, system, n, next, change, fits, from, lack)
    class(frame_type), intent(in) :: frame, system
    integer, intent(in) :: n
    type(next_type), intent(inout) :: next
    real(dp), allocatable, intent(inout) :: change(:, :)
    logical, intent(out) :: fits
    type(series_type), intent(in), optional :: from
    class(second_order_system), intent(in), optional :: lack
    real(dp), allocatable :: harmonics(:, :)
    integer :: known

    if (present(lack)) then
      call balance_harmonics(lack, n, next%of_step, next%balance, fits)
    else
      call balance_harmonics(system, n, next%of_step, next%balance, fits)
    end if
    if (.not. fits) return
    next%scale = next%balance%survey%scale
    next%error = max(frame%load_rounding, next%balance%rounding)
    next%truncation = next%balance%truncation
    allocate(harmonics(0:n - 1, frame%dofs()), source=0.0_dp)
    harmonics(:, frame%free) = next%balance%harmonics
    change = next%balance%at_phases(harmonics)
    if (present(from) .and. present(lack)) then
      known = ubound(from%cosine, 1)
      harmonics(:known, :) = harmonics(:known, :) + from%cosine
      harmonics(n / 2:n / 2 + known, :) = harmonics(n / 2:n / 2 + known, :) + from%sine
      next%q = next%balance%at_phases(harmonics)
    else
      next%q = change
    end if
    if (allocated(next%series%cosine)) deallocate(next%series%cosine, next%series%sine)
    allocate(next%series%cosine(0:n / 2 - 1, frame%dofs()), next%series%sine(0:n / 2 - 1, frame%dofs()))
    next%series%cosine = harmonics(:n / 2 - 1, :)
    next%series%sine = harmonics(n / 2:, :)
  end subroutine balance

  !> The same by one integration over the turn.
  subroutine integrate(frame, system, n, next, change, fits, from, lack)
    class(frame_type), intent(in) :: frame, system
    integer, intent(in) :: n
    type(next_type), intent(inout) :: next
    real(dp), allocatable, intent(inout) :: change(:, :)
    logical, intent(out) :: fits
    type(series_type), intent(in), optional :: from
    class(second_order_system), intent(in), optional :: lack

    if (.not. allocated(next%quick%scale) .and. allocated(next%balance%survey%scale)) then
      next%quick%scale = next%balance%survey%scale
      next%quick%phase_advance = next%balance%survey%phase_advance
    end if
    if (present(lack)) then
      call solve_quickly(lack, n, next%of_step, next%quick, fits)
    else
      call solve_quickly(system, n, next%of_step, next%quick, fits)
    end if
    if (.not. fits) return
    next%scale = next%quick%scale
    next%error = max(frame%load_rounding, next%quick%rounding)
    next%truncation = next%quick%truncation
    if (allocated(change)) deallocate(change)
    allocate(change(n, frame%dofs()), source=0.0_dp)
    change(:, frame%free) = transpose(next%quick%x(:size(frame%free), :))
    next%q = change
    if (present(from) .and. present(lack)) next%q = next%q + values_of(from, n)
    next%series = series_through(next%q)
  end subroutine integrate

  !> The same of `system` itself by a solution with its evidence, `solved`, unless that is there. Errors: as of `next_motion`.
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

  !> What errors of the motion that `varied` is about, relative to it, do to the multipliers: of the coefficients' change from those
  !> about rest this part is unknown. `scale`: balanced units of the states.
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

  pure type(accuracy_type) function loosened(accuracy, tolerance)
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in) :: tolerance

    loosened = accuracy
    loosened%tolerance = max(accuracy%tolerance, tolerance)
  end function loosened

  !> A motion at equidistant phases.
  function values_of(motion, samples) result(q)
    type(series_type), intent(in) :: motion
    integer, intent(in) :: samples
    real(dp), dimension(samples, size(motion%cosine, 2)) :: q, v, a
    integer :: k

    call motion%values([(real(k, dp) / samples, k = 0, samples - 1)], q, v, a)
  end function values_of

  !> The greatest size of a motion, over the units of the states.
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
