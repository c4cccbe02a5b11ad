!> Decouples a system with fast free vibrations into groups of modes that are almost independent of each other. Implements (69)
!> and (70) of doc/theory.md: superadiabatic diagonalisation (M. V. Berry, Proc. R. Soc. A 414 (1987) 31,
!> doi:10.1098/rspa.1987.0131), here for matrices.
!>
!> With the phase t / T as the independent variable and A = T P, the substitution x = S y + p gives
!>
!>     y' = D y + g,   D = S^-1 (A S - S'),   g = S^-1 (A p + T f - p').
!>
!> The smooth periodic S and p are chosen such that D has no elements between groups and g vanishes outside the slow group. Such
!> S and p exist up to terms that are exponentially small in the distance between the groups. The unwanted elements of D and g
!> are made zero at the phases; midway between the phases they are measured. The cost does not depend on the frequencies of the
!> vibrations.
!>
!> All phases are processed at once (gestell_floquet_reduction_phasewise), and conjugate modes in real arithmetic
!> (gestell_floquet_reduction_conjugates). Coordinates refer to the modes at phase 0, so that S is close to the unit matrix.
module gestell_floquet_reduction
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: inverse
  use gestell_base_text, only: text
  use gestell_floquet_reduction_coefficients, only: change_coordinates, coefficients_type, sample
  use gestell_floquet_reduction_continued_modes, only: follow_modes
  use gestell_floquet_reduction_decoupling, only: balance, decouple, examine, motion_type
  use gestell_floquet_reduction_fast_response, only: decouple_forcing
  use gestell_floquet_reduction_modes, only: modes_type
  use gestell_floquet_reduction_phasewise, only: along_phases, multiply
  use gestell_floquet_reduction_residuals, only: measure, measure_forcing, residuals_type
  use gestell_floquet_reduction_resolution, only: phases_needed
  use gestell_floquet_reduction_separation, only: min_distance
  use gestell_floquet_reduction_trigonometric, only: equidistant, interpolation
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: reduce

  !> Result of a reduction of n states, in balanced units, with the phase t / T as the independent variable. Matrices have the real
  !> form of gestell_floquet_reduction_conjugates.
  type, public, extends(residuals_type) :: reduction_type
    !> Number N of phases at which the reduction is computed; it is even.
    integer :: angles = 0
    !> Group of each column of S, and index of the conjugate of each column.
    type(modes_type) :: modes
    !> `basis`: matrix S at the phases. `generator`: matrix D at the phases. `generator_between`: D midway between the phases.
    !> Shapes (N, n, n).
    real(dp), allocatable :: basis(:, :, :), generator(:, :, :), generator_between(:, :, :)
    !> `response`: p at the phases. `forcing`: g at the phases. Shapes (N, n); unallocated unless requested.
    real(dp), allocatable :: response(:, :), forcing(:, :)
    !> Integral over the period of tr P, the trace of the matrix of x' = P x + f. It is computed from values at the phases and
    !> midway between them.
    real(dp) :: trace = 0
    !> Number of evaluations of the coefficients.
    integer :: evaluations = 0
  end type reduction_type

  !> Result of decoupling the groups on one set of phases. S, D and S^-1 refer to coordinates whose basis is the columns of `start`,
  !> shape (n, n).
  type :: decoupled_type
    type(modes_type) :: modes
    real(dp), allocatable :: start(:, :), start_inverse(:, :), s(:, :, :)
    type(motion_type) :: motion
    !> Response p of the fast groups, and remainder g; allocated only if requested.
    real(dp), allocatable :: p(:, :), g(:, :)
    !> Coefficients A and T f in the coordinates whose basis is the columns of `start`.
    type(coefficients_type) :: own
    !> Remaining coupling: maximum row sum of the elements of D between groups, over all phases.
    real(dp) :: left = 0
    !> True if the decoupling on more phases can start from this result.
    logical :: settled = .false.
    !> Minimum distance between two groups, or between a fast group and zero. Defined only if `settled` is true.
    real(dp) :: distance = 0
  end type decoupled_type

  !> `fewest`, `most`: minimum and maximum number of phases. The number of phases that is needed is predicted from the harmonics. A
  !> prediction above `max_predicted` is not used: the number of phases is doubled instead.
  integer, parameter :: fewest = 32, max_predicted = 128, most = 1024
  !> Estimated roundoff of a residual, relative to its terms, in units of epsilon |S| |S^-1|.
  real(dp), parameter :: rounding = 32
  !> Upper limit on the tolerance of a reduction. A larger tolerance of the user is replaced by this value, because the extra
  !> accuracy costs little.
  real(dp), parameter :: loosest_tolerance = 1.0e-9_dp
  !> Maximum roundoff of a residual. If it is larger, no digit of the phase of a multiplier is correct.
  real(dp), parameter :: max_residual = 0.1_dp

contains

  !> Reduces `system`. The number of phases is increased until the residual is at most `tolerance` or the roundoff of the
  !> residual. For the forced part the residual is relative to the response p. Fails if the system cannot be reduced; the message
  !> gives the reason.
  subroutine reduce(system, scale, forced, tolerance, reduction, error)
    class(periodic_system), intent(in) :: system
    !> `scale`: units that balance the states, shape (n). `tolerance`: allowed residual.
    real(dp), intent(in) :: scale(:), tolerance
    !> If true, also compute the response p and the remainder g
    logical, intent(in) :: forced
    type(reduction_type), intent(out) :: reduction
    type(error_type), allocatable, intent(out) :: error
    type(coefficients_type) :: nodes, middle
    type(decoupled_type) :: decoupled
    real(dp) :: before, phase_advance, aim
    integer :: n, needed, evaluations

    if (allocated(system%breaks)) then
      call fatal_error(error, "the coefficients have jumps", failed_computation)
      return
    end if
    n = fewest
    do while (2 * n <= system%least_steps)
      n = 2 * n
    end do
    aim = min(tolerance, loosest_tolerance)
    evaluations = 0
    before = huge(before)
    do while (n <= most)
      call sample(system, scale, forced, equidistant(n), nodes, error)
      if (allocated(error)) return
      evaluations = evaluations + n
      phase_advance = maxval(abs(nodes%a))
      if (min_residual(reduction) * phase_advance > max_residual) then
        call fatal_error(error, "the free vibrations oscillate so often within the period that rounding destroys their phase", &
          & failed_computation)
        return
      end if
      ! Require groups at least pi N apart. The changes that N phases resolve are slower than the relative vibration of such groups.
      call decouple_groups(nodes, pi * n, 0.1_dp * aim, decoupled, error)
      if (allocated(error)) return
      needed = phases_for(decoupled, phase_advance, max(aim, min_residual(reduction) * phase_advance))
      if (needed == n) then
        call balance(decoupled%modes, decoupled%s, decoupled%motion)
        if (forced) then
          if (allocated(decoupled%p)) deallocate(decoupled%p, decoupled%g)
          allocate(decoupled%p, decoupled%g, mold=decoupled%own%f)
          call decouple_forcing(decoupled%own%f, decoupled%modes, 0.1_dp * aim, decoupled%s, decoupled%motion, decoupled%p, &
            & decoupled%g, error)
          if (allocated(error)) return
          needed = phases_for_response(decoupled, aim)
        end if
      end if
      if (needed > n) then
        n = needed
        cycle
      end if
      call sample(system, scale, forced, equidistant(n, 0.5_dp), middle, error)
      if (allocated(error)) return
      evaluations = evaluations + n
      call assemble(nodes, middle, decoupled, forced, reduction, error)
      if (allocated(error)) return
      if (reduction%residual <= max(tolerance, min_residual(reduction) * phase_advance) &
        & .and. reduction%forcing_residual <= max(tolerance, min_residual(reduction)) * reduction%effort &
        & .and. reduction%slow_residual <= max(tolerance * reduction%slow_effort, min_residual(reduction) * reduction%effort)) then
        reduction%evaluations = evaluations
        return
      end if
      if (reduction%residual > 0.5_dp * before) exit
      before = reduction%residual
      n = 2 * n
    end do
    call fatal_error(error, text(n) // " phases per period do not resolve the modes, which couple too strongly or change too " // &
      & "suddenly", failed_computation)
  end subroutine reduce

  !> Number of phases that resolves the generator D and the product A S to the error `allowed`. Returns the present number of
  !> phases if the distance between groups is too small for more phases.
  pure integer function phases_for(decoupled, phase_advance, allowed) result(phases)
    type(decoupled_type), intent(in) :: decoupled
    real(dp), intent(in) :: phase_advance, allowed

    phases = size(decoupled%s, 1)
    if (.not. decoupled%settled) return
    associate (needed => max(phases_needed(decoupled%motion%d, allowed, max_predicted), &
      & phases_needed(decoupled%s, allowed / phase_advance, max_predicted)))
      if (pi * needed <= decoupled%distance) phases = needed
    end associate
  end function phases_for

  !> Number of phases that resolves the response p. Returns the present number of phases if the distance between groups is too
  !> small for more phases.
  !>
  !> For the same number of phases, the groups must be twice as far apart as `phases_for` requires. Otherwise the error bound of
  !> p becomes large: half the number of phases would approach the order (cycles per period) of the slowest vibration of the fast
  !> groups. p itself is resolved to more digits than requested, because velocities may be small numbers in balanced units.
  pure integer function phases_for_response(decoupled, allowed) result(phases)
    type(decoupled_type), intent(in) :: decoupled
    real(dp), intent(in) :: allowed
    real(dp), parameter :: more_digits = 1.0e-3_dp
    real(dp) :: p(size(decoupled%p, 1), size(decoupled%p, 2), 1)

    phases = size(p, 1)
    if (.not. decoupled%settled) return
    p(:, :, 1) = decoupled%p
    associate (needed => phases_needed(p, max(more_digits * allowed, rounding * epsilon(1.0_dp)) * maxval(abs(p)), max_predicted))
      if (2 * pi * needed <= decoupled%distance) phases = needed
    end associate
  end function phases_for_response

  !> Smallest residual that is possible with rounding errors, relative to the terms that add up to the residual.
  pure real(dp) function min_residual(reduction)
    type(reduction_type), intent(in) :: reduction

    min_residual = rounding * epsilon(1.0_dp) * reduction%condition
  end function min_residual

  !> Decouples groups of modes whose eigenvalues differ by at least `gap`.
  !>
  !> The iteration starts from the result on fewer phases. If there is no such result, it starts from the modes at phase 0, which
  !> are used at all phases. If the distance between the resulting groups is less than `gap`, the iteration starts again from
  !> eigenvectors that are followed from phase to phase. Fails if all modes are slow or the eigenvectors cannot be followed.
  subroutine decouple_groups(nodes, gap, enough, decoupled, error)
    type(coefficients_type), intent(in) :: nodes
    real(dp), intent(in) :: gap, enough
    type(decoupled_type), intent(inout) :: decoupled
    type(error_type), allocatable, intent(out) :: error
    !> Largest coupling between groups, relative to `gap`, at which a result counts as settled.
    real(dp), parameter :: little = 1.0e-3_dp

    if (.not. decoupled%settled) then
      call follow_modes(nodes%a(:1, :, :), gap, decoupled%modes, error)
      if (allocated(error)) return
    end if
    call decouple_from_modes(nodes, enough, decoupled, error)
    decoupled%settled = .not. allocated(error)
    if (decoupled%settled) decoupled%settled = decoupled%left <= little * gap
    if (decoupled%settled) decoupled%distance = min_distance(decoupled%motion%d, decoupled%modes)
    decoupled%settled = decoupled%settled .and. decoupled%distance >= gap
    if (decoupled%settled) return
    call follow_modes(nodes%a, gap, decoupled%modes, error)
    if (.not. allocated(error)) call decouple_from_modes(nodes, enough, decoupled, error)
  end subroutine decouple_groups

  !> Decouples the groups `decoupled%modes`. If `decoupled` is settled, the iteration starts from its S; if not, it starts from the
  !> bases of the groups.
  subroutine decouple_from_modes(nodes, enough, decoupled, error)
    type(coefficients_type), intent(in) :: nodes
    real(dp), intent(in) :: enough
    type(decoupled_type), intent(inout) :: decoupled
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: s(:, :, :), between(:, :)
    integer :: k

    allocate(s, source=0 * nodes%a)
    if (decoupled%settled) then
      allocate(between, source=interpolation(size(decoupled%s, 1), equidistant(size(s, 1))))
      call along_phases(between, decoupled%s, s)
    else
      decoupled%start = decoupled%modes%basis(1, :, :)
      call inverse(decoupled%start, decoupled%start_inverse, error)
      if (allocated(error)) return
      if (size(decoupled%modes%basis, 1) > 1) then
        call multiply(decoupled%start_inverse, decoupled%modes%basis, s)
      else
        do k = 1, size(s, 2)
          s(:, k, k) = 1
        end do
      end if
    end if
    call move_alloc(s, decoupled%s)
    call change_coordinates(nodes, decoupled%start, decoupled%start_inverse, decoupled%own)
    if (allocated(decoupled%motion%d)) deallocate(decoupled%motion%d, decoupled%motion%inverted)
    call examine(decoupled%own%a, decoupled%modes, decoupled%s, decoupled%motion, decoupled%left, error)
    if (allocated(error)) return
    call decouple(decoupled%own%a, decoupled%modes, enough, decoupled%s, decoupled%motion, decoupled%left, error)
  end subroutine decouple_from_modes

  !> Stores the results in `reduction` and measures the residuals. Fails if S is singular midway between the phases.
  subroutine assemble(nodes, middle, decoupled, forced, reduction, error)
    type(coefficients_type), intent(in) :: nodes, middle
    type(decoupled_type), intent(in) :: decoupled
    logical, intent(in) :: forced
    type(reduction_type), intent(inout) :: reduction
    type(error_type), allocatable, intent(out) :: error
    type(coefficients_type) :: own
    type(motion_type) :: between
    integer :: k

    associate (residuals => reduction%residuals_type)
      call change_coordinates(middle, decoupled%start, decoupled%start_inverse, own)
      call measure(own%a, decoupled%s, decoupled%motion%d, decoupled%modes, decoupled%start, decoupled%start_inverse, &
        & residuals, between, error)
      if (allocated(error)) return
      reduction%angles = size(nodes%a, 1)
      reduction%modes = decoupled%modes
      reduction%generator = decoupled%motion%d
      reduction%basis = decoupled%s
      call multiply(decoupled%start, decoupled%s, reduction%basis)
      call move_alloc(between%d, reduction%generator_between)
      reduction%trace = 0
      do k = 1, size(nodes%f, 2)
        reduction%trace = reduction%trace + (sum(nodes%a(:, k, k)) + sum(middle%a(:, k, k))) / (2 * reduction%angles)
      end do
      if (.not. forced) return
      reduction%forcing = decoupled%g
      call measure_forcing(own%a, own%f, decoupled%p, decoupled%g, between, decoupled%modes, decoupled%start, &
        & maxval(abs(middle%a)), residuals)
      reduction%response = decoupled%p
      call multiply(decoupled%start, decoupled%p, reduction%response)
    end associate
  end subroutine assemble

end module gestell_floquet_reduction
