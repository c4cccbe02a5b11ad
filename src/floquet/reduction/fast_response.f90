!> Computes the forced motion of the fast groups of gestell_floquet_reduction at all phases together, in real form.
module gestell_floquet_reduction_fast_response
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_floquet_reduction_conjugates, only: add_coordinate, coordinate, divide, entry
  use gestell_floquet_reduction_decoupling, only: max_rounds, motion_type
  use gestell_floquet_reduction_equations, only: equations_type, means
  use gestell_floquet_reduction_modes, only: columns_of, modes_type
  use gestell_floquet_reduction_phasewise, only: multiply, solve, times
  use gestell_floquet_reduction_trigonometric, only: differentiation
  implicit none (type, external)
  private

  public :: decouple_forcing, fast_sizes

contains

  !> Computes the response p = S z of the fast groups to the loads, after the groups have been decoupled. Here z contains the
  !> coordinates of the fast groups. The remainder
  !>
  !>     g = D z + S^-1 f - z'
  !>
  !> is made small by repeatedly adding to z_g, the coordinates of group g, the solution of D_g z_g = -g_g. The iteration stops
  !> when the remainder, relative to its terms, is at most `enough` or no longer falls. Fails if a group has the eigenvalue zero
  !> or a number overflows.
  subroutine decouple_forcing(f, modes, enough, s, motion, p, g, error)
    !> `f`: loads T f at the phases, shape (phases, n). `s`: matrix S of the modes at the phases, shape (phases, n, n).
    real(dp), contiguous, intent(in) :: f(:, :), s(:, :, :)
    type(modes_type), intent(in) :: modes
    !> The iteration ends when the remainder g, relative to its terms, is at most this value
    real(dp), intent(in) :: enough
    !> D and S^-1 at the phases; D is the matrix of the decoupled equations
    type(motion_type), intent(in) :: motion
    !> `p`: response at the phases. `g`: remainder at the phases. Shapes (phases, n).
    real(dp), contiguous, intent(out) :: p(:, :), g(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), dimension(size(f, 1), size(f, 2)) :: load, z, change, best, slope, tried
    real(dp) :: derivative(size(f, 1), size(f, 1)), size_d, size_f, rest, left
    logical :: done
    integer :: round, number

    derivative = differentiation(size(f, 1))
    call multiply(motion%inverted, f, load)
    size_d = maxval(abs(motion%d))
    size_f = maxval(abs(load))
    z = 0
    best = 0
    left = huge(left)
    do round = 1, max_rounds
      call multiply(motion%d, z, tried)
      call times(derivative, z, slope)
      tried = tried + load - slope
      rest = size_d * maxval(fast_sizes(tried, modes)) / max(size_f + size_d * maxval(abs(z)), tiny(1.0_dp))
      if (.not. rest < left) exit
      best = z
      g = tried
      done = rest <= enough .or. rest >= 0.5_dp * left
      left = rest
      if (done) exit
      change = 0
      do number = 1, size(modes%group)
        associate (own => columns_of(modes%group, number))
          if (size(own) > 0) call respond(motion%d, g, modes%conjugate, own, change, error)
          if (allocated(error)) return
        end associate
      end do
      z = z + change
    end do
    if (left >= huge(left)) then
      call fatal_error(error, "the forcing overflows double precision", failed_computation)
      return
    end if
    call multiply(s, best, p)
  end subroutine decouple_forcing

  !> Solves D_g z_g = -g_g for the coordinates z_g of the group whose columns are `own`, and adds the solution to `z`. Fails if
  !> the group has the eigenvalue zero.
  subroutine respond(d, g, conjugate, own, z, error)
    real(dp), contiguous, intent(in) :: d(:, :, :), g(:, :)
    integer, intent(in) :: conjugate(:), own(:)
    real(dp), contiguous, intent(inout) :: z(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(equations_type) :: equations
    real(dp), dimension(size(d, 1)) :: re, im, a, b
    integer :: m, i, k

    if (all(own > conjugate(own))) return
    m = size(own)
    if (m == 1) then
      call coordinate(g, conjugate, own(1), re, im)
      call entry(d, conjugate, own(1), own(1), a, b)
      call divide(a, b, re, im, error)
      if (.not. allocated(error)) call add_coordinate(-re, -im, conjugate, own(1), z)
      return
    end if
    allocate(equations%re(size(d, 1)), equations%im(size(d, 1)))
    call means(d, conjugate, own, equations%re, equations%im)
    call equations%start(m)
    do i = 1, m
      do k = 1, m
        call entry(d, conjugate, own(i), own(k), re, im)
        call equations%add(re, im, i, k)
      end do
      call coordinate(g, conjugate, own(i), re, im)
      call equations%set_right(-re, -im, i)
    end do
    call solve(equations%matrix, equations%x, error)
    if (allocated(error)) return
    do i = 1, m
      if (own(i) > conjugate(own(i))) cycle
      call add_coordinate(equations%x(:, i), equations%x(:, m + i), conjugate, own(i), z)
    end do
  end subroutine respond

  !> Maximum of the remainder |g| over all elements outside the slow group, at each phase.
  pure function fast_sizes(g, modes) result(sizes)
    real(dp), contiguous, intent(in) :: g(:, :)
    type(modes_type), intent(in) :: modes
    real(dp), dimension(size(g, 1)) :: sizes, re, im
    integer :: k

    sizes = 0
    do k = 1, size(g, 2)
      if (k > modes%conjugate(k) .or. modes%group(k) == 0) cycle
      call coordinate(g, modes%conjugate, k, re, im)
      sizes = max(sizes, sqrt(re**2 + im**2))
    end do
  end function fast_sizes

end module gestell_floquet_reduction_fast_response
