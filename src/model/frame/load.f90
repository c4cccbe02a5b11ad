!> The load h of (12) that a mechanism exerts on its frame.
module gestell_model_frame_load
  use gestell_base_kinds, only: dp, pi
  use gestell_model_mechanism_held, only: tabulate_felt
  use gestell_model_mechanism, only: mechanism_type, table_columns
  implicit none (type, external)
  private

  public :: cancellation, set_load

contains

  !> h of (12), shape (angles, degrees of freedom), of the `free` ones of xi, eta, psi, from the `load` at crank angles, shape
  !> (angles, 3), as `tabulate_felt` has it; the crank's `speed` (rad/s) and its pivot, the `origin`, in the frame (m).
  pure subroutine set_load(free, speed, origin, load, h)
    integer, intent(in) :: free(:)
    real(dp), intent(in) :: speed, origin(2)
    real(dp), contiguous, intent(in) :: load(:, :)
    real(dp), contiguous, intent(inout) :: h(:, :)
    integer :: i

    associate (omega => speed, xi0 => origin(1), eta0 => origin(2))
      do i = 1, size(free)
        select case (free(i))
        case (1)
          h(:, i) = -omega**2 * load(:, 1)
        case (2)
          h(:, i) = -omega**2 * load(:, 2)
        case (3)
          h(:, i) = -omega**2 * (xi0 * load(:, 2) - eta0 * load(:, 1) + load(:, 3))
        case default
          h(:, i) = 0
        end select
      end do
    end associate
  end subroutine set_load

  !> By how many times the absolute terms of the load exceed it, the greatest over the `free` of xi, eta, psi, weighted as in the
  !> kinetic energy of `mass` (kg) and `inertia` (kg m^2); 0: nothing cancels. `even_in_space`: so the crank turns.
  real(dp) function cancellation(mechanism, free, origin, mass, inertia, even_in_space)
    class(mechanism_type), intent(in) :: mechanism
    integer, intent(in) :: free(:)
    real(dp), intent(in) :: origin(2), mass, inertia
    logical, intent(in) :: even_in_space
    integer, parameter :: angles = 16
    real(dp) :: felt(angles, table_columns), load(angles, 3), h(angles, size(free)), terms(3), weights(3), greatest
    integer :: i

    cancellation = 0
    if (.not. any(mechanism%terms > 0)) return
    call tabulate_felt(mechanism, origin, even_in_space, [(2 * pi * i / angles, i = 1, angles)], felt, load)
    call set_load(free, 1.0_dp, origin, load, h)
    terms = mechanism%terms(:3)
    terms(3) = abs(origin(1)) * terms(2) + abs(origin(2)) * terms(1) + terms(3)
    weights = 1 / sqrt(max(tiny(1.0_dp), inertia + mechanism%inertia))
    weights(:2) = 1 / sqrt(max(tiny(1.0_dp), mass + mechanism%mass))
    greatest = maxval(maxval(abs(h), dim=1) * weights(free))
    if (greatest > 0) cancellation = max(0.0_dp, maxval(terms(free) * weights(free)) / greatest - 1)
  end function cancellation

end module gestell_model_frame_load
