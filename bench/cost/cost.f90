!> What a solution costs against the work that lies in it, as CSV:
!>
!>     bash bench/cost/run.sh
!>
!> draws it. Everything is solved by method auto; times are the shortest of many, in seconds. Three families:
!>
!> - `turns`: the four-bar of data/ from fast to slow, w_max T from 1 to 1e6, tolerance 1e-9;
!> - `links`: a four-bar and a row of rockers behind it, 2 to 20 links, tolerance 1e-9; x is their number;
!> - `tolerance`: the four-bar at 240, 20 and 1 rpm; x is the tolerance.
!>
!> Series `x0` solves multipliers and x0, `multipliers` no x0, `frame` makes the frame and proves that the mechanism turns.
program cost
  use gestell_api_numerics, only: accuracy_type, dp, error_type, evidence, evidence_type, floquet_type, frame_type, linkage_type, &
    & multipliers_type, new_frame, periodic_solution_type, pi, solve_floquet, solve_multipliers, solve_periodic, &
    & stiffness_matrix, support_type
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)

  integer, parameter :: per_decade = 4, most_links = 20
  real(dp), parameter :: seconds = 0.1_dp, usual = 1.0e-9_dp
  real(dp), parameter :: speeds(3) = [240.0_dp, 20.0_dp, 1.0_dp]
  character(len=*), parameter :: names(3) = [character(len=7) :: "240 rpm", "20 rpm", "1 rpm"]
  type(frame_type) :: frame
  integer :: i, k

  print "(a)", "family,series,x,seconds,evaluations,way"
  do i = 0, 6 * per_decade
    call build(3, speed_of(10.0_dp**(real(i, dp) / per_decade)), frame)
    call measure("turns", "multipliers", turns_of(frame), frame, usual, .false.)
    call measure("turns", "x0", turns_of(frame), frame, usual, .true.)
  end do
  do i = 2, most_links
    call build(i, 240.0_dp, frame)
    call measure("links", "multipliers", real(i, dp), frame, usual, .false.)
    call measure("links", "x0", real(i, dp), frame, usual, .true.)
    call measure_building(i)
  end do
  do k = 1, size(speeds)
    call build(3, speeds(k), frame)
    do i = 3, 13
      call measure("tolerance", trim(names(k)), 10.0_dp**(-i), frame, 10.0_dp**(-i), .true.)
    end do
  end do

contains

  !> The crank speed (rpm) at which w_max T of the four-bar is `turns`: they are inversely proportional but for the part of
  !> the coefficients that the speed brings.
  real(dp) function speed_of(turns) result(speed)
    real(dp), intent(in) :: turns
    type(frame_type) :: slow

    call build(3, 1.0_dp, slow)
    speed = turns_of(slow) / turns
  end function speed_of

  real(dp) function turns_of(frame)
    type(frame_type), intent(in) :: frame
    type(survey_type) :: survey
    type(error_type), allocatable :: error

    call survey_system(frame, survey, error)
    turns_of = survey%phase_advance
    if (allocated(error)) error stop error%message
  end function turns_of

  !> One line of the table. Where there is no result, none.
  subroutine measure(family, series, x, frame, tolerance, forced)
    character(len=*), intent(in) :: family, series
    real(dp), intent(in) :: x, tolerance
    type(frame_type), intent(in) :: frame
    logical, intent(in) :: forced
    type(floquet_type) :: floquet
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: start
    type(evidence_type) :: found
    type(error_type), allocatable :: error
    integer(int64) :: begin, since, now, rate
    real(dp) :: shortest

    shortest = huge(shortest)
    call system_clock(begin, rate)
    do
      call system_clock(since)
      call solve_floquet(frame, accuracy_type(tolerance=tolerance), forced, floquet, error)
      if (.not. allocated(error)) call solve_multipliers(floquet, .false., multipliers, error)
      if (.not. allocated(error) .and. forced) call solve_periodic(floquet, start, error)
      call system_clock(now)
      if (allocated(error)) return
      shortest = min(shortest, real(now - since, dp) / rate)
      if (now - begin > seconds * rate) exit
    end do
    call evidence(floquet, found)
    if (found%angles > 0) found%methods = "reduced"
    print "(4a, 2(es12.5, ','), i0, 2a)", family, ",", series, ",", x, shortest, found%evaluations, ",", found%methods
  end subroutine measure

  subroutine measure_building(links)
    integer, intent(in) :: links
    type(frame_type) :: frame
    integer(int64) :: begin, since, now, rate
    real(dp) :: shortest

    shortest = huge(shortest)
    call system_clock(begin, rate)
    do
      call system_clock(since)
      call build(links, 240.0_dp, frame)
      call system_clock(now)
      shortest = min(shortest, real(now - since, dp) / rate)
      if (now - begin > seconds * rate) exit
    end do
    print "(a, 2(es12.5, ','), a)", "links,frame,", real(links, dp), shortest, "0,"
  end subroutine measure_building

  !> The four-bar of data/khang_four_bar.nml with the first `links` of its links; from the fourth on couplers and rockers of a
  !> row of equal rockers, each driven by the one before.
  subroutine build(links, rpm, frame)
    integer, intent(in) :: links
    real(dp), intent(in) :: rpm
    type(frame_type), intent(out) :: frame
    real(dp), parameter :: coupler = 0.37_dp, rocker = 0.16_dp, apart = 0.20_dp
    type(linkage_type) :: linkage
    type(support_type) :: supports(4)
    type(error_type), allocatable :: error
    character(len=4) :: from, to, pivot
    integer :: i

    call linkage%ground("A0", [0.0_dp, 0.0_dp], error)
    call linkage%crank("A", "A0", 0.07_dp, 0.0_dp, error)
    call linkage%link("crank", "A0", "A", 0.50_dp, 0.0035_dp, [0.03_dp, 0.0_dp], error)
    from = "A"
    do i = 1, links / 2
      write (to, "('B', i0)") i
      write (pivot, "('P', i0)") i
      call linkage%ground(pivot, [0.40_dp + (i - 1) * apart, 0.0_dp], error)
      call linkage%rrr(to, [from, pivot], [merge(coupler, apart, i == 1), rocker], 1, error)
      call linkage%link("coupler " // to, from, to, 0.60_dp, 0.0070_dp, [merge(0.18_dp, 0.1_dp, i == 1), 0.0_dp], error)
      if (2 * i + 1 <= links) call linkage%link("rocker " // to, pivot, to, 0.25_dp, 0.0060_dp, [0.08_dp, 0.0_dp], error)
      from = to
    end do
    do i = 1, 4
      supports(i) = support_type(position=[-0.5_dp + 0.2_dp * i, -0.20_dp], stiffness=[196133.0_dp, 196133.0_dp])
    end do
    call new_frame(frame, linkage, 18.0_dp, 0.78_dp, [-0.20_dp, 0.20_dp], stiffness_matrix(supports), &
      & reshape([0.5_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.5_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.05_dp], [3, 3]), rpm * pi / 30, error)
    if (allocated(error)) error stop error%message
  end subroutine build

end program cost
