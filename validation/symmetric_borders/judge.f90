!> Verdicts of an engine by its own equations: shooting by Runge and Kutta's method, multipliers of differences.
module engine_judge
  use gestell_base_kinds, only: dp, pi
  use symmetric_engine, only: engine_type, sums
  implicit none (type, external)
  private

  public :: scan, natural_frequencies

  !> Steps of a turn, and of Newton's method.
  integer, parameter :: steps = 480, most = 20
  integer, parameter :: states = 6

  interface
    subroutine dgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: dp
      implicit none (type, external)
      integer, intent(in) :: n, nrhs, lda, ldb
      real(dp), intent(inout) :: a(lda, *), b(ldb, *)
      integer, intent(out) :: ipiv(*), info
    end subroutine dgesv

    subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
      import :: dp
      implicit none (type, external)
      character, intent(in) :: jobvl, jobvr
      integer, intent(in) :: n, lda, ldvl, ldvr, lwork
      real(dp), intent(inout) :: a(lda, *)
      real(dp), intent(out) :: wr(*), wi(*), vl(ldvl, *), vr(ldvr, *), work(*)
      integer, intent(out) :: info
    end subroutine dgeev
  end interface

contains

  !> ln(rho_max) of the vibration at each of `speeds` (1/min), from the one before where that is `joined`; `known`: whether there is
  !> one.
  subroutine scan(engine, speeds, growth, known, joined)
    type(engine_type), intent(in) :: engine
    real(dp), intent(in) :: speeds(:)
    real(dp), intent(out) :: growth(:)
    logical, intent(out) :: known(:), joined(:)
    real(dp), parameter :: far = 0.2_dp
    real(dp) :: table(sums, 0:2 * steps), x(states), before(states), last(states)
    integer :: i, k

    do k = 0, 2 * steps
      table(:, k) = engine%sums_at(pi * k / steps)
    end do
    last = 0
    before = 0
    known = .false.
    joined = .false.
    do i = 1, size(speeds)
      x = last
      if (joined(max(i - 1, 1))) x = 2 * last - before
      call settle(engine, table, speeds(i) * pi / 30, x, growth(i), known(i))
      if (.not. known(i)) then
        x = 0
        call settle(engine, table, speeds(i) * pi / 30, x, growth(i), known(i))
      else if (i > 1) then
        joined(i) = known(max(i - 1, 1)) .and. norm2(x - last) < far * norm2(x)
      end if
      before = last
      last = merge(x, 0.0_dp, known(i))
    end do
  end subroutine scan

  !> Newton's method for the state at phi = 0 of a periodic motion.
  subroutine settle(engine, table, speed, x, growth, found)
    type(engine_type), intent(in) :: engine
    real(dp), intent(in) :: table(:, 0:), speed
    real(dp), intent(inout) :: x(:)
    real(dp), intent(out) :: growth
    logical, intent(out) :: found
    real(dp), parameter :: close = 1.0e-10_dp, furthest = 1.5_dp, slow = 0.3_dp
    real(dp) :: phi(states, states), a(states, states), b(states, 1), y(states), step, last
    integer :: pivots(states), info, k, i

    found = .false.
    growth = 0
    step = 0
    last = 0
    do k = 1, most
      ! The derivatives of an earlier step do as long as steps become much smaller.
      if (k == 1 .or. step > slow * last) then
        call turn(engine, table, speed, x, y, phi)
      else
        y = after(engine, table, speed, x)
      end if
      a = -phi
      do i = 1, states
        a(i, i) = a(i, i) + 1
      end do
      b(:, 1) = y - x
      call dgesv(states, 1, a, states, pivots, b, states, info)
      if (info /= 0) return
      x = x + b(:, 1)
      last = step
      step = norm2(b(:, 1))
      if (.not. abs(x(3)) < furthest) return
      found = step <= close * max(norm2(x), 1.0e-6_dp)
      if (found) exit
    end do
    if (.not. found) return
    call turn(engine, table, speed, x, y, phi)
    growth = log(radius(phi))
  end subroutine settle

  !> The state after a turn, and its derivatives by the state before, by central differences.
  subroutine turn(engine, table, speed, x, y, phi)
    type(engine_type), intent(in) :: engine
    real(dp), intent(in) :: table(:, 0:), speed, x(:)
    real(dp), intent(out) :: y(:), phi(:, :)
    real(dp), parameter :: small = 1.0e-6_dp
    real(dp) :: h(states), up(states), down(states)
    integer :: i

    y = after(engine, table, speed, x)
    do i = 1, states
      h = 0
      h(i) = small * merge(1.0_dp, speed, i <= 3)
      up = after(engine, table, speed, x + h)
      down = after(engine, table, speed, x - h)
      phi(:, i) = (up - down) / (2 * h(i))
    end do
  end subroutine turn

  !> The state after a turn by Runge and Kutta's method of fourth order.
  function after(engine, table, speed, x0) result(x)
    type(engine_type), intent(in) :: engine
    real(dp), intent(in) :: table(:, 0:), speed, x0(:)
    real(dp) :: x(states), k1(states), k2(states), k3(states), k4(states), h
    integer :: i

    x = x0
    h = 2 * pi / abs(speed) / steps
    do i = 0, steps - 1
      k1 = rates(table(:, 2 * i), x)
      k2 = rates(table(:, 2 * i + 1), x + h / 2 * k1)
      k3 = rates(table(:, 2 * i + 1), x + h / 2 * k2)
      k4 = rates(table(:, 2 * i + 2), x + h * k3)
      x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    end do

  contains

    pure function rates(s, y) result(y_d)
      real(dp), intent(in) :: s(:), y(:)
      real(dp) :: y_d(states)

      y_d(:3) = y(4:)
      y_d(4:) = engine%accelerations(s, speed, y)
    end function rates

  end function after

  !> The largest modulus of the eigenvalues.
  real(dp) function radius(phi)
    real(dp), intent(in) :: phi(:, :)
    real(dp) :: a(states, states), re(states), im(states), none(1, 1), nothing(1, 1), work(64 * states)
    integer :: info

    a = phi
    call dgeev("N", "N", states, a, states, re, im, none, 1, nothing, 1, work, size(work), info)
    radius = maxval(hypot(re, im))
  end function radius

  !> The natural frequencies (Hz) of small vibrations with the sums of `phi` = 0, ascending: only to choose a range of speeds by.
  function natural_frequencies(engine) result(f)
    type(engine_type), intent(in) :: engine
    real(dp) :: f(3)
    real(dp) :: s(sums), k(3, 3), a(states, states), re(states), im(states), none(1, 1), nothing(1, 1), work(64 * states), x(states)
    integer :: i, info, n

    s = engine%sums_at(0.0_dp)
    s(3:6) = 0
    s(8:) = 0
    do i = 1, 3
      x = 0
      x(i) = 1.0e-6_dp
      k(:, i) = engine%accelerations(s, 0.0_dp, x) / 1.0e-6_dp
    end do
    a = 0
    a(:3, 4:) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
    a(4:, :3) = k
    call dgeev("N", "N", states, a, states, re, im, none, 1, nothing, 1, work, size(work), info)
    n = 0
    f = 0
    do i = 1, states
      if (im(i) > 0 .and. n < 3) then
        n = n + 1
        f(n) = im(i) / (2 * pi)
      end if
    end do
    do i = 1, 2
      n = i - 1 + minloc(f(i:), dim=1)
      f([i, n]) = f([n, i])
    end do
  end function natural_frequencies

end module engine_judge
