!> Finds the free vibration whose frequency is closest to an order of the crank. It belongs to the multiplier nearest to 1; its mode
!> supplies the frequency.
module gestell_study_vibration_resonance
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, text
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_model_frame, only: frame_type
  use gestell_study_mode_naming, only: modes_of_multipliers
  use gestell_study_mode, only: mode_type
  implicit none (type, external)
  private

  public :: describe_resonance, find_nearest, is_near, name_resonance

  !> A multiplier near 1, and the natural frequency of its mode.
  type, public :: resonance_type
    !> Index of the multiplier among all multipliers
    integer :: multiplier = 0
    !> Distance of the multiplier from 1, |1 - rho|
    real(dp) :: distance = 0
    !> `frequency`: natural frequency of the mode (rad/s), 0 if the mode does not oscillate. `ratio`: this frequency divided by 2 pi
    !> / T
    real(dp) :: frequency = 0, ratio = 0
    !> The harmonic of the period that is nearest to the frequency: `ratio`, rounded to an integer
    integer :: order = 0
    !> Number of turns that the drive makes in the period. `ratio` and `order` divided by this number are multiples of the drive
    !> speed
    integer :: turns = 1
  contains
    procedure :: is_free, near
  end type resonance_type

  !> A frequency is near an order k if its distance from k times the crank speed is less than both `near_order` times k and
  !> `near_spacing`. Unit of the distance: the crank speed.
  real(dp), parameter :: near_order = 0.05_dp, near_spacing = 0.125_dp

contains

  !> Finds the multiplier nearest to 1. The frequency of its mode is set later by `name_resonance`.
  pure type(resonance_type) function find_nearest(multipliers) result(resonance)
    type(multipliers_type), intent(in) :: multipliers

    resonance%multiplier = minloc(abs(1 - multipliers%rho), dim=1)
    resonance%distance = abs(1 - multipliers%rho(resonance%multiplier))
  end function find_nearest

  !> Sets the frequency of the resonance to that of the multiplier's mode. If this mode is unknown, uses a natural frequency of
  !> the frame linearised about rest: the one that best fits the argument of the multiplier. Fails if these natural frequencies
  !> cannot be computed.
  subroutine name_resonance(resonance, frame, multipliers, modes, error)
    !> The multiplier found by `find_nearest`. On return its frequency, ratio, order and turns are set
    type(resonance_type), intent(inout) :: resonance
    class(frame_type), intent(in) :: frame
    type(multipliers_type), intent(in) :: multipliers
    !> Modes of the frame about the vibration to which the multiplier belongs
    type(mode_type), intent(in) :: modes(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: frequencies(:), ratios(:)
    integer :: mode(size(multipliers%rho))

    associate (k => resonance%multiplier, speed => abs(frame%speed))
      mode = modes_of_multipliers(multipliers, modes, speed)
      if (mode(k) > 0) then
        resonance%frequency = modes(mode(k))%frequency()
      else
        call frame%natural_frequencies(frequencies, error)
        if (allocated(error)) return
        ratios = max(frequencies, 0.0_dp) / speed
        resonance%frequency = speed * ratios(minloc(abs(abs(ratios - anint(ratios)) - abs(multipliers%arg(k)) / (2 * pi)), dim=1))
      end if
      resonance%ratio = resonance%frequency / speed
    end associate
    resonance%order = nint(min(resonance%ratio, 1.0e9_dp))
    resonance%turns = frame%mechanism%turns
  end subroutine name_resonance

  !> True if the motion does not oscillate, or so slowly that the frame is practically free to move in some direction.
  pure logical function is_free(self)
    class(resonance_type), intent(in) :: self
    real(dp), parameter :: slowest = 1.0e-3_dp

    is_free = self%ratio < slowest
  end function is_free

  !> True if the frequency of the resonance is near an order of the crank.
  pure logical function near(self)
    class(resonance_type), intent(in) :: self

    near = is_near(self%ratio, self%order)
  end function near

  !> True if `ratio`, a frequency divided by a speed, is near the order `order`.
  elemental logical function is_near(ratio, order)
    real(dp), intent(in) :: ratio
    integer, intent(in) :: order

    is_near = order > 0 .and. abs(ratio - order) < min(near_order * order, near_spacing)
  end function is_near

  !> Describes the resonance in one sentence: frequency, order, and distance of the multiplier from 1.
  pure subroutine describe_resonance(resonance, sentence)
    type(resonance_type), intent(in) :: resonance
    character(len=:), allocatable, intent(out) :: sentence

    if (resonance%is_free()) then
      sentence = "a free motion does not oscillate: the frame is free in some direction, or its damping is overcritical"
    else
      sentence = "the natural frequency " // concise(resonance%frequency / (2 * pi), 6) // " Hz is " &
        & // concise(resonance%ratio / resonance%turns, 6) // " times the crank speed (order " &
        & // concise(real(resonance%order, dp) / resonance%turns, 10) // ")"
    end if
    sentence = sentence // "; multiplier " // text(resonance%multiplier) // " is " // concise(resonance%distance, 2) &
      & // " away from 1"
  end subroutine describe_resonance

end module gestell_study_vibration_resonance
