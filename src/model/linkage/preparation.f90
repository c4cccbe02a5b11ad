!> Prepares a linkage: proves that it can turn, and computes what depends on its joints and not on the drive's speed.
submodule (gestell_model_linkage) gestell_model_linkage_preparation
use gestell_base_kinds, only: pi
use gestell_model_joints_driven, only: driven_joint
use gestell_model_joints_types_crank, only: crank_joint
use gestell_model_linkage_assembly, only: prove_assembly
use gestell_model_linkage_gas, only: set_gas_force
use gestell_model_linkage_kinks, only: find_kinks
implicit none (type, external)

contains

  module procedure prepare
    !> Number of crank angles at which the sums of the absolute values of the terms are computed.
    integer, parameter :: angles = 16
    type(mass_functions_type) :: a
    type(point_type), allocatable :: at(:)
    real(dp) :: terms(4)
    logical :: has_drive
    integer :: i

    if (self%prepared) return
    has_drive = .false.
    self%has_crank = .false.
    if (allocated(self%joints)) then
      do i = 1, size(self%joints)
        select type (joint => self%joints(i)%joint)
        class is (crank_joint)
          has_drive = .true.
          self%has_crank = .true.
        class is (driven_joint)
          has_drive = .true.
        end select
      end do
    end if
    if (.not. has_drive) then
      call fatal_error(error, "the mechanism has no crank or cylinder", invalid_input)
    else if (.not. allocated(self%links)) then
      call fatal_error(error, "the mechanism has no links", invalid_input)
    end if
    if (allocated(error)) return
    call prove_assembly(self%joints, self%links, self%angle_scale, self%intervals, error, self%turns)
    self%prepared = .not. allocated(error)
    if (.not. self%prepared) return
    call find_kinks(self%joints, self%angle_scale, self%kinks, self%jumps)
    allocate(at(size(self%joints)))
    self%terms = 0
    do i = 1, angles
      call self%points(2 * pi * i / angles, at)
      call sum_masses(self%links, at, a, terms)
      self%terms = max(self%terms, terms)
    end do
    if (.not. allocated(self%loads)) return
    do i = 1, size(self%loads)
      if (allocated(self%loads(i)%gas)) call set_gas_force(self%loads(i), self%joints, error)
      if (allocated(error)) return
      self%load_order = max(self%load_order, self%loads(i)%highest_order())
      self%has_ground_loads = self%has_ground_loads .or. self%loads(i)%against == ground_body
    end do
  end procedure prepare

end submodule gestell_model_linkage_preparation
