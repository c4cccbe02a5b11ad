!> The error of a followed periodic motion over the whole turn, from a second one whose steps are half as long.
!>
!> The turn is followed in segments, each from its own start x_k. From the same starts with half the steps the motion comes to
!> y(t) = x(t) + l(t); at the ends it misses the next start by d_k. The periodic motion of the shorter steps is
!>
!>     x^(t) = y(t) + Phi(t, t_k) z_k,   z_{k+1} = A_k z_k + d_k,   z_{K+1} = z_1,
!>
!> A_k the maps of the segments. So local errors are seen where they arise, however fast they die out, and with their signs. A
!> method of order p leaves 2^-p of x^ - x in x^. Equal steps owe much to the period, which unequal ones do not have: between
!> equidistant phases all are equal, and what the starts miss is found with half the steps of their own mesh.
!>
!> A motion that is followed from the same starts with more steps, for more phases, has the same part of x^ - x that is due to the
!> starts, and less of the local errors: it lies between x and a motion that has none of them. Bounds hold for both ends.
module gestell_floquet_period_turn_errors
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: inverse
  use gestell_math_matrix, only: balanced, unit_matrix
  use gestell_floquet_period_convergence, only: safety
  use gestell_floquet_period_period_map, only: block_length, end_of_block
  use gestell_floquet_integrator_mesh, only: merged, refined
  use gestell_floquet_integrator_method, only: method_type
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: close_turn, compare, relative_rounding, rounding_errors, take_differences

  !> The error of n quantities: at a phase some part, between -1 and 1, of the differences there, shape (n, 2 * phases), the safety
  !> included: of the motion that was compared, then of one whose steps are much shorter; and at any time rounding beside it,
  !> shape (n).
  type, public :: turn_errors_type
    real(dp), allocatable :: differences(:, :), rounding(:)
  contains
    procedure :: bounds
    procedure :: along
  end type turn_errors_type

  !> At the phases l(t), shape (n, phases), Phi(t, t_k), shape (n, n, phases), and the segment; A_k, shape (n, n, K), the defects
  !> d_k, shape (n, K), and the greatest |x|, in balanced units, within each segment, shape (K).
  type, public :: comparison_type
    real(dp), allocatable :: local(:, :), transition(:, :, :), map(:, :, :), defect(:, :), size(:)
    integer, allocatable :: segment(:)
    !> Steps of the motion that was followed.
    integer :: steps = 0
  end type comparison_type

contains

  !> A bound on the error of the sum of the first quantities with these weights that holds at all times.
  pure real(dp) function along(self, weights)
    class(turn_errors_type), intent(in) :: self
    real(dp), intent(in) :: weights(:)
    integer :: n

    n = size(weights)
    along = dot_product(abs(weights), self%rounding(:n))
    if (size(self%differences, 2) > 0) along = along + maxval(abs(matmul(weights, self%differences(:n, :))))
  end function along

  !> Bounds on the error of each quantity that hold at all times, shape (n).
  pure function bounds(self)
    class(turn_errors_type), intent(in) :: self
    real(dp) :: bounds(size(self%rounding))

    bounds = self%rounding
    if (size(self%differences, 2) > 0) bounds = bounds + maxval(abs(self%differences), dim=2)
  end function bounds

  !> The motion x at `phases`, shape (n, phases), the last one 1, that was followed with steps between `nodes`, the phases and the
  !> `ends` of the segments, shape (0:K), each from its start, shape (n, K), beside one with half the steps. Error: overflow.
  subroutine compare(system, method, nodes, scale, ends, starts, phases, x, comparison, error)
    class(periodic_system), intent(in) :: system
    class(method_type), intent(in) :: method
    real(dp), intent(in) :: nodes(:), scale(:), ends(0:), starts(:, :), phases(:), x(:, :)
    type(comparison_type), intent(out) :: comparison
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: maps(:, :, :), half(:)
    real(dp) :: now(size(x, 1), size(x, 1) + 1)
    integer :: n, count, k, first, last, next, segment

    n = size(x, 1)
    count = size(starts, 2)
    half = refined(system, nodes, merged(phases, ends))
    comparison%steps = size(half) - 1
    half = merged(half, (half(:size(half) - 1) + half(2:)) / 2)
    allocate(comparison%local(n, size(phases)), comparison%transition(n, n, size(phases)), comparison%map(n, n, count))
    allocate(comparison%defect(n, count), comparison%size(count), source=0.0_dp)
    allocate(comparison%segment(size(phases)))
    allocate(maps(block_length, n, n + 1))
    segment = 0
    next = 1
    call start_segment()
    call keep(half(1))
    last = 0
    do while (last < size(half) - 1)
      first = last + 1
      last = end_of_block(first, size(half) - 1)
      associate (from => half(first:last), to => half(first + 1:last + 1))
        call method%maps(system, from, to, maps, error)
        if (allocated(error)) return
        do k = 1, size(from)
          now = matmul(maps(k, :, :n), now)
          now(:, n + 1) = now(:, n + 1) + maps(k, :, n + 1)
          comparison%size(segment) = max(comparison%size(segment), norm2(now(:, n + 1) / scale))
          if (to(k) >= ends(segment)) then
            comparison%map(:, :, segment) = now(:, :n)
            comparison%defect(:, segment) = now(:, n + 1) - starts(:, modulo(segment, count) + 1)
            if (segment < count) call start_segment()
          end if
          call keep(to(k))
        end do
      end associate
    end do
    if (all(ieee_is_finite(comparison%local)) .and. all(ieee_is_finite(comparison%transition))) return
    call fatal_error(error, "the motion leaves the range of the numbers", failed_computation)

  contains

    subroutine start_segment()
      segment = segment + 1
      now(:, :n) = unit_matrix(n)
      now(:, n + 1) = starts(:, segment)
      comparison%size(segment) = norm2(starts(:, segment) / scale)
    end subroutine start_segment

    subroutine keep(phase)
      real(dp), intent(in) :: phase

      do while (next <= size(phases))
        if (phases(next) > phase) return
        comparison%local(:, next) = now(:, n + 1) - x(:, next)
        comparison%transition(:, :, next) = now(:, :n)
        comparison%segment(next) = segment
        next = next + 1
      end do
    end subroutine keep

  end subroutine compare

  !> The z at the starts of few segments, shape (n, K), and what of it is due to z_1: (E - Phi) z_1 is what the motion from x_1
  !> misses at the end of `turn`, one segment; `inverted`: the inverse of that matrix in balanced units. Error: it is singular.
  subroutine close_turn(turn, comparison, scale, z, due, inverted, error)
    type(comparison_type), intent(in) :: turn, comparison
    real(dp), intent(in) :: scale(:)
    real(dp), intent(out) :: z(:, :), due(:, :)
    real(dp), allocatable, intent(out) :: inverted(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: k

    call inverse(unit_matrix(size(scale)) - balanced(turn%map(:, :, 1), scale), inverted, error)
    if (allocated(error)) return
    z(:, 1) = matmul(inverted, turn%defect(:, 1) / scale) * scale
    due(:, 1) = z(:, 1)
    do k = 1, size(z, 2) - 1
      z(:, k + 1) = matmul(comparison%map(:, :, k), z(:, k)) + comparison%defect(:, k)
      due(:, k + 1) = matmul(comparison%map(:, :, k), due(:, k))
    end do
  end subroutine close_turn

  !> The differences, from what the starts are moved by, z, and from what of that is due to the starts of a motion that is followed,
  !> `due`, shape (n, K); and what roundings at the starts, shape (n, K), and `own` ones within
  !> each segment, shape (K), both in balanced units, come to.
  pure subroutine take_differences(comparison, scale, z, due, at_starts, own, errors)
    type(comparison_type), intent(in) :: comparison
    real(dp), intent(in) :: scale(:), z(:, :), due(:, :), at_starts(:, :), own(:)
    type(turn_errors_type), intent(out) :: errors
    integer :: phases, k

    phases = size(comparison%segment)
    allocate(errors%differences(size(scale), 2 * phases))
    allocate(errors%rounding(size(scale)), source=0.0_dp)
    do k = 1, phases
      associate (segment => comparison%segment(k))
        errors%differences(:, k) = safety * (comparison%local(:, k) + matmul(comparison%transition(:, :, k), z(:, segment)))
        errors%differences(:, phases + k) = safety * matmul(comparison%transition(:, :, k), due(:, segment))
        errors%rounding = max(errors%rounding, matmul(abs(comparison%transition(:, :, k)), &
          & (at_starts(:, segment) + own(segment)) * scale))
      end associate
    end do
  end subroutine take_differences

  !> Roundings over a turn relative to the motion: of n numbers in every step, for nearly constant coefficients all with the same
  !> sign, of the phase of the fastest motion, and the model's own.
  pure real(dp) function relative_rounding(system, steps, phase_advance) result(rounding)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: steps
    real(dp), intent(in) :: phase_advance

    rounding = epsilon(1.0_dp) * (system%states * steps + 2 * phase_advance) + system%rounding
  end function relative_rounding

  !> What roundings `own` within each of few segments, shape (K), in balanced units, come to at
  !> the starts, shape (n, K): each reaches t_i through the Green's function of the periodic motion,
  !>
  !>     G(t_i, t_j) = Phi(t_i, t_j) [t_i > t_j] + Phi(t_i, 0) (E - Phi(T))^-1 Phi(T, t_j).
  pure function rounding_errors(comparison, scale, inverted, own) result(at_starts)
    type(comparison_type), intent(in) :: comparison
    real(dp), intent(in) :: scale(:), inverted(:, :), own(:)
    real(dp) :: at_starts(size(scale), size(own))
    real(dp), dimension(size(scale), size(scale), size(own)) :: a, to_start, to_end
    real(dp), dimension(size(scale), size(scale)) :: green, direct
    integer :: count, i, j

    count = size(own)
    do i = 1, count
      a(:, :, i) = balanced(comparison%map(:, :, i), scale)
    end do
    ! Phi(t_i, 0) (E - Phi)^-1, and Phi(T, t_{j+1}).
    to_start(:, :, 1) = inverted
    to_end(:, :, count) = unit_matrix(size(scale))
    do i = 2, count
      to_start(:, :, i) = matmul(a(:, :, i - 1), to_start(:, :, i - 1))
      to_end(:, :, count + 1 - i) = matmul(to_end(:, :, count + 2 - i), a(:, :, count + 2 - i))
    end do
    at_starts = 0
    do j = 1, count
      direct = unit_matrix(size(scale))
      do i = 1, count
        green = matmul(to_start(:, :, i), to_end(:, :, j))
        if (i > j) green = green + direct
        if (i > j) direct = matmul(a(:, :, i), direct)
        at_starts(:, i) = at_starts(:, i) + norm2(green, dim=2) * own(j)
      end do
    end do
  end function rounding_errors

end module gestell_floquet_period_turn_errors
