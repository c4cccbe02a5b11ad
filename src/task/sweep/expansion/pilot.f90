!> How many Chebyshev points a line through a cell needs.
module gestell_task_sweep_expansion_pilot
  use gestell_math_chebyshev, only: chebyshev_coefficients, chebyshev_points
  use gestell_base_kinds, only: dp
  use gestell_study_family, only: family_type
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  use gestell_task_sweep_expansion_variable, only: variable_type
  implicit none (type, external)
  private

  public :: count_points, most_points, needed_points

  !> Points of the first trial, and the most: each trial has twice as many intervals, so that values serve again.
  integer, parameter :: first_trial = 9, most_points = 129

contains

  !> The points that a series needs whose terms beyond stay below `tolerance` times the least norm of Phi(T) on the line.
  !> The line: parameter `axis` moves through `variable`, the others are `fixed`. Zero: more than trials of up to `most` points
  !> tell, or `fits` is false and some member of the family has no solution.
  !> Nine arguments: the sampler with its family, and a line through the cell.
  subroutine count_points(sampler, family, axis, variable, fixed, tolerance, most, needed, fits)
    type(sampler_type), intent(inout) :: sampler
    class(family_type), intent(in) :: family
    integer, intent(in) :: axis
    type(variable_type), intent(in) :: variable
    real(dp), intent(in) :: fixed(:), tolerance
    integer, intent(in) :: most
    integer, intent(out) :: needed
    logical, intent(out) :: fits
    real(dp), allocatable :: values(:, :), finer(:, :), x(:)
    real(dp) :: parameters(size(fixed))
    integer :: n, j

    needed = 0
    fits = .true.
    if (.not. abs(variable%to - variable%from) > 0) then
      needed = 1
      return
    end if
    n = first_trial
    parameters = fixed
    allocate(values(sampler%numbers(), 0))
    do while (n <= max(first_trial, min(most, most_points)))
      allocate(finer(sampler%numbers(), n))
      x = chebyshev_points(n)
      do j = 1, n
        if (mod(j, 2) == 1 .and. size(values, 2) > 0) then
          finer(:, j) = values(:, (j + 1) / 2)
          cycle
        end if
        parameters(axis) = variable%parameter_of(x(j))
        call sampler%sample(family, parameters, finer(:, j), fits)
        if (.not. fits) return
      end do
      call move_alloc(finer, values)
      needed = needed_points(values, sampler%states**2, tolerance)
      if (needed > 0) return
      n = 2 * n - 1
    end do
  end subroutine count_points

  !> The least number of terms of the series through `values`, shape (numbers, points), beyond which those that follow add up
  !> to less than `tolerance` times the least norm of the first `measured` numbers. Zero: the series is too short to tell.
  pure integer function needed_points(values, measured, tolerance) result(needed)
    real(dp), intent(in) :: values(:, :)
    integer, intent(in) :: measured
    real(dp), intent(in) :: tolerance
    real(dp) :: size_of_term(size(values, 2)), limit, rest
    integer :: n, k

    n = size(values, 2)
    size_of_term = norm2(matmul(values, transpose(chebyshev_coefficients(n))), dim=1)
    limit = tolerance * minval(norm2(values(:measured, :), dim=1))
    needed = 0
    rest = 0
    do k = n, 1, -1
      rest = rest + size_of_term(k)
      if (.not. rest <= limit) exit
    end do
    ! Two terms, an even and an odd one, have to be small before more of them are taken to be.
    if (k <= n - 3) needed = k + 1
  end function needed_points

end module gestell_task_sweep_expansion_pilot
