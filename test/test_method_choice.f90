!> The work that methods report, and the choice that depends on it.
module test_method_choice
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: text
  use gestell_floquet_integrator_method, only: method_type, name_length
  use gestell_floquet_choice_cheapest, only: cheapest_method
  use gestell_floquet_choice_methods, only: method_names, new_method
  use gestell_floquet_choice_prediction, only: first_steps
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_model_frame, only: frame_type
  use gestell_system_periodic, only: periodic_system
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
  implicit none (type, external)
  private

  public :: collect_method_choice

  !> P = (1 + change cos(2 pi t / T)) E.
  type, extends(periodic_system) :: still_type
    real(dp) :: change = 0
  contains
    procedure :: matrix => still_matrix
  end type still_type

  !> A system that turns by w radians in a period and also decays.
  type, extends(periodic_system) :: turning_type
    real(dp) :: w = 1
  contains
    procedure :: matrix => turning_matrix
  end type turning_type

contains

  subroutine collect_method_choice(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the work of a step grows with the states and stages", test_work), &
      & new_unittest("low order is chosen for easy cases, high order for hard ones", test_choice), &
      & new_slow("the chosen method needs at most half more than the least work", test_least_work), &
      & new_unittest("fast vibrations demand a method of order 8 or more", test_large_choice), &
      & new_unittest("methods that pay only in blocks of eight steps are avoided", test_few_steps)]
  end subroutine collect_method_choice

  subroutine still_matrix(self, t, p)
    class(still_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    integer :: i

    p = 0
    do i = 1, self%states
      p(i, i) = 1 + self%change * cos(2 * pi * t / self%period)
    end do
  end subroutine still_matrix

  !> More states and more stages require more work; eliminating the positions saves some (with two stages 40 %, with more 90 %).
  subroutine test_work(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=name_length), allocatable :: names(:)
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    real(dp) :: before
    integer :: i

    allocate(names, source=method_names())
    before = 0
    do i = 2, size(names)
      call new_method(trim(names(i)), method, failure)
      call check_that(error, method%work(6, .true.), ">", method%work(2, .true.), names(i))
      call check_that(error, method%work(2, .true.), ">", 0.0_dp, names(i))
      if (allocated(error)) return
      if (names(i)(:5) == "gauss") then
        call check_that(error, method%work(6, .true.), ">", before, names(i))
        call check_that(error, method%work(12, .false.), ">", 1.5_dp * method%work(12, .true.), names(i))
        if (allocated(error)) return
        before = method%work(6, .true.)
      end if
      deallocate(method)
    end do
  end subroutine test_work

  subroutine test_choice(error)
    type(error_type), allocatable, intent(out) :: error
    class(method_type), allocatable :: method
    type(frame_type) :: frame
    type(still_type) :: still
    type(gestell_error), allocatable :: failure
    real(dp) :: work, before
    integer :: k

    call frame_of_machine(khang_machine(240.0_dp), frame, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call cheapest_method(frame, survey_type(1.5_dp, 1.5_dp, [3.0_dp, 3.0_dp]), 1.0e-3_dp, method)
    ! Eight steps once cost less than three solutions of a lower order: the lowest order with embedded methods.
    call check(error, method%name, "gauss6", more="easy")
    if (allocated(error)) return
    call cheapest_method(frame, survey_type(1500.0_dp, 1500.0_dp), 1.0e-12_dp, method)
    call check(error, method%name, "gauss10", more="hard")
    if (allocated(error)) return
    work = 0
    do k = 1, 14
      before = work
      call cheapest_method(frame, survey_type(20.0_dp, 20.0_dp), 10.0_dp**(-k), method)
      work = first_steps(method, frame, survey_type(20.0_dp, 20.0_dp), 10.0_dp**(-k)) * method%work(frame%states, .true.)
      call check_that(error, work, ">=", before, "the tighter, the more work: " // method%name)
      call check_that(error, method%order, ">=", 12, "a method with embedded methods")
      if (allocated(error)) return
    end do

    ! Of 24 states in first order collocation solves 96 equations, too many for lanes, where Magnus multiplies matrices.
    still = still_type(states=24, period=1.0_dp)
    call cheapest_method(still, survey_type(60.0_dp, 60.0_dp), 1.0e-6_dp, method)
    call check(error, method%name(:6), "magnus", more="nothing changes")
    if (allocated(error)) return
    still%change = 0.02_dp
    call cheapest_method(still, survey_type(60.0_dp, 60.0_dp), 1.0e-9_dp, method)
    call check(error, method%name, "magnus6", more="slow changes of a fiftieth")
    if (allocated(error)) return
    still%least_steps = 300
    call cheapest_method(still, survey_type(60.0_dp, 60.0_dp), 1.0e-9_dp, method)
    call check_that(error, method%name(:6), "/=", "magnus", "fast changes")
    if (allocated(error)) return
    still = still_type(states=24, period=1.0_dp, change=5.0_dp)
    call cheapest_method(still, survey_type(60.0_dp, 60.0_dp), 1.0e-9_dp, method)
    call check_that(error, method%name(:6), "/=", "magnus", "great changes")
  end subroutine test_choice

  !> The paper's machine at two speeds: the number of steps that each method really takes, times its work per step.
  subroutine test_least_work(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: rpm(2) = [240.0_dp, 2000.0_dp]
    character(len=name_length), allocatable :: names(:)
    class(method_type), allocatable :: method
    type(frame_type) :: frame
    type(survey_type) :: survey
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: work, least, chosen
    integer :: i, k, m

    allocate(names, source=method_names())
    do i = 1, size(rpm)
      call frame_of_machine(khang_machine(rpm(i)), frame, failure)
      if (.not. allocated(failure)) call survey_system(frame, survey, failure, .true.)
      call check_success(error, failure)
      if (allocated(error)) return
      do k = 3, 12, 3
        call cheapest_method(frame, survey, 10.0_dp**(-k), method)
        least = huge(least)
        chosen = 0
        do m = 2, size(names)
          if (.not. allocated(failure)) call solve_monodromy(frame, &
            & accuracy_type(tolerance=10.0_dp**(-k), method=trim(names(m))), .true., monodromy, failure)
          call check_success(error, failure)
          if (allocated(error)) return
          work = monodromy%evaluations / monodromy%method%stages * monodromy%method%work(6, .true.)
          least = min(least, work)
          if (names(m) == method%name) chosen = work
        end do
        call check_that(error, chosen, ">", 0.0_dp, method%name)
        call check_that(error, chosen, "<=", 1.5_dp * least, method%name // ": least work, rpm " &
          & // text(nint(rpm(i))) // ", digits " // text(k))
        if (allocated(error)) return
      end do
    end do
  end subroutine test_least_work

  subroutine turning_matrix(self, t, p)
    class(turning_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    p = 0
    p(1, 2) = self%w * (1 + 0.3_dp * cos(2 * pi * t))
    p(2, 1) = -p(1, 2)
    p(3, 3) = -0.1_dp
  end subroutine turning_matrix

  !> A low order is not chosen for a million turns and more; works are positive and grow with the states.
  subroutine test_large_choice(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=name_length), allocatable :: names(:)
    class(method_type), allocatable :: method
    type(gestell_error), allocatable :: failure
    type(turning_type) :: system
    real(dp) :: before
    logical :: traps(size(ieee_usual))
    integer :: i, k

    call ieee_get_halting_mode(ieee_usual, traps)
    call ieee_set_halting_mode(ieee_usual, .false.)
    system%states = 3
    system%period = 1
    do k = 4, 12
      system%w = 10.0_dp**k
      call cheapest_method(system, survey_type(system%w, system%w), 1.0e-6_dp, method)
      if (.not. allocated(error)) call check_that(error, method%order, ">=", 8, method%name)
    end do
    allocate(names, source=method_names())
    do i = 2, size(names)
      call new_method(trim(names(i)), method, failure)
      before = 0
      do k = 40, 400, 20
        if (.not. allocated(error)) call check_that(error, method%work(k, .false.), ">", before, names(i))
        before = method%work(k, .false.)
      end do
    end do
    call ieee_set_flag(ieee_usual, .false.)
    call ieee_set_halting_mode(ieee_usual, traps)
  end subroutine test_large_choice

  !> If a few steps suffice, methods that compute eight steps at once do not pay.
  subroutine test_few_steps(error)
    type(error_type), allocatable, intent(out) :: error
    type(turning_type) :: system
    class(method_type), allocatable :: method

    system%states = 3
    system%period = 1
    system%least_steps = 1
    system%w = 0.01_dp
    call cheapest_method(system, survey_type(0.02_dp, 0.02_dp), 1.0e-3_dp, method)
    call check_that(error, method%name(:5), "/=", "gauss", method%name)
  end subroutine test_few_steps

end module test_method_choice
