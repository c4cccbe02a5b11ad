!> Inner loops of elimination and of products for eight lanes. They are also compiled in versions for processors with long vectors
!> (gestell_base_processor), so that a portable build can use long vectors without a compiler flag. A panel has room for six
!> columns, of which a procedure processes three: callers pass the first element of these three columns.
module gestell_math_lanes_versions
  use gestell_base_processor, only: has_versions
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: four_columns, solve_with_lower, solve_with_upper, subtract_column, subtract_product

  !> `lanes`: number of matrices side by side. `block`: number of rows of a block. `width`: maximum number of columns of a panel.
  integer, parameter, public :: lanes = 8, block = 3, width = 6

contains

  !> Body of `subtract_product`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine subtract_here(terms, c, r, s, once) bind(C, name="lanes_gestell_subtract")
    !$omp declare simd uniform(terms, c, r, s) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: terms, once
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in) :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp) :: c11, c21, c31, c12, c22, c32, c13, c23, c33, r1, r2, r3, s1
    integer :: lane, k

    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      c11 = c(lane, 1, 1)
      c21 = c(lane, 2, 1)
      c31 = c(lane, 3, 1)
      c12 = c(lane, 1, 2)
      c22 = c(lane, 2, 2)
      c32 = c(lane, 3, 2)
      c13 = c(lane, 1, 3)
      c23 = c(lane, 2, 3)
      c33 = c(lane, 3, 3)
      k = 1
      do
        r1 = r(lane, 1, k)
        r2 = r(lane, 2, k)
        r3 = r(lane, 3, k)
        s1 = s(lane, 1, k)
        c11 = c11 - r1 * s1
        c12 = c12 - r2 * s1
        c13 = c13 - r3 * s1
        s1 = s(lane, 2, k)
        c21 = c21 - r1 * s1
        c22 = c22 - r2 * s1
        c23 = c23 - r3 * s1
        s1 = s(lane, 3, k)
        c31 = c31 - r1 * s1
        c32 = c32 - r2 * s1
        c33 = c33 - r3 * s1
        k = k + 1
        if (k > terms) exit
      end do
      c(lane, 1, 1) = c11
      c(lane, 2, 1) = c21
      c(lane, 3, 1) = c31
      c(lane, 1, 2) = c12
      c(lane, 2, 2) = c22
      c(lane, 3, 2) = c32
      c(lane, 1, 3) = c13
      c(lane, 2, 3) = c23
      c(lane, 3, 3) = c33
    end do
  end subroutine subtract_here

  !> Computes C <- C - R S in all lanes. R has `terms` columns, S has `terms` rows. `length`: number of double precision numbers in
  !> a vector register.
  pure subroutine subtract_product(length, terms, c, r, s)
    integer, intent(in) :: length, terms
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in) :: r(lanes, block, terms), s(lanes, width, terms)
    procedure(subtract_here), bind(C, name="_ZGVeN2uuuul_lanes_gestell_subtract") :: subtract_512
    procedure(subtract_here), bind(C, name="_ZGVdN2uuuul_lanes_gestell_subtract") :: subtract_256

    if (has_versions .and. length == 8) then
      call subtract_512(terms, c, r, s, 1)
    else if (has_versions .and. length == 4) then
      call subtract_256(terms, c, r, s, 1)
    else
      call subtract_here(terms, c, r, s, 1)
    end if
  end subroutine subtract_product

  !> Body of `subtract_column`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine column_here(terms, c, r, s, once) bind(C, name="lanes_gestell_column")
    !$omp declare simd uniform(terms, c, r, s) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: terms, once
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in) :: r(lanes, block, terms), s(lanes, width, terms)
    real(dp) :: c11, c12, c13, s1
    integer :: lane, k

    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      c11 = c(lane, 1, 1)
      c12 = c(lane, 1, 2)
      c13 = c(lane, 1, 3)
      k = 1
      do
        s1 = s(lane, 1, k)
        c11 = c11 - r(lane, 1, k) * s1
        c12 = c12 - r(lane, 2, k) * s1
        c13 = c13 - r(lane, 3, k) * s1
        k = k + 1
        if (k > terms) exit
      end do
      c(lane, 1, 1) = c11
      c(lane, 1, 2) = c12
      c(lane, 1, 3) = c13
    end do
  end subroutine column_here

  !> Computes C <- C - R S in all lanes, but only for the first column of C and S.
  pure subroutine subtract_column(length, terms, c, r, s)
    integer, intent(in) :: length, terms
    real(dp), intent(inout) :: c(lanes, width, block)
    real(dp), intent(in) :: r(lanes, block, terms), s(lanes, width, terms)
    procedure(column_here), bind(C, name="_ZGVeN2uuuul_lanes_gestell_column") :: column_512
    procedure(column_here), bind(C, name="_ZGVdN2uuuul_lanes_gestell_column") :: column_256

    if (has_versions .and. length == 8) then
      call column_512(terms, c, r, s, 1)
    else if (has_versions .and. length == 4) then
      call column_256(terms, c, r, s, 1)
    else
      call column_here(terms, c, r, s, 1)
    end if
  end subroutine subtract_column

  !> Body of `solve_with_upper`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine upper_here(w, u, l, multiplier, once) bind(C, name="lanes_gestell_upper")
    !$omp declare simd uniform(w, u, l, multiplier) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: once
    real(dp), intent(in) :: w(lanes, width, block), u(lanes, width, block)
    real(dp), intent(inout) :: l(lanes, block, block), multiplier(lanes)
    real(dp) :: l1, l2, l3
    integer :: lane, row

    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      do row = 1, 3
        l1 = w(lane, 1, row) * u(lane, 1, 1)
        l2 = (w(lane, 2, row) - l1 * u(lane, 2, 1)) * u(lane, 2, 2)
        l3 = (w(lane, 3, row) - l1 * u(lane, 3, 1) - l2 * u(lane, 3, 2)) * u(lane, 3, 3)
        l(lane, row, 1) = l1
        l(lane, row, 2) = l2
        l(lane, row, 3) = l3
        multiplier(lane) = max(multiplier(lane), abs(l1), abs(l2), abs(l3))
      end do
    end do
  end subroutine upper_here

  !> Computes L <- W U^-1 in all lanes. The diagonal of U contains the reciprocals of the pivots. `multiplier` becomes the largest
  !> absolute value of an element of L if this exceeds its old value.
  pure subroutine solve_with_upper(length, w, u, l, multiplier)
    integer, intent(in) :: length
    real(dp), intent(in) :: w(lanes, width, block), u(lanes, width, block)
    real(dp), intent(inout) :: l(lanes, block, block), multiplier(lanes)
    procedure(upper_here), bind(C, name="_ZGVeN2uuuul_lanes_gestell_upper") :: upper_512
    procedure(upper_here), bind(C, name="_ZGVdN2uuuul_lanes_gestell_upper") :: upper_256

    if (has_versions .and. length == 8) then
      call upper_512(w, u, l, multiplier, 1)
    else if (has_versions .and. length == 4) then
      call upper_256(w, u, l, multiplier, 1)
    else
      call upper_here(w, u, l, multiplier, 1)
    end if
  end subroutine solve_with_upper

  !> Body of `solve_with_lower`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine lower_here(w, l, once) bind(C, name="lanes_gestell_lower")
    !$omp declare simd uniform(w, l) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: once
    real(dp), intent(inout) :: w(lanes, width, block)
    real(dp), intent(in) :: l(lanes, block, block)
    integer :: lane, column

    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      do column = 1, 3
        w(lane, column, 2) = w(lane, column, 2) - l(lane, 2, 1) * w(lane, column, 1)
        w(lane, column, 3) = w(lane, column, 3) - l(lane, 3, 1) * w(lane, column, 1) - l(lane, 3, 2) * w(lane, column, 2)
      end do
    end do
  end subroutine lower_here

  !> Computes W <- L^-1 W in all lanes. The diagonal of L is 1.
  pure subroutine solve_with_lower(length, w, l)
    integer, intent(in) :: length
    real(dp), intent(inout) :: w(lanes, width, block)
    real(dp), intent(in) :: l(lanes, block, block)
    procedure(lower_here), bind(C, name="_ZGVeN2uul_lanes_gestell_lower") :: lower_512
    procedure(lower_here), bind(C, name="_ZGVdN2uul_lanes_gestell_lower") :: lower_256

    if (has_versions .and. length == 8) then
      call lower_512(w, l, 1)
    else if (has_versions .and. length == 4) then
      call lower_256(w, l, 1)
    else
      call lower_here(w, l, 1)
    end if
  end subroutine solve_with_lower

  !> Body of `four_columns`, compiled in one version for each vector length (gestell_base_processor).
  pure subroutine four_here(terms, a, b, c, once) bind(C, name="lanes_gestell_four")
    !$omp declare simd uniform(terms, a, b, c) linear(once) simdlen(2) notinbranch
    integer(c_int), value :: terms, once
    real(dp), intent(in) :: a(lanes, terms), b(terms, 4)
    real(dp), intent(inout) :: c(lanes, 4)
    real(dp) :: c1, c2, c3, c4, row
    integer :: lane, k

    ! Return: the second of two vectorised calls has nothing to do (see gestell_base_processor).
    if (once > 1) return
    !GCC$ ivdep
    do lane = 1, lanes
      c1 = 0
      c2 = 0
      c3 = 0
      c4 = 0
      k = 1
      do
        row = a(lane, k)
        c1 = c1 + row * b(k, 1)
        c2 = c2 + row * b(k, 2)
        c3 = c3 + row * b(k, 3)
        c4 = c4 + row * b(k, 4)
        k = k + 1
        if (k > terms) exit
      end do
      c(lane, 1) = c1
      c(lane, 2) = c2
      c(lane, 3) = c3
      c(lane, 4) = c4
    end do
  end subroutine four_here

  !> Computes four columns of C = A B. Each lane contains one row of A and the same row of C.
  pure subroutine four_columns(length, terms, a, b, c)
    integer, intent(in) :: length, terms
    real(dp), intent(in) :: a(lanes, terms), b(terms, 4)
    real(dp), intent(inout) :: c(lanes, 4)
    procedure(four_here), bind(C, name="_ZGVeN2uuuul_lanes_gestell_four") :: four_512
    procedure(four_here), bind(C, name="_ZGVdN2uuuul_lanes_gestell_four") :: four_256

    if (has_versions .and. length == 8) then
      call four_512(terms, a, b, c, 1)
    else if (has_versions .and. length == 4) then
      call four_256(terms, a, b, c, 1)
    else
      call four_here(terms, a, b, c, 1)
    end if
  end subroutine four_columns

end module gestell_math_lanes_versions
