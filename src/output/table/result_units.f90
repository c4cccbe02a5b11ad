!> Converts results from SI units to the units that the input requests by `&units results`.
module gestell_output_table_result_units
  use gestell_base_key, only: of_force, of_inertia, of_length, of_mass, of_moment
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline
  use gestell_input_schema_units, only: unit_type, units_type, usual_units
  implicit none (type, external)
  private

  !> How the results of one unit are converted: a result in the new unit is its value in the old one, times `factor`, divided by
  !> `divisor`.
  type, public :: conversion_type
    !> The new unit; empty if results of the old unit are not converted
    character(len=16) :: words = ""
    !> Both are whole numbers where possible, so that the result has the fewest rounding errors.
    real(dp) :: factor = 1, divisor = 1
  contains
    procedure :: converted, original
  end type conversion_type

  !> The units of the results.
  type, public :: result_units_type
    !> For each quantity of the input: the unit of results. Only the units `of_results` differ from SI units
    type(units_type) :: units = usual_units
    !> Names in the input that contain digits, each after a newline and before the next: text in them is not converted
    character(len=:), allocatable :: names
  contains
    procedure :: amount, are_si, conversion, is_in_name
  end type result_units_type

  !> A unit in which results are computed: its quantity, its value in SI units as `factor`/`divisor`, and the rest of the words of
  !> the new unit behind that of the quantity.
  type :: computed_type
    character(len=5) :: words
    integer :: quantity
    real(dp) :: factor = 1, divisor = 1
    character(len=4) :: rest = ""
  end type computed_type

  type(computed_type), parameter :: computed(*) = [computed_type("m", of_length), &
    & computed_type("mm", of_length, divisor=1.0e3_dp), &
    & computed_type("m/s", of_length, rest="/s"), computed_type("mm/s", of_length, divisor=1.0e3_dp, rest="/s"), &
    & computed_type("m/s^2", of_length, rest="/s^2"), computed_type("N", of_force), computed_type("kN", of_force, 1.0e3_dp), &
    & computed_type("N m", of_moment), computed_type("Nm", of_moment), computed_type("kN m", of_moment, 1.0e3_dp), &
    & computed_type("kg", of_mass)]

contains

  !> The conversion of results whose unit is `words`. Units of other quantities, such as W or Hz, are not converted, nor are those
  !> of quantities for which the input requests SI units.
  elemental type(conversion_type) function conversion(self, words)
    class(result_units_type), intent(in) :: self
    character(len=*), intent(in) :: words
    type(unit_type) :: unit, arm
    integer :: i

    if (self%are_si()) return
    if (words == "kg m^2") then
      unit = self%units%of(of_inertia)
      if (unit%name /= usual_units%of(of_inertia)%name) conversion = conversion_type(unit%name, unit%divisor, unit%factor)
      return
    else if (words == "kg m" .or. words == "kg mm") then
      ! a mass times a distance
      unit = self%units%of(of_mass)
      arm = self%units%of(of_length)
      if (unit%name == usual_units%of(of_mass)%name .and. arm%name == usual_units%of(of_length)%name) return
      conversion = conversion_type(trim(unit%name) // " " // arm%name, unit%divisor * arm%divisor, unit%factor * arm%factor &
        & * merge(1.0e3_dp, 1.0_dp, words == "kg mm"))
      return
    end if
    i = findloc(computed%words, words, dim=1)
    if (i == 0) return
    unit = self%units%of(computed(i)%quantity)
    if (unit%name == usual_units%of(computed(i)%quantity)%name) return
    conversion = conversion_type(trim(unit%name) // computed(i)%rest, computed(i)%factor * unit%divisor, &
      & computed(i)%divisor * unit%factor)
  end function conversion

  !> True if all results are in SI units.
  pure logical function are_si(self)
    class(result_units_type), intent(in) :: self

    are_si = all(self%units%of%name == usual_units%of%name)
  end function are_si

  !> True if the character `at` of a text belongs to a name of the input.
  pure logical function is_in_name(self, text, at)
    class(result_units_type), intent(in) :: self
    character(len=*), intent(in) :: text
    integer, intent(in) :: at
    integer :: first, n, start

    is_in_name = .false.
    if (.not. allocated(self%names)) return
    first = 2
    do while (first <= len(self%names))
      n = index(self%names(first:) // newline, newline) - 1
      do start = max(1, at - n + 1), min(at, len(text) - n + 1)
        is_in_name = text(start:start + n - 1) == self%names(first:first + n - 1)
        if (is_in_name) return
      end do
      first = first + n + 1
    end do
  end function is_in_name

  !> A value in the new unit.
  elemental real(dp) function converted(self, value)
    class(conversion_type), intent(in) :: self
    real(dp), intent(in) :: value

    converted = value
    if (self%words /= "") converted = value * self%factor / self%divisor
  end function converted

  !> The value whose conversion is `value`.
  elemental real(dp) function original(self, value)
    class(conversion_type), intent(in) :: self
    real(dp), intent(in) :: value

    original = value
    if (self%words /= "") original = value * self%divisor / self%factor
  end function original

  !> Text of a value, whose unit is `words`, with `digits` significant digits and its unit.
  pure character(len=48) function amount(self, value, digits, words) result(text)
    class(result_units_type), intent(in) :: self
    real(dp), intent(in) :: value
    integer, intent(in) :: digits
    character(len=*), intent(in) :: words
    type(conversion_type) :: conversion

    conversion = self%conversion(words)
    if (conversion%words == "") conversion%words = words
    text = concise(conversion%converted(value), digits) // " " // trim(conversion%words)
  end function amount

end module gestell_output_table_result_units
