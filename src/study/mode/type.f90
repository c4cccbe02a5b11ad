!> A free vibration of a system with periodic coefficients in physical terms.
module gestell_study_mode_type
  use gestell_base_kinds, only: dp
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: assurance

  !> Degrees of freedom at the most, and components that are kept.
  integer, parameter, public :: most_dofs = 6, most_components = 8

  !> One mode: the motion of a conjugate pair of multipliers or of two real ones that belong together.
  !>
  !>     q(t) = Re sum_m c_m exp((growth + i w_m) t),   w_m = Im lambda + m 2 pi / T
  type, public :: mode_type
    !> Whether the mode is known at all: a multiplier may be lost in rounding. What follows is NaN or empty if not.
    logical :: identified = .false.
    !> Two real multipliers: locked to a multiple of half the crank's speed, or not swinging at all.
    logical :: real_pair = .false.
    !> Whether it is proved to neither grow nor decay.
    logical :: neutral = .false.
    !> Of the multiplier that is greater in modulus, and of the other one (1/s).
    real(dp) :: growth = 0, partner_growth = 0
    !> Bound on the errors of growth (1/s) and frequency (rad/s).
    real(dp) :: error = 0
    !> The strongest components, strongest first: frequencies (rad/s, not negative), parts of |p|^2 in the norm of the mean
    !> mass matrix, and shapes of the positions, unit vectors in that norm.
    integer :: components = 0
    real(dp) :: frequencies(most_components) = 0, shares(most_components) = 0
    complex(dp) :: shapes(most_dofs, most_components) = 0
    !> The component by which the mode is named.
    integer :: principal = 1
  contains
    procedure :: frequency
    procedure :: share
    procedure :: shape => principal_shape
    procedure :: damping_ratio
    procedure :: grows
  end type mode_type

contains

  !> Of the principal component (rad/s).
  elemental real(dp) function frequency(self)
    class(mode_type), intent(in) :: self

    frequency = ieee_value(1.0_dp, ieee_quiet_nan)
    if (self%identified) frequency = self%frequencies(self%principal)
  end function frequency

  !> Whether it grows for sure.
  elemental logical function grows(self)
    class(mode_type), intent(in) :: self

    grows = self%identified .and. self%growth > self%error
  end function grows

  !> Of the principal component.
  elemental real(dp) function share(self)
    class(mode_type), intent(in) :: self

    share = ieee_value(1.0_dp, ieee_quiet_nan)
    if (self%identified) share = self%shares(self%principal)
  end function share

  !> Of the principal component.
  pure function principal_shape(self) result(shape)
    class(mode_type), intent(in) :: self
    complex(dp) :: shape(most_dofs)

    shape = self%shapes(:, self%principal)
  end function principal_shape

  !> - growth / |growth + i frequency|.
  elemental real(dp) function damping_ratio(self)
    class(mode_type), intent(in) :: self

    damping_ratio = ieee_value(1.0_dp, ieee_quiet_nan)
    if (.not. self%identified) return
    damping_ratio = 0
    if (abs(self%growth) > 0) damping_ratio = -self%growth / hypot(self%growth, self%frequency())
  end function damping_ratio

  !> The modal assurance criterion |a* M b|^2 / (a* M a) (b* M b): 1 for the same shape, 0 for orthogonal ones. What the shapes have
  !> beyond the size of M does not count.
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

end module gestell_study_mode_type
