!> Computes the periodic motion of a second-order system as a Fourier series, with a bound on its error at any time.
!>
!> The series q satisfies the equations of motion at N equidistant phases up to rounding errors
!> (gestell_floquet_balance_harmonic_balance). At other N phases the acceleration lacks
!>
!>     w = q'' - M^-1 (h - B q' - C q).
!>
!> These phases lie a golden section of the spacing behind the others: there no harmonic is an alias of a lower one, whatever its
!> order. The error e of the motion is the periodic response to w, so |e| <= gain |w| in the norm of the energy
!> (gestell_floquet_balance_response_bound). Rounding errors of the coefficients and of the residual are added to |w|.
module gestell_floquet_balance_periodic_motion
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_balance_harmonic_balance, only: balance_to_rounding, balance_type
  use gestell_floquet_balance_response_bound, only: bound_response, response_type
  use gestell_floquet_choice_survey, only: survey_type
  use gestell_floquet_period_convergence, only: safety
  use gestell_floquet_period_monodromy, only: monodromy_type
  use gestell_floquet_period_turn_errors, only: relative_rounding
  use gestell_math_series_trigonometric, only: series_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: sample_by_phase, second_order_system
  implicit none (type, external)
  private

  public :: solve_motion

  !> Periodic motion of a system with n states
  type, public :: motion_type
    !> Fourier series of the displacements
    type(series_type) :: series
    !> 2 pi/T (rad/s)
    real(dp) :: omega = 0
    !> Bounds on the errors of the states at any time, shape (n)
    real(dp), allocatable :: error(:)
  contains
    procedure :: states
  end type motion_type

  !> Smallest and largest number of phases that are tried. More phases would cost more than an integration.
  integer, parameter :: fewest = 48, most = 128
  !> Part of the spacing of the phases by which those of the residual are shifted
  real(dp), parameter :: golden = 0.3819660112501052_dp

contains

  !> Computes the periodic motion of `system`.
  subroutine solve_motion(system, survey, monodromy, tolerance, motion, fits)
    class(periodic_system), intent(in) :: system
    !> The estimates from which the system was solved
    type(survey_type), intent(in) :: survey
    !> The solution over the period
    type(monodromy_type), intent(in) :: monodromy
    !> Allowed error bound relative to the motion, in the norm of the energy
    real(dp), intent(in) :: tolerance
    type(motion_type), intent(out) :: motion
    !> False if harmonic balance does not work for this system, or if its error bound exceeds the tolerance
    logical, intent(out) :: fits
    !> Relative residuals between which a motion is computed again with twice as many phases: with `hopeful` the residual then
    !> usually suffices, and with `rounding` it would not decrease
    real(dp), parameter :: hopeful = 1.0e-4_dp, rounding = 1.0e-14_dp
    type(balance_type) :: balance
    real(dp) :: lack
    integer :: phases

    fits = .false.
    select type (system)
    class is (second_order_system)
      balance%survey = survey
      phases = max(fewest, 16 * ceiling(4 * system%least_steps / 16.0_dp))
      do while (phases <= most)
        call balance_to_rounding(system, phases, tolerance, balance, fits)
        if (fits) then
          call bound_error(system, balance, monodromy, phases, tolerance, motion, lack, fits)
          if (fits .or. .not. (lack < hopeful .and. lack > rounding)) return
        else if (.not. (balance%left_out > tolerance .and. balance%left_out < hopeful)) then
          return
        end if
        phases = 2 * phases
      end do
    end select
  end subroutine solve_motion

  !> Bounds the error of the motion by its residual between the phases.
  subroutine bound_error(system, balance, monodromy, phases, tolerance, motion, lack, fits)
    class(second_order_system), intent(in) :: system
    !> The motion that satisfies the equations at `phases` phases
    type(balance_type), intent(in) :: balance
    type(monodromy_type), intent(in) :: monodromy
    integer, intent(in) :: phases
    real(dp), intent(in) :: tolerance
    type(motion_type), intent(inout) :: motion
    !> Largest residual relative to the largest acceleration
    real(dp), intent(out) :: lack
    logical, intent(out) :: fits
    !> Assumed number of rounding errors in each term of the residual
    real(dp), parameter :: roundings = 8
    real(dp), dimension(phases, system%states / 2) :: q, q_d, q_dd, residual, terms
    real(dp), dimension(phases, system%states) :: x, f
    !> Allocated on the heap because threads have small stacks.
    real(dp), allocatable :: p(:, :, :)
    real(dp) :: shifted(phases), size_of_motion, disturbance, error
    type(response_type) :: response
    integer :: n, half, i, j, k

    n = system%states
    half = n / 2
    motion%omega = 2 * pi / system%period
    if (allocated(motion%series%cosine)) deallocate(motion%series%cosine, motion%series%sine)
    allocate(motion%series%cosine(0:phases / 2 - 1, half), source=balance%harmonics(:phases / 2, :))
    allocate(motion%series%sine(0:phases / 2 - 1, half), source=balance%harmonics(phases / 2 + 1:, :))
    call motion%series%trim(monodromy%scale(:half), epsilon(1.0_dp) / 16 * largest(balance%harmonics, monodromy%scale(:half)))
    shifted = [((k + golden) / phases, k = 0, phases - 1)]
    allocate(p(phases, n, n))
    call sample_by_phase(system, shifted, p, f)
    call motion%series%values(shifted, q, q_d, q_dd)
    x(:, :half) = q
    x(:, half + 1:) = motion%omega * q_d
    residual = motion%omega**2 * q_dd - f(:, half + 1:)
    terms = abs(motion%omega**2 * q_dd) + abs(f(:, half + 1:))
    do j = 1, n
      do i = 1, half
        residual(:, i) = residual(:, i) - p(:, half + i, j) * x(:, j)
        terms(:, i) = terms(:, i) + abs(p(:, half + i, j) * x(:, j))
      end do
    end do
    call bound_response(balance%energy, motion%omega, monodromy, shifted, p, response, fits)
    lack = 1
    if (.not. fits) return
    associate (to => response%to, of_velocity => response%to(half + 1:, half + 1:) / motion%omega)
      size_of_motion = largest_norm(to, x)
      lack = largest_norm(of_velocity, residual)
      disturbance = safety * lack + roundings * epsilon(1.0_dp) * largest_norm(abs(of_velocity), terms) &
        & + (relative_rounding(system, phases, monodromy%phase_advance) + system%load_rounding) / (2 * pi) * size_of_motion
      lack = lack / max(largest_norm(abs(of_velocity), terms), tiny(lack))
      error = response%gain * disturbance
      ! Norms square their elements, and squares underflow below sqrt(tiny): a smaller motion has no bound.
      fits = error <= tolerance * size_of_motion .and. size_of_motion > sqrt(tiny(1.0_dp))
      motion%error = norm2(response%from, dim=2) * error
    end associate
  end subroutine bound_error

  !> Largest norm of A x over all phases; `x` has the shape (phases, size of x).
  pure real(dp) function largest_norm(a, x)
    real(dp), intent(in) :: a(:, :), x(:, :)
    real(dp) :: sums(size(x, 1)), squares(size(x, 1))
    integer :: i, j

    squares = 0
    do i = 1, size(a, 1)
      sums = 0
      do j = 1, size(a, 2)
        sums = sums + a(i, j) * x(:, j)
      end do
      squares = squares + sums**2
    end do
    largest_norm = sqrt(maxval(squares))
  end function largest_norm

  !> Largest harmonic in comparable units.
  pure real(dp) function largest(harmonics, scale)
    real(dp), intent(in) :: harmonics(:, :), scale(:)
    integer :: i

    largest = 0
    do i = 1, size(scale)
      largest = max(largest, maxval(abs(harmonics(:, i))) / scale(i))
    end do
  end function largest

  !> Computes the states x = (q, q') at phases t / T, shape (n, phases).
  subroutine states(self, phases, x)
    class(motion_type), intent(in) :: self
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: x(:, :)
    real(dp), dimension(size(phases), size(x, 1) / 2) :: q, q_d, q_dd
    real(dp) :: copy(size(phases))
    integer :: half

    half = size(x, 1) / 2
    copy = phases
    call self%series%values(copy, q, q_d, q_dd)
    x(:half, :) = transpose(q)
    x(half + 1:, :) = self%omega * transpose(q_d)
  end subroutine states

end module gestell_floquet_balance_periodic_motion
