!> Reports the natural frequencies of the frame, and the orders of the crank that are near them.
module gestell_task_machine_frequencies
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, newline, text
  use gestell_model_frame, only: frame_type
  use gestell_output_report_orders, only: order_of
  use gestell_output_report_text_table, only: listed, tab, tabulated
  use gestell_study_vibration_resonance, only: describe_resonance, is_near, resonance_type
  implicit none (type, external)
  private

  public :: frequency_lines, frequency_list, list_frequencies, report_frequencies, resonance_lines

  !> Highest order that the table may mark as near a natural frequency. Higher orders hardly excite the frame
  integer, parameter :: highest_order = 50
  !> Two natural frequencies count as equal if their relative difference is smaller than this
  real(dp), parameter :: equal = 1.0e-9_dp
  !> The sum of two natural frequencies counts as near an order of the crank if their relative difference is smaller than this. The
  !> limit is small because regions of parametric instability are narrower than resonances
  real(dp), parameter :: near_sum = 0.03_dp

contains

  !> Table of the natural frequencies, or the reason why they cannot be computed.
  function report_frequencies(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    type(error_type), allocatable :: failure
    real(dp), allocatable :: frequencies(:), slow_frequencies(:)
    class(frame_type), allocatable :: slow_frame

    call frame%natural_frequencies(frequencies, failure)
    if (allocated(failure)) then
      lines = newline // "NATURAL FREQUENCIES of the frame cannot be computed: " // failure%message // newline
      return
    end if
    lines = frequency_lines(frequencies, abs(frame%drive_speed()), frame%mechanism%turns, varies(frame))
    allocate(slow_frame, source=frame)
    call slow_frame%run_at(frame%speed / 2)
    call slow_frame%natural_frequencies(slow_frequencies, failure)
    if (allocated(failure)) return
    if (any(abs(slow_frequencies - frequencies) > equal * abs(frequencies))) lines = lines &
      & // "  natural frequencies depend on the speed (gyroscopic moments): the task 'campbell' computes them for a range of " &
      & // "speeds" // newline
  end function report_frequencies

  !> True if the coefficients of the equations linearised about rest vary over the period by more than rounding error.
  logical function varies(frame)
    class(frame_type), intent(in) :: frame
    integer, parameter :: phases = 16
    real(dp), parameter :: rounding = 1.0e-12_dp
    real(dp), dimension(phases, size(frame%free), size(frame%free)) :: m, b, c
    integer :: k

    call frame%sample_second_order([(real(k, dp) / phases, k = 0, phases - 1)], m, b, c)
    varies = changes(m) .or. changes(b) .or. changes(c)

  contains

    !> True if a matrix with values at several phases, shape (phases, dofs, dofs), varies by more than rounding error.
    pure logical function changes(a)
      real(dp), intent(in) :: a(:, :, :)

      changes = maxval(abs(a - spread(a(1, :, :), 1, phases))) > rounding * maxval(abs(a))
    end function changes

  end function varies

  !> Line with the natural frequencies; empty if they cannot be computed.
  function list_frequencies(frame) result(line)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: line

    line = frequency_list(frame)
    if (line /= "") line = newline // "NATURAL FREQUENCIES of the frame" // line // "; the crank turns at " &
      & // concise(frame%mechanism%turns / frame%period, 4) // " Hz" // newline
  end function list_frequencies

  !> Natural frequencies as a list, for example " 1.2, 3.4, 5.6 Hz"; empty if they cannot be computed.
  function frequency_list(frame) result(list)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: list
    real(dp), allocatable :: frequencies(:)
    type(error_type), allocatable :: error

    list = ""
    call frame%natural_frequencies(frequencies, error)
    if (allocated(error)) return
    list = " " // listed(max(frequencies, 0.0_dp) / (2 * pi), 4, ", ") // " Hz"
  end function frequency_list

  !> Table of the natural frequencies, each with the nearest order, a multiple of the crank speed. If the crank makes several
  !> `turns` in the period, there are also fractional orders, multiples of 1 / `turns`. If the coefficients are `periodic`, lines
  !> follow on sums of two frequencies that are near an order.
  pure function frequency_lines(frequencies, speed, turns, periodic) result(lines)
    !> `frequencies`: natural frequencies in ascending order (rad/s); a negative value is minus the growth rate (1/s) of an unstable
    !> motion. `speed`: crank speed (rad/s)
    real(dp), intent(in) :: frequencies(:), speed
    integer, intent(in) :: turns
    logical, intent(in) :: periodic
    character(len=:), allocatable :: lines
    real(dp) :: ratio, nearest, distance
    integer :: k

    lines = ""
    do k = 1, size(frequencies)
      lines = lines // text(k) // tab
      if (frequencies(k) < 0) then
        lines = lines // "-" // repeat(tab, 6) // "unstable, growth rate " // concise(-frequencies(k), 4) // " 1/s" // newline
        cycle
      end if
      if (.not. frequencies(k) > 0) then
        lines = lines // "0" // repeat(tab, 6) // "nothing holds the frame in this direction" // newline
        cycle
      end if
      ratio = frequencies(k) / speed
      nearest = max(1.0_dp, anint(ratio * turns)) / turns
      distance = frequencies(k) / (nearest * speed) - 1
      lines = lines // concise(frequencies(k) / (2 * pi)) // tab // concise(frequencies(k)) // tab // concise(ratio, 5) // tab &
        & // concise(nearest, merge(9, 4, turns == 1)) // tab // concise(frequencies(k) / nearest * 30 / pi, 5) // tab &
        & // merge("+", "-", distance > 0) // concise(100 * abs(distance), 2) // " %" // tab
      if (nearest <= highest_order) then
        if (is_near(ratio * turns, nint(nearest * turns))) lines = lines // "<- near"
      end if
      lines = lines // newline
    end do
    lines = newline // "NATURAL FREQUENCIES of the frame, with the moving masses averaged over the turn" // newline &
      & // tabulated("lrrrrrrl", ",,,crank,nearest,resonance,from crank" // newline // ",Hz,rad/s,speeds,order,at rpm,speed", lines)
    if (periodic) lines = lines // parametric_lines(frequencies, speed, turns)
  end function frequency_lines

  !> Lines on those sums of two natural frequencies that are near a low multiple of the crank speed. There the periodic coefficients
  !> can make free vibrations grow (parametric resonance). Equal frequencies count only once.
  pure function parametric_lines(frequencies, speed, turns) result(lines)
    real(dp), intent(in) :: frequencies(:), speed
    integer, intent(in) :: turns
    character(len=:), allocatable :: lines
    integer, parameter :: highest = 3
    real(dp) :: ratio
    integer :: i, k

    lines = ""
    do i = 1, size(frequencies)
      do k = i, size(frequencies)
        if (.not. frequencies(i) > 0 .or. is_repeated(i) .or. is_repeated(k)) cycle
        ratio = (frequencies(i) + frequencies(k)) / speed * turns
        if (ratio < 0.5_dp .or. ratio > highest * turns + 0.5_dp) cycle
        if (abs(ratio / nint(ratio) - 1) > near_sum) cycle
        lines = lines // either("  twice frequency " // text(i) // " is ", "  the sum of frequencies " // text(i) // " and " &
          & // text(k) // " is ", i == k) // concise(ratio / turns, 4) &
          & // " times the crank speed: near parametric resonance of order " // order_of(nint(ratio), turns) // newline
      end do
    end do

  contains

    !> True if frequency number `k` equals the previous one.
    pure logical function is_repeated(k)
      integer, intent(in) :: k

      is_repeated = .false.
      if (k > 1) is_repeated = frequencies(k) - frequencies(k - 1) <= equal * frequencies(k)
    end function is_repeated

  end function parametric_lines

  !> Line on the resonance to which the vibration is near; empty if it is not near a resonance.
  pure function resonance_lines(resonance) result(lines)
    type(resonance_type), intent(in), allocatable :: resonance
    character(len=:), allocatable :: lines

    lines = ""
    if (.not. allocated(resonance)) return
    if (.not. (resonance%near() .or. resonance%is_free())) return
    call describe_resonance(resonance, lines)
    lines = "  near resonance: " // lines // newline
  end function resonance_lines

end module gestell_task_machine_frequencies
