!> Writes the results of a run as tables, pictures, results.json, an HTML page or a CSV line, whichever the options request.
module gestell_run_files
  use gestell_base_error, only: error_type
  use gestell_input_schema_path, only: position_of_equals
  use gestell_base_words, only: on_one_line
  use gestell_base_verdict, only: unjudged
  use gestell_output_file_output, only: open_output, output_type
  use gestell_output_json, only: append_json
  use gestell_output_picture_gnuplot, only: draw_pictures
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_csv, only: append_rows
  use gestell_run_command_line, only: options_type
  use gestell_task_common_context, only: context_type
  use gestell_task_registry_machine_json, only: machine_json
  use gestell_task_registry_page, only: append_page
  implicit none (type, external)
  private

  public :: write_files

  character, parameter :: newline = new_line("a")

contains

  !> Writes the results in the forms that the options request. `error` is already allocated at the call if a task has failed.
  subroutine write_files(options, context, result, closing, error)
    !> Options of the command line
    type(options_type), intent(in) :: options
    !> Machine, heads of the files, and the staging folder into which the files are written
    type(context_type), intent(in) :: context
    type(result_type), intent(inout) :: result
    !> Lines that are to be printed after the files have been published
    character(len=:), allocatable, intent(inout) :: closing
    type(error_type), allocatable, intent(inout) :: error
    type(error_type), allocatable :: write_failed, undrawn
    type(output_type) :: page
    character(len=:), allocatable :: drawn, failure

    if (options%has("--one-line")) then
      if (.not. allocated(error)) call print_brief(options, result, error)
      return
    else if (.not. options%writes_files()) then
      return
    end if
    call result%write(context%staging, context%head, write_failed)
    if (allocated(error) .and. options%has("--json") .and. .not. allocated(write_failed)) call write_json(options, context, &
      & result, error%message, write_failed)
    if (allocated(write_failed)) call move_alloc(write_failed, error)
    if (allocated(error)) return
    if (.not. options%has("--check")) closing = newline // "files in " // on_one_line(context%folder) // "/" // newline
    if (options%has("--plot") .or. options%has("--report")) then
      call draw_pictures(context%staging, context%folder, result%figures, drawn, undrawn)
      call result%record_failure(undrawn)
      if (drawn == "") drawn = "none"
      closing = closing // "pictures in " // on_one_line(context%folder) // "/, .svg and .png: " // drawn // newline
      if (result%animations() /= "") closing = closing // "animations in " // on_one_line(context%folder) // "/: " &
        & // result%animations() // newline
    end if
    if (.not. options%has("--check")) closing = closing // result%summary_line()
    failure = ""
    if (allocated(result%failure)) failure = result%failure%message
    if (options%has("--json")) call write_json(options, context, result, failure, error)
    if (allocated(error)) return
    if (options%has("--report") .and. .not. options%has("--check")) then
      call open_output(page, context%staging // "/report.html")
      call append_page(context, result, page, context%staging)
      call page%complete(error)
    end if
  end subroutine write_files

  !> Writes results.json or, with --quiet, writes the same text to standard output. Fails if it cannot be written.
  subroutine write_json(options, context, result, failure, error)
    type(options_type), intent(in) :: options
    type(context_type), intent(in) :: context
    type(result_type), intent(in) :: result
    !> Message about a failed computation; empty if no computation has failed
    character(len=*), intent(in) :: failure
    type(error_type), allocatable, intent(out) :: error
    type(output_type) :: output

    if (options%has("--quiet")) then
      call open_output(output)
    else
      call open_output(output, context%staging // "/results.json")
    end if
    call append_json(result, context%head, machine_json(context%configuration, result%scenes()), failure, output)
    call output%complete(error)
  end subroutine write_json

  !> Prints a CSV line for the machine, or one line for each case of a sweep. Each line begins with the values of --set. Fails if
  !> standard output cannot be written.
  subroutine print_brief(options, result, error)
    type(options_type), intent(in) :: options
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(output_type) :: output
    type(table_type) :: table
    character(len=:), allocatable :: value
    integer :: i, k, equals

    table = new_table("", "", "", unjudged)
    do i = 1, size(options%settings)
      associate (setting => options%settings(i)%text)
        equals = position_of_equals(setting)
        value = trim(adjustl(setting(equals + 1:)))
        call table%add(trim(adjustl(setting(:equals - 1))), "value of --set", [(value, k = 1, result%brief%rows)])
      end associate
    end do
    call result%brief%convert(result%units)
    call table%join(result%brief)
    call open_output(output)
    call append_rows(table, output)
    call output%complete(error)
  end subroutine print_brief

end module gestell_run_files
