!> One table of the mechanism for many cases.
module test_shared_tables
  use checks, only: check_success, check_that
  use data_files, only: machine_of_file
  use gestell_api_numerics, only: dp, frame_type, mass_functions_type, mechanism_type, mesh, method_type, new_frame, new_method, &
    & period_map, cache_mechanism, table_columns
  use gestell_api_numerics, only: gestell_error => error_type
  use gestell_base_error, only: fatal_error
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type, grid_type, new_grid
  use gestell_study_point, only: sweep_options
  use gestell_study_mechanism_cache, only: swap_mechanisms
  use gestell_study_tile_results, only: tile_results_type
  use gestell_system_periodic, only: periodic_system
  use gestell_task_sweep, only: solve_tile
  use gestell_model_mechanism_tabulated, only: new_tabulated, tabulated_type
  use machines, only: frame_of_machine
  use reference_machine, only: machine_data
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_shared_tables

  !> A linkage that counts how often it is evaluated.
  type, extends(mechanism_type) :: counting_type
    class(mechanism_type), allocatable :: linkage
    integer, pointer :: count => null()
  contains
    procedure :: mass_functions
    procedure :: prepare
  end type counting_type

  !> Frames at a speed (rad/s) with a multiple of the stiffness, all with one mechanism; they may hide that it is the same.
  type, extends(family_type) :: one_mechanism_type
    type(frame_type) :: frame
    logical :: declared = .true.
  contains
    procedure :: member
    procedure :: shares_mechanism
  end type one_mechanism_type

contains

  subroutine collect_shared_tables(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("many cases share one table of the mechanism", test_cases), &
      & new_unittest("all samples of a cell share one table of the mechanism", test_cell), &
      & new_unittest("a table is used only for exactly its own angles", test_tables), &
      & new_unittest("a tabulated mechanism in a new frame keeps the mechanism's properties", test_new_frame)]
  end subroutine collect_shared_tables

  !> With the table the results are the same except for rounding, for other speeds, stiffnesses, masses and origins, and the
  !> mechanism is not evaluated again. Where the table does not apply, for other steps or the reverse direction, it is.
  subroutine test_cases(error)
    type(error_type), allocatable, intent(out) :: error
    ! 35 and 75 steps are two and three blocks, of which the first one is shortened for the second.
    integer, parameter :: steps(3) = [28, 35, 75]
    type(frame_type) :: plain, frame
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    integer, target :: evaluations
    real(dp), dimension(6, 6) :: phi, again
    real(dp) :: xp(6), xp_again(6), reach, scale(6), nodes(0:75)
    integer :: i, k, before

    call counted_frame(plain, frame, evaluations, failure)
    if (.not. allocated(failure)) call new_method("gauss8", method, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    evaluations = 0
    scale = 1
    do i = 1, size(steps)
      nodes(:steps(i)) = mesh(frame, steps(i))
      call cache_mechanism(frame, method, nodes(:steps(i)))
    end do
    call check(error, evaluations, 8 * sum(steps))
    if (allocated(error)) return

    do k = 1, 4
      plain%speed = 10.0_dp * k
      plain%period = 8 * atan(1.0_dp) / plain%speed
      plain%stiffness = plain%stiffness * 1.1_dp
      plain%damping = plain%damping * 1.2_dp
      plain%mass = plain%mass * 1.3_dp
      plain%origin = plain%origin + 0.01_dp
      frame%speed = plain%speed
      frame%period = plain%period
      frame%stiffness = plain%stiffness
      frame%damping = plain%damping
      frame%mass = plain%mass
      frame%origin = plain%origin
      do i = 1, size(steps)
        call period_map(plain, method, mesh(plain, steps(i)), scale, phi, failure, xp, reach)
        before = evaluations
        call period_map(frame, method, mesh(frame, steps(i)), scale, again, failure, xp_again, reach)
        call check(error, evaluations, before, more="no further evaluations")
        if (allocated(error)) return
        ! The counting mechanism is evaluated one angle at a time, the linkage in bulk: roundings of its sums differ.
        call check_that(error, maxval(abs(again - phi)), "<=", 1.0e-11_dp * maxval(abs(phi)), "with the table")
        call check_that(error, maxval(abs(xp_again - xp)), "<=", 1.0e-11_dp * maxval(abs(xp)), "with the table")
        if (allocated(error)) return
      end do
    end do

    before = evaluations
    call swap_mechanisms(plain, frame)
    call period_map(plain, method, mesh(plain, steps(1)), scale, again, failure)
    call check(error, evaluations, before, more="with the mechanism of the other")
    call swap_mechanisms(plain, frame)
    if (.not. allocated(error)) call check_that(error, maxval(abs(again - phi)), ">", 0.0_dp, "another number of steps")
    if (allocated(error)) return
    call period_map(frame, method, mesh(frame, 29), scale, again, failure)
    call check(error, evaluations, before + 8 * 29, more="other steps")
    if (allocated(error)) return
    frame%speed = -frame%speed
    plain%speed = frame%speed
    call period_map(plain, method, mesh(plain, 28), scale, phi, failure)
    before = evaluations
    call period_map(frame, method, mesh(frame, 28), scale, again, failure)
    call check(error, evaluations, before + 8 * 28, more="turned the other way")
    if (allocated(error)) return
    call check_that(error, maxval(abs(again - phi)), "<=", 1.0e-11_dp * maxval(abs(phi)), "Phi")
  end subroutine test_cases

  !> The paper's machine, and a copy whose linkage counts evaluations.
  subroutine counted_frame(plain, frame, evaluations, failure)
    type(frame_type), intent(out) :: plain, frame
    integer, target, intent(in) :: evaluations
    type(gestell_error), allocatable, intent(out) :: failure
    type(machine_data) :: machine
    type(counting_type) :: counting

    call machine_of_file("data/khang_four_bar.nml", machine, failure)
    if (.not. allocated(failure)) call frame_of_machine(machine, plain, failure)
    if (allocated(failure)) return
    counting%mass = plain%mechanism%mass
    counting%inertia = plain%mechanism%inertia
    counting%angle_scale = plain%mechanism%angle_scale
    counting%count => evaluations
    allocate(counting%linkage, source=plain%mechanism)
    frame = plain
    deallocate(frame%mechanism)
    allocate(frame%mechanism, source=counting)
  end subroutine counted_frame

  !> The samples of an expansion share one table of a mechanism that is the same in all of them. Evaluations remain for single
  !> solutions at corners and checks, and for one table. The numbers are the same.
  subroutine test_cell(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(one_mechanism_type) :: family
    type(frame_type) :: plain
    type(grid_type) :: grid
    type(sweep_options) :: options
    type(tile_results_type) :: results(2)
    integer, target :: evaluations
    integer :: k, counted(2)

    call counted_frame(plain, family%frame, evaluations, failure)
    if (.not. allocated(failure)) call new_grid(grid, [axis_type(21.0_dp, 31.0_dp, 160), axis_type(0.8_dp, 1.2_dp, 160)], failure)
    options%engine = "expansion"
    do k = 1, 2
      family%declared = k == 1
      evaluations = 0
      if (.not. allocated(failure)) call solve_tile(family, grid, grid%tile(6), options, results(k), failure)
      call check_success(error, failure)
      if (allocated(error)) return
      counted(k) = evaluations
    end do
    call check_that(error, results(1)%solutions, ">", 100, "solutions")
    call check_that(error, counted(1), "<", counted(2) / 3, "evaluations")
    call check_that(error, [abs(results(1)%values - results(2)%values)], "<=", 0.0_dp, "the same numbers")
  end subroutine test_cell

  subroutine member(self, parameters, system, error)
    class(one_mechanism_type), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(gestell_error), allocatable, intent(out) :: error
    type(frame_type), allocatable :: frame

    allocate(frame, source=self%frame)
    frame%speed = parameters(1)
    frame%period = 8 * atan(1.0_dp) / frame%speed
    frame%stiffness = frame%stiffness * parameters(2)
    call move_alloc(frame, system)
    if (.not. allocated(system)) call fatal_error(error, "no frame", 2)
  end subroutine member

  pure logical function shares_mechanism(self)
    class(one_mechanism_type), intent(in) :: self

    shares_mechanism = self%declared
  end function shares_mechanism

  !> The angle scale that `prepare` determines: 0.02 rad.
  subroutine prepare(self, error)
    class(counting_type), intent(inout) :: self
    type(gestell_error), allocatable, intent(out) :: error

    self%angle_scale = 0.02_dp
    if (.not. allocated(self%linkage)) call fatal_error(error, "no linkage", 2)
  end subroutine prepare

  subroutine mass_functions(self, crank_angle, a)
    class(counting_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(mass_functions_type), intent(out) :: a

    self%count = self%count + 1
    call self%linkage%mass_functions(crank_angle, a)
  end subroutine mass_functions

  !> Requests with fewer angles, or with angles that differ in the last digits, are not served from the table.
  subroutine test_tables(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: many = 40, few = 8
    type(frame_type) :: frame
    type(tabulated_type) :: tabulated
    real(dp) :: angles(many), near(many), table(many, table_columns), exact(many, table_columns)
    integer :: k

    call four_bar(frame, error)
    if (allocated(error)) return
    call new_tabulated(tabulated, frame%mechanism)
    angles = [(0.1_dp * k, k = 1, many)]
    call tabulated%remember(angles, .false.)
    table = 0
    call tabulated%tabulate(angles(:few), table(:few, :))
    call frame%mechanism%tabulate(angles(:few), exact(:few, :))
    call check_that(error, maxval(abs(table(:few, :) - exact(:few, :))), "<=", 0.0_dp, "fewer")
    call check_that(error, maxval(abs(table(few + 1:, :))), "<=", 0.0_dp, "fewer")
    if (allocated(error)) return
    near = angles
    near(many) = near(many) + 1.0e-9_dp
    call tabulated%tabulate(near, table)
    call frame%mechanism%tabulate(near, exact)
    call check_that(error, maxval(abs(table - exact)), "<=", 0.0_dp, "near")
  end subroutine test_tables

  !> The properties of a mechanism that a frame needs are those of the source, alone and in a frame.
  subroutine test_new_frame(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: plain, frame
    type(tabulated_type) :: tabulated
    type(counting_type) :: counting
    type(gestell_error), allocatable :: failure
    integer, target :: evaluations

    call four_bar(plain, error)
    if (allocated(error)) return
    plain%mechanism%angle_scale = 0.01_dp
    call new_tabulated(tabulated, plain%mechanism)
    call check_that(error, abs(tabulated%angle_scale - 0.01_dp), "<=", 0.0_dp, "new")
    call check_that(error, abs(tabulated%mass - plain%mechanism%mass), "<=", 0.0_dp, "new")
    call check_that(error, abs(tabulated%inertia - plain%mechanism%inertia), "<=", 0.0_dp, "new")
    if (allocated(error)) return
    allocate(counting%linkage, source=plain%mechanism)
    counting%count => evaluations
    call new_tabulated(tabulated, counting)
    call new_frame(frame, tabulated, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], plain%stiffness, plain%damping, 10.0_dp, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    ! 2 pi / 0.02
    call check(error, frame%least_steps, 315, more="prepared")
  end subroutine test_new_frame

  subroutine four_bar(frame, error)
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(gestell_error), allocatable :: failure

    call machine_of_file("data/khang_four_bar.nml", machine, failure)
    if (.not. allocated(failure)) call frame_of_machine(machine, frame, failure)
    call check_success(error, failure)
  end subroutine four_bar

end module test_shared_tables
