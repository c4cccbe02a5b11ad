!> Reports the natural frequencies of the frame, and the orders of the crank that are near them.
module gestell_task_drawing_frequencies
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_verdict, only: unjudged
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_math_sorting, only: ascending
  use gestell_model_frame, only: frame_type
  use gestell_output_report_orders, only: order_of
  use gestell_output_report_table_lines, only: table_lines
  use gestell_output_report_text_table, only: listed
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_unit, only: hertz, percent, plain, radian_per_s, rpm
  use gestell_study_mode, only: mode_type
  use gestell_study_mode_solution, only: solve_modes
  use gestell_study_vibration_resonance, only: describe_resonance, is_near, resonance_type
  use gestell_system_averaged, only: averaged_system
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: frequency_list, report_frequencies, resonance_lines, tabulate_frequencies

  !> Highest order that the table may mark as near a natural frequency. Higher orders hardly excite the frame
  integer, parameter :: highest_order = 50
  !> Two natural frequencies count as equal if their relative difference is smaller than this
  real(dp), parameter :: equal = 1.0e-9_dp
  !> The sum of two natural frequencies counts as near an order of the crank if their relative difference is smaller than this. The
  !> limit is small because regions of parametric instability are narrower than resonances
  real(dp), parameter :: near_sum = 0.03_dp

contains

  !> Section on the natural frequencies, or the reason why they cannot be computed.
  function report_frequencies(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines
    type(error_type), allocatable :: failure
    real(dp), allocatable :: frequencies(:), slow_frequencies(:)
    class(frame_type), allocatable :: slow_frame
    type(table_type) :: table

    call tabulate_frequencies(frame, table, frequencies, failure)
    if (allocated(failure)) then
      lines = newline // "NATURAL FREQUENCIES of the frame cannot be computed: " // failure%message // newline
      return
    end if
    lines = newline // "NATURAL FREQUENCIES of the frame, with the moving masses averaged over the turn" // newline &
      & // table_lines(table, "lrrrrrrl", ",,damping,crank,nearest,resonance,from crank" // newline // ",Hz,ratio,speeds,order," &
      & // "at rpm,speed", [1, 6, 0, 3, 5, merge(9, 4, frame%mechanism%turns == 1), 5, 2, 1])
    if (varies(frame)) lines = lines // parametric_lines(frequencies, abs(frame%drive_speed()), frame%mechanism%turns)
    allocate(slow_frame, source=frame)
    call slow_frame%run_at(frame%speed / 2)
    call slow_frame%natural_frequencies(slow_frequencies, failure)
    if (allocated(failure)) return
    if (any(abs(slow_frequencies - frequencies) > equal * abs(frequencies))) lines = lines &
      & // "  natural frequencies depend on the speed (gyroscopic moments): the task 'campbell' computes them for a range of " &
      & // "speeds" // newline
  end function report_frequencies

  !> Tabulates the natural frequencies, each with its damping ratio and the nearest order, a multiple of the crank speed. If the
  !> crank makes several turns in the period, there are also fractional orders. Fails if the frequencies cannot be computed.
  subroutine tabulate_frequencies(frame, table, frequencies, error)
    class(frame_type), intent(in) :: frame
    type(table_type), intent(out) :: table
    !> Natural frequencies in ascending order (rad/s); a negative value is minus the growth rate (1/s) of an unstable motion
    real(dp), allocatable, intent(out) :: frequencies(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=52), allocatable :: remarks(:)
    real(dp), allocatable :: ratios(:), orders(:)
    real(dp) :: missing
    integer :: k

    call frame%natural_frequencies(frequencies, error)
    if (allocated(error)) return
    missing = ieee_value(missing, ieee_quiet_nan)
    associate (w => frequencies, speed => abs(frame%drive_speed()), turns => frame%mechanism%turns)
      ratios = merge(w / speed, missing, w > 0)
      orders = merge(max(1.0_dp, anint(w / speed * turns)) / turns, missing, w > 0)
      allocate(remarks(size(w)))
      do k = 1, size(w)
        remarks(k) = ""
        if (w(k) < 0) then
          remarks(k) = "unstable, growth rate " // concise(-w(k), 4) // " 1/s"
        else if (.not. w(k) > 0) then
          remarks(k) = "nothing holds the frame in this direction"
        else if (orders(k) <= highest_order) then
          if (is_near(ratios(k) * turns, nint(orders(k) * turns))) remarks(k) = "near"
        end if
      end do
      table = new_table("frequencies", "Natural frequencies", "Natural frequencies of the frame, linearised about rest, with the " &
        & // "moving masses averaged over the turn.", unjudged, shown=.true.)
      call table%add("index", "number of the natural frequency, in ascending order", [(k, k = 1, size(w))])
      call table%add("frequency", hertz, "natural frequency without damping", merge(w / (2 * pi), missing, w >= 0))
      call table%add("angular_frequency", radian_per_s, "natural angular frequency", merge(w, missing, w >= 0))
      call table%add("damping_ratio", plain, "damping ratio of the mode", damping_ratios(frame, size(w)))
      call table%add("crank_speeds", plain, "frequency divided by the crank speed", ratios)
      k = size(table%columns)
      table%columns(k)%label = "frequency / crank frequency"
      call table%add("order", plain, "nearest order", orders)
      call table%add("resonance", rpm, "crank speed at which this order equals the frequency", w / orders * 30 / pi)
      call table%add("distance", percent, "distance of this speed from the crank speed", 100 * (w / (orders * speed) - 1))
      call table%add("remark", "`near`: near resonance with the order", remarks)
      call table%mark_details(["angular_frequency"])
    end associate
  end subroutine tabulate_frequencies

  !> Damping ratios of the frame linearised about rest, with coefficients averaged over the turn, in ascending order of natural
  !> frequency. NaN if a mode has no frequency or no damping ratio can be computed.
  function damping_ratios(frame, count) result(ratios)
    class(frame_type), intent(in) :: frame
    !> Number of natural frequencies
    integer, intent(in) :: count
    real(dp) :: ratios(count), squares(count), growth(count)
    type(averaged_system) :: model
    type(mode_type), allocatable :: modes(:)
    real(dp), allocatable :: mass(:, :)
    type(error_type), allocatable :: error

    ratios = ieee_value(1.0_dp, ieee_quiet_nan)
    call frame%averaged(model)
    call solve_modes(model, accuracy_type(), modes, mass, error)
    if (allocated(error)) return
    if (.not. all(modes%identified)) return
    ! The two exponents of a mode have the sum -2 D w and the product w^2, even if they are real.
    squares = merge(modes%growth * modes%partner_growth, modes%growth**2 + modes%frequency()**2, modes%real_pair)
    growth = merge(0.0_dp, modes%growth + modes%partner_growth, abs(modes%growth) <= modes%error)
    ratios = merge(-growth / (2 * sqrt(max(squares, tiny(1.0_dp)))), ratios, squares > 0)
    ratios = ratios(ascending(squares))
  end function damping_ratios

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

end module gestell_task_drawing_frequencies
