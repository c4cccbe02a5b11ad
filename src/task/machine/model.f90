!> What the report says of the frame's model.
module gestell_task_machine_model
  use gestell_base_text, only: concise
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_task_stability_report, only: modulus_of
  use gestell_study_vibration_analysis, only: analysis_options
  use gestell_study_frame_model, only: newton_type
  implicit none (type, external)
  private

  public :: better_line, model_line, newton_line

  character, parameter :: newline = new_line("a")

contains

  !> The head's line.
  pure function model_line(options) result(line)
    type(analysis_options), intent(in) :: options
    character(len=:), allocatable :: line

    if (options%averaged) then
      line = "  model      averaged: M, B, C are their means over the turn, the load h(t) is full" // newline
    else if (options%model == "exact") then
      line = "  model      exact: any rotation of the frame; multipliers about its vibration" // newline
    else if (options%model == "first_order") then
      line = "  model      first order: vibration as about rest, multipliers about that vibration" // newline
    else
      line = "  model      about rest, the paper's equations; without &model frame: exact" // newline
    end if
  end function model_line

  !> How the exact vibration was found; nothing of the other models.
  pure function newton_line(newton) result(line)
    type(newton_type), intent(in) :: newton
    character(len=:), allocatable :: line
    integer :: k

    line = ""
    if (.not. allocated(newton%steps)) return
    line = "  vibration           by Newton's method, steps relative to it"
    do k = 1, size(newton%steps)
      line = line // trim(merge(",", " ", k > 1)) // " " // concise(newton%steps(k), 1)
    end do
    if (newton%followed) line = line // "; on a path from rest or from another speed, there may be others"
    line = line // newline
  end function newton_line

  !> What the multipliers about the vibration say, where those of a cheaper `model` miss it.
  pure function better_line(better, model) result(line)
    type(multipliers_type), intent(in), allocatable :: better
    character(len=*), intent(in) :: model
    character(len=:), allocatable :: line

    line = ""
    if (.not. allocated(better)) return
    line = "  BUT these are the equations " // trim(merge("about rest.    ", "to first order.", model == "rest")) &
      & // " About its vibration the machine is " // trim(better%verdict()) &
      & // ", |rho| = " // modulus_of(better, 1, 7) // ": order &model frame='exact'" // newline
  end function better_line

end module gestell_task_machine_model
