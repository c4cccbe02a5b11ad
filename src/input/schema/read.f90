!> Reads the values of a checked group. The records of the keys specify units, defaults, ranges and permitted words.
module gestell_input_schema_read
  use gestell_base_error, only: error_type
  use gestell_base_key, only: all_words, find_key, integer_key, key_type, unset
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_base_words, only: word_length
  use gestell_input_namelist_document, only: find_entry, group_type
  use gestell_input_namelist_message, only: input_error
  use gestell_input_namelist_suggest, only: suggestion
  use gestell_input_schema_units, only: units_type, usual_units
  implicit none (type, external)
  private

  public :: read, read_axis_values, count_values

  !> Reads the key called `name`, whose record is in `keys`: call read(group, keys, name, value, error, units, default). If
  !> `units` is present, numbers are converted to SI units; otherwise they stay as typed. A missing key, or a missing element of a
  !> vector or matrix, gets the value `default` if present, otherwise the default of the record. If a matrix in the input has more
  !> rows than `value`, only its first rows are read. Fails if a value is out of range, a word is not permitted, or a key without
  !> a default is missing. Does nothing if `error` is already allocated, so that a caller can read several keys before testing for
  !> errors.
  interface read
    module procedure read_real, read_vector, read_matrix, read_integer, read_text, read_texts
  end interface read

contains

  !> Number of values that the group gives for a key; 0 if the key is missing.
  pure integer function count_values(group, key)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    integer :: i

    count_values = 0
    i = find_entry(group, key)
    if (i > 0) count_values = size(group%entries(i)%values)
  end function count_values

  pure subroutine read_real(group, keys, name, value, error, units, default)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: keys(:)
    character(len=*), intent(in) :: name
    real(dp), intent(out) :: value
    type(error_type), allocatable, intent(inout) :: error
    type(units_type), intent(in), optional :: units
    real(dp), intent(in), optional :: default
    real(dp) :: values(1)

    call read_vector(group, keys, name, values, error, units, default)
    value = values(1)
  end subroutine read_real

  pure subroutine read_vector(group, keys, name, value, error, units, default)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: keys(:)
    character(len=*), intent(in) :: name
    real(dp), intent(out) :: value(:)
    type(error_type), allocatable, intent(inout) :: error
    type(units_type), intent(in), optional :: units
    real(dp), intent(in), optional :: default
    real(dp) :: missing
    integer :: i, k, n

    value = 0
    if (allocated(error)) return
    associate (key => keys(find_key(keys, name)))
      missing = key%default
      if (present(default)) missing = default
      i = find_entry(group, name)
      n = 0
      if (i > 0) n = findloc([(allocated(group%entries(i)%values(k)%text), k = 1, size(group%entries(i)%values))], .true., dim=1, &
        & back=.true.)
      if (n > size(value)) then
        call input_error(group, name, "takes " // text(size(value)) &
          // trim(merge(" value ", " values", size(value) == 1)) // ", has " // text(n), error)
        return
      end if
      do k = 1, size(value)
        if (k <= n) then
          if (allocated(group%entries(i)%values(k)%text)) then
            value(k) = group%entries(i)%values(k)%number
            call check_range(group, key, value(k), k, error)
            if (present(units)) value(k) = units%to_si(key, k, value(k))
            if (allocated(error)) return
            cycle
          end if
        end if
        if (.not. missing > unset) then
          call input_error(group, name, "must be given", error, k)
          return
        end if
        value(k) = missing
        ! defaults of the records are in SI, except that angles are in degrees
        if (present(units) .and. abs(missing) > 0) value(k) = usual_units%to_si(key, k, missing)
      end do
    end associate
  end subroutine read_vector

  !> Reads a quantity with one value for each of three axes, such as a position (m). If only two values are given, the third value
  !> is 0. Does nothing if `error` is already allocated.
  pure subroutine read_axis_values(group, keys, name, units, value, error)
    type(group_type), intent(in) :: group
    !> Records of the group's keys
    type(key_type), intent(in) :: keys(:)
    !> Name of the key that is read
    character(len=*), intent(in) :: name
    type(units_type), intent(in) :: units
    real(dp), intent(out) :: value(3)
    type(error_type), allocatable, intent(inout) :: error
    integer :: n

    n = min(3, max(keys(find_key(keys, name))%least, count_values(group, name)))
    value = 0
    call read_vector(group, keys, name, value(:n), error, units)
  end subroutine read_axis_values

  pure subroutine read_matrix(group, keys, name, value, error, units)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: keys(:)
    character(len=*), intent(in) :: name
    real(dp), intent(out) :: value(:, :)
    type(error_type), allocatable, intent(inout) :: error
    type(units_type), intent(in), optional :: units
    real(dp), allocatable :: elements(:)
    integer :: i, k, rows

    rows = size(value, 1)
    i = find_entry(group, name)
    if (i > 0) rows = max(rows, group%entries(i)%rows)
    allocate(elements(rows * size(value, 2)))
    call read_vector(group, keys, name, elements, error, units)
    do k = 1, size(value, 2)
      value(:, k) = elements(1 + rows * (k - 1):size(value, 1) + rows * (k - 1))
    end do
  end subroutine read_matrix

  pure subroutine read_integer(group, keys, name, value, error)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: keys(:)
    character(len=*), intent(in) :: name
    integer, intent(out) :: value
    type(error_type), allocatable, intent(inout) :: error
    real(dp) :: values(1)

    call read_vector(group, keys, name, values, error)
    value = nint(values(1))
  end subroutine read_integer

  pure subroutine read_text(group, keys, name, value, error, default)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: keys(:)
    character(len=*), intent(in) :: name
    character(len=:), allocatable, intent(out) :: value
    type(error_type), allocatable, intent(inout) :: error
    character(len=*), intent(in), optional :: default
    integer :: i

    if (allocated(error)) return
    associate (key => keys(find_key(keys, name)))
      value = trim(key%word)
      if (present(default)) value = default
      i = find_entry(group, name)
      if (i == 0) then
        if (value == "" .and. key%otherwise == "") call input_error(group, name, "must be given", error)
        return
      end if
      value = group%entries(i)%values(1)%text
      if (.not. allowed(key, value)) call input_error(group, name, "unknown" // suggestion(value, all_words(key%words)), error)
    end associate
  end subroutine read_text

  pure subroutine read_texts(group, keys, name, value, error)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: keys(:)
    character(len=*), intent(in) :: name
    character(len=word_length), allocatable, intent(out) :: value(:)
    type(error_type), allocatable, intent(inout) :: error
    integer :: i, k

    if (allocated(error)) return
    associate (key => keys(find_key(keys, name)))
      i = find_entry(group, name)
      if (i == 0) then
        value = all_words(key%word)
        if (size(value) == 0) call input_error(group, name, "must be given", error)
        return
      end if
      associate (values => group%entries(i)%values)
        allocate(value(size(values)))
        do k = 1, size(values)
          value(k) = values(k)%text
          if (allowed(key, trim(value(k)))) cycle
          call input_error(group, name, "unknown" // suggestion(value(k), all_words(key%words)), error, k)
          return
        end do
      end associate
    end associate
  end subroutine read_texts

  !> True if the key accepts this word as its value.
  pure logical function allowed(key, word)
    type(key_type), intent(in) :: key
    character(len=*), intent(in) :: word

    allowed = key%words == ""
    if (.not. allowed) allowed = index(word, ",") == 0 .and. index(", " // trim(key%words) // ",", ", " // trim(word) // ",") > 0
  end function allowed

  !> Fails if a number is outside the range that the record of its key permits.
  pure subroutine check_range(group, key, value, element, error)
    type(group_type), intent(in) :: group
    type(key_type), intent(in) :: key
    real(dp), intent(in) :: value
    integer, intent(in) :: element
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: reason

    associate (least => key%range%least, most => key%range%most)
      if (key%range%above_zero .and. .not. value > 0) then
        reason = "must be positive"
      else if (key%range%not_zero .and. .not. abs(value) > 0) then
        reason = "must not be zero"
      ! nint would overflow: without optimisation both operands are evaluated
      else if (key%range%unit_size .and. .not. abs(abs(value) - 1) < 0.5_dp) then
        reason = "must be 1 or -1"
      else if (least > unset .and. .not. value >= least) then
        reason = "must be at least " // concise(least)
        if (key%kind /= integer_key .and. abs(least) <= 0) reason = "must not be negative"
      else if (most < huge(most) .and. .not. value <= most) then
        reason = "must be at most " // concise(most, 9)
      else
        return
      end if
      if (most < huge(most) .and. key%kind /= integer_key .and. (value > 0 .or. .not. key%range%above_zero)) reason = &
        & "must lie between " // concise(least) // " and " // concise(most)
    end associate
    call input_error(group, trim(key%name), reason, error, element)
  end subroutine check_range

end module gestell_input_schema_read
