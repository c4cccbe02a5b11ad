!> Chooses for a given system the integration method that should need the least work.
module gestell_floquet_choice_cheapest
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: balancing
  use gestell_floquet_choice_prediction, only: first_steps, steps_in_all
  use gestell_floquet_choice_survey, only: survey_type
  use gestell_floquet_integrator_gauss, only: gauss
  use gestell_floquet_integrator_method, only: method_type, name_length
  use gestell_floquet_choice_methods, only: find_method, method_names, stages_of
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: has_positions
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: cheapest_method

  !> Work of a step that includes the embedded methods, relative to the same step without them.
  real(dp), parameter :: pair_work = 1.15_dp

contains

  !> Chooses the integration method that reaches `tolerance` with the least predicted work. The work is predicted from three
  !> properties of each method (order, error constant, work per step) and from the estimates in `survey`.
  subroutine cheapest_method(system, survey, tolerance, method)
    class(periodic_system), intent(in) :: system
    !> Estimates of the phase advance and the variation of the coefficients, from `survey_system`
    type(survey_type), intent(in) :: survey
    !> Allowed error of the map over the period, relative to its norm
    real(dp), intent(in) :: tolerance
    class(method_type), allocatable, intent(out) :: method
    class(method_type), allocatable :: candidate
    type(error_type), allocatable :: error
    character(len=name_length), allocatable :: names(:)
    real(dp) :: part, min_work
    logical :: second_order
    integer :: i, best

    ! Evaluate how much P changes only if all methods work with P. For second-order systems collocation solves half as many
    ! equations.
    second_order = has_positions(system)
    part = 1
    if (.not. second_order) part = changing_part(system)

    min_work = huge(min_work)
    best = 1
    allocate(names, source=method_names())
    do i = 2, size(names)
      if (names(i)(:5) == "gauss") then
        ! Most candidates are Gauss methods: they are made on the stack.
        call consider(gauss(stages_of(names(i))))
      else
        call find_method(names(i), candidate, error)
        call consider(candidate)
      end if
    end do
    call find_method(names(best), method, error)
    call method%prepare()

  contains

    !> If method `one` is predicted to need less work than all candidates before it, stores its index `i` in `best` and its work
    !> in `min_work`.
    subroutine consider(one)
      class(method_type), intent(in) :: one
      real(dp) :: work

      if (one%lower_order > 0) then
        work = pair_work * first_steps(one, system, survey, tolerance)
      else
        work = steps_in_all(one, system, survey, tolerance, part)
      end if
      work = work * one%work(system%states, second_order)
      if (work >= min_work) return
      min_work = work
      best = i
    end subroutine consider

  end subroutine cheapest_method

  !> Variation of the state matrix P over the period: maximum over the phases of |P - mean| / |mean|, in balanced units; at most 1.
  real(dp) function changing_part(system) result(part)
    class(periodic_system), intent(in) :: system
    integer, parameter :: points = 8
    real(dp) :: p(system%states, system%states, points), mean(system%states, system%states), units(system%states)
    real(dp) :: constant, changing
    integer :: n, k

    n = system%states
    call system%sample([((k - 0.5_dp) / points, k = 1, points)], p)
    part = 1
    if (.not. all(ieee_is_finite(p))) return
    units = balancing(maxval(abs(p), dim=3))
    p = p * spread(spread(units, 1, n) / spread(units, 2, n), 3, points)
    mean = sum(p, dim=3) / points
    constant = norm2(mean)
    changing = maxval([(norm2(p(:, :, k) - mean), k = 1, points)])
    if (changing < constant) part = changing / constant
  end function changing_part

end module gestell_floquet_choice_cheapest
