!> The types of joints that can be named in an input. The file list.f90 lists them.
module gestell_model_joints_types_registry
  use gestell_model_joints_joint, only: form_type, joint_type
  implicit none (type, external)
  private

  public :: joint_forms, new_joint

  interface
    !> Creates a joint of type number `i` without data. `joint` is not allocated if the number of types is smaller than `i`.
    module subroutine new_joint(i, joint)
      implicit none (type, external)
      integer, intent(in) :: i
      class(joint_type), allocatable, intent(out) :: joint
    end subroutine new_joint
  end interface

contains

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
