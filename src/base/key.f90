!> Defines the record of an input key. Reading, units, ranges for sweeps, help texts and the reference manual all use this record.
module gestell_base_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> Kinds of values.
  integer, parameter, public :: real_key = 1, integer_key = 2, text_key = 3

  !> Kinds of units: quantities whose unit the group &units sets, and two matrices of the foundation with mixed units.
  integer, parameter, public :: of_length = 1, of_mass = 2, of_inertia = 3, of_stiffness = 4, of_force = 5, of_moment = 6, &
    & of_damping = 7, of_rotary_damping = 8, of_angle = 9, quantities = 9
  integer, parameter, public :: of_stiffness_matrix = 10, of_damping_diagonal = 11

  !> Marks a number that is not given.
  real(dp), parameter, public :: unset = -huge(1.0_dp)

  !> Conditions on a number: inclusive bounds, greater than zero, not zero, or equal to 1 or -1.
  type, public :: range_type
    real(dp) :: least = -huge(1.0_dp), most = huge(1.0_dp)
    logical :: above_zero = .false., not_zero = .false., unit_size = .false.
  end type range_type

  type(range_type), parameter, public :: positive = range_type(above_zero=.true.)
  type(range_type), parameter, public :: nonnegative = range_type(least=0.0_dp)
  type(range_type), parameter, public :: nonzero = range_type(not_zero=.true.)
  type(range_type), parameter, public :: one_or_minus_one = range_type(unit_size=.true.)

  !> The record of a key.
  type, public :: key_type
    character(len=16) :: group, name
    !> real_key, integer_key or text_key
    integer :: kind
    !> One sentence in Markdown
    character(len=256) :: meaning = ""
    !> Number of subscripts (0 scalar, 1 vector or list, 2 matrix); smallest and largest number of values
    integer :: rank = 0, least = 1, most = 1
    !> Number of values of a permitted shorter form, 0 if there is none: the first elements of a vector, or the upper left square
    !> block of a matrix
    integer :: shorter = 0
    !> True if every group of this name must contain the key
    logical :: required = .false.
    !> Quantity of the unit (`of_length`, ...), 0 for none; `symbol` is a unit that cannot be changed
    integer :: unit = 0
    character(len=12) :: symbol = ""
    !> Default of a missing key: a number (SI units, angles in deg), comma-separated words, or a description for the manual. If none
    !> of the three is set, the key has no default.
    real(dp) :: default = unset
    character(len=64) :: word = "", otherwise = ""
    type(range_type) :: range = range_type()
    !> Allowed words of a text, separated by commas; empty: any text
    character(len=160) :: words = ""
    !> First dimension of a matrix
    integer :: rows = 1
    !> True if one value given by --set applies to all components
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
