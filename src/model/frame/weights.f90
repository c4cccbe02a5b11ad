!> The weights of the frame and of the moving masses, and the static forces of the supports that carry them.
!>
!> Positions are those of the loaded machine at static rest, with the moment S = sum m r of the moving masses at its mean over the
!> turn. Of the weights the motion then feels their moment about F alone, with that of the static forces F_j, which stay in space
!> while the frame turns under them; those that turn with it are the mounting's (gestell_model_frame_moved_mounting). Vectors of the
!> plane are complex numbers, a x b = Im(conj(a) b), E = exp(i psi), and with
!>
!>     X = conj(S - mean S) g + R,   R = conj(mean S) g + sum of conj(p_j) F_j    of the F_j that stay in space
!>
!> the moment is Im(conj(E) X - R), its derivative with respect to psi -Re(conj(E) X), the potential Im(R) psi - Re(conj(E) X).
module gestell_model_frame_weights
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_model_mechanism, only: a1_d, a1_v, a2_d, a2_v, mechanism_type, table_columns
  use gestell_model_frame_mounting, only: stiffness_matrix, support_type
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
  !> Nine arguments: what weighs, what carries it.
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

  !> The mean over the turn of a1 + i a2 and the greatest size of it, by the trapezoidal rule, its points doubled until two
  !> doublings in a row have changed nothing but roundings.
  subroutine average_masses(mechanism, mean, greatest)
    class(mechanism_type), intent(in) :: mechanism
    complex(dp), intent(out) :: mean
    real(dp), intent(out) :: greatest
    integer, parameter :: most_points = 2**18
    real(dp), allocatable :: table(:, :), angles(:)
    complex(dp) :: before
    real(dp) :: shift, change, last
    integer :: k, points

    points = max(16, 2 * ceiling(2 * pi / mechanism%angle_scale))
    shift = 0
    mean = 0
    greatest = 0
    change = huge(change)
    do
      if (allocated(table)) deallocate(table)
      allocate(table(points, table_columns))
      angles = [(2 * pi * (k + shift) / points, k = 0, points - 1)]
      call mechanism%tabulate(angles, table)
      greatest = max(greatest, maxval(hypot(table(:, a1_v), table(:, a2_v))))
      before = mean
      mean = cmplx(sum(table(:, a1_v)), sum(table(:, a2_v)), dp) / points
      if (shift > 0) then
        mean = (mean + before) / 2
        points = 2 * points
        last = change
        change = abs(mean - before)
        if (max(change, last) <= 8 * epsilon(1.0_dp) * greatest .or. points > most_points) exit
      end if
      shift = 0.5_dp
    end do
  end subroutine average_masses

  !> C q = load of the `free` degrees of freedom, by elimination with full pivoting in units that make the diagonal 1; what no
  !> spring holds stays 0. `sizes`: of the terms that the load sums. Error: a load along it is left.
  pure subroutine find_sag(c, free, load, sizes, q, error)
    real(dp), intent(in) :: c(3, 3), load(3), sizes(3)
    integer, intent(in) :: free(:)
    real(dp), intent(out) :: q(3)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: singular = 1.0e-12_dp, left = 1.0e-9_dp
    character(len=*), parameter :: names(3) = [character(len=32) :: "the weight along xi", "the weight along eta", &
      & "the weights' moment about F"]
    real(dp) :: a(size(free), size(free)), b(size(free)), x(size(free)), unit(3), greatest
    integer :: row(size(free)), column(size(free)), at(2), i, k, n, rank

    n = size(free)
    unit = sqrt([(abs(c(i, i)), i = 1, 3)])
    where (.not. unit > 0) unit = max(1.0_dp, maxval(unit(free)))
    a = c(free, free) / (spread(unit(free), 2, n) * spread(unit(free), 1, n))
    b = load(free) / unit(free)
    greatest = sum(sizes(free) / unit(free))
    row = [(i, i = 1, n)]
    column = row
    rank = n
    do k = 1, n
      at = k - 1 + maxloc(abs(a(row(k:), column(k:))))
      row([k, at(1)]) = row([at(1), k])
      column([k, at(2)]) = column([at(2), k])
      if (.not. abs(a(row(k), column(k))) > singular) then
        rank = k - 1
        exit
      end if
      do i = k + 1, n
        associate (factor => a(row(i), column(k)) / a(row(k), column(k)))
          b(row(i)) = b(row(i)) - factor * b(row(k))
          a(row(i), column(k + 1:)) = a(row(i), column(k + 1:)) - factor * a(row(k), column(k + 1:))
        end associate
      end do
    end do
    q = 0
    do i = rank + 1, n
      if (abs(b(row(i))) <= left * greatest) cycle
      call fatal_error(error, "nothing carries " // trim(names(free(row(i)))) // ": give the frame a spring there, or a guide", &
        & impossible_mechanism, gravity_subject)
      return
    end do
    x = 0
    do k = rank, 1, -1
      x(column(k)) = (b(row(k)) - dot_product(a(row(k), column(k + 1:rank)), x(column(k + 1:rank)))) / a(row(k), column(k))
    end do
    q(free) = x / unit(free)
  end subroutine find_sag

  !> What the weights add to C and h of the `free` degrees of freedom about rest, at the crank angles of a table of the mass
  !> functions that the frame feels; shapes (angles, size(free), size(free)) and (angles, size(free)). Of a crank that turns
  !> `even_in_space` those are S + i S', and what changes with psi is the moment of S + 2 i S' - S'' (gestell_model_mechanism_held).
  pure subroutine add(self, free, table, even_in_space, c, h)
    class(weights_type), intent(in) :: self
    integer, intent(in) :: free(:)
    real(dp), intent(in) :: table(:, :)
    logical, intent(in) :: even_in_space
    real(dp), intent(inout) :: c(:, :, :)
    real(dp), intent(inout), optional :: h(:, :)
    complex(dp), parameter :: upright = 1, i = (0.0_dp, 1.0_dp)
    integer :: psi

    psi = findloc(free, 3, dim=1)
    if (psi == 0) return
    associate (a => cmplx(table(:, a1_v), table(:, a2_v), dp))
      if (even_in_space) then
        c(:, psi, psi) = c(:, psi, psi) + self%stiffness(upright, a + i * cmplx(table(:, a1_d), table(:, a2_d), dp))
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

    moment = aimag(conjg(turn * (a - self%mean)) * self%gravity + conjg(turn - 1) * self%rest)
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
