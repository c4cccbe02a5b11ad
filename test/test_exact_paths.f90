!> The exact frame where its vibration is far from the linear one; its invariants.
module test_exact_paths
  use checks, only: check_success, check_that
  use exact_machines, only: check_residual, light_slider, machine_on_supports, ram, scotch_yoke, &
    & sinking_slider, solve, solve_multiplier, swinging_yoke
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_math_series_trigonometric, only: series_type
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_study_frame_model, only: newton_type, settle
  use gestell_study_frame_model_vibration_path, only: follow_excitation, follow_speed
  use gestell_study_vibration_vibration_list, only: index_sum, list_vibrations, search_vibrations, listed_vibration_type
  use machines, only: frame_of_machine
  use reference_machine, only: khang_machine, machine_data
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use user_mechanisms, only: count_angles
  implicit none (type, external)
  private

  public :: collect_exact_paths

contains

  subroutine collect_exact_paths(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("path following finds vibrations far from the linear one", test_paths), &
      & new_unittest("the excitation path and the speed path each find a vibration", test_each_path), &
      & new_unittest("a frame swinging by more than a radian has its published multiplier", test_great_turn), &
      & new_unittest("a diverging Newton iteration is abandoned early", test_divergence), &
      & new_unittest("the path over damping finds a vibration that other paths miss", test_damping_path), &
      & new_unittest("a search that finds no vibration ends within bounded work", test_search_ends), &
      & new_slow("all three vibrations of a yoke are found from each of them", test_all_vibrations), &
      & new_unittest("undamped machines have reciprocal multipliers about their exact vibration", test_reciprocal), &
      & new_unittest("the product of the multipliers agrees with Liouville's formula", test_liouville)]
  end subroutine collect_exact_paths

  !> Close to resonances of a machine with almost no damping, whose linear vibration is a hundred millimetres. At 609 rpm the
  !> path from rest passes two turning points; at 961.3 rpm the path over the speed leads to the vibration.
  subroutine test_paths(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: speeds(2) = [609.0_dp, 961.3_dp]
    class(frame_type), allocatable :: system
    type(newton_type) :: newton
    integer :: i

    do i = 1, size(speeds)
      call solve(khang_machine(speeds(i)), "exact", system, error, newton)
      if (.not. allocated(error)) call check(error, newton%followed, more="Newton's method needed no path")
      if (.not. allocated(error)) call check_residual(khang_machine(speeds(i)), system, error)
      if (allocated(error)) return
    end do
  end subroutine test_paths

  !> The paths over the excitation and over the speed each lead to a vibration on their own; the path over the damping is tested
  !> below.
  subroutine test_each_path(error)
    type(error_type), allocatable, intent(out) :: error
    type(accuracy_type), parameter :: accuracy = accuracy_type(tolerance=1.0e-11_dp)
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(series_type) :: rest
    type(varied_frame_type) :: varied
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: steps(:)
    character(len=10), parameter :: paths(2) = [character(len=10) :: "excitation", "speed"]
    integer :: i

    allocate(rest%cosine(0:1, 3), rest%sine(0:1, 3), source=0.0_dp)
    do i = 1, size(paths)
      machine = khang_machine(merge(609.0_dp, 961.3_dp, i == 1))
      call frame_of_machine(machine, frame, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      varied = varied_frame(frame, rest)
      varied%newton = .true.
      if (i == 1) call follow_excitation(frame, accuracy, varied, steps, failure)
      if (i == 2) call follow_speed(frame, accuracy, varied, steps, failure)
      call check_success(error, failure, "the path over the " // trim(paths(i)))
      if (.not. allocated(error)) call check_residual(machine, varied, error)
      if (allocated(error)) return
    end do
  end subroutine test_each_path

  !> The largest multiplier by two programs independent of this project: 0.997621; psi reaches 1.42 rad.
  subroutine test_great_turn(error)
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), allocatable :: system
    type(multipliers_type) :: exact

    call solve(swinging_yoke(), "exact", system, error)
    if (.not. allocated(error)) call check_residual(swinging_yoke(), system, error)
    if (.not. allocated(error)) call solve_multiplier(swinging_yoke(), "exact", exact, error)
    if (allocated(error)) return
    ! six digits are given
    call check(error, exp(exact%log_abs(1)), 0.997621_dp, thr=6.0e-7_dp, more="largest |rho|")
  end subroutine test_great_turn

  !> Solves `system` by the exact frame, and counts the crank `angles` at which the masses were evaluated.
  subroutine settle_counted(machine, accuracy, system, angles, failure)
    type(machine_data), intent(in) :: machine
    type(accuracy_type), intent(in) :: accuracy
    class(frame_type), allocatable, intent(out) :: system
    integer, intent(out), target :: angles
    type(gestell_error), allocatable, intent(out) :: failure
    type(frame_type) :: frame

    angles = 0
    call frame_of_machine(machine, frame, failure)
    if (allocated(failure)) return
    call count_angles(frame%mechanism, angles)
    call settle(frame, "exact", accuracy, system, failure)
  end subroutine settle_counted

  !> The vibration of the ram is found with fewer evaluations of the masses than 20 integrations of 500 steps of eight stages
  !> take (formerly twelve million).
  subroutine test_divergence(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most = 20 * 500 * 8
    class(frame_type), allocatable :: system
    type(gestell_error), allocatable :: failure
    integer, target :: angles

    call settle_counted(ram(), accuracy_type(tolerance=1.0e-11_dp), system, angles, failure)
    call check_success(error, failure)
    if (.not. allocated(error)) call check_residual(ram(), system, error)
    if (.not. allocated(error)) call check_that(error, real(angles, dp), "<", real(most, dp), "crank angles")
  end subroutine test_divergence

  !> The path over the damping finds the vibration; the three other ways do not.
  subroutine test_damping_path(error)
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), allocatable :: system

    call solve(light_slider(), "exact", system, error)
    if (.not. allocated(error)) call check_residual(light_slider(), system, error)
  end subroutine test_damping_path

  !> The search for a vibration of the sinking slider-crank fails after fewer evaluations of the masses than 100 integrations of
  !> 500 steps of eight stages take. It took 4.4 million when a path could lead back to a thousand times the damping at its
  !> start.
  subroutine test_search_ends(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most = 100 * 500 * 8
    class(frame_type), allocatable :: system
    type(gestell_error), allocatable :: failure
    integer, target :: angles

    call settle_counted(sinking_slider(), accuracy_type(), system, angles, failure)
    call check(error, allocated(failure), more="a vibration is found")
    if (.not. allocated(error)) call check_that(error, real(angles, dp), "<", real(most, dp), "crank angles")
  end subroutine test_search_ends

  !> The Scotch yoke has three vibrations at 1138.6 rpm, whichever of them the search starts from: each satisfies d'Alembert's
  !> principle, they differ, and of the three indices, whose sum is 1, the one in the middle is -1.
  subroutine test_all_vibrations(error)
    type(error_type), allocatable, intent(out) :: error
    type(accuracy_type), parameter :: accuracy = accuracy_type(tolerance=1.0e-11_dp)
    type(machine_data) :: machine
    type(frame_type) :: frame
    class(frame_type), allocatable :: system
    type(varied_frame_type), allocatable :: list(:), one(:)
    type(listed_vibration_type), allocatable :: several(:)
    type(gestell_error), allocatable :: failure
    integer :: i, k

    machine = scotch_yoke(1138.6_dp)
    call frame_of_machine(machine, frame, failure)
    if (.not. allocated(failure)) call settle(frame, "exact", accuracy, system, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    allocate(list(1))
    select type (system)
    class is (varied_frame_type)
      list(1) = system
    end select
    call search_vibrations(frame, accuracy, list)
    call check(error, size(list), 3, more="vibrations")
    if (allocated(error)) return
    do i = 1, size(list)
      call check_residual(machine, list(i), error)
      if (allocated(error)) return
      allocate(one(1))
      one(1) = list(i)
      call search_vibrations(frame, accuracy, one)
      call check(error, size(one), 3, more="vibrations, from another one")
      if (allocated(error)) return
      deallocate(one)
    end do
    call list_vibrations(list, accuracy, 64, 20, several, failure)
    call check_success(error, failure, "the list fails")
    if (allocated(error)) return
    do k = 1, size(several)
      call check(error, several(k)%vibration_index(), merge(-1, 1, k == 2), more="index")
      if (.not. allocated(error) .and. k > 1) call check_that(error, several(k)%rms(3), ">", 1.1_dp * several(k - 1)%rms(3), &
        & "the next")
      if (allocated(error)) return
    end do
    call check(error, index_sum(several), 1, more="sum of the indices")
  end subroutine test_all_vibrations

  !> The equations linearised about a vibration of an undamped machine are Hamilton's, so 1/rho is a multiplier if rho is.
  subroutine test_reciprocal(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(multipliers_type) :: exact
    real(dp) :: speed
    integer :: i

    do i = 1, 2
      ! Inside a tongue and outside of it.
      speed = merge(2426.0_dp, 700.0_dp, i == 1)
      machine = khang_machine(speed)
      machine%foundation_damping = 0
      call solve_multiplier(machine, "exact", exact, error)
      if (allocated(error)) return
      associate (pairs => exact%log_abs + exact%log_abs(6:1:-1))
        call check(error, maxval(abs(pairs)), 0.0_dp, thr=1.0e-9_dp, more="ln of a pair's product")
      end associate
      if (allocated(error)) return
    end do
    machine = khang_machine(2426.0_dp)
    machine%foundation_damping = 0
    call solve_multiplier(machine, "exact", exact, error)
    if (.not. allocated(error)) call check_that(error, exact%log_abs(1), ">", 0.01_dp, "a pair off the circle")
  end subroutine test_reciprocal

  !> prod rho = exp(-integral of tr(M^-1 B) over the turn), the integral by the trapezoidal rule, which has the order of the samples
  !> for periodic functions.
  subroutine test_liouville(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 1024
    class(frame_type), allocatable :: system
    type(multipliers_type) :: exact
    real(dp), dimension(points, 3, 3) :: m, b, c
    real(dp) :: here(3, 3, 2), solved(3, 3), integral
    integer :: i, k

    call solve(machine_on_supports(700.0_dp, 10.0_dp), "exact", system, error)
    if (.not. allocated(error)) call solve_multiplier(machine_on_supports(700.0_dp, 10.0_dp), "exact", exact, error)
    if (allocated(error)) return
    call system%sample_second_order([((k - 1) / real(points, dp), k = 1, points)], m, b, c)
    integral = 0
    do k = 1, points
      here(:, :, 1) = m(k, :, :)
      here(:, :, 2) = b(k, :, :)
      solved = solution(here(:, :, 1), here(:, :, 2))
      integral = integral + sum([(solved(i, i), i = 1, 3)]) * system%period / points
    end do
    call check(error, sum(exact%log_abs), -integral, thr=1.0e-9_dp, more="sum of ln |rho|")
  end subroutine test_liouville

  !> m^-1 b by Cramer's rule.
  pure function solution(m, b) result(x)
    real(dp), intent(in) :: m(3, 3), b(3, 3)
    real(dp) :: x(3, 3), replaced(3, 3)
    integer :: i, k

    do k = 1, 3
      do i = 1, 3
        replaced = m
        replaced(:, i) = b(:, k)
        x(i, k) = determinant(replaced) / determinant(m)
      end do
    end do
  end function solution

  pure real(dp) function determinant(a)
    real(dp), intent(in) :: a(3, 3)

    determinant = a(1, 1) * (a(2, 2) * a(3, 3) - a(2, 3) * a(3, 2)) - a(1, 2) * (a(2, 1) * a(3, 3) - a(2, 3) * a(3, 1)) &
      & + a(1, 3) * (a(2, 1) * a(3, 2) - a(2, 2) * a(3, 1))
  end function determinant

end module test_exact_paths
