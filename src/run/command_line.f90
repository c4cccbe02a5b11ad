!> Parses the command line into options and the name of the input file. The text of --help is composed from the same table of
!> options.
module gestell_run_command_line
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_paths, only: decode_word, use_slashes
  use gestell_input_namelist_number, only: read_integer
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_input_schema_help, only: entry
  use gestell_output_head, only: setting_type
  implicit none (type, external)
  private

  public :: command_line, help_text, parse

  !> A word of the command line
  type, public :: word_type
    character(len=:), allocatable :: text
  end type word_type

  !> Describes an option. The parser, the text of --help and the shell completion use this description.
  type :: option_type
    character(len=2) :: short
    character(len=18) :: long
    !> Name that --help uses for the option's value. If blank, the option takes no value; if in brackets, the value may be omitted
    character(len=10) :: value
    character(len=160) :: meaning
  end type option_type

  type(option_type), parameter :: all_options(*) = [ &
    & option_type("-s", "--set", "PATH=VALUE", "set a key of the input, such as drive.speed_rpm=300 or link(coupler).mass=0.7; " &
    &   // "may be repeated"), &
    & option_type("-o", "--output", "DIR", "folder of the results; default: the input's name without its ending, in the working " &
    &   // "directory"), &
    & option_type("", "--check", "", "validate the input and report on the mechanism over one turn; no vibration is computed"), &
    & option_type("-q", "--quiet", "", "print no report on standard output"), &
    & option_type("", "--verbose", "", "also report the accuracy of the solution: method, steps, periodicity, Liouville's " &
    &   // "formula and balance of power"), &
    & option_type("", "--fail-if-unstable", "", "exit with code 10 unless the verdict is stable (in a sweep or a range of " // &
    &   "speeds: stable at every point)"), &
    & option_type("", "--part", "i/n", "compute part i of n of a sweep (i from 1 to n), without sweep.csv"), &
    & option_type("", "--merge", "", "combine all parts of a sweep in sweep.csv"), &
    & option_type("", "--one-line", "", "print a CSV header and one CSV line per case; print no report and write no files"), &
    & option_type("", "--plot", "", "draw pictures (SVG, PNG) with gnuplot; with --check only the mechanism"), &
    & option_type("", "--report", "", "write report.html: input, verdict, tables and pictures on one page; also draws the " &
    &   // "pictures of --plot"), &
    & option_type("", "--json", "", "write results.json: all results with units, meanings and errors; with -q to " &
    &   // "standard output"), &
    & option_type("", "--new", "[KIND]", "print a commented input file to start from; without KIND: list the kinds of machines"), &
    & option_type("-h", "--help", "[KEY]", "print this text, or describe a group or key of the input, such as support or " // &
    &   "support.stiffness; --help groups lists all groups"), &
    & option_type("-V", "--version", "", "print the version")]

  !> Two options that must not be given together. `reason` says why; it is empty if the reason is obvious
  type :: conflict_type
    character(len=10) :: one
    character(len=18) :: other
    character(len=72) :: reason = ""
  end type conflict_type

  type(conflict_type), parameter :: conflicts(*) = [ &
    & conflict_type("--check", "--part"), conflict_type("--check", "--merge"), conflict_type("--check", "--one-line"), &
    & conflict_type("--part", "--merge"), conflict_type("--part", "--one-line"), conflict_type("--merge", "--one-line"), &
    & conflict_type("--part", "--fail-if-unstable", ": a part of a sweep has no verdict; use --fail-if-unstable with --merge"), &
    & conflict_type("--part", "--plot", ": a part of a sweep has no picture; use --plot with --merge"), &
    & conflict_type("--one-line", "--plot"), conflict_type("--check", "--report"), conflict_type("--part", "--report"), &
    & conflict_type("--one-line", "--report"), conflict_type("--check", "--json"), conflict_type("--part", "--json"), &
    & conflict_type("--one-line", "--json")]

  !> The options and the input file that a command line specifies.
  type, public :: options_type
    !> Name of the input file; unallocated if the command line does not contain it
    character(len=:), allocatable :: input
    !> Folder for the result files. If unallocated, the name of the folder is derived from that of the input file
    character(len=:), allocatable :: output
    !> Topic that --help explains, such as a group or key. If unallocated, --help lists the options
    character(len=:), allocatable :: topic
    !> Kind of machine for which --new prints an input. If unallocated, --new lists the kinds
    character(len=:), allocatable :: kind
    !> Assignments PATH=VALUE given by the options --set
    type(setting_type), allocatable :: settings(:)
    !> A sweep is divided into `parts` parts, of which this run computes part number `part`
    integer :: part = 1, parts = 1
    logical, private :: is_given(size(all_options)) = .false.
  contains
    procedure :: has, writes_files
  end type options_type

contains

  !> True if the command line contains the option with this long name.
  elemental logical function has(self, name)
    class(options_type), intent(in) :: self
    character(len=*), intent(in) :: name

    has = any(self%is_given .and. all_options%long == name)
  end function has

  !> True if the run publishes files. A run with --check publishes only the pictures that --plot requests.
  pure logical function writes_files(self)
    class(options_type), intent(in) :: self

    writes_files = .not. (self%has("--one-line") .or. self%has("--part") .or. self%has("--check") .and. .not. self%has("--plot"))
  end function writes_files

  !> Returns the words with which the program was called.
  function command_line() result(words)
    type(word_type), allocatable :: words(:)
    integer :: i, length

    allocate(words(command_argument_count()))
    do i = 1, size(words)
      call get_command_argument(i, length=length)
      allocate(character(len=length) :: words(i)%text)
      call get_command_argument(i, words(i)%text)
      call decode_word(words(i)%text)
    end do
  end function command_line

  !> Parses the words of a command line. Fails if the input file is missing, an option is unknown or lacks its value, or two options
  !> exclude each other.
  subroutine parse(words, options, error)
    type(word_type), intent(in) :: words(:)
    type(options_type), intent(out) :: options
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: word, value
    type(setting_type) :: setting
    logical :: only_names, attached
    integer :: i, k

    allocate(options%settings(0))
    only_names = .false.
    i = 0
    do while (i < size(words))
      i = i + 1
      word = words(i)%text
      if (only_names .or. word == "-" .or. index(word, "-") /= 1) then
        if (allocated(options%input)) then
          call fatal_error(error, "more than one input file: '" // options%input // "' and '" // word // "'", wrong_usage)
        else if (len(word) == 0) then
          call fatal_error(error, "the name of the input file is empty", wrong_usage)
        end if
        if (allocated(error)) return
        options%input = word
        call use_slashes(options%input)
        cycle
      else if (word == "--") then
        only_names = .true.
        cycle
      end if

      attached = index(word, "--") == 1 .and. index(word, "=") > 0
      if (attached) then
        value = word(index(word, "=") + 1:)
        word = word(:index(word, "=") - 1)
      end if
      k = number_of(word)
      if (k == 0) then
        call fatal_error(error, "unknown option '" // word // "'" // suggestion(word, all_options%long), wrong_usage)
        return
      end if
      options%is_given(k) = .true.
      if (scan(all_options(k)%value, " [") == 1) then
        if (attached) call fatal_error(error, "option '" // word // "' takes no value", wrong_usage)
      else if (.not. attached) then
        i = i + 1
        value = ""
        if (i <= size(words)) value = words(i)%text
        if (i > size(words) .or. number_of(value) > 0) call fatal_error(error, "option '" // word // "' needs a value", wrong_usage)
      end if
      if (allocated(error)) return

      select case (all_options(k)%long)
      case ("--set")
        ! A variable, because gfortran 12 does not free what a constructor within an array constructor allocates.
        setting%text = value
        options%settings = [options%settings, setting]
      case ("--output")
        options%output = value
        call use_slashes(options%output)
        if (len(value) == 0) call fatal_error(error, "option '" // word // "' needs the name of a folder", wrong_usage)
      case ("--part")
        call read_part(value, options, error)
      case ("--help")
        if (i == size(words)) cycle
        value = words(i + 1)%text
        ! a file name behind --help is the input, not a topic
        if (index(value, "-") == 1 .or. scan(value, "/\") > 0 .or. index(value // " ", ".nml ") > 0) cycle
        options%topic = value
        i = i + 1
      case ("--new")
        if (i == size(words)) cycle
        if (index(words(i + 1)%text, "-") == 1) cycle
        options%kind = words(i + 1)%text
        i = i + 1
      case default
        ! a switch has no value
      end select
      if (allocated(error)) return
    end do
    do i = 1, size(conflicts)
      if (.not. (options%has(conflicts(i)%one) .and. options%has(conflicts(i)%other))) cycle
      call fatal_error(error, "options '" // trim(conflicts(i)%one) // "' and '" // trim(conflicts(i)%other) &
        & // "' exclude each other" // trim(conflicts(i)%reason), wrong_usage)
      return
    end do
    if (options%has("--new") .and. allocated(options%input)) then
      call fatal_error(error, "option '--new' reads no input file; to write one: gestell --new KIND > machine.nml", wrong_usage)
    else if (any(options%has(["--help   ", "--version", "--new    "])) .or. allocated(options%input)) then
      return
    end if
    if (allocated(error)) return
    call fatal_error(error, "no input file; usage: gestell [options] input.nml (gestell --help lists the options)", wrong_usage)
  end subroutine parse

  !> Index of the option with this short or long name; 0 if there is no such option.
  pure integer function number_of(word)
    character(len=*), intent(in) :: word

    number_of = findloc(len(word) > 0 .and. (all_options%long == word .or. all_options%short == word), .true., dim=1)
  end function number_of

  !> Reads the value i/n of the option --part.
  subroutine read_part(value, options, error)
    character(len=*), intent(in) :: value
    type(options_type), intent(inout) :: options
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: reason
    integer :: slash

    slash = index(value, "/")
    if (slash > 0) then
      call read_integer(value(:slash - 1), options%part, reason)
      if (reason == "") call read_integer(value(slash + 1:), options%parts, reason)
      if (reason == "" .and. options%part >= 1 .and. options%part <= options%parts) return
    end if
    call fatal_error(error, "--part " // value // ": must be i/n with i from 1 to n, such as 3/8 for the third of eight parts", &
      & wrong_usage)
  end subroutine read_part

  !> The text of --help.
  pure function help_text() result(text)
    character(len=:), allocatable :: text
    character, parameter :: newline = new_line("a")
    character(len=4) :: short
    integer :: i

    text = "Vibrations and stability of machines with crank mechanisms on elastic mounts." // newline // newline &
      & // "usage: gestell [options] input.nml" // newline // newline
    do i = 1, size(all_options)
      short = all_options(i)%short
      if (short /= "") short(3:) = ","
      text = text // entry(short // trim(all_options(i)%long) // " " // all_options(i)%value, trim(all_options(i)%meaning), &
        & column=26)
    end do
    text = text // newline // "exit codes: 0 done, 1 wrong usage, 2 invalid input, 3 the mechanism cannot be" // newline &
      & // "assembled or is singular at some crank angle, 4 the computation failed"
  end function help_text

end module gestell_run_command_line
