!> The mass functions of a linkage at many crank angles, batch by batch.
module gestell_model_linkage_table
  use gestell_base_kinds, only: dp, pi
  use gestell_model_linkage_bodies, only: link_type, sum_masses, tabulate_masses
  use gestell_model_joints_joint, only: named_joint_type, point_type
  use gestell_model_joints_path, only: batch, path_type, take_batch
  use gestell_model_mechanism, only: mass_functions_type
  implicit none (type, external)
  private

  public :: greatest_terms, tabulate_linkage

contains

  !> The table at crank angles (rad), shape (angles, table_columns).
  subroutine tabulate_linkage(joints, links, angles, table)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: table(:, :)
    !> On the heap: threads have small stacks.
    type(path_type), allocatable :: at(:)
    real(dp) :: some(batch)
    integer :: first, last, i

    allocate(at(size(joints)))
    do first = 1, size(angles), batch
      call take_batch(angles, first, last, some)
      do i = 1, size(joints)
        call joints(i)%joint%trace(some, at(:i - 1), at(i))
      end do
      call tabulate_masses(links, at, first, last, table)
    end do
  end subroutine tabulate_linkage

  !> The terms of a mechanism_type, at some crank angles.
  pure function greatest_terms(joints, links) result(terms)
    type(named_joint_type), intent(in) :: joints(:)
    type(link_type), intent(in) :: links(:)
    real(dp) :: terms(4)
    integer, parameter :: angles = 16
    type(mass_functions_type) :: a
    type(point_type) :: at(size(joints))
    real(dp) :: here(4)
    integer :: i, k

    terms = 0
    do k = 1, angles
      do i = 1, size(joints)
        call joints(i)%joint%locate(2 * pi * k / angles, at(:i - 1), at(i))
      end do
      call sum_masses(links, at, a, here)
      terms = max(terms, here)
    end do
  end function greatest_terms

end module gestell_model_linkage_table
