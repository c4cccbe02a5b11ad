!> Reads namelist files and returns their groups, keys and values. The line number of each group, key and value is recorded.
module gestell_input_namelist
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_files, only: close_file, file_exists, folder_exists, open_to_read, read_chunk, report_system_error
  use gestell_base_paths, only: find_full_path
  use gestell_base_text, only: text
  use gestell_input_namelist_document, only: document_type, group_type, entry_type
  use gestell_input_namelist_entry, only: parse_entry, is_name
  use gestell_input_namelist_message, only: label, location, refuse_line
  use gestell_input_namelist_scanner, only: scanner_type, token_type, next_token, skip_blanks, bare, mark, end_of_text
  use gestell_input_wording, only: shown, lower
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none (type, external)
  private

  public :: read_document, parse_document

  !> Maximum size of an input file in bytes; a larger file is an error.
  integer, parameter :: max_bytes = 100000000
  !> Byte order mark of UTF-8: three bytes that some editors write at the beginning of a text.
  character(len=*), parameter :: byte_order_mark = char(239) // char(187) // char(191)

contains

  !> Reads a namelist file and parses it. Fails if the file cannot be read or its syntax is wrong.
  subroutine read_document(file, doc, error)
    character(len=*), intent(in) :: file
    type(document_type), intent(out) :: doc
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: text

    call read_text(file, text, error)
    if (allocated(error)) return
    call parse_document(text, file, doc, error)
    call find_full_path(file, doc%path)
  end subroutine read_document

  !> Reads all bytes of a file. Fails if the file does not exist, is a directory, cannot be read or is too large.
  subroutine read_text(file, content, error)
    character(len=*), intent(in) :: file
    character(len=:), allocatable, intent(out) :: content
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: buffer
    character(len=65536) :: piece
    integer(c_int) :: handle
    integer :: n, length
    logical :: closed

    handle = -1
    if (.not. file_exists(file)) then
      call fatal_error(error, file // ": there is no such file", invalid_input)
    else if (folder_exists(file)) then
      call fatal_error(error, file // ": is a directory, not a file", invalid_input)
    else
      call open_to_read(file, handle)
      if (handle < 0) call report_system_error(file // ": cannot be read", invalid_input, error)
    end if
    if (allocated(error)) return
    allocate(character(len=len(piece)) :: buffer)
    length = 0
    do
      call read_chunk(handle, piece, n)
      if (n <= 0 .or. length + n >= max_bytes) exit
      if (length + n > len(buffer)) buffer = buffer // repeat(" ", len(buffer) + n)
      buffer(length + 1:length + n) = piece(:n)
      length = length + n
    end do
    if (n < 0) then
      call report_system_error(file // ": cannot be read", invalid_input, error)
    else if (n > 0) then
      call fatal_error(error, file // ": is larger than " // text(max_bytes / 1000000) // " MB", invalid_input)
    end if
    call close_file(handle, closed)
    content = buffer(:length)
  end subroutine read_text

  !> Parses a text in the format of a namelist file. Fails if its syntax is wrong.
  pure subroutine parse_document(text, file, doc, error)
    !> `text`: content of the file, with lines separated by new_line('a'). `file`: name of the file, for messages
    character(len=*), intent(in) :: text, file
    type(document_type), intent(out) :: doc
    type(error_type), allocatable, intent(out) :: error
    type(group_type), allocatable :: groups(:), longer(:)
    type(scanner_type) :: scanner
    integer :: n

    doc%file = file
    call check_characters(text, file, error)
    if (allocated(error)) return
    scanner%text = text
    if (index(text, byte_order_mark) == 1) scanner%position = 4

    allocate(groups(16))
    n = 0
    do
      call skip_outside(scanner, file, groups(:n), error)
      if (allocated(error)) return
      if (scanner%position > len(text)) exit
      if (n == size(groups)) then
        allocate(longer(2 * n))
        longer(:n) = groups
        call move_alloc(longer, groups)
      end if
      n = n + 1
      call parse_group(scanner, file, groups(n), error)
      if (allocated(error)) return
    end do
    if (n == 0) call fatal_error(error, file // ": contains no group &name ... /", invalid_input)
    if (allocated(error)) return
    doc%groups = groups(:n)
    doc%text = text
  end subroutine parse_document

  !> Moves the scanner to the & of the next group or, if there is none, to the end of the text. Fails if anything other than blanks
  !> and comments is skipped.
  pure subroutine skip_outside(scanner, file, groups, error)
    type(scanner_type), intent(inout) :: scanner
    character(len=*), intent(in) :: file
    type(group_type), intent(in) :: groups(:)
    type(error_type), allocatable, intent(out) :: error
    type(scanner_type) :: ahead
    type(token_type) :: token
    character(len=:), allocatable :: message
    integer :: behind

    behind = scanner%position
    call skip_blanks(scanner)
    if (scanner%position > len(scanner%text)) return
    if (scanner%text(scanner%position:scanner%position) == "&") return
    ahead = scanner
    call next_token(ahead, token)
    message = "'" // shown(token%text) // "' is outside of any group"
    if (token%text(1:min(1, len(token%text))) == "$") then
      message = "write &" // shown(token%text(2:)) // " ... / instead of " // shown(token%text)
    else if (size(groups) > 0) then
      message = message // ": the / before it ended " // label(groups(size(groups)))
      if (scanner%position == behind) message = message // " (a fraction? write a decimal number)"
    end if
    call fatal_error(error, location(file, token%line) // message, invalid_input)
  end subroutine skip_outside

  !> Parses one group, from its & to its /.
  pure subroutine parse_group(scanner, file, group, error)
    type(scanner_type), intent(inout) :: scanner
    character(len=*), intent(in) :: file
    type(group_type), intent(out) :: group
    type(error_type), allocatable, intent(out) :: error
    type(entry_type), allocatable :: entries(:), longer(:)
    type(token_type) :: token
    integer :: n

    call next_token(scanner, token)
    group%line = token%line
    group%file = file
    call next_token(scanner, token)
    group%name = lower(token%text)
    allocate(group%entries(0))
    if (token%kind /= bare .or. .not. is_name(token%text)) then
      call fatal_error(error, location(file, group%line) // "a group's name must follow the &", invalid_input)
    else if (group%name == "end") then
      call fatal_error(error, location(file, group%line) // "&end without a group before it", invalid_input)
    end if
    if (allocated(error)) return

    allocate(entries(8))
    n = 0
    call next_token(scanner, token)
    do while (token%kind == bare)
      if (n == size(entries)) then
        allocate(longer(2 * n))
        longer(:n) = entries
        call move_alloc(longer, entries)
      end if
      n = n + 1
      call parse_entry(scanner, group, token, entries(n), error)
      if (allocated(error)) return
      ! from now on messages identify the group by its name
      if (entries(n)%key == "name" .and. size(group%entries) == 0) group%entries = entries(n:n)
    end do
    if (token%kind == mark .and. token%text == "/") then
      group%entries = entries(:n)
    else
      call refuse_end(scanner, group, token, error)
    end if
  end subroutine parse_group

  !> Returns an error for a group that does not end with a /. The message states the probable reason.
  pure subroutine refuse_end(scanner, group, token, error)
    type(scanner_type), intent(inout) :: scanner
    type(group_type), intent(in) :: group
    type(token_type), intent(in) :: token
    type(error_type), allocatable, intent(out) :: error
    type(token_type) :: next
    character(len=:), allocatable :: message
    integer :: line

    line = group%line
    if (token%kind == end_of_text) then
      message = "has no closing / (the file ends)"
    else if (token%text == "&") then
      call next_token(scanner, next)
      message = "has no closing / (the next group begins in line " // text(token%line) // ")"
      if (lower(next%text) == "end") then
        message = "close the group with / instead of &end"
        line = token%line
      end if
    else
      message = "a key or the closing / is expected, not '" // shown(token%text) // "'"
      line = token%line
    end if
    call refuse_line(group, line, message, error)
  end subroutine refuse_end

  !> Fails if the content is empty or contains control characters other than tabs and line ends.
  pure subroutine check_characters(content, file, error)
    character(len=*), intent(in) :: content, file
    type(error_type), allocatable, intent(out) :: error
    integer :: i, line, code

    if (len(content) == 0) call fatal_error(error, file // ": the file is empty", invalid_input)
    line = 1
    do i = 1, len(content)
      code = ichar(content(i:i))
      if (code >= 32 .and. code /= 127) cycle
      select case (code)
      case (9)
      case (10)
        line = line + 1
      case (13)
        if (i == len(content)) cycle
        if (content(i+1:i+1) == new_line("a")) cycle
        call fatal_error(error, location(file, line) // "a carriage return within a line", invalid_input)
        return
      case default
        call fatal_error(error, location(file, line) // "not a text file (character code " // text(code) &
          // "); save it as UTF-8 text", invalid_input)
        return
      end select
    end do
  end subroutine check_characters

end module gestell_input_namelist
