!> What `auto` chooses, and its time over that of the best of all methods, as a Markdown table:
!>
!>     fpm run --directory bench/choice --profile release
!>
!> For each machine and tolerance every method solves Phi(T) and x_p(T) once; those within four
!> times the best are repeated, one after the other, and their medians count.
program choice
  use gestell_api_numerics, only: accuracy_type, dp, error_type, frame_type, method_names, monodromy_type, solve_monodromy
  use gestell_input_schema_check, only: check_document
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_configuration
  use gestell_input_namelist_document, only: document_type
  use gestell_input_namelist, only: read_document
  use gestell_input_schema_path, only: set_value
  use gestell_input_schema, only: schema_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)

  real(dp), parameter :: tolerances(4) = [1.0e-3_dp, 1.0e-6_dp, 1.0e-9_dp, 1.0e-12_dp]
  character(len=*), parameter :: speeds(5) = [character(len=5) :: "1", "20", "240", "1300", "20000"]
  character(len=*), parameter :: others(5) = [character(len=13) :: "compressor", "flying_press", "rocking_sieve", "shaper", &
    & "watt_six_bar"]
  integer :: i

  print "(a)", "| machine | 1e-3 | 1e-6 | 1e-9 | 1e-12 |", "|---|---|---|---|---|"
  do i = 1, size(speeds)
    call measure("khang_four_bar", trim(speeds(i)))
  end do
  do i = 1, size(others)
    call measure(trim(others(i)), "")
  end do

contains

  !> One row: method and time over the best, for each tolerance.
  subroutine measure(name, speed)
    character(len=*), intent(in) :: name, speed
    type(frame_type) :: frame
    character(len=200) :: cells
    character(len=24) :: cell
    character(len=:), allocatable :: label
    integer :: k

    call read_machine(name, speed, frame)
    cells = ""
    do k = 1, size(tolerances)
      call compare(frame, tolerances(k), cell)
      cells = trim(cells) // " " // trim(cell) // " |"
    end do
    label = name
    if (len(speed) > 0) label = label // " at " // speed // " rpm"
    print "(a)", "| " // label // " |" // trim(cells)
  end subroutine measure

  subroutine compare(frame, tolerance, cell)
    type(frame_type), intent(in) :: frame
    real(dp), intent(in) :: tolerance
    character(len=24), intent(out) :: cell
    integer, parameter :: runs = 7
    real(dp), allocatable :: times(:, :), medians(:)
    character(len=:), allocatable :: chosen
    integer :: i, run

    associate (names => method_names())
      allocate(times(size(names), runs), source=huge(1.0_dp))
      do i = 1, size(names)
        times(i, 1) = seconds(frame, trim(names(i)), tolerance)
      end do
      do run = 2, runs
        do i = 1, size(names)
          if (times(i, 1) <= 4 * minval(times(:, 1))) times(i, run) = seconds(frame, trim(names(i)), tolerance)
        end do
      end do
      medians = [(middle(times(i, :)), i = 1, size(names))]
      call name_choice(frame, tolerance, chosen)
      write (cell, "(a, 1x, f0.2)") chosen, medians(1) / minval(medians)
    end associate
  end subroutine compare

  !> Time of one solution; huge where there is none.
  real(dp) function seconds(frame, method, tolerance)
    type(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: method
    real(dp), intent(in) :: tolerance
    type(monodromy_type) :: monodromy
    type(error_type), allocatable :: error
    integer(int64) :: begin, finish, rate

    call system_clock(begin, rate)
    call solve_monodromy(frame, accuracy_type(tolerance, method), .true., monodromy, error)
    call system_clock(finish)
    seconds = real(finish - begin, dp) / rate
    if (allocated(error)) seconds = huge(seconds)
  end function seconds

  subroutine name_choice(frame, tolerance, name)
    type(frame_type), intent(in) :: frame
    real(dp), intent(in) :: tolerance
    character(len=:), allocatable, intent(out) :: name
    type(monodromy_type) :: monodromy
    type(error_type), allocatable :: error

    call solve_monodromy(frame, accuracy_type(tolerance), .true., monodromy, error)
    name = "none"
    if (.not. allocated(error)) name = trim(monodromy%method%name)
  end subroutine name_choice

  pure real(dp) function middle(values)
    real(dp), intent(in) :: values(:)
    integer :: i

    middle = values(1)
    do i = 1, size(values)
      if (count(values < values(i)) <= size(values) / 2 .and. count(values <= values(i)) > size(values) / 2) middle = values(i)
    end do
  end function middle

  subroutine read_machine(name, speed, frame)
    character(len=*), intent(in) :: name, speed
    type(frame_type), intent(out) :: frame
    type(configuration_type) :: configuration
    type(document_type) :: doc
    type(schema_type) :: schema
    type(error_type), allocatable :: error

    schema = input_schema()
    call read_document("../../data/" // name // ".nml", doc, error)
    if (.not. allocated(error) .and. len(speed) > 0) call set_value(doc, schema, "drive.speed_rpm=" // speed, error)
    if (.not. allocated(error)) call check_document(doc, schema, error)
    if (.not. allocated(error)) call read_configuration(doc, configuration, error)
    if (allocated(error)) error stop error%message
    frame = configuration%frame
  end subroutine read_machine

end program choice
