!> Transforms a second-order system to Floquet's coordinates z. Let A be the matrix of its first-order equations x' = A x + f. Its
!> free vibrations are x_i(t) = p_i(t) exp(lambda_i t) with periodic p_i. With P = [p_1 ... p_n], W = P^-1 and x = P z the
!> equations become scalar equations with constant coefficients:
!>
!>     z_i' = lambda_i z_i + w_i f,
!>
!> where w_i is row i of W. The harmonic k of their periodic solution is (w_i f)_k / (i k 2 pi/T - lambda_i), where (w_i f)_k is
!> the harmonic k of w_i f. Therefore many loads cost little more than one load. (V. A. Yakubovich, V. M. Starzhinskii, Linear
!> Differential Equations with Periodic Coefficients, 1975, chapter II.)
module gestell_study_design_coordinates
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_quick_motion, only: quick_motion_type, solve_quickly
  use gestell_math_dft, only: dft
  use gestell_math_lapack, only: eigensystem
  use gestell_math_matrix, only: balanced, unit_matrix
  use gestell_system_mass, only: solve_mass
  use gestell_system_second_order, only: sample_in_units, second_order_system
  implicit none (type, external)
  private

  public :: find_coordinates, respond

  !> Floquet's coordinates of a system with n states, sampled at equidistant phases.
  type, public :: coordinates_type
    real(dp) :: period = 0
    !> `lambda`: exponents (1/s), whose imaginary parts are known up to multiples of 2 pi/T; shape (n). `p`: periodic matrix P of
    !> the free vibrations. `w`: its inverse W. Both are in units of `scale` and have shape (n, n, phases)
    complex(dp), allocatable :: lambda(:), p(:, :, :), w(:, :, :)
    !> Units by which the states are divided to make them comparable, shape (n)
    real(dp), allocatable :: scale(:)
    !> Factor of each coordinate in the sum that yields a real motion, shape (n): 2 for one coordinate of a conjugate pair, 0 for
    !> its partner, 1 for a coordinate without a partner
    real(dp), allocatable :: share(:)
  end type coordinates_type

  !> `of_modes`: largest allowed difference between the matrix P at the start and at the end of the period. `max_condition`:
  !> largest allowed condition number of P. A larger value shows that two free vibrations coincide, or that small free vibrations
  !> are lost in rounding next to large ones.
  real(dp), parameter :: of_modes = 1.0e-7_dp, max_condition = 1.0e6_dp

contains

  !> Computes Floquet's coordinates of a system at the phases t/T = (k - 1)/`phases`.
  subroutine find_coordinates(system, phases, tolerance, found, fits, earlier)
    !> The system to transform, with n states
    class(second_order_system), intent(in) :: system
    !> Number of phases at which the coordinates are computed
    integer, intent(in) :: phases
    !> Allowed error of the monodromy matrix Phi, relative to its size
    real(dp), intent(in) :: tolerance
    !> The coordinates
    type(coordinates_type), intent(out) :: found
    !> True if the coordinates are accurate enough (see `of_modes` and `max_condition`)
    logical, intent(out) :: fits
    !> A fast solution of the system. Its matrices, which map the state at the start of the period to the state at each phase, are
    !> used again if it has the same number of phases
    type(quick_motion_type), intent(in) :: earlier
    type(quick_motion_type) :: quick
    type(error_type), allocatable :: error
    complex(dp), allocatable :: rho(:), vectors(:, :), left(:, :)
    complex(dp) :: last(system%states, system%states)
    integer :: i, k, n

    n = system%states
    quick = earlier
    fits = allocated(earlier%maps)
    if (fits) fits = size(earlier%maps, 3) == phases
    if (.not. fits) then
      quick%keeps = .true.
      call solve_quickly(system, phases, tolerance, quick, fits)
    end if
    if (.not. fits) return
    found%period = system%period
    found%scale = quick%scale
    call eigensystem(balanced(quick%maps(:, :n, phases), quick%scale), rho, vectors, left, error)
    fits = .not. allocated(error)
    if (fits) fits = all(abs(rho) > 0)
    if (.not. fits) return
    found%lambda = log(rho) / system%period
    found%share = [(merge(1.0_dp, merge(2.0_dp, 0.0_dp, aimag(rho(i)) > 0), .not. abs(aimag(rho(i))) > 0), i = 1, n)]
    allocate(found%p(n, n, phases), found%w(n, n, phases))
    found%p(:, :, 1) = vectors
    do k = 1, phases
      last = matmul(balanced(quick%maps(:, :n, k), quick%scale), vectors)
      do i = 1, n
        last(:, i) = last(:, i) * exp(-log(rho(i)) * k / phases)
      end do
      if (k < phases) found%p(:, :, k + 1) = last
    end do
    fits = maxval(abs(last - vectors)) <= of_modes
    do k = 1, phases
      if (.not. fits) return
      call invert(found%p(:, :, k), found%w(:, :, k), fits)
    end do
  end subroutine find_coordinates

  !> Inverts a small complex matrix by Gauss-Jordan elimination. Sets `fits` to false if the matrix is singular or its condition
  !> number is too large.
  subroutine invert(a, b, fits)
    complex(dp), intent(in) :: a(:, :)
    complex(dp), intent(out) :: b(:, :)
    logical, intent(out) :: fits
    complex(dp) :: w(size(a, 1), 2 * size(a, 1)), row(2 * size(a, 1))
    integer :: j, k, n, pivot

    n = size(a, 1)
    w(:, :n) = a
    w(:, n + 1:) = unit_matrix(n)
    do j = 1, n
      pivot = j - 1 + maxloc(abs(real(w(j:, j))) + abs(aimag(w(j:, j))), dim=1)
      fits = abs(w(pivot, j)) > 0
      if (.not. fits) return
      row = w(pivot, :) / w(pivot, j)
      w(pivot, :) = w(j, :)
      w(j, :) = row
      do k = 1, n
        if (k /= j) w(k, :) = w(k, :) - w(k, j) * row
      end do
    end do
    b = w(:, n + 1:)
    fits = norm2([real(a), aimag(a)]) * norm2([real(b), aimag(b)]) <= max_condition
  end subroutine invert

  !> Computes the periodic motions of `system` under several loads that replace its own load. The results are not finite at a
  !> resonance.
  subroutine respond(system, coordinates, phases, loads, motions)
    !> The system whose motions are computed
    class(second_order_system), intent(in) :: system
    !> Floquet's coordinates of the system
    type(coordinates_type), intent(in) :: coordinates
    !> Phases t/T, and loads at these phases, shape (phases, degrees of freedom, loads)
    real(dp), contiguous, intent(in) :: phases(:), loads(:, :, :)
    !> Displacements q and their first and second derivatives with respect to theta = 2 pi t/T, shape (phases, degrees of freedom,
    !> 0:2, loads)
    real(dp), intent(out) :: motions(:, :, 0:, :)
    real(dp), dimension(size(phases), size(loads, 2), size(loads, 2)) :: m, b, c
    real(dp) :: r(size(phases), size(loads, 2), 2 * size(loads, 2) + size(loads, 3)), units(size(loads, 2)), &
      & x(2 * size(loads, 2)), unit
    complex(dp) :: z(size(phases), 2 * size(loads, 2))
    integer :: f, i, j, k, l, n

    f = size(loads, 2)
    n = size(phases)
    unit = system%period / (2 * pi)
    ! U^-1 q'' = -M^-1 C (U^-1 q) - M^-1 B (U^-1 q') + M^-1 (U h), where M, B, C are in the units U
    call sample_in_units(system, phases, m, b, c, units)
    r(:, :, :f) = -c
    r(:, :, f + 1:2 * f) = -b
    do j = 1, f
      r(:, j, 2 * f + 1:) = units(j) * loads(:, j, :)
    end do
    call solve_mass(m, r)
    do l = 1, size(loads, 3)
      do i = 1, 2 * f
        z(:, i) = 0
        if (.not. coordinates%share(i) > 0) cycle
        do k = 1, n
          z(k, i) = coordinates%share(i) * sum(coordinates%w(i, f + 1:, k) * (units * r(k, :, 2 * f + l) &
            & / coordinates%scale(f + 1:)))
        end do
        z(:, i) = dft(z(:, i))
        do j = 0, n - 1
          z(j + 1, i) = z(j + 1, i) / (cmplx(0, merge(j, j - n, 2 * j < n) / unit, dp) - coordinates%lambda(i)) / n
        end do
        if (modulo(n, 2) == 0) z(n / 2 + 1, i) = 0
        z(:, i) = conjg(dft(conjg(z(:, i))))
      end do
      do k = 1, n
        x = coordinates%scale * real(matmul(coordinates%p(:, :, k), z(k, :)))
        motions(k, :, 0, l) = x(:f)
        motions(k, :, 1, l) = unit * x(f + 1:)
        x = x / [units, units]
        motions(k, :, 2, l) = unit**2 * units * (matmul(r(k, :, :2 * f), x) + r(k, :, 2 * f + l))
      end do
    end do
  end subroutine respond

end module gestell_study_design_coordinates
