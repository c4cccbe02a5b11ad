!> Converts damping ratios, as textbooks and data sheets state them, to dampers (doc/theory.md, Mounting).
module gestell_model_frame_damping
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_math_lapack, only: symmetric_pencil
  use gestell_model_frame, only: frame_type
  use gestell_model_mounting, only: in_frame, matrix_rounding, support_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: add_damping_ratios

contains

  !> Adds dampers with the given damping ratios to the mounting of a frame. Must be called before the frame gets its weight. Fails
  !> if the modes of the mounting cannot be computed, or if the damping overflows double precision.
  subroutine add_damping_ratios(frame, whole, single, error)
    type(frame_type), intent(inout) :: frame
    !> `whole`: damping ratio of each mode of the mounting. `single`: damping ratio of each support
    real(dp), intent(in) :: whole, single(:)
    type(error_type), allocatable, intent(out) :: error
    type(support_type) :: supports(size(single))
    real(dp), allocatable, dimension(:, :) :: m, g, c, b
    integer :: i

    frame%has_damping_ratios = whole > 0 .or. any(single > 0)
    if (.not. frame%has_damping_ratios) return
    call frame%mean_matrices([(i, i = 1, frame%dofs())], m, g, c)
    supports = frame%supports
    do i = 1, size(single)
      call add_dampers(single(i), m(1, 1), frame%stiffness, supports(i))
    end do
    b = frame%foundation_damping
    if (whole > 0) call add_modal_damping(whole, frame%free, m, frame%stiffness, b, error)
    if (allocated(error)) return
    call frame%put_on(supports, (frame%foundation_stiffness), b)
    if (.not. all(ieee_is_finite(frame%damping))) call fatal_error(error, "the damping that damping_ratio requires overflows " &
      & // "double precision", invalid_input)
  end subroutine add_damping_ratios

  !> Adds dampers to a support. If the machine moves along an axis n without rotating, its natural frequency is w = sqrt(n^T C n /
  !> m). The damper along n is b = 2 D k / w with the damping ratio D, which is that of the machine if all supports have it.
  pure subroutine add_dampers(ratio, mass, stiffness, support)
    !> `mass`: mass m of the machine (kg). `stiffness`: matrix C of the whole mounting, shape (dofs, dofs)
    real(dp), intent(in) :: ratio, mass, stiffness(:, :)
    type(support_type), intent(inout) :: support
    integer :: i, n

    ! xi, eta and, in space, zeta
    n = merge(3, 2, size(stiffness, 1) > 3)
    do i = 1, n
      associate (k => support%stiffness(i), along => support%axes(:n, i), at => in_frame(:n))
        if (k > 0) support%damping(i) = support%damping(i) &
          & + 2 * ratio * k * sqrt(mass / dot_product(along, matmul(stiffness(at, at), along)))
      end associate
    end do
  end subroutine add_dampers

  !> Adds the damping matrix with which each mode of the mounting has the same `ratio` D. With M Phi diag(w)^2 = C Phi and
  !> Phi^T M Phi = 1 this matrix is M Phi diag(2 D w) Phi^T M.
  subroutine add_modal_damping(ratio, free, mass, stiffness, damping, error)
    real(dp), intent(in) :: ratio
    !> Indices of the free degrees of freedom
    integer, intent(in) :: free(:)
    !> `mass`: matrix M, averaged over the turn. `stiffness`: matrix C of the mounting. Both of shape (dofs, dofs)
    real(dp), intent(in) :: mass(:, :), stiffness(:, :)
    real(dp), intent(inout) :: damping(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: squares(:), modes(:, :)
    real(dp) :: b(size(free), size(free))

    call symmetric_pencil(stiffness(free, free), mass(free, free), squares, error, modes)
    if (allocated(error)) return
    modes = matmul(mass(free, free), modes) * spread(sqrt(2 * ratio * sqrt(max(squares, 0.0_dp))), 1, size(free))
    b = matmul(modes, transpose(modes))
    ! Rounding must not couple degrees of freedom that are independent: independent parts are solved separately.
    where (abs(b) <= 4 * matrix_rounding(b)) b = 0
    damping(free, free) = damping(free, free) + b
  end subroutine add_modal_damping

end module gestell_model_frame_damping
