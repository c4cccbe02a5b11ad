!> A system whose free vibrations are fast against its period, taken apart into groups of modes that hardly couple:
!> superadiabatic diagonalisation (M. V. Berry, Proc. R. Soc. A 414 (1987) 31, doi:10.1098/rspa.1987.0131, for matrices).
!>
!> With the phase t / T as the independent variable, A = T P and x = S y + p
!>
!>     y' = D y + g,   D = S^-1 (A S - S'),   g = S^-1 (A p + T f - p').
!>
!> Smooth periodic S and p are sought for which D has no entries between groups and g vanishes but in the slow group.
!> They exist up to terms that are exponentially small in the distance of the groups, in periods; what is left is measured
!> between the phases where it was made to vanish. The cost does not depend on how fast the vibrations are.
module gestell_floquet_reduction
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_base_lapack, only: balancing, inverse
  use gestell_base_text, only: text
  use gestell_floquet_modes, only: columns_of, follow_modes, modes_type
  use gestell_floquet_trigonometric, only: differentiation, equidistant, interpolation
  use gestell_system_periodic, only: periodic_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: reduce

  type, public :: reduction_type
    !> Number N of phases, odd.
    integer :: angles = 0
    !> Groups of the columns of S and which of these are conjugates of each other, both of shape (n).
    type(modes_type) :: modes
    !> S and D at the phases, shape (n, n, N), in balanced units and per period.
    complex(dp), allocatable :: basis(:, :, :), generator(:, :, :)
    !> p and g at the phases, shape (n, N); unallocated unless asked for.
    complex(dp), allocatable :: response(:, :), forcing(:, :)
    !> What D has between groups and how far it is from its interpolation: the greatest sum over a row, integrated over
    !> the period by the phases and those in the middle between them. The same of g.
    real(dp) :: residual = 0, forcing_residual = 0
    !> Greatest |S| |S^-1|, and greatest size of the terms of which g consists.
    real(dp) :: condition = 1, effort = 0
    !> Evaluations of the coefficients.
    integer :: evaluations = 0
  end type reduction_type

  !> Phases that are tried.
  integer, parameter :: fewest = 33, most = 1025
  !> What counts as roundoff: this many times epsilon |S| |S^-1|, relative to the terms of a residual.
  real(dp), parameter :: rounding = 32

contains

  !> The reduction of `system` whose residual is `tolerance`, relative to p for the forced part, or roundoff. `scale`,
  !> shape (n): units that balance the states. Error: there is none; the message says why.
  subroutine reduce(system, scale, forced, tolerance, reduction, error)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: scale(:), tolerance
    logical, intent(in) :: forced
    type(reduction_type), intent(out) :: reduction
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: a(:, :, :), f(:, :)
    real(dp) :: before, turns
    integer :: n, evaluations

    if (allocated(system%breaks)) then
      call fatal_error(error, "the coefficients jump", failed_computation)
      return
    end if
    n = fewest
    evaluations = 0
    before = huge(before)
    do while (n <= most)
      evaluations = evaluations + 2 * n
      if (2 * n > system%least_steps) then
        call coefficients(system, scale, forced, equidistant(n), a, f, error)
        if (allocated(error)) return
        turns = maxval(abs(a))
        ! What N phases resolve then varies more slowly than groups vibrate against each other.
        call follow_modes(a, pi * n, reduction%modes, error)
        if (allocated(error)) return
        if (all(reduction%modes%group == 0)) then
          call fatal_error(error, "the free vibrations are too slow against the crank", failed_computation)
          return
        end if
        call decouple(a, f, forced, reduction, error)
        if (allocated(error)) return
        call measure(system, scale, forced, reduction, error)
        if (allocated(error)) return
        if (reduction%residual <= max(tolerance, least_residual(reduction) * turns) &
          & .and. reduction%forcing_residual <= max(tolerance, least_residual(reduction)) * reduction%effort) then
          reduction%evaluations = evaluations
          return
        end if
        if (reduction%residual > 0.5_dp * before) exit
        before = reduction%residual
      end if
      n = 2 * n - 1
    end do
    call fatal_error(error, "the modes couple too much, or change too suddenly, for " // text(n) // " phases", &
      & failed_computation)
  end subroutine reduce

  !> A, shape (n, n, phases), and T f, shape (n, phases), in balanced units.
  subroutine coefficients(system, scale, forced, phases, a, f, error)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: scale(:), phases(:)
    logical, intent(in) :: forced
    real(dp), allocatable, intent(out) :: a(:, :, :), f(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: n, k

    n = system%states
    allocate(a(n, n, size(phases)), f(n, size(phases)), source=0.0_dp)
    if (forced) then
      call system%sample(phases, a, f)
    else
      call system%sample(phases, a)
    end if
    do k = 1, size(phases)
      a(:, :, k) = system%period * a(:, :, k) * spread(scale, 1, n) / spread(scale, 2, n)
      f(:, k) = system%period * f(:, k) / scale
    end do
    if (.not. (all(ieee_is_finite(a)) .and. all(ieee_is_finite(f)))) &
      & call fatal_error(error, "the coefficients of the system are not finite", failed_computation)
  end subroutine coefficients

  !> Improves S by S (E + Z) with D_g Z_gh - Z_gh D_h = -D_gh, and p by S z with D_g z_g = -g_g: what is neglected,
  !> Z' and z', is small where the groups are far apart against the change within a period. Ends where it no longer helps.
  subroutine decouple(a, f, forced, reduction, error)
    real(dp), intent(in) :: a(:, :, :), f(:, :)
    logical, intent(in) :: forced
    type(reduction_type), intent(inout) :: reduction
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most_rounds = 60
    complex(dp), allocatable :: s(:, :, :), p(:, :), d(:, :, :), g(:, :)
    real(dp) :: left, before
    integer :: n, m, round, k, failures

    n = size(a, 1)
    m = size(a, 3)
    reduction%angles = m
    s = reduction%modes%basis
    p = 0 * f
    before = huge(before)
    failures = 0
    do round = 1, most_rounds
      call transform(a, f, s, p, matmul(reshape(s, [n * n, m]), transpose(differentiation(m))), &
        & matmul(p, transpose(differentiation(m))), d, g, error)
      if (allocated(error)) return
      left = maxval([(uncoupled_size(d(:, :, k), reduction%modes%group), k = 1, m)])
      if (forced .and. round > 1) left = left + maxval([(fast_size(g(:, k), reduction%modes%group), k = 1, m)]) &
        & / max(maxval(abs(p)), tiny(1.0_dp))
      if (round == 1) left = max(left, 0.1_dp * huge(left))
      if (left < before) then
        reduction%basis = s
        reduction%generator = d
        if (forced) reduction%response = p
        if (forced) reduction%forcing = g
      end if
      if (.not. left < 0.5_dp * before) failures = failures + 1
      if (failures == 3 .or. .not. ieee_is_finite(left)) exit
      before = min(before, left)
      do k = 1, m
        call improve(d(:, :, k), g(:, k), reduction%modes%group, s(:, :, k), p(:, k), error)
        if (allocated(error)) return
      end do
    end do
    call balance(reduction)
  end subroutine decouple

  !> Units of the columns of S that make the rows and columns of D within the groups comparable.
  subroutine balance(reduction)
    type(reduction_type), intent(inout) :: reduction
    real(dp) :: sizes(size(reduction%modes%group), size(reduction%modes%group))
    real(dp) :: unit(size(reduction%modes%group))
    integer :: n, m

    n = size(unit)
    m = reduction%angles
    sizes = maxval(abs(reduction%generator), dim=3)
    where (spread(reduction%modes%group, 1, n) /= spread(reduction%modes%group, 2, n)) sizes = 0
    unit = balancing(sizes)
    reduction%basis = reduction%basis * spread(spread(unit, 1, n), 3, m)
    reduction%generator = reduction%generator * spread(spread(unit, 1, n), 3, m) / spread(spread(unit, 2, n), 3, m)
    if (allocated(reduction%forcing)) reduction%forcing = reduction%forcing / spread(unit, 2, m)
  end subroutine balance

  !> D = S^-1 (A S - S') and g = S^-1 (A p + f - p') at each phase; ds, shape (n n, phases), and dp are the derivatives.
  subroutine transform(a, f, s, p, ds, dp_, d, g, error)
    real(dp), intent(in) :: a(:, :, :), f(:, :)
    complex(dp), intent(in) :: s(:, :, :), p(:, :), ds(:, :), dp_(:, :)
    complex(dp), allocatable, intent(out) :: d(:, :, :), g(:, :)
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: inverted(:, :)
    integer :: n, k

    n = size(a, 1)
    allocate(d(n, n, size(a, 3)), g(n, size(a, 3)))
    do k = 1, size(a, 3)
      call inverse(s(:, :, k), inverted, error)
      if (allocated(error)) return
      d(:, :, k) = matmul(inverted, matmul(a(:, :, k), s(:, :, k)) - reshape(ds(:, k), [n, n]))
      g(:, k) = matmul(inverted, matmul(a(:, :, k), p(:, k)) + f(:, k) - dp_(:, k))
    end do
  end subroutine transform

  !> One step of `decouple` at one phase.
  subroutine improve(d, g, group, s, p, error)
    complex(dp), intent(in) :: d(:, :), g(:)
    integer, intent(in) :: group(:)
    complex(dp), intent(inout) :: s(:, :), p(:)
    type(error_type), allocatable, intent(out) :: error
    complex(dp) :: z(size(group), size(group)), change(size(group))
    complex(dp), allocatable :: inverted(:, :), block(:, :)
    integer :: i, k
    integer, allocatable :: own(:), others(:)

    z = 0
    change = 0
    do i = 0, size(group)
      own = columns_of(group, i)
      if (size(own) == 0) cycle
      do k = 0, size(group)
        others = columns_of(group, k)
        if (i == k .or. size(others) == 0) cycle
        call sylvester(d(own, own), d(others, others), -d(own, others), block, error)
        if (allocated(error)) return
        z(own, others) = block
      end do
      if (i == 0) cycle
      call inverse(d(own, own), inverted, error)
      if (allocated(error)) return
      change(own) = -matmul(inverted, g(own))
    end do
    p = p + matmul(s, change)
    s = s + matmul(s, z)
  end subroutine improve

  !> X of A X - X B = C. Error: A and B share an eigenvalue.
  subroutine sylvester(a, b, c, x, error)
    complex(dp), intent(in) :: a(:, :), b(:, :), c(:, :)
    complex(dp), allocatable, intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    complex(dp) :: operator(size(c), size(c))
    complex(dp), allocatable :: inverted(:, :)
    integer :: i, j, k, n

    n = size(a, 1)
    operator = 0
    do j = 1, size(b, 1)
      operator(n * (j - 1) + 1:n * j, n * (j - 1) + 1:n * j) = a
      do k = 1, size(b, 1)
        do i = 1, n
          operator(n * (j - 1) + i, n * (k - 1) + i) = operator(n * (j - 1) + i, n * (k - 1) + i) - b(k, j)
        end do
      end do
    end do
    call inverse(operator, inverted, error)
    if (.not. allocated(error)) x = reshape(matmul(inverted, reshape(c, [size(c)])), shape(c))
  end subroutine sylvester

  !> What roundoff makes of a residual at the least, relative to the terms of which it consists.
  pure real(dp) function least_residual(reduction)
    type(reduction_type), intent(in) :: reduction

    least_residual = rounding * epsilon(1.0_dp) * reduction%condition
  end function least_residual

  !> The residuals of the reduction.
  subroutine measure(system, scale, forced, reduction, error)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: scale(:)
    logical, intent(in) :: forced
    type(reduction_type), intent(inout) :: reduction
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: a(:, :, :), f(:, :), between(:, :)
    complex(dp), allocatable :: s(:, :, :), p(:, :), d(:, :, :), g(:, :), interpolated(:, :, :), inverted(:, :), slow(:, :)
    integer :: n, m, k

    n = system%states
    m = reduction%angles
    associate (middle => equidistant(m, 0.5_dp))
      call coefficients(system, scale, forced, middle, a, f, error)
      if (allocated(error)) return
      between = transpose(interpolation(m, middle))
    end associate
    s = values_between(reduction%basis)
    p = 0 * f
    if (forced) p = matmul(reduction%response, between)
    call transform(a, f, s, p, matmul(matmul(reshape(reduction%basis, [n * n, m]), transpose(differentiation(m))), between), &
      & derivative_between(), d, g, error)
    if (allocated(error)) return

    interpolated = values_between(reduction%generator)
    reduction%residual = 0
    do k = 1, m
      ! Within the groups D is compared with its interpolation, between them with zero.
      where (spread(reduction%modes%group, 1, n) /= spread(reduction%modes%group, 2, n)) interpolated(:, :, k) = 0
      reduction%residual = reduction%residual + (uncoupled_size(reduction%generator(:, :, k), reduction%modes%group) &
        & + maxval(sum(abs(d(:, :, k) - interpolated(:, :, k)), dim=2))) / m
    end do
    reduction%forcing_residual = 0
    if (forced) then
      slow = matmul(reduction%forcing, between)
      where (spread(reduction%modes%group, 2, m) /= 0) slow = 0
      reduction%forcing_residual = sum([(fast_size(reduction%forcing(:, k), reduction%modes%group) &
        & + maxval(abs(g(:, k) - slow(:, k))), k = 1, m)]) / m
    end if

    reduction%condition = 1
    reduction%effort = 0
    do k = 1, m
      call inverse(s(:, :, k), inverted, error)
      if (allocated(error)) return
      reduction%condition = max(reduction%condition, norm2(abs(s(:, :, k))) * norm2(abs(inverted)))
      if (forced) reduction%effort = max(reduction%effort, norm2(f(:, k)) + maxval(abs(a)) * norm2(abs(p(:, k))))
    end do

  contains

    function values_between(values) result(interpolant)
      complex(dp), intent(in) :: values(:, :, :)
      complex(dp), allocatable :: interpolant(:, :, :)

      allocate(interpolant, source=reshape(matmul(reshape(values, [n * n, m]), between), [n, n, m]))
    end function values_between

    function derivative_between() result(derivative)
      complex(dp) :: derivative(n, m)

      derivative = 0
      if (forced) derivative = matmul(matmul(reduction%response, transpose(differentiation(m))), between)
    end function derivative_between

  end subroutine measure

  !> Greatest sum over a row of the entries between groups.
  pure real(dp) function uncoupled_size(d, group)
    complex(dp), intent(in) :: d(:, :)
    integer, intent(in) :: group(:)

    uncoupled_size = maxval(sum(abs(d), dim=2, mask=spread(group, 1, size(group)) /= spread(group, 2, size(group))))
  end function uncoupled_size

  !> Greatest entry outside of the slow group.
  pure real(dp) function fast_size(g, group)
    complex(dp), intent(in) :: g(:)
    integer, intent(in) :: group(:)

    fast_size = maxval(abs(g), mask=group /= 0)
  end function fast_size

end module gestell_floquet_reduction
