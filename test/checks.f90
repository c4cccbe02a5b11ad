!> Checks whose failure texts contain the found and the wanted values. Once a check has failed, the following checks keep its
!> error.
module checks
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use testdrive, only: error_type, test_failed
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use, intrinsic :: iso_fortran_env, only: qp => real128
  implicit none (type, external)
  private

  public :: check_that, check_success, check_failure

  !> call check_that(error, found, relation, wanted [, what]) fails unless `found` has the relation to `wanted`: <, <=, >, >=, ==
  !> or /=. Texts and logicals know only == and /=, and a text may 'contain' another. In a list every element must have the
  !> relation to the one wanted value, or to its own. NaN has no relation to any number. `what` begins the failure text.
  interface check_that
    module procedure :: compare_integer, compare_integers, compare_integer_lists
    module procedure :: compare_real, compare_reals, compare_real_lists
    module procedure :: compare_quad, compare_quads, compare_quad_lists
    module procedure :: compare_text, compare_texts, compare_logical, compare_logicals
  end interface check_that

  !> Maximum number of list elements that a failure text shows.
  integer, parameter :: most_shown = 4

contains

  subroutine compare_integer(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    integer, intent(in) :: found, wanted
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_numbers(error, [real(found, qp)], relation, [real(wanted, qp)], .true., what)
  end subroutine compare_integer

  subroutine compare_integers(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    integer, intent(in) :: found(:), wanted
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_numbers(error, real(found, qp), relation, spread(real(wanted, qp), 1, size(found)), .true., what)
  end subroutine compare_integers

  subroutine compare_integer_lists(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    integer, intent(in) :: found(:), wanted(:)
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_numbers(error, real(found, qp), relation, real(wanted, qp), .true., what)
  end subroutine compare_integer_lists

  subroutine compare_real(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    real(dp), intent(in) :: found, wanted
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_numbers(error, [real(found, qp)], relation, [real(wanted, qp)], .false., what)
  end subroutine compare_real

  subroutine compare_reals(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    real(dp), intent(in) :: found(:), wanted
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_numbers(error, real(found, qp), relation, spread(real(wanted, qp), 1, size(found)), .false., what)
  end subroutine compare_reals

  subroutine compare_real_lists(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    real(dp), intent(in) :: found(:), wanted(:)
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_numbers(error, real(found, qp), relation, real(wanted, qp), .false., what)
  end subroutine compare_real_lists

  subroutine compare_quad(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    real(qp), intent(in) :: found, wanted
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_numbers(error, [found], relation, [wanted], .false., what)
  end subroutine compare_quad

  subroutine compare_quads(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    real(qp), intent(in) :: found(:), wanted
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_numbers(error, found, relation, spread(wanted, 1, size(found)), .false., what)
  end subroutine compare_quads

  subroutine compare_quad_lists(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    real(qp), intent(in) :: found(:), wanted(:)
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_numbers(error, found, relation, wanted, .false., what)
  end subroutine compare_quad_lists

  subroutine compare_text(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: found, relation, wanted
    character(len=*), intent(in), optional :: what

    if (allocated(error) .or. text_holds(found, relation, wanted)) return
    call fail_with(error, what, "'" // found // "'" // wanted_text(relation, "'" // wanted // "'"))
  end subroutine compare_text

  subroutine compare_texts(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    character(len=*), intent(in) :: found(:), relation, wanted
    character(len=*), intent(in), optional :: what
    integer :: i

    do i = 1, size(found)
      call compare_text(error, trim(found(i)), relation, wanted, what)
    end do
  end subroutine compare_texts

  subroutine compare_logical(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    logical, intent(in) :: found, wanted
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what

    call compare_logicals(error, [found], relation, [wanted], what)
  end subroutine compare_logical

  subroutine compare_logicals(error, found, relation, wanted, what)
    type(error_type), allocatable, intent(inout) :: error
    logical, intent(in) :: found(:), wanted(:)
    character(len=*), intent(in) :: relation
    character(len=*), intent(in), optional :: what
    logical :: holds

    if (allocated(error)) return
    holds = size(found) == size(wanted)
    if (holds) holds = all((found .eqv. wanted) .eqv. text_holds("", relation, ""))
    if (.not. holds) call fail_with(error, what, letters(found) // wanted_text(relation, letters(wanted)))
  end subroutine compare_logicals

  pure function letters(list)
    logical, intent(in) :: list(:)
    character(len=size(list)) :: letters
    integer :: i

    do i = 1, size(list)
      letters(i:i) = merge("T", "F", list(i))
    end do
  end function letters

  !> Fails with the library's message if it reports a failure.
  subroutine check_success(error, failure, what)
    type(error_type), allocatable, intent(inout) :: error
    type(gestell_error), allocatable, intent(in) :: failure
    character(len=*), intent(in), optional :: what

    if (allocated(error) .or. .not. allocated(failure)) return
    call fail_with(error, what, "'" // failure%message // "', wanted no failure")
  end subroutine check_success

  !> Fails if the library reports no failure, or one whose message does not contain `words`, or with another `code`.
  subroutine check_failure(error, failure, words, code, what)
    type(error_type), allocatable, intent(inout) :: error
    type(gestell_error), allocatable, intent(in) :: failure
    character(len=*), intent(in), optional :: words, what
    integer, intent(in), optional :: code

    if (allocated(error)) return
    if (.not. allocated(failure)) then
      call fail_with(error, what, "no failure, wanted one")
      return
    end if
    if (present(words)) call compare_text(error, failure%message, "contains", words, what)
    if (present(code)) call compare_integer(error, failure%code, "==", code, failure%message)
  end subroutine check_failure

  subroutine compare_numbers(error, found, relation, wanted, whole, what)
    type(error_type), allocatable, intent(inout) :: error
    real(qp), intent(in) :: found(:), wanted(:)
    character(len=*), intent(in) :: relation
    logical, intent(in) :: whole
    character(len=*), intent(in), optional :: what
    character(len=:), allocatable :: text
    character(len=80) :: part
    logical, allocatable :: wrong(:)
    integer :: i, shown

    if (allocated(error)) return
    if (size(found) /= size(wanted)) then
      write (part, "(2(i0, a))") size(found), " elements, wanted ", size(wanted)
      call fail_with(error, what, trim(part))
      return
    end if
    wrong = .not. holds(found, relation, wanted)
    if (.not. any(wrong)) return
    if (size(found) == 1) then
      call fail_with(error, what, trim(number(found(1), whole)) // wanted_text(relation, trim(number(wanted(1), whole))))
      return
    end if
    write (part, "(i0, a, i0)") count(wrong), " wrong of ", size(found)
    text = trim(part)
    shown = 0
    do i = 1, size(found)
      if (.not. wrong(i) .or. shown == most_shown) cycle
      shown = shown + 1
      write (part, "(a, i0, a)") "; at ", i, ": "
      text = text // trim(part) // " " // trim(number(found(i), whole)) // wanted_text(relation, trim(number(wanted(i), whole)))
    end do
    call fail_with(error, what, text)
  end subroutine compare_numbers

  elemental logical function holds(found, relation, wanted)
    real(qp), intent(in) :: found, wanted
    character(len=*), intent(in) :: relation

    ! Comparing NaN would raise an invalid operation.
    holds = .false.
    if (ieee_is_nan(found) .or. ieee_is_nan(wanted)) return
    select case (relation)
    case ("<")
      holds = found < wanted
    case ("<=")
      holds = found <= wanted
    case (">")
      holds = found > wanted
    case (">=")
      holds = found >= wanted
    case ("==")
      holds = found <= wanted .and. found >= wanted
    case ("/=")
      holds = found < wanted .or. found > wanted
    case default
      holds = .false.
    end select
  end function holds

  pure logical function text_holds(found, relation, wanted)
    character(len=*), intent(in) :: found, relation, wanted

    select case (relation)
    case ("==")
      text_holds = found == wanted
    case ("/=")
      text_holds = found /= wanted
    case ("contains")
      text_holds = index(found, wanted) > 0
    case default
      text_holds = .false.
    end select
  end function text_holds

  pure function number(x, whole)
    real(qp), intent(in) :: x
    logical, intent(in) :: whole
    character(len=40) :: number

    if (whole) then
      write (number, "(i0)") nint(x)
    else
      write (number, "(es24.16e3)") x
      number = adjustl(number)
    end if
  end function number

  pure function wanted_text(relation, wanted)
    character(len=*), intent(in) :: relation, wanted
    character(len=len(", wanted ") + len(relation) + 1 + len(wanted)) :: wanted_text

    wanted_text = ", wanted " // relation // " " // wanted
  end function wanted_text

  subroutine fail_with(error, what, text)
    type(error_type), allocatable, intent(inout) :: error
    character(len=*), intent(in), optional :: what
    character(len=*), intent(in) :: text

    if (present(what)) then
      call test_failed(error, what // ": " // text)
    else
      call test_failed(error, text)
    end if
  end subroutine fail_with

end module checks
