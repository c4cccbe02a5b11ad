!> How many Chebyshev points a line through a cell needs.
module gestell_task_sweep_expansion_pilot
  use gestell_math_series_chebyshev, only: chebyshev_coefficients, chebyshev_points
  use gestell_base_kinds, only: dp
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  use gestell_task_sweep_expansion_variable, only: variable_type
  implicit none (type, external)
  private

  public :: count_points, most_points

  !> Points of the first trial, and the most: each trial has twice as many intervals, so that values serve again.
  integer, parameter :: first_trial = 9, most_points = 129

contains

  !> The points that a series needs whose terms beyond stay below `tolerance` times the least norm of Phi(T) on the line.
  !> The line: parameter `axis` moves through `variable`, the others are `fixed`. Zero: more than trials of up to `most` points
  !> tell, or `fits` is false and some member of the family has no solution.
  subroutine count_points(sampler, axis, variable, fixed, tolerance, most, needed, fits)
    type(sampler_type), intent(inout) :: sampler
    integer, intent(in) :: axis
    type(variable_type), intent(in) :: variable
    real(dp), intent(in) :: fixed(:), tolerance
    integer, intent(in) :: most
    integer, intent(out) :: needed
    logical, intent(out) :: fits
    real(dp), allocatable :: values(:, :), finer(:, :), x(:)
    real(dp) :: parameters(size(fixed)), least
    integer :: n, j

    needed = 0
    fits = .true.
    if (.not. abs(variable%to - variable%from) > 0) then
      needed = 1
      return
    end if
    n = first_trial
    parameters = fixed
    least = huge(least)
    allocate(values(sampler%parts%numbers(), 0))
    do while (n <= max(first_trial, min(most, most_points)))
      allocate(finer(sampler%parts%numbers(), n))
      x = chebyshev_points(n)
      do j = 1, n
        if (mod(j, 2) == 1 .and. size(values, 2) > 0) then
          finer(:, j) = values(:, (j + 1) / 2)
          cycle
        end if
        parameters(axis) = variable%parameter_of(x(j))
        call sampler%sample(parameters, finer(:, j), fits)
        if (.not. fits) return
        least = min(least, norm2(sampler%parts%phi(finer(:, j))))
      end do
      call move_alloc(finer, values)
      needed = needed_points(values, tolerance * least / sqrt(real(sampler%parts%parts, dp)))
      if (needed > 0) return
      n = 2 * n - 1
    end do
  end subroutine count_points

  !> The least number of terms of the series through `values`, shape (numbers, points), beyond which those that follow add up
  !> to less than `limit`; it may be up to twice the points. Zero: the series is too short to tell.
  pure integer function needed_points(values, limit) result(needed)
    real(dp), intent(in) :: values(:, :), limit
    real(dp) :: size_of_term(size(values, 2)), rest
    integer :: n, k

    n = size(values, 2)
    size_of_term = norm2(matmul(values, transpose(chebyshev_coefficients(n))), dim=1)
    needed = 0
    rest = 0
    do k = n, 1, -1
      rest = rest + size_of_term(k)
      if (.not. rest <= limit) exit
    end do
    ! Two terms, an even and an odd one, have to be small before more of them are taken to be.
    if (k <= n - 3) then
      needed = k + 1
    else
      needed = continued(size_of_term, limit)
    end if
  end function needed_points

  !> The same where the terms there are do not get so small but tell how it goes on: those of cos(h x) are Bessel functions J_k(h),
  !> which fall by h / 2k from one to the next in the end. Zero: they do not fall so.
  pure integer function continued(size_of_term, limit) result(needed)
    real(dp), intent(in) :: size_of_term(:), limit
    !> The fall from one term to the next, at the most, with which more can be told.
    real(dp), parameter :: telling = 0.5_dp
    real(dp) :: fall, term, pair
    integer :: n, k

    needed = 0
    n = size(size_of_term)
    ! Pairs of an even and an odd term; the last one is half of what it should be.
    pair = sum(size_of_term(n - 2:n - 1))
    if (.not. pair > 0) return
    fall = (pair / sum(size_of_term(n - 6:n - 5)))**0.25_dp
    if (.not. fall < telling) return
    term = pair
    do k = n - 1, 2 * n - 2
      if (term <= limit) exit
      term = term * fall * (n - 4) / (k - 1)
    end do
    if (k <= 2 * n - 2) needed = max(k, n)
  end function continued

end module gestell_task_sweep_expansion_pilot
