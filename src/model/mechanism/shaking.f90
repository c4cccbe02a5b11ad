!> Shaking forces: the forces that a mechanism exerts on a frame at rest, (53) and (54) of doc/theory.md.
module gestell_model_mechanism_shaking
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_math_series_fourier, only: find_series, fourier_type, largest_value
  use gestell_model_mechanism_held, only: part_of_turn
  use gestell_model_mechanism, only: drive_columns, energy_d, mass_functions_type, mechanism_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: shaking

  !> Shaking forces over the crank angle phi. Each component is f = mean + sum of amplitude(k) cos(k phi + phase(k)).
  type, public :: shaking_type
    !> Fourier series of the two forces along x and y (N) and of the moment about the mechanism's origin O (N m).
    type(fourier_type) :: series(3)
    !> Maximum absolute value over the turn, and rms value, of the three components; the fourth element belongs to the magnitude of
    !> the force.
    real(dp), dimension(4) :: peak = 0, rms = 0
    !> First order of the force fx + i fy at crank angle zero, divided by the square of the drive speed (kg m). It is the sum of two
    !> rotating vectors: the first rotates with the crank, the second against it. For a mass m at the radius r on the crank they are
    !> m r and 0.
    complex(dp) :: unbalance(2) = 0
  contains
    procedure :: is_finite
  end type shaking_type

contains

  !> True if no force overflows double precision.
  pure logical function is_finite(self)
    class(shaking_type), intent(in) :: self

    is_finite = all(ieee_is_finite(self%rms) .and. ieee_is_finite(self%peak))
  end function is_finite

  !> Computes the shaking forces at a speed (rad/s): the force -Omega^2 S'' with the first moment S = (a1, a2), and the moment about
  !> O. The moment is -Omega^2 a4, or -Omega^2 (a4 - K'/2) if the drive's torque does not act on the frame. Fails if the mechanism's
  !> `check` fails, its `angle_scale` is not positive, or the speed is not finite. (Lowen, Berkof, Survey of investigations into the
  !> balancing of linkages, J. Mechanisms 3, 1968, 221-231.)
  subroutine shaking(mechanism, speed, computed, error, uniform_in_space)
    class(mechanism_type), intent(in) :: mechanism
    real(dp), intent(in) :: speed
    type(shaking_type), intent(out) :: computed
    type(error_type), allocatable, intent(out) :: error
    !> True if the crank turns uniformly relative to the ground. False, the default, if it turns uniformly relative to the frame
    logical, intent(in), optional :: uniform_in_space
    integer, parameter :: most = 8192
    real(dp), allocatable :: samples(:, :)
    real(dp) :: drive(1, drive_columns)
    type(mass_functions_type) :: a
    real(dp) :: bound
    complex(dp), parameter :: i = (0.0_dp, 1.0_dp)
    complex(dp) :: c(2)
    logical :: corrected
    integer :: k, n

    call mechanism%check(error)
    if (allocated(error)) return
    if (.not. (ieee_is_finite(speed) .and. mechanism%angle_scale > 0)) then
      call fatal_error(error, "the speed must be finite and the mechanism's angle_scale positive", invalid_input)
      return
    end if
    corrected = .false.
    if (present(uniform_in_space)) corrected = uniform_in_space
    ! With fewer samples than the angle scale requires, a high order could be mistaken for a low one.
    n = max(128, ceiling(min(real(most, dp), 8 * pi / mechanism%angle_scale)))
    do
      if (allocated(samples)) deallocate(samples)
      allocate(samples(n, 3))
      do k = 1, n
        call mechanism%mass_functions(2 * pi * (k - 1) / n, a)
        drive = 0
        if (corrected) call mechanism%tabulate_drive([2 * pi * (k - 1) / n], drive, corrected)
        samples(k, :) = -speed**2 * [a%a1%dd, a%a2%dd, a%a4 - part_of_turn(mechanism, corrected) * drive(1, energy_d) / 2]
      end do
      call find_series(transpose(samples), computed%series)
      ! terms that cancel to less than this are rounding, which no number of samples resolves
      if (all([(computed%series(k)%tail() < 1.0e-9_dp .or. computed%series(k)%largest_term() <= 1.0e-12_dp * speed**2 &
        & * mechanism%terms(k), k = 1, 3)]) .or. n >= most) exit
      n = 2 * n
    end do
    computed%rms(:3) = [(computed%series(k)%rms(), k = 1, 3)]
    computed%rms(4) = hypot(computed%rms(1), computed%rms(2))
    if (.not. all(ieee_is_finite(computed%rms))) return
    computed%peak(:3) = [(computed%series(k)%peak(samples(:, k)), k = 1, 3)]
    ! A Fourier series overshoots where the acceleration jumps.
    if (mechanism%jumps) then
      computed%peak = [maxval(abs(samples), dim=1), maxval(hypot(samples(:, 1), samples(:, 2)))]
    end if
    ! the square of a vector's length is a trigonometric polynomial too
    bound = hypot(computed%peak(1), computed%peak(2))
    if (bound > 0 .and. .not. mechanism%jumps) computed%peak(4) = bound * sqrt(largest_value((samples(:, 1) / bound)**2 &
      & + (samples(:, 2) / bound)**2))
    if (.not. abs(speed) > 0) return
    ! With Re C_x e^(i phi) and Re C_y e^(i phi) along x and y the vector is F+ e^(i phi) + F- e^(-i phi),
    ! F+ = (C_x + i C_y) / 2, F- = conjg(C_x - i C_y) / 2.
    associate (first => mechanism%turns)
      c = [(computed%series(k)%amplitude(first) * exp(i * computed%series(k)%phase(first)), k = 1, 2)]
      computed%unbalance = [c(1) + i * c(2), conjg(c(1) - i * c(2))] / 2 / (first * speed)**2
    end associate
  end subroutine shaking

end module gestell_model_mechanism_shaking
