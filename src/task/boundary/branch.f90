!> Branches of the exact frame's periodic vibration over one parameter: one vibration for each value, a smooth function of the
!> value.
module gestell_task_boundary_branch
  use gestell_base_kinds, only: dp
  use gestell_math_series_trigonometric, only: series_through, series_type
  use gestell_study_frame_model_path, only: between, cubic, point_type
  implicit none (type, external)
  private

  public :: passed

  !> Part of a path of vibrations along which the coordinate lambda of the parameter (0 to 1 over its range) is monotonic.
  type, public :: branch_type
    !> Points in ascending order of lambda, with tangents in this direction; lengths of the arcs between them, shape (points - 1).
    type(point_type), allocatable :: points(:)
    real(dp), allocatable :: arcs(:)
    !> At the lower and the upper end of lambda: `turns`: true for a turning point; `lost`: true if the continuation failed there;
    !> `errors`: error of lambda at a turning point.
    logical :: turns(2) = .false., lost(2) = .false.
    real(dp) :: errors(2) = 0
    !> Scales of the coordinates of the motion (m, m, rad), as in path_family_type.
    real(dp), allocatable :: units(:)
  contains
    procedure :: ends
    procedure :: motion_at
  end type branch_type

contains

  !> Smallest and largest lambda.
  pure function ends(self)
    class(branch_type), intent(in) :: self
    real(dp) :: ends(2)

    ends = self%points([1, size(self%points)])%lambda
  end function ends

  !> Motion (m, m, rad) at lambda = t, by cubic interpolation along the arc.
  function motion_at(self, t) result(motion)
    class(branch_type), intent(in) :: self
    real(dp), intent(in) :: t
    type(series_type) :: motion
    integer, parameter :: halvings = 50
    real(dp), allocatable :: q(:, :)
    real(dp) :: low, high, x
    integer :: i, k

    k = 1
    do i = 2, size(self%points) - 1
      if (self%points(i)%lambda <= t) k = i
    end do
    associate (l => self%points(k), r => self%points(k + 1), h => self%arcs(k))
      low = 0
      high = 1
      do i = 1, halvings
        x = (low + high) / 2
        if (cubic(x, l%lambda, r%lambda, h * l%rise, h * r%rise) < t) then
          low = x
        else
          high = x
        end if
      end do
      q = between(x, l, r, h)
    end associate
    motion = series_through(spread(self%units, 1, size(q, 1)) * q)
  end function motion_at

  !> True if one of the branches has this motion (m, m, rad) at lambda = t. Branch number `except` is not considered.
  logical function passed(branches, t, motion, except)
    type(branch_type), intent(in) :: branches(:)
    real(dp), intent(in) :: t
    !> The motion (m, m, rad) at this lambda
    type(series_type), intent(in) :: motion
    !> Number of a branch that is not considered
    integer, intent(in), optional :: except
    integer :: i

    passed = .false.
    do i = 1, size(branches)
      if (present(except)) then
        if (i == except) cycle
      end if
      passed = passes(branches(i), t, motion)
      if (passed) return
    end do
  end function passed

  !> True if the branch has this motion at lambda = t within the error of the cubic interpolation.
  logical function passes(self, t, motion)
    type(branch_type), intent(in) :: self
    real(dp), intent(in) :: t
    type(series_type), intent(in) :: motion
    real(dp), parameter :: alike = 1.0e-3_dp
    type(series_type) :: own
    real(dp) :: ends(2), difference, size_of_both
    integer :: j, k

    ends = self%ends()
    passes = t >= ends(1) .and. t <= ends(2)
    if (.not. passes) return
    own = self%motion_at(t)
    difference = 0
    size_of_both = 0
    do j = 1, size(self%units)
      do k = 0, max(ubound(own%cosine, 1), ubound(motion%cosine, 1))
        associate (a => [coefficient(own%cosine), coefficient(own%sine)], &
          & b => [coefficient(motion%cosine), coefficient(motion%sine)])
          difference = difference + sum((a - b)**2) / self%units(j)**2
          size_of_both = size_of_both + sum(a**2 + b**2) / self%units(j)**2
        end associate
      end do
    end do
    passes = difference <= alike**2 * size_of_both

  contains

    !> Coefficient of order k and coordinate j; 0 beyond the highest order of the series.
    pure real(dp) function coefficient(of)
      real(dp), intent(in) :: of(0:, :)

      coefficient = 0
      if (k <= ubound(of, 1)) coefficient = of(k, j)
    end function coefficient

  end function passes

end module gestell_task_boundary_branch
