!> Variables in which a parameter can be expanded. The motion over a period is a smoother function of some variables than of others.
!> For example, the phase of vibrations within a period is proportional to the inverse of the speed.
module gestell_task_sweep_expansion_variable
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  integer, parameter, public :: itself = 1, inverse = 2, logarithm = 3

  !> A variable in which a parameter is expanded. The range of the parameter is mapped to x in [-1, 1].
  type, public :: variable_type
    real(dp) :: from = 0, to = 0
    integer :: kind = itself
  contains
    procedure :: is_applicable, x_of, parameter_of
  end type variable_type

contains

  !> True if the variable is defined in the whole range of the parameter.
  pure logical function is_applicable(self)
    class(variable_type), intent(in) :: self

    is_applicable = self%kind == itself .or. self%from * self%to > 0
  end function is_applicable

  !> Coordinate x that belongs to a value of the parameter: 1 at the end `to` of the range, -1 at the end `from`.
  elemental real(dp) function x_of(self, parameter) result(x)
    class(variable_type), intent(in) :: self
    real(dp), intent(in) :: parameter
    real(dp) :: a, b, u

    x = 0
    if (.not. abs(self%to - self%from) > 0) return
    a = mapped(self, self%from)
    b = mapped(self, self%to)
    u = mapped(self, parameter)
    x = max(-1.0_dp, min(1.0_dp, ((u - a) - (b - u)) / (b - a)))
  end function x_of

  !> Value of the parameter at the coordinate `x`; the inverse of `x_of`.
  elemental real(dp) function parameter_of(self, x) result(parameter)
    class(variable_type), intent(in) :: self
    real(dp), intent(in) :: x
    real(dp) :: u

    u = (mapped(self, self%from) * (1 - x) + mapped(self, self%to) * (1 + x)) / 2
    parameter = u
    if (self%kind == inverse) parameter = 1 / u
    if (self%kind == logarithm) parameter = sign(exp(u), self%from)
    ! Rounding must not move the parameter out of its range.
    parameter = max(min(self%from, self%to), min(max(self%from, self%to), parameter))
  end function parameter_of

  elemental real(dp) function mapped(self, parameter) result(u)
    class(variable_type), intent(in) :: self
    real(dp), intent(in) :: parameter

    u = parameter
    if (self%kind == inverse) u = 1 / parameter
    if (self%kind == logarithm) u = log(abs(parameter))
  end function mapped

end module gestell_task_sweep_expansion_variable
