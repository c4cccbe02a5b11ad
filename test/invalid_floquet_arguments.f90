!> Invalid arguments to the procedures that solve a periodic system.
module invalid_floquet_arguments
  use checks, only: check_that
  use gestell_api_numerics, only: accuracy_type, dp, error_type, evidence, evidence_type, floquet_type, follow, invalid_input, &
    & mesh, method_type, monodromy_type, multipliers_type, new_method, period_map, periodic_solution_type, periodic_system, &
    & solve_floquet, solve_modes, solve_monodromy, solve_multipliers, solve_periodic, trajectory
  use gestell_api_numerics, only: mode_type
  use faulty_systems, only: check_answer, evaluations, faulty_first_order, faulty_second_order, infinite, nan, expect
  use testdrive, only: check, test_error => error_type
  implicit none (type, external)
  private

  public :: test_accuracies, test_faults, test_order_of_calls, test_systems, test_trajectories

  real(dp), parameter :: pi = acos(-1.0_dp)

contains

  !> Invalid components: nothing may be computed.
  subroutine test_systems(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=:), allocatable :: complaints
    real(dp) :: periods(5)
    integer :: i

    complaints = ""
    periods = [0.0_dp, -1.0_dp, nan(), infinite(), -infinite()]
    do i = 1, size(periods)
      call check_refused(faulty_second_order(states=2, period=periods(i)), "period", complaints)
      call check_refused(faulty_first_order(states=2, period=periods(i)), "period", complaints)
    end do
    call check_refused(faulty_second_order(), "nothing set", complaints)
    call check_refused(faulty_second_order(states=2), "period not set", complaints)
    call check_refused(faulty_second_order(period=pi), "no states", complaints)
    call check_refused(faulty_first_order(period=pi), "no states", complaints)
    call check_refused(faulty_second_order(states=-2, period=pi), "negative states", complaints)
    call check_refused(faulty_first_order(states=-2, period=pi), "negative states", complaints)
    call check_refused(faulty_second_order(states=1, period=pi), "one state", complaints)
    call check_refused(faulty_second_order(states=3, period=pi), "odd states", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, breaks=[nan()]), "break nan", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, breaks=[infinite()]), "break infinite", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, breaks=[-1.0_dp, 10.0_dp]), "breaks outside", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, breaks=[2.0_dp, 1.0_dp]), "breaks descend", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, breaks=[1.0_dp, 1.0_dp]), "break twice", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, breaks=[0.0_dp, 1.0_dp]), "break at 0", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, breaks=[1.0_dp, pi]), "break at T", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, least_steps=0), "least_steps 0", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, least_steps=-5), "least_steps negative", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, least_steps=huge(1)), "least_steps huge", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, least_steps=100000000), "least_steps 1e8", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, rounding=nan()), "rounding nan", complaints)
    call check_refused(faulty_second_order(states=2, period=pi, rounding=-1.0_dp), "rounding negative", complaints)
    call check(error, complaints, "")
  end subroutine test_systems

  !> Systems that are valid but mechanically absurd: the result is an answer, or an error that does not blame the caller, within
  !> bounded work.
  subroutine test_faults(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=*), parameter :: second(19) = [character(len=16) :: "mass nan", "stiffness nan", "no mass", "singular mass", &
      & "negative mass", "least mass", "small mass", "huge stiffness", "great stiffness", "repelled", "free", "damping infinite", &
      & "great damping", "nan later", "rough", "load nan", "huge load", "least load", "no load"]
    character(len=*), parameter :: first(7) = [character(len=16) :: "nan", "infinite", "huge", "growing", "decaying", "nothing", &
      & "forcing nan"]
    character(len=:), allocatable :: complaints
    integer :: i

    complaints = ""
    do i = 1, size(second)
      call solve(faulty_second_order(states=2, period=pi, fault=second(i)), accuracy_type(), trim(second(i)), complaints)
      if (second(i) == "rough") cycle
      call solve(faulty_second_order(states=6, period=pi, fault=second(i)), accuracy_type(tolerance=1.0e-6_dp), trim(second(i)), &
        & complaints)
    end do
    do i = 1, size(first)
      call solve(faulty_first_order(states=2, period=pi, fault=first(i)), accuracy_type(), trim(first(i)), complaints)
    end do
    call solve(faulty_first_order(states=1, period=pi), accuracy_type(), "one state", complaints)
    call solve(faulty_second_order(states=8, period=pi), accuracy_type(), "four degrees of freedom", complaints)
    call solve(faulty_second_order(states=2, period=pi, breaks=[real(dp) ::]), accuracy_type(), "no breaks", complaints)
    call solve(faulty_second_order(states=2, period=tiny(1.0_dp)), accuracy_type(), "least period", complaints)
    call solve(faulty_first_order(states=2, period=huge(1.0_dp)), accuracy_type(), "huge period", complaints)
    call solve(faulty_second_order(states=2, period=1.0e3_dp), accuracy_type(), "long period", complaints)
    call solve(faulty_second_order(states=2, period=1.0e-9_dp), accuracy_type(), "short period", complaints)
    call check(error, complaints, "")
  end subroutine test_faults

  !> Invalid accuracies and methods.
  subroutine test_accuracies(error)
    type(test_error), allocatable, intent(out) :: error
    character(len=*), parameter :: methods(6) = [character(len=16) :: "", "gauss0", "gauss11", "GAUSS6", "xxxxxxxxxxxxxxxx", &
      & "steps"]
    type(faulty_second_order) :: system
    class(method_type), allocatable :: method
    type(error_type), allocatable :: failure
    type(mode_type), allocatable :: modes(:)
    real(dp), allocatable :: mass(:, :)
    character(len=:), allocatable :: complaints
    real(dp) :: tolerances(7)
    integer :: i

    complaints = ""
    system = faulty_second_order(states=2, period=pi)
    tolerances = [0.0_dp, -1.0_dp, nan(), infinite(), 1.0_dp, 2.0_dp, -infinite()]
    do i = 1, size(tolerances)
      call check_refused_with(system, accuracy_type(tolerance=tolerances(i)), "tolerance", complaints)
      call solve_modes(system, accuracy_type(tolerance=tolerances(i)), modes, mass, failure)
      call expect(failure, invalid_input, "modes: tolerance", complaints)
    end do
    call check_refused_with(system, accuracy_type(steps=-1), "negative steps", complaints)
    call check_refused_with(system, accuracy_type(steps=huge(1)), "huge steps", complaints)
    call check_refused_with(system, accuracy_type(steps=200000000), "many steps", complaints)
    do i = 1, size(methods)
      call new_method(trim(methods(i)), method, failure)
      call expect(failure, invalid_input, "method '" // trim(methods(i)) // "'", complaints)
      call solve(system, accuracy_type(method=trim(methods(i))), "method", complaints)
      call solve(system, accuracy_type(method=trim(methods(i)), steps=7), "method and steps", complaints)
    end do
    call solve(system, accuracy_type(method="reduced", steps=3), "reduced", complaints)
    call solve(system, accuracy_type(method="rk4 ", steps=1), "rk4", complaints)
    call solve(system, accuracy_type(tolerance=tiny(1.0_dp)), "tolerance tiny", complaints)
    call check(error, complaints, "")
  end subroutine test_accuracies

  !> Uses results that were never computed, and tables of the wrong shape.
  subroutine test_order_of_calls(error)
    type(test_error), allocatable, intent(out) :: error
    type(floquet_type) :: floquet, other
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(evidence_type) :: found
    type(error_type), allocatable :: failure
    real(dp), allocatable :: x(:, :)
    character(len=:), allocatable :: complaints

    complaints = ""
    call evidence(floquet, found)
    call solve_multipliers(floquet, .true., multipliers, failure)
    call expect(failure, invalid_input, "multipliers of an unsolved system", complaints)
    call solve_multipliers(monodromy, .true., multipliers, failure)
    call expect(failure, invalid_input, "multipliers of no monodromy", complaints)
    call solve_periodic(floquet, solution, failure)
    call expect(failure, invalid_input, "periodic motion of an unsolved system", complaints)
    call solve_periodic(monodromy, solution, failure)
    call expect(failure, invalid_input, "periodic motion of no monodromy", complaints)
    call follow(faulty_second_order(states=2, period=pi), floquet, solution, [0.0_dp], x, failure)
    call expect(failure, invalid_input, "trajectory of an unsolved system", complaints)
    call follow(faulty_second_order(states=2, period=pi), monodromy, solution, [0.0_dp], x, failure)
    call expect(failure, invalid_input, "follow no monodromy", complaints)

    call solve_floquet(faulty_second_order(states=2, period=pi), accuracy_type(), .false., floquet, failure)
    call check_answer(failure, "not forced", complaints)
    call solve_periodic(floquet, solution, failure)
    call expect(failure, invalid_input, "periodic motion without forcing", complaints)
    call solve_monodromy(faulty_second_order(states=2, period=pi), accuracy_type(), .false., monodromy, failure)
    call check_answer(failure, "not forced", complaints)
    call solve_periodic(monodromy, solution, failure)
    call expect(failure, invalid_input, "periodic motion of a monodromy without forcing", complaints)

    call solve_floquet(faulty_second_order(states=2, period=pi), accuracy_type(), .true., other, failure)
    if (.not. allocated(failure)) call solve_periodic(other, solution, failure)
    call check_answer(failure, "periodic motion", complaints)
    call follow(faulty_second_order(states=2, period=pi), other, solution, [0.5_dp, 0.2_dp], x, failure)
    call expect(failure, invalid_input, "phases descend", complaints)
    call follow(faulty_second_order(states=2, period=pi), other, solution, [-0.5_dp, 0.2_dp], x, failure)
    call expect(failure, invalid_input, "phase below 0", complaints)
    call follow(faulty_second_order(states=2, period=pi), other, solution, [0.5_dp, nan()], x, failure)
    call expect(failure, invalid_input, "phase nan", complaints)
    call follow(faulty_second_order(states=4, period=pi), other, solution, [0.5_dp], x, failure)
    call expect(failure, invalid_input, "another system", complaints)

    call solve_floquet(faulty_first_order(states=2, period=pi, table=3), accuracy_type(), .true., other, failure)
    call expect(failure, invalid_input, "coupled of another shape", complaints)
    call check(error, complaints, "")
  end subroutine test_order_of_calls

  !> Steps and shapes of the map of a period and of a trajectory.
  subroutine test_trajectories(error)
    type(test_error), allocatable, intent(out) :: error
    type(faulty_second_order) :: system
    class(method_type), allocatable :: method
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: complaints
    real(dp) :: phi(2, 2), large(3, 3), x(2, 1)

    complaints = ""
    system = faulty_second_order(states=2, period=pi)
    call new_method("gauss4", method, failure)
    call period_map(system, method, [0.0_dp, nan(), 1.0_dp], [1.0_dp, 1.0_dp], phi, failure)
    call expect(failure, invalid_input, "node nan", complaints)
    call period_map(system, method, [0.0_dp, 0.7_dp, 0.5_dp, 1.0_dp], [1.0_dp, 1.0_dp], phi, failure)
    call expect(failure, invalid_input, "nodes descend", complaints)
    call period_map(system, method, [0.0_dp], [1.0_dp, 1.0_dp], phi, failure)
    call expect(failure, invalid_input, "one node", complaints)
    call period_map(system, method, [real(dp) ::], [1.0_dp, 1.0_dp], phi, failure)
    call expect(failure, invalid_input, "no nodes", complaints)
    call period_map(system, method, [0.0_dp, 1.0_dp], [1.0_dp], phi, failure)
    call expect(failure, invalid_input, "units missing", complaints)
    call period_map(system, method, [0.0_dp, 1.0_dp], [1.0_dp, 1.0_dp], large, failure)
    call expect(failure, invalid_input, "phi too large", complaints)
    call trajectory(system, method, [0.0_dp, 1.0_dp], [1.0_dp, 1.0_dp], [2.0_dp], x, failure)
    call expect(failure, invalid_input, "phase above 1", complaints)
    call trajectory(system, method, [0.0_dp, 1.0_dp], [1.0_dp], [0.5_dp], x, failure)
    call expect(failure, invalid_input, "a state missing", complaints)
    call trajectory(system, method, [0.0_dp, 1.0_dp], [1.0_dp, 1.0_dp], [0.5_dp, 0.6_dp], x, failure)
    call expect(failure, invalid_input, "a column missing", complaints)
    call check(error, complaints, "")
    if (allocated(error)) return
    call check_that(error, size(mesh(system, 0)), "==", 2, "one step at least")
    call check_that(error, size(mesh(system, -1)), "==", 2, "one step at least")
  end subroutine test_trajectories

  !> Checks that both ways of solving refuse the system.
  subroutine check_refused(system, what, complaints)
    class(periodic_system), intent(in) :: system
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(inout) :: complaints

    call check_refused_with(system, accuracy_type(), what, complaints)
  end subroutine check_refused

  subroutine check_refused_with(system, accuracy, what, complaints)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(inout) :: complaints
    type(floquet_type) :: floquet
    type(monodromy_type) :: monodromy
    type(error_type), allocatable :: failure

    evaluations = 0
    call solve_floquet(system, accuracy, .true., floquet, failure)
    call expect(failure, invalid_input, "solve_floquet: " // what, complaints)
    call solve_monodromy(system, accuracy, .true., monodromy, failure)
    call expect(failure, invalid_input, "solve_monodromy: " // what, complaints)
  end subroutine check_refused_with

  !> Requests all results of a system.
  subroutine solve(system, accuracy, what, complaints)
    class(periodic_system), intent(in) :: system
    type(accuracy_type), intent(in) :: accuracy
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(inout) :: complaints
    type(floquet_type) :: floquet
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(error_type), allocatable :: failure
    real(dp), allocatable :: x(:, :)

    evaluations = 0
    call solve_floquet(system, accuracy, .true., floquet, failure)
    if (.not. allocated(failure)) call solve_multipliers(floquet, .true., multipliers, failure)
    if (.not. allocated(failure)) call solve_periodic(floquet, solution, failure)
    if (.not. allocated(failure)) call follow(system, floquet, solution, [0.0_dp, 0.5_dp, 1.0_dp], x, failure)
    call check_answer(failure, "solve_floquet: " // what, complaints)
    call solve_monodromy(system, accuracy, .true., monodromy, failure)
    call check_answer(failure, "solve_monodromy: " // what, complaints)
  end subroutine solve

end module invalid_floquet_arguments
