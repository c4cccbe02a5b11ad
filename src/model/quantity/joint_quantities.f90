!> Joint forces as quantities: joint(A).f, joint(A:rod).fx, joint(B:guide).n, and so on. They are rows of the motion
!> (gestell_model_pairs_rows).
module gestell_model_quantity_joint_quantities
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_pairs, only: pin
  use gestell_model_pairs, only: frame_body, on_pin, structure_type
  use gestell_model_pairs_forces, only: axial, components, fx, fy, moment, transverse
  use gestell_model_pairs_rows, only: find_machine_pairs, plane_pairs_type
  use gestell_model_quantity_rows, only: exact_rows, quantity_type
  implicit none (type, external)
  private

  public :: find_joint_force, list_joint_places, pair_words

  !> Names of the places at which other parts than pins act on a body, in the order of the constants of gestell_model_joints_pairs.
  character(len=*), parameter :: kinds(6) = [character(len=5) :: "", "guide", "slot", "cam", "", "drive"]
  !> Names of the components. `n` is the normal force of a guide, a slot or a cam.
  character(len=*), parameter :: parts(7) = [character(len=10) :: "fx", "fy", "m", "axial", "transverse", "f", "n"]
  integer, parameter :: columns_of(7) = [fx, fy, moment, axial, transverse, fx, transverse]

  !> A place at which a force acts on a body of the machine.
  type, public :: joint_place_type
    !> Name in quantities, for example "A:rod" or "B:guide"
    character(len=2 * word_length + 1) :: name = ""
    !> Names of the joint, of the body on which the force acts, and of the part that exerts it
    character(len=word_length) :: joint = "", body = "", other = ""
    !> `kind`: kind of the pair (gestell_model_joints_pairs). `row`: number of the row that precedes the components of the force
    integer :: kind = pin, row = 0
    !> `driven`: true if the drive's torque acts on the body. `hosts`: true if the pin is fixed to the body. `repeats`: true if the
    !> force is that at another place or its opposite
    logical :: driven = .false., hosts = .false., repeats = .false.
  end type joint_place_type

contains

  !> Lists all places at which forces act on the bodies of a machine. Fails if the joint forces are not determined.
  subroutine list_joint_places(frame, places, error)
    class(frame_type), intent(in) :: frame
    type(joint_place_type), allocatable, intent(out) :: places(:)
    type(error_type), allocatable, intent(out) :: error
    type(plane_pairs_type), allocatable :: pairs(:)
    integer :: i, k, n

    call find_machine_pairs(frame, pairs, error)
    if (allocated(error)) return
    allocate(places(sum([(size(pairs(i)%structure%places), i = 1, size(pairs))])))
    n = 0
    do i = 1, size(pairs)
      associate (structure => pairs(i)%structure, joints => pairs(i)%plane%linkage%joints)
        do k = 1, size(structure%places)
          n = n + 1
          associate (from => structure%places(k), to => places(n))
            to%joint = joints(from%joint)%name
            to%body = structure%bodies(from%body)%name
            to%other = name_of_body(structure, from%other)
            to%name = trim(to%joint) // ":" // to%body
            if (from%kind /= pin) to%name = trim(to%joint) // ":" // kinds(from%kind)
            to%kind = from%kind
            to%row = exact_rows(frame) + components * (n - 1)
            to%driven = from%driven
            to%hosts = any(structure%host_places == k)
            to%repeats = repeats_another(structure, k) .or. to%kind == pin .and. .not. structure%bodies(from%body)%has_link &
              & .and. to%body == "block"
          end associate
        end do
      end associate
    end do
  end subroutine list_joint_places

  !> True if the force at place `k` is the opposite of the force at another place that is reported: of the two forces between a pin
  !> and the body that carries it, the one on the other body; of two bodies on a free pin, the one on the later body.
  pure logical function repeats_another(structure, k)
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: k
    integer :: i

    repeats_another = .false.
    do i = 1, size(structure%places)
      associate (place => structure%places(k), other => structure%places(i))
        if (place%kind /= pin .or. other%joint /= place%joint .or. other%body /= place%other .or. other%other /= place%body) cycle
        repeats_another = any(structure%host_places == k) .or. i > k .and. .not. any(structure%host_places == i)
      end associate
    end do
  end function repeats_another

  !> Name of a body: "frame", "pin" if several bodies are attached to the pin, or the name of the link.
  pure character(len=word_length) function name_of_body(structure, body) result(name)
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: body

    select case (body)
    case (frame_body)
      name = "frame"
    case (on_pin)
      name = "pin"
    case default
      name = structure%bodies(body)%name
    end select
  end function name_of_body

  !> Word for a kind of pair in tables.
  elemental character(len=5) function pair_words(kind) result(word)
    integer, intent(in) :: kind

    word = kinds(kind)
    if (kind == pin) word = "pin"
  end function pair_words

  !> Finds the component `part` of the force at `place`: the name of a joint, if exactly two parts meet at its pin, or of one of
  !> `list_joint_places`. At a pin of two parts the force acts on the later one in the list of joints. If there is no such force,
  !> `quantity%weights` is not allocated. Fails if the name of the joint alone does not determine the force.
  subroutine find_joint_force(frame, place, part, quantity, error)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: place, part
    type(quantity_type), intent(inout) :: quantity
    type(error_type), allocatable, intent(out) :: error
    type(joint_place_type), allocatable :: places(:)
    character(len=:), allocatable :: names
    integer :: found, i, at, pins
    logical :: several

    call list_joint_places(frame, places, error)
    if (allocated(error)) return
    found = 0
    pins = 0
    several = .false.
    names = ""
    do i = 1, size(places)
      if (places(i)%joint /= place .or. places(i)%kind /= pin) cycle
      pins = pins + 1
      several = several .or. places(i)%other == "pin" .or. places(i)%other == "frame" .and. pins > 1
      names = names // ", joint(" // trim(places(i)%name) // ")." // part
      if (found == 0 .or. .not. places(i)%hosts) found = i
    end do
    if (several) then
      call fatal_error(error, "more than two parts meet at joint '" // place // "': use one of" // names(2:), invalid_input)
      return
    end if
    do i = 1, size(places)
      if (places(i)%name == place) found = i
    end do
    at = findloc(parts, part, dim=1)
    if (found == 0 .or. at == 0) return
    if (part == "n" .and. places(found)%kind == pin) return
    allocate(quantity%weights(exact_rows(frame) + components * size(places), merge(2, 1, part == "f")), source=0.0_dp)
    quantity%weights(places(found)%row + columns_of(at), 1) = 1
    if (part == "f") quantity%weights(places(found)%row + fy, 2) = 1
    quantity%unit = "N"
    if (part == "m") quantity%unit = "Nm"
    quantity%of_joints = .true.
  end subroutine find_joint_force

end module gestell_model_quantity_joint_quantities
