!> Returns the results computed for a machine: verdict, multipliers, vibrations, tables, report and files.
module gestell_api_solution
  use gestell_base_error, only: error_type, fatal_error, invalid_input, wrong_usage
  use gestell_base_verdict, only: verdict_length
  use gestell_base_kinds, only: dp
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_rewrite, only: rewrite
  use gestell_input_wording, only: shown
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_rows, only: quantity_type
  use gestell_output_file_output, only: collect_output, output_type
  use gestell_output_file_result_files, only: animation
  use gestell_output_file_staging, only: open_staging, staging_type
  use gestell_output_head, only: setting_type
  use gestell_output_json, only: append_json
  use gestell_output_picture_gnuplot, only: draw_pictures
  use gestell_output_result, only: result_type
  use gestell_output_table, only: table_type
  use gestell_study_vibration, only: check_rows, solve_vibration
  use gestell_study_vibration_statistics, only: history_of, statistics_type, compute_statistics
  use gestell_system_averaged, only: averaged_system
  use gestell_system_periodic, only: periodic_system
  use gestell_task_common_task, only: any_task_type, own_machine
  use gestell_task_common_context, only: context_type
  use gestell_task_machine_report, only: report_machine
  use gestell_task_registry, only: all_tables, list_tasks_of, read_input
  use gestell_task_registry_machine_json, only: machine_json
  use gestell_task_registry_page, only: append_page
  use gestell_task_registry_run, only: prepare_tasks, run_tasks
  implicit none (type, external)
  private

  public :: solve_document

  !> A text that was composed from the results.
  type :: text_type
    character(len=:), allocatable :: name, words
  end type text_type

  !> Results of the tasks that were run. Its procedures `verdict`, `multipliers`, `response`, `table`, `text`, `report` and `write`
  !> return them.
  type, public :: solution_type
    private
    type(context_type) :: context
    type(result_type), public :: result
    !> Texts that were composed earlier
    type(text_type), allocatable :: texts(:)
  contains
    procedure :: verdict, multipliers, response, find_table, table, text => text_of, report, write => write_files
  end type solution_type

  !> Extents of a computation: results only, or also what the report needs, what pictures and animations need, and what the page
  !> needs
  integer, parameter :: numbers = 1, for_report = 2, for_pictures = 3, for_page = 4

  !> Vibration of one quantity over one period T.
  type, public :: response_type
    !> Name and SI unit of the quantity
    character(len=:), allocatable :: name, unit
    !> `peak`: maximum of the magnitude; `rms`: root mean square; `peak_error`, `rms_error`: bounds on the errors of `peak` and
    !> `rms`
    real(dp) :: peak = 0, peak_error = 0, rms = 0, rms_error = 0
    !> `amplitudes`: amplitudes of the harmonics 1, 2, ... of the period; `history`: values at equidistant times from 0 to T, both
    !> ends included
    real(dp), allocatable :: amplitudes(:), history(:)
  end type response_type

contains

  !> Runs the tasks of a checked document. If the tasks concern only the machine of the input, what reports and pictures need is
  !> computed only on request, because this takes longer than the verdict; the task `drawing` is such a request. Fails if the
  !> machine is invalid, its mechanism cannot be assembled at every crank angle, or nothing could be computed.
  subroutine solve_document(document, schema, settings, solution, error)
    type(document_type), intent(in) :: document
    type(schema_type), intent(in) :: schema
    !> Assignments PATH=VALUE made after the input was read, which the heads of the files quote
    type(setting_type), intent(in) :: settings(:)
    type(solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error

    call solve_tasks(document, schema, numbers, solution%context, solution%result, error)
    if (.not. allocated(error)) call solution%context%fill_header(document%file, settings)
  end subroutine solve_document

  !> Runs the tasks of a document. Fails under the conditions stated at `solve_document`.
  subroutine solve_tasks(document, schema, extent, context, result, error)
    type(document_type), intent(in) :: document
    type(schema_type), intent(in) :: schema
    !> Minimum extent of the computation: `numbers`, `for_report`, `for_pictures` or `for_page`
    integer, intent(in) :: extent
    type(context_type), intent(out) :: context
    type(result_type), intent(out) :: result
    type(error_type), allocatable, intent(out) :: error
    type(any_task_type), allocatable :: tasks(:)
    logical :: draws, others
    integer :: i

    call read_input(document, schema, tasks, context%configuration, error)
    if (allocated(error)) return
    draws = extent == numbers .and. any([(tasks(i)%task%requested .and. tasks(i)%task%drawn_with_plot, i = 1, size(tasks))])
    others = any([(tasks(i)%task%requested .and. tasks(i)%task%scope /= own_machine, i = 1, size(tasks))])
    context%keep_all_rows = .true.
    context%reports = draws .or. others .or. extent >= for_report
    context%draws = draws .or. extent >= for_pictures
    context%describes_mechanism = draws .or. extent >= for_page
    ! gfortran keeps the length of a text that a function returns in static memory, which all threads share. Such functions compose
    ! reports and pictures, but neither read the input nor compute results.
    if (context%reports) then
      !$omp critical (texts_of_gestell)
      call run
      !$omp end critical (texts_of_gestell)
    else
      call run
    end if
    if (.not. allocated(error) .and. allocated(result%failure) .and. size(result%tables) == 0) then
      allocate(error, source=result%failure)
    end if

  contains

    subroutine run
      call prepare_tasks(tasks, context, result, error)
      if (.not. allocated(error)) call run_tasks(tasks, context, result, error)
    end subroutine run

  end subroutine solve_tasks

  !> Returns a text about the results. `what` is "verdict"; "failure": why some results could not be computed; "report": the lines
  !> that the program prints; "results": the content of results.json; "machine": its member about the machine; "input": an input
  !> file that requests the same results; "page": the HTML page without the pictures of gnuplot; or the name of a result file that
  !> is no table, such as mechanism_motion.svg. If the tasks have not computed what the text needs, they run again. Fails if there
  !> is no such text or it cannot be composed.
  subroutine text_of(self, what, words, error)
    class(solution_type), intent(inout) :: self
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(out) :: words
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    words = ""
    if (what == "verdict") then
      words = trim(self%result%worst%word())
    else if (what == "failure") then
      if (allocated(self%result%failure)) words = self%result%failure%message
    else
      if (.not. allocated(self%texts)) allocate(self%texts(0))
      i = findloc([(self%texts(i)%name == what, i = 1, size(self%texts))], .true., dim=1)
      if (i > 0) then
        words = self%texts(i)%words
      else
        call compose(self, what, words, error)
      end if
    end if
  end subroutine text_of

  !> Composes a text other than verdict and failure, and stores it in the solution.
  subroutine compose(solution, what, words, error)
    class(solution_type), intent(inout) :: solution
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(out) :: words
    type(error_type), allocatable, intent(out) :: error
    type(context_type) :: context
    type(result_type) :: result
    type(text_type) :: text
    integer :: extent

    extent = numbers
    if (what == "report") extent = for_report
    if (what == "results" .or. what == "machine" .or. index(what, animation) > 0) extent = for_pictures
    if (what == "page") extent = for_page
    if (has_computed(solution%context, extent)) then
      call append(solution%context, solution%result)
    else
      associate (configuration => solution%context%configuration)
        call solve_tasks(configuration%document, configuration%schema, extent, context, result, error)
      end associate
      if (allocated(error)) return
      context%head = solution%context%head
      call append(context, result)
    end if
    if (allocated(error)) return
    ! gfortran 12 does not free the components of a structure constructor within an array constructor
    text%name = what
    text%words = words
    solution%texts = [solution%texts, text]

  contains

    subroutine append(context, result)
      type(context_type), intent(in) :: context
      type(result_type), intent(inout) :: result
      type(output_type) :: output
      character(len=:), allocatable :: failure, bytes

      !$omp critical (texts_of_gestell)
      call result%insert_headlines()
      failure = ""
      if (allocated(result%failure)) failure = result%failure%message
      call collect_output(output)
      select case (what)
      case ("report")
        call output%append(report_machine(context%configuration, context%head%input) // result%report // result%summary_line())
      case ("results")
        call append_json(result, context%head, machine_json(context%configuration, result%scenes()), failure, output)
      case ("machine")
        call output%append(machine_json(context%configuration, result%scenes()))
      case ("input")
        call rewrite(context%configuration%document, context%configuration%schema, bytes, error)
        if (.not. allocated(error)) call output%append(bytes)
      case ("page")
        call append_page(context, result, output)
      case default
        call result%find_file(what, trim(context%head%title), bytes)
        if (allocated(bytes)) then
          call output%append(bytes)
        else
          call fatal_error(error, "there is no text '" // what // "': use verdict, report, results, machine, input, page, " &
            & // "failure, or the name of a result file", wrong_usage)
        end if
      end select
      call output%take(words)
      !$omp end critical (texts_of_gestell)
    end subroutine append

  end subroutine compose

  !> True if the tasks have computed everything that `extent` comprises.
  pure logical function has_computed(context, extent)
    type(context_type), intent(in) :: context
    integer, intent(in) :: extent

    has_computed = (context%reports .or. extent < for_report) .and. (context%draws .or. extent < for_pictures) &
      & .and. (context%describes_mechanism .or. extent < for_page)
  end function has_computed

  !> Returns the report, with the same lines as the program prints. Composes the report now if this was postponed; fails if this is
  !> impossible.
  subroutine report(self, lines, error)
    class(solution_type), intent(inout) :: self
    character(len=:), allocatable, intent(out) :: lines
    type(error_type), allocatable, intent(out) :: error

    call self%text("report", lines, error)
  end subroutine report

  !> Writes the files of the program into `folder`: tables, and the gnuplot scripts that draw their pictures. Fails if a file
  !> cannot be written. If pictures are requested and gnuplot is missing, the procedure writes all other files and then fails.
  subroutine write_files(self, folder, error, pictures)
    class(solution_type), intent(in) :: self
    !> Folder for the files; it is created if it does not exist
    character(len=*), intent(in) :: folder
    type(error_type), allocatable, intent(out) :: error
    !> True if gnuplot is to draw the pictures; false if absent
    logical, intent(in), optional :: pictures

    type(staging_type) :: staging
    type(context_type) :: context
    type(result_type) :: result
    type(error_type), allocatable :: picture_error
    character(len=:), allocatable :: drawn
    logical :: draws

    draws = .false.
    if (present(pictures)) draws = pictures
    ! results that only reports and pictures need are computed now
    if (self%context%reports .and. (self%context%draws .eqv. draws)) then
      result = self%result
    else
      call solve_tasks(self%context%configuration%document, self%context%configuration%schema, merge(for_pictures, for_report, &
        & draws), context, result, error)
    end if
    !$omp critical (texts_of_gestell)
    if (.not. allocated(error)) call open_staging(staging, folder, all_tables(), error, self%context%configuration%document%path)
    if (.not. allocated(error)) then
      call result%write(staging%path, self%context%head, error)
      if (allocated(error)) then
        call staging%show_final_folder(error)
        call staging%discard()
      else
        if (draws) call draw_pictures(staging%path, folder, result%figures, drawn, picture_error)
        call staging%publish(result%left(), error)
      end if
    end if
    if (allocated(picture_error) .and. .not. allocated(error)) call move_alloc(picture_error, error)
    !$omp end critical (texts_of_gestell)
  end subroutine write_files

  !> Word of the worst verdict of all tasks: stable, undamped, undecided, unstable, or the reason why no vibration exists. Blank if
  !> no task examines stability.
  pure character(len=verdict_length) function verdict(self)
    class(solution_type), intent(in) :: self

    verdict = self%result%worst%word()
  end function verdict

  !> Returns the multipliers of the machine of the input in descending magnitude, and absolute bounds on their errors. If no task
  !> computed multipliers, both arguments stay unallocated.
  pure subroutine multipliers(self, rho, errors)
    class(solution_type), intent(in) :: self
    complex(dp), allocatable, intent(out) :: rho(:)
    real(dp), allocatable, intent(out) :: errors(:)

    if (.not. allocated(self%context%analysis%multipliers)) return
    rho = self%context%analysis%multipliers%rho
    errors = abs(rho) * self%context%analysis%multipliers%error
  end subroutine multipliers

  !> Returns the vibration of the quantity called `name`. Fails if no quantity has this name or no task has computed the vibration.
  subroutine response(self, name, found, error)
    class(solution_type), intent(inout), target :: self
    !> Name of the quantity as in doc/input.md, for example "f" or "probe(outlet).v"
    character(len=*), intent(in) :: name
    type(response_type), intent(out) :: found
    type(error_type), allocatable, intent(out) :: error

    type(quantity_type) :: quantity
    type(statistics_type) :: statistics
    integer :: k

    associate (configuration => self%context%configuration, analysis => self%context%analysis)
      if (allocated(analysis%vibration)) then
        call find_quantity(analysis%frame, configuration%probes, name, quantity, error)
        if (.not. allocated(error)) call ensure_rows(self, quantity%rows(), error)
        if (.not. allocated(error)) call compute_statistics(analysis%vibration, quantity, statistics, error)
        if (.not. allocated(error)) call history_of(analysis%vibration, quantity, found%history, error)
      else
        call fatal_error(error, "the vibration was not computed: add the task 'response'", invalid_input)
      end if
      if (.not. allocated(error)) then
        found%name = name
        found%unit = trim(quantity%unit)
        found%peak = statistics%peak
        found%peak_error = statistics%peak_error
        found%rms = statistics%rms
        found%rms_error = statistics%error
        found%amplitudes = [(statistics%amplitude(k), k = 1, configuration%analysis%harmonics)]
      end if
    end associate
  end subroutine response

  !> Computes the vibration again if its stored motion has fewer than `rows` rows, the number that a quantity needs (see
  !> gestell_model_quantity_rows). Fails if the vibration cannot be computed.
  subroutine ensure_rows(solution, rows, error)
    type(solution_type), intent(inout), target :: solution
    integer, intent(in) :: rows
    type(error_type), allocatable, intent(out) :: error
    type(averaged_system), target :: model
    class(periodic_system), pointer :: system

    associate (analysis => solution%context%analysis, tasks => solution%context%configuration%analysis)
      call check_rows(analysis%vibration, rows, error)
      if (.not. allocated(error)) return
      deallocate(error)
      system => solution%context%analysis%frame
      if (tasks%averaged) then
        call analysis%frame%averaged(model)
        system => model
      end if
      call solve_vibration(system, analysis%floquet, tasks%points, tasks%harmonics, analysis%vibration, error, rows)
    end associate
  end subroutine ensure_rows

  !> Returns the table called `name`. Fails if there is no such table.
  subroutine table(self, name, found, error)
    class(solution_type), intent(in) :: self
    character(len=*), intent(in) :: name
    type(table_type), intent(out) :: found
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    call self%find_table(name, i, error)
    if (.not. allocated(error)) found = self%result%tables(i)
  end subroutine table

  !> Returns the index of the table called `name`. Fails if there is no such table; the message names the tasks that compute it.
  subroutine find_table(self, name, i, error)
    class(solution_type), intent(in) :: self
    character(len=*), intent(in) :: name
    integer, intent(out) :: i
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: tasks

    do i = 1, size(self%result%tables)
      if (self%result%tables(i)%name == name) return
    end do
    !$omp critical (texts_of_gestell)
    call list_tasks_of(name, tasks)
    if (tasks /= "") tasks = ": the task " // tasks // " computes it"
    call fatal_error(error, "there is no table '" // shown(name) // "'" // tasks, wrong_usage)
    !$omp end critical (texts_of_gestell)
  end subroutine find_table

end module gestell_api_solution
