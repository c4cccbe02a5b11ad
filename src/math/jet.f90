!> Truncated Taylor arithmetic: a jet is a value with its first three derivatives with respect to the crank angle. Kinematic
!> formulas written for jets thus give exact derivatives, by Leibniz' rule and the chain rule.
module gestell_math_jet
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: operator(+), operator(-), operator(*), operator(/), sqrt, sin, cos

  !> `v`: value. `d`, `dd`, `ddd`: first, second and third derivative
  type, public :: jet
    real(dp) :: v = 0, d = 0, dd = 0, ddd = 0
  end type jet

  interface operator(+)
    module procedure :: add, add_constant
  end interface

  interface operator(-)
    module procedure :: subtract, subtract_constant, negate
  end interface

  interface operator(*)
    module procedure :: multiply, multiply_constant
  end interface

  interface operator(/)
    module procedure :: divide
  end interface

  interface sqrt
    module procedure :: square_root
  end interface

  interface sin
    module procedure :: sine
  end interface

  interface cos
    module procedure :: cosine
  end interface

contains

  !> Sum of two jets: value and derivatives are added.
  elemental type(jet) function add(a, b) result(c)
    type(jet), intent(in) :: a, b
    c = jet(a%v + b%v, a%d + b%d, a%dd + b%dd, a%ddd + b%ddd)
  end function add

  elemental type(jet) function add_constant(a, b) result(c)
    type(jet), intent(in) :: a
    real(dp), intent(in) :: b
    c = jet(a%v + b, a%d, a%dd, a%ddd)
  end function add_constant

  !> Difference of two jets: value and derivatives are subtracted.
  elemental type(jet) function subtract(a, b) result(c)
    type(jet), intent(in) :: a, b
    c = jet(a%v - b%v, a%d - b%d, a%dd - b%dd, a%ddd - b%ddd)
  end function subtract

  elemental type(jet) function subtract_constant(a, b) result(c)
    type(jet), intent(in) :: a
    real(dp), intent(in) :: b
    c = jet(a%v - b, a%d, a%dd, a%ddd)
  end function subtract_constant

  elemental type(jet) function negate(a) result(c)
    type(jet), intent(in) :: a
    c = jet(-a%v, -a%d, -a%dd, -a%ddd)
  end function negate

  !> Product of two jets, by Leibniz' rule.
  elemental type(jet) function multiply(a, b) result(c)
    type(jet), intent(in) :: a, b
    c = jet(a%v * b%v, a%d * b%v + a%v * b%d, a%dd * b%v + 2 * a%d * b%d + a%v * b%dd, &
      & a%ddd * b%v + 3 * (a%dd * b%d + a%d * b%dd) + a%v * b%ddd)
  end function multiply

  elemental type(jet) function multiply_constant(a, b) result(c)
    real(dp), intent(in) :: a
    type(jet), intent(in) :: b
    c = jet(a * b%v, a * b%d, a * b%dd, a * b%ddd)
  end function multiply_constant

  !> Quotient c = a / b, computed from a = c b and its first three derivatives.
  elemental type(jet) function divide(a, b) result(c)
    type(jet), intent(in) :: a, b
    c%v = a%v / b%v
    c%d = (a%d - c%v * b%d) / b%v
    c%dd = (a%dd - 2 * c%d * b%d - c%v * b%dd) / b%v
    c%ddd = (a%ddd - 3 * (c%dd * b%d + c%d * b%dd) - c%v * b%ddd) / b%v
  end function divide

  !> Square root c of a jet a, computed from a = c c and its first three derivatives; requires a%v > 0.
  elemental type(jet) function square_root(a) result(c)
    type(jet), intent(in) :: a
    c%v = sqrt(a%v)
    c%d = a%d / (2 * c%v)
    c%dd = (a%dd - 2 * c%d**2) / (2 * c%v)
    c%ddd = (a%ddd - 6 * c%d * c%dd) / (2 * c%v)
  end function square_root

  !> Sine of a jet, by the chain rule.
  elemental type(jet) function sine(a) result(c)
    type(jet), intent(in) :: a
    c%v = sin(a%v)
    c%d = cos(a%v) * a%d
    c%dd = cos(a%v) * a%dd - sin(a%v) * a%d**2
    c%ddd = cos(a%v) * (a%ddd - a%d**3) - 3 * sin(a%v) * a%d * a%dd
  end function sine

  !> Cosine of a jet, by the chain rule.
  elemental type(jet) function cosine(a) result(c)
    type(jet), intent(in) :: a
    c%v = cos(a%v)
    c%d = -sin(a%v) * a%d
    c%dd = -sin(a%v) * a%dd - cos(a%v) * a%d**2
    c%ddd = -sin(a%v) * (a%ddd - a%d**3) - 3 * cos(a%v) * a%d * a%dd
  end function cosine

end module gestell_math_jet
