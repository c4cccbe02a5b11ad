!> Directions in which the mean square of a vector is looked at.
module gestell_study_design_directions
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: directions_about

contains

  !> That of the greatest eigenvalue of a symmetric matrix, and others all around, shape (size, directions).
  pure function directions_about(square) result(u)
    real(dp), intent(in) :: square(:, :)
    real(dp), allocatable :: u(:, :)
    integer, parameter :: around = 12, iterations = 200
    !> Half of those to the faces, edges and corners of a cube.
    integer, parameter :: cube(3, 13) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0, 1, -1, 0, 1, 0, 1, 1, 0, -1, 0, 1, 1, &
      & 0, 1, -1, 1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, -1], [3, 13])
    real(dp) :: v(3), most
    integer :: d

    select case (size(square, 1))
    case (1)
      u = reshape([1.0_dp], [1, 1])
    case (2)
      allocate(u(2, around + 1))
      u(:, 1) = along_angle(atan2(2 * square(1, 2), square(1, 1) - square(2, 2)) / 2)
      do d = 1, around
        u(:, d + 1) = along_angle(pi * d / around)
      end do
    case default
      allocate(u(3, size(cube, 2) + 1))
      most = -1
      do d = 1, size(cube, 2)
        v = cube(:, d)
        v = v / norm2(v)
        u(:, d + 1) = v
        if (dot_product(v, matmul(square, v)) > most) u(:, 1) = v
        most = max(most, dot_product(v, matmul(square, v)))
      end do
      do d = 1, iterations
        v = matmul(square, u(:, 1))
        if (.not. norm2(v) > 0) exit
        u(:, 1) = v / norm2(v)
      end do
    end select
  end function directions_about

  pure function along_angle(angle) result(u)
    real(dp), intent(in) :: angle
    real(dp) :: u(2)

    u = [cos(angle), sin(angle)]
  end function along_angle

end module gestell_study_design_directions
