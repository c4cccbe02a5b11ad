!> One part of a system that does not act on the others, solved by the cheapest way: by reduction where its vibrations are
!> fast against the period, by the factors of its map where this loses modes, else by integration over the period.
module gestell_floquet_part
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_floquet_constant, only: constant_type, solve_constant
  use gestell_floquet_factors_factored, only: factored_errors, follow_factored
  use gestell_floquet_factors, only: factors_type, solve_factors
  use gestell_floquet_integrator_method, only: name_length
  use gestell_floquet_integrator_methods, only: method_names
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy, survey
  use gestell_floquet_period_periodic_solution, only: errors_of_monodromy => take_errors, follow_monodromy => follow, &
    & periodic_solution_type
  use gestell_floquet_reduction_reduced, only: follow_reduced, reduced_errors, reduced_periodic, reduced_type, solve_reduced
  use gestell_floquet_reduction, only: reduce, reduction_type
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_system_averaged, only: averaged_system
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: errors_of_part, follow_part, scale_of, solve_part, ways

  !> A part of the system: its map over the period, its reduction, or the factors of its map.
  type, public :: part_type
    !> Places of its states in those of the system.
    integer, allocatable :: states(:)
    type(monodromy_type), allocatable :: monodromy
    type(reduced_type), allocatable :: reduced
    type(factors_type), allocatable :: factors
    type(constant_type), allocatable :: constant
    !> The part as a system; unallocated where it is the whole.
    class(periodic_system), allocatable :: system
  end type part_type

  !> Reduction is tried where the fastest vibration turns by more radians than this within the period.
  real(dp), parameter :: many_turns = 700
  !> And where reduction tells little of the periodic motion, integration up to so many: a tenth of a second.
  real(dp), parameter :: most_affordable = 1.0e5_dp
  !> What reduction is to tell of the periodic motion, relative to it, where integration costs more, and where it costs less.
  real(dp), parameter :: few_digits = 1.0e-4_dp, many_digits = 1.0e-5_dp

contains

  !> All names that `accuracy%method` may have: those of the integration methods, and the reduction.
  pure function ways() result(names)
    character(len=name_length), allocatable :: names(:)

    allocate(names, source=[character(len=name_length) :: method_names(), "reduced"])
  end function ways

  !> Solves a part; see gestell_floquet_solution.
  subroutine solve_part(system, accuracy, forced, part, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(in) :: forced
    type(part_type), intent(inout) :: part
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: unfit, why
    type(reduced_type), allocatable :: vague
    type(accuracy_type) :: order
    real(dp), allocatable :: scale(:)
    real(dp) :: turns

    select type (system)
    type is (averaged_system)
      allocate(part%constant)
      call solve_constant(system, forced, part%constant, error)
      return
    end select

    order = accuracy
    if (.not. allocated(order%method)) order%method = "auto"
    call survey(system, scale, turns, error)
    if (allocated(error)) return
    if (order%method == "reduced" .or. (order%method == "auto" .and. order%steps == 0 .and. turns > many_turns)) then
      call try_reduction(system, order, forced, scale, part, why)
      if (.not. allocated(why)) then
        if (.not. forced .or. order%method == "reduced" .or. turns > most_affordable) return
        if (tells_motion(part%reduced, max(few_digits, order%tolerance))) return
        call move_alloc(part%reduced, vague)
        call integrate(system, order, forced, part, why)
        if (.not. allocated(why)) return
        call move_alloc(vague, part%reduced)
        if (allocated(part%monodromy)) deallocate(part%monodromy)
        return
      end if
      if (order%method == "reduced") then
        call fatal_error(error, "method 'reduced' does not apply: " // why%message, failed_computation)
        return
      end if
    end if

    allocate(part%monodromy)
    call solve_monodromy(system, order, forced, part%monodromy, error)
    if (order%steps > 0) return
    if (allocated(error) .and. .not. part%monodromy%broken) then
      if (allocated(why)) error%message = error%message // "; reduction does not apply: " // why%message
      return
    end if
    if (.not. allocated(error)) then
      if (.not. part%monodromy%loses_modes()) return
    end if
    ! Some modes are lost in rounding beside others, or the numbers overflow.
    if (order%method == "auto" .and. turns <= many_turns) then
      call try_reduction(system, order, forced, scale, part, unfit)
      if (.not. allocated(unfit) .and. forced) then
        if (.not. tells_motion(part%reduced, max(many_digits, order%tolerance))) then
          deallocate(part%reduced)
          allocate(unfit)
        end if
      end if
      if (.not. allocated(unfit)) then
        deallocate(part%monodromy)
        if (allocated(error)) deallocate(error)
        return
      end if
    end if
    allocate(part%factors)
    call solve_factors(system, order, forced, part%factors, unfit)
    if (allocated(unfit)) then
      deallocate(part%factors)
      if (allocated(error) .and. allocated(why)) error%message = error%message // "; reduction does not apply: " // why%message
    else
      deallocate(part%monodromy)
      if (allocated(error)) deallocate(error)
    end if
  end subroutine solve_part

  !> By integration, whatever reduction could tell. Error: the motion cannot be integrated so.
  subroutine integrate(system, order, forced, part, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: order
    logical, intent(in) :: forced
    type(part_type), intent(inout) :: part
    type(error_type), allocatable, intent(out) :: error
    logical :: lost

    allocate(part%monodromy)
    call solve_monodromy(system, order, forced, part%monodromy, error)
    lost = allocated(error)
    if (.not. lost) lost = part%monodromy%loses_modes()
    if (.not. lost) return
    if (allocated(error)) deallocate(error)
    deallocate(part%monodromy)
    allocate(part%factors)
    call solve_factors(system, order, forced, part%factors, error)
    if (allocated(error)) deallocate(part%factors)
  end subroutine integrate

  !> Whether the bound on the error of the periodic motion is below this part of its size: within a group of modes whose rates vary
  !> over the period it may be worse than the motion by many orders, where factors tell it well.
  logical function tells_motion(reduced, part)
    type(reduced_type), intent(in) :: reduced
    real(dp), intent(in) :: part
    type(periodic_solution_type) :: motion
    type(error_type), allocatable :: error

    tells_motion = .false.
    call reduced_periodic(reduced, motion, error)
    if (allocated(error)) return
    tells_motion = norm2(motion%error / reduced%scale) <= part * maxval(abs(reduced%reduction%response))
  end function tells_motion

  subroutine try_reduction(system, accuracy, forced, scale, part, unfit)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(in) :: forced
    real(dp), intent(in) :: scale(:)
    type(part_type), intent(inout) :: part
    type(error_type), allocatable, intent(out) :: unfit
    type(reduction_type) :: reduction

    call reduce(system, scale, forced, accuracy%tolerance, reduction, unfit)
    if (allocated(unfit)) return
    allocate(part%reduced)
    call solve_reduced(system, reduction, scale, accuracy_type(tolerance=accuracy%tolerance), part%reduced, unfit)
    if (allocated(unfit)) deallocate(part%reduced)
  end subroutine try_reduction

  pure function scale_of(part) result(scale)
    type(part_type), intent(in) :: part
    real(dp) :: scale(size(part%states))

    if (allocated(part%constant)) then
      scale = part%constant%scale
    else if (allocated(part%reduced)) then
      scale = part%reduced%scale
    else if (allocated(part%factors)) then
      scale = part%factors%scale
    else
      scale = part%monodromy%scale
    end if
  end function scale_of

  !> The periodic motion at `phases` (ascending, in [0, 1]), shape (n, points). Error: overflow.
  subroutine follow_part(system, part, solution, phases, x, error)
    class(periodic_system), intent(in) :: system
    type(part_type), intent(in) :: part
    type(periodic_solution_type), intent(in) :: solution
    real(dp), intent(in) :: phases(:)
    real(dp), allocatable, intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error

    allocate(x(size(part%states), size(phases)))
    if (allocated(part%constant)) then
      call part%constant%spectrum%motion(phases, x)
    else if (allocated(part%monodromy)) then
      deallocate(x)
      call follow_monodromy(system, part%monodromy, solution, phases, x, error)
    else if (allocated(part%reduced)) then
      call follow_reduced(part%reduced, solution%x0, phases, x, error)
    else
      call follow_factored(system, part%factors, phases, x, error)
    end if
  end subroutine follow_part

  !> The errors of the motion `x` that `follow_part` found at `phases`, shape (n, phases), the first 0 and the last 1. Errors:
  !> overflow; resonance within the errors.
  subroutine errors_of_part(system, part, phases, x, errors, error)
    class(periodic_system), intent(in) :: system
    type(part_type), intent(in) :: part
    real(dp), intent(in) :: phases(:), x(:, :)
    type(turn_errors_type), intent(out) :: errors
    type(error_type), allocatable, intent(out) :: error

    if (allocated(part%constant)) then
      allocate(errors%differences(size(x, 1), 2 * size(phases)), source=0.0_dp)
      allocate(errors%rounding, source=part%constant%spectrum%error)
    else if (allocated(part%monodromy)) then
      call errors_of_monodromy(system, part%monodromy, phases, x, errors, error)
    else if (allocated(part%reduced)) then
      call reduced_errors(part%reduced, phases, x, errors, error)
    else
      call factored_errors(system, part%factors, phases, x, errors, error)
    end if
  end subroutine errors_of_part

end module gestell_floquet_part
