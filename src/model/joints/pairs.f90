!> The kinematic pairs that a joint adds to a linkage, with the forces that each pair can transmit. From them follow the joint
!> forces (gestell_model_pairs).
!>
!> A joint adds new bodies, numbered 1, 2, ..., and holds them by pairs to earlier bodies and to each other. A dyad adds as many
!> unknown forces and moments as its bodies and its pin have equations of equilibrium.
module gestell_model_joints_pairs
  use gestell_model_joints_guide, only: guide_type
  implicit none (type, external)
  private

  !> Kinds of pairs, with the unknown components of their action on the new body.
  !> `pin`: a force in any direction. `slide`: a force perpendicular to the guide and a moment. `slot`: the same between a block
  !> and the slot of another new body. `contact`: a force along the common normal of a cam and the centre of its roller. `shaft`:
  !> the torque of the drive. `thrust`: the force of a drive along the guide.
  integer, parameter, public :: pin = 1, slide = 2, slot = 3, contact = 4, shaft = 5, thrust = 6

  !> A pair between a new body of a joint and an earlier part or another new body.
  type, public :: pair_type
    !> `kind`: see the constants above. `body`: number of the new body. `joint`: joint at which the force acts
    integer :: kind = pin, body = 1, joint = 0
    !> `slide`, `thrust`: the guide. `slot`: the line of the slot. `contact`: the line that is fixed to the cam
    type(guide_type) :: guide = guide_type()
    !> `slot`: number of the new body that has the slot. The block is a point of its pin; its axis is that of the slot
    integer :: against = 0
  end type pair_type

end module gestell_model_joints_pairs
