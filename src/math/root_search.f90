!> Finds a zero of a continuous function between two points where its signs differ. It uses inverse quadratic interpolation where
!> this is safe, and bisection elsewhere (Chandrupatla, Adv. Eng. Software 28, 1997, 145). The caller evaluates the function:
!>
!>     call search%start(a, f(a), b, f(b))
!>     do while (.not. search%found(tolerance))
!>       x = search%next(tolerance)
!>       call search%take(x, f(x))
!>     end do
!>     x = search%root()
module gestell_math_root_search
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> A search for a zero
  type, public :: root_search_type
    !> `x`: ends of the interval that contains the zero, newest point first. `f`: values of the function at these points.
    real(dp) :: x(2) = 0, f(2) = 0
    !> The end of the interval that the newest point has replaced, and the value of the function there
    real(dp), private :: x_before = 0, f_before = 0
    !> True until `take` has added the first point
    logical, private :: is_new = .true.
  contains
    procedure :: start, found, next, replaces, take, root, width
  end type root_search_type

contains

  !> Starts a search between `a` and `b`, where the function has the values `fa` and `fb`.
  subroutine start(self, a, fa, b, fb)
    class(root_search_type), intent(out) :: self
    real(dp), intent(in) :: a, fa, b, fb

    self%x = [a, b]
    self%f = [fa, fb]
  end subroutine start

  !> True if the interval that contains the zero is narrower than two tolerances, or if the function is zero at one of its ends.
  pure logical function found(self, tolerance)
    class(root_search_type), intent(in) :: self
    real(dp), intent(in) :: tolerance

    found = tolerance > 0.5_dp * self%width() .or. .not. minval(abs(self%f)) > 0
  end function found

  !> Point at which the caller must evaluate the function next. It is at least `tolerance` away from both ends of the interval.
  pure real(dp) function next(self, tolerance)
    class(root_search_type), intent(in) :: self
    real(dp), intent(in) :: tolerance
    real(dp) :: part, least

    part = 0.5_dp
    if (.not. self%is_new) then
      associate (a => self%x(1), b => self%x(2), c => self%x_before, fa => self%f(1), fb => self%f(2), fc => self%f_before)
        associate (xi => (a - b) / (c - b), phi => (fa - fb) / (fc - fb))
          if (phi**2 < xi .and. (1 - phi)**2 < 1 - xi) then
            part = fa / (fb - fa) * (fc / (fb - fc)) + (c - a) / (b - a) * (fa / (fc - fa)) * (fb / (fc - fb))
          end if
        end associate
      end associate
      least = min(tolerance / self%width(), 0.5_dp)
      part = min(max(part, least), 1 - least)
    end if
    ! Rounding can lead out of an interval whose ends differ by many orders of magnitude.
    next = max(minval(self%x), min(maxval(self%x), self%x(1) + part * (self%x(2) - self%x(1))))
  end function next

  !> True if a point with the value `f` replaces the newest end of the interval; false if it replaces the other end.
  pure logical function replaces(self, f)
    class(root_search_type), intent(in) :: self
    real(dp), intent(in) :: f

    replaces = (f > 0) .eqv. (self%f(1) > 0)
  end function replaces

  !> Adds the point `x` within the interval, where the function has the value `f`.
  pure subroutine take(self, x, f)
    class(root_search_type), intent(inout) :: self
    real(dp), intent(in) :: x, f
    integer :: leaving

    leaving = merge(1, 2, self%replaces(f))
    self%x_before = self%x(leaving)
    self%f_before = self%f(leaving)
    if (leaving == 2) then
      self%x(2) = self%x(1)
      self%f(2) = self%f(1)
    end if
    self%x(1) = x
    self%f(1) = f
    self%is_new = .false.
  end subroutine take

  !> Result of the search: the end of the interval at which the function is closer to zero.
  pure real(dp) function root(self)
    class(root_search_type), intent(in) :: self

    root = merge(self%x(1), self%x(2), abs(self%f(1)) < abs(self%f(2)))
  end function root

  !> Width of the interval that contains the zero.
  pure real(dp) function width(self)
    class(root_search_type), intent(in) :: self

    width = abs(self%x(2) - self%x(1))
  end function width

end module gestell_math_root_search
