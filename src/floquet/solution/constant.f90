!> Solves systems with constant coefficients and a periodic load, M q'' + B q' + C q = h(t), in closed form ("Averaged coefficients"
!> in doc/theory.md). The multipliers are exp(lambda T). The periodic motion is computed harmonic by harmonic
!> (gestell_floquet_constant_harmonics). No integration over time is needed.
module gestell_floquet_solution_constant
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: balancing, eigensystem, inverse
  use gestell_floquet_constant_harmonics, only: solve_harmonics, spectrum_type
  use gestell_floquet_multipliers_krein, only: krein_signs
  use gestell_floquet_multipliers, only: arrange, disc_bounds, multiplier, multipliers_type
  use gestell_floquet_solution_part_solution, only: part_solution_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_period_turn_errors, only: turn_errors_type
  use gestell_system_averaged, only: averaged_system
  use gestell_system_second_order, only: conserved_form
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: solve_constant

  !> Closed-form solution of a system with constant coefficients and n states.
  type, extends(part_solution_type), public :: constant_type
    !> Period T (s)
    real(dp) :: period = 0
    !> `values`: eigenvalues lambda of the first-order matrix P (1/s), shape (n). `vectors`: eigenvectors in balanced units, shape
    !> (n, n).
    complex(dp), allocatable :: values(:), vectors(:, :)
    !> `radius`: radii of the error discs around the eigenvalues (1/s). `condition`: condition numbers in balanced units. Shapes
    !> (n).
    real(dp), allocatable :: radius(:), condition(:)
    !> Signs of Krein's form (`krein_signs`), shape (n); unallocated if the system may not conserve energy.
    integer, allocatable :: signs(:)
    !> Defect of Liouville's formula, T (sum of lambda - tr P); zero except for rounding errors.
    real(dp) :: trace_defect = 0
    !> Periodic motion; unallocated if it was not requested or does not exist.
    type(spectrum_type), allocatable :: spectrum
    !> Error message that explains why no periodic motion exists; unallocated if the motion exists.
    type(error_type), allocatable :: resonance
  contains
    procedure :: multipliers => part_multipliers, start => part_start, follow => part_motion
    procedure :: errors => part_errors, liouville_defect => part_liouville_defect
  end type constant_type

contains

  !> Computes the eigenvalues, and the periodic motion if `forced` is true. Resonance is not an error here, because it affects only
  !> the periodic motion: it is stored in `constant%resonance`. Fails if M is singular or LAPACK finds no eigenvalues.
  subroutine solve_constant(system, forced, constant, error)
    type(averaged_system), intent(in) :: system
    !> If true, also compute the periodic motion
    logical, intent(in) :: forced
    type(constant_type), intent(out) :: constant
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: p(system%states, system%states), balanced(system%states, system%states), perturbation
    complex(dp), allocatable :: left(:, :)
    real(dp), allocatable :: form(:, :)
    integer :: n, k

    n = system%states
    constant%period = system%period
    call system%matrix(0.0_dp, p)
    if (.not. all(ieee_is_finite(p))) then
      call fatal_error(error, "the system's coefficients are not finite, or its mass matrix is singular", &
        & failed_computation)
      return
    end if
    constant%scale = balancing(p)
    balanced = p * spread(constant%scale, 1, n) / spread(constant%scale, 2, n)
    call eigensystem(balanced, constant%values, constant%vectors, left, error)
    if (allocated(error)) return
    ! LAPACK's eigenvalues are those of a matrix that differs by roundoff.
    perturbation = error_of(system, p, constant%scale) + n * epsilon(1.0_dp) * norm2(balanced)
    constant%evidence%methods = "averaged"
    constant%evidence%evaluations = system%evaluations
    constant%evidence%error = 1
    if (perturbation < norm2(balanced)) constant%evidence%error = perturbation / norm2(balanced)
    constant%condition = [(1 / max(abs(dot_product(left(:, k), constant%vectors(:, k))), epsilon(1.0_dp)**2), k = 1, n)]
    constant%radius = n * constant%condition * perturbation
    call conserved_form(system, form)
    if (allocated(form)) constant%signs = krein_signs(constant%values, constant%radius, left, perturbation, &
      & spread(constant%scale, 2, n) * form * spread(constant%scale, 1, n))
    constant%trace_defect = constant%period * (sum(real(constant%values)) - sum([(p(k, k), k = 1, n)]))
    if (.not. forced) return

    allocate(constant%spectrum)
    call solve_harmonics(system, constant%scale, constant%values, constant%spectrum, constant%resonance)
    constant%evidence%evaluations = constant%evidence%evaluations + constant%spectrum%evaluations
    if (allocated(constant%resonance)) deallocate(constant%spectrum)
  end subroutine solve_constant

  !> Bound on the error of the matrix P that errors of M, B and C cause, linearised in these errors: d(M^-1 C) = M^-1 (dC - dM
  !> M^-1 C). `norm`: norm of the bound, in units of `scale`.
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

  !> Implements `multipliers` of part_solution_type. An error d of lambda multiplies rho by exp(d T). So |d| T bounds the errors of
  !> ln |rho| and of the argument, even if |rho| is very small.
  subroutine part_multipliers(self, vectors, multipliers, error)
    class(constant_type), intent(in) :: self
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: most = 690
    real(dp) :: turn(size(self%values))

    associate (period => self%period, m => multipliers)
      m%condition = self%condition
      m%log_abs = real(self%values) * period
      turn = aimag(self%values) * period
      m%arg = turn - 2 * pi * anint(turn / (2 * pi))
      m%exponent = cmplx(m%log_abs, m%arg, dp)
      m%rho = multiplier(m%exponent)
      m%error = disc_bounds(m%exponent, exp(min(log_growth(self%radius * period), most)))
      m%exponent = m%exponent / period
      if (allocated(self%signs)) m%krein = self%signs
      if (vectors) m%vectors = self%vectors * spread(self%scale, 2, size(turn))
    end associate
    call arrange(multipliers)
  end subroutine part_multipliers

  !> Logarithm of exp(x) - 1 for x > 0, without loss of digits for small x and without overflow.
  elemental real(dp) function log_growth(x)
    real(dp), intent(in) :: x

    if (x > 40) then
      log_growth = x
    else
      log_growth = x / 2 + log(2 * sinh(x / 2))
    end if
  end function log_growth

  !> Implements `start` of part_solution_type. The error bounds in `solution` are valid at all times of the period.
  subroutine part_start(self, solution, error)
    class(constant_type), intent(in) :: self
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: start(size(self%scale), 1)

    if (allocated(self%resonance)) then
      allocate(error, source=self%resonance)
      return
    end if
    call self%spectrum%motion([0.0_dp], start)
    solution%x0 = start(:, 1)
    solution%error = self%spectrum%error
    solution%condition = self%spectrum%condition
  end subroutine part_start

  !> Implements `follow` of part_solution_type.
  subroutine part_motion(self, system, x0, phases, x, error)
    class(constant_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: x0(:), phases(:)
    real(dp), intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error

    associate (unused_system => system, unused_start => x0)
    end associate
    call self%spectrum%motion(phases, x)
  end subroutine part_motion

  !> Implements `errors` of part_solution_type. The motion's error bound holds at all times, so it is stored as the
  !> rounding error.
  subroutine part_errors(self, system, phases, x, errors, error, disturbance)
    class(constant_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: phases(:), x(:, :)
    type(turn_errors_type), intent(out) :: errors
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: disturbance

    associate (unused_system => system, unused_disturbance => present(disturbance))
    end associate
    allocate(errors%differences(size(x, 1), 2 * size(phases)), source=0.0_dp)
    allocate(errors%rounding, source=self%spectrum%error)
  end subroutine part_errors

  !> Implements `liouville_defect` of part_solution_type.
  subroutine part_liouville_defect(self, system, defect, error)
    class(constant_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(out) :: defect
    type(error_type), allocatable, intent(out) :: error

    associate (unused_system => system, no_error => allocated(error))
    end associate
    defect = self%trace_defect
  end subroutine part_liouville_defect

end module gestell_floquet_solution_constant
