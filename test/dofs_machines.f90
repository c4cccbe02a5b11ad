!> Inputs for all tasks with any set of degrees of freedom.
module dofs_machines
  use gestell_model_frame, only: dof_names
  implicit none (type, external)
  private

  public :: critical_range, machine_of, names_of, orders_of, quantities_of, ranges_of

  character, parameter :: newline = new_line("a")
  !> Requested orders of the task `critical`: in some sets the first order meets a mode.
  character(len=*), parameter :: critical_range = "&sweep parameter='drive.speed_rpm', from=430, to=760, count=2 /" // newline &
    & // "&resonance orders=1 /" // newline
  !> A set of degrees of freedom is a number whose bits stand for `dof_names`. The first seven sets are those of the plane.
  integer, parameter, public :: last_plane = 7, last_space = 63

contains

  !> A slider-crank at 430 rpm on tilted mounts, one of which turns with the frame, with weights, a foundation and a probe.
  !> Every seventh set has the exact frame, unless a `model` is given; holders of the speed take turns.
  function machine_of(set, model) result(text)
    integer, intent(in) :: set
    character(len=*), intent(in), optional :: model
    character(len=:), allocatable :: text
    character(len=8), parameter :: holders(0:2) = [character(len=8) :: "motor", "flywheel", "outside"]
    character(len=:), allocatable :: frame_model
    logical :: space

    space = set > last_plane
    frame_model = merge("exact", "rest ", modulo(set, 7) == 5)
    frame_model = trim(frame_model)
    if (present(model)) frame_model = model
    text = "&drive speed_rpm=430, held_by='" // trim(holders(modulo(set, 3))) // "' /" // newline &
      & // "&model frame='" // frame_model // "' /" // newline &
      & // "&joint name='O', type='ground', position=0,0 /" // newline &
      & // "&joint name='A', type='crank', pivot='O', radius=0.03, phase=20 /" // newline &
      & // "&joint name='B', type='RRP', ends='A', lengths=0.11, guide_point=0,0.01, guide_angle=70, branch=1 /" // newline &
      & // "&link name='crank', from='O', to='A', mass=1.2, inertia=0.002, center=0.012,0.003" // in_space(", z=0.02") // " /" &
      & // newline // "&link name='rod', from='A', to='B', mass=0.6, inertia=0.001, center=0.04,0" // in_space(", z=0.03") // " /" &
      & // newline // "&link name='slider', from='B', mass=0.9, inertia=0" // in_space(", z=0.04") // " /" // newline &
      & // "&frame mass=25, inertia=" // in_space("0.8,0.7,") // "0.9, origin=-0.02,0.05, dof=" // names_of(set) // " /" &
      & // newline &
      & // "&support position=-0.25,-0.15" // in_space(",0.1") // ", stiffness=6e4,9e4" // in_space(",7e4") &
      & // ", damping=250,350" // in_space(",300") // ", angle=10" // in_space(",5,0") // " /" // newline &
      & // "&support position=0.22,-0.12" // in_space(",-0.14") // ", stiffness=7e4,8e4" // in_space(",5e4") &
      & // ", damping=200,400" // in_space(",300") // ", angle=-15" // in_space(",0,10") // ", axes='frame' /" // newline &
      & // "&support position=0.1,0.14" // in_space(",0.12") // ", stiffness=5e4,3e4" // in_space(",4e4") &
      & // ", damping=200,200" // in_space(",300") // " /" // newline &
      & // "&foundation damping=30,40,2" // in_space(",35,1,1.5") // " /" // newline // "&gravity /" // newline &
      & // "&probe name='p', position=0.2,0.15" // in_space(",0.05") // ", limit_mm_s=20, band_hz=5,40 /" // newline &
      & // "&accuracy tolerance=1e-7 /" // newline

  contains

    function in_space(words)
      character(len=*), intent(in) :: words
      character(len=:), allocatable :: in_space

      in_space = ""
      if (space) in_space = words
    end function in_space

  end function machine_of

  !> The degrees of freedom of a set as in an input: 'xi','zeta'.
  function names_of(set) result(names)
    integer, intent(in) :: set
    character(len=:), allocatable :: names
    integer :: i

    names = ""
    do i = 1, size(dof_names)
      if (btest(set, i - 1)) names = names // ",'" // trim(dof_names(i)) // "'"
    end do
    names = names(2:)
  end function names_of

  !> Quantities of all kinds as in an input: 'xi_ddot','f',...
  function quantities_of(set) result(names)
    integer, intent(in) :: set
    character(len=:), allocatable :: names

    names = "'xi_ddot','psi','fx','m','f','total.fx','total.f','total.m','guide.fy','guide.f','guide.m','foundation.f'," &
      & // "'support(1).fx','support(1).f','support(2).f','probe(p).d','probe(p).v','probe(p).ax'"
    if (set > last_plane) names = names // ",'total.mx','total.fz'"
  end function quantities_of

  !> Groups of the input for tasks about one machine.
  function orders_of(set) result(text)
    integer, intent(in) :: set
    character(len=:), allocatable :: text

    text = "&response quantities=" // quantities_of(set) // ", measures='peak','rms','band', points=12, harmonics=3 /" // newline &
      & // "&sensitivity quantities='f','guide.m','probe(p).v', parameters='support(1).stiffness' /" // newline &
      & // "&design parameter='link(crank).center(1)', from=-0.012, to=0.012, starts=1 /" // newline &
      & // "&objective quantity='total.f' /" // newline &
      & // limit("'total.m'", "rms") // limit("'guide.f'", "peak") // limit("'torque'", "peak") // limit("'shaking.f'", "rms") &
      & // limit("'shaking.m'", "rms") // limit("'probe(p).v'", "band") &
      & // "&constraint quantity='rho_max', at_most=1e9 /" // newline

  contains

    function limit(quantity, measure)
      character(len=*), intent(in) :: quantity, measure
      character(len=:), allocatable :: limit

      limit = "&constraint quantity=" // quantity // ", measure='" // measure // "', at_most=1e9 /" // newline
    end function limit

  end function orders_of

  !> Groups of the input for tasks over a range.
  function ranges_of(set) result(text)
    integer, intent(in) :: set
    character(len=:), allocatable :: text

    text = "&sweep parameter='drive.speed_rpm', from=430, to=560, count=2, engine='direct', columns='rho_max'," &
      & // quantities_of(set) // ", measures='peak','rms','band' /" // newline &
      & // "&resonance quantities='f','total.m','guide.m','probe(p).v', orders=1 /" // newline &
      & // "&separation orders=1 /" // newline
  end function ranges_of

end module dofs_machines
