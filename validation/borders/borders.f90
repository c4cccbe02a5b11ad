!> Borders of stability of random weakly damped machines against dense sweeps:
!>
!>     fpm run borders --directory validation --profile release -- [MACHINES [FIRST [POINTS [COUNT]]]]
!>
!> Each of MACHINES families (default 20) from number FIRST (default 1) on is swept over POINTS values (default 1e6): what is
!> unstable in an interval wider than their distance is seen, whatever it comes from. The search has COUNT search points
!> (default 10). Stops with an error where it disagrees with the sweep at a point that lies farther from all borders than
!> their errors.
program borders
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: stable => stable_number, unstable => unstable_number
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_task_boundary_line_borders, only: border_accuracy, border_rest_type, border_type, find_borders
  use gestell_study_grid, only: axis_type, grid_type
  use gestell_study_point, only: sweep_options
  use gestell_task_sweep, only: solve_tile
  use gestell_study_tile_results, only: tile_results_type, verdict
  use weakly_damped, only: new_weak_family, parameters, weak_family
  use, intrinsic :: iso_fortran_env, only: int64, output_unit
  implicit none (type, external)

  integer :: machines, first, points, search_points, i, total, missed, invented, questions
  real(dp) :: search_time

  machines = argument(1, 20)
  first = argument(2, 1)
  points = argument(3, 1000000)
  search_points = argument(4, 10)
  total = 0
  missed = 0
  invented = 0
  questions = 0
  search_time = 0
  do i = first, first + machines - 1
    call compare(i)
  end do
  print "(a, i0, a, i0, a)", "Families ", first, " to ", first + machines - 1, ":"
  print "(i0, a, i0, a)", total, " borders from ", search_points, " search points"
  print "(i0, a, i0, a)", missed, " unstable intervals of the sweeps (", points, " points each) without them"
  print "(i0, a)", invented, " intervals that are unstable by the borders only"
  print "(i0, a)", questions, " places said to be open"
  print "(a, f0.3, a)", "Seconds per search: ", search_time / machines, " in the mean"
  if (missed + invented > 0) error stop 1, quiet=.true.

contains

  integer function argument(place, default)
    integer, intent(in) :: place, default
    character(len=20) :: word
    integer :: status

    argument = default
    call get_command_argument(place, word)
    if (word == "") return
    read (word, *, iostat=status) argument
    if (status /= 0 .or. argument < 1) error stop "usage: borders [MACHINES [FIRST [POINTS [COUNT]]]]"
  end function argument

  subroutine compare(number)
    integer, intent(in) :: number
    type(weak_family) :: family
    type(axis_type) :: axis
    type(grid_type) :: grid
    type(border_type), allocatable :: found(:)
    type(border_rest_type) :: rest
    type(error_type), allocatable :: error
    integer, allocatable :: verdicts(:)
    integer(int64) :: ticks(2), rate
    integer :: m, n

    call new_weak_family(number, family)
    axis = family%axis
    axis%count = search_points
    call system_clock(ticks(1), rate)
    call find_borders(family, axis, accuracy_type(tolerance=border_accuracy), 1.0e-10_dp, found, error, rest)
    call system_clock(ticks(2))
    if (allocated(error)) then
      print "(i0, 2a)", number, " refused: ", error%message
      return
    end if
    search_time = search_time + real(ticks(2) - ticks(1), dp) / real(rate, dp)
    axis%count = points
    grid%axes = [axis]
    call sweep(family, grid, verdicts)
    call differences(number, axis, found, verdicts, m, n)
    total = total + size(found)
    missed = missed + m
    invented = invented + n
    questions = questions + size(rest%places)
    print "(i5, 1x, a, i5, a, i5, a, i6, a, i5, a, i5, a, f8.2, a)", number, parameters(family%parameter), size(found), &
      & " borders", m + n, " differ", rest%meetings, " meetings", rest%thin, " thin", size(rest%places), " open", &
      & real(ticks(2) - ticks(1), dp) / real(rate, dp), " s"
    do m = 1, size(rest%places)
      print "(5x, a, 2es24.15)", "open ", rest%places(m)%value, rest%places(m)%width
    end do
    flush (output_unit)
  end subroutine compare

  subroutine sweep(family, grid, verdicts)
    type(weak_family), intent(in) :: family
    type(grid_type), intent(in) :: grid
    integer, allocatable, intent(out) :: verdicts(:)
    type(sweep_options) :: options
    type(tile_results_type) :: results
    type(error_type), allocatable :: error
    integer :: k

    options%accuracy = accuracy_type(tolerance=1.0e-10_dp)
    options%columns = .false.
    options%columns(verdict) = .true.
    allocate(verdicts(grid%axes(1)%count))
    do k = 1, grid%tiles()
      associate (tile => grid%tile(k))
        call solve_tile(family, grid, tile, options, results, error)
        if (allocated(error)) error stop "a sweep that failed"
        verdicts(tile%first(1):tile%last(1)) = nint(results%values(1, 1, :))
      end associate
    end do
  end subroutine sweep

  !> Runs of points that only the sweep, or only the borders call unstable.
  subroutine differences(number, axis, found, verdicts, missing, additional)
    integer, intent(in) :: number, verdicts(:)
    type(axis_type), intent(in) :: axis
    type(border_type), intent(in) :: found(:)
    integer, intent(out) :: missing, additional
    logical :: inside, differs, run
    integer :: i, k, first_of_run, last_of_run

    missing = 0
    additional = 0
    inside = verdicts(1) == unstable
    if (size(found) > 0) inside = merge(found(1)%below, found(1)%above, axis%to > axis%from) == "unstable"
    k = 1
    run = .false.
    first_of_run = 1
    last_of_run = 1
    do i = 1, size(verdicts)
      do while (k <= size(found))
        if ((found(k)%value - axis%value(i)) * (axis%to - axis%from) > 0) exit
        inside = .not. inside
        k = k + 1
      end do
      differs = (inside .and. verdicts(i) == stable) .or. (.not. inside .and. verdicts(i) == unstable)
      if (size(found) > 0 .and. differs) differs = all(abs(found%value - axis%value(i)) > 2 * found%error)
      if (differs .and. .not. run) first_of_run = i
      if (run .and. .not. differs) call end_run(number, axis, verdicts, first_of_run, last_of_run, missing, additional)
      if (differs) last_of_run = i
      run = differs
    end do
    if (run) call end_run(number, axis, verdicts, first_of_run, last_of_run, missing, additional)
  end subroutine differences

  !> Counts the run of points from `first` to `last`, and prints the first ones.
  subroutine end_run(number, axis, verdicts, first, last, missing, additional)
    integer, intent(in) :: number, verdicts(:), first, last
    type(axis_type), intent(in) :: axis
    integer, intent(inout) :: missing, additional

    if (verdicts(last) == unstable) missing = missing + 1
    if (verdicts(last) == stable) additional = additional + 1
    if (missing + additional <= 4) print "(i5, 1x, a, es23.15, a, es23.15, i8, a)", number, &
      & merge("missed  ", "invented", verdicts(last) == unstable), axis%value(first), " to", axis%value(last), &
      & last - first + 1, " points"
  end subroutine end_run

end program borders
