!> The task `boundary`.
module bordering
  use gestell_base_error, only: error_type
  use gestell_io_borders_csv, only: write_borders
  use gestell_io_configuration, only: configuration_type
  use gestell_io_plot_borders, only: plot_borders
  use gestell_study_boundary_task, only: border_results_type, solve_borders
  implicit none (type, external)
  private

  public :: run_borders

contains

  !> Finds the borders and writes boundary.csv with its script to `folder`.
  subroutine run_borders(configuration, folder, preamble, results, error)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: folder, preamble(:)
    type(border_results_type), intent(out) :: results
    type(error_type), allocatable, intent(out) :: error

    associate (plan => configuration%plan)
      if (allocated(plan%base)) then
        call solve_borders(plan%family, plan%grid, plan%borders, results, error, plan%base)
      else
        call solve_borders(plan%family, plan%grid, plan%borders, results, error)
      end if
      if (.not. allocated(error)) call write_borders(folder, preamble, plan%paths, results, error)
      if (.not. allocated(error)) call plot_borders(folder, preamble, plan%paths, plan%units, plan%grid, results, error)
    end associate
  end subroutine run_borders

end module bordering
