!> Bad arguments to every public procedure: an error that says what is wrong, before anything is computed; where the arguments make
!> sense but the mechanics does not, an answer or an error within bounded work.
module test_hostile
  use hostile_floquet, only: test_accuracies, test_faults, test_order_of_calls, test_systems, test_trajectories
  use hostile_machines, only: test_frames, test_linkages, test_orders, test_small, test_vibrations
  use hostile_studies, only: test_axes, test_borders, test_families, test_speeds, test_tiles
  use slow_tests, only: new_slow
  use testdrive, only: new_unittest, unittest_type
  use, intrinsic :: ieee_exceptions, only: ieee_set_halting_mode, ieee_usual
  implicit none (type, external)
  private

  public :: collect_hostile

contains

  subroutine collect_hostile(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    ! Numbers that are not finite are what this suite is about.
    call ieee_set_halting_mode(ieee_usual, .false.)
    testsuite = [ &
      & new_unittest("systems", test_systems), &
      & new_slow("faults within systems", test_faults), &
      & new_unittest("accuracies and methods", test_accuracies), &
      & new_unittest("results that are not there", test_order_of_calls), &
      & new_unittest("steps and shapes", test_trajectories), &
      & new_unittest("axes and grids", test_axes), &
      & new_unittest("tiles", test_tiles), &
      & new_unittest("families", test_families), &
      & new_unittest("borders", test_borders), &
      & new_unittest("speeds", test_speeds), &
      & new_unittest("linkages", test_linkages), &
      & new_unittest("frames", test_frames), &
      & new_unittest("tasks and names", test_orders), &
      & new_unittest("vibrations", test_vibrations), &
      & new_unittest("functions", test_small)]
  end subroutine collect_hostile

end module test_hostile
