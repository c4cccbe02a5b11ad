!> The task `boundary`.
module bordering
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_task_boundary_csv, only: write_borders
  use gestell_task_configuration, only: configuration_type
  use gestell_task_boundary_plot, only: plot_borders
  use gestell_task_sweep_plan, only: sweep_plan_type
  use gestell_task_boundary, only: border_accuracy
  use gestell_task_boundary_map, only: border_line_type, border_lines
  use gestell_task_boundary_task, only: border_results_type, search_line_of, solve_borders
  use locked_family, only: locked_family_type
  use terminal, only: show_part
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
    type(locked_family_type), target :: family
    type(locked_family_type), allocatable, target :: bare
    type(border_line_type), allocatable :: lines(:)

    associate (plan => configuration%plan)
      allocate(family%inner, source=plan%family)
      family%model = configuration%tasks%model
      family%accuracy = plan%borders%accuracy
      family%accuracy%tolerance = min(family%accuracy%tolerance, border_accuracy)
      if (size(plan%grid%axes) == 2) call search_lines(family, plan, lines, error)
      if (allocated(error)) return
      if (size(plan%grid%axes) == 1 .and. family%model == "exact") then
        allocate(bare, source=family)
        bare%model = "rest"
      end if
      ! What is not allocated is not there.
      if (allocated(plan%base)) then
        call solve_borders(family, plan%grid, plan%borders, results, error, plan%base, lines, bare)
      else
        call solve_borders(family, plan%grid, plan%borders, results, error, lines=lines, bare=bare)
      end if
      if (.not. allocated(error)) call write_borders(folder, preamble, plan%paths, results, error)
      if (.not. allocated(error)) call plot_borders(folder, preamble, plan%paths, plan%units, plan%grid, results, error)
    end associate
  end subroutine run_borders

  !> The lines of the search over two parameters, by threads. Error: that of the first line that fails.
  subroutine search_lines(family, plan, lines, error)
    type(locked_family_type), intent(in) :: family
    type(sweep_plan_type), intent(in) :: plan
    type(border_line_type), allocatable, intent(out) :: lines(:)
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: own
    integer :: k, done, failed

    allocate(lines(border_lines(plan%grid)))
    done = 0
    failed = huge(failed)
    !$omp parallel do schedule(dynamic, 1) private(own)
    do k = 1, size(lines)
      call search_line_of(family, plan%grid, plan%borders, k, lines(k), own)
      !$omp critical (input_and_output)
      if (allocated(own) .and. k < failed) then
        failed = k
        call move_alloc(own, error)
      end if
      done = done + 1
      call show_part("searching lines", real(done, dp) / size(lines))
      !$omp end critical (input_and_output)
    end do
    !$omp end parallel do
  end subroutine search_lines

end module bordering
