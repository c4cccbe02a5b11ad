!> Logarithms z = ln(rho) of the multipliers along a line: values and slopes at nodes, and cubic interpolation between the nodes.
!>
!> z is a smooth function of the parameter except where two multipliers meet. If they meet well inside the interval between two
!> nodes, gestell_task_boundary_line_meeting computes what happens there.
module gestell_task_boundary_line_exponents
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_task_boundary_line, only: line_type, probe_line, probe_type
  implicit none (type, external)
  private

  public :: connect, solve_node, wrapped

  !> A node: the system at a position t on a line, and the derivatives (slopes) of the logarithms of its multipliers with respect
  !> to t, shape (number of multipliers).
  type, public :: node_type
    type(probe_type) :: at
    complex(dp), allocatable :: slope(:)
  end type node_type

  !> Interval between two nodes. In it a cubic curve represents the logarithm of each multiplier.
  type, public :: stretch_type
    type(probe_type) :: ends(2)
    !> `z`: logarithms of the multipliers at both ends, in corresponding order, with continuous imaginary parts. `change`: slopes
    !> of these logarithms times the length of the interval. Both arrays have shape (number of multipliers, 2).
    complex(dp), allocatable :: z(:, :), change(:, :)
    !> For each multiplier: the change of its logarithm over the interval minus the change predicted by the slopes at both ends.
    complex(dp), allocatable :: mismatch(:)
    !> Error bounds of the logarithms `z` at both ends, shape (number of multipliers, 2).
    real(dp), allocatable :: noise(:, :)
    !> Signs of Krein's form at both ends, shape (number of multipliers, 2); see `probe_type`.
    real(dp), allocatable :: krein(:, :)
    !> `ambiguous`: true if the multipliers at both ends could be assigned to each other in another way that fits nearly as well.
    !> `rough`: true if the cubic curves do not represent the logarithms of the multipliers accurately enough.
    logical :: ambiguous = .false., rough = .false.
  contains
    procedure :: length, at => z_at
  end type stretch_type

contains

  !> Solves the system at the position `t`, and computes the derivatives of the logarithms of its multipliers by a difference
  !> quotient. The second system of the quotient lies between the `ends` of the searched range. Fails if the parameters are
  !> invalid.
  subroutine solve_node(line, t, ends, node, error)
    type(line_type), intent(in) :: line
    real(dp), intent(in) :: t, ends(2)
    type(node_type), intent(out) :: node
    type(error_type), allocatable, intent(out) :: error
    !> Step of the difference quotient, relative to the line. If a vibration makes a thousand oscillations per period, this step
    !> changes its phase by about a thousandth of a radian.
    real(dp), parameter :: part = 1.0e-7_dp
    type(probe_type) :: neighbour
    logical, allocatable :: free(:)
    real(dp) :: change
    integer :: i, k

    call probe_line(line, t, node%at, error)
    if (allocated(error) .or. node%at%missing()) return
    allocate(node%slope(size(node%at%z)), source=(0.0_dp, 0.0_dp))
    change = part * (ends(2) - ends(1))
    if (t > sum(ends) / 2) change = -change
    call probe_line(line, t + change, neighbour, error)
    if (allocated(error) .or. neighbour%missing()) return
    if (size(neighbour%z) /= size(node%slope)) return
    allocate(free(size(node%slope)), source=.true.)
    do i = 1, size(free)
      k = minloc(abs(wrapped(neighbour%z - node%at%z(i))), dim=1, mask=free)
      free(k) = .false.
      node%slope(i) = wrapped(neighbour%z(k) - node%at%z(i)) / (neighbour%t - t)
    end do
  end subroutine solve_node

  !> Connects node `l` with the following node `r`. Each multiplier of `l` is assigned to the multiplier of `r` that fits its slope
  !> best; the best fits are assigned first.
  pure subroutine connect(l, r, stretch)
    type(node_type), intent(in) :: l, r
    type(stretch_type), intent(out) :: stretch
    !> `weight`: weight of a deviation of the slope relative to a deviation of the logarithm. `apart`: the assignment is
    !> unambiguous if every exchange of two multipliers increases their deviations at least by this factor. Multipliers closer to
    !> each other than `similar` may be exchanged.
    real(dp), parameter :: weight = 0.5_dp, apart = 3, similar = 0.05_dp
    real(dp), dimension(size(l%slope), size(l%slope)) :: difference
    logical, dimension(size(l%slope), size(l%slope)) :: free
    integer :: order(size(l%slope)), place(2), i, k, n

    n = size(l%slope)
    stretch%ends = [l%at, r%at]
    associate (h => r%at%t - l%at%t, numbers => [(i, i = 1, n)])
      do k = 1, n
        difference(:, k) = size_of(mismatch_of(numbers, k, h), l%at%z) + weight * size_of(h * (r%slope(k) - l%slope), l%at%z)
      end do
      free = .true.
      do i = 1, n
        place = minloc(difference, mask=free)
        order(place(1)) = place(2)
        free(place(1), :) = .false.
        free(:, place(2)) = .false.
      end do
      do i = 1, n
        do k = i + 1, n
          if (min(abs(wrapped(l%at%z(i) - l%at%z(k))), abs(wrapped(r%at%z(order(i)) - r%at%z(order(k))))) < similar) cycle
          if (difference(i, order(k)) + difference(k, order(i)) < apart * (difference(i, order(i)) + difference(k, &
            & order(k)))) stretch%ambiguous = .true.
        end do
      end do
      stretch%mismatch = mismatch_of(numbers, order, h)
      stretch%z = reshape([l%at%z, l%at%z + h * (l%slope + r%slope(order)) / 2 + stretch%mismatch], [n, 2])
      stretch%change = reshape(h * [l%slope, r%slope(order)], [n, 2])
    end associate
    stretch%noise = reshape([l%at%noise, r%at%noise(order)], [n, 2])
    stretch%krein = reshape([l%at%krein, r%at%krein(order)], [n, 2])
    stretch%rough = .not. is_smooth(stretch)

  contains

    elemental complex(dp) function mismatch_of(i, k, h) result(mismatch)
      integer, intent(in) :: i, k
      real(dp), intent(in) :: h

      mismatch = wrapped(r%at%z(k) - l%at%z(i) - h * (l%slope(i) + r%slope(k)) / 2)
    end function mismatch_of

    !> Magnitude of the deviation `mismatch` of the logarithm `z` of a multiplier. For a strongly decaying multiplier, the real
    !> part of the deviation is divided by the decay, abs(real(z)).
    elemental real(dp) function size_of(mismatch, z)
      complex(dp), intent(in) :: mismatch, z

      size_of = abs(aimag(mismatch)) + abs(real(mismatch)) / max(1.0_dp, abs(real(z)))
    end function size_of

  end subroutine connect

  !> Length of the interval, as a difference of positions t on the line.
  pure real(dp) function length(self)
    class(stretch_type), intent(in) :: self

    length = self%ends(2)%t - self%ends(1)%t
  end function length

  !> Logarithms z of all multipliers at the relative position `x` in the interval (0 to 1), by cubic interpolation; shape (number
  !> of multipliers).
  pure function z_at(self, x) result(z)
    class(stretch_type), intent(in) :: self
    real(dp), intent(in) :: x
    complex(dp) :: z(size(self%mismatch))

    z = (1 + 2 * x) * (1 - x)**2 * self%z(:, 1) + x**2 * (3 - 2 * x) * self%z(:, 2) &
      & + x * (1 - x)**2 * self%change(:, 1) - x**2 * (1 - x) * self%change(:, 2)
  end function z_at

  !> True if the cubic curves represent the logarithms of the multipliers accurately enough. This requires that no phase makes a
  !> whole turn unnoticed, that multipliers meet where their curves meet, and that no growth rate changes its sign twice.
  pure logical function is_smooth(self)
    type(stretch_type), intent(in) :: self
    !> Limits for each multiplier rho. `bend`: maximum difference between the slopes of the phase of rho at the two ends, times the
    !> length of the interval (rad). `near`: maximum modulus of `mismatch`. If the decay -ln |rho| is positive at both ends, its
    !> smaller value is added to `bend`, and `part` times this value is added to `near`.
    real(dp), parameter :: bend = 3, near = 0.02_dp, part = 0.25_dp
    !> The sign of a growth rate counts as certain if the rate exceeds its error by this factor: `safety` inside the interval,
    !> `clear` at its ends.
    real(dp), parameter :: safety = 2, clear = 10
    integer, parameter :: samples = 8
    complex(dp) :: z(size(self%mismatch), 0:samples)
    integer :: i, k

    associate (decay => max(-max(real(self%z(:, 1)), real(self%z(:, 2))), 0.0_dp))
      is_smooth = .not. self%ambiguous .and. all(abs(aimag(self%change(:, 2) - self%change(:, 1))) <= bend + decay) &
        & .and. all(abs(self%mismatch) <= near + part * decay)
    end associate
    do k = 0, samples
      z(:, k) = self%at(real(k, dp) / samples)
      is_smooth = is_smooth .and. .not. three_meet(z(:, k), abs(self%mismatch))
    end do
    do i = 1, size(z, 1)
      if (.not. is_smooth) return
      if (meets_another(z, i)) cycle
      ! If the growth rate has the same sign at both ends, it must not change its sign between them.
      associate (ends => real(z(i, [0, samples])), sign_of_both => sign(1.0_dp, real(z(i, 0))))
        if (any(abs(ends) <= clear * self%noise(i, :)) .or. ((ends(1) > 0) .neqv. (ends(2) > 0))) cycle
        is_smooth = .not. any(sign_of_both * real(z(i, 1:samples - 1)) - safety * abs(real(self%mismatch(i))) < 0)
      end associate
    end do
  end function is_smooth

  !> True if the phase of multiplier `i` comes close to the phase of another multiplier. The growth of these two multipliers is
  !> then determined by the search for meetings.
  pure logical function meets_another(z, i)
    complex(dp), intent(in) :: z(:, :)
    integer, intent(in) :: i
    !> Limits for the difference between two phases (rad). The phases meet if their difference falls below `near`. They do not
    !> meet if the difference stays below `locked` throughout the interval.
    real(dp), parameter :: near = 0.02_dp, locked = 1.0e-9_dp
    real(dp) :: apart(size(z, 2))
    integer :: k

    meets_another = .false.
    do k = 1, size(z, 1)
      apart = abs(aimag(wrapped(z(i, :) - z(k, :))))
      if (k /= i) meets_another = meets_another .or. (minval(apart) <= near .and. maxval(apart) > locked)
    end do
  end function meets_another

  !> True if three multipliers come so close that they may meet within the errors of their curves.
  pure logical function three_meet(z, mismatch)
    complex(dp), intent(in) :: z(:)
    real(dp), intent(in) :: mismatch(:)
    real(dp), parameter :: safety = 6, known = 1.0e-5_dp
    integer :: i

    three_meet = any([(count(abs(wrapped(z - z(i))) <= safety * (mismatch + mismatch(i)) &
      & .and. mismatch + mismatch(i) > known) > 2, i = 1, size(z))])
  end function three_meet

  !> The logarithm `z` with a multiple of 2 pi i added, so that its imaginary part lies between -pi and pi.
  elemental complex(dp) function wrapped(z)
    complex(dp), intent(in) :: z

    wrapped = cmplx(real(z), aimag(z) - 2 * pi * anint(aimag(z) / (2 * pi)), dp)
  end function wrapped

end module gestell_task_boundary_line_exponents
