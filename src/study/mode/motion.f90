!> Computes the free vibrations of a periodic system over one period and removes their growth. By Floquet's theorem a free vibration
!> is
!>
!>     x(t) = exp(lambda t) p(t),   p(t + T) = p(t).
module gestell_study_mode_motion
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_math_matrix, only: balanced
  use gestell_floquet_solution_factored, only: factored_type, solve_factored
  use gestell_floquet_integrator_mesh, only: merged, refined
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: solve_motions

  !> The free vibrations that belong to the n multipliers of a system.
  type, public :: motions_type
    !> The exponents lambda (1/s), shape (n). Their imaginary parts are known up to multiples of 2 pi / T
    complex(dp), allocatable :: exponent(:)
    !> Bounds on the relative errors of the multipliers rho, shape (n)
    real(dp), allocatable :: error(:)
    !> Signs of Krein's form (`krein_signs`), shape (n); unallocated if the system may not conserve energy
    integer, allocatable :: signs(:)
    !> Positions of the periodic parts p(t) at t / T = k / samples, k = 0, 1, ...; shape (samples, n / 2, n). `samples` is a power
    !> of two
    complex(dp), allocatable :: positions(:, :, :)
  end type motions_type

  !> Maximum phase advance over the period (rad) for which free vibrations are computed.
  real(dp), parameter :: max_turns = 1.0e5_dp
  !> Number of integration steps whose state-transition matrices are computed together.
  integer, parameter :: block_length = 64

contains

  !> Computes all free vibrations from the factors of the monodromy matrix and from the eigenvectors at the ends of the factors. In
  !> this way a small vibration keeps its digits next to a larger one, and none underflows or overflows. Fails if `solve_factored`
  !> fails, or if the vibrations are too fast for the period.
  subroutine solve_motions(system, accuracy, motions, error)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    type(motions_type), intent(out) :: motions
    type(error_type), allocatable, intent(out) :: error
    type(factored_type) :: factored
    type(survey_type) :: survey
    integer :: n, samples

    call survey_system(system, survey, error)
    if (allocated(error)) return
    if (survey%phase_advance > max_turns) then
      call fatal_error(error, "the modes cannot be identified: within the period the free vibrations oscillate too many times", &
        & failed_computation)
      return
    end if
    call solve_factored(system, accuracy_type(tolerance=accuracy%tolerance), .false., factored, error, survey)
    if (.not. allocated(error) .and. allocated(factored%failure)) allocate(error, source=factored%failure)
    if (allocated(error)) return
    n = system%states
    motions%exponent = factored%spectrum%z
    motions%error = factored%spectrum%bound
    if (allocated(factored%signs)) motions%signs = factored%signs
    ! Number of samples: more than twice the order of the fastest vibration, plus the harmonics that the coefficients add.
    samples = 2**ceiling(log(max(64.0_dp, 1.5_dp * survey%phase_advance / pi + 4 * system%least_steps)) / log(2.0_dp))
    allocate(motions%positions(samples, n / 2, n))
    call follow_vectors(system, factored, motions, error)
    motions%exponent = motions%exponent / system%period
  end subroutine solve_motions

  !> Computes the periodic parts p of all free vibrations at equidistant phases. The period is divided into segments. In each
  !> segment the integration starts from the eigenvectors at its beginning.
  subroutine follow_vectors(system, factored, motions, error)
    class(periodic_system), intent(in) :: system
    type(factored_type), intent(in) :: factored
    type(motions_type), intent(inout) :: motions
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: nodes(:), maps(:, :, :)
    complex(dp) :: now(system%states, system%states), past(system%states)
    integer :: samples, next, segment, first, last, k

    samples = size(motions%positions, 1)
    allocate(maps(block_length, system%states, system%states))
    next = 1
    segment = 1
    past = 0
    associate (factors => factored%factors, x => factored%spectrum%vectors%x, lambda => factored%spectrum%vectors%lambda)
      nodes = refined(system, factors%nodes, merged(factors%ends, [(real(k, dp) / samples, k = 0, samples - 1)]))
      now = x(:, :, 1)
      call keep(0.0_dp)
      do first = 1, size(nodes) - 1, block_length
        last = min(first + block_length - 1, size(nodes) - 1)
        call factors%method%maps(system, nodes(first:last), nodes(first + 1:last + 1), maps, error)
        if (allocated(error)) return
        do k = first, last
          now = matmul(balanced(maps(k - first + 1, :, :), factors%scale), now)
          if (nodes(k + 1) >= factors%ends(segment + 1) .and. segment < size(x, 3)) then
            past = past + log(lambda(:, segment))
            segment = segment + 1
            now = x(:, :, segment)
          end if
          call keep(nodes(k + 1))
        end do
      end do
    end associate

  contains

    !> Stores the periodic parts p of all vibrations if `phase` is the next phase at which they are requested.
    subroutine keep(phase)
      real(dp), intent(in) :: phase
      integer :: i, f

      if (next > samples) return
      if (real(next - 1, dp) / samples > phase) return
      f = system%states / 2
      do i = 1, system%states
        motions%positions(next, :, i) = exp(past(i) - motions%exponent(i) * phase) * now(:f, i) * factored%scale(:f)
      end do
      next = next + 1
    end subroutine keep

  end subroutine follow_vectors

end module gestell_study_mode_motion
