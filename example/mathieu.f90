!> Mathieu's equation as a periodic system.
module mathieu_equation
  use gestell_api_numerics, only: dp, second_order_system
  implicit none (type, external)
  private

  !> y'' + (a - 2 q cos 2 t) y = 0 with period pi.
  type, extends(second_order_system), public :: mathieu_type
    real(dp) :: a, q
  contains
    procedure :: matrices
  end type mathieu_type

contains

  subroutine matrices(self, t, m, b, c)
    class(mathieu_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    m = 1
    b = 0
    c = self%a - 2 * self%q * cos(2 * t)
  end subroutine matrices

end module mathieu_equation

!> Prints multipliers, exponents and verdict of Mathieu's equation, then the values of a for which it is unstable.
program mathieu
  use gestell_api_numerics, only: accuracy_type, dp, error_type, floquet_type, multipliers_type, pi, solve_floquet, &
    & solve_multipliers
  use mathieu_equation, only: mathieu_type
  use, intrinsic :: iso_fortran_env, only: error_unit
  implicit none (type, external)

  real(dp), parameter :: q = 0.2_dp
  type(multipliers_type) :: multipliers
  type(error_type), allocatable :: error
  character(len=:), allocatable :: verdict
  integer :: i

  call solve(1.0_dp, multipliers, error)
  if (allocated(error)) call give_up(error)
  print "(a)", "Mathieu's equation y'' + (a - 2 q cos 2 t) y = 0 with a = 1, q = 0.2"
  print "(a)", "                          real part      imaginary part   bound on the error"
  do i = 1, 2
    print "(a, i0, 2f20.15, es15.1)", "  multiplier ", i, multipliers%rho(i), &
      & abs(multipliers%rho(i)) * multipliers%error(i)
    print "(a, i0, 2f20.15, es15.1)", "  exponent   ", i, multipliers%exponent(i), multipliers%error(i) / pi
  end do
  verdict = multipliers%verdict()
  print "(a)", "  verdict      " // verdict

  ! Without damping the multipliers of bounded motions lie exactly on the unit circle. No computation can distinguish them from
  ! multipliers slightly off it, so the verdict is 'undecided'.
  print "(/, a)", "The same for other a: largest |rho| and verdict"
  do i = 5, 15
    call solve(0.1_dp * i, multipliers, error)
    if (allocated(error)) call give_up(error)
    verdict = multipliers%verdict()
    print "(a, f3.1, f16.10, 2a)", "  a = ", 0.1_dp * i, abs(multipliers%rho(1)), "  ", verdict
  end do

contains

  subroutine solve(a, multipliers, error)
    real(dp), intent(in) :: a
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    type(mathieu_type) :: system
    type(floquet_type) :: floquet

    system = mathieu_type(states=2, period=pi, a=a, q=q)
    call solve_floquet(system, accuracy_type(tolerance=1.0e-12_dp), .false., floquet, error)
    if (allocated(error)) return
    call solve_multipliers(floquet, .false., multipliers, error)
  end subroutine solve

  subroutine give_up(error)
    type(error_type), intent(in) :: error

    write (error_unit, "(a)") error%message
    stop error%code, quiet=.true.
  end subroutine give_up

end program mathieu
