!> Composes a self-contained HTML page with the input, the verdict, the tables and the pictures of a run.
module gestell_task_registry_page
  use gestell_base_files, only: read_file
  use gestell_base_text, only: either, newline, text
  use gestell_base_version, only: version
  use gestell_base_words, only: on_one_line, printable
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_common_context, only: context_type
  use gestell_task_machine_report, only: report_machine
  use gestell_task_registry_summary, only: summary
  use gestell_output_head, only: setting_type
  use gestell_output_file_output, only: output_type
  use gestell_base_markup, only: escaped
  use gestell_output_page_html, only: cell, head, row, scroll_start, section_start, tail, with_squares
  use gestell_output_page_style, only: button_script
  use gestell_output_page_svg, only: inline_svg
  use gestell_output_page_table, only: html_table
  use gestell_output_page_viewer, only: viewer, viewer_script
  use gestell_output_picture_script, only: figure_type
  use gestell_output_result, only: result_type
  use gestell_output_table, only: table_type
  use gestell_input_namelist_document, only: group_type, name_of
  use gestell_input_namelist_message, only: describe_entry
  use gestell_input_schema, only: find_key_rule, schema_type
  use gestell_input_schema_units, only: unit_symbol
  use gestell_output_picture_axis, only: unit_words
  implicit none (type, external)
  private

  public :: append_page

  !> HTML of one section of the page.
  type :: section_type
    character(len=:), allocatable :: html
  end type section_type

  !> Heading of the section in which the machine moves
  character(len=*), parameter :: motion_heading = "The machine in motion"

contains

  !> Appends the page with the results to `page`. The page shows the name of the input file without its folder. It contains the
  !> pictures in `folder`; none if `folder` is absent.
  subroutine append_page(context, result, page, folder)
    type(context_type), intent(in) :: context
    type(result_type), intent(in) :: result
    type(output_type), intent(inout) :: page
    character(len=*), intent(in), optional :: folder
    character(len=:), allocatable :: title, input, words
    type(section_type) :: sections(size(result%tables))
    integer :: i

    input = on_one_line(context%head%input(index(context%head%input, "/", back=.true.) + 1:))
    title = context%head%title
    if (len_trim(title) == 0) title = input
    do i = 1, size(sections)
      sections(i)%html = section(result%tables(i), result%figures, folder)
    end do
    call page%append(head(title) // "<a class=""skip"" href=""#summary"">Skip to the summary</a>" // newline // "<header><h1>" &
      & // escaped(title) // "</h1>" // newline // "<p class=""sub"">Gestell " // version // ", input " // escaped(input) &
      & // "</p></header>" // newline // "<main>" // newline // summary(context, result))
    call page%append("<nav aria-label=""Contents""><h2>Contents</h2><ol>" // newline)
    if (result%moves()) call page%append(link("motion", motion_heading))
    do i = 1, size(sections)
      if (sections(i)%html /= "") call page%append(link(result%tables(i)%name, result%tables(i)%heading))
    end do
    call page%append(link("input", "Input") // link("report", "Report") // "</ol></nav>" // newline)
    if (result%moves()) call page%append(section_start("motion", motion_heading) // viewer(result%scenes()) &
      & // viewer_script() // "</section>" // newline)
    do i = 1, size(sections)
      call page%append(sections(i)%html)
    end do
    call page%append(input_table(context%configuration, context%head%settings))
    words = section_start("report", "Report") // folded("as printed on standard output", &
      & printable(report_machine(context%configuration, input) // result%report) // newline // result%summary_line())
    if (result%details /= "") words = words // folded("accuracy of the numerical solution", result%details)
    call page%append(words // "</section>" // newline // "</main>" // newline // button_script() // tail)
  end subroutine append_page

  !> HTML of an entry of the contents.
  pure function link(id, heading) result(words)
    character(len=*), intent(in) :: id, heading
    character(len=:), allocatable :: words

    words = "<li><a href=""#" // escaped(id) // """>" // escaped(heading) // "</a></li>" // newline
  end function link

  !> HTML for lines of a report that are hidden until the reader opens them.
  pure function folded(summary, lines) result(words)
    character(len=*), intent(in) :: summary, lines
    character(len=:), allocatable :: words

    words = "<details><summary>" // summary // "</summary>" // newline // "<pre tabindex=""0"">" // escaped(lines) &
      & // "</pre></details>" // newline
  end function folded

  !> HTML section with the pictures of a table. It includes the table itself if the page shows it. It is empty if there is neither
  !> picture nor table.
  function section(table, figures, folder) result(words)
    type(table_type), intent(in) :: table
    !> All pictures of the run
    type(figure_type), intent(in) :: figures(:)
    !> Folder of the pictures; the section has none if it is absent
    character(len=*), intent(in), optional :: folder
    character(len=:), allocatable :: words, source, picture, rows, caption, heading
    integer :: i

    words = ""
    do i = 1, size(figures)
      if (.not. present(folder)) exit
      associate (figure => figures(i))
        if (figure%table /= table%name .or. allocated(figure%scenes)) cycle
        call read_file(folder // "/" // figure%name // ".svg", source)
        picture = inline_svg(source, figure%name // "-", table%heading // ". " // figure%shown)
        ! the picture of the table itself has the table's caption, further pictures say what they show
        caption = either(table%caption, figure%shown // ".", figure%name == table%name)
        heading = either(table%heading, figure%shown, figure%name == table%name)
        if (picture /= "") words = words // "<figure>" // scroll_start(heading // ", picture") // picture // "</div>" &
          & // "<figcaption>" // escaped(caption) // "</figcaption></figure>" // newline
      end associate
    end do
    if (words == "" .and. .not. table%shown) return
    words = section_start(table%name, table%heading) // words
    if (table%shown) then
      rows = html_table(table)
      words = words // rows
      if (len(rows) == 0) words = words // "<p>None.</p>" // newline
    end if
    words = words // "</section>" // newline
  end function section

  !> HTML table of the input as the user typed it, with units. The settings from the command line come first.
  function input_table(configuration, settings) result(words)
    type(configuration_type), intent(in) :: configuration
    type(setting_type), intent(in) :: settings(:)
    character(len=:), allocatable :: words
    integer :: i

    words = section_start("input", "Input")
    if (size(settings) > 0) then
      words = words // "<p>Set on the command line: "
      do i = 1, size(settings)
        words = words // trim(merge(", ", "  ", i > 1)) // " <code>" // escaped(trim(settings(i)%text)) // "</code>"
      end do
      words = words // "</p>" // newline
    end if
    words = words // scroll_start("Input") // "<table><thead>" // row(cell("th", "group") // cell("th", "key") &
      & // cell("th", "value") // cell("th", "unit")) // "</thead>" // newline
    do i = 1, size(configuration%document%groups)
      words = words // group_rows(configuration, configuration%document%groups(i))
    end do
    words = words // "</table></div></section>" // newline
  end function input_table

  !> HTML rows for the keys of one input group, under one heading.
  function group_rows(configuration, group) result(words)
    type(configuration_type), intent(in) :: configuration
    type(group_type), intent(in) :: group
    character(len=:), allocatable :: words, heading, line, unit
    type(schema_type) :: schema
    integer :: i, equals, rows

    schema = configuration%schema
    heading = "&" // group%name
    if (len(name_of(group)) > 0) then
      heading = heading // " " // name_of(group)
    else if (group%number > 0) then
      heading = heading // " " // text(group%number)
    end if
    rows = count([(group%entries(i)%key /= "name", i = 1, size(group%entries))])
    words = ""
    do i = 1, size(group%entries)
      associate (entry => group%entries(i))
        if (entry%key == "name") cycle
        call describe_entry(entry, line)
        equals = index(line, " = ")
        unit = trim(unit_symbol(schema%keys(find_key_rule(schema, group%name, entry%key)), 0, configuration%units, .true.))
        if (words == "") heading = "<th scope=""rowgroup"" rowspan=""" // text(rows) // """>" // escaped(heading) // "</th>"
        words = words // row(either(heading, "", words == "") // cell("td", entry%key) // cell("td", line(equals + 3:)) &
          & // cell("td", with_squares(unit_words(unit))))
      end associate
    end do
    if (words /= "") words = "<tbody>" // words // "</tbody>" // newline
  end function group_rows

end module gestell_task_registry_page
