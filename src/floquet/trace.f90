!> Liouville's side of the monodromy matrix: ln det Phi(T) is the integral of tr P over the period.
module gestell_floquet_trace
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_floquet_tableau, only: gauss_tableau, tableau_type
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: trace_integral

contains

  !> The integral of tr P over the period by Gauss' quadrature with 4 points in each step between `nodes`.
  !> Error: P is not finite somewhere.
  subroutine trace_integral(system, nodes, integral, error)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: nodes(:)
    real(dp), intent(out) :: integral
    type(error_type), allocatable, intent(out) :: error
    type(tableau_type) :: rule
    real(dp), allocatable :: p(:, :, :)
    real(dp) :: h
    integer :: i, j, k

    rule = gauss_tableau(4)
    allocate(p(system%states, system%states, 4))
    integral = 0
    do k = 1, size(nodes) - 1
      h = nodes(k + 1) - nodes(k)
      call system%sample(nodes(k) + h * rule%c, p)
      do i = 1, 4
        integral = integral + h * system%period * rule%b(i) * sum([(p(j, j, i), j = 1, system%states)])
      end do
    end do
    if (ieee_is_finite(integral)) return
    call fatal_error(error, "the coefficients of the system are not finite", failed_computation)
  end subroutine trace_integral

end module gestell_floquet_trace
