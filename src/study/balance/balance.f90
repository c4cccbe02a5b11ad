!> What counterweights on the links of a linkage do to the forces that it exerts on rigid ground.
!>
!> A counterweight is a point mass m at the place c, complex, in the axes of a body that turns with exp(i theta(phi)): it lies at
!> P + c exp(i theta), P(phi) the body's pivot, or of a body without one the joint at the origin of its axes. At a given radius
!> r = |c| it is told by its unbalance u = m c = rho exp(i alpha), m = rho / r, and adds to S'', the sum of m r'' over the masses,
!> and to the moment A' - K'/2 (gestell_model_mechanism_shaking; K where the torque of the drive stays outside)
!>
!>     rho [f_0(phi) + f_1(phi) cos alpha + f_2(phi) sin alpha]
!>
!> for at given m all of these are affine in c but for m |c|^2, which is rho r whatever alpha. f_0, f_1, f_2 follow from the masses
!> 1 / r at alpha = 0, pi/2 and pi. What it adds to S'' is, complex, u (exp(i theta))'' + m P''; a pivot rests, P'' = 0.
module gestell_study_balance
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_fourier, only: fourier_series, fourier_type, greatest
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: link_type, sum_drive, sum_masses
  use gestell_model_mechanism, only: drive_columns, energy_d, mass_functions_type, table_columns
  use gestell_model_mechanism_held, only: tabulate_felt
  implicit none (type, external)
  private

  public :: examine, measure_left, what_is_left, with_counterweights

  !> Rows of what shakes: the force along x and y, the moment.
  integer, parameter, public :: shaking_rows = 3

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
    !> f_0, f_1, f_2 over Omega^2, shape (shaking_rows, angles, 3): 1 and 1, the moments m.
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

  type, public :: rigid_ground_type
    !> What shakes over -Omega^2 at equidistant crank angles from 0 on, shape (shaking_rows, angles): kg m, kg m, kg m^2.
    real(dp), allocatable :: found(:, :)
    type(turning_body_type), allocatable :: bodies(:)
    !> What is rounding, of force (kg m) and moment (kg m^2), in the root of the mean square.
    real(dp) :: rounding(2) = 0
  end type rigid_ground_type

  !> What is left on rigid ground at a speed: over the crank angle fx, fy (N), the moment (N m); peak and rms of the whole force and
  !> of the moment.
  type, public :: left_type
    type(fourier_type) :: series(shaking_rows)
    real(dp) :: peak(2) = 0, rms(2) = 0
  contains
    procedure :: order_rms
  end type left_type

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

  !> The shaking of a prepared linkage whose crank turns `even_in_space` or against the frame, with the moment about `about`, as
  !> seen from the mechanism's origin (m), and what counterweights on its bodies do, at as many angles as resolve both. The radii
  !> are the lengths of the links, or `radii` (m), shape (1), or (size(links)) by `links`, indices of links; with `links` only
  !> bodies that carry one of these are told. Error: as of `check`.
  subroutine examine(linkage, even_in_space, about, rigid, error, links, radii)
    class(linkage_type), intent(in) :: linkage
    logical, intent(in) :: even_in_space
    real(dp), intent(in) :: about(2)
    type(rigid_ground_type), intent(out) :: rigid
    type(error_type), allocatable, intent(out) :: error
    integer, intent(in), optional :: links(:)
    real(dp), intent(in), optional :: radii(:)
    integer, parameter :: most = 8192
    type(point_type), allocatable :: at(:, :)
    real(dp), allocatable :: angles(:), felt(:, :), load(:, :)
    integer :: n, k, b

    call linkage%check(error)
    if (allocated(error)) return
    call find_rounding(linkage, about, rigid%rounding)
    n = max(128, ceiling(min(real(most, dp), 8 * pi / linkage%angle_scale)))
    do
      angles = [(2 * pi * k / n, k = 0, n - 1)]
      if (allocated(at)) deallocate(at, felt, load)
      allocate(at(size(linkage%joints), n), felt(n, table_columns), load(n, shaking_rows))
      do k = 1, n
        call linkage%points(angles(k), at(:, k))
      end do
      call tabulate_felt(linkage, [0.0_dp, 0.0_dp], even_in_space, angles, felt, load)
      rigid%found = transpose(load)
      call move_moment(about, rigid%found)
      call find_bodies(linkage, at, rigid%bodies, links, radii)
      do b = 1, size(rigid%bodies)
        call find_effect(linkage%links(rigid%bodies(b)%link), at, even_in_space, about, rigid%bodies(b))
      end do
      if (resolved(rigid) .or. 2 * n > most) exit
      n = 2 * n
    end do
  end subroutine examine

  !> What the links' terms leave of force and moment where they cancel; near dead points more than a rounding of them.
  pure subroutine find_rounding(linkage, about, rounding)
    class(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: about(2)
    real(dp), intent(out) :: rounding(2)
    real(dp), parameter :: least = 1.0e-12_dp, part = 100

    rounding = max(least, part * epsilon(1.0_dp) / linkage%angle_scale**2) * [norm2(linkage%terms(:2)), linkage%terms(3) &
      & + norm2(linkage%terms(:2)) * norm2(about)]
  end subroutine find_rounding

  !> Whether the upper third of the orders is small, for each kind beside the greatest of its kind, or rounding.
  pure logical function resolved(rigid)
    type(rigid_ground_type), intent(in) :: rigid
    real(dp), parameter :: small = 1.0e-9_dp, least = 1.0e-12_dp
    integer :: b, j

    resolved = small_tail(rigid%found, rigid%rounding)
    do b = 1, size(rigid%bodies)
      do j = 1, 3
        resolved = resolved .and. small_tail(rigid%bodies(b)%effect(:, :, j), least * [1.0_dp, rigid%bodies(b)%radius])
      end do
    end do

  contains

    pure logical function small_tail(rows, rounding)
      real(dp), intent(in) :: rows(:, :), rounding(2)
      type(fourier_type) :: series
      real(dp) :: tail(shaking_rows), greatest(shaking_rows)
      integer :: k

      do k = 1, shaking_rows
        series = fourier_series(rows(k, :))
        greatest(k) = series%greatest_term()
        tail(k) = series%tail() * greatest(k)
      end do
      small_tail = maxval(tail(:2)) <= max(rounding(1), small * maxval(greatest(:2))) .and. tail(3) <= max(rounding(2), &
        & small * greatest(3))
    end function small_tail

  end function resolved

  !> The moment about another point, from that about the origin: less the point x S''.
  pure subroutine move_moment(about, rows)
    real(dp), intent(in) :: about(2)
    real(dp), intent(inout) :: rows(:, :)

    rows(3, :) = rows(3, :) - about(1) * rows(2, :) + about(2) * rows(1, :)
  end subroutine move_moment

  !> Bodies that turn, each once, with all joints at `at`, shape (joints, angles). Links whose axes turn alike and whose origins
  !> keep their distance are one.
  subroutine find_bodies(linkage, at, bodies, links, radii)
    class(linkage_type), intent(in) :: linkage
    type(point_type), intent(in) :: at(:, :)
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
          if (constant(turn * conjg(turns(:, b)), 1.0_dp) .and. constant((origin - origins(:, b)) * conjg(turns(:, b)), &
            & bodies(b)%length)) exit
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

  !> Whether values stay where they are, beside a size.
  pure logical function constant(values, size)
    complex(dp), intent(in) :: values(:)
    real(dp), intent(in) :: size

    constant = maxval(abs(values - values(1))) <= same * size
  end function constant

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

  !> The effect of a counterweight on a body with the axes of `link`.
  subroutine find_effect(link, at, even_in_space, about, body)
    type(link_type), intent(in) :: link
    type(point_type), intent(in) :: at(:, :)
    logical, intent(in) :: even_in_space
    real(dp), intent(in) :: about(2)
    type(turning_body_type), intent(inout) :: body
    real(dp) :: of(shaking_rows, size(at, 2), 3), drive(drive_columns)
    type(link_type) :: weight(1)
    type(counterweight_type) :: unit
    type(mass_functions_type) :: a
    integer :: j, k

    weight(1)%from = link%from
    weight(1)%to = link%to
    unit%unbalance = 1
    weight(1)%mass = unit%mass(body)
    do j = 1, 3
      unit%angle = (j - 1) * pi / 2
      weight(1)%center = unit%center(body)
      do k = 1, size(at, 2)
        call sum_masses(weight, at(:, k), a)
        of(:, k, j) = [a%a1%dd, a%a2%dd, a%a4]
        if (.not. even_in_space) cycle
        call sum_drive(weight, at(:, k), drive)
        of(3, k, j) = of(3, k, j) - drive(energy_d) / 2
      end do
      call move_moment(about, of(:, :, j))
    end do
    allocate(body%effect, mold=of)
    body%effect(:, :, 1) = (of(:, :, 1) + of(:, :, 3)) / 2
    body%effect(:, :, 2) = (of(:, :, 1) - of(:, :, 3)) / 2
    body%effect(:, :, 3) = of(:, :, 2) - body%effect(:, :, 1)
    ! a pivot rests: what is left of its acceleration is rounding
    if (body%pivoted) body%effect(:2, :, 1) = 0
  end subroutine find_effect

  !> What shakes over -Omega^2 with counterweights, shape (shaking_rows, angles).
  pure function what_is_left(rigid, weights) result(rows)
    type(rigid_ground_type), intent(in) :: rigid
    type(counterweight_type), intent(in) :: weights(:)
    real(dp) :: rows(shaking_rows, size(rigid%found, 2))
    integer :: k

    rows = rigid%found
    do k = 1, size(weights)
      associate (effect => rigid%bodies(weights(k)%body)%effect, alpha => weights(k)%angle)
        rows = rows + weights(k)%unbalance * (effect(:, :, 1) + effect(:, :, 2) * cos(alpha) + effect(:, :, 3) * sin(alpha))
      end associate
    end do
  end function what_is_left

  !> The same at a speed (rad/s). What is rounding is zero.
  pure subroutine measure_left(rigid, weights, speed, left)
    type(rigid_ground_type), intent(in) :: rigid
    type(counterweight_type), intent(in) :: weights(:)
    real(dp), intent(in) :: speed
    type(left_type), intent(out) :: left
    real(dp) :: rows(shaking_rows, size(rigid%found, 2)), largest
    integer :: k

    rows = -speed**2 * what_is_left(rigid, weights)
    if (rms_of(rows(:2, :)) <= speed**2 * rigid%rounding(1)) rows(:2, :) = 0
    if (rms_of(rows(3:, :)) <= speed**2 * rigid%rounding(2)) rows(3, :) = 0
    do k = 1, shaking_rows
      left%series(k) = fourier_series(rows(k, :))
    end do
    left%rms = [hypot(left%series(1)%rms(), left%series(2)%rms()), left%series(3)%rms()]
    largest = maxval(abs(rows(:2, :)))
    if (largest > 0) left%peak(1) = largest * sqrt(greatest(sum((rows(:2, :) / largest)**2, dim=1)))
    left%peak(2) = left%series(3)%peak(rows(3, :))
  end subroutine measure_left

  !> Root of the mean square over the columns.
  pure real(dp) function rms_of(rows)
    real(dp), intent(in) :: rows(:, :)

    rms_of = norm2(rows) / sqrt(real(size(rows, 2), dp))
  end function rms_of

  !> The rms of an order of the force (`what` = 1, N) or of the moment (2, N m).
  pure real(dp) function order_rms(self, order, what)
    class(left_type), intent(in) :: self
    integer, intent(in) :: order, what

    order_rms = 0
    if (order > size(self%series(1)%amplitude)) return
    if (what == 2) order_rms = self%series(3)%amplitude(order) / sqrt(2.0_dp)
    if (what == 1) order_rms = hypot(self%series(1)%amplitude(order), self%series(2)%amplitude(order)) / sqrt(2.0_dp)
  end function order_rms

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
        end associate
      end associate
      if (allocated(error)) return
    end do
  end subroutine with_counterweights

end module gestell_study_balance
