!> Elimination and steps in lanes, against the plain algorithms in quadruple precision.
module test_lanes
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: has_long_vectors, has_versions
  use gestell_math_lanes, only: block, eliminate, lanes, padded_to_block, reduce, schur_complement, width
  use gestell_floquet_integrator_method, only: method_type, unresolved_type
  use gestell_floquet_choice_methods, only: new_method
  use gestell_floquet_integrator_tableau, only: find_legendre, gauss_tableau, tableau_type
  use gestell_math_lapack, only: factorise, solve_factored
  use gestell_system_mass, only: solve_mass
  use gestell_system_second_order, only: second_order_system
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use, intrinsic :: iso_fortran_env, only: qp => real128
  implicit none (type, external)
  private

  public :: collect_lanes

  !> M q'' + C q = load with constant coefficients, period 1.
  type, extends(second_order_system) :: oscillators_type
    real(dp), allocatable :: m(:, :), c(:, :), h(:)
  contains
    procedure :: matrices
    procedure :: load
  end type oscillators_type

contains

  subroutine collect_lanes(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the vectorised Schur complement agrees with elimination with row exchanges", test_schur), &
      & new_unittest("panels of three and six columns yield the same Schur complements", test_panels), &
      & new_unittest("vanishing pivots and large multipliers are reported for their lane only", test_multipliers), &
      & new_unittest("vectorised accelerations agree with solving M X = R; singular M is reported", test_mass), &
      & new_unittest("a step is the same vectorised, single and with row exchanges", test_steps)]
  end subroutine collect_lanes

  subroutine test_schur(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: unknowns(6) = [3, 6, 18, 24, 36, 60], borders(6) = [3, 3, 6, 9, 12, 12], &
      & right(6) = [3, 12, 9, 12, 15, 15]
    real(dp), allocatable :: w(:, :, :), before(:, :, :)
    real(dp) :: multiplier(lanes)
    real(qp), allocatable :: exact(:, :)
    integer :: i, k, lane, rows, columns

    call random_init(repeatable=.true., image_distinct=.false.)
    do i = 1, size(unknowns)
      rows = unknowns(i) + borders(i)
      columns = unknowns(i) + right(i)
      if (allocated(w)) deallocate(w)
      allocate(w(lanes, rows, columns))
      call random_number(w)
      w = w - 0.5_dp
      do k = 1, unknowns(i)
        w(:, k, k) = w(:, k, k) + 3
      end do
      before = w
      call schur_complement(w, unknowns(i), multiplier)
      do lane = 1, lanes
        exact = schur_of(before(lane, :, :), unknowns(i))
        ! Elements up to 3, multipliers below 1: a few roundings in each of 60 unknowns.
        call check_that(error, maxval(abs(w(lane, unknowns(i) + 1:, unknowns(i) + 1:) - exact)), "<", 1.0e-13_qp, &
          & "Schur complement")
        call check_that(error, maxval(abs(multiplier - 1)), "<", 1.0_dp, "multipliers")
        if (allocated(error)) return
      end do
    end do
    call check_that(error, [padded_to_block(1), padded_to_block(3), padded_to_block(4), padded_to_block(24), &
      & padded_to_block(25)], "==", [3, 3, 6, 24, 27], "padded")
  end subroutine test_schur

  !> The Schur complements after 15, 18 and 21 unknowns, eliminated one after the other in panels of three columns and of six,
  !> whichever is faster on this processor.
  subroutine test_panels(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 21, rows = 27, columns = 30, stages(3) = [15, 18, 21]
    real(dp) :: w(lanes, rows, columns), panel(lanes, width, rows), l(lanes, block, n, rows / block), multiplier(lanes)
    real(dp) :: found(lanes, rows - n, columns - n, size(stages))
    integer :: at_once, first, count, from, i, k, lane, c

    call random_init(repeatable=.true., image_distinct=.false.)
    call random_number(w)
    do k = 1, n
      w(:, k, k) = w(:, k, k) + 3
    end do
    do at_once = block, width, block
      ! Six columns at once need AVX-512 where the procedures for it are called by name.
      if (at_once == width .and. has_versions .and. .not. has_long_vectors()) cycle
      multiplier = 0
      first = 1
      do while (first <= columns)
        count = min(at_once, merge(n, columns, first <= n) - first + 1)
        do c = 1, count
          panel(:, c, :) = w(:, :, first + c - 1)
        end do
        if (first <= n) then
          call eliminate(first, count, n, rows, panel, l, multiplier)
        else
          from = 1
          do i = 1, size(stages)
            call reduce(from, stages(i), count, n, rows, panel, l)
            do c = 1, count
              found(:, :, first - n + c - 1, i) = panel(:, c, n + 1:)
            end do
            from = stages(i) + 1
          end do
        end if
        first = first + count
      end do
      do i = 1, size(stages)
        do lane = 1, lanes
          associate (exact => schur_of(w(lane, [(k, k = 1, stages(i)), (k, k = n + 1, rows)], &
            & [(k, k = 1, stages(i)), (k, k = n + 1, columns)]), stages(i)))
            call check_that(error, maxval(abs(found(lane, :, :, i) - exact)), "<", 1.0e-13_qp, "Schur complement of a stage")
            if (allocated(error)) return
          end associate
        end do
      end do
      call check_that(error, maxval(multiplier), "<", 1.0_dp, "multipliers")
      if (allocated(error)) return
    end do
  end subroutine test_panels

  !> S - G A^-1 R with exchanges of rows.
  function schur_of(matrix, n) result(s)
    real(dp), intent(in) :: matrix(:, :)
    integer, intent(in) :: n
    real(qp), allocatable :: s(:, :)
    real(qp) :: w(size(matrix, 1), size(matrix, 2)), row(size(matrix, 2))
    integer :: i, k, pivot

    w = real(matrix, qp)
    do k = 1, n
      pivot = k - 1 + maxloc(abs(w(k:n, k)), dim=1)
      row = w(k, :)
      w(k, :) = w(pivot, :)
      w(pivot, :) = row
      do i = k + 1, size(w, 1)
        w(i, :) = w(i, :) - w(i, k) / w(k, k) * w(k, :)
      end do
    end do
    allocate(s, source=w(n + 1:, n + 1:))
  end function schur_of

  !> A lane reports its own pivots and does not disturb the others.
  subroutine test_multipliers(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: sound(lanes, 9, 9), w(lanes, 9, 9), multiplier(lanes)
    integer :: k

    call random_init(repeatable=.true., image_distinct=.false.)
    sound = 0
    call random_number(sound)
    do k = 1, 6
      sound(:, k, k) = sound(:, k, k) + 6
    end do
    w = sound
    ! Columns of the first block: 100 below a 2; of the second: 0 on the diagonal; in lane 7 a row twice.
    w(2, 5, 1) = 100
    w(2, 1, 1) = 2
    w(4, 1:3, 4) = 0
    w(4, 4:6, 1:3) = 0
    w(4, 4, 4) = 0
    w(7, 2, :) = w(7, 1, :)
    call schur_complement(w, 6, multiplier)
    call check_that(error, abs(multiplier(2) - 50), "<", 1.0e-12_dp, "multiplier")
    call check_that(error, multiplier(4), ">", 1.0e300_dp, "vanished pivots")
    call check_that(error, multiplier(7), ">", 1.0e300_dp, "vanished pivots")
    call check_that(error, multiplier([1, 3, 5, 6, 8]), "<", 1.0_dp, "multipliers of the other lanes")
    if (allocated(error)) return
    do k = 1, lanes
      if (any(k == [2, 4, 7])) cycle
      call check_that(error, maxval(abs(w(k, 7:9, 7:9) - schur_of(sound(k, :9, :), 6))), "<", 1.0e-14_qp, &
        & "lanes without vanished pivots")
      if (allocated(error)) return
    end do
  end subroutine test_multipliers

  !> M^-1 R at 1 to 20 points for 1 to 40 degrees of freedom; some M are indefinite with zeros on the diagonal, some singular.
  subroutine test_mass(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: freedoms(7) = [1, 2, 3, 7, 18, 35, 40]
    real(dp), allocatable :: m(:, :, :), r(:, :, :), before(:, :, :)
    integer :: i, points, k, j

    call random_init(repeatable=.true., image_distinct=.false.)
    do i = 1, size(freedoms)
      do points = 1, 20
        if (allocated(m)) deallocate(m, r)
        allocate(m(points, freedoms(i), freedoms(i)), r(points, freedoms(i), 2 * freedoms(i) + 1))
        call random_number(m)
        call random_number(r)
        do j = 1, freedoms(i)
          m(:, j, j) = m(:, j, j) + freedoms(i)
        end do
        ! An exchange of rows makes M indefinite, a row of zeros singular.
        if (freedoms(i) > 1) then
          if (points >= 3) m(3, [1, 2], :) = m(3, [2, 1], :)
          if (points >= 3) m(3, 1, 1) = 0
          if (points >= 11) m(11, 1, :) = 0
        end if
        before = r
        call solve_mass(m, r)
        do k = 1, points
          if (k == 11 .and. freedoms(i) > 1) then
            call check(error, all(ieee_is_nan(r(k, :, :))), more="a singular M is reported")
          else
            ! Diagonally dominant: residuals of a few roundings of 40 terms of size 1 to 40.
            call check_that(error, maxval(abs(matmul(m(k, :, :), r(k, :, :)) - before(k, :, :))), "<", 1.0e-13_dp, "M X = R")
          end if
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_mass

  !> A step of gauss8 for M q'' + C q = h with constant coefficients is the same map in every implementation: in lanes (eight
  !> steps and more), singly (fewer), with row exchanges (M with zeros on its diagonal; frequencies too high for elimination
  !> without exchanges) and with more unknowns than the lanes allow. Oracle: each oscillator by itself, whose step is known. The
  !> embedded method is compared with Galerkin's for accelerations of degree 6, solved for their coefficients in Legendre's
  !> polynomials.
  subroutine test_steps(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: frequencies(3) = [1.0_dp, 40.0_dp, 4000.0_dp]
    integer :: counts(5), i, k, f

    counts = [1, 7, 8, 9, 21]
    do f = 1, 9
      do i = 1, size(counts)
        call check_oscillators(counts(i), [(frequencies(1 + modulo(k, 3)), k = 1, f)], .false., error)
        if (allocated(error)) return
        if (f > 1) call check_oscillators(counts(i), [(frequencies(1 + modulo(k, 3)), k = 1, f)], .true., error)
        if (allocated(error)) return
      end do
    end do
  end subroutine test_steps

  !> Oscillators of these angular frequencies, in rotated coordinates; `crossed`: with their equations in another order,
  !> so that the diagonal of M vanishes.
  subroutine check_oscillators(steps, frequencies, crossed, error)
    integer, intent(in) :: steps
    real(dp), intent(in) :: frequencies(:)
    logical, intent(in) :: crossed
    type(error_type), allocatable, intent(out) :: error
    type(oscillators_type) :: system
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(dp) :: maps(steps, 2 * size(frequencies), 2 * size(frequencies) + 1), from(steps), to(steps)
    real(dp) :: lower(steps, 2 * size(frequencies), 2 * size(frequencies) + 1, 2)
    type(unresolved_type) :: unresolved
    real(dp) :: cosine, sine, turn, shift, fitted, galerkin(2, 3)
    integer :: f, i, k, place, fewer

    f = size(frequencies)
    system%states = 2 * f
    system%period = 1
    allocate(system%m(f, f), system%c(f, f), source=0.0_dp)
    allocate(system%h(f), source=1.0_dp)
    do i = 1, f
      place = i
      if (crossed) place = 1 + modulo(i, f)
      system%m(place, i) = 1
      system%c(place, i) = frequencies(i)**2
    end do
    from = [((k - 1) / 21.0_dp, k = 1, steps)]
    to = [(k / 21.0_dp, k = 1, steps)]
    call new_method("gauss8", method, failure)
    call method%maps(system, from, to, maps, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call method%pair(system, from, to, maps, failure, lower, unresolved)
    call check_success(error, failure)
    if (allocated(error)) return
    do k = 1, steps
      do i = 1, f
        associate (w => frequencies(i), h => to(k) - from(k))
          ! No method is fitted to more than 2 s radians.
          fitted = min(maxval(frequencies) * h, 16.0_dp)
          ! The condition of the equations grows as (w h)^2, that of the multiplier mu as its square.
          turn = 4.0e-13_dp * max(1.0_dp, (w * h)**2)
          do fewer = 1, 2
            call galerkin_step(8, 8 - fewer, w * h, fitted, galerkin)
            associate (map => lower(k, :, :2 * f, fewer), load => lower(k, :, 2 * f + 1, fewer))
              call check_that(error, abs(map(i, i) - galerkin(1, 1)), "<", turn, "turn of an embedded method")
              call check_that(error, abs(map(i, f + i) / h - galerkin(1, 2)), "<", turn, "turn of an embedded method")
              call check_that(error, abs(map(f + i, i) * h - galerkin(2, 1)), "<", turn * max(1.0_dp, w * h), &
                & "turn of an embedded method")
              call check_that(error, abs(map(f + i, f + i) - galerkin(2, 2)), "<", turn, "turn of an embedded method")
              call check_that(error, abs(load(i) / h**2 - galerkin(1, 3)), "<", turn, "load of an embedded method")
              call check_that(error, abs(load(f + i) / h - galerkin(2, 3)), "<", turn, "load of an embedded method")
            end associate
            if (allocated(error)) return
          end do
          call gauss_turn(8, w * h, fitted, cosine, sine)
          turn = 4.0e-13_dp * max(1.0_dp, (w * h)**2)
          call check_that(error, max(abs(maps(k, i, i) - cosine), abs(maps(k, f + i, f + i) - cosine)), "<", turn, "turn")
          call check_that(error, max(abs(maps(k, i, f + i) * w - sine), abs(maps(k, f + i, i) / w + sine)), "<", turn, "turn")
          if (allocated(error)) return
          ! The load 1 shifts the middle of the oscillation to 1 / w^2.
          shift = 1 / w**2
          call check_that(error, abs(maps(k, i, 2 * f + 1) - shift * (1 - cosine)), "<", turn * shift, "load")
          call check_that(error, abs(maps(k, f + i, 2 * f + 1) / w - shift * sine), "<", turn * shift, "load")
          if (allocated(error)) return
        end associate
      end do
      call check_that(error, count(abs(maps(k, :, :2 * f)) > 0), "<=", 4 * f, "oscillators act on each other")
      if (allocated(error)) return
    end do
  end subroutine check_oscillators

  !> A step of length 1 of q'' + z^2 q = 1 by Galerkin's method with q'' a sum of Legendre's first `terms` polynomials, whose
  !> residual is orthogonal to them by Gauss' quadrature of s nodes, integrals taken by the tableau that is fitted to a turn by
  !> `fitted`: [A b].
  subroutine galerkin_step(s, terms, z, fitted, map)
    integer, intent(in) :: s, terms
    real(dp), intent(in) :: z, fitted
    real(dp), intent(out) :: map(2, 3)
    type(tableau_type) :: rule
    type(gestell_error), allocatable :: failure
    real(dp) :: p(s, terms), left(terms, terms), right(terms, 3)
    integer :: pivots(terms)

    rule = gauss_tableau(s)
    call rule%fit(fitted)
    call find_legendre(terms - 1, 2 * rule%c - 1, p)
    left = matmul(transpose(p * spread(rule%b, 2, terms)), p + z**2 * matmul(rule%aa, p))
    right(:, 1) = -z**2 * matmul(rule%b, p)
    right(:, 2) = -z**2 * matmul(rule%b * rule%c, p)
    right(:, 3) = matmul(rule%b, p)
    call factorise(left, pivots, failure)
    call solve_factored(left, pivots, right)
    map = reshape([1, 0, 1, 1, 0, 0], [2, 3])
    map(1, :) = map(1, :) + matmul(matmul(rule%ba, p), right)
    map(2, :) = map(2, :) + matmul(matmul(rule%b, p), right)
  end subroutine galerkin_step

  !> cosine + i sine = R(i z) = exp(2 i atan(t(z))): tan(z / 2) is z / 2 over Lambert's continued fraction 1 - x_1 / (1 - x_2 /
  !> ...) with x_k = z^2 / (4 (4 k^2 - 1)), which a method of s stages has to x_s-1, and x_s-1 over the rest of the fraction for
  !> `fitted`: this is what x_s-1 has to be for R(i fitted) = exp(i fitted).
  subroutine gauss_turn(s, z, fitted, cosine, sine)
    integer, intent(in) :: s
    real(dp), intent(in) :: z, fitted
    real(dp), intent(out) :: cosine, sine
    real(qp) :: fraction, t
    integer :: k

    ! From the front: what the fraction of tan(fitted / 2) leaves for the last term.
    fraction = real(fitted, qp) / 2 / tan(real(fitted, qp) / 2)
    do k = 1, s - 2
      fraction = term(k, fitted) / (1 - fraction)
    end do
    fraction = 1 - (1 - fraction) / term(s - 1, fitted) * term(s - 1, z)
    do k = s - 2, 1, -1
      fraction = 1 - term(k, z) / fraction
    end do
    t = real(z, qp) / 2 / fraction
    cosine = real((1 - t**2) / (1 + t**2), dp)
    sine = real(2 * t / (1 + t**2), dp)

  contains

    pure real(qp) function term(k, z)
      integer, intent(in) :: k
      real(dp), intent(in) :: z

      term = real(z, qp)**2 / (4 * (4 * real(k, qp)**2 - 1))
    end function term

  end subroutine gauss_turn

  subroutine matrices(self, t, m, b, c)
    class(oscillators_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    associate (unused => t)
    end associate
    m = self%m
    b = 0
    c = self%c
  end subroutine matrices

  subroutine load(self, t, h)
    class(oscillators_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    associate (unused => t)
    end associate
    h = self%h
  end subroutine load

end module test_lanes
