!> Stores the result of a piece of work as 64-bit words. The same procedure, `work_type%exchange`, writes and reads the values, so
!> both use the same order.
module gestell_task_common_record
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: verdict_of_ordinal, verdict_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  !> A record that is being written or being read.
  type, public :: record_type
    !> True if `pass` reads values from the record; false if it writes values to it.
    logical :: reads = .false.
    integer(int64), allocatable :: words(:)
    !> Number of words that have been read.
    integer, private :: at = 0
    !> True if more words were requested than the record contains.
    logical, private :: short = .false.
  contains
    procedure :: begin, is_complete, pass_words
    procedure, private :: pass_integer, pass_logical, pass_real, pass_reals, pass_table, pass_complex, pass_verdict
    generic :: pass => pass_integer, pass_logical, pass_real, pass_reals, pass_table, pass_complex, pass_verdict
  end type record_type

contains

  !> Starts an empty record for writing or, if `words` is present, starts reading these words.
  pure subroutine begin(self, words)
    class(record_type), intent(inout) :: self
    integer(int64), intent(in), optional :: words(:)

    self%reads = present(words)
    self%at = 0
    self%short = .false.
    self%words = [integer(int64) ::]
    if (present(words)) self%words = words
  end subroutine begin

  !> True if all words have been read and no word was missing.
  pure logical function is_complete(self)
    class(record_type), intent(in) :: self

    is_complete = .not. self%short .and. self%at == size(self%words)
  end function is_complete

  !> Writes or reads an array of words. Its length is stored before it. Data of other types are converted to words by `transfer`.
  pure subroutine pass_words(self, words)
    class(record_type), intent(inout) :: self
    integer(int64), allocatable, intent(inout) :: words(:)
    integer :: n

    n = 0
    if (allocated(words)) n = size(words)
    call self%pass(n)
    if (.not. self%reads) then
      if (n > 0) self%words = [self%words, words]
      return
    end if
    self%short = self%short .or. n < 0 .or. n > size(self%words) - self%at
    if (self%short) n = 0
    words = self%words(self%at + 1:self%at + n)
    self%at = self%at + n
  end subroutine pass_words

  pure subroutine pass_integer(self, value)
    class(record_type), intent(inout) :: self
    integer, intent(inout) :: value

    if (.not. self%reads) then
      self%words = [self%words, int(value, int64)]
      return
    end if
    self%short = self%short .or. self%at >= size(self%words)
    value = 0
    if (self%short) return
    self%at = self%at + 1
    value = int(self%words(self%at))
  end subroutine pass_integer

  pure subroutine pass_logical(self, value)
    class(record_type), intent(inout) :: self
    logical, intent(inout) :: value
    integer :: word

    word = merge(1, 0, value)
    call self%pass(word)
    value = word == 1
  end subroutine pass_logical

  !> Writes or reads a verdict, which is stored as a number.
  pure subroutine pass_verdict(self, verdict)
    class(record_type), intent(inout) :: self
    type(verdict_type), intent(inout) :: verdict
    integer :: ordinal

    ordinal = verdict%ordinal()
    call self%pass(ordinal)
    verdict = verdict_of_ordinal(ordinal)
  end subroutine pass_verdict

  pure subroutine pass_real(self, value)
    class(record_type), intent(inout) :: self
    real(dp), intent(inout) :: value
    integer(int64), allocatable :: words(:)

    words = transfer(value, [0_int64])
    call self%pass_words(words)
    if (size(words) == 1) value = transfer(words, value)
  end subroutine pass_real

  !> Writes or reads a real array. An array that is not allocated is written as an empty array.
  pure subroutine pass_reals(self, values)
    class(record_type), intent(inout) :: self
    real(dp), allocatable, intent(inout) :: values(:)
    integer(int64), allocatable :: words(:)

    if (allocated(values)) words = transfer(values, [0_int64])
    call self%pass_words(words)
    if (self%reads) values = transfer(words, [0.0_dp])
  end subroutine pass_reals

  !> Writes or reads a real array of rank 2. Its number of rows is stored, too.
  pure subroutine pass_table(self, values)
    class(record_type), intent(inout) :: self
    real(dp), allocatable, intent(inout) :: values(:, :)
    real(dp), allocatable :: all(:)
    integer :: rows

    rows = 0
    if (allocated(values)) then
      rows = size(values, 1)
      all = reshape(values, [size(values)])
    end if
    call self%pass(rows)
    call self%pass(all)
    if (.not. self%reads) return
    self%short = self%short .or. rows < 0 .or. modulo(size(all), max(rows, 1)) /= 0
    if (self%short) rows = 1
    values = reshape(all, [rows, size(all) / max(rows, 1)])
  end subroutine pass_table

  pure subroutine pass_complex(self, values)
    class(record_type), intent(inout) :: self
    complex(dp), allocatable, intent(inout) :: values(:)
    integer(int64), allocatable :: words(:)

    if (allocated(values)) words = transfer(values, [0_int64])
    call self%pass_words(words)
    if (self%reads) values = transfer(words, [(0.0_dp, 0.0_dp)])
  end subroutine pass_complex

end module gestell_task_common_record
