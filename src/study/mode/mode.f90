!> Describes a free vibration of a system with periodic coefficients by its frequencies, its growth rate and its shapes.
module gestell_study_mode
  use gestell_base_kinds, only: dp
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: assurance

  !> `max_dofs`: maximum number of degrees of freedom. `max_components`: maximum number of components of a mode that are kept.
  integer, parameter, public :: max_dofs = 6, max_components = 8

  !> A mode: the free vibration that belongs to a conjugate pair of multipliers, or to two real multipliers that form a pair. Its
  !> displacements are
  !>
  !>     q(t) = Re sum_m c_m exp((growth + i w_m) t),   w_m = Im lambda + m 2 pi / T,
  !>
  !> where lambda is the exponent of the multiplier, T the period, and the sum is over the components c_m of all orders m.
  type, public :: mode_type
    !> False if the multiplier is lost in rounding errors. Frequency, damping ratio and share are then NaN
    logical :: identified = .false.
    !> True for two real multipliers. The mode is locked to a multiple of half the crank speed, or it does not oscillate
    logical :: real_pair = .false.
    !> True if it is proved that the mode neither grows nor decays
    logical :: neutral = .false.
    !> `growth`: growth rate of the multiplier with the larger modulus (1/s). `partner_growth`: growth rate of the other multiplier
    !> (1/s)
    real(dp) :: growth = 0, partner_growth = 0
    !> Bound on the errors of growth rate (1/s) and frequency (rad/s)
    real(dp) :: error = 0
    !> Number of components that are kept; the strongest comes first
    integer :: components = 0
    !> `frequencies`: frequencies of the components (rad/s, not negative). `shares`: their shares of the mean square of the motion,
    !> in the norm of the mean mass matrix
    real(dp) :: frequencies(max_components) = 0, shares(max_components) = 0
    !> Shapes of the components: amplitudes of the positions, scaled to 1 in the norm of the mean mass matrix; shape (dofs,
    !> components)
    complex(dp) :: shapes(max_dofs, max_components) = 0
    !> Index of the component whose frequency is the frequency of the mode
    integer :: principal = 1
  contains
    procedure :: frequency, share, shape => principal_shape, damping_ratio, grows
  end type mode_type

contains

  !> Frequency of the principal component (rad/s); NaN if the mode is not identified.
  elemental real(dp) function frequency(self)
    class(mode_type), intent(in) :: self

    frequency = ieee_value(1.0_dp, ieee_quiet_nan)
    if (self%identified) frequency = self%frequencies(self%principal)
  end function frequency

  !> True if the growth rate of the mode exceeds its error bound.
  elemental logical function grows(self)
    class(mode_type), intent(in) :: self

    grows = self%identified .and. self%growth > self%error
  end function grows

  !> Share of the principal component in the mean square of the motion; NaN if the mode is not identified.
  elemental real(dp) function share(self)
    class(mode_type), intent(in) :: self

    share = ieee_value(1.0_dp, ieee_quiet_nan)
    if (self%identified) share = self%shares(self%principal)
  end function share

  !> Shape of the principal component, shape (max_dofs).
  pure function principal_shape(self) result(shape)
    class(mode_type), intent(in) :: self
    complex(dp) :: shape(max_dofs)

    shape = self%shapes(:, self%principal)
  end function principal_shape

  !> Damping ratio, -growth / |growth + i frequency|; NaN if the mode is not identified.
  elemental real(dp) function damping_ratio(self)
    class(mode_type), intent(in) :: self

    damping_ratio = ieee_value(1.0_dp, ieee_quiet_nan)
    if (.not. self%identified) return
    damping_ratio = 0
    if (abs(self%growth) > 0) damping_ratio = -self%growth / hypot(self%growth, self%frequency())
  end function damping_ratio

  !> The modal assurance criterion of two shapes a and b: |a* M b|^2 / ((a* M a) (b* M b)). It is 1 for equal shapes and 0 for
  !> orthogonal shapes. Elements of a and b beyond the size of M are ignored (doc/theory.md, equation 79).
  pure real(dp) function assurance(a, b, mass)
    complex(dp), intent(in) :: a(:), b(:)
    real(dp), intent(in) :: mass(:, :)
    real(dp) :: sizes

    associate (x => a(:size(mass, 1)), y => b(:size(mass, 1)))
      sizes = real(dot_product(x, matmul(mass, x))) * real(dot_product(y, matmul(mass, y)))
      assurance = 0
      if (sizes > 0) assurance = abs(dot_product(x, matmul(mass, y)))**2 / sizes
    end associate
  end function assurance

end module gestell_study_mode
