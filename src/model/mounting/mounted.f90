!> The part of a frame on its mounting that the equations in the plane and in space share.
module gestell_model_mounting_mounted
  use gestell_base_kinds, only: dp
  use gestell_model_mounting, only: damping_matrix, stiffness_matrix, support_type, turned_loads
  use gestell_model_mounting_weights, only: weights_type
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  !> A second-order system on a mounting: supports and a foundation.
  type, abstract, extends(second_order_system), public :: mounted_system
    !> Mass m_F of the frame (kg); crank speed Omega (rad/s), negative if clockwise.
    real(dp) :: mass = 0, speed = 0
    !> Stiffness c_ij (N/m, N, N m) and damping b_ij (N s/m, N s, N m s) of supports and foundation, then those of the foundation
    !> alone, shapes (dofs, dofs).
    real(dp), allocatable, dimension(:, :) :: stiffness, damping, foundation_stiffness, foundation_damping
    type(support_type), allocatable :: supports(:)
    !> Numbers of the free degrees of freedom.
    integer, allocatable :: free(:)
    type(weights_type) :: weights
  contains
    procedure :: put_on, scale_mounting
    procedure :: rest_stiffness, ground_stiffness
  end type mounted_system

contains

  !> Puts the frame on supports and a foundation, without static forces.
  pure subroutine put_on(self, supports, stiffness, damping)
    class(mounted_system), intent(inout) :: self
    type(support_type), intent(in) :: supports(:)
    !> Matrices of the foundation, shape (dofs, dofs)
    real(dp), intent(in) :: stiffness(:, :), damping(:, :)
    integer :: i

    self%supports = supports
    do i = 1, size(supports)
      self%supports(i)%static = 0
    end do
    self%foundation_stiffness = stiffness
    self%foundation_damping = damping
    self%stiffness = stiffness + stiffness_matrix(supports, size(stiffness, 1))
    self%damping = damping + damping_matrix(supports, size(damping, 1))
  end subroutine put_on

  !> Multiplies stiffness and damping of supports and foundation by factors.
  pure subroutine scale_mounting(self, stiffness, damping)
    class(mounted_system), intent(inout) :: self
    real(dp), intent(in) :: stiffness, damping
    integer :: i

    self%stiffness = self%stiffness * stiffness
    self%damping = self%damping * damping
    self%foundation_stiffness = self%foundation_stiffness * stiffness
    self%foundation_damping = self%foundation_damping * damping
    do i = 1, size(self%supports)
      self%supports(i)%stiffness = self%supports(i)%stiffness * stiffness
      self%supports(i)%damping = self%supports(i)%damping * damping
    end do
  end subroutine scale_mounting

  !> Mean over the turn of C about rest, shape (dofs, dofs): mounting, weights and static forces.
  pure function rest_stiffness(self) result(c)
    class(mounted_system), intent(in) :: self
    real(dp) :: c(size(self%stiffness, 1), size(self%stiffness, 1))

    c = self%stiffness + self%weights%stiffness(:size(c, 1), :size(c, 1))
  end function rest_stiffness

  !> Derivative with respect to q of the forces on the ground and their moment about F at rest, shape (dofs, dofs).
  pure function ground_stiffness(self) result(c)
    class(mounted_system), intent(in) :: self
    real(dp) :: c(size(self%stiffness, 1), size(self%stiffness, 1))

    c = self%stiffness + turned_loads(self%supports, size(c, 1))
  end function ground_stiffness

end module gestell_model_mounting_mounted
