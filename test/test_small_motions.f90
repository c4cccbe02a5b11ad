!> Small motions of the exact frame keep their digits: the equations of a frame whose mechanism has no masses are linear in the
!> motion but for terms of its square, over all decades. `test/cli/space.py` has vibrations.
module test_small_motions
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_series_trigonometric, only: series_through
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_mounting, only: support_type
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_model_space_masses, only: plane_type
  use space_machines, only: four_bar_plane, new_space_frame
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_small_motions

  real(dp), parameter :: speed = 31.0_dp, places(3, 2) = reshape([-0.3_dp, -0.2_dp, 0.7_dp, 0.4_dp, 0.1_dp, -0.5_dp], [3, 2]), &
    & springs(3) = [4.0e4_dp, 6.0e4_dp, 1.0e4_dp], dampers(3) = [40.0_dp, 60.0_dp, 10.0_dp], &
    & static(3) = [70.0_dp, -900.0_dp, 30.0_dp]

contains

  subroutine collect_small_motions(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [new_unittest("small exact motions in the plane keep their relative accuracy", &
      & test_plane), new_unittest("small exact motions in space keep their relative accuracy", test_space)]
  end subroutine collect_small_motions

  !> One support's axes stay in space, one's turn with the frame and carry a static force.
  subroutine test_plane(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(frame_type) :: frame
    type(plane_type) :: plane
    real(dp) :: none(3, 3)

    call massless(plane, failure)
    none = 0
    if (.not. allocated(failure)) call new_frame(frame, plane%linkage, 18.0_dp, 0.78_dp, [0.1_dp, 0.2_dp], none, none, speed, &
      & failure, supports=[support_type(places(:2, 1), springs(:2), dampers(:2), angle=0.4_dp), &
      & support_type(places(:2, 2), springs(:2), dampers(:2), turning=.true., static=static(:2))])
    call check_success(error, failure)
    if (.not. allocated(error)) call compare(frame, error)
  end subroutine test_plane

  subroutine test_space(error)
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    type(frame_type) :: frame
    type(plane_type) :: plane
    real(dp), parameter :: inertia(3, 3) = reshape([0.5_dp, 0.1_dp, 0.0_dp, 0.1_dp, 0.7_dp, 0.05_dp, 0.0_dp, 0.05_dp, 0.6_dp], &
      & [3, 3])
    integer :: i

    call massless(plane, failure)
    if (.not. allocated(failure)) call new_space_frame(frame, 18.0_dp, inertia, [plane], [support_type(places(:, 1), &
      & springs, dampers), support_type(places(:, 2), springs, dampers, turning=.true.)], speed, [(i, i = 1, 6)], failure)
    call check_success(error, failure)
    if (allocated(error)) return
    frame%supports(2)%static = static
    call compare(frame, error)
  end subroutine test_space

  subroutine massless(plane, failure)
    type(plane_type), intent(out) :: plane
    type(gestell_error), allocatable, intent(out) :: failure

    call four_bar_plane(plane, failure)
    if (allocated(failure)) return
    plane%linkage%links%mass = 0
    plane%linkage%links%inertia = 0
    plane%linkage%links%along = 0
    plane%linkage%links%across = 0
  end subroutine massless

  !> The left-hand sides for a motion are r(q) = M q'' + B q' + C q + O(q^2), M, B, C at rest. Half of r(q) - r(-q) is the same
  !> except for terms of third order; half of the sum contains the terms of second and fourth order.
  subroutine compare(frame, error)
    type(frame_type), intent(in) :: frame
    type(error_type), allocatable, intent(inout) :: error
    !> Terms of second order are some times those of first order times the motion; and so on. Rounding of the terms of first
    !> order.
    real(dp), parameter :: next = 30, roundings = 1.0e-14_dp, phases(4) = [0.0_dp, 0.27_dp, 0.54_dp, 0.81_dp]
    integer, parameter :: samples = 16
    real(dp), dimension(size(phases), frame%dofs()) :: odd, even, first_even, linear, opposite
    real(dp) :: motion(samples, frame%dofs()), part, first_part
    character(len=8) :: decade
    integer :: i, k, decades

    do k = 1, frame%dofs()
      motion(:, k) = [(cos(2 * pi * i / samples + k) + 0.3_dp * sin(4 * pi * i / samples - k), i = 1, samples)]
    end do
    do decades = 3, 14
      part = 10.0_dp**(-decades)
      write (decade, "('1e-', i0)") decades
      call find_left(frame, part * motion, phases, odd, linear)
      call find_left(frame, -part * motion, phases, opposite)
      even = (odd + opposite) / 2
      odd = (odd - opposite) / 2
      call check_that(error, maxval(abs(odd - linear)) / maxval(abs(linear)), "<=", next * part**2 + roundings, &
        & "terms of first order of a motion of " // trim(decade))
      if (decades == 3) then
        first_part = part
        first_even = even
      else if (decades <= 8) then
        call check_that(error, maxval(abs(even * (first_part / part)**2 - first_even)) / maxval(abs(first_even)), "<=", &
          & next * (first_part**2 + roundings / part), "terms of second order of a motion of " // trim(decade))
      end if
      if (allocated(error)) return
    end do
  end subroutine compare

  !> The left-hand sides along a motion at some phases, for the equations about rest too.
  subroutine find_left(frame, motion, phases, left, linear)
    type(frame_type), intent(in) :: frame
    real(dp), intent(in) :: motion(:, :)
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: left(:, :)
    real(dp), intent(out), optional :: linear(:, :)
    type(varied_frame_type) :: varied
    real(dp), dimension(size(phases), frame%dofs(), frame%dofs()) :: m, b, c
    real(dp), dimension(size(phases), frame%dofs()) :: q, v, a
    integer :: k

    varied = varied_frame(frame, series_through(motion))
    varied%lacking = .true.
    call varied%sample_second_order(phases, m, b, c, left)
    left = -left
    if (.not. present(linear)) return
    call varied%motion%values(phases, q, v, a)
    call varied%linearise_about(series_through(0 * motion))
    call varied%sample_second_order(phases, m, b, c)
    linear = 0
    do k = 1, frame%dofs()
      linear = linear + m(:, :, k) * spread(a(:, k) * speed**2, 2, frame%dofs()) &
        & + b(:, :, k) * spread(v(:, k) * speed, 2, frame%dofs()) + c(:, :, k) * spread(q(:, k), 2, frame%dofs())
    end do
  end subroutine find_left

end module test_small_motions
