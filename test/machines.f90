!> Machines for the tests: the reference's data as the library's frames.
module machines
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mounting, only: support_type
  use reference_machine, only: joint_data, machine_data
  implicit none (type, external)
  private

  public :: frame_of_machine, linkage_of_machine, new_crank, solve3

contains

  !> The library's linkage for the reference's data; joints are named j1, j2, ..., links l1, l2, ...
  subroutine linkage_of_machine(machine, linkage, error)
    type(machine_data), intent(in) :: machine
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: error
    character(len=3) :: to
    integer :: i

    do i = 1, size(machine%joints)
      call add(machine%joints(i), name("j", i), linkage, error)
      if (allocated(error)) return
    end do
    do i = 1, size(machine%links)
      associate (link => machine%links(i))
        to = ""
        if (link%to > 0) to = name("j", link%to)
        call linkage%link(name("l", i), name("j", link%from), to, link%mass, link%inertia, link%center, error)
      end associate
      if (allocated(error)) return
    end do
    call linkage%prepare(error)
  end subroutine linkage_of_machine

  subroutine add(joint, own_name, linkage, error)
    type(joint_data), intent(in) :: joint
    character(len=*), intent(in) :: own_name
    type(linkage_type), intent(inout) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(guide_type) :: guides(2)
    character(len=3) :: ends(2)

    ends = [name("j", joint%ends(1)), name("j", joint%ends(2))]
    guides = [guide_of(joint%guide, joint%guide_point, joint%guide_angle_deg), &
      & guide_of(joint%guide2, joint%guide2_point, joint%guide2_angle_deg)]
    select case (joint%kind)
    case ("ground")
      call linkage%ground(own_name, joint%position, error)
    case ("crank")
      call linkage%crank(own_name, ends(1), joint%radius, joint%phase_deg * pi / 180, error)
    case ("RRR")
      call linkage%rrr(own_name, ends, joint%lengths, joint%branch, error)
    case ("RRP")
      call linkage%rrp(own_name, ends(1), joint%lengths(1), guides(1), joint%branch, error)
    case ("RPR")
      call linkage%rpr(own_name, ends, joint%lengths(1), joint%branch, error)
    case ("rigid")
      call linkage%rigid(own_name, ends, joint%offset, error)
    case ("PRP")
      call linkage%prp(own_name, guides, error)
    case default ! RPP
      call linkage%rpp(own_name, ends(1), guides(1), joint%slot_angle_deg * pi / 180, error)
    end select
  end subroutine add

  pure type(guide_type) function guide_of(carriers, point, angle_deg)
    integer, intent(in) :: carriers(2)
    real(dp), intent(in) :: point(2), angle_deg

    guide_of = guide_type(carriers, point, angle_deg * pi / 180)
  end function guide_of

  !> The library's frame for the reference's data.
  subroutine frame_of_machine(machine, frame, error)
    type(machine_data), intent(in) :: machine
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(support_type), allocatable :: supports(:)
    real(dp) :: damping(3, 3)
    integer :: i

    call linkage_of_machine(machine, linkage, error)
    if (allocated(error)) return
    allocate(supports(size(machine%supports)))
    do i = 1, size(supports)
      associate (s => machine%supports(i))
        supports(i) = support_type(s%position, s%stiffness, s%damping, s%angle_deg * pi / 180, s%turning)
      end associate
    end do
    damping = 0
    do i = 1, 3
      damping(i, i) = machine%foundation_damping(i)
    end do
    call new_frame(frame, linkage, machine%frame_mass, machine%frame_inertia, machine%origin, machine%foundation_stiffness, &
      & damping, machine%speed_rpm * 2 * pi / 60, error, pack([1, 2, 3], machine%free), supports, &
      & machine%gravity, trim(machine%held_by))
  end subroutine frame_of_machine

  pure character(len=3) function name(letter, i)
    character, intent(in) :: letter
    integer, intent(in) :: i

    write (name, "(a, i0)") letter, i
  end function name

  !> Cramer's rule.
  pure function solve3(a, b) result(x)
    real(dp), intent(in) :: a(3, 3), b(3)
    real(dp) :: x(3), c(3, 3)
    integer :: i

    do i = 1, 3
      c = a
      c(:, i) = b
      x(i) = det(c) / det(a)
    end do
  end function solve3

  pure real(dp) function det(a)
    real(dp), intent(in) :: a(3, 3)

    det = a(1, 1) * (a(2, 2) * a(3, 3) - a(2, 3) * a(3, 2)) - a(1, 2) * (a(2, 1) * a(3, 3) - a(2, 3) * a(3, 1)) &
      & + a(1, 3) * (a(2, 1) * a(3, 2) - a(2, 2) * a(3, 1))
  end function det

  !> A crank of radius 1 about the origin.
  subroutine new_crank(linkage, failure)
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: failure

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 1.0_dp, 0.0_dp, failure)
    call linkage%link("crank", "O", "A", 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
  end subroutine new_crank

end module machines
