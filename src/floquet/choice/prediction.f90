!> How many steps a method will take, before one is taken.
module gestell_floquet_choice_prediction
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_integrator_methods, only: pair_begun
  use gestell_floquet_integrator_nested, only: fall_over, left_by_embedded
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: has_positions
  implicit none (type, external)
  private

  public :: fewest, first_steps, growth, steps_in_all, whole_steps

  !> The powers of k that the harmonics of coefficients, 1, and of loads, 2, are taken to have beside exp(-k width): places have
  !> branch points (a dyad stretched at complex angles: a root, k^-3/2), loads have their second derivatives, in harmonics this low
  !> nearly 1 rather than 1/2.
  real(dp), parameter :: growth(2) = [-1.5_dp, 1.0_dp]

  !> What is known of a system before it is solved.
  type, public :: outlook_type
    !> How far the fastest motion turns within the period, w_max T in radians: at most |P| T / sqrt 2, as w comes with -w.
    real(dp) :: phase_advance = 0
    !> (|P^16| / sqrt 2)^(1/16) T where P is greatest, in which of several fast motions little but the fastest counts.
    real(dp) :: fastest = 0
    !> How far beside the real axis the coefficients, 1, and the loads, 2, are analytic, in radians of the turn: their k-th harmonic
    !> is at most height k^growth exp(-k width). Width zero: not known.
    real(dp) :: width(2) = 0, height(2) = 1
    !> The part of the fastest motion in Phi(T), what its decay leaves of it.
    real(dp) :: fade = 1
    !> The part of the coefficients that changes.
    real(dp) :: changing = 1
  end type outlook_type

contains

  !> With how many steps a method with others embedded in it should come to the tolerance, by an error that is told with care: that
  !> of Gauss' method itself, not fitted, and as much of the change by the first embedded one as counts; and the second embedded one
  !> has begun to converge, or that change is all that is wanted.
  !> What nodes miss of coefficients that change and of loads is told by the roots of the last terms of series, so it falls by three
  !> orders less than what quadrature leaves, and of loads grows with the order: `of_changes`, the powers of it, of the width and of
  !> the order are fitted to 30000 solutions of 548 random machines. With less a second number of steps was needed more often, with
  !> more the first one was too great; of `change`, from 100 to 300 times what is allowed, both came to the same work.
  pure real(dp) function first_steps(method, system, outlook, tolerance) result(steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    class(outlook_type), intent(in) :: outlook
    real(dp), intent(in) :: tolerance
    real(dp), parameter :: left = 4, change = 240, of_changes = 0.15_dp
    real(dp) :: allowed, rounding, lower, width(2), gain(2)
    integer :: i

    ! Roundings are told too, and blur what is told of the rest.
    rounding = epsilon(1.0_dp) * (2 * outlook%phase_advance + 4 * outlook%fastest)
    allowed = max(tolerance - 4 * rounding, tolerance / 4, 4 * epsilon(1.0_dp) * outlook%fastest) / 8
    lower = left_by_embedded(has_positions(system)) * method%lower_constant
    width = [(width_of(system, outlook, i), i = 1, 2)]
    gain = of_changes * outlook%height / allowed * [outlook%changing * max(outlook%fastest, 1.0_dp), &
      & method%order**2 / width(2)**1.5_dp * (1 + outlook%phase_advance / 8)]
    steps = max(fewest(method, system), outlook%fastest / method%longest_turn, &
      & predicted(method%order, method%error_constant, system, outlook, left * allowed), &
      & following(method%lower_order, lower, outlook, change * allowed), &
      & min(following(method%lower_order - 2, fall_over(method%stages - 1) * lower, outlook, pair_begun), &
      &   following(method%lower_order, lower, outlook, 2 * allowed)), &
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
  pure real(dp) function width_of(system, outlook, which) result(width)
    class(periodic_system), intent(in) :: system
    class(outlook_type), intent(in) :: outlook
    integer, intent(in) :: which

    width = max(outlook%width(which), 7.0_dp / system%least_steps)
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
  pure real(dp) function following(order, constant, outlook, error) result(steps)
    integer, intent(in) :: order
    real(dp), intent(in) :: constant, error
    class(outlook_type), intent(in) :: outlook

    steps = 0.98_dp * outlook%fastest * (constant * outlook%fade * max(outlook%fastest, 1.0_dp) / error)**(1.0_dp / order)
  end function following

  !> Steps that leave such an error: the fastest motion counts 0.925 of `fastest` and what is left of it, and the coefficients turn
  !> too: of their k-th harmonic, exp(-k width), a method of order p leaves most where k is p / width.
  pure real(dp) function predicted(order, constant, system, outlook, error) result(steps)
    integer, intent(in) :: order
    real(dp), intent(in) :: constant, error
    class(periodic_system), intent(in) :: system
    class(outlook_type), intent(in) :: outlook
    real(dp) :: harmonic

    harmonic = 1.4_dp * order / width_of(system, outlook, 1) * outlook%changing**(1.0_dp / order)
    steps = hypot(0.925_dp * outlook%fastest, harmonic) &
      & * (constant * outlook%fade * max(outlook%fastest, 1.0_dp) / error)**(1.0_dp / order)
  end function predicted

  !> Steps of all solutions that lead to the tolerance: a coarse one, one with twice as many, and the last, for which the method's
  !> error is known.
  pure real(dp) function steps_in_all(method, system, outlook, tolerance, changing) result(steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    class(outlook_type), intent(in) :: outlook
    real(dp), intent(in) :: tolerance, changing
    real(dp) :: coarse, last, constant, allowed

    coarse = max(real(system%least_steps, dp), 1.5_dp * outlook%phase_advance / method%order)
    constant = method%error_constant
    if (method%exact_if_constant) constant = constant * changing &
      & * (system%least_steps / max(outlook%phase_advance, real(system%least_steps, dp)))**3
    ! The estimate of the error is four times the error, and half the tolerance is aimed at; rounding sets a floor.
    allowed = max(tolerance, 4 * epsilon(1.0_dp) * outlook%phase_advance) / 8
    last = 1.1_dp * predicted(method%order, constant, system, outlook, allowed)
    steps = whole_steps(method, system, coarse) + whole_steps(method, system, 2 * coarse) &
      & + whole_steps(method, system, max(2.5_dp * coarse, last))
  end function steps_in_all

  !> No fewer steps, a whole number of times those that are done at once.
  pure real(dp) function whole_steps(method, system, steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: steps

    associate (at_once => method%steps_at_once(system%states, has_positions(system)))
      whole_steps = at_once * whole(steps / at_once)
    end associate
  end function whole_steps

  !> The least whole number that is not below `x`, which may be beyond the range of integers.
  pure real(dp) function whole(x)
    real(dp), intent(in) :: x

    whole = aint(x)
    if (whole < x) whole = whole + 1
  end function whole

end module gestell_floquet_choice_prediction
