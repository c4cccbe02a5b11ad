!> One input: drawn, run, judged; and made smaller while its fault stays.
module fuzz_trial
  use gestell_run_command_line, only: word_type
  use fuzz_folder, only: clear, prepare
  use fuzz_input, only: input_type
  use fuzz_oracle, only: judge
  use fuzz_process, only: ending_type, run_apart
  use fuzz_schema, only: long_tasks
  use fuzz_text, only: newline
  use gestell_base_kinds, only: dp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: describe, minimise, try

  !> Seconds of the processor that a run may take, and those of tasks that compute hundreds of machines.
  real(dp), parameter :: usual = 0.25_dp, long = 1
  !> Runs that making an input smaller may take.
  integer, parameter :: most_runs = 400

contains

  !> Runs the input in `folder`, for one `part`-th of the usual time.
  subroutine try(input, folder, ending, fault, part)
    type(input_type), intent(in) :: input
    character(len=*), intent(in) :: folder
    type(ending_type), intent(out) :: ending
    character(len=:), allocatable, intent(out) :: fault
    integer(int64), intent(in), optional :: part
    real(dp) :: seconds
    logical :: clean

    call prepare(folder, input)
    seconds = allowed(input)
    if (present(part)) seconds = seconds / real(part, dp)
    call run_apart(input%words, folder, seconds, ending)
    fault = judge(input, ending, folder)
    call clear(folder, input, clean)
    ! parts of a sweep, and a run that was interrupted, leave what is done
    if (clean .or. fault /= "" .or. input%option("--part") .or. ending%code == 4 .or. ending%too_long()) return
    ! the folder may have another name then
    if (.not. input%garbled) fault = "left: files that have no business there"
  end subroutine try

  real(dp) function allowed(input)
    type(input_type), intent(in) :: input
    integer :: i, k

    allowed = usual
    do i = 1, size(long_tasks)
      if (index(input%document, trim(long_tasks(i))) > 0) allowed = long
      do k = 1, size(input%words)
        if (index(input%words(k)%text, trim(long_tasks(i))) > 0) allowed = long
      end do
    end do
  end function allowed

  !> Takes lines of the document and words of the command line away while the fault stays the same.
  subroutine minimise(input, fault, folder)
    type(input_type), intent(inout) :: input
    character(len=*), intent(in) :: fault, folder
    type(input_type) :: smaller
    integer :: runs, k, before

    runs = 0
    do
      before = len(input%document) + size(input%words)
      k = 1
      do while (k <= size(input%words))
        smaller = input
        smaller%words = [input%words(:k - 1), input%words(k + 1:)]
        if (.not. stays(smaller)) k = k + 1
      end do
      call shorten(newline)
      call shorten(",")
      if (len(input%document) + size(input%words) == before .or. runs >= most_runs) exit
    end do
  contains
    !> Whether the smaller one has the fault: then it takes the place of the other.
    logical function stays(smaller)
      type(input_type), intent(in) :: smaller
      type(ending_type) :: ending
      character(len=:), allocatable :: came

      stays = .false.
      if (runs >= most_runs) return
      runs = runs + 1
      call try(smaller, folder, ending, came)
      stays = came == fault
      if (stays) input = smaller
    end function stays

    !> Takes pieces between marks away, the last first.
    subroutine shorten(mark)
      character, intent(in) :: mark
      integer :: first, last
      logical :: shorter

      last = len(input%document)
      do while (last > 0)
        first = index(input%document(:last - 1), mark, back=.true.) + 1
        smaller = input
        smaller%document = input%document(:first - 1) // input%document(last + 1:)
        shorter = stays(smaller)
        last = first - 1
        if (.not. shorter .and. runs >= most_runs) return
      end do
    end subroutine shorten
  end subroutine minimise

  !> The input as one writes it down.
  function describe(input) result(words)
    type(input_type), intent(in) :: input
    character(len=:), allocatable :: words
    integer :: i

    words = "gestell"
    do i = 1, size(input%words)
      words = words // " [" // input%words(i)%text // "]"
    end do
    words = words // newline // input%document
  end function describe

end module fuzz_trial
