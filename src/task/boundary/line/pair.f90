!> Pairs of multipliers that meet. Their logarithms are z = mean +- sqrt(delta).
!>
!> Where the phases of two multipliers meet, the two logarithms are not smooth functions of the position on the line. But mean and
!> delta are smooth, because they depend only on the plane that both modes span. Outside a tongue (region of instability) delta is
!> negative: -(detuning/2)**2, where the detuning is the difference of the two phases. Inside a tongue delta is positive. The
!> larger growth is the real part of mean + sqrt(delta).
module gestell_task_boundary_line_pair
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: failed
  use gestell_base_kinds, only: dp, pi
  use gestell_task_boundary_line_exponents, only: stretch_type, wrapped
  use gestell_task_boundary_line, only: line_type, probe_line, probe_type
  implicit none (type, external)
  private

  public :: fit_pair, place_of_max_growth

  !> Identifies two multipliers that meet in an interval between nodes.
  type, public :: pair_indices_type
    !> `i`, `k`: indices of the two multipliers. `turns`: number of turns by which the phase of multiplier `i` exceeds that of
    !> multiplier `k` where they meet.
    integer :: i = 0, k = 0, turns = 0
  end type pair_indices_type

  !> A pair of multipliers in an interval between two nodes. It can be computed at any position of the line.
  type, public :: pair_path_type
    type(line_type), pointer :: line => null()
    type(stretch_type), pointer :: stretch => null()
    type(pair_indices_type) :: name
  contains
    procedure :: solve
  end type pair_path_type

  !> A pair of multipliers at one position of the line.
  type, public :: pair_type
    real(dp) :: t = 0
    !> `mean`: mean of the two logarithms z. `delta`: square of half the difference of the two logarithms
    complex(dp) :: mean = 0, delta = 0
    !> `growth`: the larger real part of the two logarithms. `noise`: the larger error of the two logarithms.
    real(dp) :: growth = 0, noise = 0
    !> The system at this position, with all its multipliers
    type(probe_type) :: at
  contains
    procedure :: decay_margin
  end type pair_type

  !> Quadratic polynomials that represent `mean` and `delta` of a pair near the position `origin`. The elements are the
  !> coefficients of 1, x and x**2, where x is the position minus `origin`.
  type, public :: pair_fit_type
    real(dp) :: origin = 0
    complex(dp) :: mean(0:2) = 0, delta(0:2) = 0
  contains
    procedure :: growth => growth_of_fit
  end type pair_fit_type

contains

  !> Solves the system at the position `t` and selects the pair: the two multipliers closest to those predicted by the cubic
  !> curves of the interval. Fails if the parameters are invalid.
  subroutine solve(self, t, pair, error)
    class(pair_path_type), intent(in) :: self
    real(dp), intent(in) :: t
    type(pair_type), intent(out) :: pair
    type(error_type), allocatable, intent(out) :: error
    complex(dp) :: expected(size(self%stretch%mismatch)), one, other
    real(dp) :: difference, smallest
    integer :: i, k, best(2)

    pair%t = t
    call probe_line(self%line, t, pair%at, error)
    if (allocated(error) .or. pair%at%missing()) return
    if (size(pair%at%z) /= size(expected)) then
      pair%at%verdict = failed
      return
    end if
    expected = self%stretch%at((t - self%stretch%ends(1)%t) / self%stretch%length())
    one = expected(self%name%i)
    other = expected(self%name%k) + cmplx(0.0_dp, 2 * pi * self%name%turns, dp)
    smallest = huge(smallest)
    best = 1
    associate (z => pair%at%z)
      do i = 1, size(z)
        do k = 1, size(z)
          if (i == k) cycle
          difference = abs(wrapped(z(i) - one)) + abs(wrapped(z(k) - other))
          if (difference >= smallest) cycle
          smallest = difference
          best = [i, k]
        end do
      end do
      one = one + wrapped(z(best(1)) - one)
      other = other + wrapped(z(best(2)) - other)
      pair%noise = maxval(pair%at%noise(best))
    end associate
    pair%mean = (one + other) / 2
    pair%delta = ((one - other) / 2)**2
    pair%growth = max(real(one), real(other))
  end subroutine solve

  !> A function that is positive if both multipliers decay, otherwise negative. It is smooth except where both multipliers grow.
  !> It results from the condition that a multiplier lies on the unit circle: (i y - mean)**2 = delta with real y.
  elemental real(dp) function decay_margin(self)
    class(pair_type), intent(in) :: self
    real(dp), parameter :: clear = 10

    decay_margin = real(self%mean)**2 - real(self%delta)
    if (abs(real(self%mean)) > clear * self%noise) decay_margin = decay_margin - (aimag(self%delta) / (2 * real(self%mean)))**2
    if (real(self%mean) > clear * self%noise) decay_margin = -abs(decay_margin)
  end function decay_margin

  !> Fits parabolas to `mean` and `delta` of a pair of multipliers that is known at three positions.
  pure function fit_pair(three) result(fit)
    type(pair_type), intent(in) :: three(3)
    type(pair_fit_type) :: fit

    fit%origin = three(2)%t
    fit%mean = parabola(three%t - fit%origin, (three%mean))
    fit%delta = parabola(three%t - fit%origin, (three%delta))
  end function fit_pair

  !> Coefficients of the parabola through three points. The second point is at x = 0.
  pure function parabola(x, y) result(c)
    real(dp), intent(in) :: x(:)
    complex(dp), intent(in) :: y(:)
    complex(dp) :: c(0:2)

    associate (first => (y(1) - y(2)) / x(1), last => (y(3) - y(2)) / x(3))
      c(0) = y(2)
      c(2) = (last - first) / (x(3) - x(1))
      c(1) = first - c(2) * x(1)
    end associate
  end function parabola

  !> Growth of the pair at the position `t` according to the fit: the larger real part of the two logarithms.
  elemental real(dp) function growth_of_fit(self, t) result(growth)
    class(pair_fit_type), intent(in) :: self
    real(dp), intent(in) :: t

    associate (x => t - self%origin)
      growth = real(self%mean(0) + x * (self%mean(1) + x * self%mean(2))) &
        & + real(sqrt(self%delta(0) + x * (self%delta(1) + x * self%delta(2))))
    end associate
  end function growth_of_fit

  !> Position between `low` and `high` at which the growth of the fit is largest, by golden-section search. Only a neighbourhood
  !> of the vertex of the parabola for delta is searched; its width depends on the value of delta at the vertex.
  pure real(dp) function place_of_max_growth(fit, low, high) result(t)
    type(pair_fit_type), intent(in) :: fit
    real(dp), intent(in) :: low, high
    integer, parameter :: samples = 20, sections = 60
    real(dp), parameter :: golden = 0.6180339887498949_dp, reach = 4
    real(dp) :: a, b, x(samples + 1), vertex, width
    integer :: i, k

    a = low
    b = high
    if (abs(fit%delta(2)) > 0) then
      vertex = -real(fit%delta(1) * conjg(fit%delta(2))) / (2 * abs(fit%delta(2))**2)
      width = reach * sqrt(abs(fit%delta(0) + vertex * (fit%delta(1) + vertex * fit%delta(2))) / abs(fit%delta(2)))
      a = min(max(low, fit%origin + vertex - width), high)
      b = max(min(high, fit%origin + vertex + width), low)
    end if
    x = [(a + (b - a) * i / samples, i = 0, samples)]
    i = maxloc(fit%growth(x), dim=1)
    a = x(max(i - 1, 1))
    b = x(min(i + 1, size(x)))
    do k = 1, sections
      if (fit%growth(b - golden * (b - a)) > fit%growth(a + golden * (b - a))) then
        b = a + golden * (b - a)
      else
        a = b - golden * (b - a)
      end if
    end do
    t = (a + b) / 2
  end function place_of_max_growth

end module gestell_task_boundary_line_pair
