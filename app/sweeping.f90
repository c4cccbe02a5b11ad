!> The task `sweep`.
module sweeping
  use gestell_base_error, only: error_type
  use gestell_io_campaign, only: campaign_type, open_campaign
  use gestell_io_configuration, only: configuration_type
  use gestell_io_sweep_summary, only: summary_type
  use gestell_io_text, only: counted
  use gestell_study_sweep, only: solve_tile
  use gestell_study_tile_results, only: tile_results_type
  use, intrinsic :: iso_fortran_env, only: error_unit
  implicit none (type, external)
  private

  public :: run_sweep

contains

  !> Computes the tiles that are not done and writes sweep.csv to `folder`.
  subroutine run_sweep(configuration, folder, preamble, summary, error)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, preamble(:)
    type(summary_type), intent(out) :: summary
    type(error_type), allocatable, intent(out) :: error
    type(campaign_type) :: campaign
    type(tile_results_type) :: results
    integer :: i

    associate (plan => configuration%plan)
      call open_campaign(campaign, folder, plan, configuration%content, error)
      if (allocated(error)) return
      if (campaign%damaged > 0) write (error_unit, "(a)") "note: " // folder // "/sweep.blocks: " // &
        & counted(campaign%damaged, "damaged block") // " will be computed again"
      call campaign%begin(error)
      do i = 1, size(campaign%done)
        if (allocated(error)) return
        if (campaign%done(i)) cycle
        call solve_tile(plan%family, plan%grid, plan%grid%tile(i), plan%order, results, error)
        if (.not. allocated(error)) call campaign%store(i, results, error)
      end do
      if (.not. allocated(error)) call campaign%finish(preamble, summary, error)
    end associate
  end subroutine run_sweep

end module sweeping
