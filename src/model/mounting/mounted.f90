!> What the models of a frame in the plane and in space have in common: mounting, speed and gravity.
module gestell_model_mounting_mounted
  use gestell_base_kinds, only: dp
  use gestell_model_mounting, only: damping_matrix, stiffness_matrix, support_type, turned_loads
  use gestell_model_mounting_weights, only: weights_type
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  !> A second-order system on a mounting, which consists of supports and a foundation.
  type, abstract, extends(second_order_system), public :: mounted_system
    !> `mass`: mass m_F of the frame (kg). `speed`: crank speed Omega (rad/s), negative if clockwise.
    real(dp) :: mass = 0, speed = 0
    !> `stiffness` c_ij (N/m, N, N m), `damping` b_ij (N s/m, N s, N m s): matrices of supports and foundation together.
    !> `foundation_stiffness`, `foundation_damping`: matrices of the foundation alone. Shapes (dofs, dofs).
    real(dp), allocatable, dimension(:, :) :: stiffness, damping, foundation_stiffness, foundation_damping
    type(support_type), allocatable :: supports(:)
    !> True if some of the dampers result from damping ratios, and thus from the masses of frame and links.
    logical :: has_damping_ratios = .false.
    !> Indices of the free degrees of freedom.
    integer, allocatable :: free(:)
    type(weights_type) :: weights
  contains
    procedure :: put_on, scale_mounting
    procedure :: rest_stiffness, ground_stiffness
  end type mounted_system

contains

  !> Puts the frame on supports and a foundation, and sets the static forces of the supports to zero.
  pure subroutine put_on(self, supports, stiffness, damping)
    class(mounted_system), intent(inout) :: self
    type(support_type), intent(in) :: supports(:)
    !> Matrices of the foundation alone, shape (dofs, dofs)
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

  !> Multiplies the stiffness of all supports and of the foundation by the factor `stiffness`, their damping by the factor
  !> `damping`.
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

  !> Mean over the period of the stiffness matrix C linearised about rest, shape (dofs, dofs): the sum of the contributions of
  !> mounting, weights and static forces.
  pure function rest_stiffness(self) result(c)
    class(mounted_system), intent(in) :: self
    real(dp) :: c(size(self%stiffness, 1), size(self%stiffness, 1))

    c = self%stiffness + self%weights%stiffness(:size(c, 1), :size(c, 1))
  end function rest_stiffness

  !> Derivative of the forces on the ground, and of their moments about the rest position of the frame's centre of mass, with
  !> respect to the displacements q; shape (dofs, dofs).
  pure function ground_stiffness(self) result(c)
    class(mounted_system), intent(in) :: self
    real(dp) :: c(size(self%stiffness, 1), size(self%stiffness, 1))

    c = self%stiffness + turned_loads(self%supports, size(c, 1))
  end function ground_stiffness

end module gestell_model_mounting_mounted
