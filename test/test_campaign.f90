!> The way from an input to the members of its family, and from tiles to the table.
module test_campaign
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: failure_type => error_type, impossible_mechanism, invalid_input, wrong_usage
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: stable => stable_number, unstable => unstable_number
  use gestell_task_sweep_checkpoint, only: campaign_type, open_campaign
  use gestell_input_schema_check, only: check_document
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_configuration
  use gestell_input_namelist_document, only: document_type
  use gestell_base_files, only: file_size, remove_file, remove_folder
  use gestell_input_schema_path, only: set_value
  use gestell_input_namelist, only: parse_document
  use gestell_output_table_scientific, only: number_width, put_number
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_summary, only: summary_type
  use gestell_model_frame, only: frame_type
  use gestell_system_family, only: family_type
  use gestell_study_grid, only: axis_type, new_axis, new_grid, tile_type
  use gestell_study_tile_results, only: rho_max, tile_results_type, verdict
  use gestell_system_periodic, only: periodic_system
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_negative_inf, ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: collect_campaign

  character(len=*), parameter :: machine = "&drive speed_rpm=240/ &joint name='A0' type='ground' position=0,0/" &
    & // "&joint name='B0' type='ground' position=0.4,0/ &joint name='A' type='crank' pivot='A0' radius=0.07/" &
    & // "&joint name='B' type='RRR' ends='A','B0' lengths=0.37,0.16 branch=1/" &
    & // "&link name='crank' from='A0' to='A' mass=0.5 inertia=0.0035 center=0.03,0/" &
    & // "&link name='coupler' from='A' to='B' mass=0.6 inertia=0.007 center=0.18,0/" &
    & // "&frame mass=18 inertia=0.78 origin=-0.2,0.2/ &units stiffness='N/cm'/" &
    & // "&support position=-0.3,-0.2 stiffness=1961,1961/ &support position=0.3,-0.2 stiffness=1961,1961 angle=10/"
  character(len=*), parameter :: folder = "build/test_campaign"

contains

  subroutine collect_campaign(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("numbers are written exactly as the compiler writes them", test_numbers), &
      & new_unittest("a family member equals the machine read with --set, bit by bit", test_members), &
      & new_unittest("members without assembly and members with invalid data are told apart", test_impossible), &
      & new_unittest("tiles finished in any order form a table in grid order", test_table), &
      & new_unittest("blocks of another input are refused and left unchanged", test_foreign), &
      & new_unittest("if two inputs start in one folder at once the second is refused", test_two_inputs), &
      & new_unittest("a run learns that another run has finished the same sweep", test_finished_by_other_run), &
      & new_unittest("blocks replaced by those of another input do not enter the table", test_replaced)]
  end subroutine collect_campaign

  !> Comparison with the compiler's output: numbers of all sizes, integers over powers of two, which are ties at the 17th digit,
  !> powers of ten and their neighbours.
  subroutine test_numbers(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: special(*) = [0.0_dp, -0.0_dp, 1.0_dp, 9.9999999999999999e22_dp, 1.0e300_dp, huge(1.0_dp), &
      & tiny(1.0_dp), 0.1_dp, 5.0e-1_dp, 123456789012345675.0_dp, 1.5_dp]
    integer, parameter :: count = 40000
    real(dp) :: u(2), x
    integer :: i

    do i = 1, size(special)
      call check_number(error, special(i))
    end do
    call check_number(error, ieee_value(x, ieee_quiet_nan))
    call check_number(error, ieee_value(x, ieee_negative_inf))
    do i = 1, count
      if (allocated(error)) return
      call random_number(u)
      select case (mod(i, 4))
      case (0)
        x = (u(1) - 0.5_dp) * 10.0_dp**(600 * (u(2) - 0.5_dp))
      case (1)
        x = nint(100000 * u(1)) * 2.0_dp**nint(120 * (u(2) - 0.5_dp))
      case (2)
        x = nearest(10.0_dp**nint(600 * (u(1) - 0.5_dp)), u(2) - 0.5_dp)
      case default
        x = u(1)
      end select
      call check_number(error, x)
    end do
    call random_number(u)
    call check_number(error, u(1) * tiny(x))
  end subroutine test_numbers

  subroutine check_number(error, x)
    type(error_type), allocatable, intent(inout) :: error
    real(dp), intent(in) :: x
    character(len=:), allocatable :: line
    character(len=number_width) :: word
    integer :: n

    if (allocated(error)) return
    allocate(character(len=2 * number_width) :: line)
    n = 3
    line(:n) = "abc"
    call put_number(line, n, x)
    write (word, "(es24.16e3)") x
    call check(error, line(:n), "abc" // trim(adjustl(word)))
  end subroutine check_number

  !> A family member and a machine that is read from the input with the same values set agree to the last bit.
  subroutine test_members(error)
    type(error_type), allocatable, intent(out) :: error

    call compare(error, "drive.speed_rpm", "-300.5", "support.stiffness", "1234.5")
    call compare(error, "support(2).angle", "77", "frame.origin(2)", "0.3")
    call compare(error, "foundation.damping(2)", "7", "support.damping", "3")
    call compare(error, "link(coupler).mass", "0.7", "frame.mass", "20")
    call compare(error, "joint(B).lengths(1)", "0.38", "joint(A).phase", "30")
    call compare(error, "link.inertia", "0.01", "frame.inertia", "0.5")
  end subroutine test_members

  subroutine compare(error, path1, value1, path2, value2)
    type(error_type), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: path1, value1, path2, value2
    type(configuration_type) :: swept, anew
    class(periodic_system), allocatable :: system
    type(failure_type), allocatable :: failure
    real(dp) :: parameters(2)
    real(dp), dimension(3, 3) :: m, b, c, m2, b2, c2
    real(dp) :: h(3), h2(3)
    integer :: k

    if (allocated(error)) return
    call configure(machine // "&sweep parameter='" // path1 // "', from=" // value1 // " count=1/ &sweep parameter='" // path2 &
      & // "' from=1 to=2 count=9/ &case tasks='sweep'/", "", "", swept, failure)
    if (.not. allocated(failure)) call configure(machine, path1 // "=" // value1, path2 // "=" // value2, anew, failure)
    read (value1, *) parameters(1)
    read (value2, *) parameters(2)
    if (.not. allocated(failure)) call swept%plan%family%member(parameters, system, failure)
    if (allocated(failure)) then
      call test_failed(error, path1 // ", " // path2 // ": " // failure%message)
      return
    end if
    select type (system)
    type is (frame_type)
      do k = 0, 2
        call system%matrices(0.1_dp * k * system%period, m, b, c)
        call system%load(0.1_dp * k * system%period, h)
        call anew%frame%matrices(0.1_dp * k * anew%frame%period, m2, b2, c2)
        call anew%frame%load(0.1_dp * k * anew%frame%period, h2)
        call check_that(error, [abs(m - m2), abs(b - b2), abs(c - c2), abs(h - h2)], "<=", 0.0_dp, path1 // ", " // path2)
      end do
      call check_that(error, abs(system%speed - anew%frame%speed), "<=", 0.0_dp, "speed")
    class default
      call test_failed(error, "a member is no frame")
    end select
  end subroutine compare

  !> An input with up to two values set.
  subroutine configure(text, set1, set2, configuration, failure)
    character(len=*), intent(in) :: text, set1, set2
    type(configuration_type), intent(out) :: configuration
    type(failure_type), allocatable, intent(out) :: failure
    type(document_type) :: doc

    call parse_document(text, "in.nml", doc, failure)
    if (.not. allocated(failure) .and. set1 /= "") call set_value(doc, input_schema(), set1, failure)
    if (.not. allocated(failure) .and. set2 /= "") call set_value(doc, input_schema(), set2, failure)
    if (.not. allocated(failure)) call check_document(doc, input_schema(), failure)
    if (.not. allocated(failure)) call read_configuration(doc, configuration, failure)
  end subroutine configure

  !> A member without assembly and a member with invalid data have different errors. The shared mechanism of a family may itself
  !> be impossible.
  subroutine test_impossible(error)
    type(error_type), allocatable, intent(out) :: error
    type(configuration_type) :: configuration
    class(periodic_system), allocatable :: system
    class(family_type), allocatable :: first, second
    type(failure_type), allocatable :: failure

    call configure(machine // "&sweep parameter='joint(B).lengths(1)' from=0.3 to=0.4 count=3/ &case tasks='sweep'/" &
      & // "&sweep parameter='frame.mass' from=1 to=20 count=3/", "", "", configuration, failure)
    ! Tasks and threads have copies of copies.
    if (.not. allocated(failure)) allocate(first, source=configuration%plan%family)
    allocate(second, source=first)
    call second%member([0.3_dp, 9.0_dp], system, failure)
    call check_failure(error, failure, code=impossible_mechanism)
    call second%member([-0.3_dp, 9.0_dp], system, failure)
    call check_failure(error, failure, code=invalid_input)
    if (allocated(error)) return
    call check_that(error, failure%message, "==", "joint(B).lengths(1) = -0.3: must be positive")
    if (allocated(error)) return

    call configure(machine // "&sweep parameter='frame.mass' from=10 to=20 count=3/ &case tasks='sweep'/", &
      & "joint(B).lengths(1)=0.3", "", configuration, failure)
    call check_success(error, failure, "the machine cannot turn")
    call check_that(error, allocated(configuration%impossible), "==", .true., "the machine cannot turn")
    if (allocated(error)) return
    call configuration%plan%family%member([15.0_dp], system, failure)
    call check_failure(error, failure, code=impossible_mechanism)
  end subroutine test_impossible

  !> Tiles in any order yield rows in the grid's order, wherever the tiles lie.
  subroutine test_table(error)
    type(error_type), allocatable, intent(out) :: error

    call one_table(error, [1, 1])
    call one_table(error, [300, 520])
    call one_table(error, [20, 1])
    call one_table(error, [1, 300])
    call one_table(error, [9000])
  end subroutine test_table

  subroutine one_table(error, counts)
    type(error_type), allocatable, intent(inout) :: error
    integer, intent(in) :: counts(:)
    type(sweep_plan_type) :: plan
    type(campaign_type) :: campaign
    type(summary_type) :: summary
    type(failure_type), allocatable :: failure
    character(len=200) :: line
    character(len=8) :: word
    real(dp) :: numbers(3)
    integer :: i, j, k, unit, status

    if (allocated(error)) return
    call new_plan(plan, counts)
    call open_campaign(campaign, folder, plan, 7_int64, failure)
    if (.not. allocated(failure)) call campaign%begin("# title" // new_line("a"), failure)
    do k = plan%grid%tiles(), 1, -1
      if (.not. allocated(failure)) call campaign%store(k, results_of(plan%grid%tile(k)), failure)
    end do
    if (.not. allocated(failure)) call open_campaign(campaign, folder, plan, 7_int64, failure)
    if (.not. allocated(failure)) call check_that(error, count(campaign%done), "==", size(campaign%done), "tiles done")
    if (.not. allocated(failure)) call check_that(error, count(campaign%damaged), "==", 0, "damaged tiles")
    if (.not. allocated(failure)) call campaign%finish(folder, summary, failure)
    if (.not. allocated(failure)) call campaign%clear()
    call check_success(error, failure)
    if (allocated(error)) return
    open (newunit=unit, file=folder // "/sweep.csv", action="read", status="old")
    read (unit, "(a)") line
    call check_that(error, trim(line), "==", "# title")
    read (unit, "(a)") line
    call check_that(error, trim(line), "==", """a(1,2)""," // trim(merge("b,", "  ", size(counts) == 2)) // "rho_max,verdict")
    do i = 1, counts(1)
      do j = 1, product(counts) / counts(1)
        read (unit, "(a)", iostat=status) line
        if (status /= 0) line = ",,,"
        numbers = 0
        read (line, *, iostat=status) numbers(:size(counts) + 1), word
        if (status /= 0 .or. nint(numbers(1)) /= i .or. nint(numbers(size(counts))) /= merge(j, i, size(counts) == 2) &
          & .or. nint(numbers(size(counts) + 1)) /= 1000 * i + j .or. word /= merge("unstable", "stable  ", j == 1)) then
          call test_failed(error, "wrong row: " // trim(line))
          close (unit)
          return
        end if
      end do
    end do
    read (unit, "(a)", iostat=status) line
    close (unit)
    call check_that(error, status, "/=", 0, "end of the file")
    call check_that(error, int([summary%points, summary%verdicts(unstable)]), "==", [product(counts), counts(1)], "summary")
    call check_that(error, int(summary%where(:size(counts))), "==", counts, "where the least is")
    call check_that(error, nint(summary%least), "==", 1001, "least")
    call check_that(error, int(file_size(folder // "/sweep.blocks/origin")), "<", 0, "size of the origin")
    call clear_folder
  end subroutine one_table

  subroutine new_plan(plan, counts)
    type(sweep_plan_type), intent(out) :: plan
    integer, intent(in) :: counts(:)
    type(axis_type) :: axes(size(counts))
    type(failure_type), allocatable :: failure
    integer :: k

    do k = 1, size(counts)
      call new_axis(axes(k), 1.0_dp, real(counts(k), dp), counts(k), .false., failure)
    end do
    call new_grid(plan%grid, axes, failure)
    allocate(character(len=6) :: plan%paths(size(counts)))
    plan%paths(1) = "a(1,2)"
    if (size(counts) > 1) plan%paths(2) = "b"
    plan%format = "csv"
    plan%units = spread(repeat(" ", 16), 1, size(counts))
    plan%options%columns = [(any(k == [rho_max, verdict]), k = 1, size(plan%options%columns))]
  end subroutine new_plan

  !> At point (i, j) the number 1000 i + j, unstable where j = 1.
  pure function results_of(tile) result(results)
    type(tile_type), intent(in) :: tile
    type(tile_results_type) :: results
    integer :: i, j

    allocate(results%values(2, tile%last(2) - tile%first(2) + 1, tile%last(1) - tile%first(1) + 1))
    do i = tile%first(1), tile%last(1)
      do j = tile%first(2), tile%last(2)
        results%values(:, j - tile%first(2) + 1, i - tile%first(1) + 1) = &
          & [1000.0_dp * i + j, real(merge(unstable, stable, j == 1), dp)]
      end do
    end do
  end function results_of

  !> Blocks of another input are refused, and stay.
  subroutine test_foreign(error)
    type(error_type), allocatable, intent(out) :: error
    type(sweep_plan_type) :: plan
    type(campaign_type) :: campaign
    type(failure_type), allocatable :: failure

    call new_plan(plan, [3, 4])
    call open_campaign(campaign, folder, plan, 7_int64, failure)
    call campaign%begin("# title" // new_line("a"), failure)
    call campaign%store(1, results_of(plan%grid%tile(1)), failure)
    call check_success(error, failure)
    call open_campaign(campaign, folder, plan, 8_int64, failure)
    call check_failure(error, failure, code=wrong_usage)
    call open_campaign(campaign, folder, plan, 7_int64, failure)
    call check_success(error, failure)
    call check_that(error, campaign%done(1), "==", .true., "tile 1 done")
    call clear_folder
  end subroutine test_foreign

  !> Both runs found an empty folder; the second one is refused.
  subroutine test_two_inputs(error)
    type(error_type), allocatable, intent(out) :: error
    type(sweep_plan_type) :: plan
    type(campaign_type) :: one, two
    type(failure_type), allocatable :: failure

    call new_plan(plan, [3, 4])
    call open_campaign(one, folder, plan, 7_int64, failure)
    call open_campaign(two, folder, plan, 8_int64, failure)
    call one%begin("# title" // new_line("a"), failure)
    call check_success(error, failure)
    if (.not. allocated(error)) call two%begin("# title" // new_line("a"), failure)
    call check_failure(error, failure, code=wrong_usage)
    call two%store(1, results_of(plan%grid%tile(1)), failure)
    call check_failure(error, failure)
    call check_that(error, int(file_size(folder // "/sweep.blocks/marks")), "==", 0, "size of the marks")
    call clear_folder
  end subroutine test_two_inputs

  !> Two runs of one input: the first writes the table and removes the blocks; the second receives an error that says so.
  subroutine test_finished_by_other_run(error)
    type(error_type), allocatable, intent(out) :: error
    type(sweep_plan_type) :: plan
    type(campaign_type) :: one, two
    type(summary_type) :: summary
    type(failure_type), allocatable :: failure

    call new_plan(plan, [3, 4])
    call open_campaign(one, folder, plan, 7_int64, failure)
    call open_campaign(two, folder, plan, 7_int64, failure)
    call one%begin("# title" // new_line("a"), failure)
    call two%begin("# title" // new_line("a"), failure)
    call one%store(1, results_of(plan%grid%tile(1)), failure)
    call two%store(1, results_of(plan%grid%tile(1)), failure)
    call check_success(error, failure)
    call one%finish(folder, summary, failure)
    call check_success(error, failure)
    call one%clear()
    call two%store(1, results_of(plan%grid%tile(1)), failure)
    call check_failure(error, failure)
    if (.not. allocated(error)) call check(error, failure%message, folder // "/sweep.blocks: no longer exists: another run has " &
      & // "finished this sweep, or the folder was removed")
    call check_that(error, int(file_size(folder // "/sweep.csv")), ">", 0, "size of the table")
    call clear_folder
  end subroutine test_finished_by_other_run

  !> Blocks of another input do not enter the table, however they came into the folder.
  subroutine test_replaced(error)
    type(error_type), allocatable, intent(out) :: error
    type(sweep_plan_type) :: plan
    type(campaign_type) :: one, two
    type(summary_type) :: summary
    type(failure_type), allocatable :: failure

    call new_plan(plan, [3, 4])
    call open_campaign(one, folder, plan, 7_int64, failure)
    call open_campaign(two, folder, plan, 8_int64, failure)
    call one%begin("# title" // new_line("a"), failure)
    call one%store(1, results_of(plan%grid%tile(1)), failure)
    call remove_file(folder // "/sweep.blocks/origin")
    call two%begin("# title" // new_line("a"), failure)
    call two%store(1, results_of(plan%grid%tile(1)), failure)
    call check_success(error, failure)
    call one%finish(folder, summary, failure)
    call check_failure(error, failure)
    call check_that(error, int(file_size(folder // "/sweep.csv")), "<", 0, "size")
    call clear_folder
  end subroutine test_replaced

  subroutine clear_folder()
    character(len=*), parameter :: names(*) = [character(len=19) :: "sweep.blocks/rows", "sweep.blocks/marks", &
      & "sweep.blocks/origin", "sweep.blocks/lock", "sweep.csv"]
    integer :: i

    do i = 1, size(names)
      call remove_file(folder // "/" // trim(names(i)))
    end do
    call remove_folder(folder // "/sweep.blocks")
    call remove_folder(folder)
  end subroutine clear_folder

end module test_campaign
