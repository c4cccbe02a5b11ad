!> Finds the strongest harmonic components of a free vibration (doc/theory.md, equation 78).
module gestell_study_mode_components
  use gestell_base_kinds, only: dp, pi
  use gestell_math_dft, only: dft
  use gestell_study_mode, only: assurance, mode_type, max_components
  implicit none (type, external)
  private

  public :: find_components, append_component

  !> A component is dropped if its share of the total strength is smaller than this.
  real(dp), parameter :: min_share = 1.0e-3_dp

contains

  !> Finds the components c_m of a mode and sorts them, strongest first. They are the harmonics of p, the periodic part of a free
  !> vibration. The strength |c_m|^2 is measured in the norm of `mass`, so it does not depend on the springs. The strengths add up
  !> to the mean square of p (Parseval). If the exponent lambda of the vibration is real, p has pairs of conjugate components;
  !> each pair counts as one component. The first component is the strongest one. It may have less than half of the total
  !> strength, as when a slow crank modulates the frequency. The mode then gets the frequency that is nearest to the mean
  !> frequency of all components, weighted by strength and by similarity of shape.
  pure subroutine find_components(p, turn, period, mass, mode)
    !> Positions of p, the periodic part of the free vibration, without its growth; shape (samples, f)
    complex(dp), intent(in) :: p(:, :)
    !> `turn`: imaginary part of the exponent lambda (rad/s). `period`: the period (s). `mass`: mean of the mass matrix, shape (f,
    !> f)
    real(dp), intent(in) :: turn, period, mass(:, :)
    !> The mode to which the components are added
    type(mode_type), intent(inout) :: mode
    complex(dp) :: c(size(p, 1), size(p, 2))
    real(dp) :: strength(size(p, 1)), frequencies(size(p, 1)), all, both, name
    integer :: samples, i, k, place, mirrored
    logical :: alone

    samples = size(p, 1)
    do i = 1, size(p, 2)
      c(:, i) = dft((p(:, i)))
    end do
    strength = [(real(dot_product(c(i, :), matmul(mass, c(i, :)))), i = 1, samples)]
    all = sum(strength)
    frequencies = [(turn + 2 * pi / period * order(i), i = 1, samples)]
    place = maxloc(strength, dim=1)
    name = frequencies(place)
    if (strength(place) < 0.5_dp * all) name = frequencies(nearest_to_mean(frequencies, strength, c, mass))
    ! False if lambda is real, or real plus i pi / T. Then pairs of conjugate components belong to one vibration.
    alone = abs(turn * period / pi - nint(turn * period / pi)) > 1.0e-12_dp
    mode%components = 0
    do k = 1, max_components
      both = strength(place)
      strength(place) = -1
      mirrored = modulo(-order(place) - nint(turn * period / pi), samples) + 1
      if (.not. alone .and. mirrored /= place) then
        both = both + max(strength(mirrored), 0.0_dp)
        strength(mirrored) = -1
      end if
      if (both < min_share * all .and. k > 1) exit
      ! Without rounding errors the sum of all strengths is at least `both`. Rounding may make the mass matrix indefinite.
      call append_component(name, c(place, :), both / max(all, both, tiny(all)), mass, mode)
      place = maxloc(strength, dim=1)
      name = frequencies(place)
    end do

  contains

    !> Order of the harmonic that is stored at index `at` of the Fourier transform.
    pure integer function order(at)
      integer, intent(in) :: at

      order = at - 1
      if (2 * order >= samples) order = order - samples
    end function order

  end subroutine find_components

  !> Index of the component whose |frequency| is nearest to the mean |frequency|. The mean is weighted by strength and by similarity
  !> to the strongest component.
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

  !> Adds a component to the mode. If its frequency (rad/s) is negative, it is replaced by its conjugate, whose frequency is
  !> positive.
  pure subroutine append_component(frequency, shape, share, mass, mode)
    real(dp), intent(in) :: frequency, share, mass(:, :)
    complex(dp), intent(in) :: shape(:)
    type(mode_type), intent(inout) :: mode
    complex(dp) :: turned(size(shape))

    turned = merge(conjg(shape), shape, frequency < 0)
    mode%components = mode%components + 1
    associate (k => mode%components)
      mode%frequencies(k) = abs(frequency)
      mode%shares(k) = share
      mode%shapes(:size(shape), k) = turned / sqrt(max(real(dot_product(turned, matmul(mass, turned))), tiny(1.0_dp)))
    end associate
  end subroutine append_component

end module gestell_study_mode_components
