!> What a mounting exerts on the ground, and how points move, of a frame in space, as weights of the motion's rows
!> (gestell_model_quantity_rows). The names of quantities stand in gestell_model_quantity.
module gestell_model_quantity_quantity_in_space
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_mounting, only: matrix_rounding
  use gestell_model_quantity_rows, only: exact_rows, ground_forces_type, moments_excess, probe_type, supports_excess, turn_excess
  use gestell_model_space, only: in_frame
  use gestell_model_space_mounting, only: space_support_type, support_matrix, turned_loads
  use gestell_model_space_rotation, only: cross
  implicit none (type, external)
  private

  public :: add_foundation, add_mounting, add_support, point_rows

contains

  !> Adds the foundation.
  pure subroutine add_foundation(frame, forces)
    class(frame_type), intent(in) :: frame
    type(ground_forces_type), intent(inout) :: forces

    call add_matrices(forces, frame%space%foundation_stiffness, frame%space%foundation_damping)
  end subroutine add_foundation

  !> Adds all that holds the frame but the guides.
  pure subroutine add_mounting(frame, forces)
    class(frame_type), intent(in) :: frame
    type(ground_forces_type), intent(inout) :: forces
    integer :: i

    associate (space => frame%space)
      call add_matrices(forces, space%stiffness, space%damping)
      do i = 4, 6
        forces%weights(moments_excess + i - 3, in_frame(i)) = 1
      end do
      do i = 1, size(space%supports)
        call add_turned(space%supports, i, forces)
      end do
    end associate
  end subroutine add_mounting

  !> Adds the support of this number.
  pure subroutine add_support(frame, number, forces)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: number
    type(ground_forces_type), intent(inout) :: forces

    associate (support => frame%space%supports(number))
      call add_matrices(forces, support_matrix(support, support%stiffness), support_matrix(support, support%damping))
    end associate
    call add_turned(frame%space%supports, number, forces)
  end subroutine add_support

  !> Adds what the force of a support has by the frame's turn: where its axes stay in space, rows of R - 1 - [theta], which moves
  !> its head too; else its static force turned, and its own rows of the exact frame.
  pure subroutine add_turned(supports, number, forces)
    type(space_support_type), intent(in) :: supports(:)
    integer, intent(in) :: number
    type(ground_forces_type), intent(inout) :: forces
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)
    integer, parameter :: along(3) = in_frame(:3), turns(3) = in_frame(4:)
    real(dp) :: c(6, 6), k(3, 3), d(3, 3)
    integer :: i, row

    associate (support => supports(number), p => supports(number)%position)
      if (support%turning) then
        c = turned_loads([support])
        forces%weights(in_frame, in_frame) = forces%weights(in_frame, in_frame) + transpose(c)
        forces%rounding(turns, along) = forces%rounding(turns, along) + unit * norm2(support%static)
        forces%rounding(turns, turns) = forces%rounding(turns, turns) + unit * norm2(support%static) * norm2(p)
        row = supports_excess + 3 * count(supports(:number - 1)%turning)
        do i = 1, 3
          forces%weights(row + i, along(i)) = 1
        end do
        return
      end if
      c = support_matrix(support, support%stiffness)
      k = c(:3, :3)
      c = support_matrix(support, support%damping)
      d = c(:3, :3)
      do i = 1, 3
        row = turn_excess + 3 * (i - 1)
        forces%weights(row + 1:row + 3, along) = forces%weights(row + 1:row + 3, along) + p(i) * k
        forces%weights(row + 10:row + 12, along) = forces%weights(row + 10:row + 12, along) + p(i) * d
      end do
    end associate
  end subroutine add_turned

  !> Adds a mounting's matrices of (u, theta).
  pure subroutine add_matrices(forces, c, b)
    type(ground_forces_type), intent(inout) :: forces
    real(dp), intent(in) :: c(6, 6), b(6, 6)

    forces%weights(in_frame, in_frame) = forces%weights(in_frame, in_frame) + transpose(c)
    forces%weights(6 + in_frame, in_frame) = forces%weights(6 + in_frame, in_frame) + transpose(b)
    forces%rounding(in_frame, in_frame) = forces%rounding(in_frame, in_frame) + matrix_rounding(c)
    forces%rounding(6 + in_frame, in_frame) = forces%rounding(6 + in_frame, in_frame) + matrix_rounding(b)
  end subroutine add_matrices

  !> How the place of a probe, level 0, its velocity, 1, or acceleration, 2, along x, y, z follows from the motion, shape (rows, 3):
  !> u + theta x p + (R - 1 - [theta]) p and its derivatives.
  pure function point_rows(frame, probe, level) result(along)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probe
    integer, intent(in) :: level
    real(dp) :: along(exact_rows(frame), 3), unit(3), p(3)
    integer :: i, row

    p = [probe%position, probe%z]
    along = 0
    do i = 1, 3
      unit = 0
      unit(i) = 1
      row = 6 * level
      along(row + in_frame(i), i) = 1
      ! e . (theta x p) = theta . (p x e)
      along(row + in_frame(4:), i) = cross(p, unit)
      row = turn_excess + 9 * level
      along([row + i, row + 3 + i, row + 6 + i], i) = p
    end do
  end function point_rows

end module gestell_model_quantity_quantity_in_space
