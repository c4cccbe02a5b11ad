!> Computes multipliers for the search for borders. They are accurate even if the motion grows by many decades within the period and
!> decays again.
module gestell_task_boundary_line_multipliers
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_solution_factored, only: factored_type, solve_factored
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_floquet_multipliers, only: append, arrange, multipliers_type, empty_multipliers
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_system_averaged, only: averaged_system
  use gestell_system_subsystem, only: find_subsystems, extract_subsystem
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: border_multipliers

contains

  !> Computes all multipliers of a system. Parts of the system that are not coupled are solved separately. The multipliers are
  !> computed from the factors of the monodromy matrix, because forming the product of the factors loses digits. For example,
  !> solutions of Mathieu's equation with q = 25 reach 1e7 in the middle of the period and +-1 at its end. If the factors are not
  !> available or too expensive, `solve_floquet` computes the matrix itself. Fails if `solve_floquet` fails.
  subroutine border_multipliers(system, accuracy, multipliers, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    class(periodic_system), allocatable :: part
    type(multipliers_type) :: own
    integer, allocatable :: numbers(:), states(:)
    integer :: i, k

    call find_subsystems(system, numbers, error)
    if (allocated(error)) return
    if (maxval(numbers) == 1) then
      call solve_part(system, accuracy, multipliers, error)
      return
    end if
    multipliers = empty_multipliers(0)
    do k = 1, maxval(numbers)
      call extract_subsystem(system, pack([(i, i = 1, size(numbers))], numbers == k), part, states)
      call solve_part(part, accuracy, own, error)
      if (allocated(error)) return
      call append(multipliers, own)
    end do
    call arrange(multipliers)
  end subroutine border_multipliers

  subroutine solve_part(system, accuracy, multipliers, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    !> Limit of the phase advance (rad) of the fastest vibration over the period. Above this limit order reduction may be cheaper
    !> than the factors of the monodromy matrix.
    real(dp), parameter :: many_turns = 700
    type(factored_type) :: factored
    type(floquet_type) :: floquet
    type(survey_type) :: survey
    logical :: factors

    factors = accuracy%steps <= 0
    if (allocated(accuracy%method)) factors = factors .and. accuracy%method /= "reduced"
    select type (system)
    type is (averaged_system)
      factors = .false.
    end select
    if (factors) call survey_system(system, survey, error)
    if (factors .and. .not. (allocated(error) .or. survey%phase_advance > many_turns)) then
      call solve_factored(system, accuracy, .false., factored, error, survey)
      if (.not. allocated(error)) call factored%multipliers(.false., multipliers, error)
      if (.not. allocated(error)) return
    end if
    call solve_floquet(system, accuracy, .false., floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
  end subroutine solve_part

end module gestell_task_boundary_line_multipliers
