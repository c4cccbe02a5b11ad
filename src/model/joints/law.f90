!> Cam laws by segments, with the names of VDI 2143. In each segment the lift follows a normalised law f, and in a dwell it rests:
!>
!>     L(theta) = L_0 + h f(z),   z = (theta - theta_0) / beta,   f(0) = 0,   f(1) = 1,   f'(0) = f'(1) = 0.
!>
!> Lift and velocity are therefore continuous. All laws are symmetric: f(z) = 1 - f(1 - z).
module gestell_model_joints_law
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: new_law, normalised

  !> Names of the laws in an input; the indices below are their positions.
  character(len=*), parameter, public :: law_names = "dwell, harmonic, polynomial_345, polynomial_4567, modified_sine, " // &
    & "modified_trapezoid"
  integer, parameter, public :: dwell = 1, harmonic = 2, polynomial_345 = 3, polynomial_4567 = 4, modified_sine = 5, &
    & modified_trapezoid = 6

  !> Maxima of |f'| and |f''| of the laws, shape (2, laws).
  real(dp), parameter :: peaks(2, 6) = reshape([0.0_dp, 0.0_dp, pi / 2, pi**2 / 2, 15 / 8.0_dp, 10 / sqrt(3.0_dp), &
    & 35 / 16.0_dp, 84 / sqrt(125.0_dp), 4 * pi / (4 + pi), 4 * pi**2 / (4 + pi), 2.0_dp, 8 * pi / (2 + pi)], [2, 6])

  !> The lift of a cam over a turn of the cam's angle.
  type, public :: law_type
    !> For each segment: index of its law
    integer, allocatable :: laws(:)
    !> Angle (rad) and lift (m) at the end of each segment, shape (0:segments). Element 0 belongs to the start of the first
    !> segment, so that `ends` runs from 0 to 2 pi
    real(dp), allocatable :: ends(:), lifts(:)
  contains
    procedure :: follow, bounds, order, kinks, jumps
  end type law_type

contains

  !> Creates a law from its segments, which fill the turn. If they do not define a cam, `reason` says why and `key` names the key;
  !> otherwise `reason` is empty.
  pure subroutine new_law(law, laws, widths, lifts, key, reason)
    type(law_type), intent(out) :: law
    !> For each segment: index of its law
    integer, intent(in) :: laws(:)
    !> `widths`: width of each segment (rad). `lifts`: lift (m) at the end of each segment that is not a dwell
    real(dp), intent(in) :: widths(:), lifts(:)
    character(len=16), intent(out) :: key
    character(len=200), intent(out) :: reason
    real(dp), parameter :: rounding = 1.0e-9_dp
    integer :: k, n, moves

    n = size(laws)
    moves = count(laws /= dwell)
    key = "law_angle"
    reason = ""
    if (size(widths) /= n) then
      reason = "must have one value for each segment of 'law'"
    else if (abs(sum(widths) - 2 * pi) > rounding) then
      reason = "must add up to 360 deg"
    else if (moves < 2) then
      key = "law"
      reason = "must have at least two segments that are not 'dwell': the follower must return"
    else if (size(lifts) /= moves) then
      key = "law_lift"
      reason = "must have one value for each segment of 'law' that is not 'dwell'"
    end if
    if (reason /= "") return
    law%laws = laws
    allocate(law%ends(0:n), law%lifts(0:n))
    law%ends(0) = 0
    law%lifts(0) = lifts(moves)
    do k = 1, n
      law%ends(k) = 2 * pi * (sum(widths(:k)) / sum(widths))
      law%lifts(k) = law%lifts(k - 1)
      if (laws(k) /= dwell) law%lifts(k) = lifts(count(laws(:k) /= dwell))
    end do
  end subroutine new_law

  !> Value of the normalised law f and its first three derivatives at z, 0 <= z <= 1.
  pure function normalised(law, z) result(f)
    integer, intent(in) :: law
    real(dp), intent(in) :: z
    real(dp) :: f(0:3)
    !> Factor of a modified sine; acceleration of the plateau of a modified trapezoid
    real(dp), parameter :: q = 4 + pi, a = 8 * pi / (2 + pi)
    real(dp) :: t, w

    t = min(z, 1 - z)
    f = 0
    select case (law)
    case (harmonic)
      w = pi * t
      f = [sin(w / 2)**2, pi / 2 * sin(w), pi**2 / 2 * cos(w), -pi**3 / 2 * sin(w)]
    case (polynomial_345)
      f = [t**3 * (10 - t * (15 - 6 * t)), 30 * (t * (1 - t))**2, 60 * t * (1 - t) * (1 - 2 * t), 60 - 360 * t * (1 - t)]
    case (polynomial_4567)
      f = [t**4 * (35 - t * (84 - t * (70 - 20 * t))), 140 * (t * (1 - t))**3, 420 * (t * (1 - t))**2 * (1 - 2 * t), &
        & 840 * t * (1 - t) * (1 - 5 * t * (1 - t))]
    case (modified_sine)
      w = 4 * pi * t
      if (8 * t <= 1) then
        f = [w / 4 - sin(w) / 4, pi * (1 - cos(w)), 4 * pi**2 * sin(w), 16 * pi**3 * cos(w)] / q
      else
        w = (w + pi) / 3
        f = [2 + pi * t - 9 * sin(w) / 4, pi * (1 - 3 * cos(w)), 4 * pi**2 * sin(w), 16 * pi**3 / 3 * cos(w)] / q
      end if
    case (modified_trapezoid)
      w = 4 * pi * min(t, 0.125_dp)
      f = a * [(w - sin(w)) / (4 * pi)**2, (1 - cos(w)) / (4 * pi), sin(w), 4 * pi * cos(w)]
      ! The plateau adds a parabola, the middle part a cosine.
      w = min(t, 0.375_dp) - 0.125_dp
      if (w > 0) f = [f(0) + w * (f(1) + a * w / 2), f(1) + a * w, a, 0.0_dp]
      w = t - 0.375_dp
      if (w > 0) f = [f(0) + w * f(1) + a * (1 - cos(4 * pi * w)) / (4 * pi)**2, f(1) + a * sin(4 * pi * w) / (4 * pi), &
        & a * cos(4 * pi * w), -4 * pi * a * sin(4 * pi * w)]
    case default ! dwell
    end select
    if (2 * z > 1) f = [1 - f(0), f(1), -f(2), f(3)]
  end function normalised

  !> Computes the lift L and its first three derivatives with respect to the cam's angle theta (rad); `f` has the shape (angles,
  !> 0:3).
  pure subroutine follow(self, theta, f)
    class(law_type), intent(in) :: self
    real(dp), intent(in) :: theta(:)
    real(dp), intent(out) :: f(:, 0:)
    real(dp) :: angle, width
    integer :: i, k, p

    do i = 1, size(theta)
      angle = modulo(theta(i), 2 * pi)
      k = 1 + count(self%ends(1:size(self%laws) - 1) <= angle)
      width = self%ends(k) - self%ends(k - 1)
      f(i, :) = normalised(self%laws(k), min((angle - self%ends(k - 1)) / width, 1.0_dp)) &
        & * (self%lifts(k) - self%lifts(k - 1)) / [(width**p, p = 0, 3)]
      f(i, 0) = f(i, 0) + self%lifts(k - 1)
    end do
  end subroutine follow

  !> Maxima over the turn of |L|, |dL/dtheta| and |d2L/dtheta2|.
  pure function bounds(self)
    class(law_type), intent(in) :: self
    real(dp) :: bounds(0:2)
    integer :: k

    bounds = [maxval(abs(self%lifts)), 0.0_dp, 0.0_dp]
    do k = 1, size(self%laws)
      associate (width => self%ends(k) - self%ends(k - 1))
        bounds(1:) = max(bounds(1:), abs(self%lifts(k) - self%lifts(k - 1)) * peaks(:, self%laws(k)) / [width, width**2])
      end associate
    end do
  end function bounds

  !> Order whose wave is as long as the shortest segment in which the follower moves.
  pure real(dp) function order(self)
    class(law_type), intent(in) :: self
    integer :: k

    order = 2 * pi / minval([(self%ends(k) - self%ends(k - 1), k = 1, size(self%laws))], mask=self%laws /= dwell)
  end function order

  !> Angles of the cam (rad) at which the law is not smooth: the ends of all segments, and where parts of a modified law meet.
  pure function kinks(self)
    class(law_type), intent(in) :: self
    real(dp), allocatable :: kinks(:)
    integer :: k

    kinks = self%ends(1:)
    do k = 1, size(self%laws)
      associate (width => self%ends(k) - self%ends(k - 1))
        if (self%laws(k) == modified_sine) kinks = [kinks, self%ends(k - 1) + width * [1, 7] / 8]
        if (self%laws(k) == modified_trapezoid) kinks = [kinks, self%ends(k - 1) + width * [1, 3, 5, 7] / 8]
      end associate
    end do
  end function kinks

  !> Jump of the acceleration d2L/dtheta2 (m) at the end of each segment, shape (segments); 0 if it is only a rounding error.
  pure function jumps(self)
    class(law_type), intent(in) :: self
    real(dp) :: jumps(size(self%laws))
    real(dp), parameter :: rounding = 1.0e-9_dp
    real(dp) :: f(0:3), start(size(self%laws)), limits(0:2)
    integer :: k

    do k = 1, size(self%laws)
      f = normalised(self%laws(k), 0.0_dp)
      start(k) = f(2) * (self%lifts(k) - self%lifts(k - 1)) / (self%ends(k) - self%ends(k - 1))**2
    end do
    ! By symmetry the acceleration at the end of a segment is the opposite of that at its start.
    jumps = cshift(start, 1) + start
    limits = self%bounds()
    where (abs(jumps) <= rounding * limits(2)) jumps = 0
  end function jumps

end module gestell_model_joints_law
