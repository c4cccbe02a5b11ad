!> Random machines for tests: a linkage on an elastically mounted frame, the same everywhere for the same number of the
!> case. The data are short decimals, so that no compiler can round them differently.
module reference_cases
  use reference_chains, only: set_chain
  use reference_frame, only: frame_matrices, frame_of, frame_system
  use reference_linear, only: qp, solve
  use reference_machine, only: dp, joint_data, machine_data
  use reference_random, only: random_type, rounded
  implicit none (type, external)
  private

  public :: random_machine, random_linkage, highest_frequency

contains

  !> Case `number` (1, 2, ...): a crank-rocker that turns fully, |cos| of the transmission angle at most 0.95 over the
  !> whole turn, anywhere and at any angle on its frame, on 2 to 4 supports; a quarter of the cases has turned supports,
  !> a quarter no damping at all, half of them turn clockwise. The highest natural frequency of the frame at t = 0 times
  !> the period is spread evenly in logarithm over [phase_min, phase_max], default [1, 300].
  function random_machine(number, phase_min, phase_max) result(machine)
    integer, intent(in) :: number
    real(dp), intent(in), optional :: phase_min, phase_max
    type(machine_data) :: machine
    type(random_type) :: random

    call random%start(number, 0)
    call set_linkage(random, machine)
    call set_frame(random, machine)
    call set_speed(random, machine, phase_min, phase_max)
  end function random_machine

  !> Case `number` (1, 2, ...): a linkage of 1 to 4 dyads of all kinds and rigid points (see set_chain) that turns fully
  !> with a margin of 0.3, with 2 to 8 links; frame and speed as in random_machine, a quarter of the cases with a
  !> foundation's stiffness. All of xi, eta, psi are free; set machine%free for less.
  function random_linkage(number, phase_min, phase_max) result(machine)
    integer, intent(in) :: number
    real(dp), intent(in), optional :: phase_min, phase_max
    type(machine_data) :: machine
    type(random_type) :: random

    call random%start(number, 1)
    call set_chain(random, machine)
    call set_frame(random, machine)
    if (random%chance(0.25_dp)) call set_foundation(random, machine)
    call set_speed(random, machine, phase_min, phase_max)
  end function random_linkage

  !> Highest natural frequency (rad/s) of the frame on its springs with the linkage held at t = 0.
  function highest_frequency(machine) result(frequency)
    type(machine_data), intent(in) :: machine
    real(qp) :: frequency
    type(frame_system) :: frame
    real(qp), dimension(count(machine%free), count(machine%free)) :: m, b, c, a
    real(qp), dimension(count(machine%free)) :: h, v
    real(qp), parameter :: start(3) = [1.0_qp, 0.7_qp, 3.1_qp]
    integer :: i

    frame = frame_of(machine)
    call frame_matrices(frame, 0.0_qp, m, b, c, h)
    a = solve(m, frame%stiffness(frame%free, frame%free))
    v = pack(start, machine%free)
    do i = 1, 200
      v = matmul(a, v)
      v = v/norm2(v)
    end do
    frequency = sqrt(norm2(matmul(a, v)))
  end function highest_frequency

  subroutine set_linkage(random, machine)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    real(dp) :: crank, coupler, rocker, pivot(2), way(2), ground
    integer :: i

    do
      crank = random%between(0.03_dp, 0.15_dp)
      coupler = random%between(0.08_dp, 0.60_dp)
      rocker = random%between(0.06_dp, 0.50_dp)
      pivot = [random%about_zero(0.2_dp), random%about_zero(0.2_dp)]
      way = [random%about_zero(0.5_dp), random%about_zero(0.5_dp)]
      ground = sqrt(sum(way**2))
      if (ground < 1.2_dp*crank) cycle
      if (transmits(ground - crank, coupler, rocker) .and. transmits(ground + crank, coupler, rocker)) exit
    end do
    allocate (machine%joints(4), machine%links(3))
    machine%joints(1) = joint_data('ground', position=pivot)
    machine%joints(2) = joint_data('ground', position=[rounded(pivot(1) + way(1), 4), rounded(pivot(2) + way(2), 4)])
    machine%joints(3) = joint_data('crank', ends=[1, 0], radius=crank, phase_deg=rounded(random%between(0.0_dp, &
      & 360.0_dp), 1))
    machine%joints(4) = joint_data('RRR', ends=[3, 2], lengths=[coupler, rocker], &
      & branch=merge(1, -1, random%chance(0.5_dp)))
    machine%links(1)%from = 1
    machine%links(1)%to = 3
    machine%links(2)%from = 3
    machine%links(2)%to = 4
    machine%links(3)%from = 2
    machine%links(3)%to = 4
    do i = 1, 3
      machine%links(i)%mass = random%between(0.1_dp, 2.0_dp)
      machine%links(i)%inertia = random%between(0.0002_dp, 0.02_dp)
      machine%links(i)%center = [random%about_zero(0.2_dp), random%about_zero(0.05_dp)]
    end do
  end subroutine set_linkage

  !> The dyad closes over the distance of its ends with |cos| of the transmission angle at most 0.95.
  pure function transmits(distance, l1, l2) result(good)
    real(dp), intent(in) :: distance, l1, l2
    logical :: good

    good = abs(l1**2 + l2**2 - distance**2) <= 0.95_dp*2*l1*l2
  end function transmits

  subroutine set_frame(random, machine)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    real(dp) :: damper
    logical :: damped, turned
    integer :: i

    machine%frame_mass = random%between(3.0_dp, 40.0_dp)
    machine%frame_inertia = rounded(machine%frame_mass*random%between(0.01_dp, 0.1_dp), 4)
    machine%origin = [random%about_zero(0.3_dp), random%about_zero(0.3_dp)]
    damped = random%chance(0.75_dp)
    damper = 300*0.001_dp**random%draw()
    turned = random%chance(0.25_dp)
    allocate (machine%supports(1 + ceiling(3*random%draw())))
    do i = 1, size(machine%supports)
      associate (support => machine%supports(i))
        support%position = [random%about_zero(0.4_dp), random%about_zero(0.3_dp)]
        support%position(1) = rounded(support%position(1) + merge(0.5_dp, -0.5_dp, modulo(i, 2) == 0), 4)
        support%stiffness = [random%between(10.0_dp, 400.0_dp), random%between(10.0_dp, 400.0_dp)]*1000
        if (damped) support%damping = [random%between(0.0_dp, damper), random%between(0.0_dp, damper)]
        if (turned) support%angle_deg = rounded(random%about_zero(90.0_dp), 1)
      end associate
    end do
    if (damped) machine%foundation_damping = [random%between(0.0_dp, damper/10), random%between(0.0_dp, damper/10), &
      & random%between(0.0_dp, damper/100)]
  end subroutine set_frame

  !> A full symmetric matrix, its diagonal dominant when psi is measured in 1/8 rad.
  subroutine set_foundation(random, machine)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    integer :: i, k

    associate (c => machine%foundation_stiffness)
      do i = 1, 3
        c(i, i) = 1000*random%between(20.0_dp, 50.0_dp)
        do k = 1, i - 1
          c(i, k) = 1000*random%about_zero(10.0_dp)
          c(k, i) = c(i, k)
        end do
      end do
      c(3, :2) = c(3, :2)/8
      c(:2, 3) = c(:2, 3)/8
      c(3, 3) = c(3, 3)/64
    end associate
  end subroutine set_foundation

  subroutine set_speed(random, machine, phase_min, phase_max)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    real(dp), intent(in), optional :: phase_min, phase_max
    real(dp) :: low, high, phase

    low = 1
    high = 300
    if (present(phase_min)) low = phase_min
    if (present(phase_max)) high = phase_max
    machine%speed_rpm = 600 ! any speed will do here
    phase = low*(high/low)**random%draw()
    machine%speed_rpm = rounded(60*real(highest_frequency(machine), dp)/phase, 3)
    if (random%chance(0.5_dp)) machine%speed_rpm = -machine%speed_rpm
  end subroutine set_speed

end module reference_cases
