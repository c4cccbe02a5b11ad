!> A machine as programs hold it: in the language of input files, or built in code.
module gestell_door_machine
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_door_solution, only: order_type, solution_type, solve_order
  use gestell_input_namelist, only: parse_document, read_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_check, only: check_document, normalise
  use gestell_input_schema_path, only: get_path, set_path_real, set_path_text
  use gestell_output_head, only: setting_type
  use gestell_task_registry, only: input_schema
  implicit none (type, external)
  private

  !> What an input file says (doc/input.md). Paths, keys and units are those of the language, as in --set: `drive.speed_rpm` is in
  !> 1/min, whatever the units of the results. What several threads call at the same time is done one after the other: gfortran 12
  !> keeps the lengths of texts that functions give in static memory, whatever the flags.
  type, public :: machine_type
    private
    type(document_type) :: document
    !> Not allocated: there is no machine yet.
    type(schema_type), allocatable :: schema
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

contains

  !> Takes the machine of an input file. Error: it cannot be read, or has no sense; the message points into it.
  subroutine read_file(self, file, error)
    class(machine_type), intent(out) :: self
    character(len=*), intent(in) :: file
    type(error_type), allocatable, intent(out) :: error

    !$omp critical (gestell_door)
    call read_document(file, self%document, error)
    if (.not. allocated(error)) call accept(self, error)
    !$omp end critical (gestell_door)
  end subroutine read_file

  !> Takes the machine of a text in the same language, its lines ended by new_line('a'). Error: it makes no sense.
  subroutine parse(self, text, error)
    class(machine_type), intent(out) :: self
    character(len=*), intent(in) :: text
    type(error_type), allocatable, intent(out) :: error

    !$omp critical (gestell_door)
    call parse_document(text, text_name, self%document, error)
    if (.not. allocated(error)) call accept(self, error)
    !$omp end critical (gestell_door)
  end subroutine parse

  !> Error: the document says what the language does not know, or lacks what it needs.
  subroutine accept(self, error)
    class(machine_type), intent(inout) :: self
    type(error_type), allocatable, intent(out) :: error
    type(schema_type) :: schema

    schema = input_schema()
    call check_document(self%document, schema, error)
    if (allocated(error)) return
    self%schema = schema
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
    type(document_type) :: more, all
    type(schema_type) :: schema
    integer :: i, n

    call parse_document(groups, text_name, more, error)
    if (allocated(error)) return
    schema = input_schema()
    n = 0
    if (allocated(self%schema)) n = size(self%document%groups)
    all%file = more%file
    if (n > 0) all%file = self%document%file
    allocate(all%groups(n + size(more%groups)))
    do i = 1, size(all%groups)
      if (i <= n) all%groups(i) = self%document%groups(i)
      if (i > n) all%groups(i) = more%groups(i - n)
    end do
    call normalise(all, schema, error)
    if (allocated(error)) return
    self%document = all
    if (.not. allocated(self%settings)) allocate(self%settings(0))
    self%schema = schema
    self%checked = .false.
  end subroutine append

  !> Gives a path a number, to all its digits. Error: there is no such path, or the number makes no sense there.
  subroutine set_number(self, path, value, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: path
    real(dp), intent(in) :: value
    type(error_type), allocatable, intent(out) :: error

    character(len=24) :: digits

    write(digits, "(es24.16e3)") value
    call self%set_text(path, trim(adjustl(digits)), error)
  end subroutine set_number

  !> Gives a path what would stand behind the sign of equality of --set. Errors: as of numbers.
  subroutine set_text(self, path, value, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: path, value
    type(error_type), allocatable, intent(out) :: error

    !$omp critical (gestell_door)
    call require(self, error)
    if (.not. allocated(error)) call set_path_text(self%document, self%schema, path, value, error)
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
    call require(self, error)
    if (.not. allocated(error)) then
      document = self%document
      call get_path(document, self%schema, path, values, error)
    end if
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
    type(order_type) :: order

    !$omp critical (gestell_door)
    call require(self, error)
    if (.not. allocated(error)) then
      order = order_type(self%document, self%schema, self%settings)
      if (present(tasks)) call set_path_text(order%document, order%schema, "case.tasks", tasks, error)
    end if
    if (present(tolerance) .and. .not. allocated(error)) call set_path_real(order%document, order%schema, "accuracy.tolerance", &
      & tolerance, error)
    if (.not. (allocated(error) .or. self%checked)) call check_document(order%document, order%schema, error)
    if (.not. allocated(error)) call solve_order(order, solution, error)
    !$omp end critical (gestell_door)
  end subroutine solve

  subroutine require(self, error)
    class(machine_type), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error

    if (.not. allocated(self%schema)) call fatal_error(error, "there is no machine yet: read one first", invalid_input)
  end subroutine require

end module gestell_door_machine
