!> What Floquet's theory tells of a system, or of a part of one that does not act on the others: its multipliers, its periodic
!> motion and how far both can be trusted. How that is found is for those that extend this type.
module gestell_floquet_solution_part_solution
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  !> What a solution rests on, of one part or over all of them.
  type, public :: evidence_type
    !> Methods that integrated, separated by commas; 'averaged': closed form. Empty where all was reduced.
    character(len=:), allocatable :: methods
    !> Parts that do not act on each other; steps of the integrations over the period; factors of Phi(T) that were kept in
    !> place of their product; angles of the reductions; evaluations of the coefficients in all.
    integer :: parts = 0, steps = 0, factors = 0, angles = 0, evaluations = 0
    !> Greatest relative error of a part's map.
    real(dp) :: error = 0
  contains
    procedure :: add
  end type evidence_type

  type, abstract, public :: part_solution_type
    !> Units that make the states comparable, shape (n).
    real(dp), allocatable :: scale(:)
    !> Radians by which the fastest motion that is integrated turns within the period.
    real(dp) :: phase_advance = 0
    type(evidence_type) :: evidence
  contains
    procedure(take_multipliers), deferred :: multipliers
    procedure(take_start), deferred :: start
    procedure(take_motion), deferred :: follow
    procedure(take_errors), deferred :: errors
    procedure(take_liouville_defect), deferred :: liouville_defect
  end type part_solution_type

  abstract interface
    !> All multipliers; with `vectors` the eigenvectors too. Error: LAPACK found no eigenvalues.
    subroutine take_multipliers(self, vectors, multipliers, error)
      import :: error_type, multipliers_type, part_solution_type
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      logical, intent(in) :: vectors
      type(multipliers_type), intent(out) :: multipliers
      type(error_type), allocatable, intent(out) :: error
    end subroutine take_multipliers

    !> x(0) of the periodic motion, of a system that was solved with forcing. Error: resonance within the errors.
    subroutine take_start(self, solution, error)
      import :: error_type, part_solution_type, periodic_solution_type
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      type(periodic_solution_type), intent(out) :: solution
      type(error_type), allocatable, intent(out) :: error
    end subroutine take_start

    !> The periodic motion that starts with `x0`, shape (n), at `phases` (ascending, in [0, 1]); x has the shape (n, phases).
    !> Errors: overflow.
    subroutine take_motion(self, system, x0, phases, x, error)
      import :: dp, error_type, part_solution_type, periodic_system
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      class(periodic_system), intent(in) :: system
      real(dp), intent(in) :: x0(:), phases(:)
      real(dp), intent(out) :: x(:, :)
      type(error_type), allocatable, intent(out) :: error
    end subroutine take_motion

    !> The errors of the motion `x` that `follow` found at `phases`, shape (n, phases), the first 0 and the last 1.
    !> `disturbance`: what is unknown of the load, integrated over the period. Errors: overflow; resonance within the errors.
    subroutine take_errors(self, system, phases, x, errors, error, disturbance)
      import :: dp, error_type, part_solution_type, periodic_system, turn_errors_type
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      class(periodic_system), intent(in) :: system
      real(dp), intent(in) :: phases(:), x(:, :)
      type(turn_errors_type), intent(out) :: errors
      type(error_type), allocatable, intent(out) :: error
      real(dp), intent(in), optional :: disturbance
    end subroutine take_errors

    !> The sum of ln |rho| less the integral of tr P, zero by Liouville's theorem. Errors: the coefficients are not finite; LAPACK
    !> found no eigenvalues.
    subroutine take_liouville_defect(self, system, defect, error)
      import :: dp, error_type, part_solution_type, periodic_system
      implicit none (type, external)
      class(part_solution_type), intent(in) :: self
      class(periodic_system), intent(in) :: system
      real(dp), intent(out) :: defect
      type(error_type), allocatable, intent(out) :: error
    end subroutine take_liouville_defect
  end interface

contains

  !> Adds that of another part: its method, if there is one that is not named already, what it cost, and its error, if that is the
  !> greatest.
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
