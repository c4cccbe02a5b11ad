!> Reference tables of the mass functions, for the tests.
module tables
  use gestell_base_kinds, only: dp
  use gestell_model_joints_path, only: batch
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_v, a2_d, a2_dd, a2_v, a3_d, a3_dd, a3_v, a4_v, mass_functions_type, &
    & mechanism_type
  implicit none (type, external)
  private

  public :: one_by_one, some_angles

  !> More than two batches, both senses of rotation, angles that are not adjacent.
  integer, parameter, public :: many = 2 * batch + 7

contains

  !> Angles to both sides of 0, neighbours far apart.
  pure function some_angles(count) result(angles)
    integer, intent(in) :: count
    real(dp) :: angles(count)
    integer :: k

    angles = [(0.73_dp * k * (-1)**k, k = 1, count)]
  end function some_angles

  !> The reference table, computed angle by angle.
  subroutine one_by_one(mechanism, angles, table)
    class(mechanism_type), intent(in) :: mechanism
    real(dp), intent(in) :: angles(:)
    real(dp), intent(out) :: table(:, :)
    type(mass_functions_type) :: a
    integer :: k

    do k = 1, size(angles)
      call mechanism%mass_functions(angles(k), a)
      table(k, a1_v) = a%a1%v
      table(k, a1_d) = a%a1%d
      table(k, a1_dd) = a%a1%dd
      table(k, a2_v) = a%a2%v
      table(k, a2_d) = a%a2%d
      table(k, a2_dd) = a%a2%dd
      table(k, a3_v) = a%a3%v
      table(k, a3_d) = a%a3%d
      table(k, a3_dd) = a%a3%dd
      table(k, a4_v) = a%a4
    end do
  end subroutine one_by_one

end module tables
