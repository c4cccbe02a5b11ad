!> Chebyshev series for the motion of a family over a cell, which is a range of one or two parameters. The matrices of the parts of
!> a period are analytic functions of nearly all parameters. Their eigenvalues are not, so the matrices are expanded.
module gestell_task_sweep_expansion
  use gestell_math_series_chebyshev, only: chebyshev_coefficients, chebyshev_points, chebyshev_values
  use gestell_base_kinds, only: dp
  use gestell_math_lanes_products, only: combine, padded_to_four
  use gestell_math_lanes, only: lanes
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  use gestell_task_sweep_expansion_variable, only: variable_type
  implicit none (type, external)
  private

  public :: expand

  !> Chebyshev series of the numbers by which a sampler represents the motion over a period.
  type, public :: expansion_type
    !> Variables in which the two axes are expanded. If there is a single axis, it is the second one.
    type(variable_type) :: variables(2)
    !> `points`: number of points of the series along each axis. `numbers`: number of quantities that are expanded.
    integer :: points(2) = 1, numbers = 0
    !> Values of the expanded numbers at the points of the series, shape (points(2), numbers, points(1)). The second dimension is
    !> padded to a multiple of four and is at least eight. If there is a single axis, it is the second one.
    real(dp), allocatable :: values(:, :, :)
    !> `rest`: bound on the norm of the sum of the omitted terms. `maximum`: largest norms, among the points of the series, of the
    !> monodromy matrix Phi(T) and of [Phi(T) x_p(T)], where x_p is the motion forced from rest. `least`: smallest norm of Phi(T)
    !> among these points.
    real(dp) :: rest = 0, maximum(2) = 0, least = 0
  contains
    procedure :: factors, blocks, lines, point
  end type expansion_type

contains

  !> Computes the numbers that represent the motion at points(1) times points(2) Chebyshev points. Sets `fits` to false if a member
  !> of the family has no solution.
  subroutine expand(expansion, sampler, variables, points, fits)
    type(expansion_type), intent(out) :: expansion
    type(sampler_type), intent(inout) :: sampler
    !> Variable in which each axis of the cell is expanded
    type(variable_type), intent(in) :: variables(:)
    !> Number of Chebyshev points along each axis
    integer, intent(in) :: points(2)
    logical, intent(out) :: fits
    real(dp) :: parameters(size(variables)), numbers(sampler%parts%numbers()), norms(2), reach
    type(variable_type) :: lines(2)
    integer :: i, j, axes

    axes = size(variables)
    lines(:3 - axes) = variable_type()
    lines(3 - axes:) = variables
    expansion%variables = lines
    expansion%points = merge(points, [1, points(1)], axes == 2)
    expansion%numbers = size(numbers)
    allocate(expansion%values(expansion%points(2), padded_to_four(max(lanes, expansion%numbers)), expansion%points(1)), &
      & source=0.0_dp)
    associate (x => chebyshev_points(expansion%points(1)), y => chebyshev_points(expansion%points(2)))
      expansion%least = huge(norms)
      reach = 1
      do i = 1, size(x)
        do j = 1, size(y)
          parameters(1) = lines(1)%parameter_of(x(i))
          parameters(axes) = lines(2)%parameter_of(y(j))
          call sampler%sample(parameters, numbers, fits)
          if (.not. fits) return
          expansion%values(j, :expansion%numbers, i) = numbers
          associate (period => sampler%parts%period(numbers))
            norms = [norm2(period(:sampler%parts%states**2)), norm2(period)]
          end associate
          expansion%maximum = max(expansion%maximum, norms)
          expansion%least = min(expansion%least, norms(1))
          reach = max(reach, sampler%parts%reach(numbers))
        end do
      end do
    end associate
    ! The truncation errors of the parts of the period add up in Phi(T).
    expansion%rest = reach * sqrt(real(sampler%parts%parts, dp)) * omitted(expansion)
  end subroutine expand

  !> Estimates the norm of the sum of the omitted terms. The terms of an analytic function decrease at least geometrically. The
  !> omitted sum is therefore taken to be at most the sum of the last two terms (one even, one odd) along each axis. Interpolation
  !> along the other axis amplifies the omitted sum by less than the Lebesgue constant 4.
  pure real(dp) function omitted(expansion) result(rest)
    type(expansion_type), intent(in) :: expansion
    real(dp), parameter :: lebesgue = 4
    real(dp), allocatable :: coefficients(:, :)
    real(dp) :: last(size(expansion%values, 2), 2), term
    integer :: axis, i, n

    rest = 0
    do axis = 1, 2
      n = expansion%points(axis)
      if (n == 1) cycle
      coefficients = chebyshev_coefficients(n)
      term = 0
      do i = 1, expansion%points(3 - axis)
        if (axis == 1) last = matmul(expansion%values(i, :, :), transpose(coefficients(n - 1:, :)))
        if (axis == 2) last = transpose(matmul(coefficients(n - 1:, :), expansion%values(:, :, i)))
        term = max(term, sum(norm2(last, dim=1)))
      end do
      rest = rest + lebesgue * term
    end do
  end function omitted

  !> Factors that interpolate from the Chebyshev points of an axis to the given parameters, shape (lanes, points, groups). Eight
  !> parameters form a group, one in each vector lane. The last parameter is repeated to fill the last group.
  pure function factors(self, axis, parameters)
    class(expansion_type), intent(in) :: self
    integer, intent(in) :: axis
    real(dp), intent(in) :: parameters(:)
    real(dp), allocatable :: factors(:, :, :)
    integer :: group, n, i

    n = self%points(axis)
    allocate(factors(lanes, n, (size(parameters) + lanes - 1) / lanes))
    associate (matrix => chebyshev_coefficients(n))
      do group = 1, size(factors, 3)
        associate (at => [(min(lanes * (group - 1) + i, size(parameters)), i = 1, lanes)])
          factors(:, :, group) = matmul(chebyshev_values(self%variables(axis)%x_of(parameters(at)), n), matrix)
        end associate
      end do
    end associate
  end function factors

  !> The expanded values in blocks of eight, for each point of the first axis; shape (lanes, points(1), blocks). The last block
  !> ends with the last value and may overlap the block before it.
  pure function blocks(self)
    class(expansion_type), intent(in) :: self
    real(dp), allocatable :: blocks(:, :, :)
    real(dp) :: values(size(self%values(:, :, 1)))
    integer :: block, first, i

    allocate(blocks(lanes, self%points(1), (size(values) + lanes - 1) / lanes))
    do i = 1, self%points(1)
      values = reshape(self%values(:, :, i), [size(values)])
      do block = 1, size(blocks, 3)
        first = min(lanes * (block - 1), size(values) - lanes) + 1
        blocks(:, i, block) = values(first:first + lanes - 1)
      end do
    end do
  end function blocks

  !> Interpolates to eight positions on the first axis, one in each vector lane. `factors`: interpolation factors of these
  !> positions, shape (lanes, points(1)). `values`: results at the points of the second axis, shape (points(2) * size(values, 2),
  !> lanes).
  pure subroutine lines(self, blocks, factors, values)
    class(expansion_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: blocks(:, :, :), factors(:, :)
    real(dp), intent(out) :: values(size(self%values(:, :, 1)), lanes)
    real(dp) :: terms(self%points(1), lanes), sums(lanes, lanes)
    integer :: block, first, lane

    terms = transpose(factors)
    do block = 1, size(blocks, 3)
      call combine(self%points(1), lanes, blocks(:, :, block), terms, sums)
      ! The last block ends with the last value, so it may overlap the previous block.
      first = min(lanes * (block - 1), size(values, 1) - lanes) + 1
      do lane = 1, lanes
        values(first:first + lanes - 1, lane) = sums(:, lane)
      end do
    end do
  end subroutine lines

  !> The expanded numbers at one point of the cell, shape (numbers).
  pure function point(self, parameters) result(values)
    class(expansion_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    real(dp) :: values(self%numbers), at(self%points(2), size(self%values, 2))
    real(dp), allocatable :: first(:, :, :), second(:, :, :)
    integer :: i

    ! If there is a single axis, it is the second one, and the first axis has one point.
    first = self%factors(1, parameters(:1))
    second = self%factors(2, parameters(size(parameters):))
    at = 0
    do i = 1, self%points(1)
      at = at + first(1, i, 1) * self%values(:, :, i)
    end do
    values = matmul(second(1, :, 1), at(:, :self%numbers))
  end function point

end module gestell_task_sweep_expansion
