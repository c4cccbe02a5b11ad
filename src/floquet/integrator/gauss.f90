!> Gauss-Legendre collocation with s stages. The method has order 2 s. It is symmetric, stable for every step length, and
!> symplectic for undamped systems. Methods with six stages or more are fitted to the fastest motion
!> (gestell_floquet_integrator_pace).
module gestell_floquet_integrator_gauss
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: lanes
  use gestell_floquet_integrator_gauss_steps, only: fits_lanes, gauss_steps
  use gestell_floquet_integrator_method, only: evaluation_work, method_type, unresolved_type
  use gestell_floquet_integrator_nested, only: nested_tableau, nested_type
  use gestell_floquet_integrator_tableau, only: gauss_tableau, tableau_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: gauss

  !> Minimum number of stages for embedded methods. With fewer stages the order of the embedded methods is too low for an error
  !> estimate.
  integer, parameter :: min_to_embed = 6
  !> Maximum phase advance (radians) of the fastest motion in a step of `pair`, for even and odd numbers of stages. In longer steps,
  !> matrices of the embedded methods can become singular during elimination, and rows must be exchanged. This begins at 6 radians
  !> with even and at 11 radians with odd numbers of stages.
  real(dp), parameter :: longest_even = 5.5_dp, longest_odd = 10

  type, extends(method_type), public :: gauss_method
    private
    !> If true, fit the method to the fastest motion, provided that it has six stages or more
    logical, public :: fitted = .true.
    !> Coefficients of the method without embedded methods; allocated by `prepare`
    type(tableau_type), allocatable :: tableau
    !> Coefficients of the method with its embedded methods; allocated by `prepare`
    type(nested_type), allocatable :: nested
  contains
    procedure :: prepare, phases, steps_at_once, maps, pair, work
  end type gauss_method

contains

  !> Returns the method with the given number of stages, 2 to 10; its name is gauss2 to gauss10.
  pure type(gauss_method) function gauss(stages) result(method)
    integer, intent(in) :: stages
    character(len=2), parameter :: numbers(*) = [character(len=2) :: "1", "2", "3", "4", "5", "6", "7", "8", "9", "10"]

    method%name = "gauss" // trim(numbers(stages))
    method%order = 2 * stages
    method%stages = stages
    method%error_constant = constant(stages)
    if (stages < min_to_embed) return
    method%lower_order = 2 * stages - 2
    method%lower_constant = constant(stages - 1)
    method%longest_turn = merge(longest_odd, longest_even, modulo(stages, 2) == 1)

  contains

    !> Error constant (s!)^2 / ((2 s)! (2 s + 1)!) of the method with s stages. It is the leading coefficient of the difference
    !> between exp and its Pade approximation.
    pure real(dp) function constant(s)
      integer, intent(in) :: s
      integer :: k

      constant = 1
      do k = 1, s
        constant = constant / (4 * (4 * k**2 - 1))
      end do
    end function constant

  end function gauss

  !> Computes the tableaus.
  pure subroutine prepare(self)
    class(gauss_method), intent(inout) :: self

    self%tableau = gauss_tableau(self%stages)
    if (self%lower_order > 0) self%nested = nested_tableau(self%tableau)
  end subroutine prepare

  !> Phases of the nodes of all steps, sorted by stage: first node 1 of every step, then node 2 of every step, and so on.
  pure function phases(self, from, to)
    class(gauss_method), intent(in) :: self
    real(dp), intent(in) :: from(:), to(:)
    real(dp), allocatable :: phases(:)

    phases = phases_at(self%tableau%c, from, to)
  end function phases

  !> Phases at the relative positions `c` in all steps, sorted by position: first `c(1)` in every step, then `c(2)` in every step,
  !> and so on.
  pure function phases_at(c, from, to) result(phases)
    real(dp), intent(in) :: c(:), from(:), to(:)
    real(dp) :: phases(size(c) * size(from))
    integer :: i

    do i = 1, size(c)
      phases(size(from) * (i - 1) + 1:size(from) * i) = from + c(i) * (to - from)
    end do
  end function phases_at

  !> Computing time of a step, in the units of `step_work` in gestell_floquet_integrator_method.
  pure real(dp) function work(self, states, second_order)
    class(gauss_method), intent(in) :: self
    integer, intent(in) :: states
    logical, intent(in) :: second_order
    real(dp) :: operations, unknowns, at_node

    at_node = merge(states / 2, states, second_order)
    unknowns = self%stages * at_node
    operations = unknowns**2 * (2 * unknowns / 3.0_dp + 2 * states + 1)
    if (fits_lanes(self%stages, states, second_order)) then
      work = 130 + 2.7_dp * states**2 + self%stages * (0.7_dp * evaluation_work(second_order) + 3.2_dp * at_node**2) &
        & + 0.18_dp * unknowns**2 + 0.014_dp * operations
    else
      work = self%stages * (evaluation_work(second_order) + 80 + 8 * states**2) + 0.2_dp * operations
    end if
  end function work

  !> Number of steps that are computed together: `lanes` if the equations of a step are small enough to be solved in one lane of
  !> the vector registers; otherwise 1.
  pure integer function steps_at_once(self, states, second_order)
    class(gauss_method), intent(in) :: self
    integer, intent(in) :: states
    logical, intent(in) :: second_order

    steps_at_once = merge(lanes, 1, fits_lanes(self%stages, states, second_order))
  end function steps_at_once

  !> Computes the maps of the steps. For the arguments see `step_maps` in gestell_floquet_integrator_method.
  subroutine maps(self, system, from, to, map, error)
    class(gauss_method), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: from(:), to(:)
    real(dp), contiguous, intent(out) :: map(:, :, :)
    type(error_type), allocatable, intent(out) :: error

    type(tableau_type) :: tableau

    tableau = self%tableau
    call gauss_steps(tableau, self%fitted, system, self%phases(from, to), (to - from) * system%period, map, error)
  end subroutine maps

  !> Computes the maps of the steps by the method and by its two embedded methods. For the arguments see `pair` in
  !> gestell_floquet_integrator_method.
  subroutine pair(self, system, from, to, map, error, lower, unresolved)
    class(gauss_method), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: from(:), to(:)
    real(dp), contiguous, intent(out) :: map(:, :, :), lower(:, :, :, :)
    type(error_type), allocatable, intent(out) :: error
    type(unresolved_type), intent(inout) :: unresolved

    type(nested_type) :: nested

    nested = self%nested
    call gauss_steps(nested, self%fitted, system, phases_at(nested%c, from, to), (to - from) * system%period, map, error, lower, &
      & unresolved)
  end subroutine pair

end module gestell_floquet_integrator_gauss
