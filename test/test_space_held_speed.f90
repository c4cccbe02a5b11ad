!> Who holds the speed of a frame in space: against the plane, and derivatives against differences. `test/cli/space.py` has the
!> numbers of d'Alembert's principle (validation/space/holders.py) and the balance of power.
module test_space_held_speed
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_series_trigonometric, only: series_through, series_type
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mounting, only: support_type
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_model_mechanism_held, only: holders
  use gestell_model_space_drive, only: drive_type
  use gestell_model_space_masses, only: plane_type
  use gestell_model_space_variation, only: sample_varied
  use gestell_system_second_order, only: second_order_system
  use space_machines, only: four_bar_plane, new_space_frame, v_twin
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_space_held_speed

contains

  subroutine collect_space_held_speed(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("with a held speed space and plane equations agree", test_plane), &
      & new_unittest("derivatives in space with an outside drive agree with differences", test_derivatives)]
  end subroutine collect_space_held_speed

  !> The plane's own frame in space.
  subroutine test_plane(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: speed = -31.0_dp, origin(2) = [0.1_dp, -0.25_dp]
    type(gestell_error), allocatable :: failure
    type(plane_type) :: plane
    type(support_type) :: support
    type(frame_type) :: space, flat
    type(varied_frame_type) :: flat_varied, space_varied
    type(series_type) :: motion, motion_6
    real(dp) :: none(3, 3), inertia(3, 3), samples(16, 6)
    integer :: i, k

    call four_bar_plane(plane, failure)
    plane%origin = [origin, 0.2_dp]
    support%position = [-0.3_dp, 0.2_dp, 0.7_dp]
    support%stiffness = [4.0e4_dp, 6.0e4_dp, 1.0e4_dp]
    support%damping = [40.0_dp, 60.0_dp, 10.0_dp]
    inertia = reshape([0.5_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.5_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.78_dp], [3, 3])
    none = 0
    samples = 0
    do k = 1, 16
      samples(k, 1) = 0.01_dp * cos(pi * k / 8) + 0.002_dp
      samples(k, 2) = 0.02_dp * sin(pi * k / 4)
      samples(k, 3) = 0.3_dp * cos(pi * k / 8 - 1) - 0.1_dp * sin(pi * k / 4)
    end do
    motion = series_through(samples(:, :3))
    motion_6 = series_through(samples)
    do i = 1, size(holders)
      if (.not. allocated(failure)) call new_space_frame(space, 18.0_dp, inertia, [plane], [support], speed, [1, 2, 3], &
        & failure)
      if (.not. allocated(failure)) call new_frame(flat, plane%linkage, 18.0_dp, 0.78_dp, origin, none, none, speed, failure, &
        & supports=[support_type(support%position(:2), support%stiffness(:2), support%damping(:2))], held_by=trim(holders(i)))
      call check_success(error, failure)
      if (allocated(error)) return
      space%held_by = holders(i)
      ! a flywheel's gyroscopic moment vanishes in the plane
      space%space%drive = drive_type(holders(i), flywheel_inertia=merge(0.4_dp, 0.0_dp, holders(i) == "flywheel"))
      call compare(trim(holders(i)) // ", rest", flat, space)
      if (allocated(error)) return
      flat_varied = varied_frame(flat, motion)
      space_varied = varied_frame(space, motion_6)
      call compare(trim(holders(i)) // ", exact", flat_varied, space_varied)
      if (allocated(error)) return
    end do

  contains

    !> Compares to the rounding of the largest values; the drive's contribution adds more of it.
    subroutine compare(what, one, other)
      character(len=*), intent(in) :: what
      class(second_order_system), intent(in) :: one, other
      real(dp), dimension(5, 3, 3) :: m, b, c, m_other, b_other, c_other
      real(dp) :: h(5, 3), h_other(5, 3), rounding
      real(dp), parameter :: phases(5) = [0.0_dp, 0.21_dp, 0.42_dp, 0.63_dp, 0.84_dp]

      call one%sample_second_order(phases, m, b, c, h)
      call other%sample_second_order(phases, m_other, b_other, c_other, h_other)
      call check_that(error, maxval(abs(m_other - m)), "<=", 1.0e-13_dp * maxval(abs(m)), what // ": M")
      rounding = merge(1.0e-13_dp, 1.0e-12_dp, holders(i) == "motor")
      call check_that(error, maxval(abs(b_other - b)), "<=", rounding * maxval(abs(b)), what // ": B")
      call check_that(error, maxval(abs(c_other - c)), "<=", rounding * maxval(abs(c)), what // ": C")
      call check_that(error, maxval(abs(h_other - h)), "<=", 1.0e-12_dp * maxval(abs(h)), what // ": h")
    end subroutine compare

  end subroutine test_plane

  !> Central differences of steps h and h/2, extrapolated: h^4 and rounding over h leave an error of 1e-9 of the maximum. The
  !> shaft is inclined to all axes.
  subroutine test_derivatives(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: step = 1.0e-3_dp, angle(1) = [0.7_dp], lag(1, 3) = 0
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp) :: q(6, 0:2), r(1, 6), m(1, 6, 6), b(1, 6, 6), c(1, 6, 6), found(6, 2), scale(0:2), exact(6, 6, 0:2)
    integer :: i, k, n

    call v_twin(70.0_dp, frame, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    frame%space%drive = drive_type("outside", [2.0_dp, -1.0_dp, 2.0_dp] / 3)
    q(:, 0) = [0.02_dp, -0.01_dp, 0.4_dp, 0.5_dp, 0.03_dp, -0.3_dp]
    q(:, 1) = [0.5_dp, 0.3_dp, 3.0_dp, -4.0_dp, -0.4_dp, 5.0_dp]
    q(:, 2) = [-9.0_dp, 20.0_dp, 90.0_dp, 50.0_dp, 10.0_dp, -60.0_dp]
    scale = [1.0_dp, 10.0_dp, 100.0_dp]
    call sample(q)
    exact(:, :, 0) = c(1, :, :)
    exact(:, :, 1) = b(1, :, :)
    exact(:, :, 2) = m(1, :, :)
    do k = 0, 2
      do i = 1, 6
        do n = 1, 2
          found(:, n) = (left(i, k, scale(k) * step / n) - left(i, k, -scale(k) * step / n)) / (2 * scale(k) * step / n)
        end do
        found(:, 1) = found(:, 2) + (found(:, 2) - found(:, 1)) / 3
        call check_that(error, maxval(abs(found(:, 1) - exact(:, i, k))), "<=", 1.0e-9_dp * maxval(abs(exact(:, :, k))), &
          & "derivative by q")
        if (allocated(error)) return
      end do
    end do

  contains

    subroutine sample(at)
      real(dp), intent(in) :: at(6, 0:2)

      call sample_varied(frame, frame%space, angle, reshape(at(:, 0), [1, 6]), reshape(at(:, 1), [1, 6]), &
        & reshape(at(:, 2), [1, 6]), lag, r, m, b, c)
    end subroutine sample

    function left(i, k, change)
      integer, intent(in) :: i, k
      real(dp), intent(in) :: change
      real(dp) :: left(6), there(6, 0:2)

      there = q
      there(i, k) = there(i, k) + change
      call sample(there)
      left = r(1, :)
    end function left

  end subroutine test_derivatives

end module test_space_held_speed
