!> The mass functions of a linkage at many crank angles, batch by batch.
module gestell_model_linkage_table
  use gestell_base_kinds, only: dp
  use gestell_model_bodies, only: link_type, tabulate_masses
  use gestell_model_joints_joint, only: named_joint_type
  use gestell_model_joints_path, only: batch, path_type, take_batch
  implicit none (type, external)
  private

  public :: tabulate_linkage

  !> Room on the stack for the paths of a linkage's joints; longer ones take theirs from the heap.
  integer, parameter :: common_joints = 40

contains

  !> The table at crank angles (rad), shape (angles, table_columns). (Recursive only so that no compiler keeps the room in
  !> static memory, which threads share.)
  recursive subroutine tabulate_linkage(joints, links, angles, table)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: table(:, :)
    type(path_type) :: few(common_joints)
    type(path_type), allocatable :: many(:)

    if (size(joints) <= common_joints) then
      call tabulate_on(few(:size(joints)), joints, links, angles, table)
    else
      allocate(many(size(joints)))
      call tabulate_on(many, joints, links, angles, table)
    end if
  end subroutine tabulate_linkage

  !> The same with the joints' paths on `at`.
  subroutine tabulate_on(at, joints, links, angles, table)
    type(path_type), intent(inout) :: at(:)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: table(:, :)
    real(dp) :: some(batch)
    integer :: first, last, i

    do first = 1, size(angles), batch
      call take_batch(angles, first, last, some)
      do i = 1, size(joints)
        call joints(i)%joint%trace(some, at(:i - 1), at(i))
      end do
      call tabulate_masses(links, at, first, last, table)
    end do
  end subroutine tabulate_on

end module gestell_model_linkage_table
