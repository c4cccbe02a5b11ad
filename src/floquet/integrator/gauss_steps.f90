!> The steps of Gauss-Legendre collocation, each an affine map of the state.
!>
!> For M q'' + B q' + C q = g the positions are eliminated: with the start (q, p) of a step of length h, the accelerations
!> v_i at the nodes c_i and the tableau A, b,
!>
!>     q'_i = p + h sum_j A_ij v_j,   q_i = q + h c_i p + h^2 sum_j (A A)_ij v_j,
!>     M_i v_i + h B_i sum_j A_ij v_j + h^2 C_i sum_j (A A)_ij v_j = g_i - B_i p - C_i (q + h c_i p),            (a)
!>     q + h p + h^2 sum_j (b A)_j v_j,   p + h sum_j b_j v_j   at the end of the step:                          (b)
!>
!> half the unknowns of the slopes, and M is never inverted. x' = P x + f is the same with M = E, B = -P, g = f, p = x, and
!> neither q nor C. (a) and (b) together are one matrix,
!>
!>     [  K   R ]    rows: (a), with v on the left and q, p, 1 on the right,
!>     [ -G   S ]    rows: (b), in the same columns,
!>
!> and the map of the step is what elimination of v leaves in the place of S: S + G K^-1 R. Side by side, each step is its own
!> unit of time: with h B, h^2 C, h^2 g (h g without positions) and the start (q, h p), (a) and (b) hold with h = 1.
!>
!> *The embedded methods* (gestell_floquet_integrator_nested) come of the same elimination, in other unknowns and sums of the
!> equations: before the unknowns of the last two nodes, and before those of the last, are eliminated, the corner holds their maps.
module gestell_floquet_integrator_gauss_steps
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: block, columns_at_once, columns_of_panel, eliminate, lanes, padded, reduce, safe_multiplier, &
    & vector_border, width
  use gestell_floquet_integrator_exchanges, only: map_with_exchanges
  use gestell_floquet_integrator_method, only: unseen_type
  use gestell_floquet_integrator_nested, only: nested_type
  use gestell_floquet_integrator_pace, only: pace_of
  use gestell_floquet_integrator_step_coefficients, only: coefficients_type, layout_of, layout_type, estimate_unseen, most_rows, &
    & sample_coefficients, scale_coefficients
  use gestell_floquet_integrator_step_equations, only: fill_panel
  use gestell_floquet_integrator_tableau, only: tableau_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: fits_lanes, gauss_steps

  !> Numbers that eight steps at once need at most: a panel and the multipliers of their equations, and M, h B and h^2 C of one
  !> stage below the other.
  integer, parameter :: of_panel = lanes * width * most_rows, of_multipliers = lanes * most_rows**2, &
    & of_stages = lanes * most_rows * (most_rows / 2)
  !> Where these begin behind the panel.
  integer, parameter :: multipliers = of_panel, mass = multipliers + of_multipliers, damping = mass + of_stages, &
    & stiffness = damping + of_stages

contains

  !> Whether a step with so many stages is small enough to be eliminated in lanes, its last two nodes by themselves.
  pure logical function fits_lanes(stages, states, second_order)
    integer, intent(in) :: stages, states
    logical, intent(in) :: second_order
    integer :: f

    f = merge(states / 2, states, second_order)
    fits_lanes = padded(max(stages - 2, 0) * f) + 2 * padded(f) + padded(states) <= most_rows
  end function fits_lanes

  !> Maps of steps of these lengths (time), as `method_type` has them, from the coefficients at `phases`: the nodes of one stage
  !> together; of a tableau that is to be `fitted` or not. Eight steps at a time; singly, with exchanges of rows, what is fewer
  !> than eight, too large, or unsafe without. `lower` and `unseen`: by a nested tableau, as `method_type` has them.
  subroutine gauss_steps(tableau, fitted, system, phases, lengths, map, error, lower, unseen)
    class(tableau_type), intent(inout) :: tableau
    logical, intent(in) :: fitted
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:), lengths(:)
    real(dp), contiguous, intent(out) :: map(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), contiguous, intent(out), optional :: lower(:, :, :, :)
    type(unseen_type), intent(inout), optional :: unseen
    type(coefficients_type) :: at
    type(layout_type) :: layout
    ! On the heap: threads have small stacks. As for the largest of steps: what was as large once the GNU C library keeps.
    real(dp), allocatable, target :: room(:)
    ! Of the method, and where asked for of the one embedded in it and of the one embedded in that.
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
    allocate(room(merge(of_panel + of_multipliers + 3 * of_stages + lanes, 0, side_by_side)))
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
      ! Units of the states and of the loads; each step is its own unit of time: positions are over h times velocities.
      of_step = 1
      do i = 1, at%states
        of_step(:, i) = units(i)
        if (i > at%positions .and. at%positions > 0) of_step(:last - first + 1, i) = units(i) / at%lengths(first:last)
      end do
      call take(of_step, first, k, last, maps(:, :, :, 1), map)
      do i = 2, size(maps, 4)
        call take(of_step, first, k, last, maps(:, :, :, i), lower(:, :, :, i - 1))
      end do
    end do
    if (.not. present(unseen)) return
    select type (tableau)
    class is (nested_type)
      call estimate_unseen(tableau, at, units(:at%f), unseen)
      unseen%steps = unseen%steps + steps
      unseen%fitted = unseen%fitted + steps * [turn**2, turn**4]
    end select
  end subroutine gauss_steps

  !> The maps of the steps `from` to `to`, shape (steps, states, columns), from maps in lanes, the first those of step `first`, in
  !> these units.
  pure subroutine take(of_step, first, from, to, in_lanes, map)
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
  end subroutine take

  !> The maps [A b], or A, shape (lanes, states, columns, 1 or 3), of the steps from `first` on: of the method, of the one embedded
  !> in it and of the one embedded in that. Panel after panel: first those of the unknowns, then those of the map, in which after
  !> the unknowns of each embedded method its map stands.
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
