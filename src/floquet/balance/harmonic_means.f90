!> The preconditioner of harmonic balance. From the means <B>, <C> over the turn of the coefficients of q'' + B q' + C q = h, with
!> theta = 2 pi t/T as independent variable, it forms the matrices A_k = <C> + i k <B> - k^2 E.
module gestell_floquet_balance_harmonic_means
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_choice_survey, only: survey_type
  use gestell_math_lanes_waves, only: waves_at, waves_type
  implicit none (type, external)
  private

  public :: begin_means, invert, solve_means

  !> Means of B and C over the turn, in units of the states, and the inverses of the matrices A_k for all orders k.
  type, public :: means_type
    !> `f`: number of degrees of freedom. `half`: half the number of phases; the phases resolve orders below `half`
    integer :: f = 0, half = 0
    !> Means of B and C over the turn, shape (f, f)
    real(dp), allocatable, dimension(:, :) :: b, c
    !> Real parts (`along`) and imaginary parts (`across`) of A_k^-1, shape (0:half - 1, f, f). A_k x_k = h_k is the averaged
    !> equation of harmonic k
    real(dp), allocatable, dimension(:, :, :) :: along, across
    !> `of_velocity`: ratio of velocity to displacement at order 1, shape (f). `weights`: factors of the harmonics in the rms value
    !> of motion and velocity, shape (0:2 half - 1, f)
    real(dp), allocatable :: of_velocity(:), weights(:, :)
    !> Norm of A_k^-1 for each order k. A_k x_k = h_k is the averaged equation of harmonic k
    real(dp), allocatable :: gains(:)
    !> Factor by which errors made during one turn are amplified: the maximum over k of |(i k W - P)^-1|/T, where W = 2 pi/T, and
    !> P is the matrix of the averaged first-order equations. Near a resonance it approximates |(E - Phi)^-1| with the monodromy
    !> matrix Phi
    real(dp) :: amplification = 0
    !> The Fourier transform for this number of phases
    type(waves_type) :: waves
  contains
    procedure :: weighted, left_out
  end type means_type

  !> Resonances are considered for orders up to this multiple of the order of the fastest free vibration.
  real(dp), parameter :: beyond_fastest = 1.1_dp

contains

  !> Computes the means of B and C over the turn, and the inverses of A_k = <C> + i k <B> - k^2 E for all orders k.
  pure subroutine solve_means(b, c, omega, survey, means, fits)
    !> `b`, `c`: coefficients of the equations q'' + B q' + C q = h with theta = 2 pi t/T as independent variable, at equidistant
    !> phases, in the units of `survey`, shapes (phases, f, f). `omega`: 2 pi/T (rad/s)
    real(dp), intent(in) :: b(:, :, :), c(:, :, :), omega
    type(survey_type), intent(in) :: survey
    type(means_type), intent(out) :: means
    !> False if, for some harmonic k, the matrix of the averaged equation A_k x_k = h_k is singular
    logical, intent(out) :: fits
    integer :: furthest

    call begin_means(b, c, omega, survey, means)
    associate (f => means%f, half => means%half)
      furthest = max(half - 1, ceiling(beyond_fastest * survey%fastest / (2 * pi)))
      allocate(means%along(0:half - 1, f, f), means%across(0:half - 1, f, f), means%gains(0:furthest))
    end associate
    call invert_means(means, fits)
  end subroutine solve_means

  !> Computes the means, the weights and the Fourier transform, but no inverses. The arguments are those of `solve_means`.
  pure subroutine begin_means(b, c, omega, survey, means)
    real(dp), intent(in) :: b(:, :, :), c(:, :, :), omega
    type(survey_type), intent(in) :: survey
    type(means_type), intent(out) :: means
    integer :: f, n, i, k

    n = size(c, 1)
    f = size(c, 2)
    means%f = f
    means%half = n / 2
    means%b = sum(b, dim=1) / n
    means%c = sum(c, dim=1) / n
    means%of_velocity = omega * survey%scale(:f) / survey%scale(f + 1:)
    allocate(means%weights(0:n - 1, f), source=1.0_dp)
    do i = 1, f
      means%weights(1:n / 2 - 1, i) = [(sqrt((1 + (k * means%of_velocity(i))**2) / 2), k = 1, n / 2 - 1)]
    end do
    means%weights(n / 2 + 1:, :) = means%weights(1:n / 2 - 1, :)
    means%waves = waves_at(n)
  end subroutine begin_means

  !> Inverts the matrices A_k of all orders k. For orders that the phases do not resolve, only the norms of the inverses are kept.
  !> `fits` is false if one of the matrices is singular.
  pure subroutine invert_means(means, fits)
    type(means_type), intent(inout) :: means
    logical, intent(out) :: fits
    complex(dp) :: inverted(means%f, means%f), of_acceleration
    real(dp) :: squares, weight
    integer :: f, i, j, k

    f = means%f
    means%amplification = 0
    fits = .false.
    do k = 0, ubound(means%gains, 1)
      inverted = operator_of(means, k)
      call invert(inverted, fits)
      if (.not. fits) return
      if (k < means%half) then
        means%along(k, :, :) = real(inverted)
        means%across(k, :, :) = aimag(inverted)
      end if
      means%gains(k) = 0
      squares = 0
      do i = 1, f
        weight = 1 + (k * means%of_velocity(i))**2
        do j = 1, f
          of_acceleration = inverted(i, j) / (2 * pi * means%of_velocity(j))
          squares = squares + weight * (real(of_acceleration)**2 + aimag(of_acceleration)**2)
          means%gains(k) = means%gains(k) + weight * (real(inverted(i, j))**2 + aimag(inverted(i, j))**2)
        end do
      end do
      means%gains(k) = sqrt(means%gains(k))
      means%amplification = max(means%amplification, sqrt(squares))
    end do
  end subroutine invert_means

  !> The matrix A_k of the averaged equation of harmonic k.
  pure function operator_of(means, k) result(a)
    type(means_type), intent(in) :: means
    integer, intent(in) :: k
    complex(dp) :: a(means%f, means%f)
    integer :: i

    a = cmplx(means%c, k * means%b, dp)
    do i = 1, means%f
      a(i, i) = a(i, i) - real(k, dp)**2
    end do
  end function operator_of

  !> Inverts a matrix in place by Gauss-Jordan elimination with row pivots. `fits` is false if the matrix is singular.
  pure subroutine invert(a, fits)
    complex(dp), contiguous, intent(inout) :: a(:, :)
    logical, intent(out) :: fits
    complex(dp) :: factor
    integer :: row(size(a, 1)), i, j, k

    do j = 1, size(a, 1)
      row(j) = j
      do i = j + 1, size(a, 1)
        if (abs(real(a(i, j))) + abs(aimag(a(i, j))) > abs(real(a(row(j), j))) + abs(aimag(a(row(j), j)))) row(j) = i
      end do
      if (row(j) /= j) a([j, row(j)], :) = a([row(j), j], :)
      fits = abs(real(a(j, j))) + abs(aimag(a(j, j))) > tiny(1.0_dp)
      if (.not. fits) return
      factor = 1 / a(j, j)
      a(j, j) = 1
      a(j, :) = a(j, :) * factor
      do i = 1, size(a, 1)
        if (i == j) cycle
        factor = a(i, j)
        a(i, j) = 0
        do k = 1, size(a, 1)
          a(i, k) = a(i, k) - factor * a(j, k)
        end do
      end do
    end do
    do j = size(a, 1), 1, -1
      if (row(j) /= j) a(:, [j, row(j)]) = a(:, [row(j), j])
    end do
  end subroutine invert

  !> Harmonics of the load, multiplied by A_k^-1 and then by `weights`. A_k x_k = h_k is the averaged equation of harmonic k.
  pure function weighted(means, load) result(x)
    class(means_type), intent(in) :: means
    real(dp), intent(in) :: load(0:, :)
    real(dp) :: x(0:2 * means%half - 1, means%f)
    integer :: i, j, k

    x = 0
    associate (half => means%half, along => means%along, across => means%across)
      do j = 1, means%f
        do i = 1, means%f
          do k = 0, half - 1
            x(k, i) = x(k, i) + along(k, i, j) * load(k, j) + across(k, i, j) * load(half + k, j)
            x(half + k, i) = x(half + k, i) + along(k, i, j) * load(half + k, j) - across(k, i, j) * load(k, j)
          end do
        end do
      end do
      x(half, :) = 0
    end associate
    x = x * means%weights
  end function weighted

  !> Estimates the error caused by missing harmonics (doc/theory.md, equation 37). If the n phases do not resolve the order k,
  !> harmonic k is missing, and its load appears as a load of order n - k. The load A_k x_k is assumed to fall further as it falls
  !> from the last but one to the last sixth of the resolved orders.
  pure real(dp) function left_out(means, x)
    class(means_type), intent(in) :: means
    real(dp), intent(in) :: x(0:, :)
    complex(dp) :: load(means%f)
    real(dp) :: sizes(0:means%half - 1), last, fall
    integer :: sixth, k

    associate (half => means%half, phases => 2 * means%half, furthest => ubound(means%gains, 1))
      sixth = max(1, half / 6)
      do k = half - 2 * sixth, half - 1
        load = matmul(operator_of(means, k), cmplx(x(k, :), -x(half + k, :), dp))
        sizes(k) = sqrt(sum(real(load)**2 + aimag(load)**2))
      end do
      last = maxval(sizes(half - sixth:half - 1))
      fall = min(1.0_dp, last / max(maxval(sizes(half - 2 * sixth:half - sixth - 1)), tiny(fall)))**(1.0_dp / sixth)
      left_out = 0
      do k = max(phases, furthest), half, -1
        left_out = left_out * fall
        if (k <= furthest) left_out = left_out + means%gains(k)
        if (k > half .and. k <= phases) left_out = left_out + means%gains(phases - k)
      end do
      left_out = left_out * fall * last
    end associate
  end function left_out

end module gestell_floquet_balance_harmonic_means
