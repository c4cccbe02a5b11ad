!> Reads the input file of a run and checks whether its tasks support the options of the command line.
module gestell_run_input
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_input_namelist, only: read_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_check, only: check_document
  use gestell_input_schema_path, only: set_value
  use gestell_output_file_result_files, only: longest_table, result_files
  use gestell_output_file_staging, only: protect_input
  use gestell_run_command_line, only: options_type
  use gestell_task_common_task, only: any_task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_tasks => read_input
  implicit none (type, external)
  private

  public :: check_folder, check_options, folder_name, read_input

contains

  !> Reads the input file and sets the values that --set assigns. Fails if the file cannot be read or the input is invalid.
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
      call set_value(doc, schema, options%settings(i)%text, error)
      if (allocated(error)) return
    end do
    call check_document(doc, schema, error)
    if (allocated(error)) return
    call read_tasks(doc, schema, tasks, configuration, error)
  end subroutine read_input

  !> Checks whether the tasks support the options. If they do not, `error` has the code for wrong usage.
  subroutine check_options(options, tasks, has_many_processes, error)
    type(options_type), intent(in) :: options
    !> All tasks that exist, whether the input requests them or not
    type(any_task_type), intent(in) :: tasks(:)
    !> True if several processes (MPI ranks) share the work of the tasks
    logical, intent(in) :: has_many_processes
    type(error_type), allocatable, intent(out) :: error
    logical, dimension(size(tasks)) :: requested, shareable, brief, gives_verdict
    integer :: i

    requested = [(tasks(i)%task%requested, i = 1, size(tasks))]
    shareable = [(tasks(i)%task%shareable, i = 1, size(tasks))]
    brief = [(tasks(i)%task%brief, i = 1, size(tasks))]
    gives_verdict = [(tasks(i)%task%gives_verdict, i = 1, size(tasks))]
    if (has_many_processes .and. .not. any(requested .and. shareable)) then
      call fatal_error(error, options%input // ": gestell_mpi needs the task " // one_of(tasks, shareable) &
        & // "; use gestell for other tasks", wrong_usage)
    else if ((options%has("--part") .or. options%has("--merge")) .and. .not. any(requested .and. shareable)) then
      call fatal_error(error, "--part and --merge need the task " // one_of(tasks, shareable), wrong_usage)
    else if (options%has("--one-line") .and. .not. any(requested .and. brief)) then
      call fatal_error(error, "--one-line needs one of the tasks " // one_of(tasks, brief), wrong_usage)
    else if (options%has("--fail-if-unstable") .and. .not. any(requested .and. gives_verdict)) then
      call fatal_error(error, "--fail-if-unstable needs a task with a verdict: " // one_of(tasks, gives_verdict), wrong_usage)
    end if
  end subroutine check_options

  !> Fails if a result file of the `tasks` in `folder` would replace the input file, whose path is `path`.
  subroutine check_folder(tasks, folder, path, error)
    type(any_task_type), intent(in) :: tasks(:)
    !> `folder`: folder for the result files. `path`: full path of the input file
    character(len=*), intent(in) :: folder, path
    type(error_type), allocatable, intent(out) :: error
    character(len=longest_table), allocatable :: tables(:)
    integer :: i

    allocate(tables(0))
    do i = 1, size(tasks)
      if (.not. (tasks(i)%task%requested .and. allocated(tasks(i)%task%tables))) cycle
      tables = [character(len=longest_table) :: tables, tasks(i)%task%tables]
    end do
    call protect_input(folder, result_files(tables), path, error)
  end subroutine check_folder

  !> List of the names of those tasks for which `selected` is true, as in "'a', 'b' or 'c'".
  pure function one_of(tasks, selected) result(words)
    type(any_task_type), intent(in) :: tasks(:)
    logical, intent(in) :: selected(:)
    character(len=:), allocatable :: words
    character(len=11), allocatable :: names(:)
    integer :: i

    names = pack([(tasks(i)%task%name, i = 1, size(tasks))], selected)
    names = pack(names, [(all(names(:i - 1) /= names(i)), i = 1, size(names))])
    words = "'" // trim(names(1)) // "'"
    do i = 2, size(names)
      words = words // trim(merge(" or", ",  ", i == size(names))) // " '" // trim(names(i)) // "'"
    end do
  end function one_of

  !> Folder for the result files: the value of --output or, without this option, the name of the input file without its folders and
  !> its ending. If the name of the input file has no ending, the folder is NAME.results.
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

end module gestell_run_input
