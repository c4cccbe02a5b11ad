!> The inner loops of elimination for six columns at once, where there are 32 registers for vectors (AVX-512): in 18 of them are
!> sums. As gestell_math_lanes_versions, whose procedures do the same for three.
!>
!> What is stored in `kept` nobody reads: as it might be one of the factors (`target`), GCC loads these once for all their products,
!> and not for each.
module gestell_math_lanes_six
  use gestell_base_processor, only: has_versions
  use gestell_math_lanes_versions, only: block, lanes, width
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: divide_six, reduce_six, subtract_six

  abstract interface
    !> As the procedures of one lane below, for the eight from `lane` on.
    pure subroutine subtract_lanes(c, r, s, kept, terms, lane) bind(C)
      import :: block, c_int, dp, lanes, width
      implicit none (type, external)
      real(dp), intent(inout) :: c(lanes, width, block)
      real(dp), intent(inout), target :: kept(lanes)
      integer(c_int), value :: terms, lane
      real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    end subroutine subtract_lanes

    pure subroutine reduce_lanes(c, r, s, l, kept, terms, lane) bind(C)
      import :: block, c_int, dp, lanes, width
      implicit none (type, external)
      real(dp), intent(inout) :: c(lanes, width, block)
      real(dp), intent(inout), target :: kept(lanes)
      integer(c_int), value :: terms, lane
      real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
      real(dp), intent(in) :: l(lanes, block, block)
    end subroutine reduce_lanes

    pure subroutine divide_lanes(c, r, s, u, l, multiplier, kept, terms, lane) bind(C)
      import :: block, c_int, dp, lanes, width
      implicit none (type, external)
      real(dp), intent(in) :: c(lanes, width, block), u(lanes, width, width)
      real(dp), intent(inout) :: l(lanes, block, width), multiplier(lanes)
      real(dp), intent(inout), target :: kept(lanes)
      integer(c_int), value :: terms, lane
      real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    end subroutine divide_lanes
  end interface

  procedure(subtract_lanes), bind(C, name="_ZGVeN8uuuuul_lanes_gestell_subtract_six") :: subtract_512
  procedure(reduce_lanes), bind(C, name="_ZGVeN8uuuuuul_lanes_gestell_reduce_six") :: reduce_512
  procedure(divide_lanes), bind(C, name="_ZGVeN8uuuuuuuul_lanes_gestell_divide_six") :: divide_512

contains

  !> C <- C - R S in all lanes, `terms` columns of R and rows of S.
  pure subroutine subtract_six(terms, c, r, s)
    integer, intent(in) :: terms
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), target :: kept(lanes)
    real(dp) :: c11, c21, c31, c41, c51, c61, c12, c22, c32, c42, c52, c62, c13, c23, c33, c43, c53, c63
    real(dp) :: r1, r2, r3, s1, s2, s3, s4, s5, s6
    integer :: lane, k

    if (has_versions) then
      call subtract_512(c, r, s, kept, terms, 1)
    else
      !GCC$ ivdep
      do lane = 1, lanes
        include "in_lane/sums_of_six.inc"
        include "in_lane/store_six.inc"
      end do
    end if
  end subroutine subtract_six

  !> C <- L^-1 (C - R S) in all lanes; L has ones on its diagonal.
  pure subroutine reduce_six(terms, c, r, s, l)
    integer, intent(in) :: terms
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), intent(in) :: l(lanes, block, block)
    real(dp), target :: kept(lanes)
    real(dp) :: c11, c21, c31, c41, c51, c61, c12, c22, c32, c42, c52, c62, c13, c23, c33, c43, c53, c63
    real(dp) :: r1, r2, r3, s1, s2, s3, s4, s5, s6
    real(dp) :: l21, l31, l32
    integer :: lane, k

    if (has_versions) then
      call reduce_512(c, r, s, l, kept, terms, 1)
    else
      !GCC$ ivdep
      do lane = 1, lanes
        include "in_lane/sums_of_six.inc"
        include "in_lane/lower_of_six.inc"
        include "in_lane/store_six.inc"
      end do
    end if
  end subroutine reduce_six

  !> L <- (C - R S) U^-1 in all lanes; in place of the pivots U has their reciprocals. `multiplier` becomes the greatest of the
  !> elements if that is greater.
  pure subroutine divide_six(terms, c, r, s, u, l, multiplier)
    integer, intent(in) :: terms
    real(dp), intent(in) :: c(lanes, width, block), u(lanes, width, width)
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), intent(inout) :: l(lanes, block, width), multiplier(lanes)
    real(dp), target :: kept(lanes)
    real(dp) :: c11, c21, c31, c41, c51, c61, c12, c22, c32, c42, c52, c62, c13, c23, c33, c43, c53, c63
    real(dp) :: r1, r2, r3, s1, s2, s3, s4, s5, s6
    integer :: lane, k

    if (has_versions) then
      call divide_512(c, r, s, u, l, multiplier, kept, terms, 1)
    else
      !GCC$ ivdep
      do lane = 1, lanes
        include "in_lane/sums_of_six.inc"
        include "in_lane/divide_six.inc"
      end do
    end if
  end subroutine divide_six

  !> These in one lane.
  pure subroutine subtract_in_lane(c, r, s, kept, terms, lane) bind(C, name="lanes_gestell_subtract_six")
    !$omp declare simd uniform(c, r, s, kept, terms) linear(lane) simdlen(8) notinbranch
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(inout), target :: kept(lanes)
    integer(c_int), value :: terms, lane
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp) :: c11, c21, c31, c41, c51, c61, c12, c22, c32, c42, c52, c62, c13, c23, c33, c43, c53, c63
    real(dp) :: r1, r2, r3, s1, s2, s3, s4, s5, s6
    integer :: k

    include "in_lane/sums_of_six.inc"
    include "in_lane/store_six.inc"
  end subroutine subtract_in_lane

  pure subroutine reduce_in_lane(c, r, s, l, kept, terms, lane) bind(C, name="lanes_gestell_reduce_six")
    !$omp declare simd uniform(c, r, s, l, kept, terms) linear(lane) simdlen(8) notinbranch
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(inout), target :: kept(lanes)
    integer(c_int), value :: terms, lane
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), intent(in) :: l(lanes, block, block)
    real(dp) :: c11, c21, c31, c41, c51, c61, c12, c22, c32, c42, c52, c62, c13, c23, c33, c43, c53, c63
    real(dp) :: r1, r2, r3, s1, s2, s3, s4, s5, s6
    real(dp) :: l21, l31, l32
    integer :: k

    include "in_lane/sums_of_six.inc"
    include "in_lane/lower_of_six.inc"
    include "in_lane/store_six.inc"
  end subroutine reduce_in_lane

  pure subroutine divide_in_lane(c, r, s, u, l, multiplier, kept, terms, lane) bind(C, name="lanes_gestell_divide_six")
    !$omp declare simd uniform(c, r, s, u, l, multiplier, kept, terms) linear(lane) simdlen(8) notinbranch
    real(dp), intent(in) :: c(lanes, width, block), u(lanes, width, width)
    real(dp), intent(inout) :: l(lanes, block, width), multiplier(lanes)
    real(dp), intent(inout), target :: kept(lanes)
    integer(c_int), value :: terms, lane
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp) :: c11, c21, c31, c41, c51, c61, c12, c22, c32, c42, c52, c62, c13, c23, c33, c43, c53, c63
    real(dp) :: r1, r2, r3, s1, s2, s3, s4, s5, s6
    integer :: k

    include "in_lane/sums_of_six.inc"
    include "in_lane/divide_six.inc"
  end subroutine divide_in_lane

end module gestell_math_lanes_six
