!> Invalid arguments to every public procedure cause an error that says what is wrong, before anything is computed. Arguments
!> that are valid but mechanically absurd cause an answer or an error within bounded work.
module test_invalid_arguments
  use invalid_floquet_arguments, only: test_accuracies, test_faults, test_order_of_calls, test_systems, test_trajectories
  use invalid_machine_arguments, only: test_frames, test_linkages, test_tasks_and_names, test_empty_input, test_vibrations
  use invalid_study_arguments, only: test_axes, test_borders, test_families, test_speeds, test_tiles
  use slow_tests, only: new_slow
  use testdrive, only: new_unittest, unittest_type
  use, intrinsic :: ieee_exceptions, only: ieee_set_halting_mode, ieee_usual
  implicit none (type, external)
  private

  public :: collect_invalid_arguments

contains

  subroutine collect_invalid_arguments(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    ! This suite passes NaN and infinity on purpose.
    call ieee_set_halting_mode(ieee_usual, .false.)
    testsuite = [ &
      & new_unittest("invalid systems are refused before anything is computed", test_systems), &
      & new_slow("mechanically absurd systems end in bounded work", test_faults), &
      & new_unittest("invalid accuracies and unknown methods are refused", test_accuracies), &
      & new_unittest("using results that were never computed is an error", test_order_of_calls), &
      & new_unittest("trajectories expect invalid step numbers and array shapes", test_trajectories), &
      & new_unittest("invalid axes and grids are refused", test_axes), &
      & new_unittest("invalid tiles of a grid are refused", test_tiles), &
      & new_unittest("invalid families of systems end every study with an error", test_families), &
      & new_unittest("boundary searches expect invalid arguments", test_borders), &
      & new_unittest("studies over the speed expect invalid arguments", test_speeds), &
      & new_unittest("invalid links and joints are refused", test_linkages), &
      & new_unittest("invalid frames and mass functions are refused", test_frames), &
      & new_unittest("unknown tasks, unknown names and damaged frames are refused", test_tasks_and_names), &
      & new_unittest("quantities that a vibration does not contain are refused", test_vibrations), &
      & new_unittest("functions without error argument return defined values for empty input", test_empty_input)]
  end subroutine collect_invalid_arguments

end module test_invalid_arguments
