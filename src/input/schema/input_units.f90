!> In what unit a key of the input is typed.
module gestell_input_schema_input_units
  use gestell_input_schema_units, only: units_type
  implicit none (type, external)
  private

  public :: element_unit, input_unit

contains

  !> The unit of a key as a text, empty for numbers without one.
  pure function input_unit(group, key, units) result(unit)
    character(len=*), intent(in) :: group, key
    type(units_type), intent(in) :: units
    character(len=:), allocatable :: unit

    select case (group // " " // key)
    case ("joint position", "joint radius", "joint lengths", "joint guide_point", "joint guide2_point", "joint offset", &
      & "link center", "frame origin", "support position", "probe position")
      unit = trim(units%length%name)
    case ("joint phase", "joint guide_angle", "joint guide2_angle", "joint slot_angle", "support angle", &
      & "gravity direction")
      unit = trim(units%angle%name)
    case ("link mass", "frame mass")
      unit = trim(units%mass%name)
    case ("link inertia", "frame inertia", "drive flywheel_inertia")
      unit = trim(units%inertia%name)
    case ("support stiffness")
      unit = trim(units%stiffness%name)
    case ("support damping")
      unit = trim(units%damping%name)
    case ("foundation stiffness")
      unit = in_turn(units%stiffness%name, units%force%name, units%moment%name)
    case ("foundation damping")
      unit = in_turn(units%damping%name, units%damping%name, units%rotary_damping%name)
    case ("gravity acceleration")
      unit = "m/s^2"
    case ("drive speed_rpm")
      unit = "1/min"
    case ("mass_functions mass")
      unit = "kg"
    case ("mass_functions a1", "mass_functions a2")
      unit = "kg m"
    case ("mass_functions inertia", "mass_functions a3", "mass_functions moment", "mass_functions energy")
      unit = "kg m^2"
    case ("probe limit_mm_s")
      unit = "mm/s"
    case ("probe band_hz")
      unit = "Hz"
    case default
      unit = ""
    end select
  end function input_unit

  !> The unit of one of a key's numbers, by its place; `element` 0: of all of them, empty where they have not the same.
  pure function element_unit(group, key, element, units) result(unit)
    character(len=*), intent(in) :: group, key
    integer, intent(in) :: element
    type(units_type), intent(in) :: units
    character(len=:), allocatable :: unit

    select case (group // " " // key)
    case ("foundation stiffness")
      select case (element)
      case (1, 2, 4, 5)
        unit = trim(units%stiffness%name)
      case (3, 6, 7, 8)
        unit = trim(units%force%name)
      case (9)
        unit = trim(units%moment%name)
      case default
        unit = ""
      end select
    case ("foundation damping")
      select case (element)
      case (1, 2)
        unit = trim(units%damping%name)
      case (3)
        unit = trim(units%rotary_damping%name)
      case default
        unit = ""
      end select
    case default
      unit = input_unit(group, key, units)
    end select
  end function element_unit

  !> Several units; those that are not set are SI.
  pure function in_turn(first, second, third) result(unit)
    character(len=*), intent(in) :: first, second, third
    character(len=:), allocatable :: unit

    unit = trim(first) // ", " // trim(second) // ", " // trim(third)
  end function in_turn

end module gestell_input_schema_input_units
