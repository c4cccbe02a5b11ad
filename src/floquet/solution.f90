!> Floquet's solution of a periodic system by the cheapest way: parts that do not act on each other apart, vibrations that
!> are fast against the period by reduction, the others by integration over the period.
module gestell_floquet_solution
  use gestell_base_error, only: error_type, failed_computation, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_constant, only: constant_multipliers, constant_periodic
  use gestell_floquet_factors_factored, only: factored_multipliers, factored_periodic
  use gestell_floquet_period_monodromy, only: accuracy_type, check_accuracy
  use gestell_floquet_period_period_map, only: check_phases
  use gestell_floquet_multipliers, only: append, arrange, multipliers_type, no_multipliers
  use gestell_floquet_multipliers, only: multipliers_of_monodromy => solve_multipliers
  use gestell_floquet_part, only: errors_of_part, follow_part, part_type, scale_of, solve_part
  use gestell_floquet_period_periodic_solution, only: follow_monodromy => follow, periodic_solution_type
  use gestell_floquet_period_periodic_solution, only: periodic_of_monodromy => solve_periodic
  use gestell_floquet_reduction_reduced, only: reduced_multipliers, reduced_periodic
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_system_part, only: check_coupled, independent_parts, part_of
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: checkpoints, evidence, follow, solve_floquet, solve_multipliers, solve_periodic, take_errors

  !> All multipliers of a monodromy matrix or of a Floquet solution.
  interface solve_multipliers
    procedure multipliers_of_monodromy, multipliers_of_floquet
  end interface solve_multipliers

  !> The start of the periodic motion from a monodromy matrix or a Floquet solution.
  interface solve_periodic
    procedure periodic_of_monodromy, periodic_of_floquet
  end interface solve_periodic

  !> The periodic motion over the period.
  interface follow
    procedure follow_monodromy, follow_floquet
  end interface follow

  type, public :: floquet_type
    real(dp) :: period = 0
    !> Whether there is what the periodic motion needs.
    logical :: forced = .false.
    !> Units that make the states comparable, shape (n).
    real(dp), allocatable :: scale(:)
    type(part_type), allocatable :: parts(:)
  end type floquet_type

  !> What a solution rests on, over all parts.
  type, public :: evidence_type
    !> Methods that integrated, separated by commas; 'averaged': closed form. Empty where all was reduced.
    character(len=:), allocatable :: methods
    !> Parts that do not act on each other; steps of the integrations over the period; factors of Phi(T) that were kept in
    !> place of their product; angles of the reductions; evaluations of the coefficients in all.
    integer :: parts = 0, steps = 0, factors = 0, angles = 0, evaluations = 0
    !> Greatest relative error of a part's map, and greatest defect of Liouville's theorem.
    real(dp) :: error = 0, liouville_defect = 0
  end type evidence_type

contains

  !> Solves `system` over its period to `accuracy`; with `forced` also what the periodic motion needs. Method `auto` without
  !> given steps may reduce; `reduced` does nothing else. Where multipliers differ by so much that Phi(T) loses the small
  !> ones, its factors are kept, unless steps are given.
  !> Errors: those of `solve_monodromy`; a table `coupled` of another shape; reduction was asked for and does not apply.
  subroutine solve_floquet(system, accuracy, forced, floquet, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(in) :: forced
    type(floquet_type), intent(out) :: floquet
    type(error_type), allocatable, intent(out) :: error
    integer, allocatable :: numbers(:)
    integer :: k, i

    call system%check(error)
    if (.not. allocated(error)) call check_accuracy(accuracy, error)
    if (.not. allocated(error)) call check_coupled(system, error)
    if (allocated(error)) return
    floquet%period = system%period
    floquet%forced = forced
    allocate(floquet%scale(system%states))
    allocate(numbers, source=independent_parts(system))
    allocate(floquet%parts(maxval(numbers)))
    if (size(floquet%parts) == 1) then
      floquet%parts(1)%states = [(i, i = 1, system%states)]
      call solve_part(system, accuracy, forced, floquet%parts(1), error)
      if (allocated(error)) return
      floquet%scale = scale_of(floquet%parts(1))
      return
    end if
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        call part_of(system, pack([(i, i = 1, size(numbers))], numbers == k), part%system, part%states)
        call solve_part(part%system, accuracy, forced, part, error)
        if (allocated(error)) return
        floquet%scale(part%states) = scale_of(part)
      end associate
    end do
  end subroutine solve_floquet

  !> What `floquet` rests on; nothing where it was not solved.
  pure subroutine evidence(floquet, found)
    type(floquet_type), intent(in) :: floquet
    type(evidence_type), intent(out) :: found
    integer :: k

    found%methods = ""
    if (.not. allocated(floquet%parts)) return
    found%parts = size(floquet%parts)
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        if (allocated(part%constant)) then
          call add("averaged", part%constant%liouville_defect, found)
          found%evaluations = found%evaluations + part%constant%evaluations
          found%error = max(found%error, part%constant%error)
        else if (allocated(part%reduced)) then
          call add("", part%reduced%liouville_defect, found)
          found%angles = found%angles + part%reduced%reduction%angles
          found%evaluations = found%evaluations + part%reduced%reduction%evaluations
          found%error = max(found%error, part%reduced%reduction%residual)
        else if (allocated(part%factors)) then
          call add(part%factors%method%name, part%factors%liouville_defect, found)
          found%steps = found%steps + part%factors%steps
          found%factors = found%factors + size(part%factors%a, 3)
          found%evaluations = found%evaluations + part%factors%evaluations
          found%error = max(found%error, part%factors%relative_error)
        else
          call add(part%monodromy%method%name, part%monodromy%liouville_defect, found)
          found%steps = found%steps + part%monodromy%steps
          found%evaluations = found%evaluations + part%monodromy%evaluations
          found%error = max(found%error, part%monodromy%error / max(part%monodromy%norm, tiny(1.0_dp)))
        end if
      end associate
    end do
  end subroutine evidence

  !> A method, if there is one that is not named already, and a defect, if it is the greatest.
  pure subroutine add(method, liouville_defect, found)
    character(len=*), intent(in) :: method
    real(dp), intent(in) :: liouville_defect
    type(evidence_type), intent(inout) :: found

    if (abs(liouville_defect) > abs(found%liouville_defect)) found%liouville_defect = liouville_defect
    if (len(method) == 0 .or. index(", " // found%methods // ",", ", " // method // ",") > 0) return
    if (len(found%methods) > 0) found%methods = found%methods // ", "
    found%methods = found%methods // method
  end subroutine add

  !> All multipliers; with `vectors` the eigenvectors too. Errors: `floquet` was not solved; LAPACK found no eigenvalues.
  subroutine multipliers_of_floquet(floquet, vectors, multipliers, error)
    type(floquet_type), intent(in) :: floquet
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: own
    complex(dp), allocatable :: shapes(:, :)
    integer :: k

    if (.not. allocated(floquet%parts)) then
      call fatal_error(error, "multipliers are those of a system that solve_floquet has solved", invalid_input)
      return
    end if
    multipliers = no_multipliers(merge(size(floquet%scale), 0, vectors))
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        if (allocated(part%constant)) then
          call constant_multipliers(part%constant, vectors, own)
        else if (allocated(part%reduced)) then
          call reduced_multipliers(part%reduced, vectors, own, error)
        else if (allocated(part%factors)) then
          call factored_multipliers(part%factors, vectors, own, error)
        else
          call multipliers_of_monodromy(part%monodromy, vectors, own, error)
        end if
        if (allocated(error)) return
        if (vectors) then
          allocate(shapes(size(floquet%scale), size(part%states)), source=(0.0_dp, 0.0_dp))
          shapes(part%states, :) = own%vectors
          call move_alloc(shapes, own%vectors)
        end if
        call append(multipliers, own)
      end associate
    end do
    call arrange(multipliers)
  end subroutine multipliers_of_floquet

  !> The start of the periodic motion. Errors: `floquet` was not solved with forcing; resonance in one of the parts.
  subroutine periodic_of_floquet(floquet, solution, error)
    type(floquet_type), intent(in) :: floquet
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    type(periodic_solution_type) :: own
    integer :: k

    if (.not. (allocated(floquet%parts) .and. floquet%forced)) then
      call fatal_error(error, "the periodic motion needs a system that was solved with forcing", invalid_input)
      return
    end if
    allocate(solution%x0(size(floquet%scale)), solution%error(size(floquet%scale)), source=0.0_dp)
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        if (allocated(part%constant)) then
          call constant_periodic(part%constant, own, error)
        else if (allocated(part%reduced)) then
          call reduced_periodic(part%reduced, own, error)
        else if (allocated(part%factors)) then
          call factored_periodic(part%factors, own, error)
        else
          call periodic_of_monodromy(part%monodromy, own, error)
        end if
        if (allocated(error)) return
        solution%x0(part%states) = own%x0
        ! The squares within a norm vanish below sqrt(tiny): so small a motion is known to that only.
        solution%error(part%states) = own%error
        if (any(abs(own%x0) > 0)) solution%error(part%states) = max(own%error, sqrt(tiny(1.0_dp)) * scale_of(part))
        solution%condition = max(solution%condition, own%condition)
      end associate
    end do
  end subroutine periodic_of_floquet

  !> The periodic motion at `phases` (ascending, in [0, 1]), shape (n, points). Errors: the phases are not, or `solution` is not
  !> that of `floquet` and `system`; overflow.
  subroutine follow_floquet(system, floquet, solution, phases, x, error)
    class(periodic_system), intent(in) :: system
    type(floquet_type), intent(in) :: floquet
    type(periodic_solution_type), intent(in) :: solution
    real(dp), intent(in) :: phases(:)
    real(dp), allocatable, intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(periodic_solution_type) :: own
    real(dp), allocatable :: y(:, :)
    integer :: k

    call check_phases(phases, error)
    if (allocated(error)) return
    if (.not. (allocated(floquet%parts) .and. floquet%forced .and. allocated(solution%x0))) then
      call fatal_error(error, "a motion is followed from the start that solve_periodic found", invalid_input)
    else if (size(solution%x0) /= size(floquet%scale) .or. system%states /= size(floquet%scale)) then
      call fatal_error(error, "system, solution and start of the motion differ in their numbers of states", invalid_input)
    end if
    if (allocated(error)) return
    allocate(x(size(floquet%scale), size(phases)))
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        own%x0 = solution%x0(part%states)
        if (allocated(part%system)) then
          call follow_part(part%system, part, own, phases, y, error)
        else
          call follow_part(system, part, own, phases, y, error)
        end if
        if (allocated(error)) return
        x(part%states, :) = y
        deallocate(y)
      end associate
    end do
  end subroutine follow_floquet

  !> At how many phases the errors of a motion are to be looked at: the fastest error swings like the fastest free vibration that is
  !> integrated, and is seen at four of them in a swing.
  pure integer function checkpoints(floquet) result(number)
    type(floquet_type), intent(in) :: floquet
    integer, parameter :: fewest = 40
    real(dp) :: turns
    integer :: k

    turns = 0
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        if (allocated(part%monodromy)) turns = max(turns, part%monodromy%turns)
        if (allocated(part%factors)) turns = max(turns, part%factors%turns)
      end associate
    end do
    number = max(fewest, ceiling(2 / pi * min(turns, 1.0e6_dp)))
  end function checkpoints

  !> The errors of the motion `x` that `follow` found at `phases`, shape (n, phases), the first 0 and the last 1, or with them among
  !> more. Errors: overflow; resonance within the errors.
  subroutine take_errors(system, floquet, phases, x, errors, error)
    class(periodic_system), intent(in) :: system
    type(floquet_type), intent(in) :: floquet
    real(dp), intent(in) :: phases(:), x(:, :)
    type(turn_errors_type), intent(out) :: errors
    type(error_type), allocatable, intent(out) :: error
    type(turn_errors_type) :: own
    integer :: k

    allocate(errors%differences(size(x, 1), 2 * size(phases)))
    allocate(errors%rounding(size(x, 1)), source=0.0_dp)
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        if (allocated(part%system)) then
          call errors_of_part(part%system, part, phases, x(part%states, :), own, error)
        else
          call errors_of_part(system, part, phases, x(part%states, :), own, error)
        end if
        if (allocated(error)) return
        errors%differences(part%states, :) = own%differences
        errors%rounding(part%states) = own%rounding
        ! The squares within a norm vanish below sqrt(tiny): so small a motion is known to that only.
        if (any(abs(x(part%states, :)) > 0)) errors%rounding(part%states) = max(own%rounding, sqrt(tiny(1.0_dp)) * scale_of(part))
      end associate
    end do
    if (.not. all(ieee_is_finite(errors%bounds()))) call fatal_error(error, "the errors of the periodic vibration " &
      & // "cannot be told: they leave the range of the numbers", failed_computation)
  end subroutine take_errors

end module gestell_floquet_solution
