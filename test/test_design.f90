!> Designs: closed forms, published counterweights, proofs, SciPy and differential evolution.
module test_design
  use checks, only: check_success, check_that
  use design_families, only: new_design, places
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_input_machine_family, only: document_family_type
  use gestell_math_optimum_minimax, only: optimum_type
  use gestell_model_mechanism, only: a1_dd, a2_dd, table_columns
  use gestell_study_design, only: halton, is_convex, bound_gap, search_from
  use gestell_study_design_goal, only: new_goal
  use gestell_study_design_problem, only: design_options, evaluate_goals, goal_branches_type, inside
  use gestell_study_measure, only: peak_measure, rms_measure
  use gestell_task_common_configuration, only: configuration_type
  use slow_tests, only: new_slow
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_design

contains

  subroutine collect_design(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the best counterweight of a crank agrees with the closed form", test_crank), &
      & new_unittest("the design finds the complete balance of a four-bar", test_complete), &
      & new_unittest("the proved optimum is better than every random feasible point", test_proof), &
      & new_unittest("the optimum of a convex design agrees with SciPy", test_convex), &
      & new_slow("the design of a mounted machine is as good as differential evolution's", test_evolution)]
  end subroutine collect_design

  !> The force is -Omega^2 S'', and a counterweight adds u exp(i phi) to S. The rms is smallest if u is minus the coefficient c
  !> of exp(i phi) in S; the rest of the series remains (Parseval).
  subroutine test_crank(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 256
    type(document_family_type) :: family
    type(design_options) :: options
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp) :: table(n, table_columns), phi(n), left
    complex(dp) :: c, s(n)
    integer :: k

    call new_design(places(:2), "shaking.f", rms_measure, family, options, configuration, error)
    if (allocated(error)) return
    call search_from(family, options, [0.1_dp, -0.1_dp], optimum, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    phi = [(2 * pi * k / n, k = 1, n)]
    call configuration%frame%mechanism%tabulate(phi, table)
    s = -cmplx(table(:, a1_dd), table(:, a2_dd), dp)
    c = sum(s * exp(cmplx(0, -phi, dp))) / n
    left = configuration%frame%speed**2 * sqrt(sum(abs(s)**2) / n - abs(c)**2)
    ! the counterweight has 1 kg
    call check_that(error, abs(optimum%x - [-real(c), -aimag(c)]), "<=", 1.0e-8_dp, "its place")
    call check_that(error, abs(optimum%objective / left - 1), "<=", 1.0e-12_dp, "what is left")
    call check_that(error, is_convex(options), "==", .true., "convex")
    call check_that(error, bound_gap(options, optimum) / left, "<=", 1.0e-8_dp, "gap")
  end subroutine test_crank

  !> Berkof, Lowen, J. Eng. Ind. 91, 1969, 21-26: opposite to crank and rocker, 0.0365675675675676 and 0.0667027027027027 kg m.
  subroutine test_complete(error)
    type(error_type), allocatable, intent(out) :: error
    type(document_family_type) :: family
    type(design_options) :: options
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp) :: before

    call new_design(places, "shaking.f", rms_measure, family, options, configuration, error)
    if (allocated(error)) return
    before = value_at([0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp])
    call search_from(family, options, [0.1_dp, -0.1_dp, 0.0_dp, 0.05_dp], optimum, failure)
    call check_success(error, failure)
    call check_that(error, optimum%objective / before, "<=", 1.0e-6_dp, "the force that is left")
    call check_that(error, abs(optimum%x - [-0.0365675675675676_dp, 0.0_dp, -0.0667027027027027_dp, 0.0_dp]), "<=", 1.0e-7_dp, &
      & "the counterweights")

  contains

    real(dp) function value_at(x)
      real(dp), intent(in) :: x(:)
      type(goal_branches_type) :: at

      call evaluate_goals(family, options, options%objectives, x, .false., at, failure)
      value_at = maxval(at%value)
    end function value_at

  end subroutine test_complete

  !> Peak of the force, limited mass: the gap is small, and no random point within the limit is better than the gap allows.
  subroutine test_proof(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: paths(6) = [character(len=20) :: places, "link(one).mass", "link(two).mass"]
    type(document_family_type) :: family
    type(design_options) :: options
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(goal_branches_type) :: at
    type(gestell_error), allocatable :: failure
    real(dp) :: gap, x(6)
    integer :: k

    call new_design(paths, "shaking.f", peak_measure, family, options, configuration, error)
    if (allocated(error)) return
    deallocate(options%constraints)
    allocate(options%constraints(1))
    call new_goal(configuration%frame, configuration%probes, "added_mass", peak_measure, options%constraints(1), failure)
    options%constraints%offset = configuration%frame%mass + configuration%frame%mechanism%mass
    options%constraints%limit = -1.6_dp
    call check_that(error, is_convex(options), "==", .true., "convex")
    call search_from(family, options, [0.1_dp, -0.1_dp, 0.0_dp, 0.05_dp, 0.3_dp, 0.3_dp], optimum, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    gap = bound_gap(options, optimum)
    call check_that(error, optimum%feasible, "==", .true., "feasible")
    call check_that(error, gap / optimum%objective, "<=", 1.0e-5_dp, "gap")
    call check_that(error, optimum%stationarity, "<=", 1.0e-6_dp, "optimality")
    call check_that(error, sum(optimum%x(5:)), "<=", 0.4_dp + 1.0e-9_dp, "mass")
    do k = 1, 300
      x = options%lower + halton(k, 6) * (options%upper - options%lower)
      x(5:) = x(5:) * min(1.0_dp, 0.4_dp / sum(x(5:)))
      if (mod(k, 2) == 0) x = optimum%x + 0.01_dp * (x - optimum%x)
      call evaluate_goals(family, options, options%objectives, x, .false., at, failure)
      call check_that(error, maxval(at%value), ">=", optimum%objective - gap, "a point of the cloud")
      if (allocated(error)) return
    end do
  end subroutine test_proof

  !> SciPy 1.17.1, SLSQP with kinematics of its own (720 angles, Fourier's derivatives) over masses and first moments: two masses of
  !> 0.1 to 0.5 kg, 0.6 kg together, within 0.05 m: 19.028966461295 N with (-0.05, -1.59007e-5), (-0.05, 1.99088e-4).
  subroutine test_convex(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: paths(6) = [character(len=20) :: places, "link(one).mass", "link(two).mass"]
    real(dp), parameter :: theirs = 19.028966461295_dp
    type(document_family_type) :: family
    type(design_options) :: options
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure

    call new_design(paths, "shaking.f", rms_measure, family, options, configuration, error)
    if (allocated(error)) return
    options%lower(:4) = -0.05_dp
    options%upper = [0.05_dp, 0.05_dp, 0.05_dp, 0.05_dp, 0.5_dp, 0.5_dp]
    deallocate(options%constraints)
    allocate(options%constraints(1))
    call new_goal(configuration%frame, configuration%probes, "added_mass", peak_measure, options%constraints(1), failure)
    options%constraints%offset = configuration%frame%mass + configuration%frame%mechanism%mass
    options%constraints%limit = -1.4_dp / (1 + inside)
    call search_from(family, options, [0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.2_dp, 0.2_dp], optimum, failure)
    call check_success(error, failure)
    call check_that(error, abs(optimum%objective / theirs - 1), "<=", 1.0e-8_dp, "the objective")
    call check_that(error, abs(optimum%x - [-0.05_dp, -1.59007e-5_dp, -0.05_dp, 1.99088e-4_dp, 0.5_dp, 0.1_dp]), "<=", &
      & 1.0e-8_dp, "masses and places")
    call check_that(error, optimum%stationarity, "<=", 1.0e-6_dp, "optimality")
  end subroutine test_convex

  !> The force on the ground of the mounted machine has several minima over the counterweights' places: the best of eight starts is
  !> no worse than what differential evolution (Storn, Price, J. Global Optim. 11, 1997, 341-359) finds with a hundred times the
  !> solutions.
  subroutine test_evolution(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: population = 40
    type(document_family_type) :: family
    type(design_options) :: options
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp) :: best, x(4, population), f(population), trial(4), value
    integer :: k, g, draws, pick(3), used, j

    call new_design(places, "f", peak_measure, family, options, configuration, error)
    if (allocated(error)) return
    best = huge(best)
    used = 0
    do k = 1, 8
      call search_from(family, options, options%lower + halton(k, 4) * (options%upper - options%lower), optimum, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      best = min(best, optimum%objective)
      used = used + optimum%evaluations
    end do
    draws = 12345
    do k = 1, population
      x(:, k) = options%lower + drawn(4) * (options%upper - options%lower)
      f(k) = value_at(x(:, k))
    end do
    do g = 1, 100 * used / population
      do k = 1, population
        pick = 1 + int(population * drawn(3))
        trial = min(max(x(:, pick(1)) + 0.7_dp * (x(:, pick(2)) - x(:, pick(3))), options%lower), options%upper)
        j = 1 + int(4 * maxval(drawn(1)))
        trial = merge(trial, x(:, k), drawn(4) < 0.9_dp .or. [1, 2, 3, 4] == j)
        value = value_at(trial)
        if (value >= f(k)) cycle
        f(k) = value
        x(:, k) = trial
      end do
    end do
    call check_that(error, best, "<=", minval(f) * (1 + 1.0e-6_dp), "best of all starts minus that of evolution")

  contains

    !> Numbers between 0 and 1, always the same ones (Park, Miller, Comm. ACM 31, 1988, 1192-1201).
    function drawn(n)
      integer, intent(in) :: n
      real(dp) :: drawn(n)
      integer :: i

      do i = 1, n
        draws = 16807 * modulo(draws, 127773) - 2836 * (draws / 127773)
        if (draws < 0) draws = draws + 2147483647
        drawn(i) = draws / 2147483647.0_dp
      end do
    end function drawn

    real(dp) function value_at(there)
      real(dp), intent(in) :: there(:)
      type(goal_branches_type) :: at

      call evaluate_goals(family, options, options%objectives, there, .false., at, failure)
      value_at = huge(value_at)
      if (at%known) value_at = maxval(at%value)
    end function value_at

  end subroutine test_evolution

end module test_design
