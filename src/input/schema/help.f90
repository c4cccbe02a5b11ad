!> Composes help texts for the terminal and tables for the manual from the records of the input keys.
module gestell_input_schema_help
  use gestell_base_error, only: error_type, fatal_error, wrong_usage
  use gestell_base_key, only: all_words, integer_key, key_type, real_key, text_key, unset
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, decimal => text
  use gestell_input_wording, only: lower, shown
  use gestell_input_namelist_suggest, only: listed, nearest_of
  use gestell_input_schema, only: find_group_rule, find_key_rule, option_group, schema_type, variant_type
  use gestell_input_schema_check, only: unknown_group
  use gestell_input_schema_rule, only: unknown_key
  use gestell_input_schema_units, only: unit_symbol, usual_units
  implicit none (type, external)
  private

  public :: entry, help_on

  character, parameter :: newline = new_line("a")
  !> Number of characters in a line of the terminal.
  integer, parameter :: terminal_width = 80
  !> Column of the terminal in which explanations begin.
  integer, parameter :: text_column = 18

contains

  !> Returns the help text for a topic. Fails if there is no such topic.
  subroutine help_on(schema, topic, text, error)
    !> All groups and keys of the input
    type(schema_type), intent(in) :: schema
    !> GROUP for help on a group; GROUP.KEY for a key; KEY for all keys of this name; "groups" for a list of all groups; "tables"
    !> for the manual's tables in Markdown
    character(len=*), intent(in) :: topic
    character(len=:), allocatable, intent(out) :: text
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: word, message
    integer :: dot, group, i

    word = lower(trim(adjustl(topic)))
    if (index(word, "&") == 1) word = word(2:)
    dot = scan(word // ".", "(.")
    group = find_group_rule(schema, word(:dot - 1))
    text = ""
    message = ""
    if (word == "groups") then
      text = "Groups of an input file. --help GROUP lists the keys of a group." // newline // newline
      do i = 1, size(schema%groups)
        text = text // entry("&" // trim(schema%groups(i)%name), trim(schema%groups(i)%meaning) // " (" &
          & // occurrence_words(schema, i) // ")")
      end do
    else if (word == "tables") then
      text = key_tables(schema)
    else if (dot <= len(word)) then
      dot = index(word, ".", back=.true.)
      if (group == 0) then
        call unknown_group(word(:min(dot, scan(word, "(.")) - 1), schema, message)
      else
        i = find_key_rule(schema, trim(schema%groups(group)%name), word(dot + 1:scan(word(dot:) // "(", "(") + dot - 2))
        if (i == 0) call unknown_key(word(dot + 1:), schema, trim(schema%groups(group)%name), message)
        if (i > 0) text = key_help(schema, i)
      end if
    else if (group > 0) then
      text = group_help(schema, group)
    else
      do i = 1, size(schema%keys)
        if (schema%keys(i)%name == word) text = text // key_help(schema, i)
      end do
      if (text == "") message = "no group or key has this name" // topic_hint(schema, word)
    end if
    if (message /= "") call fatal_error(error, "--help " // shown(topic) // ": " // message, wrong_usage)
  end subroutine help_on

  !> Hint that suggests a group or key similar to an unknown word.
  pure function topic_hint(schema, word) result(hint)
    type(schema_type), intent(in) :: schema
    character(len=*), intent(in) :: word
    character(len=:), allocatable :: hint
    character(len=16), allocatable :: names(:)
    integer :: i

    names = [character(len=16) :: "groups", schema%groups%name]
    i = nearest_of(word, names)
    if (i == 0) then
      names = schema%keys%name
      i = nearest_of(word, names)
      ! a name that occurs in two groups counts as a tie in nearest_of
      if (i == 0) i = findloc([(nearest_of(word, names(i:i)) == 1, i = 1, size(names))], .true., dim=1)
    end if
    if (i > 0) then
      hint = "; did you mean '" // trim(names(i)) // "'?"
    else
      hint = "; the groups are " // listed((schema%groups%name), "", "")
    end if
  end function topic_hint

  !> Phrase that states how often a group may occur in an input file.
  pure function occurrence_words(schema, group) result(words)
    type(schema_type), intent(in) :: schema
    integer, intent(in) :: group
    character(len=:), allocatable :: words

    words = "optional"
    if (schema%groups(group)%required) words = "required"
    if (schema%groups(group)%repeatable) words = "may repeat"
  end function occurrence_words

  !> Help text for a group: its meaning, its keys and its variants.
  pure function group_help(schema, group) result(text)
    type(schema_type), intent(in) :: schema
    integer, intent(in) :: group
    character(len=:), allocatable :: text
    integer :: i

    associate (rule => schema%groups(group))
      text = paragraph("&" // trim(rule%name) // ": " // trim(rule%meaning) // " (" // occurrence_words(schema, group) // ")", 0) &
        & // newline
      do i = 1, size(schema%keys)
        if (schema%keys(i)%group /= rule%name) cycle
        text = text // entry(trim(schema%keys(i)%name), trim(schema%keys(i)%meaning)) &
          & // paragraph(values_of(schema%keys(i)) // "; " // default_words(schema%keys(i), "default: ", "required"), text_column)
      end do
      do i = 1, size(schema%keys)
        if (schema%keys(i)%group == rule%name) text = text // described_words(schema, schema%keys(i), trim(schema%keys(i)%name) &
          & // "=")
      end do
    end associate
  end function group_help

  !> Entries that describe the words that a key accepts, one entry for each word. Empty if the schema does not describe these words.
  pure function described_words(schema, key, before) result(text)
    type(schema_type), intent(in) :: schema
    type(key_type), intent(in) :: key
    !> Text that precedes every word
    character(len=*), intent(in) :: before
    character(len=:), allocatable :: text
    integer :: i

    text = ""
    do i = 1, size(schema%variants)
      associate (variant => schema%variants(i))
        if (variant%group /= key%group .or. variant%key /= key%name) cycle
        if (text == "" .or. variant%keys /= "") text = text // newline
        text = text // entry(before // "'" // trim(variant%name) // "'", trim(variant%meaning))
        if (variant%keys /= "") text = text // paragraph("keys: " // trim(variant%keys), text_column)
      end associate
    end do
  end function described_words

  !> Help text for a key: its meaning, values and default, whether sweeps can vary it, and the meanings of the words it accepts.
  pure function key_help(schema, i) result(text)
    type(schema_type), intent(in) :: schema
    integer, intent(in) :: i
    character(len=:), allocatable :: text

    associate (key => schema%keys(i))
      text = paragraph(trim(key%group) // "." // trim(key%name) // ": " // trim(key%meaning), 0) &
        & // entry("values", values_of(key)) // entry("default", default_words(key, "", "none: the key is required"))
      if (schema%groups(find_group_rule(schema, key%group))%subject == option_group) then
        text = text // entry("sweep", "no: &sweep can vary only numbers that describe the machine")
      else if (key%kind /= real_key) then
        text = text // entry("sweep", "no: &sweep can vary only real numbers")
      else
        text = text // entry("sweep", "yes: &sweep, &sensitivity and &design can vary this key")
      end if
      text = text // described_words(schema, key, "")
    end associate
  end function key_help

  !> Lines that consist of a name and its explanation, which begins in the terminal column with number `column`.
  pure function entry(name, words, column) result(text)
    character(len=*), intent(in) :: name, words
    integer, intent(in), optional :: column
    character(len=:), allocatable :: text
    integer :: indent

    indent = text_column
    if (present(column)) indent = column
    text = paragraph(words, indent)
    if (len_trim(name) <= indent - 3) then
      text(3:2 + len_trim(name)) = name
    else
      text = "  " // name // newline // text
    end if
  end function entry

  !> Lines of a text that is broken to fit the terminal and indented by `indent` columns. Markdown marks are removed.
  pure function paragraph(words, indent) result(text)
    character(len=*), intent(in) :: words
    integer, intent(in) :: indent
    character(len=:), allocatable :: text, word
    integer :: first, last, column, i

    text = repeat(" ", indent)
    column = indent
    first = 1
    do while (first <= len_trim(words))
      last = first + index(words(first:) // " ", " ") - 2
      word = ""
      do i = first, last
        if (words(i:i) /= "`") word = word // words(i:i)
      end do
      if (column > indent .and. column + 1 + len(word) > terminal_width) then
        text = text // newline // repeat(" ", indent)
        column = indent
      else if (column > indent) then
        text = text // " "
        column = column + 1
      end if
      text = text // word
      column = column + len(word)
      first = last + 2
    end do
    text = text // newline
  end function paragraph

  !> Phrase in Markdown that describes the values of a key.
  pure function values_of(key) result(words)
    type(key_type), intent(in) :: key
    character(len=:), allocatable :: words
    character(len=:), allocatable :: unit, noun
    integer :: n

    noun = "number"
    if (key%kind == integer_key) noun = "whole number"
    if (key%kind == text_key) noun = "text"
    if (key%words /= "") then
      words = "one of " // quoted(key%words)
      if (key%most > 1) words = "one or more of " // quoted(key%words)
      return
    end if
    if (key%rank == 2) then
      words = decimal(key%rows) // " x " // decimal(key%most / key%rows) // " " // noun // "s"
      n = nint(sqrt(real(key%shorter, dp)))
      if (n > 0) words = decimal(n) // " x " // decimal(n) // " or " // words
    else if (key%shorter > 0) then
      words = decimal(key%shorter) // " or " // decimal(key%most) // " " // noun // "s"
    else if (key%most == 1) then
      words = noun
    else if (key%least == key%most) then
      words = decimal(key%most) // " " // noun // "s"
    else
      words = decimal(key%least) // trim(merge(" or", " to", key%most == key%least + 1)) // " " // decimal(key%most) // " " &
        & // noun // "s"
    end if
    unit = trim(unit_symbol(key, 0, usual_units, as_list=.true.))
    if (unit /= "") words = words // ", " // unit
    words = words // range_of(key)
  end function values_of

  !> Phrase that describes the permitted range of a key's values.
  pure function range_of(key) result(words)
    type(key_type), intent(in) :: key
    character(len=:), allocatable :: words

    words = ""
    associate (range => key%range)
      if (range%least > unset .and. range%most < huge(range%most)) then
        words = ", " // concise(range%least) // " to " // concise(range%most, 9)
      else if (range%above_zero) then
        words = ", positive"
      else if (range%unit_size) then
        words = ", 1 or -1"
      else if (range%not_zero) then
        words = ", not zero"
      else if (range%least > unset .and. abs(range%least) <= 0) then
        words = ", not negative"
      else if (range%least > unset) then
        words = ", at least " // concise(range%least)
      end if
    end associate
  end function range_of

  !> The default of a key after the words `before`, or the words `required` if the key has no default.
  pure function default_words(key, before, required) result(words)
    type(key_type), intent(in) :: key
    character(len=*), intent(in) :: before, required
    character(len=:), allocatable :: words

    words = before // default_of(key)
    if (default_of(key) == "") words = required
  end function default_words

  !> Default of a key in Markdown; empty if the key has no default.
  pure function default_of(key) result(words)
    type(key_type), intent(in) :: key
    character(len=:), allocatable :: words
    integer :: n

    words = trim(key%otherwise)
    if (words /= "") return
    if (key%word /= "") then
      words = quoted(key%word)
    else if (key%default > unset) then
      words = concise(key%default)
      n = merge(key%shorter, key%most, key%shorter > 0)
      if (key%rank == 1 .and. key%least == key%most) words = words // repeat(", " // words, n - 1)
      if (key%rank == 2) words = decimal(n) // "*" // words
      words = "`" // words // "`"
    end if
  end function default_of

  !> Copy of a list, separated by commas, with quotes around each word.
  pure function quoted(list) result(words)
    character(len=*), intent(in) :: list
    character(len=:), allocatable :: words

    words = listed(all_words(list), "`'", "'`")
  end function quoted

  !> Markdown tables of the keys of all groups. If the schema describes the words of a key, a table of these words follows.
  pure function key_tables(schema) result(text)
    type(schema_type), intent(in) :: schema
    character(len=:), allocatable :: text
    integer :: g, i

    text = ""
    do g = 1, size(schema%groups)
      text = text // "### `&" // trim(schema%groups(g)%name) // "`" // newline // newline &
        & // "| key | values | default | meaning |" // newline // "|---|---|---|---|" // newline
      do i = 1, size(schema%keys)
        associate (key => schema%keys(i))
          if (key%group == schema%groups(g)%name) text = text // "| `" // trim(key%name) // "` | " // values_of(key) // " | " &
            & // default_of(key) // " | " // trim(key%meaning) // " |" // newline
        end associate
      end do
      text = text // newline
      do i = 1, size(schema%keys)
        if (schema%keys(i)%group == schema%groups(g)%name) text = text // word_table(schema, schema%keys(i))
      end do
    end do
  end function key_tables

  !> Markdown table of the words that a key accepts; empty if the schema does not describe them. If any of these words has keys of
  !> its own, the table has a column for them.
  pure function word_table(schema, key) result(text)
    type(schema_type), intent(in) :: schema
    type(key_type), intent(in) :: key
    character(len=:), allocatable :: text
    type(variant_type), allocatable :: variants(:)
    integer :: i

    text = ""
    variants = pack(schema%variants, schema%variants%group == key%group .and. schema%variants%key == key%name)
    if (size(variants) == 0) return
    if (any(variants%keys /= "")) then
      text = "| `" // trim(key%name) // "` | keys | meaning |" // newline // "|---|---|---|" // newline
    else
      text = "| `" // trim(key%name) // "` | meaning |" // newline // "|---|---|" // newline
    end if
    do i = 1, size(variants)
      text = text // "| `'" // trim(variants(i)%name) // "'` | "
      if (any(variants%keys /= "")) text = text // trim(variants(i)%keys) // " | "
      text = text // trim(variants(i)%meaning) // " |" // newline
    end do
    text = text // newline
  end function word_table

end module gestell_input_schema_help
