!> Converts input values between the units of the input and SI units. The rest of the library uses only SI units and rad.
module gestell_input_schema_units
  use gestell_base_key, only: key_type, of_acceleration, of_angle, of_area, of_damping, of_damping_diagonal, of_force, &
    & of_inertia, of_length, of_mass, of_moment, of_pressure, of_rotary_damping, of_stiffness, of_stiffness_matrix, quantities
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: find_unit, unit_names, unit_symbol

  !> A unit of the input. A value in SI units equals the input value times `factor`, divided by `divisor`. Both are whole numbers
  !> where possible, so that 7 cm and 0.07 m yield exactly the same number.
  type, public :: unit_type
    !> Code of the quantity that the unit measures (`of_length`, ...)
    integer :: quantity = 0
    character(len=12) :: name = ""
    real(dp) :: factor = 1, divisor = 1
  end type unit_type

  !> For each quantity: the unit in which the input gives it
  type, public :: units_type
    type(unit_type) :: of(quantities) = [unit_type(of_length, "m"), unit_type(of_mass, "kg"), unit_type(of_inertia, "kg m^2"), &
      & unit_type(of_stiffness, "N/m"), unit_type(of_force, "N"), unit_type(of_moment, "N m"), unit_type(of_damping, "N s/m"), &
      & unit_type(of_rotary_damping, "N m s"), unit_type(of_angle, "deg", pi, 180.0_dp), &
      & unit_type(of_pressure, "bar", 100000.0_dp), unit_type(of_area, "m^2"), unit_type(of_acceleration, "m/s^2")]
    !> Unit of the pressures that &load multiplies by an area: Pa, unless the input gives the unit of pressures
    type(unit_type) :: of_pressure_times_area = unit_type(of_pressure, "Pa")
  contains
    procedure :: to_si
  end type units_type

  !> Units of an input without the group &units: SI units, but deg for angles and bar for pressures.
  type(units_type), parameter, public :: usual_units = units_type()

  !> Names of the keys of the group &units. Each key sets the unit of one quantity.
  character(len=14), parameter, public :: quantity_names(quantities) = [character(len=14) :: "length", "mass", "inertia", &
    & "stiffness", "force", "moment", "damping", "rotary_damping", "angle", "pressure", "area", "acceleration"]

  !> Quantities whose unit in the results the input can choose.
  integer, parameter, public :: of_results(5) = [of_length, of_mass, of_inertia, of_force, of_moment]

  !> For each degree of freedom of a frame: true if it is a rotation.
  logical, parameter :: is_rotation(6) = [.false., .false., .true., .false., .true., .true.]
  !> Indices for the implied do loops in the constants below.
  integer :: i, j
  !> For each element of a stiffness matrix, column by column: code of its quantity.
  integer, parameter :: stiffness_matrix(36) = [((of_stiffness + count([is_rotation(i), is_rotation(j)]), i = 1, 6), j = 1, 6)]
  !> For each diagonal element of a damping matrix: code of its quantity.
  integer, parameter :: damping_diagonal(6) = [(merge(of_rotary_damping, of_damping, is_rotation(i)), i = 1, 6)]

  !> Numerators and denominators of the force of 1 lb under standard gravity, 0.45359237 kg x 9.80665 m/s^2, in N, and of its moment
  !> at 1 in and at 1 ft (N m). All are whole numbers below 2^53, which are exact in double precision.
  real(dp), parameter :: lbf(2) = [44482216152605.0_dp, 1.0e13_dp], lbf_in(2) = [1129848290276167.0_dp, 1.0e16_dp], &
    & lbf_ft(2) = [3389544870828501.0_dp, 2.5e15_dp]
  !> Pound (1e-8 kg), square inch and square foot (1e-8 m^2)
  real(dp), parameter :: lb = 45359237, in2 = 64516, ft2 = 9290304

  !> All units. The factors are exact: 1 in = 25.4 mm, 1 ft = 12 in, 1 lb = 0.45359237 kg, and standard gravity 9.80665 m/s^2, which
  !> defines kp, lbf, slug (lbf s^2/ft) and g. Source: A. Thompson, B. N. Taylor, NIST Special Publication 811 (2008), Appendix B.
  type(unit_type), parameter :: table(*) = [ &
    & unit_type(of_length, "m"), &
    & unit_type(of_length, "cm", 1.0_dp, 100.0_dp), &
    & unit_type(of_length, "mm", 1.0_dp, 1000.0_dp), &
    & unit_type(of_length, "in", 254.0_dp, 10000.0_dp), &
    & unit_type(of_length, "ft", 3048.0_dp, 10000.0_dp), &
    & unit_type(of_mass, "kg"), &
    & unit_type(of_mass, "g", 1.0_dp, 1000.0_dp), &
    & unit_type(of_mass, "t", 1000.0_dp), &
    & unit_type(of_mass, "kp s^2/m", 980665.0_dp, 100000.0_dp), &
    & unit_type(of_mass, "lb", lb, 1.0e8_dp), &
    & unit_type(of_mass, "slug", lbf(1), 3048.0e9_dp), &
    & unit_type(of_mass, "lbf s^2/in", lbf(1), 254.0e9_dp), &
    & unit_type(of_inertia, "kg m^2"), &
    & unit_type(of_inertia, "kg cm^2", 1.0_dp, 10000.0_dp), &
    & unit_type(of_inertia, "kg mm^2", 1.0_dp, 1000000.0_dp), &
    & unit_type(of_inertia, "g cm^2", 1.0_dp, 10000000.0_dp), &
    & unit_type(of_inertia, "t m^2", 1000.0_dp), &
    & unit_type(of_inertia, "kp cm s^2", 980665.0_dp, 10000000.0_dp), &
    & unit_type(of_inertia, "lb in^2", lb * in2, 1.0e16_dp), &
    & unit_type(of_inertia, "lb ft^2", lb * ft2, 1.0e16_dp), &
    & unit_type(of_inertia, "slug ft^2", lbf_ft(1), lbf_ft(2)), &
    & unit_type(of_inertia, "lbf in s^2", lbf_in(1), lbf_in(2)), &
    & unit_type(of_stiffness, "N/m"), &
    & unit_type(of_stiffness, "N/cm", 100.0_dp), &
    & unit_type(of_stiffness, "N/mm", 1000.0_dp), &
    & unit_type(of_stiffness, "kN/m", 1000.0_dp), &
    & unit_type(of_stiffness, "kN/mm", 1000000.0_dp), &
    & unit_type(of_stiffness, "MN/m", 1000000.0_dp), &
    & unit_type(of_stiffness, "kp/m", 980665.0_dp, 100000.0_dp), &
    & unit_type(of_stiffness, "kp/cm", 980665.0_dp, 1000.0_dp), &
    & unit_type(of_stiffness, "kp/mm", 980665.0_dp, 100.0_dp), &
    & unit_type(of_stiffness, "lbf/in", lbf(1), 254.0e9_dp), &
    & unit_type(of_stiffness, "lbf/ft", lbf(1), 3048.0e9_dp), &
    & unit_type(of_force, "N"), &
    & unit_type(of_force, "kN", 1000.0_dp), &
    & unit_type(of_force, "kp", 980665.0_dp, 100000.0_dp), &
    & unit_type(of_force, "lbf", lbf(1), lbf(2)), &
    & unit_type(of_force, "kip", lbf(1), 1.0e10_dp), &
    & unit_type(of_moment, "N m"), &
    & unit_type(of_moment, "N cm", 1.0_dp, 100.0_dp), &
    & unit_type(of_moment, "N mm", 1.0_dp, 1000.0_dp), &
    & unit_type(of_moment, "kN m", 1000.0_dp), &
    & unit_type(of_moment, "kp m", 980665.0_dp, 100000.0_dp), &
    & unit_type(of_moment, "kp cm", 980665.0_dp, 10000000.0_dp), &
    & unit_type(of_moment, "lbf in", lbf_in(1), lbf_in(2)), &
    & unit_type(of_moment, "lbf ft", lbf_ft(1), lbf_ft(2)), &
    & unit_type(of_damping, "N s/m"), &
    & unit_type(of_damping, "kg/s"), &
    & unit_type(of_damping, "N s/cm", 100.0_dp), &
    & unit_type(of_damping, "N s/mm", 1000.0_dp), &
    & unit_type(of_damping, "kN s/m", 1000.0_dp), &
    & unit_type(of_damping, "kp s/m", 980665.0_dp, 100000.0_dp), &
    & unit_type(of_damping, "kp s/cm", 980665.0_dp, 1000.0_dp), &
    & unit_type(of_damping, "lbf s/in", lbf(1), 254.0e9_dp), &
    & unit_type(of_damping, "lbf s/ft", lbf(1), 3048.0e9_dp), &
    & unit_type(of_rotary_damping, "N m s"), &
    & unit_type(of_rotary_damping, "kg m^2/s"), &
    & unit_type(of_rotary_damping, "N mm s", 1.0_dp, 1000.0_dp), &
    & unit_type(of_rotary_damping, "kN m s", 1000.0_dp), &
    & unit_type(of_rotary_damping, "kp m s", 980665.0_dp, 100000.0_dp), &
    & unit_type(of_rotary_damping, "kp cm s", 980665.0_dp, 10000000.0_dp), &
    & unit_type(of_rotary_damping, "lbf in s", lbf_in(1), lbf_in(2)), &
    & unit_type(of_rotary_damping, "lbf ft s", lbf_ft(1), lbf_ft(2)), &
    & unit_type(of_angle, "deg", pi, 180.0_dp), &
    & unit_type(of_angle, "rad"), &
    & unit_type(of_pressure, "bar", 100000.0_dp), &
    & unit_type(of_pressure, "Pa"), &
    & unit_type(of_pressure, "kPa", 1000.0_dp), &
    & unit_type(of_pressure, "MPa", 1000000.0_dp), &
    & unit_type(of_pressure, "kp/cm^2", 980665.0_dp, 10.0_dp), &
    & unit_type(of_pressure, "psi", lbf(1), in2 * 1.0e5_dp), &
    & unit_type(of_area, "m^2"), &
    & unit_type(of_area, "cm^2", 1.0_dp, 10000.0_dp), &
    & unit_type(of_area, "mm^2", 1.0_dp, 1000000.0_dp), &
    & unit_type(of_area, "in^2", in2, 1.0e8_dp), &
    & unit_type(of_area, "ft^2", ft2, 1.0e8_dp), &
    & unit_type(of_acceleration, "m/s^2"), &
    & unit_type(of_acceleration, "cm/s^2", 1.0_dp, 100.0_dp), &
    & unit_type(of_acceleration, "mm/s^2", 1.0_dp, 1000.0_dp), &
    & unit_type(of_acceleration, "in/s^2", 254.0_dp, 10000.0_dp), &
    & unit_type(of_acceleration, "ft/s^2", 3048.0_dp, 10000.0_dp), &
    & unit_type(of_acceleration, "g", 980665.0_dp, 100000.0_dp)]

contains

  !> Converts the number `typed`, which is element `element` of a key's values, to SI units.
  pure real(dp) function to_si(self, key, element, typed)
    class(units_type), intent(in) :: self
    type(key_type), intent(in) :: key
    integer, intent(in) :: element
    real(dp), intent(in) :: typed
    integer :: quantity

    quantity = quantity_of(key, element)
    to_si = typed
    if (quantity > 0) to_si = typed * self%of(quantity)%factor / self%of(quantity)%divisor
  end function to_si

  !> Code of the quantity of an element of a key's values; 0 if &units sets no unit for it.
  pure integer function quantity_of(key, element) result(quantity)
    type(key_type), intent(in) :: key
    integer, intent(in) :: element

    quantity = key%unit
    if (key%unit == of_stiffness_matrix) quantity = stiffness_matrix(element)
    if (key%unit == of_damping_diagonal) quantity = damping_diagonal(element)
  end function quantity_of

  !> Symbol of the unit of an element of a key's values; empty if the element has no unit. If `element` is 0, the symbol applies
  !> to all elements. If their units differ, the symbol is then empty or, with `as_list`, a list of the units.
  pure character(len=40) function unit_symbol(key, element, units, as_list) result(symbol)
    type(key_type), intent(in) :: key
    integer, intent(in) :: element
    type(units_type), intent(in) :: units
    logical, intent(in), optional :: as_list
    integer :: quantity

    symbol = key%symbol
    quantity = key%unit
    if (element > 0) quantity = quantity_of(key, element)
    if (quantity >= 1 .and. quantity <= quantities) symbol = units%of(quantity)%name
    if (quantity <= quantities .or. .not. present(as_list)) return
    symbol = trim(units%of(of_stiffness)%name) // ", " // trim(units%of(of_force)%name) // ", " // trim(units%of(of_moment)%name)
    if (quantity == of_damping_diagonal) symbol = trim(units%of(of_damping)%name) // ", " // trim(units%of(of_damping)%name) &
      & // ", " // trim(units%of(of_rotary_damping)%name)
  end function unit_symbol

  !> Names of the units in which a quantity can be given. The first one is the SI unit (deg for angles, bar for pressures).
  pure function unit_names(quantity) result(names)
    integer, intent(in) :: quantity
    character(len=12), allocatable :: names(:)

    allocate(names, source=pack(table%name, table%quantity == quantity))
  end function unit_names

  !> Unit called `name` of the quantity with the code `quantity`.
  pure type(unit_type) function find_unit(quantity, name)
    integer, intent(in) :: quantity
    character(len=*), intent(in) :: name

    find_unit = table(findloc(table%quantity == quantity .and. table%name == name, .true., dim=1))
  end function find_unit

end module gestell_input_schema_units
