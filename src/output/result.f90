!> What a run found: tables with their pictures, what heads a page, and the report for people.
module gestell_output_result
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_text, only: either, newline
  use gestell_base_verdict, only: not_judged, operator(==), operator(>), stable, verdict_named, verdict_type, worst
  use gestell_base_words, only: character_count
  use gestell_input_wording, only: counted
  use gestell_output_file_output, only: write_file
  use gestell_output_picture_script, only: figure_type, write_figure
  use gestell_output_file_result_files, only: longest_table
  use gestell_output_head, only: head_type
  use gestell_output_report_verdict, only: alarm, judgement_type, section
  use gestell_output_report_wrapping, only: widest, wrapped
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_csv, only: write_csv
  implicit none (type, external)
  private

  !> A sentence that an engineer reads first; `state`: a verdict's word, empty where it is neither good nor bad.
  type, public :: headline_type
    character(len=9) :: state
    character(len=:), allocatable :: words
    !> Whether the report has it elsewhere.
    logical :: said = .false.
  end type headline_type

  !> A file that is no table.
  type :: attachment_type
    character(len=:), allocatable :: name, bytes
  end type attachment_type

  type, public :: result_type
    type(table_type), allocatable :: tables(:)
    type(figure_type), allocatable :: figures(:)
    type(headline_type), allocatable :: headlines(:)
    type(dictionary_type), private :: warned
    type(attachment_type), allocatable, private :: attachments(:)
    !> The report, and what of it was not yet said.
    character(len=:), allocatable :: report
    integer, private :: said = 0, room = -1
    !> What the numbers rest on, and whether the report tells it.
    character(len=:), allocatable :: details
    logical :: verbose = .false.
    !> What is told beside the report, each on a line of its own.
    character(len=:), allocatable :: notes
    !> What is told of a machine on one line, or of several on one each.
    type(table_type) :: brief
    !> The verdict on the machine of the input; empty: none.
    character(len=9) :: verdict = ""
    !> The worst verdict on a range of machines, and whether any range but a sweep was judged; the worst of all.
    type(judgement_type) :: judgement
    logical, private :: judged_range = .false.
    type(verdict_type) :: worst
    !> Whether every machine that was judged is stable.
    logical :: all_stable = .true.
    !> What the verdict does not depend on and could not be computed, the first.
    type(error_type), allocatable :: failure
  contains
    procedure :: begin
    procedure :: has
    procedure :: left
    procedure :: draw_over
    procedure :: add
    procedure :: attach
    procedure :: say, say_section
    procedure :: detail
    procedure :: note
    procedure :: leave_room
    procedure :: lead
    procedure :: in_short
    procedure :: rest
    procedure :: warn
    procedure :: judge, include_verdict
    procedure :: fail
    procedure :: write => write_result
  end type result_type

contains

  !> Nothing was found yet.
  pure subroutine begin(self, verbose)
    class(result_type), intent(inout) :: self
    logical, intent(in) :: verbose

    self%verbose = verbose
    allocate(self%tables(0), self%figures(0), self%headlines(0), self%attachments(0))
    self%report = ""
    self%details = ""
    self%notes = ""
    self%brief = new_table("", "", "", "")
  end subroutine begin

  !> Whether there is a table of that name.
  pure logical function has(self, name)
    class(result_type), intent(in) :: self
    character(len=*), intent(in) :: name
    integer :: i

    has = any([(self%tables(i)%name == name, i = 1, size(self%tables))])
  end function has

  !> The names of the files that it leaves, without endings.
  pure function left(self) result(names)
    class(result_type), intent(in) :: self
    character(len=longest_table), allocatable :: names(:)
    integer :: i

    names = [character(len=longest_table) :: (self%tables(i)%name, i = 1, size(self%tables)), &
      & (self%figures(i)%name, i = 1, size(self%figures)), &
      & (self%attachments(i)%name(:index(self%attachments(i)%name, ".") - 1), i = 1, size(self%attachments))]
    names = pack(names, [(all(names(:i - 1) /= names(i)), i = 1, size(names))])
  end function left

  !> A table and its picture. A table that says nothing of a verdict has that on the machine of the input.
  pure subroutine add(self, table, figure)
    class(result_type), intent(inout) :: self
    type(table_type), intent(in) :: table
    type(figure_type), intent(in), optional :: figure

    self%tables = [self%tables, table]
    associate (added => self%tables(size(self%tables)))
      if (.not. allocated(added%verdict)) added%verdict = trim(self%verdict)
    end associate
    if (present(figure)) self%figures = [self%figures, figure]
  end subroutine add

  !> A file that stands beside the tables.
  pure subroutine attach(self, name, bytes)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: name, bytes
    type(attachment_type) :: attachment

    attachment%name = name
    attachment%bytes = bytes
    self%attachments = [self%attachments, attachment]
  end subroutine attach

  !> Adds curves to the picture of that name, where its commands plot @over; nothing where there is no such picture.
  pure subroutine draw_over(self, name, curves)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: name, curves
    integer :: i

    do i = 1, size(self%figures)
      if (self%figures(i)%name == name) self%figures(i)%lines = "over = """ // curves // """" // newline &
        & // self%figures(i)%lines
    end do
  end subroutine draw_over

  !> Further lines of the report, those that are too long broken unless they are to stay `whole`.
  pure subroutine say(self, lines, whole)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: lines
    logical, intent(in), optional :: whole

    if (present(whole)) then
      self%report = self%report // lines
    else
      self%report = self%report // wrapped(lines)
    end if
  end subroutine say

  !> A section of the report on the vibration of the machine of the input, with a warning where the machine leaves it.
  pure subroutine say_section(self, heading, lines)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: heading, lines

    call self%say(section(heading, self%verdict) // lines)
  end subroutine say_section

  !> Lines on what the numbers rest on, which only some readers want: the report tells them if it is verbose.
  pure subroutine detail(self, lines)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: lines

    if (self%verbose) call self%say(lines)
    self%details = self%details // lines
  end subroutine detail

  !> Here the headlines will stand when all are known; nothing behind them is said before.
  pure subroutine leave_room(self)
    class(result_type), intent(inout) :: self

    self%room = len(self%report)
  end subroutine leave_room

  !> Puts the headlines where room was left: the verdict first, with what is wrong below it.
  pure subroutine lead(self)
    class(result_type), intent(inout) :: self
    type(growing_text_type) :: lines
    integer :: i

    if (self%room < 0 .or. self%verdict == "") return
    call lines%append(newline // "VERDICT  ")
    do i = 1, size(self%headlines)
      if (self%headlines(i)%said) cycle
      if (i > 1) call lines%append("  ")
      call lines%append(self%headlines(i)%words // newline)
    end do
    self%report = self%report(:self%room) // wrapped(lines%whole()) // self%report(self%room + 1:)
    self%room = -1
  end subroutine lead

  !> The worst verdict on one line, with what is wrong as far as there is room; where nothing was judged, what was found first.
  pure function in_short(self) result(line)
    class(result_type), intent(in) :: self
    character(len=:), allocatable :: line
    logical :: over_range
    integer :: i, left

    line = ""
    if (size(self%headlines) > 0) line = self%headlines(1)%words // newline
    over_range = self%judgement%verdict > verdict_named(self%verdict) .and. (self%judged_range .or. self%verdict /= "")
    if (self%verdict == "" .and. .not. over_range) return
    line = "VERDICT  " // trim(self%verdict)
    if (over_range) then
      line = "VERDICT  " // self%judgement%words(:scan(self%judgement%words // ",", ",") - 1)
      if (self%judgement%verdict == stable) line = line // either(" at all speeds", " where it could be solved", &
        & self%all_stable)
      if (self%verdict /= "") line = line // "; " // either("the machine of the input is", "at the speed of the input", &
        & self%judgement%of_sweep) // " " // trim(self%verdict)
    end if
    left = 0
    do i = merge(1, 2, self%verdict == ""), size(self%headlines)
      associate (headline => self%headlines(i))
        if (any(headline%state == [character(len=9) :: "stable", ""])) cycle
        if (over_range .and. headline%words == self%judgement%words) cycle
        if (left == 0 .and. character_count(line) + character_count(headline%words) + 2 <= widest) then
          line = line // "; " // headline%words
        else
          left = left + 1
        end if
      end associate
    end do
    if (left > 0) line = line // "; " // counted(left, "warning") // " above"
    line = line // newline
  end function in_short

  !> A line beside the report.
  pure subroutine note(self, line)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: line

    self%notes = self%notes // "note: " // line // newline
  end subroutine note

  !> What of the report was not yet taken.
  function rest(self) result(lines)
    class(result_type), intent(inout) :: self
    character(len=:), allocatable :: lines

    lines = self%report(self%said + 1:)
    self%said = len(self%report)
  end function rest

  !> Adds the first line as a headline, unless it is blank or already one. `said`: the report has it elsewhere.
  pure subroutine warn(self, state, lines, said)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: state, lines
    logical, intent(in), optional :: said
    type(headline_type), allocatable :: longer(:)
    character(len=:), allocatable :: words
    integer :: i, n

    if (len_trim(lines) == 0) return
    words = trim(adjustl(lines(:index(lines // newline, newline) - 1)))
    if (self%warned%position(words) > 0) return
    call self%warned%add(words)
    ! the words move: copies of all would cost more than the rest
    n = size(self%headlines)
    allocate(longer(n + 1))
    do i = 1, n
      longer(i)%state = self%headlines(i)%state
      longer(i)%said = self%headlines(i)%said
      call move_alloc(self%headlines(i)%words, longer(i)%words)
    end do
    longer(n + 1)%state = state
    if (present(said)) longer(n + 1)%said = said
    call move_alloc(words, longer(n + 1)%words)
    call move_alloc(longer, self%headlines)
  end subroutine warn

  !> Takes a judgement on a range of machines: one that is not stable becomes a headline, the worst one the last line. A sweep has
  !> a headline of its own, which is the last line too if nothing else was judged.
  pure subroutine judge(self, judgement)
    class(result_type), intent(inout) :: self
    type(judgement_type), intent(in) :: judgement

    associate (before => self%judgement)
      if (judgement%verdict > before%verdict .or. judgement%verdict == before%verdict .and. before%of_sweep) before = judgement
    end associate
    self%judged_range = self%judged_range .or. .not. judgement%of_sweep
    call self%include_verdict(judgement%verdict)
    if (judgement%verdict > stable .and. .not. judgement%of_sweep) call self%warn(judgement%verdict%word(), judgement%words)
  end subroutine judge

  !> Counts a verdict among those of which the worst one is that of the run.
  pure subroutine include_verdict(self, verdict)
    class(result_type), intent(inout) :: self
    type(verdict_type), intent(in) :: verdict

    self%worst = worst(self%worst, verdict)
    self%all_stable = self%all_stable .and. (verdict == stable .or. verdict == not_judged)
  end subroutine include_verdict

  !> Keeps the first failure.
  pure subroutine fail(self, error)
    class(result_type), intent(inout) :: self
    type(error_type), allocatable, intent(inout) :: error

    if (allocated(error) .and. .not. allocated(self%failure)) call move_alloc(error, self%failure)
    if (allocated(error)) deallocate(error)
  end subroutine fail

  !> Writes all tables and the scripts of their pictures into `folder`. Error: one cannot be written.
  subroutine write_result(self, folder, head, error)
    class(result_type), intent(in) :: self
    character(len=*), intent(in) :: folder
    type(head_type), intent(in) :: head
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: warning
    integer :: i, k

    do i = 1, size(self%attachments)
      call write_file(folder // "/" // self%attachments(i)%name, self%attachments(i)%bytes, error)
      if (allocated(error)) return
    end do
    do i = 1, size(self%tables)
      if (.not. self%tables(i)%written) call write_csv(folder, self%tables(i), head%lines(self%tables(i)), error)
      if (allocated(error)) return
    end do
    do i = 1, size(self%figures)
      warning = ""
      do k = 1, size(self%tables)
        if (self%tables(k)%name == self%figures(i)%name) warning = alarm(self%tables(k)%verdict)
      end do
      call write_figure(folder, self%figures(i), head%title, warning, error)
      if (allocated(error)) return
    end do
  end subroutine write_result

end module gestell_output_result
