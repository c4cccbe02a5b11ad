!> The program behind Table 3, as far as its printed results tell: a RECONSTRUCTION, not the lost source.
!>
!> What is certain: the formulas (17)-(18) as they are printed. What is inferred from the twelve printed values:
!> 360 steps, and a slip in the excitation part of the step. Its distribution over the terms is not unique;
!> `table_3_evidence` counts the others that print the same table.
module original_program
  use original_mechanism, only: dp, pi, four_bar, state_form, identity, solve
  implicit none (type, external)
  private

  public :: program_options, as_printed, runge_kutta_weights, monodromy, initial_state

  !> What the Runge-Kutta method gives the terms Pm f0, Pm fm, P1 fm, Pm^2 f0, P1 Pm fm, P1 Pm^2 f0 of a step
  real(dp), parameter :: runge_kutta_weights(6) = 1.0_dp
  !> What the original program seems to give them
  real(dp), parameter :: slipped_weights(6) = [1.0_dp, 2.0_dp, 1.0_dp, 2.0_dp, 2.0_dp, 1.0_dp]

  !> Which program is emulated; the defaults are the original one.
  type :: program_options
    integer :: steps = 360
    !> The factors of each product in (18) in the printed order, which is the reverse of the right one
    logical :: printed_order = .true.
    !> Weights of the excitation terms relative to the Runge-Kutta method
    real(dp) :: weights(6) = slipped_weights
  end type program_options

  type(program_options), parameter :: as_printed = program_options()

contains

  !> The initial state of the periodic vibration: (E - Phi) x0 = x_p(T), units m, rad, m/s, rad/s.
  function initial_state(machine, omega, options) result(x0)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega
    type(program_options), intent(in) :: options
    real(dp) :: x0(6)

    real(dp) :: phi(6, 6), x_p(6), x(6, 1)

    call run_through_period(machine, omega, options, phi, x_p)
    x = solve(identity(6) - phi, reshape(x_p, [6, 1]))
    x0 = x(:, 1)
  end function initial_state

  !> Phi(T) of (17).
  function monodromy(machine, omega, options) result(phi)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega
    type(program_options), intent(in) :: options
    real(dp) :: phi(6, 6)

    real(dp) :: x_p(6)

    call run_through_period(machine, omega, options, phi, x_p)
  end function monodromy

  !> Phi(T) from Phi = E and the particular solution x_p(T) from x = 0, step by step with x <- A x + b.
  subroutine run_through_period(machine, omega, options, phi, x_p)
    type(four_bar), intent(in) :: machine
    real(dp), intent(in) :: omega
    type(program_options), intent(in) :: options
    real(dp), intent(out) :: phi(6, 6), x_p(6)

    real(dp), dimension(6, 6) :: p0, pm, p1, a
    real(dp), dimension(6) :: f0, fm, f1, b
    real(dp) :: h
    integer :: i

    h = 2 * pi / abs(omega) / options%steps
    phi = identity(6)
    x_p = 0.0_dp
    call state_form(machine, omega, 0.0_dp, p1, f1)
    do i = 1, options%steps
      p0 = p1
      f0 = f1
      call state_form(machine, omega, (i - 0.5_dp) * h, pm, fm)
      call state_form(machine, omega, i * h, p1, f1)
      if (options%printed_order) then
        a = step_matrix(h, p1, pm, p0)
      else
        a = step_matrix(h, p0, pm, p1)
      end if
      b = step_excitation(h, pm, p1, f0, fm, f1, options%weights)
      phi = matmul(a, phi)
      x_p = matmul(a, x_p) + b
    end do
  end subroutine run_through_period

  !> A of one step of the classical Runge-Kutta method for x' = P x. The matrix at the beginning of the step stands
  !> on the right of each product. The printed (18) has it on the left: p0 and p1 change places, which the first,
  !> symmetric bracket does not notice.
  pure function step_matrix(h, p0, pm, p1) result(a)
    real(dp), intent(in) :: h
    real(dp), intent(in), dimension(6, 6) :: p0, pm, p1
    real(dp) :: a(6, 6)

    real(dp), dimension(6, 6) :: pm_p0, p1_pm

    pm_p0 = matmul(pm, p0)
    p1_pm = matmul(p1, pm)
    a = identity(6) + (h * (p0 + 4 * pm + p1) &
        & + h**2 * (pm_p0 + matmul(pm, pm) + p1_pm) &
        & + h**3 / 2 * (matmul(pm, pm_p0) + matmul(p1_pm, pm)) &
        & + h**4 / 4 * matmul(p1_pm, pm_p0)) / 6
  end function step_matrix

  !> b of one step: what the excitation adds to x <- A x + b. With all weights 1 it is that of the Runge-Kutta method.
  pure function step_excitation(h, pm, p1, f0, fm, f1, weights) result(b)
    real(dp), intent(in) :: h
    real(dp), intent(in) :: pm(6, 6), p1(6, 6), f0(6), fm(6), f1(6), weights(6)
    real(dp) :: b(6)

    real(dp), dimension(6) :: pm_f0, pm_fm, pm_pm_f0

    pm_f0 = matmul(pm, f0)
    pm_fm = matmul(pm, fm)
    pm_pm_f0 = matmul(pm, pm_f0)
    associate (w => weights)
      b = (h * (f0 + 4 * fm + f1) &
          & + h**2 * (w(1) * pm_f0 + w(2) * pm_fm + w(3) * matmul(p1, fm)) &
          & + h**3 / 2 * (w(4) * pm_pm_f0 + w(5) * matmul(p1, pm_fm)) &
          & + h**4 / 4 * w(6) * matmul(p1, pm_pm_f0)) / 6
    end associate
  end function step_excitation

end module original_program
