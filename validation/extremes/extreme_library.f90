!> What the library says about a case: the only place that calls it.
module extreme_library
  use extreme_cases, only: case_type
  use gestell_api_numerics, only: accuracy_type, analyse, analysis_type, error_type, frame_type, analysis_options
  use machines, only: frame_of_machine
  use reference_machine, only: dp
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: answer_type, ask_library

  !> What is declined stays unallocated, and the message says why. error_rho: relative, as claimed; error_x0: absolute.
  type :: answer_type
    character(len=9) :: verdict = 'none'
    real(dp), allocatable :: log_abs(:), arg(:), error_rho(:)
    real(dp), allocatable :: x0(:), error_x0(:)
    character(len=:), allocatable :: message
    real(dp) :: seconds = 0
  end type answer_type

contains

  subroutine ask_library(one, answer)
    type(case_type), intent(in) :: one
    type(answer_type), intent(out) :: answer
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(error_type), allocatable :: error
    integer(int64) :: begin, finish, rate

    answer%message = ''
    call system_clock(begin, rate)
    call frame_of_machine(one%machine, frame, error)
    if (.not. allocated(error)) call analyse(frame, analysis_options(model="rest"), accuracy_type(tolerance=one%tolerance), &
      & analysis, error)
    call system_clock(finish)
    answer%seconds = real(finish - begin, dp)/rate
    if (allocated(error)) answer%message = error%message
    if (allocated(analysis%multipliers)) then
      answer%verdict = analysis%multipliers%verdict()
      answer%log_abs = analysis%multipliers%log_abs
      answer%arg = analysis%multipliers%arg
      answer%error_rho = analysis%multipliers%error
    end if
    if (allocated(analysis%vibration)) then
      answer%x0 = analysis%vibration%start%x0
      answer%error_x0 = analysis%vibration%start%error
    end if
  end subroutine ask_library

end module extreme_library
