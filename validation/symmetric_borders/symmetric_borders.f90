!> Borders of stability of random symmetric engines by the exact frame (task boundary) against fine scans of verdicts by equations
!> of their own:
!>
!>     fpm run symmetric_borders --directory validation --profile release -- [ENGINES [FIRST [SPEEDS]]]
!>
!> Each of ENGINES engines (default 50) from number FIRST (default 1) on is scanned at SPEEDS speeds (default 400) over a range
!> about a natural frequency, where twice that is twice the crank's speed, or half the sum of two. Where the scan follows a
!> vibration and its verdict changes from one speed to the next, a border must be listed between these two; a place that is listed
!> as open is counted. Stops with an error if a border is lost.
program symmetric_borders
  use boundary_families, only: machine_family
  use engine_judge, only: natural_frequencies, scan
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_input_namelist, only: parse_document
  use gestell_input_schema_check, only: check_document
  use gestell_study_frame_model_settled_family, only: settled_family_type
  use gestell_study_grid, only: axis_type, grid_type
  use gestell_task_boundary_line_borders, only: border_accuracy, border_type, open_border_type
  use gestell_task_boundary_branches, only: turning_point
  use gestell_task_boundary_solution, only: border_results_type, solve_borders
  use gestell_task_boundary_line, only: border_options
  use gestell_task_registry, only: input_schema
  use reference_random, only: random_type
  use symmetric_engine, only: engine_type, input_of, kinds, new_engine
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none (type, external)

  integer :: engines, first, points, i, changes, lost, open, extra, listed

  engines = argument(1, 50)
  first = argument(2, 1)
  points = argument(3, 400)
  changes = 0
  lost = 0
  open = 0
  extra = 0
  listed = 0
  do i = first, first + engines - 1
    call compare(i)
  end do
  print "(a, i0, a, i0, a)", "Engines ", first, " to ", first + engines - 1, ":"
  print "(i0, a)", listed, " borders listed, turning points apart"
  print "(i0, a, i0, a)", changes, " changes of the verdict between neighbours of the scans (", points, " speeds each)"
  print "(i0, a, i0, a)", lost, " of them without a border, ", open, " of them in places that are listed as open"
  print "(i0, a)", extra, " borders across which the scan's verdict does not change"
  if (lost > 0) error stop 1, quiet=.true.

contains

  integer function argument(place, default)
    integer, intent(in) :: place, default
    character(len=20) :: word
    integer :: status

    argument = default
    call get_command_argument(place, word)
    if (word == "") return
    read (word, *, iostat=status) argument
    if (status /= 0 .or. argument < 1) error stop "usage: symmetric_borders [ENGINES [FIRST [SPEEDS]]]"
  end function argument

  !> A range about one of the places where two multipliers meet at 1, which lies anywhere in it.
  function range_of(number, engine) result(range)
    integer, intent(in) :: number
    type(engine_type), intent(in) :: engine
    real(dp) :: range(2), f(3), places(6), width
    integer, parameter :: sequence = 48
    type(random_type) :: random

    call random%start(number, sequence)
    f = natural_frequencies(engine)
    places = 60 * [f(1), f(2), f(3), (f(1) + f(2)) / 2, (f(1) + f(3)) / 2, (f(2) + f(3)) / 2]
    width = random%between(0.02_dp, 0.08_dp)
    range(1) = places(1 + modulo(number - 1, 6)) * (1 - width * random%between(0.1_dp, 0.9_dp))
    range(2) = range(1) * (1 + width)
  end function range_of

  subroutine compare(number)
    integer, intent(in) :: number
    type(engine_type) :: engine
    type(machine_family) :: family
    type(settled_family_type) :: settled
    type(border_options) :: options
    type(border_results_type) :: results
    type(border_type), allocatable :: borders(:)
    type(open_border_type), allocatable :: places(:)
    type(error_type), allocatable :: error
    real(dp) :: range(2), speeds(points), growth(points)
    logical :: known(points), joined(points)
    integer :: k, n, own(4)

    call new_engine(number, engine)
    range = range_of(number, engine)
    call parse_document(input_of(engine, range), "engine.nml", family%doc, error)
    if (.not. allocated(error)) call check_document(family%doc, input_schema(), error)
    family%paths(1) = "drive.speed_rpm"
    allocate(settled%inner, source=family)
    settled%accuracy = accuracy_type(tolerance=border_accuracy)
    options%accuracy = settled%accuracy
    if (.not. allocated(error)) call solve_borders(settled, grid_type([axis_type(range(1), range(2), 20)]), options, &
      & [real(dp) ::], results, error, family)
    if (allocated(error)) then
      print "(i5, 2a)", number, " refused: ", error%message
      lost = lost + 1
      return
    end if
    speeds = [(range(1) + (range(2) - range(1)) * (k - 1) / (points - 1), k = 1, points)]
    call scan(engine, speeds, growth, known, joined)
    borders = pack(results%values, results%values%kind /= turning_point)
    places = results%rest%places
    own = 0
    do k = 2, points
      if (.not. joined(k)) cycle
      n = count(borders%value + borders%error >= speeds(k - 1) .and. borders%value - borders%error <= speeds(k))
      if ((growth(k) > 0) .neqv. (growth(k - 1) > 0)) then
        own(1) = own(1) + 1
        if (n > 0) cycle
        if (any(places%value + places%width / 2 >= speeds(k - 1) .and. &
          & places%value - places%width / 2 <= speeds(k))) then
          own(3) = own(3) + 1
        else
          own(2) = own(2) + 1
          print "(i5, a, 2f14.6, 2es12.4)", number, " lost between", speeds(k - 1:k), growth(k - 1:k)
        end if
      else if (n == 1) then
        own(4) = own(4) + 1
      end if
    end do
    changes = changes + own(1)
    lost = lost + own(2)
    open = open + own(3)
    extra = extra + own(4)
    listed = listed + size(borders)
    print "(i5, 1x, a, 2f10.3, i4, a, i4, a, i3, a, i3, a, i3, a, i5, a)", number, kinds(engine%kind), range, size(borders), &
      & " borders", own(1), " changes", own(2), " lost", size(places), " open", own(4), " extra", count(.not. known), &
      & " unknown"
    flush (output_unit)
  end subroutine compare

end program symmetric_borders
