!> The modes of periodic systems at one speed.
module test_campbell_modes
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_study_mode_solution, only: solve_modes
  use gestell_study_mode, only: mode_type
  use gestell_system_averaged, only: averaged_system
  use gestell_system_second_order, only: second_order_system
  use machines, only: frame_of_machine
  use reference_frame, only: frame_matrices, frame_of, frame_system
  use reference_linear, only: qp
  use reference_machine, only: joint_data, khang_machine, link_data, machine_data, period, support_data
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  implicit none (type, external)
  private

  public :: collect_campbell_modes, modes_of, rotor

  !> q = g(t) y with y'' + 2 d y' + w^2 y = 0 and g = 1 + depth cos(2 pi t / T): its motion is g exp(lambda t), whatever T is.
  type, extends(second_order_system) :: modulated_type
    real(dp) :: w = 0, d = 0, depth = 0
  contains
    procedure :: matrices
  end type modulated_type

contains

  subroutine collect_campbell_modes(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("modes of constant systems satisfy the characteristic polynomial", test_constant), &
      & new_unittest("an overdamped mode has two real exponents and frequency zero", test_overdamped), &
      & new_unittest("components of a modulated vibration have their known frequencies and shares", test_components), &
      & new_unittest("uncoupled degrees of freedom yield modes along single axes", test_parts), &
      & new_unittest("with a slow crank frequencies equal the mean over frozen crank angles", test_slow), &
      & new_unittest("modes whose phase cannot be determined are reported as unknown", test_unknown_phase)]
  end subroutine collect_campbell_modes

  !> A balanced rotor on two unlike supports: all coefficients are constant.
  type(machine_data) function rotor(speed_rpm) result(machine)
    real(dp), intent(in) :: speed_rpm

    machine%speed_rpm = speed_rpm
    machine%joints = [joint_data("ground", position=[0.0_dp, 0.0_dp]), joint_data("crank", ends=[1, 0], radius=0.1_dp)]
    machine%links = [link_data(1, 2, 2.0_dp, 0.01_dp, [0.0_dp, 0.0_dp])]
    machine%frame_mass = 18
    machine%frame_inertia = 0.8_dp
    machine%origin = [-0.2_dp, 0.15_dp]
    machine%supports = [support_data([-0.3_dp, -0.2_dp], [3.0e5_dp, 4.0e5_dp], [60.0_dp, 150.0_dp], 20.0_dp), &
      & support_data([0.25_dp, -0.2_dp], [2.0e5_dp, 6.0e5_dp], [90.0_dp, 70.0_dp], -10.0_dp)]
  end function rotor

  subroutine modes_of(machine, modes, error, averaged)
    type(machine_data), intent(in) :: machine
    type(mode_type), allocatable, intent(out) :: modes(:)
    type(error_type), allocatable, intent(out) :: error
    logical, intent(in), optional :: averaged
    type(frame_type) :: frame
    type(averaged_system) :: model
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: mass(:, :)

    call frame_of_machine(machine, frame, failure)
    if (.not. allocated(failure)) then
      if (present(averaged)) then
        call frame%averaged(model)
        call solve_modes(model, accuracy_type(), modes, mass, failure)
      else
        call solve_modes(frame, accuracy_type(), modes, mass, failure)
      end if
    end if
    call check_success(error, failure)
  end subroutine modes_of

  !> The exponents are zeros of det(lambda^2 M + lambda B + C), the shapes its vectors, by both methods.
  subroutine test_constant(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(mode_type), allocatable :: modes(:)
    type(frame_system) :: reference
    real(qp) :: m(3, 3), b(3, 3), c(3, 3), h(3)
    complex(qp) :: z, shape(3), slope
    integer :: k, way
    real(qp), parameter :: step = 1.0e-10_qp

    machine = rotor(300.0_dp)
    reference = frame_of(machine)
    call frame_matrices(reference, 0.0_qp, m, b, c, h)
    do way = 1, 2
      if (way == 1) call modes_of(machine, modes, error)
      if (way == 2) call modes_of(machine, modes, error, averaged=.true.)
      if (allocated(error)) return
      do k = 1, 3
        z = cmplx(modes(k)%growth, modes(k)%frequency(), qp)
        slope = (determinant(z * (1 + step)) - determinant(z)) / (z * step)
        ! Newton's correction: how far the true zero is.
        call check_that(error, real(abs(determinant(z) / slope), dp), "<=", modes(k)%error, "exponent beyond its error")
        ! The tolerance of 1e-9 over 0.2 s, and discs as wide as condition and dimension make them.
        call check_that(error, modes(k)%error, "<", 1.0e-6_dp, "the error bound is not too wide")
        if (allocated(error)) return
        shape = modes(k)%shapes(:3, 1)
        ! The shape has the accuracy of the motion, 1e-9, relative to terms as large as |lambda^2 M|.
        call check_that(error, norm2(abs(matmul(z**2 * m + z * b + c, shape))), "<", 1.0e-7_qp * abs(z)**2 * norm2(m) &
          & * norm2(abs(shape)), "shape")
        call check_that(error, abs(modes(k)%share() - 1), "<", 1.0e-9_dp, "share")
        if (allocated(error)) return
      end do
      call check_that(error, modes(1)%frequency(), "<", modes(2)%frequency(), "order")
      call check_that(error, modes(2)%frequency(), "<", modes(3)%frequency(), "order")
      if (allocated(error)) return
    end do

  contains

    pure complex(qp) function determinant(z)
      complex(qp), intent(in) :: z
      complex(qp) :: a(3, 3)

      a = z**2 * m + z * b + c
      determinant = a(1, 1) * (a(2, 2) * a(3, 3) - a(2, 3) * a(3, 2)) - a(1, 2) * (a(2, 1) * a(3, 3) - a(2, 3) * a(3, 1)) &
        & + a(1, 3) * (a(2, 1) * a(3, 2) - a(2, 2) * a(3, 1))
    end function determinant

  end subroutine test_constant

  !> One degree of freedom with m lambda^2 + b lambda + c = 0; in the last case exp(lambda T) underflows.
  subroutine test_overdamped(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: ratios(3) = [1.5_dp, 5.0_dp, 200.0_dp]
    type(machine_data) :: machine
    type(mode_type), allocatable :: modes(:)
    real(dp) :: mass, stiffness, exact(2)
    integer :: k

    do k = 1, size(ratios)
      machine = rotor(60.0_dp)
      machine%free = [.true., .false., .false.]
      deallocate(machine%supports)
      allocate(machine%supports(0))
      mass = machine%frame_mass + machine%links(1)%mass
      stiffness = 5.0e4_dp
      machine%foundation_stiffness(1, 1) = stiffness
      machine%foundation_damping(1) = 2 * ratios(k) * sqrt(stiffness * mass)
      associate (w => sqrt(stiffness / mass), d => ratios(k))
        exact = -w * [d - sqrt(d**2 - 1), d + sqrt(d**2 - 1)]
      end associate
      call modes_of(machine, modes, error)
      if (allocated(error)) return
      call check_that(error, modes(1)%identified, "==", .true., "not overdamped")
      call check_that(error, modes(1)%real_pair, "==", .true., "not overdamped")
      call check_that(error, modes(1)%frequency(), "<=", 0.0_dp, "not overdamped")
      ! Bounds hold, up to the rounding of the closed form: d - sqrt(d^2 - 1) loses d^2 of its digits.
      call check_that(error, abs([modes(1)%growth, modes(1)%partner_growth] - exact), "<=", modes(1)%error + 4 * ratios(k)**2 &
        & * epsilon(1.0_dp) * abs(exact), "exponents")
      call check_that(error, modes(1)%error, "<", 1.0e-6_dp * abs(exact(2)), "the error bound is not too wide")
      call check_that(error, abs(modes(1)%damping_ratio() - 1), "<", 1.0e-12_dp, "damping ratio")
      if (allocated(error)) return
    end do
  end subroutine test_overdamped

  subroutine matrices(self, t, m, b, c)
    class(modulated_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    real(dp) :: g(3), inverse(3), w

    ! y = q / g: (1/g) q'' + 2 (1/g)' q' + (1/g)'' q, and so on.
    w = 2 * pi / self%period
    g = [1 + self%depth * cos(w * t), -self%depth * w * sin(w * t), -self%depth * w**2 * cos(w * t)]
    inverse = [1 / g(1), -g(2) / g(1)**2, 2 * g(2)**2 / g(1)**3 - g(3) / g(1)**2]
    m = inverse(1)
    b = 2 * inverse(2) + 2 * self%d * inverse(1)
    c = inverse(3) + 2 * self%d * inverse(2) + self%w**2 * inverse(1)
  end subroutine matrices

  !> exp(lambda t) (1 + depth cos Omega t): one component of 1 and two of depth / 2, at w and w +- Omega.
  subroutine test_components(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: depth = 0.6_dp, all = 1 + depth**2 / 2
    real(dp), parameter :: cranks(5) = [70.0_dp, 23.7_dp, 6.1_dp, 0.8_dp, 0.3_dp]
    real(dp), parameter :: dampings(5) = [0.3_dp, 0.3_dp, 0.3_dp, 0.3_dp, 15.0_dp]
    type(modulated_type) :: system
    type(mode_type), allocatable :: modes(:)
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: mass(:, :)
    real(dp) :: exact, crank
    integer :: k

    system%states = 2
    system%w = 20
    system%depth = depth
    ! Fast, about as fast as the vibration, slow: frequencies go round the circle up to 25 times. In the last case the motion
    ! falls to e^-314 of itself, and Phi(T) has several factors.
    do k = 1, size(cranks)
      crank = cranks(k)
      system%d = dampings(k)
      system%period = 2 * pi / crank
      exact = sqrt(system%w**2 - system%d**2)
      call solve_modes(system, accuracy_type(), modes, mass, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      associate (mode => modes(1))
        call check_that(error, mode%identified, "==", .true., "components")
        call check_that(error, mode%components, "==", 3, "components")
        call check_that(error, abs(mode%frequency() - exact), "<=", mode%error, "exponent")
        call check_that(error, abs(mode%growth + system%d), "<=", mode%error, "exponent")
        ! As accurate as Phi(t), 1e-9, plus rounding for the slow crank.
        call check_that(error, abs(mode%share() - 1 / all), "<", 1.0e-8_dp, "share of the first")
        if (allocated(error)) return
        call check(error, all_close(mode%shares(2:3), depth**2 / 4 / all), more="shares of the side components")
        if (allocated(error)) return
        call check_that(error, abs(sum(mode%frequencies(2:3)) - (exact + crank + abs(exact - crank))), "<", 2 * mode%error &
          & + 1.0e-12_dp, "frequencies of the side components")
        if (allocated(error)) return
      end associate
    end do

  contains

    pure logical function all_close(values, exact)
      real(dp), intent(in) :: values(:), exact

      all_close = maxval(abs(values - exact)) < 1.0e-8_dp
    end function all_close

  end subroutine test_components

  !> xi is stiffer than eta: the first mode is eta's.
  subroutine test_parts(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(mode_type), allocatable :: modes(:)
    complex(dp) :: shape(6)
    real(dp) :: mass, exact(2)
    integer :: k

    machine = khang_machine(240.0_dp)
    machine%free(3) = .false.
    deallocate(machine%supports)
    allocate(machine%supports(0))
    machine%foundation_stiffness(1, 1) = 9.0e4_dp
    machine%foundation_stiffness(2, 2) = 4.0e4_dp
    machine%foundation_damping = 0
    mass = machine%frame_mass + sum(machine%links%mass)
    exact = sqrt([4.0e4_dp, 9.0e4_dp] / mass)
    call modes_of(machine, modes, error)
    if (allocated(error)) return
    do k = 1, 2
      call check_that(error, abs(modes(k)%frequency() - exact(k)), "<=", modes(k)%error, "frequency")
      if (allocated(error)) return
      shape = modes(k)%shape()
      ! Unit vectors in the norm of the mass: exact but for rounding.
      call check_that(error, abs(abs(shape(3 - k)) - 1 / sqrt(mass)), "<", 1.0e-12_dp, "shape")
      call check_that(error, abs(shape(k)), "<=", 0.0_dp, "shape")
      if (allocated(error)) return
    end do
  end subroutine test_parts

  !> The paper's machine at 5 rpm: the crank changes the first frequency so slowly that the vibration contains many components
  !> around the mean frequency. To first order in Omega this is the mean over the turn of the frozen frame's natural frequency.
  subroutine test_slow(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: angles = 60
    type(machine_data) :: machine
    type(mode_type), allocatable :: modes(:), frozen(:)
    type(frame_system) :: reference
    type(frame_type) :: frame
    type(averaged_system) :: model
    type(gestell_error), allocatable :: failure
    real(qp) :: m(3, 3), b(3, 3), c(3, 3), h(3)
    real(dp), allocatable :: mass(:, :)
    real(qp) :: mean_mass(3, 3)
    real(dp) :: mean(3)
    integer :: k

    machine = khang_machine(5.0_dp)
    call modes_of(machine, modes, error)
    if (allocated(error)) return
    reference = frame_of(machine)
    call frame_of_machine(machine, frame, failure)
    if (.not. allocated(failure)) call frame%averaged(model)
    mean = 0
    mean_mass = 0
    do k = 1, angles
      call frame_matrices(reference, period(machine) * k / angles, m, b, c, h)
      mean_mass = mean_mass + m / angles
      model%m = real(m, dp)
      call solve_modes(model, accuracy_type(), frozen, mass, failure)
      if (allocated(failure)) exit
      mean = mean + frozen%frequency() / angles
    end do
    call check_success(error, failure)
    if (allocated(error)) return
    ! Omega^2 / w of the first order's square is 0.002; the crank's speed, by which a component more or less shows, is 0.52.
    call check_that(error, abs(modes%frequency() - mean), "<", 0.01_dp, "frequency")
    if (allocated(error)) return
    call solve_modes(frame, accuracy_type(), frozen, mass, failure)
    ! The trapezoidal rule on 60 points: the 60th harmonic of the mechanism's masses is far below rounding.
    call check_that(error, real([abs(mass - mean_mass)], dp), "<", 1.0e-12_dp, "mean mass matrix")
  end subroutine test_slow

  !> For a crank that turns once in eleven days no phase can be determined.
  subroutine test_unknown_phase(error)
    type(error_type), allocatable, intent(out) :: error
    type(mode_type), allocatable :: modes(:)

    call modes_of(khang_machine(1.0e-9_dp), modes, error)
    if (allocated(error)) return
    call check_that(error, size(modes), "==", 3, "number of modes")
    if (allocated(error)) return
    call check(error, .not. any(modes%identified), more="number of modes")
    if (allocated(error)) return
    call check(error, all(ieee_is_nan(modes%frequency())) .and. all(ieee_is_nan(modes%damping_ratio())), more="numbers")
  end subroutine test_unknown_phase

end module test_campbell_modes
