!> The reduction of fast vibrations satisfies its defining equations, and its residuals are those of its definition.
module test_reduction_equations
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_reduction, only: reduce, reduction_type
  use gestell_floquet_reduction_conjugates, only: complex_columns
  use testdrive, only: error_type, new_unittest, unittest_type
  use turning_system, only: turning_type
  implicit none (type, external)
  private

  public :: collect_reduction_equations

  integer, parameter :: n = 6
  !> Units of the states, as unequal as those of a machine.
  real(dp), parameter :: scale(n) = [1.0_dp, 2.0_dp, 0.5_dp, 1.0_dp, 3.0_dp, 0.25_dp]

  !> A reduction, computed again from the coefficients and from S, p at the phases, at some phases t / T. Complex: no real forms.
  type :: again_type
    !> A = T P and T f in units of `scale`; S, S' and p, p'; shapes (n, n, phases) and (n, phases)
    complex(dp), allocatable :: a(:, :, :), f(:, :), s(:, :, :), s_slope(:, :, :), p(:, :), p_slope(:, :)
    !> D = S^-1 (A S - S') and g = S^-1 (A p + T f - p')
    complex(dp), allocatable :: d(:, :, :), g(:, :)
    !> |S| |S^-1| in the Frobenius norm
    real(dp), allocatable :: condition(:)
  end type again_type

contains

  subroutine collect_reduction_equations(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the reduction satisfies its equations, and its residuals are measured correctly", test_equations)]
  end subroutine collect_reduction_equations

  subroutine test_equations(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: period = 2 * pi

    call check_equations("fast modes", turning_type(states=n, period=period, rate=[-0.1_dp, -0.02_dp, 0.05_dp], &
      & frequency=[100.3_dp, 250.2_dp, 900.1_dp]), error)
    if (.not. allocated(error)) call check_equations("a wide swing", turning_type(states=n, period=period, &
      & rate=[-3.0_dp, -1.0_dp, -0.5_dp], frequency=[100.3_dp, 250.2_dp, 900.1_dp], swing=0.8_dp), error)
    if (.not. allocated(error)) call check_equations("close modes", turning_type(states=n, period=period, &
      & rate=[-0.1_dp, -0.02_dp, -0.05_dp], frequency=[300.3_dp, 302.1_dp, 900.1_dp]), error)
    if (.not. allocated(error)) call check_equations("a slow mode", turning_type(states=n, period=period, &
      & rate=[-0.1_dp, -0.2_dp, -0.05_dp], frequency=[0.3_dp, 302.1_dp, 900.1_dp]), error)
    if (.not. allocated(error)) call check_equations("overdamped", turning_type(states=n, period=period, &
      & rate=[-0.1_dp, -600.0_dp, -20.0_dp], frequency=[0.3_dp, 0.0_dp, 900.1_dp], real_block=[.false., .true., .false.]), error)
  end subroutine test_equations

  subroutine check_equations(name, system, error)
    character(len=*), intent(in) :: name
    type(turning_type), intent(in) :: system
    type(error_type), allocatable, intent(out) :: error
    type(reduction_type) :: r
    type(gestell_error), allocatable :: failure
    type(again_type) :: at, between
    complex(dp), allocatable :: d(:, :, :), g(:, :), d_between(:, :, :)
    real(dp), allocatable :: sizes(:), loads(:), slow(:)
    logical :: fast(n)
    real(dp) :: size_d, rounded, effort
    integer :: k, count

    call reduce(system, scale, .true., 1.0e-9_dp, r, failure)
    call check_success(error, failure, name)
    if (allocated(error)) return
    count = r%angles
    at = again(system, r, [(real(k, dp) / count, k = 0, count - 1)])
    between = again(system, r, [((k + 0.5_dp) / count, k = 0, count - 1)])
    d = complex_generator(r%generator)
    d_between = complex_generator(r%generator_between)
    g = reshape([(coordinates(r%forcing(k, :)), k = 1, count)], [n, count])
    size_d = maxval(abs(at%d)) + count * maxval(abs(at%s_slope))
    ! Differentiation over `count` phases magnifies roundings of S by that number; 20 for their sums.
    rounded = 20 * n * epsilon(1.0_dp) * size_d * r%condition
    call check_that(error, maxval(abs(at%d - d)), "<=", rounded, name // ": D at the phases")
    call check_that(error, maxval(abs(between%d - d_between)), "<=", rounded, name // ": D between the phases")
    effort = maxval(abs(at%p)) * (maxval(abs(at%a)) + count) + maxval(abs(at%f))
    call check_that(error, maxval(abs(at%g - g)), "<=", 20 * n * epsilon(1.0_dp) * effort * r%condition, name // &
      & ": g at the phases")
    if (allocated(error)) return

    ! Only the condition between the phases is measured. Sums of 36 squares are rounded.
    call check_that(error, abs(r%condition / max(1.0_dp, maxval(between%condition)) - 1), "<", 1.0e-10_dp, name // ": condition")
    ! The trace of each block over the period, from the closed form: the sum of all ln rho.
    call check_that(error, abs(r%trace - real(sum(system%logarithms()))), "<=", 100 * epsilon(1.0_dp) * maxval(abs(at%a)), &
      & name // ": trace")

    fast = r%modes%group /= 0
    allocate(sizes(count), loads(count), slow(count))
    do k = 1, count
      associate (departure => between%d(:, :, k) - interpolated_matrix(d, k))
        sizes(k) = maxval(sum(merge(abs(d(:, :, k)), 0.0_dp, apart()), dim=2)) &
          & + maxval(sum(abs(merge(between%d(:, :, k), departure, apart())), dim=2))
      end associate
      slow(k) = maxval(merge(0.0_dp, abs(between%g(:, k) - matmul(g, weights_at((k - 0.5_dp) / count, count))), fast))
      loads(k) = maxval(merge(abs(g(:, k)), 0.0_dp, fast)) + max(slow(k), maxval(merge(abs(between%g(:, k)), 0.0_dp, fast)))
    end do
    ! The residuals are as small as rounding errors allow; they are compared above these. The size of rounding is added.
    call check_close("residual", r%residual, sum(sizes) / count, rounded)
    call check_close("its maximum", r%residual_peak, maxval(sizes), rounded)
    rounded = 20 * n * epsilon(1.0_dp) * effort * r%condition
    call check_close("forcing residual", r%forcing_residual, sum(loads) / count, rounded)
    call check_close("its maximum", r%forcing_peak, maxval(loads), rounded)
    call check_close("slow residual", r%slow_residual, sum(slow) / count, rounded)
    effort = maxval([(norm2(abs(between%f(:, k))) + maxval(abs(between%a)) * norm2(abs(between%p(:, k))), k = 1, count)])
    call check_that(error, abs(r%effort - effort), "<=", 1.0e-10_dp * effort, name // ": size of the terms of g")
    ! The slow group keeps its real form.
    effort = maxval([(maxval(merge(0.0_dp, abs(matmul(weights_at((k - 0.5_dp) / count, count), r%forcing)), fast)), k = 1, count)])
    call check_that(error, abs(r%slow_effort - effort), "<=", rounded, name // ": slow part of g")

  contains

    !> Both members agree within a tenth, or within rounding errors.
    subroutine check_close(what, found, wanted, rounding)
      character(len=*), intent(in) :: what
      real(dp), intent(in) :: found, wanted, rounding

      call check_that(error, abs(found - wanted), "<=", 0.1_dp * wanted + rounding, name // ": " // what)
    end subroutine check_close

    !> True for elements between groups.
    function apart()
      logical :: apart(n, n)
      integer :: i

      do i = 1, n
        apart(:, i) = r%modes%group /= r%modes%group(i)
      end do
    end function apart

    !> The complex D at the phases from its real form G: S = R K, D = K^-1 G K.
    function complex_generator(real_form) result(full)
      real(dp), intent(in) :: real_form(:, :, :)
      complex(dp) :: full(n, n, count), unit(n, n)
      integer :: i

      unit = complex_columns(identity(), r%modes%conjugate)
      do i = 1, count
        full(:, :, i) = solved(unit, matmul(cmplx(real_form(i, :, :), kind=dp), unit))
      end do
    end function complex_generator

    !> The complex coordinates of their real form w: y = K^-1 w.
    function coordinates(w) result(y)
      real(dp), intent(in) :: w(:)
      complex(dp) :: y(n), column(n, 1)

      column = solved(complex_columns(identity(), r%modes%conjugate), reshape(cmplx(w, kind=dp), [n, 1]))
      y = column(:, 1)
    end function coordinates

    !> Matrices at the phases, interpolated midway between phase k and the next one.
    function interpolated_matrix(matrices, phase) result(middle)
      complex(dp), intent(in) :: matrices(:, :, :)
      integer, intent(in) :: phase
      complex(dp) :: middle(n, n)
      real(dp) :: weights(count)
      integer :: i

      weights = weights_at((phase - 0.5_dp) / count, count)
      middle = 0
      do i = 1, count
        middle = middle + weights(i) * matrices(:, :, i)
      end do
    end function interpolated_matrix

  end subroutine check_equations

  !> S and p through their values at the phases of `r`, and what follows from them and from the coefficients at other phases.
  function again(system, r, phases) result(at)
    type(turning_type), intent(in) :: system
    type(reduction_type), intent(in) :: r
    real(dp), intent(in) :: phases(:)
    type(again_type) :: at
    complex(dp) :: s(n, n), inverse(n, n), g(n, 1)
    real(dp) :: p(n, n), f(n), weights(r%angles), slopes(r%angles)
    integer :: i, k, m

    m = size(phases)
    allocate(at%a(n, n, m), at%f(n, m), at%s(n, n, m), at%s_slope(n, n, m), at%p(n, m), at%p_slope(n, m), at%d(n, n, m), &
      & at%g(n, m), at%condition(m))
    do k = 1, m
      call system%matrix(phases(k) * system%period, p)
      call system%forcing(phases(k) * system%period, f)
      at%a(:, :, k) = system%period * p * spread(scale, 1, n) / spread(scale, 2, n)
      at%f(:, k) = system%period * f / scale
      weights = weights_at(phases(k), r%angles)
      slopes = slopes_at(phases(k), r%angles)
      at%s(:, :, k) = 0
      at%s_slope(:, :, k) = 0
      do i = 1, r%angles
        s = complex_columns(r%basis(i, :, :), r%modes%conjugate)
        at%s(:, :, k) = at%s(:, :, k) + weights(i) * s
        at%s_slope(:, :, k) = at%s_slope(:, :, k) + slopes(i) * s
      end do
      at%p(:, k) = matmul(weights, r%response)
      at%p_slope(:, k) = matmul(slopes, r%response)
      at%d(:, :, k) = solved(at%s(:, :, k), matmul(at%a(:, :, k), at%s(:, :, k)) - at%s_slope(:, :, k))
      g = solved(at%s(:, :, k), reshape(matmul(at%a(:, :, k), at%p(:, k)) + at%f(:, k) - at%p_slope(:, k), [n, 1]))
      at%g(:, k) = g(:, 1)
      inverse = solved(at%s(:, :, k), cmplx(identity(), kind=dp))
      at%condition(k) = sqrt(sum(abs(at%s(:, :, k))**2) * sum(abs(inverse)**2))
    end do
  end function again

  !> Values at a phase of the trigonometric polynomials that are 1 at one of `count` phases and 0 at the others: the mean of all
  !> cosines of orders up to count / 2, the last one with weight one half.
  pure function weights_at(phase, count) result(weights)
    real(dp), intent(in) :: phase
    integer, intent(in) :: count
    real(dp) :: weights(count)
    integer :: i, k

    do i = 1, count
      associate (apart => 2 * pi * (phase - real(i - 1, dp) / count))
        weights(i) = (1 + 2 * sum([(cos(k * apart), k = 1, count / 2 - 1)]) + cos(count / 2 * apart)) / count
      end associate
    end do
  end function weights_at

  !> Derivatives of these polynomials with respect to the phase.
  pure function slopes_at(phase, count) result(slopes)
    real(dp), intent(in) :: phase
    integer, intent(in) :: count
    real(dp) :: slopes(count)
    integer :: i, k

    do i = 1, count
      associate (apart => 2 * pi * (phase - real(i - 1, dp) / count))
        slopes(i) = -2 * pi * (2 * sum([(k * sin(k * apart), k = 1, count / 2 - 1)]) + count / 2 * sin(count / 2 * apart)) / count
      end associate
    end do
  end function slopes_at

  pure function identity() result(e)
    real(dp) :: e(n, n)
    integer :: i

    e = 0
    do i = 1, n
      e(i, i) = 1
    end do
  end function identity

  !> The solution x of a x = b, by Gauss-Jordan elimination with pivots.
  pure function solved(a, b) result(x)
    complex(dp), intent(in) :: a(:, :), b(:, :)
    complex(dp) :: x(size(a, 1), size(b, 2)), rows(size(a, 1), size(a, 1) + size(b, 2))
    integer :: i, k, pivot

    rows(:, :size(a, 1)) = a
    rows(:, size(a, 1) + 1:) = b
    do k = 1, size(a, 1)
      pivot = k - 1 + maxloc(abs(rows(k:, k)), dim=1)
      rows([k, pivot], :) = rows([pivot, k], :)
      rows(k, :) = rows(k, :) / rows(k, k)
      do i = 1, size(a, 1)
        if (i /= k) rows(i, :) = rows(i, :) - rows(i, k) * rows(k, :)
      end do
    end do
    x = rows(:, size(a, 1) + 1:)
  end function solved

end module test_reduction_equations
