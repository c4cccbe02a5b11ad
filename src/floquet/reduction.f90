!> A system whose free vibrations are fast against its period, taken apart into groups of modes that hardly couple:
!> superadiabatic diagonalisation (M. V. Berry, Proc. R. Soc. A 414 (1987) 31, doi:10.1098/rspa.1987.0131, for matrices).
!>
!> With the phase t / T as the independent variable, A = T P and x = S y + p
!>
!>     y' = D y + g,   D = S^-1 (A S - S'),   g = S^-1 (A p + T f - p').
!>
!> Smooth periodic S and p are sought for which D has no entries between groups and g vanishes but in the slow group.
!> They exist up to terms that are exponentially small in the distance of the groups, in periods; what is left is measured
!> between the phases where it was made to vanish. The cost does not depend on how fast the vibrations are.
module gestell_floquet_reduction
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_base_lapack, only: inverse
  use gestell_base_text, only: text
  use gestell_floquet_decoupling, only: decouple, fast_size, reduction_type, transform, uncoupled_size
  use gestell_floquet_modes, only: follow_modes
  use gestell_floquet_trigonometric, only: differentiation, equidistant, interpolation
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: reduce, reduction_type

  !> Phases that are tried.
  integer, parameter :: fewest = 33, most = 1025
  !> What counts as roundoff: this many times epsilon |S| |S^-1|, relative to the terms of a residual.
  real(dp), parameter :: rounding = 32
  !> A greater one says nothing about a multiplier.
  real(dp), parameter :: most_residual = 0.1_dp

contains

  !> The reduction of `system` whose residual is `tolerance`, relative to p for the forced part, or roundoff. `scale`,
  !> shape (n): units that balance the states. Error: there is none; the message says why.
  subroutine reduce(system, scale, forced, tolerance, reduction, error)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: scale(:), tolerance
    logical, intent(in) :: forced
    type(reduction_type), intent(out) :: reduction
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: a(:, :, :), f(:, :)
    real(dp) :: before, turns
    integer :: n, evaluations

    if (allocated(system%breaks)) then
      call fatal_error(error, "the coefficients jump", failed_computation)
      return
    end if
    n = fewest
    evaluations = 0
    before = huge(before)
    do while (n <= most)
      evaluations = evaluations + 2 * n
      if (2 * n > system%least_steps) then
        call coefficients(system, scale, forced, equidistant(n), a, f, error)
        if (allocated(error)) return
        turns = maxval(abs(a))
        if (least_residual(reduction) * turns > most_residual) then
          call fatal_error(error, "the free vibrations turn so often within the period that rounding loses their phase", &
            & failed_computation)
          return
        end if
        ! What N phases resolve then varies more slowly than groups vibrate against each other.
        call follow_modes(a, pi * n, reduction%modes, error)
        if (allocated(error)) return
        if (all(reduction%modes%group == 0)) then
          call fatal_error(error, "the free vibrations are too slow against the crank", failed_computation)
          return
        end if
        call decouple(a, f, forced, 0.1_dp * tolerance, reduction, error)
        if (allocated(error)) return
        call measure(system, scale, forced, reduction, error)
        if (allocated(error)) return
        if (reduction%residual <= max(tolerance, least_residual(reduction) * turns) &
          & .and. reduction%forcing_residual <= max(tolerance, least_residual(reduction)) * reduction%effort &
          & .and. reduction%slow_residual <= max(tolerance * reduction%slow_effort, &
          & least_residual(reduction) * reduction%effort)) then
          reduction%evaluations = evaluations
          return
        end if
        if (reduction%residual > 0.5_dp * before) exit
        before = reduction%residual
      end if
      n = 2 * n - 1
    end do
    call fatal_error(error, "the modes couple too much, or change too suddenly, for " // text(n) // " phases", &
      & failed_computation)
  end subroutine reduce

  !> A, shape (n, n, phases), and T f, shape (n, phases), in balanced units.
  subroutine coefficients(system, scale, forced, phases, a, f, error)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: scale(:), phases(:)
    logical, intent(in) :: forced
    real(dp), allocatable, intent(out) :: a(:, :, :), f(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: n, k

    n = system%states
    allocate(a(n, n, size(phases)), f(n, size(phases)), source=0.0_dp)
    if (forced) then
      call system%sample(phases, a, f)
    else
      call system%sample(phases, a)
    end if
    do k = 1, size(phases)
      a(:, :, k) = system%period * a(:, :, k) * spread(scale, 1, n) / spread(scale, 2, n)
      f(:, k) = system%period * f(:, k) / scale
    end do
    if (all(ieee_is_finite(a)) .and. all(ieee_is_finite(f))) return
    call fatal_error(error, "the coefficients of the system are not finite", failed_computation)
  end subroutine coefficients

  !> What roundoff makes of a residual at the least, relative to the terms of which it consists.
  pure real(dp) function least_residual(reduction)
    type(reduction_type), intent(in) :: reduction

    least_residual = rounding * epsilon(1.0_dp) * reduction%condition
  end function least_residual

  !> The residuals of the reduction.
  subroutine measure(system, scale, forced, reduction, error)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: scale(:)
    logical, intent(in) :: forced
    type(reduction_type), intent(inout) :: reduction
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: a(:, :, :), f(:, :), between(:, :)
    complex(dp), allocatable :: s(:, :, :), p(:, :), d(:, :, :), g(:, :), interpolated(:, :, :), inverted(:, :), slow(:, :)
    integer :: n, m, k

    n = system%states
    m = reduction%angles
    associate (middle => equidistant(m, 0.5_dp))
      call coefficients(system, scale, forced, middle, a, f, error)
      if (allocated(error)) return
      between = transpose(interpolation(m, middle))
    end associate
    s = values_between(reduction%basis)
    p = 0 * f
    if (forced) p = matmul(reduction%response, between)
    call transform(a, f, s, p, matmul(matmul(reshape(reduction%basis, [n * n, m]), transpose(differentiation(m))), between), &
      & derivative_between(), d, g, error)
    if (allocated(error)) return

    interpolated = values_between(reduction%generator)
    reduction%residual = 0
    do k = 1, m
      ! Within the groups D is compared with its interpolation, between them with zero.
      where (spread(reduction%modes%group, 1, n) /= spread(reduction%modes%group, 2, n)) interpolated(:, :, k) = 0
      reduction%residual = reduction%residual + (uncoupled_size(reduction%generator(:, :, k), reduction%modes%group) &
        & + maxval(sum(abs(d(:, :, k) - interpolated(:, :, k)), dim=2))) / m
    end do
    reduction%forcing_residual = 0
    reduction%slow_residual = 0
    reduction%slow_effort = 0
    if (forced) then
      slow = matmul(reduction%forcing, between)
      where (spread(reduction%modes%group, 2, m) /= 0) slow = 0
      reduction%forcing_residual = sum([(fast_size(reduction%forcing(:, k), reduction%modes%group) &
        & + maxval(abs(g(:, k) - slow(:, k))), k = 1, m)]) / m
      if (any(reduction%modes%group == 0)) then
        reduction%slow_residual = sum([(maxval(abs(g(:, k) - slow(:, k)), mask=reduction%modes%group == 0), k = 1, m)]) / m
        reduction%slow_effort = maxval(abs(slow))
      end if
    end if

    reduction%condition = 1
    reduction%effort = 0
    do k = 1, m
      call inverse(s(:, :, k), inverted, error)
      if (allocated(error)) return
      reduction%condition = max(reduction%condition, norm2(abs(s(:, :, k))) * norm2(abs(inverted)))
      if (forced) reduction%effort = max(reduction%effort, norm2(f(:, k)) + maxval(abs(a)) * norm2(abs(p(:, k))))
    end do

  contains

    function values_between(values) result(interpolant)
      complex(dp), intent(in) :: values(:, :, :)
      complex(dp), allocatable :: interpolant(:, :, :)

      allocate(interpolant, source=reshape(matmul(reshape(values, [n * n, m]), between), [n, n, m]))
    end function values_between

    function derivative_between() result(derivative)
      complex(dp) :: derivative(n, m)

      derivative = 0
      if (forced) derivative = matmul(matmul(reduction%response, transpose(differentiation(m))), between)
    end function derivative_between

  end subroutine measure

end module gestell_floquet_reduction
