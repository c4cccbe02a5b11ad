!> Random inputs, sound, nearly sound and not, through the whole program; every output is looked through:
!>
!>     fpm run fuzz --directory validation/fuzz --profile release -- [INPUTS [FIRST [SEED [FILE [PART]]]]]
!>
!> runs inputs FIRST (default 1) to FIRST + INPUTS - 1 (default 10000) of SEED (default 1), each in a process of its own, and
!> stops with an error where one of them breaks what doc/input.md and doc/output.md promise. FILE keeps what is done: the
!> same command goes on where it ended. With PART an input has one PART-th of the usual time. Of each class of faults the first
!> input is made smaller and shown.
!>
!>     fuzz show NUMBER [SEED]     prints an input       fuzz self-test     faults that are planted must be found
program fuzz
  use gestell_run_command_line, only: word_type
  use fuzz_input, only: draw_input, input_type, read_corpus
  use fuzz_process, only: ending_type
  use fuzz_schema, only: load_registry
  use fuzz_self_test, only: test_itself
  use fuzz_tally, only: tally_type
  use fuzz_trial, only: describe, minimise, try
  use gestell_base_error, only: error_type
  use gestell_base_text, only: text
  use gestell_output_file_folder, only: make_folder
  use omp_lib, only: omp_set_num_threads
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64, output_unit
  implicit none (type, external)

  interface
    integer(c_int) function c_getpid() bind(c, name="getpid")
      import :: c_int
      implicit none (type, external)
    end function c_getpid
  end interface

  integer(int64), parameter :: default_inputs = 10000, saved_every = 1000
  type(word_type), allocatable :: corpus(:)
  character(len=:), allocatable :: folder
  type(input_type) :: input
  integer :: failed, status

  call omp_set_num_threads(1)
  call find_root()
  call load_registry()
  select case (word(1))
  case ("show")
    call draw_input(number(3, 1_int64), number(2, 1_int64), corpus, input)
    print "(a)", describe(input)
  case ("self-test")
    call make_place()
    call test_itself(folder, failed)
    call execute_command_line("rm -rf " // folder, exitstat=status)
    if (failed > 0) stop 1, quiet=.true.
  case default
    call make_place()
    call run_all(number(1, default_inputs), number(2, 1_int64), number(3, 1_int64), word(4), number(5, 1_int64))
  end select

contains

  !> Runs inputs `first` to `first` + `inputs` - 1.
  subroutine run_all(inputs, first, seed, file, part)
    integer(int64), intent(in) :: inputs, first, seed, part
    character(len=*), intent(in) :: file
    type(tally_type) :: tally
    type(ending_type) :: ending
    character(len=:), allocatable :: fault
    integer(int64) :: i, times

    tally%last = first - 1
    if (file /= "") call tally%load(file)
    do i = tally%last + 1, first + inputs - 1
      call draw_input(seed, i, corpus, input)
      call try(input, folder, ending, fault, part)
      call tally%add(i, ending, fault, times)
      if (times > 1) print "(a, i0, 2a)", "input ", i, ": ", fault
      if (times == 1) then
        if (ending%seconds < 0.1) call minimise(input, fault, folder)
        print "(/, a, i0, 3a)", "input ", i, ": ", fault, new_line("a") // describe(input)
      end if
      if (ending%too_long()) print "(a, i0, a)", "input ", i, ": took too long"
      if (file /= "" .and. (mod(i, saved_every) == 0 .or. i == first + inputs - 1)) call tally%save_to(file)
    end do
    call execute_command_line("rm -rf " // folder, exitstat=status)
    call tally%show()
    print "(/, i0, a, i0, a)", tally%inputs - tally%faults(), " passed, ", tally%faults(), " failed"
    flush (output_unit)
    if (tally%faults() > 0) stop 1, quiet=.true.
  end subroutine run_all

  !> The project's own inputs, from its folder or from this one.
  subroutine find_root()
    logical :: here

    inquire (file="data/khang_four_bar.nml", exist=here)
    if (here) then
      call read_corpus(".", corpus)
    else
      call read_corpus("../..", corpus)
    end if
  end subroutine find_root

  !> A folder of this process, in memory where the system has such a place.
  subroutine make_place()
    type(error_type), allocatable :: error
    logical :: there

    inquire (file="/dev/shm/.", exist=there)
    folder = merge("/dev/shm", "/tmp    ", there)
    folder = trim(folder) // "/gestell-fuzz-" // text(int(c_getpid()))
    call make_folder(folder, error)
    if (allocated(error)) error stop "no folder for the runs"
  end subroutine make_place

  function word(place)
    integer, intent(in) :: place
    character(len=:), allocatable :: word
    character(len=256) :: buffer

    call get_command_argument(place, buffer)
    word = trim(buffer)
  end function word

  integer(int64) function number(place, default)
    integer, intent(in) :: place
    integer(int64), intent(in) :: default
    character(len=:), allocatable :: digits
    integer :: status

    number = default
    digits = word(place)
    if (digits == "") return
    read (digits, *, iostat=status) number
    if (status /= 0 .or. number < 1) error stop "usage: fuzz [INPUTS [FIRST [SEED [FILE [PART]]]]]"
  end function number

end program fuzz
