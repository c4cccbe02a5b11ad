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
!> *The embedded method* has one stage fewer on the same nodes. Collocation at Gauss' nodes is Galerkin's method for polynomials v
!> of degree s - 1 whose integrals are taken by Gauss' quadrature; Galerkin's method for those of degree s - 2, of order 2 s - 2,
!> leaves residuals orthogonal to them, which are L mu, L_i = P_s-1(c_i) E in each node, and has no v along P_s-1:
!> T v = 0, T_i = (2 s - 1) b_i P_s-1(c_i) E. So K v - L mu = R: f more rows and columns,
!>
!>     [  K   L   R ]
!>     [ -T   0   0 ]    and with mu eliminated after v there stands S + G K^-1 R - (G K^-1 L) (T K^-1 L)^-1 (T K^-1 R).
!>     [ -G   0   S ]
module gestell_floquet_integrator_gauss_steps
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lanes, only: block, lanes, most_rows, padded, safe_multiplier, schur_complement, vector_border
  use gestell_math_lapack, only: factorise, solve_factored
  use gestell_floquet_integrator_method, only: maps_type
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

  !> Numbers that eight steps at once need: their equations w, and h B and h^2 C of one stage below the other.
  integer, parameter :: of_equations = lanes * most_rows * (most_rows + block), of_stages = lanes * most_rows * (most_rows / 2)

contains

  !> Whether a step with so many stages is small enough to be eliminated in lanes, with the embedded method beside it.
  pure logical function fits_lanes(stages, states, second_order)
    integer, intent(in) :: stages, states
    logical, intent(in) :: second_order
    integer :: f

    f = merge(states / 2, states, second_order)
    fits_lanes = padded(stages * f) + padded(f) + padded(states) <= most_rows
  end function fits_lanes

  !> Maps of steps of these lengths (time), as `method_type` has them, from the coefficients at `phases`: the nodes of one
  !> stage together. Eight steps at a time; singly, with exchanges of rows, what is fewer than eight, too large, or unsafe
  !> without. `lower`: those of the embedded method.
  subroutine gauss_steps(tableau, system, phases, lengths, a, error, b, lower)
    type(tableau_type), intent(in) :: tableau
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:), lengths(:)
    real(dp), intent(out) :: a(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(out), optional :: b(:, :)
    type(maps_type), intent(inout), optional :: lower
    type(coefficients_type) :: at
    ! On the heap: threads have small stacks. As for the largest of steps: what was as large once the GNU C library keeps.
    real(dp), allocatable, target :: room(:)
    ! What is not allocated is absent where it is an argument.
    real(dp), allocatable :: map(:, :, :), low(:, :, :)
    real(dp) :: units(system%states)
    logical :: safe(lanes), side_by_side
    integer :: steps, i, k, first, last, border

    call sample_coefficients(system, phases, present(b), at, units)
    at%lengths = lengths
    steps = size(lengths)
    side_by_side = steps >= lanes .and. fits_lanes(size(tableau%c), at%states, at%positions > 0)
    safe = .false.
    allocate(room(merge(of_equations + 2 * of_stages + lanes, 0, side_by_side)))
    border = vector_border(room)
    allocate(map(lanes, at%states, at%states + 1))
    if (present(lower)) allocate(low, mold=map)
    do k = 1, steps, lanes
      first = max(1, min(k, steps - lanes + 1))
      if (side_by_side) call maps_of_lanes(tableau, at, first, room(border), room(border + of_equations), &
        & room(border + of_equations + of_stages), map, safe, low)
      last = min(k + lanes - 1, steps)
      do i = k, last
        if (.not. safe(i - first + 1)) then
          call map_with_exchanges(tableau, at, i, i - first + 1, map, error, low)
          if (allocated(error)) return
        end if
      end do
      call take(map(k - first + 1:last - first + 1, :, :), units, a(:, :, k:last), b, k)
      if (present(lower)) call take(low(k - first + 1:last - first + 1, :, :), units, lower%a(:, :, k:last), lower%b, k)
    end do
  end subroutine gauss_steps

  !> A, shape (states, states, steps), from maps [A b], shape (steps, states, states + 1), in these units, and where it is asked for
  !> b, whose first column is the one `from`.
  pure subroutine take(map, units, a, b, from)
    real(dp), intent(in) :: map(:, :, :), units(:)
    real(dp), intent(out) :: a(:, :, :)
    real(dp), intent(inout), optional :: b(:, :)
    integer, intent(in) :: from
    integer :: i, j

    do j = 1, size(units)
      do i = 1, size(units)
        a(i, j, :) = units(i) / units(j) * map(:, i, j)
      end do
      if (present(b)) b(j, from:from + size(map, 1) - 1) = units(j) * map(:, j, size(units) + 1)
    end do
  end subroutine take

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

  !> The maps [A b], shape (lanes, states, states + 1), of the steps from `first` on, b where there are loads; `low`: those of the
  !> embedded method. In w, damping, stiffness there is room.
  !> Nine arguments: the steps, room and results.
  !> (Recursive: gfortran makes large arrays of other procedures static, and threads share those.)
  pure recursive subroutine maps_of_lanes(tableau, at, first, w, damping, stiffness, map, safe, low)
    type(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first
    real(dp), intent(inout) :: w(lanes, most_rows, most_rows + block)
    real(dp), dimension(lanes, most_rows, most_rows / 2), intent(inout) :: damping, stiffness
    real(dp), contiguous, intent(inout) :: map(:, :, :)
    logical, intent(out) :: safe(lanes)
    real(dp), contiguous, intent(inout), optional :: low(:, :, :)
    real(dp), dimension(lanes) :: multiplier, of_border
    integer :: n, e, rows, columns, last

    n = padded(size(tableau%c) * at%f)
    e = n
    if (present(low)) e = n + padded(at%f)
    rows = e + padded(at%states)
    columns = at%states
    if (allocated(at%g)) columns = columns + 1
    last = e + padded(columns)
    call fill_equations(tableau, at, first, n, e, rows, last, w, damping, stiffness)
    call schur_complement(w, n, rows, last, multiplier)
    call take_map(at, first, w(:, e + 1:e + at%states, e + 1:e + columns), map)
    if (present(low)) then
      call schur_complement(w, e, rows, last, of_border, from=n + 1)
      multiplier = max(multiplier, of_border)
      call take_map(at, first, w(:, e + 1:e + at%states, e + 1:e + columns), low)
    end if
    safe = multiplier < safe_multiplier
  end subroutine maps_of_lanes

  !> Maps from those whose unit of time is the step.
  pure subroutine take_map(at, first, of_steps, map)
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first
    real(dp), intent(in) :: of_steps(:, :, :)
    real(dp), intent(inout) :: map(:, :, :)
    real(dp) :: h(lanes)
    integer :: p, columns, i, j

    p = at%positions
    columns = size(of_steps, 3)
    map(:, :, :columns) = of_steps
    h = at%lengths(first:first + lanes - 1)
    do i = 1, p
      do j = 1, p
        map(:, i, p + j) = h * map(:, i, p + j)
        map(:, p + i, j) = map(:, p + i, j) / h
      end do
      if (allocated(at%g)) map(:, p + i, columns) = map(:, p + i, columns) / h
    end do
  end subroutine take_map

  !> (a) and (b) of the steps from `first` on; unknowns and equations up to `n`, `rows` and `columns` are padded with zeros and
  !> ones, and those of the embedded method, where there are any, up to `e`. Column after column, as they lie in memory. Without
  !> positions C is zero, and p takes the place of q after it.
  !> Ten arguments: sizes are given where loops are to have them known.
  pure recursive subroutine fill_equations(tableau, at, first, n, e, rows, columns, w, damping, stiffness)
    type(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first, n, e, rows, columns
    real(dp), intent(inout) :: w(lanes, most_rows, columns)
    real(dp), dimension(lanes, most_rows, most_rows / 2), intent(inout) :: damping, stiffness
    real(dp) :: h(lanes), a, aa
    integer :: f, p, s, points, lane, i, j, r, c, row, column

    f = at%f
    s = size(tableau%c)
    p = e + at%positions
    h = at%lengths(first:first + lanes - 1)
    w(:, s * f + 1:rows, :) = 0
    w(:, :s * f, s * f + 1:e) = 0
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
            w(lane, row, e + c) = -stiffness(lane, row, c)
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
        w(:, e + c, column + c) = -tableau%ba(j)
        w(:, p + c, column + c) = -tableau%b(j)
        if (e == n) cycle
        w(:, column + c, n + c) = tableau%last(j)
        w(:, n + c, column + c) = -tableau%part(j)
      end do
    end do

    do i = s * f + 1, rows
      if (i <= n .or. i > min(n + f, e)) w(:, i, i) = 1
    end do
    do i = 1, at%positions
      w(:, e + i, p + i) = 1
    end do
  end subroutine fill_equations

  !> The map [A b] of step `k` with exchanges of rows, in this `lane` of `map`, and that of the embedded method in `low`. Error: the
  !> equations are singular.
  subroutine map_with_exchanges(tableau, at, k, lane, map, error, low)
    type(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: k, lane
    real(dp), intent(inout) :: map(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(inout), optional :: low(:, :, :)
    real(dp), allocatable :: left(:, :), right(:, :), mu(:, :)
    integer :: pivots(size(tableau%c) * at%f), of_border(at%f), f, p, s, n, i, j, point, row, column

    f = at%f
    s = size(tableau%c)
    p = at%positions
    n = at%states + 1
    allocate(left(f * s, f * s), right(f * s, n + merge(f, 0, present(low))), mu(f, n + merge(f, 0, present(low))))
    right(:, n:) = 0
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
        if (allocated(at%g)) right(row + 1:row + f, n) = at%g(point, :)
        if (.not. present(low)) cycle
        do j = 1, f
          right(row + j, n + j) = tableau%last(i)
        end do
      end do
      call factorise(left, pivots, error)
      if (allocated(error)) return
      call solve_factored(left, pivots, right)
      map(lane, :, :) = map_of(tableau, at%states, h, right(:, :n))
      if (.not. present(low)) return
      mu = 0
      do j = 1, s
        row = f * (j - 1)
        mu = mu + tableau%part(j) * right(row + 1:row + f, :)
      end do
      left = mu(:, n + 1:)
      call factorise(left, of_border, error)
      if (allocated(error)) return
      call solve_factored(left, of_border, mu(:, :n))
      low(lane, :, :) = map_of(tableau, at%states, h, right(:, :n) - matmul(right(:, n + 1:), mu(:, :n)))
    end associate
  end subroutine map_with_exchanges

  !> The map [A b], shape (states, states + 1), of a step of length h from its slopes v, shape (unknowns, states + 1).
  pure function map_of(tableau, states, h, v) result(map)
    type(tableau_type), intent(in) :: tableau
    integer, intent(in) :: states
    real(dp), intent(in) :: h, v(:, :)
    real(dp) :: map(states, states + 1)
    integer :: f, p, i, j, row

    f = size(v, 1) / size(tableau%c)
    p = states - f
    map = 0
    do i = 1, p
      map(i, p + i) = h
    end do
    do i = 1, states
      map(i, i) = 1
    end do
    do j = 1, size(tableau%c)
      row = f * (j - 1)
      if (p > 0) map(:p, :) = map(:p, :) + h**2 * tableau%ba(j) * v(row + 1:row + f, :)
      map(p + 1:, :) = map(p + 1:, :) + h * tableau%b(j) * v(row + 1:row + f, :)
    end do
  end function map_of

end module gestell_floquet_integrator_gauss_steps
