!> Applies one of three models to a frame. A model defines the equations that describe the frame's vibration and stability. The
!> linear equations are those of the frame linearised about rest (doc/theory.md, equation 8).
!>
!> | model       | the vibration satisfies | multipliers belong to the equations linearised about |
!> |-------------|-------------------------|------------------------------------------------------|
!> | exact       | the exact equations     | the vibration                                        |
!> | first_order | the linear equations    | the vibration, from the exact equations              |
!> | rest        | the linear equations    | rest, the method of Nguyen van Khang                 |
!>
!> Each model is a linear periodic system whose periodic motion is the vibration, so one solver of such systems serves all models.
!> Newton's method computes the exact vibration (gestell_study_frame_model_newton), starting from the vibration of the linear
!> equations. If that start is too far away, the vibration is followed from rest, from another speed or from more damping
!> (gestell_study_frame_model_vibration_path).
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

  !> How the vibration of the exact frame was found.
  type, public :: newton_type
    !> Relative steps of Newton's method, |q_k+1 - q_k|/|q_k+1|; the first step starts from the linear vibration. The last step
    !> estimates the remaining error
    real(dp), allocatable :: steps(:)
    !> True if the vibration was found by continuation: by following vibrations while the excitation, the speed or the damping
    !> varies
    logical :: followed = .false.
    !> Other vibrations of the same frame that were found during the search
    type(varied_frame_type), allocatable :: others(:)
  end type newton_type

  !> If the first relative step of Newton's method is larger than this, the exact vibration differs much from the linear one and may
  !> be one of several.
  real(dp), parameter :: notably_nonlinear = 0.02_dp
  !> A motion that is given as a start is rejected if a step of Newton's method reaches this fraction of the motion.
  real(dp), parameter :: near_step = 0.3_dp

contains

  !> Applies `model`, one of `frame_models`, to `frame`: computes the vibration about which the equations are linearised (the model
  !> 'rest' needs no vibration). Fails if the model does not exist, if `solve_floquet` or `solve_periodic` fails, or if no vibration
  !> is found.
  recursive subroutine settle(frame, model, accuracy, settled, error, newton, near)
    !> The frame, before the model is applied
    class(frame_type), intent(in) :: frame
    !> Name of the model: one of `frame_models`
    character(len=*), intent(in) :: model
    type(accuracy_type), intent(in) :: accuracy
    !> The frame with the equations of the model: for 'exact' and 'first_order' a `varied_frame_type`, otherwise a copy of `frame`
    class(frame_type), allocatable, intent(out) :: settled
    type(error_type), allocatable, intent(out) :: error
    !> How the vibration of the exact frame was found
    type(newton_type), intent(out), optional :: newton
    !> Start of Newton's method, close to the vibration of the exact frame. If a step leads far away from it, perhaps to another
    !> vibration, the search is repeated without `near`
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
      ! Forces that are only rounding errors of larger forces move the frame so little that all models agree.
      varied%newton = model == "exact" .and. frame%load_rounding < 0.5_dp
      if (varied%newton .and. present(near)) then
        call varied%linearise_about(near)
        call iterate(frame, accuracy, .false., varied, steps, error)
        if (.not. allocated(error) .and. maxval([0.0_dp, steps]) < near_step) then
          call move_alloc(varied, settled)
          return
        end if
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
      call fatal_error(error, "unknown model of the frame '" // model // "'", invalid_input)
    end select
  end subroutine settle

  !> Applies a model to a member of a family, in place. The model 'averaged' replaces a frame by equations with the averages of M,
  !> B, C. Systems that are not frames remain unchanged. Fails if `settle` fails.
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

  !> Searches for the vibration of the exact frame. Newton's method starts from `varied`, the frame linearised about rest. If it
  !> fails, the vibration is searched by continuation. On the curve of the vibration against the speed, a vibration between two
  !> turning points is unstable, so no machine stays on it. If Newton's method finds such a vibration, and continuation from
  !> another speed leads to a different one, the latter is returned.
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
    logical :: followed

    found = varied
    call iterate(frame, accuracy, .false., found, steps, error)
    ! Continuation may succeed even if the linear equations have no vibration, or if their vibration is too large as a start.
    followed = .false.
    if (allocated(error)) followed = any(error%cause == [resonance, no_convergence])
    if (allocated(error) .and. .not. followed) return
    if (followed) then
      found = varied
      call follow_excitation(frame, accuracy, found, steps, error)
      if (allocated(error)) call follow_speed(frame, accuracy, found, steps, error)
      if (allocated(error)) call follow_damping(frame, accuracy, found, steps, error)
      if (allocated(error)) return
    else if (steps(1) > notably_nonlinear) then
      if (between_turning_points(found)) then
        other = varied
        call follow_speed(frame, accuracy, other, other_steps, none)
        if (.not. allocated(none)) followed = .not. between_turning_points(other)
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

  !> True if a real multiplier is greater than 1. On the curve of the vibration against the speed, the vibration then lies between
  !> two turning points.
  logical function between_turning_points(varied)
    type(varied_frame_type), intent(in) :: varied
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(error_type), allocatable :: error

    call solve_floquet(varied, accuracy_type(tolerance=rough), .false., floquet, error)
    if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
    between_turning_points = .false.
    if (.not. allocated(error)) between_turning_points = any(real(multipliers%rho) > 1 + multipliers%error .and. &
      & .not. abs(aimag(multipliers%rho)) > 0)
  end function between_turning_points

end module gestell_study_frame_model
