!> Reduces a quantity of the vibration to one number. This number is its peak over the turn, its rms over the turn, or its rms
!> within the frequency band of a probe, as a vibration meter displays it.
module gestell_study_measure
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_frame_of, only: frame_of
  use gestell_model_quantity, only: find_quantity, look_up_quantity
  use gestell_model_quantity_rows, only: probe_type, quantity_type
  use gestell_study_vibration, only: solve_vibration, vibration_type
  use gestell_study_vibration_statistics, only: band_rms, statistics_type, compute_statistics
  use gestell_system_periodic, only: periodic_system
  use gestell_floquet_solution, only: floquet_type
  implicit none (type, external)
  private

  public :: has_band, new_measure, rows_of, solve_measures, compute_measures

  integer, parameter, public :: peak_measure = 1, rms_measure = 2, band_measure = 3
  character(len=*), parameter, public :: measure_names(3) = [character(len=4) :: "peak", "rms", "band"]
  !> Message for a band measure of a quantity for which `has_band` is false.
  character(len=*), parameter, public :: band_only = "'band' is available only for velocities of probes: probe(NAME).v, .vx, " &
    & // ".vy, in space .vz"

  !> A quantity of the vibration and the number to which it is reduced.
  type, public :: measure_type
    !> Name of the quantity as the user gave it (gestell_model_quantity)
    character(len=word_length) :: quantity = ""
    !> Kind of the measure: `peak_measure`, `rms_measure` or `band_measure`
    integer :: kind = peak_measure
    !> Unit of the measure
    character(len=8) :: unit = ""
    !> Lower and upper limit of the frequency band of a band measure (Hz)
    real(dp) :: band(2) = 0
  contains
    procedure :: name, meaning
  end type measure_type

  !> Unit of band measures, as displayed by vibration meters.
  character(len=*), parameter :: meter_unit = "mm/s"
  real(dp), parameter :: meter_scale = 1000

contains

  !> Name of the measure in tables, without the unit, for example f_peak.
  pure function name(self)
    class(measure_type), intent(in) :: self
    character(len=len(self%quantity) + 1 + len(measure_names)) :: name

    name = trim(self%quantity) // "_" // measure_names(self%kind)
  end function name

  !> Meaning of the measure in words, for headings.
  pure character(len=48) function meaning(self)
    class(measure_type), intent(in) :: self
    character(len=*), parameter :: meanings(3) = [character(len=len(meaning)) :: "maximum magnitude over the period", &
      & "root mean square", "root mean square within the probe's band"]

    meaning = meanings(self%kind)
  end function meaning

  !> True if the quantity is a velocity of a probe: only such velocities are measured in a frequency band.
  pure logical function has_band(quantity)
    character(len=*), intent(in) :: quantity

    has_band = index(quantity, "probe(") == 1 .and. any(quantity(index(quantity, ").", back=.true.) + 2:) &
      & == [character(len=2) :: "v", "vx", "vy", "vz"])
  end function has_band

  !> Creates a measure of the quantity `name`. The mechanism is not evaluated, so it need not be possible to assemble it. Fails if
  !> the quantity does not exist or cannot be measured in a band.
  subroutine new_measure(frame, probes, name, kind, measure, error)
    !> The frame whose quantity is measured
    class(frame_type), intent(in) :: frame
    !> Probes that `name` may refer to
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: name
    !> `peak_measure`, `rms_measure` or `band_measure`
    integer, intent(in) :: kind
    type(measure_type), intent(out) :: measure
    type(error_type), allocatable, intent(out) :: error
    type(quantity_type) :: quantity
    integer :: k

    call look_up_quantity(frame, probes, name, quantity, error)
    if (allocated(error)) return
    measure%quantity = name
    measure%kind = kind
    measure%unit = quantity%unit
    if (kind /= band_measure) return
    if (.not. has_band(name)) then
      call fatal_error(error, band_only, invalid_input)
      return
    end if
    measure%unit = meter_unit
    do k = 1, size(probes)
      if (index(name, "probe(" // trim(probes(k)%name) // ").") == 1) measure%band = probes(k)%band
    end do
  end subroutine new_measure

  !> Number of rows of the motion (gestell_model_quantity_rows) that are required to compute the measures. Fails in the same cases
  !> as `new_measure`.
  subroutine rows_of(frame, probes, measures, rows, error)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    type(measure_type), intent(in) :: measures(:)
    integer, intent(out) :: rows
    type(error_type), allocatable, intent(out) :: error
    type(quantity_type) :: quantity
    integer :: i

    rows = 0
    do i = 1, size(measures)
      call look_up_quantity(frame, probes, trim(measures(i)%quantity), quantity, error)
      if (allocated(error)) return
      rows = max(rows, quantity%rows())
    end do
  end subroutine rows_of

  !> Computes the vibration of `system`, which is a frame or its averaged model, and the measures of this vibration. Fails if
  !> `solve_vibration` or `compute_measures` fails.
  subroutine solve_measures(system, floquet, probes, measures, vibration, values, error, least_rows)
    class(periodic_system), intent(in), target :: system
    !> Floquet solution of `system`, computed with its load
    type(floquet_type), intent(in) :: floquet
    !> Probes that the measures may refer to
    type(probe_type), intent(in) :: probes(:)
    type(measure_type), intent(in) :: measures(:)
    type(vibration_type), intent(out) :: vibration
    !> Each measure and a bound on its error, shape (2, measures); 0 if `system` is neither a frame nor its averaged model
    real(dp), intent(out) :: values(:, :)
    type(error_type), allocatable, intent(out) :: error
    !> Minimum number of rows of the motion that `vibration` must contain
    integer, intent(in), optional :: least_rows
    integer, parameter :: points = 64, harmonics = 20
    class(frame_type), pointer :: frame
    integer :: rows

    values = 0
    frame => frame_of(system)
    if (.not. associated(frame) .or. (size(measures) == 0 .and. .not. present(least_rows))) then
      call solve_vibration(system, floquet, points, harmonics, vibration, error)
      return
    end if
    call rows_of(frame, probes, measures, rows, error)
    if (present(least_rows)) rows = max(rows, least_rows)
    if (.not. allocated(error)) call solve_vibration(system, floquet, points, harmonics, vibration, error, rows)
    if (.not. allocated(error)) call compute_measures(frame, probes, vibration, measures, values, error)
  end subroutine solve_measures

  !> Computes each measure of a vibration of the frame and a bound on its error, in the unit of the measure; shape (2, measures).
  !> Fails if a quantity does not exist, or if the vibration lacks rows of the motion from which the measures are computed.
  subroutine compute_measures(frame, probes, vibration, measures, values, error)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    type(vibration_type), intent(in) :: vibration
    type(measure_type), intent(in) :: measures(:)
    real(dp), intent(out) :: values(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(quantity_type) :: quantity
    type(statistics_type) :: statistics
    real(dp) :: along(3), maximum
    integer :: i

    values = 0
    do i = 1, size(measures)
      call find_quantity(frame, probes, trim(measures(i)%quantity), quantity, error)
      if (.not. allocated(error)) call compute_statistics(vibration, quantity, statistics, error)
      if (allocated(error)) return
      select case (measures(i)%kind)
      case (peak_measure)
        values(:, i) = [statistics%peak, statistics%peak_error]
      case (rms_measure)
        values(:, i) = [statistics%rms, statistics%error]
      case default
        call band_rms(statistics, frame%period, measures(i)%band, along(:size(statistics%series)), maximum, error)
        if (allocated(error)) return
        ! the rms of the error within the band cannot exceed the error bound of the whole quantity
        values(:, i) = meter_scale * [maximum, statistics%error]
      end select
    end do
  end subroutine compute_measures

end module gestell_study_measure
