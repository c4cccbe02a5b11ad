!> The survey of a system before it is solved, and the number of steps that is predicted from it.
module test_prediction
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_choice_methods, only: new_method
  use gestell_floquet_choice_prediction, only: first_steps
  use gestell_floquet_integrator_method, only: method_type, unresolved_type
  use gestell_floquet_period_convergence, only: unresolved_errors
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_choice_survey, only: growth, survey_system, survey_type
  use gestell_system_periodic, only: periodic_system
  use systems, only: oscillators_type
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_prediction

  !> x' = -rate K(t; a, -3/2) x + K(t; b, 1), period 1, with K(t; r, p) = 1 + 2 sum of k^p r^k cos 2 pi k t, as harmonics fall where
  !> a function and where its second derivative have a branch point; Phi(t) = exp(-rate (integral of K)), Phi(1) = exp(-rate).
  type, extends(periodic_system) :: kernel_type
    real(dp) :: rate = 0.5_dp, a = 0, b = 0
    !> Amplitude of the additional eighth harmonic, a cosine.
    real(dp) :: eighth = 0
  contains
    procedure :: matrix => kernel_matrix
    procedure :: forcing => kernel_forcing
  end type kernel_type

contains

  subroutine collect_prediction(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the measured decay of harmonics agrees with known functions", test_widths), &
      & new_unittest("the eighth harmonic of an even function is not missed", test_eighth), &
      & new_unittest("the decay of the fastest motion agrees with the closed form", test_decay), &
      & new_unittest("the quadrature error for fast vibrations agrees with the closed form", test_not_averaged), &
      & new_unittest("constant coefficients need no steps; loads count only if requested", test_constant), &
      & new_unittest("the predicted number of steps suffices and is not much too large", test_first_steps)]
  end subroutine collect_prediction

  pure real(dp) function kernel(t, r, power)
    real(dp), intent(in) :: t, r, power
    integer :: k

    ! 0.5^70 is below roundoff.
    kernel = 1 + 2 * sum([(k**power * r**k * cos(2 * pi * k * t), k = 1, 70)])
  end function kernel

  subroutine kernel_matrix(self, t, p)
    class(kernel_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    p = -self%rate * (kernel(t, self%a, growth(1)) + self%eighth * cos(16 * pi * t))
  end subroutine kernel_matrix

  subroutine kernel_forcing(self, t, f)
    class(kernel_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    f = kernel(t, self%b, growth(2))
  end subroutine kernel_forcing

  pure type(kernel_type) function new_kernel(a, b) result(system)
    real(dp), intent(in) :: a, b

    system%states = 1
    system%period = 1
    system%a = a
    system%b = b
  end function new_kernel

  !> The width is -ln r; what 16 samples fold back adds r^2 to the seventh harmonic, 2 % to the width at most.
  subroutine test_widths(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: ratios(*) = [0.05_dp, 0.1_dp, 0.2_dp, 0.3_dp, 0.4_dp]
    type(survey_type) :: survey
    type(gestell_error), allocatable :: failure
    real(dp) :: maximum(2)
    integer :: i

    do i = 1, size(ratios)
      call survey_system(new_kernel(ratios(i), ratios(size(ratios) + 1 - i)), survey, failure, .true.)
      call check_success(error, failure)
      if (allocated(error)) return
      call check_that(error, abs(survey%width / (-log([ratios(i), ratios(size(ratios) + 1 - i)])) - 1), "<", 0.05_dp, "widths")
      if (allocated(error)) return
      ! Amplitudes are 2 k^p r^k relative to the maximum; 2 % of the width, 3 at most, count eight times.
      maximum = [kernel(0.0_dp, ratios(i), growth(1)), kernel(0.0_dp, ratios(size(ratios) + 1 - i), growth(2))]
      call check_that(error, abs(log(survey%height * maximum / 2)), "<", 0.5_dp, "heights")
      ! K changes by 2 r around its mean; its size, relative to which this is measured, is its maximum over sqrt 2. Weights are
      ! 1 to 2.
      call check_that(error, abs(survey%changing / (4 * sqrt(2.0_dp) * ratios(i) / maximum(1)) - 1), "<", 1.0_dp, &
        & "part that changes")
      if (allocated(error)) return
    end do
  end subroutine test_widths

  !> `survey_phases` are offset from the multiples of T / 16, so that the sixteen samples are not all zero.
  subroutine test_eighth(error)
    type(error_type), allocatable, intent(out) :: error
    type(kernel_type) :: system
    type(survey_type) :: survey
    type(gestell_error), allocatable :: failure

    system = new_kernel(0.0_dp, 0.0_dp)
    system%eighth = 0.1_dp
    call survey_system(system, survey, failure, .true.)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, survey%width(1), "<=", 0.0_dp, "harmonics that do not decay")
    call check_that(error, survey%changing, ">", 0.05_dp, "part that changes")
  end subroutine test_eighth

  !> Uncoupled vibrations: |Phi(T)| and the share of the fastest one are known, exp(-d) of each, d = damping T / 2. Both angles
  !> are rounded to 16.5 e, and units to powers of two: this changes d = 2.5 in 40 radians by 2 %, exp(-d) by 5 %, and 0.4 and
  !> 0.8 to 0.6 and 0.6, which are 1 % less.
  subroutine test_decay(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: damping(3, 4) = reshape([0.0_dp, 0.0_dp, 0.0_dp, 0.2_dp, 0.2_dp, 2.0_dp, 0.4_dp, 0.8_dp, 5.0_dp, &
      & 1.0_dp, 1.0_dp, 0.1_dp], [3, 4])
    type(survey_type) :: survey
    type(gestell_error), allocatable :: failure
    real(dp) :: left(3)
    integer :: i

    do i = 1, size(damping, 2)
      call survey_system(oscillators_type(states=6, period=1.0_dp, square=[3.0_dp, 11.0_dp, 40.0_dp]**2, damping=damping(:, i), &
        & amplitude=[0.0_dp, 0.0_dp, 0.0_dp]), survey, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      left = exp(-damping(:, i) / 2)
      call check_that(error, abs(survey%fade / (left(3) / norm2(left)) - 1), "<", 0.06_dp, "fade")
      if (allocated(error)) return
    end do
  end subroutine test_decay

  !> (z / 2)^s / (1 3 ... (2 s - 1)) times the missed part, a quarter of the load: a third of it for two nodes and z = 2, all of
  !> it if z is large. The part of cos(z t) along P_2, 5 (3 j_1(z/2) / (z/2) - j_0(z/2)), is less.
  subroutine test_not_averaged(error)
    type(error_type), allocatable, intent(out) :: error
    type(unresolved_type) :: unresolved
    real(dp), parameter :: scale(2) = 1, x = 1
    real(dp) :: left(2)

    unresolved%missed = 1
    unresolved%load = 4
    left = unresolved_errors(unresolved, scale, 1.0_dp, 2 * x, 2)
    call check_that(error, abs(left(2) - 1 / 12.0_dp), "<", 1.0e-15_dp, "a third")
    call check_that(error, left(2), ">", 5 * (3 * (sin(x) / x**2 - cos(x) / x) / x - sin(x) / x) / 4, "the part of cos")
    if (allocated(error)) return
    left = unresolved_errors(unresolved, scale, 1.0_dp, 1.0e300_dp, 10)
    call check_that(error, abs(left(2) - 0.25_dp), "<", 1.0e-15_dp, "all")
    call check_that(error, abs(left(1)), "<=", 0.0_dp, "no error of Phi(T)")
  end subroutine test_not_averaged

  !> Constant coefficients and loads require no steps.
  subroutine test_constant(error)
    type(error_type), allocatable, intent(out) :: error
    type(survey_type) :: survey, alone
    type(gestell_error), allocatable :: failure

    call survey_system(new_kernel(0.0_dp, 0.3_dp), survey, failure, .true.)
    if (.not. allocated(failure)) call survey_system(new_kernel(0.0_dp, 0.3_dp), alone, failure, .false.)
    call check_success(error, failure)
    if (allocated(error)) return
    call check_that(error, survey%width(1), ">", 1.0e3_dp, "constant coefficients")
    call check_that(error, survey%width(2), "<", 2.0_dp, "loads")
    call check_that(error, alone%width(2), ">", 1.0e3_dp, "loads that are not requested")
  end subroutine test_constant

  !> Phi(1) is known in closed form. Of 20 tolerances and ratios two at most may need a second number of steps.
  subroutine test_first_steps(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: ratios(*) = [0.05_dp, 0.2_dp, 0.4_dp, 0.5_dp]
    class(method_type), allocatable :: method
    type(kernel_type) :: system
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure
    real(dp) :: tolerance
    integer :: i, k, second

    second = 0
    do k = 4, 12, 2
      tolerance = 10.0_dp**(-k)
      do i = 1, size(ratios)
        system = new_kernel(ratios(i), ratios(i))
        call solve_monodromy(system, accuracy_type(tolerance=tolerance, method="gauss8"), .true., monodromy, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call check_that(error, abs(monodromy%phi(1, 1) - exp(-system%rate)), "<=", monodromy%error, "Phi")
        call check_that(error, monodromy%error, "<=", tolerance * monodromy%norm, "requested tolerance")
        if (allocated(error)) return
        if (monodromy%evaluations > monodromy%steps * monodromy%method%stages) second = second + 1
        ! For 12 digits 24 steps are needed if only the finest feature is known.
        if (i == 1) call check_that(error, monodromy%steps, "==", 8, "harmonics that decay by 20")
        if (allocated(error)) return
      end do
    end do
    call check_that(error, second, "<=", 2, "second numbers of steps")
    if (allocated(error)) return
    call new_method("gauss8", method, failure)
    call check_that(error, first_steps(method, system, survey_type(1.0_dp, 1.0_dp, [9.0_dp, 2.0_dp]), 1.0e-9_dp), "<", &
      & first_steps(method, system, survey_type(1.0_dp, 1.0_dp, [9.0_dp, 1.0_dp]), 1.0e-9_dp), "wider loads")
    call check_that(error, first_steps(method, system, survey_type(1.0_dp, 1.0_dp, [9.0_dp, 1.0_dp], [1.0_dp, 1.0e-4_dp]), &
      & 1.0e-9_dp), "<", first_steps(method, system, survey_type(1.0_dp, 1.0_dp, [9.0_dp, 1.0_dp]), 1.0e-9_dp), "lower loads")
    ! (1 / 64)^(1 / 16) is 0.77.
    call check_that(error, first_steps(method, system, survey_type(80.0_dp, 80.0_dp, [9.0_dp, 9.0_dp], fade=1 / 64.0_dp), &
      & 1.0e-12_dp), "<", first_steps(method, system, survey_type(80.0_dp, 80.0_dp, [9.0_dp, 9.0_dp]), 1.0e-12_dp), &
      & "a fast motion that dies out")
    ! Of no digits, and where the embedded methods have matrices to eliminate.
    call check_that(error, first_steps(method, system, survey_type(88.0_dp, 88.0_dp, [9.0_dp, 9.0_dp]), 1.0e6_dp), ">=", 16.0_dp, &
      & "5.5 radians in a step of an even number of stages")
    deallocate(method)
    call new_method("gauss9", method, failure)
    call check_that(error, first_steps(method, system, survey_type(88.0_dp, 88.0_dp, [9.0_dp, 9.0_dp]), 1.0e6_dp), ">=", 8.8_dp, &
      & "10 radians of an odd one")
  end subroutine test_first_steps

end module test_prediction
