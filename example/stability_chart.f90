!> Mathieu's equation with damping as a family with two parameters.
module mathieu_family
  use gestell_api_numerics, only: dp, error_type, family_type, periodic_system, pi, second_order_system
  implicit none (type, external)
  private

  !> y'' + y' / 5 + (a - 2 q cos 2 t) y = 0 with period pi.
  type, extends(second_order_system) :: mathieu_type
    real(dp) :: a, q
  contains
    procedure :: matrices
  end type mathieu_type

  !> The family of systems with the parameters a and q.
  type, extends(family_type), public :: mathieu_family_type
  contains
    procedure :: member
  end type mathieu_family_type

contains

  subroutine matrices(self, t, m, b, c)
    class(mathieu_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    m = 1
    b = 0.2_dp
    c = self%a - 2 * self%q * cos(2 * t)
  end subroutine matrices

  subroutine member(self, parameters, system, error)
    class(mathieu_family_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error

    ! This family has no data, and every member exists.
    associate (unused => self)
    end associate
    if (allocated(error)) return
    allocate(system, source=mathieu_type(states=2, period=pi, a=parameters(1), q=parameters(2)))
  end subroutine member

end module mathieu_family

!> Prints the Ince-Strutt chart with a to the right and q upward; # marks where Mathieu's equation with damping is unstable.
program stability_chart
  use gestell_api_numerics, only: axis_type, column_verdict, dp, error_type, grid_type, new_axis, new_grid, solve_tile, &
    & sweep_options, tile_results_type, tile_type, verdict_stable, verdict_undecided, verdict_unstable
  use mathieu_family, only: mathieu_family_type
  use, intrinsic :: iso_fortran_env, only: error_unit
  implicit none (type, external)

  integer, parameter :: columns = 76, rows = 24
  character, parameter :: signs(verdict_stable:verdict_undecided) = [".", "#", "?"]
  type(mathieu_family_type) :: family
  type(axis_type) :: axes(2)
  type(grid_type) :: grid
  type(tile_type) :: tile
  type(sweep_options) :: options
  type(tile_results_type) :: results
  type(error_type), allocatable :: error
  character :: chart(columns, rows)
  integer :: k, i

  call new_axis(axes(1), from=-2.0_dp, to=13.0_dp, count=columns, logarithmic=.false., error=error)
  if (.not. allocated(error)) call new_axis(axes(2), from=0.0_dp, to=6.0_dp, count=rows, logarithmic=.false., error=error)
  if (.not. allocated(error)) call new_grid(grid, axes, error)
  options%columns = .false.
  options%columns(column_verdict) = .true.
  do k = 1, grid%tiles()
    if (allocated(error)) exit
    tile = grid%tile(k)
    call solve_tile(family, grid, tile, options, results, error)
    if (allocated(error)) exit
    do i = tile%first(1), tile%last(1)
      chart(i, tile%first(2):tile%last(2)) = signs(nint(results%values(1, :, i - tile%first(1) + 1)))
    end do
  end do
  if (allocated(error)) then
    write (error_unit, "(a)") error%message
    error stop 1
  end if
  do k = rows, 1, -1
    print "(a, f4.1, 1x, *(a))", "q =", grid%axes(2)%value(k), chart(:, k)
  end do
  print "(8x, a, t80, a)", "a = -2", "13"
  print "(i0, a)", count(chart == signs(verdict_unstable)), " of the points are unstable"
end program stability_chart
