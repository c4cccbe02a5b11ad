!> Solves a system by integration over the period, which gives the monodromy matrix and the forced motion.
module gestell_floquet_solution_integrated
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_balance_periodic_motion, only: motion_type, solve_motion
  use gestell_floquet_multipliers, only: multipliers_type, solve_multipliers
  use gestell_floquet_solution_part_solution, only: part_solution_type
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_choice_survey, only: survey_type
  use gestell_floquet_period_period_map, only: trajectory
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, raise_resonance, solve_periodic
  use gestell_floquet_period_turn_errors, only: solve_corrections, compare, comparison_type, relative_rounding, rounding_errors, &
    & compute_differences, turn_errors_type
  use gestell_math_matrix, only: balanced
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: integrate

  !> Solution by integration.
  type, extends(part_solution_type), public :: integrated_type
    !> Monodromy matrix and forced motion over the period
    type(monodromy_type) :: monodromy
    !> `survey`: estimates from which the method and its steps were chosen; unallocated if the user chose them. `tolerance`:
    !> requested accuracy
    type(survey_type), allocatable :: survey
    real(dp) :: tolerance = 0
  contains
    procedure :: multipliers => part_multipliers, start => part_start, follow => part_motion
    procedure :: errors => part_errors, liouville_defect => part_liouville_defect, balance => part_balance
  end type integrated_type

contains

  !> Computes Phi(T), and x_p(T) if `forced`, to the requested accuracy. Fails in the cases in which `solve_monodromy` fails.
  subroutine integrate(system, accuracy, forced, integrated, error, surveyed)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    !> If true, compute x_p(T) too
    logical, intent(in) :: forced
    type(integrated_type), intent(out) :: integrated
    type(error_type), allocatable, intent(out) :: error
    !> Estimates from `survey_system`, if the caller already has them
    type(survey_type), intent(in), optional :: surveyed

    call solve_monodromy(system, accuracy, forced, integrated%monodromy, error, surveyed)
    if (allocated(error)) return
    integrated%tolerance = accuracy%tolerance
    if (present(surveyed) .and. accuracy%steps == 0 .and. allocated(accuracy%method)) then
      if (accuracy%method == "auto") integrated%survey = surveyed
    end if
    integrated%scale = integrated%monodromy%scale
    integrated%phase_advance = integrated%monodromy%phase_advance
    associate (evidence => integrated%evidence, monodromy => integrated%monodromy)
      evidence%methods = trim(monodromy%method%name)
      evidence%evaluations = monodromy%evaluations
      evidence%error = monodromy%error / max(monodromy%norm, tiny(1.0_dp))
      evidence%steps = monodromy%steps
    end associate
  end subroutine integrate

  !> Implements `multipliers` of part_solution_type.
  subroutine part_multipliers(self, vectors, multipliers, error)
    class(integrated_type), intent(in) :: self
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error

    call solve_multipliers(self%monodromy, vectors, multipliers, error)
  end subroutine part_multipliers

  !> Implements `start` of part_solution_type.
  subroutine part_start(self, solution, error)
    class(integrated_type), intent(in) :: self
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error

    call solve_periodic(self%monodromy, solution, error)
  end subroutine part_start

  !> Implements `balance` of part_solution_type.
  subroutine part_balance(self, system, motion)
    class(integrated_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    type(motion_type), allocatable, intent(out) :: motion
    logical :: fits

    if (.not. (allocated(self%survey) .and. allocated(self%monodromy%segments%maps))) return
    allocate(motion)
    call solve_motion(system, self%survey, self%monodromy, self%tolerance, motion, fits)
    if (.not. fits) deallocate(motion)
  end subroutine part_balance

  !> Implements `follow` of part_solution_type.
  subroutine part_motion(self, system, x0, phases, x, error)
    class(integrated_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: x0(:), phases(:)
    real(dp), intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error

    call trajectory(system, self%monodromy%method, self%monodromy%nodes, x0, phases, x, error)
  end subroutine part_motion

  !> Implements `errors` of part_solution_type, by (67) of doc/theory.md. Fails on overflow, or if rounding errors do not exclude a
  !> resonance.
  subroutine part_errors(self, system, phases, x, errors, error, disturbance)
    class(integrated_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: phases(:), x(:, :)
    type(turn_errors_type), intent(out) :: errors
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: disturbance
    integer, parameter :: max_segments = 8
    real(dp), parameter :: ends(2) = [0.0_dp, 1.0_dp]
    type(comparison_type) :: comparison, turn
    real(dp), allocatable :: z(:, :), due(:, :), inverted(:, :), own(:)
    integer, allocatable :: first(:)
    real(dp), allocatable :: a(:, :, :)
    real(dp) :: rounding, lost
    integer :: count, k

    count = min(max_segments, size(phases) - 1)
    allocate(first, source=[(1 + (k * (size(phases) - 1)) / count, k = 0, count)])
    associate (monodromy => self%monodromy)
      call compare(system, monodromy%method, monodromy%nodes, monodromy%scale, phases(first), x(:, first(:count)), phases, x, &
        & comparison, error)
      if (allocated(error)) return
      call compare(system, monodromy%method, monodromy%nodes, monodromy%scale, ends, x(:, :1), ends, x(:, [1, 1]), turn, error)
      if (allocated(error)) return
      allocate(z(size(x, 1), count), due(size(x, 1), count))
      call solve_corrections(turn, comparison, monodromy%scale, z, due, inverted, error)
      if (allocated(error)) return
      rounding = relative_rounding(system, comparison%steps, monodromy%phase_advance)
      lost = norm2(inverted) * rounding * monodromy%norm
      if (.not. lost < 1) then
        call raise_resonance(error)
        return
      end if
      own = (rounding + system%load_rounding) / (1 - lost) * comparison%size / count
      if (present(disturbance)) own = own + disturbance / minval(monodromy%scale) / count
      allocate(a, mold=comparison%map)
      do k = 1, count
        a(:, :, k) = balanced(comparison%map(:, :, k), monodromy%scale)
      end do
      call compute_differences(comparison, monodromy%scale, z, due, rounding_errors(a, inverted, own), own, errors)
    end associate
  end subroutine part_errors

  !> Implements `liouville_defect` of part_solution_type.
  subroutine part_liouville_defect(self, system, defect, error)
    class(integrated_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(out) :: defect
    type(error_type), allocatable, intent(out) :: error

    call self%monodromy%liouville_defect(system, defect, error)
  end subroutine part_liouville_defect

end module gestell_floquet_solution_integrated
