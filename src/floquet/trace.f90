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

  !> The integral of tr P over the period with 8 points for each of the steps between `nodes`: equidistant ones where the
  !> coefficients do not jump, which for smooth periodic functions converges faster than any power, else Gauss' points.
  !> Error: P is not finite somewhere.
  subroutine trace_integral(system, nodes, integral, error)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: nodes(:)
    real(dp), intent(out) :: integral
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 8
    type(tableau_type) :: rule
    real(dp) :: h
    integer :: k

    rule = gauss_tableau(points)
    if (.not. allocated(system%breaks)) then
      rule%c = [((k - 0.5_dp) / points, k = 1, points)]
      rule%b = 1.0_dp / points
    end if
    integral = 0
    do k = 1, size(nodes) - 1
      h = nodes(k + 1) - nodes(k)
      integral = integral + h * system%period * dot_product(rule%b, traces(system, nodes(k) + h * rule%c))
    end do
    if (ieee_is_finite(integral)) return
    call fatal_error(error, "the coefficients of the system are not finite", failed_computation)
  end subroutine trace_integral

  function traces(system, phases)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: phases(:)
    real(dp) :: traces(size(phases))
    real(dp), allocatable :: p(:, :, :)
    integer :: j, k

    allocate(p(system%states, system%states, size(phases)))
    call system%sample(phases, p)
    traces = [(sum([(p(j, j, k), j = 1, system%states)]), k = 1, size(phases))]
  end function traces

end module gestell_floquet_trace
