!> Functions of the multipliers that are smooth and change their sign where a system loses its stability.
!>
!> The largest modulus of a multiplier has kinks and, where two multipliers meet, behaves like a square root. The following
!> products over all multipliers rho_k are smooth:
!>
!>     f+ = product of (rho_k - 1),   f- = product of (rho_k + 1),   h = product over pairs of (1 - rho_i rho_k)
!>
!> They are symmetric in the multipliers and therefore as smooth as the monodromy matrix Phi. f+ = det(Phi - E) (E: identity
!> matrix) is zero at divergence, f- at period doubling, and h where a conjugate pair crosses the unit circle. Only the signs
!> matter. To prevent overflow, each factor is divided by sqrt(1 + |p|**2), where p is rho_k or rho_i rho_k.
!>
!> Without damping the multipliers form pairs rho, 1/rho, and h is zero everywhere. The discriminant of z = rho + 1/rho then
!> replaces h: the product of (z_i - z_k)**2, which is zero where two pairs meet.
module gestell_task_boundary_line_functions
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_multipliers, only: multipliers_type
  implicit none (type, external)
  private

  public :: border_functions

  integer, parameter, public :: divergence = 1, period_doubling = 2, flutter = 3, border_kinds = 3
  character(len=15), parameter, public :: kind_names(border_kinds) = [character(len=15) :: "divergence", "period_doubling", &
    & "flutter"]

  !> Upper limit of ln |rho|. Multipliers with a larger modulus are replaced by ones with this modulus and the same argument.
  real(dp), parameter :: most = 100

contains

  !> Computes the border functions f+, f- and h of the multipliers rho: the products of (rho - 1), of (rho + 1) and of (1 - rho_i
  !> rho_k). If the multipliers form reciprocal pairs, the discriminant replaces h. `sign_certain`: true for each function that
  !> differs from zero by more than the effect of the multipliers' errors.
  pure subroutine border_functions(multipliers, f, sign_certain, reciprocal)
    type(multipliers_type), intent(in) :: multipliers
    real(dp), intent(out) :: f(border_kinds)
    !> `sign_certain`: true for each function that certainly differs from zero. `reciprocal`: true if the multipliers form pairs
    !> rho, 1/rho
    logical, intent(out) :: sign_certain(border_kinds), reciprocal
    complex(dp), dimension(size(multipliers%rho)) :: w
    complex(dp) :: z(size(w) / 2)
    real(dp) :: radius(size(w)), z_error(size(w) / 2)

    associate (log_abs => min(multipliers%log_abs, most))
      w = exp(log_abs) * cmplx(cos(multipliers%arg), sin(multipliers%arg), dp)
      ! in floating point sin(pi) is not exactly zero, but real multipliers must stay real
      where (pi - abs(multipliers%arg) < epsilon(pi)) w = -exp(log_abs)
      radius = exp(min(log(max(multipliers%error, tiny(pi))) + log_abs, most))
    end associate
    f(divergence) = real(product((w - 1) / size_of(w)))
    f(period_doubling) = real(product((w + 1) / size_of(w)))
    sign_certain(divergence) = all(abs(w - 1) > radius)
    sign_certain(period_doubling) = all(abs(w + 1) > radius)
    call find_pairs(w, radius, z, z_error, reciprocal)
    if (reciprocal) then
      call product_of_pairs(z, z_error, reciprocal, f(flutter), sign_certain(flutter))
    else
      call product_of_pairs(w, radius, reciprocal, f(flutter), sign_certain(flutter))
    end if
  end subroutine border_functions

  !> Computes a product over all pairs of the numbers `x`. If `of_differences` is true, the factors are (x_i - x_k)**2, and the
  !> product is the discriminant. Otherwise the factors are 1 - x_i x_k, and the product is h. Each factor is scaled to prevent
  !> overflow.
  pure subroutine product_of_pairs(x, error, of_differences, value, sign_certain)
    complex(dp), intent(in) :: x(:)
    !> Error bounds of the numbers `x`
    real(dp), intent(in) :: error(:)
    logical, intent(in) :: of_differences
    real(dp), intent(out) :: value
    !> True if each factor differs from zero by more than its error
    logical, intent(out) :: sign_certain
    complex(dp) :: all_pairs
    integer :: i, k

    all_pairs = 1
    sign_certain = .true.
    do i = 1, size(x)
      do k = i + 1, size(x)
        if (of_differences) then
          all_pairs = all_pairs * ((x(i) - x(k)) / (size_of(x(i)) * size_of(x(k))))**2
          sign_certain = sign_certain .and. abs(x(i) - x(k)) > error(i) + error(k)
        else
          all_pairs = all_pairs * ((1 - x(i) * x(k)) / size_of(x(i) * x(k)))
          sign_certain = sign_certain .and. abs(1 - x(i) * x(k)) > abs(x(i)) * error(k) + (abs(x(k)) + error(k)) * error(i)
        end if
      end do
    end do
    value = real(all_pairs)
  end subroutine product_of_pairs

  !> Finds pairs of multipliers whose product is 1 within their errors, and computes z = rho + 1/rho for each pair. `reciprocal`:
  !> true if all multipliers belong to such pairs.
  pure subroutine find_pairs(w, radius, z, error, reciprocal)
    complex(dp), intent(in) :: w(:)
    real(dp), intent(in) :: radius(:)
    complex(dp), intent(out) :: z(:)
    real(dp), intent(out) :: error(:)
    logical, intent(out) :: reciprocal
    logical :: free(size(w))
    integer :: i, k, pair

    z = 0
    error = 0
    reciprocal = mod(size(w), 2) == 0
    free = .true.
    do pair = 1, size(z)
      if (.not. reciprocal) return
      i = findloc(free, .true., dim=1)
      free(i) = .false.
      k = minloc(abs(1 - w(i) * w), dim=1, mask=free)
      free(k) = .false.
      reciprocal = abs(1 - w(i) * w(k)) <= abs(w(i)) * radius(k) + (abs(w(k)) + radius(k)) * radius(i)
      z(pair) = w(i) + w(k)
      error(pair) = radius(i) + radius(k)
    end do
  end subroutine find_pairs

  elemental real(dp) function size_of(w)
    complex(dp), intent(in) :: w

    size_of = sqrt(1 + real(w)**2 + aimag(w)**2)
  end function size_of

end module gestell_task_boundary_line_functions
