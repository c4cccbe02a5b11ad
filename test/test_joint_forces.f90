!> Forces in the pairs of linkages: against published and independently derived numbers, the balances of every link, and the driving
!> torque.
module test_joint_forces
  use checks, only: check_failure, check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_pairs, only: contact, slide, slot
  use gestell_model_linkage, only: linkage_type
  use gestell_model_pairs_forces, only: fx, fy, moment
  use gestell_model_pairs_rows, only: compute_joint_forces, find_machine_pairs, joint_rows, plane_pairs_type
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_driving, only: drive_power, power_rows, torque
  use gestell_model_quantity_joint_quantities, only: joint_place_type, list_joint_places
  use gestell_model_quantity_rows, only: exact_rows, joint_forces, probe_type, quantity_type
  use gestell_study_vibration, only: vibration_type
  use gestell_study_vibration_analysis, only: analyse, analysis_options, analysis_type
  use gestell_study_vibration_rigid_ground, only: solve_on_rigid_ground
  use gestell_study_vibration_statistics, only: compute_statistics, statistics_type
  use reference_cases, only: random_linkage, random_machine
  use reference_linear, only: qp
  use reference_linkage, only: move, reference_motion => motion_type
  use reference_machine, only: khang_machine, machine_data, pi_qp
  use reference_momentum, only: exact_torque
  use reference_random, only: random_type
  use shaken_ground, only: make, near
  use space_machines, only: three_planes, v_twin
  use systems, only: diagonal
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_joint_forces

  type(probe_type), parameter :: no_probes(0) = [probe_type ::]

contains

  subroutine collect_joint_forces(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("forces in a slider-crank agree with a solution in 30 digits", test_slider_crank), &
      & new_unittest("peaks in the paper's four-bar on rigid ground agree with two other codes", test_four_bar), &
      & new_unittest("forces on every link of random linkages balance its inertia", test_balance), &
      & new_unittest("the moment on the crank is the driving torque, in the plane", test_torque), &
      & new_unittest("the moments on the cranks add up to the driving torque, in space", test_torque_in_space), &
      & new_unittest("error bounds of joint forces hold at loose tolerances", test_bounds), &
      & new_unittest("names of joint forces are found, ambiguous and unknown ones refused", test_names)]
  end subroutine collect_joint_forces

  !> A slider-crank: radius 1, rod 3, guide along x, 1 rad/s, gravity along -y; masses 1, 2, 0.5 with centres in the middle.
  subroutine make_slider_crank(frame, error)
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(gestell_error), allocatable :: failure

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 1.0_dp, 0.0_dp, failure)
    call linkage%rrp("B", "A", 3.0_dp, guide_type(), 1, failure)
    call linkage%link("crank", "O", "A", 1.0_dp, 0.01_dp, [0.5_dp, 0.0_dp], failure)
    call linkage%link("rod", "A", "B", 2.0_dp, 0.1_dp, [1.5_dp, 0.0_dp], failure)
    call linkage%link("slider", "B", "", 0.5_dp, 0.0_dp, [0.0_dp, 0.0_dp], failure)
    call new_frame(frame, linkage, 10.0_dp, 1.0_dp, [0.0_dp, 0.0_dp], diagonal([1.0e4_dp, 1.0e4_dp, 1.0e4_dp]), &
      & diagonal([10.0_dp, 10.0_dp, 10.0_dp]), 1.0_dp, failure, gravity=[0.0_dp, -9.81_dp])
    call check_success(error, failure)
  end subroutine make_slider_crank

  !> Newton and Euler's equations as a system of nine equations, solved in 30 digits for the crank angle 15 deg. The torque also
  !> follows from the energy, the forces from the momentum; both differ by less than 1e-29.
  subroutine test_slider_crank(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    real(dp), parameter :: tolerance = 1.0e-12_dp
    real(dp) :: motion(9, 1)

    call make_slider_crank(frame, error)
    if (allocated(error)) return
    motion = 0
    call near_force("O:crank", [fx, fy, moment], [-3.335922048344_dp, 19.50934838309_dp, 14.97011743844_dp])
    call near_force("A:rod", [fx, fy], [-2.852959135199_dp, 9.828757905641_dp])
    call near_force("B:slider", [fx, fy], [-0.6290111029701_dp, -9.532423049257_dp])
    call near_force("B:guide", [fx, fy, moment], [0.0_dp, 14.43742304926_dp, 0.0_dp])

  contains

    !> The printed numbers have 13 digits, of forces of 20 N.
    subroutine near_force(name, parts, expected)
      character(len=*), intent(in) :: name
      integer, intent(in) :: parts(:)
      real(dp), intent(in) :: expected(:)
      real(dp), allocatable :: forces(:, :)
      type(joint_place_type), allocatable :: places(:)
      integer :: i

      call find(frame, [15.0_dp / 360], motion, forces, places, error)
      if (allocated(error)) return
      i = findloc(places%name, name, dim=1)
      call check_that(error, i, ">", 0, name)
      if (allocated(error)) return
      call near(error, (forces(places(i)%row + parts, 1)), expected, 20 * tolerance, name)
    end subroutine near_force

  end subroutine test_slider_crank

  !> The joint forces of a motion, and the places of their rows, counted from the first joint force.
  subroutine find(frame, phases, motion, forces, places, error)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:), motion(:, :)
    real(dp), allocatable, intent(out) :: forces(:, :)
    type(joint_place_type), allocatable, intent(out) :: places(:)
    type(error_type), allocatable, intent(inout) :: error
    type(plane_pairs_type), allocatable :: pairs(:)
    type(gestell_error), allocatable :: failure

    call find_machine_pairs(frame, pairs, failure)
    if (.not. allocated(failure)) call list_joint_places(frame, places, failure)
    if (.not. allocated(failure)) then
      allocate(forces(joint_rows(frame), size(phases)))
      call compute_joint_forces(frame, pairs, phases, motion, forces, failure)
    end if
    if (allocated(failure)) call check_success(error, failure)
    if (allocated(places)) places%row = places%row - exact_rows(frame)
  end subroutine find

  !> Peaks and rms of data/khang_four_bar.nml at 240 rpm on rigid ground, by two independent programs.
  subroutine test_four_bar(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(vibration_type) :: vibration
    type(statistics_type) :: pivot, pin
    real(dp), parameter :: printed = 1.0e-10_dp

    call make(khang_machine(240.0_dp), frame, error)
    if (allocated(error)) return
    call solve_on_rigid_ground(frame, 360, 20, vibration)
    call statistics_of("joint(j1).f", pivot)
    call statistics_of("joint(j3).f", pin)
    if (allocated(error)) return
    call near(error, [pivot%peak, pivot%rms], [60.7514278368_dp, 39.2913473137_dp], 61 * printed, "crank's pivot")
    call near(error, [pin%peak, pin%rms], [51.3109229474_dp, 31.0284865243_dp], 51 * printed, "crank pin")
    call check_that(error, [pivot%peak_error, pin%peak_error], "<=", 51 * printed, "error bounds")
    ! the parabola through three samples, 1.4 deg apart, errs by about 0.01 deg
    call near(error, 360 * [pivot%peak_phase, pin%peak_phase], [13.2046682_dp, 12.8382526_dp], 0.05_dp, "crank angles")

  contains

    subroutine statistics_of(name, statistics)
      character(len=*), intent(in) :: name
      type(statistics_type), intent(out) :: statistics
      type(quantity_type) :: quantity
      type(gestell_error), allocatable :: failure

      if (allocated(error)) return
      call find_quantity(frame, no_probes, name, quantity, failure)
      if (.not. allocated(failure)) call compute_statistics(vibration, quantity, statistics, failure)
      call check_success(error, failure)
    end subroutine statistics_of

  end subroutine test_four_bar

  !> A frame with a random linkage, and a random motion at one phase: q, q', q'' of the size of radians and metres. The crank turns
  !> uniformly against the frame if `number` is odd, in space if it is even.
  subroutine make_moving(number, machine, frame, phase, motion, error)
    integer, intent(in) :: number
    type(machine_data), intent(out) :: machine
    type(frame_type), intent(out) :: frame
    real(dp), intent(out) :: phase, motion(9, 1)
    type(error_type), allocatable, intent(out) :: error
    type(random_type) :: random
    real(dp) :: rate
    integer :: i

    machine = random_linkage(number, 1.0_dp, 20.0_dp)
    if (modulo(number, 2) == 0) machine%held_by = "outside"
    call make(machine, frame, error)
    if (allocated(error)) return
    call random%start(number, 11)
    phase = random%between(0.0_dp, 1.0_dp)
    rate = 2 * pi / frame%period
    motion(:, 1) = [(random%about_zero(0.5_dp), i = 1, 9)]
    motion(4:6, 1) = rate * motion(4:6, 1)
    motion(7:9, 1) = rate**2 * motion(7:9, 1)
  end subroutine make_moving

  !> The forces at all places of a link, those of guides and cams that it carries, and its inertia add up to zero, and so do the
  !> moments about its centre of mass. Kinematics in quadruple precision, by the reference.
  subroutine test_balance(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(reference_motion) :: moved
    type(joint_place_type), allocatable :: places(:)
    real(dp), allocatable :: forces(:, :)
    real(dp) :: phase, motion(9, 1), sum_of(3), maximum, arm(2), action(3), own
    real(qp) :: angle, rate, gain
    complex(qp) :: r(0:2), acceleration
    complex(qp), parameter :: i_qp = (0.0_qp, 1.0_qp)
    integer :: number, i, k, tested
    character(len=3) :: link

    tested = 0
    do number = 1, 120
      call make_moving(number, machine, frame, phase, motion, error)
      if (allocated(error)) return
      if (.not. is_determined(frame)) cycle
      tested = tested + 1
      call find(frame, [phase], motion, forces, places, error)
      if (allocated(error)) return
      angle = sign(1.0_qp, real(frame%speed, qp)) * 2 * pi_qp * phase
      rate = frame%speed
      gain = 0
      if (frame%held_by == "outside") then
        angle = angle - motion(3, 1)
        rate = rate - motion(6, 1)
        gain = -motion(9, 1)
      end if
      moved = move(machine, angle)
      maximum = maxval(abs(forces))
      do k = 1, size(machine%links)
        write (link, "(a, i0)") "l", k
        ! several links may form one body; a link that only translates acts on a pin unless it belongs to a slider on a fixed
        ! guide, or to a block (test/cli/joints.py)
        if (count(places%body == link) == 0 .or. shares_body(frame, k)) cycle
        if (machine%links(k)%to == 0) then
          associate (joint => machine%joints(machine%links(k)%from))
            if (joint%guide(1) > 0 .or. all(joint%kind /= ["RRP", "RPP"])) cycle
          end associate
        end if
        r = cmplx(moved%center(1, :, k), moved%center(2, :, k), qp)
        r = [r(0), r(1) * rate, r(2) * rate**2 + r(1) * gain]
        r(0) = r(0) + cmplx(frame%origin(1), frame%origin(2), qp)
        associate (psi => real(motion(3, 1), qp), w => real(motion(6, 1), qp), w_d => real(motion(9, 1), qp))
          acceleration = cmplx(motion(7, 1), motion(8, 1), qp) * exp(-i_qp * psi) + (i_qp * w_d - w**2) * r(0) &
            & + 2 * i_qp * w * r(1) + r(2)
          sum_of(:2) = -machine%links(k)%mass * real([real(acceleration), aimag(acceleration)], dp)
          sum_of(3) = -machine%links(k)%inertia * real(w_d + rate**2 * moved%turn(2, k) &
            & + gain * moved%turn(1, k), dp)
        end associate
        if (machine%links(k)%to == 0) sum_of(3) = 0
        own = 0
        do i = 1, size(places)
          associate (place => places(i), force => forces(places(i)%row + 1:places(i)%row + 3, 1))
            if (place%body == link) then
              action = force
            else if (place%other == link .and. any(place%kind == [slide, slot, contact])) then
              action = -force
            else
              cycle
            end if
            arm = real(moved%joint(:, 0, joint_of(place%joint)) - moved%center(:, 0, k), dp)
            sum_of = sum_of + [action(:2), action(3) + arm(1) * action(2) - arm(2) * action(1)]
            own = max(own, norm2(arm))
          end associate
        end do
        ! accelerations of joints lose digits near dead points, by the square of the angle scale
        call near(error, sum_of(:2), [0.0_dp, 0.0_dp], 1.0e-12_dp * maximum / frame%mechanism%angle_scale, "force on " // link)
        if (machine%links(k)%to > 0) call near(error, sum_of(3:), [0.0_dp], 1.0e-12_dp * maximum * (own + 1) &
          & / frame%mechanism%angle_scale, "moment on " // link)
        if (allocated(error)) return
      end do
    end do
    call check_that(error, tested, ">", 20, "linkages")
  end subroutine test_balance

  !> False if a random linkage has a rigid point, a guide or a link between two joints that no body carries together.
  logical function is_determined(frame)
    type(frame_type), intent(in) :: frame
    type(plane_pairs_type), allocatable :: pairs(:)
    type(gestell_error), allocatable :: failure

    call find_machine_pairs(frame, pairs, failure)
    is_determined = .not. allocated(failure)
  end function is_determined

  !> True if another link belongs to the same body as link `k`.
  logical function shares_body(frame, k)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: k
    type(plane_pairs_type), allocatable :: pairs(:)
    type(gestell_error), allocatable :: failure

    call find_machine_pairs(frame, pairs, failure)
    associate (bodies => pairs(1)%structure%links)
      shares_body = count(bodies == bodies(k)) > 1
    end associate
  end function shares_body

  !> Number of a joint called j1, j2, ...
  integer function joint_of(name) result(number)
    character(len=*), intent(in) :: name

    read (name(2:), *) number
  end function joint_of

  !> Lagrange's equation for the crank, in quadruple precision, for random linkages and motions.
  subroutine test_torque(error)
    type(error_type), allocatable, intent(out) :: error
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(joint_place_type), allocatable :: places(:)
    real(dp), allocatable :: forces(:, :)
    real(dp) :: phase, motion(9, 1), exact
    integer :: number, i

    do number = 1, 120
      call make_moving(number, machine, frame, phase, motion, error)
      if (allocated(error)) return
      if (.not. is_determined(frame)) cycle
      call find(frame, [phase], motion, forces, places, error)
      if (allocated(error)) return
      exact = real(exact_torque(machine, sign(1.0_qp, real(frame%speed, qp)) * 2 * pi_qp * phase, real(motion(1:3, 1), qp), &
        & real(motion(4:6, 1), qp), real(motion(7:9, 1), qp)), dp)
      ! the reference's differences to 1e-20; accelerations of joints lose digits near dead points
      call near(error, [sum([(forces(places(i)%row + moment, 1), i = 1, size(places))], mask=places%driven)], [exact], &
        & 1.0e-11_dp * maxval(abs(forces)) / frame%mechanism%angle_scale, "torque")
      if (allocated(error)) return
    end do
  end subroutine test_torque

  !> Two machines in space, in random motion: gyroscopic moments, tilted planes, weights above the plane.
  subroutine test_torque_in_space(error)
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    type(joint_place_type), allocatable :: places(:)
    type(random_type) :: random
    real(dp), allocatable :: forces(:, :)
    real(dp) :: motion(18, 1), power(power_rows, 1), rate
    logical :: known
    integer :: number, i, ratios(3)

    do number = 1, 10
      if (number <= 5) call v_twin(150.0_dp, frame, failure)
      if (number > 5) call three_planes(40.0_dp, 0.1_dp, frame, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      call random%start(number, 12)
      rate = 2 * pi / frame%period
      motion(:, 1) = [(random%about_zero(0.5_dp), i = 1, 18)]
      motion(7:12, 1) = rate * motion(7:12, 1)
      motion(13:18, 1) = rate**2 * motion(13:18, 1)
      call drive_power(frame, [0.3_dp], motion, power, known)
      call find(frame, [0.3_dp], motion, forces, places, error)
      if (allocated(error)) return
      ! the sums of the masses and the forces of the links round differently; moments of arms of 0.1 m
      ratios = merge([1, 1, 1], [2, 3, -2], number <= 5)
      call near(error, [dot_product(ratios(:count(places%driven)), pack([(forces(places(i)%row + moment, 1), &
        & i = 1, size(places))], places%driven))], power(torque, :), 1.0e-12_dp * maxval(abs(forces)), "torque")
      if (allocated(error)) return
    end do
  end subroutine test_torque_in_space

  !> Peak and rms at loose tolerances against those at 1e-13, for both models.
  subroutine test_bounds(error)
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: tolerances(3) = [1.0e-2_dp, 1.0e-4_dp, 1.0e-7_dp]
    type(frame_type) :: frame
    type(statistics_type) :: exact, found
    real(dp) :: largest
    integer :: number, i

    largest = 0
    do number = 1, 6
      call make(random_machine(30 + number, 3.0_dp, 30.0_dp), frame, error)
      if (.not. allocated(error)) call solve(1.0e-13_dp, exact)
      if (allocated(error)) return
      do i = 1, size(tolerances)
        call solve(tolerances(i), found)
        if (allocated(error)) return
        call check_that(error, abs(found%peak - exact%peak), "<=", found%peak_error + exact%peak_error, "peak")
        call check_that(error, abs(found%rms - exact%rms), "<=", found%error + exact%error, "rms")
        if (allocated(error)) return
        largest = max(largest, abs(found%peak - exact%peak) / found%peak_error)
      end do
    end do
    ! A bound that no case comes near would be of no use. At loose tolerances harmonic balance is far more accurate than requested.
    call check_that(error, largest, ">", 1.0e-5_dp, "largest part of a bound")

  contains

    subroutine solve(tolerance, statistics)
      real(dp), intent(in) :: tolerance
      type(statistics_type), intent(out) :: statistics
      type(analysis_type) :: analysis
      type(quantity_type) :: quantity
      type(gestell_error), allocatable :: failure

      call analyse(frame, analysis_options(model=merge("exact", "rest ", mod(number, 2) == 0), points=36, rows=joint_forces), &
        & accuracy_type(tolerance=tolerance), analysis, failure)
      if (.not. allocated(failure)) call find_quantity(analysis%frame, no_probes, "joint(j4).f", quantity, failure)
      if (.not. allocated(failure)) call compute_statistics(analysis%vibration, quantity, statistics, failure)
      call check_success(error, failure)
    end subroutine solve

  end subroutine test_bounds

  subroutine test_names(error)
    type(error_type), allocatable, intent(out) :: error
    character(len=*), parameter :: right(8) = [character(len=20) :: "joint(O).f", "joint(O).m", "joint(A).fx", &
      & "joint(A:crank).fx", "joint(A:rod).axial", "joint(B:slider).fy", "joint(B:guide).n", "joint(B:guide).m"]
    character(len=*), parameter :: wrong(5) = [character(len=20) :: "joint(C).f", "joint(A).n", "joint(A:slider).f", "joint(A).v", &
      & "joint().f"]
    type(frame_type) :: frame
    type(quantity_type) :: quantity
    type(gestell_error), allocatable :: failure
    integer :: i

    call make_slider_crank(frame, error)
    if (allocated(error)) return
    do i = 1, size(right)
      call find_quantity(frame, no_probes, trim(right(i)), quantity, failure)
      call check_success(error, failure)
    end do
    do i = 1, size(wrong)
      call find_quantity(frame, no_probes, trim(wrong(i)), quantity, failure)
      call check_failure(error, failure, what=wrong(i))
    end do
  end subroutine test_names

end module test_joint_forces
