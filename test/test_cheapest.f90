!> What the methods tell of their work, and the choice that rests on it.
module test_cheapest
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_method, only: method_type, name_length
  use gestell_floquet_methods, only: cheapest_method, method_names, new_method
  use gestell_floquet_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_model_frame, only: frame_type
  use gestell_system_periodic, only: periodic_system
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  implicit none (type, external)
  private

  public :: collect_cheapest

  !> P = (1 + change cos(2 pi t / T)) E.
  type, extends(periodic_system) :: still_type
    real(dp) :: change = 0
  contains
    procedure :: matrix => still_matrix
  end type still_type

contains

  subroutine collect_cheapest(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("works of the steps", test_work), &
      & new_unittest("low order for easy cases, high order for hard ones", test_choice), &
      & new_unittest("at most half more than the least work", test_least_work)]
  end subroutine collect_cheapest

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

  !> More states and more stages are more work; eliminating the positions saves some (with two stages 40 %, with more 90 %).
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
      call check(error, method%work(6, .true.) > method%work(2, .true.) .and. method%work(2, .true.) > 0, more=names(i))
      if (allocated(error)) return
      if (names(i)(:5) == "gauss") then
        call check(error, method%work(6, .true.) > before .and. method%work(12, .false.) > 1.5_dp * method%work(12, .true.), &
          & more=names(i))
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
    integer :: before, k

    call frame_of_machine(khang_machine(240.0_dp), frame, failure)
    if (allocated(failure)) then
      call test_failed(error, failure%message)
      return
    end if
    call cheapest_method(frame, 1.5_dp, 1.0e-3_dp, method)
    call check(error, method%order <= 4, more="easy: " // method%name)
    if (allocated(error)) return
    call cheapest_method(frame, 1500.0_dp, 1.0e-12_dp, method)
    call check(error, method%name, "gauss10", more="hard")
    if (allocated(error)) return
    before = 0
    do k = 1, 14
      call cheapest_method(frame, 20.0_dp, 10.0_dp**(-k), method)
      call check(error, method%order >= before, more="the tighter, the higher the order")
      if (allocated(error)) return
      before = method%order
    end do

    ! Of twelve states in first order collocation solves 72 equations where Magnus multiplies matrices.
    still = still_type(states=12, period=1.0_dp)
    call cheapest_method(still, 60.0_dp, 1.0e-6_dp, method)
    call check(error, method%name(:6), "magnus", more="nothing changes")
    if (allocated(error)) return
    still%change = 0.02_dp
    call cheapest_method(still, 60.0_dp, 1.0e-9_dp, method)
    call check(error, method%name, "magnus6", more="slow changes of a fiftieth")
    if (allocated(error)) return
    still%least_steps = 300
    call cheapest_method(still, 60.0_dp, 1.0e-9_dp, method)
    call check(error, method%name(:6) /= "magnus", more="fast changes")
    if (allocated(error)) return
    still = still_type(states=12, period=1.0_dp, change=5.0_dp)
    call cheapest_method(still, 60.0_dp, 1.0e-9_dp, method)
    call check(error, method%name(:6) /= "magnus", more="great changes")
  end subroutine test_choice

  !> The paper's machine at two speeds: the steps that each method really takes, times its work.
  subroutine test_least_work(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: rpm(2) = [240.0_dp, 2000.0_dp], turns(2) = [125.0_dp, 15.0_dp]
    character(len=name_length), allocatable :: names(:)
    class(method_type), allocatable :: method
    type(frame_type) :: frame
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: work, least, chosen
    integer :: i, k, m

    allocate(names, source=method_names())
    do i = 1, size(rpm)
      call frame_of_machine(khang_machine(rpm(i)), frame, failure)
      do k = 3, 12, 3
        call cheapest_method(frame, turns(i), 10.0_dp**(-k), method)
        least = huge(least)
        chosen = 0
        do m = 2, size(names)
          if (.not. allocated(failure)) call solve_monodromy(frame, &
            & accuracy_type(tolerance=10.0_dp**(-k), method=trim(names(m))), .true., monodromy, failure)
          if (allocated(failure)) then
            call test_failed(error, failure%message)
            return
          end if
          work = monodromy%evaluations / monodromy%method%stages * monodromy%method%work(6, .true.)
          least = min(least, work)
          if (names(m) == method%name) chosen = work
        end do
        call check(error, chosen > 0 .and. chosen <= 1.5_dp * least, more=method%name)
        if (allocated(error)) return
      end do
    end do
  end subroutine test_least_work

end module test_cheapest
