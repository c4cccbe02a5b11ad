!> Compares what the library claims about a machine with the truth, which is known in quadruple precision.
module population_check
  use gestell_base_kinds, only: dp
  use population_library, only: claim_type, turn_points
  use population_turn, only: quantities_of
  use reference_flow, only: flow_path, periodic_start
  use reference_frame, only: frame_of, frame_system
  use reference_linear, only: eigenvalues, qp, solve
  use reference_machine, only: machine_data, period
  implicit none (type, external)
  private

  public :: compare, disagreement, liouville_bound, partners, scaled_norm, truth_of, unpaired

  type, public :: truth_type
    complex(qp), allocatable :: rho(:)
    real(qp), allocatable :: phi(:, :)
    !> Unallocated where no vibration is periodic: a multiplier is 1.
    real(qp), allocatable :: x0(:)
    !> The vibration over the turn, shape (turn_rows, turn_points), with x0.
    real(qp), allocatable :: turn(:, :)
    !> rho_max - 1.
    real(dp) :: excess = 0
  end type truth_type

  !> Ratios of true errors to claimed bounds: of each multiplier, relative, of ln |rho|, and of x0 and Phi in their norms,
  !> relative; and the largest of all ratios.
  type, public :: comparison_type
    real(dp), allocatable :: rho_error(:), rho_bound(:), log_error(:), log_bound(:)
    real(dp) :: x0_error = 0, x0_bound = 0, phi_error = 0, phi_bound = 0
    real(dp) :: rho_used = 0, log_used = 0, x0_used = 0, phi_used = 0
    logical :: verdict_wrong = .false.
  end type comparison_type

  !> Larger than any ratio or bound of interest.
  real(dp), parameter :: hopeless = 1.0e30_dp

contains

  function truth_of(machine) result(truth)
    type(machine_data), intent(in) :: machine
    type(truth_type) :: truth
    ! Multipliers of order m that coincide are then known to 1e-24**(1/m), the library's to 1e-15**(1/m) at best.
    real(qp), parameter :: tolerance = 1.0e-24_qp
    type(frame_system) :: frame
    real(qp), allocatable :: phi(:, :, :), xp(:, :)
    integer :: k

    frame = frame_of(machine)
    allocate(phi(frame%n, frame%n, turn_points), xp(frame%n, turn_points), truth%rho(frame%n))
    call flow_path(frame, 0.0_qp, [(k * period(machine) / turn_points, k = 1, turn_points)], tolerance, phi, xp)
    truth%phi = phi(:, :, turn_points)
    call eigenvalues(truth%phi, truth%rho)
    truth%excess = real(maxval(abs(truth%rho)) - 1, dp)
    call find_start(truth%phi, xp(:, turn_points), truth%x0)
    if (.not. allocated(truth%x0)) return
    do k = 1, turn_points
      xp(:, k) = xp(:, k) + matmul(phi(:, :, k), truth%x0)
    end do
    truth%turn = quantities_of(frame, period(machine), xp)
  end function truth_of

  !> x0, unallocated if errors of Phi of 1e-22 change it by more than 1e-4: in the library's double precision it is then
  !> arbitrary.
  subroutine find_start(phi, xp, x0)
    real(qp), intent(in) :: phi(:, :), xp(:)
    real(qp), allocatable, intent(out) :: x0(:)
    real(qp), parameter :: small = 1.0e-22_qp, change = 1.0e-4_qp
    real(qp) :: unit(size(xp), size(xp)), other(size(xp)), sign_of(size(xp), size(xp))
    integer :: n, i, k

    n = size(xp)
    unit = 0
    do k = 1, n
      unit(k, k) = 1
      sign_of(:, k) = [(1 - 2 * modulo(i * k, 3), i = 1, n)]
    end do
    ! A column of exact zeros is a direction in which nothing holds the frame.
    if (any(maxval(abs(unit - phi), dim=1) <= 0)) return
    x0 = periodic_start(phi, xp)
    other = periodic_start(phi * (1 + small * sign_of), xp)
    if (norm2(other - x0) > change * norm2(x0)) deallocate(x0)
  end subroutine find_start

  !> Compares a claim with the truth. Multipliers are paired so that as many as possible lie within their bounds: the bounds of
  !> close multipliers cover all of them, so they cannot be told apart.
  subroutine compare(claim, truth, undamped, comparison)
    type(claim_type), intent(in) :: claim
    type(truth_type), intent(in) :: truth
    logical, intent(in) :: undamped
    type(comparison_type), intent(out) :: comparison
    real(dp) :: distance(size(claim%rho), size(claim%rho))
    integer :: n, k, partner(size(claim%rho))

    n = size(claim%rho)
    do k = 1, n
      distance(:, k) = real(abs(claim%rho - truth%rho(k)), dp)
    end do
    ! The truth has errors of its own: 1e-28 of Phi, as repeating it with a smaller tolerance showed.
    distance = max(0.0_dp, distance - 1.0e-28_dp * real(norm2(truth%phi), dp))
    partner = partners(used(distance, spread(claim%bound, 2, n)))
    associate (true => truth%rho(partner))
      comparison%rho_error = [(distance(k, partner(k)), k = 1, n)] / real(abs(true), dp)
      comparison%rho_bound = claim%bound / real(abs(true), dp)
      comparison%log_error = real(max(0.0_qp, abs(claim%log_abs - log(abs(true))) - 1.0e-28_qp * norm2(truth%phi) / abs(true)), dp)
      ! |ln (1 - e)| <= e / (1 - e); nothing is claimed about a modulus if the bound covers zero
      comparison%log_bound = merge(claim%error / (1 - min(claim%error, 0.5_dp)), hopeless, claim%error < 0.5_dp)
    end associate
    comparison%rho_used = maxval(used(comparison%rho_error, comparison%rho_bound))
    comparison%log_used = maxval(used(comparison%log_error, comparison%log_bound))

    if (allocated(claim%phi)) then
      comparison%phi_error = scaled_norm(real(claim%phi - truth%phi, dp), claim%scale) / claim%norm
      comparison%phi_bound = claim%phi_error / claim%norm
      comparison%phi_used = used(comparison%phi_error, comparison%phi_bound)
    end if

    ! If free vibrations grow by far, the truth is a product that has lost the small multipliers.
    if (allocated(claim%x0) .and. .not. allocated(truth%x0) .and. norm2(truth%phi) < 1.0e6_qp) comparison%x0_used = hopeless
    if (allocated(claim%x0) .and. allocated(truth%x0)) then
      associate (size_of_x0 => real(norm2(truth%x0 / claim%scale), dp), error => real(abs(claim%x0 - truth%x0), dp))
        comparison%x0_used = maxval(used(error, claim%x0_error))
        if (size_of_x0 > 0) then
          comparison%x0_error = norm2(error / claim%scale) / size_of_x0
          comparison%x0_bound = norm2(claim%x0_error / claim%scale) / size_of_x0
        end if
      end associate
    end if

    comparison%verdict_wrong = (claim%verdict == "stable" .and. (undamped .or. truth%excess >= 0)) &
      & .or. (claim%verdict == "unstable" .and. truth%excess <= 0)
  end subroutine compare

  !> The part of a bound that an error uses; above 1 the bound is exceeded.
  elemental real(dp) function used(error, bound)
    real(dp), intent(in) :: error, bound

    used = 0
    if (error / hopeless > bound) then
      used = hopeless
    else if (error > 0) then
      used = error / bound
    end if
  end function used

  !> partner(i) = j: the pairing of rows and columns whose entries above 1 are fewest, among these the one with the
  !> smallest sum of the others.
  pure function partners(cost) result(best)
    real(dp), intent(in) :: cost(:, :)
    integer :: best(size(cost, 1))
    real(dp), parameter :: beaten = 1000
    integer :: now(size(cost, 1))
    real(dp) :: least

    least = huge(1.0_dp)
    best = 0
    now = 0
    call extend(merge(beaten, cost, cost > 1), 1, 0.0_dp, now, best, least)
  end function partners

  !> Tries all pairings that continue the first rows' partners `now`, unless they already cost more than the best.
  pure recursive subroutine extend(cost, row, so_far, now, best, least)
    real(dp), intent(in) :: cost(:, :), so_far
    integer, intent(in) :: row
    integer, intent(inout) :: now(:), best(:)
    real(dp), intent(inout) :: least
    integer :: k

    if (so_far >= least) return
    if (row > size(now)) then
      least = so_far
      best = now
      return
    end if
    do k = 1, size(now)
      if (any(now(:row - 1) == k)) cycle
      now(row) = k
      call extend(cost, row + 1, so_far + cost(row, k), now, best, least)
    end do
  end subroutine extend

  !> The largest difference between two claims on one machine, in multipliers and x0, relative to the sum of the two bounds.
  real(dp) function disagreement(one, other)
    type(claim_type), intent(in) :: one, other
    real(dp) :: cost(size(one%rho), size(one%rho))
    integer :: k, partner(size(one%rho))

    do k = 1, size(one%rho)
      ! Halves: the sum of two bounds that are huge would overflow.
      cost(:, k) = used(abs(one%rho - other%rho(k)) / 2, one%bound / 2 + other%bound(k) / 2)
    end do
    partner = partners(cost)
    disagreement = maxval([(cost(k, partner(k)), k = 1, size(partner))])
    if (allocated(one%x0) .and. allocated(other%x0)) disagreement = max(disagreement, &
      & maxval(used(abs(one%x0 - other%x0) / 2, one%x0_error / 2 + other%x0_error / 2)))
  end function disagreement

  !> How far the multipliers deviate from pairs rho and 1 / rho, relative to their bounds.
  real(dp) function unpaired(claim)
    type(claim_type), intent(in) :: claim
    real(dp) :: cost(size(claim%rho), size(claim%rho))
    integer :: k, partner(size(claim%rho))

    do k = 1, size(claim%rho)
      ! 1 / mu for any mu within the bound of rho(k)
      if (claim%error(k) < 0.5_dp) then
        cost(:, k) = used(abs(claim%rho - 1 / claim%rho(k)), claim%bound &
          & + claim%error(k) / (1 - claim%error(k)) / abs(claim%rho(k)))
      else
        cost(:, k) = 0
      end if
    end do
    partner = partners(cost)
    unpaired = maxval([(cost(k, partner(k)), k = 1, size(partner))])
  end function unpaired

  !> The possible effect of an error of Phi as large as claimed, and of rounding, on ln |det Phi|: with X = Phi^-1 E, |ln |det
  !> (1 + X)|| <= sqrt(n) |X| / (1 - |X|). Huge if |X| can be 1/2 and if there is no Phi.
  real(dp) function liouville_bound(claim)
    type(claim_type), intent(in) :: claim
    real(qp) :: unit(size(claim%rho), size(claim%rho))
    real(dp) :: x
    integer :: n, k

    n = size(claim%rho)
    liouville_bound = huge(1.0_dp)
    if (.not. allocated(claim%phi) .or. any(abs(claim%rho) <= 0)) return
    unit = 0
    do k = 1, n
      unit(k, k) = 1
    end do
    x = scaled_norm(real(solve(real(claim%phi, qp), unit), dp), claim%scale) &
      & * (claim%phi_error + n * epsilon(1.0_dp) * claim%norm)
    if (x < 0.5_dp) liouville_bound = sqrt(real(n, dp)) * x / (1 - x)
  end function liouville_bound

  !> Frobenius' norm of D^-1 A D, D = diag(scale).
  pure real(dp) function scaled_norm(a, scale)
    real(dp), intent(in) :: a(:, :), scale(:)

    scaled_norm = norm2(a * spread(scale, 1, size(scale)) / spread(scale, 2, size(scale)))
  end function scaled_norm

end module population_check
