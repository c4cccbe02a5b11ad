!> Trigonometric polynomials of several functions at once, with their derivatives, at many phases.
module gestell_math_trigonometric
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_math_dft, only: dft
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: series_through

  !> f_j(theta) = sum over k of cosine(k, j) cos(k theta) + sine(k, j) sin(k theta), k = 0 ... K; shapes (0:K, functions).
  type, public :: series_type
    real(dp), allocatable :: cosine(:, :), sine(:, :)
  contains
    procedure :: values
    procedure :: tail
    procedure :: beyond
    procedure :: trim => trim_series
  end type series_type

contains

  !> The series through `samples`, shape (samples, functions), at theta = 2 pi (i - 1) / size(samples, 1), of all orders below
  !> half their number.
  pure function series_through(samples) result(series)
    real(dp), intent(in) :: samples(:, :)
    type(series_type) :: series
    complex(dp) :: y(size(samples, 1))
    integer :: n, j, highest

    n = size(samples, 1)
    highest = (n - 1) / 2
    allocate(series%cosine(0:highest, size(samples, 2)), series%sine(0:highest, size(samples, 2)))
    do j = 1, size(samples, 2)
      y = dft(cmplx(samples(:, j), 0, dp))
      series%cosine(:, j) = 2 * real(y(:highest + 1)) / n
      series%sine(:, j) = -2 * aimag(y(:highest + 1)) / n
    end do
    series%cosine(0, :) = series%cosine(0, :) / 2
    series%sine(0, :) = 0
  end function series_through

  !> f, df/dtheta and d2f/dtheta2 at theta = 2 pi `phases`, each of shape (phases, functions). cos(k theta) and sin(k theta)
  !> follow from those before. Phases go in blocks that stay in the processor's first cache.
  pure subroutine values(self, phases, f, f_d, f_dd)
    class(series_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: f(:, :), f_d(:, :), f_dd(:, :)
    integer, parameter :: block = 64
    real(dp), dimension(block) :: c1, s1, c, s
    real(dp) :: turned, along, across
    integer :: first, n, k, j, p

    do first = 0, size(phases) - 1, block
      n = min(block, size(phases) - first)
      call cosine_sine(2 * pi * phases(first + 1:first + n), c1(:n), s1(:n))
      c = 1
      s = 0
      do j = 1, size(self%cosine, 2)
        f(first + 1:first + n, j) = self%cosine(0, j)
        f_d(first + 1:first + n, j) = 0
        f_dd(first + 1:first + n, j) = 0
      end do
      do k = 1, ubound(self%cosine, 1)
        do p = 1, n
          turned = c(p) * c1(p) - s(p) * s1(p)
          s(p) = s(p) * c1(p) + c(p) * s1(p)
          c(p) = turned
        end do
        do j = 1, size(self%cosine, 2)
          associate (a => self%cosine(k, j), b => self%sine(k, j))
            do p = 1, n
              along = a * c(p) + b * s(p)
              across = b * c(p) - a * s(p)
              f(first + p, j) = f(first + p, j) + along
              f_d(first + p, j) = f_d(first + p, j) + k * across
              f_dd(first + p, j) = f_dd(first + p, j) - real(k, dp)**2 * along
            end do
          end associate
        end do
      end do
    end do
  end subroutine values

  !> The greatest amplitude in the upper third of the orders, of each function: what the samples do not resolve is about as large.
  pure function tail(self)
    class(series_type), intent(in) :: self
    real(dp) :: tail(size(self%cosine, 2))
    integer :: highest

    highest = ubound(self%cosine, 1)
    associate (first => highest - highest / 3 + 1)
      tail = maxval(hypot(self%cosine(first:, :), self%sine(first:, :)), dim=1)
    end associate
  end function tail

  !> An estimate of the greatest amplitude of the orders that are not there any more, of each function: amplitudes fall from the
  !> last sixth of the orders to those that follow as they do from the sixth before to the last one, but to no less than a tenth.
  pure function beyond(self)
    class(series_type), intent(in) :: self
    real(dp), parameter :: steepest = 0.1_dp
    real(dp) :: beyond(size(self%cosine, 2))
    real(dp), dimension(size(self%cosine, 2)) :: before, last
    integer :: highest

    highest = ubound(self%cosine, 1)
    associate (middle => highest - max(1, highest / 6), first => highest - max(2, highest / 3) + 1)
      before = maxval(hypot(self%cosine(first:middle, :), self%sine(first:middle, :)), dim=1)
      last = maxval(hypot(self%cosine(middle + 1:, :), self%sine(middle + 1:, :)), dim=1)
    end associate
    beyond = last * min(1.0_dp, max(steepest, last / max(before, tiny(before))))
  end function beyond

  !> Leaves out the highest orders, all of whose amplitudes, over `units` of the functions, are below `least`: what is noise in them
  !> would be enlarged by the derivatives.
  pure subroutine trim_series(self, units, least)
    class(series_type), intent(inout) :: self
    real(dp), intent(in) :: units(:), least
    real(dp), allocatable :: shorter(:, :)
    integer :: k

    do k = ubound(self%cosine, 1), 1, -1
      if (any(hypot(self%cosine(k, :), self%sine(k, :)) > least * units)) exit
    end do
    allocate(shorter(0:k, size(units)))
    shorter = self%cosine(:k, :)
    call move_alloc(shorter, self%cosine)
    allocate(shorter(0:k, size(units)))
    shorter = self%sine(:k, :)
    call move_alloc(shorter, self%sine)
  end subroutine trim_series

end module gestell_math_trigonometric
