!> Computes Phi(T) and x_p(T) with a given number of steps, and compares solutions with different numbers of steps.
module gestell_floquet_period_trial
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: balanced
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type, unresolved_type
  use gestell_floquet_period_period_map, only: period_map, period_map_type, segments_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: distance, roundoff, solve_level

  !> Map of the period, computed with a given number of steps
  type, public, extends(period_map_type) :: level_type
    !> Ends of the steps, as phases t / T, shape (0:steps)
    real(dp), allocatable :: nodes(:)
    !> `norm`: norm of Phi(T). `xp_peak`: largest norm of x_p(t). `transient_growth`: growth of rounding errors (see `period_map`).
    real(dp) :: norm = 0, xp_peak = 0, transient_growth = 1
    !> `steps`: number of steps. `stages`: number of stages per step.
    integer :: steps = 0, stages = 0
    !> Effects of variations of the coefficients and loads between the nodes, summed over the steps
    type(unresolved_type) :: unresolved
  end type level_type

contains

  !> Computes the map of the period with `steps` steps, or slightly more because every break of the coefficients must end a step.
  !> Fails in the cases in which `period_map` fails.
  subroutine solve_level(system, method, scale, steps, forced, level, error, lower, segments)
    class(periodic_system), intent(in) :: system
    class(method_type), intent(in) :: method
    !> Units of the states, shape (n)
    real(dp), contiguous, intent(in) :: scale(:)
    !> Number of steps
    integer, intent(in) :: steps
    !> If true, compute x_p(T) too
    logical, intent(in) :: forced
    type(level_type), intent(out) :: level
    type(error_type), allocatable, intent(out) :: error
    !> Maps of the period by the two embedded methods, shape (2)
    type(period_map_type), intent(out), optional :: lower(:)
    !> Maps of segments of the period; computed only if x_p(T) is
    type(segments_type), intent(inout), optional :: segments

    level%nodes = mesh(system, steps)
    level%steps = size(level%nodes) - 1
    level%stages = method%stages
    allocate(level%phi(system%states, system%states))
    ! An unallocated xp counts as an absent argument.
    if (forced) allocate(level%xp(system%states))
    call period_map(system, method, level%nodes, scale, level%phi, error, level%xp, level%xp_peak, level%transient_growth, lower, &
      & level%unresolved, segments)
    if (.not. allocated(error)) level%norm = norm2(balanced(level%phi, scale))
  end subroutine solve_level

  !> Differences between two solutions, relative to `other`: of Phi(T), index 1, and of x_p(T), index 2. If all free vibrations
  !> decay below the smallest number, Phi(T) is treated as zero.
  pure function distance(one, other, scale) result(d)
    type(level_type), intent(in) :: one, other
    real(dp), intent(in) :: scale(:)
    real(dp) :: d(2)

    d(1) = norm2(balanced(one%phi - other%phi, scale)) / max(other%norm, tiny(1.0_dp))
    d(2) = 0
    if (allocated(other%xp)) then
      if (other%xp_peak > 0) d(2) = norm2((one%xp - other%xp) / scale) / other%xp_peak
    end if
  end function distance

  !> Bound on the rounding error relative to Phi(T), the sum of three parts:
  !>
  !> - the rounding errors of all steps, which have the same sign if the coefficients are nearly constant,
  !> - the phase error of the fastest motion due to rounded coefficients,
  !> - the rounding errors of the model.
  !>
  !> The sum is multiplied by the transient growth of Phi(t).
  pure real(dp) function roundoff(system, level, phase_advance)
    class(periodic_system), intent(in) :: system
    type(level_type), intent(in) :: level
    !> Phase advance (radians) of the fastest motion within the period
    real(dp), intent(in) :: phase_advance

    roundoff = (epsilon(1.0_dp) * ((size(level%phi, 1) + level%stages) * level%steps + 2 * phase_advance) + system%rounding) &
      & * level%transient_growth
  end function roundoff

end module gestell_floquet_period_trial
