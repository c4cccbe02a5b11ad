!> Defines the machine that a program reads from an input file or a text, or builds in code.
module gestell_api_machine
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, exact
  use gestell_api_solution, only: solution_type, solve_document
  use gestell_input_machine_groups, only: read_units
  use gestell_input_namelist, only: parse_document, read_document
  use gestell_input_namelist_document, only: document_type, group_type
  use gestell_input_namelist_edit, only: remove_group
  use gestell_input_schema, only: find_group_rule, schema_type
  use gestell_input_schema_check, only: check_document, normalise
  use gestell_input_schema_locate, only: find_groups
  use gestell_input_schema_path, only: get_path, set_path_real, set_path_text
  use gestell_input_schema_rewrite, only: rewrite
  use gestell_input_schema_units, only: units_type
  use gestell_output_head, only: setting_type
  use gestell_task_registry, only: input_schema
  use gestell_task_registry_machine_json, only: list_parameters
  !$ use omp_lib, only: omp_pause_resource_all, omp_pause_soft
  implicit none (type, external)
  private

  !> A machine as described by an input file (doc/input.md). Paths, keys and units are those of the input and of --set. For example,
  !> `drive.speed_rpm` is in 1/min, whatever the units of the results. Several threads may solve different machines at the same
  !> time.
  type, public :: machine_type
    private
    !> The machine's input; it contains no groups if no machine has been read yet
    type(document_type) :: document
    type(schema_type), allocatable :: schema
    !> The first `waiting` elements are groups that were added but are not yet part of `document`. Because they are collected
    !> here, the time for adding n groups one by one is proportional to n
    type(group_type), allocatable :: added(:)
    integer :: waiting = 0
    !> For each group name of the schema: number of its groups in `document` and `added`. Unallocated until groups are added
    integer, allocatable :: counts(:)
    !> True if `document` has been checked since it was last changed
    logical :: checked = .false.
    !> Assignments PATH=VALUE that were made after the input was read
    type(setting_type), allocatable :: settings(:)
  contains
    procedure :: read => read_file, parse, add, remove
    procedure, private :: set_number, set_text
    generic :: set => set_number, set_text
    procedure :: get, parameters, text => input_text, solve
  end type machine_type

  !> Messages use this name in place of a file name if the input is a text.
  character(len=*), parameter :: text_name = "text"

contains

  !> Reads the machine from an input file. Fails if the file cannot be read or its content is invalid; the message names the line.
  subroutine read_file(self, file, error)
    class(machine_type), intent(out) :: self
    character(len=*), intent(in) :: file
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: document

    call read_document(file, document, error)
    if (.not. allocated(error)) call store_document(self, document, error)
  end subroutine read_file

  !> Reads the machine from a text in the format of an input file, whose lines are separated by new_line('a'). Fails if the text is
  !> invalid.
  subroutine parse(self, text, error, name)
    class(machine_type), intent(out) :: self
    character(len=*), intent(in) :: text
    type(error_type), allocatable, intent(out) :: error
    !> Name of the text in messages and reports, such as that of the file from which it comes; "text" if absent
    character(len=*), intent(in), optional :: name
    type(document_type) :: document
    character(len=:), allocatable :: file

    file = text_name
    if (present(name)) file = name
    call parse_document(text, file, document, error)
    if (.not. allocated(error)) call store_document(self, document, error)
  end subroutine parse

  !> Checks `document` and makes it the machine's input. Fails if it contains unknown groups or keys, or lacks required ones.
  subroutine store_document(self, document, error)
    class(machine_type), intent(inout) :: self
    type(document_type), intent(inout) :: document
    type(error_type), allocatable, intent(out) :: error

    self%schema = input_schema()
    call check_document(document, self%schema, error)
    if (allocated(error)) return
    self%document = document
    self%checked = .true.
    allocate(self%settings(0))
  end subroutine store_document

  !> Adds groups such as "&joint name='B', type='RRR', ... /" to a machine, which may still be empty. In this way a program can
  !> build a machine entirely in code. Fails if the groups are invalid; the machine then stays unchanged. Missing groups are
  !> reported only by `solve`.
  subroutine add(self, groups, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: groups
    type(error_type), allocatable, intent(out) :: error

    type(document_type) :: more
    type(group_type), allocatable :: longer(:)
    integer :: n

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
      longer(:self%waiting) = self%added(:self%waiting)
      call move_alloc(longer, self%added)
    end if
    self%added(self%waiting + 1:n) = more%groups
    self%waiting = n
    call count_names(self, more%groups)
    if (.not. allocated(self%settings)) allocate(self%settings(0))
    self%checked = .false.
  end subroutine add

  !> Removes the groups that a path such as "support(2)" or "probe" denotes, also from the machine's text. Fails if there are none,
  !> or if no other group would remain; the machine then stays unchanged.
  subroutine remove(self, groups, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: groups
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: document, shorter
    character(len=:), allocatable :: words
    integer, allocatable :: numbers(:)
    integer :: i

    call merge_groups(self, document, error)
    if (.not. allocated(error)) call find_groups(document, self%schema, groups, numbers, error)
    if (.not. allocated(error)) then
      if (size(numbers) == size(document%groups)) call fatal_error(error, groups // ": no other group would remain", invalid_input)
    end if
    if (.not. allocated(error)) call rewrite(document, self%schema, words, error)
    if (.not. allocated(error)) then
      do i = size(numbers), 1, -1
        call remove_group(words, numbers(i))
      end do
      call parse_document(words, document%file, shorter, error)
    end if
    if (.not. allocated(error)) call normalise(shorter, self%schema, error)
    if (.not. allocated(error)) then
      if (allocated(document%path)) shorter%path = document%path
      self%document = shorter
      self%waiting = 0
      if (allocated(self%counts)) deallocate(self%counts)
      self%checked = .false.
    end if
  end subroutine remove

  !> Adds these groups to `counts`, the number of groups of each name. The names of the groups must occur in the schema.
  subroutine count_names(self, groups)
    class(machine_type), intent(inout) :: self
    type(group_type), intent(in) :: groups(:)
    integer :: i, rule

    do i = 1, size(groups)
      rule = find_group_rule(self%schema, groups(i)%name)
      self%counts(rule) = self%counts(rule) + 1
    end do
  end subroutine count_names

  !> Returns the machine's document with all added groups. Fails if the machine is still empty.
  subroutine merge_groups(self, document, error)
    class(machine_type), intent(in) :: self
    type(document_type), intent(out) :: document
    type(error_type), allocatable, intent(out) :: error
    integer :: n

    n = 0
    if (allocated(self%document%groups)) n = size(self%document%groups)
    if (n + self%waiting == 0) then
      call fatal_error(error, "the machine is empty: call read, parse or add first", invalid_input)
      return
    end if
    if (self%waiting == 0) then
      document = self%document
      return
    end if
    document%file = text_name
    if (n > 0) document%file = self%document%file
    if (n > 0 .and. allocated(self%document%path)) document%path = self%document%path
    if (n > 0 .and. allocated(self%document%text)) document%text = self%document%text
    allocate(document%groups(n + self%waiting))
    if (n > 0) document%groups(:n) = self%document%groups
    document%groups(n + 1:) = self%added(:self%waiting)
    call normalise(document, self%schema, error)
  end subroutine merge_groups

  !> Sets the value at `path` to a number; no digit of it is lost. Fails if the path does not exist or the number is not allowed
  !> there.
  subroutine set_number(self, path, value, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: path
    real(dp), intent(in) :: value
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: digits
    real(dp) :: again

    ! 15 digits are enough for numbers that people type, and for whole numbers, which integer keys require without a point
    digits = concise(value, 15)
    read (digits, *) again
    if (exact(again) /= exact(value)) digits = exact(value)
    call self%set_text(path, digits, error)
  end subroutine set_number

  !> Sets the value at `path` to the text `value`, in the form that `--set PATH=VALUE` accepts after the equals sign. Fails if the
  !> path does not exist or the value is not allowed there.
  subroutine set_text(self, path, value, error)
    class(machine_type), intent(inout) :: self
    character(len=*), intent(in) :: path, value
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: document

    if (self%waiting > 0 .or. .not. allocated(self%document%groups)) then
      call merge_groups(self, document, error)
      if (.not. allocated(error)) then
        self%document = document
        self%waiting = 0
      end if
    end if
    if (.not. allocated(error)) call set_path_text(self%document, self%schema, path, value, error)
    ! Setting a path may have added a group.
    if (allocated(self%counts)) deallocate(self%counts)
    if (.not. allocated(error)) call record_setting(self, path, value)
  end subroutine set_text

  !> Records the assignment of `value` to `path`, which replaces an earlier assignment to this path. The heads of the result files
  !> list the recorded assignments.
  subroutine record_setting(self, path, value)
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
  end subroutine record_setting

  !> Returns the numbers at `path` as the input gives them, in the units of the input. Fails if the path does not exist or holds
  !> no number.
  subroutine get(self, path, values, error)
    class(machine_type), intent(in) :: self
    character(len=*), intent(in) :: path
    real(dp), allocatable, intent(out) :: values(:)
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: document

    call merge_groups(self, document, error)
    if (.not. allocated(error)) call get_path(document, self%schema, path, values, error)
  end subroutine get

  !> Returns the values of the input with their paths, units, meanings and ranges in JSON: an array with an object for each key, as
  !> the member `parameters` of the machine in results.json. If `path` is present, the array contains only what `path` denotes.
  !> Fails if `path` denotes no value of the input, or a unit of &units is unknown.
  subroutine parameters(self, words, error, path)
    class(machine_type), intent(in) :: self
    character(len=:), allocatable, intent(out) :: words
    type(error_type), allocatable, intent(out) :: error
    character(len=*), intent(in), optional :: path
    type(document_type) :: document
    type(units_type) :: units

    ! Functions that compose JSON return texts of deferred length (see solve_tasks).
    !$omp critical (texts_of_gestell)
    call merge_groups(self, document, error)
    if (.not. allocated(error)) call read_units(document, units, error)
    if (.not. allocated(error)) call list_parameters(document, self%schema, units, words, error, path)
    !$omp end critical (texts_of_gestell)
  end subroutine parameters

  !> Returns the machine as the text of an input file: the text that was read, with all values set since then, and all groups added
  !> since then at its end. Comments and blanks remain as they are. Fails if the machine is empty.
  subroutine input_text(self, words, error)
    class(machine_type), intent(in) :: self
    character(len=:), allocatable, intent(out) :: words
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: document

    call merge_groups(self, document, error)
    if (.not. allocated(error)) call rewrite(document, self%schema, words, error)
  end subroutine input_text

  !> Runs the tasks and returns their results in `solution`. Prints nothing and writes no files. Fails if the input is invalid, the
  !> mechanism cannot be assembled, or a computation fails.
  subroutine solve(self, solution, error, tasks, tolerance)
    class(machine_type), intent(in) :: self
    type(solution_type), intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error
    !> Names of the tasks, written as in an input file, for example "stability, response". If absent, the tasks of the machine's
    !> input are run
    character(len=*), intent(in), optional :: tasks
    !> Relative tolerance of the results. If absent, the tolerance of the machine's input applies
    real(dp), intent(in), optional :: tolerance
    type(document_type) :: document
    !$ integer :: status

    call merge_groups(self, document, error)
    if (present(tasks) .and. .not. allocated(error)) call set_path_text(document, self%schema, "case.tasks", tasks, error)
    if (present(tolerance) .and. .not. allocated(error)) call set_path_real(document, self%schema, "accuracy.tolerance", &
      & tolerance, error)
    if (.not. (allocated(error) .or. self%checked)) call check_document(document, self%schema, error)
    if (.not. allocated(error)) call solve_document(document, self%schema, self%settings, solution, error)
    ! Threads do not survive fork: a child that inherits a thread team would wait for it forever. Therefore no team is kept.
    !$ status = omp_pause_resource_all(omp_pause_soft)
  end subroutine solve

end module gestell_api_machine
