!> How fast the fastest motion of a system turns.
!>
!> In z^2 + 2 d z + k = 0, M z^2 u + B z u + C u = 0, it is the motion of the greatest k: where C is greatest (M^-1 C)^16 is little
!> but that one. One of its columns is the shape u, one of its rows, times M^-1, what the equations are to be multiplied with, y. At
!> other phases the shape is another, but by two-sided Rayleigh quotients with these two the frequency is wrong by the product of
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
  use gestell_math_lapack, only: factorise, solve_factored, solve_transposed
  implicit none (type, external)
  private

  public :: pace_of

contains

  !> v, radians in the unit of time, for eight stages, from the coefficients in one node of some steps; 0: the motion does not turn,
  !> or there is no telling.
  real(dp) function pace_of(at) result(pace)
    type(coefficients_type), intent(in) :: at
    !> Steps that are enough.
    integer, parameter :: enough = 16
    real(dp), allocatable :: square(:), weight(:)
    real(dp) :: greatest
    integer :: every

    ! The first node of each step comes first.
    every = max(1, size(at%lengths) / enough)
    associate (points => (size(at%lengths) - 1) / every + 1)
      allocate(square(points), weight(points))
    end associate
    if (at%positions > 0) then
      call square_with_positions(at, every, square)
    else
      call square_of(at%b(:size(at%lengths):every, :, :), square)
    end if
    pace = 0
    greatest = maxval(square)
    if (.not. (greatest > 0 .and. greatest <= huge(greatest))) return
    square = max(square / greatest, 0.0_dp)
    ! Of the squares the powers are halves.
    weight = square**7 * sqrt(square)
    pace = sqrt(greatest * sum(weight * square) / sum(weight))
  end function pace_of

  !> w^2 at every so many steps; zero where M is singular.
  subroutine square_with_positions(at, every, square)
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: every
    real(dp), intent(out) :: square(:)
    real(dp), dimension(at%f, at%f) :: mass, power
    real(dp) :: y(at%f, 1)
    real(dp), dimension(size(square)) :: of_mass, damping
    type(error_type), allocatable :: singular
    integer :: pivots(at%f), last, point, row, column, i, j

    last = size(at%lengths)
    square = 0
    do i = 1, at%f
      square = square + at%c(:last:every, i, i)
    end do
    point = 1 + every * (maxloc(square, dim=1) - 1)
    mass = at%m(point, :, :)
    power = at%c(point, :, :)
    square = 0
    call factorise(mass, pivots, singular)
    if (allocated(singular)) return
    call solve_factored(mass, pivots, power)
    power = high_power(power)
    row = 1
    column = 1
    do j = 1, at%f
      do i = 1, at%f
        if (.not. abs(power(i, j)) > abs(power(row, column))) cycle
        row = i
        column = j
      end do
    end do
    y(:, 1) = power(row, :)
    call solve_transposed(mass, pivots, y)
    of_mass = 0
    damping = 0
    do j = 1, at%f
      do i = 1, at%f
        of_mass = of_mass + y(i, 1) * power(j, column) * at%m(:last:every, i, j)
        damping = damping + y(i, 1) * power(j, column) * at%b(:last:every, i, j)
        square = square + y(i, 1) * power(j, column) * at%c(:last:every, i, j)
      end do
    end do
    square = square / of_mass - (damping / of_mass)**2 / 2
  end subroutine square_with_positions

  !> The same from B = -P.
  pure subroutine square_of(b, square)
    real(dp), intent(in) :: b(:, :, :)
    real(dp), intent(out) :: square(:)
    real(dp) :: power(size(b, 2), size(b, 2))
    real(dp), dimension(size(square)) :: before, after
    integer :: n, k, i, j

    n = size(b, 2)
    power = high_power(b(point_of_greatest(b), :, :))
    k = 1
    do i = 2, n
      if (abs(power(i, i)) > abs(power(k, k))) k = i
    end do
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
    real(dp), intent(in) :: a(:, :, :)
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

  !> A^16, in a unit that is near its norm.
  pure function high_power(a) result(power)
    real(dp), intent(in) :: a(:, :)
    real(dp) :: power(size(a, 1), size(a, 1)), square(size(a, 1), size(a, 1)), unit
    integer :: squaring, j, k

    power = a
    do squaring = 0, 4
      unit = 1 / max(sum(abs(power)), tiny(unit))
      power = power * unit
      if (squaring == 4) return
      square = 0
      do j = 1, size(a, 1)
        do k = 1, size(a, 1)
          square(:, j) = square(:, j) + power(:, k) * power(k, j)
        end do
      end do
      power = square
    end do
  end function high_power

end module gestell_floquet_integrator_pace
