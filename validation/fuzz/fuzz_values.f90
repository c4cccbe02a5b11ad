!> Numbers and names as they are typed, sound or not.
module fuzz_values
  use fuzz_dice, only: dice_type
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: name_word, real_word, whole_word, wild_name, wild_number

  !> How a document is drawn: the dice, and how probable a wild value is at each place.
  type, public :: source_type
    type(dice_type) :: dice
    real(dp) :: wild = 0
  end type source_type

  !> Measures that the groups have in common.
  type, public :: scale_type
    real(dp) :: length = 1, mass = 1, stiffness = 1, damping = 1, speed = 1
    !> The joints so far: J1 ... Jn; the links L1 ... Lm; supports.
    integer :: joints = 0, links = 0, supports = 0, probes = 0
    !> Mass functions in place of joints and links; whether the frame may move in space.
    logical :: functions = .false., space = .false.
  end type scale_type

  character(len=*), parameter :: wild_numbers(*) = [character(len=24) :: &
    & "0", "0.0", "-0.0", "-1", "1", "NaN", "nan(7)", "Infinity", "-inf", "1e300", "-1e300", "1e307", "9.99e307", "1e308", &
    & "1e400", "1e-300", "1e-307", "2.3e-308", "1e-320", "4.9e-324", "-4.9e-324", "1e-400", "1e155", "1e-155", "1e-160", &
    & "1e160", "1e77", "1e-77", "1e20", "1e-20", "99999999999", "2147483647", "2147483648", "-2147483648", &
    & "9223372036854775808", "1000000", "1000001", "65536", "1e", "e5", "1d5", "1q5", "+5", "1_000", ".", "+", "-", &
    & "1.5.2", "0x10", "1,5", "2*3", "3*", "0*1", "-2*1", "999999999*1", "''", "'1'", """2", ".true.", "T", "1/2", &
    & "1e99999999999999999999", "0.000000000000000001", "12345678901234567890123", "(1,2)", "$5", "1e+-3", ""]
  character(len=*), parameter :: wild_names(*) = [character(len=24) :: &
    & "", " ", "A B", "a,b", "a=b", "f(x)", "(1)", ")", "it''s", "=1+1", "@SUM(A1)", "-5", "+A", "50 %", "%s%n%d", """q""", &
    & "<b>&amp;</b>", "a/b", "../x", "$HOME", "`id`", "a;b", "#1", "!", "&joint", "A0", "a0", "NaN", "1", "support(1)", &
    & "drive.speed_rpm", "{/Symbol a}", "a_b^c", "\\n", "@", achar(9) // "tab", &
    & char(195) // char(164) // char(206) // char(169), char(255) // char(254), "a" // achar(27) // "[2Jb", &
    & "a" // achar(7), "a" // achar(127) // "b"]

contains

  !> A number near what is sound, in one of the ways of writing it; now and then a wild one.
  function real_word(source, value) result(word)
    type(source_type), intent(inout) :: source
    real(dp), intent(in) :: value
    character(len=:), allocatable :: word
    character(len=32) :: buffer

    if (source%dice%chance(source%wild)) then
      word = wild_number(source%dice)
      return
    end if
    select case (source%dice%below(4))
    case (0)
      write (buffer, "(es24.16e3)") value
    case (1)
      write (buffer, "(es12.4e3)") value
    case default
      write (buffer, "(g0.6)") value
    end select
    word = trim(adjustl(buffer))
  end function real_word

  function whole_word(source, value) result(word)
    type(source_type), intent(inout) :: source
    integer, intent(in) :: value
    character(len=:), allocatable :: word
    character(len=16) :: buffer

    if (source%dice%chance(source%wild)) then
      word = wild_number(source%dice)
      return
    end if
    write (buffer, "(i0)") value
    word = trim(buffer)
  end function whole_word

  !> A name in quotes.
  function name_word(source, name) result(word)
    type(source_type), intent(inout) :: source
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: word

    word = "'" // name // "'"
    if (source%dice%chance(source%wild / 2)) word = "'" // wild_name(source%dice) // "'"
  end function name_word

  !> A number of any kind, or what only looks like one.
  function wild_number(dice) result(word)
    type(dice_type), intent(inout) :: dice
    character(len=:), allocatable :: word
    character(len=32) :: buffer

    select case (dice%below(3))
    case (0)
      word = dice%pick(wild_numbers)
    case (1)
      write (buffer, "(es12.4e3)") dice%decades(-30.0_dp, 30.0_dp)
      word = trim(adjustl(buffer))
    case default
      write (buffer, "(es12.4e3)") dice%decades(-307.0_dp, 307.0_dp) * merge(-1, 1, dice%chance(0.2_dp))
      word = trim(adjustl(buffer))
    end select
  end function wild_number

  !> What nobody would call a joint.
  function wild_name(dice) result(word)
    type(dice_type), intent(inout) :: dice
    character(len=:), allocatable :: word

    select case (dice%below(8))
    case (0)
      word = repeat("x", 60 + dice%below(10))
    case (1)
      word = repeat(dice%pick(wild_names) // "y", 1 + dice%below(200))
    case (2)
      word = "two" // new_line("a") // "lines"
    case default
      word = dice%pick(wild_names)
    end select
  end function wild_name

end module fuzz_values
