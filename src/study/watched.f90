!> What a vibration meter at a point of the frame would show, against the limit that is set there.
module gestell_study_watched
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: point_quantity, probe_type, quantity_type
  use gestell_study_statistics, only: band_rms, history_of, statistics_type, take_statistics
  use gestell_study_vibration, only: vibration_type
  implicit none (type, external)
  private

  public :: watch

  !> Displacement, velocity, acceleration: along x, along y, and the size of the vector.
  integer, parameter, public :: probe_parts = 9, velocity_part = 6
  character(len=*), parameter, public :: probe_part_names(probe_parts) = &
    & [character(len=2) :: "x", "y", "d", "vx", "vy", "v", "ax", "ay", "a"]

  type, public :: watched_type
    type(probe_type) :: probe
    type(statistics_type), allocatable :: statistics(:)
    !> At the times of the vibration's history, shape (points + 1, probe_parts).
    real(dp), allocatable :: history(:, :)
    !> Velocity in the probe's band of frequencies (m/s, root of the mean square): along x and y, in the direction in which
    !> it is greatest, and an estimate of the latter's error.
    real(dp) :: band(2) = 0, greatest = 0, error = 0
  contains
    procedure :: verdict
  end type watched_type

contains

  !> All probes. `vibration` must hold the accelerations.
  subroutine watch(frame, vibration, probes, watched)
    type(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(probe_type), intent(in) :: probes(:)
    type(watched_type), allocatable, intent(out) :: watched(:)
    type(quantity_type) :: quantity
    real(dp), allocatable :: history(:)
    integer :: i, k

    allocate(watched(size(probes)))
    do i = 1, size(probes)
      watched(i)%probe = probes(i)
      allocate(watched(i)%statistics(probe_parts))
      allocate(watched(i)%history(size(vibration%motion_history, 2), probe_parts))
      do k = 1, probe_parts
        call point_quantity(probes(i), trim(probe_part_names(k)), quantity)
        call take_statistics(vibration, quantity, watched(i)%statistics(k))
        call history_of(vibration, quantity, history)
        watched(i)%history(:, k) = history
      end do
      associate (velocity => watched(i)%statistics(velocity_part))
        call band_rms(velocity, frame%period, probes(i)%band, watched(i)%band, watched(i)%greatest)
        ! A part of an error, in the mean square, is at most its greatest value.
        watched(i)%error = velocity%peak_error
      end associate
    end do
  end subroutine watch

  !> "within" or "above" the limit, "undecided" where the error reaches across it; empty without a limit.
  pure character(len=9) function verdict(self)
    class(watched_type), intent(in) :: self

    if (.not. self%probe%limit > 0) then
      verdict = ""
    else if (self%greatest + self%error <= self%probe%limit) then
      verdict = "within"
    else if (self%greatest - self%error > self%probe%limit) then
      verdict = "above"
    else
      verdict = "undecided"
    end if
  end function verdict

end module gestell_study_watched
