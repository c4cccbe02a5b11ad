!> The motion over a period as numbers that depend smoothly on the parameters: Phi(T), and x_p(T) where there is forcing.
module gestell_study_sampler
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_flow, only: period_map
  use gestell_floquet_mesh, only: mesh
  use gestell_floquet_method, only: method_type
  use gestell_floquet_monodromy, only: accuracy_type, monodromy_type, solve_monodromy, survey
  use gestell_study_family, only: family_type
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
  contains
    procedure :: numbers
    procedure :: sample
    procedure :: check
  end type sampler_type

  !> Where vibrations turn by more radians than this within the period, expansions need too many points, and reduction is
  !> the better way.
  real(dp), parameter :: most_turns = 700

contains

  !> A sampler that is accurate at the parameters `corners`, shape (parameters, corners): with the steps of the most
  !> demanding of them. `fits` is false where there is none.
  subroutine new_sampler(sampler, family, corners, accuracy, fits)
    type(sampler_type), intent(out) :: sampler
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: corners(:, :)
    type(accuracy_type), intent(in) :: accuracy
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
      call family%member(corners(:, k), system, error)
      if (allocated(error)) return
      call survey(system, scale, turns, error)
      if (allocated(error)) return
      if (turns > most_turns .or. (k > 1 .and. system%states /= sampler%states)) return
      call solve_monodromy(system, accuracy, .false., monodromy, error)
      sampler%solutions = sampler%solutions + 1
      if (allocated(error)) return
      sampler%states = system%states
      sampler%error = max(sampler%error, monodromy%error / monodromy%norm)
      if (k == 1) sampler%scale = scale
      work = real(monodromy%steps, dp) * monodromy%method%stages
      if (work <= most) cycle
      most = work
      sampler%steps = monodromy%steps
      if (allocated(sampler%method)) deallocate(sampler%method)
      allocate(sampler%method, source=monodromy%method)
    end do
    fits = .true.
  end subroutine new_sampler

  !> How many numbers there are.
  pure integer function numbers(self)
    class(sampler_type), intent(in) :: self

    numbers = self%states**2
  end function numbers

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

    fits = .false.
    values = 0
    call family%member(parameters, system, error)
    if (allocated(error)) return
    if (system%states /= self%states .or. system%least_steps > self%steps) return
    call period_map(system, self%method, mesh(system, self%steps), self%scale, phi, error)
    self%solutions = self%solutions + 1
    if (allocated(error)) return
    values = balanced_numbers(self, phi)
    fits = .true.
  end subroutine sample

  !> The same from a solution of its own with a bound on its error, relative to the numbers' norm.
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
    call family%member(parameters, system, error)
    if (.not. allocated(error)) call solve_monodromy(system, accuracy, .false., monodromy, error)
    self%solutions = self%solutions + 1
    if (allocated(error)) return
    if (size(monodromy%phi, 1) /= self%states) return
    values = balanced_numbers(self, monodromy%phi)
    bound = monodromy%error / monodromy%norm
    fits = .true.
  end subroutine check

  pure function balanced_numbers(self, phi) result(values)
    class(sampler_type), intent(in) :: self
    real(dp), intent(in) :: phi(:, :)
    real(dp) :: values(size(phi))
    integer :: i, j

    values = [((phi(i, j) * (self%scale(j) / self%scale(i)), i = 1, self%states), j = 1, self%states)]
  end function balanced_numbers

end module gestell_study_sampler
