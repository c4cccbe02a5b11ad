!> Forces of the supports on a frame after a displacement and rotation of any size, and their derivatives with respect to the
!> motion; (32) to (34) of doc/theory.md.
!>
!> Vectors of the plane are complex numbers, E = exp(i psi). The upper end of a support, where it is attached to the frame, is at p
!> relative to the frame's centre of mass F, along the frame's axes. It has the displacement and velocity
!>
!>     d = u + (E - 1) p,   v = u' + i psi' E p,   u = xi + i eta.
!>
!> Support j exerts the force F_j = -K d - B v on the frame, with the moment M_j = Im(conj(E p) F_j) about F. Two springs k1, k2
!> along axes at the angle alpha give
!>
!>     K d = (k1 + k2)/2 d + (k1 - k2)/2 exp(2 i alpha) conj(d).
!>
!> If the axes of a support turn with the frame, displacement and rate are measured along the frame's axes. With w = conj(E) (u -
!> p),
!>
!>     e = conj(E) d = p + w,   e' = conj(E) u' - i psi' w,   f = K e + B e' + G.
!>
!> The support then exerts the force -E f on the frame. Its line of action passes through p, the position of the upper end when the
!> frame is at rest: M = Im(conj(w) f). The static force G on the ground turns with these axes. At rest, G and its moment balance
!> the weight of the machine. Therefore G and Im(conj(p) G) are added to the force and moment on the frame.
module gestell_model_exact_moved_mounting
  use gestell_base_kinds, only: dp
  use gestell_math_turn, only: less_one
  use gestell_model_mounting, only: support_type
  implicit none (type, external)
  private

  public :: add_mounting, ground_load, mounting_energy

  complex(dp), parameter :: i = (0.0_dp, 1.0_dp)

  !> Two springs or two dampers along perpendicular axes. The displacement d of their upper end causes the force K d = `mean` d +
  !> `difference` conj(d).
  type :: pair_type
    real(dp) :: mean = 0
    complex(dp) :: difference = 0
  contains
    procedure :: times
  end type pair_type

  !> Sums over all pairs of springs, or of dampers, whose axes do not turn with the frame. With the position p of a pair's upper
  !> end, `mean`, `mean_p` and `mean_pp` are sums of the means of the pairs times 1, p and |p|^2. `difference`, `difference_p` and
  !> `difference_pp` are sums of the differences times 1, conj(p) and conj(p)^2.
  type :: sums_type
    real(dp) :: mean = 0, mean_pp = 0
    complex(dp) :: difference = 0, mean_p = 0, difference_p = 0, difference_pp = 0
    logical :: act = .false.
  end type sums_type

contains

  !> Subtracts the forces F_j and moments of the supports from the left sides r of the equations of motion. The derivatives of
  !> forces and moments with respect to q' are subtracted from b, those with respect to q from c. The supports whose axes do not
  !> turn with the frame have the total moment Im(conj(E) G). Here E = exp(i psi), and G is the sum of conj(p_j) F_j with the
  !> positions p_j of the upper ends.
  pure subroutine add_mounting(supports, q, v, turn, r, b, c)
    type(support_type), intent(in) :: supports(:)
    !> `q`: displacement and rotation (xi, eta, psi) of the frame, shape (points, 3). `v`: rates of change of `q`, in the same shape
    real(dp), intent(in) :: q(:, :), v(:, :)
    !> E = exp(i psi), shape (points)
    complex(dp), intent(in) :: turn(:)
    !> Left sides r, shape (points, 3). Derivatives b with respect to q' and c with respect to q, shapes (points, 3, 3)
    real(dp), intent(inout) :: r(:, :), b(:, :, :), c(:, :, :)
    complex(dp), dimension(size(turn)) :: f, g, f_turn, g_turn, f_spin, g_spin, rest
    type(sums_type) :: springs, dampers
    integer :: j

    do j = 1, size(supports)
      associate (s => supports(j))
        if (s%turning) then
          call add_in_frame(s, q, v, turn, r, b, c)
        else
          call add_pair(springs, pair_of(s%stiffness, s%axes), complex_of(s%position))
          call add_pair(dampers, pair_of(s%damping, s%axes), complex_of(s%position))
        end if
      end associate
    end do
    f = 0
    g = 0
    f_turn = 0
    g_turn = 0
    f_spin = 0
    g_spin = 0
    rest = 0
    call add_head_forces(springs, cmplx(q(:, 1), q(:, 2), dp), less_one(turn), f, g)
    call add_head_forces(springs, rest, i * turn, f_turn, g_turn)
    call subtract_plane(springs, turn, c)
    if (dampers%act) then
      call add_head_forces(dampers, cmplx(v(:, 1), v(:, 2), dp), i * v(:, 3) * turn, f, g)
      call add_head_forces(dampers, rest, -v(:, 3) * turn, f_turn, g_turn)
      call add_head_forces(dampers, rest, i * turn, f_spin, g_spin)
      call subtract_plane(dampers, turn, b)
      b(:, 1, 3) = b(:, 1, 3) - real(f_spin)
      b(:, 2, 3) = b(:, 2, 3) - aimag(f_spin)
      b(:, 3, 3) = b(:, 3, 3) - cross(turn, g_spin)
    end if
    r(:, 1) = r(:, 1) - real(f)
    r(:, 2) = r(:, 2) - aimag(f)
    r(:, 3) = r(:, 3) - cross(turn, g)
    c(:, 1, 3) = c(:, 1, 3) - real(f_turn)
    c(:, 2, 3) = c(:, 2, 3) - aimag(f_turn)
    c(:, 3, 3) = c(:, 3, 3) - cross(turn, g_turn) + real(conjg(turn) * g)      ! the moment arm rotates
  end subroutine add_mounting

  !> Subtracts the force and moment of one support whose axes turn with the frame from the left sides r, and their derivatives
  !> with respect to q' and q from b and c. `add_mounting` calls it for each of these supports.
  pure subroutine add_in_frame(support, q, v, turn, r, b, c)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: q(:, :), v(:, :)
    complex(dp), intent(in) :: turn(:)
    real(dp), intent(inout) :: r(:, :), b(:, :, :), c(:, :, :)
    complex(dp), parameter :: along(2) = [(1.0_dp, 0.0_dp), i]
    type(pair_type) :: spring, damper
    complex(dp), dimension(size(q, 1)) :: e, e_dot, w, f, moved, by_position, by_speed
    complex(dp) :: static
    integer :: k

    spring = pair_of(support%stiffness, support%axes)
    damper = pair_of(support%damping, support%axes)
    static = complex_of(support%static)
    call elongate(support, q, v, e, e_dot)
    w = e - complex_of(support%position)
    f = spring%times(e) + damper%times(e_dot)
    r(:, 1) = r(:, 1) + real(turn * f + less_one(turn) * static)
    r(:, 2) = r(:, 2) + aimag(turn * f + less_one(turn) * static)
    r(:, 3) = r(:, 3) - cross(w, f) - cross(e, static)
    f = f + static
    do k = 1, 2
      moved = conjg(turn) * along(k)                                           ! dw
      by_position = spring%times(moved) - damper%times(i * v(:, 3) * moved)       ! df/du
      by_speed = damper%times(moved)                                           ! df/du'
      c(:, 1, k) = c(:, 1, k) + real(turn * by_position)
      c(:, 2, k) = c(:, 2, k) + aimag(turn * by_position)
      c(:, 3, k) = c(:, 3, k) - cross(w, by_position) - cross(moved, f)
      b(:, 1, k) = b(:, 1, k) + real(turn * by_speed)
      b(:, 2, k) = b(:, 2, k) + aimag(turn * by_speed)
      b(:, 3, k) = b(:, 3, k) - cross(w, by_speed)
    end do
    by_position = -spring%times(i * w) - damper%times(i * e_dot)                  ! df/dpsi
    by_speed = -damper%times(i * w)                                            ! df/dpsi'
    c(:, 1, 3) = c(:, 1, 3) + real(turn * (by_position + i * f))
    c(:, 2, 3) = c(:, 2, 3) + aimag(turn * (by_position + i * f))
    c(:, 3, 3) = c(:, 3, 3) - cross(w, by_position) + cross(i * w, f)
    b(:, 1, 3) = b(:, 1, 3) + real(turn * by_speed)
    b(:, 2, 3) = b(:, 2, 3) + aimag(turn * by_speed)
    b(:, 3, 3) = b(:, 3, 3) - cross(w, by_speed)
  end subroutine add_in_frame

  pure subroutine add_pair(sums, pair, p)
    type(sums_type), intent(inout) :: sums
    type(pair_type), intent(in) :: pair
    complex(dp), intent(in) :: p

    sums%act = sums%act .or. abs(pair%mean) > 0 .or. abs(pair%difference) > 0
    sums%mean = sums%mean + pair%mean
    sums%difference = sums%difference + pair%difference
    sums%mean_p = sums%mean_p + pair%mean * p
    sums%difference_p = sums%difference_p + pair%difference * conjg(p)
    sums%mean_pp = sums%mean_pp + pair%mean * real(conjg(p) * p)
    sums%difference_pp = sums%difference_pp + pair%difference * conjg(p)**2
  end subroutine add_pair

  !> Adds the sum of the supports' forces F_j to f and the sum of conj(p_j) F_j to g. The upper ends, at the positions p_j on the
  !> frame, move by u + w p_j.
  pure subroutine add_head_forces(sums, u, w, f, g)
    type(sums_type), intent(in) :: sums
    complex(dp), intent(in) :: u(:), w(:)
    complex(dp), intent(inout) :: f(:), g(:)

    f = f - (sums%mean * u + sums%difference * conjg(u) + sums%mean_p * w + sums%difference_p * conjg(w))
    g = g - (conjg(sums%mean_p) * u + sums%difference_p * conjg(u) + sums%mean_pp * w + sums%difference_pp * conjg(w))
  end subroutine add_head_forces

  !> Forces of the supports on the ground along the fixed axes xi and eta (N), and their moment about the rest position of the
  !> frame's centre of mass F (N m), shape (points, 3). Static forces are excluded. The force of a support acts at its displaced
  !> upper end, or at the rest position of this end if the axes turn with the frame.
  pure function ground_load(supports, q, v) result(load)
    type(support_type), intent(in) :: supports(:)
    real(dp), intent(in) :: q(:, :), v(:, :)
    real(dp) :: load(size(q, 1), 3)
    complex(dp), dimension(size(q, 1)) :: d, d_dot, force, arm
    type(pair_type) :: spring, damper
    integer :: j

    load = 0
    do j = 1, size(supports)
      call elongate(supports(j), q, v, d, d_dot)
      spring = pair_of(supports(j)%stiffness, supports(j)%axes)
      damper = pair_of(supports(j)%damping, supports(j)%axes)
      force = spring%times(d) + damper%times(d_dot)
      arm = complex_of(supports(j)%position)
      if (supports(j)%turning) then
        force = exp(i * q(:, 3)) * force + less_one(exp(i * q(:, 3))) * complex_of(supports(j)%static)
      else
        arm = arm + d
      end if
      load(:, 1) = load(:, 1) + real(force)
      load(:, 2) = load(:, 2) + aimag(force)
      load(:, 3) = load(:, 3) + cross(arm, force)
    end do
  end function ground_load

  !> Potential energy (J), shape (points), of two contributions: the supports' springs, and the static forces of the supports whose
  !> axes turn with the frame.
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
      spring = pair_of(supports(j)%stiffness, supports(j)%axes)
      energy = energy + real(conjg(d) * spring%times(d)) / 2
      if (.not. supports(j)%turning) cycle
      static = complex_of(supports(j)%static)
      energy = energy + real(conjg(static) * (d - cmplx(q(:, 1), q(:, 2), dp))) &
        & - cross(complex_of(supports(j)%position), static) * q(:, 3)
    end do
  end function mounting_energy

  !> Computes displacement `d` and velocity `d_dot` of the upper end of a support along the fixed axes xi and eta. If the support's
  !> axes turn with the frame, both are computed along the frame's axes instead.
  pure subroutine elongate(support, q, v, d, d_dot)
    type(support_type), intent(in) :: support
    real(dp), intent(in) :: q(:, :), v(:, :)
    complex(dp), intent(out) :: d(:), d_dot(:)

    associate (turn => exp(i * q(:, 3)), p => complex_of(support%position))
      d = cmplx(q(:, 1), q(:, 2), dp) + less_one(turn) * p
      d_dot = cmplx(v(:, 1), v(:, 2), dp) + i * v(:, 3) * turn * p
      if (.not. support%turning) return
      d = conjg(turn) * d
      d_dot = conjg(turn) * d_dot - i * v(:, 3) * d
    end associate
  end subroutine elongate

  pure complex(dp) function complex_of(a)
    real(dp), intent(in) :: a(3)

    complex_of = cmplx(a(1), a(2), dp)
  end function complex_of

  !> Adds to the matrices k the derivatives of -force and -moment with respect to the frame's displacements xi and eta. A unit of
  !> xi moves all upper ends by 1, a unit of eta by i. If `sums` are those of the dampers, the derivatives are with respect to xi'
  !> and eta'.
  pure subroutine subtract_plane(sums, turn, k)
    type(sums_type), intent(in) :: sums
    complex(dp), intent(in) :: turn(:)
    real(dp), intent(inout) :: k(:, :, :)
    complex(dp), parameter :: along(2) = [(1.0_dp, 0.0_dp), i], none(1) = 0
    complex(dp) :: f(1), g(1)
    integer :: j

    do j = 1, 2
      f = 0
      g = 0
      call add_head_forces(sums, along(j:j), none, f, g)
      k(:, 1, j) = k(:, 1, j) - real(f(1))
      k(:, 2, j) = k(:, 2, j) - aimag(f(1))
      k(:, 3, j) = k(:, 3, j) - cross(turn, g(1))
    end do
  end subroutine subtract_plane

  pure type(pair_type) function pair_of(k, axes)
    real(dp), intent(in) :: k(3), axes(3, 3)

    pair_of%mean = sum(k(:2)) / 2
    pair_of%difference = (k(1) - k(2)) / 2 * cmplx(axes(1, 1), axes(2, 1), dp)**2
  end function pair_of

  !> Product K d.
  elemental complex(dp) function times(self, d)
    class(pair_type), intent(in) :: self
    complex(dp), intent(in) :: d

    times = self%mean * d + self%difference * conjg(d)
  end function times

  !> Cross product a x b of two vectors of the plane.
  elemental real(dp) function cross(a, b)
    complex(dp), intent(in) :: a, b

    cross = aimag(conjg(a) * b)
  end function cross

end module gestell_model_exact_moved_mounting
