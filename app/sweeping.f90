!> The task `sweep`: tiles by threads, each tile by one.
module sweeping
  use console, only: tell
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_task_sweep_checkpoint, only: campaign_type, open_campaign
  use gestell_task_configuration, only: configuration_type
  use gestell_task_sweep_plan, only: sweep_plan_type
  use gestell_task_sweep_summary, only: summary_type
  use gestell_base_wording, only: counted
  use gestell_study_grid, only: tile_type
  use gestell_task_sweep, only: solve_tile
  use gestell_study_tile_results, only: tile_results_type
  use locked_family, only: locked_family_type
  use terminal, only: progress_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: compute_all, compute_tiles, open_sweep

  !> What the threads share.
  type :: work_type
    type(locked_family_type) :: family
    type(progress_type) :: progress
    !> The error of the first tile that failed.
    integer :: failed = huge(1)
    type(error_type), allocatable :: error
  end type work_type

contains

  !> What there is of a sweep, part `part` of `parts`. Error: blocks that do not fit.
  subroutine open_sweep(configuration, folder, part, parts, campaign, mine, error)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder
    integer, intent(in) :: part, parts
    type(campaign_type), intent(out) :: campaign
    logical, allocatable, intent(out) :: mine(:)
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    mine = [(mod(i - part, parts) == 0, i = 1, configuration%plan%grid%tiles())]
    call open_campaign(campaign, folder, configuration%plan, configuration%content, error, mine)
    if (allocated(error)) return
    if (campaign%damaged > 0) call tell("note: " // folder // "/sweep.blocks: " // &
      & counted(campaign%damaged, "damaged block") // ": computed again")
  end subroutine open_sweep

  !> Computes and stores those of `mine` that are not done.
  !> Error: that of the first tile, by number, that could not be computed or stored.
  subroutine compute_tiles(plan, campaign, mine, error)
    type(sweep_plan_type), intent(in) :: plan
    type(campaign_type), intent(inout) :: campaign
    logical, intent(in) :: mine(:)
    type(error_type), allocatable, intent(out) :: error
    type(work_type) :: work
    integer, allocatable :: pending(:)
    integer :: k

    call campaign%begin(error)
    if (allocated(error)) return
    pending = pack([(k, k = 1, size(mine))], mine .and. .not. campaign%done)
    allocate(work%family%inner, source=plan%family)
    work%family%model = plan%order%model
    work%family%accuracy = plan%order%accuracy
    call work%progress%start(sum([(points_of(plan%grid%tile(pending(k))), k = 1, size(pending))]))
    !$omp parallel do schedule(dynamic, 1)
    do k = 1, size(pending)
      call compute(plan, pending(k), work, campaign=campaign)
    end do
    !$omp end parallel do
    call work%progress%clear()
    if (allocated(work%error)) call move_alloc(work%error, error)
  end subroutine compute_tiles

  !> Computes all points at once, nothing is stored; shape (ordered columns, points of the second axis, of the first).
  subroutine compute_all(plan, values, error)
    type(sweep_plan_type), intent(in) :: plan
    real(dp), allocatable, intent(out) :: values(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    type(work_type) :: work
    integer :: shape(2), k, status

    shape = 1
    shape(:size(plan%grid%axes)) = plan%grid%axes%count
    allocate(values(count(plan%order%columns), shape(2), shape(1)), stat=status)
    if (status /= 0) then
      call fatal_error(error, "there is no memory for all points of the sweep at once; leave out --one-line", failed_computation)
      return
    end if
    allocate(work%family%inner, source=plan%family)
    work%family%model = plan%order%model
    work%family%accuracy = plan%order%accuracy
    call work%progress%start(plan%grid%points())
    !$omp parallel do schedule(dynamic, 1)
    do k = 1, plan%grid%tiles()
      call compute(plan, k, work, values=values)
    end do
    !$omp end parallel do
    call work%progress%clear()
    if (allocated(work%error)) call move_alloc(work%error, error)
  end subroutine compute_all

  !> One tile, on one of the threads. Tiles behind one that failed are left out; those before it are begun already.
  recursive subroutine compute(plan, number, work, campaign, values)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: number
    type(work_type), intent(inout) :: work
    type(campaign_type), intent(inout), optional :: campaign
    real(dp), intent(inout), optional :: values(:, :, :)
    type(tile_type) :: tile
    type(tile_results_type) :: results
    type(error_type), allocatable :: error
    integer :: failed

    !$omp atomic read
    failed = work%failed
    if (number > failed) return
    tile = plan%grid%tile(number)
    call solve_tile(work%family, plan%grid, tile, plan%order, results, error)
    !$omp critical (input_and_output)
    if (.not. allocated(error)) then
      if (present(campaign)) call campaign%store(number, results, error)
      if (present(values)) values(:, tile%first(2):tile%last(2), tile%first(1):tile%last(1)) = results%values
    end if
    if (allocated(error) .and. number < work%failed) then
      !$omp atomic write
      work%failed = number
      call move_alloc(error, work%error)
    end if
    call work%progress%add(points_of(tile))
    !$omp end critical (input_and_output)
  end subroutine compute

  pure integer(int64) function points_of(tile)
    type(tile_type), intent(in) :: tile

    points_of = product(int(tile%last - tile%first + 1, int64))
  end function points_of

end module sweeping
