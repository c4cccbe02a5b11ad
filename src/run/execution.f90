!> A run of the program from the words of its command line to its exit code.
module gestell_run_execution
  use gestell_run_command_line, only: help_text, options_type, parse, word_type
  use gestell_run_console, only: print_out, tell
  use gestell_run, only: run
  use gestell_base_error, only: error_type
  use gestell_base_version, only: version
  use gestell_input_schema_help, only: help_on
  use gestell_task_common_executor, only: executor_type
  use gestell_task_registry, only: input_schema
  implicit none (type, external)
  private

  public :: execute

contains

  !> Does what the words ask for; an error becomes one line on standard error. `executor`: who does the work.
  subroutine execute(words, code, executor)
    type(word_type), intent(in) :: words(:)
    integer, intent(out) :: code
    class(executor_type), allocatable, intent(inout), optional :: executor
    type(options_type) :: options
    type(error_type), allocatable :: error
    character(len=:), allocatable :: text

    code = 0
    call parse(words, options, error)
    if (.not. allocated(error)) then
      if (allocated(options%topic)) then
        call help_on(input_schema(), options%topic, text, error)
        if (.not. allocated(error)) call print_out(text, error)
      else if (options%has("--help")) then
        call print_out(help_text() // new_line("a"), error)
      else if (options%has("--version")) then
        call print_out("gestell " // version // new_line("a"), error)
      else
        call run(options, code, error, executor)
      end if
    end if
    if (.not. allocated(error)) return
    call tell(error%message)
    code = error%code
  end subroutine execute

end module gestell_run_execution
