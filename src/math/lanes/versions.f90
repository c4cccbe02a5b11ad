!> The inner loops of elimination and of products for eight lanes, in versions for processors with long vectors, so that a portable
!> build needs no flag to use them. A compiler that has them (`has_versions`) makes of the procedures for one lane, at `!$omp
!> declare simd`, one for eight lanes for each kind of vectors, under names that follow from its arguments (u uniform, l linear) and
!> are called here. The names in C begin with "lanes", as the door for C exports what begins with "gestell". Three columns of a
!> panel begin with the element that is handed over.
module gestell_math_lanes_versions
  use gestell_base_processor, only: has_versions
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: four_columns, solve_with_lower, solve_with_upper, subtract_column, subtract_product

  !> As in gestell_math_lanes, which says what they are.
  integer, parameter, public :: lanes = 8, block = 3, width = 6

  abstract interface
    !> As the procedures of one lane below, for the eight from `lane` on.
    pure subroutine subtract_lanes(c, r, s, terms, lane) bind(C)
      import :: block, c_int, dp, lanes, width
      implicit none (type, external)
      real(dp), intent(inout) :: c(lanes, width, block)
      integer(c_int), value :: terms, lane
      real(dp), intent(in) :: r(lanes, block, terms), s(lanes, width, terms)
    end subroutine subtract_lanes

    pure subroutine upper_lanes(w, u, l, multiplier, lane) bind(C)
      import :: block, c_int, dp, lanes, width
      implicit none (type, external)
      real(dp), intent(in) :: w(lanes, width, block), u(lanes, width, block)
      real(dp), intent(inout) :: l(lanes, block, block), multiplier(lanes)
      integer(c_int), value :: lane
    end subroutine upper_lanes

    pure subroutine lower_lanes(w, l, lane) bind(C)
      import :: block, c_int, dp, lanes, width
      implicit none (type, external)
      real(dp), intent(inout) :: w(lanes, width, block)
      real(dp), intent(in) :: l(lanes, block, block)
      integer(c_int), value :: lane
    end subroutine lower_lanes

    pure subroutine four_lanes(terms, a, b, c, lane) bind(C)
      import :: c_int, dp, lanes
      implicit none (type, external)
      integer(c_int), value :: terms, lane
      real(dp), intent(in) :: a(lanes, terms), b(terms, 4)
      real(dp), intent(inout) :: c(lanes, 4)
    end subroutine four_lanes
  end interface

  procedure(subtract_lanes), bind(C, name="_ZGVeN8uuuul_lanes_gestell_subtract") :: subtract_512
  procedure(subtract_lanes), bind(C, name="_ZGVdN8uuuul_lanes_gestell_subtract") :: subtract_256
  procedure(subtract_lanes), bind(C, name="_ZGVeN8uuuul_lanes_gestell_column") :: column_512
  procedure(subtract_lanes), bind(C, name="_ZGVdN8uuuul_lanes_gestell_column") :: column_256
  procedure(upper_lanes), bind(C, name="_ZGVeN8uuuul_lanes_gestell_upper") :: upper_512
  procedure(upper_lanes), bind(C, name="_ZGVdN8uuuul_lanes_gestell_upper") :: upper_256
  procedure(lower_lanes), bind(C, name="_ZGVeN8uul_lanes_gestell_lower") :: lower_512
  procedure(lower_lanes), bind(C, name="_ZGVdN8uul_lanes_gestell_lower") :: lower_256
  procedure(four_lanes), bind(C, name="_ZGVeN8uuuul_lanes_gestell_four") :: four_512
  procedure(four_lanes), bind(C, name="_ZGVdN8uuuul_lanes_gestell_four") :: four_256

contains

  !> C <- C - R S in all lanes, `terms` columns of R and rows of S; `length`: of the processor's vectors.
  pure subroutine subtract_product(length, terms, c, r, s)
    integer, intent(in) :: length, terms
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in) :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp) :: c11, c21, c31, c12, c22, c32, c13, c23, c33, r1, r2, r3, s1
    integer :: lane, k

    if (has_versions .and. length == 8) then
      call subtract_512(c, r, s, terms, 1)
    else if (has_versions .and. length == 4) then
      call subtract_256(c, r, s, terms, 1)
    else
      !GCC$ ivdep
      do lane = 1, lanes
        include "in_lane/sums_of_three.inc"
        include "in_lane/store_three.inc"
      end do
    end if
  end subroutine subtract_product

  !> The first of these columns alone.
  pure subroutine subtract_column(length, terms, c, r, s)
    integer, intent(in) :: length, terms
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in) :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp) :: c11, c12, c13, s1
    integer :: lane, k

    if (has_versions .and. length == 8) then
      call column_512(c, r, s, terms, 1)
    else if (has_versions .and. length == 4) then
      call column_256(c, r, s, terms, 1)
    else
      !GCC$ ivdep
      do lane = 1, lanes
        include "in_lane/sums_of_one.inc"
      end do
    end if
  end subroutine subtract_column

  !> L <- W U^-1 in all lanes; `multiplier` becomes the greatest of the elements if that is greater.
  pure subroutine solve_with_upper(length, w, u, l, multiplier)
    integer, intent(in) :: length
    real(dp), intent(in) :: w(lanes, width, block), u(lanes, width, block)
    real(dp), intent(inout) :: l(lanes, block, block), multiplier(lanes)
    real(dp) :: l1, l2, l3
    integer :: lane, row

    if (has_versions .and. length == 8) then
      call upper_512(w, u, l, multiplier, 1)
    else if (has_versions .and. length == 4) then
      call upper_256(w, u, l, multiplier, 1)
    else
      !GCC$ ivdep
      do lane = 1, lanes
        include "in_lane/solve_with_upper.inc"
      end do
    end if
  end subroutine solve_with_upper

  !> W <- L^-1 W in all lanes.
  pure subroutine solve_with_lower(length, w, l)
    integer, intent(in) :: length
    real(dp), intent(inout) :: w(lanes, width, block)
    real(dp), intent(in) :: l(lanes, block, block)
    integer :: lane, column

    if (has_versions .and. length == 8) then
      call lower_512(w, l, 1)
    else if (has_versions .and. length == 4) then
      call lower_256(w, l, 1)
    else
      !GCC$ ivdep
      do lane = 1, lanes
        include "in_lane/solve_with_lower.inc"
      end do
    end if
  end subroutine solve_with_lower

  !> C = A B for as many rows of A and C as there are lanes, and four columns of B and C.
  pure subroutine four_columns(length, terms, a, b, c)
    integer, intent(in) :: length, terms
    real(dp), intent(in) :: a(lanes, terms), b(terms, 4)
    real(dp), intent(inout) :: c(lanes, 4)
    real(dp) :: c1, c2, c3, c4, row
    integer :: lane, k

    if (has_versions .and. length == 8) then
      call four_512(terms, a, b, c, 1)
    else if (has_versions .and. length == 4) then
      call four_256(terms, a, b, c, 1)
    else
      !GCC$ ivdep
      do lane = 1, lanes
        include "in_lane/four_columns.inc"
      end do
    end if
  end subroutine four_columns

  !> These in one lane.
  pure subroutine subtract_in_lane(c, r, s, terms, lane) bind(C, name="lanes_gestell_subtract")
    !$omp declare simd uniform(c, r, s, terms) linear(lane) simdlen(8) notinbranch
    real(dp), intent(inout) :: c(lanes, width, block)
    integer(c_int), value :: terms, lane
    real(dp), intent(in) :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp) :: c11, c21, c31, c12, c22, c32, c13, c23, c33, r1, r2, r3, s1
    integer :: k

    include "in_lane/sums_of_three.inc"
    include "in_lane/store_three.inc"
  end subroutine subtract_in_lane

  pure subroutine column_in_lane(c, r, s, terms, lane) bind(C, name="lanes_gestell_column")
    !$omp declare simd uniform(c, r, s, terms) linear(lane) simdlen(8) notinbranch
    real(dp), intent(inout) :: c(lanes, width, block)
    integer(c_int), value :: terms, lane
    real(dp), intent(in) :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp) :: c11, c12, c13, s1
    integer :: k

    include "in_lane/sums_of_one.inc"
  end subroutine column_in_lane

  pure subroutine upper_in_lane(w, u, l, multiplier, lane) bind(C, name="lanes_gestell_upper")
    !$omp declare simd uniform(w, u, l, multiplier) linear(lane) simdlen(8) notinbranch
    real(dp), intent(in) :: w(lanes, width, block), u(lanes, width, block)
    real(dp), intent(inout) :: l(lanes, block, block), multiplier(lanes)
    integer(c_int), value :: lane
    real(dp) :: l1, l2, l3
    integer :: row

    include "in_lane/solve_with_upper.inc"
  end subroutine upper_in_lane

  pure subroutine lower_in_lane(w, l, lane) bind(C, name="lanes_gestell_lower")
    !$omp declare simd uniform(w, l) linear(lane) simdlen(8) notinbranch
    real(dp), intent(inout) :: w(lanes, width, block)
    real(dp), intent(in) :: l(lanes, block, block)
    integer(c_int), value :: lane
    integer :: column

    include "in_lane/solve_with_lower.inc"
  end subroutine lower_in_lane

  pure subroutine four_in_lane(terms, a, b, c, lane) bind(C, name="lanes_gestell_four")
    !$omp declare simd uniform(terms, a, b, c) linear(lane) simdlen(8) notinbranch
    integer(c_int), value :: terms, lane
    real(dp), intent(in) :: a(lanes, terms), b(terms, 4)
    real(dp), intent(inout) :: c(lanes, 4)
    real(dp) :: c1, c2, c3, c4, row
    integer :: k

    include "in_lane/four_columns.inc"
  end subroutine four_in_lane

end module gestell_math_lanes_versions
