!> Results without accurate digits are reported as lost: too few given steps, numbers whose squares underflow.
module test_unreliable
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_choice_methods, only: method_names
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_floquet_multipliers, only: multipliers_type, solve_multipliers
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type, solve_periodic
  use gestell_model_frame, only: frame_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use machines, only: frame_of_machine
  use population_check, only: truth_of, truth_type
  use population_machines, only: specimen, specimen_type
  use reference_linear, only: qp
  use reference_machine, only: khang_machine, machine_data
  use slow_tests, only: new_slow
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_unreliable

contains

  subroutine collect_unreliable(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_slow("all methods with any number of steps keep their error bounds", test_given_steps), &
      & new_unittest("far too few steps give an undecided verdict and no vibration", test_too_few), &
      & new_unittest("error bounds hold for links with almost no mass", test_small_masses)]
  end subroutine collect_unreliable

  !> Random machines with all methods and numbers of steps from far too few to enough, against quadruple precision. A multiplier
  !> that is not lost holds its bound relative to the true one too.
  subroutine test_given_steps(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: machines = 12, steps(7) = [1, 2, 3, 7, 19, 24, 60]
    character(len=:), allocatable :: names(:)
    type(specimen_type) :: one
    type(truth_type) :: truth
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    integer :: i, k, m, determined, lost
    character(len=60) :: counts

    allocate(names, source=pack(method_names(), method_names() /= "auto"))
    determined = 0
    lost = 0
    do i = 1, machines
      one = specimen(i, 30.0_dp)
      truth = truth_of(one%machine)
      call frame_of_machine(one%machine, frame, failure)
      if (allocated(failure)) cycle
      do m = 1, size(names)
        do k = 1, size(steps)
          call check_claim(frame, truth, accuracy_type(method=trim(names(m)), steps=steps(k)), determined, lost, error)
          if (allocated(error)) return
        end do
      end do
    end do
    write(counts, "(i0, a, i0, a)") determined, " determined, ", lost, " lost"
    call check_that(error, determined, ">", 500, trim(counts))
    call check_that(error, lost, ">", 500, trim(counts))
  end subroutine test_given_steps

  subroutine check_claim(frame, truth, accuracy, determined, lost, error)
    type(frame_type), intent(in) :: frame
    type(truth_type), intent(in) :: truth
    type(accuracy_type), intent(in) :: accuracy
    integer, intent(inout) :: determined, lost
    type(error_type), allocatable, intent(out) :: error
    type(monodromy_type) :: monodromy
    type(multipliers_type) :: multipliers
    type(periodic_solution_type) :: solution
    type(gestell_error), allocatable :: failure
    character(len=120) :: label
    real(dp) :: distance
    integer :: k

    call solve_monodromy(frame, accuracy, .true., monodromy, failure)
    if (.not. allocated(failure)) call solve_multipliers(monodromy, .false., multipliers, failure)
    if (allocated(failure)) return
    do k = 1, size(multipliers%rho)
      distance = real(minval(abs(multipliers%rho(k) - truth%rho)), dp)
      ! Relative to the library's result, and not written as a product, which would overflow for lost results.
      distance = distance / max(abs(multipliers%rho(k)), tiny(1.0_dp))
      write(label, "(2a, i0, a, 3es10.2)") accuracy%method, " with ", accuracy%steps, ": |rho|, error, true error ", &
        & abs(multipliers%rho(k)), multipliers%error(k), distance
      call check_that(error, distance, "<=", multipliers%error(k), trim(label))
      if (allocated(error)) return
    end do
    determined = determined + count(.not. multipliers%lost())
    lost = lost + count(multipliers%lost())
    label = accuracy%method // ": " // multipliers%verdict()
    call check(error, .not. (multipliers%verdict() == "stable" .and. truth%excess >= 0 .or. &
      & multipliers%verdict() == "unstable" .and. truth%excess <= 0), more=trim(label))
    if (allocated(error)) return
    call solve_periodic(monodromy, solution, failure)
    if (allocated(failure) .or. .not. allocated(truth%x0)) return
    write(label, "(2a, i0, a, 2es10.2)") accuracy%method, " with ", accuracy%steps, ": error of x0, its bound ", &
      & maxval(real(abs(solution%x0 - truth%x0), dp) / solution%error), norm2(solution%error)
    call check_that(error, real(abs(solution%x0 - truth%x0), dp), "<=", solution%error, trim(label))
  end subroutine check_claim

  !> One step for a turn with 16 oscillations.
  subroutine test_too_few(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure

    call frame_of_machine(khang_machine(240.0_dp), frame, failure)
    if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest"), accuracy_type(method="explicit8", &
      & steps=2), analysis, failure)
    call check_failure(error, failure, what="no vibration")
    if (allocated(error)) return
    call check(error, .not. allocated(analysis%vibration), more="no vibration")
    if (allocated(error)) return
    call check_that(error, failure%message, "contains", "steps")
    if (allocated(error)) return
    call check(error, analysis%multipliers%verdict(), "undecided")
    if (allocated(error)) return
    call check_that(error, analysis%multipliers%unknown(), "==", .true., "all lost")
    if (allocated(error)) return
    call check(error, all(analysis%multipliers%lost()), more="all lost")
  end subroutine test_too_few

  !> For links of next to no mass the motion is proportional to their masses: errors hold in comparison with 1e-100 times the
  !> motion of links of 1e-60 kg, and none is zero.
  subroutine test_small_masses(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: factors(3) = [1.0e-90_dp, 1.0e-100_dp, 1.0e-250_dp], base = 1.0e-60_dp
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: light, analysis
    type(gestell_error), allocatable :: failure
    character(len=120) :: label
    integer :: i, k

    machine = lighter(khang_machine(240.0_dp), base)
    call frame_of_machine(machine, frame, failure)
    if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest", points=64), accuracy_type(), light, failure)
    do i = 1, size(factors)
      if (.not. allocated(failure)) call frame_of_machine(lighter(machine, factors(i)), frame, failure)
      if (.not. allocated(failure)) call analyse(frame, analysis_options(model="rest", points=64), accuracy_type(), &
        & analysis, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      associate (few => analysis%vibration, many => light%vibration)
        do k = 1, size(few%peak)
          write(label, "(a, es8.1, i3, 4es11.3)") "factor, quantity, peak, rms, error, expected", factors(i), k, few%peak(k), &
            & few%rms(k), few%peak_error(k), many%peak(k) * factors(i)
          call check_that(error, few%peak_error(k), ">", 0.0_dp, "an error of zero: " // trim(label))
          call check_that(error, abs(few%peak(k) - many%peak(k) * factors(i)), "<=", few%peak_error(k) + many%peak_error(k) &
            & * factors(i), trim(label))
          call check_that(error, few%rms(k), "<=", few%peak(k), trim(label))
          call check_that(error, few%rms(k), ">", 0.01_dp * few%peak(k), trim(label))
          if (allocated(error)) return
        end do
      end associate
    end do
  end subroutine test_small_masses

  pure function lighter(machine, factor) result(light)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: factor
    type(machine_data) :: light

    light = machine
    light%links%mass = factor * machine%links%mass
    light%links%inertia = factor * machine%links%inertia
  end function lighter

end module test_unreliable
