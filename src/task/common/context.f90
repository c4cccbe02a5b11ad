!> What a task is run with: the machine, what the options ask for, where files go, who does the work.
module gestell_task_common_context
  use gestell_output_head, only: head_type, setting_type
  use gestell_output_result, only: result_type
  use gestell_system_family, only: family_type
  use gestell_study_vibration_analysis, only: analysis_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_executor, only: executor_type
  use gestell_task_common_journal, only: open_journal
  use gestell_task_common_locked_family, only: locked_family_type
  implicit none (type, external)
  private

  public :: keep_journal

  type, public :: context_type
    type(configuration_type) :: configuration
    !> What heads tables.
    type(head_type) :: head
    !> Where the files of the run will stand, and where they are written until then.
    character(len=:), allocatable :: folder, staging
    !> Whether people read a report; whether one line is all that is wanted.
    logical :: reports = .true., one_line = .false.
    !> Whether all rows of all tables are wanted when they are written.
    logical :: keeps_rows = .false.
    !> Whether the verdict decides on the exit code.
    logical :: fails_if_unstable = .false.
    !> The share of a sweep that is computed; whether its parts are put together.
    integer :: part = 1, parts = 1
    logical :: in_parts = .false., merge = .false.
    class(executor_type), allocatable :: executor
    !> What was found of the input's own machine.
    type(analysis_type) :: analysis
    !> What a task keeps for others.
    class(*), allocatable :: kept
  contains
    procedure :: members
    procedure :: entitle
  end type context_type

contains

  !> The machines of `family` by the frame's model, or by another one unless that is averaged, as several threads may ask for them.
  subroutine members(self, family, locked, model)
    class(context_type), intent(in) :: self
    class(family_type), intent(in) :: family
    type(locked_family_type), intent(out) :: locked
    character(len=*), intent(in), optional :: model

    allocate(locked%inner, source=family)
    locked%model = self%configuration%model()
    if (present(model) .and. .not. self%configuration%analysis%averaged) locked%model = model
    locked%accuracy = self%configuration%accuracy
  end subroutine members

  !> What heads tables, of the `input` of this name and what was set from outside.
  subroutine entitle(self, input, settings)
    class(context_type), intent(inout) :: self
    character(len=*), intent(in) :: input
    type(setting_type), intent(in) :: settings(:)

    self%head%title = self%configuration%title
    self%head%input = input
    self%head%model = self%configuration%model()
    self%head%held_by = trim(self%configuration%frame%held_by)
    self%head%settings = settings
  end subroutine entitle

  !> Lets the executor keep what is done where the files are written, and take what an interrupted run has left there.
  subroutine keep_journal(context, result)
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result

    allocate(context%executor%journal)
    call open_journal(context%executor%journal, context%staging, context%configuration%content)
    if (context%executor%journal%damaged) call result%note(context%folder // ": what an interrupted run has left is damaged: " &
      & // "computed again as far as it is")
  end subroutine keep_journal

end module gestell_task_common_context
