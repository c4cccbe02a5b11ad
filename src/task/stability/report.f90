!> Reports the multipliers and exponents, with the frequencies at which the free vibrations actually oscillate.
module gestell_task_stability_report
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, newline, text
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_output_report_text_table, only: tab, tabulated
  use gestell_study_mode_naming, only: modes_of_multipliers
  use gestell_study_mode, only: mode_type
  implicit none (type, external)
  private

  public :: modulus, multiplier_lines, modulus_of

  !> If |ln |rho|| is larger than this, rho overflows or underflows double precision and is printed as a power of e
  real(dp), parameter, public :: out_of_range = 700

  !> A mode counts as having several frequencies if its strongest component contributes less than this share to the mean square of
  !> the free vibration
  real(dp), parameter :: half = 0.5_dp

contains

  !> Table of the multipliers. It has one row for each real multiplier or conjugate pair, with the frequency of the mode.
  pure function multiplier_lines(multipliers, modes, speed, turns) result(lines)
    type(multipliers_type), intent(in) :: multipliers
    type(mode_type), intent(in) :: modes(:)
    !> Angular frequency 2 pi / T of the period T (rad/s)
    real(dp), intent(in) :: speed
    !> Number of turns that the crank makes in the period
    integer, intent(in) :: turns
    character(len=:), allocatable :: lines
    real(dp) :: error
    integer :: mode(size(multipliers%rho)), k, last

    mode = modes_of_multipliers(multipliers, modes, speed)
    lines = ""
    last = 0
    do k = 1, size(multipliers%rho)
      if (k <= last) cycle
      last = k
      lines = lines // text(k)
      if (k < size(multipliers%rho) .and. aimag(multipliers%rho(k)) > 0) then
        if (.not. abs(multipliers%rho(k + 1) - conjg(multipliers%rho(k))) > 0) last = k + 1
      end if
      if (last > k) lines = lines // ", " // text(last)
      error = maxval(multipliers%error(k:last))
      lines = lines // tab // modulus_of(multipliers, k, 9) // tab // either(concise(error, 1), "lost", error < 1) // tab &
        & // concise(real(multipliers%exponent(k)), 5) // tab
      if (mode(k) > 0) then
        lines = lines // frequency_columns(modes(mode(k)), speed * turns)
      else
        lines = lines // "-" // tab // "-" // tab // "not identified"
      end if
      lines = lines // newline
    end do
    lines = newline // "MULTIPLIERS AND EXPONENTS" // newline // tabulated("lrrrrrl", &
      & ",|rho|,error,growth,frequency,crank" // newline // ",,rel.,1/s,Hz,speeds", lines) &
      & // "  frequency: that of the strongest component of the free vibration" // newline
    if (any(multipliers%lost())) lines = lines // "  lost: the error bound exceeds |rho|, so that no digit is reliable" // newline
  end function multiplier_lines

  !> Modulus of multiplier number `k` as text. It is written as a power of e if it overflows or underflows double precision.
  pure function modulus_of(multipliers, k, digits) result(words)
    type(multipliers_type), intent(in) :: multipliers
    integer, intent(in) :: k, digits
    character(len=:), allocatable :: words

    words = concise(abs(multipliers%rho(k)), digits)
    if (abs(multipliers%log_abs(k)) > out_of_range) words = "e^" // concise(multipliers%log_abs(k), digits)
  end function modulus_of

  !> A modulus as text, given its logarithm. It is written as a power of e if it overflows or underflows double precision.
  pure function modulus(log_abs, digits) result(words)
    real(dp), intent(in) :: log_abs
    integer, intent(in) :: digits
    character(len=:), allocatable :: words

    if (abs(log_abs) > out_of_range) then
      words = "e^" // concise(log_abs, digits)
    else
      words = concise(exp(log_abs), digits)
    end if
  end function modulus

  !> Three cells of the table: the frequency of a mode (Hz), its ratio to the crank speed, and the kind of vibration. `speed`: crank
  !> speed (rad/s).
  pure function frequency_columns(mode, speed) result(columns)
    type(mode_type), intent(in) :: mode
    real(dp), intent(in) :: speed
    character(len=:), allocatable :: columns

    if (.not. mode%frequency() > 0) then
      columns = "0" // tab // "0" // tab // "no oscillation"
      return
    end if
    columns = concise(mode%frequency() / (2 * pi), 7) // tab // concise(mode%frequency() / speed, 5) // tab
    if (mode%real_pair) then
      columns = columns // "locked to the crank"
    else if (mode%share() < half) then
      columns = columns // "one of several components"
    end if
  end function frequency_columns

end module gestell_task_stability_report
