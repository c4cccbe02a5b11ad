!> A linear system with periodic coefficients at equidistant angles, and Newton's method for its Floquet solutions as
!> trigonometric polynomials: the equations (H) of reference_hill. Residuals in quadruple precision, so that the linear
!> systems may be solved in double precision.
module reference_collocation
  use, intrinsic :: iso_fortran_env, only: dp => real64
  use reference_double, only: factorise, factors_type
  use reference_flow, only: flow_system
  use reference_linear, only: qp
  use reference_machine, only: pi => pi_qp
  implicit none (type, external)
  private

  public :: table_type, sample, iterate

  !> P and f at the angles, in balanced units.
  type :: table_type
    integer :: n = 0, points = 0
    real(qp), allocatable :: a(:, :, :), g(:, :), unit(:)
    real(qp), allocatable :: slope(:)      ! of the interpolation's cardinal function, at k angles from its own
  end type table_type

contains

  subroutine sample(system, period, points, table)
    class(flow_system), intent(in) :: system
    real(qp), intent(in) :: period
    integer, intent(in) :: points
    type(table_type), intent(out) :: table
    integer :: j, k

    table%n = system%n
    table%points = points
    allocate (table%a(system%n, system%n, points), table%g(system%n, points), table%slope(-points:points))
    do j = 1, points
      call system%evaluate(period*(j - 1)/points, table%a(:, :, j), table%g(:, j))
    end do
    table%a = table%a*period/(2*pi)
    table%g = table%g*period/(2*pi)
    call balance(table)
    table%slope = 0
    do k = 1, points - 1
      table%slope(k) = (-1)**k/(2*sin(pi*k/points))
      table%slope(-k) = -table%slope(k)
    end do
  end subroutine sample

  !> Units, powers of two, that make rows and columns of A of like size.
  subroutine balance(table)
    type(table_type), intent(inout) :: table
    real(qp) :: row, column, f
    integer :: i, sweep

    allocate (table%unit(table%n))
    table%unit = 1
    do sweep = 1, 30
      do i = 1, table%n
        row = sum(abs(table%a(i, :, :))) - sum(abs(table%a(i, i, :)))
        column = sum(abs(table%a(:, i, :))) - sum(abs(table%a(i, i, :)))
        if (row <= 0 .or. column <= 0) cycle
        f = 2.0_qp**nint(log(row/column)/(2*log(2.0_qp)))
        table%unit(i) = table%unit(i)*f
        table%a(i, :, :) = table%a(i, :, :)/f
        table%g(i, :) = table%g(i, :)/f
        table%a(:, i, :) = table%a(:, i, :)*f
      end do
    end do
  end subroutine balance

  !> Newton's method for (H) from x and lambda, in place. pin: the component that is 1. The route 'periodic' solves
  !> A x + g - x' = 0 instead.
  subroutine iterate(table, route, pin, x, lambda, ok)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: route
    integer, intent(in) :: pin
    complex(qp), intent(inout) :: x(:, :), lambda(:)
    logical, intent(out) :: ok
    type(factors_type) :: factors
    complex(qp) :: r(size(x, 1), size(x, 2)), step(size(x, 1), size(x, 2)), step_lambda(size(lambda))
    real(qp) :: moved, before
    integer :: i

    before = huge(before)
    do i = 1, 30
      r = residual(table, x, lambda)
      if (route == 'periodic') r = r + table%g
      if (before > 1.0e-9_qp) then
        call factorise(jacobian(table, route, pin, x, lambda), factors, ok)
        if (.not. ok) return
      end if
      step = reshape(cmplx(factors%solve(cmplx(reshape(-r, [size(r)]), kind=dp)), kind=qp), shape(r))
      step_lambda = 0
      if (route == 'direct') then
        step_lambda = step(pin, 1)
        step(pin, 1) = 0
      else if (route == 'followed') then
        step_lambda = step(pin, :)
        step(pin, :) = 0
      end if
      x = x + step
      lambda = lambda + step_lambda
      moved = max(maxval(abs(step))/maxval(abs(x)), maxval(abs(step_lambda))/max(1.0_qp, maxval(abs(lambda))))
      ok = moved <= 1.0e-31_qp .or. (moved <= 1.0e-17_qp .and. moved > before/4)
      if (ok .or. .not. moved < 1.0e6_qp) return
      before = moved
    end do
  end subroutine iterate

  !> A x - lambda x - x'.
  function residual(table, x, lambda) result(r)
    type(table_type), intent(in) :: table
    complex(qp), intent(in) :: x(:, :), lambda(:)
    complex(qp) :: r(size(x, 1), size(x, 2))
    integer :: j, k

    do j = 1, table%points
      r(:, j) = matmul(table%a(:, :, j), x(:, j)) - lambda(j)*x(:, j)
      do k = 1, table%points
        if (k /= j) r(:, j) = r(:, j) - table%slope(j - k)*x(:, k)
      end do
    end do
  end function residual

  !> Derivative of the residual, where lambda replaces the fixed component.
  function jacobian(table, route, pin, x, lambda) result(a)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: route
    integer, intent(in) :: pin
    complex(qp), intent(in) :: x(:, :), lambda(:)
    complex(dp), allocatable :: a(:, :)
    integer :: n, i, j, k

    n = table%n
    allocate (a(n*table%points, n*table%points))
    a = 0
    do k = 1, table%points
      do j = 1, table%points
        do i = 1, n
          a(n*(j - 1) + i, n*(k - 1) + i) = -real(table%slope(j - k), dp)
        end do
      end do
      associate (block => a(n*(k - 1) + 1:n*k, n*(k - 1) + 1:n*k))
        block = real(table%a(:, :, k), dp)
        do i = 1, n
          block(i, i) = cmplx(table%a(i, i, k) - lambda(k), kind=dp)
        end do
      end associate
    end do
    if (route == 'direct') then
      a(:, pin) = cmplx(reshape(-x, [size(x)]), kind=dp)
    else if (route == 'followed') then
      do k = 1, table%points
        a(:, n*(k - 1) + pin) = 0
        a(n*(k - 1) + 1:n*k, n*(k - 1) + pin) = cmplx(-x(:, k), kind=dp)
      end do
    end if
  end function jacobian

end module reference_collocation
