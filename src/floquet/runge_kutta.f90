!> The paper's method: classical Runge-Kutta of order 4, whose step is the matrix (18).
module gestell_floquet_runge_kutta
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_method, only: method_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: runge_kutta

  type, extends(method_type), public :: runge_kutta_method
  contains
    procedure :: maps
  end type runge_kutta_method

  !> The ends of a step are taken this far inside of it, in phase: at a break the coefficients are those of the step's
  !> own side, also after rounding.
  real(dp), parameter :: inside = 8 * epsilon(1.0_dp)

contains

  pure function runge_kutta() result(method)
    type(runge_kutta_method) :: method

    method%name = "rk4"
    method%order = 4
    method%stages = 3
  end function runge_kutta

  !> Maps of the steps, (18) with its factors in the order that x' = P x asks for: the later matrix stands on the left.
  !> (In the paper they stand in reverse, which is of order 2 only.)
  subroutine maps(self, system, from, to, a, error, b)
    class(runge_kutta_method), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: from(:), to(:)
    real(dp), intent(out) :: a(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(out), optional :: b(:, :)
    real(dp), allocatable :: p(:, :, :), f(:, :)
    real(dp) :: phases(3 * size(from)), h
    integer :: i, k, n

    n = system%states
    phases = [(from(k) + inside, (from(k) + to(k)) / 2, to(k) - inside, k = 1, size(from))]
    allocate(p(n, n, size(phases)))
    if (present(b)) then
      allocate(f(n, size(phases)))
      call system%sample(phases, p, f)
    else
      call system%sample(phases, p)
    end if

    do k = 1, size(from)
      h = (to(k) - from(k)) * system%period
      i = self%stages * (k - 1)
      associate (p0 => p(:, :, i + 1), pm => p(:, :, i + 2), p1 => p(:, :, i + 3))
        a(:, :, k) = (h * (p0 + 4 * pm + p1) &
          & + h**2 * (matmul(pm, p0) + matmul(pm, pm) + matmul(p1, pm)) &
          & + h**3 / 2 * (matmul(pm, matmul(pm, p0)) + matmul(p1, matmul(pm, pm))) &
          & + h**4 / 4 * matmul(p1, matmul(pm, matmul(pm, p0)))) / 6
        if (present(b)) then
          associate (f0 => f(:, i + 1), fm => f(:, i + 2), f1 => f(:, i + 3))
            b(:, k) = (h * (f0 + 4 * fm + f1) &
              & + h**2 * (matmul(pm, f0) + matmul(pm, fm) + matmul(p1, fm)) &
              & + h**3 / 2 * (matmul(pm, matmul(pm, f0)) + matmul(p1, matmul(pm, fm))) &
              & + h**4 / 4 * matmul(p1, matmul(pm, matmul(pm, f0)))) / 6
          end associate
        end if
      end associate
      do i = 1, n
        a(i, i, k) = 1 + a(i, i, k)
      end do
    end do
  end subroutine maps

end module gestell_floquet_runge_kutta
