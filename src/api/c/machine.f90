!> C interface for machines (include/gestell.h). Every function returns an error code, 0 for success. A null handle is an error.
module gestell_api_c_machine
  use gestell_base_error, only: error_type, wrong_usage
  use gestell_base_files, only: copy_text
  use gestell_base_kinds, only: dp
  use gestell_base_version, only: version
  use gestell_api_c_handle, only: c_error_type, code_of, return_count, return_numbers, return_text, report_null_pointer, &
    & report_wrong_size
  use gestell_api_machine, only: machine_type
  use gestell_api_solution, only: solution_type
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_loc, c_null_ptr, c_ptr
  !$ use omp_lib, only: omp_get_max_threads, omp_pause_resource_all, omp_pause_soft
  implicit none (type, external)
  private

  public :: add_groups, copy_machine, count_values, delete_error, delete_machine, error_text, get_input, get_parameters, &
    & get_values, get_version, new_error, new_machine, parse_named_text, parse_text, read_file, remove_groups, set_number, &
    & set_text, size_input, size_parameters, solve_machine, solve_many

contains

  !> Copies the version number of the library, such as "1.0.0", to `text`, for which C provides `size` characters.
  integer(c_int) function get_version(size, text) result(code) bind(c, name="gestell_get_version")
    integer(c_int), value :: size
    type(c_ptr), value :: text
    type(error_type), allocatable :: error

    call return_text(version, size, text, error)
    code = code_of(error, c_null_ptr)
  end function get_version

  !> Creates an error handle, through which later calls return the message of an error.
  type(c_ptr) function new_error() result(handle) bind(c, name="gestell_new_error")
    type(c_error_type), pointer :: holder

    allocate(holder)
    handle = c_loc(holder)
  end function new_error

  !> Deletes the error object to which `handle` points, and sets the handle to null.
  subroutine delete_error(handle) bind(c, name="gestell_delete_error")
    type(c_ptr), intent(inout), optional :: handle
    type(c_error_type), pointer :: holder

    if (.not. present(handle)) return
    if (.not. c_associated(handle)) return
    call c_f_pointer(handle, holder)
    deallocate(holder)
    handle = c_null_ptr
  end subroutine delete_error

  !> Returns the code of the last error of this handle, and copies its message to `text`, truncated to `size` characters.
  integer(c_int) function error_text(handle, size, text) result(code) bind(c, name="gestell_get_error")
    type(c_ptr), value :: handle, text
    integer(c_int), value :: size
    type(c_error_type), pointer :: holder
    type(error_type), allocatable :: none

    code = 0
    if (c_associated(text) .and. size > 0) call return_text("", size, text, none)
    if (.not. c_associated(handle)) return
    call c_f_pointer(handle, holder)
    if (.not. allocated(holder%error)) return
    code = int(holder%error%code, c_int)
    if (c_associated(text) .and. size > 0) call return_text(holder%error%message(:min(size - 1, len(holder%error%message))), &
      & size, text, none)
  end function error_text

  !> Creates an empty machine and returns its handle.
  type(c_ptr) function new_machine() result(handle) bind(c, name="gestell_new_machine")
    type(machine_type), pointer :: machine

    allocate(machine)
    handle = c_loc(machine)
  end function new_machine

  !> Deletes the machine to which `handle` points, and sets the handle to null.
  subroutine delete_machine(handle) bind(c, name="gestell_delete_machine")
    type(c_ptr), intent(inout), optional :: handle
    type(machine_type), pointer :: machine

    if (.not. present(handle)) return
    if (.not. c_associated(handle)) return
    call c_f_pointer(handle, machine)
    deallocate(machine)
    handle = c_null_ptr
  end subroutine delete_machine

  !> Creates a copy of a machine. `copy` receives the handle of the copy, or null after an error.
  integer(c_int) function copy_machine(handle, copy, failure) result(code) bind(c, name="gestell_copy_machine")
    type(c_ptr), value :: handle, failure
    type(c_ptr), intent(out), optional :: copy
    type(machine_type), pointer :: machine, second
    type(error_type), allocatable :: error

    if (.not. present(copy)) then
      call report_null_pointer("the pointer for the copy", error)
    else
      copy = c_null_ptr
      call find_machine(handle, machine, error)
      if (.not. allocated(error)) then
        allocate(second, source=machine)
        copy = c_loc(second)
      end if
    end if
    code = code_of(error, failure)
  end function copy_machine

  !> Reads an input file into the machine.
  integer(c_int) function read_file(handle, file, failure) result(code) bind(c, name="gestell_read")
    type(c_ptr), value :: handle, file, failure
    type(machine_type), pointer :: machine
    character(len=:), allocatable :: name
    type(error_type), allocatable :: error

    call find_machine_and_text(handle, machine, file, "the file name", name, error)
    if (.not. allocated(error)) call machine%read(name, error)
    code = code_of(error, failure)
  end function read_file

  !> Reads the machine from `text`, which has the format of an input file.
  integer(c_int) function parse_text(handle, text, failure) result(code) bind(c, name="gestell_parse")
    type(c_ptr), value :: handle, text, failure
    type(machine_type), pointer :: machine
    character(len=:), allocatable :: input
    type(error_type), allocatable :: error

    call find_machine_and_text(handle, machine, text, "the text", input, error)
    if (.not. allocated(error)) call machine%parse(input, error)
    code = code_of(error, failure)
  end function parse_text

  !> Reads the machine from `text`, which messages call `name`.
  integer(c_int) function parse_named_text(handle, text, name, failure) result(code) bind(c, name="gestell_parse_named")
    type(c_ptr), value :: handle, text, name, failure
    type(machine_type), pointer :: machine
    character(len=:), allocatable :: input, file
    type(error_type), allocatable :: error

    call find_machine_and_text(handle, machine, text, "the text", input, error)
    if (.not. allocated(error)) call find_machine_and_text(handle, machine, name, "the name", file, error)
    if (.not. allocated(error)) call machine%parse(input, error, file)
    code = code_of(error, failure)
  end function parse_named_text

  !> Adds the groups in `text`, such as "&joint ... /", to the machine.
  integer(c_int) function add_groups(handle, text, failure) result(code) bind(c, name="gestell_add")
    type(c_ptr), value :: handle, text, failure
    type(machine_type), pointer :: machine
    character(len=:), allocatable :: groups
    type(error_type), allocatable :: error

    call find_machine_and_text(handle, machine, text, "the text", groups, error)
    if (.not. allocated(error)) call machine%add(groups, error)
    code = code_of(error, failure)
  end function add_groups

  !> Removes the groups that the text at `path`, such as "support(2)", denotes.
  integer(c_int) function remove_groups(handle, path, failure) result(code) bind(c, name="gestell_remove")
    type(c_ptr), value :: handle, path, failure
    type(machine_type), pointer :: machine
    character(len=:), allocatable :: name
    type(error_type), allocatable :: error

    call find_machine_and_text(handle, machine, path, "the path", name, error)
    if (.not. allocated(error)) call machine%remove(name, error)
    code = code_of(error, failure)
  end function remove_groups

  !> Sets the value at `path`, such as "drive.speed_rpm", to `number`.
  integer(c_int) function set_number(handle, path, number, failure) result(code) bind(c, name="gestell_set")
    type(c_ptr), value :: handle, path, failure
    real(c_double), value :: number
    type(machine_type), pointer :: machine
    character(len=:), allocatable :: name
    type(error_type), allocatable :: error

    call find_machine_and_text(handle, machine, path, "the path", name, error)
    if (.not. allocated(error)) call machine%set(name, number, error)
    code = code_of(error, failure)
  end function set_number

  !> Sets the value at `path`, such as "drive.held_by", to `text`.
  integer(c_int) function set_text(handle, path, text, failure) result(code) bind(c, name="gestell_set_text")
    type(c_ptr), value :: handle, path, text, failure
    type(machine_type), pointer :: machine
    character(len=:), allocatable :: name, words
    type(error_type), allocatable :: error

    call find_machine_and_text(handle, machine, path, "the path", name, error)
    if (.not. allocated(error)) call find_machine_and_text(handle, machine, text, "the text", words, error)
    if (.not. allocated(error)) call machine%set(name, words, error)
    code = code_of(error, failure)
  end function set_text

  !> Returns in `count` how many numerical values are stored under `path`, such as 2 for "joint(B).lengths".
  integer(c_int) function count_values(handle, path, count, failure) result(code) bind(c, name="gestell_count_values")
    type(c_ptr), value :: handle, path, failure
    integer(c_int), intent(out), optional :: count
    real(dp), allocatable :: values(:)
    type(error_type), allocatable :: error

    call find_values(handle, path, values, error)
    call return_count(size(values), error, count)
    code = code_of(error, failure)
  end function count_values

  !> Copies the numerical values stored under `path`, in the units of the input, to `numbers`. Fails unless `count` is their number.
  integer(c_int) function get_values(handle, path, count, numbers, failure) result(code) bind(c, name="gestell_get_values")
    type(c_ptr), value :: handle, path, numbers, failure
    integer(c_int), value :: count
    real(dp), allocatable :: values(:)
    type(error_type), allocatable :: error

    if (.not. c_associated(numbers)) call report_null_pointer("the array for the values", error)
    if (.not. allocated(error)) call find_values(handle, path, values, error)
    if (.not. allocated(error)) then
      if (count /= size(values)) call report_wrong_size("the array for the values", int(count), size(values), error)
    end if
    if (.not. allocated(error)) call return_numbers(values, numbers)
    code = code_of(error, failure)
  end function get_values

  !> Returns the numerical values stored under the C text `path` of the machine. After an error `values` is empty.
  subroutine find_values(handle, path, values, error)
    type(c_ptr), intent(in) :: handle, path
    real(dp), allocatable, intent(out) :: values(:)
    type(error_type), allocatable, intent(out) :: error
    type(machine_type), pointer :: machine
    character(len=:), allocatable :: name

    call find_machine_and_text(handle, machine, path, "the path", name, error)
    if (.not. allocated(error)) call machine%get(name, values, error)
    if (.not. allocated(values)) allocate(values(0))
  end subroutine find_values

  !> Returns in `size` the length in bytes, with the terminating zero, of the list of parameters (see `find_parameters`).
  integer(c_int) function size_parameters(handle, path, size, failure) result(code) bind(c, name="gestell_size_parameters")
    type(c_ptr), value :: handle, path, failure
    integer(c_int), intent(out), optional :: size
    character(len=:), allocatable :: words
    type(error_type), allocatable :: error

    call find_parameters(handle, path, words, error)
    call return_count(len(words) + 1, error, size)
    code = code_of(error, failure)
  end function size_parameters

  !> Copies the list of parameters (see `find_parameters`) to `place`, for which C provides `size` bytes.
  integer(c_int) function get_parameters(handle, path, size, place, failure) result(code) bind(c, name="gestell_get_parameters")
    type(c_ptr), value :: handle, path, place, failure
    integer(c_int), value :: size
    character(len=:), allocatable :: words
    type(error_type), allocatable :: error

    call find_parameters(handle, path, words, error)
    if (.not. allocated(error)) call return_text(words, size, place, error)
    code = code_of(error, failure)
  end function get_parameters

  !> Returns in JSON the values that `path` denotes or, if `path` is null, all values of the input. After an error the text is
  !> empty.
  subroutine find_parameters(handle, path, words, error)
    type(c_ptr), intent(in) :: handle, path
    character(len=:), allocatable, intent(out) :: words
    type(error_type), allocatable, intent(out) :: error
    type(machine_type), pointer :: machine
    character(len=:), allocatable :: name

    call find_machine(handle, machine, error)
    if (c_associated(path)) call copy_text(path, name)
    ! `name` is unallocated if C passed no path, which makes the argument absent
    if (.not. allocated(error)) call machine%parameters(words, error, name)
    if (.not. allocated(words)) words = ""
  end subroutine find_parameters

  !> Returns in `size` the length in bytes, with the terminating zero, of the machine's input.
  integer(c_int) function size_input(handle, size, failure) result(code) bind(c, name="gestell_size_input")
    type(c_ptr), value :: handle, failure
    integer(c_int), intent(out), optional :: size
    character(len=:), allocatable :: text
    type(error_type), allocatable :: error

    call find_input(handle, text, error)
    call return_count(len(text) + 1, error, size)
    code = code_of(error, failure)
  end function size_input

  !> Copies the machine's input to `place`, for which C provides `size` bytes.
  integer(c_int) function get_input(handle, size, place, failure) result(code) bind(c, name="gestell_get_input")
    type(c_ptr), value :: handle, place, failure
    integer(c_int), value :: size
    character(len=:), allocatable :: text
    type(error_type), allocatable :: error

    call find_input(handle, text, error)
    if (.not. allocated(error)) call return_text(text, size, place, error)
    code = code_of(error, failure)
  end function get_input

  !> Returns the text of the machine's input. After an error it is empty.
  subroutine find_input(handle, text, error)
    type(c_ptr), intent(in) :: handle
    character(len=:), allocatable, intent(out) :: text
    type(error_type), allocatable, intent(out) :: error
    type(machine_type), pointer :: machine

    call find_machine(handle, machine, error)
    if (.not. allocated(error)) call machine%text(text, error)
    if (.not. allocated(text)) text = ""
  end subroutine find_input

  !> Computes the results of a machine. If `tasks` is null, the tasks named in the machine's input are run. `found` receives the
  !> handle of the new solution, or null after an error.
  integer(c_int) function solve_machine(handle, tasks, found, failure) result(code) bind(c, name="gestell_solve")
    type(c_ptr), value :: handle, tasks, failure
    type(c_ptr), intent(out), optional :: found
    type(machine_type), pointer :: machine
    type(solution_type), pointer :: solution
    character(len=:), allocatable :: names
    type(error_type), allocatable :: error

    if (.not. present(found)) then
      call report_null_pointer("the pointer for the solution", error)
      code = code_of(error, failure)
      return
    end if
    found = c_null_ptr
    if (c_associated(tasks)) then
      call find_machine_and_text(handle, machine, tasks, "the text with the names of the tasks", names, error)
    else
      call find_machine(handle, machine, error)
    end if
    if (.not. allocated(error)) then
      allocate(solution)
      ! `names` is unallocated if C passed no tasks, which makes the argument absent
      call machine%solve(solution, error, names)
      if (allocated(error)) then
        deallocate(solution)
      else
        found = c_loc(solution)
      end if
    end if
    code = code_of(error, failure)
  end function solve_machine

  !> Solves `count` machines on several cores. `tasks` is as for `solve_machine`. `solutions` receives a handle for each machine, or
  !> null where a machine could not be solved; the handles `failures`, unless null, then receive the errors. Returns the code of the
  !> first machine that could not be solved; 0 if all were.
  integer(c_int) function solve_many(count, machines, tasks, threads, solutions, failures) result(code) &
    & bind(c, name="gestell_solve_many")
    integer(c_int), value :: count
    !> `threads`: number of threads; 0 for the default of OpenMP
    integer(c_int), value :: threads
    type(c_ptr), value :: machines, tasks, solutions, failures
    type(c_ptr), pointer :: machine(:), solution(:), failure(:)
    integer(c_int), allocatable :: codes(:)
    integer :: i
    !$ integer :: team, status

    code = wrong_usage
    if (count < 0 .or. threads < 0 .or. .not. (c_associated(machines) .and. c_associated(solutions))) return
    call c_f_pointer(machines, machine, [count])
    call c_f_pointer(solutions, solution, [count])
    if (c_associated(failures)) then
      call c_f_pointer(failures, failure, [count])
    else
      allocate(failure(count))
      failure = c_null_ptr
    end if
    allocate(codes(count))
    !$ team = merge(int(threads), omp_get_max_threads(), threads > 0)
    !$omp parallel do schedule(dynamic) num_threads(team)
    do i = 1, count
      codes(i) = solve_machine(machine(i), tasks, solution(i), failure(i))
    end do
    !$omp end parallel do
    !$ status = omp_pause_resource_all(omp_pause_soft)
    if (.not. c_associated(failures)) deallocate(failure)
    code = 0
    do i = count, 1, -1
      if (codes(i) /= 0) code = codes(i)
    end do
  end function solve_many

  !> Returns the machine to which `handle` points, and a Fortran copy of the C text at `pointer`. Error messages call this text
  !> `what`. Fails if `handle` or `pointer` is null.
  subroutine find_machine_and_text(handle, machine, pointer, what, text, error)
    type(c_ptr), intent(in) :: handle, pointer
    type(machine_type), pointer, intent(out) :: machine
    character(len=*), intent(in) :: what
    character(len=:), allocatable, intent(out) :: text
    type(error_type), allocatable, intent(out) :: error

    call find_machine(handle, machine, error)
    if (allocated(error)) return
    if (c_associated(pointer)) call copy_text(pointer, text)
    if (.not. c_associated(pointer)) call report_null_pointer(what, error)
  end subroutine find_machine_and_text

  !> Returns the machine to which `handle` points. Fails if `handle` is null.
  subroutine find_machine(handle, machine, error)
    type(c_ptr), intent(in) :: handle
    type(machine_type), pointer, intent(out) :: machine
    type(error_type), allocatable, intent(out) :: error

    nullify(machine)
    if (c_associated(handle)) call c_f_pointer(handle, machine)
    if (.not. c_associated(handle)) call report_null_pointer("the machine", error)
  end subroutine find_machine

end module gestell_api_c_machine
