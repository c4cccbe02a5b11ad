!> Decouples a system with fast free vibrations into groups of modes that hardly interact. Implements (69) and (70) of
!> doc/theory.md: superadiabatic diagonalisation (M. V. Berry, Proc. R. Soc. A 414 (1987) 31, doi:10.1098/rspa.1987.0131, for
!> matrices).
!>
!> With the phase t / T as the independent variable, A = T P and x = S y + p
!>
!>     y' = D y + g,   D = S^-1 (A S - S'),   g = S^-1 (A p + T f - p').
!>
!> The smooth periodic S and p are chosen such that D has no elements between groups and g vanishes outside the slow group. They
!> exist up to terms that are exponentially small in the distance of the groups. The remainder is measured midway between the phases
!> at which it was made to vanish. The cost does not depend on how fast the vibrations are.
!>
!> All phases are treated at once (gestell_floquet_reduction_phasewise), conjugate modes in real arithmetic
!> (gestell_floquet_reduction_conjugates). The coordinates are those of the modes at phase 0, in which S is close to E.
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
  use gestell_floquet_reduction_separation, only: least_distance
  use gestell_floquet_reduction_trigonometric, only: equidistant, interpolation
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: reduce

  !> Result of a reduction of n states, in balanced units, with the phase t / T as the independent variable. Matrices have the real
  !> form of gestell_floquet_reduction_conjugates.
  type, public, extends(residuals_type) :: reduction_type
    !> Number N of phases; even.
    integer :: angles = 0
    !> Groups of the columns of S, and pairs of conjugate columns.
    type(modes_type) :: modes
    !> S and D at the phases, and D midway between the phases; shapes (N, n, n).
    real(dp), allocatable :: basis(:, :, :), generator(:, :, :), generator_between(:, :, :)
    !> p and g at the phases, shape (N, n); unallocated unless requested.
    real(dp), allocatable :: response(:, :), forcing(:, :)
    !> Integral of tr P over the period, from the phases and the points midway between them.
    real(dp) :: trace = 0
    !> Number of evaluations of the coefficients.
    integer :: evaluations = 0
  end type reduction_type

  !> Groups that are decoupled at the phases: S, D and S^-1 in the coordinates of the columns of `start`, shape (n, n).
  type :: decoupled_type
    type(modes_type) :: modes
    real(dp), allocatable :: start(:, :), start_inverse(:, :), s(:, :, :)
    type(motion_type) :: motion
    !> p, and the g that it leaves; allocated only if requested.
    real(dp), allocatable :: p(:, :), g(:, :)
    !> Coefficients A and T f in the coordinates of `start`.
    type(coefficients_type) :: own
    !> Maximum row sum of the elements of D between groups, over all phases.
    real(dp) :: left = 0
    !> `settled`: True if the result can start a decoupling on more phases. `distance`: then the minimum distance between two
    !> groups, or of a fast group from zero.
    logical :: settled = .false.
    real(dp) :: distance = 0
  end type decoupled_type

  !> Limits of the number of phases are `fewest` and `most`. Predicted numbers are used up to `most_foretold`; beyond it the number
  !> is doubled.
  integer, parameter :: fewest = 32, most_foretold = 128, most = 1024
  !> Factor on epsilon |S| |S^-1| that gives the roundoff of a residual, relative to its terms.
  real(dp), parameter :: rounding = 32
  !> Maximum tolerance aimed at, even if the user's tolerance is larger: the extra accuracy costs little.
  real(dp), parameter :: least_aim = 1.0e-9_dp
  !> Maximum roundoff of a residual: beyond it nothing is known about a multiplier.
  real(dp), parameter :: most_residual = 0.1_dp

contains

  !> Reduces `system` until the residual is at most `tolerance` or roundoff. For the forced part the tolerance is relative to p.
  !> Fails if the system cannot be reduced; the message gives the reason.
  subroutine reduce(system, scale, forced, tolerance, reduction, error)
    class(periodic_system), intent(in) :: system
    !> Units that balance the states, shape (n); tolerance for the residual
    real(dp), intent(in) :: scale(:), tolerance
    !> True: compute p and g too
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
    aim = min(tolerance, least_aim)
    evaluations = 0
    before = huge(before)
    do while (n <= most)
      call sample(system, scale, forced, equidistant(n), nodes, error)
      if (allocated(error)) return
      evaluations = evaluations + n
      phase_advance = maxval(abs(nodes%a))
      if (least_residual(reduction) * phase_advance > most_residual) then
        call fatal_error(error, "the free vibrations oscillate so often within the period that rounding destroys their phase", &
          & failed_computation)
        return
      end if
      ! Require groups at least pi N apart. The changes that N phases resolve are slower than the relative vibration of such groups.
      call decouple_groups(nodes, pi * n, 0.1_dp * aim, decoupled, error)
      if (allocated(error)) return
      needed = phases_for(decoupled, phase_advance, max(aim, least_residual(reduction) * phase_advance))
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
      if (reduction%residual <= max(tolerance, least_residual(reduction) * phase_advance) &
        & .and. reduction%forcing_residual <= max(tolerance, least_residual(reduction)) * reduction%effort &
        & .and. reduction%slow_residual <= max(tolerance * reduction%slow_effort, &
        & least_residual(reduction) * reduction%effort)) then
        reduction%evaluations = evaluations
        return
      end if
      if (reduction%residual > 0.5_dp * before) exit
      before = reduction%residual
      n = 2 * n
    end do
    call fatal_error(error, "the modes couple too strongly or change too suddenly for " // text(n) // " phases", &
      & failed_computation)
  end subroutine reduce

  !> Number of phases that resolves D and A S to `allowed`. Returns the present number if the groups are too close for more phases.
  pure integer function phases_for(decoupled, phase_advance, allowed) result(phases)
    type(decoupled_type), intent(in) :: decoupled
    real(dp), intent(in) :: phase_advance, allowed

    phases = size(decoupled%s, 1)
    if (.not. decoupled%settled) return
    associate (needed => max(phases_needed(decoupled%motion%d, allowed, most_foretold), &
      & phases_needed(decoupled%s, allowed / phase_advance, most_foretold)))
      if (pi * needed <= decoupled%distance) phases = needed
    end associate
  end function phases_for

  !> Number of phases that resolves p. Returns the present number if the groups are too close for more phases.
  !>
  !> p is measured in units in which velocities may be small. Its error bound therefore needs more digits than requested. The groups
  !> must be twice as far apart as in `phases_for`: the bound grows as the phases come close to resolving the slowest fast
  !> vibration.
  pure integer function phases_for_response(decoupled, allowed) result(phases)
    type(decoupled_type), intent(in) :: decoupled
    real(dp), intent(in) :: allowed
    real(dp), parameter :: more_digits = 1.0e-3_dp
    real(dp) :: p(size(decoupled%p, 1), size(decoupled%p, 2), 1)

    phases = size(p, 1)
    if (.not. decoupled%settled) return
    p(:, :, 1) = decoupled%p
    associate (needed => phases_needed(p, max(more_digits * allowed, rounding * epsilon(1.0_dp)) * maxval(abs(p)), most_foretold))
      if (2 * pi * needed <= decoupled%distance) phases = needed
    end associate
  end function phases_for_response

  !> Smallest residual that roundoff permits, relative to the terms of the residual.
  pure real(dp) function least_residual(reduction)
    type(reduction_type), intent(in) :: reduction

    least_residual = rounding * epsilon(1.0_dp) * reduction%condition
  end function least_residual

  !> Decouples groups of modes that stay apart by at least `gap`.
  !>
  !> The iteration starts from the result on fewer phases, or from the groups at phase 0 applied to all phases. If this does not
  !> give groups that are `gap` apart, it starts again from eigenvectors followed from phase to phase. Errors: all modes are slow;
  !> the eigenvectors cannot be followed.
  subroutine decouple_groups(nodes, gap, enough, decoupled, error)
    type(coefficients_type), intent(in) :: nodes
    real(dp), intent(in) :: gap, enough
    type(decoupled_type), intent(inout) :: decoupled
    type(error_type), allocatable, intent(out) :: error
    !> Maximum coupling that remains between groups, relative to their distance.
    real(dp), parameter :: little = 1.0e-3_dp

    if (.not. decoupled%settled) then
      call follow_modes(nodes%a(:1, :, :), gap, decoupled%modes, error)
      if (allocated(error)) return
    end if
    call decouple_from_modes(nodes, enough, decoupled, error)
    decoupled%settled = .not. allocated(error)
    if (decoupled%settled) decoupled%settled = decoupled%left <= little * gap
    if (decoupled%settled) decoupled%distance = least_distance(decoupled%motion%d, decoupled%modes)
    decoupled%settled = decoupled%settled .and. decoupled%distance >= gap
    if (decoupled%settled) return
    call follow_modes(nodes%a, gap, decoupled%modes, error)
    if (.not. allocated(error)) call decouple_from_modes(nodes, enough, decoupled, error)
  end subroutine decouple_groups

  !> Decouples `decoupled%modes`. The iteration starts from their bases, or from the present S if `decoupled` is settled.
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

  !> Assembles the result and measures its residuals. Fails if S is singular midway between the phases.
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
