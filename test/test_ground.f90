!> Forces and moments on the ground: one definition of moments everywhere, and bounds that cover rounding.
module test_ground
  use checks, only: check_success, check_that
  use exact_machines, only: machine_on_supports
  use gestell, only: machine_type, solution_type, table_type
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_model_frame, only: frame_type
  use gestell_model_quantity, only: find_quantity
  use gestell_model_quantity_rows, only: guide_forces, probe_type, quantity_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type, analysis_options
  use gestell_study_vibration_statistics, only: history_of
  use machines, only: frame_of_machine
  use reference_exact, only: inertia_of, mass_of, place
  use reference_linear, only: qp
  use reference_linkage, only: motion_type, move
  use reference_machine, only: crank_speed, machine_data
  use reference_momentum, only: derivative
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_ground

  character, parameter :: newline = new_line("a")

  !> A frame that turns by 7e-7 rad, so that cos psi - 1 is 3e-13, on one support whose axes stay in space and one whose axes turn.
  character(len=*), parameter :: cancelled = "&drive speed_rpm=36.67929604612007, held_by='outside' /" // newline // &
    & "&joint name='O', type='ground', position=0.0,0.0 /" // newline // &
    & "&joint name='A', type='crank', pivot='O', radius=0.009224704142103735, phase=43.90033673244304 /" // newline // &
    & "&joint name='B', type='RRP', ends='A', lengths=0.043327481512799686," // &
    & " guide_point=-0.0,0.00015765595550739335, guide_angle=0.0, branch=1 /" // newline // &
    & "&link name='crank', from='O', to='A', mass=0.0018561450133567036, inertia=1.3162414081423382e-08," // &
    & " center=0.003090549410874741,0.0 /" // newline // &
    & "&link name='rod', from='A', to='B', mass=0.0016139093329388438, inertia=2.524787191111142e-07," // &
    & " center=0.021218446307984598,0.0 /" // newline // &
    & "&link name='piston', from='B', mass=0.0038805543888007147, inertia=0.0, center=0.0,0.0 /" // newline // &
    & "&link name='cw', from='O', to='A', mass=0.004484082721756517, inertia=2.8618032438716347e-09," // &
    & " center=-0.006855162906936174,0.0 /" // newline // &
    & "&frame mass=28.1720964773221, inertia=0.13075198174831232," // &
    & " origin=0.004584786400481793,-0.06527839311864161, dof='psi' /" // newline // &
    & "&support position=-0.061084007007942004,-0.023180344199719385," // &
    & " stiffness=8959.75464908919,1917.7404550783256, damping=2.3454497848932037,2.157124706498236 /" // newline // &
    & "&support position=0.08968918172862936,-0.07188844701853685," // &
    & " stiffness=1633.2506458238522,3640.835139416557, damping=1.9938757422645852,1.4439987747408638," // &
    & " axes='frame' /" // newline // &
    & "&accuracy tolerance=1.2194978424716087e-12, method='auto' /" // newline // &
    & "&response quantities='psi','fx','fy','m','f', measures='peak','rms' /" // newline
  !> A drive at 9000 1/min whose torque is the difference of larger terms of its links.
  character(len=*), parameter :: quick = "&drive speed_rpm=9023.360697604465, held_by='flywheel' /" // newline // &
    & "&joint name='A0', type='ground', position=0.0,0.0 /" // newline // &
    & "&joint name='B0', type='ground', position=0.03716954258887067,0.011420479342946202 /" // newline // &
    & "&joint name='A', type='crank', pivot='A0', radius=0.007474991812574786, phase=73.2816316070913 /" // newline // &
    & "&joint name='B', type='RRR', ends='A','B0', lengths=0.05020618808839413,0.042935824667383535, branch=1 /" // newline // &
    & "&joint name='D', type='RRP', ends='B', lengths=0.07495097486198919," // &
    & " guide_point=-0.008791892816193941,-0.006405195969456911, guide_angle=58.302199285314174, branch=1 /" // newline // &
    & "&link name='crank', from='A0', to='A', mass=0.018591672075686336, inertia=8.656825178060776e-08," // &
    & " center=0.0008949900149734449,0.0004800507639464402 /" // newline // &
    & "&link name='coupler', from='A', to='B', mass=0.01830664957358854, inertia=3.845405293522898e-06," // &
    & " center=0.02710364263527239,-0.00897772420221245 /" // newline // &
    & "&link name='rocker', from='B0', to='B', mass=0.05270517695642676, inertia=8.09676710356535e-06," // &
    & " center=0.019312078368896056,0.0 /" // newline // &
    & "&link name='rod', from='B', to='D', mass=0.01802242292456347, inertia=8.436969958436847e-06," // &
    & " center=0.037475487430994596,0.0 /" // newline // &
    & "&link name='ram', from='D', mass=0.06879050866522415, inertia=0.0, center=0.0,0.0 /" // newline // &
    & "&frame mass=513.8834059534717, inertia=1.0222796893772146," // &
    & " origin=0.037452692314672895,-0.07977165957655197 /" // newline // &
    & "&support position=-0.11968826107162774,-0.10899132791380053," // &
    & " stiffness=1530747.7652775606,1530747.7652775606, damping=871.2752766794935,573.9332612632896 /" // newline // &
    & "&support position=0.1569200105584469,-0.10899132791380053," // &
    & " stiffness=4484302.061337495,4484302.061337495, damping=1534.0571304408813,1885.9028018246895 /" // newline // &
    & "&foundation stiffness=0,0,0,0,0,0,0,0,18915.543565113057," // &
    & " damping=380.4650283998172,380.4650283998172,1.5144141216311258 /" // newline // &
    & "&gravity /" // newline // &
    & "&accuracy tolerance=3.02839051885503e-08, method='auto' /" // newline // &
    & "&design parameter='frame.mass', from=500, to=520, starts=1 / &objective quantity='torque'," // &
    & " measure='peak' /" // newline
  !> A mass of 15 t on springs, shaken by the residual force of a counterweight.
  character(len=*), parameter :: heavy = "&drive speed_rpm=340.83108337489773, held_by='outside' /" // newline // &
    & "&joint name='O', type='ground', position=0,0 /" // newline // &
    & "&joint name='A', type='crank', pivot='O', radius=0.0018461040468618183, phase=54.22191264846862 /" // newline // &
    & "&link name='crank', from='O', to='A', mass=3.263954682788322, inertia=6.350215042648279e-06," // &
    & " center=0.000679449930945741,0.00017815041121859864, z=0.0005556180654955138 /" // newline // &
    & "&link name='cw', from='O', to='A', mass=3.263954682788322, inertia=0, center=-0.0006836505054327465,0," // &
    & " z=0.0002952927972098063 /" // newline // &
    & "&frame mass=14899.22232629884, inertia=11.440191492062494,9.333980550086801,16.187022154898614," // &
    & " origin=-0.0004416594223355317,0.0035465106729705804, dof='xi','psi','zeta','rot_eta' /" // newline // &
    & "&support position=0.012280692435782576,-0.013048231293653673,-0.011799809624140926," // &
    & " stiffness=12203985.446042756,40172109.79335336,1943508.6684885349," // &
    & " damping=79360.72815498074,81919.64517278831,36830.30538976105," // &
    & " angle=18.61920555592812,-1.149086400706273,0 /" // newline // &
    & "&support position=0.013101911963832346,0.00589882109665321,0.013903965567514278," // &
    & " stiffness=1131731.667071516,3709244.2454682183,1844351.1851590693," // &
    & " damping=11009.86294307339,32327.132065775306,22764.65690371591 /" // newline // &
    & "&support position=0.006930726129219142,-0.00936367751307633,0.010748834424543831," // &
    & " stiffness=9535903.059037639,511595.86657365673,28364282.67251256," // &
    & " damping=84046.96948576412,18288.984492931308,87057.2729979975, axes='frame' /" // newline // &
    & "&foundation damping=10635.58565061096,10635.58565061096,9.271995797367293,10635.58565061096,9.27199579736" // &
    & "7293,9.271995797367293 /" // newline // &
    & "&gravity /" // newline // &
    & "&accuracy tolerance=1.921739950982291e-10 /" // newline // &
    & "&response points=48 /" // newline

contains

  subroutine collect_ground(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the moment on the ground equals the rate of angular momentum lost", test_moment), &
      & new_unittest("error bounds cover rounding, by comparison with quadruple precision", test_roundings)]
  end subroutine collect_ground

  !> Results for the same machines by this program with quadruple precision throughout and a tolerance of 1e-15 (gfortran, kind
  !> real128, LAPACK by -freal-8-real-16). They lie within the bounds, and the bounds are not too wide.
  subroutine test_roundings(error)
    type(error_type), allocatable, intent(out) :: error

    call compare(cancelled, "response", "quantities", "value", [3, 4, 5, 6, 9, 10], [2.4143699857518629794e-4_dp, &
      & 1.2946906494585867398e-4_dp, 1.5551025340472707631e-4_dp, 8.3391488615632388855e-5_dp, 5.1427118165426105582e-4_dp, &
      & 3.3784275825210645972e-4_dp], error)
    if (.not. allocated(error)) call compare(quick, "design", "design_goals", "before", [1], [7.7419175015231281_dp], error)
    if (.not. allocated(error)) call compare(heavy, "forces", "supports", "least_compression_N", [6], &
      & [1.4617473460223752371e5_dp], error)
  end subroutine test_roundings

  !> Compares some rows of the column `value` of a task's table with the right values, within its column of errors.
  subroutine compare(input, task, name, value, rows, right, error)
    character(len=*), intent(in) :: input, task, name, value
    integer, intent(in) :: rows(:)
    real(dp), intent(in) :: right(:)
    type(error_type), allocatable, intent(out) :: error
    type(machine_type) :: machine
    type(solution_type) :: solution
    type(table_type) :: table
    type(gestell_error), allocatable :: failure
    real(dp), allocatable :: found(:), errors(:)
    integer :: i, k

    call machine%parse(input, failure)
    if (.not. allocated(failure)) call machine%solve(solution, failure, task)
    if (.not. allocated(failure)) call solution%table(name, table, failure)
    call check_success(error, failure, name)
    if (allocated(error)) return
    do k = 1, size(table%columns)
      if (table%columns(k)%key /= value) cycle
      found = table%columns(k)%numbers(rows)
      do i = 1, size(table%columns)
        if (table%columns(i)%key == table%columns(k)%error) errors = table%columns(i)%numbers(rows)
      end do
    end do
    ! and half a unit in the last place of both numbers
    call check_that(error, abs(found - right), "<=", errors + epsilon(right) * right, name // ", " // value)
    call check_that(error, errors, "<=", 1.0e-9_dp * right, name // ", bound on " // value)
  end subroutine compare

  !> The moment of all ground forces about the point where F rests equals the loss of angular momentum about it, whichever
  !> degrees of freedom guides hold. Where the frame rotates freely the guide's moment is that of its force at the moving F.
  subroutine test_moment(error)
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: points = 256
    logical, parameter :: free(3, 5) = reshape([.true., .true., .true., .true., .false., .true., .false., .true., .true., .true., &
      & .true., .false., .false., .false., .true.], [3, 5])
    type(machine_data) :: machine
    type(frame_type) :: frame
    type(analysis_type) :: analysis
    type(gestell_error), allocatable :: failure
    real(dp) :: lost(points)
    integer :: i

    do i = 1, size(free, 2)
      machine = machine_on_supports(500.0_dp, 10.0_dp)
      ! A foundation's moment is its matrix times the displacement: no body's force has that arm.
      machine%foundation_stiffness = 0
      machine%foundation_damping = 0
      machine%supports%damping(1) = 400
      machine%supports%damping(2) = 400
      machine%free = free(:, i)
      call frame_of_machine(machine, frame, failure)
      if (.not. allocated(failure)) call analyse(frame, analysis_options(model="exact", points=points, rows=guide_forces), &
        & accuracy_type(tolerance=1.0e-12_dp), analysis, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      lost = lost_momentum(machine, analysis%vibration%motion_history(:, :points))
      ! The motion is good to about 1e-12 of its size; the derivatives of up to 128 orders take four digits.
      call expect("total.m", lost)
      if (free(3, i)) then
        associate (motion => analysis%vibration%motion_history(:, :points))
          call expect("guide.m", motion(1, :) * motion(11, :) - motion(2, :) * motion(10, :))
        end associate
      end if
      if (allocated(error)) return
    end do

  contains

    subroutine expect(name, expected)
      character(len=*), intent(in) :: name
      real(dp), intent(in) :: expected(:)
      type(quantity_type) :: quantity
      type(probe_type) :: none(0)
      real(dp), allocatable :: history(:)

      if (allocated(error)) return
      call find_quantity(frame, none, name, quantity, failure)
      if (.not. allocated(failure)) call history_of(analysis%vibration, quantity, history, failure)
      call check_success(error, failure, name)
      if (allocated(error)) return
      call check_that(error, maxval(abs(history(:points) - expected)), "<", 1.0e-8_dp * maxval(abs(lost)), name)
    end subroutine expect

  end subroutine test_moment

  !> -d/dt of the angular momentum of links and frame about the origin in space, from q at equidistant times over the turn.
  function lost_momentum(machine, q) result(lost)
    type(machine_data), intent(in) :: machine
    real(dp), intent(in) :: q(:, :)
    real(dp) :: lost(size(q, 2)), z(2, size(q, 2)), turn_dd(size(q, 2)), acceleration(2, size(q, 2)), omega, period
    type(motion_type) :: motion
    integer :: i, k

    omega = real(crank_speed(machine), dp)
    period = 2 * pi / abs(omega)
    lost = 0
    do i = 0, size(machine%links)
      turn_dd = 0
      do k = 1, size(q, 2)
        motion = move(machine, omega * period * (k - 1) / real(size(q, 2), qp))
        z(:, k) = real(place(machine, motion, i, real(q(:3, k), qp)), dp)
        if (i > 0) turn_dd(k) = omega**2 * real(motion%turn(2, i), dp)
      end do
      do k = 1, 2
        acceleration(k, :) = derivative(derivative(z(k, :), period), period)
      end do
      turn_dd = turn_dd + derivative(derivative(q(3, :), period), period)
      lost = lost - real(mass_of(machine, i), dp) * (z(1, :) * acceleration(2, :) - z(2, :) * acceleration(1, :)) &
        & - real(inertia_of(machine, i), dp) * turn_dd
    end do
  end function lost_momentum

end module test_ground
