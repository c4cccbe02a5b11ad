!> Writes all results of a run as one JSON object (RFC 8259), which doc/output.md describes.
module gestell_output_json
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_text, only: either, newline, text
  use gestell_base_version, only: version
  use gestell_base_words, only: printable
  use gestell_output_file_output, only: output_type
  use gestell_output_head, only: head_type
  use gestell_output_result, only: result_type
  use gestell_output_table, only: column_type, nothing, table_type
  use gestell_output_table_scientific, only: number_width, put_number
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  implicit none (type, external)
  private

  public :: append_json, json_string

contains

  !> Appends the JSON object and a newline to `output`. `machine`: JSON object that describes the machine. `failure`: explanation
  !> why results are missing; empty if no result is missing.
  subroutine append_json(result, head, machine, failure, output)
    !> All results of the run
    type(result_type), intent(in) :: result
    !> Data about the origin of the results, such as input file and model
    type(head_type), intent(in) :: head
    character(len=*), intent(in) :: machine, failure
    type(output_type), intent(inout) :: output
    integer :: i

    call output%append("{" // newline // member("gestell", json_string(version)) // member("title", json_string(trim(head%title))) &
      & // member("input", json_string(head%input)) // member("model", json_string(head%model)) // member("speed_held_by", &
      & json_string(head%held_by)))
    call output%append("""settings"": [")
    do i = 1, size(head%settings)
      call output%append(either(", ", "", i > 1) // json_string(trim(head%settings(i)%text)))
    end do
    call output%append("]," // newline // member("verdict", or_null(trim(result%worst%word()))) // """headlines"": [")
    do i = 1, size(result%headlines)
      associate (headline => result%headlines(i))
        call output%append(either(", ", "", i > 1) // "{""state"": " // json_string(trim(headline%state%word())) &
          & // ", ""words"": " // json_string(headline%words) // "}")
      end associate
    end do
    call output%append("]," // newline // member("diagnostics", json_string(result%details)) &
      & // member("failure", or_null(failure)) // member("machine", machine) // """tables"": {")
    do i = 1, size(result%tables)
      call output%append(either(", ", "", i > 1) // newline)
      call append_table(result%tables(i), output)
    end do
    call output%append("}" // newline // "}" // newline)
  end subroutine append_json

  !> Appends a table to the JSON object, as one of its members.
  subroutine append_table(table, output)
    type(table_type), intent(in) :: table
    type(output_type), intent(inout) :: output
    integer :: i, k

    call output%append(json_string(table%name) // ": {""heading"": " // json_string(table%heading) // ", ""model"": " &
      & // or_null(table%model) // ", ""verdict"": " // or_null(table%verdict%sentence()) // ", ""remarks"": " &
      & // json_string(table%remarks) // "," // newline // " ""columns"": [")
    do k = 1, size(table%columns)
      associate (column => table%columns(k))
        call output%append(either(", ", "", k > 1) // newline // "  {""key"": " // json_string(column%key) // ", ""label"": " &
          & // json_string(column%label) // ", ""unit"": " // or_null(trim(column%unit%words)) // ", ""meaning"": " &
          & // json_string(column%meaning) // ", ""error"": " // or_null(column%error) // "}")
      end associate
    end do
    call output%append("]," // newline // " ""rows"": [")
    do i = 1, table%rows
      call output%append(either(", ", "", i > 1) // newline // "  [")
      do k = 1, size(table%columns)
        call output%append(either(", ", "", k > 1) // value(table%columns(k), i))
      end do
      call output%append("]")
    end do
    call output%append("]}")
  end subroutine append_table

  !> Value of a column in row `i` in JSON. NaN becomes null, and infinity becomes a string.
  function value(column, i) result(words)
    type(column_type), intent(in) :: column
    integer, intent(in) :: i
    character(len=:), allocatable :: words
    integer :: n

    if (allocated(column%words)) then
      words = json_string(column%word(i))
    else if (allocated(column%integers)) then
      words = "null"
      if (column%integers(i) /= nothing) words = text(column%integers(i))
    else if (ieee_is_finite(column%numbers(i))) then
      words = repeat(" ", number_width)
      n = 0
      call put_number(words, n, column%numbers(i))
      words = words(:n)
    else if (ieee_is_nan(column%numbers(i))) then
      words = "null"
    else
      words = json_string(either("Infinity", "-Infinity", column%numbers(i) > 0))
    end if
  end function value

  !> A member "name": value of a JSON object, followed by a comma.
  pure function member(name, value) result(words)
    character(len=*), intent(in) :: name, value
    character(len=:), allocatable :: words

    words = """" // name // """: " // value // "," // newline
  end function member

  !> A JSON string with these words; null if they are blank.
  pure function or_null(words) result(word)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: word

    word = "null"
    if (words /= "") word = json_string(words)
  end function or_null

  !> A JSON string, in quotes, with these words. Bytes that are no valid text are replaced by "?".
  pure function json_string(words) result(quoted)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: quoted, safe
    type(growing_text_type) :: pieces
    integer :: i

    safe = printable(words)
    call pieces%append("""")
    do i = 1, len(safe)
      if (safe(i:i) == newline) then
        call pieces%append("\n")
      else
        if (scan(safe(i:i), """\") > 0) call pieces%append("\")
        call pieces%append(safe(i:i))
      end if
    end do
    call pieces%append("""")
    quoted = pieces%whole()
  end function json_string

end module gestell_output_json
