!> Result files against doc/output.md: complete, every number finite but where the page says that it is not.
module fuzz_tables
  use fuzz_text, only: has, newline
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: check_table, field_type, split, verdict_of_multipliers

  type :: field_type
    character(len=:), allocatable :: text
  end type field_type

  !> Columns of words.
  character(len=*), parameter :: word_columns(*) = [character(len=10) :: "verdict", "state", "kind", "below", "above", "outcome", &
    & "quantity", "unit", "role", "parameter", "support", "name", "method", "aim", "links", "on", "from", "to", &
    & "meaning", "joint", "pair", "cause", "remark", "component", "rotation", "slider"]
  !> What a point of a sweep has: the numbers behind its parameters.
  character(len=*), parameter :: point_columns(*) = [character(len=16) :: "rho_max", "log_rho_max", "rho_error", "xi_peak_m", &
    & "eta_peak_m", "psi_peak_rad", "zeta_peak_m", "rot_xi_peak_rad", "rot_eta_peak_rad"]
  character(len=*), parameter :: peak_columns(*) = point_columns(4:)

contains

  !> What is wrong with the table `name` (without its ending), in few words; empty where nothing is.
  function check_table(name, content) result(fault)
    character(len=*), intent(in) :: name, content
    character(len=:), allocatable :: fault
    type(field_type), allocatable :: heads(:), fields(:)
    integer :: start, last
    logical :: header

    fault = ""
    if (len(content) == 0) then
      fault = "is empty"
      return
    end if
    if (content(len(content):) /= newline) then
      fault = "its last line does not end"
      return
    end if
    header = .true.
    start = 1
    do while (start <= len(content))
      last = start + index(content(start:), newline) - 2
      if (header .and. content(start:start) == "#") then
        start = last + 2
        cycle
      end if
      call split(content(start:last), fields)
      ! its rows are of one width
      if (name == "sweep") call drop_padding(fields)
      if (header) then
        call move_alloc(fields, heads)
        header = .false.
      else if (size(fields) /= size(heads)) then
        fault = "a row has another number of fields than the header"
      else
        fault = check_row(name, heads, fields)
      end if
      if (fault /= "") return
      start = last + 2
    end do
    if (header) fault = "has no header"
  end function check_table

  !> What is wrong with a row.
  function check_row(name, heads, fields) result(fault)
    character(len=*), intent(in) :: name
    type(field_type), intent(in) :: heads(:), fields(:)
    character(len=:), allocatable :: fault
    logical :: missing(size(fields))
    integer :: i

    fault = ""
    do i = 1, size(fields)
      missing(i) = .false.
      associate (head => heads(i)%text, word => fields(i)%text)
        if (is_word(name, head)) cycle
        if (word == "NaN") then
          missing(i) = .true.
        else if (word == "Infinity") then
          if (.not. may_be_infinite(name, heads, fields, head)) fault = "Infinity in " // generic(head)
        else if (len(word) == 0) then
          fault = "nothing in " // generic(head)
        else if (verify(word, "0123456789+-.E") /= 0) then
          ! a path may be set to a text, which --one-line repeats
          if (name /= "one-line" .or. any(point_columns == head)) fault = "no number in " // generic(head)
        else if (word(1:1) == "-" .and. never_negative(head)) then
          if (verify(word, "-0.E+") /= 0) fault = "negative " // generic(head)
        end if
      end associate
      if (fault /= "") return
    end do
    if (.not. any(missing)) return
    do i = 1, size(fields)
      if (missing(i)) then
        if (.not. may_miss(name, heads, fields, missing, i)) fault = "NaN in " // generic(heads(i)%text)
      end if
    end do
  end function check_row

  !> Where doc/output.md says that there may be Infinity: an unbounded peak, a multiplier that overflows.
  logical function may_be_infinite(name, heads, fields, head)
    character(len=*), intent(in) :: name, head
    type(field_type), intent(in) :: heads(:), fields(:)
    real(dp), parameter :: least = 709
    character(len=:), allocatable :: word
    real(dp) :: log_abs
    integer :: status

    may_be_infinite = name == "peaks" .and. head == "value"
    if (may_be_infinite) may_be_infinite = value_of(heads, fields, "state") == "unbounded"
    if (name == "multipliers" .and. (head == "re" .or. head == "abs")) then
      word = value_of(heads, fields, "log_abs")
    else if ((name == "sweep" .or. name == "one-line") .and. head == "rho_max") then
      word = value_of(heads, fields, "log_rho_max")
      may_be_infinite = word == ""
    else
      return
    end if
    read (word, *, iostat=status) log_abs
    if (status == 0) may_be_infinite = log_abs > least
  end function may_be_infinite

  !> Where doc/output.md says that there may be no number.
  logical function may_miss(name, heads, fields, missing, i)
    character(len=*), intent(in) :: name
    type(field_type), intent(in) :: heads(:), fields(:)
    logical, intent(in) :: missing(:)
    integer, intent(in) :: i
    character(len=:), allocatable :: word

    may_miss = .false.
    associate (head => heads(i)%text)
      select case (name)
      case ("probes")
        may_miss = head == "limit_mm_s"
      case ("sweep", "one-line")
        word = value_of(heads, fields, "verdict")
        if (.not. any(point_columns == head)) return
        if (any(peak_columns == head)) may_miss = together(heads, missing, peak_columns)
        if (word == "" .or. word == "impossible" .or. word == "failed") may_miss = may_miss .or. &
          & together(heads, missing, point_columns)
      case ("resonance")
        word = value_of(heads, fields, "state")
        may_miss = i > 3 .and. (word == "resonance" .or. word == "impossible" .or. word == "failed")
      case ("peaks")
        if (head == "other_side") then
          may_miss = value_of(heads, fields, "state") /= "jump"
        else if (head == "width_rpm" .or. head == "damping_ratio") then
          may_miss = together(heads, missing, [character(len=13) :: "width_rpm", "damping_ratio"])
        end if
      case ("sensitivity")
        word = value_of(heads, fields, "state")
        may_miss = has(head, "_change_") .and. (word == "failed" .or. word == "zero")
      case ("separation")
        may_miss = all(missing([4, 5, 6, 7, 9, 10, 11, 12, 13])) .and. value_of(heads, fields, "state") == "undecided"
        if (head == "share" .or. index(head, "energy_") == 1) may_miss = all(missing([7, 11, 12, 13]))
        if (index(head, "energy_") == 1) may_miss = all(missing([11, 12, 13]))
      case ("balance")
        may_miss = i > 7 .and. all(missing(8:21))
      case ("balance_harmonics")
        may_miss = i > 5 .and. all(missing(6:7))
      case ("frequencies")
        may_miss = i > 1 .and. value_of(heads, fields, "remark") /= "near" .or. head == "damping_ratio"
      case ("balance_table", "unbalance")
        ! phases of zero amplitudes; vectors that rotate have no peak
        may_miss = has(head, "_phase_rad") .or. head == "angle_rad" &
          & .or. any(value_of(heads, fields, "component") == ["peak", "rms "])
      case ("strokes")
        may_miss = head == "forward_deg" .or. head == "time_ratio"
      case ("campbell")
        may_miss = all(missing(3:15))
      case ("critical")
        if (index(head, "force_") == 1) then
          may_miss = together(heads, missing, [character(len=21) :: "force_speed_rpm", "force_speed_error_rpm", "force_N", &
            & "force_prominence"])
        else
          may_miss = together(heads, missing, [character(len=21) :: "speed_rpm", "speed_error_rpm", "amplitude_m", "prominence", &
            & "share"])
          may_miss = may_miss .and. value_of(heads, fields, "outcome") /= "peak"
        end if
      case default
        may_miss = .false.
      end select
    end associate
  end function may_miss

  !> Whether all columns of these names that there are have no number.
  pure logical function together(heads, missing, names)
    type(field_type), intent(in) :: heads(:)
    logical, intent(in) :: missing(:)
    character(len=*), intent(in) :: names(:)
    integer :: i

    together = .true.
    do i = 1, size(heads)
      if (any(names == heads(i)%text)) together = together .and. missing(i)
    end do
  end function together

  pure function value_of(heads, fields, name) result(word)
    type(field_type), intent(in) :: heads(:), fields(:)
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: word
    integer :: i

    word = ""
    do i = 1, size(heads)
      if (heads(i)%text == name) word = fields(i)%text
    end do
  end function value_of

  pure logical function is_word(name, head)
    character(len=*), intent(in) :: name, head

    is_word = any(word_columns == head) .and. index(name, "one-line") == 0 .or. head == "verdict"
  end function is_word

  !> Errors, peaks, mean squares, amplitudes.
  pure logical function never_negative(head)
    character(len=*), intent(in) :: head

    never_negative = head == "error" .or. head == "abs" .or. head == "share" .or. head == "prominence" .or. has(head, "_rms") &
      & .or. has(head, "error") .or. has(head, "peak_") .and. .not. has(head, "crank_deg") .and. .not. has(head, "change_percent") &
      & .and. .not. has(head, "torque") .and. .not. has(head, "at_peak") .or. has(head, "frequency_Hz")
  end function never_negative

  !> A column's name without what the input has given to it: names of probes and joints, numbers of supports.
  pure function generic(head) result(words)
    character(len=*), intent(in) :: head
    character(len=:), allocatable :: words
    integer :: i

    words = ""
    do i = 1, len(head)
      if (scan(head(i:i), "0123456789") == 0) words = words // head(i:i)
    end do
    if (len(words) > 40) words = words(:40)
  end function generic

  !> Leaves out the blanks before each field.
  pure subroutine drop_padding(fields)
    type(field_type), intent(inout) :: fields(:)
    integer :: i

    do i = 1, size(fields)
      fields(i)%text = trim(adjustl(fields(i)%text))
    end do
  end subroutine drop_padding

  !> The fields of a line; one in quotes may hold commas.
  pure subroutine split(line, fields)
    character(len=*), intent(in) :: line
    type(field_type), allocatable, intent(out) :: fields(:)
    integer :: i, n, start
    logical :: quoted

    n = 1
    quoted = .false.
    do i = 1, len(line)
      if (line(i:i) == """") quoted = .not. quoted
      if (line(i:i) == "," .and. .not. quoted) n = n + 1
    end do
    allocate(fields(n))
    n = 1
    start = 1
    quoted = .false.
    do i = 1, len(line)
      if (line(i:i) == """") quoted = .not. quoted
      if (line(i:i) /= "," .or. quoted) cycle
      fields(n)%text = line(start:i - 1)
      n = n + 1
      start = i + 1
    end do
    fields(n)%text = line(start:)
  end subroutine split

  !> The verdict that the multipliers have by their errors; empty where the border is nearer than rounding.
  function verdict_of_multipliers(content) result(verdict)
    character(len=*), intent(in) :: content
    character(len=:), allocatable :: verdict
    type(field_type), allocatable :: fields(:)
    real(dp), parameter :: rounding = 1.0e-14_dp
    real(dp) :: modulus, error
    logical :: below, above
    integer :: start, last, status

    below = .true.
    above = .false.
    verdict = ""
    start = 1
    do while (start <= len(content))
      last = start + index(content(start:), newline) - 2
      if (scan(content(start:start), "123456789") > 0) then
        call split(content(start:last), fields)
        if (size(fields) < 9) return
        read (fields(4)%text, *, iostat=status) modulus
        if (status == 0) read (fields(9)%text, *, iostat=status) error
        if (status /= 0) return
        if (abs(modulus * (1 + error) - 1) < rounding .or. abs(modulus * (1 - error) - 1) < rounding) return
        below = below .and. modulus * (1 + error) < 1
        above = above .or. modulus * (1 - error) > 1
      end if
      start = last + 2
    end do
    verdict = "undecided"
    if (below) verdict = "stable"
    if (above) verdict = "unstable"
  end function verdict_of_multipliers

end module fuzz_tables
