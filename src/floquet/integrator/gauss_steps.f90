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
  use gestell_math_matrix, only: unit_matrix
  use gestell_math_lanes, only: block, lanes, most_rows, padded, safe_multiplier, schur_complement, vector_border
  use gestell_floquet_integrator_exchanges, only: map_with_exchanges
  use gestell_floquet_integrator_method, only: maps_type, unseen_type
  use gestell_floquet_integrator_nested, only: nested_type
  use gestell_floquet_integrator_step_coefficients, only: coefficients_type, look_beyond, sample_coefficients
  use gestell_floquet_integrator_tableau, only: tableau_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: fits_lanes, gauss_steps

  !> Numbers that eight steps at once need: their equations w, and M, h B and h^2 C of one stage below the other.
  integer, parameter :: of_equations = lanes * most_rows * (most_rows + block), of_stages = lanes * most_rows * (most_rows / 2)

contains

  !> Whether a step with so many stages is small enough to be eliminated in lanes, its last two nodes by themselves.
  pure logical function fits_lanes(stages, states, second_order)
    integer, intent(in) :: stages, states
    logical, intent(in) :: second_order
    integer :: f

    f = merge(states / 2, states, second_order)
    fits_lanes = padded(max(stages - 2, 0) * f) + 2 * padded(f) + padded(states) <= most_rows
  end function fits_lanes

  !> Maps of steps of these lengths (time), as `method_type` has them, from the coefficients at `phases`: the nodes of one
  !> stage together. Eight steps at a time; singly, with exchanges of rows, what is fewer than eight, too large, or unsafe without.
  !> `lower`, shape (2), and `unseen`: by a nested tableau, as `method_type` has them.
  !> Nine arguments: those of a method's `pair`, the tableau and the phases.
  subroutine gauss_steps(tableau, system, phases, lengths, a, error, b, lower, unseen)
    class(tableau_type), intent(in) :: tableau
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:), lengths(:)
    real(dp), intent(out) :: a(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(out), optional :: b(:, :)
    type(maps_type), intent(inout), optional :: lower(:)
    type(unseen_type), intent(inout), optional :: unseen
    type(coefficients_type) :: at
    ! On the heap: threads have small stacks. As for the largest of steps: what was as large once the GNU C library keeps.
    real(dp), allocatable, target :: room(:)
    ! Of the method, and where asked for of the one embedded in it and of the one embedded in that.
    real(dp), allocatable :: maps(:, :, :, :)
    real(dp) :: units(system%states)
    logical :: safe(lanes), side_by_side
    integer :: steps, i, k, first, last, border

    call sample_coefficients(system, phases, present(b), at, units)
    at%lengths = lengths
    steps = size(lengths)
    side_by_side = steps >= lanes .and. fits_lanes(size(tableau%c), at%states, at%positions > 0)
    safe = .false.
    allocate(room(merge(of_equations + 3 * of_stages + lanes, 0, side_by_side)))
    border = vector_border(room)
    allocate(maps(lanes, at%states, at%states + 1, merge(3, 1, present(lower))))
    do k = 1, steps, lanes
      first = max(1, min(k, steps - lanes + 1))
      if (side_by_side) call maps_of_lanes(tableau, at, first, room(border), room(border + of_equations), &
        & room(border + of_equations + of_stages), room(border + of_equations + 2 * of_stages), maps, safe)
      last = min(k + lanes - 1, steps)
      do i = k, last
        if (.not. safe(i - first + 1)) then
          call map_with_exchanges(tableau, at, i, maps(i - first + 1, :, :, :), error)
          if (allocated(error)) return
        end if
      end do
      call take(at, units, k, maps(k - first + 1:last - first + 1, :, :, 1), a(:, :, k:last), b)
      do i = 2, size(maps, 4)
        call take(at, units, k, maps(k - first + 1:last - first + 1, :, :, i), lower(i - 1)%a(:, :, k:last), lower(i - 1)%b)
      end do
    end do
    if (.not. present(unseen)) return
    select type (tableau)
    class is (nested_type)
      call look_beyond(tableau, at, unseen)
    end select
  end subroutine gauss_steps

  !> A, shape (states, states, steps), and where it is asked for b, whose first column is the one `from`, from maps [A b], shape
  !> (steps, states, states + 1), in these units, of steps that are their own unit of time: positions are over h times velocities.
  pure subroutine take(at, units, from, map, a, b)
    type(coefficients_type), intent(in) :: at
    real(dp), intent(in) :: units(:), map(:, :, :)
    integer, intent(in) :: from
    real(dp), intent(out) :: a(:, :, :)
    real(dp), intent(inout), optional :: b(:, :)
    real(dp) :: of_step(size(units)), inverse(size(units))
    integer :: n, k, j

    n = size(units)
    of_step = units
    do k = 1, size(map, 1)
      if (at%positions > 0) of_step(at%positions + 1:) = units(at%positions + 1:) / at%lengths(from + k - 1)
      inverse = 1 / of_step
      do j = 1, n
        a(:, j, k) = of_step * inverse(j) * map(k, :, j)
      end do
      if (present(b)) b(:, from + k - 1) = of_step * map(k, :, n + 1)
    end do
  end subroutine take

  !> Where the unknowns of each node begin, less one, and where they end; shape (s + 1). Those of the last two nodes of a nested
  !> tableau begin with a block.
  pure function places(tableau, f)
    class(tableau_type), intent(in) :: tableau
    integer, intent(in) :: f
    integer :: places(size(tableau%c) + 1)
    integer :: s, i

    s = size(tableau%c)
    places = [(f * (i - 1), i = 1, s), padded(s * f)]
    select type (tableau)
    class is (nested_type)
      places(s - 1:) = padded((s - 2) * f) + [0, 1, 2] * padded(f)
    end select
  end function places

  !> The maps [A b], shape (lanes, states, states + 1, 1 or 3), of the steps from `first` on, b where there are loads: of the
  !> method, of the one embedded in it and of the one embedded in that. In w, mass, damping, stiffness there
  !> is room.
  !> Nine arguments: the steps, room and results.
  !> (Recursive: gfortran makes large arrays of other procedures static, and threads share those.)
  pure recursive subroutine maps_of_lanes(tableau, at, first, w, mass, damping, stiffness, maps, safe)
    class(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first
    real(dp), intent(inout) :: w(lanes, most_rows, most_rows + block)
    real(dp), dimension(lanes, most_rows, most_rows / 2), intent(inout) :: mass, damping, stiffness
    real(dp), contiguous, intent(inout) :: maps(:, :, :, :)
    logical, intent(out) :: safe(lanes)
    real(dp) :: multiplier(lanes)
    integer :: place(size(tableau%c) + 1), n, rows, columns, last, from, to, i

    place = places(tableau, at%f)
    n = place(size(place))
    rows = n + padded(at%states)
    columns = at%states
    if (allocated(at%g)) columns = columns + 1
    last = n + padded(columns)
    call fill_equations(tableau, at, first, place, rows, last, w, mass, damping, stiffness)
    safe = .true.
    from = 1
    do i = size(maps, 4), 1, -1
      to = place(size(place) + 1 - i)
      call schur_complement(w, to, rows, last, multiplier, from)
      maps(:, :, :columns, i) = w(:, n + 1:n + at%states, n + 1:n + columns)
      safe = safe .and. multiplier < safe_multiplier
      from = to + 1
    end do
  end subroutine maps_of_lanes

  !> (a) and (b) of the steps from `first` on; places that are no unknown's, and rows and columns of the corner that are no state's,
  !> are padded with zeros and ones. Column after column, as they lie in memory. Without positions C is zero, and p takes the place
  !> of q after it. Ten arguments: sizes are given where loops are to have them known.
  pure recursive subroutine fill_equations(tableau, at, first, place, rows, columns, w, mass, damping, stiffness)
    class(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first, place(:), rows, columns
    real(dp), intent(inout) :: w(lanes, most_rows, columns)
    real(dp), dimension(lanes, most_rows, most_rows / 2), intent(inout) :: mass, damping, stiffness
    ! Slopes in the nodes, of the unknowns; what of the last two equations is added to each.
    real(dp) :: slopes(size(tableau%c), size(tableau%c)), sums(size(tableau%c), 2)
    real(dp), dimension(lanes, at%f) :: next, last
    integer :: f, n, p, s, lane, i, j, r, c, row, end_row, column
    logical :: nested

    f = at%f
    s = size(tableau%c)
    n = place(s + 1)
    p = n + at%positions
    nested = .false.
    slopes = unit_matrix(s)
    select type (tableau)
    class is (nested_type)
      nested = .true.
      slopes(s - 1:, :) = tableau%values
      sums = tableau%sums
    end select
    call scale_coefficients(at, first, place, mass, damping, stiffness)
    call pad(place, f, p + f, rows, w)

    do c = 1, f
      do i = 1, s
        do r = 1, f
          row = place(i) + r
          !GCC$ unroll 1
          do lane = 1, lanes
            w(lane, row, n + c) = -stiffness(lane, row, c)
            w(lane, row, p + c) = -damping(lane, row, c) - tableau%c(i) * stiffness(lane, row, c)
          end do
        end do
      end do
    end do
    if (allocated(at%g)) call fill_loads(at, first, place, w(:, :, p + f + 1))
    if (nested) then
      do c = n + 1, p + f + merge(1, 0, allocated(at%g))
        call sum_equations(place, sums, f, w(:, :, c))
      end do
    end if

    associate (a => tableau%a, aa => tableau%aa)
      do j = 1, s
        do c = 1, f
          column = place(j) + c
          if (nested) then
            do r = 1, f
              row = place(s - 1) + r
              end_row = place(s) + r
              !GCC$ unroll 1
              do lane = 1, lanes
                next(lane, r) = a(s - 1, j) * damping(lane, row, c) + aa(s - 1, j) * stiffness(lane, row, c) &
                  & + slopes(s - 1, j) * mass(lane, row, c)
                last(lane, r) = a(s, j) * damping(lane, end_row, c) + aa(s, j) * stiffness(lane, end_row, c) &
                  & + slopes(s, j) * mass(lane, end_row, c)
                w(lane, row, column) = next(lane, r) + sums(s - 1, 2) * last(lane, r)
                w(lane, end_row, column) = last(lane, r)
              end do
            end do
            do i = 1, s - 2
              do r = 1, f
                row = place(i) + r
                !GCC$ unroll 1
                do lane = 1, lanes
                  w(lane, row, column) = a(i, j) * damping(lane, row, c) + aa(i, j) * stiffness(lane, row, c) &
                    & + sums(i, 1) * next(lane, r) + sums(i, 2) * last(lane, r)
                end do
              end do
            end do
          else
            do i = 1, s
              do r = 1, f
                row = place(i) + r
                !GCC$ unroll 1
                do lane = 1, lanes
                  w(lane, row, column) = a(i, j) * damping(lane, row, c) + aa(i, j) * stiffness(lane, row, c)
                end do
              end do
            end do
          end if
          if (.not. nested .or. j <= s - 2) w(:, place(j) + 1:place(j) + f, column) = w(:, place(j) + 1:place(j) + f, column) &
            & + mass(:, place(j) + 1:place(j) + f, c)
          w(:, n + c, column) = -tableau%ba(j)
          w(:, p + c, column) = -tableau%b(j)
        end do
      end do
    end associate
  end subroutine fill_equations

  !> Ones on the diagonal and zeros beside it for places in K that are no unknown's, and in the corner S, after it and up to `rows`,
  !> for what no state is; the states after the positions, h p, move these. `columns`: up to the last state.
  pure subroutine pad(place, f, columns, rows, w)
    integer, intent(in) :: place(:), f, columns, rows
    real(dp), intent(inout) :: w(:, :, :)
    integer :: n, i, k

    n = place(size(place))
    w(:, n + 1:rows, :) = 0
    w(:, :n, columns + 1:) = 0
    do i = 1, size(place) - 1
      do k = place(i) + f + 1, place(i + 1)
        w(:, k, :) = 0
        w(:, :n, k) = 0
        w(:, k, k) = 1
      end do
    end do
    do i = n + 1, rows
      w(:, i, i) = 1
    end do
    do i = n + 1, columns - f
      w(:, i, i + f) = 1
    end do
  end subroutine pad

  !> M, h B and h^2 C of the steps from `first` on at the places of their nodes; without positions M is the unit matrix and C zero.
  pure subroutine scale_coefficients(at, first, place, mass, damping, stiffness)
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first, place(:)
    real(dp), dimension(lanes, most_rows, most_rows / 2), intent(inout) :: mass, damping, stiffness
    real(dp) :: h(lanes)
    integer :: points, row, lane, i, r, c

    h = at%lengths(first:first + lanes - 1)
    do i = 1, size(place) - 1
      points = size(at%lengths) * (i - 1) + first - 1
      do c = 1, at%f
        do r = 1, at%f
          row = place(i) + r
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

  !> h^2 g of the steps from `first` on, h g without positions, at the places of their nodes.
  pure subroutine fill_loads(at, first, place, column)
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first, place(:)
    real(dp), intent(inout) :: column(:, :)
    real(dp) :: h(lanes)
    integer :: points, i, c

    h = at%lengths(first:first + lanes - 1)
    if (at%positions > 0) h = h**2
    do i = 1, size(place) - 1
      points = size(at%lengths) * (i - 1) + first - 1
      do c = 1, at%f
        column(:, place(i) + c) = h * at%g(points + 1:points + lanes, c)
      end do
    end do
  end subroutine fill_loads

  !> Adds the equations of the last two nodes to those of the others, and those of the last to those of the one before.
  pure subroutine sum_equations(place, sums, f, column)
    integer, intent(in) :: place(:), f
    real(dp), intent(in) :: sums(:, :)
    real(dp), contiguous, intent(inout) :: column(:, :)
    real(dp), dimension(lanes) :: next, last
    integer :: s, i, r, lane

    s = size(sums, 1)
    do r = 1, f
      next = column(:, place(s - 1) + r)
      last = column(:, place(s) + r)
      do i = 1, s - 1
        !GCC$ unroll 1
        do lane = 1, lanes
          column(lane, place(i) + r) = column(lane, place(i) + r) + sums(i, 1) * next(lane) + sums(i, 2) * last(lane)
        end do
      end do
    end do
  end subroutine sum_equations

end module gestell_floquet_integrator_gauss_steps
