!> Discs around the eigenvalues of small matrices, eight side by side: set_multipliers' discs where none touches another.
module gestell_floquet_multipliers_gershgorin
  use gestell_math_hessenberg, only: hessenberg_type, most_states
  use gestell_base_processor, only: has_versions
  use gestell_math_lanes, only: lanes
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: find_disc, find_discs

  abstract interface
    pure subroutine disc_version(h, z_re, z_im, perturbation, radius, impurity, worst, once) bind(C)
      import :: c_int, dp, hessenberg_type, lanes
      implicit none (type, external)
      type(hessenberg_type), intent(in) :: h
      real(dp), intent(in) :: z_re(lanes), z_im(lanes), perturbation(lanes)
      real(dp), intent(inout) :: radius(lanes), impurity(lanes), worst(lanes)
      integer(c_int), value :: once
    end subroutine disc_version
  end interface

  procedure(disc_version), bind(C, name="_ZGVeN2uuuuuuul_lanes_gestell_disc") :: disc_512
  procedure(disc_version), bind(C, name="_ZGVdN2uuuuuuul_lanes_gestell_disc") :: disc_256

contains

  !> The radii of the discs around the eigenvalues `z` of `h`, shapes (lanes, most_states), where the error of the matrix is at most
  !> `perturbation` in norm, shape (lanes), the eigenvalues' rounding included. `conjugate`: of those that are the conjugate of the
  !> one before the same is known as of that. `separate`, shape (lanes): 1, or 0 where discs touch or an eigenvector is too
  !> inaccurate to tell; then the radii are nothing. `length`: of the processor's vectors.
  !>
  !> What couples an eigenvalue to others counts to second order: `apart` of gestell_floquet_multipliers, where every one of the n
  !> elements of a row is known by the same bound. With x the greatest of the others' radii over n times the room between the discs
  !> alpha is x / (1 + x).
  pure subroutine find_discs(length, h, z_re, z_im, conjugate, perturbation, radius, separate)
    integer, intent(in) :: length
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(in) :: z_re(lanes, most_states), z_im(lanes, most_states), perturbation(lanes)
    logical, intent(in) :: conjugate(most_states)
    real(dp), intent(out) :: radius(lanes, most_states), separate(lanes)
    !> Part of the way to the next eigenvalue that a vector's error may be worth; room that is none.
    real(dp), parameter :: small = 0.01_dp, nothing = 1.0e-100_dp
    real(dp), dimension(lanes, most_states) :: nearest, impurity, x
    real(dp) :: worst(lanes), part, square, distance, share
    integer :: i, k, lane

    worst = 1
    do k = 1, h%n
      if (conjugate(k)) then
        radius(:, k) = radius(:, k - 1)
      else
        call find_disc(length, h, z_re(:, k), z_im(:, k), perturbation, radius(:, k), impurity(:, k), worst)
      end if
    end do
    part = 1.0_dp / h%n
    separate = 1
    nearest = huge(1.0_dp)
    x = 0
    do k = 2, h%n
      do i = 1, k - 1
        ! As far apart as their conjugates.
        if (conjugate(i)) cycle
        !GCC$ ivdep
        do lane = 1, lanes
          square = (z_re(lane, i) - z_re(lane, k))**2 + (z_im(lane, i) - z_im(lane, k))**2
          distance = sqrt(square)
          nearest(lane, i) = min(nearest(lane, i), square)
          nearest(lane, k) = min(nearest(lane, k), square)
          separate(lane) = merge(separate(lane), 0.0_dp, (1 - small) * distance > radius(lane, i) + radius(lane, k))
          share = part / max(distance - radius(lane, i) - radius(lane, k), nothing)
          x(lane, i) = max(x(lane, i), radius(lane, k) * share)
          x(lane, k) = max(x(lane, k), radius(lane, i) * share)
        end do
      end do
    end do
    do k = 1, h%n
      if (conjugate(k)) then
        radius(:, k) = radius(:, k - 1)
        cycle
      end if
      if (k < h%n) then
        if (conjugate(k + 1)) then
          nearest(:, k) = min(nearest(:, k), nearest(:, k + 1))
          x(:, k) = max(x(:, k), x(:, k + 1))
        end if
      end if
      separate = merge(separate, 0.0_dp, (impurity(:, k) * worst)**2 <= small**2 * nearest(:, k))
      ! 1 / n + (1 - 1 / n) alpha.
      radius(:, k) = radius(:, k) * (part + x(:, k)) / (1 + x(:, k))
    end do
  end subroutine find_discs

  !> One eigenvalue's disc. With x_n = 1 all rows but the first of (H - z E) x = 0 give the eigenvector, with y_1 = 1 all columns
  !> but the last the left one; the condition is |x| |y| / |y' x|. `impurity`: the residuals of the two, which is what other
  !> eigenvectors may have added to them but for their conditions; `worst` condition so far. `length`: of the processor's vectors.
  pure subroutine find_disc(length, h, z_re, z_im, perturbation, radius, impurity, worst)
    integer, intent(in) :: length
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(in) :: z_re(lanes), z_im(lanes), perturbation(lanes)
    real(dp), intent(out) :: radius(lanes), impurity(lanes)
    real(dp), intent(inout) :: worst(lanes)

    if (has_versions .and. length == 8) then
      call disc_512(h, z_re, z_im, perturbation, radius, impurity, worst, 1)
    else if (has_versions .and. length == 4) then
      call disc_256(h, z_re, z_im, perturbation, radius, impurity, worst, 1)
    else
      call disc_here(h, z_re, z_im, perturbation, radius, impurity, worst, 1)
    end if
  end subroutine find_disc

  pure subroutine disc_here(h, z_re, z_im, perturbation, radius, impurity, worst, once) bind(C, name="lanes_gestell_disc")
    !$omp declare simd uniform(h, z_re, z_im, perturbation, radius, impurity, worst) linear(once) simdlen(2) notinbranch
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(in) :: z_re(lanes), z_im(lanes), perturbation(lanes)
    real(dp), intent(inout) :: radius(lanes), impurity(lanes), worst(lanes)
    integer(c_int), value :: once
    !> The square of a product y' x that is none.
    real(dp), parameter :: nothing = 1.0e-100_dp
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
    ! The second of two: gestell_base_processor.
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
      ! Squares.
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
      residual = max(x_re(lane, 0)**2 + x_im(lane, 0)**2, y_re(lane, n + 1)**2 + y_im(lane, n + 1)**2)
      condition = sqrt(x_norm / max(s_re**2 + s_im**2, nothing)) * sqrt(y_norm)
      impurity(lane) = sqrt(residual / min(x_norm, y_norm))
      radius(lane) = n * (perturbation(lane) + sqrt(residual / max(x_norm, y_norm))) * condition
      worst(lane) = max(worst(lane), condition)
    end do
  end subroutine disc_here

end module gestell_floquet_multipliers_gershgorin
