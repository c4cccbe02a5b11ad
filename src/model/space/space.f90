!> A frame in space: a rigid body with the moving masses of planar mechanisms, on springs and dampers; (45) to (48) of
!> doc/theory.md. This module contains the data and equations that a frame in the plane does not require.
!>
!> The centre of mass F of the frame moves by u = (xi, eta, zeta). The rotation R has the rotation vector theta = (rot_xi, rot_eta,
!> psi) (gestell_math_rotation) and the angular velocity w along the frame's axes. S, J, H are sums over the masses
!> (gestell_model_space_masses); m and J include the frame; ' = d/dt. The balances of momentum along the fixed axes xi, eta, zeta
!> and of angular momentum along the frame's axes give, for any rotation,
!>
!>     m u'' + R g                                          = sum of F_j,   g = S'' + 2 w x S' + w' x S + w x (w x S)
!>     J w' + J' w + w x (J w) + H' + w x H + S x (R^T u'') = sum of p_j x R^T F_j
!>
!> and, linearised about rest, with theta small,
!>
!>     M = |  m 1   -[S] |   B = B_0 + | 0   -2 [S']    |   C = C_0 + | 0   -[S''] |   h = -(S'', H').
!>         | [S]     J   |             | 0    J' - [H]  |             | 0    0     |
!>
!> The terms of the weights are added (gestell_model_mounting_weights). If only psi is free to rotate and S = (a1, a2) about F,
!> these equations are (8) to (12).
module gestell_model_space
  use gestell_base_kinds, only: dp, pi
  use gestell_math_rotation, only: cross_matrix, identity
  use gestell_math_vectors, only: batch, blocks_type, cross_matrix, element, steady
  use gestell_model_mechanism_held, only: sum_or_zero
  use gestell_model_mechanism_mean_moment, only: average_masses
  use gestell_model_mounting, only: in_frame, in_space, is_rotation
  use gestell_model_mounting_mounted, only: mounted_system
  use gestell_model_space_drive, only: add_drive, drive_type, find_torque, follow_frame, moved_type
  use gestell_model_space_masses, only: along_fixed_axes, fixed_masses_type, masses_type, plane_type, sum_planes
  use gestell_model_space_loads, only: add_loads, count_loads, find_loads, space_load_type
  implicit none (type, external)
  private

  public :: in_frame, in_space, is_rotation

  !> Table of the sums over the masses, for angles of the drive (rad) at which they are required repeatedly.
  type :: table_type
    real(dp), allocatable :: angles(:)
    type(masses_type) :: masses
  end type table_type

  !> Rotation vectors of a frame at rest, with their first and second derivatives.
  real(dp), parameter :: upright(batch, 3, 0:2) = 0

  !> The mechanisms of a frame in space, each in its own plane, and their drive.
  type, public :: space_type
    !> `inertia`: inertia tensor of the frame about its centre of mass F (kg m^2). `origin`: origin O of the mechanisms relative
    !> to F (m).
    real(dp) :: inertia(3, 3) = 0, origin(3) = 0
    type(plane_type), allocatable :: planes(:)
    type(drive_type) :: drive
    !> Mean torque of a flywheel's motor that replaces the power of loads (forces and moments between links, frame and ground) on a
    !> frame at rest (N m).
    real(dp) :: motor_torque = 0
    type(table_type), allocatable, private :: tables(:)
  contains
    procedure :: average, remember, masses_at, sample_at_rest, loads_at_rest, shake, terms, cancellation
  end type space_type

contains

  !> Computes averages over the turn. `mean`: mean of the first moment of the moving masses about the frame's centre of mass (kg
  !> m). `mass`: mass of all planes (kg). `maximum`: bound on the magnitude of the first moment (kg m).
  subroutine average(self, mean, mass, maximum)
    class(space_type), intent(in) :: self
    real(dp), intent(out) :: mean(3), mass, maximum
    complex(dp) :: of_plane
    real(dp) :: size_of_plane
    integer :: i

    mean = 0
    mass = 0
    maximum = 0
    do i = 1, size(self%planes)
      associate (plane => self%planes(i), links => self%planes(i)%linkage%links)
        call average_masses(plane%linkage, of_plane, size_of_plane)
        mean = mean + sum(links%mass) * plane%origin &
          & + matmul(plane%axes, [real(of_plane), aimag(of_plane), sum(links%mass * links%z)])
        mass = mass + sum(links%mass)
        maximum = maximum + sum(links%mass) * norm2(plane%origin) + size_of_plane + sum(links%mass * abs(links%z))
      end associate
    end do
  end subroutine average

  !> Tabulates the sums over the masses at `angles` (rad). Later evaluations at exactly these angles use the table. Before these
  !> evaluations the magnitude of the speed, the frame's mass and inertia, and the mounting may change, but not the sign of the
  !> speed.
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
    call sum_planes(self%planes, angles, longer(count + 1)%masses, self%drive%uniform_in_space())
    call move_alloc(longer, self%tables)
  end subroutine remember

  !> Computes mass, first moment S, inertia tensor J and angular momentum H of the frame with all moving masses, about the frame's
  !> centre of mass, and their derivatives with respect to the angle of the drive.
  pure subroutine masses_at(self, mass, angles, masses)
    class(space_type), intent(in) :: self
    !> `mass`: mass of the frame (kg). `angles`: angles of the drive (rad)
    real(dp), intent(in) :: mass
    real(dp), contiguous, intent(in) :: angles(:)
    type(masses_type), intent(out) :: masses
    logical :: known
    integer :: i, k

    known = .false.
    if (allocated(self%tables)) then
      ! the planes' sums from the table with exactly these angles in this order
      do i = 1, size(self%tables)
        if (size(self%tables(i)%angles) /= size(angles)) cycle
        known = all(abs(self%tables(i)%angles - angles) <= 0)
        if (known) exit
      end do
      if (known) masses = self%tables(i)%masses
    end if
    if (.not. known) call sum_planes(self%planes, angles, masses, self%drive%uniform_in_space())
    masses%mass = masses%mass + mass
    do k = 1, 3
      do i = 1, 3
        masses%j(:, i, k, 0) = masses%j(:, i, k, 0) + self%inertia(i, k)
      end do
    end do
  end subroutine masses_at

  !> Computes the matrices M, B, C, shape (angles, size(free), size(free)), and the load h, shape (angles, size(free)), of a frame
  !> in space, linearised about rest. `angles`: angles of the drive (rad). `free`: degrees of freedom.
  pure subroutine sample_at_rest(self, frame, angles, free, m, b, c, h)
    class(space_type), intent(in) :: self
    class(mounted_system), intent(in) :: frame
    !> Angles of the drive (rad)
    real(dp), contiguous, intent(in) :: angles(:)
    integer, intent(in) :: free(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    type(masses_type) :: masses
    real(dp) :: r(6), all_c(6, 6)
    integer :: at(size(free)), place(6), i, k

    call self%masses_at(frame%mass, angles, masses)
    at = in_space(free)
    place = 0
    place(at) = [(i, i = 1, size(at))]
    do k = 1, size(at)
      do i = 1, size(at)
        m(:, i, k) = 0
        b(:, i, k) = frame%damping(free(i), free(k))
        c(:, i, k) = frame%stiffness(free(i), free(k)) + frame%weights%stiffness(free(i), free(k))
      end do
      if (at(k) <= 3) m(:, k, k) = masses%mass
    end do
    associate (u => place(:3), theta => place(4:), s => masses%s, j => masses%j, h => masses%h, speed => frame%speed)
      call add_cross(m, -1.0_dp, s(:, :, 0), u, theta)
      call add_cross(m, 1.0_dp, s(:, :, 0), theta, u)
      call add_block(m, 1.0_dp, j(:, :, :, 0), theta)
      call add_cross(b, -2 * speed, s(:, :, 1), u, theta)
      call add_block(b, speed, j(:, :, :, 1), theta)
      call add_cross(b, -speed, h(:, :, 0), theta, theta)
      call add_cross(c, -speed**2, s(:, :, 2), u, theta)
    end associate
    if (frame%weights%act) call frame%weights%add_stiffness(place(4:), masses%s(:, :, 0), c)
    if (present(h)) then
      do i = 1, size(at)
        if (at(i) <= 3) h(:, i) = -frame%speed**2 * masses%s(:, at(i), 2)
        if (at(i) > 3) h(:, i) = -frame%speed**2 * masses%h(:, at(i) - 3, 1)
      end do
      if (frame%weights%act) call frame%weights%add_load(place(4:), masses%s(:, :, 0), h)
    end if
    if (self%drive%uniform_in_space()) call add_drive_at_rest(self, frame, masses, at, m, b, c, h)
    if (count_loads(self%planes) > 0) then
      do k = 1, size(angles)
        call self%loads_at_rest(frame%speed, angles(k), r, all_c)
        c(k, :, :) = c(k, :, :) + all_c(at, at)
        if (present(h)) h(k, :) = h(k, :) - r(at)
      end do
    end if
  end subroutine sample_at_rest

  !> Effect of the loads, at an angle of the drive (rad), on the left sides r of the frame at rest, and on their derivatives c with
  !> respect to displacements and rotations, in the order (u, theta). `speed`: speed of the drive (rad/s).
  pure subroutine loads_at_rest(self, speed, angle, r, c)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: speed, angle
    real(dp), intent(out) :: r(6), c(6, 6)
    type(space_load_type) :: loads(count_loads(self%planes))
    type(moved_type) :: moved

    call follow_frame(self%drive, speed, upright(:, :, 0), upright, moved)
    call find_loads(self%planes, angle, loads)
    r = 0
    c = 0
    call add_loads(loads, moved%b(1, :), moved%bend(1, :, :), identity(), r, c)
    ! change of the moments along the frame's axes
    c(4:, 4:) = c(4:, 4:) + cross_matrix(r(4:))
    r(4:) = r(4:) + self%motor_torque * self%drive%axis
  end subroutine loads_at_rest

  !> Adds the effect of a drive that turns uniformly relative to the ground to the matrices M, B, C and the load h.
  pure subroutine add_drive_at_rest(self, frame, masses, at, m, b, c, h)
    class(space_type), intent(in) :: self
    class(mounted_system), intent(in) :: frame
    type(masses_type), intent(in) :: masses
    integer, intent(in) :: at(:)
    real(dp), intent(inout) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), intent(inout), optional :: h(:, :)
    type(moved_type) :: moved
    type(fixed_masses_type) :: fixed
    type(blocks_type), parameter :: zero = blocks_type(0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp)
    type(blocks_type) :: of_a, of_v, of_q
    real(dp) :: moments(batch, 3)
    integer :: first, last, i

    call follow_frame(self%drive, frame%speed, steady(-frame%weights%gravity), upright, moved)
    do first = 1, size(m, 1), batch
      last = min(first + batch - 1, size(m, 1))
      call along_fixed_axes(masses, first, moved%rotation, fixed)
      moments = 0
      of_a = zero
      of_v = zero
      of_q = zero
      of_v%aa = -cross_matrix(moved%spin)
      call add_drive(moved, fixed, moments, of_a, of_v, of_q)
      ! change of the moments along the frame's axes
      of_q%aa = of_q%aa + cross_matrix(moments)
      call add_blocks(of_a, m(first:last, :, :))
      call add_blocks(of_v, b(first:last, :, :))
      call add_blocks(of_q, c(first:last, :, :))
      if (.not. present(h)) cycle
      do i = 1, size(at)
        if (at(i) > 3) h(first:last, i) = sum_or_zero(h(first:last, i), -moments(:last - first + 1, at(i) - 3))
      end do
    end do

  contains

    pure subroutine add_blocks(blocks, matrices)
      type(blocks_type), intent(in) :: blocks
      real(dp), intent(inout) :: matrices(:, :, :)
      real(dp) :: added(batch)
      integer :: i, k

      do k = 1, size(at)
        do i = 1, size(at)
          added = element(blocks, at(i), at(k))
          matrices(:, i, k) = sum_or_zero(matrices(:, i, k), added(:size(matrices, 1)))
        end do
      end do
    end subroutine add_blocks

  end subroutine add_drive_at_rest

  !> Computes the shaking forces (N), and their moments about the frame's centre of mass (N m), on the frame at rest without
  !> gravity, at angles of the drive; shape (angles, 6), in the order (u, theta). `speed`: speed of the drive (rad/s).
  pure subroutine shake(self, speed, angles, loads)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: speed
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), intent(out) :: loads(:, :)
    type(masses_type) :: masses
    type(fixed_masses_type) :: fixed
    type(moved_type) :: moved
    real(dp) :: torque(batch)
    real(dp), dimension(batch, 3) :: by_gain, by_spin, by_turn
    integer :: first, last, i

    call self%masses_at(0.0_dp, angles, masses)
    loads(:, :3) = -speed**2 * masses%s(:, :, 2)
    loads(:, 4:) = -speed**2 * masses%h(:, :, 1)
    if (.not. self%drive%uniform_in_space()) return
    call follow_frame(self%drive, speed, upright(:, :, 0), upright, moved)
    do first = 1, size(angles), batch
      last = min(first + batch - 1, size(angles))
      call along_fixed_axes(masses, first, moved%rotation, fixed)
      call find_torque(moved, fixed, torque, by_gain, by_spin, by_turn)
      do i = 1, 3
        loads(first:last, 3 + i) = sum_or_zero(loads(first:last, 3 + i), torque(:last - first + 1) * moved%b(:last - first + 1, i))
      end do
    end do
  end subroutine shake

  !> Sums of the absolute values of the terms of the mechanisms' forces (kg m) and moments (kg m^2) at unit speed. They bound the
  !> rounding errors where the terms cancel.
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

  !> Measures how strongly the terms of the load cancel (dimensionless): the largest sum of their absolute values, divided by the
  !> largest load for the degrees of freedom `free`, minus 1. The value 0 means that nothing cancels. To make forces and moments
  !> comparable, forces are divided by the square root of the machine's mass, moments by the square root of its moment of inertia.
  !> `mass`: mass of the frame (kg). `speed`: speed of the drive (rad/s) at which loads are added to the inertia forces.
  pure real(dp) function cancellation(self, mass, speed, free)
    class(space_type), intent(in) :: self
    real(dp), intent(in) :: mass, speed
    integer, intent(in) :: free(:)
    integer, parameter :: angles = 16
    type(masses_type) :: all
    real(dp) :: maximum, weights(6), turn(angles), loads(angles, 6), r(6), c(6, 6)
    integer :: i, k, at(size(free))

    at = in_space(free)
    maximum = 0
    turn = [(2 * pi * k / angles, k = 1, angles)]
    call self%masses_at(mass, turn, all)
    call self%shake(1.0_dp, turn, loads)
    do k = 1, merge(angles, 0, count_loads(self%planes) > 0)
      call self%loads_at_rest(speed, turn(k), r, c)
      loads(k, :) = loads(k, :) - r / speed**2
    end do
    weights(:3) = 1 / sqrt(max(tiny(1.0_dp), all%mass))
    do k = 1, angles
      weights(4:) = 1 / sqrt(max(tiny(1.0_dp), [(all%j(k, i, i, 0), i = 1, 3)]))
      maximum = max(maximum, maxval(abs(loads(k, at)) * weights(at)))
    end do
    cancellation = 0
    if (.not. maximum > 0) return
    associate (terms => [maxval(weights(:3)), maxval(weights(4:))] * self%terms())
      cancellation = max(0.0_dp, maxval(terms) / maximum - 1)
    end associate
  end function cancellation

  !> Adds to the matrices, at each angle, `factor` times the cross product matrix of the vector a; `a` has the shape (angles, 3).
  !> A 0 in `rows` or `columns` means that the matrices do not contain this row or column.
  pure subroutine add_cross(matrices, factor, a, rows, columns)
    real(dp), contiguous, intent(inout) :: matrices(:, :, :)
    real(dp), intent(in) :: factor
    real(dp), contiguous, intent(in) :: a(:, :)
    integer, intent(in) :: rows(3), columns(3)
    integer :: i, next, last

    do i = 1, 3
      next = 1 + modulo(i, 3)
      last = 1 + modulo(i + 1, 3)
      if (rows(last) > 0 .and. columns(next) > 0) matrices(:, rows(last), columns(next)) = matrices(:, rows(last), columns(next)) &
        & + factor * a(:, i)
      if (rows(next) > 0 .and. columns(last) > 0) matrices(:, rows(next), columns(last)) = matrices(:, rows(next), columns(last)) &
        & - factor * a(:, i)
    end do
  end subroutine add_cross

  !> Adds `factor` times the 3 x 3 blocks `a`, shape (angles, 3, 3), to the rows and columns `at` of the matrices. A 0 in `at` means
  !> that the matrices do not contain this row and column.
  pure subroutine add_block(matrices, factor, a, at)
    real(dp), contiguous, intent(inout) :: matrices(:, :, :)
    real(dp), intent(in) :: factor
    real(dp), contiguous, intent(in) :: a(:, :, :)
    integer, intent(in) :: at(3)
    integer :: i, k

    do k = 1, 3
      do i = 1, 3
        if (at(i) > 0 .and. at(k) > 0) matrices(:, at(i), at(k)) = matrices(:, at(i), at(k)) &
          & + factor * a(:, i, k)
      end do
    end do
  end subroutine add_block

end module gestell_model_space
