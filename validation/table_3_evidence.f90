!> How much the twelve values of Table 3 say about the data that the paper does not give, and about the program
!> that computed them.
module table_3_evidence
  use original_mechanism, only: dp, four_bar, crank_speed
  use original_program, only: program_options, as_printed, initial_state
  use printed_tables, only: speed_rpm, table_3, six_decimals
  implicit none (type, external)
  private

  public :: reproduced, range_alone, range_together, distributions

contains

  !> How many of the twelve printed values come out digit for digit.
  integer function reproduced(machine, options) result(hits)
    type(four_bar), intent(in) :: machine
    type(program_options), intent(in) :: options

    hits = matches(both_states(machine, options))
  end function reproduced

  !> The deviations from the nominal data along `direction` = (l1 in m, k in N/m) within which all twelve values
  !> come out, as factors of the direction: bisection on either side.
  function range_alone(direction) result(ends)
    real(dp), intent(in) :: direction(2)
    real(dp) :: ends(2)

    real(dp) :: inside, outside, middle
    integer :: i, side

    do side = 1, 2
      inside = 0.0_dp
      outside = merge(-1.0_dp, 1.0_dp, side == 1)
      do i = 1, 12
        middle = (inside + outside) / 2
        if (reproduced(deviating(middle * direction), as_printed) == 12) then
          inside = middle
        else
          outside = middle
        end if
      end do
      ends(side) = inside
    end do
  end function range_alone

  !> The extent in l1 and k of all pairs that give all twelve values, as deviations from the nominal data within
  !> +-`box`: first row l1, second row k; low > high where no pair does. The states are taken as linear in the
  !> deviations: the neglected part is below 0.02 units of the last printed digit for boxes up to 20e-6 m, 5 N/m.
  function range_together(options, box, points) result(extent)
    type(program_options), intent(in) :: options
    real(dp), intent(in) :: box(2)
    integer, intent(in) :: points
    real(dp) :: extent(2, 2)

    real(dp) :: center(12), per_box(12, 2), at(2)
    integer :: i, j

    center = both_states(four_bar(), options)
    per_box(:, 1) = (both_states(deviating([box(1), 0.0_dp]), options) &
        & - both_states(deviating([-box(1), 0.0_dp]), options)) / 2
    per_box(:, 2) = (both_states(deviating([0.0_dp, box(2)]), options) &
        & - both_states(deviating([0.0_dp, -box(2)]), options)) / 2

    extent(:, 1) = huge(1.0_dp)
    extent(:, 2) = -huge(1.0_dp)
    do j = -points, points
      do i = -points, points
        at = [real(dp) :: i, j] / points
        if (.not. rounds_to_printed(center + matmul(per_box, at))) cycle
        extent(:, 1) = min(extent(:, 1), at * box)
        extent(:, 2) = max(extent(:, 2), at * box)
      end do
    end do
  end function range_together

  !> All distributions of weights from `values` over the six excitation terms that give all twelve printed values,
  !> one per column. The states are linear in the weights: seven runs serve them all.
  function distributions(printed_order, values) result(found)
    logical, intent(in) :: printed_order
    real(dp), intent(in) :: values(:)
    real(dp), allocatable :: found(:, :)

    type(program_options) :: options
    real(dp) :: without(12), per_weight(12, 6), weights(6), states(12)
    integer :: i, code

    options = program_options(printed_order=printed_order, weights=0.0_dp)
    without = both_states(four_bar(), options)
    do i = 1, 6
      options%weights = 0.0_dp
      options%weights(i) = 1.0_dp
      per_weight(:, i) = both_states(four_bar(), options) - without
    end do

    allocate (found(6, 0))
    do code = 0, size(values)**6 - 1
      weights = values(1 + mod(code / size(values)**[0, 1, 2, 3, 4, 5], size(values)))
      states = without + matmul(per_weight, weights)
      if (rounds_to_printed(states)) found = reshape([found, weights], [6, size(found, 2) + 1])
    end do
  end function distributions

  !> The paper's machine with l1 and k changed by deviation = (m, N/m).
  pure function deviating(deviation) result(machine)
    real(dp), intent(in) :: deviation(2)
    type(four_bar) :: machine

    machine%ground_link = machine%ground_link + deviation(1)
    machine%stiffness = machine%stiffness + deviation(2)
  end function deviating

  !> Initial states at both speeds, one after the other.
  function both_states(machine, options) result(states)
    type(four_bar), intent(in) :: machine
    type(program_options), intent(in) :: options
    real(dp) :: states(12)

    states(1:6) = initial_state(machine, crank_speed(speed_rpm(1)), options)
    states(7:12) = initial_state(machine, crank_speed(speed_rpm(2)), options)
  end function both_states

  pure integer function matches(states)
    real(dp), intent(in) :: states(12)

    matches = count(six_decimals(states) == reshape(table_3, [12]))
  end function matches

  !> The same test as twelve matches, with the printing of digits only where the first value fits.
  pure logical function rounds_to_printed(states)
    real(dp), intent(in) :: states(12)

    rounds_to_printed = .false.
    if (six_decimals(states(12)) == table_3(6, 2)) rounds_to_printed = matches(states) == 12
  end function rounds_to_printed

end module table_3_evidence
