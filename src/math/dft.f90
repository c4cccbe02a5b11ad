!> The discrete Fourier transform of any number of samples.
module gestell_math_dft
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_base_kinds, only: dp, pi
  implicit none (type, external)
  private

  public :: dft

  interface dft
    module procedure transform_one, transform_many
  end interface dft

contains

  !> Discrete Fourier transform y_k = sum over j of x_j exp(-2 pi i j k / n), j and k from 0 to n - 1.
  pure function transform_one(x) result(y)
    complex(dp), contiguous, intent(in) :: x(:)
    complex(dp), allocatable :: y(:)

    y = pack(transform_many(reshape(x, [1, size(x)])), .true.)
  end function transform_one

  !> Discrete Fourier transforms of several functions, shape (functions, n). For n = p1 p2 ... each requires n (p1 + p2 + ...)
  !> multiplications.
  !>
  !> With n = l m there are m transforms X(a, j) of length l, one for each sequence of samples x_a, x_a+m, x_a+2m, ... For each
  !> factor p of m, groups of p transforms are joined into one transform. The results are in Stockham's order, which needs no
  !> sorting (D. A. Bailey, Int. J. Supercomput. Appl. 2, 1988, 82). Each function has m such sequences.
  pure function transform_many(x) result(y)
    complex(dp), contiguous, intent(in) :: x(:, :)
    complex(dp), allocatable, dimension(:, :) :: y, before, spare
    complex(dp) :: roots(0:size(x, 2) - 1)
    real(dp), dimension(size(x, 2)) :: c, s
    integer :: n, l, m, p, i

    n = size(x, 2)
    call cosine_sine([(2 * pi * i / n, i = 0, n - 1)], c, s)
    roots = cmplx(c, -s, dp)
    y = x
    allocate(before, mold=x)
    l = 1
    do while (l < n)
      m = n / l
      ! The smallest prime factor of m
      do p = 2, m
        if (mod(m, p) == 0) exit
      end do
      call move_alloc(y, spare)
      call move_alloc(before, y)
      call move_alloc(spare, before)
      call join_transforms(size(x, 1) * m / p, p, l, roots, before, y)
      l = l * p
    end do
  end function transform_many

  !> Joins groups of p transforms of length l to one transform: y(a, j + l q) = sum over r of w^(r (j + l q)) x(a + m r, j), where w
  !> is a root of unity of order l p (w^(l p) = 1), and m is the number of sequences of all functions. `roots`: powers of a root of
  !> unity whose order is a multiple of l p.
  pure subroutine join_transforms(m, p, l, roots, x, y)
    integer, intent(in) :: m, p, l
    complex(dp), intent(in) :: roots(0:), x(m, 0:p - 1, 0:l - 1)
    complex(dp), intent(out) :: y(m, 0:l - 1, 0:p - 1)
    integer :: j, q, r, turned

    do q = 0, p - 1
      do j = 0, l - 1
        turned = 0
        y(:, j, q) = x(:, 0, j)
        do r = 1, p - 1
          turned = turned + size(roots) / (p * l) * (j + l * q)
          if (turned >= size(roots)) turned = turned - size(roots)
          y(:, j, q) = y(:, j, q) + roots(turned) * x(:, r, j)
        end do
      end do
    end do
  end subroutine join_transforms

end module gestell_math_dft
