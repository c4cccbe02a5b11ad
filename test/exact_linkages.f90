!> Random linkages for the population of the exact frame: every type of joint in machines that turn.
module exact_linkages
  use exact_text, only: brief
  use oracle_machine, only: dp, exact_machine
  use reference_machine, only: joint_data, link_data
  use reference_random, only: random_type
  implicit none (type, external)
  private

  public :: draw_linkage

  character(len=14), parameter, public :: linkage_names(11) = [character(len=14) :: "four-bar", "press", "slider-crank", &
    & "Scotch yoke", "slotted lever", "V twin", "geared", "cam", "swinging guide", "six-bar", &
    & "cylinders"]

contains

  !> Joints and links of a `kind`, with a crank of the radius `length` and links of some `mass` (kg) each.
  subroutine draw_linkage(random, kind, length, mass, machine)
    type(random_type), intent(inout) :: random
    integer, intent(in) :: kind
    real(dp), intent(in) :: length, mass
    type(exact_machine), intent(inout) :: machine

    allocate(machine%joints(0), machine%links(0), machine%turns_of(0))
    call add(machine, joint_data("ground"))
    call add(machine, joint_data("crank", ends=[1, 0], radius=length, phase_deg=brief(360 * random%draw())), 1)
    call add_link(random, machine, 1, 2, mass, length)
    if (random%chance(0.4_dp)) then        ! a counterweight
      machine%links = [machine%links, link_data(1, 2, brief(mass * random%draw()), brief(0.1_dp * mass * length**2), &
        & [brief(-length * random%draw()), 0.0_dp])]
    end if
    select case (linkage_names(kind))
    case ("four-bar")
      call add_four_bar(random, length, mass, machine)
    case ("press")
      call add_four_bar(random, length, mass, machine)
      call add_slider(random, 4, 4.5_dp * length, mass, length, machine)
    case ("slider-crank")
      call add_slider(random, 2, length, mass, length, machine)
    case ("Scotch yoke")
      call add(machine, joint_data("RPP", ends=[2, 0], guide_point=random_pair(random, length), guide_angle_deg= &
        & brief(360 * random%draw()), slot_angle_deg=brief(60 + 60 * random%draw())))
      call add_link(random, machine, 3, 0, mass, length)
    case ("slotted lever")
      call add(machine, joint_data("ground", position=[brief(length * (1.5_dp + 2 * random%draw())), brief(length * &
        & random%draw())]))
      call add(machine, joint_data("RPR", ends=[2, 3], lengths=[brief(length * (2 + 4 * random%draw())), 0.0_dp], &
        & branch=sign_of(random)))
      call add_link(random, machine, 3, 4, mass, 3 * length)
      call add_link(random, machine, 2, 3, 0.3_dp * mass, 0.3_dp * length)
    case ("V twin")
      call add(machine, joint_data("crank", ends=[1, 0], radius=length, phase_deg=brief(90.0_dp * random%pick(4) &
        & + 30 * random%draw())), 1)
      call add_link(random, machine, 1, 3, mass, length)
      call add_slider(random, 2, length, mass, length, machine)
      call add_slider(random, 3, length, mass, length, machine)
    case ("geared")
      call add_geared(random, length, mass, machine)
    case ("cam")
      call add_follower(random, length, mass, machine)
    case ("swinging guide")
      call add_four_bar(random, length, mass, machine)
      ! Across the rocker, which swings by less than half a right angle to either side: guides cross at 50 deg at least.
      call add(machine, joint_data("PRP", guide=[3, 4], guide_point=random_pair(random, length), guide_angle_deg=0.0_dp, &
        & guide2_point=[machine%joints(3)%position(1), brief(length * (1.5_dp + random%draw()))], guide2_angle_deg=brief(20 &
        & * (2 * random%draw() - 1))))
      call add_link(random, machine, 5, 0, mass, length)
    case ("cylinders")
      call add_cylinders(random, length, mass, machine)
    case default ! six-bar
      call add_four_bar(random, length, mass, machine)
      call add(machine, joint_data("rigid", ends=[2, 4], offset=[brief(2 * length * random%draw()), brief(length * (0.5_dp &
        & + random%draw()))]))
      call add(machine, joint_data("ground", position=[brief(length * (5 + random%draw())), brief(length * (3 + random%draw()))]))
      call add(machine, joint_data("RRR", ends=[5, 6], lengths=[brief(length * (6 + random%draw())), brief(length * (6 &
        & + random%draw()))], branch=sign_of(random)))
      call add_link(random, machine, 5, 7, mass, 6 * length)
      call add_link(random, machine, 6, 7, mass, 6 * length)
    end select
  end subroutine draw_linkage

  !> A crank and rocker: joints 3 (ground) and 4.
  subroutine add_four_bar(random, length, mass, machine)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: length, mass
    type(exact_machine), intent(inout) :: machine
    real(dp) :: sides(3)

    ! Ground, coupler and rocker so that the distance of the ends, ground -+ crank, keeps 0.3 cranks from the dead points.
    sides(1) = 3 + 2 * random%draw()
    sides(2) = 3 + 2 * random%draw()
    sides(3) = max(sides(1) + 1 - sides(2) + 0.3_dp, 2.0_dp) + random%draw()
    if (abs(sides(2) - sides(3)) > sides(1) - 1.3_dp) sides(3) = sides(2)
    sides = [brief(sides(1) * length), brief(sides(2) * length), brief(sides(3) * length)]
    call add(machine, joint_data("ground", position=[sides(1), 0.0_dp]))
    call add(machine, joint_data("RRR", ends=[2, 3], lengths=sides(2:3), branch=sign_of(random)))
    call add_link(random, machine, 2, 4, mass, sides(2))
    call add_link(random, machine, 3, 4, mass, sides(3))
  end subroutine add_four_bar

  !> A rod and a slider on a fixed guide that does not pass through O; the joint `from` keeps within `reach` of O.
  subroutine add_slider(random, from, reach, mass, length, machine)
    type(random_type), intent(inout) :: random
    integer, intent(in) :: from
    real(dp), intent(in) :: reach, mass, length
    type(exact_machine), intent(inout) :: machine
    real(dp) :: rod
    integer :: last

    rod = brief(reach * (1.8_dp + 3 * random%draw()))
    if (from == 4) rod = brief(12 * length)
    call add(machine, joint_data("RRP", ends=[from, 0], lengths=[rod, 0.0_dp], branch=sign_of(random), guide_point= &
      & random_pair(random, 0.3_dp * length), guide_angle_deg=brief(360 * random%draw())))
    last = size(machine%joints)
    call add_link(random, machine, from, last, mass, rod)
    call add_link(random, machine, last, 0, mass, length)
  end subroutine add_slider

  !> A slider-crank and a shaft with an unbalance geared to it, one against the other or twice or half as fast.
  subroutine add_geared(random, length, mass, machine)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: length, mass
    type(exact_machine), intent(inout) :: machine
    integer, parameter :: ratios(2, 5) = reshape([-1, 1, 2, 1, -2, 1, 1, 2, -3, 2], [2, 5])
    integer :: k

    call add_slider(random, 2, length, mass, length, machine)
    k = random%pick(5)
    machine%turns = ratios(2, k)
    machine%turns_of(2) = machine%turns
    call add(machine, joint_data("ground", position=[brief(2 * length), brief(length * (random%draw() - 0.5_dp))]))
    call add(machine, joint_data("crank", ends=[4, 0], radius=brief(0.6_dp * length), phase_deg=brief(360 * random%draw())), &
      & ratios(1, k))
    call add_link(random, machine, 4, 5, mass, 0.6_dp * length)
  end subroutine add_geared

  !> A follower of a cam on the crank, and a rocker driven by it.
  subroutine add_follower(random, length, mass, machine)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: length, mass
    type(exact_machine), intent(inout) :: machine
    real(dp) :: lift(7)
    integer :: k

    lift(1) = brief(3 * length)
    do k = 2, 7
      lift(k) = brief(length * (2 * random%draw() - 1) / (k / 2)**2)
    end do
    call add(machine, joint_data("follower", ends=[1, 2], lift=lift, phase_deg=brief(360 * random%draw()), &
      & guide_point=random_pair(random, length), guide_angle_deg=brief(360 * random%draw())))
    call add_link(random, machine, 3, 0, mass, length)
  end subroutine add_follower

  !> A cylinder between the crank pin and a lever, and a cylinder that moves a slider along this lever. The ends are 3 to 5 cranks
  !> apart; lever and cylinder have 2.9 to 4.1.
  subroutine add_cylinders(random, length, mass, machine)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: length, mass
    type(exact_machine), intent(inout) :: machine

    call add(machine, joint_data("ground", position=[4 * length, 0.0_dp]))
    call add(machine, joint_data("cylinder", ends=[3, 2], lengths=[brief(length * (3.2_dp + 0.6_dp * random%draw())), 0.0_dp], &
      & branch=sign_of(random), lift=harmonics(3.5_dp, 0.3_dp), phase_deg=brief(360 * random%draw())), 1)
    call add_link(random, machine, 3, 4, mass, 3 * length)
    call add_link(random, machine, 2, 4, mass, 3 * length)
    call add(machine, joint_data("cylinder", guide=[3, 4], guide_point=random_pair(random, length), guide_angle_deg= &
      & brief(360 * random%draw()), lift=harmonics(1.0_dp, 1.0_dp)), 1)
    call add_link(random, machine, 5, 0, mass, length)

  contains

    !> Three orders about a mean, both in cranks.
    function harmonics(mean, amplitude) result(stroke)
      real(dp), intent(in) :: mean, amplitude
      real(dp) :: stroke(7)
      integer :: k

      stroke(1) = brief(mean * length)
      do k = 2, 7
        stroke(k) = brief(amplitude * length * (2 * random%draw() - 1) / (k / 2)**2)
      end do
    end function harmonics

  end subroutine add_cylinders

  !> `turns`: number of turns of a crank or cylinder in a period.
  subroutine add(machine, joint, turns)
    type(exact_machine), intent(inout) :: machine
    type(joint_data), intent(in) :: joint
    integer, intent(in), optional :: turns
    integer :: own

    own = 0
    if (present(turns)) own = turns
    machine%joints = [machine%joints, joint]
    machine%turns_of = [machine%turns_of, own]
  end subroutine add

  subroutine add_link(random, machine, from, to, mass, length)
    type(random_type), intent(inout) :: random
    type(exact_machine), intent(inout) :: machine
    integer, intent(in) :: from, to
    real(dp), intent(in) :: mass, length
    real(dp) :: own, inertia, center(2)

    own = brief(mass * (0.3_dp + 1.7_dp * random%draw()))
    inertia = brief(own * length**2 * (0.02_dp + 0.13_dp * random%draw()))
    center = [brief(length * (random%draw() - 0.2_dp)), 0.0_dp]
    if (random%chance(0.5_dp)) center(2) = brief(0.3_dp * length * (2 * random%draw() - 1))
    machine%links = [machine%links, link_data(from, to, own, inertia, center)]
  end subroutine add_link

  function random_pair(random, length) result(pair)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: length
    real(dp) :: pair(2)

    pair(1) = brief(length * (2 * random%draw() - 1))
    pair(2) = brief(length * (2 * random%draw() - 1))
  end function random_pair

  integer function sign_of(random)
    type(random_type), intent(inout) :: random

    sign_of = merge(1, -1, random%chance(0.5_dp))
  end function sign_of

end module exact_linkages
