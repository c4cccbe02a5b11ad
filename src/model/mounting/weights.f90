!> The weights of a frame and of its moving masses, and the static forces of the supports that carry them.
!>
!> Positions are those of the loaded machine at static rest, with the moment S = sum m r of the moving masses about F at its mean
!> over the turn. Of the weights the motion then feels their moment about F alone, with that of the static forces F_j, which stay in
!> space while the frame turns under them; those that turn with it are the mounting's. With
!>
!>     X = (S - mean S) g^T + Y,   Y = mean S g^T - sum of p_j F_j^T of the F_j that stay in space (on the ground),
!>
!> and a(N) = (N_23 - N_32, N_31 - N_13, N_12 - N_21), that is a(b c^T) = b x c, the moment in the frame's axes is
!>
!>     S x R^T g - sum of p_j x R^T F_j = a(X R),   d a(N) = (N^T - tr N 1) dalpha,   N = X R,
!>
!> and what is left of all static moments at rest, the foundation and the guides carry along theta's own directions.
!>
!> In the plane vectors are complex numbers, a x b = Im(conj(a) b), E = exp(i psi). With R = Y_11 + Y_22 + i (Y_12 - Y_21) and
!> X = conj(S - mean S) g + R the moment is Im(conj(E) X - R), its derivative with respect to psi -Re(conj(E) X), the potential
!> Im(R) psi - Re(conj(E) X).
module gestell_model_mounting_weights
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: solve_semidefinite
  use gestell_math_rotation, only: cross, cross_matrix, outer
  use gestell_math_turn, only: less_one
  use gestell_model_mounting, only: in_frame, in_space, load_matrix, support_matrix, support_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: new_weights

  !> Subject of the error that nothing carries the weights.
  character(len=*), parameter, public :: gravity_subject = "gravity"

  type, public :: weights_type
    !> Without, nothing weighs anything.
    logical :: act = .false.
    !> g (m/s^2), the weight of all masses (N), the mean of S over the turn (kg m), Y (N m).
    real(dp) :: gravity(3) = 0, weight(3) = 0, mean(3) = 0, rest(3, 3) = 0
    !> The static moment that foundation and guides carry, a bound on the rounding of static moments (N m).
    real(dp) :: carried(3) = 0, rounding = 0
    !> The displacement (u, theta) by the weights from where no support carries anything.
    real(dp) :: sag(6) = 0
    !> What weights and static forces add to the stiffness about rest, the masses at their mean, in the frame's order.
    real(dp) :: stiffness(6, 6) = 0
  contains
    procedure, private :: moment_in_plane, moment_in_space, stiffness_in_plane, stiffness_in_space
    generic :: moment => moment_in_plane, moment_in_space
    generic :: moment_stiffness => stiffness_in_plane, stiffness_in_space
    procedure :: add_stiffness, add_load
    procedure :: static_force
    procedure :: potential, torque
    procedure :: gravity_in_plane, rest_in_plane
  end type weights_type

contains

  !> Weights by `gravity` (m/s^2) of `mass` (kg) in all, whose moving part has the moment S with this `mean` and at most the size
  !> `greatest` (kg m), on a mounting with the `stiffness` c_ij, among it that of `supports`, whose static forces are set; `free`:
  !> the degrees of freedom that are. Errors: no spring carries the weights along one of them; they overflow.
  pure subroutine new_weights(weights, gravity, mass, mean, greatest, stiffness, supports, free, error)
    type(weights_type), intent(out) :: weights
    real(dp), intent(in) :: gravity(3), mass, mean(3), greatest, stiffness(:, :)
    type(support_type), intent(inout) :: supports(:)
    integer, intent(in) :: free(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(6) = [character(len=30) :: "weight along xi", "weight along eta", &
      & "weights' moment about zeta", "weight along zeta", "weights' moment about xi", "weights' moment about eta"]
    integer, parameter :: turns(3) = in_frame(4:)
    real(dp) :: load(6), sizes(6), moved(size(free))
    integer :: j, left

    do j = 1, size(supports)
      supports(j)%static = 0
    end do
    weights%act = any(abs(gravity) > 0)
    if (.not. weights%act) return
    weights%gravity = gravity
    weights%mean = mean
    weights%weight = mass * gravity
    load = [weights%weight, cross(mean, gravity)]
    sizes(:3) = mass * norm2(gravity)
    sizes(4:) = greatest * norm2(gravity)
    call solve_semidefinite(stiffness(free, free), load(in_space(free)), sizes(in_space(free)), moved, left)
    if (left > 0) then
      call fatal_error(error, "nothing carries the " // trim(names(free(left))) // ": give the frame a spring there, or a guide", &
        & impossible_mechanism, gravity_subject)
      return
    end if
    weights%sag(in_space(free)) = moved
    weights%rest = outer(mean, gravity)
    weights%carried = load(4:)
    do j = 1, size(supports)
      associate (p => supports(j)%position, static => supports(j)%static)
        static = weights%static_force(support_matrix(supports(j), supports(j)%stiffness))
        weights%carried = weights%carried - cross(p, static)
        sizes(4) = sizes(4) + norm2(p) * norm2(static)
        if (.not. supports(j)%turning) weights%rest = weights%rest - outer(p, static)
      end associate
    end do
    weights%rounding = 16 * epsilon(1.0_dp) * sizes(4)
    weights%stiffness = load_matrix(supports, 6)
    associate (c => weights%stiffness)
      ! theta's own directions are turned by theta/2 from the frame's axes: 1/2 a(Y) x theta makes it symmetric
      c(turns, turns) = c(turns, turns) + turn_stiffness(weights%rest) + cross_matrix(weights%carried) / 2
      c(turns, turns) = merge(0.0_dp, c(turns, turns), abs(c(turns, turns)) <= weights%rounding)
    end associate
    if (.not. all(ieee_is_finite([load, weights%sag, weights%rounding])) .or. .not. all(ieee_is_finite(weights%stiffness))) then
      call fatal_error(error, "the weights overflow", invalid_input, gravity_subject)
    end if
  end subroutine new_weights

  !> g and R in the plane.
  elemental complex(dp) function gravity_in_plane(self)
    class(weights_type), intent(in) :: self

    gravity_in_plane = cmplx(self%gravity(1), self%gravity(2), dp)
  end function gravity_in_plane

  elemental complex(dp) function rest_in_plane(self)
    class(weights_type), intent(in) :: self

    rest_in_plane = cmplx(self%rest(1, 1) + self%rest(2, 2), self%rest(1, 2) - self%rest(2, 1), dp)
  end function rest_in_plane

  !> The moment in the plane on a frame turned by E = `turn`, where the masses' S is `s` (N m).
  elemental real(dp) function moment_in_plane(self, turn, s) result(moment)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, s

    moment = aimag(conjg(turn * (s - cmplx(self%mean(1), self%mean(2), dp))) * self%gravity_in_plane() &
      & + conjg(less_one(turn)) * self%rest_in_plane())
  end function moment_in_plane

  !> Its decrease with psi (N m).
  elemental real(dp) function stiffness_in_plane(self, turn, s) result(c)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, s

    c = real(conjg(turn) * (conjg(s - cmplx(self%mean(1), self%mean(2), dp)) * self%gravity_in_plane() &
      & + self%rest_in_plane()), dp)
  end function stiffness_in_plane

  !> The potential in the plane of weights and static forces (J), psi being the angle of `turn`.
  elemental real(dp) function potential(self, turn, psi, s)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, s
    real(dp), intent(in) :: psi

    potential = aimag(self%rest_in_plane()) * psi - self%stiffness_in_plane(turn, s)
  end function potential

  !> The torque on the crank in the plane (N m) that lifts the links, whose S changes with the crank angle by `s_d`.
  elemental real(dp) function torque(self, turn, s_d)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, s_d

    torque = -real(conjg(turn * s_d) * self%gravity_in_plane(), dp)
  end function torque

  !> The moment on a frame in space with the axes R = 1 + `turn`, along these, less a(Y) at rest, the masses' S being `s` (N m).
  pure function moment_in_space(self, turn, s) result(moment)
    class(weights_type), intent(in) :: self
    real(dp), intent(in) :: turn(3, 3), s(3)
    real(dp) :: moment(3)

    associate (x => outer(s - self%mean, self%gravity))
      associate (n => x + matmul(x + self%rest, turn))
        moment = [n(2, 3) - n(3, 2), n(3, 1) - n(1, 3), n(1, 2) - n(2, 1)]
      end associate
    end associate
  end function moment_in_space

  !> Its decrease with dalpha, shape (3, 3) (N m).
  pure function stiffness_in_space(self, rotation, s) result(c)
    class(weights_type), intent(in) :: self
    real(dp), intent(in) :: rotation(3, 3), s(3)
    real(dp) :: c(3, 3)

    c = turn_stiffness(matmul(outer(s - self%mean, self%gravity) + self%rest, rotation))
  end function stiffness_in_space

  !> Adds what of C about rest is periodic, of moments in the frame's axes, to the rows and columns `at` of theta, 0: one that is
  !> not there; S over the angles, shape (angles, 3): tr N 1 - N^T of N = (S - mean S) g^T.
  pure subroutine add_stiffness(self, at, s, c)
    class(weights_type), intent(in) :: self
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
    class(weights_type), intent(in) :: self
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

  !> The static force on the ground (N) of the part of the mounting with the stiffness c of (u, theta), shape (6, 6).
  pure function static_force(self, c) result(force)
    class(weights_type), intent(in) :: self
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

end module gestell_model_mounting_weights
