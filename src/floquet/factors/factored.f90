!> Multipliers and periodic motion from the factors of a monodromy matrix.
module gestell_floquet_factors_factored
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_factors_cycle, only: accumulate, distance_from_one, frames_type, periodic_answer, solve_frames
  use gestell_floquet_factors, only: factors_type
  use gestell_floquet_period_period_map, only: trajectory
  use gestell_floquet_multipliers, only: arrange, multiplier, multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, resonance
  use gestell_floquet_period_turn_errors, only: compare, comparison_type, relative_rounding, take_differences, turn_errors_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: factored_errors, factored_multipliers, factored_periodic, follow_factored

contains

  !> All multipliers; with `vectors` the eigenvectors too. Error: no convergence.
  subroutine factored_multipliers(factors, vectors, multipliers, error)
    type(factors_type), intent(in) :: factors
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    type(frames_type) :: frames
    logical, allocatable :: paired(:)
    integer :: n, k, partner

    call solve_frames(factors, frames, error)
    if (allocated(error)) return
    n = size(factors%scale)
    allocate(paired(n), source=.false.)
    multipliers%exponent = frames%z
    multipliers%error = frames%bound
    multipliers%condition = frames%condition
    if (vectors) multipliers%vectors = frames%x(:, :, 1) * spread(factors%scale, 2, n)
    do k = 1, n
      if (paired(k)) cycle
      partner = partner_of(frames, paired, k)
      paired([k, partner]) = .true.
      associate (z => multipliers%exponent(k))
        if (partner == k) then
          z = cmplx(real(z), pi * anint(aimag(z) / pi), dp)
        else
          multipliers%exponent(partner) = conjg(z)
          if (vectors) multipliers%vectors(:, partner) = conjg(multipliers%vectors(:, k))
        end if
      end associate
    end do
    multipliers%log_abs = real(multipliers%exponent)
    multipliers%arg = aimag(multipliers%exponent)
    multipliers%rho = multiplier(multipliers%exponent)
    multipliers%exponent = multipliers%exponent / factors%period
    call arrange(multipliers)
  end subroutine factored_multipliers

  !> Of those that have no partner yet the multiplier that is nearest to the conjugate of the k-th: k itself for a real one.
  pure integer function partner_of(frames, paired, k) result(partner)
    type(frames_type), intent(in) :: frames
    logical, intent(in) :: paired(:)
    integer, intent(in) :: k
    complex(dp) :: difference(size(frames%z))

    difference = frames%z - conjg(frames%z(k))
    difference = cmplx(real(difference), aimag(difference) - 2 * pi * anint(aimag(difference) / (2 * pi)), dp)
    partner = minloc(abs(difference), dim=1, mask=.not. paired)
  end function partner_of

  !> x(0) of the periodic motion. Error: resonance within the errors.
  subroutine factored_periodic(factors, solution, error)
    type(factors_type), intent(in) :: factors
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    type(frames_type) :: frames
    real(dp), allocatable :: x(:, :), doubt(:), at_starts(:, :)
    integer :: n, count, k, next

    call periodic_states(factors, frames, x, error)
    if (allocated(error)) return
    n = size(x, 1)
    count = size(x, 2)
    allocate(doubt(count))
    do k = 1, count
      next = modulo(k, count) + 1
      doubt(k) = factors%error(k) * norm2(x(:, k)) + factors%b_error(k) &
        & + n * epsilon(1.0_dp) * (norm2(x(:, next)) + norm2(factors%a(:, :, k)) * norm2(x(:, k)))
    end do
    call accumulate(factors, frames, doubt, at_starts)
    solution%x0 = x(:, 1) * factors%scale
    solution%error = at_starts(:, 1) * factors%scale
    solution%condition = maxval(frames%condition / frames%distance)
  end subroutine factored_periodic

  !> The frames, and the periodic motion at the starts of the segments, shape (n, K), in balanced units. Error: resonance within
  !> the errors.
  subroutine periodic_states(factors, frames, x, error)
    type(factors_type), intent(in) :: factors
    type(frames_type), intent(out) :: frames
    real(dp), allocatable, intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    call solve_frames(factors, frames, error)
    if (allocated(error)) return
    frames%distance = [(distance_from_one(frames, i), i = 1, size(factors%scale))]
    if (any(frames%distance <= 0)) then
      call fatal_error(error, resonance, failed_computation)
      return
    end if
    call periodic_answer(frames, factors%b, x)
  end subroutine periodic_states

  !> The periodic motion at `phases` (ascending, in [0, 1]), shape (n, points): anew from its own start in each segment.
  subroutine follow_factored(system, factors, phases, x, error)
    class(periodic_system), intent(in) :: system
    type(factors_type), intent(in) :: factors
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(frames_type) :: frames
    real(dp), allocatable :: starts(:, :)
    integer :: k, first, last, begin, finish

    call periodic_states(factors, frames, starts, error)
    if (allocated(error)) return
    last = 0
    begin = 1
    do k = 1, size(starts, 2)
      first = last + 1
      do while (last < size(phases))
        if (phases(last + 1) >= factors%ends(k + 1) .and. k < size(starts, 2)) exit
        last = last + 1
      end do
      finish = begin
      do while (factors%nodes(finish) < factors%ends(k + 1))
        finish = finish + 1
      end do
      call trajectory(system, factors%method, factors%nodes(begin:finish), starts(:, k) * factors%scale, phases(first:last), &
        & x(:, first:last), error)
      if (allocated(error)) return
      begin = finish
    end do
  end subroutine follow_factored

  !> The errors of the motion `x` that `follow_factored` found at `phases`, shape (n, phases), the first 0 and the last 1.
  !> `disturbance`: what is unknown of the load, integrated over the period. Errors: overflow; resonance within the errors.
  subroutine factored_errors(system, factors, phases, x, errors, error, disturbance)
    class(periodic_system), intent(in) :: system
    type(factors_type), intent(in) :: factors
    real(dp), intent(in) :: phases(:), x(:, :)
    type(turn_errors_type), intent(out) :: errors
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: disturbance
    type(frames_type) :: frames
    type(comparison_type) :: comparison, turn
    real(dp), allocatable :: starts(:, :), z(:, :), own(:), at_starts(:, :)
    integer :: count

    call periodic_states(factors, frames, starts, error)
    if (allocated(error)) return
    count = size(starts, 2)
    associate (scale => spread(factors%scale, 2, count))
      call compare(system, factors%method, factors%nodes, factors%scale, factors%ends, starts * scale, phases, x, comparison, error)
      if (.not. allocated(error)) call compare(system, factors%method, factors%nodes, factors%scale, factors%ends, &
        & starts * scale, factors%ends(:1), x(:, :1), turn, error)
      if (allocated(error)) return
      call periodic_answer(frames, turn%defect / scale, z)
      z = z * scale
    end associate
    own = (relative_rounding(system, comparison%steps, factors%turns) + system%load_rounding) * comparison%size / count
    if (present(disturbance)) own = own + disturbance / minval(factors%scale) / count
    call accumulate(factors, frames, own, at_starts)
    ! The motion is followed from each start.
    call take_differences(comparison, factors%scale, z, z, at_starts, own, errors)
  end subroutine factored_errors

end module gestell_floquet_factors_factored
