!> What the program does with an input file.
module driver
  use bordering, only: run_borders
  use cli, only: options_type
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_base_version, only: version
  use gestell_io_campaign, only: campaign_type
  use gestell_io_check, only: check_document
  use gestell_io_configuration, only: configuration_type, read_configuration
  use gestell_io_document, only: document_type
  use gestell_io_findings, only: report_findings, write_findings
  use gestell_io_folder, only: make_folder
  use gestell_io_mechanism_csv, only: write_mechanism
  use gestell_io_namelist, only: read_document
  use gestell_io_path, only: set_value
  use gestell_io_plot_sweep, only: plot_sweep
  use gestell_io_report, only: report_machine, report_results
  use gestell_io_report_borders, only: report_borders, report_search
  use gestell_io_report_mechanism, only: report_mechanism, report_transmission
  use gestell_io_report_trade, only: report_model, report_trade
  use gestell_io_report_sweep, only: report_grid, report_sweep
  use gestell_io_results, only: write_results, write_trade
  use gestell_io_schema, only: input_schema, schema_type
  use gestell_io_sweep_summary, only: summary_type
  use gestell_io_text, only: counted
  use one_line, only: print_case, print_sweep
  use over_modes, only: run_over_modes
  use plotting, only: draw_pictures, find_gnuplot
  use sweeping, only: compute_tiles, open_sweep
  use terminal, only: show_progress
  use gestell_study_boundary_task, only: border_results_type
  use gestell_study_analysis, only: analyse, analysis_type
  use gestell_study_findings, only: find, findings_type
  use gestell_study_model_trade, only: measure_model, model_trade_type
  use gestell_study_tile_results, only: stable, verdict
  use gestell_study_trade, only: measure_trade, trade_type
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none (type, external)
  private

  public :: folder_name, preamble, read_input, run

  !> Exit code of a run with --fail-if-unstable whose verdict is not stable.
  integer, parameter, public :: not_stable = 10

  !> Seconds that measuring the trade may take, about.
  real(dp), parameter :: trade_budget = 10

contains

  !> Reads, computes, reports and writes what the options and the input ask for. `code` is 0 or `not_stable`.
  subroutine run(options, code, error)
    type(options_type), intent(in) :: options
    integer, intent(out) :: code
    type(error_type), allocatable, intent(out) :: error
    type(configuration_type) :: configuration
    type(error_type), allocatable :: failure
    type(border_results_type) :: borders
    type(summary_type) :: summary
    character(len=:), allocatable :: folder, report

    code = 0
    if (options%plot) call find_gnuplot(error)
    if (.not. allocated(error)) call read_input(options, configuration, error)
    if (allocated(error)) return
    call check_options(options, configuration, error)
    if (allocated(error)) return
    if (.not. (options%quiet .or. options%one_line)) write (output_unit, "(a)", advance="no") &
      & report_machine(configuration, options%input)
    folder = folder_name(options)
    if (options%check) then
      if (.not. options%quiet) call report_check(configuration)
      if (options%plot) call draw(options, configuration, folder, error)
      return
    end if
    if (configuration%single() .and. .not. (options%in_parts .or. options%merge)) then
      call run_single(options, configuration, folder, code, failure, error)
      if (allocated(error)) return
    end if
    if (configuration%sweep) call run_sweep(options, configuration, folder, code, summary, error)
    if (allocated(error)) return
    if (configuration%boundary .and. .not. (options%in_parts .or. options%merge .or. options%one_line)) then
      call run_borders(configuration, folder, preamble(options, configuration), borders, error)
      if (configuration%sweep .and. allocated(borders%map) .and. .not. allocated(error)) call plot_sweep(folder, &
        & preamble(options, configuration), configuration%plan%paths, configuration%plan%grid, &
        & configuration%plan%order%columns, summary, error, borders%map%curves)
      if (allocated(error)) return
      if (.not. options%quiet) write (output_unit, "(a)", advance="no") &
        & report_search(configuration%plan) // report_borders(configuration%plan, borders)
    end if
    if (configuration%campbell .or. configuration%critical) then
      call run_over_modes(configuration, folder, preamble(options, configuration), report, error)
      if (allocated(error)) return
      if (.not. (options%quiet .or. options%one_line)) write (output_unit, "(a)", advance="no") report
    end if
    if (.not. (options%quiet .or. options%one_line)) write (output_unit, "(/, a)") "files in " // folder // "/"
    if (options%plot) call draw(options, configuration, folder, error)
    if (allocated(error)) return
    ! The verdict stands even where the vibration could not be computed.
    if (code == 0 .and. allocated(failure)) call move_alloc(failure, error)
  end subroutine run

  !> What --check tells.
  subroutine report_check(configuration)
    type(configuration_type), intent(in) :: configuration

    if (.not. allocated(configuration%impossible)) write (output_unit, "(a)", advance="no") &
      & report_mechanism(configuration%frame)
    if (configuration%sweep) write (output_unit, "(a)", advance="no") report_grid(configuration%plan)
    if (configuration%boundary) write (output_unit, "(a)", advance="no") report_search(configuration%plan)
    write (output_unit, "(/, a)") "The input is sound; nothing more was computed (--check)."
  end subroutine report_check

  !> The pictures of a run; with --check the mechanism's alone. Errors: the mechanism's files cannot be written; gnuplot fails.
  subroutine draw(options, configuration, folder, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: drawn

    if (.not. (allocated(configuration%impossible) .or. options%merge)) then
      call make_folder(folder, error)
      if (.not. allocated(error)) call write_mechanism(folder, preamble(options, configuration), configuration%frame, error)
      if (allocated(error)) return
    end if
    call draw_pictures(folder, options%check, drawn, error)
    if (allocated(error) .or. options%quiet) return
    if (drawn == "") drawn = "none"
    write (output_unit, "(a)") "pictures in " // folder // "/, .svg and .png: " // drawn
  end subroutine draw

  !> What the options ask of the input's tasks. Error: wrong usage.
  subroutine check_options(options, configuration, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    type(error_type), allocatable, intent(out) :: error

    associate (tasks => configuration%tasks)
      if ((options%in_parts .or. options%merge) .and. .not. configuration%sweep) then
        call fatal_error(error, "--part and --merge need the task 'sweep'", wrong_usage)
      else if (options%one_line .and. .not. (configuration%sweep .or. tasks%stability .or. tasks%modes .or. tasks%response)) then
        call fatal_error(error, "--one-line needs a task 'stability', 'modes', 'response' or 'sweep'", wrong_usage)
      end if
    end associate
    if (allocated(error) .or. .not. options%fail_if_unstable) return
    if (.not. (configuration%tasks%stability .or. configuration%sweep)) then
      call fatal_error(error, "--fail-if-unstable needs the task 'stability' or 'sweep'", wrong_usage)
    else if (configuration%sweep) then
      if (.not. configuration%plan%order%columns(verdict)) call fatal_error(error, "--fail-if-unstable needs the column " // &
        & "'verdict' of the sweep", wrong_usage)
    end if
  end subroutine check_options

  !> The machine of the input itself. `failure`: what the verdict does not depend on could not be computed.
  subroutine run_single(options, configuration, folder, code, failure, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder
    integer, intent(inout) :: code
    type(error_type), allocatable, intent(out) :: failure, error
    type(analysis_type) :: analysis
    type(trade_type) :: trade
    type(model_trade_type) :: model_trade
    type(findings_type) :: findings
    real(dp), allocatable :: frequencies(:)

    if (configuration%trade) then
      call measure_trade(configuration%frame, trade_budget, trade, error, show_progress)
      if (.not. allocated(error)) call measure_model(configuration%frame, configuration%accuracy, model_trade, error)
      if (allocated(error)) return
    end if
    call analyse(configuration%frame, configuration%tasks, configuration%accuracy, analysis, failure)
    if (allocated(failure) .and. .not. allocated(analysis%multipliers)) then
      call move_alloc(failure, error)
      return
    end if
    if (options%one_line) then
      if (.not. configuration%sweep) call print_case(options%settings, configuration, analysis, error)
      if (allocated(error)) return
      call take_verdict(options, configuration, analysis, code)
      return
    end if
    if (allocated(analysis%vibration)) call find(configuration%frame, analysis%vibration, &
      & configuration%probes(:merge(size(configuration%probes), 0, configuration%tasks%response)), configuration%forces, &
      & configuration%power, findings)
    if (.not. options%quiet) then
      call configuration%frame%natural_frequencies(frequencies, error)
      if (allocated(error)) return
      write (output_unit, "(a)", advance="no") report_transmission(configuration%frame) &
        & // report_results(configuration, analysis, frequencies) // report_findings(findings)
      if (configuration%trade) write (output_unit, "(a)", advance="no") report_trade(trade) // report_model(model_trade)
    end if

    call make_folder(folder, error)
    if (allocated(error)) return
    call write_results(folder, preamble(options, configuration), configuration%frame, configuration%tasks, analysis, error)
    if (allocated(error)) return
    call write_findings(folder, preamble(options, configuration), findings, configuration%tasks%harmonics, error)
    if (allocated(error)) return
    if (configuration%trade) call write_trade(folder, preamble(options, configuration), trade, model_trade, error)
    if (configuration%drawing .and. .not. allocated(error)) call write_mechanism(folder, preamble(options, configuration), &
      & configuration%frame, error)
    if (allocated(error)) return
    call take_verdict(options, configuration, analysis, code)
  end subroutine run_single

  !> The exit code of --fail-if-unstable.
  subroutine take_verdict(options, configuration, analysis, code)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    type(analysis_type), intent(in) :: analysis
    integer, intent(inout) :: code

    if (.not. (options%fail_if_unstable .and. configuration%tasks%stability)) return
    if (analysis%multipliers%verdict() /= "stable") code = not_stable
  end subroutine take_verdict

  !> The points of a sweep: all, a part of them, or only the file.
  subroutine run_sweep(options, configuration, folder, code, summary, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder
    integer, intent(inout) :: code
    type(summary_type), intent(out) :: summary
    type(error_type), allocatable, intent(out) :: error
    type(campaign_type) :: campaign
    logical, allocatable :: mine(:)

    if (options%one_line) then
      call print_sweep(configuration, summary, error)
    else
      call open_sweep(configuration, folder, options%part, options%parts, campaign, mine, error)
      if (allocated(error)) return
      if (.not. options%quiet) write (output_unit, "(a)", advance="no") report_grid(configuration%plan)
      if (.not. options%merge) call compute_tiles(configuration%plan, campaign, mine, error)
      if (allocated(error)) return
      if (options%in_parts) then
        if (.not. options%quiet) write (output_unit, "(/, a)") "Part " // text(options%part) // " of " // text(options%parts) &
          & // ": " // counted(count(mine), "tile") // " done; --merge writes sweep.csv when all parts are."
        return
      end if
      call campaign%finish(preamble(options, configuration), summary, error)
      if (allocated(error)) return
      if (.not. options%quiet) write (output_unit, "(a)", advance="no") report_sweep(configuration%plan, summary)
    end if
    if (options%fail_if_unstable .and. any(summary%verdicts(stable + 1:) > 0)) code = not_stable
  end subroutine run_sweep

  subroutine read_input(options, configuration, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(schema_type) :: schema
    integer :: i

    schema = input_schema()
    call read_document(options%input, doc, error)
    if (allocated(error)) return
    do i = 1, size(options%settings)
      call set_value(doc, schema, options%settings(i)%assignment, error)
      if (allocated(error)) return
    end do
    call check_document(doc, schema, error)
    if (allocated(error)) return
    call read_configuration(doc, configuration, error)
  end subroutine read_input

  !> The folder for the results: as ordered, or the input's name without folders and ending.
  pure function folder_name(options) result(folder)
    type(options_type), intent(in) :: options
    character(len=:), allocatable :: folder
    integer :: dot

    if (allocated(options%output)) then
      folder = options%output
      return
    end if
    folder = options%input(index(options%input, "/", back=.true.) + 1:)
    dot = index(folder, ".", back=.true.)
    if (dot > 1) then
      folder = folder(:dot - 1)
    else
      folder = folder // ".results"
    end if
  end function folder_name

  !> The # lines that head every file. Control characters, as ends of lines, become blanks.
  pure function preamble(options, configuration) result(lines)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines(:)
    integer :: i, k, width

    width = max(len("title: " // configuration%title), len("input: " // options%input), 40)
    do i = 1, size(options%settings)
      width = max(width, len("set: " // options%settings(i)%assignment))
    end do
    allocate(character(len=width) :: lines(3 + size(options%settings)))
    lines(1) = "title: " // configuration%title
    lines(2) = "version: gestell " // version
    lines(3) = "input: " // options%input
    do i = 1, size(options%settings)
      lines(3 + i) = "set: " // options%settings(i)%assignment
    end do
    do i = 1, size(lines)
      do k = 1, width
        if (lines(i)(k:k) < " ") lines(i)(k:k) = " "
      end do
    end do
  end function preamble

end module driver
