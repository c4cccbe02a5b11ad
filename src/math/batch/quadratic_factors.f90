!> Factorises real polynomials, eight polynomials together, into real quadratic factors f_k = t^2 - s_k t + q_k.
!>
!> The method is Weierstrass's iteration (also named after Durand and Kerner), applied to factors instead of roots. Let g be the
!> product of the other factors; then p = (f_k + d) g with d = p / g modulo f_k. Residues modulo f_k are linear in t; their products
!> use t^2 = s_k t - q_k. All numbers are real. A conjugate pair of roots can become two real roots while a factor changes.
module gestell_math_batch_quadratic_factors
  use gestell_base_processor, only: has_versions
  use gestell_math_lanes, only: lanes
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: find_factors

  !> Maximum number of iterations. It limits an iteration that moves erratically, as may happen if roots are real.
  integer, parameter :: max_iterations = 30
  !> The iteration ends when the relative change of the factors in a step is at most this number. Convergence is quadratic.
  real(dp), parameter :: last_step = 1.0e-6_dp
  !> Minimum absolute value of the divisor in a step; it replaces a smaller divisor
  real(dp), parameter :: min_divisor = 1.0e-100_dp

contains

  !> Body of `find_factors`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine find_here(m, c, radius, bound, s, q, converged, once) bind(C, name="lanes_gestell_factors")
    !$omp declare simd uniform(m, c, radius, bound, s, q, converged) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: m, once
    real(dp), intent(in) :: c(lanes, 0:2 * m - 1), radius(lanes), bound(lanes)
    real(dp), intent(inout) :: s(lanes, 2 * m), q(lanes, 2 * m), converged(lanes)
    real(dp) :: maximum(lanes)
    integer :: iteration, k

    maximum = 0
    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    s(:, m + 1:) = s(:, :m)
    q(:, m + 1:) = q(:, :m)
    if (m == 1) then
      s(:, 1) = -c(:, 1)
      q(:, 1) = c(:, 0)
      converged = 1
      return
    end if
    converged = 0
    do iteration = 1, max_iterations
      maximum = 0
      do k = 1, m
        call improve(m, k, c, bound, converged, s, q, maximum)
      end do
      converged = merge(1.0_dp, converged, maximum <= (last_step * radius**2)**2)
      if (all(converged > 0)) exit
    end do
  end subroutine find_here

  !> Computes the quadratic factors of the polynomials t^2m + c_(2m-1) t^(2m-1) + ... + c_0 from starting values. A lane does not
  !> change once it has converged, so no lane depends on another.
  pure subroutine find_factors(length, m, c, radius, bound, s, q, converged)
    !> `length`: number of double precision numbers in a vector register (gestell_base_processor). `m`: number of factors.
    integer, intent(in) :: length, m
    !> `c`: coefficients. `radius`: geometric mean of the moduli of the roots. `bound`: bound on the moduli of all roots.
    real(dp), intent(in) :: c(lanes, 0:2 * m - 1), radius(lanes), bound(lanes)
    !> Coefficients s_k and q_k of the factors t^2 - s_k t + q_k: on input starting values, on output the result. The second half
    !> of each array is a copy of the first half, which has the shape (lanes, m).
    real(dp), intent(inout) :: s(lanes, 2 * m), q(lanes, 2 * m)
    !> 1 in lanes that have converged, 0 in all others
    real(dp), intent(out) :: converged(lanes)
    procedure(find_here), bind(C, name="_ZGVeN2uuuuuuul_lanes_gestell_factors") :: find_512
    procedure(find_here), bind(C, name="_ZGVdN2uuuuuuul_lanes_gestell_factors") :: find_256

    if (has_versions .and. length == 8) then
      call find_512(m, c, radius, bound, s, q, converged, 1)
    else if (has_versions .and. length == 4) then
      call find_256(m, c, radius, bound, s, q, converged, 1)
    else
      call find_here(m, c, radius, bound, s, q, converged, 1)
    end if
  end subroutine find_factors

  !> Updates factor `k`, t^2 - s t + q, in the lanes that have not converged. `maximum`: square of the largest change of a factor
  !> so far, in the unit of q.
  pure subroutine improve(m, k, c, bound, converged, s, q, maximum)
    integer, intent(in) :: m, k
    real(dp), intent(in) :: c(lanes, 0:2 * m - 1), bound(lanes), converged(lanes)
    real(dp), intent(inout) :: s(lanes, 2 * m), q(lanes, 2 * m), maximum(lanes)
    real(dp) :: p1(lanes), p0(lanes), g1, g0, a, b, next, share, ds, dq
    integer :: lane, i, j

    ! p = p_1 t + p_0 modulo f_k, by Horner's scheme.
    !GCC$ ivdep
    do lane = 1, lanes
      g1 = 1
      g0 = c(lane, 2 * m - 1)
      i = 2 * m - 2
      do
        next = g1 * s(lane, k) + g0
        g0 = c(lane, i) - g1 * q(lane, k)
        g1 = next
        i = i - 1
        if (i < 0) exit
      end do
      p1(lane) = g1
      p0(lane) = g0
    end do
    ! g = g_1 t + g_0 modulo f_k: each f_j is replaced by f_j - f_k = a t + b. The divisor is g (-g_1 t + g_1 s + g_0) = g_0^2 + g_0
    ! g_1 s + g_1^2 q.
    !GCC$ ivdep
    do lane = 1, lanes
      g1 = 0
      g0 = 1
      j = k + 1
      do
        a = s(lane, k) - s(lane, j)
        b = q(lane, j) - q(lane, k)
        next = g1 * (a * s(lane, k) + b) + g0 * a
        g0 = g0 * b - g1 * a * q(lane, k)
        g1 = next
        j = j + 1
        if (j >= k + m) exit
      end do
      share = g0 + g1 * s(lane, k)
      next = g0 * share + g1**2 * q(lane, k)
      next = (1 - converged(lane)) / sign(max(abs(next), min_divisor), next)
      ds = (p0(lane) * g1 - p1(lane) * g0) * next
      dq = (p0(lane) * share + p1(lane) * g1 * q(lane, k)) * next
      maximum(lane) = max(maximum(lane), dq**2 + ds**2 * abs(q(lane, k)))
      s(lane, k) = max(-2 * bound(lane), min(2 * bound(lane), s(lane, k) + ds))
      q(lane, k) = max(-bound(lane)**2, min(bound(lane)**2, q(lane, k) + dq))
      s(lane, k + m) = s(lane, k)
      q(lane, k + m) = q(lane, k)
    end do
  end subroutine improve

end module gestell_math_batch_quadratic_factors
