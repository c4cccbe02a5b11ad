!> Estimates two properties of a system before it is solved: the angular frequency of its fastest motion, and the variation of its
!> coefficients over the period.
module gestell_floquet_choice_survey
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_math_lapack, only: balancing
  use gestell_math_matrix, only: balanced
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: sample_by_phase
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: survey_system

  !> Exponents in the assumed decay k^growth exp(-k width) of the k-th harmonic: `growth(1)` for coefficients, `growth(2)` for
  !> loads. Positions of joints have square-root branch points at the complex crank angles at which a dyad is stretched. Their
  !> harmonics therefore contain the factor k^(-3/2). Loads contain second derivatives of positions, and so the factor k^(1/2)
  !> for high k; the low harmonics used here grow nearly like k.
  real(dp), parameter, public :: growth(2) = [-1.5_dp, 1.0_dp]

  !> Properties of a system with n states, estimated from samples of its coefficients before it is solved.
  type, public :: survey_type
    !> Upper bound on the phase advance w_max T of the fastest motion within the period (rad): |P| T / sqrt 2, with the Frobenius
    !> norm of P. The factor sqrt 2 is allowed because frequencies come in pairs w, -w.
    real(dp) :: phase_advance = 0
    !> Better estimate of the phase advance w_max T of the fastest motion within the period (rad): (|P^16| / sqrt 2)^(1/16) T at the
    !> phase where P is largest. The 16th power suppresses all motions but the fastest.
    real(dp) :: fastest = 0
    !> `width`: distance from the real axis up to which the coefficients (element 1) and the loads (element 2) are analytic (rad,
    !> with 2 pi per period); zero if unknown. `height`: factor in the bound `height` k^`growth` exp(-k `width`) on the k-th
    !> harmonic, relative to the maximum of the function.
    real(dp) :: width(2) = 0, height(2) = 1
    !> Share of the fastest motion in the norm of the monodromy matrix Phi(T). It is below 1 if this motion decays over the period.
    real(dp) :: fade = 1
    !> Variation of the coefficients over the period, relative to their size.
    real(dp) :: changing = 1
    !> Units that balance the states, from the largest elements of P over the period; shape (n).
    real(dp), allocatable :: scale(:)
  end type survey_type

  integer, parameter :: points = 16
  integer :: place, order
  !> Phases t / T at which a survey samples the system. A model may evaluate its coefficients at these phases in advance.
  real(dp), parameter, public :: survey_phases(points) = [((place - 0.75_dp) / points, place = 1, points)]
  real(dp), parameter :: cosine(points, points / 2) = reshape([((cos(2 * pi * place * order / points), &
    & place = 1, points), order = 1, points / 2)], [points, points / 2])
  real(dp), parameter :: sine(points, points / 2) = reshape([((sin(2 * pi * place * order / points), &
    & place = 1, points), order = 1, points / 2)], [points, points / 2])
  !> Index of the array constructor below; 1 means coefficients, 2 means loads.
  integer :: which
  !> Factors k^growth for the harmonics k = 1, 2, ...; column 1 for coefficients, column 2 for loads.
  real(dp), parameter :: falling(points / 2, 2) = reshape([((real(order, dp)**growth(which), order = 1, points / 2), &
    & which = 1, 2)], [points / 2, 2])

contains

  !> Estimates the phase advance and the variation of the coefficients of `system` from samples. Fails if the coefficients are not
  !> finite or the mass matrix is singular.
  subroutine survey_system(system, survey, error, forced)
    class(periodic_system), intent(in) :: system
    type(survey_type), intent(out) :: survey
    type(error_type), allocatable, intent(out) :: error
    !> If present, also estimate how the coefficients vary over the period. If present and true, also estimate how the loads vary
    logical, intent(in), optional :: forced
    real(dp), allocatable :: p(:, :, :), f(:, :)
    real(dp), dimension(system%states, system%states) :: maximum, one, power, square
    real(dp) :: sums(points), squares(points), inverse(system%states), size_of_p, unit, part
    integer :: n, i, j, k

    n = system%states
    allocate(p(points, n, n))
    ! An unallocated actual argument counts as an absent optional argument.
    if (present(forced)) then
      if (forced) allocate(f(points, n))
    end if
    call sample_by_phase(system, survey_phases, p, f)
    ! NaN propagates through the sums; the factor keeps these from overflowing.
    part = 1.0_dp / n**2
    sums = 0
    do j = 1, n
      do i = 1, n
        sums = sums + part * abs(p(:, i, j))
      end do
    end do
    if (.not. all(ieee_is_finite(sums))) then
      call fatal_error(error, "the coefficients of the system are not finite, or its mass matrix is singular", &
        & failed_computation)
      return
    end if
    ! The maximum of abs(x) over the phases, vectorised: maxval tests each element for NaN.
    maximum = 0
    do j = 1, n
      do i = 1, n
        do k = 1, points
          maximum(i, j) = max(maximum(i, j), abs(p(k, i, j)))
        end do
      end do
    end do
    survey%scale = balancing(maximum)
    ! Divide by the largest element: squares cannot overflow, and only negligible ones underflow.
    unit = max(maxval(balanced(maximum, survey%scale)), tiny(unit))
    inverse = 1 / survey%scale / unit
    squares = 0
    do j = 1, n
      do i = 1, n
        squares = squares + (p(:, i, j) * survey%scale(j) * inverse(i))**2
      end do
    end do
    k = maxloc(squares, dim=1)
    size_of_p = sqrt(squares(k) / 2) * unit
    survey%phase_advance = size_of_p * system%period
    unit = max(size_of_p, tiny(unit))
    one = balanced(p(k, :, :), survey%scale) / unit
    ! P^16 by repeated squaring into separate arrays.
    power = one
    do i = 1, 2
      square = matmul(power, power)
      power = matmul(square, square)
    end do
    survey%fastest = min(survey%phase_advance, (norm2(power) / sqrt(2.0_dp))**0.0625_dp * unit * system%period)
    survey%fade = fastest_share(one, power, unit * system%period, survey%fastest)
    if (present(forced)) call find_changes(p, system%period, survey, f)
  end subroutine survey_system

  !> Share of the fastest motion in the norm of the monodromy matrix Phi(T); between `least` and 1. `p`: matrix P, shape (n, n),
  !> in units of `unit` / T. `power`: 16th power of P. `fastest`: phase advance of the fastest motion within the period (rad).
  !>
  !> The fastest motion has a pair of eigenvalues r exp(+-i (pi / 2 + e)). Over the period it decays by the factor exp(-d), where d
  !> is the product of e and the phase advance `fastest`. The angle e follows from the traces tr P^16 = 2 r^16 cos 16 e and
  !> tr P^17 = -2 r^17 sin 17 e, in which the other motions are negligible. The trace of P gives the mean decay of the
  !> other motions. A share below `least` is raised to `least`, because the errors of the other motions, which decay more slowly,
  !> are then no longer negligible.
  pure real(dp) function fastest_share(p, power, unit, fastest) result(fade)
    real(dp), intent(in) :: p(:, :), power(:, :), unit, fastest
    real(dp), parameter :: least = 1 / 64.0_dp
    real(dp) :: decay, others, r
    integer :: n, i

    fade = 1
    n = size(p, 1)
    if (n < 4 .or. .not. unit > 0) return
    r = fastest / unit
    decay = fastest * atan2(-sum(p * transpose(power)), r * sum([(power(i, i), i = 1, n)])) / 16.5_dp
    others = (-sum([(p(i, i), i = 1, n)]) * unit - 2 * decay) / (n - 2)
    fade = max(1 / sqrt(1 + (n - 2) / 2.0_dp * exp(2 * min(decay - others, 10.0_dp))), least)
  end function fastest_share

  !> Estimates how the coefficients `p`, shape (points, n, n), and the loads `f`, shape (points, n), vary over the period. It
  !> analyses sums over all components, with quasi-random weights that keep components from cancelling.
  pure subroutine find_changes(p, period, survey, f)
    real(dp), contiguous, intent(in) :: p(:, :, :)
    real(dp), intent(in) :: period
    type(survey_type), intent(inout) :: survey
    real(dp), contiguous, intent(in), optional :: f(:, :)
    !> `any_width`: width assigned to functions that are constant or absent, for which every width is valid. `golden`: step of the
    !> quasi-random weights.
    real(dp), parameter :: any_width = 1.0e6_dp, golden = 0.6180339887498949_dp
    real(dp) :: together(points), rows(size(p, 2)), columns(size(p, 2)), maximum
    integer :: i, j

    columns = [(1 + modulo(golden * i, 1.0_dp), i = 1, size(columns))]
    rows = columns(size(columns):1:-1) / survey%scale
    columns = columns * survey%scale
    together = 0
    do j = 1, size(columns)
      do i = 1, size(rows)
        together = together + rows(i) * columns(j) * p(:, i, j)
      end do
    end do
    call fit_harmonics(together, any_width, falling(:, 1), survey%width(1), survey%height(1), maximum)
    survey%changing = maximum * period / max(survey%phase_advance, tiny(period))
    survey%width(2) = any_width
    if (.not. present(f)) return
    together = 0
    do i = 1, size(rows)
      together = together + rows(i) * f(:, i)
    end do
    call fit_harmonics(together, any_width, falling(:, 2), survey%width(2), survey%height(2), maximum)
  end subroutine find_changes

  !> Computes the largest amplitude of the harmonics of `values`, `maximum`, and fits their decay. The `width` follows from a
  !> comparison of harmonics 3 and 4 with harmonics 7 and 8. From k = 3 on, the k-th harmonic is at most `height` falling(k)
  !> exp(-k width) times the maximum of |values|.
  pure subroutine fit_harmonics(values, any_width, falling, width, height, maximum)
    real(dp), intent(in) :: values(points), any_width, falling(points / 2)
    real(dp), intent(out) :: width, height, maximum
    !> Limit on amplitudes, relative to the maximum amplitude. Smaller amplitudes are treated as rounding errors.
    real(dp), parameter :: least = 16 * epsilon(1.0_dp)
    real(dp) :: amplitude(points / 2), unit
    integer :: k

    unit = max(maxval(abs(values)), tiny(unit))
    do k = 1, points / 2
      amplitude(k) = sqrt(sum(values / unit * cosine(:, k))**2 + sum(values / unit * sine(:, k))**2) * 2 / points
    end do
    maximum = maxval(amplitude) * unit
    width = any_width
    height = 0
    if (.not. maxval(amplitude(3:)) > least) return
    amplitude = max(amplitude, least) / falling
    width = max(log(maxval(amplitude(3:4)) / maxval(amplitude(7:))) / 4, 0.0_dp)
    height = maxval([(amplitude(k) * exp(k * width), k = 3, points / 2)])
  end subroutine fit_harmonics

end module gestell_floquet_choice_survey
