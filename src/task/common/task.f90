!> A task: an answer that the user can order. A new one is a folder beside this file and a line in the registry.
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

  !> What a task is about: the machine of the input, solved; others in the ranges of the sweep; it at all speeds of the sweep; the
  !> machine of the input as it is read.
  integer, parameter, public :: own_machine = 1, all_machines = 2, all_speeds = 3, unsolved_machine = 4

  type, abstract, public :: task_type
    !> As it is ordered; what it is about; whether it has a verdict, a part in what is told on one line, a picture that belongs to
    !> every run with pictures, pieces that several runs can share.
    character(len=11) :: name = ""
    !> The names of all tables that it can leave: files of other names would not find their way into the folder of results.
    character(len=longest_table), allocatable :: tables(:)
    integer :: about = own_machine
    logical :: judges = .false., brief = .false., pictured = .false., shared = .false.
    !> Whether the input orders it; whether an option does, for its picture alone.
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

  !> Any task.
  type, public :: any_task_type
    class(task_type), allocatable :: task
  end type any_task_type

  abstract interface
    !> Sets what the components say of every task of its kind.
    pure subroutine describe(self)
      import :: task_type
      implicit none (type, external)
      class(task_type), intent(inout) :: self
    end subroutine describe

    !> Computes, and tells what was found. Error: it could not be computed; what came before it in `result` stands.
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

  !> Adds the groups and keys that are the task's own to what an input can say.
  subroutine extend_nothing(schema)
    type(schema_type), intent(inout) :: schema

    associate (unused => schema)
    end associate
  end subroutine extend_nothing

  !> Reads the task's own keys, also where it was not ordered, and enters what it needs of the machine. Errors point into the
  !> input.
  subroutine read_nothing(self, configuration, error)
    class(task_type), intent(inout) :: self
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error

    associate (unused_task => self, unused_machine => configuration)
    end associate
  end subroutine read_nothing

  !> Looks whether it can do what the options ask for. Error: wrong usage.
  subroutine prepare_nothing(context, error)
    type(context_type), intent(in) :: context
    type(error_type), allocatable, intent(out) :: error

    associate (unused => context)
    end associate
  end subroutine prepare_nothing

  !> What --check tells of it.
  function no_preview(self, configuration) result(lines)
    class(task_type), intent(in) :: self
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines

    lines = ""
    associate (unused_task => self, unused_machine => configuration)
    end associate
  end function no_preview

  !> What is to be done when all files are published.
  subroutine settle_nothing(self)
    class(task_type), intent(inout) :: self

    associate (unused => self)
    end associate
  end subroutine settle_nothing

end module gestell_task_common_task
