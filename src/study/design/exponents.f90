!> The multipliers of a machine about its vibration and their derivatives with respect to parameters. In Floquet's coordinates
!> (gestell_study_design_coordinates) a change dA of the equations x' = A x changes the logarithm of the i-th multiplier by
!>
!>     d ln rho_i = integral over the period of [W dA P]_ii
!>
!> (Seyranian, Mailybaev, Multiparameter Stability Theory with Mechanical Applications, 2003, chapter 9). The integrand is periodic,
!> so its mean over equidistant phases is exact but for orders that they do not resolve; where the period changes too, A T takes the
!> place of A.
module gestell_study_design_exponents
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_model_frame, only: frame_type
  use gestell_study_design_coordinates, only: coordinates_type, find_coordinates
  use gestell_study_design_motion, only: beside, motion_type
  use gestell_study_design_neighbours, only: neighbours_type
  implicit none (type, external)
  private

  public :: solve_exponents

contains

  !> abs(rho), shape (states), to `tolerance`, and their derivatives, shape (parameters, states), no parameters without the motion's
  !> derivatives.
  !> Error: the free vibrations are too fast against the period, or multipliers coincide.
  subroutine solve_exponents(neighbours, motion, tolerance, moduli, changes, error)
    type(neighbours_type), intent(in) :: neighbours
    type(motion_type), intent(in) :: motion
    real(dp), intent(in) :: tolerance
    real(dp), allocatable, intent(out) :: moduli(:), changes(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(coordinates_type) :: free
    real(dp), allocatable :: a(:, :, :)
    logical :: fits
    integer :: i, j, k, n

    n = motion%frame%states
    call find_coordinates(motion%frame, size(motion%phases), tolerance, free, fits, motion%quick)
    if (.not. fits) then
      call fatal_error(error, "the multipliers' derivatives cannot be told", failed_computation)
      return
    end if
    moduli = exp(real(free%lambda) * free%period)
    allocate(changes(motion%parameters(), n), source=0.0_dp)
    allocate(a(n, n, size(motion%phases)))
    do k = 1, size(changes, 1)
      call differentiate_system(neighbours, motion, k, a)
      do j = 1, size(a, 3)
        do i = 1, n
          changes(k, i) = changes(k, i) + real(sum(free%w(i, :, j) / free%scale * matmul(a(:, :, j), free%scale * free%p(:, i, j))))
        end do
      end do
      changes(k, :) = moduli * changes(k, :) / size(a, 3)
    end do
  end subroutine solve_exponents

  !> d(T A)/dp at the motion's phases, shape (states, states, phases), along parameter `k` and with the motion about which the
  !> system is varied.
  subroutine differentiate_system(neighbours, motion, k, changes)
    type(neighbours_type), intent(in) :: neighbours
    type(motion_type), intent(in) :: motion
    integer, intent(in) :: k
    real(dp), intent(out) :: changes(:, :, :)
    class(frame_type), allocatable :: frame
    real(dp) :: a(size(changes, 1), size(changes, 1), size(changes, 3))
    integer :: i

    call motion%frame%sample(motion%phases, a)
    changes = neighbours%weight(0, k) * motion%frame%period * a
    do i = 1, 2
      call beside(neighbours, motion%frame, motion, motion%q + neighbours%distance(i, k) * motion%slope(:, :, :, k), k, i, frame)
      call frame%sample(motion%phases, a)
      changes = changes + neighbours%weight(i, k) * frame%period * a
    end do
  end subroutine differentiate_system

end module gestell_study_design_exponents
