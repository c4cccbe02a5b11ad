!> Gradients of designs against differences of solutions.
module test_design_gradients
  use checks, only: check_success, check_that
  use design_families, only: machine, new_family, newline
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_input_machine_family, only: document_family_type
  use gestell_math_optimum_minimax, only: branches_type, optimum_type
  use gestell_study_design_moments, only: moments_type, new_moments
  use gestell_study_design_goal, only: goal_type, new_goal
  use gestell_study_design_perturbed_members, only: condition_type
  use gestell_study_design_perturbed_members, only: inertia_part, mass_part, other_part, place_parts
  use gestell_study_design_problem, only: design_options, evaluate_goals, goal_branches_type
  use gestell_study_measure, only: band_measure, peak_measure, rms_measure
  use gestell_task_common_configuration, only: configuration_type
  use reference_random, only: random_type
  use slow_tests, only: new_slow
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_design_gradients

contains

  subroutine collect_design_gradients(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("slopes, limits and prices transform correctly to first moments", test_moments), &
      & new_unittest("gradients of the model about rest agree with differences of solutions", test_gradients), &
      & new_unittest("gradients of all models agree with differences in a random direction", test_directions), &
      & new_slow("gradients of all models agree with differences of solutions", test_all_gradients)]
  end subroutine collect_design_gradients

  !> f = m^2 + 3 m^2 c of a mass m and a place c between -1 and 2, which is y_m^2 + 3 y_m y_c in y_m = m and y_c = m c.
  subroutine test_moments(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: m = 1.5_dp, c = 0.7_dp, lower(2) = [0.5_dp, -1.0_dp], upper(2) = [3.0_dp, 2.0_dp]
    real(dp), parameter :: in_x(2) = [2 * m + 6 * m * c, 3 * m**2], in_y(2) = [2 * m + 3 * m * c, 3 * m]
    real(dp), parameter :: prices(2) = [0.4_dp, 0.1_dp]
    ! Of the limits y_c - 2 y_m <= 0 and -y_m - y_c <= 0.
    real(dp), parameter :: limit(2) = [m * c - 2 * m, -m - m * c], limit_slope(2, 2) = reshape([-2, 1, -1, -1] * 1.0_dp, [2, 2])
    ! A rounding of each term, of about 10.
    real(dp), parameter :: rounded = 40 * epsilon(1.0_dp)
    type(moments_type) :: moments
    type(branches_type) :: at
    type(optimum_type) :: optimum
    real(dp) :: slopes(2, 1)

    moments = new_moments(lower(2:1:-1), upper(2:1:-1), [7, 7], [place_parts(1), mass_part])
    call check_that(error, moments%from([c, m]), "==", [m * c, m], "coordinates, the place first")
    moments = new_moments(lower, upper, [7, 7], [mass_part, place_parts(1)])
    call check_that(error, moments%from([m, c]), "==", [m, m * c], "coordinates")
    if (.not. allocated(error)) call check_that(error, abs(moments%to([m, m * c]) - [m, c]), "<=", rounded, "transformed back")
    if (allocated(error)) return
    slopes(:, 1) = in_x
    call moments%turn_slopes([m, c], slopes)
    call check_that(error, abs(slopes(:, 1) - in_y), "<=", rounded, "slopes")
    if (allocated(error)) return
    at%group = [1]
    at%value = [0.0_dp]
    at%slope = slopes
    call moments%add_limits([m, m * c], 2, at)
    call check_that(error, at%group, "==", [1, 2, 3], "groups of the limits")
    if (.not. allocated(error)) call check_that(error, abs(at%value(2:) - limit), "<=", rounded, "limits")
    if (.not. allocated(error)) call check_that(error, reshape(abs(at%slope(:, 2:) - limit_slope), [4]), "<=", rounded, &
      & "their slopes")
    if (allocated(error)) return
    optimum%x = [m, m * c]
    optimum%price = prices
    optimum%bound_price = [0.0_dp, 0.0_dp]
    optimum%slope = in_y + matmul(limit_slope, prices)
    call moments%turn_optimum(optimum)
    call check_that(error, abs(optimum%slope - in_x), "<=", rounded, "slope of the optimum")
    if (.not. allocated(error)) call check_that(error, abs(optimum%x - [m, c]), "<=", rounded, "the optimum")
    if (allocated(error)) return
    ! What the range of c costs: dL/dc by its limits.
    call check_that(error, abs(optimum%bound_price - [0.0_dp, (prices(2) - prices(1)) * m]), "<=", rounded, "prices of the range")
  end subroutine test_moments

  !> Every kind of parameter and goal, with all models and holders of the speed. With `seed`, in one random direction only.
  subroutine compare_gradients(variants, error, seed)
    character(len=*), intent(in) :: variants(:)
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: seed
    character(len=*), parameter :: names(14) = [character(len=12) :: "f", "f", "probe(p).v", "probe(p).a", "support(2).f", "m", &
      & "shaking.f", "shaking.m", "torque", "added_mass", "sag", "separation", "psi", "rho_max"]
    integer, parameter :: kinds(14) = [rms_measure, peak_measure, band_measure, peak_measure, rms_measure, peak_measure, &
      & peak_measure, rms_measure, peak_measure, peak_measure, peak_measure, peak_measure, peak_measure, peak_measure]
    character(len=*), parameter :: paths(9) = [character(len=28) :: "link(crank).center(1)", "link(piston).mass", &
      & "link(rod).inertia", "joint(B).lengths(1)", "support(1).stiffness(2)", "support(2).angle", "support(1).position(1)", &
      & "frame.inertia", "drive.speed_rpm"]
    real(dp), parameter :: start(9) = [0.01_dp, 0.5_dp, 0.003_dp, 0.2_dp, 1.2e5_dp, 5.0_dp, -0.2_dp, 0.6_dp, 900.0_dp]
    real(dp), parameter :: range(9) = [0.1_dp, 1.0_dp, 0.002_dp, 0.1_dp, 1.0e5_dp, 40.0_dp, 0.2_dp, 0.5_dp, 400.0_dp]
    character(len=:), allocatable :: text
    integer :: v, i, k, n

    do v = 1, size(variants)
      text = machine // variants(v)
      if (variants(v)(:6) == "&drive") text = "&drive speed_rpm=900, " // trim(variants(v)(8:)) // machine(index(machine, newline):)
      if (variants(v)(:6) == "&frame") then
        i = index(machine, "&frame")
        text = machine(:i + 6) // "dof='xi','psi', " // machine(i + 7:)
      end if
      ! multipliers that are lost among larger ones have no derivatives
      n = merge(size(names) - 1, size(names), variants(v)(:6) == "&found")
      call compare(trim(variants(v)), text, names(:n), kinds(:n), paths, start, range, [1, 3, 2, 0, 0, 0, 0, 0, 0], &
        & [place_parts(1), mass_part, inertia_part, (other_part, k = 4, size(start))], error, seed)
      if (allocated(error)) return
    end do
  end subroutine compare_gradients

  !> A V-twin in space: three stiffnesses and angles, a tensor of inertia, several mechanisms.
  subroutine compare_in_space(model, held_by, error, seed)
    character(len=*), intent(in) :: model, held_by
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: seed
    character(len=*), parameter :: names(15) = [character(len=12) :: "f", "f", "probe(p).v", "probe(p).az", "support(2).f", "mx", &
      & "shaking.f", "shaking.my", "shaking.fz", "added_mass", "separation", "rot_eta", "zeta", "torque", "rho_max"]
    integer, parameter :: kinds(15) = [rms_measure, peak_measure, band_measure, peak_measure, rms_measure, peak_measure, &
      & peak_measure, rms_measure, peak_measure, peak_measure, peak_measure, rms_measure, peak_measure, peak_measure, peak_measure]
    character(len=*), parameter :: paths(9) = [character(len=28) :: "link(crank).center(1)", "link(piston).mass", &
      & "link(rod).inertia(2)", "joint(B).lengths(1)", "support(1).stiffness(3)", "support(2).angle(2)", "support(1).position(3)", &
      & "frame.inertia(4)", "drive.speed_rpm"]
    real(dp), parameter :: start(9) = [-0.004_dp, 0.5_dp, 0.0013_dp, 0.14_dp, 6.0e4_dp, 5.0_dp, 0.16_dp, 0.05_dp, 900.0_dp]
    real(dp), parameter :: range(9) = [0.02_dp, 0.5_dp, 0.001_dp, 0.04_dp, 5.0e4_dp, 40.0_dp, 0.2_dp, 0.5_dp, 400.0_dp]
    character(len=*), parameter :: twin = newline // &
      & "&mechanism name='right', origin=0,0,0.03, angle=-45, phase=45 /" // newline // &
      & "&repeat of='right', name='left', origin=0,0,-0.02, axis=0.1,0,1, phase=-45 /" // newline // &
      & "&joint mechanism='right', name='O', type='ground', position=0,0 /" // newline // &
      & "&joint mechanism='right', name='A', type='crank', pivot='O', radius=0.04 /" // newline // &
      & "&joint mechanism='right', name='B', type='RRP', ends='A', lengths=0.14, guide_point=0,0, " // &
      & "guide_angle=90, branch=1 /" // newline // &
      & "&link mechanism='right', name='crank', from='O', to='A', mass=3.6, " // &
      & "inertia=0.006,0.006,0.009, center=-0.004,0 /" // newline // &
      & "&link mechanism='right', name='rod', from='A', to='B', mass=0.44, " // &
      & "inertia=1.5e-4,1.3e-3,1.4e-3, center=0.042,0 /" // newline // &
      & "&link mechanism='right', name='piston', from='B', mass=0.5, inertia=3e-4,2.5e-4,3e-4 /" // newline // &
      & "&frame mass=28, inertia=0.9,0.8,0.7,0.05,-0.06,0.08, origin=0.02,-0.07,0, " // &
      & "dof='xi','eta','zeta','rot_xi','rot_eta','psi' /" // newline // &
      & "&support position=0.22,-0.17,0.16, stiffness=7e4,1.3e5,6e4, damping=150,180,150, angle=45,0,0 /" // newline // &
      & "&support position=-0.22,-0.17,0.16, stiffness=7e4,1.3e5,6e4, damping=150,180,150, angle=-45,5,0 /" // newline // &
      & "&support position=0.01,-0.17,-0.18, stiffness=7e4,1.3e5,6e4, damping=150,180,150, angle=10,20,15 /" // newline // &
      & "&probe name='p', position=0.1,0.05,0.1 /" // newline
    integer :: k

    call compare("space, " // model // ", " // held_by, "&model frame='" // model // "' / &drive speed_rpm=900, held_by=" &
      & // held_by // " /" // twin, names, kinds, paths, start, range, [(0, k = 1, size(start))], &
      & [(other_part, k = 1, size(start))], error, seed)
  end subroutine compare_in_space

  !> Relative changes of the values over the parameters' ranges. The differences are extrapolated from steps of a 200th, 400th and
  !> 800th of these ranges: solutions to 1e-11 leave 1e-8 of them. `text` contains the values `start`: the differences vary only the
  !> parameters that change, because each parameter more costs further solutions.
  !> Eleven arguments: the machine, its goals, its parameters and, with `seed`, the random direction in which all of them change.
  !> Without `seed` they change one after the other.
  subroutine compare(what, text, names, kinds, paths, start, range, link, part, error, seed)
    character(len=*), intent(in) :: what, text, names(:), paths(:)
    integer, intent(in) :: kinds(:), link(:), part(:)
    real(dp), intent(in) :: start(:), range(:)
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: seed
    type(document_family_type) :: family, single
    type(design_options) :: options, one
    type(configuration_type) :: configuration, unused
    type(goal_branches_type) :: above(3), at, below(3)
    type(goal_type), allocatable :: goals(:)
    type(gestell_error), allocatable :: failure
    character(len=:), allocatable :: which
    type(random_type) :: random
    !> Change of each parameter: as a part of its range, and in its unit
    real(dp), dimension(size(start)) :: direction, change_of
    real(dp) :: table(3), h, change, found, unit, side, part_of_change
    integer :: g, k, i, b, n, first, last

    call new_family(text, paths, start, family, options, configuration, error)
    if (allocated(error)) return
    call set_parameters(options, 1, size(start))
    n = size(names)
    allocate(goals(n))
    do g = 1, n
      call new_goal(configuration%frame, configuration%probes, trim(names(g)), kinds(g), goals(g), failure)
      call check_success(error, failure)
      if (allocated(error)) return
    end do
    call evaluate_goals(family, options, goals, start, .true., at, failure)
    call check_success(error, failure)
    call check_that(error, at%known, "==", .true., trim(what) // " known")
    if (allocated(error)) return
    do k = 1, size(paths)
      first = k
      last = k
      direction = 0
      direction(k) = 1
      which = trim(paths(k))
      if (present(seed)) then
        if (k > 1) exit
        last = size(paths)
        call random%start(seed, 1)
        direction = [(merge(-1.0_dp, 1.0_dp, random%chance(0.5_dp)) * random%between(0.2_dp, 0.6_dp), i = 1, size(start))]
        which = "all parameters"
      end if
      call new_family(text, paths(first:last), start(first:last), single, one, unused, error)
      if (allocated(error)) return
      call set_parameters(one, first, last)
      change_of = direction * range
      do i = 1, 3
        h = 0.01_dp / 2**i
        call evaluate_goals(single, one, goals, start(first:last) + h * change_of(first:last), .true., above(i), failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call evaluate_goals(single, one, goals, start(first:last) - h * change_of(first:last), .true., below(i), failure)
        call check_success(error, failure)
        if (allocated(error)) return
      end do
      do g = 1, n
        ! the separation is the minimum of its branches, all other goals are the maximum
        side = merge(-1.0_dp, 1.0_dp, names(g) == "separation")
        b = maxloc(merge(side * at%value, -huge(h), at%group == g), dim=1)
        unit = max(abs(at%value(b)), tiny(unit))
        do i = 1, 3
          h = 0.01_dp / 2**i
          table(i) = (top(above(i), h) - top(below(i), -h)) / (2 * h)
        end do
        ! Neville's table, twice
        table(:2) = table(2:) + (table(2:) - table(:2)) / 3
        change = (table(2) + (table(2) - table(1)) / 15) / unit
        part_of_change = 1.0e-7_dp
        if (side < 0) then
          ! with the larger steps another mode or order may be the nearest one; the smallest step has an error of second order
          change = (top(above(3), h) - top(below(3), -h)) / (2 * h) / unit
          part_of_change = 1.0e-5_dp
        end if
        found = sum(at%slope(:, b) * change_of) / unit
        call check_that(error, abs(found - change), "<=", part_of_change * max(abs(change), 1.0_dp), trim(what) // " d " // &
          & goals(g)%name() // " / d " // which)
        if (allocated(error)) return
      end do
    end do

  contains

    !> The design has the parameters from `from` to `to`.
    subroutine set_parameters(design, from, to)
      type(design_options), intent(inout) :: design
      integer, intent(in) :: from, to
      integer :: p

      design%lower = start(from:to) - range(from:to) / 2
      design%upper = start(from:to) + range(from:to) / 2
      design%conditions = [condition_type()]
      design%link = link(from:to)
      design%part = part(from:to)
      design%unit = [(1.0_dp, p = from, to)]
    end subroutine set_parameters

    !> The value of goal g after a step, for the same one of several local maxima: both slopes predict its value, and samples
    !> next to it are lower.
    real(dp) function top(there, step)
      type(goal_branches_type), intent(in) :: there
      real(dp), intent(in) :: step
      logical :: same(size(there%value))
      real(dp) :: predicted(size(there%value))

      same = there%group == g
      predicted = at%value(b) + step * matmul(change_of(first:last), spread(at%slope(first:last, b), 2, size(same)) &
        & + there%slope) / 2
      if (kinds(g) == peak_measure .and. side > 0) same = same .and. abs(there%value - predicted) <= 1.0e-4_dp * abs(at%value(b))
      top = side * maxval(side * there%value, mask=same)
    end function top

  end subroutine compare

  subroutine test_gradients(error)
    type(error_type), allocatable, intent(out) :: error

    call compare_gradients([character(len=80) :: "&model frame='rest' /"], error)
  end subroutine test_gradients

  !> One direction that changes all parameters needs two solutions where single parameters need eighteen. A wrong derivative
  !> escapes only if the changes of the other parameters cancel its error.
  subroutine test_directions(error)
    type(error_type), allocatable, intent(out) :: error

    call compare_gradients([character(len=80) :: "&model frame='exact' /", "&drive held_by='outside' /", &
      & "&drive held_by='flywheel' /", "&model frame='first_order' /"], error, seed=1)
    if (.not. allocated(error)) call compare_in_space("exact", "'motor'", error, seed=2)
    if (.not. allocated(error)) call compare_in_space("first_order", "'flywheel', flywheel_inertia=0.3", error, seed=3)
  end subroutine test_directions

  subroutine test_all_gradients(error)
    type(error_type), allocatable, intent(out) :: error

    call compare_gradients([character(len=80) :: "&model frame='first_order' /", "&model frame='exact' /", &
      & "&drive held_by='outside' /", "&drive held_by='flywheel' /", "&frame dof='xi','psi' /", &
      & "&foundation damping=5e4,0,0 / &model frame='rest' /", "&foundation damping_ratio=0.05 / &model frame='rest' /"], error)
    if (.not. allocated(error)) call compare_in_space("first_order", "'outside'", error)
    if (.not. allocated(error)) call compare_in_space("exact", "'motor'", error)
    if (.not. allocated(error)) call compare_in_space("rest", "'flywheel', flywheel_inertia=0.3", error)
    if (.not. allocated(error)) call compare_in_space("exact", "'flywheel', flywheel_inertia=0.3", error)
  end subroutine test_all_gradients

end module test_design_gradients
