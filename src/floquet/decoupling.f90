!> The groups of modes of y' = D y + g, made as independent of each other as they can be: the numerics of
!> gestell_floquet_reduction, whose terms are used here.
module gestell_floquet_decoupling
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_base_lapack, only: balancing, inverse
  use gestell_floquet_modes, only: columns_of, modes_type
  use gestell_floquet_trigonometric, only: differentiation
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: decouple, fast_size, transform, uncoupled_size

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
    !> How far the slow group's g is from its interpolation, in the same way, and its greatest size.
    real(dp) :: slow_residual = 0, slow_effort = 0
    !> Greatest |S| |S^-1|, and greatest size of the terms of which g consists.
    real(dp) :: condition = 1, effort = 0
    !> Evaluations of the coefficients.
    integer :: evaluations = 0
  end type reduction_type

  !> The columns of one group.
  type :: group_type
    integer, allocatable :: columns(:)
    logical :: slow = .false.
  end type group_type

contains

  !> Improves S by S (E + Z) with D_g Z_gh - Z_gh D_h = -D_gh, and p by S z with D_g z_g = -g_g: what is neglected,
  !> Z' and z', is small where the groups are far apart against the change within a period. Ends where what is left is
  !> `enough`, relative to the terms of which it consists, or no longer falls.
  subroutine decouple(a, f, forced, enough, reduction, error)
    real(dp), intent(in) :: a(:, :, :), f(:, :), enough
    logical, intent(in) :: forced
    type(reduction_type), intent(inout) :: reduction
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most_rounds = 60
    complex(dp), allocatable :: s(:, :, :), p(:, :), d(:, :, :), g(:, :)
    type(group_type), allocatable :: groups(:)
    real(dp), allocatable :: derivative(:, :)
    real(dp) :: left, before
    integer :: n, m, round, k

    n = size(a, 1)
    m = size(a, 3)
    reduction%angles = m
    call list_groups(reduction%modes, groups)
    allocate(derivative, source=transpose(differentiation(m)))
    s = reduction%modes%basis
    p = 0 * f
    before = huge(before)
    do round = 1, most_rounds
      call transform(a, f, s, p, matmul(reshape(s, [n * n, m]), derivative), matmul(p, derivative), d, g, error)
      if (allocated(error)) return
      left = maxval([(uncoupled_size(d(:, :, k), reduction%modes%group), k = 1, m)])
      if (forced) left = max(left, maxval([(fast_size(g(:, k), reduction%modes%group), k = 1, m)]) * maxval(abs(a)) &
        & / max(maxval(abs(f)) + maxval(abs(a)) * maxval(abs(p)), tiny(1.0_dp)))
      if (left < before) then
        reduction%basis = s
        reduction%generator = d
        if (forced) reduction%response = p
        if (forced) reduction%forcing = g
      end if
      if (left <= enough .or. .not. left < 0.5_dp * before) exit
      before = left
      do k = 1, m
        call improve(d(:, :, k), g(:, k), groups, s(:, :, k), p(:, k), error)
        if (allocated(error)) return
      end do
    end do
    if (allocated(reduction%generator)) then
      call balance(reduction)
    else
      call fatal_error(error, "the coefficients or the forcing leave the range of the numbers", failed_computation)
    end if
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

  !> D = S^-1 (A S - S') and g = S^-1 (A p + f - p') at each phase; ds, shape (n n, phases), and `slope` are S' and p'.
  subroutine transform(a, f, s, p, ds, slope, d, g, error)
    real(dp), intent(in) :: a(:, :, :), f(:, :)
    complex(dp), intent(in) :: s(:, :, :), p(:, :), ds(:, :), slope(:, :)
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
      g(:, k) = matmul(inverted, matmul(a(:, :, k), p(:, k)) + f(:, k) - slope(:, k))
    end do
  end subroutine transform

  !> One step of `decouple` at one phase.
  subroutine improve(d, g, groups, s, p, error)
    complex(dp), intent(in) :: d(:, :), g(:)
    type(group_type), intent(in) :: groups(:)
    complex(dp), intent(inout) :: s(:, :), p(:)
    type(error_type), allocatable, intent(out) :: error
    complex(dp) :: z(size(g), size(g)), change(size(g))
    complex(dp), allocatable :: inverted(:, :), block(:, :)
    integer :: i, k

    z = 0
    change = 0
    do i = 1, size(groups)
      associate (own => groups(i)%columns)
        do k = 1, size(groups)
          if (i == k) cycle
          associate (others => groups(k)%columns)
            call sylvester(d(own, own), d(others, others), -d(own, others), block, error)
            if (allocated(error)) return
            z(own, others) = block
          end associate
        end do
        if (groups(i)%slow) cycle
        call inverse(d(own, own), inverted, error)
        if (allocated(error)) return
        change(own) = -matmul(inverted, g(own))
      end associate
    end do
    p = p + matmul(s, change)
    s = s + matmul(s, z)
  end subroutine improve

  subroutine list_groups(modes, groups)
    type(modes_type), intent(in) :: modes
    type(group_type), allocatable, intent(out) :: groups(:)
    integer :: g, i

    allocate(groups(count([(any(modes%group == g), g = 0, size(modes%group))])))
    i = 0
    do g = 0, size(modes%group)
      if (.not. any(modes%group == g)) cycle
      i = i + 1
      allocate(groups(i)%columns, source=columns_of(modes%group, g))
      groups(i)%slow = g == 0
    end do
  end subroutine list_groups

  !> X of A X - X B = C. Error: A and B share an eigenvalue.
  subroutine sylvester(a, b, c, x, error)
    complex(dp), intent(in) :: a(:, :), b(:, :), c(:, :)
    complex(dp), allocatable, intent(out) :: x(:, :)
    type(error_type), allocatable, intent(out) :: error
    complex(dp) :: operator(size(c), size(c))
    complex(dp), allocatable :: inverted(:, :)
    integer :: i, j, k, n

    n = size(a, 1)
    if (size(c) == 1 .and. abs(a(1, 1) - b(1, 1)) > 0) then
      x = c / (a(1, 1) - b(1, 1))
      return
    end if
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

end module gestell_floquet_decoupling
