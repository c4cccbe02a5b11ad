!> The elastically mounted frame of a mechanism as a periodic system M q'' + B q' + C q = h with q = (xi, eta, psi), linearised
!> about rest: (8) to (12) of doc/theory.md. A frame in space has six degrees of freedom instead of three.
module gestell_model_frame
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp, pi
  use gestell_model_mechanism_held, only: check_held, part_of_turn, tabulate_effective
  use gestell_model_frame_data, only: check_frame_data, check_free, check_turning
  use gestell_model_frame_equations, only: add_loads, add_weights, all_connected, cancellation, mass_matrix, set_load, set_matrices
  use gestell_model_mechanism, only: mechanism_type, table_columns
  use gestell_model_mechanism_loads, only: mean_load_torque
  use gestell_model_mechanism_mean_moment, only: average_masses
  use gestell_model_mounting, only: is_rotation, load_matrix, load_rounding, support_type
  use gestell_model_mounting_mounted, only: mounted_system
  use gestell_model_mounting_weights, only: new_weights
  use gestell_model_mechanism_tabulated, only: new_tabulated, tabulated_type
  use gestell_model_space, only: space_type
  use gestell_system_averaged, only: average, averaged_system, term_size
  use gestell_system_natural_frequencies, only: solve_natural_frequencies
  use gestell_system_second_order, only: check_second_order, is_gyroscopic
  implicit none (type, external)
  private

  public :: connections, new_frame, add_gravity

  !> Names of the frame's degrees of freedom, in the order of the matrices: displacements of its centre of mass F, and rotations. A
  !> frame in the plane has the first three, a frame in space all six.
  character(len=7), parameter, public :: dof_names(6) = [character(len=7) :: "xi", "eta", "psi", "zeta", "rot_xi", "rot_eta"]

  !> The frame as a periodic system. Its states are (q, q') in m, rad, m/s, rad/s. At time 0 (s) the crank angle is 0.
  type, extends(mounted_system), public :: frame_type
    !> `inertia`: moment of inertia J_F of the frame about its centre of mass F (kg m^2). `origin`: origin O = (xi_0, eta_0) of
    !> the mechanism relative to F, in the frame's axes (m).
    real(dp) :: inertia = 0, origin(2) = 0
    !> What keeps the crank speed constant: "motor", "outside" or "flywheel" (gestell_model_mechanism_held).
    character(len=8) :: held_by = "motor"
    !> Moment of inertia of the flywheel in addition to that of the links (kg m^2); 0 if unknown.
    real(dp) :: flywheel_inertia = 0
    !> Mean torque of the motor (N m) if the motor stands on the frame and drives a flywheel; in all other cases 0. In the equations
    !> linearised about rest it is 0 unless loads act.
    real(dp) :: motor_torque = 0
    class(mechanism_type), allocatable :: mechanism
    !> The mechanisms of a frame in space, which replace `mechanism` and `origin`. Not allocated for a frame in the plane. See
    !> gestell_model_frame_in_space.
    type(space_type), allocatable :: space
    !> Axes of the first drive shaft as columns: the crank turns about the third axis, from the first towards the second.
    real(dp) :: shaft_axes(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
    !> Largest distance of a mechanism's origin from F (m).
    real(dp) :: mechanism_distance = 0
    !> True if the equations are linearised about rest, false if they are linearised about a motion.
    logical :: about_rest = .true.
  contains
    procedure :: matrices, load, sample_second_order, sample_at_rest, crank_angles, uniform_in_space, loads_act, remember
    procedure :: weigh => add_gravity
    procedure :: coupled, check, averaged, mean_matrices, natural_frequencies, conserves, ground_forces, dofs
    procedure :: run_at, drive_speed, drive_rpm, degrees_per_period
    procedure :: rotations, potential, dissipation, moments_of_inertia, drive_lags
  end type frame_type

contains

  !> Creates a frame on its mounting. The frame gets its own copy of the mechanism, whose motion is checked over the whole period.
  !> With `gravity` all masses have weight, and q = 0 is the rest position of the machine under its own weight. Fails if a number is
  !> not finite or out of range, if the mechanism cannot turn, or if `add_gravity` or `check_held` fails.
  subroutine new_frame(frame, mechanism, mass, inertia, origin, stiffness, damping, speed, error, free, supports, gravity, held_by)
    type(frame_type), intent(out) :: frame
    class(mechanism_type), intent(in) :: mechanism
    !> `mass` (kg), `inertia` (kg m^2): mass and moment of inertia of the frame without links. `origin`: origin of the mechanism's
    !> axes relative to the frame's centre of mass (m). `stiffness` (N/m, N, N m), `damping` (N s/m, N s, N m s): matrices of the
    !> foundation, or of the whole mounting if there are no `supports`. `speed`: crank speed (rad/s); negative means clockwise
    real(dp), intent(in) :: mass, inertia, origin(2), stiffness(3, 3), damping(3, 3), speed
    type(error_type), allocatable, intent(out) :: error
    !> Indices of the free degrees of freedom: 1 xi, 2 eta, 3 psi. By default all three are free
    integer, intent(in), optional :: free(:)
    !> Supports whose stiffness and damping are added to those of the foundation
    type(support_type), intent(in), optional :: supports(:)
    !> Acceleration of gravity along xi and eta (m/s^2); without this argument, gravity is ignored
    real(dp), intent(in), optional :: gravity(2)
    !> What keeps the speed constant: "motor" (the default), "outside" or "flywheel"
    character(len=*), intent(in), optional :: held_by
    !> Assumed number of rounding errors in each term of the load. They arise in the accelerations of the joints and in the crank
    !> angle of up to 2 pi.
    real(dp), parameter :: share = 12

    if (present(supports)) then
      call frame%put_on(supports, stiffness, damping)
      frame%supports%position(3) = 0
    else
      call frame%put_on([support_type ::], stiffness, damping)
    end if
    call check_frame_data(mass, inertia, origin, frame%stiffness, frame%damping, speed, error)
    if (allocated(error)) return
    allocate(frame%mechanism, source=mechanism)
    call frame%mechanism%prepare(error)
    if (.not. allocated(error)) call frame%mechanism%check(error)
    if (.not. allocated(error)) call check_turning(frame%mechanism, error)
    if (allocated(error)) return
    frame%mass = mass
    frame%inertia = inertia
    frame%origin = origin
    frame%mechanism_distance = norm2(origin)
    frame%free = [1, 2, 3]
    if (present(free)) frame%free = free
    call check_free(frame%free, 3, error)
    if (allocated(error)) return
    frame%states = 2 * size(frame%free)
    call frame%run_at(speed)
    if (present(held_by)) then
      call check_held(held_by, frame%mechanism, error)
      if (allocated(error)) return
      frame%held_by = held_by
    end if
    ! Near a dead point, lengths lose twice as many digits as the angle scale, which is about the sine of the transmission angle
    ! there.
    frame%rounding = epsilon(1.0_dp) / frame%mechanism%angle_scale**2
    frame%load_rounding = min(1.0_dp, share * frame%rounding * cancellation(frame%mechanism, frame%free, origin, mass, inertia, &
      & frame%uniform_in_space(), speed))
    frame%least_steps = max(8, ceiling(2 * pi / frame%mechanism%angle_scale))
    if (frame%loads_act()) frame%least_steps = max(frame%least_steps, ceiling(2 * pi * frame%mechanism%load_order))
    if (frame%loads_act() .and. frame%held_by == "flywheel") frame%motor_torque = -mean_load_torque(frame%mechanism, origin) &
      & / frame%mechanism%turns
    if (present(gravity)) call frame%weigh([gravity, 0.0_dp], error)
  end subroutine new_frame

  !> Sets the crank speed (rad/s). An integration step ends wherever the mechanism's motion is not smooth.
  pure subroutine run_at(self, speed)
    class(frame_type), intent(inout) :: self
    real(dp), intent(in) :: speed

    self%speed = speed
    self%period = 2 * pi / abs(speed)
    if (.not. allocated(self%mechanism%kinks)) return
    self%breaks = self%mechanism%kinks / abs(speed)
    if (speed < 0) self%breaks = (2 * pi - self%mechanism%kinks(size(self%breaks):1:-1)) / abs(speed)
  end subroutine run_at

  !> Gives weight to all masses of a frame and sets the static forces of its supports, which carry the weight. Fails if no spring
  !> carries the weight along some free degree of freedom, or if the weight overflows.
  subroutine add_gravity(frame, gravity, error)
    class(frame_type), intent(inout) :: frame
    !> Acceleration of gravity along xi, eta, zeta (m/s^2); the component along zeta is 0 for a frame in the plane
    real(dp), intent(in) :: gravity(3)
    type(error_type), allocatable, intent(out) :: error
    complex(dp) :: unbalance
    real(dp) :: mean(3), mass, maximum

    if (allocated(frame%space)) then
      call frame%space%average(mean, mass, maximum)
    else
      call average_masses(frame%mechanism, unbalance, maximum)
      mass = frame%mechanism%mass
      mean = [mass * frame%origin + [real(unbalance), aimag(unbalance)], 0.0_dp]
      maximum = mass * norm2(frame%origin) + maximum
    end if
    call new_weights(frame%weights, gravity, frame%mass + mass, mean, maximum, frame%stiffness, frame%supports, frame%free, error)
  end subroutine add_gravity

  !> Checks that the frame is a valid second-order system. Fails if `new_frame` has not created it, or if its period does not match
  !> its speed.
  subroutine check(self, error)
    class(frame_type), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error
    real(dp), parameter :: rounding = 1.0e-9_dp

    if (.not. (allocated(self%mechanism) .and. allocated(self%free) .and. allocated(self%supports))) then
      call fatal_error(error, "the frame must be created with new_frame", invalid_input)
      return
    end if
    call check_second_order(self, error)
    if (allocated(error)) return
    if (self%states /= 2 * size(self%free)) then
      call fatal_error(error, "the frame must have two states for each free degree of freedom", invalid_input)
    else if (.not. abs(abs(self%speed) * self%period / (2 * pi) - 1) <= rounding) then
      call fatal_error(error, "the frame's period must be 2 pi / |speed|", invalid_input)
    end if
  end subroutine check

  !> Computes the matrices M, B and C of the free degrees of freedom at the time `t` (s).
  subroutine matrices(self, t, m, b, c)
    class(frame_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    real(dp) :: all(1, size(self%free), size(self%free), 3)

    call self%sample_second_order([t / self%period], all(:, :, :, 1), all(:, :, :, 2), all(:, :, :, 3))
    m = all(1, :, :, 1)
    b = all(1, :, :, 2)
    c = all(1, :, :, 3)
  end subroutine matrices

  !> Computes the load h of the free degrees of freedom at the time `t` (s).
  subroutine load(self, t, h)
    class(frame_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)
    real(dp) :: m(1, size(h), size(h)), b(1, size(h), size(h)), c(1, size(h), size(h)), all(1, size(h))

    call self%sample_second_order([t / self%period], m, b, c, all)
    h = all(1, :)
  end subroutine load

  !> Computes M, B, C (shape (phases, n, n)) and h (shape (phases, n)) of the n free degrees of freedom at phases of the period.
  subroutine sample_second_order(self, phases, m, b, c, h)
    class(frame_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)

    call self%sample_at_rest(self%crank_angles(phases), self%free, m, b, c, h)
  end subroutine sample_second_order

  !> Computes the matrices M, B, C and the load h, linearised about rest, at crank angles (rad), for the degrees of freedom
  !> `free`. For a frame in the plane they are (9) to (12), with the effective mass functions (gestell_model_mechanism_held).
  subroutine sample_at_rest(self, angles, free, m, b, c, h)
    class(frame_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    integer, intent(in) :: free(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    real(dp) :: effective(size(angles), table_columns), load(size(angles), 3), slope(size(angles)), part
    integer :: psi

    if (allocated(self%space)) then
      call self%space%sample_at_rest(self, angles, free, m, b, c, h)
      return
    end if
    call tabulate_effective(self%mechanism, self%origin, self%uniform_in_space(), angles, effective, load, slope)
    call set_matrices(free, mass_matrix(self%mass, self%inertia, self%origin, self%mechanism), &
      & self%damping, self%rest_stiffness(), self%speed, self%origin, effective, m, b, c)
    psi = findloc(free, 3, dim=1)
    if (self%uniform_in_space() .and. psi > 0) c(:, psi, psi) = c(:, psi, psi) - self%speed**2 * slope
    if (present(h)) call set_load(free, self%speed, self%origin, load, h)
    part = part_of_turn(self%mechanism, self%uniform_in_space())
    if (self%loads_act()) call add_loads(self%mechanism, self%origin, self%motor_torque, part, angles, free, c, h)
    if (self%weights%act .and. psi > 0) call add_weights(self%weights, self%mechanism%mass * self%origin, part, effective, psi, c, &
      & h)
  end subroutine sample_at_rest

  !> True if loads (forces and moments between links, frame and ground) move the frame. If a motor on the frame holds the speed,
  !> loads between links and frame only change the driving torque.
  pure logical function loads_act(self)
    class(frame_type), intent(in) :: self

    loads_act = self%mechanism%load_order >= 0 .and. (self%uniform_in_space() .or. self%mechanism%has_ground_loads)
  end function loads_act

  !> True if the crank turns uniformly relative to the ground, false if it turns uniformly relative to the frame.
  pure logical function uniform_in_space(self)
    class(frame_type), intent(in) :: self

    uniform_in_space = self%held_by /= "motor"
  end function uniform_in_space

  !> Crank angles (rad) at phases of the period.
  pure function crank_angles(self, phases) result(angles)
    class(frame_type), intent(in) :: self
    real(dp), intent(in) :: phases(:)
    real(dp) :: angles(size(phases))

    angles = sign(2 * pi, self%speed) * phases
  end function crank_angles

  !> True if the drive lags by an angle that depends on the whole motion of the frame (gestell_model_space_drive).
  pure logical function drive_lags(self)
    class(frame_type), intent(in) :: self

    drive_lags = allocated(self%space) .and. self%held_by == "flywheel"
  end function drive_lags

  !> Moment of inertia of the frame about F; in space the moments of inertia about xi, eta and zeta (kg m^2).
  pure function moments_of_inertia(self) result(moments)
    class(frame_type), intent(in) :: self
    real(dp), allocatable :: moments(:)
    integer :: i

    moments = [self%inertia]
    if (allocated(self%space)) moments = [(self%space%inertia(i, i), i = 1, 3)]
  end function moments_of_inertia

  !> Tabulates the mass functions of the mechanism at `phases`. Later evaluations at exactly these phases use the table. Before
  !> these evaluations the magnitude of the speed, masses, stiffness and damping may change, but not the sign of the speed.
  subroutine remember(self, phases, drive)
    class(frame_type), intent(inout) :: self
    real(dp), intent(in) :: phases(:)
    !> True if the functions of the drive are tabulated, too. By default they are if the equations of motion contain them
    logical, intent(in), optional :: drive
    type(tabulated_type) :: tabulated
    class(mechanism_type), allocatable :: plain
    logical :: with_drive

    with_drive = self%uniform_in_space()
    if (present(drive)) with_drive = drive
    if (allocated(self%space)) then
      call self%space%remember(self%crank_angles(phases))
      return
    end if
    if (.not. allocated(self%mechanism)) return
    select type (mechanism => self%mechanism)
    type is (tabulated_type)
      call mechanism%remember(self%crank_angles(phases), with_drive)
    class default
      call new_tabulated(tabulated, mechanism)
      call tabulated%remember(self%crank_angles(phases), with_drive)
      allocate(plain, source=tabulated)
    end select
    if (allocated(plain)) call move_alloc(plain, self%mechanism)
  end subroutine remember

  !> True for each pair of free degrees of freedom that the equations linearised about rest couple, shape (n, n).
  function coupled(self)
    class(frame_type), intent(in) :: self
    logical, allocatable :: coupled(:, :)

    coupled = connections(self, 0.0_dp)
  end function coupled

  !> True for each pair of free degrees of freedom that one of the matrices M, B, C couples at one of many equidistant phases,
  !> shape (n, n). The search stops as soon as all degrees of freedom are connected.
  function connections(frame, shift) result(coupled)
    class(frame_type), intent(in) :: frame
    !> Shift of the phases as a fraction of their spacing, 0 to 1
    real(dp), intent(in) :: shift
    logical, allocatable :: coupled(:, :)
    real(dp), dimension(4, size(frame%free), size(frame%free)) :: m, b, c
    integer :: first, k

    allocate(coupled(size(frame%free), size(frame%free)), source=.false.)
    do first = 0, 4 * frame%least_steps - 1, size(m, 1)
      call frame%sample_second_order([((first + k + shift) / (4 * frame%least_steps), k = 0, size(m, 1) - 1)], m, b, c)
      coupled = coupled .or. any(abs(m) > 0 .or. abs(b) > 0 .or. abs(c) > 0, dim=1)
      coupled = coupled .or. transpose(coupled)
      if (all_connected(coupled)) exit
    end do
  end function connections

  !> Computes the model with the matrices M, B and C averaged over the period, and bounds on its rounding errors. The periodic
  !> parts of B and C in (10) and (11) are derivatives with respect to the crank angle, so their means are zero. The mean of the
  !> periodic part of the moment of the weights is zero as well. Hence the mean of B is the damping of the mounting. The mean of C
  !> is the stiffness of the mounting, plus the contribution of the weights when the frame is at rest. Loads against the ground have
  !> a mean stiffness too.
  subroutine averaged(self, model)
    class(frame_type), intent(in) :: self
    type(averaged_system), intent(out) :: model
    real(dp), parameter :: rounding = 4 * epsilon(1.0_dp)
    real(dp) :: moved(3, 3)

    call average(self, model)
    if (allocated(self%space) .or. self%mechanism%has_ground_loads) return
    moved = -reshape([self%mass, 0.0_dp, 0.0_dp, 0.0_dp, self%mass, 0.0_dp, 0.0_dp, 0.0_dp, self%inertia], [3, 3])
    moved(self%free, self%free) = moved(self%free, self%free) + model%m
    moved = term_size(moved)
    model%m_error = model%m_error + rounding * moved(self%free, self%free)
    model%b = self%damping(self%free, self%free)
    model%b_error = rounding * term_size(model%b)
    moved = self%rest_stiffness()
    model%c = moved(self%free, self%free)
    moved = rounding * term_size(self%stiffness) + load_rounding(self%supports, 3)
    moved(3, 3) = moved(3, 3) + self%weights%rounding
    model%c_error = moved(self%free, self%free)
  end subroutine averaged

  !> Computes means over the period for the degrees of freedom `free` of the frame linearised about rest: `m` of the mass matrix,
  !> `c` of the stiffness matrix, and `g` of the gyroscopic part of the damping matrix (0 in the plane).
  subroutine mean_matrices(self, free, m, g, c)
    class(frame_type), intent(in) :: self
    !> Indices of the degrees of freedom for which the means are computed; they may be free or locked
    integer, intent(in) :: free(:)
    real(dp), allocatable, intent(out) :: m(:, :), g(:, :), c(:, :)
    real(dp), allocatable, dimension(:, :, :) :: all_m, all_b, all_c
    integer :: angles, k

    angles = 4 * self%least_steps
    allocate(all_m(angles, size(free), size(free)), all_b(angles, size(free), size(free)), all_c(angles, size(free), size(free)))
    call self%sample_at_rest([(2 * pi * k / angles, k = 1, angles)], free, all_m, all_b, all_c)
    m = sum(all_m, dim=1) / angles
    c = self%rest_stiffness()
    c = c(free, free)
    if (self%mechanism%has_ground_loads) c = sum(all_c, dim=1) / angles
    g = 0 * m
    if (.not. allocated(self%space)) return
    all_b = all_b - spread(self%damping(free, free), 1, angles)
    g = sum(all_b, dim=1) / angles
    g = (g - transpose(g)) / 2
    where (abs(g) <= 64 * epsilon(1.0_dp) * maxval(abs(all_b), dim=1)) g = 0
  end subroutine mean_matrices

  !> Computes the natural angular frequencies (rad/s) of the undamped frame, linearised about rest, from the mean matrices. Fails if
  !> `check` or `solve_natural_frequencies` fails.
  subroutine natural_frequencies(self, frequencies, error)
    class(frame_type), intent(in) :: self
    real(dp), allocatable, intent(out) :: frequencies(:)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable, dimension(:, :) :: m, g, c

    call self%check(error)
    if (allocated(error)) return
    call self%mean_matrices(self%free, m, g, c)
    call solve_natural_frequencies(m, g, (c + transpose(c)) / 2, frequencies, error)
  end subroutine natural_frequencies

  !> Number of degrees of freedom, whether free or locked: three for a frame in the plane, six for a frame in space.
  pure integer function dofs(self)
    class(frame_type), intent(in) :: self

    dofs = merge(6, 3, allocated(self%space))
  end function dofs

  !> True if the equations of the degrees of freedom free(chosen) derive from a Lagrangian. This requires zero damping and a
  !> symmetric stiffness matrix. For a frame in space the crank must also turn uniformly relative to the frame. The equations in
  !> space linearised about rest with two or more rotations neglect terms that only a balanced rotor does not have.
  logical function conserves(self, chosen)
    class(frame_type), intent(in) :: self
    integer, intent(in) :: chosen(:)
    integer :: i

    associate (free => self%free(chosen), c => self%stiffness(self%free(chosen), self%free(chosen)))
      conserves = .not. (any(abs(self%damping(free, free)) > 0) .or. any(abs(c - transpose(c)) > 0))
      ! If the frame rotates, dampers along its other degrees of freedom act too.
      if (any(is_rotation(free))) conserves = conserves &
        & .and. .not. any([(self%supports(i)%damping > 0, i = 1, size(self%supports))])
      conserves = conserves .and. .not. self%mechanism%has_ground_loads
      if (.not. (allocated(self%space) .and. conserves)) return
      conserves = .not. self%uniform_in_space()
      if (conserves .and. self%about_rest .and. count(is_rotation(free)) > 1) conserves = is_gyroscopic(self, chosen)
    end associate
  end function conserves

  !> Forces (N) of supports and foundation on the ground, and their moments (N m) about the rest position of the frame's centre of
  !> mass, shape (dofs, points). `x`: a state (q, q') in each column, shape (states, points).
  pure function ground_forces(self, x) result(forces)
    class(frame_type), intent(in) :: self
    real(dp), intent(in) :: x(:, :)
    real(dp), allocatable :: forces(:, :), stiffness(:, :)

    stiffness = self%ground_stiffness()
    forces = matmul(stiffness(:, self%free), x(:size(self%free), :)) &
      & + matmul(self%damping(:, self%free), x(size(self%free) + 1:, :))
  end function ground_forces

  !> Three complex numbers. The first is E = exp(i psi), which rotates vectors of the plane with the frame, to first order in psi.
  !> The second is dE/dpsi at rest. The third is E to second order in psi, as needed for the effect of gravity.
  pure function rotations(self, psi)
    class(frame_type), intent(in) :: self
    real(dp), intent(in) :: psi
    complex(dp) :: rotations(3)

    associate (unused_frame => self)
    end associate
    rotations = [cmplx(1, psi, dp), (0.0_dp, 1.0_dp), cmplx(1 - psi**2 / 2, psi, dp)]
  end function rotations

  !> Potential energy of the mounting (J) at the displacement q.
  pure real(dp) function potential(self, q)
    class(frame_type), intent(in) :: self
    real(dp), intent(in) :: q(3)

    potential = dot_product(q, matmul(self%stiffness + load_matrix(self%supports, 3), q)) / 2
  end function potential

  !> Power dissipated by the mounting (W) at the displacement q and velocity v, by the dampers and by the asymmetric part of the
  !> stiffness matrix.
  pure real(dp) function dissipation(self, q, v)
    class(frame_type), intent(in) :: self
    real(dp), intent(in) :: q(3), v(3)

    dissipation = dot_product(v, matmul(self%damping, v)) &
      & + dot_product(v, matmul(self%stiffness - transpose(self%stiffness), q)) / 2
  end function dissipation

  !> Mean speed of the drive (rad/s). The component `speed` is the speed of a shaft that turns once per period; the drive may turn
  !> several times per period.
  pure real(dp) function drive_speed(self)
    class(frame_type), intent(in) :: self

    drive_speed = self%speed * self%mechanism%turns
  end function drive_speed

  !> Mean speed of the drive (1/min).
  pure real(dp) function drive_rpm(self)
    class(frame_type), intent(in) :: self

    drive_rpm = self%drive_speed() * 30 / pi
  end function drive_rpm

  !> Angle by which the drive turns in a period (deg); negative if it turns clockwise.
  pure real(dp) function degrees_per_period(self)
    class(frame_type), intent(in) :: self

    degrees_per_period = sign(360.0_dp, self%speed) * self%mechanism%turns
  end function degrees_per_period

end module gestell_model_frame
