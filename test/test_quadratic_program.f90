!> Quadratic programs against the conditions of Karush, Kuhn and Tucker, which are enough where a program is convex.
module test_quadratic_program
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_math_matrix, only: unit_matrix
  use gestell_math_optimum_quadratic_program, only: solve_quadratic_program
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_quadratic_program

contains

  subroutine collect_quadratic_program(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("solutions of random programs satisfy the Karush-Kuhn-Tucker conditions", test_random), &
      & new_unittest("a program with 2000 limits is solved quickly and correctly", test_many_groups), &
      & new_unittest("programs without a solution are reported", test_failures)]
  end subroutine collect_quadratic_program

  !> 200 programs of up to 8 parameters and 3 groups, with repeated branches, satisfy their optimality conditions: B d + sum of
  !> lambda a = 0, lambda >= 0, sums w, lambda only where the branch is the maximum of its group; d within the limits.
  subroutine test_random(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: branches = 30, n = 8
    real(dp) :: b(n, n), a(n, 2 * branches), v(2 * branches), d(n), lambda(2 * branches), model(2 * branches), w(3), top
    integer :: group(2 * branches), i, g
    type(gestell_error), allocatable :: failure

    do i = 1, 200
      call numbers(i, b)
      b = matmul(b, transpose(b)) + 1.0e-3_dp * unit_matrix(n)
      call numbers(i + 1000, a(:, :branches))
      a(:, branches + 1:) = a(:, :branches)
      v(:branches) = a(1, branches:1:-1)
      v(branches + 1:) = v(:branches)
      group(:branches) = [(modulo(g, 4), g = 1, branches)]
      group(branches + 1:) = group(:branches)
      where (group == 0) v = -abs(v)
      w = [1.0_dp, 0.3_dp, 5.0_dp]
      call solve_quadratic_program(b, w, group, v, a, d, lambda, failure)
      call check_success(error, failure, "program " // text(i))
      model = v + matmul(d, a)
      call check_that(error, lambda, ">=", 0.0_dp)
      call check_that(error, abs(matmul(b, d) + matmul(a, lambda)), "<=", 1.0e-11_dp)
      call check_that(error, abs([(sum(lambda, group == g), g = 1, 3)] - w), "<=", 1.0e-12_dp)
      do g = 0, 3
        top = maxval(model, group == g)
        if (g == 0) top = 0
        call check_that(error, pack(model, group == g), "<=", top + 1.0e-10_dp)
        call check_that(error, abs(pack(lambda * (model - top), group == g)), "<=", 1.0e-10_dp)
      end do
    end do
  end subroutine test_random

  !> The distance from the centre of a square, cut off by 2000 lines around it, each given by a group of a branch and zero. It
  !> is smallest at a point of the hull of the lines' normals; checked by the conditions of `test_random`. A method that solves
  !> for the multiplier of every group in every step would take more than a minute.
  subroutine test_many_groups(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: limits = 2000, n = 2
    real(dp), parameter :: heavy = 1.0e3_dp
    real(dp) :: a(n, 2 * limits + 1), v(2 * limits + 1), d(n), lambda(2 * limits + 1), turn
    integer :: group(2 * limits + 1), g
    type(gestell_error), allocatable :: failure

    do g = 1, limits
      turn = 1.0_dp * g / limits
      a(:, g) = -[cos(turn), sin(turn)]
    end do
    a(:, limits + 1:) = 0
    ! Each line lies at a distance of 1 from the start: a . d >= 1.
    v(:limits) = 1
    v(limits + 1:) = 0
    group = [(g, g = 1, limits), (g, g = 1, limits), limits + 1]
    call solve_quadratic_program(unit_matrix(n), [(heavy, g = 1, limits), 1.0_dp], group, v, a, d, lambda, failure)
    call check_success(error, failure, "2000 limits")
    if (allocated(error)) return
    call check_that(error, lambda, ">=", 0.0_dp)
    call check_that(error, abs(d + matmul(a, lambda)), "<=", 1.0e-9_dp)
    call check_that(error, v(:limits) + matmul(d, a(:, :limits)), "<=", 1.0e-9_dp)
    ! The first and the last line, at the angles 1/2000 and 1, meet the nearest point of all: on the bisector, at 1 / cos of half
    ! the angle between them.
    call check_that(error, abs(norm2(d) - 1 / cos((1 - 1.0_dp / limits) / 2)), "<=", 1.0e-9_dp, "distance")
  end subroutine test_many_groups

  !> Numbers from -1 to 1 that are always the same.
  pure subroutine numbers(seed, list)
    integer, intent(in) :: seed
    real(dp), intent(out) :: list(:, :)
    integer :: i, j, state

    state = modulo(7919 * seed + 17, 65537)
    do j = 1, size(list, 2)
      do i = 1, size(list, 1)
        state = modulo(75 * state + 74, 65537)
        list(i, j) = state / 32768.0_dp - 1
      end do
    end do
  end subroutine numbers

  !> B with a negative eigenvalue; d <= -1 and d >= 1.
  subroutine test_failures(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: d(1), lambda(3)
    type(gestell_error), allocatable :: failure

    call solve_quadratic_program(-unit_matrix(1), [1.0_dp], [1], [0.0_dp], reshape([1.0_dp], [1, 1]), d, lambda(:1), failure)
    call check_failure(error, failure, "not positive definite")
    call solve_quadratic_program(unit_matrix(1), [1.0_dp], [1, 0, 0], [0.0_dp, 1.0_dp, 1.0_dp], &
      & reshape([1.0_dp, 1.0_dp, -1.0_dp], [1, 3]), d, lambda, failure)
    call check_failure(error, failure, "no step satisfies all constraints")
  end subroutine test_failures

end module test_quadratic_program
