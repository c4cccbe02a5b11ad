!> Planar linkages: a list of joints, each from earlier ones, and the links that move with them.
module gestell_model_linkage
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism, invalid_input
  use gestell_base_jet, only: jet, operator(*), operator(+), operator(-), operator(/), sqrt
  use gestell_base_kinds, only: dp
  use gestell_model_joints_driven, only: crank_joint, ground_joint
  use gestell_model_joints_joint, only: joint_type, point_type
  use gestell_model_joints_rrr, only: rrr_joint
  use gestell_model_mechanism, only: mass_functions_type, mechanism_type
  implicit none (type, external)
  private

  type, public :: named_joint_type
    character(len=:), allocatable :: name
    class(joint_type), allocatable :: joint
  end type named_joint_type

  !> A body. Its xi-axis points from joint `from` to joint `to`; without `to` (0) it keeps the directions of x and y.
  type, public :: link_type
    character(len=:), allocatable :: name
    integer :: from = 0, to = 0
    !> Mass (kg), moment of inertia about the centre of mass (kg m^2), centre of mass in the link's system (m).
    real(dp) :: mass = 0, inertia = 0, center(2) = 0
  end type link_type

  !> Build it with `ground`, `crank`, `rrr` and `link`, then call `turn_once` (see `gestell_model_assembly`).
  type, extends(mechanism_type), public :: linkage_type
    type(named_joint_type), allocatable :: joints(:)
    type(link_type), allocatable :: links(:)
  contains
    procedure :: ground => add_ground
    procedure :: crank => add_crank
    procedure :: rrr => add_rrr
    procedure :: add_joint
    procedure :: link => add_link
    procedure :: find
    procedure :: points
    procedure :: mass_functions
  end type linkage_type

contains

  !> A joint fixed to the frame at `position` (m).
  subroutine add_ground(self, name, position, error)
    class(linkage_type), intent(inout) :: self
    character(len=*), intent(in) :: name
    real(dp), intent(in) :: position(2)
    type(error_type), allocatable, intent(out) :: error

    call self%add_joint(name, ground_joint(position), error)
  end subroutine add_ground

  !> The crank's joint: at `radius` (m) about the joint `pivot`, at the crank angle + `phase` (rad).
  subroutine add_crank(self, name, pivot, radius, phase, error)
    class(linkage_type), intent(inout) :: self
    character(len=*), intent(in) :: name, pivot
    real(dp), intent(in) :: radius, phase
    type(error_type), allocatable, intent(out) :: error
    integer :: place

    call self%find(pivot, place, error)
    if (allocated(error)) return
    if (.not. radius > 0) then
      call fatal_error(error, "joint '" // name // "': its radius must be positive", invalid_input)
      return
    end if
    call self%add_joint(name, crank_joint(place, radius, phase), error)
  end subroutine add_crank

  !> A dyad's joint at `lengths` (m) from the joints `ends`, left (`branch` = 1) or right (-1) of the way between them.
  subroutine add_rrr(self, name, ends, lengths, branch, error)
    class(linkage_type), intent(inout) :: self
    character(len=*), intent(in) :: name, ends(2)
    real(dp), intent(in) :: lengths(2)
    integer, intent(in) :: branch
    type(error_type), allocatable, intent(out) :: error
    integer :: places(2), i

    do i = 1, 2
      call self%find(ends(i), places(i), error)
      if (allocated(error)) return
    end do
    if (places(1) == places(2)) then
      call fatal_error(error, "joint '" // name // "': its ends are the same joint", invalid_input)
    else if (.not. all(lengths > 0)) then
      call fatal_error(error, "joint '" // name // "': its lengths must be positive", invalid_input)
    else if (abs(branch) /= 1) then
      call fatal_error(error, "joint '" // name // "': its branch must be 1 or -1", invalid_input)
    end if
    if (allocated(error)) return
    call self%add_joint(name, rrr_joint(places, lengths, branch), error)
  end subroutine add_rrr

  !> Any joint, given by an object whose references are places in the list of joints.
  subroutine add_joint(self, name, joint, error)
    class(linkage_type), intent(inout) :: self
    character(len=*), intent(in) :: name
    class(joint_type), intent(in) :: joint
    type(error_type), allocatable, intent(out) :: error
    type(named_joint_type), allocatable :: longer(:)
    integer :: i, count

    count = 0
    if (allocated(self%joints)) count = size(self%joints)
    do i = 1, count
      if (self%joints(i)%name == name) then
        call fatal_error(error, "joint '" // name // "' is there already", invalid_input)
        return
      end if
    end do
    allocate(longer(count + 1))
    do i = 1, count
      call move_alloc(self%joints(i)%name, longer(i)%name)
      call move_alloc(self%joints(i)%joint, longer(i)%joint)
    end do
    longer(count + 1)%name = name
    allocate(longer(count + 1)%joint, source=joint)
    call move_alloc(longer, self%joints)
  end subroutine add_joint

  !> A body of `mass` (kg) and `inertia` (kg m^2, about its centre of mass `center` in its own system, m) on the joints
  !> `from` and `to`; an empty `to`: it only translates with `from`.
  subroutine add_link(self, name, from, to, mass, inertia, center, error)
    class(linkage_type), intent(inout) :: self
    character(len=*), intent(in) :: name, from, to
    real(dp), intent(in) :: mass, inertia, center(2)
    type(error_type), allocatable, intent(out) :: error
    type(link_type) :: link

    link%name = name
    link%mass = mass
    link%inertia = inertia
    link%center = center
    call self%find(from, link%from, error)
    if (allocated(error)) return
    if (len_trim(to) > 0) call self%find(to, link%to, error)
    if (allocated(error)) return
    if (link%from == link%to) then
      call fatal_error(error, "link '" // name // "': from and to are the same joint", invalid_input)
    else if (.not. (mass >= 0 .and. inertia >= 0)) then
      call fatal_error(error, "link '" // name // "': mass and inertia must not be negative", invalid_input)
    end if
    if (allocated(error)) return
    if (.not. allocated(self%links)) allocate(self%links(0))
    self%links = [self%links, link]
    self%mass = self%mass + mass
    self%inertia = self%inertia + inertia
  end subroutine add_link

  !> The place of the joint of that name. Error: there is none.
  subroutine find(self, name, place, error)
    class(linkage_type), intent(in) :: self
    character(len=*), intent(in) :: name
    integer, intent(out) :: place
    type(error_type), allocatable, intent(out) :: error

    if (allocated(self%joints)) then
      do place = 1, size(self%joints)
        if (self%joints(place)%name == name) return
      end do
    end if
    place = 0
    call fatal_error(error, "no joint '" // trim(name) // "' stands before it", invalid_input)
  end subroutine find

  !> All joints at a crank angle (rad), shape (joints).
  pure subroutine points(self, crank_angle, at)
    class(linkage_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(out) :: at(:)
    integer :: i

    do i = 1, size(self%joints)
      call self%joints(i)%joint%place(crank_angle, at(:i - 1), at(i))
    end do
  end subroutine points

  !> The sums (4) to (7). Sums that cancel to the last rounding are zero: a balanced mechanism does not shake at all.
  subroutine mass_functions(self, crank_angle, a)
    class(linkage_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(mass_functions_type), intent(out) :: a
    type(point_type) :: at(size(self%joints)), center
    type(jet) :: size1, size2
    real(dp) :: turn, a4_size
    integer :: i

    call self%points(crank_angle, at)
    a4_size = 0
    do i = 1, size(self%links)
      associate (link => self%links(i))
        call body_motion(link, at, center, turn)
        a%a1 = a%a1 + link%mass * center%x
        a%a2 = a%a2 + link%mass * center%y
        a%a3 = a%a3 + link%mass * (center%x * center%x + center%y * center%y)
        a%a4 = a%a4 + link%mass * (center%x%v * center%y%dd - center%y%v * center%x%dd) + link%inertia * turn
        size1 = size1 + magnitude(link%mass, center%x)
        size2 = size2 + magnitude(link%mass, center%y)
        a4_size = a4_size + link%inertia * abs(turn) &
          & + link%mass * (abs(center%x%v * center%y%dd) + abs(center%y%v * center%x%dd))
      end associate
    end do
    a%a1 = cleaned(a%a1, size1)
    a%a2 = cleaned(a%a2, size2)
    if (abs(a%a4) <= 8 * epsilon(1.0_dp) * a4_size) a%a4 = 0
  end subroutine mass_functions

  !> The motion of a link's centre of mass, and its angular acceleration d2(phi_i) / dphi2.
  pure subroutine body_motion(link, at, center, turn)
    type(link_type), intent(in) :: link
    type(point_type), intent(in) :: at(:)
    type(point_type), intent(out) :: center
    real(dp), intent(out) :: turn
    type(jet) :: ux, uy, length

    if (link%to == 0) then
      center%x = at(link%from)%x + link%center(1)
      center%y = at(link%from)%y + link%center(2)
      turn = 0
      return
    end if
    ux = at(link%to)%x - at(link%from)%x
    uy = at(link%to)%y - at(link%from)%y
    length = sqrt(ux * ux + uy * uy)
    ux = ux / length
    uy = uy / length
    center%x = at(link%from)%x + link%center(1) * ux - link%center(2) * uy
    center%y = at(link%from)%y + link%center(1) * uy + link%center(2) * ux
    ! u = (cos phi, sin phi): phi'' = u x u''.
    turn = ux%v * uy%dd - uy%v * ux%dd
  end subroutine body_motion

  pure type(jet) function magnitude(factor, term)
    real(dp), intent(in) :: factor
    type(jet), intent(in) :: term

    magnitude = jet(factor * abs(term%v), factor * abs(term%d), factor * abs(term%dd))
  end function magnitude

  pure type(jet) function cleaned(sum, magnitude)
    type(jet), intent(in) :: sum, magnitude
    real(dp), parameter :: noise = 8 * epsilon(1.0_dp)

    cleaned = jet(merge(0.0_dp, sum%v, abs(sum%v) <= noise * magnitude%v), &
      & merge(0.0_dp, sum%d, abs(sum%d) <= noise * magnitude%d), &
      & merge(0.0_dp, sum%dd, abs(sum%dd) <= noise * magnitude%dd))
  end function cleaned

end module gestell_model_linkage
