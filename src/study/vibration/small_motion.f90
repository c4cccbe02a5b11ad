!> Judges whether the motion of the frame is small enough for linear equations.
module gestell_study_vibration_small_motion
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: dof_names, frame_type
  use gestell_model_mounting, only: is_rotation
  implicit none (type, external)
  private

  public :: moved

  !> Largest rotation (rad) that counts as small: for larger angles the cosine differs from 1 by more than half a per cent.
  real(dp), parameter, public :: small_turn = 0.1_dp
  !> Largest displacement of the frame's centre of mass that counts as small, relative to the machine's size. Larger displacements
  !> noticeably move the points at which springs act.
  real(dp), parameter, public :: small_part = 0.1_dp
  !> A motion that exceeds the limits by this factor is too large even for the exact frame, because the model keeps springs and
  !> dampers linear.
  real(dp), parameter :: great = 5

  !> Extent of the frame's motion, and size of the machine with which the displacement is compared.
  type, public :: moved_type
    !> `displacement`: maximum of |xi|, |eta| and |zeta| (m). `turn`: maximum of the rotations (rad). `size`: largest distance of
    !> a support or of the mechanism's origin O from the frame's centre of mass F (m), 0 if there is none
    real(dp) :: displacement = 0, turn = 0, size = 0
    !> The coordinate that has the largest rotation
    character(len=7) :: rotation = "psi"
  contains
    procedure :: small, is_rotation_large, is_displacement_large, is_large
  end type moved_type

contains

  !> Determines the largest displacement and rotation of a motion. `peaks`: maxima of the degrees of freedom (m, rad), in the
  !> frame's order.
  pure type(moved_type) function moved(frame, peaks)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: peaks(:)
    logical :: turns(size(peaks))
    integer :: i

    turns = is_rotation([(i, i = 1, size(peaks))])
    moved%displacement = maxval(peaks, mask=.not. turns)
    moved%turn = maxval(peaks, mask=turns)
    moved%rotation = dof_names(maxloc(peaks, dim=1, mask=turns))
    moved%size = frame%mechanism_distance
    do i = 1, size(frame%supports)
      moved%size = max(moved%size, norm2(frame%supports(i)%position))
    end do
  end function moved

  !> True if both the rotation and the displacement are small.
  elemental logical function small(self)
    class(moved_type), intent(in) :: self

    small = .not. (self%is_rotation_large() .or. self%is_displacement_large())
  end function small

  !> True if the rotation exceeds `small_turn`.
  elemental logical function is_rotation_large(self)
    class(moved_type), intent(in) :: self

    is_rotation_large = self%turn > small_turn
  end function is_rotation_large

  !> True if the displacement exceeds `small_part` of the machine's size.
  elemental logical function is_displacement_large(self)
    class(moved_type), intent(in) :: self

    is_displacement_large = self%size > 0 .and. self%displacement > small_part * self%size
  end function is_displacement_large

  !> True if the motion is too large even for the exact frame, whose springs and dampers are linear.
  elemental logical function is_large(self)
    class(moved_type), intent(in) :: self

    is_large = .not. small(moved_type(self%displacement / great, self%turn / great, self%size, self%rotation))
  end function is_large

end module gestell_study_vibration_small_motion
