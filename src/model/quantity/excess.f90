!> Rows of the motion that are not linear in the displacements of the frame: the guides' moments about the rest position of F, and
!> the rows that exist only for the exact frame (gestell_model_quantity_rows).
module gestell_model_quantity_excess
  use gestell_base_kinds, only: dp
  use gestell_math_rotation, only: cross, find_rotation, turning_matrices
  use gestell_math_turn, only: less_one
  use gestell_math_vectors, only: batch, cross, cross_matrix, in_batch
  use gestell_model_exact_moved_mounting, only: ground_load
  use gestell_model_frame, only: frame_type
  use gestell_model_mounting, only: damping_matrix, in_frame, stiffness_matrix, turned_loads
  use gestell_model_quantity_rows, only: accelerations, excess_row, guide_forces, moment_rows, rotations_of, rows_of, shifts_of, &
    & support_rows
  use gestell_model_space_drive, only: moved_type, rotate_frame
  use gestell_model_space_variation, only: force_excess
  implicit none (type, external)
  private

  public :: add_moment_errors, add_turned, add_turned_errors, move_moments

  !> Indices of the displacements and of the rotations in the motion of a frame in space.
  integer, parameter :: places(3) = in_frame(:3), turns(3) = in_frame(4:)

contains

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
        call find_beyond_first_order(motion(:18, :), motion(first + 1:excess_row(frame, 3), :))
        motion(excess_row(frame, 3) + 4:, :) = force_excess(frame, q, v)
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

  !> Computes R - 1 - [theta], the terms of second and higher order of the rotation matrix R, and its first and second time
  !> derivatives, shape (27, phases). With the angular velocity w along the fixed axes, R' = [w] R and R'' = ([w'] + [w]^2) R.
  pure subroutine find_beyond_first_order(motion, rows)
    real(dp), intent(in) :: motion(:, :)
    real(dp), intent(out) :: rows(:, :)
    real(dp) :: theta(batch, 3, 0:2), beyond(batch, 3, 3, 0:2)
    type(moved_type) :: moved
    integer :: at(batch), first, i, k

    do first = 1, size(motion, 2), batch
      at = in_batch(first, size(motion, 2))
      do k = 0, 2
        do i = 1, 3
          theta(:, i, k) = motion(6 * k + turns(i), at)
        end do
      end do
      call rotate_frame(theta, moved)
      call find_rotation(batch, theta, beyond(:, :, :, 0), beyond_first_order=.true.)
      associate (r => moved%rotation, w => moved%w)
        beyond(:, :, :, 1) = cross(w, r) - cross_matrix(theta(:, :, 1))
        beyond(:, :, :, 2) = cross(moved%w_d, r) + cross(w, cross(w, r)) - cross_matrix(theta(:, :, 2))
      end associate
      do k = 1, min(batch, size(motion, 2) - first + 1)
        rows(:, at(k)) = reshape(beyond(k, :, :, :), [27])
      end do
    end do
  end subroutine find_beyond_first_order

  !> Adds the errors that `move_moments` causes in the guides' moments. `large`: maxima of the rows, shape (rows). Let u be the
  !> displacement of F and r the force of the guides, with the errors du and dr. The moment u x r has the error du x r + u x dr.
  !> In space T^-1 rho (T: see gestell_math_rotation; theta: rotation) also differs from the moment rho by about theta x rho/2.
  pure subroutine add_moment_errors(frame, large, errors)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: large(:)
    real(dp), intent(inout) :: errors(:)
    real(dp) :: of_turns, of_moments
    integer, allocatable :: shifts(:), rotations(:)
    integer :: first

    shifts = shifts_of(frame)
    rotations = rotations_of(frame)
    first = rows_of(frame%dofs(), accelerations)
    of_turns = 0
    of_moments = 0
    if (size(rotations) > 1) then
      of_turns = sum(errors(rotations)) * sum(large(first + rotations))
      of_moments = sum(large(rotations)) * sum(errors(first + rotations))
    end if
    errors(first + rotations) = errors(first + rotations) + sum(errors(shifts)) * sum(large(first + shifts)) &
      & + sum(large(shifts)) * sum(errors(first + shifts)) + of_turns + of_moments
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

end module gestell_model_quantity_excess
