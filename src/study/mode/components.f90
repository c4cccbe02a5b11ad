!> The strongest harmonic components of a periodic motion.
module gestell_study_mode_components
  use gestell_base_kinds, only: dp, pi
  use gestell_math_dft, only: dft
  use gestell_study_mode_type, only: assurance, mode_type, most_components
  implicit none (type, external)
  private

  public :: find_components, keep_component

  !> Components below this part of the whole are left out.
  real(dp), parameter :: least_share = 1.0e-3_dp

contains

  !> Components of a mode whose p is given at equidistant phases, shape (samples, f); `turn` = Im lambda (rad/s). Their
  !> strength is |c_m|^2 in the norm of `mass`: they add up to the mean square of the motion (Parseval), whatever springs there
  !> are. Two conjugate components, which p has where lambda is real, are one vibration. The strongest stands first.
  !> Where it has less than half of the strength, as of a vibration whose frequency a slow crank modulates, it gets the
  !> frequency that is nearest to the mean of those with its shape.
  pure subroutine find_components(p, turn, period, mass, mode)
    complex(dp), intent(in) :: p(:, :)
    real(dp), intent(in) :: turn, period, mass(:, :)
    type(mode_type), intent(inout) :: mode
    complex(dp) :: c(size(p, 1), size(p, 2))
    real(dp) :: strength(size(p, 1)), frequencies(size(p, 1)), all, both, name
    integer :: samples, i, k, place, mirrored
    logical :: alone

    samples = size(p, 1)
    do i = 1, size(p, 2)
      c(:, i) = dft(p(:, i))
    end do
    strength = [(real(dot_product(c(i, :), matmul(mass, c(i, :)))), i = 1, samples)]
    all = sum(strength)
    frequencies = [(turn + 2 * pi / period * order(i), i = 1, samples)]
    place = maxloc(strength, dim=1)
    name = frequencies(place)
    if (strength(place) < 0.5_dp * all) name = frequencies(nearest_to_mean(frequencies, strength, c, mass))
    ! Of a real lambda.
    alone = abs(turn * period / pi - nint(turn * period / pi)) > 1.0e-12_dp
    mode%components = 0
    do k = 1, most_components
      both = strength(place)
      strength(place) = -1
      mirrored = modulo(-order(place) - nint(turn * period / pi), samples) + 1
      if (.not. alone .and. mirrored /= place) then
        both = both + max(strength(mirrored), 0.0_dp)
        strength(mirrored) = -1
      end if
      if (both < least_share * all .and. k > 1) exit
      ! The sum of all is at least `both`, unless rounding has made the mass matrix indefinite.
      call keep_component(name, c(place, :), both / max(all, both, tiny(all)), mass, mode)
      place = maxloc(strength, dim=1)
      name = frequencies(place)
    end do

  contains

    !> Of the component at a place of the transform.
    pure integer function order(at)
      integer, intent(in) :: at

      order = at - 1
      if (2 * order >= samples) order = order - samples
    end function order

  end subroutine find_components

  !> The component nearest to the mean |frequency| of all, each as strong as it resembles the strongest.
  pure integer function nearest_to_mean(frequencies, strength, c, mass) result(place)
    real(dp), intent(in) :: frequencies(:), strength(:), mass(:, :)
    complex(dp), intent(in) :: c(:, :)
    real(dp) :: weight(size(strength))
    complex(dp) :: forward(size(c, 2), size(strength))
    integer :: i

    do i = 1, size(strength)
      forward(:, i) = c(i, :)
      if (frequencies(i) < 0) forward(:, i) = conjg(c(i, :))
    end do
    place = maxloc(strength, dim=1)
    weight = [(strength(i) * assurance(forward(:, i), forward(:, place), mass), i = 1, size(strength))]
    place = minloc(abs(abs(frequencies) - sum(weight * abs(frequencies)) / sum(weight)), dim=1)
  end function nearest_to_mean

  !> Adds a component of `frequency` (rad/s); one that turns backward is the conjugate of one that turns forward.
  pure subroutine keep_component(frequency, shape, share, mass, mode)
    real(dp), intent(in) :: frequency, share, mass(:, :)
    complex(dp), intent(in) :: shape(:)
    type(mode_type), intent(inout) :: mode
    complex(dp) :: turned(size(shape))
    integer :: f

    f = size(shape)
    turned = shape
    if (frequency < 0) turned = conjg(shape)
    mode%components = mode%components + 1
    associate (k => mode%components)
      mode%frequencies(k) = abs(frequency)
      mode%shares(k) = share
      mode%shapes(:f, k) = turned / sqrt(max(real(dot_product(turned, matmul(mass, turned))), tiny(1.0_dp)))
    end associate
  end subroutine keep_component

end module gestell_study_mode_components
