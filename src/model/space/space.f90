!> What a frame in space has beyond that of the plane: a rigid body with the moving masses of planar mechanisms, on springs and
!> dampers.
!>
!> Its own centre of mass F moves by u = (xi, eta, zeta); theta = (rot_xi, rot_eta, psi) is the vector of its rotation R
!> (gestell_model_space_rotation), w its angular velocity in its own axes. With S, J, H of the masses, those of the frame in m and J
!> (gestell_model_space_masses; ' = d/dt), momentum in space and angular momentum in the frame's axes give, for any rotation,
!>
!>     m u'' + R g                                          = sum of F_j,   g = S'' + 2 w x S' + w' x S + w x (w x S)
!>     J w' + J' w + w x (J w) + H' + w x H + S x (R^T u'') = sum of p_j x R^T F_j
!>
!> and about rest, with theta small,
!>
!>     M = |  m 1   -[S] |   B = B_0 + | 0   -2 [S']    |   C = C_0 + | 0   -[S''] |   h = -(S'', H').
!>         | [S]     J   |             | 0    J' - [H]  |             | 0    0     |
!>
!> and what weights do (gestell_model_space_weights). In the plane psi alone turns, S = (a1, a2) about F, and these are (8) to (12).
module gestell_model_space
  use gestell_base_kinds, only: dp, pi
  use gestell_model_space_blocks, only: add_block, add_cross, all_connected
  use gestell_model_space_drive, only: add_drive, drive_type, driven_type, follow_frame
  use gestell_model_space_masses, only: masses_type, plane_type, sum_planes
  use gestell_model_space_mounting, only: space_support_type, support_matrix, turned_loads
  use gestell_model_space_moving, only: find_moving, moving_type
  use gestell_model_space_rotation, only: cross_matrix
  use gestell_model_space_weights, only: new_space_weights, space_weights_type
  implicit none (type, external)
  private

  public :: is_rotation, new_space

  !> Where the degrees of freedom of a frame, in whose order those of the plane come first, stand in (u, theta).
  integer, parameter, public :: in_space(6) = [1, 2, 6, 3, 4, 5]
  !> Where (u, theta) stand among the frame's degrees of freedom.
  integer, parameter, public :: in_frame(6) = [1, 2, 4, 5, 6, 3]

  !> Sums that will be asked for again, at these angles of the drive (rad).
  type :: table_type
    real(dp), allocatable :: angles(:)
    type(masses_type) :: masses
  end type table_type

  type, public :: space_type
    !> The tensor of inertia about F (kg m^2); the mechanisms' origin O from F (m).
    real(dp) :: inertia(3, 3) = 0, origin(3) = 0
    type(plane_type), allocatable :: planes(:)
    type(space_support_type), allocatable :: supports(:)
    type(drive_type) :: drive
    !> C_0 and B_0, and what of them is the foundation's.
    real(dp), dimension(6, 6) :: stiffness = 0, damping = 0, foundation_stiffness = 0, foundation_damping = 0
    type(space_weights_type) :: weights
    type(table_type), allocatable, private :: tables(:)
  contains
    procedure :: weigh
    procedure :: mean_stiffness, ground_stiffness
    procedure :: scale_mounting
    procedure :: remember
    procedure :: masses_at
    procedure :: sample_at_rest
    procedure :: coupled
    procedure :: mean_matrices, conserves
    procedure :: terms
    procedure :: cancellation
  end type space_type

contains

  !> Mechanisms in their `planes`, each proved to turn, and supports, beside a foundation's matrices in the frame's order.
  pure subroutine new_space(space, inertia, planes, supports, stiffness, damping)
    type(space_type), intent(out) :: space
    real(dp), intent(in) :: inertia(3, 3), stiffness(6, 6), damping(6, 6)
    type(plane_type), intent(in) :: planes(:)
    type(space_support_type), intent(in) :: supports(:)
    integer :: i

    space%inertia = inertia
    space%planes = planes
    space%supports = supports
    space%foundation_stiffness = stiffness(in_frame, in_frame)
    space%foundation_damping = damping(in_frame, in_frame)
    space%stiffness = space%foundation_stiffness
    space%damping = space%foundation_damping
    do i = 1, size(supports)
      space%stiffness = space%stiffness + support_matrix(supports(i), supports(i)%stiffness)
      space%damping = space%damping + support_matrix(supports(i), supports(i)%damping)
    end do
  end subroutine new_space

  !> Weights by `gravity` (m/s^2) where the degrees of freedom `free` of a frame of this `mass` are. `left`: the one along which no
  !> spring carries them, 0: there is none.
  subroutine weigh(self, gravity, mass, free, left)
    class(space_type), intent(inout) :: self
    real(dp), intent(in) :: gravity(3), mass
    integer, intent(in) :: free(:)
    integer, intent(out) :: left

    call new_space_weights(self%weights, gravity, mass, self%planes, self%stiffness, self%supports, in_space(free), left)
    if (left > 0) left = in_frame(left)
  end subroutine weigh

  !> C about rest, its mean over the turn, of the degrees of freedom `free`.
  pure function mean_stiffness(self, free) result(c)
    class(space_type), intent(in) :: self
    integer, intent(in) :: free(:)
    real(dp) :: c(size(free), size(free))

    c = self%stiffness(in_space(free), in_space(free)) + self%weights%stiffness(in_space(free), in_space(free))
  end function mean_stiffness

  !> What forces on the ground and their moment about F at rest have of small motions, in the frame's order.
  pure function ground_stiffness(self) result(c)
    class(space_type), intent(in) :: self
    real(dp) :: c(6, 6)

    c = self%stiffness + turned_loads(self%supports)
    c = c(in_space, in_space)
  end function ground_stiffness
  !> The mounting becomes stiffer and more damped by these factors.
  pure subroutine scale_mounting(self, stiffness, damping)
    class(space_type), intent(inout) :: self
    real(dp), intent(in) :: stiffness, damping
    integer :: i

    self%stiffness = self%stiffness * stiffness
    self%damping = self%damping * damping
    self%foundation_stiffness = self%foundation_stiffness * stiffness
    self%foundation_damping = self%foundation_damping * damping
    do i = 1, size(self%supports)
      self%supports(i)%stiffness = self%supports(i)%stiffness * stiffness
      self%supports(i)%damping = self%supports(i)%damping * damping
    end do
  end subroutine scale_mounting

  !> Whether one of the frame's degrees of freedom turns it.
  elemental logical function is_rotation(dof)
    integer, intent(in) :: dof

    is_rotation = any(in_frame(4:) == dof)
  end function is_rotation

  !> Sums the masses at these angles (rad), for all cases with the same mechanisms that ask for exactly these: the speed (but for
  !> its sign), the frame's mass and inertia and what holds it may change afterwards.
  pure subroutine remember(self, angles)
    class(space_type), intent(inout) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    type(table_type), allocatable :: longer(:)
    integer :: count

    count = 0
    if (allocated(self%tables)) count = size(self%tables)
    allocate(longer(count + 1))
    if (count > 0) longer(:count) = self%tables
    longer(count + 1)%angles = angles
    call sum_planes(self%planes, angles, longer(count + 1)%masses)
    call move_alloc(longer, self%tables)
  end subroutine remember

  !> All masses about F at angles of the drive (rad) that turns at `speed` (rad/s), with the frame's own `mass`, derivatives with
  !> respect to time; or that turns, at each angle, at the first of `rates` (rad/s) and ever faster by the second (rad/s^2).
  pure subroutine masses_at(self, mass, speed, angles, masses, rates)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass, speed
    real(dp), contiguous, intent(in) :: angles(:)
    type(masses_type), intent(out) :: masses
    real(dp), intent(in), optional :: rates(:, :)
    integer :: i, k

    call find_sums(self, angles, masses)
    masses%mass = masses%mass + mass
    do k = 1, 3
      do i = 1, 3
        masses%j(:, i, k, 0) = masses%j(:, i, k, 0) + self%inertia(i, k)
      end do
    end do
    if (present(rates)) then
      do k = 1, 3
        associate (s => masses%s(:, k, :), j => masses%j(:, :, k, 1), h => masses%h(:, k, :))
          s(:, 3) = rates(:, 1)**2 * s(:, 3) + rates(:, 2) * s(:, 2)
          s(:, 2) = rates(:, 1) * s(:, 2)
          j = j * spread(rates(:, 1), 2, 3)
          h(:, 2) = rates(:, 1)**2 * h(:, 2) + rates(:, 2) * h(:, 1)
          h(:, 1) = rates(:, 1) * h(:, 1)
        end associate
      end do
      return
    end if
    masses%s(:, :, 1) = speed * masses%s(:, :, 1)
    masses%s(:, :, 2) = speed**2 * masses%s(:, :, 2)
    masses%j(:, :, :, 1) = speed * masses%j(:, :, :, 1)
    masses%h(:, :, 0) = speed * masses%h(:, :, 0)
    masses%h(:, :, 1) = speed**2 * masses%h(:, :, 1)
  end subroutine masses_at

  !> The planes' sums, from the table with exactly these angles in this order, if there is one.
  pure subroutine find_sums(self, angles, masses)
    class(space_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    type(masses_type), intent(out) :: masses
    integer :: i

    if (allocated(self%tables)) then
      do i = 1, size(self%tables)
        if (size(self%tables(i)%angles) /= size(angles)) cycle
        if (any(abs(self%tables(i)%angles - angles) > 0)) cycle
        masses = self%tables(i)%masses
        return
      end do
    end if
    call sum_planes(self%planes, angles, masses)
  end subroutine find_sums

  !> M, B, C, h about rest at angles of the drive, of the degrees of freedom `free` of a frame of this `mass`, shapes (angles, free,
  !> free), (angles, free).
  pure subroutine sample_at_rest(self, mass, speed, angles, free, m, b, c, h)
    class(space_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), intent(in) :: mass, speed
    integer, intent(in) :: free(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    type(masses_type) :: masses
    integer :: at(size(free)), place(6), i, k

    call self%masses_at(mass, speed, angles, masses)
    at = in_space(free)
    place = 0
    place(at) = [(i, i = 1, size(at))]
    do k = 1, size(at)
      do i = 1, size(at)
        m(:, i, k) = 0
        b(:, i, k) = self%damping(at(i), at(k))
        c(:, i, k) = self%stiffness(at(i), at(k)) + self%weights%stiffness(at(i), at(k))
      end do
      if (at(k) <= 3) m(:, k, k) = masses%mass
    end do
    associate (u => place(:3), theta => place(4:), s => masses%s, j => masses%j, h => masses%h)
      call add_cross(m, -1.0_dp, s(:, :, 0), u, theta)
      call add_cross(m, 1.0_dp, s(:, :, 0), theta, u)
      call add_block(m, j(:, :, :, 0), theta)
      call add_cross(b, -2.0_dp, s(:, :, 1), u, theta)
      call add_block(b, j(:, :, :, 1), theta)
      call add_cross(b, -1.0_dp, h(:, :, 0), theta, theta)
      call add_cross(c, -1.0_dp, s(:, :, 2), u, theta)
    end associate
    if (self%weights%act) call self%weights%add_stiffness(place(4:), masses%s(:, :, 0), c)
    if (present(h)) then
      do i = 1, size(at)
        if (at(i) <= 3) h(:, i) = -masses%s(:, at(i), 2)
        if (at(i) > 3) h(:, i) = -masses%h(:, at(i) - 3, 1)
      end do
      if (self%weights%act) call self%weights%add_load(place(4:), masses%s(:, :, 0), h)
    end if
    if (self%drive%even_in_space()) call add_drive_at_rest(self, speed, angles, at, m, b, c, h)
  end subroutine sample_at_rest

  !> Adds to these what a drive that turns evenly in space makes of them.
  pure subroutine add_drive_at_rest(self, speed, angles, at, m, b, c, h)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: speed, angles(:)
    integer, intent(in) :: at(:)
    real(dp), intent(inout) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), intent(inout), optional :: h(:, :)
    type(driven_type) :: driven
    real(dp) :: r(6), all_m(6, 6), all_b(6, 6), all_c(6, 6)
    real(dp), parameter :: upright(3, 0:2) = 0
    integer :: k

    call follow_frame(self%drive, speed, -self%weights%gravity, upright, driven%moved, driven%turn)
    do k = 1, size(angles)
      call find_moving(self%planes, angles(k), driven%moving)
      r = 0
      all_m = 0
      all_b = 0
      all_c = 0
      all_b(4:, 4:) = -cross_matrix(driven%moved%spin)
      call add_drive(driven%turn, driven%moving, driven%moved, r, all_m, all_b, all_c)
      m(k, :, :) = total(m(k, :, :), all_m(at, at))
      b(k, :, :) = total(b(k, :, :), all_b(at, at))
      c(k, :, :) = total(c(k, :, :), all_c(at, at))
      if (present(h)) h(k, :) = total(h(k, :), -r(at))
    end do
  end subroutine add_drive_at_rest

  !> a + b, zero where only rounding is left.
  elemental real(dp) function total(a, b)
    real(dp), intent(in) :: a, b

    total = a + b
    if (abs(total) <= 8 * epsilon(1.0_dp) * (abs(a) + abs(b))) total = 0
  end function total

  !> Which of the degrees of freedom `free` act on each other, of so many angles of the turn, or of the first ones that connect all.
  pure function coupled(self, mass, free, angles)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass
    integer, intent(in) :: free(:), angles
    logical :: coupled(size(free), size(free))
    integer, parameter :: at_once = 4
    real(dp), dimension(at_once, size(free), size(free)) :: m, b, c
    integer :: first, i

    coupled = .false.
    do first = 1, angles, at_once
      call self%sample_at_rest(mass, 1.0_dp, [(2 * pi * i / angles, i = first, first + at_once - 1)], free, m, b, c)
      coupled = coupled .or. any(abs(m) > 0 .or. abs(b) > 0 .or. abs(c) > 0, dim=1)
      coupled = coupled .or. transpose(coupled)
      if (all_connected(coupled)) exit
    end do
  end function coupled

  !> Means of M, of the gyroscopic moments G in B and of C over so many angles of the turn, of the degrees of freedom `free` of a
  !> frame of this `mass`, the drive turning at `speed` (rad/s).
  pure subroutine mean_matrices(self, mass, speed, free, angles, m, g, c)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass, speed
    integer, intent(in) :: free(:), angles
    real(dp), allocatable, intent(out) :: m(:, :), g(:, :), c(:, :)
    real(dp), dimension(angles, size(free), size(free)) :: all_m, all_b, all_c
    integer :: i

    call self%sample_at_rest(mass, speed, [(2 * pi * i / angles, i = 1, angles)], free, all_m, all_b, all_c)
    m = sum(all_m, dim=1) / angles
    c = self%mean_stiffness(free)
    all_b = all_b - spread(self%damping(in_space(free), in_space(free)), 1, angles)
    g = sum(all_b, dim=1) / angles
    g = (g - transpose(g)) / 2
    where (abs(g) <= 64 * epsilon(1.0_dp) * maxval(abs(all_b), dim=1)) g = 0
  end subroutine mean_matrices

  !> Whether the equations of the degrees of freedom `free` are those of a Lagrangian: nothing damps them, their stiffness is
  !> symmetric, the drive stands on the frame, and of two rotations nothing is left out, as it is `about_rest`.
  pure logical function conserves(self, free, about_rest)
    class(space_type), intent(in) :: self
    integer, intent(in) :: free(:)
    logical, intent(in) :: about_rest
    real(dp) :: c(size(free), size(free)), rounding
    integer :: rotations, i

    rotations = count(is_rotation(free))
    c = self%stiffness(in_space(free), in_space(free))
    ! sums over turned supports are symmetric but for their rounding
    rounding = 64 * epsilon(1.0_dp) * maxval(abs(c))
    conserves = .not. (self%drive%even_in_space() .or. about_rest .and. rotations > 1 .or. any(abs(c - transpose(c)) > rounding) &
      & .or. any(abs(self%damping(in_space(free), in_space(free))) > 0))
    ! Once the frame turns, dampers along the others act too.
    if (rotations > 0) conserves = conserves .and. .not. any([(self%supports(i)%damping > 0, i = 1, size(self%supports))])
  end function conserves

  !> At unit speed, the sum of the absolute terms of the mechanisms' forces (kg m) and of their moments (kg m^2): what they cancel
  !> to is known to their roundings only.
  pure function terms(self)
    class(space_type), intent(in) :: self
    real(dp) :: terms(2), force, reach
    integer :: j

    terms = 0
    do j = 1, size(self%planes)
      associate (plane => self%planes(j))
        force = norm2(plane%linkage%terms(:2))
        reach = norm2(plane%origin) + maxval([0.0_dp, abs(plane%linkage%links%z)])
        terms = terms + [force, plane%linkage%terms(3) + reach * force]
      end associate
    end do
  end function terms

  !> By how many times the absolute terms of the load exceed it, the greatest over the degrees of freedom `free`, weighted as in the
  !> kinetic energy of a frame of this `mass` (kg); 0: nothing cancels.
  pure real(dp) function cancellation(self, mass, free)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass
    integer, intent(in) :: free(:)
    integer, parameter :: angles = 16
    type(masses_type) :: all
    type(moving_type) :: moving
    real(dp) :: greatest, weights(6), turn(angles), load(6)
    integer :: i, k, at(size(free))

    at = in_space(free)
    greatest = 0
    turn = [(2 * pi * k / angles, k = 1, angles)]
    call self%masses_at(mass, 1.0_dp, turn, all)
    weights(:3) = 1 / sqrt(max(tiny(1.0_dp), all%mass))
    do k = 1, angles
      weights(4:) = 1 / sqrt(max(tiny(1.0_dp), [(all%j(k, i, i, 0), i = 1, 3)]))
      load = [all%s(k, :, 2), all%h(k, :, 1)]
      if (self%drive%even_in_space()) then
        call find_moving(self%planes, turn(k), moving)
        load(4:) = load(4:) - self%drive%axis * moving%k(1) / (2 * self%drive%turns)
      end if
      greatest = max(greatest, maxval(abs(load(at)) * weights(at)))
    end do
    cancellation = 0
    if (.not. greatest > 0) return
    associate (terms => [maxval(weights(:3)), maxval(weights(4:))] * self%terms())
      cancellation = max(0.0_dp, maxval(terms) / greatest - 1)
    end associate
  end function cancellation

end module gestell_model_space
