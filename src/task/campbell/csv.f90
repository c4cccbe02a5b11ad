!> campbell.csv, crossings.csv, critical.csv.
module gestell_task_campbell_csv
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: exact, text
  use gestell_output_table_csv, only: write_table
  use gestell_task_campbell, only: campbell_type
  use gestell_task_campbell_crossings, only: crossing_type
  use gestell_task_critical, only: amplitude, critical_type, force, outcomes
  use gestell_study_mode_type, only: mode_type, most_freedoms
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: write_campbell, write_critical, write_crossings

contains

  !> A row for every mode at every speed into `folder`; `preamble` heads the file. Error: it cannot be written.
  subroutine write_campbell(folder, preamble, campbell, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(campbell_type), intent(in) :: campbell
    type(error_type), allocatable, intent(out) :: error
    character(len=40), allocatable :: labels(:)
    character(len=8), allocatable :: tails(:)
    real(dp), allocatable :: values(:, :)
    integer :: i, k, row

    associate (rows => campbell%modes * size(campbell%points))
      allocate(labels(rows), tails(rows), values(13, rows))
    end associate
    row = 0
    do i = 1, size(campbell%points)
      do k = 1, campbell%modes
        associate (point => campbell%points(i), mode => campbell%points(i)%modes(k))
          row = row + 1
          labels(row) = exact(point%speed) // "," // text(k)
          values(:, row) = numbers(mode, campbell%free)
          tails(row) = bit(mode%told .and. mode%real_pair) // "," // bit(point%sure) // "," // bit(.not. point%ordered)
        end associate
      end do
    end do
    call write_table(folder, "campbell.csv", preamble, "speed_rpm,mode,frequency_Hz,growth_1_per_s,partner_growth_1_per_s," // &
      & "damping_ratio,share,frequency_error_Hz,growth_error_1_per_s,xi_re,xi_im,eta_re,eta_im,psi_re,psi_im," // &
      & "real_pair,sure,inserted", values, error, labels=labels, tails=tails)
  end subroutine write_campbell

  !> Frequency to error, then the shape, whose greatest component is real and positive.
  pure function numbers(mode, free) result(row)
    type(mode_type), intent(in) :: mode
    integer, intent(in) :: free(:)
    real(dp) :: row(13)
    complex(dp) :: shape(most_freedoms), all(most_freedoms)
    integer :: k

    row = ieee_value(1.0_dp, ieee_quiet_nan)
    if (.not. mode%told) return
    shape = mode%shape()
    associate (largest => shape(maxloc(abs(shape), dim=1)))
      if (abs(largest) > 0) shape = shape * (abs(largest) / largest)
    end associate
    all = 0
    all(free) = shape(:size(free))
    row(:7) = [mode%frequency() / (2 * pi), mode%growth, mode%partner_growth, mode%damping_ratio(), mode%share(), &
      & mode%error / (2 * pi), mode%error]
    row(8:) = [(real(all(k)), aimag(all(k)), k = 1, most_freedoms)]
  end function numbers

  !> The crossings into `folder`. Error: the file cannot be written.
  subroutine write_crossings(folder, preamble, crossings, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(crossing_type), intent(in) :: crossings(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=40) :: labels(size(crossings))
    character(len=8) :: tails(size(crossings))
    real(dp) :: values(7, size(crossings))
    integer :: i

    do i = 1, size(crossings)
      associate (c => crossings(i))
        labels(i) = text(c%mode) // "," // exact(c%order)
        values(:, i) = [c%speed, c%error, c%ends, c%at%frequency() / (2 * pi), c%at%growth, c%at%damping_ratio()]
        tails(i) = bit(c%locked)
      end associate
    end do
    call write_table(folder, "crossings.csv", preamble, "mode,order,speed_rpm,speed_error_rpm,from_rpm,to_rpm,frequency_Hz," // &
      & "growth_1_per_s,damping_ratio,locked", values, error, labels=labels, tails=tails)
  end subroutine write_crossings

  !> The critical speeds into `folder`. Error: the file cannot be written.
  subroutine write_critical(folder, preamble, critical, error)
    character(len=*), intent(in) :: folder, preamble(:)
    type(critical_type), intent(in) :: critical(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=40) :: labels(size(critical))
    character(len=16) :: tails(size(critical))
    real(dp) :: values(13, size(critical))
    integer :: i

    do i = 1, size(critical)
      associate (c => critical(i))
        labels(i) = text(c%crossing%mode) // "," // text(nint(c%crossing%order)) // "," // trim(outcomes(c%outcome))
        values(:, i) = ieee_value(1.0_dp, ieee_quiet_nan)
        values(:4, i) = [c%crossing%speed, c%half_width, c%crossing%at%frequency() / (2 * pi), c%crossing%at%damping_ratio()]
        if (c%found(amplitude)) values(5:9, i) = [c%speed(amplitude), c%error(amplitude), c%height(amplitude), &
          & c%prominence(amplitude), c%share]
        if (c%found(force)) values(10:, i) = [c%speed(force), c%error(force), c%height(force), c%prominence(force)]
        tails(i) = trim(c%verdict) // "," // merge(bit(c%moved%small()) // "  ", "NaN", any(c%found))
      end associate
    end do
    call write_table(folder, "critical.csv", preamble, "mode,order,outcome,crossing_rpm,half_width_rpm,frequency_Hz," // &
      & "damping_ratio,speed_rpm,speed_error_rpm,amplitude_m,prominence,share,force_speed_rpm,force_speed_error_rpm,force_N," // &
      & "force_prominence,verdict,small_motion", values, error, labels=labels, tails=tails)
  end subroutine write_critical

  pure character function bit(yes)
    logical, intent(in) :: yes

    bit = merge("1", "0", yes)
  end function bit

end module gestell_task_campbell_csv
