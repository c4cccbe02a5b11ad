!> Finds the rotating bodies of a linkage and places counterweights on them.
!>
!> A counterweight is a point mass m on a body that rotates by the angle theta(phi), where phi is the crank angle. Its position is
!> P + c exp(i theta). P(phi) is the position of the body's pivot, and the complex number c is the position relative to the pivot
!> in the axes of the body. The pivot is a point of the body that is at rest. If no point of the body is at rest, P is the joint
!> at the origin of its axes (doc/theory.md, "Balancing").
module gestell_study_balance_bodies
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: link_type
  implicit none (type, external)
  private

  public :: find_bodies, point_on, with_counterweights

  !> A rigid body of the linkage that rotates relative to the frame.
  type, public :: turning_body_type
    !> Index of the first link that belongs to the body; the link's axes are the axes of the body
    integer :: link = 0
    !> Mean distance between the two joints of this link (m)
    real(dp) :: length = 0
    !> True if some point of the body is at rest
    logical :: pivoted = .false.
    !> Position of the point at rest in the body's axes (m); 0 if no point is at rest
    complex(dp) :: pivot = 0
    !> Distance of a counterweight from the pivot, or from the origin of the body's axes if there is no pivot (m)
    real(dp) :: radius = 0
    !> Effect of a counterweight of unit unbalance at the angle alpha: f_0 + f_1 cos alpha + f_2 sin alpha. The array holds the
    !> functions f_0, f_1, f_2 of the crank angle, shape (rows, angles, 3). Rows of forces are dimensionless, rows of moments in m
    real(dp), allocatable :: effect(:, :, :)
  end type turning_body_type

  !> A counterweight: a point mass that is fixed to a rotating body.
  type, public :: counterweight_type
    !> Index of the body that carries the counterweight
    integer :: body = 0
    !> Unbalance rho relative to the body's pivot (kg m), and its angle alpha in the body's axes (rad)
    real(dp) :: unbalance = 0, angle = 0
  contains
    procedure :: mass, center
  end type counterweight_type

  complex(dp), parameter :: i = (0.0_dp, 1.0_dp)
  !> Two directions or lengths count as equal if their relative difference is smaller than this. If the direction of a body varies
  !> by less than this, the body does not rotate.
  real(dp), parameter :: same = 1.0e-9_dp

contains

  !> Mass of the counterweight (kg): its unbalance divided by its radius on `body`.
  elemental real(dp) function mass(self, body)
    class(counterweight_type), intent(in) :: self
    type(turning_body_type), intent(in) :: body

    mass = self%unbalance / body%radius
  end function mass

  !> Position of the counterweight in the axes of its body (m).
  pure function center(self, body)
    class(counterweight_type), intent(in) :: self
    type(turning_body_type), intent(in) :: body
    real(dp) :: center(2)
    complex(dp) :: c

    c = body%pivot + body%radius * exp(i * self%angle)
    center = [real(c, dp), aimag(c)]
    ! rounding would leave a tiny component across an axis: set it to zero
    where (abs(center) <= 4 * epsilon(1.0_dp) * body%radius) center = 0
  end function center

  !> Finds the rotating bodies of the linkage and lists each once. Links that rotate by the same angle and do not move relative to
  !> each other form one body.
  subroutine find_bodies(linkage, at, by_place, bodies, links, radii)
    !> The linkage whose rotating bodies are found
    class(linkage_type), intent(in) :: linkage
    !> Positions of the joints, shape (joints, angles)
    type(point_type), intent(in) :: at(:, :)
    !> If true, links form one body only if they also have the same z and the same plane
    logical, intent(in) :: by_place
    type(turning_body_type), allocatable, intent(out) :: bodies(:)
    !> If present, only bodies that contain one of these links are listed
    integer, intent(in), optional :: links(:)
    !> Radii of the counterweights (m): one for all bodies, or one for each of `links`. By default the radius is the length of the
    !> body
    real(dp), intent(in), optional :: radii(:)
    complex(dp) :: turn(size(at, 2)), origin(size(at, 2)), turns(size(at, 2), size(linkage%links)), &
      & origins(size(at, 2), size(linkage%links))
    integer :: own(size(linkage%links)), k, b, n, requested

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
      do requested = 1, size(links)
        if (own(links(requested)) == 0 .or. .not. present(radii)) cycle
        if (size(radii) == size(links)) bodies(own(links(requested)))%radius = radii(requested)
      end do
      bodies = pack(bodies(:n), [(any(own(links) == b), b = 1, n)])
    else
      bodies = bodies(:n)
    end if
  end subroutine find_bodies

  !> True if `vectors` are constant in axes that rotate by `turn`. The tolerance is relative to `length`.
  pure logical function turns_with(vectors, turn, length)
    complex(dp), intent(in) :: vectors(:), turn(:)
    real(dp), intent(in) :: length

    turns_with = all(abs(vectors * conjg(turn) - vectors(1) * conjg(turn(1))) <= same * length)
  end function turns_with

  !> Finds the pivot of a body: the point whose mean square displacement over the turn is smallest. It counts as a pivot only if
  !> it is at rest.
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

  !> Creates a link that is a point mass (kg) at a position in the axes of `link` (m) and lies in the same plane as `link`.
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

  !> Copies the linkage and adds each counterweight to the copy as a link. Fails if a link cannot be added.
  subroutine with_counterweights(linkage, bodies, weights, names, balanced, error)
    !> The linkage to copy
    class(linkage_type), intent(in) :: linkage
    !> The rotating bodies, found by `find_bodies`
    type(turning_body_type), intent(in) :: bodies(:)
    !> Counterweights on the bodies of the linkage
    type(counterweight_type), intent(in) :: weights(:)
    !> Name of the new link for each counterweight
    character(len=*), intent(in) :: names(:)
    class(linkage_type), allocatable, intent(out) :: balanced
    type(error_type), allocatable, intent(out) :: error
    integer :: k

    allocate(balanced, source=linkage)
    do k = 1, size(weights)
      associate (body => bodies(weights(k)%body), link => linkage%links(bodies(weights(k)%body)%link))
        call balanced%link(trim(names(k)), linkage%joints(link%from)%name, linkage%joints(link%to)%name, weights(k)%mass(body), &
          & 0.0_dp, weights(k)%center(body), error)
        if (allocated(error)) return
        balanced%links(size(balanced%links))%z = link%z
        balanced%links(size(balanced%links))%own_z = link%own_z
        balanced%links(size(balanced%links))%plane = link%plane
      end associate
    end do
  end subroutine with_counterweights

end module gestell_study_balance_bodies
