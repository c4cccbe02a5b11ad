!> The values of a checked group, by key.
module gestell_input_schema_get
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_input_namelist_document, only: group_type, find_entry, word_length
  use gestell_input_namelist_message, only: input_error
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_base_wording, only: decimal
  use gestell_input_schema_units, only: unit_type
  implicit none (type, external)
  private

  public :: get, at_least, count_values

  !> What a number must satisfy.
  type, public :: condition_type
    private
    integer :: kind
    integer :: bound
  end type condition_type

  integer, parameter :: is_positive = 1, is_nonnegative = 2, is_nonzero = 3, is_not_below = 4
  type(condition_type), parameter, public :: positive = condition_type(is_positive, 0)
  type(condition_type), parameter, public :: nonnegative = condition_type(is_nonnegative, 0)
  type(condition_type), parameter, public :: nonzero = condition_type(is_nonzero, 0)

  !> call get(group, key, value, error, default, must, unit) for numbers and vectors (the value in SI, `default` and
  !> `must` as typed), without `unit` for integers and matrices,
  !> call get(group, key, value, error, default, allowed) for a text and a list of texts.
  !> Without `default` the key is required; for vectors and matrices it stands for every element not given.
  interface get
    module procedure get_real
    module procedure get_vector
    module procedure get_matrix
    module procedure get_integer
    module procedure get_text
    module procedure get_texts
  end interface get

contains

  !> The condition of not falling below a whole number.
  pure type(condition_type) function at_least(bound)
    integer, intent(in) :: bound

    at_least = condition_type(is_not_below, bound)
  end function at_least

  !> Number of values that a key has; zero where it is missing.
  pure integer function count_values(group, key)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    integer :: i

    count_values = 0
    i = find_entry(group, key)
    if (i > 0) count_values = size(group%entries(i)%values)
  end function count_values

  pure subroutine get_real(group, key, value, error, default, must, unit)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    real(dp), intent(out) :: value
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: default
    type(condition_type), intent(in), optional :: must
    type(unit_type), intent(in), optional :: unit
    character(len=:), allocatable :: reason
    integer :: i

    value = 0
    if (present(default)) value = default
    i = find_entry(group, key)
    if (i == 0) then
      if (.not. present(default)) call input_error(group, key, "must be given", error)
      return
    end if
    value = group%entries(i)%values(1)%number
    reason = broken(value, must)
    if (present(unit)) value = unit%si(value)
    if (reason /= "") call input_error(group, key, reason, error)
  end subroutine get_real

  pure subroutine get_vector(group, key, value, error, default, must, unit)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    real(dp), intent(out) :: value(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: default
    type(condition_type), intent(in), optional :: must
    type(unit_type), intent(in), optional :: unit
    character(len=:), allocatable :: reason
    integer :: i, k

    value = 0
    if (present(default)) value = default
    i = find_entry(group, key)
    if (i == 0) then
      if (.not. present(default)) call input_error(group, key, "must be given", error)
      return
    end if
    associate (values => group%entries(i)%values)
      if (size(values) > size(value)) then
        call input_error(group, key, "needs " // decimal(size(value)) &
          // trim(merge(" value ", " values", size(value) == 1)) // ", has " // decimal(size(values)), error)
        return
      end if
      do k = 1, size(value)
        reason = ""
        if (k > size(values)) then
          if (.not. present(default)) reason = "must be given"
        else if (.not. allocated(values(k)%text)) then
          if (.not. present(default)) reason = "must be given"
        else
          value(k) = values(k)%number
          reason = broken(value(k), must)
          if (present(unit)) value(k) = unit%si(value(k))
        end if
        if (reason == "") cycle
        call input_error(group, key, reason, error, k)
        return
      end do
    end associate
  end subroutine get_vector

  pure subroutine get_matrix(group, key, value, error, default, must)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    real(dp), intent(out) :: value(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(in), optional :: default
    type(condition_type), intent(in), optional :: must
    real(dp) :: elements(size(value))

    call get_vector(group, key, elements, error, default, must)
    value = reshape(elements, shape(value))
  end subroutine get_matrix

  pure subroutine get_integer(group, key, value, error, default, must)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    integer, intent(out) :: value
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: default
    type(condition_type), intent(in), optional :: must
    character(len=:), allocatable :: reason
    integer :: i

    value = 0
    if (present(default)) value = default
    i = find_entry(group, key)
    if (i == 0) then
      if (.not. present(default)) call input_error(group, key, "must be given", error)
      return
    end if
    value = nint(group%entries(i)%values(1)%number)
    reason = broken(real(value, dp), must)
    if (reason /= "") call input_error(group, key, reason, error)
  end subroutine get_integer

  pure subroutine get_text(group, key, value, error, default, allowed)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    character(len=:), allocatable, intent(out) :: value
    type(error_type), allocatable, intent(out) :: error
    character(len=*), intent(in), optional :: default
    character(len=*), intent(in), optional :: allowed(:)
    integer :: i

    value = ""
    if (present(default)) value = default
    i = find_entry(group, key)
    if (i == 0) then
      if (.not. present(default)) call input_error(group, key, "must be given", error)
      return
    end if
    value = group%entries(i)%values(1)%text
    if (.not. present(allowed)) return
    if (all(allowed /= value)) call input_error(group, key, "unknown" // suggestion(value, allowed), error)
  end subroutine get_text

  pure subroutine get_texts(group, key, value, error, default, allowed)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    character(len=word_length), allocatable, intent(out) :: value(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), intent(in), optional :: default(:)
    character(len=*), intent(in), optional :: allowed(:)
    integer :: i, k

    i = find_entry(group, key)
    if (i == 0) then
      if (present(default)) then
        allocate(value(size(default)))
        value(:) = default
      else
        call input_error(group, key, "must be given", error)
      end if
      return
    end if
    associate (values => group%entries(i)%values)
      allocate(value(size(values)))
      do k = 1, size(values)
        value(k) = values(k)%text
        if (.not. present(allowed)) cycle
        if (any(allowed == value(k))) cycle
        call input_error(group, key, "unknown" // suggestion(value(k), allowed), error, k)
        return
      end do
    end associate
  end subroutine get_texts

  !> What a number must be and is not; empty where it is.
  pure function broken(value, must) result(reason)
    real(dp), intent(in) :: value
    type(condition_type), intent(in), optional :: must
    character(len=:), allocatable :: reason

    reason = ""
    if (.not. present(must)) return
    select case (must%kind)
    case (is_positive)
      if (.not. value > 0) reason = "must be positive"
    case (is_nonnegative)
      if (.not. value >= 0) reason = "must not be negative"
    case (is_nonzero)
      if (.not. abs(value) > 0) reason = "must not be zero"
    case default
      if (.not. value >= must%bound) reason = "must be at least " // decimal(must%bound)
    end select
  end function broken

end module gestell_input_schema_get
