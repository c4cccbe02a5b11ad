!> The weights of the frame and of the moving masses, and the static forces of the supports that carry them.
!>
!> Positions are those of the loaded machine at static rest, with the moment S = sum m r of the moving masses at its mean over the
!> turn. Of the weights the motion then feels their moment about F alone, with that of the static forces F_j, which stay in space
!> while the frame turns under them; those that turn with it are the mounting's (gestell_model_exact_moved_mounting). Vectors of the
!> plane are complex numbers, a x b = Im(conj(a) b), E = exp(i psi), and with
!>
!>     X = conj(S - mean S) g + R,   R = conj(mean S) g + sum of conj(p_j) F_j    of the F_j that stay in space
!>
!> the moment is Im(conj(E) X - R), its derivative with respect to psi -Re(conj(E) X), the potential Im(R) psi - Re(conj(E) X).
module gestell_model_frame_weights
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: solve_semidefinite
  use gestell_model_mechanism, only: a1_d, a1_v, a2_d, a2_v, mechanism_type
  use gestell_model_mechanism_mean_moment, only: average_masses
  use gestell_model_frame_mounting, only: stiffness_matrix, support_type
  use gestell_math_turn, only: less_one
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: new_weights

  !> Subject of the error that nothing carries the weights.
  character(len=*), parameter, public :: gravity_subject = "gravity"

  type, public :: weights_type
    !> Without, nothing weighs anything.
    logical :: act = .false.
    !> g (m/s^2), the mean over the turn of a1 + i a2 (kg m), R (N m), a bound on its rounding.
    complex(dp) :: gravity = 0, mean = 0, rest = 0
    real(dp) :: rounding = 0
    !> Weight and its moment about F (N, N, N m); the frame's displacement by it from where no support carries anything.
    real(dp) :: load(3) = 0, sag(3) = 0
  contains
    procedure :: add
    procedure :: moment
    procedure :: stiffness
    procedure :: potential
    procedure :: torque
    procedure :: static_forces
  end type weights_type

contains

  !> Weights by `gravity` (m/s^2) of a frame of `mass` (kg) with its `mechanism`, whose pivot is at `origin` (m), on a mounting with
  !> the `stiffness` c_ij, among it that of `supports`, whose static forces are set; `free`: indices of the free ones of xi, eta,
  !> psi. Errors: no spring carries the weights along one of them; they overflow.
  subroutine new_weights(weights, gravity, mechanism, mass, origin, stiffness, supports, free, error)
    type(weights_type), intent(out) :: weights
    real(dp), intent(in) :: gravity(2), mass, origin(2), stiffness(3, 3)
    class(mechanism_type), intent(in) :: mechanism
    type(support_type), intent(inout) :: supports(:)
    integer, intent(in) :: free(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: greatest, sizes(3)
    complex(dp) :: first_moment
    integer :: j

    weights%act = any(abs(gravity) > 0)
    if (.not. weights%act) return
    weights%gravity = cmplx(gravity(1), gravity(2), dp)
    call average_masses(mechanism, weights%mean, greatest)
    first_moment = mechanism%mass * cmplx(origin(1), origin(2), dp) + weights%mean
    weights%rest = conjg(first_moment) * weights%gravity
    weights%load = [(mass + mechanism%mass) * gravity, aimag(weights%rest)]
    sizes(:2) = (mass + mechanism%mass) * norm2(gravity)
    sizes(3) = (mechanism%mass * norm2(origin) + greatest) * norm2(gravity)
    call find_sag(stiffness, free, weights%load, sizes, weights%sag, error)
    if (allocated(error)) return
    weights%rounding = sizes(3)
    do j = 1, size(supports)
      associate (p => supports(j)%position, static => supports(j)%static)
        static = weights%static_forces(stiffness_matrix([supports(j)]))
        if (supports(j)%turning) cycle
        weights%rest = weights%rest - cmplx(p(1), -p(2), dp) * cmplx(static(1), static(2), dp)
        weights%rounding = weights%rounding + norm2(p) * norm2(static)
      end associate
    end do
    weights%rounding = 16 * epsilon(1.0_dp) * weights%rounding
    if (.not. all(ieee_is_finite([weights%load, weights%sag, weights%rounding, abs(weights%rest)]))) call fatal_error(error, &
      & "the weights overflow", invalid_input, gravity_subject)
  end subroutine new_weights

  !> Where the mounting with the stiffness c carries a load of the `free` degrees of freedom; what no spring holds stays 0.
  !> `sizes`: of the terms that the load sums. Error: a load along it is left.
  pure subroutine find_sag(c, free, load, sizes, q, error)
    real(dp), intent(in) :: c(3, 3), load(3), sizes(3)
    integer, intent(in) :: free(:)
    real(dp), intent(out) :: q(3)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(3) = [character(len=32) :: "the weight along xi", "the weight along eta", &
      & "the weights' moment about F"]
    real(dp) :: moved(size(free))
    integer :: left

    call solve_semidefinite(c(free, free), load(free), sizes(free), moved, left)
    q = 0
    q(free) = moved
    if (left > 0) call fatal_error(error, "nothing carries " // trim(names(free(left))) &
      & // ": give the frame a spring there, or a guide", impossible_mechanism, gravity_subject)
  end subroutine find_sag

  !> What the weights add to C and h of the `free` degrees of freedom about rest, at the crank angles of a table of the mass
  !> functions that the frame feels; shapes (angles, size(free), size(free)) and (angles, size(free)). Where the
  !> crank angle falls back by a `part` p of psi those are S + i p S', and what changes with psi is the moment of S + 2 i p S'
  !> - p^2 S'' (gestell_model_mechanism_held).
  pure subroutine add(self, free, table, part, c, h)
    class(weights_type), intent(in) :: self
    integer, intent(in) :: free(:)
    real(dp), intent(in) :: table(:, :)
    real(dp), intent(in) :: part
    real(dp), intent(inout) :: c(:, :, :)
    real(dp), intent(inout), optional :: h(:, :)
    complex(dp), parameter :: upright = 1, i = (0.0_dp, 1.0_dp)
    integer :: psi

    psi = findloc(free, 3, dim=1)
    if (psi == 0) return
    associate (a => cmplx(table(:, a1_v), table(:, a2_v), dp))
      if (part > 0) then
        c(:, psi, psi) = c(:, psi, psi) + self%stiffness(upright, a + i * part * cmplx(table(:, a1_d), table(:, a2_d), dp))
      else
        c(:, psi, psi) = c(:, psi, psi) + self%stiffness(upright, a)
      end if
      if (present(h)) h(:, psi) = h(:, psi) + self%moment(upright, a)
    end associate
  end subroutine add

  !> The moment on the frame (N m), turned by E = `turn`, where the masses' sums a1 + i a2 are `a`.
  elemental real(dp) function moment(self, turn, a)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, a

    moment = aimag(conjg(turn * (a - self%mean)) * self%gravity + conjg(less_one(turn)) * self%rest)
  end function moment

  !> Its decrease with psi (N m).
  elemental real(dp) function stiffness(self, turn, a)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, a

    stiffness = real(conjg(turn) * (conjg(a - self%mean) * self%gravity + self%rest), dp)
  end function stiffness

  !> The potential of weights and static forces (J), psi being the angle of `turn`.
  elemental real(dp) function potential(self, turn, psi, a)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, a
    real(dp), intent(in) :: psi

    potential = aimag(self%rest) * psi - self%stiffness(turn, a)
  end function potential

  !> The torque on the crank (N m) that lifts the links, whose sums change with the crank angle by `a_d` = a1' + i a2'.
  elemental real(dp) function torque(self, turn, a_d)
    class(weights_type), intent(in) :: self
    complex(dp), intent(in) :: turn, a_d

    torque = -real(conjg(turn * a_d) * self%gravity, dp)
  end function torque

  !> The static forces (N) on the ground of the part of the mounting with stiffness c.
  pure function static_forces(self, c) result(forces)
    class(weights_type), intent(in) :: self
    real(dp), intent(in) :: c(3, 3)
    real(dp) :: forces(2)

    forces = matmul(c(:2, :), self%sag)
  end function static_forces

end module gestell_model_frame_weights
