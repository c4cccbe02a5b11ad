!> Finds the vibration of the exact frame by continuation: vibrations are followed along a path while a parameter lambda grows from
!> 0 to 1 (gestell_study_frame_model_path).
!>
!> The parameter lambda stands for one of three quantities:
!>
!> - the excitation, from zero to its actual value,
!> - the speed, from another speed to the requested one,
!> - damping between frame and ground in addition to the machine's own, from very heavy damping to none.
!>
!> The path with varying damping leads to the vibration if the machine has a bounded vibration for every damping on the path. Under
!> heavy damping there is only one vibration, so the path cannot return to its start.
module gestell_study_frame_model_vibration_path
  use gestell_base_error, only: error_type, failed_computation, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_study_frame_model_newton, only: first_samples, iterate, with_min_tolerance, rough, values_of
  use gestell_study_frame_model_path, only: advance, first_arc, first_point, furthest_turn, max_arc, min_arc, middle_of, &
    & motion_of, path_family_type, point_type, size_of, slow, units_of
  implicit none (type, external)
  private

  public :: follow_damping, follow_excitation, follow_speed, machine_path

  !> The path of one machine while its excitation, its speed or its added damping varies.
  type, extends(path_family_type), public :: machine_path_type
    !> The machine, a frame linearised about a motion
    type(varied_frame_type) :: varied
    !> Speeds at lambda = 0 and lambda = 1 (rad/s); not used if the excitation varies
    real(dp) :: speeds(2) = 0
    !> Damping added at lambda = 0, divided by the mass or the moment of inertia (1/s)
    real(dp) :: drag = 0
    !> The path ends if lambda becomes smaller than this value
    real(dp) :: furthest_back = -1
  contains
    procedure :: member
  end type machine_path_type

  !> Maximum number of points of a path.
  integer, parameter :: max_points = 100
  !> The path ends if the size of the motion falls below this fraction of the largest motion on it. The path has then returned to
  !> rest.
  real(dp), parameter :: back_at_rest = 1.0e-4_dp
  !> Speeds at which a path may start, relative to the requested speed. Lower speeds come first, because a machine usually reaches
  !> its speed from below. If the vibration jumps at some speed, the vibration above this speed is the continuation of the vibration
  !> at higher speeds.
  real(dp), parameter :: other_speeds(*) = [0.97_dp, 1.03_dp, 0.9_dp, 1.1_dp]

  !> The damping added at the start of a path is the larger of two values: `of_speed` times the drive speed, and `of_frequency`
  !> times the frequency of the stiffest direction. It decreases as exp(-fall lambda), so weakly damped resonances are approached
  !> slowly.
  real(dp), parameter :: of_speed = 2, of_frequency = 1, fall = 12
  !> Maximum number of linear systems that are solved on a path along which the added damping varies.
  integer, parameter :: max_systems = 500
  !> Value of `furthest_back` for a path along which the added damping varies. A path that returns to more damping than at its start
  !> leads to another equilibrium of the frame.
  real(dp), parameter :: back_at_start = -0.1_dp

  character(len=*), parameter :: no_vibration_found = "no periodic vibration of the nonlinear equations was found; the search " // &
    &   "started from the linear vibration, from rest, from other speeds and from more damping"

contains

  !> Follows the vibration while the excitation increases from zero. `varied` becomes `frame` linearised about the first vibration
  !> that is found. Fails if the path ends in both directions before it reaches the machine's actual excitation.
  subroutine follow_excitation(frame, accuracy, varied, steps, error)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(varied_frame_type), intent(inout) :: varied
    !> Relative steps of Newton's method (see `iterate`)
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    type(machine_path_type) :: family
    real(dp), allocatable :: rest(:, :)
    integer :: way

    family = machine_path(varied, accuracy)
    allocate(rest(first_samples, frame%dofs()), source=0.0_dp)
    do way = 1, -1, -2
      call follow_path(family, frame, rest, way, varied, steps, error)
      if (.not. allocated(error)) return
    end do
  end subroutine follow_excitation

  !> Follows the vibration from other speeds to the requested speed. Arguments and failures are those of `follow_excitation`.
  subroutine follow_speed(frame, accuracy, varied, steps, error)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(varied_frame_type), intent(inout) :: varied
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    type(machine_path_type) :: family
    class(frame_type), allocatable :: other
    type(varied_frame_type) :: start
    logical :: quickly
    integer :: k

    family = machine_path(varied, accuracy, frame%speed * [1, 1])
    do k = 1, size(other_speeds)
      family%speeds(1) = frame%speed * other_speeds(k)
      call family%member(0.0_dp, start, error)
      other = frame
      call other%run_at(start%speed)
      call iterate(other, with_min_tolerance(accuracy, rough), .false., start, steps, error, quickly)
      if (.not. quickly) family%left = family%left - slow * size(steps)
      if (allocated(error)) then
        error%message = no_vibration_found
        if (family%left < 0) return
        cycle
      end if
      call follow_path(family, frame, values_of(start%motion, first_samples) / spread(family%units, 1, first_samples), 1, &
        & varied, steps, error)
      if (.not. allocated(error)) return
    end do
  end subroutine follow_speed

  !> Follows the vibration from very heavy damping to the machine's own damping. Arguments and failures are those of
  !> `follow_excitation`.
  subroutine follow_damping(frame, accuracy, varied, steps, error)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(varied_frame_type), intent(inout) :: varied
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    type(machine_path_type) :: family
    class(frame_type), allocatable :: other
    type(varied_frame_type) :: start
    real(dp), allocatable :: stiffness(:, :)
    integer :: i

    family = machine_path(varied, accuracy, frame%speed * [1, 1])
    family%left = max_systems
    family%furthest_back = back_at_start
    allocate(stiffness, source=frame%ground_stiffness())
    associate (squares => [(stiffness(i, i) * family%units(i)**2 / total_mass(frame), i = 1, frame%dofs())])
      family%drag = max(of_speed * abs(frame%drive_speed()), of_frequency * sqrt(maxval([0.0_dp, squares])))
    end associate
    other = frame
    call add_drag(other, family%units, family%drag)
    call family%member(0.0_dp, start, error)
    if (.not. allocated(error)) call iterate(other, with_min_tolerance(accuracy, rough), .false., start, steps, error)
    if (.not. allocated(error)) call follow_path(family, frame, values_of(start%motion, first_samples) &
      & / spread(family%units, 1, first_samples), 1, varied, steps, error)
    if (allocated(error)) error%message = no_vibration_found
  end subroutine follow_damping

  !> Adds dampers between the frame's centre of mass and the ground. Their coefficients are `rate` (1/s) times masses and moments of
  !> inertia.
  pure subroutine add_drag(frame, units, rate)
    class(frame_type), intent(inout) :: frame
    real(dp), intent(in) :: units(:), rate
    integer :: i

    do i = 1, frame%dofs()
      associate (added => rate * total_mass(frame) / units(i)**2)
        frame%damping(i, i) = frame%damping(i, i) + added
        frame%foundation_damping(i, i) = frame%foundation_damping(i, i) + added
      end associate
    end do
  end subroutine add_drag

  !> Total mass of frame and mechanism (kg).
  pure real(dp) function total_mass(frame)
    class(frame_type), intent(in) :: frame

    total_mass = frame%mass + frame%mechanism%mass
  end function total_mass

  !> Creates the path of the machine `varied`. If `speeds` is present, the speed varies along the path, from `speeds(1)` at lambda
  !> = 0 to `speeds(2)` at lambda = 1 (rad/s). Otherwise the excitation varies, starting from rest.
  function machine_path(varied, accuracy, speeds) result(family)
    type(varied_frame_type), intent(in) :: varied
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in), optional :: speeds(2)
    type(machine_path_type) :: family

    family%varied = varied
    family%accuracy = accuracy
    family%units = units_of(varied)
    family%from_rest = .not. present(speeds)
    if (present(speeds)) family%speeds = speeds
  end function machine_path

  !> Returns the machine at `lambda`. Fails if the speed changes its sign, or if the damping is far larger than at the start of the
  !> path.
  subroutine member(self, lambda, varied, error)
    class(machine_path_type), intent(in) :: self
    real(dp), intent(in) :: lambda
    type(varied_frame_type), intent(out) :: varied
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: speed

    varied = self%varied
    if (self%drag > 0 .and. lambda < 2 * self%furthest_back) then
      call fatal_error(error, "on the branch of vibrations the damping rises far above its value at the start", failed_computation)
    else if (self%from_rest) then
      varied%excitation = lambda
    else
      speed = self%speeds(1) + lambda * (self%speeds(2) - self%speeds(1))
      if (.not. speed / self%speeds(1) > 0) then
        call fatal_error(error, "the branch of vibrations reaches the speed 0", invalid_input)
        return
      end if
      call varied%run_at(speed)
      if (self%drag > 0) call add_drag(varied, self%units, self%drag * (exp(-fall * lambda) - exp(-fall)))
    end if
  end subroutine member

  !> Follows the path from the vibration q at lambda = 0 to lambda = 1. `varied` becomes the frame linearised about the vibration at
  !> lambda = 1. `way`: direction at the start, 1 towards larger lambda, -1 towards smaller lambda. Fails if the path ends before
  !> lambda = 1.
  subroutine follow_path(family, frame, q, way, varied, steps, error)
    type(machine_path_type), intent(inout) :: family
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: q(:, :)
    integer, intent(in) :: way
    type(varied_frame_type), intent(inout) :: varied
    real(dp), allocatable, intent(out) :: steps(:)
    type(error_type), allocatable, intent(out) :: error
    type(varied_frame_type) :: found
    type(point_type) :: at, next
    real(dp) :: arc, part, maximum
    logical :: easy
    integer :: k

    call first_point(family, q, 0.0_dp, way, at, error)
    if (allocated(error)) then
      error%message = no_vibration_found
      return
    end if
    arc = first_arc
    maximum = 0
    do k = 1, max_points
      call advance(family, at, arc, next, easy, error)
      if (.not. allocated(error) .and. next%lambda >= 1) then
        part = (1 - at%lambda) / (next%lambda - at%lambda)
        call family%member(1.0_dp, found, error)
        call found%linearise_about(motion_of(family, middle_of(at, next, part)))
        call iterate(frame, family%accuracy, .false., found, steps, error)
        if (.not. allocated(error)) then
          varied = found
          return
        end if
      end if
      if (allocated(error)) then
        arc = arc / 4
        if (arc < min_arc) exit
      else
        at = next
        maximum = max(maximum, size_of(at%q))
        if (easy) arc = min(2 * arc, max_arc)
        if (at%lambda < family%furthest_back .or. size_of(at%q) < back_at_rest * maximum) exit
        if (family%turn(at%q) > furthest_turn) exit
      end if
    end do
    call fatal_error(error, no_vibration_found, failed_computation)
  end subroutine follow_path

end module gestell_study_frame_model_vibration_path
