!> The motion over a period as numbers that depend smoothly on the parameters: Phi(T), and where the periodic vibration is
!> asked for x_p(T), and Phi(t) and x_p(t) of the positions at equidistant times. All are in balanced units; x_p in a unit of
!> its own, and the numbers at the times between are divided by the root of how many they are, so that norms compare.
module gestell_task_sweep_expansion_sampler
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_period_map, only: motions, period_map
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_period_survey, only: survey
  use gestell_floquet_solution, only: floquet_type, solve_floquet
  use gestell_model_frame, only: frame_type
  use gestell_study_family, only: family_type, take_member
  use gestell_study_vibration, only: solve_vibration, vibration_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: new_sampler

  !> Integrates every member of a family in the same way: only then the errors of integration are smooth too.
  type, public :: sampler_type
    class(method_type), allocatable :: method
    integer :: steps = 0, states = 0
    !> Units that balance the states, shape (n).
    real(dp), allocatable :: scale(:)
    !> Bound on the relative error of the numbers by integration and rounding, where it was measured.
    real(dp) :: error = 0
    !> Solutions computed so far.
    integer :: solutions = 0
    !> Times within a period at which the periodic vibration is wanted; zero: it is not. Unit of x_p.
    integer :: times = 0
    real(dp) :: unit = 1
    !> Which of xi, eta, psi the positions are.
    integer, allocatable :: free(:)
  contains
    procedure :: numbers
    procedure :: numbers_of_period
    procedure :: sample
    procedure :: check
  end type sampler_type

  !> Where vibrations turn by more radians than this within the period, expansions need too many points, and reduction is
  !> the better way.
  real(dp), parameter :: most_turns = 700
  !> Roundings in the series of numbers of size 1.
  real(dp), parameter :: rounded = 16 * epsilon(1.0_dp)
  !> Times within a period for which expansions pay.
  integer, parameter :: most_times = 256

contains

  !> A sampler that is accurate at the parameters `corners`, shape (parameters, corners): with the steps of the most
  !> demanding of them. `forced`: with the periodic vibration. `fits` is false where there is none.
  subroutine new_sampler(sampler, family, corners, accuracy, forced, fits)
    type(sampler_type), intent(out) :: sampler
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: corners(:, :)
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(in) :: forced
    logical, intent(out) :: fits
    class(periodic_system), allocatable :: system
    type(monodromy_type) :: monodromy
    type(error_type), allocatable :: error
    real(dp), allocatable :: scale(:)
    real(dp) :: turns, work, most
    integer :: k

    fits = .false.
    most = -1
    do k = 1, size(corners, 2)
      call take_member(family, corners(:, k), system, error)
      if (allocated(error)) return
      call survey(system, scale, turns, error)
      if (allocated(error)) return
      if (turns > most_turns .or. (k > 1 .and. system%states /= sampler%states)) return
      call solve_monodromy(system, sharper(accuracy), forced, monodromy, error)
      sampler%solutions = sampler%solutions + 1
      if (allocated(error)) return
      sampler%states = system%states
      sampler%error = max(sampler%error, monodromy%error / monodromy%norm)
      if (k == 1) sampler%scale = scale
      if (forced) then
        ! Phi(T) is lost in the roundings of Phi(t), which begins with E.
        if (accuracy%tolerance * monodromy%norm < rounded) return
        call look_at_vibration(sampler, system, accuracy, fits)
        if (.not. fits) return
        fits = .false.
        sampler%unit = merge(norm2(monodromy%xp / sampler%scale), max(sampler%unit, norm2(monodromy%xp / sampler%scale)), k == 1)
      end if
      work = real(monodromy%steps, dp) * monodromy%method%stages
      if (work <= most) cycle
      most = work
      sampler%steps = monodromy%steps
      if (allocated(sampler%method)) deallocate(sampler%method)
      allocate(sampler%method, source=monodromy%method)
    end do
    if (forced) then
      fits = sampler%unit > 0 .and. sampler%times <= most_times
      sampler%steps = sampler%times * ((sampler%steps - 1) / sampler%times + 1)
    else
      fits = .true.
    end if
  end subroutine new_sampler

  !> An eighth of the tolerance for the integration: most of it is left to the expansion.
  pure type(accuracy_type) function sharper(accuracy)
    type(accuracy_type), intent(in) :: accuracy

    sharper = accuracy
    sharper%tolerance = max(accuracy%tolerance / 8, 10 * epsilon(1.0_dp))
  end function sharper

  !> Counts the times at which a frame's vibration has to be known. `fits` is false for other systems.
  subroutine look_at_vibration(sampler, system, accuracy, fits)
    type(sampler_type), intent(inout) :: sampler
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    logical, intent(out) :: fits
    !> Part of the greatest amplitude below which a harmonic does not matter for the peak, at most.
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
        ! Two orders more, and a multiple of eight.
        sampler%times = max(sampler%times, 8 * ((2 * (order + 2)) / 8 + 1))
      end do
      fits = .true.
    end select
  end subroutine look_at_vibration

  !> How many numbers there are.
  pure integer function numbers(self)
    class(sampler_type), intent(in) :: self

    numbers = self%numbers_of_period()
    if (self%times > 0) numbers = numbers + (self%times - 1) * (self%states / 2) * (self%states + 1)
  end function numbers

  !> How many of them, the first ones, belong to the end of the period.
  pure integer function numbers_of_period(self) result(numbers)
    class(sampler_type), intent(in) :: self

    numbers = self%states**2
    if (self%times > 0) numbers = numbers + self%states
  end function numbers_of_period

  !> The numbers at these parameters, in balanced units. `fits` is false where there are none.
  subroutine sample(self, family, parameters, values, fits)
    class(sampler_type), intent(inout) :: self
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    real(dp), intent(out) :: values(:)
    logical, intent(out) :: fits
    class(periodic_system), allocatable :: system
    type(error_type), allocatable :: error
    real(dp) :: phi(self%states, self%states)
    real(dp), allocatable :: maps(:, :, :)

    fits = .false.
    values = 0
    call take_member(family, parameters, system, error)
    if (allocated(error)) return
    if (system%states /= self%states .or. system%least_steps > self%steps) return
    self%solutions = self%solutions + 1
    if (self%times == 0) then
      call period_map(system, self%method, mesh(system, self%steps), self%scale, phi, error)
      if (.not. allocated(error)) values = balanced_numbers(self, phi)
    else
      allocate(maps(self%states, self%states + 1, self%times))
      call motions(system, self%method, mesh(system, self%steps), maps, error)
      if (.not. allocated(error)) values = motion_numbers(self, maps)
    end if
    fits = .not. allocated(error)
  end subroutine sample

  !> The numbers of the period from a solution of their own, with a bound on its error relative to their norms.
  subroutine check(self, family, parameters, accuracy, values, bound, fits)
    class(sampler_type), intent(inout) :: self
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(out) :: values(:), bound
    logical, intent(out) :: fits
    class(periodic_system), allocatable :: system
    type(monodromy_type) :: monodromy
    type(error_type), allocatable :: error

    fits = .false.
    values = 0
    bound = 0
    call take_member(family, parameters, system, error)
    if (.not. allocated(error)) call solve_monodromy(system, accuracy, self%times > 0, monodromy, error)
    self%solutions = self%solutions + 1
    if (allocated(error)) return
    if (size(monodromy%phi, 1) /= self%states) return
    values(:self%states**2) = balanced_numbers(self, monodromy%phi)
    bound = monodromy%error / monodromy%norm
    if (self%times > 0) values(self%states**2 + 1:) = monodromy%xp / (self%scale * self%unit)
    fits = .true.
  end subroutine check

  pure function balanced_numbers(self, phi) result(values)
    class(sampler_type), intent(in) :: self
    real(dp), intent(in) :: phi(:, :)
    real(dp) :: values(size(phi))
    integer :: i, j

    values = [((phi(i, j) * (self%scale(j) / self%scale(i)), i = 1, self%states), j = 1, self%states)]
  end function balanced_numbers

  pure function motion_numbers(self, maps) result(values)
    class(sampler_type), intent(in) :: self
    real(dp), intent(in) :: maps(:, :, :)
    real(dp) :: values(numbers(self))
    real(dp) :: units(self%states + 1), between(self%states / 2, self%states + 1, self%times - 1)
    integer :: n, i, j

    n = self%states
    units = [1 / self%scale, self%unit]
    values(:n**2) = balanced_numbers(self, maps(:, :n, self%times))
    values(n**2 + 1:n**2 + n) = maps(:, n + 1, self%times) / (self%scale * self%unit)
    do j = 1, n + 1
      do i = 1, n / 2
        between(i, j, :) = maps(i, j, :self%times - 1) / (self%scale(i) * units(j) * sqrt(real(self%times, dp)))
      end do
    end do
    values(n**2 + n + 1:) = reshape(between, [size(between)])
  end function motion_numbers

end module gestell_task_sweep_expansion_sampler
