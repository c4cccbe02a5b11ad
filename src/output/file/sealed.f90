!> Writes and checks sealed records of 8-byte words. A record consists of a header, a content and a checksum; the header
!> identifies the owner of the content. A file may contain several successive records.
module gestell_output_file_sealed
  use gestell_base_files, only: file_size, read_file
  use gestell_base_hash, only: hash_start, mix
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: read_words, sealed, unseal

  !> `sealed_head`: number of words in the header (magic number, fingerprint, number of words in the content). `word_bytes`: number
  !> of bytes in a word.
  integer, parameter, public :: sealed_head = 3, word_bytes = 8
  !> Magic number: the letters "gestell" in ASCII and the version of this format. A file that was written with the opposite byte
  !> order begins with another number.
  integer(int64), parameter :: magic = int(z"67657374656C6C02", int64)

contains

  !> Sealed record with this fingerprint and content: header, content and checksum.
  pure function sealed(fingerprint, content) result(words)
    integer(int64), intent(in) :: fingerprint, content(:)
    integer(int64), allocatable :: words(:)

    words = [magic, fingerprint, size(content, kind=int64), content, 0_int64]
    words(size(words)) = checksum(words(:size(words) - 1))
  end function sealed

  !> Checks the record whose header begins at word `first`, and returns its fingerprint and the indices of its content.
  pure subroutine unseal(words, first, fingerprint, content, is_valid, truncated)
    integer(int64), intent(in) :: words(:)
    !> Index of the first word of the record's header
    integer, intent(in) :: first
    integer(int64), intent(out) :: fingerprint
    !> Indices in `words` of the first and the last word of the content
    integer, intent(out) :: content(2)
    !> True if the record is complete and its checksum matches
    logical, intent(out) :: is_valid
    !> True if the end of the record is missing
    logical, intent(out), optional :: truncated
    integer(int64) :: room

    fingerprint = 0
    content = first - 1
    is_valid = .false.
    room = size(words) - first - sealed_head
    if (present(truncated)) truncated = room < 0
    if (room < 0) return
    if (present(truncated)) truncated = words(first) == magic .and. words(first + 2) > room
    if (words(first) /= magic .or. words(first + 2) < 0 .or. words(first + 2) > room) return
    fingerprint = words(first + 1)
    content = first + sealed_head + [0, int(words(first + 2)) - 1]
    is_valid = words(content(2) + 1) == checksum(words(first:content(2)))
  end subroutine unseal

  !> Reads the file called `name` as words; an incomplete last word is ignored. If the file cannot be read, `words` is empty.
  subroutine read_words(name, words)
    character(len=*), intent(in) :: name
    integer(int64), allocatable, intent(out) :: words(:)
    character(len=:), allocatable :: bytes
    integer(int64) :: i

    allocate(words(0))
    if (file_size(name) / word_bytes > huge(0)) return
    call read_file(name, bytes)
    deallocate(words)
    allocate(words(len(bytes, int64) / word_bytes))
    do i = 1, size(words, kind=int64)
      words(i) = transfer(bytes((i - 1) * word_bytes + 1:i * word_bytes), words(i))
    end do
  end subroutine read_words

  pure integer(int64) function checksum(words)
    integer(int64), intent(in) :: words(:)

    checksum = hash_start
    call mix(checksum, words)
  end function checksum

end module gestell_output_file_sealed
