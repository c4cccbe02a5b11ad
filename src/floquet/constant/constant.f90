!> Systems with constant coefficients and a periodic load, M q'' + B q' + C q = h(t), in closed form: multipliers
!> exp(lambda T), the periodic motion harmonic by harmonic (gestell_floquet_constant_harmonics). Nothing is integrated.
module gestell_floquet_constant
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: balancing, eigensystem, inverse
  use gestell_floquet_constant_harmonics, only: solve_harmonics, spectrum_type
  use gestell_floquet_multipliers, only: arrange, disc_bounds, multiplier, multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_system_averaged, only: averaged_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: constant_multipliers, constant_periodic, solve_constant

  type, public :: constant_type
    real(dp) :: period = 0
    !> Units of the states, powers of two, shape (n).
    real(dp), allocatable :: scale(:)
    !> Eigenvalues lambda of P (1/s), radii of their discs, their conditions, shape (n), and eigenvectors, shape (n, n);
    !> conditions and vectors in balanced units.
    complex(dp), allocatable :: values(:), vectors(:, :)
    real(dp), allocatable :: radius(:), condition(:)
    !> Bound on the norm of the error of P, relative to the norm of P, in balanced units.
    real(dp) :: error = 0
    !> T (sum of lambda - tr P).
    real(dp) :: liouville_defect = 0
    !> Samples of coefficients and load.
    integer :: evaluations = 0
    !> The periodic motion, where it was asked for, or why there is none.
    type(spectrum_type), allocatable :: spectrum
    type(error_type), allocatable :: resonance
  end type constant_type

contains

  !> Eigenvalues, and if `forced` the periodic motion. Errors: M is singular; LAPACK found no eigenvalues. A resonance is
  !> an error of the periodic motion alone, see `constant_periodic`.
  subroutine solve_constant(system, forced, constant, error)
    type(averaged_system), intent(in) :: system
    logical, intent(in) :: forced
    type(constant_type), intent(out) :: constant
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: p(system%states, system%states), balanced(system%states, system%states)
    complex(dp), allocatable :: left(:, :)
    real(dp) :: perturbation
    integer :: n, k

    n = system%states
    constant%period = system%period
    constant%evaluations = system%evaluations
    call system%matrix(0.0_dp, p)
    if (.not. all(ieee_is_finite(p))) then
      call fatal_error(error, "the coefficients of the system are not finite, or its mass matrix is singular", &
        & failed_computation)
      return
    end if
    constant%scale = balancing(p)
    balanced = p * spread(constant%scale, 1, n) / spread(constant%scale, 2, n)
    call eigensystem(balanced, constant%values, constant%vectors, left, error)
    if (allocated(error)) return
    ! LAPACK's eigenvalues are those of a matrix that differs by roundoff.
    perturbation = error_of(system, p, constant%scale) + n * epsilon(1.0_dp) * norm2(balanced)
    constant%error = 1
    if (perturbation < norm2(balanced)) constant%error = perturbation / norm2(balanced)
    constant%condition = [(1 / max(abs(dot_product(left(:, k), constant%vectors(:, k))), epsilon(1.0_dp)**2), k = 1, n)]
    constant%radius = n * constant%condition * perturbation
    constant%liouville_defect = constant%period * (sum(real(constant%values)) - sum([(p(k, k), k = 1, n)]))
    if (.not. forced) return

    allocate(constant%spectrum)
    call solve_harmonics(system, constant%scale, constant%values, constant%spectrum, constant%resonance)
    constant%evaluations = constant%evaluations + constant%spectrum%evaluations
    if (allocated(constant%resonance)) deallocate(constant%spectrum)
  end subroutine solve_constant

  !> Bound on the norm, in units of `scale`, of the error of P by that of the coefficients, to first order:
  !> d(M^-1 C) = M^-1 (dC - dM M^-1 C).
  real(dp) function error_of(system, p, scale) result(norm)
    type(averaged_system), intent(in) :: system
    real(dp), intent(in) :: p(:, :), scale(:)
    type(error_type), allocatable :: singular
    real(dp), allocatable :: inverted(:, :)
    real(dp), dimension(size(p, 1) / 2, size(p, 1)) :: change, lower
    real(dp) :: dm(size(p, 1) / 2, size(p, 1) / 2), rounding
    integer :: f

    f = size(p, 1) / 2
    call inverse(system%m, inverted, singular)
    rounding = 2 * f * epsilon(1.0_dp)
    dm = system%m_error + rounding * abs(system%m)
    change(:, :f) = system%c_error + rounding * abs(system%c)
    change(:, f + 1:) = system%b_error + rounding * abs(system%b)
    lower = matmul(abs(inverted), change + matmul(dm, abs(p(f + 1:, :))))
    norm = norm2(lower * spread(scale, 1, f) / spread(scale(f + 1:), 2, 2 * f))
  end function error_of

  !> All multipliers; with `vectors` the eigenvectors too. An error d of lambda changes rho by the factor exp(d T), so
  !> |d| T is the error of ln |rho| and of the argument, however small |rho| is.
  pure subroutine constant_multipliers(constant, vectors, multipliers)
    type(constant_type), intent(in) :: constant
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    real(dp), parameter :: most = 690
    real(dp) :: turn(size(constant%values))

    associate (period => constant%period, m => multipliers)
      m%condition = constant%condition
      m%log_abs = real(constant%values) * period
      turn = aimag(constant%values) * period
      m%arg = turn - 2 * pi * anint(turn / (2 * pi))
      m%exponent = cmplx(m%log_abs, m%arg, dp)
      m%rho = multiplier(m%exponent)
      m%error = disc_bounds(m%exponent, exp(min(log_growth(constant%radius * period), most)))
      m%exponent = m%exponent / period
      if (vectors) m%vectors = constant%vectors * spread(constant%scale, 2, size(turn))
    end associate
    call arrange(multipliers)
  end subroutine constant_multipliers

  !> ln(exp(x) - 1) for x > 0, without loss of digits.
  elemental real(dp) function log_growth(x)
    real(dp), intent(in) :: x

    if (x > 40) then
      log_growth = x
    else
      log_growth = x / 2 + log(2 * sinh(x / 2))
    end if
  end function log_growth

  !> The start of the periodic motion. Its error bounds hold at all times of the period. Error: resonance.
  subroutine constant_periodic(constant, solution, error)
    type(constant_type), intent(in) :: constant
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: start(size(constant%scale), 1)

    if (allocated(constant%resonance)) then
      allocate(error, source=constant%resonance)
      return
    end if
    call constant%spectrum%motion([0.0_dp], start)
    solution%x0 = start(:, 1)
    solution%error = constant%spectrum%error
    solution%condition = constant%spectrum%condition
  end subroutine constant_periodic

end module gestell_floquet_constant
