!> Machines by the models of the frame, and a vibration against d'Alembert's principle.
module exact_machines
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_math_series_trigonometric, only: series_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_floquet_solution, only: floquet_type, solve_floquet, solve_multipliers
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame_type
  use gestell_study_frame_model, only: newton_type, settle
  use machines, only: frame_of_machine
  use reference_exact, only: mean_dissipation, residual
  use reference_linear, only: qp
  use reference_machine, only: crank_speed, joint_data, khang_machine, link_data, machine_data, pi_qp, support_data
  use testdrive, only: check, error_type
  implicit none (type, external)
  private

  public :: check_residual, light_slider, machine_on_supports, ram, scotch_yoke, sinking_slider, solve, &
    & solve_multiplier, swinging_yoke

contains

  !> The paper's machine with supports of all kinds and damping. `turning`: the axes of all but one turn with the frame.
  function machine_on_supports(speed_rpm, factor, gravity, turning, held_by) result(machine)
    real(dp), intent(in) :: speed_rpm, factor
    real(dp), intent(in), optional :: gravity(2)
    logical, intent(in), optional :: turning
    character(len=*), intent(in), optional :: held_by
    type(machine_data) :: machine

    machine = khang_machine(speed_rpm, factor)
    machine%supports(1)%angle_deg = 30
    machine%supports(2)%stiffness = [1.0e5_dp, 3.0e5_dp]
    machine%supports(3)%damping = [400.0_dp, 150.0_dp]
    machine%supports(4)%damping = [50.0_dp, 700.0_dp]
    machine%supports(4)%angle_deg = -50
    if (present(gravity)) machine%gravity = gravity
    if (present(turning)) machine%supports([1, 2, 4])%turning = turning
    if (present(held_by)) machine%held_by = held_by
  end function machine_on_supports

  !> The machine of validation/exudyn/scotch_yoke.nml, weakly damped.
  function scotch_yoke(speed_rpm) result(machine)
    real(dp), intent(in) :: speed_rpm
    type(machine_data) :: machine

    machine%speed_rpm = speed_rpm
    allocate(machine%joints(3), machine%links(3), machine%supports(3))
    machine%joints(2) = joint_data("crank", ends=[1, 0], radius=0.06_dp, phase_deg=40.0_dp)
    machine%joints(3) = joint_data("RPP", ends=[2, 0], guide_point=[0.0_dp, 0.03_dp], guide_angle_deg=20.0_dp)
    machine%links(1) = link_data(1, 2, 1.6_dp, 0.004_dp, [-0.01_dp, 0.005_dp])
    machine%links(2) = link_data(2, 0, 0.3_dp, 0.0002_dp)
    machine%links(3) = link_data(3, 0, 2.4_dp, 0.012_dp, [0.05_dp, -0.02_dp])
    machine%frame_mass = 38
    machine%frame_inertia = 1.1_dp
    machine%origin = [-0.04_dp, 0.12_dp]
    machine%supports(1) = support_data([-0.25_dp, -0.22_dp], [1.4e5_dp, 0.5e5_dp], [6.0_dp, 3.0_dp], 45.0_dp)
    machine%supports(2) = support_data([0.27_dp, -0.20_dp], [1.5e5_dp, 0.6e5_dp], [6.0_dp, 3.0_dp], 125.0_dp)
    machine%supports(3) = support_data([0.02_dp, 0.30_dp], [2.0e4_dp, 4.0e4_dp], [2.0_dp, 2.0_dp], -10.0_dp)
  end function scotch_yoke

  !> A light Scotch yoke, weakly damped, whose frame swings by 1.42 rad.
  function swinging_yoke() result(machine)
    type(machine_data) :: machine

    machine%speed_rpm = -781.2411_dp
    allocate(machine%joints(3), machine%links(2), machine%supports(4))
    machine%joints(1) = joint_data("ground", position=[0.0_dp, 0.0_dp])
    machine%joints(2) = joint_data("crank", ends=[1, 0], radius=0.08007012_dp, phase_deg=-14.96457_dp)
    machine%joints(3) = joint_data("RPP", ends=[2, 0], guide_point=[0.0_dp, 0.1170459_dp], guide_angle_deg=27.87495_dp, &
      & slot_angle_deg=118.6496_dp)
    machine%links(1) = link_data(1, 2, 0.3303653_dp, 0.0001765039_dp, [0.04235374_dp, 0.0_dp])
    machine%links(2) = link_data(3, 0, 0.5692474_dp, 4.063496e-05_dp, [-0.03496283_dp, 0.01113721_dp])
    machine%frame_mass = 4.427426_dp
    machine%frame_inertia = 0.2901629_dp
    machine%origin = [-0.3459364_dp, 0.3497709_dp]
    machine%supports(1) = support_data([-0.4676102_dp, -0.3380505_dp], [2714.883_dp, 1425.433_dp], &
      & [0.1792276_dp, 0.1412837_dp], 0.0_dp, .true.)
    machine%supports(2) = support_data([-0.1330837_dp, -0.2046382_dp], [1476.783_dp, 4867.839_dp], &
      & [0.1129806_dp, 0.09399997_dp], 0.0_dp, .true.)
    machine%supports(3) = support_data([0.1499118_dp, 0.5031726_dp], [4173.424_dp, 6505.938_dp], &
      & [0.08866208_dp, 0.205337_dp], 0.0_dp, .false.)
    machine%supports(4) = support_data([0.6043491_dp, 0.3320154_dp], [6597.883_dp, 2043.96_dp], &
      & [0.1954325_dp, 0.1307855_dp], 0.0_dp, .true.)
    machine%gravity = [0.0_dp, -9.80665_dp]
  end function swinging_yoke

  !> A ram on weakly damped supports: from its linear vibration Newton's method diverges to ever rougher motions.
  function ram() result(machine)
    type(machine_data) :: machine

    machine%speed_rpm = 681.6597_dp
    machine%held_by = 'flywheel'
    allocate(machine%joints(5), machine%links(5), machine%supports(4))
    machine%joints(1) = joint_data("ground", position=[0.0_dp, 0.0_dp])
    machine%joints(2) = joint_data("ground", position=[0.1785124_dp, 0.01035125_dp])
    machine%joints(3) = joint_data("crank", ends=[1, 0], radius=0.04221779_dp, phase_deg=-33.95332_dp)
    machine%joints(4) = joint_data("RRR", ends=[3, 2], lengths=[0.2245674_dp, 0.1792676_dp], branch=-1)
    machine%joints(5) = joint_data("RRP", ends=[4, 0], lengths=[0.4339858_dp, 0.0_dp], branch=1, &
      & guide_point=[0.02236603_dp, 0.03279756_dp], guide_angle_deg=-34.87087_dp)
    machine%links(1) = link_data(1, 3, 2.955838_dp, 0.0004390261_dp, [0.006575781_dp, 0.0001705107_dp])
    machine%links(2) = link_data(3, 4, 1.86194_dp, 0.007824887_dp, [0.07456594_dp, -0.03183378_dp])
    machine%links(3) = link_data(2, 4, 6.299634_dp, 0.01687088_dp, [0.0682214_dp, 0.0_dp])
    machine%links(4) = link_data(4, 5, 4.657709_dp, 0.07310417_dp, [0.2169929_dp, 0.0_dp])
    machine%links(5) = link_data(5, 0, 4.316304_dp, 0.0_dp, [0.0_dp, 0.0_dp])
    machine%frame_mass = 35.3951_dp
    machine%frame_inertia = 0.3758569_dp
    machine%origin = [0.07706703_dp, -0.1429413_dp]
    machine%supports(1) = support_data([-0.2215443_dp, -0.06595064_dp], [100095.5_dp, 23140.38_dp], &
      & [5.001617_dp, 13.01114_dp], 0.0_dp, .false.)
    machine%supports(2) = support_data([-0.04748483_dp, -0.06595064_dp], [100319.4_dp, 141855.6_dp], &
      & [11.46319_dp, 20.75571_dp], 0.0_dp, .true.)
    machine%supports(3) = support_data([0.07196993_dp, -0.06595064_dp], [92564.53_dp, 33844.63_dp], &
      & [20.85941_dp, 21.45363_dp], 0.0_dp, .false.)
    machine%supports(4) = support_data([0.1930832_dp, -0.06595064_dp], [116573.6_dp, 20914.39_dp], &
      & [19.91791_dp, 17.42779_dp], 57.14694_dp, .false.)
    machine%gravity = [0.0_dp, -9.80665_dp]
  end function ram

  !> A slider-crank on two weakly damped supports, lighter than its links. At this speed no path leads to its vibration: neither
  !> from the linear one, nor over the excitation, nor from other speeds within a tenth.
  function light_slider() result(machine)
    type(machine_data) :: machine

    machine%speed_rpm = -74.12699421_dp
    allocate(machine%joints(3), machine%links(3), machine%supports(2))
    machine%joints(2) = joint_data("crank", ends=[1, 0], radius=0.0326765_dp, phase_deg=-34.765_dp)
    machine%joints(3) = joint_data("RRP", ends=[2, 0], lengths=[0.134855_dp, 0.0_dp], guide_point=[0.0_dp, -0.00223343_dp], &
      & guide_angle_deg=32.6056_dp)
    machine%links(1) = link_data(1, 2, 0.809763_dp, 8.64628e-05_dp, [0.0112529_dp, 0.0_dp])
    machine%links(2) = link_data(2, 3, 0.927775_dp, 0.00132203_dp, [0.0274213_dp, -0.00125753_dp])
    machine%links(3) = link_data(3, 0, 0.150783_dp)
    machine%frame_mass = 2.95318_dp
    machine%frame_inertia = 0.0141583_dp
    machine%origin = [-0.0287911_dp, 0.0576715_dp]
    machine%supports(1) = support_data([-0.00505078_dp, 0.0899476_dp], [652.318_dp, 742.582_dp], [0.0511739_dp, 0.0395881_dp])
    machine%supports(2) = support_data([0.125542_dp, 0.111083_dp], [839.07_dp, 679.027_dp], [0.0917968_dp, 0.0658305_dp])
  end function light_slider

  !> A slider-crank that sinks by ten times its size on its mounts: no vibration of it is known.
  function sinking_slider() result(machine)
    type(machine_data) :: machine

    machine%speed_rpm = -53.13_dp
    machine%held_by = "outside"
    machine%gravity = [0.0_dp, -9.80665_dp]
    machine%free(1) = .false.
    allocate(machine%joints(3), machine%links(3), machine%supports(4))
    machine%joints(2) = joint_data("crank", ends=[1, 0], radius=0.05995_dp, phase_deg=129.7_dp)
    machine%joints(3) = joint_data("RRP", ends=[2, 0], lengths=[0.1847_dp, 0.0_dp], branch=-1, &
      & guide_point=[0.01663_dp, -0.003047_dp], guide_angle_deg=134.0_dp)
    machine%links(1) = link_data(1, 2, 0.9239_dp, 1.649e-4_dp, [0.04562_dp, 0.0_dp])
    machine%links(2) = link_data(2, 3, 0.539_dp, 2.387e-3_dp, [0.09114_dp, 0.0_dp])
    machine%links(3) = link_data(3, 0, 1.374_dp, 4.919e-4_dp, [0.02169_dp, 0.0_dp])
    machine%frame_mass = 50.53_dp
    machine%frame_inertia = 0.443_dp
    machine%origin = [-0.01291_dp, 0.05711_dp]
    machine%supports(1) = support_data([-0.1274_dp, -0.03686_dp], [223.9_dp, 78.53_dp], [28.2_dp, 9.227_dp])
    machine%supports(2) = support_data([-0.05768_dp, -0.07461_dp], [364.9_dp, 161.8_dp], [32.83_dp, 20.31_dp])
    machine%supports(3) = support_data([0.05593_dp, -0.0568_dp], [232.3_dp, 110.2_dp], [22.36_dp, 6.012_dp])
    machine%supports(4) = support_data([0.1171_dp, -0.02174_dp], [309.3_dp, 98.27_dp], [45.55_dp, 14.1_dp], 20.03_dp)
    machine%supports([2, 4])%turning = .true.
  end function sinking_slider

  subroutine solve(machine, model, system, error, newton)
    type(machine_data), intent(in) :: machine
    character(len=*), intent(in) :: model
    class(frame_type), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(newton_type), intent(out), optional :: newton
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure

    call frame_of_machine(machine, frame, failure)
    if (.not. allocated(failure)) call settle(frame, model, accuracy_type(tolerance=1.0e-11_dp), system, failure, newton)
    call check_success(error, failure)
  end subroutine solve

  subroutine solve_multiplier(machine, model, multipliers, error)
    type(machine_data), intent(in) :: machine
    character(len=*), intent(in) :: model
    type(multipliers_type), intent(out) :: multipliers
    type(error_type), allocatable, intent(out) :: error
    class(frame_type), allocatable :: system
    type(floquet_type) :: floquet
    type(gestell_error), allocatable :: failure

    call solve(machine, model, system, error)
    if (allocated(error)) return
    call solve_floquet(system, accuracy_type(tolerance=1.0e-11_dp), .false., floquet, failure)
    if (.not. allocated(failure)) call solve_multipliers(floquet, .false., multipliers, failure)
    call check_success(error, failure)
  end subroutine solve_multiplier

  !> q at a crank angle, in quadruple precision.
  function motion_at(series, phi) result(q)
    type(series_type), intent(in) :: series
    real(qp), intent(in) :: phi
    real(qp) :: q(3)
    integer :: k

    q = series%cosine(0, :)
    do k = 1, ubound(series%cosine, 1)
      q = q + series%cosine(k, :) * cos(k * phi) + series%sine(k, :) * sin(k * phi)
    end do
  end function motion_at

  !> Checks that a vibration of large amplitude satisfies d'Alembert's principle.
  subroutine check_residual(machine, system, error)
    type(machine_data), intent(in) :: machine
    class(frame_type), intent(in) :: system
    type(error_type), allocatable, intent(out) :: error
    real(qp), parameter :: step = 1.0e-8_qp
    integer, parameter :: angles = 64
    real(qp) :: left(3), terms(3), phi, torque, q(3, 3, angles)
    integer :: i

    select type (system)
    class is (varied_frame_type)
      call check_that(error, maxval(abs(system%motion%cosine(1:, 3))), ">", 1.0e-3_dp, "the motion is not small")
      torque = 0
      if (machine%held_by == "flywheel") then
        do i = 1, angles
          q(:, :, i) = around(system%motion, 2 * pi_qp * i / angles)
        end do
        torque = mean_dissipation(machine, step, q) / crank_speed(machine)
      end if
      do i = 0, 6
        if (allocated(error)) return
        phi = 0.3_qp + i
        call residual(machine, phi, step, around(system%motion, phi), torque, left, terms)
        ! The motion is accurate to 1e-11, its accelerations to the square of the orders times that.
        call check(error, real(maxval(abs(left) / terms), dp), 0.0_dp, thr=1.0e-8_dp, more="residual")
      end do
    end select

  contains

    !> Over the crank angle, which falls with time where the speed is negative.
    function around(motion, phi) result(q)
      type(series_type), intent(in) :: motion
      real(qp), intent(in) :: phi
      real(qp) :: q(3, 3), way

      way = sign(1.0_dp, machine%speed_rpm)
      q = reshape([motion_at(motion, way * (phi - step)), motion_at(motion, way * phi), motion_at(motion, way * (phi + step))], &
        & [3, 3])
    end function around

  end subroutine check_residual

end module exact_machines
