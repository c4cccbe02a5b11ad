!> Files as texts, and what a text may hold.
module fuzz_text
  use gestell_base_files, only: file_size
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: absurd_word, read_content, control_character, count_lines, has, lowered, save_text

  character, parameter, public :: newline = new_line("a")

contains

  !> The bytes of a file; empty where there is none.
  subroutine read_content(name, content, there)
    character(len=*), intent(in) :: name
    character(len=:), allocatable, intent(out) :: content
    logical, intent(out) :: there
    integer :: unit, status
    integer(int64) :: bytes

    bytes = file_size(name)
    there = bytes >= 0
    allocate(character(len=max(0_int64, bytes)) :: content)
    if (bytes <= 0) return
    open (newunit=unit, file=name, access="stream", form="unformatted", action="read", status="old", iostat=status)
    if (status == 0) read (unit, iostat=status) content
    if (status == 0) close (unit)
    there = status == 0
  end subroutine read_content

  subroutine save_text(name, content)
    character(len=*), intent(in) :: name, content
    integer :: unit

    open (newunit=unit, file=name, access="stream", form="unformatted", action="write", status="replace")
    write (unit) content
    close (unit)
  end subroutine save_text

  pure logical function has(text, part)
    character(len=*), intent(in) :: text, part

    has = index(text, part) > 0
  end function has

  pure integer function count_lines(text) result(lines)
    character(len=*), intent(in) :: text
    integer :: i

    lines = 0
    do i = 1, len(text)
      if (text(i:i) == newline) lines = lines + 1
    end do
  end function count_lines

  !> Whether there is a control character other than the ends of lines, of one byte or, in UTF-8, of two.
  pure logical function control_character(text)
    character(len=*), intent(in) :: text
    integer :: i

    control_character = .true.
    do i = 1, len(text)
      if (text(i:i) == newline) cycle
      if (ichar(text(i:i)) < 32 .or. ichar(text(i:i)) == 127) return
      if (ichar(text(i:i)) == 194 .and. i < len(text)) then
        if (ichar(text(i + 1:i + 1)) >= 128 .and. ichar(text(i + 1:i + 1)) < 160) return
      end if
    end do
    control_character = .false.
  end function control_character

  pure function lowered(text) result(low)
    character(len=*), intent(in) :: text
    character(len=len(text)) :: low
    integer :: i

    low = text
    do i = 1, len(text)
      if (text(i:i) >= "A" .and. text(i:i) <= "Z") low(i:i) = achar(iachar(text(i:i)) + 32)
    end do
  end function lowered

  !> The first sign of a number that is none in words for people: "NaN", "Infinity", "***"; empty where there is none.
  pure function absurd_word(text) result(word)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: word

    word = ""
    if (has(text, "NaN")) word = "NaN"
    if (has(text, " Inf") .or. has(text, "-Inf") .or. has(text, "+Inf")) word = "Inf"
    if (has(text, "***")) word = "***"
  end function absurd_word

end module fuzz_text
