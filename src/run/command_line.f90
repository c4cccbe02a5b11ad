!> The command line: options and the input's name.
module gestell_run_command_line
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_input_namelist_number, only: read_integer
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_output_head, only: setting_type
  implicit none (type, external)
  private

  public :: command_line, help_text, parse

  !> A word of the command line.
  type, public :: word_type
    character(len=:), allocatable :: text
  end type word_type

  type, public :: options_type
    character(len=:), allocatable :: input
    !> Unallocated: named after the input.
    character(len=:), allocatable :: output
    !> The group or key that help is wanted on.
    character(len=:), allocatable :: topic
    type(setting_type), allocatable :: settings(:)
    logical :: check = .false., quiet = .false., help = .false., version = .false., fail_if_unstable = .false., &
      & merge = .false., one_line = .false., plot = .false., report = .false., json = .false., verbose = .false.
    !> The share of a sweep that is computed: part `part` of `parts`.
    integer :: part = 1, parts = 1
    logical :: in_parts = .false.
  end type options_type

  character(len=*), parameter :: long_names(*) = [character(len=18) :: "--set", "--output", "--check", "--quiet", "--help", &
    & "--version", "--fail-if-unstable", "--part", "--merge", "--one-line", "--plot", "--report", "--json", "--verbose"]
  character(len=*), parameter :: short_names(*) = ["-s", "-o", "-q", "-h", "-V"]
  !> Those that take a value.
  character(len=*), parameter :: with_value(*) = [character(len=8) :: "-s", "--set", "-o", "--output", "--part"]

contains

  !> The arguments of the program.
  function command_line() result(words)
    type(word_type), allocatable :: words(:)
    integer :: i

    allocate(words(command_argument_count()))
    do i = 1, size(words)
      words(i)%text = argument(i)
    end do
  end function command_line

  !> The options from the words of a command line. Error: wrong usage.
  subroutine parse(words, options, error)
    type(word_type), intent(in) :: words(:)
    type(options_type), intent(out) :: options
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: word, value
    type(setting_type) :: setting
    logical :: only_names
    integer :: i

    allocate(options%settings(0))
    only_names = .false.
    i = 0
    do while (i < size(words))
      i = i + 1
      word = words(i)%text
      if (only_names .or. word == "-" .or. index(word, "-") /= 1) then
        if (allocated(options%input)) then
          call fatal_error(error, "more than one input: '" // options%input // "' and '" // word // "'", wrong_usage)
          return
        end if
        if (len(word) == 0) then
          call fatal_error(error, "the name of the input is empty", wrong_usage)
          return
        end if
        options%input = word
        cycle
      end if

      if (index(word, "--") == 1 .and. index(word, "=") > 0) then
        value = word(index(word, "=") + 1:)
        word = word(:index(word, "=") - 1)
        if (all(with_value /= word) .and. any(long_names == word)) then
          call fatal_error(error, "option '" // word // "' takes no value", wrong_usage)
          return
        end if
      else if (any(with_value == word)) then
        value = ""
        if (i < size(words)) value = words(i + 1)%text
        if (i == size(words) .or. any(long_names == value) .or. any(short_names == value)) then
          call fatal_error(error, "option '" // word // "' needs a value", wrong_usage)
          return
        end if
        i = i + 1
      end if

      select case (word)
      case ("--")
        only_names = .true.
      case ("-s", "--set")
        ! of a variable: gfortran 12 does not free what a constructor within a list has allocated
        setting%text = value
        options%settings = [options%settings, setting]
      case ("-o", "--output")
        options%output = value
        if (len(value) == 0) call fatal_error(error, "option '" // word // "' needs a folder's name", wrong_usage)
      case ("--check")
        options%check = .true.
      case ("-q", "--quiet")
        options%quiet = .true.
      case ("--verbose")
        options%verbose = .true.
      case ("-h", "--help")
        options%help = .true.
        if (i == size(words)) cycle
        value = words(i + 1)%text
        ! an input beside --help is no topic
        if (index(value, "-") == 1 .or. index(value, "/") > 0 .or. index(value // " ", ".nml ") > 0) cycle
        options%topic = value
        i = i + 1
      case ("-V", "--version")
        options%version = .true.
      case ("--fail-if-unstable")
        options%fail_if_unstable = .true.
      case ("--part")
        call read_part(value, options, error)
      case ("--merge")
        options%merge = .true.
      case ("--one-line")
        options%one_line = .true.
      case ("--plot")
        options%plot = .true.
      case ("--report")
        options%report = .true.
      case ("--json")
        options%json = .true.
      case default
        call fatal_error(error, "unknown option '" // word // "'" // suggestion(word, long_names), wrong_usage)
      end select
      if (allocated(error)) return
    end do
    call refuse_together(options, error)
    if (allocated(error) .or. options%help .or. options%version .or. allocated(options%input)) return
    call fatal_error(error, "no input file; usage: gestell [options] input.nml, and gestell --help", wrong_usage)
  end subroutine parse

  !> The share of --part i/n.
  subroutine read_part(value, options, error)
    character(len=*), intent(in) :: value
    type(options_type), intent(inout) :: options
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: reason
    integer :: slash

    options%in_parts = .true.
    slash = index(value, "/")
    if (slash > 0) then
      call read_integer(value(:slash - 1), options%part, reason)
      if (reason == "") call read_integer(value(slash + 1:), options%parts, reason)
      if (reason == "" .and. options%part >= 1 .and. options%part <= options%parts) return
    end if
    call fatal_error(error, "--part " // value // ": must be i/n, as in 3/8: the third of eight parts", wrong_usage)
  end subroutine read_part

  !> Options that exclude each other.
  subroutine refuse_together(options, error)
    type(options_type), intent(in) :: options
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: names(*) = [character(len=10) :: "--check", "--part", "--merge", "--one-line"]
    logical :: given(size(names))

    given = [options%check, options%in_parts, options%merge, options%one_line]
    if (count(given) > 1) then
      call fatal_error(error, "options '" // trim(names(findloc(given, .true., dim=1))) // "' and '" // &
        & trim(names(findloc(given, .true., dim=1, back=.true.))) // "' exclude each other", wrong_usage)
    else if (options%fail_if_unstable .and. options%in_parts) then
      call fatal_error(error, "options '--part' and '--fail-if-unstable' exclude each other: a part has no verdict on all; give " &
        & // "--fail-if-unstable to --merge", wrong_usage)
    else if (options%plot .and. options%in_parts) then
      call fatal_error(error, "options '--part' and '--plot' exclude each other: a part is no picture; give --plot to --merge", &
        & wrong_usage)
    else if (options%plot .and. options%one_line) then
      call fatal_error(error, "options '--one-line' and '--plot' exclude each other", wrong_usage)
    else if ((options%report .or. options%json) .and. any(given([1, 2, 4]))) then
      call fatal_error(error, "options '" // trim(names(findloc(given, .true., dim=1))) // "' and '" &
        & // trim(merge("--report", "--json  ", options%report)) // "' exclude each other", wrong_usage)
    end if
  end subroutine refuse_together

  function argument(i) result(word)
    integer, intent(in) :: i
    character(len=:), allocatable :: word
    integer :: length

    call get_command_argument(i, length=length)
    allocate(character(len=length) :: word)
    call get_command_argument(i, word)
  end function argument

  pure function help_text() result(text)
    character(len=:), allocatable :: text
    character, parameter :: newline = new_line("a")

    text = "Vibrations and stability of the elastically mounted frame of a planar linkage." // newline // newline // &
      & "usage: gestell [options] input.nml" // newline // newline // &
      & "  -s, --set PATH=VALUE    override a key of the input, as drive.speed_rpm=300 or" // newline // &
      & "                          link(coupler).mass=0.7; repeatable" // newline // &
      & "  -o, --output DIR        where the files go; default: the input's name without" // newline // &
      & "                          its ending, in the working directory" // newline // &
      & "      --check             read and validate everything, turn the mechanism once," // newline // &
      & "                          compute nothing more" // newline // &
      & "  -q, --quiet             no report on standard output" // newline // &
      & "      --verbose           the report also says what its numbers rest on:" // newline // &
      & "                          method, steps, how well closing, Liouville's formula" // newline // &
      & "                          and the balance of power hold" // newline // &
      & "      --fail-if-unstable  exit code 10 for a verdict other than stable; of a" // newline // &
      & "                          sweep or over the speed, for any point's" // newline // &
      & "      --part i/n          compute part i of n of a sweep, write no sweep.csv" // newline // &
      & "      --merge             write the sweep.csv of all parts" // newline // &
      & "      --one-line          a header and a line of CSV for each case on standard" // newline // &
      & "                          output in place of report and files" // newline // &
      & "      --plot              draw pictures, SVG and PNG, by gnuplot; with --check" // newline // &
      & "                          only the mechanism's" // newline // &
      & "      --report            report.html: input, verdict, tables, pictures on a" // newline // &
      & "                          page that needs nothing else; draws as --plot" // newline // &
      & "      --json              results.json: everything that was found, with units," // newline // &
      & "                          meanings and errors; with -q on standard output" // newline // &
      & "  -h, --help [KEY]        this text; help on a group or key of the input, as" // newline // &
      & "                          support or support.stiffness; groups: all groups" // newline // &
      & "  -V, --version           the version" // newline // newline // &
      & "exit codes: 0 done, 1 wrong usage, 2 invalid input, 3 the mechanism cannot be" // newline // &
      & "assembled or is singular at some crank angle, 4 the computation failed"
  end function help_text

end module gestell_run_command_line
