!> Invalid arguments to the procedures that build machines and evaluate their vibration.
module invalid_machine_arguments
  use checks, only: check_that
  use gestell_api_numerics, only: accuracy_type, analyse, analysis_type, band_rms, diagnose, diagnosis_type, dp, drive_type, &
    & error_type, find_drive, find_reactions, find_quantity, fourier_series, fourier_type, frame_type, guide_forces, guide_type, &
    & harmonic_mechanism_type, history_of, invalid_input, linkage_type, measure_trade, mesh, method_type, new_frame, &
    & new_harmonic_mechanism, new_method, reaction_type, probe_type, quantity_type, cache_mechanism, shaking, shaking_type, &
    & solve_vibration, statistics_type, stiffness_matrix, support_type, compute_statistics, analysis_options, trade_type, &
    & vibration_type, find_responses, probe_response_type
  use gestell_api_numerics, only: damping_matrix
  use faulty_systems, only: check_answer, infinite, nan, expect
  use testdrive, only: check, test_error => error_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  implicit none (type, external)
  private

  public :: test_frames, test_linkages, test_tasks_and_names, test_empty_input, test_vibrations

  real(dp), parameter :: springs(3, 3) = reshape([1.0e5_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0e5_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0e4_dp], &
    & [3, 3])
  real(dp), parameter :: dampers(3, 3) = reshape([1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp], [3, 3])

contains

  !> Numbers that are not finite, invalid lengths, unknown names and joints.
  subroutine test_linkages(error)
    type(test_error), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(guide_type) :: guide
    type(diagnosis_type) :: diagnosis
    type(shaking_type) :: found
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: complaints
    real(dp) :: bad(6)
    integer :: i

    complaints = ""
    call diagnose(linkage, diagnosis, failure)
    call expect(failure, invalid_input, "diagnosis of an empty linkage", complaints)
    call shaking(linkage, 1.0_dp, found, failure)
    call expect(failure, invalid_input, "shaking forces of an empty linkage", complaints)
    call four_bar(linkage)
    call shaking(linkage, nan(), found, failure)
    call expect(failure, invalid_input, "shaking: speed", complaints)
    bad = [nan(), infinite(), -1.0_dp, 0.0_dp, 1.0e-155_dp, 1.0e200_dp]
    do i = 1, size(bad)
      call linkage%crank("C", "A0", bad(i), 0.0_dp, failure)
      call expect(failure, invalid_input, "crank: radius", complaints)
      call linkage%rrr("C", ["A ", "B0"], [bad(i), 1.0_dp], 1, failure)
      call expect(failure, invalid_input, "rrr: length", complaints)
      call linkage%rrp("C", "A", bad(i), guide, 1, failure)
      call expect(failure, invalid_input, "rrp: length", complaints)
      call linkage%rpr("C", ["A ", "B0"], bad(i), 1, failure)
      call expect(failure, invalid_input, "rpr: length", complaints)
      if (i >= 4) cycle
      call linkage%link("C", "A", "B", bad(i), 1.0_dp, [0.0_dp, 0.0_dp], failure)
      call expect(failure, invalid_input, "link: mass", complaints)
      call linkage%link("C", "A", "B", 1.0_dp, bad(i), [0.0_dp, 0.0_dp], failure)
      call expect(failure, invalid_input, "link: inertia", complaints)
      if (i == 3) cycle
      call linkage%ground("C", [bad(i), 0.0_dp], failure)
      call expect(failure, invalid_input, "ground: position", complaints)
      call linkage%crank("C", "A0", 0.1_dp, bad(i), failure)
      call expect(failure, invalid_input, "crank: phase", complaints)
      call linkage%rigid("C", ["A ", "B0"], [0.0_dp, bad(i)], failure)
      call expect(failure, invalid_input, "rigid: offset", complaints)
      call linkage%rrp("C", "A", 1.0_dp, guide_type(point=[bad(i), 0.0_dp]), 1, failure)
      call expect(failure, invalid_input, "rrp: guide", complaints)
      call linkage%prp("C", [guide, guide_type(angle=bad(i))], failure)
      call expect(failure, invalid_input, "prp: guide", complaints)
      call linkage%rpp("C", "A", guide, bad(i), failure)
      call expect(failure, invalid_input, "rpp: slot", complaints)
      call linkage%moving_guide(["A ", "B0"], [bad(i), 0.0_dp], 0.0_dp, guide, failure)
      call expect(failure, invalid_input, "guide: point", complaints)
      guide = guide_type()
      call linkage%link("C", "A", "B", 1.0_dp, 1.0_dp, [0.0_dp, bad(i)], failure)
      call expect(failure, invalid_input, "link: centre", complaints)
    end do
    call linkage%rrr("C", ["A"], [1.0_dp, 1.0_dp], 1, failure)
    call expect(failure, invalid_input, "rrr: one end", complaints)
    call linkage%rrr("C", [character(len=2) ::], [1.0_dp, 1.0_dp], 1, failure)
    call expect(failure, invalid_input, "rrr: no ends", complaints)
    call linkage%rrr("C", ["A", "A"], [1.0_dp, 1.0_dp], 1, failure)
    call expect(failure, invalid_input, "rrr: an end twice", complaints)
    call linkage%rrr("C", ["A ", "Z0"], [1.0_dp, 1.0_dp], 1, failure)
    call expect(failure, invalid_input, "rrr: no such end", complaints)
    call linkage%rrr("C", ["A ", "B0"], [0.37_dp, 0.16_dp], 7, failure)
    call expect(failure, invalid_input, "rrr: branch", complaints)
    call linkage%rpp("C", "A", guide_type(carriers=[99, 1]), 1.0_dp, failure)
    call expect(failure, invalid_input, "rpp: carried by a missing joint", complaints)
    call linkage%moving_guide(["A"], [0.0_dp, 0.0_dp], 0.0_dp, guide, failure)
    call expect(failure, invalid_input, "guide: one carrier", complaints)
    call linkage%ground("", [0.0_dp, 0.0_dp], failure)
    call expect(failure, invalid_input, "no name", complaints)
    call linkage%ground("A", [0.0_dp, 0.0_dp], failure)
    call expect(failure, invalid_input, "a name twice", complaints)
    call linkage%link("C", "A", "A", 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
    call expect(failure, invalid_input, "link: from and to", complaints)
    call linkage%ground(repeat("x", 100000), [0.0_dp, 0.0_dp], failure)
    call check_answer(failure, "a long name", complaints)
    call check(error, complaints, "")
  end subroutine test_linkages

  !> Frames, and mechanisms given by harmonics.
  subroutine test_frames(error)
    type(test_error), allocatable, intent(out) :: error
    type(linkage_type) :: linkage, empty, two_cranks, no_links
    type(harmonic_mechanism_type) :: harmonic
    type(support_type) :: support
    type(frame_type) :: frame
    type(error_type), allocatable :: failure
    character(len=:), allocatable :: complaints
    real(dp) :: bad(6), stiffness(3, 3)
    integer, allocatable :: none(:)
    integer :: i

    complaints = ""
    call four_bar(linkage)
    bad = [nan(), infinite(), -1.0_dp, 0.0_dp, huge(1.0_dp), tiny(1.0_dp)]
    do i = 1, size(bad)
      stiffness = springs
      stiffness(1, 1) = bad(i)
      call request(linkage, bad(i), 1.0_dp, 10.0_dp, springs, i <= 3, "frame: mass", complaints)
      call request(linkage, 1.0_dp, bad(i), 10.0_dp, springs, i <= 3, "frame: inertia", complaints)
      call request(linkage, 1.0_dp, 1.0_dp, bad(i), springs, i <= 2 .or. i == 4, "frame: speed", complaints)
      call request(linkage, 1.0_dp, 1.0_dp, 10.0_dp, stiffness, i <= 2, "frame: stiffness", complaints)
      call new_harmonic_mechanism(harmonic, bad(i), 1.0_dp, [0.0_dp], [0.0_dp], [0.0_dp], [0.0_dp], error=failure)
      if (i <= 3) call expect(failure, invalid_input, "harmonics: mass", complaints)
      call new_harmonic_mechanism(harmonic, 1.0_dp, 1.0_dp, [0.0_dp], [0.0_dp], [1.0_dp], [bad(i)], error=failure)
      if (i <= 2) call expect(failure, invalid_input, "harmonics: moment", complaints)
    end do
    call new_harmonic_mechanism(harmonic, 1.0_dp, 1.0_dp, [1.0_dp, 2.0_dp], [0.0_dp], [0.0_dp], [0.0_dp], error=failure)
    call expect(failure, invalid_input, "harmonics: an even number", complaints)
    call new_harmonic_mechanism(harmonic, 1.0_dp, 1.0_dp, [real(dp) ::], [0.0_dp], [0.0_dp], [0.0_dp], error=failure)
    call expect(failure, invalid_input, "harmonics: none", complaints)
    call new_harmonic_mechanism(harmonic, 1.0_dp, 1.0_dp, [0.0_dp], [0.0_dp], [1.0_dp], [0.0_dp], error=failure, energy=[nan()])
    call expect(failure, invalid_input, "harmonics: energy", complaints)
    call use_uninitialised(complaints)

    call no_links%ground("A0", [0.0_dp, 0.0_dp], failure)
    call request(empty, 1.0_dp, 1.0_dp, 1.0_dp, springs, .true., "no joints", complaints)
    call request(no_links, 1.0_dp, 1.0_dp, 1.0_dp, springs, .true., "no crank", complaints)
    call no_links%crank("A", "A0", 0.1_dp, 0.0_dp, failure)
    call request(no_links, 1.0_dp, 1.0_dp, 1.0_dp, springs, .true., "no links", complaints)
    call four_bar(two_cranks)
    call two_cranks%crank("A2", "A0", 0.1_dp, 0.0_dp, failure)
    call request(two_cranks, 1.0_dp, 1.0_dp, 1.0_dp, springs, .false., "two cranks", complaints)

    ! gfortran takes an empty structure constructor for an absent argument, so this one is not empty.
    allocate(none(0))
    call freed(none, .true.)
    call freed([9], .true.)
    call freed([0], .true.)
    call freed([1, 1], .true.)
    call freed([3, 1], .false.)
    support%stiffness = nan()
    call new_frame(frame, linkage, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], springs, dampers, 10.0_dp, error=failure, supports=[support])
    call expect(failure, invalid_input, "support nan", complaints)
    stiffness = springs
    stiffness(1, 2) = 1.0e6_dp
    call request(linkage, 1.0_dp, 1.0_dp, 10.0_dp, stiffness, .false., "stiffness that is not symmetric", complaints)
    call check(error, complaints, "")

  contains

    subroutine freed(free, refused)
      integer, intent(in) :: free(:)
      logical, intent(in) :: refused

      call new_frame(frame, linkage, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], springs, dampers, 10.0_dp, error=failure, free=free)
      if (refused) then
        call expect(failure, invalid_input, "free", complaints)
      else
        call check_answer(failure, "free", complaints)
      end if
    end subroutine freed

  end subroutine test_frames

  !> Builds a frame and requests its results.
  subroutine request(linkage, mass, inertia, speed, stiffness, refused, what, complaints)
    type(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: mass, inertia, speed, stiffness(3, 3)
    logical, intent(in) :: refused
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(inout) :: complaints
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(error_type), allocatable :: failure

    call new_frame(frame, linkage, mass, inertia, [0.0_dp, 0.0_dp], stiffness, dampers, speed, error=failure)
    if (refused) then
      call expect(failure, invalid_input, what, complaints)
      return
    end if
    if (.not. allocated(failure)) call analyse(frame, analysis_options(), accuracy_type(), analysis, failure)
    call check_answer(failure, what, complaints)
  end subroutine request

  !> Frames and mechanisms that were never initialised.
  subroutine use_uninitialised(complaints)
    character(len=:), allocatable, intent(inout) :: complaints
    type(harmonic_mechanism_type) :: harmonic
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(quantity_type) :: quantity
    type(probe_type) :: probes(0)
    type(trade_type) :: trade
    class(method_type), allocatable :: method
    type(error_type), allocatable :: failure
    real(dp), allocatable :: frequencies(:)

    call new_frame(frame, harmonic, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], springs, dampers, 10.0_dp, error=failure)
    call expect(failure, invalid_input, "harmonics not made", complaints)
    call unset(frame)
    call analyse(frame, analysis_options(), accuracy_type(), analysis, failure)
    call expect(failure, invalid_input, "analyse: no frame", complaints)
    call analyse(frame, analysis_options(averaged=.true.), accuracy_type(), analysis, failure)
    call expect(failure, invalid_input, "analyse: no frame to average", complaints)
    call frame%natural_frequencies(frequencies, failure)
    call expect(failure, invalid_input, "natural frequencies: no frame", complaints)
    call find_quantity(frame, probes, "f", quantity, failure)
    call expect(failure, invalid_input, "quantity: no frame", complaints)
    call measure_trade(frame, 1.0_dp, trade, failure)
    call expect(failure, invalid_input, "trade: no frame", complaints)
    call new_method("gauss4", method, failure)
    call cache_mechanism(frame, method, [0.0_dp, 1.0_dp])
  end subroutine use_uninitialised

  pure subroutine unset(frame)
    type(frame_type), intent(out) :: frame

    frame%states = 0
  end subroutine unset

  !> Tasks, names, and frames whose components were changed inconsistently.
  subroutine test_tasks_and_names(error)
    type(test_error), allocatable, intent(out) :: error
    type(analysis_options), parameter :: bad(9) = [analysis_options(points=0), analysis_options(points=-1), &
      & analysis_options(points=huge(1)), analysis_options(harmonics=-1), analysis_options(harmonics=1000000), &
      & analysis_options(harmonics=huge(1)), analysis_options(rows=5), analysis_options(rows=99), analysis_options(rows=-1)]
    character(len=*), parameter :: names(5) = [character(len=24) :: "", "support(", "support(99999999999).fx", "probe(x).v", &
      & "foundation."]
    type(frame_type) :: frame, changed
    type(analysis_type) :: analysis
    type(vibration_type) :: vibration
    type(quantity_type) :: quantity
    type(probe_type) :: probes(0)
    type(trade_type) :: trade
    type(error_type), allocatable :: failure
    real(dp), allocatable :: frequencies(:)
    character(len=:), allocatable :: complaints
    integer :: i

    complaints = ""
    call sound(frame, failure)
    call check_answer(failure, "a valid frame", complaints)
    do i = 1, size(bad)
      call analyse(frame, bad(i), accuracy_type(), analysis, failure)
      call expect(failure, invalid_input, "analyse: tasks", complaints)
    end do
    call analyse(frame, analysis_options(response=.false.), accuracy_type(), analysis, failure)
    call check_answer(failure, "stability alone", complaints)
    call solve_vibration(frame, analysis%floquet, 10, 10, vibration, failure)
    call expect(failure, invalid_input, "vibration without forcing", complaints)
    do i = 1, size(names)
      call find_quantity(frame, probes, trim(names(i)), quantity, failure)
      call expect(failure, invalid_input, "quantity '" // trim(names(i)) // "'", complaints)
    end do
    call measure_trade(frame, nan(), trade, failure)
    call expect(failure, invalid_input, "trade: time nan", complaints)
    call measure_trade(frame, -1.0_dp, trade, failure)
    call expect(failure, invalid_input, "trade: time negative", complaints)

    changed = frame
    changed%speed = 0
    changed%period = infinite()
    call analyse(changed, analysis_options(), accuracy_type(), analysis, failure)
    call expect(failure, invalid_input, "speed 0", complaints)
    changed = frame
    changed%period = -frame%period
    call analyse(changed, analysis_options(), accuracy_type(), analysis, failure)
    call expect(failure, invalid_input, "negative period", complaints)
    changed%period = 2 * frame%period
    call analyse(changed, analysis_options(), accuracy_type(), analysis, failure)
    call expect(failure, invalid_input, "period of another speed", complaints)
    call changed%natural_frequencies(frequencies, failure)
    call expect(failure, invalid_input, "natural frequencies: period of another speed", complaints)
    changed = frame
    changed%free = [1]
    call analyse(changed, analysis_options(), accuracy_type(), analysis, failure)
    call expect(failure, invalid_input, "other degrees of freedom", complaints)
    call check(error, complaints, "")
  end subroutine test_tasks_and_names

  !> Vibrations that lack the requested quantities.
  subroutine test_vibrations(error)
    type(test_error), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(vibration_type) :: none
    type(quantity_type) :: quantity, unknown
    type(probe_type) :: probe
    type(statistics_type) :: statistics
    type(reaction_type), allocatable :: reactions(:)
    type(probe_response_type), allocatable :: responses(:)
    type(drive_type) :: drive
    type(error_type), allocatable :: failure
    real(dp), allocatable :: history(:)
    real(dp) :: along(1), maximum
    character(len=:), allocatable :: complaints
    logical :: known

    complaints = ""
    call sound(frame, failure)
    call find_quantity(frame, [probe], "f", quantity, failure)
    call analyse(frame, analysis_options(), accuracy_type(), analysis, failure)
    call check_answer(failure, "a valid vibration", complaints)
    call use_incomplete(analysis%vibration, "without rows")
    call use_incomplete(none, "not solved")
    call band_rms(statistics, 1.0_dp, [0.0_dp, 1.0_dp], along, maximum, failure)
    call expect(failure, invalid_input, "band of no statistics", complaints)
    call analyse(frame, analysis_options(rows=guide_forces), accuracy_type(), analysis, failure)
    call check_answer(failure, "all rows", complaints)
    call compute_statistics(analysis%vibration, unknown, statistics, failure)
    call expect(failure, invalid_input, "statistics of no quantity", complaints)
    call history_of(analysis%vibration, unknown, history, failure)
    call expect(failure, invalid_input, "history of no quantity", complaints)
    probe%position = nan()
    call find_responses(frame, analysis%vibration, [probe], responses, failure)
    call expect(failure, invalid_input, "probe: position", complaints)
    probe = probe_type(band=[10.0_dp, 5.0_dp])
    call find_responses(frame, analysis%vibration, [probe], responses, failure)
    call expect(failure, invalid_input, "probe: band", complaints)
    probe = probe_type(limit=-1.0_dp)
    call find_responses(frame, analysis%vibration, [probe], responses, failure)
    call expect(failure, invalid_input, "probe: limit", complaints)
    call check(error, complaints, "")

  contains

    subroutine use_incomplete(vibration, what)
      type(vibration_type), intent(in) :: vibration
      character(len=*), intent(in) :: what

      call compute_statistics(vibration, quantity, statistics, failure)
      call expect(failure, invalid_input, "statistics: " // what, complaints)
      call history_of(vibration, quantity, history, failure)
      call expect(failure, invalid_input, "history: " // what, complaints)
      call find_reactions(frame, vibration, reactions, failure)
      call expect(failure, invalid_input, "places: " // what, complaints)
      call find_responses(frame, vibration, [probe], responses, failure)
      call expect(failure, invalid_input, "probes: " // what, complaints)
      call find_drive(frame, vibration, drive, known, failure)
      call expect(failure, invalid_input, "drive: " // what, complaints)
    end subroutine use_incomplete

  end subroutine test_vibrations

  !> Functions without an error argument return defined values for empty input.
  subroutine test_empty_input(error)
    type(test_error), allocatable, intent(out) :: error
    type(fourier_type) :: series
    real(dp), parameter :: one(1) = 1

    series = fourier_series([real(dp) ::])
    call check(error, size(series%amplitude), 0, more="no samples")
    if (allocated(error)) return
    series = fourier_series(one)
    call check(error, series%mean, one(1), thr=0.0_dp, more="one sample")
    if (allocated(error)) return
    series = fourier_series([1.0_dp, nan(), 2.0_dp])
    call check(error, ieee_is_nan(series%mean), more="a sample that is NaN")
    if (allocated(error)) return
    call check_that(error, [abs(stiffness_matrix([support_type ::])), abs(damping_matrix([support_type ::]))], "<=", &
      & 0.0_dp, "no supports")
  end subroutine test_empty_input

  subroutine four_bar(linkage)
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable :: failure

    call linkage%ground("A0", [0.0_dp, 0.0_dp], failure)
    call linkage%ground("B0", [0.40_dp, 0.0_dp], failure)
    call linkage%crank("A", "A0", 0.07_dp, 0.0_dp, failure)
    call linkage%rrr("B", ["A ", "B0"], [0.37_dp, 0.16_dp], 1, failure)
    call linkage%link("coupler", "A", "B", 0.60_dp, 0.0070_dp, [0.18_dp, 0.0_dp], failure)
  end subroutine four_bar

  subroutine sound(frame, failure)
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: failure
    type(linkage_type) :: linkage

    call four_bar(linkage)
    call new_frame(frame, linkage, 18.0_dp, 0.78_dp, [0.0_dp, 0.0_dp], springs, dampers, 25.0_dp, error=failure)
  end subroutine sound

end module invalid_machine_arguments
