!> Which free vibration stands in the way of the periodic one: the multiplier nearest to 1, as a mode against an order of
!> the crank.
module gestell_study_vibration_resonance
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_model_frame, only: frame_type
  implicit none (type, external)
  private

  public :: describe_resonance, find_resonance

  type, public :: resonance_type
    !> Index of the multiplier, and |1 - rho|.
    integer :: multiplier = 0
    real(dp) :: distance = 0
    !> Natural frequency of the averaged frame (rad/s) that fits its argument best, that over the crank speed, and the
    !> nearest order of the crank; frequency 0: nothing holds the frame in some direction.
    real(dp) :: frequency = 0, ratio = 0
    integer :: order = 0
    !> Turns of the drive in the period: ratio and order are of the drive's speed times that.
    integer :: turns = 1
  contains
    procedure :: loose
  end type resonance_type

contains

  !> Error: the averaged mass matrix is not positive definite.
  subroutine find_resonance(frame, multipliers, resonance, error)
    class(frame_type), intent(in) :: frame
    type(multipliers_type), intent(in) :: multipliers
    type(resonance_type), intent(out) :: resonance
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: frequencies(:), ratios(:)
    integer :: mode

    resonance%multiplier = minloc(abs(1 - multipliers%rho), dim=1)
    resonance%distance = abs(1 - multipliers%rho(resonance%multiplier))
    call frame%natural_frequencies(frequencies, error)
    if (allocated(error)) return
    allocate(ratios, source=max(frequencies, 0.0_dp) / abs(frame%speed))
    mode = minloc(abs(abs(ratios - anint(ratios)) - abs(multipliers%arg(resonance%multiplier)) / (2 * pi)), dim=1)
    resonance%turns = frame%mechanism%turns
    resonance%frequency = max(frequencies(mode), 0.0_dp)
    resonance%ratio = ratios(mode)
    resonance%order = nint(min(ratios(mode), 1.0e9_dp))
  end subroutine find_resonance

  !> Whether nothing, or next to nothing, holds the frame in some direction: no vibration swings so slowly that is meant.
  pure logical function loose(self)
    class(resonance_type), intent(in) :: self
    real(dp), parameter :: slowest = 1.0e-3_dp

    loose = self%ratio < slowest
  end function loose

  !> In one sentence.
  pure subroutine describe_resonance(resonance, sentence)
    type(resonance_type), intent(in) :: resonance
    character(len=:), allocatable, intent(out) :: sentence

    sentence = "multiplier " // text(resonance%multiplier) // " lies " // concise(resonance%distance, 2) // " from 1: "
    if (resonance%loose()) then
      sentence = sentence // "nothing, or next to nothing, holds the frame in some direction"
    else
      sentence = sentence // "the free vibration of " // concise(resonance%frequency / (2 * pi), 6) // " Hz swings " &
        & // concise(resonance%ratio / resonance%turns, 7) // " times in a turn of the crank: order " &
        & // concise(real(resonance%order, dp) / resonance%turns, 10)
    end if
  end subroutine describe_resonance

end module gestell_study_vibration_resonance
