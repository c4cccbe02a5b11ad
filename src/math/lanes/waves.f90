!> Converts values of functions to harmonics and back, with the waves cos k theta and sin k theta at equidistant phases of a turn,
!> eight phases side by side. Orders are below half the number of phases. Even and odd parts are treated separately, so that only
!> half of the turn is needed.
module gestell_math_lanes_waves
  use gestell_base_kinds, only: dp, pi
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_math_lanes, only: lanes
  use gestell_math_lanes_products, only: combine, padded_to_four
  implicit none (type, external)
  private

  public :: waves_at

  !> Values of the waves cos k theta and sin k theta at equidistant phases
  type, public :: waves_type
    !> Half the number of phases, a multiple of `lanes`
    integer :: half = 0
    !> cos k theta_j and sin k theta_j over half the turn, shape (lanes, half, half / lanes); symmetric in k and j
    real(dp), allocatable, private :: cosine(:, :, :), sine(:, :, :)
  contains
    procedure :: values
    procedure :: harmonics
  end type waves_type

contains

  !> Returns the values of the waves at `phases` equidistant phases; this number must be a multiple of 2 `lanes`.
  pure function waves_at(phases) result(waves)
    integer, intent(in) :: phases
    type(waves_type) :: waves
    real(dp), dimension(0:phases - 1) :: c, s
    integer :: j, k, group, at

    waves%half = phases / 2
    allocate(waves%cosine(lanes, waves%half, waves%half / lanes), waves%sine(lanes, waves%half, waves%half / lanes))
    call cosine_sine([(2 * pi * j / phases, j = 0, phases - 1)], c, s)
    do k = 0, waves%half - 1
      at = 0
      do group = 1, waves%half / lanes
        do j = 1, lanes
          waves%cosine(j, k + 1, group) = c(at)
          waves%sine(j, k + 1, group) = s(at)
          at = at + k
          if (at >= phases) at = at - phases
        end do
      end do
    end do
  end function waves_at

  !> Computes the values of functions at equidistant phases from their harmonics. The harmonics are the coefficients of the
  !> cosines of orders 0 ... half - 1, followed by those of the sines. Values and harmonics have the shape (phases, functions).
  pure function values(waves, harmonics)
    class(waves_type), intent(in) :: waves
    real(dp), contiguous, intent(in) :: harmonics(0:, :)
    real(dp) :: values(0:size(harmonics, 1) - 1, size(harmonics, 2))
    real(dp), dimension(0:waves%half - 1, size(harmonics, 2)) :: even, odd
    integer :: half, j

    half = waves%half
    even = products(waves%cosine, harmonics(:half - 1, :))
    odd = products(waves%sine, harmonics(half:, :))
    do j = 1, size(harmonics, 2)
      values(:half - 1, j) = even(:, j) + odd(:, j)
      values(half, j) = sum(harmonics(0:half - 1:2, j)) - sum(harmonics(1:half - 1:2, j))
      values(half + 1:, j) = even(half - 1:1:-1, j) - odd(half - 1:1:-1, j)
    end do
  end function values

  !> Computes harmonics from values; both arrays have the shape (phases, functions). The harmonic of order `half` is omitted.
  pure function harmonics(waves, values)
    class(waves_type), intent(in) :: waves
    real(dp), contiguous, intent(in) :: values(0:, :)
    real(dp) :: harmonics(0:size(values, 1) - 1, size(values, 2))
    real(dp), dimension(0:waves%half - 1, size(values, 2)) :: even, odd
    integer :: n, half, j

    half = waves%half
    n = 2 * half
    even(0, :) = values(0, :)
    odd(0, :) = 0
    do j = 1, size(values, 2)
      even(1:, j) = values(1:half - 1, j) + values(n - 1:half + 1:-1, j)
      odd(1:, j) = values(1:half - 1, j) - values(n - 1:half + 1:-1, j)
    end do
    harmonics(:half - 1, :) = products(waves%cosine, even)
    harmonics(half:, :) = products(waves%sine, odd)
    do j = 1, size(values, 2)
      harmonics(0:half - 1:2, j) = harmonics(0:half - 1:2, j) + values(half, j)
      harmonics(1:half - 1:2, j) = harmonics(1:half - 1:2, j) - values(half, j)
    end do
    harmonics = harmonics / half
    harmonics(0, :) = harmonics(0, :) / 2
  end function harmonics

  !> Product A B, computed for eight rows of A together. `a`: matrix A, shape (lanes, columns of A, rows of A / lanes).
  pure function products(a, b) result(c)
    real(dp), contiguous, intent(in) :: a(:, :, :)
    real(dp), intent(in) :: b(:, :)
    real(dp) :: c(size(b, 1), size(b, 2))
    real(dp) :: terms(size(b, 1), padded_to_four(size(b, 2))), rows(lanes, padded_to_four(size(b, 2)))
    integer :: columns, group, j

    columns = size(b, 2)
    terms(:, :columns) = b
    terms(:, columns + 1:) = 0
    do group = 1, size(a, 3)
      call combine(size(b, 1), size(terms, 2), a(:, :, group), terms, rows)
      do j = 1, columns
        c(lanes * (group - 1) + 1:lanes * group, j) = rows(:, j)
      end do
    end do
  end function products

end module gestell_math_lanes_waves
