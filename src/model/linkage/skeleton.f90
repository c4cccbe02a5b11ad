!> What of a linkage can be drawn: bars between joints, guides with the ways of their sliders, and where all of it goes.
module gestell_model_linkage_skeleton
  use gestell_base_kinds, only: dp
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: form_type, itself, point_type
  use gestell_model_linkage, only: linkage_type
  implicit none (type, external)
  private

  public :: trace_skeleton

  !> A straight line between two joints, as places in the list.
  type, public :: bar_type
    integer :: joints(2) = 0
    !> The link it belongs to, 0 where none has its mass.
    integer :: link = 0
    !> Whether its length changes, because something slides along it.
    logical :: slides = .false.
  end type bar_type

  !> A joint's slider on a guide, and how far it goes from the guide's point (m).
  type, public :: slider_type
    integer :: joint = 0
    type(guide_type) :: guide
    real(dp) :: travel(2) = 0
  end type slider_type

  type, public :: skeleton_type
    type(bar_type), allocatable :: bars(:)
    type(slider_type), allocatable :: sliders(:)
    !> Which joints are fixed to the frame.
    logical, allocatable :: grounded(:)
    !> Joints and centres of mass of the links in x-y (m), shapes (2, joints, angles) and (2, links, angles).
    real(dp), allocatable :: joints(:, :, :), centers(:, :, :)
  end type skeleton_type

contains

  !> The skeleton of a linkage that turns, at these crank angles (rad).
  subroutine trace_skeleton(linkage, angles, skeleton)
    class(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: angles(:)
    type(skeleton_type), intent(out) :: skeleton
    type(point_type) :: at(size(linkage%joints))
    real(dp) :: lengths(size(angles))
    integer :: i, k

    call find_parts(linkage, skeleton)
    allocate(skeleton%joints(2, size(linkage%joints), size(angles)), skeleton%centers(2, size(linkage%links), size(angles)))
    do k = 1, size(angles)
      call linkage%points(angles(k), at)
      do i = 1, size(at)
        skeleton%joints(:, i, k) = [at(i)%x%v, at(i)%y%v]
      end do
      do i = 1, size(skeleton%sliders)
        call extend_travel(skeleton%sliders(i), at, k == 1)
      end do
      do i = 1, size(linkage%links)
        skeleton%centers(:, i, k) = center_of(linkage, i, skeleton%joints(:, :, k))
      end do
    end do
    do i = 1, size(skeleton%bars)
      associate (bar => skeleton%bars(i))
        lengths = norm2(skeleton%joints(:, bar%joints(2), :) - skeleton%joints(:, bar%joints(1), :), dim=1)
        bar%slides = maxval(lengths) - minval(lengths) > 1.0e-6_dp * maxval(lengths)
      end associate
    end do
  end subroutine trace_skeleton

  !> The bars that joints and links say there are, and the sliders. A joint that brings no link is a point of a body that is there:
  !> the bars to it are this body's, and it is fixed to the frame where all that it is built on is.
  subroutine find_parts(linkage, skeleton)
    class(linkage_type), intent(in) :: linkage
    type(skeleton_type), intent(inout) :: skeleton
    type(form_type) :: form
    integer, allocatable :: carriers(:)
    integer :: i, k, link

    allocate(skeleton%bars(0), skeleton%sliders(0))
    allocate(skeleton%grounded(size(linkage%joints)), source=.false.)
    do i = 1, size(linkage%joints)
      call linkage%joints(i)%joint%describe(form)
      call linkage%joints(i)%joint%carriers(carriers)
      skeleton%grounded(i) = form%links == 0 .and. all(skeleton%grounded(carriers))
    end do
    do i = 1, size(linkage%links)
      if (linkage%links(i)%to > 0) call add_bar(skeleton, [linkage%links(i)%from, linkage%links(i)%to], i)
    end do
    do i = 1, size(linkage%joints)
      call linkage%joints(i)%joint%describe(form)
      call linkage%joints(i)%joint%carriers(carriers)
      if (allocated(form%bars)) then
        where (form%bars == itself) form%bars = i
        do k = 1, size(form%bars), 2
          link = 0
          if (form%links == 0 .and. size(carriers) == 2) link = body_of(skeleton, carriers)
          call add_bar(skeleton, form%bars(k:k + 1), link)
        end do
      end if
      if (.not. allocated(form%guides)) cycle
      do k = 1, size(form%guides)
        skeleton%sliders = [skeleton%sliders, slider_type(i, form%guides(k))]
      end do
    end do
  end subroutine find_parts

  !> Adds a bar unless it is there, or lies on the frame.
  subroutine add_bar(skeleton, joints, link)
    type(skeleton_type), intent(inout) :: skeleton
    integer, intent(in) :: joints(2), link

    if (place_of_bar(skeleton, joints) > 0 .or. all(skeleton%grounded(joints))) return
    skeleton%bars = [skeleton%bars, bar_type(joints, link)]
  end subroutine add_bar

  !> The bar between two joints, 0 where there is none.
  pure integer function place_of_bar(skeleton, joints) result(place)
    type(skeleton_type), intent(in) :: skeleton
    integer, intent(in) :: joints(2)

    do place = 1, size(skeleton%bars)
      associate (have => skeleton%bars(place)%joints)
        if (all(have == joints) .or. all(have == joints(2:1:-1))) return
      end associate
    end do
    place = 0
  end function place_of_bar

  !> The link that carries two joints, 0 where none is known to.
  pure integer function body_of(skeleton, joints) result(link)
    type(skeleton_type), intent(in) :: skeleton
    integer, intent(in) :: joints(2)
    integer :: place

    link = 0
    place = place_of_bar(skeleton, joints)
    if (place > 0) link = skeleton%bars(place)%link
  end function body_of

  !> Takes the place of a slider into its travel.
  pure subroutine extend_travel(slider, at, first)
    type(slider_type), intent(inout) :: slider
    type(point_type), intent(in) :: at(:)
    logical, intent(in) :: first
    type(point_type) :: origin, along
    real(dp) :: travel

    call slider%guide%line(at, origin, along)
    travel = (at(slider%joint)%x%v - origin%x%v) * along%x%v + (at(slider%joint)%y%v - origin%y%v) * along%y%v
    if (first) slider%travel = travel
    slider%travel = [min(slider%travel(1), travel), max(slider%travel(2), travel)]
  end subroutine extend_travel

  !> Centre of mass of a link with the joints at `at`, shape (2, joints).
  pure function center_of(linkage, i, at) result(center)
    class(linkage_type), intent(in) :: linkage
    integer, intent(in) :: i
    real(dp), intent(in) :: at(:, :)
    real(dp) :: center(2), e(2)

    associate (link => linkage%links(i))
      e = [1, 0]
      if (link%to > 0) then
        e = at(:, link%to) - at(:, link%from)
        e = e / norm2(e)
      end if
      center = at(:, link%from) + link%center(1) * e + link%center(2) * [-e(2), e(1)]
    end associate
  end function center_of

end module gestell_model_linkage_skeleton
