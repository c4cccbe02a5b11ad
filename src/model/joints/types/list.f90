!> Lists the types of joints. A new type needs one `use` and one case in this file.
submodule (gestell_model_joints_types_registry) gestell_model_joints_types_list
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

contains

  module procedure new_joint
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
  end procedure new_joint

end submodule gestell_model_joints_types_list
