!> Families of systems for the tests of sweeps.
module families
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type
  use gestell_system_family, only: family_type
  use gestell_system_periodic, only: periodic_system
  use systems, only: mathieu_type, pulsed_type
  implicit none (type, external)
  private

  public :: largest_of_oscillator

  !> y'' + d y' + a y = 0 over the period pi; parameters d and a, or a alone with the damping of the family. From `jump` on the
  !> damping is greater by 1; within `hole` there is no system.
  type, extends(family_type), public :: oscillator_family
    real(dp) :: damping = 0.1_dp, jump = huge(1.0_dp), hole(2) = huge(1.0_dp)
  contains
    procedure :: member => member_of_oscillators
  end type oscillator_family

  !> A frame; parameters: the crank's speed (1/min) and a factor of all stiffnesses.
  type, extends(family_type), public :: machine_family
    type(frame_type) :: frame
  contains
    procedure :: member => member_of_machines
  end type machine_family

  !> y'' + d(t) y' + a y = 0 over the period pi; parameter a. The damping d = 0.05 is a pulse of that mean for a between 1 and 2.
  type, extends(family_type), public :: pulsed_family
  contains
    procedure :: member => member_of_pulsed
  end type pulsed_family

contains

  subroutine member_of_pulsed(self, parameters, system, error)
    class(pulsed_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(pulsed_type), allocatable :: pulsed

    associate (unused => self)
    end associate
    if (size(parameters) /= 1) then
      call fatal_error(error, "one parameter", impossible_mechanism)
      return
    end if
    allocate(pulsed)
    pulsed%states = 2
    pulsed%period = pi
    pulsed%square = parameters(1)
    if (parameters(1) > 1 .and. parameters(1) < 2) then
      pulsed%ratio = 0.85_dp
      pulsed%least_steps = 40
    end if
    call move_alloc(pulsed, system)
  end subroutine member_of_pulsed

  subroutine member_of_oscillators(self, parameters, system, error)
    class(oscillator_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(mathieu_type), allocatable :: mathieu
    real(dp) :: a

    a = parameters(size(parameters))
    if (a > self%hole(1) .and. a < self%hole(2)) then
      call fatal_error(error, "a hole", impossible_mechanism)
      return
    end if
    allocate(mathieu)
    mathieu%states = 2
    mathieu%period = pi
    mathieu%a = a
    mathieu%d = self%damping
    if (size(parameters) == 2) mathieu%d = parameters(1)
    if (a >= self%jump) mathieu%d = mathieu%d + 1
    call move_alloc(mathieu, system)
  end subroutine member_of_oscillators

  !> max |rho| of y'' + d y' + a y = 0 over pi.
  elemental real(dp) function largest_of_oscillator(d, a) result(rho)
    real(dp), intent(in) :: d, a

    rho = exp(pi * (-d / 2 + sqrt(max(0.0_dp, d**2 / 4 - a))))
  end function largest_of_oscillator

  subroutine member_of_machines(self, parameters, system, error)
    class(machine_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(frame_type), allocatable :: frame

    if (size(parameters) == 0) call fatal_error(error, "no parameters", impossible_mechanism)
    allocate(frame, source=self%frame)
    frame%speed = parameters(1) * 2 * pi / 60
    frame%period = 2 * pi / abs(frame%speed)
    if (size(parameters) == 2) frame%stiffness = parameters(2) * frame%stiffness
    call move_alloc(frame, system)
  end subroutine member_of_machines

end module families
