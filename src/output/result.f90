!> Collects the results of a run: tables with their pictures, headlines of the report, and the text of the report.
module gestell_output_result
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_text, only: either, newline
  use gestell_base_verdict, only: judgement_type, not_judged, operator(/=), operator(==), operator(>), stable, unjudged, &
    & verdict_type, worst
  use gestell_base_words, only: character_count
  use gestell_input_wording, only: counted
  use gestell_output_file_output, only: write_file
  use gestell_output_picture_animation, only: animated_svg
  use gestell_output_picture_scene, only: scene_type
  use gestell_output_picture_scene_script, only: write_animation, write_still
  use gestell_output_picture_script, only: figure_type, new_figure, write_figure
  use gestell_output_file_result_files, only: animation, longest_table
  use gestell_output_head, only: head_type
  use gestell_output_report_in_units, only: convert_lines, convert_sentence, lay_out
  use gestell_output_report_verdict, only: alarm, section
  use gestell_output_report_wrapping, only: widest, wrapped
  use gestell_output_table, only: column_type, new_table, table_type
  use gestell_output_table_csv, only: write_csv
  use gestell_output_table_result_units, only: result_units_type
  implicit none (type, external)
  private

  !> A sentence that stands at the top of the report.
  type, public :: headline_type
    !> Verdict that the sentence states, or `not_judged`
    type(verdict_type) :: state
    !> The sentence
    character(len=:), allocatable :: words
    !> True if the report also contains the sentence at another place
    logical :: printed = .false.
  end type headline_type

  !> A result file that is not a table.
  type :: attachment_type
    !> `name`: name of the file. `bytes`: content of the file
    character(len=:), allocatable :: name, bytes
  end type attachment_type

  !> All results of a run.
  type, public :: result_type
    type(table_type), allocatable :: tables(:)
    !> Pictures. A table may have several; the first has the name of the table
    type(figure_type), allocatable :: figures(:)
    !> Sentences that stand at the top of the report
    type(headline_type), allocatable :: headlines(:)
    !> Texts of all headlines, by which a repeated headline is recognised and not added again
    type(dictionary_type), private :: headline_texts
    !> Result files that are not tables
    type(attachment_type), allocatable, private :: attachments(:)
    !> The report
    character(len=:), allocatable :: report
    !> `printed`: number of characters of the report that have been printed. `headline_position`: position in the report at which
    !> the headlines are to be inserted; -1 if no position is marked
    integer, private :: printed = 0, headline_position = -1
    !> Diagnostics of the numerical solution
    character(len=:), allocatable :: details
    !> True if the report is to include the diagnostics in `details`
    logical :: verbose = .false.
    !> Units of the results
    type(result_units_type) :: units
    !> Messages that are printed separately from the report; each is one line
    character(len=:), allocatable :: notes
    !> Table that --one-line prints, with one row for each machine
    type(table_type) :: brief
    !> Verdict on the machine of the input
    type(verdict_type) :: verdict
    !> Worst verdict on several machines, such as the machine at all speeds of a range
    type(judgement_type) :: judgement
    !> True if there is a verdict on several machines that are not the points of a sweep
    logical, private :: judged_range = .false.
    !> Worst of all verdicts of the run
    type(verdict_type) :: worst
    !> True if all machines with a verdict are stable
    logical :: all_stable = .true.
    !> First failure of a computation on which the verdict does not depend
    type(error_type), allocatable :: failure
  contains
    procedure :: begin, has, left, add_curves, add, add_figure, animate, animations, attach, draw
    procedure :: find_file, moves, scenes, write_lines, write_section, detail, note, reserve_headlines, insert_headlines
    procedure :: summary_line, unprinted_report, warn, warn_each, judge, include_verdict, record_failure
    procedure :: write => write_result
  end type result_type

contains

  !> Makes the result empty. `verbose`: true if the report is to include the diagnostics. `units`: units of the results, by default
  !> SI units
  pure subroutine begin(self, verbose, units)
    class(result_type), intent(inout) :: self
    logical, intent(in) :: verbose
    type(result_units_type), intent(in), optional :: units

    self%verbose = verbose
    if (present(units)) self%units = units
    allocate(self%tables(0), self%figures(0), self%headlines(0), self%attachments(0))
    self%report = ""
    self%details = ""
    self%notes = ""
    self%brief = new_table("", "", "", unjudged)
  end subroutine begin

  !> True if the result contains a table called `name`.
  pure logical function has(self, name)
    class(result_type), intent(in) :: self
    character(len=*), intent(in) :: name
    integer :: i

    has = any([(self%tables(i)%name == name, i = 1, size(self%tables))])
  end function has

  !> Names, without endings, of all files that the result will write. Each name occurs once.
  pure function left(self) result(names)
    class(result_type), intent(in) :: self
    character(len=longest_table), allocatable :: names(:)
    integer :: i

    names = [character(len=longest_table) :: (self%tables(i)%name, i = 1, size(self%tables)), &
      & (self%figures(i)%name, i = 1, size(self%figures)), &
      & (self%attachments(i)%name(:index(self%attachments(i)%name, ".") - 1), i = 1, size(self%attachments))]
    do i = 1, size(names)
      if (index(names(i), animation) > 0) names(i) = names(i)(:index(names(i), animation) - 1)
    end do
    names = pack(names, [(all(names(:i - 1) /= names(i)), i = 1, size(names))])
  end function left

  !> Adds a table and, if present, its picture. If the table has no verdict of its own, it gets the verdict on the machine of the
  !> input.
  pure subroutine add(self, table, figure)
    class(result_type), intent(inout) :: self
    type(table_type), intent(in) :: table
    type(figure_type), intent(in), optional :: figure
    type(table_type), allocatable :: longer(:)
    type(column_type), allocatable :: columns(:)
    integer :: i, n

    n = size(self%tables)
    allocate(longer(n + 1))
    do i = 1, n
      ! the columns of earlier tables are moved, not copied
      call move_alloc(self%tables(i)%columns, columns)
      longer(i) = self%tables(i)
      call move_alloc(columns, longer(i)%columns)
    end do
    longer(n + 1) = table
    call move_alloc(longer, self%tables)
    associate (added => self%tables(size(self%tables)))
      call added%convert(self%units)
      if (.not. allocated(added%verdict)) added%verdict = judgement_type(self%verdict)
    end associate
    if (present(figure)) self%figures = [self%figures, figure]
  end subroutine add

  !> Adds a further picture of a table.
  pure subroutine add_figure(self, figure)
    class(result_type), intent(inout) :: self
    type(figure_type), intent(in) :: figure

    self%figures = [self%figures, figure]
  end subroutine add_figure

  !> Adds a result file that is not a table.
  pure subroutine attach(self, name, bytes)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: name, bytes
    type(attachment_type) :: attachment

    attachment%name = name
    attachment%bytes = bytes
    self%attachments = [self%attachments, attachment]
  end subroutine attach

  !> Returns the content of a result file that is neither table nor script nor drawn by gnuplot; `bytes` stays unallocated if there
  !> is no such file. `title`: title of the input.
  subroutine find_file(self, name, title, bytes)
    class(result_type), intent(in) :: self
    character(len=*), intent(in) :: name, title
    character(len=:), allocatable, intent(out) :: bytes
    integer :: i

    do i = 1, size(self%attachments)
      if (self%attachments(i)%name == name) bytes = self%attachments(i)%bytes
    end do
    do i = 1, size(self%figures)
      associate (figure => self%figures(i))
        if (.not. allocated(figure%scenes)) cycle
        if (figure%name // ".svg" == name) allocate(bytes, source=animated_svg(figure%scenes, title, figure%shown))
      end associate
    end do
  end subroutine find_file

  !> Adds a still picture of scenes, which shows the table called `name`. `shown`: what the picture shows.
  subroutine draw(self, name, shown, scenes)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: name, shown
    type(scene_type), intent(in) :: scenes(:)
    type(figure_type) :: figure
    character(len=:), allocatable :: commands
    integer :: pixels(2)

    call write_still(scenes, commands, pixels)
    figure = new_figure(name, shown, commands, width=pixels(1), height=pixels(2))
    call self%add_figure(figure)
  end subroutine draw

  !> Adds an animation of the picture called `name`: the file NAME_motion.svg, and a gnuplot script that draws NAME_motion.gif.
  !> `shown`: what the animation shows.
  subroutine animate(self, name, shown, scenes)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: name, shown
    type(scene_type), intent(in) :: scenes(:)
    type(figure_type) :: figure

    figure = new_figure(name // animation, shown, "")
    figure%scenes = scenes
    call self%add_figure(figure)
  end subroutine animate

  !> True if the result contains an animation.
  pure logical function moves(self)
    class(result_type), intent(in) :: self
    integer :: i

    moves = any([(allocated(self%figures(i)%scenes), i = 1, size(self%figures))])
  end function moves

  !> The scenes of all animations, as a list in JSON.
  pure function scenes(self) result(words)
    class(result_type), intent(in) :: self
    character(len=:), allocatable :: words
    type(growing_text_type) :: list
    integer :: i, k

    do i = 1, size(self%figures)
      if (.not. allocated(self%figures(i)%scenes)) cycle
      do k = 1, size(self%figures(i)%scenes)
        call list%append("," // newline // self%figures(i)%scenes(k)%json())
      end do
    end do
    words = list%whole()
    words = "[" // words(min(2, len(words) + 1):) // "]"
  end function scenes

  !> Names of the files with animations, separated by commas.
  pure function animations(self) result(names)
    class(result_type), intent(in) :: self
    character(len=:), allocatable :: names
    integer :: i

    names = ""
    do i = 1, size(self%figures)
      if (allocated(self%figures(i)%scenes)) names = names // either(", ", "", names /= "") // self%figures(i)%name // ".svg"
    end do
  end function animations

  !> Adds curves to the pictures of a table, whose gnuplot scripts plot them by the macro @over. Does nothing if there is no such
  !> picture.
  pure subroutine add_curves(self, table, curves)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: table, curves
    integer :: i

    do i = 1, size(self%figures)
      if (self%figures(i)%table == table) self%figures(i)%lines = "over = """ // curves // """" // newline // self%figures(i)%lines
    end do
  end subroutine add_curves

  !> Appends lines to the report, in the units of the results. Long lines are broken.
  pure subroutine write_lines(self, lines)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: lines
    character(len=:), allocatable :: text

    call lay_out(lines, self%units, text)
    self%report = self%report // text
  end subroutine write_lines

  !> Appends to the report a section on the vibration of the input's machine. If this vibration is unstable, undamped or undecided,
  !> a warning follows the heading.
  pure subroutine write_section(self, heading, lines)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: heading, lines

    call self%write_lines(section(heading, self%verdict) // lines)
  end subroutine write_section

  !> Appends diagnostics of the numerical solution. They are part of the report only if `verbose` is true.
  pure subroutine detail(self, lines)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: lines
    character(len=:), allocatable :: text

    if (self%verbose) call self%write_lines(lines)
    call convert_lines(lines, self%units, text)
    self%details = self%details // text
  end subroutine detail

  !> Marks the position of the headlines in the report. The report after this position is not printed until `insert_headlines` has
  !> inserted the headlines.
  pure subroutine reserve_headlines(self)
    class(result_type), intent(inout) :: self

    self%headline_position = len(self%report)
  end subroutine reserve_headlines

  !> Inserts the headlines at the position that `reserve_headlines` has marked: first the verdict, then the warnings.
  pure subroutine insert_headlines(self)
    class(result_type), intent(inout) :: self
    type(growing_text_type) :: lines
    integer :: i

    if (self%headline_position < 0 .or. self%verdict == not_judged) return
    call lines%append(newline // "VERDICT  ")
    do i = 1, size(self%headlines)
      if (self%headlines(i)%printed) cycle
      if (i > 1) call lines%append("  ")
      call lines%append(self%headlines(i)%words // newline)
    end do
    self%report = self%report(:self%headline_position) // wrapped(lines%whole()) // self%report(self%headline_position + 1:)
    self%headline_position = -1
  end subroutine insert_headlines

  !> Last line of the report: the worst verdict and as many warnings as fit. If there is no verdict, it is the first headline.
  pure function summary_line(self) result(line)
    class(result_type), intent(in) :: self
    character(len=:), allocatable :: line
    logical :: over_range
    integer :: i, left

    line = ""
    if (size(self%headlines) > 0) line = self%headlines(1)%words // newline
    over_range = self%judgement%verdict > self%verdict .and. (self%judged_range .or. self%verdict /= not_judged)
    if (self%verdict == not_judged .and. .not. over_range) return
    line = "VERDICT  " // trim(self%verdict%word())
    if (over_range) then
      line = "VERDICT  " // self%judgement%sentence(short=.true.)
      if (self%judgement%verdict == stable) line = line // either(" at all speeds", " wherever a solution exists", self%all_stable)
      if (self%verdict /= not_judged) line = line // "; " // either("the machine of the input is", "at the speed of the input", &
        & self%judgement%of_sweep) // " " // trim(self%verdict%word())
    end if
    left = 0
    do i = merge(1, 2, self%verdict == not_judged), size(self%headlines)
      associate (headline => self%headlines(i))
        if (.not. headline%state > stable) cycle
        if (over_range .and. headline%words == self%judgement%sentence()) cycle
        if (left == 0 .and. character_count(line) + character_count(headline%words) + 2 <= widest) then
          line = line // "; " // headline%words
        else
          left = left + 1
        end if
      end associate
    end do
    if (left > 0) line = line // "; " // counted(left, "warning") // " above"
    line = line // newline
  end function summary_line

  !> Adds a message of one line that is printed separately from the report.
  pure subroutine note(self, line)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: line

    self%notes = self%notes // "note: " // line // newline
  end subroutine note

  !> Returns the part of the report that has not been returned by earlier calls.
  function unprinted_report(self) result(lines)
    class(result_type), intent(inout) :: self
    character(len=:), allocatable :: lines

    lines = self%report(self%printed + 1:)
    self%printed = len(self%report)
  end function unprinted_report

  !> Adds the first of `lines` as a headline, unless it is blank or is a headline already. `printed`: true if the report also
  !> contains it at another place.
  pure subroutine warn(self, state, lines, printed)
    class(result_type), intent(inout) :: self
    !> Verdict that the lines state, or `not_judged`
    type(verdict_type), intent(in) :: state
    character(len=*), intent(in) :: lines
    logical, intent(in), optional :: printed
    type(headline_type), allocatable :: longer(:)
    character(len=:), allocatable :: words
    integer :: i, n

    if (len_trim(lines) == 0) return
    call convert_sentence(trim(adjustl(lines(:index(lines // newline, newline) - 1))), self%units, words)
    if (self%headline_texts%position(words) > 0) return
    call self%headline_texts%add(words)
    ! Move the texts instead of copying them: copying dominated the run time.
    n = size(self%headlines)
    allocate(longer(n + 1))
    do i = 1, n
      longer(i)%state = self%headlines(i)%state
      longer(i)%printed = self%headlines(i)%printed
      call move_alloc(self%headlines(i)%words, longer(i)%words)
    end do
    longer(n + 1)%state = state
    if (present(printed)) longer(n + 1)%printed = printed
    call move_alloc(words, longer(n + 1)%words)
    call move_alloc(longer, self%headlines)
  end subroutine warn

  !> Adds each of `lines` as a headline, as `warn` does.
  pure subroutine warn_each(self, state, lines, printed)
    class(result_type), intent(inout) :: self
    !> Verdict that the lines state, or `not_judged`
    type(verdict_type), intent(in) :: state
    character(len=*), intent(in) :: lines
    logical, intent(in), optional :: printed
    integer :: first, last

    first = 1
    do while (first <= len(lines))
      last = first - 1 + index(lines(first:), newline)
      call self%warn(state, lines(first:last), printed)
      first = last + 1
    end do
  end subroutine warn_each

  !> Records a verdict on several machines. The last line of the report states the worst recorded verdict. Of two equally bad
  !> verdicts, it states the one that does not concern a sweep. A verdict worse than stable becomes a headline, unless it concerns
  !> a sweep, which writes a headline of its own.
  pure subroutine judge(self, judgement)
    class(result_type), intent(inout) :: self
    type(judgement_type), intent(in) :: judgement

    associate (before => self%judgement)
      if (judgement%verdict > before%verdict .or. judgement%verdict == before%verdict .and. before%of_sweep) before = judgement
    end associate
    self%judged_range = self%judged_range .or. .not. judgement%of_sweep
    call self%include_verdict(judgement%verdict)
    if (judgement%verdict > stable .and. .not. judgement%of_sweep) call self%warn(judgement%verdict, judgement%sentence())
  end subroutine judge

  !> Includes a verdict in the worst verdict of the run.
  pure subroutine include_verdict(self, verdict)
    class(result_type), intent(inout) :: self
    type(verdict_type), intent(in) :: verdict

    self%worst = worst(self%worst, verdict)
    self%all_stable = self%all_stable .and. (verdict == stable .or. verdict == not_judged)
  end subroutine include_verdict

  !> Records `error` as the failure of the run, unless a failure has been recorded before, and deallocates `error`.
  pure subroutine record_failure(self, error)
    class(result_type), intent(inout) :: self
    type(error_type), allocatable, intent(inout) :: error

    if (allocated(error) .and. .not. allocated(self%failure)) call move_alloc(error, self%failure)
    if (allocated(error)) deallocate(error)
  end subroutine record_failure

  !> Writes all tables, and the gnuplot scripts of their pictures, into `folder`. Fails if a file cannot be written.
  subroutine write_result(self, folder, head, error)
    class(result_type), intent(in) :: self
    character(len=*), intent(in) :: folder
    type(head_type), intent(in) :: head
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: warning
    type(figure_type) :: figure
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
        if (self%tables(k)%name == self%figures(i)%table) warning = alarm(self%tables(k)%verdict)
      end do
      figure = self%figures(i)
      if (allocated(figure%scenes)) then
        call write_animation(figure%scenes, figure%lines, figure%pixels)
        call write_file(folder // "/" // figure%name // ".svg", animated_svg(figure%scenes, trim(head%title), figure%shown), error)
        if (allocated(error)) return
      end if
      call write_figure(folder, figure, head%title, warning, error)
      if (allocated(error)) return
    end do
  end subroutine write_result

end module gestell_output_result
