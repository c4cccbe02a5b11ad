!> A task: a result that the user can request. A new task is a folder beside this file and an entry in the registry.
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

  !> Machines with which a task deals. `own_machine`: the machine of the input and its vibration. `all_machines`: the machines in
  !> the ranges of the sweep. `all_speeds`: the machine of the input at all speeds of the sweep. `unsolved_machine`: the machine of
  !> the input, whose vibration is not needed.
  integer, parameter, public :: own_machine = 1, all_machines = 2, all_speeds = 3, unsolved_machine = 4

  !> Maximum length of the sentence on a task.
  integer, parameter, public :: longest_meaning = 112

  !> A task of any kind.
  type, abstract, public :: task_type
    !> Name of the task in the input.
    character(len=11) :: name = ""
    !> What the task computes, for --help and manual; blank if another task of this name comes before
    character(len=longest_meaning) :: meaning = ""
    !> Names of all tables that the task may write. Only these are moved to the folder of results.
    character(len=longest_table), allocatable :: tables(:)
    !> Machines with which the task deals
    integer :: about = own_machine
    !> `judges`: true if the task gives a verdict. `brief`: true if it contributes to the line of --one-line. `pictured`: true if
    !> its picture belongs to every run with pictures. `shared`: true if several runs can share its work.
    logical :: judges = .false., brief = .false., pictured = .false., shared = .false.
    !> True if the input requests the task; true if an option needs the task for its picture only.
    logical :: ordered = .false., implied = .false.
  contains
    procedure(describe), deferred :: describe
    procedure, nopass :: extend => extend_nothing
    procedure :: read => read_nothing
    procedure, nopass :: prepare => prepare_nothing
    procedure :: preview => no_preview
    procedure(run), deferred :: run
    procedure :: settle => settle_nothing
  end type task_type

  !> Container for a task of any type.
  type, public :: any_task_type
    class(task_type), allocatable :: task
  end type any_task_type

  abstract interface
    !> Sets the components that are equal for all tasks of this type.
    pure subroutine describe(self)
      import :: task_type
      implicit none (type, external)
      class(task_type), intent(inout) :: self
    end subroutine describe

    !> Computes the results of the task and reports them. On error the results already in `result` remain valid.
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

  !> Adds the groups and keys of this task to the schema of the input.
  subroutine extend_nothing(schema)
    type(schema_type), intent(inout) :: schema

    associate (unused => schema)
    end associate
  end subroutine extend_nothing

  !> Reads the keys of this task, even if it is not requested, and registers the results of the machine that it needs. Errors refer
  !> to the input file.
  subroutine read_nothing(self, configuration, error)
    class(task_type), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    associate (unused_task => self, unused_machine => configuration)
    end associate
  end subroutine read_nothing

  !> Checks that the task supports the options of the run. Error: wrong usage.
  subroutine prepare_nothing(context, error)
    type(context_type), intent(in) :: context
    type(error_type), allocatable, intent(out) :: error

    associate (unused => context)
    end associate
  end subroutine prepare_nothing

  !> Lines that --check prints on this task.
  function no_preview(self, configuration) result(lines)
    class(task_type), intent(in) :: self
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines

    lines = ""
    associate (unused_task => self, unused_machine => configuration)
    end associate
  end function no_preview

  !> Final steps of the task after all files have been published.
  subroutine settle_nothing(self)
    class(task_type), intent(inout) :: self

    associate (unused => self)
    end associate
  end subroutine settle_nothing

end module gestell_task_common_task
