!> The equations of eight steps of collocation side by side, (a) and (b) of gestell_floquet_integrator_gauss_steps, panel by panel
!> as gestell_math_lanes eliminates them.
module gestell_floquet_integrator_step_equations
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: block, lanes, padded, width
  use gestell_floquet_integrator_nested, only: nested_type
  use gestell_floquet_integrator_step_coefficients, only: coefficients_type
  use gestell_floquet_integrator_step_unknowns, only: fill_unknowns, most_rows
  use gestell_floquet_integrator_tableau, only: tableau_type
  implicit none (type, external)
  private

  public :: fill_panel, layout_of, most_rows, scale_coefficients

  !> Where everything stands. Stages and unknowns at a node; places of unknowns, and rows of all, multiples of a block; columns of
  !> all. (Arrays of fixed size, as of no more rows: nothing is fetched from the heap for eight steps.)
  type, public :: layout_type
    integer :: s = 0, f = 0, n = 0, rows = 0, columns = 0
    !> Where the unknowns of each node begin, less one, and where they end; shape (s + 1).
    integer :: place(most_rows + 1) = 0
    !> Of each column of unknowns, shape (n): its node and its place there, 0 where it is no unknown's.
    integer :: node(most_rows) = 0, component(most_rows) = 0
    logical :: nested = .false.
    !> Of a nested tableau: the slopes in the last two nodes, of the unknowns, and what of the last two equations is added to each.
    real(dp) :: values(2, most_rows) = 0, sums(most_rows, 2) = 0
  end type layout_type

contains

  !> Of steps with this tableau. The unknowns of the last two nodes of a nested tableau begin with a block.
  pure subroutine layout_of(tableau, at, layout)
    class(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    type(layout_type), intent(out) :: layout
    integer :: s, i, k

    s = size(tableau%c)
    layout%s = s
    layout%f = at%f
    layout%place(:s + 1) = [(at%f * (i - 1), i = 1, s), padded(s * at%f)]
    select type (tableau)
    class is (nested_type)
      layout%nested = .true.
      layout%values(:, :s) = tableau%values
      layout%sums(:s, :) = tableau%sums
      layout%place(s - 1:s + 1) = padded((s - 2) * at%f) + [0, 1, 2] * padded(at%f)
    end select
    layout%n = layout%place(s + 1)
    layout%rows = layout%n + padded(at%states)
    ! A column more than threes is treated alone.
    i = at%states + merge(1, 0, allocated(at%g))
    layout%columns = layout%n + merge(i, padded(i), modulo(i, block) == 1)
    do i = 1, s
      do k = 1, at%f
        layout%node(layout%place(i) + k) = i
        layout%component(layout%place(i) + k) = k
      end do
    end do
  end subroutine layout_of

  !> The columns from `column` on, unknowns or states and loads, of the steps from `step` on, from M, h B and h^2 C. Places that are
  !> no unknown's, and rows and columns that are no state's, are padded with zeros and ones.
  !> Ten arguments: what the steps are, which columns, and arrays whose sizes loops are to know.
  pure subroutine fill_panel(tableau, at, step, layout, column, columns, panel, mass, damping, stiffness)
    class(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: step, column, columns
    type(layout_type), intent(in) :: layout
    real(dp), intent(inout) :: panel(lanes, width, layout%rows)
    real(dp), dimension(lanes, layout%n, layout%f), intent(in) :: mass, damping, stiffness
    integer :: c, here, together, lane

    call clear(layout, panel)
    c = 1
    do while (c <= columns)
      here = column + c - 1
      together = 1
      if (here > layout%n) then
        call fill_state(tableau%c, at, step, layout, here - layout%n, c, panel, damping, stiffness)
      else if (layout%component(here) == 0) then
        panel(:, c, :) = 0
        panel(:, c, here) = 1
      else
        associate (j => layout%node(here), k => layout%component(here), map => layout%n + layout%component(here))
          together = min(3, layout%f - k + 1, columns - c + 1)
          call fill_unknowns(layout%s, layout%f, layout%n, layout%rows, layout%nested, together, j, layout%place, &
            & tableau%a(:, j), tableau%aa(:, j), layout%values(:, j), layout%sums, mass(1, 1, k), damping(1, 1, k), &
            & stiffness(1, 1, k), panel(1, c, 1))
          do here = 0, together - 1
            !GCC$ unroll 1
            do lane = 1, lanes
              panel(lane, c + here, map + here) = -tableau%ba(j)
              panel(lane, c + here, map + here + at%positions) = -tableau%b(j)
            end do
          end do
        end associate
      end if
      c = c + together
    end do
  end subroutine fill_panel

  !> Zeros in the rows of states and in those that are no unknown's.
  pure subroutine clear(layout, panel)
    type(layout_type), intent(in) :: layout
    real(dp), intent(inout) :: panel(lanes, width, layout%rows)
    integer :: i, row

    do i = max(1, layout%s - 2), layout%s
      do row = layout%place(i) + layout%f + 1, merge(layout%rows, layout%place(i + 1), i == layout%s)
        panel(:, :, row) = 0
      end do
    end do
  end subroutine clear

  !> Column `c` of a panel, that of a state (without positions C is zero), of the loads after the states, or of nothing.
  !> Nine arguments: the column and what it is made of.
  pure subroutine fill_state(nodes, at, step, layout, state, c, panel, damping, stiffness)
    real(dp), intent(in) :: nodes(:)
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: step, state, c
    type(layout_type), intent(in) :: layout
    real(dp), intent(inout) :: panel(lanes, width, layout%rows)
    real(dp), dimension(lanes, layout%n, layout%f), intent(in) :: damping, stiffness
    integer :: i, k, row, lane

    if (state <= layout%rows - layout%n) panel(:, c, layout%n + state) = 1
    ! A position is moved by its velocity.
    if (state > at%positions .and. state <= at%states .and. at%positions > 0) panel(:, c, layout%n + state - layout%f) = 1
    if (state == at%states + 1 .and. allocated(at%g)) then
      call fill_loads(at, step, layout, c, panel)
    else if (state > at%states) then
      panel(:, c, :layout%n) = 0
    else
      k = merge(state, state - at%positions, state <= at%positions)
      do i = 1, layout%s
        do row = layout%place(i) + 1, layout%place(i) + layout%f
          if (state <= at%positions) then
            !GCC$ unroll 1
            do lane = 1, lanes
              panel(lane, c, row) = -stiffness(lane, row, k)
            end do
          else
            !GCC$ unroll 1
            do lane = 1, lanes
              panel(lane, c, row) = -damping(lane, row, k) - nodes(i) * stiffness(lane, row, k)
            end do
          end if
        end do
      end do
    end if
    if (layout%nested) call sum_equations(layout, c, panel)
  end subroutine fill_state

  !> h^2 g of the steps from `step` on, h g without positions, at the places of their nodes.
  pure subroutine fill_loads(at, step, layout, c, panel)
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: step, c
    type(layout_type), intent(in) :: layout
    real(dp), intent(inout) :: panel(lanes, width, layout%rows)
    real(dp) :: h(lanes)
    integer :: points, row, lane, i, k

    h = at%lengths(step:step + lanes - 1)
    if (at%positions > 0) h = h**2
    do i = 1, layout%s
      points = size(at%lengths) * (i - 1) + step - 1
      do k = 1, layout%f
        row = layout%place(i) + k
        !GCC$ unroll 1
        do lane = 1, lanes
          panel(lane, c, row) = h(lane) * at%g(points + lane, k)
        end do
      end do
    end do
  end subroutine fill_loads

  !> Adds the equations of the last two nodes to those of the others, and those of the last to those of the one before.
  pure subroutine sum_equations(layout, c, panel)
    type(layout_type), intent(in) :: layout
    integer, intent(in) :: c
    real(dp), intent(inout) :: panel(lanes, width, layout%rows)
    real(dp), dimension(lanes) :: next, last
    integer :: s, i, r, lane

    s = layout%s
    associate (place => layout%place, sums => layout%sums)
      do r = 1, layout%f
        !GCC$ unroll 1
        do lane = 1, lanes
          next(lane) = panel(lane, c, place(s - 1) + r)
          last(lane) = panel(lane, c, place(s) + r)
        end do
        do i = 1, s - 1
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, c, place(i) + r) = panel(lane, c, place(i) + r) + sums(i, 1) * next(lane) + sums(i, 2) * last(lane)
          end do
        end do
      end do
    end associate
  end subroutine sum_equations

  !> M, h B and h^2 C of the steps from `step` on at the places of their nodes; without positions M is the unit matrix and C zero.
  pure subroutine scale_coefficients(at, step, layout, mass, damping, stiffness)
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: step
    type(layout_type), intent(in) :: layout
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

end module gestell_floquet_integrator_step_equations
