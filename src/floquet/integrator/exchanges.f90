!> Computes a step of Gauss-Legendre collocation with row exchanges, by LAPACK. It is used for steps that
!> gestell_floquet_integrator_gauss_steps cannot eliminate in lanes.
module gestell_floquet_integrator_exchanges
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_nested, only: nested_type
  use gestell_floquet_integrator_step_coefficients, only: coefficients_type
  use gestell_floquet_integrator_tableau, only: tableau_type
  use gestell_math_lapack, only: factorise, solve_factored
  use gestell_math_matrix, only: unit_matrix
  implicit none (type, external)
  private

  public :: map_with_exchanges

contains

  !> Computes the maps [A b], or A alone, of step `k` with row exchanges. Fails if the equations are singular.
  !>
  !> The first embedded method sets the unknowns u of the last node to zero; the second one sets those of the last two nodes to
  !> zero. The equations of these nodes then contain Lagrange multipliers mu:
  !>
  !>     K' u - E mu = R,  E^T u = 0,
  !>
  !> where the columns of E are the columns of the unit matrix that belong to the unknowns set to zero.
  subroutine map_with_exchanges(tableau, at, k, maps, error)
    class(tableau_type), intent(in) :: tableau
    !> Coefficients at the nodes of all steps
    type(coefficients_type), intent(in) :: at
    !> Number of the step whose map is computed
    integer, intent(in) :: k
    !> Maps of the method (last index 1) and, if requested, of its first (2) and second (3) embedded method, shape (states,
    !> columns, 1 or 3)
    real(dp), intent(inout) :: maps(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: left(:, :), right(:, :), mu(:, :), border(:, :)
    real(dp) :: h, slopes(size(tableau%c), size(tableau%c))
    integer, allocatable :: pivots(:)
    integer :: f, p, s, n, level, i, j, point

    f = at%f
    s = size(tableau%c)
    p = at%positions
    n = size(maps, 2)
    h = at%lengths(k)
    slopes = unit_matrix(s)
    select type (tableau)
    class is (nested_type)
      slopes(s - 1:, :) = tableau%values
    end select
    allocate(left(f * s, f * s), right(f * s, n + f * (size(maps, 3) - 1)), source=0.0_dp)
    allocate(pivots(f * s))
    do i = 1, s
      point = size(at%lengths) * (i - 1) + k
      associate (rows => right(f * (i - 1) + 1:f * i, :))
        rows(:, p + 1:p + f) = -h * at%b(point, :, :)
        if (p > 0) rows(:, :p) = -h**2 * at%c(point, :, :)
        if (p > 0) rows(:, p + 1:p + f) = rows(:, p + 1:p + f) + tableau%c(i) * rows(:, :p)
        if (allocated(at%g)) rows(:, n) = merge(h**2, h, p > 0) * at%g(point, :)
      end associate
      do j = 1, s
        associate (part => left(f * (i - 1) + 1:f * i, f * (j - 1) + 1:f * j))
          part = h * tableau%a(i, j) * at%b(point, :, :)
          if (p > 0) then
            part = part + h**2 * tableau%aa(i, j) * at%c(point, :, :) + slopes(i, j) * at%m(point, :, :)
          else
            part = part + slopes(i, j) * unit_matrix(f)
          end if
        end associate
      end do
    end do
    select type (tableau)
    class is (nested_type)
      do i = 1, s - 1
        associate (rows => [(f * (i - 1) + j, j = 1, f)], next => [(f * (s - 2) + j, j = 1, f)], &
          & last => [(f * (s - 1) + j, j = 1, f)])
          left(rows, :) = left(rows, :) + tableau%sums(i, 1) * left(next, :) + tableau%sums(i, 2) * left(last, :)
          right(rows, :) = right(rows, :) + tableau%sums(i, 1) * right(next, :) + tableau%sums(i, 2) * right(last, :)
        end associate
      end do
    end select
    do j = 1, size(right, 2) - n
      right(size(right, 1) + 1 - j, n + j) = 1
    end do

    call factorise(left, pivots, error)
    if (allocated(error)) return
    call solve_factored(left, pivots, right)
    maps(:, :, 1) = map_of(tableau, at%states, right(:, :n))
    do level = 1, size(maps, 3) - 1
      border = right(size(right, 1) + 1 - f * level:, n + 1:n + f * level)
      mu = right(size(right, 1) + 1 - f * level:, :n)
      call factorise(border, pivots(:f * level), error)
      if (allocated(error)) return
      call solve_factored(border, pivots(:f * level), mu)
      maps(:, :, level + 1) = map_of(tableau, at%states, right(:, :n) - matmul(right(:, n + 1:n + f * level), mu))
    end do
  end subroutine map_with_exchanges

  !> Map of a step, shape (states, columns), computed from the unknowns `u` of the step, shape (unknowns, columns). The map
  !> measures time in units of the length of the step.
  pure function map_of(tableau, states, u) result(map)
    class(tableau_type), intent(in) :: tableau
    integer, intent(in) :: states
    real(dp), intent(in) :: u(:, :)
    real(dp) :: map(states, size(u, 2))
    integer :: f, p, i, j

    f = size(u, 1) / size(tableau%c)
    p = states - f
    map = 0
    do i = 1, states
      map(i, i) = 1
    end do
    do i = 1, p
      map(i, p + i) = 1
    end do
    do j = 1, size(tableau%c)
      associate (unknowns => u(f * (j - 1) + 1:f * j, :))
        if (p > 0) map(:p, :) = map(:p, :) + tableau%ba(j) * unknowns
        map(p + 1:, :) = map(p + 1:, :) + tableau%b(j) * unknowns
      end associate
    end do
  end function map_of

end module gestell_floquet_integrator_exchanges
