!> Newton's method for the periodic vibration of the exact frame, in the space of periodic functions: from q_k to the periodic
!> motion q_k+1 of the frame varied about q_k (gestell_model_frame_varied_frame). Each step is a quick solution of the system that
!> tells what q_k lacks, so that its own errors are small beside the step.
module gestell_study_frame_model_newton
  use gestell_base_error, only: error_type, failed_computation, fatal_error, no_convergence
  use gestell_base_kinds, only: dp
  use gestell_math_trigonometric, only: series_through, series_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_period_quick_motion, only: quick_motion_type, solve_quickly
  use gestell_floquet_solution, only: floquet_type, follow, solve_floquet, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_varied_frame, only: varied_frame_type
  use gestell_system_corrected, only: corrected_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: iterate, loosened, next_motion, values_of

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
  !> Samples of a motion, of a start that is rough too; harmonics that count as resolved and those that are left out as rounding,
  !> relative to the motion.
  integer, parameter, public :: first_samples = 64
  integer, parameter :: fewest_samples = 48, fewest_of_start = 32, most_samples = 2**12
  real(dp), parameter :: resolved = 1.0e-12_dp, noise = 1.0e-14_dp

  !> A periodic motion as it is told by `next_motion`.
  type, public :: next_type
    !> At equidistant phases, shape (samples, dofs), the series through them, units that make the states comparable.
    real(dp), allocatable :: q(:, :), scale(:)
    type(series_type) :: series
    !> Its size in these units; its change from the motion it is told from, and an estimate of its error, relative to it.
    real(dp) :: size = 0, step = 0, error = 0
    type(quick_motion_type) :: quick
    !> Whether the quick way did; the error that is allowed of such a motion or step, relative to it.
    logical :: quickly = .false.
    real(dp) :: of_step = of_step
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
    real(dp) :: step, before, left, missed
    integer :: first, k, samples

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
        call next_motion(frame, varied, order, samples, next, error, varied%motion, lack)
      end if
      if (present(quickly)) quickly = next%quickly
      if (allocated(error)) return
      step = next%step
      if (k > 0) steps = [steps, step]
      missed = merge(next%quick%truncation, 0.0_dp, next%quickly)
      call trim_motion(frame, next, max(part_left * accuracy%tolerance, missed * step))
      call varied%move_to(next%series)
      ! Steps fall at least as the last two did, those of a linear system as quick solutions miss it: what is yet to come. A motion
      ! that is all error is not told better by another.
      left = step * min(1.0_dp, max(step / before, missed))
      if (linear .and. next%quickly) left = step * missed
      next%of_step = min(of_last_step, max(of_step, part_left * accuracy%tolerance / max(left, tiny(left))))
      if ((k > 0 .or. linear) .and. (left <= max(part_left * accuracy%tolerance, next%error) .or. next%error >= all_error)) then
        call add_rounding(frame, next%scale, next%error + 2 * merge(left, 0.0_dp, left < 1), varied)
        return
      end if
      if (.not. step < greatest_step .and. k > 2) exit
      before = step
    end do
    call fatal_error(error, "Newton's method does not converge", failed_computation)
    error%cause = no_convergence
  end subroutine iterate

  !> The periodic motion of `system` at as many equidistant phases as resolve it, at least `samples`. It is solved quickly, so its
  !> error may be `rough`, unless there is a motion `from` which lacks the periodic motion of the system `lack`. `next` may hold the
  !> motion of a system that differs little. Where the quick way does not fit the system is solved as all others, to `accuracy`.
  !> `floquet`: that solution, which is then the way. Errors: as of `solve_floquet` and `solve_periodic`.
  !> Nine arguments: Newton's step and, by the last three, what is known before it.
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
    type(periodic_solution_type) :: start
    real(dp), allocatable :: x(:, :), change(:, :)
    real(dp) :: unseen
    real(dp), allocatable :: beyond(:)
    logical :: fits
    integer :: n, k

    n = merge(fewest_samples, fewest_of_start, present(lack) .or. next%of_step < of_step)
    do
      ! Multiples of 8 are quickly transformed.
      n = 8 * ((max(n, samples) + 7) / 8)
      if (allocated(next%q)) deallocate(next%q)
      allocate(next%q(n, frame%dofs()), source=0.0_dp)
      if (present(from) .and. present(lack)) then
        next%q = values_of(from, n)
        change = -next%q
        call solve_quickly(lack, n, next%of_step, next%quick, fits)
      else
        change = next%q
        fits = .not. present(floquet)
        if (fits) call solve_quickly(system, n, next%of_step, next%quick, fits)
      end if
      next%quickly = fits
      if (fits) then
        next%q(:, frame%free) = next%q(:, frame%free) + transpose(next%quick%x(:size(frame%free), :))
        next%scale = next%quick%scale
        next%error = max(frame%load_rounding, next%quick%rounding)
      else
        if (.not. allocated(solved%parts)) then
          call solve_floquet(system, accuracy, .true., solved, error)
          if (.not. allocated(error)) call solve_periodic(solved, start, error)
          if (allocated(error)) return
        end if
        call follow(system, solved, start, [(real(k, dp) / n, k = 0, n - 1)], x, error)
        if (allocated(error)) return
        next%q(:, frame%free) = transpose(x(:size(frame%free), :))
        next%scale = solved%scale
        next%error = max(frame%load_rounding, norm2(start%error / next%scale) &
          & / max(maxval(norm2(x / spread(next%scale, 2, n), dim=1)), tiny(unseen)))
      end if
      next%size = size_of(frame, next%scale, next%q)
      next%step = size_of(frame, next%scale, next%q + change) / max(next%size, tiny(next%size))
      next%series = series_through(next%q)
      beyond = next%series%beyond()
      unseen = maxval(beyond(frame%free) / next%scale(:size(frame%free))) / max(next%size, tiny(unseen))
      if (unseen <= max(resolved, accuracy%tolerance / 100, next%error / 100, &
        & merge(next%of_step / 100, 0.0_dp, fits .and. .not. present(lack))) .or. 2 * n > most_samples &
        & .or. next%error >= all_error) exit
      n = merge(first_samples, 2 * n, n < first_samples)
    end do
    next%error = max(next%error, unseen)
    if (present(floquet)) floquet = solved
  end subroutine next_motion

  !> What errors of the motion that `varied` is about, relative to it, do to the multipliers: of the coefficients' change from those
  !> about rest this part is unknown. `scale`: balanced units of the states.
  subroutine add_rounding(frame, scale, part, varied)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: scale(:), part
    type(varied_frame_type), intent(inout) :: varied
    integer, parameter :: points = 16
    real(dp), dimension(varied%states, varied%states, points) :: p, p_rest
    real(dp), dimension(varied%states, varied%states) :: units
    real(dp) :: phases(points)
    integer :: k

    phases = [((k - 0.5_dp) / points, k = 1, points)]
    call varied%sample(phases, p)
    call frame%sample(phases, p_rest)
    units = spread(scale, 1, varied%states) / spread(scale, 2, varied%states)
    varied%rounding = frame%rounding &
      & + part * frame%period * maxval([(norm2(units * (p(:, :, k) - p_rest(:, :, k))), k = 1, points)])
  end subroutine add_rounding

  pure type(accuracy_type) function loosened(accuracy, tolerance)
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in) :: tolerance

    loosened = accuracy
    loosened%tolerance = max(accuracy%tolerance, tolerance)
  end function loosened

  !> Leaves out of the series of a motion what is rounding, or within its error, or of this part of it.
  subroutine trim_motion(frame, next, part)
    class(frame_type), intent(in) :: frame
    type(next_type), intent(inout) :: next
    real(dp), intent(in) :: part
    real(dp) :: units(frame%dofs())

    units = 0
    units(frame%free) = next%scale(:size(frame%free))
    call next%series%trim(units, max(noise, next%error / 100, part / 100) * next%size)
  end subroutine trim_motion

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
