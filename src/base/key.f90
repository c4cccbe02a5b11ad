!> Defines the record that describes an input key. Reading, unit conversion, ranges for sweeps, help texts and the reference manual
!> all use this record.
module gestell_base_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> Kinds of values.
  integer, parameter, public :: real_key = 1, integer_key = 2, text_key = 3

  !> Codes of the quantities whose unit the group &units sets. `quantities` is the number of these quantities.
  integer, parameter, public :: of_length = 1, of_mass = 2, of_inertia = 3, of_stiffness = 4, of_force = 5, of_moment = 6, &
    & of_damping = 7, of_rotary_damping = 8, of_angle = 9, of_pressure = 10, of_area = 11, of_acceleration = 12, &
    & quantities = 12
  !> Codes for two matrices of the foundation whose elements have different units.
  integer, parameter, public :: of_stiffness_matrix = 13, of_damping_diagonal = 14

  !> Maximum length of a list of words that a key accepts
  integer, parameter :: list_length = 320

  !> Value that marks a real number as not specified.
  real(dp), parameter, public :: unset = -huge(1.0_dp)

  !> Conditions on a number: inclusive bounds, and whether it must be positive, be nonzero, or be 1 or -1.
  type, public :: range_type
    real(dp) :: least = -huge(1.0_dp), most = huge(1.0_dp)
    logical :: above_zero = .false., not_zero = .false., unit_size = .false.
  end type range_type

  type(range_type), parameter, public :: positive = range_type(above_zero=.true.), nonnegative = range_type(least=0.0_dp), &
    & fraction = range_type(least=0.0_dp, most=1.0_dp)
  type(range_type), parameter, public :: nonzero = range_type(not_zero=.true.), one_or_minus_one = range_type(unit_size=.true.)

  !> Describes an input key: its name, kind of values, unit, default and range.
  type, public :: key_type
    character(len=16) :: group, name
    !> real_key, integer_key or text_key
    integer :: kind
    !> Meaning of the key in one sentence of Markdown
    character(len=320) :: meaning = ""
    !> `rank`: number of subscripts (0 for a scalar, 1 for a vector or list, 2 for a matrix). `least`, `most`: minimum and maximum
    !> number of values
    integer :: rank = 0, least = 1, most = 1
    !> Number of values in the short form of a vector (its first elements) or of a matrix (its upper left square block). 0 if the
    !> key has no short form
    integer :: shorter = 0
    !> True if the key must be given in every group to which it belongs
    logical :: required = .false.
    !> Code of the quantity that the key gives (`of_length`, ...). 0 if the key has no unit, or the fixed unit `symbol`
    integer :: unit = 0
    character(len=12) :: symbol = ""
    !> Default value as a number (in SI units, angles in deg, pressures in bar). If the default is one word or several words
    !> separated by commas, `word` contains it. Any other default is described in `otherwise`, for the manual. If none of these
    !> three components is set, the key has no default
    real(dp) :: default = unset
    character(len=64) :: word = "", otherwise = ""
    type(range_type) :: range = range_type()
    !> Texts that the key accepts, separated by commas. If empty, the key accepts any text
    character(len=list_length) :: words = ""
    !> Number of rows, if the key is a matrix
    integer :: rows = 1
    !> True if --set with a single value assigns this value to all components of the key
    logical :: alike = .false.
    !> If the key is another name of a key in its group: that key, and the factor from a value of this key to a value of that key
    character(len=16) :: same_as = ""
    real(dp) :: factor = 1
  end type key_type

  public :: all_words, find_key, joined

contains

  !> Index in `keys` of the key called `name`; 0 if there is none.
  pure integer function find_key(keys, name) result(i)
    type(key_type), intent(in) :: keys(:)
    character(len=*), intent(in) :: name

    i = findloc(keys%name == name, .true., dim=1)
  end function find_key

  !> Array of the words in a list that is separated by commas.
  pure function all_words(list) result(words)
    character(len=*), intent(in) :: list
    character(len=20), allocatable :: words(:)
    integer :: i, first, last

    allocate(words(merge(0, 1 + count([(list(i:i) == ",", i = 1, len_trim(list))]), list == "")))
    first = 1
    do i = 1, size(words)
      last = first + index(list(first:) // ",", ",") - 2
      words(i) = adjustl(list(first:last))
      first = last + 2
    end do
  end function all_words

  !> List of the words, separated by commas.
  pure character(len=list_length) function joined(words) result(list)
    character(len=*), intent(in) :: words(:)
    integer :: i

    list = words(1)
    do i = 2, size(words)
      list = trim(list) // ", " // words(i)
    end do
  end function joined

end module gestell_base_key
