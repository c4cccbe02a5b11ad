!> Defines verdicts on the stability of a vibration, ordered by severity, and the words and numbers that stand for them. Some
!> verdicts state why no vibration exists.
module gestell_base_verdict
  implicit none (type, external)
  private

  public :: has_vibration, operator(/=), operator(==), operator(>), state_word, verdict_named, verdict_numbered, &
    & verdict_of_ordinal, worst

  !> A verdict on stability. The operators ==, /= and > compare verdicts; the more severe of two verdicts is the greater one.
  type, public :: verdict_type
    integer, private :: severity = 0
  contains
    procedure :: word, alarm, ordinal, number
  end type verdict_type

  !> Verdict on a vibration whose stability was not examined.
  type(verdict_type), parameter, public :: not_judged = verdict_type(0)
  !> `stable`: disturbances of the vibration decay. `undamped`: they neither grow nor decay. `unstable`: they grow. `undecided`: the
  !> error bounds do not exclude growth or decay.
  type(verdict_type), parameter, public :: stable = verdict_type(1), undamped = verdict_type(2), undecided = verdict_type(3), &
    & unstable = verdict_type(4)
  !> Verdicts if no vibration exists or none is known. `in_resonance`: undamped resonance. `impossible`: the mechanism cannot be
  !> assembled. `failed`: the computation failed.
  type(verdict_type), parameter, public :: in_resonance = verdict_type(5), impossible = verdict_type(6), failed = verdict_type(7)

  !> A verdict on one or on several machines, such as the machine at all speeds of a range.
  type, public :: judgement_type
    type(verdict_type) :: verdict
    !> `extent`: machines to which the verdict applies, such as " at 3 of 40 speeds". `rest`: the rest of the sentence. Both are
    !> unallocated if the verdict is on one machine, or if all machines are stable.
    character(len=:), allocatable :: extent, rest
    !> True if the machines are the points of a sweep. A sweep has a headline of its own, which counts the points with each verdict
    logical :: of_sweep = .false.
  contains
    procedure :: sentence
  end type judgement_type
  !> Stands for the absence of a verdict.
  type(judgement_type), parameter, public :: unjudged = judgement_type(not_judged)

  integer, parameter, public :: verdict_length = 10
  character(len=*), parameter :: words(0:7) = [character(len=verdict_length) :: "", "stable", "undamped", "undecided", "unstable", &
    & "resonance", "impossible", "failed"]
  character(len=*), parameter :: alarms(0:7) = [character(len=verdict_length) :: "", "STABLE", "UNDAMPED", "UNDECIDED", &
    & "UNSTABLE", "RESONANCE", "IMPOSSIBLE", "FAILED"]
  !> Words for the verdicts in tables of the response over the speed. There the word for a stable vibration is "ok".
  character(len=*), parameter, public :: state_words(0:7) = [character(len=verdict_length) :: "", "ok", words(2:)]

  !> Numbers that stand for verdicts in binary files (sweep.npy) and in sweeps. No number stands for a resonance, because a sweep
  !> judges stability without the forced vibration.
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

  !> Word for the verdict in result files; blank for `not_judged`.
  elemental character(len=verdict_length) function word(self)
    class(verdict_type), intent(in) :: self

    word = words(self%severity)
  end function word

  !> Word for the verdict in capital letters, for warnings.
  elemental character(len=verdict_length) function alarm(self)
    class(verdict_type), intent(in) :: self

    alarm = alarms(self%severity)
  end function alarm

  !> Word for the verdict in tables of the response over the speed.
  elemental character(len=verdict_length) function state_word(verdict)
    type(verdict_type), intent(in) :: verdict

    state_word = state_words(verdict%severity)
  end function state_word

  !> The sentence on the verdict; empty if there is no verdict. If `short`, only the verdict and the machines to which it applies:
  !> "stable", or for example "UNSTABLE at 3 of 40 speeds".
  pure function sentence(self, short) result(words)
    class(judgement_type), intent(in) :: self
    logical, intent(in), optional :: short
    character(len=:), allocatable :: words

    words = trim(self%verdict%word())
    if (allocated(self%extent)) words = trim(self%verdict%alarm()) // self%extent
    if (present(short)) then
      if (short) return
    end if
    if (allocated(self%rest)) words = words // self%rest
  end function sentence

  !> Severity of the verdict, from 0 (not judged) and 1 (stable) to 7 (failed).
  elemental integer function ordinal(self)
    class(verdict_type), intent(in) :: self

    ordinal = self%severity
  end function ordinal

  !> Verdict with this severity, as defined by `ordinal`; `not_judged` for any other number.
  elemental type(verdict_type) function verdict_of_ordinal(ordinal) result(verdict)
    integer, intent(in) :: ordinal

    if (ordinal > 0 .and. ordinal <= ubound(words, 1)) verdict%severity = ordinal
  end function verdict_of_ordinal

  !> Number that stands for the verdict in binary files; -1 if there is none.
  elemental integer function number(self)
    class(verdict_type), intent(in) :: self

    number = numbers(self%severity)
  end function number

  !> Verdict for which this word stands; `not_judged` for any other word.
  elemental type(verdict_type) function verdict_named(word) result(verdict)
    character(len=*), intent(in) :: word

    verdict = verdict_type(findloc(words(1:) == word, .true., dim=1))
  end function verdict_named

  !> Verdict for which this number stands in binary files; `not_judged` for any other number.
  elemental type(verdict_type) function verdict_numbered(number) result(verdict)
    integer, intent(in) :: number

    verdict = verdict_type(findloc(numbers(1:), number, dim=1))
  end function verdict_numbered

  !> True if a vibration with this verdict exists: stable, undamped, undecided or unstable.
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

  !> The more severe of two verdicts.
  elemental type(verdict_type) function worst(one, other)
    type(verdict_type), intent(in) :: one, other

    worst = verdict_type(max(one%severity, other%severity))
  end function worst

end module gestell_base_verdict
