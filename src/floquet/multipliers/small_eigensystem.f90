!> Computes the eigenvalues and eigenvectors of one small matrix with the procedures written for stability charts. These
!> procedures find all roots of the characteristic polynomial at once and verify them by Gershgorin discs; Hyman's method gives
!> the eigenvectors. For six states LAPACK's dgeev takes twice as long.
module gestell_floquet_multipliers_small_eigensystem
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: vector_length
  use gestell_floquet_multipliers_gershgorin, only: discs_type, find_discs
  use gestell_math_batch_characteristic_roots, only: guess_roots
  use gestell_math_batch_hessenberg, only: hessenberg_type, max_states, of_one
  use gestell_math_lanes, only: lanes
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: small_eigensystem

  !> Householder reflections E - beta u u' that reduce a matrix to Hessenberg form. The first k elements of vector k are zero.
  type :: reflections_type
    real(dp) :: u(max_states, max_states) = 0, beta(max_states) = 0
  end type reflections_type

contains

  !> Computes the eigenvalues of `a`, shape (n, n), and its right and left eigenvectors as unit columns. Conjugates are adjacent.
  !> All three results are unallocated if the eigenvalues are not proved to be accurate to about roundoff.
  !>
  !> Hyman's vectors leave the residuals (H - z_k) x_k = -r_k e_1 and y_k (H - z_k) = -s_k e_n' (`find_vectors`), with unit
  !> vectors e_1, e_n. In terms of the eigenvectors, e_1 is the sum over j of x_j / (y_j x_j), and e_n' the sum of y_j / (y_j x_j).
  !> To remove the residuals to first order, the procedure adds to x_k the product of r_k and the sum over j /= k of
  !> x_j / (y_j x_j) / (z_j - z_k). To y_k it adds the product of s_k and the same sum with y_j in place of x_j.
  pure subroutine small_eigensystem(a, values, right, left)
    real(dp), intent(in) :: a(:, :)
    complex(dp), allocatable, intent(out) :: values(:), right(:, :), left(:, :)
    !> Limits on the size of a matrix. LAPACK solves matrices outside these limits.
    real(dp), parameter :: least = 1.0e-100_dp, most = 1.0e100_dp
    !> Maximum number of states for which this method is used, because it is faster than LAPACK's dgeev.
    integer, parameter :: max_small = 8
    !> The eigenvalues are accepted if their discs do not touch even when the matrix has an error of this many times the roundoff.
    real(dp), parameter :: many = 100
    type(reflections_type) :: reflections
    type(hessenberg_type) :: h
    type(discs_type) :: discs
    real(dp) :: b(max_states, max_states), found(lanes), rounding(lanes), unit, maximum
    real(dp), dimension(lanes, max_states) :: z_re, z_im
    complex(dp), dimension(size(a, 1)) :: rho, r, s, weight
    complex(dp) :: share
    complex(dp), dimension(size(a, 1), size(a, 1)) :: x, y
    logical :: conjugate(max_states)
    integer :: n, j, k

    n = size(a, 1)
    if (n < 2 .or. n > max_small) return
    ! NaN propagates through the sum; the factor keeps it from overflowing.
    maximum = 0
    do k = 1, n
      maximum = maximum + sum(abs(a(:, k)) / n**2)
    end do
    if (.not. ieee_is_finite(maximum)) return
    if (maximum < least .or. maximum > most) return
    unit = scale(1.0_dp, exponent(maximum * n**2))
    b(:n, :n) = a / unit
    call reduce(n, b, reflections)
    call of_one(n, b, h)
    call guess_roots(vector_length(), h, z_re, z_im, conjugate, found)
    rounding = n * epsilon(1.0_dp) * h%norm
    call find_discs(vector_length(), h, conjugate, many * rounding, z_re, z_im, discs)
    if (.not. found(1) * discs%sharp(1) * discs%separate(1) * h%sound(1) > 0) return
    ! Real eigenvalues get the imaginary part +0, as LAPACK returns them. Their logarithms then lie on the upper side of the branch
    ! cut.
    rho = cmplx(z_re(1, :n), merge(z_im(1, :n), 0.0_dp, abs(z_im(1, :n)) > 0), dp)
    do k = 1, n
      if (.not. conjugate(k)) call find_vectors(n, b, rho(k), x(:, k), y(:, k), r(k), s(k))
    end do
    do k = 2, n
      if (.not. conjugate(k)) cycle
      x(:, k) = conjg(x(:, k - 1))
      y(:, k) = conjg(y(:, k - 1))
    end do
    weight = 1 / sum(x * y, dim=1)
    values = unit * rho
    allocate(right(n, n), left(n, n))
    do k = 1, n
      if (conjugate(k)) cycle
      right(:, k) = x(:, k)
      left(:, k) = y(:, k)
      do j = 1, n
        if (j == k) cycle
        share = weight(j) / (rho(j) - rho(k))
        right(:, k) = right(:, k) + r(k) * share * x(:, j)
        left(:, k) = left(:, k) + s(k) * share * y(:, j)
      end do
      left(:, k) = conjg(left(:, k))
      call reflect(n, reflections, right(:, k))
      call reflect(n, reflections, left(:, k))
      right(:, k) = right(:, k) / sqrt(sum(right(:, k)%re**2 + right(:, k)%im**2))
      left(:, k) = left(:, k) / sqrt(sum(left(:, k)%re**2 + left(:, k)%im**2))
    end do
    do k = 2, n
      if (.not. conjugate(k)) cycle
      right(:, k) = conjg(right(:, k - 1))
      left(:, k) = conjg(left(:, k - 1))
    end do
  end subroutine small_eigensystem

  !> Reduces the first `n` rows and columns of `a` to Hessenberg form. Subdiagonal elements smaller than roundoff are increased to
  !> roundoff, because Hyman's method divides by them.
  pure subroutine reduce(n, a, reflections)
    integer, intent(in) :: n
    real(dp), intent(inout) :: a(max_states, max_states)
    type(reflections_type), intent(out) :: reflections
    real(dp) :: length, rounding
    integer :: i, j, k

    rounding = 0
    do k = 1, n
      rounding = rounding + sum(a(:n, k)**2)
    end do
    rounding = epsilon(1.0_dp) * sqrt(rounding)
    associate (u => reflections%u, beta => reflections%beta)
      do k = 1, n - 2
        length = sqrt(sum(a(k + 1:n, k)**2))
        if (length > rounding) then
          u(k + 1:n, k) = a(k + 1:n, k)
          u(k + 1, k) = u(k + 1, k) + sign(length, u(k + 1, k))
          beta(k) = 1 / (length * abs(u(k + 1, k)))
          do j = k, n
            a(k + 1:n, j) = a(k + 1:n, j) - beta(k) * sum(u(k + 1:n, k) * a(k + 1:n, j)) * u(k + 1:n, k)
          end do
          do i = 1, n
            length = beta(k) * sum(a(i, k + 1:n) * u(k + 1:n, k))
            a(i, k + 1:n) = a(i, k + 1:n) - length * u(k + 1:n, k)
          end do
        end if
        a(k + 2:n, k) = 0
      end do
    end associate
    do k = 2, n
      a(k, k - 1) = sign(max(abs(a(k, k - 1)), rounding), a(k, k - 1))
    end do
  end subroutine reduce

  !> Computes eigenvectors of the Hessenberg matrix `h` for an approximate eigenvalue `z` by Hyman's method: (H - z) x = -r e_1 with
  !> x_n = 1, and y (H - z) = -s e_n' with y_1 = 1.
  pure subroutine find_vectors(n, h, z, x, y, r, s)
    integer, intent(in) :: n
    real(dp), intent(in) :: h(max_states, max_states)
    complex(dp), intent(in) :: z
    complex(dp), intent(out) :: x(n), y(n), r, s
    integer :: i, k

    x(n) = 1
    do i = n, 2, -1
      x(i - 1) = (z * x(i) - sum(h(i, i:n) * x(i:n))) / h(i, i - 1)
    end do
    r = z * x(1) - sum(h(1, :n) * x)
    y(1) = 1
    do k = 1, n - 1
      y(k + 1) = (z * y(k) - sum(h(:k, k) * y(:k))) / h(k + 1, k)
    end do
    s = z * y(n) - sum(h(:n, n) * y)
  end subroutine find_vectors

  !> Replaces vector `v` by Q `v`, where Q is the product of the reflections.
  pure subroutine reflect(n, reflections, v)
    integer, intent(in) :: n
    type(reflections_type), intent(in) :: reflections
    complex(dp), intent(inout) :: v(n)
    complex(dp) :: share
    integer :: k

    do k = n - 2, 1, -1
      associate (u => reflections%u(k + 1:n, k))
        share = reflections%beta(k) * sum(u * v(k + 1:n))
        v(k + 1:n) = v(k + 1:n) - share * u
      end associate
    end do
  end subroutine reflect

end module gestell_floquet_multipliers_small_eigensystem
