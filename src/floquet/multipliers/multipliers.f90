!> Computes multipliers and characteristic exponents with error bounds, and the verdict on stability. Implements equations (19) and
!> (64) of doc/theory.md and its section "Undamped machines".
module gestell_floquet_multipliers
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_base_verdict, only: stable, undamped, undecided, unstable, verdict_length, verdict_type
  use gestell_math_lapack, only: eigensystem
  use gestell_math_matrix, only: balanced
  use gestell_floquet_multipliers_krein, only: krein_signs
  use gestell_floquet_multipliers_small_eigensystem, only: small_eigensystem
  use gestell_floquet_period_monodromy, only: monodromy_type
  use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_value
  implicit none (type, external)
  private

  public :: append, arrange, disc_bounds, krein_of, lie_on_circle, multiplier, empty_multipliers, pair_conjugates, &
    & prove_undamped, set_multipliers, solve_multipliers

  !> All n multipliers of a system, sorted by descending modulus. The two multipliers of a conjugate pair are adjacent; the one with
  !> the positive imaginary part comes first.
  type, public :: multipliers_type
    !> Multipliers, shape (n); may overflow or underflow.
    complex(dp), allocatable :: rho(:)
    !> ln |rho|, shape (n); valid even if rho overflows or underflows.
    real(dp), allocatable :: log_abs(:)
    !> Argument of rho in (-pi, pi], shape (n).
    real(dp), allocatable :: arg(:)
    !> Characteristic exponents ln(rho) / T (1/s), shape (n). Imaginary parts are defined up to multiples of 2 pi / T.
    complex(dp), allocatable :: exponent(:)
    !> Bound on the error of rho relative to |rho|, shape (n), at most 1e300. If it is 1 or more, rho has no significant digit. The
    !> value `nothing_known` means that no bound exists.
    real(dp), allocatable :: error(:)
    !> Condition number of each multiplier as an eigenvalue, in balanced units, shape (n): at least 1.
    real(dp), allocatable :: condition(:)
    !> Eigenvectors of the monodromy matrix as unit columns, shape (n, n): states at t = 0 in the model's units, y_k of equation
    !> (19) in doc/theory.md.
    complex(dp), allocatable :: vectors(:, :)
    !> Signs of Krein's form (`krein_signs`), shape (n). Unallocated if the system may not conserve energy.
    integer, allocatable :: krein(:)
    !> True where |rho| = 1 is proved by `prove_undamped`, shape (n). Unallocated if no proof was attempted.
    logical, allocatable :: on_circle(:)
  contains
    procedure :: judge, verdict, lost, unknown
  end type multipliers_type

  !> Value of `error` for a multiplier without an error bound; larger than every bound.
  real(dp), parameter, public :: nothing_known = 1.0e308_dp

  !> Logarithm of the largest error bound, 1e300.
  real(dp), parameter :: most = 300 * log(10.0_dp)

contains

  !> Computes the multipliers of a monodromy matrix, and the eigenvectors if requested. Fails if `monodromy` is not solved or if
  !> LAPACK finds no eigenvalues.
  subroutine solve_multipliers(monodromy, vectors, multipliers, error)
    type(monodromy_type), intent(in) :: monodromy
    !> If true, also compute the eigenvectors
    logical, intent(in) :: vectors
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    complex(dp), allocatable :: rho(:), right(:, :), left(:, :)
    real(dp), allocatable :: phi(:, :), changes(:, :, :)
    integer :: n, k

    if (.not. allocated(monodromy%phi)) then
      call fatal_error(error, "call solve_monodromy before solve_multipliers", invalid_input)
      return
    end if
    n = size(monodromy%scale)
    allocate(phi, source=balanced(monodromy%phi, monodromy%scale))
    call small_eigensystem(phi, rho, right, left)
    if (.not. allocated(rho)) call eigensystem(phi, rho, right, left, error)
    if (allocated(error)) return
    ! The computed eigenvalues are those of a matrix that differs from phi by roundoff.
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
      if (.not. monodromy%known) multipliers%error = nothing_known
      if (allocated(monodromy%form) .and. all(multipliers%error < 1)) multipliers%krein = krein_signs(rho, &
        & abs(rho) * multipliers%error, left, monodromy%error + rounding, spread(d, 2, n) * monodromy%form * spread(d, 1, n))
    end associate
    multipliers%exponent = multipliers%exponent / monodromy%period
    if (vectors) multipliers%vectors = right * spread(monodromy%scale, 2, n)
    call arrange(multipliers)
  end subroutine solve_multipliers

  !> Computes multipliers, with the period as the unit of time, and their error bounds from the eigenvalues and eigenvectors of a
  !> matrix Phi. The error E of Phi is the sum of two matrices: one of the `changes`, and a matrix whose norm is at most
  !> `perturbation`.
  !>
  !> Let x_j and y_k be right and left unit eigenvectors. By Gershgorin's theorem for X^-1 (Phi + E) X the eigenvalues of Phi + E
  !> lie in the union of the discs
  !>
  !>     |mu - rho_k| <= sum over j of f_kj,   f_kj = |y_k* E x_j| / |y_k* x_k|.
  !>
  !> The part of E of which only the norm is known contributes at most its norm / |y_k* x_k| to each f_kj. If discs touch, the
  !> eigenvalues may lie in any of them, so the bound extends over all connected discs. It therefore also holds for close and for
  !> defective eigenvalues. The radius of an isolated disc is reduced by `separated_radius`.
  pure subroutine set_multipliers(rho, right, left, perturbation, multipliers, changes)
    !> `rho`: eigenvalues of the matrix Phi, shape (n). `right`, `left`: right and left eigenvectors of Phi as unit columns, shape
    !> (n, n).
    complex(dp), intent(in) :: rho(:), right(:, :), left(:, :)
    !> Bound on the norm of that part of the error E of Phi of which only the norm is known
    real(dp), intent(in) :: perturbation
    type(multipliers_type), intent(out) :: multipliers
    !> Possible values of the other part of the error E of Phi, shape (n, n, :); E is the sum of one of them and of a matrix
    !> whose norm is at most `perturbation`
    real(dp), intent(in), optional :: changes(:, :, :)
    !> Safety factor on `changes` in the radius of an isolated disc, because the direction of `changes` is known only in leading
    !> order.
    real(dp), parameter :: of_direction = 2
    real(dp), dimension(size(rho), size(rho)) :: f, perturbed_matrix
    complex(dp) :: along(size(rho), size(rho))
    real(dp), dimension(size(rho)) :: radius, rows, modulus
    integer :: n, k

    n = size(rho)
    multipliers%rho = rho
    allocate(multipliers%condition(n), multipliers%exponent(n))
    do k = 1, n
      multipliers%condition(k) = 1 / max(abs(dot_product(left(:, k), right(:, k))), epsilon(1.0_dp)**2)
      if (aimag(rho(k)) < 0 .and. abs(rho(k) - conjg(rho(max(k - 1, 1)))) <= 0) then
        ! Second of a conjugate pair. For k = 1 the condition is false: a number below the real axis is not its own conjugate.
        multipliers%exponent(k) = conjg(multipliers%exponent(k - 1))
      else
        ! Use the complex logarithm: equal numbers give equal results, conjugate numbers conjugate results. The vectorised real
        ! logarithm and atan2 may differ in the last digit between elements of an array.
        multipliers%exponent(k) = log(merge(rho(k), cmplx(tiny(1.0_dp), 0.0_dp, dp), abs(rho(k)) > 0))
      end if
    end do
    multipliers%log_abs = real(multipliers%exponent)
    multipliers%arg = aimag(multipliers%exponent)
    f = 0
    if (present(changes)) then
      ! Compare squares. A square that underflows belongs to a term far below `perturbation`.
      do k = 1, size(changes, 3)
        along = matmul(conjg(transpose(left)), matmul(changes(:, :, k), right))
        f = max(f, along%re**2 + along%im**2)
      end do
      f = sqrt(f)
    end if
    perturbed_matrix = (of_direction * f + perturbation) * spread(multipliers%condition, 2, n)
    f = (f + perturbation) * spread(multipliers%condition, 2, n)
    rows = sum(perturbed_matrix, dim=2)
    radius = sum(f, dim=2)
    radius = [(min(radius(k), separated_radius(rho, perturbed_matrix, rows, k)), k = 1, n)]
    modulus = max(abs(rho), tiny(1.0_dp))
    radius = exp(min(log(max(radius, tiny(1.0_dp))) - log(modulus), most))
    multipliers%error = disc_bounds(multipliers%exponent, radius)
  end subroutine set_multipliers

  !> Radius of the disc of eigenvalue k after a diagonal similarity transformation that makes this disc as small as the other
  !> discs allow.
  !>
  !> The transformation multiplies the off-diagonal elements f_kj of row k by alpha and the elements f_ik of column k by 1/alpha
  !> (J. H. Wilkinson, The Algebraic Eigenvalue Problem, 1965, chapter 2). All other discs grow until one touches disc k. The
  !> coupling to other eigenvalues then has only an effect of second order. The result is huge if no alpha below 1 keeps the
  !> discs disjoint. `rows`: row sums of f.
  pure real(dp) function separated_radius(rho, f, rows, k) result(radius)
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
  end function separated_radius

  !> Empty list of multipliers, to which `append` adds multipliers. If n > 0, the list can hold eigenvectors with n elements.
  pure type(multipliers_type) function empty_multipliers(n) result(multipliers)
    integer, intent(in) :: n

    allocate(multipliers%rho(0), multipliers%exponent(0))
    allocate(multipliers%log_abs(0), multipliers%arg(0), multipliers%error(0), multipliers%condition(0))
    if (n > 0) allocate(multipliers%vectors(n, 0))
  end function empty_multipliers

  !> Appends the multipliers `more` to `all`.
  pure subroutine append(all, more)
    type(multipliers_type), intent(inout) :: all
    type(multipliers_type), intent(in) :: more

    if (allocated(all%krein) .or. allocated(more%krein)) all%krein = [krein_of(all), krein_of(more)]
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

  !> The component `on_circle` of `multipliers`; all elements are false if this component is not allocated.
  pure function circle_of(multipliers) result(on_circle)
    type(multipliers_type), intent(in) :: multipliers
    logical :: on_circle(size(multipliers%rho))

    on_circle = .false.
    if (allocated(multipliers%on_circle)) on_circle = multipliers%on_circle
  end function circle_of

  !> The component `krein` of `multipliers`; zeros if this component is not allocated.
  pure function krein_of(multipliers) result(krein)
    type(multipliers_type), intent(in) :: multipliers
    integer :: krein(size(multipliers%exponent))

    krein = 0
    if (allocated(multipliers%krein)) krein = multipliers%krein
  end function krein_of

  !> Sorts the multipliers by descending modulus. Scales each eigenvector to unit length, with its largest component real and
  !> positive.
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
    if (allocated(multipliers%krein)) multipliers%krein = multipliers%krein(order)
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

  !> Makes the multipliers of a real system exactly real, or exactly conjugate in pairs, after a computation in complex
  !> arithmetic with rounding errors. Each multiplier is paired with the multiplier nearest to its conjugate. This is correct
  !> because the conjugate of a multiplier's disc contains the true value of its partner. On entry `exponent` must hold ln(rho);
  !> the other components are computed from it.
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

  !> Bounds on the distance between rho(k) and the true multiplier, relative to |rho(k)|; shape (n), at most 1e300. The bound is the
  !> radius of the disc around rho(k) if no other disc touches it. If discs touch, the bound is the distance from rho(k) to the
  !> farthest point of all discs connected with its own.
  pure function disc_bounds(z, radius) result(bound)
    !> ln rho, shape (n)
    complex(dp), intent(in) :: z(:)
    !> Radius of each disc relative to |rho| of its centre, shape (n)
    real(dp), intent(in) :: radius(:)
    real(dp) :: bound(size(z))
    integer :: cluster(size(z)), i, k

    cluster = [(k, k = 1, size(z))]
    do i = 1, size(z)
      do k = 1, size(z)
        ! Treat each pair once, relative to the larger modulus |rho(k)|.
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

  !> Distance |rho_1 - rho_2| / |rho_2| of two multipliers, computed from their logarithms z1 and z2; at most 1e300.
  pure real(dp) function distance(z1, z2)
    complex(dp), intent(in) :: z1, z2

    distance = exp(min(real(z1 - z2), most))
    ! |e^(a + i b) - 1|^2 = (e^a - 1)^2 + 4 e^a sin(b / 2)^2.
    if (real(z1 - z2) < most) distance = hypot(distance - 1, 2 * sqrt(distance) * sin(aimag(z1 - z2) / 2))
  end function distance

  !> Multiplier exp(z) with the logarithm z; infinity if it overflows.
  elemental complex(dp) function multiplier(z)
    complex(dp), intent(in) :: z

    if (real(z) < log(huge(1.0_dp))) then
      multiplier = exp(z)
    else
      multiplier = ieee_value(1.0_dp, ieee_positive_inf)
    end if
  end function multiplier

  !> Indices that sort the multipliers by descending modulus. The two multipliers of a conjugate pair are adjacent, the one above
  !> the real axis first, even if several pairs are equal.
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
      precedes = equal_values_before(one) < equal_values_before(other)
      if (precedes .or. equal_values_before(one) > equal_values_before(other)) return
      precedes = arg(one) > arg(other)
    end function precedes

    !> Number of multipliers before multiplier `k` that are equal to it.
    pure integer function equal_values_before(k)
      integer, intent(in) :: k

      equal_values_before = count(abs(log_abs(:k - 1) - log_abs(k)) <= 0 .and. abs(arg(:k - 1) - arg(k)) <= 0)
    end function equal_values_before

  end function by_modulus

  !> True for each multiplier without a significant digit: its error bound is at least as large as its modulus.
  pure function lost(self)
    class(multipliers_type), intent(in) :: self
    logical :: lost(size(self%error))

    lost = self%error >= 1
  end function lost

  !> True if at least one multiplier has no error bound, for instance because too few steps were given.
  pure logical function unknown(self)
    class(multipliers_type), intent(in) :: self

    unknown = any(self%error >= nothing_known)
  end function unknown

  !> Verdict on stability. It uses ln |rho| because |rho| may overflow or underflow.
  !>
  !>     'unstable'    some |rho| exceeds 1 by more than its error bound
  !>     'stable'      all |rho| are below 1 by more than their error bounds
  !>     'undamped'    each |rho| is below 1 by more than its error bound or is proved to be 1
  !>     'undecided'   none of these conditions is met
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

  !> The verdict as a word: 'stable', 'unstable', 'undamped' or 'undecided'.
  pure character(len=9) function verdict(self)
    class(multipliers_type), intent(in) :: self
    type(verdict_type) :: judged
    character(len=verdict_length) :: word

    judged = self%judge()
    word = judged%word()
    verdict = word(:len(verdict))
  end function verdict

  !> Marks the multipliers that are proved to lie on the unit circle. The system must conserve energy (`conserves` of
  !> gestell_system_periodic) and must not consist of independent parts.
  pure subroutine prove_undamped(multipliers)
    type(multipliers_type), intent(inout) :: multipliers

    multipliers%on_circle = krein_of(multipliers) /= 0 &
      & .or. lie_on_circle(multipliers%log_abs, multipliers%arg, multipliers%error)
  end subroutine prove_undamped

  !> True for each multiplier of a conservative system that is proved to have |rho| = 1.
  !>
  !> The multipliers of such a system come in pairs rho, 1 / conj(rho). A disc that touches no other disc contains one
  !> multiplier. The mirror image of the disc in the unit circle contains the partner 1 / conj(rho). If the mirror image touches
  !> no other disc either, the partner lies in the same disc and is rho itself. Such a multiplier is simple: the free vibration
  !> neither grows nor decays.
  !>
  !> The check uses the plane of ln rho, where the unit circle becomes the imaginary axis. A disc lies within the radius -ln(1 -
  !> error) of its centre there.
  pure function lie_on_circle(log_abs, arg, error) result(on_circle)
    !> Three arrays of shape (n). `log_abs`: ln |rho|. `arg`: argument of rho. `error`: bound on the error of rho relative to |rho|.
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
