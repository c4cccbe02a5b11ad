!> Gauss-Legendre collocation: s stages, order 2 s, stable for every step, symmetric, and for undamped systems symplectic.
module gestell_floquet_gauss
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_lapack, only: factorise, solve_factored
  use gestell_floquet_gauss_accelerations, only: acceleration_maps, fits_lanes
  use gestell_floquet_method, only: evaluation_work, method_type
  use gestell_floquet_tableau, only: gauss_tableau, tableau_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: gauss

  type, extends(method_type), public :: gauss_method
    private
    type(tableau_type) :: tableau
  contains
    procedure :: prepare
    procedure :: phases
    procedure :: maps
    procedure :: work
  end type gauss_method

contains

  !> The method with 2 to 8 stages, named gauss2 to gauss8.
  pure function gauss(stages) result(method)
    integer, intent(in) :: stages
    type(gauss_method) :: method

    method%name = "gauss" // achar(iachar("0") + stages)
    method%order = 2 * stages
    method%stages = stages
    ! (s!)^2 / ((2 s)! (2 s + 1)!), the first term by which the Pade approximation departs from exp
    method%error_constant = gamma(stages + 1.0_dp)**2 / (gamma(2 * stages + 1.0_dp) * gamma(2 * stages + 2.0_dp))
  end function gauss

  pure subroutine prepare(self)
    class(gauss_method), intent(inout) :: self

    self%tableau = gauss_tableau(self%stages)
  end subroutine prepare

  !> The nodes, those of one stage together.
  pure function phases(self, from, to)
    class(gauss_method), intent(in) :: self
    real(dp), intent(in) :: from(:), to(:)
    real(dp), allocatable :: phases(:)
    integer :: i

    allocate(phases(self%stages * size(from)))
    do i = 1, self%stages
      phases(size(from) * (i - 1) + 1:size(from) * i) = from + self%tableau%c(i) * (to - from)
    end do
  end function phases

  pure function work(self, states, second_order)
    class(gauss_method), intent(in) :: self
    integer, intent(in) :: states
    logical, intent(in) :: second_order
    real(dp) :: work

    real(dp) :: operations
    integer :: unknowns

    unknowns = self%stages * merge(states / 2, states, second_order)
    operations = 2 * unknowns**3 / 3.0_dp + unknowns**2 * (2 * states + 1.0_dp)
    if (second_order .and. fits_lanes(self%stages, states / 2)) then
      work = 20 + 2.3_dp * states**2 + self%stages * (evaluation_work(second_order) + 0.3_dp * states**2) &
        & + 0.03_dp * operations
    else
      work = self%stages * (evaluation_work(second_order) + 80 + 8 * states**2) + 0.2_dp * operations
    end if
  end function work

  subroutine maps(self, system, from, to, a, error, b)
    class(gauss_method), intent(in) :: self
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: from(:), to(:)
    real(dp), intent(out) :: a(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(out), optional :: b(:, :)

    select type (system)
    class is (second_order_system)
      call acceleration_maps(self%tableau, system, self%phases(from, to), (to - from) * system%period, a, error, b)
    class default
      call slope_maps(self%tableau, system, self%phases(from, to), (to - from) * system%period, a, error, b)
    end select
  end subroutine maps

  !> x' = P x + f. The slopes k_i at the nodes solve
  !>
  !>     k_i - h P_i sum_j A_ij k_j = P_i x + f_i,
  !>
  !> for all x at once: their columns are those of the n states and of the forcing. Then x + h sum_j b_j k_j.
  subroutine slope_maps(tableau, system, phases, h, a, error, b)
    type(tableau_type), intent(in) :: tableau
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: phases(:), h(:)
    real(dp), intent(out) :: a(:, :, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(out), optional :: b(:, :)
    real(dp), allocatable :: p(:, :, :), f(:, :), left(:, :), right(:, :)
    integer :: pivots(size(tableau%c) * system%states), n, s, i, j, k, at, row, column

    n = system%states
    s = size(tableau%c)
    allocate(p(n, n, size(phases)), f(n, size(phases)), left(n * s, n * s), right(n * s, merge(n + 1, n, present(b))))
    if (present(b)) then
      call system%sample(phases, p, f)
    else
      call system%sample(phases, p)
    end if

    do k = 1, size(h)
      do i = 1, s
        at = size(h) * (i - 1) + k
        row = n * (i - 1)
        do j = 1, s
          column = n * (j - 1)
          left(row + 1:row + n, column + 1:column + n) = -h(k) * tableau%a(i, j) * p(:, :, at)
        end do
        right(row + 1:row + n, :n) = p(:, :, at)
        if (present(b)) right(row + 1:row + n, n + 1) = f(:, at)
      end do
      call add_unit_matrix(left)
      call factorise(left, pivots, error)
      if (allocated(error)) return
      call solve_factored(left, pivots, right)

      a(:, :, k) = 0
      if (present(b)) b(:, k) = 0
      do j = 1, s
        row = n * (j - 1)
        a(:, :, k) = a(:, :, k) + h(k) * tableau%b(j) * right(row + 1:row + n, :n)
        if (present(b)) b(:, k) = b(:, k) + h(k) * tableau%b(j) * right(row + 1:row + n, n + 1)
      end do
      call add_unit_matrix(a(:, :, k))
    end do
  end subroutine slope_maps

  pure subroutine add_unit_matrix(matrix)
    real(dp), intent(inout) :: matrix(:, :)
    integer :: i

    do i = 1, size(matrix, 1)
      matrix(i, i) = matrix(i, i) + 1
    end do
  end subroutine add_unit_matrix

end module gestell_floquet_gauss
