!> Defines the points of a sweep: one or two axes of parameters, and the tiles (rectangles of points) into which the grid of
!> points is divided. A tile is always computed, written and restarted as a whole. The tiles depend only on the grid, not on the
!> number of threads or processes.
module gestell_study_grid
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: check_axis, check_grid, check_tile, new_axis, new_grid

  !> Equidistant values of one parameter, on a linear or a logarithmic scale.
  type, public :: axis_type
    !> First and last value of the parameter
    real(dp) :: from = 0, to = 0
    !> Number of values of the parameter on the axis
    integer :: count = 1
    !> True for a logarithmic scale: successive values have a constant ratio instead of a constant difference
    logical :: logarithmic = .false.
  contains
    procedure :: value => value_of_axis
  end type axis_type

  !> A grid of points (i, j) over one or two axes. The index j of the second axis varies fastest; with one axis j = 1.
  type, public :: grid_type
    type(axis_type), allocatable :: axes(:)
    !> True if the points are solved one by one, without expansions; tiles (the rectangles of points that are computed as a whole)
    !> are then smaller
    logical :: one_by_one = .false.
  contains
    procedure :: points, tiles, tile, parameters
  end type grid_type

  !> A tile: a rectangle of grid points. It contains the points with indices from first(1) to last(1) on the first axis and from
  !> first(2) to last(2) on the second axis.
  type, public :: tile_type
    integer :: number = 0, first(2) = 1, last(2) = 1
  end type tile_type

  !> Maximum number of points along one axis of a tile, the rectangle of points that is computed as a whole. `max_of_two`: for a
  !> grid with two axes. `max_one_by_one`: for a grid with two axes whose points are solved one by one. `max_of_one`: for a grid
  !> with one axis.
  integer, parameter :: max_of_two = 500, max_one_by_one = 250, max_of_one = 4000
  !> `usual_tiles`: minimum number of tiles (rectangles of points) along an axis, so that several threads have work. A short axis
  !> has fewer tiles: one for every `min_of_tile` points. The minimum does not apply to large grids that are solved by expansions.
  integer, parameter :: usual_tiles = 4, min_of_tile = 8

contains

  !> Creates an axis of `count` values. Fails if the range is empty or not finite, if its length or ratio overflows, or if a
  !> logarithmic range contains zero.
  pure subroutine new_axis(axis, from, to, count, logarithmic, error)
    type(axis_type), intent(out) :: axis
    real(dp), intent(in) :: from, to
    integer, intent(in) :: count
    logical, intent(in) :: logarithmic
    type(error_type), allocatable, intent(out) :: error

    axis = axis_type(from, to, count, logarithmic)
    call check_axis(axis, error)
  end subroutine new_axis

  !> Checks an axis. Fails in the same cases as `new_axis`.
  pure subroutine check_axis(axis, error)
    type(axis_type), intent(in) :: axis
    type(error_type), allocatable, intent(out) :: error

    associate (from => axis%from, to => axis%to, count => axis%count, logarithmic => axis%logarithmic)
      if (count < 1) then
        call fatal_error(error, "the number of values of a range must be 1 or more", invalid_input)
      else if (.not. (ieee_is_finite(from) .and. ieee_is_finite(to))) then
        call fatal_error(error, "both ends of a range must be finite numbers", invalid_input)
      else if (count > 1 .and. .not. abs(to - from) > 0) then
        call fatal_error(error, "'from' and 'to' must differ if there are several values", invalid_input)
      else if (count == 1 .and. abs(to - from) > 0) then
        call fatal_error(error, "'from' and 'to' must be equal if there is only one value", invalid_input)
      else if (logarithmic .and. .not. (from > 0 .and. to > 0 .or. from < 0 .and. to < 0)) then
        call fatal_error(error, "'from' and 'to' of a logarithmic range must be nonzero and have the same sign", invalid_input)
      else if (max(abs(from), abs(to)) > huge(from) / 2) then
        call fatal_error(error, "the range is too wide for double precision", invalid_input)
      else if (logarithmic) then
        if (abs(log(abs(to)) - log(abs(from))) > 700) call fatal_error(error, "the range is too wide for double precision", &
          & invalid_input)
      end if
    end associate
  end subroutine check_axis

  !> Value number `i` of the axis, from 1 to `count`. The first and last value are returned exactly as given.
  elemental real(dp) function value_of_axis(self, i) result(value)
    class(axis_type), intent(in) :: self
    integer, intent(in) :: i
    real(dp) :: part

    part = real(i - 1, dp) / max(self%count - 1, 1)
    if (i == 1) then
      value = self%from
    else if (i == self%count) then
      value = self%to
    else if (self%logarithmic) then
      value = self%from * exp(part * log(self%to / self%from))
    else
      value = self%from + part * (self%to - self%from)
    end if
  end function value_of_axis

  !> Creates a grid of one or two axes. Fails in the same cases as `check_grid`.
  pure subroutine new_grid(grid, axes, error)
    type(grid_type), intent(out) :: grid
    type(axis_type), intent(in) :: axes(:)
    type(error_type), allocatable, intent(out) :: error

    grid%axes = axes
    call check_grid(grid, error)
  end subroutine new_grid

  !> Checks a grid. Fails if the number of axes is not one or two, or if an axis is invalid.
  pure subroutine check_grid(grid, error)
    type(grid_type), intent(in) :: grid
    type(error_type), allocatable, intent(out) :: error
    integer :: k

    k = 0
    if (allocated(grid%axes)) k = size(grid%axes)
    if (k < 1 .or. k > 2) then
      call fatal_error(error, "the number of axes of a grid must be 1 or 2", invalid_input)
      return
    end if
    do k = 1, size(grid%axes)
      call check_axis(grid%axes(k), error)
      if (allocated(error)) return
    end do
  end subroutine check_grid

  !> Checks a tile. Fails if it is not one of the rectangles of points into which the grid is divided.
  pure subroutine check_tile(grid, tile, error)
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile
    type(error_type), allocatable, intent(out) :: error
    type(tile_type) :: own

    own = grid%tile(tile%number)
    if (own%number == 0 .or. any(tile%first /= own%first) .or. any(tile%last /= own%last)) then
      call fatal_error(error, "the tile (block of grid points) does not belong to the grid", invalid_input)
    end if
  end subroutine check_tile

  !> Number of points of the grid; 0 for a grid without axes.
  pure integer(int64) function points(self)
    class(grid_type), intent(in) :: self

    points = 0
    if (allocated(self%axes)) points = product(int(self%axes%count, int64))
  end function points

  !> Number of tiles (rectangles of points) into which the grid is divided; 0 for a grid without axes.
  pure integer function tiles(self)
    class(grid_type), intent(in) :: self

    tiles = 0
    if (allocated(self%axes)) tiles = product(tiles_along(self))
  end function tiles

  !> The tile (rectangle of grid points) with this number, from 1 to `tiles`. For any other number the result is an empty tile
  !> with number 0.
  pure type(tile_type) function tile(self, number)
    class(grid_type), intent(in) :: self
    integer, intent(in) :: number
    integer :: along(2), position(2), k

    tile%last = 0
    if (number < 1 .or. number > self%tiles()) return
    tile%last = 1
    along = tiles_along(self)
    position = [(number - 1) / along(2), mod(number - 1, along(2))]
    tile%number = number
    do k = 1, min(2, size(self%axes))
      tile%first(k) = 1 + int(int(position(k), int64) * self%axes(k)%count / along(k))
      tile%last(k) = int(int(position(k) + 1, int64) * self%axes(k)%count / along(k))
    end do
  end function tile

  !> Number of tiles (rectangles of points) into which each axis is divided, shape (2); 1 for an axis that the grid does not have.
  pure function tiles_along(self) result(along)
    class(grid_type), intent(in) :: self
    integer :: along(2), most, k
    logical :: large

    along = 1
    large = size(self%axes) == 2 .and. all(self%axes%count >= 2 * max_of_two)
    most = merge(max_one_by_one, max_of_two, self%one_by_one)
    if (size(self%axes) == 1) most = max_of_one
    do k = 1, min(2, size(self%axes))
      associate (count => self%axes(k)%count)
        along(k) = (count - 1) / most + 1
        if (self%one_by_one .or. .not. large) along(k) = max(along(k), min(usual_tiles, (count - 1) / min_of_tile + 1))
      end associate
    end do
  end function tiles_along

  !> Values of the parameters at the grid point (i, j), shape (number of axes).
  pure function parameters(self, i, j)
    class(grid_type), intent(in) :: self
    integer, intent(in) :: i, j
    real(dp) :: parameters(size(self%axes))

    parameters(1) = self%axes(1)%value(i)
    if (size(self%axes) > 1) parameters(2) = self%axes(2)%value(j)
  end function parameters

end module gestell_study_grid
