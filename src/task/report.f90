!> The report for people: what an engineer wants to read first.
module gestell_task_report
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, fixed, text
  use gestell_base_version, only: version
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_solution, only: evidence, evidence_type
  use gestell_task_configuration, only: configuration_type
  use gestell_base_wording, only: counted, on_one_line, padded
  use gestell_output_report_plausibility, only: implausible_lines
  use gestell_task_power_report, only: holder_line
  use gestell_task_report_model, only: better_line, model_line, newton_line
  use gestell_task_stability_report, only: multiplier_lines, out_of_range, told
  use gestell_task_report_several, only: among, several_lines
  use gestell_output_report_significance, only: noise_of, order_words
  use gestell_output_report_verdict, only: section
  use gestell_output_report_warnings, only: beyond_small
  use gestell_model_frame, only: frame_type, freedom_names
  use gestell_model_linkage, only: linkage_type
  use gestell_study_vibration_analysis, only: analysis_type
  use gestell_study_mode_type, only: mode_type
  use gestell_study_vibration_resonance, only: describe_resonance, resonance_type
  use gestell_study_vibration_small_motion, only: moved
  use gestell_study_vibration, only: vibration_type
  implicit none (type, external)
  private

  public :: report_frequencies, report_machine, report_results

  character, parameter :: newline = new_line("a")
  !> Speeds closer than this, relative, are called near.
  real(dp), parameter :: near = 0.03_dp
  !> Orders above this hardly shake: nearness to them is not worth a word.
  real(dp), parameter :: highest_order = 50

contains

  !> What was read: title, machine, drive.
  function report_machine(configuration, input) result(report)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: input
    character(len=:), allocatable :: report
    integer :: i

    associate (frame => configuration%frame)
      report = "Gestell " // version // newline // newline
      if (len(configuration%title) > 0) report = report // "  title      " // on_one_line(configuration%title) // newline
      report = report // "  input      " // on_one_line(input) // newline
      if (allocated(configuration%impossible)) then
        report = report // "  mechanism  cannot turn as it stands in the input: " // configuration%impossible%message // newline
        return
      end if
      select type (mechanism => frame%mechanism)
      type is (linkage_type)
        report = report // "  mechanism  " // counted(size(mechanism%joints), "joint") // ", " &
          & // counted(size(mechanism%links), "link") // " of " // concise(mechanism%mass) &
          & // " kg in all; turns freely through 360 deg" // newline
      class default
        report = report // "  mechanism  " // concise(mechanism%mass) // " kg in all, by its mass functions" // newline
      end select
      report = report // "  frame      " // concise(frame%mass) // " kg, " // concise(frame%inertia) // " kg m^2, free in"
      do i = 1, size(frame%free)
        report = report // " " // trim(freedom_names(frame%free(i)))
      end do
      if (.not. any(abs(frame%stiffness(frame%free, frame%free)) > 0)) report = report // newline // "  mounting   none: " // &
        & "no &support and no stiffness of the &foundation holds the frame"
      report = report // newline // "  drive      " // concise(abs(frame%speed) * 30 / pi) // " rpm " &
        & // trim(merge("counter-clockwise", "clockwise        ", frame%speed > 0)) // ", " &
        & // concise(1 / frame%period) // " Hz, period " // concise(frame%period) // " s" // newline &
        & // holder_line(frame%held_by) // newline // gravity_line(frame) // implausible_lines(frame)
      report = report // model_line(configuration%tasks)
    end associate
  end function report_machine

  !> What weighs, and where to; nothing without gravity.
  pure function gravity_line(frame) result(line)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: line

    line = ""
    if (.not. frame%weights%act) return
    associate (g => [real(frame%weights%gravity, dp), aimag(frame%weights%gravity)], weight => norm2(frame%weights%load(:2)))
      line = "  gravity    " // concise(norm2(g)) // " m/s^2 at " // concise(atan2(g(2), g(1)) * 180 / pi, 4) &
        & // " deg; all weighs " // concise(weight, 5) // " N" // newline
    end associate
  end function gravity_line

  !> The natural frequencies in one line; nothing where they cannot be told.
  function report_frequencies(frame) result(line)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: line
    real(dp), allocatable :: frequencies(:)
    type(error_type), allocatable :: error
    integer :: k

    line = ""
    call frame%natural_frequencies(frequencies, error)
    if (allocated(error)) return
    line = newline // "NATURAL FREQUENCIES of the frame"
    do k = 1, size(frequencies)
      line = line // trim(merge(",", " ", k > 1)) // " " // concise(max(frequencies(k), 0.0_dp) / (2 * pi), 4)
    end do
    line = line // " Hz; the crank turns at " // concise(1 / frame%period, 4) // " Hz" // newline
  end function report_frequencies

  !> What was found, for what was asked for. `frequencies`: natural frequencies (rad/s); `modes`: none where they cannot be told;
  !> `better`: multipliers about the vibration where those about rest miss them.
  pure function report_results(configuration, analysis, frequencies, modes, better) result(report)
    type(configuration_type), intent(in) :: configuration
    type(analysis_type), intent(in) :: analysis
    real(dp), intent(in) :: frequencies(:)
    type(mode_type), intent(in) :: modes(:)
    type(multipliers_type), intent(in), allocatable :: better
    character(len=:), allocatable :: report

    associate (frame => configuration%frame)
      report = ""
      if (allocated(analysis%multipliers)) report = report // verdict_lines(analysis%multipliers, frame%period, &
        & among(analysis%several))
      report = report // better_line(better, trim(configuration%tasks%model)) // evidence_lines(analysis, configuration%accuracy) &
        & // newton_line(analysis%newton) // several_lines(analysis%several, configuration%tasks%all_vibrations)
      if (allocated(analysis%vibration)) report = report // beyond_small([moved(frame, analysis%vibration%peak(:3))], &
        & configuration%tasks%model)
      if (configuration%tasks%stability .or. configuration%tasks%modes) report = report &
        & // multiplier_lines(analysis%multipliers, modes, abs(frame%speed))
      report = report // frequency_lines(frequencies, abs(frame%speed))
      if (allocated(analysis%vibration)) then
        if (configuration%tasks%response) report = report // vibration_lines(analysis%vibration, frame, &
          & configuration%tasks%averaged, trim(analysis%multipliers%verdict()))
        if (allocated(analysis%resonance)) report = report // resonance_lines(analysis%resonance)
      end if
    end associate
  end function report_results

  !> The verdict in words; `others`: what is said of other vibrations.
  pure function verdict_lines(multipliers, period, others) result(lines)
    type(multipliers_type), intent(in) :: multipliers
    real(dp), intent(in) :: period
    character(len=*), intent(in) :: others
    character(len=:), allocatable :: lines
    character(len=:), allocatable :: word
    real(dp) :: turns
    integer :: worst

    word = trim(multipliers%verdict())
    lines = newline // "VERDICT  " // word // ": "
    if (multipliers%untold()) then
      lines = lines // "nothing is known of the multipliers: with half and with twice the steps that were ordered" // newline &
        & // "  they come out different. Order more steps, or none: then the tolerance decides" // newline
      return
    end if
    turns = log(2.0_dp) / max(abs(multipliers%log_abs(1)), tiny(1.0_dp))
    if (word == "stable" .and. multipliers%error(1) >= 1) then
      lines = lines // "every free vibration dies out within a turn, so fast that the multipliers are lost in rounding" &
        & // others // newline
      return
    end if
    select case (word)
    case ("stable")
      lines = lines // "every free vibration dies out, the slowest to half in " // concise(turns, 3) // " turns (" &
        & // concise(turns * period, 3) // " s)" // others
    case ("unstable")
      lines = lines // "a free vibration grows, to twice its size in " // concise(turns, 3) // " turns (" &
        & // concise(turns * period, 3) // " s)" // others // newline // "  it " // manner(multipliers%arg(1))
    case default
      lines = lines // "the error bound reaches across the border |rho| = 1" // others
    end select
    lines = lines // newline // "  largest multiplier  |rho| = " // modulus(multipliers, 1) // newline
    if (word == "undecided") then
      worst = maxloc(multipliers%log_abs + log(1 + multipliers%error), dim=1)
      if (worst > 1) lines = lines // "  largest bound       |rho| = " // modulus(multipliers, worst) // newline
      lines = lines // "  Either the tolerance is too coarse (ask for a smaller one in &accuracy), or the machine sits on the" &
        & // newline // "  border, as one without damping or without springs in some direction does." // newline
    end if
  end function verdict_lines

  !> How the free vibration of a multiplier with that argument looks from turn to turn.
  pure function manner(arg) result(words)
    real(dp), intent(in) :: arg
    character(len=:), allocatable :: words
    real(dp), parameter :: real_axis = 1.0e-6_dp

    if (abs(arg) < real_axis) then
      words = "repeats itself in every turn (divergence, or parametric resonance of even order)"
    else if (pi - abs(arg) < real_axis) then
      words = "changes its sign from turn to turn (parametric resonance of odd order)"
    else
      words = "beats with the turns (flutter, or combination resonance)"
    end if
  end function manner

  !> A modulus with as many digits as its error leaves, and the error; beyond the range of numbers by its logarithm.
  pure function modulus(multipliers, k) result(words)
    type(multipliers_type), intent(in) :: multipliers
    integer, intent(in) :: k
    character(len=:), allocatable :: words
    real(dp) :: rho, bound

    rho = abs(multipliers%rho(k))
    bound = rho * multipliers%error(k)
    if (multipliers%error(k) >= 1) then
      words = told(multipliers, k, 3) // ", lost: no digit of it is sure"
      return
    else if (abs(multipliers%log_abs(k)) > out_of_range) then
      words = told(multipliers, k, 10) // ", to " // concise(multipliers%error(k), 1) // " of it"
      return
    end if
    if (rho > 1.0e-4_dp .and. rho < 1.0e6_dp .and. bound > 1.0e-16_dp) then
      words = fixed(rho, min(max(ceiling(-log10(bound)), 4), 14))
    else
      words = concise(rho, 10)
    end if
    words = words // " +- " // concise(bound, 1)
  end function modulus

  !> What the results rest on.
  pure function evidence_lines(analysis, accuracy) result(lines)
    type(analysis_type), intent(in) :: analysis
    type(accuracy_type), intent(in) :: accuracy
    character(len=:), allocatable :: lines, known
    type(evidence_type) :: found

    call evidence(analysis%floquet, found)
    lines = ""
    if (found%methods == "averaged") then
      known = "to " // concise(found%error, 1) // " of its size"
      if (found%error >= 1) known = "is lost"
      lines = "  rests on            the AVERAGED model in closed form, nothing integrated; its matrix " &
        & // known // "," // newline // "                      " // text(found%evaluations) &
        & // " evaluations in all; trace's defect " // concise(abs(found%liouville_defect), 1) // newline
      return
    end if
    if (.not. allocated(analysis%multipliers)) lines = newline
    if (found%error >= 1) then
      lines = lines // "  rests on            nothing: Phi(T) is lost"
    else
      lines = lines // "  rests on            Phi(T) to " // concise(found%error, 1) // " of its size"
    end if
    if (accuracy%steps == 0) then
      lines = lines // " (" // concise(accuracy%tolerance, 2) // " was ordered)"
    else
      lines = lines // " (with the steps that were ordered)"
    end if
    lines = lines // ", by " // ways_taken(found) // "," // newline &
      & // "                      " // text(found%evaluations) // " evaluations in all; Liouville's defect " &
      & // concise(abs(found%liouville_defect), 1)
    if (allocated(analysis%multipliers)) lines = lines // "; condition of the multipliers at most " &
      & // concise(maxval(analysis%multipliers%condition), 2)
    if (found%parts > 1) lines = lines // newline // "                      " // text(found%parts) // &
      & " parts that do not act on each other were solved apart"
    if (accuracy%steps == 0 .and. found%error > accuracy%tolerance) lines = lines // newline // &
      & "                      the tolerance lies below what double precision can give here"
    lines = lines // newline
  end function evidence_lines

  !> The methods with their effort.
  pure function ways_taken(found) result(words)
    type(evidence_type), intent(in) :: found
    character(len=:), allocatable :: words

    words = ""
    if (found%steps > 0) words = found%methods // " with " // counted(found%steps, "step")
    if (found%factors > 0) words = words // " in " // counted(found%factors, "factor")
    if (found%steps > 0 .and. found%angles > 0) words = words // " and "
    if (found%angles > 0) words = words // "reduction on " // counted(found%angles, "angle")
  end function ways_taken

  !> Natural frequencies beside the crank speed: where resonance is near.
  pure function frequency_lines(frequencies, speed) result(lines)
    real(dp), intent(in) :: frequencies(:), speed
    character(len=:), allocatable :: lines
    real(dp) :: ratio, nearest
    integer :: k

    lines = newline // "NATURAL FREQUENCIES of the frame, mechanism's masses averaged over the turn" // newline // &
      & "         rad/s         Hz   x crank speed   nearest resonance" // newline
    do k = 1, size(frequencies)
      if (.not. frequencies(k) > 0) then
        lines = lines // text(k) // "  none: nothing holds the frame in this direction" // newline
        cycle
      end if
      ratio = frequencies(k) / speed
      nearest = max(1.0_dp, anint(ratio))
      lines = lines // text(k) // repeat(" ", 2 - len(text(k))) // padded(concise(frequencies(k)), 12) &
        & // padded(concise(frequencies(k) / (2 * pi)), 11) // padded(concise(ratio, 5), 16) // "   order " &
        & // concise(nearest, 9) // " at " // concise(frequencies(k) / nearest * 30 / pi, 5) // " rpm" &
        & // away(frequencies(k) / (nearest * speed) - 1)
      if (abs(ratio / nearest - 1) < near .and. nearest <= highest_order) lines = lines // "  <- near"
      lines = lines // newline
    end do
    lines = lines // parametric_lines(frequencies, speed)
  end function frequency_lines

  !> Sums of two natural frequencies that are close to a low multiple of the crank speed: there the periodic coefficients
  !> themselves can make free vibrations grow.
  pure function parametric_lines(frequencies, speed) result(lines)
    real(dp), intent(in) :: frequencies(:), speed
    character(len=:), allocatable :: lines
    integer, parameter :: highest = 3
    real(dp) :: ratio
    integer :: i, k

    lines = ""
    do i = 1, size(frequencies)
      do k = i, size(frequencies)
        if (.not. frequencies(i) > 0) cycle
        ratio = (frequencies(i) + frequencies(k)) / speed
        if (nint(min(ratio, 1.0e6_dp)) < 1 .or. nint(min(ratio, 1.0e6_dp)) > highest) cycle
        if (abs(ratio / nint(ratio) - 1) > near) cycle
        if (i == k) then
          lines = lines // "  twice frequency " // text(i) // " is "
        else
          lines = lines // "  frequencies " // text(i) // " and " // text(k) // " together are "
        end if
        lines = lines // concise(ratio, 4) // " x crank speed: near parametric resonance of order " // text(nint(ratio)) &
          & // newline
      end do
    end do
  end function parametric_lines

  !> How far a speed lies from the crank speed.
  pure function away(relative) result(words)
    real(dp), intent(in) :: relative
    character(len=:), allocatable :: words

    words = ", " // concise(100 * abs(relative), 2) // " % " // trim(merge("above", "below", relative > 0))
  end function away

  !> What the vibration resonates with.
  pure function resonance_lines(resonance) result(lines)
    type(resonance_type), intent(in) :: resonance
    character(len=:), allocatable :: lines

    call describe_resonance(resonance, lines)
    lines = "  near resonance: " // lines // newline
  end function resonance_lines

  pure function vibration_lines(vibration, frame, averaged, verdict) result(lines)
    type(vibration_type), intent(in) :: vibration
    class(frame_type), intent(in) :: frame
    logical, intent(in) :: averaged
    character(len=*), intent(in) :: verdict
    character(len=:), allocatable :: lines
    character(len=*), parameter :: names(9) = [character(len=22) :: "xi of F", "eta of F", "psi", "xi velocity", &
      & "eta velocity", "psi velocity", "force on ground, x", "force on ground, y", "moment on ground"]
    character(len=*), parameter :: units(9) = [character(len=6) :: "mm", "mm", "mrad", "mm/s", "mm/s", "mrad/s", "N", "N", "N m"]
    real(dp), parameter :: factors(9) = [1.0e3_dp, 1.0e3_dp, 1.0e3_dp, 1.0e3_dp, 1.0e3_dp, 1.0e3_dp, 1.0_dp, 1.0_dp, 1.0_dp]
    real(dp) :: noise
    integer :: i, order

    lines = section("PERIODIC VIBRATION", verdict) // &
      & "                              peak       error         rms           strongest order, its part of rms^2" // newline
    do i = 1, 9
      if (.not. any(frame%free == 1 + mod(i - 1, 3))) cycle
      associate (series => vibration%series(i))
        noise = noise_of(vibration%peak(i), vibration%peak_error(i), greatest_beside(vibration, frame, i))
        lines = lines // "  " // names(i) // padded(concise(factors(i) * noise * vibration%peak(i), 5), 10) &
          & // padded(concise(factors(i) * vibration%peak_error(i), 1), 12) &
          & // padded(concise(factors(i) * noise * vibration%rms(i), 5), 12) &
          & // "  " // units(i) // "  "
        order = maxloc(series%amplitude, dim=1)
        if (vibration%peak(i) > vibration%peak_error(i)) lines = lines // order_words(order, series%amplitude(order), &
          & vibration%rms(i))
        lines = lines // newline
      end associate
    end do
    if (any([(vibration%peak_error(frame%free(i)) >= vibration%peak(frame%free(i)) .and. vibration%peak(frame%free(i)) > 0 &
      & .and. noise_of(vibration%peak(frame%free(i)), vibration%peak_error(frame%free(i)), &
      & greatest_beside(vibration, frame, frame%free(i))) > 0, i = 1, size(frame%free))])) lines = lines // &
      & "  note: an error is as great as its peak, which tells nothing then; more steps, or a smaller tolerance, may" // newline
    if (averaged) then
      lines = lines // "  harmonic by harmonic: condition at worst " // concise(vibration%start%condition, 2) // ", costs " &
        & // concise(max(0.0_dp, log10(vibration%start%condition)), 2) // " digits" // newline
      return
    end if
    lines = lines // "  start x0 from (E - Phi) x0 = x_p(T): condition " // concise(vibration%start%condition, 2) // ", costs " &
      & // concise(max(0.0_dp, log10(vibration%start%condition)), 2) // " digits; motion closes after a turn to " &
      & // concise(vibration%closing_defect, 1) // newline
  end function vibration_lines

  !> The greatest peak of the kind of the `i`-th quantity, turns and moments made comparable by the frame's radius of gyration.
  pure real(dp) function greatest_beside(vibration, frame, i) result(greatest)
    type(vibration_type), intent(in) :: vibration
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: i
    real(dp) :: scale(3)
    integer :: first

    first = 3 * ((i - 1) / 3) + 1
    scale = 1
    if (frame%mass > 0 .and. frame%inertia > 0) scale(3) = sqrt(frame%inertia / frame%mass)
    if (first == 7) scale(3) = 1 / scale(3)
    greatest = maxval(vibration%peak(first:first + 2) * scale) / scale(i - first + 1)
  end function greatest_beside

end module gestell_task_report
