!> Samples the coefficients at the nodes of many steps, for methods that use both ends of a step.
module gestell_floquet_integrator_comparison_step_nodes
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: sample_steps

  !> Distance in phase between the end of a step and the sample for this end. If the coefficients jump at the end of the step,
  !> this distance keeps the sample on the correct side of the jump in spite of rounding errors.
  real(dp), parameter :: inside = 8 * epsilon(1.0_dp)

contains

  !> Samples P and, if `forced`, f at the relative positions `c` in every step. The common end of two successive steps is evaluated
  !> only once, unless the coefficients jump there.
  subroutine sample_steps(system, from, to, c, forced, at, p, f)
    class(periodic_system), intent(in) :: system
    !> `from`, `to`: start and end of each step, as phases. `c`: relative positions in a step, ascending from 0 to 1.
    real(dp), intent(in) :: from(:), to(:), c(:)
    logical, intent(in) :: forced
    !> `at(i, k)`: index of the sample at the relative position `c(i)` in step k; the coefficients of this sample are p(:, :, at(i,
    !> k)) and f(:, at(i, k))
    integer, intent(out) :: at(:, :)
    !> `p`: samples of the matrix P, shape (n, n, points). `f`: samples of the forcing f, shape (n, points); unallocated unless
    !> `forced`.
    real(dp), allocatable, intent(out) :: p(:, :, :), f(:, :)
    real(dp) :: phases(size(c) * size(from))
    integer :: last, i, k

    last = 0
    do k = 1, size(from)
      if (.not. starts_at_last_end(k)) then
        last = last + 1
        phases(last) = from(k) + inside
      end if
      at(:, k) = [(last + i, i = 0, size(c) - 1)]
      phases(at(2:, k)) = [from(k) + c(2:size(c) - 1) * (to(k) - from(k)), to(k) - inside]
      last = last + size(c) - 1
    end do

    allocate(p(system%states, system%states, last))
    ! An unallocated variable counts as an absent argument.
    if (forced) allocate(f(system%states, last))
    call system%sample(phases(:last), p, f)

  contains

    logical function starts_at_last_end(k) result(shares)
      integer, intent(in) :: k

      shares = .false.
      if (k > 1) shares = abs(from(k) - to(k - 1)) < inside
      if (.not. allocated(system%breaks)) return
      shares = shares .and. all(abs(system%breaks / system%period - from(k)) > inside)
    end function starts_at_last_end

  end subroutine sample_steps

end module gestell_floquet_integrator_comparison_step_nodes
