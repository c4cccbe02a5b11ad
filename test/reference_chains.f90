!> Random linkages: a crank and a chain of dyads and rigid points that turns fully, found by trial over sampled turns.
module reference_chains
  use reference_joints, only: body_axis, place_joint
  use reference_linear, only: qp
  use reference_machine, only: dp, joint_data, link_data, machine_data, pi_qp
  use reference_random, only: random_type
  implicit none (type, external)
  private

  public :: set_chain

  integer, parameter :: samples = 240  ! angles of one turn
  integer, parameter :: stride = 97    ! they are tried in this stride, so that what fails does so soon
  integer, parameter :: most = 20      ! joints: 2 of the crank, 2 a dyad, 1 rigid point before and after each dyad
  real(qp), parameter :: margin_least = 0.3_qp
  real(qp), parameter :: farthest = 1.5_qp           ! of a joint from the crank's pivot, m
  real(qp), parameter :: steepest(2) = [6.0_qp, 40.0_qp] ! first and second derivative of a joint over the radius
  character(len=3), parameter :: kinds(5) = ['RRR', 'RRP', 'RPR', 'PRP', 'RPP']

  !> The part of the linkage that stands; p(:, :, k, i) is joint k at the i-th angle.
  type :: chain_type
    integer :: count = 0
    type(joint_data) :: joints(most)
    logical :: moves(most) = .false.
    real(qp) :: p(2, 0:2, most, samples) = 0
  end type chain_type

contains

  !> Joints and 2 to 8 links with masses. The crank is joint 2 on joint 1; it is followed by 1 to 4 dyads, each led by
  !> at least one joint that moves, half of the guides moving, and by rigid points in between. Over 240 angles of the
  !> turn every margin (see place_joint) is at least 0.3, no joint is farther than 1.5 m from the crank's pivot, and its
  !> first and second derivatives are at most 6 and 40 times the crank's radius.
  subroutine set_chain(random, machine)
    type(random_type), intent(inout) :: random
    type(machine_data), intent(inout) :: machine
    type(chain_type), allocatable :: chain
    type(link_data), allocatable :: bodies(:)
    integer :: dyads, i

    allocate (chain)
    call set_crank(random, chain)
    bodies = [link_data(1, 2)]
    dyads = random%pick(4)
    if (random%chance(0.2_dp)) call add_rigid(random, chain)
    do i = 1, dyads
      call add_dyad(random, chain, bodies)
      if (random%chance(0.3_dp)) call add_rigid(random, chain)
    end do
    machine%joints = chain%joints(:chain%count)
    call set_links(random, chain, bodies, machine%links)
  end subroutine set_chain

  subroutine set_crank(random, chain)
    type(random_type), intent(inout) :: random
    type(chain_type), intent(inout) :: chain
    type(joint_data) :: joint
    logical :: fits

    joint%position(1) = random%about_zero(0.2_dp)
    joint%position(2) = random%about_zero(0.2_dp)
    call append(chain, joint, fits)
    joint = joint_data('crank', ends=[1, 0])
    joint%radius = random%between(0.03_dp, 0.15_dp)
    joint%phase_deg = tenths(random, 360.0_dp)
    call append(chain, joint, fits)
  end subroutine set_crank

  !> One more dyad, and the bodies it brings. A kind that does not fit 100 times gives way to another.
  subroutine add_dyad(random, chain, bodies)
    type(random_type), intent(inout) :: random
    type(chain_type), intent(inout) :: chain
    type(link_data), allocatable, intent(inout) :: bodies(:)
    type(joint_data) :: joint
    integer :: kind, try, before
    logical :: fits

    before = chain%count
    do
      kind = random%pick(size(kinds))
      do try = 1, 100
        call draw_dyad(random, chain, kinds(kind), joint)
        call append(chain, joint, fits)
        if (fits) exit
        chain%count = before
      end do
      if (fits) exit
    end do
    associate (s => chain%count)
      select case (joint%kind)
      case ('RRR')
        bodies = [bodies, link_data(joint%ends(1), s), link_data(joint%ends(2), s)]
      case ('RRP')
        bodies = [bodies, link_data(joint%ends(1), s), link_data(s, 0)]
      case ('RPR')
        bodies = [bodies, link_data(joint%ends(2), s), link_data(joint%ends(1), joint%ends(2))]
      case default
        bodies = [bodies, link_data(s, 0)]
      end select
    end associate
  end subroutine add_dyad

  !> A dyad's joint with a moving joint among those it uses. It may bring a ground joint, appended at once.
  subroutine draw_dyad(random, chain, kind, joint)
    type(random_type), intent(inout) :: random
    type(chain_type), intent(inout) :: chain
    character(len=*), intent(in) :: kind
    type(joint_data), intent(out) :: joint
    logical :: fixed

    joint%kind = kind
    joint%branch = merge(1, -1, random%chance(0.5_dp))
    fixed = random%chance(0.5_dp)
    select case (kind)
    case ('RRR')
      joint%ends(1) = leader(random, chain)
      joint%ends(2) = partner(random, chain, joint%ends(1))
      if (random%chance(0.5_dp)) joint%ends = joint%ends([2, 1])
      joint%lengths(1) = random%between(0.06_dp, 0.60_dp)
      joint%lengths(2) = random%between(0.06_dp, 0.60_dp)
    case ('RRP')
      joint%ends(1) = leader(random, chain)
      if (.not. fixed) then
        if (random%chance(0.3_dp)) joint%ends(1) = random%pick(chain%count)
      end if
      joint%lengths(1) = random%between(0.06_dp, 0.60_dp)
      call draw_guide(random, chain, fixed, joint%guide, joint%guide_point, joint%guide_angle_deg)
    case ('RPR')
      joint%ends(1) = leader(random, chain)
      joint%ends(2) = partner(random, chain, joint%ends(1))
      if (random%chance(0.3_dp)) joint%ends = joint%ends([2, 1])
      joint%lengths(1) = random%between(0.06_dp, 0.60_dp)
    case ('PRP')
      call draw_guide(random, chain, .false., joint%guide, joint%guide_point, joint%guide_angle_deg)
      call draw_guide(random, chain, fixed, joint%guide2, joint%guide2_point, joint%guide2_angle_deg)
      if (random%chance(0.5_dp)) then
        joint = joint_data('PRP', branch=joint%branch, guide=joint%guide2, guide_point=joint%guide2_point, &
          & guide_angle_deg=joint%guide2_angle_deg, guide2=joint%guide, guide2_point=joint%guide_point, &
          & guide2_angle_deg=joint%guide_angle_deg)
      end if
    case ('RPP')
      joint%ends(1) = leader(random, chain)
      call draw_guide(random, chain, fixed, joint%guide, joint%guide_point, joint%guide_angle_deg)
      if (random%chance(0.7_dp)) joint%slot_angle_deg = 30 + tenths(random, 120.0_dp)
      if (random%chance(0.3_dp)) joint%slot_angle_deg = -joint%slot_angle_deg
    case default
      error stop "reference_chains: unknown kind of dyad"
    end select
  end subroutine draw_dyad

  !> A guide, moving ones carried by two joints of which one moves.
  subroutine draw_guide(random, chain, fixed, carriers, point, angle_deg)
    type(random_type), intent(inout) :: random
    type(chain_type), intent(in) :: chain
    logical, intent(in) :: fixed
    integer, intent(out) :: carriers(2)
    real(dp), intent(out) :: point(2), angle_deg

    carriers = 0
    point = 0
    if (.not. fixed) carriers = pair(random, chain)
    if (random%chance(0.8_dp)) then
      point(1) = random%about_zero(0.3_dp)
      point(2) = random%about_zero(0.3_dp)
    end if
    angle_deg = tenths(random, 360.0_dp) - 180
  end subroutine draw_guide

  !> A rigid point on a body between any two joints, if one fits soon.
  subroutine add_rigid(random, chain)
    type(random_type), intent(inout) :: random
    type(chain_type), intent(inout) :: chain
    type(joint_data) :: joint
    integer :: try
    logical :: fits

    joint%kind = 'rigid'
    do try = 1, 20
      joint%ends = pair(random, chain)
      joint%offset(1) = random%about_zero(0.3_dp)
      joint%offset(2) = random%about_zero(0.3_dp)
      call append(chain, joint, fits)
      if (fits) return
    end do
  end subroutine add_rigid

  !> Appends the joint if it can be assembled well all over the turn.
  subroutine append(chain, joint, fits)
    type(chain_type), intent(inout) :: chain
    type(joint_data), intent(in) :: joint
    logical, intent(out) :: fits
    real(qp) :: s(2, 0:2), margin, scale
    integer :: i, k, n

    n = chain%count + 1
    if (n > most) error stop "reference_chains: too many joints"
    scale = max(maxval(chain%joints(:n - 1)%radius), joint%radius)
    fits = .false.
    k = 1
    do i = 1, samples
      k = modulo(k - 1 + stride, samples) + 1
      call place_joint(joint, 2*pi_qp*k/samples, scale, chain%p(:, :, :n - 1, k), s, margin)
      if (margin < margin_least .or. norm2(s(:, 0) - chain%p(:, 0, 1, k)) > farthest) return
      if (norm2(s(:, 1)) > steepest(1)*scale .or. norm2(s(:, 2)) > steepest(2)*scale) return
      chain%p(:, :, n, k) = s
    end do
    fits = .true.
    chain%joints(n) = joint
    chain%moves(n) = maxval(abs(chain%p(:, 1, n, :))) > 1.0e-20_qp
    chain%count = n
  end subroutine append

  !> 2 to 8 of the bodies, the crank among them; if they do not suffice, others between any joints.
  subroutine set_links(random, chain, bodies, links)
    type(random_type), intent(inout) :: random
    type(chain_type), intent(in) :: chain
    type(link_data), intent(in) :: bodies(:)
    type(link_data), allocatable, intent(inout) :: links(:)
    type(link_data) :: body
    integer :: i, k, many

    links = pack(bodies, [(turns_gently(chain, bodies(i)), i = 1, size(bodies))])
    many = 1 + random%pick(7)
    do while (size(links) > many)
      k = 1 + random%pick(size(links) - 1)
      links = [links(:k - 1), links(k + 1:)]
    end do
    do while (size(links) < many)
      if (random%chance(0.3_dp)) then
        body = link_data(leader(random, chain), 0)
      else
        associate (ends => pair(random, chain))
          body = link_data(ends(1), ends(2))
        end associate
      end if
      if (turns_gently(chain, body)) links = [links, body]
    end do
    do i = 1, size(links)
      links(i)%mass = random%between(0.1_dp, 2.0_dp)
      links(i)%inertia = random%between(0.0002_dp, 0.02_dp)
      links(i)%center(1) = random%about_zero(0.2_dp)
      links(i)%center(2) = random%about_zero(0.05_dp)
    end do
  end subroutine set_links

  !> The body's joints keep their distance, and it turns no faster than the bound for a joint on a crank of radius 1.
  function turns_gently(chain, body) result(good)
    type(chain_type), intent(in) :: chain
    type(link_data), intent(in) :: body
    logical :: good
    real(qp) :: e(2, 0:2), margin
    integer :: k

    do k = 1, samples
      call body_axis(chain%p(:, :, :chain%count, k), body%from, body%to, chain%joints(2)%radius*1.0_qp, e, margin)
      good = margin >= margin_least .and. norm2(e(:, 1)) <= steepest(1) .and. norm2(e(:, 2)) <= steepest(2)
      if (.not. good) return
    end do
  end function turns_gently

  !> A joint that moves, most often the last.
  function leader(random, chain) result(k)
    type(random_type), intent(inout) :: random
    type(chain_type), intent(in) :: chain
    integer :: k

    k = chain%count
    if (random%chance(0.3_dp)) k = random%pick(chain%count)
    do while (.not. chain%moves(k))
      k = modulo(k - 2, chain%count) + 1
    end do
  end function leader

  !> The other end of a dyad: most often a new ground joint.
  function partner(random, chain, end) result(k)
    type(random_type), intent(inout) :: random
    type(chain_type), intent(inout) :: chain
    integer, intent(in) :: end
    integer :: k
    type(joint_data) :: ground
    logical :: fits

    if (random%chance(0.7_dp)) then
      ground%position(1) = random%about_zero(0.6_dp)
      ground%position(2) = random%about_zero(0.6_dp)
      call append(chain, ground, fits)
      k = chain%count
      if (fits) return
    end if
    k = random%pick(chain%count)
    if (k == end) k = modulo(k, chain%count) + 1
  end function partner

  !> Two different joints, at least one of them moving.
  function pair(random, chain) result(ends)
    type(random_type), intent(inout) :: random
    type(chain_type), intent(in) :: chain
    integer :: ends(2)

    ends(1) = leader(random, chain)
    ends(2) = random%pick(chain%count)
    if (ends(2) == ends(1)) ends(2) = modulo(ends(1), chain%count) + 1
    if (random%chance(0.5_dp)) ends = ends([2, 1])
  end function pair

  !> Evenly in [0, high], to one decimal.
  function tenths(random, high) result(u)
    type(random_type), intent(inout) :: random
    real(dp), intent(in) :: high
    real(dp) :: u

    u = anint(10*high*random%draw())/10
  end function tenths

end module reference_chains
