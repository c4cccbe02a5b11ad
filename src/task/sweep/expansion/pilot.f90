!> Determines how many Chebyshev points an expansion along a line through a cell needs.
module gestell_task_sweep_expansion_pilot
  use gestell_math_series_chebyshev, only: chebyshev_coefficients, chebyshev_points
  use gestell_base_kinds, only: dp
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  use gestell_task_sweep_expansion_variable, only: variable_type
  implicit none (type, external)
  private

  public :: count_points, max_points

  !> Number of points of the first trial, and maximum number of points. Each trial doubles the number of intervals, so that earlier
  !> values are used again.
  integer, parameter :: first_trial = 9, max_points = 129

contains

  !> Determines the number of Chebyshev points of a series along a line. The sum of the omitted terms must be below `tolerance`
  !> times the smallest norm of the monodromy matrix Phi(T) on the line.
  subroutine count_points(sampler, axis, variable, fixed, tolerance, most, needed, fits)
    !> Integrates the machines on the line
    type(sampler_type), intent(inout) :: sampler
    !> Number of the parameter that varies along the line
    integer, intent(in) :: axis
    !> Variable in which this parameter is expanded
    type(variable_type), intent(in) :: variable
    !> `fixed`: values of all parameters; the parameters that do not vary keep them. `tolerance`: tolerance relative to the
    !> smallest norm of Phi(T)
    real(dp), intent(in) :: fixed(:), tolerance
    !> Maximum number of points that a trial may use
    integer, intent(in) :: most
    !> Number of points that the series needs; 0 if the trials do not suffice, or if `fits` is false
    integer, intent(out) :: needed
    !> False if a member of the family on the line has no solution
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
    do while (n <= max(first_trial, min(most, max_points)))
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

  !> Smallest number of terms of the series through `values`, shape (numbers, points), for which the sum of the remaining terms is
  !> below `limit`. The result may be up to twice the number of points. It is 0 if the series is too short to decide.
  pure integer function needed_points(values, limit) result(needed)
    real(dp), intent(in) :: values(:, :), limit
    real(dp) :: size_of_term(size(values, 2)), rest
    integer :: n, k

    n = size(values, 2)
    size_of_term = norm2(matmul(values, transpose(chebyshev_coefficients(n))), dim=1)
    rest = 0
    do k = n, 1, -1
      rest = rest + size_of_term(k)
      if (.not. rest <= limit) exit
    end do
    ! Two terms, one even and one odd, must be small before the following terms are assumed to be small, too.
    needed = k + 1
    if (k > n - 3) needed = extrapolated_count(size_of_term, limit)
  end function needed_points

  !> Number of terms that a series needs, extrapolated from terms that are not yet small enough. For cos(h x) the terms are Bessel
  !> functions J_k(h), which finally decrease by the factor h / 2k from term to term. The result is 0 if the terms do not decrease
  !> fast enough.
  pure integer function extrapolated_count(size_of_term, limit) result(needed)
    real(dp), intent(in) :: size_of_term(:), limit
    !> The extrapolation is reliable if the ratio of successive terms does not exceed this value.
    real(dp), parameter :: telling = 0.5_dp
    real(dp) :: fall, term, pair
    integer :: n, k

    needed = 0
    n = size(size_of_term)
    ! Sums of an even and an odd term. The last term is left out, because it is only half of its true value.
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
  end function extrapolated_count

end module gestell_task_sweep_expansion_pilot
