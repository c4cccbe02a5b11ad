!> The dyad RRR of three turning pairs: the joint at given distances from two earlier joints, (24) of doc/theory.md.
module gestell_model_joints_types_rrr
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-), operator(/), sqrt
  use gestell_model_joints_data, only: check_lengths, joint_data_type
  use gestell_model_joints_deviation, only: along_bar, deviation_type, parallelogram
  use gestell_model_joints_joint, only: branch_key, form_type, largest_change, itself, joint_type, point_type, reach_type, &
    & slack, steady, transmission_type, two_ends, two_lengths
  use gestell_model_joints_path, only: batch, path_type
  implicit none (type, external)
  private

  !> A joint at the distances `lengths(1)` from joint `ends(1)` and `lengths(2)` from joint `ends(2)` (m). It is on the left of the
  !> line from `ends(1)` to `ends(2)` if `branch` = 1, and on the right if `branch` = -1.
  type, extends(joint_type), public :: rrr_joint
    integer :: ends(2) = 0
    real(dp) :: lengths(2) = 0
    integer :: branch = 1
  contains
    procedure :: describe, define, check, locate, trace, reach, deviation, transmission, explain
  end type rrr_joint

contains

  pure subroutine describe(self, form)
    class(rrr_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("RRR", "pin of two links, at the distances `lengths(1)` from `ends(1)` and `lengths(2)` from `ends(2)`. " // &
      &   "With `branch = 1` it lies to the left of the line from `ends(1)` to `ends(2)`, with `-1` to the right", links=2, &
      &   pairs=3, keys=[two_ends, two_lengths, branch_key], bars=[self%ends(1), itself, self%ends(2), itself])
  end subroutine describe

  pure subroutine define(self, data)
    class(rrr_joint), intent(inout) :: self
    type(joint_data_type), intent(inout) :: data

    self%ends = data%joints("ends")
    self%lengths = data%numbers("lengths")
    self%branch = nint(data%number("branch"))
  end subroutine define

  pure subroutine check(self, reason)
    class(rrr_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call check_lengths(self%lengths, self%branch, reason)
  end subroutine check

  !> Computes the joint's position. With the vector e from ends(1) to ends(2), d = |e|, and the angle mu between the two links,
  !>
  !>     cos mu = (l1^2 + l2^2 - d^2) / (2 l1 l2),
  !>     r = r1 + [(l1^2 - l2^2 + d^2) / 2 e + branch l1 l2 sin mu e_perp] / d^2.
  pure subroutine locate(self, crank_angle, points, here)
    class(rrr_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(jet) :: ex, ey, d2, cos_mu, along, across

    associate (unused => crank_angle)
    end associate
    associate (one => points(self%ends(1)), two => points(self%ends(2)), l1 => self%lengths(1), l2 => self%lengths(2))
      ex = two%x - one%x
      ey = two%y - one%y
      d2 = ex * ex + ey * ey
      cos_mu = (-0.5_dp / (l1 * l2)) * d2 + (l1**2 + l2**2) / (2 * l1 * l2)
      along = (0.5_dp * d2 + (l1 - l2) * (l1 + l2) / 2) / d2
      ! 1 - cos^2 as (1 - cos)(1 + cos) loses no digits near a dead point
      across = self%branch * l1 * l2 * sqrt((-1.0_dp) * (cos_mu + (-1.0_dp)) * (cos_mu + 1.0_dp)) / d2
      here%x = one%x + along * ex - across * ey
      here%y = one%y + along * ey + across * ex
    end associate
  end subroutine locate

  pure subroutine trace(self, angles, points, here)
    class(rrr_joint), intent(in) :: self
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(in) :: points(:)
    type(path_type), intent(out) :: here

    associate (unused => angles)
    end associate
    call close_dyad(points(self%ends(1)), points(self%ends(2)), self%lengths(1), self%lengths(2), self%branch, here)
  end subroutine trace

  !> Computes the path of the joint; `locate` gives its position. The links p = r - r1 and q = r - r2 rotate at the rates w and z:
  !>
  !>     r' = r1' + w p_perp = r2' + z q_perp:          w = (r2' - r1') . q / (p x q),  z = (r2' - r1') . p / (p x q),
  !>     r'' = r1'' + w' p_perp - w^2 p = r2'' + ...:   w' = [(r2'' - r1'') . q + w^2 p . q - z^2 q . q] / (p x q),
  !>
  !> where p x q = branch l1 l2 sin mu.
  pure subroutine close_dyad(one, two, l1, l2, branch, here)
    type(path_type), intent(in) :: one, two
    real(dp), intent(in) :: l1, l2
    integer, intent(in) :: branch
    type(path_type), intent(out) :: here
    real(dp) :: ex, ey, d2, cosine, cross, across, inverse, along, px, py, qx, qy, vx, vy, ax, ay, w, z, change
    integer :: k

    do k = 1, batch
      ex = two%x(k) - one%x(k)
      ey = two%y(k) - one%y(k)
      d2 = ex * ex + ey * ey
      cosine = (l1**2 + l2**2) / (2 * l1 * l2) - 1 / (2 * l1 * l2) * d2
      cross = branch * l1 * l2 * sqrt((1 - cosine) * (1 + cosine))
      across = cross / d2
      along = ((l1 - l2) * (l1 + l2) + d2) / (2 * d2)
      px = along * ex - across * ey
      py = along * ey + across * ex
      along = ((l1 - l2) * (l1 + l2) - d2) / (2 * d2)
      qx = along * ex - across * ey
      qy = along * ey + across * ex
      vx = two%vx(k) - one%vx(k)
      vy = two%vy(k) - one%vy(k)
      ax = two%ax(k) - one%ax(k)
      ay = two%ay(k) - one%ay(k)
      inverse = 1 / cross
      w = (vx * qx + vy * qy) * inverse
      z = (vx * px + vy * py) * inverse
      change = (ax * qx + ay * qy + w * w * (px * qx + py * qy) - z * z * (qx * qx + qy * qy)) * inverse
      here%x(k) = one%x(k) + px
      here%y(k) = one%y(k) + py
      here%vx(k) = one%vx(k) - w * py
      here%vy(k) = one%vy(k) + w * px
      here%ax(k) = one%ax(k) - change * py - w * w * px
      here%ay(k) = one%ay(k) + change * px - w * w * py
    end do
  end subroutine close_dyad

  !> Bounds on the joint's motion. The speeds of the ends are at most v1, v2 and their accelerations at most a1, a2. Their distance
  !> d changes by at most (v1 + v2) half_width, or less if d' is small in the middle of the interval, because |d''| <= a1 + a2 + (v1
  !> + v2)^2 / d. If this range of d lies within |l1 - l2| < d < l1 + l2, the angle mu differs from 0 and pi everywhere. The links
  !> determine the components of the joint's velocity along themselves, hence |v| <= (v1 + v2) / sin mu. The component of its
  !> acceleration along link i is the acceleration of end i along this link minus the centripetal term |v - v_i|^2 / l_i.
  pure function reach(self, points, speeds, accelerations, half_width)
    class(rrr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach
    type(jet) :: d
    real(dp) :: v, least, bend, change, sine, rate

    associate (one => points(self%ends(1)), two => points(self%ends(2)), l1 => self%lengths(1), l2 => self%lengths(2))
      d = distance_of(one, two)
      v = slack * sum(speeds(self%ends))
      least = max(abs(l1 - l2), d%v - v * half_width)
      if (least > v * half_width) then
        bend = sum(accelerations(self%ends)) + v**2 / least
        change = largest_change(v, d%d, bend, half_width)
      else
        change = largest_change(v, v, 0.0_dp, half_width)
      end if
      reach%assembled = d%v - change > abs(l1 - l2) .and. d%v + change < l1 + l2
      if (.not. reach%assembled) return
      sine = sqrt(min(sine2(d%v - change), sine2(d%v + change)))
      ! Closer to a dead point `locate` loses half its digits.
      reach%assembled = sine > max(1.0e-6_dp, steady * sqrt(sine2(d%v)))
      if (.not. reach%assembled) return
      reach%speed = v / sine
      reach%acceleration = (sum(accelerations(self%ends)) + (reach%speed + speeds(self%ends(1)))**2 / l1 &
        & + (reach%speed + speeds(self%ends(2)))**2 / l2) / sine
      ! If the ends coincide, the speed has no bound, and the proof for links that follow the joint would fail.
      reach%assembled = reach%speed * half_width < min(l1, l2) / 4
      if (.not. reach%assembled) return
      ! cos mu changes at most at this rate. Near an extremum the dead point at a complex angle is sin mu / sqrt(rate) away.
      rate = d%v * v / (l1 * l2)
      if (rate > 0) reach%angle_scale = sqrt(sine2(d%v)) / sqrt(rate)
    end associate

  contains

    !> Square of the sine of the angle mu between the links, if the distance between the ends is `distance` (m).
    pure real(dp) function sine2(distance)
      real(dp), intent(in) :: distance

      associate (l1 => self%lengths(1), l2 => self%lengths(2))
        sine2 = (distance - (l1 - l2)) / l1 * ((distance + (l1 - l2)) / l2) * ((l1 + l2 - distance) / l1) &
          & * ((l1 + l2 + distance) / l2) / 4
      end associate
    end function sine2

  end function reach

  !> Deviation of the acceleration, from bounds on its components along both links. It is computed twice: first with the bound on
  !> the acceleration as radius, then with the smaller radius that results.
  pure function deviation(self, points, here, deviations, acceleration, half_width)
    class(rrr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(deviation_type), intent(in) :: deviations(:)
    real(dp), intent(in) :: acceleration, half_width
    type(deviation_type) :: deviation
    real(dp) :: radius, directions(2, 2), bounds(2)
    integer :: round, k

    radius = acceleration + hypot(here%x%dd, here%y%dd)
    do round = 1, 2
      do k = 1, 2
        call along_bar(points(self%ends(k)), here, deviations(self%ends(k)), radius, half_width, directions(:, k), bounds(k))
      end do
      deviation = parallelogram(directions, bounds)
      radius = min(radius, deviation%radius())
    end do
  end function deviation

  pure type(jet) function distance_of(one, two) result(d)
    type(point_type), intent(in) :: one, two
    type(jet) :: ex, ey

    ex = two%x - one%x
    ey = two%y - one%y
    d = sqrt(ex * ex + ey * ey)
  end function distance_of

  !> Quality of the transmission. At a dead point the links are in line: d = l1 + l2 or d = |l1 - l2|.
  pure function transmission(self, points, here)
    class(rrr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:), here
    type(transmission_type) :: transmission
    type(jet) :: d, square

    associate (unused => here, l => self%lengths)
      d = distance_of(points(self%ends(1)), points(self%ends(2)))
      ! sin^2 mu
      associate (p => 1 / l(1), q => 1 / l(2), difference => l(1) - l(2), sum => l(1) + l(2))
        square = (p * (d + difference)) * (q * (d - difference)) * (p * (d + sum)) * (q * ((-1.0_dp) * d + sum))
      end associate
      transmission%sine = jet()
      if (square%v > 0) transmission%sine = 0.5_dp * sqrt(square)
      transmission%margin = (-1.0_dp) * d + (l(1) + l(2))
      if (d%v - abs(l(1) - l(2)) < transmission%margin%v) transmission%margin = d - abs(l(1) - l(2))
    end associate
  end function transmission

  pure subroutine explain(self, points, text)
    class(rrr_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    character(len=:), allocatable, intent(out) :: text

    associate (one => points(self%ends(1)), two => points(self%ends(2)), l => self%lengths)
      text = "its ends are " // concise(hypot(two%x%v - one%x%v, two%y%v - one%y%v)) // " m apart; lengths of " &
        & // concise(l(1)) // " m and " // concise(l(2)) // " m allow " // concise(abs(l(1) - l(2))) // " m to " &
        & // concise(l(1) + l(2)) // " m"
    end associate
  end subroutine explain

end module gestell_model_joints_types_rrr
