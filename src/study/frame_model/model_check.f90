!> Checks whether the stability of the vibration is the same in the exact model as in the cheaper model that was used.
module gestell_study_frame_model_model_check
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: operator(/=), operator(==), undecided
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_model_frame, only: frame_type
  use gestell_study_frame_model, only: settle
  implicit none (type, external)
  private

  public :: check_model

  !> The result of a cheaper model counts as correct if ln rho_max differs by at most this fraction from the better value
  !> (rho_max: largest modulus of a multiplier).
  real(dp), parameter :: negligible = 0.01_dp

contains

  !> Compares `multipliers` of a cheaper model with the multipliers about the exact vibration. If these are unknown or leave the
  !> verdict undecided, the comparison uses the multipliers about the vibration of the equations linearised about rest. `better`
  !> is allocated if the verdicts differ, or if the values of ln rho_max differ by more than one per cent plus both errors.
  subroutine check_model(frame, accuracy, multipliers, better)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(multipliers_type), intent(in) :: multipliers
    type(multipliers_type), allocatable, intent(out) :: better
    class(frame_type), allocatable :: varied
    type(floquet_type) :: floquet
    type(multipliers_type) :: exact_multipliers
    type(error_type), allocatable :: error
    character(len=*), parameter :: models(2) = [character(len=11) :: "exact", "first_order"]
    integer :: i

    if (multipliers%unknown() .or. multipliers%error(1) >= 1) return
    do i = 1, size(models)
      call settle(frame, trim(models(i)), accuracy, varied, error)
      if (.not. allocated(error)) call solve_floquet(varied, accuracy, .false., floquet, error)
      if (.not. allocated(error)) call solve_multipliers(floquet, .false., exact_multipliers, error)
      if (allocated(error)) cycle
      if (exact_multipliers%unknown() .or. exact_multipliers%error(1) >= 1 .or. exact_multipliers%judge() == undecided) cycle
      if (exact_multipliers%judge() /= multipliers%judge() .or. abs(exact_multipliers%log_abs(1) - multipliers%log_abs(1)) &
        & > negligible * abs(multipliers%log_abs(1)) + exact_multipliers%error(1) + multipliers%error(1)) better = exact_multipliers
      return
    end do
  end subroutine check_model

end module gestell_study_frame_model_model_check
