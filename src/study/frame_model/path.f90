!> Follows periodic vibrations of a family of exact frames over a parameter lambda by arc length.
!>
!> Arc length continuation (H. B. Keller, 1977) passes turning points, where lambda reverses and Newton's method at given lambda
!> fails. One step of Newton's method from a motion q yields, to first order in lambda, the motion q_a + lambda q_b. Let (q_p,
!> lambda_p) be the predicted point of the path, and (t_q, t_lambda) the tangent of the path. The condition
!>
!>     <t_q, q - q_p> + t_lambda (lambda - lambda_p) = 0
!>
!> with the inner product <,> keeps the correction of the predicted point orthogonal to the tangent and determines lambda. The
!> derivative of Newton's step with respect to q vanishes at a vibration, so the tangent there is (q_b, 1).
module gestell_study_frame_model_path
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_sorting, only: ascending
  use gestell_math_series_trigonometric, only: series_through, series_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type, solve_multipliers
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_model_space, only: is_rotation
  use gestell_study_frame_model_newton, only: with_min_tolerance, next_motion, next_type, too_rough, values_of
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: advance, between, cubic, first_point, middle_of, motion_of, next_iterate, size_of, units_of

  !> A family of machines that depend on the parameter lambda. Each member is a frame linearised about a motion. Motions are
  !> stored at equidistant phases, shape (samples, dofs), divided by `units`; the degrees of freedom are in the frame's order.
  type, abstract, public :: path_family_type
    type(accuracy_type) :: accuracy
    real(dp), allocatable :: units(:)
    !> True if the equations are linear in lambda and the frame is at rest for lambda = 0
    logical :: from_rest = .false.
    !> `difference`: step of lambda for difference quotients. `precise`: tolerance of the two motions whose difference is formed.
    !> Errors of 1e-8 over a step of 1e-3 make the quotients accurate to 1e-5
    real(dp) :: difference = 1.0e-3_dp, precise = 1.0e-8_dp
    !> `close`: a motion has converged if its relative correction is smaller than this. `last_lambda`: largest lambda for which a
    !> machine exists
    real(dp) :: close = 1.0e-3_dp, last_lambda = huge(1.0_dp)
    !> True if the multipliers are computed together with every iterate
    logical :: multipliers = .false.
    !> Angles of the multipliers of the last iterate: see `angles` of `iterate_type`
    real(dp), allocatable :: angles(:, :)
    !> Number of linear systems that may still be solved. It limits the length of every search
    integer :: left = 200
  contains
    procedure(member_at), deferred :: member
    procedure :: solve_both, turn
  end type path_family_type

  !> The next iterate of Newton's method, computed from the frame linearised about a motion.
  type, public :: iterate_type
    !> The iterate at equidistant phases, shape (samples, dofs)
    real(dp), allocatable :: q(:, :)
    !> True if a fast solver (harmonic balance or fast integration) computed the iterate
    logical :: quickly = .true.
    !> Multipliers in the upper half plane, if requested, shape (n, 2). Column 1: their arguments, ascending. Column 2: |ln
    !> abs(rho)|
    real(dp), allocatable :: angles(:, :)
  end type iterate_type

  abstract interface
    !> Returns the machine at lambda, not yet linearised about a motion. Fails if no machine exists at lambda.
    subroutine member_at(self, lambda, varied, error)
      import :: dp, error_type, path_family_type, varied_frame_type
      implicit none (type, external)
      class(path_family_type), intent(in) :: self
      real(dp), intent(in) :: lambda
      type(varied_frame_type), intent(out) :: varied
      type(error_type), allocatable, intent(out) :: error
    end subroutine member_at
  end interface

  !> A point of the path: the motion `q` and the parameter `lambda`. The tangent of the path consists of `along` (for the motion)
  !> and `rise` (for lambda).
  type, public :: point_type
    real(dp), allocatable :: q(:, :), along(:, :)
    real(dp) :: lambda = 0, rise = 1
  end type point_type

  !> Initial, minimum and maximum arc length of a step along the path.
  real(dp), parameter, public :: first_arc = 0.2_dp, min_arc = 1.0e-4_dp, max_arc = 0.5_dp
  !> A path ends if the rotation of the frame exceeds this angle (rad).
  real(dp), parameter, public :: furthest_turn = 3
  !> `largest_change`: maximum relative correction of a motion. `min_cosine`: minimum cosine of the angle between successive
  !> tangents.
  real(dp), parameter :: largest_change = 0.3_dp, min_cosine = 0.8_dp
  !> Maximum number of corrections of a predicted point.
  integer, parameter :: max_corrections = 6
  !> Relative error allowed for an iterate of a fast solver (harmonic balance or fast integration).
  real(dp), parameter :: of_iterate = 1.0e-6_dp
  !> Cost of a full solution, as a multiple of the cost of a fast solution.
  integer, parameter, public :: slow = 50

contains

  !> Units of the degrees of freedom of `frame`, which make rotations comparable to displacements, shape (dofs).
  pure function units_of(frame) result(units)
    class(frame_type), intent(in) :: frame
    real(dp) :: units(frame%dofs()), mass, inertia
    integer :: i

    units = 1
    mass = frame%mass + frame%mechanism%mass
    ! for a tensor of inertia: the mean of its diagonal elements, which does not depend on the axes
    associate (moments => frame%moments_of_inertia())
      inertia = sum(moments) / size(moments) + frame%mechanism%inertia
    end associate
    if (.not. (mass > 0 .and. inertia > 0)) return
    where (is_rotation([(i, i = 1, size(units))])) units = sqrt(mass / inertia)
  end function units_of

  !> Largest rotation of the frame (rad) in the motion q.
  pure real(dp) function turn(self, q)
    class(path_family_type), intent(in) :: self
    real(dp), intent(in) :: q(:, :)
    logical :: turns(size(self%units))
    integer :: i

    turns = is_rotation([(i, i = 1, size(turns))])
    turn = maxval([(norm2(pack(q(i, :) * self%units, turns)), i = 1, size(q, 1))])
  end function turn

  !> Computes the point of the path at `lambda` that is close to the motion q. Fails if `linearise` fails.
  subroutine first_point(family, q, lambda, way, at, error)
    class(path_family_type), intent(inout) :: family
    !> A motion close to the vibration, and the value of lambda
    real(dp), intent(in) :: q(:, :), lambda
    !> Direction of the tangent: 1 towards larger lambda, -1 towards smaller lambda
    integer, intent(in) :: way
    type(point_type), intent(out) :: at
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: q_a(:, :), q_b(:, :)

    call linearise(family, q, lambda, q_a, q_b, error)
    if (allocated(error)) return
    at%lambda = lambda
    at%q = q_a + lambda * q_b
    if (family%from_rest) at%q = 0 * q_a
    at%along = q_b * way
    at%rise = way
    call set_length(at, max(size_of(at%q), size_of(q_b) * merge(1, 0, family%from_rest)))
  end subroutine first_point

  !> Follows the path from the point `at` by the arc length `arc`. Fails if the corrections do not converge, or if the tangent turns
  !> too far.
  subroutine advance(family, at, arc, next, easy, error)
    class(path_family_type), intent(inout) :: family
    type(point_type), intent(in) :: at
    real(dp), intent(in) :: arc
    !> The new point of the path
    type(point_type), intent(out) :: next
    !> True if one or two corrections were sufficient
    logical, intent(out) :: easy
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: q_a(:, :), q_b(:, :), predicted(:, :), along(:, :), q(:, :)
    real(dp) :: scale, lambda, change, last, cosine
    integer :: j

    easy = .false.
    scale = size_of(at%q)
    if (.not. scale > 0) scale = size_of(at%along) / abs(at%rise)
    next%q = at%q + arc * at%along
    lambda = at%lambda + arc * at%rise
    next%lambda = lambda
    last = huge(last)
    do j = 1, max_corrections
      call linearise(family, next%q, next%lambda, q_a, q_b, error)
      if (allocated(error)) return
      associate (n => size(q_a, 1))
        next%q = resampled(next%q, n)
        along = resampled(at%along, n)
        predicted = resampled(at%q, n) + arc * along
      end associate
      next%lambda = (at%rise * lambda - inner(along, q_a - predicted) / scale**2) / (at%rise + inner(along, q_b) / scale**2)
      q = q_a + next%lambda * q_b
      change = size_of(q - next%q) / max(size_of(q), tiny(change))
      if (.not. (ieee_is_finite(change) .and. change < min(largest_change, last))) exit
      next%q = q
      last = change
      if (change < family%close) then
        next%along = q_b
        next%rise = 1
        call set_length(next, scale)
        ! Choose the sign of the tangent so that the path continues in the same direction.
        cosine = inner(along, next%along) / scale**2 + at%rise * next%rise
        next%along = sign(1.0_dp, cosine) * next%along
        next%rise = sign(1.0_dp, cosine) * next%rise
        if (abs(cosine) < min_cosine) exit
        call set_length(next, size_of(next%q))
        easy = j <= 2
        return
      end if
    end do
    call fatal_error(error, "the branch of vibrations cannot be continued: Newton's method did not converge", failed_computation)
  end subroutine advance

  !> Motion at the fraction x of the arc between two points of the path, interpolated by the cubic that has the values and tangents
  !> of both points.
  function between(x, from, to, arc) result(q)
    real(dp), intent(in) :: x, arc
    type(point_type), intent(in) :: from, to
    real(dp), allocatable :: q(:, :)
    integer :: n

    n = max(size(from%q, 1), size(to%q, 1))
    q = cubic(x, resampled(from%q, n), resampled(to%q, n), arc * resampled(from%along, n), arc * resampled(to%along, n))
  end function between

  !> Value at x of the cubic with given values and slopes at two points: a and `slope_a` at x = 0, b and `slope_b` at x = 1.
  elemental real(dp) function cubic(x, a, b, slope_a, slope_b)
    real(dp), intent(in) :: x, a, b, slope_a, slope_b

    cubic = (1 + 2 * x) * (1 - x)**2 * a + x**2 * (3 - 2 * x) * b + x * (1 - x)**2 * slope_a - x**2 * (1 - x) * slope_b
  end function cubic

  !> Scales the tangent to length 1; motions are measured relative to `scale`.
  pure subroutine set_length(point, scale)
    type(point_type), intent(inout) :: point
    real(dp), intent(in) :: scale
    real(dp) :: length

    length = hypot(size_of(point%along) / max(scale, tiny(scale)), point%rise)
    point%along = point%along / length
    point%rise = point%rise / length
  end subroutine set_length

  !> Computes the next iterate of Newton's method as a linear function of lambda, q_a + lambda q_b, from the frame linearised
  !> about the motion q. The function is exact if the path starts from rest; otherwise it is valid near `lambda`. Fails if the
  !> permitted number of linear systems is used up, if too many samples are needed, or if `next_motion` fails.
  subroutine linearise(family, q, lambda, q_a, q_b, error)
    class(path_family_type), intent(inout) :: family
    real(dp), intent(in) :: q(:, :), lambda
    real(dp), allocatable, intent(out) :: q_a(:, :), q_b(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(iterate_type) :: next(2)
    real(dp) :: ends(2)

    family%left = family%left - 2
    if (family%left < 0) then
      call fatal_error(error, "the continuation of the branch of vibrations exceeded the permitted number of steps", &
        & failed_computation)
      return
    end if
    ends = [lambda, lambda + family%difference]
    if (ends(2) > family%last_lambda) ends(2) = lambda - family%difference
    if (family%from_rest) ends = [0.0_dp, 1.0_dp]
    if (family%from_rest .and. .not. any(abs(q) > 0)) then
      next(1)%q = q                                                ! no excitation: the frame is at rest
      call next_iterate(family, q, ends(2), size(q, 1), next(2), error)
    else
      call family%solve_both(q, ends, next, error)
    end if
    if (.not. family%multipliers) family%left = family%left - slow * count(.not. next%quickly)
    if (allocated(error)) return
    if (allocated(next(2)%angles)) family%angles = next(2)%angles
    q_a = resampled(next(1)%q, size(next(2)%q, 1))
    q_b = (next(2)%q - q_a) / (ends(2) - ends(1))
    q_a = q_a - ends(1) * q_b
  end subroutine linearise

  !> Computes the next iterates from the motion q for the two values of lambda in `ends`. The second iterate has at least as many
  !> samples as the first. Fails if `next_iterate` fails.
  subroutine solve_both(self, q, ends, next, error)
    class(path_family_type), intent(in) :: self
    real(dp), intent(in) :: q(:, :), ends(2)
    type(iterate_type), intent(inout) :: next(2)
    type(error_type), allocatable, intent(out) :: error

    call next_iterate(self, q, ends(1), size(q, 1), next(1), error)
    if (.not. allocated(error)) call next_iterate(self, q, ends(2), size(next(1)%q, 1), next(2), error)
  end subroutine solve_both

  !> Computes the next iterate from the motion q at `lambda`, with at least `samples` samples. Fails if the motion needs too many
  !> samples, or if `next_motion` fails.
  subroutine next_iterate(family, q, lambda, samples, next, error)
    class(path_family_type), intent(in) :: family
    real(dp), intent(in) :: q(:, :), lambda
    integer, intent(in) :: samples
    type(iterate_type), intent(out) :: next
    type(error_type), allocatable, intent(out) :: error
    type(varied_frame_type) :: about
    type(next_type) :: solved
    !> An unallocated actual argument counts as absent for an optional argument
    type(floquet_type), allocatable :: floquet

    call family%member(lambda, about, error)
    if (allocated(error)) return
    call about%linearise_about(motion_of(family, q))
    solved%of_step = of_iterate
    solved%intermediate = .true.
    if (family%multipliers) allocate(floquet)
    call next_motion(about, about, with_min_tolerance(family%accuracy, family%precise), samples, solved, error, floquet=floquet)
    next%quickly = solved%quickly
    if (allocated(error)) return
    next%q = solved%q / spread(family%units, 1, size(solved%q, 1))
    if (too_rough(about, solved)) call fatal_error(error, "a motion on the branch of vibrations has too many harmonics", &
      & failed_computation)
    if (family%multipliers) next%angles = angles_of(floquet)
  end subroutine next_iterate

  !> Angles of the multipliers, shape (n, 2) (see `angles` of `iterate_type`); n = 0 if there are no multipliers.
  function angles_of(floquet) result(angles)
    type(floquet_type), intent(in) :: floquet
    real(dp), allocatable :: angles(:, :)
    type(multipliers_type) :: multipliers
    type(error_type), allocatable :: error

    call solve_multipliers(floquet, .false., multipliers, error)
    allocate(angles(0, 2))
    if (allocated(error)) return
    associate (upper => multipliers%arg > 0)
      associate (order => ascending(pack(multipliers%arg, upper)))
        angles = reshape([pack(multipliers%arg, upper), pack(abs(multipliers%log_abs), upper)], [size(order), 2])
        angles = angles(order, :)
      end associate
    end associate
  end function angles_of

  !> Motion at the fraction `part` of the arc between two points of the path, with as many samples as the second point has.
  function middle_of(at, next, part) result(q)
    type(point_type), intent(in) :: at, next
    real(dp), intent(in) :: part
    real(dp), allocatable :: q(:, :)

    q = resampled(at%q, size(next%q, 1)) * (1 - part) + next%q * part
  end function middle_of

  !> Fourier series of a motion whose samples are given in the family's units.
  pure function motion_of(family, q) result(motion)
    class(path_family_type), intent(in) :: family
    real(dp), intent(in) :: q(:, :)
    type(series_type) :: motion

    motion = series_through(spread(family%units, 1, size(q, 1)) * q)
  end function motion_of

  !> The motion q, interpolated at `samples` equidistant phases.
  function resampled(q, samples) result(more)
    real(dp), intent(in) :: q(:, :)
    integer, intent(in) :: samples
    real(dp), allocatable :: more(:, :)

    if (size(q, 1) == samples) then
      more = q
    else
      more = values_of(series_through(q), samples)
    end if
  end function resampled

  !> Mean over the turn of the scalar product u . v.
  pure real(dp) function inner(u, v)
    real(dp), intent(in) :: u(:, :), v(:, :)

    inner = sum(u * v) / size(u, 1)
  end function inner

  !> Rms of a motion over the turn.
  pure real(dp) function size_of(q)
    real(dp), intent(in) :: q(:, :)

    size_of = sqrt(inner(q, q))
  end function size_of

end module gestell_study_frame_model_path
