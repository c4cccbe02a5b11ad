!> Adds joints of the types that programs use most, and creates guides that move (gestell_model_linkage).
submodule (gestell_model_linkage) gestell_model_linkage_builders
use gestell_model_joints_types_crank, only: crank_joint
use gestell_model_joints_types_ground, only: ground_joint
use gestell_model_joints_types_prp, only: prp_joint
use gestell_model_joints_types_rigid, only: rigid_joint
use gestell_model_joints_types_rpp, only: rpp_joint
use gestell_model_joints_types_rpr, only: rpr_joint
use gestell_model_joints_types_rrp, only: rrp_joint
use gestell_model_joints_types_rrr, only: rrr_joint
implicit none (type, external)

contains

  module procedure add_ground
    call self%add_joint(name, ground_joint(position), error)
  end procedure add_ground

  module procedure add_crank
    integer :: joint

    call self%find(pivot, joint, error)
    if (.not. allocated(error)) call self%add_joint(name, crank_joint(pivot=joint, radius=radius, phase=phase), error)
  end procedure add_crank

  module procedure add_rrr
    integer :: joints(2)

    call find_both(self, "joint '" // name // "'", ends, joints, error)
    if (.not. allocated(error)) call self%add_joint(name, rrr_joint(joints, lengths, branch), error)
  end procedure add_rrr

  module procedure add_rrp
    integer :: joint

    call self%find(end, joint, error)
    if (.not. allocated(error)) call self%add_joint(name, rrp_joint(guide, joint, length, branch), error)
  end procedure add_rrp

  module procedure add_rpr
    integer :: joints(2)

    call find_both(self, "joint '" // name // "'", ends, joints, error)
    if (.not. allocated(error)) call self%add_joint(name, rpr_joint(joints, length, branch), error)
  end procedure add_rpr

  module procedure add_rigid
    integer :: joints(2)

    call find_both(self, "joint '" // name // "'", ends, joints, error)
    if (.not. allocated(error)) call self%add_joint(name, rigid_joint(joints, offset), error)
  end procedure add_rigid

  module procedure add_prp
    call self%add_joint(name, prp_joint(guides), error)
  end procedure add_prp

  module procedure add_rpp
    integer :: joint

    call self%find(end, joint, error)
    if (.not. allocated(error)) call self%add_joint(name, rpp_joint(guide, joint, slot_angle), error)
  end procedure add_rpp

  module procedure moving_guide
    character(len=:), allocatable :: reason

    call find_both(self, "a guide", carriers, guide%carriers, error)
    if (allocated(error)) return
    guide%point = point
    guide%angle = angle
    reason = ""
    call guide%check(reason)
    if (reason /= "") call fatal_error(error, reason, invalid_input)
  end procedure moving_guide

  !> Finds the indices of two different joints by their names. `name`: the joint or guide that refers to them, for the error
  !> message.
  subroutine find_both(self, name, names, joints, error)
    class(linkage_type), intent(in) :: self
    character(len=*), intent(in) :: name, names(:)
    integer, intent(out) :: joints(2)
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    joints = 0
    if (size(names) /= 2) then
      call fatal_error(error, name // " must refer to two joints", invalid_input)
      return
    end if
    do i = 1, 2
      call self%find(names(i), joints(i), error)
      if (allocated(error)) return
    end do
    if (joints(1) == joints(2)) call fatal_error(error, name // " must refer to two different joints", invalid_input)
  end subroutine find_both

end submodule gestell_model_linkage_builders
