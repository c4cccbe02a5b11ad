!> What is known of a key of the input: one record, from which come its reading, its unit, what may run, help and documents.
module gestell_base_key
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> Kinds of values.
  integer, parameter, public :: real_key = 1, integer_key = 2, text_key = 3

  !> Units of values: quantities whose unit the group &units names, and two matrices of the foundation.
  integer, parameter, public :: of_length = 1, of_mass = 2, of_inertia = 3, of_stiffness = 4, of_force = 5, of_moment = 6, &
    & of_damping = 7, of_rotary_damping = 8, of_angle = 9, quantities = 9
  integer, parameter, public :: of_stiffness_matrix = 10, of_damping_diagonal = 11

  !> A number that is not given.
  real(dp), parameter, public :: unset = -huge(1.0_dp)

  !> What a number must satisfy: bounds, both included; more than zero, or not zero; 1 or -1.
  type, public :: range_type
    real(dp) :: least = -huge(1.0_dp), most = huge(1.0_dp)
    logical :: above_zero = .false., not_zero = .false., unit_size = .false.
  end type range_type

  type(range_type), parameter, public :: positive = range_type(above_zero=.true.)
  type(range_type), parameter, public :: nonnegative = range_type(least=0.0_dp)
  type(range_type), parameter, public :: nonzero = range_type(not_zero=.true.)
  type(range_type), parameter, public :: one_or_minus_one = range_type(unit_size=.true.)

  !> A key of a group.
  type, public :: key_type
    character(len=16) :: group, name
    !> real_key, integer_key or text_key.
    integer :: kind
    !> One sentence, in Markdown.
    character(len=256) :: meaning = ""
    !> Number of subscripts: 0 scalar, 1 vector or list, 2 matrix; fewest and most values.
    integer :: rank = 0, least = 1, most = 1
    !> Where a shorter list will do too: so many values, the first ones, of a matrix the square of its first rows.
    integer :: shorter = 0
    !> Whether every group of this name must have it.
    logical :: required = .false.
    !> The quantity of its unit (`of_length`, ...), or the symbol of a unit that is always the same.
    integer :: unit = 0
    character(len=12) :: symbol = ""
    !> What stands for it where it is missing: a number (in SI, angles in deg), words between commas, or what documents say of a
    !> default that is none of these. Without any of them the key must be given where it is wanted.
    real(dp) :: default = unset
    character(len=64) :: word = "", otherwise = ""
    type(range_type) :: range = range_type()
    !> The words that a text can be, between commas; empty: any.
    character(len=160) :: words = ""
    !> First dimension of a matrix.
    integer :: rows = 1
    !> With --set one value stands for all components.
    logical :: alike = .false.
  end type key_type

  public :: all_words, find_key, joined

contains

  !> Index of a key of the table by its name, zero where it has none.
  pure integer function find_key(keys, name) result(i)
    type(key_type), intent(in) :: keys(:)
    character(len=*), intent(in) :: name

    do i = 1, size(keys)
      if (keys(i)%name == name) return
    end do
    i = 0
  end function find_key

  !> The words of a list between commas.
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

  !> Words as a list between commas.
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
