!> Small things about square matrices.
module gestell_math_matrix
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: balanced, unit_matrix

contains

  !> D^-1 A D with D = diag(d): the matrix in the units `d` of its states.
  pure function balanced(a, d)
    real(dp), intent(in) :: a(:, :), d(:)
    real(dp) :: balanced(size(d), size(d))

    balanced = a * spread(d, 1, size(d)) / spread(d, 2, size(d))
  end function balanced

  !> E, shape (n, n).
  pure function unit_matrix(n) result(e)
    integer, intent(in) :: n
    real(dp) :: e(n, n)
    integer :: i

    e = 0
    do i = 1, n
      e(i, i) = 1
    end do
  end function unit_matrix

end module gestell_math_matrix
