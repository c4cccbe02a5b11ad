!> Solves a machine at one speed of a resonance curve. Computes peaks, rms values and amplitudes of orders, and the frequencies of
!> the free vibrations relative to the frequency of the period.
module gestell_study_speed_point
  use gestell_base_error, only: error_type, fatal_error, invalid_input, resonance
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: failed, in_resonance, verdict_type
  use gestell_base_words, only: word_length
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_frame_of, only: frame_of
  use gestell_model_quantity, only: find_quantity
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_model_quantity_rows, only: probe_type, quantity_type
  use gestell_system_family, only: family_type
  use gestell_study_measure, only: measure_type, compute_measures
  use gestell_study_member, only: member_type
  use gestell_study_vibration_small_motion, only: moved, moved_type
  use gestell_study_speeds, only: check_harmonic_options, harmonic_options
  use gestell_study_vibration_statistics, only: statistics_type, compute_statistics
  use gestell_study_vibration, only: solve_vibration, vibration_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: check_speed_options, solve_response, solve_speed_point, compute_turns

  !> Options for a solution at one speed: the results that are requested. The amplitudes of the harmonics that are considered are
  !> reported.
  type, extends(harmonic_options), public :: speed_options
    !> Names of the quantities as the user gave them (gestell_model_quantity)
    character(len=word_length), allocatable :: names(:)
    !> Probes to which the names and measures may refer
    type(probe_type), allocatable :: probes(:)
    !> Measures of quantities that are reported in addition
    type(measure_type), allocatable :: measures(:)
  end type speed_options

  !> Results of a machine at one speed.
  type, public :: speed_point_type
    !> The speed, which is the parameter of the family
    real(dp) :: speed = 0
    !> The verdict on the vibration, or the reason why there is no vibration
    type(verdict_type) :: state = failed
    !> Values for each quantity, shape (3 + harmonics, quantities): peak, bound on the error of the peak, rms, and amplitudes of the
    !> harmonics. NaN if there is no vibration
    real(dp), allocatable :: values(:, :)
    !> Number of the harmonic with the largest amplitude of all, shape (quantities)
    integer, allocatable :: strongest(:)
    !> The requested measures, each with a bound on its error, shape (2, measures)
    real(dp), allocatable :: measured(:, :)
    !> Free vibrations, each component of shape (modes). `turns`: phase advance over the period, in turns, reduced to (-1/2, 1/2].
    !> `growth`: logarithm of the growth over the period. Both are unallocated if no multipliers are computed. `averaged_turns`:
    !> natural frequencies of the averaged frame in cycles per period, ascending
    real(dp), allocatable :: turns(:), growth(:), averaged_turns(:)
    !> 2 pi divided by the period (rad/s)
    real(dp) :: crank = 0
    !> Number of turns that the drive makes in the period
    integer :: drive_turns = 1
    !> Largest displacement and rotation of the frame; 0 if there is no vibration
    type(moved_type) :: moved
    !> True if the equations are linear; only then can the vibration grow without bound. A vibration of the exact frame stays
    !> finite, but it may be one of several
    logical :: linear = .true.
    !> Distance from 1 of the multiplier that is nearest to 1. At distance 0 a vibration of the exact frame ceases to exist
    real(dp) :: from_fold = huge(1.0_dp)
  end type speed_point_type

  !> Arguments for `solve_vibration`. `history`: number of intervals of the history. `harmonics`: minimum number of harmonics.
  integer, parameter :: history = 64, harmonics = 20

contains

  !> Solves the member of `family` at `speed`. Fails if the speed, the accuracy or a name is invalid. Other failures are recorded in
  !> `point%state`.
  subroutine solve_speed_point(family, speed, options, point, error)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: speed
    type(speed_options), intent(in) :: options
    type(speed_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error

    call solve_response(family, [speed], options, point, error)
    point%speed = speed
  end subroutine solve_speed_point

  !> Checks the options. Fails if no quantity is requested, or if the orders or the accuracy are out of range.
  pure subroutine check_speed_options(options, error)
    type(speed_options), intent(in) :: options
    type(error_type), allocatable, intent(out) :: error
    integer :: n

    n = 0
    if (allocated(options%names)) n = size(options%names)
    if (n == 0) then
      call fatal_error(error, "a resonance curve requires one or more quantities", invalid_input)
    else
      call check_harmonic_options(options, error)
    end if
  end subroutine check_speed_options

  !> Solves the member of `family` with any parameters; the caller sets `point%speed`. Fails in the same cases as
  !> `solve_speed_point`.
  subroutine solve_response(family, parameters, options, point, error)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    type(speed_options), intent(in) :: options
    type(speed_point_type), intent(out) :: point
    type(error_type), allocatable, intent(out) :: error
    type(member_type), target :: member
    class(frame_type), pointer :: frame
    type(quantity_type), allocatable :: quantities(:)
    type(multipliers_type) :: multipliers
    type(vibration_type) :: vibration
    type(statistics_type) :: statistics
    type(probe_type), allocatable :: probes(:)
    integer, allocatable :: split(:)
    integer :: i, k

    call check_speed_options(options, error)
    if (allocated(error)) return
    split = options%requested_harmonics()
    allocate(point%values(3 + size(split), size(options%names)), source=ieee_value(1.0_dp, ieee_quiet_nan))
    allocate(point%strongest(size(options%names)), source=0)
    call member%make(family, parameters, error)
    if (allocated(error)) return
    if (.not. member%is_sound()) then
      point%state = member%state
      return
    end if
    frame => frame_of(member%system)
    allocate(probes(0))
    if (allocated(options%probes)) probes = options%probes
    if (.not. associated(frame)) then
      call fatal_error(error, "a resonance curve requires a frame, but the system is not a frame", invalid_input)
      return
    end if
    allocate(quantities(size(options%names)))
    do i = 1, size(quantities)
      call find_quantity(frame, probes, trim(options%names(i)), quantities(i), error)
      if (allocated(error)) return
    end do
    call member%solve(options%accuracy, .true., error)
    if (.not. allocated(error)) call member%multipliers(.true., multipliers, error)
    if (allocated(error) .or. .not. member%is_sound()) return
    call compute_turns(frame, multipliers%arg, multipliers%log_abs, multipliers%vectors, point)
    select type (frame)
    class is (varied_frame_type)
      point%linear = .not. frame%newton
    end select
    if (.not. point%linear) point%from_fold = minval(abs(multipliers%rho - 1))
    call solve_vibration(member%system, member%floquet, history, maxval([harmonics, split]), vibration, error, &
      & maxval([(quantities(i)%rows(), i = 1, size(quantities))]))
    if (allocated(error)) then
      if (error%cause == resonance) point%state = in_resonance
      deallocate(error)
      return
    end if
    point%state = multipliers%judge()
    point%moved = moved(frame, vibration%peak(:frame%dofs()))
    do i = 1, size(quantities)
      call compute_statistics(vibration, quantities(i), statistics, error)
      if (allocated(error)) return
      point%values(:, i) = [statistics%peak, statistics%peak_error, statistics%rms, &
        & (statistics%amplitude(split(k)), k = 1, size(split))]
      point%strongest(i) = statistics%strongest()
    end do
    if (.not. allocated(options%measures)) return
    allocate(point%measured(2, size(options%measures)))
    call compute_measures(frame, probes, vibration, options%measures, point%measured, error)
  end subroutine solve_response

  !> Computes the phase advance of each free vibration over the period. Conjugate multipliers describe the same vibration and differ
  !> only in the sign of the phase advance. The sign is determined by Im(q* M q'), where q is the eigenvector: it is positive for
  !> exp(i w t) with w > 0. Real multipliers of the same sign form pairs, and only one of each pair is used.
  subroutine compute_turns(frame, arg, log_abs, vectors, point)
    class(frame_type), intent(in) :: frame
    !> Arguments and logarithms of the moduli of all multipliers: imaginary and real parts of ln(rho), shapes (states)
    real(dp), intent(in) :: arg(:), log_abs(:)
    !> Eigenvectors of the multipliers, shape (states, states)
    complex(dp), intent(in) :: vectors(:, :)
    type(speed_point_type), intent(inout) :: point
    type(error_type), allocatable :: none
    real(dp), allocatable :: frequencies(:)
    real(dp), dimension(size(frame%free), size(frame%free)) :: m, b, c
    complex(dp) :: q(size(frame%free)), q_dot(size(frame%free))
    real(dp) :: turn
    integer :: f, k, n
    logical :: second(2)

    f = size(frame%free)
    allocate(point%turns(f), point%growth(f), point%averaged_turns(f), source=0.0_dp)
    point%crank = abs(frame%speed)
    point%drive_turns = frame%mechanism%turns
    call frame%matrices(0.0_dp, m, b, c)
    n = 0
    second = .false.
    do k = 1, size(arg)
      turn = arg(k) / (2 * pi)
      if (turn < 0 .or. n == f) cycle
      if (turn > 0 .and. turn < 0.5_dp) then
        q = vectors(:f, k)
        q_dot = vectors(f + 1:, k)
        turn = sign(turn, aimag(dot_product(q, matmul(m, q_dot))))
      else
        associate (skip => second(merge(1, 2, turn > 0)))
          skip = .not. skip
          if (.not. skip) cycle
        end associate
      end if
      n = n + 1
      point%turns(n) = turn
      point%growth(n) = log_abs(k)
    end do
    call frame%natural_frequencies(frequencies, none)
    if (.not. allocated(none)) point%averaged_turns = max(frequencies, 0.0_dp) / abs(frame%speed)
  end subroutine compute_turns

end module gestell_study_speed_point
