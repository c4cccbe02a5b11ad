!> Ball arithmetic: a ball represents all numbers whose distance from `mid` is at most `radius`. Rounding errors are not included;
!> the caller adds them.
module gestell_math_ball
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: operator(+), operator(-), operator(*), operator(/)

  type, public :: ball
    !> Centre and radius >= 0
    real(dp) :: mid = 0, radius = 0
  contains
    procedure :: maximum
  end type ball

  interface operator(+)
    module procedure :: add
  end interface

  interface operator(-)
    module procedure :: subtract
  end interface

  interface operator(*)
    module procedure :: multiply
  end interface

  interface operator(/)
    module procedure :: divide
  end interface

contains

  !> Maximum of |x| over all numbers x in the ball.
  elemental real(dp) function maximum(self)
    class(ball), intent(in) :: self

    maximum = abs(self%mid) + self%radius
  end function maximum

  !> Sum of two balls: it contains every sum of a number in `a` and a number in `b`.
  elemental type(ball) function add(a, b)
    type(ball), intent(in) :: a, b

    add = ball(a%mid + b%mid, a%radius + b%radius)
  end function add

  !> Difference of two balls: it contains every difference of a number in `a` and a number in `b`.
  elemental type(ball) function subtract(a, b)
    type(ball), intent(in) :: a, b

    subtract = ball(a%mid - b%mid, a%radius + b%radius)
  end function subtract

  !> Product of two balls: it contains every product of a number in `a` and a number in `b`.
  elemental type(ball) function multiply(a, b)
    type(ball), intent(in) :: a, b

    multiply = ball(a%mid * b%mid, abs(a%mid) * b%radius + a%radius * b%maximum())
  end function multiply

  !> Quotient of two balls: it contains every quotient of a number in `a` and a number in `b`; `b` must not contain zero.
  elemental type(ball) function divide(a, b)
    type(ball), intent(in) :: a, b

    divide%mid = a%mid / b%mid
    divide%radius = (a%radius + abs(divide%mid) * b%radius) / (abs(b%mid) - b%radius)
  end function divide

end module gestell_math_ball
