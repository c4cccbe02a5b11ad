!> The task `sweep`: solves many machines, tile by tile. Several threads, processes or separate runs may share the work. An
!> interrupted run can be continued.
module gestell_task_sweep_task
  use gestell_base_error, only: error_type, failed_computation, fatal_error, wrong_usage
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: has_vibration, judgement_type, not_judged, operator(/=), operator(==), operator(>), stable, &
    & unjudged
  use gestell_base_text, only: integer_text, newline, text
  use gestell_input_wording, only: counted
  use gestell_output_result, only: result_type
  use gestell_output_table, only: new_table, table_type
  use gestell_study_grid, only: tile_type
  use gestell_study_tile_results, only: tile_results_type, verdict
  use gestell_task_common_task, only: all_machines, longest_table, task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_common_executor, only: work_type
  use gestell_task_common_locked_family, only: locked_family_type
  use gestell_task_sweep, only: solve_tile
  use gestell_task_sweep_checkpoint, only: campaign_type, open_campaign
  use gestell_task_sweep_columns, only: column_table, table_of
  use gestell_task_sweep_expansion_cell, only: cell_points
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_output_picture_script, only: figure_type
  use gestell_task_sweep_plot, only: most_pictures, picture_name, plot_sweep
  use gestell_task_sweep_report, only: evidence_line, report_grid, report_sweep, sweep_headline
  use gestell_task_sweep_summary, only: summary_type, verdict_count_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  !> The task `sweep`, and the files that store its finished tiles.
  type, extends(task_type), public :: sweep_task
    private
    type(campaign_type) :: campaign
  contains
    procedure :: describe, preview, run, conclude
    procedure, nopass :: prepare
  end type sweep_task

  !> Parallel work: each piece computes one tile (a rectangle of grid points). Its results are stored in files or, if `values` is
  !> allocated, in `values`.
  type, extends(work_type) :: tiles_type
    type(locked_family_type) :: family
    type(sweep_plan_type) :: plan
    type(campaign_type) :: campaign
    !> Results at all points, shape (results per point, points of the second axis, points of the first axis).
    real(dp), allocatable :: values(:, :, :)
  contains
    procedure :: compute
  end type tiles_type

contains

  pure subroutine describe(self)
    class(sweep_task), intent(inout) :: self
    integer :: i

    self%name = "sweep"
    self%meaning = "results for every machine of a line or grid of parameter values, given by `&sweep`"
    self%tables = [character(len=longest_table) :: "sweep", "sweep_columns"]
    ! the first picture has the name of the table
    do i = 2, most_pictures
      self%tables = [character(len=longest_table) :: self%tables, picture_name(i)]
    end do
    self%scope = all_machines
    self%gives_verdict = .true.
    self%brief = .true.
    self%shareable = .true.
  end subroutine describe

  !> Checks the options of the run. Fails if the exit code should depend on the verdict, but the verdict is not one of the requested
  !> columns.
  subroutine prepare(context, error)
    type(context_type), intent(in) :: context
    type(error_type), allocatable, intent(out) :: error

    if (context%fails_if_unstable .and. .not. context%configuration%plan%options%columns(verdict)) call fatal_error(error, &
      & "--fail-if-unstable needs the column 'verdict' of the sweep", wrong_usage)
  end subroutine prepare

  function preview(self, configuration) result(lines)
    class(sweep_task), intent(in) :: self
    type(configuration_type), intent(in) :: configuration
    character(len=:), allocatable :: lines

    lines = report_grid(configuration%plan)
    associate (unused_task => self)
    end associate
  end function preview

  subroutine run(self, context, result, error)
    class(sweep_task), intent(inout) :: self
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    type(summary_type) :: summary
    type(verdict_count_type), allocatable :: counts(:)
    type(judgement_type) :: judgement
    logical, allocatable :: own_tiles(:)
    integer :: i

    associate (plan => context%configuration%plan)
      if (context%one_line) then
        call compute_all(context, summary, result%brief, error)
      else if (.not. allocated(context%folder)) then
        call compute_all(context, summary, table, error)
        if (allocated(error)) return
        call result%write_lines(report_grid(plan))
        call add_results(context, summary, table, result)
      else
        own_tiles = [(mod(i - context%part, context%parts) == 0, i = 1, plan%grid%tiles())]
        call open_shared_campaign(context, own_tiles, self%campaign, error)
        if (allocated(error)) return
        if (any(self%campaign%damaged)) call result%note(context%folder // "/sweep.blocks: " &
          & // counted(count(self%campaign%damaged), "damaged tile") // ": computed again")
        call result%write_lines(report_grid(plan) // context%executor%workers_line())
        if (.not. context%merge) call compute_tiles(context, self%campaign, own_tiles, error)
        if (allocated(error)) return
        if (context%in_parts) then
          call result%write_lines(newline // "Part " // text(context%part) // " of " // text(context%parts) // ": " &
            & // counted(count(own_tiles), "tile") // " done; when all parts are done, --merge writes " &
            & // self%campaign%layout%file // newline)
          return
        end if
        if (context%executor%has_many_processes) then
          ! Some file systems lose data if two processes write to adjacent positions.
          call self%campaign%look(context%executor%share_of(size(own_tiles)))
          call context%executor%share_marks(self%campaign%done)
          if (.not. all(self%campaign%done)) then
            call fatal_error(error, context%folder // "/sweep.blocks: was damaged during the run; start the sweep again", &
              & failed_computation)
            return
          end if
        end if
        if (context%executor%is_leader()) call report_finished_sweep(context, self%campaign, summary, result, error)
        call context%executor%share_error(error)
        if (allocated(error)) return
      end if
    end associate
    counts = summary%verdict_counts()
    result%all_stable = result%all_stable .and. all(counts%verdict == stable)
    do i = 1, size(counts)
      if (.not. (has_vibration(counts(i)%verdict) .and. counts(i)%verdict > judgement%verdict)) cycle
      judgement%verdict = counts(i)%verdict
      if (judgement%verdict > stable) judgement%extent = " at " // integer_text(counts(i)%points) // " of " &
        & // integer_text(summary%points) // " points of the sweep"
    end do
    judgement%of_sweep = .true.
    if (judgement%verdict /= not_judged) call result%judge(judgement)
  end subroutine run

  !> Opens the campaign (the stored tiles of the sweep) for the tiles marked in `own_tiles`. If nothing is stored yet, one process
  !> begins the campaign. Then each process examines its share of the tiles. Fails if the stored tiles do not belong to this
  !> input, if the folder cannot be created, or if it is not visible to all processes.
  subroutine open_shared_campaign(context, own_tiles, campaign, error)
    type(context_type), intent(in) :: context
    logical, intent(in) :: own_tiles(:)
    type(campaign_type), intent(inout) :: campaign
    type(error_type), allocatable, intent(out) :: error
    logical :: examined(size(own_tiles)), is_leader

    examined = own_tiles .and. context%executor%share_of(size(own_tiles))
    is_leader = context%executor%is_leader()
    associate (configuration => context%configuration)
      if (is_leader) call open_campaign(campaign, context%folder, configuration%plan, configuration%content, error, examined)
      if (is_leader .and. .not. (context%merge .or. allocated(error))) then
        call campaign%begin(context%head%lines(new_table("sweep", "", "", unjudged)), error)
      end if
      call context%executor%share_error(error)
      if (allocated(error)) return
      if (.not. is_leader) call open_campaign(campaign, context%folder, configuration%plan, configuration%content, error, examined)
    end associate
    if (.not. (is_leader .or. allocated(error))) then
      if (.not. campaign%has_begun()) call fatal_error(error, context%folder // "/sweep.blocks: some processes cannot see " // &
        &   "this file; choose an output folder that all processes share", wrong_usage)
    end if
    call context%executor%share_error(error)
    if (allocated(error)) return
    call context%executor%share_marks(campaign%done)
    call context%executor%share_marks(campaign%damaged)
  end subroutine open_shared_campaign

  !> Reports the finished sweep: adds the table, its picture and the text to `result`. Fails if tiles are missing or the table
  !> cannot be written.
  subroutine report_finished_sweep(context, campaign, summary, result, error)
    type(context_type), intent(in) :: context
    type(campaign_type), intent(inout) :: campaign
    type(summary_type), intent(out) :: summary
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(table_type) :: table
    real(dp), allocatable :: values(:, :, :)

    associate (plan => context%configuration%plan)
      if (context%keep_all_rows) call allocate_values(plan, "--json", values, error)
      if (.not. context%keep_all_rows) allocate(values(plan%options%numbers(), 0, 0))
      if (.not. allocated(error)) call campaign%finish(context%staging, summary, error, values)
      if (allocated(error)) return
      table = table_of(plan, values)
      table%written = .true.
      call add_results(context, summary, table, result)
      call result%detail(evidence_line(summary))
    end associate
  end subroutine report_finished_sweep

  !> Allocates memory for the results at all points. Fails if there is not enough memory. The error message names the `option` that
  !> should be omitted.
  subroutine allocate_values(plan, option, values, error)
    type(sweep_plan_type), intent(in) :: plan
    character(len=*), intent(in) :: option
    real(dp), allocatable, intent(out) :: values(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: shape(2), status

    shape = 1
    shape(:size(plan%grid%axes)) = plan%grid%axes%count
    allocate(values(plan%options%numbers(), shape(2), shape(1)), stat=status)
    if (status /= 0) call fatal_error(error, &
      & "there is not enough memory to hold all points of the sweep at once; omit " // option, failed_computation)
  end subroutine allocate_values

  !> Adds the table with its picture and the text of the report to `result`.
  subroutine add_results(context, summary, table, result)
    type(context_type), intent(in) :: context
    type(summary_type), intent(in) :: summary
    type(table_type), intent(in) :: table
    type(result_type), intent(inout) :: result
    type(figure_type), allocatable :: figures(:)
    integer :: i

    associate (plan => context%configuration%plan)
      if (plan%format == "npy" .and. table%written) then
        call result%add(table)
        call result%add(column_table(table))
      else
        call result%add(table)
        figures = plot_sweep(plan, context%configuration%turns(), summary)
        do i = 1, size(figures)
          call result%add_figure(figures(i))
        end do
      end if
      call result%warn(not_judged, sweep_headline(summary))
      call result%write_lines(report_sweep(plan, summary))
    end associate
  end subroutine add_results

  !> Removes the folder that contains the stored tiles.
  subroutine conclude(self)
    class(sweep_task), intent(inout) :: self

    call self%campaign%clear()
  end subroutine conclude

  !> Computes and stores those tiles of `own_tiles` that are not finished yet.
  subroutine compute_tiles(context, campaign, own_tiles, error)
    type(context_type), intent(inout) :: context
    type(campaign_type), intent(inout) :: campaign
    logical, intent(in) :: own_tiles(:)
    type(error_type), allocatable, intent(out) :: error
    type(tiles_type) :: work
    integer, allocatable :: pending(:)
    integer :: k

    pending = pack([(k, k = 1, size(own_tiles))], own_tiles .and. .not. campaign%done)
    work%campaign = campaign
    call distribute_tiles(context, work, pending, error)
    campaign = work%campaign
    ! All pending tiles are finished: this process has computed some of them, other processes the rest.
    if (.not. allocated(error)) campaign%done(pending) = .true.
  end subroutine compute_tiles

  !> Computes all points without storing tiles in files.
  subroutine compute_all(context, summary, table, error)
    type(context_type), intent(inout) :: context
    type(summary_type), intent(out) :: summary
    type(table_type), intent(out) :: table
    type(error_type), allocatable, intent(out) :: error
    type(tiles_type) :: work
    integer :: k

    associate (plan => context%configuration%plan)
      call allocate_values(plan, "--one-line", work%values, error)
      if (allocated(error)) return
      call distribute_tiles(context, work, [(k, k = 1, plan%grid%tiles())], error)
      if (allocated(error)) return
      call summary%add_points(plan%options, [1, 1], work%values)
      ! Use the original plan: gfortran 12 loses the length of the paths in the copy in `work`.
      table = table_of(plan, work%values)
    end associate
  end subroutine compute_all

  !> Computes the given tiles. In the progress display, the weight of a tile is its number of points.
  subroutine distribute_tiles(context, work, tiles, error)
    type(context_type), intent(inout) :: context
    type(tiles_type), intent(inout) :: work
    integer, intent(in) :: tiles(:)
    type(error_type), allocatable, intent(out) :: error
    integer(int64) :: points(size(tiles))
    integer :: i

    work%plan = context%configuration%plan
    call context%members(work%plan%family, work%family)
    do i = 1, size(tiles)
      points(i) = cell_points(work%plan%grid%tile(tiles(i)))
    end do
    call context%executor%distribute(work, tiles, error, points)
  end subroutine distribute_tiles

  recursive subroutine compute(self, k, error)
    class(tiles_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error
    type(tile_type) :: tile
    type(tile_results_type) :: results

    tile = self%plan%grid%tile(k)
    call solve_tile(self%family, self%plan%grid, tile, self%plan%options, results, error)
    if (allocated(error)) return
    if (allocated(self%values)) then
      self%values(:, tile%first(2):tile%last(2), tile%first(1):tile%last(1)) = results%values
    else
      call self%campaign%store(k, results, error)
    end if
  end subroutine compute

end module gestell_task_sweep_task
