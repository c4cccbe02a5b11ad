!> Computes the periodic vibration of a frame: its history, the forces on the ground, harmonics, and peaks with bounds on their
!> errors.
module gestell_study_vibration
  use gestell_base_error, only: error_type, failed_computation, fatal_error, invalid_input
  use gestell_math_series_fourier, only: find_series, fourier_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: balance_motion, balanced_motion_type, bound_motion_errors, checkpoints, floquet_type, &
    & follow, solve_periodic
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_frame_of, only: frame_of
  use gestell_model_mounting, only: load_rounding, matrix_rounding
  use gestell_model_quantity_rows, only: accelerations, guide_forces, joint_forces, joint_sources, rows_of, velocities
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_study_vibration_motion, only: accelerations_type, motion_errors, sample_accelerations, whole_motion
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: check_rows, check_times, solve_vibration

  !> Number of quantities of the vibration in the plane: xi, eta, psi, their velocities, and two forces and the moment on the
  !> ground. In space there are 18 quantities for six degrees of freedom, in the frame's order.
  integer, parameter, public :: quantities = 9

  !> A periodic vibration of a frame.
  type, public :: vibration_type
    !> State at the start of the period, and its error; only free degrees of freedom
    type(periodic_solution_type) :: start
    !> All quantities at equidistant times from 0 to T, both included; shape (quantities, points + 1). Locked degrees of freedom are
    !> zero
    real(dp), allocatable :: history(:, :)
    !> Fourier series of every quantity, shape (quantities)
    type(fourier_type), allocatable :: series(:)
    !> `peak`: maximum of the absolute value over the period. `peak_error`: bound on its error. `rms`: rms over the period. All have
    !> shape (quantities)
    real(dp), allocatable :: peak(:), peak_error(:), rms(:)
    !> Bounds on the errors of the quantities at any time; they also bound the errors of the rms values. Shape (quantities)
    real(dp), allocatable :: error(:)
    !> Difference |x(T) - x(0)| of the computed motion, relative to the maximum of |x(t)|, in units that make the states comparable
    real(dp) :: closing_defect = 0
    !> Rows of the motion (gestell_model_quantity), allocated if requested. `motion`: values at equidistant phases that resolve the
    !> motion, shape (rows, samples). `motion_history`: values at the times of the history, shape (rows, points + 1)
    real(dp), allocatable :: motion(:, :), motion_history(:, :)
    !> Parts of the joint forces that have one source each (inertia, weights, and each load) at the phases of `motion`, shape (rows
    !> of the joint forces, samples, sources). Allocated if they were requested
    real(dp), allocatable :: joint_parts(:, :, :)
    !> Last group of rows that was requested; 0 if none was
    integer :: last_rows = 0
    !> Bounds on the errors of the rows of the motion, if these were computed
    type(turn_errors_type) :: motion_errors
    !> Fourier series of the rows of the motion, shape (rows)
    type(fourier_type), allocatable :: motion_series(:)
  end type vibration_type

  !> If the history has more points than this, the harmonics are computed from separate samples.
  integer, parameter :: max_shared = 1024
  !> Maximum number of samples per period.
  integer, parameter :: max_samples = 2**14
  !> Harmonics count as resolved if the highest orders are below `resolved` times the largest harmonic, or below `part_of_error`
  !> times the error of the quantity. A solution with coarse integration steps has kinks as large as its error, which no number of
  !> samples resolves.
  real(dp), parameter :: resolved = 1.0e-9_dp, part_of_error = 0.1_dp

contains

  !> Computes the periodic vibration of `system`, which is a frame or its averaged model. Fails if `check_times` fails, if `system`
  !> is of another type, or if `floquet` is the solution of another system or was computed without load. Fails also at a resonance,
  !> or if the vibration overflows.
  subroutine solve_vibration(system, floquet, points, harmonics, vibration, error, rows)
    class(periodic_system), intent(in), target :: system
    !> Floquet solution of `system`, computed with its load
    type(floquet_type), intent(in) :: floquet
    !> Number of intervals of the history, and minimum number of harmonics
    integer, intent(in) :: points, harmonics
    type(vibration_type), intent(out) :: vibration
    type(error_type), allocatable, intent(out) :: error
    !> If present, `vibration` also contains the rows of the motion up to and including this group: `velocities`, `accelerations`,
    !> `guide_forces`, `joint_forces` or `joint_sources`
    integer, intent(in), optional :: rows
    class(frame_type), pointer :: frame
    real(dp), allocatable :: x(:, :), all(:, :), phases(:)
    type(balanced_motion_type) :: balanced
    type(turn_errors_type) :: errors
    type(accelerations_type) :: sampled
    logical :: resolved_all
    integer :: samples, numbers, every, k, i

    frame => frame_of(system)
    if (.not. associated(frame)) then
      call fatal_error(error, "the system is not a frame: a vibration can be computed only for a frame", invalid_input)
      return
    end if
    call frame%check(error)
    if (.not. allocated(error)) call check_times(points, harmonics, error, rows)
    if (.not. allocated(error)) call solve_periodic(floquet, vibration%start, error)
    if (allocated(error)) return
    if (size(floquet%scale) /= frame%states) then
      call fatal_error(error, "the frame and the solution must have the same number of states", invalid_input)
      return
    end if

    call balance_motion(frame, floquet, vibration%start, balanced)

    ! The points of the history serve as samples, together with as many points between them as the harmonics require. If the history
    ! has very many points, the harmonics are computed from separate samples.
    samples = max(64, 2 * harmonics + 2, min(max(4 * frame%least_steps, 2 * (frame%least_steps &
      & + frame%mechanism%load_order)), max_samples))
    if (points <= max_shared) samples = points * ceiling(samples / real(points, dp))
    numbers = 3 * frame%dofs()
    if (present(rows)) vibration%last_rows = rows
    allocate(vibration%series(numbers))

    ! The bounds remain valid if the motion is sampled at more phases. `every`: the largest stride that divides the number of
    ! samples and selects at least as many of them as there are checkpoints.
    every = maxval([(merge(k, 1, modulo(samples, k) == 0), k = 1, max(1, samples / checkpoints(floquet)))])
    phases = [(real(k, dp) / samples, k = 0, samples, every)]
    call follow(frame, floquet, vibration%start, phases, x, error, balanced)
    if (.not. allocated(error)) call bound_motion_errors(frame, floquet, phases, x, errors, error, balanced)
    if (allocated(error)) return
    vibration%start%error = min(vibration%start%error, errors%bounds())
    vibration%error = quantity_errors(frame, errors, x)
    if (present(rows)) call compute_motion_errors(frame, system, phases, x, rows, errors, vibration%motion_errors)

    do
      phases = [(real(k, dp) / samples, k = 0, samples)]
      call follow(frame, floquet, vibration%start, phases, x, error, balanced)
      if (allocated(error)) return
      all = all_quantities(frame, x)
      call find_series(all(:, :samples), vibration%series)
      resolved_all = states_resolved(frame, floquet, vibration, abs(x(:, samples + 1) - x(:, 1)))
      if (present(rows)) then
        call sample_accelerations(frame, system, phases, rows, sampled)
        call whole_motion(frame, system, phases, x, rows, sampled, vibration%motion, vibration%joint_parts)
        if (allocated(vibration%motion_series)) deallocate(vibration%motion_series)
        allocate(vibration%motion_series(size(vibration%motion, 1)))
        ! The first rows are the states, whose series are known.
        vibration%motion_series(:2 * frame%dofs()) = vibration%series(:2 * frame%dofs())
        k = 2 * frame%dofs() + 1
        call find_series(vibration%motion(k:, :samples), vibration%motion_series(k:))
        if (resolved_all) resolved_all = rows_resolved(frame, system, phases, x, sampled, vibration)
      end if
      if (resolved_all .or. 2 * samples > max_samples) exit
      samples = 2 * samples
    end do
    vibration%closing_defect = norm2((x(:, samples + 1) - x(:, 1)) / floquet%scale) &
      & / max(maxval(norm2(x / spread(floquet%scale, 2, samples + 1), dim=1)), tiny(1.0_dp))
    vibration%peak = [(vibration%series(i)%peak(all(i, :samples)), i = 1, numbers)]
    vibration%rms = [(vibration%series(i)%rms(), i = 1, numbers)]
    vibration%peak_error = vibration%error + [(vibration%series(i)%beyond(), i = 1, numbers)]

    if (points <= max_shared) then
      vibration%history = all(:, ::samples / points)
      if (present(rows)) vibration%motion_history = vibration%motion(:, ::samples / points)
    else
      phases = [(real(k, dp) / points, k = 0, points)]
      call follow(frame, floquet, vibration%start, phases, x, error, balanced)
      if (allocated(error)) return
      vibration%history = all_quantities(frame, x)
      if (present(rows)) then
        call sample_accelerations(frame, system, phases, rows, sampled)
        call whole_motion(frame, system, phases, x, min(rows, joint_forces), sampled, vibration%motion_history)
      end if
    end if
    if (present(rows)) vibration%motion = vibration%motion(:, :samples)
    if (allocated(vibration%joint_parts)) vibration%joint_parts = vibration%joint_parts(:, :samples, :)
    if (any(.not. ieee_is_finite([vibration%peak, vibration%peak_error, vibration%rms]))) call fatal_error(error, &
      & "the periodic vibration or its error bound overflows double precision", failed_computation)
  end subroutine solve_vibration

  !> Checks the numbers of points, harmonics and rows of the motion. Fails if one of them is out of range.
  pure subroutine check_times(points, harmonics, error, rows)
    integer, intent(in) :: points, harmonics
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: rows
    integer, parameter :: max_points = 10**6, max_harmonics = 8000

    if (points < 1 .or. points > max_points) then
      call fatal_error(error, "the number of points of the history must lie between 1 and 1000000", invalid_input)
    else if (harmonics < 0 .or. harmonics > max_harmonics) then
      call fatal_error(error, "the number of harmonics must lie between 0 and 8000", invalid_input)
    else if (present(rows)) then
      if (all(rows /= [velocities, accelerations, guide_forces, joint_forces, joint_sources])) call fatal_error(error, "the " &
        & // "number of rows of the motion must be 6 (positions and velocities), 9 (also accelerations), 12 (also forces of " &
        & // "guides), 15 (also joint forces) or 18 (also their sources)", invalid_input)
    end if
  end subroutine check_times

  !> Fails if the vibration contains fewer than `rows` rows of the motion.
  pure subroutine check_rows(vibration, rows, error)
    type(vibration_type), intent(in) :: vibration
    integer, intent(in) :: rows
    type(error_type), allocatable, intent(out) :: error
    logical :: held

    held = allocated(vibration%motion) .and. allocated(vibration%motion_history)
    if (held .and. rows >= joint_forces) held = vibration%last_rows >= rows
    if (held .and. rows < joint_forces) held = size(vibration%motion, 1) >= rows_of(size(vibration%history, 1) / 3, rows)
    if (.not. held) call fatal_error(error, "the vibration was computed without data that this quantity requires: request " // &
      &   "more rows of the motion in solve_vibration", invalid_input)
  end subroutine check_rows

  !> Error bounds of all quantities. They result from the errors `states` of the states x, shape (states, phases), and from
  !> rounding of the mounting's matrices.
  pure function quantity_errors(frame, states, x) result(errors)
    class(frame_type), intent(in) :: frame
    type(turn_errors_type), intent(in) :: states
    real(dp), intent(in) :: x(:, :)
    real(dp) :: errors(3 * frame%dofs())
    real(dp), dimension(size(states%rounding), frame%dofs()) :: weights, rounding
    real(dp), dimension(frame%dofs(), frame%dofs()) :: c, stiffness
    integer :: i, n

    n = frame%dofs()
    errors = 0
    c = frame%ground_stiffness()
    stiffness = matrix_rounding(frame%stiffness) + load_rounding(frame%supports, n)
    associate (bounds => states%bounds(), f => size(frame%free), b => frame%damping, damping => matrix_rounding(frame%damping))
      errors(frame%free) = bounds(:f)
      errors(n + frame%free) = bounds(f + 1:)
      weights(:f, :) = transpose(c(:, frame%free))
      weights(f + 1:, :) = transpose(b(:, frame%free))
      rounding(:f, :) = stiffness(frame%free, :)
      rounding(f + 1:, :) = damping(frame%free, :)
    end associate
    errors(2 * n + 1:) = [(states%along(weights(:, i)), i = 1, n)] + matmul(maxval(abs(x), dim=2), rounding)
  end function quantity_errors

  !> Computes the errors of the rows of the motion from the errors `states` of the states x at the same phases. The rows are
  !> computed twice, without and with these errors, and compared. For the exact frame the errors are added to the computed motion,
  !> for other models to rest. Rounding errors result from the states, the load and the sums.
  subroutine compute_motion_errors(frame, system, phases, x, rows, states, errors)
    class(frame_type), intent(in) :: frame
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(in) :: x(:, :)
    integer, intent(in) :: rows
    type(turn_errors_type), intent(in) :: states
    type(turn_errors_type), intent(out) :: errors
    real(dp), parameter :: sums = 4 * epsilon(1.0_dp)
    real(dp), allocatable :: from(:, :), there(:, :), compared(:, :), finer(:, :)
    type(accelerations_type) :: sampled
    integer :: n, last

    n = size(phases)
    last = min(rows, joint_forces)
    from = 0 * x
    select type (frame)
    class is (varied_frame_type)
      from = x
    end select
    call sample_accelerations(frame, system, phases, last, sampled)
    call whole_motion(frame, system, phases, from, last, sampled, there)
    allocate(errors%differences(size(there, 1), size(states%differences, 2)), errors%rounding(size(there, 1)))
    if (size(states%differences, 2) > 0) then
      call whole_motion(frame, system, phases, from + states%differences(:, :n), last, sampled, compared)
      call whole_motion(frame, system, phases, from + states%differences(:, n + 1:), last, sampled, finer)
      errors%differences(:, :n) = compared - there
      errors%differences(:, n + 1:) = finer - there
    end if
    ! Relative errors of coefficients and load of the accelerations. They have three sources: the model; the mechanism's first and
    ! second derivatives, whose errors accumulate over several joints; and forces of links that cancel.
    associate (own => 16 * (sums + frame%rounding), model => 16 * (sums + frame%rounding) + frame%load_rounding)
      call motion_errors(frame, system, phases, states%rounding + model * maxval(abs(x), dim=2), [model, own], sampled, there, &
        & errors%rounding)
    end associate
  end subroutine compute_motion_errors

  !> True if the samples resolve the accelerations and the forces of guides, which are the rows of the motion after those of the
  !> states. Harmonics below the rounding error of a row's terms count as resolved. A larger harmonic counts as resolved if it is
  !> smaller than both the row's error and the difference between the row's values at the start and at the end of the period.
  logical function rows_resolved(frame, system, phases, x, sampled, vibration)
    class(frame_type), intent(in) :: frame
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(in) :: x(:, :)
    !> The accelerations at the phases
    type(accelerations_type), intent(in) :: sampled
    type(vibration_type), intent(in) :: vibration
    real(dp), parameter :: rounding = 1.0e-12_dp
    real(dp), dimension(size(vibration%motion_series)) :: terms, errors, missed
    integer :: k

    errors = vibration%motion_errors%bounds()
    associate (inner => phases(:size(phases) - 1), series => vibration%motion_series, motion => vibration%motion)
      call motion_errors(frame, system, inner, maxval(abs(x), dim=2), [1.0_dp, 1.0_dp], sampled, motion, terms)
      missed = abs(motion(:, size(phases)) - motion(:, 1))
      rows_resolved = all([(is_resolved(series(k), max(rounding * terms(k), min(missed(k), errors(k))), errors(k)), &
        & k = 2 * frame%dofs() + 1, size(series))])
    end associate
  end function rows_resolved

  !> True if the samples resolve the states, from which the forces result. In comparable units, harmonics below the rounding error
  !> of the largest state count as resolved. Larger harmonics of a state count as resolved if they are smaller than both its error
  !> and `missed`, the difference between its values at the end and at the start of the period. They then belong to free
  !> vibrations of this size, which are not periodic.
  pure logical function states_resolved(frame, floquet, vibration, missed)
    class(frame_type), intent(in) :: frame
    type(floquet_type), intent(in) :: floquet
    type(vibration_type), intent(in) :: vibration
    real(dp), intent(in) :: missed(:)
    real(dp), parameter :: rounding = 1.0e-13_dp
    real(dp) :: maximum(size(floquet%scale)), errors(size(floquet%scale))
    integer :: states(size(floquet%scale)), k

    states = [frame%free, frame%dofs() + frame%free]
    errors = vibration%error(states)
    associate (series => vibration%series)
      maximum = [(series(states(k))%largest_term() / floquet%scale(k), k = 1, size(states))]
      states_resolved = all([(is_resolved(series(states(k)), &
        & max(rounding * maxval(maximum) * floquet%scale(k), min(missed(k), errors(k))), errors(k)), k = 1, size(states))])
    end associate
  end function states_resolved

  !> True if the upper third of the orders of a series is negligible: relative to its largest order, to `rounding`, or to its
  !> `error`.
  pure logical function is_resolved(series, rounding, error)
    type(fourier_type), intent(in) :: series
    real(dp), intent(in) :: rounding, error
    real(dp) :: maximum

    maximum = series%largest_term()
    is_resolved = series%tail() * maximum <= max(resolved * maximum, rounding, part_of_error * error)
  end function is_resolved

  !> All quantities, computed from the states of the free degrees of freedom, shape (quantities, points).
  pure function all_quantities(frame, x) result(all)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: x(:, :)
    real(dp), allocatable :: all(:, :)
    integer :: f, n

    f = size(frame%free)
    n = frame%dofs()
    allocate(all(3 * n, size(x, 2)), source=0.0_dp)
    all(frame%free, :) = x(:f, :)
    all(n + frame%free, :) = x(f + 1:, :)
    all(2 * n + 1:, :) = frame%ground_forces(x)
  end function all_quantities

end module gestell_study_vibration
