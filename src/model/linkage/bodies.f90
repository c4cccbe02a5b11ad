!> The links of a linkage as rigid bodies, and the sums (4) to (7) of doc/theory.md over their masses.
module gestell_model_linkage_bodies
  use gestell_base_processor, only: has_versions, vector_length
  use gestell_math_jet, only: jet, operator(*), operator(+), operator(-)
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_path, only: batch, carried, direction, find_direction, set_fixed, path_type
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_dd, a3_v, a4_v, drive_columns, &
    & a1_ddd, a2_ddd, energy_d, energy_dd, energy_v, mass_functions_type, spin_dd, spin_v, table_columns
  use, intrinsic :: iso_c_binding, only: c_int, dp => c_double
  implicit none (type, external)
  private

  public :: body_motion, move_link, sum_drive, sum_masses, tabulate_masses

  !> A sum smaller than this fraction of the sum of the absolute values of its terms is set to zero, so that a balanced mechanism
  !> causes no shaking forces at all.
  real(dp), parameter :: noise = 8 * epsilon(1.0_dp)

  !> A link as a rigid body. Its xi-axis points from joint `from` to joint `to`. If `to` is 0, the link only translates, and its
  !> axes are parallel to x and y.
  type, public :: link_type
    character(len=:), allocatable :: name
    integer :: from = 0, to = 0
    !> `mass`: mass (kg). `inertia`: moment of inertia about the centre of mass (kg m^2). `center`: position of the centre of mass
    !> in the link's axes (m).
    real(dp) :: mass = 0, inertia = 0, center(2) = 0
    !> For a frame in space only. `z`: position of the centre of mass along the plane's normal (m). `own_z`: the part of `z` that is
    !> measured within the link's mechanism. `along`, `across`: moments of inertia about the link's xi-axis, and about the
    !> perpendicular axis in the plane (kg m^2). `axis`: direction of the xi-axis of a link that only translates.
    real(dp) :: z = 0, own_z = 0, along = 0, across = 0, axis(2) = [1.0_dp, 0.0_dp]
    !> Number of the link's plane; 0 is the plane of the frame. For a frame in space only.
    integer :: plane = 0
  end type link_type

  abstract interface
    pure subroutine body_version(mass, inertia, center, from, u, sums, magnitudes, once) bind(C)
      import :: batch, c_int, dp, path_type, table_columns
      implicit none (type, external)
      real(dp), value :: mass, inertia
      real(dp), intent(in) :: center(2)
      type(path_type), intent(in) :: from, u
      real(dp), intent(inout) :: sums(batch, table_columns), magnitudes(batch, table_columns)
      integer(c_int), value :: once
    end subroutine body_version
  end interface

  procedure(body_version), bind(C, name="_ZGVeN2uuuuuuul_lanes_gestell_body") :: body_512
  procedure(body_version), bind(C, name="_ZGVdN2uuuuuuul_lanes_gestell_body") :: body_256

contains

  !> Moves the link `from` to the variable `to` without allocating memory. `from` loses its name.
  pure subroutine move_link(from, to)
    type(link_type), intent(inout) :: from
    type(link_type), intent(out) :: to
    character(len=:), allocatable :: name

    call move_alloc(from%name, name)
    to = from
    call move_alloc(name, to%name)
  end subroutine move_link

  !> Computes the sums (4) to (7) of doc/theory.md over the links for one crank angle, at which the joints are at the points `at`.
  !> `terms`: sums of the absolute values of the terms of a1'', a2'' (kg m), a4 and K' (kg m^2).
  pure subroutine sum_masses(links, at, a, terms)
    type(link_type), intent(in) :: links(:)
    !> Points of all joints at one crank angle
    type(point_type), intent(in) :: at(:)
    type(mass_functions_type), intent(out) :: a
    real(dp), intent(out), optional :: terms(4)
    type(point_type) :: center
    type(jet) :: size1, size2
    real(dp) :: rate, turn, turn_terms, a4_size, energy_size
    integer :: i

    a4_size = 0
    energy_size = 0
    do i = 1, size(links)
      associate (link => links(i))
        call body_motion(link, at, center, rate, turn, turn_terms=turn_terms)
        a%a1 = a%a1 + link%mass * center%x
        a%a2 = a%a2 + link%mass * center%y
        a%a3 = a%a3 + link%mass * (center%x * center%x + center%y * center%y)
        a%a4 = a%a4 + link%mass * (center%x%v * center%y%dd - center%y%v * center%x%dd) + link%inertia * turn
        size1 = size1 + magnitude(link%mass, center%x)
        size2 = size2 + magnitude(link%mass, center%y)
        a4_size = a4_size + link%inertia * turn_terms + link%mass * (abs(center%x%v * center%y%dd) + abs(center%y%v * center%x%dd))
        energy_size = energy_size + 2 * (link%inertia * abs(rate) * turn_terms &
          & + link%mass * (abs(center%x%d * center%x%dd) + abs(center%y%d * center%y%dd)))
      end associate
    end do
    a%a1 = cleaned(a%a1, size1)
    a%a2 = cleaned(a%a2, size2)
    if (abs(a%a4) <= noise * a4_size) a%a4 = 0
    if (present(terms)) terms = [size1%dd, size2%dd, a4_size, energy_size]
  end subroutine sum_masses

  !> Computes the functions H and K of the drive and their derivatives, summed over the links, with all joints at the points `at`;
  !> shape (drive_columns). H is the angular momentum and K twice the kinetic energy at unit crank speed.
  pure subroutine sum_drive(links, at, drive)
    type(link_type), intent(in) :: links(:)
    type(point_type), intent(in) :: at(:)
    real(dp), intent(out) :: drive(drive_columns)
    type(point_type) :: center
    real(dp) :: rate, turn, change, magnitude
    integer :: i

    drive = 0
    magnitude = 0
    do i = 1, size(links)
      call body_motion(links(i), at, center, rate, turn, change)
      associate (m => links(i)%mass, j => links(i)%inertia, x => center%x, y => center%y)
        drive(spin_v) = drive(spin_v) + m * (x%v * y%d - y%v * x%d) + j * rate
        drive(spin_dd) = drive(spin_dd) + m * (x%d * y%dd - y%d * x%dd + x%v * y%ddd - y%v * x%ddd) + j * change
        drive(energy_v) = drive(energy_v) + m * (x%d**2 + y%d**2) + j * rate**2
        drive(energy_d) = drive(energy_d) + 2 * (m * (x%d * x%dd + y%d * y%dd) + j * rate * turn)
        drive(energy_dd) = drive(energy_dd) + 2 * (m * (x%dd**2 + y%dd**2 + x%d * x%ddd + y%d * y%ddd) &
          & + j * (turn**2 + rate * change))
        drive(a1_ddd) = drive(a1_ddd) + m * x%ddd
        drive(a2_ddd) = drive(a2_ddd) + m * y%ddd
        magnitude = magnitude + 2 * (m * (abs(x%d * x%dd) + abs(y%d * y%dd)) + j * abs(rate * turn))
      end associate
    end do
    if (abs(drive(energy_d)) <= noise * magnitude) drive(energy_d) = 0
  end subroutine sum_drive

  !> Computes the motion of a link's centre of mass and the derivatives of its angle phi_i with respect to the crank angle: first
  !> (`rate`), second (`turn`) and third (`change`). `turn_terms`: sum of the absolute values of the terms of `turn`.
  pure subroutine body_motion(link, at, center, rate, turn, change, turn_terms)
    type(link_type), intent(in) :: link
    type(point_type), intent(in) :: at(:)
    type(point_type), intent(out) :: center
    real(dp), intent(out) :: rate, turn
    real(dp), intent(out), optional :: change, turn_terms
    type(point_type) :: u

    if (link%to == 0) then
      center%x = at(link%from)%x + link%center(1)
      center%y = at(link%from)%y + link%center(2)
      rate = 0
      turn = 0
      if (present(change)) change = 0
      if (present(turn_terms)) turn_terms = 0
      return
    end if
    u = direction(at(link%from), at(link%to))
    center = carried(at(link%from), u, link%center(1), link%center(2))
    ! u = (cos phi, sin phi): phi' = u x u', phi'' = u x u''.
    rate = u%x%v * u%y%d - u%y%v * u%x%d
    turn = u%x%v * u%y%dd - u%y%v * u%x%dd
    if (present(change)) change = u%x%v * u%y%ddd - u%y%v * u%x%ddd + u%x%d * u%y%dd - u%y%d * u%x%dd
    if (present(turn_terms)) turn_terms = abs(u%x%v * u%y%dd) + abs(u%y%v * u%x%dd)
  end subroutine body_motion

  pure type(jet) function magnitude(factor, term)
    real(dp), intent(in) :: factor
    type(jet), intent(in) :: term

    magnitude = jet(factor * abs(term%v), factor * abs(term%d), factor * abs(term%dd))
  end function magnitude

  pure type(jet) function cleaned(sum, magnitude)
    type(jet), intent(in) :: sum, magnitude

    cleaned = jet(merge(0.0_dp, sum%v, abs(sum%v) <= noise * magnitude%v), &
      & merge(0.0_dp, sum%d, abs(sum%d) <= noise * magnitude%d), &
      & merge(0.0_dp, sum%dd, abs(sum%dd) <= noise * magnitude%dd))
  end function cleaned

  !> Computes the sums (4) to (7) of doc/theory.md over a batch of crank angles and stores them in rows `first` to `last` of the
  !> table.
  pure subroutine tabulate_masses(links, at, first, last, table)
    type(link_type), intent(in) :: links(:)
    !> Paths of all joints over the batch
    type(path_type), intent(in) :: at(:)
    integer, intent(in) :: first, last
    real(dp), contiguous, intent(inout) :: table(:, :)
    type(path_type) :: u
    real(dp), dimension(batch, table_columns) :: sums, magnitudes
    integer :: i, j, k

    sums = 0
    magnitudes = 0
    do i = 1, size(links)
      if (links(i)%to == 0) then
        call set_fixed([1.0_dp, 0.0_dp], u)
      else
        call find_direction(at(links(i)%from), at(links(i)%to), u)
      end if
      call add_body(links(i)%mass, links(i)%inertia, links(i)%center, at(links(i)%from), u, sums, magnitudes)
    end do
    do j = 1, table_columns
      do k = 1, last - first + 1
        table(first - 1 + k, j) = merge(0.0_dp, sums(k, j), abs(sums(k, j)) <= noise * magnitudes(k, j))
      end do
    end do
  end subroutine tabulate_masses

  !> Adds a body whose xi-axis has the direction u to the sums. The absolute values of its terms are added to `magnitudes`. There is
  !> no magnitude for a3, because balancing cannot make a3 zero.
  pure subroutine add_body(mass, inertia, center, from, u, sums, magnitudes)
    real(dp), intent(in) :: mass, inertia, center(2)
    type(path_type), intent(in) :: from, u
    real(dp), intent(inout) :: sums(batch, table_columns), magnitudes(batch, table_columns)

    if (has_versions .and. vector_length() == 8) then
      call body_512(mass, inertia, center, from, u, sums, magnitudes, 1)
    else if (has_versions .and. vector_length() == 4) then
      call body_256(mass, inertia, center, from, u, sums, magnitudes, 1)
    else
      call body_here(mass, inertia, center, from, u, sums, magnitudes, 1)
    end if
  end subroutine add_body

  pure subroutine body_here(mass, inertia, center, from, u, sums, magnitudes, once) bind(C, name="lanes_gestell_body")
    !$omp declare simd uniform(mass, inertia, center, from, u, sums, magnitudes) linear(once) simdlen(2) notinbranch
    real(dp), value :: mass, inertia
    real(dp), intent(in) :: center(2)
    type(path_type), intent(in) :: from, u
    real(dp), intent(inout) :: sums(batch, table_columns), magnitudes(batch, table_columns)
    integer(c_int), value :: once
    real(dp) :: turn(batch), x, y, vx, vy, ax, ay
    integer :: k

    turn = 0
    ! A vector version runs this body twice; the second run has nothing to do (gestell_base_processor).
    if (once > 1) return
    do k = 1, batch
      turn(k) = u%x(k) * u%ay(k) - u%y(k) * u%ax(k)
    end do
    do k = 1, batch
      x = from%x(k) + center(1) * u%x(k) - center(2) * u%y(k)
      y = from%y(k) + center(1) * u%y(k) + center(2) * u%x(k)
      vx = from%vx(k) + center(1) * u%vx(k) - center(2) * u%vy(k)
      vy = from%vy(k) + center(1) * u%vy(k) + center(2) * u%vx(k)
      ax = from%ax(k) + center(1) * u%ax(k) - center(2) * u%ay(k)
      ay = from%ay(k) + center(1) * u%ay(k) + center(2) * u%ax(k)
      sums(k, a1_v) = sums(k, a1_v) + mass * x
      sums(k, a1_d) = sums(k, a1_d) + mass * vx
      sums(k, a1_dd) = sums(k, a1_dd) + mass * ax
      sums(k, a2_v) = sums(k, a2_v) + mass * y
      sums(k, a2_d) = sums(k, a2_d) + mass * vy
      sums(k, a2_dd) = sums(k, a2_dd) + mass * ay
      sums(k, a3_v) = sums(k, a3_v) + mass * (x * x + y * y)
      sums(k, a3_d) = sums(k, a3_d) + 2 * mass * (x * vx + y * vy)
      sums(k, a3_dd) = sums(k, a3_dd) + 2 * mass * (vx * vx + vy * vy + x * ax + y * ay)
      sums(k, a4_v) = sums(k, a4_v) + mass * (x * ay - y * ax) + inertia * turn(k)
      magnitudes(k, a1_v) = magnitudes(k, a1_v) + mass * abs(x)
      magnitudes(k, a1_d) = magnitudes(k, a1_d) + mass * abs(vx)
      magnitudes(k, a1_dd) = magnitudes(k, a1_dd) + mass * abs(ax)
      magnitudes(k, a2_v) = magnitudes(k, a2_v) + mass * abs(y)
      magnitudes(k, a2_d) = magnitudes(k, a2_d) + mass * abs(vy)
      magnitudes(k, a2_dd) = magnitudes(k, a2_dd) + mass * abs(ay)
      magnitudes(k, a4_v) = magnitudes(k, a4_v) + mass * (abs(x * ay) + abs(y * ax)) &
        & + inertia * (abs(u%x(k) * u%ay(k)) + abs(u%y(k) * u%ax(k)))
    end do
  end subroutine body_here

end module gestell_model_linkage_bodies
