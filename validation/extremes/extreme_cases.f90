!> The list of extreme cases: the paper's machine, changed in one thing at a time.
module extreme_cases
  use reference_machine, only: dp, khang_machine, machine_data
  implicit none (type, external)
  private

  public :: case_type, all_cases

  type :: case_type
    character(len=12) :: family = ''
    character(len=44) :: label = ''
    type(machine_data) :: machine
    real(dp) :: tolerance = 1.0e-9_dp
  end type case_type

contains

  function all_cases() result(cases)
    type(case_type), allocatable :: cases(:)

    allocate (cases(0))
    call speeds(cases)
    call stiffnesses(cases)
    call masses(cases)
    call dampings(cases)
    call dead_points(cases)
    call sizes(cases)
    call tolerances(cases)
    call supports(cases)
  end function all_cases

  subroutine add(cases, family, label, machine, tolerance)
    type(case_type), allocatable, intent(inout) :: cases(:)
    character(len=*), intent(in) :: family, label
    type(machine_data), intent(in) :: machine
    real(dp), intent(in), optional :: tolerance
    type(case_type) :: one

    one%family = family
    one%label = label
    one%machine = machine
    if (present(tolerance)) one%tolerance = tolerance
    cases = [cases, one]
  end subroutine add

  subroutine speeds(cases)
    type(case_type), allocatable, intent(inout) :: cases(:)
    real(dp), parameter :: rpm(10) = [0.01_dp, 0.1_dp, 1.0_dp, 20.0_dp, 60.0_dp, 240.0_dp, 360.0_dp, 1300.0_dp, &
      & 10000.0_dp, 100000.0_dp]
    character(len=*), parameter :: numbers(10) = [character(len=6) :: '0.01', '0.1', '1', '20', '60', '240', '360', '1300', &
      & '10000', '100000']
    integer :: i

    do i = 1, size(rpm)
      call add(cases, 'speed', trim(numbers(i)) // ' rpm', khang_machine(rpm(i)))
    end do
  end subroutine speeds

  subroutine stiffnesses(cases)
    type(case_type), allocatable, intent(inout) :: cases(:)
    type(machine_data) :: machine
    integer :: decade, i

    do decade = -3, 15
      machine = khang_machine(240.0_dp)
      do i = 1, size(machine%supports)
        machine%supports(i)%stiffness = machine%supports(i)%stiffness*10.0_dp**decade
      end do
      call add(cases, 'stiffness', 'springs ' // power(decade), machine)
    end do
  end subroutine stiffnesses

  !> The mass of the links against that of the frame, first on the same springs, then on springs that are stiffer by as
  !> much as the whole is heavier.
  subroutine masses(cases)
    type(case_type), allocatable, intent(inout) :: cases(:)
    type(machine_data) :: machine
    real(dp) :: heavier
    integer :: decade, i

    do decade = -9, 9
      machine = with_ratio(decade)
      call add(cases, 'masses', 'links over frame ' // power(decade), machine)
    end do
    do decade = 1, 9, 2
      machine = with_ratio(decade)
      heavier = (machine%frame_mass + sum(machine%links%mass))/machine%frame_mass
      do i = 1, size(machine%supports)
        machine%supports(i)%stiffness = machine%supports(i)%stiffness*heavier
      end do
      call add(cases, 'masses', 'links over frame ' // power(decade) // ', springs in proportion', machine)
    end do
  end subroutine masses

  function with_ratio(decade) result(machine)
    integer, intent(in) :: decade
    type(machine_data) :: machine
    real(dp) :: factor

    machine = khang_machine(240.0_dp)
    factor = 10.0_dp**decade*machine%frame_mass/sum(machine%links%mass)
    machine%links%mass = machine%links%mass*factor
    machine%links%inertia = machine%links%inertia*factor
  end function with_ratio

  subroutine dampings(cases)
    type(case_type), allocatable, intent(inout) :: cases(:)
    type(machine_data) :: machine
    real(dp), parameter :: factor(13) = [0.0_dp, 1.0e-6_dp, 1.0e-3_dp, 1.0_dp, 1.0e2_dp, 1.0e3_dp, 5.0e3_dp, 1.0e4_dp, &
      & 2.0e4_dp, 5.0e4_dp, 1.0e5_dp, 1.0e6_dp, 2.0e6_dp]
    character(len=*), parameter :: numbers(13) = [character(len=6) :: '0', '1e-6', '1e-3', '1', '100', '1000', '5000', &
      & '10000', '20000', '50000', '1e5', '1e6', '2e6']
    integer :: i

    do i = 1, size(factor)
      machine = khang_machine(240.0_dp)
      machine%foundation_damping = machine%foundation_damping*factor(i)
      call add(cases, 'damping', 'dampers times ' // numbers(i), machine)
    end do
  end subroutine dampings

  !> The coupler so long that the dyad almost stretches, or so short that it almost folds.
  subroutine dead_points(cases)
    type(case_type), allocatable, intent(inout) :: cases(:)
    type(machine_data) :: machine
    integer, parameter :: decades(4) = [-2, -3, -4, -6]
    integer :: i

    do i = 1, size(decades)
      machine = khang_machine(240.0_dp)
      machine%joints(4)%lengths(1) = 0.47_dp*(1 + 10.0_dp**decades(i)) - 0.16_dp
      call add(cases, 'dead point', 'stretched but for ' // power(decades(i)), machine)
    end do
    do i = 1, size(decades)
      machine = khang_machine(240.0_dp)
      machine%joints(4)%lengths(1) = 0.33_dp*(1 - 10.0_dp**decades(i)) + 0.16_dp
      call add(cases, 'dead point', 'folded but for ' // power(decades(i)), machine)
    end do
  end subroutine dead_points

  !> Machines whose ground link has the length 1e-6 m or 1e3 m, alike in form, density and elasticity: masses as
  !> length^3, inertias ^5, springs ^1, dampers ^2 and ^4; at 240 rpm and at a speed as 1/length.
  subroutine sizes(cases)
    type(case_type), allocatable, intent(inout) :: cases(:)
    real(dp), parameter :: ground(2) = [1.0e-6_dp, 1.0e3_dp]
    integer :: i

    do i = 1, 2
      call add(cases, 'size', merge('1e-6 m', '1e3 m ', i == 1) // ', 240 rpm', scaled(ground(i)/0.40_dp, 240.0_dp))
      call add(cases, 'size', merge('1e-6 m', '1e3 m ', i == 1) // ', speed as 1/length', &
        & scaled(ground(i)/0.40_dp, 240.0_dp*0.40_dp/ground(i)))
    end do
  end subroutine sizes

  function scaled(s, speed_rpm) result(machine)
    real(dp), intent(in) :: s, speed_rpm
    type(machine_data) :: machine
    integer :: i

    machine = khang_machine(speed_rpm)
    do i = 1, size(machine%joints)
      associate (joint => machine%joints(i))
        joint%position = joint%position*s
        joint%radius = joint%radius*s
        joint%lengths = joint%lengths*s
      end associate
    end do
    do i = 1, size(machine%links)
      associate (link => machine%links(i))
        link%mass = link%mass*s**3
        link%inertia = link%inertia*s**5
        link%center = link%center*s
      end associate
    end do
    do i = 1, size(machine%supports)
      machine%supports(i)%position = machine%supports(i)%position*s
      machine%supports(i)%stiffness = machine%supports(i)%stiffness*s
    end do
    machine%frame_mass = machine%frame_mass*s**3
    machine%frame_inertia = machine%frame_inertia*s**5
    machine%origin = machine%origin*s
    machine%foundation_damping = machine%foundation_damping*[s**2, s**2, s**4]
  end function scaled

  subroutine tolerances(cases)
    type(case_type), allocatable, intent(inout) :: cases(:)
    real(dp), parameter :: rpm(3) = [1.0_dp, 240.0_dp, 1300.0_dp]
    character(len=6), parameter :: names(3) = ['1     ', '240   ', '1300  ']
    integer :: i, decade

    do i = 1, size(rpm)
      do decade = -2, -14, -2
        call add(cases, 'tolerance', trim(names(i)) // ' rpm, tolerance ' // power(decade), khang_machine(rpm(i)), &
          & 10.0_dp**decade)
      end do
    end do
  end subroutine tolerances

  subroutine supports(cases)
    type(case_type), allocatable, intent(inout) :: cases(:)
    type(machine_data) :: machine
    integer :: i

    machine = khang_machine(240.0_dp)
    machine%supports(1)%stiffness = machine%supports(1)%stiffness*1.0e12_dp
    call add(cases, 'supports', 'first 1e12 times the others', machine)
    machine = khang_machine(240.0_dp)
    machine%supports(1)%stiffness = machine%supports(1)%stiffness*1.0e6_dp
    call add(cases, 'supports', 'first 1e6 times the others', machine)
    machine = khang_machine(240.0_dp)
    machine%supports(1)%stiffness = machine%supports(1)%stiffness*1.0e-12_dp
    call add(cases, 'supports', 'first 1e-12 of the others', machine)
    machine = khang_machine(240.0_dp)
    do i = 2, 4
      machine%supports(i)%stiffness = machine%supports(i)%stiffness*1.0e-12_dp
    end do
    call add(cases, 'supports', 'all but the first 1e-12 of it', machine)
    machine = khang_machine(240.0_dp)
    do i = 2, 4
      machine%supports(i)%stiffness = machine%supports(i)%stiffness*10.0_dp**(-4*(i - 1))
    end do
    call add(cases, 'supports', '1, 1e-4, 1e-8, 1e-12', machine)
    machine = khang_machine(240.0_dp)
    do i = 1, 4
      machine%supports(i)%stiffness(2) = machine%supports(i)%stiffness(2)*1.0e12_dp
    end do
    call add(cases, 'supports', 'upright 1e12 times along', machine)
    machine = khang_machine(240.0_dp)
    do i = 1, 4
      machine%supports(i)%stiffness(1) = machine%supports(i)%stiffness(1)*1.0e-12_dp
    end do
    call add(cases, 'supports', 'along 1e-12 of upright', machine)
  end subroutine supports

  pure function power(decade) result(word)
    integer, intent(in) :: decade
    character(len=:), allocatable :: word
    character(len=8) :: digits

    write (digits, '(i0)') decade
    word = '1e' // trim(digits)
  end function power

end module extreme_cases
