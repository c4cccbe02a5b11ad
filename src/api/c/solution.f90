!> C interface for solutions (include/gestell.h): returns texts, multipliers and the vibrations of quantities.
module gestell_api_c_solution
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_files, only: copy_text
  use gestell_base_kinds, only: dp
  use gestell_api_c_handle, only: code_of, return_count, return_numbers, return_text, report_null_pointer, report_wrong_size
  use gestell_api_solution, only: response_type, solution_type
  use, intrinsic :: iso_c_binding, only: c_associated, c_f_pointer, c_int, c_null_ptr, c_ptr
  implicit none (type, external)
  private

  public :: count_multipliers, delete_solution, describe_response, find_solution, get_multipliers, get_response, get_text, &
    & size_text, find_solution_and_name, write_files

contains

  !> Deletes the solution to which `handle` points, and sets the handle to null.
  subroutine delete_solution(handle) bind(c, name="gestell_delete_solution")
    type(c_ptr), intent(inout), optional :: handle
    type(solution_type), pointer :: solution

    if (.not. present(handle)) return
    if (.not. c_associated(handle)) return
    call c_f_pointer(handle, solution)
    deallocate(solution)
    handle = c_null_ptr
  end subroutine delete_solution

  !> Returns in `size` the length in bytes, with the terminating zero, of the solution's text called `what` (see `find_text`).
  integer(c_int) function size_text(handle, what, size, failure) result(code) bind(c, name="gestell_size_text")
    type(c_ptr), value :: handle, what, failure
    integer(c_int), intent(out), optional :: size
    character(len=:), allocatable :: text
    type(error_type), allocatable :: error

    call find_text(handle, what, text, error)
    call return_count(len(text) + 1, error, size)
    code = code_of(error, failure)
  end function size_text

  !> Copies the solution's text called `what` (see `find_text`) to `place`, for which C provides `size` bytes.
  integer(c_int) function get_text(handle, what, size, place, failure) result(code) bind(c, name="gestell_get_text")
    type(c_ptr), value :: handle, what, place, failure
    integer(c_int), value :: size
    character(len=:), allocatable :: text
    type(error_type), allocatable :: error

    call find_text(handle, what, text, error)
    if (.not. allocated(error)) call return_text(text, size, place, error)
    code = code_of(error, failure)
  end function get_text

  !> Returns the text of a solution that C calls `what` (see `text_of` in gestell_api_solution).
  subroutine find_text(handle, what, text, error)
    type(c_ptr), intent(in) :: handle, what
    character(len=:), allocatable, intent(out) :: text
    type(error_type), allocatable, intent(out) :: error
    type(solution_type), pointer :: solution
    character(len=:), allocatable :: name

    text = ""
    call find_solution_and_name(handle, what, "the name of the requested text", solution, name, error)
    if (allocated(error)) return
    call solution%text(name, text, error)
    if (.not. allocated(text)) text = ""
  end subroutine find_text

  !> Counts the multipliers.
  integer(c_int) function count_multipliers(handle, count, failure) result(code) bind(c, name="gestell_count_multipliers")
    type(c_ptr), value :: handle, failure
    integer(c_int), intent(out), optional :: count
    complex(dp), allocatable :: rho(:)
    real(dp), allocatable :: errors(:)
    type(error_type), allocatable :: error

    call find_multipliers(handle, rho, errors, error)
    call return_count(size(rho), error, count)
    code = code_of(error, failure)
  end function count_multipliers

  !> Copies the multipliers to three arrays of `count` elements each: real parts, imaginary parts, and bounds on the errors.
  integer(c_int) function get_multipliers(handle, count, re, im, bounds, failure) result(code) &
    & bind(c, name="gestell_get_multipliers")
    type(c_ptr), value :: handle, re, im, bounds, failure
    integer(c_int), value :: count
    complex(dp), allocatable :: rho(:)
    real(dp), allocatable :: errors(:)
    type(error_type), allocatable :: error

    if (.not. (c_associated(re) .and. c_associated(im) .and. c_associated(bounds))) then
      call report_null_pointer("an array for the multipliers", error)
    end if
    if (.not. allocated(error)) call find_multipliers(handle, rho, errors, error)
    if (.not. allocated(error)) then
      if (count /= size(rho)) call report_wrong_size("the array for the multipliers", int(count), size(rho), error)
    end if
    if (.not. allocated(error)) then
      call return_numbers(real(rho), re)
      call return_numbers(aimag(rho), im)
      call return_numbers(errors, bounds)
    end if
    code = code_of(error, failure)
  end function get_multipliers

  !> Returns the multipliers `rho` and the bounds `errors` on their errors. After an error `rho` is empty.
  subroutine find_multipliers(handle, rho, errors, error)
    type(c_ptr), intent(in) :: handle
    complex(dp), allocatable, intent(out) :: rho(:)
    real(dp), allocatable, intent(out) :: errors(:)
    type(error_type), allocatable, intent(out) :: error
    type(solution_type), pointer :: solution

    call find_solution(handle, solution, error)
    if (.not. allocated(error)) then
      call solution%multipliers(rho, errors)
      if (.not. allocated(rho)) call fatal_error(error, "the multipliers were not computed: add the task 'stability'", wrong_usage)
    end if
    if (.not. allocated(rho)) allocate(rho(0))
  end subroutine find_multipliers

  !> Returns in `orders` and `points` the sizes of the arrays `amplitudes` and `history` that `get_response` fills for `quantity`.
  !> Also copies the unit of the quantity, for which C provides `size` characters.
  integer(c_int) function describe_response(handle, quantity, orders, points, size, unit, failure) result(code) &
    & bind(c, name="gestell_describe_response")
    type(c_ptr), value :: handle, quantity, unit, failure
    integer(c_int), intent(out), optional :: orders, points
    integer(c_int), value :: size
    type(response_type) :: response
    type(error_type), allocatable :: error

    call find_response(handle, quantity, response, error)
    if (.not. allocated(error)) call return_text(response%unit, size, unit, error)
    if (.not. allocated(response%history)) allocate(response%history(0), response%amplitudes(0))
    call return_count(ubound(response%amplitudes, 1), error, orders)
    call return_count(ubound(response%history, 1), error, points)
    code = code_of(error, failure)
  end function describe_response

  !> Copies the vibration of a quantity. `numbers` receives 4 values: peak, rms, bound on the error of the peak, bound on the error
  !> of the rms. If `amplitudes` or `history` is null, it is not filled.
  integer(c_int) function get_response(handle, quantity, numbers, orders, amplitudes, points, history, failure) result(code) &
    & bind(c, name="gestell_get_response")
    type(c_ptr), value :: handle, quantity, numbers, amplitudes, history, failure
    integer(c_int), value :: orders, points
    type(response_type) :: response
    type(error_type), allocatable :: error

    call find_response(handle, quantity, response, error)
    if (.not. allocated(error)) then
      if (.not. c_associated(numbers)) then
        call report_null_pointer("the array for peak and rms", error)
      else if (c_associated(amplitudes) .and. orders /= size(response%amplitudes)) then
        call report_wrong_size("the array for the amplitudes", int(orders), size(response%amplitudes), error)
      else if (c_associated(history) .and. points /= size(response%history)) then
        call report_wrong_size("the array for the history", int(points), size(response%history), error)
      end if
    end if
    if (.not. allocated(error)) then
      call return_numbers([response%peak, response%rms, response%peak_error, response%rms_error], numbers)
      call return_numbers(response%amplitudes, amplitudes)
      call return_numbers(response%history, history)
    end if
    code = code_of(error, failure)
  end function get_response

  !> Returns the vibration of the quantity that the C text `quantity` names.
  subroutine find_response(handle, quantity, response, error)
    type(c_ptr), intent(in) :: handle, quantity
    type(response_type), intent(out) :: response
    type(error_type), allocatable, intent(out) :: error
    type(solution_type), pointer :: solution
    character(len=:), allocatable :: name

    call find_solution_and_name(handle, quantity, "the quantity", solution, name, error)
    if (.not. allocated(error)) call solution%response(name, response, error)
  end subroutine find_response

  !> Writes the result files into `folder` as the program does. Pictures are drawn unless `pictures` is 0.
  integer(c_int) function write_files(handle, folder, pictures, failure) result(code) bind(c, name="gestell_write")
    type(c_ptr), value :: handle, folder, failure
    integer(c_int), value :: pictures
    type(solution_type), pointer :: solution
    character(len=:), allocatable :: name
    type(error_type), allocatable :: error

    call find_solution_and_name(handle, folder, "the folder", solution, name, error)
    if (.not. allocated(error)) call solution%write(name, error, pictures /= 0)
    code = code_of(error, failure)
  end function write_files

  !> Returns the solution to which `handle` points, and a Fortran copy of the C text at `pointer`. Error messages call this text
  !> `what`. Fails if `handle` or `pointer` is null.
  subroutine find_solution_and_name(handle, pointer, what, solution, name, error)
    type(c_ptr), intent(in) :: handle, pointer
    character(len=*), intent(in) :: what
    type(solution_type), pointer, intent(out) :: solution
    character(len=:), allocatable, intent(out) :: name
    type(error_type), allocatable, intent(out) :: error

    call find_solution(handle, solution, error)
    if (allocated(error)) return
    if (c_associated(pointer)) call copy_text(pointer, name)
    if (.not. c_associated(pointer)) call report_null_pointer(what, error)
  end subroutine find_solution_and_name

  !> Returns the solution to which `handle` points. Fails if `handle` is null.
  subroutine find_solution(handle, solution, error)
    type(c_ptr), intent(in) :: handle
    type(solution_type), pointer, intent(out) :: solution
    type(error_type), allocatable, intent(out) :: error

    nullify(solution)
    if (c_associated(handle)) call c_f_pointer(handle, solution)
    if (.not. c_associated(handle)) call report_null_pointer("the solution", error)
  end subroutine find_solution

end module gestell_api_c_solution
