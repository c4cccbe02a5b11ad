!> Multipliers and characteristic exponents with their error bounds, and the verdict on stability.
module gestell_floquet_multipliers
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: stable, undamped, undecided, unstable, verdict_length, verdict_type
  use gestell_math_lapack, only: eigensystem
  use gestell_math_matrix, only: balanced
  use gestell_floquet_multipliers_small_eigensystem, only: small_eigensystem
  use gestell_floquet_period_monodromy, only: monodromy_type
  use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_value
  implicit none (type, external)
  private

  public :: append, arrange, disc_bounds, lie_on_circle, multiplier, no_multipliers, pair_conjugates, prove_undamped, &
    & set_multipliers, solve_multipliers

  !> Of all multipliers, largest modulus first, conjugate pairs adjacent, +im first. All shapes (n).
  type, public :: multipliers_type
    complex(dp), allocatable :: rho(:)
    !> ln |rho|, also where rho over- or underflows.
    real(dp), allocatable :: log_abs(:)
    !> Argument in (-pi, pi].
    real(dp), allocatable :: arg(:)
    !> Characteristic exponents ln(rho) / T, imaginary parts up to multiples of 2 pi / T.
    complex(dp), allocatable :: exponent(:)
    !> Bound on the error of rho relative to |rho|; from 1 on rho is lost: no digit of it is significant. At most 1e300;
    !> `nothing_known` where there is no bound at all.
    real(dp), allocatable :: error(:)
    !> Condition of the eigenvalue in balanced units: 1 at best.
    real(dp), allocatable :: condition(:)
    !> Eigenvectors y_k of (19), states at t = 0 in the model's units, unit columns; shape (n, n).
    complex(dp), allocatable :: vectors(:, :)
    !> Whether |rho| = 1 is proved (`prove_undamped`), shape (n); not allocated where no proof was tried.
    logical, allocatable :: on_circle(:)
  contains
    procedure :: judge
    procedure :: verdict
    procedure :: lost
    procedure :: unknown
  end type multipliers_type

  !> The error of a multiplier of which nothing is known: above every bound.
  real(dp), parameter, public :: nothing_known = 1.0e308_dp

  !> ln 1e300.
  real(dp), parameter :: most = 300 * log(10.0_dp)

contains

  !> The multipliers of `monodromy`; with `vectors` the eigenvectors too.
  !> Errors: `monodromy` was not solved; LAPACK found no eigenvalues.
  subroutine solve_multipliers(monodromy, vectors, multipliers, error)
    type(monodromy_type), intent(in) :: monodromy
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
    real(dp), allocatable :: phi(:, :), changes(:, :, :)
    integer :: n, k

    if (.not. allocated(monodromy%phi)) then
      call fatal_error(error, "multipliers are those of a system that solve_monodromy has solved", invalid_input)
      return
    end if
    n = size(monodromy%scale)
    phi = balanced(monodromy%phi, monodromy%scale)
    call small_eigensystem(phi, rho, right, left)
    if (.not. allocated(rho)) call eigensystem(phi, rho, right, left, error)
    if (allocated(error)) return
    ! They are the eigenvalues of a matrix that differs by roundoff.
    associate (d => monodromy%scale, rounding => n * epsilon(1.0_dp) * monodromy%norm)
      if (allocated(monodromy%phi_change)) then
        allocate(changes, mold=monodromy%phi_change)
        do k = 1, size(changes, 3)
          changes(:, :, k) = balanced(monodromy%phi_change(:, :, k), d)
        end do
        call set_multipliers(rho, right, left, monodromy%roundoff + rounding, multipliers, changes)
      else
        call set_multipliers(rho, right, left, monodromy%error + rounding, multipliers)
      end if
    end associate
    if (.not. monodromy%known) multipliers%error = nothing_known
    multipliers%exponent = multipliers%exponent / monodromy%period
    if (vectors) multipliers%vectors = right * spread(monodromy%scale, 2, n)
    call arrange(multipliers)
  end subroutine solve_multipliers

  !> Multipliers, for the period 1, from the eigenvalues `rho` of a matrix whose error is at most `perturbation` in norm, plus
  !> one of the matrices `changes`, and its right and left eigenvectors, unit columns.
  !>
  !> Error bounds: with eigenvectors x_j and left ones y_k, |y_k| = |x_j| = 1, the eigenvalues of Phi + E lie in the
  !> union of the discs |mu - rho_k| <= sum over j of f_kj, f_kj = |y_k* E x_j| / |y_k* x_k| (Gershgorin's theorem for
  !> X^-1 (Phi + E) X), where the part of E that is known in norm only gives |E| / |y_k* x_k| at most. Discs that touch
  !> share their eigenvalues, so a bound then reaches across all of them: it holds for close and defective ones. The disc of
  !> one that lies apart shrinks (`apart`).
  pure subroutine set_multipliers(rho, right, left, perturbation, multipliers, changes)
    complex(dp), intent(in) :: rho(:), right(:, :), left(:, :)
    real(dp), intent(in) :: perturbation
    type(multipliers_type), intent(out) :: multipliers
    real(dp), intent(in), optional :: changes(:, :, :)
    !> What is left out of the changes' direction, which is that of their leading order, where nothing else makes a disc wider.
    real(dp), parameter :: of_direction = 2
    real(dp), dimension(size(rho), size(rho)) :: f, doubted
    complex(dp) :: along(size(rho), size(rho))
    real(dp), dimension(size(rho)) :: radius, rows, modulus
    integer :: n, k

    n = size(rho)
    multipliers%rho = rho
    allocate(multipliers%condition(n), multipliers%exponent(n))
    do k = 1, n
      multipliers%condition(k) = 1 / max(abs(dot_product(left(:, k), right(:, k))), epsilon(1.0_dp)**2)
      if (aimag(rho(k)) < 0 .and. abs(rho(k) - conjg(rho(max(k - 1, 1)))) <= 0) then
        ! the second of a conjugate pair; the first number is not its own conjugate where it lies below the real axis
        multipliers%exponent(k) = conjg(multipliers%exponent(k - 1))
      else
        ! The logarithm of a complex number is the same for the same number, that of its conjugate the conjugate. Those of real
        ! numbers, and atan2, may differ in the last digit from one element of an array to the next, where they are vectorised.
        multipliers%exponent(k) = log(merge(rho(k), cmplx(tiny(1.0_dp), 0.0_dp, dp), abs(rho(k)) > 0))
      end if
    end do
    multipliers%log_abs = real(multipliers%exponent)
    multipliers%arg = aimag(multipliers%exponent)
    f = 0
    if (present(changes)) then
      ! Squares: what vanishes among them is less than `perturbation`.
      do k = 1, size(changes, 3)
        along = matmul(conjg(transpose(left)), matmul(changes(:, :, k), right))
        f = max(f, along%re**2 + along%im**2)
      end do
      f = sqrt(f)
    end if
    doubted = (of_direction * f + perturbation) * spread(multipliers%condition, 2, n)
    f = (f + perturbation) * spread(multipliers%condition, 2, n)
    rows = sum(doubted, dim=2)
    radius = sum(f, dim=2)
    radius = [(min(radius(k), apart(rho, doubted, rows, k)), k = 1, n)]
    modulus = max(abs(rho), tiny(1.0_dp))
    radius = exp(min(log(max(radius, tiny(1.0_dp))) - log(modulus), most))
    multipliers%error = disc_bounds(multipliers%exponent, radius)
  end subroutine set_multipliers

  !> The radius of the disc of the k-th eigenvalue where those of all others grow as far as they may without touching it: a
  !> similarity that shrinks the off-diagonal elements f_kj of its row by alpha enlarges those of its column, f_ik, by 1/alpha
  !> (J. H. Wilkinson, The Algebraic Eigenvalue Problem, 1965, chapter 2), so that they count to second order only. Without such
  !> an alpha: huge. `rows`: the sums of each row of f.
  pure real(dp) function apart(rho, f, rows, k) result(radius)
    complex(dp), intent(in) :: rho(:)
    real(dp), intent(in) :: f(:, :), rows(:)
    integer, intent(in) :: k
    real(dp) :: alpha, room
    integer :: i

    radius = huge(radius)
    alpha = 0
    do i = 1, size(rho)
      if (i == k) cycle
      room = abs(rho(i) - rho(k)) - (rows(i) - f(i, k)) - rows(k)
      if (.not. f(i, k) < room) return
      alpha = max(alpha, f(i, k) / room)
    end do
    radius = f(k, k) + alpha * (rows(k) - f(k, k))
  end function apart

  !> None at all, to begin with; with eigenvectors of n states if n > 0.
  pure function no_multipliers(n) result(multipliers)
    integer, intent(in) :: n
    type(multipliers_type) :: multipliers

    allocate(multipliers%rho(0), multipliers%exponent(0))
    allocate(multipliers%log_abs(0), multipliers%arg(0), multipliers%error(0), multipliers%condition(0))
    if (n > 0) allocate(multipliers%vectors(n, 0))
  end function no_multipliers

  !> Adds `more` at the end.
  pure subroutine append(all, more)
    type(multipliers_type), intent(inout) :: all
    type(multipliers_type), intent(in) :: more

    if (allocated(all%on_circle) .or. allocated(more%on_circle)) all%on_circle = [circle_of(all), circle_of(more)]
    all%rho = [all%rho, more%rho]
    all%log_abs = [all%log_abs, more%log_abs]
    all%arg = [all%arg, more%arg]
    all%exponent = [all%exponent, more%exponent]
    all%error = [all%error, more%error]
    all%condition = [all%condition, more%condition]
    if (allocated(more%vectors)) all%vectors = reshape([all%vectors, more%vectors], &
      & [size(more%vectors, 1), size(all%vectors, 2) + size(more%vectors, 2)])
  end subroutine append

  !> `on_circle`, false where it is not allocated.
  pure function circle_of(multipliers) result(on_circle)
    type(multipliers_type), intent(in) :: multipliers
    logical :: on_circle(size(multipliers%rho))

    on_circle = .false.
    if (allocated(multipliers%on_circle)) on_circle = multipliers%on_circle
  end function circle_of

  !> Largest modulus first, unit eigenvectors whose largest component is real and positive.
  pure subroutine arrange(multipliers)
    type(multipliers_type), intent(inout) :: multipliers
    complex(dp) :: largest
    integer :: order(size(multipliers%rho)), k

    order = by_modulus(multipliers%log_abs, multipliers%arg)
    multipliers%rho = multipliers%rho(order)
    multipliers%condition = multipliers%condition(order)
    multipliers%log_abs = multipliers%log_abs(order)
    multipliers%arg = multipliers%arg(order)
    multipliers%exponent = multipliers%exponent(order)
    multipliers%error = multipliers%error(order)
    if (allocated(multipliers%on_circle)) multipliers%on_circle = multipliers%on_circle(order)
    if (.not. allocated(multipliers%vectors)) return
    multipliers%vectors = multipliers%vectors(:, order)
    do k = 1, size(order)
      associate (vector => multipliers%vectors(:, k))
        vector = vector / maxval(abs(vector))
        largest = vector(maxloc(abs(vector), dim=1))
        vector = vector * (abs(largest) / largest)
        vector = vector / norm2(abs(vector))
      end associate
    end do
  end subroutine arrange

  !> Makes the multipliers of a real system real, or conjugate in pairs, to the last digit if they were computed in complex numbers
  !> and are so to rounding only. `exponent` must hold ln(rho); the other numbers follow from it. Each is paired with the one that
  !> is nearest to its conjugate, whose true value lies in the conjugate of its own disc.
  pure subroutine pair_conjugates(multipliers)
    type(multipliers_type), intent(inout) :: multipliers
    logical :: paired(size(multipliers%exponent))
    complex(dp) :: difference(size(multipliers%exponent))
    integer :: k, partner

    paired = .false.
    do k = 1, size(paired)
      if (paired(k)) cycle
      associate (z => multipliers%exponent)
        difference = z - conjg(z(k))
        difference = cmplx(real(difference), aimag(difference) - 2 * pi * anint(aimag(difference) / (2 * pi)), dp)
        partner = minloc(abs(difference), dim=1, mask=.not. paired)
        if (partner == k) then
          z(k) = cmplx(real(z(k)), pi * abs(anint(aimag(z(k)) / pi)), dp)
        else
          z(partner) = conjg(z(k))
          multipliers%error([k, partner]) = maxval(multipliers%error([k, partner]))
          if (allocated(multipliers%vectors)) multipliers%vectors(:, partner) = conjg(multipliers%vectors(:, k))
        end if
      end associate
      paired([k, partner]) = .true.
    end do
    multipliers%log_abs = real(multipliers%exponent)
    multipliers%arg = aimag(multipliers%exponent)
    multipliers%rho = multiplier(multipliers%exponent)
  end subroutine pair_conjugates

  !> Bounds on the distance between rho(k) and the true multiplier, relative to |rho(k)|: the radius of its disc, or where discs
  !> touch, the reach of all discs that hang together with it. `z` = ln rho; radii relative to |rho|.
  pure function disc_bounds(z, radius) result(bound)
    complex(dp), intent(in) :: z(:)
    real(dp), intent(in) :: radius(:)
    real(dp) :: bound(size(z))
    integer :: cluster(size(z)), i, k

    cluster = [(k, k = 1, size(z))]
    do i = 1, size(z)
      do k = 1, size(z)
        ! In units of the greater one of the two.
        if (real(z(i)) > real(z(k)) .or. cluster(i) == cluster(k)) cycle
        if (distance(z(i), z(k)) > radius(i) * exp(real(z(i) - z(k))) + radius(k)) cycle
        where (cluster == cluster(i)) cluster = cluster(k)
      end do
    end do
    bound = radius
    do k = 1, size(z)
      do i = 1, size(z)
        if (i /= k .and. cluster(i) == cluster(k)) bound(k) = max(bound(k), distance(z(i), z(k)) &
          & + radius(i) * exp(min(real(z(i) - z(k)), most - log(max(radius(i), 1.0_dp)))))
      end do
    end do
    bound = min(bound, exp(most))
  end function disc_bounds

  !> |rho_1 - rho_2| / |rho_2| by the logarithms, at most 1e300.
  pure real(dp) function distance(z1, z2)
    complex(dp), intent(in) :: z1, z2

    distance = exp(min(real(z1 - z2), most))
    ! |e^(a + i b) - 1|^2 = (e^a - 1)^2 + 4 e^a sin(b / 2)^2.
    if (real(z1 - z2) < most) distance = hypot(distance - 1, 2 * sqrt(distance) * sin(aimag(z1 - z2) / 2))
  end function distance

  !> exp(z), infinite where it overflows.
  elemental complex(dp) function multiplier(z)
    complex(dp), intent(in) :: z

    if (real(z) < log(huge(1.0_dp))) then
      multiplier = exp(z)
    else
      multiplier = ieee_value(1.0_dp, ieee_positive_inf)
    end if
  end function multiplier

  !> Indices of the values, largest modulus first; conjugate pairs adjacent, that above the real axis first, also where several are
  !> equal.
  pure function by_modulus(log_abs, arg) result(order)
    real(dp), intent(in) :: log_abs(:), arg(:)
    integer :: order(size(log_abs))
    integer :: i, k

    do k = 1, size(order)
      i = k
      do while (i > 1)
        if (.not. precedes(k, order(i - 1))) exit
        order(i) = order(i - 1)
        i = i - 1
      end do
      order(i) = k
    end do

  contains

    pure logical function precedes(one, other)
      integer, intent(in) :: one, other

      precedes = log_abs(one) > log_abs(other)
      if (precedes .or. log_abs(one) < log_abs(other)) return
      precedes = abs(arg(one)) > abs(arg(other))
      if (precedes .or. abs(arg(one)) < abs(arg(other))) return
      precedes = twins_before(one) < twins_before(other)
      if (precedes .or. twins_before(one) > twins_before(other)) return
      precedes = arg(one) > arg(other)
    end function precedes

    !> How many of the same value come before.
    pure integer function twins_before(k)
      integer, intent(in) :: k

      twins_before = count(abs(log_abs(:k - 1) - log_abs(k)) <= 0 .and. abs(arg(:k - 1) - arg(k)) <= 0)
    end function twins_before

  end function by_modulus

  !> Which multipliers have no significant digit: the bound is as great as the number.
  pure function lost(self)
    class(multipliers_type), intent(in) :: self
    logical :: lost(size(self%error))

    lost = self%error >= 1
  end function lost

  !> Whether nothing at all is known of them, as with too few given steps.
  pure logical function unknown(self)
    class(multipliers_type), intent(in) :: self

    unknown = any(self%error >= nothing_known)
  end function unknown

  !> 'unstable': some |rho| above 1 by more than its error; 'stable': all |rho| below 1 by more than their error; 'undamped': all
  !> others proved to lie on the unit circle; 'undecided': none of these. By logarithms: |rho| may over- or underflow.
  pure type(verdict_type) function judge(self) result(verdict)
    class(multipliers_type), intent(in) :: self
    logical :: inside(size(self%rho))

    associate (e => self%error)
      inside = e < nothing_known .and. self%log_abs + min(log(1 + e) + epsilon(1.0_dp), e) < 0
      if (any(e < 1 .and. self%log_abs + min(log(max(1 - e, tiny(1.0_dp))), -e) > 0)) then
        verdict = unstable
      else if (all(inside)) then
        verdict = stable
      else if (all(inside .or. circle_of(self))) then
        verdict = undamped
      else
        verdict = undecided
      end if
    end associate
  end function judge

  !> The verdict as a word.
  pure character(len=9) function verdict(self)
    class(multipliers_type), intent(in) :: self
    type(verdict_type) :: judged
    character(len=verdict_length) :: word

    judged = self%judge()
    word = judged%word()
    verdict = word(:len(verdict))
  end function verdict

  !> Marks the multipliers that lie on the unit circle, of a system that conserves (`conserves` of gestell_system_periodic) and does
  !> not fall into parts.
  pure subroutine prove_undamped(multipliers)
    type(multipliers_type), intent(inout) :: multipliers

    multipliers%on_circle = lie_on_circle(multipliers%log_abs, multipliers%arg, multipliers%error)
  end subroutine prove_undamped

  !> Which multipliers of a conserving system are proved to have |rho| = 1; `error`: bounds relative to |rho|.
  !>
  !> The multipliers of such a system come in pairs rho, 1 / conj(rho). A disc that meets no other one has one multiplier in it. If
  !> its mirror image in the unit circle meets no other disc either, the partner 1 / conj(rho) lies in the same disc and is rho
  !> itself. Such a multiplier is simple: the free vibration neither grows nor decays. In the plane of ln rho the disc lies within a
  !> radius of -ln(1 - error) about its centre, and the mirror is the imaginary axis.
  pure function lie_on_circle(log_abs, arg, error) result(on_circle)
    real(dp), intent(in) :: log_abs(:), arg(:), error(:)
    logical :: on_circle(size(log_abs))
    real(dp), dimension(size(log_abs)) :: radius, turn
    integer :: k

    on_circle = error < 1
    radius = -log(1 - min(error, 1 - epsilon(1.0_dp)))
    do k = 1, size(log_abs)
      turn = abs(arg - arg(k) - 2 * pi * anint((arg - arg(k)) / (2 * pi)))
      associate (others => hypot(log_abs - log_abs(k), turn), mirrored => hypot(log_abs + log_abs(k), turn), &
        & reach => radius + radius(k))
        on_circle(k) = on_circle(k) .and. count(.not. (others > reach .and. mirrored > reach)) == 1 .and. &
          & .not. mirrored(k) > reach(k)
      end associate
    end do
  end function lie_on_circle

end module gestell_floquet_multipliers
