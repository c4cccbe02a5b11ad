!> The tests' own comparisons fail when they must, with the right failure text.
module test_checks
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: failure_type => error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: collect_checks

contains

  subroutine collect_checks(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("each relation holds or fails for numbers of every kind", test_relations), &
      & new_unittest("failure texts contain the found and the wanted numbers", test_failure_texts), &
      & new_unittest("checks of library failures compare presence, message and code", test_failures)]
  end subroutine collect_checks

  subroutine test_relations(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=2), parameter :: relations(*) = ["< ", "<=", "> ", ">=", "==", "/=", "=<"]
    logical, parameter :: expected(7, -1:1) = reshape([ &
      & .true., .true., .false., .false., .false., .true., .false., &
      & .false., .true., .false., .true., .true., .false., .false., &
      & .false., .false., .true., .true., .false., .true., .false.], [7, 3])
    integer :: i, k

    do i = -1, 1
      do k = 1, size(relations)
        call expect(trim(relations(k)), expected(k, i))
        if (allocated(error)) return
      end do
    end do

  contains

    !> i against 0 as numbers of every kind, alone and in a list; NaN, and a list of another length, in no relation.
    subroutine expect(relation, holds)
      character(len=*), intent(in) :: relation
      logical, intent(in) :: holds
      type(error_type), allocatable :: one
      logical :: good(6)

      call check_that(one, i, relation, 0)
      good(1) = allocated(one) .neqv. holds
      call forget(one)
      call check_that(one, real(i, dp), relation, 0.0_dp)
      good(2) = allocated(one) .neqv. holds
      call forget(one)
      call check_that(one, [real(i, dp), real(i, dp)], relation, [0.0_dp, 0.0_dp])
      good(3) = allocated(one) .neqv. holds
      call forget(one)
      call check_that(one, [real(i, dp), ieee_value(1.0_dp, ieee_quiet_nan)], relation, 0.0_dp)
      good(4) = allocated(one)
      call forget(one)
      call check_that(one, [real(i, dp)], relation, [0.0_dp, 0.0_dp])
      good(5) = allocated(one)
      call forget(one)
      call check_that(one, 0, "==", 0)
      good(6) = .not. allocated(one)
      call check(error, all(good), more=relation)
    end subroutine expect

  end subroutine test_relations

  subroutine test_failure_texts(error)
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: first

    call check_that(first, [1, 7, 2, 9], "<", [5, 5, 5, 8], "counts")
    call check(error, first%message, "counts: 2 wrong of 4; at 2: 7, wanted < 5; at 4: 9, wanted < 8")
    if (allocated(error)) call forget(first)
    if (allocated(error)) return
    call check_that(first, 1.0_dp, "<", 0.0_dp, "a second one")
    call check(error, first%message(:7), "counts:", more="the first is kept")
    call forget(first)
    if (allocated(error)) return
    call check_that(first, 0.125_dp, "<=", 0.1_dp, "x")
    call check(error, first%message, "x: 1.2500000000000000E-001, wanted <= 1.0000000000000001E-001")
    call forget(first)
    if (allocated(error)) return
    call check_that(first, "stable", "==", "unstable")
    call check(error, first%message, "'stable', wanted == 'unstable'")
    call forget(first)
    if (allocated(error)) return
    call check_that(first, [.true., .false.], "==", [.true., .true.])
    call check(error, first%message, "TF, wanted == TT")
    call forget(first)
  end subroutine test_failure_texts

  subroutine test_failures(error)
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: first
    type(failure_type), allocatable :: failure

    call check_success(first, failure)
    call check(error, .not. allocated(first), more="nothing failed")
    if (allocated(error)) return
    call check_failure(first, failure, what="a task")
    call check(error, first%message, "a task: no failure, wanted one")
    call forget(first)
    if (allocated(error)) return
    call fatal_error(failure, "no such joint", invalid_input)
    call check_failure(first, failure, "such", invalid_input)
    call check(error, .not. allocated(first), more="this one was wanted")
    if (allocated(error)) return
    call check_failure(first, failure, "link")
    call check(error, first%message, "'no such joint', wanted contains 'link'")
    call forget(first)
    if (allocated(error)) return
    call check_failure(first, failure, code=invalid_input + 1)
    call check(error, allocated(first), more="another code")
    call forget(first)
    if (allocated(error)) return
    call check_success(first, failure)
    call check(error, first%message, "'no such joint', wanted no failure")
    call forget(first)
  end subroutine test_failures

  !> An error of test-drive that goes out of scope stops the program, unless its status is 0.
  subroutine forget(error)
    type(error_type), allocatable, intent(inout) :: error

    if (.not. allocated(error)) return
    error%stat = 0
    deallocate(error)
  end subroutine forget

end module test_checks
