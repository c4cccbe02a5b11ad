!> The frame in space: a rigid body with the moving masses of planar mechanisms, on springs and dampers.
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
module gestell_model_space_frame
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_model_space_masses, only: masses_type, plane_type, sum_planes
  use gestell_model_space_mounting, only: space_support_type, support_matrix
  use gestell_model_space_rotation, only: cross_matrix
  use gestell_system_second_order, only: second_order_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: new_space_frame

  !> Degrees of freedom, in the order of the matrices.
  character(len=7), parameter, public :: space_dof_names(6) = [character(len=7) :: "xi", "eta", "zeta", "rot_xi", "rot_eta", "psi"]

  !> States (q, q') of the free ones in m, rad, m/s, rad/s, time in s from the drive's angle 0.
  type, extends(second_order_system), public :: space_frame_type
    !> m_F (kg), the tensor of inertia about F (kg m^2).
    real(dp) :: mass = 0, inertia(3, 3) = 0
    !> The drive's speed (rad/s).
    real(dp) :: speed = 0
    integer, allocatable :: free(:)
    type(plane_type), allocatable :: planes(:)
    type(space_support_type), allocatable :: supports(:)
    !> C_0 and B_0.
    real(dp) :: stiffness(6, 6) = 0, damping(6, 6) = 0
  contains
    procedure :: matrices
    procedure :: load
    procedure :: masses_at
  end type space_frame_type

contains

  !> A frame with mechanisms in its `planes`, each proved to turn. `inertia`: the tensor about F. Errors: numbers that are not
  !> finite or out of range; a mechanism that cannot turn.
  !> Eight arguments: the data of a machine.
  subroutine new_space_frame(frame, mass, inertia, planes, supports, speed, free, error)
    type(space_frame_type), intent(out) :: frame
    real(dp), intent(in) :: mass, inertia(3, 3), speed
    type(plane_type), intent(in) :: planes(:)
    type(space_support_type), intent(in) :: supports(:)
    integer, intent(in) :: free(:)
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    if (.not. (ieee_is_finite(mass) .and. all(ieee_is_finite(inertia)) .and. ieee_is_finite(speed))) then
      call fatal_error(error, "the frame's data are not finite", invalid_input)
    else if (mass < 0 .or. abs(speed) < tiny(speed)) then
      call fatal_error(error, "the frame's mass must not be negative, and the speed not zero", invalid_input)
    else if (size(free) == 0 .or. any(free < 1) .or. any(free > 6) .or. any([(count(free == i) > 1, i = 1, 6)])) then
      call fatal_error(error, "the free degrees of freedom must be some of six, each once", invalid_input)
    end if
    if (allocated(error)) return
    frame%mass = mass
    frame%inertia = inertia
    frame%planes = planes
    frame%supports = supports
    frame%speed = speed
    frame%free = free
    frame%states = 2 * size(free)
    frame%period = 2 * pi / abs(speed)
    do i = 1, size(planes)
      call frame%planes(i)%linkage%prepare(error)
      if (allocated(error)) return
      associate (scale => frame%planes(i)%linkage%angle_scale)
        frame%rounding = max(frame%rounding, epsilon(1.0_dp) / scale**2)
        frame%least_steps = max(frame%least_steps, ceiling(2 * pi / scale))
      end associate
    end do
    do i = 1, size(supports)
      frame%stiffness = frame%stiffness + support_matrix(supports(i), supports(i)%stiffness)
      frame%damping = frame%damping + support_matrix(supports(i), supports(i)%damping)
    end do
  end subroutine new_space_frame

  !> All masses about F at a time (s), with the frame's own, derivatives with respect to time.
  pure subroutine masses_at(self, t, masses)
    class(space_frame_type), intent(in) :: self
    real(dp), intent(in) :: t
    type(masses_type), intent(out) :: masses

    call sum_planes(self%planes, self%speed * t, masses)
    masses%mass = masses%mass + self%mass
    masses%j(:, :, 0) = masses%j(:, :, 0) + self%inertia
    masses%s(:, 1) = self%speed * masses%s(:, 1)
    masses%s(:, 2) = self%speed**2 * masses%s(:, 2)
    masses%j(:, :, 1) = self%speed * masses%j(:, :, 1)
    masses%h(:, 0) = self%speed * masses%h(:, 0)
    masses%h(:, 1) = self%speed**2 * masses%h(:, 1)
  end subroutine masses_at

  subroutine matrices(self, t, m, b, c)
    class(space_frame_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    type(masses_type) :: masses
    real(dp), dimension(6, 6) :: all_m, all_b, all_c
    integer :: i

    call self%masses_at(t, masses)
    all_m = 0
    do i = 1, 3
      all_m(i, i) = masses%mass
    end do
    all_m(4:, :3) = cross_matrix(masses%s(:, 0))
    all_m(:3, 4:) = -cross_matrix(masses%s(:, 0))
    all_m(4:, 4:) = masses%j(:, :, 0)
    all_b = self%damping
    all_b(:3, 4:) = all_b(:3, 4:) - 2 * cross_matrix(masses%s(:, 1))
    all_b(4:, 4:) = all_b(4:, 4:) + masses%j(:, :, 1) - cross_matrix(masses%h(:, 0))
    all_c = self%stiffness
    all_c(:3, 4:) = all_c(:3, 4:) - cross_matrix(masses%s(:, 2))
    m = all_m(self%free, self%free)
    b = all_b(self%free, self%free)
    c = all_c(self%free, self%free)
  end subroutine matrices

  subroutine load(self, t, h)
    class(space_frame_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)
    type(masses_type) :: masses
    real(dp) :: all_h(6)

    call self%masses_at(t, masses)
    all_h = -[masses%s(:, 2), masses%h(:, 1)]
    h = all_h(self%free)
  end subroutine load

end module gestell_model_space_frame
