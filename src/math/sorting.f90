!> The order of numbers.
module gestell_math_sorting
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  public :: ascending

contains

  !> The places of the values from the least to the greatest, of equal ones as they come; quick where they nearly ascend.
  pure function ascending(values) result(places)
    real(dp), intent(in) :: values(:)
    integer :: places(size(values))
    integer :: k, i

    do k = 1, size(values)
      do i = k, 2, -1
        if (values(places(i - 1)) <= values(k)) exit
        places(i) = places(i - 1)
      end do
      places(i) = k
    end do
  end function ascending

end module gestell_math_sorting
