!> Systems whose coefficients are not smooth, not finite, without mass, or have an absurd period: each fault is reported by its
!> name within 100,000 calls.
module test_callbacks
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_api_system, only: motion_type, solve_system
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
  implicit none (type, external)
  private

  public :: collect_callbacks

  !> q'' + 0.1 q' + 2 q = cos(t) with period 2 pi, modified by `fault`.
  type, extends(second_order_system) :: faulty_type
    character(len=12) :: fault = ""
    integer, pointer :: calls => null()
  contains
    procedure :: matrices
    procedure :: load
  end type faulty_type

  !> The same system as x' = P x + f with x = (q, q').
  type, extends(periodic_system) :: first_order_type
    type(faulty_type) :: inner
  contains
    procedure :: matrix
    procedure :: forcing
  end type first_order_type

  integer, parameter :: most_calls = 100000

contains

  subroutine collect_callbacks(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("faulty user coefficients are refused with an error that names them", test_faults), &
      & new_unittest("faults of first-order systems are named, and sound ones solved as of second order", test_first_order), &
      & new_unittest("a sharp but smooth pulse is integrated without complaint", test_smooth), &
      & new_slow("rapidly oscillating coefficients and tiny masses are not mistaken for faults", test_demanding_coefficients)]
  end subroutine collect_callbacks

  subroutine test_faults(error)
    type(error_type), allocatable, intent(out) :: error

    call expect("jump", "the stiffness matrix C jumps near t = 2.", error)
    if (.not. allocated(error)) call expect("load jump", "the load h jumps near t = 2.", error)
    if (.not. allocated(error)) call expect("noise", "the stiffness matrix C is not a smooth function of time", error)
    if (.not. allocated(error)) call expect("no mass", "the mass matrix is singular at all times", error)
    if (.not. allocated(error)) call expect("mass turns", "the mass matrix is singular at t = 1.5708", error)
    if (.not. allocated(error)) call expect("NaN mass", "the mass matrix M is NaN or infinite at t =", error)
    if (.not. allocated(error)) call expect("NaN load", "the load h is NaN or infinite at t =", error)
    if (.not. allocated(error)) call expect("infinite", "the damping matrix B is NaN or infinite at t =", error)
    if (.not. allocated(error)) call expect("period", "the period of 1", error)
  end subroutine test_faults

  subroutine test_first_order(error)
    type(error_type), allocatable, intent(out) :: error
    type(faulty_type) :: second
    type(first_order_type) :: first
    type(motion_type) :: motions(2)
    type(gestell_error), allocatable :: failure
    integer, target, volatile :: calls

    call expect("jump", "the matrix P jumps near t = 2.", error, first_order=.true.)
    if (.not. allocated(error)) call expect("load jump", "the load f jumps near t = 2.", error, first_order=.true.)
    if (.not. allocated(error)) call expect("noise", "the matrix P is not a smooth function of time", error, first_order=.true.)
    if (.not. allocated(error)) call expect("infinite", "the matrix P is NaN or infinite at t =", error, first_order=.true.)
    if (.not. allocated(error)) call expect("NaN load", "the load f is NaN or infinite at t =", error, first_order=.true.)
    if (.not. allocated(error)) call expect("period", "the period of 1", error, first_order=.true.)
    if (allocated(error)) return
    calls = 0
    second%calls => calls
    second%states = 2
    second%period = 2 * pi
    first%states = 2
    first%period = 2 * pi
    first%inner = second
    call solve_system(second, motions(1), failure, tolerance=1.0e-10_dp, points=16)
    call check_success(error, failure)
    call solve_system(first, motions(2), failure, tolerance=1.0e-10_dp, points=16)
    call check_success(error, failure)
    if (allocated(error)) return
    ! to the sum of the tolerances
    call check_that(error, abs(motions(1)%multipliers - motions(2)%multipliers), "<=", 2.0e-10_dp, "multipliers")
    call check_that(error, reshape(abs(motions(1)%x - motions(2)%x), [size(motions(1)%x)]), "<=", &
      & 2.0e-10_dp * maxval(abs(motions(1)%x)), "motion")
  end subroutine test_first_order

  !> Checks that the failure of a system begins with this message and comes within bounded work. (Traps are off: NaN is
  !> intended.)
  subroutine expect(fault, message, error, first_order)
    character(len=*), intent(in) :: fault, message
    type(error_type), allocatable, intent(out) :: error
    !> True: a system of first order
    logical, intent(in), optional :: first_order
    type(faulty_type) :: system
    type(first_order_type) :: of_first_order
    type(motion_type) :: motion
    type(gestell_error), allocatable :: failure
    integer, target, volatile :: calls
    character(len=:), allocatable :: came
    logical :: traps(size(ieee_usual))

    call ieee_get_halting_mode(ieee_usual, traps)
    call ieee_set_halting_mode(ieee_usual, .false.)
    calls = 0
    system%states = 2
    system%period = 2 * pi
    if (fault == "period") system%period = 1.0e9_dp
    system%fault = fault
    system%calls => calls
    if (present(first_order)) then
      of_first_order%states = system%states
      of_first_order%period = system%period
      of_first_order%inner = system
      call solve_system(of_first_order, motion, failure, tolerance=1.0e-10_dp, points=16)
    else
      call solve_system(system, motion, failure, tolerance=1.0e-10_dp, points=16)
    end if
    call ieee_set_flag(ieee_usual, .false.)
    call ieee_set_halting_mode(ieee_usual, traps)
    came = "no failure"
    if (allocated(failure)) came = failure%message
    call check(error, index(came, message) == 1, more=fault // ": " // came)
    if (.not. allocated(error)) call check_that(error, real(calls, dp), "<=", real(most_calls, dp), fault // ", calls")
  end subroutine expect

  !> A pulse as sharp as a thousandth of the period is smooth; its integration takes more calls than there are before the first
  !> check for smoothness.
  subroutine test_smooth(error)
    type(error_type), allocatable, intent(out) :: error
    type(faulty_type) :: system
    type(motion_type) :: motion
    type(gestell_error), allocatable :: failure
    integer, target, volatile :: calls

    calls = 0
    system%states = 2
    system%period = 2 * pi
    system%fault = "pulse"
    system%calls => calls
    call solve_system(system, motion, failure, tolerance=1.0e-12_dp, points=16)
    call check_success(error, failure)
    if (.not. allocated(error)) call check_that(error, real(calls, dp), ">", 60000.0_dp, "calls")
    ! Liouville: rho_1 rho_2 = exp(-0.1 * 2 pi)
    if (.not. allocated(error)) call check(error, real(product(motion%multipliers), dp), exp(-0.2_dp * pi), thr=1.0e-11_dp)
  end subroutine test_smooth

  !> A stiffness of order 1000, which the first check does not resolve, and 17 masses of 1e-20, whose product underflows.
  subroutine test_demanding_coefficients(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: kinds(2) = ["fast ", "light"]
    integer, parameter :: states(2) = [2, 34]
    type(faulty_type) :: system
    type(motion_type) :: motion
    type(gestell_error), allocatable :: failure
    integer, target, volatile :: calls
    integer :: k

    do k = 1, 2
      calls = 0
      system%states = states(k)
      system%period = 2 * pi
      system%fault = kinds(k)
      system%calls => calls
      call solve_system(system, motion, failure, tolerance=1.0e-9_dp, points=16)
      call check_success(error, failure, kinds(k))
      if (.not. allocated(error)) call check_that(error, real(calls, dp), ">", 60000.0_dp, kinds(k) // ": calls, enough for a look")
      ! Liouville: the trace of M^-1 B is 0.1 or 17 * 0.05
      if (.not. allocated(error)) call check_that(error, abs(sum(log(abs(motion%multipliers))) &
        & + 2 * pi * merge(0.1_dp, 0.85_dp, k == 1)), "<=", 1.0e-8_dp, kinds(k) // ": log of the determinant")
      if (allocated(error)) return
    end do
  end subroutine test_demanding_coefficients

  subroutine matrices(self, t, m, b, c)
    class(faulty_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    real(dp) :: phase
    integer :: i

    self%calls = self%calls + 1
    m = 1
    b = 0.1_dp
    c = 2 + cos(t) / 2
    select case (self%fault)
    case ("jump")
      if (t > 2.2_dp) c = c + 0.3_dp
    case ("noise")
      phase = modulo(self%calls * 0.7548776662466927_dp, 1.0_dp)
      c = c + 1.0e-3_dp * phase
    case ("no mass")
      m = 0
    case ("mass turns")
      m = cos(t)
    case ("NaN mass")
      if (t > 3) m = sqrt(3 - t)
    case ("infinite")
      if (t > 3) b = exp(1000 * t)
    case ("fast")
      c = 1 + 0.3_dp * cos(1000 * t)
    case ("light")
      m = 0
      do i = 1, size(m, 1)
        m(i, i) = 1.0e-20_dp
      end do
      b = 0.05_dp * m
      c = (1 + 0.3_dp * cos(t) / (1.3_dp + sin(100 * t))) * m
    case ("pulse")
      c = c + 0.1_dp / (1.0e-6_dp + sin((t - 1) / 2)**2) * 1.0e-4_dp
    case default
      continue
    end select
  end subroutine matrices

  subroutine load(self, t, h)
    class(faulty_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    self%calls = self%calls + 1
    h = cos(t)
    if (self%fault == "light") h = 1.0e-20_dp * h
    if (self%fault == "load jump" .and. t > 2.2_dp) h = h + 1
    if (self%fault == "NaN load" .and. t > 3) h = sqrt(3 - t)
  end subroutine load

  subroutine matrix(self, t, p)
    class(first_order_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp), dimension(1, 1) :: m, b, c

    call self%inner%matrices(t, m, b, c)
    p(1, :) = [0.0_dp, 1.0_dp]
    p(2, :) = -[c(1, 1), b(1, 1)] / m(1, 1)
  end subroutine matrix

  subroutine forcing(self, t, f)
    class(first_order_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    f(1) = 0
    call self%inner%load(t, f(2:))
  end subroutine forcing

end module test_callbacks
