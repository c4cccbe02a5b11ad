!> What was asked about the vibration: forces on the ground, probes, the drive.
module gestell_task_findings
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_quantity, only: accelerations, probe_type
  use gestell_task_power_drive, only: drive_type, find_drive
  use gestell_task_forces_ground, only: find_places, place_type
  use gestell_study_vibration, only: vibration_type
  use gestell_task_response_probes, only: watch, watched_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: find

  !> What was not asked for stays unallocated.
  type, public :: findings_type
    !> Crank speed (rad/s) and period (s).
    real(dp) :: speed = 1, period = 1
    type(place_type), allocatable :: places(:)
    type(watched_type), allocatable :: watched(:)
    type(drive_type), allocatable :: drive
  end type findings_type

contains

  !> Evaluates a vibration that holds the rows of the motion that are needed. `forces`, `power`: what is asked for beside the
  !> probes. Errors: those of the parts; overflow: then nothing is found.
  subroutine find(frame, vibration, probes, forces, power, findings, error)
    class(frame_type), intent(in) :: frame
    type(vibration_type), intent(in) :: vibration
    type(probe_type), intent(in) :: probes(:)
    logical, intent(in) :: forces, power
    type(findings_type), intent(out) :: findings
    type(error_type), allocatable, intent(out) :: error
    logical :: known

    findings%speed = frame%speed
    findings%period = frame%period
    if (.not. allocated(vibration%motion)) return
    if (forces) call find_places(frame, vibration, findings%places, error)
    if (allocated(error)) return
    if (size(vibration%motion, 1) >= accelerations) then
      if (size(probes) > 0) call watch(frame, vibration, probes, findings%watched, error)
      if (allocated(error)) return
      if (power) then
        allocate(findings%drive)
        call find_drive(frame, vibration, findings%drive, known, error)
        if (.not. known) deallocate(findings%drive)
      end if
    end if
    if (allocated(error) .or. finite(findings)) return
    findings = findings_type()
    call fatal_error(error, "forces, motion of probes or torque overflow: they lie beyond what double precision holds", &
      & failed_computation)
  end subroutine find

  !> Whether all that was found are numbers.
  pure logical function finite(findings)
    type(findings_type), intent(in) :: findings
    integer :: i

    finite = .true.
    if (allocated(findings%places)) then
      do i = 1, size(findings%places)
        finite = finite .and. all(findings%places(i)%statistics%finite()) .and. all(ieee_is_finite(findings%places(i)%history)) &
          & .and. ieee_is_finite(findings%places(i)%least_compression)
      end do
    end if
    if (allocated(findings%watched)) then
      do i = 1, size(findings%watched)
        finite = finite .and. all(findings%watched(i)%statistics%finite()) .and. all(ieee_is_finite(findings%watched(i)%history)) &
          & .and. ieee_is_finite(findings%watched(i)%greatest) .and. ieee_is_finite(findings%watched(i)%error)
      end do
    end if
    if (.not. allocated(findings%drive)) return
    associate (drive => findings%drive)
      finite = finite .and. all(ieee_is_finite(drive%history)) .and. all(ieee_is_finite([drive%actual%rms, drive%rigid%rms, &
        & drive%peak_error, drive%drive_mean, drive%dampers_mean]))
      if (allocated(drive%fluctuation)) finite = finite .and. ieee_is_finite(drive%fluctuation%irregularity) &
        & .and. ieee_is_finite(drive%fluctuation%error)
    end associate
  end function finite

end module gestell_task_findings
