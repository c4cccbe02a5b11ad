!> Defines periodic systems by samples of their coefficients at an even number of equidistant phases. Between these phases the
!> coefficients are trigonometric polynomials.
module gestell_floquet_solution_sampled
  use gestell_base_kinds, only: dp
  use gestell_floquet_reduction_trigonometric, only: interpolation
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: complex_system, real_system

  !> Periodic system whose coefficients are given at N equidistant phases.
  type, extends(periodic_system), public :: sampled_system
    !> `p`: samples of P, shape (n, n, N). `f`: samples of f, shape (n, N).
    real(dp), allocatable :: p(:, :, :), f(:, :)
  contains
    procedure :: matrix, forcing, sample
  end type sampled_system

contains

  !> The system y' = P y + f with the period 1. `rounding`: relative error of the map over the period that errors of the samples
  !> cause.
  pure type(sampled_system) function real_system(p, f, rounding) result(system)
    real(dp), intent(in) :: p(:, :, :), f(:, :), rounding

    allocate(system%p, source=p)
    allocate(system%f, source=f)
    system%states = size(p, 1)
    system%period = 1
    system%least_steps = size(p, 3)
    system%rounding = rounding
  end function real_system

  !> Converts the complex system y' = P y to a real system with twice as many states, (Re y, Im y).
  pure type(sampled_system) function complex_system(p, rounding) result(system)
    complex(dp), intent(in) :: p(:, :, :)
    real(dp), intent(in) :: rounding
    real(dp) :: doubled(2 * size(p, 1), 2 * size(p, 1), size(p, 3))
    integer :: n

    n = size(p, 1)
    doubled(:n, :n, :) = real(p)
    doubled(n + 1:, n + 1:, :) = real(p)
    doubled(:n, n + 1:, :) = -aimag(p)
    doubled(n + 1:, :n, :) = aimag(p)
    system = real_system(doubled, reshape([real(dp) ::], [2 * n, size(p, 3)], [0.0_dp]), rounding)
  end function complex_system

  !> Computes the matrix P at time t. The period is 1.
  subroutine matrix(self, t, p)
    class(sampled_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp) :: many(self%states, self%states, 1)

    call self%sample([t], many)
    p = many(:, :, 1)
  end subroutine matrix

  !> Computes the forcing f at time t. The period is 1.
  subroutine forcing(self, t, f)
    class(sampled_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    f = matmul(self%f, reshape(interpolation(size(self%f, 2), [t]), [size(self%f, 2)]))
  end subroutine forcing

  !> Computes the matrix P, shape (n, n, phases), and the forcing f, shape (n, phases), by trigonometric interpolation.
  subroutine sample(self, phases, p, f)
    class(sampled_system), intent(in) :: self
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: p(:, :, :)
    real(dp), intent(out), optional :: f(:, :)
    real(dp) :: weights(size(self%p, 3), size(phases))

    weights = transpose(interpolation(size(self%p, 3), phases))
    p = reshape(matmul(reshape(self%p, [self%states**2, size(self%p, 3)]), weights), shape(p))
    if (present(f)) f = matmul(self%f, weights)
  end subroutine sample

end module gestell_floquet_solution_sampled
