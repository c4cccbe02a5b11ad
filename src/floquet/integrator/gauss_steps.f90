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
module gestell_floquet_integrator_gauss_steps
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: block, lanes, most_rows, padded, safe_multiplier, schur_complement
  use gestell_math_lapack, only: factorise, solve_factored
  use gestell_floquet_integrator_tableau, only: tableau_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: sample_in_units, second_order_system
  implicit none (type, external)
  private

  public :: fits_lanes, gauss_steps

  !> M, B, C, shape (points, f, f), and g, shape (points, f), at the nodes of all steps, those of one stage together: the
  !> nodes i of eight steps that follow each other lie side by side. M and C are allocated only with positions.
  type :: coefficients_type
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
    real(dp), allocatable :: g(:, :)
    !> Lengths of the steps, in time.
    real(dp), allocatable :: lengths(:)
    !> Unknowns at a node; positions and all states of the map.
    integer :: f = 0, positions = 0, states = 0
  end type coefficients_type

  !> What eight steps at once need: their equations, and of these h B and h^2 C of one stage below the other. On the heap:
  !> threads have small stacks. For the largest of steps, whatever is used of it: once such a piece was given back the GNU C library
  !> keeps twice as much for the next case, where else it returns memory to the system, and fetches it anew, ten times a case.
  type :: room_type
    real(dp) :: w(lanes, most_rows, most_rows + block)
    real(dp), dimension(lanes, most_rows, most_rows / 2) :: damping, stiffness
  end type room_type

contains

  !> Whether a step with so many stages is small enough to be eliminated in lanes.
  pure logical function fits_lanes(stages, states, second_order)
    integer, intent(in) :: stages, states
    logical, intent(in) :: second_order

    fits_lanes = padded(stages * merge(states / 2, states, second_order)) + padded(states) <= most_rows
  end function fits_lanes

  !> Maps of steps of these lengths (time), as `method_type` has them, from the coefficients at `phases`: the nodes of one
  !> stage together. Eight steps at a time; singly, with exchanges of rows, what is fewer than eight, too large, or unsafe
  !> without.
  subroutine gauss_steps(tableau, system, phases, lengths, a, error, b)
    type(tableau_type), intent(in) :: tableau
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:), lengths(:)
    real(dp), intent(out) :: a(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(out), optional :: b(:, :)
    type(coefficients_type) :: at
    type(room_type), allocatable :: room
    real(dp) :: units(system%states), map(lanes, system%states, system%states + 1)
    logical :: safe(lanes), side_by_side
    integer :: steps, i, j, k, first, last

    call sample_coefficients(system, phases, present(b), at, units)
    at%lengths = lengths
    steps = size(lengths)
    side_by_side = steps >= lanes .and. fits_lanes(size(tableau%c), at%states, at%positions > 0)
    safe = .false.
    if (side_by_side) allocate(room)
    do k = 1, steps, lanes
      first = max(1, min(k, steps - lanes + 1))
      if (side_by_side) call maps_of_lanes(tableau, at, first, room, map, safe)
      last = min(k + lanes - 1, steps)
      do i = k, last
        if (.not. safe(i - first + 1)) then
          call map_with_exchanges(tableau, at, i, map(i - first + 1, :, :), error)
          if (allocated(error)) return
        end if
      end do
      do j = 1, at%states
        do i = 1, at%states
          a(i, j, k:last) = units(i) / units(j) * map(k - first + 1:last - first + 1, i, j)
        end do
        if (present(b)) b(j, k:last) = units(j) * map(k - first + 1:last - first + 1, j, at%states + 1)
      end do
    end do
  end subroutine gauss_steps

  !> The coefficients, and the units of the states, shape (states), in which they are.
  subroutine sample_coefficients(system, phases, forced, at, units)
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    logical, intent(in) :: forced
    type(coefficients_type), intent(out) :: at
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
      ! What is not allocated is absent where it is an argument.
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

  !> The maps [A b], shape (lanes, states, states + 1), of the steps from `first` on, b where there are loads.
  !> (Recursive: gfortran makes large arrays of other procedures static, and threads share those.)
  pure recursive subroutine maps_of_lanes(tableau, at, first, room, map, safe)
    type(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first
    type(room_type), intent(inout) :: room
    real(dp), contiguous, intent(inout) :: map(:, :, :)
    logical, intent(out) :: safe(lanes)
    real(dp) :: h(lanes), multiplier(lanes)
    integer :: p, n, rows, columns, i, j

    p = at%positions
    n = padded(size(tableau%c) * at%f)
    rows = n + padded(at%states)
    columns = at%states
    if (allocated(at%g)) columns = columns + 1
    call fill_equations(tableau, at, first, n, rows, n + padded(columns), room%w, room%damping, room%stiffness)
    call schur_complement(room%w, n, rows, n + padded(columns), multiplier)
    safe = multiplier < safe_multiplier
    map(:, :, :columns) = room%w(:, n + 1:n + at%states, n + 1:n + columns)

    h = at%lengths(first:first + lanes - 1)
    do i = 1, p
      do j = 1, p
        map(:, i, p + j) = h * map(:, i, p + j)
        map(:, p + i, j) = map(:, p + i, j) / h
      end do
      if (allocated(at%g)) map(:, p + i, columns) = map(:, p + i, columns) / h
    end do
  end subroutine maps_of_lanes

  !> (a) and (b) of the steps from `first` on; unknowns and equations up to `n`, `rows` and `columns` are padded with zeros and
  !> ones. Column after column, as they lie in memory. Without positions C is zero, and p takes the place of q after it.
  !> Nine arguments: sizes are given where loops are to have them known.
  pure recursive subroutine fill_equations(tableau, at, first, n, rows, columns, w, damping, stiffness)
    type(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first, n, rows, columns
    real(dp), intent(inout) :: w(lanes, most_rows, columns)
    real(dp), dimension(lanes, most_rows, most_rows / 2), intent(inout) :: damping, stiffness
    real(dp) :: h(lanes), a, aa
    integer :: f, p, s, points, lane, i, j, r, c, row, column

    f = at%f
    s = size(tableau%c)
    p = n + at%positions
    h = at%lengths(first:first + lanes - 1)
    w(:, s * f + 1:rows, :) = 0
    w(:, :s * f, s * f + 1:n) = 0
    w(:, :s * f, p + f + 1:) = 0
    if (at%positions == 0) stiffness(:, :n, :f) = 0

    do i = 1, s
      points = size(at%lengths) * (i - 1) + first - 1
      do c = 1, f
        do r = 1, f
          row = f * (i - 1) + r
          !GCC$ unroll 1
          do lane = 1, lanes
            damping(lane, row, c) = h(lane) * at%b(points + lane, r, c)
          end do
          if (at%positions > 0) then
            !GCC$ unroll 1
            do lane = 1, lanes
              stiffness(lane, row, c) = h(lane)**2 * at%c(points + lane, r, c)
            end do
          end if
          !GCC$ unroll 1
          do lane = 1, lanes
            w(lane, row, n + c) = -stiffness(lane, row, c)
            w(lane, row, p + c) = -damping(lane, row, c) - tableau%c(i) * stiffness(lane, row, c)
          end do
        end do
        if (.not. allocated(at%g)) cycle
        row = f * (i - 1) + c
        w(:, row, p + f + 1) = h * at%g(points + 1:points + lanes, c)
        if (at%positions > 0) w(:, row, p + f + 1) = h * w(:, row, p + f + 1)
      end do
    end do

    do j = 1, s
      column = f * (j - 1)
      do i = 1, s
        row = f * (i - 1)
        a = tableau%a(i, j)
        aa = tableau%aa(i, j)
        do c = 1, f
          do r = 1, f
            !GCC$ unroll 1
            do lane = 1, lanes
              w(lane, row + r, column + c) = a * damping(lane, row + r, c) + aa * stiffness(lane, row + r, c)
            end do
          end do
        end do
      end do
      points = size(at%lengths) * (j - 1) + first - 1
      do c = 1, f
        if (at%positions > 0) then
          do r = 1, f
            !GCC$ unroll 1
            do lane = 1, lanes
              w(lane, column + r, column + c) = w(lane, column + r, column + c) + at%m(points + lane, r, c)
            end do
          end do
        else
          w(:, column + c, column + c) = w(:, column + c, column + c) + 1
        end if
        w(:, n + c, column + c) = -tableau%ba(j)
        w(:, p + c, column + c) = -tableau%b(j)
      end do
    end do

    do i = s * f + 1, rows
      w(:, i, i) = 1
    end do
    do i = 1, at%positions
      w(:, n + i, p + i) = 1
    end do
  end subroutine fill_equations

  !> The map [A b], shape (states, states + 1), of step `k` with exchanges of rows. Error: the equations are singular.
  subroutine map_with_exchanges(tableau, at, k, map, error)
    type(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: k
    real(dp), intent(out) :: map(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: left(:, :), right(:, :)
    integer :: pivots(size(tableau%c) * at%f), f, p, s, i, j, point, row, column

    f = at%f
    s = size(tableau%c)
    p = at%positions
    allocate(left(f * s, f * s), right(f * s, at%states + 1))
    right(:, at%states + 1) = 0
    associate (h => at%lengths(k))
      do i = 1, s
        point = size(at%lengths) * (i - 1) + k
        row = f * (i - 1)
        do j = 1, s
          column = f * (j - 1)
          left(row + 1:row + f, column + 1:column + f) = h * tableau%a(i, j) * at%b(point, :, :)
          if (p > 0) left(row + 1:row + f, column + 1:column + f) = left(row + 1:row + f, column + 1:column + f) &
            & + h**2 * tableau%aa(i, j) * at%c(point, :, :)
        end do
        right(row + 1:row + f, p + 1:p + f) = -at%b(point, :, :)
        if (p > 0) then
          left(row + 1:row + f, row + 1:row + f) = left(row + 1:row + f, row + 1:row + f) + at%m(point, :, :)
          right(row + 1:row + f, :p) = -at%c(point, :, :)
          right(row + 1:row + f, p + 1:p + f) = right(row + 1:row + f, p + 1:p + f) - h * tableau%c(i) * at%c(point, :, :)
        else
          do j = row + 1, row + f
            left(j, j) = left(j, j) + 1
          end do
        end if
        if (allocated(at%g)) right(row + 1:row + f, at%states + 1) = at%g(point, :)
      end do
      call factorise(left, pivots, error)
      if (allocated(error)) return
      call solve_factored(left, pivots, right)

      map = 0
      do i = 1, p
        map(i, p + i) = h
      end do
      do i = 1, at%states
        map(i, i) = 1
      end do
      do j = 1, s
        row = f * (j - 1)
        if (p > 0) map(:p, :) = map(:p, :) + h**2 * tableau%ba(j) * right(row + 1:row + f, :)
        map(p + 1:, :) = map(p + 1:, :) + h * tableau%b(j) * right(row + 1:row + f, :)
      end do
    end associate
  end subroutine map_with_exchanges

end module gestell_floquet_integrator_gauss_steps
