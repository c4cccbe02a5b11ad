!> The averaged model of a mechanical system with periodic coefficients. M, B, C are replaced by their means over the period; the
!> load h(t) is not averaged:
!>
!>     <M> q'' + <B> q' + <C> q = h(t).
module gestell_system_averaged
  use gestell_base_kinds, only: dp, pi
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: average, term_size

  type, extends(second_order_system), public :: averaged_system
    !> Means of M, B, C, and bounds on the errors of their elements; each of shape (f, f)
    real(dp), allocatable, dimension(:, :) :: m, b, c, m_error, b_error, c_error
    !> Number of samples of the coefficients in the period
    integer :: evaluations = 0
    !> The system with periodic coefficients, which provides the load
    class(second_order_system), allocatable :: whole
  contains
    procedure :: matrices, load, sample_second_order, conserves
  end type averaged_system

  !> Safety factor: an error bound is this factor times the error estimate.
  real(dp), parameter :: safety = 4
  !> `max_points`: maximum number of samples. `block_length`: number of samples taken in one call
  integer, parameter :: max_points = 2**18, block_length = 1024

contains

  !> Computes the averaged model of `system` with bounds on the errors of the means.
  !>
  !> The means are computed by the trapezoidal rule. The number of points is doubled until two successive doublings change the
  !> means only by rounding errors. For smooth coefficients the error falls faster than any power of the number of points. If a
  !> coefficient jumps, N points have an error of up to the jump / N. One jump is counted for each break, and one for the end of
  !> the period.
  subroutine average(system, averaged)
    class(second_order_system), intent(in) :: system
    type(averaged_system), intent(out) :: averaged
    real(dp), allocatable, dimension(:, :, :) :: mean, magnitude, range, before, change, change_before, terms
    integer :: f, k, points

    f = system%states / 2
    averaged%states = system%states
    call averaged%inherit(system)
    allocate(averaged%whole, source=system)

    points = max(16, 2 * system%least_steps)
    allocate(mean(f, f, 3), magnitude(f, f, 3), range(f, f, 3), terms(f, f, 3))
    call means(system, points, 0.0_dp, mean, magnitude, range)
    averaged%evaluations = points
    allocate(change(f, f, 3), source=magnitude)
    do
      change_before = change
      before = mean
      call means(system, points, 0.5_dp, mean, magnitude, range)
      mean = (mean + before) / 2
      change = abs(mean - before)
      points = 2 * points
      averaged%evaluations = points
      if (allocated(system%breaks)) change = max(change, (size(system%breaks) + 1) * range / points)
      ! Moving masses contribute terms to M, B and C that may cancel, as in a balanced engine. Only rounding remains then, which
      ! does not converge.
      do k = 1, 3
        terms(:, :, k) = (2 * pi / system%period)**(k - 1) * term_size(mean(:, :, 1))
      end do
      if (all(max(change, change_before) <= 4 * system%rounding * max(magnitude, terms)) .or. 2 * points > max_points) exit
    end do
    change = safety * max(change, change_before / 2) + (system%rounding + epsilon(1.0_dp)) * magnitude
    averaged%m = mean(:, :, 1)
    averaged%b = mean(:, :, 2)
    averaged%c = mean(:, :, 3)
    averaged%m_error = change(:, :, 1)
    averaged%b_error = change(:, :, 2)
    averaged%c_error = change(:, :, 3)
  end subroutine average

  !> Bound on the size of the terms whose sum is an element of `a`: the larger of |a_ik| and sqrt(a_ii a_kk). Terms of masses and
  !> springs do not exceed this bound even where they cancel.
  pure function term_size(a) result(size_of)
    real(dp), intent(in) :: a(:, :)
    real(dp) :: size_of(size(a, 1), size(a, 2)), root(size(a, 1))
    integer :: i

    root = [(sqrt(abs(a(i, i))), i = 1, size(a, 1))]
    size_of = max(abs(a), spread(root, 1, size(root)) * spread(root, 2, size(root)))
  end function term_size

  !> Samples M, B and C at equidistant points. Computes the means of their elements, the means of the moduli, and bounds on the
  !> difference between maximum and minimum of each element; shapes (f, f, 3). The first point is at `shift` times the spacing of
  !> the points.
  subroutine means(system, points, shift, mean, magnitude, range)
    class(second_order_system), intent(in) :: system
    integer, intent(in) :: points
    real(dp), intent(in) :: shift
    real(dp), intent(out) :: mean(:, :, :), magnitude(:, :, :), range(:, :, :)
    real(dp), allocatable :: samples(:, :, :, :), start(:, :, :)
    integer :: count, done, f, k

    f = size(mean, 1)
    mean = 0
    magnitude = 0
    range = 0
    done = 0
    do while (done < points)
      count = min(block_length, points - done)
      if (allocated(samples)) deallocate(samples)
      allocate(samples(count, f, f, 3))
      call system%sample_second_order([((done + k - 1 + shift) / points, k = 1, count)], &
        & samples(:, :, :, 1), samples(:, :, :, 2), samples(:, :, :, 3))
      ! Sums differences from the first sample: adding many equal samples would round them all in the same direction.
      if (done == 0) start = samples(1, :, :, :)
      magnitude = magnitude + sum(abs(samples), dim=1)
      samples = samples - spread(start, 1, count)
      mean = mean + sum(samples, dim=1)
      range = max(range, 2 * maxval(abs(samples), dim=1))
      done = done + count
    end do
    mean = start + mean / points
    magnitude = magnitude / points
  end subroutine means

  !> Copies the means, which do not depend on the time `t`.
  subroutine matrices(self, t, m, b, c)
    class(averaged_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    associate (unused_time => t)
    end associate
    m = self%m
    b = self%b
    c = self%c
  end subroutine matrices

  !> Computes the load of the original system, which is not averaged.
  subroutine load(self, t, h)
    class(averaged_system), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    call self%whole%load(t, h)
  end subroutine load

  !> Copies the means to every phase and samples the load of the original system.
  subroutine sample_second_order(self, phases, m, b, c, h)
    class(averaged_system), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)

    if (present(h)) call self%whole%sample_second_order(phases, m, b, c, h)
    m = spread(self%m, 1, size(phases))
    b = spread(self%b, 1, size(phases))
    c = spread(self%c, 1, size(phases))
  end subroutine sample_second_order

  !> True if the coefficients are those of a Lagrangian without damping. The mean of a Lagrangian is a Lagrangian, so the result is
  !> the same as for the system `whole`.
  logical function conserves(self, chosen)
    class(averaged_system), intent(in) :: self
    integer, intent(in) :: chosen(:)
    integer :: i

    ! The averaged system is solved as a whole, as if all states were coupled.
    conserves = size(chosen) > 0
    if (conserves) conserves = self%whole%conserves([(i, i = 1, self%states / 2)])
  end function conserves

end module gestell_system_averaged
