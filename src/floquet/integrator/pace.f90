!> Estimates the frequency of the fastest motion of a system, equation (60) of doc/theory.md.
!>
!> A motion u exp(z t) satisfies M z^2 u + B z u + C u = 0, and so z^2 + 2 d z + k = 0 with scalars d and k. The fastest motion
!> has the largest k and therefore dominates (M^-1 C)^16. This power is computed at the phase at which C is largest. Take the
!> column and the row of the power that contain its largest diagonal element: the column is the shape u, the row times M^-1 is
!> the left vector y. At other phases the shape differs from u. Two-sided Rayleigh quotients with u and y still have only an
!> error of the order of the product of the errors of u and y (A. M. Ostrowski, Arch. Rational Mech. Anal. 3 (1959), 325):
!>
!>     k = y C u / y M u,   2 d = y B u / y M u,   w^2 = -Re z^2 = k - 2 d^2.
!>
!> For a system without positions, x' = P x, the vectors u and y are a column and a row of P^16, to which both conjugate motions
!> z contribute. So t_j = y P^j u satisfies t_j+2 = 2 Re z t_j+1 - |z|^2 t_j. Two equations of this form give Re z and |z|^2, and
!> w^2 = |z|^2 - 2 (Re z)^2.
!>
!> In a step of length h a method with s stages has a phase error c (w h)^(2 s + 1). If the method is fitted to a motion of
!> frequency v (gestell_floquet_integrator_tableau), its phase error is nearly c (w h)^(2 s - 1) (w^2 - v^2) h^2. The sum of
!> these errors over the steps is zero for
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

  !> Angular frequency v (radians per unit of time) to which the steps are fitted, assuming eight stages. It is computed from the
  !> coefficients at the first node of each step. Zero if the motion does not oscillate or cannot be determined.
  pure real(dp) function pace_of(at) result(pace)
    type(coefficients_type), intent(in) :: at
    real(dp), dimension(size(at%lengths)) :: square, weight
    real(dp) :: maximum

    if (at%positions > 0) then
      call square_with_positions(at, square)
    else
      call square_of(at%b(:size(at%lengths), :, :), square)
    end if
    pace = 0
    where (.not. abs(square) <= huge(maximum)) square = 0
    maximum = maxval(square)
    if (.not. maximum > 0) return
    square = max(square / maximum, 0.0_dp)
    ! `square` is w^2, so w^15 is its power of 7.5.
    weight = square**7 * sqrt(square)
    pace = sqrt(maximum * sum(weight * square) / sum(weight))
  end function pace_of

  !> Computes w^2, the square of the angular frequency of the fastest motion, in every step. It is zero where M is singular, or
  !> where circulatory forces merge two motions into one that grows.
  pure subroutine square_with_positions(at, square)
    type(coefficients_type), intent(in) :: at
    real(dp), intent(out) :: square(:)
    real(dp), parameter :: least = 1.0e-6_dp
    ! [M C E], later M^-1 C; first index as in `sixteenth_power`
    real(dp) :: table(padded_rows(at%f), 3 * at%f)
    real(dp), dimension(at%f) :: y, after, before
    real(dp), dimension(padded_rows(at%f), at%f) :: a, power
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
    call sixteenth_power(power)
    k = position_of_largest(power)
    ! Column u and row y are tested for a complex conjugate pair of k.
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
    ! Zero where y M u vanishes: the quotients are then undetermined.
    where (abs(of_mass) > least * maxval(abs(of_mass)))
      square = square / of_mass - (damping / of_mass)**2 / 2
    else where
      square = 0
    end where
  end subroutine square_with_positions

  !> Computes p and q such that both motions z of a pair satisfy z^2 = p z - q. `t_0` to `t_3` are the numbers t_j = y A^j u.
  !> Each is a sum over both motions, so that t_j+2 = p t_j+1 - q t_j. Returns zeros if one motion dominates the sum.
  elemental subroutine find_pair(t_0, t_1, t_2, t_3, p, q)
    real(dp), intent(in) :: t_0, t_1, t_2, t_3
    real(dp), intent(out) :: p, q
    !> Smallest accepted determinant, relative to its terms. A decaying motion whose phase advances by a ten-thousandth of a
    !> radian has this determinant
    real(dp), parameter :: least = 1.0e-8_dp
    real(dp) :: det

    det = t_0 * t_2 - t_1**2
    p = 0
    q = 0
    if (.not. abs(det) > least * (abs(t_0 * t_2) + t_1**2)) return
    p = (t_0 * t_3 - t_1 * t_2) / det
    q = (t_1 * t_3 - t_2**2) / det
  end subroutine find_pair

  !> Computes w^2, the square of the angular frequency of the fastest motion, in every step of a system without positions. `b` is
  !> -P. The result is zero in steps in which a motion that does not oscillate dominates.
  pure subroutine square_of(b, square)
    real(dp), intent(in) :: b(:, :, :)
    real(dp), intent(out) :: square(:)
    real(dp) :: power(padded_rows(size(b, 2)), size(b, 2))
    ! y P, P u and P P u
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
    call sixteenth_power(power)
    k = position_of_largest(power)
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

  !> Index of the diagonal element with the largest absolute value.
  pure integer function position_of_largest(a) result(place)
    real(dp), intent(in) :: a(:, :)
    integer :: i

    place = 1
    do i = 2, size(a, 2)
      if (abs(a(i, i)) > abs(a(place, place))) place = i
    end do
  end function position_of_largest

  !> Number of rows rounded up to a multiple of `lanes`, so that loops can process `lanes` rows at a time. The additional rows are
  !> zero.
  pure integer function padded_rows(rows)
    integer, intent(in) :: rows

    padded_rows = lanes * ((rows + lanes - 1) / lanes)
  end function padded_rows

  !> Performs Gauss-Jordan elimination on [M X], which has `n` rows followed by rows of zeros. Afterwards row `rows(k)` of `table`
  !> contains row k of M^-1 X. Instead of exchanging rows in memory, which would delay the loops, the procedure records their order
  !> in `rows`.
  pure subroutine eliminate(table, n, rows, singular)
    real(dp), contiguous, intent(inout) :: table(:, :)
    integer, intent(in) :: n
    integer, intent(out) :: rows(n)
    logical, intent(out) :: singular
    real(dp) :: factor(size(table, 1)), maximum, kept
    logical :: free(n)
    integer :: pivot, i, j, k

    free = .true.
    do k = 1, n
      maximum = 0
      do i = 1, n
        if (.not. (free(i) .and. abs(table(i, k)) > maximum)) cycle
        maximum = abs(table(i, k))
        pivot = i
      end do
      singular = .not. maximum > 0
      if (singular) return
      rows(k) = pivot
      free(pivot) = .false.
      factor = table(:, k) / table(pivot, k)
      ! With this factor the update divides the pivot row by its pivot.
      factor(pivot) = 1 - 1 / table(pivot, k)
      do j = k + 1, size(table, 2)
        kept = table(pivot, j)
        do i = 1, size(table, 1), lanes
          table(i:i + lanes - 1, j) = table(i:i + lanes - 1, j) - kept * factor(i:i + lanes - 1)
        end do
      end do
    end do
  end subroutine eliminate

  !> Replaces A by A^16, scaled to a norm of 1.
  pure subroutine sixteenth_power(a)
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
  end subroutine sixteenth_power

end module gestell_floquet_integrator_pace
