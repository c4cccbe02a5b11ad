!> Computes the shaking forces and moments of a linkage on rigid ground, and how counterweights on its bodies change them.
!>
!> A counterweight on a body has the mass m, the radius r from the body's pivot and the angle alpha in the body's axes. Its
!> unbalance is the complex number u = rho exp(i alpha) with rho = m r. The radius is given, so the mass is rho / r. The
!> counterweight changes the shaking force and the shaking moment, as functions of the crank angle phi, by
!>
!>     rho [f_0(phi) + f_1(phi) cos alpha + f_2(phi) sin alpha].
!>
!> The reason: for a given mass all terms are affine in the position of the counterweight, except its moment of inertia m r^2,
!> which does not depend on alpha. Therefore the effects of unit unbalances at alpha = 0, pi/2 and pi determine f_0, f_1 and f_2.
!> Let theta be the angle of the body and P the position of its pivot. In complex form the counterweight adds u (exp(i theta))'' +
!> m P'' to the force. If the pivot is at rest, P'' = 0 (doc/theory.md, equations 55 and 56).
!>
!> If the speed of the crank is constant relative to the ground, the torque of the drive does not act on the frame. The moment
!> then contains the additional term -K'/2, where K is twice the kinetic energy at unit speed (gestell_model_mechanism).
!>
!> On a frame in space, force and moment have three components each (gestell_model_space). Gravity is omitted. What keeps the
!> speed constant (motor, outside drive or flywheel) decides which part of the moment acts on the frame. A counterweight has the
!> same z as its link. A body has one counterweight in every plane in which it has links.
module gestell_study_balance
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_math_series_fourier, only: fourier_series, fourier_type, largest_value
  use gestell_model_frame_shaking, only: turning_vectors
  use gestell_model_joints_joint, only: point_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: link_type, sum_drive, sum_masses
  use gestell_model_mechanism, only: drive_columns, energy_d, mass_functions_type, table_columns
  use gestell_model_mechanism_held, only: part_of_turn, tabulate_effective
  use gestell_model_space, only: space_type
  use gestell_model_space_masses, only: plane_type
  use gestell_math_rotation, only: cross
  use gestell_study_balance_bodies, only: counterweight_type, find_bodies, point_on, turning_body_type
  implicit none (type, external)
  private

  public :: examine, measure_residual, residual_rows

  !> Kind of each row of the shaking force and moment: 1 force, 2 moment. In the plane the rows are the force along x, the force
  !> along y and the moment. In space there are three rows of forces and three rows of moments.
  integer, parameter :: in_plane(3) = [1, 1, 2], in_space(6) = [1, 1, 1, 2, 2, 2]

  !> Shaking forces and moments of a linkage on rigid ground, and the effects of counterweights on its bodies.
  type, public :: rigid_ground_type
    !> Shaking force (kg m) and moment (kg m^2) of the linkage without counterweights, divided by minus the square of the crank
    !> speed; shape (rows, angles). The crank angles are equidistant and start at 0
    real(dp), allocatable :: found(:, :)
    !> Bodies that can carry counterweights, each with the effect of its counterweight
    type(turning_body_type), allocatable :: bodies(:)
    !> Bounds on the rounding errors of the rms force (kg m) and of the rms moment (kg m^2)
    real(dp) :: rounding(2) = 0
  contains
    procedure :: kinds
  end type rigid_ground_type

  !> Shaking forces and moments that remain after counterweights are added, on rigid ground at a given speed.
  type, public :: residual_shaking_type
    !> Fourier series of each row as a function of the crank angle (N or N m), shape (rows)
    type(fourier_type), allocatable :: series(:)
    !> Kind of each row of `series`: 1 force, 2 moment
    integer, allocatable :: kinds(:)
    !> Peak and rms over the turn. Element 1: magnitude of the force (N). Element 2: magnitude of the moment (N m)
    real(dp) :: peak(2) = 0, rms(2) = 0
  contains
    procedure :: order_rms, amplitudes, turning
  end type residual_shaking_type

contains

  !> Kind of each row of the shaking force and moment: 1 force, 2 moment.
  pure function kinds(self)
    class(rigid_ground_type), intent(in) :: self
    integer, allocatable :: kinds(:)

    kinds = in_plane
    if (size(self%found, 1) == size(in_space)) kinds = in_space
  end function kinds

  !> Computes the shaking forces and moments of a linkage on rigid ground and the effects of counterweights on its bodies. The
  !> number of crank angles is doubled, up to 8192, until the samples resolve the shaking and the effects. Fails if
  !> `linkage%check` fails.
  subroutine examine(linkage, uniform_in_space, about, rigid, error, links, radii, space)
    !> The linkage, after its `prepare`
    class(linkage_type), intent(in) :: linkage
    !> True if the speed of the crank is constant relative to the ground; false if it is constant relative to the frame
    logical, intent(in) :: uniform_in_space
    !> Reference point of the moment (m). In the plane: two coordinates relative to the mechanism's origin. In space: three
    !> coordinates relative to the frame's centre of mass F
    real(dp), intent(in) :: about(:)
    type(rigid_ground_type), intent(out) :: rigid
    type(error_type), allocatable, intent(out) :: error
    !> Indices of links. If present, only bodies that contain one of these links can carry counterweights
    integer, intent(in), optional :: links(:)
    !> Radii of the counterweights (m): one for all bodies, or one for each of `links`. By default the radius is the length of the
    !> body's first link
    real(dp), intent(in), optional :: radii(:)
    !> Required for a frame in space: its mechanisms and their drive. The speed of the drive must not be zero
    type(space_type), intent(in), optional :: space
    integer, parameter :: most = 8192
    type(point_type), allocatable :: at(:, :)
    real(dp), allocatable :: angles(:), effective(:, :), load(:, :)
    integer :: n, k, b

    call linkage%check(error)
    if (allocated(error)) return
    if (present(space)) then
      rigid%rounding = relative_rounding(linkage) * space%terms()
    else
      rigid%rounding = relative_rounding(linkage) * [norm2(linkage%terms(:2)), linkage%terms(3) + norm2(linkage%terms(:2)) &
        & * norm2(about)]
    end if
    n = max(128, ceiling(min(real(most, dp), 8 * pi / linkage%angle_scale)))
    do
      angles = [(2 * pi * k / n, k = 0, n - 1)]
      if (allocated(at)) deallocate(at, effective, load)
      allocate(at(size(linkage%joints), n), effective(n, table_columns), load(n, size(in_plane)))
      do k = 1, n
        call linkage%points(angles(k), at(:, k))
      end do
      if (present(space)) then
        rigid%found = shaking_of_planes(space, space%planes, about, angles)
      else
        call tabulate_effective(linkage, [0.0_dp, 0.0_dp], uniform_in_space, angles, effective, load)
        rigid%found = transpose(load)
        call move_moment(about, rigid%found)
      end if
      call find_bodies(linkage, at, present(space), rigid%bodies, links, radii)
      do b = 1, size(rigid%bodies)
        call find_effect(rigid%bodies(b))
      end do
      if (resolved(rigid) .or. 2 * n > most) exit
      n = 2 * n
    end do

  contains

    !> Computes the effect of a counterweight of unit unbalance on a body: f_0 + f_1 cos alpha + f_2 sin alpha, where alpha is the
    !> angle of the counterweight. The effects at alpha = 0, pi/2 and pi determine the functions f_0, f_1 and f_2 of the crank
    !> angle.
    subroutine find_effect(body)
      type(turning_body_type), intent(inout) :: body
      real(dp) :: of(size(rigid%found, 1), n, 3)
      type(counterweight_type) :: unit
      type(link_type) :: weight(1)
      integer :: j

      unit%unbalance = 1
      do j = 1, 3
        unit%angle = (j - 1) * pi / 2
        weight(1) = point_on(linkage%links(body%link), unit%mass(body), unit%center(body))
        if (present(space)) then
          of(:, :, j) = shaking_of_link(space, weight(1), about, angles)
        else
          of(:, :, j) = shaking_in_plane(weight, at, part_of_turn(linkage, uniform_in_space), about)
        end if
      end do
      allocate(body%effect, mold=of)
      body%effect(:, :, 1) = (of(:, :, 1) + of(:, :, 3)) / 2
      body%effect(:, :, 2) = (of(:, :, 1) - of(:, :, 3)) / 2
      body%effect(:, :, 3) = of(:, :, 2) - body%effect(:, :, 1)
      ! a pivot has no acceleration: its computed acceleration is rounding error
      if (body%pivoted) body%effect(pack([(j, j = 1, size(of, 1))], rigid%kinds() == 1), :, 1) = 0
    end subroutine find_effect

  end subroutine examine

  !> Relative rounding error of sums over the links, in which large terms may cancel. It grows near dead points.
  pure real(dp) function relative_rounding(linkage)
    class(linkage_type), intent(in) :: linkage
    real(dp), parameter :: least = 1.0e-12_dp, part = 100

    relative_rounding = max(least, part * epsilon(1.0_dp) / linkage%angle_scale**2)
  end function relative_rounding

  !> True if the crank angles resolve the shaking and the effects of counterweights. For the forces and for the moments, the upper
  !> third of the harmonics must be below the rounding error or below 1e-9 of the largest harmonic.
  pure logical function resolved(rigid)
    type(rigid_ground_type), intent(in) :: rigid
    real(dp), parameter :: small = 1.0e-9_dp, least = 1.0e-12_dp
    integer :: kinds(size(rigid%found, 1)), b, j

    kinds = rigid%kinds()
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
      real(dp) :: tail(size(rows, 1)), maximum(size(rows, 1))
      integer :: k

      do k = 1, size(rows, 1)
        series = fourier_series(rows(k, :))
        maximum(k) = series%largest_term()
        tail(k) = series%tail() * maximum(k)
      end do
      small_tail = all([(maxval(tail, mask=kinds == k) <= max(rounding(k), small * maxval(maximum, mask=kinds == k)), k = 1, 2)])
    end function small_tail

  end function resolved

  !> Moves the reference point of the moment from the origin to `about` by subtracting the cross product of `about` and the force.
  pure subroutine move_moment(about, rows)
    real(dp), intent(in) :: about(2)
    real(dp), intent(inout) :: rows(:, :)

    rows(3, :) = rows(3, :) - about(1) * rows(2, :) + about(2) * rows(1, :)
  end subroutine move_moment

  !> Shaking force (kg m) and moment (kg m^2) of links in the plane, divided by minus the square of the crank speed, shape (3,
  !> angles). The crank lags by `part` times the rotation psi of the frame.
  function shaking_in_plane(links, at, part, about) result(rows)
    type(link_type), intent(in) :: links(:)
    type(point_type), intent(in) :: at(:, :)
    real(dp), intent(in) :: part, about(2)
    real(dp) :: rows(size(in_plane), size(at, 2)), drive(drive_columns)
    type(mass_functions_type) :: a
    integer :: k

    do k = 1, size(at, 2)
      call sum_masses(links, at(:, k), a)
      rows(:, k) = [a%a1%dd, a%a2%dd, a%a4]
      if (.not. part > 0) cycle
      call sum_drive(links, at(:, k), drive)
      rows(3, k) = rows(3, k) - part * drive(energy_d) / 2
    end do
    call move_moment(about, rows)
  end function shaking_in_plane

  !> Shaking forces (kg m) and moments (kg m^2) of the mechanisms in `planes`, divided by minus the square of the drive speed,
  !> shape (6, angles). The frame of `space` is at rest. `angles`: drive angles (rad). `about`: reference point of the moments,
  !> relative to the frame's centre of mass F (m).
  function shaking_of_planes(space, planes, about, angles) result(rows)
    type(space_type), intent(in) :: space
    type(plane_type), intent(in) :: planes(:)
    real(dp), intent(in) :: about(3)
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp) :: rows(6, size(angles))
    real(dp), allocatable :: loads(:, :)
    type(space_type) :: bare
    integer :: k

    bare%planes = planes
    bare%drive = space%drive
    allocate(loads(size(angles), 6))
    call bare%shake(1.0_dp, angles, loads)
    rows = -transpose(loads)
    do k = 1, size(angles)
      rows(4:, k) = rows(4:, k) - cross(about, rows(:3, k))
    end do
  end function shaking_of_planes

  !> Shaking forces (kg m) and moments (kg m^2) of a single link that moves with the mechanism in its plane, divided by minus the
  !> square of the drive speed, shape (6, angles).
  function shaking_of_link(space, link, about, angles) result(rows)
    type(space_type), intent(in) :: space
    type(link_type), intent(in) :: link
    real(dp), intent(in) :: about(3)
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp) :: rows(6, size(angles))
    type(plane_type) :: plane
    integer :: k

    do k = 1, size(space%planes)
      if (space%planes(k)%linkage%links(1)%plane == link%plane) plane = space%planes(k)
    end do
    plane%linkage%links = [link]
    rows = shaking_of_planes(space, [plane], about, angles)
  end function shaking_of_link

  !> Shaking forces (kg m) and moments (kg m^2) that remain after the counterweights are added, divided by minus the square of the
  !> speed, shape (rows, angles).
  pure function residual_rows(rigid, weights) result(rows)
    type(rigid_ground_type), intent(in) :: rigid
    type(counterweight_type), intent(in) :: weights(:)
    real(dp) :: rows(size(rigid%found, 1), size(rigid%found, 2))
    integer :: k

    rows = rigid%found
    do k = 1, size(weights)
      associate (effect => rigid%bodies(weights(k)%body)%effect, alpha => weights(k)%angle)
        rows = rows + weights(k)%unbalance * (effect(:, :, 1) + effect(:, :, 2) * cos(alpha) + effect(:, :, 3) * sin(alpha))
      end associate
    end do
  end function residual_rows

  !> Computes the shaking forces and moments that remain after the counterweights are added, at a given speed (rad/s). Forces and
  !> moments below their rounding errors are set to zero.
  pure subroutine measure_residual(rigid, weights, speed, residual)
    !> Shaking of the linkage on rigid ground, and the effects of counterweights
    type(rigid_ground_type), intent(in) :: rigid
    type(counterweight_type), intent(in) :: weights(:)
    real(dp), intent(in) :: speed
    type(residual_shaking_type), intent(out) :: residual
    real(dp) :: rows(size(rigid%found, 1), size(rigid%found, 2)), largest
    integer, allocatable :: own(:)
    integer :: k, i

    residual%kinds = rigid%kinds()
    rows = -speed**2 * residual_rows(rigid, weights)
    allocate(residual%series(size(rows, 1)))
    do k = 1, 2
      own = pack([(i, i = 1, size(rows, 1))], residual%kinds == k)
      if (norm2(rows(own, :)) / sqrt(real(size(rows, 2), dp)) <= speed**2 * rigid%rounding(k)) rows(own, :) = 0
      do i = 1, size(own)
        residual%series(own(i)) = fourier_series(rows(own(i), :))
      end do
      residual%rms(k) = length_of([(residual%series(own(i))%rms(), i = 1, size(own))])
      if (size(own) == 1) then
        residual%peak(k) = residual%series(own(1))%peak(rows(own(1), :))
        cycle
      end if
      largest = maxval(abs(rows(own, :)))
      if (largest > 0) residual%peak(k) = largest * sqrt(largest_value(sum((rows(own, :) / largest)**2, dim=1)))
    end do
  end subroutine measure_residual

  !> Rms of one order of the force (if `what` is 1, N) or of the moment (if `what` is 2, N m).
  pure real(dp) function order_rms(self, order, what)
    class(residual_shaking_type), intent(in) :: self
    integer, intent(in) :: order, what

    integer :: k

    order_rms = 0
    if (order > size(self%series(1)%amplitude)) return
    order_rms = length_of(pack([(self%series(k)%amplitude(order), k = 1, size(self%series))], self%kinds == what)) / sqrt(2.0_dp)
  end function order_rms

  !> Amplitudes of the orders 1, 2, ... of every row (N or N m), shape (orders, rows).
  pure function amplitudes(self, orders)
    class(residual_shaking_type), intent(in) :: self
    integer, intent(in) :: orders
    real(dp) :: amplitudes(orders, size(self%series))
    integer :: k, n

    amplitudes = 0
    n = min(orders, size(self%series(1)%amplitude))
    do k = 1, size(self%series)
      amplitudes(:n, k) = self%series(k)%amplitude(:n)
    end do
  end function amplitudes

  !> For a frame in space: splits force and moment, in the plane normal to `axes(:, 3)`, into vectors that rotate with the crank
  !> and vectors that rotate against it. Returns their magnitudes for the orders 1, 2, ..., shape (orders, 4). Columns: force with
  !> the crank and force against it (N), moment with the crank and moment against it (N m).
  pure function turning(self, axes, orders) result(sizes)
    class(residual_shaking_type), intent(in) :: self
    real(dp), intent(in) :: axes(3, 3)
    integer, intent(in) :: orders
    real(dp) :: sizes(orders, 4)
    integer :: n

    sizes = 0
    n = min(orders, size(self%series(1)%amplitude))
    sizes(:n, :2) = turning_vectors(self%series(:3), n, axes(:, 1), axes(:, 2))
    sizes(:n, 3:) = turning_vectors(self%series(4:), n, axes(:, 1), axes(:, 2))
  end function turning

  !> Euclidean length of a vector.
  pure real(dp) function length_of(parts)
    real(dp), intent(in) :: parts(:)

    length_of = norm2(parts)
    if (size(parts) == 2) length_of = hypot(parts(1), parts(2))
  end function length_of

end module gestell_study_balance
