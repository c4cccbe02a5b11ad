!> The whole motion of a frame from its states: accelerations, and the forces of the guides that hold the degrees of freedom
!> that are not free.
module gestell_study_motion
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: accelerations, displacements, guide_forces, velocities
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: motion_errors, whole_motion

  !> Phases that are sampled at a time.
  integer, parameter :: block_length = 1024

contains

  !> The first `rows` rows of the motion (gestell_model_quantity) at `phases`, shape (rows, phases), from the states x of the
  !> free degrees of freedom there. `system`: the frame or its averaged model, whose solution x is.
  subroutine whole_motion(frame, system, phases, x, rows, motion)
    type(frame_type), intent(in) :: frame
    class(second_order_system), intent(in) :: system
    real(dp), intent(in) :: phases(:), x(:, :)
    integer, intent(in) :: rows
    real(dp), allocatable, intent(out) :: motion(:, :)
    integer :: f, first, last

    f = size(frame%free)
    allocate(motion(rows, size(phases)), source=0.0_dp)
    motion(frame%free, :) = x(:f, :)
    motion(displacements + frame%free, :) = x(f + 1:, :)
    do first = 1, merge(size(phases), 0, rows > velocities), block_length
      last = min(first + block_length - 1, size(phases))
      call add_accelerations(frame, system, phases(first:last), x(:, first:last), motion(:, first:last))
    end do
    if (rows >= guide_forces) call add_guides(frame, phases, motion)
  end subroutine whole_motion

  !> q'' from (23).
  subroutine add_accelerations(frame, system, phases, x, motion)
    type(frame_type), intent(in) :: frame
    class(second_order_system), intent(in) :: system
    real(dp), intent(in) :: phases(:), x(:, :)
    real(dp), intent(inout) :: motion(:, :)
    real(dp), allocatable :: p(:, :, :), load(:, :)
    integer :: f, k

    f = size(frame%free)
    allocate(p(2 * f, 2 * f, size(phases)), load(2 * f, size(phases)))
    call system%sample(phases, p, load)
    do k = 1, size(phases)
      motion(velocities + frame%free, k) = matmul(p(f + 1:, :, k), x(:, k)) + load(f + 1:, k)
    end do
  end subroutine add_accelerations

  !> What is missing in the equations (1) to (3) of the degrees of freedom that are not free: the guides exert it on the
  !> ground.
  subroutine add_guides(frame, phases, motion)
    type(frame_type), intent(in) :: frame
    real(dp), intent(in) :: phases(:)
    real(dp), intent(inout) :: motion(:, :)
    type(frame_type), allocatable :: whole
    real(dp), allocatable :: m(:, :, :), b(:, :, :), c(:, :, :), h(:, :), some(:)
    integer :: i, k

    if (size(frame%free) == 3) return
    allocate(whole, source=frame)
    whole%free = [1, 2, 3]
    allocate(m(size(phases), 3, 3), b(size(phases), 3, 3), c(size(phases), 3, 3), h(size(phases), 3))
    allocate(some, source=phases)
    call whole%sample_second_order(some, m, b, c, h)
    do k = 1, size(phases)
      do i = 1, 3
        if (any(frame%free == i)) cycle
        motion(accelerations + i, k) = h(k, i) - dot_product(m(k, i, :), motion(7:9, k)) &
          & - dot_product(b(k, i, :), motion(4:6, k)) - dot_product(c(k, i, :), motion(1:3, k))
      end do
    end do
  end subroutine add_guides

  !> How errors of the states, shape (states), show in the rows of the motion, shape (rows).
  subroutine motion_errors(frame, system, phases, states, errors)
    type(frame_type), intent(in) :: frame
    class(second_order_system), intent(in) :: system
    real(dp), intent(in) :: phases(:), states(:)
    real(dp), intent(out) :: errors(:)
    type(frame_type), allocatable :: whole
    real(dp), allocatable :: p(:, :, :), m(:, :, :), b(:, :, :), c(:, :, :), some(:)
    integer :: f, i, k

    f = size(frame%free)
    errors = 0
    errors(frame%free) = states(:f)
    errors(displacements + frame%free) = states(f + 1:)
    if (size(errors) <= velocities) return
    allocate(p(2 * f, 2 * f, size(phases)))
    call system%sample(phases, p)
    do k = 1, size(phases)
      errors(velocities + frame%free) = max(errors(velocities + frame%free), matmul(abs(p(f + 1:, :, k)), states))
    end do
    if (size(errors) < guide_forces .or. f == 3) return
    allocate(whole, source=frame)
    whole%free = [1, 2, 3]
    allocate(m(size(phases), 3, 3), b(size(phases), 3, 3), c(size(phases), 3, 3))
    allocate(some, source=phases)
    call whole%sample_second_order(some, m, b, c)
    do i = 1, 3
      if (any(frame%free == i)) cycle
      do k = 1, size(phases)
        errors(accelerations + i) = max(errors(accelerations + i), dot_product(abs(m(k, i, :)), errors(7:9)) &
          & + dot_product(abs(b(k, i, :)), errors(4:6)) + dot_product(abs(c(k, i, :)), errors(1:3)))
      end do
    end do
  end subroutine motion_errors

end module gestell_study_motion
