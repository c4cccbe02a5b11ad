!> Journal of a run: a file with the results of all finished pieces of work. After an interruption, the next run reads these results
!> instead of computing them again.
!>
!> A sweep has a store of its own (gestell_task_sweep_checkpoint), because its tiles have other needs: their rows stand at fixed
!> places in the file that becomes the table, so that they are written once and never held in memory together, and processes on
!> several machines write them at once. Records of the journal differ in length, are read at once, and belong to one process.
module gestell_task_common_journal
  use gestell_base_files, only: close_file, create_file, file_size, remove_file, rename_file, write_bytes
  use gestell_base_hash, only: mix_text
  use gestell_base_version, only: version
  use gestell_output_file_output, only: temporary_ending
  use gestell_output_file_sealed, only: read_words, sealed, unseal, word_bytes
  use gestell_output_file_staging, only: journal_name
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: open_journal

  !> The journal file. Each record contains the number of a round (a call of `distribute`), the number of a piece in this round, and
  !> the result of the piece.
  type, public :: journal_type
    !> True if the file contains a damaged record of an earlier run.
    logical :: damaged = .false.
    character(len=:), allocatable, private :: name
    integer(int64), private :: fingerprint = 0
    !> Contents of the journal of an earlier run, as 64-bit words.
    integer(int64), allocatable, private :: words(:)
    !> Indices in `words` of the first and the last word of each record.
    integer, allocatable, private :: begins(:), ends(:)
    !> Number of the record at which the next search begins. Results are usually requested in the order of the file.
    integer, private :: next = 1
    !> File handle; -1 until the first record is written, and after a failure.
    integer(c_int), private :: handle = -1
    !> True if writing to the file has failed. Nothing more is stored then.
    logical, private :: failed = .false.
  contains
    procedure :: close => close_journal, find, store
  end type journal_type

contains

  !> Opens the journal in `folder`, which no other process may use at the same time. `content`: hash of the input. Records of
  !> another input, or of another version of the program, are ignored.
  subroutine open_journal(journal, folder, content)
    type(journal_type), intent(out) :: journal
    character(len=*), intent(in) :: folder
    integer(int64), intent(in) :: content
    integer(int64) :: fingerprint
    integer :: record(2), first
    logical :: is_valid, truncated

    journal%name = folder // "/" // journal_name
    journal%fingerprint = content
    call mix_text(journal%fingerprint, version)
    allocate(journal%begins(0), journal%ends(0), journal%words(0))
    if (file_size(journal%name) <= 0) return
    call read_words(journal%name, journal%words)
    first = 1
    do while (first <= size(journal%words))
      call unseal(journal%words, first, fingerprint, record, is_valid, truncated)
      if (is_valid .and. fingerprint /= journal%fingerprint) exit
      ! If a run was killed, the last record may be incomplete; this does not count as damage.
      journal%damaged = .not. (is_valid .or. truncated)
      if (.not. is_valid .or. record(2) <= record(1)) exit
      journal%begins = [journal%begins, record(1)]
      journal%ends = [journal%ends, record(2)]
      first = record(2) + 2
    end do
  end subroutine open_journal

  !> Returns the stored result of a piece as `words`. They are empty if no result is stored.
  subroutine find(self, round, piece, words)
    class(journal_type), intent(inout) :: self
    integer, intent(in) :: round, piece
    integer(int64), allocatable, intent(out) :: words(:)
    integer :: i, k

    do k = 0, size(self%begins) - 1
      i = 1 + mod(self%next - 1 + k, size(self%begins))
      associate (begin => self%begins(i))
        if (self%words(begin) /= round .or. self%words(begin + 1) /= piece) cycle
        words = self%words(begin + 2:self%ends(i))
      end associate
      self%next = i + 1
      return
    end do
    allocate(words(0))
  end subroutine find

  !> Stores the result of a piece. If the file cannot be written, the journal is closed and the run continues without it.
  subroutine store(self, round, piece, words)
    class(journal_type), intent(inout) :: self
    integer, intent(in) :: round, piece
    integer(int64), intent(in) :: words(:)
    logical :: done

    if (self%failed .or. size(words) == 0) return
    done = .true.
    if (self%handle < 0) then
      ! Create the file, and copy the records of an earlier run into it.
      call create_file(self%name // temporary_ending, self%handle)
      done = self%handle >= 0
      if (done .and. size(self%ends) > 0) call append(self, self%words(:self%ends(size(self%ends)) + 1), done)
      if (done) call rename_file(self%name // temporary_ending, self%name, done)
      if (.not. done) call remove_file(self%name // temporary_ending)
    end if
    if (done) call append(self, sealed(self%fingerprint, [int([round, piece], int64), words]), done)
    self%failed = .not. done
    if (self%failed) call self%close()
  end subroutine store

  !> Closes the file. Windows keeps an open file in its folder even if it is removed.
  subroutine close_journal(self)
    class(journal_type), intent(inout) :: self
    logical :: done

    if (self%handle >= 0) call close_file(self%handle, done)
    self%handle = -1
  end subroutine close_journal

  subroutine append(journal, words, done)
    class(journal_type), intent(in) :: journal
    integer(int64), intent(in) :: words(:)
    logical, intent(out) :: done

    call write_bytes(journal%handle, transfer(words, repeat(" ", word_bytes * size(words))), done)
  end subroutine append

end module gestell_task_common_journal
