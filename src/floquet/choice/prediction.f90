!> Predicts the number of steps that a method needs, before any step is computed ("Integration" in doc/theory.md). Numbers of steps
!> are real here, because they may exceed the range of integers.
module gestell_floquet_choice_prediction
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_choice_survey, only: survey_type
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_methods, only: pair_begun
  use gestell_floquet_integrator_nested, only: phase_error_ratio, embedded_phase_error
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: has_positions
  implicit none (type, external)
  private

  public :: fewest, first_steps, steps_in_all, rounded_steps

contains

  !> Number of steps for the first solution by a method with embedded methods. With this number the solution should reach the
  !> tolerance. It is the smallest number that meets all these requirements:
  !>
  !> - the steps resolve the coefficients,
  !> - the phase of the fastest motion advances by at most `longest_turn` radians in a step,
  !> - the error of the Gauss method without fitting is at most `error_share` times the allowed error,
  !> - the result of the first embedded method differs from that of the method by at most `change` times the allowed error,
  !> - the second embedded method converges, or the first one differs from the method by at most twice the allowed error,
  !> - the nodes resolve the coefficients and the loads (`steps_to_resolve`).
  !>
  !> The constants in `gain`, the required reduction of the quadrature error, were fitted to 30000 solutions of 548 random
  !> machines. If these constants are smaller, a second solution is needed more often; if they are larger, the first solution has
  !> too many steps. Values of `change` from 100 to 300 lead to the same total work.
  pure real(dp) function first_steps(method, system, survey, tolerance) result(steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    !> Estimates of the phase advance and the variation of the coefficients, from `survey_system`
    type(survey_type), intent(in) :: survey
    !> Allowed error of the map over the period, relative to its norm
    real(dp), intent(in) :: tolerance
    real(dp), parameter :: error_share = 4, change = 240, of_changes = 0.15_dp
    real(dp) :: allowed, rounding, lower, width(2), gain(2)
    integer :: i

    ! Reserve a part of the tolerance for rounding, which the estimate of the error includes.
    rounding = epsilon(1.0_dp) * (2 * survey%phase_advance + 4 * survey%fastest)
    allowed = max(tolerance - 4 * rounding, tolerance / 4, 4 * epsilon(1.0_dp) * survey%fastest) / 8
    lower = embedded_phase_error(has_positions(system)) * method%lower_constant
    width = [(width_of(system, survey, i), i = 1, 2)]
    gain = of_changes * survey%height / allowed * [survey%changing * max(survey%fastest, 1.0_dp), &
      & method%order**2 / width(2)**1.5_dp * (1 + survey%phase_advance / 8)]
    steps = max(fewest(method, system), survey%fastest / method%longest_turn, &
      & predicted(method%order, method%error_constant, system, survey, error_share * allowed), &
      & steps_to_follow(method%lower_order, lower, survey, change * allowed), &
      & min(steps_to_follow(method%lower_order - 2, phase_error_ratio(method%stages - 1) * lower, survey, pair_begun), &
      &   steps_to_follow(method%lower_order, lower, survey, 2 * allowed)), &
      & steps_to_resolve(method, width(1), gain(1)), &
      & steps_to_resolve(method, width(2), gain(2)))
    steps = rounded_steps(method, system, steps)
  end function first_steps

  !> Number of steps for which the estimated quadrature error at the Gauss nodes is 1 / `gain` of the integrand. The integrand is
  !> analytic up to the distance `width` (rad) from the real axis, with 2 pi per period.
  !>
  !> The quadrature error of N steps is proportional to R**(-order), where R is the sum of the semiaxes of Bernstein's ellipse
  !> around a step (Trefethen, doi:10.1137/060659831, Theorem 4.5). In units of half a step, H = pi / N, the minor semiaxis is
  !> width / H = (R - 1 / R) / 2. The estimate is larger than this error: it is R**(3 - order).
  pure real(dp) function steps_to_resolve(method, width, gain) result(steps)
    class(method_type), intent(in) :: method
    real(dp), intent(in) :: width, gain
    real(dp) :: r

    steps = 0
    if (gain <= 1) return
    r = gain**(1.0_dp / max(method%order - 3, 1))
    steps = pi * (r - 1 / r) / (2 * width)
  end function steps_to_resolve

  !> Distance (rad) from the real axis up to which the coefficients (`which` = 1) or the loads (`which` = 2) are analytic. It is
  !> taken from the survey, but is at least 7 / `least_steps`: a survey with too few samples underestimates the distance, and no
  !> random linkage had a smaller one.
  pure real(dp) function width_of(system, survey, which) result(width)
    class(periodic_system), intent(in) :: system
    type(survey_type), intent(in) :: survey
    integer, intent(in) :: which

    width = max(survey%width(which), 7.0_dp / system%least_steps)
  end function width_of

  !> Minimum number of steps that resolves the fastest change of the coefficients: `least_steps` of the system. A method with
  !> embedded methods may use fewer steps, but at least as many nodes in total as `least_steps` steps with six stages have.
  pure real(dp) function fewest(method, system)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system

    fewest = system%least_steps
    if (method%lower_order > 0) fewest = 6 * fewest / method%stages
  end function fewest

  !> Number of steps for which the error that a method makes in the fastest motion is `error`. The phase of this motion is
  !> assumed to advance by 0.98 times `survey%fastest`; this factor is the median over random systems.
  pure real(dp) function steps_to_follow(order, constant, survey, error) result(steps)
    integer, intent(in) :: order
    real(dp), intent(in) :: constant, error
    type(survey_type), intent(in) :: survey

    steps = 0.98_dp * survey%fastest * (constant * survey%fade * max(survey%fastest, 1.0_dp) / error)**(1.0_dp / order)
  end function steps_to_follow

  !> Number of steps for which the error of the method is `error`.
  !>
  !> The error grows with the phase advance of the fastest motion, which is taken as 0.925 `survey%fastest`. It is proportional
  !> to `survey%fade`, the share of the fastest motion in the monodromy matrix. It also grows with the bandwidth of the
  !> coefficients: their k-th harmonic falls like exp(-k width), and a method of order p has its largest error at k = p / width.
  pure real(dp) function predicted(order, constant, system, survey, error) result(steps)
    !> Order p of the method
    integer, intent(in) :: order
    !> `constant`: error constant of the method. `error`: allowed relative error.
    real(dp), intent(in) :: constant, error
    class(periodic_system), intent(in) :: system
    type(survey_type), intent(in) :: survey
    real(dp) :: harmonic

    harmonic = 1.4_dp * order / width_of(system, survey, 1) * survey%changing**(1.0_dp / order)
    steps = hypot(0.925_dp * survey%fastest, harmonic) &
      & * (constant * survey%fade * max(survey%fastest, 1.0_dp) / error)**(1.0_dp / order)
  end function predicted

  !> Total number of steps of the three solutions that a method without embedded methods computes. The second solution has twice
  !> as many steps as the first; the third one reaches the tolerance. The number of steps of the third solution is predicted from
  !> the method's error constant.
  pure real(dp) function steps_in_all(method, system, survey, tolerance, changing) result(steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    type(survey_type), intent(in) :: survey
    !> `tolerance`: relative tolerance. `changing`: variation of the state matrix P over the period, relative to its mean.
    real(dp), intent(in) :: tolerance, changing
    real(dp) :: coarse, last, constant, allowed

    coarse = max(real(system%least_steps, dp), 1.5_dp * survey%phase_advance / method%order)
    constant = method%error_constant
    if (method%exact_if_constant) constant = constant * changing &
      & * (system%least_steps / max(survey%phase_advance, real(system%least_steps, dp)))**3
    ! The estimate is four times the error, and the aim is half the tolerance. Rounding sets a lower limit.
    allowed = max(tolerance, 4 * epsilon(1.0_dp) * survey%phase_advance) / 8
    last = 1.1_dp * predicted(method%order, constant, system, survey, allowed)
    steps = rounded_steps(method, system, coarse) + rounded_steps(method, system, 2 * coarse) &
      & + rounded_steps(method, system, max(2.5_dp * coarse, last))
  end function steps_in_all

  !> Number `steps`, rounded up to a multiple of the number of steps that the method computes together.
  pure real(dp) function rounded_steps(method, system, steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: steps

    ! Avoid ceiling: the number may exceed the range of integers.
    associate (at_once => method%steps_at_once(system%states, has_positions(system)))
      rounded_steps = aint(steps / at_once)
      if (rounded_steps < steps / at_once) rounded_steps = rounded_steps + 1
      rounded_steps = at_once * rounded_steps
    end associate
  end function rounded_steps

end module gestell_floquet_choice_prediction
