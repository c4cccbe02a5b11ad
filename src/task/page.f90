!> report.html: input, verdict, tables and pictures of one run on one page that needs nothing beside it.
module gestell_task_page
  use gestell_base_base64, only: base64
  use gestell_base_error, only: error_type
  use gestell_base_text, only: text
  use gestell_base_version, only: version
  use gestell_task_configuration, only: configuration_type
  use gestell_input_namelist_document, only: group_type, name_of
  use gestell_base_files, only: file_size
  use gestell_output_page_html, only: cell, escaped, head, row, tail
  use gestell_output_page_table, only: html_table
  use gestell_input_schema, only: find_key_rule, schema_type
  use gestell_input_schema_units, only: unit_symbol
  use gestell_task_keys, only: input_schema
  use gestell_input_namelist_message, only: typed
  use gestell_output_file_output, only: open_output, output_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: write_html

  !> A result file: its name without ending, what stands above it, what its picture shows, whether its table is shown.
  type :: part_type
    character(len=20) :: name
    character(len=48) :: heading
    character(len=140) :: caption
    logical :: table = .false.
  end type part_type

  type(part_type), parameter :: parts(*) = [ &
    & part_type("mechanism", "The machine", "The mechanism through a turn on its frame and mounts, to scale."), &
    & part_type("multipliers", "Stability", "The multipliers and the unit circle: inside, free vibrations die out.", .true.), &
    & part_type("vibrations", "Vibrations at this speed", "Periodic vibrations of the machine, smallest first.", .true.), &
    & part_type("modes", "Modes", "The eigenvectors of the free vibrations at crank angle 0."), &
    & part_type("response", "Vibration over a turn", "Displacements of the frame and forces on the ground."), &
    & part_type("harmonics", "Spectrum", "Amplitudes by orders of the crank."), &
    & part_type("supports", "Forces on the ground", "Peak and root of the mean square, support by support.", .true.), &
    & part_type("supports_history", "Forces over a turn", "The forces of every support over a turn."), &
    & part_type("supports_harmonics", "Forces by orders", "Amplitudes of the supports' forces by orders of the crank."), &
    & part_type("probes", "Probes", "Vibration at the probes.", .true.), &
    & part_type("probes_history", "Probes over a turn", "Velocity at the probes over a turn."), &
    & part_type("probes_harmonics", "Probes by orders", "Amplitudes of the velocity at the probes by orders of the crank."), &
    & part_type("power", "Drive", "Driving torque over a turn, and the power of drive and dampers."), &
    & part_type("resonance", "Resonance curves", "Response over the speed; shaded: the machine leaves it; gaps: none."), &
    & part_type("peaks", "Peaks of the resonance curves", "", .true.), &
    & part_type("campbell", "Campbell diagram", "The modes' frequencies over the speed, and the orders of the crank."), &
    & part_type("crossings", "Crossings", "", .true.), &
    & part_type("critical", "Critical speeds", "Where the response peaks, by order and mode.", .true.), &
    & part_type("sensitivity", "Sensitivity", "Change of the peaks in percent for one percent of each parameter.", .true.), &
    & part_type("sweep", "Sweep", "The points of the sweep."), &
    & part_type("boundary", "Borders of stability", "Where the largest multiplier crosses the unit circle.", .true.), &
    & part_type("trade", "Speed against accuracy", "What an accuracy costs, by method.", .true.)]

  character, parameter :: newline = new_line("a")

contains

  !> Writes report.html into `folder` from the files `names` (without ending) that this run left there, with their pictures
  !> where there are some. `report`: the report for people; `verdict`: stable, unstable, undecided or empty; `limits`: what is said
  !> of probes with a limit.
  !> Error: it cannot be written.
  subroutine write_html(folder, names, configuration, input, settings, verdict, report, error, limits)
    character(len=*), intent(in) :: folder, names(:), input, settings(:), verdict, report
    type(configuration_type), intent(in) :: configuration
    type(error_type), allocatable, intent(out) :: error
    character(len=*), intent(in), optional :: limits(:)
    type(output_type) :: page
    character(len=:), allocatable :: title
    integer :: i

    title = configuration%title
    if (len_trim(title) == 0) title = input
    call open_output(page, folder // "/report.html")
    call page%append(head(title) // "<h1>" // escaped(title) // "</h1>" // newline // "<p class=""sub"">Gestell " // version &
      & // ", input " // escaped(input) // "</p>" // newline // banner(verdict, report) // alarms(report))
    if (present(limits)) then
      do i = 1, size(limits)
        call page%append("<p class=""verdict " // colour(limits(i)) // """>" // escaped(trim(limits(i))) // "</p>" // newline)
      end do
    end if
    do i = 1, size(parts)
      if (any(names == parts(i)%name)) call page%append(section(folder, parts(i)))
    end do
    call page%append(input_table(configuration, settings))
    call page%append("<h2>Report</h2>" // newline // "<pre>" // escaped(report) // "</pre>" // newline // tail())
    call page%complete(error)
  end subroutine write_html

  !> How a sentence on a limit is marked.
  pure function colour(sentence) result(name)
    character(len=*), intent(in) :: sentence
    character(len=:), allocatable :: name

    if (index(sentence, "UNSTABLE: ") == 1 .or. index(sentence, ", ABOVE the limit") > 0) then
      name = "unstable"
    else if (index(sentence, ", WITHIN the limit") > 0 .and. index(sentence, "UNDECIDED: ") /= 1) then
      name = "stable"
    else
      name = "undecided"
    end if
  end function colour

  !> The verdict in the words of the report.
  pure function banner(verdict, report) result(words)
    character(len=*), intent(in) :: verdict, report
    character(len=:), allocatable :: words
    integer :: first, last

    words = ""
    if (len(verdict) == 0) return
    first = index(report, "VERDICT  ")
    if (first == 0) return
    first = first + len("VERDICT  ")
    last = first + index(report(first:), newline) - 2
    words = "<p class=""verdict " // verdict // """><strong>" // verdict // "</strong>" &
      & // escaped(report(first + len(verdict):last)) // "</p>" // newline
  end function banner

  !> What the report says in capitals of vibrations that no machine has, each once, behind the verdict.
  pure function alarms(report) result(words)
    character(len=*), intent(in) :: report
    character(len=:), allocatable :: words
    character(len=:), allocatable :: line
    integer :: first, last

    words = ""
    first = 1
    do while (first <= len(report))
      last = first + index(report(first:) // newline, newline) - 2
      if (any([index(report(first:last), "  UNSTABLE at "), index(report(first:last), "  UNDECIDED at "), &
        & index(report(first:last), "  BEYOND SMALL MOTIONS"), index(report(first:last), "  GREAT MOTIONS")] == 1)) then
        line = "undecided"
        if (index(report(first:last), "UNSTABLE") > 0) line = "unstable"
        line = "<p class=""verdict " // line // """>" // escaped(report(first + 2:last)) // "</p>" // newline
        if (index(words, line) == 0) words = words // line
      end if
      first = last + 2
    end do
  end function alarms

  !> Picture and table of one file.
  function section(folder, part) result(words)
    character(len=*), intent(in) :: folder
    type(part_type), intent(in) :: part
    character(len=:), allocatable :: words
    character(len=:), allocatable :: picture, encoded, table

    words = "<h2>" // trim(part%heading) // "</h2>" // newline
    picture = content_of(folder // "/" // trim(part%name) // ".svg")
    if (len(picture) > 0) then
      call base64(picture, encoded)
      words = words // "<figure><img alt=""" // trim(part%heading) // """ src=""data:image/svg+xml;base64," // encoded // """>" &
        & // "<figcaption>" // trim(part%caption) // "</figcaption></figure>" // newline
    end if
    if (.not. part%table) return
    table = html_table(trim(part%name) // ".csv", content_of(folder // "/" // trim(part%name) // ".csv"))
    words = words // table
    if (len(table) == 0) words = words // "<p>None.</p>" // newline
  end function section

  !> The bytes of a file; none where it cannot be read.
  function content_of(name) result(bytes)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: bytes
    integer(int64) :: size_of
    integer :: unit, status

    size_of = file_size(name)
    if (size_of < 1) then
      bytes = ""
      return
    end if
    allocate(character(len=size_of) :: bytes)
    open (newunit=unit, file=name, access="stream", form="unformatted", action="read", status="old", iostat=status)
    if (status == 0) read (unit, iostat=status) bytes
    if (status == 0) close (unit, iostat=status)
    if (status /= 0) bytes = ""
  end function content_of

  !> The input: what was typed, with units, and what was set from outside.
  pure function input_table(configuration, settings) result(words)
    type(configuration_type), intent(in) :: configuration
    character(len=*), intent(in) :: settings(:)
    character(len=:), allocatable :: words
    integer :: i

    words = "<h2>Input</h2>" // newline
    if (size(settings) > 0) then
      words = words // "<p>Set from outside the file: "
      do i = 1, size(settings)
        words = words // trim(merge(", ", "  ", i > 1)) // " <code>" // escaped(trim(settings(i))) // "</code>"
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

  pure function group_rows(configuration, group) result(words)
    type(configuration_type), intent(in) :: configuration
    type(group_type), intent(in) :: group
    character(len=:), allocatable :: words
    character(len=:), allocatable :: heading, line
    type(schema_type) :: schema
    integer :: i, equals

    schema = input_schema()
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

end module gestell_task_page
