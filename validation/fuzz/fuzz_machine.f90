!> The grammar: the groups that describe a machine.
module fuzz_machine
  use fuzz_dice, only: dice_type
  use fuzz_values, only: name_word, real_word, scale_type, source_type, whole_word
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  implicit none (type, external)
  private

  public :: draw_machine

  character, parameter :: newline = new_line("a")

contains

  !> Everything but orders. `scale` tells what there is.
  subroutine draw_machine(source, scale, words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(out) :: scale
    character(len=:), allocatable, intent(out) :: words
    real(dp) :: spread

    spread = source%dice%pick_of([0.3_dp, 0.3_dp, 0.3_dp, 1.0_dp, 3.0_dp, 10.0_dp, 40.0_dp])
    scale%length = 0.1_dp * source%dice%decades(-spread, spread)
    scale%mass = source%dice%decades(-spread, spread)
    scale%stiffness = 1.0e5_dp * source%dice%decades(-spread, spread)
    scale%damping = sqrt(scale%stiffness * scale%mass) * source%dice%decades(-3.0_dp, 0.0_dp)
    if (source%dice%chance(0.05_dp)) scale%damping = 1.0e2_dp * source%dice%decades(-spread, spread)
    ! the crank about as fast as the free vibrations, seldom anything else
    scale%speed = 9.5_dp * sqrt(scale%stiffness / (10 * scale%mass)) * source%dice%decades(-1.0_dp, 0.7_dp)
    if (source%dice%chance(0.05_dp)) scale%speed = 2.0e2_dp * source%dice%decades(-min(spread, 3.0_dp), min(spread, 3.0_dp))
    if (source%dice%chance(0.2_dp)) scale%speed = -scale%speed
    words = "&drive speed_rpm=" // real_word(source, scale%speed)
    if (source%dice%chance(0.2_dp)) then
      words = words // ", held_by=" // name_word(source, source%dice%pick(["flywheel", "outside ", "motor   "]))
      if (index(words, "flywheel") > 0 .and. source%dice%chance(0.5_dp)) words = words // ", flywheel_inertia=" &
        & // real_word(source, scale%mass * scale%length**2)
    end if
    words = words // " /" // newline
    scale%functions = source%dice%chance(0.15_dp)
    scale%space = source%dice%chance(merge(0.05_dp, 0.25_dp, scale%functions))
    if (scale%functions) then
      words = words // mass_functions(source, scale)
    else
      if (source%dice%chance(0.2_dp)) words = words // twice(source, scale)
      call add_linkage(source, scale, words)
    end if
    words = words // mounting(source, scale)
    if (source%dice%chance(0.1_dp)) words = words // units(source)
  end subroutine draw_machine

  !> Ground, crank, dyads and links.
  subroutine add_linkage(source, scale, words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(inout) :: scale
    character(len=:), allocatable, intent(inout) :: words
    integer :: i, from

    call add_joint(scale, words, "type='ground', position=" // pair(source, 0.0_dp, 0.0_dp))
    call add_joint(scale, words, "type='crank', pivot='J1', radius=" // real_word(source, scale%length &
      & * source%dice%between(0.2_dp, 0.4_dp)) // optional(source, ", phase=", 360.0_dp) // ratio(source))
    do i = 1, source%dice%pick_of([0, 1, 1, 1, 2, 3])
      call add_dyad(source, scale, words)
    end do
    do i = 1, 1 + source%dice%below(scale%joints)
      scale%links = scale%links + 1
      from = 1 + source%dice%below(scale%joints)
      words = words // "&link name=" // name_word(source, "L" // text(i)) // ", from=" // name_word(source, "J" // text(from))
      if (source%dice%chance(0.8_dp)) words = words // ", to=" // other_joint(source, scale%joints, from)
      words = words // ", mass=" // real_word(source, scale%mass * source%dice%decades(-1.0_dp, 1.0_dp)) // ", inertia=" &
        & // inertia(source, scale, 0.1_dp * scale%mass * scale%length**2 * source%dice%decades(-1.0_dp, 1.0_dp), 0.7_dp)
      if (scale%space) words = words // optional(source, ", z=", scale%length)
      if (source%dice%chance(0.6_dp)) words = words // ", center=" // pair(source, scale%length * source%dice%uniform(), &
        & scale%length * source%dice%between(-0.2_dp, 0.2_dp))
      words = words // " /" // newline
    end do
  end subroutine add_linkage

  !> The mechanism by its name, and once more at another place.
  function twice(source, scale) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable :: words

    words = "&mechanism name=" // name_word(source, "M1") // ", origin=" // point(source, scale, scale%length) &
      & // optional(source, ", angle=", 180.0_dp) // ratio(source)
    if (scale%space .and. source%dice%chance(0.4_dp)) words = words // ", axis=" // pair(source, 0.2_dp, -0.1_dp) // "," &
      & // real_word(source, 1.0_dp)
    words = words // " /" // newline
    if (source%dice%chance(0.7_dp)) words = words // "&repeat of=" // name_word(source, "M1") // ", name=" &
      & // name_word(source, "M2") // optional(source, ", phase=", 360.0_dp) // ", origin=" // point(source, scale, scale%length) &
      & // ratio(source) // " /" // newline
  end function twice

  !> Two coordinates up to `size`, or three in space.
  function point(source, scale, size) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    real(dp), intent(in) :: size
    character(len=:), allocatable :: words

    words = pair(source, size * source%dice%between(-1.0_dp, 1.0_dp), size * source%dice%between(-1.0_dp, 1.0_dp))
    if (scale%space) words = words // "," // real_word(source, size * source%dice%between(-1.0_dp, 1.0_dp))
  end function point

  !> Two numbers of that size, or three in space.
  function constants(source, scale, size) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    real(dp), intent(in) :: size
    character(len=:), allocatable :: words

    words = pair(source, size * source%dice%decades(-1.0_dp, 1.0_dp), size * source%dice%decades(-1.0_dp, 1.0_dp))
    if (scale%space) words = words // "," // real_word(source, size * source%dice%decades(-1.0_dp, 1.0_dp))
  end function constants

  !> The moment of inertia of a body; in space, with that probability, those about three axes: none exceeds the sum of the others.
  function inertia(source, scale, size, probability) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    real(dp), intent(in) :: size, probability
    character(len=:), allocatable :: words

    words = real_word(source, size)
    if (scale%space .and. source%dice%chance(probability)) words = words // "," // pair(source, size * &
      & source%dice%between(0.6_dp, 0.9_dp), size * source%dice%between(0.6_dp, 0.9_dp))
  end function inertia

  !> The free degrees of freedom: in space some of the six, with one at least that the plane has not.
  function degrees_of_freedom(source, scale) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable :: words
    character(len=*), parameter :: names(*) = [character(len=9) :: "'xi'", "'eta'", "'psi'", "'rot_eta'", "'zeta'", "'rot_xi'"]
    integer :: i

    associate (dice => source%dice)
      if (.not. scale%space) then
        words = ""
        if (dice%chance(0.2_dp)) words = ", dof=" // dice%pick([character(len=18) :: "'xi'", "'eta'", "'psi'", "'xi','eta'", &
          & "'xi','psi'", "'eta','psi'", "'psi','xi','eta'", "'xi','xi'", "'zeta'"])
        return
      end if
      words = ", dof=" // dice%pick(names(4:))
      do i = 1, size(names)
        if (index(words, trim(names(i))) == 0 .and. dice%chance(0.7_dp)) words = words // "," // trim(names(i))
      end do
    end associate
  end function degrees_of_freedom

  !> Turns of the crank in one of the drive's; not whole ones make the period longer.
  function ratio(source) result(words)
    type(source_type), intent(inout) :: source
    character(len=:), allocatable :: words

    words = ""
    if (source%dice%chance(0.1_dp)) words = ", ratio=" // trim(source%dice%pick(["0.5 ", "-3,2", "2   ", "3,7 "]))
  end function ratio

  !> A dyad on what is there, with lengths that mostly fit on crank and ground.
  subroutine add_dyad(source, scale, words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(inout) :: scale
    character(len=:), allocatable, intent(inout) :: words
    character(len=:), allocatable :: first, second
    integer :: first_one

    associate (dice => source%dice, l => scale%length)
      first_one = 2
      if (dice%chance(0.2_dp)) first_one = 1 + dice%below(scale%joints)
      if (dice%chance(0.6_dp)) then
        call add_joint(scale, words, "type='ground', position=" // pair(source, l * dice%between(0.6_dp, 1.2_dp), &
          & l * dice%between(-0.4_dp, 0.4_dp)))
        second = "'J" // text(scale%joints) // "'"
      else
        second = other_joint(source, scale%joints, first_one)
      end if
      first = name_word(source, "J" // text(first_one))
      select case (dice%below(7))
      case (0)
        call add_joint(scale, words, "type='RRR', ends=" // first // "," // second // ", lengths=" // pair(source, &
          & l * dice%between(0.9_dp, 1.3_dp), l * dice%between(0.7_dp, 1.3_dp)) // branch(source))
      case (1)
        call add_joint(scale, words, "type='RRP', ends=" // first // ", lengths=" // real_word(source, l * &
          & dice%between(0.6_dp, 2.0_dp)) // guide(source, scale, "guide", 0.2_dp) // branch(source))
      case (2)
        call add_joint(scale, words, "type='RPR', ends=" // first // "," // second // ", lengths=" // real_word(source, l * &
          & dice%between(0.1_dp, 2.0_dp)) // branch(source))
      case (3)
        call add_joint(scale, words, "type='rigid', ends=" // first // "," // second // ", offset=" // pair(source, &
          & l * dice%between(-1.0_dp, 1.0_dp), l * dice%between(-1.0_dp, 1.0_dp)))
      case (4)
        call add_joint(scale, words, "type='follower', cam='J1','J2', lift=" // pair(source, 0.3_dp * l, 0.02_dp * l) &
          & // "," // real_word(source, -0.01_dp * l) // guide(source, scale, "guide", 0.2_dp) &
          & // optional(source, ", lift_phase=", 180.0_dp))
      case (5)
        call add_joint(scale, words, "type='PRP'" // guide(source, scale, "guide", 1.0_dp) // guide(source, scale, "guide2", &
          & 0.0_dp))
      case default
        call add_joint(scale, words, "type='RPP', ends=" // first // guide(source, scale, "guide", 0.3_dp) // ", slot_angle=" &
          & // real_word(source, dice%between(40.0_dp, 140.0_dp)))
      end select
    end associate
  end subroutine add_dyad

  !> A guide by its keys; with that probability on the crank.
  function guide(source, scale, key, moving) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=*), intent(in) :: key
    real(dp), intent(in) :: moving
    character(len=:), allocatable :: words

    words = ""
    if (source%dice%chance(moving)) words = ", " // key // "='J1','J2'"
    if (words == "" .or. source%dice%chance(0.5_dp)) words = words // ", " // key // "_point=" // pair(source, 0.0_dp, &
      & scale%length * source%dice%between(-0.2_dp, 0.2_dp)) // ", " // key // "_angle=" // real_word(source, &
      & source%dice%between(-180.0_dp, 180.0_dp))
  end function guide

  subroutine add_joint(scale, words, keys)
    type(scale_type), intent(inout) :: scale
    character(len=:), allocatable, intent(inout) :: words
    character(len=*), intent(in) :: keys

    scale%joints = scale%joints + 1
    words = words // "&joint name='J" // text(scale%joints) // "', " // keys // " /" // newline
  end subroutine add_joint

  !> The name of one of the joints but joint `one`, now and then of that too.
  function other_joint(source, joints, one) result(word)
    type(source_type), intent(inout) :: source
    integer, intent(in) :: joints, one
    character(len=:), allocatable :: word
    integer :: other

    other = 1 + source%dice%below(joints)
    if (other == one .and. source%dice%chance(0.97_dp)) other = 1 + mod(one, joints)
    word = name_word(source, "J" // text(other))
  end function other_joint

  function branch(source) result(words)
    type(source_type), intent(inout) :: source
    character(len=:), allocatable :: words

    words = ", branch=" // whole_word(source, merge(1, -1, source%dice%chance(0.5_dp)))
  end function branch

  !> A key up to `most`, in half of the cases.
  function optional(source, key, most) result(words)
    type(source_type), intent(inout) :: source
    character(len=*), intent(in) :: key
    real(dp), intent(in) :: most
    character(len=:), allocatable :: words

    words = ""
    if (source%dice%chance(0.5_dp)) words = key // real_word(source, most * source%dice%between(-1.0_dp, 1.0_dp))
  end function optional

  !> Two numbers.
  function pair(source, first, second) result(words)
    type(source_type), intent(inout) :: source
    real(dp), intent(in) :: first, second
    character(len=:), allocatable :: words

    words = real_word(source, first) // "," // real_word(source, second)
  end function pair

  !> A mechanism by its mass functions.
  function mass_functions(source, scale) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable :: words

    associate (m => scale%mass, l => scale%length)
      words = "&mass_functions mass=" // real_word(source, m) // ", inertia=" // real_word(source, 0.1_dp * m * l**2) &
        & // harmonics(source, "a1", 0.3_dp * m * l) // harmonics(source, "a2", 0.3_dp * m * l) &
        & // harmonics(source, "a3", m * l**2) // harmonics(source, "moment", m * l**2) &
        & // harmonics(source, "energy", m * l**2) // " /" // newline
    end associate
  end function mass_functions

  function harmonics(source, key, size) result(words)
    type(source_type), intent(inout) :: source
    character(len=*), intent(in) :: key
    real(dp), intent(in) :: size
    character(len=:), allocatable :: words
    integer :: i

    words = ""
    if (source%dice%chance(0.2_dp)) return
    words = ", " // key // "=" // real_word(source, size)
    do i = 1, 2 * source%dice%below(4)
      words = words // "," // real_word(source, 0.1_dp * size * source%dice%between(-1.0_dp, 1.0_dp))
    end do
  end function harmonics

  !> Frame, supports, foundation, probes.
  function mounting(source, scale) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(inout) :: scale
    character(len=:), allocatable :: words
    integer :: i

    associate (dice => source%dice, m => 10 * scale%mass, l => 3 * scale%length)
      words = "&frame mass=" // real_word(source, m) // ", inertia=" &
        & // inertia(source, scale, 0.3_dp * m * l**2, 0.97_dp) // ", origin=" &
        & // point(source, scale, 0.5_dp * l) // degrees_of_freedom(source, scale) // " /" // newline
      scale%supports = dice%below(5)
      do i = 1, scale%supports
        words = words // "&support position=" // point(source, scale, l) // ", stiffness=" &
          & // constants(source, scale, scale%stiffness)
        if (dice%chance(0.6_dp)) words = words // ", damping=" // constants(source, scale, scale%damping)
        if (dice%chance(0.3_dp)) words = words // optional(source, ", angle=", 180.0_dp)
        if (dice%chance(0.3_dp)) words = words // ", axes=" // dice%pick([character(len=7) :: "'frame'", "'space'"])
        words = words // " /" // newline
      end do
      if (scale%supports == 0 .or. dice%chance(0.3_dp)) words = words // foundation(source, scale)
      scale%probes = merge(1 + dice%below(2), 0, dice%chance(0.3_dp))
      do i = 1, scale%probes
        words = words // "&probe name=" // name_word(source, "P" // text(i)) // ", position=" // point(source, scale, l)
        if (dice%chance(0.5_dp)) words = words // ", limit_mm_s=" // real_word(source, dice%decades(-2.0_dp, 2.0_dp))
        if (dice%chance(0.3_dp)) words = words // ", band_hz=" // pair(source, 1.0_dp, dice%decades(0.0_dp, 4.0_dp))
        words = words // " /" // newline
      end do
    end associate
  end function mounting

  function foundation(source, scale) result(words)
    type(source_type), intent(inout) :: source
    type(scale_type), intent(in) :: scale
    character(len=:), allocatable :: words

    associate (c => scale%stiffness, b => scale%damping, l => 3 * scale%length)
      words = "&foundation stiffness=" // real_word(source, c) // ",0,0,0," // real_word(source, c) // ",0,0,0," &
        & // real_word(source, c * l**2) // ", damping=" // pair(source, b, b) // "," // real_word(source, b * l**2) // " /" &
        & // newline
    end associate
  end function foundation

  function units(source) result(words)
    type(source_type), intent(inout) :: source
    character(len=:), allocatable :: words

    associate (dice => source%dice)
      words = "&units length=" // name_word(source, dice%pick(["m ", "cm", "mm", "in"])) // ", mass=" &
        & // name_word(source, dice%pick([character(len=9) :: "kg", "g", "t", "kp s^2/m"])) // ", stiffness=" &
        & // name_word(source, dice%pick([character(len=5) :: "N/m", "N/mm", "kN/m", "kp/cm"])) // ", angle=" &
        & // name_word(source, dice%pick(["deg", "rad"])) // " /" // newline
    end associate
  end function units

end module fuzz_machine
