!> Natural frequencies of undamped systems with constant coefficients and gyroscopic forces,
!>
!>     M q'' + G q' + C q = 0,   M, C symmetric, M positive definite, G antisymmetric.
module gestell_system_natural_frequencies
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: eigensystem, symmetric_pencil
  use gestell_math_matrix, only: unit_matrix
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: solve_natural_frequencies

contains

  !> Computes the natural angular frequencies (rad/s), ascending, one for each degree of freedom. A zero means that nothing holds
  !> the system in some direction. A negative number is the growth rate (1/s) of an unstable motion, with reversed sign. Fails if M
  !> is not positive definite or the frequencies overflow.
  subroutine solve_natural_frequencies(m, g, c, frequencies, error)
    !> M, G and C, shape (f, f)
    real(dp), intent(in) :: m(:, :), g(:, :), c(:, :)
    !> Natural angular frequencies (rad/s), shape (f)
    real(dp), allocatable, intent(out) :: frequencies(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: squares(:), vectors(:, :)
    real(dp) :: modal(size(m, 1), size(m, 1))

    if (any(abs(g) > 0)) then
      call symmetric_pencil(c, m, squares, error, vectors)
    else
      call symmetric_pencil(c, m, squares, error)
    end if
    if (allocated(error)) return
    if (.not. all(ieee_is_finite(squares))) then
      call fatal_error(error, "the natural frequencies overflow double precision", failed_computation)
      return
    end if
    ! If C is singular only rounding remains of its zero eigenvalues.
    where (abs(squares) <= 4 * size(squares) * epsilon(1.0_dp) * maxval(abs(squares))) squares = 0
    frequencies = sign(sqrt(abs(squares)), squares)
    if (.not. allocated(vectors)) return
    modal = matmul(transpose(vectors), matmul(g, vectors))
    if (all(squares >= 0)) then
      call solve_with_gyroscopic_forces(frequencies, modal, error)
    else
      call solve_unstable(squares, modal, frequencies, error)
    end if
  end subroutine solve_natural_frequencies

  !> Computes the frequencies of the system with G from the frequencies w of the system without G, shape (n), and stores them in w.
  !> `modal` is G in modal coordinates. With W = diag(w) the states (W q, q') have the antisymmetric matrix S = [0, W; -W, -G]. Its
  !> eigenvalues are +-i times the frequencies. They are computed as the eigenvalues of the symmetric matrix [0, -S; S, 0], which
  !> has each of them twice.
  subroutine solve_with_gyroscopic_forces(w, modal, error)
    real(dp), intent(inout) :: w(:)
    real(dp), intent(in) :: modal(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: s(2 * size(w), 2 * size(w)), twice(4 * size(w), 4 * size(w))
    real(dp), allocatable :: values(:)
    integer :: n, i

    n = size(w)
    s = 0
    s(n + 1:, n + 1:) = (transpose(modal) - modal) / 2
    do i = 1, n
      s(i, n + i) = w(i)
      s(n + i, i) = -w(i)
    end do
    twice = 0
    twice(2 * n + 1:, :2 * n) = s
    twice(:2 * n, 2 * n + 1:) = -s
    call symmetric_pencil(twice, unit_matrix(4 * n), values, error)
    if (allocated(error)) return
    w = values(2 * n + 2::2)
    where (w <= 8 * n * epsilon(1.0_dp) * maxval(w)) w = 0
  end subroutine solve_with_gyroscopic_forces

  !> Computes the frequencies of the system with G if the stiffness is unstable, as eigenvalues of the first-order matrix. A
  !> negative number is a growth rate (1/s) with reversed sign.
  subroutine solve_unstable(squares, modal, w, error)
    real(dp), intent(in) :: squares(:), modal(:, :)
    real(dp), intent(out) :: w(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: p(2 * size(w), 2 * size(w)), next
    complex(dp), allocatable :: values(:), right(:, :), left(:, :)
    integer :: n, i, k, found

    n = size(w)
    p = 0
    p(n + 1:, n + 1:) = -modal
    do i = 1, n
      p(i, n + i) = 1
      p(n + i, i) = -squares(i)
    end do
    call eigensystem(p, values, right, left, error)
    if (allocated(error)) return
    w = 0
    found = 0
    do i = 1, 2 * n
      next = aimag(values(i))
      if (.not. abs(next) > 0) next = -real(values(i))
      if (real(values(i)) < 0 .and. .not. aimag(values(i)) > 0 .or. aimag(values(i)) < 0 .or. found == n) cycle
      k = count(w(:found) <= next)
      w(k + 2:found + 1) = w(k + 1:found)
      w(k + 1) = next
      found = found + 1
    end do
  end subroutine solve_unstable

end module gestell_system_natural_frequencies
