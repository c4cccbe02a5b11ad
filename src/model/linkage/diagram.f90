!> Kinematic diagram of a linkage: bars between joints, guides with the travel of their sliders, and the paths of joints and centres
!> of mass.
module gestell_model_linkage_diagram
  use gestell_base_kinds, only: dp
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: form_type, itself, point_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: body_motion
  implicit none (type, external)
  private

  public :: trace_diagram

  !> A bar of the diagram: a straight line between two joints. `joints`: indices of these joints.
  type, public :: bar_type
    integer :: joints(2) = 0
    !> Number of the link to which the bar belongs; 0 if it belongs to no link.
    integer :: link = 0
    !> True if the length of the bar changes because a part slides along it.
    logical :: slides = .false.
  end type bar_type

  !> A joint that slides on a guide. `travel`: minimum and maximum of its distance from the guide's point (m).
  type, public :: slider_type
    integer :: joint = 0
    type(guide_type) :: guide
    real(dp) :: travel(2) = 0
  end type slider_type

  !> Data from which the kinematic diagram of a linkage is drawn.
  type, public :: diagram_type
    type(bar_type), allocatable :: bars(:)
    type(slider_type), allocatable :: sliders(:)
    !> True for each joint that is fixed to the frame.
    logical, allocatable :: grounded(:)
    !> Positions in the x-y plane (m) of the joints, shape (2, joints, angles), and of the links' centres of mass, shape (2, links,
    !> angles).
    real(dp), allocatable :: joints(:, :, :), centers(:, :, :)
    !> First and second derivatives of these positions with respect to the crank angle (m), of the joints and then of the centres of
    !> mass, shape (2, joints + links, angles, 2).
    real(dp), allocatable :: rates(:, :, :, :)
  end type diagram_type

contains

  !> Computes the diagram of a linkage at crank angles (rad). The linkage must be able to turn.
  subroutine trace_diagram(linkage, angles, diagram)
    class(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: angles(:)
    type(diagram_type), intent(out) :: diagram
    type(point_type) :: at(size(linkage%joints)), origin, along, center
    real(dp) :: lengths(size(angles)), travel, rate, turn
    integer :: i, k, n

    call list_bars_and_guides(linkage, diagram)
    n = size(linkage%joints)
    allocate(diagram%joints(2, n, size(angles)), diagram%centers(2, size(linkage%links), size(angles)))
    allocate(diagram%rates(2, n + size(linkage%links), size(angles), 2))
    do k = 1, size(angles)
      call linkage%points(angles(k), at)
      do i = 1, size(at)
        diagram%joints(:, i, k) = [at(i)%x%v, at(i)%y%v]
        diagram%rates(:, i, k, :) = rates_of(at(i))
      end do
      do i = 1, size(diagram%sliders)
        associate (slider => diagram%sliders(i), here => at(diagram%sliders(i)%joint))
          call slider%guide%line(at, origin, along)
          travel = (here%x%v - origin%x%v) * along%x%v + (here%y%v - origin%y%v) * along%y%v
          if (k == 1) slider%travel = travel
          slider%travel = [min(slider%travel(1), travel), max(slider%travel(2), travel)]
        end associate
      end do
      do i = 1, size(linkage%links)
        call body_motion(linkage%links(i), at, center, rate, turn)
        diagram%centers(:, i, k) = [center%x%v, center%y%v]
        diagram%rates(:, n + i, k, :) = rates_of(center)
      end do
    end do
    do i = 1, size(diagram%bars)
      associate (bar => diagram%bars(i))
        lengths = norm2(diagram%joints(:, bar%joints(2), :) - diagram%joints(:, bar%joints(1), :), dim=1)
        bar%slides = maxval(lengths) - minval(lengths) > 1.0e-6_dp * maxval(lengths)
      end associate
    end do

  contains

    !> First and second derivatives of a point's position with respect to the crank angle, shape (2, 2).
    pure function rates_of(point)
      type(point_type), intent(in) :: point
      real(dp) :: rates_of(2, 2)

      rates_of = reshape([point%x%d, point%y%d, point%x%dd, point%y%dd], [2, 2])
    end function rates_of

  end subroutine trace_diagram

  !> Finds the bars of joints and links, and the sliders. A joint that adds no link is a point of an existing body; the bars to this
  !> joint belong to the body. The joint is fixed to the frame if all joints from which it is built are fixed.
  subroutine list_bars_and_guides(linkage, diagram)
    class(linkage_type), intent(in) :: linkage
    type(diagram_type), intent(inout) :: diagram
    type(form_type) :: form
    integer, allocatable :: carriers(:)
    integer :: i, k, link

    allocate(diagram%bars(0), diagram%sliders(0))
    allocate(diagram%grounded(size(linkage%joints)), source=.false.)
    do i = 1, size(linkage%joints)
      call linkage%joints(i)%joint%describe(form)
      call linkage%joints(i)%joint%carriers(carriers)
      diagram%grounded(i) = form%links == 0 .and. all(diagram%grounded(carriers))
    end do
    do i = 1, size(linkage%links)
      if (linkage%links(i)%to > 0) call add_bar(diagram, [linkage%links(i)%from, linkage%links(i)%to], i)
    end do
    do i = 1, size(linkage%joints)
      call linkage%joints(i)%joint%describe(form)
      call linkage%joints(i)%joint%carriers(carriers)
      if (allocated(form%bars)) then
        where (form%bars == itself) form%bars = i
        do k = 1, size(form%bars), 2
          link = 0
          if (form%links == 0 .and. size(carriers) == 2) link = index_of_bar(diagram, carriers)
          if (link > 0) link = diagram%bars(link)%link
          call add_bar(diagram, form%bars(k:k + 1), link)
        end do
      end if
      if (.not. allocated(form%guides)) cycle
      do k = 1, size(form%guides)
        diagram%sliders = [diagram%sliders, slider_type(i, form%guides(k))]
      end do
    end do
  end subroutine list_bars_and_guides

  !> Adds a bar unless the diagram already contains it or both joints of the bar are fixed to the frame.
  subroutine add_bar(diagram, joints, link)
    type(diagram_type), intent(inout) :: diagram
    integer, intent(in) :: joints(2), link

    if (index_of_bar(diagram, joints) > 0 .or. all(diagram%grounded(joints))) return
    diagram%bars = [diagram%bars, bar_type(joints, link)]
  end subroutine add_bar

  !> Number of the bar between two joints; 0 if there is no such bar.
  pure integer function index_of_bar(diagram, joints) result(i)
    type(diagram_type), intent(in) :: diagram
    integer, intent(in) :: joints(2)

    do i = 1, size(diagram%bars)
      associate (have => diagram%bars(i)%joints)
        if (all(have == joints) .or. all(have == joints(2:1:-1))) return
      end associate
    end do
    i = 0
  end function index_of_bar

end module gestell_model_linkage_diagram
