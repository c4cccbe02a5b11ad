!> Period of a linkage in which at least one crank does not turn, or one load does not repeat, a whole number of times per turn of
!> the drive.
module gestell_model_linkage_gearing
  use gestell_math_rational, only: common_multiple
  use gestell_model_joints_driven, only: driven_joint
  use gestell_model_joints_joint, only: named_joint_type
  use gestell_model_linkage_load, only: load_type
  implicit none (type, external)
  private

  public :: gear

  !> Maximum number of turns in a period: `max_turns` for the drive, `max_crank_turns` for a crank.
  integer, parameter, public :: max_turns = 64, max_crank_turns = 4096

contains

  !> Finds the smallest number of turns of the drive after which all cranks are back at their initial angles and all loads repeat.
  !> The linkage's crank angle is then redefined as the angle of a shaft that turns once in this period, so that every crank turns,
  !> and every load repeats, a whole number of times.
  pure subroutine gear(joints, loads, turns, crank_turns, joint)
    type(named_joint_type), intent(inout) :: joints(:)
    type(load_type), intent(inout) :: loads(:)
    !> `turns`: number of turns of the drive in the period. `joint`: index of a joint whose ratio would require too many turns, or
    !> number of joints plus index of such a load; 0 if there is none
    integer, intent(out) :: turns, joint
    !> Number of turns of each crank in the period, regardless of direction; allocated if `turns` > 1
    integer, allocatable, intent(out) :: crank_turns(:)
    integer :: i

    turns = 1
    do joint = 1, size(joints)
      select type (crank => joints(joint)%joint)
      class is (driven_joint)
        turns = common_multiple(turns, crank%denominator)
      end select
      if (turns > max_turns) return
    end do
    do joint = size(joints) + 1, size(joints) + size(loads)
      turns = common_multiple(turns, loads(joint - size(joints))%denominator)
      if (turns > max_turns) return
    end do
    do joint = 1, size(joints)
      select type (crank => joints(joint)%joint)
      class is (driven_joint)
        if (abs(crank%ratio) > max_crank_turns / (turns / crank%denominator)) return
      end select
    end do
    joint = 0
    if (turns > 1) allocate(crank_turns(0))
    do i = 1, size(joints)
      select type (crank => joints(i)%joint)
      class is (driven_joint)
        crank%ratio = crank%ratio * (turns / crank%denominator)
        crank%denominator = 1
        if (turns > 1) crank_turns = [crank_turns, abs(crank%ratio)]
      end select
    end do
    loads%ratio = loads%ratio * (turns / loads%denominator)
    loads%denominator = 1
    if (turns > 1) crank_turns = [crank_turns, abs(loads%ratio)]
  end subroutine gear

end module gestell_model_linkage_gearing
