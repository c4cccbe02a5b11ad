!> probes.csv, probes_history.csv, probes_harmonics.csv: the vibration of points of the frame.
module gestell_task_response_probes_csv
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_output_table_csv, only: field, write_table
  use gestell_task_findings_csv, only: add_harmonics, write_harmonics, write_turn
  use gestell_task_findings, only: findings_type
  use gestell_task_response_probes, only: probe_part_names, probe_parts, watched_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: write_probes

  character(len=*), parameter :: units(probe_parts) = [character(len=4) :: "m", "m", "m", "m_s", "m_s", "m_s", "m_s2", "m_s2", &
    & "m_s2"]

contains

  !> Error: a file cannot be written.
  subroutine write_probes(folder, preamble, findings, harmonics, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    integer, intent(in) :: harmonics
    type(error_type), allocatable, intent(out) :: error

    call write_table_of_probes(folder, preamble, findings, error)
    if (.not. allocated(error)) call write_histories(folder, preamble, findings, error)
    if (.not. allocated(error)) call write_series(folder, preamble, findings, harmonics, error)
  end subroutine write_probes

  !> One row a probe.
  subroutine write_table_of_probes(folder, preamble, findings, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: told = 3, extras = 7
    real(dp), parameter :: mm = 1000
    real(dp) :: values(2 + told * probe_parts + extras, size(findings%watched))
    character(len=200) :: labels(size(findings%watched))
    character(len=9) :: verdicts(size(findings%watched))
    character(len=:), allocatable :: header
    integer :: i, k

    do i = 1, size(findings%watched)
      associate (watched => findings%watched(i), probe => findings%watched(i)%probe)
        labels(i) = field(trim(probe%name))
        verdicts(i) = watched%verdict()
        values(:2, i) = probe%position
        do k = 1, probe_parts
          values(told * k:told * k + 2, i) = [watched%statistics(k)%peak, watched%statistics(k)%peak_error, &
            & watched%statistics(k)%rms]
        end do
        values(3 + told * probe_parts:, i) = [mm * watched%band, mm * watched%greatest, mm * watched%error, probe%band, &
          & limit(watched)]
      end associate
    end do
    header = "name,x_m,y_m"
    do k = 1, probe_parts
      header = header // told_of(trim(probe_part_names(k)), trim(units(k)))
    end do
    call write_table(folder, "probes.csv", preamble, header // ",vx_rms_band_mm_s,vy_rms_band_mm_s,v_rms_band_mm_s," &
      & // "v_rms_band_error_mm_s,band_from_Hz,band_to_Hz,limit_mm_s,verdict", values, error, labels=labels, tails=verdicts)
  end subroutine write_table_of_probes

  !> The columns of one part.
  pure function told_of(name, unit) result(columns)
    character(len=*), intent(in) :: name, unit
    character(len=:), allocatable :: columns

    columns = "," // name // "_peak_" // unit // "," // name // "_peak_error_" // unit // "," // name // "_rms_" // unit
  end function told_of

  !> In mm/s; NaN: there is none.
  pure real(dp) function limit(watched)
    type(watched_type), intent(in) :: watched

    limit = ieee_value(limit, ieee_quiet_nan)
    if (watched%probe%limit > 0) limit = 1000 * watched%probe%limit
  end function limit

  subroutine write_histories(folder, preamble, findings, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: values(:, :)
    character(len=:), allocatable :: header
    integer :: i, k

    allocate(values(size(findings%watched(1)%history, 1), probe_parts * size(findings%watched)))
    header = ""
    do i = 1, size(findings%watched)
      do k = 1, probe_parts
        values(:, probe_parts * (i - 1) + k) = findings%watched(i)%history(:, k)
        header = header // "," // field(column(findings%watched(i), k))
      end do
    end do
    call write_turn(folder, "probes_history.csv", preamble, header, findings%speed, findings%period, values, error)
  end subroutine write_histories

  !> The components along x and y.
  subroutine write_series(folder, preamble, findings, harmonics, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(findings_type), intent(in) :: findings
    integer, intent(in) :: harmonics
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: values(:, :)
    character(len=:), allocatable :: header
    integer :: i, k, n

    allocate(values(2 * 2 * (probe_parts / 3) * size(findings%watched), 0:harmonics), source=0.0_dp)
    header = ""
    n = 0
    do i = 1, size(findings%watched)
      do k = 1, probe_parts
        if (mod(k, 3) == 0) cycle
        call add_harmonics(findings%watched(i)%statistics(k)%series(1), values, n)
        header = header // "," // field(column(findings%watched(i), k) // "_amplitude") &
          & // "," // field(column(findings%watched(i), k) // "_phase_rad")
      end do
    end do
    call write_harmonics(folder, "probes_harmonics.csv", preamble, header, findings%period, values, error)
  end subroutine write_series

  !> As vx_NAME_m_s.
  pure function column(watched, part) result(name)
    type(watched_type), intent(in) :: watched
    integer, intent(in) :: part
    character(len=:), allocatable :: name

    name = trim(probe_part_names(part)) // "_" // trim(watched%probe%name) // "_" // trim(units(part))
  end function column

end module gestell_task_response_probes_csv
