!> Summary at the top of a page: verdict, warnings, natural frequencies with damping, the probe that vibrates most, and the peak
!> force on the ground.
module gestell_task_registry_summary
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline
  use gestell_base_verdict, only: not_judged, operator(/=)
  use gestell_base_markup, only: escaped
  use gestell_output_page_html, only: cell, row, scroll_start, section_start
  use gestell_output_result, only: headline_type, result_type
  use gestell_output_table, only: table_type
  use gestell_output_table_result_units, only: conversion_type
  use gestell_task_common_context, only: context_type
  use gestell_task_forces_reactions, only: components_of, component_names, find_reactions, force_magnitude, reaction_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  implicit none (type, external)
  private

  public :: summary

  !> Number of significant digits in the summary
  integer, parameter :: digits = 4

contains

  !> HTML section with those answers that the run has computed.
  function summary(context, result) result(words)
    type(context_type), intent(in) :: context
    type(result_type), intent(in) :: result
    character(len=:), allocatable :: words, cards
    integer :: i

    words = section_start("summary", "Summary")
    if (size(result%headlines) > 0) words = words // verdict_line(result)
    if (size(result%headlines) > 1) then
      words = words // "<ul class=""warnings"" aria-label=""Warnings and further results"">" // newline
      do i = 2, size(result%headlines)
        words = words // "<li class=""" // state_of(result%headlines(i)) // """>" // escaped(result%headlines(i)%words) // "</li>" &
          & // newline
      end do
      words = words // "</ul>" // newline
    end if
    cards = ""
    do i = 1, size(result%tables)
      if (result%tables(i)%name == "frequencies") cards = cards // frequency_card(result%tables(i))
    end do
    cards = cards // force_card(context)
    if (.not. allocated(context%configuration%impossible)) words = words // "<dl><div><dt>crank speed</dt><dd>" &
      & // concise(abs(context%configuration%frame%drive_rpm()), 6) // " rpm</dd></div>" // worst_probe(result%tables) &
      & // "</dl>" // newline
    if (cards /= "") words = words // "<div class=""cards"">" // cards // "</div>" // newline
    words = words // "</section>" // newline
  end function summary

  !> HTML of the first headline. If it states the verdict on the machine of the input, the verdict is set in bold.
  pure function verdict_line(result) result(line)
    type(result_type), intent(in) :: result
    character(len=:), allocatable :: line, words, state

    words = result%headlines(1)%words
    state = state_of(result%headlines(1))
    line = escaped(words)
    if (result%verdict /= not_judged) line = "<strong>" // state // "</strong>" // escaped(words(len(state) + 1:))
    line = "<p class=""verdict " // state // """>" // line // "</p>" // newline
  end function verdict_line

  !> Verdict that a headline states; "note" if it states none.
  pure function state_of(headline) result(state)
    type(headline_type), intent(in) :: headline
    character(len=:), allocatable :: state

    state = trim(headline%state%word())
    if (state == "") state = "note"
  end function state_of

  !> HTML table of the natural frequencies with damping ratios. If one of them needs a remark, such as a resonance, the table has a
  !> column for remarks.
  pure function frequency_card(table) result(words)
    type(table_type), intent(in) :: table
    character(len=:), allocatable :: words, note
    integer :: i

    words = card_start("Natural frequencies of the frame", "<th scope=""col"" class=""n"">frequency (Hz)</th>" &
      & // "<th scope=""col"" class=""n"">damping ratio</th>" // either("<th scope=""col"">remark</th>", "", &
      & table%columns(table%number_of("remark"))%words /= ""))
    associate (hertz => table%columns(table%number_of("frequency"))%numbers, &
      & ratio => table%columns(table%number_of("damping_ratio"))%numbers, &
      & order => table%columns(table%number_of("order"))%numbers, remark => table%columns(table%number_of("remark")))
      do i = 1, table%rows
        note = remark%word(i)
        if (note == "near") note = "near order " // number(order(i))
        if (remark%words /= "") note = cell("td", note)
        words = words // row(cell("n", number(hertz(i))) // cell("n", number(100 * ratio(i), " %")) // note)
      end do
    end associate
    words = words // "</tbody></table></div></div>" // newline
  end function frequency_card

  !> HTML of the probe whose rms velocity is largest relative to its limit or, if no probe has a limit, largest.
  pure function worst_probe(tables) result(words)
    type(table_type), intent(in) :: tables(:)
    character(len=:), allocatable :: words, unit
    integer :: i, k

    words = ""
    do i = 1, size(tables)
      if (tables(i)%name /= "probes" .or. tables(i)%rows == 0) cycle
      associate (velocity => tables(i)%columns(tables(i)%number_of("v_rms_band"))%numbers, &
        & limit => tables(i)%columns(tables(i)%number_of("limit"))%numbers, name => tables(i)%columns(tables(i)%number_of("name")))
        if (all(ieee_is_nan(limit))) then
          k = maxloc(velocity, 1)
        else
          k = maxloc(velocity / limit, 1, mask=.not. ieee_is_nan(limit))
        end if
        unit = trim(tables(i)%columns(tables(i)%number_of("limit"))%unit%words)
        words = "<div><dt>" // either("probe with the strongest vibration", "probe closest to its limit", all(ieee_is_nan(limit))) &
          & // "</dt><dd>" // escaped(name%word(k)) // ": " // concise(velocity(k), digits) // " " // unit // " rms" &
          & // either("", ", limit " // concise(limit(k), digits) // " " // unit, ieee_is_nan(limit(k))) // "</dd></div>"
      end associate
    end do
  end function worst_probe

  !> HTML table of the total force and moment on the ground; empty if no vibration was computed.
  function force_card(context) result(words)
    type(context_type), intent(in) :: context
    character(len=:), allocatable :: words, unit
    type(conversion_type) :: conversion
    type(reaction_type), allocatable :: reactions(:)
    type(error_type), allocatable :: unknown
    integer, allocatable :: parts(:)
    integer :: i

    words = ""
    if (.not. allocated(context%analysis%vibration)) return
    call find_reactions(context%analysis%frame, context%analysis%vibration, reactions, unknown)
    if (allocated(unknown)) return
    words = card_start("Force on the ground due to the motion", "<th scope=""col"">component</th>" &
      & // "<th scope=""col"" class=""n"">peak</th><th scope=""col"" class=""n"">rms</th><th scope=""col"">unit</th>")
    associate (total => reactions(size(reactions)))
      parts = components_of(total)
      do i = 1, size(parts)
        unit = either("N", "N m", component_names(parts(i)) < "m")
        conversion = context%configuration%result_units%conversion(unit)
        if (conversion%words /= "") unit = trim(conversion%words)
        associate (statistics => total%statistics(parts(i)))
          words = words // row(cell("row", name_of(parts(i))) // cell("n", number(conversion%converted(statistics%peak))) &
            & // cell("n", number(conversion%converted(statistics%rms))) // cell("td", unit))
        end associate
      end do
    end associate
    words = words // "</tbody></table></div></div>" // newline

  contains

    !> Name of a component: "x", or "moment about x".
    pure function name_of(part) result(name)
      integer, intent(in) :: part
      character(len=:), allocatable :: name
      character(len=2) :: symbol

      symbol = component_names(part)
      name = either("", "moment about ", symbol < "m") // either("z", symbol(2:2), symbol == "m")
      if (part == force_magnitude) name = "magnitude"
      if (symbol == "m" .and. size(reactions(1)%position) == 2) name = "moment"
    end function name_of

  end function force_card

  !> Beginning of a small table with a heading; "</tbody></table></div></div>" ends it.
  pure function card_start(heading, columns) result(words)
    !> `columns`: HTML of the cells of the heading row
    character(len=*), intent(in) :: heading, columns
    character(len=:), allocatable :: words

    words = "<div><h3>" // heading // "</h3>" // scroll_start(heading) // "<table><thead>" // row(columns) // "</thead><tbody>" &
      & // newline
  end function card_start

  !> Text of a number with its unit; a dash if there is no number.
  pure function number(value, unit) result(words)
    real(dp), intent(in) :: value
    character(len=*), intent(in), optional :: unit
    character(len=:), allocatable :: words

    words = "–"
    if (ieee_is_nan(value)) return
    words = concise(value, digits)
    if (present(unit)) words = words // unit
  end function number

end module gestell_task_registry_summary
