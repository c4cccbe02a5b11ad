!> Shows the progress of a computation in one line of the terminal. Shows nothing if standard error is not a terminal.
module gestell_run_terminal
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_base_files, only: write_bytes
  use gestell_base_platform, only: c_is_terminal
  use gestell_task_common_executor, only: progress_type
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  integer(c_int), parameter :: standard_error = 2

  !> Shows how many points of a computation are completed, how many are completed per second, and how long the remaining ones will
  !> take.
  type, extends(progress_type), public :: terminal_type
    private
    !> `on_terminal`: true if standard error is a terminal. `line_visible`: true while the terminal shows a progress line
    logical :: on_terminal = .false., line_visible = .false.
    !> `all`: total number of points. `done`: number of points completed so far
    integer(int64) :: all = 0, done = 0
    !> `begin`: time when the computation started (s). `last`: time of the last update of the line (s)
    real(dp) :: begin = 0, last = 0
  contains
    procedure :: start, add, clear
    procedure, nopass :: show_fraction
  end type terminal_type

  !> `bar`: number of characters of the progress bar. `widest`: maximum number of characters of the progress line.
  integer, parameter :: bar = 30, widest = 79
  !> Minimum time between two updates of the progress line (s).
  real(dp), parameter :: pause = 0.1_dp

contains

  !> Shows a bar for an activity of which the fraction `part` (0 to 1) is completed. If `part` is 1, the progress line is
  !> removed.
  subroutine show_fraction(activity, part)
    character(len=*), intent(in) :: activity
    real(dp), intent(in) :: part

    if (c_is_terminal(standard_error) == 0) return
    if (part < 1) then
      call show(activity // " " // bar_of(part))
    else
      call show("")
    end if
  end subroutine show_fraction

  !> Begins to show the progress of a computation with `all` points.
  subroutine start(self, all)
    class(terminal_type), intent(inout) :: self
    integer(int64), intent(in) :: all

    self%done = 0
    self%line_visible = .false.
    self%on_terminal = c_is_terminal(standard_error) /= 0
    self%all = all
    self%begin = now()
    self%last = self%begin
  end subroutine start

  !> Adds newly completed points to the number of completed points, and updates the progress line.
  subroutine add(self, points)
    class(terminal_type), intent(inout) :: self
    integer(int64), intent(in) :: points
    real(dp) :: time, rate

    self%done = self%done + points
    time = now()
    if (.not. self%on_terminal .or. time < self%last + pause) return
    self%last = time
    self%line_visible = .true.
    rate = real(self%done, dp) / (time - self%begin)
    call show(bar_of(real(self%done, dp) / real(self%all, dp)) // " " // text(int(100 * self%done / self%all)) // " %, " &
      & // concise(rate, 3) // " points/s, " // duration(real(self%all - self%done, dp) / rate) // " left")
  end subroutine add

  !> Removes the progress line.
  subroutine clear(self)
    class(terminal_type), intent(inout) :: self

    if (self%line_visible) call show("")
  end subroutine clear

  !> Replaces the text of the progress line by `words`.
  subroutine show(words)
    character(len=*), intent(in) :: words
    logical :: done

    call write_bytes(standard_error, achar(13) // words // repeat(" ", max(0, widest - len(words))) // achar(13), done)
  end subroutine show

  !> Text that represents a bar of which the fraction `part` (0 to 1) is filled.
  pure character(len=bar + 2) function bar_of(part) result(words)
    real(dp), intent(in) :: part
    integer :: done

    done = nint(bar * part)
    words = "[" // repeat("#", done) // repeat(".", bar - done) // "]"
  end function bar_of

  !> Text for a duration in seconds, such as 59 s, 59:59 or 59:59:59.
  pure function duration(seconds) result(words)
    real(dp), intent(in) :: seconds
    character(len=:), allocatable :: words
    character(len=24) :: buffer
    integer :: left

    left = nint(min(seconds, 1.0e9_dp))
    if (left < 60) then
      write (buffer, "(i0, a)") left, " s"
    else if (left < 3600) then
      write (buffer, "(i0, ':', i2.2)") left / 60, mod(left, 60)
    else
      write (buffer, "(i0, ':', i2.2, ':', i2.2)") left / 3600, mod(left / 60, 60), mod(left, 60)
    end if
    words = trim(buffer)
  end function duration

  !> Current reading of the system clock in seconds.
  real(dp) function now()
    integer(int64) :: ticks, rate

    call system_clock(ticks, rate)
    now = real(ticks, dp) / real(rate, dp)
  end function now

end module gestell_run_terminal
