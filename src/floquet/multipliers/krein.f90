!> Proves for close eigenvalues of a conservative system that their free vibrations neither grow nor decay. Implements the proof by
!> Krein's form in the section "Undamped machines" of doc/theory.md.
module gestell_floquet_multipliers_krein
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: inverse_factor
  use gestell_math_matrix, only: unit_matrix
  implicit none (type, external)
  private

  public :: krein_signs

contains

  !> Sign of Krein's form H = i Omega on the subspace that belongs to each eigenvalue and to all eigenvalues close to it: 1 or -1 if
  !> H is definite there, otherwise 0.
  !>
  !> The exact map Phi + E satisfies (Phi + E)' Omega (Phi + E) = Omega. If an eigenvalue mu of the exact map does not lie on the
  !> unit circle, or if it is defective, it has an eigenvector v with v* H v = 0. Let |v| = 1. A left unit eigenvector y_j of Phi
  !> satisfies |y_j* v| = |y_j* E v| / |rho_j - mu| <= |E| / gap_j. Let b^2 be the sum of the squares of these bounds over all rho_j
  !> far from mu, and Y the matrix of their y_j. Hence v* Y Y* v <= b^2. If all eigenvalues of H + Y Y* / b or of -H + Y Y* / b
  !> exceed b, v* H v = 0 is impossible. The same holds for x' = P x, with eigenvalues lambda on the imaginary axis.
  function krein_signs(values, radius, left, change, form) result(signs)
    !> `values`: eigenvalues rho of Phi, shape (n). `radius`, shape (n): each exact eigenvalue lies within radius(k) of values(k)
    !> for at least one k.
    complex(dp), intent(in) :: values(:)
    real(dp), intent(in) :: radius(:)
    !> Left unit eigenvectors of Phi as columns, shape (n, n)
    complex(dp), intent(in) :: left(:, :)
    !> Bound on the norm of E, including the rounding errors of `left`
    real(dp), intent(in) :: change
    !> Omega, shape (n, n); not zero
    real(dp), intent(in) :: form(:, :)
    integer :: signs(size(values))
    !> Eigenvalues are far from each other if their distance exceeds `wide` times |E|. b is at least `least`, and the factor
    !> `margin` on it covers rounding errors of Omega and of the factorisation.
    real(dp), parameter :: wide = 1000, least = 1.0e-6_dp, margin = 3
    complex(dp) :: squares(size(values), size(values))
    real(dp) :: both(2 * size(values), 2 * size(values)), gap(size(values)), b
    real(dp), allocatable :: factor(:, :)
    type(error_type), allocatable :: indefinite
    integer, allocatable :: far(:)
    integer :: j, k, n, sense

    n = size(values)
    signs = 0
    do k = 1, n
      gap = abs(values - values(k)) - radius(k)
      far = pack([(j, j = 1, n)], gap > wide * change)
      b = max(norm2(change / gap(far)), least)
      squares = matmul(left(:, far), conjg(transpose(left(:, far)))) / b
      do sense = -1, 1, 2
        ! A Hermitian matrix A + i B is positive definite if and only if the real matrix [A -B; B A] is.
        both(:n, :n) = real(squares) - margin * b * unit_matrix(n)
        both(n + 1:, n + 1:) = both(:n, :n)
        both(n + 1:, :n) = aimag(squares) + sense * form / norm2(form)
        both(:n, n + 1:) = transpose(both(n + 1:, :n))
        call inverse_factor(both, factor, indefinite)
        if (.not. allocated(indefinite)) signs(k) = sense
      end do
    end do
  end function krein_signs

end module gestell_floquet_multipliers_krein
