!> The report for people: what an engineer wants to read first.
module gestell_task_machine_report
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, fixed, text
  use gestell_base_version, only: version
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_solution, only: evidence, evidence_type, liouville_defect
  use gestell_task_common_configuration, only: configuration_type
  use gestell_base_words, only: on_one_line
  use gestell_input_machine_frame, only: values_out_of_the_plane
  use gestell_input_wording, only: counted
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_report_plausibility, only: slips
  use gestell_output_report_wrapping, only: wrapped
  use gestell_output_result, only: result_type
  use gestell_task_power_report, only: holder_line
  use gestell_task_machine_model, only: model_line
  use gestell_task_stability_report, only: modulus_of, out_of_range
  use gestell_model_frame, only: frame_type, dof_names
  use gestell_model_frame_gravity, only: gravity_of, sag_of, weighs, weight_of
  use gestell_model_linkage, only: linkage_type
  use gestell_study_vibration_analysis, only: analysis_type
  use gestell_study_vibration_held, only: unheld
  implicit none (type, external)
  private

  public :: evidence_lines, report_machine, slips_of, tolerance_note, verdict_lines, verdict_sentence, &
    & warn_of_slips

  character, parameter :: newline = new_line("a")

contains

  !> What was read: title, machine, drive. The input's name stays on its line, however long.
  function report_machine(configuration, input) result(report)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: input
    character(len=:), allocatable :: report

    associate (frame => configuration%frame)
      report = "Gestell " // version // newline // newline
      if (len(configuration%title) > 0) report = report // wrapped("  title      " // on_one_line(configuration%title) // newline)
      report = report // "  input      " // on_one_line(input) // newline
      if (allocated(configuration%impossible)) then
        report = report // wrapped("  mechanism  cannot turn as it stands in the input: " // configuration%impossible%message &
          & // newline)
      else
        report = report // wrapped(machine_lines(configuration))
      end if
    end associate
  end function report_machine

  function machine_lines(configuration) result(report)
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: report
    integer :: i

    associate (frame => configuration%frame)
      select type (mechanism => frame%mechanism)
      type is (linkage_type)
        report = "  mechanism  " // counted(size(mechanism%joints), "joint") // ", " &
          & // counted(size(mechanism%links), "link") // " of " // concise(mechanism%mass) &
          & // " kg in all; turns freely through " // text(360 * mechanism%turns) // " deg" // newline
      class default
        report = "  mechanism  " // concise(mechanism%mass) // " kg in all, by its mass functions" // newline
      end select
      report = report // "  frame      " // concise(frame%mass) // " kg, " // inertia_words(frame) // ", free in"
      do i = 1, size(frame%free)
        report = report // " " // trim(dof_names(frame%free(i)))
      end do
      report = report // newline // "  drive      " // concise(abs(frame%drive_rpm())) // " rpm " &
        & // trim(merge("counter-clockwise", "clockwise        ", frame%speed > 0)) // ", " &
        & // concise(frame%mechanism%turns / frame%period) // " Hz, period " // concise(frame%period) // " s" &
        & // period_words(frame%mechanism%turns) // newline &
        & // holder_line(frame%held_by) // gravity_line(frame) // warning_lines(slips_of(configuration))
      report = report // model_line(configuration%analysis)
    end associate
  end function machine_lines

  !> Lists probable errors of the input, one per line.
  function slips_of(configuration) result(lines)
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines

    lines = ""
    if (allocated(configuration%impossible)) return
    lines = trim(unheld(configuration%frame))
    if (lines /= "") lines = lines // newline
    lines = lines // slips(configuration%frame) // values_out_of_the_plane(configuration%document)
  end function slips_of

  !> Makes headlines of these lines, which the report has in its head.
  pure subroutine warn_of_slips(result, lines)
    type(result_type), intent(inout) :: result
    character(len=*), intent(in) :: lines
    integer :: first, last

    first = 1
    do while (first <= len(lines))
      last = first - 1 + index(lines(first:), newline)
      call result%warn("undecided", lines(first:last), said=.true.)
      first = last + 1
    end do
  end subroutine warn_of_slips

  !> These lines with their label.
  pure function warning_lines(lines) result(labelled)
    character(len=*), intent(in) :: lines
    character(len=:), allocatable :: labelled
    integer :: first, last

    labelled = ""
    first = 1
    do while (first <= len(lines))
      last = first - 1 + index(lines(first:), newline)
      labelled = labelled // "  warning    " // lines(first:last)
      first = last + 1
    end do
  end function warning_lines

  !> What weighs, and where to; nothing without gravity.
  pure function gravity_line(frame) result(line)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: line

    line = ""
    if (.not. weighs(frame)) return
    associate (g => gravity_of(frame))
      line = "  gravity    " // concise(norm2(g)) // " m/s^2 "
      if (abs(g(3)) > 0) then
        line = line // "along (" // listed(g / norm2(g)) // ")"
      else
        line = line // "at " // concise(atan2(g(2), g(1)) * 180 / pi, 4) // " deg"
      end if
    end associate
    line = line // "; all weighs " // concise(norm2(weight_of(frame)), 5) // " N"
    if (allocated(frame%space)) line = line // newline // "  static sag (" // listed(1000 * sag_of(frame)) // ") mm at F"
    line = line // newline
  end function gravity_line

  !> The moment of inertia about F, in space the three about xi, eta and zeta.
  pure function inertia_words(frame) result(words)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: words
    integer :: i

    if (allocated(frame%space)) then
      words = "(" // listed([(frame%space%inertia(i, i), i = 1, 3)]) // ") kg m^2 about (xi,eta,zeta)"
    else
      words = concise(frame%inertia) // " kg m^2"
    end if
  end function inertia_words

  pure function listed(values) result(words)
    real(dp), intent(in) :: values(3)
    character(len=:), allocatable :: words

    words = concise(values(1), 4) // "," // concise(values(2), 4) // "," // concise(values(3), 4)
  end function listed

  !> What is told of a period that is more than a turn.
  pure function period_words(turns) result(words)
    integer, intent(in) :: turns
    character(len=:), allocatable :: words

    words = ""
    if (turns > 1) words = ", " // turns_in_words(turns)
  end function period_words

  !> The verdict in a sentence; the period (s) is that many turns; `others`: what is said of other vibrations.
  pure function verdict_sentence(multipliers, period, in_period, others) result(words)
    type(multipliers_type), intent(in) :: multipliers
    real(dp), intent(in) :: period
    integer, intent(in) :: in_period
    character(len=*), intent(in) :: others
    character(len=:), allocatable :: words
    real(dp) :: turns

    words = trim(multipliers%verdict()) // ": "
    turns = log(2.0_dp) / max(abs(multipliers%log_abs(1)), tiny(1.0_dp))
    if (multipliers%unknown()) then
      words = words // "nothing is known of the multipliers, the steps ordered are too few"
      return
    end if
    select case (multipliers%verdict())
    case ("stable")
      if (multipliers%error(1) >= 1) then
        words = words // "free vibrations decay within " // turns_in_words(in_period) // ", the multipliers are lost in rounding"
      else
        words = words // "the slowest free vibration halves in " // concise(turns * in_period, 3) // " turns (" &
          & // concise(turns * period, 3) // " s)"
      end if
    case ("undamped")
      words = words // "free vibrations neither grow nor decay"
    case ("unstable")
      words = words // "a free vibration doubles in " // concise(turns * in_period, 3) // " turns (" &
        & // concise(turns * period, 3) // " s)"
    case default
      words = words // "the error bound reaches across |rho| = 1"
    end select
    words = words // others
  end function verdict_sentence

  !> What stands below it, of a period of so many turns. `unheld`: in which directions nothing holds the frame; `at_limit`: a
  !> smaller error of Phi(T) was ordered than double precision allows.
  pure function verdict_lines(multipliers, turns, unheld, at_limit) result(lines)
    type(multipliers_type), intent(in) :: multipliers
    integer, intent(in) :: turns
    character(len=*), intent(in) :: unheld
    logical, intent(in) :: at_limit
    character(len=:), allocatable :: lines
    character(len=:), allocatable :: word
    integer :: worst

    word = trim(multipliers%verdict())
    lines = ""
    if (multipliers%unknown()) then
      lines = "  with half and with twice these steps they differ: order more, or none and the tolerance decides" // newline
      return
    end if
    if (word == "stable" .and. multipliers%error(1) >= 1) return
    if (word == "unstable") lines = "  it " // manner(multipliers%arg(1), turns) // newline
    if (word == "undamped") lines = "  no damping; all multipliers are proved to lie on the unit circle (doc/theory.md)" // newline
    lines = lines // "  largest multiplier  |rho| = " // modulus(multipliers, 1) // newline
    if (word == "undecided") then
      worst = maxloc(multipliers%log_abs + log(1 + multipliers%error), dim=1)
      if (worst > 1) lines = lines // "  largest bound       |rho| = " // modulus(multipliers, worst) // newline
      if (unheld /= "") then
        lines = lines // "  " // unheld // newline
      else if (at_limit) then
        lines = lines // "  the error is that of rounding, so a smaller tolerance would not help: the machine lies on the " &
          & // "stability boundary, or small changes of its numbers change its multipliers much" // newline
      else
        lines = lines // "  either the tolerance is too coarse (set a smaller one in &accuracy), or the machine lies on the " &
          & // "stability boundary" // newline
      end if
    end if
  end function verdict_lines

  !> How the free vibration of a multiplier with that argument looks from turn to turn.
  pure function manner(arg, turns) result(words)
    real(dp), intent(in) :: arg
    integer, intent(in) :: turns
    character(len=:), allocatable :: words
    real(dp), parameter :: real_axis = 1.0e-6_dp

    if (abs(arg) < real_axis) then
      words = "repeats itself in every turn (divergence, or parametric resonance of even order)"
      if (turns > 1) words = "repeats itself after " // text(turns) // " turns (divergence, or parametric resonance)"
    else if (pi - abs(arg) < real_axis) then
      words = "changes its sign from turn to turn (parametric resonance of odd order)"
      if (turns > 1) words = "changes its sign in " // text(turns) // " turns (parametric resonance)"
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
      words = modulus_of(multipliers, k, 3) // ", lost: no digit of it is sure"
      return
    else if (abs(multipliers%log_abs(k)) > out_of_range) then
      words = modulus_of(multipliers, k, 10) // ", to " // concise(multipliers%error(k), 1) // " of it"
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
  function evidence_lines(analysis, accuracy) result(lines)
    type(analysis_type), intent(in) :: analysis
    type(accuracy_type), intent(in) :: accuracy
    character(len=:), allocatable :: lines, known
    type(evidence_type) :: found

    call evidence(analysis%floquet, found)
    if (found%methods == "averaged") then
      known = "to " // concise(found%error, 1) // " of its size"
      if (found%error >= 1) known = "is lost"
      lines = "  rests on            the AVERAGED model in closed form, nothing integrated; its matrix " &
        & // known // ", " // text(found%evaluations) // " evaluations in all; trace's defect " &
        & // defect_in_words(analysis) // newline
      return
    end if
    known = "Phi(T) to " // concise(found%error, 1) // " of its size"
    if (found%error >= 1) known = "nothing: Phi(T) is lost"
    lines = " (with the steps that were ordered)"
    if (accuracy%steps == 0) lines = " (" // concise(accuracy%tolerance, 2) // " was ordered)"
    lines = "  rests on            " // known // lines // ", by " // methods_used(found) // ", " // text(found%evaluations) &
      & // " evaluations in all; Liouville's defect " // defect_in_words(analysis)
    if (allocated(analysis%multipliers)) lines = lines // "; condition of the multipliers at most " &
      & // concise(maxval(analysis%multipliers%condition), 2)
    if (found%parts > 1) lines = lines // "; " // text(found%parts) // " parts that do not act on each other were solved apart"
    lines = lines // newline
  end function evidence_lines

  function defect_in_words(analysis) result(words)
    type(analysis_type), intent(in) :: analysis
    character(len=:), allocatable :: words
    type(error_type), allocatable :: error
    real(dp) :: defect

    call liouville_defect(analysis%frame, analysis%floquet, defect, error)
    words = concise(abs(defect), 1)
    if (allocated(error)) words = "unknown: " // error%message
  end function defect_in_words

  !> Where the results are less accurate than was ordered.
  function tolerance_note(analysis, accuracy) result(line)
    type(analysis_type), intent(in) :: analysis
    type(accuracy_type), intent(in) :: accuracy
    character(len=:), allocatable :: line
    type(evidence_type) :: found

    call evidence(analysis%floquet, found)
    line = ""
    if (found%methods /= "averaged" .and. accuracy%steps == 0 .and. found%error > accuracy%tolerance) line = "  note: the " &
      & // "tolerance lies below what double precision can give here; Phi(T) is known to " // concise(found%error, 1) &
      & // " of its size" // newline
  end function tolerance_note

  !> The methods with their effort.
  pure function methods_used(found) result(words)
    type(evidence_type), intent(in) :: found
    character(len=:), allocatable :: words

    words = ""
    if (found%steps > 0) words = found%methods // " with " // counted(found%steps, "step")
    if (found%factors > 0) words = words // " in " // counted(found%factors, "factor")
    if (found%steps > 0 .and. found%angles > 0) words = words // " and "
    if (found%angles > 0) words = words // "reduction on " // counted(found%angles, "angle")
  end function methods_used

end module gestell_task_machine_report
