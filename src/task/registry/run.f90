!> Prepares and runs all requested tasks, one after the other, for the program and for the libraries.
module gestell_task_registry_run
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: undecided
  use gestell_output_result, only: result_type
  use gestell_task_common_task, only: all_speeds, any_task_type, own_machine
  use gestell_task_common_context, only: context_type
  use gestell_task_drawing_report, only: report_mechanism
  use gestell_task_machine, only: add_machine_columns, solve_machine
  use gestell_task_drawing_frequencies, only: report_frequencies
  use gestell_task_machine_report, only: input_warnings
  use gestell_task_registry, only: requests_any
  implicit none (type, external)
  private

  public :: prepare_tasks, run_tasks

  !> Receives the results of a run as soon as they are available, for example in order to print them.
  type, abstract, public :: listener_type
  contains
    procedure(receive), deferred :: receive
  end type listener_type

  abstract interface
    !> Receives that part of the report in `result` that was added after the previous call.
    subroutine receive(self, result)
      import :: listener_type, result_type
      implicit none (type, external)
      class(listener_type), intent(inout) :: self
      type(result_type), intent(inout) :: result
    end subroutine receive
  end interface

  character, parameter :: newline = new_line("a")

contains

  !> Makes the result empty, and prepares the requested tasks. Fails if a task does not support the options of the run.
  subroutine prepare_tasks(tasks, context, result, error)
    type(any_task_type), intent(inout) :: tasks(:)
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    if (.not. allocated(context%executor)) allocate(context%executor)
    call result%begin(context%verbose, context%configuration%result_units)
    do i = 1, size(tasks)
      tasks(i)%task%needed_for_picture = tasks(i)%task%drawn_with_plot .and. context%draws
      if (tasks(i)%task%requested) call tasks(i)%task%prepare(context, error)
      if (allocated(error)) return
    end do
  end subroutine prepare_tasks

  !> Runs the tasks that `prepare_tasks` has prepared, and adds the warnings on the input. If a task fails, its error is returned,
  !> and the tasks after it are not started.
  subroutine run_tasks(tasks, context, result, error, listener)
    !> All tasks; those that neither the input nor a picture requires are skipped
    type(any_task_type), intent(inout) :: tasks(:)
    !> The machine, the options and the executor
    type(context_type), intent(inout) :: context
    !> Collects the reports, tables and pictures
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    !> Receives the results of each task as soon as they are complete
    class(listener_type), intent(inout), optional :: listener

    if (context%only_checks) then
      call preview_tasks(tasks, context, result, error)
    else
      call compute_tasks(tasks, context, result, error, listener)
    end if
    if (context%reports) call result%warn_each(undecided, input_warnings(context%configuration), printed=.true.)
    if (present(listener)) call listener%receive(result)
  end subroutine run_tasks

  !> Reports the mechanism, and what the tasks would compute. Runs only the tasks that are needed for pictures.
  subroutine preview_tasks(tasks, context, result, error)
    type(any_task_type), intent(inout) :: tasks(:)
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    logical :: is_possible
    integer :: i

    is_possible = .not. allocated(context%configuration%impossible)
    associate (frame => context%configuration%frame)
      if (is_possible) call result%write_lines(report_mechanism(frame) // report_frequencies(frame))
    end associate
    do i = 1, size(tasks)
      associate (task => tasks(i)%task)
        if (task%requested) call result%write_lines(task%preview(context%configuration))
        if (task%needed_for_picture .and. is_possible) call task%run(context, result, error)
      end associate
      if (allocated(error)) return
    end do
    call result%write_lines(newline // "The input is valid; with --check no vibration is computed." // newline)
  end subroutine preview_tasks

  !> Computes the vibration of the input's machine, if a task needs it, and the results of the tasks.
  subroutine compute_tasks(tasks, context, result, error, listener)
    type(any_task_type), intent(inout) :: tasks(:)
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    class(listener_type), intent(inout), optional :: listener
    logical :: parts, others
    integer :: i

    parts = context%in_parts .or. context%merge .or. context%executor%has_many_processes
    others = any([(tasks(i)%task%requested .and. tasks(i)%task%scope /= own_machine, i = 1, size(tasks))])
    if (.not. parts .and. (requests_any(tasks, own_machine) .or. .not. others)) then
      if (.not. allocated(context%configuration%impossible)) call solve_machine(context, result, error)
      if (allocated(error)) return
    end if
    if (requests_any(tasks, all_speeds)) then
      if (context%configuration%plan%grid%axes(1)%from * context%configuration%frame%speed < 0) call result%write_lines(newline &
        & // "note: the speeds of &sweep and the speed of &drive have opposite signs" // newline)
    end if
    do i = 1, size(tasks)
      associate (task => tasks(i)%task)
        if (.not. (task%requested .or. task%needed_for_picture) .or. parts .and. .not. task%shareable) cycle
        if (context%one_line .and. .not. task%brief) cycle
        if (allocated(context%configuration%impossible) .and. task%scope == own_machine) cycle
        ! Results for the machine of the input are passed on together, after their headlines. Results of other tasks are passed on
        ! at once.
        if (present(listener) .and. task%scope /= own_machine) call listener%receive(result)
        call task%run(context, result, error)
      end associate
      if (allocated(error)) return
      if (present(listener) .and. tasks(i)%task%scope /= own_machine) call listener%receive(result)
    end do
    if (requests_any(tasks, own_machine)) call add_machine_columns(context, result)
  end subroutine compute_tasks

end module gestell_task_registry_run
