!> Solves a periodic system by Floquet's theory in the cheapest way ("Floquet numerics" in doc/theory.md). Parts that do not act on
!> each other are solved separately. A part whose vibrations are fast compared with the period is reduced; all other parts are
!> integrated.
module gestell_floquet_solution
  use gestell_base_error, only: error_type, failed_computation, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_balance_periodic_motion, only: motion_type
  use gestell_floquet_period_monodromy, only: accuracy_type, check_accuracy
  use gestell_floquet_period_period_map, only: check_phases
  use gestell_floquet_multipliers, only: append, arrange, multipliers_type, empty_multipliers, prove_undamped
  use gestell_floquet_multipliers, only: multipliers_of_monodromy => solve_multipliers
  use gestell_floquet_solution_part, only: solve_part
  use gestell_floquet_solution_part_solution, only: evidence_type, part_solution_type
  use gestell_floquet_period_periodic_solution, only: follow_monodromy => follow, periodic_solution_type
  use gestell_floquet_period_periodic_solution, only: periodic_of_monodromy => solve_periodic
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_system_subsystem, only: find_subsystems, extract_subsystem
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: balance_motion, checkpoints, evidence, evidence_type, follow, liouville_defect, solve_floquet, solve_multipliers, &
    & solve_periodic, bound_motion_errors

  !> Computes all multipliers of a monodromy matrix or of a Floquet solution.
  interface solve_multipliers
    procedure multipliers_of_monodromy, multipliers_of_floquet
  end interface solve_multipliers

  !> Computes the initial state of the periodic motion from a monodromy matrix or a Floquet solution.
  interface solve_periodic
    procedure periodic_of_monodromy, periodic_of_floquet
  end interface solve_periodic

  !> Computes the periodic motion at given phases of the period.
  interface follow
    procedure follow_monodromy, follow_floquet
  end interface follow

  !> A part of the system that does not interact with the other parts.
  type, public :: part_type
    !> Indices of the states that belong to this part
    integer, allocatable :: states(:)
    !> True if the multipliers of this part come in pairs rho, 1 / conj(rho).
    logical :: conserves = .false.
    !> The part as a system of its own; unallocated if it is the whole system
    class(periodic_system), allocatable :: system
    !> Floquet solution of the part
    class(part_solution_type), allocatable :: solution
  end type part_type

  !> Floquet solution of a periodic system with n states.
  type, public :: floquet_type
    !> Period T (s)
    real(dp) :: period = 0
    !> True if the solution contains the data for the periodic motion.
    logical :: forced = .false.
    !> Units that make the states comparable, shape (n).
    real(dp), allocatable :: scale(:)
    !> Parts of the system that do not interact
    type(part_type), allocatable :: parts(:)
  end type floquet_type

  !> Periodic motion of one part; unallocated if the part must be integrated.
  type :: part_motion_type
    type(motion_type), allocatable :: series
  end type part_motion_type

  !> Periodic motion of all parts of a system as Fourier series, where harmonic balance applies.
  type, public :: balanced_motion_type
    type(part_motion_type), allocatable :: parts(:)
  contains
    procedure :: everywhere
  end type balanced_motion_type

contains

  !> Solves `system` over its period to the requested accuracy.
  !>
  !> The method `auto`, if no steps are given, may use reduction; the method `reduced` always does. If the multipliers differ so
  !> much that Phi(T) loses the small ones, the factors of Phi(T) are used instead, unless steps are given. Fails if
  !> `solve_monodromy` fails, the table `coupled` has a wrong shape, or reduction is requested but does not apply.
  subroutine solve_floquet(system, accuracy, forced, floquet, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    !> If true, also compute the data for the periodic motion
    logical, intent(in) :: forced
    type(floquet_type), intent(out) :: floquet
    type(error_type), allocatable, intent(out) :: error
    integer, allocatable :: numbers(:), chosen(:)
    integer :: k, i

    call system%check(error)
    if (.not. allocated(error)) call check_accuracy(accuracy, error)
    if (.not. allocated(error)) call find_subsystems(system, numbers, error)
    if (allocated(error)) return
    floquet%period = system%period
    floquet%forced = forced
    allocate(floquet%scale(system%states))
    allocate(floquet%parts(maxval(numbers)))
    if (size(floquet%parts) == 1) then
      floquet%parts(1)%states = [(i, i = 1, system%states)]
      floquet%parts(1)%conserves = system%conserves([(i, i = 1, size(numbers))])
      call solve_part(system, accuracy, forced, floquet%parts(1)%solution, error)
      if (.not. allocated(error)) floquet%scale = floquet%parts(1)%solution%scale
      return
    end if
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        chosen = pack([(i, i = 1, size(numbers))], numbers == k)
        call extract_subsystem(system, chosen, part%system, part%states)
        part%conserves = system%conserves(chosen)
        call solve_part(part%system, accuracy, forced, part%solution, error)
        if (allocated(error)) return
        floquet%scale(part%states) = part%solution%scale
      end associate
    end do
  end subroutine solve_floquet

  !> Collects the methods, cost and error of a solution in `found`, which is empty if `floquet` has not been solved.
  subroutine evidence(floquet, found)
    type(floquet_type), intent(in) :: floquet
    type(evidence_type), intent(out) :: found
    integer :: k

    found%methods = ""
    if (.not. allocated(floquet%parts)) return
    found%parts = size(floquet%parts)
    do k = 1, size(floquet%parts)
      if (allocated(floquet%parts(k)%solution)) call found%add(floquet%parts(k)%solution%evidence)
    end do
  end subroutine evidence

  !> Computes the sum of ln |rho| minus the integral of tr P. By Liouville's theorem this difference is zero. For several parts, the
  !> difference with the largest modulus is returned. Fails if `floquet` has not been solved, the coefficients are not finite, or
  !> LAPACK finds no eigenvalues.
  subroutine liouville_defect(system, floquet, defect, error)
    class(periodic_system), intent(in) :: system
    type(floquet_type), intent(in) :: floquet
    real(dp), intent(out) :: defect
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: own
    integer :: k

    defect = 0
    if (.not. allocated(floquet%parts)) then
      call fatal_error(error, "call solve_floquet before liouville_defect", invalid_input)
      return
    end if
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        if (allocated(part%system)) then
          call part%solution%liouville_defect(part%system, own, error)
        else
          call part%solution%liouville_defect(system, own, error)
        end if
        if (allocated(error)) return
        if (abs(own) > abs(defect)) defect = own
      end associate
    end do
  end subroutine liouville_defect

  !> Computes all multipliers, and the eigenvectors if `vectors` is true. Fails if `floquet` has not been solved or LAPACK finds no
  !> eigenvalues.
  subroutine multipliers_of_floquet(floquet, vectors, multipliers, error)
    type(floquet_type), intent(in) :: floquet
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    type(multipliers_type) :: own
    complex(dp), allocatable :: shapes(:, :)
    integer :: k

    if (.not. allocated(floquet%parts)) then
      call fatal_error(error, "call solve_floquet before solve_multipliers", invalid_input)
      return
    end if
    if (size(floquet%parts) == 1) then
      call floquet%parts(1)%solution%multipliers(vectors, multipliers, error)
      if (floquet%parts(1)%conserves .and. .not. allocated(error)) call prove_undamped(multipliers)
      return
    end if
    multipliers = empty_multipliers(merge(size(floquet%scale), 0, vectors))
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        call part%solution%multipliers(vectors, own, error)
        if (allocated(error)) return
        if (part%conserves) call prove_undamped(own)
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

  !> Computes the initial state of the periodic motion. Fails if `floquet` was solved without forcing or one of the parts is at
  !> resonance.
  subroutine periodic_of_floquet(floquet, solution, error)
    type(floquet_type), intent(in) :: floquet
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    type(periodic_solution_type) :: own
    integer :: k

    if (.not. (allocated(floquet%parts) .and. floquet%forced)) then
      call fatal_error(error, "solve_periodic requires a system that solve_floquet has solved with forcing", invalid_input)
      return
    end if
    allocate(solution%x0(size(floquet%scale)), solution%error(size(floquet%scale)), source=0.0_dp)
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        call part%solution%start(own, error)
        if (allocated(error)) return
        ! Norms square their elements, and squares underflow below sqrt(tiny): smaller errors cannot be claimed.
        if (any(abs(own%x0) > 0)) own%error = max(own%error, sqrt(tiny(1.0_dp)) * part%solution%scale)
        solution%x0(part%states) = own%x0
        solution%error(part%states) = own%error
        solution%condition = max(solution%condition, own%condition)
      end associate
    end do
  end subroutine periodic_of_floquet

  !> Computes the periodic motion of each part by harmonic balance, if this is possible. The start of the motion in `solution` is
  !> then replaced by that of the series. As a check, both must agree within their error bounds; otherwise the series is discarded.
  subroutine balance_motion(system, floquet, solution, motion)
    class(periodic_system), intent(in) :: system
    type(floquet_type), intent(in) :: floquet
    type(periodic_solution_type), intent(inout) :: solution
    type(balanced_motion_type), intent(out) :: motion
    type(motion_type), allocatable :: series
    real(dp), allocatable :: x0(:, :)
    integer :: k

    allocate(motion%parts(size(floquet%parts)))
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        if (allocated(part%system)) then
          call part%solution%balance(part%system, series)
        else
          call part%solution%balance(system, series)
        end if
        if (.not. allocated(series)) cycle
        allocate(x0(size(part%states), 1))
        call series%states([0.0_dp], x0)
        if (all(abs(x0(:, 1) - solution%x0(part%states)) <= solution%error(part%states) + series%error)) then
          solution%x0(part%states) = x0(:, 1)
          solution%error(part%states) = series%error
          call move_alloc(series, motion%parts(k)%series)
        end if
        deallocate(x0)
      end associate
    end do
  end subroutine balance_motion

  !> True if the motion of every part is a Fourier series.
  pure logical function everywhere(self)
    class(balanced_motion_type), intent(in) :: self
    integer :: k

    everywhere = allocated(self%parts)
    if (everywhere) everywhere = all([(allocated(self%parts(k)%series), k = 1, size(self%parts))])
  end function everywhere

  !> True if the motion of part k is a Fourier series.
  pure logical function is_series(motion, k)
    type(balanced_motion_type), intent(in), optional :: motion
    integer, intent(in) :: k

    is_series = .false.
    if (present(motion)) is_series = allocated(motion%parts(k)%series)
  end function is_series

  !> Computes the periodic motion at `phases`. Fails if the phases are invalid, `solution` does not belong to `floquet` and
  !> `system`, or a number overflows.
  subroutine follow_floquet(system, floquet, solution, phases, x, error, motion)
    class(periodic_system), intent(in) :: system
    type(floquet_type), intent(in) :: floquet
    !> Initial state of the periodic motion
    type(periodic_solution_type), intent(in) :: solution
    !> Phases t / T, ascending, in [0, 1]
    real(dp), intent(in) :: phases(:)
    !> States at the phases, shape (n, phases)
    real(dp), allocatable, intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    !> Parts with a Fourier series are evaluated, the others are integrated
    type(balanced_motion_type), intent(in), optional :: motion
    real(dp), allocatable :: y(:, :)
    integer :: k

    call check_phases(phases, error)
    if (allocated(error)) return
    if (.not. (allocated(floquet%parts) .and. floquet%forced .and. allocated(solution%x0))) then
      call fatal_error(error, "call solve_periodic before follow: the start of the motion is missing", invalid_input)
    else if (size(solution%x0) /= size(floquet%scale) .or. system%states /= size(floquet%scale)) then
      call fatal_error(error, "system, solution and start of the motion must have the same number of states", invalid_input)
    end if
    if (allocated(error)) return
    allocate(x(size(floquet%scale), size(phases)))
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        allocate(y(size(part%states), size(phases)))
        if (is_series(motion, k)) then
          call motion%parts(k)%series%states(phases, y)
        else if (allocated(part%system)) then
          call part%solution%follow(part%system, solution%x0(part%states), phases, y, error)
        else
          call part%solution%follow(system, solution%x0, phases, y, error)
        end if
        if (allocated(error)) return
        x(part%states, :) = y
        deallocate(y)
      end associate
    end do
  end subroutine follow_floquet

  !> Number of phases at which the errors of a motion are evaluated. The fastest error oscillates as often as the fastest free
  !> vibration that is integrated; there are four phases per oscillation.
  pure integer function checkpoints(floquet) result(number)
    type(floquet_type), intent(in) :: floquet
    integer, parameter :: fewest = 40
    real(dp) :: phase_advance
    integer :: k

    phase_advance = maxval([0.0_dp, (floquet%parts(k)%solution%phase_advance, k = 1, size(floquet%parts))])
    number = max(fewest, ceiling(2 / pi * min(phase_advance, 1.0e6_dp)))
  end function checkpoints

  !> Computes the errors of a motion that `follow` has computed. Fails on overflow, or if the error bounds do not exclude a
  !> resonance. If all parts are Fourier series, there are no `differences`, only bounds.
  subroutine bound_motion_errors(system, floquet, phases, x, errors, error, motion)
    class(periodic_system), intent(in) :: system
    type(floquet_type), intent(in) :: floquet
    !> `phases`: phases t / T, which include 0 and 1. `x`: states at the phases, shape (n, phases).
    real(dp), intent(in) :: phases(:), x(:, :)
    type(turn_errors_type), intent(out) :: errors
    type(error_type), allocatable, intent(out) :: error
    !> The motion, where it is a Fourier series
    type(balanced_motion_type), intent(in), optional :: motion
    type(turn_errors_type) :: own
    integer :: k, compared

    compared = 2 * size(phases)
    if (present(motion)) compared = merge(0, compared, motion%everywhere())
    allocate(errors%differences(size(x, 1), compared), errors%rounding(size(x, 1)), source=0.0_dp)
    do k = 1, size(floquet%parts)
      associate (part => floquet%parts(k))
        if (is_series(motion, k)) then
          errors%rounding(part%states) = motion%parts(k)%series%error
        else
          if (allocated(part%system)) then
            call part%solution%errors(part%system, phases, x(part%states, :), own, error)
          else
            call part%solution%errors(system, phases, x(part%states, :), own, error)
          end if
          if (allocated(error)) return
          errors%differences(part%states, :) = own%differences
          errors%rounding(part%states) = own%rounding
        end if
        ! Norms square their elements, and squares underflow below sqrt(tiny): smaller errors cannot be claimed.
        if (any(abs(x(part%states, :)) > 0)) errors%rounding(part%states) = max(errors%rounding(part%states), &
          & sqrt(tiny(1.0_dp)) * part%solution%scale)
      end associate
    end do
    if (.not. all(ieee_is_finite(errors%bounds()))) call fatal_error(error, "the error bounds of the periodic " &
      & // "vibration overflow double precision", failed_computation)
  end subroutine bound_motion_errors

end module gestell_floquet_solution
