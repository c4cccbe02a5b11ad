!> Joints that the drive moves directly: crank pins and cylinders.
module gestell_model_joints_driven
  use gestell_base_key, only: key_type, nonzero, of_angle, real_key
  use gestell_base_kinds, only: dp, pi
  use gestell_math_rational, only: greatest_divisor, to_rational
  use gestell_model_joints_data, only: joint_data_type
  use gestell_model_joints_joint, only: joint_type
  use gestell_model_joints_placement, only: placement_type
  implicit none (type, external)
  private

  type(key_type), parameter, public :: driven_keys(*) = [ &
    & key_type("joint", "phase", real_key, "angle of this crank when the drive's angle is 0", unit=of_angle, default=0.0_dp), &
    & key_type("joint", "ratio", real_key, "turns of this crank per turn of the drive, negative if it turns in the opposite " // &
    &   "direction; a decimal such as 0.5, or numerator and denominator such as 17,23", 1, 1, 2, default=1.0_dp, range=nonzero)]

  character(len=*), parameter, public :: no_ratio = "must be a fraction: either a decimal such as 0.5 that equals a " // &
    & "fraction with a denominator up to 64, or numerator and denominator, whole numbers up to 4096"

  !> A joint whose motion depends on the angle phi `ratio`/`denominator` + `phase` (rad) of a real or imaginary crank, where phi is
  !> the linkage's crank angle. After the procedure `gear` (gestell_model_linkage_gearing) the denominator is 1.
  type, abstract, extends(joint_type), public :: driven_joint
    integer :: ratio = 1, denominator = 1
    real(dp) :: phase = 0
  contains
    procedure :: define_drive, move_drive
  end type driven_joint

contains

  !> Sets ratio and phase. If the ratio is not a permitted fraction, stores the reason in `data`.
  pure subroutine define_drive(self, data)
    class(driven_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data
    logical :: known

    self%phase = data%number("phase")
    call to_rational(data%numbers("ratio"), self%ratio, self%denominator, known)
    if (.not. known) then
      data%key = "ratio"
      data%reason = no_ratio
    end if
    if (abs(self%phase) > 2 * pi) self%phase = modulo(self%phase, 2 * pi)
  end subroutine define_drive

  !> Applies the phase and the gear ratio of the mechanism.
  pure subroutine move_drive(self, placement)
    class(driven_joint), intent(inout) :: self
    type(placement_type), intent(in) :: placement
    integer :: shared

    self%phase = self%phase + self%ratio * placement%phase / self%denominator
    self%ratio = self%ratio * placement%ratio
    self%denominator = self%denominator * placement%denominator
    shared = greatest_divisor(self%ratio, self%denominator)
    self%ratio = self%ratio / shared
    self%denominator = self%denominator / shared
  end subroutine move_drive

end module gestell_model_joints_driven
