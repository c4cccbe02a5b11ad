!> Bodies of a linkage that turn, and counterweights on them.
!>
!> A counterweight is a point mass m at the place c, complex, in the axes of a body that turns with exp(i theta(phi)): it lies at
!> P + c exp(i theta), P(phi) the body's pivot, where a point of it rests, or of a body without one the joint at the origin of its
!> axes.
module gestell_study_balance_bodies
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: link_type
  implicit none (type, external)
  private

  public :: find_bodies, point_on, with_counterweights

  !> A body that turns.
  type, public :: turning_body_type
    !> The link that gives it its axes, the first on it; its mean length from joint to joint (m).
    integer :: link = 0
    real(dp) :: length = 0
    !> Whether a point of it rests, and that point in its axes (m); of others their origin.
    logical :: pivoted = .false.
    complex(dp) :: pivot = 0
    !> Of its counterweight about the pivot (m).
    real(dp) :: radius = 0
    !> f_0, f_1, f_2 over Omega^2, shape (rows, angles, 3): of forces 1, of moments m.
    real(dp), allocatable :: effect(:, :, :)
  end type turning_body_type

  !> A point mass on a body: its unbalance rho (kg m) about the pivot at the angle alpha (rad) to the body's axes.
  type, public :: counterweight_type
    integer :: body = 0
    real(dp) :: unbalance = 0, angle = 0
  contains
    procedure :: mass
    procedure :: center
  end type counterweight_type

  complex(dp), parameter :: i = (0.0_dp, 1.0_dp)
  !> What is the same to this part of the lengths is the same: a body that turns no further does not.
  real(dp), parameter :: same = 1.0e-9_dp

contains

  !> Mass of the counterweight on its body (kg).
  elemental real(dp) function mass(self, body)
    class(counterweight_type), intent(in) :: self
    type(turning_body_type), intent(in) :: body

    mass = self%unbalance / body%radius
  end function mass

  !> Its place in the body's axes (m).
  pure function center(self, body)
    class(counterweight_type), intent(in) :: self
    type(turning_body_type), intent(in) :: body
    real(dp) :: center(2)
    complex(dp) :: c

    c = body%pivot + body%radius * exp(i * self%angle)
    center = [real(c, dp), aimag(c)]
    ! along an axis the other component is zero, not its rounding
    where (abs(center) <= 4 * epsilon(1.0_dp) * body%radius) center = 0
  end function center

  !> Bodies that turn, each once, with all joints at `at`, shape (joints, angles). Links whose axes turn alike and whose origins
  !> keep their distance are one; with `by_place` if they have their z and their plane in common too.
  subroutine find_bodies(linkage, at, by_place, bodies, links, radii)
    class(linkage_type), intent(in) :: linkage
    type(point_type), intent(in) :: at(:, :)
    logical, intent(in) :: by_place
    type(turning_body_type), allocatable, intent(out) :: bodies(:)
    integer, intent(in), optional :: links(:)
    real(dp), intent(in), optional :: radii(:)
    complex(dp) :: turn(size(at, 2)), origin(size(at, 2)), turns(size(at, 2), size(linkage%links)), &
      & origins(size(at, 2), size(linkage%links))
    integer :: own(size(linkage%links)), k, b, n, asked

    allocate(bodies(size(linkage%links)))
    n = 0
    own = 0
    do k = 1, size(linkage%links)
      associate (link => linkage%links(k))
        if (link%to == 0) cycle
        origin = cmplx(at(link%from, :)%x%v, at(link%from, :)%y%v, dp)
        turn = cmplx(at(link%to, :)%x%v, at(link%to, :)%y%v, dp) - origin
        bodies(n + 1)%length = sum(abs(turn)) / size(turn)
        turn = turn / abs(turn)
        if (maxval(abs(turn - turn(1))) <= same) cycle
        do b = 1, n
          if (by_place .and. (linkage%links(bodies(b)%link)%plane /= link%plane .or. abs(linkage%links(bodies(b)%link)%z &
            & - link%z) > same * bodies(b)%length)) cycle
          if (turns_with(turn, turns(:, b), 1.0_dp) .and. turns_with(origin - origins(:, b), turns(:, b), bodies(b)%length)) exit
        end do
        own(k) = b
        if (b <= n) cycle
        n = b
        bodies(n)%link = k
        bodies(n)%radius = bodies(n)%length
        turns(:, n) = turn
        origins(:, n) = origin
        call find_pivot(origin, turn, bodies(n))
      end associate
    end do
    if (present(radii)) then
      if (size(radii) == 1) bodies%radius = radii(1)
    end if
    if (present(links)) then
      do asked = 1, size(links)
        if (own(links(asked)) == 0 .or. .not. present(radii)) cycle
        if (size(radii) == size(links)) bodies(own(links(asked)))%radius = radii(asked)
      end do
      bodies = pack(bodies(:n), [(any(own(links) == b), b = 1, n)])
    else
      bodies = bodies(:n)
    end if
  end subroutine find_bodies

  !> Whether vectors keep their place in axes that turn with `turn`, beside a size. (Most bodies part at the second angle.)
  pure logical function turns_with(vectors, turn, length)
    complex(dp), intent(in) :: vectors(:), turn(:)
    real(dp), intent(in) :: length
    complex(dp) :: first
    integer :: k

    turns_with = .false.
    first = vectors(1) * conjg(turn(1))
    do k = 2, size(vectors)
      if (.not. abs(vectors(k) * conjg(turn(k)) - first) <= same * length) return
    end do
    turns_with = .true.
  end function turns_with

  !> A point c of the body rests where origin + c turn does: the least squares of its motion tell c.
  pure subroutine find_pivot(origin, turn, body)
    complex(dp), intent(in) :: origin(:), turn(:)
    type(turning_body_type), intent(inout) :: body
    complex(dp), dimension(size(turn)) :: swing, way
    integer :: n

    n = size(turn)
    swing = turn - sum(turn) / n
    way = origin - sum(origin) / n
    body%pivot = -sum(conjg(swing) * way) / sum(abs(swing)**2)
    body%pivoted = maxval(abs(way + body%pivot * swing)) <= same * (body%length + maxval(abs(way)))
    if (.not. body%pivoted .or. abs(body%pivot) <= same * body%length) body%pivot = 0
  end subroutine find_pivot

  !> A point mass (kg) at a place in the axes of a link (m), in its plane.
  pure type(link_type) function point_on(link, mass, center) result(point)
    type(link_type), intent(in) :: link
    real(dp), intent(in) :: mass, center(2)

    point = link
    point%mass = mass
    point%center = center
    point%inertia = 0
    point%along = 0
    point%across = 0
  end function point_on

  !> The linkage with counterweights as links of these names. Errors: as of `add_link`.
  subroutine with_counterweights(linkage, bodies, weights, names, balanced, error)
    class(linkage_type), intent(in) :: linkage
    type(turning_body_type), intent(in) :: bodies(:)
    type(counterweight_type), intent(in) :: weights(:)
    character(len=*), intent(in) :: names(:)
    class(linkage_type), allocatable, intent(out) :: balanced
    type(error_type), allocatable, intent(out) :: error
    integer :: k

    allocate(balanced, source=linkage)
    do k = 1, size(weights)
      associate (body => bodies(weights(k)%body))
        associate (link => linkage%links(body%link))
          call balanced%link(trim(names(k)), linkage%joints(link%from)%name, linkage%joints(link%to)%name, weights(k)%mass(body), &
            & 0.0_dp, weights(k)%center(body), error)
          if (allocated(error)) return
          balanced%links(size(balanced%links))%z = link%z
          balanced%links(size(balanced%links))%own_z = link%own_z
          balanced%links(size(balanced%links))%plane = link%plane
        end associate
      end associate
    end do
  end subroutine with_counterweights

end module gestell_study_balance_bodies
