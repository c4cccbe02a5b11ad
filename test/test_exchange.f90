!> Results that pass through records, as after an interruption, agree with results that were computed directly.
module test_exchange
  use checks, only: check_success, check_that
  use gestell_base_error, only: failure_type => error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_input_namelist, only: parse_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema_check, only: check_document
  use gestell_output_result, only: result_type
  use gestell_task_common_context, only: context_type
  use gestell_task_common_executor, only: executor_type, work_type
  use gestell_task_common_record, only: record_type
  use gestell_task_common_task, only: any_task_type
  use gestell_task_registry, only: input_schema, read_input
  use gestell_task_registry_run, only: prepare_tasks, run_tasks
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none (type, external)
  private

  public :: collect_exchange

  !> Computes each piece of work with a copy of the work. The work itself receives only the record of the result.
  type, extends(executor_type) :: recording_executor
    !> `records`: number of results that passed through a record. `incomplete`: number of records that were not read to their ends
    integer :: records = 0, incomplete = 0
  contains
    procedure :: distribute
  end type recording_executor

  !> A frame with three degrees of freedom, carrying a slider-crank.
  character(len=*), parameter :: machine = "&drive speed_rpm=240 / &joint name='O' type='ground' position=0,0 /" &
    & // "&joint name='A' type='crank' pivot='O' radius=0.06 /" &
    & // "&joint name='B' type='RRP' ends='A' lengths=0.3 guide_point=0,0 guide_angle=90 branch=1 /" &
    & // "&link name='crank' from='O' to='A' mass=1 inertia=0.004 center=0.02,0 /" &
    & // "&link name='rod' from='A' to='B' mass=0.5 inertia=0.005 center=0.1,0 /" &
    & // "&link name='piston' from='B' mass=1.5 inertia=0 /" &
    & // "&frame mass=40 inertia=2 origin=0.05,0.2 /" &
    & // "&support position=-0.3,-0.2 stiffness=2e4,4e4 damping=40,60 /" &
    & // "&support position=0.3,-0.2 stiffness=2e4,4e4 damping=40,60 /"
  !> An eccentric that rocks its frame, which parametric resonance makes unstable between 218 and 246 rpm.
  character(len=*), parameter :: rocking = "&drive speed_rpm=229 / &joint name='O' type='ground' position=0,0 /" &
    & // "&joint name='A' type='crank' pivot='O' radius=0.12 /" &
    & // "&link name='eccentric' from='O' to='A' mass=9 inertia=0.02 center=0.12,0 /" &
    & // "&frame mass=40 inertia=2 origin=0.5,0 dof='psi' / &foundation stiffness=0,0,0,0,0,0,0,0,630 damping=0,0,1.5 /"
  character(len=*), parameter :: at_rest = "&model frame='rest' /"
  character(len=*), parameter :: speeds = "&sweep parameter='drive.speed_rpm' "

contains

  subroutine collect_exchange(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("results over the speed agree after passing through records", test_speeds), &
      & new_unittest("borders agree after passing through records", test_borders), &
      & new_unittest("crossings of a level agree after passing through records", test_levels), &
      & new_unittest("designs and sensitivities agree after passing through records", test_designs)]
  end subroutine collect_exchange

  !> Computes pieces of work one after the other, each with a copy of the work.
  subroutine distribute(self, work, pieces, error, points)
    class(recording_executor), intent(inout) :: self
    class(work_type), intent(inout) :: work
    integer, intent(in) :: pieces(:)
    type(failure_type), allocatable, intent(out) :: error
    integer(int64), intent(in), optional :: points(:)
    class(work_type), allocatable :: copy
    type(record_type) :: record
    integer :: i

    do i = 1, size(pieces)
      if (allocated(copy)) deallocate(copy)
      allocate(copy, source=work)
      call copy%compute(pieces(i), error)
      if (allocated(error)) return
      call record%begin()
      call copy%exchange(pieces(i), record)
      if (size(record%words) == 0) then
        call work%compute(pieces(i), error)
        cycle
      end if
      call record%begin((record%words))
      call work%exchange(pieces(i), record)
      self%records = self%records + 1
      if (.not. record%is_complete()) self%incomplete = self%incomplete + 1
    end do
    associate (unused_points => points)
    end associate
  end subroutine distribute

  subroutine test_speeds(error)
    type(error_type), allocatable, intent(out) :: error

    call compare(error, "&case tasks='campbell','critical','resonance' / &model frame='rest' / &resonance orders=3 /" &
      & // speeds // "from=200 to=420 count=3 /")
  end subroutine test_speeds

  subroutine test_borders(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: inertias = "&sweep parameter='frame.inertia' from=2 to=3 count=3 /"

    call compare(error, "&case tasks='boundary' /" // at_rest // speeds // "from=200 to=420 count=3 /")
    call compare(error, "&case tasks='boundary' /" // at_rest // speeds // "from=200 to=250 count=3 /", rocking)
    call compare(error, "&case tasks='boundary' /" // speeds // "from=200 to=250 count=3 /", rocking)
    call compare(error, "&case tasks='boundary' /" // at_rest // speeds // "from=200 to=250 count=3 /" // inertias, rocking)
  end subroutine test_borders

  subroutine test_levels(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: of_level = "&case tasks='boundary' / " // at_rest &
      & // "&boundary quantity='f' measure='rms' level=60 /"

    call compare(error, of_level // speeds // "from=200 to=420 count=3 /")
    call compare(error, of_level // speeds // "from=250 to=330 count=3 / &sweep parameter='frame.mass' from=40 to=50 count=3 /")
  end subroutine test_levels

  subroutine test_designs(error)
    type(error_type), allocatable, intent(out) :: error

    call compare(error, "&case tasks='design','sensitivity' / &model frame='rest' / &objective quantity='f' /" &
      & // "&sensitivity parameters='frame.mass','support.stiffness' /" &
      & // "&design parameter='support.stiffness' from=1e4 to=5e4 starts=3 / &design parameter='support.damping' from=10 to=500 /" &
      & // "&constraint quantity='eta' measure='peak' at_most=1.4e-3 / &constraint quantity='xi' at_most=1e-3 /")
  end subroutine test_designs

  !> Compares reports and tables of two runs: with an executor of the program, and with records.
  subroutine compare(error, input, frame)
    type(error_type), allocatable, intent(inout) :: error
    !> What is added to the description of the machine
    character(len=*), intent(in) :: input
    !> Description of the machine; by default `machine`
    character(len=*), intent(in), optional :: frame
    character(len=:), allocatable :: groups
    type(context_type) :: context(2)
    type(result_type) :: results(2)
    type(failure_type), allocatable :: failure
    integer :: i, k

    if (allocated(error)) return
    groups = machine // input
    if (present(frame)) groups = frame // input
    allocate(recording_executor :: context(2)%executor)
    do k = 1, 2
      call solve(groups, context(k), results(k), failure)
      call check_success(error, failure, input)
    end do
    if (allocated(error)) return
    select type (executor => context(2)%executor)
    type is (recording_executor)
      call check_that(error, executor%records, ">", 0, "records of " // input)
      call check_that(error, executor%incomplete, "==", 0, "records that were not read to the end: " // input)
    end select
    if (allocated(error)) return
    call check(error, results(2)%report, results(1)%report)
    call check_that(error, size(results(2)%tables), "==", size(results(1)%tables), "tables")
    if (allocated(error)) return
    do i = 1, size(results(1)%tables)
      associate (one => results(1)%tables(i), other => results(2)%tables(i))
        call check(error, other%name, one%name)
        do k = 1, size(one%columns)
          if (.not. allocated(one%columns(k)%numbers) .or. allocated(error)) cycle
          call check_that(error, differing(one%columns(k)%numbers, other%columns(k)%numbers), "==", 0, &
            & "different numbers in column " // text(k) // " of " // one%name)
        end do
      end associate
    end do
  end subroutine compare

  !> Number of places at which two lists have different bits. Bits are compared because a missing number is NaN.
  pure integer function differing(one, other)
    real(dp), intent(in) :: one(:), other(:)

    differing = count(transfer(one, [0_int64]) /= transfer(other, [0_int64])) + abs(size(one) - size(other))
  end function differing

  !> Runs the tasks of an input with the executor of `context`, or the usual one if it has none.
  subroutine solve(input, context, result, failure)
    character(len=*), intent(in) :: input
    type(context_type), intent(inout) :: context
    type(result_type), intent(inout) :: result
    type(failure_type), allocatable, intent(out) :: failure
    type(any_task_type), allocatable :: tasks(:)
    type(document_type) :: document

    call parse_document(input, "in.nml", document, failure)
    if (.not. allocated(failure)) call check_document(document, input_schema(), failure)
    if (.not. allocated(failure)) call read_input(document, input_schema(), tasks, context%configuration, failure)
    if (allocated(failure)) return
    context%keep_all_rows = .true.
    context%verbose = .true.
    call prepare_tasks(tasks, context, result, failure)
    if (.not. allocated(failure)) call run_tasks(tasks, context, result, failure)
  end subroutine solve

end module test_exchange
