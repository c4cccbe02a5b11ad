!> Frames, and error bounds of multipliers, from factors whose product is never formed.
module test_periodic_bounds
  use checks, only: check_that
  use factor_sequences, only: distances, hidden, outcome_type, random_matrix, solve
  use gestell_base_kinds, only: dp
  use gestell_floquet_factors_periodic_bounds, only: periodic_bounds
  use gestell_floquet_factors_periodic_schur, only: periodic_multipliers
  use reference_random, only: random_type
  use systems, only: diagonal
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_periodic_bounds

contains

  subroutine collect_periodic_bounds(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("right and left eigenvectors of every factor satisfy their equations", test_eigenvectors), &
      & new_unittest("bounds hold for products with singular, zero and tiny factors", test_singular), &
      & new_unittest("multipliers of perturbed factors stay within their bounds", test_bounds), &
      & new_unittest("bounds of defective multipliers have the size of their movement", test_defective)]
  end subroutine collect_periodic_bounds

  subroutine test_eigenvectors(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 5, counts(3) = [1, 4, 50]
    type(random_type) :: random
    type(outcome_type) :: o
    complex(dp), allocatable :: factors(:, :, :)
    complex(dp) :: product(n, n)
    integer :: i, j, k, next

    call random%start(1, 46)
    do i = 1, size(counts)
      allocate(factors(n, n, counts(i)))
      do k = 1, counts(i)
        factors(:, :, k) = random_matrix(random, n, n)
      end do
      call solve(factors, o, error)
      if (allocated(error)) return
      do k = 1, counts(i)
        next = modulo(k, counts(i)) + 1
        ! Roundoff of factors of norm 4; swaps cost some times that.
        call check_that(error, maxval(abs(matmul(factors(:, :, k), o%vectors%x(:, :, k)) - o%vectors%x(:, :, next) &
          & * spread(o%vectors%lambda(:, k), 1, n))), "<", 1.0e-13_dp, "right eigenvectors")
        call check_that(error, maxval(abs(matmul(o%vectors%y(:, :, next), factors(:, :, k)) - spread(o%vectors%lambda(:, k), 2, n) &
          & * o%vectors%y(:, :, k))), "<", 1.0e-12_dp * maxval(o%condition), "left eigenvectors")
        if (allocated(error)) return
        product = matmul(o%vectors%y(:, :, k), o%vectors%x(:, :, k)) - diagonal([(1.0_dp, j = 1, n)])
        call check_that(error, maxval(abs(product)), "<", 1.0e-12_dp * maxval(o%condition), "Y = X^-1")
        call check_that(error, maxval(abs(norm2(abs(o%vectors%x(:, :, k)), dim=1) - 1)), "<", 1.0e-13_dp, "unit columns")
        if (allocated(error)) return
      end do
      call check_that(error, maxval(abs(sum(log(abs(o%vectors%lambda)), dim=2) - o%log_abs)), "<", 1.0e-11_dp, &
        & "growth over the period")
      if (allocated(error)) return
      ! Frames that are wrong by 1e-3 somewhere.
      o%vectors%x(:, 2, 1) = o%vectors%x(:, 2, 1) + 1.0e-3_dp * o%vectors%x(:, 1, 1)
      call periodic_bounds(factors, o%log_abs, o%arg, o%vectors, [(0.0_dp, j = 1, counts(i))], o%bound, o%most, &
        & o%condition)
      call check_that(error, o%bound(2), ">", 1.0e-4_dp, "poor eigenvectors")
      if (allocated(error)) return
      deallocate(factors)
    end do
  end subroutine test_eigenvectors

  !> Products of rank 3, 2 and 0, whose other multipliers are known, and of factors as small as 2^-700.
  subroutine test_singular(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 4, length = 5
    type(random_type) :: random
    type(outcome_type) :: o, small
    complex(dp), dimension(n, n, length) :: t, factors
    real(dp) :: log_abs(n), arg(n)
    integer :: i, j, k

    call random%start(1, 45)
    do i = 0, (n * length)**2 - 1
      do k = 1, length
        t(:, :, k) = random_matrix(random, n, n)
        do j = 1, n
          t(j + 1:, j, k) = 0
          t(j, j, k) = 0.5_dp + 0.2_dp * j
          ! Zeros at any two places of any factors.
          associate (place => j + n * (k - 1) - 1)
            if (any(place == [modulo(i, n * length), i / (n * length)])) t(j, j, k) = 0
          end associate
        end do
      end do
      call periodic_multipliers(t, log_abs, arg)
      factors = hidden(random, t)
      call solve(factors, o, error)
      if (allocated(error)) return
      do j = 1, n
        if (log_abs(j) < -100) cycle
        call check_that(error, distances(log_abs(j:j), arg(j:j), o%log_abs, o%arg), "<", 1.0e-9_dp, "the other multipliers")
        if (allocated(error)) return
      end do
      j = count(log_abs < -100)
      ! Two of them are defective: the root of roundoff.
      call check_that(error, o%log_abs(n - j + 1:), "<", log(1.0e-6_dp), "zeros")
      call check_that(error, o%bound(n - j + 1:), ">", 0.5_dp, "zeros are marked as lost")
      call check_that(error, o%bound(:n - j), "<", 1.0e-6_dp, "zeros are marked as lost")
      if (allocated(error)) return
      do k = 1, length
        associate (moved => o%vectors%x(:, :, modulo(k, length) + 1) * spread(o%vectors%lambda(:, k), 1, n))
          ! Two zeros are brought apart by roundoff only.
          call check_that(error, maxval(abs(matmul(factors(:, :, k), o%vectors%x(:, :, k)) - moved)), "<", 1.0e-12_dp, &
            & "eigenvectors")
          if (allocated(error)) return
        end associate
      end do
    end do

    t(:, :, 3) = 0
    call solve(t, o, error, spread(1.0e-3_dp, 1, length))
    if (allocated(error)) return
    call check_that(error, o%log_abs, "<", -700.0_dp, "zero factor")
    ! An error of 1e-3 there can bring multipliers of about as much.
    call check_that(error, o%most, ">", log(1.0e-3_dp), "bounds of zero")
    call check_that(error, o%bound, ">", 1.0e250_dp, "bounds of zero")
    if (allocated(error)) return

    do k = 1, length
      t(:, :, k) = 2.0_dp**(-700) * random_matrix(random, n, n)
    end do
    call solve(t, small, error)
    if (allocated(error)) return
    call solve(2.0_dp**700 * t, o, error)
    if (allocated(error)) return
    call check_that(error, maxval(abs(small%log_abs - o%log_abs + length * 700 * log(2.0_dp))), "<", 1.0e-11_dp, "small factors")
    ! The residuals are roundoff, which moduli of very small numbers may change.
    call check_that(error, small%bound, "<", 10 * o%bound, "bounds of small factors")
    call check_that(error, o%bound, "<", 10 * small%bound, "bounds of small factors")
  end subroutine test_singular

  !> Factors with errors as large as claimed, in random directions and along y x^H, which moves one multiplier most; e is spread
  !> evenly or all in one factor. Triangular factors with gaps down to 1e-6, moduli over 40 decades, and full ones.
  subroutine test_bounds(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 4, length = 10, samples = 150, tries = 12
    type(random_type) :: random
    type(outcome_type) :: o, moved
    complex(dp) :: factors(n, n, length), e(n, n, length)
    real(dp) :: errors(length), ratio(samples)
    integer :: i, j, k, m

    call random%start(1, 47)
    do i = 1, samples
      do k = 1, length
        factors(:, :, k) = random_matrix(random, n, n)
        if (modulo(i, 3) == 0) cycle
        do j = 1, n
          factors(j + 1:, j, k) = 0
          factors(j, j, k) = merge(1 + 10.0_dp**(-modulo(i, 7)) * factors(j, j, k), &
            & 10.0_dp**(2 - j) * factors(j, j, k), modulo(i, 3) == 1)
        end do
      end do
      factors = hidden(random, factors)
      errors = 10.0_dp**(-4 - modulo(i, 8)) / length
      if (modulo(i, 4) == 0) errors(2:) = 0
      call solve(factors, o, error, errors)
      if (allocated(error)) return
      ratio(i) = 0
      do j = 1, tries
        m = random%pick(n)
        do k = 1, length
          if (j <= tries / 3) then
            e(:, :, k) = random_matrix(random, n, n)
          else
            ! Each factor's part turned so that all push alike.
            associate (y => o%vectors%y(m, :, modulo(k, length) + 1), x => o%vectors%x(:, m, k))
              e(:, :, k) = spread(conjg(y), 2, n) * spread(conjg(x), 1, n) * o%vectors%lambda(m, k) / abs(o%vectors%lambda(m, k))
            end associate
          end if
          e(:, :, k) = e(:, :, k) * errors(k) / norm2(abs(e(:, :, k)))
        end do
        call solve(factors + e, moved, error)
        if (allocated(error)) return
        call check_that(error, distances(o%log_abs, o%arg, moved%log_abs, moved%arg), "<=", o%bound + moved%bound, "each disc")
        call check_that(error, moved%log_abs(1), "<=", maxval(o%most), "most")
        if (allocated(error)) return
        do k = 1, n
          call check_that(error, minval(distances(o%log_abs, o%arg, moved%log_abs(k:k), moved%arg(k:k)) - o%bound - moved%bound), &
            & "<=", 0.0_dp, "each one")
          if (allocated(error)) return
        end do
        ratio(i) = max(ratio(i), maxval(distances(o%log_abs, o%arg, moved%log_abs, moved%arg) / o%bound))
      end do
    end do
    ! Gershgorin's theorem gives away n = 4, and the direction is that of first order.
    call check_that(error, maxval(ratio), ">", 0.2_dp, "sharp for one")
    call check_that(error, count(ratio > 0.01_dp), ">", samples / 2, "median")
    if (allocated(error)) return
    call solve(reshape([((1.0_dp, 0.0_dp), j = 1, length)], [1, 1, length]), o, error, [(0.05_dp, j = 1, length)])
    if (allocated(error)) return
    call check_that(error, abs(o%bound(1) / (1.05_dp**length - 1) - 1), "<", 1.0e-12_dp, "large errors multiply")
  end subroutine test_bounds

  !> Jordan blocks of 2 to 4 multipliers 1, disguised and not, and exactly double ones: errors e at the corner move them by
  !> e^(1/m); the bound has that size, and the bound of the single ones has the size e.
  subroutine test_defective(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 5, length = 6
    type(random_type) :: random
    type(outcome_type) :: o, moved
    complex(dp), dimension(n, n, length) :: t, factors, corner
    real(dp) :: e, change
    integer :: i, j, m

    call random%start(1, 48)
    do m = 2, 4
      t = 0
      do j = 1, n
        t(j, j, :) = merge((1.0_dp, 0.0_dp), 0.5_dp**(1.0_dp / length) * exp(cmplx(0, real(j, dp) / length, dp)), j <= m)
        if (j < m) t(j, j + 1, :) = 1.0_dp / length
      end do
      do i = -13, -4
        e = 10.0_dp**i
        corner = t
        corner(m, 1, 1) = e
        if (modulo(i, 2) == 0) then
          factors = t
        else
          call random%start(1, 48)
          factors = hidden(random, t)
          call random%start(1, 48)
          corner = hidden(random, corner)
        end if
        call solve(factors, o, error, [e, (0.0_dp, j = 2, length)])
        if (allocated(error)) return
        call solve(corner, moved, error)
        if (allocated(error)) return
        call check_that(error, distances(o%log_abs, o%arg, moved%log_abs, moved%arg), "<=", o%bound, "within the bound")
        if (allocated(error)) return
        change = maxval(hypot(moved%log_abs(:m), moved%arg(:m)))
        call check_that(error, change, ">", 0.3_dp * e**(1.0_dp / m), "perturbed multipliers move")
        call check_that(error, o%bound(:m), "<", 100 * change, "the bound is not too wide")
        ! Unless the discs of the others are reached, 0.5 away.
        if (o%bound(1) <= 0.3_dp) call check_that(error, o%bound(m + 1:), "<", 100 * e, "the other multipliers are not affected")
        if (allocated(error)) return
      end do
    end do
    do i = 1, length
      factors(:, :, i) = diagonal([(1.0_dp, j = 1, n)])
    end do
    call solve(factors, o, error, [(1.0e-6_dp, j = 1, length)])
    if (allocated(error)) return
    call check_that(error, abs(o%bound - 3.0e-5_dp), "<", 1.0e-8_dp, "five the same, any vectors: n sum e")
  end subroutine test_defective

end module test_periodic_bounds
