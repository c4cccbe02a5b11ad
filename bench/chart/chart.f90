!> Times sweeps inside one process, with one thread and in memory, and draws the points at which others are compared:
!>
!>     chart solve FILE CHECKED [PATH=VALUE ...]       one line: points, seconds of processor time, solutions, points compared
!>                                                     by the sweep itself, its deviation of Phi, largest deviation of rho_max
!>                                                     at CHECKED points drawn at random, peak of resident memory in MB
!>     chart sample FILE COUNT TOLERANCE [PATH=VALUE ...]
!>                                                     lines: parameters, rho_max, units that balance the states
!>     chart radii < matrices                          seconds of dgeev for one matrix, then the radius of every one
!>
!> The deviation of rho_max is from solutions of their own to 1e-12, `sample` gives such solutions to TOLERANCE. Reading and
!> checking the file are not timed.
program chart
  use gestell_api_numerics, only: dp, error_type
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_input_schema_check, only: check_document
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_configuration
  use gestell_input_namelist_document, only: document_type
  use gestell_input_namelist, only: read_document
  use gestell_input_schema_path, only: set_value
  use gestell_input_schema, only: schema_type
  use gestell_task_range_plan, only: sweep_plan_type
  use gestell_task_sweep_expansion_cell, only: random_points
  use gestell_study_grid, only: tile_type
  use gestell_study_point, only: solve_point, sweep_options
  use gestell_task_sweep, only: solve_tile
  use gestell_study_tile_results, only: rho_max, sweep_columns, tile_results_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)

  interface
    subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: jobvl, jobvr
      integer, intent(in) :: n, lda, ldvl, ldvr, lwork
      real(dp), intent(inout) :: a(lda, n)
      real(dp), intent(out) :: wr(n), wi(n), vl(ldvl, 1), vr(ldvr, 1), work(lwork)
      integer, intent(out) :: info
    end subroutine dgeev
  end interface

  integer, parameter :: n = 6
  real(dp), parameter :: sharp = 1.0e-12_dp
  character(len=200) :: word
  type(sweep_plan_type) :: plan
  real(dp) :: tolerance
  integer :: points

  call get_command_argument(1, word)
  select case (word)
  case ("solve")
    call get_command_argument(3, word)
    read (word, *) points
    call read_plan(4, plan)
    call solve(plan, points)
  case ("sample")
    call get_command_argument(3, word)
    read (word, *) points
    call get_command_argument(4, word)
    read (word, *) tolerance
    call read_plan(5, plan)
    call draw(plan, points, tolerance)
  case ("radii")
    call find_radii()
  case default
    error stop "usage: chart solve | sample | radii ..."
  end select

contains

  !> The sweep of the file that is the second argument, with what is set from argument `first` on.
  subroutine read_plan(first, plan)
    integer, intent(in) :: first
    type(sweep_plan_type), intent(out) :: plan
    type(configuration_type) :: configuration
    type(document_type) :: doc
    type(schema_type) :: schema
    type(error_type), allocatable :: error
    character(len=200) :: word
    integer :: i

    schema = input_schema()
    call get_command_argument(2, word)
    call read_document(trim(word), doc, error)
    do i = first, command_argument_count()
      if (allocated(error)) exit
      call get_command_argument(i, word)
      call set_value(doc, schema, trim(word), error)
    end do
    if (.not. allocated(error)) call check_document(doc, schema, error)
    if (.not. allocated(error)) call read_configuration(doc, configuration, error)
    if (allocated(error)) error stop error%message
    plan = configuration%plan
  end subroutine read_plan

  subroutine solve(plan, checked)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: checked
    type(tile_results_type), allocatable :: tiles(:)
    type(error_type), allocatable :: error
    real(dp) :: begin, finish
    integer :: i

    allocate(tiles(plan%grid%tiles()))
    call cpu_time(begin)
    do i = 1, size(tiles)
      call solve_tile(plan%family, plan%grid, plan%grid%tile(i), plan%options, tiles(i), error)
      if (allocated(error)) error stop error%message
    end do
    call cpu_time(finish)
    print "(i0, ',', es13.6, 2(',', i0), 3(',', es10.3))", plan%grid%points(), finish - begin, sum(tiles%solutions), &
      & sum(tiles%checks), maxval(tiles%deviation), max_deviation(plan, tiles, checked), peak_memory()
  end subroutine solve

  !> Of rho_max at points drawn at random.
  real(dp) function max_deviation(plan, tiles, checked) result(maximum)
    type(sweep_plan_type), intent(in) :: plan
    type(tile_results_type), intent(in) :: tiles(:)
    integer, intent(in) :: checked
    integer :: places(2, checked), column, i, k

    maximum = 0
    places = random_points(all_points(plan), checked)
    column = count(plan%options%columns(:rho_max))
    do k = 1, checked
      do i = 1, size(tiles)
        associate (tile => plan%grid%tile(i), place => places(:, k))
          if (any(place < tile%first .or. place > tile%last)) cycle
          maximum = max(maximum, abs(tiles(i)%values(column, place(2) - tile%first(2) + 1, place(1) - tile%first(1) + 1) &
            & - radius_at(plan, place, sharp)))
        end associate
      end do
    end do
  end function max_deviation

  subroutine draw(plan, points, tolerance)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: points
    real(dp), intent(in) :: tolerance
    class(periodic_system), allocatable :: system
    type(error_type), allocatable :: error
    type(survey_type) :: survey
    integer :: places(2, points), k

    places = random_points(all_points(plan), points)
    do k = 1, points
      associate (parameters => plan%grid%parameters(places(1, k), places(2, k)))
        call plan%family%member(parameters, system, error)
        if (.not. allocated(error)) call survey_system(system, survey, error)
        if (allocated(error)) error stop error%message
        print "(*(es24.17, :, ' '))", parameters, radius_at(plan, places(:, k), tolerance), survey%scale
      end associate
    end do
  end subroutine draw

  pure type(tile_type) function all_points(plan) result(tile)
    type(sweep_plan_type), intent(in) :: plan

    tile%last(:size(plan%grid%axes)) = plan%grid%axes%count
  end function all_points

  !> rho_max of a point by a solution of its own.
  real(dp) function radius_at(plan, place, tolerance) result(radius)
    type(sweep_plan_type), intent(in) :: plan
    integer, intent(in) :: place(2)
    real(dp), intent(in) :: tolerance
    type(sweep_options) :: options
    type(error_type), allocatable :: error
    real(dp) :: all(sweep_columns)

    options = plan%options
    options%accuracy%tolerance = tolerance
    options%columns = .false.
    options%columns(rho_max) = .true.
    call solve_point(plan%family, plan%grid%parameters(place(1), place(2)), options, all, error)
    if (allocated(error)) error stop error%message
    radius = all(rho_max)
  end function radius_at

  subroutine find_radii()
    integer, parameter :: rounds = 5
    real(dp), allocatable :: matrices(:, :, :), longer(:, :, :), radii(:)
    real(dp) :: a(n, n), re(n), im(n), left(1, 1), right(1, 1), work(10 * n), begin, finish, shortest
    integer :: known, k, round, status, info

    allocate(matrices(n, n, 1000))
    known = 0
    do
      read (*, *, iostat=status) a
      if (status /= 0) exit
      if (known == size(matrices, 3)) then
        allocate(longer(n, n, 2 * known))
        longer(:, :, :known) = matrices
        call move_alloc(longer, matrices)
      end if
      known = known + 1
      matrices(:, :, known) = transpose(a)
    end do
    allocate(radii(known))
    shortest = huge(shortest)
    do round = 1, rounds
      call cpu_time(begin)
      do k = 1, known
        a = matrices(:, :, k)
        call dgeev("N", "N", n, a, n, re, im, left, 1, right, 1, work, size(work), info)
        radii(k) = maxval(hypot(re, im))
      end do
      call cpu_time(finish)
      shortest = min(shortest, (finish - begin) / max(1, known))
    end do
    print "(es13.6)", shortest
    print "(es24.17)", radii
  end subroutine find_radii

  !> In MB.
  real(dp) function peak_memory()
    character(len=200) :: line
    integer :: unit, status

    peak_memory = 0
    open (newunit=unit, file="/proc/self/status", action="read", iostat=status)
    do while (status == 0)
      read (unit, "(a)", iostat=status) line
      if (status /= 0 .or. line(:6) /= "VmHWM:") cycle
      read (line(7:), *) peak_memory
      peak_memory = peak_memory / 1024
      exit
    end do
    close (unit)
  end function peak_memory

end program chart
