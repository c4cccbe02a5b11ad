!> What a number of inputs gave, kept in a file so that a long run can go on where it ended.
module fuzz_tally
  use fuzz_process, only: ending_type
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  integer, parameter :: longest = 160, codes = 10

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
    !> Seconds of the processor, of the slowest input, which that is; the greatest memory (MB) and which.
    real(dp) :: seconds = 0, longest = 0, megabytes = 0
    integer(int64) :: slowest = 0, greatest = 0
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
    if (ending%seconds > self%longest) then
      self%longest = ending%seconds
      self%slowest = number
    end if
    if (ending%megabytes > self%megabytes) then
      self%megabytes = ending%megabytes
      self%greatest = number
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

  pure integer(int64) function faults(self)
    class(tally_type), intent(in) :: self

    faults = 0
    if (allocated(self%classes)) faults = sum(self%classes%times)
  end function faults

  subroutine save_to(self, file)
    class(tally_type), intent(in) :: self
    character(len=*), intent(in) :: file
    integer :: unit, i

    open (newunit=unit, file=file, action="write", status="replace")
    write (unit, *) self%last, self%inputs, self%by_code, self%too_long, self%slowest, self%greatest
    write (unit, *) self%seconds, self%longest, self%megabytes
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
    read (unit, *) self%last, self%inputs, self%by_code, self%too_long, self%slowest, self%greatest
    read (unit, *) self%seconds, self%longest, self%megabytes
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
    print "(a, f0.2, a, i0, a, f0.0, a, i0)", "  slowest ", self%longest, " s: input ", self%slowest, "; greatest memory ", &
      & self%megabytes, " MB: input ", self%greatest
    print "(a, i0)", "faults: ", self%faults()
    if (.not. allocated(self%classes)) return
    do i = 1, size(self%classes)
      print "(i8, a, i0, 2a)", self%classes(i)%times, " times, first in input ", self%classes(i)%first, ": ", &
        & trim(self%classes(i)%words)
    end do
  end subroutine show

end module fuzz_tally
