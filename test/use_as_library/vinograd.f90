!> Vinograd's system: exponents +2 and -13, though P(t) has the eigenvalues -1 and -10 at every time.
module vinograd_system
  use gestell_api_numerics, only: dp, periodic_system
  implicit none (type, external)
  private

  type, extends(periodic_system), public :: vinograd_type
  contains
    procedure :: matrix
  end type vinograd_type

contains

  subroutine matrix(self, t, p)
    class(vinograd_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    associate (unused => self, c => cos(6 * t), s => sin(6 * t))
      p(:, 1) = [-1 - 9 * c**2 + 12 * s * c, -12 * s**2 + 9 * s * c]
      p(:, 2) = [12 * c**2 + 9 * s * c, -1 - 9 * s**2 - 12 * s * c]
    end associate
  end subroutine matrix

end module vinograd_system

!> A program of another package. Stops with an error unless the known exponents come out, within the errors claimed.
program vinograd
  use gestell_api_numerics, only: accuracy_type, dp, error_type, monodromy_type, multipliers_type, pi, solve_monodromy, &
    & solve_multipliers
  use vinograd_system, only: vinograd_type
  implicit none (type, external)

  real(dp), parameter :: period = pi / 6, known(2) = [2.0_dp, -13.0_dp]
  type(monodromy_type) :: monodromy
  type(multipliers_type) :: multipliers
  type(error_type), allocatable :: error
  real(dp) :: off(2)

  call solve_monodromy(vinograd_type(states=2, period=period), accuracy_type(), .false., monodromy, error)
  if (allocated(error)) error stop "no monodromy matrix"
  call solve_multipliers(monodromy, .false., multipliers, error)
  if (allocated(error)) error stop "no multipliers"

  off = abs(exp(real(multipliers%exponent) * period) / exp(known * period) - 1)
  print "(a, 2f18.12)", "exponents     ", real(multipliers%exponent)
  print "(a, 2es18.1)", "errors of rho ", off
  print "(a, 2es18.1)", "bounds        ", multipliers%error
  if (any(off > multipliers%error)) error stop "an error is greater than its bound"
  ! The tolerance of 1e-9 is for Phi(T), whose norm is about exp(2 T); the small multiplier is exp(15 T) times smaller.
  if (any(multipliers%error > [1.0e-7_dp, 1.0e-3_dp])) error stop "a bound is too wide"
end program vinograd
