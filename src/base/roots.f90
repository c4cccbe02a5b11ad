!> Eigenvalues of small matrices, eight side by side: all roots of their characteristic polynomials at once.
module gestell_base_roots
  use gestell_base_hessenberg, only: evaluate, hessenberg_type, most_states
  use gestell_base_kinds, only: dp, pi
  use gestell_base_lanes, only: lanes
  implicit none (type, external)
  private

  public :: find_roots

  !> Iterations at most, and the last step, relative to the matrix' norm, that leaves no error: convergence is cubic, and where
  !> it is not, roundoff keeps the steps above this.
  integer, parameter :: most_iterations = 40
  real(dp), parameter :: last_step = 1.0e-9_dp

contains

  !> The eigenvalues z, shapes (lanes, n), by the iteration of Aberth and Ehrlich: Newton's steps for p / q, where q has the
  !> other approximations as its roots. `converged`, shape (lanes): 1, or 0 where they were not all found. A lane stands
  !> still once it has converged: nothing in it depends on its neighbours.
  pure subroutine find_roots(h, z_re, z_im, converged)
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(out) :: z_re(lanes, most_states), z_im(lanes, most_states), converged(lanes)
    real(dp) :: greatest(lanes), difference
    integer :: iteration, k, lane

    call start(h, z_re, z_im)
    converged = 0
    do iteration = 1, most_iterations
      greatest = 0
      do k = 1, h%n
        call improve(h, k, converged, z_re, z_im, greatest)
      end do
      converged = merge(1.0_dp, converged, greatest <= (last_step * h%norm)**2)
      if (all(converged > 0)) exit
    end do
    ! Found twice, missed another time: the sum tells.
    do lane = 1, lanes
      difference = abs(sum(z_re(lane, :h%n)) - h%trace(lane)) + abs(sum(z_im(lane, :h%n)))
      if (.not. difference <= last_step * h%norm(lane)) converged(lane) = 0
    end do
  end subroutine find_roots

  !> A circle around the mean of the eigenvalues, its radius the geometric mean of their distances.
  pure subroutine start(h, z_re, z_im)
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(out) :: z_re(lanes, most_states), z_im(lanes, most_states)
    real(dp) :: centre(lanes), zero(lanes), p_re(lanes), p_im(lanes), d_re(lanes), d_im(lanes), radius(lanes)
    integer :: k

    centre = h%trace / h%n
    zero = 0
    call evaluate(h, centre, zero, p_re, p_im, d_re, d_im)
    radius = max(abs(p_re) * h%product, tiny(1.0_dp))**(1.0_dp / h%n)
    radius = max(radius, 1.0e-3_dp * h%norm)
    do k = 1, h%n
      ! No symmetry about the real axis, which the iteration would keep.
      z_re(:, k) = centre + radius * cos(2 * pi * (k - 0.7_dp) / h%n)
      z_im(:, k) = radius * sin(2 * pi * (k - 0.7_dp) / h%n)
    end do
  end subroutine start

  !> A step for root `k` in the lanes that have not converged; `greatest`: squares of the greatest steps so far.
  pure subroutine improve(h, k, converged, z_re, z_im, greatest)
    type(hessenberg_type), intent(in) :: h
    integer, intent(in) :: k
    real(dp), intent(in) :: converged(lanes)
    real(dp), intent(inout) :: z_re(lanes, most_states), z_im(lanes, most_states), greatest(lanes)
    real(dp) :: p_re(lanes), p_im(lanes), d_re(lanes), d_im(lanes)
    real(dp) :: q_re(lanes), q_im(lanes), e_re(lanes), e_im(lanes), a, b, c, n_re, n_im, w_re, w_im
    integer :: lane, j

    call evaluate(h, z_re(:, k), z_im(:, k), p_re, p_im, d_re, d_im)
    q_re = 1
    q_im = 0
    e_re = 0
    e_im = 0
    do j = 1, h%n
      if (j == k) cycle
      !GCC$ ivdep
      do lane = 1, lanes
        a = z_re(lane, k) - z_re(lane, j)
        b = z_im(lane, k) - z_im(lane, j)
        c = e_re(lane) * a - e_im(lane) * b + q_re(lane)
        e_im(lane) = e_re(lane) * b + e_im(lane) * a + q_im(lane)
        e_re(lane) = c
        c = q_re(lane) * a - q_im(lane) * b
        q_im(lane) = q_re(lane) * b + q_im(lane) * a
        q_re(lane) = c
      end do
    end do
    !GCC$ ivdep
    do lane = 1, lanes
      ! p q / (p' q - p q')
      n_re = p_re(lane) * q_re(lane) - p_im(lane) * q_im(lane)
      n_im = p_re(lane) * q_im(lane) + p_im(lane) * q_re(lane)
      a = d_re(lane) * q_re(lane) - d_im(lane) * q_im(lane) - (p_re(lane) * e_re(lane) - p_im(lane) * e_im(lane))
      b = d_re(lane) * q_im(lane) + d_im(lane) * q_re(lane) - (p_re(lane) * e_im(lane) + p_im(lane) * e_re(lane))
      c = (1 - converged(lane)) / max(a**2 + b**2, tiny(1.0_dp))
      w_re = (n_re * a + n_im * b) * c
      w_im = (n_im * a - n_re * b) * c
      z_re(lane, k) = z_re(lane, k) - w_re
      z_im(lane, k) = z_im(lane, k) - w_im
      greatest(lane) = max(greatest(lane), w_re**2 + w_im**2)
    end do
  end subroutine improve

end module gestell_base_roots
