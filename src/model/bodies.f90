!> The links of a linkage as bodies, and the sums over them.
module gestell_model_bodies
  use gestell_base_jet, only: jet, operator(*), operator(+), operator(-)
  use gestell_base_kinds, only: dp
  use gestell_model_joints_guide, only: direction
  use gestell_model_joints_joint, only: point_type
  use gestell_model_mechanism, only: mass_functions_type
  implicit none (type, external)
  private

  public :: sum_masses

  !> A body. Its xi-axis points from joint `from` to joint `to`; without `to` (0) it keeps the directions of x and y.
  type, public :: link_type
    character(len=:), allocatable :: name
    integer :: from = 0, to = 0
    !> Mass (kg), moment of inertia about the centre of mass (kg m^2), centre of mass in the link's system (m).
    real(dp) :: mass = 0, inertia = 0, center(2) = 0
  end type link_type

contains

  !> The sums (4) to (7) over the links, with all joints at `at`. Sums that cancel to the last rounding are zero: a
  !> balanced mechanism does not shake at all.
  pure subroutine sum_masses(links, at, a)
    type(link_type), intent(in) :: links(:)
    type(point_type), intent(in) :: at(:)
    type(mass_functions_type), intent(out) :: a
    type(point_type) :: center
    type(jet) :: size1, size2
    real(dp) :: turn, a4_size
    integer :: i

    a4_size = 0
    do i = 1, size(links)
      associate (link => links(i))
        call body_motion(link, at, center, turn)
        a%a1 = a%a1 + link%mass * center%x
        a%a2 = a%a2 + link%mass * center%y
        a%a3 = a%a3 + link%mass * (center%x * center%x + center%y * center%y)
        a%a4 = a%a4 + link%mass * (center%x%v * center%y%dd - center%y%v * center%x%dd) + link%inertia * turn
        size1 = size1 + magnitude(link%mass, center%x)
        size2 = size2 + magnitude(link%mass, center%y)
        a4_size = a4_size + link%inertia * abs(turn) &
          & + link%mass * (abs(center%x%v * center%y%dd) + abs(center%y%v * center%x%dd))
      end associate
    end do
    a%a1 = cleaned(a%a1, size1)
    a%a2 = cleaned(a%a2, size2)
    if (abs(a%a4) <= 8 * epsilon(1.0_dp) * a4_size) a%a4 = 0
  end subroutine sum_masses

  !> The motion of a link's centre of mass, and its angular acceleration d2(phi_i) / dphi2.
  pure subroutine body_motion(link, at, center, turn)
    type(link_type), intent(in) :: link
    type(point_type), intent(in) :: at(:)
    type(point_type), intent(out) :: center
    real(dp), intent(out) :: turn
    type(point_type) :: u

    if (link%to == 0) then
      center%x = at(link%from)%x + link%center(1)
      center%y = at(link%from)%y + link%center(2)
      turn = 0
      return
    end if
    u = direction(at(link%from), at(link%to))
    center%x = at(link%from)%x + link%center(1) * u%x - link%center(2) * u%y
    center%y = at(link%from)%y + link%center(1) * u%y + link%center(2) * u%x
    ! u = (cos phi, sin phi): phi'' = u x u''.
    turn = u%x%v * u%y%dd - u%y%v * u%x%dd
  end subroutine body_motion

  pure type(jet) function magnitude(factor, term)
    real(dp), intent(in) :: factor
    type(jet), intent(in) :: term

    magnitude = jet(factor * abs(term%v), factor * abs(term%d), factor * abs(term%dd))
  end function magnitude

  pure type(jet) function cleaned(sum, magnitude)
    type(jet), intent(in) :: sum, magnitude
    real(dp), parameter :: noise = 8 * epsilon(1.0_dp)

    cleaned = jet(merge(0.0_dp, sum%v, abs(sum%v) <= noise * magnitude%v), &
      & merge(0.0_dp, sum%d, abs(sum%d) <= noise * magnitude%d), &
      & merge(0.0_dp, sum%dd, abs(sum%dd) <= noise * magnitude%dd))
  end function cleaned

end module gestell_model_bodies
