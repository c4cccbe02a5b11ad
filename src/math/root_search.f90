!> A zero of a continuous function between two places where its signs differ, by inverse quadratic interpolation where that is
!> safe and bisection elsewhere (Chandrupatla, Adv. Eng. Software 28, 1997, 145). The caller evaluates the function:
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

  type, public :: root_search_type
    !> The ends of the bracket, the newest point first, and the function there.
    real(dp) :: x(2) = 0, f(2) = 0
    !> The point that left the bracket last, and the function there.
    real(dp), private :: x_before = 0, f_before = 0
    logical, private :: is_new = .true.
  contains
    procedure :: start
    procedure :: found
    procedure :: next
    procedure :: replaces
    procedure :: take
    procedure :: root
    procedure :: width
  end type root_search_type

contains

  !> A search between `a` and `b`.
  subroutine start(self, a, fa, b, fb)
    class(root_search_type), intent(out) :: self
    real(dp), intent(in) :: a, fa, b, fb

    self%x = [a, b]
    self%f = [fa, fb]
  end subroutine start

  !> Whether the bracket is narrower than two tolerances, or a zero was met.
  pure logical function found(self, tolerance)
    class(root_search_type), intent(in) :: self
    real(dp), intent(in) :: tolerance

    found = tolerance > 0.5_dp * self%width() .or. .not. minval(abs(self%f)) > 0
  end function found

  !> Where the function is wanted next, at least `tolerance` away from both ends.
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
    ! Rounding may lead out of a bracket whose ends differ by many decades.
    next = max(minval(self%x), min(maxval(self%x), self%x(1) + part * (self%x(2) - self%x(1))))
  end function next

  !> Whether a point where the function is `f` takes the place of the newest end; else of the other one.
  pure logical function replaces(self, f)
    class(root_search_type), intent(in) :: self
    real(dp), intent(in) :: f

    replaces = (f > 0) .eqv. (self%f(1) > 0)
  end function replaces

  !> Takes in the function at `x` within the bracket.
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

  !> The end of the bracket where the function is nearer to zero.
  pure real(dp) function root(self)
    class(root_search_type), intent(in) :: self

    root = merge(self%x(1), self%x(2), abs(self%f(1)) < abs(self%f(2)))
  end function root

  !> Of the bracket.
  pure real(dp) function width(self)
    class(root_search_type), intent(in) :: self

    width = abs(self%x(2) - self%x(1))
  end function width

end module gestell_math_root_search
