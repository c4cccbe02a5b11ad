!> The bodies of a linkage and the pairs between them. The joints of a linkage are a list in which each joint is built from earlier
!> ones. The forces in the pairs therefore follow joint by joint in reverse order: when the forces of a joint are computed, all
!> forces that later joints exert on its bodies are known.
module gestell_model_pairs
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_pairs, only: contact, pair_type, pin, shaft, slide, slot, thrust
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: link_type
  use gestell_model_linkage_diagnosis, only: shaft_of
  implicit none (type, external)
  private

  public :: carrier_of, find_structure

  !> Values of a body's index that denote no moving body. `frame_body`: the frame. `on_pin`: the pin of a joint, to which several
  !> bodies are attached.
  integer, parameter, public :: frame_body = 0, on_pin = -1
  !> Index that `body_with` returns if no body carries both joints.
  integer, parameter :: no_body = -2

  !> A rigid body of a linkage.
  type, public :: body_type
    !> Name of the body's first link. If the body has no link, `has_link` is false, and its name is "block" or consists of the
    !> names of two joints
    character(len=:), allocatable :: name
    logical :: has_link = .true.
    !> Joint that adds the body; moments on the body refer to this joint
    integer :: joint = 0
    !> `joints`: joints that are points of the body. `aligned`: joints toward which, from a point of the body, its direction is
    !> fixed
    integer, allocatable :: joints(:), aligned(:)
    !> The body's axis leads from the first of these joints to the second: from `from` to `to` of its first link
    integer :: axis(2) = 0
    !> `guide`: for a body that slides on a guide, this guide. `slot`: for a block, the line of the slot, which is the block's axis
    !> unless a link defines another one
    type(guide_type), allocatable :: guide, slot
  end type body_type

  !> A place at which forces act on a body.
  type, public :: place_type
    !> `kind`: pin, slide, slot, contact or thrust (gestell_model_joints_pairs). `joint`: joint at which the force acts. `body`:
    !> body on which it acts. `other`: body that exerts it; `on_pin` if several bodies do
    integer :: kind = pin, joint = 0, body = 0, other = 0
    !> True if the drive's torque acts on the body
    logical :: driven = .false.
  end type place_type

  !> The new bodies and pairs of one joint. `first`: index of the body that comes before the first new one. `places`: index of the
  !> place of each pair; 0 for a shaft.
  type, public :: group_type
    integer :: first = 0, bodies = 0
    type(pair_type), allocatable :: pairs(:)
    integer, allocatable :: places(:)
  end type group_type

  !> Bodies and pairs of a linkage.
  type, public :: structure_type
    type(body_type), allocatable :: bodies(:)
    type(place_type), allocatable :: places(:)
    !> One group for each joint
    type(group_type), allocatable :: groups(:)
    !> For each joint: the body of which it is a point, `frame_body`, or `on_pin`; and the index of the place at which bodies on its
    !> pin act on this body, 0 if there is none
    integer, allocatable :: hosts(:), host_places(:)
    !> For each link: its body, `frame_body`, or `on_pin` if the link's mass acts on the pin of its joint
    integer, allocatable :: links(:)
  end type structure_type

contains

  !> Finds the bodies and pairs of a linkage. Fails if a link or a rigid point refers to two joints that no body carries together,
  !> because the forces are then not determined.
  pure subroutine find_structure(linkage, structure, error)
    class(linkage_type), intent(in) :: linkage
    type(structure_type), intent(out) :: structure
    type(error_type), allocatable, intent(out) :: error
    type(point_type) :: at(size(linkage%joints))
    integer, allocatable :: carriers(:)
    integer :: i

    associate (joints => linkage%joints)
      allocate(structure%bodies(0), structure%places(0), structure%groups(size(joints)), structure%links(size(linkage%links)))
      allocate(structure%hosts(size(joints)), structure%host_places(size(joints)), source=0)
      call linkage%points(0.0_dp, at)
      do i = 1, size(joints)
        call joints(i)%joint%pairs(i, structure%groups(i)%pairs)
        if (shaft_of(linkage, at, i) > 0) structure%groups(i)%pairs = structure%groups(i)%pairs(:0)
        call add_bodies(structure, i)
        structure%hosts(i) = host_of(linkage, structure, at, i)
        if (structure%hosts(i) == no_body .or. any(lacks_carrier(structure, structure%groups(i)%pairs))) then
          call fatal_error(error, "the forces at joint '" // joints(i)%name // "' are not determined: no body carries both " // &
            & "joints from which the joint, or its guide or cam, is built", invalid_input)
          return
        end if
        call align_sliders(structure, at, i)
        if (structure%hosts(i) <= frame_body) cycle
        call add_point(structure%bodies(structure%hosts(i)), i)
        ! a further crank on a shaft may name another joint in the shaft's place
        if (shaft_of(linkage, at, i) > 0) then
          call joints(i)%joint%carriers(carriers)
          call add_point(structure%bodies(structure%hosts(i)), carriers(1))
        end if
      end do
    end associate
    call place_links(linkage, structure, error)
    if (allocated(error)) return
    call list_places(structure, linkage%links)
  end subroutine find_structure

  !> Adds the new bodies of joint `i`.
  pure subroutine add_bodies(structure, i)
    type(structure_type), intent(inout) :: structure
    integer, intent(in) :: i
    type(body_type), allocatable :: longer(:)
    integer :: k, first

    first = size(structure%bodies)
    associate (group => structure%groups(i))
      group%first = first
      if (size(group%pairs) > 0) group%bodies = maxval(group%pairs%body)
      allocate(longer(first + group%bodies))
      do k = 1, first
        longer(k) = structure%bodies(k)
      end do
      do k = 1, group%bodies
        longer(first + k)%joint = i
        allocate(longer(first + k)%joints(0), longer(first + k)%aligned(0))
      end do
      do k = 1, size(group%pairs)
        associate (pair => group%pairs(k), body => longer(first + group%pairs(k)%body))
          if (pair%kind == pin .and. pair%joint /= i) call add_point(body, pair%joint)
          if (pair%kind == slide) body%guide = pair%guide
        end associate
      end do
      do k = 1, group%bodies
        if (.not. any(group%pairs%kind == slot .and. group%pairs%body == k)) call add_point(longer(first + k), i)
      end do
      do k = 1, size(group%pairs)
        if (group%pairs(k)%kind /= slot) cycle
        associate (block => longer(first + group%pairs(k)%body), slotted => longer(first + group%pairs(k)%against))
          block%slot = group%pairs(k)%guide
          block%aligned = slotted%joints
          slotted%aligned = block%joints
        end associate
      end do
    end associate
    call move_alloc(longer, structure%bodies)
  end subroutine add_bodies

  !> True for a guide or cam that no body carries.
  elemental logical function lacks_carrier(structure, pair)
    type(structure_type), intent(in) :: structure
    type(pair_type), intent(in) :: pair

    lacks_carrier = any(pair%kind == [slide, contact, thrust]) .and. pair%guide%carriers(1) > 0
    if (lacks_carrier) lacks_carrier = body_with(structure, pair%guide%carriers(1), pair%guide%carriers(2)) == no_body
  end function lacks_carrier

  pure subroutine add_point(body, joint)
    type(body_type), intent(inout) :: body
    integer, intent(in) :: joint

    if (.not. any(body%joints == joint)) body%joints = [body%joints, joint]
  end subroutine add_point

  !> Lists the joints toward which the sliders of joint `i` point: the joints of the body that carries the guide, or of the frame,
  !> if they lie on the line of the guide. `at`: points of all joints at one crank angle.
  pure subroutine align_sliders(structure, at, i)
    type(structure_type), intent(inout) :: structure
    type(point_type), intent(in) :: at(:)
    integer, intent(in) :: i
    real(dp), parameter :: rounding = 1.0e-12_dp
    type(point_type) :: origin, along
    real(dp) :: x, y
    integer :: carrier, j, k

    do k = structure%groups(i)%first + 1, structure%groups(i)%first + structure%groups(i)%bodies
      if (.not. allocated(structure%bodies(k)%guide)) cycle
      carrier = carrier_of(structure, structure%bodies(k)%guide)
      call structure%bodies(k)%guide%line(at, origin, along)
      do j = 1, i - 1
        if (carrier == frame_body .and. structure%hosts(j) /= frame_body) cycle
        if (carrier > frame_body) then
          if (.not. any(structure%bodies(carrier)%joints == j)) cycle
        end if
        x = at(j)%x%v - origin%x%v
        y = at(j)%y%v - origin%y%v
        if (abs(along%x%v * y - along%y%v * x) <= rounding * hypot(x, y)) structure%bodies(k)%aligned &
          & = [structure%bodies(k)%aligned, j]
      end do
    end do
  end subroutine align_sliders

  !> The body of which joint `i` is a point, `frame_body`, `on_pin`, or `no_body` if its body is unknown.
  pure integer function host_of(linkage, structure, at, i) result(host)
    class(linkage_type), intent(in) :: linkage
    type(structure_type), intent(in) :: structure
    type(point_type), intent(in) :: at(:)
    integer, intent(in) :: i
    integer, allocatable :: carriers(:)
    integer :: k

    associate (group => structure%groups(i))
      if (group%bodies > 0) then
        host = group%first + 1
        if (count([(any(structure%bodies(group%first + k)%joints == i), k = 1, group%bodies)]) > 1) host = on_pin
      else if (shaft_of(linkage, at, i) > 0) then
        host = structure%groups(shaft_of(linkage, at, i))%first + 1
      else
        call linkage%joints(i)%joint%carriers(carriers)
        host = frame_body
        if (size(carriers) > 0) host = body_with(structure, carriers(1), carriers(size(carriers)))
      end if
    end associate
  end function host_of

  !> The body with the point `one` whose direction is fixed toward the joint `two`; `no_body` if there is none.
  pure integer function body_with(structure, one, two) result(body)
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: one, two

    if (structure%hosts(one) == frame_body .and. structure%hosts(two) == frame_body) then
      body = frame_body
      return
    end if
    do body = 1, size(structure%bodies)
      associate (points => structure%bodies(body)%joints, aligned => structure%bodies(body)%aligned)
        if (any(points == one) .and. (any(points == two) .or. any(aligned == two))) return
      end associate
    end do
    body = no_body
  end function body_with

  !> Finds the body of each link, and names the bodies after their first links.
  pure subroutine place_links(linkage, structure, error)
    class(linkage_type), intent(in) :: linkage
    type(structure_type), intent(inout) :: structure
    type(error_type), allocatable, intent(out) :: error
    integer :: i, k

    do i = 1, size(linkage%links)
      associate (link => linkage%links(i), body => structure%links(i))
        if (link%to > 0) then
          body = body_with(structure, link%from, link%to)
        else
          body = translating_body(structure, link%from)
          if (body > 0) then
            if (.not. allocated(structure%bodies(body)%name)) structure%bodies(body)%name = link%name
            if (allocated(structure%bodies(body)%guide)) then
              ! the link does not turn with a guide that turns
              if (structure%bodies(body)%guide%carriers(1) > 0) body = on_pin
            end if
          end if
        end if
        if (body == no_body) then
          call fatal_error(error, "the joint forces are not determined: no body carries both joints '" &
            & // linkage%joints(link%from)%name // "' and '" // linkage%joints(link%to)%name // "' of link '" // link%name // "'", &
            & invalid_input)
          return
        end if
        if (body > 0) then
          if (allocated(structure%bodies(body)%name)) cycle
          structure%bodies(body)%name = link%name
          if (link%to > 0) structure%bodies(body)%axis = [link%from, link%to]
        end if
      end associate
    end do
    do k = 1, size(structure%bodies)
      associate (body => structure%bodies(k))
        if (allocated(body%name)) cycle
        body%has_link = .false.
        body%name = "block"
        if (allocated(body%slot)) cycle
        body%name = linkage%joints(body%joints(1))%name
        if (size(body%joints) == 1) cycle
        body%name = body%name // "-" // linkage%joints(body%joints(2))%name
        body%axis = body%joints(:2)
      end associate
    end do
  end subroutine place_links

  !> The body of a link that only translates with a joint: the slider that the joint adds, or else the block on the joint's pin in
  !> the slot of a yoke that does not turn. `on_pin` if there is no such body, or several; the link's mass then acts on the pin.
  pure integer function translating_body(structure, joint) result(body)
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: joint
    logical, dimension(size(structure%bodies)) :: sliders, blocks
    integer :: k

    do k = 1, size(structure%bodies)
      associate (candidate => structure%bodies(k))
        sliders(k) = allocated(candidate%guide) .and. candidate%joint == joint
        blocks(k) = .false.
        if (allocated(candidate%slot)) blocks(k) = candidate%slot%carriers(1) == 0 .and. any(candidate%joints == joint)
      end associate
    end do
    if (any(sliders)) blocks = sliders
    body = on_pin
    if (count(blocks) == 1) body = findloc(blocks, .true., dim=1)
  end function translating_body

  !> Lists the places at which forces act on the bodies: first those of the pairs, joint by joint, then those at which bodies on a
  !> pin act on the body that carries the pin.
  pure subroutine list_places(structure, links)
    type(structure_type), intent(inout) :: structure
    type(link_type), intent(in) :: links(:)
    integer :: j, k

    do j = 1, size(structure%groups)
      associate (group => structure%groups(j))
        allocate(group%places(size(group%pairs)), source=0)
        do k = 1, size(group%pairs)
          if (group%pairs(k)%kind == shaft) cycle
          associate (pair => group%pairs(k))
            structure%places = [structure%places, place_type(pair%kind, pair%joint, group%first + merge(pair%against, pair%body, &
              & pair%kind == slot))]
          end associate
          group%places(k) = size(structure%places)
        end do
        if (any(group%pairs%kind == shaft)) structure%places(group%places(1))%driven = .true.
      end associate
    end do
    do j = 1, size(structure%hosts)
      if (structure%hosts(j) <= frame_body) cycle
      if (.not. (any(acts_on_pin(structure%places, j)) .or. any(links%from == j .and. structure%links == on_pin))) cycle
      structure%places = [structure%places, place_type(pin, j, structure%hosts(j))]
      structure%host_places(j) = size(structure%places)
    end do
    do k = 1, size(structure%places)
      structure%places(k)%other = partner(structure, structure%places(k))
    end do
  end subroutine list_places

  !> True for each place at which a body is attached to the pin of a joint.
  elemental logical function acts_on_pin(place, joint)
    type(place_type), intent(in) :: place
    integer, intent(in) :: joint

    acts_on_pin = place%joint == joint .and. place%kind == pin
  end function acts_on_pin

  !> The body that exerts the force at a place; `on_pin` if several bodies are attached to the pin.
  pure integer function partner(structure, place)
    type(structure_type), intent(in) :: structure
    type(place_type), intent(in) :: place
    integer :: k

    if (place%kind /= pin) then
      partner = frame_body
      associate (group => structure%groups(structure%bodies(place%body)%joint))
        do k = 1, size(group%pairs)
          associate (pair => group%pairs(k))
            if (pair%kind /= place%kind) cycle
            if (pair%kind == slot) partner = group%first + pair%body
            if (pair%kind /= slot .and. group%first + pair%body == place%body) partner = carrier_of(structure, pair%guide)
          end associate
        end do
      end associate
      return
    end if
    ! The pin belongs to its host, which acts on all other bodies.
    partner = structure%hosts(place%joint)
    if (partner /= on_pin .and. partner /= place%body) return
    partner = on_pin
    do k = 1, size(structure%places)
      if (.not. acts_on_pin(structure%places(k), place%joint) .or. structure%places(k)%body == place%body) cycle
      if (partner /= on_pin) then
        partner = on_pin
        return
      end if
      partner = structure%places(k)%body
    end do
  end function partner

  !> The body that carries a guide or a cam; `frame_body` if the guide is fixed to the frame.
  pure integer function carrier_of(structure, guide) result(body)
    type(structure_type), intent(in) :: structure
    type(guide_type), intent(in) :: guide

    body = frame_body
    if (guide%carriers(1) > 0) body = body_with(structure, guide%carriers(1), guide%carriers(2))
  end function carrier_of

end module gestell_model_pairs
