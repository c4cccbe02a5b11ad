!> What results cost, in counted work: samples, evaluations, intervals, comparisons.
module test_cost
  use gestell_base_dft, only: dft
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_monodromy, only: accuracy_type
  use gestell_floquet_solution, only: evidence, evidence_type
  use gestell_model_frame, only: frame_type
  use gestell_study_analysis, only: analyse, analysis_type, tasks_type
  use machines, only: frame_of_machine
  use reference_cases, only: random_machine
  use reference_linear, only: qp
  use reference_machine, only: khang_machine, machine_data, pi_qp
  use testdrive, only: check, error_type, new_unittest, test_failed, unittest_type
  implicit none (type, external)
  private

  public :: collect_cost

contains

  subroutine collect_cost(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the discrete Fourier transform is its sum", test_dft), &
      & new_unittest("a looser tolerance takes no more samples", test_tolerance)]
  end subroutine collect_cost

  !> Of lengths with one prime factor and with several, by the sum in quadruple precision.
  subroutine test_dft(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: lengths(14) = [1, 2, 3, 4, 5, 6, 8, 12, 49, 64, 97, 360, 1021, 1024]
    complex(dp), allocatable :: x(:)
    complex(qp), allocatable :: roots(:), y(:)
    character(len=60) :: found
    real(qp) :: worst
    integer :: i, j, k, n

    do i = 1, size(lengths)
      n = lengths(i)
      x = [(cmplx(sin(0.7_dp * k**2), cos(3.1_dp * k) - 0.4_dp, dp), k = 1, n)]
      roots = [(cmplx(cos(2 * pi_qp * k / n), -sin(2 * pi_qp * k / n), qp), k = 0, n - 1)]
      y = [(sum([(x(j + 1) * roots(modulo(j * k, n) + 1), j = 0, n - 1)]), k = 0, n - 1)]
      worst = maxval(abs(dft(x) - y)) / sum(abs(x))
      ! A rounding of each root, product and sum, each on one of |x|.
      write (found, "(a, i0, a, es10.2)") "length ", n, ", error ", worst
      call check(error, worst < 4 * epsilon(1.0_dp), more=found)
      if (allocated(error)) return
    end do
  end subroutine test_dft

  !> A loose tolerance takes a method of low order with few steps; what these err by is no reason for more samples.
  subroutine test_tolerance(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    integer :: i, k

    machine = khang_machine(51160.0_dp)
    do k = 1, size(machine%supports)
      machine%supports(k)%stiffness = 28210.0_dp
    end do
    machine%frame_mass = 13700.0_dp
    call frame_of_machine(machine, frame, failure)
    if (allocated(failure)) then
      call test_failed(error, failure%message)
      return
    end if
    call compare(frame, "four-bar near a free motion", error)
    if (allocated(error)) return
    do i = 1, 8
      call frame_of_machine(random_machine(i), frame, failure)
      if (allocated(failure)) then
        call test_failed(error, failure%message)
        return
      end if
      call compare(frame, "random machine", error)
      if (allocated(error)) return
    end do
  end subroutine test_tolerance

  !> Samples of the vibration, with and without accelerations, and evaluations for its solution.
  subroutine compare(frame, name, error)
    type(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: rows(2) = [0, 12]
    !> An evaluation is not worth the same to all methods, and which is the cheapest is a forecast.
    real(dp), parameter :: forecast = 1.5_dp
    type(analysis_type) :: analysis
    type(evidence_type) :: found
    type(gestell_error), allocatable :: failure
    character(len=200) :: numbers
    integer :: i, k, samples(6), evaluations(6)

    do k = 1, size(rows)
      do i = 1, size(samples)
        call analyse(frame, tasks_type(points=32, rows=rows(k)), accuracy_type(tolerance=10.0_dp**(1 - 2 * i)), analysis, failure)
        if (allocated(failure)) then
          call test_failed(error, failure%message)
          return
        end if
        call evidence(analysis%floquet, found)
        samples(i) = 2 * size(analysis%vibration%series(1)%amplitude) + 2
        evaluations(i) = found%evaluations
      end do
      write (numbers, "(2a, 6(1x, i0), a, 6(1x, i0))") name, ": samples", samples, ", evaluations", evaluations
      call check(error, all(samples(:5) <= samples(2:)), more=numbers)
      if (allocated(error)) return
      call check(error, all([(evaluations(i) <= forecast * minval(evaluations(i + 1:)), i = 1, 5)]), more=numbers)
      if (allocated(error)) return
    end do
  end subroutine compare

end module test_cost
