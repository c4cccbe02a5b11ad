!> What a number of inputs gave, kept in a file so that a long run can go on where it ended.
module fuzz_tally
  use fuzz_process, only: ending_type
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  integer, parameter :: longest = 160, codes = 10
  !> Slowest inputs that are kept; bins of times, three to a decade: below 1 ms, ..., below 10 s, above.
  integer, parameter :: kept = 20, bins = 13

  !> A class of faults: how often, and the first input.
  type :: class_type
    character(len=longest) :: words = ""
    integer(int64) :: times = 0, first = 0
  end type class_type

  type, public :: tally_type
    !> The last input that is in it.
    integer(int64) :: last = 0
    !> Inputs in all, and by exit code 0 to 10.
    integer(int64) :: inputs = 0, by_code(0:codes) = 0
    !> Those that were ended because they took too long.
    integer(int64) :: too_long = 0
    !> Seconds of the processor; the largest memory (MB) and which input took it.
    real(dp) :: seconds = 0, megabytes = 0
    integer(int64) :: peak_input = 0
    !> The slowest inputs that ended by themselves, the first one leading, and their seconds.
    integer(int64) :: slowest(kept) = 0
    real(dp) :: longest(kept) = 0
    !> Inputs and their seconds by the time that they took.
    integer(int64) :: times(0:bins) = 0
    real(dp) :: shares(0:bins) = 0
    type(class_type), allocatable :: classes(:)
  contains
    procedure :: add
    procedure :: faults
    procedure :: save_to
    procedure :: load
    procedure :: show
  end type tally_type

contains

  !> Adds input `number`; `times`: how often its class has come, 0 without a fault.
  subroutine add(self, number, ending, fault, times)
    class(tally_type), intent(inout) :: self
    integer(int64), intent(in) :: number
    type(ending_type), intent(in) :: ending
    character(len=*), intent(in) :: fault
    integer(int64), intent(out) :: times
    integer :: i

    self%last = number
    self%inputs = self%inputs + 1
    self%seconds = self%seconds + ending%seconds
    if (ending%too_long()) self%too_long = self%too_long + 1
    if (ending%code >= 0 .and. ending%code <= codes) self%by_code(ending%code) = self%by_code(ending%code) + 1
    call rank(self, number, ending)
    if (ending%megabytes > self%megabytes) then
      self%megabytes = ending%megabytes
      self%peak_input = number
    end if
    times = 0
    if (fault == "") return
    if (.not. allocated(self%classes)) allocate(self%classes(0))
    do i = 1, size(self%classes)
      if (self%classes(i)%words == fault) exit
    end do
    if (i > size(self%classes)) self%classes = [self%classes, class_type(fault, 0, number)]
    self%classes(i)%times = self%classes(i)%times + 1
    times = self%classes(i)%times
  end subroutine add

  !> Sorts an input in by its time.
  subroutine rank(self, number, ending)
    class(tally_type), intent(inout) :: self
    integer(int64), intent(in) :: number
    type(ending_type), intent(in) :: ending
    integer :: bin, place

    bin = min(max(ceiling(3 * (log10(max(ending%seconds, tiny(1.0_dp))) + 3)), 0), bins)
    self%times(bin) = self%times(bin) + 1
    self%shares(bin) = self%shares(bin) + ending%seconds
    if (ending%too_long()) return
    place = 1 + count(self%longest >= ending%seconds)
    if (place > kept) return
    self%longest(place + 1:) = self%longest(place:kept - 1)
    self%slowest(place + 1:) = self%slowest(place:kept - 1)
    self%longest(place) = ending%seconds
    self%slowest(place) = number
  end subroutine rank

  pure integer(int64) function faults(self)
    class(tally_type), intent(in) :: self

    faults = 0
    if (allocated(self%classes)) faults = sum(self%classes%times)
  end function faults

  subroutine save_to(self, file)
    class(tally_type), intent(in) :: self
    character(len=*), intent(in) :: file
    character(len=*), parameter :: layout = "(*(g0, :, 1x))"
    integer :: unit, i

    open (newunit=unit, file=file, action="write", status="replace")
    write (unit, layout) self%last, self%inputs, self%by_code, self%too_long, self%peak_input, self%slowest, self%times
    write (unit, layout) self%seconds, self%megabytes, self%longest, self%shares
    if (allocated(self%classes)) then
      do i = 1, size(self%classes)
        write (unit, "(i0, 1x, i0, 1x, a)") self%classes(i)%times, self%classes(i)%first, trim(self%classes(i)%words)
      end do
    end if
    close (unit)
  end subroutine save_to

  !> What the file keeps; nothing where there is none.
  subroutine load(self, file)
    class(tally_type), intent(inout) :: self
    character(len=*), intent(in) :: file
    character(len=longest + 44) :: line
    type(class_type) :: one
    integer :: unit, status, k

    open (newunit=unit, file=file, action="read", status="old", iostat=status)
    if (status /= 0) return
    allocate(self%classes(0))
    read (unit, *) self%last, self%inputs, self%by_code, self%too_long, self%peak_input, self%slowest, self%times
    read (unit, *) self%seconds, self%megabytes, self%longest, self%shares
    do
      read (unit, "(a)", iostat=status) line
      if (status /= 0) exit
      read (line, *) one%times, one%first
      k = index(line, " ")
      k = k + index(line(k + 1:), " ")
      one%words = line(k + 1:)
      self%classes = [self%classes, one]
    end do
    close (unit)
  end subroutine load

  subroutine show(self)
    class(tally_type), intent(in) :: self
    integer :: i

    print "(/, i0, a, f0.1, a)", self%inputs, " inputs, ", self%seconds, " s of the processor in the program"
    do i = 0, codes
      if (self%by_code(i) > 0) print "(a, i0, a, i0)", "  exit code ", i, ": ", self%by_code(i)
    end do
    print "(a, i0)", "  ended because they took too long: ", self%too_long
    print "(a, i0, a, i0)", "  largest memory ", nint(self%megabytes), " MB: input ", self%peak_input
    print "(a)", "  time of the processor     inputs   s in all"
    do i = 0, bins
      if (self%times(i) > 0) print "(2x, a, f9.5, a, i14, f11.1)", trim(merge("below", "above", i < bins)), &
        & 10.0_dp**((min(i, bins - 1) - 9) / 3.0_dp), " s", self%times(i), self%shares(i)
    end do
    print "(a)", "  slowest of those that ended by themselves"
    do i = 1, min(kept, count(self%slowest > 0))
      print "(f9.2, a, i0)", self%longest(i), " s: input ", self%slowest(i)
    end do
    print "(a, i0)", "faults: ", self%faults()
    if (.not. allocated(self%classes)) return
    do i = 1, size(self%classes)
      print "(i8, a, i0, 2a)", self%classes(i)%times, " times, first in input ", self%classes(i)%first, ": ", &
        & trim(self%classes(i)%words)
    end do
  end subroutine show

end module fuzz_tally
