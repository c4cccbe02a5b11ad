!> Checks the monodromy matrix by Liouville's formula: ln det Phi(T) equals the integral of tr P over the period.
module gestell_floquet_period_liouville
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: log_abs_determinant
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_tableau, only: gauss_tableau, tableau_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: sample_traces, second_order_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: defect_of, trace_integral

  !> Number of steps whose coefficients are sampled in one call
  integer, parameter :: block_length = 16

contains

  !> Computes the Liouville defect: ln |det Phi(T)| minus the integral of tr P. If a determinant underflows, the defect is very
  !> large and proves nothing. Fails if P is not finite at some phase.
  subroutine defect_of(system, steps, factors, defect, error)
    class(periodic_system), intent(in) :: system
    !> Number of steps with which Phi(T) was computed
    integer, intent(in) :: steps
    !> Factors whose product is Phi(T), shape (n, n, factors)
    real(dp), intent(in) :: factors(:, :, :)
    !> Liouville defect (dimensionless); zero if the factors are exact
    real(dp), intent(out) :: defect
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: singular
    real(dp) :: log_det
    integer :: k

    call trace_integral(system, mesh(system, max(system%least_steps, steps / 4)), defect, error)
    if (allocated(error)) return
    defect = -defect
    do k = 1, size(factors, 3)
      call log_abs_determinant(factors(:, :, k), log_det, singular)
      defect = defect + log_det
    end do
  end subroutine defect_of

  !> Computes the integral of tr P over the period with 8 points in each step. If the coefficients are smooth, the points are
  !> equidistant: for periodic functions the error then falls faster than any power of the step length. If the coefficients jump,
  !> the points are Gauss points. Fails if P is not finite at some phase.
  subroutine trace_integral(system, nodes, integral, error)
    class(periodic_system), intent(in) :: system
    !> Ends of the steps, as phases t / T
    real(dp), intent(in) :: nodes(:)
    real(dp), intent(out) :: integral
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 8
    real(dp) :: c(points), b(points), phases(points * block_length), weights(points * block_length)
    type(tableau_type) :: rule
    integer :: first, count, k

    c = [((k - 0.5_dp) / points, k = 1, points)]
    b = 1.0_dp / points
    if (allocated(system%breaks)) then
      rule = gauss_tableau(points)
      c = rule%c
      b = rule%b
    end if
    integral = 0
    do first = 1, size(nodes) - 1, block_length
      count = 0
      do k = first, min(first + block_length, size(nodes)) - 1
        associate (h => nodes(k + 1) - nodes(k))
          phases(count + 1:count + points) = nodes(k) + h * c
          weights(count + 1:count + points) = h * system%period * b
        end associate
        count = count + points
      end do
      integral = integral + dot_product(weights(:count), traces(system, phases(:count)))
    end do
    if (ieee_is_finite(integral)) return
    call fatal_error(error, "the system's coefficients are not finite", failed_computation)
  end subroutine trace_integral

  !> Values of tr P, the trace of the matrix P of x' = P x + f, at the phases; shape (phases)
  function traces(system, phases)
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp) :: traces(size(phases))
    real(dp), allocatable :: p(:, :, :)
    integer :: j

    select type (system)
    class is (second_order_system)
      call sample_traces(system, phases, traces)
      return
    end select
    allocate(p(system%states, system%states, size(phases)))
    call system%sample(phases, p)
    traces = 0
    do j = 1, system%states
      traces = traces + p(j, j, :)
    end do
  end function traces

end module gestell_floquet_period_liouville
