!> Defines the record of an input key. Reading, units, ranges for sweeps, help texts and the reference manual all use this record.
module gestell_base_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> Kinds of values.
  integer, parameter, public :: real_key = 1, integer_key = 2, text_key = 3

  !> Quantities whose unit is set in the group &units; `quantities` is their number.
  integer, parameter, public :: of_length = 1, of_mass = 2, of_inertia = 3, of_stiffness = 4, of_force = 5, of_moment = 6, &
    & of_damping = 7, of_rotary_damping = 8, of_angle = 9, quantities = 9
  !> Units of two matrices of the foundation, whose elements have different units.
  integer, parameter, public :: of_stiffness_matrix = 10, of_damping_diagonal = 11

  !> Stands for a number that is not given.
  real(dp), parameter, public :: unset = -huge(1.0_dp)

  !> Conditions that a number must meet: lie between inclusive bounds, be positive, be nonzero, or be 1 or -1.
  type, public :: range_type
    real(dp) :: least = -huge(1.0_dp), most = huge(1.0_dp)
    logical :: above_zero = .false., not_zero = .false., unit_size = .false.
  end type range_type

  type(range_type), parameter, public :: positive = range_type(above_zero=.true.)
  type(range_type), parameter, public :: nonnegative = range_type(least=0.0_dp)
  type(range_type), parameter, public :: nonzero = range_type(not_zero=.true.)
  type(range_type), parameter, public :: one_or_minus_one = range_type(unit_size=.true.)

  !> Describes an input key: its name, kind of values, unit, default and range.
  type, public :: key_type
    character(len=16) :: group, name
    !> real_key, integer_key or text_key
    integer :: kind
    !> Explains the key in one sentence of Markdown
    character(len=256) :: meaning = ""
    !> `rank`: number of subscripts (0 scalar, 1 vector or list, 2 matrix); `least`, `most`: minimum and maximum number of values
    integer :: rank = 0, least = 1, most = 1
    !> Number of values in the shorter form, if the key permits one: the first elements of a vector, or the upper left square block
    !> of a matrix. Otherwise 0
    integer :: shorter = 0
    !> True if every group of this name must contain the key
    logical :: required = .false.
    !> Quantity that the unit measures (`of_length`, ...); 0 if the key has no unit or the fixed unit `symbol`
    integer :: unit = 0
    character(len=12) :: symbol = ""
    !> Default as a number (SI units, angles in deg). Instead, `word` may hold comma-separated words, or `otherwise` a description
    !> for the manual. If none of the three is set, the key has no default.
    real(dp) :: default = unset
    character(len=64) :: word = "", otherwise = ""
    type(range_type) :: range = range_type()
    !> Texts that the key accepts, separated by commas; empty: any text
    character(len=160) :: words = ""
    !> Number of rows of a matrix
    integer :: rows = 1
    !> True if a single value given by --set applies to all components
    logical :: alike = .false.
  end type key_type

  public :: all_words, find_key, joined

contains

  !> Index of the key with this name; 0 if the table does not contain it.
  pure integer function find_key(keys, name) result(i)
    type(key_type), intent(in) :: keys(:)
    character(len=*), intent(in) :: name

    do i = 1, size(keys)
      if (keys(i)%name == name) return
    end do
    i = 0
  end function find_key

  !> Splits a comma-separated list into words.
  pure function all_words(list) result(words)
    character(len=*), intent(in) :: list
    character(len=16), allocatable :: words(:)
    integer :: i, first, last

    allocate(words(merge(0, 1 + count([(list(i:i) == ",", i = 1, len_trim(list))]), list == "")))
    first = 1
    do i = 1, size(words)
      last = first + index(list(first:) // ",", ",") - 2
      words(i) = adjustl(list(first:last))
      first = last + 2
    end do
  end function all_words

  !> Joins words to a comma-separated list.
  pure function joined(words) result(list)
    character(len=*), intent(in) :: words(:)
    character(len=160) :: list
    integer :: i

    list = words(1)
    do i = 2, size(words)
      list = trim(list) // ", " // words(i)
    end do
  end function joined

end module gestell_base_key
