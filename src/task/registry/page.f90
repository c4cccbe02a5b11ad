!> Writes report.html, a self-contained page with the input, the verdict, the tables and the pictures of a run.
module gestell_task_registry_page
  use gestell_base_base64, only: base64
  use gestell_base_error, only: error_type
  use gestell_base_text, only: concise, newline, text
  use gestell_base_version, only: version
  use gestell_base_words, only: on_one_line, printable
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_forces_reactions, only: along_x, along_y, along_z, find_reactions, reaction_type, force_magnitude
  use gestell_task_drawing_frequencies, only: frequency_list
  use gestell_task_machine_report, only: report_machine
  use gestell_output_head, only: setting_type
  use gestell_output_result, only: result_type
  use gestell_output_table, only: table_type
  use gestell_input_namelist_document, only: group_type, name_of
  use gestell_base_files, only: read_file
  use gestell_base_verdict, only: not_judged, operator(/=)
  use gestell_output_page_html, only: cell, escaped, head, row, tail
  use gestell_output_page_table, only: html_table
  use gestell_input_schema, only: find_key_rule, schema_type
  use gestell_input_schema_units, only: unit_symbol
  use gestell_input_namelist_message, only: typed
  use gestell_output_file_output, only: open_output, output_type
  implicit none (type, external)
  private

  public :: write_page

contains

  !> Writes report.html with the results and the pictures. The page shows the name of the input file without its folder. Fails if
  !> the file cannot be written.
  subroutine write_page(context, result, error)
    type(context_type), intent(in) :: context
    type(result_type), intent(in) :: result
    type(error_type), allocatable, intent(out) :: error
    type(output_type) :: page
    character(len=:), allocatable :: title, input, state, words, line
    integer :: i

    input = on_one_line(context%head%input(index(context%head%input, "/", back=.true.) + 1:))
    title = context%head%title
    if (len_trim(title) == 0) title = input
    call open_output(page, context%staging // "/report.html")
    call page%append(head(title) // "<h1>" // escaped(title) // "</h1>" // newline // "<p class=""sub"">Gestell " // version &
      & // ", input " // escaped(input) // "</p>" // newline)
    do i = 1, size(result%headlines)
      state = trim(result%headlines(i)%state%word())
      words = result%headlines(i)%words
      line = escaped(words)
      ! The first headline begins with the verdict on the machine of the input, which is set in bold.
      if (i == 1 .and. result%verdict /= not_judged) line = "<strong>" // state // "</strong>" // escaped(words(len(state) + 1:))
      if (state == "") state = "note"
      call page%append("<p class=""verdict " // state // """>" // line // "</p>" // newline)
    end do
    if (.not. allocated(context%configuration%impossible)) call page%append(key_figures(context))
    do i = 1, size(result%tables)
      call page%append(section(context%staging, result%tables(i)))
    end do
    call page%append(input_table(context%configuration, context%head%settings))
    call page%append("<h2>Report</h2>" // newline // folded("as printed on standard output", &
      & printable(report_machine(context%configuration, input) // result%report) // newline // result%summary_line()))
    if (result%details /= "") call page%append(folded("accuracy of the numerical solution", result%details))
    call page%append(tail)
    call page%complete(error)
  end subroutine write_page

  !> HTML for lines of a report that are hidden until the reader opens them.
  pure function folded(summary, lines) result(words)
    character(len=*), intent(in) :: summary, lines
    character(len=:), allocatable :: words

    words = "<details><summary>" // summary // "</summary>" // newline // "<pre>" // escaped(lines) // "</pre></details>" // newline
  end function folded

  !> HTML with those key figures that are available: the crank speed, the natural frequencies, and the peak force on the ground.
  function key_figures(context) result(words)
    type(context_type), intent(in) :: context
    character(len=:), allocatable :: words
    type(reaction_type), allocatable :: reactions(:)
    type(error_type), allocatable :: unknown

    associate (frame => context%configuration%frame)
      words = "<dl>" // figure("speed of the crank", concise(abs(frame%drive_rpm()), 6) // " 1/min")
      if (frequency_list(frame) /= "") words = words // figure("natural frequencies", frequency_list(frame))
    end associate
    if (allocated(context%analysis%vibration)) then
      call find_reactions(context%analysis%frame, context%analysis%vibration, reactions, unknown)
      if (.not. allocated(unknown)) words = words // figure("peak force on the ground", force_peaks(reactions(size(reactions))))
    end if
    words = words // "</dl>" // newline

  contains

    !> HTML for one key figure: its name and its value.
    pure function figure(name, value) result(item)
      character(len=*), intent(in) :: name, value
      character(len=:), allocatable :: item

      item = "<div><dt>" // name // "</dt><dd>" // trim(adjustl(value)) // "</dd></div>"
    end function figure

  end function key_figures

  !> Text with the peak forces along the axes, and the peak of the force's magnitude.
  pure function force_peaks(total) result(words)
    type(reaction_type), intent(in) :: total
    character(len=:), allocatable :: words

    words = "x " // concise(total%statistics(along_x)%peak, 4) // " N, y " // concise(total%statistics(along_y)%peak, 4) // " N"
    if (size(total%position) == 3) words = words // ", z " // concise(total%statistics(along_z)%peak, 4) // " N"
    words = words // ", magnitude " // concise(total%statistics(force_magnitude)%peak, 4) // " N"
  end function force_peaks

  !> HTML section with the picture of a table. It includes the table itself if the page shows it.
  function section(folder, table) result(words)
    character(len=*), intent(in) :: folder
    type(table_type), intent(in) :: table
    character(len=:), allocatable :: words, picture, encoded, rows

    words = "<h2>" // escaped(table%heading) // "</h2>" // newline
    call read_file(folder // "/" // table%name // ".svg", picture)
    if (len(picture) > 0) then
      call base64(picture, encoded)
      words = words // "<figure><img alt=""" // escaped(table%heading) // """ src=""data:image/svg+xml;base64," // encoded &
        & // """><figcaption>" // escaped(table%caption) // "</figcaption></figure>" // newline
    end if
    if (.not. table%shown) return
    rows = html_table(table)
    words = words // rows
    if (len(rows) == 0) words = words // "<p>None.</p>" // newline
  end function section

  !> HTML table of the input as the user typed it, with units. The settings from the command line come first.
  function input_table(configuration, settings) result(words)
    type(configuration_type), intent(in) :: configuration
    type(setting_type), intent(in) :: settings(:)
    character(len=:), allocatable :: words
    integer :: i

    words = "<h2>Input</h2>" // newline
    if (size(settings) > 0) then
      words = words // "<p>Set on the command line: "
      do i = 1, size(settings)
        words = words // trim(merge(", ", "  ", i > 1)) // " <code>" // escaped(trim(settings(i)%text)) // "</code>"
      end do
      words = words // "</p>" // newline
    end if
    words = words // "<div class=""wide""><table><thead>" // row(cell("th", "group") // cell("th", "key") // cell("th", "value") &
      & // cell("th", "unit")) // "</thead><tbody>" // newline
    do i = 1, size(configuration%document%groups)
      words = words // group_rows(configuration, configuration%document%groups(i))
    end do
    words = words // "</tbody></table></div>" // newline
  end function input_table

  !> HTML rows for the keys of one input group.
  function group_rows(configuration, group) result(words)
    type(configuration_type), intent(in) :: configuration
    type(group_type), intent(in) :: group
    character(len=:), allocatable :: words, heading, line
    type(schema_type) :: schema
    integer :: i, equals

    schema = configuration%schema
    heading = "&" // group%name
    if (len(name_of(group)) > 0) then
      heading = heading // " " // name_of(group)
    else if (group%number > 0) then
      heading = heading // " " // text(group%number)
    end if
    words = ""
    do i = 1, size(group%entries)
      associate (entry => group%entries(i))
        if (entry%key == "name") cycle
        line = typed(entry)
        equals = index(line, " = ")
        words = words // row(cell("row", heading) // cell("td", entry%key) // cell("td", line(equals + 3:)) &
          & // cell("td", unit_symbol(schema%keys(find_key_rule(schema, group%name, entry%key)), 0, configuration%units, .true.)))
        heading = ""
      end associate
    end do
  end function group_rows

end module gestell_task_registry_page
