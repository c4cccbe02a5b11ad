!> Units that data can be typed in; everything behind the reader is SI and rad.
module gestell_input_schema_units
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: find_unit, unit_names

  !> Value in SI = value * factor / divisor. Both are whole numbers where the unit allows it: 7 cm become the number that
  !> 0.07 stands for, to the last bit.
  type, public :: unit_type
    character(len=12) :: name = ""
    real(dp) :: factor = 1, divisor = 1
  contains
    procedure :: si
  end type unit_type

  !> The units in use.
  type, public :: units_type
    type(unit_type) :: length, mass, inertia, stiffness, force, moment, damping, rotary_damping
    type(unit_type) :: angle = unit_type("deg", pi, 180.0_dp)
  end type units_type

  !> A unit of a quantity, as in `units_type`. 1 kp = 9.80665 N.
  type :: entry_type
    character(len=14) :: quantity
    type(unit_type) :: unit
  end type entry_type

  type(entry_type), parameter :: table(*) = [ &
    & entry_type("length", unit_type("m")), &
    & entry_type("length", unit_type("cm", 1.0_dp, 100.0_dp)), &
    & entry_type("length", unit_type("mm", 1.0_dp, 1000.0_dp)), &
    & entry_type("length", unit_type("in", 254.0_dp, 10000.0_dp)), &
    & entry_type("mass", unit_type("kg")), &
    & entry_type("mass", unit_type("g", 1.0_dp, 1000.0_dp)), &
    & entry_type("mass", unit_type("t", 1000.0_dp)), &
    & entry_type("mass", unit_type("kp s^2/m", 980665.0_dp, 100000.0_dp)), &
    & entry_type("inertia", unit_type("kg m^2")), &
    & entry_type("inertia", unit_type("kg cm^2", 1.0_dp, 10000.0_dp)), &
    & entry_type("inertia", unit_type("kg mm^2", 1.0_dp, 1000000.0_dp)), &
    & entry_type("inertia", unit_type("g cm^2", 1.0_dp, 10000000.0_dp)), &
    & entry_type("inertia", unit_type("t m^2", 1000.0_dp)), &
    & entry_type("inertia", unit_type("kp cm s^2", 980665.0_dp, 10000000.0_dp)), &
    & entry_type("stiffness", unit_type("N/m")), &
    & entry_type("stiffness", unit_type("N/cm", 100.0_dp)), &
    & entry_type("stiffness", unit_type("N/mm", 1000.0_dp)), &
    & entry_type("stiffness", unit_type("kN/m", 1000.0_dp)), &
    & entry_type("stiffness", unit_type("kN/mm", 1000000.0_dp)), &
    & entry_type("stiffness", unit_type("MN/m", 1000000.0_dp)), &
    & entry_type("stiffness", unit_type("kp/m", 980665.0_dp, 100000.0_dp)), &
    & entry_type("stiffness", unit_type("kp/cm", 980665.0_dp, 1000.0_dp)), &
    & entry_type("stiffness", unit_type("kp/mm", 980665.0_dp, 100.0_dp)), &
    & entry_type("force", unit_type("N")), &
    & entry_type("force", unit_type("kN", 1000.0_dp)), &
    & entry_type("force", unit_type("kp", 980665.0_dp, 100000.0_dp)), &
    & entry_type("moment", unit_type("N m")), &
    & entry_type("moment", unit_type("N cm", 1.0_dp, 100.0_dp)), &
    & entry_type("moment", unit_type("N mm", 1.0_dp, 1000.0_dp)), &
    & entry_type("moment", unit_type("kN m", 1000.0_dp)), &
    & entry_type("moment", unit_type("kp m", 980665.0_dp, 100000.0_dp)), &
    & entry_type("moment", unit_type("kp cm", 980665.0_dp, 10000000.0_dp)), &
    & entry_type("damping", unit_type("N s/m")), &
    & entry_type("damping", unit_type("kg/s")), &
    & entry_type("damping", unit_type("N s/cm", 100.0_dp)), &
    & entry_type("damping", unit_type("N s/mm", 1000.0_dp)), &
    & entry_type("damping", unit_type("kN s/m", 1000.0_dp)), &
    & entry_type("damping", unit_type("kp s/m", 980665.0_dp, 100000.0_dp)), &
    & entry_type("damping", unit_type("kp s/cm", 980665.0_dp, 1000.0_dp)), &
    & entry_type("rotary_damping", unit_type("N m s")), &
    & entry_type("rotary_damping", unit_type("kg m^2/s")), &
    & entry_type("rotary_damping", unit_type("N mm s", 1.0_dp, 1000.0_dp)), &
    & entry_type("rotary_damping", unit_type("kN m s", 1000.0_dp)), &
    & entry_type("rotary_damping", unit_type("kp m s", 980665.0_dp, 100000.0_dp)), &
    & entry_type("rotary_damping", unit_type("kp cm s", 980665.0_dp, 10000000.0_dp)), &
    & entry_type("angle", unit_type("deg", pi, 180.0_dp)), &
    & entry_type("angle", unit_type("rad"))]

contains

  !> A value in SI.
  elemental real(dp) function si(self, value)
    class(unit_type), intent(in) :: self
    real(dp), intent(in) :: value

    si = value * self%factor / self%divisor
  end function si

  !> The names of a quantity's units, SI first (for angles: deg).
  pure function unit_names(quantity) result(names)
    character(len=*), intent(in) :: quantity
    character(len=12), allocatable :: names(:)

    allocate(names, source=pack(table%unit%name, table%quantity == quantity))
  end function unit_names

  !> The unit of that name.
  pure type(unit_type) function find_unit(quantity, name)
    character(len=*), intent(in) :: quantity, name
    integer :: i

    do i = 1, size(table)
      if (table(i)%quantity == quantity .and. table(i)%unit%name == name) find_unit = table(i)%unit
    end do
  end function find_unit

end module gestell_input_schema_units
