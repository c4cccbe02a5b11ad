!> Kinematics of planar linkages in extended precision, for the oracle of the exact frame: it shares nothing with the library nor
!> with the other reference.
!>
!> Points of the plane are complex numbers, a . b = Re(conj(a) b). Every joint has its place and three derivatives with respect to
!> the drive's angle. The place follows from geometry; the derivatives of a place p that satisfies two constraints follow from
!> differentiating these, order by order:
!>
!>     |p - p1|^2 = l^2:        (p - p1) . p^(k) = (p - p1) . p1^(k) - 1/2 sum over 0 < j < k of C(k, j) D^(j) . D^(k-j),  D = p
!> - p1
!>     N . (p - g) = 0:         N . p^(k) = N . g^(k) - sum over 0 < j <= k of C(k, j) N^(j) . (p - g)^(k-j)
module oracle_kinematics
  use oracle_machine, only: dot, dp, exact_machine, i, pi, xp
  implicit none (type, external)
  private

  public :: prepare, trace

  !> A directed line through a point that may move and turn: place and direction of length 1.
  type :: line_type
    complex(xp) :: point(0:3) = 0, along(0:3) = 0
  end type line_type

  !> A condition on p^(k): `normal` . p^(k) = `value`.
  type :: condition_type
    complex(xp) :: normal = 0
    real(xp) :: value = 0
  end type condition_type

  !> C(k, j).
  integer, parameter :: binomial(0:3, 0:3) = reshape([1, 1, 1, 1, 0, 1, 2, 3, 0, 0, 1, 3, 0, 0, 0, 1], [4, 4])

  !> Rows of a machine's directions.
  integer, parameter :: phase = 1, guide = 2, guide2 = 3, slot = 4

contains

  !> Computes directions from angles once for all.
  pure subroutine prepare(machine)
    type(exact_machine), intent(inout) :: machine
    integer :: n

    machine%directions = reshape([([degrees(machine%joints(n)%phase_deg), degrees(machine%joints(n)%guide_angle_deg), &
      & degrees(machine%joints(n)%guide2_angle_deg), degrees(machine%joints(n)%slot_angle_deg)], n = 1, size(machine%joints))], &
      & [4, size(machine%joints)])
  end subroutine prepare

  !> Centres of mass of the links in x-y, with three derivatives with respect to the drive's angle `phi`, and three derivatives
  !> of the links' angles; shapes (0:3, links), (3, links). `turn`: exp(i phi/turns).
  pure subroutine trace(machine, turn, center, spin)
    type(exact_machine), intent(in) :: machine
    complex(xp), intent(in) :: turn
    complex(xp), intent(out) :: center(0:, :)
    real(xp), intent(out) :: spin(:, :)
    complex(xp) :: z(0:3, size(machine%joints)), along(0:3)
    integer :: n

    do n = 1, size(machine%joints)
      call place(machine, n, turn, z)
    end do
    do n = 1, size(machine%links)
      associate (link => machine%links(n))
        center(:, n) = z(:, link%from)
        spin(:, n) = 0
        if (link%to == 0) then
          center(0, n) = center(0, n) + point(link%center)
        else
          call direction(z(:, link%to) - z(:, link%from), along, spin(:, n))
          center(:, n) = center(:, n) + point(link%center) * along
        end if
      end associate
    end do
  end subroutine trace

  !> Place and derivatives of joint n, from those before it.
  pure subroutine place(machine, n, turn, z)
    type(exact_machine), intent(in) :: machine
    integer, intent(in) :: n
    complex(xp), intent(in) :: turn
    complex(xp), intent(inout) :: z(0:, :)
    complex(xp) :: along(0:3)
    type(line_type) :: line
    real(xp) :: spin(3), length(0:3)
    integer :: k

    associate (joint => machine%joints(n))
      select case (joint%kind)
      case ("ground")
        z(0, n) = point(joint%position)
        z(1:, n) = 0
      case ("crank")
        z(0, n) = joint%radius * machine%directions(phase, n) * turn**machine%turns_of(n)
        do k = 1, 3
          z(k, n) = z(k - 1, n) * i * machine%turns_of(n) / machine%turns
        end do
        z(:, n) = z(:, n) + z(:, joint%ends(1))
      case ("slip") ! a virtual displacement (oracle_joints)
        z(:, n) = z(:, joint%ends(1))
        z(1, n) = z(1, n) + point(joint%offset)
      case ("rigid")
        call direction(z(:, joint%ends(2)) - z(:, joint%ends(1)), along, spin)
        z(:, n) = z(:, joint%ends(1)) + point(joint%offset) * along
      case ("RPR")
        call direction(z(:, joint%ends(1)) - z(:, joint%ends(2)), along, spin)
        z(:, n) = z(:, joint%ends(2)) + joint%branch * real(joint%lengths(1), xp) * along
      case ("RRR")
        call meet_circles(z(:, joint%ends(1)), z(:, joint%ends(2)), real(joint%lengths, xp), joint%branch, z(:, n))
      case ("RRP")
        line = line_of(joint%guide, joint%guide_point, machine%directions(guide, n), z)
        call meet_circle(z(:, joint%ends(1)), real(joint%lengths(1), xp), line, joint%branch, z(:, n))
      case ("PRP")
        call meet_lines(line_of(joint%guide, joint%guide_point, machine%directions(guide, n), z), &
          & line_of(joint%guide2, joint%guide2_point, machine%directions(guide2, n), z), z(:, n))
      case ("RPP")
        line = line_of(joint%guide, joint%guide_point, machine%directions(guide, n), z)
        call meet_lines(line, line_type(z(:, joint%ends(1)), line%along * machine%directions(slot, n)), z(:, n))
      case ("cylinder")
        length = harmonics(joint%lift, machine%directions(phase, n) * turn**machine%turns_of(n)) &
          & * [((machine%turns_of(n) / real(machine%turns, xp))**k, k = 0, 3)]
        if (joint%ends(1) > 0) then
          call meet_circles(z(:, joint%ends(1)), z(:, joint%ends(2)), [real(joint%lengths(1), xp), length(0)], joint%branch, &
            & z(:, n), length)
        else
          call slide_along(line_of(joint%guide, joint%guide_point, machine%directions(guide, n), z), length, z(:, n))
        end if
      case default ! follower
        line = line_of(joint%guide, joint%guide_point, machine%directions(guide, n), z)
        call follow(z(:, joint%ends(2)) - z(:, joint%ends(1)), joint%lift, machine%directions(phase, n), line, z(:, n))
      end select
    end associate
  end subroutine place

  !> A fixed guide, or one carried by the body that connects two joints.
  pure function line_of(carriers, at, toward, z) result(line)
    integer, intent(in) :: carriers(2)
    real(dp), intent(in) :: at(2)
    complex(xp), intent(in) :: toward
    complex(xp), intent(in) :: z(0:, :)
    type(line_type) :: line
    complex(xp) :: along(0:3)
    real(xp) :: spin(3)

    if (carriers(1) == 0) then
      line%point(0) = point(at)
      line%along(0) = toward
    else
      call direction(z(:, carriers(2)) - z(:, carriers(1)), along, spin)
      line%point = z(:, carriers(1)) + point(at) * along
      line%along = along * toward
    end if
  end function line_of

  !> The direction exp(i theta) of e with its derivatives, and those of theta, the imaginary part of ln e.
  pure subroutine direction(e, along, spin)
    complex(xp), intent(in) :: e(0:)
    complex(xp), intent(out) :: along(0:)
    real(xp), intent(out) :: spin(:)
    complex(xp) :: first, second

    first = e(1) / e(0)
    second = e(2) / e(0)
    spin(1) = aimag(first)
    spin(2) = aimag(second - first**2)
    spin(3) = aimag(e(3) / e(0) - 3 * second * first + 2 * first**3)
    along(0) = e(0) / abs(e(0))
    along(1) = i * spin(1) * along(0)
    along(2) = cmplx(-spin(1)**2, spin(2), xp) * along(0)
    along(3) = cmplx(-3 * spin(1) * spin(2), spin(3) - spin(1)**3, xp) * along(0)
  end subroutine direction

  !> `length`: the second length with its derivatives, if it changes.
  pure subroutine meet_circles(p1, p2, lengths, branch, p, length)
    complex(xp), intent(in) :: p1(0:), p2(0:)
    real(xp), intent(in) :: lengths(2)
    integer, intent(in) :: branch
    complex(xp), intent(inout) :: p(0:)
    real(xp), intent(in), optional :: length(0:)
    complex(xp) :: e
    type(condition_type) :: second
    real(xp) :: d, part
    integer :: j, k

    e = p2(0) - p1(0)
    d = abs(e)
    part = ((lengths(1) - lengths(2)) * (lengths(1) + lengths(2)) / d**2 + 1) / 2
    p(0) = p1(0) + e * cmplx(part, branch * sqrt((lengths(1) / d - part) * (lengths(1) / d + part)), xp)
    do k = 1, 3
      second = on_circle(p2, p, k)
      if (present(length)) second%value = second%value + sum([(binomial(k, j) * length(j) * length(k - j), j = 0, k)]) / 2
      p(k) = solution(on_circle(p1, p, k), second)
    end do
  end subroutine meet_circles

  pure subroutine meet_circle(p1, length, line, branch, p)
    complex(xp), intent(in) :: p1(0:)
    real(xp), intent(in) :: length
    type(line_type), intent(in) :: line
    integer, intent(in) :: branch
    complex(xp), intent(inout) :: p(0:)
    complex(xp) :: way
    integer :: k

    way = conjg(line%along(0)) * (p1(0) - line%point(0))       ! along the line, and across
    p(0) = line%point(0) + line%along(0) * (real(way) + branch * sqrt((length - aimag(way)) * (length + aimag(way))))
    do k = 1, 3
      p(k) = solution(on_circle(p1, p, k), on_line(line, p, k))
    end do
  end subroutine meet_circle

  pure subroutine meet_lines(one, other, p)
    type(line_type), intent(in) :: one, other
    complex(xp), intent(inout) :: p(0:)
    integer :: k

    p(0) = line_meeting(one, other)
    do k = 1, 3
      p(k) = solution(on_line(one, p, k), on_line(other, p, k))
    end do
  end subroutine meet_lines

  pure complex(xp) function line_meeting(one, other)
    type(line_type), intent(in) :: one, other

    line_meeting = one%point(0) + one%along(0) * dot(i * other%along(0), other%point(0) - one%point(0)) &
      & / dot(i * other%along(0), one%along(0))
  end function line_meeting

  !> The joint at the lift L(theta) along the line, theta from the line's direction to the way e on the cam, plus that of `ahead`.
  pure subroutine follow(e, lift, ahead, line, p)
    complex(xp), intent(in) :: e(0:), ahead
    real(dp), intent(in) :: lift(:)
    type(line_type), intent(in) :: line
    complex(xp), intent(inout) :: p(0:)
    complex(xp) :: along(0:3)
    real(xp) :: spin(3), slide(3), by_angle(0:3), travel(0:3)

    call direction(e, along, spin)
    call direction(line%along, along, slide)
    spin = spin - slide
    by_angle = harmonics(lift, e(0) / abs(e(0)) / line%along(0) * ahead)
    travel(0) = by_angle(0)
    travel(1) = by_angle(1) * spin(1)
    travel(2) = by_angle(2) * spin(1)**2 + by_angle(1) * spin(2)
    travel(3) = by_angle(3) * spin(1)**3 + 3 * by_angle(2) * spin(1) * spin(2) + by_angle(1) * spin(3)
    call slide_along(line, travel, p)
  end subroutine follow

  !> Fourier series and its derivatives with respect to theta; `wave`: exp(i theta).
  pure function harmonics(coefficients, wave) result(series)
    real(dp), intent(in) :: coefficients(:)
    complex(xp), intent(in) :: wave
    real(xp) :: series(0:3)
    integer :: k, m

    series = 0
    series(0) = coefficients(1)
    do k = 1, size(coefficients) / 2
      do m = 0, 3
        series(m) = series(m) + real(cmplx(coefficients(2 * k), -coefficients(2 * k + 1), xp) * (i * k)**m * wave**k)
      end do
    end do
  end function harmonics

  !> The point at the distance `travel` along a line.
  pure subroutine slide_along(line, travel, p)
    type(line_type), intent(in) :: line
    real(xp), intent(in) :: travel(0:)
    complex(xp), intent(inout) :: p(0:)
    integer :: j, k

    do k = 0, 3
      p(k) = line%point(k)
      do j = 0, k
        p(k) = p(k) + binomial(k, j) * travel(j) * line%along(k - j)
      end do
    end do
  end subroutine slide_along

  pure type(condition_type) function on_circle(center, p, k)
    complex(xp), intent(in) :: center(0:), p(0:)
    integer, intent(in) :: k
    integer :: j

    on_circle%normal = p(0) - center(0)
    on_circle%value = dot(on_circle%normal, center(k))
    do j = 1, k - 1
      on_circle%value = on_circle%value - binomial(k, j) * dot(p(j) - center(j), p(k - j) - center(k - j)) / 2
    end do
  end function on_circle

  pure type(condition_type) function on_line(line, p, k)
    type(line_type), intent(in) :: line
    complex(xp), intent(in) :: p(0:)
    integer, intent(in) :: k
    integer :: j

    on_line%normal = i * line%along(0)
    on_line%value = dot(on_line%normal, line%point(k))
    do j = 1, k
      on_line%value = on_line%value - binomial(k, j) * dot(i * line%along(j), p(k - j) - line%point(k - j))
    end do
  end function on_line

  !> The x with a . x = alpha and b . x = beta.
  pure complex(xp) function solution(a, b)
    type(condition_type), intent(in) :: a, b

    solution = i * (b%value * a%normal - a%value * b%normal) / dot(i * a%normal, b%normal)
  end function solution

  pure complex(xp) function point(a)
    real(dp), intent(in) :: a(2)

    point = cmplx(a(1), a(2), xp)
  end function point

  pure complex(xp) function degrees(angle)
    real(dp), intent(in) :: angle

    degrees = exp(i * angle * pi / 180)
  end function degrees

end module oracle_kinematics
