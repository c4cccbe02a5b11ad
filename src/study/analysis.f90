!> One machine at one speed: what was asked for, and nothing else.
module gestell_study_analysis
  use gestell_base_error, only: error_type
  use gestell_floquet_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_model_frame, only: frame_type
  use gestell_study_vibration, only: solve_vibration, vibration_type
  implicit none (type, external)
  private

  public :: analyse

  !> What is asked for.
  type, public :: tasks_type
    !> Multipliers and verdict; the eigenvectors too; the periodic vibration.
    logical :: stability = .true., modes = .false., response = .true.
    !> Rows of the history over one period, harmonics wanted at least.
    integer :: points = 360, harmonics = 20
  end type tasks_type

  !> What was asked for; the rest stays unallocated.
  type, public :: analysis_type
    type(floquet_type) :: floquet
    type(multipliers_type), allocatable :: multipliers
    type(vibration_type), allocatable :: vibration
  end type analysis_type

contains

  !> Verdict and vibration of a frame. Errors: those of the parts; where the vibration fails, the multipliers are there.
  subroutine analyse(frame, tasks, accuracy, analysis, error)
    type(frame_type), intent(in) :: frame
    type(tasks_type), intent(in) :: tasks
    type(accuracy_type), intent(in) :: accuracy
    type(analysis_type), intent(out) :: analysis
    type(error_type), allocatable, intent(out) :: error

    call solve_floquet(frame, accuracy, tasks%response, analysis%floquet, error)
    if (allocated(error)) return
    if (tasks%stability .or. tasks%modes) then
      allocate(analysis%multipliers)
      call solve_multipliers(analysis%floquet, tasks%modes, analysis%multipliers, error)
      if (allocated(error)) return
    end if
    if (tasks%response) then
      allocate(analysis%vibration)
      call solve_vibration(frame, analysis%floquet, tasks%points, tasks%harmonics, analysis%vibration, error)
      if (allocated(error)) deallocate(analysis%vibration)
    end if
  end subroutine analyse

end module gestell_study_analysis
