!> Procedures that the C interface uses for its handles, texts and errors.
module gestell_api_c_handle
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_int, c_null_char, c_ptr
  implicit none (type, external)
  private

  public :: code_of, return_count, return_numbers, return_text, report_null_pointer, report_wrong_size

  !> Fortran object to which an error handle of C points; it holds the last error returned through this handle.
  type, public :: c_error_type
    type(error_type), allocatable :: error
  end type c_error_type

contains

  !> Returns the code of `error`, 0 for success. Moves the error to the object to which `handle` points, unless `handle` is null.
  integer(c_int) function code_of(error, handle) result(code)
    type(error_type), allocatable, intent(inout) :: error
    type(c_ptr), intent(in) :: handle
    type(c_error_type), pointer :: holder

    code = 0
    if (allocated(error)) code = int(error%code, c_int)
    if (.not. c_associated(handle)) return
    call c_f_pointer(handle, holder)
    call move_alloc(error, holder%error)
  end function code_of

  !> Returns the error that a C pointer is null. The message calls this pointer `what`.
  pure subroutine report_null_pointer(what, error)
    character(len=*), intent(in) :: what
    type(error_type), allocatable, intent(out) :: error

    call fatal_error(error, what // " is a null pointer", wrong_usage)
  end subroutine report_null_pointer

  !> Copies the number `found` to the C variable to which `count` points, or copies 0 if `error` is already allocated. Fails if
  !> `count` is null.
  pure subroutine return_count(found, error, count)
    integer, intent(in) :: found
    type(error_type), allocatable, intent(inout) :: error
    integer(c_int), intent(out), optional :: count

    if (.not. present(count)) then
      if (.not. allocated(error)) call report_null_pointer("the pointer for a count", error)
      return
    end if
    count = 0
    if (.not. allocated(error)) count = int(found, c_int)
  end subroutine return_count

  !> Copies `numbers` to the address `pointer`, where C has reserved enough memory. Does nothing if `pointer` is null.
  subroutine return_numbers(numbers, pointer)
    real(c_double), intent(in) :: numbers(:)
    type(c_ptr), intent(in) :: pointer
    real(c_double), pointer :: place(:)

    if (.not. c_associated(pointer)) return
    call c_f_pointer(pointer, place, [size(numbers)])
    place = numbers
  end subroutine return_numbers

  !> Returns the error that the array called `what` has `has_elements` elements instead of `needed` elements.
  pure subroutine report_wrong_size(what, has_elements, needed, error)
    character(len=*), intent(in) :: what
    integer, intent(in) :: has_elements, needed
    type(error_type), allocatable, intent(out) :: error
    character(len=60) :: numbers

    write(numbers, "(a, i0, a, i0)") " must have ", needed, " elements, not ", has_elements
    call fatal_error(error, what // trim(numbers), wrong_usage)
  end subroutine report_wrong_size

  !> Copies `text` and a terminating zero to the address `pointer`, where C has reserved `size` characters. Fails if `size` is too
  !> small or `pointer` is null.
  subroutine return_text(text, size, pointer, error)
    character(len=*), intent(in) :: text
    integer(c_int), intent(in) :: size
    type(c_ptr), intent(in) :: pointer
    type(error_type), allocatable, intent(out) :: error
    character(kind=c_char), pointer :: characters(:)
    integer :: i

    if (.not. c_associated(pointer)) then
      call report_null_pointer("the array for the text", error)
    else if (size < len(text) + 1) then
      call report_wrong_size("the array for the text", int(size), len(text) + 1, error)
    end if
    if (allocated(error)) return
    call c_f_pointer(pointer, characters, [len(text) + 1])
    do i = 1, len(text)
      characters(i) = text(i:i)
    end do
    characters(len(text) + 1) = c_null_char
  end subroutine return_text

end module gestell_api_c_handle
