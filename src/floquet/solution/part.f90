!> Solves one part of a system in the cheapest way. If the vibrations of the part are fast compared with the period, the part is
!> reduced. If rounding errors in the map over the period would destroy strongly damped modes, the factors of the map are
!> used. All other parts are integrated over the period.
module gestell_floquet_solution_part
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_floquet_solution_constant, only: constant_type, solve_constant
  use gestell_floquet_solution_factored, only: factored_type, solve_factored
  use gestell_floquet_integrator_method, only: name_length
  use gestell_floquet_choice_methods, only: method_names
  use gestell_floquet_solution_part_solution, only: part_solution_type
  use gestell_floquet_solution_integrated, only: integrate, integrated_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_reduction, only: reduce, reduction_type
  use gestell_floquet_solution_reduced, only: reduced_type, solve_reduced
  use gestell_system_averaged, only: averaged_system
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: solve_part, solution_methods

  !> Phase advance of the fastest vibration within the period (rad) above which reduction is tried.
  real(dp), parameter :: large_advance = 700
  !> Maximum phase advance of the fastest vibration within the period (rad) at which the system is integrated because the
  !> periodic motion from a reduction is too inaccurate. The integration then takes about 0.1 s.
  real(dp), parameter :: max_affordable = 1.0e5_dp
  !> Relative accuracy of the periodic motion that a reduction must reach: `few_digits` if integration would be expensive,
  !> `many_digits` if it is cheap.
  real(dp), parameter :: few_digits = 1.0e-4_dp, many_digits = 1.0e-5_dp

contains

  !> All valid values of `accuracy%method`: the names of the integration methods, and 'reduced'.
  pure function solution_methods() result(names)
    character(len=name_length), allocatable :: names(:)

    allocate(names, source=[character(len=name_length) :: method_names(), "reduced"])
  end function solution_methods

  !> Solves a system that does not consist of independent parts. For arguments and errors see `solve_floquet` in
  !> gestell_floquet_solution.
  subroutine solve_part(system, accuracy, forced, solution, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(in) :: forced
    class(part_solution_type), allocatable, intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: refusal, why
    type(constant_type), allocatable :: constant
    type(integrated_type), allocatable :: integrated
    type(reduced_type), allocatable :: reduced
    type(factored_type), allocatable :: factored
    type(accuracy_type) :: settings
    type(survey_type) :: survey
    logical :: lost

    select type (system)
    type is (averaged_system)
      allocate(constant)
      call solve_constant(system, forced, constant, error)
      call move_alloc(constant, solution)
      return
    end select

    settings = accuracy
    if (.not. allocated(settings%method)) settings%method = "auto"
    call survey_system(system, survey, error, forced)
    if (allocated(error)) return
    if (settings%method == "reduced" .or. (settings%method == "auto" .and. settings%steps == 0 &
      & .and. survey%phase_advance > large_advance)) then
      call try_reduction(system, settings, forced, survey, reduced, why)
      if (allocated(reduced)) then
        if (forced .and. settings%method /= "reduced" .and. survey%phase_advance <= max_affordable) then
          if (.not. bounds_motion(reduced, max(few_digits, settings%tolerance))) then
            call map_period(system, settings, forced, survey, solution)
          end if
        end if
        if (.not. allocated(solution)) call move_alloc(reduced, solution)
        return
      end if
      if (settings%method == "reduced") then
        call fatal_error(error, "method 'reduced' cannot be used: " // why%message, failed_computation)
        return
      end if
    end if

    allocate(integrated)
    call integrate(system, settings, forced, integrated, error, survey)
    lost = .not. allocated(error)
    if (lost) lost = integrated%monodromy%loses_modes()
    if (integrated%monodromy%broken) lost = .true.
    if (settings%steps == 0 .and. lost) then
      ! Some modes are lost in rounding, or numbers overflow.
      if (settings%method == "auto" .and. survey%phase_advance <= large_advance) then
        call try_reduction(system, settings, forced, survey, reduced, refusal)
        if (allocated(reduced) .and. forced) then
          if (.not. bounds_motion(reduced, max(many_digits, settings%tolerance))) deallocate(reduced)
        end if
      end if
      if (allocated(reduced)) then
        call move_alloc(reduced, solution)
      else
        allocate(factored)
        call solve_factored(system, settings, forced, factored, refusal, survey)
        if (.not. allocated(refusal)) call move_alloc(factored, solution)
      end if
    end if
    if (allocated(solution)) then
      if (allocated(error)) deallocate(error)
    else if (allocated(error)) then
      if (allocated(why)) error%message = error%message // "; reduction does not apply: " // why%message
    else
      call move_alloc(integrated, solution)
    end if
  end subroutine solve_part

  !> Solves the system by its map over the period, or by the factors of the map if the map loses modes. If both fail, `solution` is
  !> unallocated.
  subroutine map_period(system, settings, forced, survey, solution)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: settings
    logical, intent(in) :: forced
    type(survey_type), intent(in) :: survey
    class(part_solution_type), allocatable, intent(out) :: solution
    type(integrated_type), allocatable :: integrated
    type(factored_type), allocatable :: factored
    type(error_type), allocatable :: error

    allocate(integrated, factored)
    call integrate(system, settings, forced, integrated, error, survey)
    if (.not. allocated(error)) then
      if (.not. integrated%monodromy%loses_modes()) call move_alloc(integrated, solution)
    end if
    if (allocated(solution)) return
    call solve_factored(system, settings, forced, factored, error, survey)
    if (.not. allocated(error)) call move_alloc(factored, solution)
  end subroutine map_period

  !> True if the bound on the error of the periodic motion is at most `part` times the size of the motion. If the decay rates of
  !> a group of modes vary over the period, the bound may exceed the motion by orders of magnitude. The factors of the map over
  !> the period then give a better bound.
  logical function bounds_motion(reduced, part)
    type(reduced_type), intent(in) :: reduced
    real(dp), intent(in) :: part
    type(periodic_solution_type) :: motion
    type(error_type), allocatable :: error

    bounds_motion = .false.
    call reduced%start(motion, error)
    if (allocated(error)) return
    bounds_motion = norm2(motion%error / reduced%scale) <= part * max(maxval(abs(reduced%reduction%response)), &
      & maxval(abs(motion%x0 / reduced%scale)))
  end function bounds_motion

  !> Solves the system by reduction. If reduction does not apply, `refusal` holds the reason.
  subroutine try_reduction(system, accuracy, forced, survey, reduced, refusal)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(in) :: forced
    type(survey_type), intent(in) :: survey
    type(reduced_type), allocatable, intent(out) :: reduced
    type(error_type), allocatable, intent(out) :: refusal
    type(reduction_type) :: reduction

    call reduce(system, survey%scale, forced, accuracy%tolerance, reduction, refusal)
    if (allocated(refusal)) return
    allocate(reduced)
    call solve_reduced(system, reduction, survey%scale, accuracy_type(tolerance=accuracy%tolerance), reduced, refusal)
    if (allocated(refusal)) deallocate(reduced)
  end subroutine try_reduction

end module gestell_floquet_solution_part
