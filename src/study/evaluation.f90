!> The columns of a sweep at the points of a cell, from the expansion of Phi(T) over it.
module gestell_study_evaluation
  use gestell_base_blas, only: multiply
  use gestell_base_kinds, only: dp
  use gestell_floquet_spectra, only: spectral_radii
  use gestell_study_expansion, only: expansion_type, interpolation
  use gestell_study_grid, only: grid_type, tile_type
  use gestell_study_point, only: sweep_order_type
  use gestell_study_tile_results, only: log_rho_max, rho_error, rho_max, stable, sweep_columns, tile_results_type, &
    & undecided, unstable, verdict
  implicit none (type, external)
  private

  public :: evaluate

contains

  !> Sets the results in `cell`, a part of `tile`; `perturbation` bounds the error of Phi in norm.
  subroutine evaluate(grid, tile, cell, order, expansion, perturbation, results)
    type(grid_type), intent(in) :: grid
    type(tile_type), intent(in) :: tile, cell
    type(sweep_order_type), intent(in) :: order
    type(expansion_type), intent(in) :: expansion
    real(dp), intent(in) :: perturbation
    type(tile_results_type), intent(inout) :: results
    real(dp), allocatable :: lines(:, :, :), to_points(:, :), phi(:, :), columns(:, :)
    integer :: along(2), first(2), ordered(count(order%columns)), i, k

    ordered = pack([(k, k = 1, sweep_columns)], order%columns)
    along = cell%last - cell%first + 1
    first = cell%first - tile%first + 1
    call expansion%lines(grid%axes(1)%value([(i, i = cell%first(1), cell%last(1))]), lines)
    if (size(grid%axes) == 1) then
      phi = transpose(lines(1, :, :))
      allocate(columns(along(1), sweep_columns))
      call set_columns(order, phi, perturbation, columns)
      do k = 1, size(ordered)
        results%values(k, 1, first(1):first(1) + along(1) - 1) = columns(:, ordered(k))
      end do
      return
    end if

    to_points = interpolation(expansion%variables(2), &
      & grid%axes(2)%value([(i, i = cell%first(2), cell%last(2))]), expansion%points(2))
    allocate(phi(along(2), expansion%numbers), columns(along(2), sweep_columns))
    do i = 1, along(1)
      call multiply(along(2), expansion%numbers, expansion%points(2), to_points, lines(:, :, i), phi)
      call set_columns(order, phi, perturbation, columns)
      do k = 1, size(ordered)
        results%values(k, first(2):first(2) + along(2) - 1, first(1) + i - 1) = columns(:, ordered(k))
      end do
    end do
  end subroutine evaluate

  !> The columns, shape (points, columns), that follow from the multipliers.
  subroutine set_columns(order, phi, perturbation, columns)
    type(sweep_order_type), intent(in) :: order
    real(dp), contiguous, intent(in) :: phi(:, :)
    real(dp), intent(in) :: perturbation
    real(dp), contiguous, intent(inout) :: columns(:, :)
    logical :: inside(size(phi, 1)), outside(size(phi, 1))

    if (order%columns(rho_error) .or. order%columns(verdict)) then
      call spectral_radii(phi, perturbation, columns(:, rho_max), columns(:, log_rho_max), columns(:, rho_error), inside, outside)
      columns(:, verdict) = merge(stable, merge(unstable, undecided, outside), inside)
    else
      call spectral_radii(phi, perturbation, columns(:, rho_max), columns(:, log_rho_max))
    end if
  end subroutine set_columns

end module gestell_study_evaluation
