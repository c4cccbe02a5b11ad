!> Columns of the unknowns of a node in the equations of eight steps of collocation (gestell_floquet_integrator_step_equations).
module gestell_floquet_integrator_step_unknowns
  use gestell_base_processor, only: has_versions, vector_length
  use gestell_math_lanes, only: lanes, width
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: fill_unknowns

  !> The most rows, unknowns and states, with which steps are eliminated in lanes: ten stages of six degrees of freedom.
  integer, parameter, public :: most_rows = 72

  abstract interface
    !> Seventeen arguments: a version as a whole has all from outside.
    pure subroutine fill_version(s, f, n, rows, nested, together, own, place, a, aa, values, sums, mass, damping, stiffness, &
      & panel, once) bind(C)
      import :: c_int, dp, lanes, most_rows, width
      implicit none (type, external)
      integer(c_int), value :: s, f, n, rows, nested, together, own, once
      integer(c_int), intent(in) :: place(most_rows + 1)
      real(dp), intent(in) :: a(s), aa(s), values(2), sums(most_rows, 2)
      real(dp), dimension(lanes, n, together), intent(in) :: mass, damping, stiffness
      real(dp), intent(inout) :: panel(lanes, width, rows)
    end subroutine fill_version
  end interface

  procedure(fill_version), bind(C, name="_ZGVeN2uuuuuuuuuuuuuuuul_lanes_gestell_fill") :: fill_512
  procedure(fill_version), bind(C, name="_ZGVdN2uuuuuuuuuuuuuuuul_lanes_gestell_fill") :: fill_256

contains

  !> The first columns of a panel, one to three `together`, of unknowns of node `j`, from their columns of M, h B and h^2 C, in the
  !> rows of s nodes with f unknowns that begin at `place`. `a`, `aa`: the columns of A and A A for node `j`. Of a nested tableau
  !> `values` and `sums` as in its layout. (But for the last two of a nested tableau the nodes follow each other without a gap.)
  !> Sixteen arguments: the columns and what they are made of.
  pure subroutine fill_unknowns(s, f, n, rows, nested, together, j, place, a, aa, values, sums, mass, damping, stiffness, panel)
    integer, intent(in) :: s, f, n, rows, together, j, place(most_rows + 1)
    logical, intent(in) :: nested
    real(dp), intent(in) :: a(s), aa(s), values(2), sums(most_rows, 2)
    real(dp), dimension(lanes, n, together), intent(in) :: mass, damping, stiffness
    real(dp), intent(inout) :: panel(lanes, width, rows)
    integer :: last_two, own

    last_two = merge(1, 0, nested)
    ! M stands in the rows of the node itself.
    own = merge(0, j, nested .and. j > s - 2)
    if (has_versions .and. vector_length() == 8) then
      call fill_512(s, f, n, rows, last_two, together, own, place, a, aa, values, sums, mass, damping, stiffness, panel, 1)
    else if (has_versions .and. vector_length() == 4) then
      call fill_256(s, f, n, rows, last_two, together, own, place, a, aa, values, sums, mass, damping, stiffness, panel, 1)
    else
      call fill_here(s, f, n, rows, last_two, together, own, place, a, aa, values, sums, mass, damping, stiffness, panel, 1)
    end if
  end subroutine fill_unknowns

  !> Three columns share the factors of the tableau; where there are no three the last one stands for those that are missing.
  !> Seventeen arguments: as above.
  pure subroutine fill_here(s, f, n, rows, nested, together, own, place, a, aa, values, sums, mass, damping, stiffness, panel, &
    & once) bind(C, name="lanes_gestell_fill")
    !$omp declare simd uniform(s, f, n, rows, nested, together, own, place, a, aa, values, sums, mass, damping, stiffness, panel) &
    !$omp& linear(once) simdlen(2) notinbranch
    integer(c_int), value :: s, f, n, rows, nested, together, own, once
    integer(c_int), intent(in) :: place(most_rows + 1)
    real(dp), intent(in) :: a(s), aa(s), values(2), sums(most_rows, 2)
    real(dp), dimension(lanes, n, together), intent(in) :: mass, damping, stiffness
    real(dp), intent(inout) :: panel(lanes, width, rows)
    ! Elements of the last two equations.
    real(dp), dimension(lanes, 3) :: next, last
    integer :: c2, c3, i, r, row, end_row, lane

    next = 0
    ! The second of two: gestell_base_processor.
    if (once > 1) return
    c2 = min(2, together)
    c3 = min(3, together)
    do r = 1, f
      if (nested > 0) then
        row = place(s - 1) + r
        end_row = place(s) + r
        do i = 1, together
          !GCC$ unroll 1
          do lane = 1, lanes
            next(lane, i) = a(s - 1) * damping(lane, row, i) + aa(s - 1) * stiffness(lane, row, i) + values(1) * mass(lane, row, i)
            last(lane, i) = a(s) * damping(lane, end_row, i) + aa(s) * stiffness(lane, end_row, i) &
              & + values(2) * mass(lane, end_row, i)
            panel(lane, i, row) = next(lane, i) + sums(s - 1, 2) * last(lane, i)
            panel(lane, i, end_row) = last(lane, i)
          end do
        end do
        do i = 1, s - 2
          row = f * (i - 1) + r
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, 1, row) = a(i) * damping(lane, row, 1) + aa(i) * stiffness(lane, row, 1) &
              & + sums(i, 1) * next(lane, 1) + sums(i, 2) * last(lane, 1)
          end do
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, c2, row) = a(i) * damping(lane, row, c2) + aa(i) * stiffness(lane, row, c2) &
              & + sums(i, 1) * next(lane, c2) + sums(i, 2) * last(lane, c2)
          end do
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, c3, row) = a(i) * damping(lane, row, c3) + aa(i) * stiffness(lane, row, c3) &
              & + sums(i, 1) * next(lane, c3) + sums(i, 2) * last(lane, c3)
          end do
        end do
      else
        do i = 1, s
          row = f * (i - 1) + r
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, 1, row) = a(i) * damping(lane, row, 1) + aa(i) * stiffness(lane, row, 1)
          end do
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, c2, row) = a(i) * damping(lane, row, c2) + aa(i) * stiffness(lane, row, c2)
          end do
          !GCC$ unroll 1
          do lane = 1, lanes
            panel(lane, c3, row) = a(i) * damping(lane, row, c3) + aa(i) * stiffness(lane, row, c3)
          end do
        end do
      end if
    end do
    if (own == 0) return
    do i = 1, together
      do row = place(own) + 1, place(own) + f
        !GCC$ unroll 1
        do lane = 1, lanes
          panel(lane, i, row) = panel(lane, i, row) + mass(lane, row, i)
        end do
      end do
    end do
  end subroutine fill_here

end module gestell_floquet_integrator_step_unknowns
