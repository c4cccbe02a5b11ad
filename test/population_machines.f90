!> A population of random machines for tests of claims: linkages of all kinds, mountings and speeds from slow to far above the
!> resonances. In many of them error bounds and verdicts are hard on purpose. A number always yields the same machine.
module population_machines
  use population_border, only: damp_to_border, scale_damping, speed_to_border
  use population_library, only: all_methods, name_length
  use reference_cases, only: random_linkage, random_machine
  use reference_frame, only: frame_matrices, frame_of, frame_system
  use reference_linear, only: qp, solve
  use reference_machine, only: dp, joint_data, machine_data, pi_qp
  use reference_random, only: random_type, rounded
  implicit none (type, external)
  private

  public :: specimen

  !> What makes a machine of the population hard:
  !>
  !>   plain       nothing
  !>   undamped    no damper anywhere: all multipliers in reciprocal pairs
  !>   overdamped  dampers 10 to 1000 times as strong
  !>   heavy       links up to 100 times as heavy: parametric resonance
  !>   light       links down to 1e-6 times as heavy
  !>   soft        one direction not held at all, hardly held, or pushed away by a negative stiffness
  !>   border      dampers scaled so that rho_max is 1e-12 to 1e-3 below 1, or above it where damping alone stabilises
  !>   tongue      heavy, the crank speed at the border of a parametric resonance
  !>   twins       the same stiffness in all directions, light links: multipliers in close pairs, often near 1 or -1
  !>   critical    twins with dampers at the border of overdamping: all but defective multipliers
  character(len=10), parameter, public :: traits(10) = [character(len=10) :: "plain", "undamped", "overdamped", "heavy", &
    & "light", "soft", "border", "tongue", "twins", "critical"]

  type, public :: specimen_type
    integer :: number = 0
    character(len=12) :: linkage = ""
    character(len=10) :: trait = ""
    type(machine_data) :: machine
    !> The requested tolerance, and two methods.
    real(dp) :: tolerance = 0
    character(len=name_length) :: methods(2) = ""
    !> Number of given steps; 0: automatic.
    integer :: steps = 0
  contains
    procedure :: undamped
  end type specimen_type

contains

  !> Machine `number` (1, 2, ...) of the population. The fastest of its free motions turns, or decays, by 0.1 to `max_turns` in
  !> a period, spread evenly in logarithm. With a `kind` all machines are weakly damped ('weak', damping times 1e-5 to 1e-2),
  !> strongly damped ('strong', times 10 to 1e4), or have a given number of steps ('steps', 4 to 400).
  function specimen(number, max_turns, kind) result(one)
    integer, intent(in) :: number
    real(dp), intent(in) :: max_turns
    character(len=*), intent(in), optional :: kind
    type(specimen_type) :: one
    type(random_type) :: random
    integer :: stages

    call random%start(number, 2)
    one%number = number
    one%trait = traits(random%pick(size(traits)))
    select case (random%pick(3))
    case (1)
      one%linkage = "four-bar"
      one%machine = random_machine(number)
    case (2)
      one%linkage = "slider-crank"
      one%machine = random_machine(number)
      call set_slider_crank(random, one%machine)
    case default
      one%linkage = "chain"
      one%machine = random_linkage(number)
    end select
    if (random%chance(0.25_dp)) call hold_some(random, one%machine)
    call set_trait(random, one%trait, max_turns, one%machine)
    one%tolerance = 10.0_dp**(-random%between(2.0_dp, 13.0_dp))
    one%methods = two_methods(random, one%tolerance)
    if (.not. present(kind)) return
    select case (kind)
    case ("weak")
      call scale_damping(one%machine, 10.0_dp**(-random%between(2.0_dp, 5.0_dp)))
    case ("strong")
      call scale_damping(one%machine, 10.0_dp**random%between(1.0_dp, 4.0_dp))
      call set_speed(random, max_turns, one%machine)
    case ("steps")
      one%steps = nint(4 * 100**random%draw())
    case ("gauss")
      stages = random%pick(5)
      one%methods(1) = name_of(5 + stages)
      stages = stages + random%pick(4)
      one%methods(2) = name_of(6 + mod(stages - 1, 5))
    case default
    end select
  end function specimen

  !> Name of Gauss' method with so many stages.
  pure function name_of(stages) result(name)
    integer, intent(in) :: stages
    character(len=name_length) :: name

    write (name, "('gauss', i0)") stages
  end function name_of

  !> No damper acts.
  pure logical function undamped(self)
    class(specimen_type), intent(in) :: self
    integer :: i

    undamped = all(self%machine%foundation_damping <= 0) &
      & .and. all([(self%machine%supports(i)%damping <= 0, i = 1, size(self%machine%supports))])
  end function undamped

  !> Usually auto and another method; RK4 only where it is not too slow.
  function two_methods(random, tolerance) result(two)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: tolerance
    character(len=name_length) :: two(2)
    character(len=name_length), allocatable :: names(:)

    names = all_methods()
    if (tolerance < 1.0e-7_dp) names = pack(names, names /= "rk4")
    two(1) = "auto"
    if (random%chance(0.3_dp)) two(1) = names(random%pick(size(names)))
    do
      two(2) = names(random%pick(size(names)))
      if (two(2) /= two(1)) exit
    end do
  end function two_methods

  !> Replaces the linkage by a crank, a rod and a slider on a fixed guide anywhere, with the same masses.
  subroutine set_slider_crank(random, machine)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    type(joint_data) :: slider
    real(dp) :: rod, angle, offset

    associate (pivot => machine%joints(1), crank => machine%joints(3))
      rod = rounded(crank%radius * random%between(1.5_dp, 6.0_dp), 4)
      offset = random%about_zero(0.5_dp) * (rod - crank%radius)
      angle = rounded(random%about_zero(180.0_dp), 1)
      slider = joint_data("RRP", ends=[2, 0], lengths=[rod, 0.0_dp], guide_angle_deg=angle, &
        & branch=merge(1, -1, random%chance(0.5_dp)), guide_point=[ &
        & rounded(pivot%position(1) - offset * sin(angle * real(pi_qp, dp) / 180), 4), &
        & rounded(pivot%position(2) + offset * cos(angle * real(pi_qp, dp) / 180), 4)])
      machine%joints = [pivot, crank, slider]
    end associate
    machine%links(1)%to = 2
    machine%links(2)%from = 2
    machine%links(2)%to = 3
    machine%links(3)%from = 3
    machine%links(3)%to = 0
  end subroutine set_slider_crank

  !> One or two of xi, eta, psi are held.
  subroutine hold_some(random, machine)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    integer :: k

    k = random%pick(3)
    machine%free(k) = .false.
    if (random%chance(0.3_dp)) machine%free(modulo(k, 3) + 1) = .false.
  end subroutine hold_some

  subroutine set_trait(random, trait, max_turns, machine)
    type(random_type), intent(inout) :: random
    character(len=*), intent(in) :: trait
    real(dp), intent(in) :: max_turns
    type(machine_data), intent(inout) :: machine
    real(dp) :: distance

    select case (trait)
    case ("undamped")
      call scale_damping(machine, 0.0_dp)
    case ("overdamped")
      call scale_damping(machine, 10 * 100**random%draw())
    case ("heavy")
      call scale_links(machine, 100**random%draw())
    case ("light")
      call scale_links(machine, 1.0e-6_dp**random%draw())
    case ("soft")
      call soften(random, machine)
    case ("tongue")
      call scale_links(machine, 3 * 30**random%draw())
      if (random%chance(0.5_dp)) call scale_damping(machine, 0.0_dp)
    case ("twins")
      call set_twins(random, machine)
    case ("critical")
      call set_twins(random, machine)
      call set_critical(random, machine)
    case default
    end select

    call set_speed(random, max_turns, machine)
    distance = 10.0_dp**(-random%between(3.0_dp, 12.0_dp))
    if (trait == "border") call damp_to_border(machine, distance)
    if (trait == "tongue") call speed_to_border(machine, distance)
    if (trait == "twins") then
      ! At least half a turn of the free translations in a period. One draw per statement, so that no compiler can omit one.
      if (random%chance(0.5_dp)) machine%speed_rpm = 60 * translation(machine) / (real(pi_qp, dp) * random%pick(6))
    end if
  end subroutine set_trait

  subroutine scale_links(machine, factor)
    type(machine_data), intent(inout) :: machine
    real(dp), intent(in) :: factor

    machine%links%mass = factor * machine%links%mass
    machine%links%inertia = factor * machine%links%inertia
  end subroutine scale_links

  !> In xi or eta: no stiffness at all, 1e-10 to 1e-1 of it, or a negative one of the foundation that exceeds it by up to
  !> a half. The sum of stiffnesses never nearly cancels: its rounding would be another machine.
  subroutine soften(random, machine)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    real(dp) :: factor
    integer :: i, k

    k = random%pick(2)
    factor = 0
    if (random%chance(0.5_dp)) factor = 1.0e-10_dp**random%draw()
    machine%foundation_stiffness = 0
    if (random%chance(0.3_dp)) then
      factor = 1
      do i = 1, size(machine%supports)
        machine%foundation_stiffness(k, k) = machine%foundation_stiffness(k, k) &
          & - random%between(1.05_dp, 1.5_dp) * machine%supports(i)%stiffness(k)
      end do
    end if
    do i = 1, size(machine%supports)
      machine%supports(i)%angle_deg = 0
      machine%supports(i)%stiffness(k) = factor * machine%supports(i)%stiffness(k)
      if (random%chance(0.2_dp)) machine%supports(i)%damping(k) = 0
    end do
  end subroutine soften

  !> Four equal supports about the centre of mass, equally stiff and damped in both directions. In some cases the frame
  !> turns as fast as it translates.
  subroutine set_twins(random, machine)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    real(dp) :: x, y, stiffness, damping
    integer :: i

    x = random%between(0.1_dp, 0.5_dp)
    y = random%between(0.0_dp, 0.3_dp)
    stiffness = 1000 * random%between(10.0_dp, 400.0_dp)
    damping = merge(0.0_dp, 300 * 0.001_dp**random%draw(), random%chance(0.4_dp))
    deallocate(machine%supports)
    allocate(machine%supports(4))
    do i = 1, 4
      machine%supports(i)%position = [merge(x, -x, i <= 2), merge(y, -y, modulo(i, 2) == 0)]
      machine%supports(i)%stiffness = stiffness
      machine%supports(i)%damping = damping
    end do
    machine%foundation_stiffness = 0
    machine%foundation_damping = 0
    if (random%chance(0.3_dp)) machine%frame_inertia = machine%frame_mass * (x**2 + y**2)
    call scale_links(machine, 1.0e-10_dp**random%draw())
  end subroutine set_twins

  !> Natural frequency of the translations of twins.
  pure real(dp) function translation(machine)
    type(machine_data), intent(in) :: machine
    integer :: i

    translation = sqrt(sum([(machine%supports(i)%stiffness(1), i = 1, size(machine%supports))]) &
      & / (machine%frame_mass + sum(machine%links%mass)))
  end function translation

  !> Dampers of twins at 1 +- 1e-12 to 1 +- 1e-2 times the damping that just keeps the translations from vibrating.
  subroutine set_critical(random, machine)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    integer :: i

    do i = 1, size(machine%supports)
      machine%supports(i)%damping = 2 * machine%supports(i)%stiffness / translation(machine) &
        & * (1 + sign(10.0_dp**(-random%between(2.0_dp, 12.0_dp)), random%about_zero(1.0_dp)))
    end do
  end subroutine set_critical

  subroutine set_speed(random, max_turns, machine)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: max_turns
    type(machine_data), intent(inout) :: machine
    real(dp), parameter :: least_turns = 0.1_dp

    machine%speed_rpm = 600 ! any speed will do here
    machine%speed_rpm = 60 * fastest(machine) / (least_turns * (max_turns / least_turns)**random%draw())
    if (random%chance(0.5_dp)) machine%speed_rpm = -machine%speed_rpm
  end subroutine set_speed

  !> The highest natural frequency or the fastest decay (rad/s) of the frame with the linkage held at t = 0.
  function fastest(machine)
    type(machine_data), intent(in) :: machine
    real(dp) :: fastest
    type(frame_system) :: frame
    real(qp), dimension(count(machine%free), count(machine%free)) :: m, b, c
    real(qp) :: h(count(machine%free))

    frame = frame_of(machine)
    call frame_matrices(frame, 0.0_qp, m, b, c, h)
    fastest = real(max(sqrt(spectral_radius(solve(m, frame%stiffness(frame%free, frame%free)))), &
      & spectral_radius(solve(m, frame%damping(frame%free, frame%free)))), dp)
  end function fastest

  !> By powers, to a few digits at least.
  function spectral_radius(a) result(radius)
    real(qp), intent(in) :: a(:, :)
    real(qp) :: radius
    real(qp), parameter :: start(3) = [1.0_qp, 0.7_qp, 3.1_qp]
    real(qp) :: v(size(a, 1))
    integer :: i

    v = start(:size(v))
    radius = 0
    do i = 1, 40
      v = matmul(a, v)
      radius = norm2(v)
      if (.not. radius > 0) return
      v = v / radius
    end do
  end function spectral_radius

end module population_machines
