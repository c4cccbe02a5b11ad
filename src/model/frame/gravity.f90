!> Gravity as a frame feels it, in the plane or in space.
module gestell_model_frame_gravity
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_weights, only: gravity_subject
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: gravity_of, sag_of, weigh_frame, weighs, weight_of

contains

  !> Gives all masses of a frame weight, as they are, and what carries them their static forces; `gravity` (m/s^2) along xi, eta,
  !> zeta, which must be 0 in the plane. Errors: no spring carries the weights along some degree of freedom; they overflow.
  subroutine weigh_frame(frame, gravity, error)
    class(frame_type), intent(inout) :: frame
    real(dp), intent(in) :: gravity(3)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(6) = [character(len=30) :: "weight along xi", "weight along eta", &
      & "weights' moment about zeta", "weight along zeta", "weights' moment about xi", "weights' moment about eta"]
    integer :: left

    if (.not. allocated(frame%space)) then
      call frame%weigh(gravity(:2), error)
      return
    end if
    call frame%space%weigh(gravity, frame%mass, frame%free, left)
    if (left > 0) then
      call fatal_error(error, "nothing carries the " // trim(names(left)) // ": give the frame a spring there, or a guide", &
        & impossible_mechanism, gravity_subject)
    else if (.not. all(ieee_is_finite([frame%space%weights%load, frame%space%weights%sag])) &
      & .or. .not. all(ieee_is_finite(frame%space%weights%stiffness))) then
      call fatal_error(error, "the weights overflow", invalid_input, gravity_subject)
    end if
  end subroutine weigh_frame

  pure logical function weighs(frame)
    class(frame_type), intent(in) :: frame

    weighs = frame%weights%act
    if (allocated(frame%space)) weighs = frame%space%weights%act
  end function weighs

  !> Gravity (m/s^2) along xi, eta, zeta.
  pure function gravity_of(frame) result(g)
    class(frame_type), intent(in) :: frame
    real(dp) :: g(3)

    g = [real(frame%weights%gravity, dp), aimag(frame%weights%gravity), 0.0_dp]
    if (allocated(frame%space)) g = frame%space%weights%gravity
  end function gravity_of

  !> The weight of all masses (N) along xi, eta, zeta.
  pure function weight_of(frame) result(weight)
    class(frame_type), intent(in) :: frame
    real(dp) :: weight(3)

    weight = [frame%weights%load(:2), 0.0_dp]
    if (allocated(frame%space)) weight = frame%space%weights%load(:3)
  end function weight_of

  !> How far the weights move F (m) along xi, eta, zeta.
  pure function sag_of(frame) result(sag)
    class(frame_type), intent(in) :: frame
    real(dp) :: sag(3)

    sag = [frame%weights%sag(:2), 0.0_dp]
    if (allocated(frame%space)) sag = frame%space%weights%sag(:3)
  end function sag_of

end module gestell_model_frame_gravity
