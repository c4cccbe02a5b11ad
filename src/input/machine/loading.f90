!> Reads the loads of an input file: forces and moments between links, frame and ground.
module gestell_input_machine_loading
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type
  use gestell_base_key, only: key_type, integer_key, nonnegative, nonzero, of_angle, of_area, of_force, of_length, of_moment, &
    & of_pressure, positive, range_type, real_key, text_key
  use gestell_base_kinds, only: dp, pi
  use gestell_base_paths, only: is_absolute
  use gestell_base_text, only: text
  use gestell_input_machine_joints, only: check_joint_references
  use gestell_input_machine_load_table, only: load_table_type, moment_table, pressure_table, read_load_table
  use gestell_input_namelist_document, only: group_type, has, name_of
  use gestell_input_namelist_message, only: input_error
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_input_schema, only: variant_type
  use gestell_input_schema_read, only: count_values, read
  use gestell_input_schema_units, only: units_type
  use gestell_math_rational, only: greatest_divisor, to_rational
  use gestell_math_series_piecewise, only: harmonics_of, interpolate, quadrature_nodes, trimmed
  use gestell_model_joints_joint, only: form_type
  use gestell_model_joints_driven, only: no_ratio
  use gestell_model_joints_placement, only: placement_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_gearing, only: max_turns
  use gestell_model_linkage_load, only: frame_body, ground_body, load_type
  implicit none (type, external)
  private

  public :: read_load

  !> Maximum number of values of a series or table, and orders of a table if `harmonics` is not given.
  integer, parameter :: most = 1001, usual_orders = 64
  type(range_type), parameter :: whole_turns = range_type(least=1.0_dp, most=real(max_turns, dp))

  type(key_type), parameter, public :: load_keys(*) = [ &
    & key_type("load", "name", text_key, "name in messages and in paths such as `load(NAME).scale`", required=.true.), &
    & key_type("load", "on", text_key, "name of the link on which the load acts, or `'frame'`", required=.true.), &
    & key_type("load", "against", text_key, "body that carries the reaction: another link, `'frame'` or `'ground'`", &
    &   otherwise="`'frame'`; `'ground'` if `on='frame'`"), &
    & key_type("load", "joint", text_key, "joint at which the force acts", otherwise="none"), &
    & key_type("load", "point", real_key, "replaces `joint`: point in the axes of the link `on`; if `on='frame'`, relative " // &
    &   "to F, along xi, eta (in space also zeta)", 1, 2, 3, unit=of_length, otherwise="none"), &
    & key_type("load", "axes", text_key, "axes to which `direction` refers", otherwise="`'frame'`; `'guide'` if " // &
    &   "`type='polytropic'`", words="frame, link, guide, ground"), &
    & key_type("load", "direction", real_key, "direction of a positive force: angle from the first of the `axes`. For a " // &
    &   "frame in space and `on='frame'` also a vector along xi, eta, zeta, then also the axis of `moment`", 1, 1, 3, &
    &   unit=of_angle, default=0.0_dp), &
    & key_type("load", "type", text_key, "how the course of the load is given", word="given", words="given, polytropic"), &
    & key_type("load", "force", real_key, "Fourier coefficients of the force over the crank angle theta: the mean, then the " // &
    &   "factors of cos theta, sin theta, cos 2 theta, ... (theta/2 with `cycle=2`)", 1, 1, most, unit=of_force, &
    &   otherwise="none"), &
    & key_type("load", "moment", real_key, "Fourier coefficients of the moment, like `force`; positive: counter-clockwise", &
    &   1, 1, most, unit=of_moment, otherwise="none"), &
    & key_type("load", "force_table", real_key, "replaces `force`: values at equal steps of the crank angle over the cycle, " // &
    &   "the first at 0", 1, 3, most, unit=of_force, otherwise="none"), &
    & key_type("load", "table", text_key, "replaces `force` or `moment`: CSV file, relative to the folder of the input", &
    &   otherwise="none"), &
    & key_type("load", "area", real_key, "area that turns a pressure in `force`, `force_table` or `table` into a " // &
    &   "force. The pressures of `force` and `force_table` are in Pa, or in the unit of `&units " // &
    &   "pressure` if it is given", unit=of_area, range=positive, otherwise="none"), &
    & key_type("load", "bore", real_key, "replaces `area`: diameter of a piston", unit=of_length, range=positive, &
    &   otherwise="none"), &
    & key_type("load", "cycle", integer_key, "turns of the crank after which the load repeats: 2 for a four-stroke engine", &
    &   default=1.0_dp, range=whole_turns), &
    & key_type("load", "order", real_key, "only with `on='frame'`: cycles per turn of the drive, that is 60 times the " // &
    &   "frequency divided by the speed; a number such as 0.5, or numerator and denominator", 1, 1, 2, default=1.0_dp, &
    &   range=nonzero), &
    & key_type("load", "phase", real_key, "constant angle that is added to the crank angle", unit=of_angle, default=0.0_dp), &
    & key_type("load", "interpolation", text_key, "curve through the values of a table", otherwise="`'fourier'` for " // &
    &   "`force_table`, `'spline'` for `table`", words="fourier, spline, linear"), &
    & key_type("load", "harmonics", integer_key, "highest multiple of the cycle's frequency that represents a table or " // &
    &   "polytropic cycle", range=range_type(least=1.0_dp, most=500.0_dp), otherwise="64, for a table at most what its rows " // &
    &   "allow"), &
    & key_type("load", "scale", real_key, "factor by which force and moment are multiplied", default=1.0_dp), &
    & key_type("load", "clearance", real_key, "clearance volume divided by swept volume", range=positive, otherwise="none"), &
    & key_type("load", "suction", real_key, "absolute suction pressure", unit=of_pressure, range=positive, otherwise="none"), &
    & key_type("load", "discharge", real_key, "absolute discharge pressure", unit=of_pressure, range=positive, otherwise="none"), &
    & key_type("load", "exponent", real_key, "exponent n of compression and expansion, p V^n = const", default=1.3_dp, &
    &   range=positive), &
    & key_type("load", "ambient", real_key, "absolute pressure on the other side of the piston", unit=of_pressure, &
    &   default=1.0_dp, range=nonnegative)]

  !> Words that keys of &load accept, and the meaning of each.
  type(variant_type), parameter, public :: load_words(*) = [ &
    & variant_type("load", "axes", "frame", "x and y of the mechanism; they turn with the frame"), &
    & variant_type("load", "axes", "link", "the axes of the link `on`"), &
    & variant_type("load", "axes", "guide", "the guide on which the joint `joint` slides, and its perpendicular"), &
    & variant_type("load", "axes", "ground", "x and y of the mechanism at rest; only for `against='ground'`: the force keeps " // &
    &   "its direction when the frame turns"), &
    & variant_type("load", "type", "given", "by `force`, `moment`, `force_table` or `table`"), &
    & variant_type("load", "type", "polytropic", "gas force of a compressor, from `bore`, `clearance`, `suction`, " // &
    &   "`discharge`, `exponent`, `ambient` and the travel of `joint`. `direction` points from the cylinder head to the piston"), &
    & variant_type("load", "interpolation", "fourier", "trigonometric polynomial; the angles must be equally spaced"), &
    & variant_type("load", "interpolation", "spline", "periodic cubic spline"), &
    & variant_type("load", "interpolation", "linear", "straight lines")]

contains

  !> Reads a load and adds it to the linkage, which contains all joints and links. Fails if a body, joint or file does not exist, if
  !> keys contradict each other, or if a value is out of range.
  subroutine read_load(group, joints, names, units, placement, linkage, error)
    !> The group &load, and the groups of all joints
    type(group_type), intent(in) :: group, joints(:)
    !> Names of the joints
    type(dictionary_type), intent(in) :: names
    type(units_type), intent(in) :: units
    !> Position of the mechanism to which the load belongs
    type(placement_type), intent(in) :: placement
    type(linkage_type), intent(inout) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(load_type) :: load
    character(len=:), allocatable :: word, usual
    logical :: known
    integer :: cycles, n

    load%name = name_of(group)
    call read(group, load_keys, "on", word, error)
    if (allocated(error)) return
    call find_body(group, "on", word, linkage, load%on, error)
    if (allocated(error)) return
    usual = "frame"
    if (load%on == frame_body) usual = "ground"
    call read(group, load_keys, "against", word, error, default=usual)
    if (allocated(error)) return
    call find_body(group, "against", word, linkage, load%against, error)
    if (allocated(error)) return
    if (load%on == ground_body) then
      call input_error(group, "on", "must be a link or 'frame'", error)
    else if (load%on == load%against) then
      call input_error(group, "against", "must differ from the body in 'on'", error)
    else if (load%on == frame_body .and. load%against > 0) then
      call input_error(group, "on", "must be the link, and 'against' the frame", error)
    end if
    if (.not. allocated(error)) call read_course(group, units, load, error)
    if (allocated(error)) return
    call read_point(group, joints, names, units, placement, linkage, load, error)
    if (allocated(error)) return
    call read(group, load_keys, "cycle", cycles, error)
    call read(group, load_keys, "phase", load%phase, error, units)
    if (allocated(error)) return
    load%ratio = placement%ratio
    load%denominator = placement%denominator
    load%phase = load%phase + placement%phase + 2 * pi * placement%load_turns
    if (has(group, "order")) then
      if (load%on /= frame_body) call input_error(group, "order", "is allowed only with on='frame'", error)
      if (.not. allocated(error)) call read_order()
      if (allocated(error)) return
    end if
    if (allocated(load%gas) .and. (cycles > 1 .or. has(group, "phase"))) then
      call input_error(group, "type", "'polytropic' follows the piston: remove 'cycle' and 'phase'", error)
      return
    end if
    load%phase = load%phase / cycles
    n = greatest_divisor(load%ratio, load%denominator * cycles)
    load%ratio = load%ratio / n
    load%denominator = load%denominator * cycles / n
    load%z = placement%z + load%z
    load%plane = placement%plane
    if (.not. allocated(linkage%loads)) allocate(linkage%loads(0))
    linkage%loads = [linkage%loads, load]

  contains

    !> Reads the order of an excitation of the frame.
    subroutine read_order()
      real(dp) :: numbers(2)

      n = count_values(group, "order")
      call read(group, load_keys, "order", numbers(:n), error)
      if (allocated(error)) return
      call to_rational(numbers(:n), load%ratio, load%denominator, known)
      if (.not. known) call input_error(group, "order", no_ratio, error)
    end subroutine read_order

  end subroutine read_load

  !> Number of the body called `name`: index of a link, `frame_body` or `ground_body`. Fails if there is no such body.
  subroutine find_body(group, key, name, linkage, body, error)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key, name
    type(linkage_type), intent(in) :: linkage
    integer, intent(out) :: body
    type(error_type), allocatable, intent(out) :: error
    character(len=64), allocatable :: bodies(:)
    integer :: i

    allocate(bodies(size(linkage%links) + 2))
    bodies(:2) = [character(len=64) :: "frame", "ground"]
    do i = 1, size(linkage%links)
      bodies(2 + i) = linkage%links(i)%name
    end do
    body = findloc(bodies, name, dim=1) - 2
    if (body == -1) body = frame_body
    if (name == "ground") body = ground_body
    if (body == -2) call input_error(group, key, "there is no link '" // name // "'" // suggestion(name, bodies), error)
  end subroutine find_body

  !> Reads point of action and direction of a load.
  subroutine read_point(group, joints, names, units, placement, linkage, load, error)
    type(group_type), intent(in) :: group, joints(:)
    type(dictionary_type), intent(in) :: names
    type(units_type), intent(in) :: units
    type(placement_type), intent(in) :: placement
    type(linkage_type), intent(in) :: linkage
    type(load_type), intent(inout) :: load
    type(error_type), allocatable, intent(out) :: error
    type(form_type) :: form
    character(len=:), allocatable :: name, axes, usual
    real(dp) :: angle(1)
    logical :: is_force
    integer :: n

    is_force = allocated(load%force) .or. allocated(load%gas)
    usual = "frame"
    if (allocated(load%gas)) usual = "guide"
    call read(group, load_keys, "axes", axes, error, default=usual)
    n = count_values(group, "direction")
    if (n > 1) then
      call read(group, load_keys, "direction", load%vector, error)
      if (allocated(error)) return
      if (n == 2 .or. load%on /= frame_body) then
        call input_error(group, "direction", "must be one angle or, if on='frame', a vector of 3 values", error)
      else if (.not. norm2(load%vector) > 0) then
        call input_error(group, "direction", "must not be the zero vector", error)
      end if
      load%vector = load%vector / max(norm2(load%vector), tiny(1.0_dp))
    else
      call read(group, load_keys, "direction", angle, error, units)
      if (.not. allocated(error)) load%angle = angle(1)
    end if
    if (allocated(error)) return
    load%axes = axes
    if (has(group, "joint")) then
      call read(group, load_keys, "joint", name, error)
      if (.not. allocated(error)) call check_joint_references(group, "joint", [name], joints, names, size(joints), error)
      if (allocated(error)) return
      load%joint = names%position(name)
      call linkage%joints(load%joint)%joint%describe(form)
    end if
    if (has(group, "point")) then
      n = count_values(group, "point")
      call read(group, load_keys, "point", load%point(:n), error, units)
      if (allocated(error)) return
      if (n == 3 .and. load%on /= frame_body) call input_error(group, "point", "must have 2 values unless on='frame'", error)
      if (n < 2 .and. .not. allocated(error)) call input_error(group, "point", "must have 2 or 3 values", error)
      if (allocated(error)) return
      if (load%on > 0) then
        if (linkage%links(load%on)%to == 0) load%point(:2) = placement%vector(load%point(:2))
      end if
    end if
    if (load%on == frame_body .and. has(group, "joint")) then
      call input_error(group, "joint", "a force on the frame needs 'point' instead", error)
    else if (is_force .and. (has(group, "joint") .eqv. has(group, "point"))) then
      call input_error(group, "", "give either 'joint' or 'point', at which the force acts", error)
    else if (load%axes == "ground" .and. load%against /= ground_body) then
      call input_error(group, "axes", "'ground' requires against='ground'", error)
    else if (load%axes == "link" .and. load%on == frame_body) then
      call input_error(group, "axes", "'link' requires a link in 'on'", error)
    else if (load%axes == "guide" .and. .not. allocated(form%guides)) then
      call input_error(group, "axes", "'guide' requires a 'joint' that slides on a guide", error)
    end if
    if (allocated(error)) return
    if (load%on > 0) load%z = linkage%links(load%on)%own_z
    if (load%on == frame_body) load%z = load%point(3)
    if (load%axes == "guide") load%guide = form%guides(1)
    if (load%axes == "frame" .or. load%axes == "ground") load%angle = load%angle + placement%angle
    if (load%axes == "link" .and. linkage%links(max(1, load%on))%to == 0) load%angle = load%angle + placement%angle
  end subroutine read_point

  !> Reads the course of a load: Fourier coefficients, a table, or the data of a polytropic cycle.
  subroutine read_course(group, units, load, error)
    type(group_type), intent(in) :: group
    type(units_type), intent(in) :: units
    type(load_type), intent(inout) :: load
    type(error_type), allocatable, intent(out) :: error
    character(len=11), parameter :: forces(3) = [character(len=11) :: "force", "force_table", "table"]
    character(len=:), allocatable :: type, file, interpolation, usual
    type(load_table_type) :: table
    type(units_type) :: units_of_force
    real(dp) :: area, bore
    integer :: cycles, i, n

    call read(group, load_keys, "type", type, error)
    call read(group, load_keys, "scale", load%scale, error)
    if (allocated(error)) return
    n = count([(has(group, trim(forces(i))), i = 1, 3)])
    if (type == "polytropic") then
      if (n > 0 .or. has(group, "moment")) call input_error(group, "type", "'polytropic' computes the force: remove 'force', " // &
        &   "'moment', 'force_table' and 'table'", error)
      if (.not. allocated(error)) call read_gas(group, units, load, error)
      return
    end if
    if (n > 1) then
      call input_error(group, "", "give only one of 'force', 'force_table' and 'table'", error)
    else if (n == 0 .and. .not. has(group, "moment")) then
      call input_error(group, "", "give 'force', 'moment', 'force_table', 'table' or type='polytropic'", error)
    end if
    if (allocated(error)) return
    if (has(group, "moment")) call read_series(group, "moment", units, load%moment, error)
    if (allocated(error)) return
    units_of_force = units
    if (has(group, "area") .or. has(group, "bore")) units_of_force%of(of_force) = units%of_pressure_times_area
    if (has(group, "force")) call read_series(group, "force", units_of_force, load%force, error)
    if (allocated(error)) return
    if (has(group, "force_table")) then
      n = count_values(group, "force_table")
      allocate(table%values(n))
      call read(group, load_keys, "force_table", table%values, error, units_of_force)
      if (allocated(error)) return
      table%angles = [(2 * pi * i / n, i = 0, n - 1)]
      usual = "fourier"
    else if (has(group, "table")) then
      call read(group, load_keys, "table", file, error)
      call read(group, load_keys, "cycle", cycles, error)
      if (allocated(error)) return
      if (.not. is_absolute(file)) file = group%file(:index(group%file, "/", back=.true.)) // file
      call read_load_table(file, cycles, table, error)
      if (allocated(error)) return
      usual = "spline"
    end if
    if (allocated(table%values)) then
      call read(group, load_keys, "interpolation", interpolation, error, default=usual)
      if (.not. allocated(error)) call represent(group, table, interpolation, load, error)
    else if (has(group, "interpolation") .or. has(group, "harmonics")) then
      call input_error(group, "", "'interpolation' and 'harmonics' apply only to tables and type='polytropic'", error)
    end if
    if (allocated(error)) return
    if (has(group, "area") .or. has(group, "bore")) then
      if (.not. allocated(load%force) .or. has(group, "area") .and. has(group, "bore")) then
        call input_error(group, "", "give either 'area' or 'bore', together with a pressure", error)
      else if (has(group, "table") .and. table%quantity /= pressure_table) then
        call input_error(group, "table", "must give a pressure if 'area' or 'bore' is given", error)
      else if (has(group, "area")) then
        call read(group, load_keys, "area", area, error, units)
      else
        call read(group, load_keys, "bore", bore, error, units)
        area = pi / 4 * bore**2
      end if
      if (allocated(error)) return
      load%force = area * load%force
    else if (table%quantity == pressure_table) then
      call input_error(group, "table", "gives a pressure: add 'area' or 'bore'", error)
    end if
    if (allocated(load%force)) load%force = load%scale * load%force
    if (allocated(load%moment)) load%moment = load%scale * load%moment
  end subroutine read_course

  !> Reads the Fourier coefficients of a force or moment.
  subroutine read_series(group, key, units, values, error)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    type(units_type), intent(in) :: units
    real(dp), allocatable, intent(out) :: values(:)
    type(error_type), allocatable, intent(out) :: error

    allocate(values(count_values(group, key)))
    call read(group, load_keys, key, values, error, units)
    if (allocated(error)) return
    if (modulo(size(values), 2) == 0) call input_error(group, key, &
      & "must have an odd number of values: the mean, then one cosine and one sine coefficient for each order", error)
  end subroutine read_series

  !> Computes the Fourier coefficients of the curve through a table. Fails if the table has too few rows for the orders, or if its
  !> steps are unequal although the interpolation requires equal steps.
  subroutine represent(group, table, interpolation, load, error)
    type(group_type), intent(in) :: group
    type(load_table_type), intent(in) :: table
    character(len=*), intent(in) :: interpolation
    type(load_type), intent(inout) :: load
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: rounding = 1.0e-6_dp
    real(dp), allocatable :: nodes(:), weights(:), values(:)
    integer :: orders, n

    n = size(table%values)
    orders = min(usual_orders, (n - 1) / 2)
    if (has(group, "harmonics")) call read(group, load_keys, "harmonics", orders, error)
    if (allocated(error)) return
    if (orders > (n - 1) / 2) then
      call input_error(group, "harmonics", "the table has " // text(n) // " rows per cycle, which determine at most " &
        & // text((n - 1) / 2) // " orders", error)
    else if (interpolation == "fourier" .and. any(abs(table%angles(2:) - table%angles(:n - 1) - 2 * pi / n) > rounding)) then
      call input_error(group, "interpolation", "'fourier' requires equally spaced angles that divide the cycle", error)
    end if
    if (allocated(error)) return
    if (interpolation == "fourier") then
      nodes = table%angles
      weights = spread(2 * pi / n, 1, n)
      values = table%values
    else
      call quadrature_nodes(table%angles, orders, nodes, weights)
      values = interpolate(table%angles, table%values, nodes, interpolation == "linear")
    end if
    values = trimmed(harmonics_of(values, nodes, weights, orders))
    if (table%quantity == moment_table .and. allocated(load%moment)) then
      call input_error(group, "table", "gives a moment: remove 'moment'", error)
    else if (table%quantity == moment_table) then
      call move_alloc(values, load%moment)
    else
      call move_alloc(values, load%force)
    end if
  end subroutine represent

  !> Reads the data of a polytropic cycle.
  subroutine read_gas(group, units, load, error)
    type(group_type), intent(in) :: group
    type(units_type), intent(in) :: units
    type(load_type), intent(inout) :: load
    type(error_type), allocatable, intent(out) :: error
    character(len=9), parameter :: needed(5) = [character(len=9) :: "joint", "bore", "clearance", "suction", "discharge"]
    integer :: i

    do i = 1, size(needed)
      if (has(group, trim(needed(i)))) cycle
      call input_error(group, "", "type='polytropic' needs the key '" // trim(needed(i)) // "'", error)
      return
    end do
    allocate(load%gas)
    associate (gas => load%gas)
      call read(group, load_keys, "bore", gas%bore, error, units)
      call read(group, load_keys, "clearance", gas%clearance, error)
      call read(group, load_keys, "suction", gas%suction, error, units)
      call read(group, load_keys, "discharge", gas%discharge, error, units)
      call read(group, load_keys, "ambient", gas%ambient, error, units)
      call read(group, load_keys, "exponent", gas%exponent, error)
      gas%orders = usual_orders
      if (has(group, "harmonics")) call read(group, load_keys, "harmonics", gas%orders, error)
      if (allocated(error)) return
      if (.not. gas%discharge > gas%suction) call input_error(group, "discharge", "must exceed 'suction'", error)
    end associate
  end subroutine read_gas

end module gestell_input_machine_loading
