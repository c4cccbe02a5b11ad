!> Solves convex quadratic programs whose objective contains maxima:
!>
!>     minimise  1/2 d' B d + sum over groups g of w_g max over b in g of (v_b + a_b' d)
!>     subject to  v_b + a_b' d <= 0  for the branches b of group 0
!>
!> The method is the dual active-set method of Goldfarb and Idnani (Math. Programming 27, 1983, 1-33, doi 10.1007/BF02591962). With
!> B = L L' and y = L' d the minimum is y = -sum lambda_b L^-1 a_b, where lambda >= 0 and sum over b in g of lambda_b = w_g.
!>
!> The method maintains this form of y and a working set of branches with multipliers. The branches of a group that are in the
!> working set have equal values, and each group has at least one such branch. The branch p that exceeds the value of its group most
!> enters the working set. When the multiplier of p grows by t, the multipliers of the working set change by t r_b, and y by t dy:
!>
!>     r = argmin |L^-1 a_p + sum r_b L^-1 a_b|,  sum over b in g of r_b = -1 for the group of p, 0 for others,      (1)
!>     dy = -(L^-1 a_p + sum r_b L^-1 a_b).                                                                          (2)
!>
!> The amount by which p exceeds its group then falls by t |dy|^2. The multiplier of p grows until p no longer exceeds its group or
!> another multiplier falls to zero. In the second case the branch of this multiplier leaves the working set.
module gestell_math_optimum_quadratic_program
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: constrained_least_squares, inverse_factor
  use gestell_math_matrix, only: unit_matrix
  implicit none (type, external)
  private

  public :: solve_quadratic_program

contains

  !> Solves the quadratic program. Fails if B is not positive definite, no d satisfies the constraints, or rounding errors prevent
  !> convergence.
  subroutine solve_quadratic_program(hessian, weight, group, value, slope, d, multiplier, error)
    !> `hessian`: matrix B, shape (n, n), positive definite. `weight`: weights w of the groups 1, 2, ..., not negative. `value`:
    !> values v, shape (branches). `slope`: slopes a, shape (n, branches).
    real(dp), intent(in) :: hessian(:, :), weight(:), value(:), slope(:, :)
    !> Group of each branch; 0 for branches that are constraints. Every group from 1 on must have a branch.
    integer, intent(in) :: group(:)
    !> `d`: solution, shape (n). `multiplier`: multipliers of the branches, shape (branches).
    real(dp), intent(out) :: d(:), multiplier(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: inverse_l(:, :), a(:, :), r(:)
    real(dp) :: y(size(d)), dy(size(d)), model(size(value)), excess(size(value)), rounding(size(value)), length(size(value))
    real(dp) :: of_group(0:size(weight)), full, part, over
    integer, allocatable :: working(:)
    integer :: g, i, k, p, step

    d = 0
    multiplier = 0
    call inverse_factor(hessian, inverse_l, error)
    if (allocated(error)) return
    a = matmul(inverse_l, slope)
    length = norm2(a, 1)
    working = spread(0, 1, size(weight))
    do i = 1, size(value)
      g = group(i)
      if (g == 0) cycle
      if (working(g) > 0) then
        if (.not. length(i) < length(working(g))) cycle
      end if
      working(g) = i
    end do
    multiplier(working) = weight
    do step = 1, 20 * (size(value) + size(d))
      call settle()
      if (allocated(error)) return
      model = value + matmul(y, a)
      rounding = 100 * epsilon(1.0_dp) * (abs(value) + length * norm2(y))
      ! Values of the groups in the linear model: maxima over the groups' branches in the working set; 0 for group 0.
      of_group = -huge(full)
      do i = 1, size(working)
        of_group(group(working(i))) = max(of_group(group(working(i))), model(working(i)))
      end do
      of_group(0) = 0
      excess = model - of_group(group) - rounding
      excess(working) = 0
      p = maxloc(excess, 1)
      if (.not. excess(p) > 0) then
        d = matmul(y, inverse_l)
        return
      end if
      over = excess(p) + rounding(p)
      do
        r = change(p)
        dy = -a(:, p) - matmul(a(:, working), r)
        full = huge(full)
        if (norm2(dy) > 1.0e-11_dp * (length(p) + sum(length(working) * abs(r))) + sqrt(tiny(full))) full = over / sum(dy**2)
        k = 0
        part = full
        do i = 1, size(working)
          if (r(i) > -1.0e-13_dp) cycle
          if (-multiplier(working(i)) / r(i) >= part) cycle
          k = i
          part = -multiplier(working(i)) / r(i)
        end do
        if (allocated(error) .or. .not. part < huge(part)) then
          if (.not. allocated(error)) call fatal_error(error, "no step satisfies all constraints", failed_computation)
          d = matmul(y, inverse_l)
          return
        end if
        multiplier(working) = max(0.0_dp, multiplier(working) + part * r)
        multiplier(p) = multiplier(p) + part
        y = y + part * dy
        over = over - part * sum(dy**2)
        if (k == 0) exit
        multiplier(working(k)) = 0
        working = [working(:k - 1), working(k + 1:)]
        if (group(p) > 0 .and. .not. any(group(working) == group(p))) exit
      end do
      working = [working, p]
    end do
    d = matmul(y, inverse_l)
    call fatal_error(error, "the quadratic program did not converge", failed_computation)

  contains

    !> Recomputes the scaled step y from the working set alone, to remove rounding errors, which grow with the sizes of the
    !> multipliers. The new y minimises |y|^2 / 2 + sum over g of w_g phi_g, where w_g and phi_g are weight and value of group g,
    !> under two conditions: all branches of a group that are in the working set have equal values, and those of group 0 have the
    !> value zero.
    subroutine settle()
      real(dp) :: gradient(size(d)), differences(size(working), size(d)), gaps(size(working))
      integer :: first(0:size(weight)), j, rows

      gradient = 0
      first = 0
      rows = 0
      do j = 1, size(working)
        associate (b => working(j), base => first(group(working(j))))
          if (group(b) > 0 .and. base == 0) then
            gradient = gradient - weight(group(b)) * a(:, b)
            base = b
            cycle
          end if
          rows = rows + 1
          differences(rows, :) = a(:, b)
          gaps(rows) = -value(b)
          if (base == 0) cycle
          differences(rows, :) = a(:, b) - a(:, base)
          gaps(rows) = value(base) - value(b)
        end associate
      end do
      call constrained_least_squares(unit_matrix(size(d)), gradient, differences(:rows, :), gaps(:rows), y, error)
    end subroutine settle

    !> Computes the vector r of equation (1) in the module's header for the branch `entering`. If a branch of the working set is
    !> the only one of its group there, its element of r is known: -1 for the group of `entering`, 0 for other groups. Least squares
    !> therefore need only the remaining branches; these are at most twice as many as the parameters.
    function change(entering) result(ratio)
      integer, intent(in) :: entering
      real(dp) :: ratio(size(working)), total(0:size(weight))
      real(dp), allocatable :: member(:, :), found(:)
      integer, allocatable :: shared(:), groups(:)
      integer :: members(0:size(weight)), row(size(weight)), j

      total = 0
      if (group(entering) > 0) total(group(entering)) = -1
      members = [2, (count(group(working) == j), j = 1, size(weight))]
      shared = pack([(j, j = 1, size(working))], members(group(working)) > 1)
      ratio = merge(total(group(working)), 0.0_dp, members(group(working)) == 1)
      if (size(shared) == 0) return
      groups = pack([(j, j = 1, size(weight))], members(1:) > 1)
      row(groups) = [(j, j = 1, size(groups))]
      allocate(member(size(groups), size(shared)), source=0.0_dp)
      allocate(found(size(shared)))
      do j = 1, size(shared)
        if (group(working(shared(j))) > 0) member(row(group(working(shared(j)))), j) = 1
      end do
      call constrained_least_squares(a(:, working(shared)), -a(:, entering) - matmul(a(:, working), ratio), member, &
        & total(groups), found, error)
      ratio(shared) = found
    end function change

  end subroutine solve_quadratic_program

end module gestell_math_optimum_quadratic_program
