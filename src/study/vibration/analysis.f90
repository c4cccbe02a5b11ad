!> Analyses one machine at one speed. Only those results that are requested are computed.
module gestell_study_vibration_analysis
  use gestell_base_error, only: error_type, failed_computation, resonance
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_study_frame_model, only: newton_type, settle
  use gestell_study_mode_solution, only: solve_modes
  use gestell_study_mode, only: mode_type
  use gestell_study_vibration_free_directions, only: describe_free_directions
  use gestell_study_vibration_resonance, only: describe_resonance, find_nearest, name_resonance, resonance_type
  use gestell_study_vibration_vibration_list, only: list_vibrations, search_vibrations, listed_vibration_type
  use gestell_study_vibration, only: check_times, solve_vibration, vibration_type
  use gestell_system_averaged, only: averaged_system
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: analyse, find_modes

  !> Options of `analyse`: the results that are requested.
  type, public :: analysis_options
    !> Groups of results. `stability`: multipliers and verdict. `modes`: also the eigenvectors. `response`: the periodic vibration
    logical :: stability = .true., modes = .false., response = .true.
    !> `points`: number of intervals of the history over one period. `harmonics`: minimum number of harmonics
    integer :: points = 360, harmonics = 20
    !> True if M, B, C are replaced by their averages over the turn
    logical :: averaged = .false.
    !> Model of the frame to apply (gestell_study_frame_model)
    character(len=11) :: model = "exact"
    !> True if all vibrations of the exact frame are to be found, not only the one that is reported
    logical :: all_vibrations = .false.
    !> Number of rows of the motion to compute (gestell_model_quantity); 0 for none. Forces, probes and power are derived from these
    !> rows
    integer :: rows = 0
    !> True if the verdict is requested, even if no other result is
    logical :: verdict = .false.
  contains
    procedure :: vibration, judged
  end type analysis_options

  !> Results of `analyse`. Results that were not requested stay unallocated. Whenever a vibration is computed, its multipliers are
  !> computed too, because they decide its stability.
  type, public :: analysis_type
    type(floquet_type) :: floquet
    type(multipliers_type), allocatable :: multipliers
    !> The frame with its model applied: it has the equations that were solved
    class(frame_type), allocatable :: frame
    !> How the vibration of the exact frame was found
    type(newton_type) :: newton
    !> All known vibrations of the exact frame, in ascending order of size. Allocated if several are known, or if all were
    !> requested
    type(listed_vibration_type), allocatable :: several(:)
    type(vibration_type), allocatable :: vibration
    !> The multiplier nearest to 1. Allocated only if this resonance costs the vibration a digit of accuracy or more. `find_modes`
    !> adds the mode of the multiplier
    type(resonance_type), allocatable :: resonance
    !> The modes of the frame about its vibration, computed by `find_modes`; empty if they cannot be computed
    type(mode_type), allocatable :: modes(:)
  end type analysis_type

  !> A periodic vibration counts as near resonance if its condition number exceeds this value.
  real(dp), parameter :: one_digit = 10
  !> Advice that is printed if no vibration of the exact frame was found, although the equations linearised about rest have one.
  character(len=*), parameter :: advice = ": change the speed, add damping, or use &model frame='rest' for small motions"

contains

  !> True if the periodic vibration must be computed.
  pure logical function vibration(self)
    class(analysis_options), intent(in) :: self

    vibration = self%response .or. self%rows > 0
  end function vibration

  !> True if a verdict must be computed.
  pure logical function judged(self)
    class(analysis_options), intent(in) :: self

    judged = self%stability .or. self%modes .or. self%verdict .or. self%vibration()
  end function judged

  !> Computes the verdict and the vibration of a frame. Fails if the frame or the options are invalid, or if a step of the
  !> computation fails. If only the vibration fails, the multipliers are kept, and the error message names the resonance.
  subroutine analyse(frame, options, accuracy, analysis, error)
    !> The frame, before the model is applied
    class(frame_type), intent(in) :: frame
    type(analysis_options), intent(in) :: options
    type(accuracy_type), intent(in) :: accuracy
    !> The results that were requested
    type(analysis_type), intent(out), target :: analysis
    type(error_type), allocatable, intent(out) :: error
    type(averaged_system), target :: model
    class(periodic_system), pointer :: system
    type(multipliers_type) :: multipliers
    !> Unallocated if no rows are requested. An unallocated actual argument counts as absent for an optional argument
    integer, allocatable :: rows
    logical :: explained

    call frame%check(error)
    if (options%rows /= 0) rows = options%rows
    if (.not. allocated(error)) call check_times(options%points, options%harmonics, error, rows)
    if (allocated(error)) return
    if (options%averaged) then
      allocate(analysis%frame, source=frame)
      call frame%averaged(model)
      system => model
    else
      call settle(frame, trim(options%model), accuracy, analysis%frame, error, analysis%newton)
      if (allocated(error)) call explain_at_rest(frame, accuracy, error)
      if (allocated(error)) return
      system => analysis%frame
    end if
    call solve_floquet(system, accuracy, options%vibration(), analysis%floquet, error)
    if (.not. allocated(error) .and. options%judged()) call solve_multipliers(analysis%floquet, options%modes, multipliers, error)
    if (allocated(error) .and. .not. options%averaged .and. options%model /= "rest") call explain_by_mounting(frame, error, &
      & explained)
    if (allocated(error)) return
    if (options%judged()) analysis%multipliers = multipliers
    if (options%judged() .and. .not. options%averaged) call list_all_vibrations(frame, options, accuracy, analysis, error)
    if (allocated(error)) return
    if (.not. options%vibration()) return
    allocate(analysis%vibration)
    call solve_vibration(system, analysis%floquet, options%points, options%harmonics, analysis%vibration, error, rows)
    if (allocated(error)) then
      deallocate(analysis%vibration)
      if (error%cause == resonance .and. .not. options%averaged) call explain(frame, accuracy, analysis, error)
    else if (analysis%vibration%start%condition > one_digit) then
      analysis%resonance = find_nearest(analysis%multipliers)
    end if
  end subroutine analyse

  !> Lists all vibrations if several are known. Searches for further vibrations if this is requested. Fails if `list_vibrations`
  !> fails.
  subroutine list_all_vibrations(frame, options, accuracy, analysis, error)
    class(frame_type), intent(in) :: frame
    type(analysis_options), intent(in) :: options
    type(accuracy_type), intent(in) :: accuracy
    type(analysis_type), intent(inout) :: analysis
    type(error_type), allocatable, intent(out) :: error
    type(varied_frame_type), allocatable :: list(:)
    integer :: i, others

    others = 0
    if (allocated(analysis%newton%others)) others = size(analysis%newton%others)
    if (others == 0 .and. .not. options%all_vibrations) return
    allocate(list(1 + others))
    select type (reported => analysis%frame)
    class is (varied_frame_type)
      list(1) = reported
    end select
    do i = 1, others
      list(1 + i) = analysis%newton%others(i)
    end do
    if (options%all_vibrations .and. list(1)%newton) call search_vibrations(frame, accuracy, list)
    call list_vibrations(list, accuracy, options%points, options%harmonics, analysis%several, error)
  end subroutine list_all_vibrations

  !> Computes the modes of the frame about its vibration. If there is a resonance, also sets the mode of the resonance.
  subroutine find_modes(frame, averaged, accuracy, analysis)
    !> The frame to which `analysis` belongs
    class(frame_type), intent(in) :: frame
    !> True if the averaged model of the frame was analysed
    logical, intent(in) :: averaged
    type(accuracy_type), intent(in) :: accuracy
    !> The analysis of the frame, to which the modes are added
    type(analysis_type), intent(inout) :: analysis
    type(error_type), allocatable :: error
    type(averaged_system) :: model
    real(dp), allocatable :: mass(:, :)

    if (allocated(analysis%modes)) return
    if (averaged) then
      call frame%averaged(model)
      call solve_modes(model, accuracy, analysis%modes, mass, error)
    else
      call solve_modes(analysis%frame, accuracy, analysis%modes, mass, error)
    end if
    if (.not. allocated(analysis%modes)) allocate(analysis%modes(0))
    if (.not. allocated(analysis%resonance)) return
    call name_resonance(analysis%resonance, frame, analysis%multipliers, analysis%modes, error)
    if (allocated(error)) deallocate(analysis%resonance)
  end subroutine find_modes

  !> Explains in the message of `failure` why there is no vibration. If the mounting does not hold the frame in some direction,
  !> the explanation replaces the message. Otherwise it is appended: a resonance of the frame linearised about rest, or advice
  !> what to change.
  subroutine explain_at_rest(frame, accuracy, failure)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(error_type), intent(inout) :: failure
    type(analysis_type) :: at_rest
    type(periodic_solution_type) :: start
    type(error_type), allocatable :: error
    logical :: explained

    if (failure%code /= failed_computation) return
    call explain_by_mounting(frame, failure, explained)
    if (explained) return
    call solve_floquet(frame, accuracy, .true., at_rest%floquet, error)
    if (.not. allocated(error)) call solve_periodic(at_rest%floquet, start, error)
    if (.not. allocated(error)) failure%message = failure%message // advice
    if (.not. allocated(error)) return
    if (error%cause /= resonance) return
    allocate(at_rest%multipliers)
    call solve_multipliers(at_rest%floquet, .false., at_rest%multipliers, error)
    if (allocated(error)) return
    allocate(at_rest%frame, source=frame)
    failure%message = failure%message // "; the equations linearised about rest have no periodic vibration either"
    call explain(frame, accuracy, at_rest, failure)
  end subroutine explain_at_rest

  !> If the mounting does not hold the frame in some direction, replaces the message of `failure` and sets `explained` to true.
  subroutine explain_by_mounting(frame, failure, explained)
    class(frame_type), intent(in) :: frame
    type(error_type), intent(inout) :: failure
    logical, intent(out) :: explained
    character(len=:), allocatable :: directions

    directions = trim(describe_free_directions(frame))
    explained = directions /= ""
    if (explained) failure%message = "there is no periodic vibration: " // directions
  end subroutine explain_by_mounting

  !> Explains the cause of the resonance in the message of `failure`. If the mounting does not hold the frame in some direction,
  !> the explanation replaces the message. Otherwise the mode that is in resonance is appended to it.
  subroutine explain(frame, accuracy, analysis, failure)
    class(frame_type), intent(in) :: frame
    type(accuracy_type), intent(in) :: accuracy
    type(analysis_type), intent(inout) :: analysis
    type(error_type), intent(inout) :: failure
    character(len=:), allocatable :: sentence
    logical :: explained

    call explain_by_mounting(frame, failure, explained)
    if (explained) return
    analysis%resonance = find_nearest(analysis%multipliers)
    call find_modes(frame, .false., accuracy, analysis)
    if (.not. allocated(analysis%resonance)) return
    call describe_resonance(analysis%resonance, sentence)
    failure%message = failure%message // "; " // sentence
  end subroutine explain

end module gestell_study_vibration_analysis
