!> The crank pin: a joint that the drive turns on a circle around another joint.
module gestell_model_joints_types_crank
  use gestell_base_key, only: key_type, of_length, positive, real_key, text_key
  use gestell_base_kinds, only: dp
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_math_jet, only: cos, jet, operator(*), operator(+), sin
  use gestell_model_joints_data, only: check_finite, check_lengths, joint_data_type
  use gestell_model_joints_deviation, only: deviation_type, disc
  use gestell_model_joints_driven, only: driven_joint, driven_keys
  use gestell_model_joints_joint, only: form_type, itself, point_type, reach_type
  use gestell_model_joints_pairs, only: pair_type, pin, shaft
  use gestell_model_joints_path, only: batch, path_type
  use gestell_model_joints_placement, only: placement_type
  implicit none (type, external)
  private

  type(key_type), parameter :: keys(*) = [ &
    & key_type("joint", "pivot", text_key, "joint about which the crank turns", required=.true.), &
    & key_type("joint", "radius", real_key, "crank radius", required=.true., unit=of_length, range=positive)]

  !> A point at the distance `radius` (m) from the joint `pivot`, about which it turns.
  type, extends(driven_joint), public :: crank_joint
    integer :: pivot = 0
    real(dp) :: radius = 0
  contains
    procedure :: describe, define, check, move, locate, trace, reach, deviation, pairs
  end type crank_joint

contains

  pure subroutine describe(self, form)
    class(crank_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("crank", "crank pin, at the distance `radius` from the joint `pivot`; the crank angle is `ratio` times " // &
      &   "the drive's angle, plus `phase`", links=1, pairs=1, keys=[keys, driven_keys], bars=[self%pivot, itself])
  end subroutine describe

  !> The crank is one body, on its pivot and driven by its shaft; the crank pin is a point of this body.
  pure subroutine pairs(self, number, list)
    class(crank_joint), intent(in) :: self
    integer, intent(in) :: number
    type(pair_type), allocatable, intent(out) :: list(:)

    list = [pair_type(pin, 1, self%pivot), pair_type(shaft, 1, number)]
  end subroutine pairs

  pure subroutine define(self, data)
    class(crank_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    self%pivot = sum(data%joints("pivot"))
    self%radius = data%number("radius")
    call self%define_drive(data)
  end subroutine define

  pure subroutine check(self, reason)
    class(crank_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call check_finite([self%radius, self%phase], reason)
    call check_lengths([self%radius], 1, reason)
  end subroutine check

  pure subroutine move(self, placement)
    class(crank_joint), intent(inout) :: self
    type(placement_type), intent(in) :: placement

    call self%move_drive(placement)
    self%phase = self%phase + placement%angle
  end subroutine move

  pure subroutine locate(self, crank_angle, points, here)
    class(crank_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(jet) :: angle

    angle = jet(self%ratio * crank_angle + self%phase, real(self%ratio, dp), 0.0_dp)
    here%x = points(self%pivot)%x + self%radius * cos(angle)
    here%y = points(self%pivot)%y + self%radius * sin(angle)
  end subroutine locate

  pure subroutine trace(self, angles, points, here)
    class(crank_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here
    real(dp) :: c(batch), s(batch)

    call cosine_sine(self%ratio * angles + self%phase, c, s)
    here%x = points(self%pivot)%x + self%radius * c
    here%y = points(self%pivot)%y + self%radius * s
    here%vx = points(self%pivot)%vx - self%ratio * self%radius * s
    here%vy = points(self%pivot)%vy + self%ratio * self%radius * c
    here%ax = points(self%pivot)%ax - self%ratio**2 * self%radius * c
    here%ay = points(self%pivot)%ay - self%ratio**2 * self%radius * s
  end subroutine trace

  pure function reach(self, points, speeds, accelerations, half_width)
    class(crank_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_points => points, unused_width => half_width)
    end associate
    reach%speed = speeds(self%pivot) + abs(self%ratio) * self%radius
    reach%acceleration = accelerations(self%pivot) + self%ratio**2 * self%radius
    reach%angle_scale = 1.0_dp / abs(self%ratio)
  end function reach

  !> Deviation of the acceleration: the deviation of the pivot, plus the change of the centripetal acceleration, which turns with
  !> the crank.
  pure function deviation(self, points, here, deviations, acceleration, half_width)
    class(crank_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(deviation_type), intent(in) :: deviations(:)
    real(dp), intent(in) :: acceleration, half_width
    type(deviation_type) :: deviation

    associate (unused_points => points, unused_here => here, unused => acceleration)
    end associate
    deviation = disc(deviations(self%pivot)%radius() + abs(self%ratio)**3 * self%radius * half_width)
  end function deviation

end module gestell_model_joints_types_crank
