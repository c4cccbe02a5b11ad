!> Computes the vibration at points of the frame (probes) as a vibration meter would measure it, and compares the velocity with
!> limits.
module gestell_task_probes_response
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: parts_of_point, point_quantity
  use gestell_model_quantity_rows, only: accelerations, probe_type, quantity_type
  use gestell_study_vibration_statistics, only: band_rms, history_of, statistics_type, compute_statistics
  use gestell_study_vibration, only: check_rows, vibration_type
  use gestell_task_common_executor, only: executor_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: find_responses

  !> Quantities of a probe in the plane: displacement, velocity and acceleration, each along x, along y and as magnitude.
  !> `probe_parts`: number of these quantities. `velocity_part`: index of the magnitude of the velocity among them.
  integer, parameter, public :: probe_parts = 9, velocity_part = 6
  character(len=2), parameter, public :: probe_part_names(probe_parts) = &
    & [character(len=2) :: "x", "y", "d", "vx", "vy", "v", "ax", "ay", "a"]

  !> Vibration at a probe.
  type, public :: probe_response_type
    !> The probe, with its frequency band and its limit
    type(probe_type) :: probe
    !> Names of the quantities: displacement, velocity and acceleration, each along all axes and as magnitude
    character(len=2), allocatable :: parts(:)
    !> Peak, rms and harmonics of each quantity over the period
    type(statistics_type), allocatable :: statistics(:)
    !> Values of the quantities at the times of the vibration's history, shape (points + 1, quantities)
    real(dp), allocatable :: history(:, :)
    !> Rms velocity (m/s) within the frequency band. `band`: its components along x, y and z. `maximum`: its value in the direction
    !> in which it is largest. `error`: error bound of `maximum`
    real(dp) :: band(3) = 0, maximum = 0, error = 0
  contains
    procedure :: verdict
  end type probe_response_type

contains

  !> Computes the vibration at all probes. Fails if a position, limit or band is invalid, or if `vibration` lacks the accelerations.
  subroutine find_responses(frame, vibration, probes, responses, error, executor)
    class(frame_type), intent(in) :: frame
    !> The periodic vibration of the frame
    type(vibration_type), intent(in) :: vibration
    type(probe_type), intent(in) :: probes(:)
    type(probe_response_type), allocatable, intent(out) :: responses(:)
    type(error_type), allocatable, intent(out) :: error
    !> Displays the progress, which is useful if there are thousands of probes
    class(executor_type), intent(inout), optional :: executor
    !> Number of probes between two updates of the progress display. With fewer probes, progress is not displayed
    integer, parameter :: many = 500
    type(quantity_type) :: quantity
    real(dp), allocatable :: history(:)
    integer :: i, k, n

    call frame%check(error)
    if (.not. allocated(error)) call check_rows(vibration, accelerations, error)
    if (allocated(error)) return
    do i = 1, size(probes)
      if (all(ieee_is_finite([probes(i)%position, probes(i)%limit])) .and. probes(i)%limit >= 0 &
        & .and. probes(i)%band(1) >= 0 .and. probes(i)%band(1) <= probes(i)%band(2)) cycle
      call fatal_error(error, "probe '" // trim(probes(i)%name) // "' must have a finite position, a limit of at least 0, and " &
        & // "a band that lists its lower frequency first", invalid_input)
      return
    end do
    allocate(responses(size(probes)))
    do i = 1, size(probes)
      if (present(executor) .and. modulo(i, many) == 0) call executor%show("probes", (i - 1.0_dp) / size(probes))
      responses(i)%probe = probes(i)
      responses(i)%parts = parts_of_point(frame)
      n = size(responses(i)%parts)
      allocate(responses(i)%statistics(n))
      allocate(responses(i)%history(size(vibration%motion_history, 2), n))
      do k = 1, n
        call point_quantity(frame, probes(i), trim(responses(i)%parts(k)), quantity)
        call compute_statistics(vibration, quantity, responses(i)%statistics(k), error)
        if (.not. allocated(error)) call history_of(vibration, quantity, history, error)
        if (allocated(error)) return
        responses(i)%history(:, k) = history
      end do
      associate (velocity => responses(i)%statistics(2 * n / 3))
        call band_rms(velocity, frame%period, probes(i)%band, responses(i)%band(:n / 3 - 1), responses(i)%maximum, error)
        if (allocated(error)) return
        ! If only some orders of an error are included, their mean square does not exceed the square of the error's maximum.
        responses(i)%error = velocity%error
      end associate
    end do
    if (present(executor) .and. size(probes) >= many) call executor%show("probes", 1.0_dp)
  end subroutine find_responses

  !> States whether the velocity is "within" or "above" the limit. "undecided" if the error bound includes the limit; empty if there
  !> is no limit.
  pure character(len=9) function verdict(self)
    class(probe_response_type), intent(in) :: self

    if (.not. self%probe%limit > 0) then
      verdict = ""
    else if (self%maximum + self%error <= self%probe%limit) then
      verdict = "within"
    else if (self%maximum - self%error > self%probe%limit) then
      verdict = "above"
    else
      verdict = "undecided"
    end if
  end function verdict

end module gestell_task_probes_response
