!> What joints and links can be given.
module gestell_model_linkage_checks
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: check_finite, check_lengths, check_place

  !> Lengths of links (m) within which squares and their quotients neither vanish nor overflow.
  real(dp), parameter :: shortest = 1.0e-100_dp, longest = 1.0e100_dp

contains

  !> Error: not all of the numbers of `part` are finite.
  pure subroutine check_finite(part, numbers, error)
    character(len=*), intent(in) :: part
    real(dp), intent(in) :: numbers(:)
    type(error_type), allocatable, intent(out) :: error

    if (.not. all(ieee_is_finite(numbers))) call fatal_error(error, part // ": its numbers must be finite", invalid_input)
  end subroutine check_finite

  !> Error: coordinates (m) of `part` are not finite, or beyond all lengths.
  pure subroutine check_place(part, coordinates, error)
    character(len=*), intent(in) :: part
    real(dp), intent(in) :: coordinates(:)
    type(error_type), allocatable, intent(out) :: error

    call check_finite(part, coordinates, error)
    if (allocated(error) .or. all(abs(coordinates) <= longest)) return
    call fatal_error(error, part // ": coordinates must lie between -1e100 m and 1e100 m", invalid_input)
  end subroutine check_place

  !> Errors: lengths (m) that are not positive, or beyond what can be computed with; a branch that is neither 1 nor -1.
  pure subroutine check_lengths(name, lengths, branch, error)
    character(len=*), intent(in) :: name
    real(dp), intent(in) :: lengths(:)
    integer, intent(in) :: branch
    type(error_type), allocatable, intent(out) :: error

    call check_finite("joint '" // name // "'", lengths, error)
    if (allocated(error)) return
    if (.not. all(lengths > 0)) then
      call fatal_error(error, "joint '" // name // "': its lengths must be positive", invalid_input)
    else if (any(lengths < shortest .or. lengths > longest)) then
      call fatal_error(error, "joint '" // name // "': lengths must lie between 1e-100 m and 1e100 m", invalid_input)
    else if (abs(branch) /= 1) then
      call fatal_error(error, "joint '" // name // "': its branch must be 1 or -1", invalid_input)
    end if
  end subroutine check_lengths

end module gestell_model_linkage_checks
