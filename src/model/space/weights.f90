!> The weights of a frame in space and of its moving masses, and the static forces of the supports that carry them.
!>
!> As in the plane (gestell_model_frame_weights) positions are those of the loaded machine at static rest, with S at its mean over
!> the turn; the motion feels the moment of the weights about F and that of the static forces F_j, which stay in space while the
!> frame turns under them; those that turn with it are the mounting's. With X = (S - mean S) g^T + Y, Y = mean S g^T + sum of
!> p_j F_j^T of the F_j that stay in space, and a(N) = (N_23 - N_32, N_31 - N_13, N_12 - N_21), that is a(b c^T) = b x c, the moment
!> in the frame's axes is
!>
!>     S x R^T g + sum of p_j x R^T F_j = a(X R),   d a(N) = (N^T - tr N 1) dalpha,   N = X R,
!>
!> and what is left of all static moments at rest, the foundation and the guides carry along theta's own directions.
module gestell_model_space_weights
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: solve_semidefinite
  use gestell_model_mechanism_mean_moment, only: average_masses
  use gestell_model_space_masses, only: plane_type
  use gestell_model_space_mounting, only: load_matrix, space_support_type, support_matrix
  use gestell_model_space_rotation, only: cross, cross_matrix, outer
  implicit none (type, external)
  private

  public :: new_space_weights

  type, public :: space_weights_type
    !> Without, nothing weighs anything.
    logical :: act = .false.
    !> g (m/s^2), the mean of S over the turn (kg m), Y (N m).
    real(dp) :: gravity(3) = 0, mean(3) = 0, rest(3, 3) = 0
    !> The static moment that foundation and guides carry (N m).
    real(dp) :: carried(3) = 0
    !> Weight and its moment about F (N, N m), the displacement by it from where no support carries anything, of (u, theta).
    real(dp) :: load(6) = 0, sag(6) = 0
    !> What weights and static forces add to C_0 about rest, the masses at their mean, and to what the ground feels.
    real(dp) :: stiffness(6, 6) = 0
  contains
    procedure :: moment
    procedure :: moment_stiffness
    procedure :: add_stiffness, add_load
    procedure :: static_force
  end type space_weights_type

contains

  !> Weights by `gravity` (m/s^2) of a frame of `mass` (kg) with mechanisms in `planes` on a mounting with this `stiffness`, among
  !> it that of `supports`, whose static forces are set; `free`: those of (u, theta) that are. `left`: along which one no spring
  !> carries the weights, 0: there is none.
  subroutine new_space_weights(weights, gravity, mass, planes, stiffness, supports, free, left)
    type(space_weights_type), intent(out) :: weights
    real(dp), intent(in) :: gravity(3), mass, stiffness(6, 6)
    type(plane_type), intent(in) :: planes(:)
    type(space_support_type), intent(inout) :: supports(:)
    integer, intent(in) :: free(:)
    integer, intent(out) :: left
    real(dp) :: whole, size_of_mean, sizes(6), moved(size(free))
    integer :: j

    left = 0
    do j = 1, size(supports)
      supports(j)%static = 0
    end do
    weights%act = any(abs(gravity) > 0)
    if (.not. weights%act) return
    weights%gravity = gravity
    call find_mean(planes, weights%mean, whole, size_of_mean)
    whole = whole + mass
    weights%load = [whole * gravity, cross(weights%mean, gravity)]
    sizes(:3) = whole * norm2(gravity)
    sizes(4:) = size_of_mean * norm2(gravity)
    call solve_semidefinite(stiffness(free, free), weights%load(free), sizes(free), moved, left)
    if (left > 0) then
      left = free(left)
      return
    end if
    weights%sag(free) = moved
    weights%rest = outer(weights%mean, gravity)
    weights%carried = weights%load(4:)
    do j = 1, size(supports)
      associate (p => supports(j)%position, static => supports(j)%static)
        static = weights%static_force(support_matrix(supports(j), supports(j)%stiffness))
        weights%carried = weights%carried - cross(p, static)
        sizes(4:) = sizes(4:) + norm2(p) * norm2(static)
        if (.not. supports(j)%turning) weights%rest = weights%rest - outer(p, static)
      end associate
    end do
    call take_stiffness(weights, supports, sizes(4))
  end subroutine new_space_weights

  !> The stiffness, of which what is rounding beside its terms, of this size, is 0.
  pure subroutine take_stiffness(weights, supports, size_of_terms)
    type(space_weights_type), intent(inout) :: weights
    type(space_support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: size_of_terms
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)

    associate (c => weights%stiffness)
      c = load_matrix(supports)
      ! theta's own directions are turned by theta/2 from the frame's axes: 1/2 a(Y) x theta makes it symmetric
      c(4:, 4:) = c(4:, 4:) + turn_stiffness(weights%rest) + cross_matrix(weights%carried) / 2
      where (abs(c(4:, 4:)) <= unit * size_of_terms) c(4:, 4:) = 0
    end associate
  end subroutine take_stiffness

  !> Mean S over the turn about F, the mass of all planes, a bound on the size of S.
  subroutine find_mean(planes, mean, mass, greatest)
    type(plane_type), intent(in) :: planes(:)
    real(dp), intent(out) :: mean(3), mass, greatest
    complex(dp) :: of_plane
    real(dp) :: size_of_plane, high
    integer :: i

    mean = 0
    mass = 0
    greatest = 0
    do i = 1, size(planes)
      associate (plane => planes(i), links => planes(i)%linkage%links)
        call average_masses(plane%linkage, of_plane, size_of_plane)
        high = sum(links%mass * links%z)
        mean = mean + sum(links%mass) * plane%origin + matmul(plane%axes, [real(of_plane, dp), aimag(of_plane), high])
        mass = mass + sum(links%mass)
        greatest = greatest + sum(links%mass) * norm2(plane%origin) + size_of_plane + sum(links%mass * abs(links%z))
      end associate
    end do
  end subroutine find_mean

  !> The moment on a frame with the axes R = 1 + `turn`, along these, less a(Y) at rest, the masses' S being `s` (N m).
  pure function moment(self, turn, s)
    class(space_weights_type), intent(in) :: self
    real(dp), intent(in) :: turn(3, 3), s(3)
    real(dp) :: moment(3)

    associate (x => outer(s - self%mean, self%gravity))
      moment = axial(x + matmul(x + self%rest, turn))
    end associate
  end function moment

  !> Its decrease with dalpha, shape (3, 3) (N m).
  pure function moment_stiffness(self, rotation, s) result(c)
    class(space_weights_type), intent(in) :: self
    real(dp), intent(in) :: rotation(3, 3), s(3)
    real(dp) :: c(3, 3)

    c = turn_stiffness(matmul(outer(s - self%mean, self%gravity) + self%rest, rotation))
  end function moment_stiffness

  !> Adds what of C about rest is periodic, of moments in the frame's axes, to the rows and columns `at` of theta, 0: one that is
  !> not there; S over the angles, shape (angles, 3): tr N 1 - N^T of N = (S - mean S) g^T.
  pure subroutine add_stiffness(self, at, s, c)
    class(space_weights_type), intent(in) :: self
    integer, intent(in) :: at(3)
    real(dp), contiguous, intent(in) :: s(:, :)
    real(dp), contiguous, intent(inout) :: c(:, :, :)
    integer :: i, k

    associate (g => self%gravity, mean => self%mean)
      do k = 1, 3
        do i = 1, 3
          if (at(i) == 0 .or. at(k) == 0) cycle
          c(:, at(i), at(k)) = c(:, at(i), at(k)) - (s(:, k) - mean(k)) * g(i)
          if (i == k) c(:, at(i), at(k)) = c(:, at(i), at(k)) + matmul(s, g) - dot_product(mean, g)
        end do
      end do
    end associate
  end subroutine add_stiffness

  !> Adds the periodic moment (S - mean S) x g to the columns `at` of theta of a load over the angles.
  pure subroutine add_load(self, at, s, h)
    class(space_weights_type), intent(in) :: self
    integer, intent(in) :: at(3)
    real(dp), contiguous, intent(in) :: s(:, :)
    real(dp), contiguous, intent(inout) :: h(:, :)
    integer :: i, next, last

    do i = 1, 3
      if (at(i) == 0) cycle
      next = 1 + modulo(i, 3)
      last = 1 + modulo(i + 1, 3)
      h(:, at(i)) = h(:, at(i)) + (s(:, next) - self%mean(next)) * self%gravity(last) &
        & - (s(:, last) - self%mean(last)) * self%gravity(next)
    end do
  end subroutine add_load

  !> The static force on the ground (N) of the part of the mounting with stiffness c, shape (6, 6).
  pure function static_force(self, c) result(force)
    class(space_weights_type), intent(in) :: self
    real(dp), intent(in) :: c(6, 6)
    real(dp) :: force(3)

    force = matmul(c(:3, :), self%sag)
  end function static_force

  !> tr N 1 - N^T.
  pure function turn_stiffness(n) result(c)
    real(dp), intent(in) :: n(3, 3)
    real(dp) :: c(3, 3)
    integer :: i

    c = -transpose(n)
    do i = 1, 3
      c(i, i) = c(i, i) + n(1, 1) + n(2, 2) + n(3, 3)
    end do
  end function turn_stiffness

  !> a(N).
  pure function axial(n)
    real(dp), intent(in) :: n(3, 3)
    real(dp) :: axial(3)

    axial = [n(2, 3) - n(3, 2), n(3, 1) - n(1, 3), n(1, 2) - n(2, 1)]
  end function axial

end module gestell_model_space_weights
