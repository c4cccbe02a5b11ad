!> Phi(T) of a family over a cell, a range of one or two parameters, as a Chebyshev series. Phi is an analytic function of
!> nearly all parameters, its eigenvalues are not: the series is for the matrix.
module gestell_task_sweep_expansion
  use gestell_math_blas, only: multiply
  use gestell_math_chebyshev, only: chebyshev_coefficients, chebyshev_points, chebyshev_values
  use gestell_base_kinds, only: dp
  use gestell_study_family, only: family_type
  use gestell_task_sweep_expansion_sampler, only: sampler_type
  use gestell_task_sweep_expansion_variable, only: variable_type
  implicit none (type, external)
  private

  public :: expand, interpolation

  type, public :: expansion_type
    !> One or two.
    type(variable_type) :: variables(2)
    !> Points of the series on both axes, numbers that are expanded.
    integer :: points(2) = 1, numbers = 0
    !> Values at the points: (points of the second axis, numbers, points of the first).
    real(dp), allocatable :: values(:, :, :)
    !> Bound on what the missing terms add up to, in norm; the greatest norms of Phi(T) and of all numbers at a point, and the
    !> least of Phi(T): beside the motion Phi(T) may be small.
    real(dp) :: rest = 0, greatest(2) = 0, least = 0
  contains
    procedure :: lines
    procedure :: line
  end type expansion_type

contains

  !> Samples a family at points(1) times points(2) Chebyshev points. `fits` is false where a member has no solution.
  subroutine expand(expansion, sampler, family, variables, points, fits)
    type(expansion_type), intent(out) :: expansion
    type(sampler_type), intent(inout) :: sampler
    class(family_type), intent(in) :: family
    type(variable_type), intent(in) :: variables(:)
    integer, intent(in) :: points(2)
    logical, intent(out) :: fits
    real(dp) :: x(points(1)), y(points(2)), parameters(size(variables)), norms(points(2), points(1)), &
      & numbers(sampler%numbers())
    integer :: i, j

    expansion%variables(:size(variables)) = variables
    expansion%points = points
    expansion%numbers = sampler%numbers()
    allocate(expansion%values(points(2), expansion%numbers, points(1)))
    x = chebyshev_points(points(1))
    y = chebyshev_points(points(2))
    do i = 1, points(1)
      parameters(1) = variables(1)%parameter_of(x(i))
      do j = 1, points(2)
        if (size(variables) > 1) parameters(2) = variables(2)%parameter_of(y(j))
        call sampler%sample(family, parameters, numbers, fits)
        if (.not. fits) return
        expansion%values(j, :, i) = numbers
      end do
    end do
    norms = norm2(expansion%values, dim=2)
    expansion%greatest(2) = maxval(norms)
    norms = norm2(expansion%values(:, :sampler%states**2, :), dim=2)
    expansion%greatest(1) = maxval(norms)
    expansion%least = minval(norms)
    expansion%rest = missing(expansion)
  end subroutine expand

  !> An estimate of what the missing terms add up to: by the last two that are there, an even and an odd one, on both axes.
  !> Terms of an analytic function fall by a factor at least; what follows is taken as no more than the last two, and
  !> interpolation on the other axis enlarges it by less than four (Lebesgue's constant).
  pure real(dp) function missing(expansion) result(rest)
    type(expansion_type), intent(in) :: expansion
    real(dp), parameter :: lebesgue = 4
    real(dp), allocatable :: coefficients(:, :)
    real(dp) :: last(expansion%numbers, 2), term
    integer :: i, n

    rest = 0
    n = expansion%points(1)
    if (n > 1) then
      coefficients = chebyshev_coefficients(n)
      term = 0
      do i = 1, expansion%points(2)
        last = matmul(expansion%values(i, :, :), transpose(coefficients(n - 1:, :)))
        term = max(term, sum(norm2(last, dim=1)))
      end do
      rest = rest + lebesgue * term
    end if
    n = expansion%points(2)
    if (n > 1) then
      coefficients = chebyshev_coefficients(n)
      term = 0
      do i = 1, expansion%points(1)
        last = transpose(matmul(coefficients(n - 1:, :), expansion%values(:, :, i)))
        term = max(term, sum(norm2(last, dim=1)))
      end do
      rest = rest + lebesgue * term
    end if
  end function missing

  !> The series for these values of the first parameter: its values at the points of the second axis, shape (points(2),
  !> numbers, size(parameters)).
  subroutine lines(self, parameters, values)
    class(expansion_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    real(dp), allocatable, intent(out) :: values(:, :, :)
    real(dp) :: to_lines(self%points(1), size(parameters))

    to_lines = transpose(interpolation(self%variables(1), parameters, self%points(1)))
    allocate(values(self%points(2), self%numbers, size(parameters)))
    call multiply(self%points(2) * self%numbers, size(parameters), self%points(1), self%values, to_lines, values)
  end subroutine lines

  !> The series for one value of the first parameter and some of the second (none of it where there is one parameter), shape
  !> (max(1, size(second)), numbers).
  subroutine line(self, first, second, values)
    class(expansion_type), intent(in) :: self
    real(dp), intent(in) :: first, second(:)
    real(dp), intent(out) :: values(:, :)
    real(dp), allocatable :: at(:, :, :)

    call self%lines([first], at)
    if (size(second) == 0) then
      values = at(:, :, 1)
    else
      values = matmul(interpolation(self%variables(2), second, self%points(2)), at(:, :, 1))
    end if
  end subroutine line

  !> The matrix from values at n Chebyshev points to values at `parameters`, shape (size(parameters), n).
  function interpolation(variable, parameters, n) result(matrix)
    type(variable_type), intent(in) :: variable
    real(dp), intent(in) :: parameters(:)
    integer, intent(in) :: n
    real(dp), allocatable :: matrix(:, :)

    allocate(matrix(size(parameters), n))
    call multiply(size(parameters), n, n, chebyshev_values(variable%x_of(parameters), n), chebyshev_coefficients(n), matrix)
  end function interpolation

end module gestell_task_sweep_expansion
