!> Distances of modes from the orders of the crank, and the energy in each mode, against hand calculation.
module test_separation
  use checks, only: check_that
  use gestell_base_kinds, only: dp, pi
  use gestell_study_mode, only: mode_type
  use gestell_task_campbell, only: campbell_point_type, campbell_type
  use gestell_task_campbell_crossings, only: crossing_type
  use gestell_task_separation, only: find_separations, separation_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  implicit none (type, external)
  private

  public :: collect_separation

contains

  subroutine collect_separation(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("distances at one speed and their verdicts agree with hand calculation", test_states), &
      & new_unittest("over a range the smallest distance counts, zero if it contains a resonance", test_range), &
      & new_unittest("kinetic energy shares of coupled masses agree with hand calculation", test_energy), &
      & new_unittest("a mode that cannot be determined leaves the verdict undecided", test_unknown_mode)]
  end subroutine collect_separation

  !> A mode of this frequency and bound on its error (Hz).
  type(mode_type) function mode_of(frequency, error) result(mode)
    real(dp), intent(in) :: frequency, error

    mode%identified = .true.
    mode%growth = -1
    mode%error = 2 * pi * error
    mode%components = 1
    mode%frequencies(1) = 2 * pi * frequency
    mode%shares(1) = 1
    mode%shapes(1, 1) = 1
  end function mode_of

  !> One mode of a frame that moves along eta, at these speeds (1/min).
  subroutine make_diagram(speeds, modes, campbell)
    real(dp), intent(in) :: speeds(:)
    type(mode_type), intent(in) :: modes(:)
    type(campbell_type), intent(out) :: campbell
    integer :: i

    campbell%modes = 1
    campbell%free = [2]
    allocate(campbell%points(size(speeds)))
    do i = 1, size(speeds)
      campbell%points(i) = campbell_point_type(speed=speeds(i), solved=.true.)
      campbell%points(i)%modes(1) = modes(i)
      campbell%points(i)%mass(1, 1) = 3
    end do
  end subroutine make_diagram

  !> 300 1/min are 5 Hz, the orders 5, 10, 15 Hz. From 12.5 Hz they lie 150 %, 25 % and 16.7 % away.
  subroutine test_states(error)
    type(error_type), allocatable, intent(out) :: error
    type(campbell_type) :: campbell
    type(crossing_type) :: none(0)
    type(separation_type) :: found(3)

    call make_diagram([-300.0_dp], [mode_of(12.5_dp, 0.1_dp)], campbell)
    found = find_separations(campbell, none, [1, 2, 3], 1, 0.2_dp)
    call check(error, all(found%harmonic == [1, 2, 3]) .and. all(found%mode == 1), "a row for every order")
    if (allocated(error)) return
    call check_that(error, maxval(abs(found%distance - [1.5_dp, 0.25_dp, 1 / 6.0_dp])), "<", 1.0e-15_dp * 10, "distances")
    call check_that(error, maxval(abs(found%error - 0.1_dp / [5, 10, 15])), "<", 1.0e-15_dp * 10, "their errors")
    if (allocated(error)) return
    call check(error, all(found%state == [character(len=9) :: "pass", "pass", "fail"]), "20 %")
    if (allocated(error)) return
    ! 24.5 % and 25.5 %: the error of 1 % covers both sides of the limit.
    found = find_separations(campbell, none, [1, 2, 3], 1, 0.245_dp)
    call check(error, found(2)%state, "undecided")
    if (allocated(error)) return
    found = find_separations(campbell, none, [1, 2, 3], 1, 0.255_dp)
    call check(error, found(2)%state, "undecided")
    if (allocated(error)) return
    found = find_separations(campbell, none, [1, 2, 3], 1, 0.27_dp)
    call check(error, found(2)%state, "fail")
    if (allocated(error)) return
    call check(error, all(abs(found%energy(2) - 1) <= 0) .and. all(abs(found%energy(1)) + abs(found%energy(3)) <= 0), &
      & "all of the energy is along eta")
  end subroutine test_states

  !> From 240 to 360 1/min a mode of 9 Hz meets order 2 at 270 1/min; order 1 is nearest at 360 (9/6 - 1), order 3 at 240 (1 -
  !> 9/12).
  subroutine test_range(error)
    type(error_type), allocatable, intent(out) :: error
    type(campbell_type) :: campbell
    type(crossing_type) :: crossings(2)
    type(separation_type) :: found(3)

    call make_diagram([240.0_dp, 300.0_dp, 360.0_dp], [mode_of(9.0_dp, 0.0_dp), mode_of(9.0_dp, 0.0_dp), mode_of(9.0_dp, 0.0_dp)], &
      & campbell)
    ! Half orders are not requested.
    crossings(1) = crossing_type(mode=1, order=1.5_dp, speed=360.0_dp, at=mode_of(9.0_dp, 0.0_dp))
    crossings(2) = crossing_type(mode=1, order=2.0_dp, speed=270.0_dp, at=mode_of(9.0_dp, 0.0_dp))
    found = find_separations(campbell, crossings, [1, 2, 3], 1, 0.2_dp)
    call check_that(error, maxval(abs(found%distance - [0.5_dp, 0.0_dp, 0.25_dp])), "<", 1.0e-15_dp * 10, "distances")
    call check_that(error, maxval(abs(found%speed - [360, 270, 240])), "<", 1.0e-12_dp, "where")
    call check_that(error, maxval(abs(found%excitation - [6, 9, 12])), "<", 1.0e-12_dp, "frequencies of the orders")
    if (allocated(error)) return
    call check(error, all(found%state == [character(len=9) :: "pass", "fail", "pass"]), "states")
  end subroutine test_range

  !> M = (4 1; 1 2), q = (1, -2)/sqrt(8): q (M q) = 1 (4 - 2), -2 (1 - 4), of 8 in all. A common phase changes nothing.
  subroutine test_energy(error)
    type(error_type), allocatable, intent(out) :: error
    type(campbell_type) :: campbell
    type(crossing_type) :: none(0)
    type(separation_type) :: found(1)
    type(mode_type) :: mode

    mode = mode_of(12.5_dp, 0.0_dp)
    mode%shapes(:2, 1) = cmplx(0.6_dp, 0.8_dp, dp) * [1, -2] / sqrt(8.0_dp)
    call make_diagram([300.0_dp], [mode], campbell)
    campbell%free = [1, 3]
    campbell%points(1)%mass(:2, :2) = reshape([4.0_dp, 1.0_dp, 1.0_dp, 2.0_dp], [2, 2])
    found = find_separations(campbell, none, [1], 1, 0.2_dp)
    call check_that(error, maxval(abs(found(1)%energy(:3) - [0.25_dp, 0.0_dp, 0.75_dp])), "<", 1.0e-15_dp * 10, "xi, eta, psi")
    if (allocated(error)) return
    ! A quarter of a period apart they do not interact: 4 |q_1|^2 and 2 |q_2|^2.
    campbell%points(1)%modes(1)%shapes(:2, 1) = [(1.0_dp, 0.0_dp), (0.0_dp, 1.0_dp)] / sqrt(6.0_dp)
    found = find_separations(campbell, none, [1], 1, 0.2_dp)
    call check_that(error, maxval(abs(found(1)%energy(:3) - [2 / 3.0_dp, 0.0_dp, 1 / 3.0_dp])), "<", 1.0e-15_dp * 10, "apart")
  end subroutine test_energy

  !> The mode is determined at the second speed only; then at none.
  subroutine test_unknown_mode(error)
    type(error_type), allocatable, intent(out) :: error
    type(campbell_type) :: campbell
    type(crossing_type) :: none(0)
    type(separation_type) :: found(1)
    type(mode_type) :: lost

    call make_diagram([240.0_dp, 300.0_dp], [lost, mode_of(6.0_dp, 0.0_dp)], campbell)
    found = find_separations(campbell, none, [1], 1, 0.1_dp)
    call check_that(error, abs(found(1)%distance - 0.2_dp), "<", 1.0e-15_dp * 10, "determined at one speed only")
    if (allocated(error)) return
    call check(error, found(1)%state, "pass")
    if (allocated(error)) return
    call make_diagram([240.0_dp, 300.0_dp], [lost, lost], campbell)
    found = find_separations(campbell, none, [1], 1, 0.1_dp)
    call check(error, ieee_is_nan(found(1)%distance) .and. all(ieee_is_nan(found(1)%energy)), "no numbers")
    if (.not. allocated(error)) call check(error, found(1)%state, "undecided")
  end subroutine test_unknown_mode

end module test_separation
