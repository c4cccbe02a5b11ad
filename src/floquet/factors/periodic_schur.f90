!> Computes the periodic Schur form of a sequence of matrices. It gives the eigenvalues of the product of the matrices without
!> multiplying them.
module gestell_floquet_factors_periodic_schur
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_floquet_factors_rotations, only: propagate_vector, normalise, rotate, rotate_columns, rotate_rows, find_swap, unit
  use gestell_math_matrix, only: unit_matrix
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: periodic_schur, periodic_multipliers

contains

  !> Computes the periodic Schur form of the product A_K ... A_1: unitary Q_1, ..., Q_K such that Q_{k+1}^H A_k Q_k = R_k is
  !> upper triangular, with Q_{K+1} = Q_1. All shapes are (n, n, K). The multipliers prod_k R_k(i, i) are sorted by descending
  !> modulus as far as roundoff permits.
  !>
  !> The method is the complex periodic QR algorithm (Bojanczyk, Golub and Van Dooren 1992; Kressner, BIT 41 (2001) 736). It
  !> reduces A_K to Hessenberg form and the other factors to triangular form, then applies sweeps with one implicit shift each.
  !> The error of each factor is of the order of roundoff times its norm, even if the elements of the product differ by many
  !> orders of magnitude. Zeros on the diagonals need no special treatment: a sweep without shift moves a zero to the last
  !> position, where the next sweep separates it. Fails if a factor is not finite or the sweeps do not converge.
  pure subroutine periodic_schur(factors, q, r, error)
    !> Factors A_k
    complex(dp), intent(in) :: factors(:, :, :)
    !> Unitary Q_k and triangular R_k
    complex(dp), intent(out) :: q(:, :, :), r(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    complex(dp) :: flat(size(factors, 1)**2)
    integer :: exponents(size(factors, 3)), n, k

    if (.not. all(ieee_is_finite(real(factors)) .and. ieee_is_finite(aimag(factors)))) then
      call fatal_error(error, "a factor of the monodromy matrix contains numbers that are not finite", failed_computation)
      return
    end if
    n = size(factors, 1)
    exponents = 0
    do k = 1, size(factors, 3)
      flat = reshape(factors(:, :, k), [n**2])
      call normalise(flat, exponents(k))
      r(:, :, k) = reshape(flat, [n, n])
    end do
    call reduce(r, q)
    call iterate(r, q, error)
    if (allocated(error)) return
    call order(r, q)
    do k = 1, size(factors, 3)
      r(:, :, k) = r(:, :, k) * scale(1.0_dp, exponents(k) / 2) * scale(1.0_dp, exponents(k) - exponents(k) / 2)
    end do
  end subroutine periodic_schur

  !> Computes ln |rho_i| and the argument, in (-pi, pi], of rho_i = prod_k R_k(i, i), without underflow or overflow; shapes (n). For
  !> a zero multiplier `log_abs` is the logarithm of the smallest positive number.
  pure subroutine periodic_multipliers(r, log_abs, arg)
    complex(dp), intent(in) :: r(:, :, :)
    real(dp), intent(out) :: log_abs(:), arg(:)
    complex(dp) :: rho(1)
    integer :: i, k, exponents

    do i = 1, size(r, 1)
      rho = 1
      exponents = 0
      do k = 1, size(r, 3)
        rho = rho * r(i, i, k)
        call normalise(rho, exponents)
      end do
      log_abs(i) = log(max(abs(rho(1)), tiny(1.0_dp))) + exponents * log(2.0_dp)
      arg(i) = atan2(aimag(rho(1)), real(rho(1)))
    end do
  end subroutine periodic_multipliers

  !> Reduces the factors `r` in place: R_1, ..., R_{K-1} to triangular form and R_K to upper Hessenberg form. `q` contains the
  !> unitary matrices of the reduction.
  pure subroutine reduce(r, q)
    complex(dp), intent(inout) :: r(:, :, :)
    complex(dp), intent(out) :: q(:, :, :)
    complex(dp) :: v(2, size(r, 3))
    integer :: n, last, i, j, k

    n = size(r, 1)
    last = size(r, 3)
    q = spread(cmplx(unit_matrix(n), 0, dp), 3, last)
    do k = 1, last
      if (k > 1) r(:, :, k) = matmul(r(:, :, k), q(:, :, k))
      if (k == last) exit
      do j = 1, n - 1
        do i = n - 1, j, -1
          v(:, 1) = unit(r(i:i + 1, j, k))
          call rotate_rows(r(i:i + 1, j:, k), v(:, 1))
          r(i + 1, j, k) = 0
          call rotate_columns(q(:, i:i + 1, k + 1), v(:, 1))
        end do
      end do
    end do
    do j = 1, n - 2
      do i = n - 1, j + 1, -1
        v(:, 1) = unit(r(i:i + 1, j, last))
        call propagate_vector(r, i, v)
        call rotate(r, q, i, v, left=j, bottom=n)
        r(i + 1, j, last) = 0
      end do
    end do
  end subroutine reduce

  !> Applies QR sweeps to the periodic sequence until R_K is triangular.
  pure subroutine iterate(r, q, error)
    complex(dp), intent(inout) :: r(:, :, :), q(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most = 300, patience = 20
    integer :: low, high, sweeps

    high = size(r, 1)
    sweeps = 0
    do while (high > 1)
      low = block_start(r(:, :, size(r, 3)), high)
      if (low > 1) r(low, low - 1, size(r, 3)) = 0
      if (low == high) then
        high = high - 1
        sweeps = 0
        cycle
      end if
      if (sweeps == most) then
        call fatal_error(error, "the iteration for the multipliers did not converge", failed_computation)
        return
      end if
      sweeps = sweeps + 1
      if (modulo(sweeps, patience) == 0) then
        ! Set elements of the triangular factors to zero if they are zero to roundoff. The norms of the factors are about 1.
        associate (block => r(low:high, low:high, :size(r, 3) - 1))
          where (abs(block) < 10 * size(r, 1) * epsilon(1.0_dp)) block = 0
        end associate
      end if
      call sweep(r, q, low, high, first_direction(r, low, high, sweeps))
    end do
  end subroutine iterate

  !> First row of the unreduced block of the Hessenberg matrix `h` that ends in row `high`.
  pure integer function block_start(h, high)
    complex(dp), intent(in) :: h(:, :)
    integer, intent(in) :: high

    do block_start = high, 2, -1
      associate (i => block_start)
        if (abs(h(i, i - 1)) <= epsilon(1.0_dp) * (abs(h(i - 1, i - 1)) + abs(h(i, i)))) return
      end associate
    end do
    block_start = 1
  end function block_start

  !> Direction of the first rotation of a sweep: the first column of S - shift E, where S is the product of the factors' blocks
  !> in rows and columns `low` to `high`, and E the unit matrix. Wilkinson's shift is computed from the last rows and columns of
  !> S. Every tenth sweep uses an arbitrary direction, to break rare cycles.
  pure function first_direction(r, low, high, sweeps) result(v)
    complex(dp), intent(in) :: r(:, :, :)
    integer, intent(in) :: low, high, sweeps
    complex(dp) :: v(2), t(max(low, high - 2):high, max(low, high - 2):high), flat(size(t)), corner(1), shift
    integer :: i, k, first, last, exponents(2)

    last = size(r, 3)
    v = unit(r(low:low + 1, low, last))
    if (modulo(sweeps, 10) == 0) v = [(0.6_dp, 0.0_dp), (0.48_dp, 0.64_dp)]
    ! Use no shift if a triangular factor is singular to roundoff (norms are about 1): such sweeps separate zeros.
    if (modulo(sweeps, 10) == 0 .or. any([(any(abs(r(i, i, :last - 1)) < epsilon(1.0_dp)), i = low, high)])) return

    first = max(low, high - 2)
    t = unit_matrix(size(t, 1))
    corner = 1
    exponents = 0
    do k = 1, last - 1
      flat = reshape(matmul(r(first:high, first:high, k), t), [size(t)])
      call normalise(flat, exponents(1))
      t = reshape(flat, shape(t))
      corner = corner * r(low, low, k)
      call normalise(corner, exponents(2))
    end do
    shift = shift_of(matmul(r(high - 1:high, first:high, last), t(:, high - 1:high)))
    v = r(low:low + 1, low, last)
    v(1) = v(1) - shift * scale(1.0_dp, min(exponents(1) - exponents(2), 1000)) / corner(1)
    v = unit(v)
  end function first_direction

  !> Wilkinson's shift: the eigenvalue of t, shape (2, 2), that is nearer to t(2, 2). If the other eigenvalue is much smaller, it
  !> is the shift instead: for products of graded factors, sweeps with the larger eigenvalue may cycle.
  pure function shift_of(t) result(shift)
    complex(dp), intent(in) :: t(2, 2)
    complex(dp) :: shift, mean, root
    real(dp), parameter :: much = 0.25_dp

    mean = (t(1, 1) + t(2, 2)) / 2
    root = sqrt(((t(1, 1) - t(2, 2)) / 2)**2 + t(1, 2) * t(2, 1))
    if (abs(mean + root - t(2, 2)) < abs(mean - root - t(2, 2))) root = -root
    shift = mean - root
    if (abs(mean + root) < much * abs(shift)) shift = mean + root
  end function shift_of

  !> Performs one QR sweep through rows and columns `low` to `high`. `v` is the first column of the first rotation matrix.
  pure subroutine sweep(r, q, low, high, v)
    complex(dp), intent(inout) :: r(:, :, :), q(:, :, :)
    integer, intent(in) :: low, high
    complex(dp), intent(in) :: v(2)
    complex(dp) :: directions(2, size(r, 3))
    integer :: i

    do i = low, high - 1
      if (i == low) then
        directions(:, 1) = v
      else
        directions(:, 1) = unit(r(i:i + 1, i - 1, size(r, 3)))
      end if
      call propagate_vector(r, i, directions)
      call rotate(r, q, i, directions, left=max(i - 1, low), bottom=min(i + 2, high))
      if (i > low) r(i + 1, i - 1, size(r, 3)) = 0
    end do
  end subroutine sweep

  !> Sorts the multipliers by descending modulus. Two neighbours are not exchanged if they are too close to be swapped accurately.
  pure subroutine order(r, q)
    complex(dp), intent(inout) :: r(:, :, :), q(:, :, :)
    real(dp), parameter :: close = sqrt(epsilon(1.0_dp)), exact = 1.0e3_dp * epsilon(1.0_dp)
    complex(dp) :: v(2, size(r, 3))
    real(dp) :: log_abs(size(r, 1)), arg(size(r, 1)), gap
    integer :: pass, i

    call periodic_multipliers(r, log_abs, arg)
    do pass = 1, size(r, 1)
      do i = 1, size(r, 1) - pass
        if (log_abs(i + 1) <= log_abs(i) + close) cycle
        call find_swap(r, i, v, gap)
        if (gap > exact) cycle
        call rotate(r, q, i, v, left=i, bottom=i + 1)
        r(i + 1, i, size(r, 3)) = 0
        log_abs(i:i + 1) = log_abs(i + 1:i:-1)
      end do
    end do
  end subroutine order

end module gestell_floquet_factors_periodic_schur
