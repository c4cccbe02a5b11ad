!> Changes of a text: of bytes, words, lines and groups.
module fuzz_mutation
  use fuzz_dice, only: dice_type
  use fuzz_values, only: wild_name, wild_number
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: limited, mutate

  character, parameter :: newline = new_line("a")
  character(len=*), parameter :: letters = "&/=,()'""!* " // newline // achar(13) // achar(9) // "$;:.+-0123eEdDnNxX%#<>\@" // &
    & achar(0) // achar(27) // achar(127) // char(195) // char(164) // char(255)
  character(len=*), parameter :: words(*) = [character(len=16) :: "&case", "&drive", "&joint", "&link", "&frame", "&support", &
    & "&foundation", "&probe", "&sweep", "&accuracy", "&units", "&mass_functions", "&sensitivity", "&resonance", "&end", "$end", &
    & "/", "//", "&", "tasks='modes'", "tasks='forces'", "tasks='power'", "tasks='drawing'", "mass=", "inertia=", "position=", &
    & "stiffness=", "damping=", "angle=", "branch=-1", "phase=", "center=", "dof='psi'", "dof='xi','eta'", "name='A'", "ends='A'", &
    & "type='rigid'", "type='RRP'", "guide='A','B'", "offset=0,0", "count=2", "points=2", "steps=7", "method='rk4'", &
    & "tolerance=1e-3", "lengths(2)=", "stiffness(1,1)=", "2*", ",,", "!", "''", "'", "length='mm'"]

contains

  !> A few changes of one text; `other` lends pieces.
  subroutine mutate(dice, text, other)
    type(dice_type), intent(inout) :: dice
    character(len=:), allocatable, intent(inout) :: text
    character(len=*), intent(in) :: other
    integer :: k, at, length

    do k = 1, dice%pick_of([1, 1, 1, 2, 3, 6])
      if (len(text) == 0) text = " "
      at = 1 + dice%below(len(text))
      length = min(1 + dice%below(12), len(text) - at + 1)
      select case (dice%below(14))
      case (0)
        text = text(:at - 1) // text(at + length:)
      case (1)
        text = text(:at + length - 1) // text(at:)
      case (2)
        text = text(:at - 1) // letter(dice) // text(at + 1:)
      case (3)
        text = text(:at - 1) // letter(dice) // text(at:)
      case (4)
        text = text(:at - 1) // " " // dice%pick(words) // " " // text(at:)
      case (5, 6, 7, 8)
        call change_number(dice, text, at)
      case (9)
        call change_line(dice, text, at)
      case (10)
        if (dice%chance(0.3_dp)) text = text(:at - 1)
      case (11)
        call lend(dice, text, at, other)
      case (12)
        call change_name(dice, text, at)
      case default
        text = text(:at - 1) // char(dice%below(256)) // text(at + 1:)
      end select
    end do
  end subroutine mutate

  character function letter(dice)
    type(dice_type), intent(inout) :: dice
    integer :: i

    i = 1 + dice%below(len(letters))
    letter = letters(i:i)
  end function letter

  !> The next number behind `at` becomes a wild one, or grows or shrinks.
  subroutine change_number(dice, text, at)
    type(dice_type), intent(inout) :: dice
    character(len=:), allocatable, intent(inout) :: text
    integer, intent(in) :: at
    character(len=*), parameter :: digits = "0123456789.+-eE"
    integer :: first, last

    first = scan(text(at:), "0123456789")
    if (first == 0) return
    first = first + at - 1
    if (first > 1) then
      ! part of a name, as in J1
      if (scan(text(first - 1:first - 1), "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_") > 0) return
    end if
    last = verify(text(first:), digits)
    last = merge(len(text), first + last - 2, last == 0)
    text = text(:first - 1) // wild_number(dice) // text(last + 1:)
  end subroutine change_number

  !> The text between two quotes becomes another.
  subroutine change_name(dice, text, at)
    type(dice_type), intent(inout) :: dice
    character(len=:), allocatable, intent(inout) :: text
    integer, intent(in) :: at
    integer :: first, last

    first = index(text(at:), "'")
    if (first == 0) return
    first = first + at - 1
    last = index(text(first + 1:), "'")
    if (last == 0) return
    text = text(:first) // wild_name(dice) // text(first + last:)
  end subroutine change_name

  !> The line at `at` goes, comes twice, or comes first.
  subroutine change_line(dice, text, at)
    type(dice_type), intent(inout) :: dice
    character(len=:), allocatable, intent(inout) :: text
    integer, intent(in) :: at
    integer :: first, last

    first = index(text(:at), newline, back=.true.) + 1
    last = index(text(at:), newline)
    last = merge(len(text), at + last - 1, last == 0)
    select case (dice%below(3))
    case (0)
      text = text(:first - 1) // text(last + 1:)
    case (1)
      text = text(:last) // text(first:)
    case default
      text = text(first:last) // text(:first - 1) // text(last + 1:)
    end select
  end subroutine change_line

  !> A line of another text.
  subroutine lend(dice, text, at, other)
    type(dice_type), intent(inout) :: dice
    character(len=:), allocatable, intent(inout) :: text
    integer, intent(in) :: at
    character(len=*), intent(in) :: other
    integer :: first, last, place

    if (len(other) == 0) return
    place = 1 + dice%below(len(other))
    first = index(other(:place), newline, back=.true.) + 1
    last = index(other(place:), newline)
    last = merge(len(other), place + last - 1, last == 0)
    place = index(text(:at), newline, back=.true.)
    text = text(:place) // other(first:last) // text(place + 1:)
  end subroutine lend

  !> The text with numbers of points, steps and so on cut to two digits: large orders are no fault, they only take long.
  function limited(text) result(short)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: short
    character(len=*), parameter :: keys(*) = [character(len=9) :: "count", "points", "harmonics", "steps"]
    integer :: k, at, first, digits

    short = text
    do k = 1, size(keys)
      at = 0
      do
        first = index(short(at + 1:), trim(keys(k)))
        if (first == 0) exit
        at = at + first + len_trim(keys(k)) - 1
        first = verify(short(at + 1:), " =*'" // newline)
        if (first == 0) exit
        first = at + first
        digits = verify(short(first:), "0123456789") - 1
        if (digits < 0) digits = len(short) - first + 1
        if (digits > 2 .and. digits < 7) short = short(:first + 1) // short(first + digits:)
      end do
    end do
  end function limited

end module fuzz_mutation
