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
!> In the plane psi alone turns, S = (a1, a2) about F, and these are (8) to (12).
module gestell_model_space
  use gestell_base_kinds, only: dp, pi
  use gestell_model_space_masses, only: masses_type, plane_type, sum_planes
  use gestell_model_space_mounting, only: space_support_type, support_matrix
  use gestell_model_space_rotation, only: cross_matrix
  implicit none (type, external)
  private

  public :: is_rotation, new_space

  !> Where the degrees of freedom of a frame, in whose order those of the plane come first, stand in (u, theta).
  integer, parameter, public :: in_space(6) = [1, 2, 6, 3, 4, 5]
  !> Where (u, theta) stand among the frame's degrees of freedom.
  integer, parameter, public :: in_frame(6) = [1, 2, 4, 5, 6, 3]

  type, public :: space_type
    !> The tensor of inertia about F (kg m^2).
    real(dp) :: inertia(3, 3) = 0
    type(plane_type), allocatable :: planes(:)
    type(space_support_type), allocatable :: supports(:)
    !> C_0 and B_0, and what of them is the foundation's.
    real(dp), dimension(6, 6) :: stiffness = 0, damping = 0, foundation_stiffness = 0, foundation_damping = 0
  contains
    procedure :: masses_at
    procedure :: sample_at_rest
    procedure :: coupled
    procedure :: mean_mass
    procedure :: cancellation
  end type space_type

contains

  !> Mechanisms in their `planes`, each proved to turn, and supports, beside a foundation's matrices of (xi, eta, psi).
  pure subroutine new_space(space, inertia, planes, supports, stiffness, damping)
    type(space_type), intent(out) :: space
    real(dp), intent(in) :: inertia(3, 3), stiffness(3, 3), damping(3, 3)
    type(plane_type), intent(in) :: planes(:)
    type(space_support_type), intent(in) :: supports(:)
    integer, parameter :: flat(3) = in_space(:3)
    integer :: i

    space%inertia = inertia
    space%planes = planes
    space%supports = supports
    space%foundation_stiffness(flat, flat) = stiffness
    space%foundation_damping(flat, flat) = damping
    space%stiffness = space%foundation_stiffness
    space%damping = space%foundation_damping
    do i = 1, size(supports)
      space%stiffness = space%stiffness + support_matrix(supports(i), supports(i)%stiffness)
      space%damping = space%damping + support_matrix(supports(i), supports(i)%damping)
    end do
  end subroutine new_space

  !> Whether one of the frame's degrees of freedom turns it.
  elemental logical function is_rotation(dof)
    integer, intent(in) :: dof

    is_rotation = any(in_frame(4:) == dof)
  end function is_rotation

  !> All masses about F at an angle of the drive (rad) that turns at `speed` (rad/s), with the frame's own `mass`, derivatives with
  !> respect to time.
  pure subroutine masses_at(self, mass, speed, angle, masses)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass, speed, angle
    type(masses_type), intent(out) :: masses

    call sum_planes(self%planes, angle, masses)
    masses%mass = masses%mass + mass
    masses%j(:, :, 0) = masses%j(:, :, 0) + self%inertia
    masses%s(:, 1) = speed * masses%s(:, 1)
    masses%s(:, 2) = speed**2 * masses%s(:, 2)
    masses%j(:, :, 1) = speed * masses%j(:, :, 1)
    masses%h(:, 0) = speed * masses%h(:, 0)
    masses%h(:, 1) = speed**2 * masses%h(:, 1)
  end subroutine masses_at

  !> M, B, C, h about rest at angles of the drive, of the degrees of freedom `free` of a frame of this `mass`, shapes (angles, free,
  !> free), (angles, free).
  !> Nine arguments: the machine and where it is; M, B, C, h.
  pure subroutine sample_at_rest(self, mass, speed, angles, free, m, b, c, h)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass, speed, angles(:)
    integer, intent(in) :: free(:)
    real(dp), intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), intent(out), optional :: h(:, :)
    type(masses_type) :: masses
    real(dp), dimension(6, 6) :: all_m, all_b, all_c
    real(dp) :: all_h(6)
    integer :: at(size(free)), i, k

    at = in_space(free)
    do k = 1, size(angles)
      call self%masses_at(mass, speed, angles(k), masses)
      all_m = 0
      do i = 1, 3
        all_m(i, i) = masses%mass
      end do
      all_m(4:, :3) = cross_matrix(masses%s(:, 0))
      all_m(:3, 4:) = -all_m(4:, :3)
      all_m(4:, 4:) = masses%j(:, :, 0)
      all_b = self%damping
      all_b(:3, 4:) = all_b(:3, 4:) - 2 * cross_matrix(masses%s(:, 1))
      all_b(4:, 4:) = all_b(4:, 4:) + masses%j(:, :, 1) - cross_matrix(masses%h(:, 0))
      all_c = self%stiffness
      all_c(:3, 4:) = all_c(:3, 4:) - cross_matrix(masses%s(:, 2))
      m(k, :, :) = all_m(at, at)
      b(k, :, :) = all_b(at, at)
      c(k, :, :) = all_c(at, at)
      if (.not. present(h)) cycle
      all_h = -[masses%s(:, 2), masses%h(:, 1)]
      h(k, :) = all_h(at)
    end do
  end subroutine sample_at_rest

  !> Which of the degrees of freedom `free` act on each other, of so many angles of the turn.
  pure function coupled(self, mass, free, angles)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass
    integer, intent(in) :: free(:), angles
    logical :: coupled(size(free), size(free))
    real(dp), dimension(angles, size(free), size(free)) :: m, b, c
    integer :: i

    call self%sample_at_rest(mass, 1.0_dp, [(2 * pi * i / angles, i = 1, angles)], free, m, b, c)
    coupled = any(abs(m) > 0 .or. abs(b) > 0 .or. abs(c) > 0, dim=1)
    coupled = coupled .or. transpose(coupled)
  end function coupled

  !> M over the turn, the mean of so many angles.
  pure function mean_mass(self, mass, free, angles) result(mean)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass
    integer, intent(in) :: free(:), angles
    real(dp) :: mean(size(free), size(free))
    real(dp), dimension(angles, size(free), size(free)) :: m, b, c
    integer :: i

    call self%sample_at_rest(mass, 1.0_dp, [(2 * pi * i / angles, i = 1, angles)], free, m, b, c)
    mean = sum(m, dim=1) / angles
  end function mean_mass

  !> By how many times the absolute terms of the load exceed it, the greatest over the degrees of freedom `free`, weighted as in the
  !> kinetic energy of a frame of this `mass` (kg); 0: nothing cancels.
  pure real(dp) function cancellation(self, mass, free)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass
    integer, intent(in) :: free(:)
    integer, parameter :: angles = 16
    type(masses_type) :: all
    real(dp) :: greatest, terms, weights(6), reach
    integer :: i, j, k, at(size(free))

    at = in_space(free)
    greatest = 0
    terms = 0
    do k = 1, angles
      call self%masses_at(mass, 1.0_dp, 2 * pi * k / angles, all)
      weights(:3) = 1 / sqrt(max(tiny(1.0_dp), all%mass))
      weights(4:) = 1 / sqrt(max(tiny(1.0_dp), [(all%j(i, i, 0), i = 1, 3)]))
      associate (h => [all%s(:, 2), all%h(:, 1)] * weights)
        greatest = max(greatest, maxval(abs(h(at))))
      end associate
    end do
    cancellation = 0
    if (.not. greatest > 0) return
    do j = 1, size(self%planes)
      associate (plane => self%planes(j))
        reach = norm2(plane%origin) + maxval([0.0_dp, abs(plane%linkage%links%z)])
        terms = terms + max(maxval(weights(:3)) * norm2(plane%linkage%terms(:2)), &
          & maxval(weights(4:)) * (plane%linkage%terms(3) + reach * norm2(plane%linkage%terms(:2))))
      end associate
    end do
    cancellation = max(0.0_dp, terms / greatest - 1)
  end function cancellation

end module gestell_model_space
