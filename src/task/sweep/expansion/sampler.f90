!> Represents the motion over a period by numbers that depend smoothly on the parameters (see `parts_type`). These numbers are
!> computed with the same method for all members of a family.
module gestell_task_sweep_expansion_sampler
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_math_series_fourier, only: transform_matrix
  use gestell_math_matrix, only: balanced
  use gestell_floquet_choice_prediction, only: fewest
  use gestell_floquet_period_period_map, only: motions
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_choice_survey, only: survey_system, survey_phases, survey_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet
  use gestell_model_frame, only: frame_type
  use gestell_system_family, only: family_type, create_member
  use gestell_study_mechanism_cache, only: swap_mechanisms, cache_mechanism
  use gestell_study_vibration, only: solve_vibration, vibration_type
  use gestell_system_periodic, only: periodic_system
  use gestell_task_sweep_expansion_parts, only: parts_type
  implicit none (type, external)
  private

  public :: new_sampler

  !> Integrates the members of a family with the same method. The number of steps is proportional to the phase advance of the
  !> fastest motion. Where the number of steps is constant, the integration errors depend smoothly on the parameters. Where this
  !> number changes, the errors jump by at most a sixteenth of the largest integration error.
  type, public :: sampler_type
    class(family_type), pointer :: family => null()
    class(method_type), allocatable :: method
    !> Numbers of steps that may be used, ascending. The last number is sufficient for a member whose fastest motion has the phase
    !> advance `fastest`.
    integer, allocatable :: steps(:)
    !> `fastest`: phase advance of the fastest motion at any corner of the cell. `fewest`: smallest number of nodes that a corner
    !> needs.
    real(dp) :: fastest = 0, fewest = huge(1.0_dp)
    !> Structure of the list of numbers that represent the motion over a period.
    type(parts_type) :: parts
    !> Units of the states in which their magnitudes are balanced, shape (number of states).
    real(dp), allocatable :: scale(:)
    !> Bound on the relative error, due to integration and rounding, of the numbers that represent the motion. It is the largest
    !> of the errors that were determined at the corners of the cell.
    real(dp) :: error = 0
    !> Number of solutions that have been computed.
    integer :: solutions = 0
    !> Number of times within a period at which the periodic vibration is evaluated; 0 if the vibration is not requested.
    integer :: times = 0
    !> Matrix that transforms the values at the times within a period to harmonics.
    real(dp), allocatable :: transform(:, :)
    !> Unit of x_p(T), the motion forced from rest.
    real(dp) :: unit = 1
    !> True if the machines at all corners of the cell are undamped (`conserves` in gestell_system_periodic).
    logical :: conserves = .true.
    !> Degree of freedom (1: xi, 2: eta, 3: psi, ...) to which each position belongs.
    integer, allocatable :: free(:)
    !> A machine that stores the functions of its mechanism, so that they are computed only once. Allocated only if all members of
    !> the family have the same mechanism.
    type(frame_type), allocatable :: remembered
  contains
    procedure :: sample, check
  end type sampler_type

  !> Maximum phase advance (rad) of the vibrations over the period. Above it expansions need too many points, and order reduction is
  !> faster.
  real(dp), parameter :: max_turns = 700
  !> Rounding error of a series for numbers of magnitude 1.
  real(dp), parameter :: rounded = 16 * epsilon(1.0_dp)
  !> Maximum number of sampling times within a period; if the vibration needs more, expansions are not worthwhile.
  integer, parameter :: most_times = 256
  !> Maximum number of parts into which a period is divided.
  integer, parameter :: most_parts = 16
  !> `least_terms`: number of terms of a series in which no phase changes. `solution`: cost of a solution. `composition`: cost of
  !> composing the parts. Both costs are relative to the cost of one term of a part at a point.
  real(dp), parameter :: least_terms = 17, solution = 20000, composition = 6

contains

  !> Sets up a sampler that is accurate at all corners of a cell. The corner that needs most steps determines the number of steps.
  subroutine new_sampler(sampler, family, corners, accuracy, forced, points, fits)
    type(sampler_type), intent(out) :: sampler
    !> Family of machines that depend on the parameters of the sweep
    class(family_type), intent(in), target :: family
    !> Values of the parameters at the corners, shape (parameters, corners)
    real(dp), intent(in) :: corners(:, :)
    !> Accuracy requested for the sweep
    type(accuracy_type), intent(in) :: accuracy
    !> True if the periodic vibration is requested too
    logical, intent(in) :: forced
    !> Number of points in the cell
    integer, intent(in) :: points
    !> False if no expansion is possible over the cell
    logical, intent(out) :: fits
    class(periodic_system), allocatable :: system
    type(survey_type) :: survey
    type(monodromy_type) :: monodromy
    type(error_type), allocatable :: error
    type(accuracy_type) :: sharper
    real(dp) :: turns(size(corners, 2)), nodes, most
    integer :: i, k

    fits = .false.
    most = -1
    sampler%family => family
    ! The integration may use an eighth of the tolerance, because most of the tolerance is left for the expansion. If the periodic
    ! vibration is requested, the integration may use a 64th. The reason: errors grow near a resonance, and each point with too
    ! large an error is solved separately, which takes a hundred times as long.
    sharper = accuracy
    sharper%tolerance = max(accuracy%tolerance / merge(64, 8, forced), 10 * epsilon(1.0_dp))
    do k = 1, size(corners, 2)
      call create_member(family, corners(:, k), system, error)
      if (allocated(error)) return
      call survey_system(system, survey, error)
      if (allocated(error)) return
      turns(k) = survey%phase_advance
      if (turns(k) > max_turns) return
      if (k == 1) sampler%scale = survey%scale
      if (system%states /= size(sampler%scale)) return
      sampler%conserves = sampler%conserves .and. system%conserves([(i, i = 1, system%states / 2)])
      call solve_monodromy(system, sharper, forced, monodromy, error)
      sampler%solutions = sampler%solutions + 1
      if (allocated(error)) return
      sampler%error = max(sampler%error, monodromy%error / monodromy%norm)
      if (forced) then
        ! A very small Phi(T) is lost in the rounding errors of Phi(t), which is E at the beginning of the period.
        if (accuracy%tolerance * monodromy%norm < rounded) return
        call look_at_vibration(sampler, system, accuracy, fits)
        if (.not. fits) return
        fits = .false.
        sampler%unit = merge(norm2(monodromy%xp / sampler%scale), max(sampler%unit, norm2(monodromy%xp / sampler%scale)), k == 1)
      end if
      nodes = real(monodromy%steps, dp) * monodromy%method%stages
      sampler%fewest = min(sampler%fewest, nodes)
      sampler%fastest = max(sampler%fastest, survey%fastest)
      if (nodes <= most) cycle
      most = nodes
      if (allocated(sampler%method)) deallocate(sampler%method)
      allocate(sampler%method, source=monodromy%method)
    end do
    if (forced .and. .not. (sampler%unit > 0 .and. sampler%times <= most_times)) return
    sampler%transform = transform_matrix(sampler%times)
    associate (parts => sampler%parts)
      parts%states = size(sampler%scale)
      parts%forced = sampler%times > 0
      ! If there are breaks, the steps between them have different lengths, so the period is not divided into parts.
      if (.not. allocated(system%breaks)) parts%parts = cheapest_parts((maxval(turns) - minval(turns)) / 2, points, sampler%times)
      parts%between = max(sampler%times, parts%parts) / parts%parts - 1
    end associate
    call choose_steps(sampler, most)
    if (family%shares_mechanism()) call remember(sampler, system)
    call weigh(sampler, corners, fits)
  end subroutine new_sampler

  !> Stores the functions of the mechanism if `system` is a planar frame.
  subroutine remember(sampler, system)
    type(sampler_type), intent(inout) :: sampler
    class(periodic_system), intent(in) :: system
    integer :: k

    select type (system)
    type is (frame_type)
      if (system%dofs() > 3) return
      sampler%remembered = system
      call sampler%remembered%remember(survey_phases)
      do k = 1, size(sampler%steps)
        call cache_mechanism(sampler%remembered, sampler%method, mesh(system, sampler%steps(k)))
      end do
    end select
  end subroutine remember

  !> Chooses the permitted numbers of steps in the period. Every end of a part and every required time must coincide with the end
  !> of a step. All permitted numbers but the largest nearly fill the vector lanes, and each of these exceeds the next smaller one
  !> by at least 10 %. The largest number yields at least `most` nodes, as many as the most demanding corner needs.
  pure subroutine choose_steps(sampler, most)
    type(sampler_type), intent(inout) :: sampler
    real(dp), intent(in) :: most
    integer :: equal, last, k, steps

    equal = sampler%parts%parts * (sampler%parts%between + 1)
    last = equal * ceiling(most / (sampler%method%stages * equal))
    allocate(sampler%steps(0))
    do k = 1, last / lanes
      steps = equal * (k * lanes / equal)
      if (steps < reserve(sampler) * sampler%fewest / sampler%method%stages .or. steps >= last) cycle
      if (10 * steps >= 11 * maxval([sampler%steps, 0])) sampler%steps = [sampler%steps, steps]
    end do
    sampler%steps = [sampler%steps, last]
  end subroutine choose_steps

  !> Factor on the number of steps by which the error falls to a sixteenth. Interpolation on two axes may amplify an error that is
  !> not smooth by about 16: the Lebesgue constant is 4 for a hundred points on one axis.
  pure real(dp) function reserve(self)
    class(sampler_type), intent(in) :: self

    reserve = 16**(1.0_dp / self%method%order)
  end function reserve

  !> Number of steps that is sufficient for the coefficients of `system` and for its fastest motion.
  pure integer function enough(self, fastest, system)
    class(sampler_type), intent(in) :: self
    real(dp), intent(in) :: fastest
    class(periodic_system), intent(in) :: system
    integer :: k

    do k = 1, size(self%steps) - 1
      if (self%steps(k) < fewest(self%method, system)) cycle
      if (self%steps(k) * self%fastest >= reserve(self) * self%steps(size(self%steps)) * fastest) exit
    end do
    enough = self%steps(k)
  end function enough

  !> Number of parts of the period for which the cost of computing `points` points is lowest. It must divide `times`. Along an
  !> axis the phase of the fastest vibration at the end of the period changes by +-`half_turn`. The series of a function cos(z + x
  !> h) needs slightly more than h terms (Bessel functions J_k(h)).
  pure integer function cheapest_parts(half_turn, points, times) result(cheapest)
    real(dp), intent(in) :: half_turn
    integer, intent(in) :: points, times
    real(dp) :: terms, cost, least
    integer :: parts

    cheapest = 1
    least = huge(least)
    do parts = 1, most_parts
      if (mod(times, parts) /= 0) cycle
      terms = least_terms + half_turn / parts
      cost = solution * min(terms**2, real(points, dp)) + points * parts * (terms + composition)
      if (cost >= least) cycle
      least = cost
      cheapest = parts
    end do
  end function cheapest_parts

  !> Computes the weights of the parts so that they represent the propagation of errors at the corners of the cell.
  subroutine weigh(sampler, corners, fits)
    type(sampler_type), intent(inout) :: sampler
    real(dp), intent(in) :: corners(:, :)
    logical, intent(out) :: fits
    real(dp) :: values(sampler%parts%numbers(), size(corners, 2))
    integer :: k

    allocate(sampler%parts%of_map(sampler%parts%parts), sampler%parts%of_times(sampler%parts%parts), source=1.0_dp)
    do k = 1, size(corners, 2)
      call sampler%sample(corners(:, k), values(:, k), fits)
      if (.not. fits) return
    end do
    call sampler%parts%set_weights(values)
  end subroutine weigh

  !> Determines the number of times within a period at which the vibration of a frame must be computed. Sets `fits` to false if
  !> `system` is not a frame.
  subroutine look_at_vibration(sampler, system, accuracy, fits)
    type(sampler_type), intent(inout) :: sampler
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(out) :: fits
    !> Harmonics that are smaller than this fraction of the largest amplitude do not affect the peak.
    real(dp), parameter :: small = 1.0e-9_dp
    type(floquet_type) :: floquet
    type(vibration_type) :: vibration
    type(error_type), allocatable :: error
    integer :: i, order

    fits = .false.
    select type (system)
    class is (frame_type)
      call solve_floquet(system, accuracy, .true., floquet, error)
      if (.not. allocated(error)) call solve_vibration(system, floquet, 64, 20, vibration, error)
      sampler%solutions = sampler%solutions + 1
      if (allocated(error)) return
      sampler%free = system%free
      do i = 1, size(system%free)
        associate (amplitude => vibration%series(system%free(i))%amplitude)
          order = findloc(amplitude > min(small, accuracy%tolerance) * maxval(amplitude), .true., dim=1, back=.true.)
        end associate
        ! Adds two orders, and rounds up to a multiple of eight.
        sampler%times = max(sampler%times, 8 * ((2 * (order + 2)) / 8 + 1))
      end do
      fits = .true.
    end select
  end subroutine look_at_vibration

  !> Computes the weighted numbers that represent the motion of the machine with the given parameters. Sets `fits` to false if the
  !> machine has no solution.
  subroutine sample(self, parameters, values, fits)
    class(sampler_type), intent(inout) :: self
    real(dp), intent(in) :: parameters(:)
    real(dp), intent(out) :: values(:)
    logical, intent(out) :: fits
    class(periodic_system), allocatable :: system
    type(survey_type) :: survey
    type(error_type), allocatable :: error
    real(dp) :: maps(size(self%scale), self%parts%columns(), self%parts%parts * (self%parts%between + 1))

    fits = .false.
    values = 0
    call create_member(self%family, parameters, system, error)
    if (allocated(error)) return
    if (system%states /= size(self%scale)) return
    if (fewest(self%method, system) > maxval(self%steps)) return
    if (allocated(system%breaks) .and. size(maps, 3) > 1) return
    self%solutions = self%solutions + 1
    call exchange(self, system)
    if (size(self%steps) > 1) call survey_system(system, survey, error)
    if (.not. allocated(error)) call motions(system, self%method, mesh(system, enough(self, survey%fastest, system)), &
      & self%parts%parts, maps, error)
    call exchange(self, system)
    fits = .not. allocated(error)
    if (fits) values = self%parts%weighted(numbers_of(self, maps))
  end subroutine sample

  !> Exchanges the mechanism of a member with the mechanism whose functions are stored. A second call reverses the exchange.
  subroutine exchange(self, system)
    class(sampler_type), intent(inout) :: self
    class(periodic_system), intent(inout) :: system

    if (.not. allocated(self%remembered)) return
    select type (system)
    type is (frame_type)
      call swap_mechanisms(system, self%remembered)
    end select
  end subroutine exchange

  !> Computes the monodromy matrix Phi(T), and the motion x_p(T) forced from rest, by a separate solution. Also computes a bound
  !> on their errors relative to their norms.
  subroutine check(self, parameters, accuracy, values, bound, fits)
    class(sampler_type), intent(inout) :: self
    !> Parameters of the machine
    real(dp), intent(in) :: parameters(:)
    !> Accuracy requested for the sweep
    type(accuracy_type), intent(in) :: accuracy
    !> `values`: Phi(T), column by column, and x_p(T), in balanced units but without weights. `bound`: bound on their relative
    !> error
    real(dp), intent(out) :: values(:), bound
    !> False if the machine has no solution
    logical, intent(out) :: fits
    class(periodic_system), allocatable :: system
    type(monodromy_type) :: monodromy
    type(error_type), allocatable :: error
    integer :: n

    fits = .false.
    values = 0
    bound = 0
    call create_member(self%family, parameters, system, error)
    if (.not. allocated(error)) call solve_monodromy(system, accuracy, self%parts%forced, monodromy, error)
    self%solutions = self%solutions + 1
    if (allocated(error)) return
    n = size(self%scale)
    if (size(monodromy%phi, 1) /= n) return
    values(:n**2) = reshape(balanced(monodromy%phi, self%scale), [n**2])
    bound = monodromy%error / monodromy%norm
    if (self%parts%forced) values(n**2 + 1:) = monodromy%xp / (self%scale * self%unit)
    fits = .true.
  end subroutine check

  !> The numbers that represent the motion, without weights. They are computed from `maps`, shape (states, columns, parts *
  !> (between + 1)). Each map leads from the beginning of a part of the period to a time within this part or at its end.
  pure function numbers_of(self, maps) result(values)
    class(sampler_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: maps(:, :, :)
    real(dp) :: values(self%parts%numbers()), unit(size(maps, 1), size(maps, 2))
    integer :: n, k, i, at, time

    n = size(maps, 1)
    ! In balanced units the map is D^-1 A D, and its constant term is D^-1 b / unit.
    unit = spread(1 / self%scale, 2, size(maps, 2))
    unit(:, :n) = unit(:, :n) * spread(self%scale, 1, n)
    unit(:, n + 1:) = unit(:, n + 1:) / self%unit
    associate (parts => self%parts)
      do k = 1, parts%parts
        at = parts%map_at(k)
        values(at:at + size(unit) - 1) = reshape(transpose(unit * maps(:, :, k * (parts%between + 1))), [size(unit)])
        do i = 1, parts%between
          at = parts%times_at(k, i)
          time = (k - 1) * (parts%between + 1) + i
          values(at:at + n / 2 * size(unit, 2) - 1) = reshape(transpose(unit(:n / 2, :) * maps(:n / 2, :, time)), &
            & [n / 2 * size(unit, 2)])
        end do
      end do
    end associate
  end function numbers_of

end module gestell_task_sweep_expansion_sampler
