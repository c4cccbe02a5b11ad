!> Computes Newton's step, the condition number and the residuals for approximate eigenvalues of eight small matrices at once. The
!> eigenvectors that they require come from Hyman's method.
module gestell_floquet_multipliers_hyman
  use gestell_math_batch_hessenberg, only: hessenberg_type, max_states
  use gestell_base_processor, only: has_versions
  use gestell_math_lanes, only: lanes
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: try_eigenvalue

  !> Replaces |y x|^2 = 0 in denominators.
  real(dp), parameter :: nothing = 1.0e-100_dp

contains

  !> Body of `try_eigenvalue`, with the same arguments, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine try_here(h, z_re, z_im, step_re, step_im, condition, right, left, once) bind(C, name="lanes_gestell_hyman")
    !$omp declare simd uniform(h, z_re, z_im, step_re, step_im, condition, right, left) linear(once) simdlen(2) notinbranch
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(in) :: z_re(lanes), z_im(lanes)
    real(dp), intent(inout) :: step_re(lanes), step_im(lanes), condition(lanes), right(lanes), left(lanes)
    integer(c_int), value :: once
    real(dp) :: x_re(lanes, 0:max_states), x_im(lanes, 0:max_states), y_re(lanes, max_states + 1), y_im(lanes, max_states + 1)
    real(dp) :: s_re, s_im, m_re, m_im, x_norm, y_norm, share
    integer :: i, j, k, lane, n

    n = h%n
    x_re(:, n) = 1
    x_im(:, n) = 0
    ! The arrays y_re and y_im hold the components of y divided by those of v.
    y_re(:, 1) = 1
    y_im(:, 1) = 0
    ! The second of two vectorised calls has nothing to do: see gestell_base_processor.
    if (once > 1) return
    do k = 1, n
      i = n + 1 - k
      !GCC$ ivdep
      do lane = 1, lanes
        s_re = h%v(lane, i) * (z_re(lane) * x_re(lane, i) - z_im(lane) * x_im(lane, i))
        s_im = h%v(lane, i) * (z_re(lane) * x_im(lane, i) + z_im(lane) * x_re(lane, i))
        m_re = h%v(lane, k) * (z_re(lane) * y_re(lane, k) - z_im(lane) * y_im(lane, k))
        m_im = h%v(lane, k) * (z_re(lane) * y_im(lane, k) + z_im(lane) * y_re(lane, k))
        j = 1
        do
          s_re = s_re + h%g(lane, i, i - 1 + j) * x_re(lane, i - 1 + j)
          s_im = s_im + h%g(lane, i, i - 1 + j) * x_im(lane, i - 1 + j)
          m_re = m_re + h%g(lane, j, k) * y_re(lane, j)
          m_im = m_im + h%g(lane, j, k) * y_im(lane, j)
          j = j + 1
          if (j > k) exit
        end do
        x_re(lane, i - 1) = s_re
        x_im(lane, i - 1) = s_im
        y_re(lane, k + 1) = m_re
        y_im(lane, k + 1) = m_im
      end do
    end do
    !GCC$ ivdep
    do lane = 1, lanes
      s_re = 0
      s_im = 0
      ! x_norm and y_norm hold the squares of the norms.
      x_norm = 0
      y_norm = 0
      i = 1
      do
        m_re = h%v(lane, i) * y_re(lane, i)
        m_im = h%v(lane, i) * y_im(lane, i)
        x_norm = x_norm + (x_re(lane, i)**2 + x_im(lane, i)**2)
        y_norm = y_norm + (m_re**2 + m_im**2)
        s_re = s_re + (m_re * x_re(lane, i) - m_im * x_im(lane, i))
        s_im = s_im + (m_re * x_im(lane, i) + m_im * x_re(lane, i))
        i = i + 1
        if (i > n) exit
      end do
      right(lane) = sqrt((x_re(lane, 0)**2 + x_im(lane, 0)**2) / x_norm)
      left(lane) = sqrt((y_re(lane, n + 1)**2 + y_im(lane, n + 1)**2) / y_norm)
      ! x_0 / (y x)
      share = 1 / max(s_re**2 + s_im**2, nothing)
      step_re(lane) = (x_re(lane, 0) * s_re + x_im(lane, 0) * s_im) * share
      step_im(lane) = (x_im(lane, 0) * s_re - x_re(lane, 0) * s_im) * share
      condition(lane) = sqrt(x_norm * share) * sqrt(y_norm)
    end do
  end subroutine try_here

  !> For an approximate eigenvalue `z` in each lane, computes Newton's step, the condition number |x| |y| / |y x|, and the residuals
  !> of the right eigenvector x and the left eigenvector y. With x_n = 1, all rows of (H - z E) x = 0 except the first determine x.
  !> With y_1 = 1, all columns of y (H - z E) = 0 except the last determine y.
  pure subroutine try_eigenvalue(length, h, z_re, z_im, step_re, step_im, condition, right, left)
    !> Number of double precision numbers in a vector register of the processor
    integer, intent(in) :: length
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(in) :: z_re(lanes), z_im(lanes)
    !> `step_re`, `step_im`: real and imaginary parts of Newton's step, to be subtracted from z. `condition`: condition number.
    !> `right`, `left`: residuals of the right and left unit eigenvectors.
    real(dp), intent(out) :: step_re(lanes), step_im(lanes), condition(lanes), right(lanes), left(lanes)
    procedure(try_here), bind(C, name="_ZGVeN2uuuuuuuul_lanes_gestell_hyman") :: try_512
    procedure(try_here), bind(C, name="_ZGVdN2uuuuuuuul_lanes_gestell_hyman") :: try_256

    if (has_versions .and. length == 8) then
      call try_512(h, z_re, z_im, step_re, step_im, condition, right, left, 1)
    else if (has_versions .and. length == 4) then
      call try_256(h, z_re, z_im, step_re, step_im, condition, right, left, 1)
    else
      call try_here(h, z_re, z_im, step_re, step_im, condition, right, left, 1)
    end if
  end subroutine try_eigenvalue

end module gestell_floquet_multipliers_hyman
