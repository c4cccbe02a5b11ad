!> Writes the report of the task `balance`.
module gestell_task_balance_report
  use gestell_base_key, only: of_length, of_mass
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline
  use gestell_base_words, only: character_count
  use gestell_base_verdict, only: operator(/=), stable
  use gestell_input_namelist_edit, only: with_doubled_quotes
  use gestell_input_schema_units, only: unit_type, units_type
  use gestell_model_linkage, only: linkage_type
  use gestell_output_report_orders, only: order_of
  use gestell_output_report_text_table, only: number_cells, tab, tabulated
  use gestell_output_report_wrapping, only: widest, wrapped
  use gestell_study_balance, only: rigid_ground_type
  use gestell_study_balance_complete, only: balanced, balanced_already, no_pivots
  use gestell_task_balance_keys, only: balance_options
  use gestell_task_balance_variants, only: aims, for_force, for_moment, force, moment, variant_type
  implicit none (type, external)
  private

  public :: balance_headlines, link_lines, report_balance, turning_lines

  !> Maximum number of orders that the report lists for each variant
  integer, parameter :: max_orders = 3
  !> `notable_change`: relative changes smaller than this are not mentioned. `rounding`: a value counts as rounding error if it is
  !> smaller than this fraction of the total
  real(dp), parameter :: notable_change = 0.01_dp, rounding = 1.0e-11_dp

contains

  !> Headlines on the rms force, one per line. They name the variant with the smallest force on rigid ground, and the variant with
  !> the smallest force on the mounts. A gain below `notable_change` is called not useful. If
  !> another variant reduces the force on rigid ground but increases it on the mounts, a last line warns of it. Empty if no
  !> counterweight reduces the force on rigid ground.
  function balance_headlines(variants) result(lines)
    type(variant_type), intent(in) :: variants(:)
    character(len=:), allocatable :: lines
    logical :: solved(size(variants)), misleading(size(variants))
    integer :: i, on_rigid, on_mounts, worst

    lines = ""
    on_rigid = minloc([(variants(i)%residual%rms(force), i = 1, size(variants))], dim=1)
    if (on_rigid == 1) return
    lines = either("Best counterweights for rigid ground (", "No useful counterweight for rigid ground: the best (", &
      & variants(on_rigid)%residual%rms(force) < (1 - notable_change) * variants(1)%residual%rms(force))
    lines = lines // variants(on_rigid)%label() // "): rms force " // change(on_rigid, .true.)
    solved = [(.not. allocated(variants(i)%mounted%reason), i = 1, size(variants))]
    if (.not. solved(1)) then
      lines = lines // newline
      return
    end if
    lines = lines // either(", but on the mounts ", ", on the mounts ", variants(on_rigid)%mounted%rms(force) &
      & > variants(1)%mounted%rms(force)) // change(on_rigid, .false.) // newline
    on_mounts = minloc([(variants(i)%mounted%rms(force), i = 1, size(variants))], dim=1, mask=solved)
    if (on_mounts == 1) then
      lines = lines // "No useful counterweight for the mounts: none of these reduces the rms force on the mounts" // newline
    else if (.not. variants(on_mounts)%mounted%rms(force) < (1 - notable_change) * variants(1)%mounted%rms(force)) then
      lines = lines // "No useful counterweight for the mounts: the best (" // variants(on_mounts)%label() // "): rms force " &
        & // change(on_mounts, .false.) // newline
    else if (on_mounts /= on_rigid) then
      lines = lines // "Best counterweights for the mounts (" // variants(on_mounts)%label() // "): rms force " &
        & // change(on_mounts, .false.) // ", on rigid ground " // change(on_mounts, .true.) // newline
    end if
    misleading = solved .and. [(variants(i)%residual%rms(force) < (1 - notable_change) * variants(1)%residual%rms(force) .and. &
      & variants(i)%mounted%rms(force) > (1 + notable_change) * variants(1)%mounted%rms(force), i = 1, size(variants))]
    misleading(on_rigid) = .false.
    worst = maxloc([(variants(i)%mounted%rms(force), i = 1, size(variants))], dim=1, mask=misleading)
    if (worst > 0) lines = lines // "Worst counterweights for the mounts (" // variants(worst)%label() // "): rms force " &
      & // change(worst, .false.) // ", although on rigid ground " // change(worst, .true.) // newline

  contains

    !> Relative change of the rms force from the original machine to variant number `i`. `rigidly`: true for the force on rigid
    !> ground, false for the force on the mounts.
    pure function change(i, rigidly) result(words)
      integer, intent(in) :: i
      logical, intent(in) :: rigidly
      character(len=:), allocatable :: words

      words = "no periodic vibration"
      if (rigidly) then
        words = change_words(variants(i)%residual%rms(force), variants(1)%residual%rms(force), "N")
      else if (.not. (allocated(variants(i)%mounted%reason) .or. allocated(variants(1)%mounted%reason))) then
        words = change_words(variants(i)%mounted%rms(force), variants(1)%mounted%rms(force), "N")
      end if
    end function change

  end function balance_headlines

  !> Relative change as text, for example "-63.2 %". If the value before the change is 0, the text is the value after the change,
  !> with its unit.
  pure function change_words(after, before, unit) result(words)
    real(dp), intent(in) :: after, before
    character(len=*), intent(in) :: unit
    character(len=:), allocatable :: words
    real(dp) :: percent

    if (.not. before > 0) then
      words = concise(after, 4) // " " // unit
      return
    end if
    percent = 100 * (after / before - 1)
    words = either("-", "+", percent < 0) // concise(abs(percent), 3) // " %"
    if (abs(percent) < 0.005_dp) words = "0 %"
  end function change_words

  !> The section of the report on counterweights.
  function report_balance(variants, rigid, linkage, options, state, length) result(report)
    !> The original machine, followed by the variants with counterweights
    type(variant_type), intent(in) :: variants(:)
    !> Bodies that can carry counterweights, with the effects of these counterweights, and the shaking forces on rigid ground
    type(rigid_ground_type), intent(in) :: rigid
    class(linkage_type), intent(in) :: linkage
    !> Values of the keys of the group &balance
    type(balance_options), intent(in) :: options
    !> Result of `balance_force`: whether counterweights can make the force vanish
    integer, intent(in) :: state
    !> Length (m) by which moments are divided in the weighted sum
    real(dp), intent(in) :: length
    character(len=:), allocatable :: report, rows, orders, heads, links
    integer, allocatable :: listed_orders(:)
    integer :: aim, b, i, k

    listed_orders = linkage%harmonics(max_orders)
    listed_orders = listed_orders(:max_orders)
    heads = order_of(listed_orders(1), linkage%turns) // "," // order_of(listed_orders(2), linkage%turns) // "," &
      & // order_of(listed_orders(3), linkage%turns)
    rows = ""
    orders = ""
    do i = 1, size(variants)
      associate (one => variants(i), original => variants(1))
        rows = rows // one%label() // tab
        if (i > 1) rows = rows // concise(one%mass, 4)
        rows = rows // tab // cells(one%residual%rms, original%residual%rms, i == 1)
        if (.not. allocated(one%mounted%reason)) then
          rows = rows // tab // cells(one%mounted%rms, merge(0.0_dp, original%mounted%rms, allocated(original%mounted%reason)), &
            & i == 1)
          if (one%mounted%verdict /= stable) rows = rows // tab // trim(one%mounted%verdict%word())
        else
          rows = rows // tab // "-" // tab // "-" // tab // one%mounted%reason
        end if
        rows = rows // newline
        orders = orders // one%label()
        do k = 1, size(listed_orders)
          orders = orders // tab // clean(one%residual%order_rms(listed_orders(k), force), one%residual%rms(force))
        end do
        do k = 1, size(listed_orders)
          if (listed_orders(k) > size(one%mounted%orders, 2)) exit
          orders = orders // tab
          if (.not. allocated(one%mounted%reason)) orders = orders // clean(one%mounted%orders(force, listed_orders(k)), &
            & one%mounted%rms(force))
        end do
        orders = orders // newline
      end associate
    end do
    report = tabulated("lrrrrrl", "counterweight,mass,rigid,rigid,mounts,mounts" // newline // ",kg,force,moment,force,moment", &
      & rows)
    if (size(variants) > 1) report = report // "  for force: minimum rms force on rigid ground; likewise for moment and sum" &
      & // newline
    select case (state)
    case (balanced)
      report = report // "  the force is cancelled completely by counterweights on: " // variants(size(variants))%links(", ")
    case (balanced_already)
      report = report // "  the force is already balanced"
    case (no_pivots)
      report = report // "  the force cannot be cancelled: none of the permitted links turns about a pivot on the frame"
    case default
      report = report // "  counterweights on the permitted links cannot cancel the force completely"
    end select
    report = report // newline
    do aim = for_force, for_moment
      links = ""
      do b = 1, size(rigid%bodies)
        if (any([(variants(i)%aim == aim .and. any(variants(i)%weights%body == b), i = 2, size(variants))])) cycle
        links = links // ", " // linkage%links(rigid%bodies(b)%link)%name
      end do
      if (links /= "") report = report // "  a single counterweight on one of these links cannot reduce the rms " &
        & // trim(aims(aim)) // ": " // links(3:) // newline
    end do
    report = report // "  moments about " // either("F;", "O;", options%about_frame) // " sum: " // concise(1 - options%weight, 3) &
      & // " force^2 + " // concise(options%weight, 3) // " (moment / " // concise(length, 4) // " m)^2, of rms values" // newline &
      & // "  radius of a counterweight: " // either("as given in &balance", "length of the link, unless &balance radius is " &
      & // "given", &
      & allocated(options%radii)) // newline // newline &
      & // "RMS FORCE on rigid ground and on the mounts, by orders of the crank" // newline &
      & // tabulated("lrrrrrr", "counterweight,rigid " // heads // ",mounts " // heads // newline // ",N,N,N,N,N,N", orders)
  end function report_balance

  !> Table of the first-order force and moment in the plane normal to the shaft, for a frame in space. Each is split into a vector
  !> that rotates with the crank and a vector that rotates against it. The third of the `axes` is the direction of the shaft.
  function turning_lines(variants, axes, turns) result(lines)
    type(variant_type), intent(in) :: variants(:)
    real(dp), intent(in) :: axes(3, 3)
    !> Number of turns of the crank in the period. Harmonic number `turns` of the period is therefore the first order
    integer, intent(in) :: turns
    character(len=:), allocatable :: lines
    real(dp) :: sizes(turns, 4), scale(4)
    integer :: i

    lines = ""
    sizes = variants(1)%residual%turning(axes, turns)
    scale = max(sizes(turns, :), variants(1)%residual%rms([force, force, moment, moment]))
    do i = 1, size(variants)
      sizes = variants(i)%residual%turning(axes, turns)
      lines = lines // variants(i)%label() &
        & // number_cells(merge(0.0_dp, sizes(turns, :), sizes(turns, :) <= rounding * scale), 4) // newline
    end do
    lines = newline // wrapped("FORCE AND MOMENT VECTORS normal to the first shaft, rotating with and against the crank, " &
      & // "order 1, on rigid ground" // newline) &
      & // tabulated("lrrrr", "counterweight,force with,against,moment with,against" // newline // ",N,N,N m,N m", lines)
  end function turning_lines

  !> Two table cells, one for the force and one for the moment. If `plain` is true, they contain the values with units. Otherwise
  !> they contain the relative changes from `original`.
  pure function cells(values, original, plain) result(words)
    real(dp), intent(in) :: values(2), original(2)
    logical, intent(in) :: plain
    character(len=:), allocatable :: words

    words = either(concise(values(force), 5) // " N" // tab // concise(values(moment), 5) // " N m", &
      & change_words(values(force), original(force), "N") // tab // change_words(values(moment), original(moment), "N m"), plain)
  end function cells

  !> The value `part` as text; 0 if the value is rounding error relative to `whole`.
  pure function clean(part, whole) result(words)
    real(dp), intent(in) :: part, whole
    character(len=:), allocatable :: words

    words = concise(merge(0.0_dp, part, part <= rounding * whole), 4)
  end function clean

  !> The counterweights as &link groups that can be added to the input. Values are in the units of the input.
  function link_lines(variants, rigid, linkage, units) result(lines)
    !> The original machine, followed by the variants with counterweights
    type(variant_type), intent(in) :: variants(:)
    !> Links of the linkage that can carry counterweights, and their forces on rigid ground
    type(rigid_ground_type), intent(in) :: rigid
    class(linkage_type), intent(in) :: linkage
    type(units_type), intent(in) :: units
    character(len=:), allocatable :: lines, line, joints
    integer, parameter :: digits = 12
    real(dp) :: place(2)
    integer :: i, k

    lines = ""
    if (size(variants) == 1) return
    lines = newline // "COUNTERWEIGHTS as &link groups for the input" // newline // copies_line(variants, rigid, linkage)
    do i = 2, size(variants)
      associate (one => variants(i))
        lines = lines // "  ! " // one%label() // newline
        do k = 1, size(one%weights)
          associate (body => rigid%bodies(one%weights(k)%body))
            associate (link => linkage%links(body%link))
              place = one%weights(k)%center(body)
              where (abs(place) <= rounding * norm2(place)) place = 0
              place = in_input_units(place, units%of(of_length))
              joints = "from='" // with_doubled_quotes(linkage%joints(link%from)%name) // "', to='" &
                & // with_doubled_quotes(linkage%joints(link%to)%name) // "',"
              line = "  &link name='" // with_doubled_quotes(trim(one%names(k))) // "',"
              lines = lines // line // either(" ", newline // "    ", character_count(line // joints) < widest) // joints &
                & // newline // "    mass=" // concise(in_input_units(one%weights(k)%mass(body), units%of(of_mass)), digits) &
                & // ", inertia=0, center=" // concise(place(1), digits) // "," // concise(place(2), digits)
              if (size(rigid%kinds()) > 3 .and. abs(link%own_z) > 0) lines = lines // ", z=" // concise(in_input_units(link%own_z, &
                & units%of(of_length)), digits)
              lines = lines // " /" // newline
            end associate
          end associate
        end do
      end associate
    end do
  end function link_lines

  !> Note that lists the links that have both a counterweight and a copy made by &repeat, because &repeat would copy the
  !> counterweight too. Empty if there are none. A copy of a link is recognised by its name, which ends with a dot and the name of
  !> the link.
  pure function copies_line(variants, rigid, linkage) result(line)
    type(variant_type), intent(in) :: variants(:)
    type(rigid_ground_type), intent(in) :: rigid
    class(linkage_type), intent(in) :: linkage
    character(len=:), allocatable :: line, tail
    logical :: copied, has_counterweight
    integer :: b, i, k

    line = ""
    do b = 1, size(rigid%bodies)
      tail = "." // linkage%links(rigid%bodies(b)%link)%name
      ! a link is a copy if its name ends with `tail` and has characters before it
      copied = any([(index(linkage%links(k)%name // newline, tail // newline) > 1, k = 1, size(linkage%links))])
      has_counterweight = any([(any(variants(i)%weights%body == b), i = 1, size(variants))])
      if (copied .and. has_counterweight) line = line // ", " // tail(2:)
    end do
    if (line /= "") line = wrapped("  note: &repeat also copies a counterweight that you add to the original mechanism; this " &
      & // "concerns the links " // line(3:) // newline)
  end function copies_line

  !> Converts a value from SI units to the units of the input.
  elemental real(dp) function in_input_units(value, unit)
    real(dp), intent(in) :: value
    type(unit_type), intent(in) :: unit

    in_input_units = value * unit%divisor / unit%factor
  end function in_input_units

end module gestell_task_balance_report
