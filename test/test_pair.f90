!> A method with the two that are embedded in it: the basis in which one elimination serves all of them, and what they tell of the
!> error.
module test_pair
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: text
  use gestell_floquet_integrator_nested, only: nested_tableau, nested_type
  use gestell_floquet_integrator_tableau, only: find_legendre, gauss_tableau
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, solve_periodic
  use gestell_math_matrix, only: balanced
  use gestell_system_periodic, only: periodic_system
  use systems, only: mathieu_type, oscillators_type, plain_type
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_pair

contains

  subroutine collect_pair(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("unknowns and equations of the embedded methods", test_nested), &
      & new_unittest("extrapolation of a vibration's phase", test_phase), &
      & new_unittest("a motion that dies out below the smallest number", test_dying), &
      & new_unittest("errors of Mathieu's equation and their bounds", test_mathieu), &
      & new_unittest("a load that all embedded methods see alike", test_load), &
      & new_unittest("a start of steps that extrapolation corrected", test_added)]
  end subroutine collect_pair

  !> Polynomials of degree s - 2 have nothing of the last unknown, of degree s - 3 nothing of the last two; residuals along P_s-1
  !> are not seen in the equations of the others, along P_s-2 not in those before the last two; the tails are Legendre's
  !> coefficients over the roots of 2 k + 1.
  subroutine test_nested(error)
    type(error_type), allocatable, intent(out) :: error
    !> Sums of up to ten terms of size 1.
    real(dp), parameter :: rounding = 40 * epsilon(1.0_dp)
    type(nested_type) :: nested
    real(dp), allocatable :: v(:), p(:, :)
    real(dp) :: worst
    integer :: s, k, j

    do s = 6, 10
      nested = nested_tableau(gauss_tableau(s))
      worst = 0
      do k = 0, s - 2
        v = nested%c**k
        ! v = X u with u_s = 0, and u_s-1 = 0 below degree s - 2.
        worst = max(worst, abs(v(s) - dot_product(nested%values(2, :s - 2), v(:s - 2)) - nested%values(2, s - 1) &
          & * (v(s - 1) - dot_product(nested%values(1, :s - 2), v(:s - 2)))))
        if (k < s - 2) worst = max(worst, abs(v(s - 1) - dot_product(nested%values(1, :s - 2), v(:s - 2))))
      end do
      if (allocated(p)) deallocate(p)
      allocate(p(s, s))
      call find_legendre(s - 1, 2 * nested%c - 1, p)
      associate (of_high => p(:, s), of_next => p(:, s - 1), sums => nested%sums)
        worst = max(worst, maxval(abs(of_high(:s - 1) + sums(:s - 1, 1) * of_high(s - 1) + sums(:s - 1, 2) * of_high(s))))
        worst = max(worst, maxval(abs(of_next(:s - 2) + sums(:s - 2, 1) * of_next(s - 1) + sums(:s - 2, 2) * of_next(s))))
      end associate
      do k = 1, 4
        do j = 0, s - 1
          worst = max(worst, abs(dot_product(nested%tails(:, k), p(:, j + 1)) * sqrt(2 * j + 1.0_dp) &
            & - merge(1, 0, j == s - 5 + k)))
        end do
      end do
      call check_that(error, worst, "<=", rounding, "stages " // text(s))
      if (allocated(error)) return
    end do
  end subroutine test_nested

  !> Of an oscillator, with positions or as x' = P x, a method with s stages leaves N steps' phase errors c_s z^(2 s + 1), z the
  !> angle in a step, as the Pade approximation does, and extrapolation a third of that at most, where it would leave half or more
  !> with the r of the other form. Oracle: closed forms. The frequency is a power of two, as the units are: in these an error d of
  !> the phase is sqrt(2) d in Phi(T).
  subroutine test_phase(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: frequency = 128, period = pi / 1.1_dp, angle = frequency * period
    !> The terms of the series that follow, where z is half of s.
    real(dp), parameter :: leading = 0.5_dp, part = 0.3_dp
    type(mathieu_type) :: oscillator
    type(plain_type) :: plain
    type(accuracy_type) :: accuracy
    class(periodic_system), allocatable :: system
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: exact(2, 2), of_steps, extrapolated, phase
    integer :: s, k, form

    accuracy%tolerance = 1.0e-8_dp
    oscillator = mathieu_type(states=2, period=period, a=frequency**2, q=0.0_dp)
    plain%states = 2
    plain%period = period
    allocate(plain%system, source=oscillator)
    exact = reshape([cos(angle), -frequency * sin(angle), sin(angle) / frequency, cos(angle)], [2, 2])
    do form = 1, 2
      if (form == 1) allocate(system, source=oscillator)
      if (form == 2) allocate(system, source=plain)
      do s = 6, 10
        accuracy%method = "gauss" // text(s)
        call solve_monodromy(system, accuracy, .false., monodromy, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        phase = angle
        do k = 1, s
          phase = phase * (angle / monodromy%steps)**2 / (4 * (4 * k**2 - 1))
        end do
        extrapolated = norm2(balanced(monodromy%phi - exact, monodromy%scale))
        of_steps = norm2(balanced(monodromy%phi - monodromy%phi_added - exact, monodromy%scale))
        call check_that(error, abs(of_steps / (sqrt(2.0_dp) * phase) - 1), "<=", leading, "of steps, stages " // text(s))
        if (allocated(error)) return
        call check_that(error, of_steps, "<=", monodromy%error_of_steps(), "bound of the steps, stages " // text(s))
        if (allocated(error)) return
        call check_that(error, extrapolated, "<=", part * of_steps, "extrapolated, stages " // text(s) // ", form " // text(form))
        if (allocated(error)) return
      end do
      deallocate(system)
    end do
  end subroutine test_phase

  !> An oscillator whose motion ends below the smallest number, whatever the units: the differences of such maps tell nothing, and
  !> are not taken for what does not converge.
  subroutine test_dying(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: frequencies(2) = [500.0_dp, 600.0_dp]
    type(oscillators_type) :: system
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    type(accuracy_type) :: accuracy
    integer :: k, stages

    accuracy%tolerance = 1.0e-8_dp
    do k = 1, size(frequencies)
      system = oscillators_type(states=2, period=1.0_dp, square=[frequencies(k)**2], damping=[1.8_dp * frequencies(k)], &
        & amplitude=[1.0_dp], sharpness=1.0_dp)
      do stages = 6, 10
        accuracy%method = "gauss" // text(stages)
        call solve_monodromy(system, accuracy, .false., monodromy, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call check_that(error, norm2(monodromy%phi), "<=", monodromy%error, "Phi, stages " // text(stages))
        if (allocated(error)) return
      end do
    end do
  end subroutine test_dying

  !> Phi(T) of Mathieu's equation, from slow to fast, by every method that has others embedded, is within its bound, the bound
  !> within the tolerance, and not wide: less than 1000 times what is missed, where that is no rounding. Oracle: ten times the
  !> digits.
  subroutine test_mathieu(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: turns(3) = [1.0_dp, 12.0_dp, 70.0_dp], tolerances(3) = [1.0e-4_dp, 1.0e-7_dp, 1.0e-10_dp]
    type(mathieu_type) :: system
    type(monodromy_type) :: exact, monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: missed
    type(accuracy_type) :: accuracy
    integer :: i, k, stages

    do i = 1, size(turns)
      system = mathieu_type(states=2, period=pi, a=(turns(i) / pi)**2, q=0.2_dp * (turns(i) / pi)**2)
      call solve_monodromy(system, accuracy_type(tolerance=1.0e-13_dp, method="gauss5"), .false., exact, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      do k = 1, size(tolerances)
        do stages = 6, 10
          accuracy%tolerance = tolerances(k)
          accuracy%method = "gauss" // text(stages)
          call solve_monodromy(system, accuracy, .false., monodromy, failure)
          call check_success(error, failure)
          if (allocated(error)) return
          missed = norm2(balanced(monodromy%phi - exact%phi, monodromy%scale))
          call check_that(error, missed, "<=", monodromy%error + exact%error, "error, stages " // text(stages))
          if (allocated(error)) return
          call check_that(error, monodromy%error, "<=", tolerances(k) * monodromy%norm, "bound")
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_mathieu

  !> The start of a slow oscillator's motion under a load with many harmonics: the methods hardly differ, as all of them take the
  !> load at the same nodes, and the error is told all the same. Oracle: the series of the motion.
  subroutine test_load(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: sharpness(3) = [1.0_dp, 0.3_dp, 0.1_dp]
    type(oscillators_type) :: system
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: periodic
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: missed(:)
    type(accuracy_type) :: accuracy
    integer :: i, k, stages

    do i = 1, size(sharpness)
      system = oscillators_type(states=2, period=1.0_dp, square=[0.2_dp], damping=[0.1_dp], amplitude=[1.0_dp], &
        & sharpness=sharpness(i))
      do stages = 6, 10
        do k = 2, 10, 4
          accuracy%tolerance = 10.0_dp**(-k)
          accuracy%method = "gauss" // text(stages)
          call solve_monodromy(system, accuracy, .true., monodromy, failure)
          if (.not. allocated(failure)) call solve_periodic(monodromy, periodic, failure)
          call check_success(error, failure)
          if (allocated(error)) return
          missed = abs(periodic%x0 - system%start())
          call check_that(error, maxval(missed / periodic%error), "<=", 1.0_dp, "error over bound, stages " // text(stages))
          if (allocated(error)) return
        end do
      end do
    end do
  end subroutine test_load

  !> Of a map that extrapolation corrected, and that is exact then, x0 is the start that closes the steps, and its error the
  !> distance to the start that closes the map. Oracle: both by Cramer's rule.
  subroutine test_added(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: phi(2, 2) = reshape([0.3_dp, -0.8_dp, 0.7_dp, 0.4_dp], [2, 2]), xp(2) = [1.0_dp, 2.0_dp], &
      & phi_added(2, 2) = reshape([1.0e-3_dp, 2.0e-3_dp, -3.0e-3_dp, 1.0e-3_dp], [2, 2]), xp_added(2) = [1.0e-3_dp, -2.0e-3_dp]
    !> More is told where a multiplier is near 1: it is not.
    real(dp), parameter :: most = 2, rounding = 1.0e-14_dp
    type(monodromy_type) :: monodromy
    type(periodic_solution_type) :: periodic
    type(gestell_error), allocatable :: failure
    real(dp) :: missed(2)

    monodromy%phi = phi
    monodromy%xp = xp
    monodromy%scale = [1.0_dp, 1.0_dp]
    monodromy%norm = norm2(phi)
    monodromy%phi_added = phi_added
    monodromy%xp_added = xp_added
    allocate(monodromy%phi_change(2, 2, 1), source=0.0_dp)
    allocate(monodromy%xp_change(2, 1), source=0.0_dp)
    call solve_periodic(monodromy, periodic, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, maxval(abs(periodic%x0 - start(phi - phi_added, xp - xp_added))), "<=", rounding, "start")
    if (allocated(error)) return
    missed = abs(periodic%x0 - start(phi, xp))
    call check_that(error, maxval(missed / periodic%error), "<=", 1.0_dp, "error over bound")
    if (allocated(error)) return
    call check_that(error, maxval(periodic%error), "<=", most * maxval(missed), "bound")

  contains

    pure function start(a, b)
      real(dp), intent(in) :: a(2, 2), b(2)
      real(dp) :: start(2)

      start = [(1 - a(2, 2)) * b(1) + a(1, 2) * b(2), a(2, 1) * b(1) + (1 - a(1, 1)) * b(2)] &
        & / ((1 - a(1, 1)) * (1 - a(2, 2)) - a(1, 2) * a(2, 1))
    end function start

  end subroutine test_added

end module test_pair
