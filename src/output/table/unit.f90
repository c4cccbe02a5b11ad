!> Defines units of table columns, both as a suffix of the column's key and in words.
module gestell_output_table_unit
  implicit none (type, external)
  private

  public :: new_unit

  !> A unit of a column. The key of the column ends with "_" and `suffix`, as in speed_rpm; reports and pictures show `words`.
  type, public :: unit_type
    character(len=16) :: suffix = "", words = ""
    !> True if the unit differs from row to row: the column "unit" of the table contains it
    logical :: by_row = .false.
  end type unit_type

  !> Unit of numbers whose unit the column "unit" of the table contains.
  type(unit_type), parameter, public :: unit_of_row = unit_type(by_row=.true.)

  type(unit_type), parameter, public :: plain = unit_type(), metre = unit_type("m", "m"), mm_per_s = unit_type("mm_s", "mm/s"), &
    & radian = unit_type("rad", "rad"), degree = unit_type("deg", "deg"), second = unit_type("s", "s"), &
    & hertz = unit_type("Hz", "Hz"), per_second = unit_type("1_per_s", "1/s"), &
    & newton = unit_type("N", "N"), newton_metre = unit_type("Nm", "N m"), joule = unit_type("J", "J"), &
    & watt = unit_type("W", "W"), rpm = unit_type("rpm", "rpm"), metre_per_s = unit_type("m_s", "m/s"), &
    & metre_per_s2 = unit_type("m_s2", "m/s^2"), radian_per_s = unit_type("rad_s", "rad/s"), &
    & kilogram_metre = unit_type("kg_m", "kg m"), percent = unit_type("percent", "%")

contains

  !> Unit that `words` names. Its suffix is derived from `words`: m/s^2 becomes m_s2.
  pure type(unit_type) function new_unit(words) result(unit)
    character(len=*), intent(in) :: words
    integer :: i, n

    unit%words = words
    n = 0
    do i = 1, len_trim(words)
      if (scan(words(i:i), "^ ") > 0) cycle
      n = n + 1
      unit%suffix(n:n) = merge("_", words(i:i), words(i:i) == "/")
    end do
  end function new_unit

end module gestell_output_table_unit
