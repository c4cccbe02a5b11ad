!> A population of random machines for the exact frame: linkages of all types of joints, gears, cams, mounts with axes fixed in
!> space or turning with the frame, weights, guides, every holder of the speed; and the equivalent input file. A number always
!> yields the same machine.
module exact_specimens
  use exact_linkages, only: draw_linkage, linkage_names
  use exact_text, only: brief
  use oracle_machine, only: dp, exact_machine
  use reference_random, only: random_type
  implicit none (type, external)
  private

  public :: specimen

  !> What makes a machine hard:
  !>
  !>   plain       nothing
  !>   undamped    no damper anywhere: multipliers in reciprocal pairs
  !>   overdamped  dampers 3 to 30 times as strong as critical ones
  !>   heavy       moving masses of the frame's size: large motions, parametric resonance
  !>   light       moving masses down to 1e-5 of the frame's
  !>   resonant    a low order of the crank within some per cent of a natural frequency
  !>   tongue      twice a natural frequency within some per cent of an order, heavy, weakly damped
  character(len=10), parameter, public :: traits(7) = [character(len=10) :: "plain", "undamped", "overdamped", "heavy", "light", &
    & "resonant", "tongue"]

  type, public :: exact_specimen
    integer :: number = 0
    character(len=10) :: trait = ""
    character(len=14) :: linkage = ""
    real(dp) :: tolerance = 0
    type(exact_machine) :: machine
  end type exact_specimen

contains

  !> Machine `number` (1, 2, ...).
  function specimen(number) result(one)
    integer, intent(in) :: number
    type(exact_specimen) :: one
    type(random_type) :: random
    real(dp) :: length, moving, part, radius, frequency, ratio, damping
    integer :: kind

    call random%start(number, 7)
    one%number = number
    one%trait = traits(random%pick(size(traits)))
    if (random%chance(0.3_dp)) one%trait = "plain"
    kind = random%pick(size(linkage_names) - 1)
    ! The last kind came later; all other machines stay as they were.
    if (modulo(number, 11) == 0) kind = size(linkage_names)
    one%linkage = linkage_names(kind)
    length = brief(0.01_dp * 10**random%draw())
    moving = brief(0.05_dp * 100**random%draw())
    call draw_linkage(random, kind, length, moving, one%machine)

    associate (machine => one%machine)
      moving = sum(machine%links%mass)
      part = 100.0_dp**random%draw() * 3
      if (one%trait == "heavy" .or. one%trait == "tongue") part = 0.5_dp * 10**random%draw()
      if (one%trait == "light") part = 100 * 1000**random%draw()
      radius = length * 8**random%draw()
      machine%frame_mass = brief(part * moving)
      machine%frame_inertia = brief(machine%frame_mass * radius**2)
      machine%origin = [brief(radius * spread_of(random)), brief(radius * spread_of(random))]
      machine%speed_rpm = brief(30 * 100**random%draw())
      ! The frame's natural frequency over the crank's speed.
      ratio = 0.25_dp * 30**random%draw()
      if (one%trait == "resonant") ratio = random%pick(3) * (1 + 0.03_dp * spread_of(random))
      if (one%trait == "tongue") ratio = random%pick(3) / 2.0_dp * (1 + 0.03_dp * spread_of(random))
      frequency = ratio * machine%speed_rpm * 0.10471975511965977_dp
      if (random%chance(0.5_dp)) machine%speed_rpm = -machine%speed_rpm
      damping = 1.0e-4_dp * 3000**random%draw()
      if (one%trait == "undamped") damping = 0
      if (one%trait == "overdamped") damping = 3 * 10**random%draw()
      if (one%trait == "resonant") damping = 1.0e-2_dp * 30**random%draw()
      if (one%trait == "tongue") damping = 1.0e-4_dp * 100**random%draw()
      call draw_mounting(random, (machine%frame_mass + moving) * frequency**2, damping / frequency, radius, machine)
      if (random%chance(0.3_dp)) call hold_some(random, machine)
      if (random%chance(0.4_dp)) then
        machine%acceleration = 9.80665_dp
        if (random%chance(0.3_dp)) machine%direction_deg = brief(180 * spread_of(random))
      end if
      machine%held_by = "motor"
      if (random%chance(0.65_dp)) machine%held_by = "flywheel"
      if (random%chance(0.5_dp)) machine%held_by = "outside"
      machine%probe = [brief(2 * radius * spread_of(random)), brief(2 * radius * spread_of(random))]
      machine%band = abs(machine%speed_rpm) / 60 * [brief(1.5_dp * random%draw()), brief(2 + 8 * random%draw())]
      machine%band = [brief(machine%band(1)), brief(machine%band(2))]
    end associate
    one%tolerance = brief(10.0_dp**(-6 - 6 * random%draw()))
  end function specimen

  real(dp) function spread_of(random)
    type(random_type), intent(inout) :: random

    spread_of = 2 * random%draw() - 1
  end function spread_of

  !> Two to four supports about F, with the sum `stiffness` along x; dampers of 2 `decay` times their stiffness.
  subroutine draw_mounting(random, stiffness, decay, radius, machine)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: stiffness, decay, radius
    type(exact_machine), intent(inout) :: machine
    real(dp) :: share, slender
    integer :: j, n

    n = 1 + random%pick(3)
    allocate(machine%supports(n))
    slender = 0.3_dp * 10**random%draw()
    do j = 1, n
      associate (support => machine%supports(j))
        share = stiffness / n * (0.5_dp + random%draw())
        support%position(1) = brief(1.5_dp * radius * ((2 * j - n - 1) / (n - 1.0_dp) + 0.2_dp * spread_of(random)))
        support%position(2) = brief(radius * (-0.5_dp + 0.4_dp * spread_of(random)))
        support%stiffness = [brief(share), brief(share * slender * (0.7_dp + 0.6_dp * random%draw()))]
        support%damping(1) = brief(2 * decay * share * (0.5_dp + random%draw()))
        support%damping(2) = brief(2 * decay * share * slender * (0.5_dp + random%draw()))
        if (random%chance(0.4_dp)) support%angle_deg = brief(90 * spread_of(random))
        support%turning = random%chance(0.3_dp)
      end associate
    end do
    if (random%chance(0.3_dp)) then
      machine%foundation_stiffness(3, 3) = brief(stiffness * radius**2 * random%draw())
      machine%foundation_damping = [brief(decay * stiffness), brief(decay * stiffness), brief(decay * stiffness * radius**2)]
    end if
  end subroutine draw_mounting

  !> One or two of xi, eta, psi are held.
  subroutine hold_some(random, machine)
    type(random_type), intent(inout) :: random
    type(exact_machine), intent(inout) :: machine
    integer :: k

    k = random%pick(3)
    machine%free(k) = .false.
    if (random%chance(0.3_dp)) machine%free(modulo(k, 3) + 1) = .false.
  end subroutine hold_some

end module exact_specimens
