!> The cylinder: a drive whose length, or whose position on a guide, follows given harmonics of the crank angle.
module gestell_model_joints_types_cylinder
  use gestell_base_key, only: integer_key, key_type, of_length, one_or_minus_one, positive, real_key, text_key
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: concise
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-), operator(/), sqrt
  use gestell_model_joints_data, only: check_coordinates, check_finite, check_lengths, joint_data_type
  use gestell_model_joints_deviation, only: along_bar, deviation_type, disc, parallelogram
  use gestell_model_joints_driven, only: driven_joint, driven_keys
  use gestell_model_joints_guide, only: guide_keys, guide_motion_type, guide_type
  use gestell_model_joints_joint, only: form_type, itself, largest_change, point_type, reach_type, slack, steady, &
    & transmission_type
  use gestell_model_joints_pairs, only: pair_type, pin, slide, thrust
  use gestell_model_joints_path, only: dot
  use gestell_model_joints_placement, only: placement_type
  implicit none (type, external)
  private

  type(key_type), parameter :: keys(*) = [ &
    & key_type("joint", "stroke", real_key, "length of a cylinder as a Fourier series in the crank angle: the mean, then the " // &
    &   "factors of cos phi, sin phi, cos 2 phi, sin 2 phi, ...", 1, 3, 1001, required=.true., unit=of_length), &
    & key_type("joint", "ends", text_key, "", 1, 2, 2), &
    & key_type("joint", "lengths", real_key, "", 1, 1, 1, unit=of_length, range=positive), &
    & key_type("joint", "branch", integer_key, "", range=one_or_minus_one)]

  !> The pin of a lever about the joint `ends(1)` and of a cylinder on the joint `ends(2)`. It is at the distance `lever` from
  !> `ends(1)` and L from `ends(2)` (m), on the left of the line from `ends(1)` to `ends(2)` if `branch` = 1, on the right if -1:
  !>
  !>     L = stroke(1) + sum over k of stroke(2 k) cos(k phi) + stroke(2 k + 1) sin(k phi),
  !>
  !> where phi is the angle of the imaginary crank (gestell_model_joints_driven). If `ends` is 0, the joint is a slider at the
  !> distance L from the point of `guide`.
  type, extends(driven_joint), public :: cylinder_joint
    real(dp), allocatable :: stroke(:)
    integer :: ends(2) = 0
    real(dp) :: lever = 0
    integer :: branch = 1
    type(guide_type) :: guide
  contains
    procedure :: describe, define, check, move, locate, reach, reach_at, deviation, transmission, explain, pairs
    procedure, private :: length, bounds, sine2
  end type cylinder_joint

contains

  pure subroutine describe(self, form)
    class(cylinder_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("cylinder", "a drive: pin of a lever on `ends(1)`, of the length `lengths(1)`, and a cylinder on " // &
      &   "`ends(2)`, of the length `stroke`; `branch` as for `RRR`. Without `ends`: slider at the distance `stroke` from " // &
      &   "`guide_point`. The crank angle phi is `ratio` times the drive's angle, plus `phase`", &
      & links=1, pairs=1, keys=[keys, driven_keys, guide_keys])
    if (all(self%ends == 0)) then
      form%guides = [self%guide]
    else
      ! lever, tube and rod, with four pairs
      form%links = 3
      form%pairs = 4
      form%bars = [self%ends(1), itself, self%ends(2), itself]
    end if
  end subroutine describe

  !> Lever and cylinder are two bars: without mass the cylinder transmits only a force along its axis. A slider is one body, which
  !> the drive pushes along its guide.
  pure subroutine pairs(self, number, list)
    class(cylinder_joint), intent(in) :: self
    integer, intent(in) :: number
    type(pair_type), allocatable, intent(out) :: list(:)

    if (all(self%ends == 0)) then
      list = [pair_type(slide, 1, number, self%guide), pair_type(thrust, 1, number, self%guide)]
    else
      list = [pair_type(pin, 1, self%ends(1)), pair_type(pin, 1, number), pair_type(pin, 2, self%ends(2)), &
        & pair_type(pin, 2, number)]
    end if
  end subroutine pairs

  pure subroutine define(self, data)
    class(cylinder_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data
    logical :: lever(3), guided

    self%stroke = data%numbers("stroke")
    call self%define_drive(data)
    if (data%reason /= "") return
    lever = [data%has("ends"), data%has("lengths"), data%has("branch")]
    guided = any([data%has("guide"), data%has("guide_point"), data%has("guide_angle")])
    if (any(lever .eqv. guided)) then
      data%reason = "give either 'ends', 'lengths' and 'branch', or a guide"
    else if (guided) then
      call self%guide%define(data, "guide")
    else
      self%ends = data%joints("ends")
      self%lever = data%number("lengths")
      self%branch = nint(data%number("branch"))
    end if
  end subroutine define

  pure subroutine check(self, reason)
    class(cylinder_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    if (all(self%ends == 0)) then
      call self%guide%check(reason)
    else
      call check_lengths([self%lever], self%branch, reason)
    end if
    call check_finite([self%phase], reason)
    if (reason /= "") return
    if (.not. allocated(self%stroke)) then
      reason = "it has no stroke"
    else if (modulo(size(self%stroke), 2) == 0) then
      reason = "the stroke must have an odd number of values: the mean, then one cosine and one sine coefficient for each order"
    else
      call check_coordinates(self%stroke, reason)
    end if
  end subroutine check

  pure subroutine move(self, placement)
    class(cylinder_joint), intent(inout) :: self
    type(placement_type), intent(in) :: placement

    call self%move_drive(placement)
    call self%guide%move(placement)
  end subroutine move

  !> The length L (m) at a crank angle (rad).
  pure type(jet) function length(self, crank_angle)
    class(cylinder_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    real(dp) :: c, s, n, along, across
    integer :: k

    length = jet(self%stroke(1))
    do k = 1, size(self%stroke) / 2
      c = cos(k * (self%ratio * crank_angle + self%phase))
      s = sin(k * (self%ratio * crank_angle + self%phase))
      n = real(k * self%ratio, dp)
      along = self%stroke(2 * k) * c + self%stroke(2 * k + 1) * s
      across = self%stroke(2 * k + 1) * c - self%stroke(2 * k) * s
      length = length + jet(along, n * across, -n**2 * along, -n**3 * across)
    end do
  end function length

  !> Bounds on |L| and its first three derivatives: with the amplitude A_k of order k, |L^(m)| <= sum over k of k^m A_k.
  pure function bounds(self)
    class(cylinder_joint), intent(in) :: self
    real(dp) :: bounds(0:3)
    integer :: k, m

    bounds = [abs(self%stroke(1)), 0.0_dp, 0.0_dp, 0.0_dp]
    do k = 1, size(self%stroke) / 2
      bounds = bounds + norm2(self%stroke(2 * k:2 * k + 1)) * [(abs(real(k * self%ratio, dp))**m, m = 0, 3)]
    end do
  end function bounds

  !> Square of the sine of the angle between lever and cylinder, if the cylinder has this length and its ends are `apart` (m). It is
  !> not positive if the joint cannot be assembled.
  pure type(jet) function sine2(self, apart, length)
    class(cylinder_joint), intent(in) :: self
    type(jet), intent(in) :: apart, length

    associate (l => self%lever, p => 1 / self%lever)
      sine2 = 0.25_dp * (p * (apart - length + l)) * ((apart + length - l) / length) * (p * (apart + length + l)) &
        & * ((length - apart + l) / length)
    end associate
  end function sine2

  !> Computes the joint's position. With the unit vector u from ends(1) to ends(2), which are d apart, the lever l, and the angle mu
  !> between lever and cylinder, r = r1 + (d^2 + l^2 - L^2) / (2 d) u + branch l L sin mu / d u_perp.
  pure subroutine locate(self, crank_angle, points, here)
    class(cylinder_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: g, u
    type(jet) :: length, d, along, across

    length = self%length(crank_angle)
    if (all(self%ends == 0)) then
      call self%guide%line(points, g, u)
      here = point_type(g%x + length * u%x, g%y + length * u%y)
      return
    end if
    associate (one => points(self%ends(1)), two => points(self%ends(2)), l => self%lever)
      d = distance_of(one, two)
      along = 0.5_dp * (d - (length - l) * ((length + l) / d))
      across = (self%branch * l) * length * sqrt(self%sine2(d, length)) / d
      u = point_type((two%x - one%x) / d, (two%y - one%y) / d)
      here = point_type(one%x + along * u%x - across * u%y, one%y + along * u%y + across * u%x)
    end associate
  end subroutine locate

  pure type(jet) function distance_of(one, two) result(d)
    type(point_type), intent(in) :: one, two
    type(point_type) :: e

    e = point_type(two%x - one%x, two%y - one%y)
    d = sqrt(dot(e, e))
  end function distance_of

  !> Proves nothing, because the crank angle is unknown; see `reach_at`.
  pure function reach(self, points, speeds, accelerations, half_width)
    class(cylinder_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused => self, unused_points => points, unused_speeds => speeds, unused_accelerations => accelerations, &
      & unused_width => half_width)
    end associate
    reach%assembled = .false.
  end function reach

  !> Bounds on the joint's motion, as for the dyad RRR (gestell_model_joints_types_rrr). Here the distance d of the ends and the
  !> length L both vary. The joint can be assembled if |l - L| < d < l + L for all d and L of the interval. The sine of the angle mu
  !> has its minimum at an extreme pair of d and L, because cos mu is monotonic in d, and monotonic or convex and positive in L. The
  !> component of the joint's velocity along the cylinder is at most v2 + |L'|; the component of its acceleration along the
  !> cylinder is that of end 2 plus L'' + (L'^2 - |v - v_2|^2) / L.
  pure function reach_at(self, crank_angle, points, speeds, accelerations, half_width) result(reach)
    class(cylinder_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach
    type(guide_motion_type) :: guide
    type(jet) :: d, length, middle, extremes(4)
    real(dp) :: bound(0:3), v, least, change, rise, sine, now, rate
    integer :: i, k

    bound = self%bounds()
    ! the highest order of the cylinder's harmonics limits the angle scale
    rate = real(size(self%stroke) / 2 * abs(self%ratio), dp)
    if (rate > 1) reach%angle_scale = 1 / rate
    if (all(self%ends == 0)) then
      guide = self%guide%motion(points, speeds, accelerations, half_width)
      reach%assembled = guide%sound
      reach%speed = guide%speed + bound(0) * guide%turning + bound(1)
      reach%acceleration = guide%acceleration + bound(0) * (guide%turning_change + guide%turning**2) &
        & + 2 * bound(1) * guide%turning + bound(2)
      reach%angle_scale = min(reach%angle_scale, guide%angle_scale)
      return
    end if
    d = distance_of(points(self%ends(1)), points(self%ends(2)))
    length = self%length(crank_angle)
    v = slack * sum(speeds(self%ends))
    least = d%v - v * half_width
    change = v * half_width
    if (least > change) change = largest_change(v, d%d, sum(accelerations(self%ends)) + v**2 / least, half_width)
    rise = largest_change(bound(1), length%d, bound(2), half_width)
    reach%assembled = d%v - change > abs(length%v - self%lever) + rise .and. d%v + change < self%lever + length%v - rise
    if (.not. reach%assembled) return
    extremes = [((self%sine2(jet(d%v + i * change), jet(length%v + k * rise)), i = -1, 1, 2), k = -1, 1, 2)]
    sine = sqrt(minval(extremes%v))
    middle = self%sine2(d, length)
    now = sqrt(middle%v)
    ! Closer to a dead point `locate` loses half its digits.
    reach%assembled = sine > max(1.0e-6_dp, steady * now)
    if (.not. reach%assembled) return
    reach%speed = (v + bound(1)) / sine
    reach%acceleration = (sum(accelerations(self%ends)) + bound(2) + (reach%speed + speeds(self%ends(1)))**2 / self%lever &
      & + (reach%speed + speeds(self%ends(2)))**2 / (length%v - rise)) / sine
    reach%assembled = reach%speed * half_width < min(self%lever, length%v) / 4
    ! cos mu changes at most at this rate.
    rate = (d%v * v + (self%lever + length%v) * bound(1)) / (self%lever * length%v)
    if (rate > 0) reach%angle_scale = min(reach%angle_scale, now / sqrt(rate))
  end function reach_at

  !> Deviation of the acceleration, as for the dyad RRR. For the vector p along the cylinder p . p'' = L'^2 + L L'' - |p'|^2.
  !> Therefore half_width |3 L' L'' + L L'''| / L is added to the bound for a bar of constant length.
  pure function deviation(self, points, here, deviations, acceleration, half_width)
    class(cylinder_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(deviation_type), intent(in) :: deviations(:)
    real(dp), intent(in) :: acceleration, half_width
    type(deviation_type) :: deviation
    real(dp) :: bound(0:3), radius, directions(2, 2), limits(2), length
    integer :: round, k

    bound = self%bounds()
    radius = acceleration + hypot(here%x%dd, here%y%dd)
    deviation = disc(radius)
    if (all(self%ends == 0)) then
      if (all(self%guide%carriers == 0)) deviation = disc(bound(3) * half_width)
      return
    end if
    associate (p => points(self%ends(2)))
      length = hypot(here%x%v - p%x%v, here%y%v - p%y%v)
    end associate
    do round = 1, 2
      do k = 1, 2
        call along_bar(points(self%ends(k)), here, deviations(self%ends(k)), radius, half_width, directions(:, k), limits(k))
      end do
      limits(2) = limits(2) + slack * half_width * (3 * bound(1) * bound(2) + bound(0) * bound(3)) / length
      deviation = parallelogram(directions, limits)
      radius = min(radius, deviation%radius())
    end do
  end function deviation

  !> Quality of the transmission. At a dead point lever and cylinder are in line. The travel is the length of the cylinder.
  pure function transmission(self, points, here)
    class(cylinder_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(transmission_type) :: transmission
    type(point_type) :: g, u
    type(jet) :: d, length, square, difference

    transmission%slides = .true.
    if (all(self%ends == 0)) then
      call self%guide%line(points, g, u)
      transmission%travel = dot(point_type(here%x - g%x, here%y - g%y), u)
      return
    end if
    d = distance_of(points(self%ends(1)), points(self%ends(2)))
    length = distance_of(here, points(self%ends(2)))
    square = self%sine2(d, length)
    difference = length - self%lever
    difference = sign(1.0_dp, difference%v) * difference
    transmission%travel = length
    transmission%sine = jet()
    if (square%v > 0) transmission%sine = sqrt(square)
    transmission%margin = length - d + self%lever
    if (d%v - difference%v < transmission%margin%v) transmission%margin = d - difference
  end function transmission

  pure subroutine explain(self, points, text)
    class(cylinder_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text
    !> Number of crank angles at which the extreme lengths are looked for.
    integer, parameter :: samples = 720
    type(jet) :: d, lengths(samples)
    integer :: k

    text = "the two joints that carry the guide coincide"
    if (all(self%ends == 0)) return
    d = distance_of(points(self%ends(1)), points(self%ends(2)))
    lengths = [(self%length(2 * pi * k / samples), k = 1, samples)]
    text = "its ends are " // concise(d%v) // " m apart; the lever is " // concise(self%lever) // " m long, the cylinder " &
      & // concise(minval(lengths%v)) // " m to " // concise(maxval(lengths%v)) // " m"
  end subroutine explain

end module gestell_model_joints_types_cylinder
