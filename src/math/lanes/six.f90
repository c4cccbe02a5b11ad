!> Inner loops of elimination for six columns at once, for processors with 32 vector registers (AVX-512), of which 18 hold sums. The
!> procedures correspond to those of gestell_math_lanes_versions, which process three columns.
!>
!> The values stored in `kept` are never used. Because `kept` may overlap one of the factors (`target`), GCC loads each factor once
!> for all its products, instead of once for each product.
module gestell_math_lanes_six
  use gestell_base_processor, only: has_versions
  use gestell_math_lanes_versions, only: block, lanes, width
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: divide_six, reduce_six, subtract_six

contains

  !> Body of `subtract_six`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine subtract_here(terms, c, r, s, kept, once) bind(C, name="lanes_gestell_subtract_six")
    !$omp declare simd uniform(terms, c, r, s, kept) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: terms, once
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), intent(inout), target :: kept(lanes)
    real(dp) :: c11, c21, c31, c41, c51, c61, c12, c22, c32, c42, c52, c62, c13, c23, c33, c43, c53, c63
    real(dp) :: r1, r2, r3, s1, s2, s3, s4, s5, s6
    integer :: lane, k

    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      include "in_lane/sums_of_six.inc"
      include "in_lane/store_six.inc"
    end do
  end subroutine subtract_here

  !> Computes C <- C - R S in all lanes, for six columns of C and S. R has `terms` columns, S has `terms` rows.
  pure subroutine subtract_six(terms, c, r, s)
    integer, intent(in) :: terms
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), target :: kept(lanes)
    procedure(subtract_here), bind(C, name="_ZGVeN2uuuuul_lanes_gestell_subtract_six") :: subtract_512

    if (has_versions) then
      call subtract_512(terms, c, r, s, kept, 1)
    else
      call subtract_here(terms, c, r, s, kept, 1)
    end if
  end subroutine subtract_six

  !> Body of `reduce_six`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine reduce_here(terms, c, r, s, l, kept, once) bind(C, name="lanes_gestell_reduce_six")
    !$omp declare simd uniform(terms, c, r, s, l, kept) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: terms, once
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), intent(in) :: l(lanes, block, block)
    real(dp), intent(inout), target :: kept(lanes)
    real(dp) :: c11, c21, c31, c41, c51, c61, c12, c22, c32, c42, c52, c62, c13, c23, c33, c43, c53, c63
    real(dp) :: r1, r2, r3, s1, s2, s3, s4, s5, s6, l21, l31, l32
    integer :: lane, k

    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      include "in_lane/sums_of_six.inc"
      l21 = l(lane, 2, 1)
      l31 = l(lane, 3, 1)
      l32 = l(lane, 3, 2)
      c12 = c12 - l21 * c11
      c13 = c13 - l31 * c11 - l32 * c12
      c22 = c22 - l21 * c21
      c23 = c23 - l31 * c21 - l32 * c22
      c32 = c32 - l21 * c31
      c33 = c33 - l31 * c31 - l32 * c32
      c42 = c42 - l21 * c41
      c43 = c43 - l31 * c41 - l32 * c42
      c52 = c52 - l21 * c51
      c53 = c53 - l31 * c51 - l32 * c52
      c62 = c62 - l21 * c61
      c63 = c63 - l31 * c61 - l32 * c62
      include "in_lane/store_six.inc"
    end do
  end subroutine reduce_here

  !> Computes C <- L^-1 (C - R S) in all lanes, for six columns of C and S. The diagonal of L is 1.
  pure subroutine reduce_six(terms, c, r, s, l)
    integer, intent(in) :: terms
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), intent(in) :: l(lanes, block, block)
    real(dp), target :: kept(lanes)
    procedure(reduce_here), bind(C, name="_ZGVeN2uuuuuul_lanes_gestell_reduce_six") :: reduce_512

    if (has_versions) then
      call reduce_512(terms, c, r, s, l, kept, 1)
    else
      call reduce_here(terms, c, r, s, l, kept, 1)
    end if
  end subroutine reduce_six

  !> Body of `divide_six`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine divide_here(terms, c, r, s, u, l, multiplier, kept, once) bind(C, name="lanes_gestell_divide_six")
    !$omp declare simd uniform(terms, c, r, s, u, l, multiplier, kept) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: terms, once
    real(dp), intent(in) :: c(lanes, width, block), u(lanes, width, width)
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), intent(inout) :: l(lanes, block, width), multiplier(lanes)
    real(dp), intent(inout), target :: kept(lanes)
    real(dp) :: c11, c21, c31, c41, c51, c61, c12, c22, c32, c42, c52, c62, c13, c23, c33, c43, c53, c63
    real(dp) :: r1, r2, r3, s1, s2, s3, s4, s5, s6
    integer :: lane, k

    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      include "in_lane/sums_of_six.inc"
      c11 = c11 * u(lane, 1, 1)
      c21 = (c21 - c11 * u(lane, 2, 1)) * u(lane, 2, 2)
      c31 = (c31 - c11 * u(lane, 3, 1) - c21 * u(lane, 3, 2)) * u(lane, 3, 3)
      c41 = (c41 - c11 * u(lane, 4, 1) - c21 * u(lane, 4, 2) - c31 * u(lane, 4, 3)) * u(lane, 4, 4)
      c51 = (c51 - c11 * u(lane, 5, 1) - c21 * u(lane, 5, 2) - c31 * u(lane, 5, 3) - c41 * u(lane, 5, 4)) * u(lane, 5, 5)
      c61 = (c61 - c11 * u(lane, 6, 1) - c21 * u(lane, 6, 2) - c31 * u(lane, 6, 3) &
        & - c41 * u(lane, 6, 4) - c51 * u(lane, 6, 5)) * u(lane, 6, 6)
      c12 = c12 * u(lane, 1, 1)
      c22 = (c22 - c12 * u(lane, 2, 1)) * u(lane, 2, 2)
      c32 = (c32 - c12 * u(lane, 3, 1) - c22 * u(lane, 3, 2)) * u(lane, 3, 3)
      c42 = (c42 - c12 * u(lane, 4, 1) - c22 * u(lane, 4, 2) - c32 * u(lane, 4, 3)) * u(lane, 4, 4)
      c52 = (c52 - c12 * u(lane, 5, 1) - c22 * u(lane, 5, 2) - c32 * u(lane, 5, 3) - c42 * u(lane, 5, 4)) * u(lane, 5, 5)
      c62 = (c62 - c12 * u(lane, 6, 1) - c22 * u(lane, 6, 2) - c32 * u(lane, 6, 3) &
        & - c42 * u(lane, 6, 4) - c52 * u(lane, 6, 5)) * u(lane, 6, 6)
      c13 = c13 * u(lane, 1, 1)
      c23 = (c23 - c13 * u(lane, 2, 1)) * u(lane, 2, 2)
      c33 = (c33 - c13 * u(lane, 3, 1) - c23 * u(lane, 3, 2)) * u(lane, 3, 3)
      c43 = (c43 - c13 * u(lane, 4, 1) - c23 * u(lane, 4, 2) - c33 * u(lane, 4, 3)) * u(lane, 4, 4)
      c53 = (c53 - c13 * u(lane, 5, 1) - c23 * u(lane, 5, 2) - c33 * u(lane, 5, 3) - c43 * u(lane, 5, 4)) * u(lane, 5, 5)
      c63 = (c63 - c13 * u(lane, 6, 1) - c23 * u(lane, 6, 2) - c33 * u(lane, 6, 3) &
        & - c43 * u(lane, 6, 4) - c53 * u(lane, 6, 5)) * u(lane, 6, 6)
      l(lane, 1, 1) = c11
      l(lane, 2, 1) = c12
      l(lane, 3, 1) = c13
      l(lane, 1, 2) = c21
      l(lane, 2, 2) = c22
      l(lane, 3, 2) = c23
      l(lane, 1, 3) = c31
      l(lane, 2, 3) = c32
      l(lane, 3, 3) = c33
      l(lane, 1, 4) = c41
      l(lane, 2, 4) = c42
      l(lane, 3, 4) = c43
      l(lane, 1, 5) = c51
      l(lane, 2, 5) = c52
      l(lane, 3, 5) = c53
      l(lane, 1, 6) = c61
      l(lane, 2, 6) = c62
      l(lane, 3, 6) = c63
      multiplier(lane) = max(multiplier(lane), abs(c11), abs(c21), abs(c31), abs(c41), abs(c51), abs(c61))
      multiplier(lane) = max(multiplier(lane), abs(c12), abs(c22), abs(c32), abs(c42), abs(c52), abs(c62))
      multiplier(lane) = max(multiplier(lane), abs(c13), abs(c23), abs(c33), abs(c43), abs(c53), abs(c63))
    end do
  end subroutine divide_here

  !> Computes L <- (C - R S) U^-1 in all lanes. The diagonal of U contains the reciprocals of the pivots. `multiplier` becomes the
  !> largest absolute value of an element of L if this exceeds its old value.
  pure subroutine divide_six(terms, c, r, s, u, l, multiplier)
    integer, intent(in) :: terms
    real(dp), intent(in) :: c(lanes, width, block), u(lanes, width, width)
    real(dp), intent(in), target :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp), intent(inout) :: l(lanes, block, width), multiplier(lanes)
    real(dp), target :: kept(lanes)
    procedure(divide_here), bind(C, name="_ZGVeN2uuuuuuuul_lanes_gestell_divide_six") :: divide_512

    if (has_versions) then
      call divide_512(terms, c, r, s, u, l, multiplier, kept, 1)
    else
      call divide_here(terms, c, r, s, u, l, multiplier, kept, 1)
    end if
  end subroutine divide_six

end module gestell_math_lanes_six
