!> What holds a frame: springs and dampers along axes that stay in space or turn with the frame, as stiffness and damping matrices.
!>
!> In space a frame's motion is (u, theta), its displacement along and rotation about xi, eta, zeta. Its degrees of freedom stand in
!> another order, in which those of the plane come first: xi, eta, psi, zeta, rot_xi, rot_eta. Matrices of shape (dofs, dofs) are of
!> the first three or of all six in that order.
module gestell_model_mounting
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: cross, cross_matrix, outer
  implicit none (type, external)
  private

  public :: damping_matrix, is_rotation, load_matrix, load_rounding, matrix_rounding, stiffness_matrix, support_matrix, turned_loads

  !> Where the degrees of freedom of a frame, in whose order those of the plane come first, stand in (u, theta).
  integer, parameter, public :: in_space(6) = [1, 2, 6, 3, 4, 5]
  !> Where (u, theta) stand among the frame's degrees of freedom.
  integer, parameter, public :: in_frame(6) = [1, 2, 4, 5, 6, 3]

  !> Springs and dampers at `position` in the frame's system (m), along the three columns of `axes`, of which in the plane only the
  !> first two act.
  type, public :: support_type
    real(dp) :: position(3) = 0, stiffness(3) = 0, damping(3) = 0
    real(dp) :: axes(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
    !> Whether the axes turn with the frame; else they stay in space.
    logical :: turning = .false.
    !> The static force on the ground by the weights (N). It turns with the axes.
    real(dp) :: static(3) = 0
  end type support_type

  interface support_type
    procedure :: support_in_plane, support_in_space
  end interface support_type

contains

  !> A support with its axes turned about zeta by `angle` (rad). What is missing in vectors of two components is zero.
  pure type(support_type) function support_in_plane(position, stiffness, damping, angle, turning, static) result(support)
    real(dp), intent(in) :: position(:), stiffness(:)
    real(dp), intent(in), optional :: damping(:), angle, static(:)
    logical, intent(in), optional :: turning

    support%position(:size(position)) = position
    support%stiffness(:size(stiffness)) = stiffness
    if (present(damping)) support%damping(:size(damping)) = damping
    if (present(static)) support%static(:size(static)) = static
    if (present(turning)) support%turning = turning
    if (.not. present(angle)) return
    support%axes(:2, 1) = [cos(angle), sin(angle)]
    support%axes(:2, 2) = [-sin(angle), cos(angle)]
  end function support_in_plane

  !> A support along the columns of `axes`.
  pure type(support_type) function support_in_space(position, stiffness, damping, axes, turning) result(support)
    real(dp), intent(in) :: position(3), stiffness(3), damping(3), axes(3, 3)
    logical, intent(in), optional :: turning

    support%position = position
    support%stiffness = stiffness
    support%damping = damping
    support%axes = axes
    if (present(turning)) support%turning = turning
  end function support_in_space

  !> Whether one of the frame's degrees of freedom turns it.
  elemental logical function is_rotation(dof)
    integer, intent(in) :: dof

    is_rotation = any(in_frame(4:) == dof)
  end function is_rotation

  !> c_ij of all supports, of three degrees of freedom where `dofs` is missing: in the plane with k along x, kb along y at (X, Y)
  !> and angle 0 c11 = sum k, c22 = sum kb, c13 = -sum k Y, c23 = sum kb X, c33 = sum (k Y^2 + kb X^2) ([1] of the paper).
  pure function stiffness_matrix(supports, dofs) result(c)
    type(support_type), intent(in) :: supports(:)
    integer, intent(in), optional :: dofs
    real(dp), allocatable :: c(:, :)
    real(dp) :: whole(6, 6)
    integer :: i

    whole = 0
    do i = 1, size(supports)
      whole = whole + support_matrix(supports(i), supports(i)%stiffness)
    end do
    c = of_frame(whole, dofs)
  end function stiffness_matrix

  !> b_ij of all supports, in the same way.
  pure function damping_matrix(supports, dofs) result(b)
    type(support_type), intent(in) :: supports(:)
    integer, intent(in), optional :: dofs
    real(dp), allocatable :: b(:, :)
    real(dp) :: whole(6, 6)
    integer :: i

    whole = 0
    do i = 1, size(supports)
      whole = whole + support_matrix(supports(i), supports(i)%damping)
    end do
    b = of_frame(whole, dofs)
  end function damping_matrix

  !> A matrix of (u, theta) for the first `dofs` degrees of freedom in the frame's order.
  pure function of_frame(whole, dofs) result(c)
    real(dp), intent(in) :: whole(6, 6)
    integer, intent(in), optional :: dofs
    real(dp), allocatable :: c(:, :)
    integer :: n

    n = 3
    if (present(dofs)) n = dofs
    c = whole(in_space(:n), in_space(:n))
  end function of_frame

  !> Of small motions (u, theta), shape (6, 6): sum of k g g^T, g = (n, p x n), over the axes n of a support with the numbers `k`
  !> along them, for a small motion q moves the support's head by g . q along n.
  pure function support_matrix(support, k) result(c)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: k(3)
    real(dp) :: c(6, 6), g(6)
    integer :: i

    c = 0
    do i = 1, 3
      if (abs(k(i)) <= 0) cycle
      g = [support%axes(:, i), cross(support%position, support%axes(:, i))]
      c = c + k(i) * outer(g, g)
    end do
  end function support_matrix

  !> What static forces G on the ground that turn with the frame add to c_ij: theta x G against u, and e x G, e = u + theta x p,
  !> against theta, up to terms of second order.
  pure function load_matrix(supports, dofs) result(c)
    type(support_type), intent(in) :: supports(:)
    integer, intent(in) :: dofs
    real(dp) :: c(dofs, dofs), whole(6, 6), g(3, 3)
    integer :: i

    whole = 0
    do i = 1, size(supports)
      if (.not. supports(i)%turning) cycle
      g = cross_matrix(supports(i)%static)
      whole(:3, 4:) = whole(:3, 4:) - g
      whole(4:, :3) = whole(4:, :3) + g
      whole(4:, 4:) = whole(4:, 4:) - matmul(g, cross_matrix(supports(i)%position))
    end do
    c = whole(in_space(:dofs), in_space(:dofs))
  end function load_matrix

  !> How these forces on the ground and their moment about F at rest change with small motions: theta x G, p x (theta x G).
  pure function turned_loads(supports, dofs) result(c)
    type(support_type), intent(in) :: supports(:)
    integer, intent(in) :: dofs
    real(dp) :: c(dofs, dofs), whole(6, 6)
    integer :: i

    whole = 0
    do i = 1, size(supports)
      if (.not. supports(i)%turning) cycle
      associate (turned => -cross_matrix(supports(i)%static))
        whole(:3, 4:) = whole(:3, 4:) + turned
        whole(4:, 4:) = whole(4:, 4:) + matmul(cross_matrix(supports(i)%position), turned)
      end associate
    end do
    c = whole(in_space(:dofs), in_space(:dofs))
  end function turned_loads

  !> Bounds on the roundings of the terms of both.
  pure function load_rounding(supports, dofs) result(c)
    type(support_type), intent(in) :: supports(:)
    integer, intent(in) :: dofs
    real(dp) :: c(dofs, dofs), whole(6, 6)
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)
    integer :: i

    whole = 0
    do i = 1, size(supports)
      if (.not. supports(i)%turning) cycle
      associate (force => unit * norm2(supports(i)%static))
        whole(:3, 4:) = whole(:3, 4:) + force
        whole(4:, 4:) = whole(4:, 4:) + force * norm2(supports(i)%position)
      end associate
    end do
    whole(4:, :3) = transpose(whole(:3, 4:))
    c = whole(in_space(:dofs), in_space(:dofs))
  end function load_rounding

  !> Bounds on the roundings in a mounting's matrix, shape as its. It is a sum of positive semi-definite terms: the sizes of those
  !> in c_ik sum to sqrt(c_ii c_kk) at most, by Schwarz's inequality, however they cancel there.
  pure function matrix_rounding(c) result(rounding)
    real(dp), intent(in) :: c(:, :)
    real(dp) :: rounding(size(c, 1), size(c, 1)), root(size(c, 1))
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)
    integer :: i

    root = [(sqrt(abs(c(i, i))), i = 1, size(c, 1))]
    rounding = unit * spread(root, 2, size(root)) * spread(root, 1, size(root))
  end function matrix_rounding

end module gestell_model_mounting
