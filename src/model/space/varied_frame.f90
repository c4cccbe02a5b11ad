!> The frame in space varied about a motion that it makes: the exact equations of gestell_model_space_frame and their derivatives.
!>
!> Changes of R are R [dalpha]; then dw = dalpha' + w x dalpha, dw' = dalpha'' + w' x dalpha + w x dalpha', and
!>
!>     d(R g)      = R (dalpha x g + dg),   dg = 2 dw x S' + dw' x S + dw x (w x S) + w x (dw x S),
!>     d(R^T u'')  = R^T du'' - dalpha x (R^T u'').
!>
!> Of the rotation vector dalpha = T dtheta, dalpha' = T dtheta' + T' dtheta, dalpha'' = T dtheta'' + 2 T' dtheta' + T'' dtheta.
module gestell_model_space_varied_frame
  use gestell_base_kinds, only: dp, pi
  use gestell_math_trigonometric, only: series_type
  use gestell_model_space_frame, only: space_frame_type
  use gestell_model_space_masses, only: masses_type
  use gestell_model_space_mounting, only: add_supports
  use gestell_model_space_rotation, only: cross, cross_matrix, rotation_matrix, turning_matrices
  implicit none (type, external)
  private

  public :: vary, varied_space_frame

  !> The linear system whose M, B, C are the exact equations' derivatives along `motion`; its periodic motion is the next iterate of
  !> Newton's method.
  type, extends(space_frame_type), public :: varied_space_frame_type
    !> xi to psi over theta = 2 pi t/T, all six.
    type(series_type) :: motion
  contains
    procedure :: matrices
    procedure :: load
  end type varied_space_frame_type

contains

  function varied_space_frame(frame, motion) result(varied)
    class(space_frame_type), intent(in) :: frame
    type(series_type), intent(in) :: motion
    type(varied_space_frame_type) :: varied

    varied%space_frame_type = frame
    varied%motion = motion
  end function varied_space_frame

  !> The left sides of the equations at q, q', q'', shape (6, 0:2), at a time (s), shape (6), and their derivatives with respect to
  !> q'', q' and q, shape (6, 6).
  subroutine vary(frame, t, q, r, m, b, c)
    class(space_frame_type), intent(in) :: frame
    real(dp), intent(in) :: t, q(6, 0:2)
    real(dp), intent(out) :: r(6), m(6, 6), b(6, 6), c(6, 6)
    type(masses_type) :: at
    real(dp), dimension(3, 3) :: rotation, back, s, spin, wheel, change
    real(dp), dimension(3, 3, 0:2) :: turning, varied
    real(dp) :: theta(3, 0:2), w(3), w_d(3), g(3), a(3), momentum(3), mass
    integer :: i

    call frame%masses_at(t, at)
    mass = at%mass
    theta = q(4:, :)
    rotation = rotation_matrix(theta(:, 0))
    back = transpose(rotation)
    turning = turning_matrices(theta)
    w = matmul(turning(:, :, 0), theta(:, 1))
    w_d = matmul(turning(:, :, 0), theta(:, 2)) + matmul(turning(:, :, 1), theta(:, 1))
    g = at%s(:, 2) + 2 * cross(w, at%s(:, 1)) + cross(w_d, at%s(:, 0)) + cross(w, cross(w, at%s(:, 0)))
    a = matmul(back, q(:3, 2))
    momentum = matmul(at%j(:, :, 0), w) + at%h(:, 0)
    r(:3) = mass * q(:3, 2) + matmul(rotation, g)
    r(4:) = matmul(at%j(:, :, 0), w_d) + matmul(at%j(:, :, 1), w) + cross(w, momentum) + at%h(:, 1) + cross(at%s(:, 0), a)
    s = cross_matrix(at%s(:, 0))
    spin = cross_matrix(w)
    m = 0
    b = 0
    c = 0
    do i = 1, 3
      m(i, i) = mass
    end do
    ! with respect to dalpha'', dalpha', dalpha
    m(:3, 4:) = -matmul(rotation, s)
    m(4:, :3) = matmul(s, back)
    m(4:, 4:) = at%j(:, :, 0)
    ! dg/dw; and of the moment, J' dw + dw x (J w + H) + w x (J dw)
    change = -2 * cross_matrix(at%s(:, 1)) - cross_matrix(cross(w, at%s(:, 0))) - matmul(spin, s)
    wheel = at%j(:, :, 1) - cross_matrix(momentum) + matmul(spin, at%j(:, :, 0))
    b(:3, 4:) = matmul(rotation, change - matmul(s, spin))
    b(4:, 4:) = wheel + matmul(at%j(:, :, 0), spin)
    c(:3, 4:) = matmul(rotation, matmul(change, spin) - matmul(s, cross_matrix(w_d)) - cross_matrix(g))
    c(4:, 4:) = matmul(wheel, spin) + matmul(at%j(:, :, 0), cross_matrix(w_d)) + matmul(s, cross_matrix(a))
    call add_supports(frame%supports, q(:3, 0), q(:3, 1), rotation, w, r, b, c)
    ! with respect to dtheta'', dtheta', dtheta
    c(:, 4:) = matmul(m(:, 4:), turning(:, :, 2)) + matmul(b(:, 4:), turning(:, :, 1)) + matmul(c(:, 4:), turning(:, :, 0))
    b(:, 4:) = 2 * matmul(m(:, 4:), turning(:, :, 1)) + matmul(b(:, 4:), turning(:, :, 0))
    m(:, 4:) = matmul(m(:, 4:), turning(:, :, 0))
    ! the moments T^T r along theta's own directions, of which those held may be at work
    m(4:, :) = matmul(transpose(turning(:, :, 0)), m(4:, :))
    b(4:, :) = matmul(transpose(turning(:, :, 0)), b(4:, :))
    c(4:, :) = matmul(transpose(turning(:, :, 0)), c(4:, :))
    do i = 1, 3
      varied = turning_matrices(reshape([theta(:, 0), merge(1.0_dp, 0.0_dp, [1, 2, 3] == i), 0.0_dp, 0.0_dp, 0.0_dp], [3, 3]))
      c(4:, 3 + i) = c(4:, 3 + i) + matmul(transpose(varied(:, :, 1)), r(4:))
    end do
    r(4:) = matmul(transpose(turning(:, :, 0)), r(4:))
  end subroutine vary

  subroutine matrices(self, t, m, b, c)
    class(varied_space_frame_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    real(dp) :: r(6), q(6, 0:2), all_m(6, 6), all_b(6, 6), all_c(6, 6)

    call take_motion(self, t, q)
    call vary(self, t, q, r, all_m, all_b, all_c)
    m = all_m(self%free, self%free)
    b = all_b(self%free, self%free)
    c = all_c(self%free, self%free)
  end subroutine matrices

  !> h = M q'' + B q' + C q - r.
  subroutine load(self, t, h)
    class(varied_space_frame_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)
    real(dp) :: r(6), q(6, 0:2), m(6, 6), b(6, 6), c(6, 6)

    call take_motion(self, t, q)
    call vary(self, t, q, r, m, b, c)
    r = matmul(m, q(:, 2)) + matmul(b, q(:, 1)) + matmul(c, q(:, 0)) - r
    h = r(self%free)
  end subroutine load

  subroutine take_motion(self, t, q)
    type(varied_space_frame_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: q(6, 0:2)
    real(dp), dimension(1, 6) :: f, f_d, f_dd
    real(dp) :: rate

    rate = 2 * pi / self%period
    call self%motion%values([t / self%period], f, f_d, f_dd)
    q(:, 0) = f(1, :)
    q(:, 1) = rate * f_d(1, :)
    q(:, 2) = rate**2 * f_dd(1, :)
  end subroutine take_motion

end module gestell_model_space_varied_frame
