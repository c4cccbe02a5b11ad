!> The frame linearised about one of its motions: the exact equations, for any rotation, and their derivatives, (30) to (34) of
!> doc/theory.md.
!>
!> Vectors of the plane are complex numbers: u = xi + i eta, E = exp(i psi). Let m be the mass of the whole machine. A mass of the
!> mechanism is at r = O + x + i y relative to F, along the frame's axes. The sums over the masses are
!>
!>     S = sum m r,   J = moment of inertia about F,   H' = sum (m r x r'' + J_i phi_i'').
!>
!> The balances of momentum, and of angular momentum about F, give
!>
!>     m u'' + E [S'' + 2 i psi' S' + (i psi'' - psi'^2) S]           = sum of F_j
!>     J psi'' + J' psi' + H' + Im(conj(E S) u'')                     = sum of M_j
!>
!> with the forces F_j and moments M_j of the mounting (gestell_model_exact_moved_mounting) and the moment of the weights
!> (gestell_model_mounting_weights). Linearised about rest, q = 0, these equations become (8) to (12). The sums over the masses are
!> functions of the crank angle phi = Omega t, so ' is Omega d/dphi.
!>
!> If the crank turns uniformly relative to the ground, phi = Omega t - p psi; gestell_model_mechanism_held defines p, A and K. Then
!> the first moment Z = E S of the masses depends on t and psi:
!>
!>     dZ/dpsi = i E S_1,   S_1 = S + i p dS/dphi,   S_2 = S_1 + i p dS_1/dphi,   S_3 = S_2 + i p dS_2/dphi.
!>
!> If the crank turns uniformly relative to the frame, p = 0 and S_1, S_2, S_3 equal S. From here on ' is the derivative at constant
!> psi, Omega d/dphi, for all quantities except u and psi. In both cases
!>
!>     m u'' + E [S'' + 2 i psi' S_1' + i psi'' S_1 - psi'^2 S_2]                 = sum of F_j
!>     J_1 psi'' + J_1' psi' + psi'^2/2 dJ_1/dpsi + H_1' + Im(conj(E S_1) u'')    = sum of M_j - M.
!>
!> If the crank turns uniformly relative to the ground, J_1 = J - 2 p A + p^2 K and H_1' = Omega^2 d(A - p K/2)/dphi. If it turns
!> uniformly relative to the frame, J_1 = J, which does not depend on psi, and H_1' = H'. M is the mean torque of a motor on the
!> frame that drives a flywheel; M = 0 without a flywheel.
module gestell_model_exact_varied_frame
  use gestell_math_cosine_sine, only: cosine_sine
  use gestell_math_vectors, only: batch, in_batch
  use gestell_base_kinds, only: dp, pi
  use gestell_math_series_trigonometric, only: series_through, series_type
  use gestell_model_frame, only: connections, frame_type
  use gestell_model_exact_moved_mounting, only: add_mounting, ground_load, mounting_energy
  use gestell_model_space, only: in_frame, is_rotation
  use gestell_model_space_drive, only: follow_frame, moved_type
  use gestell_model_space_energy, only: mounting_power
  use gestell_model_space_loads, only: count_loads, find_loads, load_power, space_load_type
  use gestell_model_space_variation, only: ground_in_space, sample_varied
  use gestell_model_mechanism_held, only: part_of_turn
  use gestell_model_mechanism, only: load_sums_type
  use gestell_model_mechanism_loads, only: effect_of, load_effect_type, power_of_loads
  use gestell_model_exact_moving_masses, only: find_masses, masses_type
  implicit none (type, external)
  private

  public :: varied_frame

  !> A frame linearised about `motion`: M q'' + B q' + C q = h, where M, B, C are the derivatives of the exact equations. The
  !> multipliers of this system decide whether `motion` is stable. If `newton` is true, the system's periodic solution is the next
  !> iterate of Newton's method, (36). If `newton` is false, the periodic solution is `motion` itself.
  type, extends(frame_type), public :: varied_frame_type
    !> Displacements and rotations of all degrees of freedom as functions of theta = 2 pi t/T, where T is the period.
    type(series_type) :: motion
    logical :: newton = .true.
    !> True if the load h is only the residual of the exact equations at `motion`, with reversed sign. The periodic solution is
    !> then the step of Newton's method, not the next iterate.
    logical :: lacking = .false.
    !> Factor on the excitation: 1 for the actual excitation, 0 where continuation begins at the frame at rest.
    real(dp) :: excitation = 1
    !> Angle chi by which the drive lags behind uniform rotation relative to the frame (rad); see gestell_model_space_drive. Only
    !> for a frame in space with a flywheel.
    type(series_type) :: flywheel_series
    !> Mean over the period of the frame's rate of rotation about the shaft (rad/s). Only for a frame in space with a flywheel.
    real(dp) :: drift = 0
  contains
    procedure :: linearise_about, lag, sample_second_order, coupled, ground_forces
    procedure :: rotations, potential, dissipation
  end type varied_frame_type

  complex(dp), parameter :: i = (0.0_dp, 1.0_dp)

contains

  !> Returns the frame linearised about `motion`.
  function varied_frame(frame, motion) result(varied)
    class(frame_type), intent(in) :: frame
    type(series_type), intent(in) :: motion
    type(varied_frame_type) :: varied

    varied%frame_type = frame
    varied%about_rest = .false.
    call varied%linearise_about(motion)
  end function varied_frame

  !> Linearises the frame about another motion. With a flywheel, also computes the mean torque of the motor, which must replace the
  !> power that the dampers dissipate in a period, less the power of the loads.
  pure subroutine linearise_about(self, motion)
    class(varied_frame_type), intent(inout) :: self
    type(series_type), intent(in) :: motion
    real(dp), allocatable :: q(:, :), v(:, :), a(:, :)
    type(load_sums_type), allocatable :: sums(:)
    real(dp) :: displacement(3), rate(3), watts
    integer :: k, points

    self%motion = motion
    call self%motion%tabulate()
    self%motor_torque = 0
    if (self%held_by /= "flywheel") return
    ! The dissipated power is of second order in the motion; this number of points integrates it exactly up to terms of tenth order.
    points = 8 * (ubound(motion%cosine, 1) + 1)
    if (self%loads_act()) points = max(points, 2 * (self%mechanism%load_order + self%least_steps))
    if (self%drive_lags()) then
      call spin_flywheel(self, points)
      return
    end if
    allocate(q(points, 3), v(points, 3), a(points, 3))
    allocate(sums(merge(points, 0, self%loads_act())))
    call motion%values([(real(k, dp) / points, k = 1, points)], q, v, a)
    if (self%loads_act()) call self%mechanism%sum_loads(self%crank_angles([(real(k, dp) / points, k = 1, points)]) &
      & - q(:, 3) / self%mechanism%turns, self%origin, sums)
    do k = 1, points
      displacement = q(k, :)
      rate = v(k, :) * (2 * pi / self%period)
      watts = self%dissipation(displacement, rate)
      if (self%loads_act()) watts = watts - power_of_loads(sums(k), exp(i * q(k, 3)), self%speed - rate(3) / self%mechanism%turns, &
        & rate)
      self%motor_torque = self%motor_torque + watts / (points * self%speed * self%mechanism%turns)
    end do
  end subroutine linearise_about

  !> Computes, for a frame in space with a flywheel, the lag chi of the drive and the mean torque of the motor. The rate of change
  !> of chi is the frame's rate of rotation about the shaft, minus its mean over the period.
  pure subroutine spin_flywheel(self, points)
    class(varied_frame_type), intent(inout) :: self
    integer, intent(in) :: points
    real(dp), dimension(points, 6) :: q, v, a
    real(dp) :: rate(points, 1), cosine, rotation(3, 3, points), relative_rate(points), w(3, points), velocity(3)
    real(dp), dimension(batch, 3, 0:2) :: theta
    type(moved_type) :: moved
    type(space_load_type), allocatable :: loads(:)
    integer, parameter :: turns(3) = in_frame(4:)
    integer :: at(batch), first, last, n, k

    call self%motion%values([(real(k - 1, dp) / points, k = 1, points)], q, v, a)
    v = v * (2 * pi / self%period)
    a = a * (2 * pi / self%period)**2
    do first = 1, points, batch
      at = in_batch(first, points)
      last = at(batch)
      n = last - first + 1
      theta(:, :, 0) = q(at, turns)
      theta(:, :, 1) = v(at, turns)
      theta(:, :, 2) = a(at, turns)
      call follow_frame(self%space%drive, self%speed, a(at, in_frame(:3)), theta, moved)
      rate(first:last, 1) = moved%chi(:n, 1) * self%mechanism%turns
      relative_rate(first:last) = moved%rate(:n)
      do k = 1, n
        rotation(:, :, at(k)) = moved%rotation(k, :, :)
        w(:, at(k)) = moved%w(k, :)
      end do
    end do
    do k = 1, points
      self%motor_torque = self%motor_torque + mounting_power(self, q(k, in_frame), v(k, in_frame)) &
        & / (points * self%speed * self%mechanism%turns)
    end do
    self%flywheel_series = series_through(rate)
    self%drift = self%flywheel_series%cosine(0, 1)
    ! the mean of chi is that of n theta
    self%flywheel_series%cosine(0, 1) = dot_product(self%space%drive%axis, self%motion%cosine(0, in_frame(4:)))
    do k = 1, ubound(self%flywheel_series%cosine, 1)
      associate (c => self%flywheel_series%cosine(k, 1), s => self%flywheel_series%sine(k, 1), frequency => 2 * pi &
        & * k / self%period)
        cosine = -s / frequency
        s = c / frequency
        c = cosine
      end associate
    end do
    call self%flywheel_series%tabulate()
    if (.not. self%loads_act()) return
    allocate(loads(count_loads(self%space%planes)))
    associate (lags => self%lag([(real(k - 1, dp) / points, k = 1, points)]), turns => self%mechanism%turns)
      do k = 1, points
        call find_loads(self%space%planes, sign(2 * pi, self%speed) * (k - 1) / points - lags(k, 1) / turns, loads)
        velocity = v(k, in_frame(:3))
        self%motor_torque = self%motor_torque - load_power(loads, rotation(:, :, k), relative_rate(k) + self%drift / turns, &
          & velocity, w(:, k)) / (points * self%speed * turns)
      end do
    end associate
  end subroutine spin_flywheel

  !> Argument `lag` of `follow_frame` at phases of the period, shape (phases, 3). Columns: angle chi by which the drive lags
  !> behind uniform rotation relative to the frame (rad), mean of the frame's rate of rotation about the shaft (rad/s), mean
  !> torque of the motor (N m). All columns are 0 without a flywheel.
  pure function lag(self, phases)
    class(varied_frame_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp) :: lag(size(phases), 3)
    real(dp), dimension(size(phases), 1) :: chi, chi_d, chi_dd

    lag = 0
    if (self%held_by /= "flywheel") return
    call self%flywheel_series%values(phases, chi, chi_d, chi_dd)
    lag(:, 1) = chi(:, 1)
    lag(:, 2) = self%drift
    lag(:, 3) = self%motor_torque
  end function lag

  !> Computes the matrices M, B, C, shape (phases, n, n), and the load h, shape (phases, n), of the n free degrees of freedom at
  !> phases of the period.
  subroutine sample_second_order(self, phases, m, b, c, h)
    class(varied_frame_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    real(dp), dimension(size(phases), self%dofs(), self%dofs()) :: all_m, all_b, all_c, rest_m, rest_b, rest_c
    real(dp), dimension(size(phases), self%dofs()) :: q, v, a, r, load
    real(dp), dimension(size(phases)) :: cosine, sine
    complex(dp) :: turn(size(phases))
    integer :: j, k

    call self%motion%values(phases, q, v, a)
    v = v * (2 * pi / self%period)
    a = a * (2 * pi / self%period)**2
    if (allocated(self%space)) then
      call sample_varied(self, self%space, self%crank_angles(phases), q, v, a, self%lag(phases), r, all_m, all_b, all_c)
    else
      call cosine_sine(q(:, 3), cosine, sine)
      turn = cmplx(cosine, sine, dp)
      call vary_inertia(self, phases, q, v, a, turn, r, all_m, all_b, all_c)
      do k = 1, 3
        do j = 1, 3
          r(:, j) = r(:, j) + self%foundation_stiffness(j, k) * q(:, k) + self%foundation_damping(j, k) * v(:, k)
          all_b(:, j, k) = all_b(:, j, k) + self%foundation_damping(j, k)
          all_c(:, j, k) = all_c(:, j, k) + self%foundation_stiffness(j, k)
        end do
      end do
      call add_mounting(self%supports, q, v, turn, r, all_b, all_c)
    end if
    if (self%excitation < 1 .or. self%excitation > 1) then
      ! subtracts the part of the load at rest that does not act
      call self%sample_at_rest(self%crank_angles(phases), [(k, k = 1, self%dofs())], rest_m, rest_b, rest_c, load)
      r = r + (1 - self%excitation) * load
    end if
    do k = 1, size(self%free)
      do j = 1, size(self%free)
        m(:, j, k) = all_m(:, self%free(j), self%free(k))
        b(:, j, k) = all_b(:, self%free(j), self%free(k))
        c(:, j, k) = all_c(:, self%free(j), self%free(k))
      end do
    end do
    if (.not. present(h)) return
    if (.not. self%newton) r = 0
    do k = 1, merge(0, size(q, 2), self%lacking)
      do j = 1, size(q, 2)
        r(:, j) = r(:, j) - all_m(:, j, k) * a(:, k) - all_b(:, j, k) * v(:, k) - all_c(:, j, k) * q(:, k)
      end do
    end do
    do j = 1, size(self%free)
      h(:, j) = -r(:, self%free(j))
    end do
  end subroutine sample_second_order

  !> Computes the contribution of the masses, including the effect of gravity on them, to the left sides of (30) and (31), and the
  !> derivatives of this contribution. `turn`: E = exp(i psi).
  subroutine vary_inertia(frame, phases, q, v, a, turn, r, m, b, c)
    type(varied_frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(in) :: q(:, :), v(:, :), a(:, :)
    complex(dp), intent(in) :: turn(:)
    real(dp), intent(out) :: r(:, :), m(:, :, :), b(:, :, :), c(:, :, :)
    type(masses_type) :: at
    complex(dp), dimension(size(phases)) :: flywheel_series, varied, moving
    real(dp) :: mass

    call find_masses(frame, frame%crank_angles(phases) - part_of_turn(frame%mechanism, frame%uniform_in_space()) * q(:, 3), at)
    mass = frame%mass + frame%mechanism%mass
    moving = i * turn * at%s_1
    m = 0
    b = 0
    c = 0
    m(:, 1, 1) = mass
    m(:, 2, 2) = mass
    m(:, 1, 3) = real(moving)
    m(:, 2, 3) = aimag(moving)
    m(:, 3, 1:2) = m(:, 1:2, 3)
    m(:, 3, 3) = at%inertia
    associate (w => v(:, 3), w_d => a(:, 3))
      flywheel_series = turn * (at%s_tt + 2 * i * w * at%s_1_t - w**2 * at%s_2) + moving * w_d
      r(:, 1) = mass * a(:, 1) + real(flywheel_series)
      r(:, 2) = mass * a(:, 2) + aimag(flywheel_series)
      r(:, 3) = at%moment + at%inertia * w_d + at%inertia_t * w + at%inertia_psi * w**2 / 2 + real(moving) * a(:, 1) &
        & + aimag(moving) * a(:, 2) + frame%motor_torque
      flywheel_series = turn * (2 * i * at%s_1_t - 2 * w * at%s_2)
      varied = turn * (i * at%s_1_tt - 2 * w * at%s_2_t - i * w**2 * at%s_3 - w_d * at%s_2)
      b(:, 3, 3) = at%inertia_t + at%inertia_psi * w
      c(:, 3, 3) = at%inertia_psi * w_d + at%inertia_tpsi * w + at%inertia_psipsi * w**2 / 2 + at%moment_psi &
        & - real(turn * at%s_2) * a(:, 1) - aimag(turn * at%s_2) * a(:, 2)
    end associate
    b(:, 1, 3) = real(flywheel_series)
    b(:, 2, 3) = aimag(flywheel_series)
    c(:, 1, 3) = real(varied)
    c(:, 2, 3) = aimag(varied)
    if (frame%weights%act) then
      r(:, 3) = r(:, 3) - frame%weights%moment(turn, at%s_1)
      c(:, 3, 3) = c(:, 3, 3) + frame%weights%moment_stiffness(turn, at%s_2)
    end if
    if (frame%loads_act()) call subtract_loads(frame, phases, q(:, 3), turn, r, c)
  end subroutine vary_inertia

  !> Subtracts the forces of the loads from the left sides r, and their derivatives from c. `psi`: rotation of the frame. `turn`:
  !> E = exp(i psi).
  pure subroutine subtract_loads(frame, phases, psi, turn, r, c)
    type(varied_frame_type), intent(in) :: frame
    real(dp), intent(in) :: phases(:), psi(:)
    complex(dp), intent(in) :: turn(:)
    real(dp), intent(inout) :: r(:, :), c(:, :, :)
    type(load_sums_type) :: sums(size(phases))
    type(load_effect_type) :: effect
    integer :: k

    associate (part => part_of_turn(frame%mechanism, frame%uniform_in_space()))
      call frame%mechanism%sum_loads(frame%crank_angles(phases) - part * psi, frame%origin, sums)
      do k = 1, size(phases)
        effect = effect_of(sums(k), turn(k), part)
        r(k, :) = r(k, :) - effect%force
        c(k, :, 3) = c(k, :, 3) - effect%force_psi
      end do
    end associate
  end subroutine subtract_loads

  !> True for each pair of free degrees of freedom that the equations couple. Usually a rotation counts as coupled to all other
  !> degrees of freedom, and displacements count as coupled if the equations about rest couple them. If only some degrees of freedom
  !> are damped, the matrices are examined at many phases instead, so that a subsystem without dampers can be proved undamped. This
  !> is done only then, because solving each subsystem costs as much as solving the whole frame. The phases are shifted by 1/pi of
  !> their spacing, so that no phase has a special symmetry.
  function coupled(self)
    class(varied_frame_type), intent(in) :: self
    logical, allocatable :: coupled(:, :), turns(:)
    integer :: k

    coupled = self%frame_type%coupled()
    turns = is_rotation(self%free)
    coupled = coupled .or. spread(turns, 1, size(turns)) .or. spread(turns, 2, size(turns))
    k = count([(self%damping(self%free(k), self%free(k)) > 0, k = 1, size(self%free))])
    if (k == 0 .or. k == size(self%free)) return
    coupled = connections(self, 1 / pi)
  end function coupled

  !> Forces (N) on the ground and their moments (N m) about the rest position of the frame's centre of mass, shape (dofs, points).
  !> `x`: a state (q, q') in each column, shape (states, points).
  pure function ground_forces(self, x) result(forces)
    class(varied_frame_type), intent(in) :: self
    real(dp), intent(in) :: x(:, :)
    real(dp), allocatable :: forces(:, :)
    real(dp), dimension(size(x, 2), self%dofs()) :: q, v
    integer :: f

    f = size(self%free)
    q = 0
    v = 0
    q(:, self%free) = transpose(x(:f, :))
    v(:, self%free) = transpose(x(f + 1:, :))
    if (allocated(self%space)) then
      forces = ground_in_space(self, q, v)
      return
    end if
    forces = transpose(ground_load(self%supports, q, v) + matmul(q, transpose(self%foundation_stiffness)) &
      & + matmul(v, transpose(self%foundation_damping)))
  end function ground_forces

  !> Three complex numbers: E = exp(i psi), dE/dpsi and again E, all exact. A frame linearised about rest uses three
  !> approximations in their place (see `rotations` of gestell_model_frame).
  pure function rotations(self, psi)
    class(varied_frame_type), intent(in) :: self
    real(dp), intent(in) :: psi
    complex(dp) :: rotations(3)

    associate (unused_frame => self)
    end associate
    rotations = exp(i * psi) * [(1.0_dp, 0.0_dp), i, (1.0_dp, 0.0_dp)]
  end function rotations

  !> Potential energy of the mounting (J) at the displacement q.
  pure real(dp) function potential(self, q)
    class(varied_frame_type), intent(in) :: self
    real(dp), intent(in) :: q(3)

    potential = sum(mounting_energy(self%supports, reshape(q, [1, 3]))) + dot_product(q, matmul(self%foundation_stiffness, q)) / 2
  end function potential

  !> Power dissipated by the mounting (W) at the displacement q and velocity v, by the dampers and by the asymmetric part of the
  !> foundation's stiffness.
  pure real(dp) function dissipation(self, q, v)
    class(varied_frame_type), intent(in) :: self
    real(dp), intent(in) :: q(3), v(3)

    dissipation = mounting_power(self, [q(:2), 0.0_dp, 0.0_dp, 0.0_dp, q(3)], [v(:2), 0.0_dp, 0.0_dp, 0.0_dp, v(3)])
  end function dissipation

end module gestell_model_exact_varied_frame
