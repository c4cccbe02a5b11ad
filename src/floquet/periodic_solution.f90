!> The one periodic solution of x' = P x + f: x0 = (E - Phi)^-1 x_p(T), and the motion that starts there.
module gestell_floquet_periodic_solution
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_lapack, only: inverse
  use gestell_floquet_flow, only: trajectory
  use gestell_floquet_monodromy, only: monodromy_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: follow, resonance, solve_periodic

  !> What a failure means.
  character(len=*), parameter :: resonance = "the periodic vibration cannot be told: within the error of the free ones a " &
    & // "multiplier may equal 1 (resonance); more damping, another speed or a smaller tolerance may help"

  !> Where the periodic motion starts, with the evidence.
  type, public :: periodic_solution_type
    !> State at t = 0, and a bound on the error of each component; shape (n).
    real(dp), allocatable :: x0(:), error(:)
    !> |(E - Phi)^-1| (1 + |Phi|) in balanced units; its decimal logarithm is what the solution costs in digits.
    real(dp) :: condition = 0
  end type periodic_solution_type

contains

  !> Solves (E - Phi) x0 = x_p(T) in balanced units. An error e of Phi and e_p of x_p(T) disturb x0 by at most
  !>
  !>     |(E - Phi)^-1| (e |x0| + e_p) / (1 - |(E - Phi)^-1| e).
  !>
  !> Error: an error of Phi as large as e can make E - Phi singular, so that nothing is known of x0.
  subroutine solve_periodic(monodromy, solution, error)
    type(monodromy_type), intent(in) :: monodromy
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: a(:, :), inverted(:, :)
    real(dp) :: x(size(monodromy%scale)), amplification
    integer :: n, i

    n = size(monodromy%scale)
    associate (d => monodromy%scale, phi_error => monodromy%error + n * epsilon(1.0_dp) * (n + monodromy%norm))
      a = -monodromy%phi * spread(d, 1, n) / spread(d, 2, n)
      do i = 1, n
        a(i, i) = 1 + a(i, i)
      end do
      call inverse(a, inverted, error)
      amplification = 0
      if (.not. allocated(error)) amplification = norm2(inverted)
      if (allocated(error) .or. amplification * phi_error >= 1) then
        call fatal_error(error, resonance, failed_computation)
        return
      end if
      solution%condition = amplification * (1 + monodromy%norm)
      x = matmul(inverted, monodromy%xp / d)
      solution%x0 = x * d
      solution%error = norm2(inverted, dim=2) * d * (norm2(x) * phi_error + monodromy%xp_error) &
        & / (1 - amplification * phi_error)
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
