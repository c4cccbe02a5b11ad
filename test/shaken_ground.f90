!> Helpers for the tests of forces, probes and drive: frames of machines, their reactions, comparisons with a message.
module shaken_ground
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity_rows, only: guide_forces
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_task_forces_reactions, only: find_reactions, reaction_type
  use machines, only: frame_of_machine
  use reference_machine, only: machine_data
  use testdrive, only: error_type
  implicit none (type, external)
  private

  public :: make, near, solve_places

contains

  !> Places of a frame's vibration, the history at `points` + 1 times.
  subroutine solve_places(frame, points, tolerance, analysis, reactions, error, averaged)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: points
    real(dp), intent(in) :: tolerance
    type(analysis_type), intent(out) :: analysis
    type(reaction_type), allocatable, intent(out) :: reactions(:)
    type(error_type), allocatable, intent(out) :: error
    logical, intent(in), optional :: averaged
    type(gestell_error), allocatable :: failure
    type(analysis_options) :: options

    options = analysis_options(model="rest", points=points, rows=guide_forces)
    if (present(averaged)) options%averaged = averaged
    call analyse(frame, options, accuracy_type(tolerance=tolerance), analysis, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call find_reactions(frame, analysis%vibration, reactions, failure)
    call check_success(error, failure)
  end subroutine solve_places

  !> The frame of a machine; fails the test if the machine is invalid.
  subroutine make(machine, frame, error)
    type(machine_data), intent(in) :: machine
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure

    call frame_of_machine(machine, frame, failure)
    call check_success(error, failure)
  end subroutine make

  subroutine near(error, came, expected, tolerance, what)
    type(error_type), allocatable, intent(inout) :: error
    real(dp), intent(in) :: came(:), expected(:), tolerance
    character(len=*), intent(in) :: what
    character(len=120) :: numbers

    if (allocated(error)) return
    write (numbers, "(3(a, es12.4))") ": off by ", maxval(abs(came - expected)), ", allowed ", tolerance, ", size ", &
      & maxval(abs(expected))
    call check_that(error, maxval(abs(came - expected)), "<=", tolerance, what // trim(numbers))
  end subroutine near

end module shaken_ground
