!> The frame's model: which equations stand for a machine.
!>
!> | model       | vibration                        | its stability: multipliers of the equations varied  |
!> |-------------|----------------------------------|-----------------------------------------------------|
!> | exact       | of the exact equations           | about that vibration                                |
!> | first_order | of the equations about rest, (8) | exactly, about that vibration                       |
!> | rest        | of the equations about rest, (8) | about rest: Nguyen van Khang's                      |
!>
!> Each is a linear periodic system whose periodic motion is the vibration, so all that is known of such systems serves all models.
!> The exact vibration comes from Newton's method (gestell_study_frame_model_newton), from the linear vibration or, where that is
!> too far away, on a path from rest or from another speed (gestell_study_frame_model_vibration_path).
module gestell_study_frame_model
  use gestell_base_error, only: error_type, fatal_error, invalid_input, no_convergence, resonance
  use gestell_base_kinds, only: dp
  use gestell_math_series_trigonometric, only: series_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_study_frame_model_vibration_path, only: follow_damping, follow_excitation, follow_speed
  use gestell_study_frame_model_newton, only: iterate, rough
  use gestell_system_averaged, only: averaged_system
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: settle, settle_member

  character(len=11), parameter, public :: frame_models(3) = [character(len=11) :: "exact", "first_order", "rest"]

  !> How the exact vibration was found.
  type, public :: newton_type
    !> Newton's steps |q_k+1 - q_k|/|q_k+1|, the first from the linear vibration; the last is what is left of the error.
    real(dp), allocatable :: steps(:)
    !> Whether it was found on a path from rest or from another speed.
    logical :: followed = .false.
    !> Other vibrations that were met on the way.
    type(varied_frame_type), allocatable :: others(:)
  end type newton_type

  !> A first step of Newton's method beyond this tells that the vibration is far enough from the linear one to be one of several.
  real(dp), parameter :: notably_nonlinear = 0.02_dp
  !> A first step from the motion of a frame that differs little is shorter than this part of the motion.
  real(dp), parameter :: beside = 0.3_dp

contains

  !> `frame` by `model`, one of `frame_models`. Errors: there is no such model; as of `solve_floquet` and `solve_periodic`; Newton's
  !> method finds no vibration.
  recursive subroutine settle(frame, model, accuracy, settled, error, newton, near)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: model
    type(accuracy_type), intent(in) :: accuracy
    class(frame_type), allocatable, intent(out) :: settled
    type(error_type), allocatable, intent(out) :: error
    type(newton_type), intent(out), optional :: newton
    !> A motion beside that of the exact frame, where Newton's method begins; the usual ways are taken if that leads far away, for
    !> it may be to another vibration.
    type(series_type), intent(in), optional :: near
    type(varied_frame_type), allocatable :: varied
    type(series_type) :: rest
    real(dp), allocatable :: steps(:)

    select case (model)
    case ("rest")
      allocate(settled, source=frame)
    case ("first_order", "exact")
      allocate(rest%cosine(0:1, frame%dofs()), rest%sine(0:1, frame%dofs()), source=0.0_dp)
      allocate(varied)
      varied = varied_frame(frame, rest)
      ! What forces do that cancel to their rounding is small, and the same of all models.
      varied%newton = model == "exact" .and. frame%load_rounding < 0.5_dp
      if (varied%newton .and. present(near)) then
        call varied%move_to(near)
        call iterate(frame, accuracy, .false., varied, steps, error)
        if (.not. allocated(error) .and. maxval([0.0_dp, steps]) < beside) then
          call move_alloc(varied, settled)
          return
        end if
        if (allocated(error)) deallocate(error)
        call settle(frame, model, accuracy, settled, error, newton)
        return
      end if
      if (varied%newton) then
        call find_vibration(frame, accuracy, varied, error, newton)
      else
        call iterate(frame, accuracy, .true., varied, steps, error)
      end if
      if (.not. allocated(error)) call move_alloc(varied, settled)
    case default
      call fatal_error(error, "there is no model '" // model // "' of the frame", invalid_input)
    end select
  end subroutine settle

  !> The same of a family's member, in its place, or with model 'averaged' the frame with M, B, C averaged over the turn; what is no
  !> frame stays as it is.
  subroutine settle_member(system, model, accuracy, error)
    class(periodic_system), allocatable, intent(inout) :: system
    character(len=*), intent(in) :: model
    type(accuracy_type), intent(in) :: accuracy
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), allocatable :: settled
    type(averaged_system), allocatable :: means

    if (model == "rest") return
    select type (system)
    class is (frame_type)
      if (model == "averaged") then
        allocate(means)
        call system%averaged(means)
      else
        call settle(system, model, accuracy, settled, error)
      end if
    end select
    if (allocated(settled)) call move_alloc(settled, system)
    if (allocated(means)) call move_alloc(means, system)
  end subroutine settle_member

  !> Newton's method from `varied`, the frame about rest; where that fails, on a path. Between two turning points of the vibrations
  !> over the speed lies one that no machine keeps to: another one, if a path leads to it, is preferred.
  subroutine find_vibration(frame, accuracy, varied, error, newton)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(varied_frame_type), intent(inout) :: varied
    type(error_type), allocatable, intent(out) :: error
    type(newton_type), intent(out), optional :: newton
    type(varied_frame_type) :: found, other
    type(varied_frame_type), allocatable :: between(:)
    type(error_type), allocatable :: none
    real(dp), allocatable :: steps(:), other_steps(:)
    logical :: followed, stays

    found = varied
    call iterate(frame, accuracy, .false., found, steps, error)
    ! Another way may lead to a vibration where the linear one is none, or too large a start.
    followed = .false.
    if (allocated(error)) followed = any(error%cause == [resonance, no_convergence])
    if (allocated(error) .and. .not. followed) return
    if (followed) then
      found = varied
      call follow_excitation(frame, accuracy, found, steps, error)
      if (allocated(error)) call follow_speed(frame, accuracy, found, steps, error)
      if (allocated(error)) call follow_damping(frame, accuracy, found, steps, error)
      if (allocated(error)) return
    else
      stays = .not. steps(1) > notably_nonlinear
      if (.not. stays) stays = .not. between_turns(found)
      if (.not. stays) then
        other = varied
        call follow_speed(frame, accuracy, other, other_steps, none)
        if (.not. allocated(none)) followed = .not. between_turns(other)
      end if
      if (followed) then
        allocate(between(1))
        between(1) = found
        found = other
        call move_alloc(other_steps, steps)
      end if
    end if
    varied = found
    if (.not. present(newton)) return
    newton%followed = followed
    call move_alloc(steps, newton%steps)
    if (allocated(between)) call move_alloc(between, newton%others)
  end subroutine find_vibration

  !> Whether a multiplier says that the vibration lies between two turning points: it is real and greater than 1.
  logical function between_turns(varied)
    type(varied_frame_type), intent(in) :: varied
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(error_type), allocatable :: error

    call solve_floquet(varied, accuracy_type(tolerance=rough), .false., floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
    between_turns = .false.
    if (.not. allocated(error)) between_turns = any(real(multipliers%rho) > 1 + multipliers%error .and. &
      & .not. abs(aimag(multipliers%rho)) > 0)
  end function between_turns

end module gestell_study_frame_model
