!> A run of the program in a process of its own (Linux): whatever it does, the fuzzer goes on.
module fuzz_process
  use gestell_run_command_line, only: word_type
  use gestell_run, only: execute
  use gestell_base_kinds, only: dp
  use gestell_run_process, only: prepare_process
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_intptr_t, c_long, c_null_char
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  implicit none (type, external)
  private

  public :: planted, run_apart

  !> How a run ended.
  type, public :: ending_type
    !> The exit code; -1 where it did not return by itself.
    integer :: code = -1
    !> The signal that ended it, 0: none. With neither code nor signal something stopped the program from within.
    integer :: signal = 0
    !> Processor time (s), memory at its largest (MB).
    real(dp) :: seconds = 0, megabytes = 0
  contains
    procedure :: too_long
  end type ending_type

  abstract interface
    subroutine planted()
      implicit none (type, external)
    end subroutine planted
  end interface

  interface
    integer(c_int) function c_fork() bind(c, name="fork")
      import :: c_int
      implicit none (type, external)
    end function c_fork

    integer(c_int) function c_wait4(process, status, options, usage) bind(c, name="wait4")
      import :: c_int, c_long
      implicit none (type, external)
      integer(c_int), value :: process, options
      integer(c_int), intent(out) :: status
      integer(c_long), intent(out) :: usage(*)
    end function c_wait4

    subroutine c_exit(code) bind(c, name="_exit")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: code
    end subroutine c_exit

    integer(c_int) function c_chdir(path) bind(c, name="chdir")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
    end function c_chdir

    integer(c_int) function c_creat(path, mode) bind(c, name="creat")
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_creat

    integer(c_int) function c_dup2(old, new) bind(c, name="dup2")
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: old, new
    end function c_dup2

    !> struct itimerval: seconds and microseconds of the interval and of the first time.
    integer(c_int) function c_setitimer(which, new, old) bind(c, name="setitimer")
      import :: c_int, c_long, c_intptr_t
      implicit none (type, external)
      integer(c_int), value :: which
      integer(c_long), intent(in) :: new(4)
      integer(c_intptr_t), value :: old
    end function c_setitimer

    !> struct rlimit: the soft and the hard one.
    integer(c_int) function c_setrlimit(which, limits) bind(c, name="setrlimit")
      import :: c_int, c_long
      implicit none (type, external)
      integer(c_int), value :: which
      integer(c_long), intent(in) :: limits(2)
    end function c_setrlimit
  end interface

  !> ITIMER_REAL with its SIGALRM, ITIMER_PROF with its SIGPROF; RLIMIT_FSIZE, RLIMIT_CORE, RLIMIT_AS.
  integer(c_int), parameter :: real_timer = 0, alarm = 14, processor_timer = 2, profile = 27
  integer(c_int), parameter :: file_size = 1, core_size = 4, address_space = 9
  integer(c_intptr_t), parameter :: none = 0
  !> The process ends with its exit code on top of this: no other way of ending looks like it.
  integer, parameter :: returned = 64
  !> Bytes that a run may write to one file, and take of memory; the rights of a file.
  integer(c_long), parameter :: largest_file = 256 * 1048576_c_long, most_memory = 4096 * 1048576_c_long
  integer(c_int), parameter :: rights = int(o"666", c_int)

contains

  !> Runs the program with `words` in the folder `folder`/case; what it says goes to `folder`/out and `folder`/err. It is
  !> ended after `seconds` of the processor, or twenty times as long by the clock.
  !> `plant`, where it is given, runs in the program's place.
  subroutine run_apart(words, folder, seconds, ending, plant)
    type(word_type), intent(in) :: words(:)
    character(len=*), intent(in) :: folder
    real(dp), intent(in) :: seconds
    type(ending_type), intent(out) :: ending
    procedure(planted), optional :: plant
    integer(c_int) :: process, status
    integer(c_long) :: usage(64)
    integer :: code

    flush (output_unit)
    process = c_fork()
    if (process < 0) error stop "fork failed"
    if (process == 0) then
      call enclose(folder, seconds)
      code = 0
      call prepare_process()
      if (present(plant)) then
        call plant()
      else
        call execute(words, code)
      end if
      flush (error_unit)
      flush (output_unit)
      call c_exit(int(returned + code, c_int))
    end if
    usage = 0
    if (c_wait4(process, status, 0_c_int, usage) /= process) error stop "wait4 failed"
    ending%seconds = real(usage(1) + usage(3), dp) + 1.0e-6_dp * real(usage(2) + usage(4), dp)
    ending%megabytes = real(usage(5), dp) / 1024
    ending%signal = iand(status, 127)
    if (ending%signal == 0) ending%code = iand(ishft(status, -8), 255) - returned
    if (ending%code < 0) ending%code = -1
  end subroutine run_apart

  !> What the run may see and use.
  subroutine enclose(folder, seconds)
    character(len=*), intent(in) :: folder
    real(dp), intent(in) :: seconds
    integer(c_int) :: status, handle

    handle = c_creat(folder // "/out" // c_null_char, rights)
    status = c_dup2(handle, 1_c_int)
    handle = c_creat(folder // "/err" // c_null_char, rights)
    status = c_dup2(handle, 2_c_int)
    status = c_chdir(folder // "/case" // c_null_char)
    if (status /= 0) call c_exit(1_c_int)
    status = c_setrlimit(core_size, [0_c_long, 0_c_long])
    status = c_setrlimit(file_size, [largest_file, largest_file])
    status = c_setrlimit(address_space, [most_memory, most_memory])
    status = c_setitimer(processor_timer, [0_c_long, 0_c_long, int(seconds, c_long), &
      & int(1.0e6_dp * (seconds - aint(seconds)), c_long)], none)
    status = c_setitimer(real_timer, [0_c_long, 0_c_long, 1 + int(20 * seconds, c_long), 0_c_long], none)
  end subroutine enclose

  !> Whether the run was ended because it took too long.
  pure logical function too_long(self)
    class(ending_type), intent(in) :: self

    too_long = self%signal == profile .or. self%signal == alarm
  end function too_long

end module fuzz_process
