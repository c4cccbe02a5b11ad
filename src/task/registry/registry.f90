!> Reads the tasks that an input requests, and builds the schema of the input with the keys of all tasks. The list of tasks is in a
!> submodule: if a task changes, only this task and the list are compiled again.
module gestell_task_registry
  use gestell_base_error, only: error_type
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: document_type, group_named
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_fingerprint, only: content_hash
  use gestell_input_schema_read, only: read
  use gestell_task_common_task, only: all_machines, all_speeds, any_task_type, longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type, read_machine, read_plan
  use gestell_task_registry_keys, only: schema_of
  use gestell_task_common_keys, only: case_keys_of
  use gestell_task_machine, only: own_table
  implicit none (type, external)
  private

  public :: all_tables, all_tasks, input_schema, list_tasks_of, requests_any, read_configuration, read_input

  interface
    !> Creates the list of all tasks, with their names, tables and other constant components (src/task/registry/list.f90).
    module subroutine all_tasks(tasks)
      implicit none (type, external)
      type(any_task_type), allocatable, intent(out) :: tasks(:)
    end subroutine all_tasks
  end interface

contains

  !> Reads the tasks and the machine from a checked input document. Fails if a value in the document is invalid; the error message
  !> states where it is in the input file.
  subroutine read_input(doc, schema, tasks, configuration, error)
    !> The checked input document
    type(document_type), intent(in) :: doc
    !> Groups and keys that are allowed in an input
    type(schema_type), intent(in) :: schema
    !> All tasks. `requested` is true for those that the document requests
    type(any_task_type), allocatable, intent(out) :: tasks(:)
    !> The machine, and the settings shared by all tasks
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: names(:)
    integer :: i

    call all_tasks(tasks)
    configuration%document = doc
    configuration%schema = schema
    configuration%content = content_hash(doc, schema)
    call read(group_named(doc, "case"), case_keys_of(names_of(tasks)), "tasks", names, error)
    if (allocated(error)) return
    do i = 1, size(tasks)
      tasks(i)%task%requested = any(names == tasks(i)%task%name)
    end do
    call read_machine(configuration, size(names) == 0 &
      & .or. any([(tasks(i)%task%requested .and. tasks(i)%task%scope /= all_machines, i = 1, size(tasks))]), error)
    if (allocated(error)) return
    if (requests_any(tasks, all_machines) .or. requests_any(tasks, all_speeds)) then
      call read_plan(configuration, requests_any(tasks, all_speeds), error)
    end if
    if (allocated(error)) return
    do i = 1, size(tasks)
      if (allocated(configuration%impossible) .and. .not. tasks(i)%task%requested) cycle
      call tasks(i)%task%read(configuration, error)
      if (allocated(error)) return
    end do
  end subroutine read_input

  !> Names of all tables that the tasks of a run may write.
  function all_tables() result(names)
    character(len=longest_table), allocatable :: names(:)
    type(any_task_type), allocatable :: tasks(:)
    integer :: i

    call all_tasks(tasks)
    names = [own_table]
    do i = 1, size(tasks)
      if (allocated(tasks(i)%task%tables)) names = [names, tasks(i)%task%tables]
    end do
    names = pack(names, [(all(names(:i - 1) /= names(i)), i = 1, size(names))])
  end function all_tables

  !> Returns the names of the tasks that compute a table, as in "'modes' or 'stability'"; empty if there are none.
  subroutine list_tasks_of(table, list)
    character(len=*), intent(in) :: table
    character(len=:), allocatable, intent(out) :: list
    type(any_task_type), allocatable :: tasks(:)
    integer :: i

    call all_tasks(tasks)
    list = ""
    do i = 1, size(tasks)
      if (.not. allocated(tasks(i)%task%tables)) cycle
      if (.not. any(tasks(i)%task%tables == table)) cycle
      if (list /= "") list = list // " or "
      list = list // "'" // trim(tasks(i)%task%name) // "'"
    end do
  end subroutine list_tasks_of

  !> Schema of the input file, with the groups of all tasks.
  function input_schema() result(schema)
    type(schema_type) :: schema
    type(any_task_type), allocatable :: tasks(:)
    integer :: i

    call all_tasks(tasks)
    ! Tasks with a name that occurs before have no meaning, so that the names and meanings agree.
    schema = schema_of(names_of(tasks), pack([(tasks(i)%task%meaning, i = 1, size(tasks))], &
      & [(tasks(i)%task%meaning /= "", i = 1, size(tasks))]))
    do i = 1, size(tasks)
      call tasks(i)%task%extend(schema)
    end do
  end function input_schema

  !> Reads only the machine and the shared settings from a checked input document, not the keys of single tasks.
  subroutine read_configuration(doc, configuration, error)
    type(document_type), intent(in) :: doc
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(any_task_type), allocatable :: tasks(:)

    call read_input(doc, input_schema(), tasks, configuration, error)
  end subroutine read_configuration

  !> True if a requested task examines the machines that `scope` denotes, a constant such as `own_machine`.
  pure logical function requests_any(tasks, scope)
    type(any_task_type), intent(in) :: tasks(:)
    integer, intent(in) :: scope
    integer :: i

    requests_any = any([(tasks(i)%task%requested .and. tasks(i)%task%scope == scope, i = 1, size(tasks))])
  end function requests_any

  !> Names of all tasks that can be requested. Each name occurs once.
  pure function names_of(tasks) result(names)
    type(any_task_type), intent(in) :: tasks(:)
    character(len=11), allocatable :: names(:)
    integer :: i

    names = [(tasks(i)%task%name, i = 1, size(tasks))]
    names = pack(names, [(all(names(:i - 1) /= names(i)), i = 1, size(names))])
  end function names_of

end module gestell_task_registry
