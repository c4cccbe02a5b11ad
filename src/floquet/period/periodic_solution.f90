!> Computes the periodic solution of x' = P x + f, if it is unique: its initial state x0 = (E - Phi)^-1 x_p(T), and the motion that
!> starts from x0.
module gestell_floquet_period_periodic_solution
  use gestell_base_error, only: error_type, failed_computation, fatal_error, invalid_input, resonance
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: inverse
  use gestell_math_matrix, only: balanced, unit_matrix
  use gestell_floquet_period_period_map, only: trajectory
  use gestell_floquet_period_monodromy, only: monodromy_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: follow, raise_resonance, solve_periodic

  !> Initial state of the periodic motion, with error bounds
  type, public :: periodic_solution_type
    !> `x0`: state at t = 0, shape (n). `error`: bound on the error of each of its components, shape (n).
    real(dp), allocatable :: x0(:), error(:)
    !> Condition number |(E - Phi)^-1| (1 + |Phi|) in balanced units. Its decimal logarithm is the number of digits that the
    !> solution loses.
    real(dp) :: condition = 0
  end type periodic_solution_type

contains

  !> Creates the error message for resonance: no periodic vibration exists, or the error of Phi(T) is too large for computing it.
  pure subroutine raise_resonance(error)
    type(error_type), allocatable, intent(out) :: error

    call fatal_error(error, "the periodic vibration cannot be computed: a multiplier equals 1 within its error bound " &
      & // "(resonance); add damping, change the speed or reduce the tolerance", failed_computation)
    error%cause = resonance
  end subroutine raise_resonance

  !> Solves (E - Phi) x0 = x_p(T) in balanced units. Errors e of Phi and e_p of x_p(T) change x0 by at most
  !>
  !>     |(E - Phi)^-1| (e |x0| + e_p) / (1 - |(E - Phi)^-1| e).
  !>
  !> This bound is used for rounding errors. Integration errors are known element by element, as matrices E' with the corresponding
  !> vectors e_p. They change x0 by (E - Phi)^-1 (E' x0 + e_p), where E' x0 and e_p nearly cancel, because the periodic motion is
  !> slower than the free vibrations.
  !>
  !> Fails if `monodromy` was solved without forcing, or with so few steps that its error is unknown. Also fails at resonance: E -
  !> Phi may be singular within its error bound.
  subroutine solve_periodic(monodromy, solution, error)
    type(monodromy_type), intent(in) :: monodromy
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: inverted(:, :), vectors(:, :)
    real(dp), parameter :: little = 0.01_dp
    real(dp) :: phi_error, xp_error, amplification, lost, part
    integer :: n, k

    if (.not. (allocated(monodromy%phi) .and. allocated(monodromy%xp))) then
      call fatal_error(error, "solve_periodic requires a system that was solved with forcing", invalid_input)
      return
    end if
    if (.not. (monodromy%known .and. monodromy%xp_known)) then
      call fatal_error(error, "the periodic vibration cannot be computed: too few steps for an error bound (request more " // &
        &   "steps, or 0 to let the tolerance determine their number)", failed_computation)
      return
    end if
    n = size(monodromy%scale)
    allocate(vectors(n, 3), source=0.0_dp)
    phi_error = n * epsilon(1.0_dp) * (n + monodromy%norm)
    associate (d => monodromy%scale, known => allocated(monodromy%phi_change) .and. allocated(monodromy%xp_change), &
      & x => vectors(:, 1), disturbance => vectors(:, 2), change => vectors(:, 3))
      if (known) then
        phi_error = phi_error + monodromy%roundoff
        xp_error = monodromy%xp_roundoff
      else
        phi_error = phi_error + monodromy%error
        xp_error = monodromy%xp_error
      end if
      call inverse(unit_matrix(n) - balanced(monodromy%phi, d), inverted, error)
      if (allocated(error)) then
        call raise_resonance(error)
        return
      end if
      amplification = norm2(inverted)
      x = matmul(inverted, monodromy%xp / d)
      lost = 0
      if (known) then
        do k = 1, size(monodromy%phi_change, 3)
          associate (e => balanced(monodromy%phi_change(:, :, k), d))
            ! |(E - Phi)^-1 E'|, or the product of the norms if it is small.
            part = amplification * norm2(e)
            if (part > little) part = norm2(matmul(inverted, e))
            lost = max(lost, part)
            disturbance = matmul(inverted, matmul(e, x) + monodromy%xp_change(:, k) / d)
          end associate
          ! A component can be small by chance: each is taken as at least half of the norm.
          change = max(change, abs(disturbance), 0.5_dp * norm2(disturbance))
        end do
      end if
      lost = lost + amplification * phi_error
      if (.not. lost < 1) then
        call raise_resonance(error)
        return
      end if
      solution%condition = amplification * (1 + monodromy%norm)
      solution%x0 = x * d
      solution%error = (norm2(inverted, dim=2) * (norm2(x) * phi_error + xp_error) + change) / (1 - lost) * d
    end associate
  end subroutine solve_periodic

  !> Computes the periodic motion at the phases. Fails if `solution` is empty or `trajectory` fails.
  subroutine follow(system, monodromy, solution, phases, x, error)
    class(periodic_system), intent(in) :: system
    type(monodromy_type), intent(in) :: monodromy
    type(periodic_solution_type), intent(in) :: solution
    !> Phases in [0, 1], ascending
    real(dp), intent(in) :: phases(:)
    !> Motion at the phases, shape (n, phases)
    real(dp), allocatable, intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error

    if (.not. (allocated(solution%x0) .and. allocated(monodromy%method))) then
      call fatal_error(error, "call solve_periodic first: the start of the motion is missing", invalid_input)
      return
    end if
    allocate(x(system%states, size(phases)))
    call trajectory(system, monodromy%method, monodromy%nodes, solution%x0, phases, x, error)
  end subroutine follow

end module gestell_floquet_period_periodic_solution
