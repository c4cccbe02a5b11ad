!> Points and directions at one crank angle, as values with derivatives (jets), and at a batch of crank angles. For a batch,
!> velocities and accelerations are computed in loops that the compiler can vectorise.
module gestell_model_joints_path
  use gestell_base_processor, only: has_versions, vector_length
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-), operator(/), sqrt
  use gestell_math_vectors, only: batch
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: carried, carry, cross, direction, dot, find_direction, set_fixed, copy_batch, turn, turning_scale

  !> A point (m) in the mechanism's x-y plane, with its derivatives with respect to the crank angle.
  type, public :: point_type
    type(jet) :: x = jet(), y = jet()
  end type point_type

  !> Safety factor on bounds on motions. It is so large that rounding errors cannot make a proof succeed wrongly.
  real(dp), parameter, public :: slack = 1.01_dp

  !> The joints of a linkage are computed at a batch of crank angles together.
  public :: batch

  !> A point (m) or a direction at the crank angles of a batch, with its first (vx, vy) and second (ax, ay) derivatives
  !> with respect to the crank angle.
  type, bind(C), public :: path_type
    real(dp), dimension(batch) :: x, y, vx, vy, ax, ay
  end type path_type

  abstract interface
    pure subroutine direction_version(from, to, u, once) bind(C)
      import :: c_int, path_type
      implicit none (type, external)
      type(path_type), intent(in) :: from, to
      type(path_type), intent(inout) :: u
      integer(c_int), value :: once
    end subroutine direction_version
  end interface

  procedure(direction_version), bind(C, name="_ZGVeN2uuul_lanes_gestell_direction") :: direction_512
  procedure(direction_version), bind(C, name="_ZGVdN2uuul_lanes_gestell_direction") :: direction_256

contains

  !> Unit vector from one point to another.
  pure type(point_type) function direction(from, to)
    type(point_type), intent(in) :: from, to
    type(jet) :: length

    direction = point_type(to%x - from%x, to%y - from%y)
    length = sqrt(dot(direction, direction))
    direction = point_type(direction%x / length, direction%y / length)
  end function direction

  !> Crank angle over which the direction from one point to another changes noticeably (rad). It is small if the points come close
  !> together.
  pure real(dp) function turning_scale(from, to) result(angle_scale)
    type(point_type), intent(in) :: from, to
    real(dp) :: apart, rate

    apart = hypot(to%x%v - from%x%v, to%y%v - from%y%v)
    rate = hypot(to%x%d - from%x%d, to%y%d - from%y%d)
    angle_scale = 1
    if (rate > apart) angle_scale = apart / rate
  end function turning_scale

  !> The point at the distance `along` (m) from `base` in the direction u, and at the distance `across` (m) to the left of this
  !> line.
  pure type(point_type) function carried(base, u, along, across)
    type(point_type), intent(in) :: base, u
    real(dp), intent(in) :: along, across

    carried = point_type(base%x + along * u%x - across * u%y, base%y + along * u%y + across * u%x)
  end function carried

  !> Scalar product of two vectors.
  pure type(jet) function dot(a, b)
    type(point_type), intent(in) :: a, b

    dot = a%x * b%x + a%y * b%y
  end function dot

  !> Cross product of two vectors.
  pure type(jet) function cross(a, b)
    type(point_type), intent(in) :: a, b

    cross = a%x * b%y - a%y * b%x
  end function cross

  !> Copies the angles `first` to `last` to the batch `some`. A batch that is not full repeats its last angle.
  pure subroutine copy_batch(angles, first, last, some)
    real(dp), contiguous, intent(in) :: angles(:)
    integer, intent(in) :: first
    integer, intent(out) :: last
    real(dp), intent(out) :: some(batch)

    last = min(first + batch - 1, size(angles))
    some(:last - first + 1) = angles(first:last)
    some(last - first + 2:) = angles(last)
  end subroutine copy_batch

  !> Sets the path of a point, or of a direction, that does not move.
  pure subroutine set_fixed(position, here)
    real(dp), intent(in) :: position(2)
    type(path_type), intent(out) :: here

    here%x = position(1)
    here%y = position(2)
    here%vx = 0
    here%vy = 0
    here%ax = 0
    here%ay = 0
  end subroutine set_fixed

  !> Computes the unit vector u along e = to - from, d = |e|, with derivatives. It rotates at the rate w:
  !>
  !>     u' = w u_perp,  u'' = w' u_perp - w^2 u,  w = e x e' / d^2,  w' = (e x e'' - 2 w e.e') / d^2.
  pure subroutine find_direction(from, to, u)
    type(path_type), intent(in) :: from, to
    type(path_type), intent(out) :: u

    if (has_versions .and. vector_length() == 8) then
      call direction_512(from, to, u, 1)
    else if (has_versions .and. vector_length() == 4) then
      call direction_256(from, to, u, 1)
    else
      call direction_here(from, to, u, 1)
    end if
  end subroutine find_direction

  pure subroutine direction_here(from, to, u, once) bind(C, name="lanes_gestell_direction")
    !$omp declare simd uniform(from, to, u) linear(once) simdlen(2) notinbranch
    type(path_type), intent(in) :: from, to
    type(path_type), intent(inout) :: u
    integer(c_int), value :: once
    real(dp) :: inverse(batch), ex, ey, vx, vy, ax, ay, w, change
    integer :: k

    inverse = 0
    ! A vector version runs this body twice; the second run has nothing to do (gestell_base_processor).
    if (once > 1) return
    do k = 1, batch
      inverse(k) = 1 / ((to%x(k) - from%x(k))**2 + (to%y(k) - from%y(k))**2)
    end do
    do k = 1, batch
      ex = to%x(k) - from%x(k)
      ey = to%y(k) - from%y(k)
      vx = to%vx(k) - from%vx(k)
      vy = to%vy(k) - from%vy(k)
      ax = to%ax(k) - from%ax(k)
      ay = to%ay(k) - from%ay(k)
      w = (ex * vy - ey * vx) * inverse(k)
      change = (ex * ay - ey * ax - 2 * w * (ex * vx + ey * vy)) * inverse(k)
      ex = ex * sqrt(inverse(k))
      ey = ey * sqrt(inverse(k))
      u%x(k) = ex
      u%y(k) = ey
      u%vx(k) = -w * ey
      u%vy(k) = w * ex
      u%ax(k) = -change * ey - w * w * ex
      u%ay(k) = change * ex - w * w * ey
    end do
  end subroutine direction_here

  !> Computes `carried` along paths.
  pure subroutine carry(base, u, along, across, here)
    type(path_type), intent(in) :: base, u
    !> `along`: distance in the direction u (m). `across`: distance to the left of this direction (m)
    real(dp), intent(in) :: along, across
    type(path_type), intent(out) :: here
    integer :: k

    do k = 1, batch
      here%x(k) = base%x(k) + along * u%x(k) - across * u%y(k)
      here%y(k) = base%y(k) + along * u%y(k) + across * u%x(k)
      here%vx(k) = base%vx(k) + along * u%vx(k) - across * u%vy(k)
      here%vy(k) = base%vy(k) + along * u%vy(k) + across * u%vx(k)
      here%ax(k) = base%ax(k) + along * u%ax(k) - across * u%ay(k)
      here%ay(k) = base%ay(k) + along * u%ay(k) + across * u%ax(k)
    end do
  end subroutine carry

  !> Rotates the direction u to the left by a constant `angle` (rad); the result is `turned`.
  pure subroutine turn(u, angle, turned)
    type(path_type), intent(in) :: u
    real(dp), intent(in) :: angle
    type(path_type), intent(out) :: turned
    real(dp) :: c, s
    integer :: k

    c = cos(angle)
    s = sin(angle)
    do k = 1, batch
      turned%x(k) = c * u%x(k) - s * u%y(k)
      turned%y(k) = c * u%y(k) + s * u%x(k)
      turned%vx(k) = c * u%vx(k) - s * u%vy(k)
      turned%vy(k) = c * u%vy(k) + s * u%vx(k)
      turned%ax(k) = c * u%ax(k) - s * u%ay(k)
      turned%ay(k) = c * u%ay(k) + s * u%ax(k)
    end do
  end subroutine turn

end module gestell_model_joints_path
