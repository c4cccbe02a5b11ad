!> The cost of results, in counted work: samples, evaluations, intervals, comparisons.
module test_cost
  use checks, only: check_failure, check_success, check_that
  use gestell_math_dft, only: dft
  use gestell_base_dictionary, only: dictionary_type
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_method, only: method_type
  use gestell_floquet_choice_methods, only: new_method
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_solution, only: evidence, evidence_type
  use gestell_model_linkage_diagnosis, only: diagnose, diagnosis_type
  use gestell_model_frame, only: frame_type
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_linkage, only: linkage_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use machines, only: frame_of_machine, new_crank
  use reference_cases, only: random_machine
  use reference_linear, only: qp
  use reference_machine, only: khang_machine, machine_data, pi_qp, support_data
  use testdrive, only: check, error_type, new_unittest, unittest_type
  use user_mechanisms, only: count_angles, timid_joint
  implicit none (type, external)
  private

  public :: collect_cost

contains

  subroutine collect_cost(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the discrete Fourier transform agrees with the direct sum", test_dft), &
      & new_unittest("a looser tolerance never requires more samples", test_tolerance), &
      & new_unittest("a stiff support does not require integration over its fast vibration", test_stiff_support), &
      & new_unittest("the dictionary finds the first position of each of many words", test_dictionary), &
      & new_unittest("the diagnosis computes every joint once per angle", test_diagnosis), &
      & new_unittest("the cost of the assembly proof does not depend on unrelated joints", test_unrelated_joints), &
      & new_unittest("proof intervals grow only logarithmically near a dead point", test_dead_points), &
      & new_unittest("the assembly proof ends within bounded work and names the joint", test_bounded_proof)]
  end subroutine collect_cost

  !> Lengths with one prime factor and with several, against the sum in quadruple precision.
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
      call check_that(error, real(worst, dp), "<", 4 * epsilon(1.0_dp), found)
      if (allocated(error)) return
    end do
  end subroutine test_dft

  !> A loose tolerance selects a method of low order with few steps; their error must not increase the number of samples.
  subroutine test_tolerance(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    !> Work for one machine, and in sum for all machines.
    real(dp) :: work(6), total(6)
    integer :: i, k

    machine = khang_machine(51160.0_dp)
    do k = 1, size(machine%supports)
      machine%supports(k)%stiffness = 28210.0_dp
    end do
    machine%frame_mass = 13700.0_dp
    call frame_of_machine(machine, frame, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    total = 0
    call compare(frame, "four-bar near a free motion", work, error)
    if (allocated(error)) return
    total = total + work
    do i = 1, 8
      call frame_of_machine(random_machine(i), frame, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call compare(frame, "random machine", work, error)
      if (allocated(error)) return
      total = total + work
    end do
    call check_that(error, total(:5), "<=", total(2:), "work for all machines")
  end subroutine test_tolerance

  !> Samples of the vibration, with and without accelerations, and `work` for its solution as the method reports it, shape (6).
  subroutine compare(frame, name, work, error)
    type(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: name
    real(dp), intent(out) :: work(:)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: rows(2) = [0, 12]
    !> The required number of steps is a prediction. If it fails, the steps are wasted, and twice as many follow.
    real(dp), parameter :: forecast = 3
    class(method_type), allocatable :: method
    type(analysis_type) :: analysis
    type(evidence_type) :: found
    type(gestell_error), allocatable :: failure
    character(len=200) :: numbers
    integer :: i, k, samples(6)

    do k = 1, size(rows)
      do i = 1, size(samples)
        call analyse(frame, analysis_options(model="rest", points=32, rows=rows(k)), &
          & accuracy_type(tolerance=10.0_dp**(1 - 2 * i)), analysis, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        call evidence(analysis%floquet, found)
        samples(i) = 2 * size(analysis%vibration%series(1)%amplitude) + 2
        call new_method(found%methods, method, failure)
        call check_success(error, failure)
        if (allocated(error)) return
        work(i) = found%evaluations / method%stages * method%work(frame%states, .true.)
      end do
      write (numbers, "(2a, 6(1x, i0), a, 6(1x, i0))") name, ": samples", samples, ", work", nint(work)
      call check_that(error, samples(:5), "<=", samples(2:), numbers)
      call check_that(error, work(:5), "<=", [(forecast * minval(work(i + 1:)), i = 1, 5)], numbers)
      if (allocated(error)) return
    end do
  end subroutine compare

  !> The paper's machine with an additional support of 1e11 N/m: 4,700 vibrations per turn in addition to nine and twelve.
  !> Reduction evaluates the masses at a few hundred crank angles; integration over all these vibrations would take 22 million.
  subroutine test_stiff_support(error)
    type(error_type), allocatable, intent(out) :: error
    !> How much the support of 1e11 N/m yields under the force on the ground, 47 N, relative to the smallest motion, 6e-6 m; the
    !> other support yields a tenth of that.
    real(dp), parameter :: give = 47 / 1.0e11_dp / 6.0e-6_dp
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure
    real(dp) :: peaks(3, 2)
    integer, target :: angles
    integer :: i

    machine = khang_machine(240.0_dp)
    machine%foundation_damping = [10.0_dp, 10.0_dp, 1.0_dp]
    machine%supports = [machine%supports, support_data([0.1_dp, 0.3_dp], [1.0e11_dp, 2.0e5_dp], [100.0_dp, 10.0_dp])]
    do i = 1, 2
      call frame_of_machine(machine, frame, failure)
      angles = 0
      if (.not. allocated(failure)) then
        call count_angles(frame%mechanism, angles)
        call analyse(frame, analysis_options(model="exact", points=32), accuracy_type(), analysis, failure)
      end if
      call check_success(error, failure)
      if (.not. allocated(error)) call check_that(error, real(angles, dp), "<", 5.0e3_dp, "crank angles")
      if (allocated(error)) return
      peaks(:, i) = analysis%vibration%peak(:3)
      machine%supports(5)%stiffness(1) = 1.0e12_dp
    end do
    call check_that(error, abs(peaks(:, 1) - peaks(:, 2)), "<=", give * peaks(:, 2), "peaks of both")
  end subroutine test_stiff_support

  !> Each word is found at its first position, even after the room has been doubled many times.
  subroutine test_dictionary(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: many = 2000
    type(dictionary_type) :: dictionary, copy
    character(len=12) :: word
    integer :: i

    call check(error, dictionary%position("nothing"), 0, more="empty")
    if (allocated(error)) return
    do i = 1, many
      write (word, "('joint ', i0)") modulo(7 * i, many)
      call dictionary%add(word)
    end do
    call dictionary%add("joint 7")
    call dictionary%add(repeat("long", 1000))
    call dictionary%add("")
    copy = dictionary
    do i = 1, many
      write (word, "('joint ', i0)") modulo(7 * i, many)
      call check(error, copy%position(word), i, more=word)
      if (allocated(error)) return
    end do
    call check(error, copy%position(repeat("long", 1000)), many + 2, more="long")
    if (allocated(error)) return
    call check(error, copy%position("  "), many + 3, more="blank")
    if (allocated(error)) return
    call check(error, copy%position("joint") + copy%position("joint 07") + copy%position(repeat("long", 999)), 0, more="not there")
  end subroutine test_dictionary

  !> The paper's four-bar with n additional points, all fixed to its coupler.
  subroutine build_fan(more, linkage, error)
    integer, intent(in) :: more
    type(linkage_type), intent(out) :: linkage
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    character(len=6) :: name
    integer :: i

    call new_crank(linkage, failure)
    call linkage%ground("P", [4.5_dp, 0.0_dp], failure)
    call linkage%rrr("B", ["A", "P"], [4.0_dp, 2.5_dp], 1, failure)
    do i = 1, more
      write (name, "('R', i0)") i
      call linkage%rigid(name, ["A", "B"], [0.01_dp * i, 1.0_dp], failure)
      call linkage%link("on " // name, "A", name, 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
    end do
    if (.not. allocated(failure)) call linkage%prepare(failure)
    call check_success(error, failure)
  end subroutine build_fan

  subroutine test_diagnosis(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(diagnosis_type) :: diagnosis
    type(gestell_error), allocatable :: failure
    integer :: more(2), placements(2), i

    more = [10, 80]
    do i = 1, 2
      call build_fan(more(i), linkage, error)
      if (allocated(error)) return
      call diagnose(linkage, diagnosis, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      placements(i) = diagnosis%placements
    end do
    ! 14 joints and 84: their numbers are as 1 to 6.
    call check(error, placements(2), 6 * placements(1))
    if (allocated(error)) return
    ! Half a degree apart, both ends of the turn.
    call check(error, placements(1), 721 * 14)
  end subroutine test_diagnosis

  subroutine test_unrelated_joints(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: few, many

    call build_fan(1, few, error)
    if (.not. allocated(error)) call build_fan(300, many, error)
    if (allocated(error)) return
    call check_that(error, few%intervals, ">", 0, "intervals of few")
    call check_that(error, many%intervals, "<=", 2 * few%intervals, "intervals of many")
  end subroutine test_unrelated_joints

  !> If the length exceeds the dead point by a small gap, the motion changes within about the square root of the gap. The
  !> intervals there are as short; elsewhere they double, so that their number grows with the logarithm.
  subroutine test_dead_points(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: decades(4) = [1, 3, 5, 7]
    real(dp), parameter :: r = 0.2_dp, d = 0.4_dp, l = 0.35_dp
    type(linkage_type) :: linkage
    type(guide_type) :: guide
    type(gestell_error), allocatable :: failure
    character(len=80) :: found
    integer :: kind, i, intervals(3, 4)

    do i = 1, size(decades)
      associate (gap => 0.1_dp * 10.0_dp**(-decades(i)))
        do kind = 1, 3
          call start()
          select case (kind)
          case (1) ! stretched
            call linkage%rrr("B", ["A", "D"], [l, r + d - l + gap], 1, failure)
          case (2) ! folded
            call linkage%rrr("B", ["A", "D"], [0.5_dp, 0.5_dp + d - r - gap], 1, failure)
          case default ! the rod across its guide
            call linkage%rrp("B", "A", r + d + gap, guide_type(point=[0.0_dp, -d]), 1, failure)
          end select
          call linkage%link("on B", "B", "", 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
          if (.not. allocated(failure)) call linkage%prepare(failure)
          call check_success(error, failure)
          if (allocated(error)) return
          intervals(kind, i) = linkage%intervals
        end do
      end associate
    end do
    do kind = 1, 3
      write (found, "(a, i0, a, 4(1x, i0))") "kind ", kind, ", intervals", intervals(kind, :)
      ! A decade of the gap is half a decade of angle, to both sides.
      call check_that(error, intervals(kind, 4) - intervals(kind, 1), "<=", 25 * (decades(4) - decades(1)), found)
      if (allocated(error)) return
    end do
    ! The rod on the point that carries its guide is nearly perpendicular to it throughout, except for 4e-6 of its length.
    call start()
    call linkage%rrr("B", ["A", "D"], [0.6_dp, 0.5_dp], 1, failure)
    call linkage%moving_guide(["D", "B"], [0.0_dp, 0.1_dp], 0.0_dp, guide, failure)
    call linkage%rrp("C", "B", 0.1_dp * (1 + 4.0e-6_dp), guide, 1, failure)
    call linkage%link("on C", "C", "", 1.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], failure)
    if (.not. allocated(failure)) call linkage%prepare(failure)
    call check_success(error, failure)
    if (allocated(error)) return
    write (found, "(a, i0)") "rod across, intervals ", linkage%intervals
    ! Bounds that ignore that the point moves with the guide would need a multiple of the root of the gap's reciprocal.
    call check_that(error, linkage%intervals, "<", 50000, found)

  contains

    subroutine start()
      linkage = linkage_type()
      call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
      call linkage%ground("D", [d, 0.0_dp], failure)
      call linkage%crank("A", "O", r, 0.0_dp, failure)
    end subroutine start

  end subroutine test_dead_points

  !> A joint whose bounds hold only within 1e-7 rad: the proof would need 30 million intervals.
  subroutine test_bounded_proof(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure

    call new_crank(linkage, failure)
    call linkage%add_joint("T", timid_joint(1.0e-7_dp), failure)
    call linkage%prepare(failure)
    call check_failure(error, failure, what="the assembly was proved")
    if (allocated(error)) return
    call check(error, failure%code, 3, more=failure%message)
    if (allocated(error)) return
    call check(error, failure%subject, "joint 'T'")
    if (allocated(error)) return
    call check_that(error, linkage%intervals, "<=", 1000001, "intervals")
  end subroutine test_bounded_proof

end module test_cost
