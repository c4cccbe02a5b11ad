!> Modes keep their identity along the speeds.
module test_campbell_tracking
  use checks, only: check_success, check_that
  use families, only: machine_family
  use gestell_base_error, only: gestell_error => error_type, fatal_error, impossible_mechanism
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type
  use gestell_task_campbell, only: campbell_options, campbell_type, solve_campbell
  use gestell_task_campbell_crossings, only: crossing_type, find_crossings
  use gestell_system_family, only: family_type
  use gestell_study_mode, only: assurance
  use gestell_system_periodic, only: periodic_system
  use gestell_task_common_executor, only: executor_type, work_type
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine, machine_data
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: collect_campbell_tracking

  !> The paper's machine, with a range of speeds in which there is no machine.
  type, extends(family_type) :: broken_family
    type(machine_family) :: inner
    real(dp) :: hole(2) = 0
  contains
    procedure :: member
  end type broken_family

  !> A frame free along x and y whose stiffness depends on the speed: the stiff axis turns, or the stiffnesses along x and y change
  !> places.
  type, extends(family_type) :: changing_family
    type(machine_family) :: inner
    logical :: turning = .true.
  contains
    procedure :: member => member_that_changes
  end type changing_family

  !> Records how many pieces of work it received at once.
  type, extends(executor_type) :: counting_executor
    integer :: pieces(8) = 0, calls = 0
  contains
    procedure :: distribute => count_and_spread
  end type counting_executor

contains

  subroutine collect_campbell_tracking(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("modes keep their numbers through a range where they mix", test_mixing), &
      & new_unittest("modes keep their numbers while shapes turn or frequencies cross", test_changing), &
      & new_unittest("all intervals are refined in one round, with the results of separate searches", test_levels), &
      & new_unittest("modes keep their numbers across a gap in the speed range", test_gap)]
  end subroutine collect_campbell_tracking

  !> Near 707 rpm the first two frequencies of the paper's machine differ by the crank's: the modes mix. Before and after each
  !> has its own shape and frequency.
  subroutine test_mixing(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: family
    type(campbell_type) :: campbell
    type(gestell_error), allocatable :: failure
    integer :: i, k

    call frame_of_machine(khang_machine(240.0_dp), family%frame, failure)
    if (.not. allocated(failure)) call solve_campbell(family, [600.0_dp, (680 + 3.1_dp * i, i = 0, 17), 800.0_dp], &
      & campbell_options(), campbell, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, any(.not. campbell%points%unambiguous), more="sure")
    if (allocated(error)) return
    call check_that(error, size(campbell%points), "<", 100, "too much inserted")
    if (allocated(error)) return
    do i = 1, size(campbell%points)
      associate (first => campbell%points(1), point => campbell%points(i))
        do k = 1, 3
          ! They repel each other by 0.5 rad/s at the most.
          call check_that(error, abs(point%modes(k)%frequency() - first%modes(k)%frequency()), "<", 1.0_dp, "frequency")
          if (allocated(error)) return
          ! Half of each vibration is the other's shape in the middle of the range in which they mix, 15 rpm wide.
          if (abs(point%speed - 707) < 15) cycle
          call check(error, point%unambiguous, more="not sure")
          if (allocated(error)) return
          call check_that(error, assurance(point%modes(k)%shape(), first%modes(k)%shape(), point%mass), ">", 0.9_dp, "shape")
          if (allocated(error)) return
        end do
      end associate
    end do
  end subroutine test_mixing

  subroutine member_that_changes(self, parameters, system, error)
    class(changing_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(gestell_error), allocatable, intent(out) :: error
    real(dp), parameter :: soft = 1.0e5_dp, stiff = 1.1e5_dp
    real(dp) :: part

    call self%inner%member(parameters, system, error)
    if (allocated(error)) return
    part = (parameters(1) - 300) / 300
    select type (system)
    class is (frame_type)
      system%stiffness = 0
      if (self%turning) then
        associate (c => cos(pi / 2 * part), s => sin(pi / 2 * part))
          system%stiffness(1, :2) = [soft * c**2 + stiff * s**2, (soft - stiff) * s * c]
          system%stiffness(2, :2) = [(soft - stiff) * s * c, soft * s**2 + stiff * c**2]
        end associate
      else
        system%stiffness(1, 1) = soft + (stiff - soft) * part
        system%stiffness(2, 2) = stiff + (soft - stiff) * part
      end if
    end select
  end subroutine member_that_changes

  !> From the shapes at two speeds alone the modes of axes that turn by 51 deg would be exchanged. Where the frequencies cross,
  !> the numbers are those of the lowest speed, whichever way the range runs.
  subroutine test_changing(error)
    type(error_type), allocatable, intent(out) :: error
    type(changing_family) :: family
    type(campbell_type) :: campbell
    type(machine_data) :: machine
    type(gestell_error), allocatable :: failure
    integer :: way, last, low

    machine = khang_machine(240.0_dp)
    machine%free(3) = .false.
    machine%foundation_damping = 0
    call frame_of_machine(machine, family%inner%frame, failure)
    do way = 1, 3
      family%turning = way == 1
      if (allocated(failure)) exit
      if (way == 1) call solve_campbell(family, [310.0_dp, 480.0_dp], campbell_options(), campbell, failure)
      if (way == 2) call solve_campbell(family, [310.0_dp, 400.0_dp, 500.0_dp, 590.0_dp], campbell_options(), campbell, failure)
      if (way == 3) call solve_campbell(family, [590.0_dp, 500.0_dp, 400.0_dp, 310.0_dp], campbell_options(), campbell, failure)
      if (allocated(failure)) exit
      last = size(campbell%points)
      low = merge(last, 1, way == 3)
      call check_that(error, any(.not. campbell%points%ordered), "==", way == 1, "inserted points")
      if (allocated(error)) return
      associate (at_low => campbell%points(low)%modes(:2)%frequency(), &
        & at_high => campbell%points(1 + last - low)%modes(:2)%frequency())
        call check_that(error, at_low(1), "<", at_low(2), "numbers")
        ! The axes turn, but the soft one remains the soft one; or soft and stiff change places.
        call check_that(error, (at_high(1) < at_high(2)), "==", way == 1, "modes are exchanged")
        if (allocated(error)) return
      end associate
    end do
    call check_success(error, failure)
  end subroutine test_changing

  subroutine count_and_spread(self, work, pieces, error, points)
    class(counting_executor), intent(inout) :: self
    class(work_type), intent(inout) :: work
    integer, intent(in) :: pieces(:)
    type(gestell_error), allocatable, intent(out) :: error
    integer(int64), intent(in), optional :: points(:)

    self%calls = self%calls + 1
    self%pieces(min(self%calls, size(self%pieces))) = size(pieces)
    call self%executor_type%distribute(work, pieces, error, points)
  end subroutine count_and_spread

  !> The axes turn by 42 deg on each of two intervals. Both intervals are halved in one round of work, with the results of a
  !> search of either interval alone.
  subroutine test_levels(error)
    type(error_type), allocatable, intent(out) :: error
    type(changing_family) :: family
    type(campbell_type) :: whole, halves(2)
    type(machine_data) :: machine
    type(counting_executor) :: executor
    type(gestell_error), allocatable :: failure
    real(dp), parameter :: speeds(3) = [310.0_dp, 450.0_dp, 590.0_dp]
    integer :: i

    machine = khang_machine(240.0_dp)
    machine%free(3) = .false.
    machine%foundation_damping = 0
    call frame_of_machine(machine, family%inner%frame, failure)
    if (.not. allocated(failure)) call solve_campbell(family, speeds, campbell_options(), whole, failure, executor)
    do i = 1, 2
      if (.not. allocated(failure)) call solve_campbell(family, speeds(i:i + 1), campbell_options(), halves(i), failure)
    end do
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, executor%calls, "==", 2, "rounds of work")
    if (.not. allocated(error)) call check_that(error, executor%pieces(2), "==", 2, "halvings in the second round")
    if (.not. allocated(error)) call check_that(error, size(whole%points), "==", 5, "points")
    if (.not. allocated(error)) call check_that(error, whole%solutions, "==", 5, "solutions")
    if (allocated(error)) return
    call check_that(error, maxval(abs(whole%points%speed - [halves(1)%points%speed, halves(2)%points(2:)%speed])), "<=", 0.0_dp, &
      & "speeds")
    do i = 1, 5
      if (allocated(error)) return
      associate (at => whole%points(i)%modes(:2)%frequency())
        ! The soft and the stiff mode keep their numbers.
        call check_that(error, at(1), "<", at(2), "numbers")
      end associate
    end do
  end subroutine test_levels

  subroutine member(self, parameters, system, error)
    class(broken_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(gestell_error), allocatable, intent(out) :: error

    if (parameters(1) > self%hole(1) .and. parameters(1) < self%hole(2)) then
      call fatal_error(error, "a hole", impossible_mechanism)
      return
    end if
    call self%inner%member(parameters, system, error)
  end subroutine member

  !> Crossings in the gap are not found, those outside are, and modes keep their numbers across the gap.
  subroutine test_gap(error)
    type(error_type), allocatable, intent(out) :: error
    type(broken_family) :: family
    type(campbell_options) :: options
    type(campbell_type) :: campbell
    type(crossing_type), allocatable :: crossings(:)
    type(gestell_error), allocatable :: failure
    integer :: i

    options%orders = 5
    call frame_of_machine(khang_machine(240.0_dp), family%inner%frame, failure)
    family%hole = [390.0_dp, 420.0_dp]
    if (.not. allocated(failure)) call solve_campbell(family, [(290.0_dp + 10 * i, i = 1, 21)], options, campbell, failure)
    if (.not. allocated(failure)) call find_crossings(family, options, campbell, crossings, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check(error, count(.not. campbell%points%solved), 2, more="points in the gap")
    if (allocated(error)) return
    do i = 1, size(campbell%points)
      if (.not. campbell%points(i)%solved) cycle
      ! The frequencies change by less than 0.1 rad/s over the range.
      call check_that(error, maxval(abs(campbell%points(i)%modes(:3)%frequency() &
        & - campbell%points(1)%modes(:3)%frequency())), "<", 0.1_dp, "numbers")
      if (allocated(error)) return
    end do
    ! 303.9 (1, 4), 480.7 (2, 4), 384.6 (2, 5); not 405.2 (1, 3).
    call check(error, size(crossings), 3, more="crossings")
  end subroutine test_gap

end module test_campbell_tracking
