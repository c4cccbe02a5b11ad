!> Computes the eigenvalues of eight small matrices together, as the roots of their characteristic polynomials.
module gestell_math_batch_characteristic_roots
  use gestell_math_batch_hessenberg, only: characteristic_polynomial, evaluate, hessenberg_type, max_states
  use gestell_base_kinds, only: pi
  use gestell_base_processor, only: has_versions
  use gestell_math_lanes, only: lanes
  use gestell_math_batch_quadratic_factors, only: find_factors
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: find_roots, guess_roots

  !> Maximum number of iterations
  integer, parameter :: max_iterations = 40
  !> The iteration ends when every step is at most `last_step` times the norm of the matrix and at most `last_part` times the
  !> distance to the other roots. Convergence is cubic: the remaining error, about `last_step` times `last_part`^2, is below
  !> roundoff.
  real(dp), parameter :: last_step = 1.0e-9_dp, last_part = 1.0e-4_dp
  !> Indices of the implied loops that compute `begin_at`
  integer :: i, m
  !> Column m: cosines of the angles at which m conjugate pairs of roots start on a circle. The angles are not symmetric, because
  !> the iteration would preserve a symmetry.
  real(dp), parameter :: begin_at(max_states / 2, max_states / 2) = &
    & reshape([((cos(pi * (i - 0.6_dp) / m), i = 1, max_states / 2), m = 1, max_states / 2)], [max_states / 2, max_states / 2])

contains

  !> Computes starting values of the eigenvalues, shape (lanes, n): the roots of quadratic factors of the characteristic polynomial.
  !> If the factors do not converge, points on a circle are used. The centre of the circle is the mean of the eigenvalues; its
  !> radius is the geometric mean of their distances from the centre.
  pure subroutine guess_roots(length, h, z_re, z_im, conjugate, found)
    !> Number of double precision numbers in a vector register (gestell_base_processor)
    integer, intent(in) :: length
    type(hessenberg_type), intent(in) :: h
    !> `z_re`, `z_im`: real and imaginary parts of the starting values. `found`: 1 in lanes where the factors have converged, 0 in
    !> lanes with points on a circle.
    real(dp), intent(out) :: z_re(lanes, max_states), z_im(lanes, max_states), found(lanes)
    !> True for each root that is the conjugate of the preceding root in all lanes, shape (n); the iteration preserves this property
    logical, intent(out) :: conjugate(max_states)
    real(dp) :: c(lanes, 0:max_states), s(lanes, max_states), q(lanes, max_states)
    real(dp), dimension(lanes) :: mean, radius, middle, square
    integer :: n, k

    n = h%n
    mean = h%trace / n
    call characteristic_polynomial(h, mean, c)
    ! The mean may be an eigenvalue: the radius must not vanish.
    radius = max(max(abs(c(:, 0)), tiny(1.0_dp))**(1.0_dp / n), 1.0e-3_dp * h%norm)
    found = 0
    conjugate = .false.
    if (mod(n, 2) == 0) then
      do k = 1, n / 2
        s(:, k) = 2 * radius * begin_at(k, n / 2)
        q(:, k) = radius**2
      end do
      call find_factors(length, n / 2, c, radius, 2 * h%norm, s, q, found)
      do k = 1, n / 2
        middle = mean + s(:, k) / 2
        square = s(:, k)**2 / 4 - q(:, k)
        conjugate(2 * k) = all(found > 0 .and. square < 0)
        z_re(:, 2 * k - 1) = middle + sqrt(max(square, 0.0_dp))
        z_im(:, 2 * k - 1) = sqrt(max(-square, 0.0_dp))
        z_re(:, 2 * k) = middle - sqrt(max(square, 0.0_dp))
        z_im(:, 2 * k) = -sqrt(max(-square, 0.0_dp))
      end do
    end if
    if (all(found > 0)) return
    do k = 1, n
      where (.not. found > 0)
        ! No point lies on the real axis, which a point might be unable to leave.
        z_re(:, k) = mean + radius * cos(2 * pi * (k - 0.7_dp) / n)
        z_im(:, k) = radius * sin(2 * pi * (k - 0.7_dp) / n)
      end where
    end do
  end subroutine guess_roots

  !> Updates root `k` in the lanes that have not converged, from the polynomial p and its derivative d at this root. `maximum`:
  !> square of the largest step so far. `near`: positive where the step is too large compared with the distance to another root.
  pure subroutine step_here(n, k, p_re, p_im, d_re, d_im, converged, z_re, z_im, maximum, near, once) bind(C, &
    & name="lanes_gestell_aberth")
    !$omp declare simd uniform(n, k, p_re, p_im, d_re, d_im, converged, z_re, z_im, maximum, near) linear(once) simdlen(2) &
    !$omp& notinbranch
    integer(c_int), value :: n, k, once
    real(dp), intent(in) :: p_re(lanes), p_im(lanes), d_re(lanes), d_im(lanes), converged(lanes)
    real(dp), intent(inout) :: z_re(lanes, 2 * max_states), z_im(lanes, 2 * max_states), maximum(lanes), near(lanes)
    real(dp) :: moving(lanes), q_re, q_im, e_re, e_im, a, b, c, n_re, n_im, w_re, w_im
    integer :: lane, j

    moving = 1 - converged
    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      ! q and its derivative e
      q_re = 1
      q_im = 0
      e_re = 0
      e_im = 0
      j = k + 1
      do
        a = z_re(lane, k) - z_re(lane, j)
        b = z_im(lane, k) - z_im(lane, j)
        c = e_re * a - e_im * b + q_re
        e_im = e_re * b + e_im * a + q_im
        e_re = c
        c = q_re * a - q_im * b
        q_im = q_re * b + q_im * a
        q_re = c
        j = j + 1
        if (j >= k + n) exit
      end do
      ! p q / (p' q - p q')
      n_re = p_re(lane) * q_re - p_im(lane) * q_im
      n_im = p_re(lane) * q_im + p_im(lane) * q_re
      a = d_re(lane) * q_re - d_im(lane) * q_im - (p_re(lane) * e_re - p_im(lane) * e_im)
      b = d_re(lane) * q_im + d_im(lane) * q_re - (p_re(lane) * e_im + p_im(lane) * e_re)
      c = moving(lane) / max(a**2 + b**2, tiny(1.0_dp))
      n_re = n_re * c
      n_im = n_im * c
      w_re = n_re * a + n_im * b
      w_im = n_im * a - n_re * b
      z_re(lane, k) = z_re(lane, k) - w_re
      z_im(lane, k) = z_im(lane, k) - w_im
      z_re(lane, k + n) = z_re(lane, k)
      z_im(lane, k + n) = z_im(lane, k)
      c = w_re**2 + w_im**2
      maximum(lane) = max(maximum(lane), c)
      ! e / q is the sum of the reciprocal distances from the other roots.
      near(lane) = max(near(lane), c * (e_re**2 + e_im**2) - last_part**2 * (q_re**2 + q_im**2))
    end do
  end subroutine step_here

  !> Computes the eigenvalues z, shape (lanes, n), from starting values by the iteration of Aberth and Ehrlich. Each step is a
  !> Newton step for p / q. Here p is the characteristic polynomial, and q is the polynomial whose roots are the approximations of
  !> the other eigenvalues. From quadratic factors one step is usually sufficient; from points on a circle six or seven are
  !> needed. A lane does not change once it has converged, so no lane depends on another.
  pure subroutine find_roots(length, h, conjugate, z_re, z_im, converged)
    !> Number of double precision numbers in a vector register (gestell_base_processor)
    integer, intent(in) :: length
    type(hessenberg_type), intent(in) :: h
    !> True for each root that is the conjugate of the preceding root in all lanes, shape (n)
    logical, intent(in) :: conjugate(max_states)
    !> `z_re`, `z_im`: real and imaginary parts of the roots. `converged`: on input, 1 in lanes to be skipped; on output, 1 in lanes
    !> that have converged and 0 in all others.
    real(dp), intent(inout) :: z_re(lanes, max_states), z_im(lanes, max_states), converged(lanes)
    !> The n roots, stored twice in succession, so that a loop over the n - 1 other roots needs no test
    real(dp), dimension(lanes, 2 * max_states) :: w_re, w_im
    real(dp), dimension(lanes) :: maximum, near, p_re, p_im, d_re, d_im
    procedure(step_here), bind(C, name="_ZGVeN2uuuuuuuuuuul_lanes_gestell_aberth") :: step_512
    procedure(step_here), bind(C, name="_ZGVdN2uuuuuuuuuuul_lanes_gestell_aberth") :: step_256
    integer :: iteration, k

    do k = 1, h%n
      call set(h%n, k, z_re(:, k), z_im(:, k), w_re, w_im)
    end do
    do iteration = 1, max_iterations
      if (all(converged > 0)) exit
      maximum = 0
      near = 0
      do k = 1, h%n
        if (conjugate(k)) then
          call set(h%n, k, w_re(:, k - 1), -w_im(:, k - 1), w_re, w_im)
          cycle
        end if
        call evaluate(length, h, w_re(:, k), w_im(:, k), p_re, p_im, d_re, d_im)
        if (has_versions .and. length == 8) then
          call step_512(h%n, k, p_re, p_im, d_re, d_im, converged, w_re, w_im, maximum, near, 1)
        else if (has_versions .and. length == 4) then
          call step_256(h%n, k, p_re, p_im, d_re, d_im, converged, w_re, w_im, maximum, near, 1)
        else
          call step_here(h%n, k, p_re, p_im, d_re, d_im, converged, w_re, w_im, maximum, near, 1)
        end if
      end do
      converged = merge(1.0_dp, converged, maximum <= (last_step * h%norm)**2 .and. near <= 0)
    end do
    z_re = w_re(:, :max_states)
    z_im = w_im(:, :max_states)
  end subroutine find_roots

  !> Stores root `k` in both copies: the arrays contain the n roots twice in succession.
  pure subroutine set(n, k, re, im, z_re, z_im)
    integer, intent(in) :: n, k
    real(dp), intent(in) :: re(lanes), im(lanes)
    real(dp), intent(inout) :: z_re(lanes, 2 * max_states), z_im(lanes, 2 * max_states)

    z_re(:, k) = re
    z_im(:, k) = im
    z_re(:, k + n) = re
    z_im(:, k + n) = im
  end subroutine set

end module gestell_math_batch_characteristic_roots
