!> Springs and dampers that hold a frame, and their stiffness and damping matrices. The axes of a support either turn with the frame
!> or have fixed directions.
!>
!> A frame in space has the motion (u, theta): displacement along and rotation about xi, eta, zeta. The frame's degrees of freedom
!> have another order, which begins with those of the plane: xi, eta, psi, zeta, rot_xi, rot_eta. Matrices of shape (dofs, dofs)
!> contain the first three or all six degrees of freedom in the frame's order.
module gestell_model_mounting
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: cross, cross_matrix, outer
  implicit none (type, external)
  private

  public :: damping_matrix, is_rotation, load_matrix, load_rounding, matrix_rounding, stiffness_matrix, support_matrix, turned_loads

  !> Index in (u, theta) of each degree of freedom of the frame; (u, theta) are the displacements along and the rotations about xi,
  !> eta, zeta.
  integer, parameter, public :: in_space(6) = [1, 2, 6, 3, 4, 5]
  !> Index, among the frame's degrees of freedom, of each component of (u, theta).
  integer, parameter, public :: in_frame(6) = [1, 2, 4, 5, 6, 3]

  !> A support at `position` in the frame's axes (m), with springs (N/m) and dampers (N s/m) along the three columns of `axes`. For
  !> a frame in the plane only the first two columns have an effect.
  type, public :: support_type
    real(dp) :: position(3) = 0, stiffness(3) = 0, damping(3) = 0
    real(dp) :: axes(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
    !> True if the axes turn with the frame, false if their directions are fixed.
    logical :: turning = .false.
    !> Static force (N) that the support exerts on the ground because it carries part of the weight. If the axes turn with the
    !> frame, so does this force.
    real(dp) :: static(3) = 0
  end type support_type

  interface support_type
    procedure :: support_in_plane, support_in_space
  end interface support_type

contains

  !> A support whose axes are rotated about zeta by `angle` (rad) relative to the frame's axes. Vectors with two components get zero
  !> as the third component.
  pure type(support_type) function support_in_plane(position, stiffness, damping, angle, turning, static) result(support)
    !> `position`: position in the frame's axes (m). `stiffness`: stiffness along each axis of the support (N/m)
    real(dp), intent(in) :: position(:), stiffness(:)
    !> `damping`: damping along each axis of the support (N s/m). `angle`: angle of the axes (rad). `static`: static force on the
    !> ground (N). Each of them is 0 by default
    real(dp), intent(in), optional :: damping(:), angle, static(:)
    !> True if the axes turn with the frame. False, the default, if their directions are fixed
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

  !> A support with springs and dampers along the columns of `axes`.
  pure type(support_type) function support_in_space(position, stiffness, damping, axes, turning) result(support)
    !> `position`: position in the frame's axes (m). `stiffness` (N/m), `damping` (N s/m): values along each axis. `axes`: unit
    !> vectors as columns
    real(dp), intent(in) :: position(3), stiffness(3), damping(3), axes(3, 3)
    !> True if the axes turn with the frame. False, the default, if their directions are fixed
    logical, intent(in), optional :: turning

    support%position = position
    support%stiffness = stiffness
    support%damping = damping
    support%axes = axes
    if (present(turning)) support%turning = turning
  end function support_in_space

  !> True if the degree of freedom number `dof` is a rotation of the frame.
  elemental logical function is_rotation(dof)
    integer, intent(in) :: dof

    is_rotation = any(in_frame(4:) == dof)
  end function is_rotation

  !> Stiffness matrix c_ij of all supports for `dofs` degrees of freedom (default 3). For example, supports at (X, Y) with springs
  !> k along x and kb along y give in the plane
  !>
  !>     c11 = sum k,   c22 = sum kb,   c13 = -sum k Y,   c23 = sum kb X,   c33 = sum (k Y^2 + kb X^2),
  !>
  !> which is (26) of doc/theory.md, and [1] of the paper on which that page is based.
  pure function stiffness_matrix(supports, dofs) result(c)
    type(support_type), intent(in) :: supports(:)
    integer, intent(in), optional :: dofs
    real(dp), allocatable :: c(:, :)

    c = sum_of_matrices(supports, .false., dofs)
  end function stiffness_matrix

  !> Damping matrix b_ij of all supports for `dofs` degrees of freedom (default 3).
  pure function damping_matrix(supports, dofs) result(b)
    type(support_type), intent(in) :: supports(:)
    integer, intent(in), optional :: dofs
    real(dp), allocatable :: b(:, :)

    b = sum_of_matrices(supports, .true., dofs)
  end function damping_matrix

  !> Sum of the supports' matrices, of their dampers or else of their springs, in the frame's order of degrees of freedom.
  pure function sum_of_matrices(supports, dampers, dofs) result(c)
    type(support_type), intent(in) :: supports(:)
    logical, intent(in) :: dampers
    integer, intent(in), optional :: dofs
    real(dp), allocatable :: c(:, :)
    real(dp) :: whole(6, 6)
    integer :: i, n

    whole = 0
    do i = 1, size(supports)
      whole = whole + support_matrix(supports(i), merge(supports(i)%damping, supports(i)%stiffness, dampers))
    end do
    n = 3
    if (present(dofs)) n = dofs
    c = whole(in_space(:n), in_space(:n))
  end function sum_of_matrices

  !> Matrix of one support for small motions q = (u, theta), shape (6, 6): the sum of k g g^T over its axes n, with g = (n, p x
  !> n). `k` is the stiffness or damping along each axis, p the position of the support. The motion q moves the upper end of the
  !> support by g . q along n.
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

  !> Contribution to the stiffness matrix c_ij, to first order, of the static forces G of supports whose axes turn with the frame.
  !> Rows of u contain theta x G. Rows of theta contain G x e, where e = u + theta x p is the displacement of the upper end of a
  !> support at the position p.
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

  !> Derivatives, with respect to small motions, of the static forces G on the ground that turn with the frame, and of their
  !> moments about the rest position of the frame's centre of mass. The forces change by theta x G, the moments by p x (theta x
  !> G), where p is the position of the support.
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

  !> Bounds on the rounding errors of `load_matrix` and `turned_loads`, shape (dofs, dofs).
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

  !> Bounds on the rounding errors of a mounting's matrix, in the shape of this matrix. The matrix is a sum of positive semidefinite
  !> terms. By Schwarz's inequality the sum of the absolute values of the terms of c_ik is at most sqrt(c_ii c_kk), even where the
  !> terms cancel.
  pure function matrix_rounding(c) result(rounding)
    real(dp), intent(in) :: c(:, :)
    real(dp) :: rounding(size(c, 1), size(c, 1)), root(size(c, 1))
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)
    integer :: i

    root = [(sqrt(abs(c(i, i))), i = 1, size(c, 1))]
    rounding = unit * spread(root, 2, size(root)) * spread(root, 1, size(root))
  end function matrix_rounding

end module gestell_model_mounting
