!> Bounds of multipliers and periodic solutions, from monodromy matrices with prescribed errors.
module test_bounds
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: monodromy_type
  use gestell_floquet_multipliers, only: multipliers_type, solve_multipliers
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, solve_periodic
  use reference_linear, only: eigenvalues, qp, solve
  use systems, only: diagonal
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_bounds

  real(dp), parameter :: period = 0.1_dp

  !> Linear congruential generator of Park and Miller.
  integer, parameter :: long = selected_int_kind(12)
  type :: random_type
    integer(long) :: state = 1
  end type random_type

contains

  subroutine collect_bounds(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("multipliers of perturbed monodromy matrices lie within the error bounds", test_perturbed), &
      & new_unittest("error bounds of close multipliers cover both of them", test_close), &
      & new_unittest("multipliers are sorted and carry correct exponents, vectors and units", test_sorted), &
      & new_unittest("the verdict follows from the multipliers' moduli and error bounds", test_verdicts), &
      & new_unittest("start vectors of perturbed equations lie within the error bounds", test_start), &
      & new_unittest("no start vector is reported if the equations may be singular", test_nearly_singular), &
      & new_unittest("error bounds cover the rounding of eigenvalues and start vector", test_rounding)]
  end subroutine collect_bounds

  !> Uniformly in [-1, 1].
  real(dp) function draw(random)
    type(random_type), intent(inout) :: random

    random%state = modulo(48271_long * random%state, 2147483647_long)
    draw = 2 * real(random%state, dp) / 2147483647 - 1
  end function draw

  function random_matrix(random, n) result(a)
    type(random_type), intent(inout) :: random
    integer, intent(in) :: n
    real(dp) :: a(n, n)
    integer :: i, j

    do j = 1, n
      do i = 1, n
        a(i, j) = draw(random)
      end do
    end do
  end function random_matrix

  !> A monodromy matrix D A D^-1, D = diag(scale), and its claims.
  function claimed(a, scale, phi_error) result(monodromy)
    real(dp), intent(in) :: a(:, :), scale(:), phi_error
    type(monodromy_type) :: monodromy

    monodromy%scale = scale
    monodromy%phi = a * spread(scale, 2, size(scale)) / spread(scale, 1, size(scale))
    monodromy%norm = norm2(a)
    monodromy%period = period
    monodromy%error = phi_error
  end function claimed

  !> Phi + E with |E| as claimed has multipliers within the bounds of Phi's, and every bound is needed. Upper triangular
  !> matrices with a small gap make them sensitive, almost defective.
  subroutine test_perturbed(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 4
    real(dp), parameter :: scale(n) = [1.0_dp, 1024.0_dp, 1.0_dp, 0.0625_dp]
    type(random_type) :: random
    type(multipliers_type) :: m, moved
    type(gestell_error), allocatable :: failure
    real(dp) :: a(n, n), e(n, n), size_of_error, most
    integer :: i, j, k

    most = 0
    do i = 1, 400
      a = random_matrix(random, n)
      if (modulo(i, 2) == 0) then
        do k = 1, n
          a(k + 1:, k) = 0
          a(k, k) = 0.5_dp + 10.0_dp**(-modulo(i, 8)) * draw(random)
        end do
      end if
      size_of_error = 10.0_dp**(-2 - modulo(i, 9))
      call solve_multipliers(claimed(a, scale, size_of_error), .false., m, failure)
      do j = 1, 5
        e = random_matrix(random, n)
        ! A single entry moves a sensitive multiplier most.
        if (j > 1) e = merge(e, 0.0_dp, abs(e) >= maxval(abs(e)))
        e = e * size_of_error / norm2(e)
        if (.not. allocated(failure)) call solve_multipliers(claimed(a + e, scale, 0.0_dp), .false., moved, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        do k = 1, n
          ! The perturbed multipliers are accurate to rounding, which their own bounds cover.
          call check_that(error, minval(abs(moved%rho(k) - m%rho) - m%error * abs(m%rho) - moved%error(k) * abs(moved%rho(k))), &
            & "<=", 0.0_dp, "each one lies in a disc")
          call check_that(error, minval(abs(m%rho(k) - moved%rho) - m%error(k) * abs(m%rho(k)) - moved%error * abs(moved%rho)), &
            & "<=", 0.0_dp, "each disc holds one")
          if (allocated(error)) return
          most = max(most, minval(abs(m%rho(k) - moved%rho)) / (m%error(k) * abs(m%rho(k))))
        end do
      end do
    end do
    ! Gershgorin's theorem gives away a factor of n and the angles between the vectors.
    call check_that(error, most, ">", 0.1_dp, "bounds are not too wide")
  end subroutine test_perturbed

  !> diag(0.5, 0.5 + gap, -0.3): the discs have the radius 3 |E|. They touch for a gap of 5 |E|, not for one of 7 |E|. In that
  !> case the other multiplier may be |E| + |E| + |E| / alpha = 4 |E| away with alpha = 1/2, and the bound is |E| + |E| / 2 +
  !> |E| / 2. The third multiplier is far away; its bound contains two such terms.
  subroutine test_close(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: e = 1.0e-3_dp, gaps(2) = [5 * e, 7 * e], bounds(2) = [8 * e, 2 * e], &
      & third = e + 2 * e**2 / (0.8_dp - 5 * e)
    type(multipliers_type) :: m
    type(gestell_error), allocatable :: failure
    integer :: i

    do i = 1, 2
      call solve_multipliers(claimed(diagonal([0.5_dp, 0.5_dp + gaps(i), -0.3_dp]), [1.0_dp, 1.0_dp, 1.0_dp], e), &
        & .false., m, failure)
      ! Up to rounding of order 1e-15.
      call check_that(error, maxval(abs(m%error * abs(m%rho) - [bounds(i), bounds(i), third])), "<", 1.0e-13_dp, "bounds")
      call check_that(error, maxval(abs(m%condition - 1)), "<", 1.0e-13_dp, "conditions")
      if (allocated(error)) return
    end do

    ! A chain of three, where the outer two do not touch, in every order.
    do i = 1, 3
      call solve_multipliers(claimed(diagonal(cshift([0.5_dp, 0.5_dp + gaps(1), 0.5_dp + 2 * gaps(1)], i)), &
        & [1.0_dp, 1.0_dp, 1.0_dp], e), .false., m, failure)
      call check_that(error, maxval(abs(m%error * abs(m%rho) - [13 * e, 8 * e, 13 * e])), "<", 1.0e-13_dp, "chain")
      if (allocated(error)) return
    end do
    call solve_multipliers(claimed(diagonal([0.5_dp, 0.5_dp + 3 * gaps(1), 0.5_dp + gaps(1), 0.5_dp + 2 * gaps(1)]), &
      & [1.0_dp, 1.0_dp, 1.0_dp, 1.0_dp], e), .false., m, failure)
    ! Radius 4 |E|.
    call check_that(error, maxval(abs(m%error * abs(m%rho) - [19 * e, 14 * e, 14 * e, 19 * e])), "<", 1.0e-13_dp, "chain of four")
  end subroutine test_close

  !> D blockdiag(1/2, 2 [cos sin; -sin cos], -3, 0) D^-1 has known multipliers and vectors.
  subroutine test_sorted(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: scale(5) = [1.0_dp, 0.25_dp, 8.0_dp, 1.0_dp, 1.0_dp], angle = 0.7_dp
    type(multipliers_type) :: m, other
    type(gestell_error), allocatable :: failure
    complex(dp) :: expected(5)
    real(dp) :: a(5, 5), b(3, 3)
    integer :: k

    a = diagonal([0.5_dp, 2 * cos(angle), 2 * cos(angle), -3.0_dp, 0.25_dp])
    a(2, 3) = 2 * sin(angle)
    a(3, 2) = -2 * sin(angle)
    call solve_multipliers(claimed(a, scale, 1.0e-9_dp), .true., m, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    expected = [cmplx(-3, 0, dp), 2 * exp(cmplx(0, angle, dp)), 2 * exp(cmplx(0, -angle, dp)), cmplx(0.5_dp, 0, dp), &
      & cmplx(0.25_dp, 0, dp)]
    ! Roundings of a normal matrix.
    call check_that(error, maxval(abs(m%rho - expected)), "<", 1.0e-14_dp, "order")
    call check_that(error, maxval(abs(m%log_abs - log(abs(expected)))), "<", 1.0e-14_dp, "log_abs")
    call check_that(error, abs(m%arg(2) - angle) + abs(m%arg(3) + angle) + abs(abs(m%arg(1)) - acos(-1.0_dp)) + abs(m%arg(4)), &
      & "<", 1.0e-14_dp, "arg")
    call check_that(error, maxval(abs(m%exponent - cmplx(m%log_abs, m%arg, dp) / period)), "<", 1.0e-12_dp, "exponent")
    call check_that(error, maxval(abs(m%error * abs(m%rho) - 1.0e-9_dp)), "<", 1.0e-13_dp, "error relative to |rho|")
    if (allocated(error)) return

    ! [0.9 5; 0 0.1]: both have the condition sqrt(1 + (5 / 0.8)^2), the third multiplier 1.
    b = diagonal([0.2_dp, 0.9_dp, 0.1_dp])
    b(2, 3) = 5
    call solve_multipliers(claimed(b, scale(:3), 1.0e-9_dp), .false., other, failure)
    call check_that(error, maxval(abs(other%condition - [hypot(1.0_dp, 6.25_dp), 1.0_dp, hypot(1.0_dp, 6.25_dp)])), "<", &
      & 1.0e-13_dp, "condition")
    if (allocated(error)) return

    ! Vectors in the model's units, unit norm, the largest component real and positive: (-i / 4, 8) / norm for the pair.
    do k = 1, 5
      call check(error, norm2(abs(m%vectors(:, k))), 1.0_dp, thr=1.0e-14_dp, more="unit")
      if (allocated(error)) return
    end do
    call check_that(error, maxval(abs([m%vectors(4, 1), m%vectors(1, 4), m%vectors(5, 5)] - 1)), "<", 1.0e-14_dp, "real vectors")
    call check_that(error, abs(m%vectors(3, 2) - 8 / hypot(8.0_dp, 0.25_dp)) &
      & + abs(m%vectors(2, 2) - cmplx(0, -0.25_dp, dp) / hypot(8.0_dp, 0.25_dp)), "<", 1.0e-14_dp, "vector of the pair")
  end subroutine test_sorted

  !> Moduli and their bounds on either side of 1.
  subroutine test_verdicts(error)
    type(error_type), allocatable, intent(out) :: error

    call compare([0.9_dp, 0.5_dp], [0.01_dp, 0.01_dp], "stable")
    call compare([0.9_dp, 0.5_dp], [0.2_dp, 0.01_dp], "undecided")
    call compare([0.5_dp, 0.4_dp], [0.01_dp, 2.0_dp], "undecided")
    call compare([1.1_dp, 0.5_dp], [0.01_dp, 0.01_dp], "unstable")
    call compare([1.1_dp, 0.5_dp], [0.2_dp, 0.01_dp], "undecided")
    call compare([1.3_dp, 1.1_dp], [0.5_dp, 0.01_dp], "unstable")
    call compare([1.0_dp, 0.5_dp], [0.0_dp, 0.0_dp], "undecided")
    ! Bounds are relative to |rho|: 0.1 of 5 and 30 of 0.01.
    call compare([5.0_dp, 0.01_dp], [0.1_dp, 30.0_dp], "unstable")
    call compare([0.6_dp, 0.01_dp], [0.1_dp, 30.0_dp], "stable")
    call compare([4.0_dp, 0.5_dp], [0.8_dp, 0.0_dp], "undecided")

  contains

    subroutine compare(moduli, errors, word)
      real(dp), intent(in) :: moduli(2), errors(2)
      character(len=*), intent(in) :: word
      type(multipliers_type) :: m

      if (allocated(error)) return
      allocate(m%rho(2), m%error(2))
      m%rho = moduli * exp(cmplx(0, 1, dp))
      m%error = errors
      m%log_abs = log(moduli)
      call check(error, m%verdict(), word)
    end subroutine compare

  end subroutine test_verdicts

  !> (E - Phi - e) x0 = x_p + e_p with errors as large as claimed that act together: e = u x0^T and e_p along u, for many
  !> directions u.
  subroutine test_start(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 3
    real(dp), parameter :: scale(n) = [1.0_dp, 512.0_dp, 0.125_dp], phi_error = 1.0e-6_dp, xp_error = 3.0e-6_dp
    type(random_type) :: random
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: solution, moved
    type(gestell_error), allocatable :: failure
    real(dp) :: a(n, n), e(n, n), xp(n), ep(n), most(n)
    integer :: i, j, k

    most = 0
    do i = 1, 60
      a = diagonal([1.0_dp, 1.0_dp, 1.0_dp]) - random_matrix(random, n) * 10.0_dp**(-modulo(i, 3))
      xp = [draw(random), draw(random), draw(random)] * merge(1.0e-4_dp, 1.0_dp, modulo(i, 2) == 0)
      monodromy = claimed(a, scale, phi_error)
      monodromy%xp = xp * scale
      monodromy%xp_error = xp_error
      call solve_periodic(monodromy, solution, failure)
      if (allocated(failure)) cycle
      do j = 1, 60
        e = spread([draw(random), draw(random), draw(random)], 2, n) * spread(solution%x0 / scale, 1, n)
        if (norm2(e) > 0) e = e * phi_error / norm2(e)
        ep = [draw(random), draw(random), draw(random)]
        if (norm2(e) > 0) ep = matmul(e, solution%x0 / scale)
        ep = ep * xp_error / norm2(ep)
        monodromy = claimed(a + e, scale, 0.0_dp)
        monodromy%xp = (xp + ep) * scale
        call solve_periodic(monodromy, moved, failure)
        if (allocated(failure)) cycle
        call check_that(error, abs(moved%x0 - solution%x0), "<=", solution%error + moved%error, "moved solution")
        if (allocated(error)) return
        do k = 1, n
          most(k) = max(most(k), abs(moved%x0(k) - solution%x0(k)) / solution%error(k))
        end do
      end do
    end do
    ! Every component comes close to its bound in some direction.
    call check_that(error, most, ">", 0.8_dp, "bounds are not too wide")
  end subroutine test_start

  !> If E - Phi can be singular within the error, no start vector is reported; before that the bound grows accordingly.
  subroutine test_nearly_singular(error)
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure

    monodromy = claimed(diagonal([1 - 1.0e-3_dp]), [1.0_dp], 1.01e-3_dp)
    monodromy%xp = [1.0_dp]
    monodromy%xp_error = 0
    call solve_periodic(monodromy, solution, failure)
    call check_failure(error, failure, what="1 is within the error")
    if (allocated(error)) return
    monodromy%error = 0.9e-3_dp
    call solve_periodic(monodromy, solution, failure)
    call check_success(error, failure, "1 is outside")
    if (allocated(error)) return
    ! The true multiplier may be 1 - 1e-4: x0 = 1e4 in place of 1e3.
    call check(error, solution%error(1), 9000.0_dp, thr=1.0e-6_dp)
    if (allocated(error)) return
    ! 1e3 (1 + 0.999).
    call check(error, solution%condition, 1999.0_dp, thr=1.0e-6_dp)
    if (allocated(error)) return
    monodromy = claimed(diagonal([1.0_dp, 0.5_dp]), [1.0_dp, 1.0_dp], 0.0_dp)
    monodromy%xp = [1.0_dp, 1.0_dp]
    call solve_periodic(monodromy, solution, failure)
    call check_failure(error, failure, "resonance")
    if (allocated(error)) return
    ! The amplification is the norm of the whole inverse, not of its largest entry: 0.9 sqrt(2) > 1.
    monodromy = claimed(diagonal([0.0_dp, 0.0_dp]), [1.0_dp, 1.0_dp], 0.9_dp)
    monodromy%xp = [1.0_dp, 1.0_dp]
    call solve_periodic(monodromy, solution, failure)
    call check_failure(error, failure, what="norm of the inverse")
  end subroutine test_nearly_singular

  !> If Phi is exact, only rounding errors remain: comparison with quadruple precision.
  subroutine test_rounding(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 5
    type(random_type) :: random
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: m
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    complex(qp) :: rho(n)
    real(qp) :: unit(n, n), x0(n)
    real(dp) :: a(n, n)
    integer :: i, k

    unit = diagonal([1.0_dp, 1.0_dp, 1.0_dp, 1.0_dp, 1.0_dp])
    do i = 1, 60
      a = random_matrix(random, n)
      if (modulo(i, 2) == 0) a(:, 1) = 0.99_dp * a(:, 2) + 1.0e-6_dp * a(:, 1)
      monodromy = claimed(a, [1.0_dp, 1.0_dp, 1.0_dp, 1.0_dp, 1.0_dp], 0.0_dp)
      monodromy%xp = a(:, 3)
      call solve_multipliers(monodromy, .false., m, failure)
      if (.not. allocated(failure)) call solve_periodic(monodromy, solution, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call eigenvalues(real(a, qp), rho)
      do k = 1, n
        call check_that(error, real(minval(abs(rho - m%rho(k))), dp), "<=", m%error(k) * abs(m%rho(k)), "multiplier")
        if (allocated(error)) return
      end do
      x0 = solve(unit - real(a, qp), real(monodromy%xp, qp))
      call check_that(error, abs(solution%x0 - real(x0, dp)), "<=", solution%error, "x0")
      if (allocated(error)) return
    end do
  end subroutine test_rounding


end module test_bounds
