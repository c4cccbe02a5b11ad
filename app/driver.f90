!> What the program does with an input file.
module driver
  use cli, only: options_type
  use console, only: console_type, tell
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_input_wording, only: on_one_line
  use gestell_input_namelist, only: read_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_check, only: check_document
  use gestell_input_schema_path, only: position_of_equals, set_value
  use gestell_output_file_staging, only: open_staging, staging_type
  use gestell_output_head, only: head_type
  use gestell_output_result, only: result_type
  use gestell_output_file_output, only: open_output, open_standard_output, output_type
  use gestell_output_json, only: append_json
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_csv, only: append_rows
  use gestell_task, only: all_speeds, any_task_type, own_machine
  use gestell_task_configuration, only: configuration_type
  use gestell_task_context, only: context_type, keep_journal
  use gestell_task_drawing_report, only: report_mechanism
  use gestell_task_machine, only: end_line, solve_machine
  use gestell_task_machine_report, only: report_frequencies, report_machine
  use gestell_task_page, only: write_page
  use gestell_task_registry, only: input_schema, orders_any, read_tasks => read_input
  use plotting, only: draw_pictures
  use terminal, only: terminal_type
  implicit none (type, external)
  private

  public :: folder_name, head_of, read_input, run

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
    type(any_task_type), allocatable :: tasks(:)
    type(context_type) :: context
    type(result_type) :: result
    type(staging_type) :: staging
    type(console_type) :: console
    character(len=:), allocatable :: closing
    logical :: unwritten
    integer :: i

    code = 0
    call read_input(options, tasks, context%configuration, error)
    if (.not. allocated(error)) call check_options(options, tasks, error)
    if (allocated(error)) return
    call prepare(options, context, result)
    do i = 1, size(tasks)
      tasks(i)%task%implied = tasks(i)%task%pictured .and. (options%plot .or. options%report)
      if (tasks(i)%task%ordered) call tasks(i)%task%prepare(context, error)
      if (allocated(error)) return
    end do
    if (.not. (options%one_line .or. options%in_parts .or. options%check .and. .not. options%plot)) then
      call open_staging(staging, context%folder, error)
      if (allocated(error)) return
      context%place = staging%place
      call keep_journal(context, result)
    end if
    console%silent = options%quiet .or. options%one_line
    call result%say(report_machine(context%configuration, options%input), whole=.true.)
    call say_rest(console, result)
    if (options%check) then
      call check_only(options, tasks, context, result, error)
    else
      call run_tasks(tasks, context, result, console, error)
    end if
    closing = ""
    call write_files(options, context, result, console, closing, error)
    if (allocated(staging%place)) call staging%retell(result%failure)
    if (allocated(staging%place)) call settle(staging, tasks, error)
    unwritten = .false.
    if (allocated(error)) unwritten = error%unwritten
    if (.not. unwritten) call console%say(closing)
    if (.not. allocated(error) .and. allocated(console%error)) call move_alloc(console%error, error)
    if (options%fail_if_unstable .and. .not. result%all_stable .and. .not. allocated(error)) code = not_stable
    ! The verdict stands even where the vibration could not be computed.
    if (code == 0 .and. .not. allocated(error) .and. allocated(result%failure)) call move_alloc(result%failure, error)
  end subroutine run

  !> What the tasks are run with.
  subroutine prepare(options, context, result)
    type(options_type), intent(in) :: options
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result

    context%head = head_of(options, context%configuration)
    context%folder = folder_name(options)
    context%place = context%folder
    context%reports = .not. (options%quiet .or. options%one_line) .or. options%report .or. options%json
    context%one_line = options%one_line
    context%fails_if_unstable = options%fail_if_unstable
    context%part = options%part
    context%parts = options%parts
    context%in_parts = options%in_parts
    context%merge = options%merge
    context%keeps_rows = options%json
    allocate(context%executor)
    allocate(terminal_type :: context%executor%progress)
    call result%begin(options%verbose)
  end subroutine prepare

  !> The tasks, one after the other. Error: that of the first that fails; the others are not begun.
  subroutine run_tasks(tasks, context, result, console, error)
    type(any_task_type), intent(inout) :: tasks(:)
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(console_type), intent(inout) :: console
    type(error_type), allocatable, intent(out) :: error
    logical :: parts, others
    integer :: i

    parts = context%in_parts .or. context%merge
    others = any([(tasks(i)%task%ordered .and. tasks(i)%task%about /= own_machine, i = 1, size(tasks))])
    if (.not. parts .and. (orders_any(tasks, own_machine) .or. .not. others)) then
      if (.not. allocated(context%configuration%impossible)) call solve_machine(context, result, error)
      if (allocated(error)) return
    end if
    if (orders_any(tasks, all_speeds)) then
      if (context%configuration%plan%grid%axes(1)%from * context%configuration%frame%speed < 0) call result%say(newline &
        & // "note: the range of speeds turns the other way round than the drive of the input" // newline)
    end if
    do i = 1, size(tasks)
      associate (task => tasks(i)%task)
        if (.not. (task%ordered .or. task%implied) .or. parts .and. .not. task%shared) cycle
        if (context%one_line .and. .not. task%brief) cycle
        if (allocated(context%configuration%impossible) .and. task%about == own_machine) cycle
        ! what is told of the machine itself waits for its headlines, and no longer
        if (task%about /= own_machine) call say_rest(console, result)
        call task%run(context, result, error)
      end associate
      if (allocated(error)) return
      if (tasks(i)%task%about /= own_machine) call say_rest(console, result)
    end do
    if (orders_any(tasks, own_machine)) call end_line(context, result)
  end subroutine run_tasks

  !> What --check tells and draws.
  subroutine check_only(options, tasks, context, result, error)
    type(options_type), intent(in) :: options
    type(any_task_type), intent(inout) :: tasks(:)
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    associate (configuration => context%configuration)
      if (.not. allocated(configuration%impossible)) call result%say(report_mechanism(configuration%frame) &
        & // report_frequencies(configuration%frame))
      do i = 1, size(tasks)
        if (tasks(i)%task%ordered) call result%say(tasks(i)%task%preview(configuration))
        if (.not. (options%plot .and. tasks(i)%task%pictured) .or. allocated(configuration%impossible)) cycle
        call tasks(i)%task%run(context, result, error)
        if (allocated(error)) return
      end do
    end associate
    call result%say(newline // "The input is sound; nothing more was computed (--check)." // newline)
  end subroutine check_only

  !> Writes what was found as the options ask for it: on one line, or as tables, pictures and page. `closing`: what is to be said
  !> when the files have their places. `error` may come in with the first failure of the tasks.
  subroutine write_files(options, context, result, console, closing, error)
    type(options_type), intent(in) :: options
    type(context_type), intent(in) :: context
    type(result_type), intent(inout) :: result
    type(console_type), intent(inout) :: console
    character(len=:), allocatable, intent(inout) :: closing
    type(error_type), allocatable, intent(inout) :: error
    type(error_type), allocatable :: unwritten, undrawn
    character(len=:), allocatable :: drawn, failure

    call say_rest(console, result)
    if (options%one_line) then
      if (.not. allocated(error)) call print_brief(options, result, error)
      return
    else if (options%in_parts .or. options%check .and. .not. options%plot) then
      return
    end if
    call result%write(context%place, context%head, unwritten)
    if (allocated(unwritten)) then
      call move_alloc(unwritten, error)
      return
    else if (allocated(error)) then
      if (options%json) call write_json(options, context, result, error%message, unwritten)
      if (allocated(unwritten)) call move_alloc(unwritten, error)
      return
    end if
    if (.not. options%check) closing = newline // "files in " // on_one_line(context%folder) // "/" // newline
    if (options%plot .or. options%report) then
      call draw_pictures(context%place, context%folder, result%figures, drawn, undrawn)
      call result%fail(undrawn)
      if (drawn == "") drawn = "none"
      closing = closing // "pictures in " // on_one_line(context%folder) // "/, .svg and .png: " // drawn // newline
    end if
    if (.not. options%check) closing = closing // result%in_short()
    failure = ""
    if (allocated(result%failure)) failure = result%failure%message
    if (options%json) call write_json(options, context, result, failure, error)
    if (allocated(error)) return
    if (options%report .and. .not. options%check) call write_page(context, result, console%said, error)
  end subroutine write_files

  !> results.json, or the same on standard output that is quiet otherwise; `failure`: what could not be computed, if anything.
  !> Error: it cannot be written.
  subroutine write_json(options, context, result, failure, error)
    type(options_type), intent(in) :: options
    type(context_type), intent(in) :: context
    type(result_type), intent(in) :: result
    character(len=*), intent(in) :: failure
    type(error_type), allocatable, intent(out) :: error
    type(output_type) :: output

    if (options%quiet) then
      call open_standard_output(output)
    else
      call open_output(output, context%place // "/results.json")
    end if
    call append_json(result, context%head, failure, output)
    call output%complete(error)
  end subroutine write_json

  !> The line of the machine, or those of a sweep, behind what was set by --set. Error: they cannot be written.
  subroutine print_brief(options, result, error)
    type(options_type), intent(in) :: options
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(output_type) :: output
    type(table_type) :: table
    character(len=:), allocatable :: value
    integer :: i, k, equals

    table = new_table("", "", "", "")
    do i = 1, size(options%settings)
      associate (setting => options%settings(i)%assignment)
        equals = position_of_equals(setting)
        value = trim(adjustl(setting(equals + 1:)))
        call table%add(trim(adjustl(setting(:equals - 1))), "set from outside", [(value, k = 1, result%brief%rows)])
      end associate
    end do
    call table%join(result%brief)
    call open_standard_output(output)
    call append_rows(table, output)
    call output%complete(error)
  end subroutine print_brief

  !> Says what of the report was not yet said, and notes.
  subroutine say_rest(console, result)
    type(console_type), intent(inout) :: console
    type(result_type), intent(inout) :: result
    integer :: last

    call result%lead()
    do while (len(result%notes) > 0)
      last = index(result%notes, newline)
      call tell(result%notes(:last - 1))
      result%notes = result%notes(last + 1:)
    end do
    call console%say(result%rest())
  end subroutine say_rest

  !> Gives the files their places, none where one could not be written.
  subroutine settle(staging, tasks, error)
    type(staging_type), intent(inout) :: staging
    type(any_task_type), intent(inout) :: tasks(:)
    type(error_type), allocatable, intent(inout) :: error
    type(error_type), allocatable :: failure
    logical :: unwritten
    integer :: i

    call staging%retell(error)
    unwritten = .false.
    if (allocated(error)) unwritten = error%unwritten
    if (unwritten) then
      call staging%discard()
      return
    end if
    call staging%publish(failure)
    if (.not. allocated(failure)) then
      do i = 1, size(tasks)
        call tasks(i)%task%settle()
      end do
    end if
    if (allocated(failure) .and. .not. allocated(error)) call move_alloc(failure, error)
  end subroutine settle

  !> What the options ask of the input's tasks. Error: wrong usage.
  subroutine check_options(options, tasks, error)
    type(options_type), intent(in) :: options
    type(any_task_type), intent(in) :: tasks(:)
    type(error_type), allocatable, intent(out) :: error
    logical, dimension(size(tasks)) :: ordered, shared, brief, judges
    integer :: i

    ordered = [(tasks(i)%task%ordered, i = 1, size(tasks))]
    shared = [(tasks(i)%task%shared, i = 1, size(tasks))]
    brief = [(tasks(i)%task%brief, i = 1, size(tasks))]
    judges = [(tasks(i)%task%judges, i = 1, size(tasks))]
    if ((options%in_parts .or. options%merge) .and. .not. any(ordered .and. shared)) then
      call fatal_error(error, "--part and --merge need the task " // one_of(tasks, shared), wrong_usage)
    else if (options%one_line .and. .not. any(ordered .and. brief)) then
      call fatal_error(error, "--one-line needs a task " // one_of(tasks, brief), wrong_usage)
    else if (options%fail_if_unstable .and. .not. any(ordered .and. judges)) then
      call fatal_error(error, "--fail-if-unstable needs a task with a verdict: " // one_of(tasks, judges), wrong_usage)
    end if
  end subroutine check_options

  !> "'a', 'b' or 'c'".
  pure function one_of(tasks, chosen) result(words)
    type(any_task_type), intent(in) :: tasks(:)
    logical, intent(in) :: chosen(:)
    character(len=:), allocatable :: words
    character(len=11) :: names(size(tasks))
    integer :: i, n, k

    names = [(tasks(i)%task%name, i = 1, size(tasks))]
    n = count([(chosen(i) .and. all(names(:i - 1) /= names(i)), i = 1, size(tasks))])
    words = ""
    k = 0
    do i = 1, size(tasks)
      if (.not. chosen(i) .or. any(names(:i - 1) == names(i))) cycle
      k = k + 1
      words = words // "'" // trim(names(i)) // "'"
      if (k == n - 1) words = words // " or "
      if (k < n - 1) words = words // ", "
    end do
  end function one_of

  subroutine read_input(options, tasks, configuration, error)
    type(options_type), intent(in) :: options
    type(any_task_type), allocatable, intent(out) :: tasks(:)
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
    call read_tasks(doc, schema, tasks, configuration, error)
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

  !> What heads every table.
  pure type(head_type) function head_of(options, configuration) result(head)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(in) :: configuration
    integer :: i, longest

    head%title = configuration%title
    head%input = options%input
    head%model = configuration%model()
    head%held_by = trim(configuration%frame%held_by)
    longest = 1
    do i = 1, size(options%settings)
      longest = max(longest, len(options%settings(i)%assignment))
    end do
    allocate(character(len=longest) :: head%settings(size(options%settings)))
    do i = 1, size(options%settings)
      head%settings(i) = options%settings(i)%assignment
    end do
  end function head_of

end module driver
