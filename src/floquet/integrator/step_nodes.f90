!> The coefficients at the nodes of many steps, for methods that use both ends of a step.
module gestell_floquet_integrator_step_nodes
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: sample_steps

  !> The ends of a step are taken this far inside of it, in phase: at a break the coefficients are those of the step's
  !> own side, also after rounding.
  real(dp), parameter :: inside = 8 * epsilon(1.0_dp)

contains

  !> P and, where asked for, f at the positions `c` of every step, `c` ascending from 0 to 1: those of position i in step k are
  !> p(:, :, at(i, k)) and f(:, at(i, k)). The end that two steps share is evaluated once, unless the coefficients
  !> jump there.
  subroutine sample_steps(system, from, to, c, at, p, f)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: from(:), to(:), c(:)
    integer, intent(out) :: at(:, :)
    real(dp), allocatable, intent(out) :: p(:, :, :)
    real(dp), allocatable, intent(out), optional :: f(:, :)
    real(dp) :: phases(size(c) * size(from))
    integer :: last, i, k

    last = 0
    do k = 1, size(from)
      if (shares_its_start(k)) then
        at(1, k) = last
      else
        call append(from(k) + inside)
        at(1, k) = last
      end if
      do i = 2, size(c) - 1
        call append(from(k) + c(i) * (to(k) - from(k)))
        at(i, k) = last
      end do
      call append(to(k) - inside)
      at(size(c), k) = last
    end do

    allocate(p(system%states, system%states, last))
    if (present(f)) then
      allocate(f(system%states, last))
      call system%sample(phases(:last), p, f)
    else
      call system%sample(phases(:last), p)
    end if

  contains

    logical function shares_its_start(k) result(shares)
      integer, intent(in) :: k

      shares = .false.
      if (k > 1) shares = abs(from(k) - to(k - 1)) < inside
      if (.not. allocated(system%breaks)) return
      shares = shares .and. all(abs(system%breaks / system%period - from(k)) > inside)
    end function shares_its_start

    subroutine append(phase)
      real(dp), intent(in) :: phase

      last = last + 1
      phases(last) = phase
    end subroutine append

  end subroutine sample_steps

end module gestell_floquet_integrator_step_nodes
