!> Whole sweeps for the tests.
module sweeps
  use checks, only: check_success
  use data_files, only: machine_of_file
  use families, only: machine_family
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: grid_type, tile_type
  use gestell_study_point, only: sweep_options
  use gestell_task_sweep, only: solve_tile
  use gestell_study_tile_results, only: tile_results_type, verdict
  use machines, only: frame_of_machine
  use reference_machine, only: machine_data
  use testdrive, only: error_type
  implicit none (type, external)
  private

  public :: new_family, ordered, solve_grid

contains

  !> The paper's machine.
  subroutine new_family(family, error)
    type(machine_family), intent(out) :: family
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(gestell_error), allocatable :: failure

    call machine_of_file("data/khang_four_bar.nml", machine, failure)
    if (.not. allocated(failure)) call frame_of_machine(machine, family%frame, failure)
    call check_success(error, failure)
  end subroutine new_family

  !> All that follows from the multipliers.
  pure type(sweep_options) function ordered(engine) result(order)
    character(len=*), intent(in) :: engine

    order%engine = engine
    order%columns(verdict + 1:) = .false.
  end function ordered

  !> All tiles of a grid: values of shape (columns, second axis, first axis), and the last tile's results.
  subroutine solve_grid(family, grid, options, values, error, last)
    class(family_type), intent(in) :: family
    type(grid_type), intent(in) :: grid
    type(sweep_options), intent(in) :: options
    real(dp), allocatable, intent(out) :: values(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    type(tile_results_type), intent(out), optional :: last
    type(tile_results_type) :: results
    type(gestell_error), allocatable :: failure
    type(tile_type) :: tile
    integer :: k, second

    second = 1
    if (size(grid%axes) == 2) second = grid%axes(2)%count
    allocate(values(count(options%columns), second, grid%axes(1)%count))
    do k = 1, grid%tiles()
      tile = grid%tile(k)
      call solve_tile(family, grid, tile, options, results, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      values(:, tile%first(2):tile%last(2), tile%first(1):tile%last(1)) = results%values
    end do
    if (present(last)) last = results
  end subroutine solve_grid

end module sweeps
