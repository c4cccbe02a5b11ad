!> Finds counterweights on several bodies that together minimise the shaking force (doc/theory.md, "Balancing").
!>
!> The unknown of each body is the complex unbalance u of its counterweight. A counterweight of mass m adds u (exp(i theta))'' + m
!> P'' to the force, where theta is the angle of the body and P the position of its pivot. If the pivots are at rest, P'' = 0, so
!> the unbalances solve a linear least-squares problem.
!>
!> Counterweights on bodies with a pivot may leave a force above rounding error, for example with a slider-crank. In this case
!> bodies without a pivot (floating bodies) get counterweights too. Their term m P'' depends on |u|, because the mass m is |u|
!> divided by the radius. This term is found by iteration, which converges in a few steps if P moves with other bodies. In the
!> least-squares problem each body has one column. If the column of a body is a combination of earlier columns, as for the coupler
!> of a four-bar linkage, the body gets no counterweight. Complete balance is possible if every link is connected to the ground by
!> a chain of turning pairs (R. S. Berkof, G. G. Lowen, J. Eng. Ind. 91, 1969, 21-26; F. R. Tepper, G. G. Lowen, J. Eng. Ind. 94,
!> 1972, 789-796).
!>
!> In space the bodies of one shaft lie side by side, and many sets of counterweights have the same effect on the force. Among
!> these sets the one with the smallest moment is chosen; if several remain, the one with the smallest sum of squared unbalances.
!> Therefore several bodies share an unbalance, and the outermost planes balance a couple.
module gestell_study_balance_complete
  use gestell_base_kinds, only: dp
  use gestell_study_balance, only: rigid_ground_type, residual_rows
  use gestell_study_balance_bodies, only: counterweight_type
  use gestell_study_balance_least_squares, only: least_squares_type
  implicit none (type, external)
  private

  public :: balance_force

  !> Results of `balance_force`. `balanced_already`: the force vanishes without counterweights. `balanced`: the counterweights make
  !> the force vanish. `not_balanced`: complete balance is impossible, and the counterweights on pivoted bodies minimise the force.
  !> `no_pivots`: no body rotates about a pivot.
  integer, parameter, public :: balanced_already = 1, balanced = 2, not_balanced = 3, no_pivots = 4

contains

  !> Finds the counterweights that make the shaking force vanish. If complete balance is impossible, `weights` holds the
  !> counterweights on pivoted bodies that minimise the mean square of the force. In space the solution with the smallest moment is
  !> chosen.
  subroutine balance_force(rigid, weights, state, pivoted)
    !> Shaking of the linkage on rigid ground, and the effects of counterweights
    type(rigid_ground_type), intent(in) :: rigid
    type(counterweight_type), allocatable, intent(out) :: weights(:)
    !> Result of the search: `balanced_already`, `balanced`, `not_balanced` or `no_pivots`
    integer, intent(out) :: state
    !> If `weights` contains counterweights on bodies without a pivot: the best counterweights on pivoted bodies alone. Otherwise
    !> empty
    type(counterweight_type), allocatable, intent(out), optional :: pivoted(:)
    type(counterweight_type), allocatable :: floating(:)

    allocate(weights(0))
    if (present(pivoted)) allocate(pivoted(0))
    state = balanced_already
    if (.not. in_space(rigid) .and. force_rms(rigid, weights) <= rigid%rounding(1)) return
    call solve(rigid, .false., weights)
    if (force_rms(rigid, weights) <= rigid%rounding(1)) then
      state = merge(balanced, balanced_already, size(weights) > 0)
      return
    end if
    state = balanced
    call solve(rigid, .true., floating)
    if (force_rms(rigid, floating) <= rigid%rounding(1)) then
      if (present(pivoted)) pivoted = weights
      call move_alloc(floating, weights)
      return
    end if
    state = merge(not_balanced, no_pivots, size(weights) > 0)
  end subroutine balance_force

  !> Rms of the shaking force that remains after the counterweights are added, divided by the square of the speed (kg m).
  pure real(dp) function force_rms(rigid, weights)
    type(rigid_ground_type), intent(in) :: rigid
    type(counterweight_type), intent(in) :: weights(:)
    real(dp) :: rows(size(rigid%found, 1), size(rigid%found, 2))
    integer :: k

    rows = residual_rows(rigid, weights)
    force_rms = norm2(rows(pack([(k, k = 1, size(rows, 1))], rigid%kinds() == 1), :)) / sqrt(real(size(rows, 2), dp))
  end function force_rms

  !> True if the moment has three components, as for a frame in space. Counterweights in different planes then change the moment
  !> independently of the force.
  pure logical function in_space(rigid)
    type(rigid_ground_type), intent(in) :: rigid

    in_space = count(rigid%kinds() == 2) > 1
  end function in_space

  !> Finds the counterweights on bodies with a pivot and, if `all` is true, also on bodies without a pivot.
  pure subroutine solve(rigid, all, weights)
    type(rigid_ground_type), intent(in) :: rigid
    logical, intent(in) :: all
    type(counterweight_type), allocatable, intent(out) :: weights(:)
    integer, parameter :: most = 100
    !> `settled`: the iteration ends when no unbalance changes by more than this fraction of the largest unbalance. `rounding`: an
    !> unbalance below this fraction of the largest one is set to zero.
    real(dp), parameter :: settled = 1.0e-15_dp, rounding = 1.0e-10_dp
    complex(dp), allocatable :: columns(:, :), u(:), before(:)
    real(dp), allocatable :: effects(:, :, :)
    type(least_squares_type) :: least
    integer, allocatable :: order(:), kinds(:)
    logical :: pivoted(size(rigid%bodies))
    integer :: k, n

    kinds = rigid%kinds()
    associate (bodies => rigid%bodies)
      pivoted = [(bodies(k)%pivoted, k = 1, size(bodies))]
      order = pack([(k, k = 1, size(bodies))], pivoted)
      if (all) order = [order, pack([(k, k = 1, size(bodies))], .not. pivoted)]
      allocate(columns(size(rigid%found, 2), size(order)), u(size(order)))
      allocate(effects(size(rigid%found, 1), size(rigid%found, 2), 2 * size(order)))
      do k = 1, size(order)
        columns(:, k) = force_of(bodies(order(k))%effect(:, :, 2))
        effects(:, :, 2 * k - 1:2 * k) = bodies(order(k))%effect(:, :, 2:3)
      end do
      if (in_space(rigid)) call least%prepare(effects, kinds)
      u = 0
      do n = 1, most
        before = u
        if (in_space(rigid)) then
          call least%solve(-shaking_with(abs(before)), u)
        else
          call least_squares(columns, -force_of(shaking_with(abs(before))), u)
        end if
        if (maxval(abs(u - before)) <= settled * maxval(abs(u)) .or. .not. all) exit
      end do
      u = merge(u, cmplx(0, 0, dp), abs(u) > rounding * maxval(abs(u)))
      if (in_space(rigid)) u = merge(u, cmplx(0, 0, dp), [(is_significant(bodies(order(k))%effect(:, :, 2), abs(u(k))), k = 1, &
        & size(u))])
    end associate
    weights = [(counterweight_type(order(k), abs(u(k)), atan2(aimag(u(k)), real(u(k), dp))), k = 1, size(order))]
    weights = pack(weights, weights%unbalance > 0)

  contains

    !> Shaking forces and moments that do not depend on the angles of the counterweights, shape (rows, angles). They are those of
    !> the linkage, plus the constant part of each counterweight's effect times its unbalance.
    pure function shaking_with(unbalances) result(rows)
      real(dp), intent(in) :: unbalances(:)
      real(dp) :: rows(size(rigid%found, 1), size(rigid%found, 2))
      integer :: j

      rows = rigid%found
      do j = 1, size(unbalances)
        rows = rows + unbalances(j) * rigid%bodies(order(j))%effect(:, :, 1)
      end do
    end function shaking_with

    !> True if the counterweight changes at least one row of `effect` (a component of force or moment) by more than that row's
    !> rounding error.
    pure logical function is_significant(effect, unbalance)
      real(dp), intent(in) :: effect(:, :), unbalance
      integer :: j

      is_significant = any([(unbalance * norm2(effect(j, :)) > rigid%rounding(kinds(j)) * sqrt(real(size(effect, 2), dp)), &
        & j = 1, size(effect, 1))])
    end function is_significant

  end subroutine solve

  !> Force in the plane as the complex number x + i y, for all crank angles.
  pure function force_of(rows) result(force)
    real(dp), intent(in) :: rows(:, :)
    complex(dp) :: force(size(rows, 2))

    force = cmplx(rows(1, :), rows(2, :), dp)
  end function force_of

  !> Solves the overdetermined system `columns` u = `target_values` by least squares. Gram-Schmidt orthogonalisation is applied
  !> twice to each column. An element of u is zero if its column is a combination of earlier columns.
  pure subroutine least_squares(columns, target_values, u)
    complex(dp), intent(in) :: columns(:, :), target_values(:)
    complex(dp), intent(out) :: u(:)
    real(dp), parameter :: dependent = 1.0e-8_dp
    complex(dp) :: q(size(columns, 1), size(columns, 2)), r(size(columns, 2), size(columns, 2)), left(size(target_values)), along
    logical :: used(size(columns, 2))
    real(dp) :: length
    integer :: j, k, pass

    r = 0
    left = target_values
    u = 0
    do k = 1, size(columns, 2)
      q(:, k) = columns(:, k)
      do pass = 1, 2
        do j = 1, k - 1
          if (.not. used(j)) cycle
          along = dot_product(q(:, j), q(:, k))
          r(j, k) = r(j, k) + along
          q(:, k) = q(:, k) - along * q(:, j)
        end do
      end do
      length = norm2(abs(q(:, k)))
      used(k) = length > dependent * norm2(abs(columns(:, k)))
      if (.not. used(k)) cycle
      r(k, k) = length
      q(:, k) = q(:, k) / length
      u(k) = dot_product(q(:, k), left)
      left = left - u(k) * q(:, k)
    end do
    do k = size(columns, 2), 1, -1
      if (.not. used(k)) cycle
      u(k) = u(k) / r(k, k)
      do j = 1, k - 1
        if (used(j)) u(j) = u(j) - r(j, k) * u(k)
      end do
    end do
  end subroutine least_squares

end module gestell_study_balance_complete
