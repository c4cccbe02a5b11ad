!> Forces in the pins of a linkage, for the oracle of the exact frame, by virtual work: the drive and the frame stand still, one bar
!> slips off its pin by delta along d, and all links that depend on it follow. The force F on the bar then satisfies
!>
!>     F . d delta = sum [m (z'' - g) . dc + J (psi + theta)'' dtheta]
!>
!> over all links, where dc and dtheta are the displacements of their centres of mass and angles. No body is balanced alone.
module oracle_joints
  use oracle_frame, only: accelerations, frame_type
  use oracle_kinematics, only: trace
  use oracle_machine, only: dot, dp, exact_machine, i, xp
  use reference_machine, only: joint_data
  implicit none (type, external)
  private

  public :: list_pins, pin_forces

  !> The pin of joint `end`, on which the bar from there to `joint` turns, or the shaft with the crank `joint`; the name of the
  !> force on it as a quantity, without its component.
  type, public :: pin_type
    integer :: joint = 0, end = 0
    character(len=16) :: name = ""
  end type pin_type

contains

  !> Pins of bars and shafts that carry a link.
  subroutine list_pins(machine, pins)
    type(exact_machine), intent(in) :: machine
    type(pin_type), allocatable, intent(out) :: pins(:)
    integer :: n

    allocate(pins(0))
    do n = 1, size(machine%joints)
      associate (joint => machine%joints(n), earlier => machine%joints(:n - 1))
        select case (joint%kind)
        case ("crank")
          ! Cranks on one pivot are one shaft. If it carries a cam, it is left out: a cam that leaves its place would lift the
          ! follower by a way that only the shape of the cam determines.
          if (.not. any(earlier%kind == "crank" .and. earlier%ends(1) == joint%ends(1)) .and. .not. &
            & any(machine%joints%kind == "follower" .and. machine%joints%ends(2) == n)) call add(joint%ends(1))
        case ("RRR")
          call add(joint%ends(1))
          call add(joint%ends(2))
        case ("RRP")
          call add(joint%ends(1))
        case ("RPR")
          call add(joint%ends(2))
        case default
        end select
      end associate
    end do

  contains

    subroutine add(end)
      integer, intent(in) :: end
      type(pin_type) :: pin
      integer :: k

      do k = 1, size(machine%links)
        associate (ends => [machine%links(k)%from, machine%links(k)%to])
          if (all(ends == [end, n]) .or. all(ends == [n, end])) exit
        end associate
      end do
      if (k > size(machine%links)) return
      pin = pin_type(n, end)
      write (pin%name, "('joint(j', i0, ':l', i0, ').')") end, k
      pins = [pins, pin]
    end subroutine add

  end subroutine list_pins

  !> The forces on bars at their pins, along the frame's axes.
  function pin_forces(frame, pins, phi, q, v, a) result(forces)
    type(frame_type), intent(in) :: frame
    type(pin_type), intent(in) :: pins(:)
    !> The drive's angle; coordinates of the frame with their derivatives
    real(xp), intent(in) :: phi, q(3), v(3), a(3)
    complex(xp) :: forces(size(pins))
    complex(xp), dimension(size(frame%machine%links)) :: acceleration
    complex(xp), dimension(0:3, size(frame%machine%links)) :: slip
    real(xp) :: rotation(size(frame%machine%links)), turned(3, size(frame%machine%links)), part(2)
    complex(xp) :: turn
    integer :: k, m

    turn = exp(i * (phi - frame%even * q(3)) / frame%machine%turns)
    call accelerations(frame, phi, q, v, a, acceleration, rotation)
    do k = 1, size(pins)
      do m = 1, 2
        call trace(slipped(frame%machine, pins(k), turn, i**(m - 1)), (1.0_xp, 0.0_xp), slip, turned)
        associate (links => frame%machine%links)
          part(m) = sum(links%mass * dot(acceleration, slip(1, :)) + links%inertia * rotation * turned(1, :))
        end associate
      end do
      forces(k) = cmplx(part(1), part(2), xp)
    end do
  end function pin_forces

  !> The machine whose drive stands still at `turn`, with an additional joint in the place of the pin that moves along d: the bar
  !> and whatever is built on it refer to this joint. The derivatives of `trace` are those with respect to the distance.
  function slipped(machine, pin, turn, d) result(other)
    type(exact_machine), intent(in) :: machine
    type(pin_type), intent(in) :: pin
    complex(xp), intent(in) :: turn, d
    type(exact_machine) :: other
    logical :: on_bar(size(machine%joints))
    integer :: k, n

    ! joints that are points of the bar, or toward which a block on it points
    n = pin%joint
    on_bar = [(k == n, k = 1, size(machine%joints))]
    if (machine%joints(n)%kind == "crank") on_bar = machine%joints%kind == "crank" .and. machine%joints%ends(1) == pin%end
    if (machine%joints(n)%kind == "RPR") on_bar(machine%joints(n)%ends(1)) = .true.
    other = machine
    do k = 1, size(other%joints)
      associate (joint => other%joints(k))
        select case (joint%kind)
        case ("rigid", "follower")
          joint%ends = renamed(joint%ends, on_body(joint%ends))
        case default
          joint%ends = renamed(joint%ends, k == n .or. joint%kind == "crank" .and. on_bar(k))
        end select
        joint%guide = renamed(joint%guide, on_body(joint%guide))
        joint%guide2 = renamed(joint%guide2, on_body(joint%guide2))
      end associate
    end do
    do k = 1, size(other%links)
      associate (ends => [machine%links(k)%from, machine%links(k)%to])
        other%links(k)%from = sum(renamed(ends(:1), on_body(ends)))
        other%links(k)%to = sum(renamed(ends(2:), on_body(ends)))
      end associate
    end do
    ! the first row: phases of cranks and cylinders
    other%directions(1, :) = other%directions(1, :) * turn**machine%turns_of
    other%directions = reshape([other%directions(:, :n - 1), other%directions(:, n:n), other%directions(:, n:)], &
      & [4, size(machine%joints) + 1])
    other%turns_of = [0 * machine%turns_of, 0]
    other%joints = [other%joints(:n - 1), joint_data("slip", ends=[pin%end, 0], offset=real([real(d), aimag(d)], dp)), &
      & other%joints(n:)]

  contains

    !> True if one of two joints is the pin, and the other one a point of the bar.
    pure logical function on_body(joints)
      integer, intent(in) :: joints(2)

      on_body = .false.
      if (joints(2) > 0) on_body = joints(1) == pin%end .and. on_bar(joints(2)) .or. joints(2) == pin%end .and. on_bar(joints(1))
    end function on_body

    !> Joints by their numbers in the other machine; the pin becomes the joint that slips if they belong to the bar.
    pure function renamed(joints, of_bar)
      integer, intent(in) :: joints(:)
      logical, intent(in) :: of_bar
      integer :: renamed(size(joints))

      renamed = joints + merge(1, 0, joints >= n)
      where (of_bar .and. joints == pin%end) renamed = n
    end function renamed

  end function slipped

end module oracle_joints
