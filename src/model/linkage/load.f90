!> Loads of a linkage: forces and moments between two links, a link and the frame, or a body and the ground, as functions of the
!> crank angle.
module gestell_model_linkage_load
  use gestell_base_kinds, only: dp
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-)
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_path, only: carried, direction, point_type
  use gestell_model_linkage_bodies, only: link_type
  use gestell_model_mechanism, only: load_sums_type
  implicit none (type, external)
  private

  public :: add_load_sums, load_action

  !> Bodies on which a load can act besides the links, whose numbers are positive.
  integer, parameter, public :: frame_body = 0, ground_body = -1

  !> Axes in which the direction of a force is fixed: those of the frame, of the link `on`, of a guide, or of the ground.
  character(len=6), parameter, public :: load_axes(4) = [character(len=6) :: "frame", "link", "guide", "ground"]

  !> Polytropic cycle of a compressor (gestell_model_linkage_gas).
  type, public :: gas_type
    !> `bore` (m); `clearance` volume as a fraction of the swept volume; pressures of suction, discharge, and on the other side of
    !> the piston (Pa); polytropic `exponent`; number of harmonics of the force.
    real(dp) :: bore = 0, clearance = 0, suction = 0, discharge = 0, ambient = 0, exponent = 0
    integer :: orders = 0
  end type gas_type

  !> A load. The force and the moment act on the body `on`; the opposite force and moment act on the body `against`.
  type, public :: load_type
    character(len=:), allocatable :: name
    !> Numbers of the two bodies: index of a link, `frame_body` or `ground_body`.
    integer :: on = frame_body, against = frame_body
    !> Index of the joint at which the force acts. If it is 0, the force acts at `point`: coordinates in the axes of the link `on`
    !> (m); if `on` is the frame, coordinates along the frame's axes relative to its centre of mass (m).
    integer :: joint = 0
    real(dp) :: point(3) = 0
    !> `axes`: one of `load_axes`. `angle`: direction of a positive force in these axes (rad).
    character(len=6) :: axes = "frame"
    real(dp) :: angle = 0
    !> Guide that sets the direction if `axes` is "guide".
    type(guide_type) :: guide
    !> Harmonics of force (N) and moment (N m) over the angle alpha = phi `ratio`/`denominator` + `phase` (rad), where phi is the
    !> crank angle: the mean, then the factors of cos alpha, sin alpha, cos 2 alpha, .... The procedure `gear`
    !> (gestell_model_linkage_gearing) sets the denominator to 1.
    real(dp), allocatable :: force(:), moment(:)
    integer :: ratio = 1, denominator = 1
    real(dp) :: phase = 0
    !> If allocated, `force` is computed from this cycle times `scale` when the linkage is prepared.
    type(gas_type), allocatable :: gas
    real(dp) :: scale = 1
    !> For a frame in space only: position along the normal of the plane (m), and number of the plane. `vector`: direction of a
    !> load on the frame, if it is not given by `angle`.
    real(dp) :: z = 0, vector(3) = 0
    integer :: plane = 0
  contains
    procedure :: highest_order
  end type load_type

  !> A load at one crank angle, in the axes of its plane (m, N, N m). All quantities are given with their first derivatives with
  !> respect to the crank angle; second and third derivatives of `force` and `moment` are not computed.
  type, public :: action_type
    !> `point`: where the force acts, relative to the origin of the plane's axes. `force`: force on the body `on`.
    type(point_type) :: point, force
    type(jet) :: moment
    !> Torque that the load exerts on the crank: its power at unit crank speed if the frame is at rest (N m).
    type(jet) :: torque
    !> Velocity of the point of the body `on` at which the force acts, relative to the frame, at unit crank speed (m).
    type(point_type) :: velocity
  end type action_type

contains

  !> Highest order of the load: number of cycles per period. The denominator must be 1.
  elemental integer function highest_order(self)
    class(load_type), intent(in) :: self

    highest_order = 0
    if (allocated(self%force)) highest_order = size(self%force) / 2
    if (allocated(self%moment)) highest_order = max(highest_order, size(self%moment) / 2)
    highest_order = abs(self%ratio) * highest_order
  end function highest_order

  !> Computes point of action, force, moment and torque of a load at a crank angle.
  pure subroutine load_action(load, links, at, crank_angle, action, origin)
    type(load_type), intent(in) :: load
    !> `links`: links of the linkage. `at`: points of its joints at the crank angle
    type(link_type), intent(in) :: links(:)
    type(point_type), intent(in) :: at(:)
    !> Crank angle phi of the linkage (rad)
    real(dp), intent(in) :: crank_angle
    type(action_type), intent(out) :: action
    !> Origin of the plane's axes relative to the frame's centre of mass (m). Only a force on the frame at a given point needs it
    real(dp), intent(in), optional :: origin(2)
    type(point_type) :: along, other, unused
    type(jet) :: force, rate(2), angle

    along = point_type(jet(1.0_dp), jet(0.0_dp))
    if (load%on > 0) then
      associate (link => links(load%on))
        if (link%to > 0) along = direction(at(link%from), at(link%to))
        action%point = carried(at(link%from), along, load%point(1), load%point(2))
      end associate
    else
      action%point = point_type(jet(load%point(1)), jet(load%point(2)))
      if (present(origin)) action%point = point_type(jet(load%point(1) - origin(1)), jet(load%point(2) - origin(2)))
    end if
    if (load%joint > 0) action%point = at(load%joint)
    if (load%axes == "guide") call load%guide%line(at, unused, along)
    if (load%axes == "frame" .or. load%axes == "ground") along = point_type(jet(1.0_dp), jet(0.0_dp))
    angle = jet(load%ratio * crank_angle + load%phase, real(load%ratio, dp))
    force = jet()
    if (allocated(load%force)) force = course(load%force, angle)
    if (allocated(load%moment)) action%moment = course(load%moment, angle)
    along = carried(point_type(), along, cos(load%angle), sin(load%angle))
    action%force = point_type(force * along%x, force * along%y)
    call move(load%on, links, at, action%point, action%velocity, rate(1))
    call move(load%against, links, at, action%point, other, rate(2))
    action%torque = action%force%x * (action%velocity%x - other%x) + action%force%y * (action%velocity%y - other%y) &
      & + action%moment * (rate(1) - rate(2))
  end subroutine load_action

  !> Value and derivative of the series c_0 + sum over k of c_k cos(k alpha) + s_k sin(k alpha), by recurrence.
  pure type(jet) function course(coefficients, alpha)
    real(dp), intent(in) :: coefficients(:)
    type(jet), intent(in) :: alpha
    complex(dp) :: turn, turned
    integer :: k

    turn = cmplx(cos(alpha%v), sin(alpha%v), dp)
    turned = 1
    course = jet(coefficients(1))
    do k = 1, size(coefficients) / 2
      turned = turned * turn
      associate (c => coefficients(2 * k), s => coefficients(2 * k + 1))
        course%v = course%v + c * real(turned) + s * aimag(turned)
        course%d = course%d + k * alpha%d * (s * real(turned) - c * aimag(turned))
      end associate
    end do
  end function course

  !> Computes the velocity of the point of a body that is at `point`, and the body's rate of rotation, both relative to the frame
  !> and at unit crank speed. Of the jets only value and first derivative are correct.
  pure subroutine move(body, links, at, point, velocity, rate)
    integer, intent(in) :: body
    type(link_type), intent(in) :: links(:)
    type(point_type), intent(in) :: at(:), point
    type(point_type), intent(out) :: velocity
    type(jet), intent(out) :: rate
    type(point_type) :: u

    if (body <= 0) return
    associate (from => at(links(body)%from))
      if (links(body)%to > 0) then
        u = direction(from, at(links(body)%to))
        rate = jet(u%x%v * u%y%d - u%y%v * u%x%d, u%x%v * u%y%dd - u%y%v * u%x%dd)
      end if
      velocity%x = jet(from%x%d, from%x%dd) - rate * (point%y - from%y)
      velocity%y = jet(from%y%d, from%y%dd) + rate * (point%x - from%x)
    end associate
  end subroutine move

  !> Adds a load at one crank angle to `sums`. `origin`: origin of the mechanism's axes relative to the frame's centre of mass (m).
  pure subroutine add_load_sums(load, action, origin, sums)
    type(load_type), intent(in) :: load
    type(action_type), intent(in) :: action
    real(dp), intent(in) :: origin(2)
    type(load_sums_type), intent(inout) :: sums
    complex(dp) :: r(0:2), f(0:1)

    associate (moment => [action%moment%v, action%moment%d], torque => [action%torque%v, action%torque%d])
      if (load%against /= ground_body) then
        sums%torque = sums%torque + torque
        return
      end if
      r(0) = cmplx(action%point%x%v + origin(1), action%point%y%v + origin(2), dp)
      r(1) = cmplx(action%point%x%d, action%point%y%d, dp)
      f = [cmplx(action%force%x%v, action%force%y%v, dp), cmplx(action%force%x%d, action%force%y%d, dp)]
      sums%moment = sums%moment + moment
      if (load%axes == "ground") then
        sums%fixed = sums%fixed + f
        sums%lever = sums%lever + [conjg(r(0)) * f(0), conjg(r(1)) * f(0) + conjg(r(0)) * f(1)]
        r(1) = cmplx(action%velocity%x%v, action%velocity%y%v, dp)
        r(2) = cmplx(action%velocity%x%d, action%velocity%y%d, dp)
        sums%sweep = sums%sweep + [conjg(r(1)) * f(0), conjg(r(2)) * f(0) + conjg(r(1)) * f(1)]
        ! the rest of the torque is that of the moment
        sums%torque = sums%torque + torque - real([conjg(r(1)) * f(0), conjg(r(2)) * f(0) + conjg(r(1)) * f(1)])
      else
        sums%force = sums%force + f
        sums%moment = sums%moment + aimag([conjg(r(0)) * f(0), conjg(r(1)) * f(0) + conjg(r(0)) * f(1)])
        sums%torque = sums%torque + torque
      end if
    end associate
  end subroutine add_load_sums

end module gestell_model_linkage_load
