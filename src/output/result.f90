!> What a run found: tables with their pictures, what heads a page, and the report for people.
module gestell_output_result
  use gestell_base_error, only: error_type
  use gestell_output_picture_script, only: figure_type, write_figure
  use gestell_output_head, only: head_type
  use gestell_output_report_verdict, only: alarm
  use gestell_output_table, only: new_table, table_type
  use gestell_output_table_csv, only: write_csv
  implicit none (type, external)
  private

  !> A sentence that an engineer reads first; `state`: stable, unstable or undecided, empty where it is neither good nor bad.
  type, public :: headline_type
    character(len=9) :: state
    character(len=:), allocatable :: words
  end type headline_type

  type, public :: result_type
    type(table_type), allocatable :: tables(:)
    type(figure_type), allocatable :: figures(:)
    type(headline_type), allocatable :: headlines(:)
    !> The report, and what of it was not yet said.
    character(len=:), allocatable :: report
    integer, private :: said = 0, room = -1
    !> What is told beside the report, each on a line of its own.
    character(len=:), allocatable :: notes
    !> What is told of a machine on one line, or of several on one each.
    type(table_type) :: brief
    !> The verdict on the machine of the input; empty: none.
    character(len=9) :: verdict = ""
    !> Whether every machine that was judged is stable.
    logical :: all_stable = .true.
    !> What the verdict does not depend on and could not be computed, the first.
    type(error_type), allocatable :: failure
  contains
    procedure :: begin
    procedure :: has
    procedure :: draw
    procedure :: draw_over
    procedure :: add
    procedure :: say
    procedure :: note
    procedure :: leave_room
    procedure :: lead
    procedure :: in_short
    procedure :: rest
    procedure :: warn
    procedure :: judge
    procedure :: fail
    procedure :: write => write_result
  end type result_type

  character, parameter :: newline = new_line("a")

contains

  pure subroutine begin(self)
    class(result_type), intent(inout) :: self

    allocate(self%tables(0), self%figures(0), self%headlines(0))
    self%report = ""
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

  !> A table and its picture.
  pure subroutine add(self, table, figure)
    class(result_type), intent(inout) :: self
    type(table_type), intent(in) :: table
    type(figure_type), intent(in), optional :: figure

    self%tables = [self%tables, table]
    if (present(figure)) self%figures = [self%figures, figure]
  end subroutine add

  !> Pictures of tables that are there.
  pure subroutine draw(self, figures)
    class(result_type), intent(inout) :: self
    type(figure_type), intent(in) :: figures(:)
    integer :: i

    do i = 1, size(figures)
      self%figures = [self%figures, figures(i)]
    end do
  end subroutine draw

  !> Adds curves to the picture of that name, behind what its last command plots; nothing where there is no such picture.
  pure subroutine draw_over(self, name, curves)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: name, curves
    integer :: i

    do i = 1, size(self%figures)
      if (self%figures(i)%name == name) self%figures(i)%lines = self%figures(i)%lines // curves
    end do
  end subroutine draw_over

  !> Further lines of the report.
  pure subroutine say(self, lines)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: lines

    self%report = self%report // lines
  end subroutine say

  !> Here the headlines will stand when all are known; nothing behind this place is said before.
  pure subroutine leave_room(self)
    class(result_type), intent(inout) :: self

    self%room = len(self%report)
  end subroutine leave_room

  !> Puts the headlines where room was left: the verdict first, with what is wrong below it.
  pure subroutine lead(self)
    class(result_type), intent(inout) :: self
    character(len=:), allocatable :: lines
    integer :: i

    if (self%room < 0 .or. self%verdict == "") return
    lines = newline // "VERDICT  "
    do i = 1, size(self%headlines)
      if (i > 1) lines = lines // "  "
      lines = lines // self%headlines(i)%words // newline
    end do
    self%report = self%report(:self%room) // lines // self%report(self%room + 1:)
    self%room = -1
  end subroutine lead

  !> The verdict in one line, with what is wrong; empty without a verdict.
  pure function in_short(self) result(line)
    class(result_type), intent(in) :: self
    character(len=:), allocatable :: line
    integer :: i

    line = ""
    if (self%verdict == "") return
    line = "VERDICT  " // trim(self%verdict)
    do i = 2, size(self%headlines)
      if (all(self%headlines(i)%state /= [character(len=9) :: "stable", ""])) line = line // "; " // self%headlines(i)%words
    end do
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

  !> A headline, the first of these lines; nothing where there are none, and where it stands there already.
  pure subroutine warn(self, state, lines)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: state, lines
    type(headline_type) :: headline
    integer :: i

    if (len_trim(lines) == 0) return
    headline%state = state
    headline%words = trim(adjustl(lines(:index(lines // newline, newline) - 1)))
    do i = 1, size(self%headlines)
      if (self%headlines(i)%words == headline%words) return
    end do
    self%headlines = [self%headlines, headline]
  end subroutine warn

  !> The verdict on a range of machines, "stable" or a sentence that begins UNSTABLE or UNDECIDED: what is not stable is a headline.
  pure subroutine judge(self, verdict)
    class(result_type), intent(inout) :: self
    character(len=*), intent(in) :: verdict

    if (verdict == "stable") return
    self%all_stable = .false.
    call self%warn(merge("unstable ", "undecided", index(verdict, "UNSTABLE") == 1), verdict)
  end subroutine judge

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
