!> Solves a system by the factors of its monodromy matrix ("Factors" in doc/theory.md).
module gestell_floquet_solution_factored
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_factors_cycle, only: accumulate, distance_from_one, spectrum_type, periodic_answer, solve_spectrum
  use gestell_floquet_factors, only: factors_type, solve_factors
  use gestell_floquet_period_liouville, only: defect_of
  use gestell_floquet_period_period_map, only: trajectory
  use gestell_floquet_multipliers_krein, only: krein_signs
  use gestell_floquet_multipliers, only: arrange, multipliers_type, pair_conjugates
  use gestell_floquet_solution_part_solution, only: part_solution_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_choice_survey, only: survey_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, raise_resonance
  use gestell_floquet_period_turn_errors, only: compare, comparison_type, relative_rounding, compute_differences, turn_errors_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: conserved_form
  implicit none (type, external)
  private

  public :: solve_factored

  !> Solution by factors.
  type, extends(part_solution_type), public :: factored_type
    !> Factors of the monodromy matrix
    type(factors_type) :: factors
    !> Multipliers and eigenvectors of the product of the factors
    type(spectrum_type) :: spectrum
    !> Signs of Krein's form (`krein_signs`), shape (n); unallocated if the system may not conserve energy
    integer, allocatable :: signs(:)
    !> Error message that explains why the spectrum could not be computed; unallocated if it was computed
    type(error_type), allocatable :: failure
    !> Periodic motion at the starts of the K segments, in balanced units, shape (n, K). Unallocated if there is no forcing, and at
    !> resonance.
    real(dp), allocatable :: starts(:, :)
  contains
    procedure :: multipliers => part_multipliers, start => part_start, follow => part_motion
    procedure :: errors => part_errors, liouville_defect => part_liouville_defect
  end type factored_type

contains

  !> Computes the factors of `system` to the requested accuracy, and their spectrum. If the spectrum cannot be computed, the reason
  !> is stored in `factored%failure`, and later requests for multipliers or the periodic motion return it as their error. Fails in
  !> the cases in which `solve_factors` fails.
  subroutine solve_factored(system, accuracy, forced, factored, error, surveyed)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    !> If true, also compute the data for the periodic motion
    logical, intent(in) :: forced
    type(factored_type), intent(out) :: factored
    type(error_type), allocatable, intent(out) :: error
    !> Estimates from `survey_system`, if the caller already has them
    type(survey_type), intent(in), optional :: surveyed
    real(dp), allocatable :: form(:, :)
    integer :: i

    call solve_factors(system, accuracy, forced, factored%factors, error, surveyed)
    if (allocated(error)) return
    factored%scale = factored%factors%scale
    factored%phase_advance = factored%factors%phase_advance
    associate (evidence => factored%evidence, factors => factored%factors)
      evidence%methods = trim(factors%method%name)
      evidence%evaluations = factors%evaluations
      evidence%error = factors%relative_error
      evidence%steps = factors%steps
      evidence%factors = size(factors%a, 3)
    end associate
    associate (spectrum => factored%spectrum)
      call solve_spectrum(factored%factors, spectrum, factored%failure)
      if (allocated(factored%failure)) return
      call conserved_form(system, form)
      if (allocated(form)) call find_signs(factored, form)
      if (.not. forced) return
      spectrum%distance = [(distance_from_one(spectrum, i), i = 1, system%states)]
      if (all(spectrum%distance > 0)) call periodic_answer(spectrum, factored%factors%b, factored%starts)
    end associate
  end subroutine solve_factored

  !> Computes the signs of Krein's form from the left eigenvectors. The signs are 0 if a multiplier is large or has a large error.
  !> To first order, as equation (71), the largest error of a multiplier also bounds the error of the product of the factors.
  subroutine find_signs(factored, form)
    type(factored_type), intent(inout) :: factored
    !> Omega, shape (n, n); see `conserved_form`
    real(dp), intent(in) :: form(:, :)
    complex(dp), allocatable :: left(:, :)
    integer :: n

    n = size(form, 1)
    allocate(factored%signs(n), source=0)
    associate (spectrum => factored%spectrum, d => factored%scale)
      if (any(abs(real(spectrum%z)) > 1 .or. spectrum%bound > 1)) return
      left = conjg(transpose(spectrum%vectors%y(:, :, 1)))
      left = left / spread(norm2(abs(left), dim=1), 1, n)
      factored%signs = krein_signs(exp(spectrum%z), exp(real(spectrum%z)) * spectrum%bound, left, maxval(exp(real(spectrum%z)) &
        & * spectrum%bound), spread(d, 2, n) * form * spread(d, 1, n))
    end associate
  end subroutine find_signs

  !> Implements `multipliers` of part_solution_type.
  subroutine part_multipliers(self, vectors, multipliers, error)
    class(factored_type), intent(in) :: self
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error

    if (allocated(self%failure)) then
      allocate(error, source=self%failure)
      return
    end if
    multipliers%exponent = self%spectrum%z
    multipliers%error = self%spectrum%bound
    multipliers%condition = self%spectrum%condition
    if (allocated(self%signs)) multipliers%krein = self%signs
    if (vectors) multipliers%vectors = self%spectrum%vectors%x(:, :, 1) * spread(self%scale, 2, size(self%scale))
    call pair_conjugates(multipliers)
    multipliers%exponent = multipliers%exponent / self%factors%period
    call arrange(multipliers)
  end subroutine part_multipliers

  !> Checks that the starts of the periodic motion exist. Fails if the spectrum could not be computed, or if a multiplier equals 1
  !> within its error (resonance).
  subroutine check_starts(self, error)
    class(factored_type), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error

    if (allocated(self%failure)) then
      allocate(error, source=self%failure)
    else if (.not. allocated(self%starts)) then
      call raise_resonance(error)
    end if
  end subroutine check_starts

  !> Implements `start` of part_solution_type.
  subroutine part_start(self, solution, error)
    class(factored_type), intent(in) :: self
    type(periodic_solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: doubt(:), at_starts(:, :)
    integer :: count, k

    call check_starts(self, error)
    if (allocated(error)) return
    associate (factors => self%factors, x => self%starts)
      count = size(x, 2)
      allocate(doubt(count))
      do k = 1, count
        doubt(k) = factors%error(k) * norm2(x(:, k)) + factors%b_error(k) &
          & + size(x, 1) * epsilon(1.0_dp) * (norm2(x(:, modulo(k, count) + 1)) + norm2(factors%a(:, :, k)) * norm2(x(:, k)))
      end do
      call accumulate(factors, self%spectrum, doubt, at_starts)
      solution%x0 = x(:, 1) * self%scale
    end associate
    solution%error = at_starts(:, 1) * self%scale
    solution%condition = maxval(self%spectrum%condition / self%spectrum%distance)
  end subroutine part_start

  !> Implements `follow` of part_solution_type. Each segment is integrated from its own start, so that growing modes remain small.
  subroutine part_motion(self, system, x0, phases, x, error)
    class(factored_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: x0(:), phases(:)
    real(dp), intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: k, first, last, begin, finish

    associate (unused_start => x0)
    end associate
    call check_starts(self, error)
    if (allocated(error)) return
    last = 0
    begin = 1
    associate (factors => self%factors, starts => self%starts)
      do k = 1, size(starts, 2)
        first = last + 1
        do while (last < size(phases))
          if (phases(last + 1) >= factors%ends(k + 1) .and. k < size(starts, 2)) exit
          last = last + 1
        end do
        finish = begin
        do while (factors%nodes(finish) < factors%ends(k + 1))
          finish = finish + 1
        end do
        call trajectory(system, factors%method, factors%nodes(begin:finish), starts(:, k) * self%scale, phases(first:last), &
          & x(:, first:last), error)
        if (allocated(error)) return
        begin = finish
      end do
    end associate
  end subroutine part_motion

  !> Implements `errors` of part_solution_type.
  subroutine part_errors(self, system, phases, x, errors, error, disturbance)
    class(factored_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: phases(:), x(:, :)
    type(turn_errors_type), intent(out) :: errors
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: disturbance
    type(comparison_type) :: comparison, turn
    real(dp), allocatable :: z(:, :), own(:), at_starts(:, :)
    integer :: count

    call check_starts(self, error)
    if (allocated(error)) return
    count = size(self%starts, 2)
    associate (factors => self%factors, scale => spread(self%scale, 2, count))
      call compare(system, factors%method, factors%nodes, self%scale, factors%ends, self%starts * scale, phases, x, &
        & comparison, error)
      if (.not. allocated(error)) call compare(system, factors%method, factors%nodes, self%scale, factors%ends, &
        & self%starts * scale, factors%ends(:1), x(:, :1), turn, error)
      if (allocated(error)) return
      call periodic_answer(self%spectrum, turn%defect / scale, z)
      z = z * scale
    end associate
    own = (relative_rounding(system, comparison%steps, self%phase_advance) + system%load_rounding) * comparison%size / count
    if (present(disturbance)) own = own + disturbance / minval(self%scale) / count
    call accumulate(self%factors, self%spectrum, own, at_starts)
    ! Pass z twice: each segment starts a new motion.
    call compute_differences(comparison, self%scale, z, z, at_starts, own, errors)
  end subroutine part_errors

  !> Implements `liouville_defect` of part_solution_type.
  subroutine part_liouville_defect(self, system, defect, error)
    class(factored_type), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(out) :: defect
    type(error_type), allocatable, intent(out) :: error

    call defect_of(system, self%factors%steps, self%factors%a, defect, error)
  end subroutine part_liouville_defect

end module gestell_floquet_solution_factored
