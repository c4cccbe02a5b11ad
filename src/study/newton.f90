!> Newton's method for the periodic vibration of the exact frame, in the space of periodic functions: from q_k to the periodic
!> motion q_k+1 of the frame varied about q_k (gestell_model_varied_frame).
module gestell_study_newton
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_trigonometric, only: series_through, series_type
  use gestell_floquet_monodromy, only: accuracy_type
  use gestell_floquet_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: floquet_type, follow, solve_floquet, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_model_varied_frame, only: varied_frame_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: add_rounding, iterate, loosened, next_motion, size_of, smooth_motion, values_of

  !> The message where the steps do not become small.
  character(len=*), parameter, public :: no_convergence = "Newton's method does not converge"

  !> Accuracy of a vibration that is a start only.
  real(dp), parameter, public :: rough = 1.0e-6_dp
  !> Newton's steps for a vibration.
  integer, parameter :: most_steps = 12
  !> A step greater than this part of the motion tells that the start was bad, an error that the motion is nothing but error.
  real(dp), parameter :: greatest_step = 0.5_dp, all_error = 0.5_dp
  !> Samples of a motion; harmonics that count as resolved and those that are left out as rounding, relative to the motion.
  integer, parameter, public :: first_samples = 64
  integer, parameter :: most_samples = 2**12
  real(dp), parameter :: resolved = 1.0e-12_dp, noise = 1.0e-14_dp

contains

  !> Newton's method with the excitation of `varied`, which becomes the frame varied about the motion that is found. Errors: as of
  !> `solve_floquet` and `solve_periodic`; no convergence.
  subroutine iterate(frame, accuracy, varied, steps, error, last)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(varied_frame_type), intent(inout) :: varied
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    !> The solution of the last step, whose multipliers are those of the vibration to about the step's size.
    type(floquet_type), intent(out), optional :: last
    type(floquet_type) :: floquet
    real(dp), allocatable :: q(:, :), before(:, :)
    real(dp) :: step, left, expected, error_of_motion, error_before
    integer :: k

    allocate(steps(0))
    expected = rough
    error_before = 0
    do k = 1, most_steps
      call next_motion(frame, varied, loosened(accuracy, expected), 2 * ubound(varied%motion%cosine, 1) + 2, floquet, q, &
        & error_of_motion, error)
      if (allocated(error)) return
      before = values_of(varied%motion, size(q, 1))
      step = size_of(frame, floquet, q - before) / max(size_of(frame, floquet, q), tiny(step))
      steps = [steps, step]
      left = next_step(steps, error_before)
      error_before = error_of_motion
      varied%motion = smooth_motion(frame, floquet, q, error_of_motion)
      ! A motion that is all error is not told better by another step.
      if (expected <= accuracy%tolerance .and. (left <= accuracy%tolerance .or. error_of_motion >= all_error)) then
        call add_rounding(frame, floquet%scale, error_of_motion + merge(left, 0.0_dp, step < 1), varied)
        if (present(last)) last = floquet
        return
      end if
      if (.not. step < greatest_step .and. k > 2 .and. error_of_motion < all_error) exit
      expected = min(rough, left)
      if (left <= rough .or. error_of_motion >= all_error) expected = min(expected, accuracy%tolerance)
    end do
    call fatal_error(error, no_convergence, failed_computation)
  end subroutine iterate

  !> The step that would follow: convergence is quadratic, s_k+1 = c s_k^2, with c of the last two steps, but for what the error of
  !> the motion between them, relative to it, makes of the last one. c is at least 1, as is taken after a first step.
  pure real(dp) function next_step(steps, error_before)
    real(dp), intent(in) :: steps(:), error_before

    associate (k => size(steps))
      next_step = steps(k)**2
      if (k > 1) next_step = max(next_step, &
        & (steps(k) - error_before) * min(steps(k) / max(steps(k - 1), tiny(next_step)), 1.0_dp)**2)
    end associate
  end function next_step

  !> The periodic motion of `system` at as many equidistant phases as resolve it, at least `samples`, shape (samples, 3), and a
  !> bound on its error relative to the motion. Errors: as of `solve_floquet` and `solve_periodic`.
  subroutine next_motion(frame, system, accuracy, samples, floquet, q, error_of_motion, error)
    class(frame_type), intent(in) :: frame
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    integer, intent(in) :: samples
    type(floquet_type), intent(out) :: floquet
    real(dp), allocatable, intent(out) :: q(:, :)
    real(dp), intent(out) :: error_of_motion
    type(error_type), allocatable, intent(out) :: error
    type(periodic_solution_type) :: start
    type(series_type) :: series
    real(dp), allocatable :: x(:, :)
    real(dp) :: tail(3)
    integer :: n, k

    call solve_floquet(system, accuracy, .true., floquet, error)
    if (.not. allocated(error)) call solve_periodic(floquet, start, error)
    if (allocated(error)) return
    n = max(first_samples, samples)
    do
      call follow(system, floquet, start, [(real(k, dp) / n, k = 0, n - 1)], x, error)
      if (allocated(error)) return
      if (allocated(q)) deallocate(q)
      allocate(q(n, 3), source=0.0_dp)
      q(:, frame%free) = transpose(x(:size(frame%free), :))
      series = series_through(q)
      tail = series%tail()
      error_of_motion = max(frame%load_rounding, norm2(start%error / floquet%scale) &
        & / max(maxval(norm2(x / spread(floquet%scale, 2, n), dim=1)), tiny(tail)))
      if (maxval(tail(frame%free) / floquet%scale(:size(frame%free))) <= max(resolved, accuracy%tolerance / 100, &
        & error_of_motion / 100) * size_of(frame, floquet, q) .or. 2 * n > most_samples .or. error_of_motion >= all_error) exit
      n = 2 * n
    end do
  end subroutine next_motion

  !> What errors of the motion that `varied` is about, relative to it, do to the multipliers: of the coefficients' change from those
  !> about rest this part is unknown. `scale`: balanced units of the states.
  subroutine add_rounding(frame, scale, part, varied)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: scale(:), part
    type(varied_frame_type), intent(inout) :: varied
    integer, parameter :: points = 32
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

  !> The series through samples of the motion, without what is rounding, or within its error, this part of it.
  function smooth_motion(frame, floquet, q, error) result(motion)
    class(frame_type), intent(in) :: frame
    type(floquet_type), intent(in) :: floquet
    real(dp), intent(in) :: q(:, :), error
    type(series_type) :: motion
    real(dp) :: units(3)

    units = 0
    units(frame%free) = floquet%scale(:size(frame%free))
    motion = series_through(q)
    call motion%trim(units, max(noise, error / 100) * size_of(frame, floquet, q))
  end function smooth_motion

  !> A motion at equidistant phases.
  function values_of(motion, samples) result(q)
    type(series_type), intent(in) :: motion
    integer, intent(in) :: samples
    real(dp), dimension(samples, 3) :: q, v, a
    integer :: k

    call motion%values([(real(k, dp) / samples, k = 0, samples - 1)], q, v, a)
  end function values_of

  !> The greatest size of a motion, in the units of `floquet`.
  pure real(dp) function size_of(frame, floquet, q)
    class(frame_type), intent(in) :: frame
    type(floquet_type), intent(in) :: floquet
    real(dp), intent(in) :: q(:, :)
    integer :: j

    size_of = 0
    do j = 1, size(frame%free)
      size_of = max(size_of, maxval(abs(q(:, frame%free(j)))) / floquet%scale(j))
    end do
  end function size_of

end module gestell_study_newton
