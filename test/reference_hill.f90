!> Floquet exponents and periodic solution of x' = P(t) x + f(t), P and f smooth and of period T, in quadruple precision
!> and without integration: Hill's method. Its cost does not depend on how far a vibration turns in a period.
!>
!> With the angle t 2 pi/T and A = P T/(2 pi), a solution x exp(integral of lambda), x periodic, obeys
!>
!>     A x - lambda x - x' = 0.                                                                       (H)
!>
!> x is sought as a trigonometric polynomial that meets (H) at N equidistant angles, in one of two ways:
!>
!>   direct    lambda is constant, one component of x at one angle is 1: Hill's determinant in the angle's plane
!>   followed  lambda is a periodic function, one component of x is 1 at every angle: a Riccati equation. The turning of
!>             fast vibrations, of thousands of harmonics, is then in lambda, and x and lambda stay smooth.
!>
!> Both give an exact multiplier exp(2 pi mean(lambda)), up to what N angles miss of a smooth function. Newton's method
!> with residuals in quadruple precision solves them; only its linear systems are solved in double precision.
module reference_hill
  use, intrinsic :: iso_fortran_env, only: dp => real64
  use reference_collocation, only: iterate, sample, table_type
  use reference_double, only: eigenpairs
  use reference_flow, only: flow_system
  use reference_linear, only: qp
  use reference_machine, only: pi => pi_qp
  implicit none (type, external)
  private

  public :: distance, hill_solution, solve_hill

  !> change_rho: largest change of a ln(rho) by the last refinement, or the rounding of 2 pi lambda if that is larger;
  !> change_x0: the same for x0, relative to its size in balanced units. A result with a change above about 1e-15 is unknown;
  !> huge means that nothing was found.
  type :: hill_solution
    complex(qp), allocatable :: log_rho(:) ! largest real part first, imaginary parts in (-pi, pi]
    real(qp), allocatable :: x0(:)
    real(qp) :: change_rho = huge(1.0_qp), change_x0 = huge(1.0_qp)
    real(qp) :: liouville = huge(1.0_qp)   ! sum of all ln(rho), minus the integral of tr P
    integer :: points = 0
    character(len=8) :: route = ''
  end type hill_solution

  !> Frozen eigenpairs at every angle, each followed around.
  type :: branches_type
    complex(dp), allocatable :: lambda(:, :), x(:, :, :) ! (mode, angle), (state, mode, angle)
  end type branches_type

  !> Numbers of angles that are tried, odd.
  integer, parameter :: hill_levels(5) = [41, 61, 91, 137, 205]
  !> Two levels that agree this well, absolutely in ln(rho) and relative to the rounding of 2 pi lambda, are accepted.
  real(qp), parameter :: wanted = 1.0e-22_qp, rounding = 1.0e-30_qp

contains

  !> route: 'direct' or 'followed'; if absent, the suitable one, and the other if it fails.
  subroutine solve_hill(system, period, solution, route)
    class(flow_system), intent(in) :: system
    real(qp), intent(in) :: period
    type(hill_solution), intent(out) :: solution
    character(len=*), intent(in), optional :: route
    type(hill_solution) :: finer
    type(table_type) :: table
    real(qp) :: size_log, enough
    integer :: i

    enough = wanted
    allocate (solution%log_rho(0))
    do i = 1, size(hill_levels)
      call sample(system, period, hill_levels(i), table)
      ! If three levels find no solution, more angles will not find one either.
      if (i <= 3 .or. (size(solution%log_rho) > 0 .and. solution%change_rho > enough)) then
        call find_exponents(table, route, finer, size_log)
        enough = max(wanted, rounding*size_log)
        finer%change_rho = max(distance(finer%log_rho, solution%log_rho), rounding*size_log)
      else
        finer = solution
      end if
      if (i <= 3 .or. solution%change_x0 > wanted) then
        call find_periodic(table, finer%x0)
        if (allocated(finer%x0) .and. allocated(solution%x0)) then
          finer%change_x0 = maxval(abs(finer%x0 - solution%x0)/table%unit) &
            & /max(maxval(abs(finer%x0)/table%unit), sqrt(tiny(1.0_qp)))
        end if
      else
        finer%x0 = solution%x0
        finer%change_x0 = solution%change_x0
      end if
      finer%points = hill_levels(i)
      solution = finer
      if (solution%change_rho <= enough .and. solution%change_x0 <= wanted) exit
    end do
  end subroutine solve_hill

  !> All ln(rho) of the table; none (size 0) where a route ends nowhere or finds one twice. size_log: |2 pi lambda|.
  subroutine find_exponents(table, route, solution, size_log)
    type(table_type), intent(in) :: table
    character(len=*), intent(in), optional :: route
    type(hill_solution), intent(out) :: solution
    real(qp), intent(out) :: size_log
    type(branches_type) :: branches
    character(len=8) :: routes(2)
    real(dp) :: swing
    integer :: i
    logical :: ok

    size_log = 0
    allocate (solution%log_rho(0))
    call follow_frozen(table, branches, ok)
    routes = ['direct  ', 'followed']
    swing = huge(swing)
    if (ok) swing = maxval(maxval(real(branches%lambda), dim=2) - minval(real(branches%lambda), dim=2) &
      & + maxval(aimag(branches%lambda), dim=2) - minval(aimag(branches%lambda), dim=2))
    if (ok .and. swing > 3) routes = routes(2:1:-1)
    if (present(route)) routes = route
    do i = 1, 2
      if (routes(i) == 'followed' .and. .not. ok) cycle
      solution%route = routes(i)
      call find_all(table, branches, solution, size_log)
      if (size(solution%log_rho) == table%n) return
    end do
  end subroutine find_exponents

  !> A start with its conjugate stands for a conjugate pair of multipliers, or in parametric resonance and where the
  !> averaged system alone oscillates, for two real ones: to first order, what Newton's method finds then lies as far on
  !> one side of the start as the other one on the other.
  subroutine find_all(table, branches, solution, size_log)
    type(table_type), intent(in) :: table
    type(branches_type), intent(in) :: branches
    type(hill_solution), intent(inout) :: solution
    real(qp), intent(out) :: size_log
    complex(dp) :: frozen(table%n), right(table%n, table%n), left(table%n, table%n)
    complex(qp), dimension(table%n, table%points) :: x, start_x
    complex(qp) :: lambda(table%points), start_lambda(table%points), log_rho(2*table%n), one
    real(qp) :: trace
    integer :: i, pin, found
    logical :: ok

    size_log = 0
    found = 0
    call eigenpairs(real(sum(table%a, dim=3)/table%points, dp), frozen, right, left, ok)
    do i = 1, table%n
      if (.not. ok .or. found > table%n) return
      if (solution%route == 'direct') then
        pin = maxloc(abs(right(:, i)), dim=1)
        start_x = spread(right(:, i)/right(pin, i), 2, table%points)
        start_lambda = frozen(i)
      else
        call start_followed(branches%x(:, i, :), pin, start_x)
        start_lambda = branches%lambda(i, :)
      end if
      if (aimag(start_lambda(1)) < 0) cycle
      x = start_x
      lambda = start_lambda
      call iterate(table, solution%route, pin, x, lambda, ok)
      if (.not. ok) then
        ! In the middle of a resonance the start is half way between two solutions, and Newton's method cannot decide.
        x = start_x
        lambda = start_lambda + 0.05_qp
        call iterate(table, solution%route, pin, x, lambda, ok)
      end if
      if (.not. ok) return
      one = 2*pi*sum(lambda)/table%points
      size_log = max(size_log, abs(one))
      found = found + 1
      log_rho(found) = reduced(one)
      if (.not. aimag(start_lambda(1)) > 0) cycle
      found = found + 1
      log_rho(found) = reduced(conjg(one))
      if (abs(sin(aimag(one))) > 1.0e-18_qp*max(1.0_qp, abs(one))) cycle
      x = 2*start_x - x*table%points/sum(x(pin, :))
      lambda = 2*start_lambda - lambda
      x = x/merge(x(pin, 1), (1.0_qp, 0.0_qp), solution%route == 'direct')
      call iterate(table, solution%route, pin, x, lambda, ok)
      log_rho(found) = reduced(2*pi*sum(lambda)/table%points)
    end do
    if (.not. ok .or. found /= table%n) return
    trace = 2*pi*sum([(table%a(i, i, :), i = 1, table%n)])/table%points
    solution%liouville = abs(real(sum(log_rho(:found))) - trace)
    if (solution%liouville > 1.0e-8_qp + 1.0e-20_qp*size_log) return
    call sort(log_rho(:found))
    solution%log_rho = log_rho(:found)
  end subroutine find_all

  !> A followed eigenvector, and which of its components is 1: that which is farthest from 0 all around.
  subroutine start_followed(branch, pin, x)
    complex(dp), intent(in) :: branch(:, :)
    integer, intent(out) :: pin
    complex(qp), intent(out) :: x(:, :)
    integer :: j

    pin = maxloc([(minval(abs(branch(j, :))/maxval(abs(branch), dim=1)), j = 1, size(branch, 1))], dim=1)
    do j = 1, size(branch, 2)
      x(:, j) = branch(:, j)/branch(pin, j)
    end do
  end subroutine start_followed

  !> The imaginary part brought into (-pi, pi].
  pure complex(qp) function reduced(z)
    complex(qp), intent(in) :: z

    reduced = cmplx(real(z), aimag(z) - 2*pi*anint(aimag(z)/(2*pi)), qp)
  end function reduced

  !> x0, unallocated where the system is singular.
  subroutine find_periodic(table, x0)
    type(table_type), intent(in) :: table
    real(qp), allocatable, intent(out) :: x0(:)
    complex(qp) :: x(table%n, table%points), lambda(table%points)
    logical :: ok

    x = 0
    lambda = 0
    if (maxval(abs(table%g)) > 0) then
      call iterate(table, 'periodic', 0, x, lambda, ok)
      if (.not. ok) return
    end if
    x0 = real(x(:, 1))*table%unit
  end subroutine find_periodic

  !> ok: every eigenpair of A comes back to itself after the turn.
  subroutine follow_frozen(table, branches, ok)
    type(table_type), intent(in) :: table
    type(branches_type), intent(out) :: branches
    logical, intent(out) :: ok
    complex(dp) :: lambda(table%n), right(table%n, table%n), left(table%n, table%n)
    real(dp) :: overlap(table%n)
    integer :: i, j, k, to(table%n)

    allocate (branches%lambda(table%n, table%points), branches%x(table%n, table%n, table%points))
    do j = 1, table%points + 1
      k = modulo(j - 1, table%points) + 1
      call eigenpairs(real(table%a(:, :, k), dp), lambda, right, left, ok)
      if (.not. ok) return
      to = [(i, i = 1, table%n)]
      if (j > 1) then
        do i = 1, table%n
          overlap = abs(matmul(branches%x(:, i, j - 1), conjg(left)))/max(abs(sum(conjg(left)*right, dim=1)), tiny(1.0_dp))
          to(i) = maxloc(overlap, dim=1)
        end do
      end if
      ok = all([(any(to == i), i = 1, table%n)])
      if (j > table%points) ok = ok .and. all(abs(lambda(to) - branches%lambda(:, 1)) <= 1.0e-6_dp*maxval(abs(lambda)))
      if (.not. ok .or. j > table%points) return
      branches%lambda(:, j) = lambda(to)
      branches%x(:, :, j) = right(:, to)
    end do
  end subroutine follow_frozen

  !> Maximum distance of two sets of ln(rho), pairing each value with the nearest remaining one; huge if they differ in number
  !> or are empty.
  function distance(a, b)
    complex(qp), intent(in) :: a(:), b(:)
    real(qp) :: distance
    logical :: free(size(a))
    integer :: i, k

    distance = huge(distance)
    if (size(a) == 0 .or. size(a) /= size(b)) return
    free = .true.
    distance = 0
    do i = 1, size(a)
      k = minloc([(abs(reduced(a(i) - b(k))), k = 1, size(b))], dim=1, mask=free)
      free(k) = .false.
      distance = max(distance, abs(reduced(a(i) - b(k))))
    end do
  end function distance

  !> Largest real part first, of like ones (to 1e-15) the larger |imaginary part|, then the positive one.
  subroutine sort(z)
    complex(qp), intent(inout) :: z(:)
    complex(qp) :: swap
    integer :: i, k

    do i = 1, size(z) - 1
      do k = size(z) - 1, i, -1
        if (precedes(z(k + 1), z(k))) then
          swap = z(k); z(k) = z(k + 1); z(k + 1) = swap
        end if
      end do
    end do
  end subroutine sort

  pure function precedes(a, b) result(before)
    complex(qp), intent(in) :: a, b
    logical :: before
    real(qp), parameter :: small = 1.0e-15_qp

    if (abs(real(a) - real(b)) > small) then
      before = real(a) > real(b)
    else if (abs(abs(aimag(a)) - abs(aimag(b))) > small) then
      before = abs(aimag(a)) > abs(aimag(b))
    else
      before = aimag(a) - aimag(b) > small
    end if
  end function precedes

end module reference_hill
