!> The motion of a frame as rows of numbers, and quantities as weights of these.
!>
!> The motion of the frame is one column of numbers, for each of its n degrees of freedom q, q', q'', and the forces of the guides
!> on the ground, which hold the degrees of freedom that are not free. Of the exact frame more follow:
!>
!> - what its rotation has beyond its linear terms, and the first and second derivatives of that: in the plane s = sin psi - psi and
!>   c = cos psi - 1, in space the nine numbers of R - 1 - [theta], column by column. With these the motion of all points is linear
!>   again, x = xi - Y (psi + s) + X c, y = eta + X (psi + s) + Y c, in space u + theta x p + (R - 1 - [theta]) p;
!> - what the moments of the supports on the ground have beyond their linear terms: one in the plane, three in space;
!> - what the force of each support whose axes turn with the frame has beyond its linear terms, two components or three.
module gestell_model_quantity_rows
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  use gestell_model_frame, only: frame_type
  use gestell_model_mounting, only: in_frame, is_rotation
  implicit none (type, external)
  private

  public :: exact_rows, excess_of_point, excess_row, is_of_probe, moment_rows, new_ground_forces, rotations_of, rows_of, &
    & shifts_of, support_rows

  !> Names of the forces on the ground along the degrees of freedom of the frame, in their order: in the plane the first three.
  character(len=2), parameter, public :: force_names(6) = [character(len=2) :: "fx", "fy", "m", "fz", "mx", "my"]

  !> Rows of the motion in the plane: the last of q, q', q'' and the guides' forces.
  integer, parameter, public :: displacements = 3, velocities = 6, accelerations = 9, guide_forces = 12

  !> A measuring point on the frame, in its system (m); the greatest vibration velocity (m/s, rms in the band of frequencies, Hz,
  !> in any direction) that is allowed, 0: no limit.
  type, public :: probe_type
    character(len=word_length) :: name = ""
    real(dp) :: position(2) = 0, z = 0, limit = 0, band(2) = [10.0_dp, 1000.0_dp]
  end type probe_type

  type, public :: quantity_type
    !> Of the frame whose motion it is of.
    integer :: dofs = 3
    !> As the user names it, and its unit.
    character(len=word_length) :: name = ""
    character(len=8) :: unit = ""
    !> Shape (rows, 1), or (rows, 2) of a magnitude, in space (rows, 3), whose components along x, y and z the columns give; rows:
    !> those of the exact frame's motion.
    real(dp), allocatable :: weights(:, :)
    !> Bounds on the weights' roundings, shape as theirs: forces that cancel in the weights do not in these.
    real(dp), allocatable :: rounding(:, :)
  contains
    procedure :: rows
  end type quantity_type

  !> Forces on the ground and their moments about F at rest, in the frame's order of degrees of freedom: weights of the motion's
  !> rows, and bounds on the weights' roundings; shapes (rows, dofs).
  type, public :: ground_forces_type
    real(dp), allocatable :: weights(:, :), rounding(:, :)
  end type ground_forces_type

contains

  !> Whether a part of the machine, as the user names it, is this probe: probe(NAME).
  pure logical function is_of_probe(part, probe)
    character(len=*), intent(in) :: part
    type(probe_type), intent(in) :: probe
    integer :: n

    n = len(part)
    is_of_probe = n > len("probe()")
    if (is_of_probe) is_of_probe = part(:6) == "probe(" .and. part(n:n) == ")" .and. part(7:n - 1) == probe%name
  end function is_of_probe

  !> No forces on the ground yet.
  pure type(ground_forces_type) function new_ground_forces(frame) result(forces)
    class(frame_type), intent(in) :: frame

    allocate(forces%weights(exact_rows(frame), frame%dofs()), forces%rounding(exact_rows(frame), frame%dofs()), source=0.0_dp)
  end function new_ground_forces

  !> The displacements among a frame's degrees of freedom, along the axes in their order.
  pure function shifts_of(frame) result(shifts)
    class(frame_type), intent(in) :: frame
    integer, allocatable :: shifts(:)
    integer :: k

    shifts = pack([(k, k = 1, frame%dofs())], .not. is_rotation([(k, k = 1, frame%dofs())]))
  end function shifts_of

  !> The rotations among them, about the axes in their order.
  pure function rotations_of(frame) result(rotations)
    class(frame_type), intent(in) :: frame
    integer, allocatable :: rotations(:)

    rotations = [3]
    if (frame%dofs() == 6) rotations = in_frame(4:)
  end function rotations_of

  !> The row before the excess of the rotation (`level` 0), of its first (1) or second derivative (2).
  pure integer function excess_row(frame, level)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: level

    excess_row = rows_of(frame%dofs(), guide_forces) + level * merge(9, 2, allocated(frame%space))
  end function excess_row

  !> The displacement of the point p by the rows of that excess, shape (rows, axes): s k x p + c p, in space (R - 1 - [theta]) p.
  pure function excess_of_point(frame, p) result(weights)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: p(3)
    real(dp), allocatable :: weights(:, :)
    integer :: i

    if (.not. allocated(frame%space)) then
      weights = reshape([-p(2), p(1), p(1), p(2)], [2, 2])
      return
    end if
    allocate(weights(9, 3), source=0.0_dp)
    do i = 1, 3
      weights(i::3, i) = p
    end do
  end function excess_of_point

  !> The rows of the moments' excess.
  pure function moment_rows(frame) result(rows)
    class(frame_type), intent(in) :: frame
    integer, allocatable :: rows(:)
    integer :: k

    rows = [(excess_row(frame, 3) + k, k = 1, size(rotations_of(frame)))]
  end function moment_rows

  !> The rows of the excess of the force of a support, of that number, whose axes turn.
  pure function support_rows(frame, number) result(rows)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: number
    integer, allocatable :: rows(:)
    integer :: axes, k

    axes = merge(3, 2, allocated(frame%space))
    rows = excess_row(frame, 3) + size(rotations_of(frame)) + axes * count(frame%supports(:number - 1)%turning) &
      & + [(k, k = 1, axes)]
  end function support_rows

  !> How many rows the exact frame's motion has.
  pure integer function exact_rows(frame)
    class(frame_type), intent(in) :: frame

    exact_rows = excess_row(frame, 3) + merge(3, 1, allocated(frame%space)) &
      & + merge(3, 2, allocated(frame%space)) * count(frame%supports%turning)
  end function exact_rows

  !> Rows of the motion of a frame that has so many degrees of freedom, down to one of those above.
  pure integer function rows_of(dofs, last)
    integer, intent(in) :: dofs, last

    rows_of = last / 3 * dofs
  end function rows_of

  !> Down to which rows of the motion, of those above, the quantity needs it; the exact frame has all.
  pure integer function rows(self)
    class(quantity_type), intent(in) :: self
    integer :: k

    rows = velocities
    do k = rows_of(self%dofs, velocities) + 1, rows_of(self%dofs, guide_forces)
      if (any(abs(self%weights(k, :)) > 0)) rows = merge(accelerations, guide_forces, k <= rows_of(self%dofs, accelerations))
    end do
  end function rows

end module gestell_model_quantity_rows
