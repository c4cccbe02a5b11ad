!> What a mounting exerts on a frame that has moved and turned, however far, and how that changes with the motion.
!>
!> Vectors of the plane are complex numbers, E = exp(i psi). The head of a support at p, seen from F in the frame's system, has
!> the displacement and velocity
!>
!>     d = u + (E - 1) p,   v = u' + i psi' E p,   u = xi + i eta,
!>
!> and is held by F = -K d - B v with the moment M = Im(conj(E p) F) about F. Two springs k1, k2 along axes at the angle alpha are
!>
!>     K d = (k1 + k2)/2 d + (k1 - k2)/2 exp(2 i alpha) conj(d).
!>
!> Axes that turn with the frame measure the displacement, and its rate, in the frame, with w = conj(E) (u - p)
!>
!>     e = conj(E) d = p + w,   e' = conj(E) u' - i psi' w,   f = K e + B e' + G,
!>
!> and the force -E f on the frame acts along a line through the place p at rest: M = Im(conj(w) f). There the static force G on the
!> ground turns with the axes, and what it exerts at rest is carried already, so that G and Im(conj(p) G) are added.
module gestell_model_moved_mounting
  use gestell_base_kinds, only: dp
  use gestell_model_mounting, only: support_type
  implicit none (type, external)
  private

  public :: add_mounting, ground_load, mounting_energy, mounting_power

  complex(dp), parameter :: i = (0.0_dp, 1.0_dp)

  !> An elastic or viscous pair: K d = mean d + difference conj(d).
  type :: pair_type
    real(dp) :: mean = 0
    complex(dp) :: difference = 0
  contains
    procedure :: times
  end type pair_type

contains

  !> Subtracts forces and moments of the `supports` on the frame from `r`, shape (points, 3), and their derivatives with respect to
  !> q and q' from `c` and `b`, shape (points, 3, 3), where the frame is at q with the velocity `v`, shape (points, 3).
  pure subroutine add_mounting(supports, q, v, r, b, c)
    type(support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp), intent(inout) :: r(:, :), b(:, :, :), c(:, :, :)
    integer :: j

    do j = 1, size(supports)
      if (supports(j)%turning) then
        call add_in_frame(supports(j), q, v, r, b, c)
      else
        call add_in_space(supports(j), q, v, r, b, c)
      end if
    end do
  end subroutine add_mounting

  !> The same of one support whose axes stay in space.
  pure subroutine add_in_space(support, q, v, r, b, c)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp), intent(inout) :: r(:, :), b(:, :, :), c(:, :, :)
    type(pair_type) :: spring, damper
    complex(dp), dimension(size(q, 1)) :: d, d_dot, arm, force, by_turn, by_spin

    spring = pair_of(support%stiffness, support%angle)
    damper = pair_of(support%damping, support%angle)
    call elongate(support, q, v, d, d_dot)
    arm = d - cmplx(q(:, 1), q(:, 2), dp) + complex_of(support%position)       ! E p
    force = -spring%times(d) - damper%times(d_dot)                             ! F = -K d - B v
    by_turn = -spring%times(i * arm) + damper%times(v(:, 3) * arm)             ! dF/dpsi
    by_spin = -damper%times(i * arm)                                           ! dF/dpsi'
    r(:, 1) = r(:, 1) - real(force)
    r(:, 2) = r(:, 2) - aimag(force)
    r(:, 3) = r(:, 3) - cross(arm, force)
    call subtract_plane(spring, arm, c)
    call subtract_plane(damper, arm, b)
    c(:, 1, 3) = c(:, 1, 3) - real(by_turn)
    c(:, 2, 3) = c(:, 2, 3) - aimag(by_turn)
    c(:, 3, 3) = c(:, 3, 3) - cross(arm, by_turn) + real(conjg(arm) * force)   ! the load turned on its arm
    b(:, 1, 3) = b(:, 1, 3) - real(by_spin)
    b(:, 2, 3) = b(:, 2, 3) - aimag(by_spin)
    b(:, 3, 3) = b(:, 3, 3) - cross(arm, by_spin)
  end subroutine add_in_space

  !> The same of one support whose axes turn with the frame.
  pure subroutine add_in_frame(support, q, v, r, b, c)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp), intent(inout) :: r(:, :), b(:, :, :), c(:, :, :)
    complex(dp), parameter :: along(2) = [(1.0_dp, 0.0_dp), i]
    type(pair_type) :: spring, damper
    complex(dp), dimension(size(q, 1)) :: e, e_dot, turn, w, f, moved, by_place, by_speed
    complex(dp) :: static
    integer :: k

    spring = pair_of(support%stiffness, support%angle)
    damper = pair_of(support%damping, support%angle)
    static = complex_of(support%static)
    turn = exp(i * q(:, 3))
    call elongate(support, q, v, e, e_dot)
    w = e - complex_of(support%position)
    f = spring%times(e) + damper%times(e_dot) + static
    r(:, 1) = r(:, 1) + real(turn * f - static)
    r(:, 2) = r(:, 2) + aimag(turn * f - static)
    r(:, 3) = r(:, 3) - cross(w, f) - cross(complex_of(support%position), static)
    do k = 1, 2
      moved = conjg(turn) * along(k)                                           ! dw
      by_place = spring%times(moved) - damper%times(i * v(:, 3) * moved)       ! df/du
      by_speed = damper%times(moved)                                           ! df/du'
      c(:, 1, k) = c(:, 1, k) + real(turn * by_place)
      c(:, 2, k) = c(:, 2, k) + aimag(turn * by_place)
      c(:, 3, k) = c(:, 3, k) - cross(w, by_place) - cross(moved, f)
      b(:, 1, k) = b(:, 1, k) + real(turn * by_speed)
      b(:, 2, k) = b(:, 2, k) + aimag(turn * by_speed)
      b(:, 3, k) = b(:, 3, k) - cross(w, by_speed)
    end do
    by_place = -spring%times(i * w) - damper%times(i * e_dot)                  ! df/dpsi
    by_speed = -damper%times(i * w)                                            ! df/dpsi'
    c(:, 1, 3) = c(:, 1, 3) + real(turn * (by_place + i * f))
    c(:, 2, 3) = c(:, 2, 3) + aimag(turn * (by_place + i * f))
    c(:, 3, 3) = c(:, 3, 3) - cross(w, by_place) + cross(i * w, f)
    b(:, 1, 3) = b(:, 1, 3) + real(turn * by_speed)
    b(:, 2, 3) = b(:, 2, 3) + aimag(turn * by_speed)
    b(:, 3, 3) = b(:, 3, 3) - cross(w, by_speed)
  end subroutine add_in_frame

  !> What the supports exert on the ground by the motion, shape (points, 3): forces along axes in space, and the moment about F at
  !> rest, sum of (p + d) x (K d + B v), or p x (E f - G).
  pure function ground_load(supports, q, v) result(load)
    type(support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp) :: load(size(q, 1), 3)
    complex(dp), dimension(size(q, 1)) :: d, d_dot, force, place
    type(pair_type) :: spring, damper
    integer :: j

    load = 0
    do j = 1, size(supports)
      call elongate(supports(j), q, v, d, d_dot)
      spring = pair_of(supports(j)%stiffness, supports(j)%angle)
      damper = pair_of(supports(j)%damping, supports(j)%angle)
      force = spring%times(d) + damper%times(d_dot)
      place = complex_of(supports(j)%position)
      if (supports(j)%turning) then
        force = exp(i * q(:, 3)) * force + (exp(i * q(:, 3)) - 1) * complex_of(supports(j)%static)
      else
        place = place + d
      end if
      load(:, 1) = load(:, 1) + real(force)
      load(:, 2) = load(:, 2) + aimag(force)
      load(:, 3) = load(:, 3) + cross(place, force)
    end do
  end function ground_load

  !> Potential energy of the supports' springs (J), shape (points), of static forces that turn with the frame too.
  pure function mounting_energy(supports, q) result(energy)
    type(support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: q(:, :)
    real(dp) :: energy(size(q, 1))
    complex(dp), dimension(size(q, 1)) :: d, d_dot
    complex(dp) :: static
    type(pair_type) :: spring
    integer :: j

    energy = 0
    do j = 1, size(supports)
      call elongate(supports(j), q, q, d, d_dot)
      spring = pair_of(supports(j)%stiffness, supports(j)%angle)
      energy = energy + real(conjg(d) * spring%times(d)) / 2
      if (.not. supports(j)%turning) cycle
      static = complex_of(supports(j)%static)
      energy = energy + real(conjg(static) * (d - cmplx(q(:, 1), q(:, 2), dp))) &
        & - cross(complex_of(supports(j)%position), static) * q(:, 3)
    end do
  end function mounting_energy

  !> Power that the supports' dampers take (W), shape (points).
  pure function mounting_power(supports, q, v) result(power)
    type(support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp) :: power(size(q, 1))
    complex(dp), dimension(size(q, 1)) :: d, d_dot
    type(pair_type) :: damper
    integer :: j

    power = 0
    do j = 1, size(supports)
      call elongate(supports(j), q, v, d, d_dot)
      damper = pair_of(supports(j)%damping, supports(j)%angle)
      power = power + real(conjg(d_dot) * damper%times(d_dot))
    end do
  end function mounting_power

  !> d and d' of the head of a support; e and e' where its axes turn with the frame.
  pure subroutine elongate(support, q, v, d, d_dot)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: q(:, :), v(:, :)
    complex(dp), intent(out) :: d(:), d_dot(:)

    associate (turn => exp(i * q(:, 3)), p => complex_of(support%position))
      d = cmplx(q(:, 1), q(:, 2), dp) + (turn - 1) * p
      d_dot = cmplx(v(:, 1), v(:, 2), dp) + i * v(:, 3) * turn * p
      if (.not. support%turning) return
      d = conjg(turn) * d
      d_dot = conjg(turn) * d_dot - i * v(:, 3) * d
    end associate
  end subroutine elongate

  pure complex(dp) function complex_of(a)
    real(dp), intent(in) :: a(2)

    complex_of = cmplx(a(1), a(2), dp)
  end function complex_of

  !> The derivatives of -force and -moment with respect to xi and eta, or their velocities.
  pure subroutine subtract_plane(pair, arm, k)
    type(pair_type), intent(in) :: pair
    complex(dp), intent(in) :: arm(:)
    real(dp), intent(inout) :: k(:, :, :)
    complex(dp) :: along
    integer :: j

    do j = 1, 2
      along = pair%times(merge((1.0_dp, 0.0_dp), i, j == 1))
      k(:, 1, j) = k(:, 1, j) + real(along)
      k(:, 2, j) = k(:, 2, j) + aimag(along)
      k(:, 3, j) = k(:, 3, j) + cross(arm, along)
    end do
  end subroutine subtract_plane

  pure type(pair_type) function pair_of(k, angle)
    real(dp), intent(in) :: k(2), angle

    pair_of%mean = sum(k) / 2
    pair_of%difference = (k(1) - k(2)) / 2 * exp(2 * i * angle)
  end function pair_of

  !> K d.
  elemental complex(dp) function times(self, d)
    class(pair_type), intent(in) :: self
    complex(dp), intent(in) :: d

    times = self%mean * d + self%difference * conjg(d)
  end function times

  !> a x b.
  elemental real(dp) function cross(a, b)
    complex(dp), intent(in) :: a, b

    cross = aimag(conjg(a) * b)
  end function cross

end module gestell_model_moved_mounting
