!> How fast the fastest motion of a system turns.
!>
!> In z^2 + 2 d z + k = 0, M z^2 u + B z u + C u = 0, it is the motion of the greatest k: where C is greatest (M^-1 C)^16 is little
!> but that one. One of its columns is the shape u, one of its rows, times M^-1, what the equations are to be multiplied with, y,
!> those of the greatest entry on the diagonal, as the sum of these is not small. At other phases the shape is another, but by
!> two-sided Rayleigh quotients with these two the frequency is wrong by the product of what both miss only (A. M. Ostrowski, Arch.
!> Rational Mech. Anal. 3 (1959), 325):
!>
!>     k = y C u / y M u,   2 d = y B u / y M u,   w^2 = -Re z^2 = k - 2 d^2.
!>
!> Without positions, x' = P x, u and y are a column and a row of P^16, which the conjugate motions z share. So the t_j = y P^j u
!> obey t_j+2 = 2 Re z t_j+1 - |z|^2 t_j: two equations for both, and w^2 = |z|^2 - 2 (Re z)^2. In a step of length h a method with
!> s stages leaves a phase error c (w h)^(2 s + 1), one that is fitted to a motion of frequency v
!> (gestell_floquet_integrator_tableau) nearly c (w h)^(2 s - 1) (w^2 - v^2) h^2. In a sum over steps nothing is left of these
!> where
!>
!>     v^2 = sum of w^(2 s + 1) / sum of w^(2 s - 1).
module gestell_floquet_integrator_pace
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_floquet_integrator_step_coefficients, only: coefficients_type
  implicit none (type, external)
  private

  public :: pace_of

contains

  !> v, radians in the unit of time, for eight stages, from the coefficients in the first node of each step; 0: the motion does not
  !> turn, or there is no telling.
  pure real(dp) function pace_of(at) result(pace)
    type(coefficients_type), intent(in) :: at
    real(dp), dimension(size(at%lengths)) :: square, weight
    real(dp) :: greatest

    if (at%positions > 0) then
      call square_with_positions(at, square)
    else
      call square_of(at%b(:size(at%lengths), :, :), square)
    end if
    pace = 0
    where (.not. abs(square) <= huge(greatest)) square = 0
    greatest = maxval(square)
    if (.not. greatest > 0) return
    square = max(square / greatest, 0.0_dp)
    ! Of the squares the powers are halves.
    weight = square**7 * sqrt(square)
    pace = sqrt(greatest * sum(weight * square) / sum(weight))
  end function pace_of

  !> w^2 at every step; zero where M is singular, and where forces that circulate make of two motions one that grows.
  pure subroutine square_with_positions(at, square)
    type(coefficients_type), intent(in) :: at
    real(dp), intent(out) :: square(:)
    real(dp), parameter :: least = 1.0e-6_dp
    ! [M C E], and M^-1 C; columns as `high_power` has them.
    real(dp) :: table(full(at%f), 3 * at%f)
    real(dp), dimension(at%f) :: y, after, before
    real(dp), dimension(full(at%f), at%f) :: a, power
    real(dp), dimension(size(square)) :: of_mass, damping
    real(dp) :: both, p, q
    logical :: singular
    integer :: rows(at%f), f, last, point, k, i, j

    f = at%f
    last = size(square)
    square = 0
    do i = 1, f
      square = square + at%c(:last, i, i)
    end do
    point = maxloc(square, dim=1)
    square = 0
    table = 0
    do j = 1, f
      table(:f, j) = at%m(point, :, j)
      table(:f, f + j) = at%c(point, :, j)
      table(j, 2 * f + j) = 1
    end do
    call eliminate(table, f, rows, singular)
    if (singular) return
    a = 0
    do j = 1, f
      a(:f, j) = table(rows, f + j)
    end do
    power = a
    call high_power(power)
    k = place_of_greatest(power)
    ! A column u and a row y of a conjugate pair.
    after = matmul(a(:f, :), power(:f, k))
    before = matmul(power(k, :), a(:f, :))
    call find_pair(dot_product(power(k, :), power(:f, k)), dot_product(power(k, :), after), dot_product(before, after), &
      & dot_product(before, matmul(a(:f, :), after)), p, q)
    if (p**2 < 4 * q) return
    do i = 1, f
      y(i) = dot_product(power(k, :), table(rows, 2 * f + i))
    end do
    of_mass = 0
    damping = 0
    do j = 1, f
      do i = 1, f
        both = y(i) * power(j, k)
        of_mass = of_mass + both * at%m(:last, i, j)
        damping = damping + both * at%b(:last, i, j)
        square = square + both * at%c(:last, i, j)
      end do
    end do
    ! Where y M u vanishes, by chance or as C does, there is no telling.
    where (abs(of_mass) > least * maxval(abs(of_mass)))
      square = square / of_mass - (damping / of_mass)**2 / 2
    else where
      square = 0
    end where
  end subroutine square_with_positions

  !> z^2 = p z - q of the two motions z of which t_j = y A^j u is a sum: t_j+2 = p t_j+1 - q t_j. Zeros: it is little but one.
  elemental subroutine find_pair(t_0, t_1, t_2, t_3, p, q)
    real(dp), intent(in) :: t_0, t_1, t_2, t_3
    real(dp), intent(out) :: p, q
    !> What the determinant is of its terms where a motion turns by a ten thousandth of a radian while it decays.
    real(dp), parameter :: least = 1.0e-8_dp
    real(dp) :: det

    det = t_0 * t_2 - t_1**2
    p = 0
    q = 0
    if (.not. abs(det) > least * (abs(t_0 * t_2) + t_1**2)) return
    p = (t_0 * t_3 - t_1 * t_2) / det
    q = (t_1 * t_3 - t_2**2) / det
  end subroutine find_pair

  !> The same from B = -P; zero where u is little but one motion that does not turn.
  pure subroutine square_of(b, square)
    real(dp), intent(in) :: b(:, :, :)
    real(dp), intent(out) :: square(:)
    real(dp) :: power(full(size(b, 2)), size(b, 2))
    ! y P, P u and P P u.
    real(dp), dimension(size(square), size(b, 2)) :: before, after, twice
    real(dp), dimension(size(square)) :: p, q
    integer :: n, k, i, j

    n = size(b, 2)
    square = 0
    do j = 1, n
      do i = 1, n
        square = square + b(:, i, j)**2
      end do
    end do
    power = 0
    power(:n, :) = b(maxloc(square, dim=1), :, :)
    call high_power(power)
    k = place_of_greatest(power)
    before = 0
    after = 0
    do j = 1, n
      do i = 1, n
        before(:, j) = before(:, j) - power(k, i) * b(:, i, j)
        after(:, i) = after(:, i) - b(:, i, j) * power(j, k)
      end do
    end do
    twice = 0
    do j = 1, n
      do i = 1, n
        twice(:, i) = twice(:, i) - b(:, i, j) * after(:, j)
      end do
    end do
    call find_pair(dot_product(power(k, :), power(:n, k)), matmul(after, power(k, :)), sum(before * after, dim=2), &
      & sum(before * twice, dim=2), p, q)
    square = q - p**2 / 2
  end subroutine square_of

  !> The place on the diagonal.
  pure integer function place_of_greatest(a) result(place)
    real(dp), intent(in) :: a(:, :)
    integer :: i

    place = 1
    do i = 2, size(a, 2)
      if (abs(a(i, i)) > abs(a(place, place))) place = i
    end do
  end function place_of_greatest

  !> Rows of so many that count with rows of zeros below them, which are worked on lanes at a time.
  pure integer function full(rows)
    integer, intent(in) :: rows

    full = lanes * ((rows + lanes - 1) / lanes)
  end function full

  !> [M X], with `n` rows that count, becomes [. Y]: Gauss and Jordan's elimination, where row `rows(k)` ends as the row k of
  !> M^-1 X. (Rows that are exchanged would have to be waited for.)
  pure subroutine eliminate(table, n, rows, singular)
    real(dp), contiguous, intent(inout) :: table(:, :)
    integer, intent(in) :: n
    integer, intent(out) :: rows(n)
    logical, intent(out) :: singular
    real(dp) :: factor(size(table, 1)), greatest, kept
    logical :: free(n)
    integer :: pivot, i, j, k

    free = .true.
    do k = 1, n
      greatest = 0
      do i = 1, n
        if (.not. (free(i) .and. abs(table(i, k)) > greatest)) cycle
        greatest = abs(table(i, k))
        pivot = i
      end do
      singular = .not. greatest > 0
      if (singular) return
      rows(k) = pivot
      free(pivot) = .false.
      factor = table(:, k) / table(pivot, k)
      ! Of the row itself its division leaves that.
      factor(pivot) = 1 - 1 / table(pivot, k)
      do j = k + 1, size(table, 2)
        kept = table(pivot, j)
        do i = 1, size(table, 1), lanes
          table(i:i + lanes - 1, j) = table(i:i + lanes - 1, j) - kept * factor(i:i + lanes - 1)
        end do
      end do
    end do
  end subroutine eliminate

  !> A^16 in the place of A, in a unit that is near its norm.
  pure subroutine high_power(a)
    real(dp), contiguous, intent(inout) :: a(:, :)
    real(dp) :: square(size(a, 1), size(a, 2)), sums(lanes), norm
    integer :: squaring, i, j, k

    do squaring = 0, 4
      norm = tiny(norm)
      do i = 1, size(a, 1), lanes
        sums = 0
        do j = 1, size(a, 2)
          sums = sums + abs(a(i:i + lanes - 1, j))
        end do
        norm = max(norm, maxval(sums))
      end do
      a = a / norm
      if (squaring == 4) return
      do j = 1, size(a, 2)
        do i = 1, size(a, 1), lanes
          sums = 0
          do k = 1, size(a, 2)
            sums = sums + a(i:i + lanes - 1, k) * a(k, j)
          end do
          square(i:i + lanes - 1, j) = sums
        end do
      end do
      a = square
    end do
  end subroutine high_power

end module gestell_floquet_integrator_pace
