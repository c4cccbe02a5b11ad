!> Chooses the units in which pictures show quantities: those of the report, such as mm, mm/s and mrad.
module gestell_output_picture_axis_unit
  use gestell_base_kinds, only: dp
  use gestell_output_table, only: table_type
  use gestell_output_table_result_units, only: conversion_type, result_units_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: label_with, maximum_in, maximum_of, own_unit, pick_unit, unit_of

  !> Unit in which an axis shows a quantity.
  type, public :: axis_unit_type
    !> Gnuplot expression for the factor that converts a value in a file to this unit
    character(len=4) :: words = "1"
    !> Factor that converts a value from the unit `si` of `pick_unit` to this unit
    real(dp) :: factor = 1
    !> Name of the unit as the axis shows it
    character(len=16) :: name = ""
  end type axis_unit_type

contains

  !> Unit in which a quantity is easy to read if its maximum is `maximum` in SI units. Lengths and rotations, also per second, are
  !> shown in thousandths of the SI unit, and in millionths if they are very small; large angular velocities in rad/s. An unknown
  !> unit is returned unchanged. Results that the input requests in another unit are shown in that unit, as they are in the files.
  pure type(axis_unit_type) function pick_unit(si, maximum, units) result(unit)
    character(len=*), intent(in) :: si
    real(dp), intent(in) :: maximum
    !> Units of the results; SI units by default
    type(result_units_type), intent(in), optional :: units
    type(conversion_type) :: conversion

    if (present(units)) conversion = units%conversion(si)
    if (conversion%words /= "") then
      unit = axis_unit_type(factor=conversion%factor / conversion%divisor, name=conversion%words)
      return
    end if
    unit = axis_unit_type(name=si)
    select case (si)
    case ("m", "rad", "m/s", "rad/s")
      if (si == "rad/s" .and. maximum > 1) return
      if (maximum < 1.0e-4_dp .and. maximum > 0) then
        unit = axis_unit_type("1e6", 1.0e6_dp, "µ" // si)
      else
        unit = axis_unit_type("1e3", 1.0e3_dp, "m" // si)
      end if
    case ("N", "N m", "Nm", "W", "J")
      if (si == "Nm") unit%name = "N m"
      if (maximum >= 1.0e7_dp) then
        unit = axis_unit_type("1e-6", 1.0e-6_dp, "M" // unit%name)
      else if (maximum >= 1.0e4_dp) then
        unit = axis_unit_type("1e-3", 1.0e-3_dp, "k" // unit%name)
      else if (maximum < 0.1_dp .and. maximum > 1.0e-6_dp) then
        unit = axis_unit_type("1e3", 1.0e3_dp, "m" // unit%name)
      end if
    case ("m/s^2")
      unit%name = "m/s²"
    case default ! no prefix
    end select
  end function pick_unit

  !> Unit for a panel that shows these columns of a table, which have the same unit. It is chosen by the largest value in any column
  !> of the table with this unit, so that all panels of a picture have the same unit.
  pure function unit_of(table, columns) result(unit)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: columns(:)
    type(axis_unit_type) :: unit

    if (size(columns) == 0) return
    associate (own => table%columns(table%number_of(columns(1)))%unit%words)
      unit = pick_unit(trim(own), maximum_in(table, trim(own)))
    end associate
  end function unit_of

  !> Unit for a panel that shows one column of a table, chosen by the largest value in this column.
  pure type(axis_unit_type) function own_unit(table, name) result(unit)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: name

    unit = pick_unit(trim(table%columns(table%number_of(name))%unit%words), maximum_of(table, [name]))
  end function own_unit

  !> Maximum absolute value in all columns of a table with this unit; infinite and missing values are ignored.
  pure real(dp) function maximum_in(table, words) result(maximum)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: words
    integer :: i

    maximum = 0
    do i = 1, size(table%columns)
      associate (column => table%columns(i))
        if (column%unit%words == words .and. allocated(column%numbers)) maximum = max(maximum, maxval(abs(column%numbers), &
          & mask=ieee_is_finite(column%numbers)))
      end associate
    end do
  end function maximum_in

  !> Maximum absolute value in these columns of a table, in the unit of the table; infinite and missing values are ignored.
  pure real(dp) function maximum_of(table, columns) result(maximum)
    type(table_type), intent(in) :: table
    character(len=*), intent(in) :: columns(:)
    integer :: i

    maximum = 0
    do i = 1, size(columns)
      associate (values => table%columns(table%number_of(columns(i)))%numbers)
        maximum = max(maximum, maxval(abs(values), mask=ieee_is_finite(values)))
      end associate
    end do
  end function maximum_of

  !> Label of an axis: name and unit, for example "ξ (mm)".
  pure function label_with(name, unit) result(label)
    character(len=*), intent(in) :: name
    type(axis_unit_type), intent(in) :: unit
    character(len=:), allocatable :: label

    label = trim(name)
    if (unit%name /= "") label = label // " (" // trim(unit%name) // ")"
  end function label_with

end module gestell_output_picture_axis_unit
