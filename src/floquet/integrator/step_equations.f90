!> Sets up the collocation equations (a) and (b) of gestell_floquet_integrator_gauss_steps for eight steps side by side. The
!> equations are filled in by panels (groups of columns), each just before gestell_math_lanes eliminates it.
module gestell_floquet_integrator_step_equations
  use gestell_base_processor, only: has_versions, vector_length
  use gestell_math_lanes, only: lanes, width
  use gestell_floquet_integrator_step_coefficients, only: coefficients_type, layout_type
  use gestell_floquet_integrator_tableau, only: tableau_type
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: fill_panel

contains

  !> Fills the first `together` (one to three) columns of a panel, a group of columns of the equations. These columns belong to
  !> unknowns of node `j`. `a`, `aa`: columns of A and A A for this node. `mass`, `damping`, `stiffness`: columns of M, h B and
  !> h^2 C.
  !>
  !> The rows of successive nodes have no gaps between them, except for the last two nodes of a nested tableau. Three columns are
  !> computed together, because they use the same factors of the tableau. If fewer than three are requested, the last requested
  !> column is computed repeatedly.
  pure subroutine fill_here(layout, j, together, a, aa, mass, damping, stiffness, panel, once) bind(C, name="lanes_gestell_fill")
    !$omp declare simd uniform(layout, j, together, a, aa, mass, damping, stiffness, panel) linear(once) simdlen(2) notinbranch
    type(layout_type), intent(in) :: layout
    integer(c_int), value :: j, together, once
    real(dp), intent(in) :: a(layout%s), aa(layout%s)
    real(dp), dimension(lanes, layout%n, together), intent(in) :: mass, damping, stiffness
    real(dp), intent(inout) :: panel(lanes, width, layout%rows)
    ! Elements of the equations of the last two nodes
    real(dp), dimension(lanes, 3) :: next, last
    integer :: s, f, c2, c3, i, r, row, end_row, lane

    next = 0
    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    s = layout%s
    f = layout%f
    c2 = min(2, together)
    c3 = min(3, together)
    associate (place => layout%place, sums => layout%sums, values => layout%values(:, j))
      do r = 1, f
        if (layout%nested) then
          row = place(s - 1) + r
          end_row = place(s) + r
          do i = 1, together
            !GCC$ unroll 1
            do lane = 1, lanes
              next(lane, i) = a(s - 1) * damping(lane, row, i) + aa(s - 1) * stiffness(lane, row, i) &
                & + values(1) * mass(lane, row, i)
              last(lane, i) = a(s) * damping(lane, end_row, i) + aa(s) * stiffness(lane, end_row, i) &
                & + values(2) * mass(lane, end_row, i)
              panel(lane, i, row) = next(lane, i) + sums(s - 1, 2) * last(lane, i)
              panel(lane, i, end_row) = last(lane, i)
            end do
          end do
          do i = 1, s - 2
            row = f * (i - 1) + r
            !GCC$ unroll 1
            do lane = 1, lanes
              panel(lane, 1, row) = a(i) * damping(lane, row, 1) + aa(i) * stiffness(lane, row, 1) &
                & + sums(i, 1) * next(lane, 1) + sums(i, 2) * last(lane, 1)
            end do
            !GCC$ unroll 1
            do lane = 1, lanes
              panel(lane, c2, row) = a(i) * damping(lane, row, c2) + aa(i) * stiffness(lane, row, c2) &
                & + sums(i, 1) * next(lane, c2) + sums(i, 2) * last(lane, c2)
            end do
            !GCC$ unroll 1
            do lane = 1, lanes
              panel(lane, c3, row) = a(i) * damping(lane, row, c3) + aa(i) * stiffness(lane, row, c3) &
                & + sums(i, 1) * next(lane, c3) + sums(i, 2) * last(lane, c3)
            end do
          end do
        else
          do i = 1, s
            row = f * (i - 1) + r
            !GCC$ unroll 1
            do lane = 1, lanes
              panel(lane, 1, row) = a(i) * damping(lane, row, 1) + aa(i) * stiffness(lane, row, 1)
            end do
            !GCC$ unroll 1
            do lane = 1, lanes
              panel(lane, c2, row) = a(i) * damping(lane, row, c2) + aa(i) * stiffness(lane, row, c2)
            end do
            !GCC$ unroll 1
            do lane = 1, lanes
              panel(lane, c3, row) = a(i) * damping(lane, row, c3) + aa(i) * stiffness(lane, row, c3)
            end do
          end do
        end if
      end do
      if (layout%nested .and. j > s - 2) return
      do i = 1, together
        do row = place(j) + 1, place(j) + f
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, i, row) = panel(lane, i, row) + mass(lane, row, i)
          end do
        end do
      end do
    end associate
  end subroutine fill_here

  !> Fills columns of a panel (a group of columns of the equations) from M, h B and h^2 C. Rows and columns of padding, which
  !> belong to neither an unknown nor a state, contain ones on the diagonal and zeros elsewhere.
  pure subroutine fill_panel(tableau, at, step, layout, column, columns, panel, mass, damping, stiffness)
    class(tableau_type), intent(in) :: tableau
    !> Coefficients at the nodes of all steps
    type(coefficients_type), intent(in) :: at
    !> `step`: number of the first of the eight steps. `column`: index of the first column to be filled. `columns`: number of
    !> columns to be filled.
    integer, intent(in) :: step, column, columns
    type(layout_type), intent(in) :: layout
    !> The panel to be filled, shape (lanes, width, rows)
    real(dp), intent(inout) :: panel(lanes, width, layout%rows)
    !> M, h B and h^2 C at the nodes, from `scale_coefficients`
    real(dp), dimension(lanes, layout%n, layout%f), intent(in) :: mass, damping, stiffness
    procedure(fill_here), bind(C, name="_ZGVeN2uuuuuuuuul_lanes_gestell_fill") :: fill_512
    procedure(fill_here), bind(C, name="_ZGVdN2uuuuuuuuul_lanes_gestell_fill") :: fill_256
    integer :: c, here, together, length, row, lane

    length = vector_length()
    ! Only the last three nodes can be followed by rows that belong to no unknown.
    do here = max(1, layout%s - 2), layout%s
      do row = layout%place(here) + layout%f + 1, merge(layout%rows, layout%place(here + 1), here == layout%s)
        panel(:, :, row) = 0
      end do
    end do
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
          associate (a => tableau%a(:, j), aa => tableau%aa(:, j))
            if (has_versions .and. length == 8) then
              call fill_512(layout, j, together, a, aa, mass(1, 1, k), damping(1, 1, k), stiffness(1, 1, k), panel(1, c, 1), 1)
            else if (has_versions .and. length == 4) then
              call fill_256(layout, j, together, a, aa, mass(1, 1, k), damping(1, 1, k), stiffness(1, 1, k), panel(1, c, 1), 1)
            else
              call fill_here(layout, j, together, a, aa, mass(1, 1, k), damping(1, 1, k), stiffness(1, 1, k), panel(1, c, 1), 1)
            end if
          end associate
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

  !> Fills column `c` of a panel. It becomes the column of a state, the column of the loads, which follows the states, or
  !> padding, depending on `state`. For systems without positions C is zero.
  pure subroutine fill_state(nodes, at, step, layout, state, c, panel, damping, stiffness)
    real(dp), intent(in) :: nodes(:)
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: step, state, c
    type(layout_type), intent(in) :: layout
    real(dp), intent(inout) :: panel(lanes, width, layout%rows)
    real(dp), dimension(lanes, layout%n, layout%f), intent(in) :: damping, stiffness
    real(dp), dimension(lanes) :: h, next, last
    integer :: points, i, k, row, lane

    if (state <= layout%rows - layout%n) panel(:, c, layout%n + state) = 1
    ! In unit time a position changes by its velocity.
    if (state > at%positions .and. state <= at%states .and. at%positions > 0) panel(:, c, layout%n + state - layout%f) = 1
    if (state == at%states + 1 .and. allocated(at%g)) then
      ! h^2 g, or h g without positions
      h = at%lengths(step:step + lanes - 1)
      if (at%positions > 0) h = h**2
      do i = 1, layout%s
        points = size(at%lengths) * (i - 1) + step - 1
        do k = 1, layout%f
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, c, layout%place(i) + k) = h(lane) * at%g(points + lane, k)
          end do
        end do
      end do
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
    if (.not. layout%nested) return
    ! Adds the equations of the last two nodes to the others, and the last one to the last but one.
    associate (place => layout%place, sums => layout%sums, s => layout%s)
      do k = 1, layout%f
        !GCC$ unroll 1
        do lane = 1, lanes
          next(lane) = panel(lane, c, place(s - 1) + k)
          last(lane) = panel(lane, c, place(s) + k)
        end do
        do i = 1, s - 1
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, c, place(i) + k) = panel(lane, c, place(i) + k) + sums(i, 1) * next(lane) + sums(i, 2) * last(lane)
          end do
        end do
      end do
    end associate
  end subroutine fill_state

end module gestell_floquet_integrator_step_equations
