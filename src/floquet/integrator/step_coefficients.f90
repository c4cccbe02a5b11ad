!> Samples the coefficients at the nodes of many collocation steps, arranges them for eight steps side by side, and estimates how
!> they vary between the nodes.
module gestell_floquet_integrator_step_coefficients
  use gestell_math_lanes, only: block, lanes, padded_to_block
  use gestell_floquet_integrator_method, only: unresolved_type
  use gestell_floquet_integrator_nested, only: nested_type
  use gestell_floquet_integrator_tableau, only: tableau_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: sample_in_units, second_order_system
  use, intrinsic :: iso_c_binding, only: c_bool, c_int, dp => c_double
  implicit none (type, external)
  private

  public :: layout_of, estimate_unresolved, sample_coefficients, scale_coefficients

  !> Maximum number of rows (unknowns and states) of a step that is computed in lanes (eight steps side by side). It suffices for
  !> ten stages and six degrees of freedom
  integer, parameter, public :: max_rows = 72

  !> Coefficients at the nodes of all steps: M, B, C, shape (points, f, f), and g, shape (points, f). All points of one stage are
  !> adjacent: node i of eight successive steps fills the eight lanes. M and C are allocated only for systems with positions.
  type, public :: coefficients_type
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
    real(dp), allocatable :: g(:, :)
    !> Lengths of the steps, in the unit of time
    real(dp), allocatable :: lengths(:)
    !> `f`: number of unknowns at a node. `positions`: number of positions. `states`: number of states.
    integer :: f = 0, positions = 0, states = 0
  end type coefficients_type

  !> Arrangement of the unknowns and the states in the equations of a step. All arrays have fixed sizes, so that eight steps need no
  !> memory from the heap.
  type, bind(C), public :: layout_type
    !> Sizes of the equations of a step; numbers of rows are multiples of `block`. `s`: number of stages. `f`: number of unknowns at
    !> a node. `n`: number of rows for the unknowns of all nodes, with padding. `rows`: `n` plus the rows of the states. `columns`:
    !> `n` plus the columns of the states and of the loads.
    integer(c_int) :: s = 0, f = 0, n = 0, rows = 0, columns = 0
    !> `place(i)`: number of rows before the first unknown of node i. `place(s + 1)`: number of rows for the unknowns of all nodes.
    integer(c_int) :: place(max_rows + 1) = 0
    !> `node`: node to which each column of unknowns belongs. `component`: index of the unknown at this node. Both are 0 in padding;
    !> shape (n).
    integer(c_int) :: node(max_rows) = 0, component(max_rows) = 0
    !> True if the method has embedded methods (a nested tableau)
    logical(c_bool) :: nested = .false.
    !> Only for a nested tableau. `values`: factors that convert the unknowns to the accelerations at the last two nodes. `sums`:
    !> factors with which the last two equations are added to each equation.
    real(dp) :: values(2, max_rows) = 0, sums(max_rows, 2) = 0
  end type layout_type

contains

  !> Samples the coefficients, and the loads if `forced`, at all nodes. Stores them in `at` for states measured in `units`.
  subroutine sample_coefficients(system, phases, forced, at, units)
    class(periodic_system), intent(in) :: system
    !> Nodes of all steps, as phases
    real(dp), contiguous, intent(in) :: phases(:)
    !> If true, sample the loads in addition to M, B and C
    logical, intent(in) :: forced
    type(coefficients_type), intent(out) :: at
    !> Units of the states in which `at` holds the coefficients, shape (states)
    real(dp), contiguous, intent(out) :: units(:)
    real(dp), allocatable :: p(:, :, :), f(:, :)
    integer :: i, j, points

    points = size(phases)
    at%states = system%states
    select type (system)
    class is (second_order_system)
      at%f = system%states / 2
      at%positions = at%f
      allocate(at%m(points, at%f, at%f), at%b(points, at%f, at%f), at%c(points, at%f, at%f))
      ! An unallocated variable counts as an absent argument.
      if (forced) allocate(at%g(points, at%f))
      call sample_in_units(system, phases, at%m, at%b, at%c, units(:at%f), at%g)
      units(at%f + 1:) = units(:at%f)
    class default
      at%f = system%states
      allocate(at%b(points, at%f, at%f), p(at%f, at%f, points))
      if (forced) allocate(f(at%f, points))
      call system%sample(phases, p, f)
      if (forced) at%g = transpose(f)
      do j = 1, at%f
        do i = 1, at%f
          at%b(:, i, j) = -p(i, j, :)
        end do
      end do
      units = 1
    end select
  end subroutine sample_coefficients

  !> Adds the estimated effects of variations of coefficients and loads between the nodes to `unresolved`.
  !>
  !> In a step of length h the phase of the fastest motion advances by z = |h^2 C|^1/2 + |h B| radians. Changes of M, h B and h^2
  !> C shift this phase by z |change of M| + |change of h B| + |change of h^2 C| / z radians. If interpolation between the nodes
  !> misses a fraction e of a variation, quadrature misses only the fraction e^2. In the units used, masses are about 1, so the
  !> integral of a load over time is a change of velocity.
  pure subroutine estimate_unresolved(nested, at, units, unresolved)
    type(nested_type), intent(in) :: nested
    type(coefficients_type), intent(in) :: at
    !> Units of the last f states (the velocities, if there are positions), shape (f)
    real(dp), intent(in) :: units(:)
    !> Effects of variations of the coefficients and loads between the nodes, summed over the steps; this call adds the effects
    !> in its own steps
    type(unresolved_type), intent(inout) :: unresolved
    ! For each step: part missed by interpolation, variation within the step, size
    real(dp), dimension(size(at%lengths), 3) :: of_m, of_b, of_c, of_g
    real(dp), dimension(size(at%lengths), 2) :: all
    real(dp), dimension(size(at%lengths)) :: h, z
    integer :: f, i

    f = at%f
    h = at%lengths
    of_m = 0
    of_c = 0
    of_b = interpolation_errors(nested, size(h), f**2, at%b)
    if (at%positions > 0) of_m = interpolation_errors(nested, size(h), f**2, at%m)
    if (at%positions > 0) of_c = interpolation_errors(nested, size(h), f**2, at%c)
    z = max(h * (sqrt(of_c(:, 3)) + of_b(:, 3)), tiny(z))
    do i = 1, 2
      all(:, i) = z * of_m(:, i) + h * of_b(:, i) + h**2 / z * of_c(:, i)
    end do
    unresolved%turns = unresolved%turns + sum(z)
    unresolved%coefficients = unresolved%coefficients + sum(all(:, 1)**2 / max(all(:, 1), all(:, 2), tiny(z)))
    if (.not. allocated(at%g)) return
    of_g = interpolation_errors(nested, size(h), f, at%g)
    unresolved%loads = unresolved%loads + sum(h * of_g(:, 1)**2 / max(of_g(:, 1), of_g(:, 2), tiny(z)))
    unresolved%load = unresolved%load + sum(h * of_g(:, 3))
    unresolved%missed = unresolved%missed + sum(h * of_g(:, 1))
    if (.not. allocated(unresolved%velocity_errors)) allocate(unresolved%velocity_errors(f), source=0.0_dp)
    do i = 1, f
      of_g = interpolation_errors(nested, size(h), 1, at%g(:, i))
      unresolved%velocity_errors(i) = unresolved%velocity_errors(i) + units(i) * sum(h * of_g(:, 1)**2 / max(of_g(:, 1), of_g(:, &
        & 2), tiny(z)))
    end do
  end subroutine estimate_unresolved

  !> Estimates three quantities for each step, shape (steps, 3), from `values` at the nodes, shape (steps, s, count):
  !> - (1) the component that interpolation misses: the rms along the Legendre polynomial P_s, extrapolated from the decay of the
  !>   components along P_s-4 to P_s-1, minus the rounding error;
  !> - (2) the variation within the step: difference between the values at the first and the last stored node, which are an end
  !>   node and a middle node;
  !> - (3) the size of the values.
  !>
  !> For (1) all `count` functions are added up with quasi-random weights, so that they do not cancel each other. For (2) and (3)
  !> their magnitudes are added up.
  pure function interpolation_errors(nested, steps, count, values)
    type(nested_type), intent(in) :: nested
    integer, intent(in) :: steps, count
    real(dp), intent(in) :: values(steps, size(nested%c), count)
    real(dp), parameter :: golden = 0.6180339887498949_dp
    real(dp) :: interpolation_errors(steps, 3), together(steps, size(nested%c)), tail(steps, 4)
    integer :: s, i, k

    s = size(nested%c)
    together = 0
    interpolation_errors = 0
    do k = 1, count
      together = together + (1 + modulo(golden * k, 1.0_dp)) * values(:, :, k)
      interpolation_errors(:, 2) = interpolation_errors(:, 2) + abs(values(:, 1, k) - values(:, s, k))
      interpolation_errors(:, 3) = interpolation_errors(:, 3) + max(abs(values(:, 1, k)), abs(values(:, s, k)))
    end do
    tail = 0
    do i = 1, s
      do k = 1, steps
        tail(k, 1) = tail(k, 1) + nested%tails(i, 1) * together(k, i)
        tail(k, 2) = tail(k, 2) + nested%tails(i, 2) * together(k, i)
        tail(k, 3) = tail(k, 3) + nested%tails(i, 3) * together(k, i)
        tail(k, 4) = tail(k, 4) + nested%tails(i, 4) * together(k, i)
      end do
    end do
    tail(:, 4) = max(abs(tail(:, 3)), abs(tail(:, 4)))
    tail(:, 2) = max(abs(tail(:, 1)), abs(tail(:, 2)), tiny(tail))
    interpolation_errors(:, 1) = max(tail(:, 4) * sqrt(min(tail(:, 4) / tail(:, 2), 1.0_dp)) - 8 * epsilon(1.0_dp) &
      & * interpolation_errors(:, 3), 0.0_dp)
  end function interpolation_errors

  !> Arranges the unknowns and states in the rows of the equations, for steps with this tableau. In a nested tableau, the
  !> unknowns of each of the last two nodes begin in a new block of `block` rows.
  pure subroutine layout_of(tableau, at, layout)
    class(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    type(layout_type), intent(out) :: layout
    integer :: s, i, k

    s = size(tableau%c)
    layout%s = s
    layout%f = at%f
    layout%place(:s + 1) = [(at%f * (i - 1), i = 1, s), padded_to_block(s * at%f)]
    select type (tableau)
    class is (nested_type)
      layout%nested = .true.
      layout%values(:, :s) = tableau%values
      layout%sums(:s, :) = tableau%sums
      layout%place(s - 1:s + 1) = padded_to_block((s - 2) * at%f) + [0, 1, 2] * padded_to_block(at%f)
    end select
    layout%n = layout%place(s + 1)
    layout%rows = layout%n + padded_to_block(at%states)
    ! A single column beyond a multiple of three is eliminated alone.
    i = at%states + merge(1, 0, allocated(at%g))
    layout%columns = layout%n + merge(i, padded_to_block(i), modulo(i, block) == 1)
    do i = 1, s
      do k = 1, at%f
        layout%node(layout%place(i) + k) = i
        layout%component(layout%place(i) + k) = k
      end do
    end do
  end subroutine layout_of

  !> Computes M, h B and h^2 C of the eight steps that begin with step `step`, in the rows of their nodes. For systems without
  !> positions M is the unit matrix and C is zero.
  pure subroutine scale_coefficients(at, step, layout, mass, damping, stiffness)
    !> Coefficients at the nodes of all steps
    type(coefficients_type), intent(in) :: at
    !> Number of the first of the eight steps
    integer, intent(in) :: step
    type(layout_type), intent(in) :: layout
    !> M, h B and h^2 C; the procedure leaves rows that belong to no node unchanged
    real(dp), dimension(lanes, layout%n, layout%f), intent(inout) :: mass, damping, stiffness
    real(dp) :: h(lanes)
    integer :: points, row, lane, i, r, c

    h = at%lengths(step:step + lanes - 1)
    do i = 1, layout%s
      points = size(at%lengths) * (i - 1) + step - 1
      do c = 1, at%f
        do r = 1, at%f
          row = layout%place(i) + r
          if (at%positions > 0) then
            !GCC$ unroll 1
            do lane = 1, lanes
              mass(lane, row, c) = at%m(points + lane, r, c)
              damping(lane, row, c) = h(lane) * at%b(points + lane, r, c)
              stiffness(lane, row, c) = h(lane)**2 * at%c(points + lane, r, c)
            end do
          else
            mass(:, row, c) = merge(1, 0, r == c)
            damping(:, row, c) = h * at%b(points + 1:points + lanes, r, c)
            stiffness(:, row, c) = 0
          end if
        end do
      end do
    end do
  end subroutine scale_coefficients

end module gestell_floquet_integrator_step_coefficients
