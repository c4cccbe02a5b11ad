!> What is timed of the library: the only place that calls it.
module library_calls
  use gestell_api_numerics, only: accuracy_type, dp, error_type, evidence, evidence_type, floquet_type, frame_type, method_type, &
    & multipliers_type, solve_floquet, solve_multipliers, solve_periodic, solve_vibration, vibration_type
  use gestell_math_lapack, only: factorise, solve_factored
  use gestell_floquet_period_period_map, only: period_map
  use gestell_floquet_integrator_mesh, only: mesh
  implicit none (type, external)
  private

  public :: map_with_steps, solve_to_tolerance

contains

  !> Phi(T), shape (n, n), and x0 = (E - Phi)^-1 x_p(T) with so many steps of a method, as a peer computes them: no estimate
  !> of the error.
  subroutine map_with_steps(frame, method, steps, phi, x0, evaluations, error)
    type(frame_type), intent(in) :: frame
    class(method_type), intent(in) :: method
    integer, intent(in) :: steps
    real(dp), intent(out) :: phi(:, :), x0(:)
    integer, intent(out) :: evaluations
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: nodes(:)
    real(dp) :: left(size(x0), size(x0)), right(size(x0), 1), ones(size(x0))
    integer :: pivots(size(x0)), i

    allocate(nodes, source=mesh(frame, steps))
    ones = 1
    call period_map(frame, method, nodes, ones, phi, error, right(:, 1))
    if (allocated(error)) return
    left = -phi
    do i = 1, size(x0)
      left(i, i) = left(i, i) + 1
    end do
    call factorise(left, pivots, error)
    if (allocated(error)) return
    call solve_factored(left, pivots, right)
    x0 = right(:, 1)
    evaluations = (size(nodes) - 1) * method%stages
  end subroutine map_with_steps

  !> Solves to a tolerance, with error bounds, as a user does. `what` is "multipliers" for the multipliers and the verdict, "auto"
  !> for x0 as well, "peaks" for the vibration as well: peaks, rms, harmonics and the history of a turn.
  subroutine solve_to_tolerance(frame, tolerance, what, rho, x0, evaluations, error)
    type(frame_type), intent(in) :: frame
    real(dp), intent(in) :: tolerance
    character(len=*), intent(in) :: what
    complex(dp), intent(out) :: rho(:)
    real(dp), intent(out) :: x0(:)
    integer, intent(out) :: evaluations
    type(error_type), allocatable, intent(out) :: error
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(vibration_type) :: vibration
    type(evidence_type) :: found
    character(len=:), allocatable :: verdict

    x0 = 0
    call solve_floquet(frame, accuracy_type(tolerance=tolerance), what /= "multipliers", floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
    if (.not. allocated(error) .and. what == "auto") call solve_periodic(floquet, vibration%start, error)
    if (.not. allocated(error) .and. what == "peaks") call solve_vibration(frame, floquet, 360, 20, vibration, error)
    if (allocated(error)) return
    rho = multipliers%rho
    if (what /= "multipliers") x0 = vibration%start%x0
    verdict = multipliers%verdict()
    call evidence(floquet, found)
    evaluations = found%evaluations
  end subroutine solve_to_tolerance

end module library_calls
