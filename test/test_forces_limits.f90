!> Limits and symmetries of the forces on the ground.
module test_forces_limits
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_rows, only: accelerations, probe_type, quantity_type
  use gestell_study_vibration_analysis, only: analysis_type
  use gestell_task_forces_reactions, only: along_x, along_y, moment, reaction_type, force_magnitude
  use gestell_study_vibration_statistics, only: band_rms, statistics_type, compute_statistics
  use reference_cases, only: random_machine
  use reference_linear, only: qp
  use reference_linkage, only: mass_functions, mass_functions_type
  use reference_machine, only: khang_machine, machine_data
  use shaken_ground, only: make, near, solve => solve_places
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_forces_limits

contains

  subroutine collect_forces_limits(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("on ever stiffer mounts forces tend to the shaking force", test_rigid), &
      & new_unittest("a guide is the limit of an ever stiffer spring", test_guide), &
      & new_unittest("forces of a mirrored machine are mirrored", test_mirror), &
      & new_unittest("forces that cancel vanish within their error bounds", test_cancelled), &
      & new_unittest("the rms in a band is correct even if squares overflow", test_overflowing_squares), &
      & new_unittest("the averaged model averages the guides' forces too", test_averaged_guides)]
  end subroutine collect_forces_limits

  !> Equal supports turned by thirds of pi are isotropic: eta causes no force along x. The sum of their stiffnesses leaves only
  !> rounding errors, which must be within the bounds, and the bounds must not be much larger.
  subroutine test_cancelled(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: reactions(:)
    type(quantity_type) :: quantity
    type(statistics_type) :: statistics
    type(probe_type) :: none(0)
    type(gestell_error), allocatable :: failure
    integer, parameter :: x = 7, y = 8
    integer :: k

    machine = khang_machine(240.0_dp)
    machine%supports = machine%supports(:3)
    do k = 1, 3
      machine%supports(k)%angle_deg = 60 * k
      machine%supports(k)%stiffness = [3.0e5_dp, 1.0e5_dp]
    end do
    machine%free = [.false., .true., .false.]
    call make(machine, frame, error)
    if (allocated(error)) return
    call solve(frame, 64, 1.0e-12_dp, analysis, reactions, error)
    if (allocated(error)) return
    call find_quantity(frame, none, "fx", quantity, failure)
    call check_success(error, failure, "fx")
    if (allocated(error)) return
    call compute_statistics(analysis%vibration, quantity, statistics, failure)
    call check_success(error, failure, "statistics of fx")
    if (allocated(error)) return
    associate (peak => analysis%vibration%peak, bound => analysis%vibration%error)
      call check_that(error, peak(x), ">", 0.0_dp, "there are rounding errors to test")
      call near(error, [peak(x)], [0.0_dp], bound(x), "row")
      call near(error, [statistics%peak], [0.0_dp], statistics%error, "quantity")
      ! A few roundings of the whole stiffness.
      call near(error, [bound(x), statistics%error], [0.0_dp, 0.0_dp], 1.0e-14_dp * peak(y), "bounds")
    end associate
  end subroutine test_cancelled

  !> 3 cos(theta) along x and 4 cos(theta) along y, times 1e200: the root of the mean square of their size is 5/sqrt(2) of that.
  subroutine test_overflowing_squares(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: great = 1.0e200_dp
    type(statistics_type) :: statistics
    type(gestell_error), allocatable :: failure
    real(dp) :: along(2), maximum

    allocate(statistics%series(2))
    statistics%series(1)%amplitude = [3 * great]
    statistics%series(2)%amplitude = [4 * great]
    statistics%series(1)%phase = [0.0_dp]
    statistics%series(2)%phase = [0.0_dp]
    call band_rms(statistics, 1.0_dp, [0.5_dp, 1.5_dp], along, maximum, failure)
    call check_success(error, failure, "band")
    call near(error, [along, maximum], great / sqrt(2.0_dp) * [3, 4, 5], 1.0e-15_dp * 5 * great, "great amplitudes")
  end subroutine test_overflowing_squares

  !> On mounts s times as stiff the forces tend to those on a frame at rest, -Omega^2 (a_1'', a_2'') and the moment, as 1/s.
  subroutine test_rigid(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 128
    real(dp), parameter :: scales(3) = [1.0e2_dp, 1.0e4_dp, 1.0e6_dp]
    type(machine_data) :: machine
    type(mass_functions_type) :: a
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: reactions(:)
    real(dp) :: rigid(0:points - 1, 3), miss(3, 3), omega
    integer :: i, k

    do i = 1, size(scales)
      machine = khang_machine(240.0_dp)
      do k = 1, 4
        machine%supports(k)%stiffness = machine%supports(k)%stiffness * scales(i)
        ! So much damping that no order of the crank meets a resonance.
        machine%supports(k)%damping = 0.02_dp * sqrt(machine%supports(k)%stiffness * 19.35_dp / 4)
      end do
      call make(machine, frame, error)
      if (allocated(error)) return
      call solve(frame, points, 1.0e-10_dp, analysis, reactions, error)
      if (allocated(error)) return
      omega = frame%speed
      do k = 0, points - 1
        a = mass_functions(machine, 2 * real(pi, qp) * k / points)
        rigid(k, :) = real(-omega**2 * [a%a1(2), a%a2(2), &
          & machine%origin(1) * a%a2(2) - machine%origin(2) * a%a1(2) + a%a4], dp)
      end do
      associate (total => reactions(size(reactions))%history(:points, :))
        miss(:, i) = [maxval(abs(total(:, along_x) - rigid(:, 1))), maxval(abs(total(:, along_y) - rigid(:, 2))), &
          & maxval(abs(total(:, moment) - rigid(:, 3)))] / maxval(abs(rigid), dim=1)
      end associate
    end do
    do k = 1, 3
      ! At the first scale higher orders still count; from 1e4 on the first one in 1/s is all, to a few percent.
      call check_that(error, miss(k, 1), ">", 50 * miss(k, 2), "1e2 to 1e4")
      call check_that(error, miss(k, 1), "<", 200 * miss(k, 2), "1e2 to 1e4")
      if (allocated(error)) return
      call check(error, miss(k, 2) / miss(k, 3), 100.0_dp, thr=5.0_dp, more="1e4 to 1e6")
      if (allocated(error)) return
      call check_that(error, miss(k, 3), "<", 1.0e-6_dp, "limit")
      if (allocated(error)) return
    end do
  end subroutine test_rigid

  !> eta is held by a guide, or by a foundation's spring of growing stiffness. The difference falls as 1/stiffness.
  subroutine test_guide(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 128
    real(dp), parameter :: stiffness(2) = [1.0e9_dp, 1.0e11_dp]
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: guided(:), reactions(:)
    real(dp) :: miss(4, 2)
    integer :: i

    machine = khang_machine(240.0_dp)
    machine%foundation_damping = [200.0_dp, 0.0_dp, 10.0_dp]
    machine%free(2) = .false.
    call make(machine, frame, error)
    if (.not. allocated(error)) call solve(frame, points, 1.0e-11_dp, analysis, guided, error)
    if (allocated(error)) return
    machine%free(2) = .true.
    do i = 1, 2
      machine%foundation_stiffness(2, 2) = stiffness(i)
      machine%foundation_damping(2) = 0.05_dp * sqrt(stiffness(i) * 19.35_dp)
      call make(machine, frame, error)
      if (.not. allocated(error)) call solve(frame, points, 1.0e-11_dp, analysis, reactions, error)
      if (allocated(error)) return
      associate (total => reactions(size(reactions))%history, held => guided(size(guided))%history)
        miss(:3, i) = maxval(abs(total(:, [1, 2, 4]) - held(:, [1, 2, 4])), dim=1) / maxval(abs(held(:, [1, 2, 4])), dim=1)
        ! Along y the spring carries what the guide does, except for the supports' share, 4 * 196133 / stiffness.
        miss(4, i) = maxval(abs(reactions(5)%history(:, along_y) - guided(6)%history(:, along_y))) / maxval(abs(held(:, along_y)))
      end associate
    end do
    call check_that(error, maxval(miss(:3, 2)), "<", 1.0e-6_dp, "limit")
    call check_that(error, miss(4, 2), "<", 2.0e-5_dp, "limit")
    if (allocated(error)) return
    do i = 1, 4
      ! First order in 1/stiffness, to a few percent.
      call check(error, miss(i, 1) / miss(i, 2), 100.0_dp, thr=5.0_dp, more="rate")
      if (allocated(error)) return
    end do
  end subroutine test_guide

  !> y becomes -y, counter-clockwise clockwise: fx stays, fy and the moment change their signs.
  subroutine test_mirror(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 90
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: reactions(:), mirrored(:)
    integer :: i, number

    do number = 1, 4
      machine = random_machine(number, 1.0_dp, 20.0_dp)
      machine%free(1 + mod(number, 3)) = number == 1
      call make(machine, frame, error)
      if (.not. allocated(error)) call solve(frame, points, 1.0e-12_dp, analysis, reactions, error)
      if (allocated(error)) return
      machine = mirror(machine)
      call make(machine, frame, error)
      if (.not. allocated(error)) call solve(frame, points, 1.0e-12_dp, analysis, mirrored, error)
      if (allocated(error)) return
      do i = 1, size(reactions)
        associate (s => reactions(size(reactions))%statistics, this => reactions(i)%history, other => mirrored(i)%history)
          ! Both are good to 1e-12 times a condition of up to 100.
          call near(error, other(:, along_x), this(:, along_x), 1.0e-9_dp * s(force_magnitude)%peak, "x")
          call near(error, other(:, along_y), -this(:, along_y), 1.0e-9_dp * s(force_magnitude)%peak, "y")
          call near(error, other(:, moment), -this(:, moment), 1.0e-9_dp * s(moment)%peak, "moment")
          if (allocated(error)) return
        end associate
      end do
    end do
  end subroutine test_mirror

  !> A crank-rocker upside down.
  function mirror(machine) result(other)
    type(machine_data), intent(in) :: machine
    type(machine_data) :: other
    integer :: i

    other = machine
    other%speed_rpm = -machine%speed_rpm
    other%origin(2) = -machine%origin(2)
    do i = 1, size(other%joints)
      other%joints(i)%position(2) = -machine%joints(i)%position(2)
      other%joints(i)%phase_deg = -machine%joints(i)%phase_deg
      other%joints(i)%branch = -machine%joints(i)%branch
    end do
    do i = 1, size(other%links)
      other%links(i)%center(2) = -machine%links(i)%center(2)
    end do
    do i = 1, size(other%supports)
      other%supports(i)%position(2) = -machine%supports(i)%position(2)
      other%supports(i)%angle_deg = -machine%supports(i)%angle_deg
    end do
  end function mirror

  !> psi alone is free, its coefficients averaged: the force that the guide exerts to hold xi and eta is -Omega^2 a'' - <M>
  !> psi'' minus the mounting's share, with the mean of a1, a2 over the turn.
  subroutine test_averaged_guides(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 128
    type(machine_data) :: machine
    type(mass_functions_type) :: a(0:points - 1)
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(reaction_type), allocatable :: reactions(:)
    real(dp) :: mean(2), expected(points, 2)
    integer :: k

    machine = khang_machine(360.0_dp)
    machine%free = [.false., .false., .true.]
    call make(machine, frame, error)
    if (.not. allocated(error)) call solve(frame, points, 1.0e-12_dp, analysis, reactions, error, averaged=.true.)
    if (allocated(error)) return
    mean = 0
    do k = 0, points - 1
      a(k) = mass_functions(machine, 2 * real(pi, qp) * k / points)
      mean = mean + real([a(k)%a1(0), a(k)%a2(0)], dp) / points
    end do
    mean = mean + real(a(0)%mass, dp) * machine%origin
    associate (motion => analysis%vibration%motion_history)
      do k = 1, points
        expected(k, 1) = real(-frame%speed**2 * a(k - 1)%a1(2), dp) + mean(2) * motion(accelerations, k)
        expected(k, 2) = real(-frame%speed**2 * a(k - 1)%a2(2), dp) - mean(1) * motion(accelerations, k)
      end do
    end associate
    ! Roundings of forces of about 30 N.
    call near(error, reactions(size(reactions))%history(:points, along_x), expected(:, 1), 1.0e-11_dp, "x")
    call near(error, reactions(size(reactions))%history(:points, along_y), expected(:, 2), 1.0e-11_dp, "y")
  end subroutine test_averaged_guides

end module test_forces_limits
