!> Coordinates in which a design is optimised. If mass m and centre of mass c of a link are both parameters, the coordinates are m
!> and the first moment m c. The reason: shaking forces are linear in these coordinates. The range of c becomes the linear limits m
!> c - c_max m <= 0 and c_min m - m c <= 0.
module gestell_study_design_moments
  use gestell_base_kinds, only: dp
  use gestell_math_optimum_minimax, only: branches_type, optimum_type
  use gestell_study_design_perturbed_members, only: mass_part, place_parts
  implicit none (type, external)
  private

  public :: new_moments

  !> Converts the parameters of a design to the coordinates of the search and back.
  type, public :: moments_type
    !> For a parameter that is a coordinate of a link's centre of mass: index of the parameter that is the mass of this link. For
    !> other parameters 0, because they are not converted. Shape (parameters)
    integer, allocatable :: mass(:)
    !> Lower and upper limits of the parameters, shape (parameters)
    real(dp), allocatable :: lower(:), upper(:)
  contains
    procedure :: limits, from, to, add_limits, turn_slopes, turn_optimum
  end type moments_type

contains

  !> Creates the conversion for parameters with the limits `lower` and `upper`. `body`: link of each parameter. `part`: property of
  !> the link that the parameter changes.
  pure function new_moments(lower, upper, body, part) result(moments)
    real(dp), intent(in) :: lower(:), upper(:)
    integer, intent(in) :: body(:), part(:)
    type(moments_type) :: moments
    integer :: k, m

    moments%lower = lower
    moments%upper = upper
    allocate(moments%mass(size(body)), source=0)
    do k = 1, size(body)
      if (.not. any(part(k) == place_parts)) cycle
      m = findloc(body == body(k) .and. part == mass_part, .true., dim=1)
      if (m == 0) cycle
      if (lower(m) > 0) moments%mass(k) = m
    end do
  end function new_moments

  !> Number of linear limits that replace the ranges of centres of mass.
  pure integer function limits(self)
    class(moments_type), intent(in) :: self

    limits = 2 * count(self%mass > 0)
  end function limits

  !> Converts the parameters x to coordinates of the search.
  pure function from(self, x) result(y)
    class(moments_type), intent(in) :: self
    real(dp), intent(in) :: x(:)
    real(dp) :: y(size(x))

    y = x
    where (self%mass > 0) y = x(max(self%mass, 1)) * x
  end function from

  !> Converts the coordinates y of the search to parameters.
  pure function to(self, y) result(x)
    class(moments_type), intent(in) :: self
    real(dp), intent(in) :: y(:)
    real(dp) :: x(size(y))

    x = y
    where (self%mass > 0) x = y / y(max(self%mass, 1))
  end function to

  !> Converts derivatives with respect to the parameters x, shape (parameters, values), to derivatives with respect to the
  !> coordinates.
  pure subroutine turn_slopes(self, x, slopes)
    class(moments_type), intent(in) :: self
    real(dp), intent(in) :: x(:)
    real(dp), intent(inout) :: slopes(:, :)
    integer :: k

    do k = 1, size(x)
      associate (m => self%mass(k))
        if (m == 0) cycle
        slopes(k, :) = slopes(k, :) / x(m)
        slopes(m, :) = slopes(m, :) - x(k) * slopes(k, :)
      end associate
    end do
  end subroutine turn_slopes

  !> Adds the linear limits on the centres of mass, evaluated at the coordinates y of the search, to the branches `at`. Each limit
  !> forms a group of branches; the groups are numbered from `first`.
  pure subroutine add_limits(self, y, first, at)
    class(moments_type), intent(in) :: self
    real(dp), intent(in) :: y(:)
    integer, intent(in) :: first
    type(branches_type), intent(inout) :: at
    real(dp) :: value(self%limits()), slope(size(y), self%limits())
    integer :: i, k

    slope = 0
    i = 0
    do k = 1, size(y)
      associate (m => self%mass(k))
        if (m == 0) cycle
        slope(k, i + 1:i + 2) = [1.0_dp, -1.0_dp]
        slope(m, i + 1:i + 2) = [-self%upper(k), self%lower(k)]
        value(i + 1:i + 2) = y(k) * slope(k, i + 1:i + 2) + y(m) * slope(m, i + 1:i + 2)
      end associate
      i = i + 2
    end do
    at%group = [at%group, [(first + k, k = 0, size(value) - 1)]]
    at%value = [at%value, value]
    if (.not. allocated(at%slope)) return
    at%slope = reshape([at%slope, slope], [size(y), size(at%value)])
  end subroutine add_limits

  !> Converts an optimum from the coordinates of the search to the parameters. The prices (Lagrange multipliers) of the linear
  !> limits become prices of the ranges, and no longer contribute to `slope`.
  !>
  !> A bound of a first moment is redundant: for c_min < 0, m <= m_max and c_min m - m c <= 0 imply m c >= c_min m_max. If all
  !> three are active, the search may put the price on any of them. The price of the redundant bound belongs to the other two.
  pure subroutine turn_optimum(self, optimum)
    class(moments_type), intent(in) :: self
    type(optimum_type), intent(inout) :: optimum
    real(dp) :: x(size(optimum%x)), y(size(optimum%x)), gradient_change, own
    integer :: i, k, limits

    y = optimum%x
    x = self%to(y)
    limits = size(optimum%price) - self%limits()
    i = limits
    do k = 1, size(x)
      associate (m => self%mass(k))
        if (m == 0) cycle
        own = optimum%bound_price(k)
        optimum%bound_price(m) = optimum%bound_price(m) + own * merge(self%lower(k), self%upper(k), own > 0)
        gradient_change = optimum%price(i + 1) - optimum%price(i + 2)
        optimum%slope(k) = (optimum%slope(k) - gradient_change) * y(m)
        optimum%slope(m) = optimum%slope(m) + optimum%price(i + 1) * self%upper(k) - optimum%price(i + 2) * self%lower(k) &
          & + optimum%slope(k) * x(k) / y(m)
        optimum%bound_price(k) = (own - gradient_change) * y(m)
        x(k) = min(max(x(k), self%lower(k)), self%upper(k))
      end associate
      i = i + 2
    end do
    optimum%x = x
    optimum%price = optimum%price(:limits)
  end subroutine turn_optimum

end module gestell_study_design_moments
