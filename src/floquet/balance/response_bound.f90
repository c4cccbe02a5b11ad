!> Bounds the periodic response of a system to small disturbances of its equations M q'' + B q' + C q = h.
!>
!> A disturbance w of the accelerations changes the periodic motion by
!>
!>     e(t) = integral over s of G(t, s) (0, w(s)),
!>     G(t, s) = Phi(t, s) [t > s] + Phi(t, 0) (E - Phi(T))^-1 Phi(T, s).
!>
!> Errors are measured by the energy of the averaged machine, |x|^2 = q' <C> q + v' <M> v. In this norm the free vibrations of the
!> averaged machine never grow. Any free vibration grows at most at the rate of the logarithmic norm of P (G. Dahlquist 1958),
!>
!>     |Phi(t, s)| <= exp(integral of mu from s to t),   mu = largest eigenvalue of (P + P')/2 in coordinates z with |z|^2 = |x|^2.
!>
!> Between the ends of the segments, to which Phi is known, this rate bounds Phi.
module gestell_floquet_balance_response_bound
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: monodromy_type
  use gestell_floquet_period_turn_errors, only: rounding_errors
  use gestell_math_lapack, only: inverse, inverse_factor, symmetric_pencil
  use gestell_math_matrix, only: unit_matrix
  implicit none (type, external)
  private

  public :: bound_response

  !> Bound on the response, and the norm in which it holds. The independent variable is the angle theta = 2 pi t/T.
  type, public :: response_type
    !> Ratio of the largest |e(t)| to the largest |(0, w(t))|
    real(dp) :: gain = 0
    !> Coordinates z = R (q, q') with |z| = |(q, q')|, where q' is the derivative with respect to the time: `to`, the matrix R, and
    !> `from`, its inverse; shapes (n, n)
    real(dp), allocatable, dimension(:, :) :: to, from
  end type response_type

contains

  !> Computes a bound on the response.
  subroutine bound_response(energies, omega, monodromy, phases, p, response, fits)
    !> <C> and <M> with theta as independent variable, in the units of the states; shape (f, f, 2)
    real(dp), intent(in) :: energies(:, :, :)
    !> 2 pi/T (rad/s)
    real(dp), intent(in) :: omega
    !> The solution over the period, with the maps of its segments
    type(monodromy_type), intent(in) :: monodromy
    !> `phases`: ascending phases t / T. `p`: matrix P at these phases, shape (phases, n, n)
    real(dp), intent(in) :: phases(:), p(:, :, :)
    type(response_type), intent(out) :: response
    !> False if there is no bound: the averaged machine has no energy that is positive for all motions, or Phi(T) is too inaccurate
    !> to exclude a resonance
    logical, intent(out) :: fits
    real(dp), parameter :: little = 0.1_dp
    real(dp), dimension(size(monodromy%segments%maps, 3)) :: length, growth
    real(dp), allocatable :: a(:, :, :), inverted(:, :), at_starts(:, :)
    real(dp) :: phi(2 * size(energies, 1), 2 * size(energies, 1)), lost
    type(error_type), allocatable :: error
    integer :: n, k

    n = 2 * size(energies, 1)
    call measure_energy(energies, omega, monodromy%scale, response, fits)
    if (.not. fits) return
    associate (to => response%to, from => response%from, segments => monodromy%segments, scale => spread(monodromy%scale, 1, n))
      phi = matmul(matmul(to, monodromy%phi), from)
      call inverse(unit_matrix(n) - phi, inverted, error)
      fits = .not. allocated(error)
      if (.not. fits) return
      lost = norm2(inverted) * norm2(to * scale) * norm2(from / transpose(scale)) * monodromy%error
      fits = lost < little
      if (.not. fits) return
      length = 2 * pi * (segments%ends(1:) - segments%ends(:size(length) - 1))
      growth = exp(length * growth_rates(response, omega, phases, p, segments%ends))
      allocate(a(n, n, size(length)))
      do k = 1, size(length)
        a(:, :, k) = matmul(matmul(to, segments%maps(:, :, k)), from)
      end do
    end associate
    allocate(at_starts, source=rounding_errors(a, inverted / (1 - lost), growth * length))
    response%gain = maxval(growth * (norm2(at_starts, dim=1) + length))
    fits = response%gain < huge(response%gain)
  end subroutine bound_response

  !> Computes the coordinates of the energy. `fits` is false if <M> or the symmetric part of <C> is not positive definite.
  subroutine measure_energy(energies, omega, scale, response, fits)
    !> <C> and <M> with theta as independent variable, in the units `scale` of the states; shape (f, f, 2)
    real(dp), intent(in) :: energies(:, :, :), omega, scale(:)
    type(response_type), intent(inout) :: response
    logical, intent(out) :: fits
    real(dp), dimension(size(energies, 1), size(energies, 1)) :: energy
    real(dp), allocatable :: factor(:, :)
    type(error_type), allocatable :: error
    integer :: i, part, f, first

    f = size(energies, 1)
    allocate(response%to(2 * f, 2 * f), response%from(2 * f, 2 * f), source=0.0_dp)
    do part = 1, 2
      energy = energies(:, :, part)
      energy = (energy + transpose(energy)) / 2
      call inverse_factor(energy, factor, error)
      fits = .not. allocated(error)
      if (.not. fits) return
      first = (part - 1) * f
      associate (to => response%to(first + 1:first + f, first + 1:first + f), &
        & from => response%from(first + 1:first + f, first + 1:first + f))
        to = matmul(factor, energy)
        from = transpose(factor)
        do i = 1, f
          associate (unit => scale(i) * merge(1.0_dp, omega, part == 1))
            to(:, i) = to(:, i) / unit
            from(i, :) = from(i, :) * unit
          end associate
        end do
      end associate
    end do
  end subroutine measure_energy

  !> Bounds mu per radian of theta in each segment, at least 0; shape (segments).
  !>
  !> In the coordinates z the matrix P is [0, U; V, S] and mu <= s + |U + V'|/2, where s is the largest eigenvalue of (S + S')/2.
  !> It is at most that of the mean of S over the phases, plus the norm of the difference from the mean.
  function growth_rates(response, omega, phases, p, ends) result(rates)
    type(response_type), intent(in) :: response
    real(dp), intent(in) :: omega, phases(:), p(:, :, :), ends(0:)
    real(dp) :: rates(ubound(ends, 1))
    real(dp), dimension(size(p, 2) / 2, size(p, 2) / 2) :: mean, apart
    real(dp) :: rate(0:size(phases) + 1), skew(size(phases)), uneven(size(phases))
    real(dp), allocatable :: values(:), v(:, :, :), s(:, :, :)
    type(error_type), allocatable :: error
    integer :: f, i, j, k, m

    f = size(p, 2) / 2
    m = size(phases)
    allocate(v(m, f, f), s(m, f, f), source=0.0_dp)
    associate (to => response%to / omega, from => response%from)
      call transform(to(f + 1:, f + 1:), p(:, f + 1:, :f), from(:f, :f), v)
      call transform(to(f + 1:, f + 1:), p(:, f + 1:, f + 1:), from(f + 1:, f + 1:), s)
      apart = matmul(to(:f, :f), from(f + 1:, f + 1:))
    end associate
    mean = sum(s, dim=1) / m
    mean = (mean + transpose(mean)) / 2
    skew = 0
    uneven = 0
    do j = 1, f
      do i = 1, f
        skew = skew + (apart(i, j) + v(:, j, i))**2
        uneven = uneven + ((s(:, i, j) + s(:, j, i)) / 2 - mean(i, j))**2
      end do
    end do
    call symmetric_pencil(mean, unit_matrix(f), values, error)
    ! not reached: LAPACK finds the eigenvalues of every finite symmetric matrix
    if (allocated(error)) values = [norm2(mean)]
    rate(1:m) = max(0.0_dp, maxval(values) + sqrt(uneven)) + sqrt(skew) / 2
    rate(0) = rate(m)
    rate(m + 1) = rate(1)
    ! The rates at the phases of a segment and at one more phase on each side
    do k = 1, size(rates)
      rates(k) = maxval(rate(count(phases < ends(k - 1)):count(phases <= ends(k)) + 1))
    end do
  end function growth_rates

  !> Adds the products A B(t) C to `sums`, shape (phases, f, f). A and C are upper triangular.
  pure subroutine transform(a, b, c, sums)
    real(dp), intent(in) :: a(:, :), b(:, :, :), c(:, :)
    real(dp), intent(inout) :: sums(:, :, :)
    real(dp), allocatable :: from_right(:, :, :)
    integer :: i, j, k

    allocate(from_right, mold=b)
    from_right = 0
    do j = 1, size(c, 2)
      do k = 1, j
        do i = 1, size(b, 2)
          from_right(:, i, j) = from_right(:, i, j) + b(:, i, k) * c(k, j)
        end do
      end do
      do k = 1, size(a, 2)
        do i = 1, k
          sums(:, i, j) = sums(:, i, j) + a(i, k) * from_right(:, k, j)
        end do
      end do
    end do
  end subroutine transform

end module gestell_floquet_balance_response_bound
