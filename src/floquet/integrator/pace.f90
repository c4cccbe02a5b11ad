!> How fast the fastest motion of a system turns.
!>
!> In z^2 + 2 d z + k = 0, M z^2 u + B z u + C u = 0, it is the motion of the greatest k: where C is greatest (M^-1 C)^16 is little
!> but that one. One of its columns, u, is the shape, one of its rows times M^-1, y, what the equations have to be multiplied with.
!> At other phases the shape is another, but by two-sided Rayleigh quotients with u and y the frequency is wrong by the product of
!> what both miss only (A. M. Ostrowski, Arch. Rational Mech. Anal. 3 (1959), 325):
!>
!>     k = y C u / y M u,   2 d = y B u / y M u,   w^2 = -Re z^2 = k - 2 d^2.
!>
!> Without positions, x' = P x, u and y are a column and a row of P^16, and w^2 = -y P P u / y u. In a step of length h a method
!> with s stages leaves a phase error c (w h)^(2 s + 1), one that is fitted to a motion of frequency v
!> (gestell_floquet_integrator_tableau) nearly c (w h)^(2 s - 1) (w^2 - v^2) h^2. In a sum over steps nothing is left of these where
!>
!>     v^2 = sum of w^(2 s + 1) / sum of w^(2 s - 1).
module gestell_floquet_integrator_pace
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_step_coefficients, only: coefficients_type
  use gestell_math_lapack, only: factorise, solve_factored
  use gestell_math_matrix, only: unit_matrix
  implicit none (type, external)
  private

  public :: pace_of

contains

  !> v, radians in the unit of time, for eight stages, from the coefficients at many points; 0: the motion does not turn, or there
  !> is no telling.
  real(dp) function pace_of(at) result(pace)
    type(coefficients_type), intent(in) :: at
    real(dp), dimension(size(at%b, 1)) :: square, weight
    real(dp) :: greatest

    if (at%positions > 0) then
      call square_with_positions(at, square)
    else
      call square_of(at%b, square)
    end if
    pace = 0
    greatest = maxval(square)
    if (.not. (greatest > 0 .and. greatest <= huge(greatest))) return
    square = max(square / greatest, 0.0_dp)
    ! Of the squares the powers are halves.
    weight = square**7 * sqrt(square)
    pace = sqrt(greatest * sum(weight * square) / sum(weight))
  end function pace_of

  !> w^2 at each point; zero where M is singular.
  subroutine square_with_positions(at, square)
    type(coefficients_type), intent(in) :: at
    real(dp), intent(out) :: square(:)
    real(dp) :: mass(at%f, at%f), right(at%f, 2 * at%f), power(at%f, at%f), y(at%f), u(at%f)
    real(dp), dimension(size(square)) :: of_mass, damping
    type(error_type), allocatable :: singular
    integer :: pivots(at%f), point, place(2), i, j

    point = point_of_greatest(at%c)
    mass = at%m(point, :, :)
    right(:, :at%f) = at%c(point, :, :)
    right(:, at%f + 1:) = unit_matrix(at%f)
    square = 0
    call factorise(mass, pivots, singular)
    if (allocated(singular)) return
    call solve_factored(mass, pivots, right)
    power = high_power(right(:, :at%f), 4)
    place = maxloc(abs(power))
    u = power(:, place(2))
    do i = 1, at%f
      y(i) = dot_product(power(place(1), :), right(:, at%f + i))
    end do
    of_mass = 0
    damping = 0
    do j = 1, at%f
      do i = 1, at%f
        of_mass = of_mass + y(i) * u(j) * at%m(:, i, j)
        damping = damping + y(i) * u(j) * at%b(:, i, j)
        square = square + y(i) * u(j) * at%c(:, i, j)
      end do
    end do
    square = square / of_mass - (damping / of_mass)**2 / 2
  end subroutine square_with_positions

  !> The same from B = -P.
  pure subroutine square_of(b, square)
    real(dp), contiguous, intent(in) :: b(:, :, :)
    real(dp), intent(out) :: square(:)
    real(dp) :: power(size(b, 2), size(b, 2))
    real(dp), dimension(size(square)) :: before, after
    integer :: n, k, i, j

    n = size(b, 2)
    power = high_power(b(point_of_greatest(b), :, :), 4)
    k = maxloc(abs([(power(i, i), i = 1, n)]), dim=1)
    square = 0
    do j = 1, n
      before = 0
      after = 0
      do i = 1, n
        before = before + power(k, i) * b(:, i, j)
        after = after + b(:, j, i) * power(i, k)
      end do
      square = square - before * after
    end do
    square = square / dot_product(power(k, :), power(:, k))
  end subroutine square_of

  pure integer function point_of_greatest(a) result(point)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp) :: squares(size(a, 1))
    integer :: i, j

    squares = 0
    do j = 1, size(a, 3)
      do i = 1, size(a, 2)
        squares = squares + a(:, i, j)**2
      end do
    end do
    point = maxloc(squares, dim=1)
  end function point_of_greatest

  !> A^(2^squarings), each square in a unit that is its norm.
  pure function high_power(a, squarings) result(power)
    real(dp), intent(in) :: a(:, :)
    integer, intent(in) :: squarings
    real(dp) :: power(size(a, 1), size(a, 1))
    integer :: k

    power = a / max(norm2(a), tiny(1.0_dp))
    do k = 1, squarings
      power = matmul(power, power)
      power = power / max(norm2(power), tiny(1.0_dp))
    end do
  end function high_power

end module gestell_floquet_integrator_pace
