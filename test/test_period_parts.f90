!> The parts of a period for which an expansion stores the motion: together they make the period, and their weights predict
!> errors.
module test_period_parts
  use checks, only: check_success, check_that
  use families, only: machine_family, oscillator_family, pulsed_family
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_processor, only: vector_length
  use gestell_base_kinds, only: dp
  use gestell_floquet_period_monodromy, only: accuracy_type, monodromy_type, solve_monodromy
  use gestell_math_lanes_products, only: combine, padded_to_four, multiply
  use gestell_math_lanes, only: lanes
  use gestell_math_matrix, only: balanced
  use gestell_system_family, only: family_type
  use gestell_system_periodic, only: periodic_system
  use gestell_task_sweep_expansion, only: expand, expansion_type
  use gestell_task_sweep_expansion_parts, only: parts_type
  use gestell_task_sweep_expansion_sampler, only: new_sampler, sampler_type
  use gestell_task_sweep_expansion_variable, only: variable_type
  use sweeps, only: new_family
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_period_parts

contains

  subroutine collect_period_parts(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("vectorised products agree with the compiler's", test_products), &
      & new_unittest("the parts of a period multiply to the whole period", test_period), &
      & new_unittest("each member takes as many steps as its frequencies require", test_steps), &
      & new_unittest("each member takes as many steps as its coefficients require", test_pulses), &
      & new_unittest("weights of partial errors bound the error of the whole period", test_weights), &
      & new_unittest("partial errors are weighted where the periodic vibration is largest", test_weights_of_vibration), &
      & new_unittest("the number of parts grows with the frequency, up to 16", test_choice), &
      & new_unittest("integration uses an eighth of the tolerance at most", test_integration_tolerance), &
      & new_unittest("the estimated truncation error of a series covers the true one", test_series_error), &
      & new_unittest("error estimates hold between corners whose motions decay strongly", test_decaying_corners)]
  end subroutine collect_period_parts

  !> Maps E, 10 E and E / 100: of the free motion only the end of the period counts, of the vibration also the end of every
  !> part, to which states of size 1 are added.
  subroutine test_weights_of_vibration(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: factors(3) = [1.0_dp, 10.0_dp, 0.01_dp], free(3) = [0.1_dp, 0.01_dp, 10.0_dp], &
      & forced(3) = [10 * sqrt(2.0_dp), sqrt(2.0_dp), sqrt(101.0_dp)]
    type(parts_type) :: parts
    integer :: k

    parts = parts_type(states=2, parts=3, of_map=[1.0_dp, 1.0_dp, 1.0_dp], of_times=[1.0_dp, 1.0_dp, 1.0_dp])
    call parts%set_weights(reshape([(factors(k) * [1, 0, 0, 1], k = 1, 3)], [12, 1]))
    ! A few roundings.
    call check_that(error, abs(parts%of_map / free - 1), "<", 1.0e-14_dp, "of the free motion")
    if (allocated(error)) return
    parts%forced = .true.
    call parts%set_weights(reshape([(factors(k) * [1, 0, 0, 0, 1, 0], k = 1, 3)], [18, 1]))
    call check_that(error, abs(parts%of_map / forced - 1), "<", 1.0e-14_dp, "of the vibration")
  end subroutine test_weights_of_vibration

  !> Integration may use an eighth of the tolerance, and for the periodic vibration a 64th. With an eighth a million points of
  !> data/khang_chart.nml with peaks took a third longer, because 1,400 points close to resonances had to be solved one by one.
  subroutine test_integration_tolerance(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: corners(2, 2) = reshape([200.0_dp, 0.8_dp, 300.0_dp, 1.2_dp], [2, 2]), tolerance = 1.0e-9_dp
    type(machine_family), target :: family
    type(sampler_type) :: sampler
    logical :: fits

    call new_family(family, error)
    if (allocated(error)) return
    call new_sampler(sampler, family, corners, accuracy_type(tolerance=tolerance), .false., 20000, fits)
    call check_that(error, fits, "==", .true., "a sampler")
    call check_that(error, sampler%error, "<=", tolerance / 8, "of the free motion")
    if (allocated(error)) return
    call new_sampler(sampler, family, corners, accuracy_type(tolerance=tolerance), .true., 20000, fits)
    call check_that(error, fits, "==", .true., "a sampler")
    call check_that(error, sampler%error, "<=", tolerance / 64, "of the vibration")
  end subroutine test_integration_tolerance

  !> Against the compiler's own products.
  subroutine test_products(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: n = 5, columns = 6, numbers = 6
    real(dp) :: rows(lanes, columns, n), b(lanes, n, columns), c(lanes, n, columns), factors(lanes, n), &
      & terms(n, padded_to_four(numbers)), values(lanes, padded_to_four(numbers))
    integer :: lane, i

    rows = reshape(sin([(1.3_dp * i, i = 1, size(rows))]), shape(rows))
    b = reshape(sin([(2.1_dp * i, i = 1, size(b))]), shape(b))
    factors = reshape(sin([(3.7_dp * i, i = 1, size(factors))]), shape(factors))
    terms = reshape(sin([(4.9_dp * i, i = 1, size(terms))]), shape(terms))
    call multiply(vector_length(), n, columns, 0.5_dp, rows, b, c)
    call combine(n, padded_to_four(numbers), factors, terms, values)
    do lane = 1, lanes
      ! Roundings of five terms below 1.
      call check_that(error, maxval(abs(c(lane, :, :) - matmul(transpose(rows(lane, :n, :)), b(lane, :, :)) / 2)), "<", &
        & 1.0e-14_dp, "A B / 2")
      call check_that(error, maxval(abs(values(lane, :) - matmul(factors(lane, :), terms))), "<", 1.0e-14_dp, "sums")
      if (allocated(error)) return
    end do
    call check_that(error, [padded_to_four(0), padded_to_four(1), padded_to_four(4), padded_to_four(5)], "==", [0, 4, 4, &
      & 8], "multiples of four")
  end subroutine test_products

  !> Phi(T) and x_p(T) of the paper's machine at a corner that has many parts and at one with few, computed number by number and
  !> in lanes, against a separate solution to 1e-12.
  subroutine test_period(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: corners(2, 4) = reshape([60.0_dp, 1.0_dp, 500.0_dp, 1.0_dp, 490.0_dp, 1.0_dp, 500.0_dp, 1.01_dp], &
      & [2, 4])
    type(machine_family), target :: family
    type(sampler_type) :: sampler
    real(dp), allocatable :: numbers(:), motion(:, :, :, :), right(:), filled(:, :)
    integer :: parts(4), k, n
    logical :: fits, forced

    call new_family(family, error)
    if (allocated(error)) return
    do k = 1, 4
      forced = mod(k, 2) == 0
      associate (pair => corners(:, 2 * ((k - 1) / 2) + 1:2 * ((k - 1) / 2) + 2))
        call new_sampler(sampler, family, pair, accuracy_type(tolerance=1.0e-12_dp), forced, 20000, fits)
        call check_that(error, fits, "==", .true., "a sampler")
        if (allocated(error)) return
        parts(k) = sampler%parts%parts
        n = sampler%parts%states
        if (allocated(numbers)) deallocate(numbers, motion)
        allocate(numbers(sampler%parts%numbers()), motion(lanes, n, sampler%parts%columns(), 0:parts(k)))
        call sampler%sample(pair(:, 2), numbers, fits)
        call own_numbers(family, pair(:, 2), sampler, right, error)
      end associate
      if (allocated(error)) return
      ! Balanced numbers of size 1 that are solved to 1e-12 of their norm twice, in 16 parts.
      call check_that(error, maxval(abs(sampler%parts%period(numbers) - right)), "<", 1.0e-11_dp, "the period of its parts")
      filled = spread(numbers, 1, lanes)
      call sampler%parts%compose(filled, motion)
      call check_that(error, maxval(abs(reshape(motion(lanes, :, :, parts(k)), [size(right)]) - right)), "<", 1.0e-11_dp, &
        & "the period in lanes")
      if (allocated(error)) return
    end do
    call check_that(error, parts(1:2), ">", 4, "parts for fast vibrations")
    call check_that(error, parts(3:4), "<=", 4, "parts for slow vibrations")
  end subroutine test_period

  !> Machines between corners at 60 and 500 rpm, whose vibrations turn by 8 times as much at one as at the other: Phi(T) against
  !> solutions of their own to 1e-12.
  subroutine test_steps(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: corners(2, 2) = reshape([60.0_dp, 1.0_dp, 500.0_dp, 1.0_dp], [2, 2])
    integer, parameter :: speeds(*) = [60, 70, 85, 110, 160, 240, 330, 420, 500]
    type(machine_family), target :: family
    type(sampler_type) :: sampler
    real(dp), allocatable :: numbers(:), right(:)
    integer :: i
    logical :: fits

    call new_family(family, error)
    if (allocated(error)) return
    call new_sampler(sampler, family, corners, accuracy_type(tolerance=1.0e-12_dp), .false., 20000, fits)
    call check_that(error, fits, "==", .true., "a sampler")
    if (allocated(error)) return
    associate (steps => sampler%steps)
      call check_that(error, size(steps), ">", 3, "numbers of steps")
      call check_that(error, mod(steps, sampler%parts%parts), "==", 0, "steps that end with the parts")
      call check_that(error, steps(2:), ">", steps(:size(steps) - 1), "ascending")
      call check_that(error, 3 * steps(1), "<", steps(size(steps)), "a slow member")
      if (allocated(error)) return
    end associate
    allocate(numbers(sampler%parts%numbers()))
    do i = 1, size(speeds)
      call sampler%sample([real(speeds(i), dp), 1.0_dp], numbers, fits)
      call check_that(error, fits, "==", .true., "a sample")
      if (allocated(error)) return
      call own_numbers(family, [real(speeds(i), dp), 1.0_dp], sampler, right, error)
      if (allocated(error)) return
      ! Both are solved to 1e-12 of the norm, 2.4 or less, in 16 parts at the most.
      call check_that(error, maxval(abs(sampler%parts%period(numbers) - right)), "<", 1.0e-11_dp, "Phi(T)")
      if (allocated(error)) return
    end do
  end subroutine test_steps

  !> A slow member whose coefficients have finer features than those of the corners; as many steps as its own frequency requires
  !> would miss them.
  subroutine test_pulses(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: members(*) = [0.7_dp, 1.5_dp, 2.5_dp]
    type(pulsed_family), target :: family
    type(sampler_type) :: sampler
    real(dp), allocatable :: numbers(:), right(:)
    integer :: i
    logical :: fits

    ! Pulses that 40 steps resolve, or fewer with as many nodes as these have with six stages: all members have them.
    call new_sampler(sampler, family, reshape([1.2_dp, 1.8_dp], [1, 2]), accuracy_type(tolerance=1.0e-4_dp), .false., 20000, fits)
    call check_that(error, fits, "==", .true., "a sampler of fewer steps")
    call check_that(error, maxval([sampler%steps, 0]), "<", 40, "fewer steps")
    if (allocated(error)) return
    call new_sampler(sampler, family, reshape([0.5_dp, 4000.0_dp], [1, 2]), accuracy_type(tolerance=1.0e-12_dp), .false., 20000, &
      & fits)
    call check_that(error, fits, "==", .true., "a sampler")
    if (allocated(error)) return
    allocate(numbers(sampler%parts%numbers()))
    do i = 1, size(members)
      call sampler%sample(members(i:i), numbers, fits)
      call check_that(error, fits, "==", .true., "a sample")
      if (allocated(error)) return
      call own_numbers(family, members(i:i), sampler, right, error)
      if (allocated(error)) return
      ! Roundings; as many steps as the slow one turns by leave 2.5e-9.
      call check_that(error, maxval(abs(sampler%parts%period(numbers) - right)), "<", 1.0e-12_dp, "Phi(T)")
      if (allocated(error)) return
    end do
  end subroutine test_pulses

  !> Phi(T), and x_p(T) where there are loads, by a solution of their own in the units of a sampler.
  subroutine own_numbers(family, parameters, sampler, numbers, error)
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    type(sampler_type), intent(in) :: sampler
    real(dp), allocatable, intent(out) :: numbers(:)
    type(error_type), allocatable, intent(out) :: error
    class(periodic_system), allocatable :: system
    type(monodromy_type) :: monodromy
    type(gestell_error), allocatable :: failure

    call family%member(parameters, system, failure)
    if (.not. allocated(failure)) call solve_monodromy(system, accuracy_type(tolerance=1.0e-12_dp), sampler%parts%forced, &
      & monodromy, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    numbers = reshape(balanced(monodromy%phi, sampler%scale), [size(monodromy%phi)])
    if (sampler%parts%forced) numbers = [numbers, monodromy%xp / (sampler%scale * sampler%unit)]
  end subroutine own_numbers

  !> Oscillators from weak to overcritical damping, where Phi(t) falls within the period by e^(d pi). Whatever part an error is
  !> in, Phi(T) is wrong by no more than its weighted size, times the root of the number of parts if all have one; and for the
  !> worst direction not by much less.
  subroutine test_weights(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: small = 1.0e-7_dp, damping(3) = [0.01_dp, 1.0_dp, 6.0_dp]
    type(oscillator_family), target :: family
    type(sampler_type) :: sampler
    real(dp), allocatable :: numbers(:), wrong(:)
    real(dp) :: moved, worst
    integer :: d, k, i
    logical :: fits

    do d = 1, size(damping)
      call new_sampler(sampler, family, reshape([damping(d), 1.0_dp, damping(d), 4000.0_dp], [2, 2]), &
        & accuracy_type(tolerance=1.0e-10_dp), .false., 20000, fits)
      call check_that(error, fits .and. sampler%parts%parts > 4, "==", .true., "a sampler of many parts")
      if (allocated(error)) return
      if (allocated(numbers)) deallocate(numbers)
      allocate(numbers(sampler%parts%numbers()))
      call sampler%sample([damping(d), 4000.0_dp], numbers, fits)
      call check_that(error, abs(sampler%parts%reach(numbers) - 1), "<", 1.0e-12_dp, "reach at a corner")
      do k = 1, sampler%parts%parts
        worst = 0
        do i = 0, 3
          wrong = numbers
          wrong(sampler%parts%map_at(k) + i) = wrong(sampler%parts%map_at(k) + i) + small
          moved = norm2(sampler%parts%phi(wrong) - sampler%parts%phi(numbers)) / small
          worst = max(worst, moved)
          ! Roundings of Phi(T), which is 1 at the most, over `small`.
          call check_that(error, moved, "<=", 1 + 1.0e-7_dp, "an error exceeds its weight")
          if (allocated(error)) return
        end do
        ! The weights are for the worse of both corners, and bounds of norms are twice too great at the most.
        if (d == 1) call check_that(error, worst, ">", 0.2_dp, "weights are too large")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_weights

  !> A single part where vibrations do not turn, and no more than 16 whatever they do.
  subroutine test_choice(error)
    type(error_type), allocatable, intent(out) :: error
    type(oscillator_family), target :: family
    type(sampler_type) :: sampler
    type(parts_type) :: all
    logical :: fits

    call new_sampler(sampler, family, reshape([0.1_dp, 1.0_dp, 0.1_dp, 1.1_dp], [2, 2]), accuracy_type(), .false., 10000, fits)
    call check_that(error, sampler%parts%parts, "==", 1, "parts without vibrations")
    call new_sampler(sampler, family, reshape([0.1_dp, 1.0_dp, 0.1_dp, 40000.0_dp], [2, 2]), accuracy_type(), .false., 20000, &
      & fits)
    call check_that(error, sampler%parts%parts, "==", 16, "parts with fast vibrations")
    all = parts_type(states=6, parts=8, between=3, forced=.true.)
    ! Maps of 6 x 7, and three times of 3 x 7 in each part.
    call check_that(error, [all%numbers(), all%numbers_of_period(), all%map_at(2), all%times_at(8, 3)], "==", &
      & [8 * (42 + 3 * 21), 42, 106, 8 * (42 + 3 * 21) - 20], "numbers")
  end subroutine test_choice

  !> Series of the oscillators' Phi with 8 to 20 terms on both axes, of the whole period and of parts of it. Their error between
  !> the points is at most the estimated one, and not much less: terms fall up to thirtyfold from one to the next, and the
  !> estimate grows with the number of parts.
  subroutine test_series_error(error)
    type(error_type), allocatable, intent(out) :: error
    ! The more points a cell has the more parts pay, if there are many points at all.
    integer, parameter :: cells(2) = [1, 10000]
    type(oscillator_family), target :: family
    type(sampler_type) :: sampler
    type(expansion_type) :: expansion
    type(variable_type) :: variables(2)
    real(dp), allocatable :: right(:)
    real(dp) :: p(2), miss, fall
    integer :: n, i, k
    logical :: fits

    variables = [variable_type(0.1_dp, 1.0_dp), variable_type(1.0_dp, 30.0_dp)]
    do k = 1, 2
      call new_sampler(sampler, family, reshape([0.1_dp, 30.0_dp, 1.0_dp, 1.0_dp], [2, 2]), &
        & accuracy_type(tolerance=1.0e-13_dp), .false., cells(k), fits)
      call check_that(error, fits, "==", .true., "samples")
      call check_that(error, sampler%parts%parts > 1, "==", k == 2, "parts of the period")
      if (allocated(error)) return
      if (allocated(right)) deallocate(right)
      allocate(right(sampler%parts%numbers()))
      fall = 30.0_dp * sampler%parts%parts
      do n = 8, 20, 3
        call expand(expansion, sampler, variables, [n, n], fits)
        miss = 0
        do i = 1, 200
          p = [0.1_dp + 0.9_dp * modulo(0.618_dp * i, 1.0_dp), 1 + 29 * modulo(0.414_dp * i, 1.0_dp)]
          call sampler%sample(p, right, fits)
          miss = max(miss, norm2(sampler%parts%phi(expansion%point(p)) - sampler%parts%phi(right)))
        end do
        ! Roundings of the sum of the terms.
        call check_that(error, miss, "<=", expansion%rest + 1.0e-13_dp, "the error exceeds its estimate")
        ! Four times the last two terms of two axes, relative to the next term.
        call check_that(error, expansion%rest, "<=", 10 * sqrt(fall / 30) * (fall + fall**2) * miss + 1.0e-11_dp, &
          & "the estimate is too large")
        if (allocated(error)) return
      end do
    end do
  end subroutine test_series_error

  !> Weights from corners where motions die within the period, e^(-3 pi), are too small where they do not. Nevertheless an error
  !> there has no more effect than assumed, and the estimate is about as large as with fitting weights.
  subroutine test_decaying_corners(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: dampings(2) = [0.1_dp, 6.0_dp], small = 1.0e-7_dp
    type(oscillator_family), target :: family
    type(sampler_type) :: samplers(2)
    type(expansion_type) :: expansions(2)
    real(dp), allocatable :: numbers(:), wrong(:)
    real(dp) :: moved
    integer :: k, i
    logical :: fits

    do k = 1, 2
      call new_sampler(samplers(k), family, reshape([dampings(k), 30.0_dp, dampings(k), 1000.0_dp], [2, 2]), &
        & accuracy_type(tolerance=1.0e-12_dp), .false., 10000, fits)
      call check_that(error, fits .and. samplers(k)%parts%parts > 1, "==", .true., "a sampler of several parts")
      if (allocated(error)) return
      call expand(expansions(k), samplers(k), [variable_type(0.1_dp, 6.0_dp), variable_type(30.0_dp, 100.0_dp)], &
        & [9, 9], fits)
    end do
    allocate(numbers(samplers(2)%parts%numbers()))
    call samplers(2)%sample([0.1_dp, 30.0_dp], numbers, fits)
    moved = 0
    do i = 1, size(numbers)
      wrong = numbers
      wrong(i) = wrong(i) + small
      moved = max(moved, norm2(samplers(2)%parts%phi(wrong) - samplers(2)%parts%phi(numbers)) / small)
    end do
    call check_that(error, moved, ">", 2.0_dp, "the weights are too small")
    call check_that(error, moved, "<=", samplers(2)%parts%reach(numbers) * (1 + 1.0e-6_dp), &
      & "the error exceeds its estimate between the corners")
    ! Other units, and the largest factor in place of each part's own.
    call check_that(error, expansions(2)%rest, ">", expansions(1)%rest / 3, "the estimate is smaller than with fitting weights")
  end subroutine test_decaying_corners

end module test_period_parts
