!> Gas force on the piston of a compressor, from a polytropic cycle.
!>
!> With the piston's travel s along the direction of the force, V = A (s - min s) + c A (max s - min s) is the volume of gas, A the
!> area of the bore and c the clearance. From the largest volume the gas is compressed, p V^n = const, until the discharge pressure
!> opens the valve; from the smallest volume it expands until the suction pressure opens the other valve. The force is A (p - p_0)
!> with the pressure p_0 on the other side of the piston.
module gestell_model_linkage_gas
  use gestell_base_error, only: error_type, fatal_error, impossible_mechanism
  use gestell_base_kinds, only: dp, pi
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-)
  use gestell_math_series_piecewise, only: harmonics_of, quadrature_nodes, trimmed
  use gestell_model_joints_joint, only: named_joint_type, point_type
  use gestell_model_joints_path, only: carried
  use gestell_model_linkage_load, only: gas_type, load_type
  implicit none (type, external)
  private

  public :: set_gas_force

contains

  !> Computes the harmonics of the gas force of a load. Fails if the piston does not move to and fro exactly once per turn.
  pure subroutine set_gas_force(load, joints, error)
    type(load_type), intent(inout) :: load
    type(named_joint_type), intent(in) :: joints(:)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: steps = 360
    real(dp), allocatable :: nodes(:), weights(:), force(:)
    !> Angles of the outer ends of the travel, and of the events: smallest volume, suction opens, largest volume, discharge opens
    real(dp) :: travels(0:steps), ends(2), events(4), least, stroke, ratio
    type(jet) :: s
    integer :: k, low, high

    do k = 0, steps
      s = travel(2 * pi * k / steps)
      travels(k) = s%v
    end do
    low = minloc(travels(:steps - 1), dim=1) - 1
    high = maxloc(travels(:steps - 1), dim=1) - 1
    if (count((travels(1:steps) > travels(:steps - 1)) .neqv. [travels(2:steps), travels(1)] > travels(1:steps)) /= 2) then
      call fatal_error(error, "load '" // load%name // "': the piston must move to and fro exactly once per turn of its crank", &
        & impossible_mechanism, "load '" // load%name // "'")
      return
    end if
    ends = [extremum(2 * pi * low / steps), extremum(2 * pi * high / steps)]
    if (ends(2) < ends(1)) ends(2) = ends(2) + 2 * pi
    s = travel(ends(1))
    least = s%v
    s = travel(ends(2))
    stroke = s%v - least
    associate (gas => load%gas)
      ratio = (gas%suction / gas%discharge)**(1 / gas%exponent)
      events = [ends(1), where_travel(ends(1), ends(2), min(1.0_dp, gas%clearance * (1 / ratio - 1))), ends(2), &
        & where_travel(ends(2), ends(1) + 2 * pi, max(0.0_dp, (1 + gas%clearance) * ratio - gas%clearance))]
      call quadrature_nodes(events, gas%orders, nodes, weights)
      allocate(force(size(nodes)))
      do k = 1, size(nodes)
        s = travel(nodes(k))
        force(k) = pressure(gas, (s%v - least) / stroke + gas%clearance, nodes(k) < ends(2)) - gas%ambient
      end do
      load%force = trimmed(load%scale * pi / 4 * gas%bore**2 * harmonics_of(force, nodes, weights, gas%orders))
    end associate

  contains

    !> Travel of the piston along the direction of the force (m), with derivatives with respect to the angle alpha of the load.
    pure type(jet) function travel(alpha)
      real(dp), intent(in) :: alpha
      type(point_type) :: at(size(joints)), origin, along
      integer :: i

      do i = 1, size(joints)
        call joints(i)%joint%locate((alpha - load%phase) / load%ratio, at(:i - 1), at(i))
      end do
      call load%guide%line(at, origin, along)
      along = carried(point_type(), along, cos(load%angle), sin(load%angle))
      travel = (at(load%joint)%x - origin%x) * along%x + (at(load%joint)%y - origin%y) * along%y
      travel = jet(travel%v, travel%d / load%ratio, travel%dd / load%ratio**2)
    end function travel

    !> Angle near `start` at which the travel has its maximum or minimum, by Newton's method.
    pure real(dp) function extremum(start)
      real(dp), intent(in) :: start
      type(jet) :: s
      integer :: i

      extremum = start
      do i = 1, 30
        s = travel(extremum)
        if (.not. abs(s%dd) > 0) return
        extremum = extremum - max(-pi / steps, min(pi / steps, s%d / s%dd))
      end do
    end function extremum

    !> Angle between `from` and `to` at which the travel reaches a fraction of the stroke, by bisection.
    pure real(dp) function where_travel(from, to, fraction) result(middle)
      real(dp), intent(in) :: from, to, fraction
      real(dp) :: a, b
      type(jet) :: s
      integer :: i

      a = from
      b = to
      do i = 1, 60
        middle = (a + b) / 2
        s = travel(middle)
        if ((s%v - least > fraction * stroke) .eqv. to <= ends(2)) then
          b = middle
        else
          a = middle
        end if
      end do
    end function where_travel

  end subroutine set_gas_force

  !> Pressure of the gas (Pa) in a volume, which is given in units of the swept volume.
  pure real(dp) function pressure(gas, volume, expands)
    type(gas_type), intent(in) :: gas
    real(dp), intent(in) :: volume
    !> True while the volume grows
    logical, intent(in) :: expands

    if (expands) then
      pressure = max(gas%suction, gas%discharge * (gas%clearance / volume)**gas%exponent)
    else
      pressure = min(gas%discharge, gas%suction * ((1 + gas%clearance) / volume)**gas%exponent)
    end if
  end function pressure

end module gestell_model_linkage_gas
