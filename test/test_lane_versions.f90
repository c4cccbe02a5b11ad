!> Versions of the inner loops for processors with longer vector registers than a portable program assumes.
module test_lane_versions
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_base_processor, only: has_long_vectors, has_versions, vector_length
  use gestell_math_lanes_six, only: divide_six, reduce_six, subtract_six
  use gestell_math_lanes_versions, only: block, four_columns, lanes, solve_with_lower, solve_with_upper, subtract_column, &
    & subtract_product, width
  use gestell_math_batch_characteristic_roots, only: find_roots, guess_roots
  use gestell_math_batch_hessenberg, only: hessenberg_type, max_states, new_hessenberg
  use gestell_math_lanes, only: vector_border
  use gestell_math_lanes_products, only: multiply
  use gestell_math_lapack, only: eigensystem
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_methods, only: new_method
  use gestell_floquet_multipliers_gershgorin, only: discs_type, find_discs
  use gestell_floquet_period_period_map, only: period_map, period_map_type
  use gestell_model_frame, only: frame_type
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine
  use space_machines, only: three_planes
  use testdrive, only: error_type, new_unittest, unittest_type
  use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t, c_loc
  implicit none (type, external)
  private

  public :: collect_lane_versions

  !> Lengths of vectors, none first.
  integer, parameter :: lengths(3) = [0, 4, 8]

  !> The state that gestell_base_processor reads. A test may hide abilities of the processor, and restores them afterwards.
  integer(c_int), bind(C, name="__cpu_model") :: cpu_model(4)
  integer, parameter :: avx2 = 10, avx512f = 15

contains

  subroutine collect_lane_versions(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("block elimination yields the same on vector registers of every length", test_blocks), &
      & new_unittest("eliminating six columns at once agrees with plain matrix products", test_six), &
      & new_unittest("sums agree on vector registers of every length", test_sums), &
      & new_unittest("products and eigenvalues agree on vector registers of every length", test_spectra), &
      & new_unittest("the map of a period agrees on vector registers of every length", test_period), &
      & new_unittest("aligned work space begins at a multiple of 64 bytes", test_border)]
  end subroutine collect_lane_versions

  !> Numbers of size 1 with both signs.
  pure function numbers(n, step)
    integer, intent(in) :: n
    real(dp), intent(in) :: step
    real(dp) :: numbers(n)
    integer :: i

    numbers = [(sin(step * i), i = 1, n)]
  end function numbers

  !> C - R S, L^-1 W and W U^-1 for three columns of a panel against the compiler's own products, lane by lane, on this
  !> processor; the other columns do not change.
  subroutine test_blocks(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: terms = 20
    real(dp), dimension(lanes, width, block) :: c, before, u
    real(dp), dimension(lanes, block, block) :: l
    real(dp) :: r(lanes, block, terms), s(lanes, width, terms), multiplier(lanes)
    integer :: k, lane

    before = reshape(numbers(size(c), 1.3_dp), shape(c))
    r = reshape(numbers(size(r), 2.1_dp), shape(r))
    s = reshape(numbers(size(s), 3.7_dp), shape(s))
    u = reshape(numbers(size(u), 4.3_dp), shape(u))
    do k = 1, size(lengths)
      if (lengths(k) > vector_length()) cycle
      c = before
      call subtract_product(lengths(k), terms, c, r, s)
      do lane = 1, lanes
        ! Roundings of twenty terms below 1.
        call check_that(error, maxval(abs(three(c, lane) - (three(before, lane) - matmul(r(lane, :, :), &
          & transpose(s(lane, :block, :)))))), "<", 2.0e-14_dp, "C - R S")
      end do
      call check_that(error, maxval(abs(c(:, block + 1:, :) - before(:, block + 1:, :))), "<=", 0.0_dp, &
        & "other columns of the block")
      if (allocated(error)) return

      c(:, 1, :) = before(:, 1, :)
      call subtract_column(lengths(k), terms, c, r, s)
      do lane = 1, lanes
        call check_that(error, maxval(abs(c(lane, 1, :) - (before(lane, 1, :) - matmul(r(lane, :, :), s(lane, 1, :))))), "<", &
          & 2.0e-14_dp, "c - R s")
      end do
      call check_that(error, maxval(abs(c(:, block + 1:, :) - before(:, block + 1:, :))), "<=", 0.0_dp, "other columns")
      if (allocated(error)) return

      c = before
      call solve_with_lower(lengths(k), c, r)
      do lane = 1, lanes
        call check_that(error, maxval(abs(matmul(unit_lower(r(lane, :, :block)), three(c, lane)) - three(before, lane))), "<", &
          & 1.0e-14_dp, "L^-1 W")
        if (allocated(error)) return
      end do
      call check_that(error, maxval(abs(c(:, block + 1:, :) - before(:, block + 1:, :))), "<=", 0.0_dp, &
        & "other columns of the block")
      if (allocated(error)) return

      multiplier = 0.5_dp
      call solve_with_upper(lengths(k), before, u, l, multiplier)
      do lane = 1, lanes
        ! Of a diagonal as great as 1 / 0.01.
        call check_that(error, maxval(abs(matmul(l(lane, :, :), upper(three(u, lane))) - three(before, lane))), "<", 1.0e-12_dp, &
          & "W U^-1")
        call check_that(error, abs(multiplier(lane) - max(0.5_dp, maxval(abs(l(lane, :, :))))), "<=", 0.0_dp, "multiplier")
        if (allocated(error)) return
      end do
    end do
    ! A build that can have versions for such a processor must have them.
    if (.not. has_versions) call check_that(error, vector_length(), "==", 0, "no versions")
  end subroutine test_blocks

  !> The same check for six columns, if there are enough registers; builds without versions have them for every processor.
  subroutine test_six(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: terms = 21
    real(dp), dimension(lanes, width, block) :: c, before
    real(dp) :: r(lanes, block, terms), s(lanes, width, terms), u(lanes, width, width), l(lanes, block, width), multiplier(lanes)
    real(dp) :: product(block, width)
    integer :: lane

    if (has_versions .and. .not. has_long_vectors()) return
    before = reshape(numbers(size(c), 1.3_dp), shape(c))
    r = reshape(numbers(size(r), 2.1_dp), shape(r))
    s = reshape(numbers(size(s), 3.7_dp), shape(s))
    u = reshape(numbers(size(u), 4.3_dp), shape(u))
    c = before
    call subtract_six(terms, c, r, s)
    do lane = 1, lanes
      product = transpose(before(lane, :, :)) - matmul(r(lane, :, :), transpose(s(lane, :, :)))
      call check_that(error, maxval(abs(transpose(c(lane, :, :)) - product)), "<", 2.0e-14_dp, "C - R S")
    end do
    if (allocated(error)) return

    c = before
    call reduce_six(terms, c, r, s, r(1, 1, terms - block + 1))
    multiplier = 0.5_dp
    call divide_six(terms, before, r, s, u, l, multiplier)
    do lane = 1, lanes
      product = transpose(before(lane, :, :)) - matmul(r(lane, :, :), transpose(s(lane, :, :)))
      call check_that(error, maxval(abs(matmul(unit_lower(r(lane, :, terms - block + 1:)), transpose(c(lane, :, :))) - product)), &
        & "<", 4.0e-14_dp, "L^-1 (C - R S)")
      ! Six unknowns after each other, divided by diagonals as small as 0.01: errors are relative to the size of L.
      call check_that(error, maxval(abs(matmul(l(lane, :, :), upper(transpose(u(lane, :, :)))) - product)), "<", &
        & 1.0e-14_dp * maxval(abs(l(lane, :, :))) * maxval(abs(upper(transpose(u(lane, :, :))))), "(C - R S) U^-1")
      call check_that(error, abs(multiplier(lane) - max(0.5_dp, maxval(abs(l(lane, :, :))))), "<=", 0.0_dp, "multiplier")
      if (allocated(error)) return
    end do
  end subroutine test_six

  !> Three columns of a panel's three rows, in one lane, as a matrix.
  pure function three(panel, lane) result(matrix)
    real(dp), intent(in) :: panel(lanes, width, block)
    integer, intent(in) :: lane
    real(dp) :: matrix(block, block)

    matrix = transpose(panel(lane, :block, :))
  end function three

  !> The lower triangle that is used, with ones on the diagonal.
  pure function unit_lower(matrix) result(l)
    real(dp), intent(in) :: matrix(:, :)
    real(dp) :: l(size(matrix, 1), size(matrix, 1))
    integer :: i

    l = matrix
    do i = 1, size(l, 1)
      l(i, i:) = 0
      l(i, i) = 1
    end do
  end function unit_lower

  !> The upper triangle that is used, with the reciprocals of its diagonal.
  pure function upper(matrix) result(u)
    real(dp), intent(in) :: matrix(:, :)
    real(dp) :: u(size(matrix, 1), size(matrix, 1))
    integer :: i

    u = matrix
    do i = 1, size(u, 1)
      u(i, :i - 1) = 0
      u(i, i) = 1 / u(i, i)
    end do
  end function upper

  subroutine test_sums(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: terms = 33
    real(dp) :: a(lanes, terms), b(terms, 4), c(lanes, 4)
    integer :: k

    a = reshape(numbers(size(a), 1.9_dp), shape(a))
    b = reshape(numbers(size(b), 2.3_dp), shape(b))
    do k = 1, size(lengths)
      if (lengths(k) > vector_length()) cycle
      c = 0
      call four_columns(lengths(k), terms, a, b, c)
      ! Roundings of 33 terms below 1.
      call check_that(error, maxval(abs(c - matmul(a, b))), "<", 4.0e-14_dp, "A B")
    end do
  end subroutine test_sums

  !> Matrices far from symmetric, their products and eigenvalues lane by lane against the compiler's and LAPACK's own.
  subroutine test_spectra(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 6
    real(dp), parameter :: perturbation(lanes) = 1.0e-12_dp
    real(dp) :: rows(lanes, n, n), b(lanes, n, n), c(lanes, n, n), a(lanes, max_states, max_states), converged(lanes)
    real(dp), dimension(lanes, max_states) :: z_re, z_im
    type(discs_type) :: discs, portable
    complex(dp) :: found(n)
    complex(dp), allocatable :: known(:), right(:, :), left(:, :)
    logical :: conjugate(max_states)
    type(hessenberg_type) :: h
    type(gestell_error), allocatable :: failure
    integer :: k, i, lane

    ! Of sines of equal steps all matrices would have rank two.
    rows = reshape([(sin(0.37_dp * i**2), i = 1, size(rows))], shape(rows))
    b = reshape(numbers(size(b), 2.9_dp), shape(b))
    do k = 1, size(lengths)
      if (lengths(k) > vector_length()) cycle
      call multiply(lengths(k), n, n, 2.0_dp, rows, b, c)
      a = 0
      a(:, :n, :n) = rows
      call new_hessenberg(lengths(k), a, n, h)
      call guess_roots(lengths(k), h, z_re, z_im, conjugate, converged)
      converged = 0
      call find_roots(lengths(k), h, conjugate, z_re, z_im, converged)
      call find_discs(lengths(k), h, conjugate, perturbation, z_re, z_im, discs)
      if (k == 1) then
        ! With the plain loops: discs are separate in some lanes at least, otherwise there is nothing to compare.
        portable = discs
        call check_that(error, sum(portable%separate), ">", 2.0_dp, "lanes with discs")
        if (allocated(error)) return
      end if
      call check_that(error, abs(discs%separate - portable%separate), "<=", 0.0_dp, "separate")
      do lane = 1, lanes
        if (.not. portable%separate(lane) > 0) cycle
        ! Discs of 1e-12 times conditions, and roundings of 1e-15 of them in the residuals.
        call check_that(error, abs(discs%radius(lane, :n) / portable%radius(lane, :n) - 1), "<", 0.05_dp, "discs")
        if (allocated(error)) return
      end do
      do lane = 1, lanes
        ! Roundings of six terms below 2.
        call check_that(error, maxval(abs(c(lane, :, :) - 2 * matmul(transpose(rows(lane, :, :)), b(lane, :, :)))), "<", &
          & 1.0e-14_dp, "A B")
        call check_that(error, converged(lane), ">", 0.0_dp, "converged")
        if (allocated(error)) return
        call eigensystem(rows(lane, :, :), known, right, left, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        found = cmplx(z_re(lane, :n), z_im(lane, :n), dp)
        do i = 1, n
          ! Roundings of a matrix of norm 4 by condition numbers of ten and more.
          call check_that(error, minval(abs(found - known(i))), "<", 1.0e-12_dp, "eigenvalue")
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_spectra

  !> Phi(T) and x_p(T) of a frame in the plane and of one in space, and those of the embedded methods, as a processor without
  !> long vectors computes them, as with vectors of four numbers, and with vectors of eight.
  subroutine test_period(error)
    type(error_type), allocatable, intent(out) :: error
    integer(c_int) :: own
    integer :: k

    own = cpu_model(4)
    do k = 1, 2
      if (.not. allocated(error)) call compare_periods(k == 2, error)
      cpu_model(4) = own
    end do
  end subroutine test_period

  subroutine compare_periods(in_space, error)
    logical, intent(in) :: in_space
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    type(period_map_type) :: lower(2)
    real(dp), allocatable :: phi(:, :), xp(:), ones(:), found(:), portable(:)
    integer(c_int) :: own
    integer :: k

    own = cpu_model(4)
    do k = 1, size(lengths)
      cpu_model(4) = own
      if (lengths(k) < 8) cpu_model(4) = ibclr(cpu_model(4), avx512f)
      if (lengths(k) < 4) cpu_model(4) = ibclr(cpu_model(4), avx2)
      call check_that(error, vector_length(), "<=", lengths(k), "registers taken away")
      if (in_space) call three_planes(44.0_dp, 1.0_dp, frame, failure)
      if (.not. in_space) call frame_of_machine(khang_machine(240.0_dp), frame, failure)
      if (.not. allocated(failure)) call new_method("gauss7", method, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      if (k == 1) then
        allocate(phi(frame%states, frame%states), xp(frame%states), ones(frame%states))
        ones = 1
      end if
      call period_map(frame, method, mesh(frame, 24), ones, phi, failure, xp, lower=lower)
      call check_success(error, failure)
      if (allocated(error)) return
      found = [phi, xp / norm2(xp), lower(1)%phi, lower(1)%xp / norm2(xp), lower(2)%phi, lower(2)%xp / norm2(xp)]
      if (k == 1) portable = found
      ! Roundings of 24 steps with 21 to 42 unknowns each, in numbers of the size of Phi.
      call check_that(error, maxval(abs(found - portable)), "<", 1.0e-11_dp * maxval(abs(portable)), "against the portable version")
      if (allocated(error)) return
    end do
  end subroutine compare_periods

  !> Wherever an array begins, the returned index is one of the first eight and its address is a multiple of 64 bytes.
  subroutine test_border(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), target :: room(40)
    integer :: from, border

    room = 0
    do from = 1, 9
      border = vector_border(room(from:))
      call check_that(error, border, ">", 0, "first number")
      call check_that(error, border, "<=", lanes, "one of the first")
      call check_that(error, int(modulo(transfer(c_loc(room(from + border - 1)), 0_c_intptr_t), 64_c_intptr_t)), "==", 0, "address")
      if (allocated(error)) return
    end do
  end subroutine test_border

end module test_lane_versions
