!> The exact equations of the frame for the oracle, body by body from d'Alembert's principle, with their derivatives, in extended
!> precision.
!>
!> u = xi + i eta, E = exp(i psi), p = psi'. A mass sits at z = u + E r(phi), r from F in the frame's axes; phi = Omega t - s psi,
!> s = 0 with a motor on the frame and 1 where the crank turns evenly in space; w = phi' = Omega - s p. Then, ' of r and theta by
!> phi,
!>
!>     dz = du + E e dpsi,      e = i r - s r'
!>     z'' = u'' + E (e psi'' + c),      c = -p^2 r + 2 i p w r' + w^2 r''
!>     d(psi + theta) = (1 - s theta') dpsi,      (psi + theta)'' = (1 - s theta') psi'' + w^2 theta''
!>
!>     sum [m Re(conj(dz) (z'' - g)) + J (psi + theta)'' d(psi + theta)] + dissipation and springs = 0.
!>
!> Every support is two springs with dampers along n: with epsilon(q), what it has become longer, its force is
!> (k epsilon + b epsilon' + G) grad epsilon, G the static force. epsilon is n . (u + (E - 1) p0), or n . conj(E) (u + (E - 1) p0)
!> along axes that turn with the frame. Weights and static forces cancel at rest with the mean moment; what is left of them is taken
!> as differences from there.
module oracle_frame
  use oracle_kinematics, only: prepare, trace
  use oracle_machine, only: dot, exact_machine, i, pi, solved, xp
  implicit none (type, external)
  private

  public :: accelerations, drive_torque, evaluate, ground_force, new_frame

  !> A spring with a damper and a static force along one axis.
  type :: spring_type
    complex(xp) :: axis = 0, place = 0
    real(xp) :: stiffness = 0, damping = 0, static = 0
    logical :: turns = .false.
  end type spring_type

  type, public :: frame_type
    type(exact_machine) :: machine
    !> Two for each support.
    type(spring_type), allocatable :: springs(:)
    integer, allocatable :: free(:)
    real(xp) :: speed = 0, period = 0, mass = 0
    !> 1 if the crank turns evenly in space, otherwise 0.
    real(xp) :: even = 0
    complex(xp) :: gravity = 0, mean_moment = 0
    !> The part of the load that acts while a vibration is sought on a path from rest.
    real(xp) :: part = 1
  end type frame_type

  !> The equations at one time, M q'' + f = 0, the derivatives of f with respect to q and q', and that of M with respect to psi.
  type, public :: equations_type
    real(xp) :: m(3, 3) = 0, f(3) = 0, by_place(3, 3) = 0, by_speed(3, 3) = 0, m_turned(3, 3) = 0
    !> Energy that the dampers take (W), and its derivatives with respect to q and q'.
    real(xp) :: power = 0, power_by_place(3) = 0, power_by_speed(3) = 0
  end type equations_type

contains

  subroutine new_frame(machine, frame)
    type(exact_machine), intent(in) :: machine
    type(frame_type), intent(out) :: frame
    real(xp) :: c(3, 3), sag(3), gradient(3)
    integer :: j, k

    frame%machine = machine
    call prepare(frame%machine)
    frame%free = pack([1, 2, 3], machine%free)
    frame%speed = machine%speed_rpm * pi / 30
    frame%period = machine%turns * 2 * pi / abs(frame%speed)
    frame%mass = machine%frame_mass + sum(real(machine%links%mass, xp))
    frame%even = merge(0, 1, machine%held_by == "motor")
    frame%gravity = cmplx(machine%gravity(1), machine%gravity(2), xp) &
      & + machine%acceleration * exp(i * machine%direction_deg * pi / 180)
    allocate(frame%springs(2 * size(machine%supports)))
    do j = 1, size(machine%supports)
      associate (support => machine%supports(j))
        do k = 1, 2
          frame%springs(2 * (j - 1) + k) = spring_type(i**(k - 1) * exp(i * support%angle_deg * pi / 180), &
            & cmplx(support%position(1), support%position(2), xp), real(support%stiffness(k), xp), &
            & real(support%damping(k), xp), 0.0_xp, support%turning)
        end do
      end associate
    end do
    if (.not. abs(frame%gravity) > 0) return
    frame%mean_moment = mean_moment_of(frame%machine)
    c = machine%foundation_stiffness
    do j = 1, size(frame%springs)
      gradient = gradient_at_rest(frame%springs(j))
      c = c + frame%springs(j)%stiffness * spread(gradient, 2, 3) * spread(gradient, 1, 3)
    end do
    sag = frame%mass * [real(frame%gravity), aimag(frame%gravity), 0.0_xp]
    sag(3) = aimag(conjg(frame%mean_moment) * frame%gravity)
    sag(frame%free) = solved(c(frame%free, frame%free), sag(frame%free))
    do k = 1, 3
      if (.not. machine%free(k)) sag(k) = 0
    end do
    do j = 1, size(frame%springs)
      frame%springs(j)%static = frame%springs(j)%stiffness * dot_product(gradient_at_rest(frame%springs(j)), sag)
    end do
  end subroutine new_frame

  pure function gradient_at_rest(spring) result(gradient)
    type(spring_type), intent(in) :: spring
    real(xp) :: gradient(3)

    gradient = [real(spring%axis), aimag(spring%axis), real(conjg(spring%axis) * i * spring%place)]
  end function gradient_at_rest

  !> sum of m r about F in the frame's axes, the mean over the period: by the trapezoidal rule, which converges as fast as Fourier
  !> series do.
  pure complex(xp) function mean_moment_of(machine) result(mean)
    type(exact_machine), intent(in) :: machine
    integer, parameter :: samples = 512
    complex(xp) :: center(0:3, size(machine%links))
    real(xp) :: spin(3, size(machine%links))
    integer :: k

    mean = 0
    do k = 1, samples
      call trace(machine, exp(2 * i * pi * k / samples), center, spin)
      mean = mean + sum(machine%links%mass * (center(0, :) + cmplx(machine%origin(1), machine%origin(2), xp))) / samples
    end do
  end function mean_moment_of

  !> The equations at the drive's angle `phi` with the frame at q with the velocity v, and the motor's torque if there is a
  !> flywheel. With `changes` the derivatives are computed too.
  pure subroutine evaluate(frame, phi, q, v, motor, changes, eq)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: phi, q(3), v(3), motor
    logical, intent(in) :: changes
    type(equations_type), intent(out) :: eq
    complex(xp), dimension(0:3, size(frame%machine%links)) :: r
    real(xp) :: spin(3, size(frame%machine%links))

    call trace(frame%machine, exp(i * (phi - frame%even * q(3)) / frame%machine%turns), r, spin)
    r(0, :) = r(0, :) + cmplx(frame%machine%origin(1), frame%machine%origin(2), xp)
    call add_bodies(frame, r, spin, q(3), v(3), changes, eq)
    call add_mounting(frame, q, v, changes, eq)
    eq%f(3) = eq%f(3) + motor
  end subroutine evaluate

  !> z'' - g of the links' centres of mass, along the frame's axes, and their angular accelerations (psi + theta)''.
  pure subroutine accelerations(frame, phi, q, v, a, linear, angular)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: phi, q(3), v(3), a(3)
    complex(xp), intent(out) :: linear(:)
    real(xp), intent(out) :: angular(:)
    complex(xp), dimension(0:3, size(linear)) :: r
    real(xp) :: spin(3, size(linear)), s, w

    s = frame%even
    w = frame%speed - s * v(3)
    call trace(frame%machine, exp(i * (phi - s * q(3)) / frame%machine%turns), r, spin)
    r(0, :) = r(0, :) + cmplx(frame%machine%origin(1), frame%machine%origin(2), xp)
    linear = exp(-i * q(3)) * (cmplx(a(1), a(2), xp) - frame%gravity) + (i * r(0, :) - s * r(1, :)) * a(3) &
      & - v(3)**2 * r(0, :) + 2 * i * v(3) * w * r(1, :) + w**2 * r(2, :)
    angular = (1 - s * spin(1, :)) * a(3) + w**2 * spin(2, :)
  end subroutine accelerations

  pure subroutine add_bodies(frame, r, spin, psi, p, changes, eq)
    type(frame_type), intent(in) :: frame
    complex(xp), intent(in) :: r(0:, :)
    real(xp), intent(in) :: spin(:, :), psi, p
    logical, intent(in) :: changes
    type(equations_type), intent(inout) :: eq
    complex(xp) :: turn, less_one, e, c, e_turned, c_turned, c_spun, moment, load, moment_turned, load_turned, load_spun
    complex(xp) :: whole
    real(xp) :: s, w, m, inertia, own, own_turned, couple, couple_turned, couple_spun, inertia_turned
    integer :: n

    less_one = turn_less_one(psi)
    turn = 1 + less_one
    s = frame%even
    w = frame%speed - s * p
    inertia = frame%machine%frame_inertia
    inertia_turned = 0
    moment = 0
    load = 0
    couple = 0
    moment_turned = 0
    load_turned = 0
    load_spun = 0
    couple_turned = 0
    couple_spun = 0
    do n = 1, size(frame%machine%links)
      m = frame%machine%links(n)%mass
      e = i * r(0, n) - s * r(1, n)
      c = -p**2 * r(0, n) + 2 * i * p * w * r(1, n) + w**2 * r(2, n)
      own = frame%machine%links(n)%inertia
      moment = moment + m * e
      load = load + m * c
      inertia = inertia + m * (real(e)**2 + aimag(e)**2) + own * (1 - s * spin(1, n))**2
      couple = couple + m * dot(e, c) + own * w**2 * spin(2, n) * (1 - s * spin(1, n))
      if (.not. changes) cycle
      e_turned = -s * (i * r(1, n) - s * r(2, n))
      c_turned = -s * (-p**2 * r(1, n) + 2 * i * p * w * r(2, n) + w**2 * r(3, n))
      c_spun = -2 * p * r(0, n) + 2 * i * (w - s * p) * r(1, n) - 2 * s * w * r(2, n)
      own_turned = s * spin(2, n)                       ! of 1 - s theta'
      moment_turned = moment_turned + m * e_turned
      load_turned = load_turned + m * c_turned
      load_spun = load_spun + m * c_spun
      inertia_turned = inertia_turned + 2 * m * dot(e, e_turned) + 2 * own * (1 - s * spin(1, n)) * own_turned
      couple_turned = couple_turned + m * (dot(e_turned, c) + dot(e, c_turned)) &
        & + own * w**2 * (-s * spin(3, n) * (1 - s * spin(1, n)) + spin(2, n) * own_turned)
      couple_spun = couple_spun + m * dot(e, c_spun) - 2 * s * own * w * spin(2, n) * (1 - s * spin(1, n))
    end do
    whole = turn * moment
    eq%m(1, 1) = frame%mass
    eq%m(2, 2) = frame%mass
    eq%m(3, 1:2) = [real(whole), aimag(whole)]
    eq%m(1:2, 3) = eq%m(3, 1:2)
    eq%m(3, 3) = inertia
    eq%f(1:2) = [real(turn * load), aimag(turn * load)]
    eq%f(3) = couple - dot(less_one * moment + (moment - i * frame%mean_moment), frame%gravity)
    if (frame%part < 1) call lessen(frame, r, spin, eq)
    if (.not. changes) return
    whole = turn * (i * moment + moment_turned)
    eq%m_turned(1:2, 3) = [real(whole), aimag(whole)]
    eq%m_turned(3, :) = [real(whole), aimag(whole), inertia_turned]
    load_turned = turn * (i * load + load_turned)
    eq%by_place(1:2, 3) = [real(load_turned), aimag(load_turned)]
    eq%by_place(3, 3) = couple_turned - dot(whole, frame%gravity)
    load_spun = turn * load_spun
    eq%by_speed(1:2, 3) = [real(load_spun), aimag(load_spun)]
    eq%by_speed(3, 3) = couple_spun
  end subroutine add_bodies

  !> Removes the part of the load at rest that does not act along a path. On a path the crank's angle depends on the frame's
  !> rotation, so that the path leads to the same equations. The derivatives remain those of the whole load, which suffices for
  !> a search.
  pure subroutine lessen(frame, r, spin, eq)
    type(frame_type), intent(in) :: frame
    complex(xp), intent(in) :: r(0:, :)
    real(xp), intent(in) :: spin(:, :)
    type(equations_type), intent(inout) :: eq
    complex(xp) :: load, moment
    real(xp) :: couple

    associate (m => frame%machine%links%mass, own => frame%machine%links%inertia, s => frame%even, w => frame%speed)
      load = sum(m * r(2, :)) * w**2
      moment = sum(m * (i * r(0, :) - s * r(1, :)))
      couple = w**2 * sum(m * dot(i * r(0, :) - s * r(1, :), r(2, :)) + own * spin(2, :) * (1 - s * spin(1, :))) &
        & - dot(moment - i * frame%mean_moment, frame%gravity)
      eq%f = eq%f - (1 - frame%part) * [real(load), aimag(load), couple]
    end associate
  end subroutine lessen

  pure subroutine add_mounting(frame, q, v, changes, eq)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: q(3), v(3)
    logical, intent(in) :: changes
    type(equations_type), intent(inout) :: eq
    real(xp) :: gradient(3), bend(3, 3), force, longer, rate, hv(3)
    complex(xp) :: less_one
    integer :: j, k

    less_one = turn_less_one(q(3))
    do j = 1, size(frame%springs)
      associate (spring => frame%springs(j))
        call elongate(spring, q, less_one, longer, gradient, bend)
        hv = bend(:, 3) * v(3)
        hv(3) = dot_product(bend(:, 3), v)
        rate = dot_product(gradient, v)
        force = spring%stiffness * longer + spring%damping * rate
        eq%f = eq%f + force * gradient + spring%static * change_of_gradient(spring, q, less_one)
        eq%power = eq%power + spring%damping * rate**2
        if (.not. changes) cycle
        force = force + spring%static
        do k = 1, 3
          eq%by_place(:, k) = eq%by_place(:, k) + gradient * (spring%stiffness * gradient(k) + spring%damping * hv(k)) &
            & + force * bend(:, k)
          eq%by_speed(:, k) = eq%by_speed(:, k) + spring%damping * gradient * gradient(k)
        end do
        eq%power_by_place = eq%power_by_place + 2 * spring%damping * rate * hv
        eq%power_by_speed = eq%power_by_speed + 2 * spring%damping * rate * gradient
      end associate
    end do
    associate (c => real(frame%machine%foundation_stiffness, xp), b => real(frame%machine%foundation_damping, xp))
      eq%f = eq%f + matmul(c, q) + b * v
      eq%power = eq%power + sum(b * v**2)
      if (.not. changes) return
      eq%by_place = eq%by_place + c
      do k = 1, 3
        eq%by_speed(k, k) = eq%by_speed(k, k) + b(k)
      end do
      eq%power_by_speed = eq%power_by_speed + 2 * b * v
    end associate
  end subroutine add_mounting

  !> E - 1, computed without cancellation.
  pure complex(xp) function turn_less_one(psi)
    real(xp), intent(in) :: psi

    turn_less_one = 2 * sin(psi / 2) * cmplx(-sin(psi / 2), cos(psi / 2), xp)
  end function turn_less_one

  !> Elongation of a spring with its first and second derivatives with respect to q; of the latter only those with psi are not
  !> zero. `less_one`: E - 1.
  pure subroutine elongate(spring, q, less_one, longer, gradient, bend)
    type(spring_type), intent(in) :: spring
    real(xp), intent(in) :: q(3)
    complex(xp), intent(in) :: less_one
    real(xp), intent(out) :: longer, gradient(3), bend(3, 3)
    complex(xp) :: axis, way

    bend = 0
    if (spring%turns) then
      axis = spring%axis + less_one * spring%axis     ! n . conj(E) d = (E n) . d
      way = cmplx(q(1), q(2), xp) - spring%place
      gradient = [real(axis), aimag(axis), dot(axis, -i * way)]
      bend(1:2, 3) = [-aimag(axis), real(axis)]
      bend(3, 1:2) = bend(1:2, 3)
      bend(3, 3) = -dot(axis, way)
    else
      axis = spring%axis
      way = spring%place + less_one * spring%place
      gradient = [real(axis), aimag(axis), dot(axis, i * way)]
      bend(3, 3) = -dot(axis, way)
    end if
    longer = dot(axis, cmplx(q(1), q(2), xp) + less_one * spring%place)
  end subroutine elongate

  !> The gradient minus that at rest, computed without cancellation.
  pure function change_of_gradient(spring, q, less_one) result(change)
    type(spring_type), intent(in) :: spring
    real(xp), intent(in) :: q(3)
    complex(xp), intent(in) :: less_one
    real(xp) :: change(3)
    complex(xp) :: axis

    if (spring%turns) then
      ! -i conj(E) (u - p0) less i p0: -i conj(E) u + i (conj(E) - 1) p0
      axis = less_one * spring%axis
      change = [real(axis), aimag(axis), &
        & dot(spring%axis + axis, -i * cmplx(q(1), q(2), xp)) + dot(spring%axis, i * conjg(less_one) * spring%place)]
    else
      change = [0.0_xp, 0.0_xp, dot(spring%axis, i * less_one * spring%place)]
    end if
  end function change_of_gradient

  !> The force that the motion makes a support exert on the ground, along axes in space, and its moment about F at rest.
  pure subroutine ground_force(frame, support, q, v, force, moment)
    type(frame_type), intent(in) :: frame
    integer, intent(in) :: support
    real(xp), intent(in) :: q(3), v(3)
    complex(xp), intent(out) :: force
    real(xp), intent(out) :: moment
    complex(xp) :: axis, arm, less_one
    real(xp) :: longer, gradient(3), bend(3, 3)
    integer :: k

    force = 0
    less_one = turn_less_one(q(3))
    do k = 2 * support - 1, 2 * support
      associate (spring => frame%springs(k))
        call elongate(spring, q, less_one, longer, gradient, bend)
        axis = cmplx(gradient(1), gradient(2), xp)     ! n, or E n
        force = force + axis * (spring%stiffness * longer + spring%damping * dot_product(gradient, v))
        if (spring%turns) force = force + less_one * spring%axis * spring%static
        ! The present position of the head, or the position at rest along whose line the force acts.
        arm = spring%place
        if (.not. spring%turns) arm = arm + cmplx(q(1), q(2), xp) + less_one * spring%place
      end associate
    end do
    moment = aimag(conjg(arm) * force)
  end subroutine ground_force

  !> Torque on the drive's shaft (N m), counter-clockwise positive: the virtual work where the drive's angle alone changes.
  pure real(xp) function drive_torque(frame, phi, q, v, a) result(torque)
    type(frame_type), intent(in) :: frame
    real(xp), intent(in) :: phi, q(3), v(3), a(3)
    complex(xp), dimension(0:3, size(frame%machine%links)) :: r
    real(xp) :: spin(3, size(frame%machine%links)), w
    complex(xp) :: acceleration
    integer :: n

    call trace(frame%machine, exp(i * (phi - frame%even * q(3)) / frame%machine%turns), r, spin)
    r(0, :) = r(0, :) + cmplx(frame%machine%origin(1), frame%machine%origin(2), xp)
    w = frame%speed - frame%even * v(3)
    torque = 0
    do n = 1, size(frame%machine%links)
      associate (link => frame%machine%links(n))
        acceleration = exp(-i * q(3)) * (cmplx(a(1), a(2), xp) - frame%gravity) + a(3) * (i * r(0, n) - frame%even * r(1, n)) &
          & - v(3)**2 * r(0, n) + 2 * i * v(3) * w * r(1, n) + w**2 * r(2, n)
        torque = torque + link%mass * dot(r(1, n), acceleration) &
          & + link%inertia * spin(1, n) * (a(3) * (1 - frame%even * spin(1, n)) + w**2 * spin(2, n))
      end associate
    end do
  end function drive_torque

end module oracle_frame
