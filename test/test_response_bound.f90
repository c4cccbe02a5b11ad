!> The bound on the periodic response to disturbances, against Green's function.
module test_response_bound
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_balance_response_bound, only: bound_response, response_type
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_system_second_order, only: sample_by_phase, second_order_system
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_response_bound

  !> Oscillator with periodic coefficients, in units of the crank speed:
  !> q'' + 2 (damping - swing sin theta) q' + stiffness (1 + variation cos theta) q = 0
  type, extends(second_order_system) :: oscillator
    real(dp) :: stiffness = 1, damping = 0.01_dp, variation = 0, swing = 0
  contains
    procedure :: matrices => oscillator_matrices
  end type oscillator

contains

  subroutine collect_response_bound(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [new_unittest("the bound on the response exceeds Green's function by less than a decade", test_response)]
  end subroutine collect_response_bound

  subroutine oscillator_matrices(self, t, m, b, c)
    class(oscillator), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    m = 1
    b = 2 * (self%damping - self%swing * sin(t))
    c = self%stiffness * (1 + self%variation * cos(t))
  end subroutine oscillator_matrices

  !> The largest integral over s of |G(t, s) (0, 1)|, from transition matrices by the classical Runge-Kutta method: for constant
  !> stiffness in resonance, for stiffness that varies by up to 80 %, and for damping with which motions grow in one half of the
  !> period and decay in the other. With the map of the whole period alone, only the rate of growth bounds the motion within the
  !> period.
  subroutine test_response(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: variations(*) = [0.0_dp, 0.3_dp, 0.8_dp, 0.0_dp], stiffness(*) = [1.0_dp, 2.2_dp, 2.2_dp, 30.0_dp]
    integer, parameter :: points = 48
    type(oscillator) :: system
    type(monodromy_type) :: monodromy
    type(response_type) :: response
    type(gestell_error), allocatable :: failure
    real(dp) :: phases(points), p(points, 2, 2), energies(1, 1, 2), exact
    logical :: fits
    integer :: i, k

    system%states = 2
    system%period = 2 * pi
    phases = [((k - 0.5_dp) / points, k = 1, points)]
    do i = 1, size(variations)
      system%stiffness = stiffness(i)
      system%variation = variations(i)
      system%swing = merge(1.5_dp, 0.0_dp, i == 4)
      call solve_monodromy(system, accuracy_type(), .true., monodromy, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call sample_by_phase(system, phases, p)
      energies(1, 1, :) = [system%stiffness, 1.0_dp] * monodromy%scale(1)**2
      exact = largest_response(system)
      do k = 1, 2
        if (k == 2) then
          deallocate(monodromy%segments%ends, monodromy%segments%maps)
          allocate(monodromy%segments%ends(0:1), source=[0.0_dp, 1.0_dp])
          allocate(monodromy%segments%maps(2, 2, 1), source=reshape(monodromy%phi, [2, 2, 1]))
        end if
        call bound_response(energies, 1.0_dp, monodromy, phases, p, response, fits)
        call check(error, fits, more="there is a bound")
        if (.not. allocated(error)) call check_that(error, response%gain, ">=", exact, "bound")
        if (.not. allocated(error) .and. k == 1 .and. i < 4) call check_that(error, response%gain, "<=", 10 * exact, "bound")
        if (allocated(error)) return
      end do
    end do
    ! In resonance a load cos(theta) of constant stiffness causes sin(theta)/(2 damping).
    system%stiffness = 1
    system%variation = 0
    system%swing = 0
    call check_that(error, largest_response(system), ">=", 1 / (2 * system%damping), "resonance")
  end subroutine test_response

  !> The largest integral over s of |G(t, s) (0, 1)| in the norm of the energy.
  real(dp) function largest_response(system) result(largest)
    type(oscillator), intent(in) :: system
    integer, parameter :: steps = 200
    real(dp) :: phi(2, 2, 0:steps), back(2, 2), inverted(2, 2), green(2), total, h
    integer :: k, j

    h = 2 * pi / steps
    phi(:, :, 0) = reshape([1, 0, 0, 1], [2, 2])
    do k = 1, steps
      associate (k1 => matmul(coefficient(h * (k - 1)), phi(:, :, k - 1)))
        associate (k2 => matmul(coefficient(h * (k - 0.5_dp)), phi(:, :, k - 1) + h / 2 * k1))
          associate (k3 => matmul(coefficient(h * (k - 0.5_dp)), phi(:, :, k - 1) + h / 2 * k2))
            associate (k4 => matmul(coefficient(h * k), phi(:, :, k - 1) + h * k3))
              phi(:, :, k) = phi(:, :, k - 1) + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            end associate
          end associate
        end associate
      end associate
    end do
    inverted = inverse_of(reshape([1, 0, 0, 1], [2, 2]) - phi(:, :, steps))
    largest = 0
    do k = 1, steps
      total = 0
      do j = 1, steps
        back = inverse_of(phi(:, :, j))
        green = matmul(phi(:, :, k), matmul(inverted, matmul(phi(:, :, steps), back(:, 2))))
        if (j < k) green = green + matmul(phi(:, :, k), back(:, 2))
        total = total + h * sqrt(system%stiffness * green(1)**2 + green(2)**2)
      end do
      largest = max(largest, total)
    end do

  contains

    pure function coefficient(theta) result(p)
      real(dp), intent(in) :: theta
      real(dp) :: p(2, 2)

      p(1, :) = [0.0_dp, 1.0_dp]
      p(2, :) = [-system%stiffness * (1 + system%variation * cos(theta)), -2 * (system%damping - system%swing * sin(theta))]
    end function coefficient

    pure function inverse_of(a) result(b)
      real(dp), intent(in) :: a(2, 2)
      real(dp) :: b(2, 2)

      b = reshape([a(2, 2), -a(2, 1), -a(1, 2), a(1, 1)], [2, 2]) / (a(1, 1) * a(2, 2) - a(1, 2) * a(2, 1))
    end function inverse_of

  end function largest_response

end module test_response_bound
