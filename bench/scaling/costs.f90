!> What the parts of a sweep cost one process, as CSV; options as those of gestell:
!>
!>     costs -o FOLDER input.nml > costs.csv
!>
!> - `start`: reading and checking the input;
!> - `tile`: one tile, of at most `most_tiles` that lie evenly among all; `inside`: the part of it spent in making the members
!>   of the family, which is for one thread at a time; `calls`: how many;
!> - `rows`: writing the rows of a tile to their places in the table and its mark, `plain`: as many bytes to a file, one behind the
!>   other;
!> - `open`: reading all rows back, as at a second start, and `finish`: giving the table its name, where all tiles were computed.
!>
!> Each is the least time of three, of tiles that are repeated at once.
program costs
  use gestell_run_command_line, only: command_line, options_type, parse
  use gestell_run_input, only: folder_name, read_input
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_task_sweep_checkpoint, only: campaign_type, open_campaign
  use gestell_task_common_task, only: any_task_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_base_files, only: file_size, remove_file
  use gestell_output_file_output, only: write_file
  use gestell_task_sweep_summary, only: summary_type
  use gestell_study_grid, only: tile_type
  use gestell_task_sweep, only: solve_tile
  use gestell_study_tile_results, only: tile_results_type
  use timed_family, only: seconds_now, tally_type, timed_family_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)

  integer, parameter :: most_tiles = 40, times = 3
  type(options_type) :: options
  type(any_task_type), allocatable :: tasks(:)
  type(configuration_type), allocatable :: configuration
  type(campaign_type) :: campaign
  type(error_type), allocatable :: error
  type(summary_type) :: summary
  type(timed_family_type) :: family
  type(tally_type), target :: tally
  character(len=:), allocatable :: folder
  real(dp) :: begin, least
  integer(int64) :: points
  integer :: i, tiles, computed

  print "(a)", "what,number,points,seconds,inside,calls,bytes"
  call parse(command_line(), options, error)
  call stop_at(error)
  folder = folder_name(options)
  least = huge(least)
  do i = 1, times
    if (allocated(configuration)) deallocate(configuration)
    allocate(configuration)
    begin = seconds_now()
    call read_input(options, tasks, configuration, error)
    least = min(least, seconds_now() - begin)
    call stop_at(error)
  end do
  call tell("start", 1, 0_int64, least, 0.0_dp, 0, 0_int64)
  associate (plan => configuration%plan)
    allocate(family%inner, source=plan%family)
    family%tally => tally
    call open_campaign(campaign, folder, plan, configuration%content, error)
    call stop_at(error)
    call campaign%begin("# costs" // new_line("a"), error)
    call stop_at(error)
    tiles = plan%grid%tiles()
    computed = min(tiles, most_tiles)
    points = plan%grid%points()
    do i = 1, computed
      call measure_tile(1 + int(((2 * i - 1) * int(tiles, int64)) / (2 * computed)))
    end do
    if (computed == tiles) then
      begin = seconds_now()
      call open_campaign(campaign, folder, plan, configuration%content, error)
      call stop_at(error)
      call tell("open", tiles, points, seconds_now() - begin, 0.0_dp, 0, 0_int64)
      begin = seconds_now()
      call campaign%finish(folder, summary, error)
      call stop_at(error)
      call campaign%clear()
      call tell("finish", tiles, points, seconds_now() - begin, 0.0_dp, 0, file_size(folder // "/" // campaign%layout%file))
    end if
  end associate

contains

  subroutine measure_tile(number)
    integer, intent(in) :: number
    type(tile_results_type) :: results
    type(tile_type) :: tile
    real(dp) :: begin, least, inside, now, writing, plain
    character(len=:), allocatable :: bytes
    integer(int64) :: points
    integer :: i

    tile = configuration%plan%grid%tile(number)
    points = product(int(tile%last - tile%first + 1, int64))
    least = huge(least)
    writing = huge(writing)
    plain = huge(plain)
    bytes = repeat("1", int(points * campaign%layout%width))
    inside = 0
    do i = 1, times
      tally = tally_type()
      begin = seconds_now()
      call solve_tile(family, configuration%plan%grid, tile, configuration%plan%options, results, error)
      now = seconds_now() - begin
      call stop_at(error)
      if (now < least) inside = tally%seconds
      least = min(least, now)
      begin = seconds_now()
      call campaign%store(number, results, error)
      writing = min(writing, seconds_now() - begin)
      call stop_at(error)
      begin = seconds_now()
      call write_file(folder // "/plain", bytes, error)
      plain = min(plain, seconds_now() - begin)
      call stop_at(error)
      call remove_file(folder // "/plain")
    end do
    call tell("tile", number, points, least, inside, tally%calls, 0_int64)
    call tell("rows", number, points, writing, 0.0_dp, 0, len(bytes, int64))
    call tell("plain", number, points, plain, 0.0_dp, 0, len(bytes, int64))
  end subroutine measure_tile

  subroutine tell(what, number, points, seconds, inside, calls, bytes)
    character(len=*), intent(in) :: what
    integer, intent(in) :: number, calls
    integer(int64), intent(in) :: points, bytes
    real(dp), intent(in) :: seconds, inside

    print "(a, ',', i0, ',', i0, 2(',', es11.4), 2(',', i0))", what, number, points, seconds, inside, calls, bytes
  end subroutine tell

  subroutine stop_at(error)
    type(error_type), allocatable, intent(in) :: error

    if (allocated(error)) error stop error%message
  end subroutine stop_at

end program costs
