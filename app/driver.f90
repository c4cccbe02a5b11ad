!> What the program does with an input file.
module driver
  use bordering, only: run_borders
  use cli, only: options_type
  use console, only: console_type
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_text, only: text
  use gestell_base_version, only: version
  use gestell_task_sweep_checkpoint, only: campaign_type
  use gestell_input_schema_check, only: check_document
  use gestell_task_configuration, only: configuration_type, read_configuration
  use gestell_input_namelist_document, only: document_type
  use gestell_task_drawing_csv, only: write_mechanism
  use gestell_task_page, only: write_html
  use gestell_input_namelist, only: read_document
  use gestell_input_schema_path, only: set_value
  use gestell_task_sweep_plot, only: plot_sweep
  use gestell_task_report, only: report_frequencies, report_machine
  use gestell_task_boundary_report, only: report_borders, report_search
  use gestell_task_drawing_report, only: report_mechanism
  use gestell_task_sweep_report, only: report_grid, report_sweep
  use gestell_input_schema, only: schema_type
  use gestell_task_keys, only: input_schema
  use gestell_output_file_staging, only: open_staging, staging_type
  use gestell_task_sweep_summary, only: summary_type
  use gestell_base_wording, only: counted, on_one_line
  use one_line, only: print_sweep
  use over_modes, only: run_over_modes
  use plotting, only: draw_pictures
  use resonating, only: run_resonance
  use sensing, only: run_sensitivity
  use single_machine, only: run_single, single_results_type
  use sweeping, only: compute_tiles, open_sweep
  use gestell_task_boundary_task, only: border_results_type
  use gestell_study_tile_results, only: stable, verdict_column
  implicit none (type, external)
  private

  public :: folder_name, preamble, read_input, run

  !> Exit code of a run with --fail-if-unstable whose verdict is not stable.
  integer, parameter, public :: not_stable = 10

  character, parameter :: newline = new_line("a")

contains

  !> Reads, computes, reports and writes what the options and the input ask for. `code` is 0 or `not_stable`. The files take
  !> their places together, in the end; where the computation failed, those of what was computed before.
  subroutine run(options, code, error)
    type(options_type), intent(in) :: options
    integer, intent(out) :: code
    type(error_type), allocatable, intent(out) :: error
    type(configuration_type) :: configuration
    type(campaign_type) :: campaign
    type(staging_type) :: staging
    type(console_type) :: console
    character(len=:), allocatable :: folder, closing
    logical :: unwritten

    code = 0
    call read_input(options, configuration, error)
    if (allocated(error)) return
    call check_options(options, configuration, error)
    if (allocated(error)) return
    folder = folder_name(options)
    if (.not. (options%one_line .or. options%in_parts .or. options%check .and. .not. options%plot)) then
      call open_staging(staging, folder, error)
    end if
    if (allocated(error)) return
    console%silent = options%quiet .or. options%one_line
    call console%say(report_machine(configuration, options%input))
    closing = ""
    if (options%check) then
      call report_check(configuration, console)
      if (options%plot) call draw(options, configuration, folder, staging%place, closing, error)
    else
      call run_tasks(options, configuration, folder, staging, campaign, console, closing, code, error)
    end if
    if (allocated(staging%place)) call settle(staging, campaign, error)
    unwritten = .false.
    if (allocated(error)) unwritten = error%unwritten
    if (.not. unwritten) call console%say(closing)
    if (.not. allocated(error) .and. allocated(console%error)) call move_alloc(console%error, error)
  end subroutine run

  !> All tasks, their files in `staging`. `closing`: what is to be said when the files have their places.
  subroutine run_tasks(options, configuration, folder, staging, campaign, console, closing, code, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder
    type(staging_type), intent(in) :: staging
    type(campaign_type), intent(out) :: campaign
    type(console_type), intent(inout) :: console
    character(len=:), allocatable, intent(inout) :: closing
    integer, intent(out) :: code
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: failure, undrawn
    type(single_results_type) :: single
    type(summary_type) :: summary
    character(len=:), allocatable :: place
    logical :: all_stable

    code = 0
    all_stable = .true.
    place = folder
    if (allocated(staging%place)) place = staging%place
    if (configuration%single() .and. .not. (options%in_parts .or. options%merge)) then
      call run_single(options, configuration, place, preamble(options, configuration), console, single, failure, error)
      if (allocated(error)) return
      if (options%fail_if_unstable .and. configuration%tasks%judged() .and. single%verdict /= "stable") code = not_stable
    end if
    if (configuration%sweep) call run_sweep(options, configuration, folder, place, code, console, campaign, summary, error)
    if (allocated(error)) return
    if (.not. (options%in_parts .or. options%merge .or. options%one_line)) call run_others(configuration, place, &
      & preamble(options, configuration), summary, console, all_stable, error)
    if (allocated(error)) return
    if (options%fail_if_unstable .and. .not. all_stable) code = not_stable
    closing = newline // "files in " // on_one_line(folder) // "/" // newline
    if (options%plot .or. options%report) call draw(options, configuration, folder, place, closing, error, undrawn)
    if (options%report .and. .not. allocated(error)) call write_html(place, configuration%result_names(single%vibrates, &
      & .not. allocated(configuration%impossible)), configuration, options%input, settings_of(options), trim(single%verdict), &
      & console%said // closing, error, single%limits)
    if (allocated(error)) return
    ! The verdict stands even where the vibration could not be computed.
    if (code == 0 .and. allocated(failure)) then
      call move_alloc(failure, error)
    else
      if (allocated(undrawn)) call move_alloc(undrawn, error)
    end if
  end subroutine run_tasks

  !> Gives the files their places, none where one could not be written. The blocks of a sweep go when its table is there.
  subroutine settle(staging, campaign, error)
    type(staging_type), intent(inout) :: staging
    type(campaign_type), intent(in) :: campaign
    type(error_type), allocatable, intent(inout) :: error
    type(error_type), allocatable :: failure
    logical :: unwritten

    call staging%retell(error)
    unwritten = .false.
    if (allocated(error)) unwritten = error%unwritten
    if (unwritten) then
      call staging%discard()
      return
    end if
    call staging%publish(failure)
    if (.not. allocated(failure)) call campaign%clear()
    if (allocated(failure) .and. .not. allocated(error)) call move_alloc(failure, error)
  end subroutine settle

  !> Sensitivity, borders, and what is asked over the speed. `all_stable`: at all speeds that are told the machine is stable.
  subroutine run_others(configuration, folder, preamble, summary, console, all_stable, error)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, preamble(:)
    type(summary_type), intent(in) :: summary
    type(console_type), intent(inout) :: console
    logical, intent(out) :: all_stable
    type(error_type), allocatable, intent(out) :: error
    type(border_results_type) :: borders
    character(len=:), allocatable :: report
    logical :: keeps

    all_stable = .true.
    if (configuration%sensitivity) then
      call run_sensitivity(configuration, folder, preamble, report, error)
      if (allocated(error)) return
      call console%say(report)
    end if
    if (.not. allocated(configuration%plan)) return
    associate (plan => configuration%plan)
      if (configuration%over_speed()) then
        if (plan%grid%axes(1)%from * configuration%frame%speed < 0) call console%say(newline // "note: the range of speeds turns " &
          & // "the other way round than the drive of the input" // newline)
      end if
      if (configuration%boundary) then
        call run_borders(configuration, folder, preamble, borders, error)
        if (configuration%sweep .and. allocated(borders%map) .and. .not. allocated(error)) call plot_sweep(folder, preamble, &
          & plan%paths, plan%units, plan%grid, plan%order%columns, summary, error, borders%map%curves)
        if (allocated(error)) return
        call console%say(report_search(plan) // report_borders(plan, borders))
      end if
      if (configuration%campbell .or. configuration%critical) then
        call run_over_modes(configuration, folder, preamble, report, keeps, error)
        if (allocated(error)) return
        all_stable = all_stable .and. keeps
        call console%say(report)
      end if
      if (configuration%resonance) then
        call run_resonance(configuration, folder, preamble, report, keeps, error)
        if (allocated(error)) return
        all_stable = all_stable .and. keeps
        call console%say(report)
      end if
    end associate
  end subroutine run_others

  !> What --check tells.
  subroutine report_check(configuration, console)
    type(configuration_type), intent(in) :: configuration
    type(console_type), intent(inout) :: console

    if (.not. allocated(configuration%impossible)) call console%say(report_mechanism(configuration%frame) &
      & // report_frequencies(configuration%frame))
    if (configuration%sweep) call console%say(report_grid(configuration%plan))
    if (configuration%boundary) call console%say(report_search(configuration%plan))
    call console%say(newline // "The input is sound; nothing more was computed (--check)." // newline)
  end subroutine report_check

  !> The pictures of a run; with --check the mechanism's alone. `closing` tells of them. `undrawn`: gnuplot is not there or
  !> fails. Error: the mechanism's files cannot be written; without `undrawn` that too.
  subroutine draw(options, configuration, folder, place, closing, error, undrawn)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, place
    character(len=:), allocatable, intent(inout) :: closing
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable, intent(out), optional :: undrawn
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: drawn

    if (.not. (allocated(configuration%impossible) .or. options%merge)) call write_mechanism(place, &
      & preamble(options, configuration), configuration%frame, configuration%probes, error)
    if (allocated(error)) return
    call draw_pictures(place, options%check, drawn, failure)
    if (drawn == "") drawn = "none"
    closing = closing // "pictures in " // on_one_line(folder) // "/, .svg and .png: " // drawn // newline
    if (present(undrawn)) then
      call move_alloc(failure, undrawn)
    else
      call move_alloc(failure, error)
    end if
  end subroutine draw

  !> The assignments of --set.
  pure function settings_of(options) result(settings)
    type(options_type), intent(in) :: options
    character(len=:), allocatable :: settings(:)
    integer :: i, longest

    longest = 1
    do i = 1, size(options%settings)
      longest = max(longest, len(options%settings(i)%assignment))
    end do
    allocate(character(len=longest) :: settings(size(options%settings)))
    do i = 1, size(settings)
      settings(i) = options%settings(i)%assignment
    end do
  end function settings_of

  !> What the options ask of the input's tasks. Error: wrong usage.
  subroutine check_options(options, configuration, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    type(error_type), allocatable, intent(out) :: error

    associate (tasks => configuration%tasks)
      if ((options%in_parts .or. options%merge) .and. .not. configuration%sweep) then
        call fatal_error(error, "--part and --merge need the task 'sweep'", wrong_usage)
      else if (options%one_line .and. .not. (configuration%sweep .or. tasks%stability .or. tasks%modes .or. tasks%vibration())) then
        call fatal_error(error, "--one-line needs a task 'stability', 'modes', 'response', 'forces', 'power' or 'sweep'", &
          & wrong_usage)
      end if
    end associate
    if (allocated(error) .or. .not. options%fail_if_unstable) return
    if (.not. (configuration%tasks%judged() .or. configuration%sweep .or. configuration%over_speed())) then
      call fatal_error(error, "--fail-if-unstable needs a task with a verdict: 'stability', 'modes', 'response', 'forces', " &
        & // "'power', 'sensitivity', 'sweep', 'resonance', 'critical' or 'campbell'", wrong_usage)
    else if (configuration%sweep) then
      if (verdict_column(configuration%plan%order%columns) == 0) call fatal_error(error, "--fail-if-unstable needs the column " // &
        & "'verdict' of the sweep", wrong_usage)
    end if
  end subroutine check_options

  !> The points of a sweep: all, a part of them, or only the file.
  subroutine run_sweep(options, configuration, folder, place, code, console, campaign, summary, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, place
    integer, intent(inout) :: code
    type(console_type), intent(inout) :: console
    type(campaign_type), intent(out) :: campaign
    type(summary_type), intent(out) :: summary
    type(error_type), allocatable, intent(out) :: error
    logical, allocatable :: mine(:)

    if (options%one_line) then
      call print_sweep(configuration, summary, error)
    else
      call open_sweep(configuration, folder, options%part, options%parts, campaign, mine, error)
      if (allocated(error)) return
      call console%say(report_grid(configuration%plan))
      if (.not. options%merge) call compute_tiles(configuration%plan, campaign, mine, error)
      if (allocated(error)) return
      if (options%in_parts) then
        call console%say(newline // "Part " // text(options%part) // " of " // text(options%parts) // ": " &
          & // counted(count(mine), "tile") // " done; --merge writes sweep.csv when all parts are." // newline)
        return
      end if
      call campaign%finish(place, preamble(options, configuration), summary, error)
      if (allocated(error)) return
      call console%say(report_sweep(configuration%plan, summary))
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

  !> The # lines that head every file. Ends of lines, as other control characters of ASCII, become blanks.
  pure function preamble(options, configuration) result(lines)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines(:)
    integer :: i, k, width, n

    width = max(len("title: " // configuration%title), len("input: " // options%input), 40)
    do i = 1, size(options%settings)
      width = max(width, len("set: " // options%settings(i)%assignment))
    end do
    n = merge(5, 4, configuration%frame%held_by /= "motor")
    allocate(character(len=width) :: lines(n + size(options%settings)))
    lines(1) = "title: " // configuration%title
    lines(2) = "version: gestell " // version
    lines(3) = "input: " // options%input
    lines(4) = "model: " // merge("averaged   ", configuration%tasks%model, configuration%tasks%averaged)
    if (n == 5) lines(n) = "speed held by: " // configuration%frame%held_by
    do i = 1, size(options%settings)
      lines(n + i) = "set: " // options%settings(i)%assignment
    end do
    do i = 1, size(lines)
      do k = 1, width
        if (lines(i)(k:k) < " ") lines(i)(k:k) = " "
      end do
      lines(i) = on_one_line(lines(i))
    end do
  end function preamble

end module driver
