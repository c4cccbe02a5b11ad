!> The types of joints that can be named in an input. A new type needs one `use` and one case in `new_joint`.
module gestell_model_joints_types_registry
  use gestell_model_joints_joint, only: form_type, joint_type
  use gestell_model_joints_types_crank, only: crank_joint
  use gestell_model_joints_types_cylinder, only: cylinder_joint
  use gestell_model_joints_types_follower, only: follower_joint
  use gestell_model_joints_types_ground, only: ground_joint
  use gestell_model_joints_types_prp, only: prp_joint
  use gestell_model_joints_types_rigid, only: rigid_joint
  use gestell_model_joints_types_rpp, only: rpp_joint
  use gestell_model_joints_types_rpr, only: rpr_joint
  use gestell_model_joints_types_rrp, only: rrp_joint
  use gestell_model_joints_types_rrr, only: rrr_joint
  implicit none (type, external)
  private

  public :: joint_forms, new_joint

contains

  !> Creates a joint of type number `i` without data. `joint` is not allocated if the number of types is smaller than `i`.
  subroutine new_joint(i, joint)
    integer, intent(in) :: i
    class(joint_type), allocatable, intent(out) :: joint

    select case (i)
    case (1); allocate(ground_joint :: joint)
    case (2); allocate(crank_joint :: joint)
    case (3); allocate(rrr_joint :: joint)
    case (4); allocate(rrp_joint :: joint)
    case (5); allocate(rpr_joint :: joint)
    case (6); allocate(rigid_joint :: joint)
    case (7); allocate(prp_joint :: joint)
    case (8); allocate(rpp_joint :: joint)
    case (9); allocate(follower_joint :: joint)
    case (10); allocate(cylinder_joint :: joint)
    case default ! there are no more
    end select
  end subroutine new_joint

  !> Returns the descriptions of all types of joints, in the order of their numbers in `new_joint`.
  subroutine joint_forms(forms)
    type(form_type), allocatable, intent(out) :: forms(:)
    class(joint_type), allocatable :: joint
    integer :: i, n

    n = 0
    do
      call new_joint(n + 1, joint)
      if (.not. allocated(joint)) exit
      n = n + 1
    end do
    allocate(forms(n))
    do i = 1, n
      call new_joint(i, joint)
      call joint%describe(forms(i))
    end do
  end subroutine joint_forms

end module gestell_model_joints_types_registry
