!> Everything that a task can use during a run: the machine, the command-line options, the folders of the files, and the executor.
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

  !> Environment in which a task runs.
  type, public :: context_type
    type(configuration_type) :: configuration
    !> Header that is written into all tables.
    type(head_type) :: head
    !> `folder`: folder in which the results finally are. `staging`: folder in which files are written until the run is complete.
    character(len=:), allocatable :: folder, staging
    !> `reports`: true if a report is printed. `one_line`: true if a single line of results is requested.
    logical :: reports = .true., one_line = .false.
    !> `verbose`: true if the report includes the diagnostics. `draws`: true if pictures are drawn. `only_checks`: true if the tasks
    !> report what they would compute, but compute nothing.
    logical :: verbose = .false., draws = .false., only_checks = .false.
    !> True if the tables that describe the mechanism are written even if they are not requested: with --check, and for the HTML
    !> page.
    logical :: describes_mechanism = .false.
    !> True if all rows of all tables must be kept in memory after they have been written.
    logical :: keep_all_rows = .false.
    !> True if an unstable machine leads to a special exit code.
    logical :: fails_if_unstable = .false.
    !> `part`: number of that part of a sweep which this run computes. `parts`: number of parts.
    integer :: part = 1, parts = 1
    !> `in_parts`: true if the sweep is divided into parts. `merge`: true if this run combines the results of all parts.
    logical :: in_parts = .false., merge = .false.
    class(executor_type), allocatable :: executor
    !> Results for the machine of the input.
    type(analysis_type) :: analysis
    !> A result that one task stores here so that a later task can use it.
    class(*), allocatable :: stored_result
  contains
    procedure :: members, fill_header, is_presented
  end type context_type

contains

  !> Wraps `family` as `locked`, from which several threads may request members at the same time. Each member is linearised by the
  !> configured model of the frame, or by `model` if present. If the coefficients are averaged, `model` is ignored.
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

  !> False if nobody reads headlines or looks at pictures: for a line of results, and for a program that calls the library without a
  !> report. Neither they nor results that only they need are computed then.
  pure logical function is_presented(self)
    class(context_type), intent(in) :: self

    is_presented = self%reports .or. .not. (self%one_line .or. self%keep_all_rows)
  end function is_presented

  !> Sets the header of all tables from the name of the input and the settings of the command line.
  subroutine fill_header(self, input, settings)
    class(context_type), intent(inout) :: self
    character(len=*), intent(in) :: input
    type(setting_type), intent(in) :: settings(:)

    self%head%title = self%configuration%title
    self%head%input = input
    self%head%model = trim(self%configuration%model())
    self%head%held_by = trim(self%configuration%frame%held_by)
    self%head%settings = settings
  end subroutine fill_header

  !> Opens the journal in the folder in which files are written. The executor stores finished pieces of work in it. If an earlier
  !> run was interrupted, the executor reads the results of that run from the journal.
  subroutine keep_journal(context, result)
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result

    allocate(context%executor%journal)
    call open_journal(context%executor%journal, context%staging, context%configuration%content)
    if (context%executor%journal%damaged) call result%note(context%folder // ": the journal of an interrupted run is damaged; " &
      & // "its damaged part is computed again")
  end subroutine keep_journal

end module gestell_task_common_context
