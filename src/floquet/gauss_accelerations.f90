!> Gauss-Legendre collocation of M q'' + B q' + C q = h, eliminated to the accelerations at the nodes.
!>
!> With the start (q, p) of a step of length h, the accelerations v_i at the nodes c_i and the tableau A, b:
!>
!>     q'_i = p + h sum_j A_ij v_j,   q_i = q + h c_i p + h^2 sum_j (A A)_ij v_j,
!>     M_i v_i + h B_i sum_j A_ij v_j + h^2 C_i sum_j (A A)_ij v_j = h_i - B_i p - C_i (q + h c_i p),            (a)
!>     q + h p + h^2 sum_j (b A)_j v_j,   p + h sum_j b_j v_j   at the end of the step:                          (b)
!>
!> half the unknowns of the slopes, and M is never inverted. (a) and (b) together are one matrix
!>
!>     [ K    R ]    rows: (a), with v on the left and q, p, 1 on the right,
!>     [ -G   S ]    rows: (b), in the same columns,
!>
!> and the map of the step is what elimination of v leaves in the place of S: S + G K^-1 R.
module gestell_floquet_gauss_accelerations
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_lanes, only: block, lanes, most_rows, padded, safe_multiplier, schur_complement
  use gestell_base_lapack, only: factorise, solve_factored
  use gestell_floquet_tableau, only: tableau_type
  use gestell_system_second_order, only: sample_in_units, second_order_system
  implicit none (type, external)
  private

  public :: acceleration_maps, fits_lanes

  !> M, B, C, shape (points, f, f), and h, shape (points, f), at the nodes of all steps, those of one stage together: the
  !> nodes i of eight steps that follow each other lie side by side.
  type :: coefficients_type
    real(dp), allocatable, dimension(:, :, :) :: m, b, c
    real(dp), allocatable :: h(:, :)
    !> Lengths of the steps, in time.
    real(dp), allocatable :: lengths(:)
  end type coefficients_type

contains

  !> Whether a step with so many stages for so many degrees of freedom is small enough to be eliminated in lanes.
  pure logical function fits_lanes(stages, freedoms)
    integer, intent(in) :: stages, freedoms

    fits_lanes = padded(stages * freedoms) + padded(2 * freedoms) <= most_rows
  end function fits_lanes

  !> Maps of steps of these lengths (time), as `method_type` has them, from the coefficients at `phases`: the nodes of one
  !> stage together. Eight steps at a time; singly, with exchanges of rows, what is fewer than eight, too large, or unsafe
  !> without.
  subroutine acceleration_maps(tableau, system, phases, lengths, a, error, b)
    type(tableau_type), intent(in) :: tableau
    class(second_order_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:), lengths(:)
    real(dp), intent(out) :: a(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(out), optional :: b(:, :)
    type(coefficients_type) :: at
    real(dp) :: units(system%states)
    real(dp) :: map(lanes, system%states, system%states + 1)
    logical :: safe(lanes)
    integer :: f, s, steps, i, j, k, first, last

    f = system%states / 2
    s = size(tableau%c)
    steps = size(lengths)
    at%lengths = lengths
    allocate(at%m(s * steps, f, f), at%b(s * steps, f, f), at%c(s * steps, f, f))
    if (present(b)) then
      allocate(at%h(s * steps, f))
      call sample_in_units(system, phases, at%m, at%b, at%c, units(:f), at%h)
    else
      call sample_in_units(system, phases, at%m, at%b, at%c, units(:f))
    end if
    units(f + 1:) = units(:f)

    safe = .false.
    do k = 1, steps, lanes
      first = max(1, min(k, steps - lanes + 1))
      if (steps >= lanes .and. fits_lanes(s, f)) call maps_of_lanes(tableau, at, first, map, safe)
      last = min(k + lanes - 1, steps)
      do i = k, last
        if (.not. safe(i - first + 1)) then
          call map_with_exchanges(tableau, at, i, map(i - first + 1, :, :), error)
          if (allocated(error)) return
        end if
      end do
      do j = 1, 2 * f
        do i = 1, 2 * f
          a(i, j, k:last) = units(i) / units(j) * map(k - first + 1:last - first + 1, i, j)
        end do
        if (present(b)) b(j, k:last) = units(j) * map(k - first + 1:last - first + 1, j, 2 * f + 1)
      end do
    end do
  end subroutine acceleration_maps

  !> The maps [A b], shape (lanes, 2 f, 2 f + 1), of the steps from `first` on. (Recursive: gfortran makes large arrays
  !> of other procedures static, and threads share those.)
  pure recursive subroutine maps_of_lanes(tableau, at, first, map, safe)
    type(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: first
    real(dp), contiguous, intent(out) :: map(:, :, :)
    logical, intent(out) :: safe(lanes)
    real(dp) :: w(lanes, most_rows, most_rows + block)
    real(dp), dimension(lanes) :: h, damping, stiffness, multiplier
    integer :: f, s, n, rows, columns, lane, i, j, r, c, row, from

    f = size(at%m, 2)
    s = size(tableau%c)
    n = padded(s * f)
    rows = n + padded(2 * f)
    columns = n + padded(2 * f + 1)
    h = at%lengths(first:first + lanes - 1)
    w(:, :rows, n + 1:columns) = 0
    w(:, n + 1:rows, :n) = 0
    if (n > s * f) w(:, :n, :n) = 0

    do i = 1, s
      from = size(at%lengths) * (i - 1) + first - 1
      do r = 1, f
        row = f * (i - 1) + r
        do c = 1, f
          !$omp simd
          do lane = 1, lanes
            damping(lane) = h(lane) * at%b(from + lane, r, c)
            stiffness(lane) = h(lane)**2 * at%c(from + lane, r, c)
            w(lane, row, n + c) = -at%c(from + lane, r, c)
            w(lane, row, n + f + c) = -at%b(from + lane, r, c) - tableau%c(i) * h(lane) * at%c(from + lane, r, c)
          end do
          do j = 1, s
            !$omp simd
            do lane = 1, lanes
              w(lane, row, f * (j - 1) + c) = tableau%a(i, j) * damping(lane) + tableau%aa(i, j) * stiffness(lane)
            end do
          end do
          !$omp simd
          do lane = 1, lanes
            w(lane, row, f * (i - 1) + c) = w(lane, row, f * (i - 1) + c) + at%m(from + lane, r, c)
          end do
        end do
        if (allocated(at%h)) w(:, row, n + 2 * f + 1) = at%h(from + 1:from + lanes, r)
        w(:, n + r, row) = -h**2 * tableau%ba(i)
        w(:, n + f + r, row) = -h * tableau%b(i)
      end do
    end do
    do row = s * f + 1, n
      w(:, row, row) = 1
    end do
    do r = 1, f
      w(:, n + r, n + r) = 1
      w(:, n + r, n + f + r) = h
      w(:, n + f + r, n + f + r) = 1
    end do

    call schur_complement(w, n, rows, columns, multiplier)
    safe = multiplier < safe_multiplier
    map = w(:, n + 1:n + 2 * f, n + 1:n + 2 * f + 1)
  end subroutine maps_of_lanes

  !> The map [A b], shape (2 f, 2 f + 1), of step `k` with exchanges of rows. Error: the equations are singular.
  subroutine map_with_exchanges(tableau, at, k, map, error)
    type(tableau_type), intent(in) :: tableau
    type(coefficients_type), intent(in) :: at
    integer, intent(in) :: k
    real(dp), intent(out) :: map(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: left(:, :), right(:, :)
    integer :: pivots(size(tableau%c) * size(at%m, 2)), f, s, i, j, point, row, column

    f = size(at%m, 2)
    s = size(tableau%c)
    allocate(left(f * s, f * s), right(f * s, 2 * f + 1))
    associate (h => at%lengths(k))
      do i = 1, s
        point = size(at%lengths) * (i - 1) + k
        row = f * (i - 1)
        do j = 1, s
          column = f * (j - 1)
          left(row + 1:row + f, column + 1:column + f) = &
            & h * tableau%a(i, j) * at%b(point, :, :) + h**2 * tableau%aa(i, j) * at%c(point, :, :)
        end do
        left(row + 1:row + f, row + 1:row + f) = left(row + 1:row + f, row + 1:row + f) + at%m(point, :, :)
        right(row + 1:row + f, :f) = -at%c(point, :, :)
        right(row + 1:row + f, f + 1:2 * f) = -at%b(point, :, :) - h * tableau%c(i) * at%c(point, :, :)
        right(row + 1:row + f, 2 * f + 1) = 0
        if (allocated(at%h)) right(row + 1:row + f, 2 * f + 1) = at%h(point, :)
      end do
      call factorise(left, pivots, error)
      if (allocated(error)) return
      call solve_factored(left, pivots, right)

      map = 0
      do i = 1, f
        map(i, f + i) = h
      end do
      do i = 1, 2 * f
        map(i, i) = 1
      end do
      do j = 1, s
        row = f * (j - 1)
        map(:f, :) = map(:f, :) + h**2 * tableau%ba(j) * right(row + 1:row + f, :)
        map(f + 1:, :) = map(f + 1:, :) + h * tableau%b(j) * right(row + 1:row + f, :)
      end do
    end associate
  end subroutine map_with_exchanges

end module gestell_floquet_gauss_accelerations
