!> Magnus integrators. The step of x' = P x is the exponential of one matrix, which is exact if P is constant.
module gestell_floquet_integrator_comparison_magnus
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: balancing
  use gestell_floquet_integrator_method, only: matrix_work, method_type, product_work
  use gestell_floquet_integrator_tableau, only: gauss_tableau, tableau_type
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: expm, magnus

  type, extends(method_type), public :: magnus_method
    private
    !> Positions of the nodes in a step of length 1; `prepare` allocates them
    real(dp), allocatable :: c(:)
  contains
    procedure :: prepare, maps, work
  end type magnus_method

contains

  !> Returns the method of order 4 or 6, named magnus4 or magnus6, with 2 or 3 Gauss nodes. The error constants were measured on
  !> Mathieu's equation, on the machine of the paper (doc/theory.md) and on a random system with 12 states; they agree within a
  !> factor of 5.
  pure type(magnus_method) function magnus(order) result(method)
    integer, intent(in) :: order

    method%name = "magnus" // achar(iachar("0") + order)
    method%order = order
    method%stages = order / 2
    method%error_constant = merge(2.0e-3_dp, 1.5e-4_dp, order == 4)
    method%exact_if_constant = .true.
  end function magnus

  !> Computes the nodes.
  pure subroutine prepare(self)
    class(magnus_method), intent(inout) :: self
    type(tableau_type) :: tableau

    tableau = gauss_tableau(self%stages)
    self%c = tableau%c
  end subroutine prepare

  !> Computing time of a step, in the units of `step_work` in gestell_floquet_integrator_method.
  pure real(dp) function work(self, states, second_order)
    class(magnus_method), intent(in) :: self
    integer, intent(in) :: states
    logical, intent(in) :: second_order
    integer :: products

    ! Products for the commutators, and for the exponential if the phase of the fastest motion advances by less than about two
    ! radians.
    products = merge(2, 6, self%order == 4) + 7
    work = self%stages * matrix_work(states, second_order) + products * product_work(states + 1)
  end function work

  !> Computes the maps of the steps as matrix exponentials in balanced units. The vector b of a map [A b] is the last column of the
  !> exponential of [P f; 0 0]. Because b is linear in f, f is first scaled to the size 1 / T. Fails if P is not finite.
  subroutine maps(self, system, from, to, map, error)
    class(magnus_method), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: from(:), to(:)
    real(dp), contiguous, intent(out) :: map(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: p(:, :, :), f(:, :), augmented(:, :, :), step(:, :)
    real(dp) :: phases(self%stages * size(from)), d(system%states), similarity(system%states, system%states), size_of_f
    integer :: n, s, i, k
    logical :: forced

    n = system%states
    forced = size(map, 3) > n
    s = self%stages
    phases = [((from(k) + self%c(i) * (to(k) - from(k)), i = 1, s), k = 1, size(from))]
    allocate(p(n, n, size(phases)))
    ! An unallocated variable counts as an absent argument.
    if (forced) allocate(f(n, size(phases)))
    call system%sample(phases, p, f)
    if (.not. all(ieee_is_finite(p))) then
      call fatal_error(error, "the system's coefficients are not finite", failed_computation)
      return
    end if

    d = balancing(maxval(abs(p), dim=3))
    similarity = spread(d, 1, n) / spread(d, 2, n)
    size_of_f = 1
    if (forced) size_of_f = max(maxval(abs(f) / spread(d, 2, size(f, 2))), tiny(1.0_dp)) * system%period
    associate (m => size(map, 3))
      allocate(augmented(m, m, s), step(m, m))
    end associate
    augmented = 0
    do k = 1, size(from)
      do i = 1, s
        augmented(:n, :n, i) = p(:, :, s * (k - 1) + i) * similarity
        if (forced) augmented(:n, n + 1, i) = f(:, s * (k - 1) + i) / (d * size_of_f)
      end do
      step = expm(exponent_of(augmented, (to(k) - from(k)) * system%period))
      map(k, :, :n) = step(:n, :n) / similarity
      if (forced) map(k, :, n + 1) = step(:n, n + 1) * d * size_of_f
    end do
  end subroutine maps

  !> Exponent of a step of length `h` (S. Blanes, F. Casas, J. A. Oteo, J. Ros, Physics Reports 470 (2009) 151). Order 4 uses P at
  !> two Gauss nodes, equation (253); order 6 uses P at three nodes and three commutators, equation (257).
  pure function exponent_of(p, h) result(omega)
    real(dp), intent(in) :: p(:, :, :), h
    real(dp), dimension(size(p, 1), size(p, 1)) :: omega, a1, a2, a3, c1, c2

    if (size(p, 3) == 2) then
      omega = h / 2 * (p(:, :, 1) + p(:, :, 2)) - h**2 * sqrt(3.0_dp) / 12 * commutator(p(:, :, 1), p(:, :, 2))
      return
    end if
    a1 = h * p(:, :, 2)
    a2 = sqrt(15.0_dp) * h / 3 * (p(:, :, 3) - p(:, :, 1))
    a3 = 10 * h / 3 * (p(:, :, 3) - 2 * p(:, :, 2) + p(:, :, 1))
    c1 = commutator(a1, a2)
    c2 = -commutator(a1, 2 * a3 + c1) / 60
    omega = a1 + a3 / 12 + commutator(-20 * a1 - a3 + c1, a2 + c2) / 240
  end function exponent_of

  pure function commutator(a, b) result(c)
    real(dp), intent(in) :: a(:, :), b(:, :)
    real(dp) :: c(size(a, 1), size(a, 1))

    c = matmul(a, b) - matmul(b, a)
  end function commutator

  !> exp(A) by scaling and squaring, exp(A) = exp(A / 2^s)^(2^s), with a Taylor polynomial of degree m = 9 or 16 in powers of A^r, r
  !> = sqrt(m) (M. Paterson, L. Stockmeyer, SIAM J. Comput. 2 (1973) 60). The truncation error is below the unit roundoff if the
  !> norm of A / 2^s is below ((m + 1)! epsilon)**(1 / (m + 1)).
  !>
  !> Balance A before the call. If the norm of A is much larger than its eigenvalues, more squarings are needed, and each squaring
  !> doubles the roundoff error.
  pure function expm(a) result(e)
    real(dp), intent(in) :: a(:, :)
    real(dp) :: e(size(a, 1), size(a, 1))
    real(dp), parameter :: inverse_factorial(0:16) = [1.0_dp, 1.0_dp, 5.0e-1_dp, 1 / 6.0_dp, 1 / 24.0_dp, 1 / 120.0_dp, &
      & 1 / 720.0_dp, 1 / 5040.0_dp, 1 / 40320.0_dp, 1 / 362880.0_dp, 1 / 3628800.0_dp, 1 / 39916800.0_dp, &
      & 1 / 479001600.0_dp, 1 / 6227020800.0_dp, 1 / 87178291200.0_dp, 1 / 1307674368000.0_dp, 1 / 20922789888000.0_dp]
    !> Largest norms of A / 2^s for which degree 9 and degree 16 suffice: (10! epsilon)**(1/10) and (17! epsilon)**(1/17)
    real(dp), parameter :: reach_9 = 0.123_dp, reach_16 = 0.861_dp
    real(dp) :: power(size(a, 1), size(a, 1), 4), norm
    integer :: squarings, r, i, j, k

    norm = maxval(sum(abs(a), dim=1))
    squarings = 0
    r = 3
    if (norm > reach_9) r = 4
    if (norm > reach_16) squarings = exponent(norm / reach_16)

    power(:, :, 1) = a * 0.5_dp**squarings
    do k = 2, r
      power(:, :, k) = matmul(power(:, :, 1), power(:, :, k - 1))
    end do
    e = inverse_factorial(r * r) * power(:, :, r)
    do j = r - 1, 0, -1
      do k = 1, r - 1
        e = e + inverse_factorial(r * j + k) * power(:, :, k)
      end do
      do i = 1, size(a, 1)
        e(i, i) = e(i, i) + inverse_factorial(r * j)
      end do
      if (j > 0) e = matmul(power(:, :, r), e)
    end do
    do k = 1, squarings
      e = matmul(e, e)
    end do
  end function expm

end module gestell_floquet_integrator_comparison_magnus
