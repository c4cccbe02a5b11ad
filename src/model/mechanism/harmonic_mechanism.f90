!> A mechanism given by the harmonics of its mass functions. The harmonics come from measurements or from a vendor, or are used
!> because the mechanism is not a linkage.
module gestell_model_mechanism_harmonic_mechanism
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_math_jet, only: jet, operator(*), operator(+)
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: fixed
  use gestell_model_joints_path, only: batch, copy_batch
  use gestell_model_mechanism, only: a1_d, a1_dd, a1_ddd, a1_v, a2_d, a2_dd, a2_ddd, a2_v, a3_d, a3_dd, a3_v, a4_v, energy_d, &
    & energy_dd, energy_v, mass_functions_type, mechanism_type, spin_dd, spin_v, table_columns
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: new_harmonic_mechanism

  !> A mechanism given by the harmonics of a1, a2 (kg m), a3 and H = sum [m (x y' - y x') + J phi'] (kg m^2), where a4 = H'. Each
  !> array holds the mean, then the coefficients of cos(phi), sin(phi), cos(2 phi), sin(2 phi) and so on; shape (1 + 2 orders).
  type, extends(mechanism_type), public :: harmonic_mechanism_type
    real(dp), allocatable :: a1(:), a2(:), a3(:), moment(:)
    !> Harmonics of K = sum [m (x'^2 + y'^2) + J phi'^2] (kg m^2), in the same arrangement as the other arrays. Only the torque of
    !> the drive needs them; not allocated if unknown.
    real(dp), allocatable :: energy(:)
  contains
    procedure :: mass_functions, tabulate, tabulate_drive, check
  end type harmonic_mechanism_type

contains

  !> Creates a mechanism from harmonics. Fails if mass or inertia is negative, if a number is not finite, if the number of
  !> coefficients is even, or if the functions are physically impossible (no set of masses has these functions).
  subroutine new_harmonic_mechanism(mechanism, mass, inertia, a1, a2, a3, moment, error, energy)
    type(harmonic_mechanism_type), intent(out) :: mechanism
    !> `mass`: total mass (kg). `inertia`: sum of the moments of inertia (kg m^2). `a1`, `a2`, `a3`, `moment`: harmonics, arranged
    !> as in the type
    real(dp), intent(in) :: mass, inertia, a1(:), a2(:), a3(:), moment(:)
    type(error_type), allocatable, intent(out) :: error
    !> Harmonics of K (kg m^2)
    real(dp), intent(in), optional :: energy(:)
    real(dp), parameter :: rounding = 1.0e-6_dp
    type(mass_functions_type) :: a
    real(dp), allocatable :: k(:)
    integer :: i, points

    k = [0.0_dp]
    if (present(energy)) k = energy
    if (.not. (mass >= 0 .and. inertia >= 0)) then
      call fatal_error(error, "the mechanism's mass and inertia must not be negative", invalid_input)
    else if (.not. all(ieee_is_finite([mass, inertia, a1, a2, a3, moment, k]))) then
      call fatal_error(error, "the mechanism's data must be finite", invalid_input)
    else if (any(modulo([size(a1), size(a2), size(a3), size(moment), size(k)], 2) == 0)) then
      call fatal_error(error, "harmonics must have an odd number of values: the mean, then one cosine and one sine " // &
        &   "coefficient for each order", invalid_input)
    end if
    if (allocated(error)) return
    if (present(energy)) mechanism%energy = energy
    mechanism%mass = mass
    mechanism%inertia = inertia
    allocate(mechanism%a1, source=a1)
    allocate(mechanism%a2, source=a2)
    allocate(mechanism%a3, source=a3)
    allocate(mechanism%moment, source=moment)
    ! Masses obey m a3 >= a1^2 + a2^2 (Cauchy and Schwarz); then M is positive definite in every frame.
    points = 8 * max(8, size(a1), size(a2), size(a3))
    do i = 0, points - 1
      call mechanism%mass_functions(2 * pi * i / points, a)
      if (mass * a%a3%v >= (1 - rounding) * (a%a1%v**2 + a%a2%v**2)) cycle
      call fatal_error(error, "these mass functions are physically impossible: at a crank angle of " &
        & // fixed(360.0_dp * i / points, 1) // " deg mass * a3 is less than a1^2 + a2^2", invalid_input)
      return
    end do
    mechanism%angle_scale = 1.0_dp / max(1, maxval([size(a1), size(a2), size(a3), size(moment)]) / 4)
  end subroutine new_harmonic_mechanism

  !> Fails if `new_harmonic_mechanism` has not created the mechanism.
  subroutine check(self, error)
    class(harmonic_mechanism_type), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error

    if (.not. allocated(self%moment)) call fatal_error(error, "a mechanism given by its harmonics must be created with " // &
      &   "new_harmonic_mechanism", invalid_input)
  end subroutine check

  subroutine mass_functions(self, crank_angle, a)
    class(harmonic_mechanism_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(mass_functions_type), intent(out) :: a
    type(jet) :: moment

    a%a1 = series(self%a1, crank_angle)
    a%a2 = series(self%a2, crank_angle)
    a%a3 = series(self%a3, crank_angle)
    moment = series(self%moment, crank_angle)
    a%a4 = moment%d
  end subroutine mass_functions

  !> Value, with three derivatives, of the series c0 + sum over k of c_k cos(k phi) + s_k sin(k phi).
  pure type(jet) function series(coefficients, phi)
    real(dp), intent(in) :: coefficients(:), phi
    integer :: k

    series = jet(coefficients(1))
    do k = 1, size(coefficients) / 2
      associate (c => cos(k * phi), s => sin(k * phi), n => real(k, dp))
        series = series + coefficients(2 * k) * jet(c, -n * s, -n**2 * c, n**3 * s) &
          & + coefficients(2 * k + 1) * jet(s, n * c, -n**2 * s, -n**3 * c)
      end associate
    end do
  end function series

  !> Tabulates the mass functions at crank angles (rad), shape (angles, table_columns), in batches.
  subroutine tabulate(self, angles, table)
    class(harmonic_mechanism_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: table(:, :)
    real(dp) :: some(batch), c(batch), s(batch), sums(batch, table_columns), moment(batch, 3)
    integer :: first, last, k, orders

    orders = maxval([size(self%a1), size(self%a2), size(self%a3), size(self%moment)]) / 2
    do first = 1, size(angles), batch
      call copy_batch(angles, first, last, some)
      sums = 0
      sums(:, a1_v) = self%a1(1)
      sums(:, a2_v) = self%a2(1)
      sums(:, a3_v) = self%a3(1)
      moment = 0
      do k = 1, orders
        call cosine_sine(k * some, c, s)
        call add_harmonic(self%a1, k, c, s, sums(:, a1_v), sums(:, a1_d), sums(:, a1_dd))
        call add_harmonic(self%a2, k, c, s, sums(:, a2_v), sums(:, a2_d), sums(:, a2_dd))
        call add_harmonic(self%a3, k, c, s, sums(:, a3_v), sums(:, a3_d), sums(:, a3_dd))
        call add_harmonic(self%moment, k, c, s, moment(:, 1), moment(:, 2), moment(:, 3))
      end do
      sums(:, a4_v) = moment(:, 2)
      table(first:last, :) = sums(:last - first + 1, :)
    end do
  end subroutine tabulate

  !> Tabulates the functions H and K of the drive with their derivatives at crank angles (rad), shape (angles, drive_columns). H
  !> is the angular momentum and K twice the kinetic energy at unit crank speed. `known` is true if the harmonics of K are given.
  subroutine tabulate_drive(self, angles, table, known)
    class(harmonic_mechanism_type), intent(in) :: self
    real(dp), intent(in) :: angles(:)
    real(dp), intent(out) :: table(:, :)
    logical, intent(out) :: known
    type(jet) :: spin, energy, a1, a2
    integer :: k

    table = 0
    known = allocated(self%energy)
    if (.not. known) return
    do k = 1, size(angles)
      spin = series(self%moment, angles(k))
      energy = series(self%energy, angles(k))
      a1 = series(self%a1, angles(k))
      a2 = series(self%a2, angles(k))
      table(k, [spin_v, spin_dd]) = [spin%v, spin%dd]
      table(k, [energy_v, energy_d, energy_dd]) = [energy%v, energy%d, energy%dd]
      table(k, [a1_ddd, a2_ddd]) = [a1%ddd, a2%ddd]
    end do
  end subroutine tabulate_drive

  !> Adds the term of harmonic `k` of a series, c_k cos(k phi) + s_k sin(k phi), and its first two derivatives. Adds nothing if the
  !> series has fewer than `k` harmonics.
  pure subroutine add_harmonic(coefficients, k, c, s, value, d, dd)
    real(dp), intent(in) :: coefficients(:), c(batch), s(batch)
    integer, intent(in) :: k
    real(dp), intent(inout) :: value(batch), d(batch), dd(batch)
    integer :: i

    if (2 * k > size(coefficients)) return
    associate (along => coefficients(2 * k), across => coefficients(2 * k + 1), n => real(k, dp))
      do i = 1, batch
        value(i) = value(i) + (along * c(i) + across * s(i))
        d(i) = d(i) + n * (across * c(i) - along * s(i))
        dd(i) = dd(i) - n**2 * (along * c(i) + across * s(i))
      end do
    end associate
  end subroutine add_harmonic

end module gestell_model_mechanism_harmonic_mechanism
