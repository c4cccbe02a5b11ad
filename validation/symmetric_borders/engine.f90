!> Random two-cylinder engines with a symmetry on two mounts: their input for the library, and their exact planar equations, which
!> share nothing with it.
!>
!> z = u + R(psi) p is the place of a link whose centre of mass p moves in the frame by phi = Omega t. With S the turn by 90 degrees
!>
!>     z'' = u'' + R [psi'' S p - psi'^2 p + 2 psi' Omega S dp/dphi + Omega^2 d2p/dphi2],
!>
!> and d'Alembert's principle with dz = du + R S p dpsi needs the sums over the links that `sums_at` gives.
module symmetric_engine
  use gestell_base_kinds, only: dp, pi
  use reference_random, only: random_type
  implicit none (type, external)
  private

  public :: new_engine, input_of

  character(len=*), parameter, public :: kinds(4) = [character(len=20) :: "inline, 180 degrees", "boxer, 180 degrees", &
    & "opposed, one pin", "inline with offset"]
  !> Of `sums_at`: sum m p, m dp, m d2p (two each), m p.p + J, m p.dp, m Sp.d2p, J d2theta.
  integer, parameter, public :: sums = 10

  type, public :: engine_type
    integer :: kind = 1
    real(dp) :: radius = 0, rod = 0, offset = 0
    !> Crank, a rod, a piston; the part of a rod at which its centre is, and the inertias.
    real(dp) :: masses(3) = 0, inertias(3) = 0, center = 0
    real(dp) :: frame_mass = 0, frame_inertia = 0, origin(2) = 0
    !> Shape (2, mounts).
    real(dp) :: position(2, 2) = 0, stiffness(2, 2) = 0, damping(2, 2) = 0
  contains
    procedure :: sums_at
    procedure :: accelerations
  end type engine_type

contains

  subroutine new_engine(number, engine)
    integer, intent(in) :: number
    type(engine_type), intent(out) :: engine
    integer, parameter :: sequence = 47
    type(random_type) :: random
    integer :: k

    call random%start(number, sequence)
    engine%kind = 1 + modulo(number - 1, size(kinds))
    engine%radius = random%between(0.03_dp, 0.07_dp)
    engine%rod = engine%radius * random%between(2.4_dp, 4.0_dp)
    if (engine%kind == 4) engine%offset = random%between(0.005_dp, 0.02_dp)
    engine%masses = [random%between(1.0_dp, 4.0_dp), random%between(0.3_dp, 0.8_dp), random%between(0.5_dp, 1.8_dp)]
    engine%inertias = [random%between(0.002_dp, 0.008_dp), random%between(0.001_dp, 0.003_dp), random%between(0.0005_dp, 0.001_dp)]
    engine%center = random%between(0.25_dp, 0.45_dp)
    engine%frame_mass = random%between(15.0_dp, 30.0_dp)
    engine%frame_inertia = random%between(0.4_dp, 1.0_dp)
    engine%origin = [random%between(-0.06_dp, 0.06_dp), random%between(0.0_dp, 0.12_dp)]
    do k = 1, 2
      engine%position(:, k) = [(2 * k - 3) * random%between(0.15_dp, 0.3_dp), -random%between(0.15_dp, 0.3_dp)]
      engine%stiffness(:, k) = 1.0e4_dp * [random%between(2.0_dp, 6.0_dp), random%between(5.0_dp, 12.0_dp)]
      engine%damping(:, k) = [random%between(0.5_dp, 3.0_dp), random%between(1.0_dp, 6.0_dp)]
    end do
  end subroutine new_engine

  !> The input of the engine over a range of speeds (1/min).
  function input_of(engine, range) result(text)
    type(engine_type), intent(in) :: engine
    real(dp), intent(in) :: range(2)
    character(len=:), allocatable :: text
    character(len=8) :: pin
    character :: name
    integer :: k

    text = "&case tasks='boundary' /" // new_line(text) // "&model frame='exact' /" // new_line(text)
    call add("&drive speed_rpm=", [sum(range) / 2])
    call add("&joint name='O', type='ground', position=", [0.0_dp, 0.0_dp])
    call add("&joint name='A1', type='crank', pivot='O', radius=", [engine%radius])
    call add("&joint name='A2', type='rigid', ends='O','A1', offset=", [-engine%radius, 0.0_dp])
    do k = 1, 2
      name = achar(iachar("0") + k)
      pin = "A" // achar(iachar("0") + pin_of(engine, k))
      call add("&joint name='B" // name // "', type='RRP', ends='" // trim(pin) // "', branch=1, lengths=", [engine%rod], "")
      call add(", guide_point=", [engine%offset, 0.0_dp], "")
      call add(", guide_angle=", [guide_of(engine, k)])
      call add("&link name='rod " // name // "', from='" // trim(pin) // "', to='B" // name // "', mass=", engine%masses(2:2), "")
      call add(", inertia=", engine%inertias(2:2), "")
      call add(", center=", [engine%center * engine%rod, 0.0_dp])
      call add("&link name='piston " // name // "', from='B" // name // "', mass=", engine%masses(3:3), "")
      call add(", inertia=", engine%inertias(3:3))
      call add("&support position=", engine%position(:, k), "")
      call add(", stiffness=", engine%stiffness(:, k), "")
      call add(", damping=", engine%damping(:, k))
    end do
    call add("&link name='crank', from='O', to='A1', mass=", engine%masses(1:1), "")
    call add(", inertia=", engine%inertias(1:1))
    call add("&frame mass=", [engine%frame_mass], "")
    call add(", inertia=", [engine%frame_inertia], "")
    call add(", origin=", engine%origin)
    call add("&sweep parameter='drive.speed_rpm', from=", range(1:1), "")
    call add(", to=", range(2:2), ", count=20 /" // new_line(text))

  contains

    subroutine add(words, values, last)
      character(len=*), intent(in) :: words
      real(dp), intent(in) :: values(:)
      character(len=*), intent(in), optional :: last
      character(len=32) :: number
      integer :: i

      text = text // words
      do i = 1, size(values)
        write (number, "(es25.17)") values(i)
        text = text // trim(adjustl(number))
        if (i < size(values)) text = text // ","
      end do
      if (present(last)) text = text // last
      if (.not. present(last)) text = text // " /" // new_line(text)
    end subroutine add

  end function input_of

  !> Which pin a cylinder's rod is on.
  pure integer function pin_of(engine, cylinder) result(pin)
    type(engine_type), intent(in) :: engine
    integer, intent(in) :: cylinder

    pin = cylinder
    if (engine%kind == 3) pin = 1
  end function pin_of

  !> Direction of a cylinder (deg).
  pure real(dp) function guide_of(engine, cylinder) result(angle)
    type(engine_type), intent(in) :: engine
    integer, intent(in) :: cylinder

    angle = 90
    if (engine%kind == 2 .or. engine%kind == 3) angle = merge(0, 180, cylinder == 1)
  end function guide_of

  !> The sums over the links at a crank angle.
  pure function sums_at(self, phi) result(s)
    class(engine_type), intent(in) :: self
    real(dp), intent(in) :: phi
    real(dp) :: s(sums)
    real(dp), dimension(2, 0:2) :: a, b, rod
    real(dp) :: g(2), n(2), c(0:2), e(0:2), w(0:2), beta, angle
    integer :: k

    s = 0
    call add(self%masses(1), self%inertias(1), reshape([0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp], [2, 3]), 0.0_dp)
    do k = 1, 2
      angle = phi + merge(pi, 0.0_dp, pin_of(self, k) == 2)
      a(:, 0) = self%radius * [cos(angle), sin(angle)]
      a(:, 1) = self%radius * [-sin(angle), cos(angle)]
      a(:, 2) = -a(:, 0)
      beta = guide_of(self, k) * pi / 180
      g = [cos(beta), sin(beta)]
      n = [-g(2), g(1)]
      ! Along the guide and across it, from its point.
      c = matmul(g, a) - [dot_product(g, [self%offset, 0.0_dp]), 0.0_dp, 0.0_dp]
      e = matmul(n, a) - [dot_product(n, [self%offset, 0.0_dp]), 0.0_dp, 0.0_dp]
      w(0) = sqrt(self%rod**2 - e(0)**2)
      w(1) = -e(0) * e(1) / w(0)
      w(2) = -(e(1)**2 + e(0) * e(2) + w(1)**2) / w(0)
      b = spread(g, 2, 3) * spread(c + w, 1, 2)
      b(:, 0) = b(:, 0) + [self%offset, 0.0_dp]
      rod = b - a
      call add(self%masses(2), self%inertias(2), a + self%center * rod, cross(rod(:, 0), rod(:, 2)) / self%rod**2)
      call add(self%masses(3), self%inertias(3), b, 0.0_dp)
    end do

  contains

    !> Adds a link whose centre is at p from O, with derivatives, and whose angle has this second derivative.
    pure subroutine add(mass, inertia, from_o, turn)
      real(dp), intent(in) :: mass, inertia, from_o(2, 0:2), turn
      real(dp) :: p(2, 0:2)

      p = from_o
      p(:, 0) = p(:, 0) + self%origin
      s(:6) = s(:6) + mass * reshape(p, [6])
      s(7) = s(7) + mass * sum(p(:, 0)**2) + inertia
      s(8) = s(8) + mass * dot_product(p(:, 0), p(:, 1))
      s(9) = s(9) + mass * cross(p(:, 0), p(:, 2))
      s(10) = s(10) + inertia * turn
    end subroutine add

  end function sums_at

  pure real(dp) function cross(a, b)
    real(dp), intent(in) :: a(2), b(2)

    cross = a(1) * b(2) - a(2) * b(1)
  end function cross

  !> (xi'', eta'', psi'') at x = (xi, eta, psi, and their derivatives), with the sums at the crank's angle and its speed (rad/s).
  pure function accelerations(self, s, speed, x) result(y)
    class(engine_type), intent(in) :: self
    real(dp), intent(in) :: s(:), speed, x(:)
    real(dp) :: y(3), r(2, 2), force(2), moment, lever(2), arm(2), pull(2), inner(2), total, m(2), i0
    integer :: k

    r = reshape([cos(x(3)), sin(x(3)), -sin(x(3)), cos(x(3))], [2, 2])
    force = 0
    moment = 0
    do k = 1, 2
      lever = matmul(r, self%position(:, k))
      arm = [-lever(2), lever(1)]
      pull = -self%stiffness(:, k) * (x(:2) + lever - self%position(:, k)) - self%damping(:, k) * (x(4:5) + x(6) * arm)
      force = force + pull
      moment = moment + dot_product(pull, arm)
    end do
    inner = -x(6)**2 * s(1:2) + 2 * x(6) * speed * [-s(4), s(3)] + speed**2 * s(5:6)
    force = force - matmul(r, inner)
    moment = moment - 2 * x(6) * speed * s(8) - speed**2 * (s(9) + s(10))
    total = self%frame_mass + self%masses(1) + 2 * sum(self%masses(2:))
    m = matmul(r, [-s(2), s(1)])
    i0 = self%frame_inertia + s(7)
    y(3) = (moment - dot_product(m, force) / total) / (i0 - dot_product(m, m) / total)
    y(:2) = (force - m * y(3)) / total
  end function accelerations

end module symmetric_engine
