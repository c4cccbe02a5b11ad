!> Explicit Runge-Kutta method of order 8 with 11 stages. Its stages use the five nodes of Lobatto quadrature.
module gestell_floquet_integrator_comparison_cooper_verner
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_method, only: matrix_work, method_type, product_work
  use gestell_floquet_integrator_comparison_step_nodes, only: sample_steps
  use gestell_math_matrix, only: unit_matrix
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: cooper_verner, cooper_verner_tableau

  integer, parameter :: slopes = 11

  type, extends(method_type), public :: cooper_verner_method
    private
    !> Coefficients A and weights b of the method; `prepare` computes them
    real(dp) :: a(slopes, slopes) = 0, b(slopes) = 0
  contains
    procedure :: prepare, maps, work
  end type cooper_verner_method

  !> Index, from 1 to 5, of the node at which each slope is evaluated
  integer, parameter :: node(slopes) = [1, 3, 3, 4, 4, 3, 2, 2, 3, 4, 5]

contains

  !> Returns the method `explicit8`. For constant P its step is a polynomial of z = h P that differs from exp(z) by 2.46e-5 z^9 in
  !> leading order.
  pure type(cooper_verner_method) function cooper_verner() result(method)
    method%name = "explicit8"
    method%order = 8
    method%stages = 4
    method%error_constant = 2.46e-5_dp
  end function cooper_verner

  !> Sets the coefficients of the method.
  pure subroutine prepare(self)
    class(cooper_verner_method), intent(inout) :: self

    call cooper_verner_tableau(self%a, self%b)
  end subroutine prepare

  !> Coefficients A and b of G. J. Cooper and J. H. Verner, SIAM J. Numer. Anal. 9 (1972) 389. The nodes c are the row sums of A.
  pure subroutine cooper_verner_tableau(a, b)
    real(dp), intent(out) :: a(slopes, slopes), b(slopes)
    real(dp), parameter :: s = sqrt(21.0_dp)

    a = 0
    a(2, 1) = 1 / 2.0_dp
    a(3, :2) = [1.0_dp, 1.0_dp] / 4
    a(4, :3) = [1 / 7.0_dp, (-7 - 3 * s) / 98, (21 + 5 * s) / 49]
    a(5, :4) = [(11 + s) / 84, 0.0_dp, (18 + 4 * s) / 63, (21 - s) / 252]
    a(6, :5) = [(5 + s) / 48, 0.0_dp, (9 + s) / 36, (-231 + 14 * s) / 360, (63 - 7 * s) / 80]
    a(7, :6) = [(10 - s) / 42, 0.0_dp, (-432 + 92 * s) / 315, (633 - 145 * s) / 90, (-504 + 115 * s) / 70, (63 - 13 * s) / 35]
    a(8, [1, 5, 6, 7]) = [1 / 14.0_dp, (14 - 3 * s) / 126, (13 - 3 * s) / 63, 1 / 9.0_dp]
    a(9, [1, 5, 6, 7, 8]) = [1 / 32.0_dp, (91 - 21 * s) / 576, 11 / 72.0_dp, (-385 - 75 * s) / 1152, (63 + 13 * s) / 128]
    a(10, [1, 5, 6, 7, 8, 9]) = [1 / 14.0_dp, 1 / 9.0_dp, (-733 - 147 * s) / 2205, (515 + 111 * s) / 504, (-51 - 11 * s) / 56, &
      & (132 + 28 * s) / 245]
    a(11, 5:10) = [(-42 + 7 * s) / 18, (-18 + 28 * s) / 45, (-273 - 53 * s) / 72, (301 + 53 * s) / 72, (28 - 28 * s) / 45, &
      & (49 - 7 * s) / 18]
    b = 0
    b([1, 8, 9, 10, 11]) = [1 / 20.0_dp, 49 / 180.0_dp, 16 / 45.0_dp, 49 / 180.0_dp, 1 / 20.0_dp]
  end subroutine cooper_verner_tableau

  !> Computing time of a step, in the units of `step_work` in gestell_floquet_integrator_method.
  pure real(dp) function work(self, states, second_order)
    class(cooper_verner_method), intent(in) :: self
    integer, intent(in) :: states
    logical, intent(in) :: second_order

    work = self%stages * matrix_work(states, second_order) + slopes * (product_work(states) + 40)
  end function work

  !> Computes the maps [A b] of all steps. A follows from the slopes K_i = P_i (E + h sum_j a_ij K_j), whose start values are the
  !> columns of the unit matrix E. The vector b is computed as an additional column: its start value is zero, and its slopes
  !> include the forcing f_i.
  subroutine maps(self, system, from, to, map, error)
    class(cooper_verner_method), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: from(:), to(:)
    real(dp), contiguous, intent(out) :: map(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: p(:, :, :), f(:, :), slope(:, :, :), x(:, :)
    integer :: at(5, size(from)), n, i, j, k
    real(dp) :: h
    logical :: forced

    n = system%states
    forced = size(map, 3) > n
    call sample_steps(system, from, to, [0.0_dp, (7 - sqrt(21.0_dp)) / 14, 0.5_dp, (7 + sqrt(21.0_dp)) / 14, 1.0_dp], forced, at, &
      & p, f)
    allocate(x(n, size(map, 3)), slope(n, size(map, 3), slopes))
    do k = 1, size(from)
      h = (to(k) - from(k)) * system%period
      do i = 1, slopes
        x = started(h * self%a(i, :i - 1))
        slope(:, :, i) = matmul(p(:, :, at(node(i), k)), x)
        if (forced) slope(:, n + 1, i) = slope(:, n + 1, i) + f(:, at(node(i), k))
      end do
      x = started(h * self%b)
      map(k, :, :) = x
    end do

  contains

    !> Start values plus the sum of the slopes, in which slope j has the factor `along(j)`. The start values are the unit matrix
    !> and, in the column of the vector b, zeros.
    function started(along) result(x)
      real(dp), intent(in) :: along(:)
      real(dp) :: x(size(slope, 1), size(slope, 2))

      x(:, :n) = unit_matrix(n)
      x(:, n + 1:) = 0
      do j = 1, size(along)
        if (abs(along(j)) > 0) x = x + along(j) * slope(:, :, j)
      end do
    end function started

  end subroutine maps

end module gestell_floquet_integrator_comparison_cooper_verner
