!> Rotations in space, described by a rotation vector theta (rad) with a = |theta|:
!>
!>     R = exp([theta]) = 1 + s_1 [theta] + s_2 [theta]^2,   s_1 = sin(a)/a,  s_2 = (1 - cos a)/a^2,
!>
!> where [theta] x is the cross product of theta and x. The angular velocity in the rotating axes is w = T theta' with
!>
!>     T = 1 - s_2 [theta] + s_3 [theta]^2,   s_3 = (a - sin a)/a^3.
!>
!> The s_k are entire functions of a^2: s_k = sum over n of (-a^2)^n / (2 n + k)! (A. Mueller, Applied Mechanics Reviews 73, 2021,
!> 010803, doi 10.1115/1.4047987). In the fixed axes the angular velocity is R w = T^T theta', because R T = T^T.
!>
!> Procedures with the argument `n` compute n phases. The phase is the first index of their arrays.
module gestell_math_rotation
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: cross, cross_matrix, find_rotation, find_turning, find_turning_gradient, identity, outer, rotation_less_one, &
    & rotation_matrix, turning_less_one, turning_matrices

  ! These names are generic because gestell_math_vectors gives them to the same operations at a batch of phases.
  interface cross
    module procedure :: cross_product
  end interface

  interface cross_matrix
    module procedure :: matrix_of_cross
  end interface

  interface outer
    module procedure :: outer_product
  end interface

contains

  !> Cross product of a and b.
  pure function cross_product(a, b) result(c)
    real(dp), intent(in) :: a(3), b(3)
    real(dp) :: c(3)

    c = [a(2) * b(3) - a(3) * b(2), a(3) * b(1) - a(1) * b(3), a(1) * b(2) - a(2) * b(1)]
  end function cross_product

  !> [a], the matrix of the cross product: [a] b = a x b for every vector b.
  pure function matrix_of_cross(a) result(c)
    real(dp), intent(in) :: a(3)
    real(dp) :: c(3, 3)

    c = reshape([0.0_dp, a(3), -a(2), -a(3), 0.0_dp, a(1), a(2), -a(1), 0.0_dp], [3, 3])
  end function matrix_of_cross

  !> Outer product a b^T.
  pure function outer_product(a, b) result(c)
    real(dp), intent(in) :: a(:), b(:)
    real(dp) :: c(size(a), size(b))

    c = spread(a, 2, size(b)) * spread(b, 1, size(a))
  end function outer_product

  !> Rotation matrix R of the rotation vector theta, shape (3, 3).
  pure function rotation_matrix(theta) result(r)
    real(dp), intent(in) :: theta(3)
    real(dp) :: r(3, 3)

    r = rotation_less_one(theta) + identity()
  end function rotation_matrix

  !> R - 1, where R is the rotation matrix; shape (3, 3). It is not computed from R, because the subtraction would lose digits for
  !> small rotations.
  pure function rotation_less_one(theta) result(r)
    real(dp), intent(in) :: theta(3)
    real(dp) :: r(3, 3)

    call find_rotation(1, theta, r)
  end function rotation_less_one

  !> Computes R - 1 for n rotation vectors, or only the terms `beyond_first_order`: R - 1 - [theta].
  pure subroutine find_rotation(n, theta, r, beyond_first_order)
    integer, intent(in) :: n
    real(dp), intent(in) :: theta(n, 3)
    real(dp), intent(out) :: r(n, 3, 3)
    logical, intent(in), optional :: beyond_first_order
    real(dp) :: s(n, 3, 0:2), v(n, 3), along(n)
    integer :: i, k

    call find_coefficients(n, theta, s)
    along = s(:, 1, 0)
    if (present(beyond_first_order)) then
      ! s_1 - 1 = -a^2 s_3
      if (beyond_first_order) along = -s(:, 3, 0) * (theta(:, 1)**2 + theta(:, 2)**2 + theta(:, 3)**2)
    end if
    do k = 1, 3
      v(:, k) = along * theta(:, k)
      do i = 1, 3
        r(:, i, k) = s(:, 2, 0) * theta(:, i) * theta(:, k)
      end do
    end do
    call add_antisymmetric(n, v, r(:, 1, 1) + r(:, 2, 2) + r(:, 3, 3), r)
  end subroutine find_rotation

  !> Adds [v] - f 1 to the matrices a.
  pure subroutine add_antisymmetric(n, v, f, a)
    integer, intent(in) :: n
    real(dp), intent(in) :: v(n, 3), f(n)
    real(dp), intent(inout) :: a(n, 3, 3)
    integer :: i, next, last

    do i = 1, 3
      next = 1 + modulo(i, 3)
      last = 1 + modulo(i + 1, 3)
      a(:, i, i) = a(:, i, i) - f
      a(:, last, next) = a(:, last, next) + v(:, i)
      a(:, next, last) = a(:, next, last) - v(:, i)
    end do
  end subroutine add_antisymmetric

  !> The matrix T, which gives the angular velocity w = T theta', and its first and second time derivatives, shape (3, 3, 0:2).
  !> `theta` contains theta, theta', theta'', shape (3, 0:2).
  pure function turning_matrices(theta) result(t)
    real(dp), intent(in) :: theta(3, 0:2)
    real(dp) :: t(3, 3, 0:2)
    integer :: k

    call find_turning(1, theta, t)
    do k = 0, 2
      t(:, :, k) = transpose(t(:, :, k))
    end do
  end function turning_matrices

  !> Computes T^T and its first and second time derivatives for n rotation vectors. `theta` contains theta, theta', theta''.
  pure subroutine find_turning(n, theta, t)
    integer, intent(in) :: n
    real(dp), intent(in) :: theta(n, 3, 0:2)
    real(dp), intent(out) :: t(n, 3, 3, 0:2)
    real(dp) :: s(n, 3, 0:2), f(n, 0:2), v(n, 3, 0:2, 2:3), x_d(n), x_dd(n)
    integer :: i, k

    call find_coefficients(n, theta, s)
    x_d = 2 * (theta(:, 1, 0) * theta(:, 1, 1) + theta(:, 2, 0) * theta(:, 2, 1) + theta(:, 3, 0) * theta(:, 3, 1))
    x_dd = 2 * (theta(:, 1, 1)**2 + theta(:, 1, 0) * theta(:, 1, 2) + theta(:, 2, 1)**2 + theta(:, 2, 0) * theta(:, 2, 2) &
      & + theta(:, 3, 1)**2 + theta(:, 3, 0) * theta(:, 3, 2))
    ! v = s_k theta with its derivatives, by Leibniz' rule
    do k = 2, 3
      f(:, 0) = s(:, k, 0)
      f(:, 1) = s(:, k, 1) * x_d
      f(:, 2) = s(:, k, 2) * x_d**2 + s(:, k, 1) * x_dd
      do i = 1, 3
        v(:, i, 0, k) = f(:, 0) * theta(:, i, 0)
        v(:, i, 1, k) = f(:, 1) * theta(:, i, 0) + f(:, 0) * theta(:, i, 1)
        v(:, i, 2, k) = f(:, 2) * theta(:, i, 0) + 2 * f(:, 1) * theta(:, i, 1) + f(:, 0) * theta(:, i, 2)
      end do
    end do
    do k = 1, 3
      do i = 1, 3
        t(:, i, k, 0) = v(:, i, 0, 3) * theta(:, k, 0)
        t(:, i, k, 1) = v(:, i, 1, 3) * theta(:, k, 0) + v(:, i, 0, 3) * theta(:, k, 1)
        t(:, i, k, 2) = v(:, i, 2, 3) * theta(:, k, 0) + 2 * v(:, i, 1, 3) * theta(:, k, 1) + v(:, i, 0, 3) * theta(:, k, 2)
      end do
    end do
    do k = 0, 2
      f(:, k) = t(:, 1, 1, k) + t(:, 2, 2, k) + t(:, 3, 3, k)
    end do
    f(:, 0) = f(:, 0) - 1
    do k = 0, 2
      call add_antisymmetric(n, v(:, :, k, 2), f(:, k), t(:, :, :, k))
    end do
  end subroutine find_turning

  !> Computes the derivative of T x with respect to theta, at constant x, for n rotation vectors theta and vectors x.
  pure subroutine find_turning_gradient(n, theta, x, gradient)
    integer, intent(in) :: n
    real(dp), intent(in) :: theta(n, 3), x(n, 3)
    real(dp), intent(out) :: gradient(n, 3, 3)
    real(dp), dimension(n, 3) :: v, y
    real(dp) :: s(n, 3, 0:2), along(n)
    integer :: i, k, next, last

    ! T x = x - s_2 theta x x + s_3 y with y = theta (theta x) - a^2 x
    call find_coefficients(n, theta, s)
    along = theta(:, 1) * x(:, 1) + theta(:, 2) * x(:, 2) + theta(:, 3) * x(:, 3)
    do i = 1, 3
      next = 1 + modulo(i, 3)
      last = 1 + modulo(i + 1, 3)
      y(:, i) = theta(:, i) * along - (theta(:, 1)**2 + theta(:, 2)**2 + theta(:, 3)**2) * x(:, i)
      v(:, i) = 2 * (s(:, 3, 1) * y(:, i) - s(:, 2, 1) * (theta(:, next) * x(:, last) - theta(:, last) * x(:, next)) &
        & - s(:, 3, 0) * x(:, i))
    end do
    do k = 1, 3
      do i = 1, 3
        gradient(:, i, k) = v(:, i) * theta(:, k) + s(:, 3, 0) * theta(:, i) * x(:, k)
      end do
      y(:, k) = s(:, 2, 0) * x(:, k)
    end do
    call add_antisymmetric(n, y, -s(:, 3, 0) * along, gradient)
  end subroutine find_turning_gradient

  !> T - 1, shape (3, 3), where w = T theta' is the angular velocity. It is computed without loss of digits for small rotations.
  pure function turning_less_one(theta) result(t)
    real(dp), intent(in) :: theta(3)
    real(dp) :: t(3, 3), s(3, 0:2), c(3, 3)

    call find_coefficients(1, theta, s)
    c = cross_matrix(theta)
    t = s(3, 0) * matmul(c, c) - s(2, 0) * c
  end function turning_less_one

  !> Computes the coefficients s_1, s_2, s_3 of the matrices R and T in the module's header, and their first and second derivatives
  !> with respect to x = a^2, for n rotation vectors; `s` has the shape (n, 3, 0:2). The series of s_6 and s_7 has enough terms for
  !> a few radians, more than any frame rotates; up to one radian eight terms are sufficient. Then
  !>
  !>     s_k = 1/k! - x s_k+2,   ds_k/dx = (k s_k+2 - s_k+1)/2.
  pure subroutine find_coefficients(n, theta, s)
    integer, intent(in) :: n
    real(dp), intent(in) :: theta(n, 3)
    real(dp), intent(out) :: s(n, 3, 0:2)
    integer :: i, k
    integer, parameter :: most = 24
    real(dp), parameter :: f(2 * most + 7) = [(1 / gamma(i + 1.0_dp), i = 1, 2 * most + 7)]
    real(dp) :: x(n), s_6(n), s_7(n)

    do k = 1, n
      x(k) = theta(k, 1)**2 + theta(k, 2)**2 + theta(k, 3)**2
      s_6(k) = f(6) - x(k) * (f(8) - x(k) * (f(10) - x(k) * (f(12) - x(k) * (f(14) - x(k) * (f(16) &
        & - x(k) * (f(18) - x(k) * f(20)))))))
      s_7(k) = f(7) - x(k) * (f(9) - x(k) * (f(11) - x(k) * (f(13) - x(k) * (f(15) - x(k) * (f(17) &
        & - x(k) * (f(19) - x(k) * f(21)))))))
    end do
    if (any(x > 1)) then
      s_6 = 0
      s_7 = 0
      do i = most, 0, -1
        s_6 = f(2 * i + 6) - x * s_6
        s_7 = f(2 * i + 7) - x * s_7
      end do
    end if
    call recur(n, x, s_6, s_7, s)
  end subroutine find_coefficients

  !> Computes the coefficients from s_6 and s_7.
  pure subroutine recur(n, x, s_6, s_7, s)
    integer, intent(in) :: n
    real(dp), intent(in) :: x(n), s_6(n), s_7(n)
    real(dp), intent(out) :: s(n, 3, 0:2)
    real(dp) :: s_2, s_3, s_4, s_5, d_2, d_3, d_4, d_5
    integer :: k

    do k = 1, n
      s_5 = 1 / 120.0_dp - x(k) * s_7(k)
      s_4 = 1 / 24.0_dp - x(k) * s_6(k)
      s_3 = 1 / 6.0_dp - x(k) * s_5
      s_2 = 1 / 2.0_dp - x(k) * s_4
      d_5 = (5 * s_7(k) - s_6(k)) / 2
      d_4 = (4 * s_6(k) - s_5) / 2
      d_3 = (3 * s_5 - s_4) / 2
      d_2 = (2 * s_4 - s_3) / 2
      s(k, 1, 0) = 1 - x(k) * s_3
      s(k, 2, 0) = s_2
      s(k, 3, 0) = s_3
      s(k, 1, 1) = (s_3 - s_2) / 2
      s(k, 2, 1) = d_2
      s(k, 3, 1) = d_3
      s(k, 1, 2) = (d_3 - d_2) / 2
      s(k, 2, 2) = (2 * d_4 - d_3) / 2
      s(k, 3, 2) = (3 * d_5 - d_4) / 2
    end do
  end subroutine recur

  !> Unit matrix, shape (3, 3).
  pure function identity() result(e)
    real(dp) :: e(3, 3)

    e = reshape([1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp], [3, 3])
  end function identity

end module gestell_math_rotation
