!> Checks the data of a frame: its numbers, its free degrees of freedom and its mechanism.
module gestell_model_frame_data
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise
  use gestell_model_mechanism, only: mechanism_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: check_frame_data, check_free, check_turning

  !> Smallest accepted angle scale (rad). A mechanism whose motion changes noticeably within a smaller crank angle is refused.
  real(dp), parameter :: min_angle_scale = 1.0e-4_dp

contains

  !> Checks the numbers that describe a frame. Fails if a number is not finite, mass or inertia is negative, or the speed is zero.
  subroutine check_frame_data(mass, inertia, origin, stiffness, damping, speed, error)
    !> Units as in `new_frame`
    real(dp), intent(in) :: mass, inertia, origin(2), stiffness(3, 3), damping(3, 3), speed
    type(error_type), allocatable, intent(out) :: error

    if (.not. all(ieee_is_finite([mass, inertia, origin, reshape(stiffness, [9]), reshape(damping, [9]), speed]))) then
      call fatal_error(error, "the frame's data must be finite", invalid_input)
    else if (mass < 0 .or. inertia < 0) then
      call fatal_error(error, "the frame's mass and inertia must not be negative", invalid_input)
    else if (abs(speed) < tiny(speed)) then
      call fatal_error(error, "the crank speed must not be zero", invalid_input)
    end if
  end subroutine check_frame_data

  !> Checks the indices of the free degrees of freedom. Fails if the list is empty, an index is outside 1 to `dofs` (3 or 6), or an
  !> index occurs twice.
  subroutine check_free(free, dofs, error)
    integer, intent(in) :: free(:), dofs
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    if (size(free) > 0 .and. all(free >= 1) .and. all(free <= dofs) .and. .not. any([(count(free == i) > 1, i = 1, dofs)])) return
    if (dofs == 3) call fatal_error(error, "the free degrees of freedom must be one or more of xi, eta, psi, each given only " // &
      &   "once", invalid_input)
    if (dofs > 3) call fatal_error(error, "the free degrees of freedom must be one or more numbers from 1 to 6, each given " // &
      &   "only once", invalid_input)
  end subroutine check_free

  !> Checks a mechanism after its `prepare` has been called. Fails if its mass or inertia is negative or not finite, or if it comes
  !> too close to a dead point.
  subroutine check_turning(mechanism, error)
    class(mechanism_type), intent(in) :: mechanism
    type(error_type), allocatable, intent(out) :: error

    if (.not. (ieee_is_finite(mechanism%mass) .and. ieee_is_finite(mechanism%inertia) .and. mechanism%mass >= 0 &
      & .and. mechanism%inertia >= 0)) then
      call fatal_error(error, "the mechanism's mass and inertia must be finite and not negative", invalid_input)
    else if (.not. mechanism%angle_scale >= min_angle_scale) then
      call fatal_error(error, "the mechanism comes so close to a dead point that its motion changes noticeably within " &
        & // concise(mechanism%angle_scale * mechanism%turns * 180 / pi, 2) // " deg of the crank angle: results would " &
        & // "be unreliable", impossible_mechanism)
    end if
  end subroutine check_turning

end module gestell_model_frame_data
