!> Finds the maximum of a function of one variable within an interval, step by step:
!>
!>     call climb%start(places, values)                  ! three ascending positions and the values there
!>     do while (.not. climb%done)
!>       value = ...                                     ! the function at the position climb%next
!>       call climb%take(value)
!>     end do
!>
!> If the middle one of the three positions is not the highest, the positions move uphill, each time twice as far apart. After
!> that the maximum is approached by parabolas. Golden sections are used if parabolas do not shorten the interval (R. P. Brent,
!> Algorithms for Minimization without Derivatives, 1973, chapter 5). Near a resonance a peak is P = P_0 / sqrt(1 + u^2), where u
!> is proportional to the distance from the resonance, so -1/P^2 is exactly a parabola.
module gestell_study_design_range_climb
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> State and result of the search for a maximum.
  type, public :: climb_type
    !> `next`: position at which the caller evaluates the function next. `top`: position of the maximum. `highest`: largest value so
    !> far, which may be slightly below the maximum
    real(dp) :: next = 0, top = 0, highest = 0
    !> True if the search has ended: the maximum is known to the relative accuracy `gain`, it is at an end of the interval, the
    !> interval is too short, or the maximum number of steps is reached
    logical :: done = .false.
    !> True if the maximum is smooth. False if it is at a jump or at an end of the interval, or if none was found
    logical :: smooth = .false.
    !> Curvature of a smooth maximum: at the distance t from the maximum the value is lower by `bend` t^2
    real(dp) :: bend = 0
    !> Number of function values that the search has used
    integer :: steps = 0
    real(dp), private :: x(3) = 0, f(3) = 0, bounds(2) = 0, before = 0
    integer, private :: most = 0
  contains
    procedure :: start, take
    procedure, private :: aim
  end type climb_type

  real(dp), parameter :: golden = 0.381966011250105_dp
  !> The search ends if the relative gain expected from another step is smaller than this.
  real(dp), parameter, public :: gain = 1.0e-10_dp
  !> Number of steps that suffice to find a smooth maximum.
  integer, parameter, public :: of_smooth = 12
  !> The search ends if the length of the interval, relative to its position, is smaller than this.
  real(dp), parameter :: shortest = 1.0e-10_dp

contains

  !> Starts the search from three ascending positions x with the values f. `bounds`: first and last position that the search may
  !> use. `most`: maximum number of steps.
  subroutine start(self, x, f, bounds, most)
    class(climb_type), intent(out) :: self
    real(dp), intent(in) :: x(3), f(3), bounds(2)
    integer, intent(in) :: most

    self%x = x
    self%f = f
    self%bounds = bounds
    self%most = most
    self%before = x(3) - x(1)
    call self%aim()
  end subroutine start

  !> Accepts the value of the function at `next`, and sets `next` to the following position.
  pure subroutine take(self, value)
    class(climb_type), intent(inout) :: self
    real(dp), intent(in) :: value
    real(dp) :: x(4), f(4)
    integer :: kept(3)

    self%steps = self%steps + 1
    x = [self%x, self%next]
    f = [self%f, value]
    if (x(4) > x(3)) then
      kept = [2, 3, 4]
    else if (x(4) < x(1)) then
      kept = [4, 1, 2]
    else if (value > f(2)) then
      kept = merge([2, 4, 3], [1, 4, 2], x(4) > x(2))
    else
      kept = merge([1, 2, 4], [4, 2, 3], x(4) > x(2))
    end if
    self%x = x(kept)
    self%f = f(kept)
    call self%aim()
  end subroutine take

  !> Sets the position `next`, or ends the search.
  pure subroutine aim(self)
    class(climb_type), intent(inout) :: self
    real(dp) :: left, right, a, b, step

    associate (x => self%x, f => self%f)
      self%top = x(maxloc(f, dim=1))
      self%highest = maxval(f)
      self%done = self%steps >= self%most
      if (self%done) return
      if (f(3) > f(2) .and. f(3) >= f(1)) then
        self%done = x(3) >= self%bounds(2)
        self%next = min(x(3) + 2 * (x(3) - x(1)), self%bounds(2))
        return
      else if (f(1) > f(2)) then
        self%done = x(1) <= self%bounds(1)
        self%next = max(x(1) - 2 * (x(3) - x(1)), self%bounds(1))
        return
      end if
      left = x(2) - x(1)
      right = x(3) - x(2)
      self%done = max(left, right) <= shortest * abs(x(2))
      if (self%done) return
      ! parabola at the distance t from the middle point: f(2) - f = a t^2 - b t
      a = ((f(2) - f(1)) / left + (f(2) - f(3)) / right) / (left + right)
      b = ((f(3) - f(2)) / right * left + (f(2) - f(1)) / left * right) / (left + right)
      step = 0
      if (a > 0) step = b / (2 * a)
      self%done = a > 0 .and. b**2 / (4 * a) <= gain * abs(f(2)) .and. min(f(2) - f(1), f(2) - f(3)) <= 100 * gain * abs(f(2))
      self%smooth = self%done
      if (self%done) then
        self%top = x(2) + step
        self%bend = a
        return
      end if
      if (self%steps > of_smooth) then
        ! near a jump a parabola does not help
        step = merge(-0.5_dp * left, 0.5_dp * right, left > right)
      else if (.not. a > 0 .or. (left + right > 0.5_dp * self%before .and. modulo(self%steps, 3) == 2)) then
        step = merge(-golden * left, golden * right, left > right)
      else if (abs(step) < 1.0e-3_dp * min(left, right)) then
        ! step to the other side, to enclose a maximum that is almost found
        step = sign(min(left, right) * 1.0e-2_dp, merge(-1.0_dp, 1.0_dp, left > right))
      end if
      if (modulo(self%steps, 3) == 2) self%before = left + right
      self%next = min(max(x(2) + step, x(1) + 0.01_dp * left), x(3) - 0.01_dp * right)
    end associate
  end subroutine aim

end module gestell_study_design_range_climb
