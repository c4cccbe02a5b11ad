!> The one periodic solution of x' = P x + f: x0 = (E - Phi)^-1 x_p(T), and the motion that starts there.
module gestell_floquet_periodic_solution
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_lapack, only: factorise, inverse, solve_factored
  use gestell_floquet_flow, only: trajectory
  use gestell_floquet_monodromy, only: monodromy_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: follow, solve_periodic

  !> Where the periodic motion starts, with the evidence.
  type, public :: periodic_solution_type
    !> State at t = 0, and a bound on the error of each component; shape (n).
    real(dp), allocatable :: x0(:), error(:)
    !> Condition of E - Phi in balanced units; its decimal logarithm is what the solution costs in digits.
    real(dp) :: condition = 0
  end type periodic_solution_type

contains

  !> Solves (E - Phi) x0 = x_p(T) in balanced units. The bound: an error of Phi and of x_p(T), and the roundings of
  !> the solution, pass through (E - Phi)^-1.
  !> Error: a multiplier is 1 to working precision, so there is no or not only one periodic solution.
  subroutine solve_periodic(monodromy, solution, error)
    type(monodromy_type), intent(in) :: monodromy
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: a(:, :), inverted(:, :), x(:, :)
    real(dp) :: disturbance
    integer, allocatable :: pivots(:)
    integer :: n, i

    n = size(monodromy%scale)
    associate (d => monodromy%scale)
      a = -monodromy%phi * spread(d, 1, n) / spread(d, 2, n)
      do i = 1, n
        a(i, i) = 1 + a(i, i)
      end do
      call inverse(a, inverted, error)
      if (.not. allocated(error)) solution%condition = norm2(a) * norm2(inverted)
      if (allocated(error) .or. solution%condition * epsilon(1.0_dp) > 0.01_dp) then
        call fatal_error(error, "no periodic vibration can be computed: the machine runs in resonance, a multiplier " // &
          & "equals 1 to working precision", failed_computation)
        return
      end if

      x = reshape(monodromy%xp / d, [n, 1])
      disturbance = norm2(a)
      allocate(pivots(n))
      call factorise(a, pivots, error)
      if (allocated(error)) return
      call solve_factored(a, pivots, x)
      disturbance = norm2(x) * (monodromy%error + n * epsilon(1.0_dp) * disturbance) + monodromy%xp_error
      solution%x0 = x(:, 1) * d
      solution%error = norm2(inverted, dim=2) * disturbance * d
    end associate
  end subroutine solve_periodic

  !> The periodic motion at `phases` (ascending, in [0, 1]), shape (n, points).
  subroutine follow(system, monodromy, solution, phases, x, error)
    class(periodic_system), intent(in) :: system
    type(monodromy_type), intent(in) :: monodromy
    type(periodic_solution_type), intent(in) :: solution
    real(dp), intent(in) :: phases(:)
    real(dp), allocatable, intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error

    allocate(x(system%states, size(phases)))
    call trajectory(system, monodromy%method, monodromy%nodes, solution%x0, phases, x, error)
  end subroutine follow

end module gestell_floquet_periodic_solution
