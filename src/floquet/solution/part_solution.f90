!> Declares the base type of solutions by Floquet's theory. A solution of a system, or of a part that does not interact with the
!> rest, gives multipliers, periodic motion and their error bounds. Extensions of `part_solution_type` implement the methods of
!> solution.
module gestell_floquet_solution_part_solution
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_balance_periodic_motion, only: motion_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  !> Methods, cost and error of a solution, for one part or for all parts together.
  type, public :: evidence_type
    !> Names of the integration methods, separated by commas; 'averaged' for a solution in closed form. Empty if reduction solves
    !> all parts.
    character(len=:), allocatable :: methods
    !> `parts`: number of parts that do not interact. `steps`: number of steps of the integrations over the period. `factors`:
    !> number of factors of Phi(T), if used. `angles`: number of phases of the reductions. `evaluations`: number of evaluations of
    !> the coefficients.
    integer :: parts = 0, steps = 0, factors = 0, angles = 0, evaluations = 0
    !> Relative error of the map over the period; the maximum over all parts.
    real(dp) :: error = 0
  contains
    procedure :: add
  end type evidence_type

  !> Base type of solutions. A solution belongs to one part of a system; this part has n states.
  type, abstract, public :: part_solution_type
    !> Units that make the states comparable, shape (n).
    real(dp), allocatable :: scale(:)
    !> Phase advance of the fastest integrated motion within the period (rad)
    real(dp) :: phase_advance = 0
    !> Methods, cost and error of this solution
    type(evidence_type) :: evidence
  contains
    procedure(part_multipliers), deferred :: multipliers
    procedure(part_start), deferred :: start
    procedure(part_motion), deferred :: follow
    procedure(part_errors), deferred :: errors
    procedure(part_liouville_defect), deferred :: liouville_defect
    procedure :: balance => no_motion
  end type part_solution_type

  abstract interface
    !> Computes all multipliers, and the eigenvectors if `vectors` is true. Fails if LAPACK finds no eigenvalues.
    subroutine part_multipliers(self, vectors, multipliers, error)
      import :: error_type, multipliers_type, part_solution_type
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      logical, intent(in) :: vectors
      type(multipliers_type), intent(out) :: multipliers
      type(error_type), allocatable, intent(out) :: error
    end subroutine part_multipliers

    !> Computes the state x(0) of the periodic motion; the system must have been solved with forcing. Fails if a multiplier equals 1
    !> within its error (resonance).
    subroutine part_start(self, solution, error)
      import :: error_type, part_solution_type, periodic_solution_type
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      type(periodic_solution_type), intent(out) :: solution
      type(error_type), allocatable, intent(out) :: error
    end subroutine part_start

    !> Computes the periodic motion `x`, shape (n, phases), that starts from `x0`, shape (n), at `phases` (ascending, in [0, 1]).
    !> Fails on overflow.
    subroutine part_motion(self, system, x0, phases, x, error)
      import :: dp, error_type, part_solution_type, periodic_system
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      class(periodic_system), intent(in) :: system
      real(dp), intent(in) :: x0(:), phases(:)
      real(dp), intent(out) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
    end subroutine part_motion

    !> Computes the errors of the motion `x`, shape (n, phases), that `follow` has computed at `phases`. The first phase is 0, the
    !> last 1. `disturbance` bounds the integral of the error of the load over the period. Fails on overflow, or if the error bounds
    !> do not exclude a resonance.
    subroutine part_errors(self, system, phases, x, errors, error, disturbance)
      import :: dp, error_type, part_solution_type, periodic_system, turn_errors_type
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      class(periodic_system), intent(in) :: system
      real(dp), intent(in) :: phases(:), x(:, :)
      type(turn_errors_type), intent(out) :: errors
      type(error_type), allocatable, intent(out) :: error
      real(dp), intent(in), optional :: disturbance
    end subroutine part_errors

    !> Computes the sum of ln |rho| minus the integral of tr P. By Liouville's theorem this difference is zero. Fails if the
    !> coefficients are not finite or LAPACK finds no eigenvalues.
    subroutine part_liouville_defect(self, system, defect, error)
      import :: dp, error_type, part_solution_type, periodic_system
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      class(periodic_system), intent(in) :: system
      real(dp), intent(out) :: defect
      type(error_type), allocatable, intent(out) :: error
    end subroutine part_liouville_defect
  end interface

contains

  !> Computes the periodic motion as a Fourier series with an error bound; the system must have been solved with forcing. `motion`
  !> stays unallocated if this is not possible. It is not possible unless an extension overrides this procedure.
  subroutine no_motion(self, system, motion)
    class(part_solution_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    type(motion_type), allocatable, intent(out) :: motion

    associate (unused_solution => self, unused_system => system)
    end associate
  end subroutine no_motion

  !> Combines this record with the record of another part: adds the numbers of steps, factors, phases and evaluations, appends
  !> the method if it is new, and keeps the larger error.
  pure subroutine add(self, part)
    class(evidence_type), intent(inout) :: self
    type(evidence_type), intent(in) :: part

    self%steps = self%steps + part%steps
    self%factors = self%factors + part%factors
    self%angles = self%angles + part%angles
    self%evaluations = self%evaluations + part%evaluations
    self%error = max(self%error, part%error)
    if (.not. allocated(part%methods)) return
    if (len(self%methods) == 0) then
      self%methods = part%methods
    else if (index(", " // self%methods // ",", ", " // part%methods // ",") == 0) then
      self%methods = self%methods // ", " // part%methods
    end if
  end subroutine add

end module gestell_floquet_solution_part_solution
