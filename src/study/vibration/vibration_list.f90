!> Finds several periodic vibrations of one machine at one speed.
!>
!> Vibrations are followed in both directions while a parameter varies: the speed, from every known vibration, or the excitation,
!> from rest. Where such a path crosses the machine's own speed or excitation, there is a vibration of the machine. The index of a
!> vibration is the sign of det(E - Phi), where Phi is the monodromy matrix and E the unit matrix. The index is -1 if the number
!> of real multipliers above 1 is odd, as between two turning points, otherwise 1. Without excitation there is one vibration, the
!> state of rest, with the index 1. Vibrations appear and vanish in pairs of opposite index, so the indices add up to 1
!> (doc/theory.md, "The vibration").
module gestell_study_vibration_vibration_list
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_math_sorting, only: ascending
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_study_frame_model_newton, only: first_samples, iterate, values_of
  use gestell_study_frame_model_path, only: advance, cubic, first_point, furthest_turn, min_arc, middle_of, motion_of, &
    & path_family_type, point_type, size_of, units_of
  use gestell_study_vibration, only: solve_vibration, vibration_type
  use gestell_study_frame_model_vibration_path, only: machine_path
  implicit none (type, external)
  private

  public :: index_sum, list_vibrations, search_vibrations

  !> One of several vibrations of the same machine.
  type, public :: listed_vibration_type
    !> True for the vibration to which the other sections of the report refer
    logical :: is_reported = .false.
    type(multipliers_type) :: multipliers
    !> `peak`: maxima of the degrees of freedom over the turn (m, rad). `peak_error`: bounds on their errors. `rms`: rms values. All
    !> have shape (dofs)
    real(dp), allocatable :: peak(:), peak_error(:), rms(:)
  contains
    procedure :: vibration_index
  end type listed_vibration_type

  !> `furthest_speed`: maximum distance from the machine's own speed at which a vibration is followed, relative to this speed.
  !> `furthest_excitation`: continuation from rest ends at this multiple of the machine's actual excitation.
  real(dp), parameter :: furthest_speed = 0.1_dp, furthest_excitation = 3
  !> `short_arc`: length of the first arc. `long_arc`: maximum length of an arc, so short that the continuation does not jump from
  !> one vibration to another.
  real(dp), parameter :: short_arc = 0.02_dp, long_arc = 0.2_dp
  !> `max_points`: maximum number of points of a path. `max_systems`: maximum number of linear systems that are solved for a path.
  integer, parameter :: max_points = 200, max_systems = 500
  !> Two motions count as equal if their relative difference is smaller than this.
  real(dp), parameter :: equality_tolerance = 1.0e-6_dp
  !> Maximum number of vibrations that are listed.
  integer, parameter :: max_vibrations = 20

contains

  !> Extends `list`, which contains known vibrations of `frame`, by the vibrations that are found by continuation from these
  !> vibrations and from rest.
  subroutine search_vibrations(frame, accuracy, list)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(varied_frame_type), allocatable, intent(inout) :: list(:)
    real(dp), allocatable :: rest(:, :)
    real(dp) :: speed
    integer :: i, way

    allocate(rest(first_samples, frame%dofs()), source=0.0_dp)
    do way = 1, -1, -2
      call follow_branch(frame, machine_path(varied_frame(frame, list(1)%motion), accuracy), rest, 1.0_dp, furthest_excitation, &
        & way, list)
    end do
    i = 1
    do while (i <= size(list) .and. size(list) < max_vibrations)
      ! a copy, because the list is reallocated when vibrations are added
      speed = list(i)%speed
      do way = 1, -1, -2
        call follow_branch(frame, &
          & machine_path(varied_frame(frame, list(i)%motion), accuracy, speed * [1.0_dp, 1 + furthest_speed]), &
          & values_of(list(i)%motion, max(first_samples, 2 * ubound(list(i)%motion%cosine, 1) + 2)), 0.0_dp, 1.0_dp, way, list)
      end do
      i = i + 1
    end do
  end subroutine search_vibrations

  !> Follows a path of vibrations over a parameter lambda (speed or excitation), from the motion q at lambda = 0. At lambda =
  !> `home` the parameter has the machine's own value; the vibrations found there are added to `list`. The path ends if
  !> abs(lambda) exceeds `furthest`, if continuation with varying speed reaches a known vibration, if Newton's method fails, or if
  !> the frame rotates too far. It also ends when the maximum number of points or of linear systems is reached.
  subroutine follow_branch(frame, start, q, home, furthest, way, list)
    class(frame_type), intent(in) :: frame
    class(path_family_type), intent(in) :: start
    real(dp), intent(in) :: q(:, :), home, furthest
    integer, intent(in) :: way
    type(varied_frame_type), allocatable, intent(inout) :: list(:)
    class(path_family_type), allocatable :: family
    type(point_type) :: at, next
    type(error_type), allocatable :: error
    real(dp) :: arc
    logical :: easy, known, again
    integer :: k

    allocate(family, source=start)
    family%left = max_systems
    ! If the speed varies along the path, q is needed in the family's units.
    call first_point(family, q / spread(family%units, 1, size(q, 1)), 0.0_dp, way, at, error)
    if (allocated(error)) return
    arc = short_arc
    known = .false.
    do k = 1, max_points
      call advance(family, at, arc, next, easy, error)
      again = allocated(error)
      if (.not. again) again = crosses_home_twice(at, next, arc, home)
      if (again) then
        arc = arc / 4
        if (arc < min_arc) return
        cycle
      end if
      if ((at%lambda - home) * (next%lambda - home) < 0) call add_crossing(frame, family, at, next, arc, home, list, known)
      at = next
      if (easy) arc = min(2 * arc, long_arc)
      ! If continuation with varying speed reaches a known vibration, its path is the same as the path that starts from that
      ! vibration.
      if (known .and. .not. family%from_rest) return
      if (abs(at%lambda) > furthest .or. family%turn(at%q) > furthest_turn) return
    end do
  end subroutine follow_branch

  !> True if the path crosses lambda = `home` twice between two points that lie on the same side of `home`. Between the points
  !> lambda is approximated by the cubic that has the values and slopes of both points.
  pure logical function crosses_home_twice(at, next, arc, home)
    type(point_type), intent(in) :: at, next
    real(dp), intent(in) :: arc, home
    integer, parameter :: samples = 16
    real(dp) :: lambda
    integer :: k

    crosses_home_twice = .false.
    if (at%rise * next%rise >= 0 .or. (at%lambda - home) * (next%lambda - home) <= 0) return
    do k = 1, samples - 1
      lambda = cubic(real(k, dp) / samples, at%lambda, next%lambda, arc * at%rise, arc * next%rise)
      crosses_home_twice = crosses_home_twice .or. (lambda - home) * (at%lambda - home) < 0
    end do
  end function crosses_home_twice

  !> Computes the vibration at lambda = `home`, where the parameter lambda has the machine's own value, between the points `from`
  !> and `to` of a path. Adds it to `list`, or sets `known` to true if `list` already contains it. `arc`: length of the path from
  !> the first point to the second.
  subroutine add_crossing(frame, family, from, to, arc, home, list, known)
    class(frame_type), intent(in) :: frame
    class(path_family_type), intent(inout) :: family
    type(point_type), intent(in) :: from, to
    real(dp), intent(in) :: arc, home
    type(varied_frame_type), allocatable, intent(inout) :: list(:)
    logical, intent(inout) :: known
    !> Number of secant steps towards lambda = `home`. They bring the start so close that Newton's method does not converge to
    !> another vibration.
    integer, parameter :: secants = 2
    real(dp), parameter :: min_tolerance = 1.0e-12_dp
    type(varied_frame_type) :: found
    type(varied_frame_type), allocatable :: longer(:)
    type(point_type) :: at, next, middle
    type(error_type), allocatable :: error
    real(dp), allocatable :: steps(:)
    type(accuracy_type) :: fine
    real(dp) :: part, left
    logical :: easy
    integer :: i, k

    at = from
    next = to
    left = arc
    do k = 0, secants
      part = (home - at%lambda) / (next%lambda - at%lambda)
      if (k == secants) exit
      call advance(family, at, part * left, middle, easy, error)
      if (allocated(error)) exit
      if ((at%lambda - home) * (middle%lambda - home) < 0) then
        next = middle
        left = part * left
      else
        at = middle
        left = (1 - part) * left
      end if
    end do
    call family%member(home, found, error)
    if (allocated(error)) return
    call found%linearise_about(motion_of(family, middle_of(at, next, part)))
    ! The tolerance is tighter than requested, because the last step of Newton's method counts as the motion's error.
    fine = family%accuracy
    fine%tolerance = max(fine%tolerance / 100, min(fine%tolerance, min_tolerance))
    call iterate(frame, fine, .false., found, steps, error)
    if (allocated(error)) return
    do i = 1, size(list)
      known = known .or. same(list(i), found, family%units)
    end do
    if (known) return
    allocate(longer(size(list) + 1))
    do i = 1, size(list)
      longer(i) = list(i)
    end do
    longer(size(longer)) = found
    call move_alloc(longer, list)
  end subroutine add_crossing

  !> True if two motions are equal within the tolerance `equality_tolerance`.
  logical function same(one, other, units)
    type(varied_frame_type), intent(in) :: one, other
    real(dp), intent(in) :: units(:)
    real(dp), allocatable :: q(:, :), r(:, :)
    integer :: samples

    samples = 2 * max(ubound(one%motion%cosine, 1), ubound(other%motion%cosine, 1)) + 2
    q = values_of(one%motion, samples) / spread(units, 1, samples)
    r = values_of(other%motion, samples) / spread(units, 1, samples)
    same = size_of(q - r) <= equality_tolerance * size_of(q)
  end function same

  !> Computes multipliers and peaks of each vibration in `list`, and sorts the vibrations in ascending order of size. Fails if
  !> `solve_floquet` or `solve_vibration` fails.
  subroutine list_vibrations(list, accuracy, points, harmonics, several, error)
    !> The vibrations. The first one is that to which the other sections of the report refer
    type(varied_frame_type), intent(in) :: list(:)
    type(accuracy_type), intent(in) :: accuracy
    !> Number of intervals of the history, and minimum number of harmonics
    integer, intent(in) :: points, harmonics
    type(listed_vibration_type), allocatable, intent(out) :: several(:)
    type(error_type), allocatable, intent(out) :: error
    type(floquet_type) :: floquet
    type(vibration_type) :: vibration
    type(listed_vibration_type) :: found(size(list))
    integer :: order(size(list)), i, dofs

    do i = 1, size(list)
      call solve_floquet(list(i), accuracy, .true., floquet, error)
      if (.not. allocated(error)) call solve_multipliers(floquet, .false., found(i)%multipliers, error)
      if (.not. allocated(error)) call solve_vibration(list(i), floquet, points, harmonics, vibration, error)
      if (allocated(error)) return
      dofs = list(i)%dofs()
      found(i)%is_reported = i == 1
      found(i)%peak = vibration%peak(:dofs)
      found(i)%peak_error = vibration%peak_error(:dofs)
      found(i)%rms = vibration%rms(:dofs)
    end do
    order = ascending([(norm2(found(i)%rms / units_of(list(1))), i = 1, size(list))])
    allocate(several(size(list)))
    do i = 1, size(list)
      several(i) = found(order(i))
    end do
  end subroutine list_vibrations

  !> Index of the vibration, 1 or -1: the sign of det(E - Phi) with the monodromy matrix Phi and the unit matrix E.
  pure integer function vibration_index(self)
    class(listed_vibration_type), intent(in) :: self

    associate (m => self%multipliers)
      vibration_index = 1 - 2 * modulo(count(real(m%rho) > 1 .and. .not. abs(aimag(m%rho)) > 0), 2)
    end associate
  end function vibration_index

  !> Sum of the indices of all vibrations: 1 if no vibration is missing.
  pure integer function index_sum(several)
    type(listed_vibration_type), intent(in) :: several(:)
    integer :: i

    index_sum = sum([(several(i)%vibration_index(), i = 1, size(several))])
  end function index_sum

end module gestell_study_vibration_vibration_list
