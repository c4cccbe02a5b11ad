!> Units that data can be typed in; everything behind the reader is SI and rad.
module gestell_input_schema_units
  use gestell_base_key, only: key_type, of_angle, of_damping, of_damping_diagonal, of_force, of_inertia, of_length, of_mass, &
    & of_moment, of_rotary_damping, of_stiffness, of_stiffness_matrix, quantities
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: find_unit, unit_names, unit_symbol

  !> Value in SI = value * factor / divisor. Both are whole numbers where the unit allows it: 7 cm become the number that
  !> 0.07 stands for, to the last bit.
  type, public :: unit_type
    character(len=12) :: name = ""
    real(dp) :: factor = 1, divisor = 1
  contains
    procedure :: si
  end type unit_type

  !> The units in use, by quantity.
  type, public :: units_type
    type(unit_type) :: of(quantities) = [unit_type("m"), unit_type("kg"), unit_type("kg m^2"), unit_type("N/m"), unit_type("N"), &
      & unit_type("N m"), unit_type("N s/m"), unit_type("N m s"), unit_type("deg", pi, 180.0_dp)]
  contains
    procedure :: to_si
  end type units_type

  type(units_type), parameter, public :: usual_units = units_type()

  !> The keys of &units, by quantity.
  character(len=14), parameter, public :: quantity_names(quantities) = [character(len=14) :: "length", "mass", "inertia", &
    & "stiffness", "force", "moment", "damping", "rotary_damping", "angle"]

  !> Which degrees of freedom of a frame turn it, in its order; the quantities of a stiffness matrix in Fortran's order, and of the
  !> diagonal of a damping matrix.
  logical, parameter :: turns(6) = [.false., .false., .true., .false., .true., .true.]
  integer :: i, j
  integer, parameter :: stiffness_matrix(36) = [((of_stiffness + count([turns(i), turns(j)]), i = 1, 6), j = 1, 6)]
  integer, parameter :: damping_diagonal(6) = [(merge(of_rotary_damping, of_damping, turns(i)), i = 1, 6)]

  !> A unit of a quantity. 1 kp = 9.80665 N.
  type :: entry_type
    integer :: quantity
    type(unit_type) :: unit
  end type entry_type

  type(entry_type), parameter :: table(*) = [ &
    & entry_type(of_length, unit_type("m")), &
    & entry_type(of_length, unit_type("cm", 1.0_dp, 100.0_dp)), &
    & entry_type(of_length, unit_type("mm", 1.0_dp, 1000.0_dp)), &
    & entry_type(of_length, unit_type("in", 254.0_dp, 10000.0_dp)), &
    & entry_type(of_mass, unit_type("kg")), &
    & entry_type(of_mass, unit_type("g", 1.0_dp, 1000.0_dp)), &
    & entry_type(of_mass, unit_type("t", 1000.0_dp)), &
    & entry_type(of_mass, unit_type("kp s^2/m", 980665.0_dp, 100000.0_dp)), &
    & entry_type(of_inertia, unit_type("kg m^2")), &
    & entry_type(of_inertia, unit_type("kg cm^2", 1.0_dp, 10000.0_dp)), &
    & entry_type(of_inertia, unit_type("kg mm^2", 1.0_dp, 1000000.0_dp)), &
    & entry_type(of_inertia, unit_type("g cm^2", 1.0_dp, 10000000.0_dp)), &
    & entry_type(of_inertia, unit_type("t m^2", 1000.0_dp)), &
    & entry_type(of_inertia, unit_type("kp cm s^2", 980665.0_dp, 10000000.0_dp)), &
    & entry_type(of_stiffness, unit_type("N/m")), &
    & entry_type(of_stiffness, unit_type("N/cm", 100.0_dp)), &
    & entry_type(of_stiffness, unit_type("N/mm", 1000.0_dp)), &
    & entry_type(of_stiffness, unit_type("kN/m", 1000.0_dp)), &
    & entry_type(of_stiffness, unit_type("kN/mm", 1000000.0_dp)), &
    & entry_type(of_stiffness, unit_type("MN/m", 1000000.0_dp)), &
    & entry_type(of_stiffness, unit_type("kp/m", 980665.0_dp, 100000.0_dp)), &
    & entry_type(of_stiffness, unit_type("kp/cm", 980665.0_dp, 1000.0_dp)), &
    & entry_type(of_stiffness, unit_type("kp/mm", 980665.0_dp, 100.0_dp)), &
    & entry_type(of_force, unit_type("N")), &
    & entry_type(of_force, unit_type("kN", 1000.0_dp)), &
    & entry_type(of_force, unit_type("kp", 980665.0_dp, 100000.0_dp)), &
    & entry_type(of_moment, unit_type("N m")), &
    & entry_type(of_moment, unit_type("N cm", 1.0_dp, 100.0_dp)), &
    & entry_type(of_moment, unit_type("N mm", 1.0_dp, 1000.0_dp)), &
    & entry_type(of_moment, unit_type("kN m", 1000.0_dp)), &
    & entry_type(of_moment, unit_type("kp m", 980665.0_dp, 100000.0_dp)), &
    & entry_type(of_moment, unit_type("kp cm", 980665.0_dp, 10000000.0_dp)), &
    & entry_type(of_damping, unit_type("N s/m")), &
    & entry_type(of_damping, unit_type("kg/s")), &
    & entry_type(of_damping, unit_type("N s/cm", 100.0_dp)), &
    & entry_type(of_damping, unit_type("N s/mm", 1000.0_dp)), &
    & entry_type(of_damping, unit_type("kN s/m", 1000.0_dp)), &
    & entry_type(of_damping, unit_type("kp s/m", 980665.0_dp, 100000.0_dp)), &
    & entry_type(of_damping, unit_type("kp s/cm", 980665.0_dp, 1000.0_dp)), &
    & entry_type(of_rotary_damping, unit_type("N m s")), &
    & entry_type(of_rotary_damping, unit_type("kg m^2/s")), &
    & entry_type(of_rotary_damping, unit_type("N mm s", 1.0_dp, 1000.0_dp)), &
    & entry_type(of_rotary_damping, unit_type("kN m s", 1000.0_dp)), &
    & entry_type(of_rotary_damping, unit_type("kp m s", 980665.0_dp, 100000.0_dp)), &
    & entry_type(of_rotary_damping, unit_type("kp cm s", 980665.0_dp, 10000000.0_dp)), &
    & entry_type(of_angle, unit_type("deg", pi, 180.0_dp)), &
    & entry_type(of_angle, unit_type("rad"))]

contains

  !> A value in SI.
  elemental real(dp) function si(self, value)
    class(unit_type), intent(in) :: self
    real(dp), intent(in) :: value

    si = value * self%factor / self%divisor
  end function si

  !> The number that a key's `element` stands for, from what is typed.
  pure real(dp) function to_si(self, key, element, typed)
    class(units_type), intent(in) :: self
    type(key_type), intent(in) :: key
    integer, intent(in) :: element
    real(dp), intent(in) :: typed
    integer :: quantity

    quantity = quantity_of(key, element)
    to_si = typed
    if (quantity > 0) to_si = self%of(quantity)%si(typed)
  end function to_si

  !> The quantity of one of a key's numbers, 0 where &units does not name its unit.
  pure integer function quantity_of(key, element) result(quantity)
    type(key_type), intent(in) :: key
    integer, intent(in) :: element

    quantity = key%unit
    if (key%unit == of_stiffness_matrix) quantity = stiffness_matrix(element)
    if (key%unit == of_damping_diagonal) quantity = damping_diagonal(element)
  end function quantity_of

  !> The unit in which a key's `element` is typed, empty for numbers without one; `element` 0: of all of them, empty where they
  !> have not the same, or with `in_turn` the different ones.
  pure function unit_symbol(key, element, units, in_turn) result(symbol)
    type(key_type), intent(in) :: key
    integer, intent(in) :: element
    type(units_type), intent(in) :: units
    logical, intent(in), optional :: in_turn
    character(len=:), allocatable :: symbol
    integer :: quantity

    symbol = trim(key%symbol)
    quantity = key%unit
    if (element > 0) quantity = quantity_of(key, element)
    if (quantity >= 1 .and. quantity <= quantities) symbol = trim(units%of(quantity)%name)
    if (quantity <= quantities .or. .not. present(in_turn)) return
    symbol = trim(units%of(of_stiffness)%name) // ", " // trim(units%of(of_force)%name) // ", " // trim(units%of(of_moment)%name)
    if (quantity == of_damping_diagonal) symbol = trim(units%of(of_damping)%name) // ", " // trim(units%of(of_damping)%name) &
      & // ", " // trim(units%of(of_rotary_damping)%name)
  end function unit_symbol

  !> The names of a quantity's units, SI first (for angles: deg).
  pure function unit_names(quantity) result(names)
    integer, intent(in) :: quantity
    character(len=12), allocatable :: names(:)

    allocate(names, source=pack(table%unit%name, table%quantity == quantity))
  end function unit_names

  !> The unit of that name.
  pure type(unit_type) function find_unit(quantity, name)
    integer, intent(in) :: quantity
    character(len=*), intent(in) :: name
    integer :: i

    do i = 1, size(table)
      if (table(i)%quantity == quantity .and. table(i)%unit%name == name) find_unit = table(i)%unit
    end do
  end function find_unit

end module gestell_input_schema_units
