!> The vibrations of the exact frame over a parameter lambda from 0 to 1: the part of the excitation that acts, from rest, or the
!> speed, from another one.
!>
!> The path (q, lambda) is followed along its arc (H. B. Keller, 1977), so it goes round turning points, where lambda comes back
!> and Newton's method with a given lambda ends. The next iterate about a motion q is, to first order in lambda, q_a + lambda q_b,
!> and the condition
!>
!>     <t_q, q - q_p> + t_lambda (lambda - lambda_p) = 0
!>
!> on the way from the predicted point (q_p, lambda_p) across the path's tangent (t_q, t_lambda) tells lambda. As Newton's map has
!> no derivative at a vibration, the tangent there is (q_b, 1).
module gestell_study_vibration_path
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_base_trigonometric, only: series_through, series_type
  use gestell_floquet_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_model_varied_frame, only: varied_frame_type
  use gestell_study_newton, only: first_samples, iterate, loosened, next_motion, next_type, rough, values_of
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: follow_excitation, follow_speed

  !> A family of frames varied about motions; motions at equidistant phases, shape (samples, 3), over `units` (m, m, rad).
  type :: family_type
    type(varied_frame_type) :: varied
    type(accuracy_type) :: accuracy
    real(dp) :: units(3) = 1
    !> Whether lambda is the part of the excitation; else it tells the speed between these at 0 and 1 (rad/s).
    logical :: over_excitation = .true.
    real(dp) :: speeds(2) = 0
    !> Linear systems that may still be solved: a search has to end.
    integer :: left = 200
  end type family_type

  !> A point of the path with its tangent.
  type :: point_type
    real(dp), allocatable :: q(:, :), along(:, :)
    real(dp) :: lambda = 0, rise = 1
  end type point_type

  !> The first arc, the least, the greatest; by what part of it a motion may be corrected, what is close enough, and the least
  !> cosine of the angle between tangents.
  real(dp), parameter :: first_arc = 0.2_dp, least_arc = 1.0e-4_dp, greatest_arc = 0.5_dp, greatest_change = 0.3_dp, &
    & close = 1.0e-3_dp, least_cosine = 0.8_dp
  integer, parameter :: most_points = 50, most_corrections = 6, most_samples = 512
  !> A lambda beyond this ends a path, and so does a motion that is this small beside the greatest: back at rest.
  real(dp), parameter :: furthest_back = -1.0_dp, back_at_rest = 1.0e-4_dp
  !> A frame that turns further (rad) ends it too.
  real(dp), parameter :: furthest_turn = 1.0_dp
  !> Speeds that a path may start from, relative to the ordered one: a machine comes there from slower ones, and beyond a jump its
  !> vibration is that of faster ones.
  real(dp), parameter :: other_speeds(*) = [0.97_dp, 1.03_dp, 0.9_dp, 1.1_dp]

  character(len=*), parameter :: unfound = "no periodic vibration of the exact frame was found, neither from the linear one nor " &
    & // "on paths from rest and from other speeds"

contains

  !> `varied` becomes `frame` varied about its vibration, the first on the path from rest over the excitation. Error: both ways
  !> from rest end before.
  subroutine follow_excitation(frame, accuracy, varied, steps, error)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(varied_frame_type), intent(inout) :: varied
    !> As of `iterate`.
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    type(family_type) :: family
    real(dp), allocatable :: rest(:, :)
    integer :: way

    call new_family(frame, accuracy, varied, family)
    allocate(rest(first_samples, 3), source=0.0_dp)
    do way = 1, -1, -2
      call follow_path(family, frame, rest, way, varied, steps, error)
      if (.not. allocated(error)) return
    end do
  end subroutine follow_excitation

  !> The same over the speed, from another one.
  subroutine follow_speed(frame, accuracy, varied, steps, error)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(varied_frame_type), intent(inout) :: varied
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    type(family_type) :: family
    class(frame_type), allocatable :: other
    type(varied_frame_type) :: start
    integer :: k

    call new_family(frame, accuracy, varied, family)
    family%over_excitation = .false.
    do k = 1, size(other_speeds)
      family%speeds = frame%speed * [other_speeds(k), 1.0_dp]
      start = member(family, 0.0_dp)
      other = frame
      other%speed = start%speed
      other%period = start%period
      call iterate(other, loosened(accuracy, rough), .false., start, steps, error)
      if (allocated(error)) then
        error%message = unfound
        cycle
      end if
      call follow_path(family, frame, values_of(start%motion, first_samples) / spread(family%units, 1, first_samples), 1, &
        & varied, steps, error)
      if (.not. allocated(error)) return
    end do
  end subroutine follow_speed

  pure subroutine new_family(frame, accuracy, varied, family)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(varied_frame_type), intent(in) :: varied
    type(family_type), intent(out) :: family

    family%varied = varied
    family%accuracy = accuracy
    associate (mass => frame%mass + frame%mechanism%mass, inertia => frame%inertia + frame%mechanism%inertia)
      if (mass > 0 .and. inertia > 0) family%units(3) = sqrt(mass / inertia)
    end associate
  end subroutine new_family

  !> The member at lambda, varied about no motion yet.
  pure function member(family, lambda) result(varied)
    type(family_type), intent(in) :: family
    real(dp), intent(in) :: lambda
    type(varied_frame_type) :: varied

    varied = family%varied
    if (family%over_excitation) then
      varied%excitation = lambda
    else
      varied%speed = family%speeds(1) + lambda * (family%speeds(2) - family%speeds(1))
      varied%period = 2 * pi / abs(varied%speed)
    end if
  end function member

  !> The path from the vibration q at lambda = 0, at first up or down (`way` = 1 or -1), to that at lambda = 1, which `varied`
  !> becomes varied about. Error: it ends before.
  subroutine follow_path(family, frame, q, way, varied, steps, error)
    type(family_type), intent(inout) :: family
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: q(:, :)
    integer, intent(in) :: way
    type(varied_frame_type), intent(inout) :: varied
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    type(varied_frame_type) :: found
    type(point_type) :: at, next
    real(dp), allocatable :: q_a(:, :), q_b(:, :)
    real(dp) :: arc, part, greatest
    logical :: easy
    integer :: k

    call linearise(family, q, 0.0_dp, q_a, q_b, error)
    if (allocated(error)) then
      error%message = unfound
      return
    end if
    at%q = q_a
    if (family%over_excitation) at%q = 0
    at%along = q_b * way
    at%rise = way
    call set_length(at, max(size_of(at%q), size_of(q_b) * merge(1, 0, family%over_excitation)))
    arc = first_arc
    greatest = 0
    do k = 1, most_points
      call advance(family, at, arc, next, easy, error)
      if (.not. allocated(error) .and. next%lambda >= 1) then
        part = (1 - at%lambda) / (next%lambda - at%lambda)
        found = member(family, 1.0_dp)
        found%motion = motion_of(family, resampled(at%q, size(next%q, 1)) * (1 - part) + next%q * part)
        call iterate(frame, family%accuracy, .false., found, steps, error)
        if (.not. allocated(error)) then
          varied = found
          return
        end if
      end if
      if (allocated(error)) then
        arc = arc / 4
        if (arc < least_arc) exit
      else
        at = next
        greatest = max(greatest, size_of(at%q))
        if (easy) arc = min(2 * arc, greatest_arc)
        if (at%lambda < furthest_back .or. size_of(at%q) < back_at_rest * greatest) exit
        if (maxval(abs(at%q(:, 3))) * family%units(3) > furthest_turn) exit
      end if
    end do
    call fatal_error(error, unfound, failed_computation)
  end subroutine follow_path

  !> From `at` along the path by `arc`. `easy`: few corrections did. Error: too far.
  subroutine advance(family, at, arc, next, easy, error)
    type(family_type), intent(inout) :: family
    type(point_type), intent(in) :: at
    real(dp), intent(in) :: arc
    type(point_type), intent(out) :: next
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
    do j = 1, most_corrections
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
      if (.not. (ieee_is_finite(change) .and. change < min(greatest_change, last))) exit
      next%q = q
      last = change
      if (change < close) then
        next%along = q_b
        next%rise = 1
        call set_length(next, scale)
        ! On, not back.
        cosine = inner(along, next%along) / scale**2 + at%rise * next%rise
        next%along = sign(1.0_dp, cosine) * next%along
        next%rise = sign(1.0_dp, cosine) * next%rise
        if (abs(cosine) < least_cosine) exit
        call set_length(next, size_of(next%q))
        easy = j <= 2
        return
      end if
    end do
    call fatal_error(error, "the path is lost", failed_computation)
  end subroutine advance

  !> The tangent gets length 1 where motions count over `scale`.
  pure subroutine set_length(point, scale)
    type(point_type), intent(inout) :: point
    real(dp), intent(in) :: scale
    real(dp) :: length

    length = hypot(size_of(point%along) / max(scale, tiny(scale)), point%rise)
    point%along = point%along / length
    point%rise = point%rise / length
  end subroutine set_length

  !> The next iterate of Newton's method about the motion q is q_a + lambda q_b: exactly over the excitation, over the speed near
  !> `lambda`. Error: too many samples; as of `next_motion`.
  subroutine linearise(family, q, lambda, q_a, q_b, error)
    type(family_type), intent(inout) :: family
    real(dp), intent(in) :: q(:, :), lambda
    real(dp), allocatable, intent(out) :: q_a(:, :), q_b(:, :)
    type(error_type), allocatable, intent(out) :: error
    !> Beside errors of 1e-8 differences over this are good for 1e-5.
    real(dp), parameter :: difference = 1.0e-3_dp, precise = 1.0e-8_dp
    real(dp) :: ends(2)

    family%left = family%left - 2
    if (family%left < 0) then
      call fatal_error(error, "the search has no end", failed_computation)
      return
    end if
    ends = [lambda, lambda + difference]
    if (family%over_excitation) ends = [0.0_dp, 1.0_dp]
    call next_of(ends(1), size(q, 1), q_a)
    if (.not. allocated(error)) call next_of(ends(2), size(q_a, 1), q_b)
    if (allocated(error)) return
    q_a = resampled(q_a, size(q_b, 1))
    q_b = (q_b - q_a) / (ends(2) - ends(1))
    q_a = q_a - ends(1) * q_b

  contains

    subroutine next_of(at, samples, next)
      real(dp), intent(in) :: at
      integer, intent(in) :: samples
      real(dp), allocatable, intent(out) :: next(:, :)
      type(varied_frame_type) :: about
      type(next_type) :: found

      about = member(family, at)
      about%motion = motion_of(family, q)
      call next_motion(about, about, loosened(family%accuracy, precise), samples, found, error)
      if (allocated(error)) return
      next = found%q / spread(family%units, 1, size(found%q, 1))
      if (size(next, 1) > most_samples) call fatal_error(error, "the motion on the path is too rough", failed_computation)
    end subroutine next_of

  end subroutine linearise

  !> A motion of samples over the units as a series.
  pure function motion_of(family, q) result(motion)
    type(family_type), intent(in) :: family
    real(dp), intent(in) :: q(:, :)
    type(series_type) :: motion

    motion = series_through(spread(family%units, 1, size(q, 1)) * q)
  end function motion_of

  !> A motion at more equidistant phases.
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

  !> The mean over the turn of u . v.
  pure real(dp) function inner(u, v)
    real(dp), intent(in) :: u(:, :), v(:, :)

    inner = sum(u * v) / size(u, 1)
  end function inner

  !> The root of the mean square of a motion.
  pure real(dp) function size_of(q)
    real(dp), intent(in) :: q(:, :)

    size_of = sqrt(inner(q, q))
  end function size_of

end module gestell_study_vibration_path
