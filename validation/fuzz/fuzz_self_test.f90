!> Faults that are planted: each must be found, and a sound run passed.
module fuzz_self_test
  use gestell_run_command_line, only: word_type
  use fuzz_folder, only: clear, prepare
  use fuzz_input, only: input_type
  use fuzz_oracle, only: judge
  use fuzz_process, only: ending_type, planted, run_apart
  use fuzz_text, only: read_content, newline, save_text
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  implicit none (type, external)
  private

  public :: test_itself

  abstract interface
    !> Spoils what a run in `folder` has left.
    subroutine spoiling(folder)
      implicit none (type, external)
      character(len=*), intent(in) :: folder
    end subroutine spoiling
  end interface

  character(len=*), parameter :: machine = "&drive speed_rpm=240 /" // newline // "&joint name='O', type='ground', position=0,0 /" &
    & // newline // "&joint name='A', type='crank', pivot='O', radius=0.1 /" // newline // "&link name='crank', from='O', " &
    & // "to='A', mass=1, inertia=0.01, center=0.1,0 /" // newline // "&frame mass=10, inertia=1, origin=0,0 /" // newline &
    & // "&support position=0.1,0, stiffness=1e5,1e5, damping=10,10 /" // newline // "&foundation stiffness=0,0,0,0,0,0,0,0,1e4, " &
    & // "damping=0,0,1 /" // newline // "&probe name='P', position=0,0 /" // newline // "&response points=3, harmonics=2 /" &
    & // newline

  character(len=*), parameter :: too_long = "took too long"

contains

  !> Tests the fuzzer in `folder`; `failed` faults were not found.
  subroutine test_itself(folder, failed)
    character(len=*), intent(in) :: folder
    integer, intent(out) :: failed
    integer :: passed

    passed = 0
    failed = 0
    call expect("", "a sound run", nothing)
    call expect("response.csv: NaN in xi_m", "NaN in a table", nan_in_table)
    call expect("multipliers.csv: Infinity in error", "Infinity in a table", infinity_in_table)
    call expect("supports.csv: no number in f_peak_crank_deg", "*** in a table", stars_in_table)
    call expect("harmonics.csv: nothing in order", "a number is missing", hole_in_table)
    call expect("probes.csv: negative d_peak_error_m", "a negative error", negative_error)
    call expect("power.csv: its last line does not end", "a table cut off", cut_table)
    call expect("power.csv: is empty", "an empty table", empty_table)
    call expect("modes.csv: a row has another number of fields than the header", "a column too many", wide_row)
    call expect("multipliers.csv: the multipliers are unstable, the report tells another verdict", "a wrong verdict", unstable)
    call expect("response.gp: NaN", "NaN in a script", nan_in_script)
    call expect("report: NaN in xi of F  NaN", "NaN in the report", nan_in_report)
    call expect("report: control character", "a control character in the report", bell_in_report)
    call expect("report: the input's name does not stand on its line", "a file's name of two lines", broken_name)
    call expect("supports.csv: control character", "a control character in the # lines", bell_in_preamble)
    call expect("modes.csv: NaN in a # line", "NaN in the # lines", nan_in_preamble)
    call expect("left: files that have no business there", "a file too many", file_too_many)
    call ends("crash: signal 11", "a crash", crash)
    call ends(too_long, "an endless loop", endless)
    call ends("stop: something stopped the program from within: ", "a stop", quiet_stop)
    call ends("message: with exit code 0: a word", "words on standard error", word_of_error)
    call refused("written: a folder, with exit code 2", "bad input, and something written", folder_made)
    call refused("message: 2 lines, exit code 2", "a message of two lines", two_lines)
    call refused("message: does not point into the file: bad input", "a message without a place", no_place)
    call refused("message: points to no line", "a message with a line that is not there", line_beyond)
    print "(i0, a, i0, a)", passed, " passed, ", failed, " failed"

  contains

    !> A run that all is well with, whose outputs `spoil` changes.
    subroutine expect(fault, name, spoil)
      character(len=*), intent(in) :: fault, name
      procedure(spoiling) :: spoil

      call examine(input_of(machine // "&case tasks='stability','modes','response','forces','power' /" // newline), fault, name, &
        & spoil)
    end subroutine expect

    !> A run that bad input ends.
    subroutine refused(fault, name, spoil)
      character(len=*), intent(in) :: fault, name
      procedure(spoiling) :: spoil

      call examine(input_of(machine // "&case tasks='nonsense' /"), fault, name, spoil)
    end subroutine refused

    subroutine examine(input, fault, name, spoil)
      type(input_type), intent(in) :: input
      character(len=*), intent(in) :: fault, name
      procedure(spoiling) :: spoil
      type(ending_type) :: ending
      character(len=:), allocatable :: came
      logical :: clean

      call prepare(folder, input)
      call run_apart(input%words, folder, 10.0_dp, ending)
      call spoil(folder)
      came = judge(input, ending, folder)
      call clear(folder, input, clean)
      if (came == "" .and. .not. clean) came = "left: files that have no business there"
      call compare(came, fault, name)
    end subroutine examine

    !> A process that ends in another way than the program does.
    subroutine ends(fault, name, plant)
      character(len=*), intent(in) :: fault, name
      procedure(planted) :: plant
      type(input_type) :: input
      type(ending_type) :: ending
      character(len=:), allocatable :: came
      logical :: clean

      input = input_of(machine)
      call prepare(folder, input)
      call run_apart(input%words, folder, 1.0_dp, ending, plant)
      came = judge(input, ending, folder)
      if (ending%too_long()) came = too_long
      call compare(came, fault, name)
      call clear(folder, input, clean)
    end subroutine ends

    subroutine compare(came, fault, name)
      character(len=*), intent(in) :: came, fault, name

      if (came == fault) then
        passed = passed + 1
      else
        failed = failed + 1
        print "(6a)", "FAILED  ", name, ": came '", came, "', expected '", fault // "'"
      end if
    end subroutine compare
  end subroutine test_itself

  type(input_type) function input_of(document) result(input)
    character(len=*), intent(in) :: document

    input%document = document
    input%file = "input.nml"
    input%folder = "out"
    allocate(input%words(3))
    input%words(1)%text = "-o"
    input%words(2)%text = "out"
    input%words(3)%text = "input.nml"
  end function input_of

  subroutine nothing(folder)
    character(len=*), intent(in) :: folder

    if (len(folder) == 0) error stop "no folder"
  end subroutine nothing

  subroutine nan_in_table(folder)
    character(len=*), intent(in) :: folder

    call change_field(folder // "/case/out/response.csv", 3, "NaN")
  end subroutine nan_in_table

  subroutine infinity_in_table(folder)
    character(len=*), intent(in) :: folder

    call change_field(folder // "/case/out/multipliers.csv", 9, "Infinity")
  end subroutine infinity_in_table

  subroutine stars_in_table(folder)
    character(len=*), intent(in) :: folder

    call change_field(folder // "/case/out/supports.csv", 18, "***")
  end subroutine stars_in_table

  subroutine hole_in_table(folder)
    character(len=*), intent(in) :: folder

    call change_field(folder // "/case/out/harmonics.csv", 1, "")
  end subroutine hole_in_table

  subroutine negative_error(folder)
    character(len=*), intent(in) :: folder

    call change_field(folder // "/case/out/probes.csv", 11, "-1.0E-003")
  end subroutine negative_error

  subroutine wide_row(folder)
    character(len=*), intent(in) :: folder

    call change_field(folder // "/case/out/modes.csv", 2, "1,2")
  end subroutine wide_row

  subroutine unstable(folder)
    character(len=*), intent(in) :: folder

    call change_field(folder // "/case/out/multipliers.csv", 4, "1.5")
  end subroutine unstable

  subroutine cut_table(folder)
    character(len=*), intent(in) :: folder
    character(len=:), allocatable :: content
    logical :: there

    call read_content(folder // "/case/out/power.csv", content, there)
    call save_text(folder // "/case/out/power.csv", content(:len(content) - 1))
  end subroutine cut_table

  subroutine empty_table(folder)
    character(len=*), intent(in) :: folder

    call save_text(folder // "/case/out/power.csv", "")
  end subroutine empty_table

  subroutine nan_in_script(folder)
    character(len=*), intent(in) :: folder
    character(len=:), allocatable :: content
    logical :: there

    call read_content(folder // "/case/out/response.gp", content, there)
    call save_text(folder // "/case/out/response.gp", content // "set xrange [0:NaN]" // newline)
  end subroutine nan_in_script

  subroutine nan_in_report(folder)
    character(len=*), intent(in) :: folder
    character(len=:), allocatable :: content
    logical :: there

    call read_content(folder // "/out", content, there)
    call save_text(folder // "/out", content // "  xi of F  NaN" // newline)
  end subroutine nan_in_report

  subroutine bell_in_report(folder)
    character(len=*), intent(in) :: folder

    call save_text(folder // "/out", "Gestell" // achar(7) // newline)
  end subroutine bell_in_report

  subroutine broken_name(folder)
    character(len=*), intent(in) :: folder

    call save_text(folder // "/out", "Gestell 0" // newline // newline // "  input      input" // newline // ".nml" // newline)
  end subroutine broken_name

  subroutine bell_in_preamble(folder)
    character(len=*), intent(in) :: folder

    call add_first(folder // "/case/out/supports.csv", "# title: a" // char(194) // char(133) // newline)
  end subroutine bell_in_preamble

  subroutine nan_in_preamble(folder)
    character(len=*), intent(in) :: folder

    call add_first(folder // "/case/out/modes.csv", "# title: NaN" // newline)
  end subroutine nan_in_preamble

  subroutine add_first(name, line)
    character(len=*), intent(in) :: name, line
    character(len=:), allocatable :: content
    logical :: there

    call read_content(name, content, there)
    call save_text(name, line // content)
  end subroutine add_first

  subroutine file_too_many(folder)
    character(len=*), intent(in) :: folder

    call save_text(folder // "/case/out/response.csv.new", "")
  end subroutine file_too_many

  subroutine folder_made(folder)
    character(len=*), intent(in) :: folder

    call execute_command_line("mkdir " // folder // "/case/out")
  end subroutine folder_made

  subroutine two_lines(folder)
    character(len=*), intent(in) :: folder

    call save_text(folder // "/err", "input.nml:1: bad" // newline // "input" // newline)
  end subroutine two_lines

  subroutine no_place(folder)
    character(len=*), intent(in) :: folder

    call save_text(folder // "/err", "bad input" // newline)
  end subroutine no_place

  subroutine line_beyond(folder)
    character(len=*), intent(in) :: folder

    call save_text(folder // "/err", "input.nml:99: bad input" // newline)
  end subroutine line_beyond

  !> Another word in a field of the first row of a table.
  subroutine change_field(name, field, word)
    character(len=*), intent(in) :: name, word
    integer, intent(in) :: field
    character(len=:), allocatable :: content
    logical :: there
    integer :: first, last, k

    call read_content(name, content, there)
    if (.not. there) return
    first = 1
    do while (content(first:first) == "#")
      first = first + index(content(first:), newline)
    end do
    first = first + index(content(first:), newline)
    do k = 2, field
      first = first + index(content(first:), ",")
    end do
    last = first + scan(content(first:), "," // newline) - 1
    call save_text(name, content(:first - 1) // word // content(last:))
  end subroutine change_field

  subroutine crash()
    integer, pointer :: nowhere

    nullify (nowhere)
    nowhere = 1
    write (output_unit, *) nowhere
  end subroutine crash

  subroutine endless()
    real(dp) :: x

    x = 1
    do while (x > 0)
      x = sqrt(x + 1)
    end do
    write (output_unit, *) x
  end subroutine endless

  subroutine quiet_stop()
    stop
  end subroutine quiet_stop

  subroutine word_of_error()
    write (error_unit, "(a)") "a word"
  end subroutine word_of_error

end module fuzz_self_test
