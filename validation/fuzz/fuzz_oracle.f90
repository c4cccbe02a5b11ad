!> What doc/input.md and doc/output.md promise of every run, whatever the input.
module fuzz_oracle
  use fuzz_folder, only: file_exists
  use fuzz_input, only: input_type
  use fuzz_process, only: ending_type
  use fuzz_tables, only: check_table, verdict_of_multipliers
  use fuzz_text, only: absurd_word, read_content, control_character, count_lines, has, lowered, newline
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_output_file_result_files, only: animation, longest_table
  use gestell_task_registry, only: all_tables
  implicit none (type, external)
  private

  public :: judge

  !> A longer message is no line that anyone reads.
  integer, parameter :: longest_message = 1000

contains

  !> What is wrong with a run, as a class of faults; empty where nothing is, and where it took too long, which depends on the
  !> computer. `folder`: as for `run_apart`.
  function judge(input, ending, folder) result(fault)
    type(input_type), intent(in) :: input
    type(ending_type), intent(in) :: ending
    character(len=*), intent(in) :: folder
    character(len=:), allocatable :: fault, said, complaint
    logical :: there

    fault = ""
    if (ending%too_long()) return
    call read_content(folder // "/out", said, there)
    call read_content(folder // "/err", complaint, there)
    if (ending%signal /= 0) then
      fault = "crash: signal " // text(ending%signal)
      return
    else if (ending%code < 0) then
      fault = "stop: something stopped the program from within: " // first_words(complaint)
      return
    end if
    select case (ending%code)
    case (0, 10)
      fault = notes(complaint)
      if (ending%code == 10 .and. .not. input%option("--fail")) fault = "exit code: 10 without --fail-if-unstable"
    case (1:3)
      fault = message(input, ending%code, complaint)
      if (fault == "" .and. file_exists(folder // "/case/" // input%folder // "/.")) fault = "written: a folder, with exit code " &
        & // text(ending%code)
    case (4)
      fault = message(input, ending%code, complaint)
    case default
      fault = "exit code: " // text(ending%code)
    end select
    if (fault == "") fault = report(input, ending%code, said)
    if (fault == "") fault = results(input, said, folder // "/case/" // input%folder)
  end function judge

  !> Notes on standard error.
  function notes(complaint) result(fault)
    character(len=*), intent(in) :: complaint
    character(len=:), allocatable :: fault

    fault = ""
    if (complaint == "") return
    if (index(complaint, "note: ") /= 1) fault = "message: with exit code 0: " // first_words(complaint)
    if (control_character(complaint)) fault = "message: control character in a note"
  end function notes

  !> The one line on standard error.
  function message(input, code, complaint) result(fault)
    type(input_type), intent(in) :: input
    integer, intent(in) :: code
    character(len=*), intent(in) :: complaint
    character(len=:), allocatable :: fault
    integer :: colon, line, status

    fault = ""
    if (count_lines(complaint) /= 1 .and. .not. (code == 4 .and. index(complaint, "note: ") == 1)) then
      fault = "message: " // text(count_lines(complaint)) // " lines, exit code " // text(code)
    else if (control_character(complaint)) then
      fault = "message: control character"
    else if (len(complaint) > longest_message) then
      fault = "message: of more than " // text(longest_message) // " characters"
    else if (absurd_word(complaint) /= "" .and. .not. quoted(input)) then
      fault = "message: " // absurd_word(complaint) // " in: " // first_words(complaint)
    end if
    if (fault /= "" .or. code < 2 .or. code > 3) return
    if (index(complaint, "--set ") == 1 .or. has(complaint, ": there is no such file" // newline)) return
    if (index(printable(complaint), printable(input%file) // ": ") == 1) return
    if (index(printable(complaint), printable(input%file) // ":") /= 1) then
      fault = "message: does not point into the file: " // first_words(complaint)
      return
    end if
    colon = len(input%file) + 2
    read (complaint(colon:colon + index(complaint(colon:), ":") - 2), *, iostat=status) line
    if (status /= 0 .or. line < 1 .or. line > count_lines(input%document) + 1) fault = "message: points to no line"
  end function message

  !> Standard output.
  function report(input, code, said) result(fault)
    type(input_type), intent(in) :: input
    integer, intent(in) :: code
    character(len=*), intent(in) :: said
    character(len=:), allocatable :: fault
    logical :: untold

    fault = ""
    if (said == "") return
    if (said(len(said):) /= newline) then
      fault = "report: its last line does not end"
    else if (control_character(said)) then
      fault = "report: control character"
    else if (input%option("--one-line") .and. .not. input%option("--help")) then
      ! With --fail-if-unstable 10 comes before 4, and a vibration that cannot be told has no numbers.
      untold = code == 4 .or. (code == 10 .and. index(said, ",undecided") > 0)
      if (.not. (untold .or. input%option("--set"))) fault = check_table("one-line", said)
      if (fault /= "") fault = "one-line: " // fault
    else if (index(said, "Gestell ") == 1 .and. .not. input%garbled .and. .not. has(in_lines(said), newline // "  input      " &
      & // printable(input%file) // newline)) then
      fault = "report: the input's name does not stand on its line"
    else if (absurd_word(said) /= "" .and. .not. quoted(input)) then
      fault = "report: " // absurd_word(said) // " in " // line_with(said, absurd_word(said))
    end if
  end function report

  !> The files.
  function results(input, said, folder) result(fault)
    type(input_type), intent(in) :: input
    character(len=*), intent(in) :: said, folder
    character(len=:), allocatable :: fault, content
    character(len=longest_table), allocatable :: tables(:)
    character(len=*), parameter :: scripts(*) = [character(len=10) :: ".gp", animation // ".gp"]
    logical :: there
    integer :: i, k

    fault = ""
    if (.not. file_exists(folder // "/.")) return
    tables = all_tables()
    do i = 1, size(tables)
      call read_content(folder // "/" // trim(tables(i)) // ".csv", content, there)
      if (there) then
        fault = check_table(trim(tables(i)), content)
        if (fault == "" .and. control_character(content)) fault = "control character"
        if (fault == "" .and. .not. quoted(input)) fault = preamble(content)
        if (fault == "" .and. tables(i) == "multipliers") fault = verdict(said, content)
        if (fault /= "") fault = trim(tables(i)) // ".csv: " // fault
      end if
      if (fault /= "") return
      do k = 1, size(scripts)
        call read_content(folder // "/" // trim(tables(i)) // trim(scripts(k)), content, there)
        if (there) fault = script(input, content)
        if (fault /= "") fault = trim(tables(i)) // trim(scripts(k)) // ": " // fault
        if (fault /= "") return
      end do
    end do
    call read_content(folder // "/report.html", content, there)
    if (.not. there) return
    if (absurd_word(content) /= "" .and. .not. quoted(input)) fault = "report.html: " // absurd_word(content)
    if (control_character(content)) fault = "report.html: control character"
    if (.not. has(content, "</html>" // newline)) fault = "report.html: is not complete"
  end function results

  !> The # lines that head a table.
  function preamble(content) result(fault)
    character(len=*), intent(in) :: content
    character(len=:), allocatable :: fault
    integer :: last

    fault = ""
    last = index(content, newline // "#", back=.true.)
    if (last == 0) last = 1
    last = last + index(content(last + 1:), newline)
    if (absurd_word(content(:last)) /= "") fault = absurd_word(content(:last)) // " in a # line"
    if (index(content, "# title:") /= 1) fault = "its # lines do not begin with the title"
  end function preamble

  !> Whether the report and the table tell the same verdict.
  function verdict(said, multipliers) result(fault)
    character(len=*), intent(in) :: said, multipliers
    character(len=:), allocatable :: fault, word

    fault = ""
    if (.not. has(said, newline // "VERDICT  ")) return
    word = verdict_of_multipliers(multipliers)
    if (word == "undecided" .and. has(said, newline // "VERDICT  undamped:")) word = "undamped"
    if (word /= "" .and. .not. has(said, newline // "VERDICT  " // word // ":")) fault = "the multipliers are " // word // &
      & ", the report tells another verdict"
  end function verdict

  !> A script for gnuplot: NaN stands there only as what is not to be drawn.
  function script(input, content) result(fault)
    type(input_type), intent(in) :: input
    character(len=*), intent(in) :: content
    character(len=:), allocatable :: fault
    integer :: at, next

    fault = ""
    if (len(content) == 0) then
      fault = "is empty"
    else if (content(len(content):) /= newline) then
      fault = "its last line does not end"
    else if (control_character(content)) then
      fault = "control character"
    else if (.not. quoted(input)) then
      if (has(content, "***")) fault = "***"
      if (has(content, "Infinity")) fault = "Infinity"
      at = 1
      do
        next = index(content(at:), "NaN")
        if (next == 0) exit
        at = at + next - 1
        if (.not. (content(at - 2:at - 1) == ": " .or. content(max(1, at - 5):at - 1) == "plot " .or. &
          & content(at + 3:min(at + 10, len(content))) == " notitle")) fault = "NaN"
        at = at + 3
      end do
    end if
  end function script

  !> Whether the input itself brings such words, as in a title: then they may be repeated.
  logical function quoted(input)
    type(input_type), intent(in) :: input
    integer :: i

    quoted = suspicious(input%document) .or. suspicious(input%file) .or. suspicious(input%folder)
    do i = 1, size(input%words)
      quoted = quoted .or. suspicious(input%words(i)%text)
    end do
  end function quoted

  pure logical function suspicious(words)
    character(len=*), intent(in) :: words

    suspicious = has(lowered(words), "nan") .or. has(lowered(words), "inf") .or. has(words, "***")
  end function suspicious

  !> A name as messages may show it: ? in place of all that is no character of ASCII.
  pure function printable(name) result(shown)
    character(len=*), intent(in) :: name
    character(len=len(name)) :: shown
    integer :: i

    shown = name
    do i = 1, len(name)
      if (ichar(name(i:i)) < 32 .or. ichar(name(i:i)) >= 127) shown(i:i) = "?"
    end do
  end function printable

  !> The same of all lines.
  pure function in_lines(text) result(shown)
    character(len=*), intent(in) :: text
    character(len=len(text)) :: shown
    integer :: i

    shown = printable(text)
    do i = 1, len(text)
      if (text(i:i) == newline) shown(i:i) = newline
    end do
  end function in_lines

  !> A message without what is particular to it: its words, no digits, no more than 60 characters.
  pure function first_words(message) result(words)
    character(len=*), intent(in) :: message
    character(len=:), allocatable :: words
    integer :: i

    words = ""
    do i = 1, min(len(message), 120)
      if (message(i:i) == newline .or. len(words) == 60) exit
      if (ichar(message(i:i)) < 32 .or. scan(message(i:i), "0123456789") > 0) cycle
      words = words // message(i:i)
    end do
  end function first_words

  !> The first words of the line that holds a word.
  pure function line_with(text, word) result(line)
    character(len=*), intent(in) :: text, word
    character(len=:), allocatable :: line
    integer :: at

    at = index(text, word)
    at = index(text(:at), newline, back=.true.) + 1
    line = first_words(text(at:))
    line = trim(adjustl(line(:min(24, len(line)))))
  end function line_with

end module fuzz_oracle
