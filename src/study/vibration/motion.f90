!> Computes the complete motion of a frame from its states: accelerations, forces of the guides that lock degrees of freedom, and
!> rows that exist only for the exact frame (gestell_model_quantity_rows).
module gestell_study_vibration_motion
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: cross, turn_beyond_first_order, turning_matrices
  use gestell_math_turn, only: less_one
  use gestell_model_exact_moved_mounting, only: ground_load
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_shaking, only: shaking_terms
  use gestell_model_mounting, only: damping_matrix, stiffness_matrix, turned_loads
  use gestell_model_pairs_rows, only: all_sources, compute_joint_forces, find_machine_pairs, joint_rows, plane_pairs_type
  use gestell_model_quantity_rows, only: accelerations, displacements, exact_rows, excess_row, guide_forces, joint_forces, &
    & moment_rows, rotations_of, rows_of, shifts_of, support_rows, velocities
  use gestell_model_space, only: in_frame
  use gestell_model_space_variation, only: force_excess
  use gestell_system_averaged, only: averaged_system
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: add_joints, bound_joint_forces, complete_motion, motion_errors, motion_rows, whole_motion

  !> Number of phases that are sampled together.
  integer, parameter :: block_length = 1024
  !> Indices of the displacements and of the rotations in the motion of a frame in space.
  integer, parameter :: places(3) = in_frame(:3), turns(3) = in_frame(4:)

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
    if (last == joint_forces) motion_rows = exact_rows(frame) + joint_rows(frame)
  end function motion_rows

  !> Computes the complete motion at `phases` from the states x, which belong to the free degrees of freedom.
  subroutine whole_motion(frame, system, phases, x, last, motion)
    class(frame_type), intent(in) :: frame
    !> The system of which the states x are a solution: the frame or its averaged model
    class(periodic_system), intent(in) :: system
    real(dp), contiguous, intent(in) :: phases(:)
    !> States, shape (states, phases)
    real(dp), intent(in) :: x(:, :)
    !> Last group of rows that is needed (see `motion_rows`)
    integer, intent(in) :: last
    !> The motion, shape (rows, phases)
    real(dp), allocatable, intent(out) :: motion(:, :)
    integer :: f, from, to, dofs

    f = size(frame%free)
    dofs = frame%dofs()
    allocate(motion(motion_rows(frame, last), size(phases)), source=0.0_dp)
    motion(frame%free, :) = x(:f, :)
    motion(dofs + frame%free, :) = x(f + 1:, :)
    if (size(motion, 1) <= rows_of(dofs, velocities)) return
    do from = 1, size(phases), block_length
      to = min(from + block_length - 1, size(phases))
      call add_accelerations(frame, system, phases(from:to), x(:, from:to), motion(:, from:to))
    end do
    if (size(motion, 1) >= rows_of(dofs, guide_forces)) call complete_motion(frame, system, phases, motion)
  end subroutine whole_motion

  !> Computes the rows that follow the accelerations: forces of the guides, and rows that exist only for the exact frame. The
  !> positions, velocities and accelerations in `motion`, shape (rows, phases), need not satisfy the equations of motion.
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
      call add_turned(frame, x, motion(:, first:last))
    end do
    if (size(motion, 1) > exact_rows(frame)) call add_joints(frame, phases, motion)
  end subroutine complete_motion

  !> Computes the joint forces, which are the rows behind all others.
  subroutine add_joints(frame, phases, motion)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(inout) :: motion(:, :)
    type(plane_pairs_type), allocatable :: pairs(:)
    type(error_type), allocatable :: error

    associate (forces => motion(exact_rows(frame) + 1:, :))
      call find_machine_pairs(frame, pairs, error)
      if (.not. allocated(error)) call compute_joint_forces(frame, pairs, phases, (motion(:3 * frame%dofs(), :)), all_sources, &
        & forces, error)
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
    real(dp), allocatable :: forces(:, :)

    call find_machine_pairs(frame, pairs, error)
    if (allocated(error)) return
    allocate(forces(size(errors) - exact_rows(frame), size(phases)))
    call compute_joint_forces(frame, pairs, phases, motion(:, :size(phases)), all_sources, forces, error, &
      & errors(:3 * frame%dofs()), relative, errors(exact_rows(frame) + 1:))
  end subroutine bound_joint_forces

  !> Converts the moments of the guides to moments about the rest position of F, the centre of mass of the frame. In the exact
  !> frame the forces of the guides act at the moving point F. In space the guides exert generalised moments rho along the
  !> rotation coordinates theta. Their moments about axes fixed to the ground are M = T^-1 rho. The reason: with the angular
  !> velocity w = T theta' in the frame's axes, rho = T^T R^T M and R = T^T T^-1, where R is the rotation matrix, and T and T^T
  !> commute.
  pure subroutine move_moments(frame, motion)
    class(frame_type), intent(in) :: frame
    real(dp), intent(inout) :: motion(:, :)
    real(dp) :: turning(3, 3, 0:2), moment(3)
    integer :: k, first

    if (.not. allocated(frame%space)) then
      motion(guide_forces, :) = motion(guide_forces, :) + motion(1, :) * motion(accelerations + 2, :) &
        & - motion(2, :) * motion(accelerations + 1, :)
      return
    end if
    first = rows_of(6, accelerations)
    do k = 1, size(motion, 2)
      moment = motion(first + turns, k)
      turning = turning_matrices(reshape(motion([turns, turns, turns], k), [3, 3]))
      associate (t => turning(:, :, 0))
        moment = [dot_product(cross(t(:, 2), t(:, 3)), moment), dot_product(cross(t(:, 3), t(:, 1)), moment), &
          & dot_product(cross(t(:, 1), t(:, 2)), moment)] / dot_product(cross(t(:, 1), t(:, 2)), t(:, 3))
      end associate
      motion(first + turns, k) = moment + cross(motion(places, k), motion(first + places, k))
    end do
  end subroutine move_moments

  !> Computes the rows that exist only for the exact frame: the parts of rotations, moments and support forces beyond the linear
  !> terms. cos psi - 1 is computed by `less_one`, because the direct difference loses digits if the rotation is small.
  subroutine add_turned(frame, x, motion)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: x(:, :)
    real(dp), intent(inout) :: motion(:, :)
    real(dp), allocatable :: load(:, :)
    real(dp) :: own(size(x, 2), 3)
    integer :: k, n, first

    n = frame%dofs()
    first = excess_row(frame, 0)
    associate (q => motion(:n, :), v => motion(n + 1:2 * n, :))
      load = frame%ground_forces(x) - matmul(frame%ground_stiffness(), q) - matmul(frame%damping, v)
      motion(moment_rows(frame), :) = load(rotations_of(frame), :)
      if (allocated(frame%space)) then
        do k = 1, size(motion, 2)
          motion(first + 1:excess_row(frame, 3), k) = reshape(turn_beyond_first_order(reshape([motion(turns, k), &
            & motion(6 + turns, k), motion(12 + turns, k)], [3, 3])), [27])
          motion(excess_row(frame, 3) + 4:, k) = force_excess(frame, q(:, k), v(:, k))
        end do
        return
      end if
      do k = 1, size(frame%supports)
        if (.not. frame%supports(k)%turning) cycle
        own = ground_load(frame%supports(k:k), transpose(q), transpose(v))
        load = transpose(own) - matmul(stiffness_matrix(frame%supports(k:k)) + turned_loads(frame%supports(k:k), n), q) &
          & - matmul(damping_matrix(frame%supports(k:k)), v)
        motion(support_rows(frame, k), :) = load(:2, :)
      end do
    end associate
    associate (psi => motion(3, :), psi_d => motion(6, :), psi_dd => motion(9, :), s => motion(first + 1::2, :), &
      & c => motion(first + 2::2, :))
      s(1, :) = sin(psi) - psi
      c(1, :) = real(less_one(cmplx(cos(psi), sin(psi), dp)))
      s(2, :) = c(1, :) * psi_d
      c(2, :) = -sin(psi) * psi_d
      s(3, :) = c(1, :) * psi_dd - sin(psi) * psi_d**2
      c(3, :) = -sin(psi) * psi_dd - cos(psi) * psi_d**2
    end associate
  end subroutine add_turned

  !> Computes the accelerations q'' from the states x and the equations x' = P x + f (doc/theory.md, equations 20 to 22).
  subroutine add_accelerations(frame, system, phases, x, motion)
    class(frame_type), intent(in) :: frame
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: phases(:), x(:, :)
    real(dp), intent(inout) :: motion(:, :)
    real(dp), allocatable :: p(:, :, :), load(:, :)
    integer :: f, k

    f = size(frame%free)
    allocate(p(2 * f, 2 * f, size(phases)), load(2 * f, size(phases)))
    call system%sample(phases, p, load)
    do k = 1, size(phases)
      motion(2 * frame%dofs() + frame%free, k) = matmul(p(f + 1:, :, k), x(:, k)) + load(f + 1:, k)
    end do
  end subroutine add_accelerations

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
  subroutine motion_errors(frame, system, phases, states, parts, motion, errors)
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
    !> Error bounds of the rows, shape (rows)
    real(dp), intent(out) :: errors(:)
    class(second_order_system), allocatable :: whole
    real(dp), allocatable :: p(:, :, :), load(:, :), m(:, :, :), b(:, :, :), c(:, :, :), h(:, :), terms(:)
    integer :: f, i, k, n

    f = size(frame%free)
    n = frame%dofs()
    errors = 0
    errors(frame%free) = states(:f)
    errors(n + frame%free) = states(f + 1:)
    if (size(errors) <= rows_of(n, velocities)) return
    allocate(p(2 * f, 2 * f, size(phases)), load(2 * f, size(phases)))
    call system%sample(phases, p, load)
    do k = 1, size(phases)
      errors(2 * n + frame%free) = max(errors(2 * n + frame%free), matmul(abs(p(f + 1:, :, k)), states) &
        & + parts(1) * abs(load(f + 1:, k)))
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

  !> Adds the errors that `move_moments` causes in the guides' moments. `large`: maxima of the rows, shape (rows). Let u be the
  !> displacement of F and r the force of the guides, with the errors du and dr. The moment u x r has the error du x r + u x dr.
  !> In space T^-1 rho (T: see gestell_math_rotation; theta: rotation) also differs from the moment rho by about theta x rho/2.
  pure subroutine add_moment_errors(frame, large, errors)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: large(:)
    real(dp), intent(inout) :: errors(:)
    integer :: first

    if (.not. allocated(frame%space)) then
      associate (u => large(:2), du => errors(:2), r => large(accelerations + 1:accelerations + 2), &
        & dr => errors(accelerations + 1:accelerations + 2))
        errors(guide_forces) = errors(guide_forces) + sum(du) * sum(r) + sum(u) * sum(dr)
      end associate
      return
    end if
    first = rows_of(6, accelerations)
    errors(first + turns) = errors(first + turns) + sum(errors(places)) * sum(large(first + places)) &
      & + sum(large(places)) * sum(errors(first + places)) + sum(errors(turns)) * sum(large(first + turns)) &
      & + sum(large(turns)) * sum(errors(first + turns))
  end subroutine add_moment_errors

  !> Computes the errors of the rows that exist only for the exact frame. Let dpsi be the error of the rotation psi. The errors of
  !> s = sin psi - psi and c = cos psi - 1 are at most |dpsi|, because |psi| is at most about 1. Errors of their derivatives are
  !> bounded in the same way. In space the errors of all rotations are added. Errors of moments and support forces are bounded by
  !> those of the linear terms.
  subroutine add_turned_errors(frame, errors)
    class(frame_type), intent(in) :: frame
    real(dp), intent(inout) :: errors(:)
    real(dp) :: load(frame%dofs())
    integer :: k, n

    n = frame%dofs()
    do k = 0, 2
      errors(excess_row(frame, k) + 1:excess_row(frame, k + 1)) = sum(errors(k * n + rotations_of(frame)))
    end do
    load = matmul(abs(frame%ground_stiffness()), errors(:n)) + matmul(abs(frame%damping), errors(n + 1:2 * n))
    errors(moment_rows(frame)) = load(rotations_of(frame))
    do k = 1, size(frame%supports)
      if (.not. frame%supports(k)%turning) cycle
      load = matmul(abs(stiffness_matrix(frame%supports(k:k), n) + turned_loads(frame%supports(k:k), n)), errors(:n)) &
        & + matmul(abs(damping_matrix(frame%supports(k:k), n)), errors(n + 1:2 * n))
      errors(support_rows(frame, k)) = load(shifts_of(frame))
    end do
  end subroutine add_turned_errors

end module gestell_study_vibration_motion
