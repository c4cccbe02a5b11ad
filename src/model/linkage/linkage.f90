!> Planar linkages: a list of joints, each of which is built from earlier joints, the links that move with them, and the loads.
module gestell_model_linkage
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_model_linkage_load, only: action_type, add_load_sums, ground_body, load_action, load_type
  use gestell_model_linkage_bodies, only: link_type, move_link, sum_drive, sum_masses, tabulate_masses
  use gestell_model_joints_data, only: check_finite
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: joint_type, named_joint_type, point_type
  use gestell_model_joints_path, only: batch, path_type, copy_batch
  use gestell_model_mechanism, only: drive_columns, load_sums_type, mass_functions_type, mechanism_type
  implicit none (type, external)
  private

  !> A linkage. The caller adds joints and links one by one and then passes the linkage to a frame.
  type, extends(mechanism_type), public :: linkage_type
    type(named_joint_type), allocatable :: joints(:)
    type(link_type), allocatable :: links(:)
    !> Forces and moments between links, frame and ground; not allocated if there are none.
    type(load_type), allocatable :: loads(:)
    !> True if `prepare` has proved that the linkage can be assembled over the whole turn.
    logical :: prepared = .false.
    !> Number of intervals of the crank angle in which `prepare` tried its proof.
    integer :: intervals = 0
    !> Names of the joints, for finding the index of a joint.
    type(dictionary_type), private :: names
  contains
    procedure :: ground => add_ground
    procedure :: crank => add_crank
    procedure :: rrr => add_rrr
    procedure :: rrp => add_rrp
    procedure :: rpr => add_rpr
    procedure :: rigid => add_rigid
    procedure :: prp => add_prp
    procedure :: rpp => add_rpp
    procedure :: moving_guide, add_joint
    procedure :: link => add_link
    procedure :: find, points, mass_functions, tabulate, tabulate_drive, sum_loads, prepare, check, link_offset
  end type linkage_type

  interface
    !> Adds a joint that is fixed to the frame at `position` (m).
    module subroutine add_ground(self, name, position, error)
      implicit none (type, external)
      class(linkage_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(dp), intent(in) :: position(2)
      type(error_type), allocatable, intent(out) :: error
    end subroutine add_ground

    !> Adds a crank pin: a joint at the distance `radius` (m) from the joint `pivot`. The direction from the pivot to the pin is
    !> the crank angle + `phase` (rad).
    module subroutine add_crank(self, name, pivot, radius, phase, error)
      implicit none (type, external)
      class(linkage_type), intent(inout) :: self
      character(len=*), intent(in) :: name, pivot
      real(dp), intent(in) :: radius, phase
      type(error_type), allocatable, intent(out) :: error
    end subroutine add_crank

    !> Adds the joint of a dyad RRR, at the distances `lengths` (m) from the joints `ends`. The joint is on the left of the line
    !> from ends(1) to ends(2) if `branch` = 1, and on the right if `branch` = -1.
    module subroutine add_rrr(self, name, ends, lengths, branch, error)
      implicit none (type, external)
      class(linkage_type), intent(inout) :: self
      character(len=*), intent(in) :: name, ends(:)
      real(dp), intent(in) :: lengths(2)
      integer, intent(in) :: branch
      type(error_type), allocatable, intent(out) :: error
    end subroutine add_rrr

    !> Adds a slider on a guide at the distance `length` (m) from the joint `end`. Two positions have this distance: `branch` = 1 is
    !> the position farther along the guide, `branch` = -1 the other position.
    module subroutine add_rrp(self, name, end, length, guide, branch, error)
      implicit none (type, external)
      class(linkage_type), intent(inout) :: self
      character(len=*), intent(in) :: name, end
      real(dp), intent(in) :: length
      type(guide_type), intent(in) :: guide
      integer, intent(in) :: branch
      type(error_type), allocatable, intent(out) :: error
    end subroutine add_rrp

    !> Adds a point of a slotted lever. The lever turns about `ends(2)`, and its slot passes through `ends(1)`. The point is at the
    !> distance `length` (m) from `ends(2)`. It lies toward `ends(1)` if `branch` = 1, and on the opposite side if `branch` = -1.
    module subroutine add_rpr(self, name, ends, length, branch, error)
      implicit none (type, external)
      class(linkage_type), intent(inout) :: self
      character(len=*), intent(in) :: name, ends(:)
      real(dp), intent(in) :: length
      integer, intent(in) :: branch
      type(error_type), allocatable, intent(out) :: error
    end subroutine add_rpr

    !> Adds a point of the body that carries the joints `ends`. The point is at the distance offset(1) from `ends(1)` toward
    !> `ends(2)`, and at the distance offset(2) to the left of this line (m).
    module subroutine add_rigid(self, name, ends, offset, error)
      implicit none (type, external)
      class(linkage_type), intent(inout) :: self
      character(len=*), intent(in) :: name, ends(:)
      real(dp), intent(in) :: offset(2)
      type(error_type), allocatable, intent(out) :: error
    end subroutine add_rigid

    !> Adds the pin of two sliders, at the intersection of their guides.
    module subroutine add_prp(self, name, guides, error)
      implicit none (type, external)
      class(linkage_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(guide_type), intent(in) :: guides(2)
      type(error_type), allocatable, intent(out) :: error
    end subroutine add_prp

    !> Adds a yoke on a guide. The joint `end` slides in the yoke's slot, which makes the angle `slot_angle` (rad) with the guide.
    !> The new joint is the intersection of slot and guide.
    module subroutine add_rpp(self, name, end, guide, slot_angle, error)
      implicit none (type, external)
      class(linkage_type), intent(inout) :: self
      character(len=*), intent(in) :: name, end
      type(guide_type), intent(in) :: guide
      real(dp), intent(in) :: slot_angle
      type(error_type), allocatable, intent(out) :: error
    end subroutine add_rpp

    !> Creates a guide that the body between two joints carries. Fails if a joint does not exist, if the two joints are the same, or
    !> if a number is invalid.
    module subroutine moving_guide(self, carriers, point, angle, guide, error)
      implicit none (type, external)
      class(linkage_type), intent(in) :: self
      !> Names of the two joints that carry the guide
      character(len=*), intent(in) :: carriers(:)
      !> Point (m) and angle (rad) of the guide, in axes with the origin carriers(1) whose first axis points to carriers(2)
      real(dp), intent(in) :: point(2), angle
      type(guide_type), intent(out) :: guide
      type(error_type), allocatable, intent(out) :: error
    end subroutine moving_guide

    !> Proves that the linkage can turn, and computes its `angle_scale`, `terms`, `kinks` and `has_crank`. Fails if the linkage has
    !> no crank or cylinder, if it has no link, or if it cannot be assembled at some crank angle (see `prove_assembly`).
    module subroutine prepare(self, error)
      implicit none (type, external)
      class(linkage_type), intent(inout) :: self
      type(error_type), allocatable, intent(out) :: error
    end subroutine prepare
  end interface

contains

  !> Adds a joint of any type; the joint refers to other joints by their indices. Fails if its name is empty or already used, if a
  !> number is invalid, or if a joint to which it refers does not exist.
  subroutine add_joint(self, name, joint, error)
    class(linkage_type), intent(inout) :: self
    character(len=*), intent(in) :: name
    class(joint_type), intent(in) :: joint
    type(error_type), allocatable, intent(out) :: error
    type(named_joint_type), allocatable :: longer(:)
    character(len=:), allocatable :: reason
    integer, allocatable :: carriers(:)
    integer :: i, count

    if (len_trim(name) == 0) then
      call fatal_error(error, "a joint must have a name", invalid_input)
      return
    end if
    count = 0
    if (allocated(self%joints)) count = size(self%joints)
    if (self%names%position(name) > 0) then
      call fatal_error(error, "joint '" // name // "' exists already", invalid_input)
      return
    end if
    reason = ""
    call joint%check(reason)
    call joint%carriers(carriers)
    if (reason == "" .and. any(carriers < 1 .or. carriers > count)) reason = "the joint refers to joints that do not exist"
    if (reason /= "") then
      call fatal_error(error, "joint '" // name // "': " // reason, invalid_input)
      return
    end if
    allocate(longer(count + 1))
    do i = 1, count
      call move_alloc(self%joints(i)%name, longer(i)%name)
      call move_alloc(self%joints(i)%joint, longer(i)%joint)
    end do
    longer(count + 1)%name = name
    allocate(longer(count + 1)%joint, source=joint)
    call move_alloc(longer, self%joints)
    call self%names%add(name)
    self%prepared = .false.
  end subroutine add_joint

  !> Adds a body as a link. Fails if a number is not finite, if mass or inertia is negative, if a joint does not exist, or if `from`
  !> and `to` are the same joint.
  subroutine add_link(self, name, from, to, mass, inertia, center, error)
    class(linkage_type), intent(inout) :: self
    !> Names of the link and of the two joints that carry the link. If `to` is empty, the link only translates with `from`
    character(len=*), intent(in) :: name, from, to
    !> `mass`: mass (kg). `inertia`: moment of inertia about the centre of mass (kg m^2). `center`: position of the centre of mass
    !> in the link's axes (m)
    real(dp), intent(in) :: mass, inertia, center(2)
    type(error_type), allocatable, intent(out) :: error
    type(link_type) :: link
    type(link_type), allocatable :: longer(:)
    character(len=:), allocatable :: reason
    integer :: i, count

    link%name = name
    link%mass = mass
    link%inertia = inertia
    link%center = center
    reason = ""
    call check_finite([mass, inertia, center], reason)
    if (reason /= "") call fatal_error(error, "link '" // name // "': " // reason, invalid_input)
    if (.not. allocated(error)) call self%find(from, link%from, error)
    if (allocated(error)) return
    if (len_trim(to) > 0) call self%find(to, link%to, error)
    if (allocated(error)) return
    if (link%from == link%to) then
      call fatal_error(error, "link '" // name // "': from and to are the same joint", invalid_input)
    else if (.not. (mass >= 0 .and. inertia >= 0)) then
      call fatal_error(error, "link '" // name // "': mass and inertia must not be negative", invalid_input)
    end if
    if (allocated(error)) return
    count = 0
    if (allocated(self%links)) count = size(self%links)
    allocate(longer(count + 1))
    ! The names are moved, because copies of all names would cost more than everything else.
    do i = 1, count
      call move_link(self%links(i), longer(i))
    end do
    longer(count + 1) = link
    call move_alloc(longer, self%links)
    self%prepared = .false.
    self%mass = self%mass + mass
    self%inertia = self%inertia + inertia
  end subroutine add_link

  !> Finds the index of the joint with the given name. Fails if there is no such joint.
  subroutine find(self, name, joint, error)
    class(linkage_type), intent(in) :: self
    character(len=*), intent(in) :: name
    integer, intent(out) :: joint
    type(error_type), allocatable, intent(out) :: error

    joint = self%names%position(name)
    if (joint > 0) return
    call fatal_error(error, "there is no joint '" // trim(name) // "' yet", invalid_input)
  end subroutine find

  !> Computes the points of all joints at a crank angle (rad), shape (joints).
  pure subroutine points(self, crank_angle, at)
    class(linkage_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(out) :: at(:)
    integer :: i

    do i = 1, size(self%joints)
      call self%joints(i)%joint%locate(crank_angle, at(:i - 1), at(i))
    end do
  end subroutine points

  !> Fails if the linkage has no joints or no links.
  subroutine check(self, error)
    class(linkage_type), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error

    if (.not. (allocated(self%joints) .and. allocated(self%links))) call fatal_error(error, &
      & "the mechanism has no joints or no links", invalid_input)
  end subroutine check

  !> Computes the sums (4) to (7) of doc/theory.md over the links at a crank angle (rad).
  subroutine mass_functions(self, crank_angle, a)
    class(linkage_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(mass_functions_type), intent(out) :: a
    type(point_type) :: at(size(self%joints))

    call self%points(crank_angle, at)
    call sum_masses(self%links, at, a)
  end subroutine mass_functions

  !> Tabulates the sums (4) to (7) of doc/theory.md at the given crank angles (rad), batch by batch. `table` has shape (angles,
  !> table_columns).
  subroutine tabulate(self, angles, table)
    class(linkage_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: table(:, :)
    !> Allocated on the heap because threads have small stacks.
    type(path_type), allocatable :: at(:)
    real(dp) :: some(batch)
    integer :: first, last, i

    allocate(at(size(self%joints)))
    do first = 1, size(angles), batch
      call copy_batch(angles, first, last, some)
      do i = 1, size(at)
        call self%joints(i)%joint%trace(some, at(:i - 1), at(i))
      end do
      call tabulate_masses(self%links, at, first, last, table)
    end do
  end subroutine tabulate

  !> Tabulates the functions H and K of the drive with their derivatives at crank angles (rad), shape (angles, drive_columns). H
  !> is the angular momentum and K twice the kinetic energy of the links at unit crank speed.
  subroutine tabulate_drive(self, angles, table, known)
    class(linkage_type), intent(in) :: self
    real(dp), intent(in) :: angles(:)
    real(dp), intent(out) :: table(:, :)
    logical, intent(out) :: known
    type(point_type) :: at(size(self%joints))
    real(dp) :: row(drive_columns)
    integer :: k

    do k = 1, size(angles)
      call self%points(angles(k), at)
      call sum_drive(self%links, at, row)
      table(k, :) = row
    end do
    known = .true.
  end subroutine tabulate_drive

  !> Sums the loads at crank angles (rad), see `load_sums_type`. `origin`: origin of the linkage's axes relative to the frame's
  !> centre of mass (m).
  pure subroutine sum_loads(self, angles, origin, sums)
    class(linkage_type), intent(in) :: self
    real(dp), intent(in) :: angles(:), origin(2)
    type(load_sums_type), intent(out) :: sums(:)
    type(point_type) :: at(size(self%joints))
    type(action_type) :: action
    integer :: i, k

    if (.not. allocated(self%loads)) return
    do k = 1, size(angles)
      call self%points(angles(k), at)
      do i = 1, size(self%loads)
        call load_action(self%loads(i), self%links, at, angles(k), action, origin)
        call add_load_sums(self%loads(i), action, origin, sums(k))
      end do
    end do
  end subroutine sum_loads

  !> Distance (m) of a link's centre of mass from the joint at which the link begins; negative if no link has this name.
  pure real(dp) function link_offset(self, name) result(offset)
    class(linkage_type), intent(in) :: self
    character(len=*), intent(in) :: name
    integer :: i

    offset = -1
    do i = 1, size(self%links)
      if (self%links(i)%name == name) offset = norm2(self%links(i)%center)
    end do
  end function link_offset

end module gestell_model_linkage
