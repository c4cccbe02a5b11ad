!> Computes the sensitivity of peaks and rms values to the parameters of a machine: d ln(peak) / d ln(parameter). This is the
!> change in per cent for a change of the parameter by one per cent.
!>
!> The parameters of the family are relative changes, which are all zero for the unchanged machine. Let F(h) be the logarithm of a
!> peak or an rms value if one parameter has the relative change h. The error of the central difference (F(h) - F(-h)) / (2 h) is a
!> power series in h^2. Neville's table over h, h/2, h/4, ... extrapolates the differences to h = 0. The error of an entry of the
!> table is estimated as its difference from the neighbouring entries plus the rounding error divided by h. The latter is included
!> because small steps lose digits by cancellation. The result is the entry with the smallest estimated error (Ridders, Adv. Eng.
!> Software 4, 1982, 75).
module gestell_task_sensitivity
  use gestell_base_error, only: error_type, failed_computation, fatal_error, invalid_input
  use gestell_base_verdict, only: has_vibration, in_resonance, operator(==), state_word, verdict_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_periodic_solution, only: raise_resonance
  use gestell_system_family, only: family_type
  use gestell_study_vibration_small_motion, only: moved_type
  use gestell_study_speed_point, only: check_speed_options, solve_response, speed_options, speed_point_type
  use gestell_task_common_executor, only: executor_type, distribute_over, work_type
  use gestell_task_common_record, only: record_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: solve_base, solve_parameter, solve_sensitivity

  !> Number of derivatives for each quantity: one of its peak and one of its rms.
  integer, parameter, public :: changes = 2

  !> Results of the unchanged machine, with which those of changed machines are compared, and the steps of the differences.
  type, public :: sensitivity_base_type
    type(speed_options) :: options
    !> Number of parameters with respect to which results are differentiated.
    integer :: parameters = 0
    type(verdict_type) :: state
    !> Largest displacement and rotation of the frame. They show whether linearised equations are sufficient.
    type(moved_type) :: moved
    !> `values`: peaks and rms values, shape (changes, quantities). `relative_error`: relative errors of the peaks, shape
    !> (quantities).
    real(dp), allocatable :: values(:, :), relative_error(:)
    !> `step`: largest relative change of a parameter. `rounding`: rounding error of the logarithm of a peak or rms value.
    !> `enough`: a derivative is accurate enough if its error does not exceed `enough` times max(|derivative|, 1).
    real(dp) :: step = 0, rounding = 0, enough = 0
  end type sensitivity_base_type

  !> Derivatives of the results with respect to one parameter; arrays have the shape (changes, quantities).
  type, public :: sensitivity_type
    !> Derivative d ln(value) / d ln(parameter) and its estimated error. NaN if the derivative does not exist, for example because
    !> the value is zero.
    real(dp), allocatable :: slope(:, :), error(:, :)
    !> True if the value has a kink as a function of the parameter. The derivatives on the two sides then differ, and `slope` is
    !> their mean.
    logical, allocatable :: bend(:, :)
    !> True for a quantity whose peak does not exceed its error bound, shape (quantities). Nothing excites the quantity, so a
    !> relative change is not defined.
    logical, allocatable :: zero(:)
  contains
    procedure :: state
  end type sensitivity_type

  !> Parallel work: each piece computes the derivatives with respect to one parameter.
  type, extends(work_type) :: parameters_type
    class(family_type), pointer :: family => null()
    type(sensitivity_base_type) :: base
    type(sensitivity_type), allocatable :: derivatives(:)
  contains
    procedure :: compute, exchange
  end type parameters_type

  !> A derivative is undecided if its error exceeds this value times max(|derivative|, 1).
  real(dp), parameter :: max_error = 0.02_dp

  !> Minimum and maximum number of steps h, h/2, h/4, ... Steps are added until the derivatives are accurate enough.
  integer, parameter :: fewest_steps = 3, steps = 7
  !> `max_step`: largest relative change of a parameter. `part_of_distance`: the change of a parameter may move a multiplier by at
  !> most this fraction of the multiplier's distance from 1.
  real(dp), parameter :: max_step = 1.0e-2_dp, part_of_distance = 0.1_dp
  !> `sharp`: tolerance of the solutions, unless the user requests a smaller one. `least_rounding`: rounding error, with this
  !> tolerance and far from resonance, of the logarithm of a peak or rms value.
  real(dp), parameter :: sharp = 1.0e-12_dp, least_rounding = 1.0e-13_dp

contains

  !> State of the derivatives of quantity number `q`: 'ok', 'zero', 'undecided' or 'failed'.
  pure character(len=9) function state(self, q)
    class(sensitivity_type), intent(in) :: self
    integer, intent(in) :: q

    if (self%zero(q)) then
      state = "zero"
    else if (any(ieee_is_nan(self%slope(:, q)))) then
      state = "failed"
    else if (any(self%bend(:, q)) .or. any(self%error(:, q) > max_error * max(abs(self%slope(:, q)), 1.0_dp))) then
      state = "undecided"
    else
      state = "ok"
    end if
  end function state

  !> Computes the derivatives with respect to all parameters. Fails if the unchanged machine cannot be solved.
  subroutine solve_sensitivity(family, parameters, options, base, derivatives, error, executor)
    !> Family of machines that differ from the unchanged machine by relative changes of parameters
    class(family_type), intent(in), target :: family
    !> Number of parameters of the family
    integer, intent(in) :: parameters
    !> Quantities to differentiate, their probes, and the accuracy of the solutions
    type(speed_options), intent(in) :: options
    !> Results of the unchanged machine, with which those of changed machines are compared
    type(sensitivity_base_type), intent(out) :: base
    !> Derivatives with respect to each parameter, shape (parameters)
    type(sensitivity_type), allocatable, intent(out) :: derivatives(:)
    type(error_type), allocatable, intent(out) :: error
    !> Distributes the parameters over threads, which may request members of `family` at the same time
    class(executor_type), intent(inout), optional :: executor
    type(parameters_type) :: work

    call solve_base(family, parameters, options, base, error)
    if (allocated(error)) return
    work%family => family
    work%base = base
    allocate(work%derivatives(parameters))
    call distribute_over(work, parameters, error, executor)
    call move_alloc(work%derivatives, derivatives)
  end subroutine solve_sensitivity

  recursive subroutine compute(self, k, error)
    class(parameters_type), intent(inout) :: self
    integer, intent(in) :: k
    type(error_type), allocatable, intent(out) :: error

    call solve_parameter(self%family, self%base, k, self%derivatives(k), error)
  end subroutine compute

  subroutine exchange(self, k, record)
    class(parameters_type), intent(inout) :: self
    integer, intent(in) :: k
    type(record_type), intent(inout) :: record
    real(dp), allocatable :: bend(:, :), zero(:)

    associate (one => self%derivatives(k))
      call record%pass(one%slope)
      call record%pass(one%error)
      if (allocated(one%bend)) bend = merge(1.0_dp, 0.0_dp, one%bend)
      call record%pass(bend)
      one%bend = bend > 0
      if (allocated(one%zero)) zero = merge(1.0_dp, 0.0_dp, one%zero)
      call record%pass(zero)
      one%zero = zero > 0
    end associate
  end subroutine exchange

  !> Solves the unchanged machine and chooses the largest step. A relative change p of a parameter shifts the phase of a free
  !> vibration with N oscillations in the period by at most 2 pi N p. This shift must be small compared with the distance of the
  !> multiplier of the free vibration from 1. Fails if there are no parameters, if there is no periodic vibration, or if
  !> `solve_response` fails.
  subroutine solve_base(family, parameters, options, base, error)
    !> Family of machines that differ from the unchanged machine by relative changes of parameters
    class(family_type), intent(in) :: family
    !> Number of parameters of the family
    integer, intent(in) :: parameters
    !> Quantities to differentiate, their probes, and the accuracy of the solutions
    type(speed_options), intent(in) :: options
    !> Results of the unchanged machine, and the steps of the differences
    type(sensitivity_base_type), intent(out) :: base
    type(error_type), allocatable, intent(out) :: error
    type(speed_point_type) :: point
    real(dp) :: distance, swings
    integer :: q

    call check_speed_options(options, error)
    if (allocated(error)) return
    if (parameters < 1) then
      call fatal_error(error, "a sensitivity analysis needs one or more parameters", invalid_input)
      return
    end if
    base%options = options
    base%options%orders = 1
    base%enough = min(options%accuracy%tolerance, max_error)
    base%options%accuracy%tolerance = min(options%accuracy%tolerance, sharp)
    base%parameters = parameters
    call solve_response(family, [(0.0_dp, q = 1, parameters)], base%options, point, error)
    if (allocated(error)) return
    base%state = point%state
    base%moved = point%moved
    if (point%state == in_resonance) then
      call raise_resonance(error)
    else if (.not. has_vibration(point%state)) then
      call fatal_error(error, "the machine has no periodic vibration whose sensitivity could be computed; its state is '" &
        & // trim(state_word(point%state)) // "'", failed_computation)
    end if
    if (allocated(error)) return
    base%values = point%values([1, 3], :)
    base%relative_error = [(point%values(2, q) / max(point%values(1, q), tiny(1.0_dp)), q = 1, size(options%names))]
    distance = minval(abs(1 - exp(cmplx(max(point%growth, -700.0_dp), 2 * pi * point%turns, dp))))
    swings = max(1.0_dp, maxval(point%averaged_turns))
    base%rounding = least_rounding + 4 * epsilon(distance) / max(distance, epsilon(distance))
    base%step = min(max_step, part_of_distance * distance / (2 * pi * swings))
  end subroutine solve_base

  !> Computes the derivatives with respect to parameter number `number`. Fails if there is no such parameter, if `base` was not
  !> computed by `solve_base`, or if `solve_response` fails.
  subroutine solve_parameter(family, base, number, derivatives, error)
    !> Family of machines that differ from the unchanged machine by relative changes of parameters
    class(family_type), intent(in) :: family
    !> Results of the unchanged machine, computed by `solve_base`
    type(sensitivity_base_type), intent(in) :: base
    !> Number of the parameter with respect to which results are differentiated
    integer, intent(in) :: number
    type(sensitivity_type), intent(out) :: derivatives
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: above(:, :, :), below(:, :, :)
    real(dp) :: h(steps)
    integer :: k, q, change
    logical :: known, enough

    if (number < 1 .or. number > base%parameters .or. .not. allocated(base%values)) then
      call fatal_error(error, "the parameter was not passed to solve_base", invalid_input)
      return
    end if
    associate (n => size(base%options%names))
      allocate(derivatives%slope(changes, n), derivatives%error(changes, n), source=ieee_value(1.0_dp, ieee_quiet_nan))
      allocate(derivatives%bend(changes, n), source=.false.)
      allocate(above(changes, n, steps), below(changes, n, steps))
    end associate
    derivatives%zero = .not. (base%values(1, :) > 0 .and. base%relative_error < 1)
    h = [(base%step / 2**k, k = 0, steps - 1)]
    do k = 1, steps
      call logarithms(h(k), above(:, :, k), known)
      if (known) call logarithms(-h(k), below(:, :, k), known)
      if (allocated(error) .or. .not. known) return
      if (k < fewest_steps) cycle
      enough = .true.
      do q = 1, size(base%options%names)
        do change = 1, changes
          if (.not. (base%values(change, q) > 0 .and. base%relative_error(q) < 1)) cycle
          call differentiate(h(:k), above(change, q, :k), below(change, q, :k), log(base%values(change, q)), &
            & base%rounding, derivatives%slope(change, q), derivatives%error(change, q), derivatives%bend(change, q))
          enough = enough .and. derivatives%error(change, q) <= base%enough * max(abs(derivatives%slope(change, q)), 1.0_dp)
        end do
      end do
      if (enough) exit
    end do

  contains

    !> Computes the logarithms of peaks and rms values of the machine in which the parameter has the relative change `p`. `known` is
    !> false if this machine has no vibration.
    subroutine logarithms(p, values, known)
      real(dp), intent(in) :: p
      real(dp), intent(out) :: values(:, :)
      logical, intent(out) :: known
      type(speed_point_type) :: point
      real(dp) :: parameters(base%parameters)

      parameters = 0
      parameters(number) = p
      call solve_response(family, parameters, base%options, point, error)
      known = .false.
      if (allocated(error)) return
      known = has_vibration(point%state)
      values = 0
      if (known) values = log(max(point%values([1, 3], :), tiny(1.0_dp)))
    end subroutine logarithms

  end subroutine solve_parameter

  !> Computes the derivative of a function at 0 by extrapolation of central differences. `h`: steps, each half the previous one.
  !> `above`, `below`, `middle`: values of the function at h, -h and 0. `noise`: error of each value. `bend`: true if the function
  !> has a kink at 0.
  pure subroutine differentiate(h, above, below, middle, noise, slope, error, bend)
    real(dp), intent(in) :: h(:), above(:), below(:), middle, noise
    real(dp), intent(out) :: slope, error
    logical, intent(out) :: bend
    real(dp) :: table(size(h), size(h)), gap(size(h)), own
    integer :: i, k, n

    n = size(h)
    table = 0
    table(:, 1) = (above - below) / (2 * h)
    slope = table(n, 1)
    error = huge(1.0_dp)
    do i = 2, n
      do k = 2, i
        table(i, k) = table(i, k - 1) + (table(i, k - 1) - table(i - 1, k - 1)) / (4.0_dp**(k - 1) - 1)
        own = max(abs(table(i, k) - table(i, k - 1)), abs(table(i, k) - table(i - 1, k - 1))) + noise / h(i)
        if (own >= error) cycle
        error = own
        slope = table(i, k)
      end do
    end do
    ! Without a kink, the difference between the slopes on both sides is proportional to h.
    gap = abs(above - middle + (below - middle)) / h
    bend = gap(n) > 0.75_dp * gap(n - 2) .and. gap(n) / 2 > max_error * max(abs(slope), 1.0_dp)
    if (.not. bend) return
    slope = table(n, 1)
    error = max(abs(slope - table(n - 1, 1)), gap(n) / 2)
  end subroutine differentiate

end module gestell_task_sensitivity
