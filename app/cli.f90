!> The command line: options and the input's name.
module cli
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_io_suggest, only: suggestion
  implicit none (type, external)
  private

  public :: help_text, parse_command_line

  type, public :: setting_type
    character(len=:), allocatable :: assignment
  end type setting_type

  type, public :: options_type
    character(len=:), allocatable :: input
    !> Unallocated: named after the input.
    character(len=:), allocatable :: output
    type(setting_type), allocatable :: settings(:)
    logical :: check = .false., quiet = .false., help = .false., version = .false., fail_if_unstable = .false.
  end type options_type

  character(len=*), parameter :: long_names(*) = [character(len=18) :: "--set", "--output", "--check", "--quiet", "--help", &
    & "--version", "--fail-if-unstable"]

contains

  !> The options from the arguments of the program. Error: wrong usage.
  subroutine parse_command_line(options, error)
    type(options_type), intent(out) :: options
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: word, value
    logical :: only_names
    integer :: i

    allocate(options%settings(0))
    only_names = .false.
    i = 0
    do while (i < command_argument_count())
      i = i + 1
      word = argument(i)
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
        if (word /= "--set" .and. word /= "--output" .and. any(long_names == word)) then
          call fatal_error(error, "option '" // word // "' takes no value", wrong_usage)
          return
        end if
      else if (word == "-s" .or. word == "--set" .or. word == "-o" .or. word == "--output") then
        if (i == command_argument_count()) then
          call fatal_error(error, "option '" // word // "' needs a value", wrong_usage)
          return
        end if
        i = i + 1
        value = argument(i)
      end if

      select case (word)
      case ("--")
        only_names = .true.
      case ("-s", "--set")
        options%settings = [options%settings, setting_type(value)]
      case ("-o", "--output")
        options%output = value
        if (len(value) == 0) call fatal_error(error, "option '" // word // "' needs a folder's name", wrong_usage)
      case ("--check")
        options%check = .true.
      case ("-q", "--quiet")
        options%quiet = .true.
      case ("-h", "--help")
        options%help = .true.
      case ("-V", "--version")
        options%version = .true.
      case ("--fail-if-unstable")
        options%fail_if_unstable = .true.
      case default
        call fatal_error(error, "unknown option '" // word // "'" // suggestion(word, long_names), wrong_usage)
      end select
      if (allocated(error)) return
    end do
    if (options%help .or. options%version .or. allocated(options%input)) return
    call fatal_error(error, "no input file; usage: gestell [options] input.nml, and gestell --help", wrong_usage)
  end subroutine parse_command_line

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
      & "      --fail-if-unstable  exit code 10 for a verdict other than stable" // newline // &
      & "  -h, --help              this text" // newline // &
      & "  -V, --version           the version" // newline // newline // &
      & "exit codes: 0 done, 1 wrong usage, 2 invalid input, 3 the mechanism cannot be" // newline // &
      & "assembled or is singular at some crank angle, 4 the computation failed"
  end function help_text

end module cli
