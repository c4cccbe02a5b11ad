!> The verdicts on a vibration, in the order of their severity.
module gestell_base_verdict
  implicit none (type, external)
  private

  public :: operator(==), operator(>), verdict_named, worst

  !> A verdict: compare two with == and >, where the greater one is the worse one.
  type, public :: verdict_type
    integer, private :: severity = 0
  contains
    procedure :: word
  end type verdict_type

  !> Nothing was judged; disturbances die out; they neither grow nor decay; an error bound reaches across the border; they grow.
  type(verdict_type), parameter, public :: not_judged = verdict_type(0), stable = verdict_type(1), undamped = verdict_type(2), &
    & undecided = verdict_type(3), unstable = verdict_type(4)

  character(len=9), parameter :: words(0:4) = [character(len=9) :: "", "stable", "undamped", "undecided", "unstable"]

  interface operator(==)
    procedure are_equal
  end interface operator(==)

  interface operator(>)
    procedure is_worse
  end interface operator(>)

contains

  !> As files have it; blank where nothing was judged.
  elemental character(len=9) function word(self)
    class(verdict_type), intent(in) :: self

    word = words(self%severity)
  end function word

  !> The verdict with this word; `not_judged` for any other word.
  elemental type(verdict_type) function verdict_named(word) result(verdict)
    character(len=*), intent(in) :: word

    integer :: k

    do k = 1, ubound(words, 1)
      if (word == words(k)) verdict%severity = k
    end do
  end function verdict_named

  elemental logical function are_equal(one, other)
    type(verdict_type), intent(in) :: one, other

    are_equal = one%severity == other%severity
  end function are_equal

  elemental logical function is_worse(one, other)
    type(verdict_type), intent(in) :: one, other

    is_worse = one%severity > other%severity
  end function is_worse

  !> The worse one of two.
  elemental type(verdict_type) function worst(one, other)
    type(verdict_type), intent(in) :: one, other

    worst = verdict_type(max(one%severity, other%severity))
  end function worst

end module gestell_base_verdict
