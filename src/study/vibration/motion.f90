!> Computes the complete motion of a frame from its states: accelerations, forces of the guides that lock degrees of freedom, and
!> rows that exist only for the exact frame (gestell_model_quantity_excess).
module gestell_study_vibration_motion
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_shaking, only: shaking_terms
  use gestell_model_pairs_rows, only: before_loads, compute_joint_forces, find_machine_pairs, joint_rows, load_count, &
    & plane_pairs_type
  use gestell_model_quantity_excess, only: add_moment_errors, add_turned, add_turned_errors, move_moments
  use gestell_model_quantity_rows, only: exact_rows, guide_forces, joint_forces, joint_sources, rows_of, velocities
  use gestell_system_averaged, only: averaged_system
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: add_joints, bound_joint_forces, complete_motion, motion_errors, motion_rows, sample_accelerations, whole_motion

  !> Accelerations of the free degrees of freedom at some phases as functions of the states x: q'' = P x + f (doc/theory.md,
  !> equations 20 to 22). `p`: P, shape (degrees of freedom, states, phases). `load`: f, shape (degrees of freedom, phases)
  type, public :: accelerations_type
    real(dp), allocatable :: p(:, :, :), load(:, :)
  end type accelerations_type

  !> Number of phases that are sampled together.
  integer, parameter :: block_length = 1024

contains

  !> Number of rows of the motion of `frame` up to and including the group `last`: `velocities`, `accelerations`, `guide_forces` or
  !> `joint_forces`. The motion of the exact frame always has all its rows except the joint forces.
  integer function motion_rows(frame, last)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: last

    motion_rows = rows_of(frame%dofs(), last)
    select type (frame)
    class is (varied_frame_type)
      motion_rows = exact_rows(frame)
    end select
    if (last >= joint_forces) motion_rows = exact_rows(frame) + joint_rows(frame)
  end function motion_rows

  !> Computes the complete motion at `phases` from the states x, which belong to the free degrees of freedom.
  subroutine whole_motion(frame, system, phases, x, last, accelerations, motion, parts)
    class(frame_type), intent(in) :: frame
    !> The system of which the states x are a solution: the frame or its averaged model
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    !> States, shape (states, phases)
    real(dp), intent(in) :: x(:, :)
    !> Last group of rows that is needed (see `motion_rows`)
    integer, intent(in) :: last
    !> The accelerations at the phases, by `sample_accelerations`
    type(accelerations_type), intent(in) :: accelerations
    !> The motion, shape (rows, phases)
    real(dp), allocatable, intent(out) :: motion(:, :)
    !> Parts of the joint forces that have one source each, if `last` is `joint_sources` (see `add_joints`)
    real(dp), allocatable, intent(out), optional :: parts(:, :, :)
    integer :: f, k, dofs

    f = size(frame%free)
    dofs = frame%dofs()
    allocate(motion(motion_rows(frame, last), size(phases)), source=0.0_dp)
    motion(frame%free, :) = x(:f, :)
    motion(dofs + frame%free, :) = x(f + 1:, :)
    if (size(motion, 1) <= rows_of(dofs, velocities)) return
    do k = 1, size(phases)
      motion(2 * dofs + frame%free, k) = matmul(accelerations%p(:, :, k), x(:, k)) + accelerations%load(:, k)
    end do
    if (size(motion, 1) >= rows_of(dofs, guide_forces)) call complete_motion(frame, system, phases, motion)
    if (last == joint_forces) call add_joints(frame, phases, motion)
    if (last == joint_sources) call add_joints(frame, phases, motion, parts)
  end subroutine whole_motion

  !> Computes the rows between the accelerations and the joint forces: forces of the guides, and rows that exist only for the exact
  !> frame. The positions, velocities and accelerations in `motion`, shape (rows, phases), need not satisfy the equations of motion.
  subroutine complete_motion(frame, system, phases, motion)
    class(frame_type), intent(in) :: frame
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(inout) :: motion(:, :)
    class(second_order_system), allocatable :: whole
    real(dp), allocatable :: x(:, :)
    integer :: first, last, dofs

    dofs = frame%dofs()
    call release_all_dofs(frame, system, whole)
    do first = 1, size(phases), block_length
      last = min(first + block_length - 1, size(phases))
      if (size(frame%free) < dofs) call add_guides(frame, whole, phases(first:last), motion(:, first:last))
      if (frame%about_rest) cycle
      if (size(frame%free) < dofs) call move_moments(frame, motion(:, first:last))
      x = motion([frame%free, dofs + frame%free], first:last)
      call add_turned(frame, x, motion(:exact_rows(frame), first:last))
    end do
  end subroutine complete_motion

  !> Computes the joint forces, which are the rows behind all others.
  subroutine add_joints(frame, phases, motion, parts)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(inout) :: motion(:, :)
    !> Parts of the joint forces that have one source each, shape (rows of the joint forces, phases, sources): inertia, weights, and
    !> each load
    real(dp), allocatable, intent(out), optional :: parts(:, :, :)
    type(plane_pairs_type), allocatable :: pairs(:)
    type(error_type), allocatable :: error

    associate (forces => motion(exact_rows(frame) + 1:, :))
      call find_machine_pairs(frame, pairs, error)
      if (.not. allocated(error)) then
        if (present(parts)) allocate(parts(size(forces, 1), size(phases), before_loads + load_count(pairs)))
        call compute_joint_forces(frame, pairs, phases, (motion(:3 * frame%dofs(), :)), forces, error, parts=parts)
      end if
      ! not reached: `find_quantity` has found the pairs, and a mechanism that turns has no dead point
      if (allocated(error)) forces = ieee_value(1.0_dp, ieee_quiet_nan)
    end associate
  end subroutine add_joints

  !> Bounds the errors of the joint forces that result from the errors of the motion and from `relative` errors of the links'
  !> accelerations.
  subroutine bound_joint_forces(frame, phases, motion, relative, errors)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(in) :: motion(:, :), relative
    real(dp), intent(inout) :: errors(:)
    type(plane_pairs_type), allocatable :: pairs(:)
    type(error_type), allocatable :: error
    !> Number of phases at which the bounds are evaluated, unless the period has fewer
    integer, parameter :: enough = 32
    real(dp), allocatable :: forces(:, :)
    integer :: every

    call find_machine_pairs(frame, pairs, error)
    if (allocated(error)) return
    every = max(1, size(phases) / enough)
    associate (some => phases(::every))
      allocate(forces(size(errors) - exact_rows(frame), size(some)))
      call compute_joint_forces(frame, pairs, some, motion(:, :size(phases):every), forces, error, &
        & errors(:3 * frame%dofs()), relative, errors(exact_rows(frame) + 1:))
    end associate
  end subroutine bound_joint_forces

  !> Samples the accelerations at `phases`, if the motion has rows for them.
  subroutine sample_accelerations(frame, system, phases, last, accelerations)
    class(frame_type), intent(in) :: frame
    !> The frame or its averaged model
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    !> Last group of rows that is needed (see `motion_rows`)
    integer, intent(in) :: last
    type(accelerations_type), intent(out) :: accelerations
    real(dp), allocatable :: p(:, :, :), load(:, :)
    integer :: f, from, to

    if (motion_rows(frame, min(last, guide_forces)) <= rows_of(frame%dofs(), velocities)) return
    f = size(frame%free)
    allocate(accelerations%p(f, 2 * f, size(phases)), accelerations%load(f, size(phases)))
    do from = 1, size(phases), block_length
      to = min(from + block_length - 1, size(phases))
      allocate(p(2 * f, 2 * f, from:to), load(2 * f, from:to))
      call system%sample(phases(from:to), p, load)
      accelerations%p(:, :, from:to) = p(f + 1:, :, :)
      accelerations%load(:, from:to) = load(f + 1:, :)
      deallocate(p, load)
    end do
  end subroutine sample_accelerations

  !> Returns a copy of the frame in which all degrees of freedom are free. The copy is an averaged model if `system` is averaged.
  subroutine release_all_dofs(frame, system, whole)
    class(frame_type), intent(in) :: frame
    class(periodic_system), intent(in) :: system
    class(second_order_system), allocatable, intent(out) :: whole
    class(frame_type), allocatable :: free
    type(averaged_system), allocatable :: model
    integer :: i

    allocate(free, source=frame)
    free%free = [(i, i = 1, frame%dofs())]
    free%states = 2 * frame%dofs()
    ! The guides exert what is left over in the exact equations, even if the vibration is a solution of the equations linearised
    ! about rest.
    select type (free)
    class is (varied_frame_type)
      free%newton = .true.
    end select
    select type (system)
    class is (averaged_system)
      allocate(model)
      call free%averaged(model)
      call move_alloc(model, whole)
    class default
      call move_alloc(free, whole)
    end select
  end subroutine release_all_dofs

  !> Computes the forces of the guides: the residuals of the equations of motion of the locked degrees of freedom. In `whole` all
  !> degrees of freedom are free.
  subroutine add_guides(frame, whole, phases, motion)
    class(frame_type), intent(in) :: frame
    class(second_order_system), intent(in) :: whole
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(inout) :: motion(:, :)
    real(dp), dimension(size(phases), frame%dofs(), frame%dofs()) :: m, b, c
    real(dp) :: h(size(phases), frame%dofs())
    integer :: i, k, n

    n = frame%dofs()
    call whole%sample_second_order(phases, m, b, c, h)
    do k = 1, size(phases)
      do i = 1, n
        if (any(frame%free == i)) cycle
        motion(3 * n + i, k) = h(k, i) - dot_product(m(k, i, :), motion(2 * n + 1:3 * n, k)) &
          & - dot_product(b(k, i, :), motion(n + 1:2 * n, k)) - dot_product(c(k, i, :), motion(:n, k))
      end do
    end do
  end subroutine add_guides

  !> Computes bounds on the errors of the rows of the motion that are caused by errors of the states.
  subroutine motion_errors(frame, system, phases, states, parts, accelerations, motion, errors)
    !> The frame whose motion was computed
    class(frame_type), intent(in) :: frame
    !> The system of which the states are a solution: the frame or its averaged model
    class(periodic_system), intent(in) :: system
    !> Phases at which the errors are evaluated
    real(dp), contiguous, intent(in) :: phases(:)
    !> `states`: errors of the states, shape (states). `parts(1)`: relative error of the load that moves the frame. `parts(2)`:
    !> relative rounding error of those terms of the load that may cancel in the forces of the guides. `motion`: rows at the phases,
    !> shape (rows, phases)
    real(dp), intent(in) :: states(:), parts(2), motion(:, :)
    !> The accelerations at the phases or at more phases of which they are the first, by `sample_accelerations`
    type(accelerations_type), intent(in) :: accelerations
    !> Error bounds of the rows, shape (rows)
    real(dp), intent(out) :: errors(:)
    class(second_order_system), allocatable :: whole
    real(dp), allocatable :: m(:, :, :), b(:, :, :), c(:, :, :), h(:, :), terms(:)
    integer :: f, i, k, n

    f = size(frame%free)
    n = frame%dofs()
    errors = 0
    errors(frame%free) = states(:f)
    errors(n + frame%free) = states(f + 1:)
    if (size(errors) <= rows_of(n, velocities)) return
    do k = 1, size(phases)
      do i = 1, f
        associate (bound => errors(2 * n + frame%free(i)))
          bound = max(bound, dot_product(abs(accelerations%p(i, :, k)), states) + parts(1) * abs(accelerations%load(i, k)))
        end associate
      end do
    end do
    if (.not. frame%about_rest) call add_turned_errors(frame, errors)
    if (size(errors) > exact_rows(frame)) call bound_joint_forces(frame, phases, motion, parts(2), errors)
    if (size(errors) < rows_of(n, guide_forces) .or. f == n) return
    call release_all_dofs(frame, system, whole)
    allocate(m(size(phases), n, n), b(size(phases), n, n), c(size(phases), n, n), h(size(phases), n))
    call whole%sample_second_order(phases, m, b, c, h)
    ! If the force along one axis is small, its error is the rounding error of the force along the other axis.
    h(:, 1) = max(abs(h(:, 1)), abs(h(:, 2)))
    h(:, 2) = h(:, 1)
    terms = shaking_terms(frame)
    do i = 1, n
      if (any(frame%free == i)) cycle
      do k = 1, size(phases)
        errors(3 * n + i) = max(errors(3 * n + i), dot_product(abs(m(k, i, :)), errors(2 * n + 1:3 * n)) &
          & + dot_product(abs(b(k, i, :)), errors(n + 1:2 * n)) + dot_product(abs(c(k, i, :)), errors(:n)) &
          & + max(parts(1) * abs(h(k, i)), parts(2) * terms(i)))
      end do
    end do
    if (.not. frame%about_rest) call add_moment_errors(frame, maxval(abs(motion(:4 * n, :)), dim=2), errors)
  end subroutine motion_errors

end module gestell_study_vibration_motion
