!> Tests that take more than a few seconds of processor time: `fpm test` skips them, `fpm test -- all` and `fpm test -- SUITE`
!> run them. All others together take two minutes.
module slow_tests
  use testdrive, only: new_unittest, test_interface, unittest_type
  implicit none (type, external)
  private

  public :: is_slow, new_slow

  character(len=*), parameter :: mark = "slow: "

  !> Tests that take longer (s of processor time) are reported by `fpm test`.
  real, parameter, public :: long = 8

contains

  type(unittest_type) function new_slow(name, test)
    character(len=*), intent(in) :: name
    procedure(test_interface) :: test

    new_slow = new_unittest(mark // name, test)
  end function new_slow

  pure logical function is_slow(test)
    type(unittest_type), intent(in) :: test

    is_slow = index(test%name, mark) == 1
  end function is_slow

end module slow_tests
