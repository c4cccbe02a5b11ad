!> Sorts numbers.
module gestell_math_sorting
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: ascending

contains

  !> Indices that sort the values in ascending order. Equal values keep their order. The procedure is fast if the values are nearly
  !> sorted.
  pure function ascending(values) result(positions)
    real(dp), intent(in) :: values(:)
    integer :: positions(size(values))
    integer :: k, i

    do k = 1, size(values)
      do i = k, 2, -1
        if (values(positions(i - 1)) <= values(k)) exit
        positions(i) = positions(i - 1)
      end do
      positions(i) = k
    end do
  end function ascending

end module gestell_math_sorting
