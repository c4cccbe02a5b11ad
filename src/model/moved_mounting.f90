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
    type(pair_type) :: spring, damper
    complex(dp), dimension(size(q, 1)) :: d, d_dot, arm, force, by_turn, by_spin
    integer :: j

    do j = 1, size(supports)
      associate (s => supports(j))
        spring = pair_of(s%stiffness, s%angle)
        damper = pair_of(s%damping, s%angle)
        call move_head(s, q, v, d, d_dot)
        arm = d - cmplx(q(:, 1), q(:, 2), dp) + place_of(s)                      ! E p
        force = -spring%times(d) - damper%times(d_dot)                         ! F = -K d - B v
      end associate
      by_turn = -spring%times(i * arm) + damper%times(v(:, 3) * arm)           ! dF/dpsi
      by_spin = -damper%times(i * arm)                                         ! dF/dpsi'
      r(:, 1) = r(:, 1) - real(force)
      r(:, 2) = r(:, 2) - aimag(force)
      r(:, 3) = r(:, 3) - cross(arm, force)
      call subtract_plane(spring, arm, c)
      call subtract_plane(damper, arm, b)
      c(:, 1, 3) = c(:, 1, 3) - real(by_turn)
      c(:, 2, 3) = c(:, 2, 3) - aimag(by_turn)
      c(:, 3, 3) = c(:, 3, 3) - cross(arm, by_turn) + real(conjg(arm) * force) ! the load turned on its arm
      b(:, 1, 3) = b(:, 1, 3) - real(by_spin)
      b(:, 2, 3) = b(:, 2, 3) - aimag(by_spin)
      b(:, 3, 3) = b(:, 3, 3) - cross(arm, by_spin)
    end do
  end subroutine add_mounting

  !> What the supports exert on the ground, shape (points, 3): forces, and the moment about F at rest, sum of (p + d) x (K d + B v).
  pure function ground_load(supports, q, v) result(load)
    type(support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp) :: load(size(q, 1), 3)
    complex(dp), dimension(size(q, 1)) :: d, d_dot, force
    type(pair_type) :: spring, damper
    integer :: j

    load = 0
    do j = 1, size(supports)
      call move_head(supports(j), q, v, d, d_dot)
      spring = pair_of(supports(j)%stiffness, supports(j)%angle)
      damper = pair_of(supports(j)%damping, supports(j)%angle)
      force = spring%times(d) + damper%times(d_dot)
      load(:, 1) = load(:, 1) + real(force)
      load(:, 2) = load(:, 2) + aimag(force)
      load(:, 3) = load(:, 3) + cross(place_of(supports(j)) + d, force)
    end do
  end function ground_load

  !> Potential energy of the supports' springs (J), shape (points).
  pure function mounting_energy(supports, q) result(energy)
    type(support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: q(:, :)
    real(dp) :: energy(size(q, 1))
    complex(dp), dimension(size(q, 1)) :: d, d_dot
    type(pair_type) :: spring
    integer :: j

    energy = 0
    do j = 1, size(supports)
      call move_head(supports(j), q, q, d, d_dot)
      spring = pair_of(supports(j)%stiffness, supports(j)%angle)
      energy = energy + real(conjg(d) * spring%times(d)) / 2
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
      call move_head(supports(j), q, v, d, d_dot)
      damper = pair_of(supports(j)%damping, supports(j)%angle)
      power = power + real(conjg(d_dot) * damper%times(d_dot))
    end do
  end function mounting_power

  !> d and d' of the head of a support.
  pure subroutine move_head(support, q, v, d, d_dot)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: q(:, :), v(:, :)
    complex(dp), intent(out) :: d(:), d_dot(:)

    d = cmplx(q(:, 1), q(:, 2), dp) + (exp(i * q(:, 3)) - 1) * place_of(support)
    d_dot = cmplx(v(:, 1), v(:, 2), dp) + i * v(:, 3) * exp(i * q(:, 3)) * place_of(support)
  end subroutine move_head

  pure complex(dp) function place_of(support)
    type(support_type), intent(in) :: support

    place_of = cmplx(support%position(1), support%position(2), dp)
  end function place_of

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
