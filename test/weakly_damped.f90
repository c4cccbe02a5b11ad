!> Families of weakly damped machines with many narrow tongues of parametric resonance. A number always yields the same family.
module weakly_damped
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type
  use gestell_system_periodic, only: periodic_system
  use machines, only: frame_of_machine
  use reference_cases, only: highest_frequency, random_linkage, random_machine
  use reference_machine, only: machine_data, pi_qp
  use reference_random, only: random_type
  implicit none (type, external)
  private

  public :: new_weak_family

  character(len=9), parameter, public :: parameters(4) = [character(len=9) :: "speed", "stiffness", "damping", "mass"]

  !> A machine over its speed (1/min), or over a factor to all its springs, dampers or links.
  type, extends(family_type), public :: weak_family
    type(machine_data) :: machine
    !> Index in `parameters`, and range.
    integer :: parameter = 1
    type(axis_type) :: axis
  contains
    procedure :: member
  end type weak_family

contains

  !> Family `number` (1, 2, ...): a four-bar or a chain of up to four dyads with heavy links, damping ratios of 1e-5 to 1e-2,
  !> most of them over the speed: up to three times twice the highest natural frequency, from a 40th to half of that on.
  subroutine new_weak_family(number, family)
    integer, intent(in) :: number
    type(weak_family), intent(out) :: family
    type(random_type) :: random
    real(dp) :: omega, ratio, high, factor
    integer :: i

    call random%start(number, 77)
    if (random%chance(0.5_dp)) then
      family%machine = random_machine(number)
    else
      family%machine = random_linkage(number)
    end if
    associate (machine => family%machine)
      factor = 30**random%draw() * machine%frame_mass / sum(machine%links%mass) / 10
      machine%links%mass = factor * machine%links%mass
      machine%links%inertia = factor * machine%links%inertia
      machine%foundation_damping = 0
      omega = real(highest_frequency(machine), dp)
      ratio = 10.0_dp**(-random%between(2.0_dp, 5.0_dp))
      do i = 1, size(machine%supports)
        machine%supports(i)%damping = 2 * ratio * 4**random%about_zero(0.5_dp) / omega * machine%supports(i)%stiffness
      end do
      high = 2 * omega * 30 / real(pi_qp, dp) * random%between(0.4_dp, 3.0_dp)
      if (random%chance(0.5_dp)) high = -high
      machine%speed_rpm = high / 10**random%draw()
    end associate
    family%parameter = 1
    if (random%chance(0.4_dp)) family%parameter = 1 + random%pick(3)
    select case (family%parameter)
    case (1)
      family%axis = axis_type(high / (2 * 20**random%draw()), high, 40)
    case (2)
      family%axis = axis_type(0.2_dp, 2.0_dp, 40)
    case (3)
      family%axis = axis_type(0.1_dp, 30.0_dp, 40, .true.)
    case default
      family%axis = axis_type(0.2_dp, 2.0_dp, 40)
    end select
  end subroutine new_weak_family

  subroutine member(self, parameters, system, error)
    class(weak_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    integer :: i

    machine = self%machine
    select case (self%parameter)
    case (1)
      machine%speed_rpm = parameters(1)
    case (2)
      machine%foundation_stiffness = parameters(1) * machine%foundation_stiffness
      do i = 1, size(machine%supports)
        machine%supports(i)%stiffness = parameters(1) * machine%supports(i)%stiffness
      end do
    case (3)
      do i = 1, size(machine%supports)
        machine%supports(i)%damping = parameters(1) * machine%supports(i)%damping
      end do
    case default
      machine%links%mass = parameters(1) * machine%links%mass
      machine%links%inertia = parameters(1) * machine%links%inertia
    end select
    call frame_of_machine(machine, frame, error)
    if (.not. allocated(error)) allocate(system, source=frame)
  end subroutine member

end module weakly_damped
