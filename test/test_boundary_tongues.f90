!> Narrow tongues of parametric resonance are all found, for any search points.
module test_boundary_tongues
  use boundary_families, only: machine_family, mathieu_family, new_machine_family
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: stable => stable_number, unstable => unstable_number
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_task_boundary_line_borders, only: border_accuracy, border_rest_type, border_type, find_borders
  use gestell_task_boundary_line, only: line_type
  use gestell_task_boundary_line_search_result, only: search_type
  use gestell_task_boundary_line_search, only: range_nodes, search_line
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type, grid_type, tile_type
  use gestell_study_point, only: sweep_options
  use gestell_task_sweep, only: solve_tile
  use gestell_study_tile_results, only: tile_results_type, verdict
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use weakly_damped, only: new_weak_family, weak_family
  implicit none (type, external)
  private

  public :: collect_boundary_tongues

contains

  subroutine collect_boundary_tongues(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_slow("10, 40 and 160 search points find the same seven tongues of two dyads", test_dyads), &
      & new_slow("10 and 40 search points find the same nine tongues of a four-bar", test_four_bar), &
      & new_slow("10 and 160 search points find the same eighteen tongues of two sliders", test_sliders), &
      & new_unittest("meetings of multipliers that were not examined are reported as open", test_unexamined_meetings), &
      & new_unittest("borders of random machines over stiffness and mass agree with dense sweeps", test_sweeps)]
  end subroutine collect_boundary_tongues

  !> The lowest and the highest unstable speed of each tongue among 1000001 equidistant speeds (task `sweep`).
  subroutine test_dyads(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tongues(2, 7) = reshape([-26916.271964091575_dp, -26959.424898986064_dp, -28821.64562918751_dp, &
      & -28829.531444701224_dp, -32306.555443361347_dp, -33862.76272154451_dp, -35797.78121162719_dp, -35809.60993489776_dp, &
      & -43117.71644542169_dp, -43495.68796400261_dp, -53508.62919573038_dp, -53537.36131058821_dp, -54033.656570279985_dp, &
      & -54090.463648702855_dp], [2, 7])
    type(axis_type), parameter :: axis = axis_type(-24396.242789787837_dp, -60904.64794587015_dp, 40)

    call check_tongues("test/tongues/dyads.nml", axis, [10, 40, 160], tongues, 14, error)
  end subroutine test_dyads

  subroutine test_four_bar(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tongues(2, 9) = reshape([4.9041676909826055_dp, 4.911551830260385_dp, 5.390562636234214_dp, &
      & 5.390720465165342_dp, 5.551503052004568_dp, 5.551683427925858_dp, 5.715622593387646_dp, 5.720526563747699_dp, &
      & 5.795630587974521_dp, 5.796047707292502_dp, 6.525792317353503_dp, 6.530910484120085_dp, 8.32614693473191_dp, &
      & 8.329032949472538_dp, 10.771165094798182_dp, 10.792438180015235_dp, 11.580748597019847_dp, 11.603521057082617_dp], [2, 9])
    type(axis_type), parameter :: axis = axis_type(3.9787377533129034_dp, 15.25223283389254_dp, 40)

    call check_tongues("test/tongues/four_bar.nml", axis, [10, 40], tongues, 18, error)
  end subroutine test_four_bar

  !> The last tongue reaches beyond the range.
  subroutine test_sliders(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tongues(2, 18) = reshape([1187.6264604512176_dp, 1188.2055942713075_dp, 1222.8975782683135_dp, &
      & 1223.1310999699629_dp, 1395.4327523148127_dp, 1395.5681949017694_dp, 1440.94146153221_dp, 1441.5999927308608_dp, &
      & 1587.34088673013_dp, 1587.3689093343278_dp, 1611.4590080764601_dp, 1611.9447332158902_dp, 1779.5432584895252_dp, &
      & 1782.6444266874269_dp, 1865.5726533770926_dp, 1865.6800733598511_dp, 2117.3464112272004_dp, 2120.013229060034_dp, &
      & 2149.6284512631864_dp, 2167.474179703219_dp, 2231.258297291683_dp, 2348.1639315713082_dp, 2412.611250792456_dp, &
      & 2426.1695207902085_dp, 2792.1073681425805_dp, 2811.7792362895093_dp, 3172.556254035433_dp, 3208.1963361411354_dp, &
      & 3382.4175368735414_dp, 3740.9340645475004_dp, 4190.734225396135_dp, 4640.721203606088_dp, 4660.154879617336_dp, &
      & 5011.002554609135_dp, 5365.198930802585_dp, 5809.987715933827_dp], [2, 18])
    type(axis_type), parameter :: axis = axis_type(1139.553682949712_dp, 5809.987715933827_dp, 40)

    call check_tongues("test/tongues/sliders.nml", axis, [10, 160], tongues, 35, error)
  end subroutine test_sliders

  !> Searches with as many search points as `counts` lists: it must find `number` borders, each at the end of one of the
  !> `tongues`, within a step of the sweep.
  subroutine check_tongues(file, axis, counts, tongues, number, error)
    character(len=*), intent(in) :: file
    type(axis_type), intent(in) :: axis
    integer, intent(in) :: counts(:), number
    real(dp), intent(in) :: tongues(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(machine_family) :: machine
    type(gestell_error), allocatable :: failure
    type(border_type), allocatable :: borders(:)
    type(border_rest_type) :: rest
    type(axis_type) :: own
    real(dp) :: ends(2 * size(tongues, 2)), step
    integer :: k

    call new_machine_family(file, ["drive.speed_rpm"], machine, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    own = axis
    ends = reshape(tongues, [size(ends)])
    step = abs(axis%to - axis%from) / 1000000
    do k = 1, size(counts)
      own%count = counts(k)
      call find_borders(machine, own, accuracy_type(tolerance=border_accuracy), 1.0e-10_dp, borders, failure, rest)
      call check_success(error, failure)
      if (allocated(error)) return
      call check(error, size(borders), number)
      if (allocated(error)) return
      ! At the border's error verdicts distinguish its sides.
      call check_that(error, abs(borders%value - ends(:number)), "<=", step + borders%error, "ends of tongues")
      if (allocated(error)) return
      call check(error, size(rest%places), 0, more="open places")
      if (allocated(error)) return
    end do
  end subroutine check_tongues

  !> y'' + 1e-3 y' + (a - 0.2 cos 2t) y = 0 over a: multipliers meet at a = k**2, k = 1, ... 14, ever more slowly; only the
  !> tongues at 1 and 4 exist (that at 9 would begin at q**3 / 32 = 2 d sqrt(a), half of the width of a3 - b3). Six of the 14
  !> places are examined, those where the phases separate most slowly (within a tongue they do not separate).
  subroutine test_unexamined_meetings(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: looked_at = 6, all_places = 14
    type(mathieu_family), target :: family
    type(line_type) :: line
    type(search_type) :: search
    type(gestell_error), allocatable :: failure
    integer :: i, k

    family = mathieu_family(q=0.1_dp, d=1.0e-3_dp)
    line%family => family
    line%axes = [axis_type(0.5_dp, 200.0_dp, 10)]
    line%start = [0.0_dp]
    line%direction = [1.0_dp]
    line%accuracy = accuracy_type(tolerance=border_accuracy)
    do i = 1, 2
      if (i == 2) line%most_meetings = looked_at
      call search_line(line, range_nodes(10), search, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      if (i == 1) then
        call check_that(error, search%meetings, ">=", all_places, "meetings")
        call check_that(error, search%left_out, "==", 0, "unexamined places")
        call check_that(error, size(search%open_parts), "==", 0, "doubts")
        if (.not. allocated(error)) call check(error, size(search%borders), 4)
      else
        call check(error, search%meetings, looked_at)
        ! Places that were not examined are reported as open; the others are known tongues.
        do k = 1, all_places - looked_at
          if (allocated(error)) return
          associate (t => (k**2 - 0.5_dp) / 199.5_dp)
            call check(error, any(abs(search%open_parts%t - t) <= search%open_parts%width / 2) .or. &
              & count(abs(search%borders%t - t) < 1.0e-3_dp) == 2, more="an unexamined place that is not reported")
          end associate
        end do
      end if
      if (allocated(error)) return
    end do
  end subroutine test_unexamined_meetings

  !> No point of a sweep contradicts the borders, and there are as many as with four times the search points.
  subroutine test_sweeps(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: numbers(3) = [8, 18, 39], borders_of(3) = [6, 6, 14]
    type(weak_family) :: family
    type(border_type), allocatable :: borders(:)
    type(gestell_error), allocatable :: failure
    type(axis_type) :: axis
    integer :: k

    do k = 1, size(numbers)
      call new_weak_family(numbers(k), family)
      axis = family%axis
      axis%count = 10
      call find_borders(family, axis, accuracy_type(tolerance=border_accuracy), 1.0e-10_dp, borders, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call check(error, size(borders), borders_of(k))
      if (.not. allocated(error)) call check_against_sweep(family, axis, borders, error)
      if (allocated(error)) return
    end do
  end subroutine test_sweeps

  subroutine check_against_sweep(family, axis, borders, error)
    class(family_type), intent(in) :: family
    type(axis_type), intent(in) :: axis
    type(border_type), intent(in) :: borders(:)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 4000
    type(grid_type) :: grid
    type(tile_type) :: tile
    type(sweep_options) :: options
    type(tile_results_type) :: results
    type(gestell_error), allocatable :: failure
    character(len=30) :: words
    integer :: k, i, first
    logical :: inside

    grid%axes = [axis_type(axis%from, axis%to, points)]
    options%accuracy = accuracy_type(tolerance=1.0e-10_dp)
    options%columns = .false.
    options%columns(verdict) = .true.
    do k = 1, grid%tiles()
      tile = grid%tile(k)
      first = tile%first(1)
      call solve_tile(family, grid, tile, options, results, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      do i = 1, size(results%values, 3)
        associate (value => grid%axes(1)%value(first + i - 1), found => nint(results%values(1, 1, i)))
          inside = mod(count(borders%value < value), 2) == 1 .neqv. borders(1)%below == "unstable"
          write (words, "(g0)") value
          call check(error, .not. (inside .and. found == stable) .and. .not. (.not. inside .and. found == unstable), &
            & more="the sweep contradicts the borders at " // words)
          if (allocated(error)) return
        end associate
      end do
    end do
  end subroutine check_against_sweep

end module test_boundary_tongues
