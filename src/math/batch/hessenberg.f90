!> Hessenberg matrices, eight side by side as in gestell_math_lanes. Values of their characteristic polynomials are computed without
!> the coefficients of the polynomials. Only starting values use coefficients (`characteristic_polynomial`).
!>
!> Hyman's method (J. H. Wilkinson, The Algebraic Eigenvalue Problem, chapter 7): with x_n = 1, rows n ... 2 of (H - lambda E) x = 0
!> give x_(n-1) ... x_1. The residual of row 1, r(lambda), equals det(H - lambda E) up to a constant factor. Its rounding error is
!> equivalent to changing each element of the matrix by a few roundings, whatever the size of the subdiagonal elements.
module gestell_math_batch_hessenberg
  use gestell_base_processor, only: has_versions
  use gestell_math_lanes, only: lanes
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: characteristic_polynomial, evaluate, new_hessenberg, of_one

  !> Maximum number of rows of a matrix
  integer, parameter, public :: max_states = 12

  !> Smallest accepted product of the subdiagonal elements; with a smaller product, numbers may overflow
  real(dp), parameter :: min_product = 1.0e-100_dp

  !> Hessenberg matrices with n rows. The first index of every array is the lane.
  type, bind(C), public :: hessenberg_type
    integer(c_int) :: n = 0
    !> Elements of the matrix with reversed sign; each row except row 1 is divided by its subdiagonal element. Shape (lanes,
    !> max_states, max_states)
    real(dp) :: g(lanes, max_states, max_states)
    !> Reciprocals of the subdiagonal elements h(i, i-1) in rows i > 1, and 1 in row 1; shape (lanes, max_states)
    real(dp) :: v(lanes, max_states)
    !> `norm`: Frobenius norm. `trace`: trace. `product`: product of the absolute values of the subdiagonal elements.
    real(dp) :: norm(lanes), trace(lanes), product(lanes)
    !> 1 if the matrix is valid. 0 if `product` is so small that numbers may overflow; the subdiagonal elements are then replaced by
    !> 1
    real(dp) :: sound(lanes)
  end type hessenberg_type

contains

  !> Applies the Householder reflection E - beta u u' to `a` from both sides. It makes all elements of column `k` below the
  !> subdiagonal zero.
  pure subroutine reflect_here(a, n, k, once) bind(C, name="lanes_gestell_reflect")
    !$omp declare simd uniform(a, n, k) linear(once) simdlen(2) notinbranch
    real(dp), intent(inout) :: a(lanes, max_states, max_states)
    integer(c_int), value :: n, k, once
    !> Minimum length (Euclidean norm) of the part of a column below the diagonal; a shorter part is not reflected.
    real(dp), parameter :: nothing = 1.0e-100_dp
    real(dp) :: u(lanes, max_states), beta(lanes), share(lanes), length, sum
    integer :: i, j, lane

    do i = k + 1, n
      u(:, i) = a(:, i, k)
    end do
    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      sum = 0
      i = k + 1
      do
        sum = sum + u(lane, i)**2
        i = i + 1
        if (i > n) exit
      end do
      length = sqrt(sum)
      beta(lane) = merge(1 / (max(length, nothing) * (max(length, nothing) + abs(u(lane, k + 1)))), 0.0_dp, length > nothing)
      u(lane, k + 1) = u(lane, k + 1) + sign(length, u(lane, k + 1))
      a(lane, k + 1, k) = merge(-sign(length, u(lane, k + 1)), a(lane, k + 1, k), length > nothing)
    end do
    do j = k + 1, n
      !GCC$ ivdep
      do lane = 1, lanes
        sum = 0
        i = k + 1
        do
          sum = sum + u(lane, i) * a(lane, i, j)
          i = i + 1
          if (i > n) exit
        end do
        share(lane) = sum * beta(lane)
      end do
      do i = k + 1, n
        !GCC$ unroll 1
        do lane = 1, lanes
          a(lane, i, j) = a(lane, i, j) - share(lane) * u(lane, i)
        end do
      end do
    end do
    do i = 1, n
      !GCC$ ivdep
      do lane = 1, lanes
        sum = 0
        j = k + 1
        do
          sum = sum + u(lane, j) * a(lane, i, j)
          j = j + 1
          if (j > n) exit
        end do
        share(lane) = sum * beta(lane)
      end do
      do j = k + 1, n
        !GCC$ unroll 1
        do lane = 1, lanes
          a(lane, i, j) = a(lane, i, j) - share(lane) * u(lane, j)
        end do
      end do
    end do
  end subroutine reflect_here

  !> Reduces the matrices `a`, shape (lanes, max_states, max_states), to Hessenberg form by Householder reflections. The matrices
  !> have `n` rows; their elements should be below about 1. Subdiagonal elements smaller than roundoff are increased to roundoff.
  !> `a` is overwritten. `length`: number of double precision numbers in a vector register (gestell_base_processor).
  pure subroutine new_hessenberg(length, a, n, h)
    real(dp), intent(inout) :: a(lanes, max_states, max_states)
    integer, intent(in) :: length, n
    type(hessenberg_type), intent(out) :: h
    procedure(reflect_here), bind(C, name="_ZGVeN2uuul_lanes_gestell_reflect") :: reflect_512
    procedure(reflect_here), bind(C, name="_ZGVdN2uuul_lanes_gestell_reflect") :: reflect_256
    real(dp) :: sum
    integer :: i, j, k, lane

    h%n = n
    h%norm = 0
    h%trace = 0
    do j = 1, n
      h%trace = h%trace + a(:, j, j)
      !GCC$ ivdep
      do lane = 1, lanes
        sum = h%norm(lane)
        i = 1
        do
          sum = sum + a(lane, i, j)**2
          i = i + 1
          if (i > n) exit
        end do
        h%norm(lane) = sum
      end do
    end do
    h%norm = sqrt(h%norm)
    do k = 1, n - 2
      if (has_versions .and. length == 8) then
        call reflect_512(a, n, k, 1)
      else if (has_versions .and. length == 4) then
        call reflect_256(a, n, k, 1)
      else
        call reflect_here(a, n, k, 1)
      end if
    end do
    call store(a, h)
  end subroutine new_hessenberg

  !> Stores a single Hessenberg matrix `a` in all lanes. It has `n` rows; its elements should be below about 1.
  pure subroutine of_one(n, a, h)
    integer, intent(in) :: n
    real(dp), intent(in) :: a(max_states, max_states)
    type(hessenberg_type), intent(out) :: h
    real(dp) :: eight(lanes, max_states, max_states)
    integer :: i, j

    h%n = n
    h%norm = 0
    h%trace = 0
    do j = 1, n
      h%trace = h%trace + a(j, j)
      do i = 1, min(j + 1, n)
        eight(:, i, j) = a(i, j)
        h%norm = h%norm + a(i, j)**2
      end do
    end do
    h%norm = sqrt(h%norm)
    call store(eight, h)
  end subroutine of_one

  !> Stores the elements of the matrices `a` in `h`, whose norm and trace must already be set. Subdiagonal elements smaller than
  !> roundoff are increased to roundoff.
  pure subroutine store(a, h)
    real(dp), intent(inout) :: a(lanes, max_states, max_states)
    type(hessenberg_type), intent(inout) :: h
    integer :: i, j, n, lane

    n = h%n
    h%product = 1
    do i = 2, n
      a(:, i, i - 1) = sign(max(abs(a(:, i, i - 1)), epsilon(1.0_dp) * h%norm), a(:, i, i - 1))
      h%product = h%product * abs(a(:, i, i - 1))
    end do
    h%sound = merge(1.0_dp, 0.0_dp, h%product > min_product)
    h%v(:, 1) = 1
    do i = 2, n
      h%v(:, i) = 1 / merge(a(:, i, i - 1), 1.0_dp, h%product > min_product)
    end do
    do j = 1, n
      do i = 1, j
        !GCC$ unroll 1
        do lane = 1, lanes
          h%g(lane, i, j) = -a(lane, i, j) * h%v(lane, i)
        end do
      end do
    end do
  end subroutine store

  !> Computes the coefficients c_0 ... c_(n-1) of the characteristic polynomial, shape (lanes, 0:n-1):
  !>
  !>     det(lambda E - H) = t^n + c_(n-1) t^(n-1) + ... + c_0,   lambda = `mean` + t.
  !>
  !> The unknowns x_(n-1) ... x_0 of Hyman's method are polynomials in t here; the array `x` contains their coefficients.
  pure subroutine characteristic_polynomial(h, mean, c)
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(in) :: mean(lanes)
    real(dp), intent(out) :: c(lanes, 0:h%n - 1)
    real(dp) :: x(lanes, -1:max_states, 0:max_states), m(lanes)
    integer :: lane, n, i, j, k

    n = h%n
    ! A zero at both ends of the coefficients of each polynomial.
    do i = 1, n
      x(:, -1, i) = 0
      x(:, n - i + 1, i) = 0
    end do
    x(:, 0, n) = 1
    do i = n, 1, -1
      m = h%v(:, i) * mean + h%g(:, i, i)
      do k = 0, n - i + 1
        do lane = 1, lanes
          x(lane, k, i - 1) = h%v(lane, i) * x(lane, k - 1, i) + m(lane) * x(lane, k, i)
        end do
      end do
      do j = i + 1, n
        do k = 0, n - j
          do lane = 1, lanes
            x(lane, k, i - 1) = x(lane, k, i - 1) + h%g(lane, i, j) * x(lane, k, j)
          end do
        end do
      end do
    end do
    do k = 0, n - 1
      c(:, k) = x(:, k, 0) / x(:, n, 0)
    end do
  end subroutine characteristic_polynomial

  !> Body of `evaluate`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine evaluate_here(h, z_re, z_im, p_re, p_im, d_re, d_im, once) bind(C, name="lanes_gestell_evaluate")
    !$omp declare simd uniform(h, z_re, z_im, p_re, p_im, d_re, d_im) linear(once) simdlen(2) notinbranch
    type(hessenberg_type), intent(in) :: h
    real(dp), intent(in) :: z_re(lanes), z_im(lanes)
    real(dp), intent(inout) :: p_re(lanes), p_im(lanes), d_re(lanes), d_im(lanes)
    integer(c_int), value :: once
    real(dp) :: x_re(lanes, 0:max_states), x_im(lanes, 0:max_states), y_re(lanes, 0:max_states), y_im(lanes, 0:max_states)
    real(dp) :: m_re, m_im, s_re, s_im, t_re, t_im
    integer :: lane, n, i, j

    n = h%n
    !GCC$ ivdep
    do lane = 1, lanes
      x_re(lane, n) = 1
      x_im(lane, n) = 0
      y_re(lane, n) = 0
      y_im(lane, n) = 0
      x_re(lane, n - 1) = h%v(lane, n) * z_re(lane) + h%g(lane, n, n)
      x_im(lane, n - 1) = h%v(lane, n) * z_im(lane)
      y_re(lane, n - 1) = h%v(lane, n)
      y_im(lane, n - 1) = 0
    end do
    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    do i = n - 1, 1, -1
      !GCC$ ivdep
      do lane = 1, lanes
        s_re = 0
        s_im = 0
        t_re = 0
        t_im = 0
        ! The element computed last is added last: the others need not wait for it.
        j = n
        do
          s_re = s_re + h%g(lane, i, j) * x_re(lane, j)
          s_im = s_im + h%g(lane, i, j) * x_im(lane, j)
          t_re = t_re + h%g(lane, i, j) * y_re(lane, j)
          t_im = t_im + h%g(lane, i, j) * y_im(lane, j)
          j = j - 1
          if (j <= i) exit
        end do
        m_re = h%v(lane, i) * z_re(lane) + h%g(lane, i, i)
        m_im = h%v(lane, i) * z_im(lane)
        s_re = s_re + (m_re * x_re(lane, i) - m_im * x_im(lane, i))
        s_im = s_im + (m_re * x_im(lane, i) + m_im * x_re(lane, i))
        t_re = t_re + (m_re * y_re(lane, i) - m_im * y_im(lane, i)) + h%v(lane, i) * x_re(lane, i)
        t_im = t_im + (m_re * y_im(lane, i) + m_im * y_re(lane, i)) + h%v(lane, i) * x_im(lane, i)
        x_re(lane, i - 1) = s_re
        x_im(lane, i - 1) = s_im
        y_re(lane, i - 1) = t_re
        y_im(lane, i - 1) = t_im
      end do
    end do
    p_re = x_re(:, 0)
    p_im = x_im(:, 0)
    d_re = y_re(:, 0)
    d_im = y_im(:, 0)
  end subroutine evaluate_here

  !> Evaluates the characteristic polynomial, up to a constant factor, by Hyman's method: its value p and its derivative d at z.
  pure subroutine evaluate(length, h, z_re, z_im, p_re, p_im, d_re, d_im)
    !> Number of double precision numbers in a vector register of the processor (gestell_base_processor)
    integer, intent(in) :: length
    type(hessenberg_type), intent(in) :: h
    !> Real and imaginary parts of the arguments z
    real(dp), intent(in) :: z_re(lanes), z_im(lanes)
    !> Real and imaginary parts of the values p and derivatives d
    real(dp), intent(out) :: p_re(lanes), p_im(lanes), d_re(lanes), d_im(lanes)
    procedure(evaluate_here), bind(C, name="_ZGVeN2uuuuuuul_lanes_gestell_evaluate") :: evaluate_512
    procedure(evaluate_here), bind(C, name="_ZGVdN2uuuuuuul_lanes_gestell_evaluate") :: evaluate_256

    if (has_versions .and. length == 8) then
      call evaluate_512(h, z_re, z_im, p_re, p_im, d_re, d_im, 1)
    else if (has_versions .and. length == 4) then
      call evaluate_256(h, z_re, z_im, p_re, p_im, d_re, d_im, 1)
    else
      call evaluate_here(h, z_re, z_im, p_re, p_im, d_re, d_im, 1)
    end if
  end subroutine evaluate

end module gestell_math_batch_hessenberg
