!> Newton's method for the exact frame's vibration: errors of its quick solutions, and the error that remains when it stops.
module test_newton
  use checks, only: check_success, check_that
  use exact_machines, only: scotch_yoke
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_period_quick_motion, only: quick_motion_type, solve_quickly
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_study_frame_model, only: settle
  use gestell_floquet_balance_harmonic_balance, only: balance_harmonics, balance_type
  use gestell_study_frame_model_newton, only: values_of
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine, machine_data
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_newton

  integer, parameter :: machines = 14

contains

  subroutine collect_newton(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the error of the quick solution is at most its truncation estimate", test_truncation), &
      & new_unittest("the error of harmonic balance is at most its truncation estimate", test_balance), &
      & new_unittest("harmonic balance with too few phases reports the error this causes", test_too_few_phases), &
      & new_unittest("Newton's method stops with at most a tenth of the tolerance left", test_remaining_error)]
  end subroutine collect_newton

  !> The paper's machine from slow to fast, and a Scotch yoke, weakly damped.
  subroutine make(number, frame, error)
    integer, intent(in) :: number
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: speeds(machines) = [120.0_dp, 200.0_dp, 210.0_dp, 240.0_dp, 301.0_dp, 370.0_dp, 503.0_dp, 700.0_dp, &
      & 1100.0_dp, 1222.0_dp, 2426.0_dp, 590.0_dp, 905.0_dp, 1400.0_dp]
    type(gestell_error), allocatable :: failure
    type(machine_data) :: machine

    if (number > machines - 3) then
      machine = scotch_yoke(speeds(number))
    else
      machine = khang_machine(speeds(number))
    end if
    call frame_of_machine(machine, frame, failure)
    call check_success(error, failure)
  end subroutine make

  !> Against a quick solution of 1e-10; the model's rounding is below that.
  subroutine test_truncation(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: phases = 64
    real(dp), parameter :: finest = 1.0e-10_dp
    type(frame_type) :: frame
    type(quick_motion_type) :: motion, fine
    real(dp) :: ordered, off, maximum
    logical :: fits
    integer :: number, k

    maximum = 0
    do number = 1, machines
      call make(number, frame, error)
      if (allocated(error)) return
      fine = quick_motion_type()
      motion = quick_motion_type()
      call solve_quickly(frame, phases, finest, fine, fits)
      call check(error, fits, more="the fine solution")
      if (allocated(error)) return
      do k = 1, 4
        ordered = 10.0_dp**(-2 * k)
        call solve_quickly(frame, phases, ordered, motion, fits)
        call check(error, fits, more="a quick solution")
        if (allocated(error)) return
        off = maxval(norm2((motion%x - fine%x) / spread(fine%scale, 2, phases), dim=1)) &
          & / maxval(norm2(fine%x / spread(fine%scale, 2, phases), dim=1))
        maximum = max(maximum, off / motion%truncation)
        call check_that(error, off, "<=", motion%truncation + finest, "distance to the fine solution")
        call check_that(error, motion%truncation, "<=", ordered, "truncation")
        if (allocated(error)) then
          print "(a, i0, 3es10.1)", "         machine, ordered, estimate, error: ", number, ordered, motion%truncation, off
          return
        end if
      end do
    end do
    print "(a, es8.1)", "         largest error over its estimate: ", maximum
  end subroutine test_truncation

  !> Against a quick solution of 1e-10, which integrates.
  subroutine test_balance(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: phases = 64
    real(dp), parameter :: finest = 1.0e-10_dp
    type(frame_type) :: frame
    type(quick_motion_type) :: fine
    type(balance_type) :: motion
    real(dp) :: ordered, off, maximum
    logical :: fits
    integer :: number, k

    maximum = 0
    do number = 1, machines
      call make(number, frame, error)
      if (allocated(error)) return
      fine = quick_motion_type()
      motion = balance_type()
      call solve_quickly(frame, phases, finest, fine, fits)
      do k = 1, 4
        ordered = 10.0_dp**(-2 * k)
        call balance_harmonics(frame, phases, ordered, motion, fits)
        call check(error, fits, more="harmonic balance")
        if (allocated(error)) return
        off = distance(motion, fine)
        maximum = max(maximum, off / motion%truncation)
        call check_that(error, off, "<=", motion%truncation + finest, "distance to the fine solution")
        call check_that(error, motion%truncation, "<=", ordered, "truncation")
        if (allocated(error)) then
          print "(a, i0, 3es10.1)", "         machine, ordered, estimate, error: ", number, ordered, motion%truncation, off
          return
        end if
      end do
    end do
    print "(a, es8.1)", "         largest error over its estimate: ", maximum
  end subroutine test_balance

  !> With fewer phases than the motion needs.
  subroutine test_too_few_phases(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: phases(*) = [32, 48]
    real(dp), parameter :: finest = 1.0e-10_dp
    type(frame_type) :: frame
    type(quick_motion_type) :: fine
    type(balance_type) :: motion
    real(dp) :: off, maximum
    logical :: fits
    integer :: number, k, refused

    maximum = 0
    refused = 0
    do number = 1, machines
      call make(number, frame, error)
      if (allocated(error)) return
      do k = 1, size(phases)
        fine = quick_motion_type()
        motion = balance_type()
        call solve_quickly(frame, phases(k), finest, fine, fits)
        call balance_harmonics(frame, phases(k), finest, motion, fits)
        if (.not. fits) then
          refused = refused + 1
          cycle
        end if
        off = distance(motion, fine)
        maximum = max(maximum, off)
        call check_that(error, off, "<=", 2 * finest, "distance to the fine solution")
        if (allocated(error)) print "(a, 2(i0, tr1), 2es10.1)", "         machine, phases, left out, error: ", number, phases(k), &
          & motion%left_out, off
        if (allocated(error)) return
      end do
    end do
    print "(a, i0, es8.1)", "         refused, largest error of the others: ", refused, maximum
    call check_that(error, real(refused, dp), ">", 0.0_dp, "refused motions")
  end subroutine test_too_few_phases

  !> Largest distance of displacements, relative to them.
  real(dp) function distance(motion, fine)
    type(balance_type), intent(in) :: motion
    type(quick_motion_type), intent(in) :: fine
    real(dp) :: q(size(fine%x, 2), size(fine%x, 1) / 2), units(size(fine%x, 2), size(fine%x, 1) / 2)
    integer :: f

    f = size(q, 2)
    units = spread(fine%scale(:f), 1, size(q, 1))
    q = transpose(fine%x(:f, :))
    distance = maxval(abs(motion%at_phases(motion%harmonics) - q) / units) / maxval(abs(q) / units)
  end function distance

  !> The motions about which multipliers are computed, with a tolerance of 1e-7, against those with 1e-13. At 210 rpm ten times
  !> as much would remain if the truncation of a step's own solution were ignored.
  subroutine test_remaining_error(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: phases = 64
    real(dp), parameter :: tolerance = 1.0e-7_dp, part_left = 0.1_dp, finest = 1.0e-13_dp
    class(frame_type), allocatable :: coarse, fine
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp), dimension(phases, 3) :: q, q_fine
    real(dp) :: off, maximum
    integer :: number

    maximum = 0
    do number = 1, machines
      call make(number, frame, error)
      if (allocated(error)) return
      call settle(frame, "exact", accuracy_type(tolerance=tolerance), coarse, failure)
      if (.not. allocated(failure)) call settle(frame, "exact", accuracy_type(tolerance=finest), fine, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      q = moved(coarse)
      q_fine = moved(fine)
      off = maxval(abs(q - q_fine)) / maxval(abs(q_fine))
      maximum = max(maximum, off)
      call check_that(error, off, "<=", part_left * tolerance, "distance")
      if (allocated(error)) print "(a, i0, es10.1)", "         machine, what is left: ", number, off
      if (allocated(error)) return
    end do
    print "(a, es8.1)", "         largest part that is left: ", maximum

  contains

    function moved(system) result(q)
      class(frame_type), intent(in) :: system
      real(dp) :: q(phases, 3)

      q = 0
      select type (system)
      class is (varied_frame_type)
        q = values_of(system%motion, phases)
      end select
    end function moved

  end subroutine test_remaining_error

end module test_newton
