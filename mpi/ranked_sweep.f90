!> A sweep whose tiles are computed by many ranks. Each writes its blocks itself; rank 0 makes the table of them.
module ranked_sweep
  use cli, only: options_type
  use console, only: print_out
  use driver, only: folder_name, head_of, read_input
  use gestell_base_error, only: error_type, fatal_error, invalid_input, wrong_usage
  use gestell_task_sweep_checkpoint, only: campaign_type, open_campaign
  use gestell_task_configuration, only: configuration_type
  use gestell_base_files, only: file_size
  use gestell_output_result, only: result_type
  use gestell_task, only: any_task_type
  use gestell_task_context, only: context_type
  use gestell_task_machine_report, only: report_machine
  use gestell_task_sweep_report, only: report_grid
  use gestell_task_sweep_task, only: tell_sweep
  use gestell_output_file_staging, only: open_staging, staging_type
  use gestell_task_sweep_plan, only: sweep_plan_type
  use gestell_task_sweep_summary, only: summary_type
  use gestell_input_wording, only: counted, decimal
  use gestell_task_sweep, only: solve_tile
  use gestell_study_tile_results, only: tile_results_type
  use gestell_task_locked_family, only: locked_family_type
  use queue, only: open_queue, queue_type
  use ranks, only: number_of_ranks, own_rank, same_everywhere, share_error, share_marks, share_sum
  use, intrinsic :: iso_fortran_env, only: error_unit
  implicit none (type, external)
  private

  public :: run

  character, parameter :: newline = new_line("a")

contains

  !> What gestell does with the task 'sweep'. `error` is the same on all ranks.
  subroutine run(options, error)
    type(options_type), intent(in) :: options
    type(error_type), allocatable, intent(out) :: error
    type(context_type) :: context
    type(campaign_type) :: campaign
    type(result_type) :: result
    integer, allocatable :: tiles(:)
    logical :: speaks
    integer :: i

    speaks = own_rank() == 0 .and. .not. options%quiet
    call read_orders(options, context%configuration, error)
    if (allocated(error)) return
    context%head = head_of(options, context%configuration)
    context%folder = folder_name(options)
    call result%begin(options%verbose)
    associate (configuration => context%configuration)
      call result%say(report_machine(configuration, options%input), whole=.true.)
      call result%say(report_grid(configuration%plan) // "  computed by " // counted(number_of_ranks(), "rank") // newline)
      if (speaks) call print_out(result%rest(), error)
      tiles = [(i, i = options%part, configuration%plan%grid%tiles(), options%parts)]
      call open_together(campaign, configuration, context%folder, tiles, error)
      if (.not. allocated(error)) call compute_together(campaign, configuration%plan, tiles, error)
    end associate
    if (allocated(error)) return
    if (options%in_parts) then
      call result%say(newline // "Part " // decimal(options%part) // " of " // decimal(options%parts) // ": " &
        & // counted(size(tiles), "tile") // " done; gestell --merge writes sweep.csv when all parts are." // newline)
    else
      if (own_rank() == 0) call write_table(context, campaign, result, error)
      call share_error(error)
    end if
    if (speaks .and. .not. allocated(error)) call print_out(result%rest(), error)
  end subroutine run

  !> The table of all tiles, by one rank.
  subroutine write_table(context, campaign, result, error)
    type(context_type), intent(inout) :: context
    type(campaign_type), intent(inout) :: campaign
    type(result_type), intent(inout) :: result
    type(error_type), allocatable, intent(out) :: error
    type(staging_type) :: staging
    type(summary_type) :: summary

    call open_staging(staging, context%folder, error)
    if (allocated(error)) return
    context%place = staging%place
    call tell_sweep(context, campaign, summary, result, error)
    if (.not. allocated(error)) call result%write(context%place, context%head, error)
    if (allocated(error)) then
      call staging%retell(error)
      call staging%discard()
      return
    end if
    call staging%publish(error)
    if (.not. allocated(error)) call campaign%clear()
    call result%say(newline // "files in " // context%folder // "/" // newline // result%in_short(), whole=.true.)
  end subroutine write_table

  !> The input, which every rank reads. Errors: those of gestell; no sweep is ordered.
  subroutine read_orders(options, configuration, error)
    type(options_type), intent(in) :: options
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(any_task_type), allocatable :: tasks(:)
    integer :: i

    if (options%check .or. options%fail_if_unstable .or. options%merge .or. options%one_line) then
      call fatal_error(error, "--check, --fail-if-unstable, --merge and --one-line are for gestell, one process does them", &
        & wrong_usage)
    else
      call read_input(options, tasks, configuration, error)
    end if
    if (.not. allocated(error)) then
      if (.not. any([(tasks(i)%task%ordered .and. tasks(i)%task%shared, i = 1, size(tasks))])) call fatal_error(error, &
        & options%input // ": gestell_mpi computes sweeps, and the tasks " // &
        & "name none; gestell does the rest", wrong_usage)
    end if
    call share_error(error)
    if (allocated(error)) return
    if (.not. same_everywhere(configuration%content)) call fatal_error(error, options%input // ": is not the same file for " // &
      & "all ranks", invalid_input)
  end subroutine read_orders

  !> What there is of these tiles: each rank looks for its share, after rank 0 has made the folder where it is new.
  !> Errors: blocks that do not fit; ranks that do not see the folder.
  subroutine open_together(campaign, configuration, folder, tiles, error)
    type(campaign_type), intent(out) :: campaign
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder
    integer, intent(in) :: tiles(:)
    type(error_type), allocatable, intent(out) :: error
    logical, allocatable :: mine(:)
    integer :: damaged

    allocate(mine(configuration%plan%grid%tiles()), source=.false.)
    mine(tiles(1 + own_rank()::number_of_ranks())) = .true.
    if (own_rank() == 0) then
      call open_campaign(campaign, folder, configuration%plan, configuration%content, error, mine)
      if (.not. allocated(error)) call campaign%begin(error)
    end if
    call share_error(error)
    if (allocated(error)) return
    if (own_rank() > 0) then
      call open_campaign(campaign, folder, configuration%plan, configuration%content, error, mine)
      if (.not. allocated(error) .and. file_size(folder // "/sweep.blocks/origin") < 0) call fatal_error(error, folder &
        & // "/sweep.blocks: is not there for rank " // decimal(own_rank()) // "; the ranks need a folder that they share", &
        & wrong_usage)
    end if
    call share_error(error)
    if (allocated(error)) return
    call share_marks(campaign%done)
    damaged = campaign%damaged
    call share_sum(damaged)
    if (own_rank() == 0 .and. damaged > 0) write (error_unit, "(a)") "note: " // folder // "/sweep.blocks: " // &
      & counted(damaged, "damaged block") // ": computed again"
  end subroutine open_together

  !> Computes and stores those of the tiles that are not done. Error: that of the first tile, by number, that could not be.
  subroutine compute_together(campaign, plan, tiles, error)
    type(campaign_type), intent(inout) :: campaign
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: tiles(:)
    type(error_type), allocatable, intent(out) :: error
    type(queue_type) :: queue
    type(locked_family_type) :: family
    type(tile_results_type) :: results
    integer, allocatable :: pending(:)
    integer :: k, tile

    pending = pack(tiles, .not. campaign%done(tiles))
    allocate(family%inner, source=plan%family)
    family%model = plan%order%model
    family%accuracy = plan%order%accuracy
    tile = 0
    call open_queue(queue, size(pending))
    call queue%ask()
    do
      k = queue%answer()
      if (k == 0) exit
      call queue%ask()
      tile = pending(k)
      call solve_tile(family, plan%grid, plan%grid%tile(tile), plan%order, results, error)
      if (.not. allocated(error)) call campaign%store(tile, results, error)
      if (.not. allocated(error)) cycle
      ! A tile that this rank has asked for since comes after this one: no error before this one is missed.
      k = queue%answer()
      call queue%stop_all()
      exit
    end do
    call queue%close()
    call share_error(error, tile)
    if (.not. allocated(error)) call share_marks(campaign%done)
  end subroutine compute_together

end module ranked_sweep
