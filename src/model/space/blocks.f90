!> Blocks of matrices over many angles: of vectors and tensors, where some degrees of freedom are not there.
module gestell_model_space_blocks
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: add_block, add_cross

contains

  !> Adds `factor` [a] to these rows and columns of matrices over the angles, 0: one that is not there; a of shape (angles, 3).
  pure subroutine add_cross(matrices, factor, a, rows, columns)
    real(dp), contiguous, intent(inout) :: matrices(:, :, :)
    real(dp), intent(in) :: factor
    real(dp), contiguous, intent(in) :: a(:, :)
    integer, intent(in) :: rows(3), columns(3)
    integer :: i, next, last

    do i = 1, 3
      next = 1 + modulo(i, 3)
      last = 1 + modulo(i + 1, 3)
      if (rows(last) > 0 .and. columns(next) > 0) matrices(:, rows(last), columns(next)) = matrices(:, rows(last), columns(next)) &
        & + factor * a(:, i)
      if (rows(next) > 0 .and. columns(last) > 0) matrices(:, rows(next), columns(last)) = matrices(:, rows(next), columns(last)) &
        & - factor * a(:, i)
    end do
  end subroutine add_cross

  !> Adds a, shape (angles, 3, 3), to rows and columns `at`, 0: one that is not there.
  pure subroutine add_block(matrices, a, at)
    real(dp), contiguous, intent(inout) :: matrices(:, :, :)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    integer, intent(in) :: at(3)
    integer :: i, k

    do k = 1, 3
      do i = 1, 3
        if (at(i) > 0 .and. at(k) > 0) matrices(:, at(i), at(k)) = matrices(:, at(i), at(k)) + a(:, i, k)
      end do
    end do
  end subroutine add_block

end module gestell_model_space_blocks
