!> Suggests correct words for a misspelt word.
module gestell_input_namelist_suggest
  use gestell_base_text, only: either
  use gestell_input_wording, only: lower
  implicit none (type, external)
  private

  public :: advice, suggestion, nearest_of, listed

  character, parameter :: quote = "'"
  !> Maximum length of a word for which corrections are suggested.
  integer, parameter :: longest_word = 64
  !> Maximum number of candidates in a list.
  integer, parameter :: most_listed = 40

contains

  !> Length of a list of candidates in one line, with `around` characters around each.
  pure integer function length_of_list(candidates, around) result(length)
    character(len=*), intent(in) :: candidates(:)
    integer, intent(in) :: around
    integer :: n

    n = min(most_listed, size(candidates))
    length = sum(len_trim(candidates(:n))) + n * around + 2 * max(0, n - 1)
    if (size(candidates) > most_listed) length = length + 5
  end function length_of_list

  !> List of up to `most_listed` candidates in one line, each between the texts `before` and `after`.
  pure function listed(candidates, before, after) result(text)
    character(len=*), intent(in) :: candidates(:), before, after
    character(len=length_of_list(candidates, len(before) + len(after))) :: text
    integer :: i, n

    n = 0
    do i = 1, min(most_listed, size(candidates))
      text(n + 1:) = before // trim(candidates(i)) // after // ", "
      n = n + len(before) + len_trim(candidates(i)) + len(after) + 2
    end do
    if (size(candidates) > most_listed) text(n + 1:) = "..."
  end function listed

  !> The candidate that is most similar to a misspelt word; blank if there is none (see `nearest_of`).
  pure function most_similar(word, candidates) result(candidate)
    character(len=*), intent(in) :: word, candidates(:)
    character(len=len(candidates)) :: candidate
    integer :: i

    candidate = ""
    i = nearest_of(word, candidates)
    if (i > 0) candidate = candidates(i)
  end function most_similar

  !> Question whether the user meant this candidate.
  pure function question(candidate, before, after) result(text)
    character(len=*), intent(in) :: candidate, before, after
    character(len=14 + len(before) + len_trim(candidate) + len(after)) :: text

    text = "did you mean " // before // trim(candidate) // after // "?"
  end function question

  !> Question "did you mean x?" with the candidate x that is most similar to the word, between the texts `before` and `after`. If
  !> no candidate is similar, the text `otherwise`.
  pure function advice(word, candidates, before, after, otherwise) result(text)
    character(len=*), intent(in) :: word, candidates(:), before, after, otherwise
    character(len=merge(len(question(most_similar(word, candidates), before, after)), len(otherwise), &
      & len_trim(most_similar(word, candidates)) > 0)) :: text

    text = either(question(most_similar(word, candidates), before, after), otherwise, len_trim(most_similar(word, candidates)) > 0)
  end function advice

  !> Phrase that offers the candidates for choice; empty if there are none.
  pure function choice(candidates) result(text)
    character(len=*), intent(in) :: candidates(:)
    character(len=merge(12, 0, size(candidates) > 0) + len(listed(candidates, quote, quote))) :: text

    text = "choose from " // listed(candidates, quote, quote)
  end function choice

  !> Hint for a message: "; did you mean 'x'?", or "; choose from 'a', 'b'" if no candidate is similar to the word. Empty if there
  !> are no candidates.
  pure function suggestion(word, candidates) result(text)
    character(len=*), intent(in) :: word, candidates(:)
    character(len=merge(2, 0, size(candidates) > 0) + len(advice(word, candidates, quote, quote, choice(candidates)))) :: text

    text = "; " // advice(word, candidates, quote, quote, choice(candidates))
  end function suggestion

  !> Index of the candidate that is most similar to a misspelt word. 0 if no candidate is similar or several are equally similar.
  pure integer function nearest_of(word, candidates) result(best)
    character(len=*), intent(in) :: word, candidates(:)
    integer :: i, d, smallest, longest

    best = 0
    smallest = longest_word
    if (len_trim(word) > longest_word) return
    do i = 1, size(candidates)
      longest = max(len_trim(word), len_trim(candidates(i)))
      if (longest > longest_word) cycle
      d = distance(trim(lower(word)), trim(lower(candidates(i))))
      if (d > smallest .or. d >= longest .or. d > max(1, longest / 3)) cycle
      best = merge(i, 0, d < smallest)
      smallest = d
    end do
  end function nearest_of

  !> Damerau-Levenshtein distance of two words: the minimum number of insertions, deletions, substitutions and swaps of neighbouring
  !> letters that convert `a` to `b`.
  pure integer function distance(a, b)
    character(len=*), intent(in) :: a, b
    ! d(i, j): distance of the first i and j letters; row and column -1 are never the minimum
    integer :: d(-1:len(a), -1:len(b))
    integer :: i, j, change, swap

    d = len(a) + len(b)
    d(0:, 0) = [(i, i = 0, len(a))]
    d(0, 0:) = [(j, j = 0, len(b))]
    do j = 1, len(b)
      do i = 1, len(a)
        change = merge(0, 1, a(i:i) == b(j:j))
        swap = 1
        if (i > 1 .and. j > 1) then
          if (a(i-1:i) /= b(j:j) // b(j-1:j-1)) swap = len(a) + len(b)
        end if
        d(i, j) = min(d(i-1, j) + 1, d(i, j-1) + 1, d(i-1, j-1) + change, d(i-2, j-2) + swap)
      end do
    end do
    distance = d(len(a), len(b))
  end function distance

end module gestell_input_namelist_suggest
