!> Writes the report on border curves in the plane of two parameters.
module gestell_task_boundary_map_report
  use gestell_base_verdict, only: stable, state_word
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_input_wording, only: counted
  use gestell_task_boundary_map, only: border_map_type, border_vertex_type
  use gestell_task_boundary_map_vertex, only: finest_lines
  implicit none (type, external)
  private

  public :: curve_lines, unsearched_lines, words

  !> Maximum number of curves, of values, and of open places (parts of the range in which a border cannot be excluded) that the
  !> report lists.
  integer, parameter, public :: max_listed = 40
  character(len=*), parameter, public :: more_listed = "  ... all in boundary.csv" // newline

contains

  !> Lines of the report on the curves, and on the parts of lines in which a border cannot be excluded.
  pure function curve_lines(map, paths) result(report)
    type(border_map_type), intent(in) :: map
    character(len=*), intent(in) :: paths(:)
    character(len=:), allocatable :: report
    integer :: c, first, last, i

    report = "  " // counted(map%curves, "curve") // ", " // text(size(map%vertices)) // " vertices; (" &
      & // trim(paths(1)) // ", " // trim(paths(2)) // ")" // newline
    do c = 1, min(map%curves, max_listed)
      first = findloc(map%vertices%curve, c, dim=1)
      last = findloc(map%vertices%curve, c, dim=1, back=.true.)
      report = report // "  curve " // text(c) // " from " // place(map%vertices(first)%parameters)
      if (all(abs(map%vertices(first)%parameters - map%vertices(last)%parameters) <= 0)) then
        report = report // ", closed"
      else
        report = report // " to " // place(map%vertices(last)%parameters)
      end if
      report = report // kinds_of(map%vertices(first:last)) // newline
    end do
    if (map%curves > max_listed) report = report // more_listed
    if (map%rough > 0) report = report // "  note: " // counted(map%rough, "segment") // " of the curves " &
      & // "could not be refined to the tolerance, as happens at the tip of an unstable region (tongue)" // newline
    report = report // unsearched_lines(map%thin, 2 * finest_lines, map%left_out)
    do i = 1, min(size(map%places), max_listed)
      associate (along => maxloc(map%places(i)%width, dim=1))
        report = report // "  open: there may be a boundary near " // place(map%places(i)%parameters) // ", in a range of " &
          & // "width " // concise(map%places(i)%width(along), 2) // " along " // trim(paths(along)) // newline
      end associate
    end do
    if (size(map%places) > max_listed) report = report // more_listed
  end function curve_lines

  !> Notes on meetings of multipliers. `thin`: number of meetings whose tongues are narrower than `width` (relative to the range).
  !> `left_out`: number of meetings that were not searched.
  pure function unsearched_lines(thin, width, left_out) result(report)
    integer, intent(in) :: thin, left_out
    real(dp), intent(in) :: width
    character(len=:), allocatable :: report

    report = ""
    if (thin > 0) report = "  note: without damping, pairs of multipliers would coincide at " // counted(thin, "more place") &
      & // "; an unstable region (tongue) at such a place is narrower than " // concise(width, 2) // " of the range" // newline
    if (left_out > 0) report = report // "  note: multipliers meet in so many places that " // counted(left_out, "place") // &
      & " were not searched; these places lie in the ranges that are marked 'open' below. Search these ranges separately" // newline
  end function unsearched_lines

  !> List such as ": divergence, flutter". It contains each kind of border once, in the order along the curve. If the machine is
  !> not stable at a border, its state follows the kind.
  pure function kinds_of(curve) result(list)
    type(border_vertex_type), intent(in) :: curve(:)
    character(len=:), allocatable :: list, kind
    integer :: i

    list = ""
    do i = 1, size(curve)
      kind = words(curve(i)%kind)
      if (curve(i)%state /= "" .and. curve(i)%state /= state_word(stable)) kind = kind // " with " // trim(curve(i)%state) &
        & // " vibration"
      if (index(list // ",", " " // kind // ",") == 0) list = list // ", " // kind
    end do
    list(1:1) = ":"
  end function kinds_of

  pure function place(parameters)
    real(dp), intent(in) :: parameters(2)
    character(len=:), allocatable :: place

    place = "(" // concise(parameters(1), 6) // ", " // concise(parameters(2), 6) // ")"
  end function place

  !> Name of the kind of border, with blanks instead of underscores.
  pure function words(kind)
    character(len=*), intent(in) :: kind
    character(len=:), allocatable :: words
    integer :: k

    words = trim(kind)
    k = index(words, "_")
    if (k > 0) words(k:k) = " "
  end function words

end module gestell_task_boundary_map_report
