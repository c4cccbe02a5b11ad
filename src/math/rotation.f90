!> Rotations in space, described by a rotation vector theta (rad) with a = |theta|:
!>
!>     R = exp([theta]) = 1 + s_1 [theta] + s_2 [theta]^2,   s_1 = sin(a)/a,  s_2 = (1 - cos a)/a^2,
!>
!> where [theta] x is the cross product of theta and x. The angular velocity in the rotating axes is w = T theta' with
!>
!>     T = 1 - s_2 [theta] + s_3 [theta]^2,   s_3 = (a - sin a)/a^3.
!>
!> The s_k are entire functions of a^2: s_k = sum over n of (-a^2)^n / (2 n + k)! (A. Mueller, Applied Mechanics Reviews 73, 2021,
!> 010803, doi 10.1115/1.4047987).
module gestell_math_rotation
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: cross, cross_matrix, identity, outer, rotation_less_one, rotation_matrix, turn_beyond_first_order, &
    & turning_less_one, turning_matrices

contains

  !> Cross product of a and b.
  pure function cross(a, b)
    real(dp), intent(in) :: a(3), b(3)
    real(dp) :: cross(3)

    cross = [a(2) * b(3) - a(3) * b(2), a(3) * b(1) - a(1) * b(3), a(1) * b(2) - a(2) * b(1)]
  end function cross

  !> [a], the matrix of the cross product: [a] b = a x b for every vector b.
  pure function cross_matrix(a) result(c)
    real(dp), intent(in) :: a(3)
    real(dp) :: c(3, 3)

    c = reshape([0.0_dp, a(3), -a(2), -a(3), 0.0_dp, a(1), a(2), -a(1), 0.0_dp], [3, 3])
  end function cross_matrix

  !> Outer product a b^T.
  pure function outer(a, b)
    real(dp), intent(in) :: a(:), b(:)
    real(dp) :: outer(size(a), size(b))

    outer = spread(a, 2, size(b)) * spread(b, 1, size(a))
  end function outer

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
    real(dp) :: r(3, 3), s(3, 0:2), c(3, 3)

    s = coefficients(dot_product(theta, theta))
    c = cross_matrix(theta)
    r = s(1, 0) * c + s(2, 0) * matmul(c, c)
  end function rotation_less_one

  !> R - 1 - [theta], the terms of second and higher order of the rotation matrix R, and its first and second time derivatives;
  !> shape (3, 3, 0:2). [theta] x is the cross product of theta and x. `theta` contains theta, theta', theta'', shape (3, 0:2).
  !> With the angular velocity w, the derivatives of R are R' = R [w], R'' = R ([w]^2 + [w']).
  pure function turn_beyond_first_order(theta) result(beyond)
    real(dp), intent(in) :: theta(3, 0:2)
    real(dp) :: beyond(3, 3, 0:2), s(3, 0:2), t(3, 3, 0:2), r(3, 3), c(3, 3), spin(3, 3), w_d(3)

    s = coefficients(dot_product(theta(:, 0), theta(:, 0)))
    t = turning_matrices(theta)
    c = cross_matrix(theta(:, 0))
    r = rotation_matrix(theta(:, 0))
    spin = cross_matrix(matmul(t(:, :, 0), theta(:, 1)))
    w_d = matmul(t(:, :, 0), theta(:, 2)) + matmul(t(:, :, 1), theta(:, 1))
    ! 1 - s_1 = a^2 s_3
    beyond(:, :, 0) = s(2, 0) * matmul(c, c) - s(3, 0) * dot_product(theta(:, 0), theta(:, 0)) * c
    beyond(:, :, 1) = matmul(r, spin) - cross_matrix(theta(:, 1))
    beyond(:, :, 2) = matmul(r, matmul(spin, spin) + cross_matrix(w_d)) - cross_matrix(theta(:, 2))
  end function turn_beyond_first_order

  !> The matrix T, which gives the angular velocity w = T theta', and its first and second time derivatives, shape (3, 3, 0:2).
  !> `theta` contains theta, theta', theta'', shape (3, 0:2).
  pure function turning_matrices(theta) result(t)
    real(dp), intent(in) :: theta(:, 0:)
    real(dp) :: t(3, 3, 0:2), s(3, 0:2), f(2:3, 0:2), c(3, 3, 0:2), cc(3, 3, 0:2), x_d, x_dd
    integer :: k

    s = coefficients(dot_product(theta(:, 0), theta(:, 0)))
    x_d = 2 * dot_product(theta(:, 0), theta(:, 1))
    x_dd = 2 * (dot_product(theta(:, 1), theta(:, 1)) + dot_product(theta(:, 0), theta(:, 2)))
    f(:, 0) = s(2:3, 0)
    f(:, 1) = s(2:3, 1) * x_d
    f(:, 2) = s(2:3, 2) * x_d**2 + s(2:3, 1) * x_dd
    do k = 0, 2
      c(:, :, k) = cross_matrix(theta(:, k))
    end do
    cc(:, :, 0) = matmul(c(:, :, 0), c(:, :, 0))
    cc(:, :, 1) = matmul(c(:, :, 1), c(:, :, 0)) + matmul(c(:, :, 0), c(:, :, 1))
    cc(:, :, 2) = matmul(c(:, :, 2), c(:, :, 0)) + 2 * matmul(c(:, :, 1), c(:, :, 1)) + matmul(c(:, :, 0), c(:, :, 2))
    t(:, :, 0) = identity() - f(2, 0) * c(:, :, 0) + f(3, 0) * cc(:, :, 0)
    t(:, :, 1) = -f(2, 1) * c(:, :, 0) - f(2, 0) * c(:, :, 1) + f(3, 1) * cc(:, :, 0) + f(3, 0) * cc(:, :, 1)
    t(:, :, 2) = -f(2, 2) * c(:, :, 0) - 2 * f(2, 1) * c(:, :, 1) - f(2, 0) * c(:, :, 2) &
      & + f(3, 2) * cc(:, :, 0) + 2 * f(3, 1) * cc(:, :, 1) + f(3, 0) * cc(:, :, 2)
  end function turning_matrices

  !> T - 1, shape (3, 3), where w = T theta' is the angular velocity. It is computed without loss of digits for small rotations.
  pure function turning_less_one(theta) result(t)
    real(dp), intent(in) :: theta(3)
    real(dp) :: t(3, 3), s(3, 0:2), c(3, 3)

    s = coefficients(dot_product(theta, theta))
    c = cross_matrix(theta)
    t = s(3, 0) * matmul(c, c) - s(2, 0) * c
  end function turning_less_one

  !> Coefficients s_1, s_2, s_3 of the matrices R and T in the module's header, and their first and second derivatives with
  !> respect to x = a^2, where a is the angle of rotation; shape (3, 0:2). They are computed by their series, which has enough
  !> terms for a few radians, more than any frame rotates. Up to one radian ten terms are sufficient.
  pure function coefficients(x) result(s)
    real(dp), intent(in) :: x
    real(dp) :: s(3, 0:2)
    integer, parameter :: most = 24, few = 10
    integer :: k, n
    real(dp), parameter :: terms(3, 0:most) = reshape([(((-1)**n / gamma(real(2 * n + k + 1, dp)), k = 1, 3), n = 0, most)], &
      & [3, most + 1])

    s = 0
    ! Horner's rule for the series and its derivatives
    do n = merge(few, most, x <= 1), 0, -1
      s(:, 2) = s(:, 2) * x + 2 * s(:, 1)
      s(:, 1) = s(:, 1) * x + s(:, 0)
      s(:, 0) = s(:, 0) * x + terms(:, n)
    end do
  end function coefficients

  !> Unit matrix, shape (3, 3).
  pure function identity() result(e)
    real(dp) :: e(3, 3)

    e = reshape([1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp], [3, 3])
  end function identity

end module gestell_math_rotation
