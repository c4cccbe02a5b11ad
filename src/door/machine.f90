!> A machine as programs hold it: in the language of input files, or built in code.
module gestell_door_machine
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_door_solution, only: solution_type, solve_document
  use gestell_input_namelist, only: parse_document, read_document
  use gestell_input_namelist_document, only: document_type, group_type
  use gestell_input_schema, only: find_group_rule, schema_type
  use gestell_input_schema_check, only: check_document, normalise
  use gestell_input_schema_path, only: get_path, set_path_real, set_path_text
  use gestell_output_head, only: setting_type
  use gestell_task_registry, only: input_schema
  use, intrinsic :: iso_fortran_env, only: int64
  !$ use omp_lib, only: omp_pause_resource_all, omp_pause_soft
  implicit none (type, external)
  private

  !> What an input file says (doc/input.md). Paths, keys and units are those of the language, as in --set: `drive.speed_rpm` is in
  !> 1/min, whatever the units of the results. What several threads call at the same time is done one after the other: gfortran 12
  !> keeps the lengths of texts that functions give in static memory, whatever the flags.
  type, public :: machine_type
    private
    !> Without groups: there is no machine yet.
    type(document_type) :: document
    type(schema_type), allocatable :: schema
    !> Groups that were added since and are not yet in the document: the first `waiting` of these. So to add n groups costs n steps.
    type(group_type), allocatable :: added(:)
    integer :: waiting = 0
    !> How many groups of each name of the schema there are; allocated where some were added.
    integer, allocatable :: counts(:)
    !> Whether the document has been checked since it was changed.
    logical :: checked = .false.
    !> What was set.
    type(setting_type), allocatable :: settings(:)
  contains
    procedure :: read => read_file
    procedure :: parse
    procedure :: add
    procedure, private :: set_number
    procedure, private :: set_text
    generic :: set => set_number, set_text
    procedure :: get
    procedure :: solve
  end type machine_type

  !> Stands in messages for the name of a file.
  character(len=*), parameter :: text_name = "text"
  !> Whole numbers below it are set without point and exponent, as keys of whole numbers want them.
  real(dp), parameter :: longest_whole = 1.0e15_dp

contains

  !> Takes the machine of an input file. Error: it cannot be read, or has no sense; the message points into it.
  subroutine read_file(self, file, error)
    class(machine_type), intent(out) :: self
    character(len=*), intent(in) :: file
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: document

    !$omp critical (gestell_door)
    call read_document(file, document, error)
    if (.not. allocated(error)) call accept(self, document, error)
    !$omp end critical (gestell_door)
  end subroutine read_file

  !> Takes the machine of a text in the same language, its lines ended by new_line('a'). Error: it makes no sense.
  subroutine parse(self, text, error)
    class(machine_type), intent(out) :: self
    character(len=*), intent(in) :: text
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: document

    !$omp critical (gestell_door)
    call parse_document(text, text_name, document, error)
    if (.not. allocated(error)) call accept(self, document, error)
    !$omp end critical (gestell_door)
  end subroutine parse

  !> Takes a document. Error: it says what the language does not know, or lacks what it needs.
  subroutine accept(self, document, error)
    class(machine_type), intent(inout) :: self
    type(document_type), intent(inout) :: document
    type(error_type), allocatable, intent(out) :: error

    self%schema = input_schema()
    call check_document(document, self%schema, error)
    if (allocated(error)) return
    self%document = document
    self%checked = .true.
    allocate(self%settings(0))
  end subroutine accept

  !> Adds groups, "&joint name='B', type='RRR', ... /", to a machine, or to none: so it is built in code. What is missing is told
  !> when it is solved. Error: they make no sense; the machine stays as it was.
  subroutine add(self, groups, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: groups
    type(error_type), allocatable, intent(out) :: error

    !$omp critical (gestell_door)
    call append(self, groups, error)
    !$omp end critical (gestell_door)
  end subroutine add

  subroutine append(self, groups, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: groups
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: more
    type(group_type), allocatable :: longer(:)
    integer :: i, n

    call parse_document(groups, text_name, more, error)
    if (allocated(error)) return
    if (.not. allocated(self%schema)) self%schema = input_schema()
    if (.not. allocated(self%counts)) then
      allocate(self%counts(size(self%schema%groups)), source=0)
      if (allocated(self%document%groups)) call count_names(self, self%document%groups)
    end if
    call normalise(more, self%schema, error, self%counts)
    if (allocated(error)) return
    n = self%waiting + size(more%groups)
    if (.not. allocated(self%added)) allocate(self%added(n))
    if (n > size(self%added)) then
      allocate(longer(2 * n))
      do i = 1, self%waiting
        longer(i) = self%added(i)
      end do
      call move_alloc(longer, self%added)
    end if
    do i = 1, size(more%groups)
      self%added(self%waiting + i) = more%groups(i)
    end do
    self%waiting = n
    call count_names(self, more%groups)
    if (.not. allocated(self%settings)) allocate(self%settings(0))
    self%checked = .false.
  end subroutine append

  !> Counts groups by their names, which the schema has.
  subroutine count_names(self, groups)
    class(machine_type), intent(inout) :: self
    type(group_type), intent(in) :: groups(:)
    integer :: i, rule

    do i = 1, size(groups)
      rule = find_group_rule(self%schema, groups(i)%name)
      self%counts(rule) = self%counts(rule) + 1
    end do
  end subroutine count_names

  !> The document with all groups that were added. Error: there is no machine yet.
  subroutine put_together(self, document, error)
    class(machine_type), intent(in) :: self
    type(document_type), intent(out) :: document
    type(error_type), allocatable, intent(out) :: error
    integer :: i, n

    n = 0
    if (allocated(self%document%groups)) n = size(self%document%groups)
    if (n + self%waiting == 0) then
      call fatal_error(error, "there is no machine yet: read one first", invalid_input)
      return
    end if
    if (self%waiting == 0) then
      document = self%document
      return
    end if
    document%file = text_name
    if (n > 0) document%file = self%document%file
    if (n > 0 .and. allocated(self%document%path)) document%path = self%document%path
    allocate(document%groups(n + self%waiting))
    do i = 1, size(document%groups)
      if (i <= n) document%groups(i) = self%document%groups(i)
      if (i > n) document%groups(i) = self%added(i - n)
    end do
    call normalise(document, self%schema, error)
  end subroutine put_together

  !> Gives a path a number, to all its digits. Error: there is no such path, or the number makes no sense there.
  subroutine set_number(self, path, value, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: path
    real(dp), intent(in) :: value
    type(error_type), allocatable, intent(out) :: error
    character(len=24) :: digits

    if (abs(value - aint(value)) <= 0 .and. abs(value) < longest_whole) then
      write(digits, "(i0)") int(value, int64)
    else
      write(digits, "(es24.16e3)") value
    end if
    call self%set_text(path, trim(adjustl(digits)), error)
  end subroutine set_number

  !> Gives a path what would stand behind the sign of equality of --set. Errors: as of numbers.
  subroutine set_text(self, path, value, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: path, value
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: document

    !$omp critical (gestell_door)
    if (self%waiting > 0 .or. .not. allocated(self%document%groups)) then
      call put_together(self, document, error)
      if (.not. allocated(error)) then
        self%document = document
        self%waiting = 0
      end if
    end if
    if (.not. allocated(error)) call set_path_text(self%document, self%schema, path, value, error)
    ! Setting a path may have added a group.
    if (allocated(self%counts)) deallocate(self%counts)
    if (.not. allocated(error)) call remember(self, path, value)
    !$omp end critical (gestell_door)
  end subroutine set_text

  !> Keeps what was set last to a path.
  subroutine remember(self, path, value)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: path, value
    type(setting_type) :: setting
    integer :: i

    self%checked = .false.
    setting%text = path // "=" // value
    do i = 1, size(self%settings)
      if (index(self%settings(i)%text, path // "=") /= 1) cycle
      self%settings(i) = setting
      return
    end do
    self%settings = [self%settings, setting]
  end subroutine remember

  !> The numbers that a path names, as they were given. Error: there is no such path, or no number there.
  subroutine get(self, path, values, error)
    class(machine_type), intent(in) :: self
    character(len=*), intent(in) :: path
    real(dp), allocatable, intent(out) :: values(:)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: document

    !$omp critical (gestell_door)
    call put_together(self, document, error)
    if (.not. allocated(error)) call get_path(document, self%schema, path, values, error)
    !$omp end critical (gestell_door)
  end subroutine get

  !> Does what the input orders, or these `tasks` (as they would be typed, "stability, response"), to a relative `tolerance` in
  !> place of the input's. Nothing is written and nothing printed. Errors: the input makes no sense; an impossible mechanism; a
  !> computation that fails.
  subroutine solve(self, solution, error, tasks, tolerance)
    class(machine_type), intent(in) :: self
    type(solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    character(len=*), intent(in), optional :: tasks
    real(dp), intent(in), optional :: tolerance
    type(document_type) :: document
    !$ integer :: status

    !$omp critical (gestell_door)
    call put_together(self, document, error)
    if (present(tasks) .and. .not. allocated(error)) call set_path_text(document, self%schema, "case.tasks", tasks, error)
    if (present(tolerance) .and. .not. allocated(error)) call set_path_real(document, self%schema, "accuracy.tolerance", &
      & tolerance, error)
    if (.not. (allocated(error) .or. self%checked)) call check_document(document, self%schema, error)
    if (.not. allocated(error)) call solve_document(document, self%schema, self%settings, solution, error)
    ! Threads do not survive fork, and a child that has inherited a team would wait for its threads for ever. So none is kept.
    !$ status = omp_pause_resource_all(omp_pause_soft)
    !$omp end critical (gestell_door)
  end subroutine solve

end module gestell_door_machine
