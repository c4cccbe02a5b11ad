!> Sums over the moving masses of planar mechanisms for a frame in space, (45) of doc/theory.md. The centre of mass of a link is at
!> r = o + Q (x, y, z) relative to F, along the frame's axes. Q has the axes of the link's mechanism as columns; o is the origin of
!> this mechanism. With the inertia tensors J_i and angular velocities w_i of the links,
!>
!>     S = sum m r,   J = sum [m (|r|^2 1 - r r^T) + J_i],   H = sum [m r x r' + J_i w_i],
!>
!> which are functions of the drive's angle phi, ' = d/dphi. The coordinate z of a link is constant. The principal axes of the
!> link's inertia tensor are along the link, perpendicular to it in the plane, and along the normal. As for a frame in the plane,
!> the joints are computed at batches of angles (gestell_model_linkage).
!>
!> If the drive does not turn uniformly relative to the frame, its torque also requires S''', J'', H'' and K, K', K'' with
!>
!>     K = sum [m |r'|^2 + w_i J_i w_i].
module gestell_model_space_masses
  use gestell_base_kinds, only: dp
  use gestell_math_vectors, only: batch, in_batch, times, transposed
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_path, only: carry, copy_batch, find_direction, path_type, set_fixed
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: link_type
  implicit none (type, external)
  private

  public :: along_fixed_axes, new_masses, sum_planes

  !> A linkage and the orientation and origin of the plane in which it moves.
  type, public :: plane_type
    type(linkage_type) :: linkage
    !> `axes`: matrix Q, whose columns are the plane's axes; the third is the plane's normal. `origin`: origin o of the plane's axes
    !> (m).
    real(dp) :: axes(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3]), origin(3) = 0
  end type plane_type

  !> Sums over the masses at many angles of the drive, with derivatives. `s`: S, S', S'', S''' (kg m), shape (angles, 3, 0:3). `j`:
  !> J, J', J'' (kg m^2), shape (angles, 3, 3, 0:2). `h`: H, H', H'' (kg m^2), shape (angles, 3, 0:2). `k`: K, K', K'' (kg m^2),
  !> shape (angles, 0:2). S''', J'', H'' are missing, and `k` is not allocated, if the drive turns uniformly relative to the frame.
  type, public :: masses_type
    real(dp) :: mass = 0
    real(dp), allocatable :: s(:, :, :), j(:, :, :, :), h(:, :, :), k(:, :)
  end type masses_type

  !> The sums of `masses_type` at a batch of phases, along the fixed axes.
  type, public :: fixed_masses_type
    real(dp) :: mass, s(batch, 3, 0:3), j(batch, 3, 3, 0:2), h(batch, 3, 0:2), k(batch, 0:2)
  end type fixed_masses_type

  !> Sums of one plane at a batch of angles, about the origin of the plane's axes and along these axes. The component of S along the
  !> normal is constant. Of the symmetric matrix J the elements xx, yy, zz, xy, xz, yz are stored.
  type :: flat_type
    real(dp) :: mass = 0, along_normal = 0
    real(dp) :: s(batch, 2, 0:3) = 0, j(batch, 6, 0:2) = 0, h(batch, 3, 0:2) = 0, k(batch, 0:2) = 0
  end type flat_type

  !> Third derivatives of the position of a joint at a batch of angles.
  type :: third_type
    real(dp) :: x(batch), y(batch)
  end type third_type

  !> Row and column in J of each of its six stored elements.
  integer, parameter :: of_row(6) = [1, 2, 3, 1, 1, 2], of_column(6) = [1, 2, 3, 2, 3, 3]

contains

  !> Allocates the sums over the masses for a number of angles and sets the sums to zero. `third`: with S''', J'', H'' and K.
  pure subroutine new_masses(angles, masses, third)
    integer, intent(in) :: angles
    type(masses_type), intent(out) :: masses
    logical, intent(in), optional :: third
    integer :: order

    order = 1
    if (present(third)) order = merge(2, 1, third)
    allocate(masses%s(angles, 3, 0:order + 1), masses%j(angles, 3, 3, 0:order), masses%h(angles, 3, 0:order), source=0.0_dp)
    if (order == 2) allocate(masses%k(angles, 0:2), source=0.0_dp)
  end subroutine new_masses

  !> Computes the sums over the masses of all planes at angles of the drive (rad). `third`: with S''', J'', H'' and K.
  pure subroutine sum_planes(planes, angles, masses, third)
    type(plane_type), intent(in) :: planes(:)
    real(dp), contiguous, intent(in) :: angles(:)
    type(masses_type), intent(out) :: masses
    logical, intent(in), optional :: third
    !> Allocated on the heap because threads have small stacks.
    type(path_type), allocatable :: at(:)
    type(third_type), allocatable :: thirds(:)
    type(flat_type), allocatable :: flat
    real(dp) :: some(batch)
    integer :: first, last, i, k

    call new_masses(size(angles), masses, third)
    do i = 1, size(planes)
      associate (plane => planes(i))
        masses%mass = masses%mass + sum(plane%linkage%links%mass)
        allocate(at(size(plane%linkage%joints)), thirds(size(plane%linkage%joints)))
        do first = 1, size(angles), batch
          call copy_batch(angles, first, last, some)
          if (allocated(masses%k)) then
            call trace_with_thirds(plane%linkage, some, at, thirds)
          else
            do k = 1, size(at)
              call plane%linkage%joints(k)%joint%trace(some, at(:k - 1), at(k))
            end do
          end if
          allocate(flat)
          do k = 1, size(plane%linkage%links)
            call add_link(plane%linkage%links(k), at, flat)
            if (allocated(masses%k)) call add_thirds(plane%linkage%links(k), at, thirds, flat)
          end do
          call place(flat, plane%axes, plane%origin, first, last, masses)
          deallocate(flat)
        end do
        deallocate(at, thirds)
      end associate
    end do
  end subroutine sum_planes

  !> Computes the paths of all joints at a batch of angles, with third derivatives.
  pure subroutine trace_with_thirds(linkage, angles, at, thirds)
    type(linkage_type), intent(in) :: linkage
    real(dp), intent(in) :: angles(batch)
    type(path_type), intent(inout) :: at(:)
    type(third_type), intent(inout) :: thirds(:)
    type(point_type) :: points(size(at))
    integer :: i, k

    do k = 1, batch
      call linkage%points(angles(k), points)
      do i = 1, size(at)
        associate (x => points(i)%x, y => points(i)%y)
          at(i)%x(k) = x%v
          at(i)%y(k) = y%v
          at(i)%vx(k) = x%d
          at(i)%vy(k) = y%d
          at(i)%ax(k) = x%dd
          at(i)%ay(k) = y%dd
          thirds(i)%x(k) = x%ddd
          thirds(i)%y(k) = y%ddd
        end associate
      end do
    end do
  end subroutine trace_with_thirds

  !> Adds a link to the sums of its plane. `at`: paths of all joints at a batch of angles.
  pure subroutine add_link(link, at, flat)
    type(link_type), intent(in) :: link
    type(path_type), intent(in) :: at(:)
    type(flat_type), intent(inout) :: flat
    type(path_type) :: place, u
    real(dp) :: x, y, vx, vy, ax, ay, cc, ss, cs, change
    integer :: k

    ! directions that place the centre of mass and the axes of the tensor
    call set_fixed([1.0_dp, 0.0_dp], place)
    call set_fixed(link%axis, u)
    if (link%to > 0) then
      call find_direction(at(link%from), at(link%to), u)
      place = u
    end if
    flat%mass = flat%mass + link%mass
    flat%along_normal = flat%along_normal + link%mass * link%z
    associate (from => at(link%from), center => link%center, m => link%mass, z => link%z, along => link%along, &
      & across => link%across, inertia => link%inertia, s => flat%s, j => flat%j, h => flat%h)
      do k = 1, batch
        x = from%x(k) + center(1) * place%x(k) - center(2) * place%y(k)
        y = from%y(k) + center(1) * place%y(k) + center(2) * place%x(k)
        vx = from%vx(k) + center(1) * place%vx(k) - center(2) * place%vy(k)
        vy = from%vy(k) + center(1) * place%vy(k) + center(2) * place%vx(k)
        ax = from%ax(k) + center(1) * place%ax(k) - center(2) * place%ay(k)
        ay = from%ay(k) + center(1) * place%ay(k) + center(2) * place%ax(k)
        s(k, 1, 0) = s(k, 1, 0) + m * x
        s(k, 2, 0) = s(k, 2, 0) + m * y
        s(k, 1, 1) = s(k, 1, 1) + m * vx
        s(k, 2, 1) = s(k, 2, 1) + m * vy
        s(k, 1, 2) = s(k, 1, 2) + m * ax
        s(k, 2, 2) = s(k, 2, 2) + m * ay
        cc = u%x(k) * u%x(k)
        ss = u%y(k) * u%y(k)
        cs = u%x(k) * u%y(k)
        j(k, 1, 0) = j(k, 1, 0) + m * (y * y + z * z) + along * cc + across * ss
        j(k, 2, 0) = j(k, 2, 0) + m * (x * x + z * z) + along * ss + across * cc
        j(k, 3, 0) = j(k, 3, 0) + m * (x * x + y * y) + inertia
        j(k, 4, 0) = j(k, 4, 0) - m * x * y + (along - across) * cs
        j(k, 5, 0) = j(k, 5, 0) - m * z * x
        j(k, 6, 0) = j(k, 6, 0) - m * z * y
        cs = u%x(k) * u%vy(k) + u%vx(k) * u%y(k)
        change = 2 * (along - across) * u%x(k) * u%vx(k)                        ! u u' = 0: (sin^2)' = -(cos^2)'
        j(k, 1, 1) = j(k, 1, 1) + 2 * m * y * vy + change
        j(k, 2, 1) = j(k, 2, 1) + 2 * m * x * vx - change
        j(k, 3, 1) = j(k, 3, 1) + 2 * m * (x * vx + y * vy)
        j(k, 4, 1) = j(k, 4, 1) - m * (x * vy + vx * y) + (along - across) * cs
        j(k, 5, 1) = j(k, 5, 1) - m * z * vx
        j(k, 6, 1) = j(k, 6, 1) - m * z * vy
        h(k, 1, 0) = h(k, 1, 0) - m * z * vy
        h(k, 2, 0) = h(k, 2, 0) + m * z * vx
        h(k, 3, 0) = h(k, 3, 0) + m * (x * vy - y * vx) + inertia * (u%x(k) * u%vy(k) - u%y(k) * u%vx(k))
        h(k, 1, 1) = h(k, 1, 1) - m * z * ay
        h(k, 2, 1) = h(k, 2, 1) + m * z * ax
        h(k, 3, 1) = h(k, 3, 1) + m * (x * ay - y * ax) + inertia * (u%x(k) * u%ay(k) - u%y(k) * u%ax(k))
      end do
    end associate
  end subroutine add_link

  !> Adds S''', J'', H'' and K of a link to the sums of its plane. Along e = to - from, d = |e|, the direction u of the link rotates
  !> at the rate w, with w and w' as in `find_direction` and
  !>
  !>     w'' = [e' x e'' + e x e''' - 4 w' e.e' - 2 w (e'.e' + e.e'')]/d^2,   u''' = (w'' - w^3) u_perp - 3 w w' u.
  pure subroutine add_thirds(link, at, thirds, flat)
    type(link_type), intent(in) :: link
    type(path_type), intent(in) :: at(:)
    type(third_type), intent(in) :: thirds(:)
    type(flat_type), intent(inout) :: flat
    type(path_type) :: place, u, center
    real(dp), dimension(batch) :: w, w_d, w_dd
    real(dp) :: ex, ey, ex_d, ey_d, ex_dd, ey_dd, square, jx, jy, ux, uy, change
    integer :: k

    call set_fixed([1.0_dp, 0.0_dp], place)
    call set_fixed(link%axis, u)
    w = 0
    w_d = 0
    w_dd = 0
    if (link%to > 0) then
      associate (a => at(link%from), b => at(link%to), a_3 => thirds(link%from), b_3 => thirds(link%to))
        do k = 1, batch
          ex = b%x(k) - a%x(k)
          ey = b%y(k) - a%y(k)
          ex_d = b%vx(k) - a%vx(k)
          ey_d = b%vy(k) - a%vy(k)
          ex_dd = b%ax(k) - a%ax(k)
          ey_dd = b%ay(k) - a%ay(k)
          ! A crank must turn at the rate 1 exactly, so that nothing excites a balanced rotor: hence quotients
          square = ex * ex + ey * ey
          w(k) = (ex * ey_d - ey * ex_d) / square
          w_d(k) = (ex * ey_dd - ey * ex_dd - 2 * w(k) * (ex * ex_d + ey * ey_d)) / square
          w_dd(k) = (ex_d * ey_dd - ey_d * ex_dd + ex * (b_3%y(k) - a_3%y(k)) - ey * (b_3%x(k) - a_3%x(k)) &
            & - 4 * w_d(k) * (ex * ex_d + ey * ey_d) - 2 * w(k) * (ex_d * ex_d + ey_d * ey_d + ex * ex_dd + ey * ey_dd)) &
            & / square
          u%x(k) = ex / sqrt(square)
          u%y(k) = ey / sqrt(square)
          u%vx(k) = -w(k) * u%y(k)
          u%vy(k) = w(k) * u%x(k)
          u%ax(k) = -w_d(k) * u%y(k) - w(k)**2 * u%x(k)
          u%ay(k) = w_d(k) * u%x(k) - w(k)**2 * u%y(k)
        end do
      end associate
      place = u
    end if
    call carry(at(link%from), place, link%center(1), link%center(2), center)
    associate (from_3 => thirds(link%from), m => link%mass, z => link%z, unequal => link%along - link%across, &
      & inertia => link%inertia, s => flat%s, j => flat%j, h => flat%h, x => center%x, y => center%y, vx => center%vx, &
      & vy => center%vy, ax => center%ax, ay => center%ay)
      do k = 1, batch
        ux = -(w_dd(k) - w(k)**3) * u%y(k) - 3 * w(k) * w_d(k) * u%x(k)
        uy = (w_dd(k) - w(k)**3) * u%x(k) - 3 * w(k) * w_d(k) * u%y(k)
        jx = from_3%x(k) + link%center(1) * ux - link%center(2) * uy
        jy = from_3%y(k) + link%center(1) * uy + link%center(2) * ux
        s(k, 1, 3) = s(k, 1, 3) + m * jx
        s(k, 2, 3) = s(k, 2, 3) + m * jy
        change = 2 * unequal * (u%vx(k) * u%vx(k) + u%x(k) * u%ax(k))
        j(k, 1, 2) = j(k, 1, 2) + 2 * m * (vy(k) * vy(k) + y(k) * ay(k)) + change
        j(k, 2, 2) = j(k, 2, 2) + 2 * m * (vx(k) * vx(k) + x(k) * ax(k)) - change
        j(k, 3, 2) = j(k, 3, 2) + 2 * m * (vx(k) * vx(k) + vy(k) * vy(k) + x(k) * ax(k) + y(k) * ay(k))
        j(k, 4, 2) = j(k, 4, 2) - m * (x(k) * ay(k) + 2 * vx(k) * vy(k) + ax(k) * y(k)) &
          & + unequal * (u%x(k) * u%ay(k) + 2 * u%vx(k) * u%vy(k) + u%ax(k) * u%y(k))
        j(k, 5, 2) = j(k, 5, 2) - m * z * ax(k)
        j(k, 6, 2) = j(k, 6, 2) - m * z * ay(k)
        h(k, 1, 2) = h(k, 1, 2) - m * z * jy
        h(k, 2, 2) = h(k, 2, 2) + m * z * jx
        h(k, 3, 2) = h(k, 3, 2) + m * (vx(k) * ay(k) - vy(k) * ax(k) + x(k) * jy - y(k) * jx) + inertia * w_dd(k)
        flat%k(k, 0) = flat%k(k, 0) + m * (vx(k) * vx(k) + vy(k) * vy(k)) + inertia * w(k)**2
        flat%k(k, 1) = flat%k(k, 1) + 2 * (m * (vx(k) * ax(k) + vy(k) * ay(k)) + inertia * w(k) * w_d(k))
        flat%k(k, 2) = flat%k(k, 2) + 2 * (m * (ax(k) * ax(k) + ay(k) * ay(k) + vx(k) * jx + vy(k) * jy) &
          & + inertia * (w_d(k)**2 + w(k) * w_dd(k)))
      end do
    end associate
  end subroutine add_thirds

  !> Adds the sums of a plane, for angles number `first` to `last`, to the sums about F. The plane has the axes Q and the origin o.
  !> With s = Q S the new sums are
  !>
  !>     S + s + m o,   J + Q J Q^T + 2 (o s) 1 - o s^T - s o^T + m (o^2 1 - o o^T),   H + Q H + o x s'.
  pure subroutine place(flat, axes, origin, first, last, masses)
    type(flat_type), intent(in) :: flat
    real(dp), intent(in) :: axes(3, 3), origin(3)
    integer, intent(in) :: first, last
    type(masses_type), intent(inout) :: masses
    real(dp) :: s(batch, 3, 0:3), j(batch), apart(3, 3), factor
    integer :: i, k, n, e, row, column, order

    n = last - first + 1
    order = ubound(masses%j, 4)
    do k = 0, order + 1
      do i = 1, 3
        s(:, i, k) = axes(i, 1) * flat%s(:, 1, k) + axes(i, 2) * flat%s(:, 2, k)
      end do
    end do
    do i = 1, 3
      s(:, i, 0) = s(:, i, 0) + axes(i, 3) * flat%along_normal
      masses%s(first:last, i, :) = masses%s(first:last, i, :) + s(:n, i, :order + 1)
      masses%s(first:last, i, 0) = masses%s(first:last, i, 0) + flat%mass * origin(i)
    end do
    apart = -flat%mass * spread(origin, 1, 3) * spread(origin, 2, 3)
    do i = 1, 3
      apart(i, i) = apart(i, i) + flat%mass * dot_product(origin, origin)
    end do
    do k = 0, order
      do e = 1, 6
        row = of_row(e)
        column = of_column(e)
        j = -origin(row) * s(:, column, k) - s(:, row, k) * origin(column)
        if (k == 0) j = j + apart(row, column)
        if (row == column) j = j + 2 * (origin(1) * s(:, 1, k) + origin(2) * s(:, 2, k) + origin(3) * s(:, 3, k))
        do i = 1, 6
          associate (a => of_row(i), b => of_column(i))
            factor = axes(row, a) * axes(column, b)
            if (a /= b) factor = factor + axes(row, b) * axes(column, a)
          end associate
          ! most axes are parallel to the frame's
          if (abs(factor) > 0) j = j + factor * flat%j(:, i, k)
        end do
        masses%j(first:last, row, column, k) = masses%j(first:last, row, column, k) + j(:n)
        if (row /= column) masses%j(first:last, column, row, k) = masses%j(first:last, row, column, k)
      end do
      do i = 1, 3
        row = 1 + modulo(i, 3)
        column = 1 + modulo(i + 1, 3)
        masses%h(first:last, i, k) = masses%h(first:last, i, k) + axes(i, 1) * flat%h(:n, 1, k) + axes(i, 2) * flat%h(:n, 2, k) &
          & + axes(i, 3) * flat%h(:n, 3, k) + origin(row) * s(:n, column, k + 1) - origin(column) * s(:n, row, k + 1)
      end do
    end do
    if (order == 2) masses%k(first:last, :) = masses%k(first:last, :) + flat%k(:n, :)
  end subroutine place

  !> Computes the sums along the fixed axes for the batch of angles that begins with angle number `first`. `rotation`: rotation
  !> matrices R of the frame.
  pure subroutine along_fixed_axes(masses, first, rotation, fixed)
    type(masses_type), intent(in) :: masses
    integer, intent(in) :: first
    real(dp), intent(in) :: rotation(batch, 3, 3)
    type(fixed_masses_type), intent(out) :: fixed
    integer :: at(batch), k

    at = in_batch(first, size(masses%s, 1))
    fixed%mass = masses%mass
    do k = 0, ubound(masses%s, 3)
      fixed%s(:, :, k) = times(rotation, masses%s(at, :, k))
    end do
    do k = 0, ubound(masses%j, 4)
      fixed%j(:, :, :, k) = times(rotation, times(masses%j(at, :, :, k), transposed(rotation)))
      fixed%h(:, :, k) = times(rotation, masses%h(at, :, k))
    end do
    if (allocated(masses%k)) fixed%k = masses%k(at, :)
  end subroutine along_fixed_axes

end module gestell_model_space_masses
