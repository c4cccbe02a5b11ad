!> Writes the first part of the report: description of the machine, verdict and accuracy.
module gestell_task_machine_report
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise, either, fixed, newline, text
  use gestell_base_version, only: version
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_solution, only: evidence, evidence_type, liouville_defect
  use gestell_task_common_configuration, only: configuration_type
  use gestell_base_words, only: on_one_line
  use gestell_base_verdict, only: operator(==), stable, undamped, undecided, unstable, verdict_type
  use gestell_input_machine_frame, only: note_on_ignored_values
  use gestell_input_wording, only: counted
  use gestell_output_report_orders, only: turns_in_words
  use gestell_output_report_plausibility, only: implausible_values
  use gestell_output_report_text_table, only: listed
  use gestell_output_report_in_units, only: lay_out
  use gestell_output_report_wrapping, only: wrapped
  use gestell_task_stability_report, only: modulus_of, out_of_range
  use gestell_model_frame, only: frame_type, dof_names
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_load, only: ground_body
  use gestell_study_vibration_analysis, only: analysis_type
  use gestell_study_frame_model, only: newton_type
  use gestell_study_vibration_free_directions, only: describe_free_directions
  implicit none (type, external)
  private

  public :: model_warning, evidence_lines, newton_line, report_machine, input_warnings, tolerance_note, verdict_lines, &
    & verdict_sentence

contains

  !> Lines on the input: title, file, machine and drive. The file name is not wrapped, however long it is.
  function report_machine(configuration, input) result(report)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: input
    character(len=:), allocatable :: report, lines

    report = "Gestell " // version // newline // newline
    if (len(configuration%title) > 0) report = report // wrapped("  title      " // on_one_line(configuration%title) // newline)
    report = report // "  input      " // on_one_line(input) // newline
    if (allocated(configuration%impossible)) then
      report = report // wrapped("  mechanism  cannot turn with the values of the input: " // configuration%impossible%message &
        & // newline)
    else
      call lay_out(machine_lines(configuration), configuration%result_units, lines)
      report = report // lines
    end if
  end function report_machine

  !> Lines on the mechanism, the frame, the drive, gravity, probable typing errors and the model.
  function machine_lines(configuration) result(report)
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: report, warnings
    integer :: i

    associate (frame => configuration%frame)
      select type (mechanism => frame%mechanism)
      type is (linkage_type)
        report = "  mechanism  " // counted(size(mechanism%joints), "joint") // ", " &
          & // counted(size(mechanism%links), "link") // " of " // concise(mechanism%mass) &
          & // " kg in total; turns freely through " // text(360 * mechanism%turns) // " deg" // newline
      class default
        report = "  mechanism  " // concise(mechanism%mass) // " kg in total, given by mass functions" // newline
      end select
      report = report // "  frame      " // concise(frame%mass) // " kg, "
      if (frame%dofs() > 3) then
        report = report // "(" // listed(frame%moments_of_inertia(), 4, ",") // ") kg m^2 about (xi,eta,zeta)"
      else
        report = report // concise(frame%inertia) // " kg m^2"
      end if
      report = report // ", free in"
      do i = 1, size(frame%free)
        report = report // " " // trim(dof_names(frame%free(i)))
      end do
      report = report // newline // "  drive      " // concise(abs(frame%drive_rpm())) // " rpm " &
        & // either("counter-clockwise", "clockwise", frame%speed > 0) // ", " &
        & // concise(frame%mechanism%turns / frame%period) // " Hz, period " // concise(frame%period) // " s" &
        & // either(", " // turns_in_words(frame%mechanism%turns), "", frame%mechanism%turns > 1) // newline
      select case (frame%held_by)
      case ("flywheel")
        report = report // "  flywheel   constant absolute speed; only the mean torque acts on the frame" // newline
      case ("outside")
        report = report // "  motor      beside the machine: constant absolute speed, no torque on the frame" // newline
      case default
        report = report // "  motor      on the frame: relative speed constant, torque acts on the frame" // newline
      end select
      report = report // load_lines(frame) // gravity_line(frame)
      warnings = input_warnings(configuration)
      do while (warnings /= "")
        i = index(warnings, newline)
        report = report // "  warning    " // warnings(:i)
        warnings = warnings(i + 1:)
      end do
      if (configuration%analysis%averaged) then
        report = report // "  model      averaged: means of the matrices M, B, C, but not of the load h(t)" // newline
      else if (configuration%analysis%model == "exact") then
        report = report // "  model      exact: valid for any frame rotation; stability about the vibration" // newline
      else if (configuration%analysis%model == "first_order") then
        report = report // "  model      first_order: linearised vibration; stability about this vibration" // newline
      else
        report = report // "  model      rest: linearised about rest; &model frame='exact' is more accurate" // newline
      end if
    end associate
  end function machine_lines

  !> Lists probable typing errors in the input, with one line for each.
  function input_warnings(configuration) result(lines)
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines

    lines = ""
    if (allocated(configuration%impossible)) return
    lines = trim(describe_free_directions(configuration%frame))
    if (lines /= "") lines = lines // newline
    lines = lines // implausible_values(configuration%frame) // note_on_ignored_values(configuration%document)
  end function input_warnings

  !> Lines on the loads: what they move depends on what keeps the speed constant.
  function load_lines(frame) result(lines)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: lines, within, outside
    integer :: i

    lines = ""
    within = ""
    outside = ""
    select type (mechanism => frame%mechanism)
    type is (linkage_type)
      if (.not. allocated(mechanism%loads)) return
      do i = 1, size(mechanism%loads)
        associate (load => mechanism%loads(i))
          if (load%against == ground_body) outside = outside // ", " // load%name
          if (load%against /= ground_body) within = within // ", " // load%name
        end associate
      end do
    end select
    if (within /= "") then
      lines = "  load       " // within(3:) // ": within the machine; changes the driving torque"
      select case (frame%held_by)
      case ("flywheel")
        lines = lines // ", whose fluctuation moves the frame" // newline
      case ("outside")
        lines = lines // ", and all of this change acts on the frame" // newline
      case default
        lines = lines // ", does not move the frame" // newline
      end select
    end if
    if (outside /= "") lines = lines // "  load       " // outside(3:) // ": against the ground; moves the frame" // newline
  end function load_lines

  !> Lines on gravity, total weight and, in space, static deflection; empty if there is no gravity.
  pure function gravity_line(frame) result(line)
    class(frame_type), intent(in) :: frame
    character(len=:), allocatable :: line

    line = ""
    if (.not. frame%weights%act) return
    associate (g => frame%weights%gravity)
      line = "  gravity    " // concise(norm2(g)) // " m/s^2 "
      if (abs(g(3)) > 0) then
        line = line // "along (" // listed(g / norm2(g), 4, ",") // ")"
      else
        line = line // "at " // concise(atan2(g(2), g(1)) * 180 / pi, 4) // " deg"
      end if
    end associate
    line = line // "; total weight " // concise(norm2(frame%weights%weight), 5) // " N"
    if (frame%dofs() > 3) line = line // newline // "  static deflection of F: (" &
      & // listed(1000 * frame%weights%sag(:3), 4, ",") // ") mm"
    line = line // newline
  end function gravity_line

  !> Sentence with the verdict, and with the rate at which disturbances grow or decay.
  pure function verdict_sentence(multipliers, period, period_turns, other_vibrations) result(words)
    type(multipliers_type), intent(in) :: multipliers
    !> Period (s)
    real(dp), intent(in) :: period
    !> Number of turns that the crank makes in the period
    integer, intent(in) :: period_turns
    !> Text on other vibrations of the machine, which is appended to the sentence
    character(len=*), intent(in) :: other_vibrations
    character(len=:), allocatable :: words
    type(verdict_type) :: verdict
    real(dp) :: turns

    verdict = multipliers%judge()
    words = trim(verdict%word()) // ": "
    turns = log(2.0_dp) / max(abs(multipliers%log_abs(1)), tiny(1.0_dp))
    if (multipliers%unknown()) then
      words = words // "too few steps in &accuracy to determine the multipliers"
      return
    end if
    if (verdict == stable) then
      if (multipliers%error(1) >= 1) then
        words = words // "disturbances decay within " // turns_in_words(period_turns) &
          & // ": all multipliers are smaller than their rounding errors"
      else
        words = words // "disturbances halve within " // concise(turns * period_turns, 3) // " turns (" &
          & // concise(turns * period, 3) // " s)"
      end if
    else if (verdict == undamped) then
      words = words // "disturbances neither grow nor decay"
    else if (verdict == unstable) then
      words = words // "a disturbance doubles in " // concise(turns * period_turns, 3) // " turns (" &
        & // concise(turns * period, 3) // " s)"
    else
      words = words // "the error bound of a multiplier reaches across |rho| = 1"
    end if
    words = words // other_vibrations
  end function verdict_sentence

  !> Lines below the verdict: the largest multiplier, the kind of instability, and the reason if the verdict is undecided.
  pure function verdict_lines(multipliers, turns, free_directions, at_precision_limit) result(lines)
    type(multipliers_type), intent(in) :: multipliers
    !> Number of turns that the crank makes in the period
    integer, intent(in) :: turns
    !> Text on directions in which the mounting does not hold the frame; empty if it holds in all directions
    character(len=*), intent(in) :: free_directions
    !> True if the monodromy matrix Phi(T) cannot reach the requested tolerance because of rounding errors
    logical, intent(in) :: at_precision_limit
    character(len=:), allocatable :: lines
    type(verdict_type) :: verdict
    integer :: worst

    verdict = multipliers%judge()
    lines = ""
    if (multipliers%unknown()) then
      lines = "  half and twice the given number of steps yield different multipliers: increase &accuracy steps, or replace it " &
        & // "by tolerance" // newline
      return
    end if
    if (verdict == stable .and. multipliers%error(1) >= 1) return
    if (verdict == unstable) lines = "  the disturbance " // growth_pattern(multipliers%arg(1), turns) // newline
    if (verdict == undamped) lines = "  no damping: all multipliers provably lie on the unit circle (doc/theory.md)" // newline
    lines = lines // "  largest multiplier  |rho| = " // modulus(multipliers, 1) // newline
    if (verdict == undecided) then
      worst = maxloc(multipliers%log_abs + log(1 + multipliers%error), dim=1)
      if (worst > 1) lines = lines // "  most critical       |rho| = " // modulus(multipliers, worst) // newline
      if (free_directions /= "") then
        lines = lines // "  " // free_directions // newline
      else if (at_precision_limit) then
        lines = lines // "  only rounding errors remain, so a smaller tolerance would not help: the machine lies on the " &
          & // "stability boundary, or its multipliers are very sensitive to its data" // newline
      else
        lines = lines // "  either the tolerance is too coarse (set a smaller one in &accuracy), or the machine lies on the " &
          & // "stability boundary" // newline
      end if
    end if
  end function verdict_lines

  !> Text on how a disturbance changes from period to period if its multiplier has the argument `arg` (rad).
  pure function growth_pattern(arg, turns) result(words)
    real(dp), intent(in) :: arg
    integer, intent(in) :: turns
    character(len=:), allocatable :: words
    real(dp), parameter :: real_axis = 1.0e-6_dp

    if (abs(arg) < real_axis) then
      words = either("repeats after " // text(turns) // " turns (divergence, or parametric resonance)", &
        & "repeats every turn (divergence, or parametric resonance of even order)", turns > 1)
    else if (pi - abs(arg) < real_axis) then
      words = either("changes sign every " // text(turns) // " turns (parametric resonance)", &
        & "changes sign every turn (parametric resonance of odd order)", turns > 1)
    else
      words = "is not synchronous with the crank (flutter, or combination resonance)"
    end if
  end function growth_pattern

  !> Modulus of multiplier number `k` with as many digits as its error bound supports, followed by this bound. If the modulus
  !> overflows or underflows double precision, it is printed as a power of e.
  pure function modulus(multipliers, k) result(words)
    type(multipliers_type), intent(in) :: multipliers
    integer, intent(in) :: k
    character(len=:), allocatable :: words
    real(dp) :: rho, bound

    rho = abs(multipliers%rho(k))
    bound = rho * multipliers%error(k)
    if (multipliers%error(k) >= 1) then
      words = modulus_of(multipliers, k, 3) // ": no digit is reliable"
    else if (abs(multipliers%log_abs(k)) > out_of_range) then
      words = modulus_of(multipliers, k, 10) // " with a relative error of at most " // concise(multipliers%error(k), 1)
    else if (rho > 1.0e-4_dp .and. rho < 1.0e6_dp .and. bound > 1.0e-16_dp) then
      words = fixed(rho, min(max(ceiling(-log10(bound)), 4), 14)) // " +- " // concise(bound, 1)
    else
      words = concise(rho, 10) // " +- " // concise(bound, 1)
    end if
  end function modulus

  !> Lines on the numerical solution: method, number of steps, error of the monodromy matrix Phi(T), defect of Liouville's formula,
  !> and condition of the multipliers.
  function evidence_lines(analysis, accuracy) result(lines)
    type(analysis_type), intent(in) :: analysis
    type(accuracy_type), intent(in) :: accuracy
    character(len=:), allocatable :: lines
    type(evidence_type) :: facts

    call evidence(analysis%floquet, facts)
    if (facts%methods == "averaged") then
      lines = "  accuracy            averaged model solved in closed form, without integration; " &
        & // either("the state transition matrix has no reliable digit", "relative error of the state transition matrix at most " &
        & // concise(facts%error, 1), facts%error >= 1) // ", " // text(facts%evaluations) // " evaluations; Liouville's defect " &
        & // defect_in_words(analysis) // newline
      return
    end if
    lines = "  accuracy            " // either("Phi(T) has no reliable digit", "relative error of Phi(T) at most " &
      & // concise(facts%error, 1), facts%error >= 1) // " (" // either("tolerance " // concise(accuracy%tolerance, 2), &
      & "number of steps given", accuracy%steps == 0) // "), by "
    if (facts%steps > 0) lines = lines // facts%methods // " with " // counted(facts%steps, "step")
    if (facts%factors > 0) lines = lines // " in " // counted(facts%factors, "factor")
    if (facts%steps > 0 .and. facts%angles > 0) lines = lines // " and "
    if (facts%angles > 0) lines = lines // "reduction on " // counted(facts%angles, "angle")
    lines = lines // ", " // text(facts%evaluations) // " evaluations; Liouville's defect " // defect_in_words(analysis)
    if (allocated(analysis%multipliers)) lines = lines // "; condition number of multipliers at most " &
      & // concise(maxval(analysis%multipliers%condition), 2)
    if (facts%parts > 1) lines = lines // "; " // text(facts%parts) // " decoupled subsystems were solved separately"
    lines = lines // newline
  end function evidence_lines

  !> The defect of Liouville's formula as text, or the reason why it cannot be computed.
  function defect_in_words(analysis) result(words)
    type(analysis_type), intent(in) :: analysis
    character(len=:), allocatable :: words
    type(error_type), allocatable :: error
    real(dp) :: defect

    call liouville_defect(analysis%frame, analysis%floquet, defect, error)
    words = concise(abs(defect), 1)
    if (allocated(error)) words = "unknown: " // error%message
  end function defect_in_words

  !> Note that double precision does not suffice for the tolerance; empty if the tolerance was reached.
  function tolerance_note(analysis, accuracy) result(line)
    type(analysis_type), intent(in) :: analysis
    type(accuracy_type), intent(in) :: accuracy
    character(len=:), allocatable :: line
    type(evidence_type) :: facts

    call evidence(analysis%floquet, facts)
    line = ""
    if (facts%methods /= "averaged" .and. accuracy%steps == 0 .and. facts%error > accuracy%tolerance) line = "  note: the " &
      & // "tolerance cannot be reached in double precision; the relative error of Phi(T) is at most " // concise(facts%error, 1) &
      & // newline
  end function tolerance_note

  !> Line that lists the relative steps of Newton's method for the vibration of the exact frame. Empty if the model does not use
  !> this method.
  pure function newton_line(newton) result(line)
    type(newton_type), intent(in) :: newton
    character(len=:), allocatable :: line
    integer :: k

    line = ""
    if (.not. allocated(newton%steps)) return
    line = "  vibration           solved by Newton's method; size of its steps relative to the motion:"
    do k = 1, size(newton%steps)
      line = line // either(",", "", k > 1) // " " // concise(newton%steps(k), 1)
    end do
    if (newton%followed) line = line // "; found by continuation from rest or from another speed; other vibrations may exist"
    line = line // newline
  end function newton_line

  !> Line that warns that the cheaper `model` is not accurate enough, because the exact model gives another result. Empty if the
  !> models agree, in which case `exact` is not allocated.
  pure function model_warning(exact, model) result(line)
    type(multipliers_type), intent(in), allocatable :: exact
    character(len=*), intent(in) :: model
    character(len=:), allocatable :: line

    line = ""
    if (.not. allocated(exact)) return
    line = "  BUT frame='" // model // "' is not accurate enough: linearised about the vibration, the machine is " &
      & // trim(exact%verdict()) // ", |rho| = " // modulus_of(exact, 1, 7) // "; use &model frame='exact'" // newline
  end function model_warning

end module gestell_task_machine_report
