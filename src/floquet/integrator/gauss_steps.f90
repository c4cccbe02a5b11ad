!> Steps of Gauss-Legendre collocation, equation (58) of doc/theory.md. Each step is an affine map of the state.
!>
!> For M q'' + B q' + C q = g the positions are eliminated. Let (q, p) be positions and velocities at the start of a step of length
!> h, v_i the accelerations at the nodes c_i, and A, b the tableau:
!>
!>     q'_i = p + h sum_j A_ij v_j,   q_i = q + h c_i p + h^2 sum_j (A A)_ij v_j,
!>     M_i v_i + h B_i sum_j A_ij v_j + h^2 C_i sum_j (A A)_ij v_j = g_i - B_i p - C_i (q + h c_i p),            (a)
!>     q + h p + h^2 sum_j (b A)_j v_j,   p + h sum_j b_j v_j   at the end of the step.                          (b)
!>
!> This has half the unknowns of the first-order form, and M is never inverted. For x' = P x + f the same equations hold with M = E,
!> B = -P, g = f, p = x, without q and C. (a) and (b) together form one matrix,
!>
!>     [  K   R ]    rows: (a), with v on the left and q, p, 1 on the right,
!>     [ -G   S ]    rows: (b), in the same columns.
!>
!> Eliminating v replaces S by the map of the step, S + G K^-1 R. In each step time is measured in units of h. Then (a) and (b) hold
!> with h = 1 if B, C, g and the start are replaced by h B, h^2 C, h^2 g (h g without positions) and (q, h p).
!>
!> The embedded methods (gestell_floquet_integrator_nested) result from the same elimination, with other unknowns and combined
!> equations. Just before the unknowns of the last two nodes are eliminated, S holds the map of the second embedded method. Just
!> before those of the last node are eliminated, S holds the map of the first one.
module gestell_floquet_integrator_gauss_steps
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: block, columns_at_once, columns_of_panel, eliminate, lanes, padded_to_block, reduce, &
    & safe_multiplier, vector_border, width
  use gestell_floquet_integrator_exchanges, only: map_with_exchanges
  use gestell_floquet_integrator_method, only: unresolved_type
  use gestell_floquet_integrator_nested, only: nested_type
  use gestell_floquet_integrator_pace, only: pace_of
  use gestell_floquet_integrator_step_coefficients, only: coefficients_type, layout_of, layout_type, estimate_unresolved, &
    & max_rows, sample_coefficients, scale_coefficients
  use gestell_floquet_integrator_step_equations, only: fill_panel
  use gestell_floquet_integrator_tableau, only: tableau_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: fits_lanes, gauss_steps

  !> Sizes of arrays for eight steps side by side, as numbers of double precision elements. `of_panel`: a panel (a group of
  !> columns of the equations). `multiplier_goal`: the multipliers of elimination. `of_stages`: the matrices M of all stages; h B
  !> and h^2 C have the same size.
  integer, parameter :: of_panel = lanes * width * max_rows, multiplier_goal = lanes * max_rows**2, &
    & of_stages = lanes * max_rows * (max_rows / 2)
  !> Offsets of arrays in the memory that begins with the panel. `multipliers`: multipliers of elimination. `mass`, `damping`,
  !> `stiffness`: M, h B and h^2 C.
  integer, parameter :: multipliers = of_panel, mass = multipliers + multiplier_goal, damping = mass + of_stages, &
    & stiffness = damping + of_stages

contains

  !> True if the equations of a step have few enough rows for elimination in lanes (eight steps side by side in vector
  !> registers). Each of the last two nodes begins a new block of rows.
  pure logical function fits_lanes(stages, states, second_order)
    integer, intent(in) :: stages, states
    logical, intent(in) :: second_order
    integer :: f

    f = merge(states / 2, states, second_order)
    fits_lanes = padded_to_block(max(stages - 2, 0) * f) + 2 * padded_to_block(f) + padded_to_block(states) <= max_rows
  end function fits_lanes

  !> Computes the maps of all steps. Eight steps at a time are eliminated side by side, one in each lane of the vector registers.
  !> A step is computed alone, with row exchanges, in three cases: there are fewer than eight steps, its equations are too large
  !> for lanes, or elimination without exchanges is unsafe.
  subroutine gauss_steps(tableau, fitted, system, phases, lengths, map, error, lower, unresolved)
    !> Coefficients of the method. If `fitted` is true, they are fitted to the fastest motion
    class(tableau_type), intent(inout) :: tableau
    !> If true, fit the tableau to the fastest motion of the steps in this call
    logical, intent(in) :: fitted
    class(periodic_system), intent(in) :: system
    !> `phases`: nodes of all steps as phases, sorted by stage: first node 1 of every step. `lengths`: lengths of the steps, in the
    !> unit of time.
    real(dp), contiguous, intent(in) :: phases(:), lengths(:)
    !> Maps of the steps, [A b], shape (steps or more, n, n + 1), or A alone, shape (steps or more, n, n)
    real(dp), contiguous, intent(out) :: map(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    !> Maps by the two embedded methods, shape (steps or more, n, n + 1 or n, 2); only allowed if `tableau` is a nested tableau
    real(dp), contiguous, intent(out), optional :: lower(:, :, :, :)
    !> Effects of variations of the coefficients and loads between the nodes, summed over the steps; this call adds the effects
    !> in its own steps
    type(unresolved_type), intent(inout), optional :: unresolved
    type(coefficients_type) :: at
    type(layout_type) :: layout
    ! On the heap: threads have small stacks. The size is always that of the largest steps: the GNU C library keeps a block for
    ! reuse if one of this size was freed before.
    real(dp), allocatable, target :: room(:)
    ! Maps of the method and, if requested, of its two embedded methods
    real(dp), allocatable :: maps(:, :, :, :)
    real(dp) :: units(system%states), of_step(lanes, size(map, 3)), turn
    logical :: safe(lanes), side_by_side
    integer :: steps, i, k, first, last, border

    call sample_coefficients(system, phases, size(map, 3) > system%states, at, units)
    at%lengths = lengths
    steps = size(lengths)
    turn = 0
    if (fitted) turn = pace_of(at) * sum(lengths) / steps
    call tableau%fit(turn)
    side_by_side = steps >= lanes .and. fits_lanes(size(tableau%c), at%states, at%positions > 0)
    safe = .false.
    allocate(room(merge(of_panel + multiplier_goal + 3 * of_stages + lanes, 0, side_by_side)))
    border = vector_border(room)
    if (side_by_side) call layout_of(tableau, at, layout)
    allocate(maps(lanes, at%states, size(map, 3), merge(3, 1, present(lower))))
    do k = 1, steps, lanes
      first = max(1, min(k, steps - lanes + 1))
      if (side_by_side) then
        call scale_coefficients(at, first, layout, room(border + mass), room(border + damping), room(border + stiffness))
        call eliminate_panels(tableau, at, first, layout, room(border), room(border + multipliers), room(border + mass), &
          & room(border + damping), room(border + stiffness), maps, safe)
      end if
      last = min(k + lanes - 1, steps)
      do i = k, last
        if (.not. safe(i - first + 1)) then
          call map_with_exchanges(tableau, at, i, maps(i - first + 1, :, :, :), error)
          if (allocated(error)) return
        end if
      end do
      ! Converts units of the states and of the loads. Each step has its own unit of time: velocities are scaled by the length h of
      ! the step, positions are not.
      of_step = 1
      do i = 1, at%states
        of_step(:, i) = units(i)
        if (i > at%positions .and. at%positions > 0) of_step(:last - first + 1, i) = units(i) / at%lengths(first:last)
      end do
      call copy_from_lanes(of_step, first, k, last, maps(:, :, :, 1), map)
      do i = 2, size(maps, 4)
        call copy_from_lanes(of_step, first, k, last, maps(:, :, :, i), lower(:, :, :, i - 1))
      end do
    end do
    if (.not. present(unresolved)) return
    select type (tableau)
    class is (nested_type)
      call estimate_unresolved(tableau, at, units(:at%f), unresolved)
      unresolved%steps = unresolved%steps + steps
      unresolved%fitted = unresolved%fitted + steps * [turn**2, turn**4]
    end select
  end subroutine gauss_steps

  !> Copies the maps of the steps `from` to `to` from the lanes (one step in each) to `map`, shape (steps, states, columns).
  !> Converts them to the units of the states. The first lane holds step `first`. `of_step`: units of the columns in each lane.
  pure subroutine copy_from_lanes(of_step, first, from, to, in_lanes, map)
    integer, intent(in) :: first, from, to
    real(dp), contiguous, intent(in) :: of_step(:, :), in_lanes(:, :, :)
    real(dp), contiguous, intent(inout) :: map(:, :, :)
    real(dp) :: inverse(lanes)
    integer :: i, j, k

    do j = 1, size(map, 3)
      inverse = 1 / of_step(:, j)
      do i = 1, size(map, 2)
        do k = from, to
          map(k, i, j) = of_step(k - first + 1, i) * inverse(k - first + 1) * in_lanes(k - first + 1, i, j)
        end do
      end do
    end do
  end subroutine copy_from_lanes

  !> Computes the maps [A b], or A alone, of the eight steps from number `first` on. The steps are eliminated side by side, one
  !> in each lane. `maps` has the shape (lanes, states, columns, 1 or 3). Its last index is 1 for the method, 2 for its first and
  !> 3 for its second embedded method.
  !>
  !> The equations are eliminated panel by panel, a panel being a group of columns: first the columns of the unknowns, then those
  !> of the map. In the latter columns the map of an embedded method is complete, and is copied, as soon as the unknowns of this
  !> method have been eliminated.
  pure subroutine eliminate_panels(tableau, at, first, layout, panel, l, masses, dampers, springs, maps, safe)
    class(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first
    type(layout_type), intent(in) :: layout
    real(dp), intent(inout) :: panel(lanes, width, layout%rows), l(lanes, block, layout%n, layout%rows / block)
    real(dp), dimension(lanes, layout%n, layout%f), intent(in) :: masses, dampers, springs
    real(dp), contiguous, intent(inout) :: maps(:, :, :, :)
    logical, intent(out) :: safe(lanes)
    real(dp) :: multiplier(lanes)
    integer :: column, columns, from, to, i, c

    associate (n => layout%n, rows => layout%rows, states => at%states)
      multiplier = 0
      do column = 1, n, columns_at_once()
        columns = min(columns_at_once(), n - column + 1)
        call fill_panel(tableau, at, first, layout, column, columns, panel, masses, dampers, springs)
        call eliminate(column, columns, n, rows, panel, l, multiplier)
      end do
      column = n + 1
      do while (column <= layout%columns)
        columns = columns_of_panel(layout%columns - column + 1)
        call fill_panel(tableau, at, first, layout, column, columns, panel, masses, dampers, springs)
        from = 1
        do i = size(maps, 4), 1, -1
          to = layout%place(layout%s + 2 - i)
          call reduce(from, to, columns, n, rows, panel, l)
          do c = 1, min(columns, n + size(maps, 3) - column + 1)
            maps(:, :, column - n + c - 1, i) = panel(:, c, n + 1:n + states)
          end do
          from = to + 1
        end do
        column = column + columns
      end do
      safe = multiplier < safe_multiplier
    end associate
  end subroutine eliminate_panels

end module gestell_floquet_integrator_gauss_steps
