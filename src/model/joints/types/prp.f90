!> The dyad PRP: a pin that joins two sliders, each on its guide.
module gestell_model_joints_types_prp
  use gestell_base_kinds, only: dp
  use gestell_math_jet, only: jet, operator(*), operator(-)
  use gestell_model_joints_data, only: joint_data_type
  use gestell_model_joints_guide, only: crossing, guide_keys, guide_motion_type, guide_type, intersect_lines, &
    & parallel, second_guide_keys
  use gestell_model_joints_joint, only: form_type, largest_change, joint_type, point_type, reach_type, steady, transmission_type
  use gestell_model_joints_path, only: batch, cross, dot, path_type
  use gestell_model_joints_placement, only: placement_type
  implicit none (type, external)
  private

  !> The pin of two sliders, at the intersection of their guides.
  type, extends(joint_type), public :: prp_joint
    type(guide_type) :: guides(2)
  contains
    procedure :: describe, define, check, move, locate, trace, reach, transmission
  end type prp_joint

contains

  pure subroutine describe(self, form)
    class(prp_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("PRP", "pin of two sliders, at the intersection of their guides", links=2, pairs=3, &
      & keys=[guide_keys, second_guide_keys], guides=self%guides, &
      & obstacle="the guides become parallel, or two joints that carry a guide coincide")
  end subroutine describe

  pure subroutine define(self, data)
    class(prp_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    call self%guides(1)%define(data, "guide")
    if (data%reason == "") call self%guides(2)%define(data, "guide2")
    if (data%reason == "" .and. all(self%guides(1)%carriers == self%guides(2)%carriers) &
      & .and. parallel(self%guides(1)%angle - self%guides(2)%angle)) data%reason = "the two guides are parallel"
  end subroutine define

  pure subroutine check(self, reason)
    class(prp_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call self%guides(1)%check(reason)
    call self%guides(2)%check(reason)
  end subroutine check

  pure subroutine move(self, placement)
    class(prp_joint), intent(inout) :: self
    type(placement_type), intent(in) :: placement

    call self%guides(1)%move(placement)
    call self%guides(2)%move(placement)
  end subroutine move

  pure subroutine locate(self, crank_angle, points, here)
    class(prp_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: g1, u1, g2, u2

    associate (unused => crank_angle)
    end associate
    call self%guides(1)%line(points, g1, u1)
    call self%guides(2)%line(points, g2, u2)
    here = crossing(g1, u1, g2, u2)
  end subroutine locate

  pure subroutine trace(self, angles, points, here)
    class(prp_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    type(path_type) :: g1, u1, g2, u2

    associate (unused => angles)
    end associate
    call self%guides(1)%trace(points, g1, u1)
    call self%guides(2)%trace(points, g2, u2)
    call intersect_lines(g1, u1, g2, u2, here)
  end subroutine trace

  !> Bounds on the joint's motion. The speed of a guide's point g is at most v_g, and the rate of rotation of the guide at most
  !> omega. The sine of the angle between the guides decreases by at most (omega_1 + omega_2) half_width. A second bound is lower if
  !> the derivative of the sine is small in the middle of the interval: the second derivative is at most omega_1' + omega_2' +
  !> (omega_1 + omega_2)^2. Perpendicular to a guide, the speed of the joint is at most v_g + omega |r - g|. The distance |r - g|
  !> grows while the joint moves. Therefore V bounds the speed of the joint if
  !>
  !>     V sin <= sum over the guides of v_g + omega (|r - g| + (V + v_g) half_width).
  pure function reach(self, points, speeds, accelerations, half_width)
    class(prp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach
    type(guide_motion_type) :: motion(2)
    type(point_type) :: g(2), u(2), here
    type(jet) :: sine
    real(dp) :: turning, left, across, distance
    integer :: i

    do i = 1, 2
      motion(i) = self%guides(i)%motion(points, speeds, accelerations, half_width)
      reach%assembled = motion(i)%sound
      if (.not. reach%assembled) return
      call self%guides(i)%line(points, g(i), u(i))
    end do
    sine = cross(u(1), u(2))
    turning = sum(motion%turning)
    left = abs(sine%v) - 2 * largest_change(turning, sine%d, sum(motion%turning_change) + turning**2, half_width)
    ! If the guides are closer to parallel, `crossing` loses half its digits.
    reach%assembled = left > max(sqrt(epsilon(left)), steady * abs(sine%v))
    if (.not. reach%assembled) return
    here = crossing(g(1), u(1), g(2), u(2))
    across = 0
    do i = 1, 2
      across = across + motion(i)%speed &
        & + motion(i)%turning * (hypot(here%x%v - g(i)%x%v, here%y%v - g(i)%y%v) + motion(i)%speed * half_width)
    end do
    reach%speed = across / left
    across = 0
    do i = 1, 2
      distance = hypot(here%x%v - g(i)%x%v, here%y%v - g(i)%y%v) + (reach%speed + motion(i)%speed) * half_width
      across = across + motion(i)%acceleration + distance * motion(i)%turning_change &
        & + 2 * motion(i)%turning * (reach%speed + motion(i)%speed + motion(i)%turning * distance)
    end do
    reach%acceleration = across / left
    if (turning > 0) reach%angle_scale = abs(sine%v) / turning
  end function reach

  !> Quality of the transmission. The transmission angle is the angle between the guides; the travel is the distance along the first
  !> guide.
  pure function transmission(self, points, here)
    class(prp_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(transmission_type) :: transmission
    type(point_type) :: g1, u1, g2, u2
    type(jet) :: sine

    call self%guides(1)%line(points, g1, u1)
    call self%guides(2)%line(points, g2, u2)
    sine = cross(u1, u2)
    transmission = transmission_type(sine=sign(1.0_dp, sine%v) * sine, slides=.true., &
      & travel=dot(point_type(here%x - g1%x, here%y - g1%y), u1))
  end function transmission

end module gestell_model_joints_types_prp
