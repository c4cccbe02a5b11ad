!> Sums over the moving masses of planar mechanisms for a frame in space, (45) of doc/theory.md. The centre of mass of a link is at
!> r = o + Q (x, y, z) relative to F, along the frame's axes. Q has the axes of the link's mechanism as columns; o is the origin of
!> this mechanism. With the inertia tensors J_i and angular velocities w_i of the links,
!>
!>     S = sum m r,   J = sum [m (|r|^2 1 - r r^T) + J_i],   H = sum [m r x r' + J_i w_i],
!>
!> which are functions of the drive's angle phi, ' = d/dphi. The coordinate z of a link is constant. The principal axes of the
!> link's inertia tensor are along the link, perpendicular to it in the plane, and along the normal. As for a frame in the plane,
!> the joints are computed at batches of angles (gestell_model_linkage).
module gestell_model_space_masses
  use gestell_base_kinds, only: dp
  use gestell_model_joints_path, only: batch, find_direction, set_fixed, path_type, copy_batch
  use gestell_model_linkage, only: linkage_type
  use gestell_model_linkage_bodies, only: link_type
  implicit none (type, external)
  private

  public :: new_masses, sum_planes

  !> A linkage and the orientation and origin of the plane in which it moves.
  type, public :: plane_type
    type(linkage_type) :: linkage
    !> `axes`: matrix Q, whose columns are the plane's axes; the third is the plane's normal. `origin`: origin o of the plane's axes
    !> (m).
    real(dp) :: axes(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3]), origin(3) = 0
  end type plane_type

  !> Sums over the masses at many angles of the drive, with derivatives. `s`: S, S', S'' (kg m), shape (angles, 3, 0:2). `j`: J, J'
  !> (kg m^2), shape (angles, 3, 3, 0:1). `h`: H, H' (kg m^2), shape (angles, 3, 0:1).
  type, public :: masses_type
    real(dp) :: mass = 0
    real(dp), allocatable :: s(:, :, :), j(:, :, :, :), h(:, :, :)
  end type masses_type

  !> Sums of one plane at a batch of angles, about the origin of the plane's axes and along these axes. The component of S along the
  !> normal is constant. Of the symmetric matrix J the elements xx, yy, zz, xy, xz, yz are stored.
  type :: flat_type
    real(dp) :: mass = 0, along_normal = 0
    real(dp) :: s(batch, 2, 0:2) = 0, j(batch, 6, 0:1) = 0, h(batch, 3, 0:1) = 0
  end type flat_type

  !> Row and column in J of each of its six stored elements.
  integer, parameter :: of_row(6) = [1, 2, 3, 1, 1, 2], of_column(6) = [1, 2, 3, 2, 3, 3]

contains

  !> Allocates the sums over the masses for a number of angles and sets the sums to zero.
  pure subroutine new_masses(angles, masses)
    integer, intent(in) :: angles
    type(masses_type), intent(out) :: masses

    allocate(masses%s(angles, 3, 0:2), masses%j(angles, 3, 3, 0:1), masses%h(angles, 3, 0:1), source=0.0_dp)
  end subroutine new_masses

  !> Computes the sums over the masses of all planes at angles of the drive (rad).
  pure subroutine sum_planes(planes, angles, masses)
    type(plane_type), intent(in) :: planes(:)
    real(dp), contiguous, intent(in) :: angles(:)
    type(masses_type), intent(out) :: masses
    !> Allocated on the heap because threads have small stacks.
    type(path_type), allocatable :: at(:)
    type(flat_type), allocatable :: flat
    real(dp) :: some(batch)
    integer :: first, last, i, k

    call new_masses(size(angles), masses)
    do i = 1, size(planes)
      associate (plane => planes(i))
        masses%mass = masses%mass + sum(plane%linkage%links%mass)
        allocate(at(size(plane%linkage%joints)))
        do first = 1, size(angles), batch
          call copy_batch(angles, first, last, some)
          do k = 1, size(at)
            call plane%linkage%joints(k)%joint%trace(some, at(:k - 1), at(k))
          end do
          allocate(flat)
          do k = 1, size(plane%linkage%links)
            call add_link(plane%linkage%links(k), at, flat)
          end do
          call place(flat, plane%axes, plane%origin, first, last, masses)
          deallocate(flat)
        end do
        deallocate(at)
      end associate
    end do
  end subroutine sum_planes

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

  !> Adds the sums of a plane, for angles number `first` to `last`, to the sums about F. The plane has the axes Q and the origin o.
  !> With s = Q S the new sums are
  !>
  !>     S + s + m o,   J + Q J Q^T + 2 (o s) 1 - o s^T - s o^T + m (o^2 1 - o o^T),   H + Q H + o x s'.
  pure subroutine place(flat, axes, origin, first, last, masses)
    type(flat_type), intent(in) :: flat
    real(dp), intent(in) :: axes(3, 3), origin(3)
    integer, intent(in) :: first, last
    type(masses_type), intent(inout) :: masses
    real(dp) :: s(batch, 3, 0:2), j(batch), apart(3, 3), factor
    integer :: i, k, n, e, row, column

    n = last - first + 1
    do k = 0, 2
      do i = 1, 3
        s(:, i, k) = axes(i, 1) * flat%s(:, 1, k) + axes(i, 2) * flat%s(:, 2, k)
      end do
    end do
    do i = 1, 3
      s(:, i, 0) = s(:, i, 0) + axes(i, 3) * flat%along_normal
      masses%s(first:last, i, :) = masses%s(first:last, i, :) + s(:n, i, :)
      masses%s(first:last, i, 0) = masses%s(first:last, i, 0) + flat%mass * origin(i)
    end do
    apart = -flat%mass * spread(origin, 1, 3) * spread(origin, 2, 3)
    do i = 1, 3
      apart(i, i) = apart(i, i) + flat%mass * dot_product(origin, origin)
    end do
    do k = 0, 1
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
  end subroutine place

end module gestell_model_space_masses
