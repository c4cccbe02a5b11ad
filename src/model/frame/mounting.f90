!> What holds the frame: supports and foundation, as stiffness and damping matrices for (xi, eta, psi).
module gestell_model_frame_mounting
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: damping_matrix, is_conservative, load_matrix, load_rounding, matrix_rounding, stiffness_matrix, support_axes, &
    & turned_loads

  !> A spring-damper pair at `position` in the frame's system (m), along its own two axes, turned by `angle` (rad).
  type, public :: support_type
    real(dp) :: position(2) = 0, stiffness(2) = 0, damping(2) = 0, angle = 0
    !> Whether the axes turn with the frame; else they stay in space.
    logical :: turning = .false.
    !> The static force on the ground by the weights (N), as new_frame finds it. It turns with the axes.
    real(dp) :: static(2) = 0
  end type support_type

contains

  !> c_ij of all supports, shape (3, 3): with k along x, kb along y at (X, Y) and angle 0
  !> c11 = sum k, c22 = sum kb, c13 = -sum k Y, c23 = sum kb X, c33 = sum (k Y^2 + kb X^2) ([1] of the paper).
  pure function stiffness_matrix(supports) result(c)
    type(support_type), intent(in) :: supports(:)
    real(dp) :: c(3, 3)
    integer :: i

    c = 0
    do i = 1, size(supports)
      c = c + pair(supports(i), supports(i)%stiffness)
    end do
  end function stiffness_matrix

  !> b_ij of all supports, shape (3, 3), in the same way.
  pure function damping_matrix(supports) result(b)
    type(support_type), intent(in) :: supports(:)
    real(dp) :: b(3, 3)
    integer :: i

    b = 0
    do i = 1, size(supports)
      b = b + pair(supports(i), supports(i)%damping)
    end do
  end function damping_matrix

  !> What static forces G on the ground that turn with the frame add to c_ij, shape (3, 3): the frame at u, psi feels -i psi G and
  !> the moment -u x G - psi p . G about F, up to terms of second order.
  pure function load_matrix(supports) result(c)
    type(support_type), intent(in) :: supports(:)
    real(dp) :: c(3, 3)

    c = turned_loads(supports)
    c(3, :2) = c(:2, 3)
  end function load_matrix

  !> Whether a mounting of these matrices takes no energy from motions along the degrees of freedom `free`: nothing damps them and
  !> the stiffness is symmetric. Once the frame turns, dampers along the others act too.
  pure logical function is_conservative(stiffness, damping, supports, free)
    real(dp), intent(in) :: stiffness(3, 3), damping(3, 3)
    type(support_type), intent(in) :: supports(:)
    integer, intent(in) :: free(:)
    integer :: i

    is_conservative = .not. any(abs(damping(free, free)) > 0) .and. .not. any(abs(stiffness(free, free) &
      & - transpose(stiffness(free, free))) > 0)
    if (any(free == 3)) is_conservative = is_conservative .and. all([(.not. any(supports(i)%damping > 0), i = 1, size(supports))])
  end function is_conservative

  !> How these forces and their moment about F at rest change with psi, the third column: i G, p . G.
  pure function turned_loads(supports) result(c)
    type(support_type), intent(in) :: supports(:)
    real(dp) :: c(3, 3)
    integer :: i

    c = 0
    do i = 1, size(supports)
      if (.not. supports(i)%turning) cycle
      associate (p => supports(i)%position, static => supports(i)%static)
        c(:, 3) = c(:, 3) + [-static(2), static(1), dot_product(p, static)]
      end associate
    end do
  end function turned_loads

  !> Bounds on the roundings of its terms, shape (3, 3).
  pure function load_rounding(supports) result(c)
    type(support_type), intent(in) :: supports(:)
    real(dp) :: c(3, 3)
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)
    integer :: i

    c = 0
    do i = 1, size(supports)
      if (.not. supports(i)%turning) cycle
      associate (force => unit * norm2(supports(i)%static))
        c(:, 3) = c(:, 3) + force * [1.0_dp, 1.0_dp, norm2(supports(i)%position)]
      end associate
    end do
    c(3, :2) = c(:2, 3)
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

  !> sum over the two axes of k g g^T: a small motion (xi, eta, psi) of the frame moves the support's head by g . q
  !> along an axis n, where g = (n_x, n_y, X n_y - Y n_x).
  pure function pair(support, k) result(c)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: k(2)
    real(dp) :: c(3, 3)
    real(dp) :: g(3, 2)

    g = support_axes(support)
    c = k(1) * outer(g(:, 1)) + k(2) * outer(g(:, 2))
  end function pair

  !> g of both axes, shape (3, 2): the first two rows are the axes' directions.
  pure function support_axes(support) result(g)
    type(support_type), intent(in) :: support
    real(dp) :: g(3, 2)

    associate (x => support%position(1), y => support%position(2), cosine => cos(support%angle), sine => sin(support%angle))
      g(:, 1) = [cosine, sine, x * sine - y * cosine]
      g(:, 2) = [-sine, cosine, x * cosine + y * sine]
    end associate
  end function support_axes

  pure function outer(g) result(c)
    real(dp), intent(in) :: g(3)
    real(dp) :: c(3, 3)

    c = spread(g, 2, 3) * spread(g, 1, 3)
  end function outer

end module gestell_model_frame_mounting
