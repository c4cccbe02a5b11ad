!> Samples the coefficients of a periodic system at many phases, in the form that gestell_floquet_reduction uses.
module gestell_floquet_reduction_coefficients
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_floquet_reduction_phasewise, only: multiply
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: change_coordinates, sample

  !> Coefficients A = T P, shape (phases, n, n), and loads T f, shape (phases, n), at a number of phases.
  type, public :: coefficients_type
    real(dp), allocatable :: a(:, :, :), f(:, :)
  end type coefficients_type

contains

  !> Samples A = T P and T f in balanced units at `phases`. Fails if the coefficients are not finite.
  subroutine sample(system, scale, forced, phases, coefficients, error)
    class(periodic_system), intent(in) :: system
    !> `scale`: units that balance the states, shape (n). `phases`: phases t / T.
    real(dp), intent(in) :: scale(:), phases(:)
    !> If true, sample f in addition to A. False: set f to zero
    logical, intent(in) :: forced
    type(coefficients_type), intent(out) :: coefficients
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: p(:, :, :), f(:, :)
    integer :: n, i, j

    n = system%states
    allocate(p(n, n, size(phases)))
    ! An unallocated actual argument counts as an absent optional argument.
    if (forced) allocate(f(n, size(phases)))
    call system%sample(phases, p, f)
    allocate(coefficients%a(size(phases), n, n), coefficients%f(size(phases), n), source=0.0_dp)
    do j = 1, n
      do i = 1, n
        coefficients%a(:, i, j) = p(i, j, :) * (system%period * scale(j) / scale(i))
      end do
      if (forced) coefficients%f(:, j) = f(j, :) * (system%period / scale(j))
    end do
    if (all(ieee_is_finite(coefficients%a)) .and. all(ieee_is_finite(coefficients%f))) return
    call fatal_error(error, "the system's coefficients are not finite", failed_computation)
  end subroutine sample

  !> Transforms the coefficients to coordinates whose basis is the columns of `start`, shape (n, n). `own`: the transformed
  !> coefficients.
  pure subroutine change_coordinates(coefficients, start, start_inverse, own)
    type(coefficients_type), intent(in) :: coefficients
    real(dp), contiguous, intent(in) :: start(:, :), start_inverse(:, :)
    type(coefficients_type), intent(out) :: own
    real(dp), allocatable :: product(:, :, :)

    allocate(own%a, product, mold=coefficients%a)
    allocate(own%f, mold=coefficients%f)
    call multiply(coefficients%a, start, product)
    call multiply(start_inverse, product, own%a)
    call multiply(start_inverse, coefficients%f, own%f)
  end subroutine change_coordinates

end module gestell_floquet_reduction_coefficients
