!> Verdicts on a vibration in the order of severity, and the reasons why there may be no vibration, with their words and numbers.
module gestell_base_verdict
  implicit none (type, external)
  private

  public :: has_vibration, operator(/=), operator(==), operator(>), state_word, verdict_named, verdict_numbered, &
    & verdict_of_ordinal, worst

  !> A verdict: compare two with ==, /= and >, where the greater one is the worse one.
  type, public :: verdict_type
    integer, private :: severity = 0
  contains
    procedure :: word
    procedure :: alarm
    procedure :: ordinal
    procedure :: number
  end type verdict_type

  !> Nothing was judged.
  type(verdict_type), parameter, public :: not_judged = verdict_type(0)
  !> Disturbances of the vibration decay; neither grow nor decay; grow or decay, the error bound does not tell which; grow.
  type(verdict_type), parameter, public :: stable = verdict_type(1), undamped = verdict_type(2), undecided = verdict_type(3), &
    & unstable = verdict_type(4)
  !> There is no vibration: a resonance without damping leaves none, the mechanism cannot be assembled, a computation failed.
  type(verdict_type), parameter, public :: in_resonance = verdict_type(5), impossible = verdict_type(6), failed = verdict_type(7)

  integer, parameter, public :: verdict_length = 10
  character(len=*), parameter :: words(0:7) = [character(len=verdict_length) :: "", "stable", "undamped", "undecided", "unstable", &
    & "resonance", "impossible", "failed"]
  character(len=*), parameter :: alarms(0:7) = [character(len=verdict_length) :: "", "STABLE", "UNDAMPED", "UNDECIDED", &
    & "UNSTABLE", "RESONANCE", "IMPOSSIBLE", "FAILED"]
  !> In tables of the response over the speed a stable vibration has the state "ok".
  character(len=*), parameter, public :: state_words(0:7) = [character(len=verdict_length) :: "", "ok", words(2:)]

  !> Numbers in place of words in binary files (sweep.npy) and in the values of sweeps. A resonance has none: a sweep judges without
  !> the forced vibration.
  integer, parameter, public :: stable_number = 0, unstable_number = 1, undecided_number = 2, impossible_number = 3, &
    & failed_number = 4, undamped_number = 5, last_number = 5
  integer, parameter :: numbers(0:7) = [-1, stable_number, undamped_number, undecided_number, unstable_number, -1, &
    & impossible_number, failed_number]

  interface operator(==)
    procedure are_equal
  end interface operator(==)

  interface operator(/=)
    procedure differ
  end interface operator(/=)

  interface operator(>)
    procedure is_worse
  end interface operator(>)

contains

  !> The word in files; blank if nothing was judged.
  elemental character(len=verdict_length) function word(self)
    class(verdict_type), intent(in) :: self

    word = words(self%severity)
  end function word

  !> The word in capitals, for sentences that must not be overlooked.
  elemental character(len=verdict_length) function alarm(self)
    class(verdict_type), intent(in) :: self

    alarm = alarms(self%severity)
  end function alarm

  !> The word in tables of states.
  elemental character(len=verdict_length) function state_word(verdict)
    type(verdict_type), intent(in) :: verdict

    state_word = state_words(verdict%severity)
  end function state_word

  !> Position in the order of severity: 1 stable to 4 unstable.
  elemental integer function ordinal(self)
    class(verdict_type), intent(in) :: self

    ordinal = self%severity
  end function ordinal

  !> The verdict at this position; `not_judged` for any other number.
  elemental type(verdict_type) function verdict_of_ordinal(ordinal) result(verdict)
    integer, intent(in) :: ordinal

    if (ordinal > 0 .and. ordinal <= ubound(words, 1)) verdict%severity = ordinal
  end function verdict_of_ordinal

  !> The number in binary files; -1 if it has none.
  elemental integer function number(self)
    class(verdict_type), intent(in) :: self

    number = numbers(self%severity)
  end function number

  !> The verdict with this word; `not_judged` for any other word.
  elemental type(verdict_type) function verdict_named(word) result(verdict)
    character(len=*), intent(in) :: word

    verdict = verdict_type(findloc(words(1:) == word, .true., dim=1))
  end function verdict_named

  !> The verdict with this number in binary files; `not_judged` for any other number.
  elemental type(verdict_type) function verdict_numbered(number) result(verdict)
    integer, intent(in) :: number

    verdict = verdict_type(findloc(numbers(1:), number, dim=1))
  end function verdict_numbered

  !> True if the verdict is one on a vibration; false if there is no vibration, or nothing was judged.
  elemental logical function has_vibration(verdict)
    type(verdict_type), intent(in) :: verdict

    has_vibration = verdict%severity >= stable%severity .and. verdict%severity <= unstable%severity
  end function has_vibration

  elemental logical function are_equal(one, other)
    type(verdict_type), intent(in) :: one, other

    are_equal = one%severity == other%severity
  end function are_equal

  elemental logical function differ(one, other)
    type(verdict_type), intent(in) :: one, other

    differ = one%severity /= other%severity
  end function differ

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
