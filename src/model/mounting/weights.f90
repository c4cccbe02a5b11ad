!> The weights of a frame and of its moving masses, and the static forces of the supports that carry them.
!>
!> Positions are those of the loaded machine at static rest. There the first moment S = sum m r of the moving masses about F equals
!> its mean over the turn. Only two moments affect the motion: the moment of the weights about F, and the moment of the static
!> forces F_j of the supports on the ground. If the axes of a support have fixed directions, so has its force while the frame
!> rotates. For forces that turn with the frame see gestell_model_mounting.
!>
!> For a matrix N let a(N) = (N_23 - N_32, N_31 - N_13, N_12 - N_21), so that a(b c^T) = b x c. With
!>
!>     X = (S - mean S) g^T + Y,   Y = mean S g^T - sum of p_j F_j^T over the F_j with fixed directions,
!>
!> the moment along the frame's axes, (49) of doc/theory.md, and its change for a small rotation dalpha are
!>
!>     S x R^T g - sum of p_j x R^T F_j = a(X R),   d a(N) = (N^T - tr N 1) dalpha,   N = X R.
!>
!> Foundation and guides carry the remaining static moment at rest, along the directions of theta.
!>
!> In the plane vectors are complex numbers, a x b = Im(conj(a) b), E = exp(i psi). For a frame in the plane R is not the rotation
!> matrix but the number Y_11 + Y_22 + i (Y_12 - Y_21). With X = conj(S - mean S) g + R, (28) of doc/theory.md gives
!>
!>     moment = Im(conj(E) X - R),   its derivative with respect to psi = -Re(conj(E) X),   potential = Im(R) psi - Re(conj(E) X).
module gestell_model_mounting_weights
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: solve_semidefinite
  use gestell_math_rotation, only: cross, cross_matrix, outer
  use gestell_math_vectors, only: batch, cross, cross_matrix, outer, steady, times, transposed, unit_matrix
  use gestell_math_turn, only: less_one
  use gestell_model_mounting, only: in_frame, in_space, load_matrix, support_matrix, support_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: new_weights

  !> Name of the input key to which error messages about weights refer.
  character(len=*), parameter, public :: gravity_subject = "gravity"

  !> Weights (gravity forces) of all masses, and the static equilibrium of the machine under them.
  type, public :: weights_type
    !> True if gravity acts on the masses.
    logical :: act = .false.
    !> `gravity`: acceleration of gravity g (m/s^2). `weight`: weight of all masses (N). `mean`: mean over the turn of the first
    !> moment S of the moving masses (kg m). `rest`: the matrix Y in the header of this module (N m).
    real(dp) :: gravity(3) = 0, weight(3) = 0, mean(3) = 0, rest(3, 3) = 0
    !> `carried`: static moment that foundation and guides carry (N m). `rounding`: bound on the rounding errors of static moments
    !> (N m).
    real(dp) :: carried(3) = 0, rounding = 0
    !> Displacement (u, theta) that the weights cause, measured from the position with unloaded springs (m, rad).
    real(dp) :: sag(6) = 0
    !> Mean stiffness that weights and static forces contribute when the frame is at rest, in the frame's order of degrees of
    !> freedom.
    real(dp) :: stiffness(6, 6) = 0
  contains
    procedure :: moment => moment_in_plane, moment_stiffness => stiffness_in_plane
    procedure :: add_moment, add_stiffness, add_load, potential, torque, gravity_in_plane, rest_in_plane
  end type weights_type

contains

  !> Computes the static equilibrium of the machine under its weight and sets the static forces of the supports. Fails if no spring
  !> carries the weight along some free degree of freedom, or if the weight overflows.
  pure subroutine new_weights(weights, gravity, mass, mean, maximum, stiffness, supports, free, error)
    type(weights_type), intent(out) :: weights
    !> `gravity`: acceleration of gravity (m/s^2). `mass`: mass of the whole machine (kg). `mean`: mean over the turn of the first
    !> moment of the moving masses (kg m). `maximum`: bound on the magnitude of this moment (kg m). `stiffness`: stiffness matrix
    !> of the whole mounting, shape (dofs, dofs)
    real(dp), intent(in) :: gravity(3), mass, mean(3), maximum, stiffness(:, :)
    !> Supports; the procedure sets their static forces
    type(support_type), intent(inout) :: supports(:)
    !> Indices of the free degrees of freedom
    integer, intent(in) :: free(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(6) = [character(len=32) :: "weight along xi", "weight along eta", &
      & "moment of the weight about zeta", "weight along zeta", "moment of the weight about xi", "moment of the weight about eta"]
    integer, parameter :: turns(3) = in_frame(4:)
    real(dp) :: load(6), sizes(6), moved(size(free))
    integer :: j, unsupported

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
    sizes(4:) = maximum * norm2(gravity)
    call solve_semidefinite(stiffness(free, free), load(in_space(free)), sizes(in_space(free)), moved, unsupported)
    if (unsupported > 0) then
      call fatal_error(error, "no spring carries the " // trim(names(free(unsupported))) // &
        & ": add a spring in this direction, or lock this degree of freedom", impossible_mechanism, gravity_subject)
      return
    end if
    weights%sag(in_space(free)) = moved
    weights%rest = outer(mean, gravity)
    weights%carried = load(4:)
    do j = 1, size(supports)
      associate (p => supports(j)%position, static => supports(j)%static, c => support_matrix(supports(j), supports(j)%stiffness))
        static = matmul(c(:3, :), weights%sag)
        weights%carried = weights%carried - cross(p, static)
        sizes(4) = sizes(4) + norm2(p) * norm2(static)
        if (.not. supports(j)%turning) weights%rest = weights%rest - outer(p, static)
      end associate
    end do
    weights%rounding = 16 * epsilon(1.0_dp) * sizes(4)
    weights%stiffness = load_matrix(supports, 6)
    associate (c => weights%stiffness)
      ! the directions of theta are rotated by theta/2 from the frame's axes: 1/2 a(Y) x theta makes the stiffness symmetric
      c(turns, turns) = c(turns, turns) + turn_stiffness(weights%rest) + cross_matrix(weights%carried) / 2
      c(turns, turns) = merge(0.0_dp, c(turns, turns), abs(c(turns, turns)) <= weights%rounding)
    end associate
    if (.not. all(ieee_is_finite([load, weights%sag, weights%rounding])) .or. .not. all(ieee_is_finite(weights%stiffness))) then
      call fatal_error(error, "the moments of the weights overflow double precision", invalid_input, gravity_subject)
    end if
  end subroutine new_weights

  !> Acceleration of gravity g in the plane as a complex number (m/s^2).
  elemental complex(dp) function gravity_in_plane(self)
    class(weights_type), intent(in) :: self

    gravity_in_plane = cmplx(self%gravity(1), self%gravity(2), dp)
  end function gravity_in_plane

  !> R in the plane (N m).
  elemental complex(dp) function rest_in_plane(self)
    class(weights_type), intent(in) :: self

    rest_in_plane = cmplx(self%rest(1, 1) + self%rest(2, 2), self%rest(1, 2) - self%rest(2, 1), dp)
  end function rest_in_plane

  !> Moment (N m) of gravity and the static forces on a frame in the plane that is rotated by psi. `turn`: exp(i psi). `s`: first
  !> moment S of the masses (kg m).
  elemental real(dp) function moment_in_plane(self, turn, s) result(moment)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, s

    moment = aimag(conjg(turn * (s - cmplx(self%mean(1), self%mean(2), dp))) * self%gravity_in_plane() &
      & + conjg(less_one(turn)) * self%rest_in_plane())
  end function moment_in_plane

  !> Derivative of `moment_in_plane` with respect to psi, with reversed sign (N m).
  elemental real(dp) function stiffness_in_plane(self, turn, s) result(c)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, s

    c = real(conjg(turn) * (conjg(s - cmplx(self%mean(1), self%mean(2), dp)) * self%gravity_in_plane() + self%rest_in_plane()), dp)
  end function stiffness_in_plane

  !> Potential energy (J) of gravity and the static forces of a frame in the plane. `psi`: rotation of the frame. `turn`: E = exp(i
  !> psi).
  elemental real(dp) function potential(self, turn, psi, s)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, s
    real(dp), intent(in) :: psi

    potential = aimag(self%rest_in_plane()) * psi - self%moment_stiffness(turn, s)
  end function potential

  !> Torque on the crank of a frame in the plane (N m) that lifts the links against gravity. `s_d`: derivative of the links' first
  !> moment S with respect to the crank angle.
  elemental real(dp) function torque(self, turn, s_d)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, s_d

    torque = -real(conjg(turn * s_d) * self%gravity_in_plane(), dp)
  end function torque

  !> Subtracts the moment of gravity and the static forces on a frame in space, minus the moment at rest, from the left sides
  !> `moments` along the fixed axes, at a batch of phases. Adds the derivatives of the left sides with respect to small rotations
  !> dalpha about the fixed axes to c. With N = R X, whose change is d a(N) = (N - tr N 1) dalpha, the moment is
  !>
  !>     a(N) - R a(Y) = R (S - mean S) x g - a(R Y (R - 1)^T).
  pure subroutine add_moment(self, rotation, less_one, s, moments, c)
    class(weights_type), intent(in) :: self
    !> Rotation matrices R, and R - 1; first moment S of the masses along the fixed axes (kg m)
    real(dp), intent(in) :: rotation(batch, 3, 3), less_one(batch, 3, 3), s(batch, 3)
    real(dp), intent(inout) :: moments(batch, 3), c(batch, 3, 3)
    real(dp), dimension(batch, 3) :: g, shifted
    real(dp), dimension(batch, 3, 3) :: turned, n

    g = steady(self%gravity)
    shifted = s - times(rotation, steady(self%mean))
    turned = times(rotation, steady(self%rest))
    n = times(turned, transposed(less_one))
    moments = moments - cross(shifted, g) + antisymmetric_part(n)
    n = turned + outer(shifted, g)
    c = c + unit_matrix(n(:, 1, 1) + n(:, 2, 2) + n(:, 3, 3)) - n &
      & - cross_matrix(times(rotation, antisymmetric_part(steady(self%rest))))
  end subroutine add_moment

  !> The vector a(N).
  pure function antisymmetric_part(n) result(a)
    real(dp), intent(in) :: n(batch, 3, 3)
    real(dp) :: a(batch, 3)

    a(:, 1) = n(:, 2, 3) - n(:, 3, 2)
    a(:, 2) = n(:, 3, 1) - n(:, 1, 3)
    a(:, 3) = n(:, 1, 2) - n(:, 2, 1)
  end function antisymmetric_part

  !> Adds to the stiffness matrix C the periodic part that is due to the weights when the frame is at rest, for moments along the
  !> frame's axes. It is the matrix tr N 1 - N^T with N = (S - mean S) g^T, where S is the first moment of the moving masses.
  pure subroutine add_stiffness(self, at, s, c)
    class(weights_type), intent(in) :: self
    !> Rows and columns of `c` that belong to theta; 0 for a component that `c` does not contain
    integer, intent(in) :: at(3)
    !> First moment S of the masses at the crank angles (kg m), shape (angles, 3)
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

  !> Adds to the load h the periodic moment (S - mean S) x g of gravity on the moving masses, where S is their first moment.
  pure subroutine add_load(self, at, s, h)
    class(weights_type), intent(in) :: self
    !> Columns of `h` that belong to theta; 0 for a component that `h` does not contain
    integer, intent(in) :: at(3)
    !> First moment S of the masses at the crank angles (kg m), shape (angles, 3)
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

  !> Matrix tr N 1 - N^T.
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
