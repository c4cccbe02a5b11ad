!> Designs: gradients of the periodic problem against differences of its solutions.
module test_design
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_input_machine_family, only: document_family_type, new_document_family
  use gestell_input_namelist, only: parse_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_check, only: check_document
    use gestell_model_mechanism, only: a1_dd, a2_dd, table_columns
  use gestell_math_optimum_minimax, only: optimum_type
  use gestell_study_design, only: halton, is_convex, prove, search_from
  use gestell_study_design_goal, only: goal_type, new_goal
  use gestell_study_design_neighbours, only: condition_type
  use gestell_study_design_parts, only: mass_part, place_parts
  use gestell_study_design_problem, only: design_order_type, evaluate_goals, goal_branches_type, inside
  use gestell_study_measure, only: band_measure, peak_measure, rms_measure
  use gestell_task_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_configuration
  use slow_tests, only: new_slow
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_design

  character, parameter :: newline = new_line("a")
  !> Small enough to swing far, with all that a gradient can depend on.
  character(len=*), parameter :: machine = &
    & "&drive speed_rpm=900 /" // newline // &
    & "&joint name='O', type='ground', position=0,0 /" // newline // &
    & "&joint name='A', type='crank', pivot='O', radius=0.05 /" // newline // &
    & "&joint name='B', type='RRP', ends='A', lengths=0.2, guide_point=0.0,0.01, guide_angle=80, branch=1 /" // newline // &
    & "&link name='crank', from='O', to='A', mass=2, inertia=0.002, center=0.01,0.002 /" // newline // &
    & "&link name='rod', from='A', to='B', mass=0.6, inertia=0.003, center=0.065,0.0 /" // newline // &
    & "&link name='piston', from='B', mass=0.5, inertia=0 /" // newline // &
    & "&frame mass=25, inertia=0.6, origin=0.02,0.05 /" // newline // &
    & "&support position=-0.20,-0.25, stiffness=6e4,1.2e5, damping=60,120, angle=10 /" // newline // &
    & "&support position= 0.25,-0.25, stiffness=6e4,1.2e5, damping=60,120, axes='frame' /" // newline // &
    & "&gravity /" // newline // &
    & "&probe name='p', position=0.1,0.05 /" // newline

  !> The paper's machine with a counterweight on crank and rocker.
  character(len=*), parameter :: four_bar = &
    & "&model frame='rest' / &drive speed_rpm=240 /" // newline // &
    & "&joint name='A0', type='ground', position=0,0 / &joint name='B0', type='ground', position=0.40,0 /" // newline // &
    & "&joint name='A', type='crank', pivot='A0', radius=0.07 /" // newline // &
    & "&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /" // newline // &
    & "&link name='crank', from='A0', to='A', mass=0.50, inertia=0.0035, center=0.03,0 /" // newline // &
    & "&link name='coupler', from='A', to='B', mass=0.60, inertia=0.0070, center=0.18,0 /" // newline // &
    & "&link name='rocker', from='B0', to='B', mass=0.25, inertia=0.0060, center=0.08,0 /" // newline // &
    & "&link name='one', from='A0', to='A', mass=1, inertia=0, center=0,0 /" // newline // &
    & "&link name='two', from='B0', to='B', mass=1, inertia=0, center=0,0 /" // newline // &
    & "&frame mass=18, inertia=0.78, origin=-0.20,0.20 /" // newline // &
    & "&support position=-0.30,-0.20, stiffness=4e5,4e5 /" // newline // &
    & "&support position=0.30,-0.20, stiffness=4e5,4e5, damping=100,100 /" // newline
  character(len=*), parameter :: places(4) = [character(len=20) :: "link(one).center(1)", "link(one).center(2)", &
    & "link(two).center(1)", "link(two).center(2)"]

contains

  subroutine collect_design(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("gradients about rest against differences of solutions", test_gradients), &
      & new_slow("gradients of all models against differences of solutions", test_all_gradients), &
      & new_unittest("the best counterweight of a crank, in closed form", test_crank), &
      & new_unittest("complete balance of a four-bar linkage", test_complete), &
      & new_unittest("masses, places and limits: proved to be the best, and against all others", test_proof), &
      & new_unittest("a convex design against SciPy", test_convex), &
      & new_slow("a mounted machine against differential evolution", test_evolution)]
  end subroutine collect_design

  !> The family of the machine with `paths` as parameters.
  subroutine new_family(text, paths, start, family, order, configuration, error)
    character(len=*), intent(in) :: text, paths(:)
    real(dp), intent(in) :: start(:)
    type(document_family_type), intent(out) :: family
    type(design_order_type), intent(out) :: order
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(schema_type) :: schema
    type(gestell_error), allocatable :: failure

    schema = input_schema()
    call parse_document(text, "in.nml", doc, failure)
    if (.not. allocated(failure)) call check_document(doc, schema, failure)
    if (.not. allocated(failure)) call read_configuration(doc, configuration, failure)
    if (.not. allocated(failure)) call new_document_family(family, configuration%document, configuration%schema, &
      & configuration%units, paths, start, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    order%probes = configuration%probes
    order%model = configuration%model()
    order%accuracy = configuration%accuracy
    order%accuracy%tolerance = 1.0e-11_dp
    allocate(order%objectives(0), order%constraints(0))
  end subroutine new_family

  !> Every kind of parameter and goal, by all models and holders: relative changes of the values over the parameters' ranges. The
  !> differences are extrapolated from steps of a 200th, 400th and 800th of these ranges: solutions to 1e-11 leave 1e-8 of them.
  subroutine compare_gradients(variants, error)
    character(len=*), intent(in) :: variants(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(14) = [character(len=12) :: "f", "f", "probe(p).v", "probe(p).a", "support(2).f", "m", &
      & "shaking.f", "shaking.m", "torque", "added_mass", "sag", "separation", "rho_max", "psi"]
    integer, parameter :: kinds(14) = [rms_measure, peak_measure, band_measure, peak_measure, rms_measure, peak_measure, &
      & peak_measure, rms_measure, peak_measure, peak_measure, peak_measure, peak_measure, peak_measure, peak_measure]
    character(len=*), parameter :: paths(8) = [character(len=28) :: "link(crank).center(1)", "link(piston).mass", &
      & "joint(B).lengths(1)", "support(1).stiffness(2)", "support(2).angle", "support(1).position(1)", "frame.inertia", &
      & "drive.speed_rpm"]
    real(dp), parameter :: start(8) = [0.01_dp, 0.5_dp, 0.2_dp, 1.2e5_dp, 5.0_dp, -0.2_dp, 0.6_dp, 900.0_dp]
    real(dp), parameter :: range(8) = [0.1_dp, 1.0_dp, 0.1_dp, 1.0e5_dp, 40.0_dp, 0.2_dp, 0.5_dp, 400.0_dp]
    character(len=:), allocatable :: text
    type(document_family_type) :: family
    type(design_order_type) :: order
    type(configuration_type) :: configuration
    type(goal_branches_type) :: at
    type(goal_type) :: goals(size(names))
    type(gestell_error), allocatable :: failure
    real(dp) :: table(3), h, change, found, unit
    integer :: v, g, k, i, b

    do v = 1, size(variants)
      text = machine // variants(v)
      if (variants(v)(:6) == "&drive") text = "&drive speed_rpm=900, " // trim(variants(v)(8:)) // machine(index(machine, newline):)
      if (variants(v)(:6) == "&frame") then
        i = index(machine, "&frame")
        text = machine(:i + 6) // "dof='xi','psi', " // machine(i + 7:)
      end if
      call new_family(text, paths, start, family, order, configuration, error)
      if (allocated(error)) return
      order%lower = start - range / 2
      order%upper = start + range / 2
      order%conditions = [condition_type()]
      do g = 1, size(names)
        call new_goal(configuration%frame, configuration%probes, trim(names(g)), kinds(g), goals(g), failure)
        call check_success(error, failure)
        if (allocated(error)) return
      end do
      call evaluate_goals(family, order, goals, start, .true., at, failure)
      call check_success(error, failure)
      call check_that(error, at%known, "==", .true., trim(variants(v)) // " known")
      if (allocated(error)) return
      do g = 1, size(names)
        b = maxloc(merge(at%value, -huge(h), at%group == g), dim=1)
        unit = max(at%value(b), tiny(unit))
        do k = 1, size(paths)
          do i = 1, 3
            h = range(k) * 0.01_dp / 2**i
            table(i) = (top(k, h) - top(k, -h)) / (2 * h)
          end do
          ! Neville's table, twice
          table(:2) = table(2:) + (table(2:) - table(:2)) / 3
          change = (table(2) + (table(2) - table(1)) / 15) * range(k) / unit
          found = at%slope(k, b) * range(k) / unit
          call check_that(error, abs(found - change), "<=", 1.0e-7_dp * max(abs(change), 1.0_dp), trim(variants(v)) // " d " // &
            & goals(g)%name() // " / d " // trim(paths(k)))
          if (allocated(error)) return
        end do
      end do
    end do

  contains

    real(dp) function top(k, step)
      integer, intent(in) :: k
      real(dp), intent(in) :: step
      type(goal_branches_type) :: there
      real(dp) :: x(size(start))
      integer :: i_top

      x = start
      x(k) = x(k) + step
      ! the same of several local maxima: both slopes tell its value, and samples beside it are lower
      call evaluate_goals(family, order, goals(g:g), x, kinds(g) == peak_measure, there, failure)
      i_top = maxloc(there%value, dim=1)
      if (kinds(g) == peak_measure) i_top = maxloc(there%value, dim=1, mask=abs(there%value - at%value(b) &
        & - step * (at%slope(k, b) + there%slope(k, :)) / 2) <= 1.0e-4_dp * at%value(b))
      top = there%value(i_top)
    end function top

  end subroutine compare_gradients

  subroutine test_gradients(error)
    type(error_type), allocatable, intent(out) :: error

    call compare_gradients([character(len=80) :: "&model frame='rest' /"], error)
  end subroutine test_gradients

  subroutine test_all_gradients(error)
    type(error_type), allocatable, intent(out) :: error

    call compare_gradients([character(len=80) :: "&model frame='first_order' /", "&model frame='exact' /", &
      & "&drive held_by='outside' /", "&drive held_by='flywheel' /", "&frame dof='xi','psi' /"], error)
  end subroutine test_all_gradients

  !> A design of the four-bar linkage with these parameters within -0.2 to 0.2, masses 0.1 to 2.
  subroutine new_design(paths, quantity, measure, family, order, configuration, error)
    character(len=*), intent(in) :: paths(:), quantity
    integer, intent(in) :: measure
    type(document_family_type), intent(out) :: family
    type(design_order_type), intent(out) :: order
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    integer :: k

    call new_family(four_bar, paths, [(1.0_dp, k = 1, size(paths))], family, order, configuration, error)
    if (allocated(error)) return
    order%lower = [(merge(0.1_dp, -0.2_dp, index(paths(k), "mass") > 0), k = 1, size(paths))]
    order%upper = [(merge(2.0_dp, 0.2_dp, index(paths(k), "mass") > 0), k = 1, size(paths))]
    order%body = [(merge(1, 2, index(paths(k), "one") > 0), k = 1, size(paths))]
    order%part = [(merge(mass_part, merge(place_parts(1), place_parts(2), index(paths(k), "(1)") > 0), &
      & index(paths(k), "mass") > 0), k = 1, size(paths))]
    order%conditions = [condition_type()]
    deallocate(order%objectives)
    allocate(order%objectives(1))
    call new_goal(configuration%frame, configuration%probes, quantity, measure, order%objectives(1), failure)
    call check_success(error, failure)
  end subroutine new_design

  !> The force is -Omega^2 S'', and a counterweight adds u exp(i phi) to S: the least rms is where u is minus the coefficient c of
  !> exp(i phi) in S, and what is left is the rest of the series (Parseval).
  subroutine test_crank(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 256
    type(document_family_type) :: family
    type(design_order_type) :: order
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp) :: table(n, table_columns), phi(n), left
    complex(dp) :: c, s(n)
    integer :: k

    call new_design(places(:2), "shaking.f", rms_measure, family, order, configuration, error)
    if (allocated(error)) return
    call search_from(family, order, [0.1_dp, -0.1_dp], optimum, failure)
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
    call check_that(error, is_convex(order), "==", .true., "convex")
    call check_that(error, prove(order, optimum) / left, "<=", 1.0e-8_dp, "gap")
  end subroutine test_crank

  !> Berkof, Lowen, J. Eng. Ind. 91, 1969, 21-26: opposite to crank and rocker, 0.0365675675675676 and 0.0667027027027027 kg m.
  subroutine test_complete(error)
    type(error_type), allocatable, intent(out) :: error
    type(document_family_type) :: family
    type(design_order_type) :: order
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp) :: before

    call new_design(places, "shaking.f", rms_measure, family, order, configuration, error)
    if (allocated(error)) return
    before = value_at([0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp])
    call search_from(family, order, [0.1_dp, -0.1_dp, 0.0_dp, 0.05_dp], optimum, failure)
    call check_success(error, failure)
    call check_that(error, optimum%objective / before, "<=", 1.0e-6_dp, "the force that is left")
    call check_that(error, abs(optimum%x - [-0.0365675675675676_dp, 0.0_dp, -0.0667027027027027_dp, 0.0_dp]), "<=", 1.0e-7_dp, &
      & "the counterweights")

  contains

    real(dp) function value_at(x)
      real(dp), intent(in) :: x(:)
      type(goal_branches_type) :: at

      call evaluate_goals(family, order, order%objectives, x, .false., at, failure)
      value_at = maxval(at%value)
    end function value_at

  end subroutine test_complete

  !> Peak of the force, limited mass: the gap is small, and no point of a random cloud within the limit is better than it allows.
  subroutine test_proof(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: paths(6) = [character(len=20) :: places, "link(one).mass", "link(two).mass"]
    type(document_family_type) :: family
    type(design_order_type) :: order
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(goal_branches_type) :: at
    type(gestell_error), allocatable :: failure
    real(dp) :: gap, x(6)
    integer :: k

    call new_design(paths, "shaking.f", peak_measure, family, order, configuration, error)
    if (allocated(error)) return
    deallocate(order%constraints)
    allocate(order%constraints(1))
    call new_goal(configuration%frame, configuration%probes, "added_mass", peak_measure, order%constraints(1), failure)
    order%constraints%offset = configuration%frame%mass + configuration%frame%mechanism%mass
    order%constraints%limit = -1.6_dp
    call check_that(error, is_convex(order), "==", .true., "convex")
    call search_from(family, order, [0.1_dp, -0.1_dp, 0.0_dp, 0.05_dp, 0.3_dp, 0.3_dp], optimum, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    gap = prove(order, optimum)
    call check_that(error, optimum%feasible, "==", .true., "feasible")
    call check_that(error, gap / optimum%objective, "<=", 1.0e-5_dp, "gap")
    call check_that(error, optimum%stationarity, "<=", 1.0e-6_dp, "optimality")
    call check_that(error, sum(optimum%x(5:)), "<=", 0.4_dp + 1.0e-9_dp, "mass")
    do k = 1, 300
      x = order%lower + halton(k, 6) * (order%upper - order%lower)
      x(5:) = x(5:) * min(1.0_dp, 0.4_dp / sum(x(5:)))
      if (mod(k, 2) == 0) x = optimum%x + 0.01_dp * (x - optimum%x)
      call evaluate_goals(family, order, order%objectives, x, .false., at, failure)
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
    type(design_order_type) :: order
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure

    call new_design(paths, "shaking.f", rms_measure, family, order, configuration, error)
    if (allocated(error)) return
    order%lower(:4) = -0.05_dp
    order%upper = [0.05_dp, 0.05_dp, 0.05_dp, 0.05_dp, 0.5_dp, 0.5_dp]
    deallocate(order%constraints)
    allocate(order%constraints(1))
    call new_goal(configuration%frame, configuration%probes, "added_mass", peak_measure, order%constraints(1), failure)
    order%constraints%offset = configuration%frame%mass + configuration%frame%mechanism%mass
    order%constraints%limit = -1.4_dp / (1 + inside)
    call search_from(family, order, [0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.2_dp, 0.2_dp], optimum, failure)
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
    type(design_order_type) :: order
    type(configuration_type) :: configuration
    type(optimum_type) :: optimum
    type(gestell_error), allocatable :: failure
    real(dp) :: best, x(4, population), f(population), trial(4), value
    integer :: k, g, draws, pick(3), used, j

    call new_design(places, "f", peak_measure, family, order, configuration, error)
    if (allocated(error)) return
    best = huge(best)
    used = 0
    do k = 1, 8
      call search_from(family, order, order%lower + halton(k, 4) * (order%upper - order%lower), optimum, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      best = min(best, optimum%objective)
      used = used + optimum%evaluations
    end do
    draws = 12345
    do k = 1, population
      x(:, k) = order%lower + drawn(4) * (order%upper - order%lower)
      f(k) = value_at(x(:, k))
    end do
    do g = 1, 100 * used / population
      do k = 1, population
        pick = 1 + int(population * drawn(3))
        trial = min(max(x(:, pick(1)) + 0.7_dp * (x(:, pick(2)) - x(:, pick(3))), order%lower), order%upper)
        j = 1 + int(4 * maxval(drawn(1)))
        trial = merge(trial, x(:, k), drawn(4) < 0.9_dp .or. [1, 2, 3, 4] == j)
        value = value_at(trial)
        if (value >= f(k)) cycle
        f(k) = value
        x(:, k) = trial
      end do
    end do
    call check_that(error, best, "<=", minval(f) * (1 + 1.0e-6_dp), "the best of all starts against evolution")

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

      call evaluate_goals(family, order, order%objectives, there, .false., at, failure)
      value_at = huge(value_at)
      if (at%known) value_at = maxval(at%value)
    end function value_at

  end subroutine test_evolution

end module test_design
