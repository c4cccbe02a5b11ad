!> The methods by name.
module gestell_floquet_integrator_methods
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: balancing
  use gestell_floquet_integrator_cooper_verner, only: cooper_verner
  use gestell_floquet_integrator_gauss, only: gauss
  use gestell_floquet_integrator_magnus, only: magnus
  use gestell_floquet_integrator_method, only: method_type, name_length
  use gestell_floquet_integrator_runge_kutta, only: runge_kutta
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: cheapest_method, first_steps, method_names, new_method, whole_steps

  !> A method has begun to converge where a solution differs from a finer one by less than this.
  real(dp), parameter, public :: begun = 0.01_dp
  !> What a step with the embedded method takes over one without it.
  real(dp), parameter :: pair_work = 1.15_dp

contains

  !> All names that `new_method` knows.
  pure function method_names() result(names)
    character(len=name_length), allocatable :: names(:)

    names = [character(len=name_length) :: "auto", "rk4", "explicit8", "magnus4", "magnus6", "gauss2", "gauss3", "gauss4", &
      & "gauss5", "gauss6", "gauss7", "gauss8", "gauss9", "gauss10"]
  end function method_names

  !> The method of that name; `auto` is gauss6, a good one for most cases. Error: there is none of that name.
  subroutine new_method(name, method, error)
    character(len=*), intent(in) :: name
    class(method_type), allocatable, intent(out) :: method
    type(error_type), allocatable, intent(out) :: error

    call find(name, method, error)
    if (allocated(method)) call method%prepare()
  end subroutine new_method

  !> The method of that name, not prepared.
  subroutine find(name, method, error)
    character(len=*), intent(in) :: name
    class(method_type), allocatable, intent(out) :: method
    type(error_type), allocatable, intent(out) :: error

    select case (name)
    case ("auto")
      method = gauss(6)
    case ("rk4")
      method = runge_kutta()
    case ("explicit8")
      method = cooper_verner()
    case ("magnus4", "magnus6")
      method = magnus(iachar(name(7:7)) - iachar("0"))
    case ("gauss2", "gauss3", "gauss4", "gauss5", "gauss6", "gauss7", "gauss8", "gauss9", "gauss10")
      method = gauss(stages_of(name))
    case default
      call fatal_error(error, "unknown method '" // name // "'", invalid_input)
    end select
  end subroutine find

  !> The method that solves `system`, whose fastest motion turns by `phase_advance` radians within the period, to `tolerance` with
  !> the least work, by the orders, error constants and works that the methods tell of themselves.
  !> `fastest`: a sharper estimate of the angle.
  subroutine cheapest_method(system, phase_advance, tolerance, method, fastest)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: phase_advance, tolerance
    class(method_type), allocatable, intent(out) :: method
    real(dp), intent(in), optional :: fastest
    class(method_type), allocatable :: candidate
    type(error_type), allocatable :: error
    character(len=name_length), allocatable :: names(:)
    real(dp) :: part, least_work, sharper
    logical :: second_order
    integer :: i, best

    ! What changes of P is worth evaluating only where P itself is what all methods work with: for systems of second
    ! order collocation takes half the equations.
    second_order = .false.
    part = 1
    select type (system)
    class is (second_order_system)
      second_order = .true.
    class default
      part = changing_part(system)
    end select

    sharper = phase_advance
    if (present(fastest)) sharper = fastest
    least_work = huge(least_work)
    best = 1
    allocate(names, source=method_names())
    do i = 2, size(names)
      if (names(i)(:5) == "gauss") then
        ! Most are of this family: none of them is a piece of memory.
        call consider(gauss(stages_of(names(i))))
      else
        call find(trim(names(i)), candidate, error)
        call consider(candidate)
      end if
    end do
    call find(trim(names(best)), method, error)
    call method%prepare()

  contains

    !> Whether method `i` takes less work than the best before.
    subroutine consider(one)
      class(method_type), intent(in) :: one
      real(dp) :: work

      if (one%lower_order > 0) then
        work = pair_work * first_steps(one, system, sharper, tolerance)
      else
        work = steps_in_all(one, system, [phase_advance, sharper], tolerance, part, &
          & one%steps_at_once(system%states, second_order))
      end if
      work = work * one%work(system%states, second_order)
      if (work >= least_work) return
      least_work = work
      best = i
    end subroutine consider

  end subroutine cheapest_method

  !> Stages of a method of Gauss' by its name.
  pure integer function stages_of(name)
    character(len=*), intent(in) :: name

    stages_of = iachar(name(6:6)) - iachar("0")
    if (len_trim(name) > 6) stages_of = 10 * stages_of + iachar(name(7:7)) - iachar("0")
  end function stages_of

  !> With how many steps a method with others embedded in it should come to the tolerance, by an error that is told with care.
  !> Of the change by the one embedded a sixteenth counts for Phi(T) at least, and all for x_p(T), which changes less. What
  !> quadrature leaves of a load whose finest feature takes 1 / m of the period (m = `least_steps`) falls as (m / (5 N))**order.
  pure real(dp) function first_steps(method, system, fastest, tolerance) result(steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: fastest, tolerance
    real(dp), parameter :: load = 4000, change = 32
    real(dp) :: allowed

    allowed = max(tolerance, 4 * epsilon(1.0_dp) * fastest) / 8
    steps = max(predicted(method%order, method%error_constant, system, fastest, allowed), &
      & predicted(method%lower_order, method%lower_constant, system, fastest, change * allowed))
    steps = whole_steps(method, system, max(fewest(method, system), steps, &
      & system%least_steps / 5.0_dp * (load / allowed)**(1.0_dp / method%order)))
  end function first_steps

  !> The steps that see the finest feature of the coefficients as well as `least_steps` with six stages do.
  pure real(dp) function fewest(method, system)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system

    fewest = 6.0_dp * system%least_steps / method%stages
  end function fewest

  !> Steps that leave such an error: the fastest motion counts 0.925 of `fastest` (as of `survey`), and the coefficients turn
  !> too: those of their harmonics matter that are the order times as fine as the finest feature.
  pure real(dp) function predicted(order, constant, system, fastest, error) result(steps)
    integer, intent(in) :: order
    real(dp), intent(in) :: constant, fastest, error
    class(periodic_system), intent(in) :: system

    steps = hypot(0.925_dp * fastest, 0.1_dp * order * system%least_steps) &
      & * (constant * max(fastest, 1.0_dp) / error)**(1.0_dp / order)
  end function predicted

  !> No fewer steps, a whole number of times those that are done at once.
  pure real(dp) function whole_steps(method, system, steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: steps
    logical :: second_order

    second_order = .false.
    select type (system)
    class is (second_order_system)
      second_order = .true.
    end select
    associate (at_once => method%steps_at_once(system%states, second_order))
      whole_steps = at_once * whole(steps / at_once)
    end associate
  end function whole_steps

  !> Steps of all solutions that lead to the tolerance, each a whole number of times those that are done `at_once`: a coarse
  !> one, one with twice as many, and the last, for which the method's error is known. `advances`: the phase advance and `fastest`.
  pure real(dp) function steps_in_all(method, system, advances, tolerance, changing, at_once) result(steps)
    class(method_type), intent(in) :: method
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: at_once
    real(dp), intent(in) :: advances(2), tolerance, changing
    real(dp) :: coarse, last, constant, allowed

    coarse = max(real(system%least_steps, dp), 1.5_dp * advances(1) / method%order)
    constant = method%error_constant
    if (method%exact_if_constant) constant = constant * changing &
      & * (system%least_steps / max(advances(1), real(system%least_steps, dp)))**3
    ! The estimate of the error is four times the error, and half the tolerance is aimed at; rounding sets a floor.
    allowed = max(tolerance, 4 * epsilon(1.0_dp) * advances(1)) / 8
    last = 1.1_dp * predicted(method%order, constant, system, advances(2), allowed)
    steps = at_once * (whole(coarse / at_once) + whole(2 * coarse / at_once) + whole(max(2.5_dp * coarse, last) / at_once))
  end function steps_in_all

  !> The least whole number that is not below `x`, which may be beyond the range of integers.
  pure real(dp) function whole(x)
    real(dp), intent(in) :: x

    whole = aint(x)
    if (whole < x) whole = whole + 1
  end function whole

  !> The greatest part of P, in balanced units, that is not constant.
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

end module gestell_floquet_integrator_methods
