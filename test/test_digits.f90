!> Numbers as text against the formats of the language.
module test_digits
  use checks, only: check_that
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, fixed, text
  use gestell_output_table_scientific, only: number_width, put_number
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_negative_inf, ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_fortran_env, only: int64, qp => real128
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_digits

contains

  subroutine collect_digits(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [new_unittest("numbers of all sizes, ties included, are printed with correct digits", test_numbers), &
      & new_unittest("whole numbers are printed with all their digits", test_whole)]
  end subroutine collect_digits

  subroutine test_numbers(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: value
    integer(int64) :: state
    integer :: i, k

    do i = -320, 307
      value = real(10.0_qp**i, dp)
      call compare(value)
      call compare(-nearest(value, -1.0_dp))
      call compare(5 * value)
      if (allocated(error)) return
    end do
    ! exact halves of the last printed digit, and their neighbours
    do i = 0, 1000
      value = i * 0.125_dp
      call compare(value)
      call compare(-value)
      call compare(nearest(value, 1.0_dp))
      call compare(nearest(value, -1.0_dp))
      call compare((i + 0.5_dp) * 1.0e5_dp)
      if (allocated(error)) return
    end do
    state = 20240229
    do i = 1, 3000
      do k = 1, 3
        state = ieor(state, ishft(state, 13))
        state = ieor(state, ishft(state, -7))
        state = ieor(state, ishft(state, 17))
      end do
      value = transfer(state, value)
      call compare(value)
      call compare(real(mod(state, 10_int64**12), dp) * 1.0e-6_dp)
      if (allocated(error)) return
    end do
    call check_that(error, concise(ieee_value(1.0_dp, ieee_quiet_nan)), "==", "NaN")
    call check_that(error, concise(ieee_value(1.0_dp, ieee_negative_inf)), "==", "-Inf")

  contains

    subroutine compare(value)
      real(dp), intent(in) :: value
      character(len=400) :: wanted, layout
      character(len=:), allocatable :: line
      integer :: digits, exponent, n

      if (allocated(error) .or. .not. ieee_is_finite(value)) return
      line = repeat(" ", number_width)
      n = 0
      call put_number(line, n, value)
      write (wanted, "(es24.16e3)") value
      call check_that(error, line(:n), "==", trim(adjustl(wanted)), "all digits")
      do digits = 1, 17, 4
        write (layout, "(a, i0, a)") "(es40.", digits - 1, "e4)"
        write (wanted, layout) value
        wanted = adjustl(wanted)
        n = index(wanted, "E")
        read (wanted(n + 1:), *) exponent
        if (exponent >= -4 .and. exponent < max(digits, 6)) then
          wanted = plain(value, max(0, digits - 1 - exponent))
          if (index(wanted, ".") > 0) wanted = without_zeros(wanted)
        else
          write (layout, "(i0)") exponent
          wanted = trim(without_zeros(wanted(:n - 1))) // "e" // layout
        end if
        call check_that(error, concise(value, digits), "==", trim(wanted), "in short")
      end do
      do digits = 0, 12, 3
        call check_that(error, fixed(value, digits), "==", trim(plain(value, digits)), "in decimals")
      end do
    end subroutine compare

    !> Fixed notation, without an exponent; zero has no sign.
    function plain(value, decimals) result(line)
      real(dp), intent(in) :: value
      integer, intent(in) :: decimals
      character(len=400) :: line, layout

      write (layout, "(a, i0, a)") "(f390.", decimals, ")"
      write (line, layout) value
      line = adjustl(line)
      if (verify(trim(line), "-0.") == 0 .and. line(1:1) == "-") line = line(2:)
      if (line(1:1) == ".") line = "0" // line(:399)
      if (line(1:2) == "-.") line = "-0" // line(2:399)
      if (decimals == 0) line = line(:index(line, ".") - 1)
    end function plain

    function without_zeros(line) result(short)
      character(len=*), intent(in) :: line
      character(len=len(line)) :: short

      short = line(:verify(trim(line), "0", back=.true.))
      if (short(len_trim(short):len_trim(short)) == ".") short = short(:len_trim(short) - 1)
    end function without_zeros

  end subroutine test_numbers

  subroutine test_whole(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=20) :: wanted
    integer, parameter :: values(*) = [0, 1, -1, 9, 10, -10, 99999, 100000, huge(1), -huge(1), -huge(1) - 1]
    integer :: i

    do i = 1, size(values)
      write (wanted, "(i0)") values(i)
      call check_that(error, text(values(i)), "==", trim(wanted))
    end do
  end subroutine test_whole

end module test_digits
