!> Branches of the periodic vibration of a frame in the exact model, as functions of one parameter. On a branch, each value of the
!> parameter has one vibration, which depends smoothly on the value.
module gestell_task_boundary_branch
  use gestell_base_kinds, only: dp
  use gestell_math_series_trigonometric, only: series_through, series_type
  use gestell_study_frame_model_path, only: between, cubic, point_type
  implicit none (type, external)
  private

  public :: lies_on_any

  !> A branch: part of a path of vibrations on which lambda is monotonic. Lambda is the parameter, scaled to go from 0 to 1 over its
  !> range.
  type, public :: branch_type
    !> Points of the branch in ascending order of lambda; their tangents point towards larger lambda.
    type(point_type), allocatable :: points(:)
    !> Arc length from each point of the branch to the next, shape (number of points - 1).
    real(dp), allocatable :: arcs(:)
    !> Element 1 refers to the lower end of the branch, element 2 to the upper end. `turning_ends`: true if the end is a turning
    !> point. `lost`: true if the continuation failed at the end.
    logical :: turning_ends(2) = .false., lost(2) = .false.
    !> Error bound of lambda at each end of the branch that is a turning point; element 1 for the lower end, element 2 for the
    !> upper end.
    real(dp) :: errors(2) = 0
    !> Scales (m, m, rad) by which the three coordinates of the motion are divided: see `units` of `path_family_type`.
    real(dp), allocatable :: units(:)
  contains
    procedure :: ends, motion_at
  end type branch_type

contains

  !> Smallest and largest value of the scaled parameter lambda on the branch.
  pure function ends(self)
    class(branch_type), intent(in) :: self
    real(dp) :: ends(2)

    ends = self%points([1, size(self%points)])%lambda
  end function ends

  !> Interpolates the motion (m, m, rad) on the branch at the scaled parameter lambda = `t`, by cubics along the arc.
  function motion_at(self, t) result(motion)
    class(branch_type), intent(in) :: self
    real(dp), intent(in) :: t
    type(series_type) :: motion
    integer, parameter :: halvings = 50
    real(dp), allocatable :: q(:, :)
    real(dp) :: low, high, x
    integer :: i, k

    k = max(1, findloc(self%points(:size(self%points) - 1)%lambda <= t, .true., dim=1, back=.true.))
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

  !> True if `motion` lies on at least one of the branches at the scaled parameter lambda = `t`.
  logical function lies_on_any(branches, t, motion)
    type(branch_type), intent(in) :: branches(:)
    real(dp), intent(in) :: t
    !> The motion (m, m, rad) that is compared with the branches
    type(series_type), intent(in) :: motion
    integer :: i

    lies_on_any = any([(lies_on(branches(i), t, motion), i = 1, size(branches))])
  end function lies_on_any

  !> True if `motion` lies on the branch at the scaled parameter lambda = `t`. The tolerance allows for the error of the cubic
  !> interpolation.
  logical function lies_on(self, t, motion)
    type(branch_type), intent(in) :: self
    real(dp), intent(in) :: t
    type(series_type), intent(in) :: motion
    real(dp), parameter :: alike = 1.0e-3_dp
    type(series_type) :: own
    real(dp) :: ends(2), difference, size_of_both
    integer :: j, k

    ends = self%ends()
    lies_on = t >= ends(1) .and. t <= ends(2)
    if (.not. lies_on) return
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
    lies_on = difference <= alike**2 * size_of_both

  contains

    !> Element (k, j) of the Fourier coefficients `of`: harmonic k of coordinate j. It is 0 beyond the highest harmonic.
    pure real(dp) function coefficient(of)
      real(dp), intent(in) :: of(0:, :)

      coefficient = 0
      if (k <= ubound(of, 1)) coefficient = of(k, j)
    end function coefficient

  end function lies_on

end module gestell_task_boundary_branch
