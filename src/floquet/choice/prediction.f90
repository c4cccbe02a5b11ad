!> How many steps a method will take, before one is taken.
module gestell_floquet_choice_prediction
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_choice_survey, only: survey_type
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_methods, only: pair_begun
  use gestell_floquet_integrator_nested, only: fall_over, left_by_embedded
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: has_positions
  implicit none (type, external)
  private

  public :: fewest, first_steps, steps_in_all, whole_steps

contains

  !> With how many steps a method with others embedded in it should come to the tolerance, by an error that is told with care: that
  !> of Gauss' method itself, not fitted, and as much of the change by the first embedded one as counts; and the second embedded one
  !> has begun to converge, or that change is all that is wanted.
  !> What nodes miss of coefficients that change and of loads is told by the roots of the last terms of series, so it falls by three
  !> orders less than what quadrature leaves, and of loads grows with the order: `of_changes`, the powers of it, of the width and of
  !> the order are fitted to 30000 solutions of 548 random machines. With less a second number of steps was needed more often, with
  !> more the first one was too great; of `change`, from 100 to 300 times what is allowed, both came to the same work.
  pure real(dp) function first_steps(method, system, survey, tolerance) result(steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    type(survey_type), intent(in) :: survey
    real(dp), intent(in) :: tolerance
    real(dp), parameter :: left = 4, change = 240, of_changes = 0.15_dp
    real(dp) :: allowed, rounding, lower, width(2), gain(2)
    integer :: i

    ! Roundings are told too, and blur what is told of the rest.
    rounding = epsilon(1.0_dp) * (2 * survey%phase_advance + 4 * survey%fastest)
    allowed = max(tolerance - 4 * rounding, tolerance / 4, 4 * epsilon(1.0_dp) * survey%fastest) / 8
    lower = left_by_embedded(has_positions(system)) * method%lower_constant
    width = [(width_of(system, survey, i), i = 1, 2)]
    gain = of_changes * survey%height / allowed * [survey%changing * max(survey%fastest, 1.0_dp), &
      & method%order**2 / width(2)**1.5_dp * (1 + survey%phase_advance / 8)]
    steps = max(fewest(method, system), survey%fastest / method%longest_turn, &
      & predicted(method%order, method%error_constant, system, survey, left * allowed), &
      & following(method%lower_order, lower, survey, change * allowed), &
      & min(following(method%lower_order - 2, fall_over(method%stages - 1) * lower, survey, pair_begun), &
      &   following(method%lower_order, lower, survey, 2 * allowed)), &
      & resolving(method, width(1), gain(1)), &
      & resolving(method, width(2), gain(2)))
    steps = whole_steps(method, system, steps)
  end function first_steps

  !> Steps that leave the part 1 / gain of a function that is analytic up to `width`: half a step H = pi / N is the unit in which
  !> Bernstein's ellipse has the lesser semiaxis width / H = (R - 1 / R) / 2; quadrature at Gauss' nodes leaves R**(-order)
  !> (Trefethen, doi:10.1137/060659831, Theorem 4.5), what is told of it R**(3 - order).
  pure real(dp) function resolving(method, width, gain) result(steps)
    class(method_type), intent(in) :: method
    real(dp), intent(in) :: width, gain
    real(dp) :: r

    steps = 0
    if (gain <= 1) return
    r = gain**(1.0_dp / max(method%order - 3, 1))
    steps = pi * (r - 1 / r) / (2 * width)
  end function resolving

  !> Width of the coefficients (which = 1) or of the loads (which = 2). Few samples may suggest a smaller one; random linkages have
  !> at least 7 / m if their fastest change takes 1 / m of the period.
  pure real(dp) function width_of(system, survey, which) result(width)
    class(periodic_system), intent(in) :: system
    type(survey_type), intent(in) :: survey
    integer, intent(in) :: which

    width = max(survey%width(which), 7.0_dp / system%least_steps)
  end function width_of

  !> Steps that resolve the fastest change of the coefficients: `least_steps`; embedded methods take as many nodes as these steps
  !> have with six stages.
  pure real(dp) function fewest(method, system)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system

    fewest = system%least_steps
    if (method%lower_order > 0) fewest = 6 * fewest / method%stages
  end function fewest

  !> Steps with which a method leaves such an error in the fastest motion alone, which turns by 0.98 of `fastest` in the median.
  pure real(dp) function following(order, constant, survey, error) result(steps)
    integer, intent(in) :: order
    real(dp), intent(in) :: constant, error
    type(survey_type), intent(in) :: survey

    steps = 0.98_dp * survey%fastest * (constant * survey%fade * max(survey%fastest, 1.0_dp) / error)**(1.0_dp / order)
  end function following

  !> Steps that leave such an error: the fastest motion counts 0.925 of `fastest` and what is left of it, and the coefficients turn
  !> too: of their k-th harmonic, exp(-k width), a method of order p leaves most where k is p / width.
  pure real(dp) function predicted(order, constant, system, survey, error) result(steps)
    integer, intent(in) :: order
    real(dp), intent(in) :: constant, error
    class(periodic_system), intent(in) :: system
    type(survey_type), intent(in) :: survey
    real(dp) :: harmonic

    harmonic = 1.4_dp * order / width_of(system, survey, 1) * survey%changing**(1.0_dp / order)
    steps = hypot(0.925_dp * survey%fastest, harmonic) &
      & * (constant * survey%fade * max(survey%fastest, 1.0_dp) / error)**(1.0_dp / order)
  end function predicted

  !> Steps of all solutions that lead to the tolerance: a coarse one, one with twice as many, and the last, for which the method's
  !> error is known.
  pure real(dp) function steps_in_all(method, system, survey, tolerance, changing) result(steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    type(survey_type), intent(in) :: survey
    real(dp), intent(in) :: tolerance, changing
    real(dp) :: coarse, last, constant, allowed

    coarse = max(real(system%least_steps, dp), 1.5_dp * survey%phase_advance / method%order)
    constant = method%error_constant
    if (method%exact_if_constant) constant = constant * changing &
      & * (system%least_steps / max(survey%phase_advance, real(system%least_steps, dp)))**3
    ! The estimate of the error is four times the error, and half the tolerance is aimed at; rounding sets a floor.
    allowed = max(tolerance, 4 * epsilon(1.0_dp) * survey%phase_advance) / 8
    last = 1.1_dp * predicted(method%order, constant, system, survey, allowed)
    steps = whole_steps(method, system, coarse) + whole_steps(method, system, 2 * coarse) &
      & + whole_steps(method, system, max(2.5_dp * coarse, last))
  end function steps_in_all

  !> No fewer steps, a whole number of times those that are done at once.
  pure real(dp) function whole_steps(method, system, steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: steps

    ! Not by ceiling: the number may be beyond the range of integers.
    associate (at_once => method%steps_at_once(system%states, has_positions(system)))
      whole_steps = aint(steps / at_once)
      if (whole_steps < steps / at_once) whole_steps = whole_steps + 1
      whole_steps = at_once * whole_steps
    end associate
  end function whole_steps

end module gestell_floquet_choice_prediction
