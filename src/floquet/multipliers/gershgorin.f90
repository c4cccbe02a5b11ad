!> Discs around the eigenvalues of small matrices, eight side by side: set_multipliers' discs where none touches another.
module gestell_floquet_multipliers_gershgorin
  use gestell_math_hessenberg, only: hessenberg_type, most_states
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  implicit none (type, external)
  private

  public :: find_disc, find_discs

contains

  !> The radii of the discs around the eigenvalues `z` of `h`, shapes (lanes, most_states), where the error of the matrix is at most
  !> `perturbation` in norm, shape (lanes), the eigenvalues' rounding included. `separate`, shape (lanes): 1, or 0 where discs touch
  !> or an eigenvector is too inaccurate to tell; then the radii are nothing.
  pure subroutine find_discs(h, z_re, z_im, perturbation, radius, separate)
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(in) :: z_re(lanes, most_states), z_im(lanes, most_states), perturbation(lanes)
    real(dp), intent(out) :: radius(lanes, most_states), separate(lanes)
    !> Part of the way to the next eigenvalue that a vector's error may be worth.
    real(dp), parameter :: small = 0.01_dp
    real(dp) :: gap(lanes, most_states), impurity(lanes, most_states), worst(lanes), distance
    integer :: i, k, lane

    worst = 1
    do k = 1, h%n
      call find_disc(h, z_re(:, k), z_im(:, k), perturbation, radius(:, k), impurity(:, k), worst)
    end do
    separate = 1
    gap = huge(1.0_dp)
    do k = 2, h%n
      do i = 1, k - 1
        !GCC$ ivdep
        do lane = 1, lanes
          distance = sqrt((z_re(lane, i) - z_re(lane, k))**2 + (z_im(lane, i) - z_im(lane, k))**2)
          gap(lane, i) = min(gap(lane, i), distance)
          gap(lane, k) = min(gap(lane, k), distance)
          separate(lane) = merge(separate(lane), 0.0_dp, (1 - small) * distance > radius(lane, i) + radius(lane, k))
        end do
      end do
    end do
    do k = 1, h%n
      separate = merge(separate, 0.0_dp, impurity(:, k) * worst <= small * gap(:, k))
    end do
    call shrink(h%n, z_re, z_im, radius)
  end subroutine find_discs

  !> What couples an eigenvalue to others counts to second order: `apart` of gestell_floquet_multipliers, where every one of the n
  !> elements of a row is known by the same bound; where discs touch alpha is 1, which shrinks nothing.
  pure subroutine shrink(n, z_re, z_im, radius)
    integer, intent(in) :: n
    real(dp), intent(in) :: z_re(lanes, most_states), z_im(lanes, most_states)
    real(dp), intent(inout) :: radius(lanes, most_states)
    real(dp) :: alpha(lanes, most_states), part, distance, room
    integer :: i, k, lane

    part = 1.0_dp / n
    alpha = 0
    do k = 2, n
      do i = 1, k - 1
        !GCC$ ivdep
        do lane = 1, lanes
          distance = sqrt((z_re(lane, i) - z_re(lane, k))**2 + (z_im(lane, i) - z_im(lane, k))**2)
          room = max(distance - radius(lane, i) - radius(lane, k), tiny(1.0_dp))
          alpha(lane, i) = max(alpha(lane, i), part * radius(lane, k) / (room + part * radius(lane, k)))
          alpha(lane, k) = max(alpha(lane, k), part * radius(lane, i) / (room + part * radius(lane, i)))
        end do
      end do
    end do
    do k = 1, n
      radius(:, k) = radius(:, k) * (part + (1 - part) * alpha(:, k))
    end do
  end subroutine shrink

  !> One eigenvalue's disc. With x_n = 1 all rows but the first of (H - z E) x = 0 give the eigenvector, with y_1 = 1 all columns
  !> but the last the left one; the condition is |x| |y| / |y' x|. `impurity`: the residuals of the two, which is what other
  !> eigenvectors may have added to them but for their conditions; `worst` condition so far.
  pure subroutine find_disc(h, z_re, z_im, perturbation, radius, impurity, worst)
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(in) :: z_re(lanes), z_im(lanes), perturbation(lanes)
    real(dp), intent(out) :: radius(lanes), impurity(lanes)
    real(dp), intent(inout) :: worst(lanes)
    real(dp) :: x_re(lanes, 0:most_states), x_im(lanes, 0:most_states)
    real(dp) :: y_re(lanes, most_states + 1), y_im(lanes, most_states + 1)
    real(dp) :: s_re, s_im, m_re, m_im, x_norm, y_norm, residual, condition
    integer :: i, j, k, lane, n

    n = h%n
    x_re(:, n) = 1
    x_im(:, n) = 0
    ! The components of y divided by those of v.
    y_re(:, 1) = 1
    y_im(:, 1) = 0
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
      x_norm = sqrt(x_norm)
      y_norm = sqrt(y_norm)
      condition = x_norm * y_norm / max(sqrt(s_re**2 + s_im**2), tiny(1.0_dp))
      residual = sqrt(max(x_re(lane, 0)**2 + x_im(lane, 0)**2, y_re(lane, n + 1)**2 + y_im(lane, n + 1)**2))
      impurity(lane) = residual / min(x_norm, y_norm)
      radius(lane) = n * (perturbation(lane) + residual / max(x_norm, y_norm)) * condition
      worst(lane) = max(worst(lane), condition)
    end do
  end subroutine find_disc

end module gestell_floquet_multipliers_gershgorin
