!> Solves one machine of a family: builds the member, and computes its Floquet solution and its multipliers.
module gestell_study_member
  use gestell_base_error, only: error_type, failed_computation, impossible_mechanism
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: failed, impossible, not_judged, operator(==), verdict_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_system_family, only: family_type, create_member
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  !> A machine of a family with its results. If a computation failed, it also holds the reason.
  type, public :: member_type
    !> State of the member: `not_judged` until a computation fails, then `impossible` or `failed`
    type(verdict_type) :: state = failed
    !> The error that led to the state `impossible` or `failed`
    type(error_type), allocatable :: reason
    class(periodic_system), allocatable :: system
    type(floquet_type) :: floquet
  contains
    procedure :: is_sound, make, solve, multipliers => multipliers_of_member, classify_failure
  end type member_type

contains

  !> True as long as no computation for this member has failed.
  pure logical function is_sound(self)
    class(member_type), intent(in) :: self

    is_sound = self%state == not_judged
  end function is_sound

  !> Builds the member of `family` with these parameters. Fails if the parameters are invalid. Other failures are recorded in
  !> `state`.
  subroutine make(self, family, parameters, error)
    class(member_type), intent(inout) :: self
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    type(error_type), allocatable, intent(out) :: error

    self%state = not_judged
    call create_member(family, parameters, self%system, error)
    call self%classify_failure(error)
  end subroutine make

  !> Computes the Floquet solution and, if `forced` is true, the periodic solution. Does nothing if an earlier computation failed.
  !> Fails if the input is invalid. Other failures are recorded in `state`.
  subroutine solve(self, accuracy, forced, error)
    class(member_type), intent(inout) :: self
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(in) :: forced
    type(error_type), allocatable, intent(out) :: error

    if (.not. self%is_sound()) return
    call solve_floquet(self%system, accuracy, forced, self%floquet, error)
    call self%classify_failure(error)
  end subroutine solve

  !> Computes the multipliers from the Floquet solution and, if `vectors` is true, the eigenvectors. Does nothing if an earlier
  !> computation failed. Fails if the input is invalid. Other failures are recorded in `state`.
  subroutine multipliers_of_member(self, vectors, multipliers, error)
    class(member_type), intent(inout) :: self
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error

    if (.not. self%is_sound()) return
    call solve_multipliers(self%floquet, vectors, multipliers, error)
    call self%classify_failure(error)
  end subroutine multipliers_of_member

  !> Records the failure `error` in the member's state. Only failures that are the caller's fault (invalid input) stay in `error`.
  subroutine classify_failure(self, error)
    class(member_type), intent(inout) :: self
    type(error_type), allocatable, intent(inout) :: error

    if (.not. allocated(error)) return
    self%state = merge(impossible, failed, error%code == impossible_mechanism)
    if (any(error%code == [impossible_mechanism, failed_computation])) call move_alloc(error, self%reason)
  end subroutine classify_failure

end module gestell_study_member
