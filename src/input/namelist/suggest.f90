!> Suggests correct words for a misspelt word.
module gestell_input_namelist_suggest
  use gestell_input_wording, only: lower
  implicit none (type, external)
  private

  public :: advice, suggestion, nearest_of, listed

  !> Maximum length of a word for which corrections are suggested.
  integer, parameter :: longest_word = 64

contains

  !> Hint for a message: "; did you mean 'x'?", or "; choose from 'a', 'b'" if no candidate is similar to the word. Empty if there
  !> are no candidates.
  pure function suggestion(word, candidates) result(text)
    character(len=*), intent(in) :: word, candidates(:)
    character(len=:), allocatable :: text

    text = ""
    if (size(candidates) > 0) text = "; " // advice(word, candidates, "'", "'", "choose from " // listed(candidates, "'", "'"))
  end function suggestion

  !> Question "did you mean x?" with the candidate x that is most similar to the word, between the texts `before` and `after`. If
  !> no candidate is similar, the text `otherwise`.
  pure function advice(word, candidates, before, after, otherwise) result(text)
    character(len=*), intent(in) :: word, candidates(:), before, after, otherwise
    character(len=:), allocatable :: text
    integer :: i

    text = otherwise
    i = nearest_of(word, candidates)
    if (i > 0) text = "did you mean " // before // trim(candidates(i)) // after // "?"
  end function advice

  !> List of up to 30 candidates in one line, each between the texts `before` and `after`.
  pure function listed(candidates, before, after) result(text)
    character(len=*), intent(in) :: candidates(:), before, after
    character(len=:), allocatable :: text
    integer :: i

    text = ""
    do i = 1, min(30, size(candidates))
      if (i > 1) text = text // ", "
      text = text // before // trim(candidates(i)) // after
    end do
    if (size(candidates) > 30) text = text // ", ..."
  end function listed

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
