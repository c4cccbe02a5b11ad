!> Executes a run of the program, from the words of the command line to the exit code.
module gestell_run
  use gestell_run_command_line, only: help_text, options_type, parse, word_type
  use gestell_run_console, only: console_type, print_out, print_error_line
  use gestell_run_files, only: write_files
  use gestell_run_input, only: check_folder, check_options, folder_name, read_input
  use gestell_run_starting_inputs, only: starting_input
  use gestell_base_error, only: error_type
  use gestell_base_version, only: version
  use gestell_input_schema_help, only: help_on
  use gestell_output_file_staging, only: open_staging, staging_type
  use gestell_output_result, only: result_type
  use gestell_task_common_task, only: any_task_type
  use gestell_task_common_context, only: context_type, keep_journal
  use gestell_task_common_executor, only: executor_type
  use gestell_task_machine_report, only: report_machine
  use gestell_task_registry, only: all_tables, input_schema
  use gestell_task_registry_run, only: prepare_tasks, run_tasks
  implicit none (type, external)
  private

  public :: execute, run

  !> Exit code if the option --fail-if-unstable is given and a verdict of the run is not stable.
  integer, parameter, public :: not_stable = 10

  character, parameter :: newline = new_line("a")

contains

  !> Executes a command line. An error is printed as one line on standard error. `executor` distributes the work among processes; if
  !> it is absent, the threads of this process do all the work.
  subroutine execute(words, code, executor)
    type(word_type), intent(in) :: words(:)
    integer, intent(out) :: code
    class(executor_type), allocatable, intent(inout), optional :: executor
    type(options_type) :: options
    type(error_type), allocatable :: error
    character(len=:), allocatable :: text, kind

    code = 0
    call parse(words, options, error)
    if (.not. allocated(error)) then
      if (allocated(options%topic)) then
        call help_on(input_schema(), options%topic, text, error)
        if (.not. allocated(error)) call print_out(text, error)
      else if (options%has("--help")) then
        call print_out(help_text() // new_line("a"), error)
      else if (options%has("--new")) then
        kind = ""
        if (allocated(options%kind)) kind = options%kind
        call starting_input(kind, text, error)
        if (.not. allocated(error)) call print_out(text, error)
      else if (options%has("--version")) then
        call print_out("gestell " // version // new_line("a"), error)
      else
        call run(options, code, error, executor)
      end if
    end if
    if (.not. allocated(error)) return
    call print_error_line(error%message)
    code = error%code
  end subroutine execute

  !> Reads the input, runs its tasks, prints the report and writes the files. All files are published together at the end. If a
  !> computation fails, the files of earlier tasks are still published. If there are several processes, all of them call this
  !> procedure, but only one prints and writes.
  subroutine run(options, code, error, executor)
    type(options_type), intent(in) :: options
    !> 0, or `not_stable` (see there)
    integer, intent(out) :: code
    !> The failure, if there is one; it is the same in all processes
    type(error_type), allocatable, intent(out) :: error
    !> Distributes the work among processes. If absent, the threads of this process do all the work
    class(executor_type), allocatable, intent(inout), optional :: executor
    type(any_task_type), allocatable :: tasks(:)
    type(context_type) :: context
    type(result_type) :: result
    type(staging_type) :: staging
    type(console_type) :: console
    character(len=:), allocatable :: closing
    logical :: write_failed, is_leader

    code = 0
    if (present(executor)) call move_alloc(executor, context%executor)
    if (.not. allocated(context%executor)) allocate(context%executor)
    call read_input(options, tasks, context%configuration, error)
    if (.not. allocated(error)) call check_options(options, tasks, context%executor%has_many_processes, error)
    call context%executor%share_error(error)
    if (.not. allocated(error)) call context%executor%compare(context%configuration%content, options%input, error)
    if (allocated(error)) return
    if (options%has("--report")) call context%configuration%request_forces()
    call set_options(options, context)
    is_leader = context%executor%is_leader()
    call prepare_tasks(tasks, context, result, error)
    if (allocated(error)) return
    if (options%writes_files()) then
      associate (path => context%configuration%document%path)
        if (is_leader .and. .not. options%has("--check")) call check_folder(tasks, context%folder, path, error)
      end associate
      if (is_leader .and. .not. allocated(error)) call open_staging(staging, context%folder, all_tables(), error, &
        & context%configuration%document%path)
      call context%executor%share_error(error)
      if (allocated(error)) return
      if (is_leader) context%staging = staging%path
      if (is_leader) call keep_journal(context, result)
    end if
    console%omits_notes = .not. is_leader
    console%silent = options%has("--quiet") .or. options%has("--one-line") .or. console%omits_notes
    call console%receive(result)
    call console%write_lines(report_machine(context%configuration, options%input))
    call run_tasks(tasks, context, result, error, console)
    closing = ""
    if (is_leader) call write_files(options, context, result, closing, error)
    if (allocated(staging%path)) call staging%show_final_folder(result%failure)
    if (allocated(context%executor%journal)) call context%executor%journal%close()
    if (allocated(staging%path)) call conclude(staging, tasks, result, error)
    write_failed = .false.
    if (allocated(error)) write_failed = error%write_failed
    if (.not. write_failed) call console%write_lines(closing)
    if (.not. allocated(error) .and. allocated(console%error)) call move_alloc(console%error, error)
    call context%executor%share_error(error)
    if (allocated(error)) return
    if (options%has("--fail-if-unstable") .and. .not. result%all_stable) code = not_stable
    if (.not. allocated(result%failure)) return
    ! The verdict is valid even if the vibration could not be computed.
    if (code == not_stable) then
      call print_error_line("note: " // result%failure%message)
    else
      call move_alloc(result%failure, error)
    end if
  end subroutine run

  !> Sets the options and folders of the context in which the tasks run.
  subroutine set_options(options, context)
    type(options_type), intent(in) :: options
    type(context_type), intent(inout) :: context

    call context%fill_header(options%input, options%settings)
    context%folder = folder_name(options)
    context%staging = context%folder
    context%reports = .not. (options%has("--quiet") .or. options%has("--one-line")) .or. options%has("--report") &
      & .or. options%has("--json")
    context%one_line = options%has("--one-line")
    context%fails_if_unstable = options%has("--fail-if-unstable")
    context%part = options%part
    context%parts = options%parts
    context%in_parts = options%has("--part")
    context%merge = options%has("--merge")
    context%describes_mechanism = options%has("--report") .or. options%has("--check")
    context%keep_all_rows = options%has("--json")
    context%verbose = options%has("--verbose")
    context%draws = options%has("--plot") .or. options%has("--report")
    context%only_checks = options%has("--check")
  end subroutine set_options

  !> Publishes all files, or no file if one of them could not be written.
  subroutine conclude(staging, tasks, result, error)
    type(staging_type), intent(inout) :: staging
    type(any_task_type), intent(inout) :: tasks(:)
    type(result_type), intent(in) :: result
    type(error_type), allocatable, intent(inout) :: error
    type(error_type), allocatable :: failure
    logical :: write_failed
    integer :: i

    call staging%show_final_folder(error)
    write_failed = .false.
    if (allocated(error)) write_failed = error%write_failed
    if (write_failed) then
      call staging%discard()
      return
    end if
    call staging%publish(result%left(), failure)
    do i = 1, size(tasks)
      if (.not. allocated(failure)) call tasks(i)%task%conclude()
    end do
    if (allocated(failure) .and. .not. allocated(error)) call move_alloc(failure, error)
  end subroutine conclude

end module gestell_run
