!> Splits periodic systems into parts that do not act on each other.
module gestell_system_subsystem
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: find_subsystems, extract_subsystem

  !> The states `chosen` of the system `whole`, treated as a system of its own
  type, extends(periodic_system) :: first_order_subsystem
    class(periodic_system), allocatable :: whole
    integer, allocatable :: chosen(:)
  contains
    procedure :: matrix, forcing, sample
  end type first_order_subsystem

  !> The degrees of freedom `chosen` of the system `whole`, treated as a system of its own
  type, extends(second_order_system) :: second_order_subsystem
    class(second_order_system), allocatable :: whole
    integer, allocatable :: chosen(:)
  contains
    procedure :: matrices, load, sample_second_order, conserves
  end type second_order_subsystem

contains

  !> Finds the part to which each state (for a second-order system each degree of freedom) belongs. Parts are numbered from 1. Fails
  !> if the table `coupled` has the wrong shape.
  subroutine find_subsystems(system, parts, error)
    class(periodic_system), intent(in) :: system
    integer, allocatable, intent(out) :: parts(:)
    type(error_type), allocatable, intent(out) :: error
    logical, allocatable :: coupled(:, :)
    integer :: expected, i, k, n

    allocate(coupled, source=system%coupled())
    n = size(coupled, 1)
    expected = system%states
    select type (system)
    class is (second_order_system)
      ! A second-order system that is all coupled may return a table for its states.
      if (.not. (all(coupled) .and. n == system%states)) expected = system%states / 2
    end select
    if (any(shape(coupled) /= expected)) then
      call fatal_error(error, "the table `coupled` must have one row and one column for each state, or for each degree of " &
        & // "freedom of a second-order system", invalid_input)
      return
    end if
    allocate(parts(n), source=1)
    if (all(coupled)) return
    parts = [(k, k = 1, n)]
    do i = 1, n
      do k = 1, i - 1
        if (coupled(i, k) .or. coupled(k, i)) where (parts == parts(i)) parts = parts(k)
      end do
    end do
    do k = n, 1, -1
      ! Renumbers the parts without gaps.
      if (count(parts == k) == 0) where (parts > k) parts = parts - 1
    end do
  end subroutine find_subsystems

  !> Extracts the part of `system` that consists of the states `chosen` (for a second-order system the degrees of freedom `chosen`).
  !> The rest of the system must not act on this part. `states`: numbers of the part's states in the whole system.
  subroutine extract_subsystem(system, chosen, part, states)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: chosen(:)
    class(periodic_system), allocatable, intent(out) :: part
    integer, allocatable, intent(out) :: states(:)
    type(first_order_subsystem) :: first
    type(second_order_subsystem) :: second

    select type (system)
    class is (second_order_system)
      allocate(states, source=[chosen, system%states / 2 + chosen])
      allocate(second%whole, source=system)
      allocate(second%chosen, source=chosen)
      allocate(part, source=second)
    class default
      allocate(states, source=chosen)
      allocate(first%whole, source=system)
      allocate(first%chosen, source=chosen)
      allocate(part, source=first)
    end select
    part%states = size(states)
    call part%inherit(system)
  end subroutine extract_subsystem

  !> Computes the matrix P of the chosen states.
  subroutine matrix(self, t, p)
    class(first_order_subsystem), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp) :: many(self%states, self%states, 1)

    call self%sample([t / self%period], many)
    p = many(:, :, 1)
  end subroutine matrix

  !> Computes the forcing f of the chosen states.
  subroutine forcing(self, t, f)
    class(first_order_subsystem), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)
    real(dp) :: full(self%whole%states)

    call self%whole%forcing(t, full)
    f = full(self%chosen)
  end subroutine forcing

  !> Samples the matrix P and the forcing f of the chosen states.
  subroutine sample(self, phases, p, f)
    class(first_order_subsystem), intent(in) :: self
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: p(:, :, :)
    real(dp), intent(out), optional :: f(:, :)
    real(dp), allocatable :: full_p(:, :, :), full_f(:, :)

    allocate(full_p(self%whole%states, self%whole%states, size(phases)))
    ! An unallocated variable counts as an absent argument.
    if (present(f)) allocate(full_f(self%whole%states, size(phases)))
    call self%whole%sample(phases, full_p, full_f)
    if (present(f)) f = full_f(self%chosen, :)
    p = full_p(self%chosen, self%chosen, :)
  end subroutine sample

  !> Computes M, B, C of the chosen degrees of freedom.
  subroutine matrices(self, t, m, b, c)
    class(second_order_subsystem), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    real(dp), dimension(self%whole%states / 2, self%whole%states / 2) :: full_m, full_b, full_c

    call self%whole%matrices(t, full_m, full_b, full_c)
    m = full_m(self%chosen, self%chosen)
    b = full_b(self%chosen, self%chosen)
    c = full_c(self%chosen, self%chosen)
  end subroutine matrices

  !> Computes the load h of the chosen degrees of freedom.
  subroutine load(self, t, h)
    class(second_order_subsystem), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)
    real(dp) :: full(self%whole%states / 2)

    call self%whole%load(t, full)
    h = full(self%chosen)
  end subroutine load

  !> Samples M, B, C and h of the chosen degrees of freedom.
  subroutine sample_second_order(self, phases, m, b, c, h)
    class(second_order_subsystem), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    real(dp), allocatable, dimension(:, :, :) :: full_m, full_b, full_c
    real(dp), allocatable :: full_h(:, :)

    associate (n => self%whole%states / 2)
      allocate(full_m(size(phases), n, n), full_b(size(phases), n, n), full_c(size(phases), n, n))
      if (present(h)) allocate(full_h(size(phases), n))
    end associate
    call self%whole%sample_second_order(phases, full_m, full_b, full_c, full_h)
    if (present(h)) h = full_h(:, self%chosen)
    m = full_m(:, self%chosen, self%chosen)
    b = full_b(:, self%chosen, self%chosen)
    c = full_c(:, self%chosen, self%chosen)
  end subroutine sample_second_order

  !> True if the equations of the degrees of freedom `chosen` are those of a Lagrangian without damping.
  logical function conserves(self, chosen)
    class(second_order_subsystem), intent(in) :: self
    integer, intent(in) :: chosen(:)

    conserves = self%whole%conserves(self%chosen(chosen))
  end function conserves

end module gestell_system_subsystem
