!> Classical Runge-Kutta method of order 4. The matrix of a step is equation (18) of the paper that doc/theory.md names.
module gestell_floquet_integrator_comparison_runge_kutta
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_method, only: matrix_work, method_type, product_work
  use gestell_floquet_integrator_comparison_step_nodes, only: sample_steps
  use gestell_math_matrix, only: unit_matrix
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: runge_kutta

  type, extends(method_type), public :: runge_kutta_method
  contains
    procedure :: maps, work
  end type runge_kutta_method

contains

  !> Returns the integration method with the name rk4.
  pure type(runge_kutta_method) function runge_kutta() result(method)
    method%name = "rk4"
    method%order = 4
    method%stages = 2
    ! exp(z) - (1 + z + z^2/2 + z^3/6 + z^4/24) = z^5/120 + ...
    method%error_constant = 1 / 120.0_dp
  end function runge_kutta

  !> Computing time of a step, in the units of `step_work` in gestell_floquet_integrator_method.
  pure real(dp) function work(self, states, second_order)
    class(runge_kutta_method), intent(in) :: self
    integer, intent(in) :: states
    logical, intent(in) :: second_order

    work = self%stages * matrix_work(states, second_order) + 6 * product_work(states) + 100
  end function work

  !> Computes the maps of the steps by equation (18) of the paper with one correction: in every product the factor for the later
  !> time stands on the left, as x' = P x requires. With the factors in the paper's order, the method is accurate to order 2
  !> only.
  subroutine maps(self, system, from, to, map, error)
    class(runge_kutta_method), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: from(:), to(:)
    real(dp), contiguous, intent(out) :: map(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: c(3) = [0.0_dp, 0.5_dp, 1.0_dp]
    real(dp), allocatable :: p(:, :, :), f(:, :)
    real(dp) :: square(system%states, system%states), h
    integer :: at(3, size(from)), n, k
    logical :: forced

    associate (unused => self)
    end associate
    n = system%states
    forced = size(map, 3) > n
    call sample_steps(system, from, to, c, forced, at, p, f)
    do k = 1, size(from)
      h = (to(k) - from(k)) * system%period
      associate (p0 => p(:, :, at(1, k)), pm => p(:, :, at(2, k)), p1 => p(:, :, at(3, k)))
        square = matmul(pm, pm)
        map(k, :, :n) = unit_matrix(n) + (h * (p0 + 4 * pm + p1) &
          & + h**2 * (matmul(pm, p0) + square + matmul(p1, pm)) &
          & + h**3 / 2 * (matmul(square, p0) + matmul(p1, square)) &
          & + h**4 / 4 * matmul(p1, matmul(square, p0))) / 6
        if (forced) then
          associate (f0 => f(:, at(1, k)), fm => f(:, at(2, k)), f1 => f(:, at(3, k)))
            map(k, :, n + 1) = (h * (f0 + 4 * fm + f1) &
              & + h**2 * (matmul(pm, f0) + matmul(pm, fm) + matmul(p1, fm)) &
              & + h**3 / 2 * (matmul(square, f0) + matmul(p1, matmul(pm, fm))) &
              & + h**4 / 4 * matmul(p1, matmul(square, f0))) / 6
          end associate
        end if
      end associate
    end do
  end subroutine maps

end module gestell_floquet_integrator_comparison_runge_kutta
