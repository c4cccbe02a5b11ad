!> Known stability borders, computed by methods that share nothing with the library.
module boundary_oracles
  use gestell_base_kinds, only: dp
  use reference_flow, only: flow_map, flow_system
  use reference_linear, only: qp
  implicit none (type, external)
  private

  public :: characteristic_values, mathieu_trace

  type, extends(flow_system) :: mathieu_flow
    real(qp) :: a = 0, q = 0
  contains
    procedure :: evaluate => evaluate_mathieu
  end type mathieu_flow

contains

  !> Mathieu's characteristic values for q: a_0, a_2, a_4, ... and b_2, b_4, ... (period pi, `odd` = .false.) or a_1, a_3,
  !> ... and b_1, b_3, ... (period 2 pi), those below `most`, ascending. They are the eigenvalues of the tridiagonal
  !> matrices of the Fourier coefficients (DLMF 28.4), by bisection of Sturm's sequence in quadruple precision; what 60
  !> coefficients leave out is far below rounding for q <= 25.
  function characteristic_values(q, odd, most) result(values)
    real(dp), intent(in) :: q, most
    logical, intent(in) :: odd
    real(dp), allocatable :: values(:)
    integer, parameter :: n = 60
    real(qp) :: diagonal(n), square(n)
    real(dp), allocatable :: a(:), b(:)
    integer :: k, least

    square = real(q, qp)**2
    if (odd) then
      diagonal = [(real(2 * k - 1, qp)**2, k = 1, n)]
      diagonal(1) = 1 + real(q, qp)
      a = eigenvalues_below(diagonal, square, most)
      diagonal(1) = 1 - real(q, qp)
      b = eigenvalues_below(diagonal, square, most)
    else
      diagonal = [(real(2 * k, qp)**2, k = 1, n)]
      b = eigenvalues_below(diagonal, square, most)
      diagonal = [(real(2 * k - 2, qp)**2, k = 1, n)]
      square(1) = 2 * square(1)
      a = eigenvalues_below(diagonal, square, most)
    end if
    values = [a, b]
    do k = 1, size(values)
      least = k - 1 + minloc(values(k:), dim=1)
      values([k, least]) = values([least, k])
    end do
  end function characteristic_values

  !> Eigenvalues below `most` of the symmetric tridiagonal matrix, given the squares of its off-diagonal entries.
  function eigenvalues_below(diagonal, square, most) result(values)
    real(qp), intent(in) :: diagonal(:), square(:)
    real(dp), intent(in) :: most
    real(dp), allocatable :: values(:)
    real(qp) :: low, high, middle
    integer :: k, halving

    allocate(values(count_below(real(most, qp))))
    do k = 1, size(values)
      low = -1000
      high = most
      do halving = 1, 100
        middle = (low + high) / 2
        if (count_below(middle) >= k) then
          high = middle
        else
          low = middle
        end if
      end do
      values(k) = real(middle, dp)
    end do

  contains

    integer function count_below(x)
      real(qp), intent(in) :: x
      real(qp) :: pivot
      integer :: i

      pivot = diagonal(1) - x
      count_below = merge(1, 0, pivot < 0)
      do i = 2, size(diagonal)
        if (abs(pivot) < 1.0e-30_qp) pivot = 1.0e-30_qp
        pivot = diagonal(i) - x - square(i - 1) / pivot
        if (pivot < 0) count_below = count_below + 1
      end do
    end function count_below

  end function eigenvalues_below

  !> The trace of Phi(pi) of y'' + (a - 2 q cos 2 t) y = 0, by extrapolation in quadruple precision.
  function mathieu_trace(a, q) result(trace)
    real(dp), intent(in) :: a, q
    real(qp) :: trace
    real(qp), parameter :: pi = acos(-1.0_qp)
    type(mathieu_flow) :: system
    real(qp) :: phi(2, 2), particular(2)

    system%n = 2
    system%a = a
    system%q = q
    call flow_map(system, 0.0_qp, pi, 1.0e-24_qp, phi, particular)
    trace = phi(1, 1) + phi(2, 2)
  end function mathieu_trace

  subroutine evaluate_mathieu(self, t, p, f)
    class(mathieu_flow), intent(in) :: self
    real(qp), intent(in) :: t
    real(qp), intent(out) :: p(:, :), f(:)

    p = 0
    p(1, 2) = 1
    p(2, 1) = -(self%a - 2 * self%q * cos(2 * t))
    f = 0
  end subroutine evaluate_mathieu

end module boundary_oracles
