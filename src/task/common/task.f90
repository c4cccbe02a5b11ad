!> Defines a task: a kind of result that the user can request. For a new task, create a folder in src/task and an entry in the
!> registry.
module gestell_task_common_task
  use gestell_base_error, only: error_type
  use gestell_input_schema, only: schema_type
  use gestell_output_file_result_files, only: longest_table
  use gestell_output_result, only: result_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  implicit none (type, external)
  private

  public :: longest_table

  !> Machines that a task examines. `own_machine`: the machine of the input, with its vibration. `all_machines`: all machines of the
  !> sweep. `all_speeds`: the machine of the input at all speeds of the sweep. `unsolved_machine`: the machine of the input, without
  !> its vibration.
  integer, parameter, public :: own_machine = 1, all_machines = 2, all_speeds = 3, unsolved_machine = 4

  !> A task: computes and reports one kind of result.
  type, abstract, public :: task_type
    !> Name of the task in the input, for example 'sweep'.
    character(len=11) :: name = ""
    !> Sentence that explains what the task computes, for --help and the manual. Blank if an earlier task in the registry has the
    !> same name
    character(len=112) :: meaning = ""
    !> Names of all tables that the task may write. Only files of these tables are moved to the final folder of results.
    character(len=longest_table), allocatable :: tables(:)
    !> Machines that the task examines: `own_machine`, `all_machines`, `all_speeds` or `unsolved_machine`
    integer :: scope = own_machine
    !> `gives_verdict`: true if the task gives a verdict. `brief`: true if it contributes to the line of --one-line.
    !> `drawn_with_plot`: true if its picture is drawn for --plot and --report even if the task is not requested. `shareable`: true
    !> if several runs can share its work.
    logical :: gives_verdict = .false., brief = .false., drawn_with_plot = .false., shareable = .false.
    !> `requested`: true if the input requests the task. `needed_for_picture`: true if its picture is needed for --plot or --report
    !> (see `drawn_with_plot`).
    logical :: requested = .false., needed_for_picture = .false.
  contains
    procedure(describe), deferred :: describe
    procedure, nopass :: extend => extend_nothing
    procedure :: read => read_nothing
    procedure, nopass :: prepare => prepare_nothing
    procedure :: preview => no_preview
    procedure(run), deferred :: run
    procedure :: conclude => conclude_nothing
  end type task_type

  !> Container for a task of any type. With it tasks of different types can be elements of an array.
  type, public :: any_task_type
    class(task_type), allocatable :: task
  end type any_task_type

  abstract interface
    !> Sets the components that are constant for all tasks of this type: name, meaning, tables, and the machines that it examines.
    pure subroutine describe(self)
      import :: task_type
      implicit none (type, external)
      class(task_type), intent(inout) :: self
    end subroutine describe

    !> Computes and reports the results of the task. If an error occurs, the results already added to `result` remain valid.
    subroutine run(self, context, result, error)
      import :: task_type, context_type, result_type, error_type
      implicit none (type, external)
      class(task_type), intent(inout) :: self
      type(context_type), intent(inout) :: context
      type(result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
    end subroutine run
  end interface

contains

  !> Default of `extend`, which does nothing. Overriding versions add the groups and keys of the task to the schema of the input.
  subroutine extend_nothing(schema)
    type(schema_type), intent(inout) :: schema

    associate (unused => schema)
    end associate
  end subroutine extend_nothing

  !> Default of `read`, which does nothing. Overriding versions read the keys of the task, even if it is not requested, and record
  !> which results for the machine it needs. They fail if the input file is invalid.
  subroutine read_nothing(self, configuration, error)
    class(task_type), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    associate (unused_task => self, unused_machine => configuration)
    end associate
  end subroutine read_nothing

  !> Default of `prepare`, which does nothing. Overriding versions fail if the task does not support the options of the run.
  subroutine prepare_nothing(context, error)
    type(context_type), intent(in) :: context
    type(error_type), allocatable, intent(out) :: error

    associate (unused => context)
    end associate
  end subroutine prepare_nothing

  !> Default of `preview`, which returns no lines. Overriding versions return the lines on the task that --check prints.
  function no_preview(self, configuration) result(lines)
    class(task_type), intent(in) :: self
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines

    lines = ""
    associate (unused_task => self, unused_machine => configuration)
    end associate
  end function no_preview

  !> Default of `conclude`, which does nothing. Overriding versions complete the task after all files have been moved to their final
  !> folder.
  subroutine conclude_nothing(self)
    class(task_type), intent(inout) :: self

    associate (unused => self)
    end associate
  end subroutine conclude_nothing

end module gestell_task_common_task
