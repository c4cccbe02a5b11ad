!> Divides a tile (a rectangle of grid points) into cells. A cell is the part of the tile that one expansion covers.
module gestell_task_sweep_expansion_cell
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: grid_type, tile_type
  use gestell_task_sweep_expansion_pilot, only: count_points, max_points
  use gestell_task_sweep_expansion_sampler, only: new_sampler, sampler_type
  use gestell_study_point, only: solve_point, sweep_options
  use gestell_study_tile_results, only: last_peak, sweep_columns, tile_results_type, xi_peak
  use gestell_task_sweep_expansion_variable, only: itself, logarithm, variable_type
  implicit none (type, external)
  private

  public :: cell_points, halves, plan_cell, random_points

  !> A tile to be solved: the machines, their grid, the requested columns, and the results that have been computed.
  type, public :: problem_type
    class(family_type), pointer :: family => null()
    type(grid_type) :: grid
    type(tile_type) :: tile
    type(sweep_options) :: options
    type(tile_results_type), pointer :: results => null()
  contains
    procedure :: solve_single
  end type problem_type

  !> Decisions on a cell. `expand_it`: compute it by an expansion. `solve_it`: solve it point by point. A positive number is the
  !> axis along which to split the cell.
  integer, parameter, public :: expand_it = 0, solve_it = -1
  !> The sum of the omitted terms of a series along a line through a cell may reach this fraction of the tolerance. It is small
  !> because the series of the cell has more terms than the series along a line.
  real(dp), parameter :: part_of_tolerance = 1 / 16.0_dp
  !> Number of points that are added on each axis to those that a series along a line needs. Because of these additional points,
  !> the last terms of the cell's series can serve to estimate the truncation error.
  integer, parameter :: margin = 2
  !> If the cell has two axes: minimum number of Chebyshev points that is assumed on the other axis.
  integer, parameter :: fewest = 5
  !> If the expansion in the variable that is tried first needs more points than this, other variables are tried too.
  integer, parameter :: few_points = 20

contains

  !> Solves the machine at the grid point (i, j) without an expansion. Fails if `solve_point` fails.
  subroutine solve_single(self, i, j, error)
    class(problem_type), intent(in) :: self
    integer, intent(in) :: i, j
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: found(sweep_columns), measures(2, self%options%measured())

    call solve_point(self%family, self%grid%parameters(i, j), self%options, found, error, measures)
    if (allocated(error)) return
    associate (first => self%tile%first, results => self%results)
      results%values(:, j - first(2) + 1, i - first(1) + 1) = [found(self%options%ordered()), measures]
      results%solutions = results%solutions + 1
    end associate
  end subroutine solve_single

  !> Number of points in a cell.
  pure integer function cell_points(cell)
    type(tile_type), intent(in) :: cell

    cell_points = product(cell%last - cell%first + 1)
  end function cell_points

  !> Decides how to solve a cell. For this it makes expansions along lines through the cell that are parallel to an axis: through
  !> the middle and, if there are two axes, along both edges. `plan`: `expand_it` (then the variables and their numbers of points
  !> are set), `solve_it`, or the axis along which to split.
  subroutine plan_cell(problem, cell, sampler, variables, points, plan)
    !> The tile to be solved
    type(problem_type), intent(in) :: problem
    !> The cell, which is a part of the tile
    type(tile_type), intent(in) :: cell
    !> Sampler that integrates all machines of the cell with the same method
    type(sampler_type), intent(out) :: sampler
    !> For each axis, the variable in which the expansion is made
    type(variable_type), allocatable, intent(out) :: variables(:)
    !> `points`: number of Chebyshev points along each axis. `plan`: the decision on the cell
    integer, intent(out) :: points(2), plan
    logical :: fits
    integer :: axis, side, needed, most, middle(2), tried(2)
    real(dp) :: line(size(problem%grid%axes)), tolerance

    points = 1
    ! By default the cell is split along the axis with the most points.
    plan = maxloc(cell%last - cell%first, dim=1)
    middle = (cell%first + cell%last) / 2
    associate (grid => problem%grid, options => problem%options)
      tolerance = part_of_tolerance * options%accuracy%tolerance
      call new_sampler(sampler, problem%family, corners(grid, cell), options%accuracy, any(options%columns(xi_peak:last_peak)), &
        & cell_points(cell), fits)
      if (.not. fits) return
      allocate(variables(size(grid%axes)))
      do axis = 1, size(variables)
        variables(axis) = variable_type(grid%axes(axis)%value(cell%first(axis)), grid%axes(axis)%value(cell%last(axis)), &
          & merge(logarithm, itself, grid%axes(axis)%logarithmic))
      end do
      call check_cost(sampler, grid%parameters(middle(1), middle(2)), tolerance, variables, options, cell, tried, fits)
      if (.not. fits .or. all(tried(:size(variables)) == 0)) return
      do axis = 1, size(variables)
        line = grid%parameters(middle(1), middle(2))
        most = max_useful_points(options, cell, merge(max(points(3 - axis), fewest), 1, size(variables) == 2))
        points(axis) = max(tried(axis), 0)
        if (points(axis) == 0) call best_variable(sampler, axis, line, tolerance, most, variables(axis), points(axis), fits)
        if (size(variables) == 2) then
          do side = 1, 2
            if (points(axis) == 0 .or. .not. fits) exit
            line(3 - axis) = grid%axes(3 - axis)%value(merge(cell%first(3 - axis), cell%last(3 - axis), side == 1))
            call count_points(sampler, axis, variables(axis), line, tolerance, most, needed, fits)
            points(axis) = merge(0, max(points(axis), needed), needed == 0)
          end do
        end if
        if (.not. fits) return
        if (points(axis) == 0) then
          plan = axis
          return
        end if
        if (points(axis) > 1) points(axis) = points(axis) + margin
      end do
    end associate
    plan = expand_it
    ! One solution with its error bound takes at least as long as three points of an expansion.
    if (problem%options%engine == "auto" .and. 2 * product(points) > cell_points(cell)) plan = solve_it
  end subroutine plan_cell

  !> Determines whether an expansion may be faster than separate solutions. Along at least one of two axes, the expansion must
  !> need no more points than the square root of the number that `max_useful_points` returns. `tried`: number of points that each
  !> axis needs; 0 if it needs too many; -1 if it was not tried.
  subroutine check_cost(sampler, middle, tolerance, variables, options, cell, tried, fits)
    type(sampler_type), intent(inout) :: sampler
    real(dp), intent(in) :: middle(:), tolerance
    type(variable_type), intent(inout) :: variables(:)
    type(sweep_options), intent(in) :: options
    type(tile_type), intent(in) :: cell
    integer, intent(out) :: tried(2)
    logical, intent(out) :: fits
    integer :: axis, most

    fits = .true.
    most = nint(sqrt(real(max_useful_points(options, cell, 1), dp)))
    tried = -1
    if (options%engine /= "auto" .or. size(variables) == 1) return
    do axis = 1, size(variables)
      call best_variable(sampler, axis, middle, tolerance, most, variables(axis), tried(axis), fits)
      if (.not. fits .or. tried(axis) > 0) return
    end do
  end subroutine check_cost

  !> Largest number of Chebyshev points along an axis for which an expansion is assumed to be faster than separate solutions. The
  !> expansion may have at most half as many points in total as the cell. `others`: number of points along the other axis.
  pure integer function max_useful_points(options, cell, others) result(most)
    type(sweep_options), intent(in) :: options
    type(tile_type), intent(in) :: cell
    integer, intent(in) :: others

    most = max_points
    if (options%engine == "auto") most = cell_points(cell) / (2 * others)
  end function max_useful_points

  !> Finds the variable in which the expansion along a line needs the fewest points.
  subroutine best_variable(sampler, axis, line, tolerance, most, variable, points, fits)
    type(sampler_type), intent(inout) :: sampler
    integer, intent(in) :: axis, most
    real(dp), intent(in) :: line(:), tolerance
    type(variable_type), intent(inout) :: variable
    integer, intent(out) :: points
    logical, intent(out) :: fits
    type(variable_type) :: other
    integer :: kind, needed
    !> Other variables are tried only if the ratio of the limits of the range exceeds this value. For smaller ratios the variables
    !> hardly differ.
    real(dp), parameter :: wide = 1.5_dp

    call count_points(sampler, axis, variable, line, tolerance, most, points, fits)
    if (.not. fits) return
    if (points > 0 .and. points <= few_points) return
    if (.not. max(abs(variable%from), abs(variable%to)) > wide * min(abs(variable%from), abs(variable%to))) return
    do kind = itself, logarithm
      other = variable
      other%kind = kind
      if (kind == variable%kind .or. .not. other%is_applicable()) cycle
      call count_points(sampler, axis, other, line, tolerance, most, needed, fits)
      if (.not. fits) return
      if (needed == 0 .or. (points > 0 .and. needed >= points)) cycle
      points = needed
      variable = other
    end do
  end subroutine best_variable

  !> Parameters at the corners of a cell and, in the last column, at its centre; shape (axes, number of corners + 1).
  pure function corners(grid, cell)
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: cell
    real(dp), allocatable :: corners(:, :)

    allocate(corners(size(grid%axes), 5))
    corners(:, 1) = grid%parameters(cell%first(1), cell%first(2))
    corners(:, 2) = grid%parameters(cell%last(1), cell%last(2))
    corners(:, 3) = grid%parameters(cell%first(1), cell%last(2))
    corners(:, 4) = grid%parameters(cell%last(1), cell%first(2))
    corners(:, 5) = grid%parameters((cell%first(1) + cell%last(1)) / 2, (cell%first(2) + cell%last(2)) / 2)
    if (size(grid%axes) == 1) corners = corners(:, [1, 2, 5])
  end function corners

  !> The two halves into which a cell is split along an axis.
  pure function halves(cell, axis)
    type(tile_type), intent(in) :: cell
    integer, intent(in) :: axis
    type(tile_type) :: halves(2)

    halves = cell
    halves(1)%last(axis) = (cell%first(axis) + cell%last(axis)) / 2
    halves(2)%first(axis) = halves(1)%last(axis) + 1
  end function halves

  !> Random points of a cell, which are the same in every run; shape (2, n). (Generator of S. K. Park and K. W. Miller,
  !> Communications of the ACM 31 (1988) 1192.)
  pure function random_points(cell, n) result(points)
    type(tile_type), intent(in) :: cell
    integer, intent(in) :: n
    integer :: points(2, n)
    integer, parameter :: multiplier = 48271, modulus = 2147483647
    integer :: k, i
    real(dp) :: state

    state = mod(1.0_dp + cell%number + 7919.0_dp * cell%first(1) + 104729.0_dp * cell%first(2), real(modulus, dp))
    do k = 1, 3
      state = mod(multiplier * state, real(modulus, dp))
    end do
    do k = 1, n
      do i = 1, 2
        state = mod(multiplier * state, real(modulus, dp))
        points(i, k) = cell%first(i) + int(state / modulus * (cell%last(i) - cell%first(i) + 1))
      end do
    end do
  end function random_points

end module gestell_task_sweep_expansion_cell
